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

    Free couples turn along. A force whose moment is not told by its arms acts at the point of its line nearest the
    centroid.

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
    # the moment that the arms do not tell: of a force at the nearest point of its line, and a free couple
    force, untold = wrench[:, :3], wrench[:, 3:] - axial(arms)
    arm = _arm(force, untold)
    couple = untold - np.cross(arm, force)
    new, arms = force @ rotation.T, arms @ rotation.T
    moment = axial(arms) + np.cross(arm, new) + couple @ rotation.T
    return {case: np.hstack([new, moment]), f"{case}_arms": arms}


def _arm(force: Array, moment: Array) -> Array:
    """Arm from the centroid to the line of action of each force [m], shape (n, 3).

    It is F x M / |F|^2, and zero where there is no force. What the moment [N m] has along the force no arm explains.
    """
    square = (force**2).sum(axis=1, keepdims=True)
    return np.divide(np.cross(force, moment), square, out=np.zeros_like(force), where=square > 0)


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
    stay; their points of application move with the size. A moment that the arms do not explain is that of the whole
    force of its block, at the arm F x M / |F|^2. What no arm explains is a couple, and stays.

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
        # all but body forces
        force, moment = rest[:, :3], rest[:, 3:]
        # arms grow with the size of the block, and with them the moments
        further = np.asarray(factors) - 1.0
        # growth [m] of the arm of the force, by the moment that ``arms`` does not explain; 0 of a pure couple
        more = _arm(force, moment - axial(arms)) * further
        rest = np.hstack([force, moment + axial(further[:, None] * arms) + np.cross(more, force)])
        out[f"{case}_arms"] = arms * np.asarray(factors)[:, None]
        rest[:, :3] += new.weights[:, None] * per_weight
        out[case] = rest
    return replace(loads, **out)
