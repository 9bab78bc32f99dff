"""The factor of solids against dense algebra: order, indefinite and singular matrices, and the path it leads to."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

import limitmason as lm
from limitmason.continuum import Box, Continuum, push, solve_elastic
from limitmason.continuum import factor as of_solids
from limitmason.errors import NotApplicable
from limitmason.multifrontal.unsymmetric import UnsymmetricFronts

LEGS = [
    Box(np.zeros(3), np.array([1.2, 0.2, 0.6])), Box(np.array([0.0, 0.2, 0.0]), np.array([0.2, 0.7, 0.6])),
    Box(np.array([1.0, 0.2, 0.0]), np.array([1.2, 0.7, 0.6])),
]
MASONRY = lm.Material(
    8e8, 0.2, 2000.0, tensile_strength=8e4, tensile_energy=12.0, compressive_strength=8e5, compressive_energy=1300.0
)


def wall(size=0.1, material=MASONRY, points=3):
    return Continuum.from_boxes(LEGS, material, size=size, points=points)


def random_bricks(solid, rng, *, definite):
    """Symmetric matrices of bricks without any structure."""
    a = rng.normal(size=(len(solid.mesh), 60, 60))
    return a @ a.swapaxes(1, 2) if definite else a + a.swapaxes(1, 2)


def assert_fronts_alone_solve(factor, right, expected, *, within=1e-6):
    """By the fronts, before and after a solution that is checked: no factor of the whole matrix has come to help."""
    for _ in range(2):
        assert not factor.exchanged
        off = np.linalg.norm(factor._substituted(right) - expected, axis=0)
        assert (off <= within * np.linalg.norm(expected, axis=0)).all()
        factor.solve(right)
    assert not factor.exchanged


def elastic(solid, factors=1.0):
    """Matrices of elastic bricks, times a factor each."""
    d = solid.discretisation
    tangent = np.tile(solid.moduli[0], (len(solid.mesh), d.per_brick, 1, 1))
    return d.stiffness(tangent * np.broadcast_to(factors, len(tangent))[:, None, None, None])


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_every_free_unknown_is_eliminated_once_and_every_brick_lies_in_one_front(scale):
    mesh = wall(0.1).mesh
    unknowns = (3 * mesh.connectivity[:, :, None] + np.arange(3)).reshape(len(mesh), 60)
    held = np.zeros(3 * len(mesh.nodes), dtype=bool)
    held[::7] = True
    e = of_solids.Elimination(unknowns, held, scale * mesh.nodes)
    assert sorted(e.order.tolist()) == np.flatnonzero(~held).tolist()
    assert sorted(np.concatenate(e.bricks).tolist()) == list(range(len(mesh)))
    for front, (bricks, places) in enumerate(zip(e.bricks, e.places, strict=True)):
        there = np.concatenate([e.fronts.first[front] + np.arange(e.fronts.owned[front]), e.fronts.edges[front], [-1]])
        assert np.array_equal(there[places], e.rank[bricks])
    # the last front goes across a wall, not along it: no more nodes than the section 0.2 x 0.6 m of the facade has
    assert e.fronts.owned[-1] <= 3 * (3 * 7 + 2 * 7 + 3 * 6)


@pytest.mark.slow
@pytest.mark.parametrize("definite", [True, False])
def test_factor_solves_as_dense_algebra_does(definite):
    solid = wall(0.2)
    d, rng = solid.discretisation, np.random.default_rng(3)
    values = random_bricks(solid, rng, definite=definite)
    dense = np.zeros((d.held.size, d.held.size))
    for at, value in zip(d.unknowns, values, strict=True):
        dense[np.ix_(at, at)] += value
    dense = dense[np.ix_(d.order, d.order)]
    assert sorted(d.order.tolist()) == d.free.tolist()
    assert np.allclose(d.assembled(values).toarray(), dense, rtol=0, atol=1e-12 * np.abs(dense).max())
    factor = d.factor(values)
    assert (factor.indefinite == 0) == definite
    assert not factor.exchanged
    right = rng.normal(size=(len(dense), 3))
    expected = np.linalg.solve(dense, right)
    assert factor.solve(right) == pytest.approx(expected, rel=1e-7, abs=1e-9 * np.abs(expected).max())
    assert factor.solve(right[:, 0]) == pytest.approx(expected[:, 0], rel=1e-7, abs=1e-9 * np.abs(expected).max())
    assert_fronts_alone_solve(factor, right, expected)
    assert factor.product(right) == pytest.approx(dense @ right, abs=1e-12 * np.abs(dense).max())


def test_a_front_whose_own_block_is_singular_takes_exchanges_over_the_whole_matrix():
    # one unknown is pulled by those of other fronts alone: regular as a whole, no exchange inside its front helps
    solid = wall(0.2)
    d = solid.discretisation
    rng = np.random.default_rng(5)
    values = random_bricks(solid, rng, definite=False)
    fronts, ranks = d.elimination.fronts, d.elimination.rank
    k = next(k for k, bricks in enumerate(d.elimination.bricks) if len(fronts.edges[k]) and len(bricks))
    first, size, boundary = int(fronts.first[k]), int(fronts.owned[k]), fronts.edges[k]
    shared = next(r for r in ranks[d.elimination.bricks[k]] if np.isin(r, boundary).any())
    one = shared[(shared >= first) & (shared < first + size)][0]
    right = rng.normal(size=len(d.order))
    factor = d.factor(values)
    assert_fronts_alone_solve(factor, right, np.linalg.solve(d.assembled(values).toarray(), right))
    assert factor.indefinite > 0
    for left in (0.0, 1e-14):  # exactly so; and nearly: elimination inside the front goes on, and is seen to be off
        for value, rank in zip(values, ranks, strict=True):
            own, at = (rank >= first) & (rank < first + size), np.flatnonzero(rank == one)
            value[np.ix_(at, own)], value[np.ix_(own, at)] = left, left
        dense = d.assembled(values).toarray()
        inside = np.arange(first, first + size)
        assert np.abs(dense[one, inside]).max() <= 4.0 * left
        expected = np.linalg.solve(dense, right)
        factor = d.factor(values)
        assert factor.solve(right) == pytest.approx(expected, rel=1e-6, abs=1e-8 * np.abs(expected).max())
        assert factor.exchanged or left
        assert factor._substituted(right) == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


def test_tangents_behind_the_peak_are_indefinite_and_solved():
    solid = wall(0.2).with_body_force((0.0, -1.0, 0.0))
    d = solid.discretisation
    tangent = np.tile(solid.moduli[0], (len(solid.mesh), d.per_brick, 1, 1))
    tangent[solid.mesh.corners.mean(axis=1)[:, 2] < 0.2] *= -0.3  # as where a softening layer unloads nothing
    factor = d.factor(d.stiffness(tangent))
    assert factor.indefinite > 0
    load = solid.live.ravel()[d.order]
    matrix = d.assembled(factor.values)
    u = factor.solve(load)
    assert np.linalg.norm(matrix @ u - load) < 1e-9 * np.linalg.norm(load)
    assert_fronts_alone_solve(factor, load, np.linalg.solve(matrix.toarray(), load))
    assert (np.linalg.eigvalsh(matrix.toarray()) < 0.0).any()


def test_a_solid_that_can_move_without_strain_is_refused_by_name():
    solid = wall(0.2)
    d = solid.discretisation
    held = np.zeros_like(solid.held)
    held[int(np.flatnonzero(solid.held[:, 0])[0])] = True  # one node: the wall turns about it
    loose = Continuum(solid.mesh, solid.materials, held, solid.dead, solid.live, solid.lumped)
    with pytest.raises(NotApplicable, match="singular.*free to move"):
        solve_elastic(loose)
    with pytest.raises(NotApplicable, match="singular"):
        d.factor(np.zeros((len(solid.mesh), 60, 60)))
    with pytest.raises(NotApplicable, match="not finite"):
        d.factor(np.full((len(solid.mesh), 60, 60), np.nan))
    # forces of a strain do no work on the three turns: the fronts alone carry them
    d = loose.discretisation
    factor = d.factor(elastic(loose))
    balanced = factor.product(np.random.default_rng(2).normal(size=(len(d.order), 1)))
    for found in (factor._substituted(balanced), factor.solve(balanced), factor._substituted(balanced)):
        assert not factor.exchanged
        assert np.linalg.norm(factor.product(found) - balanced) < 1e-6 * np.linalg.norm(balanced)
    frequency = lm.modes(loose, 4).frequency
    assert frequency[:3] == pytest.approx(0.0, abs=1e-3)
    assert frequency[3] > 1.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_load_that_is_not_finite_is_named(wrong):
    solid = wall(0.2)
    factor = solid.discretisation.factor(elastic(solid))
    load = np.ones((len(solid.discretisation.order), 2))
    load[5, 1] = wrong
    with pytest.raises(NotApplicable, match="the load is not finite"):
        factor.solve(load)
    assert not factor.exchanged


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("scale", [1e-300, 1e-290, 1e290])
def test_solutions_follow_the_scale_of_stiffness_and_load_to_the_ends_of_the_numbers(scale):
    solid = wall(0.2)
    d, values = solid.discretisation, elastic(solid)
    load = np.random.default_rng(4).normal(size=(len(d.order), 2))
    once, factor = d.factor(values).solve(load), d.factor(scale * values)
    assert factor.solve(scale * load) == pytest.approx(once, rel=1e-9)
    assert scale * factor.solve(load) == pytest.approx(once, rel=1e-9)
    assert_fronts_alone_solve(factor, scale * load, once)
    with pytest.raises(NotApplicable, match="not finite"):
        d.factor(1e297 * values)


def test_what_a_soft_layer_leaves_unbalanced_is_the_rounding_of_its_solution():
    solid = wall(0.2).with_body_force((0.0, -1.0, 0.0))
    d = solid.discretisation
    load = solid.live.ravel()[d.order][:, None]
    low = solid.mesh.corners.mean(axis=1)[:, 2] < 0.2
    for softer in (1e-6, 1e-8, 1e-10):
        factor = d.factor(elastic(solid, np.where(low, softer, 1.0)))
        x = factor.solve(load)
        off = np.linalg.norm(factor.product(x) - load) / np.linalg.norm(load)
        assert off < 2e-14 / softer  # at most 2e-4 of the load at 1e-10
        size = np.abs(factor.values).max() * np.linalg.norm(x)
        assert off * np.linalg.norm(load) < 1e-14 * size
        assert not factor.exchanged


@pytest.mark.slow
def test_the_path_is_that_of_a_factor_without_exchanges(monkeypatch):
    # scipy's SuperLU on the assembled matrix in the same order, as up to version 0.2: loads to 1e-8
    corners = [(0.3, 0.2, 0.3), (0.3, 0.2, 0.6), (0.9, 0.2, 0.6), (0.9, 0.2, 0.3)]
    solid = wall(0.2).with_patch_pressure(corners, force=1e3)
    control = ((0.6, 0.0, 0.6), (0, -1, 0))
    options = dict(control=control, to=4e-4, first=4e-5, largest=4e-5)
    here = push(solid, **options)
    assert not any(n.jump for n in here.nodes)
    assert here.load[-1] < 0.7 * here.load[1] * 10  # cracked

    class Plain:
        def __init__(self, elimination, values):
            matrix = of_solids.assembled(values, elimination.rank, len(elimination.order))
            lu = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            self.solve = lu.solve

    monkeypatch.setattr(of_solids, "Factor", Plain)
    there = push(solid, **options)
    assert here.displacement == pytest.approx(there.displacement, rel=1e-12)
    assert here.load == pytest.approx(there.load, rel=1e-8)


@pytest.mark.parametrize("dof", [1, 3])
def test_fronts_of_unsymmetric_values_solve_what_was_asked_with_a_border(dof):
    """A grid of 7 x 9 nodes; diagonals of nothing ask for exchanges of rows. Of no rank it is called singular."""
    rng, (across, up) = np.random.default_rng(2), (7, 9)
    place = np.stack(np.meshgrid(np.arange(across), np.arange(up), [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    near = np.abs(place[:, None] - place).max(axis=2) <= 1.0
    full = np.kron(near, np.ones((dof, dof)))
    full = np.block([[full, np.ones((len(full), 1))], [np.ones((1, len(full))), 1.0]])
    pattern = sparse.csc_matrix(full)
    pattern.sort_indices()
    fronts = UnsymmetricFronts(pattern, np.repeat(np.arange(len(place)), dof), place)
    for _ in range(3):
        matrix = pattern.copy()
        matrix.data = rng.normal(size=matrix.nnz)
        if dof > 1:
            matrix.setdiag(0.0)
        right = rng.normal(size=len(full))
        exact = np.linalg.solve(matrix.toarray(), right)
        factors = fronts.factors(matrix.data)
        assert fronts.solve(*factors, right) == pytest.approx(exact, rel=1e-7, abs=1e-9)
        assert fronts.sense(*factors) == np.linalg.slogdet(matrix.toarray())[0]
    assert fronts.factors(np.zeros(pattern.nnz)) is None


FACTORED = """
import numpy as np
from scipy import sparse
from limitmason.multifrontal.unsymmetric import UnsymmetricFronts
rng = np.random.default_rng(4)
place = np.stack(np.meshgrid(range(9), range(9), [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
near = np.kron(np.abs(place[:, None] - place).max(axis=2) <= 1.0, np.ones((3, 3)))
pattern = sparse.csc_matrix(np.pad(near, ((0, 1), (0, 1)), constant_values=1.0))
fronts = UnsymmetricFronts(pattern, np.repeat(np.arange(len(place)), 3), place)
store, pivot = fronts.factors(rng.normal(size=pattern.nnz))
print(store.tobytes().hex(), fronts.solve(store, pivot, rng.normal(size=len(near) + 1)).tobytes().hex())
"""


@pytest.mark.slow
def test_factors_have_the_same_bits_where_the_kernels_are_compiled_and_where_they_are_loaded(tmp_path):
    fresh = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    compiled, loaded = (
        subprocess.run([sys.executable, "-c", FACTORED], env=fresh, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert len(compiled) > 1000
    assert compiled == loaded
