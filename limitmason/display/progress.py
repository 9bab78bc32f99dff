"""How far a long run is: one bar for the outermost task, with the time left, in a terminal and in a notebook.

A run that may be long is a :func:`task` and says now and then how far it is (:func:`reached`). What runs inside fills
its share of the same bar. Nothing is drawn in the first two seconds, in worker processes and threads, or where nobody
looks: neither a terminal nor a notebook. ``lm.show_progress`` decides otherwise, for good or for a ``with`` block.
"""

import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import wraps
from typing import Any, ParamSpec, TextIO, TypeVar

from limitmason.errors import InputError

AFTER = 2.0
"""Seconds before a bar appears."""

ALWAYS, NEVER, AUTO = MODES = ("always", "never", "auto")
VARIABLE = "LIMITMASON_PROGRESS"
"""Of the environment: one of ``MODES``, where :func:`show_progress` was not called."""

_TERMINAL, _LOG = 0.1, 10.0  # seconds between two drawings: what moves, and what ends in a file
_CLOCK = 0.5  # seconds after which the clock moves on though nothing was reached

_P = ParamSpec("_P")
_R = TypeVar("_R")


class _Task:
    """One level: ``part`` of it is done [-], None where it cannot tell; ``share`` is what the level inside fills."""

    def __init__(self, title: str) -> None:
        self.title, self.text = title, ""
        self.part: float | None = 0.0
        self.share = 0.0


class _Bar:
    """The bar of the outermost task, called by ``title``, with all levels inside it; times in seconds."""

    def __init__(self, title: str) -> None:
        """Begin the clock and a thread that keeps it moving."""
        self.tasks = [_Task(title)]  # from the outermost to the one that is at work
        self.begun = time.monotonic()
        self.first = 0.0, self.begun  # part that was done when it was taken up, and when that was
        self.drawn = 0.0  # when it was drawn last
        self.tqdm: Any = None
        self.lock = threading.RLock()
        self.over = threading.Event()
        # one line that moves, where someone looks on; else a new line now and then, as in the log of a job
        self.moves = bool(_listener) or _is_watched()
        threading.Thread(target=self._keep_time, daemon=True).start()

    @property
    def part(self) -> tuple[float | None, bool]:
        """Part that is done of everything [-], and whether it is known in full.

        It is not where a level that fills some of it cannot tell its part. The part is None where the outermost task
        cannot tell.
        """
        done, width = 0.0, 1.0  # width: what the level fills of everything
        for level, task in enumerate(self.tasks):
            if task.part is None:
                return (None if level == 0 else done), width == 0.0
            done, width = done + width * task.part, width * task.share
        return min(done, 1.0), True

    def draw(self, now: float) -> None:
        """Draw the bar at a clock reading [s].

        Nothing is drawn where it was drawn a moment ago, or where the run is young.
        """
        early = not _listener and now - self.begun < AFTER
        if early or now - self.drawn < (_TERMINAL if self.moves else _LOG):
            return
        with self.lock:
            if self.over.is_set():
                return
            self.drawn = now
            (part, known), spent = self.part, now - self.begun
            before, since = self.first
            # at the pace since the run was taken up; NaN where that cannot be told
            left = (now - since) * (1.0 - part) / (part - before) if known and part and part > before else float("nan")
            text = "; ".join(t.text for t in self.tasks if t.text)
            line = clock(spent) + (f", about {clock(left)} left" if left == left else "")  # NaN differs from itself
            line += f"; {text}" if text else ""
            if _listener:
                _listener[0](part, line)
                return
            shape = "{desc}: {percentage:3.0f}%|{bar:20}| " if part else "{desc}: "
            shape += line.replace("{", "{{").replace("}", "}}")  # tqdm fills in what stands in braces
            if self.tqdm is None:
                self.tqdm = _tqdm(self.tasks[0].title, part or 0.0, shape)
                return
            self.tqdm.bar_format, self.tqdm.n = shape, part or 0.0
            self.tqdm.refresh()

    def close(self) -> None:
        """Take the bar away and end its thread."""
        with self.lock:
            self.over.set()
            if self.tqdm is not None:
                self.tqdm.close()

    def _keep_time(self) -> None:
        """Draw the bar now and then where no step of the run does, in a thread of its own."""
        while not self.over.wait(_CLOCK):
            now = time.monotonic()
            if now - self.drawn >= _CLOCK:
                self.draw(now)


def _tqdm(title: str, part: float, shape: str) -> Any:
    """A bar of tqdm with a title, at a part that is done [-], laid out by ``shape``."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # tqdm says where a notebook has no widgets; it then draws in text
        from tqdm.auto import tqdm

        return tqdm(
            total=1.0, initial=part, desc=title, bar_format=shape, leave=False, dynamic_ncols=True, file=_stream()
        )


def clock(seconds: float) -> str:
    """Seconds as "7 s", "3:05" or "2:03:05", or empty for what is no time."""
    if not seconds < 1e9:  # thirty years, infinite or NaN
        return ""
    s = round(seconds)
    if s < 60:
        return f"{s} s"
    return f"{s // 60}:{s % 60:02d}" if s < 3600 else f"{s // 3600}:{s // 60 % 60:02d}:{s % 60:02d}"


_bar: list[_Bar] = []  # at most one
_mode: list[str] = []  # as said by show_progress; empty where nothing was said
_listener: list[Callable[[float | None, str], None]] = []  # at most one


def _stream() -> TextIO:
    """Standard error as it is now: a test or a notebook may have put another in its place."""
    return sys.stderr


def _is_watched() -> bool:
    """Whether somebody sees standard error move: a terminal, or a notebook."""
    return "ipykernel" in sys.modules or bool(getattr(_stream(), "isatty", lambda: False)())


def bars_are_drawn() -> bool:
    """Whether bars are drawn: where somebody watches, or asked for them.

    They are drawn in the main thread of the main process alone. A listener is told of runs in other processes too.
    """
    from multiprocessing.process import current_process

    if threading.current_thread() is not threading.main_thread():
        return False
    if _listener:
        return True
    if current_process().name != "MainProcess":
        return False
    mode = _mode[0] if _mode else os.environ.get(VARIABLE, AUTO)
    return mode == ALWAYS or (mode != NEVER and _is_watched())


def show_progress(mode: bool | str = AUTO) -> AbstractContextManager[object]:
    """Say whether long runs show how far they are, with the time left.

    Parameters
    ----------
    mode : True or "always", False or "never", or "auto": in terminals and notebooks, after two seconds. The environment
        variable LIMITMASON_PROGRESS says the same where this function was not called

    Returns
    -------
    A context, for ``with lm.show_progress(False): ...``; without ``with`` it holds from now on.

    Raises
    ------
    InputError
        For another word.
    """
    said = (ALWAYS if mode else NEVER) if isinstance(mode, bool) else mode
    if said not in MODES:
        raise InputError(f"show_progress takes True, False or one of {', '.join(MODES)}, got {mode!r}")
    after = ExitStack()  # at the end of a with block the mode is again what it was
    after.callback(_mode.__setitem__, slice(None), list(_mode))
    _mode[:] = [said]
    return after


@contextmanager
def told_to(listener: Callable[[float | None, str], None]) -> Iterator[None]:
    """Tell a function how far long runs are, in place of a bar, also in a process that works for another one.

    Parameters
    ----------
    listener : gets the part that is done [-], None where it cannot be told, and the words of the bar; also called
        from the thread that keeps the time
    """
    _listener[:] = [listener]
    try:
        yield
    finally:
        _listener.clear()


@contextmanager
def task(title: str, shown: bool = True) -> Iterator[None]:
    """A run that may be long, in a ``with`` block.

    Inside another one it fills the share of the bar that was reached there. Without a bar, and in another thread, the
    block is run and nothing else.

    Parameters
    ----------
    title : before the bar, where this is the outermost task
    shown : False where the caller has a progress function of its own
    """
    if threading.current_thread() is not threading.main_thread() or not (_bar or (shown and bars_are_drawn())):
        yield
    elif _bar:
        tasks = _bar[0].tasks
        tasks.append(_Task(title))
        try:
            yield
        finally:
            tasks.pop()
    else:
        bar = _Bar(title)
        _bar.append(bar)
        try:
            yield
        finally:
            _bar.clear()
            bar.close()


def watched(title: str) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Make a function a :func:`task` of that title.

    Where it is given a ``progress`` function of the caller, no bar is begun.
    """

    def wrap(function: Callable[_P, _R]) -> Callable[_P, _R]:
        """The function, whose runs are told as a task."""

        @wraps(function)
        def run(*arguments: _P.args, **options: _P.kwargs) -> _R:
            with task(title, shown=options.get("progress") is None):
                return function(*arguments, **options)

        return run

    return wrap


def reached(part: float | None, text: str | None = None, *, share: float = 0.0) -> None:
    """Say how far the innermost task is.

    Parameters
    ----------
    part : done of it [-], 0 to 1; None where it cannot be told
    text : what a reader may want to know, in a few words; None leaves what stands there
    share : part of it that what comes next will fill, if that is a task itself [-]
    """
    if _bar and threading.current_thread() is threading.main_thread():
        now = _bar[0].tasks[-1]
        now.part, now.share = part, share
        now.text = now.text if text is None else text
        _bar[0].draw(time.monotonic())


def taken_up(part: float | None, text: str | None = None) -> None:
    """Say how far the innermost task was when an earlier run ended: the time left counts from here.

    ``part`` and ``text`` are those of :func:`reached`.
    """
    reached(part, text)
    if _bar and part and threading.current_thread() is threading.main_thread():
        _bar[0].first = _bar[0].part[0] or 0.0, time.monotonic()


def noted(text: str) -> None:
    """Change the words of the innermost task alone."""
    if _bar and threading.current_thread() is threading.main_thread():
        reached(_bar[0].tasks[-1].part, text, share=_bar[0].tasks[-1].share)


def write(text: str, file: TextIO | None = None) -> None:
    """Write ``text`` as a line to standard error, or to ``file``, above a bar if any."""
    out = _stream() if file is None else file
    if _bar and _bar[0].tqdm is not None:
        with _bar[0].lock:
            _bar[0].tqdm.write(text, file=out)
    else:
        out.write(text + "\n")
    out.flush()
