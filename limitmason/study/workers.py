"""Many calls of one function: here, in worker processes where these pay, or on an executor.

Short calls in chunks.

A call that takes a millisecond costs more to hand over than to do. So calls begin in this process. When workers would
save more than it takes to start them, they start while calls go on here, and what is left then goes to them, so many
calls at a time that a chunk takes about ``CHUNK``. Where other programs take the processors already, calls stay here.
The rows of a study are the same either way.
"""

import os
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, as_completed, wait
from typing import Any

from limitmason.answers.results import Prediction
from limitmason.errors import InputError

Job = tuple[int, Mapping[str, Any]]

PATIENCE = 0.25
"""Seconds between two looks whether workers pay; on an executor, those after which a call is long."""

CHUNK = 0.5
"""Seconds that a chunk of short calls takes."""

START = 3.0
"""Seconds that workers must save to be started: starting them and importing this package takes about that."""

_MOST = 32  # chunks in which calls go to an executor of unknown size, at least
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
    """Numbered results as they come, one point of keywords each.

    An :class:`Unfinished` is handed on as a result.

    Parameters
    ----------
    executor : anything with ``submit``, or a dask client; None for processes of joblib
    workers : most processes, each with one thread for its linear algebra; 1 runs in this process, -1 is one per core
    """
    if workers < 1:
        from joblib import effective_n_jobs

        workers = effective_n_jobs(workers)
    if executor is not None:
        yield from _on_executor(function, jobs, _as_executor(executor))
    elif workers == 1 or len(jobs) < 2:
        for number, point in jobs:
            yield number, _call(function, point)
    else:
        yield from _here_and_in_workers(function, jobs, workers)


def _call(function: Callable[..., Any], point: Mapping[str, Any]) -> Any:
    try:
        return function(**point)
    except Unfinished as stopped:
        return stopped


def _chunk(function: Callable[..., Any], jobs: Sequence[Job]) -> _Done:
    """Calls in a worker: what was done before an error is not lost with it."""
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
    return _Done(results, time.perf_counter() - begun, None)


def as_row(result: Any) -> Mapping[str, Any]:
    """A result as columns of a table."""
    if isinstance(result, Prediction):
        return {"multiplier": result.collapse_multiplier, "status": result.status, "method": result.method}
    if isinstance(result, Mapping):
        return result
    return {"value": result}


def _chunks(jobs: Sequence[Job], seconds: float, least: int) -> list[Sequence[Job]]:
    """Jobs in chunks of about ``CHUNK``, where one takes ``seconds``, and in at least so many."""
    size = max(min(int(CHUNK / max(seconds, 1e-9)), -(-len(jobs) // least)), 1)
    return [jobs[k : k + size] for k in range(0, len(jobs), size)]


def _unpacked(futures: Sequence[Future]) -> Iterator[tuple[int, Any]]:
    for future in as_completed(futures):
        done: _Done = future.result()
        yield from done.results
        if done.error is not None:
            raise done.error


def _here_and_in_workers(
    function: Callable[..., Any], jobs: Sequence[Job], workers: int
) -> Iterator[tuple[int, Any]]:
    """Results of calls that begin here and go on in workers where that pays.

    A second thread looks now and then whether workers pay, and then gives them all that is left.
    """
    left = deque(jobs)
    futures: list[Future] = []
    lock, over = threading.Lock(), threading.Event()
    counted, begun, used = [0], time.perf_counter(), time.process_time()
    failed: list[Exception] = []

    def look() -> None:
        while not over.wait(PATIENCE):
            with lock:
                if not left:
                    return
                # while none has ended, a call takes at least what the first has taken so far
                elapsed = time.perf_counter() - begun
                pace = elapsed / max(counted[0], 1)
                if _crowded((time.process_time() - used) / elapsed):
                    continue
                if pace * len(left) * (1.0 - 1.0 / workers) < START:
                    continue
                most = min(workers, len(left))
            try:
                pool = _processes(most)
                # they start and import while calls go on here, which loses nothing where that takes long
                starting = [pool.submit(_chunk, function, []) for _ in range(most)]
                while wait(starting, timeout=0.2 * PATIENCE).not_done:
                    if over.is_set() or not left:
                        return
                for started in starting:
                    started.result()
                with lock:
                    rest = list(left)
                    left.clear()
                futures.extend(pool.submit(_chunk, function, part) for part in _chunks(rest, pace, 4 * workers))
            except Exception as error:  # what cannot be sent to a worker; told where the results are waited for
                with lock:
                    left.clear()
                failed.append(error)
            return

    helper = threading.Thread(target=look, daemon=True)
    helper.start()
    try:
        while True:
            with lock:
                job = left.popleft() if left else None
            if job is None:
                break
            result = _call(function, job[1])
            counted[0] += 1
            yield job[0], result
        helper.join()
        if failed:
            raise failed[0]
        yield from _unpacked(futures)
    finally:
        over.set()
        helper.join()
        for future in futures:
            future.cancel()


def _crowded(share: float) -> bool:
    """Whether other programs take the processors, so that workers would only share what this process has now.

    Parameters
    ----------
    share : processor seconds of this process in a second
    """
    if share > 0.6 or not hasattr(os, "getloadavg"):
        return False
    return os.getloadavg()[0] > (os.cpu_count() or 1) + 0.5


def _processes(workers: int) -> Any:
    from joblib.externals.loky import get_reusable_executor

    return get_reusable_executor(max_workers=workers, timeout=300, env=dict.fromkeys(_THREADS, "1"))


def _as_executor(executor: Any) -> Any:
    if hasattr(executor, "get_executor"):
        executor = executor.get_executor()  # a dask client in the form of the standard library
    if not hasattr(executor, "submit"):
        raise InputError("executor must have a submit method, as those of concurrent.futures, or be a dask client")
    return executor


def _on_executor(function: Callable[..., Any], jobs: Sequence[Job], executor: Any) -> Iterator[tuple[int, Any]]:
    """Results of calls on an executor, in chunks where the calls are short.

    The first call alone tells how long one is. Where it is not back soon, calls are long and go one by one.
    """
    if not jobs:
        return
    futures = [executor.submit(_chunk, function, jobs[:1])]
    try:
        wait(futures, timeout=PATIENCE, return_when=FIRST_COMPLETED)
        pace = CHUNK
        if futures[0].done() and futures[0].exception() is None:
            # a first call may compile and import: a second one tells
            futures.append(executor.submit(_chunk, function, jobs[1:2]))
            wait(futures[1:], timeout=PATIENCE)
            if futures[1].done() and futures[1].exception() is None:
                pace = max(futures[1].result().seconds, 1e-6)
        futures += [executor.submit(_chunk, function, part) for part in _chunks(jobs[len(futures) :], pace, _MOST)]
        yield from _unpacked(futures)
    finally:
        for future in futures:
            future.cancel()
