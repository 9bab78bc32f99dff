"""Loads on blocks as causes read them: what is weight, what is overload, what all blocks share, and loads turned."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.geometry.rotation import axial
from limitmason.model import Assembly, Loads

Direction = tuple[float, float, float]


def turned(loads: Loads, case: str, rotation: Array) -> dict[str, Any]:
    """Dead or live loads whose forces turn about their points of application.

    Couples turn along: that is what a moment is that the arms do not tell, as ``Loads`` says.

    Parameters
    ----------
    case : "dead" or "live"
    rotation : rotation matrix, shape (3, 3)

    Returns
    -------
    Mapping
        Fields of ``Loads`` by name: wrenches [N, N m], shape (n, 6), and arms, the sum of r f^T [N m], (n, 3, 3)
    """
    # arms: sum of r f^T over the forces of each block, r from its centroid [N m], shape (n, 3, 3); axial(arms) is r x f
    wrench, arms = getattr(loads, case), getattr(loads, f"{case}_arms")
    couple = wrench[:, 3:] - axial(arms)
    arms = arms @ rotation.T
    return {
        case: np.hstack([wrench[:, :3] @ rotation.T, axial(arms) + couple @ rotation.T]), f"{case}_arms": arms,
    }


def self_weight(assembly: Assembly) -> Array:
    """Wrench of the weight of every block about its centroid [N, N m], shape (n, 6)."""
    out = np.zeros((assembly.n_blocks, 6))
    out[:, 2] = -assembly.weights
    return out


def shared_acceleration(assembly: Assembly, loads: Loads) -> Array:
    """Live force over weight that most blocks have in common [-], shape (3,).

    It is zero where there is none. Only forces at the centroid count, as body forces act there. Of a single block under
    a force at its centroid nobody can tell whether it is a body force: it is taken as one.
    """
    rows = np.flatnonzero((assembly.weights > 0) & ~assembly.fixed)
    if not len(rows):
        return np.zeros(3)
    ratio = loads.live[rows, :3] / assembly.weights[rows, None]
    # most blocks share it, so that the median is it
    middle = np.median(ratio, axis=0)
    same = np.abs(ratio - middle).max(axis=1) <= 1e-9 * max(1.0, float(np.abs(middle).max()))
    moment = np.abs(loads.live[rows, 3:]).max(axis=1)
    same &= moment <= 1e-9 * np.linalg.norm(loads.live[rows, :3], axis=1) * np.cbrt(assembly.volumes[rows])
    return middle if 2 * same.sum() > len(rows) else np.zeros(3)


def live_direction(loads: Loads) -> Array:
    """Unit vector along the sum of the live forces, shape (3,).

    Raises
    ------
    InputError
        When the live forces add up to nothing.
    """
    total = loads.live[:, :3].sum(axis=0)
    size = float(np.linalg.norm(total))
    if size <= 1e-9 * float(np.abs(loads.live[:, :3]).sum() or 1.0):
        raise InputError("the live forces add up to zero: give the cause a direction")
    return total / size


def overload_of(assembly: Assembly, loads: Loads) -> Array:
    """Dead load beyond self weight [N, N m], shape (n, 6).

    Rounding of the weights themselves does not count.
    """
    return _beyond_rounding(loads.dead - self_weight(assembly), loads.dead)


def _beyond_rounding(rest: Array, of: Array) -> Array:
    """What is left of wrenches after a part was taken off, zero where it is no more than their rounding."""
    return np.where(np.abs(rest) > 1e-12 * max(float(np.abs(of).max(initial=0.0)), 1e-300), rest, 0.0)


def rescaled_loads(old: Assembly, new: Assembly, loads: Loads, factors: ArrayLike = (1.0, 1.0, 1.0)) -> Loads:
    """Loads of an assembly whose blocks changed their weight and size.

    Self weight, and the live load in proportion to it that most blocks share, follow the new weights. All other forces
    stay; their points of application move with the size. A moment that the arms do not explain is a couple, and stays.

    Parameters
    ----------
    old, new : the assembly before and after
    loads : on the old one
    factors : of the size of every block along x, y and z [-], by which arms from its centroid grow
    """
    share = shared_acceleration(old, loads)
    out: dict[str, Any] = {}
    for case, per_weight in (("dead", np.array([0.0, 0.0, -1.0])), ("live", share)):
        # arms: sum of r f^T over the forces of each block [N m], shape (n, 3, 3), as in ``Loads``
        wrench, arms = getattr(loads, case), getattr(loads, f"{case}_arms")
        body = np.zeros_like(wrench)
        body[:, :3] = old.weights[:, None] * per_weight
        rest = _beyond_rounding(wrench - body, wrench)
        # arms grow with the size of the block, and with them the moments
        rest[:, 3:] += axial((np.asarray(factors) - 1.0)[:, None] * arms)
        out[f"{case}_arms"] = arms * np.asarray(factors)[:, None]
        rest[:, :3] += new.weights[:, None] * per_weight
        out[case] = rest
    return replace(loads, **out)
