"""Twelve blocks that rock or slide, three causes, and one data set for every kind of answer, shared by tests."""

import math

import numpy as np

from limitmason import causes
from limitmason.diagnosis import Cause, Measured, Noise, Observation, Study

HEIGHTS = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 0.35, 0.55])
WIDTHS = np.array([0.10, 0.14, 0.07, 0.20, 0.07, 0.14, 0.10, 0.28, 0.07, 0.14, 0.20, 0.10])
FRICTION = {"friction_coefficient": Measured(0.70, 0.03)}


def blocks(specimen, *, friction_coefficient=0.7, rounding=0.0, slope=0.0):
    """Rocking or sliding block, b/h against f; the edge is pulled in by ``rounding`` [m]."""
    rocking = (specimen["width"] - 2.0 * rounding) / specimen["height"] * math.exp(slope * specimen["height"])
    return min(friction_coefficient, rocking) if specimen.get("slides") else rocking * friction_coefficient**0.1


def specimens(n=12):
    return [
        {"height": float(h), "width": float(w), "batch": "ABBA"[i % 4]}
        for i, (h, w) in enumerate(zip(HEIGHTS[:n], WIDTHS[:n], strict=True))
    ]


ROUNDING = Cause("edge rounding", "rounding", 0.0, (0.0, 0.02), "edges pulled in", unit="m")
GAIN = Cause("gain", "gain", 1.0, (0.7, 1.4), "sensor", "measurement", apply=lambda size, p, s: size * p)


def second_batch(size, prediction, specimen):
    return prediction * size if specimen["batch"] == "B" else prediction


BATCH = Cause("batch", "batch", 1.0, (0.7, 1.4), "other sensor", "measurement", second_batch, own=("batch",))
CAUSES = (ROUNDING, GAIN, BATCH)


def study(values=None, noise=None, **options):
    options = {"nuisance": FRICTION, "covariates": ["height", "width", "batch"]} | options
    return Study(specimens(), blocks, values, noise or Noise(0.04), **options)


def data(cause=None, size=0.0, seed=0, sd=0.04):
    expected = study().baseline() if cause is None else study().predicted([cause], [size])
    return expected * np.exp(sd * np.random.default_rng(seed).standard_normal(len(expected)))


def wet_and_dry():
    return np.linspace(-1, 1, 12)[np.random.default_rng(0).permutation(12)]


def kinds():
    two = study().predicted((ROUNDING, BATCH), (0.012, 1.25)) * np.exp(
        0.02 * np.random.default_rng(2).standard_normal(12)
    )
    wet = {"height": HEIGHTS, "humidity": wet_and_dry()}
    return {
        "none": study(data(seed=1)),
        "cause": study(data(ROUNDING, 0.018)),
        "either": study(data(ROUNDING, 0.012), Noise.unknown(), groups=list("aabbccddeeff")),
        "two": study(two, Noise(0.02)),
        "unexplained": study(data(seed=5) * np.exp(0.2 * wet["humidity"]), covariates=wet),
        "scatter": study(data(seed=0, sd=0.10)),
    }


def pulled(size, prediction, specimen):
    return prediction * (specimen["width"] - 2.0 * size) / specimen["width"]


# ---- three numbers a specimen -------------------------------------------------------------------------------------

SCATTER = {"peak": 0.04, "stiffness": 0.05, "frequency 1": 0.01}
LOAD_CELL = causes.gain()
SOFT = Cause("soft joints", "soft", 1.0, (0.4, 2.0), "joints softer than stated")
SLOPE = Cause("slope", "slope", 0.0, (-1.0, 1.0), "law of the height")
LISTED = (ROUNDING, LOAD_CELL, SOFT, SLOPE)


def walls(s, *, friction_coefficient=0.7, rounding=0.0, soft=1.0, slope=0.0):
    """Blocks that rock on a soft joint: peak, stiffness with the cube of the width, frequency of that stiffness."""
    width = s["width"] - 2.0 * rounding
    stiffness = soft * (width / s["height"]) ** 3
    return {
        "peak": blocks(s, friction_coefficient=friction_coefficient, rounding=rounding, slope=slope),
        "stiffness": stiffness, "frequency 1": 10.0 * np.sqrt(stiffness / (s["height"] * s["width"])),
    }


def observed(cause=None, size=0.0, *, seed=0, only=tuple(SCATTER), gain=1.0, simulate=walls):
    rng, out = np.random.default_rng(seed), []
    for i, s in enumerate(specimens()):
        found = simulate(s, **({} if cause is None else {cause.parameter: size}))
        for q, sd in SCATTER.items():
            read = found[q] * (gain if q != "frequency 1" else 1.0) * np.exp(sd * rng.standard_normal())
            if q in only:
                out.append(Observation(i, q, float(read), sd))
    return out


def several_kinds(rows, **options):
    inputs = {"nuisance": {"friction_coefficient": Measured(0.70, 0.03)}, "covariates": ["height", "width", "batch"]}
    return Study(specimens(), walls, rows, **(inputs | {"shared": ()} | options))
