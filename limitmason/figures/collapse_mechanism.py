"""Pictures of an assembly and of its collapse mechanism, in elevation or in space."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from limitmason.answers.results import Prediction
from limitmason.checks import not_negative
from limitmason.figures import elevation, style
from limitmason.figures.canvas import Canvas
from limitmason.figures.painter import VIEWPOINT_DEG
from limitmason.figures.tie_lines import stretching
from limitmason.mechanics.rigid_motion import checked_twists, drawn_motion, largest_rates, moving_joints
from limitmason.model import Assembly
from limitmason.model.model_call import of_model

_GHOST = 0.03
"""Part of the fastest vertex below which a block has no ghost: its two outlines would be one line [-]."""


@of_model
@style.in_print_style
def assembly(
    model: Assembly,
    *,
    view: str = "auto",
    labels: bool = False,
    title: str | None = None,
    ax: Axes | None = None,
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
) -> Figure:
    """Drawing of the blocks, fixed ones hatched (grey in space).

    Parameters
    ----------
    model : the assembly
    view : "elevation", "3d", or "auto": elevation for a single leaf of prisms, otherwise 3-D
    labels : write the block names, in elevation alone
    title : heading
    ax : axes to draw on; a new figure when not given
    viewpoint_deg : azimuth, from x towards y, and elevation of the viewer in 3-D [deg]

    Returns
    -------
    Figure
        Axes in metres with equal aspect; ``savefig`` writes PNG, PDF or SVG.
    """
    canvas = Canvas(model, view, ax, viewpoint_deg=viewpoint_deg)
    canvas.blocks()
    if labels and canvas.plane is not None:
        elevation.label_blocks(canvas.ax, canvas.drawing, 72.0 * canvas.page.inch)
    handles = [*canvas.handles(), *canvas.ties()]
    canvas.frame()
    count = f"{model.n_blocks} blocks, {len(model.interfaces)} interfaces"
    return canvas.page.finish(title, count + (f", {len(model.ties)} ties" if model.ties else ""), handles)


@of_model
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
    viewpoint_deg: tuple[float, float] | None = None,
) -> Figure:
    """Collapse mechanism.

    Displaced blocks over the ghost of the original, opening and sliding joints marked, an arrow for the live loads.

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
    viewpoint_deg : azimuth and elevation of the viewer in 3-D [deg]; by default a corner towards which the
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
    not_negative("threshold", threshold)
    twists = checked_twists(model, prediction)
    motion = drawn_motion(model, twists, scale)
    rates = largest_rates(model, twists)
    fastest = max(float(rates.max(initial=0.0)), 1e-300)  # not zero: where nothing moves no block counts as moving
    moving = rates > threshold * fastest
    marks = moving_joints(model, twists, threshold) if joints else None
    ghosts = ghost & ~model.fixed & (rates > max(threshold, _GHOST) * fastest)
    canvas = Canvas(model, view, ax, twists=twists, motions=[motion], viewpoint_deg=viewpoint_deg)
    canvas.blocks(motion, moving=moving, ghosts=ghosts, joints=marks)
    rods = canvas.ties(motion, yields=stretching(model, twists, threshold) if model.ties else None)
    settles = prediction.reaction is not None  # its load is what holds the support
    push = canvas.load(prediction.loads, "support gives way" if settles else "live load")
    canvas.frame()
    handles = [*push, *canvas.handles(marks, ghost=bool(ghosts.any())), *rods] if legend else []
    return canvas.page.finish(title, style.prediction_text(prediction) if caption else None, handles)
