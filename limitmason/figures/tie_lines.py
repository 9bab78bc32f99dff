"""Ties as lines over a drawing of blocks: those that yield, and the others.

``model`` is the structure that they hold, ``ax`` are the axes that are drawn on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from limitmason.arrays import Array, Flags
from limitmason.figures import style
from limitmason.mechanics.rigid_motion import RigidMotion, largest_rates, velocity
from limitmason.model import Assembly

HELD, YIELDS = style.GREEN, style.PURPLE


def stretching(model: Assembly, twists: Array, threshold: float) -> Flags:
    """Flags of the ties that a mechanism stretches, shape (t,).

    Parameters
    ----------
    twists : of the mechanism, shape (n, 6)
    threshold : part of the speed of the fastest vertex above which a tie counts as stretched [-]
    """
    # links are all that joins two blocks: interfaces first, then ties
    rows = slice(len(model.interfaces), None)
    x = model.links
    ends = np.array([t.ends for t in model.ties]).reshape(-1, 2, 3)
    speed_a = velocity(x.centroid, twists, x.block_a[rows], ends[:, 0])
    speed_b = velocity(x.centroid, twists, x.block_b[rows], ends[:, 1])
    longer = -((speed_b - speed_a) * x.normal[rows]).sum(axis=1)  # the normal of a tie runs from its end b to its end a
    return np.asarray(longer > threshold * max(float(largest_rates(model, twists).max(initial=0.0)), 1e-300))


def draw_ties(
    ax: Axes, model: Assembly, project: Callable[[Array], Array], width: float, *, motion: RigidMotion | None,
    yields: Flags | None,
) -> list[Line2D]:
    """Draw the ties over blocks as if of glass, and return legend entries.

    Parameters
    ----------
    project : gives page coordinates [m], shape (n, 2), of places in space [m], shape (n, 3)
    width : of outlines [pt]; ties are more than twice as thick
    motion : of the blocks, which carry the ends; None for the place at rest
    yields : ties that are drawn as yielding, shape (t,); None for none
    """
    handles = []
    x, first = model.links, len(model.interfaces)
    flags = np.zeros(len(model.ties), dtype=bool) if yields is None else yields
    for chosen, colour, gid, label in (
        (~flags, HELD, "ties", "tie"), (flags, YIELDS, "yielding ties", "tie that yields"),
    ):
        lines = []
        for k in np.flatnonzero(chosen).tolist():
            ends = model.ties[k].ends
            if motion is not None:
                blocks = (int(x.block_a[first + k]), int(x.block_b[first + k]))
                ends = np.array([motion.moved(p[None], b)[0] for p, b in zip(ends, blocks, strict=True)])
            lines.append(project(ends))
        if lines:
            thick = 2.0 * width + 0.7
            ax.add_collection(LineCollection(lines, colors=colour, linewidths=thick, gid=gid, zorder=3.4))
            at = np.concatenate(lines)
            ends_of: dict[str, Any] = {"marker": "s", "markersize": 1.6 * thick, "color": colour}
            ax.plot(*at.T, linestyle="none", zorder=3.5, gid=f"{gid} ends", **ends_of)
            handles.append(Line2D([], [], linewidth=thick, label=label, **ends_of))
    return handles
