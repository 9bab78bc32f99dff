"""Columns of simply deformable blocks with a rigid cap against Timoshenko's beam, from soft to stiff joints."""

from itertools import pairwise

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, SOLID
from limitmason.deformable.levels import SIMPLY_DEFORMABLE
from limitmason.geometry.polyhedron import Solid, box
from limitmason.geometry.rotation import rotation_matrices

E, FORCE = 2e9, 1e3
WIDTH, DEPTH, HEIGHT, CAP = 0.3, 0.2, 0.4, 0.1
AREA, INERTIA = WIDTH * DEPTH, DEPTH * WIDTH**3 / 12.0
TURN = rotation_matrices(np.array([[0.3, -0.7, 0.4]]))[0]


def column(count, kn, nu, turn=None, shuffle=False):
    """Held base, blocks with a material, a rigid cap; all joints hold."""
    joint = lm.Joint(40.0, cohesion=1e9, tensile_strength=1e9, normal_stiffness=kn, shear_stiffness=kn)
    heights = [-0.3, *(HEIGHT * np.arange(count + 1)), HEIGHT * count + CAP]
    half = np.array([0.5 * WIDTH, 0.5 * DEPTH])
    solids = [box((*-half, low), (*half, high)) for low, high in pairwise(heights)]
    if turn is not None:
        solids = [Solid(s.vertices @ turn.T, s.faces) for s in solids]
    names = ["base", *(f"b{k}" for k in range(count)), "cap"]
    order = np.random.default_rng(1).permutation(len(names)) if shuffle else np.arange(len(names))
    wall = lm.Assembly.from_polyhedra(
        [(solids[k].vertices, solids[k].faces) for k in order], joint=joint, density=1e-3, fixed=["base"],
        names=[names[k] for k in order],
    )
    return wall.with_material(lm.Material(young_modulus=E, poisson_ratio=nu), blocks=names[1:-1])


def moved(wall, force, stress, grid=(9, 9), turn=None):
    """Displacement of the cap under a force on it, in the column's own axes."""
    r = np.eye(3) if turn is None else turn
    cap = wall.block_index("cap")
    loads = lm.Loads.weight(wall).with_point_load(wall, cap, tuple(r @ force))
    return lm.elastic_range(wall, loads, blocks=SIMPLY_DEFORMABLE, stress=stress, grid=grid).shift_live[cap, :3] @ r


def beam(count, kn, nu, modulus):
    """Sway of the cap's centroid under a force through it, and its settlement: beam and joints in series."""
    length, top = HEIGHT * count, HEIGHT * count + 0.5 * CAP
    arm = top - HEIGHT * np.arange(count + 1)
    joints = (arm**2 / (kn * INERTIA) + 1.0 / (kn * AREA)).sum()
    shear = E / (2.0 * (1.0 + nu)) * 5.0 / 6.0
    sway = joints + (top**3 - (top - length) ** 3) / (3.0 * modulus * INERTIA) + length / (shear * AREA)
    return FORCE * sway, FORCE * ((count + 1) / (kn * AREA) + length / (modulus * AREA))


@pytest.mark.parametrize("state", [PLANE_STRESS, PLANE_STRAIN, SOLID])
@pytest.mark.parametrize("nu", [0.0, 0.2, 0.3, 0.45])
@pytest.mark.parametrize(
    ("count", "within"),
    [(2, 0.01), pytest.param(4, 0.004, marks=pytest.mark.slow), pytest.param(12, 0.002, marks=pytest.mark.slow)],
)
def test_column_is_timoshenkos_however_stiff_its_joints_and_much_its_blocks_widen(count, within, nu, state):
    """Without plane faces, stiff joints held the blocks' widening: too stiff by 12 to 55 % at 1e13 Pa/m."""
    modulus = E / (1.0 - nu**2) if state == PLANE_STRAIN else E
    for kn in (1e8, 1e11, 1e13):
        wall = column(count, kn, nu)
        sway, settled = beam(count, kn, nu, modulus)
        # in plane strain the shear coefficient 5/6 has no part of nu / (1 - nu), of which the parabola has some
        bound = 2.0 * within if state == PLANE_STRAIN else within
        assert moved(wall, (FORCE, 0, 0), state)[0] == pytest.approx(sway, rel=bound)
        assert -moved(wall, (0, 0, -FORCE), state)[2] == pytest.approx(settled, rel=1e-6)


def test_turned_and_renumbered_column_sways_alike():
    one, two = column(3, 1e12, 0.3), column(3, 1e12, 0.3, TURN, shuffle=True)
    force = np.array((FORCE, 0.4 * FORCE, -2.0 * FORCE))
    assert (
        np.abs(moved(one, force, SOLID) - moved(two, force, SOLID, turn=TURN)).max()
        < 1e-7 * np.abs(moved(one, force, SOLID)).max()
    )


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_sway_in_other_units_of_stiffness_scales(scale):
    wall = column(3, 1e12, 0.3)
    other = column(3, scale * 1e12, 0.3).with_material(
        lm.Material(young_modulus=scale * E, poisson_ratio=0.3), blocks=[f"b{k}" for k in range(3)]
    )
    force = np.array((FORCE, 0.0, 0.0))
    assert scale * moved(other, force, SOLID) == pytest.approx(moved(wall, force, SOLID), rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("ratio, told", [(1.0, True), (6.0, False), (50.0, False)])
def test_simple_blocks_as_soft_as_their_joints_say_so(ratio, told):
    # E / (kn l): beyond 5 three frequencies lie within 2 % of those of blocks with many more shapes
    joint = lm.Joint(30.0, normal_stiffness=1e10, shear_stiffness=5e9)
    outlines = [[(0, 0.2 * k), (0.2, 0.2 * k), (0.2, 0.2 * k + 0.2), (0, 0.2 * k + 0.2)] for k in range(4)]
    column = lm.Assembly.from_polygons(outlines, thickness=0.6, joint=joint, fixed=[0])
    modulus = ratio * 1e10 * (0.2 * 0.2 * 0.6) ** (1.0 / 3.0)
    column = column.with_material(lm.Material(young_modulus=modulus, poisson_ratio=0.2))
    few, many = (lm.modes(column, 3, blocks=blocks) for blocks in ("simply deformable", "ritz"))
    assert (np.abs(few.frequency / many.frequency - 1.0).max() > 0.02) == told
    moving = dem.initial_state(column, lm.Loads.weight(column), blocks="simply deformable")
    for told_by in (few, moving):
        assert any("hardly stiffer than its joints" in w for w in told_by.warnings) == told
    assert not any("hardly stiffer" in w for w in many.warnings)
