"""The push-over of a solid: steps of the control displacement that grow, shrink, and break on where a crack runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import instance, listener, positive
from limitmason.continuum.equilibrium import NEWTON, EquilibriumState, Solver
from limitmason.continuum.first_to_crack import EqualBricks
from limitmason.continuum.result import INTERRUPTED, REACHED, STOPPED, SolidCurve, curve_of
from limitmason.continuum.solid import Continuum
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError, NotConverged
from limitmason.model.input import read_vector
from limitmason.storage.files import named_path

# numbers that steer the steps are chosen: they change where samples lie and how long a path takes
_EASY = 5  # iterations up to which steps grow
_GROWN = 1.5  # times as long as the step before
_SHRUNK = 0.7  # of the step before, where that took more iterations
_LAST = 1.2  # steps: what is left of the way is not cut into one of them and a rest below a fifth
_FAILED = 0.25  # part of a step that is tried where no Newton iteration ends it
_FAILS = 3  # steps cut for that before a path is taken to break off
_IDLE = 0.01  # of the energy so far: least that the error of a step is measured by
_CUT_LEAST = 0.1  # least part of a step that its energy error cuts it to
_CUT_MOST = 0.7  # most part of it: a step cut by less would miss as much
_CUT_AGAIN = 0.25  # most part where a cut before has not helped
_AS_MUCH = 0.8  # of the error of the longer step: a cut that leaves more has not helped
_NO_HELP = 2  # such cuts one after another, after which the longest of their steps is taken
_CUTS = 256  # first step over the shortest one
_ARRIVED = 1e-9  # of the way: what is left of it is rounding
_OTHER = 10.0  # times the residual of a state from which it is taken to be of another model
_BREAK = 400  # secant iterations of a jump


@watched("push of a solid")
def push(
    model: Continuum,
    *,
    control: tuple[ArrayLike, ArrayLike],
    to: float,
    first: float | None = None,
    largest: float | None = None,
    tolerance: float = 1e-3,
    energy_error: float = 5e-3,
    band: float = 1.0,
    start: SolidCurve | None = None,
    checkpoint: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> SolidCurve:
    """Push a cracking solid.

    Dead loads first, then live ones by the displacement of a point.

    Parameters
    ----------
    model : with live loads, and materials that crack, crush or stay elastic
    control : point [m] and direction whose displacement is prescribed, shape (3,) each
    to : control displacement from the state under dead load at which to stop [m], > 0
    first, largest : first and largest step [m]; a hundredth and a thirtieth of ``to`` by default, and no first one
        above a largest that is given. The last one may be a fifth longer
    tolerance : norm of the unbalanced nodal forces over that of the loads [-]
    energy_error : most energy that a straight line over a step may miss, over the work of the step [-]; steps are cut
        for it, down to a 256th of the first; not below three times ``tolerance``, which leaves as much
    band : width over which a crack is smeared, over the cube root of a brick's volume [-]
    start : curve of the same model whose last state is gone on from
    checkpoint : file that the curve is written to after every tenth step, for :func:`load_curve` and ``start``
    progress : called with a line per step

    Returns
    -------
    SolidCurve
        ``status`` is "reached" or "stopped". Steps that no Newton iteration ends are jumps: see ``past_instability``.

    Raises
    ------
    NotConverged
        When no state under dead load is found.
    InputError
        For a control or lengths that make no sense, live loads that do not move the control, a start of another model
        or control, and a checkpoint that a run from the beginning would write over.

    Notes
    -----
    Small displacements. Brittle solids snap back: at a prescribed displacement the load then falls at once, as in a
    stiff machine, and where it ends depends on what the run-through has broken. A homogeneous solid knows no joints: it
    cracks where strength is reached first, not where stones part. Energy is independent of the mesh where bricks are
    cubes: a crack across a flat brick has its thickness for a band, not the cube root of its volume. Of a row of
    bricks that one step would crack together one cracks, and a bar takes the energy of one crack, see
    :class:`limitmason.continuum.first_to_crack.EqualBricks`. Where bricks of a row must begin together, as in the
    middle of a beam, they go on together, on a path of more energy, and rows of points of a brick of 20 nodes may crack
    alone, with less. The curve warns where its cracks took 3 % more or less than single ones of their openings would,
    see :class:`limitmason.continuum.excess_crack_energy.CrackEnergy`.
    """
    begun, say = time.perf_counter(), listener("progress", progress, "a line of text") or (lambda _: None)
    instance("model", model, Continuum)
    if not isinstance(control, tuple | list) or len(control) != 2:
        raise InputError(f"control must be a point [m] and a direction, got {control!r}")
    point, direction = read_vector("point of control", control[0]), read_vector("direction of control", control[1])
    positive("to", to)
    given = {"first": first, "largest": largest, "tolerance": tolerance, "energy_error": energy_error}
    for name, value in (*given.items(), ("band", band)):
        if value is not None:
            positive(name, value)
    if checkpoint is not None and start is None:
        _check_free(checkpoint)
    if first is not None and largest is not None and first > largest:
        raise InputError(f"first must not be above largest, got {first!r} and {largest!r} [m]")
    if not np.abs(model.live).max() > 0.0:
        raise InputError("no live load acts on the solid: there is nothing to push with")
    solver = Solver(model, model.functional(point, direction), tolerance, band)
    if not (model.functional(point, direction)[~model.held.ravel()] != 0.0).any():
        raise InputError(f"control: the point {tuple(point.tolist())} is held, it does not move")
    if start is not None:
        _same_control(instance("start", start, SolidCurve), point, direction)
    nodes = _begun(solver, model, start, say)
    origin = nodes[0].control  # control displacement under the dead load
    step = first or min(to / 100.0, largest or to)
    longest = largest or to / 30.0
    # shortest step, and energy that a step may miss over its work
    least, budget = min(step, longest) / _CUTS, max(energy_error, 3.0 * tolerance)
    status, equal = REACHED, EqualBricks(solver)
    while (left := origin + to - nodes[-1].control) > _ARRIVED * to:
        last = nodes[-1]
        solver.largest = max(abs(n.multiplier) for n in nodes)
        target = last.control + (left if left < _LAST * step else step)
        new = equal.stepped(partial(_stepped, solver, nodes, target, least, budget, say), last)
        if new is None:
            if len(nodes) == 1 and not solver.drives(last):
                raise InputError(
                    f"control: the live load does not move the point {tuple(point.tolist())} along "
                    f"{tuple(direction.tolist())}: give a direction in which it does"
                )
            status = STOPPED
            break
        nodes = _forget([*nodes, new])
        # from the length that was taken: behind a jump, or where few iterations did, the next one may be longer
        step = min(max(new.control - last.control, least), step)
        step = min(step * (_GROWN if new.jump or new.iterations <= _EASY else _SHRUNK), longest)
        reached((new.control - origin) / to, f"{1e3 * (new.control - origin):.3g} mm")
        load = new.multiplier * float(np.linalg.norm(model.live.sum(axis=0)))
        say(
            f"{1e3 * (new.control - origin):.4g} mm, {load / 1e3:.4g} kN, {new.iterations} iterations, unbalanced "
            f"{new.residual:.0e}{', jump' if new.jump else ''}, {time.perf_counter() - begun:.0f} s"
        )
        if checkpoint is not None and len(nodes) % 10 == 0:
            curve_of(model, nodes, (point, direction), tolerance, INTERRUPTED, band).save(checkpoint)
    curve = curve_of(model, nodes, (point, direction), tolerance, status, band)
    if checkpoint is not None:
        curve.save(checkpoint)
    say(f"{status} after {len(nodes) - 1} steps, {solver.factorisations} factors, {time.perf_counter() - begun:.0f} s")
    return curve


def _check_free(checkpoint: str | Path) -> None:
    """Refuse a checkpoint that a run from the beginning would write over."""
    if named_path(checkpoint).exists():
        raise InputError(
            f"{checkpoint} is there already and would be lost: go on with "
            f"start=load_curve({str(checkpoint)!r}, model), delete it to begin anew, or give another file"
        )


def _same_control(start: SolidCurve, point: Array, direction: Array) -> None:
    """Refuse a curve whose displacement is that of another point or direction than the one to go on with."""
    at, along = start.control
    same = np.allclose(at, point, rtol=0.0, atol=_ARRIVED * float(np.ptp(start.model.mesh.nodes)))
    if not same or not np.allclose(along / np.linalg.norm(along), direction / np.linalg.norm(direction)):
        raise InputError(
            f"start is a curve of the point {tuple(at.tolist())} along {tuple(along.tolist())}: give it as control"
        )


def _begun(
    solver: Solver, model: Continuum, start: SolidCurve | None, say: Callable[[str], None]
) -> list[EquilibriumState]:
    """States to go on from: that under dead load, or those of a curve of the same model.

    A curve is of this model if it has as many integration points. Its last state must be in equilibrium under these
    loads, with no held unknown [m] moved: a moved one would mean that a support had been driven.

    Parameters
    ----------
    solver : of the path
    model : the solid
    start : curve to go on from, None to begin with the dead load
    say : called with a line per part of the dead load
    """
    if start is None:
        first = solver.dead_load(say)
        if first is None:
            raise NotConverged(
                "no state under dead load was found: the solid cannot carry it; see where by solve_elastic"
            )
        return [first]
    last = start.nodes[-1] if start.nodes else None
    if last is None or last.memory is None or len(last.memory.lost) != len(solver.curves.modulus):
        raise InputError("start is a curve of another model: nodes and integration points must be the same")
    moved = float(np.abs(last.displacement[model.held.ravel()]).max(initial=0.0))
    now = solver.answer(last.displacement, last.memory)
    off = float(np.linalg.norm(solver.unbalanced(now, last.multiplier))) / solver.size(last.multiplier)
    if moved > 0.0 or off > _OTHER * max(last.residual, solver.tolerance):
        raise InputError("start is a curve of other loads or materials: its last state is not in equilibrium here")
    return list(start.nodes)


def _stepped(
    solver: Solver, nodes: list[EquilibriumState], target: float, least: float, budget: float,
    say: Callable[[str], None],
) -> EquilibriumState | None:
    """The next state: Newton from the extrapolated path, in shorter steps until its energy holds, else breaking on.

    A step that runs past the strength of a brick finds states where its neighbours crack too, or one row of points of
    the brick alone: both are in equilibrium, with more or less energy than one crack. The energy that a straight line
    between both ends of the step misses tells: cut until that is small, the step ends just past the strength.
    Where cutting leaves as much of it, the step is taken whole.

    Parameters
    ----------
    solver : of the path
    nodes : states so far
    target : control displacement of the whole step [m]
    least : shortest step [m]
    budget : energy that a step may miss, over its work [-]
    say : called with a line where a crack breaks on
    """
    last, failed = nodes[-1], 0
    longest: EquilibriumState | None = None  # the state by the first of the steps that miss as much as each other
    missed, same = np.inf, 0  # error of the step before, and how many cuts in a row have not lowered it
    while True:
        length = target - last.control
        guess, factor = last.displacement, last.multiplier
        if len(nodes) > 1:  # along the line through the two states before
            before = nodes[-2]
            share = length / (last.control - before.control)
            guess = last.displacement + share * (last.displacement - before.displacement)
            factor = last.multiplier + share * (last.multiplier - before.multiplier)
        new = solver.solve(last, guess, factor, target, NEWTON)
        if new is None:
            failed += 1
            # behind a jump the cracks still run: a shorter step would only find the same state again
            if length <= least or failed == _FAILS or last.jump:
                return solver.past_instability(last, target, _BREAK, say)
            cut = _FAILED
        else:
            error = _energy_missed(solver, nodes[0], last, new)
            if error <= budget:
                return new
            # an error that stays as it is in steps ever shorter is none of the step's: cracks that turn have it
            same = same + 1 if error > _AS_MUCH * missed else 0
            longest, missed = (longest if same and longest is not None else new), error
            if same == _NO_HELP or length <= least:
                return longest
            cut = min(max(budget / error, _CUT_LEAST), _CUT_AGAIN if same else _CUT_MOST)
        target = last.control + max(cut * length, least)


def _energy_missed(solver: Solver, begun: EquilibriumState, last: EquilibriumState, new: EquilibriumState) -> float:
    """Energy that the straight line from state to state misses, over the work of the step [-].

    A step that does next to no work is measured by a hundredth of the energy taken so far, with what dead load lost.
    Cracks that turn make an error at any length of step, and in a solid that dead load has cracked the first steps are
    nearly all that.

    Parameters
    ----------
    solver : of the path, which has the loads
    begun : first state of the path
    last, new : states before and behind the step
    """
    travel = new.displacement - last.displacement
    live, dead = 0.5 * (last.multiplier + new.multiplier) * float(travel @ solver.live), float(travel @ solver.dead)
    taken = new.stored + new.lost - last.stored - last.lost
    so_far = abs(new.stored - begun.stored) + new.lost
    return abs(live + dead - taken) / max(abs(live) + abs(dead), _IDLE * abs(so_far), 1e-300)


def _forget(nodes: list[EquilibriumState]) -> list[EquilibriumState]:
    """Drop memory and stresses of all but the largest load and the last: they are most of the storage."""
    top = int(np.argmax([n.multiplier for n in nodes]))
    return [
        n if i in (top, len(nodes) - 1) or n.stress is None else n._replace(memory=None, stress=None, crack=None)
        for i, n in enumerate(nodes)
    ]
