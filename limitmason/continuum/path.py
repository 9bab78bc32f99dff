"""The push-over of a solid: steps of the control displacement that grow, shrink, and break on where a crack runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitmason.continuum.equilibrium import Node, Solver
from limitmason.continuum.result import SolidCurve, curve_of
from limitmason.continuum.solid import Continuum
from limitmason.errors import InputError, NotConverged
from limitmason.model.input import read_vector
from limitmason.progress import reached, watched

Array = NDArray[np.float64]

REACHED, STOPPED, INTERRUPTED = "reached", "stopped", "interrupted"
_NEWTON = 14  # iterations of an ordinary step
_EASY = 5  # iterations up to which steps grow
_FLAT = 1.8  # longest over shortest edge of a brick from which a warning names it
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
    band: float = 1.0,
    start: SolidCurve | None = None,
    checkpoint: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> SolidCurve:
    """Push a cracking solid: dead loads first, then live ones by the displacement of a point.

    Parameters
    ----------
    model : with live loads, and materials that crack, crush or stay elastic
    control : point [m] and direction whose displacement is prescribed, shape (3,) each
    to : control displacement from the state under dead load at which to stop [m], > 0
    first, largest : first and largest step [m]; a hundredth and a thirtieth of ``to`` by default
    tolerance : norm of the unbalanced nodal forces over that of the loads [-]
    band : width over which a crack is smeared, over the cube root of a brick's volume [-]
    start : curve of the same model whose last state is gone on from
    checkpoint : file that the curve is written to after every tenth step, for :func:`load_curve` and ``start``
    progress : called with a line per step

    Returns
    -------
    SolidCurve
        ``status`` is "reached" or "stopped". Steps that no Newton iteration ends are jumps: see ``break_on``.

    Raises
    ------
    NotConverged
        When no state under dead load is found.
    InputError
        For a control or lengths that make no sense, and a start of another model.

    Notes
    -----
    Small displacements. Brittle solids snap back: at a prescribed displacement the load then falls at once, as in a
    stiff machine, and where it ends depends on what the run-through has broken. A homogeneous solid knows no joints: it
    cracks where strength is reached first, not where stones part. Energy is independent of the mesh where bricks are
    cubes: a crack across a flat brick has its thickness for a band, not the cube root of its volume. Where strain is
    the same all over, a step that crosses the strength cracks every brick at once, on a path of more energy than that
    of one crack: small steps there find the weakest brick.
    """
    begun, say = time.perf_counter(), progress or (lambda _: None)
    point, direction = read_vector("point of control", control[0]), read_vector("direction of control", control[1])
    for name, value in (("to", to), ("first", first), ("largest", largest), ("tolerance", tolerance), ("band", band)):
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be positive, got {value!r}")
    if not np.abs(model.live).max() > 0.0:
        raise InputError("no live load acts on the solid: there is nothing to push with")
    solver = Solver(model, model.functional(point, direction), tolerance, band)
    nodes = _begun(solver, model, start, say)
    origin = nodes[0].control
    step = first or to / 100.0
    longest = largest or to / 30.0
    status = REACHED
    while (left := origin + to - nodes[-1].control) > 1e-9 * to:
        last = nodes[-1]
        target = last.control + (left if left < 1.2 * step else step)
        new = _stepped(solver, nodes, target, say)
        if new is None:
            status = STOPPED
            break
        nodes = _forget([*nodes, new])
        if new.jump or new.iterations <= _EASY:
            step = min(1.5 * step, longest)
        else:
            step *= 0.7
        reached((new.control - origin) / to, f"{1e3 * (new.control - origin):.3g} mm")
        load = new.multiplier * float(np.linalg.norm(model.live.sum(axis=0)))
        say(
            f"{1e3 * (new.control - origin):.4g} mm, {load / 1e3:.4g} kN, {new.iterations} iterations, unbalanced "
            f"{new.residual:.0e}{', jump' if new.jump else ''}, {time.perf_counter() - begun:.0f} s"
        )
        if checkpoint is not None and len(nodes) % 10 == 0:
            curve_of(model, nodes, (point, direction), tolerance, INTERRUPTED, (), band).save(checkpoint)
    warnings: tuple[str, ...] = _flat_bricks(model)
    if status == STOPPED:
        end = 1e3 * (nodes[-1].control - origin)
        warnings = (*warnings, f"the path stops at {end:.4g} mm: no state beyond was found")
    curve = curve_of(model, nodes, (point, direction), tolerance, status, warnings, band)
    if checkpoint is not None:
        curve.save(checkpoint)
    say(f"{status} after {len(nodes) - 1} steps, {solver.factorisations} factors, {time.perf_counter() - begun:.0f} s")
    return curve


def _flat_bricks(model: Continuum) -> tuple[str, ...]:
    corners = model.mesh.corners
    edges = corners.max(axis=1) - corners.min(axis=1)
    aspect = float((edges.max(axis=1) / edges.min(axis=1)).max())
    if aspect < _FLAT or all(m.elastic for m in model.materials):
        return ()
    return (f"bricks are up to {aspect:.2g} times as long as wide: a crack's energy depends on how it crosses them",)


def _begun(solver: Solver, model: Continuum, start: SolidCurve | None, say: Callable[[str], None]) -> list[Node]:
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
    loads = (float(np.abs(last.displacement[model.held.ravel()]).max(initial=0.0)),)
    now = solver.answer(last.displacement, last.memory)
    off = float(np.linalg.norm(solver.unbalanced(now, last.multiplier))) / solver.size(last.multiplier)
    if loads[0] > 0.0 or off > 10.0 * max(last.residual, solver.tolerance):
        raise InputError("start is a curve of other loads or materials: its last state is not in equilibrium here")
    return list(start.nodes)


def _stepped(solver: Solver, nodes: list[Node], target: float, say: Callable[[str], None]) -> Node | None:
    """The next state: Newton from the extrapolated path, then from the last state, then breaking on."""
    last = nodes[-1]
    if len(nodes) > 1:
        before = nodes[-2]
        share = (target - last.control) / (last.control - before.control)
        guess = last.displacement + share * (last.displacement - before.displacement)
        factor = last.multiplier + share * (last.multiplier - before.multiplier)
    else:
        guess, factor = last.displacement, last.multiplier
    new = solver.solve(last, guess, factor, target, _NEWTON)
    if new is not None:
        return new
    # half the step tells a large step from a path that breaks off
    middle = solver.solve(last, last.displacement, last.multiplier, 0.5 * (last.control + target), _NEWTON)
    if middle is not None:
        return middle
    return solver.break_on(last, target, _BREAK, say)


def _forget(nodes: list[Node]) -> list[Node]:
    """Drop memory and stresses of all but the first, the largest load and the last: they are most of the storage."""
    top = int(np.argmax([n.multiplier for n in nodes]))
    return [
        n if i in (top, len(nodes) - 1) or n.stress is None else n._replace(memory=None, stress=None, crack=None)
        for i, n in enumerate(nodes)
    ]
