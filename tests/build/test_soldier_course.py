"""Openings under a soldier course, and the plate that spreads a load: counts, closers, no gaps, wrong values."""

import numpy as np
import pytest
from wall_checks import deepest_overlap, parts, volume

import limitmason as lm
from limitmason import build

BRICK = (0.225, 0.075, 0.1025)
JOINT = lm.Joint(30.0, cohesion=5e4)


def panel(pier, below, above, **options):
    return build.wall(
        length=2.0 * pier + 2.025, courses=below + 3 + above, unit=BRICK, joint=JOINT, spreader=(0.225, 0.075),
        openings=[build.Opening(pier, 0.0, 2.025, 0.075 * below, head="soldier")], **options,
    )


@pytest.mark.parametrize("case", [(0.7875, 8, 4, 181), (0.675, 8, 5, 181), (1.35, 4, 3, 182)])
def test_panel_has_27_soldiers_half_brick_closers_and_no_gaps(case):
    pier, below, above, bricks = case
    wall = panel(pier, below, above)
    soldiers = [b for b in wall.blocks if b.name.startswith("soldier-1-")]
    assert (wall.n_blocks - 2, len(soldiers)) == (bricks, 27)  # beside the ground and the plate
    for k, b in enumerate(soldiers):
        low = (pier + 0.075 * k, 0.0, 0.075 * below)
        assert b.bounds == pytest.approx(np.array([low, np.add(low, (0.075, 0.1025, 0.225))]))
        assert b.axis.tolist() == [0.0, 0.0, 1.0]
    bricks = [b for b in wall.blocks if b.name.startswith("facade")]
    lengths = {round(float(np.ptp(b.bounds[:, 0])), 9) for b in bricks}
    assert lengths == {0.225, 0.1125}  # whole ones and halves
    low, high, _ = parts(wall)
    assert deepest_overlap(low, high) < 1e-9
    area = wall.recipe["length"] * wall.recipe["height"] - 2.025 * 0.075 * below
    assert volume(wall) == pytest.approx((area + 0.225 * 0.075) * 0.1025, rel=1e-12)
    # what stands on something is in contact over its whole foot
    for name in ("soldier-1-14", "spreader"):
        k = wall.block_index(name)
        x = wall.arrays
        level = ((x.block_a == k) | (x.block_b == k)) & (np.abs(x.normal[:, 2]) > 0.5)
        top = x.area[level].sum()
        assert top == pytest.approx((0.075 if "soldier" in name else 0.225) * 0.1025)


def test_soldiers_may_bear_on_the_wall():
    wall = build.wall(
        length=2.7, courses=8, unit=BRICK, joint=JOINT,
        openings=[build.Opening(0.9, 0.0, 0.9, 0.225, head="soldier", bearing=0.15)],
    )
    soldiers = [b for b in wall.blocks if b.name.startswith("soldier")]
    assert len(soldiers) == 16
    assert soldiers[0].bounds[0, 0] == pytest.approx(0.75)
    low, high, _ = parts(wall)
    assert deepest_overlap(low, high) < 1e-9
    assert volume(wall) == pytest.approx((2.7 * 0.6 - 0.9 * 0.225) * 0.1025, rel=1e-12)
    assert wall.recipe["openings"][0]["soldiers"] == 16
    assert wall.recipe["openings"][0]["bearing"] == pytest.approx(0.15)


@pytest.mark.parametrize(
    "opening, message",
    [
        ({"width": 1.0}, r"openings\[0\].head: soldiers of 0.075 m do not fill 1 m"),
        ({"lintel": 0.2}, r"openings\[0\].lintel is not used"),
        ({"head": "arch"}, r"openings\[0\].head must be one of"),
        ({"height": 0.525}, r"openings\[0\].head: the soldiers' top"),
        ({"bearing": 1.0}, r"openings\[0\].bearing 1 m reaches beyond"),
    ],
)
def test_wrong_openings_are_named(opening, message):
    given = {"x": 0.9, "z": 0.0, "width": 0.9, "height": 0.225, "head": "soldier", **opening}
    with pytest.raises(ValueError, match=message):
        build.wall(length=2.7, courses=8, unit=BRICK, joint=JOINT, openings=[given])


@pytest.mark.parametrize(
    "options, message",
    [
        ({"spreader": 0.2}, "spreader must be a pair"),
        ({"spreader": (3.0, 0.1)}, "spreader length 3 m is longer"),
        ({"spreader": (0.2, 0.0)}, "spreader height"),
        ({"spreader": (0.2, 0.1), "top_beam": 0.1}, "without a top beam"),
        ({"spreader": (0.2, 0.1), "plan": "L", "return_length": 1.0}, "straight wall"),
    ],
)
def test_wrong_plates_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        build.wall(length=2.7, courses=8, unit=BRICK, joint=JOINT, **options)
