"""Zoned walls that are driven: the associative multiplier, rate, cracks of units, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from stacked_bricks import stacked

import dem
import limitmason as lm
from dem.driving.push_curve import told
from dem.kernels.zone_plasticity import SHEAR_NOW
from dem.zones.recording import TENSION, ZoneState
from limitmason import figures
from limitmason.errors import InputError, NotConverged


def wall(phi, psi, material, **joint):
    law = lm.Joint(phi, dilatancy_angle_deg=psi, **({"normal_stiffness": 5e11, "shear_stiffness": 5e11} | joint))
    made = lm.build.wall(
        length=0.8, courses=4, unit=(0.4, 0.2, 0.2), joint=law, density=2000.0, top_beam=0.2, beam_density=60_000.0
    )
    return made.with_material(material, blocks=[b.name for b in made.blocks if b.name != "beam"])


STIFF = lm.Material(young_modulus=2e11, poisson_ratio=0.2, density=2000.0)
EAST = dem.Drive({"beam": {"x": 1.0}})


def zoned(model, drive, **options):
    return dem.push(model, drive, blocks="zoned", **options)


@pytest.mark.parametrize("phi", [pytest.param(35.0, marks=pytest.mark.slow), 55.0])
def test_plastic_joints_with_psi_equal_to_phi_carry_the_associative_multiplier(phi):
    model = wall(phi, phi, STIFF)
    loads = lm.Loads.weight(model).with_point_load(model, "beam", (1.0, 0, 0), at=tuple(model.centroids[-1]))
    exact = lm.limit_analysis(model, loads, contact_model="grid", grid=(3, 2)).collapse_multiplier
    # neither slides under the beam alone: that would be its weight times tan(phi)
    assert exact < 0.9 * model.weights[-1] * np.tan(np.deg2rad(phi))
    curve = zoned(model, EAST, to=2e-4, zone_size=0.1, contact_points=(3, 2), samples=50, steps=10_000)
    assert curve.residual == pytest.approx(exact, rel=3e-3)
    assert curve.rate_error < 0.02
    assert curve.errors["energy"].max() < 1e-3


@pytest.mark.slow
def test_weak_stone_cracks_is_marked_and_lowers_the_load():
    # stones a hundred times weaker than those that never crack; both runs with the same joints
    strong = dict(normal_stiffness=2e10, shear_stiffness=1e10, cohesion=5e5, tensile_strength=3e5)
    weak = lm.Material(
        young_modulus=5e9, poisson_ratio=0.2, density=2000.0, cohesion=1e5, friction_angle_deg=40.0,
        tensile_strength=2e4,
    )
    elastic = lm.Material(young_modulus=5e9, poisson_ratio=0.2, density=2000.0)
    options = dict(to=2e-3, zone_size=0.1, samples=50, steps=10_000, rate_check=False)
    cracked = zoned(wall(40.0, 0.0, weak, **strong), EAST, **options)
    whole = zoned(wall(40.0, 0.0, elastic, **strong), EAST, **options)
    assert cracked.peak.load < 0.9 * whole.peak.load
    assert cracked.event("unit cracks") is not None
    assert whole.event("unit cracks") is None
    assert (cracked.zones[-1].marks == TENSION).any()
    assert not whole.zones[-1].flags.any()
    # stiffness at the start is that of elastic stones
    assert cracked.load[3] == pytest.approx(whole.load[3], rel=0.02)
    figure = figures.plasticity(cracked)
    zones = next(a for a in figure.findobj() if a.get_gid() == "zones")
    assert len(zones.get_paths()) == len(cracked.mesh.zones)
    with pytest.raises(InputError, match="unknown moment"):
        figures.plasticity(cracked, at=("middle",))


def test_a_push_whose_steps_nobody_chose_is_slow_enough_for_brittle_joints():
    curve = zoned(wall(35.0, 0.0, STIFF), EAST, to=1e-5, zone_size=0.2, samples=50, rate_check=False)
    assert curve.steps >= 40_000


@pytest.mark.slow
def test_an_event_of_zones_names_the_block_of_the_one_that_it_tells_the_strain_of():
    curve = zoned(wall(35.0, 0.0, STIFF), EAST, to=1e-5, zone_size=0.2, samples=10, steps=1000, rate_check=False)
    flags, plastic = np.zeros((len(curve.mesh.zones), 4), dtype=np.int64), np.zeros(len(curve.mesh.zones))
    flags[[0, -1]], plastic[[0, -1]] = SHEAR_NOW, [1e-4, 3e-4]  # zones of two blocks yield at one sample
    made = replace(curve, zones=(curve.zones[0], ZoneState(curve.zones[1].shift, flags, plastic)))
    event = next(e for e in told(made, "").events if e.name == "unit yields")
    assert curve.mesh.zone_block[0] != curve.mesh.zone_block[-1]
    assert event.where == curve.assembly.blocks[curve.mesh.zone_block[-1]].name
    assert (event.index, event.value) == (1, 3e-4)


def test_what_a_zoned_push_cannot_do_is_refused():
    model = wall(35.0, 0.0, STIFF)
    options = dict(to=1e-4, zone_size=0.1)
    with pytest.raises(InputError, match="leaves the x-z plane"):
        zoned(model, dem.Drive({"beam": {"x": 1.0, "y": 0.5}}), **options)
    with pytest.raises(InputError, match="take no calm: leave it out of the drive"):
        zoned(model, dem.Drive({"beam": {"x": 1.0}}, calm=1e-4), **options)
    with pytest.raises(InputError, match="leave out its steps, stop_when_moved"):
        zoned(model, dem.Drive({"beam": {"x": 1.0}}, steps=100, stop_when_moved=0.1), **options)
    with pytest.raises(InputError, match="no direction"):
        zoned(model, dem.Drive({"beam": {"x": 0.0}}), **options)
    with pytest.raises(InputError, match="larger than the shortest side"):
        zoned(model, EAST, to=1e-4, zone_size=0.3)
    with pytest.raises(InputError, match="to must be"):
        zoned(model, EAST, to=0.0, zone_size=0.1)
    with pytest.raises(InputError, match="need zone_size"):
        zoned(model, EAST, to=1e-4)
    with pytest.raises(InputError, match="rigid blocks take no stress: .*simply deformable, zoned"):
        dem.push(model, EAST, to=1e-4, stress="plane strain")
    for size in ((0.1, 0.1), "5mm", True, float("nan")):
        with pytest.raises(InputError, match="must be a positive length"):
            zoned(model, EAST, to=1e-4, zone_size=size)
    # 0.64 m2 in squares of 0.1 mm are 64 million
    with pytest.raises(InputError, match=r"into 6.4e\+07 zones"):
        zoned(model, EAST, to=1e-4, zone_size=1e-4)
    with pytest.raises(InputError, match="no zones"):
        figures.plasticity(lm.Curve([0.0, 1.0], [0.0, 1.0]))


def test_a_run_is_reported_and_can_be_stopped():
    seen = []

    def stop(sample):
        seen.append(sample)
        return sample["displacement"] > 1e-5

    curve = zoned(wall(35.0, 0.0, STIFF), EAST, to=1e-4, zone_size=0.2, samples=50, steps=5000, progress=stop)
    assert curve.status == "interrupted"
    assert len(curve) == len(seen) + 1 < 20
    assert 0.0 < seen[-1]["part"] < 0.2
    assert seen[-1]["time left"] > 0.0
    assert "zones up to 200 mm, plane stress" in str(curve)


def test_hopeless_contrasts_are_refused_with_the_predicted_time_before_anything_settles():
    stiff = lm.Material(young_modulus=3e15, poisson_ratio=0.2)
    seen = []
    options = dict(to=1e-4, zone_size=0.2, samples=20, longest=1.0, progress=seen.append)
    model = wall(35.0, 0.0, stiff, normal_stiffness=1e10, shear_stiffness=5e9)
    with pytest.raises(InputError, match=r"would take about .* h: .* E / size = 1.5e\+16 Pa/m, joints from 5e\+09"):
        zoned(model, EAST, **options)
    # chosen steps are the user's, settling is not
    with pytest.raises(InputError, match="to settle some 10 of them; zones"):
        zoned(model, EAST, steps=1000, **options)
    assert not seen


@pytest.mark.slow
def test_units_that_flow_under_their_load_are_said_to_fall():
    mud = lm.Material(young_modulus=3e9, poisson_ratio=0.2, cohesion=10.0, friction_angle_deg=30.0)
    with pytest.raises(NotConverged, match="falls under its dead loads before it is driven"):
        zoned(wall(35.0, 0.0, mud, normal_stiffness=1e10, shear_stiffness=5e9), EAST, to=1e-4, zone_size=0.2)


@pytest.mark.slow
def test_a_unit_that_is_crushed_and_one_that_is_torn_are_found_at_their_strain_and_width():
    unit = lm.Material(
        young_modulus=5e9, poisson_ratio=0.0, cohesion=1e6, friction_angle_deg=0.0, tensile_strength=1e5
    )
    joint = lm.Joint(0.0, normal_stiffness=5e11, shear_stiffness=5e11, tensile_strength=1e9, cohesion=1e9)
    model = lm.build.wall(length=0.2, courses=1, unit=(0.2, 0.2, 0.2), joint=joint, density=20.0, top_beam=0.1,
                          beam_density=20.0)
    model = model.with_material(unit, blocks=[b.name for b in model.blocks if b.name.startswith("facade")])
    for sense, strength in ((-1.0, 2e6), (1.0, 1e5)):
        curve = zoned(model, dem.Drive({"beam": {"z": sense, "x": 0.0, "ry": 0.0}}), to=5e-4, zone_size=0.2,
                      samples=100, steps=20_000, rate_check=False)
        # tau <= c: 2 c in compression; ft in tension; both perfectly plastic
        assert curve.residual == pytest.approx(0.04 * strength, rel=3e-3)
        elastic = strength * 0.2 / 5e9
        crack, toe = curve.first_unit_crack(2e-4), curve.first_crushing(1.4e-3)
        # of a zone's four points the most strained counts, and a body without hardening need not strain evenly
        if sense > 0.0:
            assert toe is None
            assert crack.where.startswith("facade")
            assert 0.6 * 2e-4 < crack.displacement - elastic < 2.1e-4
        else:
            assert crack is None
            # psi = 0: strains e and -e along the two axes, of length e sqrt(2)
            assert 0.6 * 2e-4 < toe.displacement - elastic < 2.1e-4
    for wrong in (0.0, -1.0):
        with pytest.raises(InputError, match="width must be positive"):
            curve.first_unit_crack(wrong)
        with pytest.raises(InputError, match="strain must be positive"):
            curve.first_crushing(wrong)


@pytest.mark.parametrize("servo", [{"top": dem.Servo(100.0)}, {"ground": dem.Servo(100.0)}, {"top": 100.0}])
def test_a_jack_on_what_is_driven_or_held_up_or_that_is_none_is_refused_as_of_other_blocks(servo):
    """Its force went into what holds the block, and did nothing."""
    drive = dem.Drive({"top": {"z": -1.0}}, servo=servo)
    with pytest.raises(InputError, match="its vertical is held or driven already|must be a Servo, got 100.0"):
        dem.push(stacked(1), drive, to=1e-4, blocks="zoned", zone_size=0.1)


def test_the_settlement_is_that_of_the_block_that_moves_farthest_and_not_of_one_that_turns_more():
    outlines = [[[-1.0, -0.1], [1.0, -0.1], [1.0, 0.0], [-1.0, 0.0]]] + [
        [[x, z], [x + 0.2, z], [x + 0.2, z + 0.1], [x, z + 0.1]] for x in (0.0, 0.5) for z in (0.0, 0.1)
    ]
    names, joint = ["ground", "low", "top", "side", "lid"], lm.Joint(30.0, normal_stiffness=1e11)
    made = lm.Assembly.from_polygons(outlines, thickness=0.1, joint=joint, fixed=["ground"], names=names)
    drive = dem.Drive({"top": {"z": -1.0}, "lid": {"ry": 5.0}})
    curve = zoned(made.with_material(STIFF), drive, to=1e-6, zone_size=0.1, samples=10, steps=100, rate_check=False)
    # each joint closes by the weight above it over its stiffness
    area = 0.2 * 0.1
    assert curve.settlement == pytest.approx((made.weights[2] + made.weights[1:3].sum()) / (1e11 * area), rel=0.05)
