"""What a histogram of random runs draws is what the tables hold."""

import numpy as np
import pytest

from limitmason import figures, study
from limitmason.errors import InputError


def parts(figure, gid):
    return [a for a in figure.findobj() if a.get_gid() == gid]


def test_histogram_holds_every_finite_run():
    runs = [{"peak": v} for v in (*np.random.default_rng(0).normal(10.0, 1.0, 60).tolist(), float("nan"))]
    table = study.Table(tuple(runs))
    figure = figures.histogram({"a": table, "b": table}, "peak", measured=(9.0, 11.0))
    bars = parts(figure, "histogram")
    assert sum(b.get_height() for b in bars) == 2 * 60
    assert len(parts(figure, "test")) == 2
    assert "1 runs" not in parts(figure, "caption")[0].get_text()
    assert "2 runs without a value" in parts(figure, "caption")[0].get_text()


def test_ticks_of_tests_come_from_any_iterable_and_wrong_classes_are_refused():
    table = study.Table(tuple({"peak": v} for v in (1.0, 2.0, 4.0)))
    assert len(parts(figures.histogram(table, "peak", measured=iter((1.5, 2.5))), "test")) == 2
    # by the rule alone 3e11 classes: nearly all runs are one, beside one outlier
    outlier = study.Table(tuple({"peak": v} for v in (*(1.0 + 1e-9 * np.arange(9)), 1e3)))
    bars = parts(figures.histogram(outlier, "peak"), "histogram")
    assert (len(bars), sum(b.get_height() for b in bars)) == (200, 10)
    for wrong in ({"bins": 0}, {"tables": {}}):
        with pytest.raises(InputError, match="bins must be|no table"):
            figures.histogram(**{"tables": table, "column": "peak", **wrong})
