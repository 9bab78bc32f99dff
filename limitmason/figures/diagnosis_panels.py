"""The picture of a diagnosis: residuals, sizes, distances of causes, the gain.

``result`` is a diagnosis; places and lengths on a sheet are in inches, from its upper left corner.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from limitmason.diagnosis.inference.trends import is_numeric
from limitmason.diagnosis.verdict_text import headline
from limitmason.figures import residuals, style
from limitmason.figures.confusion import distance_legend, draw_distances
from limitmason.figures.residuals import named, shortened

MOST_COLUMNS = 4  # kept explanations that get a column of residuals
MOST_ROWS = 5  # covariates shown

_PAGE = style.FULL_WIDTH
_LEFT, _RIGHT, _GAP = 0.5, 0.12, 0.17  # margins of panels, and between them
_CHARACTER = 0.066  # width kept for a letter of a name, bold at 7 pt
_LETTER_10, _LETTER_7, _PLAIN_7 = 0.08, 0.062, 0.0525  # mean width of a letter: bold at 10 and 7 pt, plain at 7 pt
_PANEL = 1.05  # height of a residual panel
_SHADE = "#ececec"  # of twice the noise
_BASE = style.BLACK
_KEPT = (style.BLUE, style.GREEN, style.PURPLE, style.ORANGE)


class _Sheet:
    """A page filled downwards, so far to ``depth`` [in], whose height is known last."""

    def __init__(self) -> None:
        """Begin an empty page, whose width is that of an A4 page's text."""
        style.needs_a_page("diagnosis")
        self.figure = style.blank(_PAGE, 1.0)
        self.depth = 0.08
        self._axes: list[tuple[Axes, tuple[float, float, float, float]]] = []
        self._texts: list[tuple[Any, float, float]] = []

    def text(self, x: float, y: float, text: str, **options: Any) -> None:
        """Add text at x from the left and y from the top [in]; ``options`` of the figure."""
        options = {"va": "top", "parse_math": options.get("gid") == "title", **options}
        self._texts.append((self.figure.text(0, 0, text, **options), x, y))

    def axes(self, x: float, y: float, width: float, height: float) -> Axes:
        """New axes of a size, their upper left corner at x and y from the top left [in]."""
        ax = self.figure.add_axes((0, 0, 0.1, 0.1), label=f"axes {len(self._axes)}")
        self._axes.append((ax, (x, y, width, height)))
        ax.tick_params(labelsize=6.5, width=0.5, length=2.5, colors=style.FAINT)
        ax.spines[:].set_linewidth(0.5)
        return ax

    def heading(self, text: str, note: str = "") -> None:
        """Add ``text`` as the heading of a block, with a small note under it."""
        self.text(style._INSET, self.depth, text, fontsize=style._FONT, fontweight="bold")
        self.depth += 0.19
        lines = textwrap.wrap(note, int((_PAGE - 2.0 * style._INSET) / _PLAIN_7))
        if lines:
            self.text(style._INSET, self.depth - 0.02, "\n".join(lines), fontsize=7, color=style.FAINT,
                      linespacing=1.25, gid="caption")
            self.depth += 0.135 * len(lines)

    def close(self) -> Figure:
        """Place everything on the final page, which counts from below, and return it."""
        total = self.depth + 0.08
        self.figure.set_size_inches(_PAGE, total)
        for ax, (x, y, width, height) in self._axes:
            ax.set_position((x / _PAGE, 1.0 - (y + height) / total, width / _PAGE, height / total))
        for text, x, y in self._texts:
            text.set_position((x / _PAGE, 1.0 - y / total))
        return self.figure


@style.in_print_style
def diagnosis(
    result: Any, *, units: Mapping[str, str] | None = None, quantity: str = "", title: str | None = None
) -> Figure:
    """The picture of a verdict: residuals, sizes, distances, predictions.

    Parameters
    ----------
    result : from ``Study.diagnose(causes)``
    units : unit of each covariate, for the axes
    quantity : what was measured, with its unit, for example "collapse multiplier [-]"
    title : heading above the verdict

    Returns
    -------
    Figure
        From above: the verdict; measured / predicted - 1 [%] against each covariate, one column for the baseline and
        one per kept explanation (four at most), the covariate that the verdict names framed, twice the noise shaded;
        the size of every listed cause between its bounds, kept ones with their 95 % interval, and where nothing is
        named the sizes that would have been seen; squared distances d2 between the causes on this design; predicted
        against measured before and after.
    """
    sheet = _Sheet()
    _head(sheet, result, title)
    _residuals(sheet, result, units or {})
    _sizes(sheet, result)
    _design_and_fit(sheet, result, quantity)
    return sheet.close()


def _colours(result: Any) -> dict[tuple[str, ...], str]:
    """Colour of every kept explanation that has a column, by the names of its causes."""
    return {names: _KEPT[k] for k, names in enumerate(result.kept[:MOST_COLUMNS])}


def _head(sheet: _Sheet, result: Any, title: str | None) -> None:
    """Write title and verdict in large letters, and what it is about in small ones."""
    if title:
        sheet.text(style._INSET, sheet.depth, title, fontsize=style._FONT, color=style.FAINT, gid="title")
        sheet.depth += 0.2
    words = headline(result)
    lines = textwrap.wrap(words[0].upper() + words[1:] + ".", int((_PAGE - 2.0 * style._INSET) / _LETTER_10))
    sheet.text(style._INSET, sheet.depth, "\n".join(lines), fontsize=10, fontweight="bold", linespacing=1.2,
               gid="verdict")
    sheet.depth += 0.19 * len(lines) + 0.05
    inputs = ", ".join(f"{k} {v.value:.3g} ± {v.sd:.2g}" for k, v in result.nuisance.items())
    note = (
        f"{_count(result)}, noise {result.noise}{', measured input ' + inputs if inputs else ''}; conditional on a "
        f"list of {len(result.listed)} cause{'s' * (len(result.listed) != 1)}."
    )
    lines = style.lines_of(note, _PAGE)
    sheet.text(style._INSET, sheet.depth, "\n".join(lines), fontsize=style._SMALL, color=style.FAINT, linespacing=1.3,
               gid="caption")
    sheet.depth += style._LINE * len(lines) + 0.12


def _count(result: Any) -> str:
    """How many specimens, and numbers where a specimen has several."""
    specimens = len(set(result.design.columns.get("specimen", range(result.n))))
    return f"{specimens} specimens" + (f", {result.n} numbers" if specimens < result.n else "")


def _residuals(sheet: _Sheet, result: Any, units: Mapping[str, str]) -> None:
    """Draw residuals along every covariate, a column for each kept explanation.

    The baseline has the first column. Where nothing is kept its panels stand side by side. ``result.kept`` are tuples
    of names of causes, ``result.covariates`` values of every specimen by name, ``units`` those of the covariates.
    """
    # a covariate within one kind of specimens is left out: a panel shows every kind
    within = tuple(f" in {kind}" for kind in set(result.design.kinds))
    covariates = {k: v for k, v in result.covariates.items() if not k.endswith(within)}
    covariates = covariates or {"number of the specimen": list(range(1, result.n + 1))}
    ordered = residuals.ordered_covariates(result, covariates)
    shown, left_out = ordered[:MOST_ROWS], ordered[MOST_ROWS:]
    # explanations by the names of their causes: () is the baseline
    columns: list[tuple[str, ...]] = [(), *result.kept[:MOST_COLUMNS]]
    colours = {(): _BASE, **_colours(result)}
    values = {n: 100.0 * np.expm1(_residual(result, n)) for n in columns}  # of a logarithm to per cent
    top = max(float(np.abs(v).max()) for v in values.values()) * 1.18
    noise = _noise_band(result)
    # one scale for all panels, about zero, in which the band of noise leaves room for points beyond it
    limits = (-max(top, 3.5 * noise), max(top, 3.5 * noise))
    note = _residual_note(result, noise, left_out)
    sheet.heading("What the simulation leaves: measured / predicted − 1 [%]", note)
    if len(columns) == 1:  # nothing kept: the covariates stand side by side
        per_row = min(3, len(shown))
        width = min((_PAGE - _LEFT - _RIGHT - (per_row - 1) * _GAP) / per_row, 2.9)  # chosen: one is not the page
        for start in range(0, len(shown), per_row):
            for k, name in enumerate(shown[start : start + per_row]):
                ax = sheet.axes(_LEFT + k * (width + _GAP), sheet.depth + 0.03, width, 1.25 * _PANEL)
                residuals.residual_panel(
                    ax, width, covariates[name], values[()], limits, noise, _BASE, _trend_of(result, name),
                    first=k == 0, kinds=result.design.kinds,
                )
                ax.set_xlabel(named(name, units), fontsize=7, color=style.BLACK, labelpad=1.5)
            sheet.depth += 1.25 * _PANEL + 0.48
        return
    width = (_PAGE - _LEFT - _RIGHT - (len(columns) - 1) * _GAP) / len(columns)
    titles = [textwrap.wrap(_column_title(result, n), max(int(width / _LETTER_7), 12)) for n in columns]
    deepest = max(map(len, titles))
    for k, (explanation, lines) in enumerate(zip(columns, titles, strict=True)):
        text = "\n".join([""] * (deepest - len(lines)) + lines)  # titles end on one line
        sheet.text(_LEFT + k * (width + _GAP) + 0.5 * width, sheet.depth, text, fontsize=7, ha="center",
                   color=colours[explanation], linespacing=1.2, fontweight="bold")
    sheet.depth += 0.13 * deepest + 0.05
    high = _PANEL if len(shown) <= 3 else 0.8 * _PANEL
    for name in shown:
        for k, explanation in enumerate(columns):
            ax = sheet.axes(_LEFT + k * (width + _GAP), sheet.depth, width, high)
            trend = None if explanation else _trend_of(result, name)  # the verdict speaks of the baseline's trend
            residuals.residual_panel(
                ax, width, covariates[name], values[explanation], limits, noise, colours[explanation], trend,
                first=k == 0, kinds=result.design.kinds,
            )
        # numbers and few words are written under the axis
        sheet.depth += high + (0.19 if is_numeric(covariates[name]) or residuals.few_labels(covariates[name]) else 0.05)
        middle = _LEFT + 0.5 * (_PAGE - _LEFT - _RIGHT)
        sheet.text(middle, sheet.depth, named(name, units), fontsize=7, ha="center", parse_math=True)
        sheet.depth += 0.24


def _residual_note(result: Any, noise: float, left_out: Sequence[str]) -> str:
    """Words below the panels, with deviation ``noise`` [%] and what is ``left_out``."""
    markers = residuals.kinds_note(result.design.kinds)
    parts = [f"{markers.capitalize()}, each with the trend of its own along the covariate" if markers
             else "Points: specimens; line: trend along the covariate"]
    stated = result.noise.kind != "unknown"
    parts.append(f"shaded: twice the noise {'stated' if stated else 'estimated from the best fit'}, {noise:.1f} %")
    if result.covariate:
        parts.append(f"framed: {result.covariate}, which the baseline's residuals vary with (a pointer, not a cause)")
    if len(result.kept) > MOST_COLUMNS:
        parts.append(f"{len(result.kept) - MOST_COLUMNS} more explanations are not rejected")
    if left_out:
        parts.append(f"not shown, weaker: {', '.join(left_out)}")
    return "; ".join(parts) + "."


def _residual(result: Any, names: tuple[str, ...]) -> np.ndarray:
    """Residuals log(measured / predicted) [-], (n,), of ``names``; () is the baseline."""
    return result.residuals[" + ".join(names) if names else "baseline"]


def _noise_band(result: Any) -> float:
    """Standard deviation of the noise [%]: as stated, in the mean, or as estimated."""
    sd = result.noise_sd if result.noise.kind == "unknown" else float(np.mean(result.design.scale))
    return 100.0 * sd


def _column_title(result: Any, names: tuple[str, ...]) -> str:
    """The causes ``names``, () for none, with the error that they leave [%]."""
    return f"{' + '.join(names) or 'baseline'}: error {_error(result, names):.1f}\N{NO-BREAK SPACE}%"


def _error(result: Any, names: tuple[str, ...]) -> float:
    """Root mean square of the residuals that the causes ``names`` leave [%]."""
    return 100.0 * float(np.sqrt(np.mean(_residual(result, names) ** 2)))


def _trend_of(result: Any, name: str) -> str | None:
    """Kind of the trend along a covariate where the verdict names it, else None."""
    return result.verdict.trend if residuals.of_covariate(result, name) else None


def _sizes(sheet: _Sheet, result: Any) -> None:
    """Draw every listed cause between its bounds: size, interval, what would be seen.

    By name of a cause, ``result.estimates`` are sizes of the kept ones and ``verdict.tested`` best fits of all.
    ``detectable`` are the sizes that would have been seen, as in :func:`_unseen`.
    """
    listed = result.listed
    row = 0.205 if len(listed) <= 12 else 0.165  # height of each; chosen: long lists stay on the page
    right = 2.25  # room for the words beside
    # names are cut where they would leave the axis less than 0.8 in, chosen
    letters = min(max(len(c.name) for c in listed), int((_PAGE - right - _RIGHT - 0.32 - 0.8) / _CHARACTER))
    left = 0.32 + _CHARACTER * letters
    width = _PAGE - left - right - _RIGHT
    note = "Each cause within its own bounds (ends of the grey line); tick: baseline, no effect. " + (
        "Filled: not rejected, with its 95 % interval; open: rejected." if result.kept else
        "Open: best fit, rejected." if result.kind == "unexplained" else
        "Open: best fit, not needed; shaded: sizes that nine times in ten would not have been seen."
    )
    sheet.heading("How large: sizes of the causes on the list", note)
    ax = sheet.axes(left, sheet.depth + 0.02, width, row * len(listed))
    colours = {n: c for names, c in _colours(result).items() for n in names} if result.kept else {}
    if result.pairs:  # pairs are kept: both causes of the best one have one colour
        colours = dict.fromkeys(result.causes, style.BLUE)
    for k, cause in enumerate(listed):
        low, high = cause.bounds
        tested = result.verdict.tested[(cause.name,)]

        def at(size: float, low: float = low, high: float = high) -> float:
            """Place of a size along the axis, 0 and 1 at the bounds of this cause."""
            return (size - low) / (high - low)

        ax.plot([0, 1], [k, k], color="#cfcfcf", linewidth=0.8, zorder=1)
        ax.plot([at(cause.baseline)] * 2, [k - 0.3, k + 0.3], color=style.FAINT, linewidth=1.0, zorder=2)
        estimate = result.estimates.get(cause.name)
        if estimate is not None:
            colour = colours.get(cause.name, style.BLACK)
            ax.plot([at(estimate.low), at(estimate.high)], [k, k], color=colour, linewidth=2.6, zorder=3,
                    gid="interval", solid_capstyle="butt")
            ax.plot([at(estimate.size)], [k], "o", color=colour, markersize=5, markeredgecolor="white",
                    markeredgewidth=0.5, zorder=4, gid="estimate")
            text = f"{cause.show(estimate.size)}  [{estimate.low:.3g}, {estimate.high:.3g}]"
            text += " at its bound" if estimate.at_bound else ""
        else:
            if result.kind in ("none", "scatter"):  # no cause is needed: which would have been seen?
                start, end = map(at, _unseen(cause, result.detectable[cause.name]))
                ax.add_patch(Rectangle((start, k - 0.26), end - start, 0.52, color="#e4e4e4", linewidth=0, zorder=0.6,
                                       gid="unseen"))
                text = _seen_text(cause, result.detectable[cause.name])
            else:
                text = f"rejected (fits best at {cause.show(tested.sizes[0])})"
            ax.plot([at(tested.sizes[0])], [k], "o", color=style.GHOST, markerfacecolor="white", markersize=4,
                    zorder=3, gid="fit")
            colour = style.FAINT
        sheet.text(left + width + 0.12, sheet.depth + 0.02 + row * (k + 0.5), text, fontsize=7, va="center",
                   color=colour, gid="size")
    ax.set(xlim=(-0.03, 1.03), ylim=(len(listed) - 0.5, -0.5), xticks=[])
    rows = [f"{named(shortened(c.name, letters))}  {k}" for k, c in enumerate(listed, 1)]
    ax.set_yticks(range(len(listed)), rows, fontsize=7)
    ax.tick_params(length=0, colors=style.BLACK)
    for cause, label in zip(listed, ax.get_yticklabels(), strict=True):
        label.set_fontweight("bold" if cause.name in result.estimates else "normal")
    ax.spines[:].set_visible(False)
    sheet.depth += row * len(listed) + 0.16


def _unseen(cause: Any, seen: Sequence[float | None]) -> tuple[float, float]:
    """Least and largest size of ``cause`` that would have stayed unseen, in its unit.

    Parameters
    ----------
    seen : least size that would have been seen, to each of the cause's sides; None where none within the bounds would,
        so that all up to the bound stays unseen
    """
    low = high = cause.baseline
    for side, size in zip(cause.sides, seen, strict=True):
        end = side if size is None else size
        low, high = min(low, end), max(high, end)
    return low, high


def _seen_text(cause: Any, seen: Sequence[float | None]) -> str:
    """From which size on a cause would have been seen; ``seen`` as in :func:`_unseen`."""
    if all(s is None for s in seen):
        return "never seen within its bounds"
    parts = [f"{s:.3g}" for s in seen if s is not None]
    unit = "" if cause.unit == "-" else f" {cause.unit}"
    return f"seen from {' or '.join(parts)}{unit}" + ("" if all(s is not None for s in seen) else ", one side only")


def _design_and_fit(sheet: _Sheet, result: Any, quantity: str) -> None:
    """Draw the map of d2 left, and predicted against measured ``quantity`` right.

    d2 are the squared distances between causes, see :func:`confusion.draw_distances`. Lengths are in inches.
    """
    square, left = 1.95, 0.45  # side of the second drawing, margin of the map
    room = _PAGE - square - _RIGHT - 0.75  # for the map: left of the second drawing and of its labels, .75
    cell = min(0.34, (room - left) / len(result.listed))
    side = cell * len(result.listed)
    sheet.heading("What this design can tell apart, and what the better model gains")
    top = sheet.depth
    text = "d2 of a true cause (row) to a rival (column), numbers as above"
    sheet.text(style._INSET, top, text, fontsize=7, color=style.FAINT)
    ax = sheet.axes(left, top + 0.3, side, side)  # .3: the line of text above it
    draw_distances(ax, result.distances, cell, kept=[n for names in result.kept for n in names])
    beside = left + side + 1.6 < room  # 1.6 in is the width of the legend: it stands beside the map or under it
    place = {"bbox_to_anchor": (1.06, 1.02)} if beside else {"bbox_to_anchor": (0.0, 0.0), "ncols": 2}
    ax.legend(handles=distance_legend(), loc="upper left", fontsize=6.5, frameon=False, borderpad=0.2,
              labelspacing=0.25, columnspacing=1.0, **place)
    fit = sheet.axes(_PAGE - square - _RIGHT, top + 0.1, square, square)
    lines = _predicted(fit, result, quantity)
    # as deep as the deeper of the two: the map with a legend that may stand under it (.5), or the square with labels
    # (.38) and a legend of its own, .13 a line
    sheet.depth = top + max(0.3 + side + (0.05 if beside else 0.5), 0.1 + square + 0.38 + 0.13 * lines)


def _predicted(ax: Axes, result: Any, quantity: str) -> int:
    """Draw predicted against measured ``quantity``, and return its legend lines.

    Predictions are those of the baseline and of the first kept explanation, if any.
    """
    measured = np.asarray(result.measured)
    sets: list[tuple[tuple[str, ...], Any, str, str]] = [((), result.predicted(()), _BASE, "baseline")]
    for names, colour in list(_colours(result).items())[:1]:
        sets.append((names, result.predicted(names), colour, " + ".join(names)))
    handles: list[Any] = []
    everything = np.concatenate([measured, *(s[1] for s in sets)])
    low, high = float(everything.min()), float(everything.max())
    # from zero, unless that would leave two fifths of the axes empty
    low, high = (0.0, 1.06 * high) if low < 0.4 * high else (low - 0.08 * (high - low), high + 0.08 * (high - low))
    several = len(set(result.quantities)) > 1 and everything.min() > 0.0
    if several:  # newtons beside hertz: logarithmic axes show both
        low, high = 0.7 * float(everything.min()), 1.4 * float(everything.max())
    ends = np.geomspace(low, high, 60) if several else np.array([low, high])
    noise = _noise_band(result) / 100.0
    ax.fill_between(ends, ends * np.exp(-2 * noise), ends * np.exp(2 * noise), color=_SHADE, linewidth=0, zorder=0.5)
    ax.plot(ends, ends, color=style.FAINT, linewidth=0.7, zorder=1, gid="1:1")
    for names, predicted, colour, label in sets:
        face = colour if names else "white"
        ax.plot(measured, predicted, "o" if names else "s", color=colour, markerfacecolor=face, markersize=3.8,
                markeredgewidth=0.7, zorder=3 if names else 2, gid="after" if names else "before")
        handles.append(Line2D([], [], color=colour, marker="o" if names else "s", markerfacecolor=face, markersize=3.8,
                              linestyle="none", label=f"{named(shortened(label, 29))}: {_error(result, names):.1f} %"))
    if result.gain is not None:
        left_out = 100.0 * result.gain.error_left_out
        handles.append(Line2D([], [], linestyle="none", label=f"each specimen left out: {left_out:.1f} %"))
    handles.append(Patch(facecolor=_SHADE, label="twice the noise"))
    ax.set(xlim=(low, high), ylim=(low, high))
    if several:
        ax.set(xscale="log", yscale="log")
    else:
        ax.locator_params(nbins=5)
    ax.set_xlabel(f"measured {quantity}".strip(), fontsize=7, labelpad=1.5)
    ax.set_ylabel(f"predicted {quantity}".strip(), fontsize=7, labelpad=1.5)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.42, -0.17), fontsize=6.5, frameon=False,
              labelspacing=0.25)
    return len(handles)
