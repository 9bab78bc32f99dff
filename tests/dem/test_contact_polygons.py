"""Points of contacts found on the way: areas and first moments of any convex polygon, heights, outline, first shear."""

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.contact.inheritance import inherit, keep_energy
from dem.contact.new_joints import face_joint, linear_at, spread
from dem.kernels import CROSSING, FACES, LAW
from dem.model.edge_points import convex_hull
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


@pytest.mark.parametrize("name", POLYGONS)
def test_points_bear_area_and_first_moments_of_their_polygon(name):
    xy = np.array(POLYGONS[name])
    points, area = spread(xy)
    assert (area > 0.0).all()
    assert len(np.unique(np.rint(points * 1e9), axis=0)) == len(points)
    given = np.array([area.sum(), *(area @ points)])
    assert given == pytest.approx(moments(xy), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("name", POLYGONS)
def test_a_height_that_is_linear_over_a_polygon_is_found_anywhere(name):
    xy = np.array(POLYGONS[name])
    xy = xy - xy.mean(axis=0)
    at = np.array([(0.0, 0.0), (0.01, -0.02), *xy])
    assert linear_at(xy, 2e-4 + xy @ (0.01, -0.03), at) == pytest.approx(2e-4 + at @ (0.01, -0.03), rel=1e-9, abs=1e-15)


def test_the_outline_of_a_lattice_is_its_four_corners_the_long_way_round():
    u, v = np.meshgrid(np.linspace(-0.3, 0.3, 4), np.linspace(-0.1, 0.1, 7))
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    xy = np.column_stack([u.ravel(), v.ravel()]) @ turn.T
    corners = xy[convex_hull(xy)]
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
    state = dem.make_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = 3e-5, 0.0, -depth
    now, own = state.measured(pair), np.ones(1, dtype=bool)
    rot, place = state.bodies.rot + np.eye(3), pair.centroids + state.bodies.shift
    strip = np.array([(0, 0, -depth), (0, 0.1, -depth), (width, 0.1, -depth), (width, 0, -depth)], dtype=float)
    assert np.linalg.norm(now.force[:, :2].sum(axis=0)) == pytest.approx(mu * kn * depth * 0.04, rel=1e-9)
    for contact in (FACES, CROSSING):
        state.contact[:] = contact
        new = face_joint(pair, state, (0, 1), strip, np.array([0.0, 0.0, 1.0, 0.0]), rot, place, FACES)
        inherit(state, now, own, own & False, new)
        keep_energy(state, now, np.zeros(1, dtype=int), [new], [0])
        size = np.linalg.norm(new.slip, axis=1) * new.law[LAW.ks]
        assert size == pytest.approx(mu * kn * depth, rel=1e-6)
        assert new.slip[:, :2] @ new.world[:2, 0] == pytest.approx(-size / kn, rel=1e-6)  # against the displacement


@pytest.mark.parametrize("more", [4.0, 0.25])
def test_a_face_that_takes_over_shear_stores_no_more_of_it_however_large_it_is(more):
    # E = A t^2 / (2 ks): a quarter of the area keeps the stress, four times of it half the stress and twice the force
    kn, ks, mu, depth, aside = 1e8, 5e7, 0.5, 1e-5, 3e-6
    joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=kn, shear_stiffness=ks)
    blocks = [box((-1, -1, -1), (1, 1, 0)), box((-0.1, -0.1, 0), (0.1, 0.1, 0.2))]
    pair = lm.Assembly.from_polyhedra(blocks, joint=joint, fixed=[0])
    state = dem.make_state(pair, lm.Loads.weight(pair), contact_points=(2, 2))
    state.bodies.shift[1] = aside, 0.0, -depth
    now, own, x = state.measured(pair), np.ones(1, dtype=bool), 0.1 * np.sqrt(more)
    rot, place = state.bodies.rot + np.eye(3), pair.centroids + state.bodies.shift
    face = np.array([(-x, -x, -depth), (-x, x, -depth), (x, x, -depth), (x, -x, -depth)])
    new = face_joint(pair, state, (0, 1), face, np.array([0.0, 0.0, 1.0, 0.0]), rot, place, FACES)
    inherit(state, now, own, own & False, new)
    keep_energy(state, now, np.zeros(1, dtype=int), [new], [0])
    old = 0.5 * ks * 0.04 * aside**2
    assert now.elastic_energy == pytest.approx(old + 0.5 * kn * 0.04 * depth**2, rel=1e-9)
    sheared = 0.5 * ks * (new.area * (new.slip**2).sum(axis=1)).sum()
    pressed = 0.5 * kn * (new.area * np.maximum(-new.gap, 0.0) ** 2).sum()
    assert sheared == pytest.approx(old * min(more, 1.0), rel=1e-9)
    assert pressed == pytest.approx(0.5 * kn * 0.04 * depth**2 * min(more, 1.0), rel=1e-9)
