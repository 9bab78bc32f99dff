"""All mechanisms that fit a structure and its load, and the smallest of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import Prediction
from mechanisms.classical import overturning, sliding
from mechanisms.flexure import horizontal_flexure
from mechanisms.in_plane import sloping_crack, stepped_crack
from mechanisms.motion import UPPER
from mechanisms.out_of_plane import compound_rocking, simple_rocking
from mechanisms.parameters import load_direction

NAMES = (
    "simple rocking", "compound rocking", "compound rocking, whole courses", "horizontal flexure", "stepped crack",
    "sloping crack", "overturning", "sliding",
)  # fmt: skip


def catalogue(
    assembly: Assembly,
    loads: Loads,
    *,
    include: Iterable[str] | None = None,
    contact_factor: float = 1.0,
) -> tuple[dict[str, Prediction], tuple[str, ...]]:
    """Return the prediction of every mechanism that fits, by name, and what was left out and why.

    Facades pushed away from their side walls: A, B (straight crack and whole courses), D for L and U plans. Straight
    walls in plane: stepped and sloping crack. Everything with flat joints: overturning and sliding in one piece.

    Parameters
    ----------
    assembly, loads : the problem
    include : names out of ``mechanisms.NAMES``; all where omitted
    contact_factor : k of mechanism D [-]

    Raises
    ------
    ValueError
        For an unknown name, and when no mechanism fits.
    """
    wanted = set(NAMES if include is None else [include] if isinstance(include, str) else include)
    unknown = wanted - set(NAMES)
    if unknown:
        raise ValueError(f"include: unknown mechanism {sorted(unknown)[0]!r}; known are {', '.join(NAMES)}")
    if assembly.recipe.get("kind") == "arch":
        raise ValueError(
            "the catalogue has no mechanism of an arch under live load; mechanisms.arch_limit and geometric_safety "
            "compare thicknesses, limit analysis finds the hinges"
        )
    candidates, skipped = _fitting(assembly, loads, contact_factor)
    candidates["overturning"] = lambda: overturning(assembly, loads=loads)
    candidates["sliding"] = lambda: sliding(assembly, loads=loads)
    found: dict[str, Prediction] = {}
    for name in NAMES:
        if name in wanted and name in candidates:
            try:
                found[name] = candidates[name]()
            except ValueError as error:
                skipped.append(f"{name} left out: {error}")
    if not found:
        raise ValueError("no mechanism of the catalogue fits: " + "; ".join(skipped))
    return found, tuple(skipped)


def smallest(
    assembly: Assembly,
    loads: Loads,
    *,
    include: Iterable[str] | None = None,
    contact_factor: float = 1.0,
) -> Prediction:
    """Return the mechanism with the smallest multiplier: ``limitmason.predict(..., method="mechanisms")``.

    Parameters
    ----------
    assembly, loads, include, contact_factor : as in :func:`catalogue`

    Returns
    -------
    Prediction
        Of the governing mechanism; ``details`` also hold governing (its name), catalogue (multiplier by name), bounds
        (what each is), smallest_upper_bound and its name (over the mechanisms that are admissible on these blocks).

    Raises
    ------
    ValueError
        As :func:`catalogue`.

    Notes
    -----
    Estimates and bounds stand side by side: the smallest may be an estimate, with associative limit analysis above it.
    Only smallest_upper_bound bounds that from above.
    """
    found, skipped = catalogue(assembly, loads, include=include, contact_factor=contact_factor)
    least = min(p.collapse_multiplier for p in found.values())
    # equal values go to the first in the list, so that rounding does not choose the name
    name = next(k for k, p in found.items() if p.collapse_multiplier <= least * (1.0 + 1e-9))
    kinematic = {
        k: p.details["kinematic_multiplier"]
        for k, p in found.items()
        if p.details.get("admissible") or p.bound == UPPER
    }
    best = min(kinematic, key=lambda k: kinematic[k]) if kinematic else None
    details = {
        **found[name].details,
        "governing": name,
        "catalogue": {k: p.collapse_multiplier for k, p in found.items()},
        "bounds": {k: p.bound for k, p in found.items()},
        "smallest_upper_bound": float("nan") if best is None else kinematic[best],
        "smallest_upper_bound_of": best,
    }
    return replace(found[name], details=details, warnings=(*found[name].warnings, *skipped))


def _fitting(
    assembly: Assembly, loads: Loads, contact_factor: float
) -> tuple[dict[str, Callable[[], Prediction]], list[str]]:
    recipe = assembly.recipe
    if recipe.get("kind") != "wall":
        return {}, []
    if recipe["openings"]:
        return {}, ["A, B, D and the in-plane cracks are left out: they are for walls without openings"]
    try:
        axis, sense = load_direction(assembly, loads)
    except ValueError as error:
        return {}, [f"A, B, D and the in-plane cracks are left out: {error}"]
    sides = len(recipe["returns"])
    if axis == "x":
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
    if recipe["plan"] in ("L", "U"):
        out["horizontal flexure"] = lambda: horizontal_flexure(assembly, loads=loads, contact_factor=contact_factor)
    return out, []
