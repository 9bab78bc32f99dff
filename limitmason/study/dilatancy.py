"""What the dilatancy angle and the number of contact points do to the collapse multiplier of one structure."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from limitmason.checks import count, finite
from limitmason.errors import InputError
from limitmason.methods import ASSOCIATIVE, DEM, NON_ASSOCIATIVE, get_method, method_name, options_by_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.study.sweep import RunOptions, sweep
from limitmason.study.table import Table

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
POINTS = (2, 3, 4, 6, 8, 12, 16, 20)
"""Points across the thickness, chosen: close together where one more matters."""


@of_model
def with_dilatancy(assembly: Assembly, share: float) -> Assembly:
    """The assembly with psi = share x phi in every joint, 0 <= share <= 1."""
    if not 0.0 <= finite("share", share) <= 1.0:
        raise InputError(f"share must be psi / phi from 0 to 1, got {share!r}")
    return assembly.with_joints(lambda joint: replace(joint, dilatancy_angle_deg=share * joint.friction_angle_deg))


@of_model
def dilatancy_study(
    assembly: Assembly,
    loads: Loads,
    shares: Sequence[float] = SHARES,
    methods: Sequence[str] = (NON_ASSOCIATIVE, DEM),
    *,
    options: Mapping[str, Mapping[str, Any]] | None = None,
    **runs: Unpack[RunOptions],
) -> Table:
    """Collapse multiplier against the dilatancy angle, from psi = 0 to psi = phi.

    ratio = lambda(psi) / lambda(phi) by the same method; change = |lambda(0) - lambda(psi)| / lambda(0).

    Parameters
    ----------
    assembly, loads : the structure, whose psi is replaced
    shares : psi / phi [-]; 0 and 1 are needed for the ratios
    methods : "non-associative", "dem", or others that read psi
    options : settings by method
    runs : executor, workers, store and progress of :func:`limitmason.study.sweep`

    Returns
    -------
    Table
        method, share, psi [deg] (largest of the joints), multiplier, low, high, status, ratio, change [%].

    Raises
    ------
    InputError
        For shares outside 0 to 1, unknown methods, those that do not read psi, and options of methods not asked for.

    Notes
    -----
    At psi = 0 the ratio is that of Table 5 of Godio, Stefanou, Sab 2017, the change at psi = phi that of their Figs 12
    and 15. Between 0 and phi the limit analysis finds the smallest admissible multiplier: it may stay below the DEM.
    """
    methods = tuple(map(method_name, (methods,) if isinstance(methods, str) else methods))
    shares = _listed("shares", shares)
    chosen = options_by_method(methods, options)
    if blind := [m for m in methods if not get_method(m).feels("dilatancy")]:
        raise InputError(
            f"methods: {blind[0]!r} does not read psi, its multiplier is the same at every share; name others, such as "
            f"{NON_ASSOCIATIVE!r}; at psi = phi that is the associative one"
        )
    phi = max((i.joint.friction_angle_deg for i in assembly.interfaces), default=0.0)
    for share in shares:  # one that is wrong is refused before any run
        with_dilatancy(assembly, share)
    points = [{"method": m, "share": float(s), "psi": float(s) * phi} for m in methods for s in shares]
    key = ("dilatancy", assembly, loads, points, chosen)
    run = functools.partial(_at_dilatancy, assembly, loads, chosen)
    table = sweep(run, points, key=key, **runs, units={"psi": "deg", "change": "%"})
    rows = []
    for row in table:
        # multipliers of the same method by its shares psi / phi
        by_share = {r["share"]: r["multiplier"] for r in table if r["method"] == row["method"]}
        at_zero, at_phi = by_share.get(0.0, np.nan), by_share.get(1.0, np.nan)
        ratio = row["multiplier"] / at_phi if at_phi else np.nan
        change = 100.0 * abs(at_zero - row["multiplier"]) / at_zero if at_zero else np.nan
        rows.append({**row, "ratio": ratio, "change": change})
    return Table(tuple(rows), table.units, table.notes)


def _listed(name: str, values: Any) -> list[Any]:
    """Values as a list, which may be gone through twice; a single one is refused by its name."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise InputError(f"{name} must be a list: write [{values!r}]")
    return list(values)


def _at_dilatancy(
    assembly: Assembly, loads: Loads, options: Mapping[str, Mapping[str, Any]], *, method: str, share: float, psi: float
) -> dict[str, Any]:
    """Row of a method with psi a share of phi.

    Parameters
    ----------
    assembly, loads : the problem
    options : of each method, by name
    method : its name
    share : psi / phi [-]
    psi : largest of the joints [deg], a column of the table only
    """
    del psi
    return get_method(method).row(with_dilatancy(assembly, share), loads, options[method])


@of_model
def contact_point_study(
    assembly: Assembly,
    loads: Loads,
    points: Sequence[int] = POINTS,
    shares: Sequence[float] = (0.0, 1.0),
    *,
    along: int = 2,
    reference: bool = True,
    options: Mapping[str, Any] | None = None,
    **runs: Unpack[RunOptions],
) -> Table:
    """DEM multiplier against the number of contact points across the thickness.

    Each number is run at every ratio psi / phi in ``shares``.

    Parameters
    ----------
    assembly, loads : the structure, whose psi is replaced
    points : across the thickness
    shares : psi / phi [-]
    along : points along the unit
    reference : also the associative program on the same points, which more points never lower
    options : of the DEM, but for its ``contact_points``
    runs : executor, workers, store and progress of :func:`limitmason.study.sweep`

    Returns
    -------
    Table
        method, share, points, multiplier, low, high, status.

    Raises
    ------
    InputError
        For fewer than 2 points, shares outside 0 to 1, and ``contact_points`` among the options.

    Notes
    -----
    Figs 3, 11 and 12 of Godio, Stefanou, Sab 2017: 8 points suffice there. In the DEM at psi = 0 elasticity spreads
    the pressure and torsion falls to that of uniform pressure; at psi = phi dilation carries it back to the corners.
    """
    points = [count("points across the thickness", n, least=2) for n in _listed("points", points)]
    shares, chosen = _listed("shares", shares), dict(options or {})
    if "contact_points" in chosen:
        raise InputError("options: contact_points are what is studied, give points= and along=")
    for share in shares:
        with_dilatancy(assembly, share)
    jobs = [{"method": DEM, "share": float(s), "points": int(n)} for s in shares for n in points]
    if reference:
        jobs += [{"method": ASSOCIATIVE, "share": 1.0, "points": int(n)} for n in points]
    key = ("contact points", assembly, loads, jobs, along, chosen)
    return sweep(functools.partial(_at_points, assembly, loads, along, chosen), jobs, key=key, **runs)


def _at_points(
    assembly: Assembly, loads: Loads, along: int, options: Mapping[str, Any], *, method: str, share: float, points: int
) -> dict[str, Any]:
    """Row of a method with so many points across a joint.

    Parameters
    ----------
    assembly, loads : the problem
    along : points along a joint
    options : of the DEM
    method : the DEM, or the associative program, which has psi = phi whatever the share
    share : psi / phi [-]
    points : across a joint
    """
    if method == ASSOCIATIVE:
        # a plane problem would leave the points across the thickness out
        grid = {"contact_model": "grid", "grid": (along, points), "in_plane": False}
        return get_method(method).row(assembly, loads, grid)
    settings = {"contact_points": (along, points), **options}
    return get_method(method).row(with_dilatancy(assembly, share), loads, settings)
