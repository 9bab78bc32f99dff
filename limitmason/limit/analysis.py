"""The public entry to limit analysis."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.method import hyphened
from limitmason.answers.results import ContactModel, FlowRule, Prediction, Status
from limitmason.checks import choice, not_negative, positive, switch
from limitmason.display.progress import watched
from limitmason.errors import InputError
from limitmason.limit.associative import analyse
from limitmason.limit.papers import papers_behind
from limitmason.limit.parts import governed, independent_parts
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.limit.solvers import TOLERANCE
from limitmason.mechanics.contact_points import Grid, chosen_grid
from limitmason.mechanics.law_table import refuse
from limitmason.mechanics.model_notes import adds_model_notes
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.interrupts import handed_on

FLOW_RULES = ("associative", "non-associative")

LARGE_SPACING = 1.99
"""Largest spacing of contact points that is not taken for a number of points [m]: 2 and more may be."""


@of_model
@watched("limit analysis")
@adds_model_notes(cites=papers_behind)
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
    tolerance: float = TOLERANCE,
    check_dead_load: bool = True,
    verbose: bool = False,
    **options: Any,
) -> Prediction:
    """Collapse multiplier by limit analysis, with mechanism, forces and certificate.

    Maximise lambda subject to A f + w_dead + lambda w_live = 0 and the joint law (static theorem).

    Parameters
    ----------
    assembly, loads : the problem
    flow_rule : "associative" ignores the dilatancy angle psi and takes psi = phi; "non-associative" uses psi and
        returns the smallest admissible multiplier that its search finds
    contact_model : "vertices" or "grid" (needed for crushing in 3-D)
    grid : points along and across each interface of contact_model "grid", (5, 5) by default
    torsion_limit : limit the torsion of each face to that of uniform pressure about its centre of pressure; a number is
        the torsion of uniform pressure over the strength: True is 1, 2 halves the strength, 0 limits nothing. An
        estimate: a face that also slides is taken up to 7 % too strong if square, 14 % if long. In plane no face twists
        and it changes nothing
    in_plane : True demands, False forbids the reduction to a plane problem; None uses it where it is exact
    solver : "clarabel"; "interior-point", this package's own, for walls of thousands of blocks; "auto" takes the own
        one for large problems that it covers, falls back on Clarabel, and ``provenance["solver"]`` names the one used;
        "cvxpy" or "cvxpy:NAME" (HIGHS, SCS, MOSEK, ...) goes through the same program written in cvxpy; associative
        only, and with a torsion limit "auto" or "clarabel" only
    tolerance : of the interior-point solver [-]
    check_dead_load : also check that the structure stands without live load
    verbose : report every iteration of the solver; associative only (``progress`` does for "non-associative")
    options : for "non-associative", see :func:`limitmason.limit.nonassociative.analysis.solve_nonassociative`

    Returns
    -------
    Prediction
        ``status`` tells apart "solved", "almost solved", "cannot stand under dead load", "unbounded", "not converged"
        and "time limit ended it", for a non-associative state that is not yet admissible, or "interrupted", for the
        best state until Ctrl-C; ``bound`` says what the number is relative to which joint law. Of a structure that
        cannot stand ``mechanism`` is the motion by which it falls and ``details["falling_blocks"]`` names its blocks.
        Parts of the assembly that no joint between free blocks connects are solved apart, each in units of its own
        load; the smallest multiplier governs, ``details["parts"]`` lists them all.

    Raises
    ------
    InputError
        For loads that do not fit the assembly, no live load, floating blocks, and options that exclude each other.
    NotApplicable
        For joint laws that the analysis cannot represent.

    Notes
    -----
    The associative value is an upper bound for every dilatancy angle (Radenkovic's theorem). lambda equals the tangent
    of the tilt angle exactly only without cohesion, tension and crushing; ``Prediction.tilt_angle_deg`` refuses others.
    Wrong when blocks deform, when the geometry changes before collapse, and when the answer rests on self-stress (see
    the warnings).
    """
    flow_rule = choice("flow_rule", hyphened(flow_rule), FLOW_RULES)
    positive("tolerance", tolerance)
    not_negative("torsion_limit", int(torsion_limit) if isinstance(torsion_limit, bool) else torsion_limit)
    verbose = switch("verbose", verbose)
    check_dead_load = switch("check_dead_load", check_dead_load)
    if flow_rule == "associative" and options:
        raise TypeError(f"unknown option {sorted(options)[0]!r} for associative limit analysis")
    if flow_rule == "non-associative":
        if torsion_limit:
            raise InputError("torsion_limit is available with the associative flow rule only")
        if solver != "auto":
            raise InputError(f"solver={solver!r} is available with the associative flow rule only")
    refuse(flow_rule, assembly)
    grid = chosen_grid(contact_model, grid)
    model: dict[str, Any] = {"contact_model": contact_model, "grid": grid, "in_plane": in_plane}
    settings: dict[str, Any] = {"tolerance": tolerance, "check_dead_load": check_dead_load, "verbose": verbose}
    if flow_rule == "associative":
        settings |= {"torsion_limit": torsion_limit, "solver": solver}

    def solve(part: Assembly) -> Prediction:
        """Prediction of a part of the structure, or of all of it."""
        problem = make_problem(part, loads, **model)
        if flow_rule == "associative":
            return _associative(problem, model, settings)
        return _nonassociative(problem, model, settings, options)

    parts = independent_parts(assembly)
    # loads of another number of blocks are refused where the problem is made
    if len(parts) < 2 or len(loads.dead) != assembly.n_blocks:
        return solve(assembly)
    return governed(assembly, loads, parts, solve, model, check_dead_load=check_dead_load)


whole_limit_analysis = handed_on()(limit_analysis)
"""The same for callers that go on with the multiplier: a search that is interrupted is a KeyboardInterrupt."""


def _associative(problem: Problem, model: dict[str, Any], settings: dict[str, Any]) -> Prediction:
    """Prediction of a problem by the associative law.

    With crushing on a grid it says what half the points would have given.

    Parameters
    ----------
    model : options of :func:`make_problem`
    settings : options of :func:`limitmason.limit.associative.analyse`
    """
    prediction, _ = analyse(problem, **settings)
    return _with_grid_error(problem, prediction, model, settings)


def _nonassociative(
    problem: Problem, model: dict[str, Any], settings: dict[str, Any], options: dict[str, Any]
) -> Prediction:
    """Non-associative prediction, solved only when its certificate accepts it.

    Parameters
    ----------
    model : options of :func:`make_problem`
    settings : tolerance, check_dead_load and verbose, for :func:`analyse` and the search
    options : further ones of the search alone
    """
    from limitmason.limit.nonassociative.analysis import solve_nonassociative

    if problem.cells:
        _, problem = analyse(problem, **settings)  # cohesive faces need cells as fine as their torsion asks for
    prediction = solve_nonassociative(problem, **settings, **options)
    if prediction.flow_rule == FlowRule.ASSOCIATIVE:  # psi = phi: the two laws are one
        return _with_grid_error(problem, prediction, model, settings)
    c = prediction.certificate
    if prediction.status != Status.SOLVED or c is None or c.accepted:
        return prediction
    warnings = (*prediction.warnings, f"reduced accuracy: {c.refusal}")
    return replace(prediction, status=Status.ALMOST_SOLVED, warnings=warnings)


def _half_as_fine(
    assembly: Assembly, grid: Grid | float | Mapping[str, Grid]
) -> dict[str, Grid] | float:
    """Grid by kind of joint with half as many points either way, two at least; of a spacing [m] twice as much."""
    if isinstance(grid, int | float):
        longest = max(float(np.ptp(i.polygon, axis=0).max()) for i in assembly.interfaces)
        # beyond the longest joint it is two points on a side, whatever it is; so large a number looks like a count
        return 2.0 * grid if 2.0 * grid <= longest else min(2.0 * grid, max(grid, LARGE_SPACING))
    kinds = {i.kind for i in assembly.interfaces}
    table = grid if isinstance(grid, Mapping) else dict.fromkeys(kinds, grid)
    return {kind: (max(2, (n + 1) // 2), max(2, (m + 1) // 2)) for kind, (n, m) in table.items()}


def _with_grid_error(
    problem: Problem, prediction: Prediction, model: dict[str, Any], settings: dict[str, Any]
) -> Prediction:
    """Associative prediction with a warning of what half the points give, where joints crush at points.

    The error of crushing points falls faster than in proportion to their number: the change is more than what is left.

    Parameters
    ----------
    problem : that was solved
    prediction : its answer
    model : options of :func:`make_problem`
    settings : options of :func:`limitmason.limit.associative.analyse`
    """
    value = prediction.collapse_multiplier
    if not problem.crushing_points.any() or not np.isfinite(value):
        return prediction
    coarse = {**model, "grid": _half_as_fine(problem.assembly, model["grid"])}
    coarser, _ = analyse(
        make_problem(problem.assembly, problem.loads, **coarse), **{**settings, "check_dead_load": False}
    )
    other = coarser.collapse_multiplier
    change = (other - value) / abs(value) if value else np.nan
    where = "on a grid, which errs on the high side"
    if problem.contact_model == ContactModel.LOBATTO:
        where = "at Lobatto points, which err to either side"
    warning = (
        f"crushing is checked point by point {where}: half as many points give "
        f"{other:.6g} ({change:+.2%}), an indication of the error, not a bound; refine the grid until it stays"
    )
    return replace(
        prediction, warnings=(*prediction.warnings, warning),
        details={**prediction.details, "coarser_grid_multiplier": other, "grid_error_estimate": change},
    )
