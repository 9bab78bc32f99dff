"""The capacity curve as a method: its first limit point, for ``limitmason.predict(..., "pushover")``."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from limitmason.answers.method import DISPLACED, Look, Method, settings_of
from limitmason.answers.results import Bound, BoundKind, Prediction, Range, Status
from limitmason.capacity.analysis import pushover
from limitmason.capacity.papers import PAPERS
from limitmason.capacity.sensitivity import governing_point
from limitmason.capacity.sensitivity import spread as variants
from limitmason.capacity.steps import Steps
from limitmason.errors import NotApplicable
from limitmason.mechanics.model_notes import lost_in_failure
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

MEANING = "estimate: first limit point of the path from the unstressed wall"
MEANING_SOFTENING = "estimate: largest load of the path from the unstressed wall, whose joints lose strength on the way"


def first_limit_point(assembly: Assembly, loads: Loads, *, spread: tuple[str, ...] = (), **settings: Any) -> Prediction:
    """The first limit point of the path from the unstressed structure, or its largest load where joints soften.

    Parameters
    ----------
    spread : what it is tried for, out of "ks/kn" (0.4 and 2.5 times ks), "grid" (2 x 4, 2 x 8 and 4 x 8 points) and
        "preload" (half as far the other way first); the range is then that of all of them
    settings : of :func:`pushover`, without ``start`` and ``to``
    """
    curve = pushover(assembly, loads, **settings)
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
        tried = variants(assembly, loads, tuple(spread), point.displacement, **settings)
    budget = {
        name: {"change": _largest([v / value - 1.0 for v in found.values()]), "resolution": steps.peak, **found}
        for name, found in tried.items()
    }
    # the spread that was asked for, else the sampled limit point and what its sampling may hide above it
    around, ends = Range(), _ends(value, tried) if tried else None
    if math.isfinite(value):
        around = Range(value, value + steps.peak * abs(value), "sampling of the limit point")
        around = Range(*ends, f"spread over {', '.join(budget)}") if ends else around
    return Prediction(
        "pushover", value, Bound(BoundKind.ESTIMATE, meaning), status, mechanism, resultants, None, warnings,
        {"steps": curve.cost.steps, "programs": curve.cost.programs, "Newton iterations": curve.cost.iterations},
        {
            "curve": curve, "limit point displacement": math.nan if point is None else point.displacement,
            **({"interval": ends} if ends else {}),
        },
        error_budget=budget,
        range=around,
        lost_in_failure=lost_in_failure(assembly, np.zeros(len(assembly.interfaces))),
    )


def _largest(changes: list[float]) -> float:
    """The largest change by size, or NaN where a variant has no limit point."""
    return math.nan if any(map(math.isnan, changes)) else max(changes, key=abs)


def _ends(value: float, tried: Mapping[str, Mapping[str, float]]) -> tuple[float, float]:
    known = [v for found in tried.values() for v in found.values() if math.isfinite(v)]
    return min(value, *known), max(value, *known)


PUSHOVER = Method(
    "pushover",
    first_limit_point,
    settings_of("PushoverSettings", first_limit_point, pushover, without=("start", "to", "initial")),
    look=Look("capacity curve", "ORANGE", "s"),
    theorem="simulation",
    references=PAPERS,
    levers=DISPLACED,
)
