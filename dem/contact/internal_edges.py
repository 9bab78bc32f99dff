"""Faces that go on from one block to the next in one plane: what slides over their edge meets the face, not the side.

A block has sunk into the face that carries it by N / (kn A). Where that face ends and the next block's begins in the
same plane, the block overlaps the next one by that depth and, at first, by less along the way it slides: the least
overlap is against the side (the "internal edge" of collision detection in games). Against the *face that carries it*
the next face is no higher, so it is the one that is met.
"""

from typing import NamedTuple

import numpy as np

from dem.kernels import LAW, Carrying, Joints
from dem.model.state import PointForces, State
from limitmason.arrays import Array, Flags, Index

FLAT = np.cos(np.deg2rad(5.0))
"""Cosine of the angle up to which two faces lie on each other; their contact is an area, not a corner or a crossing."""


class Bearings(NamedTuple):
    """Joints between faces that carry now: rows, normals from a to b, centres of pressure and depths [m]."""

    row: Index
    normal: Array
    place: Array
    depth: Array

    @classmethod
    def of(cls, state: State, now: PointForces, rot: Array, flat: Flags) -> "Bearings":
        """Joints of a state that press, with their normals, centres of pressure and depths.

        Parameters
        ----------
        now : contact forces of the state
        rot : rotation matrices of the blocks, shape (n, 3, 3)
        flat : joints between faces that have not turned, shape (k,)
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


    def carrying(self, joints: Joints, n_blocks: int) -> Carrying:
        """The same with the blocks they are between, and those of every block."""
        ends = np.column_stack([joints.block_a[self.row], joints.block_b[self.row]])
        blocks = np.concatenate(ends.T)
        number = np.tile(np.arange(len(self.row)), 2)
        order = np.lexsort((number, blocks))
        start = np.searchsorted(blocks[order], np.arange(n_blocks + 1))
        return Carrying(ends, self.normal, self.place, self.depth, number[order], start)


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
