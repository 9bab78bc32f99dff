"""Masonry as a continuum from tests: a coupon with closed forms, two materials, what is refused."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.calibration import CurveTarget, Parameter, SearchSettings, SolidModel, Target, calibrate
from limitmason.continuum import Box, Continuum, push
from limitmason.errors import InputError

SIDE, TO = 0.1, 1e-3
E, FT, GF = 9e8, 6e4, 15.0
START = lm.Material(4e8, 0.0, 0.0, tensile_strength=1.2e5, tensile_energy=25.0)


def cube(material=START):
    """One brick held on its foot, pulled up."""
    solid = Continuum.from_boxes([Box(np.zeros(3), np.full(3, SIDE))], material, size=SIDE)
    top = [(0, 0, SIDE), (SIDE, 0, SIDE), (SIDE, SIDE, SIDE), (0, SIDE, SIDE)]
    return solid.with_patch_pressure(top, force=-1.0)


def pulled(solid):
    return push(solid, control=((SIDE / 2, SIDE / 2, SIDE), (0, 0, 1)), to=TO, first=4e-6, largest=4e-5)


def closed_form():
    """Curve of a bar that cracks as a whole: E A u / L, then ft A exp(-ft (w - w0) / G ..) with the area G A.

    Only what the law's shape has no part in is aimed at: stiffness, peak, area.
    """
    u = np.linspace(0.0, TO, 4001)
    stiffness, peak = E * SIDE, FT * SIDE**2
    first = peak / stiffness
    rest = GF * SIDE**2 - 0.5 * peak * first
    f = np.where(u < first, stiffness * u, peak * np.exp(-peak * (u - first) / rest))
    return lm.Curve(u, f, "m", "N")


@pytest.fixture(scope="module")
def fit():
    unknowns = [
        Parameter("young_modulus", START.young_modulus, (1e8, 1e10), unit="Pa"),
        Parameter("tensile_strength", START.tensile_strength, (1e4, 1e6), unit="Pa"),
        Parameter("tensile_energy", START.tensile_energy, (3.0, 100.0), unit="N/m"),
    ]
    target = CurveTarget(closed_form(), 0.03, ("stiffness", "peak", "area"))
    return calibrate(SolidModel(cube(), pulled), {"curve": target}, unknowns, search=SearchSettings(starts=1, most=6),
                     level=None, leave_out=None)


@pytest.mark.slow
def test_pulled_brick_gives_back_modulus_strength_and_fracture_energy(fit):
    # E A / L, ft A and Gf A: three numbers of the curve, one for each property
    assert fit.parameters == pytest.approx(
        {"young_modulus": E, "tensile_strength": FT, "tensile_energy": GF}, rel=0.02
    )
    # the area of so coarse a curve jumps with its steps: its slope, and with it the deviation of Gf, is rough
    assert {"young_modulus", "tensile_strength"} <= set(fit.identified)


@pytest.mark.slow
def test_fit_predicts_the_peak_of_a_brick_twice_as_wide(fit):
    def twice(young_modulus, tensile_strength, tensile_energy):
        solid = Continuum.from_boxes(
            [Box(np.zeros(3), np.array([2 * SIDE, SIDE, SIDE]))],
            lm.Material(young_modulus, 0.0, 0.0, tensile_strength=tensile_strength, tensile_energy=tensile_energy),
            size=SIDE,
        )
        top = [(0, 0, SIDE), (2 * SIDE, 0, SIDE), (2 * SIDE, SIDE, SIDE), (0, SIDE, SIDE)]
        curve = push(solid.with_patch_pressure(top, force=-1.0), control=((SIDE, SIDE / 2, SIDE), (0, 0, 1)),
                     to=1e-4, first=4e-6, largest=8e-6)
        return {"peak": curve.peak.load}

    assert fit.predict(twice)["peak"].value == pytest.approx(2.0 * FT * SIDE**2, rel=0.03)


def test_properties_go_to_the_materials_that_are_named():
    boxes = [Box(np.zeros(3), np.full(3, SIDE)), Box(np.array([0, 0, SIDE]), np.array([SIDE, SIDE, 2 * SIDE]), 1)]
    soft, hard = lm.Material(4e8, 0.2, 2000.0, name="soft"), lm.Material(8e8, 0.2, 2000.0, name="hard")
    solid = Continuum.from_boxes(boxes, [soft, hard], size=SIDE)
    model = SolidModel(solid, lambda s: [m.young_modulus for m in s.materials], {"upper": ("young_modulus", [1])})
    assert model(upper=2e9) == [4e8, 2e9]
    assert SolidModel(solid, model.run)(young_modulus=3e9) == [3e9, 3e9]
    fitted = calibrate(lambda upper: {"E": model(upper=upper)[1]}, {"E": Target(5e9, 0.1)},
                       [Parameter("upper", 1e9, (1e8, 1e10))], leave_out=None)
    assert fitted.parameters["upper"] == pytest.approx(5e9, rel=1e-6)


def test_what_masonry_does_not_have_is_refused_by_name():
    with pytest.raises(InputError, match="no 'cohesion'"):
        SolidModel(cube(), pulled, {"c": ("cohesion", [0])})
    with pytest.raises(InputError, match="no material 3"):
        SolidModel(cube(), pulled, {"E": ("young_modulus", [3])})
    with pytest.raises(InputError, match="does not take 'friction'"):
        SolidModel(cube(), pulled)(friction=30.0)
    with pytest.raises(InputError, match="tensile_strength = -1.0 must not be negative"):
        SolidModel(cube(), pulled)(tensile_strength=-1.0)
