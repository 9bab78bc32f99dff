"""What the figures of random runs draw is what the tables hold."""

import numpy as np
import pytest

import limitmason as lm
from limitmason import figures, study


def parts(figure, gid):
    return [a for a in figure.findobj() if a.get_gid() == gid]


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(0)
    rows = []
    u = np.linspace(0.0, 2.0, 21)
    for strength in rng.normal(10.0, 1.0, 60).tolist():
        load = (strength * np.minimum(u, 1.0)).tolist()
        curve = {"displacement": u.tolist(), "load": load, "displacement unit": "mm", "load unit": "kN"}
        mode, phi = ("weak" if strength < 10.0 else "strong"), rng.normal(30.0, 2.0)
        row = {"peak": strength, "cohesion": strength**2, "friction_angle_deg": phi, "mode": mode, "curve": curve}
        rows.append(row)
    return study.Table((*rows, {"peak": float("nan"), "mode": "none"}))


def test_histogram_holds_every_finite_run(table):
    figure = figures.histogram({"a": table, "b": table}, "peak", measured=(9.0, 11.0))
    bars = parts(figure, "histogram")
    assert sum(b.get_height() for b in bars) == 2 * 60
    assert len(parts(figure, "test")) == 2
    assert "1 runs" not in parts(figure, "caption")[0].get_text()
    assert "2 runs without a value" in parts(figure, "caption")[0].get_text()


def test_running_spread_ends_at_one_and_its_band_narrows(table):
    figure = figures.running_spread(table, "peak")
    for name in ("mean", "CoV"):
        (line,) = parts(figure, name)
        assert line.get_ydata()[-1] == 1.0
        ends = parts(figure, f"{name} error")[0].get_paths()[0].vertices
        n = ends[:, 0]
        width = [np.ptp(ends[n == k, 1]) for k in (n.min(), n.max())]
        assert width[1] < 0.6 * width[0]


def test_median_of_the_fan_is_the_median_of_the_loads(table):
    figure = figures.curve_fan(table, measured=[lm.Curve([0.0, 1.0], [0.0, 9.0], "mm", "kN")])
    (line,) = parts(figure, "median")
    peaks = table["peak"][:-1].astype(float)
    assert line.get_ydata()[-1] == pytest.approx(np.median(peaks))
    assert len(parts(figure, "run")) == 60
    assert len(parts(figure, "test")) == 1
    with pytest.raises(lm.errors.InputError, match="no curves"):
        figures.curve_fan(table, "mode")


def test_shares_of_words_add_up(table):
    figure = figures.word_shares(table, "mode")
    assert sum(b.get_width() for b in parts(figure, "share")) == pytest.approx(1.0)
    assert len(parts(figure, "interval")) == 3


def test_bars_of_sensitivity_lead_with_what_the_number_follows(table):
    figure = figures.sensitivity_bars(table, "peak")
    bars = parts(figure, "rank")
    assert bars[0].get_width() == pytest.approx(1.0)  # a rising function of it
    assert abs(bars[1].get_width()) < 0.4
