"""Figures of comparisons and studies: theories, lines over parameters, histograms."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from limitmason.answers.method import Look
from limitmason.checks import count, instance, numbers
from limitmason.comparison import SideBySide
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.methods import available_methods, get_method
from limitmason.study.sampling import running
from limitmason.study.table import Table

_LAMBDA = "collapse multiplier λ [-]"

_MONOLITH = Look("in one piece", "BLACK", "s")
"""Of block-size studies: the structure without joints, no method of its own."""


def _look(method: str) -> Look:
    """How a method is drawn, by its name.

    A name that no method has, such as a series of another program, has a plain look.
    """
    if method == "monolith":
        return _MONOLITH
    return get_method(method).look if _known(method) else Look(method)


def _known(method: Any) -> bool:
    """Whether a name is that of a method, or of the structure in one piece."""
    return method == "monolith" or method in available_methods()


def colours_of(methods: Iterable[Any]) -> dict[Any, str]:
    """A colour for each of ``methods``: its own, or the next that is free."""
    out: dict[Any, str] = {}
    # known methods choose first: they keep their colours whatever stands beside them
    for method in sorted(dict.fromkeys(methods), key=lambda m: not _known(m)):
        own = (getattr(style, _look(method).colour),) if _known(method) else ()
        out[method] = next((c for c in (*own, *style.SERIES) if c not in out.values()), style.FAINT)
    return out


@style.in_print_style
def side_by_side(result: Any, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Collapse multipliers of several theories beside the test, each with its range.

    Parameters
    ----------
    result : from ``limitmason.compare``
    title : heading; that of the result where omitted
    ax : axes to draw on; a new figure when not given

    Returns
    -------
    Figure
        Marker and number per theory, bar for its range, band for the test. What governs an answer stands under the
        name of its method.

    Raises
    ------
    InputError
        When no theory has a finite multiplier.
    """
    instance("result", result, SideBySide, "of lm.compare")
    rows = [r for r in result.rows if math.isfinite(r.multiplier)]
    left_out = [r for r in result.rows if not math.isfinite(r.multiplier)]
    if not rows:
        raise InputError("no method has a finite multiplier: there is nothing to draw")
    figure, ax = style.paper(style.page_width(), 1.1 + 0.55 * len(rows), ax)  # [in]: names of two lines have room
    ends = [v for r in rows for v in (r.multiplier, r.low, r.high) if math.isfinite(v)]
    if result.measured is not None:
        low, value, high = result.measured
        ends += [low, high]
        if high > low:
            ax.axvspan(low, high, color="#e4e4e4", linewidth=0, zorder=0.5, gid="test range")
        ax.axvline(value, color=style.BLACK, linewidth=1.0, dashes=(4, 2), zorder=1, gid="test")
    colours = colours_of(r.method for r in rows)
    for k, r in enumerate(rows):
        y = len(rows) - 1 - k
        colour = colours[r.method]
        if r.has_range and r.high > r.low:
            # taller than the marker, so that a narrow range still shows
            ax.barh([y], [r.high - r.low], 0.28, left=r.low, color=style.pale(colour, share=0.45), edgecolor=colour,
                    linewidth=0.6, zorder=2, gid="range")
        ax.plot([r.multiplier], [y], _look(r.method).marker, color=colour, markersize=6.5, zorder=4,
                markeredgecolor="white", markeredgewidth=0.6, gid="value")
        text = f"{r.multiplier:.4f}" + (f"   {r.ratio:.2f} × test" if math.isfinite(r.ratio) else "")
        ax.annotate(text, (r.multiplier, y), (0, 10), textcoords="offset points", ha="center", fontsize=style._SMALL,
                    color=style.BLACK, zorder=5, gid="number",
                    bbox={"boxstyle": "square,pad=.1", "facecolor": "white", "linewidth": 0, "alpha": .75})
    span = max(max(ends) - min(ends), 0.05 * max(map(abs, ends))) or 1.0  # answers that agree do not look apart
    ax.set_xlim(min(ends) - 0.22 * span, max(ends) + 0.22 * span)
    said = style.enlarged(*ax.get_xlim())
    ax.set_ylim(-0.6, len(rows) - 0.35)
    ax.set_yticks(range(len(rows)), [_row_name(r) for r in reversed(rows)])
    ax.set_xlabel(_LAMBDA)
    ax.grid(axis="x", linewidth=0.3, color="#dddddd")
    ax.spines["left"].set_visible(False)
    caption = [] if result.measured is None else ["dashed: test, grey: its scatter" if high > low else "dashed: test"]
    caption += [f"{r.method}: {r.status if len(r.status) <= 60 else r.status[:59] + '…'}" for r in left_out]
    caption += [f"{r.method}: {r.beside}, no bound" for r in rows if r.beside]
    if any(r.has_range and r.high > r.low for r in rows):
        caption.insert(0, "bars: range of each theory")
    caption += [said] if said else []
    style.frame(ax, title or result.title or None, " · ".join(caption))
    ax.tick_params(axis="y", length=0, colors=style.BLACK)
    return figure


def _row_name(row: Any) -> str:
    """Name of the method of a row, and under it what governs its answer."""
    name, governing = _look(row.method).name, row.details.get("governing")
    return f"{name}:\n{governing}" if governing else name


def _draw_published(ax: Axes, published: Mapping[str, Sequence[tuple[float, float]]]) -> list[Line2D]:
    """Draw the points of every source; return entries for the legend.

    ``published`` has the points (x, y), in the units of the axes, by the name of their source.
    """
    handles = []
    for number, (name, points) in enumerate(published.items()):
        places = numbers(f"points of {name!r}", points)
        if places.ndim != 2 or places.shape[1] != 2:
            raise InputError(f"points of {name!r} are pairs (x, y), got shape {places.shape}")
        u, v = places.T
        mark = ("x", "+", "*")[number % 3]
        ax.plot(u, v, mark, color=style.BLACK, markersize=6, zorder=4, gid="published")
        handles.append(Line2D([], [], color=style.BLACK, marker=mark, linestyle="none", label=name))
    return handles


@style.in_print_style
def study_lines(
    table: Iterable[Mapping[str, Any]],
    x: str,
    *,
    y: str = "multiplier",
    by: Sequence[str] | None = None,
    x_label: str | None = None,
    y_label: str | None = None,
    published: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    log: bool = False,
    title: str | None = None,
    caption: str = "",
    ax: Axes | None = None,
) -> Figure:
    """Lines of one column of a study over another, one for every group of rows.

    The column may be dilatancy, block size, contact points, or any other that was varied.

    Parameters
    ----------
    table : rows of a study
    x, y : columns to draw; ranges come from columns "low" and "high" when y is the multiplier
    by : columns that tell the lines apart, or the name of one; by default the method, where the rows have one, and
        every further column without which a line would have several values at one x. Where none helps, values stand as
        points without a line. Rows of status "extrapolated" are hollow and joined by a dotted line
    x_label, y_label : with units; by default the column and its unit
    published : points of a source, by its name
    log : logarithmic x with the values as ticks; a row at x = 0 then stands at the left edge
    title, caption : heading and the small text under it
    ax : axes to draw on; a new figure when not given

    Raises
    ------
    InputError
        When no row has finite values of both columns, or a column is missing.
    """
    rows = [r for r in table if _is_finite(r, x) and _is_finite(r, y)]
    if not rows:
        raise InputError(f"no row has finite values of {x!r} and {y!r}: there is nothing to draw")
    if log and min(r[x] for r in rows) < 0:
        raise InputError(f"column {x!r} has values below zero, which cannot stand on a logarithmic axis")
    by = _lines_by(rows, x, y) if by is None else (by,) if isinstance(by, str) else tuple(by)
    if missing := [name for name in by if not any(name in r for r in rows)]:
        raise InputError(f"by names the column {missing[0]!r}, which no row has")
    own_page = ax is None
    figure, ax = style.paper(style.page_width(), height=3.4, ax=ax)
    positive = sorted({float(r[x]) for r in rows if r[x] > 0})
    edge = 0.5 * positive[0] if positive else 1.0

    def place(value: float) -> float:
        """Where a value stands along x: zero on a logarithmic axis at its left edge."""
        return edge if log and value <= 0 else float(value)

    groups = list(dict.fromkeys(tuple(r.get(k) for k in by) for r in rows))
    colours = colours_of(m for m in dict.fromkeys(r.get("method") for r in rows) if m is not None)
    handles = []
    for number, group in enumerate(groups):
        own = sorted((r for r in rows if tuple(r.get(k) for k in by) == group), key=lambda r: r[x])
        solid = [r for r in own if r.get("status") != "extrapolated"]
        method = own[0].get("method") if by and by[0] == "method" else None
        # a group is the values of the columns ``by``: those of one method are told apart by their number
        second = 0 if method is None else [g for g in groups if g[:1] == group[:1]].index(group)
        look = _line_look(method, number, colours.get(method, style.SERIES[number % len(style.SERIES)]), second)
        if len({r[x] for r in solid}) < len(solid):  # several values at one x: joined they would zigzag
            look["linestyle"] = "none"
        if y == "multiplier":
            bars = [r for r in solid if _is_finite(r, "low") and _is_finite(r, "high") and r["high"] > r["low"]]
            ax.vlines([place(r[x]) for r in bars], [r["low"] for r in bars], [r["high"] for r in bars],
                      color=look["color"], linewidth=2.5, alpha=0.35, zorder=2, gid="range")
        ax.plot([place(r[x]) for r in solid], [r[y] for r in solid], **look, zorder=3, gid="line")
        # one row of a line at most is extrapolated, to x = 0, the neighbour of the first
        guess = [r for r in own if r.get("status") == "extrapolated"]
        if guess and solid:
            ends = [[place(r[x]) for r in (guess[0], solid[0])], [r[y] for r in (guess[0], solid[0])]]
            ax.plot(*ends, ":", color=look["color"], linewidth=1.0)
            ax.plot([place(guess[0][x])], [guess[0][y]], look["marker"], markerfacecolor="white", color=look["color"],
                    markersize=4.5, gid="extrapolated")
        if by:
            handles.append(Line2D([], [], label=_group_name(by, group), **look))
    handles += _draw_published(ax, published or {})
    if log:
        ax.set_xscale("log")
        ticks = [edge] * any(r[x] <= 0 for r in rows) + positive
        ax.set_xticks(ticks, ["→ 0" if t == edge and t not in positive else f"{t:g}" for t in ticks])
        ax.minorticks_off()
    elif all(isinstance(r[x], int) for r in rows):
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))  # of counts
    bottom, top = ax.get_ylim()
    if 0 < bottom < 0.4 * top:  # from zero, unless that would leave two fifths of the axis empty
        ax.set_ylim(bottom=0.0)
    units = table.units if isinstance(table, Table) else {}
    named = {c: f"{c} [{units[c]}]" if units.get(c, "-") != "-" else c for c in (x, y)}
    ax.set(xlabel=x_label or named[x], ylabel=y_label or (_LAMBDA if y == "multiplier" else named[y]))
    ax.grid(linewidth=0.3, color="#dddddd")
    style.frame(ax, title, "\n".join(t for t in (caption, style.enlarged(*ax.get_ylim())) if t))
    if handles and own_page:
        columns = min(style.legend_shape(handles, figure.get_size_inches()[0])[0], 3)
        figure.legend(handles=handles, fontsize=style._SMALL, loc="outside lower center", ncols=columns)
    elif handles:  # on a figure of the caller others may be drawn too
        ax.legend(handles=handles, fontsize=style._SMALL)
    return figure


def _is_finite(row: Mapping[str, Any], column: str) -> bool:
    """Whether a row of a study has a finite number in a column, in which words are refused."""
    value = row.get(column)
    if isinstance(value, str):
        raise InputError(f"column {column!r} holds {value!r}: lines are drawn of numbers")
    return value is not None and math.isfinite(value)


def _line_look(method: Any, number: int, colour: str, second: int) -> dict[str, Any]:
    """Options of ``plot`` of a line: colour and marker by method, fill by group.

    Parameters
    ----------
    method : name, None for a line of no method
    number : of the line, which chooses the marker where the method has none
    colour : of the line
    second : number of its group among those of one method, 0 for the first
    """
    known = method is not None and _known(str(method))
    return {
        "color": colour, "marker": _look(str(method)).marker if known else style.MARKERS[number % 7], "markersize": 4.5,
        "linewidth": 1.1, "markerfacecolor": "white" if second else colour,
        "linestyle": ("-", "--", ":", "-.")[second % 4],
    }


_MOST_CLASSES = 200
"""Of a histogram whose number is not given; chosen: more bars are thinner than their lines."""

_NO_PARAMETER = frozenset(("low", "high", "status", "seconds"))  # columns of results that no study varies


def varied(table: Table, y: str = "multiplier") -> str:
    """First column of ``table`` with numbers that differ, not y nor its range.

    Raises
    ------
    InputError
        Where there is none, or no column y.
    """
    for name in table.columns if y in table.columns else ():
        values = table[name]
        if name not in {y, *_NO_PARAMETER} and values.dtype == float and len(set(values[np.isfinite(values)])) > 1:
            return name
    raise InputError(f"name the column to draw over, plot('column', y='column'); there are {', '.join(table.columns)}")


def _lines_by(rows: Sequence[Mapping[str, Any]], x: str, y: str) -> tuple[str, ...]:
    """Columns that leave one value at every x: the method, then those that help most.

    Of columns that help alike, those of few values go first.

    Parameters
    ----------
    rows : of the table
    x, y : names of the columns on both axes

    Returns
    -------
    names of columns; rows with equal values in all of them are one line
    """
    by = ["method"] if any(r.get("method") is not None for r in rows) else []
    others = [c for c in dict.fromkeys(k for r in rows for k in r) if c not in {x, y, *by, *_NO_PARAMETER}]

    def places(columns: Sequence[str]) -> int:
        """How many rows are told apart by x and ``columns``."""
        return len({(r[x], *(r.get(c) for c in columns)) for r in rows})

    while places(by) < len(rows) and others:
        # of columns that help alike, that with fewest values
        best = max(others, key=lambda c: (places([*by, c]), -len({r.get(c) for r in rows})))
        others.remove(best)
        # a column whose values hardly repeat is a result, not what the rows were made by
        if places([*by, best]) > places(by) and len({r.get(best) for r in rows}) <= max(len(rows) // 2, 1):
            by.append(best)
    return tuple(by)


def _group_name(by: Sequence[str], group: Sequence[Any]) -> str:
    """Name of a line in the legend, from the columns that tell it apart.

    Parameters
    ----------
    by, group : names of the columns, and their values for the line
    """
    parts = []
    for name, value in zip(by, group, strict=True):
        if name == "method":
            parts.append((_look(value).name if _known(value) else str(value)).replace("\n", " "))
        elif name == "share":
            parts.append({0.0: "ψ = 0", 1.0: "ψ = φ"}.get(value, f"ψ = {value:g} φ"))
        else:
            parts.append(f"{name} {value}")
    return ", ".join(parts)


@style.in_print_style
def histogram(
    tables: Mapping[str, Table] | Table, column: str, *, label: str | None = None, measured: Sequence[float] = (),
    bins: int | None = None, title: str | None = None, ax: Axes | None = None,
) -> Figure:
    """How often a number occurs, one set of bars per study over the same classes.

    Parameters
    ----------
    tables : of :func:`limitmason.study.monte_carlo`, by name where there are several
    column : number
    label : of the axis, with its unit
    measured : values of tests, as ticks on the axis
    bins : number of classes; by the rule of Freedman and Diaconis where omitted, at most 200
    title, ax : heading; axes to draw on

    Raises
    ------
    InputError
        With fewer than two finite values.
    """
    groups = dict(tables) if isinstance(tables, Mapping) else {"": tables}
    if not groups:
        raise InputError("no table to draw")
    tests, classes = list(measured), "fd" if bins is None else count("bins", bins)
    found = {name: running(t, column) for name, t in groups.items()}  # mean and variation after 1, 2, ... runs
    values = {}
    for name, table in groups.items():
        cells = table[column].astype(float)
        values[name] = cells[np.isfinite(cells)]
    everything = np.concatenate(list(values.values()))
    if bins is None:
        # the rule divides the range by 2 q / n^(1/3), with q between the quartiles: nearly nothing beside one outlier
        width = 2.0 * float(np.subtract(*np.percentile(everything, (75, 25)))) / len(everything) ** (1 / 3)
        classes = _MOST_CLASSES if 0.0 < _MOST_CLASSES * width < np.ptp(everything) else classes
    edges = np.histogram_bin_edges(everything, bins=classes)
    figure, ax = style.paper(style.page_width(), height=3.2, ax=ax)
    for number, (name, own) in enumerate(values.items()):
        colour = style.SERIES[number % len(style.SERIES)]
        text = f"mean {found[name].mean[-1]:.4g}, CoV {100 * found[name].variation[-1]:.3g} %, {len(own)} runs"
        text = f"{name}: {text}" if name else text
        ax.hist(
            own, edges.tolist(), label=text, color=style.pale(colour, 0.5), edgecolor=colour, linewidth=0.8, alpha=0.75,
            gid="histogram",
        )
    for value in tests:
        ax.axvline(value, 0.0, 0.06, color=style.BLACK, linewidth=1.2, gid="test")
    ax.set_xlabel(label or column)
    ax.set_ylabel("runs [-]")
    # room for the legend above the highest bar: it is as wide as the axes where they are small
    ax.set_ylim(top=ax.get_ylim()[1] * (1.06 + 0.11 * len(values)))
    ax.legend(fontsize=style._SMALL, frameon=False, loc="upper right")
    missing = sum(r.missing for r in found.values())
    notes = [f"{missing} runs without a value are left out"] * bool(missing) + ["ticks: tests"] * bool(tests)
    style.frame(ax, title, " · ".join(notes))
    return figure
