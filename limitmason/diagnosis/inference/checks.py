"""What a verdict hangs on: the same data judged again under other statements of the noise and without each specimen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Rule, Verdict, decide
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.noise import Noise
from limitmason.progress import reached, watched

TAILS = 4.0  # degrees of freedom of the Student errors tried as a check
NEAR = 25.0  # as ``Rule.far`` in these: a rival beyond it wins fewer than one draw in a thousand
QUICK = 299  # draws of the repeated verdicts


@dataclass(frozen=True)
class Checks:
    """The same data judged again under other statements.

    Parameters
    ----------
    unknown_noise : kind and causes with the noise taken as unknown (relative sizes between specimens as stated)
    student : the same with Student errors, which forgive blunders; None unless the noise is known and Gaussian
    dropped : per specimen the kind and causes without it
    hangs_on : specimens without which the verdict is another
    """

    unknown_noise: tuple[str, Names]
    student: tuple[str, Names] | None
    dropped: tuple[tuple[str, Names], ...]
    hangs_on: tuple[int, ...]


@watched("judging again")
def judge_again(
    design: Design,
    y: np.ndarray,
    covariates: Mapping,
    rule: Rule,
    seed: int,
    pairs: bool,
    progress: Callable[[str], None] | None = None,
) -> Checks:
    """The verdict under unknown noise, and without each specimen in turn (quick; the latter without pairs).

    Parameters
    ----------
    design : tables of the design
    y : whitened data, shape (n,)
    covariates : name to values of all specimens
    rule, seed : of the verdict
    pairs : whether pairs of causes are tried under other statements of the noise
    progress : told in a line what is judged again
    """

    def draws(noise: Noise) -> Draws:
        return Draws.make([seed, n], n, design.inputs, noise, QUICK)

    say = progress or (lambda line: None)
    n, noise, rule = design.n, design.noise, replace(rule, screen=True, far=NEAR)
    say("the verdict with the noise taken as unknown")
    chances = draws(noise)
    plain = decide(design, y, chances, rule, pairs=False)
    blind = design.with_noise(Noise.unknown(), design.scale, covariates)
    other = decide(blind, y, draws(Noise.unknown()), rule, pairs=pairs)
    student = None
    if noise.kind == "known" and noise.tails is None:
        say("the verdict with Student errors")
        forgiving = Noise(noise.sd, tails=TAILS)
        heavy = design.with_noise(forgiving, design.scale, covariates)
        verdict = decide(heavy, y, draws(forgiving), rule, pairs=pairs)
        student = (verdict.kind, verdict.causes)
    dropped = []
    for i in range(n):
        say(f"the verdict without specimen {i + 1} of {n}")
        reached(i / n, f"without specimen {i + 1} of {n}")
        kept = np.arange(n) != i
        part = design.without(kept, covariates)
        verdict = decide(part, y[kept], chances.columns(kept), rule, pairs=False)
        dropped.append((verdict.kind, verdict.causes))
    hangs = [i for i, (k, c) in enumerate(dropped) if _other(plain, k, c)]
    return Checks((other.kind, other.causes), student, tuple(dropped), tuple(hangs))


def _other(plain: Verdict, kind: str, causes: Names) -> bool:
    """Whether another verdict contradicts: another kind of answer, or no cause in common."""
    named = ("cause", "either")
    if plain.kind in named and kind in named:
        return not set(plain.causes) & set(causes)
    return plain.kind != kind
