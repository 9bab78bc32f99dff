"""Ties in capacity curves: closed form at finite rotation, hanging loose, limit analysis and the DEM, certificate."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dem
import limitmason as lm
from limitmason.capacity import frozen_friction, newton, step_equilibrium, system, ties
from limitmason.capacity.kinematics import at_rest, moved
from limitmason.errors import NotApplicable

WIDTH, HEIGHT, AT, SPAN = 0.3, 2.0, 1.6, 1.0
STRENGTH, STIFFNESS = 2000.0, 1e6


def pier(side=-1.0, stiffness=STIFFNESS, strength=STRENGTH):
    """One block pushed along +x, a level rod at a height on the side that it leaves (-1) or moves towards (+1)."""
    wall = lm.build.column(width=WIDTH, depth=1.0, height=HEIGHT, courses=1, joint=lm.Joint(60.0))
    low, high = wall.blocks[wall.block_index("column-1")].bounds
    end = np.array([low[0] if side < 0 else high[0], 0.5 * (low[1] + high[1]), AT])
    rod = lm.Tie("column-1", end, None, end + [side * SPAN, 0.0, 0.0], yield_force=strength, stiffness=stiffness)
    return wall.with_ties([rod]), lm.Loads.horizontal(wall)


def angles(curve):
    """Rotation of the block per sample, positive where it overturns along +x."""
    turn = np.array([n.pose.turn[curve.structure.assembly.block_index("column-1")] for n in curve.nodes])
    return np.arctan2(turn[:, 0, 2], 1.0 + turn[:, 0, 0])


def closed_form(theta, weight, plastic=0.0):
    """Multiplier of a rigid block about its toe at x = 0, the rod from (-b, h) to (-b - D, h); also its tension."""
    c, s = np.cos(theta), np.sin(theta)
    middle_x, middle_z = -0.5 * WIDTH * c + 0.5 * HEIGHT * s, 0.5 * WIDTH * s + 0.5 * HEIGHT * c
    x, z = -WIDTH * c + AT * s, WIDTH * s + AT * c
    span_x, span_z = -WIDTH - SPAN - x, AT - z
    length = np.hypot(span_x, span_z)
    pull = np.clip(STIFFNESS * (length - SPAN - plastic), 0.0, STRENGTH)
    arm = (z * span_x - x * span_z) / length  # of a unit pull, clockwise about the toe
    return (-weight * middle_x - pull * arm) / (weight * middle_z), pull


@pytest.mark.slow
def test_an_overturning_wall_with_a_tie_follows_its_closed_form_through_finite_rotation():
    missed = []
    for stiffness in (1e9, 1e10):
        wall, loads = pier()
        curve = lm.pushover(wall, loads, to=0.1, stiffness=stiffness)
        assert curve.status == "reached"
        assert all(c.accepted for c in curve.certificates)
        assert not curve.jumps
        assert max(abs(c.energy) for c in curve.certificates) < 0.01
        theta, weight = angles(curve), float(wall.weights[~wall.fixed][0])
        exact, pull = closed_form(theta, weight)
        rocks = np.array([n.force[:, 0].min() <= 0.0 for n in curve.nodes])
        yields = pull >= STRENGTH * (1.0 + 1e-12) - 1e-3
        assert yields.any()
        assert curve.tie_force[yields, 0] == pytest.approx(STRENGTH, rel=1e-9)
        assert curve.multiplier[-3:] == pytest.approx(exact[-3:], abs=5e-6 * 1e9 / stiffness)
        missed.append(np.abs(curve.multiplier - exact)[rocks].max())
    # before it yields the rod is as much shorter as the toe slides on its elastic joint
    assert missed[0] < 3e-3
    assert missed[1] == pytest.approx(0.1 * missed[0], rel=0.03)


def test_a_tie_that_has_yielded_hangs_loose_on_the_way_back():
    wall, loads = pier()
    there = lm.pushover(wall, loads, to=0.05, stiffness=1e10)
    back = lm.pushover(wall, loads, to=0.01, stiffness=1e10, start=there)
    assert all(c.accepted for c in back.certificates)
    left = back.nodes[-1].history.stretched[0]
    assert left == there.nodes[-1].history.stretched[0] > 10.0 * STRENGTH / STIFFNESS
    exact, pull = closed_form(angles(back), float(wall.weights[~wall.fixed][0]), left)
    assert back.tie_force[-1, 0] == pull[-1] == 0.0
    assert back.multiplier[-1] == pytest.approx(math.tan(math.atan(WIDTH / HEIGHT) - angles(back)[-1]), abs=1e-6)
    assert back.multiplier == pytest.approx(exact, abs=1e-3)


def test_a_tie_that_shortens_does_nothing():
    wall, loads = pier(side=1.0)
    curve = lm.pushover(wall, loads, to=0.05, stiffness=1e9)
    top = curve.peak.index
    assert curve.multiplier[top:] == pytest.approx(np.tan(math.atan(WIDTH / HEIGHT) - angles(curve)[top:]), abs=1e-8)
    assert curve.tie_force[top:].max() == 0.0


def house(ring=False):
    """A facade on the ground with returns behind it, two rods to them, or a ring beam; of examples/tie_rods.py."""
    thickness, height, width = 0.3, 3.0, 4.0
    solids = [
        lm.geometry.box((-1.0, -1.0, -0.2), (width + 1.0, 5.0, 0.0)),
        lm.geometry.box((0.0, 0.0, 0.0), (width, thickness, height)),
        lm.geometry.box((0.0, 1.0, 0.0), (thickness, 4.0, height)),
        lm.geometry.box((width - thickness, 1.0, 0.0), (width, 4.0, height)),
    ]
    wall = lm.Assembly.from_polyhedra(
        solids, joint=lm.Joint.from_friction_coefficient(0.6), density=1800.0, fixed=["ground"],
        names=["ground", "facade", "left", "right"],
    )
    if ring:
        line = [(0.15, 3.5, height), (0.15, 0.15, height), (width - 0.15, 0.15, height), (width - 0.15, 3.5, height)]
        return wall.with_ties(lm.ring_beam(wall, line, yield_force=4e3, stiffness=1e9))
    return wall.with_ties([
        lm.Tie("facade", (x, 0.0, 2.5), name, (x, 2.5, 2.5), yield_force=6e3, stiffness=1e9)
        for name, x in (("left", 0.15), ("right", width - 0.15))
    ])


@pytest.mark.parametrize("ring", [False, True])
def test_stiff_ties_in_space_come_to_the_multiplier_of_limit_analysis(ring):
    wall = house(ring)
    loads = lm.Loads.horizontal(wall, (0.0, -1.0, 0.0))
    expected = lm.limit_analysis(wall, loads).collapse_multiplier
    curve = lm.pushover(wall, loads, stiffness=1e11)
    assert all(c.accepted for c in curve.certificates)
    assert curve.first_limit_point.load == pytest.approx(expected, rel=1e-3)
    k = curve.first_limit_point.index
    forces = curve.resultants(k)
    assert forces.normal[-len(wall.ties) :] == pytest.approx(curve.tie_force[k], rel=1e-9)
    assert curve.tie_force[k].max() == pytest.approx(4e3 if ring else 6e3, rel=1e-6)
    both = lm.compare(wall, loads, ("associative", "pushover"), pushover={"stiffness": 1e11})
    assert both["pushover"].multiplier == pytest.approx(expected, rel=1e-3)


def test_a_turned_and_renumbered_copy_has_the_same_curve():
    wall = house()
    turn = Rotation.from_euler("z", 127.0, degrees=True).as_matrix()
    copy = wall.transformed(turn, (5.0, -3.0, 1.0)).renumbered([2, 0, 3, 1])
    first = lm.pushover(wall, lm.Loads.horizontal(wall, (0.0, -1.0, 0.0)), stiffness=1e9)
    second = lm.pushover(copy, lm.Loads.horizontal(copy, turn @ (0.0, -1.0, 0.0)), stiffness=1e9)
    assert second.first_limit_point.load == pytest.approx(first.first_limit_point.load, rel=1e-6)


def tied_bond():
    """A running bond in plane with a level rod from its top course to the ground and one along its diagonal."""
    joint = lm.Joint(33.0, normal_stiffness=1e9, shear_stiffness=1e9)
    wall = lm.build.wall(length=0.8, courses=4, unit=(0.4, 0.2, 0.2), joint=joint)
    last = wall.blocks[-1].name
    middle = wall.centroids[wall.block_index(last)]
    first = next(i for i in range(wall.n_blocks) if not wall.fixed[i])
    wall = wall.with_ties([
        lm.Tie(last, middle, None, middle - [1.5, 0.0, 0.2], yield_force=300.0, stiffness=1e7),
        lm.Tie(last, middle, wall.blocks[first].name, wall.centroids[first], yield_force=200.0, stiffness=1e7),
    ])
    return wall, lm.Loads.horizontal(wall)


@pytest.mark.slow
def test_the_first_limit_point_of_a_tied_wall_lies_in_the_bracket_of_the_dem():
    wall, loads = tied_bond()
    found = dem.collapse(wall, loads, contact_model="vertices", error_budget=())
    curve = lm.pushover(wall, loads, contacts="first")
    bare = lm.pushover(wall.with_ties(()), loads, contacts="first")
    assert curve.first_limit_point.load > 1.03 * bare.first_limit_point.load
    low, high = found.details["largest stable"], found.details["smallest moving"]
    assert 0.997 * low < curve.first_limit_point.load < 1.003 * high


def test_newton_descent_and_programs_find_the_same_tensions():
    wall, loads = tied_bond()
    curve = lm.pushover(wall, loads, contacts="first")
    made = curve.generations.systems[0]
    ratio = float(np.abs(made.loads.live).sum())
    for k in range(2, curve.first_limit_point.index - 3, 3):
        node, target = curve.nodes[k], curve.nodes[k + 3].control
        start = node.pose, node.history, target, node.multiplier, node.force[:, 0], ratio
        programs = step_equilibrium.by_programs(made, *start)[0]
        found = frozen_friction.solve(newton.Way.begin(made, node.pose, node.multiplier, node.history, target))
        assert found.multiplier == pytest.approx(programs.multiplier, abs=1e-8)
        assert found.state.pulled.tension == pytest.approx(programs.state.pulled.tension, abs=1e-4)


def test_wrenches_and_stiffness_of_ties_are_derivatives_at_any_rotation():
    wall = house(ring=True)
    rng = np.random.default_rng(5)
    rods, _ = ties.make_ties(wall)
    rods = rods._replace(stiffness=rng.uniform(1.0, 2.0, len(rods.length)), strength=np.full(len(rods.length), 1e3))
    plastic = np.full(len(rods.length), -1.0)  # all of them are taut
    n, basis, h = wall.n_blocks, np.eye(6), 1e-6
    pose = moved(at_rest(n), 0.2 * rng.normal(size=(n, 6)))
    motion = rng.normal(size=(n, 6))
    now = ties.pull(rods, basis, pose, plastic)
    assert (now.tension > 0.0).all()
    ahead, behind = (ties.pull(rods, basis, moved(pose, s * h * motion), plastic) for s in (1.0, -1.0))
    ends = np.stack([motion[rods.block_a], motion[rods.block_b]], axis=1)
    longer = (ahead.elongation - behind.elongation) / (2 * h)
    assert longer == pytest.approx(-(now.wrenches * ends).sum(axis=(1, 2)), abs=1e-8)
    change = [x.tension[:, None, None] * x.wrenches for x in (ahead, behind)]
    expected = np.einsum("tij,tj->ti", ties.stiffness(now, basis), ends.reshape(len(ends), -1))
    assert ((change[0] - change[1]) / (2 * h)).reshape(expected.shape) == pytest.approx(expected, abs=1e-7)


def test_blocks_that_deform_refuse_ties_by_name():
    wall, loads = pier()
    soft = wall.with_material(lm.Material(young_modulus=1e9, poisson_ratio=0.2))
    with pytest.raises(NotApplicable, match="capacity curve of simply deformable blocks does not follow ties"):
        lm.pushover(soft, loads, blocks="simply deformable")
    with pytest.raises(NotApplicable, match="small vibration does not follow ties"):
        lm.pushover(wall, loads, to=1e-4, stiffness=1e9).vibration()


# ---- mutants: each takes a term out, and the certificate must notice ------------------------------------------------


def test_a_path_that_forgets_what_a_tie_has_yielded_is_refused(monkeypatch):
    real = step_equilibrium.node_of

    def forgetful(solved, *arguments, **options):
        node = real(solved, *arguments, **options)
        return node._replace(history=node.history._replace(stretched=np.zeros_like(node.history.stretched)))

    monkeypatch.setattr(step_equilibrium, "node_of", forgetful)
    curve = lm.pushover(*pier(), to=0.02, stiffness=1e9)
    assert not all(c.accepted for c in curve.certificates)


def test_a_path_whose_ties_keep_their_direction_is_refused(monkeypatch):
    real = system.pull

    def stiff(rods, basis, pose, plastic):
        at, reference = real(rods, basis, pose, plastic), real(rods, basis, at_rest(len(pose.shift)), plastic)
        return at._replace(wrenches=reference.wrenches)

    monkeypatch.setattr(system, "pull", stiff)
    curve = lm.pushover(*pier(), to=0.02, stiffness=1e9)
    assert len(curve) > 5
    assert not all(c.accepted for c in curve.certificates)


def test_a_path_without_its_ties_is_refused(monkeypatch):
    """By its energy: the rod would store what nobody has put in."""

    def nothing(rods, basis, pose, plastic):
        at = ties.pull(rods, basis, pose, plastic)
        return at._replace(tension=0.0 * at.tension, tangent=0.0 * at.tangent, plastic=plastic)

    monkeypatch.setattr(system, "pull", nothing)
    curve = lm.pushover(*pier(), to=0.02, stiffness=1e9)
    assert curve.status == "stopped"
    assert any("out of nothing" in w for w in curve.warnings)
    assert curve.multiplier.max() < 0.05
