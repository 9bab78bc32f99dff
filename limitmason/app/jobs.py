"""One job at a time in a process of its own: started, followed, cancelled, and ended with the last page."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from limitmason.app.script import ScriptLine
from limitmason.app.worker import work

GRACE = 5.0
"""Seconds after the last page has gone until its job ends: a page that is loaded again comes back sooner."""

MOST_PAGES = 5  # pages that look on: a browser has six connections to a server, and each keeps one

_KEPT = 6  # jobs whose files can still be fetched


class Busy(RuntimeError):
    """A solve runs: it has to end, or to be cancelled, first."""


@dataclass
class Computation:
    """A session that is, was or will be run.

    Parameters
    ----------
    number : of the job
    kind : "draw", "solve" or "report"
    lines : that are run
    state : "waiting", "running", "done", "failed" or "cancelled"
    part : done of it [-], None where that is not known
    text : how far it is, in words
    begun : clock reading when it was asked for [s]
    seconds : it took, once it has ended
    result : of ``limitmason.app.worker.run``, empty until then
    """

    number: int
    kind: str
    lines: Sequence[ScriptLine]
    state: str = "waiting"
    part: float | None = None
    text: str = ""
    begun: float = field(default_factory=time.monotonic)
    seconds: float = 0.0
    result: dict[str, Any] = field(default_factory=dict)

    def done_lines(self) -> list[ScriptLine]:
        """Its lines without those that had nothing to show, with which the script would end."""
        return [line for line in self.lines if line.text not in self.result.get("left_out", ())]

    def as_json(self) -> dict[str, Any]:
        """What all pages are told."""
        spent = time.monotonic() - self.begun if self.state in ("waiting", "running") else self.seconds
        return {"job": self.number, "kind": self.kind, "state": self.state, "part": self.part, "text": self.text,
                "seconds": round(spent, 1)}


class Jobs:
    """The worker process and the jobs that it was given.

    One job runs, and one at most waits behind it. Every method may be called by any thread: what it changes is behind
    one lock, ``_changed``, and all who wait are told. ``_now`` is the job that runs, ``_next`` the one that waits, and
    ``_kept`` are the last ones by number. ``_pages`` is the number of pages that look on.

    Parameters
    ----------
    folder : where the lines run
    target : what the process runs, with its end of the pipe and the folder
    """

    def __init__(self, folder: str, target: Callable[[Connection, str], None] = work) -> None:
        """Begin without a process."""
        self._folder, self._target = folder, target
        self._changed = threading.Condition(threading.RLock())
        self._numbers = itertools.count(1)
        self._kept: dict[int, Computation] = {}
        self._now: Computation | None = None
        self._next: Computation | None = None
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._pages = 0
        self._closed = False

    @property
    def process(self) -> int | None:
        """Number of the process that works or waits for work."""
        process = self._process
        return process.pid if process is not None and process.is_alive() else None

    def start(self, kind: str, lines: Sequence[ScriptLine]) -> Computation:
        """Begin a job, or let it wait for a drawing that is still being made.

        A drawing that waits already is dropped.

        Parameters
        ----------
        kind : "draw", "solve" or "report"
        lines : of the script

        Raises
        ------
        Busy
            While a solve runs.
        """
        with self._changed:
            now = self._now
            # one job waits at most, and only behind a drawing
            if now is not None and (now.kind != "draw" or (self._next is not None and self._next.kind != "draw")):
                raise Busy("a solve is running, in this page or another one: wait for it, or cancel it")
            job = Computation(next(self._numbers), kind, lines)
            self._kept[job.number] = job
            for number in list(self._kept)[:-_KEPT]:  # the oldest first
                del self._kept[number]
            if now is None:
                self._give(job)
            else:
                if self._next is not None:
                    self._next.state = "cancelled"
                self._next = job
            self._changed.notify_all()
            return job

    def cancel(self) -> None:
        """End the process with whatever runs in it."""
        with self._changed:
            process, self._process, pipe, self._pipe = self._process, None, self._pipe, None
            for job in (self._now, self._next):
                if job is not None:
                    job.seconds, job.state = time.monotonic() - job.begun, "cancelled"
            self._now = self._next = None
            self._changed.notify_all()
        # without the lock, which the thread that listens needs to end
        if process is not None:
            process.kill()
            process.join()
        if pipe is not None:
            pipe.close()

    def get(self, number: int) -> Computation | None:
        """The job of a number, None where it is no longer kept."""
        with self._changed:
            return self._kept.get(number)

    def last(self) -> Computation | None:
        """The job that pages are told of: the one that waits, that runs, or the last one; None before the first."""
        with self._changed:
            return self._next or self._now or (self._kept[max(self._kept)] if self._kept else None)

    def warm(self) -> None:
        """Start the process before it is needed: its imports take a second or two."""
        with self._changed:
            if self._process is None and not self._closed:
                here, there = get_context("spawn").Pipe()
                self._process = get_context("spawn").Process(
                    target=self._target, args=(there, self._folder), daemon=True, name="limitmason-app"
                )
                self._process.start()
                there.close()  # this copy: the end of the other process then ends the pipe
                self._pipe = here
                threading.Thread(target=self._listen, args=(self._process, here), daemon=True).start()

    def wait(self, seconds: float) -> None:
        """Wait until something changes, at most so long."""
        with self._changed:
            self._changed.wait(seconds)

    def page_opened(self) -> bool:
        """A page looks on, unless too many do: a browser has six connections to a server, and each page keeps one."""
        with self._changed:
            if self._pages >= MOST_PAGES:
                return False
            self._pages += 1
        self.warm()
        return True

    def page_closed(self) -> None:
        """A page has gone; with the last one the process ends."""
        with self._changed:
            self._pages -= 1
        timer = threading.Timer(GRACE, self._end_unless_seen)
        timer.daemon = True
        timer.start()

    def close(self) -> None:
        """End for good."""
        self._closed = True
        self.cancel()

    def _end_unless_seen(self) -> None:
        """Cancel what runs where no page is open any more."""
        with self._changed:
            seen = self._pages > 0
        if not seen:
            self.cancel()

    def _give(self, job: Computation) -> None:
        """Hand a job to the worker, which is started where there is none."""
        self.warm()
        job.state, self._now = "running", job
        assert self._pipe is not None
        self._pipe.send(list(job.lines))

    def _listen(self, process: BaseProcess, pipe: Connection) -> None:
        """Take what ``process`` sends through ``pipe`` until it ends.

        This runs in a thread of its own.
        """
        while True:
            try:
                kind, *rest = pipe.recv()
            except (EOFError, OSError, TypeError):  # TypeError: closed by cancel in another thread
                break
            with self._changed:
                if process is not self._process:
                    # another process has taken its place
                    return
                if self._now is None:
                    # the job was cancelled: what still comes of it is dropped
                    continue
                if kind == "progress":
                    self._now.part, self._now.text = rest
                else:
                    self._done(rest[0])
                self._changed.notify_all()
        process.join()
        with self._changed:
            if process is self._process:  # it ended by itself
                self._process = self._pipe = None
                if self._now is not None:
                    # a process that ends by itself was most likely stopped for want of memory
                    text = f"the process of the solve ended, exit status {process.exitcode}: take fewer blocks"
                    self._done({"error": {"part": "analysis", "name": "MemoryError", "text": text}})
                self._changed.notify_all()

    def _done(self, result: dict[str, Any]) -> None:
        """Keep the result of the present job, and begin the one that waits."""
        job, self._now = self._now, None
        assert job is not None
        job.seconds, job.result = time.monotonic() - job.begun, result
        job.state = "failed" if "error" in result else "done"
        following, self._next = self._next, None
        if following is not None:
            self._give(following)
