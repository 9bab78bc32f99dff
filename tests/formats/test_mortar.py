"""Irregular stones with open mortar joints: planted subdivisions come back, and laws that hold for any drawing."""

import math

import numpy as np
import pytest

import limitmason as lm
from limitmason import formats
from limitmason.formats.drawing import model_of_drawing

shapely = pytest.importorskip("shapely")
ezdxf = pytest.importorskip("ezdxf")

MORTAR, GAP = 0.012, 0.001
LENGTH, HEIGHT = 3.0, 2.0


def ring(polygon):
    return np.array(shapely.geometry.polygon.orient(polygon).exterior.coords[:-1])


def rubble(seed, count=62, uneven=0.0, mortar=MORTAR):
    """Convex cells that fill a wall, and the stones in them: every side is set back by half a joint, or less, askew."""
    rng = np.random.default_rng(seed)
    nx = round(math.sqrt(count * LENGTH / HEIGHT))
    ny = math.ceil(count / nx)
    size = np.array([LENGTH / nx, HEIGHT / ny])
    seeds = np.array([[i + 0.35 + 0.3 * (j % 2), j + 0.5] for j in range(ny) for i in range(nx)])[:count]
    seeds = (seeds + rng.uniform(-0.3, 0.3, seeds.shape)) * size
    wall = shapely.box(0.0, 0.0, LENGTH, HEIGHT)
    found = shapely.get_parts(shapely.voronoi_polygons(shapely.multipoints(seeds), extend_to=wall.buffer(5.0)))
    cells = [c.intersection(wall) for c in found]
    stones = []
    for cell in cells:
        stone, corners = cell, ring(cell)
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            inward = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
            p, q = (c + 0.5 * mortar * (1.0 - uneven * rng.uniform()) * inward for c in (a, b))
            t = (q - p) / np.linalg.norm(q - p)
            n = np.array([-t[1], t[0]])
            half = [p - 9.0 * t, p + 9.0 * t, p + 9.0 * (t + n), p + 9.0 * (n - t)]
            stone = stone.intersection(shapely.Polygon(half))
        stones.append(stone)
    return cells, stones


def check(stones, cleaned, mortar=MORTAR):
    """What holds for any drawing of stones that do not overlap."""
    grown = [shapely.Polygon(o) for o in cleaned.outlines]
    assert len(grown) == len(stones)
    assert all(p.is_valid for p in grown)
    size = sum(p.area for p in grown)
    for stone, own in zip(stones, grown, strict=True):
        assert own.intersection(stone).area == pytest.approx(stone.area, rel=1e-9)
    # no overlap: the areas add up to that of all together, which is that of the stones closed over their joints
    whole = shapely.union_all(grown)
    assert size == pytest.approx(whole.area, rel=1e-9)
    closed = shapely.union_all(stones)
    for by in (1.0, -1.0):
        closed = closed.buffer(by * (0.5 * mortar + GAP), join_style="mitre")
    assert closed.difference(whole).area < 1e-9 * size
    assert whole.area < closed.area + len(stones) * (2.0 * mortar) ** 2
    for i, a in enumerate(stones):
        for j in range(i):
            apart = a.distance(stones[j])
            if 0.0 < apart <= mortar:
                across = shapely.shortest_line(a, stones[j])
                shielded = any(k not in (i, j) and s.distance(across) < 0.75 * apart for k, s in enumerate(stones))
                assert shielded or grown[i].distance(grown[j]) < 1e-9
    assert cleaned.alone == ()
    assert cleaned.overlaps == ()
    return grown


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_cells_set_back_by_half_a_joint_come_back(seed):
    cells, stones = rubble(seed)
    cleaned = formats.clean([ring(s) for s in stones], GAP, mortar=MORTAR)
    grown = check(stones, cleaned)
    inner = shapely.box(0.0, 0.0, LENGTH, HEIGHT).buffer(-0.5 * MORTAR, join_style="mitre")
    # apart from sides shorter than the joint, which setting back takes away
    for cell, own in zip(cells, grown, strict=True):
        assert own.symmetric_difference(cell.intersection(inner)).area < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_joints_of_uneven_thickness_are_parted_without_overlap_or_loss(seed):
    _, stones = rubble(seed, uneven=0.9)
    check(stones, formats.clean([ring(s) for s in stones], GAP, mortar=MORTAR))


@pytest.mark.slow
def test_turned_renumbered_and_scaled_drawing_is_the_same_wall():
    _, stones = rubble(5, 20, uneven=0.9)
    first = formats.clean([ring(s) for s in stones], GAP, mortar=MORTAR).outlines
    c, s, order = math.cos(0.7), math.sin(0.7), np.random.default_rng(1).permutation(20)
    for size in (1.0, 1e-3, 1e3):
        turn = size * np.array([[c, s], [-s, c]])
        moved = [ring(stones[k]) @ turn + size * 10.0 for k in order]
        again = formats.clean(moved, size * GAP, mortar=size * MORTAR).outlines
        for k, own in zip(order, again, strict=True):
            same = shapely.Polygon(first[k] @ turn + size * 10.0)
            assert shapely.Polygon(own).symmetric_difference(same).area < 1e-7 * same.area


def test_two_squares_and_a_pentagon():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    roof = np.array([[0.0, 1.01], [2.01, 1.01], [2.01, 1.5], [1.0, 2.0], [0.0, 1.5]])
    cleaned = formats.clean([square, square + [1.01, 0.0], roof], GAP, mortar=0.01)
    assert cleaned.outlines[0].max(axis=0) == pytest.approx([1.005, 1.005])
    assert cleaned.outlines[1].min(axis=0) == pytest.approx([1.005, 0.0])
    assert cleaned.outlines[2].min(axis=0) == pytest.approx([0.0, 1.005])


def test_wedge_of_mortar_is_parted_by_its_bisector():
    # sides at 0 and at the angle of 8 mm over 1 m: they meet on half that angle
    low = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, -0.5], [0.0, -0.5]])[::-1]
    high = np.array([[0.0, 0.002], [1.0, 0.010], [1.0, 0.5], [0.0, 0.5]])
    bottom, top = formats.clean([low, high], GAP, mortar=MORTAR).outlines
    half = math.tan(0.5 * math.atan(0.008))
    for outline in (bottom, top):
        for x, z in outline:
            if abs(z) < 0.1:
                assert z == pytest.approx(half * (x + 0.25), abs=1e-6 + 1e-4 * (x < 1e-9 or x > 1.0 - 1e-9))


def test_stones_that_overlap_share_what_they_have_in_common():
    a = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    one, two = (shapely.Polygon(o) for o in formats.clean([a, a + [0.99, 0.0]], GAP, mortar=MORTAR).outlines)
    assert one.area == pytest.approx(0.995, abs=1e-4)
    assert two.area == pytest.approx(0.995, abs=1e-4)
    assert one.intersection(two).area < 1e-12


def test_hollow_and_round_stones_keep_their_shape():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.4], [0.4, 0.4], [0.4, 1.0], [0.0, 1.0]])
    angle = np.linspace(0.0, 2.0 * math.pi, 80, endpoint=False)
    ball = 0.705 + 0.295 * np.column_stack([np.cos(angle), np.sin(angle)])
    stones = [shapely.Polygon(corner), shapely.Polygon(ball)]
    check(stones, formats.clean([corner, ball], GAP, mortar=MORTAR))


def test_stone_within_another_is_named():
    a = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    with pytest.raises(lm.errors.InputError, match="stone 2"):
        formats.clean([a, 0.3 * a + 0.3], GAP, mortar=MORTAR)


@pytest.mark.slow
def test_rubble_with_mortar_is_a_wall_whose_joints_are_what_its_stones_share(tmp_path, recwarn):
    _, stones = rubble(2, 30, uneven=0.5)
    drawing = ezdxf.new(units=6)
    for k, stone in enumerate(stones):
        drawing.modelspace().add_lwpolyline(ring(stone).tolist(), close=True, dxfattribs={"layer": f"row {k % 3}"})
    drawing.saveas(tmp_path / "facade.dxf")
    found = model_of_drawing(tmp_path / "facade.dxf", joint=lm.Joint(33.0), thickness=0.4, mortar=MORTAR)
    grown = [shapely.Polygon(o) for o in found.cleaned.outlines]
    shared = 0.5 * (sum(p.length for p in grown) - shapely.union_all(grown, grid_size=1e-7).length)
    assert len(found.assembly.blocks) == 30
    # sides shorter than the tolerance of contacts are no joints
    assert sum(i.area for i in found.assembly.interfaces) == pytest.approx(0.4 * shared, rel=2e-3)
    assert not [w for w in recwarn if issubclass(w.category, lm.ContactWarning)]
    assert "half a mortar joint" in str(found.cleaned)


def test_stones_that_share_a_corner_line_but_for_rounding_do_not_overlap():
    # of these two GEOS gives all of the first as their common area
    first = [(-0.06274242731208328, -0.18082466541074138), (0.059794912177282486, -0.061295779171435874),
             (-0.00012349341835918724, -2.1713425652464034e-05), (-0.12267350934609686, -0.11959809234618932)]
    second = [(-0.0015104672235733627, -0.12109603067680083), (-0.12416278044688961, -0.24073706789329535),
              (-0.06428383783835406, -0.30199171831970445), (0.058296229494101556, -0.18241899415740434)]
    cleaned = formats.clean([first, second], 1e-4)
    assert len(cleaned.outlines) == 2
    assert cleaned.overlaps == ()


@pytest.mark.parametrize("error", [1e-7, 1e-6, 1e-5, 1e-4])
def test_corners_off_by_rounding_leave_the_joints_their_area(error):
    # joints that are shared out have steps of the error of the corners: thin pieces, of which some enclose nothing
    rng = np.random.default_rng(1)
    stones = [(0, 0.59, 0, 0.29), (0.6, 1.19, 0, 0.29), (0, 0.29, 0.3, 0.59), (0.3, 0.89, 0.3, 0.59)]
    drawn = [np.array([(a, c), (b, c), (b, d), (a, d)]) + rng.uniform(-error, error, (4, 2)) for a, b, c, d in stones]
    cleaned = formats.clean(drawn, 1e-3, mortar=0.01)
    wall = lm.Assembly.from_polygons(
        cleaned.outlines, thickness=1.0, joint=lm.Joint(30.0), angle_tolerance_deg=0.05, wedge_tolerance_deg=0.0
    )
    # two head joints, and the bed over the length that both courses have
    assert sum(i.area for i in wall.interfaces) == pytest.approx(0.295 + 0.295 + 0.89, abs=0.01)
