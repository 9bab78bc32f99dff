"""The public entry to limit analysis."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from limitmason.equilibrium import Grid
from limitmason.limit.associative import solve_associative
from limitmason.limit.problem import chosen_grid, make_problem
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import Prediction
from limitmason.stated import states

FLOW_RULES = ("associative", "non-associative")


@states
def limit_analysis(
    assembly: Assembly,
    loads: Loads,
    flow_rule: str = "associative",
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] | None = None,
    torsion_limit: bool | float = False,
    in_plane: bool | None = None,
    solver: str = "auto",
    tolerance: float = 1e-10,
    check_dead_load: bool = True,
    verbose: bool = False,
    **options,
) -> Prediction:
    """Collapse multiplier of an assembly by limit analysis, with mechanism, joint forces and certificate.

    Maximise lambda subject to A f + w_dead + lambda w_live = 0 and the joint law (static theorem).

    Parameters
    ----------
    assembly, loads : the problem
    flow_rule : "associative" ignores the dilatancy angle psi and takes psi = phi; "non-associative" uses psi and
        returns the smallest admissible multiplier that its search finds
    contact_model : "vertices" or "grid" (needed for crushing in 3-D)
    grid : points along and across each interface of contact_model "grid", (5, 5) by default
    torsion_limit : limit the torsion of each face to that of uniform pressure about its centre of pressure; a number is
        the torsion of uniform pressure over the strength: True is 1, 2 halves the strength, 0 limits nothing
    in_plane : True demands, False forbids the reduction to a plane problem; None uses it where it is exact
    solver : "clarabel"; "interior-point", this package's own, for walls of thousands of blocks; "auto" takes the own
        one for large problems that it covers, falls back on Clarabel, and ``provenance["solver"]`` names the one used;
        "cvxpy" or "cvxpy:NAME" (HIGHS, SCS, MOSEK, ...) goes through the same program written in cvxpy
    tolerance : of the interior-point solver [-]
    check_dead_load : also check that the structure stands without live load
    options : for "non-associative", see :func:`limitmason.limit.nonassociative.solve_nonassociative`

    Returns
    -------
    Prediction
        ``status`` tells apart "solved", "almost solved", "cannot stand under dead load", "unbounded" and
        "not converged"; ``bound`` says what the number is relative to which joint law.

    Raises
    ------
    ValueError
        For loads that do not fit the assembly, no live load, floating blocks, and combinations a model cannot
        represent.

    Notes
    -----
    The associative value is an upper bound for every dilatancy angle (Radenkovic's theorem). lambda equals the tangent
    of the tilt angle exactly only without cohesion, tension and crushing; ``Prediction.tilt_angle_deg`` refuses others.
    Wrong when blocks deform, when the geometry changes before collapse, and when the answer rests on self-stress (see
    the warnings).
    """
    if flow_rule not in FLOW_RULES:
        raise ValueError(f"flow_rule must be one of {FLOW_RULES}, got {flow_rule!r}")
    if not 0.0 <= float(torsion_limit) < np.inf:
        raise ValueError(f"torsion_limit must be True, False or a number >= 0, got {torsion_limit!r}")
    grid = chosen_grid(contact_model, grid)
    problem = make_problem(assembly, loads, contact_model=contact_model, grid=grid, in_plane=in_plane)
    if flow_rule == "associative":
        if options:
            raise TypeError(f"unknown option {sorted(options)[0]!r} for associative limit analysis")
        settings = {"torsion_limit": torsion_limit, "solver": solver, "tolerance": tolerance, "verbose": verbose}
        prediction = solve_associative(problem, check_dead_load=check_dead_load, **settings)
        if np.isfinite(problem.crushing).any() and np.isfinite(prediction.collapse_multiplier):
            coarser = make_problem(
                assembly, loads, contact_model="grid", grid=_half_as_fine(assembly, grid), in_plane=in_plane
            )
            return _with_grid_error(prediction, solve_associative(coarser, check_dead_load=False, **settings))
        return prediction
    from limitmason.limit.nonassociative import solve_nonassociative

    if torsion_limit:
        raise ValueError("torsion_limit is available with the associative flow rule only")
    if solver == "interior-point":
        raise ValueError("solver='interior-point' is available with the associative flow rule only")
    return solve_nonassociative(problem, tolerance=tolerance, check_dead_load=check_dead_load, **options)


def _half_as_fine(assembly: Assembly, grid: Grid | Mapping[str, Grid]) -> dict[str, Grid]:
    kinds = {i.kind for i in assembly.interfaces}
    table = grid if isinstance(grid, Mapping) else dict.fromkeys(kinds, grid)
    return {kind: (max(2, (n + 1) // 2), max(2, (m + 1) // 2)) for kind, (n, m) in table.items()}


def _with_grid_error(prediction: Prediction, coarser: Prediction) -> Prediction:
    """Add what half the points would have given: the error of crushing points falls faster than in proportion."""
    value, other = prediction.collapse_multiplier, coarser.collapse_multiplier
    change = (other - value) / abs(value) if value else np.nan
    warning = (
        f"crushing is checked point by point on a grid, which errs on the high side: half as many points give "
        f"{other:.6g} ({change:+.2%}), an indication of the error, not a bound; refine the grid until it stays"
    )
    return replace(
        prediction,
        warnings=(*prediction.warnings, warning),
        details={**prediction.details, "coarser_grid_multiplier": other, "grid_error_estimate": change},
    )
