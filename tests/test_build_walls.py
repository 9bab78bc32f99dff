"""Geometry of built walls from first principles: closed, free of overlaps, bonded, counted, cut where openings are."""

import itertools
import json
import time

import numpy as np
import pytest

from limitmason import Joint, Support, build

JOINT = Joint(33.0)
BRICK = (0.4, 0.2, 0.2)  # twice as long as thick: every bond can be laid with it


def parts(assembly, *, without=("base",)):
    """Lower and upper corners of every convex piece, and the name of its block."""
    low, high, names = [], [], []
    for block in assembly.blocks:
        if block.name not in without:
            for part in block.parts:
                low.append(part.vertices.min(axis=0))
                high.append(part.vertices.max(axis=0))
                names.append(block.name)
    return np.array(low), np.array(high), names


def volume(assembly, *, without=("base",)):
    return sum(block.volume for block in assembly.blocks if block.name not in without)


def plan_area(recipe):
    area = recipe["length"] * recipe["thickness"]
    return area + sum((r["length"] - recipe["thickness"]) * r["thickness"] for r in recipe["returns"])


def deepest_overlap(low, high):
    """Largest, over all pairs of boxes, of the smallest side of their intersection; not above zero if none overlap."""
    side = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    depth = side.min(axis=2)
    np.fill_diagonal(depth, -np.inf)
    return depth.max()


def course_boxes(assembly, course):
    """Boxes of one course, counted from 1, by name."""
    low, high, names = parts(assembly)
    chosen = [k for k, name in enumerate(names) if f"-{course:02d}-" in name]
    return low[chosen], high[chosen], [names[k] for k in chosen]


def head_joints(assembly, course, axis):
    """Vertical joint planes of a course normal to `axis`: (position, from, to along the other axis)."""
    low, high, _ = course_boxes(assembly, course)
    other, found = 1 - axis, []
    for i, j in itertools.permutations(range(len(low)), 2):
        a, b = max(low[i, other], low[j, other]), min(high[i, other], high[j, other])
        if abs(high[i, axis] - low[j, axis]) < 1e-9 and b - a > 1e-9:
            found.append((high[i, axis], a, b))
    return found


def smallest_overlap(assembly, axis):
    """Smallest distance between parallel head joints of successive courses that lie one over the other."""
    nearest = np.inf
    for course in range(1, assembly.recipe["courses"]):
        pairs = itertools.product(head_joints(assembly, course, axis), head_joints(assembly, course + 1, axis))
        for (u, a, b), (v, c, d) in pairs:
            if min(b, d) - max(a, c) > 1e-9:
                nearest = min(nearest, abs(u - v))
    return nearest


def plans(lengths=(2.2, 2.07), bonds=("running", "header", "english", "flemish")):
    shapes = [
        {},
        {"plan": "L", "return_length": 1.33},
        {"plan": "L", "return_length": 1.2, "corner": "right"},
        {"plan": "T", "return_length": 1.2},
        {"plan": "T", "return_length": 1.2, "return_position": 0.9},
        {"plan": "U", "return_length": (1.2, 1.5)},
    ]
    return [{"bond": b, "length": x, **shape} for b, x, shape in itertools.product(bonds, lengths, shapes)]


def words(options):
    return "-".join(str(value) for value in options.values())


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
}  # fmt: skip


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


# ---- leaves, headers, axes ------------------------------------------------------------------------------------------


def test_two_leaves_are_tied_by_through_stones_only():
    unit, plain = (0.29, 0.225, 0.15), {"length": 2.25, "height": 1.35, "joint": JOINT, "leaves": 2}
    loose = build.wall(unit=unit, **plain)
    tied = build.wall(unit=unit, header_every=(2, 3), **plain)
    assert all(name.endswith(("a", "b")) for name in parts(loose)[2])
    low, high, names = parts(tied)
    through = (high - low)[:, 1] > 0.29
    assert through.any()
    assert not any(name.endswith(("a", "b")) for name, one in zip(names, through, strict=True) if one)
    courses = {int(name.split("-")[1]) for name, one in zip(names, through, strict=True) if one}
    assert courses == {2, 4, 6}
    assert volume(tied) == pytest.approx(volume(loose)) == pytest.approx(2.25 * 1.35 * 0.3)
    for name, one in zip(names, through, strict=True):
        assert tied.blocks[tied.block_index(name)].axis == pytest.approx([0, 1, 0] if one else [1, 0, 0])


def test_outer_leaf_is_a_in_facade_and_returns():
    wall = build.wall(length=2.4, courses=2, unit=BRICK, leaves=2, plan="U", return_length=1.6, joint=JOINT)
    where = {block.name: block.centroid for block in wall.blocks}
    assert where["facade-01-03a"][1] < where["facade-01-03b"][1]
    assert where["return-left-01-02a"][0] < where["return-left-01-02b"][0]
    assert where["return-right-01-02a"][0] > where["return-right-01-02b"][0]


def test_axes_are_the_laid_directions():
    english = build.wall(length=2.0, courses=2, unit=BRICK, bond="english", plan="L", return_length=1.2, joint=JOINT)
    axes = {block.name: block.axis for block in english.blocks}
    assert axes["facade-01-01"] == pytest.approx([0, 1, 0])  # the quoin is a header
    assert axes["facade-01-02a"] == pytest.approx([1, 0, 0])
    assert axes["facade-02-02"] == pytest.approx([0, 1, 0])
    assert axes["return-left-02-02a"] == pytest.approx([0, 1, 0])
    assert axes["return-left-01-01"] == pytest.approx([1, 0, 0])
    assert axes["base"] is None


def test_straight_english_bond_is_the_textbook_one():
    wall = build.wall(length=1.6, courses=2, unit=BRICK, bond="english", joint=JOINT)
    low, high, _ = course_boxes(wall, 2)
    # header, queen closer, headers, queen closer, header
    assert (high - low)[:, 0] == pytest.approx([0.2, 0.1, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1, 0.2])


def test_straight_flemish_bond_is_the_textbook_one():
    wall = build.wall(length=1.6, courses=2, unit=BRICK, bond="flemish", joint=JOINT)
    low, high, _ = course_boxes(wall, 1)
    assert (high - low)[low[:, 1] < 0.1, 0] == pytest.approx([0.4, 0.2, 0.4, 0.2, 0.4])
    low, high, _ = course_boxes(wall, 2)
    assert (high - low)[low[:, 1] < 0.1, 0] == pytest.approx([0.2, 0.1, 0.4, 0.2, 0.4, 0.1, 0.2])


# ---- openings, base, beam -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bond", ["running", "english", "flemish"])
@pytest.mark.parametrize(
    "openings",
    [
        [build.Opening(1.2, 0.8, 0.8, 0.8)],
        [build.Opening(1.23, 0.85, 0.8, 0.83, lintel=0.25, bearing=0.17), build.Opening(2.7, 0.0, 0.55, 1.6)],
        [build.Opening(1.21, 0.8, 0.3, 1.6)],
        [{"x": 1.0, "z": 0.4, "width": 0.15, "height": 0.1, "lintel": False}],
    ],
    ids=["on-joints", "across-joints", "to-the-top", "inside-a-course"],
)
def test_openings_take_out_exactly_their_volume(openings, bond):
    wall = build.wall(length=4.0, courses=12, unit=BRICK, bond=bond, openings=openings, joint=JOINT)
    recipe = wall.recipe
    gone = sum(o["width"] * o["height"] for o in recipe["openings"]) * recipe["thickness"]
    assert volume(wall) == pytest.approx(4.0 * 2.4 * recipe["thickness"] - gone, rel=1e-12)
    low, high, _ = parts(wall)
    assert deepest_overlap(low, high) < 1e-9
    holes = np.array([[o["x"], 0, o["z"], o["x"] + o["width"], 1, o["z"] + o["height"]] for o in recipe["openings"]])
    for hole in holes:
        assert deepest_overlap(np.vstack([low, hole[:3]]), np.vstack([high, hole[3:]])) < 1e-9


def test_lintel_is_one_block_with_the_stated_bearing_on_both_jambs():
    opening = build.Opening(1.2, 0.8, 0.8, 0.8, bearing=0.15)
    wall = build.wall(length=4.0, courses=12, unit=BRICK, openings=[opening], lintel_density=2600.0, joint=JOINT)
    lintel = wall.blocks[wall.block_index("lintel-1")]
    assert lintel.bounds == pytest.approx(np.array([[1.05, 0.0, 1.6], [2.15, 0.2, 1.8]]))
    assert lintel.mass == pytest.approx(2600.0 * 1.1 * 0.2 * 0.2)
    number = wall.block_index("lintel-1")
    below = [i.polygon for i in wall.interfaces if number in (i.block_a, i.block_b) and np.ptp(i.polygon[:, 2]) < 1e-9]
    bearings = [p for p in below if abs(p[0, 2] - 1.6) < 1e-9]
    assert sum(np.ptp(p[:, 0]) for p in bearings) == pytest.approx(0.30)
    assert wall.recipe["openings"][0]["bearing"] == pytest.approx(0.15)


def test_cut_unit_shorter_than_min_piece_joins_its_neighbour():
    # 0.05 m of the unit from 0.8 to 1.2 m would remain beside the jamb at 0.85 m
    opening = build.Opening(0.85, 0.4, 0.6, 0.2, lintel=False)
    wall = build.wall(length=2.4, courses=4, unit=BRICK, openings=[opening], joint=JOINT)
    low, high, _ = course_boxes(wall, 3)
    assert (low[:, 0], high[:, 0]) == (
        pytest.approx([0, 0.4, 1.45, 1.6, 2.0]),
        pytest.approx([0.4, 0.85, 1.6, 2.0, 2.4]),
    )


def test_base_slab_is_held_and_carries_every_unit_of_the_bottom_course():
    wall = build.wall(length=2.2, courses=3, unit=BRICK, plan="U", return_length=1.2, joint=JOINT)
    assert [b.name for b, f in zip(wall.blocks, wall.fixed, strict=True) if f] == ["base"]
    bottom = len(course_boxes(wall, 1)[2])
    assert sum(i.kind == "base" for i in wall.interfaces) == bottom
    course = build.wall(length=2.2, courses=3, unit=BRICK, base="course", joint=JOINT)
    assert course.fixed.sum() == len(course_boxes(course, 1)[2])
    assert "base" not in [b.name for b in course.blocks]


def test_top_beams():
    options = {"length": 2.2, "courses": 3, "unit": BRICK, "plan": "U", "return_length": 1.2, "joint": JOINT}
    wall = build.wall(top_beam=0.1, beam_over="all", beam_density=7850.0, **options)
    beams = {b.name: b for b in wall.blocks if b.name.startswith("beam")}
    assert set(beams) == {"beam", "beam-left", "beam-right"}
    assert beams["beam"].mass == pytest.approx(7850.0 * 2.2 * 0.2 * 0.1)
    assert beams["beam-left"].bounds == pytest.approx(np.array([[0.0, 0.2, 0.6], [0.2, 1.2, 0.7]]))
    low, high, _ = parts(wall)
    assert deepest_overlap(low, high) < 1e-9


def test_joints_by_kind():
    bed, base = Joint(20.0), Joint(10.0)
    wall = build.wall(length=2.0, courses=3, unit=BRICK, joint=JOINT, joints={"bed": bed, "base": base})
    laws = {kind: {i.joint for i in wall.interfaces if i.kind == kind} for kind in ("bed", "base", "head")}
    assert laws == {"bed": {bed}, "base": {base}, "head": {JOINT}}


# ---- recipe, errors, speed ------------------------------------------------------------------------------------------


def test_recipe_is_plain_data_with_what_mechanisms_read():
    wall = build.wall(
        length=2.25, height=1.35, unit=(0.29, 0.225, 0.15), leaves=2, staggering=0.144, plan="U", return_length=1.0,
        openings=[build.Opening(0.8, 0.45, 0.5, 0.45)], joint=JOINT, density=2450.0,
    )  # fmt: skip
    recipe = json.loads(json.dumps(wall.recipe))
    assert recipe == wall.recipe
    expected = {
        "kind": "wall", "plan": "U", "bond": "running", "length": 2.25, "thickness": 0.3, "courses": 6,
        "unit_length": 0.29, "unit_height": 0.225, "staggering": 0.144, "side_walls": 2, "side_wall_thickness": 0.3,
        "leaves": 2, "density": 2450.0,
    }  # fmt: skip
    assert {key: recipe[key] for key in expected} == expected
    assert recipe["height"] == pytest.approx(1.35)
    assert [r["length"] for r in recipe["returns"]] == [1.0, 1.0]


GOOD = {"length": 2.0, "courses": 4, "unit": BRICK, "joint": JOINT}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": 0.0}, "length must be above zero"),
        ({"length": float("nan")}, "length must be finite"),
        ({"courses": 2.5}, "courses must be a whole number"),
        ({"courses": None, "height": 0.5}, "height 0.5 m is not a whole number of courses"),
        ({"height": 0.8}, "exactly one of height and courses"),
        ({"unit": (0.4, 0.2)}, "unit must be"),
        ({"unit": (0.4, -0.2, 0.2)}, "unit height"),
        ({"bond": "stretcher"}, "bond must be one of"),
        ({"bond": "english", "unit": (0.4, 0.2, 0.25)}, "twice as long as thick"),
        ({"bond": "english", "leaves": 2}, "leaves is for running bond"),
        ({"bond": "flemish", "staggering": 0.1}, "staggering"),
        ({"staggering": 0.3}, "staggering"),
        ({"min_piece": 0.3}, "min_piece"),
        ({"plan": "L"}, "return_length is needed"),
        ({"plan": "L", "return_length": 0.1}, "return_length"),
        ({"return_length": 1.0}, "return_length is given but plan is 'straight'"),
        ({"plan": "U", "return_length": 1.0, "length": 0.4}, "length 0.4 m leaves no facade"),
        ({"plan": "T", "return_length": 1.0, "return_position": 0.05}, "return_position"),
        ({"header_every": (2, 2)}, "header_every"),
        ({"density": -1.0}, "density"),
        ({"ends": "rough"}, "ends must be one of"),
        ({"bond": "english", "ends": "ragged"}, "ragged"),
        ({"base": "rock"}, "base must be one of"),
        ({"beam_over": "returns"}, "beam_over"),
        ({"top_beam": 0.1, "beam_over": "returns"}, "beam_over"),
        ({"openings": [(1, 1, 1, 1)]}, r"openings\[0\]"),
        ({"openings": [build.Opening(1.8, 0.2, 0.4, 0.2)]}, r"openings\[0\].*leaves the facade"),
        ({"openings": [build.Opening(0.1, 0.2, 0.4, 0.2)]}, r"openings\[0\].bearing"),
        ({"openings": [build.Opening(0.8, 0.21, 0.4, 0.19)]}, r"openings\[0\].z.*slice"),
        ({"openings": [build.Opening(0.8, 0.2, 0.4, 0.4, lintel=0.5)]}, r"openings\[0\].lintel"),
        (
            {"openings": [build.Opening(0.4, 0.2, 0.4, 0.2), build.Opening(0.7, 0.2, 0.4, 0.2)]},
            r"overlaps openings\[0\]",
        ),
        (
            {"plan": "L", "return_length": 1.0, "openings": [build.Opening(0.3, 0.2, 0.4, 0.2)]},
            "cuts into return-left",
        ),
    ],
    ids=lambda value: str(value)[:60] if isinstance(value, dict) else "",
)
def test_errors_name_the_argument(change, message):
    with pytest.raises(ValueError, match=message):
        build.wall(**{**GOOD, **change})


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "rows"),
        (["1 1", "0.5 1"], r"rows\[1\] is 1.5 block lengths"),
        (["1 x"], r"rows\[0\]"),
        (["1 0 1"], "zero width"),
        (["1", "-1"], r"rows\[1\] has no block"),
    ],
)
def test_layout_errors_name_the_row(rows, message):
    with pytest.raises(ValueError, match=message):
        build.layout(rows, unit=BRICK, joint=JOINT)


def test_ten_thousand_units_are_laid_in_a_fraction_of_a_second(monkeypatch):
    from limitmason.build import erect

    class Counted:
        @staticmethod
        def from_polyhedra(solids, **options):
            return len(solids)

    # only the laying is timed here; finding the contacts is the model's business
    monkeypatch.setattr(erect, "Assembly", Counted)
    start = time.perf_counter()
    number = build.wall(length=0.4 * 71, courses=141, unit=BRICK, joint=JOINT)
    assert number == 1 + 71 * 71 + 70 * 72
    assert time.perf_counter() - start < 1.0
