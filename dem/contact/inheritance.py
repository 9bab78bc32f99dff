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

    The shear is no more than Coulomb's law lets the new point bear.

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
    if state.modes is None:
        # a force on next to no area slides at once: what it does not bear must not be stored first
        pressed = new.law[LAW.kn] * np.maximum(new.lift - new.gap - new.apart, 0.0)
        most = (new.law[LAW.cohesion] + new.law[LAW.tan_phi] * pressed) / new.law[LAW.ks]
        new.slip[:] *= np.minimum(most / np.maximum(np.linalg.norm(new.slip, axis=1), 1e-300), 1.0)[:, None]


def deformed(state: State, new: Fresh) -> Fresh:
    """The joint between the faces as they are deformed now: its shear force stays, its opening is that of the faces."""
    if state.modes is None or state.deformation is None or new.contact == CROSSING:
        return new
    one = Joints(
        np.array([new.a]), np.array([new.b]), np.array([0, len(new.s)]), new.frame[None], new.turn[None],
        new.arm_a[None], new.arm_b[None], new.offset[None], new.law[None], new.edge[None],
    )  # fmt: skip
    points = Points(new.s, new.t, new.area, new.gap, new.slip[:, 0], new.slip[:, 1], new.lift, new.damage)
    change = relative_deformation(state.deformation, state.modes, one, points)
    new.slip[:] += change[:, :2]
    return new._replace(apart=change[:, 2])


def keep_energy(
    state: State, now: PointForces, family: NDArray[np.int64], made: list[Fresh], families: list[int]
) -> None:
    """Widen the gaps of the new joints of a family until they store no more normal elastic energy than the old ones.

    Cut anew under load, the points lie elsewhere; a pair first seen when it overlaps has none to give. Only points that
    are pressed are set back, and :func:`close_setbacks` takes it back as they open.

    Parameters
    ----------
    family, families : numbers of the families of old joints, -1 for those that stay, and of the new ones
    """
    points = state.points
    old = points_of(state.joints, np.flatnonzero(family >= 0))
    kn, numbers = state.joints.law[now.owner[old], LAW.kn], family[now.owner[old]]
    stored = 0.5 * kn * points.area[old] * np.maximum(-now.opening[old], 0.0) ** 2
    groups: dict[int, list[Fresh]] = {}
    for new, number in zip(made, families, strict=True):
        groups.setdefault(number, []).append(new)
    for number, group in groups.items():
        allowed = float(stored[numbers == number].sum())
        stiff = np.concatenate([0.5 * new.law[LAW.kn] * new.area for new in group])
        deep = np.concatenate([new.lift - new.gap - new.apart for new in group])
        if _stored(stiff, deep) <= allowed * (1.0 + 1e-12):
            continue
        low, high = 0.0, float(deep.max())
        while high - low > 1e-12 * float(deep.max()):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if _stored(stiff, deep - middle) > allowed else (low, middle)
        for new in group:
            new.setback[:] = np.clip(new.lift - new.gap - new.apart, 0.0, high)
            new.gap[:] += new.setback


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
