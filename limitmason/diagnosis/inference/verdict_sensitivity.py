"""What a verdict hangs on: the same data judged again under other statements."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from limitmason.checks import listener
from limitmason.diagnosis.inference.confidence_set import ConfidenceSet
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.noise import Draws, Noise
from limitmason.diagnosis.inference.shared_noise import Shares, alike, assumed
from limitmason.diagnosis.inference.trends import is_numeric
from limitmason.diagnosis.inference.verdict import Rule
from limitmason.display.progress import reached, watched

NEAR = 25.0  # as ``Rule.far`` in these: a rival beyond it wins fewer than one draw in a thousand
QUICK = 299  # draws of the repeated verdicts
LIKE = "like specimens"  # groups of them, by their covariates


class CheckedVerdict(NamedTuple):
    """Kind and causes of a verdict."""

    kind: str
    causes: Names

    def __str__(self) -> str:
        return f"{self.kind} {', '.join(self.causes)}".rstrip()


@dataclass(frozen=True)
class Checks:
    """One data set judged again under other statements.

    Parameters
    ----------
    unknown_noise : kind and causes with the noise taken as unknown (relative sizes between specimens as stated)
    dropped : per specimen the kind and causes without it
    hangs_on : specimens without which the verdict is another
    shared : by column of labels whose share of the noise is not carried (``LIKE`` for groups of like specimens, where
        no circumstance of the tests is recorded), kind and causes with ``PLAUSIBLE`` of its variance shared
    """

    unknown_noise: CheckedVerdict
    dropped: tuple[CheckedVerdict, ...]
    hangs_on: tuple[int, ...]
    shared: Mapping[str, CheckedVerdict] = field(default_factory=dict)


@watched("judging again")
def judge_again(
    design: Design, y: np.ndarray, rule: Rule, seed: int, pairs: bool, shares: Shares, unstated: tuple[str, ...] = (),
    progress: Callable[[str], None] | None = None,
) -> Checks:
    """The verdict under unknown noise, without each specimen, and with shared noise.

    Few draws; the last two without pairs.

    Parameters
    ----------
    design : tables of the design
    y : whitened data, shape (n,)
    rule, seed : of the verdict
    pairs : whether pairs of causes are tried under other statements of the noise
    shares : of the noise that are carried
    unstated : circumstances of the tests that no column tells
    progress : told in a line what is judged again
    """

    def judged(design: Design, y: np.ndarray, draws: Draws, pairs: bool, shared: np.ndarray | None) -> CheckedVerdict:
        """Verdict of a design on whitened data, with noise that some tests share."""
        decision = ConfidenceSet(design if shared is None else design.sharing(shared), draws, rule)
        verdict = decision.explained(y, decision.alarm(y, unstated), pairs)
        return CheckedVerdict(verdict.kind, verdict.causes)

    say = listener("progress", progress, "a line of text") or (lambda line: None)
    n, noise, rule = design.n, design.noise, replace(rule, screen=True, far=NEAR)
    carried = shares.correlation if shares.shares else None
    say("the verdict with the noise taken as unknown")
    chances = Draws.make([seed, n], n=n, k=design.inputs, noise=noise, count=QUICK)
    plain = judged(design, y, chances, pairs=False, shared=carried)
    unknown = Noise.unknown()
    other = judged(
        design.with_noise(unknown), y, Draws.make([seed, n], n=n, k=design.inputs, noise=unknown, count=QUICK), pairs,
        shared=carried,
    )
    dropped = []
    for i in range(n):
        say(f"the verdict without specimen {i + 1} of {n}")
        reached(i / n, f"without specimen {i + 1} of {n}")
        kept = np.arange(n) != i
        left = None if carried is None else carried[np.ix_(kept, kept)]
        dropped.append(judged(design.only(kept), y[kept], chances.columns(kept), pairs=False, shared=left))
    hangs = tuple(i for i, answer in enumerate(dropped) if _other(plain, answer))
    shared: dict[str, CheckedVerdict] = {}
    if plain.kind != "none":  # what is shared makes no alarm where there is none without
        say("the verdict with noise that some tests share")
        for name, column in _unestimated(design.columns, shares).items():
            shared[name] = judged(design, y, chances, pairs=False, shared=assumed(column))
    return Checks(unknown_noise=other, dropped=tuple(dropped), hangs_on=hangs, shared=shared)


def _unestimated(covariates: Mapping, shares: Shares) -> dict[str, Sequence]:
    """Columns within which noise may be shared though no share was estimated.

    Where there are none, and nothing was estimated, groups of specimens with like covariates stand in.
    """
    out: dict[str, Sequence] = {}
    for name, column in covariates.items():
        if name not in shares.estimated and not is_numeric(column) and 1 < len(set(map(str, column))) < len(column):
            out[name] = column
    if not out and not shares.estimated and (groups := alike(covariates)) is not None:
        out[LIKE] = groups
    return out


def _other(plain: CheckedVerdict, answer: CheckedVerdict) -> bool:
    """Whether another verdict contradicts: another kind, or no cause in common."""
    named = ("cause", "either")
    if plain.kind in named and answer.kind in named:
        return not set(plain.causes) & set(answer.causes)
    return plain.kind != answer.kind
