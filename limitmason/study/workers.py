"""Many calls of one function: here, in worker processes where these pay, or on an executor, in chunks where short.

A call that takes a millisecond costs more to hand over than to do. So calls begin in this process. Once workers save
more than it takes to start them, what is left goes to them, so many calls at a time that a chunk takes about ``CHUNK``.
The rows of a study are the same either way.
"""

import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Future, wait
from contextlib import closing, suppress
from itertools import islice
from numbers import Integral
from queue import SimpleQueue
from typing import Any

from limitmason.answers.results import Prediction
from limitmason.errors import InputError
from limitmason.storage.interrupts import handed_on

Job = tuple[int, Mapping[str, Any]]
Results = Generator[tuple[int, Any], None, None]

PATIENCE = 0.25
"""Seconds after which a call on an executor is long."""

CHUNK = 0.5
"""Seconds that a chunk of short calls takes."""

START = 3.0
"""Seconds that workers must save to be started: starting them and importing this package takes about that."""

_LEAST = 32  # chunks in which calls go to an executor of unknown size, at least; chosen
_EACH = 4  # chunks for every worker, at least: one that is done early takes another; chosen
_IDLE = 300  # seconds without work after which worker processes end; chosen
_ORPHANED = 0.5  # seconds between two looks of a worker process whether its parent is still there; chosen
_ENDING = 10.0  # seconds to wait at most until worker processes have ended; chosen
_NAMED = 4  # runs that an error names; chosen
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS")


class Unfinished(Exception):
    """Raised by a function that stops before its answer, out of time.

    The run is left out and done the next time.
    """


class _Done:
    """Results of a chunk, how long it took [s], and the error that ended it."""

    def __init__(self, results: list[tuple[int, Any]], seconds: float, error: Exception | None) -> None:
        self.results, self.seconds, self.error = results, seconds, error


def run_points(
    function: Callable[..., Any], jobs: Sequence[Job], executor: Any, workers: int
) -> Results:
    """Numbered results as they come; an :class:`Unfinished` is handed on as a result.

    Parameters
    ----------
    function : called with the keywords of every job
    jobs : number and keywords of every call
    executor : anything with ``submit``, or a dask client; None for processes of joblib
    workers : most processes, each with one thread for its linear algebra; 1 runs in this process, -1 is one per core
    """
    if executor is not None:
        yield from _on_executor(function, jobs, _as_executor(executor))
        return
    if not isinstance(workers, Integral) or workers == 0:
        raise InputError(f"workers must be at least 1, or -1 for one per core, and a whole number, got {workers!r}")
    if workers < 1:
        from joblib import effective_n_jobs

        workers = effective_n_jobs(workers)
    spent = 0.0  # seconds in calls of this process
    for done, (number, point) in enumerate(jobs):
        left = len(jobs) - done
        # processes only where they save more time than starting them takes: all that is left but a worker's share
        if workers > 1 and done and spent / done * left * (1.0 - 1.0 / workers) >= START:
            most = min(workers, left)
            chunks = _chunks(jobs[done:], spent / done, _EACH * workers)
            with closing(_unpacked(_processes(most), function, chunks, at_once=most)) as results:
                yield from results
            return
        begun = time.perf_counter()
        result = _call(function, point)
        spent += time.perf_counter() - begun
        yield number, result


def _call(function: Callable[..., Any], point: Mapping[str, Any]) -> Any:
    """Result of one call, or the :class:`Unfinished` that it ended with; any other error says at which point."""
    try:
        with handed_on():
            return function(**point)
    except Unfinished as stopped:
        return stopped
    except Exception as error:
        words = in_words(point)
        if words and not getattr(error, "__notes__", ()):  # else it has said where it was called
            error.add_note(f"at {words}")
        raise


def in_words(point: Mapping[str, Any]) -> str:
    """The numbers and words of a point, and mappings of these."""
    plain = (bool, int, float, str, Mapping)
    return ", ".join(f"{name} = {value}" for name, value in point.items() if isinstance(value, plain))


def _chunk(function: Callable[..., Any], jobs: Sequence[Job]) -> _Done:
    """Calls in a worker, one after another, up to the first error.

    What was done before an error is not lost with it.

    Parameters
    ----------
    function : called with the keywords of every job
    jobs : number and keywords of every call
    """
    begun = time.perf_counter()
    results: list[tuple[int, Any]] = []
    for number, point in jobs:
        try:
            result = _call(function, point)
        except Exception as error:
            error.add_note("in a worker:\n" + "".join(traceback.format_exception(error)))
            return _Done(results, time.perf_counter() - begun, error)
        # a whole prediction is heavy to send between processes
        results.append((number, as_row(result) if isinstance(result, Prediction) else result))
    return _Done(results, time.perf_counter() - begun, error=None)


def as_row(result: Any) -> Mapping[str, Any]:
    """A result as columns of a table."""
    if isinstance(result, Prediction):
        return {"multiplier": result.collapse_multiplier, "status": result.status, "method": result.method}
    if isinstance(result, Mapping):
        return result
    return {"value": result}


def _chunks(jobs: Sequence[Job], seconds: float, least: int) -> list[Sequence[Job]]:
    """Jobs in chunks that take about ``CHUNK`` each.

    Parameters
    ----------
    jobs : number and keywords of every call
    seconds : that one call takes
    least : number of chunks to make at least, so that no worker is without
    """
    size = max(min(int(CHUNK / max(seconds, 1e-9)), -(-len(jobs) // least)), 1)
    return [jobs[k : k + size] for k in range(0, len(jobs), size)]


def _unpacked(
    executor: Any, function: Callable[..., Any], chunks: Sequence[Sequence[Job]], *,
    begun: Mapping[Future, Sequence[Job]] | None = None, at_once: int | None = None,
) -> Results:
    """Number and result of every call, chunk by chunk as these end.

    After an error no chunk begins any more. It is raised once the results of all that is under way are handed on.

    Parameters
    ----------
    executor : where to run
    function : what is called
    chunks : jobs of every chunk
    begun : chunks already under way, whose results come among the others
    at_once : chunks that are under way together, of worker processes of our own, which end where this is left early;
        None hands all of them over
    """
    left, under_way, failed = iter(chunks), dict(begun or {}), None
    ended: SimpleQueue[Future] = SimpleQueue()

    def submit(count: int | None) -> None:
        for jobs in islice(left, count):
            future = executor.submit(_chunk, function, jobs)
            under_way[future] = jobs
            future.add_done_callback(ended.put)

    try:
        for future in list(under_way):
            future.add_done_callback(ended.put)
        submit(at_once)
        while under_way:
            future = ended.get()
            if future.cancelled():
                del under_way[future]
                continue
            done: _Done = future.result()
            del under_way[future]
            if done.error is None and failed is None:
                submit(1)
            elif failed is None:
                failed, left = done.error, iter(())
                for other in list(under_way):
                    other.cancel()
            yield from done.results
        if failed is not None:
            raise failed
    except BrokenExecutor as error:
        raise ChildProcessError(_lost(under_way.values())) from error
    finally:
        if under_way and at_once is not None:
            _end(executor)
        else:
            for future in list(under_way):
                future.cancel()


def _lost(chunks: Iterable[Sequence[Job]]) -> str:
    """What to say where a worker process has ended in the middle of one of some chunks."""
    points = [in_words(point) for jobs in chunks for _, point in jobs]
    named = "; ".join(points[:_NAMED]) + (f"; and {len(points) - _NAMED} more" if len(points) > _NAMED else "")
    return (
        f"a worker process was killed, or crashed, in one of the runs under way ({named}), as happens where memory is "
        "short: runs that had ended are kept where there is a store; start again, with fewer workers, to go on"
    )


def _processes(workers: int) -> Any:
    """So many worker processes of joblib, each with one thread for linear algebra.

    They end after five minutes without work, and with this process, also where that is killed.
    """
    from joblib.externals.loky import get_reusable_executor

    return get_reusable_executor(
        max_workers=workers, timeout=_IDLE, env=dict.fromkeys(_THREADS, "1"), initializer=_end_with,
        initargs=(os.getpid(),),
    )


def _end(executor: Any) -> None:
    """End worker processes that compute for nobody: Python would wait for them when it ends.

    What they have under way fails, by which all know that the executor is no more.
    """
    # not by its shutdown, whose thread fails where a chunk was handed over a moment ago
    for process in list(getattr(executor, "_processes", None) or ()):
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGTERM)
    # the next study would be given the same executor as long as that has not noticed: it has once a call fails. The
    # chunks under way may have ended a moment before
    deadline = time.monotonic() + _ENDING
    with suppress(BrokenExecutor, TimeoutError):
        while (left := deadline - time.monotonic()) > 0.0:
            executor.submit(int).result(left)


def _end_with(parent: int) -> None:
    """End this worker process once its ``parent`` is no more, which else would go on for nobody."""

    def look() -> None:
        while os.getppid() == parent:  # an orphan has another
            time.sleep(_ORPHANED)
        os._exit(1)

    threading.Thread(target=look, daemon=True).start()


def _as_executor(executor: Any) -> Any:
    """An executor with a ``submit`` method; a dask client gives its own."""
    if hasattr(executor, "get_executor"):
        executor = executor.get_executor()  # a dask client in the form of the standard library
    if not hasattr(executor, "submit"):
        raise InputError("executor must have a submit method, as those of concurrent.futures, or be a dask client")
    return executor


def _on_executor(function: Callable[..., Any], jobs: Sequence[Job], executor: Any) -> Results:
    """Numbered results of calls on an executor, in chunks where calls are short.

    How long one takes is told by the first, for which ``PATIENCE`` is waited. Calls that take longer go one by one, as
    if each took ``CHUNK``.

    Parameters
    ----------
    function : called with the keywords of every job
    jobs : number and keywords of every call
    executor : with a ``submit`` method
    """
    if not jobs:
        return
    first = executor.submit(_chunk, function, jobs[:1])
    wait([first], timeout=PATIENCE)
    seconds = first.result().seconds if first.done() and first.exception() is None else CHUNK
    with closing(_unpacked(executor, function, _chunks(jobs[1:], seconds, _LEAST), begun={first: jobs[:1]})) as results:
        yield from results
