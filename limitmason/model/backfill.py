"""Fill over vaults and arches as a load: the weight of the column above every face that looks up and is bare."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from limitmason.checks import finite, not_negative, positive
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import face_plane
from limitmason.geometry.splitting import split_polygon
from limitmason.model.applied_forces import AppliedForces
from limitmason.model.face_touch import outer_faces_of
from limitmason.model.input import read_fixed

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly


_UP = 1e-6
"""Least upward part of the unit normal of a loaded face, least level part of an inclined one, far above rounding."""

_COVERED = 1e-6
"""Part of the fill over all faces up to which what joints leave of it is rounding [-]: chosen."""


def backfill_forces(
    assembly: "Assembly", level: float, density: float, *, lateral: float = 0.0,
    blocks: Iterable[int | str] | None = None,
) -> AppliedForces:
    """Forces of a fill that reaches up to a level, on the blocks it lies on.

    The traction on a face with outward unit normal n at height z is -rho g (level - z) (K nx, K ny, nz), integrated
    exactly over the part of the face that lies below the level, less what joints cover.

    Parameters
    ----------
    assembly : that carries the fill
    level : of the top of the fill [m]
    density : of the fill [kg/m3]
    lateral : K, horizontal over vertical stress in the fill; 0 for weight alone. It acts on inclined faces: fill lies
        over blocks, and which side of a vertical face it is on is not known
    blocks : names or numbers; all free blocks where omitted

    Raises
    ------
    InputError
        When the fill reaches no face, a number is not positive, or the loaded faces are level and leave lateral without
        effect.

    Notes
    -----
    Fill has weight here and no strength: it neither spreads a load nor resists a mechanism that lifts it, so that the
    multiplier is low where real fill is stiff or braces the haunches. Faces below a roof are loaded too: name blocks.
    """
    top, k = finite("level", level), not_negative("lateral", lateral)
    rho = positive("density of the fill", density, "kg/m3")
    free = [i for i in range(assembly.n_blocks) if not assembly.fixed[i]]
    # a block that is named twice carries its fill once
    named = free if blocks is None else map(assembly.block_index, read_fixed(blocks, "blocks"))
    loaded = dict.fromkeys(named)
    # what the fill lies on: sign, number of the block, polygon and outward normal. The parts of faces that joints cover
    # carry no fill: they count with the opposite sign
    surfaces = [(1.0, i, face, face_plane(face)[0]) for i in loaded for face in outer_faces_of(assembly, i)]
    for joint in assembly.interfaces:
        for block, sense in ((joint.block_a, 1.0), (joint.block_b, -1.0)):
            if block in loaded:
                surfaces.append((-1.0, block, joint.polygon, sense * joint.normal))
    forces, inclined = AppliedForces.none(assembly), False
    on_faces = 0.0  # weight of the fill over all faces, covered or not [N]
    for sign, i, polygon, normal in surfaces:
        if normal[2] <= _UP:
            continue
        below, _ = split_polygon(polygon, np.array([0.0, 0.0, top]), np.array([0.0, 0.0, 1.0]), slack=0.0)
        if below is None:  # the whole face is above the fill
            continue
        inclined = inclined or bool(np.hypot(normal[0], normal[1]) > _UP)
        traction = -sign * rho * GRAVITY * np.array([k * normal[0], k * normal[1], normal[2]])
        before = forces.force[i, 2]
        # a joint's polygon may run either way round: its own normal makes its area positive
        forces.add_spread(i, below, face_plane(polygon)[0], top - below[:, 2], traction)
        on_faces += max(before - forces.force[i, 2], 0.0)
    if not -forces.force[:, 2].sum() > _COVERED * on_faces:
        which = "the free blocks" if blocks is None else "these blocks"
        raise InputError(f"fill up to {top:g} m lies on no face of {which}: its top is below them, or they are covered")
    if k and not inclined:
        raise InputError(
            "lateral: every face that the fill lies on is level, and vertical ones take no fill: give the thrust on a "
            "wall by Loads.with_pressure, block by block"
        )
    return forces
