"""Where the difference between the associative multiplier and the DEM's comes from, one assumption at a time."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np

from limitmason.answers.results import ALMOST_SOLVED, SOLVED
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.mechanics.default_stiffness import default_stiffness
from limitmason.methods import ASSOCIATIVE, DEM, get_method, predict
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.frozen import ReadOnly
from limitmason.study.dilatancy import with_dilatancy
from limitmason.study.sweep import RunOptions, sweep
from limitmason.study.table import Table

FLOW, PRESSURE, GEOMETRY, SOFTNESS, RATE = ASSUMPTIONS = (
    "flow rule", "pressure in the faces", "geometry change", "shear softness", "rate",
)  # fmt: skip

MEANING = {
    FLOW: "psi = phi, then psi of the joints",
    PRESSURE: "forces at the corners of the faces, then spread by elasticity over a grid (torsion)",
    GEOMETRY: "kn and ks ten times as stiff, then as given: without change of geometry both give the same forces",
    SOFTNESS: "ks = kn, then as given",
    RATE: "half the load step and a fifth of the unbalance, then the search's own",
}
"""What each assumption is switched from (as in the associative program) and to (as in the DEM)."""

STIFFER = 10.0
_MOST_STEPS = 100_000  # for one load
# first stride and displacement that counts as moving: just above the limit blocks move too slowly to be told from rest
_TRIES = ((1.0, 0.02), (1.37, 0.01), (0.73, 0.005))


@dataclass(frozen=True)
class GapShare:
    """Part of the gap that one assumption makes.

    Parameters
    ----------
    assumption : its name in ``ASSUMPTIONS``
    forward : fall of the multiplier when it is switched in the order of ``ASSUMPTIONS`` [-]
    backward : fall when the order is reversed [-]
    """

    assumption: str
    forward: float
    backward: float

    @property
    def mean(self) -> float:
        """Mean of the two orders [-]."""
        return 0.5 * (self.forward + self.backward)

    @property
    def meaning(self) -> str:
        """What is switched."""
        return MEANING[self.assumption]


@dataclass(frozen=True, eq=False)
class GapAttribution(Displayed, ReadOnly):
    """The way from the associative multiplier to the DEM's.

    Parameters
    ----------
    associative : multiplier of the program with forces at the corners of the faces [-]
    corner : of the DEM with all assumptions switched to those of the program [-]
    dem : of the DEM as given [-]
    shares : one per assumption; in both orders they add up to corner - dem
    resolution : half the widest step from a load in equilibrium to one refused, because blocks moved or did not come to
        rest [-]; smaller shares are noise
    table : every run
    """

    associative: float
    corner: float
    dem: float
    shares: tuple[GapShare, ...]
    resolution: float
    table: Table

    @property
    def gap(self) -> float:
        """Associative multiplier less the DEM's [-]."""
        return self.associative - self.dem

    @property
    def remainder(self) -> float:
        """What no assumption explains.

        Program less DEM under the program's assumptions [-].
        """
        return self.associative - self.corner

    def __str__(self) -> str:
        """One line per assumption, with the remainder."""
        lines = [f"{'associative, forces at the corners':<36}{self.associative:9.5f}"]
        lines.append(f"{'':<36}{'forward':>9} {'backward':>9} {'mean':>9}")
        for s in self.shares:
            lines.append(f"  {s.assumption:<34}{_fall(s.forward)} {_fall(s.backward)} {_fall(s.mean)}   {s.meaning}")
        lines.append(f"  {'remainder (not explained)':<34}{'':>9} {'':>9} {_fall(self.remainder)}")
        lines.append(f"{'DEM as given':<36}{self.dem:9.5f}")
        lines.append(f"the searches resolve {self.resolution:.5f}: smaller shares are noise")
        return "\n".join(lines)


def _fall(share: float) -> str:
    """A share as a change, nothing as plain zero."""
    return f"{-share:+9.5f}" if abs(share) >= 5e-6 else f"{'0':>9}"


@of_model
def attribute_gap(
    assembly: Assembly,
    loads: Loads,
    *,
    contact_points: tuple[int, int] = (4, 8),
    tolerance: float = 1e-3,
    options: Mapping[str, Any] | None = None,
    **runs: Unpack[RunOptions],
) -> GapAttribution:
    """Split the gap between limit analysis and the DEM over their assumptions.

    Limit analysis is associative.

    lambda_assoc - lambda_DEM = sum of shares + remainder; each share is the fall of the DEM's multiplier when one
    assumption changes, along the chain of all five and along the reversed chain.

    Parameters
    ----------
    assembly, loads : the problem
    contact_points : along the unit and across the thickness, of the DEM as given
    tolerance : width of the bracket of every search over its multiplier [-]
    options : further settings of the DEM
    runs : executor, workers, store and progress of :func:`limitmason.study.sweep`; up to ten searches

    Returns
    -------
    GapAttribution
        Shares in both orders; where the two differ, assumptions act together. At psi = phi dilation carries the
        pressure to the corners whatever the points, at psi = 0 elasticity spreads it: so the flow rule takes little
        while forces sit at the corners, and the pressure little while psi = phi; the share goes to the second switched.

    Raises
    ------
    InputError
        When a search does not end, naming the state of the assumptions.

    Notes
    -----
    Displacements before collapse scale with 1 / stiffness, forces do not (dry joints, small displacements): scaling kn
    and ks together changes the multiplier through the geometry alone; a ninth of that share is left in the remainder.
    What ks / kn does is "shear softness", nothing where ks = kn. Still larger ks / kn has no limit to go to: at psi = 0
    joints ten times as stiff in shear as across do not come to rest. Joints without stiffness get the DEM's default,
    which is numerical: the share of the geometry then is too. Rate is what the search's steps leave out of equilibrium.
    """
    given = with_stiffness(assembly, loads)
    top = predict(assembly, loads, ASSOCIATIVE)
    if top.status != SOLVED:
        raise InputError(f"there is no gap to split: associative limit analysis says '{top.status}'")
    upper = top.collapse_multiplier
    names = _changing(given)
    chain = [tuple(a in names[:k] for a in ASSUMPTIONS) for k in range(len(names) + 1)]
    back = [tuple(a in names[len(names) - k :] for a in ASSUMPTIONS) for k in range(len(names) + 1)]
    states = list(dict.fromkeys([*chain, *back]))
    jobs = [dict(zip(_KEYS, state, strict=True)) for state in states]
    run = functools.partial(_at_state, given, loads, upper, contact_points, tolerance, dict(options or {}))
    key = ("gap", given, loads, jobs, contact_points, tolerance, options)
    table = sweep(run, jobs, key=key, **runs)
    value = {}
    for state, row in zip(states, table, strict=True):
        if row["status"] not in (SOLVED, ALMOST_SOLVED):
            changed = ", ".join(a for a, s in zip(ASSUMPTIONS, state, strict=True) if s) or "none"
            raise InputError(f"the DEM with these assumptions as given: {changed}; says {row['status']!r}")
        value[state] = row["multiplier"]
    forward = {a: value[chain[k]] - value[chain[k + 1]] for k, a in enumerate(names)}
    backward = {a: value[back[k]] - value[back[k + 1]] for k, a in enumerate(reversed(names))}
    shares = tuple(GapShare(a, forward.get(a, 0.0), backward.get(a, 0.0)) for a in ASSUMPTIONS)
    width = float(np.max(table["refused"] - table["multiplier"]))
    return GapAttribution(upper, value[chain[0]], value[chain[-1]], shares, 0.5 * width, table)


_KEYS = tuple(a.replace(" ", "_") for a in ASSUMPTIONS)


def _changing(assembly: Assembly) -> list[str]:
    """Assumptions whose two sides differ for these joints."""
    associated = all(i.joint.dilatancy_angle_deg == i.joint.friction_angle_deg for i in assembly.interfaces)
    isotropic = all(i.joint.shear_stiffness == i.joint.normal_stiffness for i in assembly.interfaces)
    same = {FLOW: associated, SOFTNESS: isotropic}
    return [a for a in ASSUMPTIONS if not same.get(a)]


def with_stiffness(assembly: Assembly, loads: Loads) -> Assembly:
    """The assembly with a stiffness in every joint: its own, or kn = ks by ``default_stiffness``."""
    standard = default_stiffness(assembly, loads.dead)

    def filled(joint: Joint) -> Joint:
        kn = joint.normal_stiffness or standard
        ks = kn if joint.shear_stiffness is None else joint.shear_stiffness
        return replace(joint, normal_stiffness=float(kn), shear_stiffness=float(ks))

    return assembly.with_joints(filled)


def _at_state(
    assembly: Assembly, loads: Loads, upper: float, points: tuple[int, int], tolerance: float,
    options: Mapping[str, Any], **state: bool,
) -> dict[str, Any]:  # fmt: skip
    """DEM with every assumption as in the program (False) or as given (True)."""
    flow, pressure, geometry, softness, rate = (state[k] for k in _KEYS)
    if not flow:
        assembly = with_dilatancy(assembly, 1.0)
    scale = 1.0 if geometry else STIFFER

    def stiff(joint: Joint) -> Joint:
        kn, ks = joint.normal_stiffness, joint.shear_stiffness
        assert kn is not None, "with_stiffness gives every joint one"
        assert ks is not None, "with_stiffness gives every joint one"
        return replace(joint, normal_stiffness=scale * kn, shear_stiffness=scale * (ks if softness else kn))

    assembly = assembly.with_joints(stiff)
    model: dict[str, Any] = {"contact_points": points} if pressure else {"contact_model": "vertices"}
    row: dict[str, Any] = {}
    for stride, moved in _TRIES:
        first = {"first_increment": (0.1 if rate else 0.05) * stride * upper}
        pace = {} if rate else {"equilibrium": 2e-5}
        fixed = {"error_budget": (), "tolerance": tolerance, "max_steps": _MOST_STEPS, "moved_limit": moved}
        settings = {**fixed, **model, **first, **pace, **options}
        dem = get_method(DEM)
        found = dem.predict(assembly, loads, **settings)
        row = dem.row_of(found)
        refused = [row["high"], *(u for u in found.details.get("undecided", ()) if u > row["multiplier"])]
        row |= {"refused": float(min(refused)), "undecided": len(refused) - 1}
        if row["status"] in (SOLVED, ALMOST_SOLVED):
            break
    return row
