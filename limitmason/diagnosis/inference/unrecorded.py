"""An alarm held against noise that tests may share where nobody wrote down which of them have what in common."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from limitmason.diagnosis.inference.bootstrap import Draws
from limitmason.diagnosis.inference.decide import Rule, drawn_data, gate
from limitmason.diagnosis.inference.design import Design
from limitmason.diagnosis.inference.earned import effect_of, slopes_of
from limitmason.diagnosis.inference.fit import Fit
from limitmason.diagnosis.inference.fit import fit as best_fit
from limitmason.diagnosis.inference.plan import NINE_IN_TEN
from limitmason.diagnosis.inference.shapes import Shapes
from limitmason.diagnosis.inference.shared import PLAUSIBLE, same
from limitmason.diagnosis.inference.verdict import Doubt, Verdict, VerdictKind

EVEN = 0.05  # standard deviation over mean of an effect that acts on all specimens alike


def doubted(
    design: Design,
    y: np.ndarray,
    verdict: Verdict,
    draws: Draws,
    rule: Rule,
    covariates: Mapping[str, Sequence],
    unrecorded: tuple[str, ...],
) -> Verdict:
    """Hold the alarm of a gate against noise half of whose variance is shared by the tests that the best cause acts on.

    With g the groups of specimens that the cause with the largest gain acts on much and little, and C the correlation
    that is carried so far, gain and trend are tested again with the correlation C / 2 + same_g / 2, and the scatter
    within the groups, which no share makes larger. What fired at the gate must fire again; else the verdict is "none".

    Parameters
    ----------
    design, y, draws, rule : of the gate
    verdict : of the gate; what is no alarm stays as it is
    covariates : name to values of all specimens
    unrecorded : circumstances of the tests that no column tells

    Notes
    -----
    Which tests share a batch, a day or a rig is not known; those that one cause acts on are the grouping that imitates
    it best. Wrong, and too cautious, where tests have nothing in common. A cause that acts on its specimens by more
    than one size is still seen by that.
    """
    if verdict.kind == VerdictKind.NONE or verdict.null is None or not unrecorded:
        return verdict
    names = max(verdict.tested, key=lambda n: verdict.tested[n].gain)
    effect = effect_of(design.null, design.grid(names), verdict.tested[names].fit)
    groups = much_and_little(design.apart(effect) * design.scale)
    mix = np.eye(design.n) if design.mix is None else design.mix
    factor = np.linalg.inv(mix)
    correlation = (1.0 - PLAUSIBLE) * factor @ factor.T + PLAUSIBLE * same(groups)
    whole = np.linalg.inv(np.linalg.cholesky(correlation))
    step = whole @ factor  # from the coordinates of the gate
    sharing = design.mixed(step, Shapes(covariates, design.scale, whole))
    p = dict(gate(sharing, sharing.turned(y), draws, rule).p)
    if "scatter" in verdict.p:
        p["scatter"] = _scatter_within(design, verdict.null, groups, draws, rule)
    limits = {"gain": rule.gain, "shape": rule.shape, "scatter": rule.scatter}
    holds = any(verdict.p[k] < v and p[k] < v for k, v in limits.items() if k in verdict.p)
    doubt = Doubt(names, unrecorded, {k: p[k] for k in limits if k in p}, holds)
    return replace(verdict, doubt=doubt, kind=verdict.kind if holds else VerdictKind.NONE)


def seen_if_shared(design: Design, effects: np.ndarray) -> np.ndarray:
    """Distance that nine in ten data sets with independent noise reach where half of it is taken as shared.

    With f an effect, J the change of the baseline per standard deviation of each measured input, C the correlation with
    half of the variance shared by the specimens that f acts on much, and by the others, and w = (C + J J')^-1 f::

        d = sqrt(f' w) - 1.28 sqrt(w' (I + J J') w / f' w)

    Parameters
    ----------
    design : independent noise, known
    effects : whitened changes of the predictions, shape (b, n)
    """
    slopes = slopes_of(design.null)
    extra, one = slopes @ slopes.T, np.eye(design.n)
    out = np.full(len(effects), -np.inf)
    for k, effect in enumerate(effects):
        groups = same(much_and_little(effect * design.scale))
        weight = np.linalg.solve((1.0 - PLAUSIBLE) * one + PLAUSIBLE * groups + extra, effect)
        square = float(effect @ weight)
        if square > 0.0:
            out[k] = np.sqrt(square) - NINE_IN_TEN * np.sqrt(weight @ (one + extra) @ weight / square)
    return out


def much_and_little(effect: np.ndarray) -> list[int]:
    """1 where a cause acts much, 0 where it acts little: the two groups with the least scatter about their means.

    Parameters
    ----------
    effect : change of every specimen, shape (n,); all are one group where it is the same but for ``EVEN``
    """
    size = np.abs(effect)
    if size.std() <= EVEN * size.mean():
        return [1] * len(size)
    ordered = np.sort(size)
    cuts = range(1, len(size))
    scatter = [j * np.var(ordered[:j]) + (len(size) - j) * np.var(ordered[j:]) for j in cuts]
    cut = 1 + int(np.argmin(scatter))
    return [int(v >= 0.5 * (ordered[cut - 1] + ordered[cut])) for v in size]


def _scatter_within(design: Design, null: Fit, groups: Sequence[int], draws: Draws, rule: Rule) -> float:
    """Share of draws that scatter about the means of the groups as much as the data do; what is shared leaves those."""
    like = design.like
    y, z, replicate = drawn_data(design, (), null, draws, slice(0, min(rule.draws, len(draws.errors))))
    inside = np.eye(design.n) - same(groups) / same(groups).sum(axis=1)

    def within(fit: Fit) -> np.ndarray:
        return ((design.apart(fit.residuals) @ inside) ** 2).sum(axis=1)

    drawn = like.scatter(within(best_fit(design.null, y, z, like, replicate)), 0.0, replicate)
    observed = float(like.scatter(within(null), 0.0, np.ones(1))[0])
    return float((1.0 + np.count_nonzero(drawn >= observed)) / (1.0 + len(drawn)))
