"""Contacts found anew while blocks move: corners that leave a face or come to another, and what a new point inherits.

After a step, points whose corner has left its face are dropped and corners that have come inside another face become
points: of two blocks that slide, the end that stood out goes on as the end of the other block that is now inside, with
the force, the slip and the lift of the point that it replaces, so that equilibrium is disturbed by no more than the
overshoot. Corners of blocks that had no joint take an unbonded law.

In space edges that come to cross are not found: a corner that has left its face stays a point unless another corner
takes its place, as do points that are no corners, where edges cross or inside a grid. :func:`outside` says how far.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.contacts import NEW, Contacts
from limitmason.capacity.faces import Near, Shapes, beside, together, turned
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.point_law import History
from limitmason.law import PointLaw
from limitmason.model.assembly import Assembly

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_HEIR = 6.0  # overshoots: distance, beyond the gap, within which a new point inherits from one that has left its face
_WAITS = 4.0  # overshoots beyond a side after which a loaded point without a successor is dropped all the same


class Renewed(NamedTuple):
    """Contacts found anew with their history and forces [N]."""

    contacts: Contacts
    history: History
    force: Array


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
    gap[keyed], inside[keyed] = beside(
        shapes, assembly, pose, c.place_b[keyed], c.block_b[keyed], c.face[keyed], c.block_a[keyed]
    )
    gone = (inside < -shapes.step) | ((c.interface == NEW) & (gap > 2.0 * shapes.near))
    # corners that take over carry on where springs are pressed, however deep
    pressed = float((force[:, 0] / (c.kn * c.area)).max(initial=0.0))
    near = together(shapes, assembly, pose, 0.5 * shapes.step, pressed)
    f = len(shapes.face_block)
    code = near.corner.astype(np.int64) * f + near.face
    present = c.corner.astype(np.int64) * f + c.face
    # the successor of a point that has left is as far inside but for the turn of the blocks over a deep gap
    succeeds = np.isin(_pairs(shapes, near), _pairs_of_points(shapes, c)[gone])
    fresh = ~np.isin(code, present[keyed]) & ~np.isin(code, shapes.strangers) & (succeeds | (near.inside > shapes.step))
    near = Near(near.corner[fresh], near.face[fresh], near.gap[fresh], near.inside[fresh])
    if not (gone.any() or len(near.corner)):
        return None
    x = assembly.centroids
    now_b = x[c.block_b] + pose.shift[c.block_b] + turned(pose, c.block_b, c.place_b - x[c.block_b])
    if c.components == 3:
        gone &= np.isin(_pairs_of_points(shapes, c), _pairs(shapes, near)) | (c.interface == NEW)
    else:
        loaded = (force[:, 0] > 0.0) & (inside > -_WAITS * shapes.step)
        gone &= ~loaded | _succeeded(shapes, assembly, c, pose, near, now_b)
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
    return Renewed(kept.at(order), History(slip[order], lift[order], damage[order]), all_force[order])


def _pairs(shapes: Shapes, near: Near) -> Index:
    """Number of the pair of blocks of every corner at a face."""
    a, b = shapes.face_block[near.face], shapes.face_block[shapes.corner_face[near.corner]]
    return np.asarray(np.minimum(a, b) * (int(shapes.face_block.max()) + 1) + np.maximum(a, b))


def _pairs_of_points(shapes: Shapes, c: Contacts) -> Index:
    """The same of every point."""
    n = int(shapes.face_block.max()) + 1
    return np.asarray(np.minimum(c.block_a, c.block_b) * n + np.maximum(c.block_a, c.block_b))


def _succeeded(
    shapes: Shapes, assembly: Assembly, c: Contacts, pose: Pose, near: Near, now_b: Array
) -> NDArray[np.bool_]:
    """Points for which another corner of the same two blocks has come close by."""
    x = assembly.centroids
    owner = shapes.face_block[shapes.corner_face[near.corner]]
    now = x[owner] + pose.shift[owner] + turned(pose, owner, shapes.corner_place[near.corner] - x[owner])
    close = np.linalg.norm(now_b[:, None] - now, axis=2) < _HEIR * shapes.step + np.abs(near.gap)
    same = _pairs_of_points(shapes, c)[:, None] == _pairs(shapes, near)
    return np.asarray((close & same).any(axis=1))


def outside(shapes: Shapes, assembly: Assembly, c: Contacts, pose: Pose) -> Array:
    """How far the corners that are points lie outside the sides of their faces in a pose [m], shape (m,); 0 inside."""
    keyed = c.face >= 0
    beyond = np.zeros(c.count)
    _, inside = beside(shapes, assembly, pose, c.place_b[keyed], c.block_b[keyed], c.face[keyed], c.block_a[keyed])
    beyond[keyed] = np.maximum(-inside, 0.0)
    return beyond


def _made(
    shapes: Shapes, assembly: Assembly, c: Contacts, pose: Pose, history: History, force: Array,
    gone: NDArray[np.bool_], now_b: Array, near: Near, row: int, rows: list[Contacts],
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
    heirs = gone & touching & (apart < _HEIR * shapes.step + abs(float(near.gap[row])))
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
