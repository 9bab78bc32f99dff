"""Time stepping of zones, their joints and rigid blocks among them, in plane."""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.local_damping import brake_of
from dem.kernels.zone_arrays import Z_APPLIED, Z_DAMPING, Z_KINETIC, Z_STEPS, Z_SUPPORT, Nodes, Rigid, ZonedArrays
from dem.kernels.zones import joint_forces, zone_forces


@kernel(forceinline=True)
def _turned_moment(rigid: Rigid, b: int) -> float:
    """Change of the moment [N m] of block b's loads as their points turn with it.

    It is that of (R - I) sum of r f^T.
    """
    arms, turn = rigid.arms, rigid.shift[b, 2]
    less, s = -2.0 * np.sin(0.5 * turn) ** 2, np.sin(turn)
    return less * (arms[b, 0, 1] - arms[b, 1, 0]) - s * (arms[b, 0, 0] + arms[b, 1, 1])


@kernel(forceinline=True)
def move(nodes: Nodes, rigid: Rigid, total: Array, dt: float, local: float, drifts: bool) -> None:
    """One step of F - brake = m dv / dt for nodes of zones and for rigid blocks.

    Parameters
    ----------
    nodes, rigid : nodes and rigid blocks, moved
    total : works and losses so far [J], number of steps: entries ``Z_...``, added to
    dt : step [s], 1 where masses are scaled to the step
    local : factor of local damping [-]
    drifts : whether motion is steady and damping the combined one
    """
    force, shift, velocity = nodes.force, nodes.shift, nodes.velocity
    applied = support = damping = kinetic = 0.0
    for i in range(nodes.mass.size):
        if nodes.body[i] >= 0:
            continue  # carried by a rigid block
        inverse = dt / nodes.mass[i]
        for r in range(2):
            f, v = force[i, r], velocity[i, r]
            if nodes.held[i, r]:
                # it keeps its velocity, and the support takes the force
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
        for r in range(3):
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
            load = rigid.load[b, r] + (_turned_moment(rigid, b) if r == 2 else 0.0)
            applied += load * mean * dt
            rigid.velocity[b, r] = new
            rigid.shift[b, r] += dt * new
    total[Z_APPLIED] += applied
    total[Z_SUPPORT] += support
    total[Z_DAMPING] += damping
    total[Z_KINETIC] = kinetic
    total[Z_STEPS] += 1.0


@kernel(forceinline=True)
def _apply(nodes: Nodes) -> None:
    """Begin the forces of all nodes with the loads."""
    for i in range(nodes.mass.size):
        for r in range(2):
            nodes.force[i, r] = nodes.load[i, r]


@kernel()
def _carry(nodes: Nodes, rigid: Rigid) -> None:
    """Carry the nodes of rigid blocks along: u + (R - I) r, r from the centre.

    r is in the reference position.
    """
    for i in rigid.node:
        b = nodes.body[i]
        turn = rigid.shift[b, 2]
        # cosine less one without cancellation, and sine
        less, s = -2.0 * np.sin(0.5 * turn) ** 2, np.sin(turn)
        rx, ry = nodes.place[i, 0] - rigid.centre[b, 0], nodes.place[i, 1] - rigid.centre[b, 1]
        nodes.shift[i, 0] = rigid.shift[b, 0] + less * rx - s * ry
        nodes.shift[i, 1] = rigid.shift[b, 1] + less * ry + s * rx


@kernel()
def _net(nodes: Nodes, rigid: Rigid) -> None:
    """Write force [N] and moment [N m] of every rigid block to ``rigid.net``.

    They are of loads and of joints, at the ``nodes``; the moment is about the centre.
    """
    for b in range(rigid.centre.shape[0]):
        for r in range(3):
            rigid.net[b, r] = rigid.load[b, r]
        rigid.net[b, 2] += _turned_moment(rigid, b)
    force, shift = nodes.force, nodes.shift
    for i in rigid.node:
        b = nodes.body[i]
        rigid.net[b, 0] += force[i, 0]
        rigid.net[b, 1] += force[i, 1]
        rx = nodes.place[i, 0] + shift[i, 0] - rigid.centre[b, 0] - rigid.shift[b, 0]
        ry = nodes.place[i, 1] + shift[i, 1] - rigid.centre[b, 1] - rigid.shift[b, 1]
        rigid.net[b, 2] += rx * force[i, 1] - ry * force[i, 0]


@kernel(counted=True)
def advance_zones(model: ZonedArrays, steps: int, dt: float, local: float, drifts: bool) -> None:
    """Advance by a number of steps under constant loads and drive velocities.

    Parameters
    ----------
    model : all arrays of the model, changed
    steps : how many
    dt : step [s], 1 where masses are scaled to the step
    local : factor of local damping [-]
    drifts : whether motion is steady and damping the combined one
    """
    nodes, zones, tables, sides, contacts, rigid, law, soft, total = model
    rigid.total[:] = 0.0
    for _ in range(steps):
        _apply(nodes)
        zone_forces(nodes, zones, tables, total)
        joint_forces(nodes, sides, contacts, law, soft, total)
        _net(nodes, rigid)
        move(nodes, rigid, total, dt, local, drifts)
        _carry(nodes, rigid)
