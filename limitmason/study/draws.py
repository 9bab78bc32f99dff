"""Random joints: what is drawn, per assembly, per kind of joint or per interface, within its physical bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

Array = NDArray[np.float64]

PER = ("assembly", "kind", "interface")

# lower and upper physical bound of what can be drawn; the position keys the random numbers, so only append
BOUNDS: dict[str, tuple[float, float]] = {
    "friction_coefficient": (0.0, math.inf),
    "friction_angle_deg": (0.0, 89.0),
    "dilatancy_angle_deg": (0.0, 89.0),
    "dilatancy_ratio": (0.0, 1.0),
    "cohesion": (0.0, math.inf),
    "tensile_strength": (0.0, math.inf),
    "compressive_strength": (1e-300, math.inf),
    "normal_stiffness": (1e-300, math.inf),
    "shear_stiffness": (1e-300, math.inf),
}

UNITS = {
    "friction_angle_deg": "deg", "dilatancy_angle_deg": "deg", "cohesion": "Pa", "tensile_strength": "Pa",
    "compressive_strength": "Pa", "normal_stiffness": "Pa/m", "shear_stiffness": "Pa/m",
}  # fmt: skip


def normal(mean: float, variation: float) -> Any:
    """Normal distribution by mean and coefficient of variation [-]; ``scipy.stats.norm``."""
    return stats.norm(loc=mean, scale=abs(mean) * _positive("variation", variation))


def lognormal(mean: float, variation: float) -> Any:
    """Lognormal distribution by its own mean and coefficient of variation [-]; ``scipy.stats.lognorm``."""
    spread = math.sqrt(math.log1p(_positive("variation", variation) ** 2))
    return stats.lognorm(s=spread, scale=_positive("mean", mean) * math.exp(-0.5 * spread**2))


def uniform(low: float, high: float) -> Any:
    """Uniform distribution between two values; ``scipy.stats.uniform``."""
    if not high > low:
        raise InputError(f"uniform: the upper value {high!r} must exceed the lower one {low!r}")
    return stats.uniform(loc=low, scale=high - low)


def _positive(name: str, value: float) -> float:
    if not value > 0.0:
        raise InputError(f"{name} must be positive, got {value!r}")
    return value


@dataclass(frozen=True)
class Random:
    """How a property of the joints, or a parameter of the builder, varies.

    Parameters
    ----------
    distribution : frozen distribution of ``scipy.stats``, or :func:`normal`, :func:`lognormal`, :func:`uniform`
    per : one value per "assembly", per "kind" of joint, or per "interface" (spatial)
    correlation_length : of the values at interfaces [m], correlation exp(-distance / length); 0 for independent ones
    low, high : further bounds within the physical ones; the distribution is truncated there, not clipped

    Raises
    ------
    ValueError
        For an unknown ``per``, bounds in the wrong order, and a correlation length without "interface".
    """

    distribution: Any
    per: str = "assembly"
    correlation_length: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        """Check every field."""
        if self.per not in PER:
            raise InputError(f"per must be one of {PER}, got {self.per!r}")
        if not (hasattr(self.distribution, "ppf") and hasattr(self.distribution, "cdf")):
            raise InputError(f"distribution must be a frozen one of scipy.stats, got {self.distribution!r}")
        if not self.high > self.low:
            raise InputError(f"high = {self.high} must exceed low = {self.low}")
        if not self.correlation_length >= 0.0 or (self.correlation_length > 0.0 and self.per != "interface"):
            raise InputError("correlation_length must not be negative, and needs per='interface'")

    def value(self, share: Array | float, bounds: tuple[float, float] = (-math.inf, math.inf)) -> Array:
        """Value at a share of the probability [-] between the bounds: F^-1(F(low) + u (F(high) - F(low)))."""
        low, high = max(self.low, bounds[0]), min(self.high, bounds[1])
        below, above = float(self.distribution.cdf(low)), float(self.distribution.cdf(high))
        if not above > below:
            raise InputError(f"the distribution has no probability between {low:g} and {high:g}")
        out = self.distribution.ppf(below + np.asarray(share, dtype=float) * (above - below))
        return np.clip(out, low, high)


def check_joint_draws(joints: Mapping[str, Random]) -> None:
    """Refuse names that no joint has, and two names for one property."""
    for name, random in joints.items():
        if name not in BOUNDS:
            raise InputError(f"unknown joint property {name!r}; known: {', '.join(BOUNDS)}")
        if not isinstance(random, Random):
            raise InputError(f"joint property {name!r} needs a Random(...), got {random!r}")
    for pair in (("friction_coefficient", "friction_angle_deg"), ("dilatancy_angle_deg", "dilatancy_ratio")):
        if set(pair) <= set(joints):
            raise InputError(f"{pair[0]!r} and {pair[1]!r} are the same property: draw one of them")


def draw_joints(
    assembly: Assembly, joints: Mapping[str, Random], sample: int, seed: int, shares: Mapping[str, float]
) -> tuple[Assembly, dict[str, float]]:
    """Assembly with drawn joints, and the drawn values (mean and standard deviation where there are several).

    Parameters
    ----------
    sample, seed : together with the name of the property they alone decide the random numbers
    shares : probability [-] of the values drawn per assembly

    Notes
    -----
    psi is kept at or below phi, property by property: an angle is truncated at the smallest phi drawn with it, and
    where only phi is drawn, a larger psi of the model comes down to it.
    """
    values: dict[str, Array] = {}
    record: dict[str, float] = {}
    for name in BOUNDS:  # friction comes before dilatancy
        if name not in joints:
            continue
        bounds = BOUNDS[name]
        if name == "dilatancy_angle_deg":
            bounds = (0.0, min(bounds[1], _smallest_friction_deg(assembly, values)))
        u = _shares(assembly, joints[name], name, sample, seed, shares)
        values[name] = joints[name].value(u, bounds)
        if joints[name].per == "assembly":
            record[name] = float(values[name][0])
        else:
            record[f"{name} mean"], record[f"{name} deviation"] = float(values[name].mean()), float(values[name].std())
    changed = [
        replace(i, joint=_changed(i.joint, {n: float(v[k]) for n, v in values.items()}))
        for k, i in enumerate(assembly.interfaces)
    ]
    return assembly.with_interfaces(changed), record


def _smallest_friction_deg(assembly: Assembly, values: Mapping[str, Array]) -> float:
    if "friction_angle_deg" in values:
        return float(values["friction_angle_deg"].min())
    if "friction_coefficient" in values:
        return float(np.rad2deg(np.arctan(values["friction_coefficient"].min())))
    return min(i.joint.friction_angle_deg for i in assembly.interfaces)


def _shares(
    assembly: Assembly, random: Random, name: str, sample: int, seed: int, shares: Mapping[str, float]
) -> Array:
    """Probability per interface, shape (k,)."""
    count = len(assembly.interfaces)
    if random.per == "assembly":
        return np.full(count, shares[name])
    key = (sample, list(BOUNDS).index(name))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    if random.per == "kind":
        kinds = sorted({i.kind for i in assembly.interfaces})
        of = dict(zip(kinds, rng.random(len(kinds)), strict=True))
        return np.array([of[i.kind] for i in assembly.interfaces])
    if random.correlation_length == 0.0:
        return rng.random(count)
    centre = assembly.arrays.centre
    distance = np.linalg.norm(centre[:, None] - centre[None], axis=2)
    matrix = np.exp(-distance / random.correlation_length)
    return stats.norm.cdf(np.linalg.cholesky(matrix + 1e-10 * np.eye(count)) @ rng.standard_normal(count))


def _changed(joint: Joint, drawn: Mapping[str, float]) -> Joint:
    own: dict[str, Any] = {k: v for k, v in drawn.items() if k not in ("friction_coefficient", "dilatancy_ratio")}
    if "friction_coefficient" in drawn:
        own["friction_angle_deg"] = math.degrees(math.atan(drawn["friction_coefficient"]))
    phi = own.get("friction_angle_deg", joint.friction_angle_deg)
    if "dilatancy_ratio" in drawn:
        own["dilatancy_angle_deg"] = drawn["dilatancy_ratio"] * phi
    own["dilatancy_angle_deg"] = min(own.get("dilatancy_angle_deg", joint.dilatancy_angle_deg), phi)
    return replace(joint, **own)
