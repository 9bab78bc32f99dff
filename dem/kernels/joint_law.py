"""The joint law at a point: stress, plastic state and losses, written here only.

Compression positive, w the opening, w_p plastic opening (dilation): N = kn (w_p - w), T = ks (plastic slip - slip),
-ft <= N <= fc, |T| <= max(c + tan(phi) N, 0). The strength ft may lie beyond the apex c / tan(phi) of the cone: a point
there carries tension and no shear. A point that slides away from where it was made opens by tan(psi) per slip, and one
that slides back closes by as much: w_p = tan(psi) min(|plastic slip|, dilatant slip); in an open point too, as limit
analysis demands, opening >= tan(psi) slip. A point goes from its peak to its residual values as its damage goes from 0
to 1.

Whatever has contact points calls :func:`return_map` at each: ``dashpot`` and ``softening`` are None where a joint has
none and ``dilates`` is a constant of the call, so that what a law does not have is not compiled into its loop. The
functions that it calls are part of it; they take its numbers and give back those that they change.
"""

import numpy as np

from dem.kernels.added_terms import Numbers
from dem.kernels.compiled import kernel
from dem.kernels.joint_strength import TINY, Peak, SofteningRow, strength_of

WITHIN = 1.0 - 1e-9
"""Squared shear over squared strength below which a point is elastic whatever the rounding."""

SNAP = 0.1
"""Least stiffness against plastic slip, over ks. A point that slides back takes pressure, which softens it; chosen."""


@kernel(forceinline=True)
def tension(n0: float, ft: float, reach: float) -> float:
    """Normal stress of a point [Pa], compression positive.

    Pressed it is that of the spring. Pulled it grows straight from nothing to -ft at n0 = -reach, and stays there.

    Parameters
    ----------
    n0 : stress of the elastic opening if it were that of a spring, kn (w_p - w) [Pa]
    ft : tensile strength [Pa]
    reach : pull, as -n0, at which the point bears ft: ft itself where it unloads with kn [Pa]
    """
    return max(n0, 0.0) + max(min(n0, 0.0) * (ft / max(reach, TINY)), -ft)


@kernel(forceinline=True)
def stored(pull: float, ft: float, reach: float, kn: float) -> float:
    """Energy of a point in tension [J/m2]: :func:`tension` up to an opening pull / kn.

    Beyond reach / kn it gives back ft times the opening.

    Parameters
    ----------
    pull : kn times the elastic opening, 0 where the point is pressed [Pa]
    ft, reach : as in :func:`tension` [Pa]
    kn : stiffness [Pa/m]
    """
    q = min(pull, reach)
    return ft * (0.5 * q * q / max(reach, TINY) + (pull - q)) / kn


@kernel(fast=False, forceinline=True)
def stress(
    w: float, e1: float, e2: float, slip_1: float, slip_2: float, lift: float, damage: float, peak: Peak,
    softening: SofteningRow,
) -> Numbers:
    """Stress at a point in a position, and its elastic energy; changes nothing.

    Arguments are opening, shear displacement, plastic state and law as in :func:`return_map`.

    Returns
    -------
    t1, t2, n : stress on b along t1, t2 and n; n > 0 is compression [Pa]
    elastic : energy of the springs [J/m2]
    """
    kn, ks = peak.kn, peak.ks
    mu, _, c, ft = strength_of(peak, softening, damage, slip_1, slip_2)
    # pulled, the spring unloads straight to nothing from -reach, where tension has softened to
    reach = ft + damage * softening.secant
    n = min(tension(kn * (lift - w), ft, reach), kn * peak.crushing)
    a1, a2 = slip_1 - e1, slip_2 - e2
    trial = ks * np.sqrt(a1 * a1 + a2 * a2)
    # the elastic shear, shortened to c + tan(phi) N where it is larger
    ratio = min(max(c + mu * n, 0.0) / max(trial, TINY), 1.0)
    t1, t2 = ks * ratio * a1, ks * ratio * a2
    pressed = max(n, 0.0)
    held = stored(max(kn * (w - lift), 0.0), ft, reach, kn)
    return t1, t2, n, 0.5 * (pressed * pressed / kn + (t1 * t1 + t2 * t2) / ks) + held


@kernel(inline="always")
def _weakened(
    peak: Peak, softening: SofteningRow, slip_1: float, slip_2: float, damage: float, stretched: float, pressed: float,
    sheared: float, stiffer: float,
) -> Numbers:
    """Damage of a point at the end of a step, and the strength that it leaves.

    Parameters
    ----------
    peak, softening : peak values of the joint, and how it falls from them
    slip_1, slip_2 : plastic slip before the step [m]
    damage : before the step [-]
    stretched : pull of the elastic opening beyond the tensile strength, 0 within it [Pa]
    pressed : trial normal stress of spring and dashpot, compression positive [Pa]
    sheared : size of their trial shear stress [Pa]
    stiffer : stiffness of the spring with a dashpot beside it, over that of the spring alone [-]

    Returns
    -------
    h : damage after the step [-]
    mu, dil, c, ft : tan(phi), tan(psi), c [Pa] and ft [Pa] that it leaves
    reach : pull at which the point bears ft, see :func:`tension` [Pa]
    """
    # damage by opening beyond the tension cut-off (not cumulative), then by slip (cumulative): what has opened has less
    # shear to lose
    h = min(max(damage, softening.by_opening * stretched / peak.kn), 1.0)
    mu, dil, c, ft = strength_of(peak, softening, h, slip_1, slip_2)
    bears = c + mu * tension(pressed, ft, ft + h * softening.secant)
    # beyond the apex there is no shear strength that slip could break: the least shear would do
    beyond = max(sheared - bears, 0.0) / stiffer if bears >= 0.0 else 0.0
    h = min(h + softening.by_slip * beyond * (1.0 / peak.ks), 1.0)
    mu, dil, c, ft = strength_of(peak, softening, h, slip_1, slip_2)
    return h, mu, dil, c, ft, ft + h * softening.secant


@kernel(forceinline=True)
def within(
    w: float, e1: float, e2: float, slip_1: float, slip_2: float, lift: float, damage: float,
    peak: Peak, softening: SofteningRow | None, dashpot: Numbers | None,
) -> Numbers:
    """Stress at a point well within its strength, and whether it is within.

    It takes no root and no division. Arguments are opening, shear displacement, plastic state and law as in
    :func:`return_map`, which gives these numbers for such a point.

    Returns
    -------
    t1, t2, n : stress on b, compression positive [Pa]
    braked : power of the dashpots [W/m2]
    beyond : 0.0, or 1.0 where the point is not within: the others then mean nothing
    """
    kn, ks = peak.kn, peak.ks
    mu, _, c, ft = strength_of(peak, softening, damage, slip_1, slip_2)
    # pull that the spring bears with kn; tension that has softened and unloads to the origin does not, at any pull
    drawn = ft if softening is None else ft * (softening.secant * damage == 0.0)
    q1, q2, n0 = ks * (slip_1 - e1), ks * (slip_2 - e2), kn * (lift - w)
    n, braked = n0, 0.0
    if dashpot is not None:
        dash, r1, r2, r3, _ = dashpot
        # dashpots: none in an open joint, and no pull beyond the strength
        z = dash if n0 > -ft else 0.0
        q1, q2 = q1 - z * ks * r1, q2 - z * ks * r2
        z3 = max(-z * kn * r3, -ft - n0)
        n = n0 + z3
        braked = z * ks * (r1 * r1 + r2 * r2) - z3 * r3
    bears = max(c + mu * n, 0.0)
    holds = (n0 > -drawn) & (n0 < kn * peak.crushing) & (q1 * q1 + q2 * q2 < WITHIN * bears * bears)
    return q1, q2, n, braked, 0.0 if holds else 1.0


@kernel(inline="always")
def _held(peak: Peak, spring: Numbers) -> float:
    """Elastic energy of the springs of a point [J/m2].

    Parameters
    ----------
    peak : stiffnesses of the joint
    spring : n0 of :func:`tension`, normal stress, shear stress along t1 and t2, ft and reach of :func:`tension` [Pa]
    """
    n0, _, t1, t2, ft, reach = spring
    pressed = max(n0, 0.0)
    sheared = 0.5 * (t1 * t1 + t2 * t2) * (1.0 / peak.ks)
    return 0.5 * pressed * pressed / peak.kn + sheared + stored(max(-n0, 0.0), ft, reach, peak.kn)


@kernel(inline="always")
def _lost(peak: Peak, old: Numbers, now: Numbers, slid: Numbers, moved: Numbers, grows: bool) -> Numbers:
    """What springs lose in a step [J/m2]: friction, plastic opening, and damage.

    The part of the plastic opening is the negative of what is lost.

    Central differences give the blocks F(n) (x(n+1) - x(n-1)) / 2. Summed by parts that is, for every step, the mean of
    the forces at its two ends times its displacement. Of springs it is the change of their energy. So friction is the
    mean of old and new shear times the slip, and damage releases what is left of that work.

    Parameters
    ----------
    peak : stiffnesses of the joint
    old, now : springs before and after the step, see :func:`_held` [Pa]
    slid : plastic slip of the step along t1 and t2, positive the way the shear stress on b points, and plastic opening
        [m]
    moved : e1, e2, w less what they were before the step [m]
    grows : whether damage grows in the step

    Returns
    -------
    rubbed : work of the shear over the plastic slip
    raised : work of N over the plastic opening, which is given back
    broken : what damage releases
    """
    n, t1, t2 = 0.5 * (old[1] + now[1]), 0.5 * (old[2] + now[2]), 0.5 * (old[3] + now[3])
    rubbed, raised, broken = t1 * slid[0] + t2 * slid[1], n * slid[2], 0.0
    if grows:
        work = t1 * moved[0] + t2 * moved[1] + n * moved[2]  # of the joint on the blocks
        broken = _held(peak, old) - work - _held(peak, now) - (rubbed - raised)
    return rubbed, raised, broken


@kernel(inline="always")
def _opened(
    peak: Peak, inv_ks: float, w: float, n0: float, slip_1: float, slip_2: float, lift: float, worn: Numbers,
    tried: Numbers,
) -> Numbers:
    """Plastic opening of a point that dilates or crushes, from its state before.

    Dilation follows the sense of slip: what part of it leads away from where the point was made.

    Parameters
    ----------
    peak : stiffnesses and peak values of the joint
    inv_ks : 1 / ks [m/Pa]
    w : opening now [m]
    n0 : stress of the elastic opening if it were that of a spring, see :func:`tension` [Pa]
    slip_1, slip_2, lift : plastic slip and plastic opening before the step [m]
    worn : tan(phi), tan(psi), c, ft and reach that damage leaves after the step, see :func:`_weakened`
    tried : stresses before the law limits them: shear of the springs in size [Pa]; shear of springs and dashpots along
        t1, along t2 and in size [Pa]; their pressure [Pa]; and how much stiffer a dashpot makes a spring [-]

    Returns
    -------
    new : plastic opening by a slip that goes straight on [m]
    short : less than 0 by what an open point lacks of it [m]
    most : the largest that a point may have [m]
    before : plastic slip before the step [m]
    farthest : slip up to which it dilates [m]
    """
    kn, ks = peak.kn, peak.ks
    mu, dil, c, ft, reach = worn
    trial, b1, b2, total, pressed, stiffer = tried
    before = np.sqrt(slip_1 * slip_1 + slip_2 * slip_2)
    # cosine between the slip so far and that of this step, which runs against the shear stress on b: 1 away from where
    # the point was made, -1 straight back
    outward = -(slip_1 * b1 + slip_2 * b2) / max(before * total, TINY) if before > 0.0 else 1.0
    farthest = peak.lift / max(peak.tan_psi, TINY)
    outward = outward if before < farthest else 0.0
    rate = dil * outward  # plastic opening per slip
    # slip in a closed joint consistent with the friction it mobilises: sliding back takes pressure and friction with it
    slides_now = max(total - c - mu * pressed, 0.0) / (stiffer * max(ks + kn * mu * rate, SNAP * ks))
    # beyond the apex all of the shear slips and no more
    rise = rate * min(slides_now, total * inv_ks / stiffer)
    # at the apex too: an open point keeps the opening that goes with its slip, and is pressed if it slides more
    slides = rate * max(trial - max(c - mu * ft, 0.0), 0.0) * inv_ks
    room = min(slides, max(w - reach / kn - lift, 0.0))
    closed = n0 + kn * rise > -ft
    grow = rise if closed else room
    short = 0.0 if closed else room - slides
    # crushing closes what exceeds fc; a contact found anew does not dilate beyond what its joint can
    most = min(max(peak.lift, lift), w + peak.crushing)
    return min(lift + grow, most), short, most, before, farthest


@kernel(forceinline=True)
def return_map(
    w: float, e1: float, e2: float, slip_1: float, slip_2: float, lift: float, damage: float,
    peak: Peak, softening: SofteningRow | None, dashpot: Numbers | None, dilates: bool, moved: Numbers,
) -> Numbers:
    """Stress at a point at the end of a step, its plastic state, and what it lost.

    A dashpot lies beside the spring and both in line with the slider (Kelvin and Voigt's element, then Coulomb's): the
    law limits what spring and dashpot carry together, |T| <= c + tan(phi) N with the N of both, and the dashpot feels
    the rate of the elastic part, not the slip. A step dt adds dash / dt to the stiffness against plastic slip.

    Parameters
    ----------
    w : opening, initial gap included, negative where b overlaps a [m]
    e1, e2 : displacement of b against a along t1, t2 [m]
    slip_1, slip_2, lift, damage : plastic slip along t1 and t2, plastic opening [m] and damage [-] before the step
    peak : of :func:`peak_of`
    softening : of :func:`softening_of`, or None for a law that keeps its peak values
    dashpot : None, or dashpot over stiffness [s], velocity of b against a along t1, t2, n [m/s] and 1 / dt [1/s]
    dilates : whether the joint dilates or crushes; else the plastic opening stays, a quarter less work
    moved : e1, e2, w less what they were before the step [m]

    Returns
    -------
    t1, t2, n : stress on b along t1, t2 and n, that of the dashpots included; n > 0 is compression [Pa]
    slip_1, slip_2, lift, damage : state after the step, as given [m, m, m, -]
    rubbed : work of the friction over the slip [J/m2]
    raised : work of N over the plastic opening, which it loses [J/m2]
    braked : power of the dashpots [W/m2]
    broken : what damage releases [J/m2]

    Notes
    -----
    Losses close the balance of energy to second order in the step where a contact opens or closes, and to first order
    in what its dashpot takes then: its force before a step is taken for that after it. Else the balance is exact.

    In the elastic predictor ks (a1, a2) is the shear of the springs, with the sign of the stress on b, and n0 their
    pressure. Before the step ``held`` is the tensile strength, and ``reached`` the pull from which tension unloads to
    nothing; after it these are ``ft`` and ``reach``, and damage is ``h``. In the return to the cone q is the shear of
    spring and dashpot that is left. By g, which points along q, the plastic slip falls in the step.
    """
    kn, ks, fc = peak.kn, peak.ks, peak.crushing
    a1, a2 = slip_1 - e1, slip_2 - e2  # elastic predictor: the springs take all of the step
    n0 = kn * (lift - w)
    mu, dil, c, ft = strength_of(peak, softening, damage, slip_1, slip_2)
    held = reach = ft
    reached = ft if softening is None else ft + damage * softening.secant
    if dashpot is None and (dilates or softening is not None):
        # most points of a structure are well within their strength: what follows would give these numbers, to the bit
        bears = c + mu * n0
        drawn = held if reached == held else 0.0
        if n0 > -drawn and n0 < kn * fc and bears > 0.0 and ks * ks * (a1 * a1 + a2 * a2) < WITHIN * bears * bears:
            return ks * a1, ks * a2, n0, slip_1, slip_2, lift, damage, 0.0, 0.0, 0.0, 0.0
    inv_ks = 1.0 / ks  # here for all of what follows: the compiler orders products by where their factors come from
    trial = ks * np.sqrt(a1 * a1 + a2 * a2)
    if dashpot is None:
        b1, b2, total, pressed, stiffer = ks * a1, ks * a2, trial, n0, 1.0
    else:
        dash, r1, r2, r3, per_dt = dashpot
        z = dash if n0 > -held else 0.0  # no dashpot in an open joint
        b1, b2 = ks * (a1 - z * r1), ks * (a2 - z * r2)
        stiffer = 1.0 + z * per_dt
        total = np.sqrt(b1 * b1 + b2 * b2)
        pressed = n0 - z * kn * r3
    # damage of the step, and what strength it leaves
    before_mu, before_c, h = mu, c, damage
    if softening is not None:
        h, mu, dil, c, ft, reach = _weakened(
            peak, softening, slip_1, slip_2, damage, max(-n0 - held, 0.0), pressed, total, stiffer
        )
    new = lift  # plastic opening; then the normal stress of the spring
    if dilates:
        new, short, most, before, farthest = _opened(
            peak, inv_ks, w, n0, slip_1, slip_2, lift, (mu, dil, c, ft, reach),
            (trial, b1, b2, total, pressed, stiffer),
        )
        n = max(kn * (new - w), -ft) if softening is None else tension(kn * (new - w), ft, reach)
    else:
        n = max(n0, -ft) if softening is None else tension(n0, ft, reach)
    spring = n
    # what it bore before the step; a point that was open sheared nothing
    n_old = kn * (lift - w + moved[2])
    bore = max(n_old, -held) if softening is None else tension(n_old, held, reached)
    k_old = ks if before_c + before_mu * bore > 0.0 else 0.0
    t1_old, t2_old = k_old * (a1 + moved[0]), k_old * (a2 + moved[1])
    if dashpot is not None:
        z3 = max(z * kn * ((new - lift) * per_dt - r3), -ft - spring)  # no pull beyond the strength
        n = spring + z3
    # return to the cone: shear beyond it slips, and ``ratio`` is the part of the trial shear that is left
    cap = max(c + mu * n, 0.0)
    ratio = min(cap / max(total, TINY), 1.0)
    if dashpot is None:
        g1, g2 = (1.0 - ratio) * a1, (1.0 - ratio) * a2
        q1, q2, braked = ks * ratio * a1, ks * ratio * a2, 0.0
    else:
        back = (1.0 - ratio) / (ks * stiffer)
        g1, g2 = back * b1, back * b2
        q1, q2 = ratio * b1, ratio * b2
        # force of the dashpots times the rate of the elastic part
        s1, s2 = r1 + g1 * per_dt, r2 + g2 * per_dt
        braked = z * ks * (s1 * s1 + s2 * s2) + z3 * ((new - lift) * per_dt - r3)
    new_1, new_2 = slip_1 - g1, slip_2 - g2
    if dilates:
        # dilation ends with the slip, where that turns, passes its start or the farthest too
        after = np.sqrt(new_1 * new_1 + new_2 * new_2)
        new = min(lift + short + dil * (min(after, farthest) - min(before, farthest)), most)
    t1, t2 = (q1, q2) if dashpot is None else (ks * (a1 - g1), ks * (a2 - g2))  # shear of the springs now
    rubbed, raised, broken = _lost(
        peak, (n_old, bore, t1_old, t2_old, held, reached), (kn * (new - w), spring, t1, t2, ft, reach),
        (g1, g2, new - lift), moved, h > damage,
    )
    if dashpot is not None:
        rubbed += (q1 - t1) * g1 + (q2 - t2) * g2
        raised += (n - spring) * (new - lift)
    return q1, q2, n, new_1, new_2, new, h, rubbed, raised, braked, broken
