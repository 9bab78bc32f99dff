"""Interrupts from the keyboard by which a run ends early with what it has: what keeps results must hear of them."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_ended = threading.local()  # ``runs``: how many of this thread an interrupt has ended


def ends_early() -> None:
    """Note that an interrupt ends a run of this thread, which returns what it has."""
    _ended.runs = getattr(_ended, "runs", 0) + 1


@contextmanager
def handed_on() -> Iterator[None]:
    """Hand an interrupt that ended a run of this block early on to its caller.

    A run that is interrupted returns what it has. What keeps results must not take that for the whole run.

    Raises
    ------
    KeyboardInterrupt
        At the end of such a block, in place of an error that may follow from the part of a run.
    """
    before = getattr(_ended, "runs", 0)
    try:
        yield
    finally:
        if getattr(_ended, "runs", 0) != before:
            raise KeyboardInterrupt("it ended a run early")
