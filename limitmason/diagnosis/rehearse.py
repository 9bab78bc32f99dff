"""Blind trials on the user's own design: how often the rule would name, confuse or miss each cause."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import betaincinv

from limitmason.diagnosis.inference.bootstrap import DRAWS, Draws
from limitmason.diagnosis.inference.decide import Rule, Verdict, decide
from limitmason.diagnosis.inference.design import Design, Listed
from limitmason.diagnosis.inference.grid import at_measured
from limitmason.diagnosis.inference.plan import NINE_IN_TEN, distances
from limitmason.progress import reached, watched

OUTCOMES = ("none", "named", "set with it", "wrong name", "set without it", "two", "unexplained", "scatter")
NULL = "(none)"


def binomial_interval(k: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of a proportion, k of n."""
    if n == 0:
        return 0.0, 1.0
    tail = 0.5 * (1.0 - level)
    low = 0.0 if k == 0 else float(betaincinv(k, n - k + 1, tail))
    high = 1.0 if k == n else float(betaincinv(k + 1, n - k, 1.0 - tail))
    return low, high


@dataclass(frozen=True)
class Rehearsal:
    """Outcomes of blind trials.

    Parameters
    ----------
    counts : per hidden cause ("(none)" for nulls) how often each outcome occurred
    n : trials
    answers : per hidden cause how often each cause was named alone: the confusion matrix
    """

    counts: Mapping[str, Mapping[str, int]]
    n: int
    answers: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.report()

    def table(self) -> list[dict]:
        """One row per hidden cause."""
        return [
            {"hidden": name, "trials": sum(row.values()), **{o: row.get(o, 0) for o in OUTCOMES}}
            for name, row in self.counts.items()
        ]

    def rate(self, outcome: str, hidden: str | None = None) -> tuple[float, float, float]:
        """Share of an outcome among trials with a hidden cause (or all with one), and its 95 % interval."""
        rows = [r for name, r in self.counts.items() if (name == hidden if hidden else name != NULL)]
        k, n = sum(r.get(outcome, 0) for r in rows), sum(sum(r.values()) for r in rows)
        return (k / n if n else float("nan"), *binomial_interval(k, n))

    def report(self) -> str:
        """The table as text."""
        width = max(map(len, self.counts))
        lines = [
            f"{self.n} blind trials on this design; sizes between just visible and the bound",
            f"{'hidden':<{width}}  trials  " + "  ".join(OUTCOMES),
        ]
        for row in self.table():
            cells = "  ".join(f"{row[o] or '.':>{len(o)}}" for o in OUTCOMES)
            lines.append(f"{row['hidden']:<{width}}  {row['trials']:>6}  {cells}")
        return "\n".join(lines)


def outcome(verdict: Verdict, hidden: str | None) -> str:
    """Which of ``OUTCOMES`` a verdict is when a cause (or nothing) was hidden."""
    if verdict.kind in ("none", "unexplained", "scatter"):
        return verdict.kind
    if verdict.kind == "two":
        return "two"
    if verdict.kind == "cause":
        return "named" if verdict.causes[0] == hidden else "wrong name"
    return "set with it" if hidden in verdict.causes else "set without it"


@watched("rehearsal")
def rehearse(
    design: Design,
    known: Design,
    n: int,
    seed: int,
    pairs: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Rehearsal:
    """Hide nothing (one trial in four) or a cause of random size, draw noise and inputs, and apply the rule.

    Sizes are uniform between the smallest that is seen nine times in ten and the bound (the bound itself where none
    is). The hidden cause uses the same tables as the rule: this measures the statistics, not the physics.

    Parameters
    ----------
    design : tables of the design and its list of causes
    known : the same with the noise that is drawn
    n, seed, pairs, progress : see :meth:`limitmason.diagnosis.Study.rehearse`
    """
    causes = design.causes
    spread = known.scale / design.scale
    rng = np.random.default_rng([seed, 77, design.n])
    chances = Draws.make([seed, design.n], design.n, design.inputs, design.noise, DRAWS)
    counts: dict[str, Counter] = {NULL: Counter(), **{c.name: Counter() for c in causes}}
    answers: dict[str, Counter] = {name: Counter() for name in counts}
    rule = Rule(screen=True)  # only verdicts are counted: no p of a hopeless cause is wanted
    visible = {c.name: _visible(known, c) for c in causes}
    for trial in range(n):
        hidden = None if rng.random() < 0.25 else causes[int(rng.integers(len(causes)))]
        grid = design.null if hidden is None else design.singles[hidden.name]
        position = np.zeros(len(grid.shape))
        if hidden is not None:
            low, high = visible[hidden.name][int(rng.integers(len(visible[hidden.name])))]
            size = low + (high - low) * rng.random()
            position[0] = np.interp(size, grid.sizes[0], np.arange(len(grid.sizes[0])))
        first = len(grid.sizes)
        for axis, nodes in enumerate(grid.z):
            true = np.clip(rng.standard_normal(), nodes[0], nodes[-1])
            position[first + axis] = np.interp(true, nodes, np.arange(len(nodes)))
        y = grid.between(position) + spread * rng.standard_normal(design.n)
        verdict = decide(design, y, chances, rule, pairs)
        row = NULL if hidden is None else hidden.name
        counts[row][outcome(verdict, hidden.name if hidden else None)] += 1
        if verdict.kind == "cause":
            answers[row][verdict.causes[0]] += 1
        reached((trial + 1) / n, f"trial {trial + 1} of {n}")
        if progress is not None:
            said = " or ".join(verdict.causes) if verdict.causes else verdict.kind
            progress(f"trial {trial + 1} of {n}: hidden {row}, found {said}")
    return Rehearsal({k: dict(v) for k, v in counts.items()}, n, {k: dict(v) for k, v in answers.items()})


def _visible(design: Design, cause: Listed) -> list[tuple[float, float]]:
    """Range of visible sizes on each side of the baseline."""
    grid = design.singles[cause.name]
    d = np.sqrt(distances(at_measured(grid), design.null))
    out = []
    for side in cause.sides:
        rows = np.flatnonzero((grid.sizes[0] - cause.baseline) * np.sign(side - cause.baseline) >= 0)
        rows = rows[np.argsort(np.abs(grid.sizes[0][rows] - cause.baseline))]
        reach = np.maximum.accumulate(d[rows])
        least = 3.0 + NINE_IN_TEN  # the gate's critical distance is near 3 for lists of 10 to 20 causes
        low = float(np.interp(least, reach, grid.sizes[0][rows])) if reach[-1] > least else side
        out.append((low, side))
    return out
