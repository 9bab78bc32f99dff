"""Mode shapes as sensors see them: at which points, along which axes, and what they cannot see."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array, Index
from limitmason.checks import numbers
from limitmason.errors import InputError
from limitmason.vibration.modes import Modes

Shapes = Modes | ArrayLike

# chosen: far above rounding, far below what a sensor measures
_UNSEEN = 1e-6  # of its largest motion at the sensors' points: a mode that moves less along them is not seen

# chosen: a component of a tenth of a shape's length changes the criterion by about a hundredth
_PASSED = 1e-2  # of the squares of a shape: components that read zero are refused where the other's are larger


def check_shapes(name: str, m: Shapes) -> None:
    """Refuse what is neither modes nor a table of numbers, ``name`` in messages: a number, a word, rows of lengths."""
    if isinstance(m, Modes):
        return
    try:
        axes = np.ndim(m)
    except ValueError:
        raise InputError(f"{name}: all shapes must have equally many numbers: say NaN for a missing one") from None
    if axes < 1:
        got = "None" if m is None else type(m).__name__
        raise InputError(f"{name} must be Modes (of lm.modes), a ModalTest or shapes in numbers, got {got}")


def check_sensors(m: Shapes, count: int) -> None:
    """Refuse shapes ``m`` that are not one number for each of ``count`` sensors.

    Their shape is then other than (k, count); the modes of a model can be taken at any sensors.
    """
    shape = (0, count) if isinstance(m, Modes) else np.shape(m)
    if len(shape) != 2 or shape[1] != count:
        turned = "; rows are modes, columns sensors: transpose them" if shape[:1] == (count,) else ""
        raise InputError(
            f"shapes must have one number for each of the {count} sensors, shape (k, {count}), got {shape}{turned}"
        )


def check_zeros(u: Array, v: Array, number: Index, one_each: bool, blanks: tuple[bool, bool] = (True, True)) -> None:
    """Refuse components that are zero in every shape of one measured set, where the other moves.

    A blank that was filled with zero would lower the criterion of modes that are alike.

    Parameters
    ----------
    u, v : shapes of both sets, shape (k, s)
    number : of every column: its sensor, or three times its point plus its axis
    one_each : whether every sensor gives one number
    blanks : of which of both sets zeros may be blanks
    """
    for (which, mine, other), may_be in zip((("first", u, v), ("second", v, u)), blanks, strict=True):
        if not may_be:
            continue
        # largest part of the squares that a component has in any shape of the other set
        share = (np.abs(other) ** 2 / np.maximum((np.abs(other) ** 2).sum(axis=1, keepdims=True), 1e-300)).max(axis=0)
        blank = ~np.abs(mine).any(axis=0) & (share > _PASSED)
        if one_each:
            # a single shape may have a node there
            if len(mine) > 1 and blank.any():
                raise InputError(
                    f"sensor {number[blank][0]} reads zero in every shape of the {which} set, though the other moves "
                    "there: leave the sensor out, or say NaN where it failed"
                )
            continue
        # at points whole axes are filled with zero, where sensors measured one or two components
        for axis, name in enumerate("xyz"):
            mine_there = mine[:, number % 3 == axis]
            if blank[number % 3 == axis].any() and not np.abs(mine_there).any():
                raise InputError(
                    f"the {which} shapes are zero along {name} at every point, and the other set moves there. If that "
                    "was not measured, say NaN instead of zero, or sensors=[(point, direction), ...] with one number "
                    "for each"
                )


def unseen_modes(m: Shapes, where: Array | None, along: Array | None) -> tuple[int, ...]:
    """Numbers of a model's modes, from 0, that hardly move along any sensor.

    Of shapes without a model there are none.

    Parameters
    ----------
    m : modes or shapes
    where : places of the sensors [m], shape (s, 3), or None
    along : their unit directions, shape (s, 3), or None
    """
    if not isinstance(m, Modes) or along is None or where is None:
        return ()
    motion = m.at(where)
    seen = np.abs(np.einsum("kpi,pi->kp", motion, along)).max(axis=1)
    return tuple(np.flatnonzero(seen <= _UNSEEN * np.linalg.norm(motion, axis=2).max(axis=1)).tolist())


def compared_points(
    a: Shapes, b: Shapes, points: ArrayLike | None, masses: ArrayLike | None, weighted: bool
) -> tuple[Array | None, Array | None]:
    """Points [m] at which shapes are compared, and the masses they stand for.

    Without ``points`` they are the blocks that move in the coarser model, with its masses if ``weighted``. Without any
    model the points are None.

    Parameters
    ----------
    a, b : modes or shapes
    points : chosen places [m], shape (p, 3), or None
    masses : that these stand for [kg], shape (p,), or None
    weighted : whether masses are wanted

    Returns
    -------
    tuple
        Points [m], shape (p, 3), and masses [kg], shape (p,); None where there are none.
    """
    given = None if masses is None else numbers("masses", masses)
    if given is not None and (given.ndim != 1 or not np.isfinite(given).all() or (given < 0.0).any()):
        raise InputError(f"masses must be a column of finite numbers that are not negative [kg], got {masses!r}")
    if points is not None:
        where = np.atleast_2d(numbers("points", points))
        if weighted and given is None:
            raise InputError("give the masses that chosen points stand for, or compare plainly (weighted=False)")
        if given is not None and given.shape != (len(where),):
            raise InputError(f"masses must have shape ({len(where)},), got {given.shape}")
        return where, given
    models = [m for m in (a, b) if isinstance(m, Modes)]
    if not models:
        if weighted and given is None:
            raise InputError("shapes without a model have no masses: give them")
        return None, given
    if len(models) == 1:
        raise InputError("give the points, or the sensors, at which the shapes without a model were taken")
    coarse = min(models, key=lambda m: int(m.system.carrier.moving.sum()))
    kept = coarse.system.carrier.moving
    weight = coarse.system.carrier.masses[kept] if weighted else None
    if given is not None and len(given) != kept.sum():
        raise InputError(f"masses must have shape ({int(kept.sum())},), one for each block or node that moves: "
                         f"got {given.shape}; or give the points that they stand for")
    return coarse.places[kept], given if given is not None else weight


def as_rows(m: Shapes, where: Array | None, along: Array | None) -> Array:
    """Shapes as rows of numbers, shape (k, components), checked; real or complex.

    Parameters
    ----------
    m : modes of a model, taken at the points, or shapes (k, s) or (k, p, 3)
    where : points of the model's modes [m], shape (p, 3)
    along : unit directions at these points, (p, 3), for one number each; None for all three components
    """
    if isinstance(m, Modes):
        assert where is not None
        u = m.at(where)
        return np.asarray(u.reshape(len(m), -1) if along is None else np.einsum("kpi,pi->kp", u, along))
    try:
        shapes = np.asarray(m, dtype=complex if np.iscomplexobj(m) else float)
    except (TypeError, ValueError):
        raise InputError(
            f"shapes must be Modes or numbers of shape (k, p, 3) or (k, s), got {type(m).__name__}"
        ) from None
    if shapes.ndim not in (2, 3) or (shapes.ndim == 3 and shapes.shape[2] != 3) or not shapes.size:
        raise InputError(f"shapes must have shape (k, p, 3), or (k, s) of sensors, got {shapes.shape}")
    flat = shapes.reshape(len(shapes), -1)
    missing = np.isnan(flat)
    if np.isinf(flat).any() or (missing.any(axis=0) & ~missing.all(axis=0)).any() or missing.all():
        raise InputError("shapes must be finite; NaN says that a component was not measured, then in every mode")
    return flat


def per_component(weight: Array, length: int) -> Array:
    """Mass of every component of a shape [kg], shape (length,), place by place.

    Parameters
    ----------
    weight : mass of every place [kg], shape (p,)
    length : components of a shape, p of sensors or 3 p of points
    """
    if length not in (len(weight), 3 * len(weight)):
        raise InputError(f"{len(weight)} masses do not fit shapes of {length} components")
    return np.repeat(weight, length // len(weight))
