"""Modes against six one-axis accelerometers: as a table of a test gives them, with its own frequencies."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.errors import InputError
from limitmason.vibration import ModalTest

PLAN = [
    ((0.2, 0.0, 0.6), "y"), ((1.0, 0.0, 1.2), "-y"), ((0.2, 0.0, 1.2), "y"), ((1.8, 0.0, 1.2), "y"),
    ((0.0, 0.1, 1.2), "x"), ((2.0, 0.1, 0.6), "-x"),
]
AXIS = np.array([[0, 1, 0], [0, -1, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0.0]])
HZ = np.array([7.7, 21.0, 46.0])


@pytest.fixture(scope="module")
def found():
    joint = lm.Joint(35.0, normal_stiffness=5e9, shear_stiffness=2e9)
    return lm.modes(lm.build.wall(length=2.0, courses=6, unit=(0.4, 0.2, 0.2), joint=joint), count=4)


@pytest.fixture(scope="module")
def read(found):
    """What the six sensors read of modes 2, 1 and 4, in any scale: by hand from the model's motion at their points."""
    motion = found.at([point for point, _ in PLAN])[[1, 0, 3]]
    return (motion * AXIS).sum(axis=2) * np.array([[-3.0], [0.2], [7.0]])


def test_a_table_of_six_accelerometers_names_its_modes_and_keeps_its_frequencies(found, read):
    test = ModalTest(PLAN, HZ, read)
    for alike in (lm.mac(test, found), lm.mac(read, found, sensors=PLAN, frequencies=HZ)):
        assert [(i, j) for i, j, _ in alike.pairs] == [(0, 1), (1, 0), (2, 3)]
        np.testing.assert_allclose([v for *_, v in alike.pairs], 1.0, atol=1e-12)
        assert "7.7" in str(alike).splitlines()[1]
        assert "nan" not in str(alike)
    # any other entry by the formula
    other = (found.at([point for point, _ in PLAN])[2] * AXIS).sum(axis=1)
    by_hand = (read[0] @ other) ** 2 / (read[0] @ read[0]) / (other @ other)
    assert lm.mac(read, found, sensors=PLAN).values[0, 2] == pytest.approx(by_hand, rel=1e-9)
    # two tests beside each other, each with its frequencies
    both = lm.mac(read, -read[::-1], sensors=PLAN, frequencies=(HZ, 1.1 * HZ[::-1]))
    assert [(i, j) for i, j, _ in both.pairs] == [(0, 2), (1, 1), (2, 0)]
    assert "8.47" in str(both)
    assert both.plot().axes


def test_zeros_where_nothing_was_measured_are_refused_and_nan_says_so(found, read):
    # only y was measured: (k, p, 3) filled with zeros once gave 0.31 for the right mode
    points = np.array([p for p, _ in PLAN])
    y_only = np.zeros((3, 6, 3))
    y_only[:, :, 1] = found.at(points)[[0, 1, 3], :, 1]
    with pytest.raises(InputError, match=r"zero along x at every point.*NaN instead of zero, or sensors="):
        lm.mac(found, y_only, points=points)
    said = np.where(y_only == 0.0, np.nan, y_only)
    assert np.diag(lm.mac(found, said, points=points).values[[0, 1, 3]]) == pytest.approx(1.0)
    # a dead channel
    dead = read.copy()
    dead[:, 1] = 0.0
    with pytest.raises(InputError, match="sensor 1 reads zero in every shape of the second set"):
        lm.mac(found, dead, sensors=PLAN)
    dead[:, 1] = np.nan
    assert [j for _, j, _ in lm.mac(dead, found, sensors=PLAN).pairs] == [1, 0, 3]
    dead[0, 1] = 1.0
    with pytest.raises(InputError, match="NaN says that a component was not measured, then in every mode"):
        lm.mac(dead, found, sensors=PLAN)


def test_modes_that_no_sensor_sees_are_named(found, read):
    across = [s for s in PLAN if s[1] in ("y", "-y")]
    text = str(lm.mac(found, read[:, :4], sensors=across))
    assert "mode 3 of the first: no motion along any sensor; the numbers there are rounding" in text


@pytest.mark.parametrize(
    ("shapes", "more", "message"),
    [
        (lambda r: r.T, {}, r"one number for each of the 6 sensors, shape \(k, 6\), got \(6, 3\).*transpose them"),
        (lambda r: r[:, :5], {}, r"got \(3, 5\)"),
        (lambda r: r[0], {}, r"got \(6,\)"),
        (lambda r: r, {"frequencies": HZ[:2]}, r"one for each shape, got \(2,\)"),
        (lambda r: r, {"sensors": [(*p, d) for p, d in PLAN]}, r"sensor 0 must be \(point, direction\)"),
        (lambda r: 0.0 * r, {}, "reads zero in every shape"),
        (lambda r: r, {"sensors": [(p, "up") for p, _ in PLAN]}, "direction must be 'x', '-x'"),
        (lambda _: "shapes.csv", {}, "b must be Modes"),
    ],
)
def test_tables_that_do_not_fit_the_plan_are_refused_with_what_to_do(found, read, shapes, more, message):
    with pytest.raises(InputError, match=message):
        lm.mac(found, shapes(read), **{"sensors": PLAN, **more})


def test_two_tests_are_compared_at_the_same_sensors_alone(read):
    # one sensor turned about and its numbers with it: the same motion, once given a criterion below one
    turned = [(PLAN[0][0], "-y"), *PLAN[1:]]
    back = ModalTest(turned, HZ, read * np.array([-1, 1, 1, 1, 1, 1]))
    with pytest.raises(InputError, match="sensor 0 of the two tests"):
        lm.mac(ModalTest(PLAN, HZ, read), back)
    with pytest.raises(InputError, match="6 and 5 sensors"):
        lm.mac(ModalTest(PLAN, HZ, read), ModalTest(PLAN[:5], HZ, read[:, :5]))
    assert np.diag(lm.mac(ModalTest(PLAN, HZ, read), ModalTest(PLAN, HZ, -read)).values) == pytest.approx(1.0)


def test_a_test_is_compared_with_shapes_of_its_sensors_that_have_no_frequencies(read):
    one = lm.mac(ModalTest(PLAN, HZ, read), -2.0 * read)
    assert np.diag(one.values) == pytest.approx(1.0)
    assert one.frequency_a.tolist() == list(HZ)
    assert np.isnan(one.frequency_b).all()
    assert lm.mac(read, ModalTest(PLAN, HZ, read)).frequency_b.tolist() == list(HZ)


def test_masses_and_points_must_fit_what_they_weigh(found, read):
    motion = found.at([point for point, _ in PLAN])
    wrong = {
        "masses must have shape": lambda: lm.mac(found, found, weighted=True, masses=[1.0]),
        "12 masses do not fit": lambda: lm.mac(read, read, weighted=True, masses=[1.0] * 12),
        "not negative": lambda: lm.mac(read, read, weighted=True, masses=[1.0, -1.0, 1.0, 1.0, 1.0, 1.0]),
        "cannot be compared": lambda: lm.mac(motion, motion, points=[(0.0, 0.0, 0.0)]),
        "3 masses": lambda: lm.mac(read, read, weighted=True, masses=[1.0] * 3),
    }
    for words, call in wrong.items():
        with pytest.raises(InputError, match=words):
            call()


def test_a_test_takes_real_shapes_and_leaves_the_arrays_of_its_maker_alone(read):
    with pytest.raises(InputError, match="shape must be real"):
        ModalTest(PLAN, HZ, read * (1.0 + 0.5j))
    with pytest.raises(InputError, match="frequency must be a list"):
        ModalTest(PLAN, 7.7, read[:1])
    with pytest.raises(InputError, match="positive frequency"):
        ModalTest(PLAN, [7.7, 21.0, np.inf], read)
    own = HZ.copy()
    test = ModalTest(PLAN, own, read)
    own[0] = 1.0
    assert test.frequency[0] == 7.7


@pytest.mark.parametrize("turn_deg", [30.0, 90.0])
def test_modes_of_a_plane_that_is_turned_are_orthogonal_by_mass(turn_deg):
    joint = lm.Joint(35.0, normal_stiffness=5e10, shear_stiffness=2e10)
    wall = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.2), joint=joint)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    wall = wall.with_material(lm.Material(young_modulus=1e10, poisson_ratio=0.2)).transformed(
        [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    )
    shapes = lm.modes(wall, count=3, blocks="simply deformable", stress="plane stress")
    # unknowns along turned axes were once read from the wrong entries: 0.9 beside the diagonal
    np.testing.assert_allclose(lm.mac(shapes, shapes, weighted=True).values, np.eye(3), atol=1e-9)


def test_four_measured_modes_of_one_block_need_no_more_modes_than_it_has():
    joint = lm.Joint(30.0, normal_stiffness=1e9)
    block = lm.build.column(width=0.4, height=0.6, depth=0.3, courses=1, joint=joint)
    own = lm.modes(block, 6)
    points = np.repeat(block.blocks[-1].vertices[[0, -2]], 3, axis=0)
    axes = np.tile(np.eye(3), (2, 1))
    shape = (own.at(points) * axes).sum(axis=2)
    test = ModalTest(list(zip(points, axes, strict=True)), own.frequency[:4], shape[:4])
    found = lm.answer(block, lm.Loads.weight(block), {"frequency 4": "modes"}, modes={"test": test})
    assert found["frequency 4"] == pytest.approx(own.frequency[3])


def test_columns_of_a_table_without_places_are_sensors_and_no_axes():
    # shapes at right angles, once refused as "zero along y at every point"
    assert lm.mac([[1.0, 0.0, 0.0, 0.0]], [[0.0, 1.0, 0.0, 0.0]]).values == pytest.approx(0.0)
    assert lm.mac([[1.0, 0.0]], [[1.0, 1.0]]).values == pytest.approx(0.5)
    with pytest.raises(InputError, match="sensor 1 reads zero in every shape of the first set"):
        lm.mac([[1.0, 0.0, 2.0], [2.0, 0.0, -1.0]], [[1.0, 1.0, 1.0]])


def test_rows_of_unequal_length_are_refused_by_name():
    with pytest.raises(InputError, match="b: all shapes must have equally many numbers"):
        lm.mac([[1.0, 2.0]], [[1.0, 2.0], [3.0]])
    with pytest.raises(InputError, match="shape: every mode must have as many numbers as there are sensors"):
        ModalTest(PLAN[:2], HZ[:2], [[1.0, 2.0], [3.0]])


def test_the_places_of_sensors_that_a_caller_holds_are_neither_frozen_nor_followed():
    place = np.array([0.2, 0.0, 0.6])
    test = ModalTest([(place, "y"), PLAN[1]], HZ[:1], [[1.0, 2.0]])
    place[2] = 1.2
    assert test.sensors[0][0][2] == 0.6


def test_a_model_that_moves_in_its_plane_alone_is_compared_with_one_in_space():
    """Its zeros across the plane are no blanks: it was refused, with the advice to say NaN."""
    joint = lm.Joint(30.0, normal_stiffness=1e9, shear_stiffness=4e8)
    wall = lm.build.wall(length=1.0, courses=3, unit=(0.5, 0.2, 0.2), joint=joint)
    in_plane = lm.modes(lm.pushover(wall, lm.Loads.horizontal(wall, (1, 0, 0)), to=1e-6), 2)
    alike = lm.mac(lm.modes(wall, 6), in_plane)
    moves = np.abs(lm.modes(wall, 6).shape[:, :, 1]).max(axis=1) > 1e-6 * np.abs(lm.modes(wall, 6).shape).max()
    assert alike.values[moves].max() < 0.1
    assert alike.values[~moves].max(initial=0.0) > 0.9


def test_an_option_that_a_model_does_not_take_is_refused_by_name():
    column = lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=2, joint=lm.Joint(35.0))
    with pytest.raises(TypeError, match="no option 'grid' of this Assembly; there are contact_points, contact_model"):
        lm.modes(column, 2, grid=(4, 4))
    with pytest.raises(InputError, match="sensors must be a list, got 5"):
        lm.mac(np.ones((1, 2)), np.ones((1, 2)), sensors=5)


def test_a_point_that_is_no_number_lies_in_no_block(found):
    with pytest.raises(InputError, match="points must have finite coordinates"):
        found.at([[np.nan, 0.0, 0.6]])
