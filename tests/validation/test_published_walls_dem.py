"""Published walls that the DEM takes long for: Rondelet's wallette, and the sixth of Ferris and Tin-Loi."""

import functools

import pytest

import dem
import limitmason as lm

collapse = functools.partial(dem.collapse, error_budget=())


@pytest.mark.slow
def test_rondelet_wallette_reaches_the_associative_program_when_its_joints_are_stiff():
    # at the published 14 GPa/m the column's blocks turn on their joints: 5 % lower, gone at ten times the stiffness
    a = lm.experiments.load("rondelet-wallette", "toothed-odd-flush", dilatancy_deg=35.0).assembly()
    loads = lm.Loads.horizontal(a, (0, 1, 0))
    exact = lm.limit_analysis(a, loads, contact_model="grid", grid=(2, 8)).collapse_multiplier
    errors = []
    for factor in (0.1, 1.0, 10.0):
        p = collapse(
            a, loads, contact_points=(2, 8), tolerance=2e-3, joint_options=dem.JointOptions(stiffness_factor=factor)
        )
        errors.append(1.0 - p.collapse_multiplier / exact)
    assert errors[0] > errors[1] > errors[2] > 0.0
    assert errors[2] < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(("psi", "published"), [(35.0, 0.40), (0.0, 0.40 / 1.25)])
def test_three_assumed_bonds_of_rondelets_wallette_lie_within_a_tenth_of_3dec_at_two_points_along(psi, published):
    # the bond is not published, so three that stand are tried. 0.40 is printed for psi = phi; 0.32 follows from a
    # difference "of the order of 25 %". Two points along a unit are too strong in torsion at psi = 0: the agreement
    # there is one of this discretisation (examples/rondelet_contact_points.py: 0.254 at eight)
    found, rigid = [], []
    for bond in ("toothed-odd-flush", "toothed-even-flush", "toothed-odd-ragged"):
        a = lm.experiments.load("rondelet-wallette", bond, dilatancy_deg=psi).assembly()
        p = collapse(a, lm.Loads.horizontal(a, (0, 1, 0)), contact_points=(2, 8))
        found.append(p.collapse_multiplier)
        if psi:
            program = lm.limit_analysis(a, lm.Loads.horizontal(a, (0, 1, 0)), contact_model="grid", grid=(2, 8))
            rigid.append(program.collapse_multiplier)
    assert found == [pytest.approx(published, rel=0.1)] * 3
    if psi:
        # associated: joints that bend stay below rigid ones of the same points, and one of them meets 0.40 as printed
        # with two digits. The bending joints themselves lay within 3 % when eight points were 4 % too stiff in bending
        assert all(value < most for value, most in zip(found, rigid, strict=True))
        assert min(abs(value - published) for value in rigid) < 0.005
    else:
        assert min(abs(value / published - 1.0) for value in found) < 0.03


@pytest.mark.slow
def test_ferris_tin_loi_wall_6_with_rounded_ends_agrees_with_our_non_associative_value():
    # it read 5 % low while loads that settle after 60,000 to 170,000 steps were given up. Of a bracket its lower end
    # counts, so a wide one does
    a = lm.experiments.load("ferris-tin-loi-2001", "wall-6", rounding=0.02).assembly()
    loads = lm.Loads.horizontal(a)
    softer = dem.JointOptions(stiffness_factor=0.1)
    p = collapse(a, loads, contact_points=(2, 2), joint_options=softer, tolerance=5e-2)
    exact = lm.limit_analysis(a, loads, "non-associative", search="quick").collapse_multiplier
    assert p.collapse_multiplier == pytest.approx(exact, rel=0.03)


@pytest.mark.slow
def test_a_load_refused_after_a_long_stride_is_tried_again_from_close_by():
    # wall 6 read 0.265 at every dilatancy angle: refused from 0.2125, it stands when reached in small steps
    a = lm.experiments.load("ferris-tin-loi-2001", "wall-6", rounding=0.02, dilatancy_deg=33.0).assembly()
    p = collapse(
        a, lm.Loads.horizontal(a), contact_points=(2, 2), first_increment=0.02, tolerance=1e-2,
        damping=dem.Damping(0.8), joint_options=dem.JointOptions(stiffness_factor=0.1),
    )
    exact = lm.limit_analysis(a, lm.Loads.horizontal(a)).collapse_multiplier
    assert 0.28 < p.collapse_multiplier < 1.001 * exact
