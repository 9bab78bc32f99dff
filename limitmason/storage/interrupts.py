"""Interrupts from the keyboard by which a run ends early with what it has: what keeps results must hear of them."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_ended = threading.local()


def ends_early() -> None:
    """Note that an interrupt ends a run of this thread, which returns what it has."""
    _ended.runs = getattr(_ended, "runs", 0) + 1


@contextmanager
def handed_on() -> Iterator[None]:
    """Interrupt what calls runs whose results are kept, where an interrupt has ended one of them early.

    Raises
    ------
    KeyboardInterrupt
        At the end of the block, so that no part of a run is taken for all of it, nor an error that follows from it.
    """
    before = getattr(_ended, "runs", 0)
    try:
        yield
    finally:
        if getattr(_ended, "runs", 0) != before:
            raise KeyboardInterrupt("it ended a run early")
