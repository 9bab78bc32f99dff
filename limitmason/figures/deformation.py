"""Deformed shapes of a simulation, with finite rotations, and films of them.

``model`` is the assembly that was simulated, of n blocks and k interfaces.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, PillowWriter, writers
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from limitmason.answers.curve import Curve
from limitmason.arrays import Array, Index
from limitmason.checks import count, instance, not_negative, numbers, positive
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.canvas import Canvas
from limitmason.figures.painter import VIEWPOINT_DEG
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors
from limitmason.mechanics.rigid_motion import MovingJoints, RigidMotion, largest_jumps, structure_size
from limitmason.model import Assembly
from limitmason.storage.files import named_path

_STILL = 0.01
"""Part of the largest displacement below which a block is drawn as one that stands still, chosen [-]."""

_CRACK = 0.1
"""Part of the largest movement in a joint from which joints are marked where no width is given, chosen [-]."""

_UNIT = 1e-6
"""What the length of a unit quaternion may be off: rounding of single precision, with room [-]."""


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
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
) -> Figure:
    """Blocks where a simulation has moved them.

    Joints that have opened or slid are marked.

    x -> c + scale u + R(scale theta) (x - c): with scale 1 the true shape; otherwise displacements and rotation angles
    grow alike and blocks stay rigid.

    Parameters
    ----------
    model : what was simulated
    state : a state (``bodies.shift``, ``bodies.quat``, such as ``dem.State``), a history (``shift``, ``quaternion``
        with samples), a curve with states, such as a capacity curve, whose blocks that deform keep their shape here, or
        a pair of arrays: displacement of the centroids [m], shape (n, 3), and unit quaternions, scalar first, (n, 4)
    sample : which sample of a history or a curve
    scale : factor on displacements and rotations [-], > 0; written in the caption where it is not 1
    crack : joints that have opened or slid by more than this are marked [m]; a tenth of the largest by default
    ghost : draw the original outlines of the blocks that moved
    view : "elevation", "3d" or "auto"
    title : heading
    caption : text under it after the scale and the largest movement
    legend : explain the marks
    ax : axes to draw on; a new figure when not given
    viewpoint_deg : azimuth and elevation of the viewer in 3-D [deg]

    Raises
    ------
    InputError
        When the state is not one of this assembly, not finite, or the scale not positive.
    """
    instance("model", model, Assembly)
    shift, vector = moved_blocks(model, state, sample)
    motion, unscaled = (rigid_motion(model, shift, vector, factor) for factor in (scale, 1.0))
    marks, travel = cracked_joints(model, unscaled, crack), _travel(model, unscaled)
    # 1e-300: where nothing has moved, no block counts as moving
    moving = travel > _STILL * max(float(travel.max(initial=0.0)), 1e-300)
    ghosts = ghost & moving & ~model.fixed
    twists = np.concatenate([shift, vector], axis=1)
    canvas = Canvas(model, view, ax, twists=twists, motions=[motion], viewpoint_deg=viewpoint_deg)
    canvas.blocks(motion, moving=moving, ghosts=ghosts, joints=marks)
    canvas.frame()
    parts = [f"largest displacement {1e3 * float(travel.max(initial=0.0)):.3g} mm"]
    parts += [f"drawn {scale:g} times"] if scale != 1.0 else []
    parts += [caption] if caption else []
    handles = canvas.handles(marks, ghost=bool(ghosts.any())) if legend else []
    return canvas.page.finish(title, " · ".join(parts), handles)


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
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
) -> Path:
    """Write the motion of a history as a film.

    A .gif is made by pillow, other endings by ffmpeg where it is installed.

    Parameters
    ----------
    model, history : what was simulated; the history has ``shift`` (samples, n, 3) and ``quaternion`` (samples, n, 4)
    path : file to write; its folder is made
    scale, crack, view, viewpoint_deg : as in :func:`deformed`; ``crack`` is a tenth of the largest
        movement in a joint at the last sample by default
    frames : most pictures, evenly spread over the samples
    title : heading
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
    instance("model", model, Assembly)
    target, most, rate = named_path(path), count("frames", frames), count("fps", fps)
    if not hasattr(history, "quaternion"):
        raise InputError(f"history must have shift and quaternion by samples, got {type(history).__name__}")
    if not len(history.shift):
        raise InputError("the history has no sample to show")
    writer = writer or _writer(target, rate)
    moved = [moved_blocks(model, history, k) for k in spread(len(history.shift), most)]
    motions = [rigid_motion(model, shift, vector, scale) for shift, vector in moved]
    unscaled = [rigid_motion(model, shift, vector, scale=1.0) for shift, vector in moved]
    if crack is None:
        crack = _CRACK * largest_movement(model, unscaled[-1])  # one width for the whole film
    marks = [cracked_joints(model, motion, crack) for motion in unscaled]
    # of all samples: a block that comes back has moved too
    travel = np.max([_travel(model, motion) for motion in unscaled], axis=0)
    # 1e-300: where nothing has moved, no block counts as moving
    moving = travel > _STILL * max(float(travel.max(initial=0.0)), 1e-300)
    # plane and viewpoint are chosen for the sample that has moved farthest
    farthest = max(moved, key=lambda m: float(np.abs(m[0]).max(initial=0.0)))
    with style.print_style():
        twists = np.concatenate(farthest, axis=1)
        canvas = Canvas(model, view, ax=None, twists=twists, motions=motions, viewpoint_deg=viewpoint_deg)
        canvas.frame()
        figure = canvas.page.finish(title, f"drawn {scale:g} times" if scale != 1.0 else None, [])
        kept = set(canvas.ax.get_children())
        target.parent.mkdir(parents=True, exist_ok=True)
        with writer.saving(figure, str(target), dpi):
            for motion, cracks in zip(motions, marks, strict=True):
                for artist in [a for a in canvas.ax.get_children() if a not in kept]:
                    artist.remove()
                canvas.blocks(motion, moving=moving, joints=cracks)
                writer.grab_frame()
    return target


def rigid_motion(model: Assembly, shift: Array, vector: Array, scale: float) -> RigidMotion:
    """Finite motion of the blocks.

    Parameters
    ----------
    shift, vector : displacements of the centroids [m] and rotation vectors [rad], shape (n, 3) each
    scale : factor on both [-], > 0
    """
    return RigidMotion(model.centroids, positive("scale", scale) * shift, rotation_matrices(scale * vector))


def cracked_joints(model: Assembly, motion: RigidMotion, crack: float | None) -> MovingJoints:
    """Interfaces that have opened or slid, by the larger of the two at their corners.

    Parameters
    ----------
    motion : of the blocks, not enlarged
    crack : movement from which an interface counts [m]; None for a tenth of the largest
    """
    opening, sliding = _joint_movements(model, motion)
    largest = np.maximum(opening, sliding)
    if crack is None:
        crack = _CRACK * float(largest.max(initial=0.0))
    least = crack if crack == np.inf else not_negative("crack", crack)  # an infinite one marks none
    wide = (largest > least) & (largest > 1e-12 * structure_size(model))  # rounding opens no joint
    return MovingJoints(opening, sliding, wide & (opening >= sliding), wide & (sliding > opening))


def _joint_movements(model: Assembly, motion: RigidMotion) -> tuple[Array, Array]:
    """Largest opening and sliding at corners of every interface, from block a [m].

    ``motion`` is that of the blocks, not enlarged.

    Returns
    -------
    opening, sliding : shape (k,); opening is positive where block b moves away from a
    """
    x = model.arrays
    owner = x.corner_owner  # number of the interface of every corner
    jump = motion.moved(x.corners, x.block_b[owner]) - motion.moved(x.corners, x.block_a[owner])
    # normals of the joints, turned with block a
    normal = np.einsum("nij,nj->ni", motion.rotation[x.block_a[owner]], x.normal[owner])
    return largest_jumps(model, jump, normal)


def largest_movement(model: Assembly, motion: RigidMotion) -> float:
    """Largest opening or sliding in a joint [m]."""
    return float(max(v.max(initial=0.0) for v in _joint_movements(model, motion)))


def _travel(model: Assembly, motion: RigidMotion) -> Array:
    """Largest displacement of any vertex of each block [m], shape (n,)."""
    moves = (np.linalg.norm(motion.moved(b.vertices, i) - b.vertices, axis=1) for i, b in enumerate(model.blocks))
    return np.array([m.max() for m in moves])


def moved_blocks(model: Assembly, state: Any, sample: int) -> tuple[Array, Array]:
    """Displacements [m] and rotation vectors [rad] of all blocks, shape (n, 3) each.

    Parameters
    ----------
    state : a state, a history, a curve with states, or a pair of displacements [m] and unit quaternions
    sample : number of the sample of a history or a curve; of no meaning for the others
    """
    if isinstance(state, Curve):
        if not len(state.states):
            raise InputError("this curve kept no states: there is nothing to draw")
        state = state.states[_numbered(sample, len(state.states), "curve")]
    if hasattr(state, "turn"):  # of a capacity curve: displacements and R - I
        if state.shift.shape != (model.n_blocks, 3):
            raise InputError(
                f"positions of {len(state.shift)} blocks do not belong to the {model.n_blocks} of this assembly"
            )
        return state.shift, Rotation.from_matrix(np.eye(3) + state.turn).as_rotvec()
    bodies = getattr(state, "bodies", None)  # of a state; a history has rows by sample instead
    if bodies is not None:
        shift, quaternion = bodies.shift, bodies.quat
    elif hasattr(state, "quaternion"):
        k = _numbered(sample, len(state.shift), "history")
        shift, quaternion = state.shift[k], state.quaternion[k]
    else:
        if not (isinstance(state, tuple | list) and len(state) == 2):
            told = f"{state!r}; a file to write is path=" if isinstance(state, str) else type(state).__name__
            raise InputError(
                f"what is shown must be an answer, a history, a curve, a state or (shift, quaternion), got {told}"
            )
        shift, quaternion = state
    return _checked(model, shift, quaternion)


def _numbered(sample: Any, samples: int, of: str) -> int:
    """A number of ``samples``, which may count back from the end; ``of`` says of what, where it is none."""
    if not (isinstance(sample, int | np.integer) and -samples <= sample < samples):
        raise InputError(f"sample {sample!r} is not one of the {samples} samples of the {of}")
    return int(sample)


def _checked(model: Assembly, shift: ArrayLike, quaternion: ArrayLike) -> tuple[Array, Array]:
    """Displacements [m] and rotation vectors [rad], (n, 3) each, or what is wrong.

    Parameters
    ----------
    shift, quaternion : displacements [m], shape (n, 3), and unit quaternions, scalar first, shape (n, 4)
    """
    u, q = numbers("shift", shift), numbers("quaternion", quaternion)
    n = model.n_blocks
    if u.shape != (n, 3) or q.shape != (n, 4):
        raise InputError(
            f"displacements of shape {u.shape} and quaternions of shape {q.shape} do not belong to {n} blocks"
        )
    bad = ~(np.isfinite(u).all(axis=1) & np.isfinite(q).all(axis=1))
    if bad.any():
        raise InputError(f"the position of block {model.blocks[int(np.flatnonzero(bad)[0])].name!r} is not finite")
    off = np.abs(np.linalg.norm(q, axis=1) - 1.0)
    if off.max() > _UNIT:
        raise InputError(f"the quaternion of block {model.blocks[int(off.argmax())].name!r} is not of length 1")
    return u, rotation_vectors(q)


def spread(samples: int, most: int) -> list[int]:
    """Numbers of at most ``most`` of some samples, even, with the first and the last."""
    rows: Index = np.unique(np.linspace(0, samples - 1, min(most, samples)).round().astype(int))
    return [int(k) for k in rows]


def _writer(path: Path, fps: int) -> AbstractMovieWriter:
    """What writes a film of ``fps`` pictures a second to a file of that name."""
    if path.suffix.lower() == ".gif":
        return PillowWriter(fps=fps)
    if not writers.is_available("ffmpeg"):
        raise InputError(f"{path.name}: ffmpeg is not installed; write a .gif, or give a writer")
    return writers["ffmpeg"](fps=fps)
