"""Bricks stacked on a held block, joints of a given stiffness."""

import dem
import limitmason as lm

BRICK = lm.Material(young_modulus=16.7e9, poisson_ratio=0.15, density=2000.0)
KN, KS = 83e9, 36e9
DOWN = dem.Drive({"top": {"z": -1.0}})


def stacked(courses, *, width=0.2, height=0.1, depth=0.1, names=None, **law):
    """A stack on a held block; the uppermost is called "top"."""
    joint = lm.Joint(**{"friction_angle_deg": 30.0, "normal_stiffness": KN, "shear_stiffness": KS, **law})
    outlines = [[[-1.0, -0.1], [1.0, -0.1], [1.0, 0.0], [-1.0, 0.0]]] + [
        [[0.0, height * k], [width, height * k], [width, height * (k + 1)], [0.0, height * (k + 1)]]
        for k in range(courses)
    ]
    names = ["ground", *(f"b{k}" for k in range(courses - 1)), "top"]
    wall = lm.Assembly.from_polygons(outlines, thickness=depth, joint=joint, fixed=["ground"], names=names)
    return wall.with_material(BRICK)
