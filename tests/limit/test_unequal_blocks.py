"""Blocks of very different size: independent parts solved apart, one part in units of each block's own load."""

import numpy as np
import pytest
from giants import FRICTION, beside_giant, on_giant

import limitmason as lm
from limitmason.answers.results import BoundKind
from limitmason.geometry import box
from limitmason.limit import associative, settlement_analysis
from limitmason.limit.parts import independent_parts
from limitmason.limit.program.clarabel_solver import Carried
from limitmason.limit.program.scaling import balanced, spread
from limitmason.limit.program.static_theorem import make_problem

DIRECTIONS = [(1, 0, 0), (0.8, 0.6, 0)]


@pytest.mark.parametrize("make", [beside_giant, on_giant])
@pytest.mark.parametrize("ratio", [1, 50, 1000, 10000])
@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("solver", ["auto", "clarabel", "interior-point"])
def test_stack_rocks_at_t_over_h_whatever_stands_beside_or_under_it(make, ratio, direction, solver):
    assembly = make(ratio)
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, direction), solver=solver)
    # cubes rock over the edge that the larger component faces, h / t = 3
    assert prediction.status == "solved"
    assert prediction.collapse_multiplier == pytest.approx(1.0 / 3.0 / max(direction), rel=1e-6)
    assert prediction.certificate.block_residual < 1e-6
    assert list(prediction.mechanism.moving_blocks()) == [1, 2, 3]


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_answer_does_not_depend_on_units_numbers_or_position(factor):
    assembly = on_giant(300)
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    moved = assembly.transformed(factor * turn, (5.0 * factor, -3.0 * factor, factor)).renumbered([4, 2, 0, 1, 3])
    prediction = lm.limit_analysis(moved, lm.Loads.horizontal(moved, turn @ (1.0, 0.0, 0.0)))
    assert prediction.status == "solved"
    assert prediction.collapse_multiplier == pytest.approx(1.0 / 3.0, rel=1e-6)


@pytest.mark.parametrize("density", [0.0, 1e-9, 1e-3])
def test_a_plate_of_hardly_any_weight_between_heavy_blocks(density):
    boxes = [box((0, 0, k), (1, 1, k + 1)) for k in range(4)]
    assembly = lm.Assembly.from_polyhedra(
        [box((-1, -1, -1), (2, 2, 0)), *boxes], joint=FRICTION, fixed=[0], density=[2000, 2000, density, 2000, 2000]
    )
    w = assembly.weights[1:]
    exact = 0.5 * w.sum() / (w * (np.arange(4) + 0.5)).sum()
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly))
    assert prediction.status == "solved"
    assert prediction.collapse_multiplier == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("ratio", [10, 100, 1000])
@pytest.mark.parametrize("solver", ["auto", "interior-point"])
def test_a_very_large_block_on_pebbles_slides_at_tan_phi(ratio, solver):
    half = 0.5 * ratio
    feet = [(x, y) for x in (-half, half - 1) for y in (-half, half - 1)]
    solids = [box((-ratio, -ratio, -1), (ratio, ratio, 0)), *(box((x, y, 0), (x + 1, y + 1, 1)) for x, y in feet)]
    solids.append(box((-half, -half, 1), (half, half, 1 + 0.5 * ratio)))
    assembly = lm.Assembly.from_polyhedra(solids, joint=FRICTION, fixed=[0], tolerance=1e-4)
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), solver=solver)
    # everything slides on the slab: its height is half its width, and mu = 0.7 lies below the overturning 1 / 0.5
    assert prediction.status == "solved"
    assert prediction.collapse_multiplier == pytest.approx(0.7, rel=1e-6)


def test_rows_and_forces_in_units_of_each_block_are_the_same_problem():
    assembly = on_giant(100)
    problem = make_problem(assembly, lm.Loads.horizontal(assembly))
    own = balanced(problem)
    assert spread(problem) > 1e5
    force = np.random.default_rng(3).normal(size=problem.matrix.shape[1])
    columns = np.repeat(own.point_scale, problem.components)
    assert np.allclose((own.matrix @ (force / columns)) * own.row_unit, problem.matrix @ force)
    assert np.allclose(own.forces(force / columns), problem.forces(force))
    assert np.allclose(own.twists(own.dual(problem.twists(force[: len(problem.row)]))),
                       problem.twists(force[: len(problem.row)]))


# ---- independent parts -----------------------------------------------------------------------------------------------


def towers(heights, gap=1.0):
    """Stacks of unit cubes in a row on one slab, which is the last block."""
    left = [i * (1 + gap) for i in range(len(heights))]
    solids = [box((x, 0, k), (x + 1, 1, k + 1)) for x, n in zip(left, heights, strict=True) for k in range(n)]
    solids.append(box((-1, -1, -1), (len(heights) * (1 + gap) + 1, 2, 0)))
    return lm.Assembly.from_polyhedra(solids, joint=FRICTION, fixed=[len(solids) - 1])


@pytest.mark.parametrize("rule", ["associative", pytest.param("non-associative", marks=pytest.mark.slow)])
def test_smallest_multiplier_governs_and_the_rest_is_in_equilibrium(rule):
    assembly = towers([2, 5, 3, 5])
    assert [len(p) for p in independent_parts(assembly)] == [2, 5, 3, 5]
    options = {"search": "quick"} if rule == "non-associative" else {}
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), rule, **options)
    assert prediction.status == "solved"
    assert prediction.collapse_multiplier == pytest.approx(0.2, rel=1e-6)
    found = [part["multiplier"] for part in prediction.details["parts"]]
    assert found == pytest.approx([0.5, 0.2, 1 / 3, 0.2], rel=1e-6)
    assert prediction.details["governing_part"] in (1, 3)
    assert prediction.certificate.block_residual < 1e-6
    governing = independent_parts(assembly)[prediction.details["governing_part"]]
    assert set(prediction.mechanism.moving_blocks()) <= set(governing)


def test_a_part_without_live_load_must_stand_too():
    assembly = towers([2, 3])
    loads = lm.Loads.weight(assembly).with_point_load(assembly, 4, (1000.0, 0, 0))
    prediction = lm.limit_analysis(assembly, loads)
    # 1 kN at the middle of the top cube of three: lambda P 2.5 = 3 W / 2
    assert prediction.collapse_multiplier == pytest.approx(1.5 * assembly.weights[0] / 2500.0, rel=1e-6)
    assert prediction.status == "solved"
    overhanging = [box((0, 0, 0), (1, 1, 1)), box((0.7, 0, 1), (1.7, 1, 2)), box((4, 0, 0), (5, 1, 3))]
    falls = lm.Assembly.from_polyhedra([*overhanging, box((-1, -1, -1), (6, 2, 0))], joint=FRICTION, fixed=[3])
    prediction = lm.limit_analysis(falls, lm.Loads.weight(falls).with_point_load(falls, 2, (1000.0, 0, 0)))
    assert prediction.status == "cannot stand under dead load"
    assert "block-1" in prediction.details["falling_blocks"]
    assert "block-2" not in prediction.details["falling_blocks"]


def test_settlement_of_one_of_two_structures():
    solids = [box((0, 0, -1), (1, 1, 0)), box((2, 0, -1), (3, 1, 0)), box((0, 0, 0), (3, 1, 0.5))]
    solids += [box((10, 0, -1), (11, 1, 0)), box((10, 0, 0), (11, 1, 1))]
    assembly = lm.Assembly.from_polyhedra(solids, joint=FRICTION, fixed=[0, 1, 3])
    prediction = settlement_analysis(assembly, 1)
    # the beam of 3 m turns about the inner edge of the left support, 0.5 m from its middle: R (3 - 1) = W 0.5
    assert prediction.status == "solved"
    assert prediction.reaction.least == pytest.approx(0.25 * assembly.weights[2], rel=1e-6)


@pytest.mark.parametrize("ratio", [1.0, 3e3])
def test_the_other_scaling_is_another_one_of_the_same_dead_load_beside_free_loads_too(ratio, monkeypatch):
    """The load that is free was left out, and the "other" scaling was the first again where blocks differ little."""
    assembly = on_giant(ratio)
    loads, asked = lm.Loads.horizontal(assembly), []

    def undecided(problem, cones):
        asked.append(problem)
        return Carried(stands=None, force=None, velocity=None, seconds=0.0)

    monkeypatch.setattr(associative, "stands_under_dead_load", undecided)
    case = np.zeros((1, assembly.n_blocks, 6))
    case[0, -1, 0] = loads.dead[-1, 2]
    # a push of the top block against the live load, as far as pays
    associative.solve_associative(make_problem(assembly, loads, cases=case))
    first, other = asked[:2]
    assert np.abs(first.loads.dead - loads.dead).max() > 1e-3 * abs(loads.dead[-1, 2])
    np.testing.assert_allclose(other.loads.dead, first.loads.dead, rtol=1e-9, atol=1e-9)
    assert not np.allclose(other.row_unit, first.row_unit)


def test_the_smallest_of_parts_is_proven_only_where_no_other_may_lie_below_it():
    """A block has 0.5, proven; of a stack of twelve beside it the quick search says that 2/3 need not be the least."""
    stack = [box((3, 0, 0.125 * k), (4, 1, 0.125 * (k + 1))) for k in range(12)]
    both = lm.Assembly.from_polyhedra(
        [box((0, 0, -1), (5, 1, 0)), box((0, 0, 0), (1, 1, 2)), *stack], joint=lm.Joint(38.0), fixed=[0]
    )
    found = lm.limit_analysis(both, lm.Loads.horizontal(both), "non-associative", search="quick")
    assert found.collapse_multiplier == pytest.approx(0.5)
    assert found.details["proof"]["proven"]
    assert found.bound.kind is BoundKind.ESTIMATE
    alone = both.with_supports([lm.Support.fixed(k) for k in range(2, 14)])
    assert lm.limit_analysis(alone, lm.Loads.horizontal(alone), "non-associative").bound.kind is BoundKind.EXACT
