"""Modes from motion under white noise: a chain of masses with planted damping, and walls of the DEM."""

import numpy as np
import pytest
from scipy.linalg import eigh, expm

import dem
import limitmason as lm
from limitmason.errors import InputError, NotConverged
from limitmason.vibration.identification import identify_modes

DAMPING = 0.02
STEP = 0.02


def chain(seed, samples=24000):
    """Displacements of three masses on a chain of springs, forced by white noise, with 2 % damping in every mode."""
    m, k = np.eye(3), 900.0 * np.array([[2, -1, 0], [-1, 2, -1], [0, -1, 1.0]])
    w2, phi = eigh(k, m)
    w = np.sqrt(w2)
    c = phi @ np.diag(2 * DAMPING * w) @ phi.T
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-k, -c]])
    # forces that are constant over a step: the exact discrete system
    b = np.vstack([np.zeros((3, 3)), np.eye(3)])
    whole = expm(np.block([[a, b], [np.zeros((3, 9))]]) * STEP)
    ad, bd = whole[:6, :6], whole[:6, 6:]
    force = np.random.default_rng(seed).normal(size=(samples, 3))
    x, out = np.zeros(6), np.empty((samples, 3))
    for i in range(samples):
        x = ad @ x + bd @ force[i]
        out[i] = x[:3]
    return out, w / (2 * np.pi), phi.T


@pytest.fixture(scope="module")
def runs():
    return [chain(seed) for seed in range(20)]


@pytest.mark.parametrize("method", ["fdd", "ssi"])
def test_frequencies_and_shapes_of_a_chain(method, runs):
    for signals, frequency, shapes in runs[:4]:
        found = identify_modes(signals, STEP, method=method)
        assert found.frequency == pytest.approx(frequency, rel=0.01)
        assert np.diag(lm.mac(found.shape, shapes).values) == pytest.approx(1.0, abs=0.02)
        assert found.method in str(found) or "frequency" in str(found)


def test_a_mode_beyond_the_band_is_no_mode_at_its_end(runs):
    # its slope was cut off there, and counted as a peak below the band it was asked in
    signals, frequency, _ = runs[0]
    found = identify_modes(signals, STEP, band=(1.2 * frequency[0], 9.0))
    assert found.frequency == pytest.approx(frequency[1:], rel=0.01)
    assert found.warnings == ("2 of 3 modes found in the band",)


@pytest.mark.slow
def test_planted_damping_is_found_within_a_tenth_over_twenty_seeds_and_intervals_cover_it(runs):
    found = np.array([identify_modes(signals, STEP, method="ssi").damping for signals, _, _ in runs])
    mean = found.mean(axis=0)
    assert mean == pytest.approx(DAMPING, rel=0.10)
    width = 2.093 * found.std(axis=0, ddof=1) / np.sqrt(len(found))  # Student, 19 degrees of freedom, 95 %
    assert (np.abs(mean - DAMPING) <= width).all()


@pytest.mark.slow
def test_column_of_the_dem_has_its_own_modes_as_long_as_no_joint_opens():
    joint = lm.Joint(35.0, normal_stiffness=4e8, shear_stiffness=1.6e8)
    column = lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=3, joint=joint, density=2000.0)
    own = lm.modes(column, 4, contact_points=(4, 4))
    along_x = own.frequency[np.argmax(own.share[:, 0])]
    along_y = own.frequency[np.argmax(own.share[:, 1])]
    options = dem.JointOptions(dashpot=2 * 0.01 / (2 * np.pi * along_x))  # 1 % at the first mode along x
    base = dem.white_noise(12.0, rms=0.05, highest=2.0 * along_x, direction=(1.0, 0.7, 0.0), seed=3)
    history = dem.simulate(column, base, mode="dynamic", contact_points=(4, 4), joint_options=options,
                           detect_every=None, sample=20)
    free = [b.name for b, held in zip(column.blocks, column.fixed, strict=True) if not held]
    channels = [(name, axis) for name in free for axis in "xy"]
    step = float(np.median(np.diff(history.scalars["time"])))
    for method in ("fdd", "ssi"):
        found = dem.identify(history, channels, method=method, count=2, band=(5.0, 1.5 * along_x), skip=1.0,
                             lines=2 ** int(np.log2(2.0 / step)))
        assert found.frequency == pytest.approx(sorted([along_x, along_y]), rel=0.02)
    assert found.damping[np.argmin(np.abs(found.frequency - along_x))] == pytest.approx(0.01, rel=0.4)


def shaken(wall, state, highest, seconds=6.0):
    """Record of a state under weak noise at its base."""
    base = dem.white_noise(seconds, rms=0.01, highest=highest, direction=(1.0, 0.6, 0.0), seed=2)
    step = max(1, round(2e-3 / state.state.dt))
    return dem.simulate(wall, base, start=state, sample=step, detect_every=None)


@pytest.mark.slow
def test_mortared_wall_has_its_own_modes_before_a_push_and_those_of_its_cracked_state_after():
    joint = lm.Joint(40.0, cohesion=2e5, tensile_strength=2e4, residual_cohesion=0.0, residual_tensile_strength=0.0,
                     normal_stiffness=1e9, shear_stiffness=5e8)
    wall = lm.build.wall(length=0.6, courses=3, unit=(0.3, 0.2, 0.2), joint=joint, density=2000.0)
    points = (3, 6)
    own = lm.modes(wall, 2, contact_points=points)
    options = dem.JointOptions(dashpot=2 * 0.01 / (2 * np.pi * own.frequency[0]))
    calm = dem.Settle(damping=dem.Damping(local=0.8), tolerance=1e-6)
    sound = dem.simulate(wall, calm, loads=lm.Loads.horizontal(wall, (0, 1, 0)), mode="dynamic", contact_points=points,
                         joint_options=options, detect_every=None)
    # pushed out of plane until joints open, and held there
    push = dem.Ramp(0.3, duration=0.3, damping=dem.Damping(local=0.5))
    cracked = dem.simulate(wall, [push, calm], start=sound, detect_every=None)
    assert (cracked.state.points.damage == 1.0).any()
    channels = [(b, axis) for b in range(1, wall.n_blocks) for axis in "xy"]
    first = []
    for state, of in ((sound, own), (cracked, lm.modes(cracked, 2))):
        history = shaken(wall, state, 1.5 * own.frequency[1])
        assert (history.state.points.damage == state.state.points.damage).all()  # the noise cracks nothing
        for method in ("fdd", "ssi"):
            found = dem.identify(history, channels, method=method, count=2, skip=0.5,
                                 band=(0.4 * of.frequency[0], 1.3 * of.frequency[1]))
            assert found.frequency == pytest.approx(of.frequency, rel=0.02)
            shapes = of.at(wall.centroids[1:])[:, :, :2].reshape(2, -1)
            assert np.diag(lm.mac(found.shape, shapes).values) == pytest.approx(1.0, abs=0.02)
        first.append(found.frequency[0])
    assert first[1] < 0.95 * first[0]


def test_wrong_input_is_refused(runs):
    signals = runs[0][0]
    for wrong, message in (
        ({"method": "magic"}, "method"), ({"band": (1.0, 90.0)}, "band"), ({"count": 0}, "count"),
        ({"lines": 20000}, "too few"), ({"lines": 0}, "lines"), ({"lines": 256.5}, "lines"),
        ({"order": "high"}, "order"),
        ({"order": 1000}, "order must lie below"), ({"band": 3.0}, "band"), ({"band": (1.0, 2.0, 3.0)}, "band"),
    ):
        with pytest.raises(InputError, match=message):
            identify_modes(signals, STEP, **wrong)
    # whole numbers may come as floats, the band as an array or as text of a file
    for method in ("fdd", "ssi"):
        given = {"method": method, "count": 2.0, "lines": 1024.0, "order": 8.0, "lags": 20.0}
        found = identify_modes(signals, STEP, band=np.array([1.0, 12.0]), **given)
        plain = {k: v if k == "method" else int(v) for k, v in given.items()}
        np.testing.assert_array_equal(
            found.frequency, identify_modes(signals, STEP, band=("1", "12"), **plain).frequency
        )
    with pytest.raises(InputError, match="does not move"):
        identify_modes(np.column_stack([signals, np.ones(len(signals))]), STEP)
    with pytest.raises(NotConverged):
        identify_modes(signals, STEP, method="ssi", band=(20.0, 22.0))
    column = lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=2, joint=lm.Joint(35.0))
    history = dem.simulate(column, dem.Settle())
    with pytest.raises(InputError, match="dynamic"):
        dem.identify(history, [(1, "x")])
    moving = dem.simulate(column, dem.white_noise(2.0, rms=0.01, highest=20.0), mode="dynamic", sample=0.004)
    with pytest.raises(InputError, match="not evenly spaced: simulate with sample= a whole"):
        dem.identify(moving, [(1, "x")])
    assert np.std(dem.white_noise(2.0, rms=0.3, highest=20.0).acceleration) == pytest.approx(0.3)
    # two gaps, neither of which is their median
    short = dem.simulate(column, dem.Hold(steps=50), mode="dynamic", sample=20)
    with pytest.raises(InputError, match="not evenly spaced"):
        dem.identify(short, [(1, "x")])
    with pytest.raises(InputError, match="lowest"):
        dem.white_noise(10.0, rms=1.0, highest=0.05)
    with pytest.raises(InputError, match=r"0\.02 s are too short"):
        dem.white_noise(0.02, rms=1.0)
    with pytest.raises(InputError, match=r"0\.0001 s are too short"):
        dem.white_noise(0.0001, rms=1.0)
