"""Panels of a diagnosis: residuals against one covariate, numbers or words, with the noise and the trend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from limitmason.diagnosis.inference.trends import Trends, is_numeric
from limitmason.figures import style

LABELS = 6  # of a covariate whose words are written out
POINTER = style.VERMILION
"""Colour of the covariate that a verdict names."""


def ordered_covariates(result: Any, covariates: Mapping[str, Sequence]) -> list[str]:
    """Covariates with the verdict's first, then by the strength of the baseline's trend along them."""
    residual = result.y[None, :]
    strength = {}
    for name, column in covariates.items():
        trends = Trends({name: column}, result.design.scale, kinds=result.design.kinds)
        strength[name] = float(trends.statistic(residual)[0])
    return sorted(covariates, key=lambda n: (n != result.covariate, -strength[n]))


def few_labels(column: Sequence) -> bool:
    """Whether the words of a covariate are few enough to be written under the axis."""
    return len(set(map(str, column))) <= LABELS


def residual_panel(
    ax: Axes, width: float, column: Sequence, values: np.ndarray, limits: tuple[float, float],
    noise: float, colour: str, trend: str | None, *, first: bool,
) -> None:  # fmt: skip
    """Residuals of one explanation against one covariate.

    Parameters
    ----------
    width : of the axes [in]
    column, values : covariate and residuals [%], shape (n,)
    limits : of the vertical axis [%]
    noise : standard deviation [%]; twice it is shaded
    trend : kind of the trend that the verdict names, drawn and framed; None for another covariate
    first : whether the panel carries the numbers of the vertical axis
    """
    ax.axhspan(-2 * noise, 2 * noise, color="#ececec", linewidth=0, zorder=0.5, gid="noise")
    ax.axhline(0.0, color=style.FAINT, linewidth=0.6, zorder=1)
    line: dict[str, Any] = {"color": POINTER if trend else style.GHOST, "linewidth": 1.3 if trend else 0.8, "zorder": 2}
    if is_numeric(column):
        x = np.asarray(column, dtype=float)
        span = float(np.ptp(x)) or 1.0
        ax.set_xlim(x.min() - 0.07 * span, x.max() + 0.07 * span)
        levels = np.unique(x)
        ax.set_xticks(_ticks(levels), [f"{v:g}" for v in _ticks(levels)])
        if trend == "group" and len(levels) <= len(x) / 2:
            for level in levels:
                mean = float(values[x == level].mean())
                ax.plot([level - 0.03 * span, level + 0.03 * span], [mean, mean], gid="trend", **line)
        elif len(levels) > 1:
            power = 2 if trend == "quadratic" and len(levels) > 2 else 1
            at = np.linspace(x.min(), x.max(), 60)
            ax.plot(at, np.polyval(np.polyfit(x, values, power), at), gid="trend", **line)
    else:
        labels = [str(v) for v in column]
        known = sorted(set(labels))
        spread = np.random.default_rng(0).uniform(-0.13, 0.13, len(labels))
        x = np.array([known.index(v) for v in labels]) + spread
        for k, label in enumerate(known):
            mean = float(values[[v == label for v in labels]].mean())
            ax.plot([k - 0.3, k + 0.3], [mean, mean], gid="trend", **line)
        ax.set_xlim(-0.6, len(known) - 0.4)
        if len(known) <= LABELS:
            room = max(int(width / len(known) / 0.052), 4)
            ax.set_xticks(range(len(known)), [v if len(v) <= room else v[: room - 1] + "…" for v in known])
        else:
            ax.set_xticks([])
    ax.plot(x, values, "o", color=colour, markersize=3.6, markeredgecolor="white", markeredgewidth=0.4, zorder=3,
            gid="points")  # fmt: skip
    ax.set_ylim(*limits)
    if not first:
        ax.tick_params(labelleft=False)
    if trend:
        ax.spines[:].set(visible=True, color=POINTER, linewidth=1.2)
        ax.set_gid("covariate")


def _ticks(levels: np.ndarray) -> np.ndarray:
    """The values themselves where they are few and apart, else round numbers between them."""
    span = float(np.ptp(levels))
    if len(levels) <= 4 and (len(levels) == 1 or np.diff(levels).min() > 0.2 * span):
        return levels
    ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(levels[0], levels[-1])
    return ticks[(ticks >= levels[0] - 1e-9 * span) & (ticks <= levels[-1] + 1e-9 * span)]
