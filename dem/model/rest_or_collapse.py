"""A load that is held until the structure rests, or moves so far that it counts as collapsed."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from dem.model.advance import run, run_constant, without_arms
from dem.model.edge_points import follow_edges
from dem.model.state import State
from dem.model.unbalance import Scale, displacement_since, unbalance_of_blocks
from limitmason.arrays import Array
from limitmason.model import Assembly
from limitmason.model.stages import Damping

EVERY, CHECKS = 100, 4
"""Steps, about, between two checks of a load that is held, and how many in a row must find it in balance; chosen."""

UNEVEN = (0, 7, 3, 11)
"""Steps that are added in turn: checks at equal intervals could fall into step with an oscillation."""

INSTEAD = 0.6
"""Factor of the local damping that takes over where stops at peaks of the kinetic energy do not settle a load [-]."""

EARLY = 0.2
"""Part of the displacement that counts as collapse from which a motion that speeds up may be called one; chosen."""

PATIENCE = 1.5
"""Steps over those that earlier loads took to settle, from which on it may; chosen."""

CREEP = 0.02
"""Part of the displacement that counts as collapse that a block at rest may still travel in as long again; chosen."""

FADED = 0.1
"""Fall of the logarithm of the unbalanced force over a third of the time from which forces still fade; chosen."""

FEWEST = 3
"""Checks in a third, or a sixth, of a path from which its trend is told; chosen."""

STOPS = 8000
"""Steps after which stops at peaks of the kinetic energy give way to local damping, unless forces still fade.

Stops settle two to three times as fast where joints stick. Where many slip, every fast elastic peak stops the slow
slip, and they take three times as long.
"""

EXTENSIONS = 4
"""Times that a load which is still on its way to a verdict gets half as many steps again."""


class Outcome(StrEnum):
    """How holding a load ended."""

    EQUILIBRIUM = "equilibrium"
    MOVING = "moving"
    UNDECIDED = "undecided"


EQUILIBRIUM, MOVING, UNDECIDED = Outcome


@dataclass(frozen=True)
class LoadVerdict:
    """How holding a load ended.

    Parameters
    ----------
    outcome : equilibrium, moving or undecided
    steps : how many were used
    unbalance : largest unbalanced force and moment of a block at the end, over its own load (and thickness) [-]
    moved : largest displacement of a block since the load came on [m]
    block : number of the block with the largest unbalance at the end
    """

    outcome: Outcome
    steps: int
    unbalance: tuple[float, float]
    moved: float
    block: int = -1


class LoadOnset(NamedTuple):
    """How a load comes on evenly: at once it overshoots.

    Parameters
    ----------
    before : loads that it begins from, see ``Loads.rows``, shape (n, 15)
    steps : in how many it comes on
    """

    before: Array
    steps: int


def hold(
    assembly: Assembly,
    state: State,
    wrench: Array,
    scale: Scale,
    damping: Damping,
    *,
    tolerance: float,
    limit: float,
    max_steps: int,
    patience: int = 0,
    early: float | None = None,
    edges: bool = True,
    onset: LoadOnset | None = None,
) -> LoadVerdict:
    """Hold a load until the structure rests, or a block has moved too far.

    It rests where force and moment are small in several checks in a row.

    Parameters
    ----------
    assembly, state : blocks, and the state, which is changed
    wrench : loads of every block, see ``Loads.rows``, shape (n, 15)
    scale : what unbalanced forces and displacements are small against
    damping : artificial damping of the steps
    tolerance : of both unbalanced force and moment of every block, over its own load (and thickness) [-]. At this
        load a block must also stand still: what it travels while the forces are small, kept up for as long again as
        the load has been held, must stay below :data:`CREEP` times ``limit``
    limit : displacement that counts as collapse [m]
    max_steps : budget; where the unbalanced force then still fades, or the blocks speed up or will be at ``limit`` in
        time, it goes on by half as much again, up to :data:`EXTENSIONS` times; otherwise the verdict is "undecided",
        however the blocks move
    patience : steps that earlier loads took to settle; after these ``early`` is enough where the motion still speeds up
        and the unbalanced force grows. Sooner, a slow swing about a new equilibrium looks alike
    early : displacement [m], :data:`EARLY` times ``limit`` by default
    edges : let the points of joints that slide follow the edges of their faces. Held to the material of one block, a
        bearing that slides along with it bears more and more
    onset : how the load comes on; at once by default
    """
    early = EARLY * limit if early is None else early
    scale = scale.under(wrench)
    shift, quat = state.bodies.shift.copy(), state.bodies.quat.copy()
    used = 0 if onset is None else onset.steps
    # from the load before to this one, evenly
    if onset is not None and used:
        part = np.arange(1, used + 1) / used
        begun = without_arms(np.stack([onset.before, wrench]))
        run(state, begun, np.column_stack([1.0 - part, part]), damping)
    wrench = without_arms(wrench)
    # checks in a row that found balance; steps at the first of them, and the pose there; steps up to which it goes on
    quiet, since, until, extensions = 0, 0, max_steps + used, EXTENSIONS
    resting = (shift, quat)
    path: list[tuple[float, float]] = []
    while True:
        steps = EVERY + UNEVEN[len(path) % len(UNEVEN)]
        if damping.kinetic and used >= STOPS and not _fades(path):
            damping = replace(damping, local=max(damping.local, INSTEAD), kinetic=False)
        run_constant(state, wrench, steps, damping)
        if edges:
            follow_edges(assembly, state)
        used += steps
        force, moment = unbalance_of_blocks(state, scale)
        last, worst = (float(force.max()), float(moment.max())), int(np.argmax(np.maximum(force, moment)))
        moved = displacement_since(state, shift, quat, scale)
        path.append((moved, max(last)))
        if moved > limit or (used > PATIENCE * patience and moved > early and _accelerates(path)):
            return LoadVerdict(outcome=MOVING, steps=used, unbalance=last, moved=moved, block=worst)
        quiet = quiet + 1 if max(last) < tolerance else 0
        if quiet == 1:
            since, resting = used, (state.bodies.shift.copy(), state.bodies.quat.copy())
        if quiet >= CHECKS:
            # balanced forces also belong to a block that slides or turns on at a steady pace
            drift = displacement_since(state, *resting, scale) / (used - since)
            if drift * used < CREEP * limit:
                return LoadVerdict(outcome=EQUILIBRIUM, steps=used, unbalance=last, moved=moved, block=worst)
            if used >= 2 * since:
                # what crept on at first may rest since: looked at anew, from a pose of now
                quiet = 0
        if used >= until:
            left = extensions * (max_steps // 2)
            if extensions <= 0 or not (_fades(path) or _accelerates(path) or _arrives(path, used, limit, left)):
                return LoadVerdict(outcome=UNDECIDED, steps=used, unbalance=last, moved=moved, block=worst)
            extensions -= 1
            until += max_steps // 2


def _accelerates(path: list[tuple[float, float]]) -> bool:
    """Whether speed and unbalanced force grow from third to third of the last half.

    A few hundred steps say nothing: joints that slip one after the other let blocks speed up for a while on the way to
    an equilibrium that takes tens of thousands. ``path`` holds displacement [m] and unbalanced force [-] of each check.
    """
    part = len(path) // 6
    if part < FEWEST:
        return False
    # means over each third: speed as displacement between two checks, and the logarithm of the unbalanced force
    moved = np.array([p[0] for p in path[-3 * part - 1 :]])
    force = np.log([max(p[1], 1e-300) for p in path[-3 * part :]]).reshape(3, part).mean(axis=1)
    speed = np.diff(moved).reshape(3, part).mean(axis=1)
    return bool(speed[0] > 0.0 and (np.diff(speed) > 0.0).all() and (np.diff(force) > 0.0).all())


def _fades(path: list[tuple[float, float]]) -> bool:
    """Whether the unbalanced force fades.

    That of the last third of the time is a tenth lower than that of the third before.

    It is the geometric mean. ``path`` holds displacement [m] and unbalanced force [-] of each check.
    """
    part = len(path) // 3
    if part < FEWEST:
        return False
    force = np.log([max(p[1], 1e-300) for p in path[-2 * part :]]).reshape(2, part).mean(axis=1)
    return bool(force[1] < force[0] - FADED)


def _arrives(path: list[tuple[float, float]], used: int, limit: float, left: int) -> bool:
    """Whether a block will be at the limit within the steps left.

    It goes on at its mean speed of the last third of the time.

    Parameters
    ----------
    path : displacement [m] and unbalanced force [-] at each check
    used, left : steps so far, and steps that are left
    limit : displacement that counts as collapse [m]
    """
    part = len(path) // 3  # checks in ``used / 3`` steps
    if part < FEWEST:
        return False
    now, before = path[-1][0], path[-1 - part][0]
    return now + (now - before) * left * 3.0 / used > limit
