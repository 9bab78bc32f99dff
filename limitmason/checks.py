"""Checks of what a user gives: every message names the argument and the value that was wrong.

``name`` is what a message calls the argument, ``value`` what was given for it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Any, TypeVar

import numpy as np

from limitmason.errors import InputError

T = TypeVar("T")


def finite(name: str, value: object) -> float:
    """Return `value` as a float, or say which argument is not a finite number.

    True and False, numbers to Python, are none.
    """
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number) or isinstance(value, str | bytes | bool | np.bool_):
        raise InputError(f"{name} must be a finite number, got {value!r}")
    return number


def positive(name: str, value: object, unit: str = "") -> float:
    """Return `value` as a float, or say which argument is not a finite number above zero."""
    number = finite(name, value)
    if number <= 0.0:
        raise InputError(f"{name} must be positive{f' [{unit}]' if unit else ''}, got {value!r}")
    return number


def not_negative(name: str, value: object) -> float:
    """Return `value` as a float, or say which argument is not a finite number of zero or more."""
    number = finite(name, value)
    if number < 0.0:
        raise InputError(f"{name} must not be negative, got {value!r}")
    return number


def single_number(name: str, value: Any, *, endless: bool = False, signed: bool = False) -> None:
    """Refuse what is no single number, as of a joint law, a material or a rule.

    That is anything but a single number, NaN, and what is infinite or negative unless that is allowed.

    Parameters
    ----------
    name : what it is called
    value : what was given
    endless, signed : whether it may be infinite, and negative
    """
    # a numpy scalar or an array of one number is a number too; True and False, numbers to Python, are none
    single = isinstance(value, (int, float)) or (hasattr(value, "__float__") and getattr(value, "size", 1) == 1)
    if isinstance(value, bool | np.bool_) or not single:
        raise InputError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except OverflowError:  # a whole number of hundreds of digits
        raise InputError(f"{name} must be finite") from None
    if math.isnan(number):
        raise InputError(f"{name} is NaN")
    if number < 0.0 and not signed:
        raise InputError(f"{name} = {value} must not be negative")
    if math.isinf(number) and not endless:
        raise InputError(f"{name} must be finite")


def law_angles(label: str, friction_deg: float, dilatancy_deg: float) -> None:
    """Refuse a friction angle of 90 degrees and more, and a dilatancy angle above it.

    Both are in degrees; ``label`` says of which joint.
    """
    if friction_deg >= 90.0:
        raise InputError(f"{label}: friction_angle_deg = {friction_deg} must be below 90 degrees")
    if dilatancy_deg > friction_deg:
        raise InputError(
            f"{label}: dilatancy_angle_deg = {dilatancy_deg} exceeds friction_angle_deg = {friction_deg}; nothing can "
            "dilate more than its friction angle"
        )


def count(name: str, value: object, least: int = 1) -> int:
    """Return `value` as an int, or say which argument is not a whole number of at least `least`."""
    number = finite(name, value)
    if number != round(number) or number < least:
        raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")
    return int(number)


def choice(name: str, value: T, allowed: Collection[object]) -> T:
    """Return `value` if it is one of `allowed`, or list what is allowed."""
    try:
        known = value in allowed
    except (TypeError, ValueError):  # a list or an array is none of them, and cannot be looked up
        known = False
    if not known:
        # names as plain texts, whatever class they have; an empty one is a default that nobody writes
        told = (repr(str(a) if isinstance(a, str) else a) for a in allowed if a != "")
        raise InputError(f"{name} must be one of {', '.join(told)}, got {value!r}")
    return value


def switch(name: str, value: Any) -> bool:
    """Return `value` if it is True or False, or say that nothing else is taken for one of them."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} must be True or False, got {_told(value)}")
    return bool(value)


def numbers(name: str, value: Any) -> np.ndarray:
    """Return `value` as an array of floats, or say which argument holds something else than numbers."""
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be numbers, got {_told(value)}") from None


def instance(name: str, value: Any, kind: type[T], made: str = "") -> T:
    """Return `value` if it is of the class `kind`, or say what was given instead and by what one is `made`.

    An answer that has one among its fields, such as an envelope with its governing state, is told which to give.
    """
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        fields = getattr(value, "__dict__", {}).items()
        inside = [f".{f}" for f, v in fields if isinstance(v, kind)]
        inside += [f".{f}[0]" for f, v in fields if isinstance(v, tuple) and v and isinstance(v[0], kind)]
        raise InputError(
            f"{name} must be {article} {kind.__name__}{f' ({made})' if made else ''}, got {_told(value)}"
            + (f": give its {inside[0]}" if inside else "")
        )
    return value


def several(name: str, value: Any, kind: type[T]) -> tuple[T, ...]:
    """Return the items of `value` if all are of the class `kind`, or say which is not.

    One alone is told how to write it.
    """
    if isinstance(value, kind):
        raise InputError(f"{name} must be a list: write [{name[:-1]}]")
    if not isinstance(value, Iterable) or isinstance(value, str):
        raise InputError(f"{name} must be a list of {kind.__name__}, got {_told(value)}")
    return tuple(instance(f"{name}[{k}]", item, kind) for k, item in enumerate(value))


def listener(name: str, value: T | None, told: str) -> T | None:
    """Return `value` if it is a function of what is `told`, or None; or say that it cannot be called."""
    if value is not None and not callable(value):
        raise InputError(f"{name} must be a function of {told}, got {_told(value)}: print is one, None tells nobody")
    return value


def _told(value: Any) -> str:
    """A value in a message: short ones themselves, others by their class, so that a message stays a line."""
    short = isinstance(value, str | int | float | None) and len(repr(value)) < 60
    return repr(value) if short else type(value).__name__
