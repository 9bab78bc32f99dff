"""Smallest non-associative multiplier of a tiny plane structure by trying every pattern of contact, from geometry.

A joint sticks, slides left or slides right, each of its two ends is closed or open. On one pattern forces and
velocities do not know each other: a linear program says whether some mechanism fits it, another the least multiplier of
its forces. Depth first over the joints, undecided ones relaxed; no bound on forces or velocities, no binary, no big
number. Written apart from the package: its own equilibrium, kinematics and joint law.
"""

import itertools

import numpy as np
from scipy.optimize import linprog

TIGHT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


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
        self.programs = 0

    def _least(self, pattern):
        """Least multiplier of the forces of a pattern {joint: (slip, open, open)}; None when there are none."""
        m = 2 * self.joints
        equal = [np.hstack([self.normal, self.tangent, self.live[:, None]])]
        right = [self.normal @ self.corner - self.dead]
        rows, bound = [], []
        high = np.full(2 * m + 1, np.inf)
        for j in range(m):
            slip, *opened = pattern.get(j // 2, (0, False, False))
            if opened[j % 2]:
                high[j] = 0.0
            for sign in (1.0, -1.0):
                row = np.zeros(2 * m + 1)
                row[j], row[m + j] = -self.mu[j], sign
                if slip and sign == -slip:
                    equal.append(row[None, :])
                    right.append([self.cohesion[j]])
                else:
                    rows.append(row)
                    bound.append(self.cohesion[j])
        low = np.concatenate([np.zeros(m), np.full(m, -np.inf), [0.0]])
        cost = np.eye(2 * m + 1)[-1]
        self.programs += 1
        answer = linprog(
            cost, np.array(rows) if rows else None, bound or None, np.vstack(equal), np.concatenate(right),
            np.column_stack([low, high]), method="highs-ds", options=TIGHT,
        )  # fmt: skip
        return float(answer.x[-1]) if answer.status == 0 else None

    def _moves(self, pattern):
        """Whether velocities with live power one fit a pattern; undecided joints may open and slide at will."""
        equal, rows = [self.live], []
        for j in range(2 * self.joints):
            gap, slide = self.normal[:, j], self.tangent[:, j]
            if j // 2 not in pattern:
                rows += [self.psi[j] * slide - gap, -self.psi[j] * slide - gap]
                continue
            slip, *opened = pattern[j // 2]
            if slip == 0:
                equal.append(slide)
            else:
                rows.append(-slip * slide)
            dilated = gap - slip * self.psi[j] * slide
            if opened[j % 2]:
                rows.append(-dilated)
            else:
                equal.append(dilated)
        self.programs += 1
        answer = linprog(
            np.zeros(len(self.live)), np.array(rows) if rows else None, np.zeros(len(rows)) if rows else None,
            np.array(equal), np.eye(len(equal))[0], (None, None), method="highs-ds", options=TIGHT,
        )  # fmt: skip
        return answer.status == 0

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
