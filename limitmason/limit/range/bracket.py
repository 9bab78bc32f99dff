"""Radenkovic's bracket: what is certain when dilatancy lies below friction."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from limitmason.answers.results import Bound, BoundKind, ContactModel, Prediction
from limitmason.limit.associative import solve_associative
from limitmason.limit.associative_warnings import crushed_points
from limitmason.limit.papers import papers_behind
from limitmason.limit.program.static_theorem import make_problem
from limitmason.mechanics.contact_points import Grid, chosen_grid
from limitmason.mechanics.law import peak_law
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model


@dataclass(frozen=True, eq=False)
class Bracket:
    """Certain bounds of every multiplier that the non-associative law admits.

    Parameters
    ----------
    lower : associative analysis with the friction angle replaced by the dilatancy angle; weak, zero or
        "cannot stand" for psi = 0 whenever sliding matters
    upper : associative analysis with the friction angle
    """

    lower: Prediction
    upper: Prediction

    def __str__(self) -> str:
        """Both bounds on one line."""
        low, high = self.lower.collapse_multiplier, self.upper.collapse_multiplier
        if math.isnan(high):
            return f"no bounds of lambda: {self.upper.status}"
        text = f"{self.lower.status} with phi = psi: no lower bound" if math.isnan(low) else f"{low:.6g}"
        return f"{text} <= lambda <= {high:.6g} (Radenkovic)"


@of_model
def limit_bracket(
    assembly: Assembly,
    loads: Loads,
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] | None = None,
    in_plane: bool | None = None,
) -> Bracket:
    """Upper and lower bound of the multiplier for any flow rule between psi and phi.

    lambda_assoc(phi := psi) <= lambda <= lambda_assoc(phi).

    Parameters
    ----------
    assembly, loads : the problem; the joints' dilatancy angles are used
    contact_model, grid, in_plane : as in :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Bracket
        Its two predictions hold the bounds as their multipliers.

    Notes
    -----
    Source: Radenkovic's two theorems (1961). The lower bound replaces tan(phi) by tan(psi) and keeps crushing and the
    tension corner t = min(ft, c / tan(phi)), so that the cohesion becomes c - (tan(phi) - tan(psi)) t: with the full
    cohesion the reduced law would leave the true one where joints are in tension.
    """
    grid = chosen_grid(contact_model, grid)
    options: dict[str, Any] = {"contact_model": contact_model, "grid": grid, "in_plane": in_plane}
    problem = make_problem(assembly, loads, **options)
    upper = solve_associative(problem)
    c = upper.certificate
    if c is not None and c.discretisation > 0.0:
        # the forces of cells of cohesive faces give a lower bound: what lies above every flow rule is the mechanism's
        upper = replace(upper, collapse_multiplier=c.kinematic_multiplier)
    lower = solve_associative(make_problem(assembly.with_joints(inside), loads, **options))
    of_all = "bound for every flow rule between psi and phi (Radenkovic)"
    below, above = Bound(BoundKind.LOWER, f"lower {of_all}"), Bound(BoundKind.UPPER, f"upper {of_all}")
    if problem.crushing_points.any():
        # points bear more than the faces that they stand for, or less: no certain bound of these
        where = crushed_points(problem)
        below = Bound(BoundKind.ESTIMATE, f"estimate: lower {of_all} at {where}")
        if problem.contact_model == ContactModel.LOBATTO:
            above = Bound(BoundKind.ESTIMATE, f"estimate: upper {of_all} at {where}")
    upper, lower = (replace(p, references=papers_behind(p)) for p in (upper, lower))
    return Bracket(replace(lower, bound=below), replace(upper, bound=above))


def inside(joint: Joint) -> Joint:
    """The ``joint`` with friction psi, inside its law, with its tension corner."""
    law = peak_law([joint]).inside()
    return replace(
        joint, friction_angle_deg=joint.dilatancy_angle_deg, cohesion=float(law.cohesion[0]),
        tensile_strength=float(law.tension[0]),
    )
