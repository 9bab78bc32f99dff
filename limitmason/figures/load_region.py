"""Loads that are safe at once: the set with forces, within the lines beyond which a mechanism moves."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, QhullError

from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.limit.load_region import LoadRegion


@style.in_print_style
def load_region(region: LoadRegion, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Multipliers of two loads.

    Filled where forces carry them, a line per half-plane of a mechanism.

    Parameters
    ----------
    region : of two loads, from ``limitmason.load_region``; a region that is certain for psi < phi is filled darker
    title : heading
    ax : axes to draw in; its own by default

    Raises
    ------
    InputError
        For an empty region, and one of one or three loads.
    """
    if len(region.names) != 2 or not len(region.corners):
        raise InputError(f"a region is drawn of two loads that can be carried, not: {region}")
    figure, ax = style.paper(3.4, 3.0, ax)
    for drawn, shade in ((region, "#d8d8d8"), (region.certain, "#a0a0a0")):
        if drawn is not None and len(drawn.corners):
            outline = _outline(drawn.corners)
            ax.fill(*outline.T, color=shade, lw=0)
            ax.plot(*np.vstack([outline, outline[:1]]).T, color="black", lw=0.8, marker="o", ms=2.5)
    low, high = region.corners.min(axis=0), region.corners.max(axis=0)
    room = 0.12 * np.maximum(high - low, 1e-3 * np.abs(region.corners).max())
    ax.set_xlim(low[0] - room[0], high[0] + room[0])
    ax.set_ylim(low[1] - room[1], high[1] + room[1])
    for plane in region.outside:
        foot, (x, y) = plane.offset * plane.normal, plane.normal
        if plane.twists is not None:
            ax.axline((foot[0], foot[1]), (foot[0] - y, foot[1] + x), color=style.ORANGE, lw=0.5)
    ax.set_xlabel(f"multiplier of {region.names[0]} [-]")
    ax.set_ylabel(f"multiplier of {region.names[1]} [-]")
    style.frame(ax, title, str(region))
    return figure


def _outline(corners: np.ndarray) -> np.ndarray:
    """Corners in order.

    Of a set without area the two that are farthest apart.
    """
    try:
        return np.asarray(corners[ConvexHull(corners).vertices])
    except (QhullError, ValueError):
        return np.asarray(corners[[np.argmin(corners.sum(axis=1)), np.argmax(corners.sum(axis=1))]])
