"""Peaks of a push between its samples: what breaks at once falls between two of them."""

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.stages.drive_work import SHOCK, TOGETHER, DriveWork
from limitmason.geometry import box

WIDTH, DEPTH, HEIGHT, STRENGTH = 0.3, 0.2, 1.2, 2e5


def cantilever():
    """A block glued to the ground by a joint that loses its strength at once."""
    solids = [box((-0.5, 0, -0.2), (0.8, DEPTH, 0)), box((0, 0, 0), (WIDTH, DEPTH, HEIGHT))]
    joint = lm.Joint(
        40.0, cohesion=1e6, tensile_strength=STRENGTH, residual_tensile_strength=0.0, residual_cohesion=0.0,
        normal_stiffness=1e10, shear_stiffness=1e10,
    )
    return lm.Assembly.from_polyhedra(solids, names=["ground", "block"], joint=joint, density=2000.0, fixed=[0])


def pushed(samples, to=2e-4, **options):
    return dem.push(
        cantilever(), dem.Drive({"block": {"x": 1.0}}), to=to, samples=samples, contact_points=WIDTH / 24,
        rate_check=False, steps=6000, **options,
    )


@pytest.mark.exact
def test_the_peak_of_a_brittle_cantilever_hangs_on_no_sample(tmp_path):
    """It breaks at (ft + W/A) A b / 6 over the height of the drive."""
    curves = [pushed(samples) for samples in (13, 20, 200)]
    model = curves[0].assembly
    area = WIDTH * DEPTH
    exact = (STRENGTH + model.weights[1] / area) * area * WIDTH / 6.0 / (0.5 * HEIGHT)
    peaks = np.array([c.peak.load for c in curves])
    assert peaks == pytest.approx(peaks[0], rel=1e-9)
    # points at the middles of strips stand inside the edge, and the drive is not infinitely slow
    assert peaks[0] == pytest.approx(exact, rel=0.05)
    at = np.array([c.peak.displacement for c in curves])
    assert at == pytest.approx(at[0], rel=1e-9)
    assert curves[0].load.max() < 0.97 * peaks[0]
    few = curves[0]
    before, after = few.displacement[few.peak.index], few.displacement[few.peak.index + 1]
    assert before < few.peak.displacement < after
    assert few.quantities["peak"] == few.peak.load
    assert few.line[1].max() == few.peak.load
    assert (np.diff(few.line[0]) > 0.0).all()
    assert few.stiffness() == pytest.approx(curves[2].stiffness(), rel=0.02)
    units, rows = few.tabulated()
    assert list(units)[-1] == "largest load since"
    assert max(row[-1] for row in rows) == few.peak.load
    assert few.in_units("mm", 1e3, "kN", 1e-3).peak[1:] == pytest.approx((1e3 * at[0], 1e-3 * peaks[0]))


def test_a_push_that_is_stopped_and_taken_up_has_the_same_peak(tmp_path):
    whole, seen = pushed(20), []

    def stop(sampled):
        seen.append(sampled)
        return len(seen) == 5

    pushed(20, checkpoint=tmp_path / "push", progress=stop)
    again = pushed(20, checkpoint=tmp_path / "push")
    for name in ("load", "highest", "highest_at"):
        assert np.array_equal(getattr(again, name), getattr(whole, name))


def test_a_load_that_only_rises_has_its_peak_at_the_end():
    curve = pushed(20, to=4e-5)
    assert curve.peak == curve.point(-1)


@pytest.mark.exact
def test_means_over_ten_steps_do_not_hang_on_how_steps_are_cut():
    rng = np.random.default_rng(5)
    work = rng.normal(size=2000)
    means = work.reshape(-1, TOGETHER).mean(axis=1)
    for _ in range(20):
        cuts = np.unique(rng.integers(0, 2001, rng.integers(1, 300)))
        drive, k = DriveWork(), 0
        for part in np.split(work, cuts):
            drive.add(part)
            k += len(part)
            if k >= TOGETHER:
                assert drive.last == pytest.approx(means[k // TOGETHER - 1])
            if k >= (SHOCK + 1) * TOGETHER:
                best = SHOCK + int(np.argmax(means[SHOCK : k // TOGETHER]))
                assert drive.largest == pytest.approx(means[best])
                assert drive.since == k - (best + 0.5) * TOGETHER
        assert drive.sampled()["largest drive work"] == pytest.approx(means[SHOCK:].max())
        drive.add(np.zeros(5))
        assert drive.since == 0.0
