"""Push-over of solids: energy of one crack, meshes, balance, going on, states that are refused."""

from dataclasses import replace

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments, figures
from limitmason.continuum import Box, Continuum, Mesh, load_curve, path, push
from limitmason.errors import InputError
from validation.murano_macro import control_point, macro_model

MASONRY = lm.Material(
    8e8, 0.2, 2000.0, tensile_strength=8e4, tensile_energy=12.0, compressive_strength=8e5, compressive_energy=1300.0
)


def column(size, material=MASONRY, points=3):
    solid = Continuum.from_boxes([Box(np.zeros(3), np.array([0.2, 0.1, 0.6]))], material, size=size, points=points)
    return solid.with_patch_pressure([(0, 0, 0.5), (0, 0, 0.6), (0, 0.1, 0.6), (0, 0.1, 0.5)], force=1e3)


def pushed(solid, to, **options):
    return push(solid, control=((0.2, 0.05, 0.6), (1, 0, 0)), to=to, first=4e-5, largest=1.5e-4, **options)


@pytest.fixture(scope="module")
def coarse():
    return pushed(column(0.1), 1.2e-3)


def test_one_brick_pulled_apart_takes_the_fracture_energy_of_its_section():
    # a cube of side h has band h: work = G times its section
    h = 0.1
    brittle = lm.Material(8e8, 0.0, 0.0, tensile_strength=8e4, tensile_energy=12.0)
    cube = Continuum.from_boxes([Box(np.zeros(3), np.full(3, h))], brittle, size=h)
    top = [(0, 0, h), (h, 0, h), (h, h, h), (0, h, h)]
    curve = push(cube.with_patch_pressure(top, force=-1.0), control=((h / 2, h / 2, h), (0, 0, 1)), to=2e-3,
                 first=1e-5, largest=2e-5)
    assert curve.peak.load == pytest.approx(8e4 * h * h, rel=0.02)
    assert curve.work[-1] == pytest.approx(12.0 * h * h, rel=0.01)
    assert curve.energy.lost[-1] == pytest.approx(12.0 * h * h, rel=1e-3)
    assert np.abs(curve.energy.error).max() < 0.02
    assert curve.residual.max() <= 1e-3
    # the crack is as wide as the top has moved
    assert curve.crack_width().max() == pytest.approx(2e-3, rel=0.01)


def pulled_block(bricks, axis=2, held=0.0, layers=(0,), nodes=8):
    """Work and crack widths by place of a block of equal cubes, pulled along an axis from the end that is not held."""
    h, counts = 0.1, np.roll(bricks, axis - 2)
    material = lm.Material(8e8, 0.0, 0.0, tensile_strength=8e4, tensile_energy=12.0)
    across = counts * h
    boxes = []
    for k in layers:
        low, high = np.zeros(3), across.copy()
        low[axis], high[axis] = k * h, (k + 1) * h if len(layers) > 1 else across[axis]
        boxes.append(Box(low, high))
    solid = Continuum.from_boxes(boxes, material, size=h, nodes=nodes, points=2)
    x = solid.mesh.nodes
    end = 0.0 if held else across[axis]
    solid = replace(solid, held=np.repeat(np.abs(x[:, axis] - held) < 1e-9, 3).reshape(-1, 3))
    face = np.abs(x[:, axis] - end) < 1e-9
    pull = np.eye(3)[axis] * (-1.0 if held else 1.0)
    forces = np.zeros(x.shape)
    inner = np.ones(len(x))
    for other in np.flatnonzero(np.arange(3) != axis):  # nodes at the edge of the face carry half
        inner *= np.where(np.isclose(x[:, other], 0.0) | np.isclose(x[:, other], across[other]), 0.5, 1.0)
    forces[face] = inner[face, None] * pull
    point = np.where(np.arange(3) == axis, end, 0.5 * across)
    curve = push(solid.with_forces(forces), control=(point, pull), to=1.5e-3)
    return curve, curve.crack_width().mean(axis=1), solid.mesh.corners.mean(axis=1)[:, axis]


@pytest.mark.parametrize("bricks", [(1, 1, 2), (1, 1, 5), (2, 2, 3)])
def test_equal_bricks_under_equal_stress_take_the_energy_of_one_crack(bricks):
    """Gf A whatever the number of bricks; they all cracked before, 1.96, 3.7 and 2.7 times that."""
    curve, width, z = pulled_block(bricks)
    section = bricks[0] * bricks[1] * 0.01
    assert curve.energy.lost[-1] == pytest.approx(12.0 * section, rel=2e-3)
    assert curve.peak.load == pytest.approx(8e4 * section, rel=0.01)
    cracked = width > 1e-6
    assert cracked.sum() == bricks[0] * bricks[1]
    assert np.ptp(z[cracked]) < 1e-9  # one layer
    assert not curve.warnings


def test_the_brick_that_cracks_is_the_same_in_a_turned_mirrored_and_renumbered_bar():
    """Of four the second from the held end: nearest to the middle, behind as the control point moves."""
    for given in ({}, {"axis": 0}, {"axis": 1}, {"layers": (3, 0, 2, 1)}):
        curve, width, z = pulled_block((1, 1, 4), **given)
        assert z[np.argmax(width)] == pytest.approx(0.15)
        assert curve.energy.lost[-1] == pytest.approx(0.12, rel=2e-3)
    _, width, z = pulled_block((1, 1, 4), held=0.4)
    assert z[np.argmax(width)] == pytest.approx(0.25)


@pytest.mark.parametrize("part", [0.999, 0.99, 0.97])
def test_of_nearly_equal_bricks_the_weakest_cracks(part):
    """A step past both strengths cracked both, up to five times energy_error apart."""
    h, materials = 0.1, [
        lm.Material(8e8, 0.0, 0.0, tensile_strength=f * 8e4, tensile_energy=12.0) for f in (1.0, 1.0, part)
    ]
    boxes = [Box(np.array([0, 0, k * h]), np.array([h, h, (k + 1) * h]), k) for k in range(3)]
    bar = Continuum.from_boxes(boxes, materials, size=h, nodes=8, points=2)
    top = [(0, 0, 3 * h), (h, 0, 3 * h), (h, h, 3 * h), (0, h, 3 * h)]
    curve = push(bar.with_patch_pressure(top, force=-1.0), control=((h / 2, h / 2, 3 * h), (0, 0, 1)), to=1.5e-3)
    assert curve.energy.lost[-1] == pytest.approx(0.12, rel=2e-3)
    assert curve.crack_width()[bar.mesh.material == 2].mean() == pytest.approx(1.5e-3, rel=0.01)


def test_bricks_that_bending_opens_side_by_side_are_named():
    """A beam of an even number of bricks over its span, loaded in the middle: by symmetry two begin together."""
    length, depth, b = 0.6, 0.2, 0.1
    material = lm.Material(8e8, 0.2, 0.0, tensile_strength=8e4, tensile_energy=12.0)
    beam = Continuum.from_boxes([Box(np.zeros(3), np.array([length, b, depth]))], material, size=0.1, nodes=8, points=2)
    x = beam.mesh.nodes
    held = np.zeros(x.shape, dtype=bool)
    foot = np.isclose(x[:, 2], 0.0)
    held[foot & np.isclose(x[:, 0], 0.0)] = True
    held[foot & np.isclose(x[:, 0], length), 1:] = True
    forces = np.zeros(x.shape)
    forces[np.isclose(x[:, 0], length / 2) & np.isclose(x[:, 2], depth), 2] = -1.0
    middle = (length / 2, b / 2, 0.0)
    curve = push(replace(beam, held=held).with_forces(forces), control=(middle, (0, 0, -1)), to=1.2e-3, largest=1e-4)
    assert any("bricks side by side crack together" in w for w in curve.warnings)
    assert curve.crack_energy().ratio > 1.2


@pytest.mark.slow
@pytest.mark.parametrize("points", [2, 3])
def test_a_crack_through_one_row_of_bricks_takes_the_fracture_energy_of_its_section(points):
    # a bar of three cubes, the middle one 2 % weaker: it alone cracks, and G times the section is lost in all
    h = 0.1
    strengths = (8e4, 0.98 * 8e4)
    solid = Continuum.from_boxes(
        [Box(np.array([0, 0, k * h]), np.array([h, h, k * h + h]), int(k == 1)) for k in range(3)],
        [lm.Material(8e8, 0.0, 0.0, tensile_strength=ft, tensile_energy=12.0) for ft in strengths], size=h,
        points=points,
    )
    top = [(0, 0, 3 * h), (h, 0, 3 * h), (h, h, 3 * h), (0, h, 3 * h)]
    pulled = solid.with_patch_pressure(top, force=-1.0)
    control = ((h / 2, h / 2, 3 * h), (0, 0, 1))
    start = push(pulled, control=control, to=1.2e-4, first=2e-6, largest=4e-6)
    curve = push(pulled, control=control, to=4e-3, first=1e-5, largest=2e-4, start=start)
    assert curve.energy.lost[-1] == pytest.approx(12.0 * h * h, rel=1e-3)
    assert curve.crack_width()[[0, 2]].max() < 1e-9
    assert curve.crack_width()[1].mean() == pytest.approx(4e-3, rel=1e-3)
    # one step across the strength would crack all three, three times the energy in equilibrium too: it is cut
    cut = push(pulled, control=control, to=1.2e-2, first=2e-4, largest=2e-4)
    assert cut.energy.lost[-1] == pytest.approx(12.0 * h * h, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "weaker", "length"), [(0.2, 0.95, 1.0), (0.1, 0.95, 1.0), (0.2, 0.5, 1.6)])
def test_default_steps_find_one_crack_of_a_bar_at_any_mesh(size, weaker, length):
    """Gf A in all: lost, stored in the bar and the crack, and what is left of the exponential; peak ft A."""
    modulus, strength, energy, side = 3e9, 2e5, 50.0, 0.2
    ends = [0.0, 0.4, 0.4 + size, length]
    bar = Continuum.from_boxes(
        [Box(np.array([0, 0, ends[k]]), np.array([side, side, ends[k + 1]]), k % 2) for k in range(3)],
        [
            lm.Material(modulus, 0.0, 1.0, tensile_strength=part * strength, tensile_energy=energy,
                        compressive_strength=20 * strength, compressive_energy=1e4)
            for part in (1.0, weaker)
        ],
        size=size,
    )
    top = [(0, 0, length), (side, 0, length), (side, side, length), (0, side, length)]
    curve = push(bar.with_patch_pressure(top, force=-1e3), control=((side / 2, side / 2, length), (0, 0, 1)),
                 to=5 * energy / strength)
    left = curve.load[-1] * energy / (weaker * strength)
    taken = curve.energy.lost[-1] + curve.energy.stored[-1] + left
    assert taken == pytest.approx(energy * side**2, rel=0.02)
    assert curve.work[-1] + left == pytest.approx(energy * side**2, rel=0.02)
    assert curve.peak.load == pytest.approx(weaker * strength * side**2, rel=0.01)
    assert not curve.warnings


@pytest.mark.slow
def test_mesh_halving_leaves_peak_and_energy_of_the_mortared_u_wall():
    # bricks of 0.30 and 0.15 m to past the first peak. Loads agree to 1 %; work to 5.1 %, as the elastic stiffness
    # of one brick through the wall is 5.4 % above that of two
    test = experiments.load("murano-u-walls", "REGW")
    coarse, fine = (
        push(macro_model(test, size=size), control=(control_point(test), (0, -1, 0)), to=0.9e-3, first=1e-4,
             largest=1e-4)
        for size in (0.3, 0.15)
    )
    assert fine.peak.load == pytest.approx(coarse.peak.load, rel=0.05)
    stiffer = coarse.load[1] / coarse.displacement[1] / (fine.load[1] / fine.displacement[1])
    assert stiffer == pytest.approx(1.054, abs=0.005)
    assert fine.work[-1] * stiffer == pytest.approx(coarse.work[-1], rel=0.05)
    assert np.abs(fine.energy.error).max() < 0.03


def test_column_cracks_at_the_load_of_beam_theory_and_its_energy_is_balanced(coarse):
    # M = (ft + weight / A) W at the foot; the point nearest the edge cracks a little later than the edge
    weight, area, modulus = 2000 * 9.81 * 0.012, 0.02, 0.1 * 0.2**2 / 6
    first = (8e4 + weight / area) * modulus / 0.55
    crack = coarse.event("first crack")
    assert coarse.load[crack.index - 1] <= 1.3 * first
    assert coarse.peak.load > first
    assert np.abs(coarse.energy.error).max() < 0.03
    assert (np.diff(coarse.energy.lost) >= -1e-12).all()
    assert lm.modes(coarse, 1).frequency[0] < 0.8 * lm.modes(column(0.1), 1).frequency[0]  # what cracked is softer
    stiffness = coarse.load[1] / coarse.displacement[1]
    assert coarse.load[-1] / coarse.displacement[-1] < 0.5 * stiffness


def test_a_solid_that_only_crushes_has_no_first_crack_and_one_that_does_both_has_it_later():
    # a bar is pressed beyond fc / 3, where it begins to lose energy, then pulled at a third of its height aside
    crushing = lm.Material(2e9, 0.2, 0.0, compressive_strength=3e6, compressive_energy=5e3)
    box = Box(np.zeros(3), np.array([0.1, 0.1, 0.2]))
    top = [(0, 0, 0.2), (0.1, 0, 0.2), (0.1, 0.1, 0.2), (0, 0.1, 0.2)]
    solid = Continuum.from_boxes([box], crushing, size=0.1, nodes=8).with_patch_pressure(top, pressure=1e6)
    pressed = push(solid, control=((0.05, 0.05, 0.2), (0, 0, -1)), to=2e-4)
    assert pressed.energy.lost[-1] > 0.0
    assert not pressed.events
    both = replace(crushing, tensile_strength=1e5, tensile_energy=20.0)
    tall = Continuum.from_boxes([box], both, size=0.1, nodes=8).with_patch_pressure(top, pressure=2e6, case="dead")
    side = tall.with_patch_pressure([(0, 0, 0.1), (0, 0, 0.2), (0, 0.1, 0.2), (0, 0.1, 0.1)], force=1e3)
    bent = push(side, control=((0.1, 0.05, 0.2), (1, 0, 0)), to=5e-5)
    assert bent.nodes[0].lost > 0.0
    assert bent.event("first crack").index > 0


def test_a_curve_is_gone_on_from_saved_and_drawn(coarse, tmp_path):
    solid = column(0.1)
    lines = []
    half = pushed(solid, 6e-4, checkpoint=tmp_path / "path.npz", progress=lines.append)
    assert len(lines) == len(half)  # a line per step and one at the end
    with pytest.raises(InputError, match="is there already and would be lost"):
        pushed(solid, 6e-4, checkpoint=tmp_path / "path.npz")
    back = load_curve(tmp_path / "path.npz", solid)
    whole = pushed(solid, 1.2e-3, start=back)
    assert whole.displacement[: len(half)] == pytest.approx(half.displacement)
    assert (whole.load == pushed(solid, 1.2e-3, start=half).load).all()  # from a file and from memory: the same bits
    assert whole.load[-1] == pytest.approx(coarse.load[-1], rel=0.02)
    with pytest.raises(InputError, match="other loads"):
        pushed(solid.with_body_force((1, 0, 0), case="dead"), 1.2e-3, start=back)
    with pytest.raises(InputError, match="nodes"):
        load_curve(tmp_path / "path.npz", column(0.2))
    with pytest.raises(InputError, match="not kept"):
        half.stress(1)
    figure = figures.solid_map(solid, half.crack_width(), displacement=half.displacements(), label="crack [m]")
    assert figure.axes


def test_an_elastic_solid_stays_on_its_line_and_wrong_input_is_refused():
    solid = column(0.2, lm.Material(8e8, 0.2, 2000.0))
    curve = pushed(solid, 1e-3)
    assert curve.load == pytest.approx(curve.displacement * curve.load[-1] / curve.displacement[-1], rel=1e-9)
    assert curve.energy.lost[-1] == 0.0
    for wrong in ({"to": -1.0}, {"to": 1e-3, "tolerance": 0.0}):
        with pytest.raises(InputError, match="positive"):
            push(solid, control=((0.2, 0.05, 0.6), (1, 0, 0)), **wrong)
    with pytest.raises(InputError, match="to must be a finite number, got None"):
        push(solid, control=((0.2, 0.05, 0.6), (1, 0, 0)), to=None)
    bare = Continuum.from_boxes([Box(np.zeros(3), np.ones(3))], MASONRY, size=0.5)
    with pytest.raises(InputError, match="nothing to push"):
        push(bare, control=((1, 1, 1), (1, 0, 0)), to=1e-3)
    flat = pushed(column((0.2, 0.1, 0.05)), 5e-5)
    assert any("times as long as wide" in w for w in flat.warnings)


def test_warnings_of_a_turned_solid_and_of_one_that_is_read_back_are_those_of_the_path(tmp_path):
    """Bricks of 0.2 x 0.1 x 0.2 m turned by 45 degrees about z are 0.212 x 0.212 x 0.2 m along the axes."""
    straight = column((0.2, 0.1, 0.2))
    turn = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 2.0**0.5]]) / 2.0**0.5
    mesh = Mesh(straight.mesh.solid.p.T @ turn.T, straight.mesh.bricks, straight.mesh.material)
    turned = replace(straight, mesh=mesh, live=straight.live @ turn.T)
    curve = push(turned, control=(turn @ (0.2, 0.05, 0.6), turn[:, 0]), to=5e-5, first=4e-5)
    assert "2 times as long as wide" in curve.warnings[0]
    curve.save(tmp_path / "turned.npz")
    assert load_curve(tmp_path / "turned.npz", turned).warnings == curve.warnings


def test_steps_grow_while_cracks_run_on(monkeypatch):
    # where no Newton iteration ends a step, of any length, the path breaks on in steps that grow from the shortest
    class Breaking(path.Solver):
        def solve(self, last, *args, **options):
            return super().solve(last, *args, **options) if last.control < 1e-4 else None

        def past_instability(self, last, target, most, say=None):
            return last._replace(control=target, jump=True)

    monkeypatch.setattr(path, "Solver", Breaking)
    curve = pushed(column(0.1), 1.2e-3)
    assert curve.status == "reached"
    jumps = sum(n.jump for n in curve.nodes)
    # 4e-5 / 256 grows by 1.5 to 1.5e-4 in 17 steps, and 1.1e-3 / 1.5e-4 follow
    assert 10 < jumps < 30


@pytest.mark.slow
def test_a_solid_that_dead_load_has_cracked_is_pushed_in_a_few_steps_and_not_beside_those_of_finer_ones():
    test = experiments.load("murano-u-walls", "DS")
    solid, control = macro_model(test, "final", size=0.3), (control_point(test), (0.0, -1.0, 0.0))
    curve = push(solid, control=control, to=6e-4, first=2e-5, largest=2.4e-4)
    fine = push(solid, control=control, to=6e-4, first=1e-5, largest=5e-5, energy_error=3e-3)
    assert len(curve) < 120
    assert curve.peak.load == pytest.approx(fine.peak.load, rel=2e-3)
    middle = [np.interp(3e-4, c.displacement, c.load) for c in (curve, fine)]
    assert middle[0] == pytest.approx(middle[1], rel=2e-3)


def test_steps_keep_to_the_largest_and_another_control_is_no_start():
    solid = Continuum.from_boxes([Box(np.zeros(3), np.array([0.2, 0.1, 0.6]))], MASONRY, size=0.3)
    solid = solid.with_body_force((1.0, 0.0, 0.0))
    top, low = (0.2, 0.05, 0.6), (0.2, 0.05, 0.3)
    curve = push(solid, control=(top, (1, 0, 0)), to=1e-6, largest=4e-9 * 50, first=None)
    assert np.diff(curve.displacement).max() <= 1.2 * 2e-7
    short = push(solid, control=(top, (1, 0, 0)), to=1e-6, largest=2.5e-9 * 2)
    assert np.diff(short.displacement)[0] <= 5.0001e-9
    with pytest.raises(InputError, match="start is a curve of the point"):
        push(solid, control=(low, (1, 0, 0)), to=2e-6, start=curve)
    with pytest.raises(InputError, match="first must not be above largest"):
        push(solid, control=(top, (1, 0, 0)), to=1e-6, first=1e-7, largest=1e-8)
    with pytest.raises(InputError, match="is held"):
        push(solid, control=((0.2, 0.05, 0.0), (1, 0, 0)), to=1e-6)
    with pytest.raises(InputError, match="samples 0 to"):
        curve.displacements(99)


@pytest.mark.parametrize(("given", "message"), [
    ({"planes": [("z", 0.3)]}, "planes"), ({"planes": [(3, 0.1)]}, "planes"), ({"points": 7}, "points"),
    ({"foot": 9.0}, "foot"), ({"size": (1, 2)}, "size"),
])
def test_what_a_solid_would_pass_over_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        Continuum.from_boxes([Box(np.zeros(3), np.array([0.2, 0.1, 0.6]))], MASONRY, **{"size": 0.3, **given})


def test_a_load_that_does_not_move_the_control_is_refused():
    with pytest.raises(InputError, match=r"does not move the point \(0.2, 0.05, 0.6\) along \(0.0, 1.0, 0.0\)"):
        push(column(0.1), control=((0.2, 0.05, 0.6), (0, 1, 0)), to=1e-4)


def test_a_couple_has_a_multiplier_and_no_load_even_where_its_resultant_is_rounding():
    solid = Continuum.from_boxes([Box(np.zeros(3), np.array([0.2, 0.1, 0.6]))], MASONRY, size=0.1)
    for patch in ([(0, 0, 0.5), (0, 0, 0.6), (0, 0.03, 0.6), (0, 0.03, 0.5)],
                  [(0.2, 0.03, 0.37), (0.2, 0.1, 0.37), (0.2, 0.1, 0.6), (0.2, 0.03, 0.6)]):
        solid = solid.with_patch_pressure(patch, force=1e3 / 3.0)
    assert 0.0 < np.abs(solid.live.sum(axis=0)).max() < 1e-9
    curve = push(solid, control=((0.2, 0.1, 0.6), (-1, 0, 0)), to=1e-5)
    assert curve.load_unit == "-"
    assert curve.load.tolist() == curve.multiplier.tolist()


def test_planes_that_come_one_by_one_are_followed():
    boxes = [Box(np.zeros(3), np.array([0.2, 0.1, 0.6]))]
    given = Continuum.from_boxes(boxes, MASONRY, size=0.1, planes=[(2, 0.25)])
    one_by_one = Continuum.from_boxes(boxes, MASONRY, size=0.1, planes=iter([(2, 0.25)]))
    assert len(given.mesh) == len(one_by_one.mesh) == 14
    for wrong, message in (((2, np.nan), "planes: give pairs"), ((2, "a"), "planes must be numbers")):
        with pytest.raises(InputError, match=message):
            Continuum.from_boxes(boxes, MASONRY, size=0.1, planes=[wrong])
