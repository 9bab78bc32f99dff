"""Closed sets that answers are written in: how an analysis ended, what a multiplier is, flow rule, contact model."""

import math
from enum import StrEnum
from typing import Any, NamedTuple

from limitmason.errors import InputError


class Status(StrEnum):
    """How an analysis ended; decided by what can be certified, not by what a solver says of itself."""

    SOLVED = "solved"
    ALMOST_SOLVED = "almost solved"
    CANNOT_STAND = "cannot stand under dead load"
    UNBOUNDED = "unbounded"
    NOT_CONVERGED = "not converged"
    TIME_ENDED = "time limit ended it"


SOLVED, ALMOST_SOLVED, CANNOT_STAND, UNBOUNDED, NOT_CONVERGED, TIME_ENDED = Status
STATUSES = tuple(Status)


class BoundKind(StrEnum):
    """What a multiplier is with respect to the law that its bound names."""

    EXACT = "exact"
    LOWER = "lower"
    UPPER = "upper"
    ESTIMATE = "estimate"
    NONE = "none"


class FlowRule(StrEnum):
    """Normality (psi = phi), or sliding that dilates by psi < phi."""

    ASSOCIATIVE = "associative"
    NON_ASSOCIATIVE = "non-associative"


class ContactModel(StrEnum):
    """Where an interface transmits forces: the corners of its polygon, or a lattice, even or dense at the edges."""

    VERTICES = "vertices"
    GRID = "grid"
    LOBATTO = "lobatto"


class Bound(str):
    """What a multiplier is, in words for a reader, with its ``kind`` for a program.

    >>> bound = Bound(BoundKind.UPPER, "upper bound for every flow rule")
    >>> bound.kind is BoundKind.UPPER, str(bound)
    (True, 'upper bound for every flow rule')
    """

    __slots__ = ("kind",)
    kind: BoundKind

    def __new__(cls, kind: BoundKind, text: str | None = None) -> "Bound":
        """Take the kind and the words, which are the kind alone where none are given."""
        self = super().__new__(cls, str(kind) if text is None else text)
        self.kind = BoundKind(kind)
        return self

    def __getnewargs__(self) -> Any:
        return self.kind, str(self)

    @classmethod
    def from_text(cls, text: str) -> "Bound":
        """Bound of a file that holds its words only (files of 0.1): they begin with the kind."""
        first = text.replace(":", " ").replace(";", " ").split()
        known = first and first[0] in tuple(BoundKind)
        return cls(BoundKind(first[0]) if known else BoundKind.ESTIMATE if text else BoundKind.NONE, text)


class Range(NamedTuple):
    """Low and high end about a multiplier [-], NaN where there is none, and what they are."""

    low: float = math.nan
    high: float = math.nan
    meaning: str = ""

    @property
    def known(self) -> bool:
        """Whether both ends are numbers."""
        return math.isfinite(self.low) and math.isfinite(self.high)


def member_of(kind: type[StrEnum], text: str, field_: str) -> StrEnum:
    """Member of a closed set by its words, or an error that lists them all."""
    try:
        return kind(text)
    except ValueError:
        raise InputError(f"{field_} must be one of {', '.join(map(repr, map(str, kind)))}, got {text!r}") from None
