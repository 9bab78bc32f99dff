"""Cohesion, tension, crushing, torsion: single faces with exact answers."""

import math

import numpy as np
import pytest
from walls import on_slab, running_bond, stack

import limitmason as lm
from limitmason.answers.results import BoundKind
from limitmason.geometry import box


def block(width, depth, height, joint, density=0.0):
    return on_slab([((0, 0, 0), (width, depth, height))], joint=joint, density=density)


def pushed(assembly, vertical, height, width, depth):
    return (
        lm.Loads.weight(assembly)
        .with_point_load(assembly, 1, (0, 0, -vertical), at=(width / 2, depth / 2, height), case="dead")
        .with_point_load(assembly, 1, (1, 0, 0), at=(width / 2, depth / 2, height))
    )


@pytest.mark.parametrize("fc, vertical", [(1e6, 30e3), (1e6, 150e3), (5e5, 100e3)])
def test_crushing_toe_in_plane_is_exact(fc, vertical):
    # V = N (L - N / (fc t)) / (2 H0)
    width, depth, height = 1.0, 0.3, 2.0
    assembly = block(width, depth, height, lm.Joint(40.0, compressive_strength=fc))
    expected = vertical * (width - vertical / (fc * depth)) / (2 * height)
    prediction = lm.limit_analysis(assembly, pushed(assembly, vertical, height, width, depth))
    assert prediction.collapse_multiplier == pytest.approx(expected, rel=1e-6)
    assert prediction.certificate.yield_violation < 1e-9
    assert abs(prediction.certificate.gap) < 1e-8


def test_crushing_on_a_grid_comes_from_above_and_converges():
    width, depth, height, fc, vertical = 1.0, 0.3, 2.0, 5e5, 100e3
    assembly = block(width, depth, height, lm.Joint(40.0, compressive_strength=fc))
    expected = vertical * (width - vertical / (fc * depth)) / (2 * height)
    errors = []
    for n in (5, 9, 17, 33):
        prediction = lm.limit_analysis(
            assembly,
            pushed(assembly, vertical, height, width, depth),
            contact_model="grid",
            grid=(n, 3),
            in_plane=False,
        )
        errors.append(prediction.collapse_multiplier / expected - 1)
        # the error that the result states is not smaller than the true one
        assert prediction.details["grid_error_estimate"] >= 0.99 * errors[-1]
        assert any("half as many points" in w for w in prediction.warnings)
        assert prediction.bound.kind is BoundKind.ESTIMATE  # it lies above the exact value
    assert all(e >= -1e-9 for e in errors)
    assert errors[-1] < 0.005
    assert errors[-1] < errors[0] / 8


def test_crushing_with_corner_points_in_3d_is_refused():
    assembly = block(1.0, 0.3, 2.0, lm.Joint(40.0, compressive_strength=1e6))
    with pytest.raises(ValueError, match="compressive strength"):
        lm.limit_analysis(assembly, pushed(assembly, 1e4, 2.0, 1.0, 0.3), in_plane=False)


def test_tension_is_plastic_and_says_so():
    # a weightless block glued to the slab: end forces ft A / 2 each, M = ft A L / 2
    width, depth, height, ft = 1.0, 0.5, 4.0, 1e5
    joint = lm.Joint(45.0, cohesion=1e6, tensile_strength=ft)
    assembly = block(width, depth, height, joint)
    prediction = lm.limit_analysis(assembly, pushed(assembly, 1e-3, height, width, depth))
    # compression end turns: ft A/2 at lever L
    assert prediction.collapse_multiplier == pytest.approx(ft * width * depth / 2 * width / height, rel=1e-5)
    assert any("perfectly plastic" in w for w in prediction.warnings)


def test_cohesion_adds_to_sliding():
    # squat block: V = c A + mu N
    width, depth, height, c, vertical = 1.0, 0.5, 0.05, 2e4, 5e4
    assembly = block(width, depth, height, lm.Joint(30.0, cohesion=c))
    for in_plane in (None, False):
        value = lm.limit_analysis(
            assembly, pushed(assembly, vertical, height, width, depth), in_plane=in_plane
        ).collapse_multiplier
        assert value == pytest.approx(c * width * depth + math.tan(math.radians(30)) * vertical, rel=1e-6)


def test_apex_governs_where_tensile_strength_exceeds_cohesion_over_friction():
    width, depth, height, c = 1.0, 0.5, 0.5, 1e4
    apex = c / math.tan(math.radians(45))
    assembly = block(width, depth, height, lm.Joint(45.0, cohesion=c, tensile_strength=100 * apex))
    lift = np.zeros((2, 6))
    lift[1, 2] = 1.0
    loads = lm.Loads(np.zeros((2, 6)), lift)
    value = lm.limit_analysis(assembly, loads).collapse_multiplier
    assert value == pytest.approx(apex * width * depth, rel=1e-6)


def twisted(mu=0.6, side=1.0):
    assembly = on_slab([((0, 0, 0), (side, side, 0.5))], mu=mu)
    live = np.zeros((2, 6))
    live[1, 5] = 1.0
    return assembly, lm.Loads(lm.Loads.weight(assembly).dead, live)


@pytest.mark.parametrize(
    "options", [{}, {"contact_model": "grid", "grid": (3, 3)}, {"contact_model": "grid", "grid": (6, 6)}]
)
def test_torsion_of_a_square_face(options):
    # corners 0.7071 mu N a whatever the grid; uniform pressure 0.3826 mu N a
    assembly, loads = twisted()
    unit = 0.6 * assembly.weights[1]
    free = lm.limit_analysis(assembly, loads, **options).collapse_multiplier / unit
    limited = lm.limit_analysis(assembly, loads, torsion_limit=True, **options)
    assert free == pytest.approx(math.sqrt(0.5), abs=1e-6)
    assert limited.collapse_multiplier / unit == pytest.approx(0.382598, abs=1e-5)
    assert "estimate" in limited.bound


@pytest.mark.parametrize(("depth", "most"), [(1.0, 1.07), (0.25, 1.14)])
def test_shear_beside_torsion_is_taken_too_strong_by_no_more_than_the_answer_says(depth, most):
    """A block that turns about a pole beside it: shear and torsion of uniform pressure by quadrature."""
    assembly = on_slab([((0, 0, 0), (1.0, depth, 0.05))], mu=0.6)
    x, y = np.meshgrid(*(side * ((np.arange(200) + 0.5) / 200 - 0.5) for side in (1.0, depth)))
    alone = np.hypot(x, y).mean()
    for pole in np.linspace(0.15, 0.75, 5):
        distance = np.hypot(x - pole, y)
        shear, torsion = ((x - pole) / distance).mean(), ((x * (x - pole) + y * y) / distance).mean()
        live = np.zeros((2, 6))
        live[1, 1], live[1, 5] = 0.6 * assembly.weights[1] * np.array([shear, torsion])
        # the push acts at the joint, below the centroid: its pressure stays where it is
        live[1, 3] = 0.025 * live[1, 1]
        found = lm.limit_analysis(assembly, lm.Loads(lm.Loads.weight(assembly).dead, live), torsion_limit=True)
        circle = 1.0 / np.hypot(shear, torsion / alone)
        assert found.collapse_multiplier <= circle * 1.001  # the law of the corners may hold less
        if depth == 1.0:
            assert found.collapse_multiplier == pytest.approx(circle, rel=1e-3)
        assert 1.0 <= found.collapse_multiplier <= most
        assert "beside shear up to 7 % too strong" in found.bound


def test_in_plane_the_torsion_limit_changes_nothing_and_the_answer_is_exact():
    wall = running_bond(2, 3)
    loads = lm.Loads.horizontal(wall)
    free, limited = (lm.limit_analysis(wall, loads, torsion_limit=t) for t in (False, True))
    assert limited.collapse_multiplier == pytest.approx(free.collapse_multiplier, rel=1e-12)
    assert limited.bound == free.bound
    assert limited.bound.startswith("exact")
    assert abs(limited.certificate.gap) < 1e-6
    twice = lm.limit_analysis(wall, loads, torsion_limit=True, in_plane=False)
    assert "estimate" in twice.bound


def test_eccentric_block_slides_at_exactly_mu_under_the_torsion_limit():
    # centroid a quarter of the face off its middle: about the face's centroid the limit would give 0.837 mu
    base = box((0, 0, -0.5), (1, 1, 0))
    top = box((0, 0, 0), (1, 1.0, 0.05))
    wing = box((0, 1.0, 0), (1, 2.0, 0.05))
    assembly = lm.Assembly.from_polyhedra(
        [base, [top, wing]], joint=lm.Joint.from_friction_coefficient(0.5), fixed=[0], density=[2000.0, 2000.0]
    )
    # the block's own weight acts half a side off the face's middle; an equal weight at the middle halves that
    assert assembly.centroids[1][1] - 0.5 == pytest.approx(0.5)
    heavy = lm.Loads.weight(assembly).with_point_load(
        assembly, 1, (0, 0, -assembly.weights[1]), at=(0.5, 0.5, 0.05), case="dead"
    )
    total = 2 * assembly.weights[1]
    loads = heavy.with_point_load(assembly, 1, (total, 0, 0), at=(0.5, 0.75, 0.0))
    value = lm.limit_analysis(assembly, loads, torsion_limit=True)
    assert value.collapse_multiplier == pytest.approx(0.5, abs=1e-5)


def test_joint_kinds_and_pairs_choose_the_law():
    weak, strong = lm.Joint.from_friction_coefficient(0.1), lm.Joint.from_friction_coefficient(0.9)
    boxes = [((0, 0, 0), (1, 1, 0.1)), ((0, 0, 0.1), (1, 1, 0.2)), ((0, 0, 0.2), (1, 1, 0.3))]
    by_kind = on_slab(boxes, joint=strong, joints={"base": weak})
    by_pair = on_slab(boxes, joint=strong, joints={("block-2", "block-3"): weak})
    for assembly, mover in ((by_kind, 1), (by_pair, 3)):
        prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly))
        assert prediction.collapse_multiplier == pytest.approx(0.1, abs=1e-8)
        assert prediction.mechanism.moving_blocks()[0] == mover
    with pytest.raises(ValueError, match="do not touch"):
        on_slab(boxes, joint=strong, joints={("block-1", "block-3"): weak})


def test_blocks_of_different_density():
    boxes = [((0, 0, 0), (1, 1, 1)), ((0, 0, 1), (1, 1, 2))]
    assembly = on_slab(boxes, mu=5.0, density=[1.0, 1000.0, 3000.0])
    # moments about the toe: (1000 + 3000) 0.5 against 1000 0.5 + 3000 1.5
    expected = 4000 * 0.5 / (1000 * 0.5 + 3000 * 1.5)
    assert lm.limit_analysis(assembly, lm.Loads.horizontal(assembly)).collapse_multiplier == pytest.approx(
        expected, abs=1e-8
    )


def test_partial_support_guides_a_block():
    # a block held against translation only can still turn; held along x it cannot slide that way
    assembly = stack([(1.0, 1.0)], mu=0.1).with_supports([lm.Support("block-1", dofs=["x"])])
    prediction = lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, (0, 1, 0)))
    assert prediction.collapse_multiplier == pytest.approx(0.1, abs=1e-7)
    held = stack([(1.0, 1.0)], mu=0.1).with_supports([lm.Support("block-1", translations=True)])
    live = np.zeros((2, 6))
    live[1, 4] = 1.0
    prediction = lm.limit_analysis(held, lm.Loads(lm.Loads.weight(held).dead, live))
    # turning about the held centroid presses one edge into the slab: the support answers without limit
    assert prediction.status == "unbounded"


def crushing_pier(psi=35.0):
    """A pier whose toe crushes, pushed by its own weight, and its exact multiplier by a stress block."""
    pier = block(1.0, 1.0, 2.0, lm.Joint(35.0, psi, compressive_strength=2e5), density=2000.0)
    weight = pier.weights[1]
    return pier, lm.Loads.horizontal(pier), (1.0 - weight / 2e5) / 2.0


@pytest.mark.parametrize("contact_model", ["grid", "lobatto"])
def test_crushing_at_points_is_never_called_exact(contact_model):
    """Neither by the other flow rule where psi = phi, nor as a bracket: points err, as the stress block shows."""
    pier, loads, exact = crushing_pier()
    assert lm.limit_analysis(pier, loads).collapse_multiplier == pytest.approx(exact, rel=1e-6)
    found = [lm.limit_analysis(pier, loads, rule, contact_model=contact_model) for rule in lm.limit.analysis.FLOW_RULES]
    assert abs(found[0].collapse_multiplier / exact - 1.0) > 5e-3
    for p in found:
        assert p.bound.kind is BoundKind.ESTIMATE
        assert any("half as many points" in w for w in p.warnings)
    # Lobatto points crowd at the toe and lie below: "on the high side" is not said of them
    assert (found[0].collapse_multiplier < exact) == (contact_model == "lobatto")
    assert ("high side" in found[0].warnings[-1]) == (contact_model == "grid")
    bracket = lm.limit_bracket(pier, loads, contact_model=contact_model)
    assert bracket.lower.bound.kind is BoundKind.ESTIMATE
    assert (bracket.upper.bound.kind is BoundKind.UPPER) == (contact_model == "grid")


def test_a_reaction_of_joints_that_crush_at_points_is_an_estimate_along_any_motion():
    joint = lm.Joint(35.0, 35.0, compressive_strength=2e5)
    lintel = lm.Assembly.from_polyhedra(
        [box((0, 0, -1), (1, 1, 0)), box((2, 0, -1), (3, 1, 0)), box((0, 0, 0), (3, 1, 0.5))], joint=joint, fixed=[0, 1]
    )
    for motion in ("-z", lm.SupportMotion((0.1, 0.0, -1.0))):
        found = lm.settlement_analysis(lintel, 1, direction=motion, contact_model="grid")
        assert found.bound.kind is BoundKind.ESTIMATE


def test_points_may_be_given_by_their_spacing_where_joints_crush():
    pier, loads, _ = crushing_pier()
    spaced = lm.limit_analysis(pier, loads, contact_model="grid", grid=0.25)
    counted = lm.limit_analysis(pier, loads, contact_model="grid", grid=(5, 5))
    assert spaced.collapse_multiplier == counted.collapse_multiplier
    assert spaced.details["coarser_grid_multiplier"] == counted.details["coarser_grid_multiplier"]
    # half of two points is two points
    assert lm.limit_analysis(pier, loads, contact_model="grid", grid=1.5).details["grid_error_estimate"] == 0.0
