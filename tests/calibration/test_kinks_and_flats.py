"""Calibration of models with kinks, flats and several minima: closed forms, searches by brute force, coverage."""

import math

import numpy as np
import pytest

import limitmason as lm
from limitmason.calibration import CurveTarget, Parameter, SearchSettings, Target, calibrate, estimation
from limitmason.errors import InputError
from limitmason.study.linked_formulas import LinkedFormulas

ROCKING = math.tan(math.radians(33.0))
U = np.linspace(0.0, 1e-2, 201)
RISE = 3.841459
"""Quantile of chi squared, one degree of freedom, 95 %."""


def wall(kn, phi):
    """A wall that is elastic, then slides at tan(phi) or rocks, whichever comes first: above 33 degrees phi is idle."""
    top = np.minimum(math.tan(math.radians(phi)), ROCKING * (1.0 - U / 0.2))
    return lm.Curve(U, np.minimum(2e-6 * kn * U, top), "m", "-")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 3])
@pytest.mark.parametrize("points", [0, 12])
def test_friction_of_a_wall_that_rocks_has_no_upper_end(seed, points):
    rng, runs, said = np.random.default_rng(seed), [], []
    noisy = lm.Curve(U, wall(8e8, 36.0).load * (1.0 + 0.03 * rng.standard_normal(len(U))), "m", "-")
    target = CurveTarget(noisy, 0.03, () if points else ("stiffness", "peak", "area"), points)

    def model(kn, phi):
        runs.append((kn, phi))
        return wall(kn, phi)

    fit = calibrate(model, {"curve": target}, [Parameter("kn", 3e8, (1e7, 1e11)), Parameter("phi", 30.0, (10.0, 70.0))],
                    progress=said.append)
    assert len(runs) == len(set(runs)) <= 100
    # brute force: the least misfit, and how far down phi may go with any stiffness
    grid = [np.log([kn, phi]) for kn in np.geomspace(2e8, 3e9, 60) for phi in np.linspace(31.0, 36.0, 101)]
    cost = (fit.objective.residuals(grid) ** 2).sum(axis=1)
    assert fit.misfit < cost.min() + 0.2
    lowest = min(math.exp(x[1]) for x, c in zip(grid, cost, strict=True) if c <= fit.misfit + RISE)
    # known to 5 % of its distance from the best, to the safe side
    found = fit.interval["phi"][0]
    assert lowest * (lowest / fit.parameters["phi"]) ** 0.05 < found < lowest + 0.05
    assert "above" in fit.open_sides["phi"]
    assert "phi" not in fit.identified
    assert "NOT from above" in str(fit)
    if not points:
        assert "kn" in fit.identified
        assert fit.interval["kn"][0] < 8e8 < fit.interval["kn"][1]
    # the best values stand before the first interval
    first = next(k for k, line in enumerate(said) if line.startswith("best values found"))
    assert "misfit" in said[first]
    assert "kn " in said[first]
    assert "phi " in said[first]
    assert not any(line.startswith("interval") for line in said[:first])


def test_two_minima_lie_in_one_interval_that_says_so():
    # (a - 3)^2 + 1 = 2 exp(+-1.96 sd) at both outer ends
    unknown = Parameter("a", 1.5, (0.1, 10.0), log=False)
    fit = calibrate(lambda a: {"p": (a - 3.0) ** 2 + 1.0}, {"p": (2.0, 0.02)}, [unknown])
    half = math.sqrt(2.0 * math.exp(0.02 * math.sqrt(RISE)) - 1.0)
    assert fit.interval["a"] == pytest.approx((3.0 - half, 3.0 + half), abs=2e-3)
    (said,) = (w for w in fit.warnings if "another minimum" in w)
    assert ("a 2 " in said) != ("a 4 " in said)


@pytest.mark.parametrize("again", [0, 1, 3])
def test_an_interval_is_that_of_the_answer_however_often_a_lower_one_was_met(again, monkeypatch):
    # chi2 = 5 + x^2 before a jump at 1.5, (x - 2.5)^2 behind it; each of both lines has the interval x_0 +- 1.96
    monkeypatch.setattr(estimation, "AGAIN", again)

    def model(x):
        return {"a": x, "b": 5.0**0.5} if x < 1.5 else {"a": x - 2.5, "b": 0.0}

    aim = {name: Target(0.0, 1.0, absolute=True) for name in "ab"}
    x = Parameter("x", 0.3, (-5.0, 5.0), log=False)
    found = calibrate(model, aim, [x], search=SearchSettings(starts=1), leave_out=None)
    low, high = found.interval["x"]
    if again:
        assert found.parameters["x"] == pytest.approx(2.5, abs=1e-6)
        assert (low, high) == pytest.approx((1.5, 2.5 + 1.96), abs=0.05)
    else:
        assert found.parameters["x"] == pytest.approx(0.0, abs=1e-6)
        assert low == pytest.approx(-1.96, abs=0.05)
    assert any("lower misfit" in w for w in found.warnings) == (again == 0)


def test_one_minimum_is_not_called_two():
    fit = calibrate(lambda a, b: {"p": a * b}, {"p": (2.0, 0.02)},
                    [Parameter("a", 1.5, (0.1, 10.0)), Parameter("b", 1.0, (0.1, 10.0))])
    assert not any("another minimum" in w for w in fit.warnings)


@pytest.mark.parametrize("unit", [1e9, 1.0, 1e-6, 1e-12])
@pytest.mark.parametrize("widest", [10.0, 1e6])
def test_scale_of_a_parameter_changes_nothing(unit, widest):
    fit = calibrate(lambda a: {"p": a, "q": 2.0 * a}, {"p": (3.0 * unit, 0.05), "q": (6.0 * unit, 0.05)},
                    [Parameter("a", unit, (0.1 * unit, widest * unit), log=False)])
    sd = 0.05 / math.sqrt(2.0)
    ends = [3.0 * unit * math.exp(s * sd * math.sqrt(RISE)) for s in (-1.0, 1.0)]
    assert fit.parameters["a"] == pytest.approx(3.0 * unit, rel=1e-4)
    assert fit.interval["a"] == pytest.approx(tuple(ends), rel=2e-3)
    # one deviation to the weaker side: the slope of log a over 3.5 %
    assert fit.deviation["a"] == pytest.approx(3.0 * unit * sd, rel=0.03)


@pytest.mark.parametrize(
    "formula", ["9**9**9**9", "-9**9**9**9", "exp(1e9)", "a / 0", "1e400", "9" * 4000, "(" * 400 + "a" + ")" * 400]
)
def test_formula_without_a_number_ends_at_once(formula):
    with pytest.raises(InputError, match="'b'"):
        calibrate(lambda a, b: a * b, {"value": (2.0, 0.1)}, [Parameter("a", 1.0, (0.1, 10.0))], ties={"b": formula})


def test_formula_of_whole_numbers_stays_what_it_was():
    assert LinkedFormulas({"b": "2 ** 3 ** 2 + a / 4"})({"a": 2})["b"] == 512.5


@pytest.mark.parametrize(
    ("model", "message"), [(lambda a: {"value": np.array([[a]])}, "shape"), (lambda a: {"value": a + 1j}, "no number")]
)
def test_answer_that_is_no_sequence_is_named(model, message):
    with pytest.raises(InputError, match=message):
        calibrate(model, {"value": (2.0, 0.1)}, [Parameter("a", 1.0, (0.1, 10.0))])


def test_scatter_finer_than_numbers_is_refused():
    with pytest.raises(InputError, match="finer"):
        calibrate(lambda a: {"p": a, "q": a}, {"p": (2.0, 1e-300), "q": (2.0, 0.1)}, [Parameter("a", 1.0, (0.1, 10.0))])


X = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
MODELS = {
    "line": (lambda a, b: a + b * X, (2.0, 0.7)),
    "power": (lambda a, b: a * X**b, (2.0, 0.7)),
    "decay": (lambda a, b: a * np.exp(-0.3 * b * X), (2.0, 0.7)),
    "elastic then plastic": (lambda a, b: np.minimum(a * X, b), (2.0, 5.0)),
    "weaker of two": (lambda a, b: np.where(X < 3.0, np.minimum(a, 3.0) * X, b * X), (2.0, 0.7)),
    "kinked at the truth": (lambda a, b: X * (a + 0.8 * abs(a - 2.0)) + b, (2.0, 0.7)),
}
PLANTS = 40


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_intervals_cover_the_truth_of_smooth_and_kinked_models(name):
    model, truth = MODELS[name]
    rng, inside = np.random.default_rng(7), np.zeros(2)
    for _ in range(PLANTS):
        measured = model(*truth) * np.exp(0.05 * rng.standard_normal(len(X)))
        fit = calibrate(lambda a, b: {"y": model(a, b)}, {"y": Target(measured.tolist(), 0.05)},
                        [Parameter("a", 1.0, (0.2, 20.0)), Parameter("b", 1.0, (0.05, 20.0))],
                        search=SearchSettings(starts=3), leave_out=None)
        inside += [low <= t <= high for (low, high), t in zip(fit.interval.values(), truth, strict=True)]
    # 95 %: fewer than 34 of 40 in 2 of 1,000
    assert (inside >= 34).all(), inside


def test_lines_of_progress_give_the_least_misfit_of_all_runs_so_far():
    """Each line after a run of a search says what its own runs have reached, not what the stage began with."""
    misfits, said = [], []

    def model(a):
        misfits.append((((a - 3.0) / 0.05) ** 2, a))
        return a

    def heard(line):
        if "misfit" in line:
            said.append(tuple(float(line.split(word)[1].split()[0].strip(",:;")) for word in ("misfit", "at a")))
            assert said[-1] == pytest.approx(min(misfits), rel=1e-3, abs=1e-6)

    calibrate(model, {"value": Target(3.0, 0.05, absolute=True)}, [Parameter("a", 30.0, (0.1, 100.0))],
              search=SearchSettings(starts=1), level=None, progress=heard)
    assert len(said) > 3
