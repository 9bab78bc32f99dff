"""Faces of blocks and the interfaces on them: gap and angle of every contact, and the faces that touch nothing."""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.geometry.facing import Faces, all_faces
from limitmason.geometry.polygon import area_in_space
from limitmason.model.blockwork import Blockwork
from limitmason.model.detection import BlockPieces, contacts_within

_LOOKS_THE_SAME_WAY = 0.7  # cosine of about 45 degrees between outward normals, chosen
_FARTHEST = 0.5  # of a polygon's size, chosen: a face farther from its plane is not the one that it lies on
_ALIGNMENT_COUNTS = 1e-6  # of a polygon's size, chosen: so little that alignment decides between equal distances alone
_MOSTLY = 0.99  # of a face's area, chosen: a face covered by more of cuts is a cut, rounding of corners aside


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
    first = _first_faces(pieces, start)
    gaps, angles = np.full((len(assembly.interfaces), 2), np.nan), np.full(len(assembly.interfaces), np.nan)
    for k, i in enumerate(assembly.interfaces):
        f = _face_under(faces, slice(first[i.block_a], first[i.block_a + 1]), i.polygon, i.normal)
        g = _face_under(faces, slice(first[i.block_b], first[i.block_b + 1]), i.polygon, -i.normal)
        if f is None or g is None:
            continue
        # the gap is the sum of the heights of a corner over both faces, each along its outward normal
        gap = (i.polygon @ faces.normal[f] - faces.offset[f]) + (i.polygon @ faces.normal[g] - faces.offset[g])
        gaps[k] = gap.min(), gap.max()
        n, m = faces.normal[f], faces.normal[g]
        # between n and -m, without loss of digits at small angles
        angles[k] = np.degrees(2.0 * np.arctan2(np.linalg.norm(n + m), np.linalg.norm(n - m)))
    return gaps, angles


def untouched_faces(assembly: Blockwork, pieces: BlockPieces) -> tuple[list[UntouchedFace], int]:
    """Faces on which no interface lies, and the number of all faces.

    Cuts between pieces of a block are no faces.

    Parameters
    ----------
    assembly : with its interfaces
    pieces : convex pieces of its blocks
    """
    faces, start = all_faces(pieces.solids)
    first = _first_faces(pieces, start)
    inner = _inner_faces(assembly, pieces, faces, start)
    touched = inner.copy()
    for i in assembly.interfaces:
        for block, normal in ((i.block_a, i.normal), (i.block_b, -i.normal)):
            face = _face_under(faces, slice(first[block], first[block + 1]), i.polygon, normal)
            if face is not None:
                touched[face] = True
    out = []
    for k in np.flatnonzero(~touched).tolist():
        corners = faces.corners[k, : faces.corners_of[k]]
        name = assembly.blocks[int(pieces.owner[faces.part[k]])].name
        out.append(UntouchedFace(name, faces.normal[k], corners.mean(axis=0), corners))
    return out, int((~inner).sum())


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


def _first_faces(pieces: BlockPieces, start: Index) -> Index:
    """Row of every block's first face, shape (n_blocks + 1,).

    The last entry is the number of all faces.

    Parameters
    ----------
    pieces : in the order of the blocks
    start : row of the first face of every piece, with the total at the end, shape (pieces + 1,)
    """
    return start[np.searchsorted(pieces.owner, np.arange(len(pieces.widths) + 1))]


def _face_under(faces: Faces, rows: slice, polygon: Array, normal: Array) -> int | None:
    """Number of the face of one block that a polygon lies on, or None.

    The nearest of those that look its way within 45 degrees and are no farther than half its size. Alignment decides
    between faces as near as each other. How far the middle lies beside a face is told by the face's box.

    Parameters
    ----------
    faces : of all blocks
    rows : numbers of the faces of the block
    polygon : corners of the face that they may touch [m], shape (n, 3)
    normal : outward unit normal that is looked for, shape (3,)
    """
    aligned = faces.normal[rows] @ normal
    away = np.abs(polygon @ faces.normal[rows].T - faces.offset[rows]).max(axis=0)
    middle = polygon.mean(axis=0)
    low, high = faces.corners[rows].min(axis=1), faces.corners[rows].max(axis=1)
    beside = np.maximum(np.maximum(low - middle, middle - high), 0.0).max(axis=1)
    size = float(np.ptp(polygon, axis=0).max())
    fits = (aligned > _LOOKS_THE_SAME_WAY) & (away <= _FARTHEST * size)
    if not fits.any():
        return None
    distance = away + beside + _ALIGNMENT_COUNTS * size * (1.0 - aligned)
    return int(rows.start + np.where(fits, distance, np.inf).argmin())


def _inner_faces(assembly: Blockwork, pieces: BlockPieces, faces: Faces, start: Index) -> Flags:
    """Whether each face is mostly a cut between pieces of one block.

    The faces are those of convex pieces, shape (number of faces,).

    Parameters
    ----------
    assembly : whose blocks they are
    pieces : convex pieces of the blocks
    faces : of all pieces
    start : row of the first face of every piece, shape (pieces + 1,)
    """
    out = np.zeros(len(faces.normal), dtype=bool)
    owner = pieces.owner
    several, among = contacts_within(pieces, assembly.contact_rules)
    if among is None:
        return out
    covered = np.zeros(len(out))
    for a, b, polygon, normal in zip(among.a.tolist(), among.b.tolist(), among.polygons, among.normals, strict=True):
        i, j = int(several[a]), int(several[b])
        if owner[i] != owner[j]:
            continue
        for piece, outward in ((i, normal), (j, -normal)):
            face = _face_under(faces, slice(start[piece], start[piece + 1]), polygon, outward)
            if face is not None:
                covered[face] += area_in_space(polygon)
    for k in np.flatnonzero(covered > 0.0).tolist():
        out[k] = covered[k] > _MOSTLY * area_in_space(faces.corners[k, : faces.corners_of[k]])
    return out
