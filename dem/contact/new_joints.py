"""Joints made while blocks move: an area between faces, a corner on a face, two edges that cross.

What they inherit.
"""

from functools import cache
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dem.kernels import CORNER, CROSSING, E_DAMPING, E_KINETIC, LAW, Joints, Points
from dem.model.stable_step import block_stiffness, points_of, scaled_masses, stable_step
from dem.model.state import DYNAMIC, State
from dem.model.strain_shapes import add_modal_mass, coupled_of, fastest_of, with_joints
from limitmason.arrays import Array, Flags, Index
from limitmason.model import Assembly

Number = TypeVar("Number", bound=np.generic)

LATTICE = 4
"""Points along either side of a contact found later."""


BEYOND = 0.01
"""Part of an edge by which a crossing may lie beyond its end and still be made; edges that overlap cross within."""

RUN_OFF = 0.1
"""Part of an edge by which a crossing may have run beyond its end and still bear, until a search cuts it anew."""


class Fresh(NamedTuple):
    """A joint before it is written to the arrays of the kernel.

    Fields as in ``dem.kernels.Joints`` and ``Points``.
    """

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
    setback: Array  # part of the gap that keeps the energy, filled by keep_energy
    origin: int
    contact: int
    edge: Array
    limits: Array
    apart: float | Array  # distance now beside the gap: of edges, or by deformation of the faces
    aside: float | Array = 0.0  # displacement now of the faces along each other by their deformation, (m, 2)


def face_joint(
    assembly: Assembly,
    state: State,
    blocks: tuple[int, int],
    polygon: Array,
    plane: Array,
    rot: Array,
    place: Array,
    contact: int,
    like: int | None = None,
) -> Fresh | None:
    """Joint on a polygon of block b's face above the plane of block a's face, blocks (a, b).

    Parameters
    ----------
    like : joint whose law a pair without an interface takes: its own, or that on a face that goes on in this one
    """
    a, b = blocks
    n = plane[:3]
    height = polygon @ n - plane[3]
    flat = polygon - height[:, None] * n
    edge = flat - np.roll(flat, 1, axis=0)
    length = np.linalg.norm(edge, axis=1)
    t1 = edge[length.argmax()] / length.max()
    t2 = _across(n, t1)
    centre = flat.mean(axis=0)
    # the incident face runs against the base's normal: its corners are clockwise seen along -n, hence the reversal
    xy = np.column_stack([(flat - centre) @ t1, (flat - centre) @ t2])[::-1]
    if contact == CORNER:
        # touching corners, each with the same area wherever it comes to lie on the other block's face
        apart = np.linalg.norm(xy - np.roll(xy, 1, axis=0), axis=1) > 0.1 * np.sqrt(_point_area(assembly, a, b))
        grid = xy[apart] if apart.any() else xy[:1]
        area = np.full(len(grid), _point_area(assembly, a, b))
    else:
        grid, area = spread(xy)
        if not area.sum() > 1e-8 * assembly.volumes.min() ** (2.0 / 3.0):
            return None
    gap = linear_at(xy, height[::-1], grid)  # the height of b's face over the base plane
    world = np.stack([t1, t2, n])
    ra, rb = rot[a], rot[b]
    arm_a, arm_b = ra.T @ (centre - place[a]), rb.T @ (centre - place[b])
    qa, qb = state.bodies.quat[a], state.bodies.quat[b]
    relative = _multiply(qa * (1, -1, -1, -1), qb)
    offset = (assembly.centroids[b] + arm_b) - (assembly.centroids[a] + arm_a)
    law, origin = _law_for(assembly, state, blocks, like, (rot, place), n, centre)
    m = len(area)
    return Fresh(
        a, b, grid[:, 0], grid[:, 1], area, gap, world @ ra, world, centre + grid @ world[:2],
        relative * (1, -1, -1, -1), arm_a, arm_b, offset, law, np.zeros((m, 2)), np.zeros(m), np.zeros(m), np.zeros(m),
        origin, contact, np.zeros(3), np.zeros(4), 0.0,
    )


def linear_at(xy: Array, height: Array, at: Array) -> Array:
    """A height that is linear over the plane, known at points about their mean, at others; level across a line."""
    (xx, across), (_, yy) = xy.T @ xy
    det = xx * yy - across * across
    if det > 1e-16 * (xx + yy) ** 2:
        u, v = xy.T @ height
        slope = np.array([yy * u - across * v, xx * v - across * u]) / det
    else:
        slope = np.linalg.lstsq(xy, height - height.mean(), rcond=None)[0]
    return height.mean() + at @ slope


def _point_area(assembly: Assembly, a: int, b: int) -> float:
    """Area whose stiffness a touching corner or a crossing of edges takes [m2].

    They touch in a point; a stiffness per area needs an area all the same. It is assumed: that of an inner point of the
    lattice on a square face of the smaller block's volume, (V^(1/3) / 3)^2. Both have the same, so that no energy is
    lost where a corner slides off a face and two edges go on.
    """
    return float((min(assembly.volumes[a], assembly.volumes[b]) ** (1.0 / 3.0) / (LATTICE - 1)) ** 2)


def crossing_joint(
    assembly: Assembly, state: State, blocks: tuple[int, int], found: Array, rot: Array, place: Array
) -> Fresh | None:
    """Joint of one point where an edge of block a passes an edge of block b, blocks (a, b).

    The edges carry no cohesion or tension and do not dilate. None where they pass beyond their ends: of blocks
    apart, the axis of the widest gap may belong to edges that will not touch, and nearly parallel ones pass far away.
    """
    a, b = blocks
    start_a, along_a, start_b, along_b, n = found
    size = np.linalg.norm(_across(along_a, along_b))
    d = start_b - start_a
    part_a, part_b = _across(d, along_b) @ n / size, _across(d, along_a) @ n / size
    if max(abs(part_a - 0.5), abs(part_b - 0.5)) > 0.5 + BEYOND:
        return None
    point_a, point_b = start_a + part_a * along_a, start_b + part_b * along_b
    long_a, long_b = np.linalg.norm(along_a), np.linalg.norm(along_b)
    along_a, along_b = along_a / long_a, along_b / long_b
    parts = np.array([-RUN_OFF - part_a, 1.0 + RUN_OFF - part_a, -RUN_OFF - part_b, 1.0 + RUN_OFF - part_b])
    ra, rb = rot[a], rot[b]
    arm_a, arm_b = ra.T @ (point_a - place[a]), rb.T @ (point_b - place[b])
    world = np.stack([along_a, _across(n, along_a), n])
    q = state.bodies.quat
    law, origin = _law_for(assembly, state, blocks, None, (rot, place), n, point_a)
    law[[LAW.cohesion, LAW.rest_cohesion, LAW.tension, LAW.rest_tension, LAW.tan_psi, LAW.rest_tan_psi]] = 0.0
    law[LAW.by_opening] = 0.0
    law[LAW.cross] = 1.0
    area = np.array([_point_area(assembly, a, b)])
    zero = np.zeros(1)
    return Fresh(
        a, b, zero, zero, area, zero.copy(), world @ ra, world, point_b[None],
        _multiply(q[a] * (1, -1, -1, -1), q[b]) * (1, -1, -1, -1), arm_a, arm_b,
        (assembly.centroids[b] + arm_b) - (assembly.centroids[a] + arm_a), law, np.zeros((1, 2)), zero.copy(),
        zero.copy(), zero.copy(), origin, CROSSING, rb.T @ along_b, parts * np.repeat([long_a, long_b], 2),
        float(d @ n),
    )


def _law_for(
    assembly: Assembly, state: State, blocks: tuple[int, int], like: int | None, pose: tuple[Array, Array],
    n: Array, at: Array,
) -> tuple[Array, int]:
    """Law of the pair's interface, or an unbonded one, and the interface it came from (encoded).

    Parameters
    ----------
    like : joint whose law a pair without an interface takes; None for the interface on the nearest face of either
        block that looks the same way
    pose : rotation and place of all blocks
    n, at : normal from a to b and place of the contact [m]
    """
    x, (a, b), (rot, place) = assembly.arrays, blocks, pose
    same = ((x.block_a == a) & (x.block_b == b)) | ((x.block_a == b) & (x.block_b == a))
    if same.any():
        k = int(np.flatnonzero(same)[0])
        return state.laws[k].copy(), -2 - k
    if like is not None:
        law = state.joints.law[like].copy()
    else:
        score = np.full(len(state.laws), -np.inf)
        for block, outward in ((a, n), (b, -n)):
            own, local = rot[block].T @ outward, assembly.centroids[block] + rot[block].T @ (at - place[block])
            looks = np.round(np.where(x.block_a == block, 1.0, -1.0) * (x.normal @ own), 2)
            far = np.linalg.norm(x.centre - local, axis=1)
            near = (x.block_a == block) | (x.block_b == block)
            score = np.where(near, np.maximum(score, looks - 1e-3 * far / (far.max() + 1e-300)), score)
        law = state.laws[int(score.argmax())].copy()
    law[[LAW.cohesion, LAW.rest_cohesion, LAW.tension, LAW.rest_tension]] = 0.0
    return law, -1


def spread(xy: Array) -> tuple[Array, Array]:
    """Points of a convex counter-clockwise polygon, edges included, with tributary areas [m2]."""
    if len(xy) == 4:
        a, b, c, d = xy
        u, v = _STEPS[:, None], _STEPS[:, None, None]
        points = ((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)).reshape(-1, 2)
        corners, order, share = _QUAD, _first_named(_QUAD.tobytes()), 0.25
    else:
        points = np.concatenate([xy.mean(axis=0)[None], np.column_stack([xy, 0.5 * (xy + np.roll(xy, -1, axis=0))])
                                 .reshape(-1, 2)])
        corners, share = _spokes(len(xy)), 0.5
        order = _first_named(corners.tobytes())
    e1, e2 = points[corners[:, 1]] - points[corners[:, 0]], points[corners[:, 2]] - points[corners[:, 0]]
    area = share * np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0])
    weight: Array = np.bincount(corners.ravel(), np.repeat(area / 3.0, 3), len(points)).astype(float)[order]
    # points within 1e-9 m are one, in the order in which triangles name them
    number: dict[tuple[float, float], int] = {}
    one = [number.setdefault((x, y), len(number)) for x, y in np.rint(points[order] * 1e9).tolist()]
    if len(number) == len(points):
        return points[order], weight
    first = np.unique(one, return_index=True)[1]
    return points[order[first]], np.bincount(one, weight).astype(float)


@cache
def _first_named(triangles: bytes) -> Index:
    """Points in the order in which triangles name them first."""
    named = np.frombuffer(triangles, dtype=np.int64)
    return named[np.sort(np.unique(named, return_index=True)[1])]


_STEPS = np.linspace(0.0, 1.0, LATTICE)


def _quad_triangles() -> Index:
    """Triangles of the cells of a lattice, each cell both ways, shape (t, 3)."""
    rows = np.arange(LATTICE**2).reshape(LATTICE, LATTICE)
    a, b, c, d = (x.ravel() for x in (rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:], rows[1:, :-1]))
    return np.stack([a, b, c, a, c, d, a, b, d, b, c, d], axis=1).reshape(-1, 3)


_QUAD = _quad_triangles()


@cache
def _spokes(n: int) -> Index:
    """Triangles from the centre 0 to half sides of a polygon whose corners are 1, 3, ... and middles 2, 4, ..."""
    return np.array([
        t for k in range(n) for t in ((0, 1 + 2 * k, 2 + 2 * k), (0, 2 + 2 * k, 1 + 2 * ((k + 1) % n)))
    ])


def _across(u: Array, v: Array) -> Array:
    """Vector product; ``numpy.cross`` takes most of its time to move axes."""
    (a, b, c), (d, e, f) = u.tolist(), v.tolist()
    return np.array([b * f - c * e, c * d - a * f, a * e - b * d])


def _multiply(p: Array, q: Array) -> Array:
    return np.r_[p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + _across(p[1:], q[1:])]


def assemble(assembly: Assembly, state: State, stays: Flags, made: list[Fresh], changed: Flags) -> list[str]:
    """Write the kept and the new joints to the state.

    Keep the step stable.

    Parameters
    ----------
    changed : blocks beside new joints whose stiffness is other than when it was looked at last, shape (n,)
    """
    j, pt = state.joints, state.points
    count, those, each = np.diff(j.start), np.flatnonzero(stays), made
    kept = points_of(j, those)

    def stack(old: NDArray[Number], of: Index, new: list[NDArray[Number]]) -> NDArray[Number]:
        size = len(of)
        out = np.empty((size + sum(len(x) for x in new), *old.shape[1:]), dtype=old.dtype)
        np.take(old, of, axis=0, out=out[:size], mode="clip")
        if new:
            np.concatenate(new, out=out[size:])
        return out

    state.points = Points(
        stack(pt.s, kept, [m.s for m in each]), stack(pt.t, kept, [m.t for m in each]),
        stack(pt.area, kept, [m.area for m in each]), stack(pt.gap, kept, [m.gap for m in each]),
        stack(pt.slip_1, kept, [m.slip[:, 0] for m in each]), stack(pt.slip_2, kept, [m.slip[:, 1] for m in each]),
        stack(pt.lift, kept, [m.lift for m in each]), stack(pt.damage, kept, [m.damage for m in each]),
    )
    state.ends = stack(state.ends, kept, [np.full((len(m.s), state.ends.shape[1]), np.nan) for m in each])
    state.setback = stack(state.setback, kept, [m.setback for m in each])
    sizes = np.concatenate([count[stays], [len(m.s) for m in each]]).astype(np.int64)

    def rows(old: NDArray[Number], name: str) -> NDArray[Number]:
        new = [np.asarray(getattr(m, name), dtype=old.dtype)[None] for m in each]
        return stack(old, those, new)

    state.joints = Joints(
        rows(j.block_a, "a"), rows(j.block_b, "b"), np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        rows(j.frame, "frame"), rows(j.turn, "turn"), rows(j.arm_a, "arm_a"), rows(j.arm_b, "arm_b"),
        rows(j.offset, "offset"), rows(j.law, "law"), rows(j.edge, "edge"),
        rows(j.limits, "limits"),
    )
    state.interface, state.contact = rows(state.interface, "origin"), rows(state.contact, "contact")
    for k in range(len(state.joints.block_a) - len(each), len(state.joints.block_a)):
        lift = state.points.lift[state.joints.start[k] : state.joints.start[k + 1]]
        state.joints.law[k, LAW.lift] = max(state.joints.law[k, LAW.lift], float(lift.max(initial=0.0)))
    if state.modes is not None and state.deformation is not None:
        state.modes = with_joints(state.deformation, state.modes, state.points, state.joints)
    looked_at = changed.copy()
    looked_at[[block for m in made for block in (m.a, m.b)]] = True
    return _keep_stable(assembly, state, looked_at)


def _keep_stable(assembly: Assembly, state: State, blocks: Flags) -> list[str]:
    """Shorten the step (real masses) or add mass (scaled masses) where new contacts made one of some blocks stiffer."""
    bodies = state.bodies
    stiffness = block_stiffness(
        state.points, state.joints, assembly.n_blocks, bodies.rot + np.eye(3), state.ties, blocks
    )
    # what nothing can do needs no mass: points across the thickness would slow a plane problem's turns fiftyfold
    moves = ~state.outside
    stiffness *= moves[:, None] & moves
    inertia = np.asarray(np.linalg.inv(bodies.inv_inertia), dtype=np.float64)
    coupled = None
    if state.modes is not None and state.deformation is not None:
        coupled = coupled_of(state.deformation, state.points, state.joints, moves)
    if state.mode == DYNAMIC:
        top = 0.0 if coupled is None or state.modes is None else fastest_of(bodies.mass, inertia, state.modes, coupled)
        limit = 0.65 * stable_step(stiffness, bodies.mass, inertia, blocks & ~assembly.fixed, state.joints, 1.0, top)
        if limit < 0.999 * state.dt:
            state.dt = limit
            return ["new contacts made the joints stiffer: the time step was shortened"]
        return []
    mass, need = scaled_masses(stiffness, state.dt, 0.65)
    before = state.energy_of_motion()
    for i in np.flatnonzero(blocks & (mass > 1.001 * bodies.mass)).tolist():
        # mass that joins at rest: momentum stays, speed and energy of motion fall
        factor = float(mass[i] / bodies.mass[i])
        bodies.mass[i] = mass[i]
        bodies.inv_mass[i] = 1.0 / mass[i]
        bodies.vel[i] = np.where(bodies.held[i, :3], bodies.vel[i], bodies.vel[i] / factor)
        bodies.spin[i] = np.where(bodies.held[i, 3:], bodies.spin[i], bodies.spin[i] / factor)
        bodies.inv_inertia[i] = bodies.inv_inertia[i] / factor
    rows = np.flatnonzero(blocks & (mass != 1.0))
    fastest = np.linalg.eigvals(bodies.inv_inertia[rows] @ need[rows]).real.max(axis=1, initial=0.0)
    for i, top in zip(rows[fastest > 1.001].tolist(), fastest[fastest > 1.001].tolist(), strict=True):
        bodies.inv_inertia[i] /= top
        bodies.spin[i] = np.where(bodies.held[i, 3:], bodies.spin[i], bodies.spin[i] / top)
    if coupled is not None and state.modes is not None:
        factors = add_modal_mass(
            bodies.mass, bodies.inv_mass, bodies.inv_inertia, state.modes, coupled, state.dt, 0.65
        )[:, None]
        bodies.vel[:] = np.where(bodies.held[:, :3], bodies.vel, bodies.vel / factors)
        bodies.spin[:] = np.where(bodies.held[:, 3:], bodies.spin, bodies.spin / factors)
    after = state.energy_of_motion()
    state.total[E_DAMPING] += before - after
    state.total[E_KINETIC] += after - before
    return []
