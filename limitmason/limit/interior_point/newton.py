"""Newton steps of the interior-point method: scaling, factor, and directions.

The program is  max lambda  subject to  G x + lambda live = right,  every x_p in its Lorentz cone, and some first
components bounded, slack = sign x_p0 - level >= 0. Its dual has a velocity y per equation, a cone point s per contact
point and a force z per bound: G^T y + s + e_0 sum(sign z) = 0, live . y = -1. Eliminating everything but y and lambda
leaves  [M live; live^T 0],  M = G H^-1 G^T,  H = W^2 + (z / slack) e_0 e_0^T  with the scaling W of Nesterov and Todd.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.limit.interior_point import kernels
from limitmason.limit.interior_point.factor import BlockCholesky

STEP = 0.99
"""Fraction of the way to the boundary of the cones that a step may go."""

REFINEMENTS = 2
"""Corrections of a solution of the bordered system at most: chosen."""

REFINED = 1e-11
"""Relative error at which a solution of the bordered system is left alone.

A larger one would stay in the equilibrium equations: late iterates lie too close to the boundary of the cones to remove
it again.
"""

NARROW, WIDE = 0.1, 10.0
"""Products of a pair over the target within which centrality corrections leave it alone [-], as in Gondzio (1996)."""

DEAD_LOAD_BALANCE = 1e-10
"""Unbalance over the total load at which forces carry the dead load [-]: the solver's default tolerance."""


class ConeProgram(NamedTuple):
    """Max lambda: matrix x + lambda live = right, x_p in cones, and bounds on x_p0.

    The bounds are bound_sign x_p0 - bound_level >= 0.
    """

    matrix: sparse.csr_array  # G, (r, c m)
    transpose: sparse.csr_array  # of the matrix
    right: Array  # minus dead load, and what the shift of normal forces adds, (r,)
    live: Array  # (r,)
    components: int  # c, force components a point, 2 or 3
    bound_point: Index  # point of every bound, (k,)
    bound_sign: Array  # +1 for lower, -1 for upper bounds, (k,)
    bound_level: Array  # (k,)
    size: float  # total load in these units

    @property
    def degree(self) -> int:
        """Barrier degree: one per cone and bound."""
        return self.matrix.shape[1] // self.components + len(self.bound_point)

    def bounded(self, x: Array) -> Array:
        """Signed first component of ``x`` (m, c) at every bound, shape (k,)."""
        return self.bound_sign * x[self.bound_point, 0]

    def push(self, z: Array) -> Array:
        """Sum of the signed bound forces ``z`` (k,) at every point, shape (m,)."""
        total = np.bincount(self.bound_point, self.bound_sign * z, self.matrix.shape[1] // self.components)
        return np.asarray(total, dtype=float)


class Iterate(NamedTuple):
    """Primal x, multiplier, slack and dual y, s, z, or a direction in that space."""

    x: Array  # force of every point, (tan(phi) N + c A, T), within its cone |T| <= x_0, (m, c)
    multiplier: float  # lambda [-]
    slack: Array  # by how much a bounded x_p0 keeps its bound, (k,)
    y: Array  # velocity of every equilibrium row, with live . y = -1, (r,)
    s: Array  # rates of every point, within the dual cone; x . s is zero at the solution, (m, c)
    z: Array  # rate at which every bound yields; slack z is zero at the solution, (k,)

    def moved(self, by: "Iterate", primal: float, dual: float) -> "Iterate":
        """This iterate after a step ``by`` of two lengths, ``primal`` and ``dual`` [-]."""
        return Iterate(
            x=self.x + primal * by.x, multiplier=self.multiplier + primal * by.multiplier,
            slack=self.slack + primal * by.slack, y=self.y + dual * by.y, s=self.s + dual * by.s,
            z=self.z + dual * by.z,
        )

    @property
    def complementarity(self) -> float:
        """The duality gap of a feasible pair, x . s + slack . z."""
        return float(self.x.ravel() @ self.s.ravel() + self.slack @ self.z)


class Residuals(NamedTuple):
    """What an iterate leaves of the four groups of equations."""

    equilibrium: Array  # right - G x - lambda live, (r,)
    rates: Array  # -G^T y - s - e_0 sum(sign z), (m, c)
    live_rate: float  # -1 - live . y
    bounds: Array  # level - sign x_p0 + slack, (k,)


def residuals(program: ConeProgram, it: Iterate) -> Residuals:
    """Residuals that ``it`` leaves of the program's equations, 0 at a feasible point."""
    rates = -(program.transpose @ it.y).reshape(it.x.shape) - it.s
    rates[:, 0] -= program.push(it.z)
    return Residuals(
        program.right - program.matrix @ it.x.ravel() - it.multiplier * program.live,
        rates,
        -1.0 - float(program.live @ it.y),
        program.bound_level - program.bounded(it.x) + it.slack,
    )


def cone_product(x: Array, s: Array) -> Array:
    """Product of the cones' algebra, (x . s, x_0 s_i + s_0 x_i); all of shape (m, c)."""
    out = x[:, :1] * s + s[:, :1] * x
    out[:, 0] = np.einsum("mc,mc->m", x, s)
    return out


def cone_quotient(x: Array, product: Array) -> Array:
    """The s with x o s = product; all of shape (m, c).

    The determinant x_0^2 - |x_1..|^2 is a product: the difference of squares would cancel near the boundary.
    """
    tail = np.sqrt(np.einsum("mc,mc->m", x[:, 1:], x[:, 1:]))
    out = np.empty_like(product)
    out[:, 0] = x[:, 0] * product[:, 0] - np.einsum("mc,mc->m", x[:, 1:], product[:, 1:])
    out[:, 0] /= (x[:, 0] - tail) * (x[:, 0] + tail)
    out[:, 1:] = (product[:, 1:] - x[:, 1:] * out[:, :1]) / x[:, :1]
    return out


def step_lengths(it: Iterate, d: Iterate) -> tuple[float, float]:
    """Longest primal and dual steps from ``it`` along ``d``, at most one [-].

    They go at most ``STEP`` of the way to the boundary.
    """

    def inverse(cone: Array, cone_step: Array, linear: Array, linear_step: Array) -> float:
        """One over the step of ``STEP`` of the way: cones (m, c), bounds > 0 (k,).

        ``cone_step`` and ``linear_step`` are the changes by a step of one.
        """
        worst = float((-linear_step / linear).max(initial=0.0))
        return max(kernels.inverse_step(cone, cone_step), worst) / STEP

    return 1.0 / max(1.0, inverse(it.x, d.x, it.slack, d.slack)), 1.0 / max(1.0, inverse(it.s, d.s, it.z, d.z))


class NewtonSystem:
    """The linearised conditions at one iterate, factorised.

    Call :meth:`scale` before anything else.

    Parameters
    ----------
    program : in standard form
    factor : symbolic factorisation of the program's matrix

    Attributes
    ----------
    it : the iterate, from :meth:`scale`
    _axis, _size : scaling W of every point, as of :func:`kernels.nesterov_todd`
    _image : W x = W^-1 s, shape (m, c)
    _root, _turn, _lever : H^-1 = root root^T, root^T W and root^T e_0, as of :func:`kernels.inverse_roots`
    _live_solution, _live_square : M^-1 live, shape (r,), None until it is needed, and live . M^-1 live
    """

    def __init__(self, program: ConeProgram, factor: BlockCholesky) -> None:
        self.program, self.factor = program, factor
        self.it: Iterate

    def scale(self, it: Iterate) -> bool:
        """Scale and factorise at an iterate, or False where rounding does not let it."""
        inside, self._axis, self._size = kernels.nesterov_todd(it.x, it.s)
        if not inside:
            return False
        self._image = self._scaled(it.x)  # W x = W^-1 s
        self.it = it
        p = self.program
        # eliminated slack and multiplier of a bound act as a spring z / slack on the normal force
        stiffness = np.asarray(np.bincount(p.bound_point, it.z / it.slack, len(it.x)), dtype=float)
        self._root, self._turn, self._lever = kernels.inverse_roots(self._axis, self._size, stiffness)
        self._live_solution: Array | None = None
        try:
            self.factor.factorise(self._root)
        except FloatingPointError:
            return False
        return True

    def direction(self, rest: Residuals, products: Array, bound_products: Array) -> Iterate:
        """Step that removes residuals and changes products x o s and slack z as given.

        Products stay in scaled form: W u has entries so large that a sum with the rates would drown the latter.

        Parameters
        ----------
        rest : residuals of the iterate
        products, bound_products : wanted changes of x o s in scaled form, shape (m, c), and of slack z, shape (k,)

        Returns
        -------
        The step as an :class:`Iterate` of differences.
        """
        p, it = self.program, self.it
        u = cone_quotient(self._image, products)
        z_part = (bound_products + it.z * rest.bounds) / it.slack  # step of z were x to stay
        push = p.push(z_part)

        def inner(rates: Array) -> Array:
            """Step of x for rates (m, c), in the coordinates of the factor, shape (m, c)."""
            return kernels.inward(self._root, self._turn, self._lever, rates, u, push)

        # step of x with dy = 0; the bordered system then gives dy and the change of the multiplier
        start = kernels.outward(self._root, inner(-rest.rates))
        dy, dl = self._bordered(rest.equilibrium - p.matrix @ start.ravel(), rest.live_rate)
        change = (p.transpose @ dy).reshape(it.x.shape)
        scaled_step = inner(change - rest.rates)
        dx = kernels.outward(self._root, scaled_step)
        # signed dx_p0 at the bounds: the lever is the first row of the root
        bounded = p.bound_sign * np.einsum("kc,kc->k", self._lever[p.bound_point], scaled_step[p.bound_point])
        dz = z_part - it.z / it.slack * bounded
        ds = rest.rates - change
        ds[:, 0] -= p.push(dz)
        return Iterate(dx, dl, bounded - rest.bounds, dy, ds, dz)

    def _bordered(self, right: Array, rate: float) -> tuple[Array, float]:
        """Solution of [M live; live^T 0][y; l] = [right; rate], refined against M.

        Parameters
        ----------
        right, rate : right-hand side, shape (r,), and a number

        Returns
        -------
        y, multiplier : shape (r,), and l
        """
        p, live = self.program, self.program.live
        y, multiplier = np.zeros(len(right)), 0.0
        enough = REFINED * (float(np.abs(right).max()) + abs(rate))
        a, b, last = right, rate, np.inf  # what is left of both right-hand sides, and the error before
        for refinement in range(REFINEMENTS + 1):
            if self._live_solution is None:  # M^-1 live, once per factorisation
                self._live_solution, v = self.factor.solve(np.array([live, a]))
                self._live_square = float(live @ self._live_solution)
            else:
                v = self.factor.solve(a)
            # without live load there is no multiplier
            correction = (float(live @ v) - b) / self._live_square if self._live_square > 0 else 0.0
            y += v - correction * self._live_solution
            multiplier += correction
            if refinement == REFINEMENTS:
                break
            # M y = G H^-1 G^T y without M, which the factor has rounded
            strain = kernels.inverse_hessian(self._root, (p.transpose @ y).reshape(self.it.x.shape))
            a = right - p.matrix @ strain.ravel() - multiplier * live
            b = rate - float(live @ y)
            error = float(np.abs(a).max()) + abs(b)
            if error <= enough or error > 0.5 * last:  # good enough, or no longer halved: rounding is reached
                break
            last = error
        return y, multiplier

    def _scaled(self, x: Array, inverse: bool = False) -> Array:
        """W x, or W^-1 x, at every point, with the scaling of the iterate; shapes (m, c)."""
        return kernels.scaled(self._axis, self._size, x, inverse)

    def products(self, target: float, d: Iterate | None = None) -> tuple[Array, Array]:
        """Changes of products towards ``target``, less the second-order term (Mehrotra).

        Parameters
        ----------
        target : product of every pair on the central path
        d : direction whose second-order term dx o ds is taken off, None for none

        Returns
        -------
        cone, bound : wanted changes of x o s in scaled form, shape (m, c), and of slack z, shape (k,)
        """
        cone, bound = -cone_product(self._image, self._image), target - self.it.slack * self.it.z
        cone[:, 0] += target
        if d is None:
            return cone, bound
        return cone - cone_product(self._scaled(d.x), self._scaled(d.s, True)), bound - d.slack * d.z

    def centred_products(
        self, wanted: tuple[Array, Array], d: Iterate, primal: float, dual: float, target: float
    ) -> tuple[Array, Array]:
        """Wanted products with Gondzio's centrality correction at a trial point.

        Products there below 0.1 or above 10 times the target are moved to that end. Steps become longer: pairs that are
        far from the others' mean hold every later step back.

        Parameters
        ----------
        wanted : products of cones and of bounds that the direction aims at
        d : that direction
        primal, dual : step lengths of the trial point [-]
        target : product of every pair on the central path

        Returns
        -------
        cone, bound : as of :meth:`products`, shapes (m, c) and (k,)
        """
        trial = self.it.moved(d, primal, dual)

        def move(value: Array) -> Array:
            """Change of products to the nearest end, at most ``WIDE`` targets downwards."""
            return np.maximum(np.clip(value, NARROW * target, WIDE * target) - value, -WIDE * target)

        value = cone_product(self._scaled(trial.x), self._scaled(trial.s, True))
        # the two eigenvalues of a product are value_0 +- |value_1..|; each is moved by itself
        tail = np.sqrt(np.einsum("mc,mc->m", value[:, 1:], value[:, 1:]))
        high, low = move(value[:, 0] + tail), move(value[:, 0] - tail)
        cone = wanted[0].copy()
        cone[:, 0] += 0.5 * (high + low)
        # along the tail, whose direction does not matter where it is zero
        cone[:, 1:] += (0.5 * (high - low) / np.maximum(tail, 1e-300))[:, None] * value[:, 1:]
        return cone, wanted[1] + move(trial.slack * trial.z)

    def carries_dead_load(self) -> bool:
        """Whether forces near this iterate balance the dead load and obey the joint law.

        They are x + dx with the least dx^T H dx, so that dx = H^-1 G^T M^-1 (right - G x): one solution with the factor
        at hand. True is a proof, False says nothing.
        """
        p, x = self.program, self.it.x
        for _ in range(2):  # the second removes the rounding of the first
            rest = p.right - p.matrix @ x.ravel()
            pull = (p.transpose @ self.factor.solve(rest)).reshape(x.shape)
            x = x + kernels.inverse_hessian(self._root, pull)
        balanced = np.abs(p.right - p.matrix @ x.ravel()).max() <= DEAD_LOAD_BALANCE * p.size
        in_cones = (x[:, 0] > np.sqrt((x[:, 1:] ** 2).sum(axis=1))).all()
        return bool(balanced and in_cones and (p.bounded(x) >= p.bound_level).all())
