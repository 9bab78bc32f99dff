"""How convex pieces meet at any rotation: widest gap, clipped faces, edges.

Arguments that are named like a field of :class:`PieceArrays` are that field: ``corners`` and ``planes`` of all pieces,
and how many of them count. A gap is negative where pieces overlap.
"""


import numpy as np

from dem.kernels.arrays import Array, Index
from dem.kernels.compiled import kernel
from dem.kernels.kinematics import cross, dot
from dem.kernels.pieces import Meetings, PieceArrays

APART, FACES, CORNER, CROSSING = 0, 1, 2, 3
"""How two pieces meet: not at all, face on face, an edge or corner on a face, two edges."""

MOST = 32
"""Corners that a polygon in which two faces meet has room for; chosen: further corners are left out."""

PARALLEL = 1e-6
"""Sine of the angle below which two edges are parallel: their cross product is then no direction."""

HARDLY = 1e-3
"""Difference of two gaps, over the margin, that is too small for a joint to change the piece that is its base."""

ROUNDING = 1e-6
"""Difference of two gaps, over the margin, up to which a face goes before a crossing, whose gap may be the same."""


@kernel(fast=False)
def _gap_above(
    corners: Array, n_corners: Index, planes: Array, p: int, f: int, q: int
) -> tuple[float, int]:
    """Height of q's lowest corner above face f of piece p [m], and its number in q.

    ``corners`` are places [m], ``planes`` unit outward normals and offsets [m], of all pieces.
    """
    gap, low = 1e300, 0
    for k in range(n_corners[q]):
        h = planes[p, f, 0] * corners[q, k, 0] + planes[p, f, 1] * corners[q, k, 1]
        h += planes[p, f, 2] * corners[q, k, 2] - planes[p, f, 3]
        if h < gap:
            gap, low = h, k
    return gap, low


@kernel(fast=False)
def _widest_beside(
    corners: Array, n_corners: Index, planes: Array, n_faces: Index, p: int, q: int, axis: Array, flat: float
) -> float:
    """Widest gap [m] from the faces of p to q, without faces that look along an axis.

    Parameters
    ----------
    corners, n_corners, planes, n_faces : of all pieces, see :class:`PieceArrays`
    p, q : numbers of the pieces
    axis : unit vector, shape (3,)
    flat : size of the cosine between a face's normal and the axis from which on the face is left out

    Returns
    -------
    gap of the lowest corner of q above a face, negative where q reaches below all of them; -1e300 where no face is left
    """
    widest = -1e300
    for f in range(n_faces[p]):
        c = planes[p, f, 0] * axis[0] + planes[p, f, 1] * axis[1] + planes[p, f, 2] * axis[2]
        if abs(c) < flat:
            widest = max(widest, _gap_above(corners, n_corners, planes, p, f, q)[0])
    return widest


@kernel(fast=False)
def _widest_gap(
    corners: Array, n_corners: Index, planes: Array, n_faces: Index, p: int, q: int, best: Array
) -> tuple[int, int]:
    """Face of piece p with the widest gap towards q, and q's corner nearest to it.

    Parameters
    ----------
    corners, n_corners, planes, n_faces : of all pieces, see :class:`PieceArrays`
    p, q : numbers of the pieces
    best : unit outward normal (3), offset [m] and gap [m] of that face, written, shape (5,)

    Returns
    -------
    face, corner : numbers within p and within q
    """
    found, nearest = -1, 0
    best[4] = -1e300
    for f in range(n_faces[p]):
        gap, low = _gap_above(corners, n_corners, planes, p, f, q)
        if gap > best[4]:
            found, nearest, best[4] = f, low, gap
            for r in range(4):
                best[r] = planes[p, f, r]
    return found, nearest


@kernel(fast=False)
def _widest_crossing(
    corners: Array, edges: Index, n_edges: Index, planes: Array, p: int, q: int, out: Array
) -> tuple[float, float]:
    """Widest gap between p and q along the cross product of two of their edges.

    Only edges whose arcs on the sphere of normals, from face to face beside the edge, cross: theirs are planes of
    support (Gottschalk, Lin, Manocha 1996 for the axes; Gregorius 2013 for the arcs).

    Parameters
    ----------
    corners, edges, n_edges, planes : of all pieces, see :class:`PieceArrays`
    p, q : numbers of the pieces
    out : start and vector u along the edge of p [m], start and vector v along that of q [m], and the unit normal from p
        to q, which runs along u x v, written, shape (5, 3)

    Returns
    -------
    gap : [m], -1e300 where no edges cross
    steepest : largest cosine between that direction and the normals of the four faces beside the edges [-]
    """
    # u, v are the edges; a, b the outward normals of the faces beside u, and c, d the inward ones of those beside v
    widest, steepest = -1e300, 1.0
    for e in range(n_edges[p]):
        i, j = edges[p, e, 0], edges[p, e, 1]
        x, y = corners[p, i], corners[p, j]
        u = (y[0] - x[0], y[1] - x[1], y[2] - x[2])
        one, two = planes[p, edges[p, e, 2]], planes[p, edges[p, e, 3]]
        a, b = (one[0], one[1], one[2]), (two[0], two[1], two[2])
        turn = cross(b, a)
        for h in range(n_edges[q]):
            one, two = planes[q, edges[q, h, 2]], planes[q, edges[q, h, 3]]
            c, d = (-one[0], -one[1], -one[2]), (-two[0], -two[1], -two[2])
            ct, dt = dot(c, turn), dot(d, turn)
            # two edges make a face of the difference p - q where the arcs of their normals cross: c and d to either
            # side of the arc from a to b, a and b to either side of that from c to d, both on one half of the sphere
            if not ct * dt < 0.0:
                continue
            back = cross(d, c)
            at, bt = dot(a, back), dot(b, back)
            if not (at * bt < 0.0 and ct * bt > 0.0):
                continue
            o, w = corners[q, edges[q, h, 0]], corners[q, edges[q, h, 1]]
            v = (w[0] - o[0], w[1] - o[1], w[2] - o[2])
            m = cross(u, v)
            size, lu, lv = np.sqrt(dot(m, m)), np.sqrt(dot(u, u)), np.sqrt(dot(v, v))
            if size < PARALLEL * lu * lv:
                continue
            # the normal leaves p: it lies between a and b
            sign = 1.0 if m[0] * (a[0] + b[0]) + m[1] * (a[1] + b[1]) + m[2] * (a[2] + b[2]) > 0.0 else -1.0
            gap = sign * (m[0] * (o[0] - x[0]) + m[1] * (o[1] - x[1]) + m[2] * (o[2] - x[2])) / size
            if gap > widest:
                widest = gap
                n = (sign * m[0] / size, sign * m[1] / size, sign * m[2] / size)
                steepest = max(max(dot(n, a), dot(n, b)), max(dot(n, c), dot(n, d)))
                # the edge of q is told from its other end where else u x v would run against the normal
                for r in range(3):
                    out[0, r], out[1, r], out[3, r] = x[r], u[r], sign * v[r]
                    out[2, r], out[4, r] = o[r] if sign > 0.0 else w[r], n[r]
    return widest, steepest


@kernel(fast=False, forceinline=True)
def _clipped(pieces: PieceArrays, base: int, face: int, axis: Array, polygon: Array, n: int, spare: Array) -> int:
    """Clip a polygon by the sides of a face of the base, seen along its normal.

    Side after side cuts off what lies beyond it (Sutherland and Hodgman 1974).

    Parameters
    ----------
    pieces : all pieces
    base : number of the piece
    face : number of its face
    axis : unit normal of that face in the first three entries
    polygon : corners [m], changed in place, shape (MOST, 3)
    n : how many corners it has
    spare : work space, shape (MOST, 3)

    Returns
    -------
    n : how many corners are left
    """
    # a kernel uses nothing from outside: what limitmason.geometry.polygon.part_within does, compiled and in place
    corners, faces = pieces.corners, pieces.faces
    sides = pieces.size[base, face]
    for k in range(sides):
        u, v = faces[base, face, k], faces[base, face, (k + 1) % sides]
        e0 = corners[base, v, 0] - corners[base, u, 0]
        e1 = corners[base, v, 1] - corners[base, u, 1]
        e2 = corners[base, v, 2] - corners[base, u, 2]
        # plane through the side and parallel to the axis: outward normal s0, s1, s2 and offset s3
        s0, s1, s2 = e1 * axis[2] - e2 * axis[1], e2 * axis[0] - e0 * axis[2], e0 * axis[1] - e1 * axis[0]
        s3 = s0 * corners[base, u, 0] + s1 * corners[base, u, 1] + s2 * corners[base, u, 2]
        new = 0
        for i in range(n):
            # how far this corner and the next lie beyond the side; where they lie to either side the edge is cut
            a = s0 * polygon[i, 0] + s1 * polygon[i, 1] + s2 * polygon[i, 2] - s3
            z = (i + 1) % n
            b = s0 * polygon[z, 0] + s1 * polygon[z, 1] + s2 * polygon[z, 2] - s3
            if a <= 0.0 and new < MOST:
                for r in range(3):
                    spare[new, r] = polygon[i, r]
                new += 1
            if (a < 0.0 < b or b < 0.0 < a) and new < MOST:
                t = a / (a - b)  # part of the way from this corner to the next at which the side is crossed
                for r in range(3):
                    spare[new, r] = polygon[i, r] + t * (polygon[z, r] - polygon[i, r])
                new += 1
        n = new
        for i in range(n):
            for r in range(3):
                polygon[i, r] = spare[i, r]
    return n


@kernel(fast=False, forceinline=True)
def _opposed_face(pieces: PieceArrays, other: int, lowest: int, axis: Array) -> tuple[int, float]:
    """Of the faces of a piece at one of its corners, the one most opposed to an axis.

    Parameters
    ----------
    pieces : all pieces
    other : number of the piece
    lowest : number of its corner
    axis : unit vector in the first three entries

    Returns
    -------
    face : number of the face
    cosine : between its normal and the axis, -1 where they are opposed
    """
    opposed, low = 0, 2.0  # above any cosine
    for f in range(pieces.n_faces[other]):
        touches = False
        for k in range(pieces.size[other, f]):
            touches = touches or pieces.faces[other, f, k] == lowest
        plane = pieces.planes
        c = plane[other, f, 0] * axis[0] + plane[other, f, 1] * axis[1] + plane[other, f, 2] * axis[2]
        if touches and c < low:
            low, opposed = c, f
    return opposed, low


@kernel(fast=False, forceinline=True)
def _widest_axis(
    pieces: PieceArrays, p: int, q: int, m: int, margin: float, flat: float, met: Meetings, ref_p: Array, ref_q: Array
) -> tuple[bool, int, int]:
    """Axis along which p and q are farthest apart, of face normals and edge pairs.

    Parameters
    ----------
    pieces : all pieces
    p, q : numbers of the pieces
    m : row of ``met``, the meetings that are written
    margin : gap from which on two pieces are left alone [m]
    flat : cosine between the crossing's axis and the normals beside it from which on faces meet instead of edges
    ref_p, ref_q : written: plane (4) and gap [m] of the face of p, and of q, with the widest gap, shape (5,)

    Returns
    -------
    first : whether p is the base, the piece whose face the other meets
    face : number of that face; -1 where the gap is wider than the margin, and where two edges cross. The crossing is
        then in ``met``
    lowest : number of the other's corner nearest to that face
    """
    corners, n_corners, planes, n_faces = pieces.corners, pieces.n_corners, pieces.planes, pieces.n_faces
    fp, low_q = _widest_gap(corners, n_corners, planes, n_faces, p, q, ref_p)
    if ref_p[4] > margin:
        return True, -1, 0
    fq, low_p = _widest_gap(corners, n_corners, planes, n_faces, q, p, ref_q)
    if ref_q[4] > margin:
        return True, -1, 0
    # of gaps that hardly differ the first piece's counts, so that a joint keeps its base from search to search
    first = ref_p[4] >= ref_q[4] - HARDLY * margin
    ref = ref_p if first else ref_q
    met.gap[m] = ref[4]
    wide, steepest = _widest_crossing(corners, pieces.edges, pieces.n_edges, planes, p, q, met.crossing[m])
    if wide > margin:
        return True, -1, 0
    crosses = wide > ref[4] + ROUNDING * margin and steepest < flat
    axis = met.crossing[m, 4] if crosses else ref[:3]
    met.beside[m] = max(
        _widest_beside(corners, n_corners, planes, n_faces, p, q, axis, flat),
        _widest_beside(corners, n_corners, planes, n_faces, q, p, axis, flat),
    )
    if crosses:
        met.kind[m], met.gap[m], met.base_first[m] = CROSSING, wide, True
        return True, -1, 0
    if first:
        return True, fp, low_q
    return False, fq, low_p


@kernel(fast=False, counted=True)
def contact_shapes(
    pieces: PieceArrays, pairs: Index, rows: Index, margin: float, flat: float, met: Meetings, asked: Index
) -> None:
    """How pairs of convex pieces nearer than ``margin`` meet, at any rotation.

    Of the normals of the faces and the cross products of the edges, the axis of the widest gap (least penetration) is
    taken. Where it is a cross product that leaves the normals of the faces beside the edges by more than ``flat``, the
    edges meet in a point. Otherwise a face of one piece, the base, meets of the faces at the other's nearest corner the
    most opposed one, clipped by the base's sides: the polygon lies on that second face.

    Parameters
    ----------
    pieces : all pieces in their present position
    pairs : numbers of both pieces of every pair, shape (m, 2)
    rows : pairs that are looked at
    margin : gap from which on two pieces are left alone [m]
    flat : cosine of the largest angle between faces that lie on each other
    met : how every pair meets, written; ``base_first`` is read where a face is asked for
    asked : face of the base that is asked for whatever the gaps, -1 for that of the widest gap, shape (m,)
    """
    best_p, best_q = np.empty(5), np.empty(5)
    polygon, spare = np.empty((MOST, 3)), np.empty((MOST, 3))
    for m in rows:
        met.kind[m], met.corners[m] = APART, 0
        p, q = pairs[m, 0], pairs[m, 1]
        # base and face are asked for, or those of the widest gap; ``ref`` is the face's plane (4) and gap [m]
        if asked[m] >= 0:
            first, face = met.base_first[m], asked[m]
            base, other = (p, q) if first else (q, p)
            ref = best_p if first else best_q
            for r in range(4):
                ref[r] = pieces.planes[base, face, r]
            ref[4], lowest = _gap_above(pieces.corners, pieces.n_corners, pieces.planes, base, face, other)
            met.gap[m] = ref[4]
        else:
            first, face, lowest = _widest_axis(pieces, p, q, m, margin, flat, met, best_p, best_q)
            if face < 0:
                continue
            base, other = (p, q) if first else (q, p)
            ref = best_p if first else best_q
        opposed, low = _opposed_face(pieces, other, lowest, ref)
        n = pieces.size[other, opposed]
        for k in range(n):
            for r in range(3):
                polygon[k, r] = pieces.corners[other, pieces.faces[other, opposed, k], r]
        n = _clipped(pieces, base, face, ref, polygon, n, spare)
        if n < 3:
            continue  # seen along the normal the two faces share no area
        near = 1e300  # height of the polygon's lowest corner above the face
        for i in range(n):
            near = min(near, ref[0] * polygon[i, 0] + ref[1] * polygon[i, 1] + ref[2] * polygon[i, 2] - ref[3])
        if near > margin:
            continue
        met.kind[m], met.corners[m] = (FACES if low < -flat else CORNER), n
        met.base_first[m] = first
        for i in range(n):
            for r in range(3):
                met.polygon[m, i, r] = polygon[i, r]
        for r in range(4):
            met.plane[m, r] = ref[r]
