"""Statements of a study that are no numbers, or too many, are refused by name."""

import math

import numpy as np
import pytest
from diagnosis_models import CAUSES, GAIN, data, specimens, study

from limitmason.answers import Curve
from limitmason.diagnosis import Measured, Noise, Observation, Study, binomial_interval, investigate
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


def tilts(path, factor, unit="deg"):
    """Twelve blocks that fall at b / h, tilts predicted in degrees and measured in ``factor`` times that, to 2 %."""
    width, height = np.repeat([0.1, 0.2, 0.3], 4), np.tile([0.4, 0.5, 0.6, 0.8], 3)
    tilt = np.degrees(np.arctan(width / height))
    seen = factor * tilt * np.exp(0.02 * np.random.default_rng(11).standard_normal(12))
    rows = zip(width.tolist(), height.tolist(), seen.tolist(), tilt.tolist(), strict=True)
    head = ["width,height,measured,predicted", f"# units: m,m,{unit},{unit}"]
    path.write_text("\n".join([*head, *(",".join(map(str, row)) for row in rows)]))
    return path


def test_values_that_are_all_off_by_one_factor_do_not_scatter(tmp_path):
    """Radians for degrees: all values are 0.0175 times the predicted, to 2 %, and no gain of 0.7 to 1.4 does that."""
    made = Study.from_table(tilts(tmp_path / "radians.csv", math.radians(1.0)), noise=0.02)
    with pytest.warns(UserWarning, match="are both in one unit"):
        found = made.diagnose(draws=199, pairs=False)
    assert (found.kind, found.causes) == ("unexplained", ())  # was "scatter": "the values scatter by 404 %"
    apart = np.log(np.array(made.measured) / [s["predicted"] for s in made.specimens])
    assert f"All values are near {np.exp(apart.mean()):.3g} times the predicted, and scatter by " \
           f"{100.0 * apart.std(ddof=1):.1f} % about that" in found.report(checks=False)
    # six times the stated noise about the right mean is scatter as before
    right = np.array([s["predicted"] for s in made.specimens])
    wide = made.replace(measured=right * np.exp(0.12 * np.random.default_rng(2).standard_normal(12)))
    assert wide.diagnose(draws=199, pairs=False).kind == "scatter"


def test_a_tilting_test_is_given_by_tangents(tmp_path):
    """An offset of 1.5 degrees on "a multiplier" of 36.9, which was the angle, passed the vertical."""
    with pytest.raises(InputError, match=r"tilting is for tangents .* 'measured' is in 'deg': give tan\(angle\)"):
        Study.from_table(tilts(tmp_path / "tilts.csv", 1.0), noise=0.02, tilting=True)


def test_one_quantity_has_one_unit():
    rows = [Observation(0, "peak", 2.0, 0.05, "kN"), Observation(1, "peak", 2000.0, 0.05, "N")]
    with pytest.raises(InputError, match="peak of specimen 1 is in 'N', others in 'kN': give one quantity in one unit"):
        Study(specimens(2), lambda s: {"peak": 2.0}, rows)


def test_one_cause_has_one_size_and_a_name_is_no_cause():
    made = study(data())
    assert made.predicted(GAIN, 1.1) == pytest.approx(1.1 * made.baseline())  # was Python's "not iterable"
    with pytest.raises(TypeError, match="a cause must be a Cause, .* got 'gain'"):
        made.predicted(["gain"], [1.1])
    with pytest.raises(TypeError, match="a cause must be a Cause, .* got 'gain'"):  # was "got 'g'"
        made.diagnose("gain")
