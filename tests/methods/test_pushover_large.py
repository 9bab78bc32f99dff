"""Capacity curves at large displacement: contacts found anew, moved supports, other programs' curves, the DEM."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pulled_in_ends import AT, OTHERS, between, check_falling_branch, check_frames_of_pairs, rounded

import dem
import limitmason as lm
from limitmason import experiments
from limitmason.capacity import Steps, contact_generations, imperfection_ensemble
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import box


def on_a_plinth(reverse=False, beside=0.0, sideways=0.0):
    """A block of 0.4 x 0.2 m whose right face is 0.1 m short of the right edge of what it stands on, friction 0.4.

    ``beside`` is how far the plinth is wider than the block [m], ``sideways`` the part of the push across, which takes
    the problem out of its plane.
    """
    names = ["plinth", "block"]
    y = 0.15 + beside
    solids = [box((-1.0, -y, -0.2), (0.5, y, 0.0)), box((0.0, -0.15, 0.0), (0.4, 0.15, 0.2))]
    order = (1, 0) if reverse else (0, 1)
    wall = lm.Assembly.from_polyhedra(
        [[(solids[k].vertices, solids[k].faces)] for k in order], joint=lm.Joint.from_friction_coefficient(0.4),
        names=[names[k] for k in order], fixed=["plinth"],
    )
    return wall, lm.Loads.horizontal(wall, (1.0, sideways, 0.0))


TIPS = 0.5 - 0.2 - 0.4 * 0.1  # the resultant through the centroid at half the height leaves the edge


@pytest.mark.parametrize("reverse", [False, True])
def test_a_block_that_slides_off_an_edge_tips_where_its_resultant_leaves_it(reverse):
    curve = lm.pushover(*on_a_plinth(reverse), stiffness=1e9, to=0.3)
    slid = curve.displacement_of("block")[:, 0]
    rests = slid < TIPS
    assert curve.load[rests][10:] == pytest.approx(0.4, rel=2e-4)
    assert (curve.load[slid > TIPS + 0.01] < 0.35).all()
    assert (slid > TIPS + 0.01).any()
    assert any(e.name == "contacts found anew" for e in curve.events)
    assert all(c.accepted for c in curve.certificates)


@pytest.mark.parametrize("stiffness", [1e7, pytest.param(2.5e7, marks=pytest.mark.slow)])
def test_corners_that_take_over_carry_what_was_carried_however_deep_soft_joints_are_pressed(stiffness):
    """Edges of the toe are 8 to 11 mm deep in each other: without a successor the load fell by a sixth."""
    wall = lm.build.wall(length=2.0, courses=10, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.02))
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), stiffness=stiffness, to=0.035)
    assert not curve.jumps
    assert all(c.accepted for c in curve.certificates)
    made = curve.generations
    renewed = [made.begun(n) for n in curve.nodes if n.onward is not None]
    assert len(renewed) >= 3
    for node in renewed:
        at = made.systems[node.generation].evaluate(node.pose, node.history, node.multiplier)
        assert at.unbalance < 0.01  # of a block's weight; a toe that is lost leaves 4 to 7


@pytest.mark.slow
def test_a_corner_that_comes_over_a_deep_gap_before_another_leaves_does_not_bear_beside_it():
    """Steps decided whether both bore: the toe was then too stiff, and the largest load .4071 instead of .4054."""
    wall = lm.build.wall(length=2.0, courses=10, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.02))
    coarse, fine = (
        lm.pushover(wall, lm.Loads.horizontal(wall), stiffness=2.5e7, to=0.035, steps=Steps(largest=s))
        for s in (0.04, 0.005)
    )
    assert coarse.peak.load == pytest.approx(fine.peak.load, rel=2e-4)
    assert coarse.load[-1] == pytest.approx(fine.load[-1], rel=2e-4)


def test_a_curve_whose_contacts_are_never_found_anew_is_noticed(monkeypatch):
    monkeypatch.setattr(contact_generations, "found_anew", lambda *_: None)
    curve = lm.pushover(*on_a_plinth(), stiffness=1e9, to=0.3)
    assert curve.load[-1] == pytest.approx(0.4, rel=1e-3)  # it slides on over the edge


def test_a_rocking_block_is_held_by_the_control_past_its_limit_point():
    wall = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=1, joint=lm.Joint(60.0))
    curve = lm.pushover(wall, lm.Loads.horizontal(wall), to=0.05, stiffness=1e8)
    top = curve.first_limit_point.index
    verdicts = [str(curve.stability(k)) for k in range(len(curve))]
    assert set(verdicts[: top - 1]) == {"stable"}
    assert set(verdicts[top + 1 :]) == {"held by the control"}


@pytest.mark.parametrize("side", [0, 1])
def test_a_block_with_a_gap_under_one_edge_leans_before_it_is_pushed(side):
    """It first comes down on the gap and leans by asin(g / width): lambda = tan(alpha +- lean)."""
    wall = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=1, joint=lm.Joint(60.0))
    loads = lm.Loads.horizontal(wall)
    gaps = np.zeros(2)
    gaps[side] = 1e-3
    curve = lm.pushover(wall, loads, gaps=gaps, stiffness=1e11)
    lean = math.asin(1e-3 / 0.2) * (1 if side == 0 else -1)
    assert curve.first_limit_point.load == pytest.approx(math.tan(math.atan(0.2) + lean), abs=1e-5)
    assert all(c.accepted for c in curve.certificates)
    with pytest.raises(InputError, match="gaps must be 2 lengths"):
        lm.pushover(wall, loads, gaps=[0.0, 0.0, 1.0])


@pytest.mark.slow
def test_an_ensemble_of_gaps_spreads_as_far_as_the_gaps_lean():
    """One block: the lean is the slope of the gap, uniform in +-g over half the width, twice the gap over the width."""
    wall = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=1, joint=lm.Joint(60.0))
    size = float(np.cbrt(wall.volumes[~wall.fixed][0]))
    found = imperfection_ensemble(wall, lm.Loads.horizontal(wall), gap=1e-2, samples=12, seed=3, stiffness=1e10)
    lean = np.tan(np.arctan(0.2) + np.arctan(2e-2 * size / 0.2) * np.array([-1.0, 1.0]))
    spread = found.spread_of_first_loss
    assert spread.paths == 12
    assert lean[0] < spread.low < spread.median < spread.high < lean[1] + 1e-4
    assert spread.high - spread.low > 0.5 * (lean[1] - lean[0])
    # a tenth of the width further on the lean counts as much, and lambda has fallen by what the block has turned
    assert (found.sustained < found.first_loss).all()
    again = imperfection_ensemble(wall, lm.Loads.horizontal(wall), gap=1e-2, samples=2, seed=3, stiffness=1e10)
    assert again.first_loss == pytest.approx(found.first_loss[:2], rel=1e-12)


# ---- beside other programs ----------------------------------------------------------------------------------------

@pytest.mark.slow
@pytest.mark.parametrize("name, inset, to", [("wall-1", 0.02, 0.0318), ("wall-2", 0.02, 0.02), ("wall-3", 0.02, 0.06)])
def test_peaks_with_ends_pulled_in_20_mm_are_those_of_udec(name, inset, to):
    _, curve = rounded(name, inset, 1e8, to)
    assert curve.peak.load == pytest.approx(OTHERS[name]["peak"], rel=0.01)


@pytest.mark.slow
def test_the_falling_branch_of_wall_2_lies_beside_udec_and_lmgc90():
    """As those of walls 1 and 3 in the lane of validation.

    With ends pulled in 10 mm and 5e7 Pa/m; with the stated 20 mm and 1e8 Pa/m they lie 2 to 9 % below.

    The files name 20 mm and 1e8 Pa/m. What both programs follow is stronger: LMGC90 peaks at 0.607 on wall 1, above
    the associative 0.5995 of 20 mm. With 10 mm and 5e7 Pa/m walls 2 and 3 are UDEC's within 2 % from 20 to 200 mm.
    """
    check_falling_branch("wall-2", 0.045)


@pytest.mark.slow
def test_wall_3_lies_beside_both_programs_with_20_mm_too():
    moved, curve = rounded("wall-3", 0.02, 1e8, 0.06)
    assert np.interp(AT, moved, curve.load) == pytest.approx(between("wall-3"), rel=0.03)
    assert not curve.jumps
    assert abs(curve.energy.error[-1]) < 0.02


@pytest.mark.slow
def test_two_theories_follow_one_wall_to_a_quarter_of_a_metre():
    """A wall under a heavy beam that is pushed: it rocks, slides and opens; the DEM drives the beam slowly."""
    joint = lm.Joint(35.0, 0.0, normal_stiffness=1e9, shear_stiffness=1e9)
    wall = lm.build.wall(length=0.8, courses=4, unit=(0.4, 0.2, 0.2), joint=joint, top_beam=0.2, beam_density=20000.0)
    weight = float(wall.weights[~wall.fixed].sum())
    loads = lm.Loads.weight(wall)
    live = np.zeros_like(loads.live)
    live[wall.block_index("beam"), 0] = weight
    curve = lm.pushover(wall, replace(loads, live=live), control=("beam", "x"), to=0.25)
    # slowly where it is stiff: at 2.5 um a step it reads 0.8 to 1.4 % too much at 10 mm, at a third of that 0.2 %
    drives = [dem.Drive(displacement={"beam": {"x": u}}, steps=n) for u, n in ((0.05, 60_000), (0.2, 80_000))]
    driven = dem.simulate(wall, [dem.Settle(), *drives], contact_model="vertices", sample=60)
    moved, force = driven.displacement_of("beam")[:, 0], driven.reaction_of("beam")[:, 0] / weight
    for at in (0.01, 0.02, 0.04, 0.08, 0.13, 0.2, 0.24):
        near = np.abs(moved - at) < 0.03 * at
        assert np.interp(at, curve.displacement, curve.load) == pytest.approx(np.median(force[near]), rel=0.01)


def joined(wall, kn, psi_deg=0.0):
    return wall.with_joints(lambda j: replace(j, normal_stiffness=kn, shear_stiffness=kn, dilatancy_angle_deg=psi_deg))


def ten_walls():
    for name in ("wall-1", "wall-2", "wall-3", "wall-4"):
        for psi_deg in (0.0, math.degrees(math.atan(0.65)) * (1 - 1e-12)):
            test = experiments.load("ferris-tin-loi-2001", name)
            yield pytest.param(joined(test.assembly(), 1e8, psi_deg), test.loads(), id=f"{name}, psi {psi_deg:.0f}")
    unit = {"unit": (0.08, 0.04, 0.04), "joint": lm.Joint(33.82), "length": 0.32, "courses": 4}
    corner = joined(lm.build.wall(plan="L", return_length=0.12, **unit), 6e10)
    yield pytest.param(corner, lm.Loads.horizontal(corner, (0, -1, 0)), id="L wall out of plane")
    straight = joined(lm.build.wall(**unit), 1e9)
    yield pytest.param(straight, lm.Loads.horizontal(straight, (0, 1, 0)), id="straight wall out of plane")


@pytest.mark.slow
@pytest.mark.parametrize("wall, loads", list(ten_walls()))
def test_the_first_limit_point_lies_in_the_bracket_of_the_dem(wall, loads):
    """On the same points, stiffness and frames; joints of 1e8 Pa/m let a block move by a tenth of it before collapse.

    The DEM stopped early there: at 0.2486 on wall 4 with psi = phi, whose limit point is 0.2725 at 22 mm.
    """
    found = dem.collapse(wall, loads, contact_model="vertices", contacts="first", error_budget=())
    point = lm.pushover(wall, loads, contacts="first").first_limit_point
    assert 0.997 * found.details["largest stable"] < point.load < 1.003 * found.details["smallest moving"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wall-1", "wall-2", "wall-3", "wall-4"])
def test_it_does_with_contacts_that_follow_their_edges_too(name):
    """On first contacts wall 2 bears .5187, on those found anew .5132."""
    test = experiments.load("ferris-tin-loi-2001", name)
    wall, loads = joined(test.assembly(), 1e8), test.loads()
    found = dem.collapse(wall, loads, contact_model="vertices", error_budget=())
    point = lm.pushover(wall, loads).first_limit_point
    assert 0.997 * found.details["largest stable"] < point.load < 1.003 * found.details["smallest moving"]
    assert any("beyond small displacement" in w for w in found.warnings)


@pytest.mark.slow
def test_frames_as_in_programs_of_contact_pairs_lie_beside_both_programs_with_20_mm():
    """The first points, frames carried by the lower block: within 3 % of the mean; corners on faces lie lower."""
    check_frames_of_pairs("wall-3", 0.06)


# ---- supports that move -------------------------------------------------------------------------------------------


def half_arches(stiffness, to):
    arch = lm.build.arch(thickness=0.3, width=0.2, voussoirs=2, joint=lm.Joint(50.0), radius=1.0, angle_deg=120.0)
    return arch, lm.pushover(arch, lm.Loads.weight(arch), control=("base-right", "x"), to=to, stiffness=stiffness)


def thrust_of_three_hinges(arch, spread):
    """H = W x_g / f of half an arch hinged at the intrados of its springing and the extrados of the crown."""
    left = int(np.flatnonzero(~arch.fixed & (arch.centroids[:, 0] < 0.0))[0])
    base = arch.block_index("base-left")
    joint = next(i for i in arch.interfaces if base in (i.block_a, i.block_b)).polygon[:, [0, 2]]
    springing = joint[np.abs(joint[:, 0]).argmin()]
    crown = np.array([0.0, arch.blocks[left].vertices[:, 2].max()])
    length, first = np.linalg.norm(crown - springing), math.atan2(crown[1] - springing[1], crown[0] - springing[0])
    slope = np.arccos((0.5 * spread - springing[0]) / length)
    x, z = arch.centroids[left][[0, 2]] - springing
    return arch.weights[left] * (x * np.cos(slope - first) - z * np.sin(slope - first)) / (length * np.sin(slope))


@pytest.mark.slow
def test_an_arch_on_spreading_supports_has_the_thrust_of_three_hinges():
    error = []
    for stiffness in (1e10, 1e11):
        arch, curve = half_arches(stiffness, 0.35)
        assert curve.status == "reached"
        assert curve.load_unit == "N"
        assert all(c.accepted for c in curve.certificates)
        hinged = curve.displacement > 1e-4
        error.append(np.abs(curve.load / -thrust_of_three_hinges(arch, curve.displacement) - 1.0)[hinged].max())
    assert error[0] < 5e-5
    assert error[1] == pytest.approx(0.1 * error[0], rel=0.3)  # what is left is the stiffness


def test_a_settling_arch_begins_with_the_reaction_of_the_settlement_analysis():
    arch = lm.build.arch(thickness=0.3, width=0.2, voussoirs=9, joint=lm.Joint(50.0), radius=1.0, angle_deg=150.0)
    found = lm.settlement_analysis(arch, "base-right", direction="+x")
    curve = lm.pushover(arch, lm.Loads.weight(arch), control=("base-right", "x"), to=1e-4, stiffness=1e11)
    assert curve.load[-1] == pytest.approx(-found.reaction.least, rel=1e-3)
    assert curve.multiplier[-1] * curve.unit == pytest.approx(curve.load[-1])
    # the cracked shape is the mechanism: what turned, in which sense and by how much
    turned = curve.mechanism(len(curve) - 1).twists[~arch.fixed, 4]
    expected = found.mechanism.twists[~arch.fixed, 4]
    assert turned / np.abs(turned).max() == pytest.approx(expected / np.abs(expected).max(), abs=0.02)


def test_what_a_moved_support_needs_is_said():
    arch = lm.build.arch(thickness=0.3, width=0.2, voussoirs=3, joint=lm.Joint(50.0), radius=1.0, angle_deg=120.0)
    with pytest.raises(InputError, match="say how far"):
        lm.pushover(arch, lm.Loads.weight(arch), control=("base-right", "x"))
    with pytest.raises(InputError, match="leave the live loads out"):
        lm.pushover(arch, lm.Loads.horizontal(arch), control=("base-right", "x"), to=0.01)
    wall = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=1, joint=lm.Joint(40.0))
    with pytest.raises(InputError, match="only support"):
        lm.pushover(wall, lm.Loads.weight(wall), control=("base", "x"), to=0.01)


def test_a_support_that_moves_there_and_back_ends_where_it_began():
    """Two half arches without slip: elastic joints and hinges forget the way."""
    arch, there = half_arches(1e9, 0.02)
    back = lm.pushover(
        arch, lm.Loads.weight(arch), control=("base-right", "x"), to=1e-3, stiffness=1e9, start=there,
        steps=Steps(largest=0.01),
    )
    at = np.interp(1e-3, there.displacement, there.load)
    assert back.load[-1] == pytest.approx(at, rel=1e-3)
