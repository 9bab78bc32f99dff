"""Cone programs over forces that equilibrium and a joint law admit.

Clarabel keeps its set-up from solve to solve: only the objective or the right-hand side may change.
"""

import clarabel
import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Flags
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, normalised
from limitmason.limit.program.clarabel_solver import solver_settings

TOLERANCE = 1e-12
"""Of the interior-point programs: the alternation cannot come closer to the law than they do."""


GRACE = 1.0
"""Time that a program has at least, though the search that it is part of has less left [s]."""

ITERATIONS, ITERATIONS_OF_SLOPE = 200, 100
"""Iterations of a program of the true law, and of one with given slopes, at most: chosen."""


class ForceProgram:
    """Forces with |T| <= r + slope N', 0 <= N' <= q, balancing dead + lambda live.

    The unknowns are the forces (N', T) of every point, scaled and counted from the tension corner, and lambda.

    Parameters
    ----------
    law : of the problem
    slope : of the cones [-], shape (m,): r is then given with every solve and lambda may be negative; None is the true
        law, with lambda >= 0
    opening : points held at N' = 0, shape (m,)
    sliding : points held at T = -(c' + tan(phi) N') d, shape (m,)
    direction : unit sliding directions d, shape (m, c - 1); shear acts against them
    closing : points held at N' = q, where joints crush or ties yield, shape (m,)
    tolerance : of the interior-point method [-]
    deadline : at which a program that is being solved ends, without an answer

    Attributes
    ----------
    _objective, _bound : of the unknowns, shape (c m + 1,), and right-hand side of all rows; changed from solve to solve
    _equations : number of the equilibrium rows, which come first
    _cones : row at which those of |T| <= r + slope N' begin
    """

    def __init__(
        self, law: JointLaw, *, slope: Array | None = None, opening: Flags | None = None, sliding: Flags | None = None,
        direction: Array | None = None, closing: Flags | None = None, tolerance: float = TOLERANCE,
        deadline: Deadline = NEVER,
    ) -> None:
        """Set up rows: equations, orthant, cones; arguments are those of the class."""
        m, c = len(law.tan_phi), law.components
        self.law, self.deadline, n = law, deadline, c * m
        none = np.zeros(m, dtype=bool)
        opening, sliding, closing = (none if x is None else x for x in (opening, sliding, closing))
        normal = c * np.arange(m)  # columns of N'; those of T follow each, the last of all is lambda
        one = sparse.eye_array(n + 1, format="csr")  # row k picks unknown k
        # equations: equilibrium, then points that are held
        equal = [sparse.hstack([law.matrix, sparse.csc_array(law.live[:, None])]), one[normal[opening]],
                 one[normal[closing]]]
        right = [-law.dead, np.zeros(int(opening.sum())), law.crushing[closing]]
        s = np.flatnonzero(sliding)  # numbers of the points held sliding
        # T_k + d_k tan(phi) N' = -d_k c', one row per tangent
        for k, along in enumerate(() if direction is None else direction[s].T):
            equal.append(one[normal[s] + 1 + k] + sparse.diags_array(along * law.tan_phi[s]) @ one[normal[s]])
            right.append(-along * law.cohesion[s])
        crushed = np.flatnonzero(np.isfinite(law.crushing))
        free = np.flatnonzero(~sliding)
        # rows of slope_rows that belong to points not held sliding
        kept = np.concatenate([free, m + free]) if c == 2 else (3 * free[:, None] + np.arange(3)).ravel()
        cone = slope_rows(law.tan_phi if slope is None else slope, c, n + 1)[kept]
        # N' and lambda not below zero: a negative multiplier belongs to the opposite load
        low = np.append(normal, n) if slope is None else normal
        matrix = sparse.csc_matrix(sparse.vstack([*equal, -one[low], one[normal[crushed]], -cone]))
        self._equations = law.matrix.shape[0]
        # bound - matrix x is zero, not negative, or in a cone; the constants of the cones change from solve to solve
        zeros, linear = sum(len(b) for b in right), len(low) + len(crushed)
        self._cones = zeros + linear
        bound = np.zeros(matrix.shape[0])
        bound[:zeros] = np.concatenate(right)
        bound[zeros + len(low) : self._cones] = law.crushing[crushed]
        kinds = [clarabel.ZeroConeT(zeros), clarabel.NonnegativeConeT(linear + (len(kept) if c == 2 else 0))]
        kinds += [clarabel.SecondOrderConeT(3)] * (len(free) if c == 3 else 0)
        settings = solver_settings(tolerance, max_iterations=ITERATIONS if slope is None else ITERATIONS_OF_SLOPE)
        # presolve would forbid updating the right-hand side
        settings.presolve_enable = False
        self._bound, self._objective = bound, np.zeros(n + 1)
        self._constant(law.cohesion[free])
        self._arguments = (matrix, kinds, settings)
        self._solver: clarabel.DefaultSolver | None = None

    def _constant(self, constant: Array) -> None:
        """Set r, the cone's ``constant`` [-], of points that are not held sliding."""
        if self.law.components == 2:  # two rows r + slope N' -+ T >= 0; in space r stands in the first of three rows
            self._bound[self._cones :] = np.tile(constant, 2)
        else:
            self._bound[self._cones :: 3] = constant

    def _answer(self, changed: str) -> clarabel.DefaultSolution:
        """Solve after a change: ``changed`` is the objective, "q", or right side, "b".

        The solver is made once: an update keeps its factorisation of the pattern.
        """
        matrix, kinds, settings = self._arguments
        settings.time_limit = max(self.deadline.left, GRACE)
        if self._solver is None:
            n = len(self._objective)
            quadratic = sparse.csc_matrix((n, n))
            self._solver = clarabel.DefaultSolver(quadratic, self._objective, matrix, self._bound, kinds, settings)
        elif changed == "q":
            self._solver.update(q=self._objective, settings=settings)
        else:
            self._solver.update(b=self._bound, settings=settings)
        return self._solver.solve()

    def solve(self, theta: float, weight: Array | None = None) -> tuple[float, Array] | None:
        """Multiplier and forces f = (N', T) of least theta lambda + weight . f, or None.

        Parameters
        ----------
        theta : price of the multiplier [-]: 1 looks for the smallest, -1 for the largest
        weight : price of every force component [-], shape (c m,); None for no price

        Returns
        -------
        multiplier, force : scaled [-]; the latter of shape (c m,)
        """
        self._objective = np.zeros(len(self._objective))
        self._objective[-1] = theta
        if weight is not None:
            self._objective[:-1] = weight
        answer = self._answer("q")
        x = np.array(answer.x)
        if str(answer.status) not in ("Solved", "AlmostSolved") or not np.isfinite(x).all():
            return None
        return float(x[-1]), x[:-1]

    def largest(self, constant: Array) -> tuple[str, ForceState | None]:
        """Clarabel's status and the state of the largest lambda for r = ``constant``.

        ``constant`` is of every point, scaled [-], shape (m,). The velocities are the duals, with e_n >= slope |e_t|.
        There is no state where the live load has no power on them, or where the solver leaves numbers that are not
        finite.
        """
        self._constant(constant)
        self._objective[-1] = -1.0
        answer = self._answer("b")
        x, dual = np.array(answer.x), np.array(answer.z)[: self._equations]
        velocity = normalised(self.law, dual)
        if velocity is None or not (np.isfinite(x).all() and np.isfinite(velocity).all()):
            return str(answer.status), None
        return str(answer.status), ForceState(float(x[-1]), x[:-1], velocity)


def slope_rows(slope: Array, components: int, columns: int) -> sparse.csr_array:
    """Rows slope N' -+ T in plane, upper signs first, or (slope N', T1, T2) in 3-D.

    Parameters
    ----------
    slope : of every point [-], shape (m,)
    components : of a point's force, c
    columns : columns of the rows, of which the first c m are the forces'
    """
    m = len(slope)
    i = np.arange(m)
    normal = components * i
    if components == 2:
        row = np.concatenate([i, i, m + i, m + i])
        column = np.concatenate([normal, normal + 1, normal, normal + 1])
        value = np.concatenate([slope, -np.ones(m), slope, np.ones(m)])
        return sparse.csr_array((value, (row, column)), shape=(2 * m, columns))
    row = np.concatenate([3 * i, 3 * i + 1, 3 * i + 2])
    value = np.concatenate([slope, np.ones(2 * m)])
    return sparse.csr_array((value, (row, row)), shape=(3 * m, columns))
