"""Random joints and blocks: what is drawn, per assembly, kind, interface or block, within its physical bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from limitmason.arrays import Array
from limitmason.checks import choice, finite, positive, single_number
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.study.linked_formulas import LinkedFormulas

PER = ("assembly", "kind", "interface", "block")

# lower and upper physical bound of what can be drawn; the position keys the random numbers, so only append.
# 1e-300 stands for "positive": what is divided by must not be zero. 89 deg, as tan(phi) has no value at 90
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

ANGLES = {"friction_angle_deg": "friction_coefficient", "dilatancy_angle_deg": "dilatancy_ratio"}
"""Angles by which joints keep a property, and the other name under which it is drawn."""

# the same of blocks; what is not a property of the block itself is one of its material. An isotropic solid is stable
# for Poisson ratios between -1 and 0.5, neither of them included
BLOCK_BOUNDS: dict[str, tuple[float, float]] = {
    "density": (0.0, math.inf),
    "young_modulus": (1e-300, math.inf),
    "poisson_ratio": (-0.999, 0.499),
}

FIRST_BLOCK_KEY = 2000
"""Random numbers of block properties are keyed from here on, beyond those of joints and of what is drawn once."""

_DEFINITE = 1e-10
"""Added to the correlation of a value with itself: neighbours' are nearly one, rounding makes the matrix indefinite."""

UNITS = {
    "density": "kg/m3", "young_modulus": "Pa",
    "friction_angle_deg": "deg", "dilatancy_angle_deg": "deg", "cohesion": "Pa", "tensile_strength": "Pa",
    "compressive_strength": "Pa", "normal_stiffness": "Pa/m", "shear_stiffness": "Pa/m",
}


def normal(mean: float, variation: float) -> Any:
    """Normal distribution of ``scipy.stats`` by mean and coefficient of variation [-]."""
    if finite("mean", mean) == 0.0:
        raise InputError("normal: a mean of 0 has no coefficient of variation; give scipy.stats.norm(0.0, deviation)")
    return stats.norm(loc=mean, scale=abs(mean) * positive("variation", variation))


def lognormal(mean: float, variation: float) -> Any:
    """Lognormal distribution of ``scipy.stats``, by mean and coefficient of variation.

    Both are those of the values, not of their logarithms; the coefficient is in [-].
    """
    spread = math.sqrt(math.log1p(positive("variation", variation) ** 2))  # standard deviation of the logarithm
    return stats.lognorm(s=spread, scale=positive("mean", mean) * math.exp(-0.5 * spread**2))


def uniform(low: float, high: float) -> Any:
    """Uniform distribution between two values, as ``scipy.stats.uniform``."""
    if not finite("uniform: high", high) > finite("uniform: low", low):
        raise InputError(f"uniform: the upper value {high!r} must exceed the lower one {low!r}")
    return stats.uniform(loc=low, scale=high - low)


@dataclass(frozen=True)
class Random:
    """How a property of the joints or blocks, or a parameter of the builder, varies.

    Parameters
    ----------
    distribution : frozen distribution of ``scipy.stats``, or :func:`normal`, :func:`lognormal`, :func:`uniform`
    per : one value per "assembly" (non-spatial), per "kind" of joint, or per "interface" or "block" (spatial)
    correlation_length : of the values at interfaces or blocks [m], correlation of normal scores
        exp(-distance / length) of centres; 0 for independent ones
    low, high : further bounds within the physical ones; the distribution is truncated there, not clipped

    Raises
    ------
    InputError
        For an unknown ``per``, bounds in the wrong order, and a correlation length of what is not spatial.
    """

    distribution: Any
    per: str = "assembly"
    correlation_length: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        """Check every field."""
        choice("per", self.per, PER)
        frozen = not isinstance(self.distribution, stats.rv_continuous | stats.rv_discrete)
        if not (frozen and hasattr(self.distribution, "ppf") and hasattr(self.distribution, "cdf")):
            raise InputError(f"distribution must be a frozen one of scipy.stats, got {self.distribution!r}")
        for name in ("low", "high"):
            single_number(name, getattr(self, name), endless=True, signed=True)
        if not self.high > self.low:
            raise InputError(f"high = {self.high} must exceed low = {self.low}")
        spatial = self.per in ("interface", "block")
        length = finite("correlation_length", self.correlation_length)
        if length < 0.0 or (length > 0.0 and not spatial):
            raise InputError("correlation_length must not be negative, and needs per='interface' or 'block'")

    def value(self, share: Array | float, bounds: tuple[float, float] = (-math.inf, math.inf)) -> Array:
        """Value of the truncated distribution, F^-1(F(low) + u (F(high) - F(low))).

        Parameters
        ----------
        share : u, part of the probability between the bounds, from 0 to 1, any shape
        bounds : physical ones, beside its own
        """
        low, high, below, above = self._ends(bounds)
        if not above > below:
            raise InputError(f"the distribution has no probability between {low:g} and {high:g}")
        out = self.distribution.ppf(below + np.asarray(share, dtype=float) * (above - below))
        return np.clip(out, low, high)

    def cut(self, bounds: tuple[float, float]) -> float:
        """Probability that the bounds take from the distribution [-]."""
        _, _, below, above = self._ends(bounds)
        return 1.0 - (above - below)

    def _ends(self, bounds: tuple[float, float]) -> tuple[float, float, float, float]:
        """Both bounds, the probability below the lower one, and that up to and with the upper one [-]."""
        low, high = max(self.low, bounds[0]), min(self.high, bounds[1])
        # a discrete distribution may have its lower bound as a value: it is within
        below, above = (float(self.distribution.cdf(v)) for v in (np.nextafter(low, -np.inf), high))
        return low, high, below, above


def check_joint_draws(joints: Mapping[str, Random]) -> None:
    """Refuse draws of what no joint has, and of one property by two names.

    ``joints`` holds what is drawn, by property.
    """
    for name, random in joints.items():
        choice("joint property", name, BOUNDS)
        if not isinstance(random, Random):
            raise InputError(f"joint property {name!r} needs a Random(...), got {random!r}")
        if random.per == "block":
            raise InputError(f"joint property {name!r} has no value per block: use per='interface'")
    for angle, other in ANGLES.items():
        if {angle, other} <= set(joints):
            raise InputError(f"{angle!r} and {other!r} are the same property: draw one of them")


def check_block_draws(blocks: Mapping[str, Random]) -> None:
    """Refuse draws of what no block has, and draws not per block or per assembly."""
    for name, random in blocks.items():
        choice("block property", name, BLOCK_BOUNDS)
        if not isinstance(random, Random) or random.per not in ("assembly", "block"):
            raise InputError(f"block property {name!r} needs a Random(...) per block or per assembly, got {random!r}")


def check_links(links: Mapping[str, str], joints: Mapping[str, Random]) -> LinkedFormulas:
    """Formulas of joint properties from other joint properties, checked.

    Parameters
    ----------
    links : formula by the property that it gives
    joints : what is drawn, by property

    Raises
    ------
    InputError
        For what is no property of a joint, drawn and linked at once, or linked to nothing that a joint has, and for a
        dilatancy angle that is drawn or needed before its linked friction angle is known.
    """
    ties = LinkedFormulas(links)
    for name in ties.formulas:
        if name not in BOUNDS or name in ("friction_coefficient", "dilatancy_ratio"):
            raise InputError(f"links give properties of joints, got {name!r}")
    drawn = set(joints) | {angle for angle, other in ANGLES.items() if other in joints}
    if twice := sorted(drawn & set(ties.formulas)):
        raise InputError(f"{twice[0]!r} is drawn and linked: leave one of them out")
    if unknown := sorted(ties.needs - (set(BOUNDS) - {"dilatancy_ratio"})):
        raise InputError(f"a link needs {unknown[0]!r}, which is no property of a joint")
    if "friction_angle_deg" not in ties.formulas:
        return ties
    # psi is truncated at phi as it is drawn, when a linked phi is not known yet
    if "dilatancy_angle_deg" in joints or "dilatancy_angle_deg" in ties.needs:
        raise InputError("friction_angle_deg is linked: draw dilatancy_ratio, and need friction_angle_deg in its links")
    # the coefficient of a linked angle is that of the link, not the joint's own
    if "friction_coefficient" in ties.needs:
        return LinkedFormulas({**links, "friction_coefficient": "tan(radians(friction_angle_deg))"})
    return ties


def draw_blocks(
    assembly: Assembly, blocks: Mapping[str, Random], sample: int, seed: int, shares: Mapping[str, float]
) -> tuple[Assembly, dict[str, float]]:
    """Assembly with drawn blocks, held ones included, and the drawn values.

    The values come as entries of a row, mean and standard deviation where there are several.

    Parameters
    ----------
    assembly : the model
    blocks : what is drawn, by property
    sample, seed, shares : as for :func:`draw_joints`

    Raises
    ------
    InputError
        Where a property of the material is drawn and a block has no material.
    """
    values: dict[str, Array] = {}
    record: dict[str, float] = {}
    # every property has random numbers of its own, by its place among all
    for number, name in enumerate(BLOCK_BOUNDS):
        if name not in blocks:
            continue
        u = _shares(blocks[name], name, (sample, FIRST_BLOCK_KEY + number), seed, shares, assembly.centroids)
        values[name] = blocks[name].value(u, BLOCK_BOUNDS[name])
        record |= _recorded(name, blocks[name], values[name])
    changed = []
    for k, block in enumerate(assembly.blocks):
        # density is the block's own, all else its material's
        own: dict[str, Any] = {n: float(v[k]) for n, v in values.items() if n == "density"}
        of_material = {n: float(v[k]) for n, v in values.items() if n != "density"}
        if of_material:
            material: Any = getattr(block, "material", None)
            if material is None:
                raise InputError(f"block {block.name!r} has no material whose {next(iter(of_material))} could be drawn")
            own["material"] = replace(material, **of_material)
        changed.append(replace(block, **own))
    return replace(assembly, blocks=tuple(changed)), record


def draw_joints(
    assembly: Assembly, joints: Mapping[str, Random], sample: int, seed: int, shares: Mapping[str, float],
    links: LinkedFormulas | None = None,
) -> tuple[Assembly, dict[str, float]]:
    """Assembly with drawn joints, and the drawn values as entries of a row.

    Of a property with several values these are mean and standard deviation.

    Parameters
    ----------
    assembly : the model
    joints : what is drawn, by property
    sample, seed : together with the name of the property they alone decide the random numbers
    shares : probability at which values drawn per assembly are read, from 0 to 1, by property
    links : formulas of further properties, joint by joint, from those drawn and those that the joints have

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
        key = (sample, list(BOUNDS).index(name))  # of the random numbers
        kinds = [i.kind for i in assembly.interfaces]
        u = _shares(joints[name], name, key, seed, shares, assembly.arrays.centre, kinds)
        values[name] = joints[name].value(u, bounds)
        record |= _recorded(name, joints[name], values[name])
    if links:
        linked = _linked(assembly, values, links)
        for name, found in linked.items():
            values[name] = found
            record |= {name: float(found[0])} if np.ptp(found) == 0.0 else _mean_and_deviation(name, found)
    joints_of = zip(assembly.interfaces, _joints(assembly, values), strict=True)
    return assembly.with_interfaces([replace(i, joint=joint) for i, joint in joints_of]), record


def _smallest_friction_deg(assembly: Assembly, values: Mapping[str, Array]) -> float:
    """Least friction angle of all joints [deg], as drawn, or else as the model has it."""
    if "friction_angle_deg" in values:
        return float(values["friction_angle_deg"].min())
    if "friction_coefficient" in values:
        return float(np.rad2deg(np.arctan(values["friction_coefficient"].min())))
    return min(i.joint.friction_angle_deg for i in assembly.interfaces)


def _recorded(name: str, random: Random, values: Array) -> dict[str, float]:
    """Entries of a row for a drawn property: its one value, or mean and deviation."""
    return {name: float(values[0])} if random.per == "assembly" else _mean_and_deviation(name, values)


def _mean_and_deviation(name: str, values: Array) -> dict[str, float]:
    """Two entries of a row for a property of many values."""
    return {f"{name} mean": float(values.mean()), f"{name} deviation": float(values.std())}


def _linked(assembly: Assembly, values: Mapping[str, Array], links: LinkedFormulas) -> dict[str, Array]:
    """Linked properties of every interface, within physical bounds, shape (k,) each.

    A formula may need properties that are not drawn: these are those of the joints with what is drawn.

    Parameters
    ----------
    assembly : the model
    values : of every drawn property by interface, shape (k,)
    links : formula of every linked property
    """
    known, joints = dict(values), _joints(assembly, values)
    for name in links.needs - set(known):
        of_joints = [j.tan_phi if name == "friction_coefficient" else getattr(j, name) for j in joints]
        if any(v is None for v in of_joints):
            raise InputError(f"a link needs {name!r}, which the joints do not have")
        known[name] = np.array(of_joints, dtype=float)
    found = links(known)
    out = {}
    for name in links.formulas:
        column = np.broadcast_to(np.asarray(found[name], dtype=float), (len(assembly.interfaces),)).copy()
        low, high = BOUNDS[name]
        if not ((column >= low) & (column <= high)).all():
            worst = float(column[np.argmax(np.maximum(low - column, column - high))])
            raise InputError(f"the link of {name!r} gives {worst:.4g}, which no joint may have")
        out[name] = column
    if "dilatancy_angle_deg" in out:
        friction = [j.friction_angle_deg for j in _joints(assembly, {**values, **out})]
        if (out["dilatancy_angle_deg"] > friction).any():
            raise InputError("the link of 'dilatancy_angle_deg' gives more than the friction angle of a joint")
    return out


def _joints(assembly: Assembly, values: Mapping[str, Array]) -> list[Joint]:
    """Joint of every interface with drawn or linked ``values`` by name, (k,) each."""
    return [_changed(i.joint, {n: float(v[k]) for n, v in values.items()}) for k, i in enumerate(assembly.interfaces)]


def _shares(
    random: Random, name: str, key: tuple[int, int], seed: int, shares: Mapping[str, float], centre: Array,
    kind: Sequence[str] = (),
) -> Array:
    """Random probability at which each interface or block reads its value, shape (k,).

    Parameters
    ----------
    random : how the property varies
    name : of the property
    key : numbers of the sample and of the property, by which with the seed the random numbers are chosen
    seed : of the study
    shares : probabilities of what is drawn once per assembly, by name
    centre : places of the interfaces or blocks [m], between which values are correlated as exp(-distance / length),
        shape (k, 3)
    kind : of every interface, where there is one value per kind; unused else
    """
    count = len(centre)
    if random.per == "assembly":
        return np.full(count, shares[name])
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
    if random.per == "kind":
        kinds = sorted(set(kind))
        of_kind = dict(zip(kinds, rng.random(len(kinds)), strict=True))
        return np.array([of_kind[k] for k in kind])
    if random.correlation_length == 0.0:
        return rng.random(count)
    # normal scores with that correlation C: L z, with C = L L^T and independent z
    distance = np.linalg.norm(centre[:, None] - centre[None], axis=2)
    correlation = np.exp(-distance / random.correlation_length)
    scores = np.linalg.cholesky(correlation + _DEFINITE * np.eye(count)) @ rng.standard_normal(count)
    return stats.norm.cdf(scores)


def _changed(joint: Joint, drawn: Mapping[str, float]) -> Joint:
    """A joint with drawn properties by name; a psi larger than phi comes down to it."""
    own: dict[str, Any] = {k: v for k, v in drawn.items() if k not in ("friction_coefficient", "dilatancy_ratio")}
    # joints keep angles
    if "friction_coefficient" in drawn:
        own["friction_angle_deg"] = math.degrees(math.atan(drawn["friction_coefficient"]))
    phi = own.get("friction_angle_deg", joint.friction_angle_deg)
    if "dilatancy_ratio" in drawn:
        own["dilatancy_angle_deg"] = drawn["dilatancy_ratio"] * phi
    own["dilatancy_angle_deg"] = min(own.get("dilatancy_angle_deg", joint.dilatancy_angle_deg), phi)
    return replace(joint, **own)
