"""Blind trials on the user's own design: how often the rule names or misses."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.special import betaincinv

from limitmason.checks import choice, count, finite
from limitmason.diagnosis.inference.design import Design, Listed
from limitmason.diagnosis.inference.grid import Grid
from limitmason.diagnosis.inference.judge import Judge
from limitmason.diagnosis.inference.missing import position_of, visible
from limitmason.diagnosis.inference.noise import DRAWS, Draws
from limitmason.diagnosis.inference.verdict import Verdict, VerdictKind
from limitmason.display.notebook import Displayed
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError

OUTCOMES = ("none", "named", "behaves like it", "set with it", "wrong name", "behaves like another", "set without it",
            "two", "unexplained", "scatter")
NULL = "(none)"
_STREAM = 77  # second number of the seed: what is hidden is drawn by other numbers than the bootstrap


def binomial_interval(k: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of a proportion, k of n, at a level such as 0.95."""
    k, n = count("k", k, least=0), count("n", n, least=0)
    if k > n:
        raise InputError(f"k counts some of n, got {k} of {n}")
    if not 0.0 <= finite("level", level) < 1.0:
        raise InputError(f"level must be a share below 1, 0.95 for 95 %, got {level!r}")
    if n == 0:
        return 0.0, 1.0
    tail = 0.5 * (1.0 - level)
    low = 0.0 if k == 0 else float(betaincinv(k, n - k + 1, tail))
    high = 1.0 if k == n else float(betaincinv(k + 1, n - k, 1.0 - tail))
    return low, high


class Rate(NamedTuple):
    """Share of trials with an outcome [-], and the ends of its 95 % interval."""

    share: float
    low: float
    high: float


@dataclass(frozen=True)
class Rehearsal(Displayed):
    """Outcomes of blind trials.

    Parameters
    ----------
    counts : per hidden cause ("(none)" for nulls) how often each outcome occurred
    n : trials
    answers : per hidden cause how often each cause was named alone: the confusion matrix
    missing : whether each hidden cause was taken off the list
    """

    counts: Mapping[str, Mapping[str, int]]
    n: int
    answers: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    missing: bool = False

    def __str__(self) -> str:
        return self.report()

    def table(self) -> list[dict]:
        """One row per hidden cause."""
        return [
            {"hidden": name, "trials": sum(row.values()), **{o: row.get(o, 0) for o in OUTCOMES}}
            for name, row in self.counts.items()
        ]

    def rate(self, outcome: str, hidden: str | None = None) -> Rate:
        """Share of an outcome among trials with a hidden cause, with its interval.

        Parameters
        ----------
        outcome : one of ``OUTCOMES``
        hidden : name of the hidden cause; None is all trials with a cause

        Raises
        ------
        InputError
            For another outcome, or a cause that was not hidden.
        """
        choice("outcome", outcome, OUTCOMES)
        if hidden is not None:
            choice("hidden", hidden, tuple(self.counts))
        rows = [r for name, r in self.counts.items() if (name != NULL if hidden is None else name == hidden)]
        k, n = sum(r.get(outcome, 0) for r in rows), sum(sum(r.values()) for r in rows)
        return Rate(k / n if n else float("nan"), *binomial_interval(k, n))

    def report(self) -> str:
        """The table as text."""
        width = max(map(len, ("hidden", *self.counts)))
        shown = [o for o in OUTCOMES if any(row.get(o) for row in self.counts.values())]
        off = ", each hidden cause taken off the list" if self.missing else ""
        lines = [
            f"{self.n} blind trials on this design{off}; sizes between just visible and the bound",
            f"{'hidden':<{width}}  trials  " + "  ".join(shown),
        ]
        for row in self.table():
            cells = "  ".join(f"{row[o] or '.':>{len(o)}}" for o in shown)
            lines.append(f"{row['hidden']:<{width}}  {row['trials']:>6}  {cells}")
        if self.missing:
            rate, low, high = self.rate("wrong name")
            lines.append(
                f"With the true cause missing from the list a name is given in {100 * rate:.0f} of 100 data sets "
                f"(95 % interval {100 * low:.0f} to {100 * high:.0f})."
            )
        return "\n".join(lines)


def outcome(verdict: Verdict, hidden: str | None) -> str:
    """Which of ``OUTCOMES`` a verdict is when a cause (or nothing) was hidden.

    A verdict is distinct where one explanation is left that no smooth error of the model could imitate.
    """
    if verdict.kind in ("none", "unexplained", "scatter"):
        return str(verdict.kind)
    if verdict.pairs:
        return "two" if verdict.distinct or verdict.kind == VerdictKind.TWO else "behaves like another"
    if verdict.distinct:
        return "named" if verdict.causes[0] == hidden else "wrong name"
    if verdict.kind == VerdictKind.BEHAVES_LIKE:
        return "behaves like it" if verdict.causes[0] == hidden else "behaves like another"
    return "set with it" if hidden in verdict.causes else "set without it"


@dataclass(frozen=True)
class Planted:
    """What is hidden in some of the trials, and the judge that sees the data.

    Parameters
    ----------
    cause : None for nothing
    grid : of the baseline or of the cause, in units of the noise that is drawn
    ranges : visible sizes on each side of the baseline
    judge : with its list
    """

    cause: Listed | None
    grid: Grid
    ranges: Sequence[tuple[float, float]]
    judge: Judge


def planted(known: Design, cause: Listed | None, judge: Judge) -> Planted:
    """A cause, or nothing, to be hidden at visible sizes.

    Parameters
    ----------
    known : design with the cause on its list, and the noise that is drawn
    cause : to be hidden; None for the baseline, which has no size
    judge : of the list that the data are judged by
    """
    if cause is None:
        return Planted(cause=None, grid=known.null, ranges=(), judge=judge)
    return Planted(cause=cause, grid=known.singles[cause.name], ranges=visible(known, cause), judge=judge)


@watched("rehearsal")
def rehearse(
    hidden: Sequence[Planted],
    nothing: Planted,
    spread: np.ndarray,
    n: int,
    seed: int,
    *,
    missing: bool = False,
    pairs: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Rehearsal:
    """Hide nothing (one in four) or a cause of random size, draw, and apply the rule.

    Sizes are uniform between the smallest that is seen nine times in ten and the bound (the bound itself where none
    is). The hidden cause uses the same tables as the rule: this measures the statistics, not the physics.

    Parameters
    ----------
    hidden : what may be hidden
    nothing : the baseline, in one trial of four; in none where the hidden causes are missing from the list
    spread : noise that is drawn, in units of the scale that the judges see, shape (n,)
    n, seed, pairs, progress : see :meth:`limitmason.diagnosis.Study.rehearse`
    missing : whether each hidden cause is taken off the list; they are then hidden in turn
    """
    design = nothing.judge.design
    rng = np.random.default_rng([seed, _STREAM, design.n])
    # errors of the bootstrap, the same for every trial
    chances = Draws.make([seed, design.n], n=design.n, k=design.inputs, noise=design.noise, count=DRAWS)
    names = [p.cause.name for p in hidden if p.cause is not None]
    counts: dict[str, Counter] = {name: Counter() for name in ([] if missing else [NULL]) + names}
    answers: dict[str, Counter] = {name: Counter() for name in counts}
    for trial in range(n):
        if missing:
            chosen = hidden[trial % len(hidden)]
        else:
            # one trial in four hides nothing: enough of them for a rate of false alarms
            chosen = nothing if rng.random() < 0.25 else hidden[int(rng.integers(len(hidden)))]
        size = None
        if chosen.cause is not None:
            low, high = chosen.ranges[int(rng.integers(len(chosen.ranges)))]
            size = low + (high - low) * rng.random()
        inputs = rng.standard_normal(len(chosen.grid.z))  # true inputs, in standard deviations from the measured ones
        expected = chosen.grid.between(position_of(chosen.grid, size, inputs))
        # what is seen or not is misread, by what is predicted; all else has normal errors
        noise = design.noise.about(design.origin + spread * design.scale * expected)
        y = spread * (expected + noise.errors(rng, 1, design.n)[0])
        judge = chosen.judge
        verdict = judge.beside_groups(judge, judge.judge_with_own_noise(y, chances, pairs), y, chances)
        row = NULL if chosen.cause is None else chosen.cause.name
        counts[row][outcome(verdict, chosen.cause.name if chosen.cause else None)] += 1
        if verdict.distinct and not verdict.pairs:
            answers[row][verdict.causes[0]] += 1
        reached((trial + 1) / n, f"trial {trial + 1} of {n}")
        if progress is not None:
            said = " or ".join(verdict.causes) if verdict.causes else verdict.kind
            like = "behaves like " if verdict.kind == VerdictKind.BEHAVES_LIKE else ""
            progress(f"trial {trial + 1} of {n}: hidden {row}, found {like}{said}")
    return Rehearsal(
        counts={k: dict(v) for k, v in counts.items()}, n=n, answers={k: dict(v) for k, v in answers.items()},
        missing=missing,
    )
