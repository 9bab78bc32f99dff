"""Contact detection against areas known by hand, and against a plain loop over all pairs."""

from itertools import pairwise

import numpy as np
import pytest
from walls import on_slab, running_bond

import limitmason as lm
from limitmason.geometry import (
    Solid,
    box,
    clean_outline,
    convex_pieces,
    find_contacts,
    mass_properties,
    polar_mean_radius,
    polygon_area_centroid,
)
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.polygon import centred_overlap, clip_convex
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.plane import find_plane
from limitmason.mechanics.stiffness_matrix import stiffness_matrix

JOINT = lm.Joint(30.0)


def test_box_tree_finds_what_all_pairs_find():
    rng = np.random.default_rng(0)
    low = rng.uniform(0, 10, (300, 3))
    high = low + rng.uniform(0, 1.0, (300, 3))
    low[7], high[7] = (-1, -1, -1), (11, 11, 11)  # one that spans everything, like a ground slab
    expected = {
        (i, j) for i in range(300) for j in range(i + 1, 300) if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
    }
    found = set(zip(*(x.tolist() for x in overlapping_pairs(low, high)), strict=True))
    assert found == expected


def test_clipped_areas_agree_with_one_pair_at_a_time():
    from limitmason.geometry.clipping import area_perimeter, clip_convex_batch

    rng = np.random.default_rng(1)
    angles = np.sort(rng.uniform(0, 2 * np.pi, (200, 2, 5)), axis=2)
    polygons = np.stack([np.cos(angles), np.sin(angles)], axis=3) + rng.uniform(-0.8, 0.8, (200, 2, 1, 2))
    five = np.full(200, 5)
    clipped, count = clip_convex_batch(polygons[:, 0], five, polygons[:, 1], five)
    area = np.where(count >= 3, area_perimeter(clipped)[0], 0.0)
    one = [polygon_area_centroid(c)[0] if len(c := clip_convex(p, q)) > 2 else 0.0 for p, q in polygons]
    assert np.allclose(area, one, atol=1e-12)
    for (p, q), corners, n in zip(polygons, clipped, count, strict=True):
        assert np.array_equal(corners[:n], clip_convex(p, q))
    assert (area > 0.01).sum() > 50


@pytest.mark.parametrize("units, courses, blocks, contacts", [(5, 10, 55, 140), (10, 20, 210, 580)])
def test_running_bond_counts(units, courses, blocks, contacts):
    # a course pair of n whole units and n + 1 with halves meets in 2 n beds
    wall = running_bond(units, courses)
    assert wall.n_blocks - 1 == blocks
    heads = sum(units - 1 if j % 2 == 0 else units for j in range(courses))
    assert contacts == units + 2 * units * (courses - 1) + heads
    assert len(wall.interfaces) == contacts
    assert sum(i.kind == "base" for i in wall.interfaces) == units


def test_concave_outline_becomes_convex_pieces_that_tile_it():
    outline = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]
    pieces = convex_pieces(clean_outline(outline[::-1], 1e-9))
    assert sum(polygon_area_centroid(p)[0] for p in pieces) == pytest.approx(7.0)
    assert len(pieces) <= 4


def test_tenon_touches_its_mortise_on_three_faces():
    mortise = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]
    tenon = [[1, 1], [3, 1], [3, 2], [1, 2]]
    assembly = lm.Assembly.from_polygons([mortise, tenon], thickness=0.5, joint=JOINT, fixed=[0])
    assert sorted(i.area for i in assembly.interfaces) == pytest.approx([0.5, 1.0, 1.0])
    assert {i.kind for i in assembly.interfaces} == {"base"}
    assert assembly.volumes[0] == pytest.approx(3.5)


def test_t_junction_gives_one_patch_per_neighbour():
    solids = [box((0, 0, 0), (4, 1, 1)), box((0, 0, 1), (1.5, 1, 2)), box((1.5, 0, 1), (4, 1, 2))]
    assembly = lm.Assembly.from_polyhedra(solids, joint=JOINT, fixed=[0])
    found = {(i.block_a, i.block_b): i.area for i in assembly.interfaces}
    assert found == pytest.approx({(0, 1): 1.5, (0, 2): 2.5, (1, 2): 1.0})


def test_faces_cut_into_triangles_merge_to_one_patch():
    a = box((0, 0, 0), (1, 1, 1))
    triangles = tuple(t for f in a.faces for t in ((f[0], f[1], f[2]), (f[0], f[2], f[3])))
    b = box((0, 0, 1), (1, 1, 2))
    assembly = lm.Assembly.from_polyhedra([(a.vertices, triangles), (b.vertices, triangles)], joint=JOINT, fixed=[0])
    assert len(assembly.interfaces) == 1
    assert len(assembly.interfaces[0].polygon) == 4
    assert assembly.interfaces[0].area == pytest.approx(1.0)


def test_a_stone_of_several_parts_loses_no_corner_of_its_face_by_rounding():
    # 60 ashlars cut into strips whose corners agree but for rounding, turned by quarters: the bed is the whole face
    rng, joint = np.random.default_rng(3), lm.Joint(35.0)
    for k in range(60):
        length, width = rng.uniform(0.2, 2.0, 2)
        cuts = np.concatenate([[0.0], np.sort(rng.uniform(0.1, 0.9, 3)) * length, [length]])
        strips = [box((a, 0.0, 0.0), (b, width, 0.2)) for a, b in pairwise(cuts)]
        c, s = np.cos(k * np.pi / 2.0), np.sin(k * np.pi / 2.0)
        turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        away = rng.choice([0.0, 1.0, 30.0])
        stone = [Solid(strip.vertices @ turn + away, strip.faces) for strip in strips]
        low = np.min([part.vertices.min(axis=0) for part in stone], axis=0)
        high = np.max([part.vertices.max(axis=0) for part in stone], axis=0)
        slab = box(tuple(low - [0.5, 0.5, 0.2]), (*(high[:2] + 0.5), low[2]))
        laid = lm.Assembly.from_polyhedra([slab, stone], density=2000.0, joint=joint, fixed=[0])
        assert [i.area for i in laid.interfaces] == pytest.approx([length * width], rel=1e-9)


@pytest.mark.parametrize("gap", [-4e-4, 0.0, 4e-4])
def test_gaps_and_overlaps_within_the_tolerance_are_contacts(gap):
    solids = [box((0, 0, 0), (1, 1, 1)), box((0, 0, 1 + gap), (1, 1, 2))]
    assembly = lm.Assembly.from_polyhedra(solids, joint=JOINT, fixed=[0], tolerance=1e-3)
    assert assembly.interfaces[0].area == pytest.approx(1.0)
    assert assembly.interfaces[0].polygon[:, 2] == pytest.approx(1 + gap / 2)
    with pytest.raises(ValueError, match="overlap" if gap < 0 else "floats") if gap else _nothing():
        lm.Assembly.from_polyhedra(solids, joint=JOINT, fixed=[0], tolerance=1e-4)


def _nothing():
    from contextlib import nullcontext

    return nullcontext()


def test_tiny_and_huge_structures_find_the_same_contacts():
    for scale in (1e-3, 1.0, 1e3):
        solids = [
            box(np.zeros(3), scale * np.ones(3)),
            box(scale * np.array([0, 0, 1.0]), scale * np.array([1, 1, 2.0])),
        ]
        assembly = lm.Assembly.from_polyhedra(solids, joint=JOINT, fixed=[0])
        assert assembly.interfaces[0].area == pytest.approx(scale**2)


def test_edge_touching_blocks_share_no_interface():
    found = find_contacts([box((0, 0, 0), (1, 1, 1)), box((1, 0, 1), (2, 1, 2))], np.arange(2), 1e-4)
    assert len(found.a) == 0
    assert found.overlaps == []


def test_mass_properties_of_a_box_and_a_wedge():
    m = mass_properties([box((1, 2, 3), (2, 4, 6))])
    assert m.volume[0] == pytest.approx(6.0)
    assert m.centroid[0] == pytest.approx([1.5, 3.0, 4.5])
    # I_xx / rho = V (b^2 + c^2) / 12
    assert np.diag(m.inertia[0]) == pytest.approx([6.5, 5.0, 2.5])
    wedge = lm.Assembly.from_polygons([[[0, 0], [1, 0], [0, 1]]], thickness=2.0, joint=JOINT)
    assert wedge.centroids[0] == pytest.approx([1 / 3, 1.0, 1 / 3])


def test_inertia_of_pieces_is_that_of_the_whole():
    whole = lm.Assembly.from_polyhedra([box((0, 0, 0), (2, 1, 1))], joint=JOINT)
    halves = lm.Assembly.from_polyhedra([[box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 1))]], joint=JOINT)
    assert np.allclose(whole.arrays.inertia, halves.arrays.inertia)
    assert np.allclose(whole.blocks[0].inertia, halves.blocks[0].inertia)


def test_polar_mean_radius_against_quadrature():
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert polar_mean_radius(square, (0.5, 0.5)) == pytest.approx(0.382598, abs=1e-6)
    assert polar_mean_radius([[0, 0], [2, 0], [2, 1], [0, 1]], (1, 0.5)) == pytest.approx(0.593233, abs=1e-6)
    assert polar_mean_radius([[0, 0], [0.144, 0], [0.144, 0.15], [0, 0.15]], (0.072, 0.075)) == pytest.approx(
        0.05625, abs=1e-5
    )
    # about a corner: twice the value about the centre; about a pole outside: by quadrature
    assert polar_mean_radius(square, (0, 0)) == pytest.approx(2 * 0.382598, abs=2e-6)
    grid = (np.arange(400) + 0.5) / 400
    x, y = np.meshgrid(grid, grid)
    assert polar_mean_radius(square, (1.7, -0.4)) == pytest.approx(np.hypot(x - 1.7, y + 0.4).mean(), rel=1e-5)
    assert polar_mean_radius([[0, 0], [4, 0], [4, 0], [0, 0]], (2, 0)) == pytest.approx(1.0)
    beside = np.hypot(np.linspace(0.0, 4.0, 100_001) - 1.5, 0.7).mean()  # of a line that the pole is not on
    assert polar_mean_radius([[0, 0], [4, 0], [4, 0], [0, 0]], (1.5, 0.7)) == pytest.approx(beside, rel=1e-5)


def test_compressed_area_is_centred_on_the_pressure():
    area, centroid = polygon_area_centroid(centred_overlap([[0, 0], [1, 0], [1, 1], [0, 1]], (0.25, 0.5)))
    assert area == pytest.approx(0.5)
    assert centroid == pytest.approx([0.25, 0.5])


@pytest.mark.parametrize("corners", [3, 4, 5, 6])
@pytest.mark.parametrize(("model", "elastic"), [("vertices", False), ("grid", False), ("grid", True)])
def test_tributary_areas_keep_area_and_centroid(corners, model, elastic):
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False) + 0.3
    ring = np.column_stack([np.cos(angle), 0.7 * np.sin(angle)])
    ring[0] *= 1.3

    def column(z0, z1):
        n = corners
        v = np.vstack([np.column_stack([ring, np.full(n, z)]) for z in (z0, z1)])
        sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
        return v, (tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)), *sides)

    assembly = lm.Assembly.from_polyhedra([column(0, 1), column(1, 2)], joint=JOINT, fixed=[0])
    points = contact_points(assembly, contact_model=model, grid=(5, 4), elastic=elastic)
    area, centre = polygon_area_centroid(ring)
    assert points.area.sum() == pytest.approx(area)
    assert (points.area > 0).all()
    mean = (points.area[:, None] * points.position).sum(axis=0) / area
    assert mean[:2] == pytest.approx(centre, abs=1e-12)


@pytest.mark.parametrize("corners", [3, 4, 5, 6])
@pytest.mark.parametrize("grid", [(3, 3), (4, 8), (7, 5)])
def test_grid_points_have_the_second_moments_of_the_face_from_three_on(corners, grid):
    # trapezoid weights made them 1 + 2 / (n - 1)^2 too large: 1.5 at three points, 1.22 at four
    angle = np.linspace(0, 2 * np.pi, corners, endpoint=False) + 0.3
    ring = np.column_stack([np.cos(angle), 0.7 * np.sin(angle)])
    ring[0] *= 1.3

    def column(z0, z1):
        n = corners
        v = np.vstack([np.column_stack([ring, np.full(n, z)]) for z in (z0, z1)])
        sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
        return v, (tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)), *sides)

    assembly = lm.Assembly.from_polyhedra([column(0, 1), column(1, 2)], joint=JOINT, fixed=[0])
    points = contact_points(assembly, contact_model="grid", grid=grid, elastic=True)
    # of a polygon about the origin, by its triangles: integral of x x^T = A / 12 (p p^T + q q^T + (p + q) (p + q)^T)
    exact = np.zeros((2, 2))
    for p, q in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        area = 0.5 * (p[0] * q[1] - p[1] * q[0])
        exact += area / 12.0 * (np.outer(p, p) + np.outer(q, q) + np.outer(p + q, p + q))
    x = points.position[:, :2]
    assert (points.area > 0).all()
    assert np.einsum("m,mi,mj->ij", points.area, x, x) == pytest.approx(exact, abs=1e-12)


@pytest.mark.exact
@pytest.mark.parametrize("n", range(3, 9))
def test_block_on_an_elastic_bed_rocks_at_the_frequency_of_the_closed_form(n):
    width, depth, height, kn, ks = 0.2, 0.3, 0.8, 1e9, 4e8
    joint = lm.Joint(30.0, normal_stiffness=kn, shear_stiffness=ks)
    block = on_slab([((0, 0, 0), (width, depth, height))], joint=joint)
    area, arm, mass = width * depth, 0.5 * height, block.arrays.mass[1]
    bending = kn * depth * width**3 / 12.0
    points = contact_points(block, contact_model="grid", grid=(n, n), elastic=True)
    stiffness = stiffness_matrix(block, points, np.array([kn, ks, ks]))[1].toarray()[6:, 6:]
    assert stiffness[4, 4] == pytest.approx(bending + ks * area * arm**2, rel=1e-12)
    # sway u of the centroid and turn r: the foot slides by u - arm r
    k = np.array([[ks * area, -ks * area * arm], [-ks * area * arm, bending + ks * area * arm**2]])
    inertia = mass * (width**2 + height**2) / 12.0
    lowest = np.linalg.eigvals(k / np.array([[mass], [inertia]])).min()
    found = lm.modes(block, 1, contact_points=(n, n)).frequency[0]
    assert found == pytest.approx(np.sqrt(lowest) / (2.0 * np.pi), rel=1e-9)


@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("n", [2, 3, 4, 8])
def test_plastic_tension_and_crushing_turn_about_the_edge_with_the_whole_lever_arm(n, elastic):
    # every point at its strength: force ft A, moment about the edge ft A width / 2, whatever the number of points
    face = on_slab([((0, 0, 0), (0.2, 0.3, 0.5))])
    points = contact_points(face, contact_model="grid", grid=(n, n), elastic=elastic)
    arm = points.position[:, 0] - points.position[:, 0].min()
    assert arm.max() == pytest.approx(0.2, rel=1e-15)
    assert points.area @ arm == pytest.approx(0.06 * 0.1, rel=1e-14)


def test_three_thousand_blocks_on_one_slab_lose_no_contact():
    wall = running_bond(39, 77)
    assert wall.n_blocks == 3042
    assert len(wall.interfaces) == 39 + 2 * 39 * 76 + sum(38 if j % 2 == 0 else 39 for j in range(77))


@pytest.mark.parametrize("step", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
def test_a_face_of_a_thin_piece_is_no_second_contact(step):
    # two blocks that fit with a small step between: the pieces behind the step are as near as the tolerance
    low = [(0, 0), (1, 0), (1, 1), (0.5, 1), (0.5, 1 + step), (0, 1 + step)]
    high = [(0, 1 + step), (0.5, 1 + step), (0.5, 1), (1, 1), (1, 2), (0, 2)]
    wall = lm.Assembly.from_polygons([low, high], thickness=1.0, joint=JOINT, fixed=[0])
    assert sum(i.area for i in wall.interfaces if i.normal[2] > 0.9) == pytest.approx(1.0, abs=1e-5)


def test_a_plane_across_the_units_takes_the_points_across_their_thickness():
    """Out of its own plane a section crushes over its thickness: two points there would bear the whole edge load."""
    crushing = lm.Joint(35.0, compressive_strength=1e5)
    pier = lm.build.column(width=0.4, depth=0.2, unit_height=0.2, courses=8, joint=crushing)
    across = lm.Loads.horizontal(pier, (0.0, 1.0, 0.0))
    points = contact_points(pier, contact_model="grid", grid=(2, 9), plane=find_plane(pier, across))
    assert (np.bincount(points.interface) == 9).all()
    plane, space = (
        lm.limit_analysis(pier, across, contact_model="grid", grid=(2, 9), in_plane=flag).collapse_multiplier
        for flag in (True, False)
    )
    assert plane == pytest.approx(space, rel=1e-6)
    assert plane < 0.1  # 0.125 with two points on the thickness
