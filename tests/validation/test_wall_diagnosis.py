"""Diagnosis of measured walls: laws of stiffness fitted without the campaign they predict, counts of planted trials."""

import numpy as np
import pytest

from validation.wall_curves_text import peak_of
from validation.wall_diagnosis import FORCE, MODE, STIFFNESS, Trial, observations, scatter_of, trial_lines
from validation.wall_figures import drift_at
from validation.wall_stiffness import Stiff, fitted_exponent, fitted_left_out, within


def planted(exponent: float = 0.5, share: float = 0.6) -> Stiff:
    """Stiffness by a law, with a level of its own in every campaign and no other scatter."""
    rng = np.random.default_rng(2)
    campaigns = [c for c in "ABCDEF" for _ in range(8)]
    pressed, of_code = rng.uniform(-2.5, -0.2, 48), np.repeat([True, False, True, False, False, True], 8)
    level = np.repeat(rng.normal(scale=0.3, size=6), 8)
    logs = -(exponent * pressed + np.log(share) * of_code + level)
    return Stiff([str(k) for k in range(48)], campaigns, logs, pressed, of_code)


def test_exponent_within_campaigns_sees_no_level():
    found, low, high = within(planted(0.4))
    assert (found, low, high) == pytest.approx((0.4, 0.4, 0.4))


def test_law_is_fitted_to_the_other_campaigns():
    stiff = planted()
    columns = np.column_stack([stiff.pressed])
    for campaign in "AF":
        own = np.array(stiff.campaigns) == campaign
        changed = np.where(own, stiff.logs + 5.0, stiff.logs)  # what a campaign measured moves nothing of its own fit
        (out, fits), (other, again) = (fitted_left_out(v, columns, stiff.campaigns) for v in (stiff.logs, changed))
        assert other[own] == pytest.approx(out[own] + 5.0)
        assert fits["ABCDEF".index(campaign)] == pytest.approx(again["ABCDEF".index(campaign)])
    bare = stiff._replace(logs=-(0.5 * stiff.pressed + np.log(0.6) * stiff.of_code))
    assert fitted_exponent(bare) == pytest.approx(0.5)


def test_planted_data_sets_are_counted_by_what_was_said():
    webs, rig = "webs of hollow units crack at less: A", "rig that turns: A"
    found = [
        Trial(webs, "A", "behaves like", (webs,), False),
        Trial(webs, "A", "cause", (rig,), True),  # the campaign, by a wrong name
        Trial(webs, "A", "either", (webs, "shift of campaign B"), False),  # two campaigns: not found
        Trial("shift of campaign B", "B", "none", (), False),
        Trial("", "", "scatter", (), False),
        Trial("", "", "none", (), False),
    ]
    rows = {r[0]: r[1:] for r in trial_lines(found)}
    assert rows["all"] == ["4", "3 (75%)", "2 (50%)", "2 (50%)", "1 (25%)"]
    assert rows["webs of hollow units crack at less"][0] == "3"
    assert rows["load read low"] == ["1", "0 (0%)", "0 (0%)", "0 (0%)", "0 (0%)"]
    assert rows["nothing"][:2] == ["2", "1 (50%)"]


def test_drift_at_a_share_is_on_the_rising_branch():
    drift, force = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 50.0, 100.0, 60.0])
    assert drift_at(0.7, drift, force) == pytest.approx(1.4)
    assert drift_at(0.5, drift, force) == pytest.approx(1.0)


def test_observations_hold_what_is_printed_and_its_scatter():
    scatter = scatter_of(["22", "144"], {"22": 0.1, "144": 0.0}, model=0.1)
    rows = {(o.specimen, o.quantity): o for o in observations(["22", "144"], (FORCE, MODE), scatter)}
    assert rows["22", FORCE].scatter == pytest.approx(np.sqrt(0.075**2 + 0.1**2 + 0.1**2))
    assert (rows["22", MODE].value, rows["22", MODE].link, rows["22", MODE].kind) == (0.0, "identity", "pattern")
    assert observations(["22"], (STIFFNESS,), None)[0].scatter is None


def test_peak_of_a_curve_and_what_is_left_of_it():
    assert peak_of([0.0, 0.1, 0.2, 0.4], [0.0, 80.0, 100.0, 60.0]) == (100.0, 0.2, 0.6)
