"""Contact points of faces that slide: they stay with the edge that ends the contact, whichever block's it is."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walls import on_slab

import dem
import limitmason as lm
from dem.kernels.outlines import convex_hull
from dem.model.edge_points import follow_edges
from dem.model.initial_state import initial_state
from limitmason.geometry import box, prism

HOOK = [[0, 0], [1, 0], [1, 1], [3, 1], [3, 2], [0, 2]]
RIGID = lm.Joint(0.0, normal_stiffness=1e11, shear_stiffness=1e11)


def turned(state, block, centroid, corner, place, angle):
    """Turn a block in x-z by an angle, clockwise, so that a point of its reference position comes to a place."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    state.bodies.shift[block] = place + turn @ (centroid - corner) - centroid
    state.bodies.quat[block] = np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0
    state.bodies.rot[block] = turn - np.eye(3)


@pytest.mark.parametrize("angle", [0.01, 0.05, 0.2])
def test_a_hook_that_tips_over_two_posts_bears_on_their_corners(angle):
    # its inner right angle runs on the circle over the two corners (1, .9) and (2, 1) that it leans on (Thales)
    posts = [box((1, 0, -1), (1.2, 1, 0.9)), box((1.2, 0, -1), (2, 1, 1))]
    hook = lm.Assembly.from_polyhedra([*posts, prism(HOOK, 0, 1)], joint=RIGID, fixed=[0, 1])
    state = initial_state(hook, lm.Loads.horizontal(hook, (1, 0, 0)), contact_points=(4, 2))
    centre, start = np.array([1.5, 0.0, 0.95]), np.array([-0.5, 0.0, 0.05])
    c, s = np.cos(2 * angle), np.sin(2 * angle)
    place = centre + np.array([c * start[0] + s * start[2], 0.0, -s * start[0] + c * start[2]])
    turned(state, 2, hook.centroids[2], np.array([1.0, 0.0, 1.0]), place, angle)
    for _ in range(20):  # a run follows its edges every hundred steps
        follow_edges(hook, state)
    now = state.measured(hook)
    first = state.joints.start
    for joint, corner in ((0, (1.0, 0.9)), (1, (2.0, 1.0))):
        mine = slice(first[joint], first[joint + 1])
        nearest = np.argmin(now.opening[mine])
        assert now.position[mine][nearest, [0, 2]] == pytest.approx(corner, abs=1e-6)
        assert now.opening[mine][nearest] == pytest.approx(0.0, abs=1e-6)
        assert (now.opening[mine] > -1e-6).all()


def test_a_block_well_within_its_table_takes_its_points_along():
    blocks = [box((0, 0, -1), (1, 1, 0)), box((0.5, 0, 0), (0.9, 1, 0.4))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=RIGID, fixed=[0])
    state = initial_state(pair, lm.Loads.horizontal(pair, (1, 0, 0)))
    state.bodies.shift[1] = 0.05, 0.0, 0.0
    follow_edges(pair, state)
    at = state.measured(pair).position[:, 0]
    assert (at.min(), at.max()) == pytest.approx((0.55, 0.95), abs=1e-12)


def test_equal_blocks_bear_on_what_they_share():
    pair = lm.Assembly.from_polyhedra([box((0, 0, -1), (1, 1, 0)), box((0, 0, 0), (1, 1, 1))], joint=RIGID, fixed=[0])
    state = initial_state(pair, lm.Loads.horizontal(pair, (1, 0, 0)))
    state.bodies.shift[1] = 0.1, -0.04, 0.0
    follow_edges(pair, state)
    at = state.measured(pair).position
    assert (at.min(axis=0)[:2], at.max(axis=0)[:2]) == (pytest.approx((0.1, 0.0)), pytest.approx((1.0, 0.96)))


def test_corners_of_a_lattice_are_its_outline_whatever_rounding_adds():
    s, t = (v.ravel() for v in np.meshgrid(np.linspace(-0.3, 0.3, 8), np.linspace(-0.1, 0.1, 4)))
    rng, corners = np.random.default_rng(3), np.empty(len(s) + 2, dtype=np.int64)
    for _ in range(50):
        noise = 1e-16 * rng.integers(-1, 2, (2, len(s)))
        assert convex_hull(s + noise[0], t + noise[1], corners) == 4
        assert set(corners[:4]) == {0, 7, 24, 31}


def test_equal_blocks_bear_on_what_they_share_however_they_are_turned():
    pair = lm.Assembly.from_polyhedra(
        [box((0, 0, -1), (1, 0.5, 0)), box((0, 0, 0), (1, 0.5, 1))], joint=RIGID, fixed=[0]
    )
    slip, places = np.array([0.1, -0.04, 0.0]), []
    for turn in (np.eye(3), *Rotation.random(12, random_state=1).as_matrix()):
        copy = pair.transformed(turn)
        state = initial_state(copy, lm.Loads.weight(copy), contact_points=(8, 4))
        state.bodies.shift[1] = turn @ slip
        follow_edges(copy, state)
        places.append(state.measured(copy).position @ turn)
    assert places == pytest.approx(np.broadcast_to(places[0], np.shape(places)), abs=1e-12)


def test_an_l_of_stones_falls_at_one_load_however_it_is_turned():
    # rounding took a corner off the outline of a joint in two of seven copies: .360 there and .339 elsewhere
    a, b, c = 0.2062994333, 0.4125874936, 0.8452428799
    stones = [
        ((0, 0, 0), (c, a, 0.3)),
        ((0, a, 0), (a, c, 0.3)),
        ((0, 0, 0.3), (b, a, 0.6)),
        ((b, 0, 0.3), (c, a, 0.6)),
        ((0, a, 0.3), (a, c, 0.6)),
    ]
    wall = on_slab(stones, joint=lm.Joint(29.504961741, normal_stiffness=7.33e8, shear_stiffness=6.02e8))
    along, found = np.array([-0.20833, -0.97806, 0.0]), []
    for turn in (np.eye(3), *Rotation.random(3, random_state=4).as_matrix()):
        copy = wall.transformed(turn)
        still = np.zeros((copy.n_blocks, 3))
        dead, live = (np.hstack([copy.weights[:, None] * (turn @ w), still]) for w in ((0.0, 0.0, -1.0), along))
        found.append(dem.collapse(copy, lm.Loads(dead, live), error_budget=()).collapse_multiplier)
    assert found == pytest.approx(4 * [found[0]], rel=5e-3)


def test_a_joint_that_sticks_keeps_its_points_to_the_last_bit():
    pair = lm.Assembly.from_polyhedra([box((0, 0, -1), (1, 1, 0)), box((0, 0, 0), (1, 1, 1))], joint=RIGID, fixed=[0])
    state = initial_state(pair, lm.Loads.horizontal(pair, (1, 0, 0)))
    before = state.points.s.copy()
    state.bodies.shift[1] = 1e-5, 0.0, 0.0
    follow_edges(pair, state)
    assert np.array_equal(state.points.s, before)
    assert np.isnan(state.ends).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_hook_bears_no_more_where_its_bearing_would_rise_with_it(seed):
    # on points that slide along each load leads to a stiffer place: 2.164, and 834 times its weight by short steps
    move = 1e-12 * np.random.default_rng(seed).uniform(-1.0, 1.0, (3, 3)) * (seed > 0)
    posts = [box((1, 0, -1), (1.2, 1, 0.9)), box((1.2, 0, -1), (2, 1, 1))]
    solids = [(s.vertices + by, s.faces) for s, by in zip((*posts, prism(HOOK, 0, 1)), move, strict=True)]
    hook = lm.Assembly.from_polyhedra(solids, joint=RIGID, fixed=[0, 1])
    answer = dem.collapse(hook, lm.Loads.horizontal(hook, (1, 0, 0)), error_budget=(), contact_points=(4, 2))
    assert answer.status == "solved"
    assert answer.details["largest stable"] < 0.75 / 0.35 < answer.details["smallest moving"]


@pytest.mark.slow
def test_a_hook_that_is_pushed_off_its_posts_follows_the_exact_branch():
    # its normal is that of the post until it has turned by a twentieth of a degree on their edges; a
    # joint that is cut anew rings for a sample
    posts = [box((1, 0, -1), (1.2, 1, 0.9)), box((1.2, 0, -1), (2, 1, 1))]
    joint = lm.Joint(2.0, normal_stiffness=1e10, shear_stiffness=1e10)
    hook = lm.Assembly.from_polyhedra([*posts, prism(HOOK, 0, 1)], joint=joint, fixed=[0, 1])
    curve = dem.push(hook, dem.Drive({"block-2": {"x": 1.0}}), to=0.05, rate_check=False, steps=80_000)
    angle = np.linspace(0.0, 0.2, 401)
    c, s, mu = np.cos(angle), np.sin(angle), np.tan(np.deg2rad(2.0))
    inner = np.array([1.5, 0.95])[:, None] + [
        -0.5 * np.cos(2 * angle) + 0.05 * np.sin(2 * angle),
        0.5 * np.sin(2 * angle) + 0.05 * np.cos(2 * angle),
    ]
    centroid = inner + 0.25 * np.array([c + s, c - s])
    load = []
    for at, cos, sin in zip(centroid.T, c, s, strict=True):
        # on the leg and under the arm: normal force and the friction that goes with it, as the faces lie now
        leg, arm = np.array([-cos - mu * sin, sin - mu * cos]), np.array([sin - mu * cos, cos + mu * sin])
        turn = [r[0] * f[1] - r[1] * f[0] for r, f in (((1.0, 0.9) - at, leg), ((2.0, 1.0) - at, arm))]
        load.append(np.linalg.solve([[leg[0], arm[0], 1.0], [leg[1], arm[1], 0.0], [*turn, 0.0]], [0.0, 1.0, 0.0])[2])
    late = curve.displacement > 0.002
    exact = np.interp(curve.displacement[late], centroid[0] - 1.25, load)
    off = np.abs(curve.load[late] / hook.weights[2] / exact - 1.0)
    assert np.quantile(off, 0.99) < 0.005
    assert off.max() < 0.03
