"""Quick trials of earned names: effects outside the list are not named, clear ones are; broken rules must fail.

Bounds are those of the acceptance table, loosened by the binomial spread of the small counts.
"""

import numpy as np
import pytest
from blind import campaign_store, campaigns, earned_report, earned_trials, outsiders, surface

pytestmark = pytest.mark.slow

SEED = 1616  # not the seed of the full report
OFF_THE_LIST = ("missing, of the list", "missing, never listed", "outsiders")
PLAN = {**dict.fromkeys(OFF_THE_LIST, 15), "clear": 16, "nothing": 20}


@pytest.fixture(scope="module")
def records():
    out = []
    for i, (kind, count) in enumerate(PLAN.items()):
        label = "off the list" if kind in OFF_THE_LIST else kind
        out += [{**earned_trials.one("24", kind, [SEED, i, k]), "class": label} for k in range(count)]
    for carried in (True, False):
        label = "shared" if carried else "shared, not carried"
        found = [earned_trials.one("24", "nothing", [SEED, 9, k], column="setup", carried=carried) for k in range(20)]
        out += [{**r, "class": label} for r in found]
    label = "shared, not recorded"
    found = [earned_trials.one("24", "nothing", [SEED, 10, k], column="setup", recorded=False) for k in range(20)]
    return out + [{**r, "class": label} for r in found]


BOUNDS = [
    ("off the list", earned_report.WRONG, 0.0, 0.2),
    ("clear", ("named",), 0.75, 1.0),
    ("clear", earned_report.WRONG, 0.0, 0.1),
    ("nothing", ("none",), 0.8, 1.0),
]
SHARED = (("none",), 0.8, 1.0)


def failed(counts, bounds):
    out = []
    for label, outcomes, low, high in bounds:
        rate = sum(counts[label][o] for o in outcomes) / sum(counts[label].values())
        if not low <= rate <= high:
            out.append((label, outcomes, rate))
    return out


def test_quick_trials_meet_the_acceptance_table(records):
    assert not failed(earned_report.sheet(records), [*BOUNDS, ("shared", *SHARED), ("shared, not recorded", *SHARED)])


@pytest.mark.parametrize("name", list(earned_report.BROKEN))
def test_a_broken_rule_fails(name, records):
    counts = earned_report.sheet(records, earned_report.BROKEN[name])
    assert failed(counts, BOUNDS), counts


def test_ignored_groups_fail(records):
    assert failed(earned_report.sheet(records), [("shared, not carried", *SHARED)])


def test_stored_multipliers_are_those_of_the_codes():
    values = campaign_store.read()
    assert min(values.values()) > 0.05  # all stand and all runs ended: what did not is stored as 0.001
    limit = campaign_store.Simulator(campaign_store.LIMIT, {}, save=lambda: None)
    s = campaigns.SPECIMENS[0]
    mu = campaign_store.friction(campaign_store.FRICTIONS[0])
    assert limit(s, friction_coefficient=mu) == pytest.approx(values["limit", "", f"{mu:.10g}", 0], rel=1e-6)
    # a stack rocks about its edge: lambda = thickness / height
    assert limit(s, friction_coefficient=mu) == pytest.approx(s["thickness"] / s["height"], rel=1e-6)
    effect = outsiders.BY_NAME["light upper half"]
    found = limit.effect(effect.name, effect.sizes[0], 0, mu)
    assert found == pytest.approx(values["limit", f"{effect.name} {effect.sizes[0]:.10g}", f"{mu:.10g}", 0], rel=1e-6)


def test_outsiders_by_hand():
    # three courses of 0.1 m on 0.1 m: weights 1, w, w at heights 0.05, 0.15, 0.25 about the lower edge
    s = campaigns.SPECIMENS[0]
    model, loads = outsiders.light_above(s, 0.65, 0.5)
    found = campaign_store.solved(campaign_store.LIMIT, model, loads)
    assert found == pytest.approx(0.05 * (1.0 + 0.5 + 0.5) / (0.05 + 0.5 * 0.15 + 0.5 * 0.25), rel=1e-6)
    # the middle course set back by 10 mm gives its weight a longer lever
    found = campaign_store.solved(campaign_store.LIMIT, *outsiders.set_back(s, 0.65, 10.0))
    assert found == pytest.approx((0.05 + 0.06 + 0.05) / (0.05 + 0.15 + 0.25), rel=1e-6)
    # a load that grows with height: (1 + a (2 z / H - 1)) times the weight
    found = campaign_store.solved(campaign_store.LIMIT, *outsiders.higher(s, 0.65, 0.3))
    z = np.array([0.05, 0.15, 0.25])
    assert found == pytest.approx(0.15 / float((z * (1.0 + 0.3 * (2.0 * z / 0.3 - 1.0))).sum()), rel=1e-6)


def test_what_a_trend_along_a_covariate_leaves():
    x = np.linspace(0.0, 1.0, 12)
    wave = np.cos(7.0 * x)
    assert surface.remainder(3.0 + 2.0 * x - x**2, {"x": x}) == pytest.approx(0.0, abs=1e-18)
    assert surface.remainder(wave, {"label": ["a"] * 6 + ["b"] * 6}) == pytest.approx(
        sum(((part - part.mean()) ** 2).sum() for part in (wave[:6], wave[6:]))
    )
