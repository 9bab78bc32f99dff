"""Mechanisms A and B: a facade rocks alone, or with the wedges that stepped cracks cut from its side walls."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.arrays import Array
from limitmason.checks import choice, finite
from limitmason.errors import InputError, NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from mechanisms.built_wall import foot_level
from mechanisms.friction import FrictionSums, bed_joint_friction, joint_friction
from mechanisms.optimum import PowerRatio, SmallestValue, least
from mechanisms.parameters import ROUNDING, Facade, ReadParameters, check_reduction, courses_to_try, read
from mechanisms.stepping_courses import best_steps
from mechanisms.velocity_field import ESTIMATE, UPPER_IDEAL, answer, rocking_twists
from mechanisms.virtual_work_check import rocking_power

SOURCE_A = "Murano et al., eq (24), after Casapulla et al.; terms derived (docs/mechanisms.md, section 3)"
SOURCE_B = "Murano et al., eq (25), after Casapulla et al.; terms derived (docs/mechanisms.md, section 3)"
BELOW_CRACK = ("connected", "free")
CRACKS = ("straight", "stepped")


def simple_rocking(
    facade: Facade | Assembly,
    *,
    loads: Loads | None = None,
    side_walls: int | None = None,
    hinge_courses: int | None = None,
    reduction: float = 1.0,
) -> Prediction:
    """Return mechanism A: a facade rocks alone, cut off from its side walls.

    The facade rocks outwards and slides along vertical cracks at its side walls.

        lambda_A = [W t/2 + Q X_Q + n_s (F_g Z_g + F_q Z_q)] / [W H_k/2 + Q H_k],    W = gamma t L H_k

    Parameters
    ----------
    facade : parameters, or an assembly from which they are read and on which the motion is returned
    loads : of the assembly; horizontal weights along -y where omitted
    side_walls : n_s, in place of the facade's
    hinge_courses : n_k, courses between the top and the hinge; the worst where omitted
    reduction : omega on the friction: 1 full, 0 none [-]

    Returns
    -------
    Prediction
        ``details``: hinge_courses, hinge_height [m], F_g, F_q [N], Z_g, Z_q [m], omega, omega_bracket (multiplier
        without and with full friction, each at its own worst hinge), power.

    Raises
    ------
    InputError
        For a hinge outside the wall or a reduction outside 0 to 1.
    NotApplicable
        For an assembly as :meth:`Facade.from_assembly`.

    Notes
    -----
    Sign: the facade falls away from its side walls, about the toe line of its outer face. Source: Murano et al.,
    eq (24), floor-beam term mu Q Z left out as there; friction sums derived. The friction is a prescribed force: a
    moving unit over a fixed one rises and loses the contact that is said to rub. Without side walls it
    is an upper bound, exact for a free wall: t/H.
    """
    seen = read(facade, loads, side_walls=side_walls)
    f = seen.facade
    check_reduction(reduction)
    hinges = courses_to_try("hinge_courses", hinge_courses, f.courses)
    found = {n: rocking_terms(f, n, n, reduction=reduction) for n in hinges}
    n = min(found, key=lambda k: found[k].at(0.0))
    bracket = tuple(min(rocking_terms(f, k, k, reduction=w).at(0.0) for k in hinges) for w in (0.0, 1.0))
    details = _details(f, n, n, tangent=0.0, sums=found[n].friction, omega=reduction, bracket=bracket)
    details["power"] = rocking_power(f, hinge=n, crossed=n, reduction=reduction).as_dict()
    return answer(
        "simple rocking (A)", found[n].at(0.0), **seen._asdict(), details=details, source=SOURCE_A,
        twists=_twists(seen, details["hinge_height"], lambda z: f.crack_offset),
        ideal_bound=ESTIMATE if f.side_walls else UPPER_IDEAL,
    )


def compound_rocking(
    facade: Facade | Assembly,
    *,
    loads: Loads | None = None,
    side_walls: int | None = None,
    hinge_courses: int | None = None,
    crossed_courses: int | str | None = None,
    crack_tangent: float | None = None,
    reduction: float | None = None,
    crack: str = "straight",
    below_crack: str = "connected",
) -> Prediction:
    """Return mechanism B: a facade rocks outwards with wedges of its side walls.

        lambda_B = [W t/2 + Q X_Q + n_s (W_D X_D + Q_s X_s + omega (F_g Z_g + F_q Z_q))]
                   / [W H_k/2 + Q H_k + n_s (W_D Z_D + Q_s Z_s)]
        b = H_c tan(alpha_c),  W_D = gamma t_s H_c b/2,  X_D = x_0 + b/3,  Z_D = z_b + 2 H_c/3,
        Q_s = q_s b,  X_s = x_0 + b/2,  Z_s = H_k,  omega = 1 - tan(alpha_c)/tan(alpha_b)

    minimised exactly over hinge height, crossed courses and crack angle, or over which courses step.

    Parameters
    ----------
    facade, loads, side_walls, hinge_courses : as in :func:`simple_rocking`
    crossed_courses : n_c, "hinge" for n_c = n_k; the worst of 1..n_k where omitted
    crack_tangent : tan(alpha_c) [-]; the worst where omitted
    reduction : omega; 1 - tan(alpha_c)/tan(alpha_b) where omitted
    crack : "straight", friction reduced as if steps were spread evenly; "stepped", the worst choice of whole courses
        that step, each with the friction of the joints that remain (exact, by dynamic programming)
    below_crack : "connected", the vertical joint between hinge and crack keeps its friction; "free", it has none, as
        the formula reads: the minimum then runs to one crossed course and to t/H

    Returns
    -------
    Prediction
        ``details`` as of :func:`simple_rocking`, and crossed_courses, crack_tangent, crack_angle_deg, wedge_width [m]
        at the top, stepping_courses (from the top) for a stepped crack.

    Raises
    ------
    InputError
        Naming the argument that is wrong; for a given crack that leaves the side walls.
    NotApplicable
        Without side walls; for an assembly as :meth:`Facade.from_assembly`.

    Notes
    -----
    Source: Murano et al., eq (25), read with omega on the friction moments only, the one reading that follows from
    virtual work. An engineering estimate, no bound: see :func:`simple_rocking`. Wrong where side walls are cracked or
    poorly bonded to the facade, and where the facade bends between them (mechanism D).
    """
    seen = read(facade, loads, side_walls=side_walls)
    f = seen.facade
    if f.side_walls < 1:
        raise NotApplicable(
            "side_walls must be at least 1: without side walls there is nothing to take along (mechanism A)"
        )
    choice("crack", crack, CRACKS)
    choice("below_crack", below_crack, BELOW_CRACK)
    if crack == "stepped":
        taken = {"crossed_courses": crossed_courses, "crack_tangent": crack_tangent, "reduction": reduction}
        given = [name for name, value in taken.items() if value is not None]
        if given or below_crack != "connected":
            raise InputError(
                f"{(given or ['below_crack'])[0]} is for a straight crack; a stepped one is searched whole"
            )
        return _stepped(seen, hinge_courses)
    check_reduction(reduction)
    steepest = f.steepest_crack
    if crack_tangent is not None and not 0.0 <= finite("crack_tangent", crack_tangent) <= steepest * (1.0 + ROUNDING):
        raise InputError(f"crack_tangent must lie between 0 and tan(alpha_b) = {steepest:g}, got {crack_tangent!r}")

    def limit_of(m: int) -> float:
        """Largest tangent of a crack across m courses: no steeper than the bond steps, and within the side wall."""
        return min(f.steepest_crack, f.side_wall_length / (m * f.course_height))

    def at_worst(n: int, m: int, omega: float | None) -> SmallestValue:
        """Smallest multiplier over the crack's tangent, with n courses above the hinge and m that it crosses."""
        limit = limit_of(m)
        return rocking_terms(f, n, m, reduction=omega, below_crack=below_crack).smallest(limit, crack_tangent)

    def search(omega: float | None) -> tuple[SmallestValue, int, int]:
        """Smallest multiplier, courses above the hinge and crossed courses, of all that are tried.

        ``omega`` is the share of friction that the crack leaves [-], None for 1 - tan(alpha_c)/tan(alpha_b).
        """
        best = least(
            (at_worst(n, m, omega), n, m)
            for n in courses_to_try("hinge_courses", hinge_courses, f.courses)
            for m in _crossed(crossed_courses, n, given=hinge_courses is not None)
            if crack_tangent is None or crack_tangent <= limit_of(m) * (1.0 + ROUNDING)
        )
        if best is None and crack_tangent is not None and crack_tangent > limit_of(f.courses):
            raise InputError(
                f"crack_tangent {crack_tangent!r} leaves the side walls, {f.side_wall_length:g} m long, above all of "
                "the courses asked for"
            )
        if best is None:
            raise InputError(f"crossed_courses must be a whole number from 1 to {f.courses}, got {crossed_courses!r}")
        return best

    (value, tangent), n, m = search(reduction)
    omega = max(1.0 - tangent / f.steepest_crack, 0.0) if reduction is None else reduction
    bracket = (search(0.0)[0].value, search(1.0)[0].value)
    friction = rocking_terms(f, n, m, below_crack=below_crack).friction
    details = _details(f, n, m, tangent, friction, omega, bracket)
    power = rocking_power(f, hinge=n, crossed=m, tangent=tangent, reduction=omega, below_crack=below_crack)
    details["power"] = power.as_dict()
    z_b = f.height - m * f.course_height
    return answer(
        "compound rocking (B)", value, **seen._asdict(), details=details, source=SOURCE_B,
        twists=_twists(seen, details["hinge_height"], lambda z: f.crack_offset + max(z - z_b, 0.0) * tangent),
    )


def rocking_terms(
    facade: Facade, hinge: int, crossed: int, *, reduction: float | None = None, below_crack: str = "connected",
    friction: FrictionSums | None = None,
) -> PowerRatio:
    """Numerator and denominator of lambda_B as polynomials in s, the tangent of the crack.

    lambda_B = (resisting + side walls * side_n) / (driving + side walls * side_d), each moments about the hinge over
    powers 0, 1, 2 of s [N m]. s = 0 gives lambda_A.

    Parameters
    ----------
    facade : parameters
    hinge : courses from the top to the hinge
    crossed : courses that the crack crosses
    reduction : share of the friction that counts, 1 - s / s_max by default [-]
    below_crack : "connected", joints between hinge and crack keep their friction; "free", they have none
    friction : sums over the crossed joints, where they are known; worked out otherwise
    """
    f, h = facade, facade.course_height
    top, crack = hinge * h, crossed * h
    base = top - crack
    sums = friction or bed_joint_friction(
        friction=f.friction, unit_weight=f.unit_weight, thickness=f.side_wall_thickness, staggering=f.staggering,
        course_height=h, crossed=crossed, overload=f.side_overload, base_height=base,
    )
    resisting, driving = np.outer(f.rocking_powers(top), [1.0, 0.0, 0.0])
    # wedge and overload on it, per side wall: b = H_c s
    wedge = 0.5 * f.unit_weight * f.side_wall_thickness * crack**2
    load_s, x0 = f.side_overload * crack, f.crack_offset
    # moments of wedge and its overload about the hinge: to stabilise, and per lambda to overturn
    side_n = np.array([0.0, (wedge + load_s) * x0, wedge * crack / 3.0 + 0.5 * load_s * crack])
    side_d = np.array([0.0, wedge * (base + 2.0 * crack / 3.0) + load_s * f.side_overload_inertia * top, 0.0])
    # omega, the share of friction that counts, as a polynomial in s too
    share = np.array([1.0, -1.0 / f.steepest_crack, 0.0]) if reduction is None else np.array([reduction, 0.0, 0.0])
    side_n += share * sums.moment
    if below_crack == "connected" and crossed < hinge:
        joints = np.arange(crossed + 1.0, hinge + 1.0)
        side_n[0] += float(joint_friction(f, joints) @ ((hinge - joints) * h))  # forces times heights above the hinge
    return PowerRatio(resisting + f.side_walls * side_n, driving + f.side_walls * side_d, sums)


def _stepped(seen: ReadParameters, hinge_courses: int | None) -> Prediction:
    """Compound rocking whose crack follows whole courses, at the worst hinge.

    Parameters
    ----------
    seen : parameters, and the assembly and loads that they were read from
    hinge_courses : courses from the top to the hinge; None for the worst
    """
    f, h = seen.facade, seen.facade.course_height
    hinges = courses_to_try("hinge_courses", hinge_courses, f.courses)
    found = {n: best_steps(f, n) for n in hinges}
    n = min(found, key=lambda k: found[k].multiplier)
    steps = found[n].courses
    # friction and heights of the joints that go on rubbing
    joints = np.array([j for j in range(1, n + 1) if j not in steps], dtype=float)
    own = joint_friction(f.changed(side_overload=0.0), joints)
    load = joint_friction(f, joints) - own
    arm = (n - joints) * h
    sums = FrictionSums(
        weight=float(own.sum()), weight_height=_mean(arm, own),
        overload=float(load.sum()), overload_height=_mean(arm, load),
    )
    width, crossed = len(steps) * f.steepest_crack * h, max(steps, default=0)
    bracket = (
        min(best_steps(f, k, reduction=0.0).multiplier for k in hinges),
        min(best_steps(f, k, keep_all=True).multiplier for k in hinges),
    )
    # in place of tangent and reduction of a straight crack: the mean slope, and the share of courses that do not step
    mean_tangent = width / (crossed * h) if crossed else 0.0
    details = _details(f, n, crossed, mean_tangent, sums, 1.0 - len(steps) / n, bracket)
    details |= {"stepping_courses": steps, "wedge_width": width}
    details["power"] = rocking_power(f, hinge=n, crossed=n, stepping=steps).as_dict()

    def line(z: float) -> float:
        """Distance of the crack from the outer face at a height above the foot [m]: each step below adds v."""
        depth = (f.height - z) / h  # courses below the top
        return f.crack_offset + f.steepest_crack * h * sum(min(max(j - depth, 0.0), 1.0) for j in steps)

    return answer(
        "compound rocking, whole courses step (B)", found[n].multiplier, **seen._asdict(),
        twists=_twists(seen, details["hinge_height"], line), details=details, source=SOURCE_B,
    )


def _mean(arm: Array, force: Array) -> float:
    """Arm of the resultant of parallel forces, shapes (k,), or 0 where there is no force."""
    return float(arm @ force / force.sum()) if force.sum() > 0.0 else 0.0


def _details(
    f: Facade, hinge: int, crossed: int, tangent: float, sums: FrictionSums, omega: float, bracket: tuple
) -> dict[str, Any]:
    """Geometry and friction of mechanism A or B, by name.

    Parameters
    ----------
    f : parameters
    hinge : courses from the top to the hinge
    crossed : courses that the crack crosses, from the top
    tangent : of the crack from the vertical [-]
    sums : friction of the crossed joints
    omega : share of it that the crack leaves [-]
    bracket : multipliers with none and with all of the friction [-]
    """
    return {
        "hinge_courses": hinge, "hinge_height": f.height - hinge * f.course_height, "crossed_courses": crossed,
        "crack_tangent": tangent, "crack_angle_deg": math.degrees(math.atan(tangent)),
        "wedge_width": tangent * crossed * f.course_height,
        "F_g": sums.weight, "Z_g": sums.weight_height, "F_q": sums.overload, "Z_q": sums.overload_height,
        "omega": omega, "omega_bracket": bracket,
    }


def _twists(seen: ReadParameters, level: float, crack: Callable[[float], float]) -> Array | None:
    """Velocities of the blocks as they rock about a hinge, shape (n, 6); None without an assembly.

    Parameters
    ----------
    seen : parameters, and the assembly and loads that they were read from
    level : height of the hinge above the foot [m]
    crack : distance of the crack from the outer face [m] at a height above the foot [m]
    """
    if seen.assembly is None or seen.loads is None:
        return None
    foot = foot_level(seen.assembly)
    return rocking_twists(seen.assembly, seen.loads, foot + level, lambda z: crack(z - foot))


def _crossed(value: int | str | None, hinge: int, *, given: bool) -> range:
    """Numbers of courses that a crack may cross, for one hinge.

    Parameters
    ----------
    value : the number asked for, "hinge" for as many as above the hinge, or None for all that are possible
    hinge : courses from the top to the hinge
    given : whether a user chose the hinge: a crack below it is then refused, else that hinge is passed over
    """
    if value == "hinge":
        return range(hinge, hinge + 1)
    if isinstance(value, str):
        raise InputError(f"crossed_courses must be a number of courses or 'hinge', got {value!r}")
    if value is not None and finite("crossed_courses", value) > hinge:
        if not given:
            return range(0)
        raise InputError(f"crossed_courses {value} exceeds hinge_courses {hinge}: the crack would pass below the hinge")
    return courses_to_try("crossed_courses", value, hinge)
