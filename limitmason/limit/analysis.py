"""The public entry to limit analysis."""

from collections.abc import Mapping

from limitmason.equilibrium import Grid
from limitmason.limit.associative import solve_associative
from limitmason.limit.problem import make_problem
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import Prediction

FLOW_RULES = ("associative", "non-associative")


def limit_analysis(
    assembly: Assembly,
    loads: Loads,
    flow_rule: str = "associative",
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] = (5, 5),
    torsion_limit: bool = False,
    in_plane: bool | None = None,
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
    grid : points along and across each interface
    torsion_limit : limit the torsion of each face to that of uniform pressure about its centre of pressure
    in_plane : True demands, False forbids the reduction to a plane problem; None uses it where it is exact
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
    of the tilt angle exactly only without cohesion, tension and crushing. Wrong when blocks deform, when the geometry
    changes before collapse, and when the answer rests on self-stress (see the warnings).
    """
    if flow_rule not in FLOW_RULES:
        raise ValueError(f"flow_rule must be one of {FLOW_RULES}, got {flow_rule!r}")
    problem = make_problem(assembly, loads, contact_model=contact_model, grid=grid, in_plane=in_plane)
    if flow_rule == "associative":
        if options:
            raise TypeError(f"unknown option {sorted(options)[0]!r} for associative limit analysis")
        return solve_associative(
            problem, torsion_limit=torsion_limit, tolerance=tolerance, check_dead_load=check_dead_load, verbose=verbose
        )
    from limitmason.limit.nonassociative import solve_nonassociative

    if torsion_limit:
        raise ValueError("torsion_limit is available with the associative flow rule only")
    return solve_nonassociative(problem, tolerance=tolerance, check_dead_load=check_dead_load, **options)
