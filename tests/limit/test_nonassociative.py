"""Non-associative limit analysis: published walls, closed forms, order of values, and a certificate that can fail."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walls import leaning, on_slab, running_bond, stack

import limitmason as lm
from limitmason.answers.results import FlowRule
from limitmason.geometry import box
from limitmason.limit import make_problem
from limitmason.limit.nonassociative.analysis import radenkovic_lower
from limitmason.limit.nonassociative.joint_law import ForceState, joint_law, violation
from limitmason.limit.nonassociative.search import Effort
from limitmason.mechanics.certificate import certify


def analyse(assembly, direction=(1, 0, 0), *, loads=None, search="quick", measure_jump=False, **options):
    loads = loads or lm.Loads.horizontal(assembly, direction)
    return lm.limit_analysis(
        assembly, loads, flow_rule="non-associative", search=search, measure_jump=measure_jump, **options
    )


def value(assembly, direction=(1, 0, 0), **options):
    prediction = analyse(assembly, direction, **options)
    assert prediction.status == "solved"
    return prediction.collapse_multiplier


def assert_certified(prediction, tolerance):
    c = prediction.certificate
    assert prediction.status == "solved"
    assert c.equilibrium_residual <= tolerance
    assert c.yield_violation <= tolerance
    assert c.flow_residual <= tolerance
    assert c.complementarity <= tolerance


FERRIS = "ferris-tin-loi-2001"


def ferris(number):
    test = lm.experiments.load(FERRIS, f"wall-{number}")
    return test, test.assembly()


@pytest.mark.parametrize("number, published", [(1, 0.640),
    pytest.param(2, 0.563, marks=pytest.mark.slow), (3, 0.356), (4, 0.264), (5, 0.215),
    pytest.param(6, 0.297, marks=pytest.mark.slow)])
def test_ferris_and_tin_loi_2001_smallest_multiplier_at_zero_dilatancy(number, published):
    # the published values come from a local solver: a certified lower one is a finding
    test, wall = ferris(number)
    prediction = analyse(wall, loads=test.loads())
    assert_certified(prediction, 1e-9)
    assert prediction.collapse_multiplier <= 1.01 * published
    assert prediction.collapse_multiplier >= 0.97 * published
    low, high = prediction.details["radenkovic"]
    assert low <= prediction.collapse_multiplier <= high + 1e-8
    first, last = prediction.details["interval_at_mechanism"]
    assert first <= prediction.collapse_multiplier + 1e-9
    assert last <= high + 1e-7


def test_associative_value_where_psi_equals_phi():
    wall = running_bond(3, 4, joint=lm.Joint(33.0, dilatancy_angle_deg=33.0))
    prediction = analyse(wall)
    associative = lm.limit_analysis(wall, lm.Loads.horizontal(wall))
    assert prediction.collapse_multiplier == pytest.approx(associative.collapse_multiplier, abs=1e-9)
    assert abs(prediction.certificate.gap) < 1e-6
    assert prediction.method.startswith("limit analysis, non-associative")


@pytest.mark.slow
def test_smallest_multiplier_rises_with_dilatancy_between_radenkovics_bounds():
    test, wall = ferris(3)
    found = []
    for share in (0.0, 0.01, 0.25, 0.5, 0.75, 1.0):
        angle = np.degrees(np.arctan(share * 0.65))
        joint = lm.Joint.from_friction_coefficient(0.65, dilatancy_angle_deg=angle)
        prediction = analyse(wall.with_joints(joint), loads=test.loads())
        found.append(prediction.collapse_multiplier)
        if share < 1:
            # the certificate's flow rule knows psi from the assembly alone
            assert_certified(prediction, 1e-8)
            low, high = prediction.details["radenkovic"]
            assert low - 1e-7 <= found[-1] <= high + 1e-7
    assert np.all(np.diff(found) >= -1e-7)
    assert found[-1] == pytest.approx(lm.limit_analysis(wall, test.loads()).collapse_multiplier, abs=1e-8)


@pytest.mark.slow
def test_jump_at_zero_dilatancy_is_said():
    test, wall = ferris(3)
    prediction = analyse(wall, loads=test.loads(), measure_jump=True)
    assert prediction.details["at_small_dilatancy"] > 1.1 * prediction.collapse_multiplier
    assert any("jump at psi = 0" in w for w in prediction.warnings)


@pytest.mark.parametrize("n", [3, pytest.param(8, marks=pytest.mark.slow), pytest.param(12, marks=pytest.mark.slow)])
def test_running_bond_without_head_joints_above_bond_slope_keeps_the_mechanisms_value(n):
    # (v / 2h) (4n + 2) / (4n - 1): opening u_n = f u_s raises the associative value for f > v / h, sliding without
    # dilation does not
    wall = running_bond(n + 2, n, half_first=True, heads=False, mu=1.2)
    prediction = analyse(wall)
    assert_certified(prediction, 1e-9)
    assert prediction.collapse_multiplier == pytest.approx((4 * n + 2) / (4 * n - 1) / 2, abs=1e-7)
    assert prediction.details["radenkovic"][1] > prediction.collapse_multiplier + 0.03


@pytest.mark.parametrize("mu", [0.2, 0.65])
@pytest.mark.parametrize("in_plane", [None, False])
def test_single_block_slides_or_rocks(mu, in_plane):
    assert value(stack([(0.3, 1.0)], mu=mu), in_plane=in_plane) == pytest.approx(min(mu, 0.3), abs=1e-8)


def test_stack_rocks_about_the_lowest_joint():
    assert value(stack([(0.5, 0.4)] * 6, mu=0.9)) == pytest.approx(0.5 / (6 * 0.4), abs=1e-8)


@pytest.mark.parametrize("in_plane", [None, False])
def test_cohesive_block_slides_at_cohesion_plus_friction(in_plane):
    joint = lm.Joint(20.0, cohesion=5e3, tensile_strength=3e3)
    block = stack([(2.0, 0.5)], joint=joint)
    prediction = analyse(block, in_plane=in_plane)
    assert_certified(prediction, 1e-9)
    assert prediction.collapse_multiplier == pytest.approx(joint.tan_phi + 5e3 * 2.0 / block.weights[1], rel=1e-8)


def test_cohesive_block_rocks_as_in_associative_analysis():
    # nothing slides: dilatancy does not matter, the tension at the heel does
    block = stack([(0.4, 1.0)], joint=lm.Joint(35.0, cohesion=5e3, tensile_strength=3e3))
    prediction = analyse(block)
    assert_certified(prediction, 1e-9)
    expected = (block.weights[1] * 0.2 + 0.5 * 3e3 * 0.4 * 0.4) / (block.weights[1] * 0.5)
    assert prediction.collapse_multiplier == pytest.approx(expected, rel=1e-8)


@pytest.mark.slow
def test_frictionless_head_joints_equal_none():
    wall = running_bond(3, 4)
    smooth = wall.with_joints({"head": lm.Joint(0.0)})
    assert value(smooth) == pytest.approx(value(running_bond(3, 4, heads=False)), abs=1e-7)
    assert value(smooth, in_plane=False) == pytest.approx(value(smooth), abs=1e-6)


def test_crushing_points_carry_their_capacity():
    # one block that rocks: the associative program with the same points is exact, dilatancy does not matter
    block = stack([(0.5, 1.0)], joint=lm.Joint(60.0, compressive_strength=2e5))
    loads = lm.Loads.horizontal(block).with_point_load(block, 1, (0, 0, -3e4), at=(0.25, 0.5, 1.0), case="dead")
    options = {"contact_model": "grid", "grid": (9, 3)}
    for in_plane in (None, False):
        prediction = analyse(block, loads=loads, in_plane=in_plane, **options)
        assert_certified(prediction, 1e-8)
        associative = lm.limit_analysis(block, loads, in_plane=in_plane, **options)
        assert prediction.collapse_multiplier == pytest.approx(associative.collapse_multiplier, abs=1e-7)
    with pytest.raises(ValueError, match="no exact crushing stress block"):
        analyse(block, loads=loads)


def test_block_in_a_slot_lifts_at_its_weight_where_normality_would_lock_it():
    solids = [box((-1, 0, -1), (0, 1, 1)), box((0, 0, 0), (1, 1, 0.5)), box((1, 0, -1), (2, 1, 1)),
              box((0, 0, -1), (1, 1, 0))]
    slot = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), fixed=[0, 2, 3])
    loads = lm.Loads.weight(slot).with_point_load(slot, 1, (0, 0, slot.weights[1]))
    assert lm.limit_analysis(slot, loads).status == "unbounded"
    prediction = analyse(slot, loads=loads)
    assert_certified(prediction, 1e-9)
    assert prediction.collapse_multiplier == pytest.approx(1.0, abs=1e-9)


def test_results_that_are_no_number_keep_their_status():
    prediction = analyse(leaning())
    assert prediction.status == "cannot stand under dead load"
    assert np.isnan(prediction.collapse_multiplier)
    column = stack([(0.5, 0.5)] * 2)
    pressed = lm.Loads.weight(column).with_point_load(column, "block-2", (0, 0, -1.0))
    assert analyse(column, loads=pressed).status == "unbounded"


def l_wall(courses):
    """Return wall of 0.4 m units, 0.2 m thick, courses interlocking at the corner."""
    boxes = []
    for k in range(courses):
        if k % 2 == 0:
            plan = [
                (0, 0.4, 0, 0.2),
                (0.4, 0.8, 0, 0.2),
                (0.8, 1.2, 0, 0.2),
                (1.0, 1.2, 0.2, 0.4),
                (1.0, 1.2, 0.4, 0.8),
            ]
        else:
            plan = [(0, 0.2, 0, 0.2), (0.2, 0.6, 0, 0.2), (0.6, 1.0, 0, 0.2), (1.0, 1.2, 0, 0.4), (1.0, 1.2, 0.4, 0.8)]
        boxes += [((a, c, 0.175 * k), (b, d, 0.175 * (k + 1))) for a, b, c, d in plan]
    return on_slab(boxes)


@pytest.mark.slow
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0)])
def test_l_wall_in_three_dimensions_is_certified(direction):
    prediction = analyse(l_wall(6), direction)
    assert_certified(prediction, 1e-8)
    assert not prediction.provenance["plane"]
    assert prediction.collapse_multiplier < prediction.details["radenkovic"][1] - 0.02


@pytest.mark.slow
def test_three_dimensions_admit_what_the_plane_admits():
    # the plane state, halved onto both faces, is one of the 3-D states; both searches are local
    wall = running_bond(3, 4)
    assert value(wall, in_plane=False) == pytest.approx(value(wall), abs=1e-6)


@pytest.mark.slow
def test_plane_value_does_not_depend_on_how_the_wall_is_written_down():
    test, wall = ferris(1)
    expected = value(wall, loads=test.loads())
    direction = test.loads().live[1:, :3].sum(axis=0)
    direction /= np.linalg.norm(direction)
    turn = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()
    moved = wall.transformed(2.0 * turn, (3.0, -2.0, 1.0))
    moved = moved.renumbered(np.random.default_rng(3).permutation(moved.n_blocks))
    assert value(moved, turn @ direction) == pytest.approx(expected, abs=1e-6)


@pytest.mark.slow
def test_equal_arguments_give_equal_results():
    wall = running_bond(3, 4, mu=0.9)
    effort = Effort((0.02,), (0.6,), 4, (), False)
    first, second = (analyse(wall, search=effort, seed=5) for _ in range(2))
    assert first.collapse_multiplier == second.collapse_multiplier
    assert [t.certified for t in first.details["trials"]] == [t.certified for t in second.details["trials"]]
    assert first.details["candidates"] == 5


def test_certificate_notices_a_mechanism_that_dilates():
    # the associative mechanism opens with tan(phi): at psi = 0 joint forces do power against its opening
    wall = running_bond(4, 5)
    loads = lm.Loads.horizontal(wall)
    associative = lm.limit_analysis(wall, loads)
    wrong = dataclasses.replace(associative, flow_rule=FlowRule.NON_ASSOCIATIVE)
    assert certify(wall, loads, wrong).complementarity > 1e-3
    assert certify(wall, loads, analyse(wall)).complementarity < 1e-9


def test_certificate_notices_a_mechanism_that_dilates_too_little():
    wall = running_bond(4, 5, mu=1.2)
    loads = lm.Loads.horizontal(wall)
    prediction = analyse(wall)
    assert np.abs(prediction.mechanism.sliding).max() > 1e-3
    dilatant = wall.with_joints(lm.Joint.from_friction_coefficient(1.2, dilatancy_angle_deg=20.0))
    assert certify(dilatant, loads, prediction).flow_residual > 1e-3


def test_certificate_agrees_with_the_laws_own_check():
    joint = lm.Joint(35.0, dilatancy_angle_deg=5.0, cohesion=1e3, tensile_strength=700.0)
    wall = running_bond(3, 3, joint=joint)
    loads = lm.Loads.horizontal(wall)
    problem = make_problem(wall, loads)
    law = joint_law(problem)
    prediction = analyse(wall)
    assert_certified(prediction, 1e-9)
    # disturb forces and velocities: both accounts of the complementarity must be the same number
    rng = np.random.default_rng(2)
    points = problem.points
    force = prediction.resultants.point_force + 300.0 * rng.normal(size=(points.count, 1)) * points.directions[:, 0]
    twists = prediction.mechanism.twists.copy()
    twists[1:, [0, 2]] += 0.1 * rng.normal(size=(wall.n_blocks - 1, 2))
    disturbed = dataclasses.replace(
        prediction,
        mechanism=dataclasses.replace(prediction.mechanism, twists=twists),
        resultants=dataclasses.replace(prediction.resultants, point_force=force),
    )
    scaled = np.einsum("mi,mci->mc", force, points.directions) / problem.force_scale
    scaled[:, 0] += law.tension
    velocity = problem.dual(twists)
    velocity *= law.live_size / (law.live @ velocity)
    own = violation(law, ForceState(prediction.collapse_multiplier / problem.live_scale, scaled.ravel(), velocity))
    independent = certify(wall, loads, disturbed)
    assert own.complementarity > 1e-3
    assert independent.complementarity == pytest.approx(own.complementarity, rel=1e-9)
    assert independent.yield_violation == pytest.approx(own.yielding, abs=1e-12)


def test_radenkovic_lower_bound_shares_the_tension_corner():
    # with the full cohesion the reduced law would leave the true one in tension and the bound would not be one
    joint = lm.Joint(40.0, cohesion=2e3, tensile_strength=5e3)
    wall = running_bond(3, 3, joint=joint)
    loads = lm.Loads.horizontal(wall)
    problem = make_problem(wall, loads)
    bracket = lm.limit_bracket(wall, loads)
    own = radenkovic_lower(joint_law(problem)) * problem.live_scale
    assert bracket.lower.collapse_multiplier == pytest.approx(own, abs=1e-7)
    assert own <= value(wall) + 1e-8


def test_wrong_options_are_named():
    wall = running_bond(2, 2)
    with pytest.raises(ValueError, match="search must be one of"):
        analyse(wall, search="exhaustive")
    with pytest.raises(ValueError, match="torsion_limit"):
        analyse(wall, torsion_limit=True)


def test_a_solver_is_named_where_it_was_used_alone():
    """With psi = phi there is no search: HiGHS was named, and its paper cited, all the same."""
    for joint, named in ((lm.Joint(33.0, dilatancy_angle_deg=33.0), "clarabel"), (lm.Joint(33.0), "clarabel, HiGHS")):
        wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=joint)
        found = lm.limit_analysis(wall, lm.Loads.horizontal(wall, (1, 0, 0)), "non-associative", search="quick")
        assert found.provenance["solver"] == named
        assert ("HiGHS" in str(found.cite())) == ("HiGHS" in named)
