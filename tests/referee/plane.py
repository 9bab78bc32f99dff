"""The static theorem in the plane, from outlines alone: section forces N, V, M of every joint in a linear program.

Contacts are found here from the outlines, lever arms are taken from their corners, and the law is written for section
forces instead of contact points, which is exact: for a section of length L and area A with tension cut-off ft,

    |V| <= c A + mu N,   |M| <= (N + ft A) L / 2 - (N + ft A)^2 / (2 (fc + ft) A / L),   N + ft A <= (fc + ft) A,

the parabola by tangents that are added until none is passed. Nothing of ``limitmason`` is used.
"""

from typing import NamedTuple

import numpy as np

from .assemblies import GRAVITY, Case, Load
from .draw import area_centroid
from .linear import OPTIMAL, maximise

Array = np.ndarray

NUMBER, CANNOT_STAND, NO_LIMIT, UNDECIDED = "number", "cannot stand", "unbounded", "undecided"
_NEAR = 1e-7  # of the smaller block's size: edges nearer than this touch
_ACCEPTED = 1e-8  # residual of its own rows, each over its block's load, up to which the referee has an opinion


class Verdict(NamedTuple):
    """Status, multiplier [-], the referee's own residual [-], and the multiplier at which some block's live load equals
    its dead one."""

    status: str
    value: float = np.nan
    residual: float = 0.0
    unit: float = 1.0


class Contact(NamedTuple):
    """Touching stretch of two outlines; ``normal`` points from block a into block b."""

    a: int
    b: int
    start: Array
    end: Array
    normal: Array


def find_contacts(outlines: tuple[Array, ...]) -> list[Contact]:
    """All stretches along which edges of two blocks lie on each other."""
    out = []
    edges = [(o, np.roll(o, -1, axis=0)) for o in outlines]
    low, high = [o.min(axis=0) for o in outlines], [o.max(axis=0) for o in outlines]
    size = [float((h - s).min()) for s, h in zip(low, high, strict=True)]
    for i in range(len(outlines)):
        for j in range(i + 1, len(outlines)):
            near = _NEAR * min(size[i], size[j])
            if (low[i] > high[j] + near).any() or (low[j] > high[i] + near).any():
                continue
            for p, q in zip(*edges[i], strict=True):
                along = (q - p) / np.linalg.norm(q - p)
                normal = np.array([along[1], -along[0]])
                for r, s in zip(*edges[j], strict=True):
                    if (s - r) @ along >= 0 or max(abs((r - p) @ normal), abs((s - p) @ normal)) > near:
                        continue
                    first, last = max(0.0, (s - p) @ along), min((q - p) @ along, (r - p) @ along)
                    if last - first > near:
                        out.append(Contact(i, j, p + first * along, p + last * along, normal))
    return out


def wrenches(case: Case) -> tuple[Array, Array, Array]:
    """Centroids, and dead and live (Fx, Fz, moment from z to x reversed: counter-clockwise in (x, z)) per block."""
    n = len(case.outlines)
    centroid, weight = np.empty((n, 2)), np.empty(n)
    for i, (outline, (y0, y1)) in enumerate(zip(case.outlines, case.depth, strict=True)):
        area, centroid[i] = area_centroid(outline)
        weight[i] = case.density[i] * GRAVITY * area * (y1 - y0)
    loads = {"dead": np.zeros((n, 3)), "live": np.zeros((n, 3))}
    loads["dead"][:, 1] = -weight
    for f in case.loads:
        _add(loads[f.case], f, case, centroid, weight)
    return centroid, loads["dead"], loads["live"]


def _add(target: Array, f: Load, case: Case, centroid: Array, weight: Array) -> None:
    vector = np.array([f.vector[0], f.vector[2]])
    if f.kind == "body":
        for i in case.free:
            target[i, :2] += weight[i] * vector
    elif f.kind == "point":
        arm = np.array([f.at[0], f.at[2]]) - centroid[f.block]
        target[f.block] += [*vector, arm[0] * vector[1] - arm[1] * vector[0]]
    else:
        outline, (y0, y1) = case.outlines[f.block], case.depth[f.block]
        for p, q in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            outward = np.array([(q - p)[1], -(q - p)[0]]) / np.linalg.norm(q - p)
            if outward @ vector < np.cos(np.deg2rad(10.0)):
                continue
            force = -f.size * np.linalg.norm(q - p) * (y1 - y0) * outward
            arm = 0.5 * (p + q) - centroid[f.block]
            target[f.block] += [*force, arm[0] * force[1] - arm[1] * force[0]]


def least_unit(own: Array, moving: Array) -> float:
    """Smallest multiplier at which the live load of a block equals its own dead load [-]; of the whole without any."""
    both = (own > 0) & (moving > 0)
    if both.any():
        return float((own[both] / moving[both]).min())
    return float(own.sum() / moving.sum()) if own.any() and moving.any() else 1.0


def parts(free: list[int], pairs: list[tuple[int, int]]) -> list[list[int]]:
    """Free blocks in groups that no joint connects; held blocks connect nothing."""
    label = {i: i for i in free}

    def root(i: int) -> int:
        while label[i] != i:
            i = label[i]
        return i

    for a, b in pairs:
        if a in label and b in label:
            label[root(a)] = root(b)
    groups: dict[int, list[int]] = {}
    for i in free:
        groups.setdefault(root(i), []).append(i)
    return list(groups.values())


def together(verdicts: list[Verdict]) -> Verdict:
    """The whole from its independent parts: all must stand, the weakest sets the multiplier."""
    for status in (CANNOT_STAND, UNDECIDED):
        if any(v.status == status for v in verdicts):
            return Verdict(status)
    numbers = [v for v in verdicts if v.status == NUMBER]
    return min(numbers, key=lambda v: v.value) if numbers else Verdict(NO_LIMIT)


def referee(case: Case) -> Verdict:
    """Status and multiplier of a plane case."""
    contacts = find_contacts(case.outlines)
    centroid, dead, live = wrenches(case)
    verdicts = []
    for group in parts(case.free, [(c.a, c.b) for c in contacts]):
        mine = [c for c in contacts if c.a in group or c.b in group]
        verdicts.append(_Part(case, group, mine, centroid, dead, live).solve())
    return together(verdicts)


class _Part:
    """One group of blocks: rows of equilibrium over each block's own load, columns of section forces."""

    def __init__(self, case: Case, group: list[int], contacts: list[Contact], centroid, dead, live) -> None:
        self.case, self.contacts = case, contacts
        number = {block: k for k, block in enumerate(group)}
        size = np.array([np.sqrt(area_centroid(case.outlines[i])[0]) for i in group])
        own = np.maximum(np.abs(dead[group, :2]).max(axis=1), np.abs(dead[group, 2]) / size)
        moving = np.abs(live[group, :2]).max(axis=1)
        self.unit = least_unit(own, moving)
        own = np.where(own > 0, own, moving)
        own = np.where(own > 0, own, own[own > 0].min(initial=np.inf))
        own = np.where(np.isfinite(own), own, 1.0)
        load = np.full(len(case.outlines), np.inf)
        load[group] = own
        n = 3 * len(contacts)
        rows = np.zeros((3 * len(group), n))
        self.scale = np.array([min(load[c.a], load[c.b]) for c in contacts])
        for k, c in enumerate(contacts):
            along, middle = np.array([-c.normal[1], c.normal[0]]), 0.5 * (c.start + c.end)
            length = np.linalg.norm(c.end - c.start)
            for block, sign in ((c.b, 1.0), (c.a, -1.0)):
                if block not in number:
                    continue
                arm, r = middle - centroid[block], 3 * number[block]
                for q, vector in enumerate((c.normal, along)):
                    rows[r : r + 2, 3 * k + q] += sign * vector
                    rows[r + 2, 3 * k + q] += sign * (arm[0] * vector[1] - arm[1] * vector[0])
                rows[r + 2, 3 * k + 2] += sign * 0.5 * length  # M = m L / 2
        divide = np.column_stack([own, own, own * size]).ravel()
        self.rows = rows * np.repeat(self.scale, 3) / divide[:, None]
        self.dead = dead[group].ravel() / divide
        self.live = live[group].ravel() * self.unit / divide
        self._law()

    def _law(self) -> None:
        law, rows, limits = self.case.law, [], []
        self.area = np.empty(len(self.contacts))

        def row(k: int, n: float, v: float, m: float, limit: float) -> None:
            r = np.zeros(3 * len(self.contacts))
            r[3 * k : 3 * k + 3] = n, v, m
            size = max(abs(n), abs(v), abs(m))
            rows.append(r / size)
            limits.append(limit / size)

        for k, c in enumerate(self.contacts):
            y0, y1 = self.case.depth[c.a]
            self.area[k] = area = np.linalg.norm(c.end - c.start) * (y1 - y0)
            grip, pull = law.cohesion * area / self.scale[k], law.cut_off * area / self.scale[k]
            for sign in (1.0, -1.0):
                row(k, -law.mu, sign, 0.0, grip)
                row(k, -1.0, 0.0, sign, pull)
            if np.isfinite(law.crushing):
                row(k, 1.0, 0.0, 0.0, law.crushing * area / self.scale[k])
        self.below, self.limit = np.array(rows), np.array(limits)

    def _capacity(self) -> tuple[Array, Array]:
        law = self.case.law
        pull = law.cut_off * self.area / self.scale
        return law.crushing * self.area / self.scale + pull, pull

    def _tangents(self, x: Array) -> int:
        """Add tangents of m <= p - p^2 / q at every section that passes the parabola, with p = N + ft A, q = fc A."""
        if not np.isfinite(self.case.law.crushing):
            return 0
        capacity, pull = self._capacity()
        added = []
        for k in range(len(self.contacts)):
            n, _, m = x[3 * k : 3 * k + 3]
            p, q = min(max(n + pull[k], 0.0), capacity[k]), capacity[k]
            if abs(m) <= p - p * p / q + 1e-9 * p + 1e-12:
                continue
            for sign in (1.0, -1.0):  # |m| <= p (1 - 2 p0 / q) + p0^2 / q, p = n + pull
                r = np.zeros(len(x))
                slope = 1 - 2 * p / q
                r[3 * k], r[3 * k + 2] = -slope, sign
                added.append((r, slope * pull[k] + p * p / q))
        if added:
            self.below = np.vstack([self.below, [r for r, _ in added]])
            self.limit = np.concatenate([self.limit, [h for _, h in added]])
        return len(added)

    def _maximise(self, right: Array, column: Array, cap: float | None, limit: Array | None = None):
        """Largest t with rows f + column t = right, f within the law, and t <= cap."""
        for _ in range(60):
            h = self.limit if limit is None else limit(self.limit)
            below = np.column_stack([self.below, np.zeros(len(self.below))])
            if cap is not None:
                below, h = np.vstack([below, np.eye(1, below.shape[1], below.shape[1] - 1)]), np.append(h, cap)
            objective = np.eye(1, below.shape[1], below.shape[1] - 1)[0]
            answer = maximise(objective, np.column_stack([self.rows, column]), right, below, h)
            if answer.status != OPTIMAL or limit is not None or not self._tangents(answer.x[:-1]):
                return answer
        return answer

    def solve(self) -> Verdict:
        """Does it stand, is there a limit, which."""
        zero = np.zeros(len(self.dead))
        standing = self._maximise(zero, self.dead, 1.0)
        if standing.status != OPTIMAL or standing.primal_residual > _ACCEPTED:
            return Verdict(UNDECIDED)
        if standing.value < 1.0 - _ACCEPTED:
            return Verdict(CANNOT_STAND)
        if not self.live.any():
            return Verdict(NO_LIMIT)
        free = self._maximise(zero, self.live, 1.0, lambda h: 0.0 * h)  # directions in which the law has no end
        if free.status != OPTIMAL:
            return Verdict(UNDECIDED)
        if free.value > 0.5:
            return Verdict(NO_LIMIT)
        answer = self._maximise(-self.dead, self.live, None)
        if answer.status != OPTIMAL or max(answer.primal_residual, answer.dual_residual) > _ACCEPTED:
            return Verdict(UNDECIDED)
        return Verdict(NUMBER, self.unit * answer.value, answer.primal_residual, self.unit)
