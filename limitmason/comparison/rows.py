"""One row of "predicted beside measured": what a method says about a structure, and the value it is held against."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from limitmason.answers.references import Cited
from limitmason.answers.results import Bound, BoundKind, Prediction, Status
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.experiments.experiment import Quantity
from limitmason.methods import get_method
from limitmason.storage.interrupts import handed_on

NAN = float("nan")
REFUSED = "does not apply"
"""Status of a method that refuses the structure, followed by the reason."""

NO_ANSWER = "no answer"
"""Status of a method whose run ended without one, followed by the reason."""

STORED = ("method", "multiplier", "low", "high", "range_is", "bound", "status", "seconds", "details", "warnings")
"""Fields that a store keeps: what the method says, without what it is held against."""


@dataclass(frozen=True, eq=False)
class Row:
    """What one method says about one structure, and the value beside it.

    Parameters
    ----------
    method : its name
    multiplier : lambda [-]; NaN without an answer
    low, high : range about the predicted value, in ``unit``; NaN where the method has none
    range_is : what the range is
    bound : as in ``Prediction``
    status : as in ``Prediction``; "does not apply: ..." where the method refuses the structure, "no answer: ..." where
        its run ended without one, "no assembly" where there is nothing to predict
    seconds : time it took; a prediction shared by several rows has the same time
    details : plain further values
    warnings : what a user should know before trusting the number
    prediction : the whole answer; None where it was taken from a store
    reference : measured or published value beside it, with its unit; None without one
    factor : what a multiplier of 1 means, in ``unit``
    source, specimen, quantity : where the reference comes from
    kind : "measured", "published", "recomputed", or "derived" where the source states something that it follows from
    flow_rule : of limit analysis where that was an option of the method
    options : options of the assembly that differ from the experiment's own
    """

    method: str
    multiplier: float = NAN
    low: float = NAN
    high: float = NAN
    range_is: str = ""
    bound: Bound = field(default_factory=lambda: Bound(BoundKind.NONE, ""))
    status: str = ""
    seconds: float = 0.0
    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    prediction: Prediction | None = None
    reference: Quantity | None = None
    factor: float = 1.0
    source: str = ""
    specimen: str = ""
    quantity: str = ""
    kind: str = ""
    flow_rule: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def refused(cls, method: str, reason: object, seconds: float = 0.0) -> Row:
        """The row of a method that does not take the structure."""
        return cls(method, status=f"{REFUSED}: {reason}", seconds=seconds)

    @classmethod
    def unanswered(cls, method: str, reason: object, seconds: float = 0.0) -> Row:
        """The row of a method that takes the structure and found no certified answer."""
        return cls(method, status=f"{NO_ANSWER}: {reason}", seconds=seconds)

    @classmethod
    def attempted(cls, method: str, predict: Callable[[], Prediction]) -> Row:
        """The row of a method that is asked now: its answer, or why there is none, and the time it took.

        Parameters
        ----------
        method : its name
        predict : called without arguments, gives the answer or raises ``NotApplicable`` or ``NotConverged``
        """
        begun = time.perf_counter()
        try:
            with handed_on():
                found = predict()
        except NotApplicable as refusal:
            return cls.refused(method, refusal, time.perf_counter() - begun)
        except NotConverged as failure:
            return cls.unanswered(method, failure, time.perf_counter() - begun)
        return cls(
            method, float(found.collapse_multiplier), bound=found.bound, status=found.status,
            seconds=time.perf_counter() - begun, warnings=found.warnings, prediction=found,
        )

    @property
    def predicted(self) -> float:
        """Predicted value in ``unit``."""
        return self.multiplier * self.factor

    @property
    def unit(self) -> str:
        """Unit of the predicted value and of the reference.

        It is "-" for a multiplier.
        """
        return "-" if self.reference is None else self.reference.unit

    @property
    def measured(self) -> float:
        """The measured value in ``unit``, or NaN without one."""
        return float(self.reference) if self.reference is not None and self.kind == "measured" else NAN

    @property
    def ratio(self) -> float:
        """Predicted over reference [-]."""
        return self.predicted / float(self.reference) if self.reference else NAN

    @property
    def beside(self) -> str:
        """What stands beside the multiplier and must not be taken for it.

        The smallest estimate below a bound.
        """
        return get_method(self.method).beside(self.details)

    @property
    def references(self) -> tuple[Cited, ...]:
        """Papers behind the answer.

        Those of its method where it was taken from a store. None where it has none.
        """
        if self.prediction is not None:
            return self.prediction.references
        return () if math.isnan(self.multiplier) else get_method(self.method).references

    @property
    def solved(self) -> bool:
        """Whether there is a finite multiplier to compare."""
        return self.status in (Status.SOLVED, Status.ALMOST_SOLVED) and math.isfinite(self.multiplier)

    @property
    def refusal(self) -> str | None:
        """Why the method does not take the structure, or None where it does."""
        return self.status.removeprefix(f"{REFUSED}: ") if self.status.startswith(REFUSED) else None

    @property
    def has_range(self) -> bool:
        """Whether both ends of the range are known."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    def in_unit(self, factor: float) -> Row:
        """This row with its range and predicted value in another unit.

        Parameters
        ----------
        factor : what a multiplier of 1 means in that unit
        """
        change = factor / self.factor
        return replace(self, factor=factor, low=self.low * change, high=self.high * change)

    def stored(self) -> dict[str, Any]:
        """What a store keeps of it.

        :meth:`restored` reads it.
        """
        out = {name: getattr(self, name) for name in STORED}
        return {**out, "bound": str(self.bound), "status": str(self.status)}

    @classmethod
    def restored(cls, document: Mapping[str, Any], path: object) -> Row:
        """A row from what a store kept.

        Parameters
        ----------
        document : fields by name, as :meth:`stored` gave them
        path : file of the store, for the message

        Raises
        ------
        InputError
            Naming the file, for a document that lacks a field.
        """
        if missing := [name for name in STORED if name not in document]:
            raise InputError(f"{path} holds an answer without {missing[0]!r}: remove its line to compute it again")
        values = {name: document[name] for name in STORED}
        # the governing mechanism is a detail of methods that try several; others have none
        words, governing = values["bound"], values["details"].get("governing")
        # the words begin with the kind, behind the name of the mechanism that governs
        bound = Bound(Bound.from_text(words.removeprefix(f"{governing}: ")).kind, words)
        return cls(**{**values, "bound": bound, "warnings": tuple(values["warnings"])})
