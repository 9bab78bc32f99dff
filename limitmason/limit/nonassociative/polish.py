"""Polish of a plane state by linear programs: the law to the last digits.

In plane the law of a point is four complementary pairs of linear expressions,

    N' >= 0, R - T >= 0, R + T >= 0, q - N' >= 0   against   p, z+, z-, k >= 0,

with R = c' + tan(phi) N', e_t = z- - z+ and e_n = tan(psi) (z+ + z-) + p - k. Forces and velocities each fill a
polyhedron; only the products couple them. Arrays of shape (4, m) hold the pairs in this order.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from limitmason.arrays import Array, Flags
from limitmason.errors import InputError
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw

ACTIVE = 1e-9
"""Below this a rate (mean live velocity one) or a slack (mean block load one) of a linear program's vertex is zero."""

FEASIBLE = 1e-10
"""Tolerance of the linear programs [-]: the tightest that HiGHS takes, and below ``ACTIVE``."""

THRESHOLDS = (1.0, 0.1, 10.0, 1e-2, 1e2, 1e-3, 1e-4)
"""Rates over slacks above which a pair's slack vanishes, tried in turn: chosen, from one on to either side."""

LOWER = 1e-9
"""Fall of the scaled multiplier that counts as one [-]: less is rounding."""

EXACT = 1e-11
"""Gap over the total load at which the alternation takes a state for exact [-]."""

STALLED = 1e-10
"""Relative fall of theta lambda + gap in one round of the alternation below which it has come to its end."""

NOISE = 0.3
"""Largest disturbance of the weights of a descent over the largest of them [-]: chosen."""


class ForceAnswer(NamedTuple):
    """Multiplier, forces from the tension corner, and what zero slacks would lower."""

    multiplier: float  # scaled [-]
    force: Array  # (N', T) of every point, scaled [-], (2 m,)
    gain: Array  # fall of lambda if a zero slack could open [-], per slack, rows as those of the module's pairs, (4, m)


class PlanePrograms:
    """Linear programs over admissible forces and over admissible velocities.

    Attributes
    ----------
    law : of the plane problem, with n equilibrium rows and m points
    deadline : after which what is done with these programs begins no further one
    m, n : these numbers
    unit : load of a mean block, in scaled forces: the unit of forces in these programs
    normal, tangent : columns of the equilibrium matrix of N' and of T, shape (n, m) each
    balance, load : equilibrium, balance (N', T, lambda) = load, shapes (n, 2 m + 1) and (n,)
    cone, cone_bound : |T| <= R as cone (N', T, lambda) <= cone_bound, shapes (2 m, 2 m + 1) and (2 m,)
    """

    def __init__(self, law: JointLaw, deadline: Deadline = NEVER) -> None:
        """Rows of the programs of forces (N', T, lambda) and of velocities (v, z+, z-, k).

        z+ and z- are the slip rates to either side of every point, k its rate of crushing.
        """
        if law.components != 2:
            raise InputError("the plane polish needs a problem reduced to the plane")
        self.law, self.deadline = law, deadline
        self.m, self.n = len(law.tan_phi), law.matrix.shape[0]
        # the total load is sqrt(n) scaled units, so that of a mean block, the unit of these programs, is 1 / total
        self.unit = law.total / max(law.total**2, 1.0)
        self.normal, self.tangent = law.matrix[:, 0::2], law.matrix[:, 1::2]
        m = self.m
        eye, mu = sparse.eye_array(m), sparse.diags_array(law.tan_phi)
        none = sparse.csc_array((m, 1))
        self.balance = sparse.csc_array(
            sparse.hstack([self.normal, self.tangent, sparse.csc_array(law.live[:, None] / self.unit)])
        )
        self.load = -law.dead / self.unit
        self.cone = sparse.csr_array(sparse.vstack([sparse.hstack([-mu, eye, none]), sparse.hstack([-mu, -eye, none])]))
        self.cone_bound = np.tile(law.cohesion, 2) / self.unit
        live = np.concatenate([law.live / law.live_size, np.zeros(3 * m)])
        # A_t' v + z+ - z- = 0, and live power one
        self._sliding = sparse.csc_array(
            sparse.vstack([sparse.hstack([self.tangent.T, eye, -eye, sparse.csc_array((m, m))]), live[None, :]])
        )
        psi = sparse.diags_array(law.tan_psi)
        self._opening = sparse.csr_array(sparse.hstack([-self.normal.T, psi, psi, -eye]))
        self._crushable = law.points.crushes
        self._options = {"primal_feasibility_tolerance": FEASIBLE, "dual_feasibility_tolerance": FEASIBLE}

    def slacks(self, force: Array) -> Array:
        """N', R - T, R + T and q - N' in mean block loads, (4, m).

        ``force`` holds (N', T) of every point, scaled, shape (2 m,). Where nothing crushes the last row is infinite.
        """
        normal, shear = force[0::2], force[1::2]
        strength = self.law.points.shear_strength(normal)
        return np.array([normal, strength - shear, strength + shear, self.law.crushing - normal]) / self.unit

    def rates(self, velocity: Array) -> Array:
        """p, z+, z- and k at mean live velocity one, (4, m), of velocities, (n,)."""
        rate = self.law.matrix.T @ (velocity * (self.law.live_size / (self.law.live @ velocity)))
        plus, minus = np.maximum(-rate[1::2], 0.0), np.maximum(rate[1::2], 0.0)
        gap = rate[0::2] - self.law.tan_psi * (plus + minus)
        crushing = np.where(self._crushable, np.maximum(-gap, 0.0), 0.0)
        return np.array([gap + crushing, plus, minus, crushing])

    def gap(self, force: Array, velocity: Array) -> float:
        """Sum of slack times rate, over the total load [-]: zero for an exact state.

        ``force`` has shape (2 m,), ``velocity`` (n,), both scaled.
        """
        slack, rate = np.maximum(self.slacks(force), 0.0), np.maximum(self.rates(velocity), 0.0)
        slack[np.isinf(slack)] = 0.0  # where nothing crushes its rate is zero, and inf times 0 is no number
        return float((slack * rate).sum()) * self.unit / self.law.total

    def forces(
        self, *, weight: Array | None = None, theta: float = 0.0, zero: Flags | None = None
    ) -> ForceAnswer | None:
        """Minimise theta lambda + sum(weight * slack) with slacks in ``zero`` vanishing.

        Parameters
        ----------
        weight : rates at mean live velocity one, shape (4, m), so that the sum is in units of the multiplier
        theta : price of the multiplier [-]
        zero : slacks held at zero, shape (4, m)

        Returns
        -------
        Answer, or None without a solution.
        """
        m, law = self.m, self.law
        cost = np.zeros(2 * m + 1)
        cost[-1] = theta
        if weight is not None:
            opening, plus, minus, crushing = weight * (self.unit / law.live_size)
            # slacks of the module's pairs, written in N' and T
            cost[:m] = opening + law.tan_phi * (plus + minus) - np.where(self._crushable, crushing, 0.0)
            cost[m : 2 * m] = minus - plus
        low, high = np.full(2 * m + 1, -np.inf), np.full(2 * m + 1, np.inf)
        # no negative multipliers: they belong to the opposite load
        low[:m], low[-1], high[:m] = 0.0, 0.0, law.crushing / self.unit
        balance, load, cone, bound = self.balance, self.load, self.cone, self.cone_bound
        tight = np.zeros(2 * m, dtype=bool)
        if zero is not None:
            unloaded, slides_plus, slides_minus, crushes = zero
            high[:m][unloaded] = 0.0
            low[:m][crushes] = high[:m][crushes]
            tight = np.concatenate([slides_plus, slides_minus])
            balance = sparse.vstack([balance, cone[tight]], format="csc")
            load = np.concatenate([load, bound[tight]])
            cone, bound = cone[~tight], bound[~tight]
        answer = linprog(
            cost, cone, bound, balance, load, np.column_stack([low, high]), method="highs-ds", options=self._options
        )
        if answer.x is None or answer.status != 0:
            return None
        # duals of slacks that are held at zero: by how much lambda would fall if they opened
        gain = np.zeros((4, m))
        if zero is not None:
            held = answer.upper.marginals[:m] + answer.lower.marginals[:m]
            gain[0] = np.where(unloaded, np.maximum(-held, 0.0), 0.0)
            gain[3] = np.where(crushes, np.maximum(held, 0.0), 0.0)
            rows = np.zeros(2 * m)
            rows[tight] = answer.eqlin.marginals[self.n :]
            gain[1:3] = np.maximum(rows, 0.0).reshape(2, m)
        force = np.empty(2 * m)
        force[0::2], force[1::2] = answer.x[:m] * self.unit, answer.x[m : 2 * m] * self.unit
        return ForceAnswer(float(answer.x[-1]), force, gain)

    def velocities(self, *, weight: Array | None = None, zero: Flags | None = None) -> Array | None:
        """Velocities at mean live velocity one of least sum(weight * rate), or None.

        Parameters
        ----------
        weight : of every rate, shape (4, m), rows as those of :meth:`rates`: opening beyond dilation, slip to either
            side, crushing; None for no weight
        zero : rates held at zero, shape (4, m); None for none
        """
        # unknowns: velocities, then at every point slip either way and crushing; what it opens by is a row
        m, n, law = self.m, self.n, self.law
        cost = np.zeros(n + 3 * m)
        if weight is not None:
            # of p, z+, z- and k, with p = e_n - tan(psi) (z+ + z-) + k; slacks of joints that do not crush are infinite
            opening, plus, minus, crushing = np.where(np.isfinite(weight), weight, 0.0)
            cost[:n] = self.normal @ opening
            cost[n : n + m] = plus - law.tan_psi * opening
            cost[n + m : n + 2 * m] = minus - law.tan_psi * opening
            cost[n + 2 * m :] = opening + crushing
        low, high = np.full(n + 3 * m, -np.inf), np.full(n + 3 * m, np.inf)
        low[n:] = 0.0
        high[n + 2 * m :][~self._crushable] = 0.0  # without crushing no point closes
        equal, rest = self._sliding, self._opening
        if zero is not None:
            shut, *others = zero  # p = 0 is a row, the others are unknowns
            high[n:][np.concatenate(others)] = 0.0
            equal = sparse.vstack([equal, rest[shut]], format="csc")
            rest = rest[~shut]
        right = np.zeros(equal.shape[0])
        right[m] = 1.0  # the mean live velocity
        answer = linprog(
            cost, rest, np.zeros(rest.shape[0]), equal, right, np.column_stack([low, high]), method="highs-ds",
            options=self._options,
        )
        return None if answer.x is None or answer.status != 0 else answer.x[:n]


def polish(programs: PlanePrograms, state: ForceState) -> ForceState | None:
    """Exact state near a given one, smallest on its active set, or None.

    The larger of slack and rate decides which of the two vanishes. Velocities come first, with the vanishing rates
    fixed; then the forces of least lambda, with slack zero only where a rate is really used. When no threshold gives a
    solution, forces and velocities are alternated on the sum of their products.

    Parameters
    ----------
    programs : of the plane problem
    state : near-admissible, for example the end of a sequence
    """
    slack = np.maximum(programs.slacks(state.force), 0.0)
    rate = np.maximum(programs.rates(state.velocity), 0.0)
    for threshold in THRESHOLDS:
        if programs.deadline.passed:
            return None
        may_move = (rate > threshold * slack) | (slack <= ACTIVE)
        velocity = programs.velocities(weight=slack, zero=~may_move)
        if velocity is None:
            continue
        answer = programs.forces(theta=1.0, zero=programs.rates(velocity) > ACTIVE)
        if answer is not None:
            return ForceState(answer.multiplier, answer.force, velocity)
    return alternate_plane(programs, state)


def alternate_plane(
    programs: PlanePrograms, state: ForceState, *, theta: float = 0.0, steps: int = 30
) -> ForceState | None:
    """Alternate force and velocity programs on theta lambda + gap, which never rises.

    Parameters
    ----------
    state : near-admissible; only its velocities are used
    theta : price of the multiplier [-]; 0 looks for the nearest exact state, a positive one descends
    steps : pairs of programs at most

    Returns
    -------
    The last state, or None where the first program has no solution.
    """
    best, last = None, np.inf
    velocity = state.velocity
    for _ in range(steps):
        answer = programs.forces(weight=np.maximum(programs.rates(velocity), 0.0), theta=theta)
        if answer is None:
            break
        found = programs.velocities(weight=np.maximum(programs.slacks(answer.force), 0.0))
        if found is None:
            break
        velocity = found
        best = ForceState(answer.multiplier, answer.force, velocity)
        gap = programs.gap(answer.force, velocity)
        merit = theta * answer.multiplier + gap
        done = (theta == 0 and gap < EXACT) or merit > last - STALLED * max(1.0, abs(last))
        if done or programs.deadline.passed:
            break
        last = merit
    return best


def descend(
    programs: PlanePrograms, state: ForceState, *, rounds: int = 20, tries: int = 0,
    random: np.random.Generator | None = None,
) -> ForceState:
    """Lower the multiplier of an exact state by linear programs in turn.

    Each round takes velocities that open or slide where the duals of the last forces say that lambda would fall, then
    the forces of least lambda that comply with these velocities.

    Parameters
    ----------
    state : exact, from :func:`polish`
    rounds : pairs of linear programs at most; the search is local
    tries : rounds with weights disturbed by ``random``, begun where lambda falls no further
    random : None for no disturbance, whatever ``tries``

    Returns
    -------
    An exact state whose multiplier is not above that of ``state``.
    """
    # forces of least lambda that comply with the velocities: a slack is zero where its rate is not
    answer = programs.forces(theta=1.0, zero=programs.rates(state.velocity) > ACTIVE)
    # the state's own forces comply with its velocities: a higher multiplier is a program gone wrong
    if answer is None or answer.multiplier > state.multiplier + LOWER:
        return state
    best = ForceState(answer.multiplier, answer.force, state.velocity)
    noise: Array | float = 0.0
    for _ in range(rounds):
        if programs.deadline.passed:
            break
        velocity = programs.velocities(weight=answer.gain + noise, zero=programs.slacks(best.force) > ACTIVE)
        if velocity is None:
            break
        found = programs.forces(theta=1.0, zero=programs.rates(velocity) > ACTIVE)
        if found is None:
            break
        # the old forces comply with the new velocities as well: the multiplier cannot rise
        stalled = found.multiplier > best.multiplier - LOWER
        best, answer = ForceState(found.multiplier, found.force, velocity), found
        noise = 0.0
        if stalled:
            if tries <= 0 or random is None:
                break
            tries -= 1
            # where no dual asks for anything, weights as small as ``ACTIVE`` still choose a velocity
            noise = NOISE * max(float(answer.gain.max(initial=0.0)), ACTIVE) * random.random(answer.gain.shape)
    return best


def interval_in_plane(programs: PlanePrograms, state: ForceState) -> tuple[float, float]:
    """Smallest and largest scaled multiplier whose forces comply with a mechanism."""
    # slacks that vanish, since their rates do not
    zero = programs.rates(state.velocity) > ACTIVE
    low, high = programs.forces(theta=1.0, zero=zero), programs.forces(theta=-1.0, zero=zero)
    own = state.multiplier
    first = own if low is None else min(low.multiplier, own)
    return first, own if high is None else max(high.multiplier, own)
