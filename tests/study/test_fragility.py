"""Fragility curves: closed forms of the largest likelihood, and how often the intervals hold what they should."""

import numpy as np
import pytest
from scipy import stats

import limitmason as lm
from limitmason.errors import InputError, NotConverged
from limitmason.study import Table, fragility


def table(x, failed):
    return Table(tuple({"pga": float(a), "fell": bool(b)} for a, b in zip(x, failed, strict=True)), {"pga": "m/s2"})


def drawn(seed, runs, median=4.0, dispersion=0.4):
    random = np.random.default_rng(seed)
    x = np.exp(random.uniform(np.log(1.0), np.log(12.0), runs))
    return table(x, random.normal(size=runs) < np.log(x / median) / dispersion)


def test_with_two_intensities_the_curve_goes_through_both_shares():
    # two numbers and two shares: the largest likelihood is at Phi(a + b ln x) = k / n
    rows = table([2.0] * 40 + [6.0] * 50, [True] * 6 + [False] * 34 + [True] * 38 + [False] * 12)
    found = fragility(rows, "pga", "fell")
    low, high = stats.norm.ppf([6 / 40, 38 / 50])
    slope = (high - low) / np.log(3.0)
    assert found.dispersion == pytest.approx(1.0 / slope, rel=1e-9)
    assert found.median == pytest.approx(2.0 * np.exp(-low / slope), rel=1e-9)
    assert found.probability([2.0, 6.0]) == pytest.approx([6 / 40, 38 / 50], rel=1e-9)
    # and the error of each probit is that of its share alone, k (n - k) / n^3 over the density squared
    for at, k, n in ((2.0, 6, 40), (6.0, 38, 50)):
        probit = stats.norm.ppf(k / n)
        error = np.sqrt(k * (n - k) / n**3) / stats.norm.pdf(probit)
        expected = stats.norm.cdf(probit + np.array([-1, 1]) * stats.norm.ppf(0.95) * error)
        assert np.ravel(found.band(at)) == pytest.approx(expected, rel=1e-7)
    assert (found.runs, found.failures, found.missing) == (90, 44, 0)


def test_the_band_holds_one_half_at_the_ends_of_the_medians_interval():
    found = fragility(drawn(1, 200), "pga", "fell")
    low, high = found.median_interval
    assert low < found.median < high
    assert found.band(low)[1] == pytest.approx(0.5, abs=1e-9)
    assert found.band(high)[0] == pytest.approx(0.5, abs=1e-9)


@pytest.mark.slow
def test_intervals_hold_median_and_dispersion_as_often_as_they_say():
    held = []
    for seed in range(200):
        found = fragility(drawn(seed, 150), "pga", "fell")
        (a, b), (c, d) = found.median_interval, found.dispersion_interval
        held.append((a < 4.0 < b, c < 0.4 < d))
    # 90 % of 200 with a standard error of 2.1 %: three of them
    assert np.abs(np.mean(held, axis=0) - 0.9).max() < 0.064


def test_units_of_the_intensity_do_not_matter():
    rows = drawn(3, 120)
    one = fragility(rows, "pga", "fell")
    other = fragility(table(100.0 * rows["pga"], rows["fell"]), "pga", "fell")
    assert other.median == pytest.approx(100.0 * one.median, rel=1e-9)
    assert other.median_interval == pytest.approx(tuple(100.0 * v for v in one.median_interval), rel=1e-7)
    assert other.dispersion_interval == pytest.approx(one.dispersion_interval, rel=1e-7)


@pytest.mark.parametrize("power", [0.001, 0.02, 50.0])
def test_a_power_of_the_intensity_takes_median_and_dispersion_along(power):
    # ln(x^p) = p ln(x): runs of hardly different intensities give the same curve on another axis
    rows = drawn(3, 120)
    one = fragility(rows, "pga", "fell")
    other = fragility(table(rows["pga"] ** power, rows["fell"]), "pga", "fell")
    assert other.median == pytest.approx(one.median**power, rel=1e-9)
    assert other.dispersion == pytest.approx(power * one.dispersion, rel=1e-7)
    assert other.dispersion_interval == pytest.approx([power * v for v in one.dispersion_interval], rel=1e-7)


def test_what_gives_no_curve_says_why():
    with pytest.raises(InputError, match="0 of 2 runs failed"):
        fragility(table([1.0, 2.0], [False, False]), "pga", "fell")
    with pytest.raises(NotConverged, match="the median lies between"):
        fragility(table([1.0, 2.0, 3.0, 4.0], [False, False, True, True]), "pga", "fell")
    with pytest.raises(InputError, match="grows rarer"):
        fragility(table([1.0, 2.0, 3.0, 4.0], [True, False, True, False]), "pga", "fell")
    with pytest.raises(InputError, match="grows rarer"):
        fragility(table([1.0, 2.0, 3.0, 4.0], [True, True, False, False]), "pga", "fell")
    with pytest.raises(InputError, match="all runs have pga = 2"):
        fragility(table([2.0, 2.0, 2.0], [True, False, True]), "pga", "fell")
    with pytest.raises(InputError, match="intensities must be positive, got -1"):
        fragility(drawn(3, 120), "pga", "fell").probability([1.0, -1.0])
    with pytest.raises(InputError, match="'pga' must be positive"):
        fragility(table([0.0, 2.0], [True, False]), "pga", "fell")
    with pytest.raises(InputError, match="level must be a finite number, got '90 %'"):
        fragility(drawn(3, 120), "pga", "fell", level="90 %")
    # rows without an answer do not count, and are counted
    rows = drawn(5, 100)
    more = Table((*rows.rows, {"pga": 3.0, "fell": None}), rows.units)
    found = lm.study.fragility(more, "pga", "fell")
    assert found.missing == 1
    assert found.median == fragility(rows, "pga", "fell").median
    assert "1 without an answer" in str(found)
