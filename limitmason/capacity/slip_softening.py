"""Softening by plastic slip of a law whose shear springs are elastic, and points that slid back.

The rate only: damage and strengths at it are in ``point_law``.
"""

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.capacity.point_law import PlasticHistory
from limitmason.mechanics.law import SUDDEN, Softening, softening
from limitmason.model.assembly import Assembly

_NOTICED = 0.01
"""Part of the largest lift from which a lift beyond what the slip asks for counts, and not as rounding [-]: chosen."""


def slid_back(tan_psi: Array, history: PlasticHistory) -> Flags:
    """Which points have slid back, shape (m,).

    They are lifted by more than their distance from the start asks for, tan(psi) |slip|. Lift only grows under this
    flow rule, while the distance shrinks on the way back.

    Parameters
    ----------
    tan_psi : dilatancy of m points [-], shape (m,)
    history : their plastic slip and lift
    """
    away = tan_psi * np.linalg.norm(history.slip, axis=1)
    return history.lift - away > _NOTICED * max(float(np.abs(history.lift).max(initial=0.0)), 1e-300)


def softening_by_plastic_slip(assembly: Assembly, kn: Array, ks: Array) -> Softening | None:
    """Softening of every interface by its plastic slip, or None where none softens.

    A joint that has lost all of its opening's or its slip's energy is at damage 1. The slip is the plastic one:
    1 / rate_slip = 2 GfII / (c - c_r).

    Parameters
    ----------
    kn, ks : stiffness of every interface [Pa/m]
    """
    joints = [i.joint for i in assembly.interfaces]
    if not any(j.softens for j in joints):
        return None
    found = softening(joints, kn, ks)
    lost, slip = assembly.arrays.cohesion - found.rest.cohesion, found.by_slip
    gradual = (slip > 0.0) & (slip < SUDDEN)
    # at damage 1: the slip past the peak, and the elastic slip lost / ks that has unloaded meanwhile
    return found._replace(by_slip=np.where(gradual, 1.0 / (1.0 / np.where(gradual, slip, 1.0) + lost / ks), slip))
