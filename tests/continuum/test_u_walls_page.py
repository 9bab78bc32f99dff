"""What the page of the U walls reads off a curve."""

import numpy as np
import pytest
from u_walls import light_damage, where_secant_is

import limitmason as lm


def test_light_damage_and_the_load_at_a_secant_of_a_bilinear_curve():
    # 40 kN/mm to 10 kN, then 20 kN/mm: secant 0.98 x 40 at u = 5 / (0.98 x 40 - 20) mm
    u = np.concatenate([[0.0], np.linspace(0.05, 1.0, 96)])
    load = np.where(u <= 0.25, 40 * u, 10 + 20 * (u - 0.25))
    curve = lm.Curve(1e-3 * u, 1e3 * load)
    at = 5 / (0.98 * 40 - 20)
    assert light_damage(curve) == pytest.approx((0.98 * 40 * at, at), rel=1e-9)
    # initial stiffness over 0.5 mm, 30 kN/mm: 29.4 at u = 5 / (29.4 - 20) mm
    later = 5 / (0.98 * 30 - 20)
    assert light_damage(curve, over=5e-4) == pytest.approx((0.98 * 30 * later, later), rel=1e-9)
    assert np.isnan(light_damage(curve, over=1e-3)).all()
    assert where_secant_is(curve, 50.0) == "above the elastic one"
    assert where_secant_is(curve, 20.0) == "not reached"
    assert where_secant_is(curve, 30.0) == "15.00 kN, 0.50 mm"
