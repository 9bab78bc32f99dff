"""Motion of the blocks: steps of central differences with their energies."""

import numpy as np

from dem.kernels.arrays import (
    E_APPLIED,
    E_DAMPING,
    E_FRACTURE,
    E_FRICTION,
    E_KINETIC,
    E_LENGTH,
    E_STEPS,
    E_STOP,
    E_SUPPORT,
    E_VISCOSITY,
    E_VISCOUS,
    LAW,
    SUMS,
    Acting,
    Array,
    BlockModes,
    BlockStep,
    Joints,
    Part,
    Points,
    RigidBodies,
    Scheme,
    Team,
    Ties,
)
from dem.kernels.compiled import kernel
from dem.kernels.deformed import load_strain, move_modes
from dem.kernels.joint_forces import _crossing_forces, _joint_forces
from dem.kernels.local_damping import brakes_of, least_speeds
from dem.kernels.rotations import middle_spin, rotation_of, spin_of, turned_by
from dem.kernels.threads import SHUT, meet
from dem.kernels.ties import add_tie_forces

Work = tuple[float, float, float, float]
Scratch = tuple[Array, Array, Array, Array, Array, Array]

STOP_EVERY = 10.0
"""Fewest steps between two stops: fast modes are left to local damping."""

CHANGE = 1.02
"""Factor by which an adaptive viscosity grows or falls in a step; chosen."""

LEAST = 1e-6
"""Least adaptive viscosity times the step: it can always grow again."""


@kernel(inline="always")
def _adapted(viscosity: float, adaptive: float, kinetic: float, before: float, dt: float) -> float:
    """Viscosity [1/s] of global damping that adapts to the motion (adaptive damping).

    It grows where its power 2 C E_kin is less than a fixed part of |dE_kin / dt|, and falls else.

    Parameters
    ----------
    viscosity : C of the step before [1/s]
    adaptive : that fixed part [-]
    kinetic, before : kinetic energy now and a step ago [J]
    dt : step [s]
    """
    # both as energies of a step
    power = 2.0 * viscosity * kinetic * dt
    wanted = adaptive * abs(kinetic - before)
    change = CHANGE if power < wanted else 1.0 / CHANGE
    # at most 1 / dt: from 2 / dt on velocities would turn about in a step
    return min(max(viscosity * change, LEAST / dt), 1.0 / dt)


@kernel(inline="always")
def _loads_on(acting: Acting, step: int, i: int, rot: Array, force: Array) -> None:
    """Load on block i in a step; the points of forces turn with the block.

    Parameters
    ----------
    acting : load cases and their factors
    step, i : numbers of the step and of the block
    rot : R - I of all blocks, shape (n, 3, 3)
    force : force [N] and moment about the centroid [N m], written, shape (6,)
    """
    for k in range(6):
        force[k] = 0.0
    cases = acting.cases
    for c in range(cases.shape[0]):
        x = acting.factors[step, c]
        if x != 0.0:
            for k in range(6):
                force[k] += x * cases[c, i, k]
            # moment as points of attack turn, (R - I) r x f, by the sum of r f^T: nine numbers behind the wrench
            if cases.shape[2] > 6:
                for k in range(3):
                    u, v = (k + 1) % 3, (k + 2) % 3
                    for r in range(3):
                        turned = rot[i, u, r] * cases[c, i, 6 + 3 * r + v] - rot[i, v, r] * cases[c, i, 6 + 3 * r + u]
                        force[3 + k] += x * turned


@kernel(inline="always")
def _arms_on(acting: Acting, step: int, i: int, arms: Array) -> None:
    """Sum of r f^T of the loads on block i in a step, to ``arms`` (3, 3) [N m]."""
    for a in range(3):
        for b in range(3):
            arms[a, b] = 0.0
            for c in range(acting.cases.shape[0]):
                arms[a, b] += acting.factors[step, c] * acting.cases[c, i, 6 + 3 * a + b]


@kernel(inline="always")
def _driven(acting: Acting, step: int, i: int, k: int) -> float:
    """Velocity that all drives prescribe for freedom k of block i [m/s, rad/s]."""
    v = 0.0
    for q in range(acting.drives.shape[0]):
        v += acting.speeds[step, q] * acting.drives[q, i, k]
    return v


@kernel(inline="always")
def _is_turned(acting: Acting, step: int, i: int) -> bool:
    """Whether a drive turns block i at a step."""
    turns = False
    for q in range(acting.drives.shape[0]):
        for k in range(3, 6):
            turns = turns or (acting.speeds[step, q] != 0.0 and acting.drives[q, i, k] != 0.0)
    return turns


@kernel(inline="always")
def _accelerate(
    bodies: RigidBodies, i: int, past: Array, acting: Acting, step: int, at: BlockStep, local: float,
    drifts: bool | None, damping: float,
) -> tuple[float, bool]:
    """Bring velocity and angular momentum of block i from step n - 1/2 to n + 1/2.

    Parameters
    ----------
    bodies, i : all blocks, changed, and the number of the block
    past : net force [N] and moment [N m] of the step before, shape (6,); moments of the damping are written there
    acting, step : prescribed velocities, and the number of the step
    at : time step and factors of the scheme, see :class:`dem.kernels.arrays.BlockStep`
    local : factor of local damping [-]
    drifts : whether motion is steady, and damping the combined one; None where it never is
    damping : work of the damping so far [J]

    Returns
    -------
    damping : with what it took of this block's velocity; that of its spin follows once the spin is known [J]
    moving : whether a held freedom of displacement is driven
    """
    vel, spin, ang, held, net = bodies.vel, bodies.spin, bodies.ang, bodies.held, bodies.net
    dt, kick, viscosity, keep, lag = at
    moving = False
    least = least_speeds(bodies, i)
    # columns of forces begin at 0, those of moments at 3
    brake_of_force = brakes_of(local, drifts, net, i, 0, past, vel, least[0], held, bodies.axes)
    brake_of_moment = brakes_of(local, drifts, net, i, 3, past, spin, least[1], held, bodies.axes)
    for k in range(3):
        if held[i, k]:
            vel[i, k] = _driven(acting, step, i, k)
            moving = moving or vel[i, k] != 0.0
        else:
            f = net[i, k]
            v = float(vel[i, k])
            brake = brake_of_force[k]
            vel[i, k] = (v * keep + (f - brake) * bodies.inv_mass[i] * kick) * lag
            # local and global damping work at the mean of both velocities
            damping += brake * 0.5 * (v + vel[i, k]) * dt
            damping += viscosity * bodies.mass[i] * (0.5 * (v + vel[i, k])) ** 2 * dt
        if held[i, 3 + k]:
            ang[i, k] = 0.0
        else:
            f = net[i, 3 + k]
            brake, before = brake_of_moment[k], float(ang[i, k])
            ang[i, k] = (before * keep + (f - brake) * kick) * lag
            # the moment of all damping: its work waits for the spin at the end of the step
            past[3 + k] = brake + viscosity * 0.5 * (before + ang[i, k])
    return damping, moving


@kernel(inline="always")
def _stop(bodies: RigidBodies) -> None:
    """Take all free velocities of the blocks away, and their angular momentum."""
    for i in range(bodies.mass.size):
        for k in range(3):
            if not bodies.held[i, k]:
                bodies.vel[i, k] = 0.0
            if not bodies.held[i, 3 + k]:
                bodies.spin[i, k] = 0.0
                bodies.ang[i, k] = 0.0


@kernel(inline="always")
def _added_up(total: Array, sums: Array, place: int, parts: int) -> Work:
    """Kinetic energy, and work of loads, supports and damping, of all parts [J].

    Parameters
    ----------
    total : accumulated energies, entries ``E_...``, to which what joints lost is added [J]
    sums, place : sums of all parts, which begin at this entry
    parts : how many they are
    """
    kinetic = applied = support = damping = 0.0
    for row in range(place, place + parts * SUMS, SUMS):
        kinetic += sums[row + E_KINETIC]
        applied += sums[row + E_APPLIED]
        support += sums[row + E_SUPPORT]
        damping += sums[row + E_DAMPING]
        total[E_FRICTION] += sums[row + E_FRICTION]
        total[E_VISCOUS] += sums[row + E_VISCOUS]
        total[E_FRACTURE] += sums[row + E_FRACTURE]
    return kinetic, applied, support, damping


@kernel(forceinline=True)
def _move(
    bodies: RigidBodies, part: int, parts: int, acting: Acting, step: int, at: BlockStep, scheme: Scheme,
    drifts: bool | None, scratch: Scratch, modes: BlockModes | None,
) -> Work:
    """Move a part of the blocks by a step; return energies [J] as :func:`_added_up`.

    Compiled into its caller as a whole: otherwise every array is counted for every block.

    Parameters
    ----------
    bodies : all blocks; those of the part are changed
    part, parts : number of the part, and how many there are
    acting, step : what acts on the blocks, and the number of the step
    at, scheme : factors of this step, and how blocks are stepped
    drifts : whether motion is steady, and damping the combined one; None where it never is
    scratch : room for the load (6), old velocities (6), old or damping forces (6), a quaternion (4), R - I (3, 3) and
        the new spin (3)
    modes : shapes of blocks that deform; None where all are rigid
    """
    n, dt = bodies.mass.size, at.dt
    kinetic = applied = support = damping = 0.0
    force, old, past, half, trot, new = scratch
    vel, spin, ang, held, net = bodies.vel, bodies.spin, bodies.ang, bodies.held, bodies.net
    for i in range(part * n // parts, (part + 1) * n // parts):
        still = True  # held, and at rest in the step before
        for k in range(6):
            old[k] = vel[i, k] if k < 3 else spin[i, k - 3]
            still = still and held[i, k] and old[k] == 0.0
        _loads_on(acting, step, i, bodies.rot, force)
        if modes is not None and acting.cases.shape[2] > 6:
            _arms_on(acting, step, i, trot)
            load_strain(modes, i, bodies.rot, trot, force)
        for k in range(6):
            if drifts is not None:
                past[k] = net[i, k]
            net[i, k] = force[k] + bodies.contact[i, k]
        # joints of the other parts, whose sums have rows of their own
        for row in range(n + i, parts * n, n):
            for k in range(6):
                net[i, k] += bodies.contact[row, k]
        damping, moving = _accelerate(bodies, i, past, acting, step, at, scheme.local, drifts, damping)
        if still and not moving and not _is_turned(acting, step, i):
            # held and not driven: nothing works on it
            for k in range(3):
                spin[i, k] = 0.0
            continue
        spin_of(bodies.rot[i], bodies.inv_inertia[i], ang[i], new)
        if scheme.true_inertia:
            middle_spin(bodies, i, 0.5 * dt, half, trot, new)
        for k in range(3):
            if held[i, 3 + k]:
                new[k] = _driven(acting, step, i, 3 + k)
            spin[i, k] = new[k]
            # forces of the step work at the mean of the velocities half a step before and after it
            mean_v, mean_w = 0.5 * (old[k] + vel[i, k]), 0.5 * (old[3 + k] + new[k])
            applied += (force[k] * mean_v + force[3 + k] * mean_w) * dt
            if held[i, k]:
                support -= net[i, k] * mean_v * dt
            else:
                kinetic += 0.5 * bodies.mass[i] * vel[i, k] * vel[i, k]
            if held[i, 3 + k]:
                support -= net[i, 3 + k] * mean_w * dt
            else:
                damping += past[3 + k] * mean_w * dt
                kinetic += 0.5 * ang[i, k] * new[k]
            bodies.shift[i, k] += dt * vel[i, k]
        if new[0] != 0.0 or new[1] != 0.0 or new[2] != 0.0:
            turned_by(bodies.quat[i], new, dt, bodies.quat[i])
            rotation_of(bodies.quat[i], bodies.rot[i])
    return kinetic, applied, support, damping


@kernel(counted=True)
def advance(
    points: Points, joints: Joints, bodies: RigidBodies, total: Array, acting: Acting, scheme: Scheme, team: Team,
    drifts: bool | None, modes: BlockModes | None = None, space: bool | None = None, ties: Ties | None = None,
) -> None:
    """Advance by ``len(acting.factors)`` steps of central differences.

    m v(n+1/2) = m v(n-1/2) + dt F(n),  L(n+1/2) = L(n-1/2) + dt M(n),  omega = R J^-1 R^T L,  x(n+1) = x(n) + dt v.

    Parameters
    ----------
    points, joints, bodies : state, changed in place; ``bodies.contact`` has a row of every block for every part, shape
        (parts n, 6)
    total : accumulated energies [J] and the adaptive viscosity [1/s], entries ``E_...``, shape (E_SIZE,), one for each
        thread
    acting : loads and prescribed velocities, and their factors in every step
    scheme : how blocks are stepped, and their artificial damping
    team : what this thread does of every step
    drifts : whether half of the local damping acts against the change of the force, for a motion that is steady; None
        where it never does: the compiler then leaves it out
    modes : of blocks that deform, changed in place; None where all are rigid, and where there are several parts
    space : None where they deform in a plane, else True
    ties : changed in place; None where there are none

    Notes
    -----
    A step has three parts: joints and ties add up their forces, blocks and their shapes move, energies are added up.

    The functions called here are compiled into this one. It makes arrays and so counts who holds one: handed to a
    function per block, that takes three times as long, and what is compiled by itself sums in another order.

    Threads wait for each other before blocks move and after, and once more after a stop. Each adds up the sums of all
    parts for itself, in their order.
    """
    n, k, parts, sums = bodies.mass.size, joints.block_a.size, team.parts, team.sums
    alone = team.end - team.mine == parts
    dt, _, local, adaptive, kinetic_stop = scheme
    scratch = np.empty(6), np.empty(6), np.empty(6), np.empty(4), np.empty((3, 3)), np.empty(3)
    crossings = (joints.law[:, LAW.cross] != 0.0).any()
    # all threads begin together, or not at all where one never comes
    met = 0 if alone else meet(team.gate, 0, parts, 0)
    if modes is not None:
        modes.load[:] = 0.0
    for step in range(acting.factors.shape[0] if met < SHUT else 0):
        # sums of even and odd steps have places of their own: others may still read those of the step before
        place = step % 2 * parts * SUMS
        # blocks came here in the step before: with the length of this one a joint that slides would be held by its
        # dashpot for what no motion made
        since = total[E_LENGTH] if total[E_LENGTH] > 0.0 else dt
        for p in range(team.mine, team.end):
            # the sums of one part are the totals themselves, which go on from step to step
            row = place + p * SUMS if parts > 1 else 0
            if parts > 1:
                sums[row : row + SUMS] = 0.0
            bodies.contact[p * n : (p + 1) * n] = 0.0
            if modes is not None:
                modes.contact[:] = 0.0
            part = Part(p * k // parts, (p + 1) * k // parts, p * n, row)
            _joint_forces(points, joints, bodies, since, sums, part, modes, space)
            if crossings:
                _crossing_forces(points, joints, bodies, since, sums, part)
            if ties is not None and p == 0:
                add_tie_forces(ties, bodies, sums, row)
        # forces of all parts are there: blocks move
        if not alone:
            met = meet(team.gate, met, parts)
        viscosity = total[E_VISCOSITY] if adaptive > 0.0 else 0.0
        # a stop is at a whole step: only half a step leads from there to the first velocity. A whole one starts a mode
        # of frequency w from an amplitude 1 / cos(w dt / 2) too large, which grows from stop to stop in the fast modes
        kick = 0.5 * dt if kinetic_stop and total[E_STEPS] == total[E_STOP] + 1.0 else dt
        at = BlockStep(dt, kick, viscosity, 1.0 - 0.5 * viscosity * dt, 1.0 / (1.0 + 0.5 * viscosity * dt))
        kinetic = applied = support = damping = 0.0
        for p in range(team.mine, team.end):
            kinetic, applied, support, damping = _move(
                bodies, p, parts, acting, step, at, scheme, drifts, scratch, modes
            )
            if parts > 1:
                row = place + p * SUMS
                sums[row + E_KINETIC], sums[row + E_APPLIED] = kinetic, applied
                sums[row + E_SUPPORT], sums[row + E_DAMPING] = support, damping
        # all blocks have moved: energies are added up
        if not alone:
            met = meet(team.gate, met, parts)
        if parts > 1:
            kinetic, applied, support, damping = _added_up(total, sums, place, parts)
        if modes is not None:
            moving_modes, braked_modes, work_on_modes = move_modes(modes, at, local, drifts)
            kinetic += moving_modes
            damping += braked_modes
            applied += work_on_modes
        if adaptive > 0.0:
            total[E_VISCOSITY] = _adapted(viscosity, adaptive, kinetic, total[E_KINETIC], dt)
        if kinetic_stop and kinetic < total[E_KINETIC] and total[E_STEPS] >= total[E_STOP] + STOP_EVERY:
            # past a peak of kinetic energy: the leading mode passes its equilibrium, so stop there and start again
            damping += kinetic
            kinetic = 0.0
            total[E_STOP] = total[E_STEPS]
            if team.mine == 0:  # one thread for all
                _stop(bodies)
            if modes is not None:
                modes.rate[:] = 0.0
            if not alone:
                met = meet(team.gate, met, parts)
        total[E_DAMPING] += damping
        total[E_APPLIED] += applied
        total[E_SUPPORT] += support
        total[E_KINETIC] = kinetic
        total[E_LENGTH] = dt
        total[E_STEPS] += 1.0
