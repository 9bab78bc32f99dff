"""A support of several blocks that settles as one: strips, base courses, springers, rings, against statics."""

from itertools import pairwise

import numpy as np
import pytest

import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.model.stages import Drive

JOINT = lm.Joint(30.0)


def reaction(assembly, support, direction="-z"):
    found = lm.settlement_analysis(assembly, support, direction=direction)
    assert found.status in ("solved", "almost solved")
    low, high = found.reaction[1:3]
    total = assembly.weights[~assembly.fixed].sum()
    assert high - low < 1e-5 * total
    return found.reaction.least


@pytest.mark.parametrize("joint", [JOINT, lm.Joint(30.0, compressive_strength=1e6)], ids=["dry", "crushing"])
def test_a_support_that_carries_nothing_has_no_reaction(joint):
    """A block beside the structure, alone on the ground: nothing rests on it, and no joint of others is asked."""
    pier, beside, load = (box(*p) for p in (((0, 0, 0), (1, 1, 1)), ((2, 0, 0), (3, 1, 1)), ((0, 0, 1), (1, 1, 2))))
    made = lm.Assembly.from_polyhedra([pier, beside, load], joint=joint, fixed=[0, 1])
    found = lm.settlement_analysis(made, 1)
    assert found.status == "solved"
    assert found.reaction.least == 0.0
    assert found.reaction.stands_without
    wall = lm.Assembly.from_polygons(
        [np.array([(x, z), (x + 1, z), (x + 1, z + 1), (x, z + 1)], float) for x, z in ((0, 0), (2, 0), (0, 1))],
        thickness=1.0, joint=joint, fixed=[0, 1],
    )
    assert lm.settlement_analysis(wall, 1).reaction.least == 0.0


def test_a_support_that_must_push_is_needed_though_its_least_reaction_is_negative():
    """A beam of 2 m between edges .2 and 1.8: 0.8 W / 1.8 to W / 1.8 on the right post, friction either way along x."""
    posts = [box((0, 0, -0.2), (0.2, 0.5, 0)), box((1.8, 0, -0.2), (2, 0.5, 0))]
    made = lm.Assembly.from_polyhedra([*posts, box((0, 0, 0), (2, 0.5, 0.2))], joint=JOINT, fixed=[0, 1])
    weight = made.weights[2]
    for direction, least, needless in (
        ("-z", 0.8 / 1.8, False), ("+z", -1.0 / 1.8, False), ("+x", -0.5 * JOINT.tan_phi, True),
        (lm.SupportMotion((0, 0, 2)), -2.0 / 1.8, False),
    ):
        found = lm.settlement_analysis(made, 1, direction=direction).reaction
        assert found.least == pytest.approx(least * weight, rel=1e-6)
        assert found.stands_without is needless


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_strip_of_blocks_settles_as_one_block_of_its_length(scale):
    """A beam of 4 m on a strip of four blocks: turns about the edge of what stays at x, R (4 - x) = W (2 - x)."""
    strip = [box(*(scale * np.array([(k, 0, -1), (k + 1, 1, 0)]))) for k in range(4)]
    beam = box(*(scale * np.array([(0, 0, 0), (4, 1, 0.5)])))
    made = lm.Assembly.from_polyhedra([*strip, beam], joint=JOINT, fixed=range(4))
    assert len(made.interfaces) == 7  # head joints between held blocks among them: they must not lock it
    for settles, edge in (([1, 2, 3], 1.0), ([2, 3], 2.0), ([3], 3.0)):
        wanted = max(made.weights[4] * (2.0 - edge) / (4.0 - edge), 0.0)
        assert reaction(made, settles) == pytest.approx(wanted, abs=1e-6 * made.weights[4])
        names = [made.blocks[k].name for k in reversed(settles)]
        assert reaction(made, names) == pytest.approx(wanted, abs=1e-6 * made.weights[4])
    motion = lm.settlement_analysis(made, [1, 2, 3]).mechanism.twists
    assert np.allclose(motion[1:4], motion[1])  # one motion
    assert motion[1, 2] < 0.0
    assert not motion[0].any()
    # all of it: the beam follows with its whole weight, and warns
    whole = lm.settlement_analysis(made, [0, 1, 2, 3])
    assert whole.reaction.least == pytest.approx(made.weights[4], rel=1e-6)
    assert "every support settles" in whole.warnings[-1]


def course(x0, x1, z, unit=1.0, held=False):
    """Units of a course between x0 and x1, half units at the ends of every second course."""
    cuts = [x0, *np.arange(x0 + (0.5 if round(2 * z) % 2 and not held else 1.0) * unit, x1 - 1e-9, unit), x1]
    return [box((a, 0, z), (b, 0.5, z + 0.5)) for a, b in pairwise(cuts)]


@pytest.mark.parametrize(("direction", "settles"), [("-z", 2), ("-z", 1), ("+x", 2), ("+z", 2)])
def test_base_course_of_a_wall_settles_as_one_long_block_would(direction, settles):
    """The joints of a rigid support carry nothing: base units as a group are one block, with the same faces."""
    upper = [block for z in (0.0, 0.5, 1.0) for block in course(0.0, 6.0, z)]
    joint = lm.Joint(35.0)
    units = lm.Assembly.from_polyhedra([*course(0, 6, -0.5, held=True), *upper], joint=joint, fixed=range(6))
    edge = 6.0 - settles
    long = [box((0, 0, -0.5), (edge, 0.5, 0)), box((edge, 0, -0.5), (6, 0.5, 0))]
    whole = lm.Assembly.from_polyhedra([*long, *upper], joint=joint, fixed=[0, 1])
    group = list(range(6 - settles, 6))
    weight = whole.weights[2:].sum()
    assert reaction(units, group, direction) == pytest.approx(reaction(whole, 1, direction), abs=1e-6 * weight)


def test_abutment_of_a_flat_arch_spreads_against_the_least_thrust_of_three_hinges():
    """Two halves of length l and height h: hinges at the crown's top and the springings' feet, H = W l / (2 h)."""
    half, h = 1.0, 0.8
    piers = [box((-1, 0, 0), (0, 1, h)), box((2 * half, 0, 0), (3, 1, h / 2)), box((2 * half, 0, h / 2), (3, 1, h))]
    halves = [box((0, 0, 0), (half, 1, h)), box((half, 0, 0), (2 * half, 1, h))]
    arch = lm.Assembly.from_polyhedra([*piers, *halves], joint=lm.Joint(70.0), fixed=[0, 1, 2])
    thrust = arch.weights[3] * half / (2 * h)
    assert reaction(arch, [1, 2], "+x") == pytest.approx(thrust, rel=1e-6)
    assert reaction(arch, [2, 1], "+x") == pytest.approx(thrust, rel=1e-6)
    # as it closes in, with the hinges at the crown's foot and the springings' tops, nothing bounds the thrust
    assert lm.settlement_analysis(arch, [1, 2], direction="-x").status == "unbounded"


def turning_abutment(pole, matrix=None, order=None):
    """Two halves between abutments, the right one turns by -1 rad about (2, pole); R over W l, and its mechanism."""
    h, y = 0.8, np.array([0.0, 1.0, 0.0])
    piers = [box((-1, 0, 0), (0, 1, h)), box((2, 0, 0), (3, 1, h / 2)), box((2, 0, h / 2), (3, 1, h))]
    halves = [box((0, 0, 0), (1, 1, h)), box((1, 0, 0), (2, 1, h))]
    arch = lm.Assembly.from_polyhedra([*piers, *halves], joint=lm.Joint(70.0), fixed=[0, 1, 2])
    matrix, names = np.eye(3) if matrix is None else matrix, ["block-1", "block-2"]
    arch = arch.transformed(matrix)
    arch = arch if order is None else arch.renumbered(order)
    size = abs(np.linalg.det(matrix)) ** (1 / 3)
    axis = np.linalg.det(matrix) / size**3 * matrix @ y / size  # a turn is mirrored with the other sign
    sense = 1.0 if pole < 0.0 else -1.0
    motion = lm.SupportMotion(rotation=sense * axis, about=matrix @ (2.0, 0.5, pole))
    found = lm.settlement_analysis(arch, names, direction=motion)
    low, high = found.reaction[1:3]
    assert abs(high - low) < 3e-6 * abs(high)
    return found.reaction.least / (arch.weights[~arch.fixed].mean() * size), found


@pytest.mark.parametrize(("pole", "wanted"), [
    (-10.0, 10.0 / 1.6),  # it moves out more at the top: all hinges as where it only moves out
    (10.0, 10.0 / 1.6),
    (1.0, 0.2 / 0.8),  # more at the foot: the hinge at the springing is at its top, H = W l / h, arm 1 - h
])
def test_abutment_of_a_flat_arch_turns_about_a_point(pole, wanted):
    """R = H |p - z| is least over the height z of the hinge, with H = W l / (2 h - z)."""
    value, found = turning_abutment(pole)
    assert value == pytest.approx(wanted, rel=1e-6)
    twists = found.mechanism.twists[1:3]
    assert np.allclose(twists[0, 3:], twists[1, 3:])
    arm = found.structure.centroids[2] - found.structure.centroids[1]
    assert np.allclose(twists[1, :3] - twists[0, :3], np.cross(twists[0, 3:], arm), atol=1e-9)
    a = np.deg2rad(33.0)
    turned = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    for matrix, order in ((turned, None), (np.diag([-1.0, 1, 1]), None), (100.0 * turned, [4, 2, 0, 3, 1])):
        assert turning_abutment(pole, matrix, order)[0] == pytest.approx(value, rel=1e-7)


def test_the_field_of_a_group_is_one_rigid_motion_also_for_the_dem():
    piers = [box((0, 0, -1), (1, 1, 0)), box((1, 0, -1), (3, 1, 0)), box((0, 0, 0), (3, 1, 0.5))]
    made = lm.Assembly.from_polyhedra(piers, joint=JOINT, fixed=[0, 1])
    motion = lm.SupportMotion((0.0, 0.0, -0.01), rotation=(0.0, 0.002, 0.0), about=(0.0, 0.0, -1.0))
    travel, held = Drive(motion.displacements(made, [0, 1])).twists(made)
    assert held[:2].all()
    assert not held[2].any()
    for i, centre in enumerate(((0.5, 0.5, -0.5), (2.0, 0.5, -0.5))):
        assert travel[i] == pytest.approx([0.002 * 0.5, 0.0, -0.01 - 0.002 * centre[0], 0.0, 0.002, 0.0])
    # what a roller does not hold stays free, as in limit analysis
    roller = made.with_supports([lm.Support(1, dofs=("z", "ry"))])
    _, held = Drive(lm.SupportMotion((0.0, 0.0, -0.01)).displacements(roller, 1)).twists(roller)
    assert held[1].tolist() == [False, False, True, False, True, False]
    with pytest.raises(InputError, match="moves nothing"):
        lm.SupportMotion()
    with pytest.raises(InputError, match="rotation of a support's motion"):
        lm.SupportMotion(rotation=(0.0, 1.0))
    with pytest.raises(InputError, match="SupportMotion.*, got 'down'"):
        lm.settlement_analysis(made, 0, direction="down")


def test_a_strip_is_lowered_as_one_block_by_a_capacity_curve():
    """The strip settles under the beam until it turns about the edge of what stays: R (4 - x) = W (2 - x)."""
    strip = [box((k, 0, -1), (k + 1, 1, 0)) for k in range(4)]
    stiff = lm.Joint(30.0, normal_stiffness=1e10, shear_stiffness=1e10)
    made = lm.Assembly.from_polyhedra([*strip, box((0, 0, 0), (4, 1, 0.5))], joint=stiff, fixed=range(4))
    curve = lm.pushover(made, lm.Loads.weight(made), control=([2, 1, 3], "z"), to=-1e-3)
    assert curve.status == "reached"
    assert curve.load[-1] == pytest.approx(made.weights[4] / 3.0, rel=2e-4)  # it has turned by 1e-3 / 3
    with pytest.raises(InputError, match="'block-4' is not wholly held"):
        lm.pushover(made, lm.Loads.weight(made), control=([3, 4], "z"), to=-1e-3)


def test_ring_of_a_dome_carries_the_dome():
    dome = lm.build.dome(radius=2.0, thickness=0.3, courses=3, lunes=6, joint=lm.Joint(35.0))
    weight = dome.weights[~dome.fixed].sum()
    assert reaction(dome, "base") == pytest.approx(weight, rel=1e-6)
    assert reaction(dome, ["base"], "+x") == pytest.approx(0.0, abs=1e-6 * weight)
    # a ring of voussoirs that is held carries what stands on it, and no more
    names = [b.name for b in dome.blocks if b.name.startswith("voussoir-1") or b.name.startswith("voussoir-01")]
    held = dome.with_supports([lm.Support.fixed(n) for n in ("base", *names)])
    above = held.weights[~held.fixed].sum()
    assert reaction(held, names) == pytest.approx(above, rel=1e-6)


def test_springers_of_a_corner_of_a_groin_vault_settle_together():
    """Moments about a diagonal: opposite corners carry alike: none needs more than a quarter."""
    vault = lm.build.vault(
        shape="groin", thickness=0.3, voussoirs=4, unit_length=2.0, joint=lm.Joint(45.0), radius=2.0, projection=0.5
    )
    springers = [k for k, b in enumerate(vault.blocks) if b.name.startswith("springer")]
    weight = vault.weights[~vault.fixed].sum()
    where = np.sign(vault.centroids[springers][:, :2]).astype(int)
    corners = {}
    for k, sign in zip(springers, where.tolist(), strict=True):
        corners.setdefault(tuple(sign), []).append(k)
    assert sorted(map(len, corners.values())) == [2, 2, 2, 2]
    found = [reaction(vault, pair) for pair in corners.values()]
    assert found == pytest.approx([found[0]] * 4, rel=1e-5)
    assert 0.0 < found[0] <= 0.25 * weight * (1.0 + 1e-6)
    assert reaction(vault, springers) == pytest.approx(weight, rel=1e-6)
    twists = lm.settlement_analysis(vault, corners[1, 1]).mechanism.twists
    assert np.allclose(*twists[corners[1, 1]])


@pytest.mark.parametrize(("support", "message"), [
    ([], "give one block, or a list"),
    ([1, 1], "a list of different ones"),
    ([1, 2], "'block-2' is not wholly held"),
    ([0, "pier"], "no block named 'pier'"),
])
def test_groups_that_make_no_sense_are_refused_by_name(support, message):
    piers = [box((0, 0, -1), (1, 1, 0)), box((3, 0, -1), (4, 1, 0)), box((0, 0, 0), (4, 1, 0.5))]
    made = lm.Assembly.from_polyhedra(piers, joint=JOINT, fixed=[0, 1])
    with pytest.raises(InputError, match=message):
        lm.settlement_analysis(made, support)
    rolling = made.with_supports([lm.Support.fixed(0), lm.Support(1, translations=True)])
    with pytest.raises(InputError, match="'block-1' is not wholly held"):
        lm.settlement_analysis(rolling, [0, 1])


@pytest.mark.parametrize("direction", ["-z", lm.SupportMotion((1e-3, 0.0, -1.0))])
def test_what_no_reaction_holds_up_falls_beside_a_support_that_stays(direction):
    solids = [box((-0.2, -0.1, -0.2), (0.8, 0.3, 0)), box((0.8, -0.1, -0.2), (1.8, 0.3, 0)),
              box((0, 0, 0), (1.6, 0.2, 0.3)), box((1.3, 0, 0.3), (2.6, 0.2, 0.5))]
    names = ["left", "right", "beam", "over"]
    made = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(35.0), names=names, fixed=["left", "right"])
    found = lm.settlement_analysis(made, "right", direction=direction)
    assert found.status == "cannot stand under dead load"
    assert found.details["falling_margin"] > 0.1
    # a motion of the support would prove only that the structure falls where it has no reaction at all
    twists = np.abs(found.mechanism.twists)
    assert twists[1].max() < 1e-6 * twists.max()
    assert "right" not in found.details["falling_blocks"]


def test_the_reaction_of_a_turn_is_a_moment():
    piers = [box((0, 0, -1), (1, 1, 0)), box((3, 0, -1), (4, 1, 0)), box((0, 0, 0), (4, 1, 0.5))]
    made = lm.Assembly.from_polyhedra(piers, joint=JOINT, fixed=[0, 1])
    turn = lm.settlement_analysis(made, 1, direction=lm.SupportMotion(rotation=(0.0, 1.0, 0.0), about=(3.0, 0.5, 0.0)))
    assert turn.answer == f"least reaction {turn.reaction.least:.6g} N m"
    assert lm.settlement_analysis(made, 1).answer.endswith(" N")
