"""Motion of the blocks: rotations by unit quaternions and steps of central differences with their energies."""

import numpy as np

from dem.kernels.arrays import (
    E_APPLIED,
    E_DAMPING,
    E_FRACTURE,
    E_FRICTION,
    E_KINETIC,
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
from dem.kernels.deformed import move_modes
from dem.kernels.joint_forces import _crossing_forces, _joint_forces
from dem.kernels.local_damping import brakes_of, least_speeds
from dem.kernels.team import SHUT, meet
from dem.kernels.ties import add_tie_forces

Work = tuple[float, float, float, float]
Scratch = tuple[Array, Array, Array, Array, Array, Array]
STOP_EVERY = 10.0  # fewest steps between two stops: fast modes are left to local damping


@kernel(forceinline=True)
def _spin_of(rot: Array, inv_inertia: Array, ang: Array, out: Array) -> None:
    """Spin Omega = R J^-1 R^T L of a block, with ``rot`` = R - I.

    Parameters
    ----------
    inv_inertia : J^-1 in the block's axes [1/(kg m2)]
    ang : angular momentum L [kg m2/s]
    out : Omega [rad/s], written
    """
    b0 = ang[0] + rot[0, 0] * ang[0] + rot[1, 0] * ang[1] + rot[2, 0] * ang[2]
    b1 = ang[1] + rot[0, 1] * ang[0] + rot[1, 1] * ang[1] + rot[2, 1] * ang[2]
    b2 = ang[2] + rot[0, 2] * ang[0] + rot[1, 2] * ang[1] + rot[2, 2] * ang[2]
    w0 = inv_inertia[0, 0] * b0 + inv_inertia[0, 1] * b1 + inv_inertia[0, 2] * b2
    w1 = inv_inertia[1, 0] * b0 + inv_inertia[1, 1] * b1 + inv_inertia[1, 2] * b2
    w2 = inv_inertia[2, 0] * b0 + inv_inertia[2, 1] * b1 + inv_inertia[2, 2] * b2
    out[0] = w0 + rot[0, 0] * w0 + rot[0, 1] * w1 + rot[0, 2] * w2
    out[1] = w1 + rot[1, 0] * w0 + rot[1, 1] * w1 + rot[1, 2] * w2
    out[2] = w2 + rot[2, 0] * w0 + rot[2, 1] * w1 + rot[2, 2] * w2


@kernel(forceinline=True)
def _turned(q: Array, spin: Array, h: float, out: Array) -> None:
    """Quaternion q after the rotation spin h (Cayley form, exactly of unit length), written to ``out``."""
    x, y, z = 0.5 * h * spin[0], 0.5 * h * spin[1], 0.5 * h * spin[2]
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    r0 = q0 - x * q1 - y * q2 - z * q3
    r1 = q1 + x * q0 + y * q3 - z * q2
    r2 = q2 + y * q0 + z * q1 - x * q3
    r3 = q3 + z * q0 + x * q2 - y * q1
    size = 1.0 / np.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + r3 * r3)
    out[0], out[1], out[2], out[3] = r0 * size, r1 * size, r2 * size, r3 * size


@kernel(forceinline=True)
def rotation_of(q: Array, out: Array) -> None:
    """R - I of a unit quaternion q, scalar first, without cancellation at small angles, written to ``out`` (3, 3)."""
    s, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = -2.0 * (y * y + z * z)
    out[1, 1] = -2.0 * (x * x + z * z)
    out[2, 2] = -2.0 * (x * x + y * y)
    out[0, 1] = 2.0 * (x * y - s * z)
    out[1, 0] = 2.0 * (x * y + s * z)
    out[0, 2] = 2.0 * (x * z + s * y)
    out[2, 0] = 2.0 * (x * z - s * y)
    out[1, 2] = 2.0 * (y * z - s * x)
    out[2, 1] = 2.0 * (y * z + s * x)


@kernel(inline="always")
def _adapted(viscosity: float, adaptive: float, kinetic: float, before: float, dt: float) -> float:
    """Viscosity whose power 2 C E_k follows a fixed part of the rate of change of the kinetic energy [1/s].

    Parameters
    ----------
    viscosity : C of the step before [1/s]
    adaptive : that fixed part [-]
    kinetic, before : kinetic energy now and a step ago [J]
    dt : step [s]
    """
    power = 2.0 * viscosity * kinetic * dt
    wanted = adaptive * abs(kinetic - before)
    change = 1.02 if power < wanted else 1.0 / 1.02
    return min(max(viscosity * change, 1e-6 / dt), 1.0 / dt)


@kernel(inline="always")
def _loads_on(acting: Acting, step: int, i: int, rot: Array, force: Array) -> None:
    """Load on block i in a step, written to ``force`` (6,): points of forces turn with the block, ``rot`` = R - I."""
    for k in range(6):
        force[k] = 0.0
    cases = acting.cases
    for c in range(cases.shape[0]):
        x = acting.factors[step, c]
        if x != 0.0:
            for k in range(6):
                force[k] += x * cases[c, i, k]
            if cases.shape[2] > 6:  # (R - I) r x f, of the sum of r f^T that is laid out row by row behind the wrench
                for k in range(3):
                    u, v = (k + 1) % 3, (k + 2) % 3
                    for r in range(3):
                        turned = rot[i, u, r] * cases[c, i, 6 + 3 * r + v] - rot[i, v, r] * cases[c, i, 6 + 3 * r + u]
                        force[3 + k] += x * turned


@kernel(inline="always")
def _driven(acting: Acting, step: int, i: int, k: int) -> float:
    """Prescribed velocity of the held degree of freedom k of block i at a step [m/s, rad/s]."""
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
def _middle_spin(bodies: RigidBodies, i: int, half_step: float, half: Array, trot: Array, out: Array) -> None:
    """Spin at the middle of a step, of second order: with the axes that block i has there, found in two rounds.

    Parameters
    ----------
    half_step : half of the step [s]
    half, trot : work space for a quaternion and a rotation
    out : the spin [rad/s], read as a guess and written
    """
    _turned(bodies.quat[i], out, half_step, half)
    rotation_of(half, trot)
    _spin_of(trot, bodies.inv_inertia[i], bodies.ang[i], out)
    _turned(bodies.quat[i], out, half_step, half)
    rotation_of(half, trot)
    _spin_of(trot, bodies.inv_inertia[i], bodies.ang[i], out)


@kernel(inline="always")
def _accelerate(
    bodies: RigidBodies, i: int, past: Array, acting: Acting, step: int, at: BlockStep, local: float,
    drifts: bool | None, damping: float,
) -> tuple[float, bool]:
    """Velocity and angular momentum of block i half a step on; damping with what this one takes, and whether it moves.

    Parameters
    ----------
    past : net force and moment of the step before, shape (6,); moments of the damping are written there
    damping : work of the damping so far [J]
    local : factor of local damping [-]
    """
    vel, spin, ang, held, net = bodies.vel, bodies.spin, bodies.ang, bodies.held, bodies.net
    dt, kick, viscosity, keep, lag = at
    moving = False
    least = least_speeds(bodies, i)
    push = brakes_of(local, drifts, net, i, 0, past, vel, least[0], held, bodies.axes)
    turn = brakes_of(local, drifts, net, i, 3, past, spin, least[1], held, bodies.axes)
    for k in range(3):
        if held[i, k]:
            vel[i, k] = _driven(acting, step, i, k)
            moving = moving or vel[i, k] != 0.0
        else:
            f = net[i, k]
            v = float(vel[i, k])
            brake = push[k]
            vel[i, k] = (v * keep + (f - brake) * bodies.inv_mass[i] * kick) * lag
            damping += brake * 0.5 * (v + vel[i, k]) * dt
            damping += viscosity * bodies.mass[i] * (0.5 * (v + vel[i, k])) ** 2 * dt
        if held[i, 3 + k]:
            ang[i, k] = 0.0
        else:
            f = net[i, 3 + k]
            brake, before = turn[k], float(ang[i, k])
            ang[i, k] = (before * keep + (f - brake) * kick) * lag
            # its work waits for the spin at the end of the step
            past[3 + k] = brake + viscosity * 0.5 * (before + ang[i, k])
    return damping, moving


@kernel(inline="always")
def _stop(bodies: RigidBodies) -> None:
    """Take all free velocities away: velocity, spin and the angular momentum that it follows."""
    for i in range(bodies.mass.size):
        for k in range(3):
            if not bodies.held[i, k]:
                bodies.vel[i, k] = 0.0
            if not bodies.held[i, 3 + k]:
                bodies.spin[i, k] = 0.0
                bodies.ang[i, k] = 0.0


@kernel(inline="always")
def _added_up(total: Array, sums: Array, place: int, parts: int) -> Work:
    """Kinetic energy, and work of loads, supports and damping, of all parts; what joints lost is added to ``total``.

    Parameters
    ----------
    sums, place : of all parts, from this entry on
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
    drifts: bool | None, scratch: Scratch,
) -> Work:
    """Move a part of the blocks by a step; kinetic energy, and work of loads, supports and damping [J].

    Compiled into its caller as a whole: otherwise every array is counted for every block. ``scratch`` has room for
    6, 6, 6, 4, 3 x 3 and 3 numbers.
    """
    n, dt = bodies.mass.size, at.dt
    kinetic = applied = support = damping = 0.0
    force, old, past, half, trot, new = scratch
    vel, spin, ang, held, net = bodies.vel, bodies.spin, bodies.ang, bodies.held, bodies.net
    for i in range(part * n // parts, (part + 1) * n // parts):
        still = True
        for k in range(6):
            old[k] = vel[i, k] if k < 3 else spin[i, k - 3]
            still = still and held[i, k]
        _loads_on(acting, step, i, bodies.rot, force)
        for k in range(6):
            if drifts is not None:
                past[k] = net[i, k]
            net[i, k] = force[k] + bodies.contact[i, k]
        for row in range(n + i, parts * n, n):
            for k in range(6):
                net[i, k] += bodies.contact[row, k]
        damping, moving = _accelerate(bodies, i, past, acting, step, at, scheme.local, drifts, damping)
        if still and not moving and not _is_turned(acting, step, i):
            for k in range(3):
                spin[i, k] = 0.0
            continue
        _spin_of(bodies.rot[i], bodies.inv_inertia[i], ang[i], new)
        if scheme.true_inertia:
            _middle_spin(bodies, i, 0.5 * dt, half, trot, new)
        for k in range(3):
            if held[i, 3 + k]:
                new[k] = _driven(acting, step, i, 3 + k)
            spin[i, k] = new[k]
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
            _turned(bodies.quat[i], new, dt, bodies.quat[i])
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
    points, joints, bodies : state, changed in place; ``bodies.contact`` has a row of every block for every part
    total : accumulated energies [J] and the adaptive viscosity [1/s], entries ``E_...``, shape (E_SIZE,), one for each
        thread
    team : what this thread does of every step
    drifts : half of the local damping acts against the change of the force; None where it never does: the compiler then
        leaves it out
    modes : of blocks that deform, changed in place; None where all are rigid, and where there are several parts
    space : None where they deform in a plane
    ties : changed in place; None where there are none

    Notes
    -----
    Its parts are compiled into it. It makes arrays and so counts who holds one: handed to a function per block, that
    takes three times as long, and what is compiled by itself sums in another order.

    Threads wait for each other before blocks move and after, and once more after a stop. Each adds up the sums of all
    parts for itself, in their order.
    """
    n, k, parts, sums = bodies.mass.size, joints.block_a.size, team.parts, team.sums
    alone = team.end - team.mine == parts
    dt, _, local, adaptive, kinetic_stop = scheme
    scratch = np.empty(6), np.empty(6), np.empty(6), np.empty(4), np.empty((3, 3)), np.empty(3)
    crossings = (joints.law[:, LAW.cross] != 0.0).any()
    met = 0 if alone else meet(team.gate, 0, parts, 0)
    for step in range(acting.factors.shape[0] if met < SHUT else 0):
        # others may still read the sums of the step before
        place = step % 2 * parts * SUMS
        for p in range(team.mine, team.end):
            row = place + p * SUMS if parts > 1 else 0
            if parts > 1:
                sums[row : row + SUMS] = 0.0
            bodies.contact[p * n : (p + 1) * n] = 0.0
            if modes is not None:
                modes.contact[:] = 0.0
            part = Part(p * k // parts, (p + 1) * k // parts, p * n, row)
            _joint_forces(points, joints, bodies, dt, sums, part, modes, space)
            if crossings:
                _crossing_forces(points, joints, bodies, dt, sums, part)
            if ties is not None and p == 0:
                add_tie_forces(ties, bodies, sums, row)
        if not alone:
            met = meet(team.gate, met, parts)
        viscosity = total[E_VISCOSITY] if adaptive > 0.0 else 0.0
        # a stop is at a whole step: only half a step leads from there to the first velocity. A whole one starts a mode
        # of frequency w from an amplitude 1 / cos(w dt / 2) too large, which grows from stop to stop in the fast modes
        kick = 0.5 * dt if kinetic_stop and total[E_STEPS] == total[E_STOP] + 1.0 else dt
        at = BlockStep(dt, kick, viscosity, 1.0 - 0.5 * viscosity * dt, 1.0 / (1.0 + 0.5 * viscosity * dt))
        kinetic = applied = support = damping = 0.0
        for p in range(team.mine, team.end):
            kinetic, applied, support, damping = _move(bodies, p, parts, acting, step, at, scheme, drifts, scratch)
            if parts > 1:
                row = place + p * SUMS
                sums[row + E_KINETIC], sums[row + E_APPLIED] = kinetic, applied
                sums[row + E_SUPPORT], sums[row + E_DAMPING] = support, damping
        if not alone:
            met = meet(team.gate, met, parts)
        if parts > 1:
            kinetic, applied, support, damping = _added_up(total, sums, place, parts)
        if modes is not None:
            moving_modes, braked_modes = move_modes(modes, at, local, drifts)
            kinetic += moving_modes
            damping += braked_modes
        if adaptive > 0.0:
            total[E_VISCOSITY] = _adapted(viscosity, adaptive, kinetic, total[E_KINETIC], dt)
        if kinetic_stop and kinetic < total[E_KINETIC] and total[E_STEPS] >= total[E_STOP] + STOP_EVERY:
            # past a peak of kinetic energy: the leading mode passes its equilibrium, so stop there and start again
            damping += kinetic
            kinetic = 0.0
            total[E_STOP] = total[E_STEPS]
            if team.mine == 0:
                _stop(bodies)
            if modes is not None:
                modes.rate[:] = 0.0
            if not alone:
                met = meet(team.gate, met, parts)
        total[E_DAMPING] += damping
        total[E_APPLIED] += applied
        total[E_SUPPORT] += support
        total[E_KINETIC] = kinetic
        total[E_STEPS] += 1.0
