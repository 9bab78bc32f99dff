"""Time stepping of zones, their joints and the rigid blocks among them, in the plane and in space."""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.local_damping import brake_of
from dem.kernels.solid_arrays import RigidSolids
from dem.kernels.solid_joints import solid_joint_forces
from dem.kernels.solid_zones import solid_forces
from dem.kernels.zone_arrays import Z_APPLIED, Z_DAMPING, Z_KINETIC, Z_STEPS, Z_SUPPORT, Nodes, Rigid, ZonedArrays
from dem.kernels.zones import joint_forces, zone_forces


@kernel(forceinline=True)
def move(
    nodes: Nodes, rigid: Rigid | RigidSolids, total: Array, axes: int, freedoms: int, dt: float, local: float,
    drifts: bool,
) -> None:  # fmt: skip
    """One step of F - brake = m dv / dt for nodes of zones and for rigid blocks, without what they carry along.

    Parameters
    ----------
    total : sums of work, see the ``Z_`` entries
    axes, freedoms : of a node and of a rigid block, (2, 3) in the plane and (3, 6) in space; literals, for the compiler
    dt, local, drifts : as :func:`advance_zones` takes them
    """
    force, shift, velocity = nodes.force, nodes.shift, nodes.velocity
    applied = support = damping = kinetic = 0.0
    for i in range(nodes.mass.size):
        if nodes.body[i] >= 0:
            continue
        inverse = dt / nodes.mass[i]
        for r in range(axes):
            f, v = force[i, r], velocity[i, r]
            if nodes.held[i, r]:
                shift[i, r] += dt * v
                support -= f * v * dt
                applied += nodes.load[i, r] * v * dt
                continue
            brake = brake_of(local, drifts, f, nodes.before[i, r], v)
            nodes.before[i, r] = f
            new = v + (f - brake) * inverse
            mean = 0.5 * (v + new)
            velocity[i, r] = new
            shift[i, r] += dt * new
            damping += brake * mean * dt
            applied += nodes.load[i, r] * mean * dt
            kinetic += 0.5 * nodes.mass[i] * new * new
    for b in range(rigid.centre.shape[0]):
        for r in range(freedoms):
            f, v = rigid.net[b, r], rigid.velocity[b, r]
            rigid.total[b, r] += f
            if rigid.held[b, r]:
                new = rigid.drive[b, r]
                mean = 0.5 * (v + new)
                support -= f * mean * dt
            else:
                brake = brake_of(local, drifts, f, rigid.before[b, r], v)
                rigid.before[b, r] = f
                new = v + (f - brake) * dt / rigid.mass[b, r]
                mean = 0.5 * (v + new)
                damping += brake * mean * dt
                kinetic += 0.5 * rigid.mass[b, r] * new * new
            applied += rigid.load[b, r] * mean * dt
            rigid.velocity[b, r] = new
            rigid.shift[b, r] += dt * new
    total[Z_APPLIED] += applied
    total[Z_SUPPORT] += support
    total[Z_DAMPING] += damping
    total[Z_KINETIC] = kinetic
    total[Z_STEPS] += 1.0


@kernel(forceinline=True)
def _apply(nodes: Nodes, axes: int) -> None:
    """Begin the forces of all nodes with the loads."""
    for i in range(nodes.mass.size):
        for r in range(axes):
            nodes.force[i, r] = nodes.load[i, r]


@kernel()
def _carry(nodes: Nodes, rigid: Rigid) -> None:
    """Carry the nodes of rigid blocks along in the plane."""
    for i in rigid.node:
        b = nodes.body[i]
        turn = rigid.shift[b, 2]
        less, s = -2.0 * np.sin(0.5 * turn) ** 2, np.sin(turn)
        rx, ry = nodes.place[i, 0] - rigid.centre[b, 0], nodes.place[i, 1] - rigid.centre[b, 1]
        nodes.shift[i, 0] = rigid.shift[b, 0] + less * rx - s * ry
        nodes.shift[i, 1] = rigid.shift[b, 1] + less * ry + s * rx


@kernel()
def _net(nodes: Nodes, rigid: Rigid) -> None:
    """Force of loads and joints on every rigid block in the plane, and moment about its centre."""
    for b in range(rigid.centre.shape[0]):
        for r in range(3):
            rigid.net[b, r] = rigid.load[b, r]
    force, shift = nodes.force, nodes.shift
    for i in rigid.node:
        b = nodes.body[i]
        rigid.net[b, 0] += force[i, 0]
        rigid.net[b, 1] += force[i, 1]
        rx = nodes.place[i, 0] + shift[i, 0] - rigid.centre[b, 0] - rigid.shift[b, 0]
        ry = nodes.place[i, 1] + shift[i, 1] - rigid.centre[b, 1] - rigid.shift[b, 1]
        rigid.net[b, 2] += rx * force[i, 1] - ry * force[i, 0]


@kernel(forceinline=True)
def _turn(rigid: RigidSolids, b: int, dt: float) -> None:
    """Turn the quaternion of a block by its spin over a step, exactly."""
    x, y, z = dt * rigid.velocity[b, 3], dt * rigid.velocity[b, 4], dt * rigid.velocity[b, 5]
    angle = np.sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle) / angle
    x, y, z = s * x, s * y, s * z
    q = rigid.turn
    q0, q1, q2, q3 = q[b, 0], q[b, 1], q[b, 2], q[b, 3]
    n0 = c * q0 - x * q1 - y * q2 - z * q3
    n1 = c * q1 + x * q0 + y * q3 - z * q2
    n2 = c * q2 + y * q0 + z * q1 - x * q3
    n3 = c * q3 + z * q0 + x * q2 - y * q1
    inv = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + n3 * n3)
    q[b, 0], q[b, 1], q[b, 2], q[b, 3] = n0 * inv, n1 * inv, n2 * inv, n3 * inv


@kernel()
def _carry_in_space(nodes: Nodes, rigid: RigidSolids) -> None:
    """Carry the nodes of rigid blocks along in space."""
    q = rigid.turn
    for i in rigid.node:
        b = nodes.body[i]
        x, y, z = (
            nodes.place[i, 0] - rigid.centre[b, 0], nodes.place[i, 1] - rigid.centre[b, 1],
            nodes.place[i, 2] - rigid.centre[b, 2],
        )  # fmt: skip
        w, u, v, t = q[b, 0], q[b, 1], q[b, 2], q[b, 3]
        # (R - I) r = 2 (w p + q x p), p = q x r: no digits are lost where it hardly turns
        p0, p1, p2 = v * z - t * y, t * x - u * z, u * y - v * x
        nodes.shift[i, 0] = rigid.shift[b, 0] + 2.0 * (w * p0 + v * p2 - t * p1)
        nodes.shift[i, 1] = rigid.shift[b, 1] + 2.0 * (w * p1 + t * p0 - u * p2)
        nodes.shift[i, 2] = rigid.shift[b, 2] + 2.0 * (w * p2 + u * p1 - v * p0)


@kernel()
def _net_in_space(nodes: Nodes, rigid: RigidSolids) -> None:
    """Wrench of loads and joints on every rigid block about its centre, in space."""
    for b in range(rigid.centre.shape[0]):
        for r in range(6):
            rigid.net[b, r] = rigid.load[b, r]
    force, shift, net = nodes.force, nodes.shift, rigid.net
    for i in rigid.node:
        b = nodes.body[i]
        fx, fy, fz = force[i, 0], force[i, 1], force[i, 2]
        x = nodes.place[i, 0] + shift[i, 0] - rigid.centre[b, 0] - rigid.shift[b, 0]
        y = nodes.place[i, 1] + shift[i, 1] - rigid.centre[b, 1] - rigid.shift[b, 1]
        z = nodes.place[i, 2] + shift[i, 2] - rigid.centre[b, 2] - rigid.shift[b, 2]
        net[b, 0] += fx
        net[b, 1] += fy
        net[b, 2] += fz
        net[b, 3] += y * fz - z * fy
        net[b, 4] += z * fx - x * fz
        net[b, 5] += x * fy - y * fx


@kernel(counted=True)
def advance_zones(model: ZonedArrays, steps: int, dt: float, local: float, drifts: bool) -> None:
    """Advance by a number of steps in the plane under constant loads and drive velocities.

    Parameters
    ----------
    dt : [s], 1 where masses are scaled to the step
    local, drifts : see :func:`dem.kernels.local_damping.brake_of`
    """
    nodes, zones, tables, sides, contacts, rigid, law, soft, total = model
    rigid.total[:] = 0.0
    for _ in range(steps):
        _apply(nodes, 2)
        zone_forces(nodes, zones, tables, total)
        joint_forces(nodes, sides, contacts, law, soft, total)
        _net(nodes, rigid)
        move(nodes, rigid, total, 2, 3, dt, local, drifts)
        _carry(nodes, rigid)


@kernel(counted=True)
def advance_solids(model: ZonedArrays, steps: int, dt: float, local: float, drifts: bool) -> None:
    """Advance by a number of steps in space, with the arguments of :func:`advance_zones`."""
    nodes, zones, tables, sides, contacts, rigid, law, soft, total = model
    rigid.total[:] = 0.0
    for _ in range(steps):
        _apply(nodes, 3)
        solid_forces(nodes, zones, tables)
        solid_joint_forces(nodes, sides, contacts, law, soft, total)
        _net_in_space(nodes, rigid)
        move(nodes, rigid, total, 3, 6, dt, local, drifts)
        for b in range(rigid.centre.shape[0]):
            _turn(rigid, b, dt)
        _carry_in_space(nodes, rigid)
