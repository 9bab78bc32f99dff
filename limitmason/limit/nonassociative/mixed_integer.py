"""Complementarity as a mixed-integer program: extreme multipliers within bounds.

A binary per alternative says which of slack and rate may differ from zero. Bounds on the forces follow from
equilibrium by linear programs; bounds on the velocities are stated, then tightened by linear programs.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import highspy
import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Index
from limitmason.limit.nonassociative.joint_law import ForceState
from limitmason.limit.nonassociative.polish import ACTIVE, PlanePrograms, polish

INF = highspy.kHighsInf

SAME_LINE = 9
"""Decimals of the scaled sliding rows to which points on one line of action agree."""

WHOLE, FEASIBLE = 1e-8, 1e-9
"""HiGHS's tolerances of the mixed-integer program and of its linear programs [-]: chosen, states are polished after."""


class Limits(NamedTuple):
    """Largest forces, slacks and rates, and what they rest on.

    Forces are in mean block loads, rates at mean live velocity one.
    """

    velocity: Array  # largest size of every velocity, (r,)
    normal_low: Array  # least N', (m,)
    normal: Array  # largest N', (m,)
    slack: Array  # of R - T and R + T, (2, m)
    slip: Array  # of z+ and z-, (2, g)
    opening: Array  # of p, (m,)
    forces_assumed: bool  # equilibrium leaves some force without bound: the stated one is used


class Proof(NamedTuple):
    """Answer of the mixed-integer program: best state, proven bound, how it ended."""

    state: ForceState | None
    bound: float  # of the scaled multiplier [-]
    status: str  # HiGHS's word for the end
    nodes: int  # of the branch and bound
    velocity_share: float  # largest velocity of the best state over its bound [-]
    forces_assumed: bool  # the stated bound on forces was needed
    infeasible: bool  # proven: no admissible state within the bounds


class _SilentHighs(highspy.Highs):
    """HiGHS that writes nothing.

    From 1.16 on its constructor prints a banner, before an option can be set.
    """

    def enableCallbacks(self) -> None:
        """Switch the output off in what the constructor calls before it prints."""
        self.setOptionValue("output_flag", False)
        super().enableCallbacks()


def make_model(
    cost: Array, matrix: sparse.sparray, row_low: Array, row_high: Array, low: Array, high: Array, *,
    integer: Array | None = None, maximise: bool = False,
) -> highspy.Highs:
    """HiGHS model of row_low <= matrix x <= row_high, low <= x <= high.

    Parameters
    ----------
    cost : objective, per column, shape (n,)
    matrix : shape (k, n)
    row_low, row_high : shape (k,), infinite for no limit
    low, high : of the columns, shape (n,), infinite for no limit
    integer : whether a column is a whole number, shape (n,); None for none
    maximise : else it is minimised
    """
    model = _SilentHighs()
    model.setOptionValue("output_flag", False)  # where an older one enables no callbacks
    # not threads=1: HiGHS has one scheduler a process, and fails where its number of threads is not the one set before
    model.setOptionValue("parallel", "off")
    columns = sparse.csc_array(matrix)
    program = highspy.HighsLp()
    program.num_col_, program.num_row_ = columns.shape[1], columns.shape[0]
    program.col_cost_ = np.asarray(cost, dtype=float)
    program.col_lower_, program.col_upper_ = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    program.row_lower_, program.row_upper_ = np.asarray(row_low, dtype=float), np.asarray(row_high, dtype=float)
    program.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    program.a_matrix_.start_ = columns.indptr
    program.a_matrix_.index_ = columns.indices
    program.a_matrix_.value_ = columns.data
    program.sense_ = highspy.ObjSense.kMaximize if maximise else highspy.ObjSense.kMinimize
    if integer is not None:
        kinds = (highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger)
        program.integrality_ = [kinds[int(i)] for i in integer]
    model.passModel(program)
    return model


def _maxima(model: highspy.Highs, rows: Array, *, smallest: bool = False) -> Array:
    """Largest, or ``smallest``, values of linear forms within a model's limits, (k,).

    ``rows`` are their coefficients, shape (k, n). A value is infinite where nothing bounds it. The objective of the
    ``model`` is changed.
    """
    count = rows.shape[1]
    index = np.arange(count, dtype=np.int32)
    model.changeObjectiveSense(highspy.ObjSense.kMinimize if smallest else highspy.ObjSense.kMaximize)
    out = np.full(len(rows), -np.inf if smallest else np.inf)
    for k, row in enumerate(rows):
        model.changeColsCost(count, index, np.ascontiguousarray(row))
        model.run()
        if model.getModelStatus() == highspy.HighsModelStatus.kOptimal:
            out[k] = model.getObjectiveValue()
    return out


def sliding_groups(programs: PlanePrograms) -> tuple[Index, Index, sparse.csr_array]:
    """Group of every point (m,), first point of every group (g,), and both as a matrix.

    Points on one line of action, as the two of a plane joint, share one sliding rate and one choice of its sign. The
    matrix, shape (m, g), is 1 where a point belongs to a group.
    """
    columns = np.round(programs.tangent.T.toarray(), SAME_LINE)
    _, first, group = np.unique(columns, axis=0, return_index=True, return_inverse=True)
    m = len(columns)
    spread = sparse.csr_array((np.ones(m), (np.arange(m), group.ravel())), shape=(m, len(first)))
    return group.ravel(), first, spread


class BoundedProgram:
    """Admissible states within bounds as a mixed-integer program.

    Parameters
    ----------
    programs : of a plane problem without crushing
    low, high : scaled multipliers between which states are looked for
    velocity : largest size of every scaled velocity at mean live velocity one, shape (r,)
    force : normal force, in total loads, that is assumed where equilibrium gives no bound

    Attributes
    ----------
    group, first, spread : groups of points that slide together, as of :func:`sliding_groups`
    limits : largest forces, slacks and rates
    """

    def __init__(self, programs: PlanePrograms, low: float, high: float, velocity: Array, force: float) -> None:
        """Bound every slack and rate of the law; arguments are those of the class."""
        self.programs, self.low, self.high = programs, low, high
        self.group, self.first, self.spread = sliding_groups(programs)
        self.limits = self._limits(velocity, force * programs.law.total / programs.unit)

    def _limits(self, velocity: Array, force: float) -> Limits:
        """Ranges of all forces and rates, from which big-M constants are taken.

        Parameters
        ----------
        velocity : bound of every scaled velocity, shape (r,)
        force : normal force assumed where equilibrium gives no bound, in mean block loads
        """
        p, m = self.programs, self.programs.m
        cone, bound = p.cone, p.cone_bound
        # unknowns N', T and lambda
        low = np.concatenate([np.zeros(m), np.full(m, -INF), [self.low]])
        high = np.concatenate([np.full(2 * m, INF), [self.high]])
        model = make_model(
            np.zeros(2 * m + 1), sparse.vstack([p.balance, cone]), np.concatenate([p.load, np.full(2 * m, -INF)]),
            np.concatenate([p.load, bound]), low, high,
        )
        # the range of every force and slack over all admissible forces, by a linear program each
        unit = np.eye(2 * m + 1)[:m]
        normal, normal_low = _maxima(model, unit), np.maximum(_maxima(model, unit, smallest=True), 0.0)
        slack = (_maxima(model, -cone.toarray()) + bound).reshape(2, m)
        assumed = not (np.isfinite(normal).all() and np.isfinite(slack).all())
        normal = np.minimum(normal, force)
        # |T| <= R, so that neither R - T nor R + T is more than 2 R
        slack = np.minimum(slack, 2.0 * p.law.points.in_units_of(p.unit).shear_strength(normal))
        slip, opening = self._largest_rates(velocity, normal_low)
        return Limits(velocity, normal_low, normal, slack, slip, opening, assumed)

    def _largest_rates(self, velocity: Array, normal_low: Array) -> tuple[Array, Array]:
        """Largest z+ and z- of groups, (2, g), and p of points, (m,), by linear programs.

        Parameters
        ----------
        velocity : bound of every scaled velocity, shape (r,)
        normal_low : least N' of every point, in mean block loads, shape (m,)
        """
        programs, m, n, g = self.programs, self.programs.m, self.programs.n, len(self.first)
        law = programs.law
        # n velocities of blocks and two sliding rates a group: (v, z+, z-)
        eye = sparse.eye_array(g)
        sliding = sparse.csr_array(sparse.hstack([programs.tangent.T.tocsr()[self.first], eye, -eye]))
        psi = sparse.diags_array(law.tan_psi) @ self.spread
        # p = N^T v - tan(psi) (z+ + z-), which is not negative
        opens = sparse.csr_array(sparse.hstack([programs.normal.T, -psi, -psi]))
        live = np.concatenate([law.live / law.live_size, np.zeros(2 * g)])
        # lambda live . v = -dead . v + sum (c' + (tan phi - tan psi) N') |e_t|, with N' not below its smallest value
        least = self._power(law.cohesion / programs.unit + (law.tan_phi - law.tan_psi) * normal_low)
        reach = np.abs(programs.tangent).T @ velocity  # no point slides faster, whatever the motion
        top = np.concatenate([reach[self.first], reach[self.first]])
        model = make_model(
            np.zeros(n + 2 * g), sparse.vstack([sliding, opens, live[None, :], least[None, :]]),
            np.concatenate([np.zeros(g + m), [1.0, -INF]]),
            np.concatenate([np.zeros(g), np.full(m, INF), [1.0, self.high]]),
            np.concatenate([-velocity, np.zeros(2 * g)]), np.concatenate([velocity, top]),
        )
        rate = np.hstack([programs.tangent.T.toarray()[self.first], np.zeros((g, 2 * g))])
        slip = np.array([_maxima(model, -rate), _maxima(model, rate)])
        opening = _maxima(model, opens.toarray())
        slip = np.minimum(np.maximum(slip, 0.0), top.reshape(2, g))
        return slip, np.clip(opening, 0.0, np.abs(programs.normal).T @ velocity)

    def _power(self, resistance: Array) -> Array:
        """Row of -dead . v + sum resistance |e_t| over (v, z+, z-), shape (n + 2 g,).

        ``resistance`` to sliding of every point is in mean block loads, shape (m,).
        """
        law, unit = self.programs.law, self.programs.unit
        slip = self.spread.T @ resistance * (unit / law.live_size)
        return np.concatenate([-law.dead / law.live_size, slip, slip])

    def _model(self, maximise: bool) -> tuple[highspy.Highs, dict[str, slice]]:
        """Mixed-integer program of the smallest, or largest, lambda, and its columns.

        A binary chooses in each complementary pair of the law: 0 <= slack <= limit (1 - binary), 0 <= rate <= limit
        binary.
        """
        p, law, m, n, g = self.programs, self.programs.law, self.programs.m, self.programs.n, len(self.first)
        limits, spread = self.limits, self.spread
        sizes = {"N": m, "T": m, "lambda": 1, "v": n, "z+": g, "z-": g, "open": m, "slide+": g, "slide-": g}
        ends = np.cumsum([0, *sizes.values()])
        at = {name: slice(int(a), int(b)) for name, a, b in zip(sizes, ends[:-1], ends[1:], strict=True)}
        rows, row_low, row_high = [], [], []

        def add(low: Sequence[float] | Array, high: Sequence[float] | Array, **parts: Any) -> None:
            """Append rows low <= sum of coefficients times columns <= high.

            ``parts`` holds the coefficients (rows, columns) by the name of their columns; others are zero.
            """
            # columns whose names in ``sizes`` are no names of Python, or a word of it
            names = {"z_plus": "z+", "z_minus": "z-", "plus": "slide+", "minus": "slide-", "lam": "lambda"}
            given = {names.get(k, k): v for k, v in parts.items()}
            count = len(low)
            rows.append(
                sparse.hstack([sparse.csr_array(given.get(k, sparse.csr_array((count, s)))) for k, s in sizes.items()])
            )
            row_low.append(np.asarray(low, dtype=float))
            row_high.append(np.asarray(high, dtype=float))

        eye, mu, eye_g = sparse.eye_array(m), sparse.diags_array(law.tan_phi), sparse.eye_array(g)
        cohesion, free, none = law.cohesion / p.unit, np.full(m, INF), np.zeros(m)
        diagonal = sparse.diags_array
        # forces: equilibrium, and both cones
        add(p.load, p.load, N=p.normal, T=p.tangent, lam=(law.live / p.unit)[:, None])
        add(-cohesion, free, N=mu, T=-eye)
        add(-cohesion, free, N=mu, T=eye)
        # slack <= limit (1 - binary): a point that slides is on its cone, one that opens bears nothing;
        # mu N - T = slack - cohesion
        add(-free, limits.slack[0] - cohesion, N=mu, T=-eye, plus=diagonal(limits.slack[0]) @ spread)
        add(-free, limits.slack[1] - cohesion, N=mu, T=eye, minus=diagonal(limits.slack[1]) @ spread)
        add(-free, limits.normal, N=eye, open=diagonal(limits.normal))
        # rates: sliding to either side, mean live velocity one, opening not below tan(psi) per slip
        tangent = p.tangent.T.tocsr()[self.first]
        add(np.zeros(g), np.zeros(g), v=tangent, z_plus=eye_g, z_minus=-eye_g)
        add([1.0], [1.0], v=(law.live / law.live_size)[None, :])
        psi = diagonal(law.tan_psi) @ spread
        add(none, free, v=p.normal.T, z_plus=-psi, z_minus=-psi)
        # rate <= limit binary, and no group slides to both sides
        add(-free, none, v=p.normal.T, z_plus=-psi, z_minus=-psi, open=-diagonal(limits.opening))
        add(np.full(g, -INF), np.zeros(g), z_plus=eye_g, plus=-diagonal(limits.slip[0]))
        add(np.full(g, -INF), np.zeros(g), z_minus=eye_g, minus=-diagonal(limits.slip[1]))
        add(np.full(g, -INF), np.ones(g), plus=eye_g, minus=eye_g)
        # the power balance, with the normal forces at either end of their range, ties lambda to the velocities
        for normal, least, most in ((limits.normal_low, 0.0, INF), (limits.normal, -INF, 0.0)):
            row = self._power(cohesion + (law.tan_phi - law.tan_psi) * normal)[None, :]
            add([least], [most], lam=[[1.0]], v=-row[:, :n], z_plus=-row[:, n : n + g], z_minus=-row[:, n + g :])
        low, high = np.full(ends[-1], -INF), np.full(ends[-1], INF)
        low[at["N"]], high[at["N"]] = limits.normal_low, limits.normal
        low[at["lambda"]], high[at["lambda"]] = self.low, self.high
        low[at["v"]], high[at["v"]] = -limits.velocity, limits.velocity
        for name, top in (
            ("z+", limits.slip[0]), ("z-", limits.slip[1]), ("slide+", limits.slip[0] > ACTIVE),
            ("slide-", limits.slip[1] > ACTIVE),
            ("open", (limits.opening > ACTIVE) & (limits.normal_low <= ACTIVE)),
        ):
            low[at[name]], high[at[name]] = 0.0, top
        integer = np.zeros(ends[-1], dtype=bool)
        integer[at["open"].start :] = True
        cost = np.zeros(ends[-1])
        cost[at["lambda"]] = 1.0
        model = make_model(
            cost, sparse.vstack(rows), np.concatenate(row_low), np.concatenate(row_high), low, high, integer=integer,
            maximise=maximise,
        )
        return model, at

    def _values(self, state: ForceState, at: dict[str, slice]) -> Array:
        """Columns of an exact state in the program, as a start; ``at``: their places."""
        p, law = self.programs, self.programs.law
        slack, rate = p.slacks(state.force), np.maximum(p.rates(state.velocity), 0.0)
        x = np.zeros(at["slide-"].stop)
        x[at["N"]], x[at["T"]] = slack[0], state.force[1::2] / p.unit
        x[at["lambda"]] = state.multiplier
        x[at["v"]] = state.velocity * (law.live_size / (law.live @ state.velocity))
        x[at["z+"]], x[at["z-"]] = rate[1][self.first], rate[2][self.first]
        x[at["open"]] = rate[0] > ACTIVE
        x[at["slide+"]], x[at["slide-"]] = x[at["z+"]] > ACTIVE, x[at["z-"]] > ACTIVE
        return x

    def solve(
        self, start: ForceState | None, *, largest: bool = False, time_limit: float = 60.0, gap: float = 1e-6,
        verbose: bool = False,
    ) -> Proof:
        """Smallest, or largest, multiplier of an admissible state within the bounds.

        Parameters
        ----------
        start : an exact state to begin with, or None
        time_limit : [s]; the bound proven until then is returned
        gap : between state and bound at which to stop, absolute and relative [-]
        verbose : let HiGHS write its log

        Returns
        -------
        Proof, with an exact state or none.
        """
        model, at = self._model(largest)  # at: places of the unknowns among the columns, by name
        for option, value in (
            ("time_limit", float(time_limit)), ("mip_rel_gap", gap), ("mip_abs_gap", gap),
            ("mip_feasibility_tolerance", WHOLE), ("primal_feasibility_tolerance", FEASIBLE),
        ):
            model.setOptionValue(option, value)
        model.setOptionValue("output_flag", verbose)
        if start is not None:
            solution = highspy.HighsSolution()
            solution.col_value = list(self._values(start, at))
            model.setSolution(solution)
        model.run()
        info = model.getInfo()
        status = model.modelStatusToString(model.getModelStatus())
        x = np.array(model.getSolution().col_value)
        state, velocity_share = None, float("nan")
        feasible = info.primal_solution_status == int(highspy.SolutionStatus.kSolutionStatusFeasible)
        if len(x) == at["slide-"].stop and feasible:
            # at 1 the bound on velocities, which is chosen and not physical, may have cut better states off
            velocity_share = float(np.max(np.abs(x[at["v"]]) / self.limits.velocity))
            state = self._exact(x, at, largest)
        return Proof(
            state=state, bound=float(info.mip_dual_bound), status=status, nodes=int(info.mip_node_count),
            velocity_share=velocity_share, forces_assumed=self.limits.forces_assumed,
            infeasible=model.getModelStatus() == highspy.HighsModelStatus.kInfeasible,
        )

    def _exact(self, x: Array, at: dict[str, slice], largest: bool) -> ForceState | None:
        """Exact state on the alternatives chosen, or near the one that the program holds.

        Parameters
        ----------
        x : solution of the program, all columns
        at : their places by name
        largest : whether the largest multiplier is sought
        """
        found = self._on_alternatives(x, at, largest)
        if found is not None or largest:  # the polish looks for the smallest multiplier only
            return found
        force = np.empty(2 * self.programs.m)
        force[0::2], force[1::2] = x[at["N"]] * self.programs.unit, x[at["T"]] * self.programs.unit
        return polish(self.programs, ForceState(float(x[at["lambda"]][0]), force, x[at["v"]]))

    def _on_alternatives(self, x: Array, at: dict[str, slice], largest: bool) -> ForceState | None:
        """State with the open and sliding points of a point of the program, or None.

        Velocities first, in which only these points open or slide; then forces, whose slack is zero where they do.

        Parameters
        ----------
        x : solution of the program, all columns
        at : their places by name
        largest : whether the largest multiplier is sought
        """
        p = self.programs
        opens, plus, minus = (np.round(x[at[name]]) > 0.5 for name in ("open", "slide+", "slide-"))
        # no point crushes: the program has no binary for that
        moves = np.array([opens, plus[self.group], minus[self.group], np.zeros(p.m, dtype=bool)])
        velocity = p.velocities(zero=~moves)
        if velocity is None:
            return None
        answer = p.forces(theta=-1.0 if largest else 1.0, zero=p.rates(velocity) > ACTIVE)
        if answer is None:
            return None
        return ForceState(answer.multiplier, answer.force, velocity)
