"""Tilting tests: turn the weight slowly until the wall falls and read the multiplier at the support."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dem.collapse import Grid, collapse
from dem.history import History
from dem.joints import JointOptions
from dem.loading import Settle, Tilt
from dem.simulate import simulate
from dem.stepping import Damping, Scale
from limitmason.model import Assembly, Loads
from limitmason.results import CANNOT_STAND, NOT_CONVERGED, SOLVED, Prediction

Array = NDArray[np.float64]

_WINDOW = 5  # samples of the running median: a single sample may ride on a vibration
_WITHIN = 1e-3  # the peak counts as reached where the ratio comes this near to it [-]


DID_NOT_FALL = "did not fall"


@dataclass(frozen=True, eq=False)
class TiltTest:
    """A tilting test.

    Parameters
    ----------
    status : "solved", "not converged" (the rate still matters), "did not fall" (up to the last angle) or
        "cannot stand under dead load"
    collapse_multiplier : lambda = max(Rh / Rv) of the slowest run [-]; that of the last angle where it did not fall
    tilt_deg : angle of the table at the samples [deg], shape (samples,)
    steps : time steps since the table began to turn, shape (samples,)
    vertical, horizontal : Rv / Rv0 and Rh / Rv0, the reaction normal to the table and along it (positive where it holds
        the wall back) over the weight Rv0 of all blocks that are free [-], shape (samples,)
    ratio : Rh / Rv [-], shape (samples,)
    weight : Rv0 [N]
    collapse : sample at which ``ratio`` first comes within 0.1 % of its maximum
    runs : every run as (angle per 1000 steps [deg], multiplier), fastest first
    direction : down the tilted table, seen from it, shape (3,)
    history : of the slowest run
    increments : the answer of :func:`dem.collapse` with loads held one after the other, where asked for
    warnings : what a reader must know
    """

    status: str
    collapse_multiplier: float
    tilt_deg: Array
    steps: Array
    vertical: Array
    horizontal: Array
    ratio: Array
    weight: float
    collapse: int
    runs: tuple[tuple[float, float], ...]
    direction: tuple[float, float, float]
    history: History
    increments: Prediction | None = None
    warnings: tuple[str, ...] = ()

    @property
    def collapse_angle_deg(self) -> float:
        """Angle whose tangent is the multiplier [deg]: what a slow test on a table reads."""
        return float(np.rad2deg(np.arctan(self.collapse_multiplier)))

    @property
    def rate_change(self) -> float:
        """Change of the multiplier from the last run but one to the last [-]; NaN after a single run."""
        return self.runs[-1][1] / self.runs[-2][1] - 1.0 if len(self.runs) > 1 else float("nan")

    @property
    def at_rest(self) -> float:
        """Multiplier extrapolated to a table that turns infinitely slowly [-]: the lag is linear in the rate."""
        if len(self.runs) < 2 or self.status == DID_NOT_FALL:
            return float("nan")
        (fast, high), (slow, low) = self.runs[-2:]
        return low - (high - low) * slow / (fast - slow)

    def __str__(self) -> str:
        """Multiplier, angle, rate check and, where it was asked for, the comparison with held loads."""
        if self.status == DID_NOT_FALL:
            text = f"tilting test: {self.status}, lambda above {self.collapse_multiplier:.4f}"
            return "\n".join([text, *(f"  {w}" for w in self.warnings)])
        lines = [
            f"tilting test: {self.status}, lambda = max(Rh / Rv) = {self.collapse_multiplier:.4f}, "
            f"angle {self.collapse_angle_deg:.2f} deg",
            f"  rate {self.runs[-1][0]:.3g} deg per 1000 steps; the last slowing changed lambda by "
            f"{self.rate_change:+.2%}; extrapolated to rate 0: {self.at_rest:.4f}",
        ]
        if self.increments is not None:
            other = self.increments.collapse_multiplier
            lines.append(
                f"  loads held one after the other: {other:.4f} ({self.increments.status}), tilt / held "
                f"{self.collapse_multiplier / other:.3f}"
            )
        return "\n".join(lines + [f"  {w}" for w in self.warnings])


def tilt_test(
    assembly: Assembly,
    direction: ArrayLike = (1.0, 0.0, 0.0),
    *,
    to_deg: float = 45.0,
    steps: int = 20_000,
    tolerance: float = 0.01,
    halvings: int = 5,
    moved_limit: float = 0.3,
    contact_points: Grid | dict[str, Grid] = (4, 8),
    contact_model: str = "grid",
    joint_options: JointOptions | None = None,
    damping: Damping | None = None,
    sample: int | None = None,
    increments: bool = False,
) -> TiltTest:
    """Tilt a wall on its table until it falls, as in a laboratory, and again at half speed until it no longer matters.

    The weight of every block turns as W (-cos(alpha) z + sin(alpha) d) while alpha grows steadily; the multiplier is
    lambda = max(Rh / Rv) of the reactions, and tan(alpha) at collapse where the table turns slowly enough.

    Parameters
    ----------
    direction : horizontal vector d towards which the wall leans, shape (3,)
    to_deg : angle at which the table stops [deg]
    steps : time steps of the first run from 0 to ``to_deg``; the second reaches the angle of collapse in as many (or
        turns at half the rate of the first), every further one turns half as fast
    tolerance : change of lambda from one rate to half of it that is accepted [-]; the error left is about as large
    halvings : most times the rate is halved; then the status is "not converged"
    moved_limit : displacement at which the run ends, over the smallest block dimension [-]
    contact_points, contact_model, joint_options : see :func:`dem.collapse`
    damping : while the table turns; local 0.5
    sample : steps between samples; ``steps`` / 200 by default
    increments : also find the multiplier with loads held one after the other (:func:`dem.collapse`)

    Returns
    -------
    TiltTest

    Raises
    ------
    ValueError
        When the direction is zero or not horizontal, ``to_deg`` is not between 0 and 90 or nothing is held.

    Notes
    -----
    Only the blocks' own weight turns. With cohesion or tensile strength the angle is right for a tilting table but its
    tangent is not the multiplier of horizontal forces on an upright wall, so ``increments`` then differs. First
    contacts are kept: the path is right up to collapse and a little after. Source: Godio, Stefanou, Sab 2017, section
    3.1, eqs 5 to 7 and Figs 5, 6.
    """
    loads = Loads.horizontal(assembly, direction)
    d = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    if not 0.0 < to_deg < 90.0:
        raise ValueError(f"to_deg must lie between 0 and 90 degrees, got {to_deg!r}")
    if not tolerance > 0.0 or steps < 1 or halvings < 1:
        raise ValueError("tolerance, steps and halvings must be positive: the rate check needs at least one halving")
    if not assembly.held.any():
        raise ValueError("nothing is held: a tilting test reads the reactions of the held blocks (the table)")
    axis = tuple(np.cross((0.0, 0.0, 1.0), d).tolist())
    scale = Scale.of(assembly, loads.dead)
    weight = float(assembly.weights[~assembly.fixed].sum())
    options = {
        "contact_points": contact_points, "contact_model": contact_model, "joint_options": joint_options,
    }  # fmt: skip
    every = sample or max(steps // 200, 20)
    settled = simulate(assembly, Settle(tolerance=1e-6), sample=every, **options)
    if settled.status != "finished":
        fell = float(np.abs(settled.shift[-1]).max()) > moved_limit * scale.smallest
        found = _read(settled, float("nan"), d, weight)
        return TiltTest(
            CANNOT_STAND if fell else NOT_CONVERGED, float("nan"), *found, runs=((0.0, float("nan")),),
            direction=tuple(d.tolist()), history=settled, warnings=("it did not settle on the level table",),
        )  # fmt: skip
    held = collapse(assembly, loads, error_budget=(), **options) if increments else None
    runs: list[tuple[float, float]] = []
    stood: list[bool] = []
    status, notes, rate = NOT_CONVERGED, list(settled.warnings), to_deg / steps
    for k in range(halvings + 1):
        stage = Tilt(
            to_deg=to_deg, steps=int(to_deg / rate), axis=axis, damping=damping,
            stop_when_moved=moved_limit * scale.smallest,
        )  # fmt: skip
        history = simulate(assembly, stage, start=settled, sample=every)
        begun = float(settled["step"][-1])
        found = _read(history, begun, d, weight)
        peak = _peak(found[4])
        runs.append((1000.0 * rate, peak))
        # at the end of the tilt the wall still follows the table, in a run and in one at half its rate
        stood.append(history["step"][-1] - begun >= stage.steps and peak > 0.98 * np.tan(np.deg2rad(to_deg)))
        if all(stood[-2:]) and k:
            status = DID_NOT_FALL
            notes.append(f"it did not fall up to {to_deg:g} degrees: give a larger to_deg")
            break
        if k and abs(runs[-1][1] / runs[-2][1] - 1.0) < tolerance:
            status = SOLVED
            break
        # the first run only finds the scale
        rate = 0.5 * rate if k else min(0.5 * rate, float(np.rad2deg(np.arctan(peak))) / steps)
    if status == NOT_CONVERGED:
        notes.append(
            f"lambda still changes by {100 * (runs[-1][1] / runs[-2][1] - 1):+.1f} % at half speed: give more steps"
        )
    tilt, count, vertical, horizontal, ratio, rv0, at = found
    return TiltTest(
        status, runs[-1][1], tilt, count, vertical, horizontal, ratio, rv0, at, tuple(runs), tuple(d.tolist()), history,
        held, tuple(notes),
    )  # fmt: skip


def _read(
    history: History, begun: float, d: Array, weight: float
) -> tuple[Array, Array, Array, Array, Array, float, int]:
    """Angle, steps, Rv / Rv0, Rh / Rv0, Rh / Rv, Rv0 and the sample at collapse."""
    total = history.reaction[:, :, :3].sum(axis=1)
    vertical, horizontal = total[:, 2] / weight, -(total @ d) / weight
    # a wall that leaves the table has no ratio
    ratio = np.divide(horizontal, vertical, out=np.full_like(vertical, np.nan), where=vertical > 1e-3)
    near = np.flatnonzero(ratio >= (1.0 - _WITHIN) * _peak(ratio))
    return (
        np.rad2deg(history["tilt"]), history["step"] - begun, vertical, horizontal, ratio, weight,
        int(near[0]) if len(near) else len(ratio) - 1,
    )  # fmt: skip


def _peak(ratio: Array) -> float:
    """Largest running median of Rh / Rv."""
    known = ratio[np.isfinite(ratio)]
    if len(known) < _WINDOW:
        return float(known.max(initial=0.0))
    return float(np.median(np.lib.stride_tricks.sliding_window_view(known, _WINDOW), axis=1).max())
