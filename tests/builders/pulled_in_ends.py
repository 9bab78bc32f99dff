"""Walls of Ferris and Tin-Loi whose contact ends are pulled in, beside the curves of UDEC and LMGC90."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments

AT = (80, 100, 150, 200)  # mm
# multipliers of UDEC and LMGC90 at displacements of the top right corner of the last block, medians of about 30
# samples; example files of HybriDFEM 3.1 (Bouckaert, Godio and Pacheco de Almeida), blocks of 10 kN/m3
OTHERS = {
    "wall-1": {"UDEC": (0.513, 0.488, 0.426, 0.357), "LMGC90": (0.505, 0.480, 0.416, 0.345), "peak": 0.574},
    "wall-2": {"UDEC": (0.492, 0.478, 0.443, 0.390), "LMGC90": (0.480, 0.463, 0.429, 0.399), "peak": 0.497},
    "wall-3": {"UDEC": (0.303, 0.292, 0.263, 0.234), "LMGC90": (0.297, 0.285, 0.257, 0.229), "peak": 0.325},
}


@cache
def rounded(name, inset, kn, to, contacts="anew", steps=None):
    """Curve of a Ferris and Tin-Loi wall with contact ends pulled in, over the displacement of its top right corner.

    Stiffness per area of the whole joint: kn 1e8 Pa/m x area in the files, which pull in points and not springs.
    """
    test = experiments.load("ferris-tin-loi-2001", name, dilatancy_deg=0.0, density=1e4 / 9.81)
    whole = test.assembly()
    wall = whole.with_contact_ends_pulled_in(inset, direction=(0, 1, 0))
    share = whole.arrays.area / wall.arrays.area
    wall = wall.with_interfaces(
        replace(i, joint=replace(i.joint, normal_stiffness=kn * s, shear_stiffness=10 * kn * s))
        for i, s in zip(wall.interfaces, share, strict=True)
    )
    curve = lm.pushover(wall, test.loads(), to=to, contacts=contacts, steps=steps)
    last = wall.blocks[-1]
    corner = last.vertices.max(axis=0) * (1, 0.5, 1)
    moved = curve.displacement_of(last.name, at=corner)[:, 0]
    return 1e3 * (moved - moved[0]), curve


def between(name):
    return np.mean([OTHERS[name]["UDEC"], OTHERS[name]["LMGC90"]], axis=0)


def check_falling_branch(name, to):
    """With ends pulled in 10 mm and 5e7 Pa/m it lies beside both programs as far as 200 mm."""
    moved, curve = rounded(name, 0.01, 5e7, to)
    assert moved[-1] > 200.0
    assert np.interp(AT, moved, curve.load) == pytest.approx(between(name), rel=0.06)
    assert all(c.accepted for c in curve.certificates)


def check_frames_of_pairs(name, to):
    """With ends pulled in 20 mm the first points lie beside both programs, frames carried by the lower block."""
    moved, curve = rounded(name, 0.02, 1e8, to, "first")
    assert moved[-1] > 200.0
    assert np.interp(AT, moved, curve.load) == pytest.approx(between(name), rel=0.04)
