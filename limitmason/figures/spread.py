"""Figures of many random runs: histogram, running mean and spread, fan of curves, shares of modes, sensitivity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from limitmason.answers.curve import Curve
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.study.montecarlo import curves_of
from limitmason.study.spread import running, sensitivity, shares
from limitmason.study.table import Table

FAN = (0.05, 0.5, 0.95)
"""Quantiles of the load that a fan shows: edges of the band and the median."""


@style.in_print_style
def histogram(
    tables: Mapping[str, Table] | Table, column: str, *, label: str | None = None, measured: Sequence[float] = (),
    bins: int | None = None, title: str | None = None, ax: Axes | None = None,
) -> Figure:  # fmt: skip
    """How often a number occurs, one set of bars per study over the same classes.

    Parameters
    ----------
    tables : of :func:`limitmason.study.monte_carlo`, by name where there are several
    column : number
    label : of the axis, with its unit
    measured : values of tests, as ticks on the axis
    bins : number of classes; by the rule of Freedman and Diaconis where omitted
    title, ax : heading; axes to draw on

    Raises
    ------
    InputError
        With fewer than two finite values.
    """
    groups = dict(tables) if isinstance(tables, Mapping) else {"": tables}
    found = {name: running(t, column) for name, t in groups.items()}
    values = {}
    for name, table in groups.items():
        numbers = table[column].astype(float)
        values[name] = numbers[np.isfinite(numbers)]
    edges = np.histogram_bin_edges(np.concatenate(list(values.values())), bins=bins if bins is not None else "fd")
    figure, ax = style.paper(style.page_width(), 3.2, ax)
    for number, (name, own) in enumerate(values.items()):
        colour = style.SERIES[number % len(style.SERIES)]
        last = found[name]
        text = f"mean {last.mean[-1]:.4g}, CoV {100 * last.variation[-1]:.3g} %, {len(own)} runs"
        text = f"{name}: {text}" if name else text
        ax.hist(
            own, edges.tolist(), label=text, color=style.pale(colour, 0.5), edgecolor=colour, linewidth=0.8, alpha=0.75,
            gid="histogram",
        )  # fmt: skip
    for value in measured:
        ax.axvline(value, 0.0, 0.06, color=style.BLACK, linewidth=1.2, gid="test")
    ax.set_xlabel(label or column)
    ax.set_ylabel("runs [-]")
    # room for the legend above the highest bar: it is as wide as the axes where they are small
    ax.set_ylim(top=ax.get_ylim()[1] * (1.06 + 0.11 * len(values)))
    ax.legend(fontsize=style._SMALL, frameon=False, loc="upper right")
    missing = sum(r.missing for r in found.values())
    notes = [f"{missing} runs without a value are left out"] * bool(missing) + ["ticks: tests"] * bool(len(measured))
    style.frame(ax, title, " · ".join(notes))
    return figure


@style.in_print_style
def running_spread(
    table: Table, column: str, *, label: str | None = None, title: str | None = None, ax: Axes | None = None
) -> Figure:
    """Mean and CoV over the number of runs, over their last values.

    Bands are of one sampling error.

    Parameters
    ----------
    table, column : of :func:`limitmason.study.monte_carlo`
    label : of the number
    title, ax : heading; axes to draw on

    Raises
    ------
    InputError
        With fewer than two finite values.
    """
    found = running(table, column)
    figure, ax = style.paper(style.page_width(), 3.0, ax)
    kept = slice(min(5, len(found.n) - 1), None)
    lines = (
        ("mean", found.mean, found.mean_error, style.BLUE),
        ("CoV", found.variation, found.variation_error, style.VERMILION),
    )
    for name, value, error, colour in lines:
        if value[-1] == 0.0:
            continue
        share = value[kept] / value[-1]
        ax.plot(
            found.n[kept], share, color=colour, linewidth=1.1, label=f"{name}, {value[-1]:.4g} at the end", gid=name
        )
        band = (1.0 - error[kept], 1.0 + error[kept])
        ax.fill_between(found.n[kept], *band, color=colour, alpha=0.15, linewidth=0, gid=f"{name} error")
    ax.set_xlabel("runs [-]")
    ax.set_ylabel("value over its last [-]")
    ax.legend(fontsize=style._SMALL, frameon=False)
    said = style.enlarged(*ax.get_ylim())
    words = (label or column, "bands: one standard error of so many runs", said)
    style.frame(ax, title, " · ".join(w for w in words if w))
    return figure


@style.in_print_style
def curve_fan(
    table: Table, column: str = "curve", *, measured: Sequence[Curve] = (), title: str | None = None,
    ax: Axes | None = None,
) -> Figure:  # fmt: skip
    """All curves of a study, with median and 90 % band of the load.

    Both are taken at each displacement.

    Parameters
    ----------
    table, column : of :func:`limitmason.study.monte_carlo`
    measured : curves of tests, drawn over them
    title, ax : heading; axes to draw on

    Raises
    ------
    InputError
        Where the column holds no curves.
    """
    curves = curves_of(table, column)
    figure, ax = style.paper(style.page_width(), 3.6, ax)
    for c in curves:
        ax.plot(c.displacement, c.load, color="#bbbbbb", linewidth=0.3, zorder=1, gid="run")
    if all((np.diff(c.displacement) >= 0.0).all() for c in curves):
        u = np.linspace(
            max(float(c.displacement[0]) for c in curves), min(float(c.displacement[-1]) for c in curves), 200
        )
        low, middle, high = np.quantile([c.at(u) for c in curves], FAN, axis=0)
        ax.fill_between(u, low, high, color=style.BLUE, alpha=0.2, linewidth=0, zorder=2, gid="band")
        ax.plot(u, middle, color=style.BLUE, linewidth=1.4, zorder=3, gid="median")
    for test in measured:
        ax.plot(test.displacement, test.load, color=style.VERMILION, linewidth=1.2, zorder=4, gid="test")
    ax.set_xlabel(f"displacement [{curves[0].displacement_unit}]")
    ax.set_ylabel(f"load [{curves[0].load_unit}]")
    style.frame(ax, title, f"{len(curves)} runs; line: median, band: 5 to 95 % at each displacement")
    return figure


@style.in_print_style
def word_shares(
    tables: Mapping[str, Table] | Table, column: str, *, title: str | None = None, ax: Axes | None = None
) -> Figure:
    """Shares of failure modes, or of other words, with their 95 % intervals.

    Parameters
    ----------
    tables : of :func:`limitmason.study.monte_carlo`, by name where there are several
    column : words
    title, ax : heading; axes to draw on

    Raises
    ------
    InputError
        For a column without entries.
    """
    groups = dict(tables) if isinstance(tables, Mapping) else {"": tables}
    found = {name: {s.name: s for s in shares(t, column)} for name, t in groups.items()}
    words = list(dict.fromkeys(w for own in found.values() for w in own))
    figure, ax = style.paper(style.page_width(), 0.9 + 0.32 * len(words) * len(groups), ax)
    height = 0.8 / len(groups)
    for number, (name, own) in enumerate(found.items()):
        colour = style.SERIES[number % len(style.SERIES)]
        for place, word in enumerate(words):
            if word not in own:
                continue
            s = own[word]
            y = -place - (number - 0.5 * (len(groups) - 1)) * height
            first = name and place == words.index(next(w for w in words if w in own))
            ax.barh(
                y, s.share, 0.85 * height, color=style.pale(colour, 0.5), edgecolor=colour, linewidth=0.8, gid="share",
                label=name if first else None,
            )  # fmt: skip
            ax.plot([s.low, s.high], [y, y], color=style.BLACK, linewidth=0.8, gid="interval")
            ax.annotate(
                str(s.runs), (s.high, y), (3, 0), textcoords="offset points", va="center", fontsize=style._SMALL
            )
    ax.set_yticks([-k for k in range(len(words))], words)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_xlim(0.0, 1.08)
    ax.set_xlabel("share of the runs")
    if any(groups):
        ax.legend(fontsize=style._SMALL, frameon=False, loc="lower right")
    style.frame(ax, title, "lines: 95 % interval; numbers: runs")
    return figure


@style.in_print_style
def sensitivity_bars(
    table: Table, column: str, inputs: Sequence[str] | None = None, *, title: str | None = None, ax: Axes | None = None
) -> Figure:
    """Rank correlation of a number with every random input.

    The band in which chance alone lies stands beside it.

    Parameters
    ----------
    table, column, inputs : as for :func:`limitmason.study.sensitivity`
    title, ax : heading; axes to draw on

    Raises
    ------
    InputError
        As :func:`limitmason.study.sensitivity`.
    """
    found = sensitivity(table, column, inputs)
    if not found:
        raise InputError("there is nothing to draw")
    figure, ax = style.paper(style.page_width(), 0.9 + 0.32 * len(found), ax)
    chance = 1.96 * found[0].rank_error
    ax.axvspan(-chance, chance, color="#e4e4e4", linewidth=0, zorder=0.5, gid="chance")
    for place, s in enumerate(found):
        ax.barh(
            -place, s.rank, 0.65, color=style.pale(style.BLUE, 0.5), edgecolor=style.BLUE, linewidth=0.8, gid="rank"
        )
    ax.axvline(0.0, color=style.BLACK, linewidth=0.6)
    ax.set_yticks([-k for k in range(len(found))], [s.name for s in found])
    ax.set_xlim(-1.05, 1.05)
    ax.set_xlabel(f"rank correlation with {column} [-]")
    style.frame(ax, title, "grey: 95 of 100 values without any relation")
    return figure
