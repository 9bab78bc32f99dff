"""One step as a convex cone program in the forces, with the multiplier free: limit points need no arc length.

min 1/2 (f - f0)' C (f - f0) - lambda du   s.t.   A f + dead + lambda live = 0,  N >= -t,
|T| <= c + (tan(phi) - tan(psi)) N_bar + tan(psi) N, with A of the present pose and f0 the elastic forces there; an open
gap is a linear cost. The multipliers of equilibrium are the pose increment. N_bar is the normal force of the previous
program (Haslinger's fixed point); with psi = phi it drops out and one program is exact for its pose.
"""

from typing import Any, NamedTuple

import clarabel
import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.capacity.point_law import PlasticHistory
from limitmason.capacity.system import Evaluated, System
from limitmason.mechanics.law import PointLaw

TOLERANCE = 1e-12
"""Of the interior point [-]: 1e-10 stalls the path at 2e-5 of a block's weight."""

_ITERATIONS, _RATIO = 100, 1e-9
"""Iterations of the interior point at most, and its ratio of kappa to tau by which a program has no answer: chosen."""


class Entries(NamedTuple):
    """Entries of a sparse matrix: rows, columns and values, shapes (e,); those at one place add up."""

    row: Index
    column: Index
    value: Array


class Stepped(NamedTuple):
    """Answer of a program.

    Parameters
    ----------
    motion : of the free unknowns in own units of the system, shape (order,)
    force : of the points, normal first, compression positive [N], shape (m, c)
    multiplier : of the live load [-]
    """

    motion: Array
    force: Array
    multiplier: float


def solve_step(
    system: System,
    at: Evaluated,
    old: PlasticHistory,
    elastic: Array,
    normal: Array | None,
    advance: float | None,
    multiplier: float = 0.0,
    viscosity: float = 0.0,
    done: Array | None = None,
) -> Stepped | None:
    """Solve the program of a step in a pose, or None where the solver finds no answer.

    Parameters
    ----------
    system : equations of the path's blocks and points
    at : the pose, with its damage and the blocks' own deformation
    old : history at the start of the step
    elastic : f0, the forces without limits in that pose [N], (m, c)
    normal : N_bar [N], (m,); None for the associative program, which needs none
    advance : what is left of the live-conjugate displacement, live . motion [N m]; None at a given multiplier
    multiplier : where ``advance`` is None [-]
    viscosity : eta of a viscous force against the motion, own units; 0 for none
    done : motion since the viscous force was nothing, own units; none by default
    """
    m, c = elastic.shape
    law = system.law.strength_at(at.returned.history.damage)
    area, force = system.bodies.area, system.weight
    stiffness = np.column_stack([system.law.kn, *[system.law.ks] * (c - 1)]) * area[:, None] * system.length / force
    compliance = (1.0 / stiffness).ravel()
    start = (elastic / force).ravel()
    order, free = system.order, advance is not None  # unknown motions, and whether the multiplier is an unknown too
    left = 0.0 if advance is None else advance
    dead, live = system.applied(at.pose)
    if not free:
        dead = dead + multiplier * live
    if done is not None:
        dead = dead - viscosity * done
    if system.bodies.deforming:
        dead = dead + system.sprung(at.pose)
    # unknowns x are the points' forces and what follows, at the cost x' P x / 2 + q' x with P diagonal
    entries = [_equilibrium(system, at.wrenches)]
    p = [compliance]
    q = [-compliance * start]
    unknowns = len(compliance)
    if free:
        acts = np.flatnonzero(live)
        entries.append(Entries(acts, np.full(len(acts), unknowns), live[acts]))
        p.append(np.zeros(1))
        q.append(np.array([-left / (force * system.length)]))
        unknowns += 1
    # A f + w = r * motion with r the viscosity and the springs of shapes: one more force y at the cost y^2 / (2 r)
    resisting = viscosity + system.springs_own
    held = np.flatnonzero(resisting > 0.0)
    entries.append(Entries(held, unknowns + np.arange(len(held)), np.ones(len(held))))
    p.append(1.0 / resisting[held])
    q.append(np.zeros(len(held)))
    unknowns += len(held)
    ties = system.ties
    if len(ties.length):  # 0 <= T <= strength, at the same cost as a point's force
        soft = force / (ties.stiffness * system.length)
        pulls = _columns(system, at.pulled.wrenches, system.tie_ends)
        entries.append(pulls._replace(column=unknowns + pulls.column))
        p.append(soft)
        q.append(-soft * ties.stiffness * (at.pulled.elongation - old.stretched) / force)
        unknowns += len(ties.length)
    bounds, limit, cones = _bounds(system, law, normal, c, unknowns)
    row, column, value = (np.concatenate(x) for x in zip(*entries, *bounds, strict=True))
    # made at once: a sparse matrix of each part, joined, takes longer than the solver does on few points
    matrix = sparse.csc_matrix((value, (row, column)), shape=(order + len(limit), unknowns))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _ITERATIONS
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    settings.tol_ktratio = _RATIO
    cost = np.concatenate(p)
    on = np.flatnonzero(cost)
    quadratic = sparse.csc_matrix((cost[on], (on, on)), shape=(unknowns, unknowns))
    kinds, right = [clarabel.ZeroConeT(order), *cones], np.concatenate([-dead, limit])
    found = clarabel.DefaultSolver(quadratic, np.concatenate(q), matrix, right, kinds, settings).solve()
    if str(found.status) not in ("Solved", "AlmostSolved"):
        return None
    x, z = np.array(found.x), np.array(found.z)  # z: the multipliers, of the equations of equilibrium the motion
    return Stepped(z[:order], x[: c * m].reshape(m, c) * force, float(x[c * m]) if free else multiplier)


def _equilibrium(system: System, wrenches: Array) -> Entries:
    """Entries of the wrench matrix of a pose in own units on the free degrees of freedom, shape (order, c m)."""
    m, c, *ends = wrenches.shape
    return _columns(system, wrenches.reshape(m * c, *ends), np.repeat(system.ends, c, axis=0))


def _columns(system: System, wrenches: Array, ends: Index) -> Entries:
    """Wrenches [N, N m] on two blocks each, (k, 2, d), at rows ``ends``, -1 for held, as columns in own units.

    Those are of a mean block weight in every point or tie.
    """
    values = wrenches * system.row_scale * system.weight
    columns = np.broadcast_to(np.arange(len(values))[:, None, None], values.shape)
    keep = ends >= 0
    return Entries(ends[keep], columns[keep], values[keep])


def _bounds(
    system: System, law: PointLaw, normal: Array | None, c: int, unknowns: int
) -> tuple[list[Entries], Array, list[Any]]:
    """Rows G, right sides h and cones of what points and ties bear at most, h - G x in the cone, in mean block weights.

    The rows follow those of equilibrium.

    Rows and cones come in one order: pull, crushing, ties, and shear in plane, all in the nonnegative cone; in space
    then a second-order cone for each point.

    Parameters
    ----------
    system : points and ties
    law : strengths of the points [Pa]
    normal : N_bar [N], as in :func:`solve_step`
    c : force components of a point
    unknowns : of the program; forces of points come first and those of ties last
    """
    area, force, ties = system.bodies.area, system.weight, system.ties
    m, t = len(area), len(ties.length)
    rows = np.arange(m)  # of the points, whose normal forces are the unknowns c * rows
    bears = law.over(area).in_units_of(force)
    if normal is not None:
        # friction psi, with the shear strength that phi gives under the last normal forces
        bears = bears.frozen(normal / force)
    tan, fixed = bears.tan_phi, bears.cohesion
    one = np.ones(m)
    entries: list[Entries] = []
    limit = np.zeros(0)

    def bounded(row: Index, column: Index, value: Array, most: Array) -> None:
        """Rows of value x <= most."""
        nonlocal limit
        entries.append(Entries(system.order + len(limit) + row, column, value))
        limit = np.append(limit, most)

    bounded(rows, c * rows, -one, bears.tension)
    crushes = np.flatnonzero(bears.crushes)
    if len(crushes):
        bounded(np.arange(len(crushes)), c * crushes, np.ones(len(crushes)), bears.crushing[crushes])
    cones: list[Any] = [clarabel.NonnegativeConeT(len(crushes) + (m if c == 3 else 3 * m) + 2 * t)]
    if t:
        for sign, most in ((-1.0, np.zeros(t)), (1.0, ties.strength / force)):
            bounded(np.arange(t), np.arange(unknowns - t, unknowns), np.full(t, sign), most)
    if c == 2:
        for sign in (1.0, -1.0):
            # both signs of the shear: +-T - tan N <= c
            columns = np.concatenate([2 * rows + 1, 2 * rows])
            bounded(np.tile(rows, 2), columns, np.concatenate([sign * one, -tan]), fixed)
    else:
        # (c + tan N, T1, T2) in the second-order cone, as constant less rows times x
        where = np.concatenate([3 * rows, 3 * rows + 1, 3 * rows + 2])
        most = np.column_stack([fixed, np.zeros((m, 2))]).ravel()
        bounded(where, where, np.concatenate([-tan, -one, -one]), most)
        cones += [clarabel.SecondOrderConeT(3)] * m
    return entries, limit, cones
