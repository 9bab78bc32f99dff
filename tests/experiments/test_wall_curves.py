"""Capacity curves of measured walls: statics of rocking and sliding, what gave way, refusals."""

import numpy as np
import pytest

from limitmason import experiments
from limitmason.comparison.wall_curves import wall_curve
from limitmason.experiments.modern_walls import MODELS

NAME = "modern-walls"
BARE = {**MODELS["pushover"], "cracks": "none", "tension_share": 0.0}


def load(wall, **options):
    return experiments.load(NAME, wall, **{**BARE, **options})


def weight(row):
    length, height, t = (float(row[k]) for k in ("L", "H", "t"))
    return 1e-3 * 9.80665 * 1000.0 * length * height * t


def test_wall_that_sticks_rocks_up_to_its_rigid_bound():
    test = load("110", mu=5.0, fv0=0.0, coarse=2)
    found = wall_curve(test, to=0.02)
    length, height, t, fc = (float(test.row[k]) for k in ("L", "H", "t", "fc"))
    axial = 1e3 * float(test.row["sigma0"]) * length * t + np.array([0.0, weight(test.row)])
    bound = float((axial * length * (1.0 - axial / (1e3 * fc * length * t))).sum()) / (2.0 * height)
    # a toe of three points by Lobatto's rule crushes a little early, and the wall leans by its drift
    assert 0.94 * bound < found.peak < bound
    assert max(found.slips[-1], found.apart[-1], found.past[-1]) < 0.02
    assert found.status == "reached"


def test_wall_without_cohesion_slides_by_coulomb():
    test = load("146", mu=0.05, fv0=0.0, sigma0=0.3, coarse=3)
    found = wall_curve(test, to=0.003)
    axial = 300.0 * float(test.row["L"]) * float(test.row["t"])
    # the joint under the beam bears the least: it slides alone
    assert found.force[-1] == pytest.approx(0.05 * axial, rel=1e-3)
    assert (found.inside, found.slid[-1] > 0.9) == ("SL", True)


def test_wall_that_crushes_under_its_load_is_named_and_has_no_curve():
    found = wall_curve(load("22", sigma0=9.0))
    assert "sigma0 = 9 MPa is above fc" in found.status
    assert found.force == []
