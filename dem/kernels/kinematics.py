"""Relative motion of the two blocks of a joint: faces that share points, edges."""

import numpy as np

from dem.kernels.arrays import Array, Joints, RigidBodies
from dem.kernels.compiled import kernel

Numbers = tuple[float, ...]
Axes = tuple[Numbers, Numbers, Numbers]


@kernel(inline="always")
def kinematics(j: int, joints: Joints, bodies: RigidBodies) -> tuple[Axes, Numbers, Numbers, Numbers, Numbers]:
    """Frame of joint j now, motion of block b against a there, and both arms.

    ``joints`` and ``bodies`` are all of them. Tuples are returned, inlined so that they stay in registers.

    Returns
    -------
    axes : rows t1, t2, n of the joint in global axes, as block a carries them
    d : displacement of b's joint origin against a's along t1, t2, n [m]
    g : first two columns of G = R_rel - I in these axes, row by row: G11, G12, G21, G22, G31, G32 [-]
    ra, rb : from the centroids of a and of b to block a's joint origin, global axes [m]
    """
    a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
    # indices instead of views: a view costs a reference count, and there are thousands of joints per millisecond
    rot, ca, cb, frame = bodies.rot, joints.arm_a, joints.arm_b, joints.frame
    shift, offset = bodies.shift, joints.offset
    r00, r01, r02 = rot[a, 0, 0], rot[a, 0, 1], rot[a, 0, 2]
    r10, r11, r12 = rot[a, 1, 0], rot[a, 1, 1], rot[a, 1, 2]
    r20, r21, r22 = rot[a, 2, 0], rot[a, 2, 1], rot[a, 2, 2]
    # both arms turned with their blocks: ``rot`` holds R - I, so that a small turn keeps its digits
    c0, c1, c2 = ca[j, 0], ca[j, 1], ca[j, 2]
    wa0 = r00 * c0 + r01 * c1 + r02 * c2
    wa1 = r10 * c0 + r11 * c1 + r12 * c2
    wa2 = r20 * c0 + r21 * c1 + r22 * c2
    ra = (c0 + wa0, c1 + wa1, c2 + wa2)
    c0, c1, c2 = cb[j, 0], cb[j, 1], cb[j, 2]
    wb0 = rot[b, 0, 0] * c0 + rot[b, 0, 1] * c1 + rot[b, 0, 2] * c2
    wb1 = rot[b, 1, 0] * c0 + rot[b, 1, 1] * c1 + rot[b, 1, 2] * c2
    wb2 = rot[b, 2, 0] * c0 + rot[b, 2, 1] * c1 + rot[b, 2, 2] * c2
    # from a's joint origin to b's
    gap0 = offset[j, 0] + (shift[b, 0] - shift[a, 0]) + (wb0 - wa0)
    gap1 = offset[j, 1] + (shift[b, 1] - shift[a, 1]) + (wb1 - wa1)
    gap2 = offset[j, 2] + (shift[b, 2] - shift[a, 2]) + (wb2 - wa2)
    rb = (c0 + wb0 - gap0, c1 + wb1 - gap1, c2 + wb2 - gap2)
    e0, e1, e2 = frame[j, 0, 0], frame[j, 0, 1], frame[j, 0, 2]
    p0, p1, p2 = frame[j, 1, 0], frame[j, 1, 1], frame[j, 1, 2]
    n0, n1, n2 = frame[j, 2, 0], frame[j, 2, 1], frame[j, 2, 2]
    t1 = (e0 + r00 * e0 + r01 * e1 + r02 * e2, e1 + r10 * e0 + r11 * e1 + r12 * e2, e2 + r20 * e0 + r21 * e1 + r22 * e2)
    t2 = (p0 + r00 * p0 + r01 * p1 + r02 * p2, p1 + r10 * p0 + r11 * p1 + r12 * p2, p2 + r20 * p0 + r21 * p1 + r22 * p2)
    n = (n0 + r00 * n0 + r01 * n1 + r02 * n2, n1 + r10 * n0 + r11 * n1 + r12 * n2, n2 + r20 * n0 + r21 * n1 + r22 * n2)
    d = (
        t1[0] * gap0 + t1[1] * gap1 + t1[2] * gap2,
        t2[0] * gap0 + t2[1] * gap1 + t2[2] * gap2,
        n[0] * gap0 + n[1] * gap1 + n[2] * gap2,
    )
    quat, turn = bodies.quat, joints.turn
    a0, a1, a2, a3 = quat[a, 0], quat[a, 1], quat[a, 2], quat[a, 3]
    b0, b1, b2, b3 = quat[b, 0], quat[b, 1], quat[b, 2], quat[b, 3]
    k0, k1, k2, k3 = turn[j, 0], turn[j, 1], turn[j, 2], turn[j, 3]
    # turn of b against a, conj(q_a) q_b, times what undoes the turn at which the joint was made
    h0 = a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3
    h1 = a0 * b1 - a1 * b0 - (a2 * b3 - a3 * b2)
    h2 = a0 * b2 - a2 * b0 - (a3 * b1 - a1 * b3)
    h3 = a0 * b3 - a3 * b0 - (a1 * b2 - a2 * b1)
    s0 = h0 * k0 - h1 * k1 - h2 * k2 - h3 * k3
    y0 = h0 * k1 + h1 * k0 + h2 * k3 - h3 * k2
    y1 = h0 * k2 + h2 * k0 + h3 * k1 - h1 * k3
    y2 = h0 * k3 + h3 * k0 + h1 * k2 - h2 * k1
    # its vector part in the joint's axes, and G = R_rel - I of a unit quaternion
    v1 = e0 * y0 + e1 * y1 + e2 * y2
    v2 = p0 * y0 + p1 * y1 + p2 * y2
    v3 = n0 * y0 + n1 * y1 + n2 * y2
    g = (
        -2.0 * (v2 * v2 + v3 * v3), 2.0 * (v1 * v2 - s0 * v3), 2.0 * (v1 * v2 + s0 * v3),
        -2.0 * (v1 * v1 + v3 * v3), 2.0 * (v3 * v1 - s0 * v2), 2.0 * (v3 * v2 + s0 * v1),
    )
    return (t1, t2, n), d, g, ra, rb


@kernel(forceinline=True)
def third_axis(g: Numbers) -> Numbers:
    """Third column of R_rel, the vector product of the first two.

    ``g`` is G11, G12, G21, G22, G31, G32 of G = R_rel - I.
    """
    r1, r2, r3 = 1.0 + g[0], g[2], g[4]
    q1, q2, q3 = g[1], 1.0 + g[3], g[5]
    return r2 * q3 - r3 * q2, r3 * q1 - r1 * q3, r1 * q2 - r2 * q1


@kernel(fast=False)
def turn_row(rot: Array, i: int, x: float, y: float, z: float) -> Numbers:
    """(x, y, z) of block i's axes in global ones; ``rot`` is R - I of all, (n, 3, 3)."""
    return (
        x + rot[i, 0, 0] * x + rot[i, 0, 1] * y + rot[i, 0, 2] * z,
        y + rot[i, 1, 0] * x + rot[i, 1, 1] * y + rot[i, 1, 2] * z,
        z + rot[i, 2, 0] * x + rot[i, 2, 1] * y + rot[i, 2, 2] * z,
    )


@kernel(fast=False)
def cross(u: Numbers, v: Numbers) -> Numbers:
    """Vector product."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@kernel(fast=False)
def dot(u: Numbers, v: Numbers) -> float:
    """Scalar product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


PARALLEL = 1e-9
"""Sine of the angle below which edges that cross have become parallel: their normal is then lost in rounding."""


@kernel(fast=False)
def crossing(j: int, joints: Joints, bodies: RigidBodies) -> tuple[Axes, float, Numbers, Numbers]:
    """Where the edges of joint j pass each other now.

    n is the cross product of the edges as they lie now: the normal force is the gradient of an energy of the distance,
    as n turns without work at the closest points. Both arms end in b's closest point.

    The distance is infinite where the edges became parallel, where they have passed through that, which turns n around,
    and where they pass each other beyond their ends: nearly parallel ones would do so at arms of any length.

    Parameters
    ----------
    joints, bodies : all of them

    Returns
    -------
    axes : t1 along a's edge, t2, and n from a to b, in global axes
    distance : of b's edge from a's along n, negative where they overlap [m]
    ra, rb : arms from either centroid to b's closest point, global axes [m]
    """
    a, b = joints.block_a[j], joints.block_b[j]
    rot, ca, cb, frame, edge = bodies.rot, joints.arm_a, joints.arm_b, joints.frame, joints.edge
    ea = turn_row(rot, a, frame[j, 0, 0], frame[j, 0, 1], frame[j, 0, 2])
    eb = turn_row(rot, b, edge[j, 0], edge[j, 1], edge[j, 2])
    pa = turn_row(rot, a, ca[j, 0], ca[j, 1], ca[j, 2])
    pb = turn_row(rot, b, cb[j, 0], cb[j, 1], cb[j, 2])
    shift, offset = bodies.shift, joints.offset
    # from a's point to b's: the arms in the reference position are in the offset
    d = (
        offset[j, 0] + shift[b, 0] - shift[a, 0] + (pb[0] - cb[j, 0]) - (pa[0] - ca[j, 0]),
        offset[j, 1] + shift[b, 1] - shift[a, 1] + (pb[1] - cb[j, 1]) - (pa[1] - ca[j, 1]),
        offset[j, 2] + shift[b, 2] - shift[a, 2] + (pb[2] - cb[j, 2]) - (pa[2] - ca[j, 2]),
    )
    m = cross(ea, eb)
    size = np.sqrt(dot(m, m))
    if size < PARALLEL:
        return (ea, ea, ea), np.inf, pa, pb
    n = (m[0] / size, m[1] / size, m[2] / size)
    # from the joint's points to the closest ones: ``far`` along b's edge, ``along`` on a's, both edges of unit length
    far = dot(cross(d, ea), n) / size
    along, limits = dot(d, ea) + far * dot(eb, ea), joints.limits
    within = limits[j, 0] <= along and along <= limits[j, 1] and limits[j, 2] <= far and far <= limits[j, 3]
    if not within or dot(n, turn_row(rot, a, frame[j, 2, 0], frame[j, 2, 1], frame[j, 2, 2])) <= 0.0:
        return (ea, ea, ea), np.inf, pa, pb
    rb = (pb[0] + far * eb[0], pb[1] + far * eb[1], pb[2] + far * eb[2])
    ra = (pa[0] + d[0] + far * eb[0], pa[1] + d[1] + far * eb[1], pa[2] + d[2] + far * eb[2])
    return (ea, cross(n, ea), n), dot(n, d), ra, rb


@kernel(forceinline=True)
def relative_motion(
    j: int, joints: Joints, bodies: RigidBodies, axes: Axes, ra: Numbers, rb: Numbers
) -> Numbers:
    """Velocity [m/s] and spin [rad/s] of b against a at the origin of joint j.

    They are in its axes t1, t2, n.

    Parameters
    ----------
    joints, bodies : all of them
    axes : rows t1, t2, n of the joint now, global axes
    ra, rb : arms from either centroid to its origin, global axes [m]

    Returns
    -------
    three components of the velocity, then three of the spin
    """
    a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
    vel, spin = bodies.vel, bodies.spin
    va, oa = (vel[a, 0], vel[a, 1], vel[a, 2]), (spin[a, 0], spin[a, 1], spin[a, 2])
    vb, ob = (vel[b, 0], vel[b, 1], vel[b, 2]), (spin[b, 0], spin[b, 1], spin[b, 2])
    j0 = vb[0] - va[0] + ob[1] * rb[2] - ob[2] * rb[1] - oa[1] * ra[2] + oa[2] * ra[1]
    j1 = vb[1] - va[1] + ob[2] * rb[0] - ob[0] * rb[2] - oa[2] * ra[0] + oa[0] * ra[2]
    j2 = vb[2] - va[2] + ob[0] * rb[1] - ob[1] * rb[0] - oa[0] * ra[1] + oa[1] * ra[0]
    o0, o1, o2 = ob[0] - oa[0], ob[1] - oa[1], ob[2] - oa[2]
    t1, t2, n = axes
    return (
        t1[0] * j0 + t1[1] * j1 + t1[2] * j2, t2[0] * j0 + t2[1] * j1 + t2[2] * j2, n[0] * j0 + n[1] * j1 + n[2] * j2,
        t1[0] * o0 + t1[1] * o1 + t1[2] * o2, t2[0] * o0 + t2[1] * o1 + t2[2] * o2, n[0] * o0 + n[1] * o1 + n[2] * o2,
    )
