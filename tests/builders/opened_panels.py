"""The panels with an opening: a specimen of them, and what its elastic state says of settlement and first failure."""

import numpy as np
from scipy.sparse.linalg import splu

import dem
import limitmason as lm
from dem.driving.pace import tangent
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.plane import find_plane

NAME = "brick-panels-opening"


def load(specimen, **options):
    return lm.experiments.load(NAME, specimen, **options)


def elastic(test):
    """Settlement of the spreader by own weight and by 1 kN [mm], and the first-failure loads [kN] for three ft."""
    wall = with_lumped_units(test.assembly())
    loads = test.loads()
    state = dem.initial_state(wall, loads, contact_points=0.0375, plane=find_plane(wall, loads))
    k, plate = tangent(wall, state), wall.block_index("spreader")
    free = np.flatnonzero(~state.bodies.held.ravel())
    u = np.zeros((k.shape[0], 2))
    u[free] = splu(k[free][:, free].tocsc()).solve(np.stack([loads.dead.ravel(), loads.live.ravel()], axis=1)[free])
    p, j = state.points, state.joints
    owner = np.repeat(np.arange(len(j.block_a)), np.diff(j.start))
    frame, pull = j.frame[owner], []
    for column in u.T.reshape(2, -1, 6):
        opening = 0.0
        for block, arm, sign in ((j.block_a, j.arm_a, -1.0), (j.block_b, j.arm_b, 1.0)):
            r = arm[owner] + p.s[:, None] * frame[:, 0] + p.t[:, None] * frame[:, 1]
            b = block[owner]
            moved = column[b, :3] + np.cross(column[b, 3:], r)
            opening = opening + sign * np.einsum("ij,ij->i", moved, frame[:, 2])
        pull.append(j.law[owner, 0] * opening)
    grows = pull[1] > 1.0
    first = [float(((ft - pull[0][grows]) / pull[1][grows]).min()) for ft in (5e4, 1e5, 1.5e5)]
    return -1e3 * u[6 * plate + 2], np.array(first)
