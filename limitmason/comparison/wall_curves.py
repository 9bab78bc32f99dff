"""Curves of measured walls whose joints and units lose their strength, by the path or the DEM, and what gave way."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from limitmason.capacity.analysis import whole_pushover
from limitmason.capacity.kinematics import motion_between
from limitmason.capacity.outcomes import PathEnd
from limitmason.capacity.result import PushoverCurve
from limitmason.capacity.step_length import Steps
from limitmason.checks import choice, instance, positive
from limitmason.comparison.wall_modes import joint_motions, mode_of_shares
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.experiments.experiment import Experiment
from limitmason.experiments.modern_walls import BEAM, NAME, THIN, units_per_course
from limitmason.geometry.rotation import rotation_vectors
from limitmason.methods import DEM, get_method
from limitmason.model.assembly import Assembly

POINTS = 3, 2
"""Contact points of Lobatto's rule along a joint, and across it where a wall is followed in space."""

TRIES = 400
"""Tries of a step of the path, after which a curve ends where it is: with 100 wall 110 ended at 0.76 of its peak."""

LEFT_OVER = 0.05
"""Energy that a step may leave over, of its gross work: with a fifth of it the peak is the same, in twice the time."""

FURTHEST = 0.004
"""Drift to which walls are pushed [-]."""

UNITS = 100
"""Most units of a wall that is followed as it is built: of others, larger units of the same shape stand for them."""

BROKEN = 0.5  # damage, from 0 to 1, from which on a point has given way; chosen: half of its strength is gone
FALLEN = 0.9  # share of the largest force to which it has fallen just after the peak; chosen
ELASTIC = 0.1  # share of the largest force at which the elastic motion is read; chosen small: little has slipped
INNER = 0.5  # of the motion of the top: a wall whose inside has less of it rocks; chosen, not fitted
SAMPLES = 100  # of a push by the DEM


@dataclass(frozen=True, kw_only=True)
class WallCurve:
    """Capacity curve of a wall: drift, force, what gave way up to every sample, and how the path ended.

    Lists have one entry per sample. Motions are those of :func:`limitmason.comparison.wall_modes.joint_motions` since
    the dead load, over the motion of the top. What is not known of a method is 0.

    Parameters
    ----------
    wall : its number
    drift : displacement of the top over the height [%]
    force : at the beam [kN]
    slid, slips : largest slip of a bed joint, and the sum of all [-]
    apart, past : vertical planes moved apart, and past each other [-]
    cracked : share of the points of cracks across units that have given way [-]; of the DEM, of their area that
        reached its strength
    coarse : number of units along a course, and up, that one block stands for
    points : number of contact points
    steps, iterations : what the path took
    status : how the path ended, or why there is none
    warnings : of the method
    seconds : processor time
    rate : difference of the DEM's largest forces at two speeds, over that at the slower one [-]
    """

    wall: str
    drift: list[float] = field(default_factory=list)
    force: list[float] = field(default_factory=list)
    slid: list[float] = field(default_factory=list)
    slips: list[float] = field(default_factory=list)
    apart: list[float] = field(default_factory=list)
    past: list[float] = field(default_factory=list)
    cracked: list[float] = field(default_factory=list)
    coarse: int = 0
    points: int = 0
    steps: int = 0
    iterations: int = 0
    status: str = ""
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0
    rate: float = math.nan

    @property
    def peak(self) -> float:
        """Largest force [kN], NaN of a wall without a curve."""
        return max(self.force, default=math.nan)

    @property
    def cut_short(self) -> str:
        """That the curve stopped before its force had fallen to 0.9 of the largest, in words; "" where it did not."""
        if self.status != PathEnd.STOPPED or min(self.force[int(np.argmax(self.force)) :]) <= FALLEN * self.peak:
            return ""
        return f"its curve stopped at a drift of {self.drift[-1]:.2g} %, before the force fell: the largest so far"

    @property
    def mode(self) -> str:
        """F, S, SL or G by the inelastic motion just after the peak, see :meth:`inelastic`.

        F where bed joints that slip and vertical planes that move apart have less than half of the motion of the top.
        Else the largest of them names it, as in :func:`limitmason.comparison.wall_modes.mode_of_shares`. A wall without
        a curve, or whose curve ends where the elastic motion is read, has none, "".
        """
        if not self.force or self.just_after == self.elastic:
            return ""
        slips, slid, apart, past = self.inelastic(self.just_after)
        return "F" if slips + apart < INNER else mode_of_shares(slid, apart, past)

    @property
    def just_after(self) -> int:
        """First sample after the peak at which the force has fallen to 0.9 of it; the last where it never does."""
        force = np.array(self.force)
        top = int(force.argmax())
        below = np.flatnonzero(force[top:] <= FALLEN * force[top])
        return top + int(below[0]) if len(below) else len(force) - 1

    @property
    def elastic(self) -> int:
        """First sample with a tenth of the largest force, at which the elastic motion is read."""
        force = np.array(self.force)
        return int(np.argmax(force >= ELASTIC * force.max()))

    def inelastic(self, sample: int) -> list[float]:
        """Inelastic slips, slid, apart and past at a sample over motion of the top [-].

        Elastic is what goes with the force, at the ratio of the sample :attr:`elastic`.

        Parameters
        ----------
        sample : its number
        """
        force, top, first = np.array(self.force), np.array(self.drift), self.elastic

        def since(motion: np.ndarray) -> float:
            """A motion at the sample, less that which the elastic wall would have under the force of the sample."""
            return float(motion[sample] - motion[first] * force[sample] / force[first])

        return [since(np.array(v) * top) / since(top) for v in (self.slips, self.slid, self.apart, self.past)]


def wall_curve(test: Experiment, *, to: float = FURTHEST, tries: int = TRIES, by: str = "pushover") -> WallCurve:
    """Push a wall by its beam, and say what gave way.

    Parameters
    ----------
    test : a wall of ``modern-walls``
    to : drift at which the push ends [-]
    tries : of a step of the path, after which the curve ends where it is
    by : "pushover", the equilibrium path, or "dem", the distinct element method at two speeds

    Notes
    -----
    Walls of more than ``UNITS`` units are followed with larger ones, which lose their strength more suddenly: the
    energy is one of area. Largest force and drift are those of one monotonic push. Cycles take more, and crushing does
    not go on to spall. The DEM pushes cantilevers and walls whose two ends are held; others are refused by name.
    """
    choice("by", by, ("pushover", DEM))
    choice("test: its source", instance("test", test, Experiment).source.name, (NAME,))
    positive("to", to)
    begun = time.process_time()
    if test.options["coarse"] == 1:  # its default: who asks for another coarseness keeps it
        test = test.with_options(coarse=coarseness(test))
    try:
        found = curve_by_dem(test, to) if by == DEM else curve_of_path(test, equilibrium_path(test, to, tries))
    except (InputError, NotApplicable, NotConverged) as refusal:
        return WallCurve(wall=test.specimen, status=str(refusal))
    return replace(found, seconds=time.process_time() - begun)


def coarseness(test: Experiment) -> int:
    """The least number of units, along a course and up, that one block stands for so that ``UNITS`` are left."""
    units = units_per_course(test.row)[0] * int(test.row["courses"])
    return math.ceil(math.sqrt(units / UNITS))


def equilibrium_path(test: Experiment, to: float, tries: int) -> PushoverCurve:
    """Path of equilibrium of a wall that its beam pushes to a drift.

    Parameters
    ----------
    test : the wall
    to : drift at which the path ends [-]
    tries : most tries of a step
    """
    return whole_pushover(
        test.assembly(), test.loads(), control=(BEAM, "x"), to=to * float(test.row["H"]), contact_model="lobatto",
        grid=POINTS, steps=Steps(most=tries, energy=LEFT_OVER),
    )


def curve_of_path(test: Experiment, curve: PushoverCurve) -> WallCurve:
    """Curve of a wall from its path of equilibrium.

    The live load of a wall is 1 kN at its beam, so that the multiplier is the force [kN].

    Parameters
    ----------
    test : the wall
    curve : its path from the dead load on
    """
    assert curve.generations is not None
    wall, first = curve.structure.assembly, curve.nodes[0].pose
    # by number of the interface; points made by contacts of the path belong to none, -1, which reads the last entry
    is_crack = np.array([i.kind == "crack" for i in wall.interfaces] + [False])
    cracked = []
    for node in curve.nodes:
        # a path may find new contact points on its way: those of a state are the points of its generation
        own = is_crack[curve.generations.structures[node.generation].points.interface]
        damage = np.broadcast_to(np.asarray(node.history.damage), own.shape)
        cracked.append(float(np.mean(damage[own] >= BROKEN)) if own.any() else 0.0)
    drift = 100.0 * np.asarray(curve.displacement) / float(test.row["H"])
    return WallCurve(
        wall=test.specimen, drift=drift.tolist(), force=np.asarray(curve.multiplier).tolist(),
        **shares(wall, [motion_between(first, node.pose)[:, :6] for node in curve.nodes]), cracked=cracked,
        coarse=int(test.options["coarse"]), points=curve.structure.points.count, steps=curve.cost.steps,
        iterations=curve.cost.iterations, status=str(curve.status), warnings=list(curve.warnings),
    )


def curve_by_dem(test: Experiment, to: float) -> WallCurve:
    """Curve of a wall pushed by the DEM, at rest under its dead load before.

    Parameters
    ----------
    test : the wall
    to : drift at which it ends, displacement over height [-]

    Raises
    ------
    InputError
        For a wall that is neither a cantilever nor held at both ends.
    """
    drive = get_method(DEM).drive
    assert drive is not None
    # the drive acts at the beam's centroid: of a thin beam that is the top of the wall
    test = test.with_options(beam_height=THIN)
    wall, height = test.assembly(), float(test.row["H"])
    curve: Any = drive(wall, test.drive(), to=to * height, loads=test.loads(), samples=SAMPLES)
    # motions count from the state at rest
    states = [(shift, rotation_vectors(turn)) for shift, turn in map(curve.moved, range(len(curve.load)))]
    rest_shift, rest_turn = states[0]
    moved = [np.hstack([shift - rest_shift, turn - rest_turn]) for shift, turn in states]
    is_crack = [i.kind == "crack" for i in wall.interfaces]
    # a crack without points in contact has no share that failed, NaN: it counts as none
    cracked = [float(np.mean(np.nan_to_num(v[is_crack]))) if any(is_crack) else 0.0 for v in curve.failed]
    drift = 100.0 * np.asarray(curve.displacement) / height
    # 99 % of the drift asked for, both in per cent: the last sample may lie a hundredth, one sample, before the end
    ended = "reached" if drift[-1] > 99.0 * to else "stopped"
    return WallCurve(
        wall=test.specimen, drift=drift.tolist(), force=(1e-3 * np.asarray(curve.load)).tolist(),
        **shares(wall, moved), cracked=cracked, coarse=int(test.options["coarse"]), steps=curve.steps, status=ended,
        warnings=list(curve.warnings), rate=float(curve.rate_error),
    )


def shares(wall: Assembly, moved: Sequence[np.ndarray]) -> dict[str, Any]:
    """Motions of joints at every sample, as fields of :class:`WallCurve` by name.

    They are slid, slips, apart and past, by the motions of the blocks since the dead load.

    Parameters
    ----------
    wall : its blocks and joints
    moved : shift of the centroids [m] and rotation vector of every block, one array of shape (n, 6) per sample
    """
    found = []
    for motion in moved:
        joints = joint_motions(wall, motion)
        found.append((joints.bed_slips.max(), joints.bed_slips.sum(), joints.apart, joints.past))
    return dict(zip(("slid", "slips", "apart", "past"), np.array(found).T.tolist(), strict=True))
