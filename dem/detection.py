"""Contacts in large displacement: outworn joints are cut anew, new pairs join, old slip and dilation are inherited."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.kernels import LAW_C, LAW_C_R, LAW_FT, LAW_FT_R, LAW_KS, LAW_LIFT, Joints, Points
from dem.stability import block_stiffness, scaled_masses, stable_step
from dem.state import DYNAMIC, State
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.model import Assembly

Array = NDArray[np.float64]

SLIP_FRACTION = 0.25
"""A joint is cut anew when it has slipped this fraction of its point spacing since it was made [-]."""

TURN_LIMIT = np.deg2rad(3.0)
"""A joint is cut anew when its blocks have turned this far against each other since it was made [rad]."""

MARGIN = 0.05
"""Gap up to which two blocks count as near, over the smallest block dimension [-]."""

LATTICE = 4
"""Points along either side of a contact found later."""


class Pieces(NamedTuple):
    """Convex pieces of all blocks: corners from the block's centroid in the reference position [m], padded faces."""

    owner: NDArray[np.int64]
    local: Array
    n_corners: NDArray[np.int64]
    faces: NDArray[np.int64]
    size: NDArray[np.int64]
    n_faces: NDArray[np.int64]

    @classmethod
    def of(cls, assembly: Assembly) -> "Pieces":
        """Pieces of an assembly."""
        parts = [(i, part) for i, block in enumerate(assembly.blocks) for part in block.parts]
        v = max(len(p.vertices) for _, p in parts)
        f = max(len(p.faces) for _, p in parts)
        k = max(len(face) for _, p in parts for face in p.faces)
        local, faces = np.zeros((len(parts), v, 3)), np.zeros((len(parts), f, k), dtype=np.int64)
        size = np.zeros((len(parts), f), dtype=np.int64)
        for row, (i, p) in enumerate(parts):
            n = len(p.vertices)
            local[row, :n] = p.vertices - assembly.centroids[i]
            local[row, n:] = local[row, n - 1]
            for j, face in enumerate(p.faces):
                faces[row, j, : len(face)] = face
                size[row, j] = len(face)
        return cls(
            np.array([i for i, _ in parts]), local, np.array([len(p.vertices) for _, p in parts]), faces, size,
            np.array([len(p.faces) for _, p in parts]),
        )  # fmt: skip


def redetect(assembly: Assembly, state: State, *, margin: float | None = None) -> list[str]:
    """Cut outworn joints anew, drop open ones, add new pairs; changes ``state`` and returns notes for the user.

    A joint stays while it has slipped less than a quarter of its point spacing and turned less than 3 degrees. New
    pairs take the law of a joint of one of their blocks without cohesion and tension: they were never bonded. A new
    joint starts with the shear force and the dilation of the nearest old point of its pair.

    Parameters
    ----------
    margin : gap up to which two blocks count as near [m]; 5 % of the smallest block dimension by default
    """
    pieces = Pieces.of(assembly)
    rot = state.bodies.rot + np.eye(3)
    place = assembly.centroids + state.bodies.shift
    corners = np.einsum("pij,pkj->pki", rot[pieces.owner], pieces.local) + place[pieces.owner][:, None]
    margin = near_margin(assembly) if margin is None else margin
    low, high = corners.min(axis=1) - margin, corners.max(axis=1) + margin
    p, q = overlapping_pairs(low, high)
    blocks = np.sort(np.column_stack([pieces.owner[p], pieces.owner[q]]), axis=1)
    use = (blocks[:, 0] != blocks[:, 1]) & ~(assembly.fixed[blocks[:, 0]] & assembly.fixed[blocks[:, 1]])
    p, q, blocks = p[use], q[use], blocks[use]

    now = state.measured(assembly)
    joints, points = state.joints, state.points
    first = joints.start[:-1]
    pair_of = np.sort(np.column_stack([joints.block_a, joints.block_b]), axis=1)
    count = np.diff(joints.start)
    slip, nearest, spacing = np.zeros(0), np.zeros(0), np.zeros(0)
    if len(first):
        slip = np.maximum.reduceat(np.linalg.norm(now.slip, axis=1), first)
        nearest = np.minimum.reduceat(now.opening, first)
        spacing = np.sqrt(np.add.reduceat(points.area, first) / count)
    worn = (slip > SLIP_FRACTION * spacing) | (_turned_since(state) > TURN_LIMIT)
    gone = nearest > 1.5 * margin
    recut = {tuple(x) for x in pair_of[worn | gone].tolist()}
    # all joints of a pair go together: a concave block may touch another in several places
    stays = np.array([tuple(x) not in recut for x in pair_of.tolist()], dtype=bool)
    present = {tuple(x) for x in pair_of[stays].tolist()}
    wanted = np.array([tuple(x) not in present for x in blocks.tolist()], dtype=bool)
    p, q, blocks = p[wanted], q[wanted], blocks[wanted]
    if stays.all() and not len(p):
        return []
    m = len(p)
    polygon, n_poly = np.zeros((m, 32, 3)), np.zeros(m, dtype=np.int64)
    plane, base_first = np.zeros((m, 4)), np.zeros(m, dtype=bool)
    kernels.contact_polygons(
        corners, pieces.n_corners, pieces.faces, pieces.size, pieces.n_faces,
        np.ascontiguousarray(np.column_stack([p, q])), margin, polygon, n_poly, plane, base_first,
    )  # fmt: skip
    made = []
    for row in np.flatnonzero(n_poly >= 3):
        a, b = (pieces.owner[p[row]], pieces.owner[q[row]]) if base_first[row] else (
            pieces.owner[q[row]], pieces.owner[p[row]])  # fmt: skip
        new = _new_joint(assembly, state, int(a), int(b), polygon[row, : n_poly[row]], plane[row], rot, place)
        if new is not None:
            _inherit(state, now, pair_of, new)
            made.append(new)
    if stays.all() and not made:
        return []
    return _assemble(assembly, state, stays, made)


def near_margin(assembly: Assembly) -> float:
    """Gap up to which two blocks count as near [m]."""
    return MARGIN * min(
        float(np.ptp(b.vertices, axis=0).min()) for b, f in zip(assembly.blocks, assembly.fixed, strict=True) if not f
    )


def travel_per_step(assembly: Assembly, state: State) -> float:
    """Largest distance that a corner of a block can travel in one step [m]."""
    reach = np.array([np.linalg.norm(b.vertices - c, axis=1).max()
                      for b, c in zip(assembly.blocks, assembly.centroids, strict=True)])  # fmt: skip
    speed = np.linalg.norm(state.bodies.vel, axis=1) + np.linalg.norm(state.bodies.spin, axis=1) * reach
    return float(speed.max(initial=0.0)) * state.dt


def _turned_since(state: State) -> Array:
    """Relative rotation of every joint's blocks since it was made [rad]."""
    j, q = state.joints, state.bodies.quat
    p = q[j.block_a] * (1, -1, -1, -1)
    relative = _multiply_rows(_multiply_rows(p, q[j.block_b]), j.turn)
    return 2.0 * np.arcsin(np.minimum(np.linalg.norm(relative[:, 1:], axis=1), 1.0))


def _multiply_rows(p: Array, q: Array) -> Array:
    scalar = p[:, 0] * q[:, 0] - (p[:, 1:] * q[:, 1:]).sum(axis=1)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.column_stack([scalar, vector])


class _Fresh(NamedTuple):
    a: int
    b: int
    s: Array
    t: Array
    area: Array
    gap: Array
    frame: Array  # in the axes of a
    world: Array  # frame in global axes
    position: Array
    turn: Array
    arm_a: Array
    arm_b: Array
    offset: Array
    law: Array
    slip: Array  # (m, 2), filled by _inherit
    lift: Array
    damage: Array
    origin: int


def _new_joint(
    assembly: Assembly, state: State, a: int, b: int, polygon: Array, plane: Array, rot: Array, place: Array
) -> _Fresh | None:
    """Joint on a polygon of block b's face above the plane of block a's face."""
    n = plane[:3]
    height = polygon @ n - plane[3]
    flat = polygon - height[:, None] * n
    edge = flat - np.roll(flat, 1, axis=0)
    length = np.linalg.norm(edge, axis=1)
    t1 = edge[length.argmax()] / length.max()
    t2 = np.cross(n, t1)
    centre = flat.mean(axis=0)
    # the incident face runs against the base's normal: its corners are clockwise seen along -n, hence the reversal
    xy = np.column_stack([(flat - centre) @ t1, (flat - centre) @ t2])[::-1]
    grid, area = _fan(xy)
    if not area.sum() > 1e-8 * assembly.volumes.min() ** (2.0 / 3.0):
        return None
    # height of b's face over the base plane is linear
    fit = np.linalg.lstsq(np.column_stack([np.ones(len(xy)), xy]), height[::-1], rcond=None)[0]
    gap = fit[0] + grid @ fit[1:]
    world = np.stack([t1, t2, n])
    ra, rb = rot[a], rot[b]
    arm_a, arm_b = ra.T @ (centre - place[a]), rb.T @ (centre - place[b])
    qa, qb = state.bodies.quat[a], state.bodies.quat[b]
    relative = _multiply(qa * (1, -1, -1, -1), qb)
    offset = (assembly.centroids[b] + arm_b) - (assembly.centroids[a] + arm_a)
    law, origin = _law_for(assembly, state, a, b)
    m = len(area)
    return _Fresh(
        a, b, grid[:, 0], grid[:, 1], area, gap, world @ ra, world, centre + grid @ world[:2],
        relative * (1, -1, -1, -1), arm_a, arm_b, offset, law, np.zeros((m, 2)), np.zeros(m), np.zeros(m), origin,
    )  # fmt: skip


def _law_for(assembly: Assembly, state: State, a: int, b: int) -> tuple[Array, int]:
    """Law of the pair's interface, or an unbonded one of either block; and the interface it came from (encoded)."""
    x = assembly.arrays
    same = ((x.block_a == a) & (x.block_b == b)) | ((x.block_a == b) & (x.block_b == a))
    if same.any():
        k = int(np.flatnonzero(same)[0])
        return state.laws[k].copy(), -2 - k
    near = (x.block_a == a) | (x.block_a == b) | (x.block_b == a) | (x.block_b == b)
    law = state.laws[int(np.flatnonzero(near)[0]) if near.any() else 0].copy()
    law[[LAW_C, LAW_C_R, LAW_FT, LAW_FT_R]] = 0.0
    return law, -1


def _inherit(state: State, now, pair_of: Array, new: _Fresh) -> None:
    """Elastic shear displacement, dilation and damage of the nearest old point of the same pair."""
    old = np.flatnonzero((pair_of == sorted((new.a, new.b))).all(axis=1))
    if not len(old):
        return
    mine = np.flatnonzero(np.isin(now.owner, old))
    nearest = mine[((new.position[:, None] - now.position[mine][None]) ** 2).sum(axis=2).argmin(axis=1)]
    points, joints = state.points, state.joints
    owner = now.owner[nearest]
    # force on block b of the old joint; the new joint may have swapped a and b
    sign = np.where(joints.block_b[owner] == new.b, 1.0, -1.0)
    shear = (now.force[nearest] * sign[:, None]) / points.area[nearest][:, None]
    new.slip[:, 0] = shear @ new.world[0] / new.law[LAW_KS]
    new.slip[:, 1] = shear @ new.world[1] / new.law[LAW_KS]
    new.lift[:] = points.lift[nearest]
    new.damage[:] = points.damage[nearest]


def _fan(xy: Array) -> tuple[Array, Array]:
    """Points of a convex counter-clockwise polygon, edges included, with tributary areas [m2]."""
    n = len(xy)
    steps = np.linspace(0.0, 1.0, LATTICE)
    points: list[Array] = []
    weights: list[float] = []
    index: dict[tuple[int, int], int] = {}

    def add(p: Array, w: float) -> None:
        key = (round(float(p[0]) * 1e9), round(float(p[1]) * 1e9))
        if key not in index:
            index[key] = len(points)
            points.append(p)
            weights.append(0.0)
        weights[index[key]] += w

    if n == 4:
        a, b, c, d = xy
        grid = [[(1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c) for u in steps] for v in steps]
        cells = [(grid[i][j], grid[i][j + 1], grid[i + 1][j + 1], grid[i + 1][j])
                 for i in range(LATTICE - 1) for j in range(LATTICE - 1)]  # fmt: skip
        for cell in cells:
            for tri in ((cell[0], cell[1], cell[2]), (cell[0], cell[2], cell[3]), (cell[0], cell[1], cell[3]),
                        (cell[1], cell[2], cell[3])):  # fmt: skip
                area = 0.25 * abs(_cross(tri[1] - tri[0], tri[2] - tri[0]))
                for corner in tri:
                    add(corner, area / 3.0)
        return np.array(points), np.array(weights)
    centre = xy.mean(axis=0)
    for k in range(n):
        a, b = xy[k], xy[(k + 1) % n]
        middle = 0.5 * (a + b)
        for tri in ((centre, a, middle), (centre, middle, b)):
            area = 0.5 * abs(_cross(tri[1] - tri[0], tri[2] - tri[0]))
            for corner in tri:
                add(corner, area / 3.0)
    return np.array(points), np.array(weights)


def _cross(u: Array, v: Array) -> float:
    return float(u[0] * v[1] - u[1] * v[0])


def _multiply(p: Array, q: Array) -> Array:
    return np.r_[p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]


def _assemble(assembly: Assembly, state: State, stays: NDArray[np.bool_], made: list[_Fresh]) -> list[str]:
    """Write the kept and the new joints to the state; keep the step stable."""
    j, pt = state.joints, state.points
    count = np.diff(j.start)
    kept = np.repeat(stays, count)

    def stack(old: Array, new: list[Array]) -> Array:
        return np.ascontiguousarray(np.concatenate([old, *new]) if new else old.copy())

    each = made
    state.points = Points(
        stack(pt.s[kept], [m.s for m in each]), stack(pt.t[kept], [m.t for m in each]),
        stack(pt.area[kept], [m.area for m in each]), stack(pt.gap[kept], [m.gap for m in each]),
        stack(pt.slip_1[kept], [m.slip[:, 0] for m in each]), stack(pt.slip_2[kept], [m.slip[:, 1] for m in each]),
        stack(pt.lift[kept], [m.lift for m in each]), stack(pt.damage[kept], [m.damage for m in each]),
    )  # fmt: skip
    sizes = np.concatenate([count[stays], [len(m.s) for m in each]]).astype(np.int64)

    def rows(old: Array, name: str) -> Array:
        new = [np.asarray(getattr(m, name), dtype=old.dtype)[None] for m in each]
        return stack(old[stays], new)

    state.joints = Joints(
        rows(j.block_a, "a"), rows(j.block_b, "b"), np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        rows(j.frame, "frame"), rows(j.turn, "turn"), rows(j.arm_a, "arm_a"), rows(j.arm_b, "arm_b"),
        rows(j.offset, "offset"), rows(j.law, "law"),
    )  # fmt: skip
    state.interface = rows(state.interface, "origin")
    for k in range(len(state.joints.block_a) - len(each), len(state.joints.block_a)):
        lift = state.points.lift[state.joints.start[k] : state.joints.start[k + 1]]
        state.joints.law[k, LAW_LIFT] = max(state.joints.law[k, LAW_LIFT], float(lift.max(initial=0.0)))
    return _keep_stable(assembly, state)


def _keep_stable(assembly: Assembly, state: State) -> list[str]:
    """Shorten the step (real masses) or add mass (scaled masses) where new contacts made a block stiffer."""
    bodies = state.bodies
    stiffness = block_stiffness(state.points, state.joints, assembly.n_blocks, bodies.rot + np.eye(3))
    inertia = np.linalg.inv(bodies.inv_inertia)
    if state.mode == DYNAMIC:
        limit = 0.65 * stable_step(stiffness, bodies.mass, inertia, ~assembly.fixed, state.joints, 1.0)
        if limit < 0.999 * state.dt:
            state.dt = limit
            return ["new contacts made the joints stiffer: the time step was shortened"]
        return []
    mass, need = scaled_masses(stiffness, state.dt, 0.65)
    for i in np.flatnonzero(mass > 1.001 * bodies.mass):
        factor = mass[i] / bodies.mass[i]
        bodies.mass[i] = mass[i]
        bodies.inv_mass[i] = 1.0 / mass[i]
        bodies.ang[i] *= factor
        bodies.inv_inertia[i] = bodies.inv_inertia[i] / factor
    for i in range(assembly.n_blocks):
        top = np.linalg.eigvals(bodies.inv_inertia[i] @ need[i]).real.max()
        if mass[i] != 1.0 and top > 1.001:
            bodies.inv_inertia[i] /= top
            bodies.ang[i] *= top
    return []
