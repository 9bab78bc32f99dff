"""Scene of a structure in one HTML file: turn it, cut it, follow its motion.

The file needs neither network nor server. What is drawn is the model itself: faces of the blocks, moved by the frames
of a mechanism, of a capacity curve or of a history, and the forces of the joints.

``model`` is the assembly, ``most`` and ``count`` are poses that are shown at most.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.arrays import Array
from limitmason.checks import count, instance, positive, several
from limitmason.constants import VERSION
from limitmason.errors import InputError
from limitmason.figures.assembly_in_space import block_size
from limitmason.figures.canvas import resultant
from limitmason.figures.deformation import largest_movement, moved_blocks, rigid_motion, spread
from limitmason.figures.outline import visible_edges, wall_plane
from limitmason.figures.painter import VIEWPOINT_DEG, viewpoint
from limitmason.figures.scene.beside import SceneMotion, ScenePose, scene_origin, side_by_side, together
from limitmason.figures.style import force_text, round_length
from limitmason.geometry.polyhedron import face_plane
from limitmason.mechanics.joint_forces import joint_forces
from limitmason.mechanics.rigid_motion import checked_twists, drawn_motion, free_bounds, largest_rates, structure_size
from limitmason.model import Assembly
from limitmason.storage.files import named_path, write_text
from limitmason.vibration import Modes

_SEEN = 0.05
"""Largest displacement of a path over the size of the structure as the page first shows it [-]."""

_REACH = 0.12
"""Largest displacement of a mechanism or a mode over the size of the structure where no scale is given [-]."""

_GROWTH = 25
"""Most positions of a mechanism, which grows along straight lines and arcs: more are not seen."""

_SWING = 24
"""Positions in one swing of a mode."""


def view(
    model: Assembly | Sequence[Assembly],
    what: Any = None,
    path: str | Path | None = None,
    *,
    title: str | None = None,
    scale: float | None = None,
    frames: int = 60,
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
) -> Scene:
    """Scene of a structure and an answer as one self-contained HTML file.

    It shows the motion at a scale to choose, joints that open or slide, the live load and the joint forces.

    Parameters
    ----------
    model : the assembly; or several, which then stand side by side
    what : nothing; a prediction (its mechanism, growing, and its joint forces); a capacity curve of this assembly; a
        history of ``dem.simulate``; modes of ``lm.modes``, one after the other; or a state. Of several assemblies a
        list with one for each, or nothing
    path : file to write; without one the scene is only returned (a notebook shows it; ``save`` writes it)
    title : of the page, "limitmason" by default; what is shown stands under it
    scale : of a mechanism or a mode: largest displacement over the structure's size [-], 0.12 by default; of a path:
        factor on displacements and rotations that the page begins with [-], by default so that the largest can be seen
    frames : most positions that the file holds; a mechanism has at most 25, and every mode has 24
    viewpoint_deg : azimuth, from x towards y, and elevation of the viewer at first [deg]

    Returns
    -------
    Scene
        ``save(path)`` writes the file; its text is ``html``.

    Raises
    ------
    InputError
        For an answer of another assembly, a curve that kept no states, or settings that make no sense.
    """
    most = count("frames", frames)
    azimuth, elevation = np.radians(viewpoint(viewpoint_deg)).tolist()
    if scale is not None:
        positive("scale", scale)
    if isinstance(model, list | tuple):
        shown = [what] * len(model) if what is None else what
        if not model or not isinstance(shown, list | tuple) or len(shown) != len(model):
            raise InputError("of several assemblies give a list of answers, one for each (None where there is none)")
        each = [_positions(m, w, scale, most) for m, w in zip(several("model", model, Assembly), shown, strict=True)]
        whole, motion = side_by_side(model), together(each)
    else:
        whole = instance("model", model, Assembly, "write view(model, what)")
        motion = _positions(whole, what, scale, most)
    answer = what if isinstance(what, Prediction) else None
    push = None if answer is None else resultant(whole, answer.loads)
    origin = scene_origin(whole)
    data = _solids(whole, motion, origin) | {
        "motion": _text([np.concatenate([p.shift, p.turn], axis=1) for p in motion.poses]),
        "captions": [p.caption for p in motion.poses],
        "start": motion.start,
        "scale": motion.scale,
        "crack": motion.crack,
        "joints": _joints(whole, origin),
        "forces": _forces(whole, answer, origin),
        "push": [] if push is None else np.concatenate([push[0] - origin, push[1]]).tolist(),
        "azimuth": azimuth,
        "elevation": elevation,
        "front": _front(whole),
    }
    words = [motion.title, f"{whole.n_blocks} blocks, {len(whole.interfaces)} joints"]
    scene = Scene(_page(title or "limitmason", " · ".join(w for w in words if w), data))
    if path is not None:
        scene.save(path)
    return scene


class Scene:
    """An interactive scene: ``html`` is the page, which a notebook shows in a frame."""

    def __init__(self, html: str) -> None:
        self.html = html

    def save(self, path: str | Path) -> Path:
        """Write the page to a file (.html) and return its path."""
        page = named_path(path)
        if page.suffix.lower() not in (".html", ".htm"):
            raise InputError(f"{path}: a scene is a page, its name ends in .html; plot().savefig draws a picture")
        return write_text(page, self.html)

    def __repr__(self) -> str:
        return f"Scene of {len(self.html) / 1e3:.0f} kB; .save('scene.html') and open it in a browser"

    def _repr_html_(self) -> str:
        """The scene in a frame of its own, for a notebook."""
        return (
            f'<iframe srcdoc="{escape(self.html, quote=True)}" '
            'style="width: 100%; height: 32rem; border: 1px solid #ddd"></iframe>'
        )


def _positions(model: Assembly, what: Any, scale: float | None, most: int) -> SceneMotion:
    """Poses of the blocks to be shown one after the other.

    Parameters
    ----------
    what : prediction, curve, history, modes or state; None for rest
    scale, most : as in :func:`view`, where ``most`` is called frames; no scale chooses one
    """
    rest = ScenePose(np.zeros((model.n_blocks, 3)), np.zeros((model.n_blocks, 3)), "")
    if what is None:
        return SceneMotion([rest])
    if isinstance(what, Prediction):
        # a support that gives way has a reaction in place of a multiplier
        told = f"λ = {what.collapse_multiplier:.4g}" if what.reaction is None else what.answer
        line = f"{what.method}: {told} ({what.status})"
        if what.mechanism is None:
            return SceneMotion([rest], line)
        return _of_mechanism(model, what, line, _REACH if scale is None else scale, min(most, _GROWTH))
    if isinstance(what, Modes):
        return _of_modes(model, what, _REACH if scale is None else scale)
    if isinstance(what, Curve):
        poses, line, start = _of_curve(model, what, most)
    elif len(getattr(what, "shift", ())) and np.ndim(what.shift) == 3:  # a history: samples of all blocks
        poses, line = _of_history(model, what, most), f"history, {what.status}, seen from the ground"
        start = len(poses) - 1
    else:
        poses, line, start = [_moved(model, what, sample=0, caption="")], "", 0
    unscaled = [rigid_motion(model, p.shift, p.turn, scale=1.0) for p in poses]
    joints = max((largest_movement(model, motion) for motion in unscaled), default=0.0)  # widest opening or slip [m]
    travel = max(float(np.abs(p.shift).max(initial=0.0)) for p in poses)
    if scale is None:
        scale = max(round_length(_SEEN * structure_size(model) / travel), 1.0) if travel > 0.0 else 1.0
    # marked from a tenth of the widest joint on, never later than from a hundredth of the structure, and above rounding
    crack = max(min(0.1 * joints, 0.01 * structure_size(model)), 1e-9 * structure_size(model))
    return SceneMotion(poses, line, start, scale, crack)


def _of_mechanism(model: Assembly, prediction: Prediction, line: str, scale: float, count: int) -> SceneMotion:
    """Poses of a mechanism, ``count`` of them from rest on, the last one shown first.

    Parameters
    ----------
    line : what the scene is called
    scale : largest displacement at the end over the size of the structure [-]
    """
    twists = checked_twists(model, prediction)
    poses = []
    for share in np.linspace(0.0, 1.0, max(count, 2)):
        motion = drawn_motion(model, twists, max(scale * share, 1e-9))  # at rest a scale of zero would be refused
        turn = Rotation.from_matrix(motion.rotation).as_rotvec()
        poses.append(ScenePose(motion.translation, turn, f"mechanism, {100 * share:.0f} %"))
    return SceneMotion(poses, line, len(poses) - 1, crack=0.01 * scale * structure_size(model))


def _of_modes(model: Assembly, modes: Modes, scale: float) -> SceneMotion:
    """Poses of one period of every mode in turn, the first mode shown at its largest.

    Parameters
    ----------
    scale : largest displacement over the size of the structure [-]
    """
    shape = np.asarray(modes.shape)
    if shape.shape[1] != model.n_blocks or shape.shape[2] < 6:
        raise InputError(f"modes of {shape.shape[1]} places do not belong to the {model.n_blocks} blocks here")
    poses = []
    for k, (motion, hertz) in enumerate(zip(shape, modes.frequency, strict=True), 1):
        motion = motion * scale * structure_size(model) / largest_rates(model, motion[:, :6]).max()
        for phase in np.sin(2.0 * np.pi * np.arange(_SWING) / _SWING):
            poses.append(ScenePose(phase * motion[:, :3], phase * motion[:, 3:6], f"mode {k}, {hertz:.4g} Hz"))
    largest = _SWING // 4  # a quarter of a period
    return SceneMotion(poses, f"{len(modes)} modes of {modes.system.label}", largest)


def _of_curve(model: Assembly, curve: Curve, most: int) -> tuple[list[ScenePose], str, int]:
    """At most ``most`` poses of a curve: what they are, and which is shown first.

    Returns
    -------
    poses : of the samples
    line : what is shown of each, in words
    first : number of the pose to begin with: the peak, or the end where little has moved at the peak
    """
    if not len(curve.states):
        raise InputError("this curve kept no states: there is nothing to draw")

    def said(k: int) -> str:
        """Load and displacement of the sample of number k, with units that fit them."""
        load = f"{curve.load[k]:.4g}"
        if curve.load_unit == "N":
            load = force_text(curve.load[k])
        elif curve.load_unit == "-":
            load = f"λ = {load}"
        else:
            load += f" {curve.load_unit}"
        length = {"m": 1e3, "mm": 1.0}.get(curve.displacement_unit)
        along = f"{curve.displacement[k]:.3g} {curve.displacement_unit}"
        along = along if length is None else f"{length * curve.displacement[k]:.3g} mm"
        return f"{load} at {along}"

    rows, peak = spread(len(curve), most), int(curve.peak.index)
    # the peak is among the samples shown, in place of the one nearest to it
    rows[int(np.argmin(np.abs(np.array(rows) - peak)))] = peak
    poses = [_moved(model, curve.states[k], sample=0, caption=said(k)) for k in rows]
    travel = [float(np.abs(pose.shift).max(initial=0.0)) for pose in poses]
    # chosen: at less than a tenth of the way nothing would be seen to move
    start = rows.index(peak) if travel[rows.index(peak)] > 0.1 * max(travel) else len(rows) - 1
    return poses, f"{curve.label or 'curve'}: largest {said(peak)}", start


def _of_history(model: Assembly, history: Any, most: int) -> list[ScenePose]:
    """Poses of a history with time or multiplier, seen from the ground."""
    # what is said of a sample: the time of a dynamic run, as others count steps, and a multiplier that is not zero
    words = {"multiplier": "λ = {:.4g}"}
    if getattr(getattr(history, "state", None), "mode", "") == "dynamic":
        words = {"time": "{:.3g} s"} | words
    told = {c: w for c, w in words.items() if c in history.scalars and np.any(history.scalars[c])}
    poses = []
    for k in spread(len(history.shift), most):
        said = [w.format(float(history.scalars[c][k])) for c, w in told.items()] or [f"sample {k}"]
        pose = _moved(model, history, k, ", ".join(said))
        ground = pose.shift[model.fixed]
        # what carries everything, as the ground of a record, is taken away
        common = ground[0] if len(ground) and np.ptp(ground, axis=0).max() < 1e-9 else 0.0  # [m]: moves as one
        poses.append(pose._replace(shift=pose.shift - common))
    return poses


def _moved(model: Assembly, state: Any, sample: int, caption: str) -> ScenePose:
    """Pose of a state, or of a history at a sample, with its ``caption``."""
    return ScenePose(*moved_blocks(model, state, sample), caption)


def _solids(model: Assembly, motion: SceneMotion, origin: Array) -> dict[str, Any]:
    """What the page's script draws of blocks, by name: triangles, edges, names, frame.

    Arrays are base64 of single precision: "vertices" three corners of every triangle with the "normals" there, "lines"
    two ends of every edge [m], each with the block that owns it. "centre" and "size" are those of what is framed,
    "low" and "high" the ends of the free blocks.

    Parameters
    ----------
    motion : positions that the blocks take, which are framed too
    origin : from which corners are measured [m], shape (3,)
    """
    corners, normals, owner, lines, line_owner = [], [], [], [], []
    for i, block in enumerate(model.blocks):
        for points in block.faces:
            normal, _ = face_plane(points)
            for j in range(1, len(points) - 1):  # a fan about the first corner: faces are convex
                corners += [points[0], points[j], points[j + 1]]
                normals += [normal] * 3
                owner += [i] * 3
        # of cuts within a block, whose corners differ by rounding alone
        tolerance = 1e-6 * float(np.ptp(block.bounds, axis=0).max())
        for edges in visible_edges(block.parts, tolerance):
            for edge in edges:
                lines += [edge.start, edge.end]
                line_owner += [i, i]
    low, high = free_bounds(model)
    free = ~model.fixed
    centres = [model.centroids[free] + max(motion.scale, 1.0) * pose.shift[free] for pose in motion.poses]
    # what holds them is framed too, a wide ground as far as a quarter of the structure about it
    every, aside = np.array([b.bounds for b in model.blocks]), 0.25 * float((high - low).max())
    held = np.clip([every[:, 0].min(axis=0), every[:, 1].max(axis=0)], low - aside, high + aside)
    framed = np.vstack([low, high, held, *centres])
    masses = [f"{b.mass:.4g} kg" for b in model.blocks]
    return {
        "vertices": _text(np.array(corners) - origin),
        "normals": _text(normals),
        "owner": _text(owner),
        "lines": _text(np.array(lines) - origin),
        "line_owner": _text(line_owner),
        "centroids": _text(model.centroids - origin),
        "names": [b.name or f"block {i}" for i, b in enumerate(model.blocks)],
        "notes": [f"{m}, held" if model.held[i].any() else m for i, m in enumerate(masses)],
        "held": [bool(h) for h in model.fixed],
        "size": float(np.linalg.norm(np.ptp(framed, axis=0))),
        "centre": [float(v) for v in 0.5 * (framed.min(axis=0) + framed.max(axis=0)) - origin],
        "low": [float(v) for v in low - origin],
        "high": [float(v) for v in high - origin],
    }


def _joints(model: Assembly, origin: Array) -> dict[str, Any]:
    """Outlines of joints by name: "corners" [m], "normals" a to b, blocks, "count"."""
    x = model.arrays
    return {
        "corners": _text(x.corners - origin), "normals": _text(x.normal),
        "a": x.block_a.tolist(), "b": x.block_b.tolist(), "count": np.diff(x.corner_start).tolist(),
    }


def _forces(model: Assembly, answer: Prediction | None, origin: Array) -> dict[str, Any]:
    """Joint forces, a row each: ends of a line along it [m], share, friction limit.

    The share is that of the largest force [-], which "largest" has in words. Both are empty without forces.
    """
    if answer is None or answer.resultants is None:
        return {"rows": "", "largest": ""}
    found = joint_forces(model, answer)
    rows = np.flatnonzero(found.carries)  # without a force there is no direction
    size = np.linalg.norm(found.force[rows], axis=1)
    # lines as long as figures.contact_forces draws them: 0.9 of a block
    half = 0.45 * block_size(model) * found.force[rows] / size[:, None]
    share = size[:, None] / size.max(initial=1e-300)
    centre = found.centre[rows] - origin
    ends = centre - half, centre + half
    return {
        "rows": _text(np.concatenate([*ends, share, found.at_friction_limit[rows, None]], axis=1)),
        "largest": force_text(float(size.max(initial=0.0))),
    }


def _front(model: Assembly) -> float:
    """Azimuth [rad] of a viewer in front of a single-leaf wall, else looking along +y."""
    plane = wall_plane(model)
    if plane is None:
        return float(-np.pi / 2)
    towards = np.cross(plane.axis_1, plane.axis_2)
    return float(np.arctan2(towards[1], towards[0]))


def _text(values: Array | Sequence[Any]) -> str:
    """Numbers as base64 of little-endian single precision."""
    return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def _page(title: str, subtitle: str, data: dict[str, Any]) -> str:
    """The page with title, subtitle and data filled in."""
    here = files("limitmason.figures.scene")
    page = here.joinpath("page.html").read_text(encoding="utf-8")
    script = here.joinpath("scene.js").read_text(encoding="utf-8")
    # within a script element no name may end it or begin a comment, in which its end would not count: no "<" at all
    held = json.dumps(data | {"version": VERSION}, ensure_ascii=False).replace("<", "\\u003c")
    parts = {"title": escape(title), "subtitle": escape(subtitle), "data": held, "script": script}
    # in one pass: a block may be called {{script}}
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found.group(1)], page)
