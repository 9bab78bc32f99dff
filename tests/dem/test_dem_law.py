"""The joint law of the DEM against exact laws: tension above the apex, what is lost in failure, energies, dilation."""

import numpy as np
import pytest
from joint_points import along
from scipy.integrate import trapezoid
from walls import on_slab

import dem
import limitmason as lm
from limitmason.mechanics.law import interface_law

KN = KS = 1e9


# ---- tension above the apex of the cone


def steep(phi, **options):
    """Strengths of runs 13 and 16 of the panels: ft three times c, c / tan(phi) 0.107 or 0.071 MPa."""
    strengths = {"cohesion": 0.05e6, "tensile_strength": 0.15e6, "normal_stiffness": KN, "shear_stiffness": KS}
    return lm.Joint(phi, **(strengths | options))


@pytest.mark.parametrize("phi", [25.0, 35.0])
@pytest.mark.parametrize("brittle", [False, True])
def test_a_joint_is_pulled_off_at_its_tensile_strength_above_the_apex(phi, brittle):
    joint = steep(phi, **({"residual_cohesion": 0.0, "residual_tensile_strength": 0.0} if brittle else {}))
    side, lifted = 0.2, 4e-4
    block = on_slab([((0, 0, 0), (side, side, side))], joint=joint)
    up = {"x": 0.0, "y": 0.0, "z": lifted, "rx": 0.0, "ry": 0.0, "rz": 0.0}
    h = dem.simulate(block, [dem.Settle(), dem.Drive({1: up}, steps=2000)], contact_points=(3, 3), sample=1)
    pull = h.reaction[:, list(h.reaction_blocks).index(1), 2].max() - block.weights[1]
    assert pull == pytest.approx(0.15e6 * side**2, rel=2e-3)  # a step is 2e-7 m: 0.13 % of the opening at the peak
    assert pull > 1.39 * 0.05e6 / joint.tan_phi * side**2  # not c / tan(phi)


def test_beyond_the_apex_there_is_no_shear_and_slip_does_not_press_the_joint():
    joint = steep(35.0, dilatancy_angle_deg=20.0)
    opened = np.full(400, 0.1e6 / KN)  # N = -0.1 MPa, the apex at -0.0714
    path = along(joint, opening=opened, slip=np.linspace(0.0, 2e-5, 400))
    assert path.shear == pytest.approx(np.zeros(400), abs=1e-6)
    # it slides from the start and dilates up to the cone, on which it then stays: T = c + tan(phi) N
    path = along(joint, opening=opened, slip=np.linspace(0.0, 4e-4, 4000)[::10])
    onto = np.maximum(0.05e6 + joint.tan_phi * path.normal, 0.0)
    assert path.normal[-1] > -0.0714e6
    assert np.abs(path.shear) == pytest.approx(onto, rel=1e-9, abs=1e-3)
    # pulled without any slip nothing lifts
    assert not along(joint, opening=np.linspace(0.0, 1.4e-4, 300)).lift.any()


def test_a_named_residual_strength_is_taken_as_it_is_and_an_unnamed_one_ends_with_the_cone():
    pulled = np.linspace(0.0, 4e-4, 2000)
    kept = steep(35.0, residual_cohesion=0.0, residual_tensile_strength=0.02e6)
    assert along(kept, opening=pulled).normal[-1] == pytest.approx(-0.02e6)
    assert along(steep(35.0, residual_cohesion=0.0), opening=pulled).normal[-1] == pytest.approx(-0.15e6)
    inside = steep(35.0, tensile_strength=0.05e6, residual_cohesion=0.0)
    assert along(inside, opening=pulled).normal[-1] == 0.0


@pytest.mark.parametrize("phi", [25.0, 35.0])
def test_forces_above_the_apex_lie_within_the_law_of_the_dem_and_outside_the_convex_one(phi):
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=steep(phi))
    apex = 0.05e6 / np.tan(np.radians(phi))
    convex, full = (interface_law(block.arrays, convex=c) for c in (True, False))
    n = np.array([-0.5 * (apex + 0.15e6)])
    assert full.excess(n, np.zeros(1))[0] <= 0.0 < convex.excess(n, np.zeros(1))[0]
    assert full.excess(n, np.array([1e3]))[0] == pytest.approx(1e3)
    assert full.excess(np.array([-0.16e6]), np.zeros(1))[0] == pytest.approx(0.01e6)


def test_a_block_hung_from_its_joint_falls_at_ft_in_the_dem_and_at_the_apex_in_limit_analysis_which_says_so():
    joint = lm.Joint(45.0, cohesion=10e3, tensile_strength=60e3, normal_stiffness=1e9, name="hanger")
    hung = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=joint)
    loads = lm.Loads.weight(hung).with_point_load(hung, 1, (0, 0, 1.0))
    weight = hung.weights[1]
    found = lm.predict(hung, loads, "dem", error_budget=(), contact_points=(2, 2), tolerance=1e-3)
    assert found.collapse_multiplier == pytest.approx(60e3 * 0.04 + weight, rel=2e-3)
    assert found.certificate.yield_violation < 1e-6
    assert any("taken beyond the apex" in w for w in found.warnings)
    cut = lm.predict(hung, loads, "limit")
    assert cut.collapse_multiplier == pytest.approx(10e3 * 0.04 + weight, rel=1e-6)
    assert any("(hanger) counts as c / tan(phi) = 1e+04 Pa" in w for w in cut.warnings)


# ---- what is lost when a point fails, and over which energy


FT, C, PHI, SIGMA = 0.1e6, 0.2e6, 30.0, 0.3e6
TAN = np.tan(np.radians(PHI))
RESIDUAL = {"residual_cohesion": 0.0, "residual_tensile_strength": 0.0}


def bonded(**options):
    strengths = {"cohesion": C, "tensile_strength": FT, "normal_stiffness": KN, "shear_stiffness": KS}
    return lm.Joint(PHI, **(strengths | options))


SLIP = np.linspace(0.0, 4e-3, 40_001)


def test_a_joint_shears_at_its_peak_and_then_at_its_residual_strength():
    for lost_by, after in (("opening or slip", 0.0), ("opening", C), ("nothing", C)):
        path = along(bonded(lost_by=lost_by, **RESIDUAL), slip=SLIP, pressure=SIGMA)
        assert -path.shear.min() == pytest.approx(C + SIGMA * TAN, rel=5e-3)
        assert -path.shear[-1] == pytest.approx(after + SIGMA * TAN, rel=1e-12)


def test_opening_takes_cohesion_and_tension_where_opening_counts():
    opened = np.concatenate([np.linspace(0.0, 2 * FT / KN, 100), np.linspace(2 * FT / KN, -SIGMA / KN, 100)])
    slid = np.concatenate([np.zeros(150), np.linspace(0.0, 2e-3, 50)])
    for lost_by, pull, shear in (("opening or slip", 0.0, 0.0), ("opening", 0.0, 0.0), ("nothing", FT, C)):
        path = along(bonded(lost_by=lost_by, **RESIDUAL), opening=opened, slip=slid)
        assert path.normal[99] == pytest.approx(-pull, abs=1e-6)
        assert -path.shear[-1] == pytest.approx(shear + path.normal[-1] * TAN, rel=1e-12)


@pytest.mark.parametrize("left", [0.0, 0.02e6])
@pytest.mark.parametrize("unloading", ["elastic", "secant"])
def test_the_area_under_the_tension_curve_is_the_fracture_energy(left, unloading):
    energy = 30.0
    joint = bonded(fracture_energy_tension=energy, residual_tensile_strength=left, unloading=unloading)
    opening = np.linspace(0.0, 2e-3, 20_001)
    path = along(joint, opening=opening)
    crack = opening + path.normal / KN  # opening less its elastic part
    assert -path.normal.min() == pytest.approx(FT, rel=2e-3)
    assert trapezoid(-path.normal - left, crack) == pytest.approx(energy, rel=2e-3)
    # linear: half the stress at half the crack opening
    width = 2 * energy / (FT - left)
    middle = np.argmin(np.abs(crack - 0.5 * width))
    assert -path.normal[middle] == pytest.approx(0.5 * (FT + left), rel=5e-3)
    if left == 0.0:
        assert trapezoid(-path.normal, opening) == pytest.approx(energy, rel=2e-3)
        assert path.broken[-1] == pytest.approx(energy, rel=2e-3)


@pytest.mark.parametrize("left", [0.0, 0.05e6])
def test_the_area_under_the_shear_curve_above_its_residual_is_the_fracture_energy(left):
    energy = 120.0
    joint = bonded(fracture_energy_shear=energy, residual_cohesion=left)
    path = along(joint, slip=SLIP, pressure=SIGMA)
    shear, rest = -path.shear, left + SIGMA * TAN
    plastic = SLIP - shear / KS
    slides = plastic > 1e-9
    assert shear.max() == pytest.approx(C + SIGMA * TAN, rel=5e-3)
    assert shear[-1] == pytest.approx(rest, rel=1e-12)
    assert trapezoid(shear[slides] - rest, plastic[slides]) == pytest.approx(energy, rel=5e-3)
    assert path.damage[-1] == 1.0


def test_both_energies_are_spent_separately_by_one_damage():
    joint = bonded(fracture_energy_tension=30.0, fracture_energy_shear=120.0)
    pulled = along(joint, opening=np.linspace(0.0, 2e-3, 20_001))
    assert trapezoid(-pulled.normal, np.linspace(0.0, 2e-3, 20_001)) == pytest.approx(30.0, rel=2e-3)
    slid = along(joint, slip=SLIP, pressure=SIGMA)
    assert -slid.shear[-1] == pytest.approx(SIGMA * TAN, rel=1e-12)
    # half of the way by slip leaves half of the tension: slid, let go of its shear, and pulled
    half = np.argmin(np.abs(slid.damage - 0.5))
    both = along(joint, opening=np.r_[np.full(half, -SIGMA / KN), np.linspace(-SIGMA / KN, 1e-3, 4000)],
                 slip=np.r_[SLIP[:half], np.full(4000, SLIP[half] + slid.shear[half] / KS)])
    assert -both.normal.min() == pytest.approx(0.5 * FT, rel=2e-2)


def test_an_energy_below_what_the_elastic_joint_has_stored_is_refused_with_the_stiffness_it_needs():
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=bonded(fracture_energy_tension=4.0, name="mortar"))
    with pytest.raises(lm.errors.InputError, match=r"'mortar'.*normal_stiffness .*above 1.25e\+09"):
        dem.simulate(block, dem.Settle())
    stiff = block.with_joints(bonded(fracture_energy_tension=4.0, normal_stiffness=1.3e9))
    assert dem.simulate(stiff, dem.Settle()).status == "finished"
    with pytest.raises(lm.errors.InputError, match="softening_slip"):
        dem.simulate(stiff, dem.Settle(), joint_options=dem.JointOptions(softening_slip=1e-3))


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"lost_by": "sliding"}, "lost_by must be one of 'opening or slip', 'opening', 'nothing'"),
        ({"unloading": "plastic"}, "unloading must be one of"),
        ({"fracture_energy_tension": 0.0}, "must be positive"),
        ({"fracture_energy_tension": -1.0}, "must not be negative"),
        ({"fracture_energy_tension": 5.0, "lost_by": "nothing"}, "never spends it"),
        ({"fracture_energy_shear": 5.0, "lost_by": "opening"}, "loses nothing by slip"),
        ({"fracture_energy_shear": 5.0, "residual_cohesion": C}, "cohesion has nothing to lose"),
    ],
)
def test_laws_that_contradict_themselves_are_refused_by_field(fields, said):
    with pytest.raises(lm.errors.InputError, match=said):
        bonded(**fields)


# ---- unloading


def loops(unloading):
    """Openings that come back to nothing, each wider than the last, and the path."""
    turns = np.array([1.5, 2.5, 4.0, 6.0]) * FT / KN
    opening = np.concatenate([np.r_[np.linspace(0, x, 2000), np.linspace(x, 0, 2000)] for x in turns])
    return turns, opening, along(bonded(fracture_energy_tension=40.0, unloading=unloading), opening=opening)


def test_a_damaged_joint_unloads_to_the_origin_and_every_loop_takes_energy():
    turns, opening, path = loops("secant")
    pull = -path.normal
    for k, x in enumerate(turns):
        down = slice(4000 * k + 2000, 4000 * (k + 1))
        # on the envelope at the turn: ft less what the crack opening has taken
        width = 2 * 40.0 / FT
        at_turn = FT * (1.0 - (x - FT / KN) / (width - FT / KN))
        assert pull[down][0] == pytest.approx(at_turn, rel=2e-3)
        assert pull[down] == pytest.approx(at_turn * opening[down] / x, rel=5e-3, abs=1e-3 * FT)
        loop = slice(4000 * k, 4000 * (k + 1))
        taken = trapezoid(pull[loop], opening[loop])
        released = path.broken[loop][-1] - (path.broken[4000 * k - 1] if k else 0.0)
        assert taken > 0.0
        assert released == pytest.approx(taken, rel=1e-2)  # all that a loop takes is released by damage
    # once more to the widest: no new damage, no loop
    again = along(bonded(fracture_energy_tension=40.0, unloading="secant"), opening=np.r_[opening, opening[-4000:]])
    assert abs(trapezoid(-again.normal[-4000:], opening[-4000:])) < 1e-3 * 40.0


def test_elastic_unloading_keeps_its_stiffness():
    _, opening, path = loops("elastic")
    end = slice(-20, None)
    assert -path.normal[end] == pytest.approx(KN * opening[end], rel=1e-9)


@pytest.mark.parametrize("unloading", ["elastic", "secant"])
@pytest.mark.parametrize("damage", [{}, {"cohesion": 1e5, "fracture_energy_shear": 50.0}])
def test_a_joint_whose_tension_is_never_lost_bears_a_block_by_its_stiffness(damage, unloading):
    """A block of weight W at rest on an area A has sunk by W / (kn A) and stores W^2 / (2 kn A)."""
    joint = lm.Joint(35.0, normal_stiffness=KN, shear_stiffness=KS, unloading=unloading, **damage)
    block = on_slab([((0, 0, 0), (0.2, 0.3, 0.4))], joint=joint)
    h = dem.simulate(block, [dem.Settle()])
    weight, area = block.weights[1], 0.06
    assert h.displacement_of(1)[-1, 2] == pytest.approx(-weight / (KN * area), rel=1e-3)
    assert h["elastic"][-1] == pytest.approx(weight**2 / (2.0 * KN * area), rel=1e-3)


@pytest.mark.parametrize("unloading", ["elastic", "secant"])
def test_no_loop_of_opening_and_slip_makes_energy(unloading):
    joint = bonded(fracture_energy_tension=40.0, fracture_energy_shear=150.0, unloading=unloading)
    s = np.linspace(0.0, 6 * np.pi, 30_000)
    for ratio in (0.3, 1.0, 3.0):
        opening, slip = 2e-4 * np.sin(s) ** 2 * s / s[-1], ratio * 3e-4 * np.sin(s) * s / s[-1]
        path = along(joint, opening=opening, slip=slip)
        for k in range(3):
            loop = slice(10_000 * k, 10_000 * (k + 1))
            work = trapezoid(-path.normal[loop], opening[loop]) + trapezoid(-path.shear[loop], slip[loop])
            assert work >= -1e-9


def test_energy_balances_in_a_run_with_fracture_energies_and_secant_unloading():
    joint = bonded(fracture_energy_tension=40.0, fracture_energy_shear=150.0, unloading="secant")
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=joint)
    moves = [{"ry": 2e-3}, {"ry": -2e-3, "x": 2e-4}]
    h = dem.simulate(block, [dem.Settle(), *(dem.Drive({1: m}, steps=8000) for m in moves)], contact_points=(6, 3))
    work = (np.abs(h["applied"]) + np.abs(h["support"])).max()
    assert h["fracture"][-1] > 0.02 * work
    assert np.abs(h.energy_error).max() < 2e-4 * work


# ---- stated, written and read


def test_every_result_says_what_is_lost_in_failure(tmp_path):
    joint = bonded(fracture_energy_tension=40.0, lost_by="opening", unloading="secant", name="mortar")
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=joint)
    loads = lm.Loads.horizontal(block)
    said = (
        "joint 'mortar': c 2e+05 Pa, ft 1e+05 Pa, tan(phi) 0.5774: lost in failure: ft to 0, by opening over "
        "GfI = 40 J/m2 only; tension unloads to the origin",
    )
    found = lm.predict(block, loads, "dem", error_budget=(), contact_points=(2, 2), tolerance=0.1)
    assert found.lost_in_failure == said
    assert said[0] in str(found)
    assert dem.simulate(block, dem.Settle()).lost_in_failure == said
    limit = lm.predict(block, loads, "limit")
    assert limit.lost_in_failure[0].endswith("nothing is lost in failure (perfectly plastic)")
    assert any("left out" in w for w in limit.warnings)
    lm.formats.write_prediction(tmp_path / "p.json", found)
    assert lm.formats.read_prediction(tmp_path / "p.json").lost_in_failure == said
    dry = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=lm.Joint(30.0))
    assert lm.predict(dry, lm.Loads.horizontal(dry), "limit").lost_in_failure == ()
    sudden = block.with_joints(bonded(**RESIDUAL))
    assert "by opening at once or by slip at once" in dem.simulate(sudden, dem.Settle()).lost_in_failure[0]


def test_joints_with_new_fields_are_written_and_read_and_old_files_still_are(tmp_path):
    joint = bonded(fracture_energy_tension=40.0, fracture_energy_shear=150.0, unloading="secant", name="mortar")
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=joint)
    lm.formats.write_json(tmp_path / "m.json", block)
    again, _ = lm.formats.read_json(tmp_path / "m.json")
    assert again.interfaces[0].joint == joint
    plain = block.with_joints(lm.Joint(30.0, cohesion=1e5, residual_cohesion=0.0))
    lm.formats.write_json(tmp_path / "old.json", plain)
    text = (tmp_path / "old.json").read_text()
    assert "lost_by" not in text  # what is not said is not written: as 0.1 wrote it
    assert "unloading" not in text
    assert lm.formats.read_json(tmp_path / "old.json")[0].interfaces[0].joint == plain.interfaces[0].joint


def test_a_state_that_does_not_say_its_model_is_refused():
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=bonded())
    state = dem.simulate(block, dem.Hold(steps=1)).state
    old = {k: v for k, v in state.arrays().items() if not k.startswith("model.")}
    with pytest.raises(ValueError, match="old.npz .* another version"):
        type(state).from_arrays(old, "old.npz")


# ---- dilation follows the sense of slip


def dilatant(psi=20.0, **options):
    return lm.Joint(PHI, psi, **({"normal_stiffness": KN, "shear_stiffness": KS} | options))


def test_lift_is_tan_psi_times_the_slip_and_is_given_back_on_return():
    rise = np.tan(np.radians(20.0))
    there, back = np.linspace(0.0, 3e-3, 3000), np.linspace(3e-3, -3e-3, 6000)
    slip = np.r_[there, back, back[::-1]]
    path = along(dilatant(), slip=slip, pressure=SIGMA)
    plastic = slip + path.shear / KS
    # sliding away exactly, and at every step of the way back and through the start to the other side
    assert path.lift[:3000] == pytest.approx(rise * plastic[:3000], rel=1e-12, abs=1e-15)
    assert path.lift == pytest.approx(rise * np.abs(plastic), abs=1e-9)
    assert path.lift[np.argmin(np.abs(plastic[3000:])) + 3000] < 1e-6 * 3.0
    assert path.lift.max() == pytest.approx(rise * np.abs(plastic).max(), rel=1e-9)


def test_dilation_ends_at_its_slip_distance_and_starts_to_close_there():
    rise, far = np.tan(np.radians(20.0)), 1e-3
    slip = np.r_[np.linspace(0.0, 3e-3, 3000), np.linspace(3e-3, 0.0, 3000)]
    path = along(dilatant(), slip=slip, pressure=SIGMA, dilatant_slip=far)
    plastic = slip + path.shear / KS
    assert path.lift == pytest.approx(rise * np.minimum(np.abs(plastic), far), abs=1e-9)
    assert path.lift[2999] == pytest.approx(rise * far, rel=1e-9)


def test_slip_round_a_bend_lifts_by_its_distance_from_the_start():
    from joint_points import law_row

    from dem.kernels.joint_law import return_map
    from dem.kernels.joint_strength import peak_of, softening_of

    row = law_row(dilatant())
    peak, fall = peak_of(row, 0), softening_of(row, 0)
    angle = np.linspace(0.0, 2 * np.pi, 4001)
    way = 1e-3 * np.column_stack([1.0 - np.cos(angle), np.sin(angle)])  # a circle back to the start
    state = (0.0, 0.0, 0.0, 0.0)
    for e1, e2 in way:
        out = return_map(state[2] - SIGMA / KN, e1, e2, *state, peak, fall, (0.0,) * 5, True, (0.0,) * 3)
        state = out[3:7]
        assert state[2] == pytest.approx(np.tan(np.radians(20.0)) * np.hypot(state[0], state[1]), abs=2e-9)


@pytest.mark.parametrize("psi", [10.0, 30.0])
def test_a_dilating_joint_takes_energy_in_every_loop_of_slip(psi):
    s = np.linspace(0.0, 6 * np.pi, 30_000)
    slip = 2e-3 * np.sin(s)
    for opening in (np.full(len(s), -SIGMA / KN), -SIGMA / KN * (1.0 + 0.5 * np.sin(2 * s))):
        path = along(dilatant(psi), opening=opening, slip=slip, dilatant_slip=1e-3)
        for k in range(3):
            loop = slice(10_000 * k, 10_000 * (k + 1))
            work = trapezoid(-path.normal[loop], opening[loop]) + trapezoid(-path.shear[loop], slip[loop])
            assert work > 0.0
            stored = (0.5 * (path.normal**2 / KN + path.shear**2 / KS))[loop]
            lost = path.rubbed[loop][-1] - path.rubbed[loop][0]
            assert lost == pytest.approx(work - stored[-1] + stored[0], rel=5e-4)
        # with psi = phi nothing is lost; a step in which slip begins counts shear from below the strength, so that it
        # may lack up to half the product of its elastic stress and motion
        steps = np.diff(path.rubbed)
        begins = 0.5 * (KS * np.diff(slip) ** 2 + KN * np.diff(opening) ** 2)
        assert (steps > -1e-6 - begins).all()
        assert np.count_nonzero(steps < -1e-6) <= 6


@pytest.mark.parametrize("softens", [False, True])
@pytest.mark.parametrize("lifts", [False, True])
def test_the_short_way_of_points_within_their_strength_is_the_law_itself(softens, lifts):
    # with a dashpot of zero the law goes its whole way at every point; the short way is taken where there is none
    from dem.kernels.joint_law import return_map
    from dem.kernels.joint_strength import Peak, SofteningRow

    rng = np.random.default_rng(5)
    within = beyond = 0
    for _ in range(3000):
        kn, ks = 10.0 ** rng.uniform(8, 11, 2)
        c, ft = 10.0 ** rng.uniform(3, 6, 2) * (rng.random(2) < 0.8)
        mu, dil = rng.uniform(0.3, 1.0), rng.uniform(0.0, 0.3) * lifts
        fc = (10.0 ** rng.uniform(6, 7) / kn) if lifts and rng.random() < 0.5 else np.inf
        peak = Peak(kn, ks, mu, dil, c, ft, fc, 1e-3 * dil, None)
        fall = SofteningRow(-0.3 * mu, -dil * rng.random(), -c, -ft, 10.0 ** rng.uniform(2, 12), rng.choice([0.0, 1e6]),
                    rng.choice([0.0, 1.0]) * kn / 1e6) if softens else None
        damage = rng.choice([0.0, rng.random(), 1.0]) if softens else 0.0
        # from pulled apart to pressed well, and from at rest to past the strength
        n = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(2, 7)
        shear = (c + mu * abs(n)) * rng.choice([rng.random(), 1.0 - 1e-7, 1.0 + 1e-7, 1.5])
        way = rng.uniform(0.0, 2.0 * np.pi)
        s1, s2 = 1e-5 * rng.standard_normal(2) * (rng.random() < 0.7)
        lift = dil * np.hypot(s1, s2) if lifts else 0.0
        e1, e2 = s1 - shear / ks * np.cos(way), s2 - shear / ks * np.sin(way)
        points = lift - n / kn, e1, e2, s1, s2, lift, damage, peak, fall
        short, whole = (return_map(*points, dashpot, lifts, (0.0,) * 3) for dashpot in (None, (0.0,) * 5))
        stress = abs(n) + shear + c + ft
        scale = np.array([stress] * 3 + [abs(s1) + abs(s2) + stress / min(kn, ks)] * 3 + [1.0] + [stress**2 / ks] * 4)
        np.testing.assert_allclose(np.array(short) / scale, np.array(whole) / scale, rtol=0.0, atol=1e-9)
        still = short[3:7] == (s1, s2, lift, damage)
        within, beyond = within + still, beyond + (not still)
    assert min(within, beyond) > 300
