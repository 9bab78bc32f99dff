"""Checks of the numbers that a builder is given: every message names the argument and the value that was wrong."""

from __future__ import annotations

from typing import Any

from limitmason.checks import count, positive
from limitmason.errors import InputError

_WHOLE = 1e-6  # of a course, chosen: a height this near to whole courses is meant so, as with 0.1 + 0.2


def unit_size(unit: object, parts: int = 3) -> tuple[float, ...]:
    """Return the first sizes (length, height, thickness) of a unit [m].

    A wrong one is an error that names it.

    Parameters
    ----------
    unit : as given, a sequence of sizes [m]
    parts : how many sizes are needed, 3 or fewer
    """
    names = ("length", "height", "thickness")[:parts]
    try:
        sizes: tuple[Any, ...] = tuple(unit)  # type: ignore[arg-type]
    except TypeError:
        sizes = ()
    if len(sizes) != parts:
        raise InputError(f"unit must be ({', '.join(names)}) in metres, got {unit!r}")
    return tuple(positive(f"unit {name}", size) for name, size in zip(names, sizes, strict=True))


def courses_from(height: object, courses: object, unit_height: float, where: str = "height") -> int:
    """Return the number of courses from either the height [m] or the count itself.

    Exactly one of the two is given; a height that is not a whole number of courses is refused, because a builder
    that silently rounds it changes the slenderness that the analysis is about.

    Parameters
    ----------
    height : of the whole [m], or None
    courses : their number, or None
    unit_height : of a course [m]
    where : name of the height in errors
    """
    if (height is None) == (courses is None):
        raise InputError(f"give exactly one of {where} and courses, got {where}={height!r} and courses={courses!r}")
    if courses is not None:
        return count("courses", courses)
    total = positive(where, height)
    number = round(total / unit_height)
    if number < 1 or abs(number * unit_height - total) > _WHOLE * unit_height:
        below = max(int(total / unit_height), 1)
        raise InputError(
            f"{where} {total:g} m is not a whole number of courses of {unit_height:g} m; "
            f"nearest are {below * unit_height:g} m and {(below + 1) * unit_height:g} m"
        )
    return number
