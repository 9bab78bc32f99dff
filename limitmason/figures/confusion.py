"""Distances between causes as a figure on axes ``ax``: what a design can tell."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from limitmason.figures import style
from limitmason.figures.residuals import shortened, written

CLASSES = (
    (1.0, "#D55E00", "below 1: not told apart"),
    (9.0, "#F3B98A", "1 to 9: hardly told apart"),
    (25.0, "#CBE3F2", "9 to 25: mostly"),
    (np.inf, "#F7F7F7", "25 and more: clearly"),
)
"""Upper end of d2, colour and meaning; the first and the last are the limits at which the rule was tried blindly."""

_SAME = "#b5b5b5"  # a cause beside itself
_WRITTEN = 0.24  # least side of a cell in which a number can be read [in]
_CHARACTER = 0.06  # mean width at the small size [in]
_LEAST = 0.06  # side of a cell from which on names are cut to leave it its room [in]; chosen


def draw_distances(ax: Axes, result: Any, cell: float, *, kept: Collection[str] = (), letters: int = 0) -> None:
    """Draw the map of d2 on ``ax``: rows are true causes, columns rivals by number.

    Parameters
    ----------
    result : from ``Study.confusable``: ``names`` of the causes, squared distances ``d2`` [noise units], shape (n, n),
        ``twins``, pairs of names that are not told apart, and ``invisible``, names of causes that are not seen
    cell : side of a cell [in]; numbers are written where they fit
    kept : names to be set in bold
    letters : of the names of the rows at most, of which longer ones are cut; 0 only numbers them
    """
    names, d2 = result.names, result.d2
    count = len(names)
    twins = {frozenset(pair) for pair in result.twins}
    for i in range(count):
        for j in range(count):
            colour = _SAME if i == j else next(c for top, c, _ in CLASSES if d2[i, j] < top or top == np.inf)
            ax.add_patch(Rectangle((j, i), 1, 1, facecolor=colour, edgecolor="white", linewidth=0.8, gid="cell"))
            if i != j and cell >= _WRITTEN:
                value = d2[i, j]
                # up to three characters fit: 9.95 and 99.5 are where rounding would write one more
                text = f"{value:.1f}" if value < 9.95 else f"{value:.0f}" if value < 99.5 else ">99"
                ax.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=min(6.5, 23 * cell), zorder=3,
                        color="white" if value < 1 else style.BLACK, gid="d2")
            if i != j and frozenset((names[i], names[j])) in twins:  # framed inside the cell
                ax.add_patch(Rectangle((j + 0.03, i + 0.03), 0.94, 0.94, fill=False, edgecolor=style.BLACK,
                                       linewidth=1.1, zorder=4, gid="twin"))
    invisible = set(result.invisible)
    ax.set_xlim(0, count)
    ax.set_ylim(count, 0)
    size = min(style._SMALL, max(5.0, 62 * cell))  # letters shrink with the cells [pt]
    ax.set_xticks(np.arange(count) + 0.5, [str(k + 1) for k in range(count)], fontsize=size)
    rows = [f"{written(shortened(n, letters))}  {k}" if letters else str(k) for k, n in enumerate(names, 1)]
    ax.set_yticks(np.arange(count) + 0.5, rows, fontsize=min(size, 7))
    ax.xaxis.tick_top()
    ax.tick_params(length=0, pad=2, colors=style.BLACK)
    for name, label in zip(names, ax.get_yticklabels(), strict=True):
        label.set_color(style.GHOST if name in invisible else style.BLACK)
        label.set_fontweight("bold" if name in kept else "normal")
    ax.spines[:].set_visible(False)


def distance_legend() -> list[Patch]:
    """Entries of the legend of :func:`draw_distances`."""
    out = [Patch(facecolor=c, edgecolor=style.GHOST, linewidth=0.4, label=text) for _, c, text in CLASSES]
    return [
        *out,
        Patch(facecolor="white", edgecolor=style.BLACK, linewidth=1.1, label="twins: visible, not told apart"),
    ]


@style.in_print_style
def confusable(result: Any, *, title: str | None = None) -> Figure:
    """Which causes a design tells apart, as a map of squared distances d2.

    A distance is that of a true cause to a rival that is refitted to the data of the true one.

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
    # lengths in inches: names at the left, the map, and a legend beside it where the page has room, else below;
    # the head holds the caption and the numbers of the rivals
    page, gap, legend = style.page_width(), 0.15, 1.75
    room = int((page - gap - _LEAST * count - 0.3) / _CHARACTER)  # letters beside a map of the smallest cells
    letters = min(max(len(n) for n in names), max(room, 1))
    left = 0.3 + _CHARACTER * letters
    cell = min(0.36, (page - left - gap) / count)
    side = cell * count
    beside = left + side + gap + legend <= page
    head, foot = 0.92 + (0.22 if title else 0.0), 0.3 if beside else 0.72
    height = head + max(side, 1.25 if beside else 0.0) + foot
    figure = style.blank(page, height)
    low = 1.0 - (head + side) / height
    ax = figure.add_axes((left / page, low, side / page, side / height))
    draw_distances(ax, result, cell, letters=letters)
    twins = "; ".join(f"{a} and {b}" for a, b in result.twins) or "none"
    hidden = ", ".join(result.invisible) or "none"
    lines = [
        "Squared distance d2 in noise units: row true cause, column rival by number, refitted with the inputs.",
        *style.lines_of(f"Twins: {written(twins)}.", page, most=2),
        *style.lines_of(f"Not seen within their bounds (grey): {written(hidden)}.", page, most=1),
    ]
    style.Heading(title, lines, page).put(figure)
    place = {"loc": "upper left", "bbox_to_anchor": ((left + side + gap) / page, low + side / height)} if beside else {
        "loc": "lower center", "bbox_to_anchor": (0.5, 0.0), "ncols": 3}
    figure.legend(handles=distance_legend(), fontsize=style._SMALL, frameon=False, **place)
    return figure
