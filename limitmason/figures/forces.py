"""Joint forces at collapse: resultants at centres of pressure, lines of thrust.

``ax`` are the axes that are drawn on; ``axes`` project places in space on the page, shape (3, 2); ``thickest`` is the
width of the largest force, in points.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Index
from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.canvas import Canvas
from limitmason.figures.painter import VIEWPOINT_DEG
from limitmason.mechanics.joint_forces import JointForces, joint_forces
from limitmason.mechanics.thrust_line import ThrustLine, thrust_lines
from limitmason.model import Assembly
from limitmason.model.model_call import of_model

_PALE = "#b5b5b5"
"""Outlines under forces."""

_AT_STRENGTH = 0.999
"""Part of its strength from which a tie counts as yielding [-]: solvers end a little below it."""


@of_model
@style.in_print_style
def contact_forces(
    model: Assembly,
    prediction: Prediction,
    *,
    view: str = "auto",
    thrust_line: bool = True,
    length: float = 0.9,
    title: str | None = None,
    ax: Axes | None = None,
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
) -> Figure:
    """Joint forces as one segment per interface along its resultant.

    Segments are as thick as the force is large and pass through the centres of pressure. Those of joints at their
    friction limit are blue. For arches and columns the line of thrust joins the centres of pressure.

    Parameters
    ----------
    model, prediction : what was solved, and its answer with resultants
    view : "elevation", "3d", or "auto": elevation for a single leaf of prisms, otherwise 3-D
    thrust_line : draw it where free blocks form a chain
    length : of a segment over the median smaller side of the blocks [-]
    title : heading; the caption stands below it
    ax : axes to draw on; a new figure when not given
    viewpoint_deg : azimuth and elevation of the viewer in 3-D [deg]

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        When the prediction has no resultants, or those of another assembly.

    Notes
    -----
    In a statically indeterminate structure at collapse the forces away from the mechanism are one admissible state of
    many: the picture shows the one the solver returned.
    """
    positive("length", length)
    forces = joint_forces(model, prediction)
    at_strength = tie_forces(model, prediction) >= _AT_STRENGTH * np.array([t.strength for t in model.ties])
    canvas = Canvas(model, view, ax, viewpoint_deg=viewpoint_deg)
    canvas.blocks(moving=np.zeros(model.n_blocks, dtype=bool), outline=_PALE)
    pulls = canvas.ties(yields=at_strength)
    canvas.frame()
    page, axes, size = canvas.page, canvas.axes, canvas.size
    thickest = min(max(0.2 * 72.0 * page.inch * size, 0.8), 5.0)  # chosen: a fifth of a block, from 0.8 to 5 pt
    largest = float(np.linalg.norm(forces.force, axis=1).max(initial=0.0))
    lines = thrust_lines(model, forces) if thrust_line else []
    # joints of a line of thrust have no segments of their own
    in_line = {k for line in lines for k in line.interfaces}
    rows = np.array([k for k in np.flatnonzero(forces.carries).tolist() if k not in in_line], dtype=np.intp)
    _draw_segments(page.ax, forces, rows, axes, length * size, thickest)
    for line in lines:
        _draw_thrust_line(page.ax, line, forces, axes, thickest)
    unit, newtons = style.force_unit(largest)
    shares = (1.0, 0.5, 0.1) if largest > 0.0 else ()  # of the largest force: widths that the legend shows
    entries = [(style.BLACK, max(s * thickest, 0.3), f"{s * largest / newtons:.3g} {unit}") for s in shares]
    entries += [(style.BLUE, 2.0, "at friction limit")] * bool((forces.at_friction_limit & forces.carries).any())
    entries += [(style.VERMILION, 1.6, "line of thrust")] * bool(lines)
    handles = [Line2D([], [], color=colour, linewidth=width, label=text) for colour, width, text in entries]
    return page.finish(title, style.prediction_text(prediction), [*handles, *pulls, *canvas.handles()])


def tie_forces(model: Assembly, prediction: Prediction) -> Array:
    """Tension in every tie of an answer with joint forces [N], shape (t,)."""
    r, first = prediction.resultants, len(model.interfaces)
    if r is None or len(r.normal) < first + len(model.ties):
        raise InputError(f"this prediction ({prediction.method}) has no forces of the {len(model.ties)} ties")
    return np.asarray(r.normal, dtype=float)[first:]


def _draw_segments(
    ax: Axes, forces: JointForces, rows: Index, axes: Array, length: float, thickest: float
) -> None:
    """Draw a segment per interface along its resultant, at the centre of pressure.

    Parameters
    ----------
    rows : numbers of the interfaces, which carry a force
    axes : directions to the right and up on the page, shape (3, 2)
    length : of all segments [m]
    thickest : width of the segment of the largest force [pt]
    """
    if not len(rows):
        return
    size = np.linalg.norm(forces.force, axis=1)
    # small forces last, so that large ones do not bury them
    rows = rows[np.argsort(-size[rows], kind="stable")]
    half = 0.5 * length * forces.force[rows] / size[rows, None]
    ends = np.stack([forces.centre[rows] - half, forces.centre[rows] + half], axis=1) @ axes
    colours = [style.BLUE if limit else style.BLACK for limit in forces.at_friction_limit[rows]]
    ax.add_collection(LineCollection(
        list(ends), colors=colours, linewidths=np.maximum(thickest * size[rows] / size.max(), 0.25), zorder=4,
        gid="forces", capstyle="round",
    ))


def _draw_thrust_line(ax: Axes, line: ThrustLine, forces: JointForces, axes: Array, thickest: float) -> None:
    """Draw a polyline as thick as the force, and dots at the centres of pressure.

    A dot is blue where its joint is at the friction limit.

    Parameters
    ----------
    line : of thrust through the joints of a chain of blocks: its points ``centre`` [m], shape (p, 3), and the size of
        the resultant ``force`` [N] at each, shape (p,)
    forces : of all joints, whose largest has the width ``thickest`` [pt]
    axes : directions to the right and up on the page, shape (3, 2)
    """
    flat = line.centre @ axes
    width = thickest * line.force / np.linalg.norm(forces.force, axis=1).max()
    ax.add_collection(LineCollection(
        list(np.stack([flat[:-1], flat[1:]], axis=1)), colors=style.VERMILION, capstyle="round", zorder=4,
        linewidths=np.maximum(0.5 * (width[:-1] + width[1:]), 0.4), gid="thrust line",
    ))
    # several interfaces between two blocks are one point of the line, which then is of no single joint: dots are black
    sliding = [bool(forces.at_friction_limit[k]) for k in line.interfaces] if len(line.interfaces) == len(flat) else []
    colours = [style.BLUE if s else style.BLACK for s in sliding] or style.BLACK
    ax.scatter(flat[:, 0], flat[:, 1], s=7.0, c=colours, linewidths=0.0, zorder=4.5, gid="centres of pressure")
