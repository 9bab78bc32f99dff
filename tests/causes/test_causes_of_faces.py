"""Causes that act on faces and on the thickness of joints, each against a closed form."""

import math

import numpy as np
import pytest
from cause_models import DENSITY, MU, PHI, block, extend, value, wall

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.geometry.polygon import polar_mean_radius


def test_rounded_block_rocks_about_its_pulled_in_edge():
    b, h, r = 0.2, 1.0, 8.0
    made, _ = block(b, h)
    model = (made, lm.Loads.horizontal(made))
    for options in ({}, {"plane_normal": (0.0, 1.0, 0.0)}):
        assert value(*extend("edge rounding", r, model, **options)) == pytest.approx((b - 2e-3 * r) / h, abs=1e-8)


def test_rounding_is_that_of_the_published_walls():
    test = lm.experiments.load("ferris-tin-loi-2001", "wall-1")
    extended = extend("edge rounding", 20.0, (test.assembly(), test.loads()), plane_normal=(0, 1, 0))[0]
    rounded = lm.experiments.load("ferris-tin-loi-2001", "wall-1", rounding=0.02).assembly()
    assert np.array_equal(extended.arrays.corners, rounded.arrays.corners)


def test_part_of_the_thickness_gives_part_of_the_lever_arm():
    t, h = 0.2, 1.0
    made, _ = block(b=0.5, h=h, t=t)
    loads = lm.Loads.horizontal(made, (0, 1, 0))
    assert value(*extend("effective thickness", 0.7, (made, loads))) == pytest.approx(0.7 * t / h, abs=1e-8)
    # a load in the plane of the wall does not feel it
    plane = (made, lm.Loads.horizontal(made))
    assert value(*extend("effective thickness", 0.7, plane)) == pytest.approx(value(*plane), abs=1e-8)


def three_units(joint):
    """Two held units side by side and one laid over their joint."""
    boxes = [((0, 0), (0.4, 0.2)), ((0.4, 0), (0.8, 0.2)), ((0.1, 0.2), (0.7, 0.4))]
    outlines = [[(x0, z0), (x1, z0), (x1, z1), (x0, z1)] for (x0, z0), (x1, z1) in boxes]
    return lm.Assembly.from_polygons(outlines, thickness=0.3, joint=joint, fixed=[0, 1], density=DENSITY)


def test_lost_overlap_shortens_bed_joints_at_head_joints_only():
    made = three_units(lm.Joint(PHI, cohesion=500.0))
    loads = lm.Loads.horizontal(made)
    weight = made.weights[2]
    for gap in (0.0, 20.0):
        got = value(*extend("lost overlap", gap, (made, loads)))
        assert got == pytest.approx(MU + 500.0 * (0.6 - 1e-3 * gap) * 0.3 / weight, rel=1e-8)
    short = extend("lost overlap", 20.0, (made, loads))[0]
    ends = sorted(x for i in short.interfaces if i.normal[2] > 0.9 for x in set(i.polygon[:, 0].round(9)))
    assert ends == pytest.approx([0.1, 0.39, 0.41, 0.7])


def test_lost_overlap_of_running_bond_and_too_much_of_it():
    made, loads = wall()
    before = [i for i in made.interfaces if i.kind == "bed"]
    after = [i for i in extend("lost overlap", 10.0, (made, loads))[0].interfaces if i.kind == "bed"]
    lost = [(np.ptp(p.polygon[:, 0]) - np.ptp(q.polygon[:, 0])) for p, q in zip(before, after, strict=True)]
    # ends of an overlap: both at head joints, or one of them at the end of the wall
    assert {round(1e3 * v, 6) for v in lost} == {5.0, 10.0}
    with pytest.raises(ValueError, match="head joint"):
        extend("lost overlap", 500.0, (made, loads))


@pytest.mark.parametrize("overlap", [10.0, 20.0, 80.0, 100.0, 180.0])
def test_an_overlap_that_is_lost_whole_is_refused_whatever_its_rounding(overlap):
    """A bed joint between two head joints loses its length: slivers of 1e-17 m2 were left, and a multiplier of NaN."""
    x = 0.4 + 1e-3 * overlap
    boxes = [((0, 0), (0.4, 0.2)), ((0.4, 0), (0.8, 0.2)), ((0, 0.2), (x, 0.4)), ((x, 0.2), (0.8, 0.4))]
    outlines = [[(x0, z0), (x1, z0), (x1, z1), (x0, z1)] for (x0, z0), (x1, z1) in boxes]
    made = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=lm.Joint(PHI), fixed=[0, 1])
    with pytest.raises(ValueError, match="is not longer than the .* m it loses at a head joint"):
        extend("lost overlap", overlap, (made, lm.Loads.weight(made)))


@pytest.mark.parametrize("width", [0.01, 0.02, 0.08, 0.09, 0.1])
def test_a_joint_pulled_in_by_half_its_width_is_refused_whatever_its_rounding(width):
    """Slivers of 2e-17 m2 were left, on which the block stood with a multiplier of 1e-16."""
    boxes = [((0, -1), (1, 0)), ((0.3, 0), (0.3 + width, 1))]
    outlines = [[(x0, z0), (x1, z0), (x1, z1), (x0, z1)] for (x0, z0), (x1, z1) in boxes]
    made = lm.Assembly.from_polygons(outlines, thickness=0.8, joint=lm.Joint(PHI), fixed=[0])
    with pytest.raises(ValueError, match="is not wider than twice the inset"):
        extend("edge rounding", 500.0 * width, (made, lm.Loads.weight(made)))


def test_open_head_joints_leave_single_blocks_to_rock():
    joint = lm.Joint(PHI)
    boxes = [(0.0, -0.2, 0.4, 0.0), (0.0, 0.0, 0.2, 1.0), (0.2, 0.0, 0.4, 1.0)]
    outlines = [[(x0, z0), (x1, z0), (x1, z1), (x0, z1)] for x0, z0, x1, z1 in boxes]
    made = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=joint, fixed=[0])
    model = (made, lm.Loads.horizontal(made))
    assert value(*extend("open head joints", 1.0, model)) == pytest.approx(0.2, abs=1e-8)
    assert value(*model) > 0.21  # rubbing on each other they hold more


def test_open_head_joints_are_nested():
    model = wall(courses=6)
    total = len(model[0].interfaces)
    heads = sum(i.kind == "head" for i in model[0].interfaces)
    gone = []
    for share in (0.25, 0.5, 1.0):
        left = {(i.block_a, i.block_b) for i in extend("open head joints", share, model)[0].interfaces}
        gone.append({(i.block_a, i.block_b) for i in model[0].interfaces} - left)
        assert total - len(left) == round(share * heads)
    assert gone[0] < gone[1] < gone[2]


@pytest.mark.parametrize("size", [1.0, 2.0])
def test_torsion_strength_divides_the_torsion_of_uniform_pressure(size):
    a = 0.4
    made, weight = block(b=a, h=0.2, t=a)
    wrench = np.zeros((made.n_blocks, 6))
    wrench[made.block_index("column-1"), 5] = 1.0
    loads = lm.Loads(lm.Loads.weight(made).dead, wrench)
    cause = catalogue.torsion_strength(bounds=(0.0, 2.0))
    radius = polar_mean_radius([(0, 0), (a, 0), (a, a), (0, a)], (a / 2, a / 2))
    got = value(made, loads, **{cause.parameter: size})
    assert got == pytest.approx(MU * weight * radius / size, rel=2e-3)
    free = value(made, loads, **{cause.parameter: cause.baseline})
    assert free == value(made, loads)
    assert free == pytest.approx(MU * weight * a / math.sqrt(2.0), rel=1e-6)
