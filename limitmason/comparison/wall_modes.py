"""Failure mode of a measured wall by how its blocks moved, and the force at which it rocks in one piece."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.experiments.experiment import Experiment
from limitmason.experiments.modern_walls import BEAM, axial_force, shear_span, value
from limitmason.model.assembly import Assembly


def rocking_force(test: Experiment) -> float:
    """Force at which the wall rocks in one piece [kN], N L / (2 H0) (1 - s0 / fc): nothing but its edges gives way.

    N is the axial force, L the length, H0 the height of zero moment. The mean pressure s0 over the strength fc is the
    share of the length that the stress block at the toe takes.
    """
    row = test.row
    zero_moment = shear_span(test) * float(row["H"])
    without_toe = 1.0 - value(test, "sigma0") / value(test, "fc")
    return 1e-3 * axial_force(test) * 0.5 * float(row["L"]) / zero_moment * without_toe


# shares chosen for these three modes, not derived
_SLIDES = 0.5  # of the motion of the top: a bed that slips by more has most of it
_PASSES = 0.4  # of the motion of the top: vertical planes that pass each other by less leave more to rocking
_APART = 0.3  # of that slip: where planes also move apart by as much, a crack is diagonal


def mode_inside(assembly: Assembly, twists: ArrayLike) -> str:
    """Mode by the motion of the blocks, of a wall whose inside gave way.

    SL where one bed joint has most of the motion of the top; G where columns slide past each other along their vertical
    planes without moving apart; S for the rest.

    Parameters
    ----------
    assembly : the wall, with its beam
    twists : shift of the centroids and rotation of every block, up to a common factor, shape (n, 6)
    """
    moved = joint_motions(assembly, twists)
    return mode_of_shares(moved.bed_slips.max(), moved.apart, moved.past)


class JointMotions(NamedTuple):
    """Motion of a wall's joints over the horizontal motion of its top [-]."""

    bed_slips: np.ndarray  # slip of every bed joint, averaged over the length of the wall, shape (beds,)
    apart: float  # horizontal opening of the vertical planes, averaged over the height of the wall, then summed
    past: float  # vertical slip along them, likewise


def mode_of_shares(slid: float, apart: float, past: float) -> str:
    """Mode "SL", "G" or "S" of a wall, see :func:`mode_inside`, from three motions over that of the top [-].

    Parameters
    ----------
    slid : largest slip of a bed joint
    apart, past : motion of vertical planes away from each other and along each other
    """
    if slid > _SLIDES:
        return "SL"
    return "G" if past > _PASSES and apart < _APART * past else "S"


def joint_motions(assembly: Assembly, twists: ArrayLike) -> JointMotions:
    """How bed joints slip, and vertical planes (head joints, cracks) move apart and past each other.

    A joint's motion is that of its two blocks against each other at its centre, over the motion of the beam's
    underside. In a bed of several joints it is weighed by their lengths over that of the wall, in vertical planes by
    their heights over that of the wall.

    Parameters
    ----------
    assembly : the wall, with its beam; x along it, z up
    twists : shift of the centroids and rotation of every block, up to a common factor, shape (n, 6)
    """
    moved, centroids = np.asarray(twists, dtype=float), assembly.centroids
    beam = assembly.block_index(BEAM)
    height = float(assembly.blocks[beam].bounds[0, 2])
    length = float(np.ptp(assembly.blocks[beam].vertices[:, 0]))

    def velocity(block: int, place: np.ndarray) -> np.ndarray:
        """Motion of the point of a block at a place [m], shape (3,)."""
        return moved[block, :3] + np.cross(moved[block, 3:], place - centroids[block])

    # horizontal motion of the beam's underside; a top at rest gives zeros: motions are divided by infinity
    top = abs(velocity(beam, np.array([centroids[beam, 0], centroids[beam, 1], height]))[0]) or np.inf
    slip_at_level: dict[float, float] = {}
    apart = past = 0.0
    for joint in assembly.interfaces:
        centre = joint.polygon.mean(axis=0)
        relative = np.abs(velocity(joint.block_b, centre) - velocity(joint.block_a, centre)) / top
        along, _, up = relative
        wide, high = np.ptp(joint.polygon[:, 0]) / length, np.ptp(joint.polygon[:, 2]) / height
        if joint.kind in ("head", "crack"):
            apart, past = apart + along * high, past + up * high
        else:
            level = round(float(centre[2]), 4)  # joints within 0.1 mm of height are one bed
            slip_at_level[level] = slip_at_level.get(level, 0.0) + float(along * wide)
    return JointMotions(np.array(list(slip_at_level.values())), float(apart), float(past))
