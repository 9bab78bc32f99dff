"""Murano et al.: what of Table 10 can be reproduced, the stiffness conversions of section 5, the light-damage load."""

import math

import numpy as np
import pytest
from u_wall_blocks import murano_table_10 as murano

import mechanisms as me
from limitmason.mechanics import stiffness_from_moduli as stiffness


def test_weight_behind_the_loads_of_mechanism_a():
    weight = murano.murano_facade("DS").weight
    assert weight == pytest.approx(22.33e3, abs=5.0)
    for wall in ("DS", "REGW"):
        assert murano.PRINTED_LOAD[wall, "A"] / murano.PRINTED_FACTOR[wall, "A"] == pytest.approx(weight, rel=1e-3)


def test_line_load_and_friction_coefficients():
    assert murano.line_load() == pytest.approx(5.48e3, abs=1.0)
    found = [murano.murano_facade(wall).friction for wall in ("DS", "REGW")]
    assert found == pytest.approx([0.1763, 0.6494], abs=5e-5)


def test_printed_crack_angle_is_over_the_unit_length():
    facade = murano.murano_facade("DS")
    assert math.degrees(math.atan(facade.steepest_crack)) == pytest.approx(32.6, abs=0.05)
    assert math.degrees(math.atan(0.144 / 0.29)) == pytest.approx(26.4, abs=0.05)


def test_light_damage_rows_are_the_printed_ones():
    # kN/mm, mm, kN as Table 10 prints them; 0.50 mm stood here for the 0.57 of the macro-model of DS
    printed = [(2.15, 0.47, 0.99), (2.80, 0.48, 1.31), (3.10, 0.57, 0.83), (4.18, 0.50, 2.05),
               (29.80, 0.33, 9.63), (46.09, 0.22, 9.93), (46.42, 0.24, 10.91), (43.08, 0.23, 9.71)]
    rows = [(r.stiffness / 1e6, r.displacement * 1e3, r.load / 1e3) for r in murano.LIGHT_DAMAGE]
    assert rows == [pytest.approx(p) for p in printed]


@pytest.mark.parametrize("row", murano.LIGHT_DAMAGE, ids=lambda r: f"{r.wall} {r.by}")
def test_percentages_of_table_10(row):
    found = murano.percentages(row)
    for k, name in enumerate("ABD"):
        if (row.wall, name) == ("REGW", "D"):
            continue
        assert found[k] == pytest.approx(row.percent[k], abs=0.75)


@pytest.mark.parametrize("row", [r for r in murano.LIGHT_DAMAGE if r.wall == "REGW"], ids=lambda r: r.by)
def test_printed_flexure_load_of_regw_contradicts_its_percentages(row):
    assert abs(murano.percentages(row)[2] - row.percent[2]) > 8.0
    repaired = {**murano.PRINTED_LOAD, ("REGW", "D"): 2.60e3}
    assert murano.percentages(row, repaired)[2] == pytest.approx(row.percent[2], abs=0.75)


def test_weights_behind_b_and_d_do_not_agree():
    implied = {k: murano.PRINTED_LOAD[k] / murano.PRINTED_FACTOR[k] for k in murano.PRINTED_LOAD}
    for name in "BD":
        assert abs(implied["DS", name] / implied["REGW", name] - 1.0) > 0.4


def test_fit_of_simple_rocking_is_a_documented_fit():
    # one reading out of 1 920: closeness is all that is claimed
    assert murano.fitted_simple_rocking("DS") == pytest.approx(0.09, rel=0.02)
    assert murano.fitted_simple_rocking("REGW") == pytest.approx(0.231, rel=0.02)


def test_recomputed_table_10_beside_the_printed_one():
    rows = {(r.wall, r.mechanism): r for r in murano.table_10()}
    expected = {("DS", "A"): 0.2144, ("DS", "B"): 0.2140, ("DS", "D"): 0.2369,
                ("REGW", "A"): 0.3426, ("REGW", "B"): 0.2977, ("REGW", "D"): 0.3211}
    assert {k: r.recomputed for k, r in rows.items()} == pytest.approx(expected, abs=5e-5)
    assert all((r.fitted is not None) == (k[1] == "A") for k, r in rows.items())
    assert rows["DS", "A"].printed_factor == 0.09
    # no closer at the hinge, the crack and the k that the paper states: factors 2 and more from the print
    assert rows["DS", "D"].as_stated / rows["DS", "D"].printed_factor > 2.0
    assert rows["DS", "A"].as_stated / rows["DS", "A"].printed_factor > 2.0
    for word in ("Reproduced", "Not reproduced", "cannot serve"):
        assert word in murano.VERDICT


def test_section_7_hinges_and_angles_on_the_murano_geometry():
    ds, regw = murano.murano_facade("DS"), murano.murano_facade("REGW")
    assert [me.simple_rocking(f).details["hinge_courses"] for f in (ds, regw)] == [6, 5]
    b = [me.compound_rocking(f, crossed_courses="hinge").details for f in (ds, regw)]
    assert [d["hinge_courses"] for d in b] == [6, 6]
    assert [d["crack_angle_deg"] for d in b] == pytest.approx([1.6, 17.8], abs=0.05)
    d = [me.horizontal_flexure(f).details["crack_angle_deg"] for f in (ds, regw)]
    assert d == pytest.approx([23.5, 32.62], abs=0.05)


def test_section_6_readings_of_a_and_d():
    ds, regw = murano.murano_facade("DS"), murano.murano_facade("REGW")
    for hinge, expected in ((6, (0.214, 0.350)), (4, (0.261, 0.346))):
        found = [me.simple_rocking(f, hinge_courses=hinge).collapse_multiplier for f in (ds, regw)]
        assert found == pytest.approx(expected, abs=6e-4)
    at = {"crack_tangent": math.tan(math.radians(13.0)), "contact_factor": 0.5, "interaction": True}
    found = [me.horizontal_flexure(ds, hinge_courses=n, **at).collapse_multiplier for n in (6, 4)]
    assert found == pytest.approx([0.164, 0.191], abs=6e-4)


# ---- section 5 ------------------------------------------------------------------------------------------------------


def test_table_5_moduli_from_joint_stiffness():
    # Gonen: 4.00e8 Pa from 2.0e9 Pa/m over units of 0.2 m; the Itasca column agrees with rigid blocks and that spacing
    assert stiffness.masonry_modulus(math.inf, 2.0e9, 0.2) == pytest.approx(4.00e8)
    # with the 1 cm of the text it would be twenty times less
    assert stiffness.masonry_modulus(math.inf, 2.0e9, 0.01) == pytest.approx(2.0e7)


def test_table_8_takes_the_stone_of_table_5_but_not_one_height_of_units():
    # Table 5, Bui: 3.93e8 Pa from 2.0e9 Pa/m over 0.20 m, so the stone has 22.5 GPa (20.9 to 24.2 by its digits)
    def stone(masonry, normal_stiffness, height):
        return 1.0 / (1.0 / masonry - 1.0 / (normal_stiffness * height))

    of_table_5 = stone(3.93e8, 2.0e9, 0.20)
    assert of_table_5 == pytest.approx(22.5e9, rel=0.01)
    # Table 8: 4.20e9 Pa/m; Itasca and Bui print 8.20e8 Pa. The same stone and height give that within 1.5 %
    assert stiffness.masonry_modulus(of_table_5, 4.20e9, 0.20) == pytest.approx(8.20e8, rel=0.015)
    # Gonen prints 9.00e8 Pa, which is no k_n h of 0.20 m (8.40e8) nor of the 0.225 m of section 6.3 (9.45e8)
    assert stiffness.masonry_modulus(math.inf, 4.20e9, 0.20) == pytest.approx(8.40e8)
    assert stiffness.masonry_modulus(math.inf, 4.20e9, 0.225) == pytest.approx(9.45e8)
    # at the height that it needs, Bui would need a stone of 9 GPa: no height and stone give both tables
    height = 9.00e8 / 4.20e9
    assert stone(8.20e8, 4.20e9, height) == pytest.approx(9.2e9, rel=0.01)
    assert np.mean([8.20e8, 8.20e8, 9.00e8]) == pytest.approx(8.47e8, rel=5e-4)  # the mean that Table 9 takes


@pytest.mark.parametrize("poisson", [0.0, 0.2, 0.39])
def test_conversions_are_inverse_and_consistent(poisson):
    block, masonry, h = 20e9, 0.4e9, 0.2
    k = stiffness.normal_stiffness(block, masonry, h)
    assert 1.0 / masonry == pytest.approx(1.0 / block + 1.0 / (k * h))  # eq (13) as it stands
    assert stiffness.masonry_modulus(block, k, h) == pytest.approx(masonry)
    assert stiffness.normal_stiffness(math.inf, masonry, h) == pytest.approx(masonry / h)  # eq (21)
    # a mortar joint as a spring: its own stiffness less that of the block it replaces
    k_m = stiffness.normal_stiffness(block, 2e9, 0.01)
    assert 1.0 / k_m == pytest.approx(0.01 / 2e9 - 0.01 / block)
    assert stiffness.shear_stiffness(k, poisson) == pytest.approx(k / (2.0 + 2.0 * poisson))
    # eq (17), its denominator with shear moduli
    g_b, g_m = (e / (2.0 + 2.0 * poisson) for e in (block, 2e9))
    assert stiffness.shear_stiffness(k_m, poisson) == pytest.approx(g_b * g_m / (0.01 * (g_b - g_m)))


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: stiffness.normal_stiffness(1e9, 2e9, 0.1), "soft_modulus 2e"),
        (lambda: stiffness.masonry_modulus(1e9, 1e9, 0.0), "spacing must be above zero"),
        (lambda: stiffness.shear_stiffness(1e9, 0.7), "poisson"),
    ],
)
def test_conversions_name_what_is_wrong(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("row", murano.LIGHT_DAMAGE, ids=lambda r: f"{r.wall} {r.by}")
def test_light_damage_loads_of_table_10_are_98_per_cent_of_stiffness_times_displacement(row):
    ratio = 0.98 * row.stiffness * row.displacement / row.load
    if (row.wall, row.by) == ("DS", "FE macro"):
        # 0.98 x 3.10 kN/mm x 0.57 mm = 1.73 kN for the printed 0.83: the row contradicts itself
        assert ratio == pytest.approx(2.09, abs=0.01)
    else:
        assert ratio == pytest.approx(1.0, abs=0.006)


def test_light_damage_on_a_known_curve():
    # F = K d (1 - d / d0): the secant has lost 2 % at d = 0.02 d0
    d = np.linspace(0.0, 4e-3, 4001)
    found = me.light_damage(d, 30e6 * d * (1.0 - d / 0.1), initial_stiffness=30e6)
    assert found.displacement == pytest.approx(2e-3, rel=1e-6)
    assert found.load == pytest.approx(0.98 * 30e6 * 2e-3, rel=1e-6)
    five = me.light_damage(d, 30e6 * d * (1.0 - d / 0.02), drop=0.05)
    assert five.displacement == pytest.approx(1e-3, rel=2e-3)
    assert five.initial_stiffness == pytest.approx(30e6, rel=1e-3)


def test_light_damage_refuses_curves_that_do_not_show_it():
    with pytest.raises(ValueError, match="never loses"):
        me.light_damage([0.0, 1.0, 2.0], [0.0, 5.0, 10.0])
    with pytest.raises(ValueError, match="displacement must grow"):
        me.light_damage([0.0, 1.0, 0.5], [0.0, 5.0, 10.0])
    for name in ("drop", "initial_stiffness"):
        with pytest.raises(ValueError, match=f"{name} must be a finite number, got 'high'"):
            me.light_damage([0.0, 1.0, 2.0], [0.0, 5.0, 9.0], **{name: "high"})
    with pytest.raises(ValueError, match="drop"):
        me.light_damage([0.0, 1.0], [0.0, 5.0], drop=2.0)
