"""A joint between blocks that deform in modes, in space: its forces, and what acts on the modes of its blocks."""

import numpy as np

from dem.kernels.added import has_added
from dem.kernels.arrays import LAW, Array
from dem.kernels.compiled import kernel
from dem.kernels.kinematics import relative_motion
from dem.kernels.law import Fall, Peak, fall_of, peak_of, plain_peak_of, return_map

Numbers = tuple[float, ...]
SPACE_MODES = 21  # known to the compiler, which unrolls its loops


@kernel(forceinline=True)
def _space_side(side: Array, j: int, x: Array, i: int, out: Array) -> None:
    """Eighteen coefficients of one side of joint j at the coordinates of block i, written to ``out``."""
    for c in range(18):
        out[c] = 0.0
    for k in range(SPACE_MODES):
        q = x[i, k]
        for c in range(18):
            out[c] += q * side[j, k, c]


@kernel(forceinline=True)
def _space_turn(c: Array, g: Numbers, back: bool) -> None:
    """Turn coefficients of block b into block a's frame in place, or ``back``; g as of ``_kinematics``."""
    r11, r21, r31 = 1.0 + g[0], g[2], g[4]
    r12, r22, r32 = g[1], 1.0 + g[3], g[5]
    r13, r23, r33 = r21 * r32 - r31 * r22, r31 * r12 - r11 * r32, r11 * r22 - r21 * r12
    for i in range(6):
        x, y, z = c[i], c[6 + i], c[12 + i]
        if back:
            c[i], c[6 + i], c[12 + i] = r11 * x + r21 * y + r31 * z, r12 * x + r22 * y + r32 * z, (
                r13 * x + r23 * y + r33 * z
            )
        else:
            c[i], c[6 + i], c[12 + i] = r11 * x + r12 * y + r13 * z, r21 * x + r22 * y + r23 * z, (
                r31 * x + r32 * y + r33 * z
            )


@kernel(forceinline=True)
def _quadratic(c: Array, i: int, x: float, y: float) -> float:
    """Value of the i-th component of a side at (x, y)."""
    return c[i] + c[i + 1] * x + c[i + 2] * y + c[i + 3] * x * x + c[i + 4] * x * y + c[i + 5] * y * y


@kernel(forceinline=True)
def _space_points(
    s: Array, t: Array, area: Array, gap: Array, slip_1: Array, slip_2: Array, lift: Array, damage: Array, pad: Array,
    p0: int, p1: int, d: Numbers, g: Numbers, c: Array, peak: Peak, fall: Fall | None, motion: Numbers | None,
    w: Array, lifts: bool,
) -> Numbers:  # fmt: skip
    """As :func:`_plane_points` in space; ``c`` holds b's side less a's, ``w`` their rates. Forces go to ``pad``."""
    d1, d2, d3 = d
    g11, g12, g21, g22, g31, g32 = g
    f1 = f2 = f3 = m1 = m2 = m3 = work = lost = broken = 0.0
    for k in range(np.uint64(p0), np.uint64(p1)):
        x, y = s[k], t[k]
        e1 = d1 + g11 * x + g12 * y + _quadratic(c, 0, x, y)
        e2 = d2 + g21 * x + g22 * y + _quadratic(c, 6, x, y)
        e3 = d3 + g31 * x + g32 * y + _quadratic(c, 12, x, y)
        if motion is None:
            brake = None
        else:
            dash, per_dt, v1, v2, v3, o1, o2, o3 = motion
            brake = (
                dash, v1 + o2 * e3 - o3 * (y + e2) + _quadratic(w, 0, x, y),
                v2 + o3 * (x + e1) - o1 * e3 + _quadratic(w, 6, x, y),
                v3 + o1 * (y + e2) - o2 * (x + e1) + _quadratic(w, 12, x, y), per_dt,
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
        pad[k, 0], pad[k, 1], pad[k, 2] = q1, q2, q3
        f1 += q1
        f2 += q2
        f3 += q3
        x, y = x + e1, y + e2
        m1 += y * q3 - e3 * q2
        m2 += e3 * q1 - x * q3
        m3 += x * q2 - y * q1
    return f1, f2, f3, m1, m2, m3, work, lost, broken


@kernel(forceinline=True)
def _space_joint(
    j: int, a: int, b: int, p0: int, p1: int, s: Array, t: Array, area: Array, gap: Array, slip_1: Array,
    slip_2: Array, lift: Array, damage: Array, law: Array, vel: Array, spin: Array, value: Array, rate: Array,
    contact: Array, one: Array, two: Array, pad: Array, axes: tuple[Numbers, Numbers, Numbers], d: Numbers, g: Numbers,
    ra: Numbers, rb: Numbers, dt: float, scratch: Array,
) -> Numbers:  # fmt: skip
    """Forces and moments of joint j in space, and what acts on the modes of its blocks; ``scratch`` of (4, 18)."""
    side_a, c, w, h = scratch[0], scratch[1], scratch[2], scratch[3]
    _space_side(one, j, value, a, side_a)
    _space_side(two, j, value, b, c)
    _space_turn(c, g, False)
    for i in range(18):
        c[i] -= side_a[i]
    plain, peak = plain_peak_of(law, j), peak_of(law, j)
    if law[j, LAW.dash] == 0.0 or dt == 0.0:
        # what a law does not have is left out: it neither dilates nor crushes, and does not soften
        flat = law[j, LAW.tan_psi] == 0.0 and law[j, LAW.rest_tan_psi] == 0.0 and law[j, LAW.crushing] == np.inf
        flat = flat and not has_added(law, j)
        if flat and law[j, LAW.by_opening] == 0.0 and law[j, LAW.by_slip] == 0.0:
            out = _space_points(
                s, t, area, gap, slip_1, slip_2, lift, damage, pad, p0, p1, d, g, c, plain, None, None, w,
                False,
            )  # fmt: skip
        elif flat and law[j, LAW.secant] == 0.0:
            out = _space_points(
                s, t, area, gap, slip_1, slip_2, lift, damage, pad, p0, p1, d, g, c, plain, fall_of(law, j), None, w,
                False,
            )  # fmt: skip
        else:
            out = _space_points(
                s, t, area, gap, slip_1, slip_2, lift, damage, pad, p0, p1, d, g, c, peak, fall_of(law, j), None, w,
                True,
            )  # fmt: skip
    else:
        v, o = relative_motion(a, b, vel, spin, axes, ra, rb)
        _space_side(two, j, rate, b, w)
        _space_turn(w, g, False)
        _space_side(one, j, rate, a, h)
        for i in range(18):
            w[i] -= h[i]
        motion = law[j, LAW.dash], 1.0 / dt, v[0], v[1], v[2], o[0], o[1], o[2]
        out = _space_points(
            s, t, area, gap, slip_1, slip_2, lift, damage, pad, p0, p1, d, g, c, peak, fall_of(law, j), motion, w, True
        )  # fmt: skip
    for i in range(18):
        h[i] = 0.0
    for k in range(p0, p1):
        x, y = s[k], t[k]
        for i in range(3):
            q = pad[k, i]
            h[6 * i] += q
            h[6 * i + 1] += x * q
            h[6 * i + 2] += y * q
            h[6 * i + 3] += x * x * q
            h[6 * i + 4] += x * y * q
            h[6 * i + 5] += y * y * q
    m1 = m2 = m3 = 0.0
    for i in range(6):
        u1, u2, u3 = side_a[i], side_a[6 + i], side_a[12 + i]
        m1 += u2 * h[12 + i] - u3 * h[6 + i]
        m2 += u3 * h[i] - u1 * h[12 + i]
        m3 += u1 * h[6 + i] - u2 * h[i]
    for k in range(SPACE_MODES):
        x = 0.0
        for i in range(18):
            x += one[j, k, i] * h[i]
        contact[a, k] -= x
    _space_turn(h, g, True)
    for k in range(SPACE_MODES):
        x = 0.0
        for i in range(18):
            x += two[j, k, i] * h[i]
        contact[b, k] += x
    return out[0], out[1], out[2], out[3] + m1, out[4] + m2, out[5] + m3, out[6], out[7], out[8]
