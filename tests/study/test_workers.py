"""Many calls: here while they are short, in workers where these pay, in chunks, with the same rows every way."""

import os
import pickle
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

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
