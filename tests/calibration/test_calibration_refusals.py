"""Calibration: input that is refused, and models that do not answer, by name."""

import math

import pytest
from calibrated_models import power_law

import limitmason as lm
from limitmason.calibration import CurveTarget, JointModel, Parameter, SearchSettings, Target, calibrate
from limitmason.diagnosis import Cause


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"targets": {"q": (1.0, 0.1)}}, "returns no 'q'"),
        ({"targets": {}}, "mapping of what was measured"),
        ({"targets": {"a": (1.0, 0.1), "b": 2.0}}, "all or none"),
        ({"targets": {"a": 1.0, "b": 2.0}}, "without a scatter"),
        ({"targets": {"a": (-1.0, 0.1)}}, "not positive"),
        ({"parameters": [Parameter("x", 1.0, (0.1, 9.0)), Parameter("w", 1.0, (0.1, 9.0))]}, "no model takes"),
        ({"parameters": [Parameter("x", 1.0, (0.1, 9.0))]}, "the model needs 'y': give Parameter\\('y'"),
        ({"targets": {"a": [6.3, 1.4]}}, r"write Target\(values, 0.05\)"),
        ({"targets": {"a": (6.3, 5)}}, "5, 500 %: in the unit of the value it is .*absolute=True"),
        ({"parameters": []}, "nothing to fit"),
        ({"leave_out": "geometry"}, "leave_out"),
        ({"model": "panel"}, "function of the parameters"),
        ({"search": 3}, "search must be .*SearchSettings"),
        ({"level": "95"}, "level"),
        ({"ties": "y = x"}, "ties must read"),
        ({"targets": {"A": {"a": (6.3, 0.05)}, "B": {"b": (1.4, 0.1)}}, "leave_out": {"A": "g", "B": "h", "C": "g"}},
         "names 'C', which is no test"),
    ],
)
def test_wrong_input_is_named(changes, message):
    given = {"model": power_law, "targets": {"a": (6.3, 0.05), "b": (1.4, 0.1)},
             "parameters": [Parameter("x", 1.0, (0.1, 9.0)), Parameter("y", 1.0, (0.1, 9.0))], **changes}
    with pytest.raises(lm.errors.InputError, match=message):
        calibrate(**given)


@pytest.mark.parametrize("level", [0, 1, 1.5, -0.5, 95, math.nan, "95"])
def test_a_prediction_at_a_level_that_is_none_is_refused(level):
    fit = calibrate(power_law, {"a": (6.3, 0.05), "b": (1.4, 0.05)},
                    [Parameter("x", 1.0, (0.1, 9.0)), Parameter("y", 1.0, (0.1, 9.0))], level=None)
    with pytest.raises(lm.errors.InputError, match="level must"):
        fit.predict(lambda x, y: {"z": x * y}, level=level)


def test_intervals_about_a_model_that_misses_its_targets_say_that_they_are_too_narrow():
    # a scatter stated ten times too small: of 95 % intervals some 15 % hold the truth
    fit = calibrate(power_law, {"a": (6.3, 0.005), "b": (1.4, 0.005)}, [Parameter("x", 1.0, (0.1, 2.0)),
                                                                        Parameter("y", 1.0, (0.9, 1.1))], level=None)
    assert fit.misfit > 100.0
    assert "the intervals hold the true values less often than they say" in str(fit)


def test_model_that_never_answers_says_why():
    def model(x):
        raise lm.errors.NotConverged("no balance found")

    with pytest.raises(lm.errors.NotConverged, match="no balance found"):
        calibrate(model, {"a": (1.0, 0.1)}, [Parameter("x", 1.0, (0.1, 9.0))])


@pytest.mark.parametrize("starts", [1, 4])
def test_a_target_without_a_number_is_an_error_that_names_it(starts):
    """The others alone would be met to the last digit, at a misfit of 30 deviations squared for this one."""
    targets, x = {"a": (2.0, 0.1), "b": (3.0, 0.1)}, [Parameter("x", 1.0, (0.1, 9.0))]
    effort = SearchSettings(starts=starts)
    with pytest.raises(lm.errors.NotConverged, match="no number for 'b' .*0 of .* leave the target out"):
        calibrate(lambda x: {"a": x, "b": math.nan}, targets, x, search=effort)
    with pytest.raises(lm.errors.NotConverged, match="no number for 'b' .* not positive"):
        calibrate(lambda x: {"a": x, "b": -x}, targets, x, search=effort)


def test_a_target_whose_model_refuses_says_why():
    def refuses(x):
        raise lm.errors.NotApplicable("beyond the theory")

    models = {"one": lambda x: {"a": x}, "other": refuses}
    targets = {"one": {"a": (2.0, 0.1)}, "other": {"b": (3.0, 0.1)}}
    with pytest.raises(lm.errors.NotConverged, match="for 'b' .*NotApplicable: beyond the theory"):
        calibrate(models, targets, [Parameter("x", 1.0, (0.1, 9.0))])


def test_region_without_an_answer_is_a_wall():
    def model(x):
        if x > 4.0:
            raise lm.errors.NotApplicable("beyond four")
        return {"a": x}

    fit = calibrate(model, {"a": (3.9, 0.1)}, [Parameter("x", 1.0, (0.1, 9.0))], leave_out=None)
    assert fit.parameters["x"] == pytest.approx(3.9, rel=1e-4)
    assert fit.interval["x"][1] == pytest.approx(4.0, rel=1e-2)


def power_fit():
    return calibrate(power_law, {"a": (6.3, 0.05), "b": (1.4, 0.05)},
                     [Parameter("x", 1.0, (0.1, 9.0)), Parameter("y", 1.0, (0.1, 9.0))], level=None)


def test_a_fit_asks_another_model_for_numbers_and_scatters_that_tell_something():
    fit = power_fit()
    assert fit.left_out.by == "quantity"  # what "test" means where there is one
    for scatter, message in (({"z": 0.0}, "must be positive"), ({"z": -0.1}, "must be positive"),
                             ({"z": 3.0}, "relative"), ({"z": math.nan}, "finite"), ({}, "measures nothing"),
                             ({"q": 0.1}, "gives no 'q'")):
        with pytest.raises(lm.errors.InputError, match=message):
            fit.next_test({"more": (lambda x, y: {"z": x * y}, scatter)})
    for wrong in ({"more": power_law}, {"more": (power_law, 0.05)}, [("more", (power_law, {"a": 0.05}))]):
        with pytest.raises(lm.errors.InputError, match="candidates must read"):
            fit.next_test(wrong)
    with pytest.raises(lm.errors.InputError, match="no finite 'value'"):
        fit.predict(lambda x: math.nan)


CURVE = lm.Curve([0, 1, 2, 3], [0, 5, 6, 4])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Parameter("x", 1.0, (0.1, 9.0), resolution="fine"), "resolution must be a number"),
        (lambda: Target("tall"), "target must be numbers"),
        (lambda: CurveTarget(None), "curve of a target"),
        (lambda: CurveTarget(CURVE, points=2.5), "whole number"),
        (lambda: CurveTarget(CURVE, {"peak": 0.05, "aera": 0.1}, features=["peak"]), "'aera', which is not among"),
        (lambda: SearchSettings(seed=-1), "seed must be"),
        (lambda: CurveTarget(CURVE, 0.05, point_scatter=0.1), "give points="),
    ],
)
def test_wrong_statements_are_named(call, message):
    with pytest.raises(lm.errors.InputError, match=message):
        call()


def test_features_of_a_curve_may_come_from_an_iterator():
    assert CurveTarget(CURVE, 0.05, features=iter(("peak",))).features == ("peak",)


@pytest.mark.parametrize("order", [("one", "other"), ("other", "one")])
def test_every_test_of_one_model_has_its_units_checked(order):
    """Of two tests that one model serves only the last was: 10 mm were taken for 10 m."""
    in_mm = lm.answers.Curve([0.0, 1.0, 2.0], [0.0, 10.0, 12.0], "mm", "kN")
    in_m = in_mm.in_units("m", 1e-3, "kN", 1.0)
    targets = {name: {"curve": CurveTarget(c, 0.05, ("stiffness",))} for name, c in (("one", in_mm), ("other", in_m))}
    with pytest.raises(lm.errors.InputError, match="measured in mm, kN and is computed in m, kN"):
        calibrate(lambda k: in_m.in_units("m", 1.0, "kN", k), {name: targets[name] for name in order},
                  [Parameter("k", 1.0, (0.5, 2.0))], leave_out=None, level=None)


def test_two_parameters_of_one_property_of_a_joint_are_refused():
    wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    with pytest.raises(lm.errors.InputError, match="'one' and 'all' are both the cohesion of bed joints"):
        JointModel(wall, lambda _: 1.0, of={"one": ("cohesion", ["bed"]), "all": ("cohesion", [])})
    JointModel(wall, lambda _: 1.0, of={"one": ("cohesion", ["bed"]), "other": ("cohesion", ["head"])})
    with pytest.raises(lm.errors.InputError, match="write .property, .kinds.."):
        JointModel(wall, lambda _: 1.0, of={"one": ("cohesion", "bed")})


def test_what_another_model_gives_at_the_fit_alone_is_named():
    fit = calibrate(lambda k: {"peak": k}, {"peak": (1.0, 0.05)}, [Parameter("k", 1.0, (0.5, 2.0))], level=None)

    def modes(k):
        return {"modes": [k, 2.0 * k] if k < 1.01 else [k]}

    with pytest.raises(lm.errors.InputError, match="gives 'modes 1' at the fit, and not one deviation"):  # KeyError
        fit.predict(modes)


def test_a_cause_may_stand_in_for_a_tied_parameter():
    measured = {f"x{i}": (1.0 + 0.1 * i, 0.05) for i in range(5)}
    fit = calibrate(lambda k, twice: {n: k * (1.0 + 0.1 * i) * twice / 2.0 for i, n in enumerate(measured)}, measured,
                    [Parameter("k", 1.0, (0.5, 2.0))], ties={"twice": "0 * k + 2"}, level=None, leave_out=None)
    tied = Cause("twice", "twice", 2.0, (1.0, 3.0))
    assert fit.diagnose([tied], refit=(), draws=99).kind == "none"  # a keyword came twice: a TypeError
