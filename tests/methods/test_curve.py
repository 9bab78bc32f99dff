"""One curve for every method and test: peak, limit points, stiffness and work of curves known in closed form."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.answers.curve import Event
from limitmason.diagnosis.curves import features
from limitmason.errors import InputError


def rocking(n=401):
    """lambda = tan(alpha - theta) of a rigid block against its top's travel, with a steep elastic start."""
    u = np.linspace(0.0, 0.2, n)
    return lm.Curve(np.r_[0.0, u + 1e-4], np.r_[0.0, 0.2 - u], load_unit="-")


def test_peak_and_ultimate_of_a_rocking_block():
    curve = rocking()
    assert curve.peak.load == pytest.approx(0.2)
    assert curve.peak.displacement == pytest.approx(1e-4)
    for n in (3, 8, 401):  # wherever samples lie on the straight branch
        at = rocking(n).ultimate(0.5)
        assert (at.displacement, at.load) == pytest.approx((0.1 + 1e-4, 0.1), rel=1e-12)
    assert curve.ultimate(1.0) == curve.peak
    assert curve.ultimate(0.0).load == pytest.approx(0.0, abs=1e-12)


def test_a_curve_without_a_way_up_has_no_stiffness():
    rigid = lm.Curve([0.0, 0.0, 1.0], [0.0, 10.0, 10.0])
    assert set(rigid.quantities) == {"peak", "drift at peak", "residual"}
    for curve, why in ((rigid, "one displacement"), (lm.Curve([0, 1], [0, 0]), "no way up"),
                       (lm.Curve([0, 1, 2], [-5, -3, -4]), "no way up")):
        with pytest.raises(InputError, match=why):
            curve.stiffness()
        assert "stiffness" not in curve.quantities


def test_a_curve_keeps_its_own_errors_and_leaves_those_of_its_maker_alone():
    energy = np.array([0.0, 0.1])
    curve = lm.Curve([0, 1], [0, 1], errors={"energy": energy})
    energy[1] = 9.0
    assert curve.errors["energy"][1] == 0.1
    with pytest.raises(InputError, match="'crack' is at sample 0.5"):
        lm.Curve([0, 1], [0, 1], events=(Event("crack", 0.5),))


def test_curve_recorded_the_other_way_is_the_mirror_image():
    u = np.linspace(0.0, 10.0, 201)
    one = lm.Curve(u, np.where(u < 3.0, 4.0 * u, 12.0 - 0.5 * (u - 3.0)), "mm", "kN")
    for rest in (0.0, 0.05):  # noise about zero, at rest
        other = lm.Curve(np.r_[rest, -u[1:]], np.r_[rest, -one.load[1:]], "mm", "kN")
        mirrored = {name: value if name == "stiffness" else -value for name, value in one.quantities.items()}
        assert other.quantities == pytest.approx(mirrored)
        assert other.first_limit_point.displacement == pytest.approx(-3.0)
        assert other.at([-2.0, -7.0]) == pytest.approx([-8.0, -10.0])
        with pytest.raises(InputError, match=r"pushed the other way: give curve.in_units\('mm', -1.0"):
            features("a", other, load_error=0.02, displacement_error=0.05)
    # cycles have two senses, and the largest load of one of them
    assert lm.Curve([0.0, 1.0, 0.0, -1.0], [0.0, 2.0, 0.0, -3.0]).peak.load == 2.0


def test_work_of_a_straight_line_is_half_its_rectangle():
    curve = lm.Curve([0.0, 1.0, 3.0], [0.0, 2.0, 6.0])
    assert curve.work == pytest.approx([0.0, 1.0, 9.0])
    assert curve.stiffness() == pytest.approx(2.0)
    assert curve.at([0.5, 2.0]) == pytest.approx([1.0, 4.0])
    assert np.isnan(curve.at([3.5])).all()


def test_stiffness_between_shares_of_the_peak_is_a_secant():
    # a parabola f = 2 u - u^2 with its peak of 1 at u = 1: f = s at u = 1 - sqrt(1 - s)
    u = np.linspace(0.0, 1.0, 20001)
    secant = lm.Curve(u, 2 * u - u**2).stiffness(0.1, 0.4)
    assert secant == pytest.approx(0.3 / (np.sqrt(0.9) - np.sqrt(0.6)), rel=1e-6)


def test_a_second_branch_may_climb_above_the_first_limit_point():
    curve = lm.Curve([0, 1, 2, 3, 4], [0.0, 0.33, 0.32, 0.34, 0.30])
    assert curve.first_limit_point.load == 0.33
    assert curve.peak.load == 0.34
    assert lm.Curve([0, 1], [0, 1]).first_limit_point is None


def test_cycles_have_work_but_no_single_load_at_a_displacement():
    # a rectangle of friction passed round once dissipates 4 F u
    curve = lm.Curve([0, 1, 1, -1, -1, 0], [3, 3, -3, -3, 3, 3])
    assert curve.work[-1] == pytest.approx(4 * 3 * 1)
    with pytest.raises(ValueError, match="turns back"):
        curve.at(0.5)


def test_events_point_at_samples():
    curve = lm.Curve([0, 1, 2], [0, 5, 4], events=(Event("peak", 1), Event("first crack", 0, "bed-3", 1.5e-4)))
    assert [e.name for e in curve.events] == ["first crack", "peak"]
    assert curve.event("peak").load == 5
    assert curve.event("jump") is None


def test_units_change_values_and_names():
    curve = lm.Curve([0.0, 0.002], [0.0, 5e3]).in_units("mm", 1e3, "kN", 1e-3)
    assert (curve.displacement[-1], curve.load[-1], curve.load_unit) == (2.0, 5.0, "kN")
    u, f = curve
    assert u is curve.displacement
    assert f is curve.load


@pytest.mark.parametrize(
    "arguments, message",
    [
        (dict(displacement=[0, 1], load=[0.0]), "2 displacements and 1 loads"),
        (dict(displacement=[0, np.nan], load=[0, 1]), "displacement is not finite at sample 1"),
        (dict(displacement=[], load=[]), "at least one number"),
        (dict(displacement=[0, 1], load=[0, 1], errors={"energy": [0.0]}), "'energy' has shape"),
        (dict(displacement=[0, 1], load=[0, 1], states=(1,)), "1 states for 2 samples"),
        (dict(displacement=[0, 1], load=[0, 1], events=(Event("jump", 2),)), "'jump' is at sample 2"),
    ],
)
def test_columns_that_do_not_fit_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        lm.Curve(**arguments)


def test_a_curve_is_frozen():
    curve = rocking()
    with pytest.raises(ValueError, match="read-only"):
        curve.load[0] = 1.0


def test_quantities_of_a_curve_are_what_a_test_would_write_down():
    curve = lm.Curve([0, 1, 2, 4], [0, 5, 4, 2], events=(Event("first crack", 1), Event("first crack", 2)))
    assert curve.quantities == pytest.approx({
        "peak": 5.0, "drift at peak": 1.0, "residual": 2.0, "stiffness": 5.0, "drift at 80 %": 2.0, "first crack": 5.0,
        "drift at first crack": 1.0,
    })
    assert "stiffness" not in lm.Curve([0, 1], [3, 2]).quantities


def stack(width=0.2):
    joint = lm.Joint(60.0, dilatancy_angle_deg=60.0, normal_stiffness=1e9, shear_stiffness=4e8)
    made = lm.build.column(width=width, depth=0.3, unit_height=0.2, courses=2, joint=joint)
    return made, lm.Loads.horizontal(made)


def test_one_answer_holds_what_several_methods_find_of_one_model():
    model = stack()
    found = lm.answer(*model, {"peak": "limit", "opened base|column-1": "limit", "slid base|column-1": "limit",
                               "opened column-1|column-2": "limit", "frequency 2": "modes",
                               "weight": lambda a, _: a.weights[1:].sum()})
    # slender: it rocks about the edge of its base, as one
    assert found["peak"] == pytest.approx(0.5)
    assert [found[q] for q in list(found.quantities)[1:4]] == [1.0, 0.0, 0.0]
    assert found["frequency 2"] == pytest.approx(lm.modes(model[0], 2).frequency[1])
    assert found["weight"] == pytest.approx(model[0].weights[1:].sum())
    assert set(found.by) == {"limit", "modes"}
    for wanted, options, words in (
        ({"stiffness": "limit"}, {}, "does not find 'stiffness'; it finds peak"),
        ({"peak": "limit"}, {"modes": {}}, "options of 'modes': no quantity"),
        ({"peak": "limit"}, {"limit": {"drive": 1}}, "follows no drive"),
        ({"load at x": "limit"}, {}, "'load at x': write a displacement in the curve's unit, as in 'load at 0.001'"),
        (["peak"], {}, r"a mapping such as {'peak': 'limit'}"),
    ):
        with pytest.raises(ValueError, match=words):
            lm.answer(*model, wanted, **options)


@pytest.mark.slow
def test_the_path_answers_peak_stiffness_and_drift_of_one_curve():
    model = stack()
    found = lm.answer(*model, {"peak": "pushover", "stiffness": "pushover", "drift at peak": "pushover"})
    (by,) = found.by.values()
    curve = by.details["curve"]
    assert found["peak"] == by.collapse_multiplier
    assert found["stiffness"] == pytest.approx(curve.stiffness())
    assert found["drift at peak"] == by.details["limit point displacement"]


def test_events_come_from_any_iterable_and_wrong_kinds_of_bounds_are_named():
    curve = lm.Curve([0.0, 1.0], [0.0, 1.0], events=iter([Event("first crack", 1)]))
    assert curve.event("first crack").index == 1
    with pytest.raises(InputError, match="kind of a bound must be one of"):
        lm.answers.Bound("sharp")


def cycled(turns, back, end):
    """A test of 5 kN/mm to 10 kN, then -0.5 kN/mm, unloaded and loaded again at 6 kN/mm from each turn, then to end."""
    u, f, far = [0.0], [0.0], 0.0
    for turn, down in zip(turns, [*(back * t for t in turns[:-1]), end], strict=True):
        rising = np.arange(u[-1], turn + 1e-9, 0.05)[1:]
        falling = np.arange(turn, down, -0.05)[1:]
        envelope = np.interp([*rising, far, turn], [0.0, 2.0, 10.0], [0.0, 10.0, 6.0])
        again = envelope[-2] - 6.0 * (far - rising)
        u += [*rising, *falling]
        f += [*np.maximum(np.where(rising >= far, envelope[:-2], again), 0.0)]
        f += [*np.maximum(envelope[-1] - 6.0 * (turn - falling), 0.0)]
        far = turn
    return np.array(u), np.array(f)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_cycles_of_a_test_are_no_fall_of_its_load(sense):
    """By hand: peak 10 at 2, 80 % of it at 2 + 2 / 0.5 = 6, and 6 at the largest displacement, 10."""
    u, f = cycled([1.0, 3.0, 5.0, 7.0, 10.0], 0.3, 8.5)
    found = lm.Curve(sense * u, sense * f, "mm", "kN").quantities
    wanted = {"peak": 10.0, "drift at peak": 2.0, "residual": 6.0, "drift at 80 %": 6.0}
    assert {k: found[k] for k in wanted} == pytest.approx({k: sense * v for k, v in wanted.items()}, abs=1e-6)
    assert found["stiffness"] == pytest.approx(5.0)
    # the drift was 2.92 of the first unloading, the residual that at the end of the last
    assert lm.Curve(sense * u, sense * f, "mm", "kN", status="solved").quantities["residual"] == sense * f[-1]


def test_features_say_where_a_record_does_not_begin_at_zero_and_refuse_one_column_of_another_sign():
    u, f = np.array([0.0, 2.0, 10.0]), np.array([0.0, 10.0, 6.0])
    errors = {"load_error": 0.02, "displacement_error": 0.05}
    with pytest.warns(UserWarning, match="specimen a begins at 0.3 mm and 0 kN: an offset is read as displacement"):
        found = features("a", lm.Curve(u + 0.3, f, "mm", "kN"), **errors)
    assert {o.quantity: o.value for o in found}["drift at peak"] == 2.3
    with pytest.warns(UserWarning, match="stiffness of specimen a: left out, the curve starts at 1.5 kN, beyond 1.15"):
        features("a", lm.Curve(u, f + 1.5, "mm", "kN"), **errors)
    with pytest.raises(InputError, match=r"loads below zero alone: give curve.in_units\('mm', 1.0, 'kN', -1.0\)"):
        features("a", lm.Curve(u, -f, "mm", "kN"), **errors)  # was no row at all, with a warning
    with pytest.raises(InputError, match=r"displacements below zero alone: give curve.in_units\('mm', -1.0"):
        features("a", lm.Curve(-u, f, "mm", "kN"), **errors)  # was peak and residual
