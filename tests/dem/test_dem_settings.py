"""Settings of a DEM collapse: one dataclass, the same by keyword, by object and by name of the method."""

import dataclasses
import warnings

import pytest
from walls import on_slab

import dem
import limitmason as lm


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


def test_an_unknown_setting_is_refused_by_name():
    with pytest.raises(TypeError, match="damp"):
        dem.collapse(*block(), damp=0.4)
    with pytest.raises(TypeError, match="did you mean 'damping'"):
        lm.predict(*block(), "dem", dampin=0.4)
