"""Runs trials: a data set is hidden, the diagnosis sees values only, the score compares afterwards."""

from dataclasses import dataclass, field

import numpy as np

from limitmason.diagnosis import Noise, Rule, Study

from . import hide, other, score, surrogate

CROSS_ERROR = 0.015  # declared method error between the two closed forms (their difference: 0.9 to 1.3 % rms)
FRESH = 400
SET = Rule(identify=False)  # these trials count what is not rejected; `earned.py` counts what is identified


@dataclass
class Record:
    """What is collected over trials besides the outcomes."""

    sheet: score.Sheet = field(default_factory=score.Sheet)
    broken: dict = field(default_factory=lambda: {"best fit": score.Sheet(), "abstain": score.Sheet()})
    size_errors: list = field(default_factory=list)
    covered: list = field(default_factory=list)
    gain_signs: list = field(default_factory=list)
    resolved: dict = field(default_factory=dict)
    flagged: list = field(default_factory=list)
    missed: list = field(default_factory=list)

    def add(self, more):
        """Take over what another record has collected."""
        for own, other_sheet in [(self.sheet, more.sheet), *((self.broken[n], more.broken[n]) for n in self.broken)]:
            for label, row in other_sheet.counts.items():
                own.counts[label].update(row)
        for name in ("size_errors", "covered", "gain_signs", "flagged", "missed"):
            getattr(self, name).extend(getattr(more, name))
        for label, pairs in more.resolved.items():
            self.resolved.setdefault(label, []).extend(pairs)


CROSS = Noise(float(np.hypot(surrogate.NOISE, CROSS_ERROR)))


def run(
    record, where, kind, seed, count, *, label=None, causes=surrogate.CAUSES, noise=surrogate.NOISE, rule=None, **how
):
    """Hide and diagnose ``count`` times; designs that have no truth of the class are left out.

    Parameters
    ----------
    record : what is added to
    where : campaign
    kind : class of truths
    seed : integers; the trial number is appended
    label : class in the record; None is ``kind``
    rule : thresholds; None are those of the toolkit, names as they stand before they are earned
    noise, how : see :func:`hide.hide`
    """
    for k in range(count):
        try:
            values, truth = hide.hide(where, kind, [*seed, k], noise=noise, **how)
        except LookupError:
            return
        diagnosis = where.study.replace(measured=values).diagnose(causes, seed=k, rule=rule or SET)
        result = score.outcome(*score.ours(diagnosis), truth=truth)
        record.sheet.add(label or kind, result)
        if kind == "middle" and label is None:
            record.sheet.add(
                f"middle, {'less' if truth.seen < hide.SEEN else 'more'} than {hide.SEEN:.0f} seen", result
            )
        for name, broken in (("best fit", score.best_fit), ("abstain", score.abstain)):
            record.broken[name].add(label or kind, score.outcome(*broken(diagnosis), truth=truth))
        if result == "named":
            _named(record, where, diagnosis, truth, noise, [*seed, k])


def _named(record, where, diagnosis, truth, noise, seed):
    """Error of the size, cover of its interval, and sign of the gain left out against that on fresh data."""
    name, size = truth.names[0], truth.sizes[0]
    baseline = next(c.baseline for c in surrogate.CAUSES if c.name == name)
    estimate = diagnosis.estimates[name]
    record.size_errors.append(abs(estimate.size - size) / abs(size - baseline))
    record.covered.append(estimate.low <= size <= estimate.high)
    if diagnosis.gain is not None and where.study.noise.kind == "known":
        design = diagnosis.design
        mean = design.whiten(truth.expected)
        spread = noise / design.scale
        fresh = mean + spread * np.random.default_rng([*seed, 9]).standard_normal((FRESH, design.n))
        left = {}
        for names in ((), (name,)):
            fit = diagnosis.verdict.tested[names].fit if names else diagnosis.verdict.null
            left[names] = 0.5 * ((fresh - design.predicted(names, fit)[0]) ** 2).sum(axis=1)
        record.gain_signs.append((diagnosis.gain.leave_one_out.total > 0) == ((left[()] - left[(name,)]).mean() > 0))


def next_tests(record, where, kind, seed, count, label="plain"):
    """For sets that hold the truth: does the set resolve with four suggested specimens, and with four random ones?"""
    pool = {"plain": surrogate.plain_pool, "rich": surrogate.rich_pool}[label]()
    done = k = 0
    while done < count and k < 20 * count:
        k += 1
        values, truth = hide.hide(where, kind, [*seed, k])
        diagnosis = where.study.replace(measured=values).diagnose(surrogate.CAUSES, seed=k, pairs=False, rule=SET)
        if diagnosis.kind != "either" or truth.names[0] not in diagnosis.causes:
            continue
        done += 1
        rng = np.random.default_rng([*seed, k, 5])
        suggested = list(diagnosis.next_tests(pool, k=4).indices)
        picks = (suggested, list(rng.choice(len(pool), 4, replace=False)))
        pair = tuple(_resolved(where, values, truth, [pool[i] for i in p], [*seed, k]) for p in picks)
        record.resolved.setdefault(label, []).append(pair)


def _resolved(where, values, truth, extra, seed):
    """Whether the campaign with further specimens names the truth."""

    class Extra:
        study = type("Tested", (), {"specimens": extra})

    expected = hide.expected(Extra, truth.names, truth.sizes, truth.friction)
    more = expected * np.exp(surrogate.NOISE * np.random.default_rng([*seed, 6]).standard_normal(len(extra)))
    study = Study(
        [*where.study.specimens, *extra],
        surrogate.simulate,
        np.concatenate([values, more]),
        where.study.noise,
        surrogate.NUISANCE,
        surrogate.COVARIATES,
        shared=(),
        levels=17,
        nuisance_levels=5,
    )
    diagnosis = study.diagnose(surrogate.CAUSES, seed=seed[-1], pairs=False, rule=SET)
    return diagnosis.kind == "cause" and diagnosis.causes == truth.names


def blunders(record, where, seed, count):
    """Null data with one value off by five standard deviations: alarms, names, whether it is pointed at."""
    for k in range(count):
        values, truth = hide.hide(where, "null", [*seed, k], blunder=5.0)
        diagnosis = where.study.replace(measured=values).diagnose(surrogate.CAUSES, seed=k, rule=SET)
        record.sheet.add("blunder of 5 sigma", score.outcome(*score.ours(diagnosis), truth=truth))
        if diagnosis.kind != "none":
            guilty = int(np.argmax(np.abs(np.log(values / truth.expected))))
            record.flagged.append(guilty in diagnosis.checks.hangs_on)


def crossed(record, where, seed, count):
    """Truth in the second closed form, candidates in the first: the null first, then clear and middle effects."""
    for kind in ("null", "clear", "middle"):
        number = list(hide.CLASSES).index(kind)
        run(record, where, kind, [*seed, number], count, label=f"other code, {kind}", predict=other.expected)
