"""Axles over an arch: statics of the spread, point loads as its limit, and symmetry."""


import numpy as np
import pytest
from scipy.optimize import linprog

import limitmason as lm
from limitmason import formats
from limitmason.cli import main
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.model.axles import axle_forces, extrados

LEVEL = 1.4


def bridge(voussoirs=11, thickness=0.3):
    return lm.build.arch(
        radius=1.0, thickness=thickness, width=0.5, voussoirs=voussoirs, joint=lm.Joint(45.0), angle_deg=150
    )


def moment(assembly, wrench):
    """About the y axis through the origin, x of the resultant times the force."""
    return (-assembly.centroids[:, 0] * wrench[:, 2] + wrench[:, 4]).sum()


def test_load_and_place_of_an_axle_are_kept_on_level_ground():
    """Three level blocks: even between x - b/2 - d tan(beta) and x + b/2 + d tan(beta), cut at the blocks."""
    solids = [box((k, 0, -1), (k + 1, 2, 0)) for k in range(5)] + [box((k, 0, 0), (k + 1, 2, 1)) for k in range(5)]
    floor = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), fixed=range(5))
    wrench = axle_forces(floor, 2.3, 1e4, level=1.5, spread_deg=45.0, contact=0.4).wrench
    assert -wrench[:, 2].sum() == pytest.approx(1e4)
    assert moment(floor, wrench) == pytest.approx(2.3e4)
    share = np.array([0.0, 0.4, 1.0, 0.0, 0.0]) / 1.4  # from 1.6 to 3.0
    assert -wrench[5:, 2] / 1e4 == pytest.approx(share, abs=1e-12)
    assert wrench[6, 4] == pytest.approx(-wrench[6, 2] * (1.8 - 1.5))  # at the middle of 1.6 to 2.0
    half = axle_forces(floor, 5.0, 1e4, level=1.5, spread_deg=45.0, contact=0.4).wrench
    assert -half[:, 2].sum() == pytest.approx(0.5e4)  # the other half is beside the bridge
    assert moment(floor, half) == pytest.approx(0.5e4 * 4.65)  # at the middle of 4.3 to 5.0, not below the axle


def test_an_arch_bears_what_falls_on_it_at_its_place():
    arch = bridge()
    assert [s.block for s in extrados(arch)] == list(range(2, 13))
    for x in (-0.2, 0.0, 0.35):
        wrench = axle_forces(arch, x, 1e4, level=1.2, spread_deg=0.0, contact=0.2).wrench
        assert -wrench[:, 2].sum() == pytest.approx(1e4)
        assert moment(arch, wrench) == pytest.approx(x * 1e4, abs=1e-8)
    sloping = axle_forces(arch, 0.35, 1e4, level=1.0, spread_deg=30.0).wrench  # also where the extrados falls away
    assert moment(arch, sloping) == pytest.approx(3.5e3)
    assert not axle_forces(arch, 5.0, 1e4, level=LEVEL).wrench.any()


def test_an_axle_over_the_shoulder_of_a_pier_presses_on_the_pier():
    """The pier stands out by .45 m beside its springing: nothing of the axle came on it."""
    arch = lm.build.arch(
        radius=2.0, thickness=0.35, width=0.6, voussoirs=7, joint=lm.Joint(45.0), pier_height=1.0, pier_width=0.8
    )
    wrench = axle_forces(arch, -2.4, 1e4, level=2.5, spread_deg=0.0, contact=0.2).wrench
    assert -wrench[arch.block_index("pier-left-1"), 2] == pytest.approx(1e4)
    assert moment(arch, wrench) == pytest.approx(-2.4e4)
    # spread over 2 h from -2.4 m, cut at the outer face of the pier, 2.625 m from the middle
    half = 0.15 + 2.5 * np.tan(np.radians(30.0))
    spread = axle_forces(arch, -2.4, 1e4, level=2.5).wrench
    assert -spread[:, 2].sum() == pytest.approx(1e4 * (2.625 - 2.4 + half) / (2 * half))
    assert -axle_forces(arch, 0.0, 1e4, level=2.5).wrench[:, 2].sum() == pytest.approx(1e4)
    flush = lm.build.arch(radius=2.0, thickness=0.35, width=0.6, voussoirs=7, joint=lm.Joint(45.0), pier_height=1.0)
    assert [flush.blocks[s.block].name for s in extrados(flush)] == [f"voussoir-{k}" for k in range(1, 8)]


def test_joints_drawn_with_a_gap_cover_their_faces_too():
    """A joint lies half-way in a gap of some micrometres: faces in it are no extrados, on which an axle would press."""
    arch = bridge()
    parts = [(b.centroid + (1.0 - 2e-5) * (b.vertices - b.centroid), b.parts[0].faces) for b in arch.blocks]
    drawn = lm.Assembly.from_polyhedra(parts, joint=lm.Joint(45.0), fixed=[0, 1])
    assert len(drawn.interfaces) == len(arch.interfaces)
    assert [s.block for s in extrados(drawn)] == [s.block for s in extrados(arch)]
    exact, found = (axle_forces(a, 0.35, 1e4, level=1.2).wrench for a in (arch, drawn))
    assert found == pytest.approx(exact, rel=1e-3, abs=1.0)


def test_arches_side_by_side_share_an_axle_whose_joints_are_not_in_line():
    wide = [box((k, 1, 0), (k + 1, 3, 1)) for k in range(-4, 4)]
    narrow = [box((k - 0.5, 0, 0), (k + 0.5, 1, 1)) for k in range(-3, 4)]
    ground = box((-4, 0, -1), (4, 3, 0))
    floor = lm.Assembly.from_polyhedra([ground, *wide, *narrow], joint=lm.Joint(30.0), fixed=[0])
    for x in (0.0, 0.2, 1.7):  # the middle of a narrow block lies over a joint of the wide ones
        wrench = axle_forces(floor, x, 9e3, level=1.5).wrench
        assert -wrench[:, 2].sum() == pytest.approx(9e3)
        assert -wrench[1:9, 2].sum() == pytest.approx(6e3)
        assert moment(floor, wrench) == pytest.approx(9e3 * x, abs=1e-8)


def test_fill_may_end_at_a_crown_that_lies_at_zero_but_for_rounding():
    top = 0.1 + 0.2 - 0.3  # 5.6e-17
    floor = lm.Assembly.from_polyhedra(
        [box((0, 0, -2), (2, 1, -1)), box((0, 0, -1), (2, 1, top))], joint=lm.Joint(30.0), fixed=[0]
    )
    assert -axle_forces(floor, 1.0, 1e4, level=0.0).wrench[:, 2].sum() == pytest.approx(1e4)


def test_a_narrow_wheel_is_a_point_load():
    arch = bridge()
    dead = lm.Loads.weight(arch)
    found = lm.axle_envelope(arch, dead, [(0.0, 1e4)], level=LEVEL, positions=[-0.4], spread_deg=0.0, contact=1e-7)
    block = next(s.block for s in extrados(arch) if s.start < -0.4 < s.end)
    point = dead.with_point_load(arch, block, (0, 0, -1e4), at=(-0.4, 0.25, arch.centroids[block, 2]))
    assert found.multipliers[0] == pytest.approx(lm.limit_analysis(arch, point).collapse_multiplier, rel=1e-6)


def test_a_symmetric_bridge_has_a_symmetric_envelope():
    arch = bridge(7, thickness=0.15)
    places = np.array([-0.7, -0.3, 0.3, 0.7])
    found = lm.axle_envelope(arch, lm.Loads.weight(arch), [(0.0, 1e4)], level=0.9, positions=places)
    assert np.isfinite(found.multipliers).all()
    assert found.multipliers == pytest.approx(found.multipliers[::-1], rel=1e-7)
    two = lm.axle_envelope(arch, lm.Loads.weight(arch), [(0.0, 1e4), (0.3, 2e4)], level=0.9, positions=[0.6])
    back = lm.axle_envelope(arch, lm.Loads.weight(arch), [(0.0, 1e4), (-0.3, 2e4)], level=0.9, positions=[-0.6])
    assert two.multipliers == pytest.approx(back.multipliers, rel=1e-7)
    assert lm.figures.axle_envelope(found).axes
    assert found.prediction.mechanism is not None
    assert "smallest multiplier" in str(found)


def skewed(mirrored=False):
    """A bridge whose joints are spaced unevenly, from the left or from the right."""
    angles = np.deg2rad([-75, -60, -38, -20, 0, 25, 50, 75])
    curves = [np.column_stack([r * np.sin(angles), r * np.cos(angles) - 0.26]) for r in (0.95, 1.05)]
    if mirrored:
        curves = [(c * [-1.0, 1.0])[::-1] for c in curves]
    return lm.build.arch_from_curves(*curves, width=0.5, joint=lm.Joint(50.0))


def thrust_line_program(arch, wrench, mu):
    """Largest multiplier of live loads by the static theorem, written from the joints of an arch in x-z alone.

    Normal forces at both ends of every joint and a shear in it; three equations a voussoir (Heyman 1982).
    """
    free, joints = np.flatnonzero(~arch.fixed).tolist(), arch.interfaces
    balance, limits = np.zeros((3 * len(free), 3 * len(joints) + 1)), []
    for j, joint in enumerate(joints):
        ends = np.unique(np.round(joint.polygon[:, [0, 2]], 12), axis=0)
        n = joint.normal[[0, 2]]
        for block, sign in ((joint.block_a, -1.0), (joint.block_b, 1.0)):
            if block not in free:
                continue
            row, centre = 3 * free.index(block), arch.centroids[block][[0, 2]]
            for k, (at, way) in enumerate(zip((*ends, ends[0]), (n, n, np.array([-n[1], n[0]])), strict=True)):
                f, arm = sign * way, at - centre
                balance[row : row + 3, 3 * j + k] = f[0], f[1], arm[1] * f[0] - arm[0] * f[1]
        for sign in (1.0, -1.0):
            limits.append(np.zeros(3 * len(joints) + 1))
            limits[-1][3 * j : 3 * j + 3] = -mu, -mu, sign
    balance[:, -1] = wrench[free][:, [0, 2, 4]].ravel()
    dead = -lm.Loads.weight(arch).dead[free][:, [0, 2, 4]].ravel()
    cost = np.r_[np.zeros(3 * len(joints)), -1.0]
    bounds = [(0, None), (0, None), (None, None)] * len(joints) + [(0, None)]
    found = linprog(cost, np.array(limits), np.zeros(len(limits)), balance, dead, bounds, method="highs")
    assert found.status == 0
    return -found.fun


def test_every_position_of_an_axle_is_the_static_program_of_its_thrust_line():
    arch, places = skewed(), np.array([-1.2, -0.6, -0.35, 0.05, 0.4, 0.8])
    found = lm.axle_envelope(arch, lm.Loads.weight(arch), [(0.0, 1e4)], level=0.9, positions=places)
    mu = np.tan(np.deg2rad(50.0))
    exact = [thrust_line_program(arch, axle_forces(arch, x, 1e4, level=0.9).wrench, mu) for x in places]
    assert found.multipliers == pytest.approx(exact, rel=1e-6)
    assert found.governing == places[int(np.argmin(exact))]


def test_a_mirrored_bridge_and_another_first_axle_have_the_same_envelope():
    """Mirrored places and a train driven backwards; places counted from .3 m ahead of the first axle."""
    arch, image, places = skewed(), skewed(mirrored=True), np.linspace(-0.8, 0.9, 5)
    train = [(0.0, 1e4), (0.4, 5e3)]

    def envelope(assembly, axles, at):
        return lm.axle_envelope(assembly, lm.Loads.weight(assembly), axles, level=0.9, positions=at).multipliers

    wanted = envelope(arch, train, places)
    assert envelope(image, [(-x, p) for x, p in train], -places) == pytest.approx(wanted, rel=1e-7)
    assert envelope(arch, [(x + 0.3, p) for x, p in train], places + 0.3) == pytest.approx(wanted, rel=1e-7)
    loads = lm.Loads.weight(arch)
    for x, p in train:  # a group of axles is the sum of single ones
        loads = loads.with_axle(arch, places[2] - x, p, level=0.9)
    assert lm.limit_analysis(arch, loads).collapse_multiplier == pytest.approx(wanted[2], rel=1e-7)


def test_ctrl_c_keeps_the_positions_done_and_names_those_missing():
    arch = bridge(7, thickness=0.15)
    places = np.array([-0.3, 0.0, 0.2, 0.3])
    lines = []

    def say(line):
        lines.append(line)
        if len(lines) == at:
            raise KeyboardInterrupt

    def envelope(positions):
        return lm.axle_envelope(arch, lm.Loads.weight(arch), [(0.0, 1e4)], level=0.9, positions=positions,
                                flow_rule="non-associative", search="quick", prove=False, progress=say)

    at = 0
    done = envelope(places[:2])
    at, lines = len(lines) + 1, []
    cut = envelope(places)
    assert cut.status == "interrupted"
    assert cut.multipliers == pytest.approx([*done.multipliers, np.nan, np.nan], rel=1e-9, nan_ok=True)
    assert (cut.governing, cut.prediction.collapse_multiplier) == (done.governing, done.multipliers.min())
    assert "2 of 4 positions are missing, from x = 0.2 m on" in str(cut)
    assert lm.figures.axle_envelope(cut).axes
    at, lines = 1, []
    with pytest.raises(KeyboardInterrupt):  # nothing was done yet
        envelope(places)


@pytest.mark.parametrize(("given", "message"), [
    ({"axles": []}, "give pairs"),
    ({"axles": [(0.0, -1.0)]}, "a load above 0"),
    ({"level": 0.5}, "below the extrados"),
    ({"spread_deg": 90.0}, "spread_deg must be"),
    ({"positions": [9.0]}, "at no position"),
])
def test_axles_that_make_no_sense_are_refused(given, message):
    arch = bridge(5)
    with pytest.raises(InputError, match=message):
        lm.axle_envelope(arch, lm.Loads.weight(arch), **{"axles": [(0.0, 1e4)], "level": LEVEL, **given})


@pytest.mark.slow
def test_the_command_draws_the_envelope(tmp_path, capsys):
    arch = bridge(7, thickness=0.15)
    formats.write_json(tmp_path / "arch.json", arch, lm.Loads.weight(arch))
    said = ["axles", str(tmp_path / "arch.json"), "--axle", "0", "1e4", "--level", "0.9", "--fill", "1800"]
    assert main([*said, "--figure", str(tmp_path / "axles.png")]) == 0
    assert "smallest multiplier" in capsys.readouterr().out
    assert (tmp_path / "axles.png").exists()


@pytest.mark.slow
def test_a_train_may_be_placed_by_any_of_its_axles(monkeypatch):
    """With the second as the first, the axle before it is on the bridge 1.5 m earlier: it was passed over before."""
    monkeypatch.setattr("limitmason.limit.axles.POSITIONS", 8)
    arch = bridge(7, thickness=0.15)
    train = [(0.0, 2e4), (1.5, 1e3)]
    found = lm.axle_envelope(arch, lm.Loads.weight(arch), train, level=LEVEL)
    other = lm.axle_envelope(arch, lm.Loads.weight(arch), [(x - 1.5, p) for x, p in train], level=LEVEL)
    assert other.positions == pytest.approx(found.positions - 1.5)
    assert other.multipliers == pytest.approx(found.multipliers, rel=1e-6)


def test_the_smallest_multiplier_governs_where_all_are_below_zero():
    """A beam that leans over its support falls: axles would have to pull it up, the nearer the harder."""
    beam = lm.Assembly.from_polyhedra(
        [box((0, 0, -1), (1, 1, 0)), box((0, 0, 0), (4, 1, 0.5))], joint=lm.Joint(30.0), fixed=[0]
    )
    loads = lm.Loads.weight(beam)
    found = lm.axle_envelope(
        beam, loads, [(0.0, 1e4)], level=0.5, positions=[3.5, 2.5], contact=0.2, spread_deg=0.0, check_dead_load=False
    )
    weight = beam.weights[1]
    assert found.multipliers == pytest.approx([-weight / 2.5e4, -weight / 1.5e4], rel=1e-6)
    assert found.governing == 2.5
    assert found.prediction.collapse_multiplier == pytest.approx(-weight / 1.5e4, rel=1e-6)


def test_the_loads_of_an_envelope_are_those_of_its_axle():
    arch = bridge(7, thickness=0.15)
    loads = lm.Loads.weight(arch)
    found = lm.axle_envelope(arch, loads, [(0.0, 1e4)], level=LEVEL, positions=[0.4])
    alone = loads.with_axle(arch, 0.4, 1e4, level=LEVEL)
    # points turn with their blocks on a path: without arms a moment would stay as it is
    for name in ("live", "live_arms"):
        assert getattr(found.prediction.loads, name) == pytest.approx(getattr(alone, name), abs=1e-9)
