"""Wallettes cut from a bond at an angle, and their four-point bending: areas, closed forms, statics."""

import numpy as np
import pytest

import dem
from limitmason import experiments
from limitmason.experiments import mcmaster_bending as mcmaster
from limitmason.experiments.mcmaster_bending import LOADED, SUPPORTS, cut_bond
from limitmason.geometry import polygon_area_centroid
from limitmason.limit import limit_analysis
from limitmason.mechanics.contact_points import contact_points

SOURCE = "mcmaster-bending"


@pytest.mark.parametrize("theta", [0, 15, 45, 75, 90])
def test_pieces_tile_the_wallette_but_for_slivers_at_its_edges(theta):
    pieces = cut_bond(1.6, 0.79, 0.4, 0.2, np.deg2rad(theta))
    area = sum(polygon_area_centroid(p)[0] for p in pieces)
    assert 0.97 < area / (1.6 * 0.79) <= 1.0 + 1e-12
    assert all(polygon_area_centroid(p)[0] > 0.04 * 0.4 * 0.2 for p in pieces)
    whole = [p for p in pieces if polygon_area_centroid(p)[0] == pytest.approx(0.4 * 0.2)]
    assert whole
    for p in whole:
        edges = np.diff(np.vstack([p, p[:1]]), axis=0)
        longest = edges[np.argmax(np.linalg.norm(edges, axis=1))]
        assert np.rad2deg(np.arctan2(longest[1], longest[0])) % 180 == pytest.approx(theta % 180, abs=1e-6)


def test_bed_joints_lie_at_the_stated_angle_and_bars_across_the_span():
    test = experiments.load(SOURCE, "theta-15")
    wall = test.assembly()
    along = np.array([np.cos(np.deg2rad(15)), 0, np.sin(np.deg2rad(15))])
    mortar = [i for i in wall.interfaces if i.joint.name == "mortar joint"]
    dots = np.array([abs(i.normal @ along) for i in mortar])
    assert ((dots < 1e-9) | (dots > 1 - 1e-9)).all()
    x = [wall.centroids[wall.block_index(b), 0] for b in (*SUPPORTS, *LOADED)]
    assert x == pytest.approx([-0.75, 0.75, -0.35, 0.35])


def test_straight_bed_joint_in_full_tension_has_three_times_its_strength():
    test = experiments.load(SOURCE, "theta-90", residual="full")
    found = limit_analysis(test.assembly(), test.loads()).collapse_multiplier
    # the support gives way to the inner edge of its bar, 2 mm wide; a loading bar is free and keeps its force central
    arm = 0.5 * (test.options["support_span"] - test.options["load_span"])
    exact = float(test.recomputed["plastic tension"]) * arm / (arm - 0.001)
    assert found == pytest.approx(exact, rel=1e-4)


@pytest.mark.slow
def test_reaction_of_the_supports_equals_the_load_before_failure():
    test = experiments.load(SOURCE, "theta-0")
    held = dict.fromkeys(("x", "z", "rx", "ry", "rz"), 0.0)
    drive = dem.Drive(displacement={b: {"y": -2e-4, **held} for b in LOADED}, steps=20_000)
    history = dem.simulate(test.assembly(), drive, loads=test.loads(), contact_points=(4, 8), sample=1000)
    load = -sum(history.reaction_of(b)[-1, 1] for b in LOADED)
    support = sum(history.reaction_of(b)[-1, 1] for b in SUPPORTS)
    assert load > 0
    assert support == pytest.approx(load, rel=5e-3)


def test_no_measured_strength_is_packaged_and_the_assumptions_say_so():
    for name in experiments.specimens(SOURCE):
        test = experiments.load(SOURCE, name)
        assert not test.measured
        assert any("spans are assumed" in a for a in test.assumptions)
    with pytest.raises(ValueError, match="must grow"):
        experiments.load(SOURCE, "theta-0", load_span=1.5)
    with pytest.raises(ValueError, match="less than a shear span"):
        experiments.load(SOURCE, "theta-0", support_span=1.0, load_span=0.6, bar_width=0.3)
    wide = experiments.load(SOURCE, "theta-0", bar_width=0.05).assembly()
    assert [np.ptp(wide.blocks[wide.block_index(b)].vertices[:, 0]) for b in LOADED] == pytest.approx([0.05, 0.05])
    with pytest.raises(ValueError, match="residual"):
        experiments.load(SOURCE, "theta-0", residual="some")


def test_line_load_gives_the_stress_it_is_asked_for():
    test = experiments.load(SOURCE, "theta-0")
    moment = mcmaster.line_load(test, 1e6) * 0.4
    assert 6.0 * moment / (0.79 * 0.15**2) == pytest.approx(1e6)


@pytest.mark.parametrize("theta", [0, 15, 45, 75, 90])
def test_contact_grid_has_its_second_number_of_points_across_the_thickness(theta):
    wall = experiments.load(SOURCE, f"theta-{theta}", block_scale=0.5).assembly()
    points = contact_points(wall, contact_model="grid", grid=(3, 7))
    for k, joint in enumerate(wall.interfaces):
        if joint.joint.name == "mortar joint":
            y = points.position[points.interface == k, 1]
            assert len(np.unique(y.round(9))) == 7


def test_thinner_blocks_have_the_same_plastic_strength_of_a_straight_joint():
    test = experiments.load(SOURCE, "theta-90", residual="full", block_scale=0.5, scale_thickness=True)
    assert mcmaster.thickness_of(test) == pytest.approx(0.075)
    assert {round(float(np.ptp(b.vertices[:, 1])), 9) for b in test.assembly().blocks[:5]} == {0.075}
    found = limit_analysis(test.assembly(), test.loads()).collapse_multiplier
    # three times ft, whatever the thickness; the support gives way to the inner edge of its bar
    assert found == pytest.approx(3.0 * 0.36 * 0.4 / 0.399, rel=1e-4)


def test_weight_of_a_lying_wallette_is_that_of_its_blocks_and_acts_with_the_load():
    test = experiments.load(SOURCE, "theta-15", density=1500.0)
    wall, loads = test.assembly(), test.loads()
    volume = sum(b.volume for b in wall.blocks if b.name.startswith("block-"))
    assert loads.dead.sum(axis=0)[:3] == pytest.approx([0.0, -1500.0 * 9.81 * volume, 0.0], rel=1e-3)
    assert loads.live[:, 1].sum() < 0.0
    assert not experiments.load(SOURCE, "theta-15").loads().dead.any()
    for wrong in ({"density": -1.0}, {"bond_shift": 1.0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            experiments.load(SOURCE, "theta-0", **wrong)


def test_a_shifted_bond_still_fills_the_wallette():
    for theta, shift in ((0.0, 0.5), (15.0, 0.25)):
        pieces = cut_bond(1.6, 0.79, 0.4, 0.2, np.deg2rad(theta), shift)
        assert 0.97 < sum(polygon_area_centroid(p)[0] for p in pieces) / (1.6 * 0.79) <= 1.0 + 1e-12
    beds = {round(float(z), 6) for p in cut_bond(1.6, 0.79, 0.4, 0.2, 0.0, 0.5) for z in p[:, 1]}
    assert beds == {-0.395, -0.3, -0.1, 0.1, 0.3, 0.395}
