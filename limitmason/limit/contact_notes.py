"""What is known about the contacts of an assembly goes with every multiplier computed from them."""

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any, TypeVar, cast

from limitmason.answers.results import Prediction
from limitmason.model.assembly import Assembly

Analysis = TypeVar("Analysis", bound=Callable[..., Prediction])


def with_contact_warnings(analysis: Analysis) -> Analysis:
    """An analysis whose prediction says how many faces nearly touch: found with the contacts, it costs nothing."""

    @wraps(analysis)
    def wrapped(assembly: Assembly, *args: Any, **options: Any) -> Prediction:
        prediction = analysis(assembly, *args, **options)
        said = assembly.contact_warnings
        return replace(prediction, warnings=(*prediction.warnings, *said)) if said else prediction

    return cast(Analysis, wrapped)
