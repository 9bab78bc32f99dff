"""Axles that drive over an arch bridge: the multiplier at every position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.results import Prediction, Status
from limitmason.arrays import Array
from limitmason.checks import finite, numbers
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError, NotConverged
from limitmason.limit.analysis import whole_limit_analysis
from limitmason.model.assembly import Assembly
from limitmason.model.axles import axle_forces, extrados
from limitmason.model.input import read_list
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.interrupts import ends_early


@dataclass(frozen=True, eq=False)
class AxleEnvelope(Displayed):
    """Multiplier of a train of axles over its positions.

    Parameters
    ----------
    positions : x of the first axle [m], shape (n,)
    multipliers : of the axles' loads [-], shape (n,); infinite where they load no block, or where nothing fails; NaN
        where Ctrl-C came before
    governing : position with the smallest multiplier [m]
    prediction : at that position, with forces and mechanism
    status : "solved", or "interrupted" by Ctrl-C: the smallest of the positions done so far
    """

    positions: Array
    multipliers: Array
    governing: float
    prediction: Prediction
    status: Status = Status.SOLVED

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is missing after an interrupt."""
        missing = self.positions[np.isnan(self.multipliers)]
        if not len(missing):
            return ()
        where = f"{len(missing)} of {len(self.positions)} positions are missing, from x = {missing[0]:.4g} m on"
        return (f"it was interrupted: {where}; give them as positions=",)

    def __str__(self) -> str:
        """The smallest multiplier and where, and what is missing."""
        least = f"{np.nanmin(self.multipliers):.6g} with the first at x = {self.governing:.4g} m"
        return "\n".join([f"axles: smallest multiplier {least}", *self.warnings])


POSITIONS = 100
"""Positions of the train by default: chosen."""

SAME = 1e-7
"""Relative difference of multipliers that is rounding: of mirrored places the first governs."""


@of_model
def axle_envelope(
    assembly: Assembly,
    loads: Loads,
    axles: Sequence[tuple[float, float]],
    *,
    level: float,
    positions: ArrayLike | None = None,
    spread_deg: float = 30.0,
    contact: float = 0.3,
    **options: Any,
) -> AxleEnvelope:
    """Multiplier of axles at every position over an arch bridge, along x.

    At each, lambda scales the axles, which spread through the fill; dead loads, with those of the fill, stay.

    Parameters
    ----------
    assembly, loads : the bridge and its dead loads, see ``Loads.with_backfill``
    axles : of each its place behind the first, towards -x [m], and its load over the whole width [N]
    level : top of the fill [m]
    positions : x of the first axle [m]; by default 100 from where it comes onto the extrados until the last has left it
    spread_deg, contact : angle of the spread from the vertical [deg], and length of the wheels on the fill [m], as for
        :func:`limitmason.model.axles.axle_forces`
    options : of :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    AxleEnvelope
        Draw it with ``lm.figures.axle_envelope``. Ctrl-C ends it with the positions done so far.

    Raises
    ------
    InputError
        For no axles, live loads, and fill below the extrados.
    NotConverged
        Where a position is not solved, naming it.

    Notes
    -----
    Static positions, no impact; fill passes load on and resists nothing, which is on the safe side for most arches.
    """
    axles = read_list("axles", axles)
    pairs = all(np.shape(axle) == (2,) for axle in axles)
    train = [(finite("axles", x), finite("axles", p)) for x, p in axles] if pairs else []
    if not train or not all(p > 0.0 for _, p in train):
        raise InputError("axles: give pairs of a place behind the first [m] and a load above 0 [N]")
    finite("level", level)
    if loads.live.any():
        raise InputError("loads: the axles are the live load; give the others with case='dead'")
    strips = extrados(assembly)
    if positions is None and strips:
        # an axle before the first, of a place below zero, comes onto the extrados earlier
        behind = [x for x, _ in train]
        start, end = strips[0].start + min(behind), max(s.end for s in strips) + max(behind)
        positions = np.linspace(start, end, POSITIONS)
    places = np.atleast_1d(numbers("positions", [] if positions is None else positions))
    if places.ndim != 1 or not np.isfinite(places).all():
        raise InputError(f"positions must be finite numbers, x of the first axle [m], got {positions!r}")
    found: list[Prediction | None] = []
    try:
        for place in places:
            on = [
                axle_forces(
                    assembly, place - behind, force, level=level, spread_deg=spread_deg, contact=contact, strips=strips
                )
                for behind, force in train
            ]
            live, arms = (np.sum(parts, axis=0) for parts in ([a.wrench for a in on], [a.arms for a in on]))
            case = replace(loads, live=live, live_arms=arms, name=f"axles with the first at x = {place:.4g} m")
            # axles that load no block, beside the bridge, have no multiplier
            answer = whole_limit_analysis(assembly, case, **options) if np.any(live) else None
            if answer is not None and np.isnan(answer.collapse_multiplier):
                raise NotConverged(f"{case.name}: {answer.status}")
            found.append(answer)
    except KeyboardInterrupt:
        if all(p is None for p in found):  # nothing to hand back yet
            raise
        ends_early()
    values = np.full(len(places), np.nan)
    values[: len(found)] = [np.inf if p is None else p.collapse_multiplier for p in found]
    if not np.isfinite(values).any():
        raise InputError("axles: at no position do they load the structure to a limit")
    least = np.nanmin(values)
    k = int(np.argmax(values <= least + SAME * abs(least)))  # the first of the smallest
    worst = found[k]
    assert worst is not None
    status = Status.SOLVED if len(found) == len(places) else Status.INTERRUPTED
    return AxleEnvelope(
        positions=places, multipliers=values, governing=float(places[k]), prediction=worst, status=status,
    )
