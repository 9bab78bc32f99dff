"""The closed-form panel is what the published tables say."""

import numpy as np
import pytest

from limitmason import experiments
from validation import panel_surrogate as surrogate


def runs():
    for k in range(1, 19):
        yield experiments.load("brick-panels-opening", f"udec-{k:02d}")


def test_panel_meets_the_published_runs():
    peak, crack = [], []
    for run in runs():
        p = run.parameters
        strengths = 1e6 * p["cohesion"], 1e6 * p["tensile strength"]
        got = surrogate.panel_response(83e9, 36e9, p["friction angle"], *strengths)
        peak.append(np.log(got["peak"] / (1e3 * run.published["failure load"])))
        crack.append(got["first crack"] - 1e3 * run.published["first crack"])
        # displacement at the first crack less that of own weight, over its load; 0.024 mm/kN is read of the runs
        assert 1e6 / got["stiffness"] == pytest.approx(0.0245, rel=0.01)
    kept = np.delete(peak, 12)
    assert np.mean(kept) == pytest.approx(0.0, abs=1e-9)
    assert np.std(kept) < 0.12
    assert peak[12] > 0.3  # run 13 lies far out
    assert np.abs(crack).max() < 180.0  # within 0.18 kN


def test_compliance_goes_as_the_published_stiffness_study():
    # Table 3: 0.24 mm at 0.24 kN, own weight 0.189 mm, for a tenth of both stiffnesses
    soft = surrogate.panel_response(8.3e9, 3.6e9, 30.0, 1e5, 1e5)["stiffness"]
    assert 1e6 / soft == pytest.approx((0.24 - 0.189) / 0.24, rel=0.01)
