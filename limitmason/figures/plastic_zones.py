"""Plasticity maps of a wall of zoned blocks: zones at yield, yielded, cracked."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.crack_patterns import one_a_sample, point_text, sample_of
from limitmason.model.input import read_list

_DRAWN = 0.04
"""Largest displacement in the drawing over the size of the structure [-]: chosen."""

_BESIDE, _TALLEST, _HEADING = 0.7, 3.4, 0.3
"""Paper beside an elevation, height of the tallest, and paper for the heading of each [in]: chosen."""

_MARGIN = 0.005
"""Room around an elevation over its size [-], so that lines at the edge show their whole width."""

MARKS = ("elastic", "at yield in shear", "yielded in shear before", "failed in tension")
"""Names of the marks of a zone, by number."""


@style.in_print_style
def plasticity(
    curve: Any, *, at: tuple[str | int, ...] = ("peak", "end"), scale: float | None = None, title: str | None = None
) -> Figure:
    """Elevations of a driven wall, zones coloured by how they yielded or failed.

    Elevations of several moments stand one below the other. Colours are those of :data:`MARKS`; each heading gives
    their shares of the number of zones.

    Parameters
    ----------
    curve : of ``dem.push`` with zoned blocks: with ``mesh``, ``opening``, ``slip``, ``assembly``, and for every sample
        ``zones`` with displacements ``shift`` of the nodes [m], shape (k, 2), and ``marks``, numbers in :data:`MARKS`
    at : moments, one elevation each: "peak", "end", or samples by number
    scale : factor on displacements [-]; by default so that the largest at the last moment can be seen
    title : heading of the figure

    Raises
    ------
    InputError
        For a curve without zones, no moment, and an unknown one.
    """
    if not getattr(curve, "zones", ()):
        raise InputError("this curve has no zones: draw the curve of dem.push with blocks='zoned'")
    drawn = one_a_sample([(sample_of(curve, moment), moment) for moment in read_list("at", at)])
    if not drawn:
        raise InputError("at: name at least one moment: 'peak', 'end' or a sample by number")
    mesh = curve.mesh
    start = curve.zones[0].shift  # displacements count from the first state, at rest under its own weight
    shifts = [curve.zones[i].shift - start for i, _ in drawn]
    if scale is None:
        scale = style.seen_at(shifts[-1], _DRAWN * float(np.ptp(mesh.place, axis=0).max()))
    places = [mesh.place + positive("scale", scale) * u for u in shifts]
    low, high = np.min(places, axis=(0, 1)), np.max(places, axis=(0, 1))
    span = high - low
    page = style.page_width()
    inch = min((page - _BESIDE) / span[0], _TALLEST / span[1])  # scale of the drawings [in/m]
    figure, axes = style.panels(page, len(drawn) * (span[1] * inch + _HEADING), rows=len(drawn))
    colours: tuple[Any, ...] = ("white", style.VERMILION, style.pale(style.VERMILION, 0.45), style.BLUE)
    for ax, (i, name), place in zip(axes, drawn, places, strict=True):
        marks = curve.zones[i].marks
        ax.add_collection(PolyCollection(
            list(place[mesh.zones]), facecolors=[colours[m] for m in marks], edgecolors=style.GHOST, linewidths=0.2,
            gid="zones", zorder=1.0,
        ))
        # mesh.sides are the nodes along all sides of blocks, one side after the other
        sides = [place[mesh.sides[a:b]] for a, b in pairwise(mesh.side_start)]
        ax.add_collection(LineCollection(sides, colors=style.BLACK, linewidths=0.45, gid="sides", zorder=2.0))
        edge = _MARGIN * span
        ax.set_xlim(low[0] - edge[0], high[0] + edge[0])
        ax.set_ylim(low[1] - edge[1], high[1] + edge[1])
        ax.set_aspect("equal")
        ax.axis("off")
        share = ", ".join(f"{np.mean(marks == m):.0%} {MARKS[m]}" for m in (1, 2, 3) if (marks == m).any())
        heading = point_text(curve, i, name) + (f"; {share}" if share else "")
        ax.set_title(heading, loc="left", fontsize=7.5, pad=3.0)
    handles: list[Any] = [
        Patch(facecolor=c, edgecolor=style.GHOST, linewidth=0.4, label=m) for c, m in zip(colours, MARKS, strict=True)
    ]
    handles.append(Line2D([], [], color=style.BLACK, linewidth=0.6, label=f"displacements drawn {scale:g} times"))
    return style.finished(figure, title, text=None, handles=handles)
