"""Panels of a diagnosis: residuals against a covariate, with noise and trend."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from limitmason.diagnosis.inference.trends import Trends, is_numeric
from limitmason.figures import style

LABELS = 6  # of a covariate whose words are written out
_LETTER = 0.052  # mean width of a letter at 6.5 pt, the size of the numbers of an axis [in]
POINTER = style.VERMILION
"""Colour of the covariate that a verdict names."""


def ordered_covariates(result: Any, covariates: Mapping[str, Sequence]) -> list[str]:
    """Names of covariates: that of the verdict, then by the trend along them.

    The trend is that of the baseline, the strongest first.

    Parameters
    ----------
    result : the diagnosis
    covariates : columns by name, numbers or words, shape (n,) each
    """
    residual = result.y[None, :]  # log(measured / predicted) of the baseline over the noise, one row of n
    strength = {}
    for name, column in covariates.items():
        trends = Trends({name: column}, result.design.scale, kinds=result.design.kinds)
        strength[name] = float(trends.statistic(residual)[0])
    return sorted(covariates, key=lambda n: (not of_covariate(result, n), -strength[n]))


def written(name: str) -> str:
    """A name with its dollar signs, between which matplotlib would read mathematics."""
    return name.replace("$", r"\$")


def shortened(text: str, letters: int) -> str:
    """A text of so many letters at most, ending in dots where more would follow."""
    return text if len(text) <= letters else f"{text[: letters - 1]}…"


def with_unit(name: str, units: Mapping[str, str]) -> str:
    """A covariate with its unit in brackets, where it has one."""
    unit = units.get(name, "")
    return f"{name} [{unit}]" if unit and unit != "-" else name


def named(name: str, units: Mapping[str, str] | None = None) -> str:
    """A name with its unit, if any, as it is given to an axis."""
    return written(name) + with_unit(name, units or {}).removeprefix(name)


def few_labels(column: Sequence) -> bool:
    """Whether the words of a covariate are few enough to be written under the axis."""
    return len(set(map(str, column))) <= LABELS


# by kind of data in their order; the words are for the note under the heading
MARKERS = {"o": "circles", "s": "squares", "^": "triangles", "D": "diamonds"}
LINES = ("-", "--", ":", "-.")


def of_covariate(result: Any, name: str) -> bool:
    """Whether the verdict names this covariate, in all kinds of data or within one."""
    return result.covariate is not None and result.design.recorded_as(result.covariate) == name


def residual_panel(
    ax: Axes, width: float, column: Sequence, values: np.ndarray, limits: tuple[float, float],
    noise: float, colour: str, trend: str | None, *, first: bool, kinds: Sequence[str],
) -> None:
    """Residuals of one explanation against a covariate, a trend by kind of data.

    Parameters
    ----------
    width : of the axes [in]
    column, values : covariate and residuals [%], shape (n,)
    limits : of the vertical axis [%]
    colour : of the points
    noise : standard deviation [%]; twice it is shaded
    trend : kind of the trend that the verdict names, drawn and framed; None for another covariate
    first : whether the panel carries the numbers of the vertical axis
    kinds : kind of data of each row; () is one for all
    """
    ax.axhspan(-2 * noise, 2 * noise, color="#ececec", linewidth=0, zorder=0.5, gid="noise")
    ax.axhline(0.0, color=style.FAINT, linewidth=0.6, zorder=1)
    line: dict[str, Any] = {"color": POINTER if trend else style.GHOST, "linewidth": 1.3 if trend else 0.8, "zorder": 2}
    kind_of = np.array(kinds if len(kinds) else [""] * len(values))
    numeric = is_numeric(column)
    spread: Any = 0.0
    if numeric:
        x = np.asarray(column, dtype=float)
        span = float(np.ptp(x)) or 1.0  # equal values stand in the middle
        ax.set_xlim(x.min() - 0.07 * span, x.max() + 0.07 * span)
        ticks = _ticks(np.unique(x))
        ax.set_xticks(ticks, [f"{v:g}" for v in ticks])
    else:
        labels = [str(v) for v in column]
        known = sorted(set(labels))  # places of words along the axis
        # points of one word are spread at random, the same in every panel, so that they do not cover each other
        spread = np.random.default_rng(0).uniform(-0.13, 0.13, len(labels))
        x = np.array([known.index(v) for v in labels], dtype=float)
        ax.set_xlim(-0.6, len(known) - 0.4)
        ax.set_xticks([])
        if len(known) <= LABELS:
            room = max(int(width / len(known) / _LETTER), 4)
            ax.set_xticks(range(len(known)), [written(shortened(v, room)) for v in known])
    for kind, marker, dashes in zip(dict.fromkeys(kind_of.tolist()), MARKERS, LINES, strict=False):
        inside = kind_of == kind
        for at, height in _trend_lines(x[inside], values[inside], trend, numeric=numeric):
            ax.plot(at, height, gid="trend", linestyle=dashes, **line)
        ax.plot((x + spread)[inside], values[inside], marker, color=colour, markersize=3.6, markeredgecolor="white",
                markeredgewidth=0.4, zorder=3, gid="points")
    ax.set_ylim(*limits)
    if not first:
        ax.tick_params(labelleft=False)
    if trend:
        ax.spines[:].set(visible=True, color=POINTER, linewidth=1.2)
        ax.set_gid("covariate")


def _trend_lines(
    x: np.ndarray, values: np.ndarray, trend: str | None, *, numeric: bool
) -> Iterator[tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]]:
    """Lines of a trend: means of labels or levels, else a line or a parabola.

    Parameters
    ----------
    x, values : covariate and residuals [%], shape (n,); words have the numbers of their places along the axis
    trend : kind that the verdict names, "group" for means and "quadratic" for a parabola
    numeric : whether the covariate is a number

    Yields
    ------
    places along the axis, and heights [%], of the points of one line
    """
    levels = np.unique(x)
    # with hardly two values a level a mean is a single point
    if not numeric or (trend == "group" and len(levels) <= len(x) / 2):
        half = 0.03 * (float(np.ptp(x)) or 1.0) if numeric else 0.3  # half the length of the dash of a mean
        for level in levels:
            mean = float(values[x == level].mean())
            yield [level - half, level + half], [mean, mean]
    elif len(levels) > 1:  # through one level there is no slope
        power = 2 if trend == "quadratic" and len(levels) > 2 else 1
        at = np.linspace(x.min(), x.max(), 60)
        yield at, np.polyval(np.polyfit(x, values, power), at)


def kinds_note(kinds: Sequence[str]) -> str:
    """Which marker is which kind of data; nothing for one kind."""
    told = list(dict.fromkeys(kinds))
    return ", ".join(f"{m} {k}" for m, k in zip(MARKERS.values(), told, strict=False)) if len(told) > 1 else ""


def _ticks(levels: np.ndarray) -> np.ndarray:
    """Places of ticks: ``levels``, (k,), if few and apart, else round numbers.

    Up to four that lie a fifth of the axis apart do not write over each other.
    """
    span = float(np.ptp(levels))
    if len(levels) <= 4 and (len(levels) == 1 or np.diff(levels).min() > 0.2 * span):
        return levels
    ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(levels[0], levels[-1])
    return ticks[(ticks >= levels[0] - 1e-9 * span) & (ticks <= levels[-1] + 1e-9 * span)]
