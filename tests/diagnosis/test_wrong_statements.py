"""Statements of a study that are no numbers, or too many, are refused by name."""

import math

import pytest
from diagnosis_models import CAUSES, GAIN, data, specimens, study

from limitmason.answers import Curve
from limitmason.diagnosis import Measured, Noise, Observation, binomial_interval, investigate
from limitmason.diagnosis.curves import features, points
from limitmason.errors import InputError

SPENT = Curve([0.0, 1.0, 2.0, 3.0], [0.0, 5.0, 6.0, -1.0])
LINE = {"a": Curve([0.0, 1.0, 2.0, 3.0], [0.0, 5.0, 6.0, 4.0])}


@pytest.mark.parametrize(("call", "message"), [
    (lambda: study(data()).log_likelihood({GAIN: 1.1}, [0.0, 0.0]), "z has 2 numbers.*friction_coefficient"),
    (lambda: study().predicted([GAIN], [1.1, 1.2]), "1 causes have 2 sizes"),
    (lambda: study().predicted([GAIN], [1.1], [0.0, 0.0]), "an error 2 values"),
    (lambda: study(levels=2.5), "levels must be a whole number"),
    (lambda: study(nuisance_levels=1), "nuisance_levels must be a whole number of at least 3"),
    (lambda: study().plan(CAUSES, specimens(), k=2.5), "k must be a whole number"),
    (lambda: study().rehearse(CAUSES, n="many"), "n must be"),
    (lambda: Noise(0.04, "many"), "degrees of freedom of the noise must be a number"),
    (lambda: Noise.from_replicates([-1.0, 2.0], "aa"), "values must be positive"),
    (lambda: Measured("a", 0.1), "measured input must be numbers"),
    (lambda: Measured(1.0, 0.1, (0.0,)), "a lowest and a highest value"),
    (lambda: Observation(0, "peak", 1.0, "5 %"), "scatter must be"),
    (lambda: Observation(0, 3, 1.0), "quantity of specimen 0"),
    (lambda: features("a", LINE["a"], load_error="x", displacement_error=0.1), "error of load"),
    (lambda: points(LINE, load_error=-0.02, displacement_error=0.1), "must be positive, got load_error=-0.02"),
    (lambda: study().plan(CAUSES, specimens(), k=2, costs={"peek": 2.0}), "quantity of costs must be one of 'value'"),
    (lambda: study().plan(CAUSES, specimens(), k=2, costs=2.0), "costs must read"),
    (lambda: study().confusable([GAIN]).nearest("gain"), "alone on the list"),
    (lambda: study().confusable(CAUSES).nearest("gian"), "name must be one of .*'gain'"),
    (lambda: study().rehearse(CAUSES, n=0).rate("wrongname"), "outcome must be one of .*'wrong name'"),
    (lambda: study().rehearse(CAUSES, n=0).rate("named", "gian"), "hidden must be one of .*'gain'"),
    (lambda: binomial_interval(5, 3), "got 5 of 3"),
    (lambda: binomial_interval(1, 3, 95), "level must be a share"),
    (lambda: Measured(0.7, 0.03, (0.7, 0.7)), "give sd=0"),
    (lambda: investigate(study(data(), causes=CAUSES), rehearse=-3), "rehearse must be"),
    (lambda: investigate(study(data(), causes=CAUSES), missing="5"), "missing must be"),
    (lambda: study(data()).diagnose(CAUSES, rule=0.05), "rule must be a Rule"),
    (lambda: points(LINE, {"a": LINE["a"].in_units("mm", 1e3, "N", 1.0)}, load_error=0.02, displacement_error=0.1),
     "measured in m, N and predicted in mm, N"),
    (lambda: points(LINE, {"a": SPENT}, load_error=0.02, displacement_error=0.1), "falls to zero"),
    (lambda: points({"a": SPENT}, load_error=0.02, displacement_error=0.1), "no positive load at 3 m"),
    (lambda: points(LINE, LINE, load_error=0.02, displacement_error=0.1, count=0), "count must be"),
])
def test_wrong_statements_of_a_study_are_named(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_predictions_are_of_explanations_that_were_fitted():
    diagnosis = study(data(GAIN, 1.2)).diagnose(CAUSES, pairs=False)
    assert diagnosis.predicted("gain") == pytest.approx(diagnosis.predicted(["gain"]))
    with pytest.raises(InputError, match="no explanation 'gian' was fitted; there are .*gain"):
        diagnosis.predicted(["gian"])


def test_replicates_without_end_are_a_known_noise():
    assert Noise(0.04, math.inf) == Noise(0.04)
    with pytest.raises(InputError, match="need a standard deviation"):
        Noise(None, math.inf)
