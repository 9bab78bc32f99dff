"""A structure that falls under its dead load is never unbounded: the verdict, and the motion by which it falls."""

import numpy as np
import pytest
from walls import on_slab, running_bond, stack

import limitmason as lm
from limitmason import figures
from limitmason.geometry import box

FRICTION = lm.Joint.from_friction_coefficient(0.7)


def ledge(overhang, height=0.3):
    """A block of unit length that hangs over the edge of a fixed one by ``overhang``."""
    return lm.Assembly.from_polyhedra(
        [box((-1, 0, -1), (0, 1, 0)), box((overhang - 1, 0, 0), (overhang, 1, height))], joint=FRICTION, fixed=[0]
    )


@pytest.mark.parametrize("rule", ["associative", "non-associative"])
@pytest.mark.parametrize("in_plane", [None, False])
@pytest.mark.parametrize("overhang", [0.501, 0.6, 0.8])
def test_pressed_on_its_supported_end_a_block_that_overhangs_by_more_than_half_cannot_stand(rule, in_plane, overhang):
    assembly = ledge(overhang)
    at = (0.8 * (overhang - 1), 0.5, 0.3)
    loads = lm.Loads.weight(assembly).with_point_load(assembly, 1, (0, 0, -1e3), at=at)
    prediction = lm.limit_analysis(assembly, loads, rule, in_plane=in_plane)
    assert prediction.status == "cannot stand under dead load"
    assert np.isnan(prediction.collapse_multiplier)
    assert prediction.details["falling_blocks"] == ("block-1",)
    assert prediction.details["falling_margin"] > 0
    twist = prediction.mechanism.twists[1]
    assert (loads.dead[1] @ twist) > 0  # the weight does work
    assert twist[4] > 0  # and the block turns over the edge, x to z downwards


@pytest.mark.parametrize("rule", ["associative", "non-associative"])
@pytest.mark.parametrize("overhang", [0.3, 0.49])
def test_one_that_overhangs_by_less_than_half_carries_any_such_load(rule, overhang):
    assembly = ledge(overhang)
    at = (0.8 * (overhang - 1), 0.5, 0.3)
    loads = lm.Loads.weight(assembly).with_point_load(assembly, 1, (0, 0, -1e3), at=at)
    assert lm.limit_analysis(assembly, loads, rule).status == "unbounded"


@pytest.mark.parametrize("seed", range(6))
def test_random_leaning_stacks_stand_as_their_centres_of_weight_say(seed):
    rng = np.random.default_rng(seed)
    shift = np.cumsum(rng.uniform(0.0, 0.35, 4))
    boxes = [((s, 0, 0.3 * k), (s + 1, 0.6, 0.3 * (k + 1))) for k, s in enumerate(shift)]
    assembly = on_slab(boxes)
    centre = shift + 0.5
    # blocks k .. top stand on block k - 1 while their common centre lies over it (the slab is wide)
    stands = all(centre[k:].mean() < shift[k - 1] + 1.0 for k in range(1, 4))
    top = (shift[3] + 0.05, 0.3, 1.2)
    loads = lm.Loads.weight(assembly).with_point_load(assembly, 4, (0, 0, -500.0), at=top)
    prediction = lm.limit_analysis(assembly, loads)
    assert (prediction.status == "cannot stand under dead load") is not stands


@pytest.mark.parametrize("solver", ["clarabel", "interior-point"])
def test_the_falling_motion_can_be_drawn_and_saved(solver, tmp_path):
    wall = running_bond(3, 3)
    shelf = lm.Loads.weight(wall).with_point_load(wall, wall.n_blocks - 1, (4e5, 0, 0), case="dead")
    loads = lm.Loads(shelf.dead, lm.Loads.weight(wall).dead)
    prediction = lm.limit_analysis(wall, loads, solver=solver)
    assert prediction.status == "cannot stand under dead load"
    assert prediction.details["falling_blocks"]
    figures.mechanism(wall, prediction)
    from limitmason import formats

    formats.write_prediction(tmp_path / "p.json", prediction, assembly=wall)
    back = formats.read_prediction(tmp_path / "p.json")
    assert np.array_equal(back.mechanism.twists, prediction.mechanism.twists)


def test_a_fall_of_a_small_stack_is_seen_beside_a_very_large_block():
    solids = [box((-2, -2, -1), (2005, 1002, 0)), box((0, 0, 0), (1, 1, 1)), box((0.6, 0, 1), (1.6, 1, 2))]
    solids.append(box((1000, 0, 0), (2000, 1000, 1000)))
    assembly = lm.Assembly.from_polyhedra(solids, joint=FRICTION, fixed=[0], tolerance=1e-4)
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, (-1, 0, 0)))
    assert prediction.status == "cannot stand under dead load"
    assert "block-2" in prediction.details["falling_blocks"]
    assert "block-3" not in prediction.details["falling_blocks"]


def test_a_stack_that_stands_has_no_falling_blocks():
    assembly = stack([(1.0, 1.0), (0.8, 0.5)])
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly))
    assert "falling_blocks" not in prediction.details


def test_a_structure_that_falls_has_no_bounds():
    """An arch of t / R = 0.075 falls below 0.1075; it said 'no lower bound <= lambda <= nan'."""
    arch = lm.build.arch(radius=2.0, thickness=0.15, width=1.0, voussoirs=15, joint=lm.Joint(45.0))
    assert str(lm.limit_bracket(arch, lm.Loads.horizontal(arch))) == "no bounds of lambda: cannot stand under dead load"
