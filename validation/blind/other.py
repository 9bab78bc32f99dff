"""A second code for the truth: the same mechanisms as a continuum, by quadrature of virtual work.

Written apart from `surrogate`: no sums over courses, friction and weights are integrated over the height, torsion of an
overlap over its area. Its difference from the candidates is an effect of its own (about 1 %), to be declared as method
error before a verdict across the two codes is scored.
"""

import math

import numpy as np

from .surrogate import CAUSES, FRICTION, FRICTION_ERROR, UNIT_WEIGHT

STRIPS = 400


def _midpoints(top):
    return (np.arange(STRIPS) + 0.5) * top / STRIPS


def _radius(a, b):
    """Mean distance from the centre of a rectangle."""
    x = (np.arange(60) + 0.5) / 60 - 0.5
    return float(np.hypot(*np.meshgrid(a * x, b * x)).mean())


def multiplier(s, mu, effects):
    """Multiplier by balance of virtual work; ``effects`` are sizes of causes by name."""
    size = {c.name: effects.get(c.name, c.baseline) for c in CAUSES}
    mu = mu * math.exp(-size["wear"] * (s["order"] - 1))
    gamma, q, t, height, h = UNIT_WEIGHT * size["density"], s["overload"], s["thickness"], s["height"], s["unit_height"]
    v, c = s["overlap"] * size["overlap loss"], 1e3 * size["cohesion"]
    base = size["weak base joint"] * mu + c / (gamma * height + q / t)
    if s["setup"] == "slide":
        return base
    z = _midpoints(height)  # height above the hinge
    dz = height / STRIPS
    pull = 1e-3 * size["edge rounding"]
    if s["setup"] == "in-plane":
        # a triangular macro-block behind a crack of slope p; friction of the overlaps it crosses
        p = np.linspace(1e-3, 1.0, 2000) * (v - pull) / h
        depth = height - z
        weight = gamma * (p[:, None] * z[None, :]) * dz
        lift = weight * 0.5 * p[:, None] * z[None, :]
        travel = weight * z[None, :]
        rub = mu * gamma * (v - pull) / h * dz * depth * z * (1.0 - p[:, None] / ((v - pull) / h))
        value = (lift.sum(axis=1) + rub.sum(axis=1)) / travel.sum(axis=1)
        rock = float(value.min()) + c / (gamma * height) - size["P-delta"] * height
        return max(min(rock, base), 0.02)
    lever = 0.5 * t * size["effective thickness"] - pull
    lever -= 0.5 * (gamma * height + q / t) * 1e-6 * size["edge crushing"] * t
    sway, tilt = size["P-delta"] * height**2, math.tan(math.radians(size["out-of-plumb"]))
    climb = 1.0 + 2.0 * math.tan(math.radians(size["dilatancy"]))
    depth = height - z
    rub = (mu * gamma * climb * depth + c) * t * v / h * dz  # per side, over the height
    if s["setup"] == "flexure":
        slope = min(v / h, s["length"] / (2.0 * height))
        width = max(s["length"] - 2.0 * height * slope, 0.0)
        middle, sides = np.full(STRIPS, gamma * t * width * dz), gamma * t * 2.0 * slope * z * dz
        dead = (middle + sides).sum() * (lever - 0.5 * height * tilt - sway)
        arm = size["torsion strength"] * _radius(v, t * size["effective thickness"] - 2.0 * pull)
        work = (middle * z).sum() + 2.0 * (gamma * t * height**2 * slope / 2.0) * height / 3.0
        return max(min(float((dead + 2.0 * arm * rub.sum() / slope) / work), base), 0.02)
    weight, top = gamma * t * s["length"] * dz, q * s["length"]
    dead = (weight * (lever - tilt * z - sway)).sum() + top * (lever - tilt * height - 1.5 * sway)
    sides = s["side_walls"] if s["setup"] == "wall" else 0
    rock = (dead + sides * (rub * z).sum()) / ((weight * z).sum() + top * height)
    return max(min(float(rock), base), 0.02)


def expected(where, names, sizes, friction):
    """Values without noise by the second code; measurement causes act on its value."""
    effects = dict(zip(names, sizes, strict=True))
    by_name = {c.name: c for c in CAUSES}
    mu = FRICTION + FRICTION_ERROR * friction
    out = []
    for s in where.study.specimens:
        value = multiplier(s, mu, effects)
        for name in names:
            if by_name[name].transforms:
                value = by_name[name].apply(effects[name], value, s)
        out.append(value)
    return np.array(out)
