"""Capacity curves of measured walls whose joints and units lose their strength, and what gave way on the way."""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np

from limitmason.capacity.analysis import pushover
from limitmason.capacity.kinematics import motion_between
from limitmason.capacity.result import PushoverCurve
from limitmason.capacity.steps import Steps
from limitmason.comparison.wall_modes import mode_inside, motions
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.experiments.modern_walls import BEAM, units_per_course
from limitmason.experiments.record import Experiment

POINTS = 3, 2
"""Contact points of Lobatto's rule along a joint, and across it where a wall is followed in space."""

TRIES = 100
"""Of a step, after which a curve ends where it is."""

LEFT_OVER = 0.05
"""Energy that a step may leave over, of its gross work: with a fifth of it the peak is the same, in twice the time."""

FURTHEST = 0.004
"""Drift to which walls are pushed [-]."""

UNITS = 100
"""Most units of a wall that is followed as it is built: of others, larger units of the same shape stand for them."""

BROKEN = 0.5  # damage from which on a point has given way


class WallCurve(NamedTuple):
    """Capacity curve of a wall: drift [%], force [kN], what gave way up to every sample, and how the path ended.

    ``slid`` and ``slips``, the largest slip of a bed joint and that of all, ``apart`` and ``past``, vertical planes
    that moved apart and past each other, are those of :func:`limitmason.comparison.wall_modes.motions` since the dead
    load, over the motion of the top. ``cracked`` is the share of the cracks across units that have given way.
    ``inside`` is the mode by what gave way up to the end. ``coarse`` is the number of units along a course, and up,
    that one block stands for, ``points`` the number of contact points. ``status`` says how the path ended, or why there
    is none.
    """

    wall: str
    drift: list[float]
    force: list[float]
    slid: list[float]
    slips: list[float]
    apart: list[float]
    past: list[float]
    cracked: list[float]
    inside: str
    coarse: int
    points: int
    steps: int
    iterations: int
    status: str
    warnings: list[str]
    seconds: float

    @property
    def peak(self) -> float:
        """Largest force [kN]."""
        return max(self.force)


def wall_curve(test: Experiment, *, to: float = FURTHEST, tries: int = TRIES) -> WallCurve:
    """Push a wall by its beam, and say what gave way.

    Parameters
    ----------
    to : drift [-]
    tries : of a step, after which the curve ends where it is

    Notes
    -----
    Walls of more than ``UNITS`` units are followed with larger ones, which lose their strength more suddenly: the
    energy is one of area. Largest force and drift are those of one monotonic push. Cycles take more, and crushing does
    not go on to spall.
    """
    begun = time.process_time()
    if test.options["coarse"] == 1:
        test = test.with_options(coarse=coarseness(test))
    try:
        curve = pushed(test, to, tries)
    except (InputError, NotApplicable, NotConverged) as refusal:
        return WallCurve(test.specimen, [], [], [], [], [], [], [], "", 0, 0, 0, 0, str(refusal), [], 0.0)
    return described(test, curve, time.process_time() - begun)


def coarseness(test: Experiment) -> int:
    """The least number of units, along a course and up, that one block stands for so that ``UNITS`` are left."""
    units = units_per_course(test.row)[0] * int(test.row["courses"])
    return math.ceil(math.sqrt(units / UNITS))


def pushed(test: Experiment, to: float, tries: int) -> PushoverCurve:
    """The path."""
    return pushover(
        test.assembly(), test.loads(), control=(BEAM, "x"), to=to * float(test.row["H"]), contact_model="lobatto",
        grid=POINTS, steps=Steps(most=tries, energy=LEFT_OVER),
    )


def described(test: Experiment, curve: PushoverCurve, seconds: float) -> WallCurve:
    """A path as what is kept of it."""
    assert curve.generations is not None
    wall, first = curve.structure.assembly, curve.nodes[0].pose
    crack = np.array([i.kind == "crack" for i in wall.interfaces] + [False])  # the last is of points without a joint
    moved, broken = [], []
    for node in curve.nodes:
        sideways, apart, past = motions(wall, motion_between(first, node.pose)[:, :6])
        moved.append((sideways.max(), sideways.sum(), apart, past))
        own = crack[curve.generations.structures[node.generation].points.interface]
        damage = np.broadcast_to(np.asarray(node.history.damage), own.shape)
        broken.append(float(np.mean(damage[own] >= BROKEN)) if own.any() else 0.0)
    parts: list[list[float]] = np.array(moved).T.tolist()
    drift = 100.0 * np.asarray(curve.displacement) / float(test.row["H"])
    return WallCurve(
        test.specimen, drift.tolist(), np.asarray(curve.multiplier).tolist(), parts[0], parts[1], parts[2], parts[3],
        broken, mode_inside(wall, motion_between(first, curve.nodes[-1].pose)[:, :6]), int(test.options["coarse"]),
        curve.structure.points.count, curve.cost.steps, curve.cost.iterations, str(curve.status),
        list(curve.warnings), seconds,
    )
