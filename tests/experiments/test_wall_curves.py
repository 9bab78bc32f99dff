"""Curves of measured walls: statics of rocking and sliding by path and DEM, what gave way, refusals."""

import math

import numpy as np
import pytest

from limitmason import experiments
from limitmason.comparison.wall_curves import WallCurve, wall_curve
from limitmason.errors import InputError
from limitmason.experiments.modern_walls import MODELS

NAME = "modern-walls"
BARE = {**MODELS["pushover"], "cracks": "none", "tension_share": 0.0}


def load(wall, **options):
    return experiments.load(NAME, wall, **{**BARE, **options})


def weight(row):
    length, height, t = (float(row[k]) for k in ("L", "H", "t"))
    return 1e-3 * 9.80665 * 1000.0 * length * height * t


def curve_of(drift, force, slips, slid, apart, past):
    """A curve of given motions [%], from the start."""
    parts = {"slid": slid, "slips": slips, "apart": apart, "past": past}
    shares = {name: [0.0, *(v / u for v, u in zip(p, drift, strict=True))] for name, p in parts.items()}
    return WallCurve(wall="", drift=[0.0, *drift], force=[0.0, *force], **shares)


@pytest.mark.slow
@pytest.mark.parametrize("by", ["pushover", "dem"])
@pytest.mark.parametrize("wall", ["110", "112"])  # both ends held; a cantilever
def test_wall_that_sticks_rocks_up_to_its_rigid_bound(wall, by):
    test = load(wall, mu=5.0, fv0=0.0, coarse=2)
    found = wall_curve(test, to=0.02, by=by)
    length, height, t, fc = (float(test.row[k]) for k in ("L", "H", "t", "fc"))
    axial = 1e3 * float(test.row["sigma0"]) * length * t + np.array([0.0, weight(test.row)])
    ends = axial * length * (1.0 - axial / (1e3 * fc * length * t)) / (2.0 * height)
    bound = float(ends.sum() if test.row["H0_over_H"] == "0.5" else ends[1])
    # a toe of three points by Lobatto's rule crushes a little early, and the wall leans by its drift
    assert 0.94 * bound < found.peak < bound
    if by == "pushover":
        assert max(found.slips[-1], found.apart[-1], found.past[-1]) < 0.02
    assert (found.status, found.mode) == ("reached", "F")


@pytest.mark.slow
@pytest.mark.parametrize("by", ["pushover", "dem"])
def test_wall_without_cohesion_slides_by_coulomb(by):
    test = load("146", mu=0.05, fv0=0.0, sigma0=0.3, coarse=3)
    found = wall_curve(test, to=0.003, by=by)
    axial = 300.0 * float(test.row["L"]) * float(test.row["t"])
    # the joint under the beam bears the least: it slides alone
    assert found.force[-1] == pytest.approx(0.05 * axial, rel=1e-3)
    assert (found.mode, found.slid[-1] > 0.9) == ("SL", True)


@pytest.mark.slow
def test_wall_that_leaps_on_its_way_is_followed_to_the_peak_that_the_dem_finds():
    # joints break one by one and the path leaps: a hundred tries of a step ended at 45.1 kN, 0.10 %
    test = experiments.load(NAME, "110", **MODELS["pushover"])
    path, driven = wall_curve(test), wall_curve(test, by="dem")
    assert (path.status, driven.status) == ("reached", "reached")
    assert path.peak == pytest.approx(driven.peak, rel=0.02)


def test_mode_is_read_just_after_the_peak_from_what_is_not_elastic():
    # slip of 0.04 goes with the force of 10 and back with it; what comes after the force has fallen does not count
    drift, force = [0.1, 1.0, 1.2, 3.0], [1.0, 10.0, 9.0, 5.0]
    elastic = [0.04, 0.4, 0.36, 0.2]
    for inner, end in ((0.05, "F"), (0.25, "S")):
        slips = [0.04, 0.4, 0.36 + inner, 2.6]
        found = curve_of(drift, force, slips, [0.5 * v for v in slips], [0.0] * 4, [0.0] * 4)
        assert found.just_after == 3
        # elastic drift 0.9 of 1.2 at a force of 9
        assert found.inelastic(3)[0] == pytest.approx(inner / 0.3)
        assert found.mode == end
    late = np.array([0.0, 0.0, 0.3, 0.3])
    slid = curve_of(drift, force, elastic + 0.7 * late, elastic + 0.6 * late, 0.0 * late, 0.0 * late)
    gaping = curve_of(drift, force, elastic + 0.5 * late, elastic, 0.1 * late, 0.6 * late)
    assert (slid.mode, gaping.mode) == ("SL", "G")


def test_dem_refuses_a_wall_whose_zero_moment_lies_above_it_by_name():
    found = wall_curve(load("120"), by="dem")
    assert "no cantilever" in found.status
    assert found.force == []


def test_wall_that_crushes_under_its_load_is_named_and_has_no_curve():
    found = wall_curve(load("22", sigma0=9.0))
    assert "sigma0 = 9 MPa is above fc" in found.status
    assert found.force == []


@pytest.mark.parametrize(("test", "arguments", "message"), [
    (("minho-dry-stone-2005-2009", "SW.100.1"), {}, "source must be one of 'modern-walls'"),
    ((NAME, "189"), {"to": -1.0}, "to must be positive"), ((NAME, "189"), {"to": "x"}, "to must be a finite number"),
])
def test_what_no_wall_can_be_pushed_to_is_refused_by_name(test, arguments, message):
    with pytest.raises(InputError, match=message):
        wall_curve(experiments.load(*test), **arguments)


def test_a_wall_without_a_curve_has_neither_peak_nor_mode():
    none = WallCurve(wall="1", status="crushes")
    assert math.isnan(none.peak)
    assert none.mode == ""
    # a curve that ends where its elastic motion is read has nothing inelastic: was a division by zero
    two = {"slid": [0.0, 0.1], "slips": [0.0, 0.1], "apart": [0.0, 0.0], "past": [0.0, 0.0]}
    assert WallCurve(wall="1", drift=[0.0, 0.1], force=[0.0, 50.0], **two).mode == ""


def test_a_method_that_follows_no_wall_is_refused():
    with pytest.raises(InputError, match="by must be one of 'pushover', 'dem'"):
        wall_curve(load("22"), by="limit")
