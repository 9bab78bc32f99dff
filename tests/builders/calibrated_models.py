"""Small models with a closed form that calibrations are tried on."""

import math

import numpy as np

import limitmason as lm
from limitmason.answers.curve import Event


def power_law(x, y):
    return {"a": x * y, "b": x / y, "c": x**2}


def line(slope, constant):
    return {"values": [slope * t + constant for t in (0.0, 1.0, 2.0, 3.0)]}


def bilinear(stiffness, strength):
    u = np.linspace(0.0, 10.0, 401)
    crack = int(np.searchsorted(u, 0.5 * strength / stiffness))
    f = np.minimum(stiffness * u, strength)
    events = (Event("first crack", crack),) if crack < len(u) else ()
    return lm.Curve(u, f, "mm", "kN", events=events)


def chain(stiffness, mass):
    k = stiffness * np.array([[2.0, -1.0], [-1.0, 1.0]])
    return {"frequency": np.sqrt(np.linalg.eigvalsh(k / mass)) / (2.0 * math.pi)}
