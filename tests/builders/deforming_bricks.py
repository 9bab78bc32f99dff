"""Bricks that deform between joints of known stiffness: columns, and a cantilever with Timoshenko's deflection."""

from types import SimpleNamespace

import numpy as np

import limitmason as lm
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, SOLID

E, NU, KN, KS = 16.7e9, 0.2, 82e9, 36e9
STATES = (PLANE_STRESS, PLANE_STRAIN, SOLID)
SLIDING = lm.Joint(0.0, normal_stiffness=KN, shear_stiffness=KS)
BONDED = lm.Joint(35.0, cohesion=1e9, tensile_strength=1e9, normal_stiffness=KN, shear_stiffness=KS)


def bar_modulus(state, nu=NU):
    return E / (1.0 - nu**2) if state == PLANE_STRAIN else E


def brick(nu=NU, modulus=E):
    return lm.Material(young_modulus=modulus, poisson_ratio=nu)


def stack(count, joint, size=(0.2, 0.1, 0.075), material=None, plate=False):
    """Blocks on each other, the first held, with a rigid plate on top if wanted."""
    a, b, h = size
    outlines = [[(0, h * k), (a, h * k), (a, h * (k + 1)), (0, h * (k + 1))] for k in range(count + 1 + plate)]
    wall = lm.Assembly.from_polygons(outlines, thickness=b, joint=joint, fixed=[0])
    return wall.with_material(material or brick(), blocks=[f"block-{k}" for k in range(1, count + 1)])


def bonded_cantilever(state, force):
    """Four bricks with joints ten times as stiff, a force [N] on a rigid end piece, and what a beam says of it.

    The force acts at the middle of the end piece, 0.05 m beyond the bricks: a force and a moment on their end. The
    moments are those in the middle of the bricks.
    """
    length, depth, width, n, arm = 0.8, 0.1, 0.1, 4, 0.05
    h = length / n
    outlines = [[(h * k, 0), (h * (k + 1), 0), (h * (k + 1), depth), (h * k, depth)] for k in range(-1, n)]
    outlines.append([(length, 0), (length + 0.1, 0), (length + 0.1, depth), (length, depth)])
    kn, ks = 10.0 * E / h, 2.0 * E / h
    joint = lm.Joint(35.0, cohesion=1e9, tensile_strength=1e9, normal_stiffness=kn, shear_stiffness=ks)
    beam = lm.Assembly.from_polygons(outlines, thickness=width, joint=joint, fixed=[0])
    beam = beam.with_material(brick(), blocks=[f"block-{k}" for k in range(1, n + 1)])
    inertia, area = width * depth**3 / 12.0, width * depth
    stiff, shear = bar_modulus(state) * inertia, E / 2.0 / (1.0 + NU)
    at = arm + length
    deflection = force * (at**3 - arm**3) / 3.0 / stiff + 1.2 * force * length / (shear * area)
    joints = h * np.arange(n + 1)
    deflection += (force * (at - joints) ** 2 / (kn * inertia) + force / (ks * area)).sum()
    moment = force * (at - h * (np.arange(n) + 0.5))
    return SimpleNamespace(beam=beam, end=n + 1, deflection=deflection, moment=moment, inertia=inertia)
