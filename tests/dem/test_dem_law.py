"""The joint law of the DEM against exact laws: tension above the apex, what is lost in failure, energies, dilation."""

import numpy as np
import pytest
from joint_points import along
from walls import on_slab

import dem
import limitmason as lm

KN = KS = 1e9


# ---- tension above the apex of the cone


def steep(phi, **options):
    """Strengths of runs 13 and 16 of the panels: ft three times c, c / tan(phi) 0.107 or 0.071 MPa."""
    strengths = {"cohesion": 0.05e6, "tensile_strength": 0.15e6, "normal_stiffness": KN, "shear_stiffness": KS}
    return lm.Joint(phi, **(strengths | options))


@pytest.mark.parametrize("phi", [25.0, 35.0])
@pytest.mark.parametrize("brittle", [False, True])
def test_a_joint_is_pulled_off_at_its_tensile_strength_above_the_apex(phi, brittle):
    joint = steep(phi, **({"residual_cohesion": 0.0, "residual_tensile_strength": 0.0} if brittle else {}))
    side, lifted = 0.2, 4e-4
    block = on_slab([((0, 0, 0), (side, side, side))], joint=joint)
    up = {"x": 0.0, "y": 0.0, "z": lifted, "rx": 0.0, "ry": 0.0, "rz": 0.0}
    h = dem.simulate(block, [dem.Settle(), dem.Drive({1: up}, steps=2000)], contact_points=(3, 3), sample=1)
    pull = h.reaction[:, list(h.reaction_blocks).index(1), 2].max() - block.weights[1]
    assert pull == pytest.approx(0.15e6 * side**2, rel=2e-3)  # a step is 2e-7 m: 0.13 % of the opening at the peak
    assert pull > 1.39 * 0.05e6 / joint.tan_phi * side**2  # not c / tan(phi)


def test_beyond_the_apex_there_is_no_shear_and_slip_does_not_press_the_joint():
    joint = steep(35.0, dilatancy_angle_deg=20.0)
    opened = np.full(400, 0.1e6 / KN)  # N = -0.1 MPa, the apex at -0.0714
    path = along(joint, opening=opened, slip=np.linspace(0.0, 2e-5, 400))
    assert path.shear == pytest.approx(np.zeros(400), abs=1e-6)
    # it slides from the start and dilates up to the cone, on which it then stays: T = c + tan(phi) N
    path = along(joint, opening=opened, slip=np.linspace(0.0, 4e-4, 4000)[::10])
    onto = np.maximum(0.05e6 + joint.tan_phi * path.normal, 0.0)
    assert path.normal[-1] > -0.0714e6
    assert np.abs(path.shear) == pytest.approx(onto, rel=1e-9, abs=1e-3)
    # pulled without any slip nothing lifts
    assert not along(joint, opening=np.linspace(0.0, 1.4e-4, 300)).lift.any()


def test_a_named_residual_strength_is_taken_as_it_is_and_an_unnamed_one_ends_with_the_cone():
    pulled = np.linspace(0.0, 4e-4, 2000)
    kept = steep(35.0, residual_cohesion=0.0, residual_tensile_strength=0.02e6)
    assert along(kept, opening=pulled).normal[-1] == pytest.approx(-0.02e6)
    assert along(steep(35.0, residual_cohesion=0.0), opening=pulled).normal[-1] == pytest.approx(-0.15e6)
    inside = steep(35.0, tensile_strength=0.05e6, residual_cohesion=0.0)
    assert along(inside, opening=pulled).normal[-1] == 0.0


@pytest.mark.parametrize("phi", [25.0, 35.0])
def test_forces_above_the_apex_lie_within_the_law_of_the_dem_and_outside_the_convex_one(phi):
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=steep(phi))
    apex = 0.05e6 / np.tan(np.radians(phi))
    convex, full = (lm.law.interface_law(block.arrays, convex=c) for c in (True, False))
    n = np.array([-0.5 * (apex + 0.15e6)])
    assert full.excess(n, np.zeros(1))[0] <= 0.0 < convex.excess(n, np.zeros(1))[0]
    assert full.excess(n, np.array([1e3]))[0] == pytest.approx(1e3)
    assert full.excess(np.array([-0.16e6]), np.zeros(1))[0] == pytest.approx(0.01e6)


def test_a_block_hung_from_its_joint_falls_at_ft_in_the_dem_and_at_the_apex_in_limit_analysis_which_says_so():
    joint = lm.Joint(45.0, cohesion=10e3, tensile_strength=60e3, normal_stiffness=1e9, name="hanger")
    hung = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=joint)
    loads = lm.Loads.weight(hung).with_point_load(hung, 1, (0, 0, 1.0))
    weight = hung.weights[1]
    found = lm.predict(hung, loads, "dem", error_budget=(), contact_points=(2, 2), tolerance=1e-3)
    assert found.collapse_multiplier == pytest.approx(60e3 * 0.04 + weight, rel=2e-3)
    assert found.certificate.yield_violation < 1e-6
    assert not any("apex" in w for w in found.warnings)
    cut = lm.predict(hung, loads, "limit")
    assert cut.collapse_multiplier == pytest.approx(10e3 * 0.04 + weight, rel=1e-6)
    assert any("(hanger) counts as c / tan(phi) = 1e+04 Pa" in w for w in cut.warnings)
