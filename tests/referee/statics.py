"""Own statics of a :class:`~.model.Model`, from geometry alone: the static theorem with ties, elasticity, vibration.

Faces come from ``space.find_contacts``. Integrals over them are taken at the middles of the sides of triangles, exact
for what is quadratic: the stiffness of rigid blocks on elastic faces. Nothing of ``limitmason`` is used.
"""

import clarabel
import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from .linear import INFEASIBLE, OPTIMAL, maximise
from .model import Model, Pull
from .space import Face, find_contacts, mass

Array = np.ndarray

ON_THE_EDGE = 1e-9
"""Of the largest stress: less than this counts as none."""


class Statics:
    """Faces, centroids and moments of a model, once for all questions; ``taut`` are the ties that elasticity counts."""

    def __init__(self, model: Model, taut: tuple[Pull, ...] = ()) -> None:
        self.model, self.taut = model, taut
        free = set(model.free)
        self.faces = [f for f in find_contacts(model.solids) if f.a in free or f.b in free]
        self.volume, self.centroid = (np.array(v) for v in zip(*map(mass, model.solids), strict=True))

    def pair(self, f: Face, point: Array) -> Array:
        """Relative velocity of b to a at a point of a face, by the twists of all blocks, shape (3, 6 n)."""
        out = np.zeros((3, 6 * len(self.volume)))
        for block, sign in ((f.b, 1.0), (f.a, -1.0)):
            out[:, 6 * block : 6 * block + 6] = sign * _at(point - self.centroid[block])
        return out

    # ---- the static theorem -----------------------------------------------------------------------------------------

    def largest(
        self, dead: Array, live: Array, group: tuple[int, ...] = (), down: Array | None = None, turning: bool = False,
        sharp: bool = False,
    ) -> float:
        """Largest t with forces within the law in balance with dead + t live [-]; NaN without one, inf without end.

        Exact for dry faces, and in plane for cohesive ones: forces at corners, strength shared as areas are. A group is
        one body guided along ``down``. Every block's rows are in units of its own load, every force of the lighter one.
        Cohesion in space: an upper bound, since corners bear every torsion that a face does. A tie that
        is ``turning`` pulls any way: an upper bound for one that turns as its blocks slide. ``sharp``: by linear
        programs to full precision, where sizes and weights decades apart leave an interior point too little.
        """
        m = self.model
        force, size = np.full(len(self.volume), m.weight / len(m.free)), m.length
        own = np.linalg.norm(m.dead[:, :3], axis=1) + np.linalg.norm(m.live[:, :3], axis=1)
        single = [i for i in m.free if i not in group and own[i] > 0.0]
        force[single] = own[single]
        free = set(m.free)
        rows = np.zeros((0, 6 * len(self.volume)))
        scale = (force[:, None] * [1.0, 1.0, 1.0, size, size, size]).ravel()
        rows = np.eye(6 * len(self.volume))[[6 * i + k for i in m.free if i not in group for k in range(6)]]
        if group:
            along = np.zeros((1, rows.shape[1]))
            for i in group:
                along[0, 6 * i : 6 * i + 3] = down
            rows = np.vstack([rows, along])
        columns, cones, bounds, strengths = [], [], [], []
        for f in self.faces:
            if f.a in group and f.b in group:
                continue
            law, unit = m.law_of(f.a, f.b), min(force[i] for i in (f.a, f.b) if i in free)
            frame = np.stack([f.normal, f.along, f.across])
            for p, area in zip(f.corners, _corner_areas(f), strict=True):
                columns.append((self.pair(f, p).T @ frame.T) * (unit / scale)[:, None])
                cones.append((law.mu, law.cohesion * area / unit))
                bounds.append(law.cut_off * area / unit)
        for t in m.ties:
            unit = min(force[i] for i in (t.a, t.b) if i in free)
            ways = np.eye(3) if turning else [t.way]
            columns += [(_stretch(self, t, way) * -unit / scale)[:, None] for way in ways]  # it pulls its ends together
            strengths.append(t.strength / unit)
        matrix = np.hstack([rows @ np.hstack(columns), (rows @ (live.ravel() / scale))[:, None]])
        right = -rows @ (dead.ravel() / scale)
        if sharp and not np.isnan(found := _sharp(matrix, right, cones, bounds, np.array(strengths))):
            return found
        return _maximise(matrix, right, cones, bounds, np.array(strengths), turning)

    def limit(self, turning: bool = False, sharp: bool = False) -> float:
        """Multiplier by the static theorem [-]: -inf where dead load alone cannot be borne, NaN where none is found."""
        m = self.model
        stands = self.largest(np.zeros_like(m.dead), m.dead, turning=turning)
        if abs(stands - 1.0) < 1e-6 or np.isnan(stands):
            return float("nan")
        return self.largest(m.dead, m.live, turning=turning, sharp=sharp) if stands > 1.0 else float("-inf")

    # ---- elasticity -------------------------------------------------------------------------------------------------

    def stiffness(self) -> Array:
        """K of rigid blocks on closed faces, shape (6 n, 6 n)."""
        kn, ks = self.model.stiffness
        k = np.zeros((6 * len(self.volume),) * 2)
        for f in self.faces:
            spring = ks * np.eye(3) + (kn - ks) * np.outer(f.normal, f.normal)
            for point, area in zip(*_middles(f), strict=True):
                b = self.pair(f, point)
                k += area * b.T @ spring @ b
        for t in self.taut:
            row = _stretch(self, t, t.way)
            k += t.stiffness * np.outer(row, row)
        return k

    def pulled(self, factor: float) -> "Statics | None":
        """The same with the ties that pull under the dead and so much of the live load; None where one yields.

        A tie that hangs loose does nothing. What is elastic has one state, whatever pulled on the way to it.
        """
        m, on = self.model, np.ones(len(self.model.ties), dtype=bool)
        strength = np.array([t.strength for t in m.ties])
        for _ in range(2 ** len(m.ties)):
            found = Statics(m, tuple(t for t, used in zip(m.ties, on, strict=True) if used))
            u = found.displaced() @ [1.0, factor]
            pull = np.array([t.stiffness * _stretch(self, t, t.way) @ u for t in m.ties])
            if ((pull > 0.0) == on).all():
                return found if (pull < strength)[on].all() else None
            on = pull > 0.0
        return None

    def mass_matrix(self) -> Array:
        """M, with inertia by the second moments of tetrahedra, shape (6 n, 6 n)."""
        out = np.zeros((6 * len(self.volume),) * 2)
        for i, solid in enumerate(self.model.solids):
            rho, r = self.model.density[i], slice(6 * i, 6 * i + 3)
            out[r, r] = rho * self.volume[i] * np.eye(3)
            second = rho * _second_moment(solid, self.centroid[i])
            q = slice(6 * i + 3, 6 * i + 6)
            out[q, q] = np.trace(second) * np.eye(3) - second
        return out

    @property
    def dofs(self) -> Array:
        """Rows of the free blocks."""
        return np.array([6 * i + k for i in self.model.free for k in range(6)])

    def frequencies(self) -> Array:
        """All natural frequencies of the free blocks [Hz], lowest first."""
        d = self.dofs
        value = eigh(self.stiffness()[np.ix_(d, d)], self.mass_matrix()[np.ix_(d, d)], eigvals_only=True)
        return np.sqrt(np.maximum(value, 0.0)) / (2 * np.pi)

    def displaced(self) -> Array:
        """Twists of all blocks by the dead and by the live load, shape (6 n, 2)."""
        d, m = self.dofs, self.model
        out = np.zeros((6 * len(self.volume), 2))
        out[d] = np.linalg.solve(self.stiffness()[np.ix_(d, d)], np.column_stack([m.dead.ravel(), m.live.ravel()])[d])
        return out

    def elastic_ends(self) -> dict[str, tuple[float, float]]:
        """Multipliers between which no corner of a face reaches its strength, by criterion; empty if the weight does.

        Stresses are linear over a face and strengths convex in them: corners come first.
        """
        kn, ks = self.model.stiffness
        u = self.displaced()
        s, laws = [], []
        for f in self.faces:
            frame, law = np.stack([-kn * f.normal, ks * f.along, ks * f.across]), self.model.law_of(f.a, f.b)
            for p in f.corners:
                s.append(frame @ self.pair(f, p) @ u)
                laws.append((law.cut_off, law.crushing, law.mu, law.cohesion))
        stress, (ft, fc, mu, c) = np.array(s), np.array(laws).T
        stress = np.where(np.abs(stress) < ON_THE_EDGE * np.abs(stress).max(axis=(0, 1)), 0.0, stress)
        (n0, n1), (x0, x1), (y0, y1) = (stress[:, k].T for k in range(3))
        edge = 1e-6 * np.abs(n0).max()
        if min((ft + n0).min(), (fc - n0).min(), (c + mu * n0 - np.hypot(x0, y0)).min()) < edge:
            return {}
        # |T|^2 = (c + mu N)^2, of which the cone's own root has c + mu N >= 0
        a = x1**2 + y1**2 - (mu * n1) ** 2
        b = x0 * x1 + y0 * y1 - mu * n1 * (c + mu * n0)
        d = x0**2 + y0**2 - (c + mu * n0) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(np.maximum(b * b - a * d, 0.0))
            slips = np.concatenate([(-b - root) / a, (-b + root) / a])
            slips = slips[np.isfinite(slips) & (np.tile(c + mu * n0, 2) + slips * np.tile(mu * n1, 2) >= 0)]
            opens, crushes = -(ft + n0) / n1, (fc - n0) / n1
        ends = {"opening": opens[n1 != 0], "crushing": crushes[n1 != 0], "slip": slips}
        return {name: _nearest(roots) for name, roots in ends.items()}


def _at(arm: Array) -> Array:
    """Velocity at an arm from the centroid, by the block's twist, shape (3, 6)."""
    x, y, z = arm
    return np.array([[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]], dtype=float)


def _stretch(s: Statics, t, along: Array) -> Array:
    """How far the ends of a tie move apart along a direction by the twists of all blocks, shape (6 n,)."""
    out = np.zeros(6 * len(s.volume))
    for block, point, sign in ((t.a, t.at, -1.0), (t.b, t.to, 1.0)):
        if block >= 0:
            out[6 * block : 6 * block + 6] += sign * along @ _at(point - s.centroid[block])
    return out


def _corner_areas(f: Face) -> Array:
    """Integrals of functions that are one at a corner and linear between: a face's strength among its corners.

    Bilinear on a parallelogram, else linear on the triangles from the first corner. Forces shared so keep their
    resultants and the joint law: what corners bear is an upper bound, exact but for torsion.
    """
    p, out = f.corners, np.zeros(len(f.corners))
    r = p - p[0]
    for k in range(1, len(p) - 1):
        out[[0, k, k + 1]] += np.linalg.norm(np.cross(r[k], r[k + 1])) / 6.0
    if len(p) == 4 and np.abs(r[2] - r[1] - r[3]).max() < 1e-9 * np.abs(r).max():
        return np.full(4, out.sum() / 4.0)
    return out


def _middles(f: Face) -> tuple[Array, Array]:
    """Middles of the sides of the triangles from the first corner, and a third of the area of each."""
    points, areas = [], []
    for p, q in zip(f.corners[1:-1], f.corners[2:], strict=True):
        o = f.corners[0]
        area = 0.5 * np.linalg.norm(np.cross(p - o, q - o))
        points += [(o + p) / 2, (p + q) / 2, (q + o) / 2]
        areas += [area / 3] * 3
    return np.array(points), np.array(areas)


def _second_moment(solid, centre: Array) -> Array:
    """Integral of x x^T about a point, by tetrahedra from it, shape (3, 3)."""
    vertices, faces = solid
    out = np.zeros((3, 3))
    for face in faces:
        p = vertices[list(face)] - centre
        for k in range(1, len(p) - 1):
            t = np.stack([p[0], p[k], p[k + 1]])
            total = t.sum(axis=0)
            out += np.linalg.det(t) / 120.0 * (t.T @ t + np.outer(total, total))
    return out


def _nearest(roots: Array) -> tuple[float, float]:
    """The roots on either side of zero that are nearest to it."""
    return float(roots[roots < 0].max(initial=-np.inf)), float(roots[roots > 0].min(initial=np.inf))


def _maximise(matrix, right, cones, bounds, strengths, turning: bool, accuracy: float = 1e-10) -> float:
    """Largest last variable with matrix x = right, (mu N + c, T) in the cone, N >= -bound, and ties within strength."""
    count, n, ties = matrix.shape[1], len(cones), len(strengths)
    rows, limits, kinds = [sparse.csc_array(matrix)], [right], [clarabel.ZeroConeT(len(right))]
    normal = sparse.csc_array((-np.ones(n), (np.arange(n), 3 * np.arange(n))), (n, count))
    rows.append(normal)
    limits.append(np.array(bounds))
    kinds.append(clarabel.NonnegativeConeT(n))
    if turning:
        for k, strength in enumerate(strengths):
            at = (np.arange(1, 4), 3 * (n + k) + np.arange(3))
            rows.append(sparse.csc_array((-np.ones(3), at), (4, count)))
            limits.append(np.array([strength, 0.0, 0.0, 0.0]))
            kinds.append(clarabel.SecondOrderConeT(4))
    else:
        pull = sparse.csc_array((np.ones(ties), (np.arange(ties), 3 * n + np.arange(ties))), (ties, count))
        rows += [pull, -pull]
        limits += [strengths, np.zeros(ties)]
        kinds.append(clarabel.NonnegativeConeT(2 * ties))
    for k, (mu, c) in enumerate(cones):
        cone = np.zeros((3, 3))
        cone[0, 0], cone[1, 1], cone[2, 2] = -mu, -1.0, -1.0
        at = sparse.coo_array(cone)
        rows.append(sparse.csc_array((at.data, (at.row, at.col + 3 * k)), (3, count)))
        limits.append(np.array([c, 0.0, 0.0]))
        kinds.append(clarabel.SecondOrderConeT(3))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = accuracy
    q = np.zeros(count)
    q[-1] = -1.0
    answer = clarabel.DefaultSolver(
        sparse.csc_matrix((count, count)), q, sparse.csc_matrix(sparse.vstack(rows)), np.concatenate(limits), kinds,
        settings,
    ).solve()
    status = str(answer.status)
    if status == "AlmostSolved" and accuracy < 1e-8:
        return _maximise(matrix, right, cones, bounds, strengths, turning, 1e-8)
    if status == "Solved":
        return float(answer.x[-1])
    return {"DualInfeasible": np.inf, "PrimalInfeasible": -np.inf}.get(status, np.nan)


def _sharp(matrix, right, cones, bounds, strengths) -> float:
    """The same without turning ties, from above: cones by tangent planes, more where a maximiser leaves them."""
    count, n, before = matrix.shape[1], len(cones), np.inf
    planes, limits = [], []

    def bound(limit: float, first: int, *values: float) -> None:
        planes.append(np.pad(values, (first, count - first - len(values))))
        limits.append(limit)

    for k, ((mu, c), pull) in enumerate(zip(cones, bounds, strict=True)):
        bound(pull, 3 * k, -1.0)
        for angle in np.arange(8) * np.pi / 4:
            bound(c, 3 * k, -mu, np.cos(angle), np.sin(angle))
    for k, strength in enumerate(strengths, start=3 * n):
        bound(strength, k, 1.0)
        bound(0.0, k, -1.0)
    for _ in range(100):
        found = maximise(np.eye(count)[-1], matrix, right, np.array(planes), np.array(limits))
        if found.status != OPTIMAL:
            return -np.inf if found.status == INFEASIBLE else np.nan
        if before - found.value <= 1e-11 * abs(found.value):
            return found.value
        before = found.value
        for k, (mu, c) in enumerate(cones):
            normal, x, y = found.x[3 * k : 3 * k + 3]
            size = float(np.hypot(x, y))
            if size > c + mu * normal:
                bound(c, 3 * k, -mu, x / size, y / size)
    return np.nan
