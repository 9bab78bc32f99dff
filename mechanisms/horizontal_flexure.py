"""Mechanism D: horizontal flexure of a facade held by its side walls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.checks import finite, not_negative, switch
from limitmason.errors import InputError, NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from mechanisms.built_wall import foot_level
from mechanisms.friction import bed_joint_friction, edge_radii, torsion_radius
from mechanisms.optimum import PowerRatio, SmallestValue, least
from mechanisms.parameters import ROUNDING, Facade, ReadParameters, check_reduction, courses_to_try, read
from mechanisms.velocity_field import ESTIMATE, THIS_MOTION, answer, flexure_twists
from mechanisms.virtual_work_check import flexure_power

SOURCE_D = (
    "structure of Murano et al., eq (26), after Casapulla et al.; kinematics derived (docs/mechanisms.md, section 4.2)"
)


def horizontal_flexure(
    facade: Facade | Assembly,
    *,
    loads: Loads | None = None,
    side_walls: int | None = None,
    hinge_courses: int | None = None,
    crack_tangent: float | None = None,
    contact_factor: float = 1.0,
    torsion_arm: float | None = None,
    reduction: float | None = None,
    interaction: bool = False,
) -> Prediction:
    """Return mechanism D: horizontal flexure of a facade held by its side walls.

    The middle of the facade (B) rocks, and two triangles (A) turn about inclined lines beside it.

        lambda_D = [(2 W_A + W_B) t/2 + (2 Q_A + Q_B) X_Q + 2 (1 + omega) k d_0 (F_g + F_q) / tan(a)]
                   / [2 W_A H_k/3 + W_B H_k/2 + (Q_A + Q_B) H_k]
        W_A = gamma t H_k^2 tan(a)/2,  W_B = gamma t H_k c,  c = L - 2 H_k tan(a),  Q_A = q H_k tan(a),  Q_B = q c

    minimised exactly over hinge height and angle, 0 < tan(a) <= min(tan(alpha_b), L / (2 H_k)).

    Parameters
    ----------
    facade, loads, hinge_courses : as in :func:`mechanisms.simple_rocking`
    side_walls : 2 (both ends held) or 1 (one end held, the other free: half of a wall of length 2 L)
    crack_tangent : tan(a) [-]; the worst where omitted
    contact_factor : k, share of the overlap in contact; Murano et al. take 0.5 [-]
    torsion_arm : d_0 [m]; polar mean radius of the overlap v x t where omitted
    reduction : omega of the inclined lines; 1 - tan(a)/tan(alpha_b) where omitted
    interaction : add the term 2 k d_0 (1 + omega)/2 (W_A + W_B + Q_A + Q_B)/tan(a) of eq (26) to the denominator;
        as a -> 0 it turns into the shear of the side lines alone and draws the minimum to one course: off by default

    Returns
    -------
    Prediction
        ``details``: hinge_courses, hinge_height [m], crack_tangent, crack_angle_deg, middle_width c [m], F_g, F_q [N],
        d_0 [m], omega, omega_bracket, edge_pole_multipliers (same angle, the pole on the outer face instead of the
        overlap's centre: middle and end of its edge), power (without the interaction term).

    Raises
    ------
    InputError
        Naming the argument that is wrong.
    NotApplicable
        Without side walls; for an assembly as :meth:`Facade.from_assembly`.

    Notes
    -----
    Source: structure of Murano et al., eq (26), whose printed letters cannot be trusted; kinematics, lifts and travels
    are derived. The motion is not admissible as a contact field and the friction is prescribed: an estimate, no bound.
    Without friction it is the exact value of this motion, t/H as a -> 0 and 1.5 t/H at c = 0. Blocks A and B share an
    edge on the outer face, so the true pole of their relative rotation lies there and not where d_0 is taken.
    """
    seen = read(facade, loads, side_walls=side_walls)
    f = seen.facade
    if f.side_walls not in (1, 2):
        raise NotApplicable(f"side_walls must be 1 or 2 for horizontal flexure, got {f.side_walls}")
    if not 0.0 < finite("contact_factor", contact_factor) <= 1.0:
        raise InputError(f"contact_factor must be above 0 and at most 1, got {contact_factor!r}")
    check_reduction(reduction)
    interaction = switch("interaction", interaction)
    hinges = courses_to_try("hinge_courses", hinge_courses, f.courses)
    arm = torsion_radius(f.staggering, f.thickness) if torsion_arm is None else torsion_arm
    arm = not_negative("torsion_arm", arm)
    if crack_tangent is not None:
        finite("crack_tangent", crack_tangent)

    def terms_of(n: int, radius: float, omega: float | None) -> PowerRatio:
        """Multiplier over the crack's tangent with the hinge under n courses, and torsion at a radius [m]."""
        return flexure_terms(f, n, contact_factor * radius, reduction=omega, interaction=interaction)

    def search(omega: float | None) -> tuple[SmallestValue, int]:
        """Smallest multiplier, and courses above its hinge, over all hinges and cracks.

        ``omega`` is the share of friction on inclined lines [-], None for 1 - tan(a)/tan(alpha_b).
        """
        # no steeper than the bond steps, and no further than the middle of the wall
        limits = {n: min(f.steepest_crack, _whole_length(f) / (2.0 * n * f.course_height)) for n in hinges}
        best = least(
            (terms_of(n, arm, omega).smallest(limit, crack_tangent), n)
            for n, limit in limits.items()
            if crack_tangent is None or 0.0 <= crack_tangent <= limit * (1.0 + ROUNDING)
        )
        if best is None:
            raise InputError(f"crack_tangent {crack_tangent!r} must lie between 0 and min(tan(alpha_b), L / (2 H_k))")
        return best

    (value, tangent), n = search(reduction)
    if math.isinf(value):
        raise InputError(f"crack_tangent must be above 0, got {crack_tangent!r}: friction holds upright cracks")
    omega = max(1.0 - tangent / f.steepest_crack, 0.0) if reduction is None else reduction
    height, pair = n * f.course_height, edge_radii(f.staggering, f.thickness)
    friction, hinge_height = terms_of(n, arm, reduction).friction, f.height - height
    details: dict[str, Any] = {
        "hinge_courses": n, "hinge_height": hinge_height,
        "crack_tangent": tangent, "crack_angle_deg": math.degrees(math.atan(tangent)),
        "middle_width": _whole_length(f) - 2.0 * height * tangent,
        "F_g": friction.weight, "F_q": friction.overload, "d_0": arm,
        "omega": omega, "omega_bracket": (search(0.0)[0].value, search(1.0)[0].value),
        "edge_pole_multipliers": tuple(terms_of(n, r, reduction).at(tangent) for r in pair),
    }
    if tangent > 0.0:  # at tan(a) = 0 the triangles vanish, and powers per turn of the middle have no limit
        details["power"] = flexure_power(
            f, hinge=n, tangent=tangent, contact_factor=contact_factor, torsion_radius=arm, reduction=omega
        ).as_dict()
    warnings: tuple[str, ...] = ()
    if interaction:
        warnings = ("the interaction term assumes a base without shear; small angles and few courses rest on it alone",)
    warnings += (other := other_ends(seen))
    # on an assembly's blocks, where the live loads work in the motion: few courses may have no block in the triangles
    twists = None
    if seen.assembly is not None and seen.loads is not None and tangent > 0.0 and not other:
        twists = flexure_twists(seen.assembly, seen.loads, foot_level(seen.assembly) + hinge_height, tangent)
        twists = twists if (seen.loads.live * twists).sum() > 0.0 else None
    return answer(
        "horizontal flexure (D)", value, **seen._asdict(), twists=twists, details=details, warnings=warnings,
        ideal_bound=ESTIMATE if f.friction else THIS_MOTION, source=SOURCE_D,
    )


def flexure_terms(
    facade: Facade, hinge: int, radius: float, *, reduction: float | None = None, interaction: bool = False
) -> PowerRatio:
    """Return numerator and denominator of lambda_D, both times tan(a), as polynomials in tan(a).

    Parameters
    ----------
    facade : parameters
    hinge : n_k, courses between the top and the hinge
    radius : k d_0 [m], contact factor times the radius at which friction resists torsion
    reduction : omega, share of the friction that inclined lines keep [-]; None for 1 - tan(a)/tan(alpha_b)
    interaction : whether the term of eq (26) is added to the denominator
    """
    f, h = facade, facade.course_height
    length, height = _whole_length(f), hinge * h
    q = f.overload * f.overload_length / f.length  # the overload spread over the whole top [N/m]
    sums = bed_joint_friction(
        friction=f.friction, unit_weight=f.unit_weight, thickness=f.thickness, staggering=f.staggering,
        course_height=h, crossed=hinge, overload=q,
    )
    per_length = f.unit_weight * f.thickness * height  # weight of the facade above the hinge [N/m]
    # polynomials in s = tan(a), [a, b] for a + b s: weight of both A triangles together, width of B, overload of all
    pair, middle = np.array([0.0, per_length * height]), np.array([length, -2.0 * height])
    load = q * (middle + np.array([0.0, 2.0 * height]))
    omega = np.array([1.0, -1.0 / f.steepest_crack]) if reduction is None else np.array([reduction, 0.0])
    lift = (pair + per_length * middle) * 0.5 * f.thickness + load * f.overload_offset
    # the A triangles' top edge moves H_k / 2 on average, in units of the travel of B's top
    edge = q * f.overload_inertia * (middle + np.array([0.0, height]))
    travel = pair * height / 3.0 + per_length * middle * 0.5 * height + edge * height
    travel += load * f.overload_inertia * f.overload_rise
    # times s: friction is over tan(a), so that its term gets coefficients of 1 and s, all others of s and s^2
    numerator = np.concatenate([[0.0], lift])
    numerator[:2] += 2.0 * (np.array([1.0, 0.0]) + omega) * radius * sums.force
    denominator = np.concatenate([[0.0], travel])
    if interaction:
        # half of both triangles and of their load, all of B and of its load
        carried = 0.5 * pair + per_length * middle + q * (middle + np.array([0.0, height]))
        denominator += np.convolve(np.array([1.0, 0.0]) + omega, carried) * radius
    return PowerRatio(numerator, denominator, sums)


def other_ends(seen: ReadParameters) -> tuple[str, ...]:
    """A warning where ``side_walls`` is not what a built wall has: its blocks then do not move as the formula says."""
    recipe = {} if seen.assembly is None else seen.assembly.recipe
    walls = len(recipe.get("returns", ()))
    if recipe.get("plan") not in ("L", "U") or walls == seen.facade.side_walls:
        return ()
    return (f"side_walls={seen.facade.side_walls}, and the wall has {walls}: no motion of its blocks is given",)


def _whole_length(f: Facade) -> float:
    """Length of the wall held at both ends: twice the facade where one end is free."""
    return f.length if f.side_walls == 2 else 2.0 * f.length
