"""All mechanisms that fit a structure and its load.

The smallest bound and the smallest estimate among them are given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

from limitmason.answers.results import Prediction, Range
from limitmason.checks import several
from limitmason.errors import InputError, NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from mechanisms.classical import overturning, sliding
from mechanisms.facade_rocking import compound_rocking, simple_rocking
from mechanisms.horizontal_flexure import horizontal_flexure
from mechanisms.in_plane import sloping_crack, stepped_crack
from mechanisms.parameters import load_direction
from mechanisms.velocity_field import ON_BLOCKS, UPPER

NAMES = (
    "simple rocking", "compound rocking", "compound rocking, whole courses", "horizontal flexure", "stepped crack",
    "sloping crack", "overturning", "sliding",
)


_EQUAL = 1e-9
"""Relative difference of two multipliers that are the same but for rounding."""

SPREAD_OF_ESTIMATES = "the smallest estimates lay 0.17 to 1.25 times the associative value on the walls tried"
"""Measured as the Notes of :func:`smallest` say."""


@of_model
def catalogue(
    assembly: Assembly,
    loads: Loads,
    *,
    include: Iterable[str] | None = None,
    contact_factor: float = 1.0,
) -> tuple[dict[str, Prediction], tuple[str, ...]]:
    """Return the prediction of every mechanism that fits, and why others are left out.

    Facades pushed away from their side walls, in L and U plans: A, simple rocking; B, compound rocking (straight crack
    and whole courses); D, horizontal flexure. Straight walls in plane: stepped and sloping crack. Everything with flat
    joints: overturning and sliding in one piece.

    Parameters
    ----------
    assembly, loads : the problem
    include : names out of ``mechanisms.NAMES``; all where omitted
    contact_factor : k of horizontal flexure (D) [-]

    Returns
    -------
    predictions by name of the mechanism, and sentences that say what was left out and why

    Raises
    ------
    InputError
        For an unknown name, numbers of the mechanisms that are wrong, and a structure of which every block is fixed.
    NotApplicable
        When no mechanism fits.
    """
    asked = NAMES if include is None else [include] if isinstance(include, str) else several("include", include, str)
    wanted = set(asked)
    if not wanted:
        raise InputError(f"include is empty: leave it out, or name some of {', '.join(NAMES)}")
    if unknown := wanted - set(NAMES):
        raise InputError(f"include: unknown mechanism {sorted(unknown)[0]!r}; known are {', '.join(NAMES)}")
    if assembly.fixed.all():
        raise InputError("every block is fixed: there is nothing to solve")
    if assembly.recipe.get("kind") == "arch":
        raise NotApplicable(
            "the catalogue has no mechanism of an arch under live load; lm.minimum_thickness says "
            "how thin it may be, limit analysis finds the hinges"
        )
    candidates, skipped = _fitting(assembly, loads, contact_factor)
    candidates["overturning"] = lambda: overturning(assembly, loads=loads)
    candidates["sliding"] = lambda: sliding(assembly, loads=loads)
    found: dict[str, Prediction] = {}
    reasons: dict[str, list[str]] = {}
    for name in NAMES:
        if name in wanted and name in candidates:
            try:
                found[name] = candidates[name]()
            except NotApplicable as error:
                reasons.setdefault(str(error), []).append(name)
    if include is not None and (unfit := [name for name in NAMES if name in wanted - candidates.keys()]):
        reasons["not a mechanism of this plan under this load"] = unfit
    skipped += [f"{', '.join(names)} left out: {reason}" for reason, names in reasons.items()]
    if not found:
        raise NotApplicable("no mechanism of the catalogue fits: " + "; ".join(skipped))
    return found, tuple(skipped)


@of_model
def smallest(
    assembly: Assembly,
    loads: Loads,
    *,
    include: Iterable[str] | None = None,
    contact_factor: float = 1.0,
) -> Prediction:
    """Return the smallest bound of the catalogue.

    This is what ``limitmason.predict(..., method="mechanisms")`` gives.

    Where no mechanism is admissible on the blocks, the smallest estimate stands in its place and says so.

    Parameters
    ----------
    assembly, loads, include, contact_factor : as in :func:`catalogue`

    Returns
    -------
    Prediction
        ``collapse_multiplier`` is the smallest upper bound of associative limit analysis, ``bound`` says so;
        ``details`` hold governing (the mechanism it belongs to), catalogue (multiplier of every mechanism by name),
        bounds (what each is), smallest_upper_bound and smallest_upper_bound_of, smallest_estimate and
        smallest_estimate_of (NaN and None where there is none). The smallest estimate is printed below the bound.

    Raises
    ------
    InputError, NotApplicable
        As :func:`catalogue`.

    Notes
    -----
    A bound cannot lie below associative limit analysis on the same blocks; an estimate may lie on either side. How far,
    over the associative value, on 600 random walls of the builder (straight, L, T and U plans, 3 to 9 courses, friction
    0.3 to 1.1, a quarter with cohesion, all directions) and 20 packaged models: the smallest bound 1.00 to 2.98, median
    1.15, nine in ten below 1.7; single estimates 0.17 to 4.5 (A, simple rocking, 0.17 to 1.7; B, compound rocking, 0.36
    to 1.2; D, horizontal flexure, 0.41 to 2.0; stepped crack 0.6 to 4.5, sloping crack 0.24 to 1.3); the smallest
    estimate of a wall 0.17 to 1.25.
    """
    found, skipped = catalogue(assembly, loads, include=include, contact_factor=contact_factor)
    # one mechanism may be both: a bound by the power balance on the blocks, and an estimate by its closed form
    upper = {k: float(p.details["kinematic_multiplier"]) for k, p in found.items() if p.details.get("admissible")}
    estimates = {k: p.collapse_multiplier for k, p in found.items() if p.bound != UPPER}
    bound_of, estimate_of = _least(upper), _least(estimates)
    name = bound_of or estimate_of
    assert name is not None  # catalogue refuses to come back empty
    lead, notes = found[name], list(found[name].warnings)
    if bound_of is not None:
        # the power balance on the blocks: where a closed form lies above or below it, this is what is proven
        lead = replace(lead, collapse_multiplier=upper[name], bound=UPPER)
        notes = [n for n in notes if ON_BLOCKS not in n]
        if estimate_of is not None:
            said = f"{estimates[estimate_of]:.6g} ({estimate_of})"
            notes.append(f"smallest estimate {said}: no bound; {SPREAD_OF_ESTIMATES}")
    else:
        notes.append("no mechanism of the catalogue is admissible on these blocks: this is an estimate, not a bound")
    details = {
        **lead.details,
        "governing": name,
        "catalogue": {k: p.collapse_multiplier for k, p in found.items()},
        "bounds": {k: p.bound for k, p in found.items()},
        "smallest_upper_bound": upper[bound_of] if bound_of else math.nan,
        "smallest_upper_bound_of": bound_of,
        "smallest_estimate": estimates[estimate_of] if estimate_of else math.nan,
        "smallest_estimate_of": estimate_of,
    }
    between = Range() if bound_of else _friction_factor(lead)  # a bound stands alone, friction was not prescribed
    return replace(lead, details=details, governing=name, range=between, warnings=(*notes, *skipped))


def _friction_factor(estimate: Prediction) -> Range:
    """Range of an estimate from a friction factor omega = 0 to 1; none where the mechanism knows no such factor.

    ``estimate`` is the prediction, whose details may hold both multipliers as "omega_bracket".
    """
    ends = [*estimate.details.get("omega_bracket", ()), estimate.collapse_multiplier]
    if max(ends) - min(ends) <= _EQUAL * max(map(abs, ends)):  # without a bracket, or without friction
        return Range()
    return Range(min(ends), max(ends), "friction factor omega 0 to 1")


def _least(values: dict[str, float]) -> str | None:
    """Name of the smallest value.

    Equal ones go to the first in the list, so that rounding does not choose.

    Parameters
    ----------
    values : multiplier by name [-]
    """
    if not values:
        return None
    least = min(values.values())
    return next(name for name, value in values.items() if value <= least + _EQUAL * abs(least))


def _fitting(
    assembly: Assembly, loads: Loads, contact_factor: float
) -> tuple[dict[str, Callable[[], Prediction]], list[str]]:
    """Mechanisms that fit a wall and its loads, by name, and why others are left out.

    Each is a function without arguments that makes its prediction when it is called.

    Parameters
    ----------
    assembly, loads : the problem
    contact_factor : k of mechanism D [-]
    """
    recipe = assembly.recipe
    if recipe.get("kind") != "wall":
        return {}, []
    if recipe["openings"]:
        return {}, ["A, B, D and the in-plane cracks are left out: they are for walls without openings"]
    try:
        axis, sense = load_direction(assembly, loads)
    except NotApplicable as error:
        return {}, [f"A, B, D and the in-plane cracks are left out: {error}"]
    sides = len(recipe["returns"])
    if axis == "x":  # along the facade
        if sides:
            return {}, ["in-plane cracks are left out: they are for straight walls"]
        return {
            "stepped crack": lambda: stepped_crack(assembly, loads=loads),
            "sloping crack": lambda: sloping_crack(assembly, loads=loads),
        }, []
    if sides and sense > 0:
        return {}, ["A, B and D are left out: the load pushes the facade towards its side walls"]
    out = {"simple rocking": lambda: simple_rocking(assembly, loads=loads)}
    if sides:
        out["compound rocking"] = lambda: compound_rocking(assembly, loads=loads)
        out["compound rocking, whole courses"] = lambda: compound_rocking(assembly, loads=loads, crack="stepped")
    if recipe["plan"] in ("L", "U"):  # whose facade is held at its ends; that of a T is held in the middle
        out["horizontal flexure"] = lambda: horizontal_flexure(assembly, loads=loads, contact_factor=contact_factor)
    return out, []
