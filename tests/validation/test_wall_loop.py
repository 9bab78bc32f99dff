"""Choices with campaigns left out never see the campaign they predict; what a difference of scatter is."""

import numpy as np
import pytest
from wall_curves import WALLS, dozen
from wall_loop import difference, factored, first_mode, left_out, scatter, threshold_left_out

from limitmason.comparison.wall_ladder import DOZEN


def test_scatter_of_known_numbers():
    found = scatter(np.log([0.5, 1.0, 2.0]))
    assert (found.number, found.median) == (3, 1.0)
    assert found.deviation == pytest.approx(np.log(2.0))
    assert found.middle == pytest.approx(np.log(2.0))


def test_campaign_is_predicted_by_the_choice_of_the_others():
    # a model that is right everywhere but in C, where the other one is
    campaigns = ["A", "A", "B", "C", "C"]
    candidates = {"one": np.array([0.0, 0.0, 0.0, 0.7, 0.7]), "other": np.array([0.3, 0.3, 0.3, 0.0, 0.0])}
    found = left_out(candidates, campaigns)
    assert found.chosen["C"] == "one"
    assert found.logs[3] == 0.7  # its own walls would have chosen the other
    assert set(found.chosen) == {"A", "B", "C"}


def test_formulas_get_factors_that_bring_back_planted_ones():
    rng = np.random.default_rng(3)
    forces = rng.lognormal(5.0, 0.6, (60, 4))
    planted = (forces * np.array([0.8, 1.25, 0.9, 0.9])).min(axis=1)
    found = factored(forces, planted)
    assert np.abs(found["rocking 0.8, sliding 1.25, cracking 0.9"]).max() < 1e-12
    assert min(found, key=lambda k: float(np.mean(found[k] ** 2))) == "rocking 0.8, sliding 1.25, cracking 0.9"


def test_difference_of_scatter_draws_whole_campaigns():
    campaigns = [c for c in "ABCDEFGH" for _ in range(6)]
    rng = np.random.default_rng(0)
    one, shared = rng.normal(size=48), np.repeat(rng.normal(size=8), 6)
    assert difference(one, one, campaigns, draws=50) == pytest.approx([0.0, 0.0])
    low, high = difference(2.0 * one, one, campaigns, draws=500)
    assert low < np.std(one, ddof=1) < high
    # walls of a campaign that are alike count once: the interval of their scatter is wide
    alike = difference(2.0 * shared, shared, campaigns, draws=500)
    assert np.ptp(alike) > 1.5 * (high - low)


@pytest.mark.parametrize(
    ("printed", "first"), [("H-FS", "F"), ("S", "S"), ("SL", "SL"), ("H-FSL", "F"), ("H-S?", "S"), ("H-GS", "G")]
)
def test_hybrids_count_by_their_first(printed, first):
    assert first_mode(printed) == first


def test_threshold_is_chosen_without_the_campaign_that_it_serves():
    # A and B rock from 0.9 on; C, were it seen, would want 0.5
    ratios = np.array([0.95, 0.7, 0.92, 0.6, 0.55, 0.52])
    printed, campaigns = ["F", "S", "F", "S", "F", "F"], ["A", "A", "B", "B", "C", "C"]
    found = threshold_left_out(ratios, ["S"] * 6, printed, campaigns)
    assert found.modes == ["F", "S", "F", "S", "S", "S"]
    assert 0.6 < found.thresholds["A"] < 0.92
    assert 0.7 < found.thresholds["C"] < 0.92


def test_dozen_of_the_dem_is_that_of_its_rule():
    chosen = dozen()
    assert tuple(chosen) == DOZEN
    assert len({WALLS[w]["campaign"] for w in chosen}) >= 7
    assert all(WALLS[w]["responses"] == "given" for w in chosen)
