"""A study from data to report: diagnosed, rehearsed, and what to test next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from limitmason.checks import count, listener
from limitmason.diagnosis.error_rates import Rehearsal
from limitmason.diagnosis.inference.next_tests import NextTests
from limitmason.diagnosis.report import Diagnosis
from limitmason.diagnosis.study import Study
from limitmason.diagnosis.study_from_table import pool_rows
from limitmason.display.progress import watched
from limitmason.storage.measured_table import MeasuredTable

Pool = str | Path | MeasuredTable | Sequence[Any]


@dataclass(frozen=True)
class Investigation:
    """What was found.

    Parameters
    ----------
    answer : the verdict
    next_tests : suggested specimens, None where none were asked for
    from_pool : whether they come from a pool of their own, or are repeats of the tested ones
    rehearsal : blind trials on the design, None where none were asked for
    missing : blind trials with each cause of the list taken off in turn, None where none were asked for
    """

    answer: Diagnosis
    next_tests: NextTests | None
    from_pool: bool
    rehearsal: Rehearsal | None
    missing: Rehearsal | None = None

    def report(self, *, checks: bool = True) -> str:
        """Title, verdict, next tests and what is assumed, as text.

        Parameters
        ----------
        checks : also what the verdict hangs on, which judges the data again
        """
        about, tests = self.answer.study.about, self.next_tests
        text = (f"{about.title}\n\n" if about.title else "") + self.answer.report(checks=checks)
        if tests is not None:
            where = "in the pool" if self.from_pool else "in the data, to be repeated"
            text += f"\n\nNext tests, {tests.reason}: rows {tests.listed(1)} {where}."
            text += "".join(f" {told[0].upper()}{told[1:]}." for told in tests.expected)
        return text + "".join(f"\n{note}" for note in ["", *about.notes])


@watched("diagnosis")
def investigate(
    study: Study,
    *,
    seed: int = 0,
    next_tests: int = 4,
    pool: Pool | None = None,
    rehearse: int = 0,
    missing: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Investigation:
    """Diagnose a study with its own list of causes, and say what to test next.

    Parameters
    ----------
    seed : of the bootstrap
    next_tests : most specimens to suggest; 0 for none
    pool : specimens that could be tested, or a table of them; None is repeats of the tested ones
    rehearse : blind trials on the design
    missing : blind trials with the true cause missing from the list; their rate then stands in the verdict
    progress : told in a line what is done
    """
    next_tests, rehearse, missing = (count(name, n, least=0) for name, n in (
        ("next_tests", next_tests), ("rehearse", rehearse), ("missing", missing)))
    say = listener("progress", progress, "a line of text") or (lambda line: None)
    rows: Sequence[Any] = study.specimens
    if isinstance(pool, (str, Path, MeasuredTable)):
        rows = pool_rows(pool, study.covariates, study.simulate)
    elif pool is not None:
        rows = [dict(s) if isinstance(s, Mapping) else s for s in pool]
    left_out = None
    if missing > 0:
        say(f"{missing} blind trials with the true cause missing from the list")
        left_out = study.rehearse(n=missing, hide="each", seed=seed)
    answer = study.diagnose(seed=seed)
    say(f"{study.simulator.calls} simulations")
    tests = answer.next_tests(rows, k=min(next_tests, len(rows))) if next_tests > 0 else None
    rehearsal = None
    if rehearse > 0:
        say(f"{rehearse} blind trials")
        rehearsal = study.rehearse(n=rehearse, seed=seed)
    return Investigation(
        answer=answer, next_tests=tests, from_pool=pool is not None, rehearsal=rehearsal, missing=left_out
    )
