"""Positions that a scene shows, from where they are measured, and those of several structures side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.mechanics.rigid_motion import free_bounds
from limitmason.model import Assembly, Block, Interface, Support

_APART = 0.3
"""Distance between two structures over the extent of the first [-]."""

_FAR = 100.0
"""Distance from the origin over the size of the structure from which on a page measures from its middle; chosen."""


class ScenePose(NamedTuple):
    """One position of all blocks, and ``caption``, what is said of it.

    ``shift`` are displacements of the centroids [m], ``turn`` rotation vectors [rad], shape (n, 3) each.
    """

    shift: Array
    turn: Array
    caption: str


class SceneMotion(NamedTuple):
    """Positions in their order.

    ``title`` says what they are in one line, ``start`` is shown at first. ``scale`` is the factor on displacements, 0
    where there is none to choose. Joints that move by more than ``crack`` [m] are marked.
    """

    poses: list[ScenePose]
    title: str = ""
    start: int = 0
    scale: float = 0.0
    crack: float = 0.0


def scene_origin(model: Assembly) -> Array:
    """Point from which the page measures [m], shape (3,): that of the model, or the middle of one far away from it.

    Single precision holds map coordinates, 5,300 km from their origin, to half a metre only.
    """
    low, high = free_bounds(model)
    far = np.abs([low, high]).max() > _FAR * np.ptp([low, high], axis=0).max()
    return np.asarray(0.5 * (low + high)) if far else np.zeros(3)


def side_by_side(models: Sequence[Assembly]) -> Assembly:
    """Several structures as one, side by side, without joints between them.

    They stand in a row along the longer horizontal side of the first. Blocks are called "1: name", "2: name" ...
    """
    corners = [np.vstack([b.bounds for b in m.blocks]) for m in models]
    axis = int(np.argmax(np.ptp(corners[0], axis=0)[:2]))
    apart = _APART * float(np.ptp(corners[0], axis=0).max())
    blocks: list[Block] = []
    interfaces: list[Interface] = []
    supports: list[Support] = []
    end = float(corners[0][:, axis].min())
    for k, (model, points) in enumerate(zip(models, corners, strict=True), 1):
        # each begins where the one before it ends, and a gap after it
        along = np.zeros(3)
        along[axis] = end - points[:, axis].min()
        end += float(np.ptp(points[:, axis])) + apart
        moved, first = model.transformed(np.eye(3), along), len(blocks)
        supports += [replace(s, block=f"{k}: {model.blocks[model.block_index(s.block)].name}") for s in model.supports]
        interfaces += [replace(i, block_a=i.block_a + first, block_b=i.block_b + first) for i in moved.interfaces]
        blocks += [replace(b, name=f"{k}: {b.name}") for b in moved.blocks]
    return Assembly(tuple(blocks), tuple(interfaces), tuple(supports))


def together(motions: Sequence[SceneMotion]) -> SceneMotion:
    """Motions of several structures at once, each from its first to its last position.

    One factor on displacements is left to choose where all of them have one, else each has its own factor applied. A
    structure with fewer positions takes several frames for each.

    Parameters
    ----------
    motions : one of each structure
    """
    count = max(len(m.poses) for m in motions)
    shared = min(m.scale for m in motions)  # zero as soon as one has no factor to choose
    poses = []
    for k in range(count):
        part = k / max(count - 1, 1)
        now = [m.poses[round(part * (len(m.poses) - 1))] for m in motions]
        own = [1.0 if shared or not m.scale else m.scale for m in motions]
        poses.append(
            ScenePose(
                np.concatenate([f * p.shift for f, p in zip(own, now, strict=True)]),
                np.concatenate([f * p.turn for f, p in zip(own, now, strict=True)]),
                " | ".join(p.caption or "at rest" for p in now),
            )
        )
    crack = max(m.crack * (1.0 if shared or not m.scale else m.scale) for m in motions)
    return SceneMotion(poses, " | ".join(m.title or "structure" for m in motions), count - 1, shared, crack)
