"""Faces of blocks and the interfaces on them: gap and angle of every contact, and the faces that touch nothing."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags
from limitmason.constants import RELATIVE_TOLERANCE
from limitmason.geometry.facing import Faces, all_faces, faces_under
from limitmason.geometry.polygon import width_in_space
from limitmason.geometry.splitting import outer_faces
from limitmason.model.blockwork import Blockwork
from limitmason.model.detection import BlockPieces


class UntouchedFace(NamedTuple):
    """A face that touches nothing.

    Parameters
    ----------
    block : its name
    normal : outward unit normal, shape (3,)
    place : mean of its corners [m], shape (3,)
    corners : counter-clockwise seen from outside [m], shape (n, 3)
    """

    block: str
    normal: Array
    place: Array
    corners: Array


def contact_gaps(assembly: Blockwork, pieces: BlockPieces) -> tuple[Array, Array]:
    """Gap and angle between the two faces of every interface.

    The faces are looked up in the geometry.

    Parameters
    ----------
    assembly : with k interfaces
    pieces : convex pieces of its blocks

    Returns
    -------
    gaps : least and largest over the interface, negative where the faces overlap [m], shape (k, 2)
    angles : between the faces [deg], shape (k,)
        Both NaN where an interface lies on no face of one of its blocks.
    """
    faces, start = all_faces(pieces.solids)
    # row of every block's first face, and the number of all faces
    first = start[np.searchsorted(pieces.owner, np.arange(len(pieces.widths) + 1))]
    gaps, angles = np.full((len(assembly.interfaces), 2), np.nan), np.full(len(assembly.interfaces), np.nan)
    for k, i in enumerate(assembly.interfaces):
        under = [
            faces_under(faces, slice(first[block], first[block + 1]), i.polygon, n)
            for block, n in ((i.block_a, i.normal), (i.block_b, -i.normal))
        ]
        if not all(map(len, under)):
            continue
        f, g = (int(rows[0]) for rows in under)
        # the gap is the sum of the heights of a corner over both faces, each along its outward normal
        gap = (i.polygon @ faces.normal[f] - faces.offset[f]) + (i.polygon @ faces.normal[g] - faces.offset[g])
        gaps[k] = gap.min(), gap.max()
        n, m = faces.normal[f], faces.normal[g]
        # between n and -m, without loss of digits at small angles
        angles[k] = np.degrees(2.0 * np.arctan2(np.linalg.norm(n + m), np.linalg.norm(n - m)))
    return gaps, angles


def untouched_faces(assembly: Blockwork, widths: Array) -> tuple[list[UntouchedFace], int]:
    """Outer faces on which no interface lies, and the number of all outer faces.

    Parameters
    ----------
    assembly : with its interfaces
    widths : least width of every block [m], shape (n_blocks,)
    """
    faces, touched = outer_faces_touched(assembly)
    # pieces of a block that are drawn out of line by less than a contact is wide have no faces there
    several = np.array([len(b.parts) > 1 for b in assembly.blocks])
    slack = np.where(several, RELATIVE_TOLERANCE * widths, 0.0)[faces.part]
    counts = np.array([width_in_space(c[:n]) for c, n in zip(faces.corners, faces.corners_of, strict=True)]) >= slack
    out = []
    for k in np.flatnonzero(counts & ~touched).tolist():
        corners = faces.corners[k, : faces.corners_of[k]]
        out.append(UntouchedFace(
            assembly.blocks[faces.part[k]].name, faces.normal[k], corners.mean(axis=0), corners,
        ))
    return out, int(counts.sum())


def outer_faces_touched(assembly: Blockwork) -> tuple[Faces, Flags]:
    """Outer faces of all blocks, ``part`` being the block of each, and whether an interface lies on each.

    One that an interface covers in part counts as touched.
    """
    polygons = [outer_faces_of(assembly, k) for k in range(assembly.n_blocks)]
    count = [len(p) for p in polygons]
    faces = Faces.of([face for p in polygons for face in p], np.repeat(np.arange(len(count)), count))
    touched, first = np.zeros(len(faces.part), dtype=bool), np.concatenate([[0], np.cumsum(count)])
    for i in assembly.interfaces:
        for block, normal in ((i.block_a, i.normal), (i.block_b, -i.normal)):
            touched[faces_under(faces, slice(first[block], first[block + 1]), i.polygon, normal)] = True
    return faces, touched


def outer_faces_of(assembly: Blockwork, block: int) -> Sequence[Array]:
    """Corners of what is seen of the faces of a block, by its number [m], shape (k, 3) each.

    Pieces of it touch within the distance of contacts, where one was given.
    """
    b, distance = assembly.blocks[block], assembly.contact_rules.distance
    return b.outer_faces if distance is None else outer_faces(b.parts, distance)


def least_width(polygon: Array, normal: Array) -> float:
    """Smallest distance between two parallel lines that hold a convex polygon [m].

    Parameters
    ----------
    polygon : corners [m], shape (n, 3)
    normal : unit normal of its plane, shape (3,)
    """
    edge = np.roll(polygon, -1, axis=0) - polygon
    length = np.linalg.norm(edge, axis=1)
    edge = edge[length > 0.0] / length[length > 0.0, None]
    return float(np.ptp(polygon @ np.cross(normal, edge).T, axis=0).min())
