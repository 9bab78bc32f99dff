"""Time stepping of zones in space, their joints and rigid blocks, and the reading of a position."""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.solid_arrays import FaceContacts, Facets, Hexahedra, HexTable, RigidSolids
from dem.kernels.solid_joints import solid_joint_forces, solid_joint_stresses
from dem.kernels.solid_zones import solid_forces, solid_stresses
from dem.kernels.zone_arrays import Nodes
from dem.kernels.zone_motion import move


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
def _place_rigid(nodes: Nodes, rigid: RigidSolids) -> None:
    """Carry the nodes of rigid blocks along."""
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
def _rigid_net(nodes: Nodes, rigid: RigidSolids) -> None:
    """Wrench of loads and joints on every rigid block about its centre."""
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
def advance_solids(
    nodes: Nodes, zones: Hexahedra, table: HexTable, facets: Facets, contacts: FaceContacts, law: Array, soft: bool,
    rigid: RigidSolids, total: Array, steps: int, dt: float, local: float, drifts: bool,
) -> None:  # fmt: skip
    """Advance by a number of steps under constant loads and drives, as ``zones.advance_zones`` does in the plane."""
    force = nodes.force
    rigid.total[:] = 0.0
    n, nb = nodes.mass.size, rigid.centre.shape[0]
    for _ in range(steps):
        for i in range(n):
            for r in range(3):
                force[i, r] = nodes.load[i, r]
        solid_forces(nodes, zones, table)
        solid_joint_forces(nodes, facets, contacts, law, soft, total)
        _rigid_net(nodes, rigid)
        move(nodes, rigid, total, 3, 6, dt, local, drifts)
        for b in range(nb):
            _turn(rigid, b, dt)
        _place_rigid(nodes, rigid)


@kernel(counted=True)
def measure_solids(
    nodes: Nodes, zones: Hexahedra, table: HexTable, facets: Facets, contacts: FaceContacts, law: Array,
    stresses: Array, joint: Array,
) -> float:  # fmt: skip
    """Stresses and joint forces in the present position; elastic energy of zones and joints [J]. Changes no state.

    Parameters
    ----------
    stresses : as ``solid_zones.solid_stresses`` writes them, shape (e, 8, 6)
    joint : as ``solid_joints.solid_joint_stresses`` writes them, shape (m, 6)
    """
    energy = solid_stresses(nodes, zones, table, stresses)
    return energy + solid_joint_stresses(nodes, facets, contacts, law, joint)
