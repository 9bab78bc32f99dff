"""What was asked of the measured walls is met or not by the numbers, and the section by hand has known limits."""

import numpy as np
import pytest
from wall_acceptance import _forces, _modes, plastic_section
from wall_loop import LeftOut
from wall_tests import Measured

from limitmason import experiments
from limitmason.comparison.wall_ladder import WallPrediction
from limitmason.comparison.wall_modes import rocking_force


def walls(count):
    return [Measured(str(k), f"campaign {k // 5}", 100.0, "S" if k % 2 else "F") for k in range(count)]


@pytest.mark.parametrize(("scatter", "met"), [(0.05, "yes"), (0.3, "no")])
def test_scatter_is_held_against_what_was_asked_with_and_without_two_walls(scatter, met):
    logs = scatter * np.random.default_rng(3).standard_normal(50)
    logs -= np.median(logs)
    rows = _forces(walls(50), LeftOut(logs, {}), 0.2 * np.random.default_rng(4).standard_normal(50), ("22", "24"))
    assert [row[-1] for row in rows] == [met] * 3


def test_two_walls_far_off_count_only_in_the_first_row():
    logs = np.zeros(50)
    logs[[22, 24]] = 1.0
    first, second, _ = _forces(walls(50), LeftOut(logs, {}), logs, ("22", "24"))
    assert (first[-1], second[-1]) == ("no", "yes")
    assert second[2].startswith("sd 0.000, median 1.00")


@pytest.mark.parametrize(("right", "met"), [(18, "yes"), (17, "yes"), (16, "no"), (12, "no")])
def test_modes_are_counted_of_all_walls(right, met):
    own = walls(20)
    theirs = {m.wall: WallPrediction(m.wall, "formulas", 1.0, 0.0, float(m.mode == "F"), "SL", "", 0.0) for m in own}
    found = [m.mode if k < right else "G" for k, m in enumerate(own)]
    row = _modes(own, found, theirs)
    assert row[-1] == met
    assert "formulas 10 and 20" in row[2]  # every second one slides where shear is printed


def test_plastic_section_without_bond_rocks_as_one_piece_does_under_its_load_alone():
    for name in ("22", "113"):  # both ends held: the top governs, without the weight
        test = experiments.load("modern-walls", name)
        assert plastic_section(test, 0.0) == pytest.approx(rocking_force(test), rel=1e-12)
        # bond as strong as the masonry: half of the section in tension, half in compression beyond N
        strength = 1e6 * float(test.row["fc"])
        assert plastic_section(test, 1e4) > plastic_section(test, 0.0)
        assert plastic_section(test, strength) > 2.0 * plastic_section(test, 0.0)
