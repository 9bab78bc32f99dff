"""A name must be earned: nameless rivals, margins, shared noise and what is said of them, held against closed forms."""

import dataclasses
import json

import numpy as np
import pytest
from diagnosis_models import BATCH, CAUSES, FRICTION, GAIN, ROUNDING, SLOPE, blocks, data, specimens, study
from scipy.special import chdtrc
from scipy.stats import multivariate_normal

from limitmason import causes
from limitmason.diagnosis import Cause, Noise, Rule, Study
from limitmason.diagnosis.inference.confidence_set import ConfidenceSet
from limitmason.diagnosis.inference.discrepancy import AMPLITUDES, CONSTANT, Discrepancy
from limitmason.diagnosis.inference.likelihood import Likelihood
from limitmason.diagnosis.inference.noise import Draws
from limitmason.diagnosis.inference.shared_noise import (
    LEAST,
    alike,
    assumed,
    estimated_shares,
    two_groups_by_effect,
)
from limitmason.diagnosis.inference.trends import same
from limitmason.errors import InputError

X = np.random.default_rng(16).uniform(0.0, 3.0, 9)
LABELS = list("aabbbccca")


def rivals(slopes=None):
    return Discrepancy.of({"x": X, "label": LABELS}, np.ones(9), np.zeros((9, 0)) if slopes is None else slopes)


def test_evidence_of_a_bias_is_the_normal_density_with_its_covariance():
    y, every = np.random.default_rng(1).standard_normal(9), rivals()
    for number in (0, 1, 8, len(every.along) - 1):
        density = multivariate_normal(np.zeros(9), np.eye(9) + every.kernels[number]).logpdf(y)
        found = every.each(y, Likelihood())[0, number] - 4.5 * np.log(2.0 * np.pi)
        assert found == pytest.approx(density, abs=1e-9)
    assert every.along[0] == CONSTANT
    # no bias at all is among them, whose evidence is this to rounding
    assert every.evidence(y, Likelihood())[0] >= -0.5 * float(y @ y) * (1.0 + 1e-12)


def test_a_measured_input_is_profiled_out_of_a_bias_as_least_squares_does():
    rng = np.random.default_rng(2)
    slopes = rng.standard_normal((9, 1))
    y, with_input = rng.standard_normal(9), rivals(slopes)
    for number in (0, 5, len(with_input.along) - 1):
        inverse = np.linalg.inv(np.eye(9) + with_input.kernels[number])
        z = np.linspace(-3.0, 3.0, 60001)
        left = y[None] - z[:, None] * slopes[:, 0]
        least = (np.einsum("bi,ij,bj->b", left[::100], inverse, left[::100]) + z[::100] ** 2).min()
        found = -2.0 * (with_input.each(y, Likelihood())[0, number] + with_input.prices[number])
        assert found == pytest.approx(least, abs=1e-3)


def test_values_left_out_are_the_conditional_means_of_the_process():
    y, every = np.random.default_rng(3).standard_normal(9), rivals()
    number, folds = 10, np.array([0, 0, 1, 1, 1, 2, 2, 2, 0])
    miss, spread = every.left_out(number, y, folds)
    whole = np.eye(9) + every.kernels[number]
    for fold in range(3):
        out, rest = np.flatnonzero(folds == fold), np.flatnonzero(folds != fold)
        across = whole[np.ix_(out, rest)] @ np.linalg.inv(whole[np.ix_(rest, rest)])
        assert miss[out] == pytest.approx(y[out] - across @ y[rest], abs=1e-9)
        assert spread[out] == pytest.approx(np.diag(whole[np.ix_(out, out)] - across @ whole[np.ix_(rest, out)]))


def test_what_goes_with_one_covariate_is_found_along_it_and_a_turned_order_changes_nothing():
    labels, rng = ["p", "q", "r"] * 8, np.random.default_rng(4)
    x, w = rng.uniform(0, 1, 24), rng.uniform(0, 1, 24)
    every = Discrepancy.of({"x": x, "w": w, "label": labels}, np.ones(24), np.zeros((24, 0)))
    y = 8.0 * x + 0.3 * rng.standard_normal(24)
    assert every.along[every.best(y, Likelihood())] == "x"
    turned = rng.permutation(24)
    other = Discrepancy.of(
        {"label": [labels[i] for i in turned], "w": w[turned], "x": 5.0 - 3.0 * x[turned]}, np.ones(24),
        np.zeros((24, 0)),
    )
    assert other.evidence(y[turned], Likelihood()) == pytest.approx(every.evidence(y, Likelihood()), abs=1e-8)
    # a bias of any size has a price that grows with its logarithm only: none is too large to be told
    large = [float(every.evidence(f * (x - x.mean()), Likelihood())[0]) for f in (10.0, 30.0, max(AMPLITUDES))]
    assert min(large) > -15.0


def test_one_factor_on_all_values_is_never_named():
    # the nearest model discrepancy, an equal error of all values, makes exactly the same data
    verdicts = [study(data(GAIN, 1.25, seed=s)).diagnose(CAUSES, draws=699) for s in (0, 1, 2)]
    assert {v.kind for v in verdicts} == {"behaves like"}
    assert all(v.causes == ("gain",) and v.identification.along == CONSTANT for v in verdicts)
    assert "an equal error of all values could do the same" in str(verdicts[0])


def narrow(values=None, **more):
    """Twelve blocks of two widths, the wide ones all in one batch: the contrast that only rounding makes is missing."""
    made = [{**s, "width": (0.10, 0.14)[i % 2], "batch": "AB"[i % 2]} for i, s in enumerate(specimens())]
    return Study(made, blocks, values, Noise(0.04), FRICTION, ["height", "width", "batch"], **more)


def test_a_name_is_earned_only_where_its_lever_is_varied_and_next_tests_vary_it():
    wide = study(data(ROUNDING, 0.018)).diagnose(CAUSES)
    # peaks are one kind of evidence: told from every smooth discrepancy, and still not a name
    assert (wide.kind, wide.identified, wide.identification.distinct) == ("behaves like", False, True)
    assert wide.identification.missing == ("kinds",)
    values = narrow().predicted([ROUNDING], [0.012]) * np.exp(0.04 * np.random.default_rng(0).standard_normal(12))
    verdict = narrow(values).diagnose(CAUSES)
    assert (verdict.kind, verdict.causes, verdict.identified) == ("behaves like", ("edge rounding",), False)
    assert "lever" in verdict.identification.missing
    assert verdict.gain.leave_one_out.total > 0  # the gain is measured either way
    assert verdict.estimates["edge rounding"].size == pytest.approx(0.012, rel=0.2)
    pool = [{"height": h, "width": w, "batch": b} for h in (0.3, 1.0) for w in (0.06, 0.10, 0.14, 0.3) for b in "AB"]
    tests = verdict.next_tests(pool, k=4)
    assert {s["width"] for s in tests.specimens} <= {0.06, 0.3}  # not more of the same
    assert "to identify edge rounding" in str(tests)
    more = [s for s in tests.specimens for _ in range(2)]
    both = narrow().replace(specimens=[*narrow().specimens, *more])
    noise = np.exp(0.04 * np.random.default_rng(1).standard_normal(both.n))
    again = both.replace(measured=both.predicted([ROUNDING], [0.012]) * noise).diagnose(CAUSES)
    assert (again.identification.distinct, again.causes) == (True, ("edge rounding",))


def test_without_the_rule_of_earning_what_is_left_is_named():
    values = narrow().predicted([ROUNDING], [0.012]) * np.exp(0.04 * np.random.default_rng(0).standard_normal(12))
    always = narrow(values).diagnose(CAUSES, rule=Rule(identify=False))
    assert (always.kind, always.identification) == ("cause", None)
    assert "earned" not in str(always)


def test_a_margin_beyond_reach_gives_no_name_and_says_why():
    verdict = study(data(ROUNDING, 0.012)).diagnose(CAUSES, rule=Rule(margin=1e3))
    assert verdict.kind == "behaves like"
    assert {"lever", "excess"} <= set(verdict.identification.missing)
    assert "in 0 of 100 data sets" in verdict.report(checks=False)


def test_report_page_record_and_notebook_say_what_is_missing(tmp_path):
    values = narrow().predicted([ROUNDING], [0.012]) * np.exp(0.04 * np.random.default_rng(0).standard_normal(12))
    verdict = narrow(values).diagnose(CAUSES)
    text = verdict.report(checks=False)
    for said in ("Not identified", "What would identify it", "If the true cause were missing from this list"):
        assert said in text
    shown = json.loads(json.dumps(verdict.record()))
    assert (shown["kind"], shown["identified"]) == ("behaves like", False)
    assert shown["identification"]["missing"] == list(verdict.identification.missing)
    assert "behaves like edge rounding" in repr(verdict)
    (row,) = [r for r in verdict.table() if r["cause"] == "edge rounding"]
    assert row["identified"] is False


def test_leave_a_cause_out_counts_names_and_its_rate_stands_in_the_verdict():
    made = study(data(ROUNDING, 0.012))
    with pytest.raises(InputError, match="each"):
        made.rehearse(CAUSES, hide="all")
    with pytest.raises(InputError, match="list of two"):
        made.rehearse([GAIN], hide="each")
    found = made.rehearse(CAUSES, n=12, hide="each", pairs=False)
    assert found.missing
    assert {name: sum(row.values()) for name, row in found.counts.items()} == dict.fromkeys([c.name for c in CAUSES], 4)
    assert all(not row.get("named") and not row.get("behaves like it") for row in found.counts.values())
    rate = found.rate("wrong name")[0]
    text = made.diagnose(CAUSES).report(checks=False)
    assert f"given in {100 * rate:.0f} of 100 data sets on this design (rehearsed 12 times" in text
    # a cause that never was on the list
    slope = Cause("slope", "slope", 0.0, (-1.0, 1.0))
    assert set(made.rehearse(CAUSES, n=2, hide=[slope], pairs=False).counts) == {"slope"}


def test_margins_hold_a_name_of_a_twin_back():
    # with its twin off the list, either is given to the other's data; the margin of both rises above what they reach
    twin = Cause("loss", "loss", 0.0, (0.0, 0.02))

    def simulate(s, *, friction_coefficient, rounding=0.0, loss=0.0, slope=0.0):
        both = rounding + loss
        return blocks(s, friction_coefficient=friction_coefficient, rounding=both, slope=slope)

    made = Study(specimens(), simulate, data(ROUNDING, 0.012), Noise(0.04), FRICTION, ["height", "width"])
    listed = (ROUNDING, twin, Cause("slope", "slope", 0.0, (-1.0, 1.0)))
    missing = made.judge(listed).missing()
    assert missing.fitted >= 0.5 * missing.trials
    assert missing.rate <= Rule().missing
    assert missing.power["edge rounding"] < 0.1
    none, given = Rule(margin=0.0, missing=1.0, each=1.0), []
    for own in ((), ("width",)):  # with one kind of data a name needs a dose along a measured column of its own
        dosed = tuple(dataclasses.replace(c, own=own) for c in listed)
        given.append(made.judge(dosed, none).missing().rate)
    assert given[0] == 0.0
    assert given[1] > 0.3


@pytest.mark.parametrize("names", [("A", "B"), (1, 2)])
def test_a_batch_that_is_called_by_a_number_is_no_dose(names):
    stacks = [{**s, "batch": names["AB".index(s["batch"])]} for s in specimens()]
    gain = np.array([1.25 if s["batch"] == names[1] else 1.0 for s in stacks])
    made = Study(stacks, blocks, data(seed=1, sd=0.03) * gain, Noise(0.03), FRICTION, ["height", "width", "batch"])
    shift = causes.batch_shift(label=names[1])
    diagnosis = made.diagnose((ROUNDING, GAIN, shift))
    assert (diagnosis.kind, diagnosis.causes) == ("behaves like", (shift.name,))
    assert diagnosis.identification.missing == ("kinds",)


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_share_of_a_group_is_estimated_within_the_stated_total(share):
    walls = [{"height": 0.3 + 0.02 * i, "width": 0.1} for i in range(40)]
    batches = {"batch": [f"b{i // 5}" for i in range(40)]}
    made = Study(walls, blocks, None, Noise(0.04), FRICTION, batches, levels=3, nuisance_levels=3)
    design = made.design([ROUNDING])
    factor = np.linalg.cholesky(assumed(made.covariates["batch"], share))
    rng = np.random.default_rng(5)
    found = [estimated_shares(design, factor @ rng.standard_normal(40)).shares.get("batch", 0.0) for _ in range(30)]
    assert np.mean(found) == pytest.approx(share, abs=0.12)


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_an_effect_that_goes_with_the_groups_is_no_noise_that_they_share(share):
    # the middle batches 15 % high: at the baseline that passes for noise shared within batches, beside the cause not
    walls = [{"height": 0.3 + 0.02 * i, "width": 0.1} for i in range(40)]
    raised = Cause("middle", "middle", 0.0, (-0.4, 0.4))

    def simulate(s, *, friction_coefficient, middle=0.0, rounding=0.0):
        inside = 0.45 < s["height"] < 0.85
        return blocks(s, friction_coefficient=friction_coefficient, rounding=rounding) * (1.0 + inside * middle)

    batches = {"batch": [f"b{i // 5}" for i in range(40)]}
    made = Study(walls, simulate, None, Noise(0.04), FRICTION, batches, levels=3, nuisance_levels=3)
    causes, rng = [raised, ROUNDING], np.random.default_rng(6)
    factor = np.linalg.cholesky(assumed(made.covariates["batch"], share))
    before, beside = [], []
    for _ in range(20):
        values = made.predicted([raised], [0.15]) * np.exp(0.04 * factor @ rng.standard_normal(40))
        own = made.replace(measured=values)
        before.append(own.shares(causes).shares.get("batch", 0.0))
        beside.append(own.shares(causes, price=4.0).shares.get("batch", 0.0))
    assert min(before) > 0.25
    assert np.mean(beside) == pytest.approx(share, abs=0.12)


def test_shared_noise_is_carried_as_generalised_least_squares_does():
    labels = [f"day {i // 3}" for i in range(12)]
    made = study(data(ROUNDING, 0.012), covariates={"day": labels, "height": range(12)}, nuisance={})
    plain = made.design(CAUSES)
    y = plain.whiten(made.measured)
    from limitmason.diagnosis.inference.fit import fits

    correlation = assumed(labels, 0.5)
    mixed = plain.sharing(correlation)
    (found,) = fits([mixed.singles["edge rounding"]], mixed.turned(y), np.zeros(0), mixed.like)
    left = mixed.apart(found.residuals[0])
    assert float(found.loss[0]) == pytest.approx(float(left @ np.linalg.solve(correlation, left)), rel=1e-9)
    grid = plain.singles["edge rounding"]
    at_nodes = [float(r @ np.linalg.solve(correlation, r)) for r in y - grid.nodes]
    assert found.loss[0] <= min(at_nodes) + 1e-9
    assert mixed.apart(mixed.turned(y)) == pytest.approx(y)


@pytest.mark.slow
def test_noise_of_whole_days_makes_an_alarm_only_where_it_is_not_carried():
    labels = [f"{i // 3}" for i in range(12)]
    factor, rng = np.linalg.cholesky(assumed(labels, 0.85)), np.random.default_rng(4)
    alarms = {None: 0, (): 0}
    for k in range(12):
        values = study().baseline() * np.exp(0.04 * factor @ rng.standard_normal(12))
        for shared in alarms:
            made = study(values, covariates={"day": labels, "height": range(12)}, shared=shared)
            alarms[shared] += made.diagnose(CAUSES, seed=k, draws=299, pairs=False).kind != "none"
    assert alarms[None] <= 2
    assert alarms[()] > alarms[None]


@pytest.mark.exact
def test_circumstances_that_specimens_carry_are_recorded():
    # the verdict once said "Not recorded: batch" of specimens with a batch, where no covariates were named
    told = ((1, "A", 1), (2, "B", 1), (3, "A", 2))
    carry = [{"width": w, "batch": b, "Set up": "rig 1", "day": d} for w, b, d in told]
    made = Study(carry, lambda s: s["width"], [1.0, 2.0, 3.0], Noise(0.05))
    assert made.covariates == {"batch": ["A", "B", "A"], "day": [1, 1, 2]}  # one rig tells nothing apart
    assert made.unstated == ("set-up",)
    assert Study(carry, lambda s: s["width"], [1.0, 2.0, 3.0], Noise(0.05), covariates=()).covariates == {}
    assert Study([*carry, {"width": 4}], lambda s: s["width"], [1.0, 2.0, 3.0, 4.0], Noise(0.05)).covariates == {}


@pytest.mark.slow
def test_noise_shared_unrecorded_makes_few_alarms_and_a_clear_effect_still_one():
    # two batches nobody wrote down: half of the noise is theirs
    factor, rng = np.linalg.cholesky(assumed(["A", "A", "B"] * 4, 0.5)), np.random.default_rng(11)
    alarms = {None: 0, (): 0}
    for k in range(30):
        values = study().baseline() * np.exp(0.04 * factor @ rng.standard_normal(12))
        for shared in alarms:
            made = study(values, covariates=["height", "width"], shared=shared)
            verdict = made.diagnose(CAUSES, seed=k, draws=299, pairs=False)
            alarms[shared] += verdict.kind != "none"
            if shared is None and verdict.kind == "none" and verdict.verdict.doubt is not None:
                assert "would do the same" in verdict.report(checks=False)
                assert verdict.record()["shared unstated"]["not recorded"] == ["batch", "day", "set-up"]
    assert alarms[None] <= 4
    assert alarms[()] >= alarms[None] + 3
    clear = study(data(ROUNDING, 0.018), covariates=["height", "width"]).diagnose(CAUSES)
    assert (clear.causes, clear.verdict.doubt.holds) == (("edge rounding",), True)
    assert "The alarm stands" in clear.report(checks=False)


def test_an_alarm_is_held_against_its_own_specimens_as_generalised_least_squares_does():
    # gain of one size beside noise that its specimens share: the square of the mean over its variance
    made = study(data(GAIN, 1.05, seed=5), covariates=["height", "width"], nuisance={}, noise=Noise(0.04))
    design = made.design([GAIN])
    y = design.whiten(made.measured)
    decision = ConfidenceSet(design, Draws.make([0, 12], 12, 0, made.noise, 1999), Rule())
    alarm = decision.gate(y)
    found = decision.alarm(y, ("batch",)).doubt
    assert alarm.p["gain"] < 0.005
    mean, variance = y.mean(), 0.5 + 0.5 / 12
    assert found.p["gain"] == pytest.approx(chdtrc(1.0, mean**2 / variance), abs=0.03)
    assert not found.holds
    assert two_groups_by_effect(np.array([0.1, 0.2, 1.1, -1.2])) == [0, 0, 1, 1]
    assert two_groups_by_effect(np.full(4, -0.3)) == [1] * 4


def test_what_is_carried_is_said_and_what_cannot_be_is_tried():
    labels = [f"{i // 3}" for i in range(12)]
    factor = np.linalg.cholesky(assumed(labels, 0.9))
    noise = np.exp(0.04 * factor @ np.random.default_rng(4).standard_normal(12))
    values = study().predicted([ROUNDING], [0.012]) * noise
    made = study(values, covariates={"day": labels, "width": [s["width"] for s in specimens()]})
    verdict = made.diagnose(CAUSES)
    assert verdict.shares.shares["day"] > LEAST
    assert "of its variance within day" in verdict.report(checks=False)
    assert np.log(verdict.predicted(()) / study().baseline()) == pytest.approx(0.0, abs=1e-9)
    bare = study(data(ROUNDING, 0.012), covariates=["height", "width"]).diagnose(CAUSES)
    assert "groups of like specimens (assumed" in bare.report()
    with pytest.raises(InputError, match="no covariate"):
        study(shared=["weather"])


def test_a_batch_that_a_cause_is_about_is_not_carried_as_noise():
    verdict = study(data(BATCH, 1.2)).diagnose(CAUSES)
    assert verdict.causes == ("batch",)
    assert "batch" not in verdict.shares.estimated
    assert verdict.identification.distinct  # its own column, which it declares, is no rival


def test_groups_of_like_specimens_gather_what_is_alike():
    labels = alike({"height": [1.0, 1.01, 1.02, 1.0, 3.0, 3.01, 3.0, 3.02], "kind": list("aaaabbbb")})
    assert same(labels) == pytest.approx(same([0, 0, 0, 0, 1, 1, 1, 1]))
    assert alike({"height": [1.0] * 12}) is None


@pytest.mark.slow
def test_a_pair_beside_noise_that_days_share_is_judged_again_and_reported():
    days = [f"d{i % 4}" for i in range(12)]
    stacks = [{**s, "day": day} for s, day in zip(specimens(), days, strict=True)]
    made = Study(stacks, blocks, None, Noise(0.03), FRICTION, ["height", "width", "batch", "day"], shared=("day",))
    rng = np.random.default_rng(0)
    of_day = dict(zip(sorted(set(days)), 0.028 * rng.standard_normal(4), strict=True))
    errors = np.array([of_day[day] for day in days]) + 0.008 * rng.standard_normal(12)
    values = made.predicted((ROUNDING, BATCH), (0.012, 1.3)) * np.exp(errors)
    found = made.replace(measured=values).diagnose((ROUNDING, BATCH, SLOPE), draws=199)
    assert found.pairs == (("edge rounding", "batch"),)
    assert found.shares.shares["day"] > 0.5
    # the pairs that were tried and not kept had no table in the design of independent noise: a LookupError
    assert "noise taken as unknown the verdict is" in found.report()
