"""Joint forces at collapse: resultants as segments at the centres of pressure, and the line of thrust."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Flags, Index
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.canvas import Canvas
from limitmason.figures.painter import VIEWPOINT_DEG
from limitmason.mechanics.joint_forces import JointForces, joint_forces
from limitmason.model import Assembly, AssemblyArrays
from limitmason.model.model_call import of_model

Pair = tuple[int, int]

_PALE = "#b5b5b5"
"""Outlines under forces."""


class ThrustLine(NamedTuple):
    """Centres of pressure in the order of the blocks [m], (p, 3), the forces there [N], (p,), and their interfaces."""

    centre: Array
    force: Array
    interfaces: tuple[int, ...]


def thrust_lines(model: Assembly, forces: JointForces) -> list[ThrustLine]:
    """Lines of thrust of arches and columns: centres of pressure in the order in which blocks follow each other.

    There is one for every group of free blocks that form a chain, each with at most two neighbours; several interfaces
    between the same two blocks count as one, their centres weighted by the normal forces.

    Notes
    -----
    Between two joints the polyline is straight, the true line bends under the block's own weight.
    """
    x, fixed = model.arrays, model.fixed
    pairs: dict[Pair, list[int]] = {}
    for k, (a, b) in enumerate(zip(x.block_a.tolist(), x.block_b.tolist(), strict=True)):
        if not (fixed[a] and fixed[b]):
            pairs.setdefault((min(a, b), max(a, b)), []).append(k)
    around: dict[int, list[Pair]] = {}
    for pair in pairs:
        for block in pair:
            if not fixed[block]:
                around.setdefault(block, []).append(pair)
    lines, seen = [], set()
    for start in around:
        if start in seen:
            continue
        group, front = {start}, [start]
        while front:
            for pair in around[front.pop()]:
                for other in pair:
                    if not fixed[other] and other not in group:
                        group.add(other)
                        front.append(other)
        seen |= group
        if all(len(around[b]) <= 2 for b in group):
            line = _line([pairs[p] for p in _in_order(group, around, fixed)], forces, x)
            if line is not None:
                lines.append(line)
    return lines


def _in_order(group: set[int], around: dict[int, list[Pair]], fixed: Flags) -> list[Pair]:
    """Pairs of blocks along a chain, from a support or a free end, or none for a closed ring."""

    def held(pair: Pair) -> bool:
        return bool(fixed[pair[0]] or fixed[pair[1]])

    ends = [b for b in sorted(group) if any(held(p) for p in around[b])]
    ends += [b for b in sorted(group) if len(around[b]) == 1]
    if not ends:
        return []
    block = ends[0]
    first = next((p for p in around[block] if held(p)), around[block][0])
    if not held(first):
        block = first[0] + first[1] - block
    order = [first]
    while (pair := next((p for p in around[block] if p not in order), None)) is not None:
        order.append(pair)
        if held(pair):
            break
        block = pair[0] + pair[1] - block
    return order


def _line(joints: list[list[int]], forces: JointForces, x: AssemblyArrays) -> ThrustLine | None:
    centres, sizes, used = [], [], []
    for interfaces in joints:
        rows = [k for k in interfaces if forces.carries[k]]
        if not rows:
            continue
        weight = np.maximum(np.einsum("ij,ij->i", forces.force[rows], x.normal[rows]), 0.0)
        weight = weight if weight.sum() > 0 else np.ones(len(rows))
        centres.append((weight[:, None] * forces.centre[rows]).sum(axis=0) / weight.sum())
        sizes.append(float(np.linalg.norm(forces.force[rows].sum(axis=0))))
        used += rows
    return ThrustLine(np.array(centres), np.array(sizes), tuple(used)) if len(centres) > 1 else None


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

    It is as thick as the force is large.

    Segments pass through the centres of pressure. Those of joints at their friction limit are blue. For arches and
    columns the line of thrust joins the centres of pressure.

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
    forces = joint_forces(model, prediction)
    at_strength = tie_forces(model, prediction) >= 0.999 * np.array([t.strength for t in model.ties])
    canvas = Canvas(model, view, ax, viewpoint_deg=viewpoint_deg)
    canvas.blocks(moving=np.zeros(model.n_blocks, dtype=bool), outline=_PALE)
    pulls = canvas.ties(yields=at_strength)
    canvas.frame()
    page, axes, size = canvas.page, canvas.axes, canvas.size
    thickest = min(max(0.2 * 72.0 * page.inch * size, 0.8), 5.0)
    largest = float(np.linalg.norm(forces.force, axis=1).max(initial=0.0))
    lines = thrust_lines(model, forces) if thrust_line else []
    in_line = {k for line in lines for k in line.interfaces}
    rows = np.array([k for k in np.flatnonzero(forces.carries).tolist() if k not in in_line], dtype=np.intp)
    _draw_segments(page.ax, forces, rows, axes, length * size, thickest)
    for line in lines:
        _draw_line(page.ax, line, forces, axes, thickest)
    unit, newtons = style.force_unit(largest)
    shares = (1.0, 0.5, 0.1) if largest > 0.0 else ()
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
    """One segment per interface through its centre of pressure, along the resultant."""
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


def _draw_line(ax: Axes, line: ThrustLine, forces: JointForces, axes: Array, thickest: float) -> None:
    """Polyline as thick as the force, a dot at every centre of pressure, blue at the friction limit."""
    flat = line.centre @ axes
    width = thickest * line.force / np.linalg.norm(forces.force, axis=1).max()
    ax.add_collection(LineCollection(
        list(np.stack([flat[:-1], flat[1:]], axis=1)), colors=style.VERMILION, capstyle="round", zorder=4,
        linewidths=np.maximum(0.5 * (width[:-1] + width[1:]), 0.4), gid="thrust line",
    ))
    sliding = [bool(forces.at_friction_limit[k]) for k in line.interfaces] if len(line.interfaces) == len(flat) else []
    colours = [style.BLUE if s else style.BLACK for s in sliding] or style.BLACK
    ax.scatter(flat[:, 0], flat[:, 1], s=7.0, c=colours, linewidths=0.0, zorder=4.5, gid="centres of pressure")
