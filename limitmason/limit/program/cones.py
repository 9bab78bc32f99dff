"""The joint law as cones: linear rows and second-order cones on scaled forces.

Every row reads  bound + coefficients . f  >= 0, or belongs to a second-order cone s_0 >= |(s_1, ...)| of such rows.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.limit.program.static_theorem import Problem

TYPICAL_SHARE = 0.25
"""Normal force that a crushing section is expected to carry, over the total load [-]: chosen, it only scales rows."""


class Cones(NamedTuple):
    """Rows constant + matrix f in an orthant and second-order cones of given sizes."""

    matrix: sparse.csr_array  # (rows, c m), on the scaled forces
    constant: Array  # scaled forces [-], (rows,)
    n_linear: int  # rows >= 0, which come first
    cone_sizes: tuple[int, ...]  # rows of every second-order cone after them


class TorsionLimit(NamedTuple):
    """Linearisation of the torsion limit about the last centres of pressure."""

    interface: Index  # (j,)
    pole: Array  # centre of pressure [m], (j, 3)
    radius: Array  # polar mean radius of the compressed area, above zero [m], (j,)


class _Rows:
    """Collects sparse rows in groups of equal pattern."""

    def __init__(self) -> None:
        self.row: list[Index] = []
        self.col: list[Index] = []
        self.val: list[Array] = []
        self.constant: list[Array] = []
        self.count = 0

    def add(self, columns: Index, values: Array, constant: Array) -> None:
        """Append n rows of k coefficients each.

        ``columns``: unknown of every coefficient, shape (n, k); ``values``: the coefficients, and ``constant``: of
        every row, shape (n,), both of that shape or one that broadcasts to it.
        """
        n, k = columns.shape
        self.row.append(np.repeat(self.count + np.arange(n), k))
        self.col.append(columns.ravel())
        self.val.append(np.broadcast_to(values, columns.shape).ravel())
        self.constant.append(np.broadcast_to(constant, (n,)))
        self.count += n


def make_cones(problem: Problem, *, torsion: TorsionLimit | None = None) -> Cones:
    """The joint law of every contact point.

    Coulomb: |T| <= c + tan(phi) N, a second-order cone in 3-D and two half-planes in plane. Cut-off: N >= -ft, only
    where the cone's apex lies below it. Crushing: N <= fc per point of a grid, or the exact stress block
    N_i >= (N_1 + N_2)^2 / (2 Q) of an in-plane section with capacity Q = fc A, which is
    |M| <= N L / 2 - N^2 / (2 fc t) in terms of the end forces. With tension the stress block is shifted by ft.

    Parameters
    ----------
    problem : whose unknowns f are the scaled forces of every point: normal (compression > 0), then tangents
    torsion : adds |(V, M_t / r_m)| <= tan(phi) N + c A per interface, an estimate, see :mod:`limitmason.limit.torsion`

    Returns
    -------
    Cones: linear rows first, then the cones of friction, of stress blocks and of torsion.
    """
    c, m = problem.components, problem.points.count
    column = c * np.arange(m)
    law = problem.law
    mu, cohesion, tension = law.tan_phi, law.cohesion, law.tension
    linear = _Rows()
    cut = law.cut_off
    cut[problem.stress_block.ends] = False  # the stress block, counted from the tension corner, limits tension as well
    linear.add(column[cut, None], np.ones(1), tension[cut])
    crushed = law.crushes
    linear.add(column[crushed, None], -np.ones(1), law.crushing[crushed])
    # without friction and cohesion the rows of shear ask T = 0 alone and say nothing of N
    smooth = (mu == 0) & (cohesion == 0)
    if c == 2:
        pair = np.column_stack([column, column + 1])
        for sign in (1.0, -1.0):
            linear.add(pair, np.column_stack([mu, np.full(m, sign)]), cohesion)
        if smooth.any():  # also at the ends of stress blocks, left out above; elsewhere it repeats the cut-off
            linear.add(column[smooth, None], np.ones(1), tension[smooth])
    n_linear = linear.count

    sizes: list[int] = []
    if c == 3:
        # rows of one cone next to each other: c + tan(phi) N, T_1, T_2 of the first point, then of the second
        order = np.argsort(np.tile(np.arange(m), 3), kind="stable")
        columns = np.concatenate([column, column + 1, column + 2])[order]
        values = np.concatenate([mu, np.ones(2 * m)])[order]
        constants = np.concatenate([cohesion, np.zeros(2 * m)])[order]
        linear.add(columns[:, None], values[:, None], constants)
        sizes += [3] * m
    if problem.stress_block.count:
        _add_stress_blocks(problem, linear)
        sizes += [3] * (2 * problem.stress_block.count)
    if torsion is not None and len(torsion.interface):
        _add_torsion(problem, torsion, linear)
        sizes += [4] * len(torsion.interface)
    matrix = sparse.csr_array(
        sparse.coo_array(
            (np.concatenate(linear.val), (np.concatenate(linear.row), np.concatenate(linear.col))),
            shape=(linear.count, c * m),
        )
    )
    return Cones(matrix, np.concatenate(linear.constant), n_linear, tuple(sizes))


def _add_stress_blocks(problem: Problem, rows: _Rows) -> None:
    """Add cones of crushing sections: N_i' >= (N_1' + N_2')^2 / (2 Q) at both ends.

    N_i' = N_i + t / 2, with N_i the normal force of an end, t and Q the section's strength in tension and compression.
    ``rows`` are added to, three per cone and next to each other.
    """
    first, second = problem.stress_block.ends.T
    capacity, shift = problem.stress_block.capacity, problem.stress_block.tension
    # a share of the total load, which is what joint forces add up to; without any, no force is typical
    typical = TYPICAL_SHARE * np.abs(problem.dead).sum() or np.inf
    for end in (first, second):
        # N'^2 <= 2 Q N_i'  as  |(sqrt(2) N', Q/k - k N_i')| <= Q/k + k N_i', rows of one cone next to each other;
        # k balances capacity against force, else their difference drowns in rounding when Q is far above N
        unknowns = problem.components * np.column_stack([end, first, second])
        root = np.sqrt(2.0)
        k = np.sqrt(capacity / np.minimum(capacity, typical))
        values = np.zeros((len(end), 3, 3))  # of every section: three rows, on N_i, N_1 and N_2
        values[:, 0, 0], values[:, 2, 0] = k, -k
        values[:, 1, 1:] = root
        half = 0.5 * k * shift
        constant = np.column_stack([capacity / k + half, root * shift, capacity / k - half]).ravel()
        rows.add(np.repeat(unknowns, 3, axis=0), values.reshape(-1, 3), constant)


def _add_torsion(problem: Problem, torsion: TorsionLimit, rows: _Rows) -> None:
    """Add the cone of torsion of joints: moment about a pole <= radius x N.

    The row pair reads |(sum T_1, sum T_2, M / radius)| <= sum(tan(phi) N + c A) over the points of a joint, M about its
    normal through the pole.

    Parameters
    ----------
    torsion : poles [m] and radii [m] of the joints
    rows : are added to, four per joint in the order of the formula, the bound first
    """
    x = problem.assembly.arrays
    points = problem.points
    for k, pole, radius in zip(torsion.interface, torsion.pole, torsion.radius, strict=True):
        p = np.flatnonzero(points.interface == k)
        n = x.normal[k]
        # moment about the normal of a unit force along every direction of every point [m], (points, 3)
        moment = np.einsum("pci,i->pc", np.cross((points.position[p] - pole)[:, None], points.directions[p]), n)
        columns = (3 * p[:, None] + np.arange(3)).ravel()
        width = len(columns)
        values = np.zeros((4, width))
        values[0, 0::3] = problem.law.tan_phi[p]
        values[1, 1::3] = 1.0
        values[2, 2::3] = 1.0
        values[3] = (moment / radius).ravel()
        constant = np.array([problem.law.cohesion[p].sum(), 0.0, 0.0, 0.0])
        rows.add(np.broadcast_to(columns, (4, width)), values, constant)
