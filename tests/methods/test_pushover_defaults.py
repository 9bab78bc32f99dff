"""What a path promises by default: sections that crush or crack to 2 %, bonds that end, ways back, one model."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.capacity import contacts
from limitmason.capacity.contacts import standard_points
from limitmason.capacity.outcomes import PathEnd
from limitmason.capacity.step_length import bend
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import contact_points

WIDTH, DEPTH, HEIGHT = 0.3, 0.2, 1.0
WEIGHT = 2000.0 * 9.81 * WIDTH * DEPTH * HEIGHT
STIFF = {"normal_stiffness": 1e10, "shear_stiffness": 1e10}
AREA = WIDTH * DEPTH


def prism(low, high, angle):
    """A box turned about the vertical axis."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = np.array([(x, y, z) for z in (z0, z1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))], dtype=float)
    c, s = math.cos(angle), math.sin(angle)
    corners[:, :2] = corners[:, :2] @ np.array([[c, s], [-s, c]])
    sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
    return corners, [[3, 2, 1, 0], [4, 5, 6, 7], *sides]


def block(joint, *, space=False, angle=0.0, density=2000.0):
    """A block on its base, in plane or in space and turned."""
    joint = lm.Joint(60.0, **joint)
    if space:
        solids = [
            prism((-1, -1, -0.3), (1, 1, 0), angle),
            prism((-WIDTH / 2, -DEPTH / 2, 0), (WIDTH / 2, DEPTH / 2, HEIGHT), angle),
        ]
        return lm.Assembly.from_polyhedra(solids, joint=joint, density=density, fixed=["g"], names=["g", "b"])
    base = [(-1, -0.2), (1, -0.2), (1, 0), (-1, 0)]
    upper = [(-WIDTH / 2, 0), (WIDTH / 2, 0), (WIDTH / 2, HEIGHT), (-WIDTH / 2, HEIGHT)]
    return lm.Assembly.from_polygons(
        [base, upper], thickness=DEPTH, joint=joint, density=density, fixed=["g"], names=["g", "b"]
    )


@pytest.mark.parametrize("share", [0.1, 0.3, 0.45, 0.6])
@pytest.mark.parametrize(("space", "angle", "across"), [(False, 0.0, False), (True, 0.4, False), (True, 0.4, True)])
def test_a_crushing_toe_bears_what_its_stress_block_does(share, space, angle, across):
    """The resultant is half of W / (fc t) from the edge: lambda = (b / h)(1 - W / (fc A))."""
    joint = {"compressive_strength": WEIGHT / (share * AREA), "normal_stiffness": 1e12, "shear_stiffness": 1e12}
    wall = block(joint, space=space, angle=angle)
    way = angle + (math.pi / 2 if across else 0.0)
    loads = lm.Loads.horizontal(wall, (math.cos(way), math.sin(way), 0.0))
    found = lm.predict(wall, loads, "pushover")
    assert found.status == "solved"
    exact = (DEPTH if across else WIDTH) / HEIGHT * (1.0 - share)
    assert found.collapse_multiplier == pytest.approx(exact, rel=0.02)


BRITTLE = {"residual_tensile_strength": 0.0, "residual_cohesion": 0.0}


def test_a_brittle_cantilever_bears_its_first_crack():
    """M = (ft + W / A) A b / 6; what is left of the section then bears less."""
    wall = block({"cohesion": 8e5, "tensile_strength": 2e5, **BRITTLE, **STIFF})
    loads = lm.Loads.horizontal(wall)
    exact = (2e5 + WEIGHT / AREA) * AREA * WIDTH / 6.0 / (WEIGHT * HEIGHT / 2.0)
    assert lm.elastic_range(wall, loads).high.multiplier == pytest.approx(exact, rel=1e-9)
    assert lm.predict(wall, loads, "pushover").collapse_multiplier == pytest.approx(exact, rel=0.02)


def cohesive_moment(strength, energy, stiffness):
    """Largest moment of a section of 400 fibres that turns as a whole; tension falls linearly to 2 Gf / ft [N m].

    The neutral axis is prescribed, and the turn found, which keeps to the branch on which the crack grows.
    """
    x = ((np.arange(400) + 0.5) / 400 - 0.5) * WIDTH
    elastic, end = strength / stiffness, 2.0 * energy / strength

    def tension(opening):
        falling = strength * np.maximum(end - opening, 0.0) / (end - elastic)
        return np.where(opening < elastic, stiffness * opening, falling)

    def moment(turn):
        middle = np.linspace(-0.5, 0.5, 4001) * WIDTH * turn
        pull = tension(middle[:, None] + turn * x).mean(axis=1) * AREA + WEIGHT
        at = np.flatnonzero(np.diff(np.sign(pull)) != 0)
        return max(float((tension(middle[k] + turn * x) * x).mean() * AREA) for k in at) if len(at) else 0.0

    return max(moment(turn) for turn in np.linspace(0.5, 6.0, 111) * elastic / WIDTH)


@pytest.mark.slow
@pytest.mark.parametrize("energy", [3.0, 8.0])
@pytest.mark.parametrize("grid", [None, (21, 2)])
def test_a_cohesive_crack_opens_at_the_load_of_its_section(energy, grid):
    """Steps do not leap over the largest load, on any points."""
    wall = block({"cohesion": 8e5, "tensile_strength": 2e5, "fracture_energy_tension": energy, **BRITTLE, **STIFF})
    exact = cohesive_moment(2e5, energy, 1e10) / (WEIGHT * HEIGHT / 2.0)
    found = lm.predict(wall, lm.Loads.horizontal(wall), "pushover", **({} if grid is None else {"grid": grid}))
    assert found.collapse_multiplier == pytest.approx(exact, rel=0.02)


def test_fewer_points_for_many_joints_are_told(monkeypatch):
    wall = block({"compressive_strength": 1e6, **STIFF}, space=True)
    assert standard_points(wall, None) == ("lobatto", (15, 15), ())
    monkeypatch.setattr(contacts, "_MANY", 60)
    model, grid, said = standard_points(wall, None)
    assert (model, grid) == ("lobatto", (7, 7))
    assert "7 points on a side" in said[0]
    assert said[0] in lm.pushover(wall, lm.Loads.horizontal(wall, (1.0, 0.3, 0.0)), to=1e-6).warnings


def test_lobatto_points_have_the_area_and_the_second_moment_of_their_face():
    wall = block({"compressive_strength": 1e6, **STIFF}, space=True, angle=0.3)
    p = contact_points(wall, contact_model="lobatto", grid=(9, 7))
    along = p.position @ np.array([math.cos(0.3), math.sin(0.3), 0.0])
    assert p.count == 63
    assert p.area.sum() == pytest.approx(AREA, rel=1e-12)
    assert (p.area * along**2).sum() == pytest.approx(DEPTH * WIDTH**3 / 12.0, rel=1e-12)
    assert along.max() == pytest.approx(WIDTH / 2.0, rel=1e-12)


@pytest.mark.parametrize(("grid", "told"), [(None, True), ((3, 2), True), ((4, 2), True), ((15, 2), False)])
def test_points_that_bear_on_the_edge_alone_say_how_much_a_face_would_lose_at_its_toe(grid, told):
    """lambda (theta) = tan(alpha - theta), b less two thirds of the pressed length sqrt(2 W / (kn t theta))."""
    kn = 2e9
    wall = block({"normal_stiffness": kn, "shear_stiffness": kn})
    turns = np.geomspace(1e-4, 0.2, 20001)
    pressed = np.sqrt(2.0 * WEIGHT / (kn * DEPTH * turns))
    turns, pressed = turns[pressed < WIDTH], pressed[pressed < WIDTH]
    exact = np.tan(np.arctan((WIDTH - 2.0 * pressed / 3.0) / HEIGHT) - turns).max()
    curve = lm.pushover(
        wall, lm.Loads.horizontal(wall), to=0.05, **({} if grid is None else {"contact_model": "lobatto", "grid": grid})
    )
    said = re.search(r"would bear about ([\d.]+)% less", " ".join(curve.warnings))
    assert (said is not None) == told
    if said is not None:
        assert float(said[1]) / 100.0 == pytest.approx(1.0 - exact / curve.peak.load, rel=0.25)
    else:
        assert curve.peak.load == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("kn", [3e8, 1e9, 3e9])
@pytest.mark.parametrize("direction", [(1.0, 0.3, 0.0), (1.0, 1.0, 0.0)])
def test_points_of_glued_joints_in_space_bear_what_a_face_bears_where_a_block_rocks_on_its_corner(kn, direction):
    """Beside a path on so many points that they are a face; 5 x 5 even points bore 8 to 13 % more."""
    wall = block({"normal_stiffness": kn, "shear_stiffness": kn, "cohesion": 100.0}, space=True)
    loads = lm.Loads.horizontal(wall, direction)
    curve = lm.pushover(wall, loads, to=0.05)
    face = lm.pushover(wall, loads, to=0.05, contact_model="lobatto", grid=(21, 21))
    assert len(curve.nodes[0].force) == 49
    assert curve.peak.load == pytest.approx(face.peak.load, rel=0.02)
    assert "would bear" not in " ".join(curve.warnings)


@pytest.mark.parametrize("cohesion", [8e5, 8e6])
def test_a_path_ends_where_open_joints_still_bear_their_plastic_bond(cohesion):
    """ft A b / 2 + W b / 2 at the toe and no more: cohesion of the open heel is none of the section's strength."""
    wall = block({"cohesion": cohesion, "tensile_strength": 2e5, **STIFF})
    loads = lm.Loads.horizontal(wall)
    exact = (2e5 * AREA + WEIGHT) * WIDTH / (WEIGHT * HEIGHT)
    curve = lm.pushover(wall, loads)
    assert curve.status == PathEnd.OPENED
    assert "the joint between 'g' and 'b' is open by" in curve.warnings[0]
    assert curve.peak.load == pytest.approx(exact, rel=5e-3)
    assert lm.predict(wall, loads, "pushover").collapse_multiplier == pytest.approx(exact, rel=1e-3)


def test_a_rocking_block_goes_back_along_its_branch_and_over_to_the_other_side():
    """|lambda| = tan(alpha - |theta|) both ways."""
    wall = block(STIFF)
    loads = lm.Loads.horizontal(wall)
    there = lm.pushover(wall, loads, to=0.03)
    back = lm.pushover(wall, loads, to=-0.03, start=there)
    assert (there.status, back.status) == (PathEnd.REACHED, PathEnd.REACHED)
    assert back.displacement[-1] == pytest.approx(-0.03)
    turn = np.array([s.turn[1] for s in back.states])
    theta = np.arctan2(turn[:, 0, 2], 1.0 + turn[:, 0, 0])
    rocks = np.abs(theta) > 1e-3
    assert rocks.sum() > 6
    expected = np.sign(theta) * np.tan(math.atan(WIDTH / HEIGHT) - np.abs(theta))
    assert back.load[rocks] == pytest.approx(expected[rocks], abs=1e-6)


def test_a_state_goes_on_under_its_own_model_only():
    wall = block({"cohesion": 1e3, **STIFF})
    loads = lm.Loads.horizontal(wall)
    there = lm.pushover(wall, loads, to=1e-6)

    def refused(other, **options):
        with pytest.raises(InputError, match="start is .*another model") as error:
            lm.pushover(other, lm.Loads.horizontal(other), to=2e-6, start=there, **options)
        return str(error.value)

    for field, value in (("friction_angle_deg", 20.0), ("cohesion", 5e3), ("compressive_strength", 1e7)):
        said = refused(wall.with_joints(lambda j, f=field, v=value: replace(j, **{f: v})))
        assert f"the joint between 'g' and 'b' has another {field}" in said
        assert f"now ({value:g})" in said
    held = replace(wall, supports=(*wall.supports, lm.Support("b", dofs=("ry",))))
    assert "block 'b' has another support" in refused(held)
    heavy = replace(wall, blocks=(wall.blocks[0], replace(wall.blocks[1], density=500.0)))
    assert "block 'b' has another density" in refused(heavy)
    rod = lm.Tie("b", (0.0, 0.1, 0.9), None, (-0.9, 0.1, 0.9), yield_force=1e3, stiffness=1e5)
    assert "it has 1 ties and had 0" in refused(wall.with_ties([rod]))
    assert "kn" in refused(wall, stiffness=2e10)
    # an equal model that was built anew is the same
    assert lm.pushover(block({"cohesion": 1e3, **STIFF}), loads, to=2e-6, start=there).status == PathEnd.REACHED


@pytest.mark.parametrize("blocks", ["simply deformable", "ritz"])
def test_displacements_of_centroids_are_those_of_centroids_where_blocks_bend(blocks):
    """A bent block's mean lies beside its centroid: path and superposition agree at the centroid as at any point."""
    wall = block({"cohesion": 1e9, "tensile_strength": 1e9, "lost_by": "nothing", **STIFF}, density=100.0)
    wall = wall.with_material(lm.Material(young_modulus=1e8, poisson_ratio=0.2))
    loads = lm.Loads.weight(wall).with_point_load(wall, "b", (1.0, 0.0, 0.0), at=(0.0, DEPTH / 2.0, HEIGHT))
    options = {"blocks": blocks, "contact_model": "grid", "grid": (5, 5)}
    curve = lm.pushover(wall, loads, to=1e-7, **options)
    place = wall.centroids[1]
    moved = np.diff(curve.displacement_of("b", at=place)[[0, -1]], axis=0)[0] / curve.load[-1]
    mean = (curve.nodes[-1].pose.shift[1] - curve.nodes[0].pose.shift[1]) / curve.load[-1]
    assert abs(mean[0] - moved[0]) > 1e-3 * abs(moved[0])
    assert lm.elastic_range(wall, loads, **options).shift_live[1] == pytest.approx(moved, rel=1e-4, abs=1e-3 * moved[0])
    assert curve.displacement_of("b") == pytest.approx(curve.displacement_of("b", at=place))


def test_modes_about_a_plane_path_say_what_they_leave_out():
    wall = block(STIFF)
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), to=1e-6)
    said = curve.vibration().warnings
    assert any("only modes in this plane" in w for w in said)
    assert any("two points on a side" in w for w in said)
    fine = lm.pushover(wall, lm.Loads.horizontal(wall), to=1e-6, grid=(5, 5))
    assert not any("two points on a side" in w for w in fine.vibration().warnings)
    # three times the bending stiffness: rocking on the joint's springs is sqrt(3) times too fast
    spin = wall.arrays.inertia[1][1, 1] + wall.arrays.mass[1] * (HEIGHT / 2.0) ** 2
    lowest = math.sqrt(1e10 * DEPTH * WIDTH**3 / 12.0 / spin) / (2.0 * math.pi)
    assert lm.modes(fine, 1).frequency[0] == pytest.approx(lowest, rel=0.03)


def test_few_points_that_are_given_are_told_of_where_joints_lose_strength():
    wall = block({"cohesion": 8e5, "tensile_strength": 2e5, **BRITTLE, **STIFF})
    loads = lm.Loads.horizontal(wall)
    for few in ({"contact_model": "vertices"}, {"grid": (3, 3)}, {"grid": 0.25}):
        told = lm.pushover(wall, loads, to=1e-6, **few).warnings
        assert any("few contact points given" in w for w in told), few
    assert any("few contact points given" in w for w in dem.initial_state(wall, loads, contact_points=(2, 2)).warnings)
    assert not any("few" in w for w in lm.pushover(wall, loads, to=1e-6, grid=(9, 5)).warnings)


def test_a_spacing_that_was_meant_as_a_number_of_points_is_refused():
    with pytest.raises(InputError, match=r"spacing of points \[m\], more than the longest joint, 0.3 m"):
        lm.pushover(block(STIFF), lm.Loads.horizontal(block(STIFF)), grid=5)


def test_distinct_elements_say_that_their_default_points_are_few():
    wall = block({"cohesion": 8e5, "tensile_strength": 2e5, **BRITTLE, **STIFF})
    loads = lm.Loads.horizontal(wall)
    assert any("few contact points" in w for w in dem.initial_state(wall, loads).warnings)
    fine = dem.initial_state(wall, loads, contact_model="lobatto", contact_points=(15, 2))
    assert not any("few contact points" in w for w in fine.warnings)
    assert not any("few" in w for w in dem.initial_state(block(STIFF), loads).warnings)
    # the spacing that a push takes is none that was given, and is told of once
    curve = dem.push(wall, dem.Drive({wall.blocks[-1].name: {"x": 1.0}}), to=1e-7, steps=2000)
    (told,) = (w for w in curve.warnings if "few contact points" in w)
    assert "of the default" in told


def test_tension_above_the_apex_is_told_where_it_is_taken():
    """Limit analysis cuts ft at c / tan(phi), a path and the DEM do not: their loads differ by what the joint bears."""
    wall = block({"cohesion": 1e4, "tensile_strength": 2e5, **STIFF})
    loads = lm.Loads.horizontal(wall)
    cut = lm.limit_analysis(wall, loads)
    taken = lm.predict(wall, loads, "pushover", stiffness=1e12)
    apex = 1e4 / math.tan(math.radians(60.0))
    for found, tension in ((cut, apex), (taken, 2e5)):
        assert found.collapse_multiplier == pytest.approx(
            (tension * AREA + WEIGHT) * WIDTH / (WEIGHT * HEIGHT), rel=0.01
        )
    assert any("cut at the apex" in w for w in cut.warnings)
    assert sum("taken beyond the apex of the Coulomb cone in 1 of 1 joints" in w for w in taken.warnings) == 1
    assert not any("apex" in w for w in lm.pushover(block(STIFF), loads, to=1e-6).warnings)


def pile(order, matrix):
    """Three boxes on the ground, glued and pulled beside their middle, renumbered and in other axes."""
    ends = [
        (-1, -1, -0.2, 1, 1, 0),
        (0, 0, 0, 0.4, 0.3, 0.3),
        (0.05, 0, 0.3, 0.45, 0.3, 0.6),
        (0, 0.02, 0.6, 0.4, 0.32, 0.9),
    ]
    solids = [prism(e[:3], e[3:], 0.0) for e in ends]
    flip = np.linalg.det(matrix) < 0
    solids = [(p @ matrix.T, [f[::-1] for f in faces] if flip else faces) for p, faces in solids]
    names = ["g", "low", "mid", "top"]
    joint = lm.Joint(30.0, cohesion=4e3, tensile_strength=2e3, normal_stiffness=2e8, shear_stiffness=1e8)
    wall = lm.Assembly.from_polyhedra(
        [solids[k] for k in order], joint=joint, density=2000.0, fixed=["g"], names=[names[k] for k in order]
    )
    dead, live = np.zeros((4, 6)), np.zeros((4, 6))
    for k, name in enumerate(wall.blocks):
        dead[k, :3] = wall.weights[k] * (matrix @ [0.0, 0.0, -1.0]) * (name.name != "g")
        if name.name == "top":
            live[k, :3] = 1e3 * matrix @ [1.0, 0.3, 0.0]
            live[k, 3:] = 1e2 * np.linalg.det(matrix) * matrix @ [0.0, 0.0, 1.0]
    return wall, lm.Loads(dead, live)


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"to": 0.03}, {"to": 1e-3, "blocks": "simply deformable", "grid": (3, 3)}])
def test_a_curve_is_that_of_its_renumbered_mirrored_and_turned_copy(options):
    """Blocks slide far on the points of a grid, whose frame one of both carries: by geometry, not by number."""
    material = lm.Material(young_modulus=2e8, poisson_ratio=0.2)

    def curve(order, matrix):
        wall, loads = pile(order, matrix)
        return lm.pushover(wall.with_material(material), loads, **options)

    first = curve(range(4), np.eye(3))
    c, s = math.cos(0.4), math.sin(0.4)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for order, matrix in (((3, 1, 2, 0), np.eye(3)), ((0, 1, 2, 3), np.diag([1.0, -1.0, 1.0])), ((2, 3, 0, 1), turned)):
        other = curve(order, matrix)
        assert other.status == first.status
        assert other.peak.load == pytest.approx(first.peak.load, rel=1e-6)
        share = np.linspace(0.05, 1.0, 7) * first.displacement[-1]
        assert other.displacement[-1] == pytest.approx(first.displacement[-1], rel=1e-9)
        assert np.interp(share, other.displacement, other.load) == pytest.approx(
            np.interp(share, first.displacement, first.load), rel=1e-6
        )


def told(curve):
    """Part of the load that a curve says is lost at the edges of its joints; 0 where it says nothing."""
    said = [w for w in curve.warnings if "blocks rock on the ends of their joints" in w]
    return float(said[0].split("about ")[1].split("%")[0]) / 100.0 if said else 0.0


@pytest.mark.parametrize("stiffness", [1e9, 1e10])
@pytest.mark.parametrize("space", [False, True])
def test_corners_say_what_faces_that_give_way_at_the_edge_would_bear_less(stiffness, space):
    """The force stands x / 3 inside, x = sqrt(2 N / (kn d theta)), and theta h / 2 nearer to the edge."""
    wall = block({"normal_stiffness": stiffness, "shear_stiffness": stiffness}, space=space, angle=0.4)
    way = (math.cos(0.4), math.sin(0.4), 0.0) if space else (1.0, 0.0, 0.0)
    theta = np.geomspace(1e-4, 0.2, 20_000)
    inside = np.sqrt(2.0 * WEIGHT / (stiffness * DEPTH * theta)) / 3.0
    exact = 1.0 - ((WIDTH / 2.0 - inside) / (HEIGHT / 2.0) - theta).max() / (WIDTH / HEIGHT)
    assert told(lm.pushover(wall, lm.Loads.horizontal(wall, way))) == pytest.approx(exact, rel=0.1)


FEW = "turn up to (.*) times as stiffly as their faces"


@pytest.mark.parametrize(("sides", "times"), [(3, 4.0), (4, 3.0), (6, 2.4)])
@pytest.mark.parametrize("points", [{}, {"contact_model": "lobatto", "grid": (3, 3)}])
def test_two_points_on_a_side_say_how_much_more_stiffly_they_turn_than_faces(sides, times, points):
    """The foot of a column of regular prisms turns by M / (kn I), I = A (6 r^2 - s^2) / 24 of its face."""
    radius, height, count, kn = 0.2, 0.3, 3, 1e11
    at = 2.0 * math.pi * np.arange(sides) / sides
    ring = radius * np.column_stack([np.cos(at), np.sin(at)])
    around = [[k, (k + 1) % sides, (k + 1) % sides + sides, k + sides] for k in range(sides)]
    faces = [[*range(sides)][::-1], [*range(sides, 2 * sides)], *around]

    def course(k):
        return np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (height * k, height * (k + 1))]), faces

    joint = lm.Joint(40.0, normal_stiffness=kn, shear_stiffness=kn)
    column = lm.Assembly.from_polyhedra([course(k) for k in range(count + 1)], joint=joint, density=2000.0, fixed=[0])
    curve = lm.pushover(column, lm.Loads.horizontal(column, (1.0, 0.2, 0.0)), to=1e-8, contacts="first", **points)
    side, area = 2.0 * radius * math.sin(math.pi / sides), sides * radius**2 * math.sin(2.0 * math.pi / sides) / 2.0
    second = area * (6.0 * radius**2 - side**2) / 24.0
    moment = curve.load[-1] * 2000.0 * 9.81 * area * count * height * count * height / 2.0
    turned = np.linalg.norm(curve.states[-1].turn[1] - curve.states[0].turn[1]) / math.sqrt(2.0)
    told = [re.search(FEW, w) for w in curve.warnings if "two points on a side" in w]
    stiffer = float(told[0][1]) if told else 1.0
    assert stiffer == pytest.approx(times if not points else 1.0)
    assert turned * kn * second * stiffer == pytest.approx(moment, rel=1e-4)


def test_corners_say_nothing_of_edges_where_nothing_is_lost_there():
    stiff, slides = block({"normal_stiffness": 1e13, "shear_stiffness": 1e13}), lm.Joint(10.0, normal_stiffness=1e9)
    for wall in (stiff, block(STIFF).with_joints(lambda _: slides), block({})):
        assert told(lm.pushover(wall, lm.Loads.horizontal(wall))) == 0.0
    soft = block(STIFF)
    loads = lm.Loads.horizontal(soft)
    assert told(lm.predict(soft, loads, "pushover")) > 0.04
    for options in ({"grid": (9, 2)}, {"contact_model": "vertices"}):
        assert told(lm.pushover(soft, loads, **options)) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("part", [0.1, 0.3, 0.45, 0.6])
def test_a_crushing_section_bears_its_stress_block_on_the_points_that_distinct_elements_choose(part):
    # b/h (1 - W / (fc A)); on 4 x 8 even points -13 to +11 % of it
    for angle in (0.0, math.pi / 2):
        wall = block({"compressive_strength": WEIGHT / AREA / part, **STIFF}, space=True, angle=angle)
        for width, across in ((WIDTH, angle), (DEPTH, angle + math.pi / 2)):
            loads = lm.Loads.horizontal(wall, (math.cos(across), math.sin(across), 0.0))
            found = dem.collapse(wall, loads, error_budget=())
            assert found.collapse_multiplier == pytest.approx(width / HEIGHT * (1.0 - part), rel=0.015)


@pytest.mark.parametrize("friction", [15.0, 25.0, 35.0, 45.0])
@pytest.mark.parametrize("ratio", [0.2, 0.6])
def test_the_knee_of_a_block_that_begins_to_slide_lies_on_a_sample(friction, ratio):
    """Pushed at the height of its joint it slides all at once at mu W, u = mu W / (ks A); lines had put it 21 % off."""
    kn, ks = 1e9, ratio * 1e9
    wall = block({"normal_stiffness": kn, "shear_stiffness": ks})
    wall = wall.with_joints(lm.Joint(friction, normal_stiffness=kn, shear_stiffness=ks))
    live = np.zeros((2, 6))
    live[1, 0], live[1, 4] = WEIGHT, -WEIGHT * HEIGHT / 2
    curve = lm.pushover(wall, lm.Loads(lm.Loads.horizontal(wall).dead, live))
    mu = math.tan(math.radians(friction))
    assert curve.first_limit_point.load == pytest.approx(mu, rel=1e-6)
    exact = mu * WEIGHT / (ks * AREA)
    for share in (0.5, 0.9, 0.98, 0.999):
        reached = int(np.flatnonzero(curve.load >= share * mu)[0])
        (u, v), (p, q) = curve.displacement[reached - 1 : reached + 1], curve.load[reached - 1 : reached + 1]
        assert u + (share * mu - p) / (q - p) * (v - u) == pytest.approx(share * exact, rel=0.01)


@pytest.mark.parametrize(("first", "then", "at"), [(3.0, 1.0, 0.3), (1.0, 4.0, 0.9), (2.0, -1.0, 0.5)])
def test_tangents_of_two_lines_meet_at_their_knee(first, then, at):
    rose = first * at + then * (1.0 - at)
    off, share = bend(first, rose, then)
    assert share == pytest.approx(at)
    assert off == pytest.approx(abs(first * at - rose * at))
