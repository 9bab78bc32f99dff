"""Contacts found anew while blocks move: corners that leave a face or come to another, and what a new point inherits.

After a step, points whose corner has left its face are dropped and corners that have come inside another face become
points: of two blocks that slide, the end that stood out goes on as the end of the other block that is now inside, with
the force, the slip and the lift of the point that it replaces, so that equilibrium is disturbed by no more than the
overshoot. Corners of blocks that had no joint take an unbonded law.

In space places where sides of two faces cross are corners of their overlap too, see
:mod:`limitmason.capacity.contact_search.crossing`; several new points share the force and the area of one that has
left, by distance. Points inside a face stay with the block that carries them until they have left it; in space they
then go on at its side, and so does a loaded corner that nothing follows. None are added.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contact_search.crossing import candidate_contacts, gap_at, is_crossing, known, off
from limitmason.capacity.contact_search.faces import Near, Shapes, beside
from limitmason.capacity.contacts import NEW, NO_CORNER, PathContacts
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import PlasticHistory

_HEIR = 6.0  # overshoots: distance, beyond the gap, within which a new point inherits from one that has left its face
_MOVING = 25.0  # the same where sides cross, which move on by up to a step's length before they are looked at
_WAITS = 4.0  # overshoots beyond a side after which a loaded point without a successor is dropped all the same


class Renewed(NamedTuple):
    """Contacts found anew with their history, forces [N] and numbers among the points before, -1 for new ones."""

    contacts: PathContacts
    history: PlasticHistory
    force: Array
    before: Index


class NewPoint(NamedTuple):
    """A new point, its force [N], slip and lift [m], damage [-], and whose heir it is in plane, -1 for none."""

    contacts: PathContacts
    force: Array
    slip: Array
    lift: float
    damage: float
    heir_of: int


def found_anew(
    shapes: Shapes, c: PathContacts, pose: Pose, history: PlasticHistory, force: Array, since: Pose
) -> Renewed | None:
    """The contacts of a pose, or None where they are still the same.

    Parameters
    ----------
    force : of the points in that pose [N], shape (m, c)
    since : pose in which contacts were last looked for
    """
    gap, inside = _gaps(shapes, c, pose)
    gone = (inside < -shapes.step) | ((c.interface == NEW) & (gap > 2.0 * shapes.near))
    # corners that take over carry on where springs are pressed, however deep
    pressed = float((force[:, 0] / (c.kn * c.area)).max(initial=0.0))
    space = c.components == 3
    near = candidate_contacts(shapes, pose, since, pressed, inside=0.5 * shapes.step, space=space)
    # the successor of a point that has left is as far inside but for the turn of the blocks over a deep gap
    succeeds = np.isin(_pairs(shapes, near), shapes.pair(c.block_a, c.block_b)[gone])
    fresh = ~known(shapes, c, near) & (succeeds | (near.inside > shapes.step))
    if space:
        # whichever block carries it, a crossing is one point, which is made again where it has moved
        crosses = is_crossing(shapes, near)
        fresh &= ~(crosses & np.isin(near.corner, c.corner[~gone]))
        fresh |= crosses & np.isin(near.corner, c.corner[gone & is_crossing(shapes, c)])
    now_b = shapes.placed(pose, c.block_b, c.place_b)
    near = near.at(fresh)
    # over a deep gap a corner may be inside before the one whose place it takes has left: it waits, to be its heir
    leaves = ~gone & (inside < 0.0) & (c.corner != NO_CORNER) & ~is_crossing(shapes, c)
    waits = _close(shapes, c.at(leaves), near, now_b[leaves], _present(shapes, pose, near)).any(axis=0)
    near = near.at(np.flatnonzero(~waits))
    if space:
        # where sides stay in line they do not cross, and no corner comes inside
        lost = gone & (force[:, 0] > 0.0) & ~_succeeded(shapes, c, near, now_b, _present(shapes, pose, near))
        slid = (c.face >= 0) & (c.interface != NEW)
        back = _put_back(shapes, c, pose, slid & (lost | (gone & (c.corner == NO_CORNER))), gap)
        near = near.with_rows(back)
    if not (gone.any() or len(near.corner)):
        return None
    loaded = (force[:, 0] > 0.0) & (inside > -_WAITS * shapes.step)
    if space:
        near = near.at(_single(shapes, c, gone, now_b, near, _present(shapes, pose, near)))
    gone &= ~loaded | _succeeded(shapes, c, near, now_b, _present(shapes, pose, near))
    shares = _shares(shapes, c, gone, now_b, near, _present(shapes, pose, near)) if space else None
    made: list[NewPoint] = []
    # in plane what has left has one heir, of the same two blocks before others
    later = ~_close(shapes, c, near, now_b, _present(shapes, pose, near))[gone].any(axis=0)
    for row in np.lexsort((near.gap, near.face, later)):
        share = None if shares is None else shares[row]
        new = _made(shapes, c, pose, history, force, gone, now_b, near, int(row), made, share)
        made += [] if new is None else [new]
    if not (gone.any() or made):
        return None
    kept = c.at(~gone)
    for new in made:
        kept = kept.with_rows(new.contacts)
    all_force = np.vstack([force[~gone], *(new.force for new in made)])
    slip = np.vstack([history.slip[~gone], *(new.slip for new in made)])
    lift = np.append(history.lift[~gone], [new.lift for new in made])
    order = kept.ordered()
    damage = np.append(np.broadcast_to(history.damage, history.lift.shape)[~gone], [new.damage for new in made])
    before = np.concatenate([np.flatnonzero(~gone), np.full(len(made), -1, np.intp)])
    return Renewed(
        kept.at(order), PlasticHistory(slip[order], lift[order], damage[order]), all_force[order], before[order]
    )


def _put_back(shapes: Shapes, c: PathContacts, pose: Pose, rows: Flags, gap: Array) -> Near:
    """Points that have left their face, on its sides: at the places of their block that are there now.

    What its block no longer reaches of the joint is left out.
    """
    i = np.flatnonzero(rows)
    a, b, face = c.block_a[i], c.block_b[i], c.face[i]
    assembly, x = shapes.assembly, shapes.assembly.centroids
    arm = c.place_b[i] - x[b]
    apart = x[b] + pose.shift[b] + arm + np.einsum("mij,mj->mi", pose.turn[b], arm) - x[a] - pose.shift[a]
    local = x[a] + apart + np.einsum("mji,mj->mi", pose.turn[a], apart)
    off = np.minimum(np.einsum("mki,mi->mk", shapes.side[face], local) - shapes.reach[face], 0.0)
    # sides are padded by repetition: each counts once
    turns = np.diff(shapes.side[face], axis=1).any(axis=2)
    new = np.concatenate([np.ones((len(i), 1), bool), turns], axis=1)
    inward = -np.einsum("mk,mki->mi", off * new, shapes.side[face])
    inward = inward + np.einsum("mij,mj->mi", pose.turn[a], inward)
    place = c.place_b[i] + inward + np.einsum("mji,mj->mi", pose.turn[b], inward)
    joint = [assembly.interfaces[k].polygon for k in c.interface[i]]
    use = np.array([_within(x, y, shapes.step) for x, y in zip(joint, place, strict=True)], dtype=bool)
    none = np.full(int(use.sum()), NO_CORNER, np.intp)
    return Near(none, face[use], gap[i][use], np.zeros(len(none)), b[use], place[use])


def _within(polygon: Array, point: Array, slack: float) -> bool:
    """Whether a point in the plane of a convex polygon lies inside, or outside by no more than a length [m]."""
    edge, arm = np.roll(polygon, -1, axis=0) - polygon, point - polygon
    turns = np.cross(edge, arm)
    total = turns.sum(axis=0)
    inside = (turns @ total) / (np.linalg.norm(total) * np.linalg.norm(edge, axis=1))
    return bool((inside >= -slack).all())


def landed(shapes: Shapes, c: PathContacts, before: Pose, now: Pose, travel: float) -> tuple[Array, Array]:
    """Gaps before and now of what has no point, was open and lies in a face by more than an overshoot [m].

    Parameters
    ----------
    travel : the farthest that a point of a block moved between both poses [m]
    """
    near = candidate_contacts(shapes, now, before, 2.0 * travel, inside=shapes.step, space=c.components == 3)
    gap = gap_at(shapes, near, before)
    present = known(shapes, c, near) | (is_crossing(shapes, near) & np.isin(near.corner, c.corner))
    late = ~present & (gap > 0.0) & (near.gap < -shapes.step)
    return gap[late], near.gap[late]


def _pairs(shapes: Shapes, near: Near) -> Index:
    """Number of the pair of blocks of every corner at a face."""
    return shapes.pair(shapes.face_block[near.face], near.owner)


def _present(shapes: Shapes, pose: Pose, near: Near) -> Array:
    """Where corners at faces are in a pose [m]."""
    return shapes.placed(pose, near.owner, near.place)


def _succeeded(shapes: Shapes, c: PathContacts, near: Near, now_b: Array, now: Array) -> Flags:
    """Points for which another corner of the same two blocks has come close by."""
    return np.asarray(_close(shapes, c, near, now_b, now).any(axis=1))


def _close(shapes: Shapes, c: PathContacts, near: Near, now_b: Array, now: Array) -> Flags:
    reach = shapes.step * np.where(is_crossing(shapes, c), _MOVING, _HEIR)
    close = np.linalg.norm(now_b[:, None] - now, axis=2) < reach[:, None] + np.abs(near.gap)
    same = shapes.pair(c.block_a, c.block_b)[:, None] == _pairs(shapes, near)
    again = (c.corner[:, None] == near.corner) & is_crossing(shapes, c)[:, None]
    return np.asarray((close & same) | again)


def _single(shapes: Shapes, c: PathContacts, gone: Flags, now_b: Array, near: Near, now: Array) -> Index:
    """Rows of corners and crossings at which no point of the same two blocks stays and no other row lies."""
    rows: list[int] = []
    pair, of = _pairs(shapes, near), shapes.pair(c.block_a, c.block_b)
    last = near.corner.max(initial=0) + 1
    for k in np.argsort(np.where(near.corner == NO_CORNER, last, near.corner), kind="stable"):  # corners first
        here = (of == pair[k]) & ~gone & (np.linalg.norm(now_b - now[k], axis=1) < 0.5 * shapes.step)
        if not here.any() and all(
            pair[r] != pair[k] or np.linalg.norm(now[r] - now[k]) > 0.5 * shapes.step for r in rows
        ):
            rows.append(int(k))
    return np.array(sorted(rows), np.intp)


def _shares(shapes: Shapes, c: PathContacts, gone: Flags, now_b: Array, near: Near, now: Array) -> Array:
    """What every row takes over of every point that has gone, shape (rows, m): by the inverse distance.

    A crossing that is made again takes all of itself.
    """
    again = (near.corner[:, None] == c.corner) & is_crossing(shapes, c)
    apart = np.linalg.norm(now_b - now[:, None], axis=2)
    weight = np.where(_close(shapes, c, near, now_b, now).T, 1.0 / (apart + 0.1 * shapes.step), 0.0)
    weight = np.where(again.any(axis=0), again, weight) * gone
    return np.asarray(weight / np.maximum(weight.sum(axis=0), 1e-300))


def outside(shapes: Shapes, c: PathContacts, pose: Pose) -> Array:
    """How far the corners that are points lie outside the sides of their faces in a pose [m], shape (m,).

    It is 0 inside.
    """
    inside = beside_faces(shapes, c, pose)
    return np.asarray(np.where(inside < np.inf, np.maximum(-inside, 0.0), 0.0))


def beside_faces(shapes: Shapes, c: PathContacts, pose: Pose) -> Array:
    """How far points lie inside the sides of their faces in a pose [m], shape (m,).

    It is infinite for those without a face.

    A point where sides cross counts as outside by what it lies off that place.
    """
    return _gaps(shapes, c, pose)[1]


def _gaps(shapes: Shapes, c: PathContacts, pose: Pose) -> tuple[Array, Array]:
    """Gap above their faces, and :func:`beside_faces`."""
    keyed = c.face >= 0
    gap, inside = np.zeros(c.count), np.full(c.count, np.inf)
    gap[keyed], inside[keyed] = beside(shapes, pose, c.place_b[keyed], c.block_b[keyed], c.face[keyed])
    rows = np.flatnonzero(is_crossing(shapes, c)) if c.components == 3 else np.zeros(0, np.intp)
    if len(rows):
        inside[rows] = -off(shapes, c, rows, pose)
    return gap, inside


def _made(
    shapes: Shapes, c: PathContacts, pose: Pose, history: PlasticHistory, force: Array,
    gone: Flags, now_b: Array, near: Near, row: int, others: list[NewPoint],
    share: Array | None,
) -> NewPoint | None:  # fmt: skip
    """A new point, or None where a point of the same two blocks is there already.

    Parameters
    ----------
    share : what it takes over of every point, in space, shape (m,); in plane it takes all of the nearest
    """
    corner, face = int(near.corner[row]), int(near.face[row])
    a, b = int(shapes.face_block[face]), int(near.owner[row])
    assembly, x = shapes.assembly, shapes.assembly.centroids
    place = near.place[row]
    at = x[b] + pose.shift[b] + place - x[b] + pose.turn[b] @ (place - x[b])
    apart = np.linalg.norm(now_b - at, axis=1)
    same = ((c.block_a == a) & (c.block_b == b)) | ((c.block_a == b) & (c.block_b == a))
    close = 0.5 * shapes.step
    if (same & ~gone & (apart < close)).any() or any(
        {int(r.block_a[0]), int(r.block_b[0])} == {a, b} and np.abs(r.place_b[0] - place).max() < close
        for r, *_ in others
    ):
        return None
    rotation_a = np.eye(3) + pose.turn[a]
    normal = shapes.normal[face]
    touching = (c.block_a == a) | (c.block_b == a) | (c.block_a == b) | (c.block_b == b)
    heirs = gone & touching & (apart < _HEIR * shapes.step + abs(float(near.gap[row])))
    heirs[[other.heir_of for other in others if other.heir_of >= 0]] = False
    if (heirs & same).any():
        heirs &= same
    if share is not None:
        heirs = share > 0.0
    model = int(np.where(heirs if heirs.any() else same if same.any() else touching, apart, np.inf).argmin())
    # tangents of the model, turned into the face
    directions = _frame(c, model, pose, rotation_a, normal)
    law, rest, interface = c.law.at(np.array([model])), c.rest.at(np.array([model])), c.interface[[model]]
    damage = float(np.broadcast_to(history.damage, c.area.shape)[model])
    if not same[model]:
        # blocks that had no joint are not bonded, and nothing of their friction is lost
        zero = np.zeros(1)
        law, interface = law._replace(cohesion=zero, tension=zero.copy()), np.array([NEW])
        rest, damage = law, 0.0
    kn, ks, area = float(c.kn[model]), float(c.ks[model]), float(c.area[model])
    taken = np.flatnonzero(heirs)
    if share is None:
        taken, share = np.array([model]), np.ones(c.count)
    elif len(taken):
        area = float(share[taken] @ c.area[taken])
    opening, slip, lift, components = float(near.gap[row]), np.zeros(c.components - 1), 0.0, np.zeros(c.components)
    if heirs.any():
        onto, normal_force = np.zeros(3), 0.0
        for g in taken:
            old = share[g] * force[g] @ _directions_now(c, int(g), pose)
            onto += old if (c.block_b[g] == b or c.block_a[g] == a) else -old
            normal_force += float(share[g] * force[g, 0])
        lift = float(history.lift[model])
        if normal_force > 0.0:
            components = (directions @ rotation_a.T) @ onto
            components[0] = normal_force
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
    return NewPoint(
        PathContacts(
            np.array([a]), np.array([b]), (x[a] + local)[None], place[None].copy(), directions[None],
            np.array([area]), interface, np.array([sense]), law, np.array([kn]), np.array([ks]), np.array([corner]),
            np.array([face]), rest, c.by_opening[[model]] * same[model],
            c.by_slip[[model]] * same[model],
        ),
        components, slip, lift, damage, model if heirs.any() else -1,
    )  # fmt: skip


def _directions_now(c: PathContacts, row: int, pose: Pose) -> Array:
    return c.directions[row] @ (np.eye(3) + pose.turn[c.block_a[row]]).T


def _frame(c: PathContacts, row: int, pose: Pose, rotation_a: Array, normal: Array) -> Array:
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
