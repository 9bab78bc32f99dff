"""Repeated and close modes: none is missing, which is counted, and their shapes are compared by what they span."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_array

import limitmason as lm
from limitmason.continuum import Box, Continuum
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.geometry.rotation import rotation_matrices
from limitmason.vibration import ModalTest
from limitmason.vibration.eigensolver import lowest
from limitmason.vibration.modes import _directed
from limitmason.vibration.system import VibratingSystem

JOINT = lm.Joint(40.0, normal_stiffness=1e9, shear_stiffness=1e9)


def piers(count, courses, joint=JOINT, turn=None, shuffle=False):
    """Equal square piers, one metre apart, on one table."""
    boxes = [((-1.0, -1.0, -0.3), (count + 1.0, 1.0, 0.0))]
    for k in range(count):
        boxes += [((k, -0.1, 0.4 * c), (k + 0.2, 0.1, 0.4 * (c + 1))) for c in range(courses)]
    names = ["table", *(f"b{k}" for k in range(1, len(boxes)))]
    order = np.random.default_rng(4).permutation(len(boxes)) if shuffle else np.arange(len(boxes))
    cube = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    solids = [np.where(cube, high, low) @ (np.eye(3) if turn is None else turn.T) for low, high in boxes]
    return lm.Assembly.from_polyhedra(
        [(solids[k], faces) for k in order], joint=joint, density=2000.0, fixed=["table"],
        names=[names[k] for k in order],
    )


@pytest.mark.parametrize(("count", "courses", "wanted"), [(4, 3, 7), (6, 3, 12), (12, 2, 24), (20, 4, 40)])
def test_every_pier_has_the_modes_of_one(count, courses, wanted):
    alone = np.repeat(lm.modes(piers(1, courses), 6 * courses - 1).frequency, count)
    found = lm.modes(piers(count, courses), wanted)
    assert found.frequency == pytest.approx(alone[:wanted], rel=1e-8)
    # square piers sway both ways: the lowest frequency comes twice for each
    assert found.below == 2 * count
    gram = lm.mac(found, found, weighted=True).values
    assert gram == pytest.approx(np.eye(wanted), abs=1e-8)


@pytest.mark.parametrize("count", [1, 3, 8, 16, 71])
def test_modes_are_those_of_all_eigenvalues(count):
    wall = piers(4, 3)
    found = lm.modes(wall, count)
    squared = eigh(found.system.stiffness.toarray(), found.system.mass.toarray(), eigvals_only=True)
    exact = np.sqrt(squared) / (2.0 * np.pi)
    assert found.frequency == pytest.approx(exact[:count], rel=1e-8)
    assert found.below == int((exact < exact[count - 1] * (1.0 + 1e-6)).sum())
    cut = found.below > count
    assert any(f"count={found.below}" in w for w in found.warnings) == cut


@pytest.mark.parametrize("gap", [1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_last_mode_may_be_one_of_a_close_group(gap, seed):
    """Nine eigenvalues from the twelfth on nearly agree: the space must not shrink while they are told apart."""
    value = np.concatenate([np.arange(1.0, 12.0), 12.0 * (1.0 + gap * np.arange(9)), 14.0 + np.arange(196)])
    axes = np.linalg.qr(np.random.default_rng(seed).standard_normal((216, 216)))[0]
    system = VibratingSystem(csc_array((axes * value) @ axes.T), csc_array(np.eye(216)), *[None] * 4)
    found = lowest(system, 12)
    assert found.value == pytest.approx(value[:12], rel=1e-10)
    assert found.below == 12


@pytest.mark.parametrize(("above", "under"), [(6, None), (3, 3), (None, None)])
def test_counts_that_prove_nothing_are_told_as_none(above, under):
    """Four of forty eigenvalues: none is counted below their last, or fewer than are found."""
    stiffness, count = csc_array(np.diag(np.arange(1.0, 41.0))), lambda x: above if x > 4.0 else under
    system = VibratingSystem(stiffness, csc_array(np.eye(40)), *[None] * 4, below=count)
    found = lowest(system, 4)
    assert found.value == pytest.approx(np.arange(1.0, 5.0))
    assert found.below is None


def test_turned_and_renumbered_piers_have_the_same_repetitions():
    turn = rotation_matrices(np.array([[0.3, -0.7, 0.4]]))[0]
    one, two = (lm.modes(p, 13) for p in (piers(6, 3), piers(6, 3, turn=turn, shuffle=True)))
    assert one.frequency == pytest.approx(two.frequency, rel=1e-7)
    assert one.below == two.below


def by_name(found):
    """Displacements per mode and block, blocks in the order of their names."""
    return found.shape[:, np.argsort([b.name for b in found.system.carrier.assembly.blocks]), :3]


@pytest.mark.parametrize("count", [1, 2])
def test_rounding_and_numbering_choose_no_sign_and_no_direction(count):
    """Square piers sway alike along x and y; two of them have each motion in step and against each other."""
    here, wanted = piers(count, 3), 8 * count
    found = lm.modes(here, wanted)
    start = lowest(found.system, wanted)
    random = np.random.default_rng(7)
    for _ in range(3):
        other = start.vector * random.choice([-1.0, 1.0], wanted)
        for k in range(0, 4 * count, 2 * count):  # pairs, and with two piers fours, turned in what they span
            group = slice(k, k + 2 * count)
            other[:, group] = other[:, group] @ np.linalg.qr(random.standard_normal((2 * count, 2 * count)))[0]
        again = _directed(found.system, start.value, other)
        before = _directed(found.system, start.value, start.vector)
        assert again == pytest.approx(before, abs=1e-6 * np.abs(other).max())
    first = by_name(found)
    size = np.abs(first).max()
    assert by_name(lm.modes(piers(count, 3, shuffle=True), wanted)) == pytest.approx(first, abs=1e-6 * size)
    along = np.einsum("n,kni->ki", here.arrays.mass * ~here.fixed, found.shape[..., :3])
    assert along[0] == pytest.approx([along[0, 0], 0.0, 0.0], abs=1e-6 * along[0, 0])
    assert along[0, 0] > 0.0
    assert along[1] == pytest.approx([0.0, along[1, 1], 0.0], abs=1e-6 * along[1, 1])
    assert along[1, 1] > 0.0


def test_a_mode_without_mass_on_balance_has_a_sign_by_its_moments():
    """Of a wall between held ends the second sway has no resultant: its sign is that of the moment x u."""
    across = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.5), (0.0, 0.5)]
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    solids = [[(x, y, z) for x in (k, k + 1.0) for y, z in across] for k in range(8)]
    wall = lm.Assembly.from_polyhedra([(s, faces) for s in solids], joint=JOINT, density=2000.0, fixed=[0, 7])
    found = lm.modes(wall, 6)
    mass = np.where(wall.fixed, 0.0, wall.arrays.mass)
    u = found.shape[..., :3]
    first = np.einsum("n,kni->ki", mass, u)
    x = wall.centroids[:, 0] - wall.centroids[:, 0].mean()
    moment = np.einsum("n,kni->ki", mass * x, u)
    balanced = found.share.max(axis=1) < 1e-6
    assert balanced.any()
    assert not balanced.all()
    for k in range(6):
        shown = moment[k] if balanced[k] else first[k]
        assert shown[np.argmax(np.abs(shown))] > 0.0


def test_blocks_that_nothing_holds_count_their_rigid_motions():
    held = piers(2, 3)
    free = lm.Assembly.from_polyhedra(
        [(b.parts[0].vertices, b.parts[0].faces) for b in held.blocks[1:]], joint=JOINT, density=2000.0, fixed=()
    )
    found = lm.modes(free, 7)
    assert (found.frequency == 0.0).all()
    assert found.below == 12


def test_equal_piers_of_the_continuum_repeat_and_are_counted_by_its_own_factor():
    def solid(count):
        boxes = [Box(np.array([k, 0.0, 0.0]), np.array([k + 0.2, 0.2, 1.2])) for k in range(count)]
        return Continuum.from_boxes(boxes, lm.Material(1e9, 0.2, 2000.0), size=0.2)

    alone = np.repeat(lm.modes(solid(1), 12).frequency, 4)
    found = lm.modes(solid(4), 9)
    assert found.frequency == pytest.approx(alone[:9], rel=1e-7)
    assert found.below == 16
    matrix = found.system.stiffness.toarray(), found.system.mass.toarray()
    squared = eigh(*matrix, eigvals_only=True)
    apart = np.flatnonzero(squared[1:] > 1.1 * squared[:-1])
    assert len(apart) > 10
    for last in apart:
        assert found.system.below(1.05 * squared[last]) == last + 1


def test_modes_of_a_plane_say_so():
    outlines = [[(-1, -0.2), (1, -0.2), (1, 0), (-1, 0)]] + [
        [(0, 0.3 * k), (0.3, 0.3 * k), (0.3, 0.3 * k + 0.3), (0, 0.3 * k + 0.3)] for k in range(3)
    ]
    column = lm.Assembly.from_polygons(outlines, thickness=0.3, joint=JOINT, fixed=[0])
    column = column.with_material(lm.Material(young_modulus=1e10, poisson_ratio=0.2))
    plane = lm.modes(column, 3, blocks="simply deformable", stress="plane stress")
    assert any("only motions in the plane" in w for w in plane.warnings)
    path = lm.pushover(column, lm.Loads.horizontal(column, (1, 0, 0)), to=1e-6)
    assert any("only motions in the plane" in w for w in lm.modes(path, 2).warnings)
    assert not any("plane" in w for w in lm.modes(column, 3).warnings)


# ---- shapes of close modes ------------------------------------------------------------------------------------------


def test_repeated_modes_are_compared_by_what_they_span():
    """A pair turned by 30 degrees in its own space: shape by shape cos^2, together 1, and the table says so."""
    found = lm.modes(piers(1, 3), 4)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    spin = np.array([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    turned = replace(found, shape=np.tensordot(spin, found.shape, 1))
    alike = lm.mac(found, turned, weighted=True)
    assert alike.values[:2, :2] == pytest.approx(np.array([[0.75, 0.25], [0.25, 0.75]]), abs=1e-9)
    first = alike.groups[0]
    assert (first.first, first.second) == ((0, 1), (0, 1))
    assert first.value == pytest.approx(1.0, abs=1e-9)
    assert "1+2" in str(alike)
    assert "within 1% in frequency" in str(alike)


def test_rows_of_equal_blocks_held_at_either_end_are_two_models_of_one_mass():
    """Their free blocks are others: weights of equal masses change nothing beside the plain criterion."""
    left, right = (
        lm.modes(lm.Assembly.from_polyhedra(
            [box((k, 0, 0), (k + 1, 1, 1)) for k in range(4)], joint=JOINT, density=2000.0, fixed=[held],
            names=list("abcd"),
        ), 4)
        for held in "ad"
    )
    plain = lm.mac(left, right)
    np.testing.assert_allclose(lm.mac(left, right, weighted=True).values, plain.values, atol=1e-12)


def test_a_pair_that_is_split_in_the_other_model_is_met_by_both_of_its_modes():
    basis = np.eye(3)
    a = np.array([basis[0], basis[1], basis[2]])
    b = np.array([basis[0] + basis[1], basis[0] - basis[1], basis[2] + basis[0]])
    found = lm.mac(replace_frequencies(a, (1.0, 1.001, 2.0)), replace_frequencies(b, (1.0, 1.3, 2.0)))
    assert (found.groups[0].first, found.groups[0].second) == ((0, 1), (0, 1))
    assert [g.value for g in found.groups] == pytest.approx([1.0, 0.5])


def replace_frequencies(shapes, frequency):
    """Shapes as of a model of one block per component, to compare by components alone."""
    wall = piers(1, 1)
    found = lm.modes(wall, 3)
    shape = np.zeros((3, *found.shape.shape[1:]))
    shape[:, 1, :3] = shapes
    return replace(found, frequency=np.array(frequency), shape=shape)


# ---- sensors --------------------------------------------------------------------------------------------------------


def test_six_accelerometers_of_one_axis_know_the_modes():
    """Three floors of a pier, each with a sensor along x and one along a slant, opposite signs, own frequencies."""
    wall = lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=5, joint=JOINT, density=2000.0)
    modes = lm.modes(wall, 5)
    low = wall.blocks[1].bounds[0]
    place = [low + (0.02, 0.02, z) for z in (0.1, 0.4, 0.7)]
    slant = np.array((0.0, 3.0, 4.0))
    sensors = [(p, "-x") for p in place] + [(p, slant) for p in place]
    u = modes.at(np.array(place))
    table = np.concatenate([-u[:, :, 0], u @ (slant / 5.0)], axis=1)  # (k, 6): what the sensors read, by hand
    alike = lm.mac(modes, -3.0 * table, sensors=sensors, frequencies=1.02 * modes.frequency)
    assert np.diag(alike.values) == pytest.approx(1.0)
    assert alike.frequency_b == pytest.approx(1.02 * modes.frequency)
    back = lm.mac(table, modes, sensors=sensors)
    assert np.abs(back.values.T - alike.values).max() < 1e-12
    # an axis taken for its neighbour is seen
    wrong = [(p, "x") for p in place] + [(p, "y") for p in place]
    assert np.diag(lm.mac(modes, table, sensors=wrong).values).min() < 0.9
    with pytest.raises(InputError, match=r"three components each.*sensors="):
        lm.mac(modes, table, points=np.array(place * 2))
    with pytest.raises(InputError, match="sensor 1: direction must be"):
        lm.mac(modes, table, sensors=[(place[0], "x"), (place[1], "up")])
    with pytest.raises(InputError, match="sensor 0: its direction must not be zero"):
        lm.mac(modes, table, sensors=[(place[0], (0, 0, 0))])
    with pytest.raises(InputError, match="not both"):
        lm.mac(modes, table, points=place, sensors=sensors)
    with pytest.raises(InputError, match="frequencies must have shape"):
        lm.mac(modes, table, sensors=sensors, frequencies=[1.0])
    with pytest.raises(InputError, match="without a model"):
        lm.mac(modes, modes, frequencies=[1.0])


def sensors(model):
    places = [(model.centroids[k] + (0.02, 0.03, 0.0), d) for k in range(1, model.n_blocks) for d in "xy"]
    points, axes = np.array([p for p, _ in places]), ["xy".index(d) for _, d in places]
    return places, lambda found: found.at(points)[:, np.arange(len(axes)), axes]


def test_measured_shapes_of_equal_modes_are_compared_with_the_motions_that_they_span():
    tower = piers(1, 3)
    found = lm.modes(tower, 5)
    places, read = sensors(tower)
    shapes = read(found)
    turned = [shapes[0] + shapes[1], 0.3 * shapes[0] - shapes[1]]  # as good a pair of the two equal sways as theirs
    test = ModalTest(places, found.frequency[:2], turned)
    assert test.predicted(found) == pytest.approx(test.quantities, abs=1e-9)
    assert max(test.quantities.values()) == pytest.approx(found.frequency[0])


def test_modes_that_change_places_are_paired_by_their_shapes():
    # a wall-like pier sways across below along; joints soft in one direction only turn the order round
    tower = piers(1, 3)
    along, across = (lm.modes(tower.with_joints(replace(JOINT, shear_stiffness=s)), 6) for s in (1e9, 1e6))
    places, read = sensors(tower)
    one = ModalTest(places, along.frequency[:4], -5.0 * read(along)[:4])
    back = ModalTest(places, along.frequency[[3, 1, 2, 0]], read(along)[[3, 1, 2, 0]])
    first, second = one.predicted(across), back.predicted(across)
    assert first["frequency 4"] == pytest.approx(second["frequency 1"])
    assert first["mode 4 sensor 3"] == pytest.approx(second["mode 1 sensor 3"])
    assert one.predicted(along) == pytest.approx(one.quantities, abs=1e-9)
    # of a shape that is not theirs exactly, the nearest motion: what is left is at right angles to it
    noise = 0.02 * np.random.default_rng(2).standard_normal(read(along)[:4].shape)
    shaken = ModalTest(places, along.frequency[:4], read(along)[:4] / np.abs(read(along)[:4]).max() + noise)
    made = shaken.predicted(along)
    for k in (2, 3):
        p = np.array([made[f"mode {k + 1} sensor {s + 1}"] for s in range(len(places))])
        assert p @ (shaken.shape[k] - p) == pytest.approx(0.0, abs=1e-9)


def test_what_was_measured_of_modes_is_checked():
    with pytest.raises(InputError, match="a column per sensor"):
        ModalTest([((0, 0, 0), "x")], [1.0], [[1.0, 2.0]])
    with pytest.raises(InputError, match="shape must be finite, it is not at sensor 1: leave that sensor out"):
        ModalTest([((0, 0, 0), "x"), ((0, 0, 0), "y")], [1.0], [[1.0, float("nan")]])
    with pytest.raises(InputError, match="positive frequency"):
        ModalTest([((0, 0, 0), "x")], [1.0], [[0.0]])
