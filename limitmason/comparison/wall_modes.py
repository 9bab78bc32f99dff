"""Failure mode of a measured wall by how its blocks moved, and the force at which it rocks in one piece."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from limitmason.experiments.modern_walls import BEAM, axial_force, shear_span, value
from limitmason.experiments.record import Experiment
from limitmason.model.assembly import Assembly


def rocking_force(test: Experiment) -> float:
    """Force at which the wall rocks in one piece [kN], N L / (2 H0) (1 - s0 / fc): nothing but its edges gives way."""
    row = test.row
    arm = shear_span(test) * float(row["H"])
    block = 1.0 - value(test, "sigma0") / value(test, "fc")
    return 1e-3 * axial_force(test) * 0.5 * float(row["L"]) / arm * block


def mode_inside(assembly: Assembly, twists: ArrayLike) -> str:
    """Mode by the motion of the blocks, of a wall whose inside gave way.

    SL where one bed joint has most of the motion of the top; G where columns slide past each other along their vertical
    planes without moving apart; S for the rest.
    """
    sideways, apart, past = motions(assembly, twists)
    return mode_of_shares(sideways.max(), apart, past)


def mode_of_shares(slid: float, apart: float, past: float) -> str:
    """Mode "SL", "G" or "S" of a wall, see :func:`mode_inside`, from three motions over that of the top [-].

    Parameters
    ----------
    slid : largest slip of a bed joint
    apart, past : motion of vertical planes away from each other and along each other
    """
    if slid > 0.5:
        return "SL"
    return "G" if past > 0.4 and apart < 0.3 * past else "S"


def motions(assembly: Assembly, twists: ArrayLike) -> tuple[np.ndarray, float, float]:
    """Slip of every bed joint over its length, and how far vertical planes move apart and past each other.

    All over the motion of the top; vertical planes are head joints and cracks, summed over the wall and weighed by
    their height over that of the wall.

    Parameters
    ----------
    twists : shift of the centroids and rotation of every block, up to a common factor, shape (n, 6)
    """
    moved, at = np.asarray(twists, dtype=float), assembly.centroids
    beam = assembly.block_index(BEAM)
    height = float(assembly.blocks[beam].bounds[0, 2])
    length = float(np.ptp(assembly.blocks[beam].vertices[:, 0]))

    def velocity(block: int, place: np.ndarray) -> np.ndarray:
        return moved[block, :3] + np.cross(moved[block, 3:], place - at[block])

    top = abs(velocity(beam, np.array([at[beam, 0], at[beam, 1], height]))[0]) or np.inf
    beds: dict[float, float] = {}
    apart = past = 0.0
    for i in assembly.interfaces:
        place = i.polygon.mean(axis=0)
        jump = np.abs(velocity(i.block_b, place) - velocity(i.block_a, place)) / top
        wide, high = np.ptp(i.polygon[:, 0]) / length, np.ptp(i.polygon[:, 2]) / height
        if i.kind in ("head", "crack"):
            apart, past = apart + jump[0] * high, past + jump[2] * high
        else:
            level = round(float(place[2]), 4)
            beds[level] = beds.get(level, 0.0) + float(jump[0] * wide)
    return np.array(list(beds.values())), float(apart), float(past)
