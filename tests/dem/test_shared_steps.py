"""Steps shared by two threads: the same bits as one thread's, energies, interrupts, and who may share."""

import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm
from dem import kernels
from dem.kernels import threads as kernel_threads
from dem.model import shared_steps
from dem.model.advance import run_constant
from dem.model.initial_state import initial_state


@pytest.fixture
def threads(monkeypatch):
    """Every structure counts as large; how many threads step it is set by a call."""
    monkeypatch.setattr(shared_steps, "LARGE", 1)
    return lambda count: monkeypatch.setattr(kernels, "threads_allowed", lambda: count)


def wall():
    return lm.build.wall(
        length=1.0, courses=5, unit=(0.25, 0.12, 0.1),
        joint=lm.Joint.from_friction_coefficient(0.4, normal_stiffness=1e9, shear_stiffness=4e8),
    )


def same_bits(one, two):
    return all(
        np.array_equal(a, b)
        for group in ("points", "bodies", "ties") for a, b in zip(getattr(one, group), getattr(two, group), strict=True)
    ) and np.array_equal(one.total, two.total)


@pytest.mark.parametrize(
    "damping",
    [
        dem.Damping(local=0.5), dem.Damping(kinetic=True), dem.Damping(adaptive=0.5),
        dem.Damping(local=0.8, combined=True),
    ],
)
def test_two_threads_give_the_bits_of_one(threads, damping):
    built, loads = wall(), lm.Loads.weight(wall())
    ends = []
    for count in (1, 2):
        threads(count)
        state = initial_state(built, loads)
        wrench = loads.dead.copy()
        wrench[:, 0] = 0.5 * built.weights
        for steps in (1, 2, 297):
            run_constant(state, wrench, steps, damping)
        ends.append(state)
    assert same_bits(*ends)
    assert ends[0].total[kernels.E_FRICTION] > 0.0


def test_ties_and_crossing_edges_are_stepped_by_either_thread_alike(threads):
    block = on_slab([((0, 0, 0), (1, 1, 0.5))], mu=0.3)
    tied = block.with_ties([lm.Tie("block-1", (0, 0.5, 0.0), None, (-0.5, 0.5, 0.0), yield_force=400.0, stiffness=1e6)])
    ends = []
    for count in (1, 2):
        threads(count)
        state = initial_state(tied, lm.Loads.weight(tied), contact_points=(2, 2))
        # one of the joints as if two edges crossed there
        state.joints.law[0, kernels.LAW.cross] = 1.0
        state.joints.edge[0] = state.joints.frame[0, 1]
        state.joints.limits[0] = -1.0, 1.0, -1.0, 1.0
        wrench = state.dead.copy()
        wrench[1, 0] = 0.5 * tied.weights[1]
        run_constant(state, wrench, 300, dem.Damping(local=0.5))
        ends.append(state)
    assert same_bits(*ends)
    assert ends[0].ties.plastic[0] > 0.0
    assert np.abs(ends[0].points.slip_1[0]) + np.abs(ends[0].points.slip_2[0]) > 0.0


def shaken(**more):
    t = np.arange(0.0, 0.6, 0.01)
    stages = [dem.Hold(duration=0.1, damping=dem.Damping(local=0.8)), dem.BaseMotion(
        tuple(map(tuple, np.column_stack([6.0 * np.sin(12.0 * t), np.zeros_like(t), 2.0 * np.sin(30.0 * t)]).tolist())),
        0.01, after="hold",
    )]
    return stages, {"mode": "dynamic", "sample": 0.02, "contact_points": (2, 4), **more}


def test_parts_change_the_order_of_sums_and_no_law(threads, monkeypatch):
    stages, options = shaken()
    threads(2)
    two = dem.simulate(wall(), stages, **options)
    monkeypatch.setattr(shared_steps, "LARGE", 10_000)
    one = dem.simulate(wall(), stages, **options)
    # until rounding has grown: it is shaken, and slides
    assert one["friction"][15] > 0.0
    for name in ("kinetic", "friction", "damping", "viscous", "support", "elastic"):
        assert two[name][:16] == pytest.approx(one[name][:16], rel=1e-5, abs=1e-8 * one["friction"][-1]), name
    for run in (one, two):
        flow = np.abs(np.diff(run["support"])).sum()
        assert np.abs(run.energy_error).max() < 0.01 * flow


def test_a_run_goes_on_with_another_number_of_threads_to_the_same_bits(threads, tmp_path):
    stages, options = shaken()
    threads(1)
    whole = dem.simulate(wall(), stages, **options)
    seen = []

    def cut(row):
        seen.append(row)
        return len(seen) == 12

    file = tmp_path / "run.npz"
    dem.simulate(wall(), stages, progress=cut, checkpoint=file, checkpoint_every=5, **options)
    threads(2)
    gone_on = dem.resume(dem.History.load(file, wall()), stages)
    assert len(gone_on["step"]) == len(whole["step"])
    assert same_bits(whole.state, gone_on.state)


@pytest.mark.parametrize("who", [0, 1])
def test_who_fails_before_the_first_step_leaves_the_other_nowhere_and_the_state_as_it_was(threads, monkeypatch, who):
    state = initial_state(wall(), lm.Loads.weight(wall()))
    run_constant(state, state.dead, 3, dem.Damping(local=0.5))
    before, real = state.copy(), kernels.advance

    def advance(*arguments):
        if arguments[6].mine == who:
            raise KeyboardInterrupt
        real(*arguments)

    threads(2)
    monkeypatch.setattr(kernels, "advance", advance)
    with pytest.raises(KeyboardInterrupt):
        run_constant(state, state.dead, 50, dem.Damping(local=0.5))
    assert not any(t.name.startswith("steps") for t in threading.enumerate())
    monkeypatch.setattr(kernels, "advance", real)
    for one in (state, before):
        run_constant(one, one.dead, 50, dem.Damping(local=0.5))
    assert same_bits(state, before)


def test_one_thread_in_workers_and_where_numba_has_one(monkeypatch):
    monkeypatch.setitem(vars(kernel_threads.config), "NUMBA_NUM_THREADS", 2)
    here = kernels.threads_allowed()
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(kernels.threads_allowed).result() == 1
    assert here == (2 if threading.current_thread() is threading.main_thread() else 1)
    monkeypatch.setitem(vars(kernel_threads.config), "NUMBA_NUM_THREADS", 1)
    assert kernels.threads_allowed() == 1
    # an executor says when its process dies; a pool would wait for ever for what that process had taken
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(kernels.threads_allowed).result() == 1
