"""Assemblies that the tests of files write, and when two of them are the same."""

import json
import math

import numpy as np

from limitmason import Assembly, Joint
from limitmason.answers.acceptance import Certificate
from limitmason.answers.results import Mechanism, Prediction, Resultants

JOINT = Joint(33.0)


GROUND = [[-1, -0.2], [3, -0.2], [3, 0], [-1, 0]]


PIER = [[0, 0], [1, 0], [1, 2], [0, 2]]


LIP = [[1, 0], [2, 0], [2, 1], [1.5, 1], [1.5, 2], [1, 2]]


SIMPLE = {
    "schema": "limitmason-model",
    "version": 1,
    "outlines": [GROUND, PIER, LIP],
    "names": ["ground", "pier", "lip"],
    "thickness": 0.5,
    "density": 1800,
    "joint": {"friction_angle_deg": 33},
    "fixed": ["ground"],
    "loads": {"horizontal": [1, 0, 0]},
}


def make_assembly(**options):
    outlines = [np.array(o, dtype=float) for o in (GROUND, PIER, LIP)]
    return Assembly.from_polygons(
        outlines, thickness=0.5, density=[2400.0, 1 / 3e-3, 0.1 + 0.2], joint=JOINT, fixed=["ground"],
        names=["ground", "pier", "lip"], recipe={"unit": (0.4, math.pi), "limit": math.inf, "n": np.int64(3)},
        **options,
    )


def turned(assembly, angle=0.3):
    c, s = math.cos(angle), math.sin(angle)
    return assembly.transformed([[c, -s, 0], [s, c, 0], [0, 0, 1]], (1 / 3, 0.1, 0.7))


def same(a, b):
    """Two assemblies agree in every number."""
    assert [x.name for x in a.blocks] == [x.name for x in b.blocks]
    for x, y in zip(a.blocks, b.blocks, strict=True):
        assert x.density == y.density
        assert (x.axis is None) == (y.axis is None)
        assert x.axis is None or np.array_equal(x.axis, y.axis)
        assert len(x.parts) == len(y.parts)
        for p, q in zip(x.parts, y.parts, strict=True):
            assert np.array_equal(p.vertices, q.vertices)
            assert p.faces == q.faces
    assert len(a.interfaces) == len(b.interfaces)
    for x, y in zip(a.interfaces, b.interfaces, strict=True):
        assert (x.block_a, x.block_b, x.kind, x.joint) == (y.block_a, y.block_b, y.kind, y.joint)
        assert np.array_equal(x.polygon, y.polygon)
        assert np.array_equal(x.normal, y.normal)
    assert np.array_equal(a.held, b.held)
    assert a.tolerance == b.tolerance


def write(path, document):
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def make_prediction(assembly, multiplier=1 / 3):
    """A rocking pier: its twist about the toe, and one force on its base."""
    twists = np.zeros((assembly.n_blocks, 6))
    toe, omega = np.array([1.0, 0.25, 0.0]), np.array([0.0, 1.0, 0.0])
    twists[1] = [*np.cross(omega, assembly.centroids[1] - toe), *omega]
    x = assembly.arrays
    k = len(assembly.interfaces)
    base = next(n for n, i in enumerate(assembly.interfaces) if i.block_b == 1)
    normal, shear = np.zeros(k), np.zeros((k, 2))
    normal[base], shear[base] = 1000.0, (30.0, -40.0)
    force = normal[base] * x.normal[base] + shear[base, 0] * x.tangent_1[base] + shear[base, 1] * x.tangent_2[base]
    resultants = Resultants(normal, shear, np.zeros((k, 2)), np.zeros(k), toe[None], np.array([base]),
                            np.array([0.5]), force[None])
    return Prediction(
        "synthetic, associative", multiplier, "exact", "solved", Mechanism(twists, np.array([0.1]), np.zeros((1, 2))),
        resultants, Certificate(1e-9, 1 / 3), ("a warning",), {"numpy": np.__version__, "size": np.float64(0.1)},
        {"trace": np.array([0.1, math.nan])},
    )
