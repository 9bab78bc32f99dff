"""Sizes of a cause, and values of inputs, at which a table has entries."""

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from limitmason.causes.cause import Cause
from limitmason.diagnosis.simulator_calls import note_user_code, number

NODES = {0: (), 1: (9,), 2: (5, 5), 3: (3, 3, 3)}
"""Nodes along each measured input, by their number: fewer where there are more, as a table has their product."""

CELL = 0.75  # distance of neighbouring size nodes in units of the noise, all specimens together

WIDE = 10.0  # ratio of the bounds from which half-way between two sizes is their geometric mean

PAIR_NODES = 6  # size nodes on each side of the baseline in the table of a pair


def warn_without_effect(change: np.ndarray, what: str, keyword: str, ends: Sequence[float]) -> None:
    """Warn where no prediction changes by a bit: a keyword may do nothing.

    Parameters
    ----------
    change : of every prediction, on the scale of comparison
    what : that was changed, in words
    keyword : of the simulator that was changed
    ends : its two values
    """
    if not np.any(change):
        warnings.warn(
            f"{what} changes no prediction of any specimen from {ends[0]:g} to {ends[1]:g}: either simulate takes "
            f"{keyword!r} and ignores it, or none of these specimens feels it",
            stacklevel=3,
        )


def transformed(
    cause: Cause, size: float, prediction: float, specimen: Any, index: int, quantity: str = "",
    must_be_positive: bool = True,
) -> float:
    """A prediction as a measurement cause lets it be read.

    Parameters
    ----------
    quantity : what is read, for a cause that asks for it
    must_be_positive : whether the logarithm of the reading is compared
    size : of the cause in its unit
    prediction : that is read
    specimen, index : what was tested, and its number for errors
    """
    assert cause.apply is not None, "a reading is transformed by its apply"
    try:
        read = {"quantity": quantity} if cause.reads_quantity else {}
        value = cause.apply(float(size), float(prediction), specimen, **read)
    except Exception as error:
        note_user_code(error, f"cause {cause.name!r} of size {size:g} failed for specimen {index} ({specimen!r})")
        raise
    what = f"cause {cause.name!r} of size {size:g} applied to specimen {index}"
    return number(value, lambda: what, must_be_positive)


def through_zero(low: float, high: float, count: int) -> np.ndarray:
    """``count`` values from low, 0 or less, to high, 0 or more, with 0 among them."""
    if low == 0.0 or high == 0.0:
        return np.linspace(low, high, count)
    # intervals below 0: their share of the range, and at least one on either side
    below = max(1, round((count - 1) * -low / (high - low)))
    below = min(below, count - 2)
    return np.concatenate([np.linspace(low, 0.0, below + 1), np.linspace(0.0, high, count - below)[1:]])


def is_factor(cause: Cause) -> bool:
    """Whether sizes are told apart by their ratio, as of a stiffness.

    That is a factor over a wide range.
    """
    return 0.0 < WIDE * cause.bounds[0] <= cause.bounds[1]


def between_sizes(cause: Cause, sizes: np.ndarray, values: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Values between sizes, along the logarithm of a factor.

    Parameters
    ----------
    values : at the sizes, shape (sizes, n)
    """
    if not is_factor(cause):
        return PchipInterpolator(sizes, values, axis=0)
    along = PchipInterpolator(np.log(sizes), values, axis=0)
    return lambda x: along(np.log(x))


def thinned(nodes: np.ndarray, keep: float, each: int = PAIR_NODES) -> np.ndarray:
    """Numbers of at most ``each`` nodes on both sides of the node at ``keep``."""
    middle = int(np.argmin(np.abs(nodes - keep)))
    last = len(nodes) - 1
    below = np.round(np.linspace(0, middle, min(each, middle) + 1)).astype(int)
    above = np.round(np.linspace(middle, last, min(each, last - middle) + 1)).astype(int)
    return np.unique(np.concatenate([below, above]))
