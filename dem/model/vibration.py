"""Small vibrations about the state a simulation ended in: the joints that it has left closed."""

from dataclasses import replace
from typing import Any

import numpy as np

from dem.kernels import LAW
from dem.model.joints import law_at
from limitmason.arrays import Array, Index
from limitmason.deformable import simply_deformable_blocks
from limitmason.deformable.levels import RIGID, SIMPLY_DEFORMABLE
from limitmason.errors import NotApplicable
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.plane import find_plane
from limitmason.model import Assembly
from limitmason.vibration.blocks import block_system, state_stiffness
from limitmason.vibration.system import VibratingSystem


def state_system(state: Any, assembly: Assembly, sliding: str) -> VibratingSystem:
    """Blocks on the contact points that a state of the DEM has left closed.

    Points and blocks are in their places before displacement.

    Parameters
    ----------
    state : a ``dem.State``
    assembly : its blocks
    sliding : "sticks" or "drops", see :func:`limitmason.vibration.blocks.state_stiffness`

    Raises
    ------
    NotApplicable
        When contacts were found anew: the reference position is then no longer that of the points.
    """
    now = state.measured(assembly)
    x = assembly.arrays
    k = state.interface[now.owner]
    if (k < 0).any():
        raise NotApplicable(
            "contacts of this state were found anew as blocks moved: small vibrations about it are not worked out; "
            "simulate with detect_every=None to keep the first contacts"
        )
    p = state.points
    sense = state.senses(assembly)[:, None]
    place = x.centre[k] + p.s[:, None] * x.tangent_1[k] + sense * p.t[:, None] * x.tangent_2[k]
    directions = np.stack([x.normal[k], x.tangent_1[k], x.tangent_2[k]], axis=1)
    shapes, plane, kind = None, None, RIGID
    if state.deformation is not None:
        kind, normal = SIMPLY_DEFORMABLE, state.deformation.normal if state.deformation.plane else None
        shapes = simply_deformable_blocks(assembly, state.deformation.state, normal)
        turns = None if normal is None else np.concatenate([np.zeros(3), normal])[None]
        plane = None if normal is None else find_plane(assembly, state.loads, turns)
    points = ContactPoints(
        position=place, interface=k, area=p.area, directions=directions, block_a=x.block_a[k], block_b=x.block_b[k],
    )
    law = state.laws[k]
    # pressure, shear force and shear strength of every point [N]
    carrier = state.joints.block_a[now.owner]
    normal = np.einsum("mi,mi->m", sense * now.force, _turned(state, directions[:, 0], carrier))
    shear = np.sqrt(np.maximum((now.force**2).sum(axis=1) - normal**2, 0.0))
    strength = law_at(law, p.damage, np.hypot(p.slip_1, p.slip_2)).over(p.area)
    limit = np.maximum(strength.shear_strength(normal), 0.0)
    stiffness, found = state_stiffness(
        normal, shear, limit, strength.tension, law[:, LAW.kn], law[:, LAW.ks], sliding
    )
    if plane is not None:
        # in plane one shear direction is left: across the normal of the joint, within the plane
        turned = np.cross(plane.normal, directions[:, 0])
        points = replace(points, directions=np.stack([directions[:, 0], turned], axis=1))
        stiffness = stiffness[:, :2]
    label = f"{'' if kind == RIGID else kind + ' '}blocks at the end of a simulation, {found}"
    return block_system(assembly, points, stiffness, label, (), plane, shapes, kind)


def _turned(state: Any, vectors: Array, block: Index) -> Array:
    """Vectors, shape (m, 3), carried along by the rotation of their blocks.

    ``block`` are these, shape (m,).
    """
    return vectors + np.einsum("mij,mj->mi", state.bodies.rot[block], vectors)
