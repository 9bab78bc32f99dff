"""How convex pieces meet at any relative rotation: axes of the widest gap, faces clipped on faces, edges that cross."""

import numpy as np

from dem.kernels.compiled import kernel
from dem.kernels.kinematics import _cross, _dot


@kernel(fast=False, counted=True)
def _plane_of(corners, faces, size, p, f, out):
    """Outward normal and offset of face f of convex piece p (Newell), written to ``out`` (4)."""
    n0 = n1 = n2 = c0 = c1 = c2 = 0.0
    m = size[p, f]
    for k in range(m):
        u, v = faces[p, f, k], faces[p, f, (k + 1) % m]
        x0, x1, x2 = corners[p, u, 0], corners[p, u, 1], corners[p, u, 2]
        y0, y1, y2 = corners[p, v, 0], corners[p, v, 1], corners[p, v, 2]
        n0 += (x1 - y1) * (x2 + y2)
        n1 += (x2 - y2) * (x0 + y0)
        n2 += (x0 - y0) * (x1 + y1)
        c0 += x0
        c1 += x1
        c2 += x2
    r = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    out[0], out[1], out[2] = n0 * r, n1 * r, n2 * r
    out[3] = (out[0] * c0 + out[1] * c1 + out[2] * c2) / m


@kernel(fast=False, counted=True)
def _gap_above(corners, n_corners, planes, p, f, q):
    """Height above face f of p of q's corner nearest to it [m], and its number."""
    gap, low = 1e300, 0
    for k in range(n_corners[q]):
        h = planes[p, f, 0] * corners[q, k, 0] + planes[p, f, 1] * corners[q, k, 1]
        h += planes[p, f, 2] * corners[q, k, 2] - planes[p, f, 3]
        if h < gap:
            gap, low = h, k
    return gap, low


@kernel(fast=False, counted=True)
def _widest_beside(corners, n_corners, planes, n_faces, p, q, axis, flat):
    """Gap of the face of p that separates q the most, of those whose normals leave an axis by more than ``flat``."""
    widest = -1e300
    for f in range(n_faces[p]):
        c = planes[p, f, 0] * axis[0] + planes[p, f, 1] * axis[1] + planes[p, f, 2] * axis[2]
        if abs(c) < flat:
            widest = max(widest, _gap_above(corners, n_corners, planes, p, f, q)[0])
    return widest


@kernel(fast=False, counted=True)
def _widest_gap(corners, n_corners, planes, n_faces, p, q, best):
    """Face of p that separates q the most, and q's corner nearest to it; plane and gap written to ``best`` (5)."""
    found, nearest = -1, 0
    best[4] = -1e300
    for f in range(n_faces[p]):
        gap, low = _gap_above(corners, n_corners, planes, p, f, q)
        if gap > best[4]:
            found, nearest, best[4] = f, low, gap
            best[:4] = planes[p, f]
    return found, nearest


@kernel(fast=False, counted=True)
def _widest_crossing(corners, edges, n_edges, planes, p, q, out):
    """Gap along the cross product of edges of p and q that separates them most, -1e300 without any; cosine to a face.

    Only edges whose arcs on the sphere of normals, from face to face beside the edge, cross: theirs are planes of
    support (Gottschalk, Lin, Manocha 1996 for the axes; Gregorius 2013 for the arcs).

    Parameters
    ----------
    out : start and vector along either edge [m], and the unit normal from p to q, written, shape (5, 3)
    """
    widest, steepest = -1e300, 1.0
    for e in range(n_edges[p]):
        i, j = edges[p, e, 0], edges[p, e, 1]
        x, y = corners[p, i], corners[p, j]
        u = (y[0] - x[0], y[1] - x[1], y[2] - x[2])
        one, two = planes[p, edges[p, e, 2]], planes[p, edges[p, e, 3]]
        a, b = (one[0], one[1], one[2]), (two[0], two[1], two[2])
        turn = _cross(b, a)
        for h in range(n_edges[q]):
            one, two = planes[q, edges[q, h, 2]], planes[q, edges[q, h, 3]]
            c, d = (-one[0], -one[1], -one[2]), (-two[0], -two[1], -two[2])
            ct, dt = _dot(c, turn), _dot(d, turn)
            if not ct * dt < 0.0:
                continue
            back = _cross(d, c)
            at, bt = _dot(a, back), _dot(b, back)
            if not (at * bt < 0.0 and ct * bt > 0.0):
                continue
            o, w = corners[q, edges[q, h, 0]], corners[q, edges[q, h, 1]]
            v = (w[0] - o[0], w[1] - o[1], w[2] - o[2])
            m = _cross(u, v)
            size, lu, lv = np.sqrt(_dot(m, m)), np.sqrt(_dot(u, u)), np.sqrt(_dot(v, v))
            if size < 1e-6 * lu * lv:
                continue
            sign = 1.0 if m[0] * (a[0] + b[0]) + m[1] * (a[1] + b[1]) + m[2] * (a[2] + b[2]) > 0.0 else -1.0
            gap = sign * (m[0] * (o[0] - x[0]) + m[1] * (o[1] - x[1]) + m[2] * (o[2] - x[2])) / size
            if gap > widest:
                widest = gap
                n = (sign * m[0] / size, sign * m[1] / size, sign * m[2] / size)
                steepest = max(max(_dot(n, a), _dot(n, b)), max(_dot(n, c), _dot(n, d)))
                for r in range(3):
                    out[0, r], out[1, r], out[3, r] = x[r], u[r], sign * v[r]
                    out[2, r], out[4, r] = o[r] if sign > 0.0 else w[r], n[r]
    return widest, steepest


@kernel(fast=False, counted=True)
def contact_shapes(
    corners, n_corners, faces, size, n_faces, edges, n_edges, pairs, margin, flat,
    kind, gap, beside, planes, polygon, count, plane_out, crossing, first_is_base, base_face,
):  # fmt: skip
    """How every pair of convex pieces nearer than ``margin`` meets, at any relative rotation.

    Of the normals of the faces and the cross products of the edges, the axis of the widest gap (least penetration) is
    taken. Where it is a cross product that leaves the normals of the faces beside the edges by more than ``flat``, the
    edges meet in a point. Otherwise a face of one piece, the base, meets of the faces at the other's nearest corner the
    most opposed one, clipped by the base's sides: the polygon lies on that second face.

    Parameters
    ----------
    corners, faces : pieces in their present position [m], padded, shapes (p, v, 3), (p, f, k)
    edges : both corners and both faces of every edge, padded, shape (p, e, 4)
    n_corners, size, n_faces, n_edges : numbers in use, shapes (p,), (p, f), (p,), (p,)
    pairs : shape (m, 2)
    margin : [m]
    flat : cosine of the angle between the normals of faces that lie on each other
    kind : written, 0 apart, 1 face on face, 2 edge or corner on a face, 3 two edges, shape (m,)
    gap : along the axis, negative where the pieces overlap [m], written, shape (m,)
    beside : widest gap along the normals of faces that leave the axis by more than ``flat`` [m], written, shape (m,)
    planes : outward normal and offset [m] of every face of the pieces, written, shape (p, f, 4)
    polygon, count : of kinds 1 and 2 [m], written, shapes (m, 32, 3), (m,)
    plane_out : of kinds 1 and 2, unit normal away from the base and offset [m], written, shape (m, 4)
    crossing : of kind 3, see :func:`_widest_crossing`, first piece first, written, shape (m, 5, 3)
    first_is_base : written, shape (m,); given where ``base_face`` is
    base_face : face of the base that is asked for whatever the gaps, -1 for that of the widest gap, shape (m,)
    """
    plane, best_p, best_q, side = np.empty(4), np.empty(5), np.empty(5), np.empty(4)
    one, two = np.empty((32, 3)), np.empty((32, 3))
    known = np.zeros(len(corners), dtype=np.bool_)
    for m in range(len(pairs)):
        kind[m] = count[m] = 0
        p, q = pairs[m, 0], pairs[m, 1]
        for i in (p, q):
            if not known[i]:
                known[i] = True
                for f in range(n_faces[i]):
                    _plane_of(corners, faces, size, i, f, plane)
                    planes[i, f] = plane
        if base_face[m] >= 0:
            first, face, ref = first_is_base[m], base_face[m], best_p
            base, other = (p, q) if first else (q, p)
            ref[:4] = planes[base, face]
            ref[4], lowest = _gap_above(corners, n_corners, planes, base, face, other)
            gap[m] = ref[4]
        else:
            fp, low_q = _widest_gap(corners, n_corners, planes, n_faces, p, q, best_p)
            if best_p[4] > margin:
                continue
            fq, low_p = _widest_gap(corners, n_corners, planes, n_faces, q, p, best_q)
            if best_q[4] > margin:
                continue
            first = best_p[4] >= best_q[4] - 1e-3 * margin
            base, other, face = (p, q, fp) if first else (q, p, fq)
            ref = best_p if first else best_q
            lowest = low_q if first else low_p
            gap[m] = ref[4]
            wide, steepest = _widest_crossing(corners, edges, n_edges, planes, p, q, crossing[m])
            if wide > margin:
                continue
            crosses = wide > ref[4] + 1e-6 * margin and steepest < flat
            axis = crossing[m, 4] if crosses else ref[:3]
            beside[m] = max(
                _widest_beside(corners, n_corners, planes, n_faces, p, q, axis, flat),
                _widest_beside(corners, n_corners, planes, n_faces, q, p, axis, flat),
            )
            if crosses:
                kind[m], gap[m], first_is_base[m] = 3, wide, True
                continue
        opposed, low = 0, 2.0
        for f in range(n_faces[other]):
            touches = False
            for k in range(size[other, f]):
                touches = touches or faces[other, f, k] == lowest
            c = planes[other, f, 0] * ref[0] + planes[other, f, 1] * ref[1] + planes[other, f, 2] * ref[2]
            if touches and c < low:
                low, opposed = c, f
        n = size[other, opposed]
        for k in range(n):
            for r in range(3):
                one[k, r] = corners[other, faces[other, opposed, k], r]
        sides = size[base, face]
        for k in range(sides):
            u, v = faces[base, face, k], faces[base, face, (k + 1) % sides]
            e0 = corners[base, v, 0] - corners[base, u, 0]
            e1 = corners[base, v, 1] - corners[base, u, 1]
            e2 = corners[base, v, 2] - corners[base, u, 2]
            side[0] = e1 * ref[2] - e2 * ref[1]
            side[1] = e2 * ref[0] - e0 * ref[2]
            side[2] = e0 * ref[1] - e1 * ref[0]
            side[3] = side[0] * corners[base, u, 0] + side[1] * corners[base, u, 1] + side[2] * corners[base, u, 2]
            new = 0
            for i in range(n):
                a = side[0] * one[i, 0] + side[1] * one[i, 1] + side[2] * one[i, 2] - side[3]
                z = (i + 1) % n
                b = side[0] * one[z, 0] + side[1] * one[z, 1] + side[2] * one[z, 2] - side[3]
                if a <= 0.0 and new < 32:
                    for r in range(3):
                        two[new, r] = one[i, r]
                    new += 1
                if (a < 0.0 < b or b < 0.0 < a) and new < 32:
                    t = a / (a - b)
                    for r in range(3):
                        two[new, r] = one[i, r] + t * (one[z, r] - one[i, r])
                    new += 1
            n = new
            for i in range(n):
                for r in range(3):
                    one[i, r] = two[i, r]
        if n < 3:
            continue
        near = 1e300
        for i in range(n):
            near = min(near, ref[0] * one[i, 0] + ref[1] * one[i, 1] + ref[2] * one[i, 2] - ref[3])
        if near > margin:
            continue
        kind[m], count[m] = (1 if low < -flat else 2), n
        first_is_base[m] = first
        for i in range(n):
            for r in range(3):
                polygon[m, i, r] = one[i, r]
        for r in range(4):
            plane_out[m, r] = ref[r]
