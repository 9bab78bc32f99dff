"""Sequential scheme for psi < phi: programs with cones frozen at the last forces."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, excess, split

USABLE = ("Solved", "AlmostSolved", "InsufficientProgress")
"""Solver endings whose iterate is worth polishing: the true law is checked afterwards in any case."""


PROGRESS = 0.9
"""Violation of the true law over the least so far below which a step counts as progress [-]: chosen."""

MOST_STEPS, RESTARTS, PATIENCE = 40, 6, 8
"""Steps of one attempt, attempts after the first, and steps without progress, at most: chosen.

A failing step halves a and raises c0 tenfold in turn, and the attempt begins again.
"""

SETTLED = 1e-6
"""Largest change of a normal force over the total load at which the sequence has settled [-]."""

TOLERANCE = 1e-10
"""Of the programs of the scheme [-], whose ends are polished afterwards."""


class SchemeSettings(NamedTuple):
    """Settings of the sequential scheme, a, b and c0 of :func:`run_sequence`."""

    slope: float = 0.005  # a, the frozen cone rises by tan(psi) - a tan(phi) [-]
    mixing: float = 0.6  # b, share of the new normal forces in the next step [-]
    offset: float = 1e-5  # c0, added to every constant, over the largest normal force [-]

    def __str__(self) -> str:
        """The settings in words."""
        return f"a = {self.slope:.3g}, b = {self.mixing:.3g}, c0 = {self.offset:.1g}"


class SchemeRun(NamedTuple):
    """Where a run of the scheme ended.

    ``state`` is None when even the first program failed.
    """

    state: ForceState | None
    steps: int  # programs solved
    excess: float  # of the last forces over the true law, relative to the total load


def run_sequence(law: JointLaw, start: Array, variant: SchemeSettings, deadline: Deadline = NEVER) -> SchemeRun:
    """Sequence of cone programs that tends to a state of the non-associative law.

    Step k maximises lambda with |T| <= c_k + (tan psi - a tan phi) N',
    c_k = c' + (tan phi - tan psi + a tan phi) N_k + c0 max N_k, then N_k <- b N' + (1 - b) N_k.

    Parameters
    ----------
    law : of the problem
    start : normal forces N_0 from the tension corner, scaled, shape (m,)
    variant : a, b and c0
    deadline : after which no further step begins

    Returns
    -------
    SchemeRun: its state does not keep the true law yet.

    Notes
    -----
    Source: the idea of Gilbert, Casapulla and Ahmed (2006), with an opened and mixed cone. The interior point of the
    optimal face is needed, which interior-point solvers give and simplex solvers do not. Wrong by itself: a settled
    multiplier does not mean that the true law holds, and the end depends on the start; always polish and check.
    """
    total_steps, state, exceeded = 0, None, np.inf
    for attempt in range(RESTARTS + 1):
        # where psi = phi the true cone is associative already: nothing is frozen there
        slope = np.where(law.dilatant, law.tan_phi, law.tan_psi - variant.slope * law.tan_phi)
        program = ForceProgram(law, slope=slope, tolerance=TOLERANCE, deadline=deadline)
        frozen = np.maximum(start, 0.0)  # N_k
        best, idle, failed = np.inf, 0, False  # least excess over the true law, and steps since it fell
        for _ in range(MOST_STEPS):
            offset = (law.tan_phi - slope) * frozen + variant.offset * frozen.max(initial=0.0)
            status, answer = program.largest(law.cohesion + np.where(law.dilatant, 0.0, offset))
            total_steps += 1
            if status not in USABLE or answer is None:
                failed = True
                break
            state, exceeded = answer, excess(law, answer.force)
            normal = np.maximum(split(law, answer.force)[0], 0.0)
            change = np.abs(normal - frozen).max(initial=0.0) / law.total
            frozen = variant.mixing * normal + (1.0 - variant.mixing) * frozen
            idle = 0 if exceeded < PROGRESS * best else idle + 1
            best = min(best, exceeded)
            if change < SETTLED or idle >= PATIENCE or deadline.passed:
                break
        if not failed or deadline.passed:
            break
        # in turn, as either may be why the program failed
        if attempt % 2 == 0:
            variant = variant._replace(slope=0.5 * variant.slope)
        else:
            variant = variant._replace(offset=10.0 * variant.offset)
    return SchemeRun(state, total_steps, float(exceeded))
