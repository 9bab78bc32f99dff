"""Interactive scene of a structure in one HTML file: turn it, cut it, find a block, follow its motion.

The file needs neither network nor server. What is drawn is the model itself: faces of the blocks, moved by the frames
of a mechanism, of a capacity curve or of a history, and the forces of the joints.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Index
from limitmason.constants import VERSION
from limitmason.errors import InputError
from limitmason.figures.deformation import moved_blocks
from limitmason.figures.outline import visible_edges, wall_plane
from limitmason.geometry.polyhedron import face_planes
from limitmason.geometry.rotation import rotation_matrices
from limitmason.mechanics.joint_forces import joint_forces
from limitmason.mechanics.motion import checked_twists, drawn_motion, free_bounds, structure_size
from limitmason.model import Assembly
from limitmason.model.model_call import of_model
from limitmason.storage.files import write_text


class ScenePose(NamedTuple):
    """One position of all blocks: displacement of the centroids [m], (n, 3), rotation, (n, 3, 3), and what it is."""

    shift: Array
    rotation: Array
    caption: str


@of_model
def view(
    model: Assembly,
    what: Any = None,
    path: str | Path | None = None,
    *,
    title: str | None = None,
    scale: float | None = None,
    frames: int = 60,
    azimuth_deg: float = -58.0,
    elevation_deg: float = 22.0,
) -> Scene:
    """Scene of a structure and an answer as one self-contained HTML file.

    It shows the motion and the joint forces.

    Parameters
    ----------
    model : the assembly
    what : nothing; a prediction (its mechanism, growing, and its joint forces); a capacity curve of this assembly; a
        history of ``dem.simulate``; or a state
    path : file to write; without one the scene is only returned (a notebook shows it; ``save`` writes it)
    title : of the page; what is shown by default
    scale : of a mechanism: largest displacement over the structure's size [-], 0.12 by default; of a path: factor on
        displacements and rotations [-], 1 by default
    frames : most positions that the file holds
    azimuth_deg, elevation_deg : where the viewer stands at first

    Returns
    -------
    Scene
        ``save(path)`` writes the file; its text is ``html``.

    Raises
    ------
    InputError
        For an answer of another assembly, one without motion and forces, or settings that make no sense.
    """
    if frames < 1:
        raise InputError(f"frames must be at least 1, got {frames!r}")
    moved, subtitle = _positions(model, what, scale, int(frames))
    forces = _arrows(model, what) if isinstance(what, Prediction) and what.resultants is not None else np.zeros((0, 3))
    data = _solids(model) | {
        "motion": _text(np.concatenate([_poses(f).ravel() for f in moved])),
        "captions": [f.caption for f in moved],
        "forces": _text(forces),
        "azimuth": float(np.radians(azimuth_deg)),
        "elevation": float(np.radians(elevation_deg)),
        "front": _front(model),
    }
    words = f"{model.n_blocks} blocks, {len(model.interfaces)} joints"
    scene = Scene(_page(title or "limitmason", f"{words}{'; ' if subtitle else ''}{subtitle}", data))
    if path is not None:
        scene.save(path)
    return scene


class Scene:
    """An interactive scene: ``html`` is the text of the page.

    A notebook shows it in a frame.
    """

    def __init__(self, html: str) -> None:
        self.html = html

    def save(self, path: str | Path) -> Path:
        """Write the page to a file and return its path."""
        return write_text(path, self.html)

    def __repr__(self) -> str:
        return f"Scene of {len(self.html) / 1e3:.0f} kB; .save('scene.html') and open it in a browser"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.html, quote=True)}" '
            'style="width: 100%; height: 32rem; border: 1px solid #ddd"></iframe>'
        )


def _positions(model: Assembly, what: Any, scale: float | None, most: int) -> tuple[list[ScenePose], str]:
    """Frames of what is shown, and a line that says what they are."""
    n = model.n_blocks
    rest = ScenePose(np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3)), "")
    if what is None:
        return [rest], ""
    if isinstance(what, Prediction):
        line = f"{what.method}: λ = {what.collapse_multiplier:.4g} ({what.status})"
        if what.mechanism is None:
            return [rest], line
        return _of_mechanism(model, what, 0.12 if scale is None else scale, min(most, 25)), line
    factor = 1.0 if scale is None else scale
    if not (np.isfinite(factor) and factor > 0.0):
        raise InputError(f"scale must be a positive factor, got {factor!r}")
    if isinstance(what, Curve):
        return _of_curve(model, what, factor, most)
    if len(getattr(what, "shift", ())) and np.ndim(what.shift) == 3:
        return _of_history(model, what, factor, most)
    return [_moved(model, what, 0, factor, "")], f"drawn {factor:g} times" if factor != 1.0 else ""


def _of_mechanism(model: Assembly, prediction: Prediction, scale: float, count: int) -> list[ScenePose]:
    twists = checked_twists(model, prediction)
    out = []
    for share in np.linspace(0.0, 1.0, max(count, 2)):
        motion = drawn_motion(model, twists, max(scale * share, 1e-9))
        out.append(ScenePose(motion.translation, motion.rotation, f"mechanism, {100 * share:.0f} %"))
    return out


def _of_curve(model: Assembly, curve: Curve, factor: float, most: int) -> tuple[list[ScenePose], str]:
    if not len(curve.states):
        raise InputError("this curve kept no states: there is nothing to draw")
    unit, load = curve.displacement_unit, curve.load_unit
    out = [
        _moved(model, curve.states[k], 0, factor,
               f"{curve.displacement[k]:.4g} {unit}: {curve.load[k]:.4g}{'' if load == '-' else ' ' + load}")
        for k in _spread(len(curve), most)
    ]  # fmt: skip
    return out, f"{curve}" + (f"; drawn {factor:g} times" if factor != 1.0 else "")


def _of_history(model: Assembly, history: Any, factor: float, most: int) -> tuple[list[ScenePose], str]:
    out = []
    for k in _spread(len(history.shift), most):
        at = {c: float(history.scalars[c][k]) for c in ("multiplier", "time") if c in history.scalars}
        out.append(_moved(model, history, k, factor, f"sample {k}" + "".join(f", {c} {v:.4g}" for c, v in at.items())))
    return out, f"history, {history.status}" + (f"; drawn {factor:g} times" if factor != 1.0 else "")


def _spread(count: int, most: int) -> list[int]:
    rows: Index = np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))
    return [int(k) for k in rows]


def _moved(model: Assembly, state: Any, sample: int, factor: float, caption: str) -> ScenePose:
    if hasattr(state, "turn"):  # of a capacity curve: displacements and R - I
        shift, turn = state.shift, Rotation.from_matrix(np.eye(3) + state.turn).as_rotvec()
        if shift.shape != (model.n_blocks, 3):
            raise InputError(f"positions of {len(shift)} blocks do not belong to the {model.n_blocks} of this assembly")
    else:
        shift, turn = moved_blocks(model, state, sample)
    return ScenePose(factor * shift, rotation_matrices(factor * turn), caption)


def _solids(model: Assembly) -> dict[str, Any]:
    """Triangles and edges of all blocks with the block that owns each vertex."""
    corners, normals, owner, lines, line_owner = [], [], [], [], []
    for i, block in enumerate(model.blocks):
        for part in block.parts:
            for face in part.faces:
                points = part.vertices[list(face)]
                normal, _ = face_planes(points[None])
                for j in range(1, len(face) - 1):
                    corners += [points[0], points[j], points[j + 1]]
                    normals += [normal[0]] * 3
                    owner += [i] * 3
        tolerance = 1e-6 * float(np.ptp(block.bounds, axis=0).max())
        for edges in visible_edges(block.parts, tolerance):
            for edge in edges:
                lines += [edge.start, edge.end]
                line_owner += [i, i]
    low, high = free_bounds(model)
    heavy = [f"{b.mass:.4g} kg" for b in model.blocks]
    return {
        "vertices": _text(corners),
        "normals": _text(normals),
        "owner": _text(owner),
        "lines": _text(lines),
        "line_owner": _text(line_owner),
        "centroids": _text(model.centroids),
        "names": [b.name or f"block {i}" for i, b in enumerate(model.blocks)],
        "notes": [f"{m}, held" if model.held[i].any() else m for i, m in enumerate(heavy)],
        "held": [bool(h) for h in model.fixed],
        "size": float(np.linalg.norm(high - low)),
        "centre": [float(v) for v in 0.5 * (low + high)],
        "low": [float(v) for v in low],
        "high": [float(v) for v in high],
    }


def _arrows(model: Assembly, prediction: Prediction) -> Array:
    """Joint forces as slender double cones through the centres of pressure, triangles as vertices, shape (3 t, 3)."""
    found = joint_forces(model, prediction)
    rows = np.flatnonzero(found.carries)
    if not len(rows):
        return np.zeros((0, 3))
    force, place = found.force[rows], found.centre[rows]
    size = np.linalg.norm(force, axis=1)
    along = force / size[:, None]
    half = 0.06 * structure_size(model) * size / size.max()
    helper = np.where(np.abs(along[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = np.cross(along, helper)
    across /= np.linalg.norm(across, axis=1)[:, None]
    width = 0.0045 * structure_size(model)
    third = np.cross(along, across)
    ring = [across, third, -across, -third]
    out = []
    for k, a in enumerate(ring):
        b = ring[(k + 1) % 4]
        for end in (-1.0, 1.0):
            tip = place + end * half[:, None] * along
            out.append(np.stack([tip, place + width * a, place + width * b], axis=1))
    return np.concatenate(out).reshape(-1, 3)


def _front(model: Assembly) -> float:
    """Azimuth of a viewer who looks straight at a single-leaf wall.

    Along y otherwise [rad].
    """
    plane = wall_plane(model)
    if plane is None:
        return float(-np.pi / 2)
    towards = np.cross(plane.axis_1, plane.axis_2)
    return float(np.arctan2(towards[1], towards[0]))


def _poses(frame: ScenePose) -> Array:
    """Displacement and rotation matrix of every block, row by row, shape (n, 12)."""
    return np.concatenate([frame.shift, frame.rotation.reshape(-1, 9)], axis=1)


def _text(values: Array | Sequence[Any]) -> str:
    """Numbers as base64 of little-endian single precision."""
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def _page(title: str, subtitle: str, data: dict[str, Any]) -> str:
    here = files("limitmason.figures.scene")
    page = here.joinpath("page.html").read_text(encoding="utf-8")
    script = here.joinpath("scene.js").read_text(encoding="utf-8")
    # within a script element no name may end it or begin a comment, in which its end would not count: no "<" at all
    held = json.dumps(data | {"version": VERSION}, ensure_ascii=False).replace("<", "\\u003c")
    parts = {"title": escape(title), "subtitle": escape(subtitle), "data": held, "script": script}
    # in one pass: a block may be called {{script}}
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found.group(1)], page)
