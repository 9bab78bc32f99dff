"""BNW walls with units that deform: options, assumptions, bilinear data, drive."""

import numpy as np
import pytest

from limitmason import experiments
from limitmason.errors import InputError
from limitmason.experiments import bnw_walls

NAME = "bnw-walls"
INPUT = dict(friction=0.4, cohesion=0.25e6, young_modulus=3.088e9)


@pytest.mark.parametrize("specimen", experiments.specimens(NAME))
def test_a_course_has_as_many_units_as_fit_with_their_joints(specimen):
    test = experiments.load(NAME, specimen, friction=0.4)
    wall, p = test.assembly(), test.parameters
    lengths = [float(np.ptp(b.vertices[:, 0])) for b in wall.blocks if b.name.startswith("facade-01")]
    assert len(lengths) == 10
    # a unit and its joint; a unit shorter than the real one was laid here before
    assert all(float(p["unit length"]) / 1e3 < v < float(p["unit length"]) / 1e3 + 0.02 for v in lengths)


@pytest.mark.parametrize("specimen", experiments.specimens(NAME))
def test_bilinear_data_lie_under_the_envelope_they_idealise(specimen):
    test = experiments.load(NAME, specimen)
    m = test.measured
    for s in "+-":
        assert 0.85 * m[f"Vmax{s}"] < m[f"bilinear force{s}"] < m[f"Vmax{s}"]
        assert m[f"bilinear elastic drift{s}"] < m[f"drift at Vmax{s}"] < m[f"bilinear ultimate drift{s}"]
        assert m[f"bilinear ultimate drift{s}"] <= m[f"ultimate drift{s}"]
    curve = test.curve()
    assert curve.peak.load == m["bilinear force+"]
    height = 1e3 * float(test.parameters["height"])
    assert curve.displacement[-1] == pytest.approx(1e-2 * m["bilinear ultimate drift+"] * height)
    assert (curve.displacement_unit, curve.load_unit) == ("mm", "kN")


def test_cohesion_gives_the_uniaxial_strength_that_was_asked_for():
    for phi in (20.0, 35.0):
        test = experiments.load(NAME, "BNW1", **INPUT, unit_strength=3e6, unit_friction_deg=phi)
        unit = bnw_walls.unit_material(test)
        # s1 - s3 k = 2 c sqrt(k) without confinement
        assert 2.0 * unit.cohesion * np.tan(np.deg2rad(45.0 + 0.5 * phi)) == pytest.approx(3e6)
    unit = bnw_walls.unit_material(experiments.load(NAME, "BNW1", **INPUT))
    assert 2.0 * unit.cohesion * np.tan(np.deg2rad(62.5)) == pytest.approx(4.956e6)


def test_units_crack_in_their_middle_and_the_rest_stays():
    plain = experiments.load(NAME, "BNW1", **INPUT).assembly()
    cracked = experiments.load(NAME, "BNW1", **INPUT, unit_cracks=True).assembly()
    planes = [i for i in cracked.interfaces if i.kind == "crack"]
    # ten whole units in odd courses, nine and two halves in even ones; halves are left whole
    assert len(planes) == 4 * 10 + 3 * 9
    assert cracked.n_blocks == plain.n_blocks + len(planes)
    assert all((i.joint.residual_cohesion, i.joint.residual_tensile_strength) == (0.0, 0.0) for i in planes)
    assert planes[0].joint.tensile_strength == 0.2e6
    assert {b.material is None for b in cracked.blocks if b.name.startswith("facade")} == {False}
    # units that deform crush themselves
    assert all(np.isinf(i.joint.compressive_strength) for i in plain.interfaces)
    rigid = experiments.load(NAME, "BNW1", friction=0.4).assembly()
    assert all(i.joint.compressive_strength == pytest.approx(4.956e6) for i in rigid.interfaces)


def test_options_of_units_are_said_or_refused():
    with pytest.raises(InputError, match="unit_tension is of units that deform"):
        experiments.load(NAME, "BNW1", friction=0.4, unit_tension=1e5)
    with pytest.raises(InputError, match="has rigid units"):
        bnw_walls.unit_material(experiments.load(NAME, "BNW1", friction=0.4))
    text = str(experiments.load(NAME, "BNW1", **INPUT, unit_tension=0.4e6, unit_cracks=True))
    assert "ft 0.4 MPa" in text
    assert "brittle crack" in text
    assert "cracks through units, seen" not in text
    assert "cracks through units, seen" in str(experiments.load(NAME, "BNW1", friction=0.4))
