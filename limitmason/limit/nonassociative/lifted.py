"""A lower bound on admissible multipliers without bounds: products as variables.

Let x = (N', T, lambda, 1) and y = (v, z+). Every product of a linear condition on x with one on y is linear in
Y = x y^T, complementarity included, so that minimising lambda over Y bounds it from below (the first level of the
reformulation-linearisation technique). The normalisation live . v = live_size gives back x = Y live / live_size.
"""

from typing import NamedTuple

import highspy
import numpy as np
from scipy import sparse

from limitmason.arrays import Array
from limitmason.limit.nonassociative.deadline import NEVER, Deadline
from limitmason.limit.nonassociative.mixed_integer import INF, make_model, sliding_groups
from limitmason.limit.nonassociative.polish import PlanePrograms

MAX_ROWS = 200_000
"""Larger programs than this take minutes and gigabytes."""


class LiftedBound(NamedTuple):
    """Lower bound of the scaled multiplier: the dual value, less its residual's cost.

    The value is recomputed with numpy.
    """

    value: float  # [-], minus infinity where the program is not solved
    residual: float  # largest violation of dual feasibility
    status: str  # HiGHS's word for the end


def lifted_rows(programs: PlanePrograms) -> int:
    """Number of product rows, to judge the effort beforehand."""
    _, first, _ = sliding_groups(programs)
    m, n, g = programs.m, programs.n, len(first)
    return n * (n + g) + (3 * m + 2) * (m + 2 * g + 1)


def _program(programs: PlanePrograms, low: float, high: float) -> tuple[Array, sparse.csc_array, Array, Array]:
    """Linear program over Y, flattened by rows: cost, matrix, and ends of rows.

    The unity row, 1 times live . v, is the only one whose ends are not zero or infinite: both are one.

    Parameters
    ----------
    low, high : scaled multipliers that bound lambda [-]
    """
    law, m, n = programs.law, programs.m, programs.n
    group, first, spread = sliding_groups(programs)
    g = len(first)
    nx, ny = 2 * m + 2, n + g
    eye, mu = sparse.eye_array(m), sparse.diags_array(law.tan_phi)
    nothing, void = sparse.csr_array((m, 1)), sparse.csr_array((m, m))
    cohesion = sparse.csr_array((law.cohesion / programs.unit)[:, None])

    # conditions on x, whose columns are N', T, lambda and 1:
    # equilibrium, then N', R - T, R + T, high - lambda, lambda - low, all >= 0
    balance = sparse.hstack([programs.balance, sparse.csr_array(-programs.load[:, None])])
    one, ends = np.zeros((1, nx)), np.zeros((2, nx))
    one[0, -1] = 1.0
    ends[0, -2:], ends[1, -2:] = (-1.0, high), (1.0, -low)
    slack = sparse.vstack([
        sparse.hstack([eye, void, nothing, nothing]), sparse.hstack([mu, -eye, nothing, cohesion]),
        sparse.hstack([mu, eye, nothing, cohesion]), sparse.csr_array(ends),
    ])
    # conditions on y: p, z+, z- >= 0 and live . v > 0, with z- = e_t + z+
    plus = sparse.hstack([sparse.csr_array((g, n)), sparse.eye_array(g)])
    minus = sparse.hstack([programs.tangent.T.tocsr()[first], sparse.eye_array(g)])
    dilation = sparse.diags_array(law.tan_psi) @ spread @ (plus + minus)
    opening = sparse.hstack([programs.normal.T, sparse.csr_array((m, g))]) - dilation
    live = sparse.csr_array(np.concatenate([law.live / law.live_size, np.zeros(g)])[None, :])
    rate = sparse.vstack([opening, plus, minus, live])

    # row a, b of a Kronecker product with Y flattened by rows is a Y b: equations times every y are zero, inequalities
    # on x times those on y are not negative
    equal = sparse.kron(balance, sparse.eye_array(ny))
    unity = sparse.kron(sparse.csr_array(one), live)
    products = sparse.kron(slack, rate, format="csr")
    # complementarity: the product of N' and p, of R - T and z+, of R + T and z- is zero at every point
    i, width = np.arange(m), rate.shape[0]
    high_row = np.full(products.shape[0], INF)
    pairs = (i * width + i, (m + i) * width + m + group, (2 * m + i) * width + m + g + group)
    high_row[np.concatenate(pairs)] = 0.0
    matrix = sparse.csc_array(sparse.vstack([equal, unity, products]))
    matrix.eliminate_zeros()
    fixed = equal.shape[0]
    row_low = np.concatenate([np.zeros(fixed), [1.0], np.zeros(products.shape[0])])
    row_high = np.concatenate([np.zeros(fixed), [1.0], high_row])
    cost = np.zeros(nx * ny)
    cost[(nx - 2) * ny : (nx - 1) * ny] = live.toarray()[0]
    return cost, matrix, row_low, row_high


def lifted_bound(programs: PlanePrograms, low: float, high: float, deadline: Deadline = NEVER) -> LiftedBound:
    """Smallest lambda of the lifted linear program.

    Parameters
    ----------
    programs : of a plane problem without crushing
    low, high : scaled multipliers that bound lambda: zero and the associative value
    deadline : at which the solver stops, without a bound

    Returns
    -------
    LiftedBound of the scaled multiplier, for any forces and velocities.

    Notes
    -----
    Source: Sherali and Adams (1990). Exact on most small walls, never above the smallest admissible multiplier. The
    value is that of the dual vector, made feasible in sign and charged with its residual times the size of the primal
    solution: a numerical proof, not one in exact arithmetic.
    """
    cost, matrix, row_low, row_high = _program(programs, low, high)
    free = np.full(len(cost), INF)
    model = make_model(cost, matrix, row_low, row_high, -free, free)
    # any dual vector gives a bound: an interior point serves, without the way from there to a vertex
    model.setOptionValue("solver", "ipm")
    model.setOptionValue("run_crossover", "off")
    model.setOptionValue("time_limit", deadline.at_least())
    model.run()
    status = model.modelStatusToString(model.getModelStatus())
    if model.getModelStatus() != highspy.HighsModelStatus.kOptimal:
        return LiftedBound(-np.inf, np.inf, status)
    solution = model.getSolution()
    primal, dual = np.array(solution.col_value), np.array(solution.row_dual)
    # only equalities may carry duals of either sign; the dual value is the sum of lower ends times duals
    dual = np.where(row_low == row_high, dual, np.maximum(dual, 0.0))
    residual = np.abs(cost - matrix.T @ dual)
    value = float(row_low @ dual) - float(residual @ np.abs(primal))
    return LiftedBound(value, float(residual.max(initial=0.0)), status)
