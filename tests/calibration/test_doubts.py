"""Fits that a user should doubt: a bound that binds, a scatter that is stated too small."""

import numpy as np
import pytest

from limitmason import Curve, CurveTarget, Parameter, Target, calibrate
from limitmason.errors import InputError

STRESS = np.array([0.2, 0.5, 1.0, 1.5])


def coulomb(c, mu):
    return {"tau": (c + mu * STRESS).tolist()}


@pytest.mark.parametrize("scatter", [0.02, None])
def test_a_value_that_its_bound_sets_is_not_identified(scatter):
    """Six numbers near 5, bounds up to 4: the data want ln(5 / 4) = 0.22 more, two resolutions."""
    values = 5.0 * np.exp(0.02 * np.array([1.0, -1.0, 0.5, -0.5, 1.5, -1.5]))
    fit = calibrate(lambda e: {"k": [e] * 6}, {"k": Target(values.tolist(), scatter)},
                    [Parameter("e", 2.0, (0.1, 4.0))], leave_out=None)
    assert fit.parameters["e"] == 4.0
    assert fit.identified == ()  # was ("e",), with the interval 3.56 to 4
    assert fit.open_sides == {"e": ("above",)}
    assert "e lies on its bound, and the targets ask for values beyond" in str(fit)
    # the truth on the bound itself is no such case
    fit = calibrate(lambda e: {"k": [e] * 6}, {"k": Target((values / 1.25).tolist(), scatter)},
                    [Parameter("e", 2.0, (0.1, 3.998))], leave_out=None)
    assert fit.identified == ("e",)
    assert fit.warnings == ("e lies on its bound",)


def test_targets_missed_by_twenty_deviations_identify_nothing():
    """Stated 2 %, missed by 21 times as much: the model lacks a cohesion of 0.35, and finds 1.35, not 0.7."""
    values = 0.35 + 0.7 * STRESS
    fit = calibrate(lambda mu: {"tau": (mu * STRESS).tolist()}, {"tau": Target(values.tolist(), 0.02)},
                    [Parameter("mu", 0.6, (0.2, 1.5))], leave_out=None)
    # the fit is the mean of ln(tau / sigma), so that the misfit is known by hand
    apart = np.log(values / STRESS)
    misfit = float(((apart - apart.mean()) ** 2).sum()) / 0.02**2
    assert fit.misfit == pytest.approx(misfit, rel=1e-4)
    assert fit.identified == ()  # was ("mu",)
    (move,) = fit.unidentified
    # a deviation of 0.02 / sqrt(4), times the misfit over three degrees of freedom, over a resolution of 0.1
    assert move.deviation == pytest.approx(0.01 * np.sqrt(misfit / 3.0) / 0.1, rel=1e-2)
    assert f"deviations {np.sqrt(misfit / 3.0):.3g} times as wide" in str(fit)
    # with the cohesion in the model nothing is missed, and both are held by a scatter of 1 %
    fit = calibrate(coulomb, {"tau": Target(values.tolist(), 0.01)},
                    [Parameter("c", 0.3, (0.01, 1.0)), Parameter("mu", 0.6, (0.2, 1.5))], leave_out=None)
    assert fit.identified == ("c", "mu")
    assert fit.warnings == ()


def test_a_curve_without_noise_is_met_exactly():
    """5 kN/mm up to 10 kN, then 0.5 down: steps on the exact fit divided zero by zero, and asked the model at NaN."""
    def push(k):
        u = np.linspace(0.0, 12.0, 37)
        return {"push": Curve(u, np.where(u < 10.0 / k, k * u, 10.0 - 0.5 * (u - 10.0 / k)), "mm", "kN")}

    u = np.linspace(0.0, 10.0, 101)
    measured = Curve(u, np.where(u < 2.0, 5.0 * u, 11.0 - 0.5 * u), "mm", "kN")
    fit = calibrate(push, {"push": measured}, [Parameter("k", 3.0, (1.0, 20.0))])
    assert fit.parameters["k"] == pytest.approx(5.0, rel=1e-9)
    assert fit.identified == ("k",)


def test_a_unit_is_asked_about():
    """10 kN read as 10000 N; the stiffness of the model reaches a hundredth of that."""
    fit = calibrate(lambda k: {"load": k}, {"load": Target(1e4, 0.05)}, [Parameter("k", 3.0, (1.0, 100.0))])
    assert "load is measured 100 times what the fit gives: are both in one unit?" in fit.warnings
    tests = {"first": {"load": Target(50.0, 0.05)}, "second": {"load": Target(5e4, 0.5)}}
    fit = calibrate(lambda k: {"load": k}, tests, [Parameter("k", 3.0, (1.0, 100.0))])
    assert "load of second is measured" in str(fit)


@pytest.mark.parametrize(("other", "message"), [
    (5, "the other model must be a function of the parameters, got 5"),
    (lambda k, length: k * length, "the other model needs 'length', which was not fitted; known: k"),
])
def test_what_is_predicted_by_is_a_function_of_what_was_fitted(other, message):
    fit = calibrate(lambda k: {"load": k}, {"load": Target(10.0, 0.05)}, [Parameter("k", 3.0, (1.0, 100.0))])
    with pytest.raises(InputError, match=message):  # were TypeErrors of Python
        fit.predict(other)


def test_points_of_one_curve_are_no_independent_numbers():
    """A load cell that reads 5 % high: 100 points of a scatter of 3 % each say 10.5 +- 0.06, which 10 is far from."""
    u = np.linspace(0.0, 10.0, 101)

    def push(top):
        return {"push": Curve(u, np.minimum(5.0 * u, top), "mm", "kN")}

    measured = push(10.5)["push"]
    unknown = [Parameter("top", 8.0, (2.0, 50.0))]
    fit = calibrate(push, {"push": CurveTarget(measured, 0.03, (), points=100)}, unknown, leave_out=None)
    assert fit.interval["top"][0] > 10.4
    assert "100 points of 'push' count as so many independent numbers" in str(fit)  # nothing was said
    whole = CurveTarget(measured, 0.03, (), points=100, point_scatter=0.3)
    fit = calibrate(push, {"push": whole}, unknown, leave_out=None)
    low, high = fit.interval["top"]
    assert low < 10.0 < high
    assert not calibrate(push, {"push": CurveTarget(measured, 0.03)}, unknown, leave_out=None).warnings
