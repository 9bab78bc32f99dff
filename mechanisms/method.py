"""Analytical mechanisms as a method: ``limitmason.predict(..., "mechanisms")``."""

from collections.abc import Mapping
from typing import Any

from limitmason.answers.method import Look, Method, settings_of
from mechanisms.catalogue import smallest
from mechanisms.papers import PAPERS


def _smallest_estimate(details: Mapping[str, Any]) -> str:
    """The smallest estimate in words, to stand beside the bound that leads; "" where an estimate leads itself.

    Parameters
    ----------
    details : of the prediction by :func:`mechanisms.smallest`, by name
    """
    # "smallest_estimate_of" and "smallest_upper_bound_of" name mechanisms, None where none is of that kind
    name = details.get("smallest_estimate_of")
    if not name or not details.get("smallest_upper_bound_of"):
        return ""
    return f"smallest estimate {details['smallest_estimate']:.5f} ({name})"


MECHANISMS = Method(
    "mechanisms",
    smallest,
    settings_of("MechanismSettings", smallest),
    look=Look("mechanism", "GREEN", "D"),
    beside=_smallest_estimate,
    kept=(
        "governing", "catalogue", "smallest_upper_bound", "smallest_upper_bound_of", "smallest_estimate",
        "smallest_estimate_of",
    ),
    theorem="mechanism",
    references=PAPERS,
    levers=("friction", "weights", "overload", "reading"),
)
