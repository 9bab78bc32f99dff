"""Blocks that go through each other where a path has no contact point: what its points did not find."""

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity.contacts import PathContacts
from limitmason.capacity.kinematics import Pose
from limitmason.geometry.facing import all_faces
from limitmason.geometry.penetration import near_pairs, penetrations
from limitmason.geometry.polyhedron import Solid
from limitmason.model.assembly import Assembly

DEEP = 0.02
"""Depth beyond that of the pressed springs from which blocks go through each other, over the median block size [-]."""


def deepest(
    assembly: Assembly, c: PathContacts, pose: Pose, force: Array, slack: float
) -> tuple[int, int, float] | None:
    """Numbers of the two blocks that overlap most in a pose, and by how much [m].

    An overlap counts where it is deeper than the springs of the pair's points are pressed. None where no two do. Blocks
    are taken as rigid, in convex pieces. In plane only those pairs count that have no point at all.

    Parameters
    ----------
    c : contact points
    pose : where the blocks are
    force : of the points, normal first, compression positive [N], shape (m, c)
    slack : depth beyond that of the pressed springs from which an overlap counts [m]
    """
    solids: list[Solid] = []
    owner: list[int] = []
    for b, body in enumerate(assembly.blocks):
        x = assembly.centroids[b]
        for part in body.parts:
            arm = part.vertices - x
            solids.append(Solid(part.vertices + pose.shift[b] + arm @ pose.turn[b].T, part.faces))
            owner.append(b)
    of = np.array(owner, np.intp)  # block of every piece
    p, q = near_pairs(solids, of, np.zeros(assembly.n_blocks))
    moves = ~(assembly.fixed[of[p]] & assembly.fixed[of[q]])  # held blocks stay as they were drawn
    p, q = p[moves], q[moves]
    # pairs of blocks by one number each: those with points, and those of the pieces p and q (``near``)
    n = assembly.n_blocks
    pairs, of_point = np.unique(
        np.minimum(c.block_a, c.block_b) * n + np.maximum(c.block_a, c.block_b), return_inverse=True
    )
    pressed = np.zeros(len(pairs) + 1)  # deepest pressed spring of every pair [m]; the last of pairs without a point
    np.maximum.at(pressed, of_point, force[:, 0] / (c.kn * c.area))
    near = np.minimum(of[p], of[q]) * n + np.maximum(of[p], of[q])
    joined = np.isin(near, pairs)
    if c.components == 2:
        p, q, near, joined = p[~joined], q[~joined], near[~joined], joined[~joined]
    tolerance = slack + pressed[np.where(joined, np.searchsorted(pairs, near), len(pairs))]
    faces, start = all_faces(solids)
    found = penetrations(solids, of, faces, start, p, q, tolerance)
    return max(found, key=lambda row: row[2]) if found else None
