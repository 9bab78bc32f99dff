"""Walls: counts, closed and bonded, free of overlaps."""

import numpy as np
import pytest
from wall_checks import (
    BRICK,
    JOINT,
    course_boxes,
    deepest_overlap,
    parts,
    plan_area,
    plans,
    smallest_overlap,
    volume,
    words,
)

from limitmason import Support, build

# ---- counts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("units", "courses", "blocks"), [(5, 10, 55), (10, 20, 210), (20, 40, 820), (39, 77, 3041)])
def test_benchmark_running_bond_counts(units, courses, blocks):
    wall = build.wall(length=0.4 * units, courses=courses, unit=BRICK, joint=JOINT)
    assert wall.n_blocks == blocks + 1
    # successive courses share two bed joints per unit length; head joints course by course
    whole, half = (courses + 1) // 2, courses // 2
    head = whole * (units - 1) + half * units
    assert len(wall.interfaces) == units + (courses - 1) * 2 * units + head


def test_benchmark_wall_starts_whole_and_closes_with_half_units():
    wall = build.wall(length=2.0, courses=4, unit=BRICK, joint=JOINT)
    for course, sizes in ((1, [0.4] * 5), (2, [0.2, *[0.4] * 4, 0.2]), (3, [0.4] * 5)):
        low, high, _ = course_boxes(wall, course)
        assert (high - low)[:, 0] == pytest.approx(sizes)
    minho = build.wall(length=1.0, courses=9, unit=(0.2, 0.1, 0.2), start="half", top_beam=0.1, joint=JOINT)
    low, high, _ = course_boxes(minho, 1)
    assert (high - low)[:, 0] == pytest.approx([0.1, 0.2, 0.2, 0.2, 0.2, 0.1])


# rows from the bottom, "a" and "b" being solid courses; layouts of Ferris and Tin-Loi 2001 (GAMS MPECLib, MIT licence)
_W3 = ["0.5 1 -1 1 0.5", "1 0.5 -1 0.5 1"]
_W4 = ["1 -1 1 -1 1", "0.5 0.5 -1 0.5 0.5 -1 0.5 0.5"]
_W5 = ["1 -1 1", "0.5 0.5 -1 0.5 0.5"]
_W6 = ["0.5 1 -1 1 1 -1 1 0.5", "1 0.5 -1 0.5 1 0.5 -1 0.5 1"]


def _solid(n, first_half, rows):
    half, whole = " ".join(["0.5", *["1"] * (n - 1), "0.5"]), " ".join(["1"] * n)
    return [half if (k % 2 == 0) == first_half else whole for k in range(rows)]


FERRIS_TIN_LOI = {
    1: (_solid(5, True, 6), 33, 83),
    2: (_solid(5, True, 10), 55, 141),
    3: (_solid(4, False, 3) + [_W3[k % 2] for k in range(5)] + _solid(4, False, 3), 46, 102),
    4: (_solid(5, True, 3) + [_W4[k % 2] for k in range(5)] + _solid(5, True, 3), 55, 116),
    5: (
        _solid(3, True, 3) + [_W5[k % 2] for k in range(5)] + _solid(3, True, 3) + [_W5[k % 2] for k in range(5)]
        + _solid(3, True, 3), 61, 120,
    ),
    6: (
        _solid(7, True, 4) + [_W6[k % 2] for k in range(5)] + _solid(7, False, 3) + [_W6[k % 2] for k in range(5)]
        + _solid(7, False, 4), 146, 345,
    ),
}


@pytest.mark.parametrize("number", FERRIS_TIN_LOI)
def test_ferris_tin_loi_2001_counts_of_blocks_and_contacts(number):
    rows, blocks, contacts = FERRIS_TIN_LOI[number]
    wall = build.layout(rows, unit=(0.4, 0.175), thickness=0.1, joint=JOINT)
    assert wall.n_blocks - 1 == blocks
    assert len(wall.interfaces) == contacts
    assert wall.recipe["staggering"] == pytest.approx(0.2)
    assert len(wall.recipe["openings"]) == {3: 1, 4: 2, 5: 2, 6: 4}.get(number, 0)


def test_layout_opening_in_recipe_is_its_rectangle():
    wall = build.layout(FERRIS_TIN_LOI[3][0], unit=(0.4, 0.175, 0.1), joint=JOINT)
    (opening,) = wall.recipe["openings"]
    assert [opening[k] for k in ("x", "z", "width", "height")] == pytest.approx([0.6, 3 * 0.175, 0.4, 5 * 0.175])


def test_rondelet_wallette_toothed_into_a_lateral_column():
    # odd courses reach half a block into the column, even ones butt against it; free edge flush or ragged
    flush = ["0.5 1 1 1 0.5" if k % 2 == 0 else "1 1 1 1" for k in range(13)]
    ragged = ["0.5 1 1 1" if k % 2 == 0 else "1 1 1 1" for k in range(13)]
    unit = (0.21, 0.081, 0.071)
    wall = build.layout(flush, unit=unit, joint=JOINT, column="left", base="course")
    assert [wall.blocks[wall.block_index(f"column-{k}")].volume for k in (1, 2)] == pytest.approx(
        [0.5 * np.prod(unit), np.prod(unit)]
    )
    assert volume(wall) == pytest.approx(4 * 13 * np.prod(unit))
    held = [block.name for block, fixed in zip(wall.blocks, wall.fixed, strict=True) if fixed]
    assert held == ["column-1", *(f"facade-01-{k:02d}" for k in range(1, 5))]
    assert wall.with_supports([Support("column-3", translations=True)]).held[wall.block_index("column-3"), :3].all()
    free = build.layout(ragged, unit=unit, joint=JOINT, column="left", ragged=True)
    assert free.n_blocks == 1 + 13 * 4
    right = build.layout([row[::-1].replace("5.0", "0.5") for row in flush], unit=unit, joint=JOINT, column="right")
    assert right.blocks[right.block_index("column-3")].centroid[0] > right.recipe["length"] - 0.21


# ---- closed, free of overlaps, bonded -------------------------------------------------------------------------------


@pytest.mark.parametrize("options", plans(), ids=words)
def test_wall_fills_its_plan_without_gaps_or_overlaps(options):
    wall = build.wall(courses=4, unit=BRICK, joint=JOINT, **options)
    low, high, names = parts(wall)
    assert volume(wall) == pytest.approx(plan_area(wall.recipe) * wall.recipe["height"], rel=1e-12)
    assert deepest_overlap(low, high) < 1e-9
    assert len(set(names)) == len(names)
    for course in range(1, 5):
        # closed course by course, not only on the whole
        a, b, _ = course_boxes(wall, course)
        assert (b - a).prod(axis=1).sum() == pytest.approx(plan_area(wall.recipe) * 0.2, rel=1e-12)


@pytest.mark.parametrize("options", plans(bonds=("running", "header")), ids=words)
def test_every_course_laps_the_one_below_by_a_quarter_of_a_unit_at_least(options):
    wall = build.wall(courses=4, unit=BRICK, joint=JOINT, **options)
    pitch = wall.recipe["unit_length"]
    measured = min(smallest_overlap(wall, 0), smallest_overlap(wall, 1))
    assert measured >= pitch / 4.0 - 1e-9
    # the recipe states the same distance, found from the course patterns instead of the blocks
    assert wall.recipe["smallest_overlap"] == pytest.approx(measured)


@pytest.mark.parametrize("options", plans(lengths=(2.2, 2.0), bonds=("english", "flemish")), ids=words)
def test_english_and_flemish_faces_lap_by_a_quarter_of_a_stretcher(options):
    wall = build.wall(courses=4, unit=BRICK, joint=JOINT, **options)
    low, high, names = parts(wall)
    faces = {}
    for a, b, _name in zip(low, high, names, strict=True):
        if a[1] < 1e-9:  # shows on the outer face of the facade
            faces.setdefault(round(a[2] / 0.2), []).append((a[0], b[0]))
    for course in range(3):
        inner = [[a for a, _ in sorted(faces[k])[1:]] for k in (course, course + 1)]
        assert min(abs(u - v) for u in inner[0] for v in inner[1]) >= 0.1 - 1e-9
    assert wall.recipe["smallest_overlap"] >= 0.1 - 1e-9


@pytest.mark.parametrize("unit", [(0.29, 0.225, 0.15), (0.4, 0.2, 0.4), (0.08, 0.04, 0.028), (0.2, 0.1, 0.19)])
@pytest.mark.parametrize("plan", ["L", "T", "U"])
def test_corners_lap_for_walls_thin_and_thick_against_their_units(unit, plan):
    wall = build.wall(
        length=5.3 * unit[0], courses=4, unit=unit, joint=JOINT, plan=plan, return_length=unit[2] + 2.4 * unit[0]
    )
    assert min(smallest_overlap(wall, 0), smallest_overlap(wall, 1)) >= 0.25 * unit[0] - 1e-9
    low, high, _ = parts(wall)
    assert deepest_overlap(low, high) < 1e-9
    assert volume(wall) == pytest.approx(plan_area(wall.recipe) * wall.recipe["height"])


@pytest.mark.parametrize(
    "options",
    [{"leaves": 1}, {"leaves": 2}, {"bond": "header"}, {"bond": "english"}, {"bond": "flemish"}],
    ids=words,
)
@pytest.mark.parametrize("plan", ["L", "T", "U"])
def test_corner_interlocks_facade_and_return_pass_through_in_turn(plan, options):
    wall = build.wall(length=2.6, courses=4, unit=BRICK, plan=plan, return_length=1.4, joint=JOINT, **options)
    t = wall.recipe["thickness"]
    for side in wall.recipe["returns"]:
        x0, x1 = side["x"]
        for course in range(1, 5):
            low, high, names = course_boxes(wall, course)
            inside = (low[:, 0] < x1 - 1e-9) & (high[:, 0] > x0 + 1e-9) & (low[:, 1] < t - 1e-9)
            owners = {names[k].split("-0")[0] for k in np.flatnonzero(inside)}
            assert owners == ({"facade"} if course % 2 else {side["name"]})
            # and one of them reaches out of the corner into its wall, over the joint of the courses above and below
            over_x = inside & ((high[:, 0] > x1 + 1e-9) | (low[:, 0] < x0 - 1e-9))
            over_y = inside & (high[:, 1] > t + 1e-9)
            assert (over_x if course % 2 else over_y).any()


@pytest.mark.parametrize("bond", ["running", "header", "english", "flemish"])
@pytest.mark.parametrize("length", [2.0, 2.2, 2.35, 1.93])
def test_u_plan_is_its_own_mirror_image(bond, length):
    wall = build.wall(length=length, courses=4, unit=BRICK, bond=bond, plan="U", return_length=1.1, joint=JOINT)
    low, high, _ = parts(wall)
    mirrored = np.stack([low, high])
    mirrored[0, :, 0], mirrored[1, :, 0] = length - high[:, 0], length - low[:, 0]
    a = {tuple(np.round(np.concatenate(pair), 9) + 0.0) for pair in zip(low, high, strict=True)}
    b = {tuple(np.round(np.concatenate(pair), 9) + 0.0) for pair in zip(mirrored[0], mirrored[1], strict=True)}
    assert a == b


def test_l_plan_with_corner_right_mirrors_corner_left():
    walls = [
        build.wall(length=2.2, courses=2, unit=BRICK, plan="L", return_length=1.0, corner=corner, joint=JOINT)
        for corner in ("left", "right")
    ]
    low, high, _ = parts(walls[0])
    mirror_low, mirror_high, _ = parts(walls[1])
    a = {(*np.round(p, 9), *np.round(q, 9)) for p, q in zip(low, high, strict=True)}
    b = {
        (round(2.2 - q[0], 9) + 0.0, *np.round(p[1:], 9), round(2.2 - p[0], 9) + 0.0, *np.round(q[1:], 9))
        for p, q in zip(mirror_low, mirror_high, strict=True)
    }
    assert a == b


def test_staggering_is_the_overlap_everywhere_in_a_straight_wall():
    for staggering in (0.1, 0.13, 0.2):
        wall = build.wall(length=2.83, courses=4, unit=BRICK, staggering=staggering, joint=JOINT)
        assert smallest_overlap(wall, 0) == pytest.approx(staggering)
        assert wall.recipe["staggering"] == staggering


def test_pieces_shorter_than_min_piece_join_their_neighbour():
    cut = build.wall(length=2.05, courses=2, unit=BRICK, min_piece=0.04, joint=JOINT)
    merged = build.wall(length=2.05, courses=2, unit=BRICK, min_piece=0.06, joint=JOINT)
    low, high, _ = course_boxes(cut, 1)
    assert (high - low)[-1, 0] == pytest.approx(0.05)
    low, high, _ = course_boxes(merged, 1)
    assert (high - low)[-1, 0] == pytest.approx(0.45)


def test_ragged_ends_are_whole_units_only():
    wall = build.wall(length=2.2, courses=4, unit=BRICK, ends="ragged", joint=JOINT)
    low, high, _ = parts(wall)
    assert (high - low)[:, 0] == pytest.approx(0.4)
    assert wall.n_blocks == 1 + 4 * 5
    one = build.wall(length=2.0, courses=2, unit=BRICK, ends=("flush", "ragged"), joint=JOINT)
    low, high, _ = course_boxes(one, 2)
    assert (low[0, 0], high[-1, 0]) == pytest.approx((0.0, 1.8))
