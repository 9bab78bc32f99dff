"""Checks of what a user gives: every message names the argument and the value that was wrong."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TypeVar

from limitmason.errors import InputError

T = TypeVar("T")


def finite(name: str, value: object) -> float:
    """Return `value` as a float, or say which argument is not a finite number."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) or isinstance(value, str):
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


def count(name: str, value: object, least: int = 1) -> int:
    """Return `value` as an int, or say which argument is not a whole number of at least `least`."""
    number = finite(name, value)
    if number != round(number) or number < least:
        raise InputError(f"{name} must be a whole number of at least {least}, got {value!r}")
    return int(number)


def choice(name: str, value: T, allowed: Collection[object]) -> T:
    """Return `value` if it is one of `allowed`, or list what is allowed."""
    if value not in allowed:
        told = (repr(str(a) if isinstance(a, str) else a) for a in allowed if a != "")
        raise InputError(f"{name} must be one of {', '.join(told)}, got {value!r}")
    return value
