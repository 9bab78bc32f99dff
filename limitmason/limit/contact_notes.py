"""What is known about the contacts of an assembly goes with every multiplier computed from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Concatenate, ParamSpec

from limitmason.model.assembly import Assembly
from limitmason.results import Prediction

P = ParamSpec("P")


def with_contact_warnings(
    analysis: Callable[Concatenate[Assembly, P], Prediction],
) -> Callable[Concatenate[Assembly, P], Prediction]:
    """An analysis whose prediction says how many faces nearly touch: found with the contacts, it costs nothing."""

    @wraps(analysis)
    def wrapped(assembly: Assembly, *args: P.args, **options: P.kwargs) -> Prediction:
        prediction = analysis(assembly, *args, **options)
        said = assembly.contact_warnings
        return replace(prediction, warnings=(*prediction.warnings, *said)) if said else prediction

    return wrapped
