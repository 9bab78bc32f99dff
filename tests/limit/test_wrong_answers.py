"""The certificate tried on wrong answers: every one must be refused, every right one accepted; refusals are counted."""

import dataclasses

import numpy as np
import pytest
from giants import beside_giant, on_giant
from walls import running_bond

import limitmason as lm
from limitmason.geometry import box
from limitmason.limit.associative_prediction import prediction_from
from limitmason.limit.program.clarabel_solver import solve_static
from limitmason.limit.program.cones import make_cones
from limitmason.limit.program.face_cells import whole_faces
from limitmason.limit.program.static_theorem import make_problem
from limitmason.mechanics.certificate import certify


def with_forces(prediction, assembly, change):
    r = prediction.resultants
    return dataclasses.replace(
        prediction, resultants=dataclasses.replace(r, point_force=r.point_force + change(assembly, r))
    )


def with_twists(prediction, twists):
    return dataclasses.replace(prediction, mechanism=dataclasses.replace(prediction.mechanism, twists=twists))


def pushed(block, size):
    """A change of the forces on one block by a part of its own weight."""

    def change(assembly, r):
        x = assembly.arrays
        near = (x.block_a[r.point_interface] == block) | (x.block_b[r.point_interface] == block)
        out = np.zeros_like(r.point_force)
        out[np.flatnonzero(near)[0], 2] = size * assembly.weights[block]
        return out

    return change


def wrong_answers(assembly, loads, good, small):
    """Name and prediction of answers that are wrong by a little in one respect."""
    for factor in (1.0001, 1.01, 0.99):
        changed = dataclasses.replace(good, collapse_multiplier=factor * good.collapse_multiplier)
        yield f"multiplier times {factor}", changed
    for size in (1e-4, 1e-2):
        yield f"a force wrong by {size} of the block", with_forces(good, assembly, pushed(small, size))
    rate = np.abs(good.mechanism.twists).max()
    for block in (small, *np.flatnonzero(~assembly.fixed)[[0, -1]]):
        for component in (0, 4):
            twists = good.mechanism.twists.copy()
            twists[block, component] += 0.01 * rate
            yield f"block {block} moves otherwise in {component}", with_twists(good, twists)
    yield "nothing moves", with_twists(good, np.zeros_like(good.mechanism.twists))
    yield "everything moves backwards", with_twists(good, -good.mechanism.twists)
    rough = assembly.with_joints(lm.Joint.from_friction_coefficient(0.7 * 1.001))
    yield "joints too rough", lm.limit_analysis(rough, loads)


SIZES = (1, 10, 100, 1000)
STRUCTURES = {
    "wall": (lambda: running_bond(3, 4, mu=0.7), (1, 0, 0)),
    **{f"beside 1 : {r}": (lambda r=r: beside_giant(r), (1, 0, 0)) for r in SIZES},
    **{f"beside, askew, 1 : {r}": (lambda r=r: beside_giant(r), (0.8, 0.6, 0)) for r in SIZES},
    **{f"on top 1 : {r}": (lambda r=r: on_giant(r), (1, 0, 0)) for r in SIZES},
    **{f"on top, askew, 1 : {r}": (lambda r=r: on_giant(r), (0.8, 0.6, 0)) for r in SIZES},
}


@pytest.mark.parametrize("name", STRUCTURES)
def test_every_wrong_answer_is_refused_and_the_right_one_is_not(name):
    make, direction = STRUCTURES[name]
    assembly = make()
    loads = lm.Loads.horizontal(assembly, direction)
    good = lm.limit_analysis(assembly, loads)
    assert good.status == "solved"
    assert certify(assembly, loads, good).refusal == ""
    wrong = dict(wrong_answers(assembly, loads, good, small=2))
    if name != "wall":
        wrong.pop("joints too rough")  # a stack that rocks does not slide: that answer is right
    accepted = [what for what, answer in wrong.items() if certify(assembly, loads, answer).accepted]
    assert accepted == []
    assert len(wrong) >= 13


@pytest.mark.parametrize("make", [beside_giant, on_giant])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0.8, 0.6, 0)])
def test_the_answer_in_units_of_the_total_load_is_refused(make, direction):
    # what Clarabel calls solved when all residuals are relative to the load of the giant: the stack is not in it
    assembly = make(1000)
    loads = lm.Loads.horizontal(assembly, direction)
    problem = make_problem(assembly, loads, in_plane=False)
    solution = solve_static(problem, make_cones(problem), tolerance=1e-8)
    old, _ = prediction_from(problem, solution, False, {}, 1e-8, True, None)
    exact = 1.0 / 3.0 / max(direction)
    assert old.collapse_multiplier > 1.2 * exact
    assert old.certificate.equilibrium_residual < 1e-7  # relative to the total load there is nothing to see
    assert not old.certificate.accepted
    assert old.status != "solved"
    assert old.certificate.worst_block in {b.name for b in assembly.blocks[1:4]}
    assert any(old.certificate.worst_block in w or "differ" in w for w in old.warnings)


def test_cohesion_lumped_at_corners_is_refused():
    joint = lm.Joint(0.0, cohesion=1e4)
    assembly = lm.Assembly.from_polyhedra(
        [box((0, 0, -1), (1, 1, 0)), box((0, 0, 0), (1, 1, 1))], joint=joint, fixed=[0]
    )
    live = np.zeros((2, 6))
    live[1, 5] = 1e4
    loads = lm.Loads(np.zeros((2, 6)), live)
    assert len(whole_faces(assembly)) == 1
    problem = make_problem(assembly, loads, cells={})
    solution = solve_static(problem, make_cones(problem))
    old, _ = prediction_from(problem, solution, False, {}, 1e-10, True, None)
    assert old.collapse_multiplier == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert "cohesion gathers" in old.certificate.refusal
    assert old.status != "solved"
    assert lm.limit_analysis(assembly, loads).certificate.accepted


def test_wrong_non_associative_answers_are_refused():
    wall = running_bond(3, 3)
    loads = lm.Loads.horizontal(wall)
    good = lm.limit_analysis(wall, loads, flow_rule="non-associative", search="quick")
    assert certify(wall, loads, good).accepted
    # a block that slides a little further keeps the flow rule of psi = 0: such a mechanism is no wrong one
    wrong = {k: v for k, v in wrong_answers(wall, loads, good, small=2) if "otherwise in 0" not in k}
    wrong.pop("joints too rough")
    accepted = [what for what, answer in wrong.items() if certify(wall, loads, answer).accepted]
    assert accepted == []


def test_refusal_names_the_block_and_the_joint():
    assembly = beside_giant(100)
    loads = lm.Loads.horizontal(assembly)
    good = lm.limit_analysis(assembly, loads)
    bad = certify(assembly, loads, with_forces(good, assembly, pushed(3, 1e-3)))
    assert bad.worst_block in ("block-2", "block-3")
    assert bad.block_residual == pytest.approx(1e-3 / (1.0 + 1.0 / 3.0), rel=1e-6)  # of dead and live load
    assert bad.equilibrium_residual < 1e-8
    assert "out of equilibrium" in bad.refusal
    r = good.resultants
    k = int(np.flatnonzero(assembly.arrays.block_b[r.point_interface] == 3)[0])
    force = r.point_force.copy()
    force[k] += 0.01 * assembly.weights[3] * assembly.arrays.tangent_1[r.point_interface[k]] + (0, 0, 0)
    force[k, 2] = 0.0
    torn = dataclasses.replace(good, resultants=dataclasses.replace(r, point_force=force))
    assert "block-3" in certify(assembly, loads, torn).worst_joint
