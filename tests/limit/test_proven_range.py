"""The range of all admissible multipliers: values from an independent program, proofs that agree, errors."""

import numpy as np
import pytest
from walls import on_slab, running_bond

import limitmason as lm
from limitmason.geometry import box
from limitmason.limit import make_problem
from limitmason.limit.associative import solve_associative
from limitmason.limit.nonassociative.joint_law import from_corner, joint_law, violation
from limitmason.limit.nonassociative.lifted import lifted_bound
from limitmason.limit.nonassociative.mixed_integer import BoundedProgram
from limitmason.limit.nonassociative.polish import PlanePrograms
from limitmason.limit.nonassociative.search import EFFORTS, search_smallest
from limitmason.limit.range.proven_range import velocity_limits


def wall(units, courses, *, mu=0.8, psi_deg=0.0):
    """Running bond of 0.4 x 0.175 m units, bottom course with half units."""
    joint = lm.Joint.from_friction_coefficient(mu, dilatancy_angle_deg=psi_deg)
    return running_bond(units, courses, half_first=True, size=(0.4, 0.175, 0.2), joint=joint)


def portal():
    """Two piers of two courses, a lintel course and one above."""
    length, height = 0.4, 0.175
    boxes = []
    for k, row in enumerate([[0.5, -1, 0.5], [0.5, -1, 0.5], [1, 1], [0.5, 1, 0.5]]):
        x = 0.0
        for width in row:
            if width > 0:
                boxes.append(((x * length, 0, k * height), ((x + width) * length, 0.2, (k + 1) * height)))
            x += abs(width)
    return on_slab(boxes, mu=0.65)


@pytest.mark.slow
def test_wall_of_two_by_three_blocks_is_proven_without_bounds():
    # 8/11 = (v / 2h) (4n + 2) / (4n - 1), the stepped crack in closed form; 0.769510 is the associative value
    assembly = wall(2, 3)
    found = lm.proven_range(assembly, lm.Loads.horizontal(assembly), time_limit=30)
    assert found.proven
    assert found.smallest == pytest.approx(8 / 11, abs=1e-6)
    assert found.largest == pytest.approx(0.769510, abs=1e-6)
    assert found.ends["smallest"].method == "lifted linear program"
    assert not found.ends["smallest"].velocity_bounded
    assert found.ends["smallest"].gap < 1e-5
    assert "nothing below 0.727273 without bounds on forces or velocities" in str(found)


def prepared(assembly):
    problem = make_problem(assembly, lm.Loads.horizontal(assembly))
    upper = solve_associative(problem)
    law = joint_law(problem)
    normal = (upper.resultants.point_force * problem.points.directions[:, 0]).sum(axis=1) / problem.force_scale
    best = search_smallest(law, from_corner(law, normal), effort=EFFORTS["quick"]).best
    return problem, law, upper.collapse_multiplier / problem.live_scale, best


@pytest.mark.parametrize("largest", [pytest.param(False, marks=pytest.mark.slow), True])
def test_mixed_integer_program_agrees_with_the_lifted_one_and_the_associative_end(largest):
    problem, law, top, best = prepared(wall(2, 2, mu=1.0))
    programs = PlanePrograms(law)
    program = BoundedProgram(programs, -1e-6, top + 1e-6, velocity_limits(problem, 20.0), 20.0)
    proof = program.solve(best, largest=largest, time_limit=30.0)
    assert proof.status == "Optimal"
    assert violation(law, proof.state).worst < 1e-9
    assert proof.bound == pytest.approx(proof.state.multiplier, abs=1e-5)
    assert proof.velocity_share < 1.0
    if largest:
        assert proof.bound <= top + 1e-5
    else:
        lifted = lifted_bound(programs, 0.0, top + 1e-6)
        assert lifted.residual < 1e-6
        assert lifted.value <= proof.bound + 1e-6
        assert proof.bound == pytest.approx(best.multiplier, abs=1e-6)


@pytest.mark.slow
def test_smooth_slip_needs_the_mixed_integer_program_and_says_its_bounds():
    # friction so high that the lifted program leaves a gap
    assembly = wall(2, 3, mu=2.0)
    found = lm.proven_range(assembly, lm.Loads.horizontal(assembly), which="smallest", time_limit=60)
    end = found.ends["smallest"]
    assert end.proven
    assert end.method == "mixed-integer program"
    assert end.velocity_bounded
    assert end.velocity_share < 0.5
    assert found.smallest == pytest.approx(8 / 11, abs=1e-5)
    assert "for velocities up to 20 times" in str(found)
    assert np.isnan(found.largest)


@pytest.mark.parametrize("mu, psi_deg", [(0.5, 0.0), (0.9, 10.0), (1.4, 3.0)])
def test_lifted_bound_never_lies_above_a_certified_state(mu, psi_deg):
    _, law, top, best = prepared(wall(2, 2, mu=mu, psi_deg=psi_deg))
    bound = lifted_bound(PlanePrograms(law), 0.0, top + 1e-6)
    assert bound.status == "Optimal"
    assert bound.value <= best.multiplier + 1e-7


@pytest.mark.slow
def test_portal_of_four_courses():
    # both values by an independent mixed-integer program
    assembly = portal()
    found = lm.proven_range(assembly, lm.Loads.horizontal(assembly), time_limit=30)
    assert found.proven
    assert (found.smallest, found.largest) == pytest.approx((0.422852, 0.455456), abs=1e-5)


def test_largest_multiplier_of_ferris_and_tin_loi_wall_1_is_the_associative_value():
    test = lm.experiments.load("ferris-tin-loi-2001", "wall-1")
    found = lm.proven_range(test.assembly(), test.loads(), which=("largest",), time_limit=30)
    assert found.ends["largest"].proven
    assert found.ends["largest"].method == "associative"
    assert found.largest == pytest.approx(0.642859, abs=1e-5)


def test_range_is_a_point_where_psi_equals_phi():
    assembly = running_bond(2, 2, joint=lm.Joint(33.0, dilatancy_angle_deg=33.0))
    found = lm.proven_range(assembly, lm.Loads.horizontal(assembly))
    assert found.smallest == found.largest == found.associative


def test_a_short_time_limit_still_returns_a_state_and_a_bound():
    assembly = wall(2, 3, mu=2.0)
    found = lm.proven_range(assembly, lm.Loads.horizontal(assembly), which="smallest", time_limit=0.01)
    end = found.ends["smallest"]
    assert not end.proven
    assert end.bound <= 8 / 11 <= end.value + 1e-9
    assert "not proven" in str(found)


def test_problems_that_it_cannot_take_are_refused():
    assembly = running_bond(2, 2)
    with pytest.raises(ValueError, match="plane problem"):
        lm.proven_range(assembly, lm.Loads.horizontal(assembly, (0, 1, 0)))
    with pytest.raises(ValueError, match="which must hold"):
        lm.proven_range(assembly, lm.Loads.horizontal(assembly), which="least")
    with pytest.raises(ValueError, match="velocity_bound"):
        lm.proven_range(assembly, lm.Loads.horizontal(assembly), velocity_bound=0.5)
    weak = running_bond(2, 2, joint=lm.Joint(33.0, compressive_strength=1e6))
    with pytest.raises(ValueError, match="compressive strength"):
        lm.proven_range(weak, lm.Loads.horizontal(weak))


def test_smallest_multiplier_is_proven_where_the_associative_one_has_no_end():
    """Under a ceiling a block that dilates is wedged, one that does not slides at mu W: any force of the ceiling adds.

    The floor bears W + N, the ceiling N, so that lambda W = mu (W + 2 N).
    """
    mu = 0.5
    boxes = [box((-1, 0, -0.2), (2, 0.3, 0)), box((0, 0, 0), (1, 0.3, 0.2)), box((-1, 0, 0.2), (2, 0.3, 0.4))]
    wedged = lm.Assembly.from_polyhedra(boxes, joint=lm.Joint.from_friction_coefficient(mu), fixed=[0, 2])
    loads = lm.Loads.horizontal(wedged)
    assert lm.limit_analysis(wedged, loads).status == "unbounded"
    found = lm.proven_range(wedged, loads, which="smallest")
    assert found.proven
    assert found.smallest == pytest.approx(mu, abs=1e-6)
    assert found.associative == np.inf
    assert "without end" in str(found)
    with pytest.raises(lm.errors.NotConverged, match="ask for which='smallest'"):
        lm.proven_range(wedged, loads)
