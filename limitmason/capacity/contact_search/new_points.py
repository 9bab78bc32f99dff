"""A new point of contact: its place, its frame, and what it inherits from the points before it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.contact_search.crossing import edges_of, is_crossing
from limitmason.capacity.contact_search.faces import Shapes
from limitmason.capacity.contact_search.near import Near
from limitmason.capacity.contacts import NEW, PathContacts
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import PlasticHistory
from limitmason.geometry.rotation import vector_product

_HEIR = 6.0
"""Overshoots, beyond the gap, within which a new point inherits from one that has left its face.

It is above the 4 by which the steps of a path let points run off, see ``contact_generations.RUNS_OFF``.
"""

_MOVING = 25.0
"""The same where sides cross, above the 20 of ``contact_generations.MOVES_ON``."""

ONE = 0.5
"""Overshoots within which two places of the same two blocks are one: chosen."""

_NEAREST = 0.1
"""Overshoots that are added to a distance whose inverse is a weight, so that none is infinite: chosen."""

_ALONG = 0.9
"""Cosine between a tangent and the new normal above which the other tangent is taken [-]: chosen."""


class Renewed(NamedTuple):
    """Contacts found anew, m points.

    Parameters
    ----------
    contacts : the points
    history : their plastic state
    force : on them in the pose [N], shape (m, c)
    before : their numbers among the points before, -1 for new ones, shape (m,)
    """

    contacts: PathContacts
    history: PlasticHistory
    force: Array
    before: Index


class NewPoint(NamedTuple):
    """A new point and what it takes over.

    Parameters
    ----------
    contacts : the point
    force : on it, normal first [N], shape (c,)
    slip : plastic slip along its tangents [m], shape (c - 1,)
    lift : opening by dilation [m]
    damage : 0 at peak, 1 at residual strength [-]
    heir_of : number of the old point that it replaces, -1 for none
    """

    contacts: PathContacts
    force: Array
    slip: Array
    lift: float
    damage: float
    heir_of: int


class OldPoints(NamedTuple):
    """Points before contacts are found anew in a pose.

    Parameters
    ----------
    shapes : faces and corners of the blocks
    c : the points
    pose : where the blocks are
    history : plastic state of the points
    force : theirs in that pose [N], shape (m, components)
    now : where they are in that pose [m], shape (m, 3)
    gone : which of them have left their face, shape (m,)
    """

    shapes: Shapes
    c: PathContacts
    pose: Pose
    history: PlasticHistory
    force: Array
    now: Array
    gone: Flags

    @property
    def pair(self) -> Index:
        """Number of the pair of blocks of every point."""
        return self.shapes.pair(self.c.block_a, self.c.block_b)

    def places(self, near: Near) -> Array:
        """Where corners at faces are in that pose [m]."""
        return self.shapes.placed(self.pose, near.owner, near.place)

    def close(self, near: Near) -> Flags:
        """Whether a point, by row, has a corner of ``near``, by column, in its place, shape (m, corners).

        That is one close to it and of the same two blocks, or the same crossing again.
        """
        shapes, crosses = self.shapes, is_crossing(self.shapes, self.c)
        # crossings run along both sides, and so farther than corners
        reach = shapes.step * np.where(crosses, _MOVING, _HEIR)
        near_by = np.linalg.norm(self.now[:, None] - self.places(near), axis=2) < reach[:, None] + np.abs(near.gap)
        same = self.pair[:, None] == number_pairs(shapes, near)
        again = (edges_of(shapes, self.c)[:, None] == edges_of(shapes, near)) & crosses[:, None]
        return np.asarray((near_by & same) | again)

    def succeeded(self, near: Near) -> Flags:
        """Points to which a corner has come close."""
        return np.asarray(self.close(near).any(axis=1))

    def directions(self, row: int) -> Array:
        """Normal and tangents of a point as they are turned in that pose."""
        return self.c.directions[row] @ (np.eye(3) + self.pose.turn[self.c.block_a[row]]).T


def number_pairs(shapes: Shapes, near: Near) -> Index:
    """Number of the pair of blocks of every corner at a face."""
    return shapes.pair(shapes.face_block[near.face], near.owner)


def shares_of(old: OldPoints, near: Near) -> Array:
    """What every row takes over of every point that has gone, by the inverse distance [-], shape (rows, m).

    A crossing that is made again takes all of itself.

    Parameters
    ----------
    old : the m points before, and which of them have gone
    near : rows that become points
    """
    again = (edges_of(old.shapes, near)[:, None] == edges_of(old.shapes, old.c)) & is_crossing(old.shapes, old.c)
    apart = np.linalg.norm(old.now - old.places(near)[:, None], axis=2)
    weight = np.where(old.close(near).T, 1.0 / (apart + _NEAREST * old.shapes.step), 0.0)
    weight = np.where(again.any(axis=0), again, weight) * old.gone
    return np.asarray(weight / np.maximum(weight.sum(axis=0), 1e-300))


def inherited(old: OldPoints, near: Near, row: int, others: list[NewPoint], share: Array | None) -> NewPoint | None:
    """A new point, or None where a point of the same two blocks is there already.

    It has the face's normal. Law, stiffness and tangents are those of the nearest point that it inherits from, or else
    of the nearest of its blocks. In space it takes shares of the area and the force of points that have gone, in plane
    all of one.

    Parameters
    ----------
    old : the m points before, and which of them have gone
    near : corners at faces and crossings
    row : of ``near``, the corner or crossing that becomes a point
    others : points made before it
    share : part of every old point that it takes over [-], shape (m,), in space; None in plane
    """
    shapes, c, pose, gone = old.shapes, old.c, old.pose, old.gone
    face, b, place = int(near.face[row]), int(near.owner[row]), near.place[row]
    a, x = int(shapes.face_block[face]), shapes.assembly.centroids
    # where it is in the pose, and how far from every old point [m]
    at = x[b] + pose.shift[b] + place - x[b] + pose.turn[b] @ (place - x[b])
    apart = np.linalg.norm(old.now - at, axis=1)
    same, close = old.pair == number_pairs(shapes, near.at(np.array([row]))), ONE * shapes.step
    # the place has its point already, or has just been given one
    if (same & ~gone & (apart < close)).any():
        return None
    for made in (other.contacts for other in others):
        if {int(made.block_a[0]), int(made.block_b[0])} == {a, b} and np.abs(made.place_b[0] - place).max() < close:
            return None
    touching = (c.block_a == a) | (c.block_b == a) | (c.block_a == b) | (c.block_b == b)
    # old points that it inherits from: near ones that have gone and have no heir yet, of the same two blocks if any are
    sources = gone & touching & (apart < _HEIR * shapes.step + abs(float(near.gap[row])))
    sources[[other.heir_of for other in others if other.heir_of >= 0]] = False
    if (sources & same).any():
        sources &= same
    if share is not None:
        sources = share > 0.0
    # the nearest of the points it inherits from gives law and tangents; without any, of those between the same blocks
    candidates = touching
    if sources.any():
        candidates = sources
    elif same.any():
        candidates = same
    model = int(np.where(candidates, apart, np.inf).argmin())
    # tangents of the model, turned into the face
    rotation, normal = np.eye(3) + pose.turn[a], shapes.normal[face]
    directions = _frame(old, model, rotation, normal)
    one = c.at(np.array([model]))
    law, rest, interface = one.law, one.rest, one.interface
    damage = float(np.broadcast_to(old.history.damage, c.area.shape)[model])
    if not same[model]:
        # blocks that had no joint are not bonded, and nothing of their friction is lost
        zero = np.zeros(1)
        law, interface = law._replace(cohesion=zero, tension=zero.copy()), np.array([NEW])
        rest, damage = law, 0.0
    elif not sources.any():
        # what meets anew was never bonded
        law, rest = (part._replace(cohesion=np.zeros(1), tension=np.zeros(1)) for part in (law, rest))
    kn, ks, area = float(one.kn[0]), float(one.ks[0]), float(one.area[0])
    taken = np.flatnonzero(sources)
    if share is None:
        taken, share = np.array([model]), np.ones(c.count)
    elif len(taken):
        area = float(share[taken] @ c.area[taken])
    opening, slip, lift, force = float(near.gap[row]), np.zeros(c.components - 1), 0.0, np.zeros(c.components)
    if sources.any():
        lift = float(old.history.lift[model])
        onto, pressed = _taken_over(old, taken, share, a, b)
        if pressed > 0.0:
            force = (directions @ rotation.T) @ onto
            force[0] = pressed
            size = float(np.linalg.norm(force[1:]))
            # no more shear than the strength at this pressure
            held = law.towards(rest, np.array([damage]))
            most = float(held.shear_strength(np.array([force[0] / area]))[0]) * area
            force[1:] *= min(1.0, max(most, 0.0) / max(size, 1e-300))
            # opening and slip at which its springs make that force, where no sliding counts yet
            opening = lift - force[0] / (kn * area)
            slip = force[1:] / (ks * area)
    elif opening < 0.0:
        # seen late: what it has gone through the face by is not stored as energy that nobody put in
        opening = 0.0
    # the material point of a from which the opening counts and the sliding is nil
    local = rotation.T @ (at - x[a] - pose.shift[a]) - opening * normal
    sense = 1.0
    if interface[0] != NEW:
        sense = 1.0 if shapes.assembly.interfaces[int(interface[0])].block_b == b else -1.0
    point = replace(
        one, block_a=np.array([a]), block_b=np.array([b]), place_a=(x[a] + local)[None], place_b=place[None].copy(),
        directions=directions[None], area=np.array([area]), interface=interface, sense=np.array([sense]), law=law,
        rest=rest, corner=near.corner[[row]], face=near.face[[row]], by_opening=one.by_opening * same[model],
        by_slip=one.by_slip * same[model],
    )
    return NewPoint(point, force, slip, lift, damage, heir_of=model if sources.any() else -1)


def _taken_over(old: OldPoints, rows: Index, share: Array, a: int, b: int) -> tuple[Array, float]:
    """Force on block b of what a point between a and b takes over [N], (3,), in space, and its pressure [N].

    Parameters
    ----------
    old : the m points before
    rows : old points, shape (k,)
    share : the part that is taken over of every old point [-], shape (m,)
    a, b : the two blocks
    """
    onto, pressed = np.zeros(3), 0.0
    for g in rows:
        # on block b where b, or a, has the same part in the old point, else on a's side: opposite
        force = share[g] * old.force[g] @ old.directions(int(g))
        onto += force if (old.c.block_b[g] == b or old.c.block_a[g] == a) else -force
        pressed += float(share[g] * old.force[g, 0])
    return onto, pressed


def _frame(old: OldPoints, row: int, rotation: Array, normal: Array) -> Array:
    """Normal and tangents of a new point, near the tangents of the one it replaces.

    They are in the reference axes of the block that carries the frame, shape (c, 3). Slip is kept along them, so that
    they must not swing round.

    Parameters
    ----------
    row : of the old point that gives the tangents
    rotation : of the block that carries the frame, shape (3, 3)
    normal : of its face in the reference pose, shape (3,)
    """
    if old.c.components == 2:
        # as in the reference pose: the tangent is the normal turned in the plane
        first, second = old.c.directions[row]
        return np.stack([normal, vector_product(vector_product(first, second), normal)])
    tangent = rotation.T @ old.directions(row)[1]
    # nearly along the new normal it would give no tangent: the other one does
    if abs(tangent @ normal) > _ALONG:
        tangent = rotation.T @ old.directions(row)[2]
    tangent = tangent - (tangent @ normal) * normal
    tangent = tangent / np.linalg.norm(tangent)
    return np.stack([normal, tangent, vector_product(normal, tangent)])
