"""Where a path begins: in the state under dead load, or in the last state of a curve of the same model."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from limitmason.capacity import breaking, step_equilibrium
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.path_state import Structure
from limitmason.capacity.result import PushoverCurve
from limitmason.capacity.step_equilibrium import Node
from limitmason.errors import InputError, NotApplicable
from limitmason.model.fingerprint import check_same_loads

_SAME = 1e-9
"""Part of a block's size, or of a number, that rounding may change [-]."""

_SAME_SPRINGS = 1e-6
"""Part of a shape's stiffness that rounding may change, as it comes from singular values [-]."""


def begin(
    new: Generations, start: PushoverCurve | None, say: Callable[[str], None], held: float | None, ratio: float
) -> tuple[Generations, list[Node], Pose]:
    """The generations to go on with, the first node, and the pose under dead load from which displacements count.

    The list of nodes is empty where the structure does not stand under its dead load.

    Parameters
    ----------
    new : contacts and equations of the structure as built
    start : curve whose last state is gone on from; None for the state under dead load
    say : called with a line of text on what is done
    held : control displacement that is kept under dead load [m]; None where it is free
    ratio : work of the live load per control displacement [N]

    Raises
    ------
    InputError
        For a start of another model; the message names what differs.
    NotApplicable
        For a start with other live loads in its last state.
    """
    now = new.structures[0]
    if start is None:
        # the state under dead load, and what breaks at once by it
        first = step_equilibrium.dead_load(new.systems[0], held, ratio)
        if first is None:
            return new, [], new.systems[0].at_rest()
        say(f"dead load: {first.programs} programs, {first.iterations} iterations of Newton")
        system = new.systems[0]
        if breaking.brittle(system):
            over = breaking.overload_of(system, system.virgin(), first)
            if len(rows := breaking.worst_of(over)):
                say(f"joints break under the dead load, {len(rows)} points first")
                broken = breaking.released(system, first, rows, ratio, held)
                if broken is None:
                    return new, [], system.at_rest()
                first = broken._replace(jump=False)
        return new, [first._replace(looked=system.at_rest())], first.pose
    if not start.nodes:
        raise InputError("start is a curve without states: there is nothing to go on from")
    before = start.generations.structures[0]
    model = now.assembly
    model.fingerprint.check_same(before.assembly.fingerprint, "start")
    check_same_loads("dead", now.loads.rows("dead"), before.loads.rows("dead"), [b.name for b in model.blocks], "start")
    if differs := _difference(before, now):
        raise InputError(f"start is a curve of another model: {differs}; a state goes on under its own model only")
    old, live = before.loads.rows("live"), now.loads.rows("live")
    factor = float((old * live).sum() / (live * live).sum())
    last = start.nodes[-1]
    # a state under dead load alone, as of to=0, bears no live load that could differ
    if last.multiplier and not np.allclose(old, factor * live, rtol=0.0, atol=_SAME * np.abs(old).max()):
        raise NotApplicable("start: the live load may change by a factor only; other live loads are not followed")
    # the live load of the old path is ``factor`` times that of the new one, in which the multiplier is to count
    generations = Generations(new.shapes, new.make, [s._replace(loads=now.loads) for s in start.generations.structures])
    first = last._replace(
        multiplier=factor * last.multiplier, control=new.systems[0].controlled(last.pose), programs=0, iterations=0,
        jump=False,
    )
    assert start.origin is not None
    return generations, [first], start.origin


def _difference(one: Structure, other: Structure) -> str:
    """Words for the first setting in which two paths on one model differ, or "".

    Live loads may differ.

    ``one`` is the structure of the path gone on from, ``other`` that of this path.
    """
    p, q = one.points, other.points
    if p.place_a.shape != q.place_a.shape or not np.allclose(p.place_a, q.place_a, rtol=0.0, atol=_SAME * one.size):
        return f"its {p.count} contact points are not the {q.count} of this one: repeat contact_model, grid and gaps"
    for name, mine, theirs in (("kn", p.kn, q.kn), ("ks", p.ks, q.ks)):
        if not np.allclose(mine, theirs, rtol=_SAME):
            return f"{name} of its joints is {mine[0]:.6g} Pa/m, here {theirs[0]:.6g} Pa/m"
    # of blocks that deform; rigid ones have none
    springs, here = (np.zeros(0) if x.deformation is None else x.deformation.stiffness for x in (one, other))
    if springs.shape != here.shape or not np.allclose(springs, here, rtol=_SAME_SPRINGS):
        return "its blocks deform in another way: repeat blocks and stress"
    return ""
