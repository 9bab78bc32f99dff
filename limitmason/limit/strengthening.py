"""Which ties to add: chosen one by one from candidates, beside what all of them together would give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from limitmason.answers.results import CANNOT_STAND, Prediction
from limitmason.errors import InputError, NotConverged
from limitmason.limit.analysis import limit_analysis
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.tie import Tie


class AddedTie(NamedTuple):
    """A tie that was added: its name, multiplier and gain.

    ``multiplier`` is the smallest one with the tie, ``gain`` what it adds to those before.
    """

    name: str
    multiplier: float
    gain: float


@dataclass(frozen=True, eq=False)
class Strengthening:
    """Ties in the order in which they were chosen, and what the rest could give.

    Parameters
    ----------
    before : smallest multiplier of the load cases without any candidate; minus infinity where it cannot stand
    steps : the ties that were added
    alone : smallest multiplier with one candidate only, by name
    bound : smallest multiplier with all candidates: no choice among them gives more
    structure : the assembly with the chosen ties
    prediction : of its governing load case
    reached : whether the target was reached; None without one
    """

    before: float
    steps: tuple[AddedTie, ...]
    alone: dict[str, float]
    bound: float
    structure: Assembly
    prediction: Prediction
    reached: bool | None = None

    @property
    def after(self) -> float:
        """Smallest multiplier with the chosen ties."""
        return self.steps[-1].multiplier if self.steps else self.before

    @property
    def left(self) -> float:
        """What the candidates left out could still add together, at most [-]."""
        return self.bound - self.after

    def __str__(self) -> str:
        """A line per tie and the bound."""
        lines = [f"without candidates: {self.before:.6g}"]
        for s in self.steps:
            lines.append(f"+ {s.name}: {s.multiplier:.6g} (gain {s.gain:.4g}, alone {self.alone[s.name]:.6g})")
        return "\n".join([*lines, f"all candidates: {self.bound:.6g}, {self.left:.3g} more at most"])


def strengthen(
    assembly: Assembly,
    loads: Loads | Sequence[Loads],
    candidates: Sequence[Tie],
    *,
    most: int | None = None,
    target: float | None = None,
    least_gain: float = 1e-6,
    **options: Any,
) -> Strengthening:
    r"""Ties from candidates for the largest multiplier, or few of them for a target.

    They are chosen greedily.

    .. math:: S_{k+1} = S_k \cup \{\arg\max_t \lambda(S_k \cup \{t\})\}, \qquad
        \lambda(S) \le \lambda(\text{all candidates})

    Parameters
    ----------
    assembly : what is strengthened; ties that it has stay
    loads : one load case or several; the smallest of their multipliers is raised, then the next smallest
    candidates : ties that may be added
    most : ties that are added at most; all by default
    target : multiplier at which no more are added
    least_gain : gain below which a tie is not worth adding, over the multiplier or 1 [-]
    options : of :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Strengthening
        ``left`` proves how far from the best choice it may be: a tie only adds admissible forces, so that no choice
        carries more than all candidates do. The fewest for a target are not proven.

    Raises
    ------
    InputError
        For no candidates, two of one name, and a ``most`` below 1.
    NotConverged
        Where a load case is not solved.

    Notes
    -----
    Associative. Ties yield without limit: one that snaps before the others are taut carries less.
    """
    cases = [loads] if isinstance(loads, Loads) else list(loads)
    ties = {tie.name or f"candidate {k}": tie for k, tie in enumerate(candidates)}
    if not ties or not cases:
        raise InputError("strengthen: give at least one candidate and one load case")
    if len(ties) < len(candidates):
        raise InputError("candidates: two ties have the same name")
    most = len(ties) if most is None else most
    if most < 1:
        raise InputError(f"most must be 1 or more, got {most!r}")

    def solved(names: Sequence[str]) -> list[tuple[float, Prediction]]:
        made = assembly.with_ties([*assembly.ties, *(ties[n] for n in names)])
        found = []
        for case in cases:
            prediction = limit_analysis(made, case, **options)
            value = -math.inf if prediction.status == CANNOT_STAND else prediction.collapse_multiplier
            if math.isnan(value):
                raise NotConverged(f"load case {case.name!r} with {', '.join(names) or 'no tie'}: {prediction.status}")
            found.append((value, prediction))
        return sorted(found, key=lambda pair: pair[0])

    def values(names: Sequence[str]) -> tuple[float, ...]:
        return tuple(value for value, _ in solved(names))

    now, bound = values(()), values(list(ties))[0]
    before, alone = now[0], {name: values([name]) for name in ties}
    chosen: list[str] = []
    steps: list[AddedTie] = []
    while len(chosen) < most and not (target is not None and now[0] >= target):
        trials = {n: values([*chosen, n]) if chosen else alone[n] for n in ties if n not in chosen}
        # what differs by rounding is the same: the next smallest multiplier then tells
        best = max(trials, key=lambda n: [float(f"{v:.7g}") for v in trials[n]], default=None)
        if best is None or not _better(trials[best], now, least_gain):
            break
        chosen.append(best)
        gain = trials[best][0] - now[0] if math.isfinite(now[0]) else math.inf
        steps.append(AddedTie(best, trials[best][0], gain))
        now = trials[best]
    return Strengthening(
        before, tuple(steps), {n: v[0] for n, v in alone.items()}, bound,
        assembly.with_ties([*assembly.ties, *(ties[n] for n in chosen)]), solved(chosen)[0][1],
        None if target is None else now[0] >= target,
    )  # fmt: skip


def _better(new: tuple[float, ...], old: tuple[float, ...], least: float) -> bool:
    """Whether the smallest multiplier that differs has grown."""
    for a, b in zip(new, old, strict=True):
        if a == b:
            continue
        if not math.isfinite(b) or abs(a - b) > least * max(1.0, abs(b)):
            return a > b
    return False
