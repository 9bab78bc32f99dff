"""Steps of a large structure, shared by two threads."""

import threading
from collections.abc import Callable

import numpy as np

from dem import kernels
from dem.kernels import Acting, Scheme, Team
from dem.model.state import State
from limitmason.arrays import Array, Index

LARGE = 3500
"""Joints between rigid blocks from which steps are cut in two parts: with fewer the threads wait too much.

More and smaller shares have more blocks between them, whose numbers go from core to core twice a step.
"""


def shared_advance(state: State, acting: Acting, scheme: Scheme, drifts: bool | None) -> None:
    """Advance a state by :func:`dem.kernels.advance`, in two threads if it is large.

    What comes out depends on the number of joints alone: one thread adds up the same two parts.

    Parameters
    ----------
    state : changed
    acting, scheme, drifts : as :func:`dem.kernels.advance` takes them
    """
    joints, n = len(state.joints.block_a), len(state.bodies.mass)
    parts = 2 if state.modes is None and joints >= LARGE else 1
    sums, gate = state.total, np.zeros(1, dtype=np.int64)
    bodies = state.bodies
    if parts > 1:
        # where the parts leave their sums for each other, and the counter at which the threads wait for each other;
        # each part adds up the forces on blocks by itself
        sums, gate = np.empty(2 * parts * kernels.SUMS), np.zeros(kernels.SUMS, dtype=np.int64)
        bodies = bodies._replace(contact=np.empty((parts * n, 6)))

    def go(mine: int, end: int, total: Array) -> None:
        """Step as the thread that has the parts from ``mine`` to before ``end``.

        It has a ``total`` of the accumulated scalars of its own.
        """
        team = Team(mine=mine, end=end, parts=parts, sums=sums, gate=gate)
        kernels.advance(
            state.points, state.joints, bodies, total, acting, scheme, team, drifts, state.modes, state.space,
            state.ties if len(state.ties.block_a) else None,
        )

    if parts == 1 or kernels.threads_allowed() < parts:
        go(0, parts, state.total)  # one thread steps all parts
    else:
        _by_two(go, state.total, gate)
    if parts > 1:
        state.bodies.contact[:] = bodies.contact.reshape(parts, n, 6).sum(axis=0)


def _by_two(go: Callable[[int, int, Array], None], total: Array, gate: Index) -> None:
    """Step both parts of a structure at the same time, in two threads.

    An error of either ends both before the first step.

    Parameters
    ----------
    go : steps of the parts from the first argument to before the second, with accumulated scalars of their own
    total : the accumulated scalars that count, those of the first thread; each adds up the same
    gate : where the threads meet, see :func:`dem.kernels.threads.meet`
    """
    failed: list[BaseException] = []

    def second() -> None:
        """The second part, whose error is kept for the first thread."""
        try:
            go(1, 2, total.copy())
        except BaseException as error:
            failed.append(error)
            gate[0] += kernels.SHUT  # the first thread, which waits at the gate, sees that nobody comes

    # made anew each time: 0.1 ms, and a process that forks meanwhile keeps no thread that is not there
    other = threading.Thread(target=second, name="steps, second half", daemon=True)
    try:
        other.start()
        go(0, 1, total)
    finally:
        # who has come to the end passes no gate any more; an interrupt before the first step leaves the other there
        gate[0] += kernels.SHUT
        if other.ident is not None:
            other.join()
    if failed:
        raise failed[0]
