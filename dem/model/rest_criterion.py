"""Running the kernel in chunks: constant or tabulated loads, unbalanced forces, detection of bad states."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from dem import kernels
from dem.model.edge_points import follow_edges
from dem.model.shared_steps import shared_advance
from dem.model.state import DYNAMIC, State, UnstableError
from limitmason.arrays import Array, Flags
from limitmason.constants import GRAVITY
from limitmason.model import Assembly
from limitmason.model.stages import Damping

CALM = 1e-2
"""Kinetic over elastic energy up to which motion is steady, and combined damping acts where it is asked for [-].

Local damping drags on blocks that slide or turn on steadily while their joints chatter, and a push then carries too
much. After a brittle drop it brings the blocks to rest sooner.
"""


EVERY, CHECKS = 100, 4
"""Steps, about, between two checks of a load that is held, and how many in a row must find it in balance."""

STOPS = 8000
"""Steps after which stops at peaks of the kinetic energy give way to local damping of 0.6, unless forces still fade.

Stops settle two to three times as fast where joints stick. Where many slip, every fast elastic peak stops the slow
slip, and they take three times as long.
"""

EXTENSIONS = 4
"""Times that a load which is still on its way to a verdict gets half as many steps again."""

NO_WEIGHT = 1.0
"""Own load of a block per volume, as a density [kg/m3], up to which it counts as none."""


SLID = 0.005
"""Slip over the largest displacement from which loads that came on at once are pointed out, or come on again [-]."""

EVENLY = 1000
"""Fewest steps over which loads come on evenly: none of 60 small structures then rested more than 1 % elsewhere."""


def restless(state: State, calm: float) -> bool:
    """Whether the kinetic energy is above a part of the elastic one."""
    return bool(state.total[kernels.E_KINETIC] > calm * state.forces().elastic_energy)


@dataclass(frozen=True)
class Scale:
    """What unbalanced forces and displacements are small against.

    Parameters
    ----------
    load : of every block, its own [N], shape (n,)
    arm : lever arm its moments are small against, its least thickness [m], shape (n,)
    size : cube root of the volume [m], shape (n,)
    free : degrees of freedom, shape (n, 6)
    smallest : smallest dimension of a free block [m]
    """

    load: Array
    arm: Array
    size: Array
    free: Flags
    smallest: float

    @classmethod
    def of(cls, assembly: Assembly, wrench: Array) -> "Scale":
        """Scale of an assembly under a wrench per block [N, N m], shape (n, 6)."""
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
        """This scale under another load: a block's own load is the larger of both [N]."""
        return replace(self, load=np.maximum(self.load, _own_load(wrench, self.free, self.arm)))

    def above_rounding(self, state: State) -> "Scale":
        """This scale with at least 1e-7 of what others press a block by.

        Below that no balance of a block can be told from rounding.
        """
        if not (self.load < 1e-6 * self.load.max()).any():
            return self
        now = state.forces()
        pressed = np.zeros(len(self.load))
        for block in (state.joints.block_a, state.joints.block_b):
            np.add.at(pressed, block[now.owner], np.linalg.norm(now.force, axis=1))
        return replace(self, load=np.maximum(self.load, 1e-7 * pressed))


def _own_load(wrench: Array, moves: Flags, arm: Array) -> Array:
    """Applied force, or moment over the arm where that is more, on the free degrees of freedom of every block [N]."""
    acting = wrench * moves
    return np.maximum(np.linalg.norm(acting[:, :3], axis=1), np.linalg.norm(acting[:, 3:], axis=1) / arm)


def _least_thickness(assembly: Assembly) -> Array:
    """Least side of the box with a block's volume moments [m], whichever way it is turned, shape (n,)."""
    x = assembly.arrays
    value = np.linalg.eigvalsh(x.inertia)
    mass = np.where(x.mass > 0.0, x.mass, 1.0)
    # a box of sides a, b, c has I_b + I_c - I_a = m a^2 / 6
    side = np.sqrt(np.maximum(6.0 * (value[:, 0] + value[:, 1] - value[:, 2]) / mass, 0.0))
    return np.where(side > 0.0, side, np.cbrt(x.volume))


def smallest_edge(assembly: Assembly) -> float:
    """Least thickness of a free block, however it is turned [m]: displacements are large or small against it."""
    return float(_least_thickness(assembly)[~assembly.fixed].min())


def run(
    state: State,
    cases: Array,
    factors: Array,
    damping: Damping,
    drives: Array | None = None,
    speeds: Array | None = None,
) -> None:
    """Advance by ``len(factors)`` steps and check that the state is finite.

    Parameters
    ----------
    cases : wrench per case and block [N, N m], shape (c, n, 6)
    factors : per step, shape (steps, c)
    drives, speeds : twists of driven blocks, shape (d, n, 6), and their factors per step, shape (steps, d)

    Raises
    ------
    UnstableError
        When a displacement or velocity is no longer finite; the message names the block.
    """
    steps = len(factors)
    # without combined damping the kernel is compiled without it, to the bits of before
    drifts = bool(state.total[kernels.E_KINETIC] < CALM * state.forces().elastic_energy) if damping.combined else None
    if drives is None or speeds is None:
        drives, speeds = np.zeros((0,) + cases.shape[1:]), np.zeros((steps, 0))
    # copies: to the compiler loads that may not be written are another type, and the kernel is compiled twice
    acting = kernels.Acting(*(np.array(v, dtype=float, order="C") for v in (cases, factors, drives, speeds)))
    scheme = kernels.Scheme(
        float(state.dt), state.mode == DYNAMIC, float(damping.local), float(damping.adaptive), damping.kinetic
    )
    shared_advance(state, acting, scheme, drifts)
    state.time += steps * state.dt
    b = state.bodies
    finite = state.modes is None or bool(np.isfinite(state.modes.value).all())
    if not (finite and np.isfinite(state.total).all() and np.isfinite(b.shift).all() and np.isfinite(b.ang).all()):
        bad = ~(np.isfinite(b.shift).all(axis=1) & np.isfinite(b.vel).all(axis=1) & np.isfinite(b.quat).all(axis=1))
        block = int(np.flatnonzero(bad)[0]) if bad.any() else 0
        raise UnstableError(
            f"the state of block number {block} is not finite at step {state.total[kernels.E_STEPS]:.0f}: the time "
            "step is too long for the stiffness, or a load is not finite"
        )


def run_constant(state: State, wrench: Array, steps: int, damping: Damping) -> None:
    """Advance under a constant wrench per block [N, N m], shape (n, 6)."""
    run(state, wrench[None], np.ones((steps, 1)), damping)


def stand_back(state: State, assembly: Assembly, wrench: Array) -> None:
    """Give blocks at rest the velocities of half a step ago under loads [N, N m], shape (n, 6), and their joints.

    v(-1/2) = -dt F / (2 m): the first step then leads to v(1/2) = dt F / (2 m), and x(n) is that of time n dt. A whole
    step from rest would be half a step ahead for good.
    """
    b, now = state.bodies, state.measured(assembly)
    wrench, place = wrench.copy(), assembly.centroids + b.shift
    for block, sign in ((state.joints.block_a[now.owner], -1.0), (state.joints.block_b[now.owner], 1.0)):
        turning = np.cross(now.position - place[block], now.force)
        np.add.at(wrench, block, sign * np.concatenate([now.force, turning], axis=1))
    push = np.where(b.held, 0.0, -0.5 * state.dt * wrench)
    rot = b.rot + np.eye(3)
    b.vel[:] = push[:, :3] * b.inv_mass[:, None]
    b.ang[:] = push[:, 3:]
    b.spin[:] = np.einsum("nij,njk,nlk,nl->ni", rot, b.inv_inertia, rot, b.ang)


def unbalance(state: State, scale: Scale) -> tuple[float, float]:
    """Largest unbalanced force over a block's own load, and moment over that load times the block's least thickness."""
    force, moment = unbalance_of_blocks(state, scale.above_rounding(state))
    return float(force.max(initial=0.0)), float(moment.max(initial=0.0))


def unbalance_of_blocks(state: State, scale: Scale) -> tuple[Array, Array]:
    """Unbalanced force and moment of every block against its own load and thickness [-], shapes (n,), (n,).

    The force on a mode of a block that deforms counts too, at the corner that the mode moves most.

    Against the mean load of all blocks a stone of a fortieth of the largest one's size would be in equilibrium while it
    falls.
    """
    net = np.abs(state.bodies.net) * (scale.free & ~state.bodies.held)
    force = net[:, :3].max(axis=1)
    if state.modes is not None and state.deformation is not None:
        # what acts on a mode, over the largest displacement it makes, is a force at a corner
        reach = np.where(state.modes.inv_mass > 0.0, state.deformation.reach, np.inf)
        force = np.maximum(force, (np.abs(state.modes.net) / reach).max(axis=1))
    return force / scale.load, net[:, 3:].max(axis=1) / (scale.load * scale.arm)


def displacement_since(state: State, shift: Array, quat: Array, scale: Scale) -> float:
    """Largest displacement, or rotation times block size, since a stored position [m]."""
    moved = np.linalg.norm(state.bodies.shift - shift, axis=1)
    turned = np.linalg.norm(state.bodies.quat - quat, axis=1) * 2.0 * scale.size
    return float(max(moved.max(initial=0.0), turned.max(initial=0.0)))


def slid_and_moved(assembly: Assembly, state: State) -> tuple[float, float]:
    """Largest plastic slip of a point that is pressed, and largest displacement of a block [m]."""
    closed = np.linalg.norm(state.measured(assembly).force, axis=1) > 0.0
    slid = float((np.hypot(state.points.slip_1, state.points.slip_2) * closed).max(initial=0.0))
    return slid, float(np.linalg.norm(state.bodies.shift, axis=1).max())


class Outcome(StrEnum):
    """How holding a load ended."""

    EQUILIBRIUM = "equilibrium"
    MOVING = "moving"
    UNDECIDED = "undecided"


EQUILIBRIUM, MOVING, UNDECIDED = Outcome


@dataclass(frozen=True)
class LoadVerdict:
    """Outcome of holding a load, steps used, last unbalance, displacement.

    ``block`` is the number of the block with the largest unbalance at the end.
    """

    outcome: Outcome
    steps: int
    unbalance: tuple[float, float]
    moved: float
    block: int = -1


class LoadOnset(NamedTuple):
    """How a load comes on evenly: from which, [N, N m], shape (n, 6), and in how many steps. At once it overshoots."""

    before: Array
    steps: int


def hold(
    assembly: Assembly,
    state: State,
    wrench: Array,
    scale: Scale,
    damping: Damping,
    *,
    tolerance: float,
    limit: float,
    max_steps: int,
    patience: int = 0,
    early: float | None = None,
    edges: bool = True,
    onset: LoadOnset | None = None,
) -> LoadVerdict:
    """Hold a load until force and moment are small in several checks in a row, or a block has moved too far.

    Parameters
    ----------
    wrench : [N, N m], shape (n, 6)
    tolerance : of both unbalanced force and moment of every block, over its own load (and thickness) [-]. At this
        load a block must also stand still: what it travels while the forces are small, kept up for as long again as
        the load has been held, must stay below a fiftieth of ``limit``
    limit : displacement that counts as collapse [m]
    max_steps : budget; where the unbalanced force then still fades, or the blocks speed up or will be at ``limit`` in
        time, it goes on by half as much again, up to :data:`EXTENSIONS` times; otherwise the verdict is "undecided",
        however the blocks move
    patience : steps that earlier loads took to settle; after these ``early`` is enough where the motion still speeds up
        and the unbalanced force grows. Sooner, a slow swing about a new equilibrium looks alike
    early : [m], a fifth of ``limit`` by default
    edges : let the points of joints that slide follow the edges of their faces. Held to the material of one block, a
        bearing that slides along with it bears more and more
    onset : how the load comes on; at once by default
    """
    early = 0.2 * limit if early is None else early
    scale = scale.under(wrench)
    shift, quat = state.bodies.shift.copy(), state.bodies.quat.copy()
    used = 0 if onset is None else onset.steps
    if onset is not None and used:
        part = np.arange(1, used + 1) / used
        run(state, np.stack([onset.before, wrench]), np.column_stack([1.0 - part, part]), damping)
    quiet, since, until, extensions = 0, 0, max_steps + used, EXTENSIONS
    resting = (shift, quat)
    path: list[tuple[float, float]] = []
    while True:
        # checks at unequal intervals cannot fall into step with an oscillation
        steps = EVERY + (0, 7, 3, 11)[len(path) % 4]
        if damping.kinetic and used >= STOPS and not _fades(path):
            damping = replace(damping, local=max(damping.local, 0.6), kinetic=False)
        run_constant(state, wrench, steps, damping)
        if edges:
            follow_edges(assembly, state)
        used += steps
        force, moment = unbalance_of_blocks(state, scale.above_rounding(state))
        last, worst = (float(force.max()), float(moment.max())), int(np.argmax(np.maximum(force, moment)))
        moved = displacement_since(state, shift, quat, scale)
        path.append((moved, max(last)))
        if moved > limit or (used > 1.5 * patience and moved > early and _accelerates(path)):
            return LoadVerdict(MOVING, used, last, moved, worst)
        quiet = quiet + 1 if max(last) < tolerance else 0
        if quiet == 1:
            since, resting = used, (state.bodies.shift.copy(), state.bodies.quat.copy())
        if quiet >= CHECKS:
            # balanced forces also belong to a block that slides or turns on at a steady pace
            drift = displacement_since(state, *resting, scale) / (used - since)
            if drift * used < 0.02 * limit:
                return LoadVerdict(EQUILIBRIUM, used, last, moved, worst)
            if used >= 2 * since:
                # what crept on at first may rest since: looked at anew, from a pose of now
                quiet = 0
        if used >= until:
            left = extensions * (max_steps // 2)
            if extensions <= 0 or not (_fades(path) or _accelerates(path) or _arrives(path, used, limit, left)):
                return LoadVerdict(UNDECIDED, used, last, moved, worst)
            extensions -= 1
            until += max_steps // 2


def _accelerates(path: list[tuple[float, float]]) -> bool:
    """Whether speed and unbalanced force grow in each later third of the last half of a path.

    A few hundred steps say nothing: joints that slip one after the other let blocks speed up for a while on the way to
    an equilibrium that takes tens of thousands. ``path`` holds displacement and unbalanced force of each look.
    """
    part = len(path) // 6
    if part < 3:
        return False
    moved = np.array([p[0] for p in path[-3 * part - 1 :]])
    force = np.log([max(p[1], 1e-300) for p in path[-3 * part :]]).reshape(3, part).mean(axis=1)
    speed = np.diff(moved).reshape(3, part).mean(axis=1)
    return bool(speed[0] > 0.0 and (np.diff(speed) > 0.0).all() and (np.diff(force) > 0.0).all())


def _fades(path: list[tuple[float, float]]) -> bool:
    """True where the unbalanced force of the last third of the time is a tenth lower than that of the third before."""
    part = len(path) // 3
    if part < 3:
        return False
    force = np.log([max(p[1], 1e-300) for p in path[-2 * part :]]).reshape(2, part).mean(axis=1)
    return bool(force[1] < force[0] - 0.1)


def _arrives(path: list[tuple[float, float]], used: int, limit: float, left: int) -> bool:
    """True where the mean speed of the last third of the time carries a block to the limit within the steps left."""
    part = len(path) // 3
    return part >= 3 and path[-1][0] + (path[-1][0] - path[-1 - part][0]) * left * 3.0 / used > limit
