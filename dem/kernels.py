"""Compiled functions of the explicit distinct element method: contact law, joint kinematics and time stepping.

Every jitted function of ``dem`` lives in this file: numba's disk cache does not notice an edit in an imported module.

Blocks carry a displacement u of the centroid and a unit quaternion q (rotation from the reference position). A joint
owns its contact points: coordinates (s, t) on a plane carried by block a, frame (t1, t2, n). With d the displacement of
block b's joint origin against block a's in that frame, and G = R_rel - I, the total relative displacement at a point is
delta = d + G (s, t, 0): exact at any rotation, without drift. Forces act at block b's material point, on b and opposite
on a, so that elastic contact conserves energy and momentum exactly in continuous time.

Stress at a point, compression positive, w the opening, w_p plastic opening (dilation) and g the initial gap:
N = kn (w_p - g - w), T = ks (plastic slip - slip), N >= -ft, |T| <= c + tan(phi) N; slip by p opens w_p by tan(psi) p,
in an open point too: limit analysis demands the same, opening >= tan(psi) slip.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}


class Points(NamedTuple):
    """Contact points as a structure of arrays: places [m], tributary area [m2], gap [m] and plastic state [m], (m,)."""

    s: Array
    t: Array
    area: Array
    gap: Array  # opening at zero relative displacement
    slip_1: Array  # plastic slip along t1
    slip_2: Array
    lift: Array  # plastic opening w_p
    damage: Array  # 0 peak, 1 residual


class Joints(NamedTuple):
    """Joints: blocks, runs of points, frame in block a, joint origin in both bodies, and the law."""

    block_a: Index  # (k,)
    block_b: Index  # (k,)
    start: Index  # first point of each joint, (k + 1,)
    frame: Array  # rows t1, t2, n in the reference axes of block a, (k, 3, 3)
    turn: Array  # quaternion undoing the relative rotation at which the joint was made, (k, 4)
    arm_a: Array  # joint origin from the centroid of a, reference axes of a [m], (k, 3)
    arm_b: Array  # joint origin from the centroid of b, reference axes of b [m], (k, 3)
    offset: Array  # (X_b + arm_b) - (X_a + arm_a) in the reference position [m], (k, 3)
    law: Array  # (k, 16), see the LAW_ indices; LAW_CROSS is 1 where two edges cross
    edge: Array  # direction of b's edge, reference axes of b, where two edges cross (a's is frame row t1), (k, 3)


LAW_KN, LAW_KS, LAW_MU, LAW_DIL, LAW_C, LAW_FT, LAW_FC, LAW_LIFT = 0, 1, 2, 3, 4, 5, 6, 7
LAW_MU_R, LAW_DIL_R, LAW_C_R, LAW_FT_R, LAW_RATE, LAW_DASH, LAW_CROSS = 8, 9, 10, 11, 12, 13, 14
LAW_SIZE = 16


class Bodies(NamedTuple):
    """Blocks: state of motion, inverse inertia, held degrees of freedom, and the wrenches of the last step."""

    shift: Array  # displacement of the centroid [m], (n, 3)
    quat: Array  # rotation from the reference position, scalar first, (n, 4)
    rot: Array  # R - I, (n, 3, 3)
    vel: Array  # velocity at the half step [m/s], (n, 3)
    spin: Array  # angular velocity at the half step [rad/s], (n, 3)
    ang: Array  # angular momentum at the half step [kg m2/s], (n, 3)
    mass: Array  # (n,)
    inv_mass: Array  # (n,)
    inv_inertia: Array  # reference axes, (n, 3, 3)
    held: NDArray[np.bool_]  # (n, 6)
    contact: Array  # wrench of the joints about the centroid in the last step [N, N m], (n, 6)
    net: Array  # contact plus applied wrench, without damping, (n, 6)


# entries of the vector of accumulated scalars
E_FRICTION, E_VISCOUS, E_DAMPING, E_APPLIED, E_SUPPORT = 0, 1, 2, 3, 4
E_KINETIC, E_VISCOSITY, E_STEPS, E_STOP, E_FRACTURE = 5, 6, 7, 8, 9
E_SIZE = 10
STOP_EVERY = 10.0  # fewest steps between two stops: fast modes are left to local damping


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, forceinline=True)
def _sum_plain(s, t, area, gap, slip_1, slip_2, lift, p0, p1, d, g, j, law, lifts):
    """Sum of forces (t1, t2, n), moments about block a's joint origin and plastic work; perfectly plastic law.

    ``lifts`` is a constant in each call: without dilation and crushing the lift stays: a quarter less work.
    """
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    kn, ks, mu, dil = law[j, LAW_KN], law[j, LAW_KS], law[j, LAW_MU], law[j, LAW_DIL]
    c, ft, fc, highest = law[j, LAW_C], law[j, LAW_FT], law[j, LAW_FC], law[j, LAW_LIFT]
    flow = dil / (ks + kn * mu * dil)
    inv_ks = 1.0 / ks
    edge, cut = max(c - mu * ft, 0.0), ft / kn  # shear strength and opening of a point pulled to its strength
    f1 = f2 = f3 = m1 = m2 = m3 = work = 0.0
    # unsigned: no index from the end to allow for, so that the loop over part of the arrays vectorises without views
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        e1 = d1 + g11 * x + g12 * y
        e2 = d2 + g21 * x + g22 * y
        e3 = d3 + g31 * x + g32 * y
        w = e3 + gap[k]
        old = lift[k]
        a1 = slip_1[k] - e1
        a2 = slip_2[k] - e2
        trial = ks * np.sqrt(a1 * a1 + a2 * a2)
        n0 = kn * (old - w)
        if lifts:
            # dilation in a closed joint, consistent with the friction it mobilises; crushing closes what exceeds fc
            over = max(trial - c - mu * n0, 0.0)
            # at the apex too: an open point keeps the opening that goes with its slip, and is pressed if it slides more
            apart = min(dil * max(trial - edge, 0.0) * inv_ks, max(w - cut - old, 0.0))
            grow = min(flow * over if n0 + kn * flow * over > -ft else apart, max(highest - old, 0.0))
            new = min(old + grow, w + fc)
            n = max(kn * (new - w), -ft)
            lift[k] = new
            work -= area[k] * n * (new - old)
        else:
            n = max(n0, -ft)
        cap = max(c + mu * n, 0.0)
        ratio = min(cap / max(trial, 1e-300), 1.0)
        p = (1.0 - ratio) * trial * inv_ks
        da = area[k]
        slip_1[k] -= (1.0 - ratio) * a1
        slip_2[k] -= (1.0 - ratio) * a2
        q1 = ks * ratio * a1 * da
        q2 = ks * ratio * a2 * da
        q3 = n * da
        work += da * cap * p
        f1 += q1
        f2 += q2
        f3 += q3
        x += e1
        y += e2
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
    return f1, f2, f3, m1, m2, m3, work, 0.0, 0.0


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, forceinline=True)
def _sum_full(s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, d, g, rate, turn, j, law, dt):
    """As :func:`_sum_plain`, with softening to residual values and dashpots that only act where the joint is closed.

    A dashpot lies beside the spring and both in line with the slider (Kelvin and Voigt's element, then Coulomb's): the
    law limits what spring and dashpot carry together, |T| <= c + tan(phi) N with the N of both, and the dashpot feels
    the rate of the elastic part, not the slip. A step dt adds dash / dt to the stiffness against plastic slip.
    """
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    kn, ks, mu0, dil0 = law[j, LAW_KN], law[j, LAW_KS], law[j, LAW_MU], law[j, LAW_DIL]
    c0, ft0, fc, highest = law[j, LAW_C], law[j, LAW_FT], law[j, LAW_FC], law[j, LAW_LIFT]
    mu1, dil1, c1, ft1 = law[j, LAW_MU_R] - mu0, law[j, LAW_DIL_R] - dil0, law[j, LAW_C_R] - c0, law[j, LAW_FT_R] - ft0
    soften, dash = law[j, LAW_RATE], law[j, LAW_DASH]
    inv_ks = 1.0 / ks
    # without a step there is no motion to brake
    per_dt = 1.0 / dt if dt > 0.0 else 0.0
    dash = dash if dt > 0.0 else 0.0
    v1, v2, v3 = rate
    o1, o2, o3 = turn
    f1 = f2 = f3 = m1 = m2 = m3 = work = lost = broken = 0.0
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        e1 = d1 + g11 * x + g12 * y
        e2 = d2 + g21 * x + g22 * y
        e3 = d3 + g31 * x + g32 * y
        w = e3 + gap[k]
        old = lift[k]
        a1 = slip_1[k] - e1
        a2 = slip_2[k] - e2
        trial = ks * np.sqrt(a1 * a1 + a2 * a2)
        n0 = kn * (old - w)
        # dashpots: velocity of b against a at the point, none in an open joint
        y1, y2 = x + e1, y + e2
        z = dash if n0 > -(ft0 + damage[k] * ft1) else 0.0
        r1 = v1 + o2 * e3 - o3 * y2
        r2 = v2 + o3 * y1 - o1 * e3
        r3 = v3 + o1 * y2 - o2 * y1
        b1, b2 = ks * (a1 - z * r1), ks * (a2 - z * r2)
        stiffer = 1.0 + z * per_dt
        h0 = h = damage[k]
        # damage by opening beyond the tension cut-off (not cumulative), then by slip (cumulative)
        h = min(max(h, soften * max(-n0 - (ft0 + h * ft1), 0.0) / kn), 1.0)
        mu, dil = mu0 + h * mu1, dil0 + h * dil1
        total = np.sqrt(b1 * b1 + b2 * b2)
        pressed = n0 - z * kn * r3
        over = max(total - (c0 + h * c1) - mu * max(pressed, -(ft0 + h * ft1)), 0.0) / stiffer
        h = min(h + soften * over * inv_ks, 1.0)
        mu, dil, c, ft = mu0 + h * mu1, dil0 + h * dil1, c0 + h * c1, ft0 + h * ft1
        over = max(total - c - mu * pressed, 0.0)
        apart = min(dil * max(trial - max(c - mu * ft, 0.0), 0.0) * inv_ks, max(w - ft / kn - old, 0.0))
        rise = dil * over / (stiffer * (ks + kn * mu * dil))
        grow = min(rise if n0 + kn * rise > -ft else apart, max(highest - old, 0.0))
        new = min(old + grow, w + fc)
        n = max(kn * (new - w), -ft)
        # no pull beyond the strength
        z3 = max(z * kn * ((new - old) * per_dt - r3), -ft - n)
        cap = max(c + mu * (n + z3), 0.0)
        ratio = min(cap / max(total, 1e-300), 1.0)
        p = (1.0 - ratio) * total * inv_ks / stiffer
        da = area[k]
        back = (1.0 - ratio) / (ks * stiffer)
        slip_1[k] -= back * b1
        slip_2[k] -= back * b2
        lift[k] = new
        damage[k] = h
        # the normal stress that the slip's opening works against is that of spring and dashpot
        work += da * (cap * p - (n + z3) * (new - old))
        # what damage releases at this opening and slip: stored energy under the strength before less that under the new
        pull, held = max(-n0, 0.0), ft0 + h0 * ft1
        before, after = min(pull, held), min(pull, ft)
        drop = min(trial, max(c0 + h0 * c1 + (mu0 + h0 * mu1) * max(n0, -held), 0.0)) - max(c + mu * n, 0.0)
        drop = max(drop, 0.0) if h > h0 else 0.0
        broken += da * (
            ((before - after) * pull - 0.5 * (before * before - after * after)) / kn + 0.5 * drop * drop * inv_ks
        )
        x, y = y1, y2
        # force of the dashpots times the rate of the elastic part
        r1 += back * b1 * per_dt
        r2 += back * b2 * per_dt
        lost += da * (z * ks * (r1 * r1 + r2 * r2) + z3 * ((new - old) * per_dt - r3))
        q1 = ratio * b1 * da
        q2 = ratio * b2 * da
        q3 = (n + z3) * da
        f1 += q1
        f2 += q2
        f3 += q3
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
    return f1, f2, f3, m1, m2, m3, work, lost, broken


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, inline="always")
def _kinematics(j, joints, bodies):
    """Frame of joint j in global axes (rows), relative displacement d of its origin, G = R_rel - I, and both arms.

    Returns tuples, inlined so that they stay in registers: the frame's rows t1, t2, n; d (3) in the frame;
    g (6) = (G11, G12, G21, G22, G31, G32); ra and rb (3), from the centroids to block a's joint origin, global axes.
    """
    a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
    # indices instead of views: a view costs a reference count, and there are thousands of joints per millisecond
    rot, ca, cb, frame = bodies.rot, joints.arm_a, joints.arm_b, joints.frame
    shift, offset = bodies.shift, joints.offset
    r00, r01, r02 = rot[a, 0, 0], rot[a, 0, 1], rot[a, 0, 2]
    r10, r11, r12 = rot[a, 1, 0], rot[a, 1, 1], rot[a, 1, 2]
    r20, r21, r22 = rot[a, 2, 0], rot[a, 2, 1], rot[a, 2, 2]
    c0, c1, c2 = ca[j, 0], ca[j, 1], ca[j, 2]
    wa0 = r00 * c0 + r01 * c1 + r02 * c2
    wa1 = r10 * c0 + r11 * c1 + r12 * c2
    wa2 = r20 * c0 + r21 * c1 + r22 * c2
    ra = (c0 + wa0, c1 + wa1, c2 + wa2)
    c0, c1, c2 = cb[j, 0], cb[j, 1], cb[j, 2]
    wb0 = rot[b, 0, 0] * c0 + rot[b, 0, 1] * c1 + rot[b, 0, 2] * c2
    wb1 = rot[b, 1, 0] * c0 + rot[b, 1, 1] * c1 + rot[b, 1, 2] * c2
    wb2 = rot[b, 2, 0] * c0 + rot[b, 2, 1] * c1 + rot[b, 2, 2] * c2
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
    # conj(p) q, then times k
    h0 = a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3
    h1 = a0 * b1 - a1 * b0 - (a2 * b3 - a3 * b2)
    h2 = a0 * b2 - a2 * b0 - (a3 * b1 - a1 * b3)
    h3 = a0 * b3 - a3 * b0 - (a1 * b2 - a2 * b1)
    s0 = h0 * k0 - h1 * k1 - h2 * k2 - h3 * k3
    y0 = h0 * k1 + h1 * k0 + h2 * k3 - h3 * k2
    y1 = h0 * k2 + h2 * k0 + h3 * k1 - h1 * k3
    y2 = h0 * k3 + h3 * k0 + h1 * k2 - h2 * k1
    v1 = e0 * y0 + e1 * y1 + e2 * y2
    v2 = p0 * y0 + p1 * y1 + p2 * y2
    v3 = n0 * y0 + n1 * y1 + n2 * y2
    g = (
        -2.0 * (v2 * v2 + v3 * v3), 2.0 * (v1 * v2 - s0 * v3), 2.0 * (v1 * v2 + s0 * v3),
        -2.0 * (v1 * v1 + v3 * v3), 2.0 * (v3 * v1 - s0 * v2), 2.0 * (v3 * v2 + s0 * v1),
    )  # fmt: skip
    return (t1, t2, n), d, g, ra, rb


@njit(cache=True, error_model="numpy", nogil=True)
def _turn_row(rot, i, x, y, z):
    """(I + rot[i]) (x, y, z)."""
    return (
        x + rot[i, 0, 0] * x + rot[i, 0, 1] * y + rot[i, 0, 2] * z,
        y + rot[i, 1, 0] * x + rot[i, 1, 1] * y + rot[i, 1, 2] * z,
        z + rot[i, 2, 0] * x + rot[i, 2, 1] * y + rot[i, 2, 2] * z,
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _cross(u, v):
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@njit(cache=True, error_model="numpy", nogil=True)
def _dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@njit(cache=True, error_model="numpy", nogil=True)
def _crossing(j, joints, bodies):
    """Where the edges of joint j pass each other now: axes (t1 along a's edge, t2, n), distance along n, both arms.

    n is the cross product of the edges as they lie now: the normal force is the gradient of an energy of the distance,
    as n turns without work at the closest points. Both arms end in b's. Infinite distance: the edges became parallel.
    """
    a, b = joints.block_a[j], joints.block_b[j]
    rot, ca, cb, frame, edge = bodies.rot, joints.arm_a, joints.arm_b, joints.frame, joints.edge
    ea = _turn_row(rot, a, frame[j, 0, 0], frame[j, 0, 1], frame[j, 0, 2])
    eb = _turn_row(rot, b, edge[j, 0], edge[j, 1], edge[j, 2])
    pa = _turn_row(rot, a, ca[j, 0], ca[j, 1], ca[j, 2])
    pb = _turn_row(rot, b, cb[j, 0], cb[j, 1], cb[j, 2])
    shift, offset = bodies.shift, joints.offset
    # from a's point to b's: the arms in the reference position are in the offset
    d = (
        offset[j, 0] + shift[b, 0] - shift[a, 0] + (pb[0] - cb[j, 0]) - (pa[0] - ca[j, 0]),
        offset[j, 1] + shift[b, 1] - shift[a, 1] + (pb[1] - cb[j, 1]) - (pa[1] - ca[j, 1]),
        offset[j, 2] + shift[b, 2] - shift[a, 2] + (pb[2] - cb[j, 2]) - (pa[2] - ca[j, 2]),
    )
    m = _cross(ea, eb)
    size = np.sqrt(_dot(m, m))
    if size < 1e-9:
        return (ea, ea, ea), np.inf, pa, pb
    n = (m[0] / size, m[1] / size, m[2] / size)
    far = _dot(_cross(d, ea), n) / size
    rb = (pb[0] + far * eb[0], pb[1] + far * eb[1], pb[2] + far * eb[2])
    ra = (pa[0] + d[0] + far * eb[0], pa[1] + d[1] + far * eb[1], pa[2] + d[2] + far * eb[2])
    return (ea, _cross(n, ea), n), _dot(n, d), ra, rb


@njit(cache=True, error_model="numpy", nogil=True)
def _crossing_forces(points, joints, bodies, dt, total):
    """Add the forces of all crossing edges; a call from the loop of :func:`_joint_forces` would slow that by half.

    The law of :func:`_sum_full` without cohesion, tension, dilation. The point moves along both edges: shear is summed.
    """
    law, contact, vel, spin = joints.law, bodies.contact, bodies.vel, bodies.spin
    per_dt = 1.0 / dt if dt > 0.0 else 0.0
    for j in range(joints.block_a.size):
        if law[j, LAW_CROSS] == 0.0:
            continue
        a, b, k = joints.block_a[j], joints.block_b[j], joints.start[j]
        (t1, t2, n), distance, ra, rb = _crossing(j, joints, bodies)
        kn, ks = law[j, LAW_KN], law[j, LAW_KS]
        mu = law[j, LAW_MU] + points.damage[k] * (law[j, LAW_MU_R] - law[j, LAW_MU])
        w, old = distance + points.gap[k], points.lift[k]
        if not w < old:
            points.slip_1[k] = points.slip_2[k] = 0.0
            continue
        wa, wb = _cross((spin[a, 0], spin[a, 1], spin[a, 2]), ra), _cross((spin[b, 0], spin[b, 1], spin[b, 2]), rb)
        va = (vel[a, 0] + wa[0], vel[a, 1] + wa[1], vel[a, 2] + wa[2])
        vb = (vel[b, 0] + wb[0], vel[b, 1] + wb[1], vel[b, 2] + wb[2])
        r1, r2, r3 = _dot(vb, t1) - _dot(va, t1), _dot(vb, t2) - _dot(va, t2), _dot(vb, n) - _dot(va, n)
        z = law[j, LAW_DASH] if dt > 0.0 else 0.0
        new = min(old, w + law[j, LAW_FC])
        z3 = max(z * kn * ((new - old) * per_dt - r3), -kn * (new - w))
        press = kn * (new - w) + z3
        a1, a2 = points.slip_1[k] - dt * r1, points.slip_2[k] - dt * r2
        b1, b2 = ks * (a1 - z * r1), ks * (a2 - z * r2)
        trial = np.sqrt(b1 * b1 + b2 * b2)
        ratio = min(mu * press / max(trial, 1e-300), 1.0)
        back = (1.0 - ratio) / (ks * (1.0 + z * per_dt))
        points.slip_1[k], points.slip_2[k], points.lift[k] = a1 - back * b1, a2 - back * b2, new
        da = points.area[k]
        q = (ratio * b1 * da, ratio * b2 * da, press * da)
        f = _dot((t1[0], t2[0], n[0]), q), _dot((t1[1], t2[1], n[1]), q), _dot((t1[2], t2[2], n[2]), q)
        ma, mb = _cross(ra, f), _cross(rb, f)
        for i in range(3):
            contact[a, i] -= f[i]
            contact[a, 3 + i] -= ma[i]
            contact[b, i] += f[i]
            contact[b, 3 + i] += mb[i]
        braked = z * ks * ((r1 + back * b1 * per_dt) ** 2 + (r2 + back * b2 * per_dt) ** 2)
        total[E_VISCOUS] += da * (braked + z3 * ((new - old) * per_dt - r3)) * dt
        total[E_FRICTION] += da * press * (mu * back * trial - (new - old))


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, forceinline=True)
def _joint_forces(points, joints, bodies, dt, total):
    """Fill ``bodies.contact`` from all joints and update the plastic state of their points."""
    contact, vel, spin = bodies.contact, bodies.vel, bodies.spin
    contact[:] = 0.0
    law = joints.law
    s, t, area, gap, damage = points.s, points.t, points.area, points.gap, points.damage
    slip_1, slip_2, lift = points.slip_1, points.slip_2, points.lift
    friction = viscous = fracture = 0.0
    for j in range(joints.block_a.size):
        if law[j, LAW_CROSS] != 0.0:
            continue
        a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
        p0, p1 = joints.start[j], joints.start[j + 1]
        axes, d, g, ra, rb = _kinematics(j, joints, bodies)
        if law[j, LAW_RATE] == 0.0 and law[j, LAW_DASH] == 0.0:
            if law[j, LAW_DIL] == 0.0 and law[j, LAW_FC] == np.inf:
                out = _sum_plain(s, t, area, gap, slip_1, slip_2, lift, p0, p1, d, g, j, law, False)
            else:
                out = _sum_plain(s, t, area, gap, slip_1, slip_2, lift, p0, p1, d, g, j, law, True)
        else:
            va, oa = (vel[a, 0], vel[a, 1], vel[a, 2]), (spin[a, 0], spin[a, 1], spin[a, 2])
            vb, ob = (vel[b, 0], vel[b, 1], vel[b, 2]), (spin[b, 0], spin[b, 1], spin[b, 2])
            j0 = vb[0] - va[0] + ob[1] * rb[2] - ob[2] * rb[1] - oa[1] * ra[2] + oa[2] * ra[1]
            j1 = vb[1] - va[1] + ob[2] * rb[0] - ob[0] * rb[2] - oa[2] * ra[0] + oa[0] * ra[2]
            j2 = vb[2] - va[2] + ob[0] * rb[1] - ob[1] * rb[0] - oa[0] * ra[1] + oa[1] * ra[0]
            o0, o1, o2 = ob[0] - oa[0], ob[1] - oa[1], ob[2] - oa[2]
            t1, t2, n = axes
            rate = (
                t1[0] * j0 + t1[1] * j1 + t1[2] * j2,
                t2[0] * j0 + t2[1] * j1 + t2[2] * j2,
                n[0] * j0 + n[1] * j1 + n[2] * j2,
            )
            turn = (
                t1[0] * o0 + t1[1] * o1 + t1[2] * o2,
                t2[0] * o0 + t2[1] * o1 + t2[2] * o2,
                n[0] * o0 + n[1] * o1 + n[2] * o2,
            )
            out = _sum_full(s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, d, g, rate, turn, j, law, dt)
        friction += out[6]
        viscous += out[7] * dt
        fracture += out[8]
        f0 = axes[0][0] * out[0] + axes[1][0] * out[1] + axes[2][0] * out[2]
        f1 = axes[0][1] * out[0] + axes[1][1] * out[1] + axes[2][1] * out[2]
        f2 = axes[0][2] * out[0] + axes[1][2] * out[1] + axes[2][2] * out[2]
        m0 = axes[0][0] * out[3] + axes[1][0] * out[4] + axes[2][0] * out[5]
        m1 = axes[0][1] * out[3] + axes[1][1] * out[4] + axes[2][1] * out[5]
        m2 = axes[0][2] * out[3] + axes[1][2] * out[4] + axes[2][2] * out[5]
        contact[a, 0] -= f0
        contact[a, 1] -= f1
        contact[a, 2] -= f2
        contact[a, 3] -= m0 + ra[1] * f2 - ra[2] * f1
        contact[a, 4] -= m1 + ra[2] * f0 - ra[0] * f2
        contact[a, 5] -= m2 + ra[0] * f1 - ra[1] * f0
        contact[b, 0] += f0
        contact[b, 1] += f1
        contact[b, 2] += f2
        contact[b, 3] += m0 + rb[1] * f2 - rb[2] * f1
        contact[b, 4] += m1 + rb[2] * f0 - rb[0] * f2
        contact[b, 5] += m2 + rb[0] * f1 - rb[1] * f0
    total[E_FRICTION] += friction
    total[E_VISCOUS] += viscous
    total[E_FRACTURE] += fracture


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True)
def contact_wrenches(points, joints, bodies):
    """Wrench of the joints on every block in the present position, shape (n, 6), written to ``bodies.contact``."""
    _joint_forces(points, joints, bodies, 0.0, np.zeros(E_SIZE))
    _crossing_forces(points, joints, bodies, 0.0, np.zeros(E_SIZE))


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, forceinline=True)
def _spin_of(rot, inv_inertia, ang, out):
    """Omega = R J^-1 R^T L, with ``rot`` = R - I."""
    b0 = ang[0] + rot[0, 0] * ang[0] + rot[1, 0] * ang[1] + rot[2, 0] * ang[2]
    b1 = ang[1] + rot[0, 1] * ang[0] + rot[1, 1] * ang[1] + rot[2, 1] * ang[2]
    b2 = ang[2] + rot[0, 2] * ang[0] + rot[1, 2] * ang[1] + rot[2, 2] * ang[2]
    w0 = inv_inertia[0, 0] * b0 + inv_inertia[0, 1] * b1 + inv_inertia[0, 2] * b2
    w1 = inv_inertia[1, 0] * b0 + inv_inertia[1, 1] * b1 + inv_inertia[1, 2] * b2
    w2 = inv_inertia[2, 0] * b0 + inv_inertia[2, 1] * b1 + inv_inertia[2, 2] * b2
    out[0] = w0 + rot[0, 0] * w0 + rot[0, 1] * w1 + rot[0, 2] * w2
    out[1] = w1 + rot[1, 0] * w0 + rot[1, 1] * w1 + rot[1, 2] * w2
    out[2] = w2 + rot[2, 0] * w0 + rot[2, 1] * w1 + rot[2, 2] * w2


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, forceinline=True)
def _turned(q, spin, h, out):
    """Quaternion q after the rotation spin h (Cayley form, exactly of unit length), written to ``out``."""
    x, y, z = 0.5 * h * spin[0], 0.5 * h * spin[1], 0.5 * h * spin[2]
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    r0 = q0 - x * q1 - y * q2 - z * q3
    r1 = q1 + x * q0 + y * q3 - z * q2
    r2 = q2 + y * q0 + z * q1 - x * q3
    r3 = q3 + z * q0 + x * q2 - y * q1
    size = 1.0 / np.sqrt(r0 * r0 + r1 * r1 + r2 * r2 + r3 * r3)
    out[0], out[1], out[2], out[3] = r0 * size, r1 * size, r2 * size, r3 * size


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True, forceinline=True)
def rotation_of(q, out):
    """R - I of a unit quaternion, without cancellation at small angles, written to ``out`` (3, 3)."""
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


@njit(cache=True, fastmath=FASTMATH, error_model="numpy", nogil=True)
def advance(
    points, joints, bodies, total, cases, factors, drives, speeds, dt, local, adaptive, kinetic_stop, true_inertia
):
    """Advance by ``len(factors)`` steps of central differences.

    m v(n+1/2) = m v(n-1/2) + dt F(n),  L(n+1/2) = L(n-1/2) + dt M(n),  omega = R J^-1 R^T L,  x(n+1) = x(n) + dt v.

    Parameters
    ----------
    points, joints, bodies : state, changed in place
    total : accumulated energies and the adaptive viscosity, see the E_ indices, shape (E_SIZE,)
    cases : wrench per load case and block [N, N m], shape (c, n, 6)
    factors : of the cases, per step, shape (steps, c)
    drives : twist per drive and block for the held degrees of freedom, shape (d, n, 6)
    speeds : factors of the drives per step, shape (steps, d)
    dt : [s]
    local : Cundall's local damping, F - local |F| sign(v) per component, 0 for none
    adaptive : wanted ratio of the power of global damping to the rate of change of kinetic energy, 0 for none
    kinetic_stop : set all free velocities to zero whenever the kinetic energy has passed a peak
    true_inertia : keep the angular momentum exactly in free flight (second-order spin at the half step)
    """
    n = bodies.mass.size
    vel, spin, ang, held, net = bodies.vel, bodies.spin, bodies.ang, bodies.held, bodies.net
    force, old, half, trot, new = np.empty(6), np.empty(6), np.empty(4), np.empty((3, 3)), np.empty(3)
    crossings = (joints.law[:, LAW_CROSS] != 0.0).any()
    for step in range(factors.shape[0]):
        _joint_forces(points, joints, bodies, dt, total)
        if crossings:
            _crossing_forces(points, joints, bodies, dt, total)
        kinetic = applied = support = damping = 0.0
        viscosity = total[E_VISCOSITY] if adaptive > 0.0 else 0.0
        # a stop is at a whole step: only half a step leads from there to the first velocity. A whole one starts a mode
        # of frequency w from an amplitude 1 / cos(w dt / 2) too large, which grows from stop to stop in the fast modes
        kick = 0.5 * dt if kinetic_stop and total[E_STEPS] == total[E_STOP] + 1.0 else dt
        lag = 1.0 / (1.0 + 0.5 * viscosity * dt)
        keep = 1.0 - 0.5 * viscosity * dt
        for i in range(n):
            still = True
            for k in range(6):
                force[k] = 0.0
                old[k] = vel[i, k] if k < 3 else spin[i, k - 3]
                still = still and held[i, k]
            for c in range(cases.shape[0]):
                x = factors[step, c]
                if x != 0.0:
                    for k in range(6):
                        force[k] += x * cases[c, i, k]
            for k in range(6):
                net[i, k] = force[k] + bodies.contact[i, k]
            moving = not still
            for k in range(3):
                if held[i, k]:
                    v = 0.0
                    for q in range(drives.shape[0]):
                        v += speeds[step, q] * drives[q, i, k]
                    moving = moving or v != 0.0
                    vel[i, k] = v
                else:
                    f = net[i, k]
                    v = vel[i, k]
                    brake = local * abs(f) * ((v > 0.0) - (v < 0.0))
                    vel[i, k] = (v * keep + (f - brake) * bodies.inv_mass[i] * kick) * lag
                    damping += brake * 0.5 * (v + vel[i, k]) * dt
                    damping += viscosity * bodies.mass[i] * (0.5 * (v + vel[i, k])) ** 2 * dt
                if held[i, 3 + k]:
                    ang[i, k] = 0.0
                else:
                    f = net[i, 3 + k]
                    w = spin[i, k]
                    brake = local * abs(f) * ((w > 0.0) - (w < 0.0))
                    ang[i, k] = (ang[i, k] * keep + (f - brake) * kick) * lag
                    damping += brake * w * dt
            if still and not moving:
                drive_turns = False
                for q in range(drives.shape[0]):
                    for k in range(3, 6):
                        drive_turns = drive_turns or (speeds[step, q] != 0.0 and drives[q, i, k] != 0.0)
                if not drive_turns:
                    for k in range(3):
                        spin[i, k] = 0.0
                    continue
            _spin_of(bodies.rot[i], bodies.inv_inertia[i], ang[i], new)
            if true_inertia:
                _turned(bodies.quat[i], new, 0.5 * dt, half)
                rotation_of(half, trot)
                _spin_of(trot, bodies.inv_inertia[i], ang[i], new)
                _turned(bodies.quat[i], new, 0.5 * dt, half)
                rotation_of(half, trot)
                _spin_of(trot, bodies.inv_inertia[i], ang[i], new)
            for k in range(3):
                if held[i, 3 + k]:
                    w = 0.0
                    for q in range(drives.shape[0]):
                        w += speeds[step, q] * drives[q, i, 3 + k]
                    new[k] = w
                else:
                    damping += viscosity * dt * ang[i, k] * new[k]
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
                    kinetic += 0.5 * ang[i, k] * new[k]
                bodies.shift[i, k] += dt * vel[i, k]
            if new[0] != 0.0 or new[1] != 0.0 or new[2] != 0.0:
                _turned(bodies.quat[i], new, dt, bodies.quat[i])
                rotation_of(bodies.quat[i], bodies.rot[i])
        if adaptive > 0.0:
            # the power 2 C E_k of global damping follows a fixed part of the rate of change of the kinetic energy
            power = 2.0 * viscosity * kinetic * dt
            wanted = adaptive * abs(kinetic - total[E_KINETIC])
            change = 1.02 if power < wanted else 1.0 / 1.02
            total[E_VISCOSITY] = min(max(viscosity * change, 1e-6 / dt), 1.0 / dt)
        if kinetic_stop and kinetic < total[E_KINETIC] and total[E_STEPS] >= total[E_STOP] + STOP_EVERY:
            # past a peak of kinetic energy: the leading mode passes its equilibrium, so stop there and start again
            damping += kinetic
            kinetic = 0.0
            total[E_STOP] = total[E_STEPS]
            for i in range(n):
                for k in range(3):
                    if not held[i, k]:
                        vel[i, k] = 0.0
                    if not held[i, 3 + k]:
                        spin[i, k] = 0.0
                        ang[i, k] = 0.0
        total[E_DAMPING] += damping
        total[E_APPLIED] += applied
        total[E_SUPPORT] += support
        total[E_KINETIC] = kinetic
        total[E_STEPS] += 1.0


@njit(cache=True, error_model="numpy", nogil=True)
def measure(points, joints, bodies, position, force, opening, slip):
    """Contact-point places, forces, openings and slips in the present position; changes no state.

    Parameters
    ----------
    position, force : block b's material points [m] less the reference centroid of b (add it), and the force on block b
        in global axes [N], written, shape (m, 3)
    opening : w - w_p, total opening less dilation [m], written, shape (m,)
    slip : total slip of b against a along t1, t2 [m], written, shape (m, 2)

    Returns
    -------
    elastic energy : sum of (N^2 / kn + T^2 / ks) A / 2, and ft A times the opening beyond the tension cut-off [J]
    """
    energy = 0.0
    for j in range(joints.block_a.size):
        b = joints.block_b[j]
        law = joints.law[j]
        kn, ks, fc = law[LAW_KN], law[LAW_KS], law[LAW_FC]
        if law[LAW_CROSS] != 0.0:
            axes, far, _, rb = _crossing(j, joints, bodies)
            k = joints.start[j]
            opening[k], slip[k, 0], slip[k, 1] = far + points.gap[k] - points.lift[k], 0.0, 0.0
            n = min(max(-kn * opening[k], 0.0), kn * fc)
            t1, t2 = ks * points.slip_1[k], ks * points.slip_2[k]
            energy += points.area[k] * 0.5 * (n * n / kn + (t1 * t1 + t2 * t2) / ks)
            for r in range(3):
                force[k, r] = points.area[k] * (axes[0][r] * t1 + axes[1][r] * t2 + axes[2][r] * n)
                position[k, r] = rb[r] + bodies.shift[b, r]
            continue
        axes, d, g, _, rb = _kinematics(j, joints, bodies)
        for k in range(joints.start[j], joints.start[j + 1]):
            x, y, h = points.s[k], points.t[k], points.damage[k]
            e1 = d[0] + g[0] * x + g[1] * y
            e2 = d[1] + g[2] * x + g[3] * y
            e3 = d[2] + g[4] * x + g[5] * y
            mu = law[LAW_MU] + h * (law[LAW_MU_R] - law[LAW_MU])
            c = law[LAW_C] + h * (law[LAW_C_R] - law[LAW_C])
            ft = law[LAW_FT] + h * (law[LAW_FT_R] - law[LAW_FT])
            w = e3 + points.gap[k]
            n = min(max(kn * (points.lift[k] - w), -ft), kn * fc)
            a1, a2 = points.slip_1[k] - e1, points.slip_2[k] - e2
            trial = ks * np.sqrt(a1 * a1 + a2 * a2)
            ratio = min(max(c + mu * n, 0.0) / max(trial, 1e-300), 1.0)
            t1, t2 = ks * ratio * a1, ks * ratio * a2
            opening[k] = w - points.lift[k]
            slip[k, 0], slip[k, 1] = e1, e2
            # tension at its cut-off is a constant force: it gives back what it took
            more = max(w - points.lift[k] - ft / kn, 0.0)
            energy += points.area[k] * (0.5 * (n * n / kn + (t1 * t1 + t2 * t2) / ks) + ft * more)
            px, py = x + e1, y + e2
            for r in range(3):
                force[k, r] = points.area[k] * (axes[0][r] * t1 + axes[1][r] * t2 + axes[2][r] * n)
                position[k, r] = rb[r] + bodies.shift[b, r] + axes[0][r] * px + axes[1][r] * py + axes[2][r] * e3
    return energy


@njit(cache=True, error_model="numpy", nogil=True)
def _plane_of(corners, faces, size, p, f, out):
    """Outward normal and offset of face f of convex piece p (Newell), written to ``out`` (4)."""
    n0 = n1 = n2 = c0 = c1 = c2 = 0.0
    m = size[p, f]
    for k in range(m):
        u, v = faces[p, f, k], faces[p, f, (k + 1) % m]
        x0, x1, x2 = corners[p, u, 0], corners[p, u, 1], corners[p, u, 2]
        y0, y1, y2 = corners[p, v, 0], corners[p, v, 1], corners[p, v, 2]
        n0 += (x1 - y1) * (x2 + y2)
        n1 += (x2 - y2) * (x0 + y0)
        n2 += (x0 - y0) * (x1 + y1)
        c0 += x0
        c1 += x1
        c2 += x2
    r = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    out[0], out[1], out[2] = n0 * r, n1 * r, n2 * r
    out[3] = (out[0] * c0 + out[1] * c1 + out[2] * c2) / m


@njit(cache=True, error_model="numpy", nogil=True)
def _widest_gap(corners, n_corners, planes, n_faces, p, q, best):
    """Face of p that separates q the most, and q's corner nearest to it; plane and gap written to ``best`` (5)."""
    found, nearest = -1, 0
    best[4] = -1e300
    for f in range(n_faces[p]):
        gap, low = 1e300, 0
        for k in range(n_corners[q]):
            h = planes[p, f, 0] * corners[q, k, 0] + planes[p, f, 1] * corners[q, k, 1]
            h += planes[p, f, 2] * corners[q, k, 2] - planes[p, f, 3]
            if h < gap:
                gap, low = h, k
        if gap > best[4]:
            found, nearest, best[4] = f, low, gap
            best[:4] = planes[p, f]
    return found, nearest


@njit(cache=True, error_model="numpy", nogil=True)
def _widest_crossing(corners, edges, n_edges, planes, p, q, out):
    """Gap along the cross product of edges of p and q that separates them most, -1e300 without any; cosine to a face.

    Only edges whose arcs on the sphere of normals, from face to face beside the edge, cross: theirs are planes of
    support (Gottschalk, Lin, Manocha 1996 for the axes; Gregorius 2013 for the arcs).

    Parameters
    ----------
    out : start and vector along either edge [m], and the unit normal from p to q, written, shape (5, 3)
    """
    widest, steepest = -1e300, 1.0
    for e in range(n_edges[p]):
        i, j = edges[p, e, 0], edges[p, e, 1]
        x, y = corners[p, i], corners[p, j]
        u = (y[0] - x[0], y[1] - x[1], y[2] - x[2])
        one, two = planes[p, edges[p, e, 2]], planes[p, edges[p, e, 3]]
        a, b = (one[0], one[1], one[2]), (two[0], two[1], two[2])
        turn = _cross(b, a)
        for h in range(n_edges[q]):
            one, two = planes[q, edges[q, h, 2]], planes[q, edges[q, h, 3]]
            c, d = (-one[0], -one[1], -one[2]), (-two[0], -two[1], -two[2])
            ct, dt = _dot(c, turn), _dot(d, turn)
            if not ct * dt < 0.0:
                continue
            back = _cross(d, c)
            at, bt = _dot(a, back), _dot(b, back)
            if not (at * bt < 0.0 and ct * bt > 0.0):
                continue
            o, w = corners[q, edges[q, h, 0]], corners[q, edges[q, h, 1]]
            v = (w[0] - o[0], w[1] - o[1], w[2] - o[2])
            m = _cross(u, v)
            size, lu, lv = np.sqrt(_dot(m, m)), np.sqrt(_dot(u, u)), np.sqrt(_dot(v, v))
            if size < 1e-6 * lu * lv:
                continue
            sign = 1.0 if m[0] * (a[0] + b[0]) + m[1] * (a[1] + b[1]) + m[2] * (a[2] + b[2]) > 0.0 else -1.0
            gap = sign * (m[0] * (o[0] - x[0]) + m[1] * (o[1] - x[1]) + m[2] * (o[2] - x[2])) / size
            if gap > widest:
                widest = gap
                n = (sign * m[0] / size, sign * m[1] / size, sign * m[2] / size)
                steepest = max(max(_dot(n, a), _dot(n, b)), max(_dot(n, c), _dot(n, d)))
                for r in range(3):
                    out[0, r], out[1, r], out[3, r] = x[r], u[r], sign * v[r]
                    out[2, r], out[4, r] = o[r] if sign > 0.0 else w[r], n[r]
    return widest, steepest


@njit(cache=True, error_model="numpy", nogil=True)
def contact_shapes(
    corners, n_corners, faces, size, n_faces, edges, n_edges, pairs, margin, flat,
    kind, gap, polygon, count, plane_out, crossing, first_is_base,
):  # fmt: skip
    """How every pair of convex pieces nearer than ``margin`` meets, at any relative rotation.

    Of the normals of the faces and the cross products of the edges, the axis of the widest gap (least penetration) is
    taken. Where it is a cross product that leaves the normals of the faces beside the edges by more than ``flat``, the
    edges meet in a point. Otherwise a face of one piece, the base, meets of the faces at the other's nearest corner the
    most opposed one, clipped by the base's sides: the polygon lies on that second face.

    Parameters
    ----------
    corners, faces : pieces in their present position [m], padded, shapes (p, v, 3), (p, f, k)
    edges : both corners and both faces of every edge, padded, shape (p, e, 4)
    n_corners, size, n_faces, n_edges : numbers in use, shapes (p,), (p, f), (p,), (p,)
    pairs : shape (m, 2)
    margin : [m]
    flat : cosine of the angle between the normals of faces that lie on each other
    kind : written, 0 apart, 1 face on face, 2 edge or corner on a face, 3 two edges, shape (m,)
    gap : along the axis, negative where the pieces overlap [m], written, shape (m,)
    polygon, count : of kinds 1 and 2 [m], written, shapes (m, 32, 3), (m,)
    plane_out : of kinds 1 and 2, unit normal away from the base and offset [m], written, shape (m, 4)
    crossing : of kind 3, see :func:`_widest_crossing`, first piece first, written, shape (m, 5, 3)
    first_is_base : written, shape (m,)
    """
    plane, best_p, best_q, side = np.empty(4), np.empty(5), np.empty(5), np.empty(4)
    one, two = np.empty((32, 3)), np.empty((32, 3))
    planes, known = np.empty((len(corners), faces.shape[1], 4)), np.zeros(len(corners), dtype=np.bool_)
    for m in range(len(pairs)):
        kind[m] = count[m] = 0
        p, q = pairs[m, 0], pairs[m, 1]
        for i in (p, q):
            if not known[i]:
                known[i] = True
                for f in range(n_faces[i]):
                    _plane_of(corners, faces, size, i, f, plane)
                    planes[i, f] = plane
        fp, low_q = _widest_gap(corners, n_corners, planes, n_faces, p, q, best_p)
        if best_p[4] > margin:
            continue
        fq, low_p = _widest_gap(corners, n_corners, planes, n_faces, q, p, best_q)
        if best_q[4] > margin:
            continue
        first = best_p[4] >= best_q[4] - 1e-3 * margin
        base, other, face = (p, q, fp) if first else (q, p, fq)
        ref = best_p if first else best_q
        lowest = low_q if first else low_p
        gap[m] = ref[4]
        wide, steepest = _widest_crossing(corners, edges, n_edges, planes, p, q, crossing[m])
        if wide > margin:
            continue
        if wide > ref[4] + 1e-6 * margin and steepest < flat:
            kind[m], gap[m], first_is_base[m] = 3, wide, True
            continue
        opposed, low = 0, 2.0
        for f in range(n_faces[other]):
            touches = False
            for k in range(size[other, f]):
                touches = touches or faces[other, f, k] == lowest
            c = planes[other, f, 0] * ref[0] + planes[other, f, 1] * ref[1] + planes[other, f, 2] * ref[2]
            if touches and c < low:
                low, opposed = c, f
        n = size[other, opposed]
        for k in range(n):
            for r in range(3):
                one[k, r] = corners[other, faces[other, opposed, k], r]
        sides = size[base, face]
        for k in range(sides):
            u, v = faces[base, face, k], faces[base, face, (k + 1) % sides]
            e0 = corners[base, v, 0] - corners[base, u, 0]
            e1 = corners[base, v, 1] - corners[base, u, 1]
            e2 = corners[base, v, 2] - corners[base, u, 2]
            side[0] = e1 * ref[2] - e2 * ref[1]
            side[1] = e2 * ref[0] - e0 * ref[2]
            side[2] = e0 * ref[1] - e1 * ref[0]
            side[3] = side[0] * corners[base, u, 0] + side[1] * corners[base, u, 1] + side[2] * corners[base, u, 2]
            new = 0
            for i in range(n):
                a = side[0] * one[i, 0] + side[1] * one[i, 1] + side[2] * one[i, 2] - side[3]
                z = (i + 1) % n
                b = side[0] * one[z, 0] + side[1] * one[z, 1] + side[2] * one[z, 2] - side[3]
                if a <= 0.0 and new < 32:
                    for r in range(3):
                        two[new, r] = one[i, r]
                    new += 1
                if (a < 0.0 < b or b < 0.0 < a) and new < 32:
                    t = a / (a - b)
                    for r in range(3):
                        two[new, r] = one[i, r] + t * (one[z, r] - one[i, r])
                    new += 1
            n = new
            for i in range(n):
                for r in range(3):
                    one[i, r] = two[i, r]
        if n < 3:
            continue
        near = 1e300
        for i in range(n):
            near = min(near, ref[0] * one[i, 0] + ref[1] * one[i, 1] + ref[2] * one[i, 2] - ref[3])
        if near > margin:
            continue
        kind[m], count[m] = (1 if low < -flat else 2), n
        first_is_base[m] = first
        for i in range(n):
            for r in range(3):
                polygon[m, i, r] = one[i, r]
        for r in range(4):
            plane_out[m, r] = ref[r]
