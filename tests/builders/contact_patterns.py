"""Smallest non-associative multiplier of a tiny plane structure by trying every pattern of contact, from geometry.

A joint sticks, slides left or slides right, each of its two ends is closed or open. On one pattern forces and
velocities do not know each other: a linear program says whether some mechanism fits it, another the least multiplier of
its forces. Depth first over the joints, undecided ones relaxed; no bound on forces or velocities, no binary, no big
number. Written apart from the package: its own equilibrium, kinematics and joint law.
"""

import itertools

import highspy
import numpy as np
from scipy import sparse

TIGHT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def _program(cost, matrix, low):
    """Least cost over variables above ``low`` whose rows have bounds, none yet: patterns differ in bounds alone."""
    matrix = sparse.csc_array(matrix)
    program = highspy.HighsLp()
    program.num_row_, program.num_col_ = matrix.shape
    program.col_cost_, program.col_lower_, program.col_upper_ = cost, low, np.full(len(cost), np.inf)
    program.row_lower_, program.row_upper_ = (np.full(matrix.shape[0], sign * np.inf) for sign in (-1.0, 1.0))
    program.a_matrix_.start_, program.a_matrix_.index_ = matrix.indptr, matrix.indices
    program.a_matrix_.value_ = matrix.data
    solver = highspy.Highs()
    for name, value in {"output_flag": False, "solver": "simplex", "presolve": "off", **TIGHT}.items():
        solver.setOptionValue(name, value)
    solver.passModel(program)
    return solver


def _solved(solver):
    """Whether a program has an answer; its simplex goes on from the bounds of the last pattern."""
    answers = highspy.HighsModelStatus.kOptimal, highspy.HighsModelStatus.kInfeasible
    if solver.run() != highspy.HighsStatus.kOk or solver.getModelStatus() not in answers:
        solver.clearSolver()  # from there it did not come to an end
        solver.run()
    return solver.getModelStatus() == highspy.HighsModelStatus.kOptimal


def _cross(arm, force):
    return arm[0] * force[1] - arm[1] * force[0]


class Patterns:
    def __init__(self, assembly, loads):
        free = [b for b in range(assembly.n_blocks) if not assembly.fixed[b]]
        self.place = {b: 3 * k for k, b in enumerate(free)}
        n, size = 3 * len(free), float(np.ptp(assembly.arrays.corners[:, 0]))
        weight = np.linalg.norm(loads.dead[free, :3], axis=1).sum()
        self.dead, self.live = np.zeros(n), np.zeros(n)
        for b, at in self.place.items():
            for case, vector in ((loads.dead, self.dead), (loads.live, self.live)):
                # moment about y is opposite to that of x towards z
                vector[at : at + 3] = case[b, 0] / weight, case[b, 2] / weight, -case[b, 4] / weight / size
        joints = [i for i in assembly.interfaces if i.block_a in self.place or i.block_b in self.place]
        self.joints, m = len(joints), 2 * len(joints)
        self.normal, self.tangent = np.zeros((n, m)), np.zeros((n, m))
        self.mu, self.psi, self.corner, self.cohesion = (np.zeros(m) for _ in range(4))
        for k, i in enumerate(joints):
            normal = np.array([i.normal[0], i.normal[2]])
            tangent = np.array([-normal[1], normal[0]])
            along = i.polygon[:, [0, 2]] @ tangent
            ends = i.polygon[[along.argmin(), along.argmax()]][:, [0, 2]]
            area = 0.5 * i.area / weight
            for j, point in zip((2 * k, 2 * k + 1), ends, strict=True):
                for block, sign in ((i.block_b, 1.0), (i.block_a, -1.0)):
                    if block in self.place:
                        at, arm = self.place[block], (point - assembly.centroids[block][[0, 2]]) / size
                        self.normal[at : at + 3, j] = sign * np.append(normal, _cross(arm, normal))
                        self.tangent[at : at + 3, j] = sign * np.append(tangent, _cross(arm, tangent))
                self.mu[j], self.psi[j] = i.joint.tan_phi, i.joint.tan_psi
                # tension corner: normal forces are counted from it
                apex = i.joint.cohesion / i.joint.tan_phi if i.joint.tan_phi > 0 else np.inf
                self.corner[j] = min(i.joint.tensile_strength, apex) * area
                self.cohesion[j] = i.joint.cohesion * area - self.mu[j] * self.corner[j]
        force_low = np.append(np.zeros(m), np.full(m, -np.inf))
        slip_rows = [np.hstack([-np.diag(self.mu), sign * np.eye(m), np.zeros((m, 1))]) for sign in (1.0, -1.0)]
        self.forces = _program(
            np.eye(2 * m + 1)[-1], np.vstack([np.hstack([self.normal, self.tangent, self.live[:, None]]), *slip_rows]),
            np.append(force_low, 0.0),
        )
        at_tension = self.normal @ self.corner - self.dead
        for row, value in enumerate(at_tension):
            self.forces.changeRowBounds(row, value, value)
        gap, slide = self.normal.T, self.tangent.T
        dilated = [gap - sign * self.psi[:, None] * slide for sign in (1.0, -1.0)]
        self.velocities = _program(np.zeros(n), np.vstack([self.live[None, :], *dilated, slide]), np.full(n, -np.inf))
        self.velocities.changeRowBounds(0, 1.0, 1.0)

    def _least(self, pattern):
        """Least multiplier of the forces of a pattern {joint: (slip, open, open)}; None when there are none."""
        m, n = 2 * self.joints, len(self.dead)
        for j in range(m):
            slip, *opened = pattern.get(j // 2, (0, False, False))
            self.forces.changeColBounds(j, 0.0, 0.0 if opened[j % 2] else np.inf)
            for k, sign in enumerate((1, -1)):
                low = self.cohesion[j] if slip == -sign else -np.inf
                self.forces.changeRowBounds(n + k * m + j, low, self.cohesion[j])
        return self.forces.getInfo().objective_function_value if _solved(self.forces) else None

    def _moves(self, pattern):
        """Whether velocities with live power one fit a pattern; undecided joints may open and slide at will."""
        m, free, positive, zero = 2 * self.joints, (-np.inf, np.inf), (0.0, np.inf), (0.0, 0.0)
        for j in range(m):
            # less the dilation to the left, to the right; the slip itself
            rows = [positive, positive, free]
            if j // 2 in pattern:
                slip, *opened = pattern[j // 2]
                kept = positive if opened[j % 2] else zero
                rows = [free, kept, (-np.inf, 0.0)] if slip < 0 else [kept, free, positive if slip else zero]
            for k, bounds in enumerate(rows):
                self.velocities.changeRowBounds(1 + k * m + j, *bounds)
        return _solved(self.velocities)

    def smallest(self, *, best=np.inf):
        """Least multiplier over all patterns; infinite when no pattern has both forces and a mechanism."""
        kinds = list(itertools.product((0, 1, -1), (False, True), (False, True)))

        def descend(pattern):
            nonlocal best
            least = self._least(pattern)
            if least is None or least >= best - 1e-9 or not self._moves(pattern):
                return
            if len(pattern) == self.joints:
                best = least
                return
            for kind in kinds:
                descend({**pattern, len(pattern): kind})

        descend({})
        return best
