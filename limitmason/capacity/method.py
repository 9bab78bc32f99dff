"""The capacity curve as a method: its first limit point, for ``limitmason.predict(..., "pushover")``."""

import math
from typing import Any

import numpy as np

from limitmason.capacity.analysis import pushover
from limitmason.capacity.papers import PAPERS
from limitmason.capacity.path import Steps
from limitmason.errors import NotApplicable
from limitmason.method import Look, Method, settings_of
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import CANNOT_STAND, NOT_CONVERGED, SOLVED, Bound, BoundKind, Prediction, Range
from limitmason.stated import lost_in_failure

MEANING = "estimate: first limit point of the path from the unstressed wall"
MEANING_SOFTENING = "estimate: largest load of the path from the unstressed wall, whose joints lose strength on the way"


def _first_limit_point(assembly: Assembly, loads: Loads, **settings: Any) -> Prediction:
    curve = pushover(assembly, loads, **settings)
    softens = any(i.joint.softens for i in assembly.interfaces)
    point, warnings, status = curve.first_limit_point, curve.warnings, SOLVED
    if softens and point is not None:
        # where joints break the load falls again and again, and recovers
        point = curve.peak if curve.peak.index + 1 < len(curve) else None
    meaning = MEANING_SOFTENING if softens else MEANING
    value, mechanism, resultants = math.nan, None, None
    if curve.status == CANNOT_STAND:
        status = CANNOT_STAND
    elif point is None or not all(c.accepted for c in curve.certificates[: point.index + 1]):
        status = NOT_CONVERGED
        end = curve.point(-1)
        warnings = (
            *warnings,
            f"the load still rises at {end.displacement:.3g} m, lambda {end.load:.5g}, where the path ends: "
            "no limit point" if point is None else "a sample up to the limit point has no certificate",
        )  # fmt: skip
    else:
        value, mechanism = point.load, curve.mechanism(point.index)
        try:
            resultants = curve.resultants(point.index)
        except NotApplicable as reason:
            warnings = (*warnings, str(reason))
    steps = settings.get("steps") or Steps()
    return Prediction(
        "pushover", value, Bound(BoundKind.ESTIMATE, meaning), status, mechanism, resultants, None, warnings,
        {"steps": curve.cost.steps, "programs": curve.cost.programs, "Newton iterations": curve.cost.iterations},
        {
            "curve": curve, "limit point displacement": math.nan if point is None else point.displacement,
            "resolution": steps.peak * abs(value),
        },
        lost_in_failure=lost_in_failure(assembly, np.zeros(len(assembly.interfaces))),
    )  # fmt: skip


def _sampled(found: Prediction) -> Range:
    """The sampled limit point and what its sampling may hide above it."""
    value = found.collapse_multiplier
    if not math.isfinite(value):
        return Range()
    return Range(value, value + found.details["resolution"], "sampling of the limit point")


PUSHOVER = Method(
    "pushover",
    _first_limit_point,
    settings_of("PushoverSettings", pushover, without=("start", "to")),
    range_of=_sampled,
    look=Look("capacity curve", "GREEN", "D"),
    theorem="simulation",
    references=PAPERS,
)
