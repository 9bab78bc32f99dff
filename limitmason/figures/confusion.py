"""Figures of what a design can tell: distances between causes, and the confusion matrix of blind trials."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from limitmason.figures import style

CLASSES = (
    (1.0, "#D55E00", "below 1: not told apart"),
    (9.0, "#F3B98A", "1 to 9: hardly told apart"),
    (25.0, "#CBE3F2", "9 to 25: mostly"),
    (np.inf, "#F7F7F7", "25 and more: clearly"),
)
"""Upper end of d2, colour and meaning; the first and the last are the limits at which the rule was tried blindly."""

_SAME = "#b5b5b5"
_CHARACTER = 0.06  # mean width at the small size [in]


def _label_width(names: Collection[str]) -> float:
    return 0.3 + _CHARACTER * max(len(n) for n in names)


def draw_distances(ax: Axes, result: Any, cell: float, *, kept: Collection[str] = (), named: bool = True) -> None:
    """The map of d2 on given axes: rows true causes, columns rivals by number.

    Parameters
    ----------
    ax : axes
    result : from ``Study.confusable``
    cell : side of a cell [in]; numbers are written where they fit
    kept : names to be set in bold
    named : name the rows, not only number them
    """
    names, d2 = result.names, result.d2
    count = len(names)
    twins = {frozenset(pair) for pair in result.twins}
    for i in range(count):
        for j in range(count):
            colour = _SAME if i == j else next(c for top, c, _ in CLASSES if d2[i, j] < top or top == np.inf)
            ax.add_patch(Rectangle((j, i), 1, 1, facecolor=colour, edgecolor="white", linewidth=0.8, gid="cell"))
            if i != j and cell >= 0.24:
                value = d2[i, j]
                text = f"{value:.1f}" if value < 9.95 else f"{value:.0f}" if value < 99.5 else ">99"
                ax.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=min(6.5, 23 * cell), zorder=3,
                        color="white" if value < 1 else style.BLACK, gid="d2")  # fmt: skip
    for i in range(count):
        for j in range(count):
            if i != j and frozenset((names[i], names[j])) in twins:
                ax.add_patch(Rectangle((j + 0.03, i + 0.03), 0.94, 0.94, fill=False, edgecolor=style.BLACK,
                                       linewidth=1.1, zorder=4, gid="twin"))  # fmt: skip
    invisible = set(result.invisible)
    ax.set_xlim(0, count)
    ax.set_ylim(count, 0)
    size = min(style._SMALL, max(5.0, 62 * cell))
    ax.set_xticks(np.arange(count) + 0.5, [str(k + 1) for k in range(count)], fontsize=size)
    rows = [f"{name}  {k}" if named else str(k) for k, name in enumerate(names, 1)]
    ax.set_yticks(np.arange(count) + 0.5, rows, fontsize=min(size, 7))
    ax.xaxis.tick_top()
    ax.tick_params(length=0, pad=2, colors=style.BLACK)
    for name, label in zip(names, ax.get_yticklabels(), strict=True):
        label.set_color(style.GHOST if name in invisible else style.BLACK)
        label.set_fontweight("bold" if name in kept else "normal")
    ax.spines[:].set_visible(False)


def distance_legend() -> list[Patch]:
    """Legend of the map."""
    out = [Patch(facecolor=c, edgecolor=style.GHOST, linewidth=0.4, label=text) for _, c, text in CLASSES]
    return [
        *out,
        Patch(facecolor="white", edgecolor=style.BLACK, linewidth=1.1, label="twins: visible, not told apart"),
    ]


@style.in_print_style
def confusable(result: Any, *, title: str | None = None) -> Figure:
    """Which causes a design tells apart.

    It shows the squared distance d2 of each true cause to each refitted rival.

    Parameters
    ----------
    result : from ``Study.confusable(causes)`` [noise units]
    title : heading

    Returns
    -------
    Figure
        One row per true cause, one column per rival; twins framed; causes that this design does not see within their
        bounds are grey.
    """
    names = result.names
    count = len(names)
    left = _label_width(names)
    cell = min(0.36, (style.page_width() - left - 0.15) / count)
    side, legend, page = cell * count, 1.75, style.page_width()
    beside = left + side + 0.15 + legend <= page
    head, foot = 0.92 + (0.22 if title else 0.0), 0.3 if beside else 0.72
    height = head + max(side, 1.25 if beside else 0.0) + foot
    figure = style.blank(page, height)
    low = 1.0 - (head + side) / height
    ax = figure.add_axes((left / page, low, side / page, side / height))
    draw_distances(ax, result, cell)
    twins = "; ".join(f"{a} and {b}" for a, b in result.twins) or "none"
    hidden = ", ".join(result.invisible) or "none"
    lines = [
        "Squared distance d2 in noise units: row true cause, column rival by number, refitted with the inputs.",
        *style.lines_of(f"Twins: {twins}.", page, 2),
        *style.lines_of(f"Not seen within their bounds (grey): {hidden}.", page, 1),
    ]
    style.Heading(title, lines, page).put(figure)
    place = {"loc": "upper left", "bbox_to_anchor": ((left + side + 0.15) / page, low + side / height)} if beside else {
        "loc": "lower center", "bbox_to_anchor": (0.5, 0.0), "ncols": 3}  # fmt: skip
    figure.legend(handles=distance_legend(), fontsize=style._SMALL, frameon=False, **place)
    return figure


@style.in_print_style
def rehearsal(result: Any, *, title: str | None = None) -> Figure:
    """Confusion matrix of blind trials, and how often hidden causes were named.

    Parameters
    ----------
    result : from ``Study.rehearse(causes, n)``
    title : heading

    Returns
    -------
    Figure
        Left: hidden cause (row) against answer (column): counts, shaded by their share of the row; right names are
        framed. Right: share of right answers with its 95 % binomial interval; for "(none)" that is "none", for a cause
        its name (filled) and its name, "behaves like" it or a set that holds it (open). Where each hidden cause is
        missing from the list: share of names given (filled), of these and of "behaves like" (open).
    """
    hidden = list(result.counts)
    causes = hidden if result.missing else hidden[1:]
    others = ["behaves like it", "behaves like another", "set with it", "set without it", "two", "unexplained",
              "scatter", "none"]  # fmt: skip
    columns = [*causes, *others]
    left, right = _label_width(hidden), 1.25
    page = style.page_width()
    cell = min(0.36, (page - left - right - 0.3) / len(columns))
    row = max(cell, 0.17)
    wide, high = cell * len(columns), row * len(hidden)
    head, foot = 1.3 + (0.22 if title else 0.0), 0.72
    height = head + high + foot
    figure = style.blank(page, height)
    base = foot / height
    ax = figure.add_axes((left / page, base, wide / page, high / height))
    size = min(6.5, max(4.5, 24 * cell))
    for i, name in enumerate(hidden):
        counts = {c: result.answers.get(name, {}).get(c, 0) for c in causes}
        counts.update({o: result.counts[name].get(o, 0) for o in others})
        total = max(sum(counts.values()), 1)
        null = i == 0 and not result.missing
        for j, column in enumerate(columns):
            share = counts[column] / total
            good = column == name or (column == "none" and null) or column in ("set with it", "behaves like it")
            good |= result.missing and column in ("behaves like another", "unexplained")
            face = style.pale(style.BLUE if good else style.VERMILION, 0.75 * share) if counts[column] else "#f7f7f7"
            ax.add_patch(Rectangle((j, i), 1, 1, facecolor=face, edgecolor="white", linewidth=0.8, gid="cell"))
            if column == name or (column == "none" and null):
                ax.add_patch(Rectangle((j + 0.03, i + 0.03), 0.94, 0.94, fill=False, edgecolor=style.BLACK,
                                       linewidth=0.9, zorder=4, gid="right"))  # fmt: skip
            if counts[column]:
                ax.text(j + 0.5, i + 0.5, str(counts[column]), ha="center", va="center", fontsize=size, gid="count")
    ax.axvline(len(causes), color=style.FAINT, linewidth=0.8)
    ax.set_xlim(0, len(columns))
    ax.set_ylim(len(hidden), 0)
    small = min(style._SMALL, max(4.8, 40 * cell))
    ax.xaxis.tick_top()
    ax.set_xticks(np.arange(len(columns)) + 0.5, [str(k + 1) for k in range(len(causes))] + others, fontsize=small)
    for label in ax.get_xticklabels()[len(causes) :]:
        label.set(rotation=60, ha="left", rotation_mode="anchor", fontsize=7)
    labels = hidden[: len(hidden) - len(causes)] + [f"{name}  {k + 1}" for k, name in enumerate(causes)]
    ax.set_yticks(np.arange(len(hidden)) + 0.5, labels, fontsize=min(style._SMALL, 62 * row))
    ax.tick_params(length=0, pad=2)
    ax.spines[:].set_visible(False)
    _draw_rates(
        figure.add_axes(((left + wide + 0.22) / page, base, right / page - 0.1 / page, high / height)), result
    )
    lines = [
        f"{result.n} blind trials on this design: hidden cause (row) against answer (column; numbers are names).",
        "Bars: 95 % binomial intervals. Hidden and listed causes share their tables: this tries the statistics.",
    ]
    style.Heading(title, lines, page).put(figure)
    return figure


def _draw_rates(rates: Axes, result: Any) -> None:
    """Shares of right answers with their intervals, a row for each hidden cause."""
    from limitmason.diagnosis import binomial_interval

    for i, name in enumerate(result.counts):
        n = sum(result.counts[name].values())
        null = i == 0 and not result.missing
        counted = result.counts[name]
        named = counted.get("none" if null else "wrong name" if result.missing else "named", 0)
        like = "behaves like another" if result.missing else "behaves like it"
        found = named + (0 if null else counted.get(like, 0) + counted.get("set with it", 0))
        for k, offset, face in ((found, 0.18, "white"), (named, -0.18, style.BLUE)):
            if null and face == "white":
                continue
            if n == 0:
                continue
            low, high_ = binomial_interval(k, n)
            y = i + 0.5 + (0.0 if null else offset)
            rates.hlines([y], 100 * low, 100 * high_, color=style.BLUE, linewidth=0.9, gid="interval")
            rates.plot([100 * k / n], [y], "o", color=style.BLUE, markerfacecolor=face, markersize=3.2, gid="share")
    rates.set_xlim(-3, 103)
    rates.set_ylim(len(result.counts), 0)
    rates.set_yticks([])
    rates.set_xticks([0, 50, 100])
    rates.tick_params(labelsize=6.5, length=2.5, width=0.5, colors=style.FAINT)
    rates.grid(axis="x", linewidth=0.3, color="#dddddd")
    told = "filled: a name given\nopen: or behaves like one" if result.missing else (
        "filled: named (or none)\nopen: or behaves so, in the set"
    )  # fmt: skip
    rates.set_xlabel(f"share [%]\n{told}", fontsize=6.5, color=style.FAINT)
