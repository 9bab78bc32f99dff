"""The floor under a structure in motion: what fell to it lies and goes with it."""

import numpy as np

from dem.contact.near import near_margin
from dem.kernels import E_DAMPING, E_KINETIC
from dem.kernels.arrays import Index
from dem.model.pieces import reaches
from dem.model.state import State
from limitmason.arrays import Array, Flags
from limitmason.model import Assembly

_NO_SUM = 1e-9  # of the sizes of all loads: a sum below is rounding, and tells no direction [-]
_UPRIGHT = 0.5  # an axis within 60 degrees of up must be held for a block to be a support [-]; chosen


class Floor:
    """Level to which blocks fall that nothing holds.

    It is the lowest corner of the supports, down being where the dead loads pull. Where other blocks reach as low from
    the start, the structure spans or hangs and its floor is not known: it is taken one size of the structure lower.

    Parameters
    ----------
    assembly : where it stood before it moved
    dead : its dead loads [N, N m], shape (n, 6); where they have no sum nothing falls, and there is no floor

    Attributes
    ----------
    up : unit vector against the dead loads, shape (3,)
    margin : gap up to which blocks count as near [m]
    level : height of the floor along ``up`` before the ground moves, with the margin added [m]
    standing : whether each block is a support, which the ground carries, shape (n,)
    reach : of every block from its centroid to its farthest corner [m], shape (n,)
    """

    def __init__(self, assembly: Assembly, dead: Array) -> None:
        """Find up and the level of the floor, with arguments as the class names them."""
        self.assembly, self.reach = assembly, reaches(assembly)
        total = dead[~assembly.fixed, :3].sum(axis=0)
        pulls = float(np.linalg.norm(total)) > _NO_SUM * float(np.abs(dead[:, :3]).sum())
        self.up = -total / np.linalg.norm(total) if pulls else np.array([0.0, 0.0, 1.0])
        # a support is held along each axis that is about upright; the others do not matter
        held = assembly.held[:, :3] | (np.abs(self.up) < _UPRIGHT)
        self.standing, self.margin = held.all(axis=1), near_margin(assembly)
        vertices, start = assembly.vertices
        height = vertices @ self.up
        lowest = np.minimum.reduceat(height, start[:-1])  # of every block
        self.level = float(lowest[self.standing].min(initial=np.inf)) + self.margin
        if not pulls:
            self.level = -np.inf  # nothing falls
        elif not lowest[~self.standing].min(initial=np.inf) > self.level:
            # what hangs below its supports has a floor deeper down, a size of the structure below its lowest corner
            self.level = float(lowest.min() - np.linalg.norm(np.ptp(vertices, axis=0))) + self.margin

    def landed(self, state: State) -> Index:
        """Numbers of blocks on the floor, up to the gap at which blocks count as near."""
        bodies, assembly = state.bodies, self.assembly
        rise = bodies.shift @ self.up
        ground = rise[self.standing].mean() if self.standing.any() else 0.0
        # height of the floor above every centroid [m]: only blocks whose corners reach so far down can touch it
        floor = self.level + ground - assembly.centroids @ self.up - rise
        vertices, start = assembly.vertices
        found = []
        for k in np.flatnonzero(~self.standing & (self.reach > -floor)):
            local = vertices[start[k] : start[k + 1]] - assembly.centroids[k]
            # rot is the rotation less the unit matrix
            if (local @ (self.up @ bodies.rot[k] + self.up)).min() <= floor[k]:
                found.append(k)
        return np.array(found, dtype=np.intp)

    def hold_landed(self, state: State, held: Flags) -> Index:
        """Hold the blocks that have landed; the impact takes their kinetic energy.

        Parameters
        ----------
        state : changed in place
        held : freedoms that stay held when the stage ends, shape (n, 6), changed in place

        Returns
        -------
        Index
            Numbers of the blocks that have landed since the last call.
        """
        new = self.landed(state)
        new = new[~state.bodies.held[new].all(axis=1)]
        if len(new):
            before = state.energy_of_motion()
            state.bodies.held[new] = held[new] = True
            lost = before - state.energy_of_motion()
            for motion in (state.bodies.vel, state.bodies.spin, state.bodies.ang):
                motion[new] = 0.0
            state.total[E_DAMPING] += lost
            state.total[E_KINETIC] -= lost
        return new
