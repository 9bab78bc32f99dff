"""Can it stand, how well, and with what thrust: blocks on slopes, arches and lines of thrust in closed form."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

import limitmason as lm
from limitmason import formats
from limitmason.cli import main
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.limit.margin import Margin, last_standing

PHI = 35.0


def on_a_slope(slope, base=1.0, height=1.5, joint=None):
    """A block on a plane that falls towards +x."""
    c, s = math.cos(slope), math.sin(slope)
    turn = np.array([[c, -s], [s, c]])
    outlines = [
        np.array([(-1, -1), (base + 1, -1), (base + 1, 0), (-1, 0)], float),
        np.array([(0, 0), (base, 0), (base, height), (0, height)], float),
    ]
    joint = lm.Joint(PHI, dilatancy_angle_deg=PHI) if joint is None else joint
    return lm.Assembly.from_polygons([o @ turn for o in outlines], thickness=1.0, joint=joint, fixed=[0])


@pytest.mark.parametrize("slope", [0.1, 0.3])
def test_a_block_on_a_slope(slope):
    """tan(phi) / tan(slope); the weight meets the face at h / 2 tan(slope) from its middle; phi or b / h less slope."""
    found = lm.stability(on_a_slope(slope), tilts=("+x", "-x"))
    falls = min(math.radians(PHI), math.atan(1.0 / 1.5))
    wanted = {
        found.friction: math.tan(math.radians(PHI)) / math.tan(slope),
        found.share: 1.5 * math.tan(slope),
        found.tilt["+x"]: math.degrees(falls - slope),
        found.tilt["-x"]: math.degrees(falls + slope),
    }
    assert found.stands
    assert not found.notes
    for measured, value in wanted.items():
        assert abs(measured.high - measured.low) < 3e-7 * max(value, 1.0)
        assert measured.low - 1e-9 <= value <= measured.high + 1e-9 * value


def test_what_falls_has_a_motion_and_no_measures():
    found = lm.stability(on_a_slope(math.radians(36.0)))
    assert found.stands is False
    assert not found.friction.known
    motion = found.state.mechanism.twists[1, :3]
    assert motion[2] < 0.0
    assert "cannot stand" in str(found)
    # no bed joint takes an upright block down: neither friction nor width is asked for
    upright = lm.stability(on_a_slope(0.0), tilts=())
    assert upright.friction.high == math.inf
    assert upright.share.low == 0.0


def test_can_stand_is_said_to_be_necessary_below_normality():
    found = lm.stability(on_a_slope(0.1, joint=lm.Joint(PHI, dilatancy_angle_deg=0.0)), tilts=())
    assert "necessary" in found.notes[0]
    assert found.certain is None
    assert found.stands_on_path
    weight = found.path.structure.assembly.weights[1]
    assert found.path.resultants(0).normal[0] == pytest.approx(weight * math.cos(0.1), rel=1e-4)
    assert "it does on a path" in str(found)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_what_only_wedging_would_hold_falls_on_a_path(scale):
    """A block between two rocks: dry faces bear it if pressed together, which nothing does but dilation."""
    solids = [box((-1, 0, 0), (0, 1, 1)), box((1, 0, 0), (2, 1, 1)), box((0, 0, 0), (1, 1, 1))]

    def between_rocks(dilatancy):
        made = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(PHI, dilatancy_angle_deg=dilatancy), fixed=[0, 1])
        return lm.stability(made.transformed(scale * np.eye(3)), tilts=())

    falls = between_rocks(0.0)
    assert falls.stands
    assert falls.stands_on_path is False
    assert falls.certain is None
    assert "on a path it falls" in str(falls)
    wedged = between_rocks(10.0)  # it slides, opens its joints by tan(psi), and presses: N = W / (2 tan(phi))
    assert wedged.stands_on_path
    assert wedged.certain
    forces = wedged.path.resultants(0)
    weight = wedged.path.structure.assembly.weights[2]
    assert forces.normal == pytest.approx([0.5 * weight / math.tan(math.radians(PHI))] * 2, rel=1e-6)
    normal = between_rocks(PHI)
    assert normal.path is None
    assert not normal.notes


def test_a_path_that_cannot_be_followed_is_named_and_one_may_be_left_out():
    secant = lm.Joint(PHI, 0.0, cohesion=1e3, residual_cohesion=0.0, unloading="secant")
    found = lm.stability(on_a_slope(0.1, joint=secant), tilts=())
    assert found.path is None
    assert found.stands_on_path is None
    assert "no path: " in found.notes[-1]
    dry = lm.stability(on_a_slope(0.1, joint=lm.Joint(PHI, dilatancy_angle_deg=0.0)), tilts=(), path=False)
    assert dry.path is None
    assert dry.notes[-1] == "no path was asked for"


@pytest.mark.slow
def test_turned_mirrored_renumbered_and_scaled_copies_stand_alike():
    arch = lm.build.arch(radius=1.0, thickness=0.2, width=0.5, voussoirs=9, joint=lm.Joint(PHI))
    a = 0.4
    turn = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    order = np.random.default_rng(1).permutation(arch.n_blocks)
    first = lm.stability(arch, tilts={"along": (1, 0, 0)})
    for matrix in (turn, np.diag([1.0, -1.0, 1.0]), 30.0 * turn):
        copy = arch.transformed(matrix).renumbered(order)
        again = lm.stability(copy, tilts={"along": matrix @ (1, 0, 0)})
        for name in ("friction", "share"):
            assert getattr(again, name).low == pytest.approx(getattr(first, name).low, rel=1e-7)
        assert again.tilt["along"].low == pytest.approx(first.tilt["along"].low, rel=1e-7)


LACT3 = Path(os.environ.get("LIMITMASON_LACT3", "/not given"))
"""Folder of the samples of LACT3 (GabrieleMilani/LACT3_v1.0), which are not packaged: their licence is the GPL."""


@pytest.mark.slow
def test_the_arch_of_another_program_falls_at_its_tilt():
    """LACT3, arch_1: 25 voussoirs between radii of 317.0 and 373.3 mm, springing joints at 6 2/3 degrees: 17.10."""
    joint = lm.Joint(30.0, dilatancy_angle_deg=30.0)
    arch = lm.build.arch(
        radius=0.34515, thickness=0.0563, width=0.1, voussoirs=25, angle_deg=500.0 / 3.0, joint=joint
    )
    assert lm.stability(arch, tilts="+x").tilt["+x"].low == pytest.approx(17.10, rel=1e-3)


@pytest.mark.slow
@pytest.mark.skipif(not LACT3.is_dir(), reason="LIMITMASON_LACT3 names no folder with the samples of LACT3")
@pytest.mark.parametrize(("sample", "phi", "tilt"), [("wall", 26, 16.73), ("arch_1", 30, 17.10), ("Portal", 30, 27.30)])
def test_samples_of_another_program_fall_at_its_tilts(sample, phi, tilt):
    made = formats.model_of_drawing(LACT3 / f"{sample}.dxf", thickness=0.1, joint=lm.Joint(phi), scale=1e-3)
    assert lm.limit_analysis(made.assembly, made.loads).tilt_angle_deg == pytest.approx(tilt, rel=1e-3)


def test_a_tilt_of_the_ground_is_the_multiplier_of_dry_joints():
    arch = lm.build.arch(radius=1.0, thickness=0.2, width=0.5, voussoirs=9, joint=lm.Joint(PHI))
    found = lm.stability(arch, tilts="+x").tilt["+x"]
    assert found.low == pytest.approx(lm.limit_analysis(arch, lm.Loads.horizontal(arch)).tilt_angle_deg, rel=1e-7)


def test_a_tilt_with_tension_and_a_share_with_crushing():
    """5 sin(a) = cos(a) + ft A / W of a column 5 times as high as wide; W / (fc A) is the share that bears it."""
    law = {"dilatancy_angle_deg": 30.0, "cohesion": 2e4, "tensile_strength": 1e4}
    glued = lm.build.column(width=0.3, depth=0.3, unit_height=0.5, courses=3, joint=lm.Joint(30.0, **law))
    weight = glued.weights[~glued.fixed].sum()
    tilt = lm.stability(glued, tilts="+x").tilt["+x"]
    wanted = np.roots([26.0, -2 * 5 * 900.0 / weight, (900.0 / weight) ** 2 - 1.0]).max()  # of sin(a)
    assert tilt.low - 1e-6 <= math.degrees(math.asin(wanted)) <= tilt.high + 1e-6
    assert tilt.high - tilt.low < 1e-3
    soft = lm.Joint(30.0, dilatancy_angle_deg=30.0, compressive_strength=2e5)
    model = lm.build.column(width=0.3, depth=0.3, unit_height=1.5, courses=1, joint=soft)
    share = lm.stability(model, tilts=()).share  # sides shrink by the share, the area by its square
    assert share.high == pytest.approx(math.sqrt(weight / (2e5 * 0.09)), rel=1e-6)


def test_every_measure_of_two_piers_is_that_of_the_weaker():
    solids = [box((-1, 0, -1), (6, 1, 0)), box((0, 0, 0), (1, 1, 2)), box((3, 0, 0), (3.5, 1, 2))]
    piers = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(40.0), fixed=[0])
    tilt = lm.stability(piers, tilts="+x").tilt["+x"]
    assert tilt.low == pytest.approx(math.degrees(math.atan(0.25)), rel=1e-7)


def thrust_lines(arch, thickness, radius=1.0):
    """Least and greatest thrust of a semicircle over its weight: H, V and M at the crown, thrust within every joint."""
    voussoirs = arch.centroids[~arch.fixed]
    order = np.argsort(-voussoirs[:, 0])
    weight, x = arch.weights[~arch.fixed][order], voussoirs[order, 0]
    theta = np.linspace(0.0, math.pi, len(x) + 1)
    rows, bound = [], []
    for k, angle in enumerate(theta):
        # forces on the part to the right of the joint, from the right springing: (-H, V - W) and moment M + ...
        n = np.array([math.sin(angle) * -1.0, math.cos(angle), 0.0])
        passed, turning = weight[:k].sum(), float(weight[:k] @ x[:k])
        along = np.array([-n[0], n[1], 0.0])  # N = H sin + (V - passed) cos
        for side, r in ((1.0, radius - thickness / 2), (-1.0, radius + thickness / 2)):
            rows.append(side * (r * along - np.array([0.0, 0.0, 1.0])))
            bound.append(side * (r * passed * n[1] - turning))
    ends = [linprog([s, 0, 0], A_ub=rows, b_ub=bound, bounds=[(None, None)] * 3) for s in (1.0, -1.0)]
    return ends[0].fun / weight.sum(), -ends[1].fun / weight.sum()


def test_thrust_of_an_arch_is_that_of_its_lines_of_thrust():
    arch = lm.build.arch(radius=1.0, thickness=0.2, width=0.5, voussoirs=12, joint=lm.Joint(60.0))
    weight = arch.weights[~arch.fixed].sum()
    wanted = thrust_lines(arch, 0.2)
    for asked in (
        {"support": "base-right"}, {"support": ["base-left"]}, {"cut": ["voussoir-6|voussoir-7"]},
        {"cut": "voussoir-2|voussoir-3", "direction": (1, 0, 0)}, {"support": "base-right", "in_plane": False},
    ):
        found = lm.thrust(arch, **asked)
        assert (found.least / weight, found.greatest / weight) == pytest.approx(wanted, rel=1e-6), asked
        assert abs(found.direction[0]) == 1.0
    assert "along (1, 0, 0)" in str(found)


def test_a_cut_of_all_that_bears_a_tower_is_told_the_force_through_it():
    """It said that the tower floats, and to close a gap."""
    tower = lm.build.column(width=0.4, depth=0.3, unit_height=0.3, courses=3, joint=lm.Joint(35.0))
    weight = tower.weights[1:].sum()
    for cut, carried in ((tower.joint_names[0], weight), (tower.joint_names[1], weight * 2 / 3)):
        with pytest.raises(InputError, match="alone bear block 'column-.*' .*dead load of these") as said:
            lm.thrust(tower, cut=[cut], direction=(1, 0, 0))
        assert f"(0, 0, {-carried:.6g}) N" in str(said.value)


def test_thrust_of_three_hinges_through_a_group_and_a_cut():
    """Two halves of length l and height h: H = W l / (2 h) at least, and nothing bounds the greatest."""
    h = 0.8
    piers = [box((-1, 0, 0), (0, 1, h)), box((2, 0, 0), (3, 1, h / 2)), box((2, 0, h / 2), (3, 1, h))]
    halves = [box((0, 0, 0), (1, 1, h)), box((1, 0, 0), (2, 1, h))]
    arch = lm.Assembly.from_polyhedra([*piers, *halves], joint=lm.Joint(70.0), fixed=[0, 1, 2])
    two = [n for n in arch.joint_names if "block-4" in n and "block-3" not in n]
    assert len(two) == 2
    for asked in ({"support": [1, 2]}, {"cut": "block-3|block-4"}, {"cut": two, "direction": (-1, 0, 0)}):
        found = lm.thrust(arch, **asked)
        assert found.least == pytest.approx(arch.weights[3] / (2 * h), rel=1e-6)
        assert found.greatest == math.inf


@pytest.mark.parametrize(("call", "message"), [
    (lambda a: lm.thrust(a), "either a support or a cut"),
    (lambda a: lm.thrust(a, cut="base|keystone"), "no joint 'base|keystone'"),
    (lambda a: lm.thrust(a, "voussoir-1"), "'voussoir-1' is not held"),
    (lambda a: lm.thrust(a, "base-left", loads=lm.Loads.horizontal(a)), "dead loads"),
    (lambda a: lm.thrust(a, ["base-left", "base-right"]), "none follows"),
    (lambda a: lm.stability(a, lm.Loads.horizontal(a)), "dead loads"),
    (lambda a: lm.stability(a, tilts="down"), "'down' is none of"),
    (lambda a: lm.stability(a, tilts=None), "tilts: give names"),
    (lambda a: lm.stability(a, accuracy="fine"), "accuracy must be a finite number, got 'fine'"),
    (lambda a: lm.thrust(a, cut=3), "cut: give joints by name, got 3"),
    (lambda a: lm.thrust(a, 0, loads=lm.Loads(np.zeros((3, 6)), np.zeros((3, 6)))), "for 3 blocks, the assembly has 6"),
    (lambda a: lm.axle_envelope(a, lm.Loads.weight(a), [1e3], level=1.5), "axles: give pairs"),
    (lambda a: lm.minimum_thickness(lambda _: a, between=0.1), "between is a small and a larger thickness"),
    (lambda a: lm.strengthen(a, lm.Loads.horizontal(a), ["tie"]), "candidates.0. must be a Tie, got 'tie'"),
    (lambda a: lm.stability(a, tilts={"up": (0, 0, 1)}), "'up' must be a horizontal"),
    (lambda a: lm.thrust(a, 1.5), "1.5"),
    (lambda a: lm.axle_envelope(a, lm.Loads.weight(a), [(0, 1e3)], level=None), "level must be a finite number"),
    (lambda a: lm.axle_envelope(a, lm.Loads.weight(a), [(0, 1)], level=1.5, positions="all"), "positions must be"),
    (lambda a: lm.minimum_thickness(lambda _: a, between=(0.1, 0.2), loads=lm.Loads.horizontal), "dead loads"),
    (lambda a: lm.minimum_thickness(lambda _: None, between=(0.1, 0.2)), "build must be an Assembly, got None"),
    (lambda a: lm.figures.load_region(lm.limit_analysis(a, lm.Loads.horizontal(a))), "region must be a LoadRegion"),
    (lambda a: lm.figures.axle_envelope(None), "envelope must be an AxleEnvelope"),
    (lambda a: lm.figures.assessment(None), "verdict must be an Assessment"),
])
def test_what_makes_no_sense_is_refused_by_name(call, message):
    arch = lm.build.arch(radius=1.0, thickness=0.2, width=0.5, voussoirs=4, joint=lm.Joint(60.0))
    with pytest.raises(InputError, match=message):
        call(arch)


@pytest.mark.slow
def test_the_command_says_it_too(tmp_path, capsys):
    formats.write_model_template(tmp_path / "two.json")
    assert main(["stability", str(tmp_path / "two.json"), "--figure", str(tmp_path / "two.png")]) == 0
    told = capsys.readouterr().out
    assert "can stand" in told
    assert (tmp_path / "two.png").exists()


def test_a_cut_goes_through_all_faces_at_which_two_blocks_touch():
    """A beam on two posts: W / 3 to 2 W / 3, also on a post touched at two faces; 0 to 0.56 W was said before."""
    posts = [box((x, 0, 0), (x + 1, 1, 1)) for x in (0, 3)]
    beam = lm.Assembly.from_polyhedra(
        [*posts, box((0, 0, 1), (4, 1, 2))], joint=lm.Joint(PHI), fixed=[0, 1], names=["left", "right", "beam"]
    )
    whole, right = beam.interfaces
    x = whole.polygon[:, :1]
    faces = [
        replace(whole, polygon=np.hstack([np.clip(x, low, low + 0.4), whole.polygon[:, 1:]])) for low in (0.0, 0.6)
    ]
    parted = beam.with_interfaces([*faces, right])
    assert parted.joint_names == ("left|beam", "left|beam", "right|beam")
    for wall in (beam, parted):
        found = lm.thrust(wall, cut="left|beam", direction=(0, 0, 1))
        assert (found.least, found.greatest) == pytest.approx((wall.weights[2] / 3, 2 * wall.weights[2] / 3), rel=1e-6)


def test_both_ends_of_a_thrust_are_told_as_forces_on_the_arch_that_was_given():
    """Through the crown H is that on a springing, and crosses every joint. It was told as lambda, of the cut blocks."""
    arch = lm.build.arch(radius=1.0, thickness=0.2, width=0.5, voussoirs=12, joint=lm.Joint(60.0))
    for asked, where in (({"cut": "voussoir-6|voussoir-7"}, "through voussoir-6|voussoir-7"),
                         ({"support": "base-right"}, "on base-right")):
        found = lm.thrust(arch, **asked)
        ends = (found.least, "least", "(1, 0, 0)"), (-found.greatest, "greatest", "(-1, 0, 0)")
        for state, (reaction, end, way) in zip(found.states, ends, strict=True):
            assert str(state).startswith(
                f"{end} thrust {where}, which gives way along {way}: least reaction {reaction:.6g} N"
            )
            assert state.reaction.by_mechanism <= state.reaction.least <= state.reaction.by_forces + 1e-6
            assert not state.reaction.stands_without  # an arch does not stand without its abutment
            across = [row[2] for row in lm.force_table(state, arch).rows if row[0] == "joint" and "base" not in row[1]]
            assert np.abs(across) == pytest.approx(abs(reaction), rel=1e-6)
            assert lm.figures.mechanism(arch, state).axes


@pytest.mark.parametrize(("known", "high"), [(1.9, 1.5), (1.4, math.inf)])
def test_an_end_at_which_nothing_is_proven_is_no_proof_of_a_fall(known, high):
    """The margin is 1.5 - x as far as it is known: far = 2 was said to be proven to fall before, and 1 to stand."""
    nothing = Margin(math.nan, math.nan)
    found = last_standing(lambda x: Margin(1.5 - x, 1.5 - x) if x <= known else nothing, 1.0, 2.0, accuracy=1e-6)
    assert found.high == pytest.approx(high, abs=2e-6)
    assert min(1.5, known) - 0.1 < found.low <= min(1.5, known)


def test_what_is_not_decided_says_what_to_do(monkeypatch):
    """No way is known to a structure of which neither is found: the answer of its program is taken away here."""
    block = on_a_slope(0.1)
    carried = lm.stability(block, tilts=()).state
    monkeypatch.setattr("limitmason.stability_check._state", lambda problem: (None, carried))
    found = lm.stability(block, tilts=())
    assert found.stands is None
    assert "changed by a millionth" in found.notes[0]
