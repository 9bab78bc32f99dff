"""Energy of cracks beside the fracture energy of their area: by number, at any opening, turned and in other units."""

from dataclasses import replace

import numpy as np
import pytest

import limitmason as lm
from limitmason.continuum import Box, Continuum, Mesh, push

SIDE, GF, FT, E = 0.1, 12.0, 8e4, 8e8


def pulled(counts, *, nodes=20, points=3, poisson=0.2, to=2e-3, metre=1.0, newton=1.0, turn=None):
    """A block of cubes on a held foot, pulled up by pressure on its top, in any units and turned about any axis."""
    stress = newton / metre**2
    material = lm.Material(E * stress, poisson, 0.0, tensile_strength=FT * stress, tensile_energy=GF * newton / metre)
    h, q = SIDE * metre, np.eye(3) if turn is None else turn
    x, y, z = np.array(counts) * h
    solid = Continuum.from_boxes([Box(np.zeros(3), np.array([x, y, z]))], material, size=h, nodes=nodes, points=points)
    top = np.array([(0, 0, z), (x, 0, z), (x, y, z), (0, y, z)])
    if turn is not None:
        mesh = Mesh(solid.mesh.solid.p.T @ q.T, solid.mesh.bricks, solid.mesh.material, nodes)
        solid = replace(solid, mesh=mesh)
    solid = solid.with_patch_pressure(top @ q.T, force=-newton)
    return push(solid, control=(q @ [x / 2, y / 2, z], q @ [0, 0, 1]), to=to * metre)


@pytest.mark.parametrize(("counts", "nodes", "points", "rows"), [
    pytest.param((1, 1, 3), 20, 2, 1 / 2, marks=pytest.mark.slow),  # one of two rows of points across the crack
    pytest.param((1, 1, 3), 20, 3, 13 / 18, marks=pytest.mark.slow),  # weights 5, 8, 5: a middle row and an outer one
    pytest.param((3, 3, 3), 8, 3, 2, marks=pytest.mark.slow),  # two layers of bricks
    ((1, 1, 3), 8, 2, 3),  # all three
])
def test_a_curve_says_by_number_what_its_cracks_took_beside_the_fracture_energy(counts, nodes, points, rows):
    """Every row of points that cracks takes Gf A times its share of the brick: the path is wrong, and is named."""
    curve = pulled(counts, nodes=nodes, points=points)
    section = counts[0] * counts[1] * SIDE**2
    # the energy is what is lost and what is left under the curve, beside Gf A, without the check
    left = curve.load[-1] * GF / FT
    whole = (curve.energy.lost[-1] + curve.energy.stored[-1] + left) / (GF * section)
    assert whole == pytest.approx(rows, rel=0.01)
    found = curve.crack_energy()
    assert found.ratio == pytest.approx(rows, rel=0.04)
    assert found.taken == pytest.approx(curve.energy.lost[-1], rel=1e-9)
    assert found.of_one == pytest.approx(GF * section, rel=1e-3)
    assert any(f"cracks have taken {found.ratio:.2f} times the fracture energy" in w for w in curve.warnings)


@pytest.mark.slow
@pytest.mark.parametrize("to", [4e-5, 1e-4, 3e-4])
def test_one_crack_that_has_not_opened_wholly_is_no_less_than_one(to):
    """Lost at an opening w past the strength: Gf less the triangle that unloads, exact for any softening."""
    curve = pulled((2, 2, 3), nodes=8, points=2, poisson=0.0, to=to)
    assert curve.energy.lost[-1] < 0.95 * GF * 4 * SIDE**2
    assert curve.crack_energy().ratio == pytest.approx(1.0, abs=1e-6)
    assert not curve.warnings


def test_without_a_crack_nothing_is_said():
    curve = pulled((1, 1, 2), to=1e-5)
    assert curve.energy.lost[-1] == 0.0
    assert curve.crack_energy().ratio == 1.0
    assert not curve.warnings


TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:material")
@pytest.mark.parametrize("options", [
    {"metre": 1e3},
    {"turn": TURN * np.sign(np.linalg.det(TURN))},
])
def test_energy_of_cracks_is_the_same_in_millimetres_and_turned(options):
    here, there = (pulled((1, 1, 3), nodes=8, to=1e-3, **o) for o in ({}, options))
    metre = options.get("metre", 1.0)
    assert there.displacement / metre == pytest.approx(here.displacement, rel=1e-6)
    assert there.load == pytest.approx(here.load, rel=1e-3)
    assert there.crack_energy().of_one / metre == pytest.approx(here.crack_energy().of_one, rel=1e-4)
    assert there.crack_energy().ratio == pytest.approx(here.crack_energy().ratio, rel=1e-4)
