"""Alternating cone programs for psi < phi: forces for velocities, and back.

The power of slack against rate,

    gap = sum N' (e_n - tan(psi) |e_t|) + q k + T . e_t + (c' + tan(phi) N') |e_t|,

is linear in the forces for fixed velocities. For fixed N' its least value over the velocities is the dual of the cone
program with slope tan(psi) and constant c' + (tan(phi) - tan(psi)) N'. Zero gap is an exact state. In plane linear
programs do better (``polish``); this is the way in 3-D and where those find nothing.
"""

import numpy as np

from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, exact, split, violation

ACTIVE = 1e-7
"""Rates below this, at mean live velocity one, count as zero."""

LOWER = 1e-9
"""Fall of the scaled multiplier that counts as one."""

LAST_ROUNDS = 3
"""Rounds over which the alternation compares its violation of the law: chosen."""

SETTLED = 1e-4
"""Relative change of the violation over the last rounds below which the alternation has settled [-]: chosen."""

FIRST_ROUNDS = 5
"""Rounds before which it is never taken as settled: chosen."""

EXACT = 1e-10
"""Violation of the true law at which the alternation stops [-]."""

PUSH_ROUNDS = 25
"""Most rounds of a push, which leads away from the law: chosen."""

STALLED = 1e-8
"""Fall of theta lambda + gap in one round of the alternation below which a push has come to its end."""


class ConePrograms:
    """The two programs of the alternation, set up once per problem."""

    def __init__(self, law: JointLaw, deadline: Deadline = NEVER) -> None:
        """Programs of a joint law; one that runs ends at the ``deadline``, and so does what is done with them."""
        self.law, self.deadline = law, deadline
        self.forces = ForceProgram(law, deadline=deadline)
        self.velocities = ForceProgram(law, slope=law.tan_psi, deadline=deadline)


def alternate(programs: ConePrograms, state: ForceState, *, theta: float = 0.0, steps: int = 60) -> ForceState | None:
    """Alternate programs of forces and of velocities on theta lambda + gap.

    That sum never rises. Each program takes the other's last answer as fixed.

    Parameters
    ----------
    state : near-admissible; only its velocities are used
    theta : weight of the multiplier [-]; above zero that is pushed down at the expense of the law
    steps : most rounds of two programs

    Returns
    -------
    The state that violates the law least, for theta above zero the last one, or None where no program has an answer.
    """
    law, best, least, history, merit = programs.law, None, np.inf, [], np.inf
    velocity = state.velocity
    for k in range(steps):
        opening, sliding, slip = split(law, law.matrix.T @ velocity)
        # coefficients of N' and T in the gap; velocities at mean live velocity one
        weight = np.column_stack([opening + (law.tan_phi - law.tan_psi) * slip, sliding]) / law.live_size
        answer = programs.forces.solve(theta, weight.ravel())
        if answer is None:
            break
        multiplier, force = answer
        if programs.deadline.passed:  # the next program would end after the limit too
            return best or ForceState(multiplier, force, velocity)
        normal = np.maximum(split(law, force)[0], 0.0)
        _, dual = programs.velocities.largest(law.cohesion + (law.tan_phi - law.tan_psi) * normal)
        if dual is None:
            break
        velocity = dual.velocity
        found = ForceState(multiplier, force, velocity)
        violated = violation(law, found)
        off, last = violated.worst, merit
        merit = theta * multiplier + violated.complementarity  # the gap is the violation of complementarity
        history.append(off)
        if theta > 0 or off < least:
            best, least = found, off
        stalled = k > FIRST_ROUNDS and abs(history[-1] - history[-1 - LAST_ROUNDS]) < SETTLED * history[-1]
        spent = theta > 0 and merit > last - STALLED * max(1.0, abs(last))  # the push lowers nothing more
        if stalled or spent or (theta == 0 and off < EXACT) or programs.deadline.passed:
            break
    return best


def complying_forces(programs: ConePrograms, state: ForceState, *, largest: bool = False) -> ForceState | None:
    """Smallest, or largest, multiplier whose forces comply with an exact mechanism.

    A point that opens bears nothing, one that slides is on its cone against the slip, one that closes by crushing bears
    its crushing force; ``ACTIVE`` is the rate from which it does.

    Parameters
    ----------
    state : exact; its velocities are kept
    largest : the largest multiplier instead of the smallest

    Returns
    -------
    The state with the new forces and the old velocities, None where the program has no answer.
    """
    law = programs.law
    opening, sliding, slip = split(law, law.matrix.T @ state.velocity)
    gap = opening - law.tan_psi * slip
    closing = np.isfinite(law.crushing) & (gap < -ACTIVE)
    slides = slip > ACTIVE
    direction = sliding / np.maximum(slip, 1e-300)[:, None]  # of points that do not slide, it is not used
    program = ForceProgram(
        law, opening=gap > ACTIVE, sliding=slides, direction=direction, closing=closing, deadline=programs.deadline
    )
    answer = program.solve(-1.0 if largest else 1.0)
    return None if answer is None else ForceState(*answer, state.velocity)


def lower(
    programs: ConePrograms, state: ForceState, *, thetas: tuple[float, ...] = (0.003, 0.01, 0.03, 0.1, 0.3),
    tolerance: float = 1e-8,
) -> ForceState:
    """Lower the multiplier of an exact state by alternating cone programs.

    A push with theta > 0 lowers it at the expense of the law, theta = 0 then leads back to the law. What is lower and
    exact is kept.

    Parameters
    ----------
    state : exact within ``tolerance``
    thetas : weights of the multiplier [-], tried in turn
    tolerance : violation of the true law up to which a state counts [-]

    Returns
    -------
    The lowest exact state, which may be ``state`` itself.
    """
    best, complied = state, None  # complied: the state whose mechanism has been used already

    def keep(found: ForceState | None) -> None:
        """Take a state that is lower and exact for the best."""
        nonlocal best
        lowered = found is not None and found.multiplier < best.multiplier - LOWER
        if lowered and exact(found, programs.law, tolerance):
            best = found

    for theta in thetas:
        if programs.deadline.passed:
            break
        pushed = alternate(programs, best, theta=theta, steps=PUSH_ROUNDS)
        if programs.deadline.passed:
            break
        # the way back to the law ends no lower than the push has gone: a push that is no lower is not worth it
        if pushed is not None and pushed.multiplier < best.multiplier - LOWER:
            keep(alternate(programs, pushed))
        if complied is not best and not programs.deadline.passed:
            complied = best
            keep(complying_forces(programs, best))
    return best
