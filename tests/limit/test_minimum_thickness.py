"""Least thickness of arches, vaults and domes, built anew for each: published values and a program of thrust lines."""

import itertools

import numpy as np
import pytest
from thrust_lines import thinnest

import limitmason as lm
from limitmason.errors import InputError

ROUGH = lm.Joint(75.0)


def vertical_cuts(cuts, on_the_ground=4):
    """A semicircular arch cut by vertical planes; its ends beyond the intrados stand on the ground."""

    def make(thickness):
        inner, outer = 1.0 - thickness / 2, 1.0 + thickness / 2
        beyond = np.linspace(inner, outer, on_the_ground + 1)[1:]
        xs = np.concatenate([-beyond[::-1], inner * np.cos(np.linspace(np.pi, 0.0, cuts + 1)), beyond])

        def height(radius, x):
            return np.sqrt(np.maximum(radius**2 - x**2, 0.0))

        outlines = [[(-2, -1), (2, -1), (2, 0), (-2, 0)]]
        for a, b in itertools.pairwise(xs):
            corners = [(x, height(r, x)) for r, x in ((inner, a), (inner, b), (outer, b), (outer, a))]
            outlines.append([p for k, p in enumerate(corners) if np.hypot(*np.subtract(p, corners[k - 1])) > 1e-9])
        return lm.Assembly.from_polygons(outlines, thickness=0.5, joint=ROUGH, fixed=[0])

    return make


def radial_cuts(voussoirs, radius=1.0, joint=ROUGH):
    return lambda t: lm.build.arch(radius=radius, thickness=t, width=0.5, voussoirs=voussoirs, joint=joint)


def test_radial_cuts_meet_the_program_of_thrust_lines_and_milankovitch():
    found = lm.minimum_thickness(radial_cuts(60), between=(0.08, 0.2))
    assert found.high - found.low < 1e-7
    assert found.low == pytest.approx(thinnest(60), rel=1e-6)
    assert found.high == pytest.approx(0.1075, abs=1e-4)


def test_thickness_grows_with_the_radius_and_where_joints_slide():
    """At half the angle of friction that the least thickness needs (21.6 degrees) none is enough."""
    small = lm.minimum_thickness(radial_cuts(10), between=(0.08, 0.2))
    large = lm.minimum_thickness(radial_cuts(10, radius=20.0), between=(1.6, 4.0))
    assert large.high == pytest.approx(20.0 * small.high, rel=2e-7)
    with pytest.raises(InputError, match=r"does not stand at a thickness of 0\.2 m"):
        lm.minimum_thickness(radial_cuts(10, joint=lm.Joint(11.0)), between=(0.08, 0.2))
    assert lm.minimum_thickness(radial_cuts(10), between=(0.15, 0.2)).low == 0.0
    with pytest.raises(InputError, match="between must be"):
        lm.minimum_thickness(radial_cuts(10), between=(0.2, 0.1))


@pytest.mark.slow
def test_vertical_cuts_have_the_published_thickness():
    """Makris and Alexakis: t / R = 0.1095; their 0.1117 is a catenary's."""
    assert lm.minimum_thickness(vertical_cuts(80), between=(0.08, 0.2)).high == pytest.approx(0.1095, abs=1e-4)


@pytest.mark.slow
def test_a_barrel_is_its_arch_and_a_dome_is_thinner_than_half_of_it():
    """Hemispherical dome without tension in its rings: t / R = 0.042 (Heyman)."""

    def barrel(t):
        return lm.build.vault(thickness=t, voussoirs=10, unit_length=1.0, length=2.0, radius=1.0, joint=ROUGH)

    arch = lm.minimum_thickness(radial_cuts(10), between=(0.09, 0.13))
    assert lm.minimum_thickness(barrel, between=(0.09, 0.13)).high == pytest.approx(arch.high, rel=1e-6)

    def dome(t):
        return lm.build.dome(radius=1.0, thickness=t, courses=8, lunes=8, joint=ROUGH)

    found = lm.minimum_thickness(dome, between=(0.03, 0.06), accuracy=1e-5)
    assert found.high == pytest.approx(0.042, rel=0.01)


def with_friction(tangent, voussoirs=40):
    return radial_cuts(voussoirs, joint=lm.Joint(np.degrees(np.arctan(tangent))))


@pytest.mark.slow
def test_friction_of_a_semicircular_arch_has_the_three_published_ranges():
    """Cocchetti and Rizzi (2020), weight on the centre line: all hinges above tan(phi) = 0.395832, t / R = 0.107426.

    Thicker with sliding springings below, to 0.200637 at 0.309215; below that no thickness is enough.
    """
    turning = lm.minimum_thickness(with_friction(0.3960), between=(0.08, 0.35), accuracy=1e-6).high
    assert turning == pytest.approx(0.107426, rel=1e-3)
    mixed = lm.minimum_thickness(with_friction(0.3940), between=(0.08, 0.35), accuracy=1e-6).low
    assert mixed > turning * 1.001
    last = lm.minimum_thickness(with_friction(0.3095), between=(0.08, 0.35), accuracy=1e-5).high
    assert last == pytest.approx(0.200637, rel=0.02)
    with pytest.raises(InputError, match="does not stand"):
        lm.minimum_thickness(with_friction(0.3080), between=(0.08, 0.35))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::limitmason.ContactWarning")
def test_a_groin_vault_is_far_thinner_than_its_barrel_and_grows_with_it():
    def groin(radius):
        return lambda t: lm.build.vault(
            shape="groin", thickness=t, voussoirs=8, unit_length=0.5 * radius, radius=radius, projection=0.3 * radius,
            joint=lm.Joint(60.0),
        )

    one = lm.minimum_thickness(groin(1.0), between=(0.005, 0.1), accuracy=1e-5)
    assert one.low > 0.0
    assert one.high < 0.5 * lm.minimum_thickness(radial_cuts(8), between=(0.05, 0.2), accuracy=1e-5).low
    large = lm.minimum_thickness(groin(50.0), between=(0.25, 5.0), accuracy=5e-4)
    assert large.low / 50.0 < one.high
    assert large.high / 50.0 > one.low
