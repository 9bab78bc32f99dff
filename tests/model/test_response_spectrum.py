"""Response spectra of records against closed forms; records that are read, corrected and drawn."""

import math

import numpy as np
import pytest

import limitmason as lm
from dem import BaseMotion
from limitmason.constants import GRAVITY

PERIODS = np.array([0.1, 0.25, 0.5, 1.0, 2.0])


def pulse(duration, step=0.001, peak=3.0):
    """A rectangular pulse with steep ends, and 0.1 s of rest."""
    return BaseMotion((0.0,) + (peak,) * (round(duration / step) + 1) + (0.0,) * round(0.1 / step), step, after="coast")


@pytest.mark.exact
def test_a_rectangular_pulse_has_the_spectrum_of_shock():
    # without damping u w^2 / a = 2 sin(w d / 2) where the pulse of duration d ends before half a period, else 2
    found = pulse(0.2).spectrum(PERIODS, damping=0.0)
    half = math.pi * 0.201 / PERIODS  # the ends are ramps of one sample
    exact = 3.0 * np.where(half < math.pi / 2, 2.0 * np.sin(half), 2.0)
    assert found.acceleration == pytest.approx(exact, rel=5e-3)
    assert found.displacement == pytest.approx(exact * (PERIODS / (2.0 * math.pi)) ** 2, rel=5e-3)


@pytest.mark.exact
def test_resonance_grows_to_one_over_twice_the_damping():
    time = np.arange(0.0, 40.0, 0.01)
    sine = BaseMotion(np.sin(2.0 * math.pi * time / 0.5), 0.01, after="coast")
    assert sine.spectrum(0.5, damping=0.05).acceleration == pytest.approx([10.0], rel=5e-3)
    assert sine.spectrum(0.5, damping=0.10).acceleration == pytest.approx([5.0], rel=5e-3)


def test_components_have_their_own_spectra_and_a_stiff_oscillator_follows_the_ground():
    record = np.column_stack([np.sin(np.linspace(0, 9, 400)), 2.0 * np.sin(np.linspace(0, 9, 400)), np.zeros(400)])
    ground = BaseMotion(record, 0.01, after="coast")
    stiff = [ground.spectrum(0.02, component=k).acceleration[0] for k in range(3)]
    assert stiff == pytest.approx([1.0, 2.0, 0.0], rel=0.02)
    for words, message in (
        ({"component": 3}, "component must be"),
        ({"periods": [0.1, -1.0]}, "periods must be positive"),
        ({"periods": []}, "periods must be positive"),
        ({"damping": 5.0}, r"damping must lie in 0 \.\. 1"),
        ({"damping": "5%"}, "damping must be a finite number"),
    ):
        with pytest.raises(lm.errors.InputError, match=message):
            ground.spectrum(**words)


def test_a_record_of_rounded_times_is_as_long_as_in_its_file(tmp_path):
    path, time = tmp_path / "record.csv", np.arange(4000) / 128.0
    path.write_text("".join(f"{t:.5f},1.0\n" for t in time))  # steps of 0.00781 and 0.00782 s
    assert BaseMotion.from_csv(path, after="coast").sample_step == pytest.approx(1.0 / 128.0, rel=1e-6)


def test_a_spectrum_and_a_record_are_drawn_and_tabulated():
    ground = pulse(0.2)
    found = ground.spectrum()
    (line,) = [x for x in found.plot().axes[0].lines if x.get_gid() == "curve acceleration"]
    assert line.get_ydata() == pytest.approx(found.acceleration / GRAVITY)
    assert list(found.tabulated()[0].values()) == ["s", "m", "m/s2"]
    assert "5% damping: 100 periods from 0.05 to 4 s" in str(found)
    figure = ground.plot()
    (line,) = [x for x in figure.axes[0].lines if x.get_gid() == "curve acceleration"]
    assert max(line.get_ydata()) == pytest.approx(3.0 / GRAVITY)
    assert figure.axes[0].get_ylabel() == "acceleration of the ground [g]"


def test_a_corrected_record_leaves_the_ground_at_rest():
    rng = np.random.default_rng(1)
    for shape in ((200,), (200, 3)):
        ground = BaseMotion(rng.standard_normal(shape) + 0.3, 0.01)
        assert ground.left_over()[1]
        still = ground.corrected()
        assert np.abs(still.left_over()[0]).max() < 1e-12
        apart = np.asarray(ground.acceleration) - np.asarray(still.acceleration)
        assert np.ptp(apart, axis=0) == pytest.approx(0.0, abs=1e-12)  # a constant was taken away


def test_the_unit_of_a_record_is_that_of_its_heading(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("Zeit [s];a [g]\n0,00;0,5\n0,02;-0,5\n", encoding="utf-8")
    assert np.allclose(BaseMotion.from_csv(path).acceleration, [0.5 * GRAVITY, -0.5 * GRAVITY])
    with pytest.raises(lm.errors.InputError, match="line 1: the heading says g, not m/s2"):
        BaseMotion.from_csv(path, units="m/s2")
    path.write_text("t,ax (cm/s^2),ay (m/s²)\n0,50,1\n0.02,-50,1\n", encoding="utf-8")
    assert np.allclose(BaseMotion.from_csv(path).acceleration, [0.5, -0.5])
    assert np.allclose(BaseMotion.from_csv(path, column=2).acceleration, [1.0, 1.0])
    with pytest.raises(lm.errors.InputError, match="line 1: the heading says m/s2, not cm/s2"):
        BaseMotion.from_csv(path, column=(1, 2, 1))
    path.write_text("Tolmezzo (1976)\nt [ms],a [Gal]\n0,50\n20,-50\n", encoding="utf-8")
    read = BaseMotion.from_csv(path)
    assert np.allclose(read.acceleration, [0.5, -0.5])
    assert read.sample_step == pytest.approx(0.02)
    # a word in brackets need be no unit: stated units go before it
    path.write_text("t [s],a [furlong]\n0,1\n1,-1\n", encoding="utf-8")
    assert np.allclose(BaseMotion.from_csv(path, units="m/s2").acceleration, [1.0, -1.0])
    for columns in ((1, 2), (), 1.0):
        with pytest.raises(lm.errors.InputError, match="column must be a whole number above 0, or three of them"):
            BaseMotion.from_csv(path, units="m/s2", column=columns)
    for heading, message in (("t [s],a [ft/s2]", "says 'ft/s2'; give units="), ("t [min],a [g]", "time in 'min'")):
        path.write_text(f"{heading}\n0,1\n1,-1\n", encoding="utf-8")
        with pytest.raises(lm.errors.InputError, match=message):
            BaseMotion.from_csv(path)
