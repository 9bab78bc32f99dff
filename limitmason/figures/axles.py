"""Multiplier of axles over their positions on a bridge."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from limitmason.figures import style
from limitmason.limit.axles import AxleEnvelope


@style.in_print_style
def axle_envelope(envelope: AxleEnvelope, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Multiplier over the place of the first axle.

    The point is the smallest.

    Parameters
    ----------
    envelope : from ``limitmason.axle_envelope``
    title : heading
    ax : axes to draw in; its own by default
    """
    figure, ax = style.paper(3.4, 2.2, ax)
    least = float(envelope.multipliers.min())
    shown = np.where(np.isfinite(envelope.multipliers), envelope.multipliers, np.nan)
    ax.plot(envelope.positions, shown, color="black", lw=0.9)
    ax.plot([envelope.governing], [least], "o", color=style.ORANGE, ms=4)
    ax.set_ylim(0.0, min(float(np.nanmax(shown)), 6.0 * least) * 1.05)
    ax.set_xlabel("first axle at x [m]")
    ax.set_ylabel("multiplier of the axles [-]")
    style.frame(ax, title, str(envelope))
    return figure
