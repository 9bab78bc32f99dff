"""The capacity curve as a method: its first limit point, for ``limitmason.predict(..., "pushover")``.

With it how far that point depends on what nobody measures: ks / kn, the grid of points, a preload.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.curve import CurvePoint
from limitmason.answers.method import DISPLACED, Look, Method, settings_of
from limitmason.answers.results import Bound, BoundKind, Prediction, Range, Status
from limitmason.capacity.analysis import pushover, whole_pushover
from limitmason.capacity.papers import PAPERS
from limitmason.capacity.result import PushoverCurve
from limitmason.capacity.step_length import Steps
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.default_stiffness import default_stiffness
from limitmason.mechanics.model_notes import lost_in_failure
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

MEANING = "estimate: first limit point of the path from the unstressed wall"
MEANING_SOFTENING = "estimate: largest load of the path from the unstressed wall, whose joints lose strength on the way"

STIFFNESS_RATIO, GRID, PRELOAD = "ks/kn", "grid", "preload"

SPREADS = (STIFFNESS_RATIO, GRID, PRELOAD)
"""What can be varied to see how far the first limit point depends on it."""

RATIOS = (0.4, 2.5)
"""Factors of ks at the same kn [-]: chosen, as far down as up."""

GRIDS = ((2, 4), (2, 8), (4, 8))
"""Points along and across a joint, beside those of the path itself."""

PRELOADED = 0.5
"""Push the other way first, over the displacement of the first limit point."""


def first_limit_point(assembly: Assembly, loads: Loads, *, spread: tuple[str, ...] = (), **settings: Any) -> Prediction:
    """The first limit point of the path from the unstressed structure, or its largest load where joints soften.

    Parameters
    ----------
    spread : what is varied to see how far the answer depends on it, out of "ks/kn" (0.4 and 2.5 times ks), "grid"
        (2 x 4, 2 x 8 and 4 x 8 points) and "preload" (half as far the other way first); the range is then that of all
    settings : of :func:`pushover`, without ``start`` and ``to``

    Returns
    -------
    Prediction
        The multiplier is NaN where the status is not "solved". ``details``: "curve"; "limit point displacement" [m],
        NaN where the path has none; with a spread "interval", its least and largest multiplier. ``error_budget``: for
        every name in ``spread`` "change", "resolution" and the multiplier of every variant, NaN of one without answer.

    Raises
    ------
    InputError
        For a name in ``spread`` that is not known.
    """
    unknown = [n for n in spread if n not in SPREADS]
    if unknown:
        raise InputError(f"spread must be out of {', '.join(map(repr, SPREADS))}, got {unknown[0]!r}")
    curve = whole_pushover(assembly, loads, **settings)
    softens = any(i.joint.softens for i in assembly.interfaces)
    point, warnings, status = governing_point(curve, assembly), curve.warnings, Status.SOLVED
    meaning = MEANING_SOFTENING if softens else MEANING
    value, mechanism, resultants = math.nan, None, None
    if curve.status == Status.CANNOT_STAND:
        status = Status.CANNOT_STAND
    elif point is None or not all(c.accepted for c in curve.certificates[: point.index + 1]):
        status = Status.NOT_CONVERGED
        end = curve.point(-1)
        warnings = (
            *warnings,
            f"the load still rises at {end.displacement:.3g} m, lambda {end.load:.5g}, where the path ends: "
            "no limit point" if point is None else "a sample up to the limit point has no certificate",
        )
    else:
        value, mechanism = point.load, curve.mechanism(point.index)
        try:
            resultants = curve.resultants(point.index)
        except NotApplicable as reason:
            warnings = (*warnings, str(reason))
    steps = settings.get("steps") or Steps()
    tried: Mapping[str, Mapping[str, float]] = {}
    if spread and point is not None and math.isfinite(value):
        tried = _variants(assembly, loads, tuple(spread), point.displacement, **settings)
    budget = {
        # by name: largest change of the answer and how finely it is known [-], then every variant's multiplier
        name: {"change": _largest([_change(v, value) for v in found.values()]), "resolution": steps.peak, **found}
        for name, found in tried.items()
    }
    # the spread that was asked for, else the sampled limit point and what its sampling may hide above it
    around, ends = Range(), _ends(value, tried) if tried else None
    if math.isfinite(value):
        around = Range(value, value + steps.peak * abs(value), "sampling of the limit point")
        around = Range(*ends, f"spread over {', '.join(budget)}") if ends else around
    return Prediction(
        "pushover", value, Bound(BoundKind.ESTIMATE, meaning), status, mechanism, resultants,
        warnings=warnings,
        provenance=curve.cost.provenance,
        details={
            "curve": curve, "limit point displacement": math.nan if point is None else point.displacement,
            **({"interval": ends} if ends else {}),
        },
        error_budget=budget,
        range=around,
        # joints without a fracture energy lose their strength at once: over an opening or slip of 0 m
        lost_in_failure=lost_in_failure(assembly, np.zeros(len(assembly.interfaces))),
    )


def _change(other: float, value: float) -> float:
    """Change from a multiplier to another over its size [-], infinite from zero; NaN where there is no other."""
    if value == 0.0:
        return other * math.inf if other else 0.0
    return other / value - 1.0


def _largest(changes: list[float]) -> float:
    """The change of the largest size, with its sign [-], or NaN where a variant has no limit point."""
    return math.nan if any(map(math.isnan, changes)) else max(changes, key=abs)


def _ends(value: float, tried: Mapping[str, Mapping[str, float]]) -> tuple[float, float]:
    """Least and largest of a load and those of its variants, multipliers by kind and name, NaN left out [-]."""
    known = [v for found in tried.values() for v in found.values() if math.isfinite(v)]
    return min(value, *known), max(value, *known)


def _variants(
    assembly: Assembly, loads: Loads, names: tuple[str, ...], reach: float, **settings: Any
) -> Mapping[str, Mapping[str, float]]:
    """Multipliers of the first limit points of variants [-], NaN where there is none.

    They are by what is varied and then by the name of the variant.

    Parameters
    ----------
    names : what is varied, of ``SPREADS``
    reach : displacement of the first limit point itself [m]
    settings : of :func:`pushover`, without ``to`` and ``start``
    """
    out: dict[str, dict[str, float]] = {}
    for name in names:
        found = out.setdefault(name, {})
        if name == STIFFNESS_RATIO:
            for factor in RATIOS:
                wall, chosen = _with_ks_times(assembly, loads, settings, factor)
                found[f"{factor:g} ks"] = _limit(wall, loads, **chosen)
        elif name == GRID:
            for grid in GRIDS:
                chosen = {**settings, "contact_model": "grid", "grid": grid}
                found[f"{grid[0]} x {grid[1]}"] = _limit(assembly, loads, **chosen)
        else:  # PRELOAD
            before = whole_pushover(assembly, loads, to=-PRELOADED * reach, **settings)
            found["the other way first"] = _limit(assembly, loads, start=before, **settings)
    return out


def _with_ks_times(
    assembly: Assembly, loads: Loads, settings: Mapping[str, Any], factor: float
) -> tuple[Assembly, dict[str, Any]]:
    """The model and settings with the shear stiffness ks of all joints times a factor.

    Parameters
    ----------
    settings : options of :func:`limitmason.pushover`, of which "stiffness" goes before the joints' own
    factor : of every ks [-]
    """
    given = settings.get("stiffness")
    if given is not None:
        pair = np.broadcast_to(np.asarray(given, dtype=float), (2,))
        return assembly, {**settings, "stiffness": (float(pair[0]), factor * float(pair[1]))}
    standard = default_stiffness(assembly, loads.dead)

    def other(joint: Joint) -> Joint:
        """A joint with the stiffnesses that a path takes for it, the shear stiffness times the factor."""
        kn = joint.normal_stiffness or standard
        ks = kn if joint.shear_stiffness is None else joint.shear_stiffness
        return replace(joint, normal_stiffness=kn, shear_stiffness=factor * ks)

    return assembly.with_joints(other), dict(settings)


def governing_point(curve: PushoverCurve, assembly: Assembly) -> CurvePoint | None:
    """The first limit point, or the largest load where joints soften.

    It is None where the path still rises at its end.
    """
    point = curve.first_limit_point
    if point is not None and any(i.joint.softens for i in assembly.interfaces):
        # where joints break the load falls again and again, and recovers
        return curve.peak if curve.peak.index + 1 < len(curve) else None
    return point


def _limit(assembly: Assembly, loads: Loads, **settings: Any) -> float:
    """Multiplier of the governing point of a path [-], NaN where it has none, with settings of :func:`pushover`."""
    point = governing_point(whole_pushover(assembly, loads, **settings), assembly)
    return float("nan") if point is None else point.load


PUSHOVER = Method(
    "pushover",
    first_limit_point,
    settings_of("PushoverSettings", first_limit_point, pushover, without=("start", "to", "initial")),
    look=Look("capacity curve", "ORANGE", "s"),
    theorem="simulation",
    references=PAPERS,
    levers=DISPLACED,
)
