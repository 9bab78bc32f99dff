"""Natural modes of blocks and solids: closed forms, masses that add up, states, and two models of one structure."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import dem
import limitmason as lm
from limitmason import experiments
from limitmason.continuum import Box, Continuum
from limitmason.errors import InputError, NotApplicable
from validation.murano_macro import macro_model, published

JOINT = lm.Joint(35.0, normal_stiffness=2e9, shear_stiffness=8e8)


def stack(courses=4, joint=JOINT):
    return lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=courses, joint=joint, density=2000.0)


# ---- closed forms ---------------------------------------------------------------------------------------------------


def test_a_block_on_one_joint_has_all_six_of_its_modes_and_all_of_its_mass():
    # the last of six was refused: sway and rocking are coupled along x and along y, besides bounce and twist
    b, d, h, (kn, ks) = 0.4, 0.3, 0.2, (2e9, 8e8)
    found = lm.modes(stack(1), 6)
    m, area = 2000.0 * b * d * h, b * d
    exact = [kn * area / m, ks * area / m]  # bounce; twist has the same ratio of second moments
    for side in (b, d):
        stiffness = area * np.array([[ks, ks * h / 2], [ks * h / 2, ks * h**2 / 4 + kn * side**2 / 12]])
        exact += list(np.linalg.eigvals(stiffness / (m * np.array([[1.0], [(side**2 + h**2) / 12]]))).real)
    assert found.frequency == pytest.approx(np.sqrt(np.sort(exact)) / (2 * math.pi), rel=1e-9)
    assert found.share.sum(axis=0) == pytest.approx(np.ones(3), rel=1e-9)


def test_no_mass_takes_part_along_an_axis_on_which_every_block_is_held():
    column = stack(2)
    sliding = [lm.Support(b.name, dofs=("y", "rx", "rz")) for b in column.blocks[-2:]]
    held = replace(column, supports=(*column.supports, *sliding))
    found = lm.modes(held, 6)
    assert (found.share[:, 1] == 0.0).all()
    assert found.share[:, [0, 2]].sum(axis=0) == pytest.approx(np.ones(2), rel=1e-9)
    assert "nan" not in str(found)


def test_column_of_the_continuum_bends_and_stretches_at_the_frequencies_of_beams():
    # nu = 0: axial sqrt(E / rho) / (4 L) with 8 / pi^2 of the mass; bending by Timoshenko's cantilever
    e, rho, b, length = 1e9, 2000.0, 0.2, 3.0
    bar = Continuum.from_boxes([Box(np.zeros(3), np.array([b, b, length]))], lm.Material(e, 0.0, rho), size=(b, b, 0.1))
    found = lm.modes(bar, 9)
    axial = math.sqrt(e / rho) / (4 * length)
    lengthwise = int(found.share[:, 2].argmax())
    assert found.frequency[lengthwise] == pytest.approx(axial, rel=1e-4)
    assert found.share[lengthwise, 2] == pytest.approx(8 / math.pi**2, rel=2e-3)
    bending = timoshenko(e, rho, b, length)
    assert found.frequency[:2] == pytest.approx(bending, rel=2e-3)
    assert found.residual.max() < 1e-8


def timoshenko(e, rho, b, length):
    """First frequency of a cantilever with shear flexibility and rotary inertia, from its determinant."""
    area, inertia, shear = b * b, b**4 / 12, 0.5 * e * 5 / 6

    def determinant(frequency):
        w = 2 * math.pi * frequency
        # u'' , theta'' by the transfer matrix of (u, theta, V, M)
        a = np.array([[0, 1, 1 / (shear * area), 0], [0, 0, 0, 1 / (e * inertia)], [-rho * area * w**2, 0, 0, 0],
                      [0, -rho * inertia * w**2, -1, 0]])
        t = np.linalg.matrix_power(np.eye(4) + a * (length / 4096) + a @ a * (length / 4096) ** 2 / 2, 4096)
        return float(np.linalg.det(t[2:, 2:]))

    slender = 1.8751**2 / (2 * math.pi * length**2) * math.sqrt(e * inertia / (rho * area))
    return brentq(determinant, 0.8 * slender, 1.05 * slender)


def test_participating_masses_of_all_modes_add_up_to_the_mass_and_shapes_have_unit_modal_mass():
    column = stack(3)
    all_but_one = lm.modes(column, 17)
    assert (all_but_one.share.sum(axis=0) > 0.98).all()  # the highest mode is missing
    assert (all_but_one.share.sum(axis=0) <= 1.0 + 1e-9).all()
    same = lm.mac(all_but_one, all_but_one, weighted=True)
    assert same.values == pytest.approx(np.eye(17), abs=1e-9)
    assert "mode" in str(all_but_one)


def test_turned_and_renumbered_models_have_the_same_modes():
    wall = lm.build.wall(length=1.2, height=0.6, unit=(0.4, 0.2, 0.2), joint=JOINT, plan="L", return_length=0.8)
    c, s = math.cos(0.7), math.sin(0.7)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    copy = wall.transformed(turn).renumbered(np.random.default_rng(2).permutation(wall.n_blocks))
    for before, after in (
        (lm.modes(wall, 4), lm.modes(copy, 4)),
        (lm.modes(solid(wall), 4), lm.modes(solid(copy), 4)),
    ):
        assert after.frequency == pytest.approx(before.frequency, rel=1e-8)
        points = np.array([[0.1, 0.1, 0.5], [0.9, 0.1, 0.3], [0.1, 0.7, 0.55], [0.6, 0.1, 0.1]])
        assert np.diag(lm.mac(before.at(points) @ turn.T, after.at(points @ turn.T)).values) == pytest.approx(1.0)


def solid(wall):
    return Continuum.from_assembly(wall, lm.Material(5e8, 0.2, 2000.0), size=0.2)


# ---- the cell of four bricks ----------------------------------------------------------------------------------------

# frequencies [Hz] restated from an example of HybriDFEM 3.1: a discrete and a finite element reference
DISCRETE = (2496, 3430, 4184, 4325, 4732, 5163, 5732, 8755, 9172)
CONTINUOUS = (2514, 3345, 4043, 4118, 4697, 4976, 5401, 8265, 8549)
H, L, DEPTH, THICK = 0.055, 0.25, 0.12, 0.01


def brick(x, z, height=H):
    corners = np.array([(i, j, k) for i in (x, x + L) for j in (0, DEPTH) for k in (z, z + height)])
    return corners, ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def cell(fixed=()):
    # bricks whose doubled halves have their centre at the outer face are whole bricks that lie half inside the cell
    bricks = [brick(0, 0), brick(-L / 2, H), brick(L / 2, H), brick(0, 2 * H)]
    e = 1e9
    joint = lm.Joint(30.0, normal_stiffness=e / THICK, shear_stiffness=e / 2.4 / THICK)
    return lm.Assembly.from_polyhedra(bricks, joint=joint, density=1800.0, fixed=fixed)


def in_plane(modes):
    return [k for k, s in enumerate(modes.shape) if np.abs(s[:, [1, 3, 5]]).max() < 1e-6 * np.abs(s).max()]


def test_modes_of_the_free_cell_of_four_bricks_lie_within_five_per_cent_of_both_references():
    found = lm.modes(cell(), 23)
    assert (found.frequency[:6] == 0.0).all()  # a free body
    assert (found.frequency[6:] > 1e3).all()
    assert found.share[:6].sum(axis=0) == pytest.approx(1.0)  # which carry all of the mass
    own = [f for f in found.frequency[in_plane(found)] if f > 0.0]
    assert own[:8] == pytest.approx(DISCRETE[:8], rel=0.051)
    assert own[:8] == pytest.approx(CONTINUOUS[:8], rel=0.051)


def test_cell_on_a_held_brick_as_blocks_on_joints_and_as_stiff_bricks_with_thin_layers():
    # layers of t' with modulus kn t' at restrained sides and shear modulus ks t' are the joints as t' -> 0
    blocks = lm.modes(cell(fixed=(0,)), 12)
    t = 1e-3
    kn, ks = 1e9 / THICK, 1e9 / 2.4 / THICK
    nu = (kn / ks - 2) / (2 * (kn / ks) - 2)
    layer = lm.Material(2 * ks * t * (1 + nu), nu, 0.0, name="joint")
    stiff = lm.Material(1e14, 0.0, 1800.0 * H / (H - t), name="brick")

    def part(x0, x1, z0, z1, material):
        return Box(np.array([x0, 0.0, z0]), np.array([x1, DEPTH, z1]), material)

    bricks = [
        part(-L / 2, L / 2 - t / 2, H + t / 2, 2 * H - t / 2, 0),
        part(L / 2 + t / 2, 1.5 * L, H + t / 2, 2 * H - t / 2, 0),
        part(0, L, 2 * H + t / 2, 3 * H - t / 2, 0),
    ]
    joints = [part(0, L, H - t / 2, H + t / 2, 1), part(0, L, 2 * H - t / 2, 2 * H + t / 2, 1),
              part(L / 2 - t / 2, L / 2 + t / 2, H + t / 2, 2 * H - t / 2, 1)]
    model = Continuum.from_boxes([*bricks, *joints], [stiff, layer], size=(0.07, 0.07, 0.06))
    assert lm.modes(model, 12).frequency == pytest.approx(blocks.frequency, rel=0.02)


# ---- states ---------------------------------------------------------------------------------------------------------


def test_settled_column_vibrates_as_its_closed_joints_say():
    column = stack()
    history = dem.simulate(column, [dem.Settle()], contact_points=(4, 4))
    closed = lm.modes(column, 5, contact_points=(4, 4))
    assert lm.modes(history, 5).frequency == pytest.approx(closed.frequency, rel=1e-9)
    assert "0 of" in str(lm.modes(history, 5))
    with pytest.raises(InputError, match="'sticks', 'drops'"):
        lm.modes(history, sliding="perhaps")


def test_sound_joints_without_force_are_closed_in_the_state_of_either_engine():
    # the head joints of a symmetric wall carry nothing under its weight; their mortar holds both ways
    mortar = lm.Joint(40.0, cohesion=2e5, tensile_strength=2e4, normal_stiffness=1e9, shear_stiffness=5e8)
    wall = lm.build.wall(length=0.6, courses=3, unit=(0.3, 0.2, 0.2), joint=mortar, density=2000.0)
    loads = lm.Loads.horizontal(wall, (0, 1, 0))
    history = dem.simulate(wall, dem.Settle(), loads=loads, contact_points=(4, 4), detect_every=None)
    curve = lm.pushover(wall, loads, to=1e-7, contact_model="grid", grid=(4, 4))
    closed = lm.modes(wall, 5, contact_points=(4, 4)).frequency
    assert lm.modes(history, 5).frequency == pytest.approx(closed, rel=1e-9)
    assert lm.modes(curve, 5, sample=0).frequency == pytest.approx(closed, rel=1e-6)
    # dry ones are open: nothing presses them
    dry = wall.with_interfaces(replace(i, joint=replace(i.joint, cohesion=0.0, tensile_strength=0.0))
                               for i in wall.interfaces)
    settled = dem.simulate(dry, dem.Settle(), loads=loads, contact_points=(4, 4), detect_every=None)
    assert lm.modes(settled, 5).frequency[1] < 0.97 * closed[1]


def test_wall_pushed_until_joints_open_vibrates_more_slowly_by_both_engines():
    # a block of width b on an elastic bed without tension, overturning moment M: contact length from statics,
    # c = 3 (b / 2 - M / W) once M > W b / 6; the rest is open
    b, kn, multiplier = 0.4, 2e9, 1.3  # M = multiplier x weight x half the height = 0.13 W > b / 6
    block = stack(1, lm.Joint(60.0, normal_stiffness=kn, shear_stiffness=8e8))
    loads = lm.Loads.horizontal(block).scaled(live=multiplier)
    stages = [dem.Settle(), dem.Ramp(1.0, steps=4000), dem.Settle()]
    history = dem.simulate(block, stages, loads=loads, detect_every=None, contact_points=(81, 3))
    pushed = lm.modes(history, 5)
    pressed = 3 * (b / 2 - multiplier * 0.1)
    vertical = pushed.system.stiffness.toarray()[2, 2]
    assert vertical == pytest.approx(kn * pressed * 0.3, rel=0.03)
    assert pushed.frequency[0] < 0.9 * lm.modes(block, 5, contact_points=(81, 3)).frequency[0]


def test_tangent_of_a_capacity_curve_starts_closed_and_softens():
    wall = stack(3)
    curve = lm.pushover(wall, lm.Loads.horizontal(wall, (1, 0, 0)))
    start = lm.modes(curve, 3, sample=0)
    end = lm.modes(curve, 3, sample=-1)
    assert (end.frequency < start.frequency * (1 + 1e-9)).all()
    assert end.frequency[0] < 0.95 * start.frequency[0]


def test_contacts_found_anew_and_what_has_no_modes_are_refused():
    block = stack(1)
    with pytest.raises(InputError, match="between 1 and 6"):
        lm.modes(block, 7)
    with pytest.raises(InputError, match="no vibration"):
        lm.modes(3.0)
    with pytest.raises(TypeError):
        lm.modes(block, grid=(3, 3))
    with pytest.raises(InputError, match="must be positive"):
        lm.modes(block, stiffness=-1.0)
    with pytest.raises(InputError, match="three coordinates"):
        lm.modes(block, 3).at([(0.0, 0.0)])
    with pytest.raises(InputError, match="blocks must be one of"):
        lm.modes(block, 3, blocks="soft")
    with pytest.raises(InputError, match="rigid blocks have no stress"):
        lm.modes(block, 3, stress="plane stress")


def test_ties_are_refused_by_every_way_to_modes():
    wall = stack(2)
    tied = wall.with_ties([lm.Tie(2, wall.blocks[2].centroid, None, (3.0, 0.0, 0.0), stiffness=1e9, yield_force=1e3)])
    settled = dem.simulate(tied, dem.Settle(), detect_every=None, loads=lm.Loads.horizontal(tied))
    for model in (tied, settled, lm.pushover(tied, lm.Loads.horizontal(tied), to=1e-6)):
        with pytest.raises(NotApplicable, match="does not follow ties"):
            lm.modes(model, 3)


def test_a_state_in_an_ambiguous_plane_keeps_that_of_its_own_loads():
    # all joints of a stack are level: the loads along y alone say in which plane its blocks deform
    square = {"width": 0.4, "depth": 0.4, "unit_height": 0.2, "courses": 3}
    wall = lm.build.column(**square, joint=JOINT).with_material(lm.Material(young_modulus=2e8, poisson_ratio=0.2))
    options = {"blocks": "simply deformable", "stress": "plane stress", "detect_every": None}
    along, across = (
        dem.simulate(wall, dem.Settle(), loads=lm.Loads.horizontal(wall, d).scaled(live=1e-3), **options)
        for d in ((1, 0, 0), (0, 1, 0))
    )
    assert along.state.deformation.normal != pytest.approx(across.state.deformation.normal)
    # the stack is square in plan
    assert lm.modes(across, 3).frequency == pytest.approx(lm.modes(along, 3).frequency, rel=1e-6)


def slender_bar(n, level, stress, joint_factor=1e5):
    """A bar of n blocks that stands on its foot, bonded stiffly; E 2e9, rho 2000, 1 m tall, 0.1 square."""
    h, e = 1.0 / n, 2e9
    joint = lm.Joint(35.0, normal_stiffness=joint_factor * e, shear_stiffness=joint_factor * e)
    outlines = [[(0, h * k), (0.1, h * k), (0.1, h * (k + 1)), (0, h * (k + 1))] for k in range(-1, n)]
    wall = lm.Assembly.from_polygons(outlines, thickness=0.1, joint=joint, fixed=[0], density=2000.0)
    wall = wall.with_material(lm.Material(young_modulus=e, poisson_ratio=0.0))
    return lm.modes(wall, 6, blocks=level, stress=stress, contact_points=(4, 4))


@pytest.mark.parametrize(
    ("n", "level", "within"), [(1, "ritz", 2e-3), (4, "ritz", 2e-3), (4, "simply deformable", 0.02)]
)
def test_cantilever_of_deformable_blocks_sways_as_timoshenkos_beam(n, level, within):
    found = slender_bar(n, level, "plane stress")
    assert found.frequency[0] == pytest.approx(timoshenko(2e9, 2000.0, 0.1, 1.0), rel=within)
    # along: c / 4 L
    along = np.sqrt(2e9 / 2000.0) / 4.0
    assert np.abs(found.frequency / along - 1.0).min() < 0.01


@pytest.mark.slow
def test_deformable_blocks_have_the_same_modes_however_they_are_turned_and_where_they_are_asked():
    wall = lm.build.wall(length=0.9, courses=2, unit=(0.3, 0.1, 0.15), joint=JOINT, density=2000.0)
    wall = wall.with_material(lm.Material(young_modulus=2e9, poisson_ratio=0.2))
    angle = np.deg2rad(33.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    copy = wall.transformed(turn, (1.0, -2.0, 0.5)).renumbered(np.random.default_rng(5).permutation(wall.n_blocks))
    for level in ("simply deformable", "ritz"):
        one, two = lm.modes(wall, 4, blocks=level), lm.modes(copy, 4, blocks=level)
        assert two.frequency == pytest.approx(one.frequency, rel=1e-8)
        top = np.array([[0.05, 0.0, 0.18], [0.6, 0.05, 0.15]]) + wall.blocks[0].centroid * (0, 1, 0)
        moved = two.at(top @ turn.T + (1.0, -2.0, 0.5))
        for u, v in zip(one.at(top) @ turn.T, moved, strict=True):
            assert np.abs(u) == pytest.approx(np.abs(v), abs=1e-6 * np.abs(u).max())
        # stiffer units come to the rigid ones
        stiff = lm.modes(wall.with_material(lm.Material(young_modulus=2e14, poisson_ratio=0.2)), 4, blocks=level)
        assert stiff.frequency == pytest.approx(lm.modes(wall, 4).frequency, rel=1e-3)
    one, other = (lm.modes(wall, 3, blocks=b) for b in ("simply deformable", "ritz"))
    assert lm.mac(one, other).values == pytest.approx(np.eye(3), abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("stress", ["solid", "plane stress"])
def test_settled_dem_and_capacity_curve_of_simple_blocks_vibrate_as_the_closed_column(stress):
    wall = stack(2).with_material(lm.Material(young_modulus=2e9, poisson_ratio=0.2))
    kind = {"blocks": "simply deformable", "stress": stress}
    closed = lm.modes(wall, 3, **kind, contact_points=(3, 3))
    rest = dem.simulate(wall, dem.Settle(), **kind, contact_points=(3, 3), detect_every=None)
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), **kind, to=1e-9, contact_model="grid", grid=(3, 3))
    for state in (lm.modes(rest, 3), lm.modes(curve, 3, sample=0)):
        assert state.frequency == pytest.approx(closed.frequency, rel=1e-6)


# ---- comparison of shapes -------------------------------------------------------------------------------------------


def test_criterion_of_chosen_shapes():
    # |a.b|^2 / (a.a b.b): parallel 1, orthogonal 0, 45 degrees 1/2; factor, sign and phase do not count
    a = np.array([[[1.0, 0.0, 0.0]], [[0.0, 2.0, 0.0]]])
    b = np.array([[[-3.0, 0.0, 0.0]], [[1.0, 1.0, 0.0]]])
    assert lm.mac(a, b).values == pytest.approx(np.array([[1.0, 0.5], [0.0, 0.5]]))
    assert lm.mac(a * np.exp(0.4j), b).values == pytest.approx(lm.mac(a, b).values)
    two = np.array([[1.0, 1.0]])
    assert lm.mac(two, np.array([[1.0, -1.0]]), weighted=True, masses=(3.0, 1.0)).values == pytest.approx(0.25)
    for wrong in ({"masses": (1.0, 1.0)}, {"weighted": True}):
        with pytest.raises(InputError):
            lm.mac(two, two, **wrong)
    with pytest.raises(InputError, match="give the points"):
        lm.mac(lm.modes(stack(2)), two)
    with pytest.raises(InputError, match="zero"):
        lm.mac(two, np.zeros((1, 2)))


@pytest.mark.slow
def test_one_solid_with_two_meshes_has_the_same_shapes():
    wall = lm.build.wall(length=1.2, height=0.8, unit=(0.4, 0.2, 0.2), joint=JOINT)
    coarse, fine = (
        lm.modes(Continuum.from_assembly(wall, lm.Material(5e8, 0.2, 2000.0), size=size), 4) for size in (0.3, 0.15)
    )
    assert np.diag(lm.mac(coarse, fine).values) == pytest.approx(1.0, abs=2e-3)
    # Rayleigh: bricks cut in halves can only lower the frequencies
    assert (fine.frequency <= coarse.frequency).all()
    assert fine.frequency == pytest.approx(coarse.frequency, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("specimen", ["DS", "REGW"])
def test_macro_models_of_the_u_walls_have_the_printed_frequencies_and_the_shapes_of_the_blocks(specimen):
    test = experiments.load("murano-u-walls", specimen)
    model = lm.modes(macro_model(test, size=0.15), 3)
    printed = published(specimen)
    assert model.frequency == pytest.approx([float(printed[f"frequency_{k}"]) for k in (1, 2, 3)], rel=0.07)
    likeness = lm.mac(model, lm.modes(test.assembly(), 3))
    assert [j for _, j, _ in likeness.pairs] == [0, 1, 2]
    for k, (_, _, value) in enumerate(likeness.pairs, start=1):
        assert value >= float(printed[f"mac_{k}"]) - 0.1  # printed against a simulated identification, not the modes


@pytest.mark.slow
def test_step_1_of_ds_exceeds_3dec_as_the_source_says():
    # "around 20 % higher for the first 2 modes and 3 % for the third"
    test = experiments.load("murano-u-walls", "DS")
    found = lm.modes(macro_model(test, "step 1", size=0.15), 3).frequency
    over = [f / float(test.published[f"3DEC frequency {k}"]) - 1 for k, f in enumerate(found, start=1)]
    assert over[:2] == pytest.approx([0.2, 0.2], abs=0.05)
    assert 0.0 < over[2] < 0.06


def test_blocks_that_all_came_apart_have_no_modes():
    """The factors of a stiffness of zero ended in a RuntimeError."""
    column = stack(courses=8)
    state = dem.initial_state(column, lm.Loads.weight(column), mode="dynamic")
    state.bodies.shift[1:, 2] = 0.01 * np.arange(1, 9)  # each stone flies above the one below it
    flying = dem.simulate(column, dem.Hold(steps=1), start=state, detect_every=None)
    with pytest.raises(NotApplicable, match="no closed joint holds any of them"):
        lm.modes(flying)
