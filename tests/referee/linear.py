"""Linear programs to (nearly) full double precision: HiGHS, then the same program for what is left over, blown up.

HiGHS stops at an absolute tolerance of 1e-10. Solving again for the residuals, multiplied up to order one, gains the
same number of digits once more (iterative refinement of linear programs, Gleixner, Steffy and Wolter, 2016).
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

Array = np.ndarray

OPTIMAL, UNBOUNDED, INFEASIBLE, UNKNOWN = "optimal", "unbounded", "infeasible", "unknown"
_OPTIONS = {
    "primal_feasibility_tolerance": 1e-10,
    "dual_feasibility_tolerance": 1e-10,
    "maxiter": 2000,  # a hundred times what these programs need: at this tolerance the simplex may cycle for ever
    "time_limit": 2.0,
}


class Answer(NamedTuple):
    """Maximiser, its value, the multipliers of the equalities, and what is left over in primal and dual [-]."""

    status: str
    x: Array | None = None
    value: float = np.nan
    dual: Array | None = None
    primal_residual: float = np.inf
    dual_residual: float = np.inf


def maximise(objective: Array, equal: Array, right: Array, below: Array, limit: Array, rounds: int = 4) -> Answer:
    """Maximise objective . x subject to equal x = right and below x <= limit, x free.

    Parameters
    ----------
    rounds : of refinement at most; it stops when primal and dual residuals are below 1e-13
    """
    n, m, k = len(objective), len(right), len(limit)
    # with slack: one system of equations, one sign condition
    matrix = sparse.csr_array(np.block([[equal, np.zeros((m, k))], [below, np.eye(k)]]))
    b = np.concatenate([right, limit])
    c = np.concatenate([-objective, np.zeros(k)])
    low = np.concatenate([np.full(n, -np.inf), np.zeros(k)])
    x, y, blow, blow_dual = np.zeros(n + k), np.zeros(m + k), 1.0, 1.0
    best = Answer(UNKNOWN)
    for turn in range(rounds):
        rest, cost = b - matrix @ x, c - matrix.T @ y
        bound = np.where(np.isfinite(low), (low - x) * blow, low)
        bounds = np.column_stack([bound, np.full(n + k, np.inf)])
        answer = None
        for method in ("highs", "highs-ipm", "highs-ds"):
            answer = linprog(
                cost * blow_dual, A_eq=matrix, b_eq=rest * blow, bounds=bounds,
                method=method, options=_OPTIONS,
            )
            if answer.status in (0, 2, 3):
                break
        if turn == 0 and answer.status in (2, 3):
            return Answer(INFEASIBLE if answer.status == 2 else UNBOUNDED)
        if answer.status != 0:
            break
        x = x + answer.x / blow
        y = y + answer.eqlin.marginals / blow_dual
        rest, cost = b - matrix @ x, c - matrix.T @ y
        primal = max(np.abs(rest).max(initial=0.0), (-x[n:]).max(initial=0.0))
        dual = max(
            np.abs(cost[:n]).max(initial=0.0), (-cost[n:]).max(initial=0.0), np.abs(cost[n:] * x[n:]).max(initial=0.0)
        )
        if primal + dual < best.primal_residual + best.dual_residual or best.x is None:
            best = Answer(OPTIMAL, x[:n], float(objective @ x[:n]), -y[:m], float(primal), float(dual))
        if max(primal, dual) < 1e-13:
            break
        blow = min(1.0 / max(primal, 1e-14), 1e6 * blow)
        blow_dual = min(1.0 / max(dual, 1e-14), 1e6 * blow_dual)
    return best
