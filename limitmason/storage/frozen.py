"""Read-only arrays: what a model and an answer hand out cannot be changed by who reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array

T = TypeVar("T")

_PLAIN = frozenset((int, float, str, bool, type(None)))
_SEQUENCES = (tuple, list)
_MAPPINGS = (dict, Mapping)


def frozen(value: T) -> T:
    """The value itself, with all arrays in it made read-only.

    They are looked for in tuples, lists and mappings, not in other objects.
    """
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    # plain classes first: whether something is a Mapping takes ten times as long to ask
    elif isinstance(value, _SEQUENCES):
        _freeze(value)
    elif isinstance(value, _MAPPINGS):
        _freeze(value.values())
    return value


def _freeze(items: Iterable[Any]) -> None:
    """Make all arrays in some values read-only."""
    for item in items:
        # faces are tuples of thousands of numbers: these are not asked one by one what they are
        if type(item) not in _PLAIN:
            frozen(item)


def owned(value: ArrayLike) -> Array:
    """A read-only array of numbers that nobody can change, its maker neither.

    It is a copy, unless the value is read-only and shares its numbers with no other array.
    """
    array = np.asarray(value, dtype=float)
    if array.flags.writeable or not array.flags.owndata:
        array = array.copy()
    return frozen(array)


class ReadOnly:
    """A frozen dataclass whose arrays are read-only, when made, copied and unpickled."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Freeze after the check of a class that has one of its own.

        It would else replace the one here.
        """
        super().__init_subclass__(**options)
        check: Callable[..., None] | None = cls.__dict__.get("__post_init__")
        if check is not None:
            cls.__post_init__ = _then_frozen(check)  # type: ignore[method-assign]

    def __post_init__(self) -> None:
        """Freeze the arrays of a new object."""
        frozen(vars(self))

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Freeze the arrays of a copy: they come writable out of a pickle and a deep copy."""
        vars(self).update(frozen(dict(state)))


def _then_frozen(check: Callable[..., None]) -> Callable[..., None]:
    """The check of a dataclass, followed by the freezing of its arrays.

    The check is its ``__post_init__``.
    """

    @wraps(check)
    def both(self: Any, *given: Any) -> None:
        check(self, *given)
        frozen(vars(self))

    return both


__all__ = ["ReadOnly", "frozen", "owned"]
