"""Many calls of one function: here, in worker processes where these pay, or on an executor, in chunks where short.

A call that takes a millisecond costs more to hand over than to do. So calls begin in this process. Once workers save
more than it takes to start them, what is left goes to them, so many calls at a time that a chunk takes about ``CHUNK``.
The rows of a study are the same either way.
"""

import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, as_completed, wait
from numbers import Integral
from typing import Any

from limitmason.answers.results import Prediction
from limitmason.errors import InputError
from limitmason.storage.interrupts import handed_on

Job = tuple[int, Mapping[str, Any]]

PATIENCE = 0.25
"""Seconds after which a call on an executor is long."""

CHUNK = 0.5
"""Seconds that a chunk of short calls takes."""

START = 3.0
"""Seconds that workers must save to be started: starting them and importing this package takes about that."""

_LEAST = 32  # chunks in which calls go to an executor of unknown size, at least; chosen
_EACH = 4  # chunks for every worker, at least: one that is done early takes another; chosen
_IDLE = 300  # seconds without work after which worker processes end; chosen
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
) -> Iterator[tuple[int, Any]]:
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
            pool = _processes(min(workers, left))
            yield from _unpacked(pool, function, _chunks(jobs[done:], spent / done, _EACH * workers))
            return
        begun = time.perf_counter()
        result = _call(function, point)
        spent += time.perf_counter() - begun
        yield number, result


def _call(function: Callable[..., Any], point: Mapping[str, Any]) -> Any:
    """Result of one call, or the :class:`Unfinished` that it ended with."""
    try:
        with handed_on():
            return function(**point)
    except Unfinished as stopped:
        return stopped


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
    executor: Any, function: Callable[..., Any], chunks: Sequence[Sequence[Job]], begun: Sequence[Future] = ()
) -> Iterator[tuple[int, Any]]:
    """Number and result of every call, chunk by chunk as these end.

    An error is raised once the results before it are handed on, and what has not begun is then called off.

    Parameters
    ----------
    executor : where to run
    function : what is called
    chunks : jobs of every chunk
    begun : chunks already under way, whose results come among the others
    """
    futures = [*begun, *(executor.submit(_chunk, function, part) for part in chunks)]
    try:
        for future in as_completed(futures):
            done: _Done = future.result()
            yield from done.results
            if done.error is not None:
                raise done.error
    finally:
        for future in futures:
            future.cancel()


def _processes(workers: int) -> Any:
    """So many worker processes of joblib, each with one thread for linear algebra.

    They end after five minutes without work.
    """
    from joblib.externals.loky import get_reusable_executor

    return get_reusable_executor(max_workers=workers, timeout=_IDLE, env=dict.fromkeys(_THREADS, "1"))


def _as_executor(executor: Any) -> Any:
    """An executor with a ``submit`` method; a dask client gives its own."""
    if hasattr(executor, "get_executor"):
        executor = executor.get_executor()  # a dask client in the form of the standard library
    if not hasattr(executor, "submit"):
        raise InputError("executor must have a submit method, as those of concurrent.futures, or be a dask client")
    return executor


def _on_executor(function: Callable[..., Any], jobs: Sequence[Job], executor: Any) -> Iterator[tuple[int, Any]]:
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
    yield from _unpacked(executor, function, _chunks(jobs[1:], seconds, _LEAST), begun=[first])
