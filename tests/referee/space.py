"""The static theorem in space, from the faces of the solids alone, as a second-order cone program in cvxpy.

Contacts are found here by clipping opposite faces. Dry joints carry forces at the corners of the contact, which is
exact. Cohesion and tension belong to the area: they are spread over cells of the face in two ways that enclose the
true value from both sides (see :func:`face_points`). Nothing of ``limitmason`` is used.
"""

import warnings

import cvxpy as cp
import numpy as np

from .assemblies import GRAVITY, Case
from .plane import CANNOT_STAND, NO_LIMIT, NUMBER, UNDECIDED, Verdict, least_unit, parts, together

Array = np.ndarray

_NEAR = 1e-7  # of the smaller block's size: faces nearer than this touch
_ACCEPTED = 1e-7  # residual and duality gap up to which the referee has an opinion
_SOUGHT = 1e-9  # the same at which it looks no further: where loads lie decades apart 5e-8 has been worth 2e-6
PASSES = 5  # solutions at most, each in units of the one before

INSIDE, OUTSIDE = "inside", "outside"


class Face:
    """Contact polygon between blocks a and b with its unit normal from a to b and two tangents."""

    def __init__(self, a: int, b: int, corners: Array, normal: Array) -> None:
        self.a, self.b, self.corners, self.normal = a, b, corners, normal
        first = corners[1] - corners[0]
        self.along = first / np.linalg.norm(first)
        self.across = np.cross(normal, self.along)


def _clip(subject: Array, window: Array) -> Array:
    """Convex polygon cut by the half-planes of another, both counter-clockwise, shape (n, 2)."""
    for p, q in zip(window, np.roll(window, -1, axis=0), strict=True):
        inward = np.array([-(q - p)[1], (q - p)[0]]) / np.linalg.norm(q - p)
        depth = (subject - p) @ inward
        out = []
        for k in range(len(subject)):
            u, v, du, dv = subject[k], subject[(k + 1) % len(subject)], depth[k], depth[(k + 1) % len(subject)]
            if du >= 0:
                out.append(u)
            if du * dv < 0:
                out.append(u + (v - u) * du / (du - dv))
        if len(out) < 3:
            return np.empty((0, 2))
        subject = np.array(out)
    return subject


def find_contacts(solids) -> list[Face]:
    """Faces of two solids that lie on each other, clipped to what they share."""
    out = []
    low, high = [v.min(axis=0) for v, _ in solids], [v.max(axis=0) for v, _ in solids]
    size = [float((h - s).min()) for s, h in zip(low, high, strict=True)]
    planes = []
    for vertices, faces in solids:
        mine = []
        for f in faces:
            p = vertices[list(f)]
            normal = np.cross(p[1:-1] - p[0], p[2:] - p[0]).sum(axis=0)
            mine.append((p, normal / np.linalg.norm(normal)))
        planes.append(mine)
    for i in range(len(solids)):
        for j in range(i + 1, len(solids)):
            near = _NEAR * min(size[i], size[j])
            if (low[i] > high[j] + near).any() or (low[j] > high[i] + near).any():
                continue
            for p, n in planes[i]:
                for q, m in planes[j]:
                    if n @ m > -1 + 1e-9 or np.abs((q - p[0]) @ n).max() > near:
                        continue
                    e = (p[1] - p[0]) / np.linalg.norm(p[1] - p[0])
                    frame = np.column_stack([e, np.cross(n, e)])
                    flat = _clip((p - p[0]) @ frame, ((q - p[0]) @ frame)[::-1])
                    flat = _without_repeats(flat, near)
                    if len(flat) >= 3 and _area(flat) > near * np.ptp(flat, axis=0).max():
                        out.append(Face(i, j, p[0] + flat @ frame.T, n))
    return out


def _without_repeats(flat: Array, near: float) -> Array:
    if len(flat) < 3:
        return flat
    return flat[np.linalg.norm(flat - np.roll(flat, 1, axis=0), axis=1) > near]


def _area(flat: Array) -> float:
    r = flat - flat[0]
    return float(0.5 * (r[:-1, 0] * r[1:, 1] - r[1:, 0] * r[:-1, 1]).sum())


def face_points(face: Face, cells: int, side: str) -> tuple[Array, Array]:
    """Points of a face and the area whose cohesion and tension each carries [m], [m2].

    Triangles from the face's centroid to its edges are divided into ``cells`` x ``cells`` small ones. INSIDE: dry
    points at the corners and one point with the area at the centroid of every small triangle, which is a uniform
    stress there and so an admissible state: its multiplier is not above the true one. OUTSIDE: points at the corners of
    the small triangles, each with a third of the area around it. Every stress field is carried there by the hat
    functions without changing force or moment, and each share keeps within the (convex) law: not below the true one.
    """
    corners = face.corners
    if cells == 0:
        return corners, np.zeros(len(corners))
    frame = np.column_stack([face.along, face.across])
    flat = (corners - corners[0]) @ frame
    middle = flat.mean(axis=0)
    centres, areas, nodes, wide = [], [], {}, np.ptp(flat, axis=0).max()
    for p, q in zip(flat, np.roll(flat, -1, axis=0), strict=True):

        def node(i: int, j: int, p=p, q=q) -> Array:
            return middle + (p - middle) * i / cells + (q - middle) * j / cells

        share = abs((p - middle)[0] * (q - middle)[1] - (p - middle)[1] * (q - middle)[0]) / 2 / cells**2
        for i in range(cells):
            for j in range(cells - i):
                triangles = [(node(i, j), node(i + 1, j), node(i, j + 1))]
                if i + j < cells - 1:
                    triangles.append((node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)))
                for triangle in triangles:
                    centres.append((triangle[0] + triangle[1] + triangle[2]) / 3)
                    areas.append(share)
                    for corner in triangle:
                        key = tuple(np.round(corner / wide, 9).tolist())
                        nodes[key] = (corner, nodes.get(key, (corner, 0.0))[1] + share / 3)
    if side == INSIDE:
        points, area = np.vstack([flat, *centres]), np.concatenate([np.zeros(len(flat)), areas])
    else:
        points, area = np.array([c for c, _ in nodes.values()]), np.array([a for _, a in nodes.values()])
    return corners[0] + points @ frame.T, area


def mass(solid) -> tuple[float, Array]:
    """Volume and centroid of a solid by tetrahedra from its first vertex."""
    vertices, faces = solid
    volume, moment, origin = 0.0, np.zeros(3), vertices[0]
    for f in faces:
        p = vertices[list(f)] - origin
        for v, part in zip(np.cross(p[1:-1], p[2:]) @ p[0] / 6, (p[0] + p[1:-1] + p[2:]) / 4, strict=True):
            volume += v
            moment += v * part
    return float(volume), origin + moment / volume


def wrenches(case: Case, solids) -> tuple[Array, Array, Array, Array]:
    """Size [m], centroid, dead and live wrench about it, per block."""
    n = len(solids)
    size, centroid, weight = np.empty(n), np.empty((n, 3)), np.empty(n)
    for i, solid in enumerate(solids):
        volume, centroid[i] = mass(solid)
        weight[i], size[i] = case.density[i] * GRAVITY * volume, np.cbrt(volume)
    loads = {"dead": np.zeros((n, 6)), "live": np.zeros((n, 6))}
    loads["dead"][:, 2] = -weight
    for f in case.loads:
        target, vector = loads[f.case], np.array(f.vector)
        if f.kind == "body":
            target[case.free, :3] += weight[case.free, None] * vector
            continue
        pushes = [(vector, np.array(f.at))]
        if f.kind == "pressure":
            pushes = []
            vertices, faces = solids[f.block]
            for face in faces:
                p = vertices[list(face)]
                normal = sum(np.cross(p[k] - p[0], p[k + 1] - p[0]) for k in range(1, len(p) - 1))
                if normal @ vector < np.cos(np.deg2rad(10.0)) * np.linalg.norm(normal):
                    continue
                for k in range(1, len(p) - 1):
                    area = 0.5 * np.cross(p[k] - p[0], p[k + 1] - p[0])
                    pushes.append((-f.size * area, (p[0] + p[k] + p[k + 1]) / 3))
        for force, at in pushes:
            target[f.block] += np.concatenate([force, np.cross(at - centroid[f.block], force)])
    return size, centroid, loads["dead"], loads["live"]


def referee(case: Case, cells: int = 0, side: str = INSIDE) -> Verdict:
    """Status and multiplier of a case in space; ``cells`` and ``side`` matter with cohesion or tension only."""
    solids = case.solids()
    faces = find_contacts(solids)
    size, centroid, dead, live = wrenches(case, solids)
    verdicts = []
    for group in parts(case.free, [(f.a, f.b) for f in faces]):
        mine = [f for f in faces if f.a in group or f.b in group]
        verdicts.append(_part(case, group, mine, cells, side, size, centroid, dead, live))
    return together(verdicts)


def _part(case, group, faces, cells, side, size, centroid, dead, live) -> Verdict:
    number = {block: k for k, block in enumerate(group)}
    own = np.maximum(np.abs(dead[group, :3]).max(axis=1), np.abs(dead[group, 3:]).max(axis=1) / size[group])
    moving = np.abs(live[group, :3]).max(axis=1)
    unit = least_unit(own, moving)
    own = np.where(own > 0, own, moving)
    own = np.where(own > 0, own, own[own > 0].min(initial=np.inf))
    own = np.where(np.isfinite(own), own, 1.0)
    load = np.full(len(case.outlines), np.inf)
    load[group] = own
    columns, scale, area = [], [], []
    for f in faces:
        points, share = face_points(f, cells, side)
        s = min(load[f.a], load[f.b])
        block = np.zeros((6 * len(group), len(points), 3))
        for which, sign in ((f.b, 1.0), (f.a, -1.0)):
            if which in number:
                r = 6 * number[which]
                for q, vector in enumerate((f.normal, f.along, f.across)):
                    block[r : r + 3, :, q] = (sign * vector / load[which] * s)[:, None]
                    moment = np.cross(points - centroid[which], vector)
                    block[r + 3 : r + 6, :, q] = (sign * moment / (load[which] * size[which]) * s).T
        columns.append(block.reshape(len(block), -1))
        scale += [s] * len(points)
        area += list(share)
    matrix = np.hstack(columns)
    divide = np.column_stack([np.repeat(own[:, None], 3, axis=1), np.repeat((own * size[group])[:, None], 3, axis=1)])
    d, v = (dead[group] / divide).ravel(), (live[group] * unit / divide).ravel()
    grip = case.law.cohesion * np.array(area) / scale
    pull = case.law.cut_off * np.array(area) / scale
    zero = np.zeros(len(d))
    standing, _ = _program(matrix, case.law.mu, grip, pull, zero, d, 1.0)
    if standing is None or (1e-5 < standing < 1 - 1e-5 and not grip.any()):
        return Verdict(UNDECIDED)
    if standing < 1 - 1e-5:
        return Verdict(CANNOT_STAND)
    if not v.any():
        return Verdict(NO_LIMIT)
    value, residual = _program(matrix, case.law.mu, grip, pull, -d, v, None)
    if value is not None and value < -1e-7:
        return Verdict(UNDECIDED)
    if value is None:
        endless, _ = _program(matrix, case.law.mu, 0 * grip, 0 * pull, zero, v, 1.0)
        return Verdict(NO_LIMIT) if endless is not None and endless > 0.99 else Verdict(UNDECIDED)
    return Verdict(NUMBER, unit * value, residual, unit)


def _program(matrix, mu, grip, pull, right, column, cap) -> tuple[float | None, float]:
    """Largest t with matrix f + column t = right within the law, and its residual; None without a sure answer.

    Where loads of blocks lie decades apart the first answer is poor: solved again in units of its own forces.
    """
    m = matrix.shape[1] // 3
    size, rows, unit = np.ones(m), np.ones(len(right)), 1.0
    best: tuple[float | None, float] = None, np.inf
    for _ in range(PASSES):
        found = _solved(matrix, mu, grip, pull, right, column, cap, size, rows, unit)
        if found is None:
            break
        f, t, y = found
        # what is left of equilibrium is taken out by the smallest forces that do it, over the forces there
        weight = np.repeat(size, 3)
        f = f + weight * np.linalg.lstsq(matrix * weight, right - column * t - matrix @ f, rcond=1e-13)[0]
        residual = _residual(matrix, mu, grip, pull, right, column, f, t)
        if cap is None:
            residual = max(residual, _gap(matrix, mu, grip, pull, right, column, f, t, y))
        if residual <= _ACCEPTED and residual < best[1]:
            best = t, residual
        if residual <= _SOUGHT:
            break
        largest = np.abs(f).reshape(m, 3).max(axis=1)
        size = np.maximum(largest, max(1e-4 * np.median(largest), 1e-12))
        rows = np.maximum(np.abs(matrix * np.repeat(size, 3)).max(axis=1), 1e-9)
        unit = max(abs(t), 1e-6) if cap is None else 1.0
    return best


def _solved(matrix, mu, grip, pull, right, column, cap, size, rows, unit):
    """Forces, t and the velocities dual to the rows, solved in units of ``size``, ``unit`` and ``rows``."""
    f, t = cp.Variable(matrix.shape[1]), cp.Variable()
    normal = f[0::3]
    equilibrium = (matrix * np.repeat(size, 3) / rows[:, None]) @ f + (column * unit / rows) * t == right / rows
    limits = [equilibrium, cp.SOC(mu * normal + grip / size, cp.vstack([f[1::3], f[2::3]]), axis=0)]
    if pull.any() or mu == 0 or grip.any():
        limits.append(normal >= -pull / size)
    if cap is not None:
        limits.append(t <= cap)
    problem = cp.Problem(cp.Maximize(t), limits)
    for accuracy in (1e-11, 1e-9):  # at the first the method may stall short of its end
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # "may be inaccurate": found out by the residuals
                problem.solve(
                    solver=cp.CLARABEL, tol_gap_abs=accuracy, tol_gap_rel=accuracy, tol_feas=accuracy, max_iter=200
                )
        except cp.SolverError:
            continue
        if problem.status in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            return f.value * np.repeat(size, 3), float(t.value) * unit, equilibrium.dual_value / rows
        if problem.status in (cp.UNBOUNDED, cp.INFEASIBLE):
            break
    return None


def _residual(matrix, mu, grip, pull, right, column, f, t) -> float:
    """Largest unbalanced load of a block over its own, and excess over the law over the force of that joint."""
    unbalanced = np.abs(matrix @ f + column * t - right).max()
    shear = np.hypot(f[1::3], f[2::3])
    excess = np.maximum(shear - mu * f[0::3] - grip, 0.0) / max(1.0, mu) + np.maximum(-pull - f[0::3], 0.0)
    return float(max(unbalanced, (excess / np.maximum(1.0, np.abs(f).reshape(-1, 3).max(axis=1))).max()))


def _gap(matrix, mu, grip, pull, right, column, f, t, y) -> float:
    """Relative gap to the kinematic bound: the dual of the equilibrium rows is a mechanism.

    Power of the dead load and of the joints over that of the live load. Where the mechanism closes a joint by more
    than its friction allows, the power that the joint force does there is added to the gap, of a joint force not below
    the load of the lighter block: a joint at rest in these forces need not be so in those of the largest multiplier.
    """
    speed = column @ y
    if not abs(speed) > 0:
        return np.inf
    e = matrix.T @ y / speed
    opening, slip = e[0::3], np.hypot(e[1::3], e[2::3])
    upper = right @ y / speed + grip @ slip + pull @ np.maximum(opening - mu * slip, 0.0)
    closed = np.maximum(mu * slip - opening, 0.0) @ np.maximum(np.abs(f[0::3]), 1.0)
    return float((abs(upper - t) + closed) / max(1e-2, abs(t)))
