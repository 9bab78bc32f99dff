"""Sums of the joint law over the contact points of a joint: forces, moments about block a's joint origin, losses."""

import numpy as np

from dem.kernels.arrays import LAW, Array
from dem.kernels.compiled import kernel
from dem.kernels.law import Numbers, fall_of, peak_of, plain_peak_of, return_map


@kernel(forceinline=True)
def _sum_plain(s, t, area, gap, slip_1, slip_2, lift, p0, p1, d, g, j, law, lifts):
    """Sum of forces (t1, t2, n), moments about block a's joint origin and plastic work; perfectly plastic law.

    ``lifts`` is a constant in each call: without dilation and crushing the lift stays: a quarter less work.
    """
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    peak = plain_peak_of(law, j)
    f1 = f2 = f3 = m1 = m2 = m3 = work = 0.0
    # unsigned: no index from the end to allow for, so that the loop over part of the arrays vectorises without views
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        e1 = d1 + g11 * x + g12 * y
        e2 = d2 + g21 * x + g22 * y
        e3 = d3 + g31 * x + g32 * y
        q1, q2, q3, slip_1[k], slip_2[k], new, _, rubbed, raised, _, _ = return_map(
            e3 + gap[k], e1, e2, slip_1[k], slip_2[k], lift[k], 0.0, peak, None, None, lifts
        )
        da = area[k]
        if lifts:
            lift[k] = new
            work -= da * raised
        work += da * rubbed
        q1, q2, q3 = q1 * da, q2 * da, q3 * da
        f1 += q1
        f2 += q2
        f3 += q3
        x += e1
        y += e2
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
    return f1, f2, f3, m1, m2, m3, work, 0.0, 0.0


@kernel(forceinline=True)
def _sum_softening(
    s: Array, t: Array, area: Array, gap: Array, slip_1: Array, slip_2: Array, lift: Array, damage: Array,
    p0: int, p1: int, d: Numbers, g: Numbers, j: int, law: Array, lifts: bool,
) -> Numbers:  # fmt: skip
    """As :func:`_sum_plain`, with softening to residual values; nothing brakes, which halves the work."""
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    peak, fall = plain_peak_of(law, j), fall_of(law, j)
    f1 = f2 = f3 = m1 = m2 = m3 = work = broken = 0.0
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        e1 = d1 + g11 * x + g12 * y
        e2 = d2 + g21 * x + g22 * y
        e3 = d3 + g31 * x + g32 * y
        q1, q2, q3, slip_1[k], slip_2[k], new, damage[k], rubbed, raised, _, released = return_map(
            e3 + gap[k], e1, e2, slip_1[k], slip_2[k], lift[k], damage[k], peak, fall, None, lifts
        )
        da = area[k]
        if lifts:
            lift[k] = new
            work -= da * raised
        work += da * rubbed
        broken += da * released
        q1, q2, q3 = q1 * da, q2 * da, q3 * da
        f1 += q1
        f2 += q2
        f3 += q3
        x += e1
        y += e2
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
    return f1, f2, f3, m1, m2, m3, work, 0.0, broken


@kernel(forceinline=True)
def _sum_full(s, t, area, gap, slip_1, slip_2, lift, damage, p0, p1, moves, j, law, dt, lifts):
    """As :func:`_sum_plain`, with softening to residual values and dashpots that only act where the joint is closed.

    Parameters
    ----------
    moves : d and g as there, velocity of block b's joint origin against block a's [m/s] and of its rotation [rad/s]
    lifts : as there
    dt : [s]; 0 for forces in a position, where nothing moves that could be braked
    """
    d, g, rate, turn = moves
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    peak, fall = peak_of(law, j), fall_of(law, j)
    # without a step there is no motion to brake
    per_dt = 1.0 / dt if dt > 0.0 else 0.0
    dash = law[j, LAW.dash] if dt > 0.0 else 0.0
    v1, v2, v3 = rate
    o1, o2, o3 = turn
    f1 = f2 = f3 = m1 = m2 = m3 = work = lost = broken = 0.0
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        e1 = d1 + g11 * x + g12 * y
        e2 = d2 + g21 * x + g22 * y
        e3 = d3 + g31 * x + g32 * y
        x, y = x + e1, y + e2
        # velocity of b against a at the point
        brake = dash, v1 + o2 * e3 - o3 * y, v2 + o3 * x - o1 * e3, v3 + o1 * y - o2 * x, per_dt
        q1, q2, q3, slip_1[k], slip_2[k], lift[k], damage[k], rubbed, raised, braked, released = return_map(
            e3 + gap[k], e1, e2, slip_1[k], slip_2[k], lift[k], damage[k], peak, fall, brake, lifts
        )
        da = area[k]
        work += da * (rubbed - raised)
        lost += da * braked
        broken += da * released
        q1, q2, q3 = q1 * da, q2 * da, q3 * da
        f1 += q1
        f2 += q2
        f3 += q3
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
    return f1, f2, f3, m1, m2, m3, work, lost, broken
