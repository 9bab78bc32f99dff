"""Many calls: here while they are short, in workers where these pay, in chunks, with the same rows every way."""

import os
import pickle
import subprocess
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import islice

import pytest
from processes import LONGEST, ended, ready, said, together

from limitmason import study
from limitmason.study import workers
from limitmason.study.workers import Unfinished, run_points


def points(n):
    return [(k, {"x": k}) for k in range(n)]


def square(x):
    return x * x


def slow(x):
    time.sleep(0.02)
    return x * x, os.getpid()


def fails_at_five(x):
    if x == 5:
        raise RuntimeError("five")
    return x


def tired(x):
    if x % 2:
        raise Unfinished
    return x


class Counting:
    """An executor that runs at once and counts what it is given."""

    def __init__(self):
        self.given = 0

    def submit(self, function, *arguments):
        self.given += 1
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.fixture
def soon(monkeypatch):
    """Workers are taken after the first call."""
    monkeypatch.setattr(workers, "START", 0.0)


def test_short_calls_stay_here_and_start_no_worker(monkeypatch):
    monkeypatch.setattr(workers, "_processes", lambda n: pytest.fail("short calls started workers"))
    assert dict(run_points(square, points(5000), None, 2)) == {k: k * k for k in range(5000)}


@pytest.mark.slow
def test_long_calls_go_to_workers_in_chunks(soon, monkeypatch):
    given = []

    def pool(n):
        executor = ThreadPoolExecutor(n)
        submit = executor.submit
        executor.submit = lambda function, call, jobs: given.append(len(jobs)) or submit(function, call, jobs)
        return executor

    monkeypatch.setattr(workers, "_processes", pool)
    found = dict(run_points(slow, points(60), None, 2))
    assert {k: v[0] for k, v in found.items()} == {k: k * k for k in range(60)}
    assert sum(given) >= 50
    assert 4 <= len(given) <= 10, "at least four chunks for each worker, so that none waits long for the last"


@pytest.mark.slow
def test_real_workers_are_other_processes_and_give_the_same(soon):
    elsewhere = {}
    for number, (value, process) in run_points(slow, points(5000), None, 2):
        if process != os.getpid():  # the first is done here
            elsewhere[number] = value
        if len(elsewhere) == 20:
            break
    assert elsewhere == {k: k * k for k in elsewhere}
    assert len(elsewhere) == 20


def test_what_was_done_before_an_error_is_not_lost():
    done = workers._chunk(fails_at_five, points(9))
    assert [k for k, _ in done.results] == [0, 1, 2, 3, 4]
    assert "in fails_at_five" in "".join(done.error.__notes__)


@pytest.mark.parametrize("executor, most", [(None, 1), (None, 2), (Counting(), 1)])
def test_an_error_comes_through_after_the_results_before_it(executor, most, soon, monkeypatch):
    monkeypatch.setattr(workers, "_processes", ThreadPoolExecutor)
    results = run_points(fails_at_five, points(9), executor, most)
    got = set()

    def go_on():
        for number, _ in results:
            got.add(number)

    with pytest.raises(RuntimeError, match="five"):
        go_on()
    assert 5 not in got
    assert got == {0, 1, 2, 3, 4} or executor is not None or most == 2  # others come in any order


def test_an_executor_gets_few_chunks_of_short_calls():
    executor = Counting()
    assert dict(run_points(square, points(3000), executor, 1)) == {k: k * k for k in range(3000)}
    assert executor.given <= 1 + workers._LEAST


def test_an_executor_gets_long_calls_one_by_one(monkeypatch):
    monkeypatch.setattr(workers, "PATIENCE", 0.001)
    with ThreadPoolExecutor(2) as executor:
        found = dict(run_points(slow, points(12), executor, 1))
    assert len(found) == 12


def test_unfinished_runs_are_handed_on(soon, monkeypatch):
    monkeypatch.setattr(workers, "_processes", ThreadPoolExecutor)
    for executor, workers_ in ((None, 1), (None, 2), (Counting(), 1)):
        found = dict(run_points(tired, points(6), executor, workers_))
        assert [isinstance(found[k], Unfinished) for k in range(6)] == [False, True] * 3


@pytest.mark.slow
def test_a_function_that_cannot_be_sent_is_told(soon):
    lock = threading.Lock()

    def held(x):
        with lock:
            time.sleep(0.05)
        return x

    with pytest.raises((TypeError, pickle.PicklingError), match="pickle"):
        list(run_points(held, points(20), None, 2))


def test_a_study_left_early_leaves_no_thread_behind(soon, monkeypatch):
    monkeypatch.setattr(workers, "_processes", ThreadPoolExecutor)
    before = threading.active_count()
    results = run_points(slow, points(50), None, 2)
    next(results)
    results.close()
    assert threading.active_count() <= before + 2  # the threads of the pool alone


def test_tables_are_equal_with_and_without_workers(soon):
    alone = study.sweep(square, {"x": range(30)})
    assert study.sweep(square, {"x": range(30)}, workers=2) == alone
    assert study.sweep(square, {"x": range(30)}, executor=Counting()) == alone
    assert study.sweep(square, {"x": range(30)}, workers=-1) == alone


def late(x):
    """Of two calls at once one fails, and the other ends after that."""
    if x == 2:
        time.sleep(0.05)
        raise RuntimeError("two")
    time.sleep(0.2 if x == 1 else 0.0)
    return x


def test_what_is_under_way_when_a_run_fails_is_kept_and_the_error_names_the_point(soon, monkeypatch):
    """An hour's run beside the one that failed was computed to its end, and then thrown away."""
    monkeypatch.setattr(workers, "_processes", ThreadPoolExecutor)
    monkeypatch.setattr(workers, "CHUNK", 0.0)
    got = []
    with pytest.raises(RuntimeError, match="two") as raised:
        got.extend(run_points(late, points(40), None, 2))
    assert got == [(0, 0), (1, 1)]
    assert raised.value.__notes__[0] == "at x = 2"
    with pytest.raises(RuntimeError) as raised:
        list(run_points(late, points(3), None, 1))
    assert raised.value.__notes__ == ["at x = 2"]


class Lost:
    """An executor whose first worker process is killed."""

    def submit(self, *_):
        future = Future()
        future.set_exception(BrokenProcessPool("a process was terminated abruptly"))
        return future


def test_a_worker_that_was_killed_is_told_with_the_points_that_it_may_have_died_of(soon, monkeypatch):
    monkeypatch.setattr(workers, "_processes", lambda n: Lost())
    monkeypatch.setattr(workers, "CHUNK", 0.0)
    with pytest.raises(ChildProcessError, match=r"killed, .* \(x = 1; x = 2\).* are kept .* fewer workers"):
        list(run_points(square, points(30), None, 2))


def idle(pipe):
    """A worker process of a process that waits to be killed."""
    ready(pipe)
    parent = os.getpid()
    if os.fork() == 0:
        workers._end_with(parent)
        pipe.send("works")
        time.sleep(LONGEST)
    pipe.close()
    time.sleep(LONGEST)


def test_worker_processes_end_with_a_process_that_is_killed():
    """They went on computing for nobody, and then waited five minutes."""
    [parent], [pipe] = together(idle, [()])
    assert said(pipe) == "works"
    parent.kill()
    ended(parent)
    assert said(pipe) is None  # nobody holds its other end any more


class Working:
    """An executor with a worker process that comes to no end."""

    def __init__(self):
        self.process = subprocess.Popen(["sleep", str(LONGEST)])
        self._processes = {self.process.pid: self.process}
        self.given = 0

    def submit(self, function, *arguments):
        self.given += 1
        future = Future()
        if self.given == 1:
            future.set_result(function(*arguments))
        return future


def test_a_study_that_is_interrupted_ends_its_worker_processes(soon, monkeypatch):
    """Ctrl-C waited for the calls under way and those handed over, and threw their results away."""
    monkeypatch.setattr(workers, "_processes", lambda n: Working.made.append(Working()) or Working.made[0])
    monkeypatch.setattr(workers, "_ENDING", 0.0)
    Working.made = []
    results = run_points(square, points(30), None, 2)
    assert [number for number, _ in islice(results, 3)] == [0, 1, 2]
    [pool] = Working.made
    assert pool.given == 3, "no more than two chunks at once"
    with pytest.raises(KeyboardInterrupt):
        results.throw(KeyboardInterrupt())
    assert pool.process.wait(LONGEST) != 0


class NoticesLate(Counting):
    """An executor that notices at the fifth call that its worker processes were killed."""

    def submit(self, function, *arguments):
        if self.given == 4:
            raise BrokenProcessPool("no process is left")
        return super().submit(function, *arguments)


def test_the_next_study_is_not_given_worker_processes_that_are_ending(soon, monkeypatch):
    """All chunks under way had ended: a study right after one that was left early now and then lost its workers."""
    pool = NoticesLate()
    monkeypatch.setattr(workers, "_processes", lambda n: pool)
    results = run_points(square, points(30), None, 2)
    assert [number for number, _ in islice(results, 2)] == [0, 1]
    results.close()
    with pytest.raises(BrokenProcessPool):
        pool.submit(square, 1)
