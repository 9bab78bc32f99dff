"""Falling branches of walls whose contact ends are pulled in, beside UDEC and LMGC90 as far as 200 mm."""

import numpy as np
import pytest
from pulled_in_ends import AT, between, check_falling_branch, check_frames_of_pairs, rounded

from limitmason.capacity import Steps


@pytest.mark.slow
@pytest.mark.parametrize("name, to", [("wall-1", 0.03), ("wall-3", 0.06)])
def test_falling_branches_lie_beside_udec_and_lmgc90(name, to):
    check_falling_branch(name, to)


@pytest.mark.slow
@pytest.mark.parametrize("name, to", [("wall-1", 0.029), ("wall-2", 0.038)])
def test_frames_as_in_programs_of_contact_pairs_lie_beside_both_programs_with_20_mm(name, to):
    check_frames_of_pairs(name, to)


@pytest.mark.slow
def test_the_falling_branch_of_wall_1_does_not_depend_on_the_steps():
    """Near 107 mm one of two points lets go of a block; a step over it may end with the other open: another curve."""
    load = {}
    for largest in (0.04, 0.02, 0.01):
        # 0.04 is the default, whose curve has its peak compared elsewhere
        steps = None if largest == Steps().largest else Steps(largest=largest)
        moved, curve = rounded("wall-1", 0.02, 1e8, 0.0318, steps=steps)
        assert moved[-1] > 200.0
        assert not curve.jumps
        assert all(c.accepted for c in curve.certificates)
        load[largest] = np.interp((*AT, 120, 180), moved, curve.load)
    for largest in (0.04, 0.02):
        assert load[largest] == pytest.approx(load[0.01], rel=5e-3)
    assert load[0.01][:4] == pytest.approx(between("wall-1"), rel=0.065)
    # where points may open and stick as far as they like in a step, falls within it are found by their tangents
    moved, curve = rounded("wall-1", 0.02, 1e8, 0.0318, steps=Steps(largest=0.01, opening=1.0, sliding=1.0))
    assert np.interp(200.0, moved, curve.load) == pytest.approx(load[0.01][3], rel=5e-3)
