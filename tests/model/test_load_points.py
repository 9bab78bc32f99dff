"""Points of application: what loads keep of them, and pressures that grow with depth, by statics."""

from dataclasses import replace

import numpy as np
import pytest

import limitmason as lm
from limitmason import formats
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.figures.canvas import resultant
from limitmason.geometry import box, prism
from limitmason.study.run_fingerprint import fingerprint

HEIGHT, BASE, TOP, LENGTH = 3.0, 1.2, 0.5, 2.0
WATER = 9810.0


def stack(k=3):
    solids = [box((-1, 0, -0.2), (2, 0.3, 0)), *(box((0, 0, 0.3 * i), (0.4, 0.3, 0.3 * i + 0.3)) for i in range(k))]
    return lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0), fixed=[0])


def retaining_wall(friction_deg, courses=1):
    """A wall with a vertical back at x = 0 and a battered face, in courses; the water stands at x < 0."""
    z = np.linspace(0.0, HEIGHT, courses + 1)
    w = BASE - (BASE - TOP) * z / HEIGHT
    blocks = [box((-1, 0, -0.5), (3, LENGTH, 0))]
    for i in range(courses):
        corners = [(0, z[i]), (w[i], z[i]), (w[i + 1], z[i + 1]), (0, z[i + 1])]
        blocks.append(prism(corners, 0.0, LENGTH))
    return lm.Assembly.from_polyhedra(blocks, joint=lm.Joint(friction_deg, dilatancy_angle_deg=friction_deg), fixed=[0])


@pytest.mark.exact
def test_a_point_load_is_its_force_and_moment_for_limit_analysis():
    wall = stack()
    base = lm.Loads.weight(wall)
    force, at = np.array((2e2, 0.0, -5e2)), np.array((0.1, 0.15, 0.85))
    point = base.with_point_load(wall, 3, force, at=at)
    live = np.zeros((4, 6))
    live[3] = [*force, *np.cross(at - wall.centroids[3], force)]
    assert point.live == pytest.approx(live, abs=1e-9)
    by_hand = lm.limit_analysis(wall, lm.Loads(base.dead, live)).collapse_multiplier
    assert lm.limit_analysis(wall, point).collapse_multiplier == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.exact
def test_sums_shares_and_copies_of_loads_keep_their_points():
    wall = stack()
    one = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -1e3), at=(0.1, 0.15, 0.3), case="dead")
    two = lm.Loads.weight(wall).with_point_load(wall, 1, (0, 0, -3e3), at=(0.3, 0.15, 0.1))
    both = one + two.scaled(dead=0.0, live=2.0)
    assert wall.centroids[1] + both.points("live")[1] == pytest.approx((0.3, 0.15, 0.1))
    # of dead forces, weight and load, the centre
    weight = wall.weights[1]
    centre = (weight * wall.centroids[1] + 1e3 * np.array((0.1, 0.15, 0.3))) / (weight + 1e3)
    assert wall.centroids[1] + both.points("dead")[1] == pytest.approx(centre)
    assert both.live[1] == pytest.approx((0, 0, -6e3, 0, 6e3 * 0.1, 0))
    order = [2, 0, 1, 3]
    again = lm.Loads.weight(wall.renumbered(order)).with_point_load(
        wall.renumbered(order), 2, (0, 0, -1e3), at=(0.1, 0.15, 0.3), case="dead"
    )
    assert one.of_blocks(order).dead_arms == pytest.approx(again.dead_arms)
    with pytest.raises(InputError, match="orthogonal"):
        one.transformed(2.0 * np.eye(3))
    with pytest.raises(InputError, match=r"dead_arms must have shape \(4, 3, 3\)"):
        lm.Loads(one.dead, one.live, dead_arms=np.ones((4, 9)))
    with pytest.raises(InputError, match="block number 1 is not finite"):
        lm.Loads(one.dead, one.live, dead_arms=np.where(one.dead_arms, np.nan, 0.0))


def test_files_fingerprints_and_figures_know_the_point(tmp_path):
    wall = stack()
    loads = lm.Loads.weight(wall).with_point_load(wall, 3, (0, 0, -1e3), at=(0.1, 0.15, 0.9))
    formats.write_json(tmp_path / "wall.json", wall, loads)
    _, read = formats.read_json(tmp_path / "wall.json")
    for name in ("dead", "live", "dead_arms", "live_arms"):
        assert np.array_equal(getattr(read, name), getattr(loads, name))
    # a vertical force along its line: the same wrench at another point
    lower = lm.Loads.weight(wall).with_point_load(wall, 3, (0, 0, -1e3), at=(0.1, 0.15, 0.6))
    assert lower.live == pytest.approx(loads.live)
    assert fingerprint(lower) != fingerprint(loads)
    assert fingerprint(read) == fingerprint(loads)
    place, direction = resultant(wall, loads)
    assert place == pytest.approx((0.1, 0.15, 0.9))
    assert direction == pytest.approx((0, 0, -1))


@pytest.mark.exact
@pytest.mark.parametrize("level", [1.0, 3.0, 4.5])
def test_water_presses_with_the_area_of_its_triangle_at_a_third_of_its_depth(level):
    wall = retaining_wall(60.0)
    loads = lm.Loads.weight(wall).with_pressure(wall, 1, face="-x", level=level, unit_weight=WATER, case="live")
    top = min(level, HEIGHT)
    force = WATER * LENGTH * (level * top - top**2 / 2)
    z = WATER * LENGTH * (level * top**2 / 2 - top**3 / 3) / force
    assert loads.live[1, :3] == pytest.approx((force, 0.0, 0.0), abs=1e-6)
    assert wall.centroids[1] + loads.points("live")[1] == pytest.approx((0.0, LENGTH / 2, z))
    patch = [(0, LENGTH, 0), (0, 0, 0), (0, 0, HEIGHT), (0, LENGTH, HEIGHT)]
    parts = retaining_wall(60.0, courses=4)
    spread = lm.Loads.weight(parts).with_patch_pressure(parts, patch, level=level, unit_weight=WATER)
    moment = (np.cross(parts.centroids, spread.live[:, :3]) + spread.live[:, 3:]).sum(axis=0)
    assert spread.live[:, :3].sum(axis=0) == pytest.approx((force, 0.0, 0.0), abs=1e-6)
    assert moment[1] == pytest.approx(force * z)


@pytest.mark.exact
def test_earth_under_a_surcharge_is_a_trapezium():
    """Ka (q + gamma (h - z)): Ka q h + Ka gamma h^2 / 2, turned copy alike on the turned face."""
    wall, ka, q, gamma = retaining_wall(60.0), 0.3, 1e4, 18e3
    given = {"pressure": ka * q, "level": HEIGHT, "unit_weight": ka * gamma}
    loads = lm.Loads.weight(wall).with_pressure(wall, 1, face="-x", case="live", **given)
    even, growing = ka * q * HEIGHT, ka * gamma * HEIGHT**2 / 2
    assert loads.live[1, 0] == pytest.approx(LENGTH * (even + growing))
    z = (even * HEIGHT / 2 + growing * HEIGHT / 3) / (even + growing)
    assert wall.centroids[1, 2] + loads.points("live")[1, 2] == pytest.approx(z)
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    copy = wall.transformed(turn)
    other = lm.Loads.weight(copy).with_pressure(copy, 1, face=tuple(-turn[:, 0]), case="live", **given)
    assert other.live_arms == pytest.approx(loads.transformed(turn).live_arms, abs=1e-6)


@pytest.mark.exact
def test_a_retaining_wall_overturns_and_slides_at_its_closed_forms():
    """About the toe: W x_w = lambda gamma h^3 / 6; along the base: W tan(phi) = lambda gamma h^2 / 2."""
    for friction, slides in ((60.0, False), (20.0, True)):
        wall = retaining_wall(friction)
        weight, lever = wall.weights[1], BASE - wall.centroids[1, 0]
        loads = lm.Loads.weight(wall).with_pressure(wall, 1, face="-x", level=HEIGHT, unit_weight=WATER, case="live")
        overturns = weight * lever / (WATER * LENGTH * HEIGHT**3 / 6)
        along = weight * np.tan(np.deg2rad(friction)) / (WATER * LENGTH * HEIGHT**2 / 2)
        assert (along < overturns) == slides
        assert lm.limit_analysis(wall, loads).collapse_multiplier == pytest.approx(min(overturns, along), rel=1e-6)
    # the level at which it overturns, of water that is dead load: gamma h^3 / 6 = W x_w
    wall = retaining_wall(60.0)
    level = (6.0 * wall.weights[1] * (BASE - wall.centroids[1, 0]) / (WATER * LENGTH)) ** (1 / 3)
    assert level < HEIGHT
    for share, stands in ((0.999, True), (1.001, False)):
        filled = lm.Loads.weight(wall).with_pressure(wall, 1, face="-x", level=share * level, unit_weight=WATER)
        assert lm.stability(wall, filled).stands == stands


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"level": 1.0}, "level and unit_weight go together"),
        ({"level": -1.0, "unit_weight": WATER}, "lies above the level -1 m"),
        ({"level": 1.0, "unit_weight": -1.0}, "unit_weight must be positive"),
        ({"level": 1.0, "unit_weight": WATER, "traction": (1, 0, 0)}, "either pressure or traction"),
        ({"level": float("nan"), "unit_weight": WATER}, "level must be a finite number"),
    ],
)
def test_water_is_read_with_care(given, said):
    wall = retaining_wall(60.0)
    with pytest.raises(InputError, match=said):
        lm.Loads.weight(wall).with_pressure(wall, 1, face="-x", **given)
    if "traction" not in given:
        patch = [(0, LENGTH, 0), (0, 0, 0), (0, 0, HEIGHT), (0, LENGTH, HEIGHT)]
        with pytest.raises(InputError, match=said):
            lm.Loads.weight(wall).with_patch_pressure(wall, patch, **given)


@pytest.mark.exact
def test_an_axle_acts_on_the_extrados():
    arch = lm.build.arch(radius=1.0, thickness=0.3, width=0.5, voussoirs=11, joint=lm.Joint(45.0), angle_deg=150)
    loads = lm.Loads.weight(arch).with_axle(arch, 0.0, 1e4, level=1.3, spread_deg=0.0, contact=0.01)
    (key,) = np.flatnonzero(loads.live.any(axis=1))
    assert arch.centroids[key] + loads.points("live")[key] == pytest.approx((0.0, 0.25, arch.blocks[key].bounds[1, 2]))
    filled = lm.Loads.weight(arch).with_backfill(arch, level=1.5, density=1e3)
    above = filled.points("dead")[2:, :]  # weight and fill: between the centroid and the extrados
    assert (np.einsum("ni,ni->n", above, arch.centroids[2:]) > -1e-9).all()


def test_loads_without_their_live_part_do_not_keep_its_name():
    wall = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=2, joint=lm.Joint(30.0))
    pushed = lm.Loads.horizontal(wall)
    assert pushed.scaled(live=0.0).name == "dead loads"
    assert pushed.scaled(live=0.5).name == pushed.name
    assert lm.Loads.weight(wall).scaled(live=0.0).name == "self weight"


def test_a_block_that_is_named_twice_carries_its_fill_once():
    arch = lm.build.arch(thickness=0.2, width=1.0, voussoirs=7, radius=2.0, joint=lm.Joint(35.0))
    loads = lm.Loads.weight(arch)
    once = loads.with_backfill(arch, 2.5, 1800.0, blocks=["voussoir-2"])
    twice = loads.with_backfill(arch, 2.5, 1800.0, blocks=["voussoir-2", arch.block_index("voussoir-2")])
    assert np.array_equal(once.dead, twice.dead)
    for give in (loads.with_backfill, loads.with_body_force):
        place = (2.5, 1800.0) if give == loads.with_backfill else ((1.0, 0.0, 0.0),)
        with pytest.raises(lm.errors.InputError, match=r"write blocks=\['voussoir-2'\]"):
            give(arch, *place, blocks="voussoir-2")


def test_only_the_direction_of_a_direction_counts_however_long_it_is():
    wall = retaining_wall(60.0)
    plain = lm.Loads.horizontal(wall, (1.0, 0.0, 0.0))
    for size in (1e200, 1e-200):
        assert np.array_equal(lm.Loads.horizontal(wall, (size, 0.0, 0.0)).live, plain.live)
        with pytest.raises(lm.errors.InputError, match="not horizontal"):
            lm.Loads.horizontal(wall, (size, 0.0, size))


def test_corners_of_a_patch_may_repeat_and_a_star_is_no_patch():
    wall = retaining_wall(60.0)
    corners = [(0, LENGTH, 0), (0, 0, 0), (0, 0, HEIGHT), (0, LENGTH, HEIGHT)]
    plain = lm.Loads.weight(wall).with_patch_pressure(wall, corners, pressure=1e3)
    for given in ([corners[0], *corners], [*corners, corners[0]]):
        again = lm.Loads.weight(wall).with_patch_pressure(wall, given, pressure=1e3)
        assert again.live == pytest.approx(plain.live)
    turn = 2.0 * np.deg2rad(72.0) * np.arange(5)
    star = np.column_stack([np.zeros(5), LENGTH / 2 - 0.1 * np.cos(turn), HEIGHT / 2 + 0.1 * np.sin(turn)])
    with pytest.raises(lm.errors.InputError, match="flat convex polygon"):
        lm.Loads.weight(wall).with_patch_pressure(wall, star, pressure=1e3)


T_BLOCK = np.array([(0.4, 0.0), (0.6, 0.0), (0.6, 0.5), (1.0, 0.5), (1.0, 1.0), (0.0, 1.0), (0.0, 0.5), (0.4, 0.5)])
TURNED_T = T_BLOCK[::-1] * (1.0, -1.0) + (0.0, 1.0)


def block_with_notches(outline):
    ground = [(-1.0, -0.3), (2.0, -0.3), (2.0, 0.0), (-1.0, 0.0)]
    return lm.Assembly.from_polygons([ground, outline], thickness=1.0, joint=lm.Joint(35.0), fixed=[0])


def down(loads, assembly):
    return -(loads.dead + loads.live - lm.Loads.weight(assembly).dead)[1, 2]


@pytest.mark.exact
@pytest.mark.parametrize(("outline", "fill"), [(T_BLOCK, 1.0 * 0.5), (TURNED_T, 0.2 * 0.5 + 0.8 * 1.0)])
def test_nothing_presses_between_the_pieces_of_a_block_with_notches(outline, fill):
    # the faces in which two of its pieces join were loaded too: 20 to 30 % too much pressed on it
    model = block_with_notches(outline)
    weight = lm.Loads.weight(model)
    sides = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum() * 1.0
    outer = [np.cross(f[1:-1] - f[0], f[2:] - f[0]).sum(axis=0) / 2 for f in model.blocks[1].outer_faces]
    assert np.linalg.norm(outer, axis=1).sum() == pytest.approx(sides + 2 * model.volumes[1] / 1.0, rel=1e-12)
    assert down(weight.with_backfill(model, 1.5, 1000.0), model) == pytest.approx(1000.0 * GRAVITY * fill)
    assert down(weight.with_pressure(model, 1, pressure=100.0), model) == pytest.approx(100.0)
    assert down(weight.with_pressure(model, 1, pressure=100.0, face="bottom"), model) == pytest.approx(-100.0)
    # an axle that lies wholly above the block: part of it went into the faces between the pieces and was lost
    assert down(weight.with_axle(model, 0.5, 1e3, level=1.1, spread_deg=0.0), model) == pytest.approx(1e3)


@pytest.mark.exact
def test_a_patch_over_the_shoulders_of_a_block_presses_beside_its_neck():
    model = block_with_notches(TURNED_T)
    shoulders = [(0.0, 0.0, 0.5), (1.0, 0.0, 0.5), (1.0, 1.0, 0.5), (0.0, 1.0, 0.5)]
    pressed = lm.Loads.weight(model).with_patch_pressure(model, shoulders, pressure=100.0)
    assert down(pressed, model) == pytest.approx(80.0)


def test_a_patch_loads_the_faces_that_a_drawing_leaves_a_hair_behind_its_plane():
    # 0.01 mm, a tenth of the tolerance of contacts: the face was left out and a third of the pressure lost
    stones = [box((0, y, k), (1, 1 + y, k + 1)) for k, y in enumerate((0.0, 0.0, 1e-5))]
    model = lm.Assembly.from_polyhedra(stones, joint=lm.Joint(35.0), fixed=[0])
    patch = [(0, 0, 0), (1, 0, 0), (1, 0, 3), (0, 0, 3)]
    pressed = lm.Loads.weight(model).with_patch_pressure(model, patch, pressure=100.0)
    assert pressed.live[:, 1] == pytest.approx([100.0, 100.0, 100.0])


def test_loads_are_called_by_what_the_multiplier_scales():
    """A pushed pier was "self weight" in reports and on the axes of a region."""
    wall = lm.build.column(width=0.4, depth=0.3, unit_height=0.3, courses=2, joint=lm.Joint(35.0))
    weight, down = lm.Loads.weight(wall), (0.0, 0.0, -1.0)
    pushed = weight.with_point_load(wall, 2, down)
    assert pushed.name == "point load on column-2"
    assert weight.with_point_load(wall, 2, down, case="dead").name == "self weight"
    assert lm.Loads.horizontal(wall).scaled(live=0.0).with_body_force(wall, (0, 1, 0)).name == "body force"
    assert weight.with_axle(wall, 0.2, 1e3, level=0.7).name == "axle at x = 0.2 m"
    more = pushed.with_pressure(wall, 1, pressure=1e3, face="-x", case="live").with_point_load(wall, 1, down)
    assert more.name == "point load on column-2 and others"
    named = replace(weight, name="left").with_point_load(wall, 2, down)
    assert named.name == "left"
