"""Walls: leaves, headers, openings, bases, beams, recipes and errors."""

import json

import numpy as np
import pytest
from wall_checks import BRICK, JOINT, course_boxes, deepest_overlap, parts, volume

from limitmason import Joint, build

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


def test_leaves_side_by_side_share_a_position_in_every_run():
    wall = build.wall(length=2.0, courses=2, unit=BRICK, leaves=2, plan="box", return_length=2.0, joint=JOINT)
    places = {b.name: b.centroid for b in wall.blocks}
    for run, axis in (("facade", 0), ("return-left", 1), ("return-right", 1), ("rear", 0)):
        pairs = [(places[n], places[f"{n[:-1]}b"]) for n in places if n.startswith(run) and n.endswith("a")]
        assert len(pairs) > 6
        assert all(a[axis] == pytest.approx(b[axis]) for a, b in pairs)


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


def test_a_lintel_of_one_metre_is_as_high_as_it_says():
    opening = build.Opening(1.2, 0.8, 0.8, 0.8, lintel=1.0)
    wall = build.wall(length=4.0, courses=16, unit=BRICK, openings=[opening], joint=JOINT)
    assert np.ptp(wall.blocks[wall.block_index("lintel-1")].bounds[:, 2]) == pytest.approx(1.0)
    assert wall.recipe["openings"][0]["lintel"] == pytest.approx(1.0)


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
    )
    recipe = json.loads(json.dumps(wall.recipe))
    assert recipe == wall.recipe
    expected = {
        "kind": "wall", "plan": "U", "bond": "running", "length": 2.25, "thickness": 0.3, "courses": 6,
        "unit_length": 0.29, "unit_height": 0.225, "staggering": 0.144, "side_walls": 2, "side_wall_thickness": 0.3,
        "leaves": 2, "density": 2450.0,
    }
    assert {key: recipe[key] for key in expected} == expected
    assert recipe["height"] == pytest.approx(1.35)
    assert [r["length"] for r in recipe["returns"]] == [1.0, 1.0]


GOOD = {"length": 2.0, "courses": 4, "unit": BRICK, "joint": JOINT}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": 0.0}, "length must be positive"),
        ({"length": float("nan")}, "length must be a finite number"),
        ({"courses": 2.5}, "courses must be a whole number"),
        ({"courses": None, "height": 0.5}, "height 0.5 m is not a whole number of courses"),
        ({"height": 0.8}, "exactly one of height and courses"),
        ({"unit": (0.4, 0.2)}, "unit must be"),
        ({"unit": (0.4, -0.2, 0.2)}, "unit height"),
        ({"bond": "stretcher"}, "bond must be one of"),
        ({"bond": "english", "unit": (0.4, 0.2, 0.25)}, "twice as long as thick"),
        ({"bond": "english", "leaves": 2}, "leaves is for running bond"),
        ({"leaves": 27}, "leaves must be at most 26, got 27"),
        ({"bond": "flemish", "staggering": 0.1}, "staggering"),
        ({"staggering": 0.3}, "staggering"),
        ({"min_piece": 0.3}, "min_piece"),
        ({"plan": "L"}, "return_length is needed"),
        ({"plan": "L", "return_length": 0.1}, "return_length"),
        ({"return_length": 1.0}, "return_length is given but plan is 'straight'"),
        ({"corner": "left"}, "corner is for plan 'L', got plan 'straight'"),
        ({"plan": "T", "return_length": 1.0, "corner": "right"}, "corner is for plan 'L', got plan 'T'"),
        ({"plan": "U", "return_length": 1.0, "corner": "left"}, "corner is for plan 'L', got plan 'U'"),
        ({"plan": "box", "return_length": 1.0, "corner": "left"}, "corner is for plan 'L', got plan 'box'"),
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


def test_ten_thousand_units_are_laid(monkeypatch):
    from limitmason.build import erect

    class Counted:
        @staticmethod
        def from_polyhedra(solids, **options):
            return len(solids)

    # only the laying is tried here; finding the contacts is the model's business
    monkeypatch.setattr(erect, "Assembly", Counted)
    number = build.wall(length=0.4 * 71, courses=141, unit=BRICK, joint=JOINT)
    assert number == 1 + 71 * 71 + 70 * 72


@pytest.mark.parametrize("options, message", [
    ({"beam_density": 2500.0}, "beam_density is given but neither top_beam nor spreader is"),
    ({"lintel_density": 2500.0}, "lintel_density is given but no opening has a lintel"),
    ({"base": None, "base_margin": 0.5}, "base_margin is of the slab, and base is None"),
    ({"openings": [build.Opening(0.4, 0.1, 0.2, 0.1, lintel=False, bearing=0.2)]}, r"openings\[0\].bearing"),
    ({"openings": [build.Opening(0.4, 0.2, 0.2, 0.2, head="soldier")]}, r"openings\[0\].head: the soldiers' top"),
    ({"openings": [build.Opening(0.4, 0.2, 0.2, 0.2, bearing=0.1)]}, r"openings\[0\].lintel: its top"),
    ({"openings": None}, "openings must be a list"),
])
def test_what_a_wall_has_no_use_for_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        build.wall(length=1.0, courses=4, unit=(0.25, 0.1, 0.1), joint=JOINT, **options)


def test_a_layout_refuses_the_density_of_a_beam_that_is_not_there():
    with pytest.raises(ValueError, match="beam_density is given but top_beam is not"):
        build.layout(["1 1"], unit=BRICK, joint=JOINT, beam_density=2500.0)
    with pytest.raises(ValueError, match="unit length must be a finite number, got 'a'"):
        build.layout(["1 1"], unit=("a", 1.0, 2.0), joint=JOINT)
