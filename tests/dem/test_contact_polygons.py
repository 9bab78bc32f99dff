"""Points of contacts found on the way: areas and first moments of any convex polygon, heights, outline, first shear."""

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.contact.new_joints import cut
from dem.contact.state_transfer import inherit, keep_energy
from dem.kernels import CROSSING, FACES, MOST, ROOM, Meetings
from dem.kernels.cutting import spread
from dem.kernels.outlines import convex_hull, slope_of
from dem.kernels.point_transfer import HARDER
from limitmason.geometry import box

SQUARE = ((0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, 0.2))
POLYGONS = {
    "rectangle": SQUARE,
    "strip of a hundredth": ((0.0, 0.0), (0.3, 0.0), (0.3, 0.003), (0.0, 0.003)),
    "trapezium": ((0.0, 0.0), (0.4, 0.05), (0.25, 0.3), (0.02, 0.2)),
    "triangle": ((0.0, 0.0), (0.3, 0.1), (0.1, 0.25)),
    "hexagon": ((0.0, 0.0), (0.2, -0.05), (0.4, 0.05), (0.42, 0.2), (0.2, 0.3), (0.0, 0.2)),
    "two corners in one place": ((0.0, 0.0), (0.3, 0.1), (0.3, 0.1), (0.1, 0.25)),
}


def moments(xy):
    """Area and first moments of a polygon, by Green's theorem."""
    x, y = xy.T
    u, v = np.roll(xy, -1, axis=0).T
    cross = x * v - u * y
    return np.array([cross.sum() / 2.0, ((x + u) * cross).sum() / 6.0, ((y + v) * cross).sum() / 6.0])


def points_in(xy):
    """Points of a polygon and their areas."""
    s, t, area = np.empty((3, ROOM))
    count = spread(*np.ascontiguousarray(xy.T), s, t, area)
    return np.column_stack([s, t])[:count], area[:count]


def heir_of(pair, state, outline, height):
    """Joint that a search would cut on an outline below the second block [m], with what it inherits from the first."""
    polygon = np.zeros((1, MOST, 3))
    polygon[0, : len(outline)] = np.column_stack([outline, np.full(len(outline), height)])
    met = Meetings(
        np.array([FACES]), np.array([height]), np.full(1, -1.0), polygon, np.array([len(outline)]),
        np.array([[0.0, 0.0, 1.0, 0.0]]), np.zeros((1, 5, 3)), np.ones(1, dtype=bool),
    )
    one, now = np.array([1]), state.measured(pair)
    new, kept = cut(pair, state, met, np.zeros(1, dtype=int), (one * 0, one), -one)
    inherit(state, now, one, one, new, one, one)
    keep_energy(state, now, one, new, one)
    assert len(kept) == 1
    return new, np.column_stack([new.points.slip_1, new.points.slip_2])


@pytest.mark.parametrize("name", POLYGONS)
def test_points_bear_area_and_first_moments_of_their_polygon(name):
    xy = np.array(POLYGONS[name])
    points, area = points_in(xy)
    assert (area > 0.0).all()
    assert len(np.unique(np.rint(points * 1e9), axis=0)) == len(points)
    given = np.array([area.sum(), *(area @ points)])
    assert given == pytest.approx(moments(xy), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("name", POLYGONS)
def test_a_height_that_is_linear_over_a_polygon_has_its_slopes(name):
    xy = np.array(POLYGONS[name])
    slope = slope_of(*np.ascontiguousarray(xy.T), 2e-4 + xy @ (0.01, -0.03))
    assert slope == pytest.approx((0.01, -0.03), rel=1e-9)


def test_a_height_over_a_row_of_points_is_level_across_it():
    way = np.array([0.8, 0.6])
    xy = np.array([0.1, 0.2]) + np.linspace(-0.2, 0.3, 5)[:, None] * way
    assert slope_of(*np.ascontiguousarray(xy.T), 0.02 * (xy @ way)) == pytest.approx(0.02 * way, rel=1e-9)


def test_the_outline_of_a_lattice_is_its_four_corners_the_long_way_round():
    u, v = np.meshgrid(np.linspace(-0.3, 0.3, 4), np.linspace(-0.1, 0.1, 7))
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    xy = np.column_stack([u.ravel(), v.ravel()]) @ turn.T
    found = np.empty(len(xy) + 2, dtype=int)
    corners = xy[found[: convex_hull(*np.ascontiguousarray(xy.T), found)]]
    assert moments(corners)[0] == pytest.approx(0.6 * 0.2, rel=1e-12)  # counter-clockwise: above zero
    own = np.rint(corners @ turn * 1e9).tolist()
    assert sorted(map(tuple, own)) == [(-3e8, -1e8), (-3e8, 1e8), (3e8, -1e8), (3e8, 1e8)]


@pytest.mark.parametrize("width", [1e-8, 1e-4, 0.1])
def test_a_face_that_takes_over_from_an_edge_stores_no_shear_that_it_does_not_bear(width):
    # the force of the edge on a strip of no area: F^2 / (2 ks A) has no bound, Coulomb's law has one
    kn, mu, depth = 1e8, 0.5, 1e-5
    joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=kn, shear_stiffness=kn)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = 3e-5, 0.0, -depth
    now, strip = state.measured(pair), [(0, 0), (0, 0.1), (width, 0.1), (width, 0)]
    assert np.linalg.norm(now.force[:, :2].sum(axis=0)) == pytest.approx(mu * kn * depth * 0.04, rel=1e-9)
    for contact in (FACES, CROSSING):
        state.contact[:] = contact
        new, slip = heir_of(pair, state, strip, -depth)
        size = np.linalg.norm(slip, axis=1) * kn
        pressed = kn * -new.points.gap
        assert (pressed >= kn * depth).all()
        assert size == pytest.approx(mu * pressed, rel=1e-6)
        assert slip @ new.heirs.world[0, :2, 0] == pytest.approx(-size / kn, rel=1e-6)  # against the displacement


@pytest.mark.parametrize("more", [4.0, 1.0, 0.81, 0.25])
def test_a_face_that_takes_over_stores_the_energy_however_large_it_is(more):
    # E = N^2 / (2 kn A) + T^2 / (2 ks A): on an area that is r times as large both forces change by the root of r
    kn, ks, mu, depth, aside = 1e8, 5e7, 0.5, 1e-5, 3e-6
    joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=kn, shear_stiffness=ks)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = aside, 0.0, -depth
    now, x = state.measured(pair), 0.1 * np.sqrt(more)
    old, area = 0.5 * ks * 0.04 * aside**2, 0.04 * more
    assert now.elastic_energy == pytest.approx(old + 0.5 * kn * 0.04 * depth**2, rel=1e-9)
    new, slip = heir_of(pair, state, [(-x, -x), (-x, x), (x, x), (x, -x)], -depth)
    points = new.points
    assert points.area.sum() == pytest.approx(area, rel=1e-9)
    assert 0.5 * ks * (points.area * (slip**2).sum(axis=1)).sum() == pytest.approx(old, rel=1e-9)
    pressed = np.maximum(-points.gap, 0.0)
    assert 0.5 * kn * (points.area * pressed**2).sum() == pytest.approx(0.5 * kn * 0.04 * depth**2, rel=1e-9)
    assert kn * (points.area * pressed).sum() == pytest.approx(kn * 0.04 * depth * np.sqrt(more), rel=1e-9)


def test_a_joint_that_is_closed_beyond_its_crushing_hands_on_the_energy_that_it_stores():
    # E = A fc^2 / (2 kn), however far it is closed
    kn, fc, depth, side = 1e8, 500.0, 1e-5, 0.2
    joint = lm.Joint.from_friction_coefficient(0.5, compressive_strength=fc, normal_stiffness=kn, shear_stiffness=kn)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = 0.0, 0.0, -depth
    assert kn * depth > fc
    stored = 0.04 * fc**2 / (2.0 * kn)
    assert state.measured(pair).elastic_energy == pytest.approx(stored, rel=1e-9)
    new, _ = heir_of(pair, state, [(-side, -side), (-side, side), (side, side), (side, -side)], -depth)
    pressed = np.maximum(-new.points.gap, 0.0)
    assert 0.5 * kn * (new.points.area * pressed**2).sum() == pytest.approx(stored, rel=1e-9)


def test_a_face_presses_no_harder_for_the_sake_of_energy():
    # an edge that bears with N stores more than an even pressure of N on all of the face: what is over is let go
    kn, angle = 1e8, 1e-4
    joint = lm.Joint.from_friction_coefficient(0.5, normal_stiffness=kn, shear_stiffness=kn)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.quat[1] = np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0
    state.bodies.rot[1, [0, 2], [2, 0]] = np.sin(angle), -np.sin(angle)
    now = state.measured(pair)
    force = now.force[:, 2].sum()
    depth = 0.9 * force / (kn * 0.04)
    new, _ = heir_of(pair, state, [(-0.1, -0.1), (-0.1, 0.1), (0.1, 0.1), (0.1, -0.1)], -depth)
    pressed = np.maximum(-new.points.gap, 0.0)
    assert kn * (new.points.area * pressed).sum() == pytest.approx(HARDER * force, rel=1e-9)
    assert 0.5 * kn * (new.points.area * pressed**2).sum() < now.elastic_energy


def test_the_pull_of_a_bonded_joint_is_no_shear_of_the_one_that_takes_over():
    # pulled by N and sheared by T: T^2 / (2 ks A) is energy of shear, N^2 / (2 ks A) was counted as some too
    kn, ks, apart, aside = 1e8, 5e7, 2e-5, 1e-5
    joint = lm.Joint(30.0, cohesion=1e4, tensile_strength=4e3, normal_stiffness=kn, shear_stiffness=ks)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = aside, 0.0, apart
    assert state.measured(pair).force.sum(axis=0) == pytest.approx([-ks * 0.04 * aside, 0.0, -kn * 0.04 * apart])
    _, slip = heir_of(pair, state, [(-0.1, -0.1), (-0.1, 0.1), (0.1, 0.1), (0.1, -0.1)], apart)
    assert np.linalg.norm(slip, axis=1) == pytest.approx(aside, rel=1e-9)


def test_a_damaged_joint_takes_over_no_more_shear_than_its_residual_friction_bears():
    # what is above the residual cone would be booked twice: as lost where the joint is cut, and as friction afterwards
    kn, depth, residual = 1e8, 1e-5, 10.0
    joint = lm.Joint(40.0, residual_friction_angle_deg=residual, normal_stiffness=kn, shear_stiffness=kn)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = 3e-5, 0.0, -depth
    state.points.damage[:] = 1.0
    mu = np.tan(np.deg2rad(residual))
    assert -state.measured(pair).force[:, 0].sum() == pytest.approx(mu * kn * depth * 0.04, rel=1e-9)
    for contact in (FACES, CROSSING):
        state.contact[:] = contact
        new, slip = heir_of(pair, state, [(0, 0), (0, 0.1), (1e-4, 0.1), (1e-4, 0)], -depth)
        assert (new.points.damage == 1.0).all()
        assert np.linalg.norm(slip, axis=1) == pytest.approx(mu * -new.points.gap, rel=1e-6)


def test_a_bonded_joint_that_is_pulled_takes_over_no_more_shear_than_its_cohesion_less_friction():
    # |T| <= c - tan(phi) * pull
    kn, cohesion, apart, mu = 1e8, 1e4, 2e-5, 0.5
    joint = lm.Joint.from_friction_coefficient(
        mu, cohesion=cohesion, tensile_strength=4e3, normal_stiffness=kn, shear_stiffness=kn
    )
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.initial_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = 1e-3, 0.0, apart
    _, slip = heir_of(pair, state, [(0, 0), (0, 0.1), (0.05, 0.1), (0.05, 0)], apart)
    assert kn * np.linalg.norm(slip, axis=1) == pytest.approx(cohesion - mu * kn * apart, rel=1e-6)
