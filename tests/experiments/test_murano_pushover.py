"""Murano's U walls: loads on patches, weights and plan of the source, natural frequencies, limit analysis and DEM."""

import math
from dataclasses import replace

import numpy as np
import pytest
from u_wall_blocks import murano_table_10 as tables
from walls import on_slab, running_bond

import dem
import limitmason as lm
from dem.model.stable_step import block_stiffness
from limitmason import experiments
from limitmason.constants import GRAVITY
from limitmason.experiments import murano_u_walls as murano
from limitmason.geometry import polygon_area_centroid
from limitmason.limit import limit_analysis
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.default_stiffness import joint_stiffness
from limitmason.mechanics.stiffness_matrix import stiffness_matrix
from limitmason.model.patch_pressure import patch_forces
from limitmason.model.pressure import Pressure

SOURCE = "murano-u-walls"
WALLS = experiments.specimens(SOURCE)


def about_origin(assembly, wrench):
    """Resultant force, and moment about the origin, of wrenches about the centroids."""
    force = wrench[:, :3].sum(axis=0)
    moment = (wrench[:, 3:] + np.cross(assembly.centroids, wrench[:, :3])).sum(axis=0)
    return force, moment


def rear(x0, x1, z0, z1, y):
    """Rectangle that faces +y."""
    return [(x1, y, z0), (x0, y, z0), (x0, y, z1), (x1, y, z1)]


# ---- pressure on a patch --------------------------------------------------------------------------------------------


@pytest.mark.exact
def test_patch_over_a_whole_face_is_the_pressure_on_that_face():
    wall = on_slab([((0, 0, 0), (0.4, 0.3, 0.2))])
    none = lm.Loads.weight(wall)
    whole = none.with_pressure(wall, 1, pressure=7e3, face="+y", case="live")
    patch = none.with_patch_pressure(wall, rear(0.0, 0.4, 0.0, 0.2, 0.3), pressure=7e3)
    assert patch.live == pytest.approx(whole.live, abs=1e-9)


def test_patch_is_clipped_to_the_faces_it_covers():
    wall = on_slab([((0, 0, 0), (0.4, 0.3, 0.2))])
    forces, area = patch_forces(wall, rear(0.3, 9.0, 0.1, 9.0, 0.3), Pressure(1e3))
    wrench = forces.wrench
    assert area == pytest.approx(0.1 * 0.1)
    assert wrench[1, :3] == pytest.approx([0.0, -10.0, 0.0])
    # centre of what is left at (0.35, 0.3, 0.15), of the block at (0.2, 0.15, 0.1)
    assert wrench[1, 3:] == pytest.approx(np.cross((0.15, 0.15, 0.05), (0.0, -10.0, 0.0)))
    assert not wrench[0].any()


def test_patch_across_many_blocks_has_the_resultant_of_the_patch():
    wall = running_bond(4, 5)
    corners = np.array([(0.15, 0.2, 0.07), (0.1, 0.2, 0.8), (0.9, 0.2, 0.93), (1.3, 0.2, 0.31)])
    forces, area = patch_forces(wall, corners, Pressure(2e3))
    flat = corners[::-1, [0, 2]]
    exact, centre = polygon_area_centroid(flat)
    assert area == pytest.approx(abs(exact))
    force, moment = about_origin(wall, forces.wrench)
    assert force == pytest.approx([0.0, -2e3 * area, 0.0])
    assert moment == pytest.approx(np.cross((centre[0], 0.2, centre[1]), force))


def test_force_on_a_patch_is_its_resultant():
    wall = running_bond(4, 5)
    loads = lm.Loads.weight(wall).with_patch_pressure(wall, rear(0.1, 1.1, 0.0, 0.9, 0.2), force=4e3)
    assert about_origin(wall, loads.live)[0] == pytest.approx([0.0, -4e3, 0.0])


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (rear(0.0, 0.4, 0.0, 0.2, 0.3)[::-1], "counter-clockwise seen from outside"),
        (rear(0.0, 0.4, 0.0, 0.2, 0.31), "no face"),
        (rear(0.0, 0.4, 0.0, 0.2, 0.3)[:2], "three corners"),
        ([(0, 0.3, 0), (0.1, 0.3, 0), (0.2, 0.3, 0)], "one line"),
        ([(0.4, 0.3, 0), (0, 0.3, 0), (0, 0.35, 0.2), (0.4, 0.3, 0.2)], "flat convex"),
        ([(0.4, 0.3, 0), (0, 0.3, 0), (0.2, 0.3, 0.05), (0, 0.3, 0.2)], "flat convex"),
    ],
)
def test_wrong_patches_are_refused(corners, message):
    wall = on_slab([((0, 0, 0), (0.4, 0.3, 0.2))])
    with pytest.raises(ValueError, match=message):
        lm.Loads.weight(wall).with_patch_pressure(wall, corners, pressure=1.0)


def test_patch_needs_either_pressure_or_force():
    wall = on_slab([((0, 0, 0), (0.4, 0.3, 0.2))])
    for given in ({}, {"pressure": 1.0, "force": 1.0}):
        with pytest.raises(ValueError, match="either pressure or force"):
            lm.Loads.weight(wall).with_patch_pressure(wall, rear(0.0, 0.4, 0.0, 0.2, 0.3), **given)


# ---- what the source says of its walls ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WALLS)
def test_weight_is_that_of_the_axis_of_the_plan(name):
    test = experiments.load(SOURCE, name)
    p, wall = test.parameters, test.assembly()
    volume = p["centre line"] * p["thickness"] * p["height"]
    assert wall.weights[~wall.fixed].sum() == pytest.approx(volume * p["density"] * GRAVITY, rel=1e-9)


def test_facade_weighs_what_the_source_takes_for_mechanism_a():
    wall = experiments.load(SOURCE, "DS").assembly()
    boxes = np.array([b.bounds for b, held in zip(wall.blocks, wall.fixed, strict=True) if not held])
    inside = np.clip(boxes[:, 1, 1], None, 0.3) - np.clip(boxes[:, 0, 1], None, 0.3)
    size = boxes[:, 1] - boxes[:, 0]
    volume = (size[:, 0] * inside * size[:, 2]).sum()
    assert volume == pytest.approx(2.25 * 1.35 * 0.30)
    # 22.33 kN: 2450 kg/m3 and g rounded to 10 m/s2
    assert volume * 2450 * 10.0 == pytest.approx(22.33e3, abs=5.0)


@pytest.mark.parametrize("name", WALLS)
def test_loads_are_20_kn_on_the_side_walls_and_1_kn_of_airbag(name):
    test = experiments.load(SOURCE, name)
    wall, loads = test.assembly(), test.loads()
    roof = loads.dead.copy()
    roof[:, 2] += wall.weights
    force, moment = about_origin(wall, roof)
    assert force == pytest.approx([0.0, 0.0, -20e3], abs=1e-6)
    assert moment[1] == pytest.approx(20e3 * 2.25 / 2)
    loaded = [wall.blocks[i].name for i in np.flatnonzero(np.abs(roof[:, 2]) > 1.0)]
    assert all("-06-" in block for block in loaded)
    force, moment = about_origin(wall, loads.live)
    assert force == pytest.approx([0.0, -1e3, 0.0], abs=1e-9)
    # in the middle of the rear face, 1.65 x 1.35 m
    assert moment == pytest.approx([1e3 * 1.35 / 2, 0.0, -1e3 * 2.25 / 2], abs=1e-6)
    pushed = np.flatnonzero(loads.live[:, 1])
    assert all(wall.blocks[i].bounds[1, 1] == pytest.approx(0.3) for i in pushed)
    assert all(wall.blocks[i].bounds[0, 0] < 1.95 - 1e-9 for i in pushed)
    back = test.loads("-")
    assert back.live == pytest.approx(-loads.live)


@pytest.mark.exact
def test_layout_is_the_idealisation_of_the_source():
    wall = experiments.load(SOURCE, "REGW").assembly()
    stones = [b for b, held in zip(wall.blocks, wall.fixed, strict=True) if not held]
    assert sorted({round(float(b.bounds[0, 2]), 9) for b in stones}) == pytest.approx([0.225 * k for k in range(6)])
    lengths = [float(np.ptp(b.bounds[:, 0])) for b in stones if b.name.startswith("facade-01")]
    assert max(lengths) == pytest.approx(0.29)
    through = [b.name for b in stones if b.name.startswith("facade-") and np.ptp(b.bounds[:, 1]) > 0.2]
    courses = {int(n.split("-")[1]) for n in through}
    assert {2, 4, 6} <= courses
    assert wall.recipe["leaves"] == 2
    control = wall.blocks[murano.control_block(experiments.load(SOURCE, "REGW"))]
    assert control.bounds[1, 2] == pytest.approx(1.35)
    assert control.bounds[0, 0] <= 1.125 <= control.bounds[1, 0]
    assert control.bounds[0, 1] == pytest.approx(0.0)


def bed(test, kind="bed"):
    return next(i.joint for i in test.assembly().interfaces if i.kind == kind)


def test_options_change_what_they_name_and_bad_ones_are_refused():
    plain = experiments.load(SOURCE, "REGW")
    law = bed(plain)
    assert (law.cohesion, law.tensile_strength, law.friction_angle_deg) == pytest.approx((1.9e5, 1.5e5, 33.0))
    assert (law.normal_stiffness, law.shear_stiffness) == pytest.approx((4.2e9, 2.1e9))
    assert (law.residual_cohesion, law.residual_tensile_strength) == (0.0, 0.0)
    kept = bed(plain.with_options(residual="cohesion"))
    assert (kept.residual_cohesion, kept.residual_tensile_strength) == (None, 0.0)
    ground = bed(plain, "base")
    assert ground.cohesion > 5.0 * law.cohesion
    assert (ground.residual_cohesion, ground.normal_stiffness) == (None, law.normal_stiffness)
    assert bed(plain.with_options(ground="joint"), "base") == law
    for name, cohesion in (("no tension", law.cohesion), ("dry", 0.0)):
        own = bed(plain.with_options(ground=name), "base")
        assert (own.cohesion, own.tensile_strength, own.residual_cohesion) == (cohesion, 0.0, None)
        assert (own.friction_angle_deg, own.shear_stiffness) == (law.friction_angle_deg, law.shear_stiffness)
    assert bed(experiments.load(SOURCE, "DS")).residual_tensile_strength is None
    assert bed(plain.with_options(residual="full")).residual_tensile_strength is None
    first = bed(experiments.load(SOURCE, "DS", calibration="first"))
    assert (first.friction_angle_deg, first.normal_stiffness) == pytest.approx((34.0, 2.4e11))
    # a dry wall stays dry though its first calibration bonds it, and what that bond keeps is an assumption
    dry = experiments.load(SOURCE, "DS", calibration="first")
    assert first.name == bed(experiments.load(SOURCE, "DS")).name == "dry joint"
    assert law.name == "mortar joint"
    assert first.residual_cohesion == 0.0
    assert not any("Mortar" in a for a in dry.assumptions)
    assert any("gives dry joints is assumed to lose" in a for a in dry.assumptions)
    assert any("layout of the regular one" in a for a in dry.assumptions)
    longer = plain.with_options(return_length=1.2)
    said = [next(a for a in t.assumptions if a.startswith("The side walls")) for t in (plain, longer)]
    assert said == [
        "The side walls are assumed 1 m long: derived from the axis of the plan, 3.65 m.",
        "The side walls are assumed 1.2 m long; 1 m are derived from the axis of the plan, 3.65 m.",
    ]
    assert np.max([b.bounds[1, 1] for b in longer.assembly().blocks[1:]]) == pytest.approx(1.2)
    for options, message in (
        ({"residual": "some"}, "residual must be"),
        ({"ground": "sand"}, "ground must be"),
        ({"calibration": "second"}, "calibration must be"),
        ({"roof_from": 1.0}, "roof_from"),
    ):
        with pytest.raises(ValueError, match=message):
            experiments.load(SOURCE, "DS", **options)


# ---- natural frequencies --------------------------------------------------------------------------------------------


def test_block_on_springs_bounces_and_sways_at_the_frequencies_of_a_rigid_body():
    kn, ks, (a, b, h) = 3e8, 1e8, (0.4, 0.3, 0.2)
    joint = lm.Joint(30.0, normal_stiffness=kn, shear_stiffness=ks)
    block = on_slab([((0, 0, 0), (a, b, h))], joint=joint)
    mass, area = 2000.0 * a * b * h, a * b
    modes = lm.modes(block, 5, contact_points=(30, 30))
    bounce = math.sqrt(kn * area / mass) / (2 * math.pi)
    assert np.abs(modes.frequency / bounce - 1.0).min() < 1e-6
    twist = math.sqrt(ks * area * (a**2 + b**2) / 12 / (mass * (a**2 + b**2) / 12)) / (2 * math.pi)
    assert np.abs(modes.frequency / twist - 1.0).min() < 5e-3
    for side in (a, b):
        # sway along a side couples with rocking about its base: two modes of a 2 x 2 problem
        inertia, arm = mass * (side**2 + h**2) / 12, h / 2
        k = np.array([[ks, -ks * arm], [-ks * arm, ks * arm**2 + kn * side**2 / 12]]) * area
        lowest = np.sqrt(np.linalg.eigvals(k / np.array([[mass], [inertia]])).min()) / (2 * math.pi)
        assert np.abs(modes.frequency / lowest - 1.0).min() < 5e-3


def test_stiffness_matrix_is_symmetric_and_its_blocks_are_those_of_the_time_stepping():
    wall = experiments.load(SOURCE, "REGW").assembly()
    points = contact_points(wall, contact_model="grid", grid=(3, 3), elastic=True)
    kn, ks, _ = joint_stiffness(wall, lm.Loads.weight(wall).dead, None)
    _, k = stiffness_matrix(wall, points, np.column_stack([kn, ks, ks])[points.interface])
    scale = abs(k).max()
    assert abs(k - k.T).max() < 1e-12 * scale
    state = dem.initial_state(wall, lm.Loads.weight(wall), contact_points=(3, 3))
    own = block_stiffness(state.points, state.joints, wall.n_blocks)
    for i in (5, 60, wall.n_blocks - 1):
        assert k[6 * i : 6 * i + 6, 6 * i : 6 * i + 6].toarray() == pytest.approx(own[i], abs=1e-9 * scale)
    # moving everything as one body costs nothing
    assert abs(k @ np.tile([1.0, 2.0, 3.0, 0.0, 0.0, 0.0], wall.n_blocks)).max() < 1e-9 * scale


def test_natural_frequencies_refuse_massless_blocks_and_too_many_modes():
    block = on_slab([((0, 0, 0), (0.4, 0.3, 0.2))], density=0.0)
    with pytest.raises(ValueError, match="no mass"):
        lm.modes(block)
    with pytest.raises(ValueError, match="between 1 and 6"):
        lm.modes(on_slab([((0, 0, 0), (0.4, 0.3, 0.2))]), 7)


@pytest.mark.parametrize(("name", "within"), [("REGW", 0.05), ("DS", 0.15)])
def test_frequencies_of_the_assumed_walls_with_the_calibrated_stiffness_lie_within_some_per_cent_of_3dec(name, within):
    # of the regular wall nearer than of the irregular one, whose stones are not known
    test = experiments.load(SOURCE, name)
    found = lm.modes(test.assembly()).frequency
    for k, frequency in enumerate(found):
        assert frequency == pytest.approx(float(test.published[f"3DEC frequency {k + 1}"]), rel=within)


# ---- limit analysis and DEM -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def dry():
    """DS under an airbag that grows slowly: force at the ground [kN], displacement of the top [mm]."""
    test = experiments.load(SOURCE, "DS")
    wall, loads, top = test.assembly(), test.loads(), murano.control_block(test)
    settled = dem.simulate(wall, dem.Settle(tolerance=1e-4), loads=loads, contact_points=(3, 3))
    # joints that bend as their faces do sway more on the way: at half these steps the ground lags by 0.54 %
    ramps = [dem.Ramp(to=2.4, steps=6_000), dem.Ramp(to=3.6, steps=18_000, stop_when_moved=0.01)]
    history = dem.simulate(wall, ramps, loads=loads, start=settled, sample=60)
    moved = settled.displacement_of(top)[-1, 1] - history.displacement_of(top)[:, 1]
    return history, history.reaction[..., 1].sum(axis=1) / 1e3, 1e3 * moved


@pytest.mark.slow
def test_dry_wall_on_the_assumed_bond_with_its_fitted_friction_yields_within_a_tenth_of_3_kn(dry):
    # no prediction: the friction of 10 degrees was fitted by the source to this test, and the bond is assumed
    _, force, moved = dry
    at = [float(np.interp(u, moved, force)) for u in (1.0, 2.0, 5.0)]
    assert at[1] == pytest.approx(3.0, rel=0.1)
    assert at[0] < at[1] < at[2] < 1.1 * at[0]


@pytest.mark.slow
def test_initial_stiffness_of_the_dry_wall_is_not_that_of_3dec(dry):
    # 2.80 kN/mm in Table 10; here some three times as much: the load agrees, this does not
    _, force, moved = dry
    early = (force > 0.15) & (force < 0.45)
    stiffness = float(force[early] @ moved[early] / (moved[early] @ moved[early]))
    printed = float(experiments.load(SOURCE, "DS").published["3DEC initial stiffness"])
    assert 2.0 < stiffness / printed < 4.0


@pytest.mark.slow
def test_dry_wall_stays_below_the_associative_bound_at_small_displacements(dry):
    _, force, moved = dry
    test = experiments.load(SOURCE, "DS")
    bound = limit_analysis(test.assembly(), test.loads()).collapse_multiplier
    assert 0.7 * bound < force[moved < 2.0].max() < bound
    a = next(row for row in tables.table_10() if (row.wall, row.mechanism) == ("DS", "A"))
    weight = tables.murano_facade("DS").weight
    assert bound < a.recomputed * weight / 1e3


@pytest.mark.slow
def test_ground_takes_what_the_airbag_gives_until_the_facade_moves(dry):
    history, force, moved = dry
    early = (moved < 0.5) & (moved > 0.1)
    assert early.sum() > 10
    given = history["multiplier"][early]
    assert force[early].mean() == pytest.approx(given.mean(), rel=5e-3)
    # single samples ride on the vibrations of the faster ramp
    assert np.abs(force[early] - given).max() < 0.02 * given.max()


@pytest.mark.slow
def test_plastic_mortar_raises_the_bound_above_the_brittle_estimate():
    # a section carries ft A L / 2 when plastic and ft A L / 6 when elastic to its edge
    test = experiments.load(SOURCE, "REGW")
    for ground in ("bonded", "joint"):
        plain = test.with_options(ground=ground)
        bound = limit_analysis(plain.assembly(), plain.loads()).collapse_multiplier
        assert bound > 2.0 * float(test.published["3DEC peak"])


def test_mortared_wall_that_overturns_in_one_piece_meets_its_rigid_overturning():
    # a dry ground joint under mortared stones: F h / 2 = W y + 20 kN y_roof about the facade's foot
    test = experiments.load(SOURCE, "REGW", residual="full", ground="joint")
    wall, loads = test.assembly(), test.loads()
    dry = lm.Joint(60.0)
    wall = wall.with_interfaces(replace(i, joint=dry) if i.kind == "base" else i for i in wall.interfaces)
    y = wall.centroids[~wall.fixed, 1] @ wall.weights[~wall.fixed]
    force = (y + 20e3 * 0.65) / (1.35 / 2) / 1e3
    assert limit_analysis(wall, loads).collapse_multiplier == pytest.approx(force, rel=1e-6)
    # so does the one whose ground joint keeps cohesion and friction and has no tension
    loose = test.with_options(ground="no tension")
    assert limit_analysis(loose.assembly(), loose.loads()).collapse_multiplier == pytest.approx(force, rel=1e-6)
