"""Faces that go on from one block to the next in one plane: what slides over their edge meets the face, not the side.

A block has sunk into the face that carries it by N / (kn A). Where that face ends and the next block's begins in the
same plane, the block overlaps the next one by that depth and, at first, by less along the way it slides: the least
overlap is against the side (the "internal edge" of collision detection in games). Against the *face that carries it*
the next face is no higher, so it is the one that is met.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dem.kernels import LAW, Joints
from dem.model.state import PointForces, State
from limitmason.arrays import Array, Flags, Index

TURNED = np.cos(np.deg2rad(3.0))
"""Cosine of the angle up to which two faces lie in one plane [-]."""

FLAT = np.cos(np.deg2rad(5.0))
"""Cosine of the angle up to which two faces lie on each other; their contact is an area, not a corner or a crossing."""

LEVEL = 3.0
"""Step between two faces, over the depth to which joints beside them are pressed, that is theirs and not built [-]."""

SAG = 10.0
"""Depth of a face beyond the edge of what carries it, over the depth to which that is pressed, that is elastic [-]."""


class Bearings(NamedTuple):
    """Joints between faces that carry now: rows, normals from a to b, centres of pressure and depths [m]."""

    row: Index
    normal: Array
    place: Array
    depth: Array

    @classmethod
    def of(cls, state: State, now: PointForces, rot: Array, flat: Flags) -> "Bearings":
        """Those of a state.

        ``flat`` are joints between faces that have not turned, shape (k,).
        """
        joints, count = state.joints, len(state.joints.block_a)
        normal = np.einsum("kij,kj->ki", rot[joints.block_a], joints.frame[:, 2])
        push = np.maximum(np.einsum("mi,mi->m", now.force, normal[now.owner]), 0.0)
        total = np.bincount(now.owner, push, count)
        deep = np.zeros(count)
        np.maximum.at(deep, now.owner, push / (joints.law[now.owner, LAW.kn] * state.points.area))
        row = np.flatnonzero(flat & (total > 0.0))
        place = np.stack([np.bincount(now.owner, push * x, count) for x in now.position.T], axis=1)
        return cls(row, normal[row], place[row] / total[row, None], deep[row])


class Poses(NamedTuple):
    """Convex pieces now: blocks, corners [m], and outward normal and offset [m] of faces, zero where there is none."""

    owner: Index
    corners: Array
    planes: Array

    def faces_along(self, piece: int, normal: Array) -> Index:
        """Faces of a piece that look along a normal."""
        return np.flatnonzero(self.planes[piece, :, :3] @ normal > TURNED)


class GoesOn(NamedTuple):
    """A face that a pair of pieces meets on: joint that says so, piece and face, whether the joint is their own."""

    joint: int
    piece: int
    face: int
    own: bool


def goes_on(
    poses: Poses, joints: Joints, bearings: Bearings, of_block: Sequence[Index], pair: tuple[int, int], place: Array
) -> GoesOn | None:
    """Face on which two pieces meet whatever their least overlap says, or None where nothing says so.

    It is the face of one that goes on from a face on which the other is borne, no higher than what the joints
    beside it are pressed by; else the one on which they bear each other now.

    Parameters
    ----------
    of_block : numbers of the bearings of every block
    pair : numbers of the pieces
    place : where they meet [m]
    """
    blocks = [int(poses.owner[piece]) for piece in pair]
    best, rank = None, (False, -np.inf)
    for k in np.unique(np.concatenate([of_block[b] for b in blocks])):
        ends = int(joints.block_a[bearings.row[k]]), int(joints.block_b[bearings.row[k]])
        own = set(ends) == set(blocks)
        for here in (0, 1):
            borne, other = blocks[here], blocks[1 - here]
            if borne not in ends or (own and borne != ends[1]):
                continue
            carrier = ends[1] if borne == ends[0] else ends[0]
            n = bearings.normal[k] if borne == ends[1] else -bearings.normal[k]
            piece = pair[1 - here]
            for face in poses.faces_along(piece, n):
                plane = poses.planes[piece, face]
                gap = float((poses.corners[pair[here]] @ plane[:3]).min() - plane[3])
                if gap < -SAG * bearings.depth[k] or (not own, gap) <= rank:
                    continue
                if not own:
                    step = _step(poses, carrier, n, bearings.place[k], plane, place)
                    near = np.unique(np.concatenate([of_block[b] for b in (borne, other, carrier)]))
                    near = near[np.abs(bearings.normal[near] @ n) > TURNED]
                    if step > LEVEL * bearings.depth[near].max():
                        continue
                best, rank = GoesOn(int(bearings.row[k]), piece, int(face), own), (not own, gap)
    return best


def _step(poses: Poses, carrier: int, n: Array, borne_at: Array, plane: Array, place: Array) -> float:
    """How much higher a plane lies at a place than the carrier's face, along n [m], or infinite where it has none."""
    nearest, height = np.inf, -np.inf
    for piece in np.flatnonzero(poses.owner == carrier):
        for face in poses.faces_along(int(piece), n):
            own = poses.planes[piece, face]
            off = abs(float(own[:3] @ borne_at - own[3]))
            if off < nearest:
                nearest, height = off, (own[3] - own[:3] @ place) / (own[:3] @ n)
    return float((plane[3] - plane[:3] @ place) / (plane[:3] @ n) - height)


def moved_together(joints: Joints, bearings: Bearings, worn: Flags, slip: Array, near: float) -> list[tuple[int, int]]:
    """Joints on one face of a block that have slipped with an outworn one on that face: pairs (outworn, other).

    Cut anew together, what the one loses of the face at the edge is what the other gains.

    Parameters
    ----------
    worn, slip : of every joint, slip [m], shape (k,)
    near : distance of two planes up to which they are one [m]
    """
    out: list[tuple[int, int]] = []
    ends = np.stack([joints.block_a, joints.block_b], axis=1)[bearings.row]
    order = np.argsort(ends.ravel(), kind="stable")
    sorted_ends = ends.ravel()[order]
    for k in np.flatnonzero(worn[bearings.row]).tolist():
        for side in (0, 1):
            low, high = np.searchsorted(sorted_ends, (ends[k, side], ends[k, side] + 1))
            at, end = np.divmod(np.sort(order[low:high]), 2)
            # normals towards the shared block
            towards = np.where(end == 1, 1.0, -1.0)[:, None] * bearings.normal[at]
            mine = (1.0 if side else -1.0) * bearings.normal[k]
            beside = (towards @ mine > FLAT) & (at != k)
            beside &= np.abs((bearings.place[at] - bearings.place[k]) @ mine) < near
            beside &= slip[bearings.row[at]] >= 0.5 * slip[bearings.row[k]]
            out += [(int(bearings.row[k]), int(r)) for r in bearings.row[at[beside]]]
    return out
