"""Deformed shapes of a simulation with their finite rotations, and animations of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, PillowWriter, writers
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from limitmason.errors import InputError
from limitmason.figures import elevation, solid, style
from limitmason.figures.mechanism import chosen_plane, page_frame
from limitmason.figures.motion import MovingJoints, RigidMotion, structure_size
from limitmason.figures.painter import camera
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors
from limitmason.mechanics.plane import Plane
from limitmason.model import Assembly

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@style.in_print_style
def deformed(
    model: Assembly,
    state: Any,
    *,
    sample: int = -1,
    scale: float = 1.0,
    crack: float | None = None,
    ghost: bool = True,
    view: str = "auto",
    title: str | None = None,
    caption: str | None = None,
    legend: bool = True,
    ax: Axes | None = None,
    azimuth_deg: float = -58.0,
    elevation_deg: float = 22.0,
) -> Figure:
    """Blocks where a simulation has moved them, joints that have opened or slid marked.

    x -> c + scale u + R(scale theta) (x - c): with scale 1 the true shape; otherwise displacements and rotation angles
    grow alike and blocks stay rigid.

    Parameters
    ----------
    model : what was simulated
    state : a state (``bodies.shift``, ``bodies.quat``, such as ``dem.State``), a history (``shift``, ``quaternion``
        with samples), or a pair of arrays: displacement of the centroids [m], shape (n, 3), and unit quaternions,
        scalar first, shape (n, 4)
    sample : which sample of a history
    scale : factor on displacements and rotations [-], > 0; written in the caption where it is not 1
    crack : joints that have opened or slid by more than this are marked [m]; a tenth of the largest by default
    ghost : draw the original outlines of the blocks that moved
    view : "elevation", "3d" or "auto"
    title, caption : heading, and text under it after the scale and the largest movement
    legend : explain the marks
    ax : axes to draw on; a new figure when not given
    azimuth_deg, elevation_deg : direction the viewer looks from in 3-D [deg]

    Raises
    ------
    InputError
        When the state is not one of this assembly, not finite, or the scale not positive.
    """
    shift, vector = moved_blocks(model, state, sample)
    motion = rigid_motion(model, shift, vector, scale)
    marks = cracked_joints(model, rigid_motion(model, shift, vector, 1.0), crack)
    travel = _travel(model, rigid_motion(model, shift, vector, 1.0))
    moving = travel > 0.01 * max(float(travel.max(initial=0.0)), 1e-300)
    ghosts = ghost & moving & ~model.fixed
    plane = chosen_plane(model, view, np.concatenate([shift, vector], axis=1))
    if plane is not None:
        drawing = elevation.Elevation(model, plane)
        frame = drawing.frame(motion)
        page = style.Page(frame.span, ax)
        _draw_plane(page.ax, drawing, motion, moving, ghosts, marks, page.line_width(drawing.block_size()))
        elevation.set_frame(page.ax, drawing, frame)
    else:
        seen_from = camera(azimuth_deg, elevation_deg)
        scene, before = solid.SolidView(model, seen_from, motion), solid.SolidView(model, seen_from)
        layout = solid.Layout(scene, page_frame(scene, before))
        page = style.Page(layout.high - layout.low, ax, framed=False)
        solid.draw_solids(page.ax, scene, page.line_width(solid.block_size(model)), moving=moving, joints=marks,
                          before=before, ghosts=ghosts)  # fmt: skip
        layout.draw(page.ax)
    parts = [f"largest displacement {1e3 * float(travel.max(initial=0.0)):.3g} mm"]
    parts += [f"drawn {scale:g} times"] if scale != 1.0 else []
    parts += [caption] if caption else []
    handles = elevation.joint_handles(
        marks, fixed=bool(model.fixed.any()), ghost=bool(ghosts.any()), hatch=plane is not None
    )
    return page.finish(title, " · ".join(parts), handles if legend else [])


def animate(
    model: Assembly,
    history: Any,
    path: str | Path,
    *,
    scale: float = 1.0,
    frames: int = 60,
    fps: int = 15,
    crack: float | None = None,
    view: str = "auto",
    title: str | None = None,
    dpi: int = 100,
    writer: AbstractMovieWriter | None = None,
    azimuth_deg: float = -58.0,
    elevation_deg: float = 22.0,
) -> Path:
    """Write the motion of a history as a film, .gif by pillow, other endings by ffmpeg where it is installed.

    Parameters
    ----------
    model, history : what was simulated; the history has ``shift`` (samples, n, 3) and ``quaternion`` (samples, n, 4)
    path : file to write
    scale, crack, view, azimuth_deg, elevation_deg : as in :func:`deformed`; ``crack`` is a tenth of the largest
        movement in a joint at the last sample by default
    frames : most pictures, evenly spread over the samples
    fps, dpi : pictures per second, pixels per inch
    writer : any matplotlib movie writer

    Returns
    -------
    path

    Raises
    ------
    InputError
        When the history is empty or not one of this assembly, or no writer is installed for the ending.
    """
    target = Path(path)
    count = len(history.shift)
    if not count:
        raise InputError("the history has no sample to show")
    writer = writer or _writer(target, fps)
    rows = np.unique(np.linspace(0, count - 1, min(max(int(frames), 1), count)).round().astype(int))
    moved = [moved_blocks(model, history, int(k)) for k in rows]
    motions = [rigid_motion(model, u, v, scale) for u, v in moved]
    last = rigid_motion(model, *moved[-1], 1.0)
    if crack is None:
        crack = 0.1 * _largest(model, last)
    marks = [cracked_joints(model, rigid_motion(model, u, v, 1.0), crack) for u, v in moved]
    moving = _travel(model, last) > 0.01 * max(float(_travel(model, last).max(initial=0.0)), 1e-300)
    farthest = max(moved, key=lambda m: float(np.abs(m[0]).max(initial=0.0)))
    with style.print_style():
        plane = chosen_plane(model, view, np.concatenate(farthest, axis=1))
        stage = _PlaneStage(model, plane, motions) if plane else _SpaceStage(model, motions, azimuth_deg, elevation_deg)
        figure = stage.page.finish(title, f"drawn {scale:g} times" if scale != 1.0 else None, [])
        with writer.saving(figure, str(target), dpi):
            for motion, cracks in zip(motions, marks, strict=True):
                stage.show(motion, moving, cracks)
                writer.grab_frame()
    return target


class _PlaneStage:
    """Elevation with limits that hold all positions of a film."""

    def __init__(self, model: Assembly, plane: Plane, motions: list[RigidMotion]) -> None:
        self.drawing = elevation.Elevation(model, plane)
        ends = [self.drawing.frame(m) for m in motions]
        low, high = np.min([f.low for f in ends], axis=0), np.max([f.high for f in ends], axis=0)
        self.page = style.Page(high - low, None)
        elevation.set_frame(self.page.ax, self.drawing, elevation.Window(low, high))
        self.width = self.page.line_width(self.drawing.block_size())

    def show(self, motion: RigidMotion, moving: Flags, marks: MovingJoints) -> None:
        for artist in list(self.page.ax.collections):
            artist.remove()
        _draw_plane(self.page.ax, self.drawing, motion, moving, np.zeros_like(moving), marks, self.width)


class _SpaceStage:
    """Parallel projection with limits that hold all positions of a film."""

    def __init__(self, model: Assembly, motions: list[RigidMotion], azimuth_deg: float, elevation_deg: float) -> None:
        self.model, self.view = model, camera(azimuth_deg, elevation_deg)
        self.before = solid.SolidView(model, self.view)
        bounds = [page_frame(solid.SolidView(model, self.view, m), self.before) for m in motions]
        low, high = np.min([b[0] for b in bounds], axis=0), np.max([b[1] for b in bounds], axis=0)
        layout = solid.Layout(self.before, np.array([low, high]))
        self.page = style.Page(layout.high - layout.low, None, framed=False)
        layout.draw(self.page.ax)
        self.kept = set(self.page.ax.get_children())
        self.width = self.page.line_width(solid.block_size(model))

    def show(self, motion: RigidMotion, moving: Flags, marks: MovingJoints) -> None:
        for artist in [a for a in self.page.ax.get_children() if a not in self.kept]:
            artist.remove()
        limits = self.page.ax.get_xlim(), self.page.ax.get_ylim()
        solid.draw_solids(self.page.ax, solid.SolidView(self.model, self.view, motion), self.width, moving=moving,
                          joints=marks, before=self.before, ghosts=np.zeros_like(moving))  # fmt: skip
        self.page.ax.set(xlim=limits[0], ylim=limits[1])


def _draw_plane(
    ax: Axes, drawing: elevation.Elevation, motion: RigidMotion, moving: Flags, ghosts: Flags, marks: MovingJoints,
    width: float,
) -> None:  # fmt: skip
    elevation.draw_blocks(ax, drawing, width, motion=motion, moving=moving)
    elevation.draw_ghost(ax, drawing, ghosts, width)
    elevation.draw_joints(ax, drawing, marks, motion, width)


def rigid_motion(model: Assembly, shift: Array, vector: Array, scale: float) -> RigidMotion:
    """Motion of the blocks with displacements [m] and rotation vectors [rad] times a factor [-]."""
    if not (np.isfinite(scale) and scale > 0.0):
        raise InputError(f"scale must be a positive factor, got {scale!r}")
    return RigidMotion(model.centroids, scale * shift, rotation_matrices(scale * vector))


def cracked_joints(model: Assembly, motion: RigidMotion, crack: float | None) -> MovingJoints:
    """Interfaces that have opened or slid by more than a length [m], by the larger of the two at their corners."""
    opening, sliding = _joint_movements(model, motion)
    largest = np.maximum(opening, sliding)
    least = 0.1 * float(largest.max(initial=0.0)) if crack is None else float(crack)
    wide = (largest > least) & (largest > 1e-12 * structure_size(model))
    return MovingJoints(opening, sliding, wide & (opening >= sliding), wide & (sliding > opening))


def _joint_movements(model: Assembly, motion: RigidMotion) -> tuple[Array, Array]:
    """Largest opening and sliding at the corners of every interface, seen from block a [m]."""
    x = model.arrays
    owner = np.repeat(np.arange(len(x.block_a)), np.diff(x.corner_start))
    jump = motion.moved(x.corners, x.block_b[owner]) - motion.moved(x.corners, x.block_a[owner])
    normal = np.einsum("nij,nj->ni", motion.rotation[x.block_a[owner]], x.normal[owner])
    apart = np.einsum("ij,ij->i", jump, normal)
    along = np.linalg.norm(jump - apart[:, None] * normal, axis=1)
    opening, sliding = np.zeros(len(x.block_a)), np.zeros(len(x.block_a))
    np.maximum.at(opening, owner, apart)
    np.maximum.at(sliding, owner, along)
    return opening, sliding


def _largest(model: Assembly, motion: RigidMotion) -> float:
    return float(max(v.max(initial=0.0) for v in _joint_movements(model, motion)))


def _travel(model: Assembly, motion: RigidMotion) -> Array:
    """Largest displacement of any vertex of each block [m], shape (n,)."""
    moves = (np.linalg.norm(motion.moved(b.vertices, i) - b.vertices, axis=1) for i, b in enumerate(model.blocks))
    return np.array([m.max() for m in moves])


def moved_blocks(model: Assembly, state: Any, sample: int) -> tuple[Array, Array]:
    """Displacements [m] and rotation vectors [rad] of a state, a history's sample or a pair of arrays."""
    bodies = getattr(state, "bodies", None)
    if bodies is not None:
        shift, quaternion = bodies.shift, bodies.quat
    elif hasattr(state, "quaternion"):
        if not -len(state.shift) <= sample < len(state.shift):
            raise InputError(f"sample {sample} is not one of the {len(state.shift)} samples of the history")
        shift, quaternion = state.shift[sample], state.quaternion[sample]
    else:
        shift, quaternion = state
    return _checked(model, shift, quaternion)


def _checked(model: Assembly, shift: ArrayLike, quaternion: ArrayLike) -> tuple[Array, Array]:
    u, q = np.array(shift, dtype=float), np.array(quaternion, dtype=float)
    n = model.n_blocks
    if u.shape != (n, 3) or q.shape != (n, 4):
        raise InputError(
            f"displacements of shape {u.shape} and quaternions of shape {q.shape} do not belong to {n} blocks"
        )
    bad = ~(np.isfinite(u).all(axis=1) & np.isfinite(q).all(axis=1))
    if bad.any():
        raise InputError(f"the position of block {model.blocks[int(np.flatnonzero(bad)[0])].name!r} is not finite")
    return u, rotation_vectors(q)


def _writer(path: Path, fps: int) -> AbstractMovieWriter:
    if path.suffix.lower() == ".gif":
        return PillowWriter(fps=fps)
    if not writers.is_available("ffmpeg"):
        raise InputError(f"{path.name}: ffmpeg is not installed; write a .gif, or give a writer")
    return writers["ffmpeg"](fps=fps)
