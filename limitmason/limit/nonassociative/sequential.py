"""Sequential scheme for psi < phi: associative programs whose friction cones are frozen at the last forces."""

import time
from typing import NamedTuple

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from limitmason.limit.nonassociative.joint_law import ForceState, JointLaw, excess, normalised, split
from limitmason.limit.program.static import solver_settings

Array = NDArray[np.float64]

USABLE = ("Solved", "AlmostSolved", "InsufficientProgress")
"""Solver endings whose iterate is worth polishing: the true law is checked afterwards in any case."""


class SchemeSettings(NamedTuple):
    """Settings of the scheme: ``slope`` a and ``offset`` c0 open the frozen cone, ``mixing`` b weighs new forces."""

    slope: float = 0.005
    mixing: float = 0.6
    offset: float = 1e-5

    def __str__(self) -> str:
        """The settings in words."""
        return f"a = {self.slope:.3g}, b = {self.mixing:.3g}, c0 = {self.offset:.1g}"


class SchemeRun(NamedTuple):
    """Where a run of the scheme ended; ``state`` is None when even the first program failed."""

    state: ForceState | None
    steps: int
    variant: SchemeSettings  # the settings in the end, after restarts
    excess: float  # of the last forces over the true law, relative to the total load
    values: tuple[float, ...]  # scaled multiplier of every step of the last attempt


class FrozenCones:
    """Maximise lambda with |T| <= r + slope N' and 0 <= N' <= q; r may change from solve to solve, nothing else.

    Clarabel keeps its set-up between solves. The dual velocities obey e_n >= slope |e_t|.
    """

    def __init__(self, law: JointLaw, slope: Array, *, tolerance: float = 1e-10) -> None:
        m, c = len(law.tan_phi), law.components
        self.law, self._rows = law, law.matrix.shape[0]
        n = c * m
        normal = c * np.arange(m)
        crushed = np.flatnonzero(np.isfinite(law.crushing))
        one = sparse.eye_array(n + 1, format="csr")
        top = sparse.hstack([law.matrix, sparse.csc_array(law.live[:, None])])
        self._linear = m + len(crushed)
        parts = [top, -one[normal], one[normal[crushed]]]
        parts.append(-slope_rows(slope, c, n + 1))
        kinds = [clarabel.ZeroConeT(self._rows)]
        if c == 2:
            kinds.append(clarabel.NonnegativeConeT(self._linear + 2 * m))
        else:
            kinds += [clarabel.NonnegativeConeT(self._linear)] + [clarabel.SecondOrderConeT(3)] * m
        matrix = sparse.csc_matrix(sparse.vstack(parts))
        self._bound = np.zeros(matrix.shape[0])
        self._bound[: self._rows] = -law.dead
        self._bound[self._rows + m : self._rows + self._linear] = law.crushing[crushed]
        objective = np.zeros(n + 1)
        objective[-1] = -1.0
        settings = solver_settings(tolerance, max_iterations=100)
        # presolve would forbid updating the right-hand side
        settings.presolve_enable = False
        self._arguments = (sparse.csc_matrix((n + 1, n + 1)), objective, matrix, self._bound, kinds, settings)
        self._solver: clarabel.DefaultSolver | None = None

    def solve(self, constant: Array) -> tuple[str, ForceState | None]:
        """Solver status and state for r = ``constant`` (m,); no state when it is not a number."""
        start = self._rows + self._linear
        if self.law.components == 2:
            self._bound[start:] = np.tile(constant, 2)
        else:
            self._bound[start::3] = constant
        if self._solver is None:
            self._solver = clarabel.DefaultSolver(*self._arguments)
        else:
            self._solver.update(b=self._bound)
        answer = self._solver.solve()
        x, dual = np.array(answer.x), np.array(answer.z)[: self._rows]
        velocity = normalised(self.law, dual)
        if velocity is None or not (np.isfinite(x).all() and np.isfinite(velocity).all()):
            return str(answer.status), None
        return str(answer.status), ForceState(float(x[-1]), x[:-1], velocity, "cone program")


def slope_rows(slope: Array, components: int, columns: int) -> sparse.csr_array:
    """Rows slope N' -+ T of plane points (upper signs first), or (slope N', T1, T2) per point in 3-D."""
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


def run_sequence(
    law: JointLaw, start: Array, variant: SchemeSettings | None = None, *, max_steps: int = 40, tolerance: float = 1e-6,
    restarts: int = 6, patience: int = 8, deadline: float = np.inf,
) -> SchemeRun:  # fmt: skip
    """Sequence of cone programs that tends to a state of the non-associative law.

    Step k maximises lambda with |T| <= c_k + (tan psi - a tan phi) N',
    c_k = c' + (tan phi - tan psi + a tan phi) N_k + c0 max N_k, then N_k <- b N' + (1 - b) N_k.

    Parameters
    ----------
    start : normal forces N_0 from the tension corner, scaled, shape (m,)
    variant : a, b and c0
    max_steps : steps of one attempt
    tolerance : largest change of a normal force over the total load at which the chain has settled [-]
    restarts : a failing step halves a and raises c0 tenfold in turn and begins again, at most so often
    patience : steps without progress in the violation of the true law before stopping
    deadline : reading of ``time.perf_counter`` after which no further step begins

    Notes
    -----
    Source: the idea of Gilbert, Casapulla and Ahmed (2006), with an opened and mixed cone. The interior point of the
    optimal face is needed, which interior-point solvers give and simplex solvers do not. Wrong by itself: a settled
    multiplier does not mean that the true law holds, and the end depends on the start; always polish and check.
    """
    variant = variant or SchemeSettings()
    values: list[float] = []
    total_steps, state, over = 0, None, np.inf
    for attempt in range(restarts + 1):
        slope = np.where(law.dilatant, law.tan_phi, law.tan_psi - variant.slope * law.tan_phi)
        program = FrozenCones(law, slope)
        frozen = np.maximum(start, 0.0)
        best, idle, failed, values = np.inf, 0, False, []
        for _ in range(max_steps):
            offset = (law.tan_phi - slope) * frozen + variant.offset * frozen.max(initial=0.0)
            status, answer = program.solve(law.cohesion + np.where(law.dilatant, 0.0, offset))
            total_steps += 1
            if status not in USABLE or answer is None:
                failed = True
                break
            state, over = answer, excess(law, answer.force)
            values.append(answer.multiplier)
            normal = np.maximum(split(law, answer.force)[0], 0.0)
            change = np.abs(normal - frozen).max(initial=0.0) / law.total
            frozen = variant.mixing * normal + (1.0 - variant.mixing) * frozen
            idle = 0 if over < 0.9 * best else idle + 1
            best = min(best, over)
            if change < tolerance or idle >= patience or time.perf_counter() > deadline:
                break
        if not failed or time.perf_counter() > deadline:
            break
        if attempt % 2 == 0:
            variant = variant._replace(slope=0.5 * variant.slope)
        else:
            variant = variant._replace(offset=10.0 * variant.offset)
    return SchemeRun(state, total_steps, variant, float(over), tuple(values))
