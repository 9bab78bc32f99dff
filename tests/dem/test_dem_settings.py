"""Settings of a DEM collapse: one dataclass, the same by keyword, by object and by name of the method."""

import dataclasses
import warnings

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm
from limitmason.errors import InputError


def block():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    return b, lm.Loads.horizontal(b)


def same(a, b):
    return (a.collapse_multiplier, a.details["loads tried"]) == (b.collapse_multiplier, b.details["loads tried"])


def test_settings_and_keywords_are_one_and_keywords_count_before_settings():
    settings = dem.DemSettings(contact_points=(2, 2), error_budget=(), tolerance=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        by_object = dem.collapse(*block(), settings)
        by_name = dem.collapse(*block(), **{f.name: getattr(settings, f.name) for f in dataclasses.fields(settings)})
        finer = dem.collapse(*block(), settings, tolerance=0.005)
    assert same(by_object, by_name)
    width = [p.details["smallest moving"] - p.details["largest stable"] for p in (by_object, finer)]
    assert width[1] < width[0]


@pytest.mark.parametrize(("wrong", "words"), [
    ({"tolerance": 0.0}, "tolerance must be positive"), ({"tolerance": None}, "tolerance must be a finite number"),
    ({"error_budget": "rate"}, "such as"),
    ({"error_budget": ("rates",)}, "a check of error_budget must be one of .* got 'rates'"),
])
def test_a_wrong_setting_is_named(wrong, words):
    for refused in (lambda: dem.DemSettings(**wrong), lambda: dem.collapse(*block(), **wrong)):
        with pytest.raises(lm.errors.InputError, match=words):
            refused()


def test_a_wrong_interval_of_searches_is_refused_before_a_structure_settles():
    with pytest.raises(InputError, match="detect_every"):
        dem.PushSettings(detect_every=0)


def test_an_unknown_setting_is_refused_by_name():
    with pytest.raises(TypeError, match="damp"):
        dem.collapse(*block(), damp=0.4)
    with pytest.raises(TypeError, match="did you mean 'damping'"):
        lm.predict(*block(), "dem", dampin=0.4)


def test_options_that_are_no_numbers_are_refused_by_name():
    column = lm.build.column(width=0.3, depth=0.3, unit_height=0.2, courses=1, joint=lm.Joint(30.0))
    for given, message in (
        ({"start": "x"}, "start"), ({"joint_options": "x"}, "joint_options"),
        ({"joint_options": dem.JointOptions(dashpot="x")}, "dashpot"),
        ({"joint_options": dem.JointOptions(dashpot=[1.0] * 9)}, "one for each interface"),
        ({"joint_options": dem.JointOptions(stiffness_factor="x")}, "stiffness_factor"),
    ):
        with pytest.raises(InputError, match=message):
            dem.simulate(column, dem.Hold(steps=5), **given)
    for given, message in (({"rms": "x"}, "rms"), ({"rms": 0.1, "sample_step": 0.0}, "sample_step")):
        with pytest.raises(InputError, match=message):
            dem.white_noise(1.0, **given)
    for record, step in (([0.0, 1.0], -1.0), ([0.0, np.nan], 0.01)):
        with pytest.raises(InputError, match="sample_step|finite samples"):
            dem.ResponseSpectrum.of_record(record, step, [0.1], 0.05)


def test_openings_that_were_not_recorded_are_not_asked_for(tmp_path):
    column = lm.build.column(width=0.3, depth=0.3, unit_height=0.2, courses=1, joint=lm.Joint(30.0))
    history = dem.simulate(column, dem.Hold(steps=5), store=dem.Store(tmp_path / "run", joints=False))
    with pytest.raises(InputError, match="not recorded"):
        history.first_crack(1e-3)


def test_samples_and_openings_that_no_history_has_are_refused_by_name():
    history = dem.simulate(block()[0], dem.Hold(steps=5))
    assert len(history.corners(-1)) == 2
    with pytest.raises(InputError, match="the history has samples 0 to 0, got 1"):
        history.corners(1)
    with pytest.raises(InputError, match="samples 0 to 0, got 0.5"):
        history.corners(0.5)
    with pytest.raises(InputError, match="opening must be positive"):
        history.first_crack(-1e-3)


def test_corners_alone_are_told_as_such():
    answer = dem.collapse(*block(), contact_model="vertices", error_budget=(), tolerance=0.05)
    assert answer.provenance["contact points"] is None


def test_a_duration_where_time_counts_steps_is_refused():
    """One second was one step: the load came on at once."""
    b, loads = block()
    stages = [dem.Settle(), dem.Ramp(0.1, duration=1.0)]
    with pytest.raises(InputError, match=r"stage 1 \(Ramp\): duration = 1 s is for dynamic runs"):
        dem.simulate(b, stages, loads=loads)
    run = dem.simulate(b, dem.Ramp(0.1, duration=0.01), loads=loads, mode="dynamic")
    assert run["time"][-1] == pytest.approx(0.01, rel=1e-9)
    with pytest.raises(InputError, match=r"stage 0 \(Hold\): duration"):
        dem.simulate(b, dem.Hold(duration=100.0), start=dem.initial_state(b, loads))


@pytest.mark.parametrize(("made", "words"), [
    (lambda: dem.Damping(kinetic="no"), "Damping: kinetic must be True or False, got 'no'"),
    (lambda: dem.Damping(0.5, combined=0.3), "Damping: combined"), (lambda: dem.Servo(1e3, parallel="no"), "parallel"),
    (lambda: dem.Drive({1: {"x": 1e-3}}, steps=9, keep="no"), "Drive: keep"),
    (lambda: dem.simulate(block()[0], dem.Settle(), contact_points=4), r"contact_points=4 .* contact_points=\(5, 5\)"),
    (lambda: dem.simulate(block()[0], dem.Settle(), contact_points=(4, 4, 4)), "contact_points for 'b"),
    (lambda: dem.simulate(block()[0], dem.Settle(), joint_options=dem.JointOptions(dashpot=np.inf)), "dashpot must be"),
])
def test_what_would_count_as_something_else_is_named_as_it_was_given(made, words):
    with pytest.raises(InputError, match=words):
        made()
