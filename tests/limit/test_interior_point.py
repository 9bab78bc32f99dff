"""The own interior-point solver against Clarabel, dense linear algebra, and what a proof of each status means."""

import sys

import numpy as np
import pytest
from scipy import sparse
from walls import on_slab, running_bond, stack

import limitmason as lm
from limitmason.answers.results import Status
from limitmason.geometry import box
from limitmason.limit.interior_point.coverage import unsupported
from limitmason.limit.program.clarabel_solver import solve_static, stands_under_dead_load
from limitmason.limit.program.cones import make_cones
from limitmason.limit.program.static_theorem import make_problem
from limitmason.limit.solvers import choose_solver

FRICTION = lm.Joint.from_friction_coefficient(0.65)
GLUED = lm.Joint(35.0, cohesion=800.0, tensile_strength=500.0)
SOFT = lm.Joint(35.0, cohesion=500.0, compressive_strength=8e4)

WALLS = {
    "plane": (FRICTION, {}, (1, 0, 0)),
    "space, in plane": (FRICTION, {"in_plane": False}, (1, 0, 0)),
    "space, out of plane": (FRICTION, {}, (0, 1, 0)),
    "askew": (FRICTION, {}, (2, 1, 0)),
    "cohesion": (lm.Joint(35.0, cohesion=800.0), {}, (1, 0, 0)),
    "cut-off": (GLUED, {}, (1, 0, 0)),
    "cut-off in space": (GLUED, {}, (1, 1, 0)),
    "crushing": (SOFT, {"contact_model": "grid", "grid": (4, 3)}, (1, 0, 0)),
    "crushing in space": (SOFT, {"contact_model": "grid", "grid": (4, 3)}, (0, 1, 0)),
}


def own(problem, **options):
    from limitmason.limit.interior_point.solver import solve_interior_point

    return solve_interior_point(problem, **options)


@pytest.mark.parametrize("name", WALLS)
def test_own_solver_equals_clarabel(name):
    joint, options, direction = WALLS[name]
    wall = running_bond(4, 6, joint=joint)
    problem = make_problem(wall, lm.Loads.horizontal(wall, direction), **options)
    assert unsupported(problem) is None
    reference = solve_static(problem, make_cones(problem))
    solution = own(problem)
    assert solution.status == reference.status == Status.SOLVED
    assert solution.multiplier == pytest.approx(reference.multiplier, rel=1e-6)


@pytest.mark.parametrize("name", WALLS)
def test_certificate_needs_no_repair(name):
    joint, options, direction = WALLS[name]
    wall = running_bond(4, 6, joint=joint)
    prediction = lm.limit_analysis(wall, lm.Loads.horizontal(wall, direction), solver="interior-point", **options)
    c = prediction.certificate
    assert prediction.provenance["solver"] == "interior-point"
    assert abs(c.gap) < 1e-8
    assert c.equilibrium_residual < 1e-10
    assert c.yield_violation < 1e-10
    assert c.flow_residual < 1e-12


@pytest.mark.slow
def test_stepwise_multipliers_of_the_design_walls():
    # published with the design: 820 blocks by HiGHS and Clarabel, with and without friction in the head joints
    wall = lm.build.wall(length=8.0, courses=40, unit=(0.4, 0.2, 0.2), joint=FRICTION)
    for heads, expected in ((True, 0.42286), (False, 0.41896)):
        assembly = wall if heads else wall.with_interfaces(i for i in wall.interfaces if i.kind != "head")
        prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), solver="interior-point")
        assert prediction.collapse_multiplier == pytest.approx(expected, abs=1e-5)
        assert prediction.certificate.gap < 1e-7


@pytest.mark.slow
def test_stepwise_multipliers_of_3041_blocks():
    wall = lm.build.wall(length=15.6, courses=77, unit=(0.4, 0.2, 0.2), joint=FRICTION)
    for heads, expected in ((True, 0.40666), (False, 0.40579)):
        assembly = wall if heads else wall.with_interfaces(i for i in wall.interfaces if i.kind != "head")
        prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly))
        assert prediction.provenance["solver"] == "interior-point"
        assert prediction.collapse_multiplier == pytest.approx(expected, abs=1e-5)
        assert prediction.certificate.flow_residual < 1e-12
        assert prediction.certificate.gap < 1e-7


@pytest.mark.parametrize("courses", [5, 40])
def test_out_of_plane_toppling_is_thickness_over_height(courses):
    # a running bond of rigid courses turns about its toe: lambda = t / h
    wall = lm.build.wall(length=2.0, courses=courses, unit=(0.4, 0.2, 0.2), joint=FRICTION)
    prediction = lm.limit_analysis(wall, lm.Loads.horizontal(wall, (0, 1, 0)), solver="interior-point")
    assert prediction.collapse_multiplier == pytest.approx(0.2 / (0.2 * courses), rel=1e-8)


# ---- statuses --------------------------------------------------------------------------------------------------------


def leaning(offset):
    """Two blocks, the upper one shifted by ``offset``."""
    return on_slab([((0, 0, 0), (1, 1, 1)), ((offset, 0, 1), (1 + offset, 1, 2))])


@pytest.mark.parametrize("direction", [(1, 0, 0), (-1, 0, 0)])
@pytest.mark.parametrize("in_plane", [None, False])
def test_an_overhanging_block_cannot_stand_whichever_way_it_is_pushed(direction, in_plane):
    assembly = leaning(0.6)
    problem = make_problem(assembly, lm.Loads.horizontal(assembly, direction), in_plane=in_plane)
    solution = own(problem, check_dead_load=True)
    assert solution.stands is False or solution.status == Status.CANNOT_STAND
    prediction = lm.limit_analysis(
        assembly, lm.Loads.horizontal(assembly, direction), solver="interior-point", in_plane=in_plane
    )
    assert prediction.status == Status.CANNOT_STAND


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.45, 0.55, 0.9])
def test_dead_load_check_agrees_with_clarabel(offset):
    assembly = leaning(offset)
    problem = make_problem(assembly, lm.Loads.horizontal(assembly))
    assert own(problem, check_dead_load=True).stands == stands_under_dead_load(problem, make_cones(problem))[0]


def test_a_load_without_any_carrier_cannot_stand():
    # nothing pulls the block up: no multiplier of the sideways load carries a dead load that lifts it
    assembly = stack([(1.0, 1.0)])
    up = lm.Loads(-2.0 * lm.Loads.weight(assembly).dead, lm.Loads.horizontal(assembly).live)
    assert own(make_problem(assembly, up)).status == Status.CANNOT_STAND


@pytest.mark.parametrize("in_plane", [None, False])
def test_pressing_down_is_unbounded(in_plane):
    assembly = stack([(1.0, 1.0), (0.8, 0.5)])
    loads = lm.Loads(lm.Loads.weight(assembly).dead, lm.Loads.weight(assembly).dead)
    assert own(make_problem(assembly, loads, in_plane=in_plane)).status == Status.UNBOUNDED


def test_a_wedge_between_fixed_walls_is_unbounded():
    solids = [box((-1, 0, -1), (0, 1, 1)), box((0, 0, 0), (1, 1, 0.5)), box((1, 0, -1), (2, 1, 1))]
    assembly = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), fixed=[0, 2])
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, (0, 1, 0)), solver="interior-point")
    assert prediction.status == Status.UNBOUNDED


# ---- what it covers --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "dofs", [("x",), ("y", "rx", "rz"), ("x", "y", "z"), ("x", "y", "rx", "ry", "rz"), ("rx", "ry", "rz")]
)
def test_partly_held_blocks_have_fewer_unknowns(dofs):
    wall = running_bond(3, 5)
    held = wall.with_supports([lm.Support(wall.n_blocks - 2, dofs=list(dofs))])
    problem = make_problem(held, lm.Loads.horizontal(held), in_plane=False)
    assert len(problem.row) == 6 * (wall.n_blocks - 1) - len(dofs)
    reference = solve_static(problem, make_cones(problem))
    assert own(problem).multiplier == pytest.approx(reference.multiplier, rel=1e-6)


def test_what_it_does_not_cover_is_refused_and_left_to_clarabel():
    smooth = stack([(1.0, 1.0)], joint=lm.Joint(0.0, cohesion=1e3))
    crushing = stack([(1.0, 1.0)], joint=lm.Joint(30.0, compressive_strength=1e6))
    for assembly, reason in ((smooth, "friction"), (crushing, "stress blocks")):
        loads = lm.Loads.horizontal(assembly)
        with pytest.raises(ValueError, match=reason):
            lm.limit_analysis(assembly, loads, solver="interior-point")
        assert lm.limit_analysis(assembly, loads).provenance["solver"] == "clarabel"
    wall = running_bond(2, 2)
    with pytest.raises(ValueError, match="torsion"):
        lm.limit_analysis(wall, lm.Loads.horizontal(wall), torsion_limit=True, solver="interior-point")
    with pytest.raises(ValueError, match="solver must be one of"):
        lm.limit_analysis(wall, lm.Loads.horizontal(wall), solver="simplex")


def test_auto_takes_the_own_solver_for_large_problems_only():
    small, large = running_bond(3, 4), lm.build.wall(length=8.0, courses=40, unit=(0.4, 0.2, 0.2), joint=FRICTION)
    assert choose_solver(make_problem(small, lm.Loads.horizontal(small))) == "clarabel"
    for direction in ((1, 0, 0), (0, 1, 0)):
        assert choose_solver(make_problem(large, lm.Loads.horizontal(large, direction))) == "interior-point"


def test_auto_falls_back_on_clarabel_and_says_so(monkeypatch):
    from limitmason.limit import solvers
    from limitmason.limit.interior_point import solver

    wall = running_bond(4, 5)
    loads = lm.Loads.horizontal(wall)
    expected = lm.limit_analysis(wall, loads, solver="clarabel").collapse_multiplier
    original = solver.solve_interior_point
    monkeypatch.setattr(solvers, "LARGE_IN_PLANE", 0)
    monkeypatch.setattr(solver, "solve_interior_point", lambda *a, **k: original(*a, **k, max_iterations=3))
    prediction = lm.limit_analysis(wall, loads)
    assert prediction.provenance["solver"] == "clarabel"
    assert prediction.provenance["solver_fallback"] == "interior-point: not converged"
    assert prediction.collapse_multiplier == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("off, taken", [(0.0, "interior-point"), (1e-3, "clarabel")])
def test_what_the_own_solver_almost_solves_is_handed_on_only_where_its_certificate_says_so(
    off, taken, monkeypatch
):
    from limitmason.limit import solvers
    from limitmason.limit.interior_point import solver

    wall = running_bond(4, 5)
    loads = lm.Loads.horizontal(wall)
    expected = lm.limit_analysis(wall, loads, solver="clarabel").collapse_multiplier
    original = solver.solve_interior_point

    def almost(problem, **options):
        found = original(problem, **options)
        return found._replace(status="almost solved", multiplier=(1.0 + off) * found.multiplier)

    monkeypatch.setattr(solvers, "LARGE_IN_PLANE", 0)
    monkeypatch.setattr(solver, "solve_interior_point", almost)
    prediction = lm.limit_analysis(wall, loads)
    assert prediction.provenance["solver"] == taken
    assert prediction.status == "solved"
    assert prediction.collapse_multiplier == pytest.approx(expected, rel=1e-8)


@pytest.mark.slow
def test_small_problems_do_not_load_the_compiler():
    import subprocess

    code = (
        "import sys, limitmason as lm; from walls import running_bond; w = running_bond(3, 3);"
        "lm.limit_analysis(w, lm.Loads.horizontal(w)); print('numba' in sys.modules)"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=_environment()
    ).stdout.strip()
    assert out == "False"


def _environment():
    import os

    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}


def test_callback_sees_bounds_that_meet():
    wall = running_bond(4, 5)
    seen = []
    solution = own(make_problem(wall, lm.Loads.horizontal(wall)), callback=seen.append)
    assert len(seen) == solution.iterations + 1
    assert seen[-1].static == pytest.approx(seen[-1].kinematic, rel=1e-6)
    gaps = [p.complementarity for p in seen]
    assert gaps[-1] < 1e-6 * gaps[0]


# ---- linear algebra --------------------------------------------------------------------------------------------------


def random_blocks(rng, blocks, points, components):
    """Random matrix of blocks with one to six rows each, every point touching one or two of them; and their numbers."""
    width = rng.integers(1, 7, blocks)
    row_block = np.repeat(np.arange(blocks), width)
    first = np.concatenate([[0], np.cumsum(width)])
    dense = np.zeros((len(row_block), components * points))
    for p in range(points):
        near = rng.integers(blocks)
        for b in {near, int(np.clip(near + rng.integers(-3, 4), 0, blocks - 1))}:
            rows = slice(first[b], first[b + 1])
            dense[rows, components * p : components * (p + 1)] = rng.normal(size=(width[b], components))
    return dense, row_block


@pytest.mark.parametrize("components", [2, 3])
@pytest.mark.parametrize("blocks", [1, 5, 60])
def test_block_cholesky_equals_dense_cholesky(blocks, components):
    from limitmason.limit.interior_point.factor import BlockCholesky

    rng = np.random.default_rng(17 * blocks + components)
    points = 12 * blocks
    dense, row_block = random_blocks(rng, blocks, points, components)
    root = rng.normal(size=(points, components, components))
    factor = BlockCholesky(sparse.csc_array(dense), components, row_block, rng.normal(size=(blocks, 3)))
    factor.factorise(root)
    scaled = np.concatenate([dense[:, components * p : components * (p + 1)] @ root[p] for p in range(points)], axis=1)
    right = rng.normal(size=(2, len(dense)))
    expected = np.linalg.solve(scaled @ scaled.T, right.T).T
    assert np.allclose(factor.solve(right), expected, rtol=1e-7, atol=1e-10 * np.abs(expected).max())
    assert np.allclose(factor.solve(right[0]), expected[0], rtol=1e-7, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("nodes, edges", [(1, 0), (7, 3), (300, 900), (300, 100)])
def test_dissection_covers_every_node_once_and_children_stay_apart(nodes, edges):
    from limitmason.multifrontal.dissection import dissect, elimination_tree

    rng = np.random.default_rng(nodes + edges)
    position = rng.uniform(size=(nodes, 3))
    order = np.argsort(position[:, 0])
    # neighbours in a row, so that there is something to dissect
    a = rng.integers(0, nodes, edges)
    b = np.clip(a + rng.integers(-4, 5, edges), 0, nodes - 1)
    a, b = order[a], order[b]
    graph = sparse.csr_array((np.ones(2 * edges), (np.r_[a, b], np.r_[b, a])), shape=(nodes, nodes))
    graph.setdiag(0)
    graph.eliminate_zeros()
    fronts = dissect(graph, position, 4)
    assert sorted(np.concatenate(fronts).tolist()) == list(range(nodes))
    tree = elimination_tree(graph, fronts)
    place = np.empty(nodes, int)
    place[np.concatenate(fronts)] = np.arange(nodes)
    front_of = np.empty(nodes, int)
    for k, front in enumerate(fronts):
        front_of[front] = k
        assert tree.parent[k] > k or tree.parent[k] == -1
    # every edge stays within a front or joins it to its boundary: what the factorisation fills is allotted
    rows, columns = graph.nonzero()
    for i, j in zip(rows, columns, strict=True):
        k = front_of[i]
        if front_of[j] > k:
            assert place[j] in tree.boundary[k]


def test_a_wall_is_cut_across_and_nodes_at_one_place_stay_together():
    from limitmason.multifrontal.dissection import block_graph, dissect

    # a strip of 20 x 3 nodes, each element four of them: the first cut takes one column of three
    x, z = (v.ravel() for v in np.meshgrid(np.arange(20), np.arange(3), indexing="ij"))
    corner = np.array([3 * i + j for i in range(19) for j in range(2)])
    node = np.concatenate([corner, corner + 1, corner + 3, corner + 4])
    graph = block_graph(node, np.tile(np.arange(len(corner)), 4))
    fronts = dissect(graph, np.column_stack([x, 0.0 * x, z]), 4)
    assert len(fronts[-1]) == 3
    assert np.ptp(x[fronts[-1]]) == 0
    assert 5 <= x[fronts[-1]][0] <= 14
    assert len(dissect(graph, np.zeros((60, 3)), 4)) == 1


def test_blas_threads_are_restored():
    from limitmason.limit.interior_point.blas_threads import _bundled_openblas, one_blas_thread

    before = [get() for get, _ in _bundled_openblas()]
    with one_blas_thread():
        assert all(get() == 1 for get, _ in _bundled_openblas())
    assert [get() for get, _ in _bundled_openblas()] == before
