"""Every canonical assembly: equilibrium, admissibility, flow rule, complementarity and gap, computed independently."""

import dataclasses

import numpy as np
import pytest
from walls import arch_blocks, corner, on_slab, running_bond, stack

import limitmason as lm
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.dissipation import point_state
from limitmason.mechanics.equilibrium import equilibrium_matrix

CASES = {
    "block": lambda: (stack([(0.4, 1.0)]), (1, 0, 0)),
    "stack": lambda: (stack([(0.5, 0.3)] * 5), (1, 0, 0)),
    "wall in plane": lambda: (running_bond(5, 8), (1, 0, 0)),
    "wall in plane without head joints": lambda: (running_bond(5, 8, heads=False), (1, 0, 0)),
    "wall out of plane": lambda: (running_bond(4, 6), (0, 1, 0)),
    "wall askew": lambda: (running_bond(3, 5), (1, 1, 0)),
    "arch": lambda: (arch_blocks(1.0, 0.2, 15, mu=0.8), (1, 0, 0)),
    "corner": lambda: (corner(), (0, -1, 0)),
    "corner along": lambda: (corner(), (1, 0, 0)),
}


@pytest.mark.parametrize("name", CASES)
def test_associative_prediction_is_certified(name):
    assembly, direction = CASES[name]()
    loads = lm.Loads.horizontal(assembly, direction)
    prediction = lm.limit_analysis(assembly, loads)
    c = prediction.certificate
    assert prediction.status == "solved"
    assert c.equilibrium_residual < 1e-7
    assert c.yield_violation < 1e-7
    assert c.flow_residual < 1e-7
    assert c.complementarity < 1e-7
    assert abs(c.gap) < 1e-6
    assert c.kinematic_multiplier >= c.static_multiplier - 1e-9


def test_certificate_notices_what_is_wrong():
    assembly = running_bond(4, 5)
    loads = lm.Loads.horizontal(assembly)
    good = lm.limit_analysis(assembly, loads)
    # a multiplier 1 % high is out of equilibrium; its size is what the last per cent of live load leaves unbalanced
    high = dataclasses.replace(good, collapse_multiplier=1.01 * good.collapse_multiplier)
    assert certify(assembly, loads, high).equilibrium_residual > 1e-4
    # joints 2 % rougher than the assembly's
    rough = assembly.with_joints(lm.Joint.from_friction_coefficient(0.65 * 1.02))
    other = lm.limit_analysis(rough, loads)
    assert certify(assembly, loads, other).yield_violation > 1e-4
    # a mechanism with one block's velocity disturbed penetrates or slides without dilating
    twists = good.mechanism.twists.copy()
    twists[3, 0] += 0.1
    bent = dataclasses.replace(good, mechanism=dataclasses.replace(good.mechanism, twists=twists))
    assert certify(assembly, loads, bent).flow_residual > 1e-3
    # the kinematic value of a wrong but admissible mechanism lies above: every block flying outwards
    field = np.zeros_like(twists)
    field[:, :3] = (assembly.centroids - (0.8, 0.1, 0.0)) * (1, 1, 4)
    field[:, 0] += 1.0 * assembly.centroids[:, 2]
    field[0] = 0
    open_up = dataclasses.replace(good, mechanism=dataclasses.replace(good.mechanism, twists=field))
    assert certify(assembly, loads, open_up).kinematic_multiplier > good.collapse_multiplier + 0.05


def test_certificate_does_not_need_the_matrix_it_checks():
    # block sums of point forces equal A f to rounding: the certificate's statics and equilibrium.py are one
    assembly = corner()
    points = contact_points(assembly, contact_model="grid", grid=(3, 4))
    rng = np.random.default_rng(7)
    f = rng.normal(size=(points.count, 3))
    force = np.einsum("mc,mci->mi", f, points.directions)
    wrench = np.zeros((assembly.n_blocks, 6))
    for block, sign in ((points.block_b, 1.0), (points.block_a, -1.0)):
        np.add.at(wrench[:, :3], block, sign * force)
        np.add.at(wrench[:, 3:], block, sign * np.cross(points.position - assembly.centroids[block], force))
    matrix = equilibrium_matrix(assembly, points)
    assert np.allclose(matrix @ f.ravel(), wrench.ravel(), atol=1e-12)


def test_rates_are_the_transpose_of_equilibrium():
    assembly = corner()
    points = contact_points(assembly)
    rng = np.random.default_rng(3)
    twists = rng.normal(size=(assembly.n_blocks, 6))
    rates = (equilibrium_matrix(assembly, points).T @ twists.ravel()).reshape(-1, 3)
    from limitmason.mechanics.resultants import resultants_from_points

    force = np.zeros((points.count, 3))
    r = resultants_from_points(assembly, points.position, points.interface, points.area, force)
    state = point_state(assembly, r, twists)
    assert np.allclose(rates[:, 0], state.opening, atol=1e-12)
    assert np.allclose(np.linalg.norm(rates[:, 1:], axis=1), np.linalg.norm(state.sliding, axis=1), atol=1e-12)


def test_resultants_balance_every_block():
    assembly = running_bond(4, 5)
    loads = lm.Loads.horizontal(assembly)
    p = lm.limit_analysis(assembly, loads)
    x = assembly.arrays
    force = p.resultants.normal[:, None] * x.normal
    force += p.resultants.shear[:, :1] * x.tangent_1 + p.resultants.shear[:, 1:] * x.tangent_2
    rest = loads.dead[:, :3] + p.collapse_multiplier * loads.live[:, :3]
    np.add.at(rest, x.block_b, force)
    np.add.at(rest, x.block_a, -force)
    assert np.abs(rest[1:]).max() < 1e-7 * assembly.weights[1:].sum()
    assert (p.resultants.normal > -1e-6).all()


@pytest.mark.parametrize("in_plane", [None, False])
def test_cvxpy_reference_solves_the_same_program(in_plane):
    from limitmason.limit import make_problem
    from limitmason.limit.program.reference import solve_reference

    joint = lm.Joint(35.0, cohesion=500.0, tensile_strength=300.0)
    assembly = running_bond(3, 4, joint=joint)
    loads = lm.Loads.horizontal(assembly)
    problem = make_problem(assembly, loads, in_plane=in_plane)
    reference = solve_reference(problem)
    value = lm.limit_analysis(assembly, loads, in_plane=in_plane).collapse_multiplier
    assert reference.multiplier * problem.live_scale == pytest.approx(value, rel=1e-6)
    if in_plane is None:
        other = solve_reference(problem, solver="HIGHS")
        assert other.multiplier * problem.live_scale == pytest.approx(value, rel=1e-6)
        by_name = lm.limit_analysis(assembly, loads, solver="cvxpy:HIGHS")
        assert by_name.provenance["solver"] == "cvxpy:HIGHS"
        assert by_name.collapse_multiplier == pytest.approx(value, rel=1e-6)
        assert by_name.status == "solved"


def test_wedged_blocks_are_reported_as_resting_on_confining_forces():
    from limitmason.geometry import box

    # a block jammed between two fixed walls over a void: friction holds any load without limit
    solids = [box((-1, 0, -1), (0, 1, 1)), box((0, 0, 0), (1, 1, 0.5)), box((1, 0, -1), (2, 1, 1))]
    assembly = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), fixed=[0, 2])
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, (0, 1, 0)))
    assert prediction.status == "unbounded"
    assert not np.isfinite(prediction.collapse_multiplier)


def test_gap_is_not_blind_to_a_couple_or_a_long_lever():
    # the live load is a couple without any force: a wrong mechanism must still open the gap
    assembly = on_slab([((0, 0, 0), (1, 1, 0.2))])
    live = np.zeros((2, 6))
    live[1, 5] = 1.0
    loads = lm.Loads(lm.Loads.weight(assembly).dead, live)
    good = lm.limit_analysis(assembly, loads)
    assert abs(good.certificate.gap) < 1e-6
    loose = lm.limit_analysis(assembly, loads, tolerance=1e-2, solver="clarabel")
    c = loose.certificate
    assert c.gap == pytest.approx(c.kinematic_multiplier / c.static_multiplier - 1, rel=1e-6)
    low = dataclasses.replace(good, collapse_multiplier=0.9 * good.collapse_multiplier)
    assert certify(assembly, loads, low).gap > 0.05


def test_a_mechanism_that_does_not_move_is_no_mechanism():
    wall = running_bond(3, 3)
    loads = lm.Loads.horizontal(wall)
    good = lm.limit_analysis(wall, loads, flow_rule="non-associative", search="quick")
    still = dataclasses.replace(good, mechanism=dataclasses.replace(good.mechanism, twists=0 * good.mechanism.twists))
    assert np.isnan(certify(wall, loads, still).complementarity)


def test_torsion_limit_settles_and_claims_no_gap():
    prediction = lm.limit_analysis(corner(), lm.Loads.horizontal(corner(), (0, -1, 0)), torsion_limit=True)
    assert prediction.status == "solved"
    assert prediction.details["torsion_spread"] <= 2e-3
    assert np.isnan(prediction.certificate.gap)
    assert not any("torsion_limit=True" in w for w in prediction.warnings)
