"""How far the first limit point of a path depends on what nobody measures: ks / kn, the grid of points, a preload."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.curve import CurvePoint
from limitmason.capacity.analysis import pushover
from limitmason.capacity.result import PushoverCurve
from limitmason.errors import InputError
from limitmason.mechanics.default_stiffness import default_stiffness
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

STIFFNESS_RATIO, GRID, PRELOAD = "ks/kn", "grid", "preload"

SPREADS = (STIFFNESS_RATIO, GRID, PRELOAD)
"""What the first limit point can be tried for."""

RATIOS = (0.4, 2.5)
"""Factors of ks at the same kn."""

GRIDS = ((2, 4), (2, 8), (4, 8))
"""Points along and across a joint, beside those of the path itself."""

PRELOADED = 0.5
"""Push the other way first, over the displacement of the first limit point."""


def spread(
    assembly: Assembly, loads: Loads, names: tuple[str, ...], reach: float, **settings: Any
) -> Mapping[str, Mapping[str, float]]:
    """First limit points of the variants that are named, NaN where a path has none [-].

    Parameters
    ----------
    names : of ``SPREADS``
    reach : displacement of the first limit point itself [m]
    settings : of :func:`pushover`, without ``to`` and ``start``

    Raises
    ------
    InputError
        For a name that is not known.
    """
    unknown = [n for n in names if n not in SPREADS]
    if unknown:
        raise InputError(f"spread must be out of {', '.join(map(repr, SPREADS))}, got {unknown[0]!r}")
    out: dict[str, dict[str, float]] = {}
    for name in names:
        found = out.setdefault(name, {})
        if name == STIFFNESS_RATIO:
            for factor in RATIOS:
                wall, chosen = _sheared(assembly, loads, settings, factor)
                found[f"{factor:g} ks"] = _limit(wall, loads, **chosen)
        elif name == GRID:
            for grid in GRIDS:
                chosen = {**settings, "contact_model": "grid", "grid": grid}
                found[f"{grid[0]} x {grid[1]}"] = _limit(assembly, loads, **chosen)
        else:
            before = pushover(assembly, loads, to=-PRELOADED * reach, **settings)
            found["the other way first"] = _limit(assembly, loads, start=before, **settings)
    return out


def _sheared(
    assembly: Assembly, loads: Loads, settings: Mapping[str, Any], factor: float
) -> tuple[Assembly, dict[str, Any]]:
    """The model and settings with shear stiffnesses times a factor."""
    given = settings.get("stiffness")
    if given is not None:
        pair = np.broadcast_to(np.asarray(given, dtype=float), (2,))
        return assembly, {**settings, "stiffness": (float(pair[0]), factor * float(pair[1]))}
    standard = default_stiffness(assembly, loads.dead)

    def other(joint: Joint) -> Joint:
        kn = joint.normal_stiffness or standard
        ks = kn if joint.shear_stiffness is None else joint.shear_stiffness
        return replace(joint, normal_stiffness=kn, shear_stiffness=factor * ks)

    return assembly.with_joints(other), dict(settings)


def governing_point(curve: PushoverCurve, assembly: Assembly) -> CurvePoint | None:
    """The first limit point, or the largest load where joints soften.

    It is None where the path still rises at its end.
    """
    point = curve.first_limit_point
    if point is not None and any(i.joint.softens for i in assembly.interfaces):
        # where joints break the load falls again and again, and recovers
        return curve.peak if curve.peak.index + 1 < len(curve) else None
    return point


def _limit(assembly: Assembly, loads: Loads, **settings: Any) -> float:
    point = governing_point(pushover(assembly, loads, **settings), assembly)
    return float("nan") if point is None else point.load
