"""COMPAS block models and problems, with the released compas_dem: closed forms through its own interface."""

import compas
import numpy as np
import pytest
from compas.geometry import Box, Frame, Rotation, Transformation
from compas_dem.material.generic import GenericMaterial
from compas_dem.models import BlockModel
from compas_dem.problem import Problem

import limitmason as lm
from limitmason import formats
from limitmason.errors import InputError, NotApplicable

WIDTH, DEPTH, HEIGHT, DENSITY = 0.4, 0.5, 1.0, 2100.0
WEIGHT = WIDTH * DEPTH * HEIGHT * DENSITY * 9.81


def stack(turn=0.0, support=True):
    """A block on a base, both turned about z, as a COMPAS model."""
    turned = Frame.from_transformation(Rotation.from_axis_and_angle([0, 0, 1], turn))
    boxes = [Box(2.0, 2.0, 0.5), Box(WIDTH, DEPTH, HEIGHT)]
    for box, z in zip(boxes, (-0.25, 0.5 * HEIGHT), strict=True):
        box.frame = Frame([0, 0, z], turned.xaxis, turned.yaxis)
    model = BlockModel.from_boxes(boxes)
    stone = GenericMaterial(density=DENSITY)
    model.add_material(stone)
    for element in model.elements():
        model.assign_material(stone, element=element)
    if support:
        model.add_support(0)
    return model


def problem_of(model, phi=40.0, **law):
    problem = Problem(model)
    problem.set_contact_model("MohrCoulomb", phi=phi, **law)
    return problem, problem.add_boundary_condition("Live")


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("phi, expected", [(40.0, WIDTH / HEIGHT), (15.0, np.tan(np.radians(15.0)))])
def test_a_block_overturns_or_slides_at_its_closed_form_with_a_certificate(turn, phi, expected):
    problem, live = problem_of(stack(turn), phi)
    problem.add_global_body_force(9.81 * np.cos(turn), 9.81 * np.sin(turn), 0.0, boundary_condition=live)
    results = formats.solve_problem(problem, "associative")
    assert results.metadata["multiplier"] == pytest.approx(expected, rel=1e-7)
    assert results.metadata["accepted"]
    assert abs(results.metadata["certificate"]["gap"]) < 1e-6
    assert results.model_id == str(problem.model.guid)
    # the force on the block balances its weight and the live load
    ((a, b),) = results.edges()
    assert (a, b) in ((0, 1), (1, 0))
    sign = 1.0 if b == 1 else -1.0
    force = sign * np.array(results.edge_attribute((a, b), "resultant_global"))
    push = -expected * WEIGHT * np.array([np.cos(turn), np.sin(turn)])
    assert force == pytest.approx([*push, WEIGHT], rel=1e-6, abs=1e-6 * WEIGHT)
    # and its own frame turns the local resultant into the global one
    frame = results.edge_attribute((a, b), "contact_frame")
    local = results.edge_attribute((a, b), "resultant_local")
    axes = np.array([frame.xaxis, frame.yaxis, frame.zaxis])
    assert local @ axes == pytest.approx(sign * force, rel=1e-9, abs=1e-9 * WEIGHT)
    assert local[2] == pytest.approx(WEIGHT, rel=1e-6)  # compression positive


def test_mechanism_is_a_motion_of_the_blocks():
    problem, live = problem_of(stack())
    problem.add_global_body_force(9.81, 0.0, 0.0, boundary_condition=live)
    results = formats.solve_problem(problem, "associative")
    moved = results.transformation(1)
    toe, heel = np.array([WIDTH / 2, 0.0, 0.0]), np.array([-WIDTH / 2, 0.0, HEIGHT])
    assert isinstance(moved, Transformation)
    assert np.linalg.norm(np.array([*np.array(moved.matrix) @ [*toe, 1.0]])[:3] - toe) < 1e-3 * HEIGHT
    assert (np.array(moved.matrix) @ [*heel, 1.0])[0] > heel[0] + 5e-3 * HEIGHT
    assert np.array(results.transformation(0).matrix) == pytest.approx(np.eye(4))


def test_loads_act_where_they_are_applied_and_groups_are_live_or_dead():
    # a point load P at the top corner: overturning about the toe, lambda P h = W b / 2
    model = stack()
    problem, live = problem_of(model, phi=60.0)
    problem.add_point_load_at_point(1, [-WIDTH / 2, 0.0, HEIGHT], [WEIGHT, 0.0, 0.0], boundary_condition=live)
    expected = 0.5 * WIDTH / HEIGHT
    assert formats.solve_problem(problem, "associative").metadata["multiplier"] == pytest.approx(expected, rel=1e-7)
    # with a dead weight W on the top face: twice the resistance
    ballast = problem.add_boundary_condition("Ballast")
    mesh = list(model.elements())[1].modelgeometry
    top = next(f for f in mesh.faces() if mesh.face_centroid(f)[2] > 0.99 * HEIGHT)
    ballast.add_surface_load(1, top, [0.0, 0.0, -WEIGHT / (WIDTH * DEPTH)])
    found = formats.solve_problem(problem, "associative", live="Live")
    assert found.metadata["multiplier"] == pytest.approx(2.0 * expected, rel=1e-7)
    # a moment does the same as the force that makes it, and half the gravity half of it
    lighter, turning = problem_of(stack(), phi=60.0)
    lighter.add_moment(1, [0.0, WEIGHT * HEIGHT, 0.0], boundary_condition=turning)
    turning.add_gravity(9.81 / 2)
    found = formats.solve_problem(lighter, "associative")
    assert found.metadata["multiplier"] == pytest.approx(0.5 * expected, rel=1e-7)


def test_cohesion_and_tension_of_the_contact_model_are_taken():
    problem, live = problem_of(stack(), phi=60.0, c=5e4, t_c=2e4)
    problem.add_point_load_at_point(1, [0.0, 0.0, HEIGHT], [WEIGHT, 0.0, 0.0], boundary_condition=live)
    # plastic tension over the whole face: lambda P h = (W + ft A) b / 2
    expected = 0.5 * WIDTH * (WEIGHT + 2e4 * WIDTH * DEPTH) / (WEIGHT * HEIGHT)
    found = formats.solve_problem(problem, "associative")
    assert found.metadata["multiplier"] == pytest.approx(expected, rel=6e-3)


@pytest.mark.slow
def test_other_methods_answer_behind_the_same_call():
    joint = lm.Joint(40.0, normal_stiffness=1e11, shear_stiffness=1e11)
    problem, live = problem_of(stack())
    problem.add_global_body_force(9.81, 0.0, 0.0, boundary_condition=live)
    simulated = formats.solve_problem(problem, "dem", joint=joint, error_budget=(), contact_points=(4, 2))
    assert simulated.metadata["multiplier"] == pytest.approx(0.4, rel=0.02)
    assert formats.solve_problem(problem, "mechanisms").metadata["multiplier"] == pytest.approx(0.4, rel=1e-6)
    problem.set_joint_model(1e9, 1e9)
    assert "per area" in formats.solve_problem(problem, "associative").metadata["warnings"][-1]


def test_a_wall_goes_there_and_back_and_results_through_json():
    wall = lm.build.wall(length=1.6, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(35.0), density=1900.0)
    direct = lm.limit_analysis(wall, lm.Loads.horizontal(wall)).collapse_multiplier
    model = formats.to_block_model(wall)
    assert [e.name for e in model.elements()] == [b.name for b in wall.blocks]
    back = formats.from_block_model(model, lm.Joint(35.0))
    assert back.weights == pytest.approx(wall.weights, rel=1e-12)
    assert len(back.interfaces) == len(wall.interfaces)
    model.compute_contacts(minimum_area=1e-4)
    assert len(list(model.contacts())) == len(wall.interfaces)  # their detection and ours agree
    problem, live = problem_of(model, 35.0)
    problem.add_global_body_force(9.81, 0.0, 0.0, boundary_condition=live)
    results = compas.json_loads(compas.json_dumps(formats.solve_problem(problem, "associative", in_plane=False)))
    assert results.metadata["multiplier"] == pytest.approx(direct, rel=1e-6)
    assert all(len(results.edge_attribute(e, "contact_data").forces) == 4 for e in results.edges())


def test_what_cannot_be_taken_over_is_refused_by_name():
    joint = lm.Joint(35.0)
    with pytest.raises(InputError, match="no blocks"):
        formats.from_block_model(BlockModel(), joint)
    with pytest.raises(InputError, match="block 0 has no material"):
        formats.from_block_model(BlockModel.from_boxes([Box(1, 1, 1)]), joint)
    bare = Problem(stack())
    with pytest.raises(InputError, match="no contact model"):
        formats.solve_problem(bare)
    problem, live = problem_of(stack())
    with pytest.raises(InputError, match="the problem has Live"):
        formats.solve_problem(problem, live="Dead")
    live.add_point_load(7, [1.0, 0.0, 0.0])
    with pytest.raises(InputError, match="block 7"):
        formats.solve_problem(problem)
    problem, live = problem_of(stack())
    live.add_displacement(0, 0.01, 0.0, 0.0)
    with pytest.raises(NotApplicable, match="prescribes displacements"):
        formats.solve_problem(problem)
    problem.add_boundary_condition("Other").add_gravity(1.62)
    with pytest.raises(InputError, match="different gravities"):
        formats.solve_problem(problem)
    concave = lm.build.wall(length=1.6, courses=4, unit=(0.4, 0.2, 0.2), joint=joint)
    pieces = lm.Assembly.from_polyhedra(
        [concave.blocks[0].parts[0], [concave.blocks[1].parts[0], concave.blocks[2].parts[0]]], joint=joint, fixed=[0]
    )
    with pytest.raises(NotApplicable, match="2 convex pieces"):
        formats.to_block_model(pieces)
