"""How a source is shown beside the theories: variants, settings, what is left out, and what is known of departures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Settings(NamedTuple):
    """How a case is solved.

    Parameters
    ----------
    contact_points : of the DEM, along the unit and across the thickness
    grid : of limit analysis where joints crush, which corners cannot show; None for corners
    search : effort of the non-associative search
    proven : seconds for each end of the proven range, in thorough runs; None where the wall is too large or not plane
    """

    contact_points: tuple[int, int] = (2, 8)
    grid: tuple[int, int] | None = None
    search: str = "quick"
    proven: float | None = None


class Variant(NamedTuple):
    """Options of the assembly in which a source is shown, with a name.

    The empty name is the source as packaged.
    """

    name: str = ""
    options: Mapping[str, Any] = {}


class Departure(NamedTuple):
    """What tests showed of an answer outside the range of theory, or of no answer.

    Parameters
    ----------
    word : in the names of the cases of its source to which it belongs
    begins : beginning of their verdict or status
    reason : what tests showed
    """

    word: str
    begins: str
    reason: str


@dataclass(frozen=True)
class Shown:
    """How a source is shown in the table of all theories.

    Parameters
    ----------
    variants : options in which it is shown
    settings : of every case
    stubborn : specimens, as packaged, on which the quick search ends above the standard one
    proven : seconds for each end of the range of the specimens, as packaged, where that can be proven
    left_out : why a method is not asked, by its name
    departures : answers outside the range that theory leaves which are explained
    assumed : what a reader must know beyond the data sheet
    """

    variants: tuple[Variant, ...] = (Variant(),)
    settings: Settings = field(default_factory=Settings)
    stubborn: tuple[str, ...] = ()
    proven: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    departures: tuple[Departure, ...] = ()
    assumed: str = ""

    def settings_of(self, specimen: str, variant: str = "", *, thorough: bool = False) -> Settings:
        """Settings of one case.

        Parameters
        ----------
        specimen : first of the case
        variant : name of its variant
        thorough : the standard search everywhere, and the range proven where that can be
        """
        if not thorough:
            # what is known of a specimen is known of it as packaged, without a variant
            stubborn = specimen in self.stubborn and not variant
            return self.settings._replace(search="standard") if stubborn else self.settings
        return self.settings._replace(search="standard", proven=None if variant else self.proven.get(specimen))

    def reason_for(self, case: str, outcome: str) -> str:
        """What is known of a departure, empty where nothing is.

        ``case`` is the name of the case, ``outcome`` its verdict or status.
        """
        for departure in self.departures:
            if departure.word in case and outcome.startswith(departure.begins):
                return departure.reason
        return ""
