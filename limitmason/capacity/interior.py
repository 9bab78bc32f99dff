"""A step by an interior path: forces, slips and openings stay inside the law, and come to its edge last.

Whatever a point may do is a product that ends at nothing: spare tension times opening, spare crushing strength times
crushing, and (a, T) o (p, d) of the cone of friction, a = c + tan(phi) N its radius, p the size of the slip d. On the
way each product has the same value, which Newton's method brings down with equilibrium (primal and dual at once, a
predictor and a corrector for one factorisation). No set of points that stick, slide or open is chosen before the end,
so that many may change in one step. The rule of flow is the true one: tan(psi) p lifts, friction is not frozen.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.capacity import newton
from limitmason.capacity.point_law import PlasticHistory, trial
from limitmason.capacity.system import Evaluated, System

ITERATIONS = 60  # at most, chosen

FIRST = 10.0
"""Product at the start, block weights times elastic lengths: less finds fewer steps, more takes longer [-]."""

_INSIDE = 0.995
"""Part of the way to the edge of the law that the longest step goes [-]: chosen, as is usual."""

_OVER, _STUCK = 3, 0.15
"""So many last steps whose shares are together below so much lead nowhere: chosen."""

_LEAST_AIM, _CENTRED = 0.05, 3
"""The product aimed at is the part that a first step leaves, at least so much, to this power (Mehrotra's rule)."""


class Inner(NamedTuple):
    """State of m points inside the law, in mean block weights and elastic lengths, or a step from it."""

    normal: Array  # N, compression positive, (m,)
    cone: Array  # (a, T): radius of the cone of friction, and the shear in it, (m, c)
    slid: Array  # (p, d): size and components of the slip, (m, c)
    spare: Array  # strength left against opening of every point, then against crushing of those that crush, (r,)
    given: Array  # what opened and crushed, (r,)

    def onward(self, step: "Inner", share: float) -> "Inner":
        """The state after a share of a step."""
        return Inner(*(x + share * dx for x, dx in zip(self, step, strict=True)))

    def product(self) -> float:
        """Mean product."""
        own = float(self.spare @ self.given + (self.cone * self.slid).sum())
        return own / (len(self.spare) + len(self.normal))


class _Linear(NamedTuple):
    """Equations of the points, linearised at a state, in units of ``Inner``; see :meth:`_Points.linearised`.

    What an equation lacks is by how much its left side exceeds its right one at the state: a step is to undo it.
    """

    inverse: Array  # of the arrow matrix that multiplies by (a, T), (m, c, c)
    across: Array  # -d(slid) / d(a, T), by which the slip is eliminated, (m, c, c)
    tangent: Array  # stiffness -d(force) / d(displacement), (m, c, c)
    elastic: Array  # lack of the springs, as a displacement, (m, c)
    cone: Array  # lack of a = c + tan(phi) N, (m,)
    spare: Array  # lack of spare = bound + sign N, (r,)


class _Points:
    """The law of all points in mean block weights and elastic lengths, from a history on."""

    def __init__(self, system: System, old: PlasticHistory) -> None:
        """Strengths, stiffnesses and rows of spare strength, in weights and elastic lengths.

        Rows are the tension cut-off of every point, then the crushing of those that crush.

        Parameters
        ----------
        system : equations of the path's blocks and points
        old : history at the start of the step
        """
        self.system, self.old = system, old
        law, area = system.law, system.bodies.area
        self.strength = law.strength_at(old.damage).over(area).in_units_of(system.weight)
        c = system.bodies.directions.shape[1]
        self.axes = (0,) * c  # only its length counts: by it loops over components are compiled
        stiff = np.column_stack([law.kn, *[law.ks] * (c - 1)]) * area[:, None]
        self.stiff: Array = stiff * (system.length / system.weight)
        s, every = self.strength, np.arange(len(area))
        crushes = np.flatnonzero(s.crushes)
        # spare strength of every row is bound + sign N, with N of the point in ``row``
        self.row: Index = np.concatenate([every, crushes])
        self.sign = np.where(np.arange(len(self.row)) < len(area), 1.0, -1.0)
        self.bound = np.concatenate([s.tension, s.crushing[crushes]])

    def elastic(self, at: Evaluated) -> Array:
        """Forces without limits in a pose, in mean block weights, shape (m, c)."""
        x = trial(self.system.law, self.old, at.contact.displacement)
        return x * (self.system.bodies.area / self.system.weight)[:, None]

    def inside(self, at: Evaluated, product: float) -> Inner:
        """State inside the law at a pose, with one value of all products.

        Parameters
        ----------
        at : the pose, evaluated by the true law, whose opening by dilation is taken
        product : the value, mu of the interior-point method [mean block weights times elastic lengths]
        """
        from limitmason.capacity import compiled_interior

        tried, s, kn, ks = self.elastic(at), self.strength, self.stiff[:, 0], self.stiff[:, 1]
        lift = (at.returned.history.lift - self.old.lift) / self.system.length
        # spare strength x of each row solves x - kn product / x = free, a quadratic
        free = self.bound + self.sign * (tried[:, 0] + kn * lift)[self.row]
        root = np.sqrt(free**2 + 4.0 * product * kn[self.row])
        # the smaller root by the product of both, which keeps its digits
        large = 0.5 * (np.abs(free) + root)
        spare = np.where(free > 0.0, large, product * kn[self.row] / large)
        normal = spare[: len(kn)] - s.tension
        cone, slid = np.empty(tried.shape), np.empty(tried.shape)
        compiled_interior.sheared(tried, s.shear_strength(normal), ks, product, cone, slid)  # writes the last two
        return Inner(normal, cone, slid, spare, product / spare)

    def linearised(self, at: Evaluated, state: Inner) -> _Linear | None:
        """Equations of the points linearised about a state, or None where one is singular.

        Of a point with the forces N, T and the elastic ones N', T' of the pose, and with rows of spare strength:

        - springs: (N - N') / kn = tan(psi) p + sum of sign given, and (T - T') / ks = d, in displacements,
        - limits: a = c + tan(phi) N, and spare = bound + sign N of every row,
        - products: spare given = aim, and (a, T) o (p, d) = (aim, 0), with o as in ``compiled_interior.freed``.

        All unknowns of the points are eliminated: by ``tangent``, the inverse of a compliance, their forces follow from
        displacements, and motions of blocks alone are left to solve for. What springs and limits lack at the state goes
        to the right-hand side, see :meth:`freed`.

        Parameters
        ----------
        at : the pose, for the elastic forces of its points
        state : of the points
        """
        from limitmason.capacity import compiled_interior

        s, (m, c) = self.strength, state.cone.shape
        inverse, across, tangent = np.empty((3, m, c, c))
        linear = _Linear(
            inverse=inverse, across=across, tangent=tangent, elastic=np.empty((m, c)), cone=np.empty(m),
            spare=np.empty(len(self.row)),
        )
        laws, rows = (s.tan_phi, s.tan_psi, s.shear_strength(state.normal)), (self.row, self.sign, self.bound)
        # the arrays of ``linear`` are written in place; tuples are in the order that the compiled function tells
        found = compiled_interior.linearised(
            self.axes, laws, self.stiff, rows, tuple(state), self.elastic(at), tuple(linear),
        )
        return linear if found else None

    def freed(self, state: Inner, linear: _Linear, aim: float, second: Inner | None) -> tuple[Array, Array, Array]:
        """Steps of forces, slips and gaps of the points in a pose that is held.

        Parameters
        ----------
        state : of the points
        linear : its linear equations
        aim : product of every pair that is aimed at
        second : the predictor's step, whose products are taken off (Mehrotra's second-order term); None in the
            predictor

        Returns
        -------
        Steps of forces (m, c), of slips (m, c) and of plastic openings per row
        """
        from limitmason.capacity import compiled_interior

        steps = np.empty(state.cone.shape), np.empty(state.cone.shape), np.empty(len(self.row))
        first = tuple(state if second is None else second)
        compiled_interior.freed(  # writes ``steps`` in place; does not read ``first`` without a second step
            self.axes, self.strength.tan_psi, self.row, self.sign, tuple(state), tuple(linear), aim,
            second is not None, first, steps,
        )
        return steps

    def step(
        self, state: Inner, linear: _Linear, freed: tuple[Array, Array, Array], displaced: Array
    ) -> tuple[Inner, float]:
        """The step of the points that goes with displacements, (m, c), and its share to the edge of the law.

        Parameters
        ----------
        state : of the points
        linear : its linear equations
        freed : of :meth:`freed`
        displaced : displacement of the points by the step, in elastic lengths [-], shape (m, c)
        """
        from limitmason.capacity import compiled_interior

        step = Inner(*(np.empty_like(part) for part in state))
        share = compiled_interior.stepped(  # writes the arrays of ``step`` in place
            self.axes, self.strength.tan_phi, self.row, self.sign, tuple(state), tuple(linear), freed, displaced,
            tuple(step),
        )
        return step, share


def solve(way: newton.Way) -> newton.Solved | None:
    """The end of a step by an interior path, or None where it is not found.

    What is found is in equilibrium by the true law, or is not returned: Newton's method on it has the last word.
    Strengths are those at the start of the step, ties take the force of the pose that they are in. ``way`` is where the
    path begins.
    """
    system, viscosity, last_word = way.system, way.viscosity, newton.LastWord()
    # shares of the steps so far that were made; the first ones stand for steps before any
    points, shares = _Points(system, way.old), [1.0] * _OVER
    state = points.inside(way.state, FIRST)
    anew = 1  # times that it may be begun anew
    for k in range(ITERATIONS):
        now = way.state
        stuck = sum(shares[-_OVER:]) < _STUCK
        if stuck and anew:  # where the way turns back it is begun anew from the middle
            anew -= 1
            state, shares, stuck = points.inside(now, FIRST), [1.0] * _OVER, False
        last = k + 1 == ITERATIONS or stuck
        if (found := last_word.on(way, k, last=last)) is not None:
            return found
        if last or not np.isfinite(way.unbalance):
            return None
        linear = points.linearised(now, state)
        if linear is None:
            return None
        # stresses [Pa/m] and forces [N] of the points, as the structure takes them
        stiff = linear.tangent * (system.weight / system.length / system.bodies.area)[:, None, None]
        force = np.column_stack([state.normal, state.cone[:, 1:]])
        tangent = way.tangent(
            now._replace(returned=now.returned._replace(tangent=stiff), force=force * system.weight), viscosity
        )
        if tangent is None:
            return None
        step, edge = None, np.inf  # step of the points, and its share at which the first leaves the law
        product, aim = state.product(), 0.0
        # Mehrotra: a step to products of nothing tells what product to aim at in the second, which corrects it
        for _ in ("predictor", "corrector"):
            freed = points.freed(state, linear, aim, step)
            pushed = (force + freed[0]) * system.weight
            rest = system.unbalanced(now.pose, now.wrenches, pushed, now.pulled, now.multiplier)
            motion = tangent(rest - viscosity * way.made)
            if motion is None:
                return None
            step, edge = points.step(state, linear, freed, system.relative(now, motion[:-1])[0] / system.length)
            if aim == 0.0:
                left = state.onward(step, min(1.0, edge)).product() / product
                aim = product * float(np.clip(left, _LEAST_AIM, 1.0)) ** _CENTRED
        assert step is not None
        assert motion is not None
        share = min(1.0, _INSIDE * edge)
        shares.append(share)
        state = state.onward(step, share)
        way = way.moved(share * motion[:-1], now.multiplier + share * float(motion[-1]))
    return None
