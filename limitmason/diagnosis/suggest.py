"""Which specimens of a pool to test next, from a verdict or a list of causes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from limitmason.checks import count
from limitmason.diagnosis.cause_tables import PoolGrids
from limitmason.diagnosis.inference import identifying_tests, next_tests
from limitmason.diagnosis.inference.design import Design, Names
from limitmason.diagnosis.inference.discrepancy import Discrepancy
from limitmason.diagnosis.inference.grid import Grid, at_measured
from limitmason.diagnosis.inference.trends import ROWS, is_numeric
from limitmason.diagnosis.inference.verdict import Tested
from limitmason.diagnosis.result import Findings
from limitmason.diagnosis.specimens import recorded
from limitmason.errors import InputError

_NEAREST = 8
"""Most pairs that a kept pair is held against, those that fit best: chosen, it bounds the work."""


def suggest(
    design: Design, there: PoolGrids, pool: Sequence[Any], k: int, diagnosis: Findings | None,
    costs: Mapping[str, float],
) -> next_tests.NextTests:
    """Choose ``k`` specimens of the pool.

    What they are for goes by what is left: members of a set of causes (or pairs) are separated; an identified cause is
    held against every other of the list; of one that is not identified the contrast is shown that only it makes. With
    none left the whole list is separated, at visible sizes. An unexplained trend asks for specimens from end to end of
    its covariate, evenly spaced in rank. More scatter than was stated asks for any repeats. Costs count in neither.

    Parameters
    ----------
    design : tables of the tested specimens, with a known noise
    there : grids on the pool with the nodes of those of the design, by names of causes
    pool : specimens that could be tested, as ``simulate`` takes them
    k : how many, at most the size of the pool
    diagnosis : verdict so far, or None
    costs : of a test by what is measured in it; 1 where it is not told: what is chosen gains most for its cost

    Returns
    -------
    next_tests.NextTests
        The specimens, and where causes are told apart how well they are before and after these tests.

    Raises
    ------
    InputError
        For an empty pool, more tests than the pool holds, or a cost that is not positive.
    """
    pool, k = list(pool), count("k", k, least=0)
    if not 1 <= k <= len(pool):
        raise InputError(f"k must lie between 1 and the size of the pool ({len(pool)}), got {k}")
    price = np.array([float(costs.get(q, 1.0)) for q in there.rows.quantities])
    if not (price > 0.0).all():
        raise InputError(f"costs must be positive, got {dict(costs)}")
    verdict = diagnosis.verdict if diagnosis is not None else None
    if verdict is not None and verdict.kind in ("unexplained", "scatter"):
        return _spread(design, verdict.covariate if verdict.kind == "unexplained" else None, pool, k)
    if diagnosis is not None and diagnosis.kind == "behaves like":
        return _identify(design, there, pool, k, diagnosis, price)
    truths, pairs, reason = _hypotheses(design, there, diagnosis)
    rivals = dict.fromkeys(rival for _, rival in pairs)
    grids = {names: (design.grid(names).denser(), there[names].denser()) for names in rivals}
    chosen, before, after = next_tests.choose_tests(truths, grids, pairs, k, price=price)
    found = _tests(there, chosen, pool, reason, price)
    return replace(
        found, pairs=tuple((" + ".join(a), " + ".join(b)) for a, b in pairs), before=float(before.min()),
        after=float(after.min()),
        chance=(next_tests.chance_of_verdict(before, pairs), next_tests.chance_of_verdict(after, pairs)),
        worth=identifying_tests.equivalent_tests(*next_tests.apart(truths, grids, pairs), there.rows.quantities),
    )


def _identify(
    design: Design, there: PoolGrids, pool: list[Any], k: int, diagnosis: Findings, price: np.ndarray
) -> next_tests.NextTests:
    """Next tests by which one explanation most exceeds what covariates could do.

    Parameters
    ----------
    design, diagnosis : tables of the tested specimens, and what was found on them
    there, pool, k, price : tables of the pool, its specimens, number of tests, and cost of every row, shape (rows,)
    """
    names = diagnosis.kept[0]
    fit = diagnosis.verdict.tested[names].fit
    own = design.own(names)
    both: dict[str, list[Any]] = {}  # columns of tested rows and rows of the pool, where the pool records them
    for name, values in diagnosis.covariates.items():
        more = [recorded(pool[i], name) for i in there.rows.of]
        more = list(there.rows.quantities) if name == "quantity" else more
        if name not in own and all(v is not None for v in more):
            both[name] = [*values, *more]
    effect, slopes = [], []  # of tested rows, then of those of the pool, in units of the noise
    for null, grid in ((design.null, design.grid(names)), (there[()], there[names])):
        effect.append(grid.effect(null, fit.node, fit.position))
        slopes.append(null.slopes)
    scale = np.concatenate([design.scale, there.scale])
    slopes_of_both = np.concatenate(slopes)
    rivals = Discrepancy.of(both, scale, slopes_of_both)
    found = identifying_tests.tests_that_identify(rivals, slopes_of_both, np.concatenate(effect), design.n, k, price)
    # a column along which the explanation has its own dose, and those within one kind of data, are not missed
    lost = [c for c in diagnosis.covariates if c not in both and c not in own and design.recorded_as(c) == c]
    told = f"; the pool does not say its {', '.join(lost)}" if lost else ""
    asked = diagnosis.identification.margin if diagnosis.identification is not None else 0.0
    reason = (
        f"to identify {' + '.join(names)}, against all that goes with the covariates (expected excess "
        f"{found.before:.1f} now, {found.after:.1f} with them, {asked:.1f} asked{told})"
    )
    # the excess is half the square of a distance, which noise moves by one standard deviation
    d = np.sqrt(2.0 * np.maximum([found.before, found.after], 0.0))
    low, high = (float(v) for v in ndtr(d - np.sqrt(2.0 * asked)))
    # tests of a quantity that one of the best quantity is worth, by what its best specimen adds to the excess
    best = {q: float(found.each[[r == q for r in there.rows.quantities]].max()) for q in there.rows.needed}
    top = max(best.values())
    compared = best.items() if top > 0.0 else ()
    worth = {q: float(np.ceil(top / v)) if v > top / next_tests.MANY else np.inf for q, v in compared}
    return replace(_tests(there, found.chosen, pool, reason, price), chance=(low, high), worth=worth)


def _tests(
    there: PoolGrids, chosen: Sequence[int], pool: list[Any], reason: str, price: np.ndarray
) -> next_tests.NextTests:
    """Rows of a pool as specimens to be tested next, with quantities if several.

    Parameters
    ----------
    there, pool : tables of the pool, and its specimens
    chosen : rows of the pool
    reason : why these, in words
    price : cost of every row, shape (rows,)
    """
    rows = there.rows
    indices = tuple(int(rows.of[i]) for i in chosen)
    several = chosen if rows.several else ()
    return next_tests.NextTests(
        indices, tuple(pool[i] for i in indices), reason, quantities=tuple(rows.quantities[i] for i in several),
        costs=tuple(float(price[i]) for i in several),
    )


def _hypotheses(
    design: Design, there: Mapping[Names, Grid], diagnosis: Findings | None
) -> tuple[dict[Names, next_tests.Truth], list[tuple[Names, Names]], str]:
    """Explanations to be told apart: predictions, ordered pairs, and the reason.

    Several kept ones are told from one another. A single cause is held against every other of the list, or the
    baseline ``()`` where there is no other. A single pair is held against the pairs that fit best, or each of its
    causes where there is no other. With none kept all causes of the list are told apart, at visible sizes.

    Parameters
    ----------
    design, diagnosis : tables of the tested specimens, and what was found on them, or None
    there : tables of every explanation on the pool

    Returns
    -------
    truths, pairs, reason : predictions of every explanation; (true, rival); in words
    """
    if diagnosis is not None and diagnosis.kind in ("cause", "either", "two"):  # "behaves like": see _identify
        verdict = diagnosis.verdict
        kept = verdict.kept
        found = {n: _at_fit(design, there, n, verdict.tested[n]) for n in kept}
        if len(kept) > 1:
            reason = "to tell " + " from ".join(" + ".join(n) for n in kept[:4])
            return found, [(a, b) for a in kept for b in kept if a != b], reason
        rivals: list[Names]
        if diagnosis.kind == "cause":
            rivals = [(c.name,) for c in design.causes if c.name != kept[0][0]] or [()]
        else:
            rivals = [n for n in verdict.tested if len(n) == 2 and n != kept[0]]
            rivals = sorted(rivals, key=lambda n: verdict.tested[n].deficit)[:_NEAREST] or [(n,) for n in kept[0]]
        return found, [(kept[0], r) for r in rivals], f"to hold {' + '.join(kept[0])} against the others"
    visible = next_tests.confusable(design)  # each cause at a size that is clearly seen
    truths: dict[Names, next_tests.Truth] = {}
    for cause in design.causes:
        size = max(visible.sizes[cause.name], key=lambda s: abs(s - cause.baseline))
        row = int(np.argmin(np.abs(design.singles[cause.name].sizes[0] - size)))
        here = at_measured(design.singles[cause.name])[row]
        beyond = at_measured(there[(cause.name,)])[row]
        truths[(cause.name,)] = next_tests.Truth(tested=here, pool=beyond, inputs=np.zeros(design.inputs))
    names: list[Names] = [(c.name,) for c in design.causes]
    pairs = [(a, b) for a in names for b in names if a != b] or [(names[0], ())]
    return truths, pairs, "to tell the causes of the list apart"


def _at_fit(design: Design, there: Mapping[Names, Grid], names: Names, tested: Tested) -> next_tests.Truth:
    """Predictions of a fitted explanation here and on the pool, to first order.

    They start from the node next to the fit.

    Parameters
    ----------
    design : explanations and their tables on the specimens that were measured
    there : tables of every explanation on the pool
    names : of the explanation
    tested : its fit, whose position is in the unit cell about its node

    Returns
    -------
    next_tests.Truth
        Logarithms of predictions, and inputs in units of their noise, as ``next_tests`` takes them.
    """
    grid, pool = design.grid(names), there[names]
    fit = tested.fit
    here, beyond = (g.values_from(fit.node, fit.position)[0] for g in (grid, pool))
    return next_tests.Truth(tested=here, pool=beyond, inputs=grid.z_at(fit.position)[0])


def _spread(design: Design, covariate: str | None, pool: list[Any], k: int) -> next_tests.NextTests:
    """Next tests over the covariate that residuals vary with, from end to end.

    Without such a covariate they are any repeats, to measure the scatter.

    Parameters
    ----------
    design : of the tested specimens, whose columns within one kind of data it tells from recorded ones
    covariate, pool, k : with which the residuals vary, or None; specimens; number of tests
    """
    spaced = np.round(np.linspace(0, len(pool) - 1, k)).astype(int)
    if covariate is None:
        return _picked(spaced, pool, "to measure the scatter: repeat each several times")
    if covariate in ROWS:  # it tells rows apart, not specimens
        on_others = f"to see whether the residuals vary with {covariate} on others, each number measured"
        return _picked(spaced, pool, on_others)
    column = [recorded(s, covariate) for s in pool]
    if None in column:  # along a column within one kind of data
        column = [recorded(s, design.recorded_as(covariate)) for s in pool]
    if None in column:
        raise InputError(
            f"the residuals vary with {covariate}: give it for every specimen of the pool, number "
            f"{column.index(None)} lacks it"
        )
    if is_numeric(column):
        picks = np.argsort(np.asarray(column, dtype=float), kind="stable")[spaced]
    else:
        # one specimen of each label first, then second ones: in the order of how often its label came before
        labels = [str(v) for v in column]
        picks = np.argsort([labels[:i].count(label) for i, label in enumerate(labels)], kind="stable")[:k]
    return _picked(picks, pool, f"to see how the residuals vary with {covariate}")


def _picked(picks: np.ndarray, pool: list[Any], reason: str) -> next_tests.NextTests:
    """Specimens of a pool by numbers ``picks``, as tests to be made for a reason."""
    indices = tuple(int(i) for i in picks)
    return next_tests.NextTests(indices, tuple(pool[i] for i in indices), reason)
