"""Sums of the joint law over a joint's points: forces, moments, losses; here only."""

import numpy as np

from dem.kernels.added_terms import Numbers, has_added
from dem.kernels.arrays import LAW, Joints, Points, RigidBodies
from dem.kernels.compiled import kernel
from dem.kernels.joint_law import return_map, within
from dem.kernels.joint_strength import Peak, SofteningRow, peak_of, plain_peak_of, softening_of
from dem.kernels.kinematics import Axes, relative_motion

Placed = tuple[Numbers, Numbers, Numbers]


@kernel(forceinline=True)
def point_sums(
    points: Points, p0: int, p1: int, placed: Placed, peak: Peak, softening: SofteningRow | None, dt: float,
    dash: float | None, motion: Numbers | None, rates: Numbers | None, strained: bool | None, dilates: bool | None,
) -> Numbers:
    """Forces, moments and losses of a joint's points.

    What is None is left out of the loop by the compiler.

    Parameters
    ----------
    points : all points; slips, plastic openings and damage of the joint's are changed
    p0, p1 : the joint's first point, and the one after its last
    placed : d, g and z: b's point stands at d + X + G X + z gap, X = (s, t, 0), in joint axes. d is the displacement of
        the origin [m], g is G11, G12, G21, G22, G31, G32 of R_rel - I, and z is b's normal: it stood along a's when the
        joint was made, and a gap turns with its block
    peak, softening, dilates : see :func:`dem.kernels.joint_law.return_map`; ``dilates`` is a constant of each call, and
        None where all points are taken to be within their strength: nothing of them is changed
    dt : step [s]; 0 for forces in a position
    dash : dashpot over stiffness [s]; or None
    motion : velocity of b's joint origin against a's [m/s] and of its rotation [rad/s], in joint axes (6); or None
    rates : what the faces' strains add to that velocity at the origin [m/s], then its slopes d/ds and d/dt component by
        component [1/s], in joint axes (9); or None
    strained : None between rigid blocks, else True

    Returns
    -------
    forces on b along t1, t2, n [N], compression positive; then between rigid blocks its moments about block a's joint
    origin [N m] (3), else the sums of s f, t f and gap f [N m] (9); plastic work [J], power of dashpots [W], energy of
    fracture [J]; number of points that are not within their strength where they are taken to be
    """
    s, t, area, gap, damage = points.s, points.t, points.area, points.gap, points.damage
    slip_1, slip_2, lift = points.slip_1, points.slip_2, points.lift
    (d1, d2, d3), (g11, g12, g21, g22, g31, g32), (z1, z2, z3) = placed
    per_dt = 1.0 / dt if dt > 0.0 else 0.0
    # sums over the points of stress times area: forces f and moments m; or with the arms s, t and gap, of which blocks
    # that strain make both their moments and what does work on their shapes
    f1 = f2 = f3 = m1 = m2 = m3 = work = lost = broken = beyond = 0.0
    s1 = s2 = s3 = t1 = t2 = t3 = u1 = u2 = u3 = 0.0
    # unsigned numbers: an index from the end need not be allowed for, and the loop vectorises without views
    for k in range(np.uint64(p0), np.uint64(p1)):
        # displacement of b against a at the point: slip e1, e2 and opening w
        x, y, far = s[k], t[k], gap[k]
        e1 = d1 + g11 * x + g12 * y + z1 * far
        e2 = d2 + g21 * x + g22 * y + z2 * far
        w = d3 + g31 * x + g32 * y + z3 * far
        if motion is not None:
            # velocity of b against a at the point
            v1, v2, v3, o1, o2, o3 = motion
            r1 = v1 + o2 * w - o3 * (y + e2)
            r2 = v2 + o3 * (x + e1) - o1 * w
            r3 = v3 + o1 * (y + e2) - o2 * (x + e1)
            if rates is not None:
                r1 += rates[0] + rates[3] * x + rates[4] * y
                r2 += rates[1] + rates[5] * x + rates[6] * y
                r3 += rates[2] + rates[7] * x + rates[8] * y
        if dash is None:
            dashpot = None
        else:
            dashpot = dash, r1, r2, r3, per_dt
        if softening is None:
            h = 0.0
        else:
            h = damage[k]
        da = area[k]
        if dilates is None:
            q1, q2, q3, braked, out = within(
                w, e1, e2, slip_1[k], slip_2[k], lift[k], h, peak, softening, dashpot
            )
            beyond += out
        else:
            q1, q2, q3, slip_1[k], slip_2[k], new, h, rubbed, raised, braked, released = return_map(
                w, e1, e2, slip_1[k], slip_2[k], lift[k], h, peak, softening, dashpot, dilates,
                (dt * r1, dt * r2, dt * r3),
            )
            if dilates:
                lift[k] = new
                work -= da * raised
            if softening is not None:
                damage[k] = h
                broken += da * released
            work += da * rubbed
        if dash is not None:
            lost += da * braked
        q1, q2, q3 = q1 * da, q2 * da, q3 * da
        f1, f2, f3 = f1 + q1, f2 + q2, f3 + q3
        if strained is None:
            x += e1
            y += e2
            m1 += y * q3 - w * q2
            m2 += w * q1 - x * q3
            m3 += x * q2 - y * q1
        else:
            s1, s2, s3 = s1 + x * q1, s2 + x * q2, s3 + x * q3
            t1, t2, t3 = t1 + y * q1, t2 + y * q2, t3 + y * q3
            u1, u2, u3 = u1 + far * q1, u2 + far * q2, u3 + far * q3
    if strained is None:
        return f1, f2, f3, m1, m2, m3, work, lost, broken, beyond
    return f1, f2, f3, s1, s2, s3, t1, t2, t3, u1, u2, u3, work, lost, broken, beyond


@kernel(inline="always")
def held_sums(j: int, points: Points, joints: Joints, placed: Placed, strained: bool | None) -> Numbers:
    """Sums of joint j, without dashpots, where all points are within their strength.

    Nothing is written. A joint that keeps its strength takes neither root nor division; one that softens a division,
    and added terms a root a point.

    Parameters
    ----------
    j, points, joints : the joint, all points and all joints
    placed, strained : see :func:`point_sums`

    Returns
    -------
    the sums of :func:`point_sums`; they must not be used where the last one, points not within their strength, is not 0
    """
    p0, p1, law = joints.start[j], joints.start[j + 1], joints.law
    # what is None is left out by the compiler: one loop over points for each kind of joint, the plain one the shortest.
    # Whatever softens loses strength by opening, by slip perhaps too: see limitmason.mechanics.law.softening. What
    # follows the softening is dt, dash, motion, rates, strained and dilates
    if law[j, LAW.by_opening] == 0.0 and not has_added(law, j):
        out = point_sums(points, p0, p1, placed, plain_peak_of(law, j), None, 0.0, None, None, None, strained, None)
    else:
        out = point_sums(
            points, p0, p1, placed, peak_of(law, j), softening_of(law, j), 0.0, None, None, None, strained, None
        )
    return out


@kernel(inline="always")
def braked_sums(
    j: int, points: Points, joints: Joints, placed: Placed, motion: Numbers, rates: Numbers | None,
    strained: bool | None,
) -> Numbers:
    """Sums of joint j, which has dashpots, as :func:`held_sums` gives them.

    Parameters
    ----------
    j, points, joints : the joint, all points and all joints
    placed, motion, rates, strained : see :func:`point_sums`
    """
    p0, p1, law = joints.start[j], joints.start[j + 1], joints.law
    # what follows the softening is dt, dash, motion, rates, strained and dilates, as in held_sums
    return point_sums(
        points, p0, p1, placed, peak_of(law, j), softening_of(law, j), 0.0, law[j, LAW.dash], motion, rates, strained,
        None,
    )


@kernel(inline="always")
def yielding_sums(
    j: int, points: Points, joints: Joints, placed: Placed, motion: Numbers, rates: Numbers | None, dt: float,
    strained: bool | None,
) -> Numbers:
    """Sums of joint j, whose points yield, by the least law it needs.

    By more the loop over them takes twice the time.

    Parameters
    ----------
    j, points, joints : the joint, all points and all joints
    placed, motion, rates, strained : see :func:`point_sums`, and for what is returned
    dt : step [s]; 0 for forces in a position, where nothing moves that could be braked or rub
    """
    p0, p1, law = joints.start[j], joints.start[j + 1], joints.law
    plain = law[j, LAW.dash] == 0.0 and not has_added(law, j)
    # without dilation and crushing the lift stays; rates of softening and order of arguments as in held_sums. The last,
    # dilates, is a constant of each call, so that the compiler makes a loop for either
    lifts = law[j, LAW.tan_psi] != 0.0 or law[j, LAW.crushing] != np.inf
    if plain and law[j, LAW.by_opening] == 0.0:
        peak = plain_peak_of(law, j)
        if lifts:
            out = point_sums(points, p0, p1, placed, peak, None, dt, None, motion, rates, strained, True)
        else:
            out = point_sums(points, p0, p1, placed, peak, None, dt, None, motion, rates, strained, False)
    elif plain:
        peak, fall = plain_peak_of(law, j), softening_of(law, j)
        if lifts or law[j, LAW.rest_tan_psi] != 0.0:
            out = point_sums(points, p0, p1, placed, peak, fall, dt, None, motion, rates, strained, True)
        else:
            out = point_sums(points, p0, p1, placed, peak, fall, dt, None, motion, rates, strained, False)
    else:
        worn, fall, dash = peak_of(law, j), softening_of(law, j), law[j, LAW.dash] if dt > 0.0 else 0.0
        if lifts or law[j, LAW.rest_tan_psi] != 0.0:
            out = point_sums(points, p0, p1, placed, worn, fall, dt, dash, motion, rates, strained, True)
        else:
            out = point_sums(points, p0, p1, placed, worn, fall, dt, dash, motion, rates, strained, False)
    return out


@kernel(inline="always")
def joint_sums(
    j: int, points: Points, joints: Joints, bodies: RigidBodies, axes: Axes, placed: Placed,
    arms: tuple[Numbers, Numbers], dt: float,
) -> Numbers:
    """Forces, moments and losses of joint j between rigid blocks.

    Points within their strength are summed first, by a shorter loop; only a joint with one that is not is summed by the
    whole law.

    Parameters
    ----------
    points, joints, bodies : all of them; points that yield are changed
    axes : rows t1, t2, n of the joint in global axes
    placed : see :func:`point_sums`, and for what is returned
    arms : from either centroid to block a's joint origin, global axes [m]
    dt : step [s]; 0 for forces in a position
    """
    brakes, law = joints.law[j, LAW.dash] != 0.0 and dt > 0.0, joints.law
    first, opens = joints.start[j], False
    if not brakes and law[j, LAW.tension] == 0.0 and first < joints.start[j + 1]:
        # open at its origin by what its first point allows: some point most likely yields, and the shorter loop would
        # be in vain. It is a guess, which no answer rests on: the whole law is right for points within their strength
        opens = placed[0][2] + points.gap[first] > points.lift[first]
    if brakes or opens:
        motion = relative_motion(j, joints, bodies, axes, arms[0], arms[1])
    if not opens:
        if brakes:
            out = braked_sums(j, points, joints, placed, motion, None, None)
        else:
            out = held_sums(j, points, joints, placed, None)
            if out[9] != 0.0:
                motion = relative_motion(j, joints, bodies, axes, arms[0], arms[1])
    # between rigid blocks the last of the sums counts points that are not within their strength
    if opens or out[9] != 0.0:
        out = yielding_sums(j, points, joints, placed, motion, None, dt, None)  # no rates: faces do not strain
    return out
