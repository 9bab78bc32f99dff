"""Whether a name is identified: told from every model discrepancy, by two kinds of evidence or along a dose."""

import numpy as np

from limitmason.diagnosis.inference.decide import Decision
from limitmason.diagnosis.inference.design import Names
from limitmason.diagnosis.inference.discrepancy import Rivals, as_gaussian
from limitmason.diagnosis.inference.fit import BestFit, Likelihood
from limitmason.diagnosis.inference.gain import left_out, log_score
from limitmason.diagnosis.inference.kinds import agree, by_kind
from limitmason.diagnosis.inference.trends import is_numeric
from limitmason.diagnosis.inference.verdict import CONDITIONS, Identification, Verdict

DRAWN = 699  # data sets drawn from the explanation: its own distribution of the excess
SURE = 3.0  # standard errors by which the slope along its own contrast must differ from 0, and at most from 1
LEVER = 2.0  # log-likelihood by which a name must beat every listed lever with another dependence


def identification(
    decision: Decision, verdict: Verdict, y: np.ndarray, rivals: Rivals, margin: float, folds: np.ndarray
) -> Identification:
    """Hold the one explanation of a verdict against every model discrepancy.

    Parameters
    ----------
    decision : design, draws and rule of the verdict
    y : whitened data, per specimen, shape (n,)
    rivals : discrepancies of the design
    margin : by how much it must beat them
    folds : number of the group of each specimen, left out together, shape (n,)
    """
    design, rule, names = decision.design, decision.rule, verdict.kept[0]
    fit, data = verdict.tested[names].fit, design.turned(y)
    sd = design.noise_of(names, fit)
    discrepancy, parts = rivals.of(names), rivals.parts(names, fit)
    like, drawn_in, (value,) = as_gaussian(design.like, fit, data[None])
    nearest = discrepancy.best(drawn_in, like)
    levers, rival, beyond = rivals.levers(names), "", np.inf
    if levers.along:
        each = levers.each(drawn_in, like)[0]
        rival, beyond = levers.along[int(each.argmax())], float(value) - float(each.max())
    # the same statistics for data drawn from the explanation itself
    rows = slice(0, min(DRAWN, decision.count))
    drawn, z, replicate = decision.drawn(names, fit, rows)
    again = design.fit(names, drawn, z, replicate)
    # the inputs' own data are part of the draw: what the fit leaves of them is a shift of the values to first order
    shifted = drawn - z @ (rivals.slopes * rivals.sd).T
    observed = float(rivals.excess(names, fit, data, parts=parts)[0])
    over = rivals.excess(names, again, shifted, replicate, parts)
    left, more = float(rivals.structure(names, fit)[0]), rivals.structure(names, again, replicate)
    p = _share(over <= observed)
    slope, error = _dose(rivals, names, fit, drawn_in[0], sd)
    kinds = by_kind(design, names, fit, verdict.null, y, sd)
    together = len(names) == 1 and agree(kinds)
    if together and margin <= rule.margin:
        margin = rule.agreed
    doses = any(is_numeric(design.columns[c]) for c in design.own(names) if c in design.columns)
    # log score of values left out: explanation, baseline, and the nearest bias
    own, base = (left_out(design, n, data, folds)[0] for n in (names, ()))
    miss, spread = discrepancy.left_out(nearest, data, folds)
    by_fold = np.bincount(folds, weights=own - log_score(design, miss, spread * sd**2))
    ahead = float(by_fold.sum())
    ahead_error = float(np.sqrt(len(by_fold)) * by_fold.std(ddof=1)) if len(by_fold) > 1 else 0.0
    holds = {
        "lever": float(np.median(over)) >= margin,
        "dose": slope >= SURE * error and abs(slope - 1.0) <= SURE * error,
        "excess": observed >= margin,
        "usual": p >= rule.usual,
        "left out": float(np.sum(own - base)) > 0.0 and ahead + ahead_error >= 0.0,
        "rival levers": beyond >= LEVER,
        "kinds": together or (len(names) == 1 and doses and not any(k.absent for k in kinds)),
    }
    return Identification(
        names=names,
        missing=tuple(name for name in CONDITIONS if not holds[name]),
        along=discrepancy.along[nearest],
        excess=observed,
        margin=margin,
        expected=float(np.median(over)),
        chance=float(np.mean(over >= margin)),
        p=p,
        slope=slope,
        slope_error=error,
        ahead=ahead,
        ahead_error=ahead_error,
        structure=_share(more >= left),
        kinds=kinds,
        rival=rival,
        rival_excess=beyond,
    )


def _dose(rivals: Rivals, names: Names, fit: BestFit, data: np.ndarray, sd: float) -> tuple[float, float]:
    """Share of the fitted effect along the contrast that no bias takes away, and its standard error."""
    discrepancy, slopes = rivals.of(names), rivals.slopes
    effect = rivals.design.effect(names, fit)
    contrast = discrepancy.weights[discrepancy.best(effect / sd, Likelihood())] @ effect
    reach = float(contrast @ effect)
    if reach <= 0.0:
        return 0.0, float("inf")
    spread = np.eye(len(slopes)) + slopes @ slopes.T
    return float(contrast @ data) / reach, sd * float(np.sqrt(contrast @ spread @ contrast)) / reach


def _share(reached: np.ndarray) -> float:
    """Bootstrap p of a statistic, from which draws reached it."""
    return float((1.0 + np.count_nonzero(reached)) / (1.0 + len(reached)))
