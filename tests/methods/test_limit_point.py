"""What a limit point is: made-up curves with dips and level stretches, judged by hand."""

import numpy as np
import pytest

from limitmason.capacity.limit_point import first_limit_point, plateau

SIZE, LENGTH = 0.3, 1e-5
RISE = np.linspace(0.0, 1.0, 5)


@pytest.mark.parametrize(
    ("after", "found"),
    [
        ([0.9985, 1.1], None),  # a dip of 0.15 %
        ([0.997, 1.1], 4),  # of 0.3 %
        ([1.0] * 5 + [1.1], 4),  # level while the displacement doubles
        ([1.0] * 4 + [1.1], None),
        ([1.0] * 3, None),  # level at the end, not for long
        ([1.0] * 5, 4),
        ([0.9999], 4),  # lower at the end
    ],
)
def test_a_limit_point_is_passed_by_a_fall_by_lasting_or_at_the_end(after, found):
    load = np.append(RISE, after)
    way = np.cumsum(np.append(0.0, np.full(len(load) - 1, LENGTH)))
    assert first_limit_point(load, way, np.zeros(len(load)), SIZE, LENGTH) == found


def test_what_contacts_found_anew_take_off_is_no_fall():
    load = np.append(RISE, [0.99, 1.1])
    lacks, way = np.array([0.0] * 5 + [0.01, 0.0]), np.arange(7.0)
    assert first_limit_point(load, way, 0.0 * lacks, SIZE, LENGTH) == 4
    assert first_limit_point(load, way, lacks, SIZE, LENGTH) is None


def test_a_plateau_lasts_over_samples_that_go_somewhere_or_over_a_part_of_a_block():
    load = np.append(RISE, np.ones(5))
    way = LENGTH * np.arange(10.0)
    assert plateau(load, way, SIZE, LENGTH) == 4
    assert plateau(load, 1e-3 * way, SIZE, LENGTH) is None
    assert plateau(load[:-3], way[:-3], SIZE, LENGTH) is None
    assert plateau(load[:-3], 500.0 * way[:-3], SIZE, LENGTH) == 4
