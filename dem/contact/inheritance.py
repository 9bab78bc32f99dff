"""What a joint made while blocks move inherits: shear, dilation and damage, and no more energy than there was."""

import numpy as np
from numpy.typing import NDArray

from dem.contact.new_joints import Fresh
from dem.kernels import CROSSING, FACES, LAW, Joints, Points
from dem.model.stable_step import points_of
from dem.model.state import PointForces, State
from dem.model.strain_shapes import relative_deformation
from limitmason.arrays import Array, Flags


def inherit(state: State, now: PointForces, own: Flags, family: Flags, new: Fresh) -> None:
    """Elastic shear displacement, dilation and damage of the nearest old point of the pair, or of its family.

    Parameters
    ----------
    own, family : joints of the same pair, and those on one face that are cut anew with it, shape (k,)
    """
    face = new.contact == FACES and (own | family).any()
    old = np.flatnonzero(own | family if face else own)
    if not len(old):
        return
    mine = points_of(state.joints, old)
    nearest = mine[((new.position[:, None] - now.position[mine][None]) ** 2).sum(axis=2).argmin(axis=1)]
    points, joints = state.points, state.joints
    owner = now.owner[nearest]
    # force on block b of the old joint; the new joint may have swapped a and b
    sign = np.where((joints.block_b[owner] == new.b) | (joints.block_a[owner] == new.a), 1.0, -1.0)
    shear = (now.force[nearest] * sign[:, None]) / points.area[nearest][:, None]
    if new.contact == CROSSING or (state.contact[old] == CROSSING).any():
        # a point and an area: the force is what stays
        along = np.where(joints.block_b[now.owner[mine]] == new.b, 1.0, -1.0)
        shear[:] = (now.force[mine] * along[:, None]).sum(axis=0) / new.area.sum()
    new.lift[:] = 0.0 if new.contact == CROSSING else points.lift[nearest]
    new.damage[:] = np.where(own[owner], points.damage[nearest], 0.0)
    new.slip[:] = np.column_stack([shear @ new.world[0], shear @ new.world[1]]) / new.law[LAW.ks]


def deformed(state: State, new: Fresh) -> Fresh:
    """The joint between the faces as they are deformed now: its shear force stays, its opening is that of the faces."""
    if state.modes is None or state.deformation is None or new.contact == CROSSING:
        return new
    one = Joints(
        np.array([new.a]), np.array([new.b]), np.array([0, len(new.s)]), new.frame[None], new.turn[None],
        new.arm_a[None], new.arm_b[None], new.offset[None], new.law[None], new.edge[None],
        new.limits[None],
    )
    points = Points(new.s, new.t, new.area, new.gap, new.slip[:, 0], new.slip[:, 1], new.lift, new.damage)
    change = relative_deformation(state.deformation, state.modes, one, points)
    new.slip[:] += change[:, :2]
    return new._replace(apart=change[:, 2], aside=change[:, :2])


def keep_energy(
    state: State, now: PointForces, family: NDArray[np.int64], made: list[Fresh], families: list[int]
) -> None:
    """Let the new joints of a family store no more elastic energy than the old ones, of pressure and of shear.

    Cut anew under load, the points lie elsewhere; a pair first seen when it overlaps has none to give. Gaps widen: only
    points that are pressed are set back, and :func:`close_setbacks` takes it back as they open. Shear is let go
    that Coulomb's law does not let the points bear then: a force on next to no area slides at once. It falls in
    proportion where it would still store more.

    Parameters
    ----------
    family, families : numbers of the families of old joints, -1 for those that stay, and of the new ones
    """
    points = state.points
    old = points_of(state.joints, np.flatnonzero(family >= 0))
    law, area, numbers = state.joints.law[now.owner[old]], points.area[old], family[now.owner[old]]
    kn, ks, closing = law[:, LAW.kn], law[:, LAW.ks], np.maximum(-now.opening[old], 0.0)
    shear = (now.force[old] ** 2).sum(axis=1) - (kn * area * np.minimum(closing, law[:, LAW.crushing])) ** 2
    stored = np.stack([0.5 * kn * area * closing**2, 0.5 * np.maximum(shear, 0.0) / (ks * area)])
    groups: dict[int, list[Fresh]] = {}
    for new, number in zip(made, families, strict=True):
        groups.setdefault(number, []).append(new)
    for number, group in groups.items():
        pressure, sheared = stored[:, numbers == number].sum(axis=1).tolist()
        _set_back(group, pressure)
        _let_slide(group, sheared)


def _set_back(group: list[Fresh], allowed: float) -> None:
    """Widen gaps until the pressed points of some joints store no more than an energy [J]."""
    stiff = np.concatenate([0.5 * new.law[LAW.kn] * new.area for new in group])
    deep = np.concatenate([new.lift - new.gap - new.apart for new in group])
    if _stored(stiff, deep) <= allowed * (1.0 + 1e-12):
        return
    low, high = 0.0, float(deep.max())
    while high - low > 1e-12 * float(deep.max()):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _stored(stiff, deep - middle) > allowed else (low, middle)
    for new in group:
        new.setback[:] = np.clip(new.lift - new.gap - new.apart, 0.0, high)
        new.gap[:] += new.setback


def _let_slide(group: list[Fresh], allowed: float) -> None:
    """Let the points of some joints slide until their shear is within Coulomb's law and stores no more than that."""
    elastic, total = [], 0.0
    for new in group:
        pressed = new.law[LAW.kn] * np.maximum(new.lift - new.gap - new.apart, 0.0)
        most = (new.law[LAW.cohesion] + new.law[LAW.tan_phi] * pressed) / new.law[LAW.ks]
        along = new.slip - new.aside
        along *= np.minimum(most / np.maximum(np.linalg.norm(along, axis=1), 1e-300), 1.0)[:, None]
        elastic.append(along)
        total += 0.5 * float(new.law[LAW.ks] * (new.area * (along**2).sum(axis=1)).sum())
    part = np.sqrt(allowed / total) if total > allowed * (1.0 + 1e-12) else 1.0
    for new, along in zip(group, elastic, strict=True):
        new.slip[:] = new.aside + part * along


def close_setbacks(state: State, now: PointForces) -> None:
    """Move points that opened back to where :func:`keep_energy` had set them back from.

    Only points without force are moved, as far as they are open, so that no energy changes.
    """
    if not state.setback.any():
        return
    free = ~now.force.any(axis=1)
    less = np.where(free, np.minimum(state.setback, np.maximum(now.opening, 0.0)), 0.0)
    state.points.gap[:] -= less
    state.setback -= less
    now.opening[:] -= less


def _stored(stiff: Array, deep: Array) -> float:
    return float((stiff * np.maximum(deep, 0.0) ** 2).sum())
