"""A term added to the joint law: its numbers, what it makes of a point's strengths, and which theory takes it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from importlib import import_module
from typing import ClassVar, NamedTuple

from limitmason.errors import InputError


class Taken(StrEnum):
    """What a theory does with a term of the law."""

    TAKEN = "taken"
    PLASTIC = "perfectly plastic"
    LEFT_OUT = "left out, says so"
    REFUSED = "refused"


class Cell(NamedTuple):
    """What a theory does with a term.

    Parameters
    ----------
    how : taken, perfectly plastic, left out or refused
    why : why it is refused, or a remark for the table
    remedy : what to do where it is refused
    says : warning of a prediction whose joints have the term; empty for none
    """

    how: Taken
    why: str = ""
    remedy: str = ""
    says: str = ""


@dataclass(frozen=True)
class JointTerm:
    """A term that a joint has beside the fields of ``Joint``.

    One is a frozen dataclass of numbers made from this.

    Its class says what it is called (``title``), how a refusal goes on after "the joint ..." (``words``) and what
    theories make of it (``takes``, by their names in :mod:`limitmason.mechanics.law_table`). A theory that is not named
    there refuses it. The DEM may take it: :meth:`strength` is compiled into its law at a point.

    Raises
    ------
    InputError
        For a number that is negative, infinite or NaN; the message names the term and the field.
    """

    title: ClassVar[str]
    words: ClassVar[str]
    takes: ClassVar[Mapping[str, Cell]] = {}

    def __post_init__(self) -> None:
        """Check every number."""
        for field, value in self.numbers.items():
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f"{type(self).__name__}: {field} = {value} must be a number >= 0")

    @property
    def numbers(self) -> dict[str, float]:
        """Its numbers by field."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self)}

    @staticmethod
    def strength(
        tan_phi: float, tan_psi: float, cohesion: float, tension: float, slip: float, damage: float, *numbers: float
    ) -> tuple[float, float, float, float]:
        """Strengths of a point with the term: tan(phi), tan(psi), c and ft [-, -, Pa, Pa].

        Plain arithmetic and ``math`` only: it is compiled. At slip 0 and damage 0 it changes nothing, so that all that
        reads the law at its peak (elastic range, marks, modes) reads it with the term.

        Parameters
        ----------
        tan_phi, tan_psi, cohesion, tension : without it, at the damage of the point
        slip : distance of plastic slip from where the point was made, before the step [m]. It falls as the point slides
            back: a term that wears by it alone then regains strength
        damage : 0 at the peak, 1 at residual values [-]
        numbers : of the term, in the order of its fields
        """
        return tan_phi, tan_psi, cohesion, tension


ADDED: dict[str, str] = {}
"""Terms added to the joint law: name to "module:class". A script adds its own before it imports ``dem``."""


def added_terms() -> dict[str, type[JointTerm]]:
    """The added terms by name."""
    found = {}
    for name, place in ADDED.items():
        module, _, attribute = place.partition(":")
        found[name] = getattr(import_module(module), attribute)
    return found


def name_of(term: JointTerm) -> str:
    """Name under which a term is registered.

    Raises
    ------
    InputError
        Where it is not.
    """
    for name, known in added_terms().items():
        if type(term) is known:
            return name
    kind = type(term)
    raise InputError(
        f"{kind.__name__} is no term of the joint law yet: register it, "
        f"limitmason.model.joint_term.ADDED[name] = '{kind.__module__}:{kind.__qualname__}'"
    )
