"""Contacts found anew while blocks move: corners that leave a face or come to another, and what a new point inherits.

Every face of every block has corners (in plane: its two ends) and sides. A contact point is a corner of one block on a
face of another. After a step, points whose corner has left its face are dropped and corners that have come inside
another face become points: of two blocks that slide, the end that stood out goes on as the end of the other block that
is now inside, with the force, the slip and the lift of the point that it replaces, so that equilibrium is disturbed by
no more than the overshoot. Corners of blocks that had no joint take an unbonded law.

In space edges that come to cross are not found: a corner that has left its face stays a point unless another corner
takes its place, as do points that are no corners, where edges cross or inside a grid. :func:`outside` says how far.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.contacts import NEW, Contacts, turned_over
from limitmason.capacity.kinematics import Pose, at_rest
from limitmason.capacity.point_law import History
from limitmason.geometry.boxtree import overlapping_pairs
from limitmason.law import PointLaw
from limitmason.model.assembly import Assembly
from limitmason.plane import Plane

Array = NDArray[np.float64]
Index = NDArray[np.intp]

OVERSHOOT = 1e-3
"""How far beyond a side a corner goes before it has left a face, or come to it, over the median block size [-]."""

NEAR = 0.01
"""Gap within which a corner is made a contact point, over the median block size [-]."""

FACING = -0.5
"""Cosine between the outward normals up to which the face of a corner looks at another face."""


class Shapes(NamedTuple):
    """Faces of all blocks and their corners in the reference pose; a face has k sides, padded by repetition.

    Parameters
    ----------
    face_block, face_place, normal : block, a point [m] and the outward normal of every face
    side, reach : inward unit normals of the sides, (f, k, 3), and side . x on them in the reference pose [m], (f, k)
    corner_face, corner_place : face that a corner belongs to, and where it is [m], shape (q,) and (q, 3)
    faces_of, corners_of : numbers of the faces and the corners of every block, in order of blocks; start per block
    inset : distance by which contacts are pulled in from the ends of faces [m]
    step : how far beyond a side counts [m]
    near : gap within which a corner becomes a point [m]
    spread : largest distance of a corner from its block's centroid [m], shape (n,)
    strangers : codes corner * f + face of what lies together in the reference pose without a joint
    """

    face_block: Index
    face_place: Array
    normal: Array
    side: Array
    reach: Array
    corner_face: Index
    corner_place: Array
    face_start: Index
    corner_start: Index
    inset: float
    step: float
    near: float
    spread: Array
    strangers: NDArray[np.int64]


def shapes_of(assembly: Assembly, contacts: Contacts, plane: Plane | None, size: float) -> tuple[Shapes, Contacts]:
    """Faces and corners of an assembly, and the contacts with their corners named and the frame carried by the face.

    Parameters
    ----------
    contacts : of the reference pose
    plane : of a problem in plane, whose faces are then lines; None in space
    size : median block size [m]
    """
    outlines = _outlines(assembly, contacts, plane)
    inset = _inset(assembly, contacts, outlines, plane)
    block: list[int] = []
    place, normal, side, reach, owner, corner = ([] for _ in range(6))
    width = max((len(p) for _, p, _ in outlines), default=2)
    for b, points, n in outlines:
        if plane is not None:
            along = points[1] - points[0]
            length = float(np.linalg.norm(along))
            if length <= 2.0 * inset:
                continue
            along = along / length
            ends = np.array([points[0] + inset * along, points[1] - inset * along])
            inward = np.array([along, -along])
        else:
            ends = points
            edge = np.roll(points, -1, axis=0) - points
            inward = np.cross(n, edge)
            inward = inward / np.linalg.norm(inward, axis=1)[:, None]
        pad = np.minimum(np.arange(width), len(ends) - 1)
        block.append(b)
        place.append(ends.mean(axis=0))
        normal.append(n)
        side.append(inward[pad])
        reach.append((inward * ends).sum(axis=1)[pad])
        owner.append(np.full(len(ends), len(block) - 1))
        corner.append(ends)
    face_block = np.array(block, np.intp)
    corner_face = np.concatenate(owner).astype(np.intp)
    corner_place = np.concatenate(corner)
    blocks = np.arange(assembly.n_blocks + 1)
    away = np.linalg.norm(corner_place - assembly.centroids[face_block[corner_face]], axis=1)
    spread = np.zeros(assembly.n_blocks)
    np.maximum.at(spread, face_block[corner_face], away)
    shapes = Shapes(
        face_block, np.array(place), np.array(normal), np.array(side), np.array(reach), corner_face, corner_place,
        np.searchsorted(face_block, blocks), np.searchsorted(face_block[corner_face], blocks),
        inset, OVERSHOOT * size, NEAR * size, spread, np.empty(0, np.int64),
    )  # fmt: skip
    rest = at_rest(assembly.n_blocks)
    named = _named(shapes, contacts, assembly)
    near = _together(shapes, assembly, rest, -shapes.near)
    known = named.corner.astype(np.int64) * len(face_block) + named.face
    code = near.corner.astype(np.int64) * len(face_block) + near.face
    # what lies together without being a point belongs to a joint of the model, or to none by its user's will
    return shapes._replace(strangers=_strangers(shapes, named, near, np.setdiff1d(code, known))), named


class _Near(NamedTuple):
    """Corners at faces: numbers of both, gap [m], and the least distance inside a side [m]."""

    corner: Index
    face: Index
    gap: Array
    inside: Array


def _outlines(assembly: Assembly, contacts: Contacts, plane: Plane | None) -> list[tuple[int, Array, Array]]:
    """Block, corners and outward normal of every face, blocks in order; in plane the two ends of a line."""
    out = []
    level = 0.0 if plane is None else float(np.median(contacts.place_b @ plane.normal))
    for b, body in enumerate(assembly.blocks):
        for part in body.parts:
            for face in part.faces:
                x = part.vertices[list(face)]
                n = np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0)
                n = n / np.linalg.norm(n)
                if plane is None:
                    out.append((b, x, n))
                    continue
                if abs(n @ plane.normal) > 1e-6:
                    continue
                along = np.cross(plane.normal, n)
                s = x @ along
                flat = x[[int(s.argmin()), int(s.argmax())]]
                out.append((b, flat + (level - flat @ plane.normal)[:, None] * plane.normal, n))
    return out


def _inset(
    assembly: Assembly, contacts: Contacts, outlines: list[tuple[int, Array, Array]], plane: Plane | None
) -> float:
    """How far the contacts of the model are pulled in from the ends of the faces [m]: the median over its joints."""
    if plane is None:
        return 0.0
    found = []
    faces: dict[int, list[tuple[Array, Array]]] = {}
    for b, points, n in outlines:
        faces.setdefault(b, []).append((points, n))
    first = np.flatnonzero(np.diff(contacts.interface, prepend=-2))
    last = np.append(first[1:], contacts.count) - 1
    for i in np.concatenate([first, last]):
        nearest = []
        for block, sign in ((contacts.block_a[i], 1.0), (contacts.block_b[i], -1.0)):
            n = sign * contacts.directions[i, 0]
            for points, normal in faces.get(int(block), []):
                off = abs((contacts.place_b[i] - points[0]) @ normal)
                if normal @ n > 1.0 - 1e-6 and off < 1e-3 * np.linalg.norm(points[1] - points[0]):
                    nearest.append(float(np.linalg.norm(points - contacts.place_b[i], axis=1).min()))
        if nearest:
            found.append(min(nearest))
    inset = float(np.median(found)) if found else 0.0
    return inset if inset > 10.0 * assembly.tolerance else 0.0


def _named(shapes: Shapes, c: Contacts, assembly: Assembly) -> Contacts:
    """The contacts with their corners and faces, the frame carried by the face.

    Where two corners meet the frame stays with a support, then with the heavier block, then as it is.
    """
    near = _together(shapes, assembly, at_rest(assembly.n_blocks), -shapes.near)
    owner = shapes.face_block[shapes.corner_face]
    by_pair: dict[tuple[int, int], list[int]] = {}
    for row in range(len(near.corner)):
        key = int(shapes.face_block[near.face[row]]), int(owner[near.corner[row]])
        by_pair.setdefault(key, []).append(row)
    corner, face, over = c.corner.copy(), c.face.copy(), np.zeros(c.count, bool)
    mass = assembly.weights
    reachable = 1e-2 * shapes.near + 1e-9
    for i in range(c.count):
        a, b = int(c.block_a[i]), int(c.block_b[i])
        best: dict[bool, int] = {}
        for flipped, key in ((False, (a, b)), (True, (b, a))):
            for row in by_pair.get(key, []):
                off = shapes.corner_place[near.corner[row]] - c.place_b[i]
                if np.abs(off).max() < reachable:
                    best[flipped] = row
        if not best:
            continue
        flipped = next(iter(best))
        if len(best) == 2:
            if assembly.fixed[a] != assembly.fixed[b]:
                flipped = bool(assembly.fixed[b])
            else:
                flipped = bool(mass[b] > (1.0 + 1e-9) * mass[a])
        over[i] = flipped
        corner[i], face[i] = near.corner[best[flipped]], near.face[best[flipped]]
    return replace(turned_over(c, over), corner=corner, face=face)


def _strangers(shapes: Shapes, c: Contacts, near: _Near, codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Of what lies together in the reference pose without being a point, what shall not become one.

    That is all but the second of two corners that meet, which takes over once they slide.
    """
    f = len(shapes.face_block)
    owner = shapes.face_block[shapes.corner_face]
    pairs = {(min(a, b), max(a, b)) for a, b in zip(c.block_a.tolist(), c.block_b.tolist(), strict=True)}
    deep = set((near.corner.astype(np.int64) * f + near.face)[near.inside > shapes.step].tolist())
    out = []
    for code in codes.tolist():
        a, b = int(shapes.face_block[code % f]), int(owner[code // f])
        if code in deep or (min(a, b), max(a, b)) not in pairs:
            out.append(code)
    return np.array(out, np.int64)


def _together(shapes: Shapes, assembly: Assembly, pose: Pose, inside: float) -> _Near:
    """Corners within the near gap of faces of other blocks in a pose and at least so far inside their sides [m]."""
    x = assembly.centroids + pose.shift
    reach = shapes.spread + shapes.near
    one, two = overlapping_pairs(x - reach[:, None], x + reach[:, None])
    apart = ~(assembly.fixed[one] & assembly.fixed[two])
    one, two = one[apart], two[apart]
    near = np.linalg.norm(x[one] - x[two], axis=1) < shapes.spread[one] + shapes.spread[two] + shapes.near
    of, on = np.concatenate([one[near], two[near]]), np.concatenate([two[near], one[near]])
    corner, face = _products(shapes.corner_start, of, shapes.face_start, on)
    gap, sides = _distances(shapes, assembly, pose, corner, face)
    own = shapes.corner_face[corner]
    looks = np.einsum("ij,ij->i", _turned(pose, shapes.face_block[own], shapes.normal[own]),
                      _turned(pose, shapes.face_block[face], shapes.normal[face]))  # fmt: skip
    use = (np.abs(gap) < shapes.near) & (sides > inside) & (looks < FACING)
    return _Near(corner[use], face[use], gap[use], sides[use])


def _products(corner_start: Index, of: Index, face_start: Index, on: Index) -> tuple[Index, Index]:
    """Every corner of the blocks ``of`` with every face of the blocks ``on``, pair by pair."""
    nc, nf = np.diff(corner_start)[of], np.diff(face_start)[on]
    total = nc * nf
    pair = np.repeat(np.arange(len(of)), total)
    k = np.arange(total.sum()) - np.repeat(np.cumsum(total) - total, total)
    return corner_start[of][pair] + k // np.maximum(nf[pair], 1), face_start[on][pair] + k % np.maximum(nf[pair], 1)


def _turned(pose: Pose, block: Index, vector: Array) -> Array:
    return vector + np.einsum("mij,mj->mi", pose.turn[block], vector)


def _distances(shapes: Shapes, assembly: Assembly, pose: Pose, corner: Index, face: Index) -> tuple[Array, Array]:
    """Gap of corners above faces and the least distance inside their sides in a pose [m]."""
    owner, base = shapes.face_block[shapes.corner_face[corner]], shapes.face_block[face]
    return _beside(shapes, assembly, pose, shapes.corner_place[corner], owner, face, base)


def _beside(
    shapes: Shapes, assembly: Assembly, pose: Pose, place: Array, owner: Index, face: Index, base: Index
) -> tuple[Array, Array]:
    """The same for any material points of blocks ``owner``, by their reference places."""
    x = assembly.centroids
    now = x[owner] + pose.shift[owner] + _turned(pose, owner, place - x[owner])
    local = now - x[base] - pose.shift[base]
    local = x[base] + local + np.einsum("mji,mj->mi", pose.turn[base], local)
    gap = ((local - shapes.face_place[face]) * shapes.normal[face]).sum(axis=1)
    sides = np.einsum("mki,mi->mk", shapes.side[face], local) - shapes.reach[face]
    return gap, sides.min(axis=1)


class Renewed(NamedTuple):
    """Contacts found anew with their history and forces [N], and how many were dropped and made."""

    contacts: Contacts
    history: History
    force: Array
    dropped: int
    made: int


def found_anew(
    shapes: Shapes, assembly: Assembly, c: Contacts, pose: Pose, history: History, force: Array
) -> Renewed | None:
    """The contacts of a pose; None where they are still the same.

    Parameters
    ----------
    force : of the points in that pose [N], shape (m, c)
    """
    keyed = c.face >= 0
    inside = np.full(c.count, np.inf)
    gap = np.zeros(c.count)
    gap[keyed], inside[keyed] = _beside(
        shapes, assembly, pose, c.place_b[keyed], c.block_b[keyed], c.face[keyed], c.block_a[keyed]
    )
    gone = (inside < -shapes.step) | ((c.interface == NEW) & (gap > 2.0 * shapes.near))
    near = _together(shapes, assembly, pose, shapes.step)
    f = len(shapes.face_block)
    code = near.corner.astype(np.int64) * f + near.face
    present = c.corner.astype(np.int64) * f + c.face
    fresh = ~np.isin(code, present[keyed]) & ~np.isin(code, shapes.strangers)
    near = _Near(near.corner[fresh], near.face[fresh], near.gap[fresh], near.inside[fresh])
    if not (gone.any() or len(near.corner)):
        return None
    if c.components == 3:
        gone &= _replaced(shapes, c, near)
    x = assembly.centroids
    now_b = x[c.block_b] + pose.shift[c.block_b] + _turned(pose, c.block_b, c.place_b - x[c.block_b])
    rows: list[Contacts] = []
    forces: list[Array] = []
    slips: list[Array] = []
    lifts: list[float] = []
    hurt: list[float] = []
    for row in np.lexsort((near.gap, near.face)):
        made = _made(shapes, assembly, c, pose, history, force, gone, now_b, near, int(row), rows)
        if made is None:
            continue
        rows.append(made[0])
        forces.append(made[1])
        slips.append(made[2])
        lifts.append(made[3])
        hurt.append(made[4])
    if not (gone.any() or rows):
        return None
    kept = c.at(~gone)
    all_force, slip, lift = force[~gone], history.slip[~gone], history.lift[~gone]
    for k, new in enumerate(rows):
        kept = kept.with_rows(new)
        all_force = np.vstack([all_force, forces[k]])
        slip, lift = np.vstack([slip, slips[k]]), np.append(lift, lifts[k])
    order = kept.ordered()
    damage = np.concatenate([np.broadcast_to(history.damage, history.lift.shape)[~gone], hurt])
    return Renewed(
        kept.at(order), History(slip[order], lift[order], damage[order]), all_force[order], int(gone.sum()), len(rows)
    )  # fmt: skip


def _replaced(shapes: Shapes, c: Contacts, near: _Near) -> NDArray[np.bool_]:
    """Points of pairs of blocks for which another corner has come, or that had no joint to begin with."""
    a, b = shapes.face_block[near.face], shapes.face_block[shapes.corner_face[near.corner]]
    n = int(shapes.face_block.max()) + 1
    coming = np.minimum(a, b) * n + np.maximum(a, b)
    return np.isin(np.minimum(c.block_a, c.block_b) * n + np.maximum(c.block_a, c.block_b), coming) | (
        c.interface == NEW
    )


def outside(shapes: Shapes, assembly: Assembly, c: Contacts, pose: Pose) -> Array:
    """How far the corners that are points lie outside the sides of their faces in a pose [m], shape (m,); 0 inside."""
    keyed = c.face >= 0
    beyond = np.zeros(c.count)
    _, inside = _beside(shapes, assembly, pose, c.place_b[keyed], c.block_b[keyed], c.face[keyed], c.block_a[keyed])
    beyond[keyed] = np.maximum(-inside, 0.0)
    return beyond


def _made(
    shapes: Shapes, assembly: Assembly, c: Contacts, pose: Pose, history: History, force: Array,
    gone: NDArray[np.bool_], now_b: Array, near: _Near, row: int, rows: list[Contacts],
) -> tuple[Contacts, Array, Array, float, float] | None:  # fmt: skip
    """A new point with its force, slip, lift and damage; None where a point of the same two blocks is there already."""
    corner, face = int(near.corner[row]), int(near.face[row])
    a, b = int(shapes.face_block[face]), int(shapes.face_block[shapes.corner_face[corner]])
    x = assembly.centroids
    place = shapes.corner_place[corner]
    at = x[b] + pose.shift[b] + place - x[b] + pose.turn[b] @ (place - x[b])
    apart = np.linalg.norm(now_b - at, axis=1)
    same = ((c.block_a == a) & (c.block_b == b)) | ((c.block_a == b) & (c.block_b == a))
    close = 0.5 * shapes.step
    if (same & ~gone & (apart < close)).any() or any(
        {int(r.block_a[0]), int(r.block_b[0])} == {a, b} and np.abs(r.place_b[0] - place).max() < close for r in rows
    ):
        return None
    rotation_a = np.eye(3) + pose.turn[a]
    normal = shapes.normal[face]
    touching = (c.block_a == a) | (c.block_b == a) | (c.block_a == b) | (c.block_b == b)
    heirs = gone & touching & (apart < 6.0 * shapes.step)
    if (heirs & same).any():
        heirs &= same
    model = int(np.where(heirs if heirs.any() else same if same.any() else touching, apart, np.inf).argmin())
    # tangents of the model, turned into the face
    directions = _frame(c, model, pose, rotation_a, normal)
    law, rest, interface = c.law.at(np.array([model])), c.rest.at(np.array([model])), c.interface[[model]]
    damage = float(np.broadcast_to(history.damage, c.area.shape)[model])
    if not same[model]:
        # blocks that had no joint are not bonded, and nothing of their friction is lost
        zero = np.zeros(1)
        law, interface = PointLaw(law.tan_phi, law.tan_psi, zero, zero.copy(), law.crushing), np.array([NEW])
        rest, damage = law, 0.0
    kn, ks, area = float(c.kn[model]), float(c.ks[model]), float(c.area[model])
    opening, slip, lift, components = float(near.gap[row]), np.zeros(c.components - 1), 0.0, np.zeros(c.components)
    if heirs.any():
        old = np.einsum("c,ci->i", force[model], _directions_now(c, model, pose))
        onto = old if (c.block_b[model] == b or c.block_a[model] == a) else -old
        lift = float(history.lift[model])
        if force[model, 0] > 0.0:
            components = (directions @ rotation_a.T) @ onto
            components[0] = force[model, 0]
            size = float(np.linalg.norm(components[1:]))
            held = law.towards(rest, np.array([damage]))
            most = float(held.shear_strength(np.array([components[0] / area]))[0]) * area
            components[1:] *= min(1.0, max(most, 0.0) / max(size, 1e-300))
            opening = lift - components[0] / (kn * area)
            slip = components[1:] / (ks * area)
    elif opening < 0.0:
        # seen late: what it has gone through the face by is not stored as energy that nobody put in
        opening = 0.0
    # the material point of a from which the opening counts and the sliding is nil
    local = rotation_a.T @ (at - x[a] - pose.shift[a]) - opening * normal
    sense = 1.0
    if interface[0] != NEW:
        sense = 1.0 if assembly.interfaces[int(interface[0])].block_b == b else -1.0
    return (
        Contacts(
            np.array([a]), np.array([b]), (x[a] + local)[None], place[None].copy(), directions[None],
            np.array([area]), interface, np.array([sense]), law, np.array([kn]), np.array([ks]), np.array([corner]),
            np.array([face]), rest, c.by_opening[[model]] * same[model],
            c.by_slip[[model]] * same[model],
        ),
        components, slip, lift, damage,
    )  # fmt: skip


def _directions_now(c: Contacts, row: int, pose: Pose) -> Array:
    return c.directions[row] @ (np.eye(3) + pose.turn[c.block_a[row]]).T


def _frame(c: Contacts, row: int, pose: Pose, rotation_a: Array, normal: Array) -> Array:
    """Normal of a face and tangents, in the reference axes of its block, near those of another point."""
    if c.components == 2:
        # as in the reference pose: the tangent is the normal turned in the plane
        old = c.directions[row]
        turn = np.cross(old[0], old[1])
        return np.stack([normal, np.cross(turn, normal)])
    tangent = rotation_a.T @ _directions_now(c, row, pose)[1]
    if abs(tangent @ normal) > 0.9:
        tangent = rotation_a.T @ _directions_now(c, row, pose)[2]
    tangent = tangent - (tangent @ normal) * normal
    tangent = tangent / np.linalg.norm(tangent)
    return np.stack([normal, tangent, np.cross(normal, tangent)])
