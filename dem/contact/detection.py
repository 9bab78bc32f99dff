"""Contacts in large displacement: outworn joints are cut anew, new pairs join, old slip and dilation are inherited."""

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.contact.inheritance import close_setbacks, deformed, inherit, keep_energy
from dem.contact.internal_edges import FLAT, Bearings, Poses, goes_on, moved_together
from dem.contact.new_joints import Fresh, assemble, crossing_joint, face_joint
from dem.kernels import APART, CROSSING, FACES, Joints
from dem.kernels.arrays import Index
from dem.model.edge_points import note_slid, pivots_on_a
from dem.model.holding import smallest_edge
from dem.model.state import DYNAMIC, PointForces, State
from limitmason.arrays import Array, Flags
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.geometry.polyhedron import group_by_topology
from limitmason.model import Assembly

SLIP_FRACTION = 0.25
"""A joint is cut anew when it has slipped this fraction of its point spacing since it was made [-]."""

TURN_LIMIT = np.deg2rad(3.0)
"""Turn of its blocks since it was made from which a joint is cut anew where they touch elsewhere [rad]."""

PIVOT_TURN = np.deg2rad(0.05)
"""Turn from which a joint that slid and pivots on an edge of a is cut anew with b as its base [rad]."""

STIFF_TURN = 1e-3
"""Turn since a joint was made up to which a block's stiffness is that of then, to some thousandths [rad].

With real masses it is :data:`PIVOT_TURN`, to a hundredth: the step is .65 of the stable one, and nothing else hangs
on it.
"""

MARGIN = 0.05
"""Gap up to which two blocks count as near, over the smallest block dimension [-]."""

SMALL = 0.5
"""Displacement up to which the first contacts are all there are, over the gap at which two blocks count as near [-]."""

SOONEST = 4
"""Fewest steps between two searches."""


class Pieces(NamedTuple):
    """Convex pieces of all blocks: corners from the block's centroid in the reference position [m], faces, edges."""

    owner: NDArray[np.int64]
    local: Array
    n_corners: NDArray[np.int64]
    faces: NDArray[np.int64]  # corners of every face, padded
    size: NDArray[np.int64]
    n_faces: NDArray[np.int64]
    edges: NDArray[np.int64]  # both corners and both faces of every edge between faces that are not coplanar, padded
    n_edges: NDArray[np.int64]

    @classmethod
    def of(cls, assembly: Assembly) -> "Pieces":
        """Pieces of an assembly, found once: a push runs the same one at two speeds."""
        if assembly in _KNOWN:
            return _KNOWN[assembly]
        solids = [part for block in assembly.blocks for part in block.parts]
        owner = np.repeat(np.arange(assembly.n_blocks), [len(block.parts) for block in assembly.blocks])
        groups = group_by_topology(solids)
        tables = [_edges_of(faces) for faces, _, _ in groups]
        v = max(vertices.shape[1] for _, _, vertices in groups)
        f = max(len(faces) for faces, _, _ in groups)
        k = max(len(face) for faces, _, _ in groups for face in faces)
        count, m = np.zeros((3, len(solids)), dtype=np.int64), len(solids)
        local, faces_of = np.zeros((m, v, 3)), np.zeros((m, f, k), dtype=np.int64)
        size, edges = np.zeros((m, f), dtype=np.int64), np.zeros((m, max(map(len, tables)), 4), dtype=np.int64)
        for (faces, rows, vertices), table in zip(groups, tables, strict=True):
            n = vertices.shape[1]
            local[rows, :n] = vertices - assembly.centroids[owner[rows]][:, None]
            local[rows, n:] = local[rows, n - 1 : n]
            for j, face in enumerate(faces):
                faces_of[rows, j, : len(face)] = face
                size[rows, j] = len(face)
            bent = _bent(vertices, faces, table)
            first = np.argsort(~bent, axis=1, kind="stable")
            edges[rows, : len(table)] = np.where(np.sort(~bent, axis=1)[:, :, None], 0, table[first])
            count[0, rows], count[1, rows], count[2, rows] = n, len(faces), bent.sum(axis=1)
        _KNOWN[assembly] = cls(owner, local, count[0], faces_of, size, count[1], edges, count[2])
        return _KNOWN[assembly]


_KNOWN: WeakKeyDictionary[Assembly, Pieces] = WeakKeyDictionary()


def _edges_of(faces: Sequence[tuple[int, ...]]) -> Index:
    """Corners i, j and faces of every edge between two faces, shape (e, 4)."""
    beside: dict[tuple[int, int], list[int]] = {}
    for f, face in enumerate(faces):
        for i, j in zip(face, (*face[1:], face[0]), strict=True):
            beside.setdefault((min(i, j), max(i, j)), []).append(f)
    return np.array([(*ends, *fs) for ends, fs in beside.items() if len(fs) == 2], dtype=np.int64).reshape(-1, 4)


def _bent(vertices: Array, faces: Sequence[tuple[int, ...]], edges: Index) -> Flags:
    """Edges of solids of one topology that are none inside a plane, as triangulation leaves them, shape (k, e)."""
    normal = np.empty((len(vertices), len(faces), 3))
    for f, face in enumerate(faces):
        x = vertices[:, list(face)]
        n = np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1)
        normal[:, f] = n / np.linalg.norm(n, axis=1)[:, None]
    return np.asarray(np.einsum("kei,kei->ke", normal[:, edges[:, 2]], normal[:, edges[:, 3]]) < 1.0 - 1e-10)


class Found(NamedTuple):
    """Notes for the user, and the time after which an edge or a corner may touch that is open now [s]."""

    notes: list[str]
    soonest: float


def redetect(assembly: Assembly, state: State, pieces: Pieces, *, margin: float) -> Found:
    """Cut outworn joints anew, drop open ones, add new pairs.

    Changes ``state``.

    A joint between faces stays while it has slipped less than a quarter of its point spacing and, turned by more than 3
    degrees, while its nearest point is the nearest of the blocks: a rocking block keeps its points. The crossing of two
    edges follows them at any slip and turn and stays while it is where the pieces overlap least. A corner, an edge or a
    crossing that carries nothing is looked for anew each time, so that what touches first is what the joint is made
    for. New pairs take the law of a joint of one of their blocks without cohesion and tension: they were never bonded.
    A new joint starts with the shear force and the dilation of the nearest old point of its pair, or of the joint whose
    face goes on in its own (:mod:`dem.internal_edges`), and never with more elastic energy than these had: the gaps of
    pressed points are widened where it would, and narrow again as the points open.

    Parameters
    ----------
    pieces : of the assembly
    margin : gap up to which two blocks count as near [m]
    """
    rot = state.bodies.rot + np.eye(3)
    place = assembly.centroids + state.bodies.shift
    corners = np.einsum("pij,pkj->pki", rot[pieces.owner], pieces.local) + place[pieces.owner][:, None]
    p, q = overlapping_pairs(corners.min(axis=1) - margin, corners.max(axis=1) + margin)
    blocks = np.sort(np.column_stack([pieces.owner[p], pieces.owner[q]]), axis=1)
    use = (blocks[:, 0] != blocks[:, 1]) & ~(assembly.fixed[blocks[:, 0]] & assembly.fixed[blocks[:, 1]])
    p, q, blocks = p[use], q[use], blocks[use]
    met = _Meeting(corners, pieces, p, q, margin)
    now = state.measured(assembly)
    close_setbacks(state, now)
    note_slid(state, now)
    joints = state.joints
    pair_of = np.sort(np.column_stack([joints.block_a, joints.block_b]), axis=1)
    n_blocks = assembly.n_blocks
    code, key = pair_of @ (n_blocks, 1), blocks @ (n_blocks, 1)
    turn = _turned_since(state)
    turned = turn > TURN_LIMIT
    bearings = Bearings.of(state, now, rot, (state.contact == FACES) & ~turned)
    beside = _on_faces_that_go_on(met, joints, bearings, n_blocks)
    shape = met.now
    kind, gap = shape.kind, shape.gap
    near = kind > 0
    outworn = _outworn(assembly, state, now, code, key[near], kind[near], gap[near], margin, turn)
    slip = np.maximum.reduceat(np.linalg.norm(now.slip, axis=1), joints.start[:-1]) if len(code) else np.zeros(0)
    family = Families()
    normal = np.einsum("kij,kj->ki", rot[joints.block_a], joints.frame[:, 2])
    for row, k in beside.items():
        mine = code == key[row]
        across = mine & (np.abs(normal @ shape.plane[row, :3]) < FLAT)
        outworn |= across
        if kind[row] and not (mine & ~across).any():
            outworn[k] = True
            family.join(int(key[row]), int(code[k]))
    for k, other in moved_together(joints, bearings, outworn, slip, 0.5 * margin):
        outworn[other] = True
        family.join(int(code[k]), int(code[other]))
    # all joints of a pair go together: a concave block may touch another in several places
    recut = np.unique(code[outworn])
    stays = ~np.isin(code, recut)
    soonest = _soonest_touch(assembly, state, blocks, gap, (kind > FACES) & (gap > 0.0))
    group = np.array([family.of(int(c)) for c in code], dtype=np.int64)
    made: list[Fresh] = []
    families: list[int] = []
    for row in np.flatnonzero(near & ~np.isin(key, code[stays])).tolist():
        a, b = (p[row], q[row]) if shape.base_first[row] else (q[row], p[row])
        pair = int(pieces.owner[a]), int(pieces.owner[b])
        before = np.flatnonzero((code == key[row]) & (state.contact != CROSSING))
        like = int(before[0]) if len(before) else beside.get(row)
        if kind[row] == CROSSING:
            new: Fresh | None = crossing_joint(assembly, state, pair, shape.crossing[row], rot, place)
        else:
            outline = shape.polygon[row, : shape.corners[row]]
            new = face_joint(assembly, state, pair, outline, shape.plane[row], rot, place, int(kind[row]), like)
        if new is not None:
            families.append(family.of(int(key[row])))
            inherit(state, now, code == key[row], ~stays & (group == families[-1]), new)
            made.append(deformed(state, new))
    if stays.all() and not made:
        return Found([], soonest)
    keep_energy(state, now, np.where(stays, -1, group), made, families)
    changed = np.zeros(n_blocks, dtype=bool)
    limit = PIVOT_TURN if state.mode == DYNAMIC else STIFF_TURN
    changed[pair_of[stays & (turn > limit)].ravel()] = True
    return Found(assemble(assembly, state, stays, made, changed), soonest)


class Families:
    """Pairs of blocks, by number, whose joints on one face are cut anew together and share their energy."""

    def __init__(self) -> None:
        self._first: dict[int, int] = {}

    def of(self, pair: int) -> int:
        """Number of the family of a pair."""
        while pair in self._first:
            pair = self._first[pair]
        return pair

    def join(self, one: int, other: int) -> None:
        """Make two families one."""
        one, other = self.of(one), self.of(other)
        if one != other:
            self._first[one] = other


class _Meeting:
    """How pairs of pieces meet, row by row: see ``kernels.contact_shapes``."""

    def __init__(self, corners: Array, pieces: Pieces, p: Array, q: Array, margin: float) -> None:
        m = len(p)
        self.pieces, self.margin, self.pairs = pieces, margin, np.ascontiguousarray(np.column_stack([p, q]))
        self.poses = Poses(pieces.owner, corners, np.zeros((*pieces.size.shape, 4)))
        self.now = kernels.Meetings(
            np.zeros(m, dtype=np.int64), np.zeros(m), np.zeros(m), np.zeros((m, kernels.MOST, 3)),
            np.zeros(m, dtype=np.int64), np.zeros((m, 4)), np.zeros((m, 5, 3)), np.zeros(m, dtype=bool),
        )  # fmt: skip
        self._look(slice(None), np.full(m, -1))

    def meet_on(self, row: int, piece: int, face: int) -> None:
        """Take a face of a piece as the base of a row, whatever the least overlap."""
        self.now.base_first[row] = piece == self.pairs[row, 0]
        self._look(slice(row, row + 1), np.array([face]))

    def _look(self, rows: slice, face: NDArray[np.int64]) -> None:
        x = self.pieces
        pieces = kernels.PieceArrays(
            self.poses.corners, x.n_corners, x.faces, x.size, x.n_faces, x.edges, x.n_edges, self.poses.planes
        )
        now = kernels.Meetings._make(v[rows] for v in self.now)
        kernels.contact_shapes(pieces, self.pairs[rows], self.margin, FLAT, now, face)


def _on_faces_that_go_on(met: _Meeting, joints: Joints, bearings: Bearings, n_blocks: int) -> dict[int, int]:
    """Let pairs that overlap little along two axes meet on the face that goes on: rows, and the joint beside each."""
    found: dict[int, int] = {}
    shape = met.now
    rows = np.flatnonzero((shape.kind != APART) & (shape.beside > -met.margin))
    if not len(rows) or not len(bearings.row):
        return found
    ends = np.concatenate([joints.block_a[bearings.row], joints.block_b[bearings.row]])
    order = np.argsort(ends, kind="stable")
    cut = np.searchsorted(ends[order], np.arange(1, n_blocks))
    of_block = np.split(order % len(bearings.row), cut)
    for row in rows:
        outline = shape.polygon[row, : shape.corners[row]]
        place = shape.crossing[row, 2] if shape.kind[row] == CROSSING else outline.mean(axis=0)
        on = goes_on(met.poses, joints, bearings, of_block, (met.pairs[row, 0], met.pairs[row, 1]), place)
        if on is not None:
            met.meet_on(int(row), on.piece, on.face)
            if not on.own:
                found[int(row)] = on.joint
    return found


def _outworn(
    assembly: Assembly, state: State, now: PointForces, code: Index, key: Index, kind: Index, gap: Array,
    margin: float, turn: Array,
) -> Flags:  # fmt: skip
    """Joints to drop or to cut anew, by the pair code of every joint and of every pair of pieces that are near now."""
    joints, points, first = state.joints, state.points, state.joints.start[:-1]
    if not len(first):
        return np.zeros(0, dtype=bool)
    slip = np.maximum.reduceat(np.linalg.norm(now.slip, axis=1), first)
    nearest = np.minimum.reduceat(now.opening, first)
    spacing = np.sqrt(np.add.reduceat(points.area, first) / np.diff(joints.start))
    carries = np.maximum.reduceat(np.abs(now.force).max(axis=1), first) > 0.0
    sharp = state.contact > FACES
    # one point on a plane, or two edges, are right at any slip and turn
    single = sharp & (np.add.reduceat((now.opening < 0.0).astype(int), first) == 1)
    worn = ~single & (slip > SLIP_FRACTION * spacing)
    # the piece of the other block that is nearest decides: its kind and gap
    order = np.lexsort((gap, key))
    one, at = np.unique(key[order], return_index=True)
    where = np.searchsorted(one, code)
    near = np.isin(code, one)
    shape, apart = np.zeros(len(code), dtype=np.int64), np.full(len(code), np.inf)
    shape[near], apart[near] = kind[order][at[where[near]]], gap[order][at[where[near]]]
    # the nearest points are others: a block has come to lie on another face, a corner has left its face, the edges no
    # longer cross within their lengths. As long as they are the same, a joint between faces is right at any turn
    elsewhere = np.abs(apart - nearest) > 0.01 * margin + 0.1 * np.abs(nearest)
    loose = ~carries & (sharp | ((shape > FACES) & elsewhere))
    swapped = np.zeros(len(code), dtype=bool)
    for k in np.flatnonzero((turn > PIVOT_TURN) & ~worn).tolist():
        swapped[k] = pivots_on_a(assembly, state, now, k)
    left = elsewhere & ((carries & sharp) | (turn > TURN_LIMIT))
    return worn | loose | left | (nearest > 1.5 * margin) | swapped


def _soonest_touch(assembly: Assembly, state: State, blocks: Array, gap: Array, use: Flags) -> float:
    """Half the time in which the quickest of these pairs could close its gap [s]."""
    if not use.any():
        return np.inf
    a, b = blocks[use].T
    vel, turn = state.bodies.vel, np.linalg.norm(state.bodies.spin, axis=1) * reaches(assembly)
    speed = np.linalg.norm(vel[a] - vel[b], axis=1) + turn[a] + turn[b]
    return float((0.5 * gap[use] / np.maximum(speed, 1e-300)).min())


def pivots_on_wrong_face(assembly: Assembly, state: State, now: PointForces) -> bool:
    """Whether a joint that slid and turned bears on an edge of the block whose face is its plane."""
    note_slid(state, now)
    tipped = np.flatnonzero(_turned_since(state) > PIVOT_TURN)
    return any(pivots_on_a(assembly, state, now, int(k)) for k in tipped)


def near_margin(assembly: Assembly) -> float:
    """Gap up to which two blocks count as near [m]."""
    return MARGIN * smallest_edge(assembly)


def reaches(assembly: Assembly) -> Array:
    """Largest distance of a corner from the centroid of its block [m], shape (n,)."""
    vertices, start = assembly.vertices
    arm = vertices - np.repeat(assembly.centroids, np.diff(start), axis=0)
    return np.asarray(np.maximum.reduceat(np.linalg.norm(arm, axis=1), start[:-1]))


def farthest(assembly: Assembly, state: State, reach: Array) -> tuple[int, float]:
    """Block that has moved most against the held ones, and how far its farthest corner has [m].

    ``reach`` as below.
    """
    b = state.bodies
    ground = b.shift[assembly.fixed].mean(axis=0) if assembly.fixed.any() else np.zeros(3)
    moved = np.linalg.norm(b.shift - ground, axis=1)
    turned = 2.0 * np.arcsin(np.minimum(np.linalg.norm(b.quat[:, 1:], axis=1), 1.0))
    path = moved + turned * reach
    return int(path.argmax()), float(path.max())


def travel_per_step(state: State, reach: Array) -> float:
    """Largest distance that a corner of a block can travel in one step [m].

    ``reach`` as :func:`reaches` gives it.
    """
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
