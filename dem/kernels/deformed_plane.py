"""A joint between blocks that deform in modes, in a plane: its forces, and what acts on the modes of its blocks."""

import numpy as np

from dem.kernels.added import has_added
from dem.kernels.arrays import LAW, Array
from dem.kernels.compiled import kernel
from dem.kernels.kinematics import relative_motion
from dem.kernels.law import Fall, Peak, fall_of, peak_of, plain_peak_of, return_map

Numbers = tuple[float, ...]
PLANE_MODES = 9  # known to the compiler, which unrolls its loops


@kernel(forceinline=True)
def _side(side: Array, j: int, x: Array, i: int) -> Numbers:
    """Six coefficients of one side of joint j at the coordinates of block i."""
    c0 = c1 = c2 = c3 = c4 = c5 = 0.0
    for k in range(PLANE_MODES):
        q = x[i, k]
        c0 += q * side[j, k, 0]
        c1 += q * side[j, k, 1]
        c2 += q * side[j, k, 2]
        c3 += q * side[j, k, 3]
        c4 += q * side[j, k, 4]
        c5 += q * side[j, k, 5]
    return c0, c1, c2, c3, c4, c5


@kernel(forceinline=True)
def _turned_side(c: Numbers, cos: float, sin: float) -> Numbers:
    """Coefficients of block b's side in the joint's frame as block a carries it; ``cos`` is that of the turn less 1."""
    c0, c1, c2, c3, c4, c5 = c
    return (
        c0 + cos * c0 - sin * c3, c1 + cos * c1 - sin * c4, c2 + cos * c2 - sin * c5,
        c3 + sin * c0 + cos * c3, c4 + sin * c1 + cos * c4, c5 + sin * c2 + cos * c5,
    )  # fmt: skip


@kernel(forceinline=True)
def _turn_in_plane(g: Numbers, al: float, be: float) -> tuple[float, float]:
    """Cosine less 1 and sine of the relative rotation, from the direction along the joint towards its normal."""
    return al * al * g[0] + al * be * (g[1] + g[2]) + be * be * g[3], al * g[4] + be * g[5]


@kernel(forceinline=True)
def _plane_points(
    s: Array, t: Array, area: Array, gap: Array, slip_1: Array, slip_2: Array, lift: Array, damage: Array, p0: int,
    p1: int, d: Numbers, g: Numbers, al: float, be: float, side_a: Numbers, side_b: Numbers, peak: Peak,
    fall: Fall | None, motion: Numbers | None, lifts: bool,
) -> Numbers:  # fmt: skip
    """Sums over the points of a joint between modal blocks in a plane.

    Parameters
    ----------
    al, be : direction along the joint in its tangents
    side_a, side_b : coefficients of both sides in the joint's frame, see :func:`_side`
    peak, fall, lifts : see :func:`dem.kernels.law.return_map`
    motion : None, or dash, 1 / dt, velocity of b's joint origin against a's, relative spin, and both sides' rates

    Returns
    -------
    forces (3), moments about a's joint origin (3), plastic work, power of dashpots, energy of fracture
    moments : sum of f_e (1, p, p^2) and f_n (1, p, p^2) (6)
    """
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    a0, a1, a2, a3, a4, a5 = side_a
    b0, b1, b2, b3, b4, b5 = side_b
    r0, r1, r2, r3, r4, r5 = b0 - a0, b1 - a1, b2 - a2, b3 - a3, b4 - a4, b5 - a5
    f1 = f2 = f3 = m1 = m2 = m3 = work = lost = broken = 0.0
    h1 = h2 = h4 = h5 = 0.0
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        p = al * x + be * y
        along = r0 + p * (r1 + p * r2)
        e1 = d1 + g11 * x + g12 * y + al * along
        e2 = d2 + g21 * x + g22 * y + be * along
        e3 = d3 + g31 * x + g32 * y + r3 + p * (r4 + p * r5)
        x, y = x + e1, y + e2
        if motion is None:
            brake = None
        else:
            dash, per_dt, v1, v2, v3, o1, o2, o3, w0, w1, w2, w3, w4, w5 = motion
            slide = w0 + p * (w1 + p * w2)
            brake = (
                dash, v1 + o2 * e3 - o3 * y + al * slide, v2 + o3 * x - o1 * e3 + be * slide,
                v3 + o1 * y - o2 * x + w3 + p * (w4 + p * w5), per_dt,
            )  # fmt: skip
        if fall is None:
            h = 0.0
        else:
            h = damage[k]
        q1, q2, q3, slip_1[k], slip_2[k], new, h, rubbed, raised, braked, released = return_map(
            e3 + gap[k], e1, e2, slip_1[k], slip_2[k], lift[k], h, peak, fall, brake, lifts
        )
        da = area[k]
        if lifts:
            lift[k] = new
            work -= da * raised
        if fall is not None:
            damage[k] = h
            broken += da * released
        if motion is not None:
            lost += da * braked
        work += da * rubbed
        q1, q2, q3 = q1 * da, q2 * da, q3 * da
        f1 += q1
        f2 += q2
        f3 += q3
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
        pe, pn = p * (al * q1 + be * q2), p * q3
        h1 += pe
        h2 += p * pe
        h4 += pn
        h5 += p * pn
    h0, h3 = al * f1 + be * f2, f3
    # the arm of a's joint origin ends on a's undeformed face: the part of b's point that a's deformation makes
    more = a0 * h3 + a1 * h4 + a2 * h5 - a3 * h0 - a4 * h1 - a5 * h2
    return f1, f2, f3, m1 + be * more, m2 - al * more, m3, work, lost, broken, h0, h1, h2, h3, h4, h5


@kernel(forceinline=True)
def _plane_joint(
    j: int, a: int, b: int, p0: int, p1: int, s: Array, t: Array, area: Array, gap: Array, slip_1: Array,
    slip_2: Array, lift: Array, damage: Array, law: Array, vel: Array, spin: Array, value: Array, rate: Array,
    contact: Array, one: Array, two: Array, along: Array, axes: tuple[Numbers, Numbers, Numbers], d: Numbers,
    g: Numbers, ra: Numbers, rb: Numbers, dt: float,
) -> Numbers:  # fmt: skip
    """Forces and moments of joint j of a plane problem, and what acts on the modes of its blocks."""
    al, be = along[j, 0], along[j, 1]
    cos, sin = _turn_in_plane(g, al, be)
    side_a = _side(one, j, value, a)
    side_b = _turned_side(_side(two, j, value, b), cos, sin)
    plain, peak = plain_peak_of(law, j), peak_of(law, j)
    if law[j, LAW.dash] == 0.0 or dt == 0.0:
        # what a law does not have is left out: it neither dilates nor crushes, and does not soften
        flat = law[j, LAW.tan_psi] == 0.0 and law[j, LAW.rest_tan_psi] == 0.0 and law[j, LAW.crushing] == np.inf
        flat = flat and not has_added(law, j)
        if flat and law[j, LAW.by_opening] == 0.0 and law[j, LAW.by_slip] == 0.0:
            out = _plane_points(
                s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, d, g, al, be, side_a, side_b, plain,
                None, None, False,
            )  # fmt: skip
        elif flat and law[j, LAW.secant] == 0.0:
            out = _plane_points(
                s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, d, g, al, be, side_a, side_b, plain,
                fall_of(law, j), None, False,
            )  # fmt: skip
        else:
            out = _plane_points(
                s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, d, g, al, be, side_a, side_b, peak,
                fall_of(law, j), None, True,
            )  # fmt: skip
    else:
        v, o = relative_motion(a, b, vel, spin, axes, ra, rb)
        w0, w1, w2, w3, w4, w5 = _turned_side(_side(two, j, rate, b), cos, sin)
        u0, u1, u2, u3, u4, u5 = _side(one, j, rate, a)
        motion = (
            law[j, LAW.dash], 1.0 / dt, v[0], v[1], v[2], o[0], o[1], o[2],
            w0 - u0, w1 - u1, w2 - u2, w3 - u3, w4 - u4, w5 - u5,
        )  # fmt: skip
        out = _plane_points(
            s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, d, g, al, be, side_a, side_b, peak,
            fall_of(law, j), motion, True,
        )  # fmt: skip
    h0, h1, h2, h3, h4, h5 = out[9], out[10], out[11], out[12], out[13], out[14]
    k0, k1, k2, k3, k4, k5 = _turned_side((h0, h1, h2, h3, h4, h5), cos, -sin)
    for k in range(PLANE_MODES):
        contact[a, k] -= (
            one[j, k, 0] * h0 + one[j, k, 1] * h1 + one[j, k, 2] * h2
            + one[j, k, 3] * h3 + one[j, k, 4] * h4 + one[j, k, 5] * h5
        )  # fmt: skip
        contact[b, k] += (
            two[j, k, 0] * k0 + two[j, k, 1] * k1 + two[j, k, 2] * k2
            + two[j, k, 3] * k3 + two[j, k, 4] * k4 + two[j, k, 5] * k5
        )  # fmt: skip
    return out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8]
