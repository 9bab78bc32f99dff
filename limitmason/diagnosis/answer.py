"""What a study answers: the diagnosis beside the study that gave it, with its report, table and next tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from limitmason.diagnosis.from_table import About
from limitmason.diagnosis.inference.plan import NextTests
from limitmason.diagnosis.record import record
from limitmason.diagnosis.report import headline, report, table
from limitmason.diagnosis.report import warnings as warnings_of
from limitmason.diagnosis.result import Diagnosis


class Asked(Protocol):
    """A study, as far as its answers ask it: what it is about, and which tests come next."""

    @property
    def about(self) -> About:
        """What its data are."""

    def next_tests(self, diagnosis: Diagnosis, pool: Sequence[Any], k: int = 4) -> NextTests:
        """Specimens of a pool that would tell the kept causes of a diagnosis apart."""


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Diagnosis):
    """A diagnosis beside the study that gave it: what is asked of both is asked here.

    Parameters
    ----------
    study : what was asked; all others are those of :class:`Diagnosis`, which is the numbers alone
    """

    study: Asked

    @property
    def warnings(self) -> tuple[str, ...]:
        """What limits the verdict."""
        return warnings_of(self)

    def report(self, *, checks: bool = True, progress: Callable[[str], None] | None = None) -> str:
        """The verdict as text.

        Parameters
        ----------
        checks : also judge the data again under other statements of the noise and without each specimen (some seconds
            for 16 causes and 24 specimens)
        progress : told in a line what is judged again
        """
        return report(self, self.judged_again(progress) if checks else None)

    def table(self) -> list[dict[str, Any]]:
        """One row per cause of the list and per kept pair: size, interval, gain, p, and whether it is kept."""
        return table(self)

    def record(self) -> dict[str, Any]:
        """The verdict as plain numbers and words, as JSON can hold them."""
        return record(self)

    def next_tests(self, pool: Sequence[Any], k: int = 4) -> NextTests:
        """Specimens of a pool that would tell the kept causes apart best, or earn a name; see ``Study``."""
        return self.study.next_tests(self, pool, k)

    def __str__(self) -> str:
        return headline(self)

    def __repr__(self) -> str:
        return f"<Diagnosis of {self.n} specimens, {headline(self)}>"
