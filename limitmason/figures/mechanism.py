"""Pictures of an assembly and of its collapse mechanism, in elevation or in space."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from limitmason.answers.results import Prediction
from limitmason.errors import InputError
from limitmason.figures import elevation, solid, style
from limitmason.figures.motion import (
    MovingJoints,
    RigidMotion,
    checked_twists,
    drawn_motion,
    largest_rates,
    moving_joints,
)
from limitmason.figures.outline import elevation_plane, wall_plane
from limitmason.figures.painter import camera
from limitmason.figures.tie_lines import draw_ties, stretching
from limitmason.mechanics.plane import Plane
from limitmason.model import Assembly

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

VIEWS = ("auto", "elevation", "3d")


@style.in_print_style
def assembly(
    model: Assembly,
    *,
    view: str = "auto",
    labels: bool = False,
    title: str | None = None,
    ax: Axes | None = None,
    azimuth_deg: float = -58.0,
    elevation_deg: float = 22.0,
) -> Figure:
    """Drawing of the blocks, fixed ones hatched (grey in space).

    Parameters
    ----------
    model : the assembly
    view : "elevation", "3d", or "auto": elevation for a single leaf of prisms, otherwise 3-D
    labels : write the block names (elevation) [-]
    title : heading
    ax : axes to draw on; a new figure when not given
    azimuth_deg, elevation_deg : direction the viewer looks from in 3-D, from x towards y and upwards [deg]

    Returns
    -------
    Figure
        Axes in metres with equal aspect; ``savefig`` writes PNG, PDF or SVG.
    """
    plane = chosen_plane(model, view, None)
    if plane is not None:
        drawing = elevation.Elevation(model, plane)
        frame = drawing.frame()
        page = style.Page(frame.span, ax)
        elevation.draw_blocks(page.ax, drawing, page.line_width(drawing.block_size()))
        if labels:
            size = 72.0 * page.inch * drawing.block_size()
            elevation.label_blocks(page.ax, drawing, min(max(0.3 * size, 2.0), 7.0))
        rods = draw_ties(page.ax, model, lambda p: p @ drawing.axes, page.line_width(drawing.block_size()))
        elevation.set_frame(page.ax, drawing, frame)
    else:
        still = np.zeros(model.n_blocks, dtype=bool)
        page, rods = _draw_space(model, None, None, ~still, still, ax, azimuth_deg, elevation_deg, None)
    handles = elevation.joint_handles(None, fixed=bool(model.fixed.any()), ghost=False, hatch=plane is not None)
    count = f"{model.n_blocks} blocks, {len(model.interfaces)} interfaces"
    return page.finish(title, count + (f", {len(model.ties)} ties" if model.ties else ""), [*handles, *rods])


@style.in_print_style
def mechanism(
    model: Assembly,
    prediction: Prediction,
    *,
    view: str = "auto",
    scale: float = 0.08,
    threshold: float = 0.01,
    ghost: bool = True,
    joints: bool = True,
    title: str | None = None,
    caption: bool = True,
    legend: bool = True,
    ax: Axes | None = None,
    azimuth_deg: float | None = None,
    elevation_deg: float = 22.0,
) -> Figure:
    """Collapse mechanism: displaced blocks over the ghost of the original, opening and sliding joints marked.

    Blocks move as rigid bodies by finite rotations, so they keep their size and shape in the picture. Rates are scaled
    so that the fastest vertex moves by ``scale`` times sqrt(height x length) of the structure.

    Parameters
    ----------
    model, prediction : what was solved and its answer, with a mechanism
    view : "elevation" (the x-z plane, or the wall's own), "3d", or "auto": elevation when a single leaf of prisms
        moves in its plane
    scale : largest displacement over the structure's size [-], > 0; rotations stay below 20 degrees in any case
    threshold : joints that move by less than this fraction of the fastest vertex are not marked, and blocks that do
        are drawn as still [-]
    ghost : draw the original outlines of the blocks that move
    joints : mark opening (vermilion) and sliding (blue) joints
    title : heading
    caption : write multiplier, bound and method below it
    legend : explain the marks
    ax : axes to draw on; a new figure when not given
    azimuth_deg, elevation_deg : direction the viewer looks from in 3-D [deg]; by default a corner towards which the
        blocks move

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        When the prediction has no mechanism, or one of another assembly.

    Notes
    -----
    A mechanism is a rate: only directions and proportions count. Finite displacements overlap or open second-order gaps
    at joints between two rotating blocks.
    """
    twists = checked_twists(model, prediction)
    motion = drawn_motion(model, twists, scale)
    rates = largest_rates(model, twists)
    moving = rates > threshold * max(float(rates.max(initial=0.0)), 1e-300)
    marks = moving_joints(model, twists, threshold) if joints else None
    plane = chosen_plane(model, view, twists)
    ghosts = ghost & ~model.fixed & (rates > max(threshold, 0.03) * max(float(rates.max(initial=0.0)), 1e-300))
    yields = stretching(model, twists, threshold) if model.ties else None
    if plane is not None:
        page, rods = _draw_elevation(model, plane, motion, moving, ghosts, marks, ax, yields)
    else:
        if azimuth_deg is None:
            azimuth_deg = _azimuth_they_move_to(model, twists, elevation_deg)
        page, rods = _draw_space(model, motion, marks, moving, ghosts, ax, azimuth_deg, elevation_deg, yields)
    handles = elevation.joint_handles(
        marks, fixed=bool(model.fixed.any()), ghost=bool(ghosts.any()), hatch=plane is not None
    )
    handles += rods
    return page.finish(title, style.prediction_text(prediction) if caption else None, handles if legend else [])


def chosen_plane(model: Assembly, view: str, twists: Array | None) -> Plane | None:
    """Plane of the elevation that a view asks for, or None for a drawing in space."""
    if view not in VIEWS:
        raise InputError(f"view must be one of {', '.join(map(repr, VIEWS))}, got {view!r}")
    if view == "3d":
        return None
    plane = wall_plane(model, twists if view == "auto" else None)
    if plane is None and view == "elevation":
        return elevation_plane(np.array([0.0, 1.0, 0.0]))
    return plane


def _draw_elevation(
    model: Assembly, plane: Plane, motion: RigidMotion, moving: Flags, ghosts: Flags, marks: MovingJoints | None,
    ax: Axes | None, yields: Flags | None,
) -> tuple[style.Page, list[Line2D]]:  # fmt: skip
    drawing = elevation.Elevation(model, plane)
    frame = drawing.frame(motion)
    page = style.Page(frame.span, ax)
    width = page.line_width(drawing.block_size())
    elevation.draw_blocks(page.ax, drawing, width, motion=motion, moving=moving)
    elevation.draw_ghost(page.ax, drawing, ghosts, width)
    if marks is not None:
        elevation.draw_joints(page.ax, drawing, marks, motion, width)
    rods = draw_ties(page.ax, model, lambda p: p @ drawing.axes, width, motion=motion, yields=yields)
    elevation.set_frame(page.ax, drawing, frame)
    return page, rods


def _draw_space(
    model: Assembly, motion: RigidMotion | None, marks: MovingJoints | None, coloured: Flags, ghosts: Flags,
    ax: Axes | None, azimuth_deg: float, elevation_deg: float, yields: Flags | None,
) -> tuple[style.Page, list[Line2D]]:  # fmt: skip
    seen_from = camera(azimuth_deg, elevation_deg)
    scene = solid.SolidView(model, seen_from, motion)
    before = scene if motion is None else solid.SolidView(model, seen_from)
    layout = solid.Layout(scene, page_frame(scene, before))
    page = style.Page(layout.high - layout.low, ax, framed=False)
    width = page.line_width(solid.block_size(model))
    solid.draw_solids(page.ax, scene, width, moving=coloured, joints=marks, before=before, ghosts=ghosts)
    rods = draw_ties(page.ax, model, seen_from.project, width, motion=motion, yields=yields)
    layout.draw(page.ax)
    return page, rods


def page_frame(scene: solid.SolidView, before: solid.SolidView) -> Array:
    """Page bounds of the free blocks before and after, and as much of the fixed ones as needs to be seen."""
    model = scene.assembly
    free = np.flatnonzero(~model.fixed)
    fixed = np.flatnonzero(model.fixed)
    if not len(free):
        return scene.page_bounds(fixed)
    both = np.concatenate([scene.page_bounds(free), before.page_bounds(free)])
    low, high = both.min(axis=0), both.max(axis=0)
    if len(fixed):
        held = scene.page_bounds(fixed)
        # a foundation is shown whole unless it would shrink the structure to a detail
        reach = 0.5 * float(np.sqrt(np.prod(np.maximum(high - low, 1e-12))))
        low = np.maximum(np.minimum(low, held[0]), low - reach)
        high = np.minimum(np.maximum(high, held[1]), high + reach)
    return np.array([low, high])


def _azimuth_they_move_to(model: Assembly, twists: Array, elevation_deg: float) -> float:
    """Of four corners the one towards which the blocks move, weighted by their volume."""
    weight = model.volumes * np.linalg.norm(twists[:, :3], axis=1)
    mean = (weight[:, None] * twists[:, :3]).sum(axis=0)
    corners = (-58.0, -122.0, 58.0, 122.0)
    return max(corners, key=lambda a: round(float(camera(a, elevation_deg).towards @ mean), 9))
