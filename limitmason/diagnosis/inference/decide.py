"""The rule: a gate for "none", a guard for scatter, and a bootstrap confidence set of causes, then of pairs."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from limitmason.diagnosis.inference.bootstrap import DRAWS, Drawn, Draws, Tally, run
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.fit import Fit
from limitmason.diagnosis.inference.noise import Likelihood
from limitmason.diagnosis.inference.verdict import Tested, Verdict, VerdictKind

GATE_DRAWS = 699  # fewest: the critical gain is a quantile of them
RIVALS = 4  # refitted to a draw at first, then twice as many more at a time
SURE = 1e6  # degrees of freedom of a noise that is as good as known


@dataclass(frozen=True)
class Rule:
    """Thresholds on bootstrap p.

    Parameters
    ----------
    gain, shape, scatter : the gate: below any of them the baseline is not enough
    guard : scatter with neither a scale-free gain nor a trend below this is "more scatter than stated"
    deficit, kept_shape, kept_scatter : a cause below any of them is rejected under its own fit
    hopeless : log-likelihood deficit at which a pair is rejected without bootstrap
    hopeless_tail : nominal tail probability of trend or scatter at which a pair is rejected without bootstrap
    far : log-likelihood by which a rival misses what an explanation predicts, beyond which it is not refitted to the
        data drawn from that explanation (a chance of less than 1e-7 a draw)
    screen : whether single causes that are hopeless are rejected without bootstrap as well
    draws : most draws
    identify : whether a name must be identified; without, whatever is the only one left is named
    margin : least log-likelihood by which a name must beat every smooth model discrepancy; 10 was set on pilot trials
    agreed : the same where two kinds of evidence show one size, unless trials with the true cause missing ask for more
    missing, each : largest share of data sets, with a cause that was taken off the list, in which any name, or one and
        the same name, is given; the margin is raised until it holds
    usual : a name that beats the discrepancies by less than this share of data drawn from it do, is not identified
    structure : a single name whose residuals show a model discrepancy as seldom as this is withdrawn
    asks : as seldom as this, and pairs are tried before it is given
    """

    gain: float = 0.03
    shape: float = 0.01
    scatter: float = 0.01
    guard: float = 0.05
    deficit: float = 0.02
    kept_shape: float = 0.005
    kept_scatter: float = 0.005
    hopeless: float = 15.0
    hopeless_tail: float = 1e-5
    far: float = 60.0
    screen: bool = False
    draws: int = DRAWS
    identify: bool = True
    margin: float = 10.0
    agreed: float = 4.0
    missing: float = 0.05
    each: float = 0.01
    usual: float = 0.02
    structure: float = 0.005
    asks: float = 0.10


def gate(design: Design, y: np.ndarray, draws: Draws, rule: Rule) -> Verdict:
    """Whether the baseline is enough ("none"), more scatter than stated is, or neither ("unexplained" so far).

    Parameters
    ----------
    design : tables of the design
    y : whitened data, shape (n,)
    draws : standard errors for the bootstrap
    rule : thresholds
    """
    z = np.zeros(design.inputs)
    null = design.fit((), y, z)
    names: list[Names] = [(c.name,) for c in design.causes]
    singles = dict(zip(names, design.fits(names, y, z, residuals=True), strict=True))
    tally, critical = _gate(design, null, singles, draws, rule)
    p = {name: tally.p(name) for name in tally.observed}
    trend = design.shapes.best(null.residuals)
    seen = trend if trend is not None and p["shape"] < 0.05 else None
    fired = {name for name in ("gain", "shape", "scatter") if name in p and tally.rejected(name)}
    kind = VerdictKind.UNEXPLAINED
    if not fired:
        kind = VerdictKind.NONE
    elif "scatter" in fired and not tally.rejected("guard") and p["shape"] >= rule.guard:
        kind = VerdictKind.SCATTER
    tested = _untested(design, singles, float(null.loglik[0]))
    covariate, shape = (seen.covariate, seen.kind) if seen else (None, None)
    return Verdict(kind, (), (), covariate, shape, p, critical, tested, null)


def explained(design: Design, y: np.ndarray, verdict: Verdict, draws: Draws, rule: Rule, pairs: bool = True) -> Verdict:
    """What explains an alarm: the causes that are not rejected, else the pairs.

    Parameters
    ----------
    design : tables; their noise may be shared otherwise than at the gate
    y, draws, rule : as for :func:`gate`
    verdict : of the gate; what is no alarm, or scatter, stays as it is
    pairs : whether pairs of causes are tried when no single one is left

    Notes
    -----
    The verdict is conditional on the list. The p of a kept cause means "not rejected", no more.
    """
    if verdict.kind != VerdictKind.UNEXPLAINED:
        return verdict
    z = np.zeros(design.inputs)
    null = design.fit((), y, z)
    names: list[Names] = [(c.name,) for c in design.causes]
    singles = dict(zip(names, design.fits(names, y, z, residuals=True), strict=True))
    tested = confidence_set(design, singles, float(null.loglik[0]), draws, rule)
    kept = _ranked(tested)
    verdict = replace(verdict, tested=tested, null=null)
    if kept:
        kind = VerdictKind.CAUSE if len(kept) == 1 else VerdictKind.EITHER
        return replace(verdict, kind=kind, causes=tuple(k[0] for k in kept))
    return with_pairs(design, y, verdict, draws, rule) if pairs else verdict


def with_pairs(design: Design, y: np.ndarray, verdict: Verdict, draws: Draws, rule: Rule) -> Verdict:
    """The verdict after pairs of causes are held against the data: those that are kept, or "unexplained".

    Parameters
    ----------
    verdict : in which no single cause is left
    """
    if not design.pair_names:
        return verdict
    names = design.pair_names
    fits = dict(zip(names, design.fits(names, y, np.zeros(design.inputs), residuals=True), strict=True))
    both = confidence_set(design, fits, float(verdict.null.loglik[0]), draws, rule)
    kept = tuple(_ranked(both))
    kind = VerdictKind.TWO if kept else VerdictKind.UNEXPLAINED
    causes = kept[0] if kept else ()
    tested = {**verdict.tested, **both}
    return replace(verdict, kind=kind, causes=causes, pairs=kept, tested=tested, tried_pairs=True)


def confidence_set(
    design: Design, fits: dict[Names, Fit], base: float, draws: Draws, rule: Rule
) -> dict[Names, Tested]:
    """Hold every explanation against the data under its own fit.

    Parameters
    ----------
    fits : fit of every explanation to the data, all of one kind (causes, or pairs)
    base : log-likelihood of the baseline

    Returns
    -------
    dict
        By names. An explanation is kept when neither its residuals (trend, scatter) nor its log-likelihood deficit
        against the best of ``fits`` is unusual among data drawn from its own fit and fitted again by all of them.
    """
    best = max(float(f.loglik[0]) for f in fits.values())
    out = {}
    for names, fit in fits.items():
        deficit = best - float(fit.loglik[0])
        grid = design.grid(names)
        p: dict[str, float] = {}
        used = 0
        kept = (len(names) == 1 and not rule.screen) or not _hopeless(design, fit, deficit, rule)
        if kept:
            own = _adequate(design, names, fit, draws, rule)
            p = {name: own.p(name) for name in own.observed}
            used = own.draws
            kept = not any(own.rejected(name) for name in own.observed)
        if kept and len(fits) > 1:
            rival = _deficit(design, names, fit, deficit, tuple(fits), draws, rule)
            p["deficit"], used = rival.p("deficit"), max(used, rival.draws)
            kept = not rival.rejected("deficit")
        out[names] = Tested(
            names,
            kept,
            tuple(float(s) for s in grid.sizes_at(fit.position)[0]),
            tuple(float(s) for s in grid.z_at(fit.position)[0]),
            float(fit.loglik[0]) - base,
            deficit,
            p,
            used,
            fit,
        )
    return out


def _gate(design: Design, null: Fit, singles: dict[Names, Fit], draws: Draws, rule: Rule) -> tuple[Tally, float]:
    observed = _gate_statistics(design, null, list(singles.values()), np.ones(1))
    thresholds = {"gain": rule.gain, "shape": rule.shape, "scatter": rule.scatter, "guard": rule.guard}
    tally = Tally({k: float(v[0]) for k, v in observed.items()}, thresholds)
    gains: list[np.ndarray] = []

    def draw(rows: slice) -> dict[str, np.ndarray]:
        y, z, replicate = drawn_data(design, (), null, draws, rows)
        base = design.fit((), y, z, replicate)
        fits = design.fits(list(singles), y, z, replicate)
        drawn = _gate_statistics(design, base, fits, replicate)
        gains.append(drawn["gain"])
        return drawn

    def enough(t: Tally) -> bool:
        gate = [name for name in ("gain", "shape", "scatter") if name in t.observed]
        quiet = all(t.settled(name) and not t.rejected(name) for name in gate)
        loud = any(t.settled(name) and t.rejected(name) for name in gate)
        if not loud or "scatter" not in gate:
            return quiet or loud
        scatter_out = t.settled("scatter") and not t.rejected("scatter")
        trend = t.settled("shape") and t.rejected("shape")
        return scatter_out or trend or (t.settled("guard") and t.draws >= rule.draws // 2)

    count = min(rule.draws, len(draws.errors))
    run(tally, draw, enough, count, min(GATE_DRAWS, count))
    return tally, float(np.quantile(np.concatenate(gains), 1.0 - rule.gain))


def _gate_statistics(design: Design, null: Fit, fits: Sequence[Fit], replicate: np.ndarray) -> dict[str, np.ndarray]:
    best = np.max([f.loglik for f in fits], axis=0)
    out = {"gain": best - null.loglik, "shape": design.shapes.statistic(null.residuals)}
    if design.like.scale_known:
        out["scatter"] = design.like.scatter(null.loss, null.penalty, replicate)
        total = np.min([f.loss + f.penalty for f in fits], axis=0)
        least = 1e-12  # keeps the ratio finite for data that a model fits exactly
        out["guard"] = 0.5 * design.n * np.log(np.maximum(null.loss + null.penalty, least) / np.maximum(total, least))
    return out


def _hopeless(design: Design, fit: Fit, deficit: float, rule: Rule) -> bool:
    """Whether an explanation is so far off that a nominal tail probability is enough to reject it."""
    if deficit >= rule.hopeless:
        return True
    trends = max(len(design.shapes), 1)
    if float(design.shapes.statistic(fit.residuals)[0]) > np.log(trends / rule.hopeless_tail):
        return True
    loss = float(fit.loss[0] + fit.penalty[0])
    return design.like.quadratic and float(chdtrc(design.n + design.inputs, loss)) < rule.hopeless_tail


def drawn_data(design: Design, names: Names, fit: Fit, draws: Draws, rows: slice) -> Drawn:
    """Values, measured inputs and replicate variances drawn from a fitted explanation."""
    z = design.grid(names).z_at(fit.position)[0]
    return draws.data(design.predicted(names, fit)[0], z, noise_of(design, names, fit), rows)


def noise_of(design: Design, names: Names, fit: Fit) -> float:
    """Noise of the draws from a fitted explanation, in stated units."""
    squares = float((fit.residuals[0] ** 2).sum())
    return float(np.sqrt(design.like.variance(squares, design.n, 1.0, len(names))))


def _adequate(design: Design, names: Names, fit: Fit, draws: Draws, rule: Rule) -> Tally:
    """Trend and scatter of the residuals under the explanation's own fit."""

    def statistics(f: Fit, replicate: np.ndarray) -> dict[str, np.ndarray]:
        out = {"shape": design.shapes.statistic(f.residuals)}
        if design.like.scale_known:
            out["scatter"] = design.like.scatter(f.loss, f.penalty, replicate)
        return out

    def draw(rows: slice) -> dict[str, np.ndarray]:
        y, z, replicate = drawn_data(design, names, fit, draws, rows)
        return statistics(design.fit(names, y, z, replicate), replicate)

    thresholds = {"shape": rule.kept_shape, "scatter": rule.kept_scatter}
    tally = Tally({k: float(v[0]) for k, v in statistics(fit, np.ones(1)).items()}, thresholds)

    def enough(t: Tally) -> bool:
        done = [t.settled(name) for name in t.observed]
        return all(done) or any(d and t.rejected(name) for d, name in zip(done, t.observed, strict=True))

    return run(tally, draw, enough, min(rule.draws, len(draws.errors)))


def _deficit(
    design: Design, names: Names, fit: Fit, observed: float, rivals: Iterable[Names], draws: Draws, rule: Rule
) -> Tally:
    """Log-likelihood deficit against the best rival, on data drawn from the explanation's own fit."""
    tally = Tally({"deficit": observed}, {"deficit": rule.deficit})
    if observed <= 0.0:  # the best itself: every draw reaches a deficit of 0
        tally.reached, tally.draws = {"deficit": 1}, 1
        return tally
    near = _near(design, names, fit, rivals, rule)
    least = tally.least("deficit")

    def draw(rows: slice) -> dict[str, np.ndarray]:
        y, z, replicate = drawn_data(design, names, fit, draws, rows)
        own = design.fits([names], y, z, replicate)[0].loglik
        out = np.zeros(len(y))
        start, stop = 0, RIVALS
        while start < len(near):  # nearest first: a draw that has reached the observed deficit is done
            left = np.flatnonzero(out < least)
            if not len(left):
                break
            fits = design.fits(near[start:stop], y[left], z[left], replicate[left])
            out[left] = np.maximum(out[left], np.max([f.loglik for f in fits], axis=0) - own[left])
            start, stop = stop, stop + 2 * (stop - start)
        return {"deficit": out}

    return run(tally, draw, lambda t: t.settled("deficit"), min(rule.draws, len(draws.errors)))


def _near(design: Design, names: Names, fit: Fit, rivals: Iterable[Names], rule: Rule) -> list[Names]:
    """Rivals that can pass for an explanation, nearest first, by how well they fit what it predicts without errors."""
    others = [r for r in rivals if r != names]
    if not others:
        return []
    y, z = design.predicted(names, fit), design.grid(names).z_at(fit.position)
    if design.like.tails is not None:  # a large error counts for less: so does a distance
        apart = [0.25 * float(f.loss[0] + f.penalty[0]) for f in design.fits(others, y, z)]
    else:
        sd = noise_of(design, names, fit)
        # the likelihood of a noise that is as good as known
        like = Likelihood() if design.like.kind == "known" else Likelihood("replicates", SURE)
        fits = design.fits(others, y, z, sd**2, like=like)
        apart = [0.5 * float(f.loss[0] / sd**2 + f.penalty[0]) for f in fits]
    return [others[i] for i in np.argsort(apart, kind="stable") if apart[i] <= rule.far]


def _untested(design: Design, fits: dict[Names, Fit], base: float) -> dict[Names, Tested]:
    """Fits of all causes without a test, for the tables of a verdict that names none."""
    best = max(float(f.loglik[0]) for f in fits.values())
    out = {}
    for names, fit in fits.items():
        grid = design.grid(names)
        sizes = tuple(float(s) for s in grid.sizes_at(fit.position)[0])
        z = tuple(float(s) for s in grid.z_at(fit.position)[0])
        value = float(fit.loglik[0])
        out[names] = Tested(names, False, sizes, z, value - base, best - value, {}, 0, fit)
    return out


def _ranked(tested: dict[Names, Tested]) -> list[Names]:
    return sorted((n for n, t in tested.items() if t.kept), key=lambda n: tested[n].deficit)
