"""Unbalanced forces and displacements, over what a block carries, weighs and measures.

Whether blocks rest is decided with them: in ``dem.stages.stage_run`` where they settle, in ``rest_or_collapse`` under
a load.
"""

from dataclasses import dataclass, replace

import numpy as np

from dem import kernels
from dem.model.state import State
from limitmason.arrays import Array, Flags
from limitmason.constants import GRAVITY
from limitmason.model import Assembly

CALM = 1e-2
"""Kinetic over elastic energy up to which motion is steady, and combined damping acts where it is asked for [-].

Local damping drags on blocks that slide or turn on steadily while their joints chatter, and a push then carries too
much. After a brittle drop it brings the blocks to rest sooner.
"""

NO_WEIGHT = 1.0
"""Own load of a block per volume, as a density [kg/m3], up to which it counts as none."""

SLID = 0.005
"""Slip over the largest displacement from which loads that came on at once are pointed out, or come on again [-]."""

EVENLY = 1000
"""Fewest steps over which loads come on evenly: none of 60 small structures then rested more than 1 % elsewhere."""


ROUNDING = 1e-7
"""Part of the forces that press a block below which no balance of it can be told from rounding [-]."""

LIGHT = 1e-6
"""Own load over the largest of a block up to which it is asked how much presses a block; chosen [-]."""


def restless(state: State, calm: float) -> bool:
    """Whether the kinetic energy is above ``calm`` times the elastic one."""
    return bool(state.total[kernels.E_KINETIC] > calm * state.forces().elastic_energy)


@dataclass(frozen=True)
class Scale:
    """What unbalanced forces and displacements are small against.

    Parameters
    ----------
    load : own load of every block [N], shape (n,)
    arm : lever arm its moments are small against, its least thickness [m], shape (n,)
    size : cube root of its volume [m], shape (n,)
    free : degrees of freedom that are not held, shape (n, 6)
    smallest : smallest dimension of a free block [m]
    """

    load: Array
    arm: Array
    size: Array
    free: Flags
    smallest: float

    @classmethod
    def of(cls, assembly: Assembly, wrench: Array) -> "Scale":
        """Scale of an assembly under the loads ``wrench`` of every block.

        They are forces [N], moments [N m] and perhaps arms, see ``Loads.rows``, shape (n, 6 or 15).
        """
        arm, moves = _least_thickness(assembly), ~assembly.held
        load, free = _own_load(wrench, moves, arm), moves.any(axis=1)
        if not load.any():
            load = np.where(free, assembly.weights, 0.0)
        # a block without load of its own, or with less than air would weigh (a model "without weight" has densities of
        # 1e-6), is judged as the lightest that has one: else a loose block that nothing presses keeps a load undecided
        bears = load > NO_WEIGHT * GRAVITY * assembly.arrays.volume
        least = load[bears].min() if bears.any() else load[load > 0.0].min(initial=np.inf)
        load = np.where(bears, load, np.maximum(load, least))
        load = np.where(np.isfinite(load), load, 1e-300)
        return cls(load, arm, np.cbrt(assembly.arrays.volume), moves, smallest_edge(assembly))

    @property
    def force(self) -> float:
        """Mean load of the free blocks [N]."""
        return float(self.load[self.free.any(axis=1)].mean())

    def under(self, wrench: Array) -> "Scale":
        """This scale under another load: a block's own load is the larger of both.

        ``wrench`` has the loads of every block, see ``Loads.rows``, shape (n, 15 or 6).
        """
        return replace(self, load=np.maximum(self.load, _own_load(wrench, self.free, self.arm)))

    def above_rounding(self, state: State) -> "Scale":
        """This scale with loads that are not lost in the rounding of contact forces.

        The load of a block is at least :data:`ROUNDING` times what its joints in ``state`` press it by.
        """
        if not (self.load < LIGHT * self.load.max()).any():
            return self  # no block so light that it matters
        now = state.forces()
        pressed = np.zeros(len(self.load))
        for block in (state.joints.block_a, state.joints.block_b):
            np.add.at(pressed, block[now.owner], np.linalg.norm(now.force, axis=1))
        return replace(self, load=np.maximum(self.load, ROUNDING * pressed))


def _own_load(wrench: Array, moves: Flags, arm: Array) -> Array:
    """Applied force, or moment over the arm where that is more, of every block [N].

    Held degrees of freedom do not count.

    ``wrench`` has forces [N] and moments [N m], shape (n, 6 or 15), ``moves`` the free degrees of freedom, shape
    (n, 6), and ``arm`` the least thickness of every block [m], shape (n,).
    """
    acting = wrench[:, :6] * moves
    return np.maximum(np.linalg.norm(acting[:, :3], axis=1), np.linalg.norm(acting[:, 3:], axis=1) / arm)


def _least_thickness(assembly: Assembly) -> Array:
    """Least side of the box that has a block's mass and inertia [m], shape (n,).

    It is the same whichever way the block is turned.

    Where the inertia is that of no box it is the cube root of the volume.
    """
    x = assembly.arrays
    value = np.linalg.eigvalsh(x.inertia)
    mass = np.where(x.mass > 0.0, x.mass, 1.0)
    # a box of sides a, b, c has I_b + I_c - I_a = m a^2 / 6
    side = np.sqrt(np.maximum(6.0 * (value[:, 0] + value[:, 1] - value[:, 2]) / mass, 0.0))
    return np.where(side > 0.0, side, np.cbrt(x.volume))


def smallest_edge(assembly: Assembly) -> float:
    """Least thickness of a free block, however it is turned [m].

    Displacements are large or small against it.
    """
    return float(_least_thickness(assembly)[~assembly.fixed].min())


def unbalance(state: State, scale: Scale) -> tuple[float, float]:
    """Largest unbalanced force and moment of a block, over its own load [-].

    Moments are over that load times the block's least thickness.
    """
    force, moment = unbalance_of_blocks(state, scale)
    return float(force.max(initial=0.0)), float(moment.max(initial=0.0))


def unbalance_of_blocks(state: State, scale: Scale) -> tuple[Array, Array]:
    """Unbalanced force and moment of every block over its own load [-], shape (n,).

    Moments are over that load times its thickness too.

    The force on a mode of a block that deforms counts too, at the corner that the mode moves most. Each block has a
    load of its own in ``scale``: against the mean load of all blocks a stone of a fortieth of the largest one's size
    would be in equilibrium while it falls.
    """
    scale = scale.above_rounding(state)
    net = state.bodies.net * (scale.free & ~state.bodies.held)
    force = np.linalg.norm(net[:, :3], axis=1)
    if state.modes is not None and state.deformation is not None:
        # what acts on a mode, over the largest displacement it makes, is a force at a corner
        reach = np.where(state.modes.inv_mass > 0.0, state.deformation.reach, np.inf)
        force = np.maximum(force, (np.abs(state.modes.net) / reach).max(axis=1))
    return force / scale.load, np.linalg.norm(net[:, 3:], axis=1) / (scale.load * scale.arm)


def displacement_since(state: State, shift: Array, quat: Array, scale: Scale) -> float:
    """Largest displacement, or rotation times block size, since a stored position [m].

    ``shift`` and ``quat`` are displacements [m] and quaternions of all blocks there, shapes (n, 3) and (n, 4); sizes of
    blocks are those of ``scale``.
    """
    moved = np.linalg.norm(state.bodies.shift - shift, axis=1)
    # a small turn by an angle moves a unit quaternion by half of it
    turned = np.linalg.norm(state.bodies.quat - quat, axis=1) * 2.0 * scale.size
    return float(max(moved.max(initial=0.0), turned.max(initial=0.0)))


def slid_and_moved(assembly: Assembly, state: State) -> tuple[float, float]:
    """Largest plastic slip of a point that bears, and displacement of a block [m]."""
    closed = np.linalg.norm(state.measured(assembly).force, axis=1) > 0.0
    slid = float((np.hypot(state.points.slip_1, state.points.slip_2) * closed).max(initial=0.0))
    return slid, float(np.linalg.norm(state.bodies.shift, axis=1).max())
