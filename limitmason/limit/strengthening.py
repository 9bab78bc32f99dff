"""Which ties to add, one by one, beside what all of them together would give."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass
from typing import Any, NamedTuple

from limitmason.answers.results import Prediction, Status
from limitmason.checks import count, finite, not_negative, several
from limitmason.errors import InputError, NotConverged
from limitmason.limit.analysis import whole_limit_analysis
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.tie import Tie

DIGITS = 7
"""Significant digits of multipliers that are compared: what differs by less is rounding of the solver."""


class AddedTie(NamedTuple):
    """A tie that was added, and what it gives."""

    name: str
    multiplier: float  # smallest one of the load cases with the tie [-]
    gain: float  # what the tie adds to those before [-]


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
    target : multiplier that was asked for, if any
    fewest : whether it is proven that no smaller choice reaches it; None where it was not reached
    """

    before: float
    steps: tuple[AddedTie, ...]
    alone: dict[str, float]
    bound: float
    structure: Assembly
    prediction: Prediction
    target: float | None = None
    fewest: bool | None = None

    @property
    def reached(self) -> bool | None:
        """Whether the target was reached; None without one."""
        return None if self.target is None else self.after >= self.target

    @property
    def after(self) -> float:
        """Smallest multiplier with the chosen ties."""
        return self.steps[-1].multiplier if self.steps else self.before

    @property
    def left(self) -> float:
        """What the candidates left out could still add together, at most [-]."""
        return _added(self.after, self.bound)

    def __str__(self) -> str:
        """A line per tie and the bound."""
        lines = [f"without candidates: {self.before:.6g}"]
        for s in self.steps:
            lines.append(f"+ {s.name}: {s.multiplier:.6g} (gain {s.gain:.4g}, alone {self.alone[s.name]:.6g})")
        lines.append(f"all candidates: {self.bound:.6g}, {self.left:.3g} more at most")
        if self.target is not None:
            proven = "proven: no fewer do" if self.fewest else "that no fewer do is not proven"
            missed = "not reached" if self.bound >= self.target else "out of reach of all candidates"
            said = f"reached with {len(self.steps)}; {proven}" if self.reached else missed
            lines.append(f"target {self.target:.6g} {said}")
        return "\n".join(lines)


def strengthen(
    assembly: Assembly,
    loads: Loads | Sequence[Loads],
    candidates: Sequence[Tie],
    *,
    most: int | None = None,
    target: float | None = None,
    least_gain: float = 1e-6,
    proof: int = 400,
    **options: Any,
) -> Strengthening:
    r"""Ties from candidates for the largest multiplier, or the fewest for a target.

    They are chosen greedily. For a target smaller choices are then looked through, as far as bounds leave any.

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
    proof : programs spent at most on smaller choices that reach the target; 0 for none
    options : of :func:`limitmason.limit.limit_analysis`, associative

    Returns
    -------
    Strengthening
        ``left`` proves how far from the best choice it may be: a tie only adds admissible forces, so that no choice
        carries more than all candidates do. ``fewest`` says whether fewer for the target are ruled out: every choice of
        one tie less is, by itself or with all that it may still take. One that is found is returned instead.

    Raises
    ------
    InputError
        For no candidates, two of one name, a ``most`` below 1, and another flow rule, where a tie may lower it.
    NotConverged
        Where a load case is not solved.

    Notes
    -----
    Associative. Ties yield without limit: one that snaps before the others are taut carries less.
    """
    if not isinstance(assembly, Assembly):
        raise InputError(f"assembly must be an Assembly; got {type(assembly).__name__}: assembly, loads, candidates")
    cases = [loads] if isinstance(loads, Loads) else list(several("loads", loads, Loads))
    candidates = several("candidates", candidates, Tie)
    if target is not None:
        finite("target", target)
    not_negative("least_gain", least_gain)
    proof = count("proof", proof, least=0)
    if options.get("flow_rule", "associative") != "associative":
        raise InputError("strengthen knows the associative flow rule only: by another one a tie may lower a multiplier")
    ties = {tie.name or f"candidate {k}": tie for k, tie in enumerate(candidates)}
    if not ties or not cases:
        raise InputError("strengthen: give at least one candidate and one load case")
    if len(ties) < len(candidates):
        raise InputError("candidates: two ties have the same name")
    most = len(ties) if most is None else count("most", most)

    def solved(names: Sequence[str]) -> list[tuple[float, Prediction]]:
        """Multipliers and predictions with these ties, least first; -inf for a fall."""
        made = assembly.with_ties([*assembly.ties, *(ties[n] for n in names)])
        found = []
        for case in cases:
            prediction = whole_limit_analysis(made, case, **options)
            value = -math.inf if prediction.status == Status.CANNOT_STAND else prediction.collapse_multiplier
            if math.isnan(value):
                raise NotConverged(f"load case {case.name!r} with {', '.join(names) or 'no tie'}: {prediction.status}")
            found.append((value, prediction))
        return sorted(found, key=lambda pair: pair[0])

    def values(names: Sequence[str]) -> tuple[float, ...]:
        """Multipliers of all load cases with the ties of these names, least first."""
        key = frozenset(names)
        if key not in known:
            known[key] = tuple(value for value, _ in solved(names))
        return known[key]

    known: dict[frozenset[str], tuple[float, ...]] = {}
    before, bound = values(())[0], values(list(ties))[0]
    alone = {name: values([name])[0] for name in ties}
    wanted = math.inf if target is None else target

    def enough(names: Sequence[str]) -> bool:
        """Whether the smallest multiplier with the ties of these names reaches the target."""
        return values(names)[0] >= wanted

    chosen = _one_by_one(values, list(ties), most, wanted, least_gain)
    fewest = None
    if target is not None and bound >= target:
        # greedy steps may end below a target that all ties together reach: then drop ties from all of them
        if not enough(chosen) and (other := _without_the_idle(enough, list(ties))) and len(other) <= most:
            chosen = other
        if enough(chosen):
            chosen, fewest = _fewest(enough, chosen, list(ties), len(known) + proof, known)
    steps = []
    for k, name in enumerate(chosen):
        before_it, with_it = (values(chosen[:n])[0] for n in (k, k + 1))
        steps.append(AddedTie(name, with_it, _added(before_it, with_it)))
    return Strengthening(
        before=before, steps=tuple(steps), alone=alone, bound=bound,
        structure=assembly.with_ties([*assembly.ties, *(ties[n] for n in chosen)]), prediction=solved(chosen)[0][1],
        target=target, fewest=fewest,
    )


def _added(before: float, after: float) -> float:
    """What a multiplier has grown by [-]: nothing where both are infinite alike, which have no difference."""
    return 0.0 if after == before else after - before


def _one_by_one(
    values: Callable[[Sequence[str]], tuple[float, ...]], names: list[str], most: int, target: float, least_gain: float
) -> list[str]:
    """Names of ties in the order in which they raise multipliers most, to a target.

    Parameters
    ----------
    values : multipliers of the load cases with ties of some names, least first [-]
    names : of all candidates
    most : ties at most
    target : smallest multiplier at which no more are added [-]; infinite for none
    least_gain : gain below which a tie is not worth adding, over the multiplier or 1 [-]
    """
    chosen: list[str] = []
    now = values(chosen)
    while len(chosen) < most and not now[0] >= target:
        trials = {name: values([*chosen, name]) for name in names if name not in chosen}
        # what differs by rounding is the same: the next smallest multiplier then tells
        best = max(trials, key=lambda name: [float(f"{v:.{DIGITS}g}") for v in trials[name]], default=None)
        if best is None or not _better(trials[best], now, least_gain):
            break
        chosen.append(best)
        now = trials[best]
    return chosen


def _without_the_idle(enough: Callable[[Sequence[str]], bool], names: list[str]) -> list[str]:
    """Names left when each that is not needed for the target is dropped in turn.

    Parameters
    ----------
    enough : whether a choice of names reaches the target
    names : all of them, which reach it together
    """
    for name in list(names):
        if enough(rest := [n for n in names if n != name]):
            names = rest
    return names


class _SpentError(Exception):
    """More programs were needed than a proof may take."""


def _fewest(
    enough: Callable[[Sequence[str]], bool], chosen: list[str], names: list[str], most: int, known: Sized
) -> tuple[list[str], bool]:
    """Smallest choice of ties found that is enough, and whether none is smaller.

    Parameters
    ----------
    enough : whether a choice of names reaches the target; with more ties it still does
    chosen : a choice that does, in the order in which it was found
    names : of all ties
    most : size of ``known`` at which to give up
    known : multipliers of all choices computed so far: its size counts the programs
    """

    def search(taken: list[str], rest: list[str], room: int) -> list[str] | None:
        """A set that is enough, ``taken`` and at most ``room`` of the ``rest``, or None.

        It is looked for with the first of the rest, then without it.
        """
        if len(known) >= most:
            raise _SpentError
        if enough(taken):
            return taken
        if not room or not enough([*taken, *rest]):  # all of the rest are not enough: no part of them is
            return None
        first, *others = rest
        return search([*taken, first], others, room - 1) or search(taken, others, room)

    rest = [*chosen, *(n for n in names if n not in chosen)]  # ties that helped first
    try:
        while chosen and (smaller := search([], rest, len(chosen) - 1)) is not None:
            chosen = smaller
    except _SpentError:
        return chosen, False
    return chosen, True


def _better(new: tuple[float, ...], old: tuple[float, ...], least: float) -> bool:
    """Whether, from the least upwards, the first multiplier that differs has grown.

    Parameters
    ----------
    new, old : multipliers, least first [-]
    least : change that counts, over the old multiplier or 1 [-]
    """
    for a, b in zip(new, old, strict=True):
        if a == b:
            continue
        # from minus infinity, where it falls, any change counts
        if not math.isfinite(b) or abs(a - b) > least * max(1.0, abs(b)):
            return a > b
    return False
