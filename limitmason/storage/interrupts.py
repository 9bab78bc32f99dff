"""Interrupts from the keyboard by which a run ends early with what it has: what keeps results must hear of them."""

# only what is loaded in no time: the package reads this file before its libraries
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

INTERRUPTED = 130
"""Exit status of what an interrupt ended: 128 and the number of the signal, as shells have it."""

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


def _is_command_line() -> bool:
    """Whether this process is the command ``limitmason``, or ``python -m limitmason`` that still loads."""
    name = os.path.basename(sys.argv[0]) if sys.argv else ""
    return os.path.splitext(name)[0] == "limitmason" or name == "-m"


def told_in_one_line() -> None:
    """Tell an interrupt that nothing has caught by one line and :data:`INTERRUPTED`, where a command runs.

    It is of the whole process: the libraries of the command line load before it can catch anything. A script that
    imports the package keeps its traceback.
    """
    if not _is_command_line():
        return
    others = sys.excepthook

    def tell(kind: type[BaseException], error: BaseException, where: TracebackType | None) -> None:
        """Tell an error that ends the process."""
        if not issubclass(kind, KeyboardInterrupt):
            others(kind, error, where)
            return
        sys.stderr.write("interrupted\n")
        sys.exit(INTERRUPTED)

    sys.excepthook = tell
