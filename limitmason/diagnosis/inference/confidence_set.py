"""Bootstrap confidence set of causes, then pairs, behind a gate and a guard.

``y`` are the whitened values of a data set, shape (n,), or of several, (b, n); ``replicate`` the redrawn variances of
replicates, (b,), and ``shape`` a statistic of trends, (b,).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from limitmason.diagnosis.inference.bootstrap import Tally, add_draws, share_of
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.fit import BestFit
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.noise import Drawn, Draws
from limitmason.diagnosis.inference.shared_noise import PLAUSIBLE, two_groups_by_effect
from limitmason.diagnosis.inference.trends import same
from limitmason.diagnosis.inference.verdict import Doubt, Rule, Tested, Verdict, VerdictKind

GATE = ("gain", "shape", "scatter")  # any of them below its threshold is an alarm
GATE_DRAWS = 699  # fewest: the critical gain is a quantile of them
RIVALS = 4  # refitted to a draw at first, then twice as many more at a time
TOLD = 0.05  # p below which the best trend is told, as a pointer and no alarm: the usual level
AS_IF_KNOWN = 1e6  # degrees of freedom of a noise that is as good as known


class ConfidenceSet:
    """Explanations of one design held against data by the bootstrap.

    Parameters
    ----------
    design : tables; all data come per specimen, in units of the noise, shape (n,)
    draws : standard errors for the bootstrap
    rule : thresholds
    """

    def __init__(self, design: Design, draws: Draws, rule: Rule):
        self.design, self.draws, self.rule = design, draws, rule
        self.count = min(rule.draws, len(draws.errors))

    def drawn(self, names: Names, fit: BestFit, rows: slice | None = None) -> Drawn:
        """Data drawn from a fitted explanation, as many as the rule takes by default."""
        return self.design.drawn(names, fit, self.draws, rows or slice(0, self.count))

    @cached_property
    def _errors_along(self) -> np.ndarray:
        """Errors of the draws along the trends."""
        return self.design.trends.along(self.draws.errors[: self.count])

    def _trend_drawn(self, names: Names, fit: BestFit) -> Callable[[slice, BestFit], np.ndarray]:
        """Trend statistic of what new fits leave of data drawn from a fit, shape (b,).

        The function that is returned takes rows of the draws, and the fits to them.
        """
        trend, sd = self.design.trend_of(names), self.design.noise_of(names, fit)
        at = self.design.trends.along(self.design.predicted(names, fit)[0])
        return lambda rows, again: trend(at + sd * self._errors_along[rows], again)

    def fitted(self, y: np.ndarray) -> tuple[BestFit, dict[Names, BestFit]]:
        """Fits of the baseline and of every cause of the list."""
        names = self.design.listed
        null, *singles = self.design.fits([(), *names], self.design.turned(y), residuals=True)
        return null, dict(zip(names, singles, strict=True))

    def gate(self, y: np.ndarray) -> Verdict:
        """Whether the baseline is enough, the data scatter more than stated, or neither.

        The verdict is "none", "scatter", or "unexplained" so far. Scatter is said where it alone is too large: no cause
        takes more of it away than chance would (the guard), and no trend is seen.

        Parameters
        ----------
        y : log measured values per row, in units of the noise, shape (n,)
        """
        null, singles = self.fitted(y)
        tally, critical = self._gated(null, singles)
        p = {name: tally.p(name) for name in tally.observed}
        trend = self.design.trends.best(null.residuals)
        seen = trend if trend is not None and p["shape"] < TOLD else None
        fired = {name for name in GATE if name in p and tally.rejected(name)}
        kind = VerdictKind.UNEXPLAINED
        if not fired:
            kind = VerdictKind.NONE
        elif "scatter" in fired and not tally.rejected("guard") and p["shape"] >= self.rule.guard:
            kind = VerdictKind.SCATTER
        best, base = max(float(f.loglik[0]) for f in singles.values()), float(null.loglik[0])
        tested = {names: self._tested(names, fit, base, best) for names, fit in singles.items()}
        covariate, shape = (seen.covariate, seen.kind) if seen else (None, None)
        return Verdict(
            kind=kind, causes=(), pairs=(), covariate=covariate, trend=shape, p=p, critical_gain=critical,
            tested=tested, null=null,
        )

    def alarm(self, y: np.ndarray, unstated: tuple[str, ...]) -> Verdict:
        """The verdict of the gate, where an alarm must outlast noise shared unstated.

        Half of the noise's variance is taken as shared by the tests that the best cause acts on. Let g be the groups of
        specimens that the cause with the largest gain acts on much and little, and C the correlation carried so far.
        Gain and trend are tested again with the correlation C / 2 + same_g / 2. So is the scatter within the groups,
        which no share makes larger. What fired at the gate must fire again, else the verdict is "none".

        Parameters
        ----------
        y : log measured values per row, in units of the noise, shape (n,)
        unstated : circumstances of the tests that no column tells

        Notes
        -----
        Which tests share a batch, a day or a rig is not known; those that one cause acts on are the grouping that
        imitates it best. Wrong, and too cautious, where tests have nothing in common. A cause that acts on its
        specimens by more than one size is still seen by that.
        """
        verdict = self.gate(y)
        if verdict.kind == VerdictKind.NONE or not unstated:
            return verdict
        design, rule = self.design, self.rule
        names = max(verdict.tested, key=lambda n: verdict.tested[n].gain)  # the best cause
        effect = design.effect(names, verdict.tested[names].fit)
        groups = same(two_groups_by_effect(design.apart(effect) * design.scale))
        correlation = (1.0 - PLAUSIBLE) * design.correlation + PLAUSIBLE * groups
        p = dict(ConfidenceSet(design.sharing(correlation), self.draws, rule).gate(y).p)
        if "scatter" in verdict.p:
            p["scatter"] = self._scatter_within_groups(verdict.null, groups)
        limits = {"gain": rule.gain, "shape": rule.shape, "scatter": rule.scatter}
        holds = any(verdict.p[k] < v and p[k] < v for k, v in limits.items() if k in verdict.p)
        doubt = Doubt(names=names, unstated=unstated, p={k: p[k] for k in limits if k in p}, holds=holds)
        return replace(verdict, doubt=doubt, kind=verdict.kind if holds else VerdictKind.NONE)

    def _scatter_within_groups(self, null: BestFit, groups: np.ndarray) -> float:
        """Share of draws that scatter about the groups' means as the data do.

        Parameters
        ----------
        null : fit of the baseline to the data
        groups : 1 where two specimens are of one group, else 0, shape (n, n)
        """
        y, z, replicate = self.drawn((), null)
        inside = np.eye(self.design.n) - groups / groups.sum(axis=1)

        def within(fit: BestFit, replicate: np.ndarray) -> np.ndarray:
            """Statistic of the scatter about the means of the groups, shape (b,)."""
            return self._scatter(((self.design.apart(fit.residuals) @ inside) ** 2).sum(axis=1), replicate)

        drawn = within(self.design.fit((), y, z, replicate), replicate)
        return share_of(drawn >= float(within(null, np.ones(1))[0]))

    def explained(self, y: np.ndarray, verdict: Verdict, pairs: bool = True) -> Verdict:
        """What explains an alarm: the causes that are not rejected, else the pairs.

        The verdict is conditional on the list. The p of a kept cause means "not rejected", no more.

        Parameters
        ----------
        y : data, which the gate may have seen with other shares of the noise
        verdict : of the gate; what is no alarm, or scatter, stays as it is
        pairs : whether pairs of causes are tried when no single one is left
        """
        if verdict.kind != VerdictKind.UNEXPLAINED:
            return verdict
        null, singles = self.fitted(y)
        tested = self._confidence_set(singles, float(null.loglik[0]))
        verdict = replace(verdict, tested=tested, null=null)
        if kept := _ranked(tested):
            kind = VerdictKind.CAUSE if len(kept) == 1 else VerdictKind.EITHER
            return replace(verdict, kind=kind, causes=tuple(k[0] for k in kept))
        return self.with_pairs(y, verdict) if pairs else verdict

    def with_pairs(self, y: np.ndarray, verdict: Verdict) -> Verdict:
        """A verdict without any single cause left, with the pairs that the data keep."""
        names = self.design.pair_names
        if not names:
            return verdict
        found = self.design.fits(names, self.design.turned(y), residuals=True)
        both = self._confidence_set(dict(zip(names, found, strict=True)), float(verdict.null.loglik[0]))
        kept = tuple(_ranked(both))
        return replace(
            verdict, kind=VerdictKind.TWO if kept else VerdictKind.UNEXPLAINED, causes=kept[0] if kept else (),
            pairs=kept, tested={**verdict.tested, **both}, tried_pairs=True,
        )

    def _confidence_set(self, found: Mapping[Names, BestFit], base: float) -> dict[Names, Tested]:
        """Hold every explanation against the data under its own fit.

        Data are drawn from its own fit, and fitted again by all explanations. It is kept when two things are usual
        among them: its residuals (trend, scatter), and its log-likelihood deficit against the best of ``found``.

        Parameters
        ----------
        found : fit of every explanation to the data, all of one kind (causes, or pairs)
        base : log-likelihood of the baseline
        """
        best = max(float(f.loglik[0]) for f in found.values())
        out = {}
        for names, fit in found.items():
            tested = self._tested(names, fit, base, best)
            p, used = dict[str, float](), 0
            # single causes get their p even where they are far off, unless the rule screens them as it does pairs
            kept = (len(names) == 1 and not self.rule.screen) or not self._hopeless(fit, tested.deficit)
            if kept:
                own = self._residual_tally(names, fit)
                p, used = {name: own.p(name) for name in own.observed}, own.draws
                kept = not any(own.rejected(name) for name in own.observed)
            if kept and len(found) > 1:
                rival = self._deficit(names, fit, tested.deficit, found)
                p["deficit"], used = rival.p("deficit"), max(used, rival.draws)
                kept = not rival.rejected("deficit")
            out[names] = replace(tested, kept=kept, p=p, draws=used)
        return out

    def _tested(self, names: Names, fit: BestFit, base: float, best: float) -> Tested:
        """A fit beside the baseline and the best of its kind: not tested, so not kept yet.

        Parameters
        ----------
        names, fit : the explanation, and its fit to the data
        base : log-likelihood of the baseline
        best : log-likelihood of the best explanation of its kind
        """
        grid, value = self.design.grid(names), float(fit.loglik[0])
        sizes, z = (tuple(float(v) for v in at(fit.position)[0]) for at in (grid.sizes_at, grid.z_at))
        return Tested(
            names=names, kept=False, sizes=sizes, z=z, gain=value - base, deficit=best - value, p={}, draws=0, fit=fit,
        )

    def _gated(self, null: BestFit, singles: Mapping[Names, BestFit]) -> tuple[Tally, float]:
        """Statistics of the gate among draws from the baseline, and the critical gain.

        That is the gain of log-likelihood over the whole list that noise alone reaches with probability ``rule.gain``.

        Parameters
        ----------
        null : fit of the baseline to the data
        singles : fits of every cause alone to them
        """
        rule, shape = self.rule, self.design.trends.statistic(null.residuals)
        observed = self._statistics(null, list(singles.values()), np.ones(1), shape)
        thresholds = {"gain": rule.gain, "shape": rule.shape, "scatter": rule.scatter, "guard": rule.guard}
        tally = Tally({k: float(v[0]) for k, v in observed.items()}, thresholds)
        gains: list[np.ndarray] = []  # of log-likelihood, of the draws so far: ``draw`` adds them
        trend_drawn = self._trend_drawn((), null)

        def draw(rows: slice) -> dict[str, np.ndarray]:
            """The statistics of some of the draws."""
            y, z, replicate = self.drawn((), null, rows)
            base, *again = self.design.fits([(), *singles], y, z, replicate)
            drawn = self._statistics(base, again, replicate, trend_drawn(rows, base))
            gains.append(drawn["gain"])
            return drawn

        def enough(t: Tally) -> bool:
            """Whether more draws would not change the gate: quiet, or a settled alarm.

            An alarm by scatter alone is also held against the guard, which needs half of all draws at least.
            """
            gate = [name for name in GATE if name in t.observed]
            quiet = all(t.settled(name) and not t.rejected(name) for name in gate)
            loud = any(t.settled(name) and t.rejected(name) for name in gate)
            if not loud or "scatter" not in gate:
                return quiet or loud
            scatter_out = t.settled("scatter") and not t.rejected("scatter")
            trended = t.settled("shape") and t.rejected("shape")
            return scatter_out or trended or (t.settled("guard") and t.draws >= rule.draws // 2)

        add_draws(tally, draw, enough, self.count, min(GATE_DRAWS, self.count))
        return tally, float(np.quantile(np.concatenate(gains), 1.0 - rule.gain))

    def _statistics(
        self, null: BestFit, singles: Sequence[BestFit], replicate: np.ndarray, shape: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Statistics of the gate for fits of the baseline and of every cause.

        They are the largest gain of a cause, the trend ``shape`` as given, the scatter, and the guard: by how much the
        best cause reduces the scatter. Each has one value a data set.

        Parameters
        ----------
        null : fits of the baseline
        singles : fits of every cause alone
        replicate : variance of the replicates over the stated one, of every data set, shape (b,)
        """
        best = np.max([f.loglik for f in singles], axis=0)
        out = {"gain": best - null.loglik, **self._residuals(null, replicate, shape)}
        if "scatter" in out:
            total = np.min([f.loss + f.penalty for f in singles], axis=0)
            least = 1e-12  # keeps the ratio finite for data that a model fits exactly
            ratio = np.maximum(null.loss + null.penalty, least) / np.maximum(total, least)
            out["guard"] = 0.5 * self.design.n * np.log(ratio)
        return out

    def _residuals(self, fit: BestFit, replicate: np.ndarray, shape: np.ndarray) -> dict[str, np.ndarray]:
        """Trend of the residuals of fits, and scatter where it is held against noise."""
        out = {"shape": shape}
        if self.design.like.kind != "unknown":
            out["scatter"] = self._scatter(fit.loss + fit.penalty, replicate)
        return out

    def _scatter(self, loss: np.ndarray, replicate: np.ndarray) -> np.ndarray:
        """Statistic of "more scatter than stated": loss over the replicate variance."""
        return loss / replicate if self.design.like.kind == "replicates" else loss

    def _hopeless(self, fit: BestFit, deficit: float) -> bool:
        """Whether an explanation is so far off that it is rejected without a bootstrap.

        That is by a log-likelihood deficit, or by nominal tail probabilities of trend and scatter far below those of
        the bootstrap: ``rule.hopeless`` and ``rule.hopeless_tail``.

        Parameters
        ----------
        fit : of the explanation to the data
        deficit : log-likelihood below the best explanation of its kind
        """
        design, tail = self.design, self.rule.hopeless_tail
        if deficit >= self.rule.hopeless:
            return True
        # minus the log of the least tail of all trends, by Bonferroni over their number
        if float(design.trends.statistic(fit.residuals)[0]) > np.log(max(len(design.trends), 1) / tail):
            return True
        # under known noise the loss is chi-squared, with a term for each measured input
        loss = float(fit.loss[0] + fit.penalty[0])
        return design.like.known and float(chdtrc(design.n + design.inputs, loss)) < tail

    def _residual_tally(self, names: Names, fit: BestFit) -> Tally:
        """Trend and scatter of the residuals under the explanation's own fit."""
        thresholds = {"shape": self.rule.kept_shape, "scatter": self.rule.kept_scatter}
        observed = self._residuals(fit, np.ones(1), self.design.trends.statistic(fit.residuals))
        tally, trend = Tally({k: float(v[0]) for k, v in observed.items()}, thresholds), self._trend_drawn(names, fit)

        def draw(rows: slice) -> dict[str, np.ndarray]:
            """The statistics of the residuals of some of the draws."""
            y, z, replicate = self.drawn(names, fit, rows)
            again = self.design.fits([names], y, z, replicate)[0]
            return self._residuals(again, replicate, trend(rows, again))

        def enough(t: Tally) -> bool:
            """Whether every statistic is settled, or one that rejects is."""
            done = [t.settled(name) for name in t.observed]
            return all(done) or any(d and t.rejected(name) for d, name in zip(done, t.observed, strict=True))

        return add_draws(tally, draw, enough, self.count)

    def _deficit(self, names: Names, fit: BestFit, observed: float, rivals: Iterable[Names]) -> Tally:
        """Log-likelihood deficit against the best rival, on draws from the own fit.

        Parameters
        ----------
        names, fit : the explanation, and its fit to the data
        observed : deficit of the data
        rivals : explanations that it is held against
        """
        tally = Tally({"deficit": observed}, {"deficit": self.rule.deficit})
        if observed <= 0.0:  # the best itself: every draw reaches a deficit of 0
            tally.reached, tally.draws = {"deficit": 1}, 1
            return tally
        near, least = self._near(names, fit, rivals), tally.least("deficit")

        def draw(rows: slice) -> dict[str, np.ndarray]:
            """The deficit of some of the draws."""
            y, z, replicate = self.drawn(names, fit, rows)
            own = self.design.fits([names], y, z, replicate)[0].loglik
            out = np.zeros(len(y))
            start, stop = 0, RIVALS
            while start < len(near):  # nearest first: a draw that has reached the observed deficit is done
                left = np.flatnonzero(out < least)
                if not len(left):
                    break
                again = self.design.fits(near[start:stop], y[left], z[left], replicate[left])
                out[left] = np.maximum(out[left], np.max([f.loglik for f in again], axis=0) - own[left])
                start, stop = stop, stop + 2 * (stop - start)
            return {"deficit": out}

        return add_draws(tally, draw, lambda t: t.settled("deficit"), self.count)

    def _near(self, names: Names, fit: BestFit, rivals: Iterable[Names]) -> list[Names]:
        """Rivals that can pass for an explanation, nearest first, up to ``rule.far``.

        Their distance is 0.5 (loss / sd^2 + penalty) of the fit to what the explanation predicts exactly.

        Parameters
        ----------
        names, fit : the explanation, and its fit to the data
        rivals : explanations that may pass for it; itself is left out
        """
        design, others = self.design, [r for r in rivals if r != names]
        if not others:
            return []
        y, z = design.predicted(names, fit), design.grid(names).z_at(fit.position)
        sd = design.noise_of(names, fit)
        # the likelihood of a noise that is as good as known
        like = Likelihood() if design.like.known else Likelihood("replicates", AS_IF_KNOWN)
        found = design.fits(others, y, z, sd**2, like=like)
        apart = [0.5 * float(f.loss[0] / sd**2 + f.penalty[0]) for f in found]
        return [others[i] for i in np.argsort(apart, kind="stable") if apart[i] <= self.rule.far]


def _ranked(tested: Mapping[Names, Tested]) -> list[Names]:
    """Explanations that are kept, best first."""
    return sorted((n for n, t in tested.items() if t.kept), key=lambda n: tested[n].deficit)
