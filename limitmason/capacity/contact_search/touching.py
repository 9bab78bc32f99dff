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


import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contact_search.crossing import (
    already_points,
    candidate_contacts,
    edges_of,
    facing_cosine,
    gap_at,
    is_crossing,
    off_crossing,
)
from limitmason.capacity.contact_search.faces import Shapes
from limitmason.capacity.contact_search.near import Near, gap_and_inside
from limitmason.capacity.contact_search.new_points import (
    ONE,
    NewPoint,
    OldPoints,
    Renewed,
    inherited,
    number_pairs,
    shares_of,
)
from limitmason.capacity.contacts import NEW, NO_CORNER, PathContacts
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import PlasticHistory
from limitmason.geometry.rotation import vector_product

_WAITS = 4.0
"""Overshoots beyond a side after which a loaded point without a successor is dropped all the same: chosen."""

_LIFTED = 2.0
"""Near gaps from which a point between blocks that had no joint is dropped: chosen above the one at which it came."""


def found_anew(
    shapes: Shapes, c: PathContacts, pose: Pose, history: PlasticHistory, force: Array, since: Pose
) -> Renewed | None:
    """The contacts of a pose, or None where they are still the same.

    In this order: points that have left their face (``gone``); corners and crossings that have come to one (``near``);
    in space what has left and is not followed is put back at the side; what each new point inherits; all points in the
    order of their blocks.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : points so far
    pose : where the blocks are now
    history : plastic state of the points there
    force : of the points in that pose, normal first, compression positive [N], shape (m, c)
    since : pose in which contacts were last looked for
    """
    gap, inside = _gaps(shapes, c, pose)
    gone = (inside < -shapes.step) | ((c.interface == NEW) & (gap > _LIFTED * shapes.near))
    # how deep the springs are pressed: a corner that takes over lies as far behind its face as they do
    pressed = float((force[:, 0] / (c.kn * c.area)).max(initial=0.0))
    space = c.components == 3
    near = candidate_contacts(shapes, pose, since, pressed, inside=ONE * shapes.step, space=space)
    # the successor of a point that has left is as far inside but for the turn of the blocks over a deep gap
    succeeds = np.isin(number_pairs(shapes, near), shapes.pair(c.block_a, c.block_b)[gone])
    fresh = ~already_points(shapes, c, near) & (succeeds | (near.inside > shapes.step))
    if space:
        # whichever block carries it, on whichever faces, a crossing is one point, made again where it has moved
        crosses, mine, theirs = is_crossing(shapes, near), edges_of(shapes, c), edges_of(shapes, near)
        fresh &= ~(crosses & np.isin(theirs, mine[~gone]))
        fresh |= crosses & np.isin(near.corner, c.corner[gone & is_crossing(shapes, c)])
    old = OldPoints(shapes, c, pose, history, force, shapes.placed(pose, c.block_b, c.place_b), gone)
    near = near.at(fresh)
    # a new corner waits while the point whose place it takes has not left: where that is outside its face already, to
    # become its heir; and where that bears a bond, which a second point beside it would bear again
    waits = (inside < 0.0) | (np.maximum(c.law.cohesion, c.law.tension) > 0.0)
    leaves = ~gone & waits & (c.corner != NO_CORNER) & ~is_crossing(shapes, c)
    near = near.at(~old.close(near)[leaves].any(axis=0))
    if space:
        # where sides stay in line they do not cross, and no corner comes inside: points that bear would have no heir
        lost = gone & (force[:, 0] > 0.0) & ~old.succeeded(near)
        slid = (c.face >= 0) & (c.interface != NEW)
        back = _put_back(shapes, c, pose, slid & (lost | (gone & (c.corner == NO_CORNER))), gap)
        near = near.with_rows(back)
    if not (gone.any() or len(near.corner)):
        return None
    # a corner's successor may come yet; a point inside a face has none
    loaded = (force[:, 0] > 0.0) & (inside > -_WAITS * shapes.step) & (c.corner != NO_CORNER)
    if space:
        near = near.at(_single(old, near))
    gone = gone & (~loaded | old.succeeded(near))
    old = old._replace(gone=gone)
    shares = shares_of(old, near) if space else None
    made: list[NewPoint] = []
    # in plane what has left has one heir: rows in its place, of the same two blocks, come before others
    later = ~old.close(near)[gone].any(axis=0)
    for row in np.lexsort((near.face, near.gap, facing_cosine(shapes, pose, near), later)):
        new = inherited(old, near, int(row), made, None if shares is None else shares[row])
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
    kept, all_force = kept.at(order), all_force[order]
    stress = all_force / kept.area[:, None]
    renewed = PlasticHistory(slip[order], lift[order], damage[order], stress=stress)
    return Renewed(kept, renewed, all_force, before[order])


def _put_back(shapes: Shapes, c: PathContacts, pose: Pose, rows: Flags, gap: Array) -> Near:
    """The nearest place on the sides of its face for every point that has left it.

    It is given as a corner near the face, with the place of its own block that is there now. Points that would come to
    lie beyond the outline of their joint are left out.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : contact points
    pose : where the blocks are
    rows : points that have left, shape (m,)
    gap : of all points above their faces [m], shape (m,)
    """
    i = np.flatnonzero(rows)
    a, b, face = c.block_a[i], c.block_b[i], c.face[i]
    assembly, x = shapes.assembly, shapes.assembly.centroids
    # place of the point seen from block a's centroid, now; ``turn`` is a rotation less one
    arm = c.place_b[i] - x[b]
    apart = x[b] + pose.shift[b] + arm + np.einsum("mij,mj->mi", pose.turn[b], arm) - x[a] - pose.shift[a]
    # where the point of b is now, in the reference pose of a
    local = x[a] + apart + np.einsum("mji,mj->mi", pose.turn[a], apart)
    # how far it is beyond every side, negative, 0 where it is inside
    off = np.minimum(np.einsum("mki,mi->mk", shapes.side[face], local) - shapes.reach[face], 0.0)
    # sides are padded by repetition: each counts once
    differs = np.diff(shapes.side[face], axis=1).any(axis=2)
    once = np.concatenate([np.ones((len(i), 1), bool), differs], axis=1)
    inward = -np.einsum("mk,mki->mi", off * once, shapes.side[face])  # way back to the face, axes of block a [m]
    inward = inward + np.einsum("mij,mj->mi", pose.turn[a], inward)
    place = c.place_b[i] + inward + np.einsum("mji,mj->mi", pose.turn[b], inward)
    joint = [assembly.interfaces[k].polygon for k in c.interface[i]]
    use = np.array([_within(x, y, shapes.step) for x, y in zip(joint, place, strict=True)], dtype=bool)
    none = np.full(int(use.sum()), NO_CORNER, np.intp)
    return Near(
        corner=none, face=face[use], gap=gap[i][use], inside=np.zeros(len(none)), owner=b[use], place=place[use],
    )


def _within(polygon: Array, point: Array, slack: float) -> bool:
    """Whether a point in the plane of a convex polygon lies inside, or outside by no more than ``slack`` [m].

    Parameters
    ----------
    polygon : corners, either way round [m], shape (k, 3)
    point : place [m], shape (3,)
    """
    edge, arm = np.roll(polygon, -1, axis=0) - polygon, point - polygon
    # twice the areas of the triangles on every edge with the point, along the normal where that is inside of the edge
    turns = vector_product(edge, arm)
    total = turns.sum(axis=0)
    inside = (turns @ total) / (np.linalg.norm(total) * np.linalg.norm(edge, axis=1))
    return bool((inside >= -slack).all())


def landed(shapes: Shapes, c: PathContacts, before: Pose, now: Pose, travel: float) -> tuple[Array, Array]:
    """Gaps before and now of corners and crossings that landed in a face unseen [m].

    They have no point, were open, and now lie behind the face by more than an overshoot.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : points that are there
    before, now : poses at the two ends of a step
    travel : the farthest that a point of a block moved between both poses [m]

    Returns
    -------
    before, now : gaps [m], shape (k,) each
    """
    near = candidate_contacts(shapes, now, before, 2.0 * travel, inside=shapes.step, space=c.components == 3)
    gap = gap_at(shapes, near, before)
    again = is_crossing(shapes, near) & np.isin(edges_of(shapes, near), edges_of(shapes, c))
    present = already_points(shapes, c, near) | again
    late = ~present & (gap > 0.0) & (near.gap < -shapes.step)
    return gap[late], near.gap[late]


def _single(old: OldPoints, near: Near) -> Index:
    """Rows of corners and crossings at which no point of the same two blocks stays and no other row lies.

    Where faces meet at an edge the same place is a contact on either. It is one point: a corner goes before a crossing,
    a crossing before what is neither, and of equals that on the faces that look at each other most.

    Parameters
    ----------
    old : points before, and which of them have gone
    near : corners and crossings that may become points

    Returns
    -------
    ndarray
        Numbers of the rows of ``near`` that are kept, ascending.
    """
    rows: list[int] = []
    pair, now, close = number_pairs(old.shapes, near), old.places(near), ONE * old.shapes.step
    kind = np.where(near.corner == NO_CORNER, 2, is_crossing(old.shapes, near))  # 0 a corner, 1 a crossing, 2 neither
    for k in np.lexsort((near.corner, facing_cosine(old.shapes, old.pose, near), kind)):
        here = (old.pair == pair[k]) & ~old.gone & (np.linalg.norm(old.now - now[k], axis=1) < close)
        if not here.any() and all(pair[r] != pair[k] or np.linalg.norm(now[r] - now[k]) > close for r in rows):
            rows.append(int(k))
    return np.array(sorted(rows), np.intp)


def outside(shapes: Shapes, c: PathContacts, pose: Pose) -> Array:
    """How far the corners that are points lie outside the sides of their faces in a pose [m], (m,), 0 inside."""
    inside = beside_faces(shapes, c, pose)
    return np.asarray(np.where(inside < np.inf, np.maximum(-inside, 0.0), 0.0))


def beside_faces(shapes: Shapes, c: PathContacts, pose: Pose) -> Array:
    """How far points lie inside the sides of their faces in a pose [m], shape (m,).

    It is infinite for those without a face.

    A point where sides cross counts as outside by what it lies off that place.
    """
    return _gaps(shapes, c, pose)[1]


def _gaps(shapes: Shapes, c: PathContacts, pose: Pose) -> tuple[Array, Array]:
    """Gap of all points above their faces [m], and how far inside these they lie [m].

    Both have shape (m,). Points without a face count as inside without end.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : contact points
    pose : where the blocks are
    """
    keyed = c.face >= 0
    gap, inside = np.zeros(c.count), np.full(c.count, np.inf)
    gap[keyed], inside[keyed] = gap_and_inside(shapes, pose, c.place_b[keyed], c.block_b[keyed], c.face[keyed])
    rows = np.flatnonzero(is_crossing(shapes, c)) if c.components == 3 else np.zeros(0, np.intp)
    if len(rows):
        inside[rows] = -off_crossing(shapes, c, rows, pose)
    return gap, inside
