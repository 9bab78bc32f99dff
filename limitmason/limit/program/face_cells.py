"""Cells of cohesive faces in space: cohesion may not gather at corners.

Dry friction follows the pressure, which may gather at the corners of a face: its corners represent it exactly. Cohesion
is spread over the area and resists a slip that turns by the integral of c |s|, not by c A times |s| at the corners. So
a face with cohesion gets its corners, dry, and cells with |T| <= c A_q + tan(phi) N, N >= -ft A_q at their centroids:
uniform stress in every cell, hence an admissible stress field and a lower bound. One cell is exact while the face
slides without turning. Where it turns the cells are cut into wedges about the centre of rotation, along whose rays |s|
is linear: the midpoint of a wedge errs only by its angle, to second order.
"""

import itertools
from collections.abc import Mapping

import numpy as np

from limitmason.arrays import Array
from limitmason.geometry.polygon import clip_convex, polygon_area_centroid
from limitmason.geometry.slip_integrals import slip_integrals
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.dissipation import face_slip
from limitmason.mechanics.law import interface_law
from limitmason.model.assembly import Assembly

Cells = Mapping[int, tuple[Array, ...]]
"""Convex polygons (n, 2) of every face in its own tangents about its centroid [m], by number of interface."""

MOST_WEDGES = 48
"""Wedges that one cell is cut into at most in one refinement: chosen, so that the program stays small."""

FEWEST_AROUND = 4
"""Wedges about a pole inside a polygon at least: chosen, so that each stays well below the half turn of a window."""

INSIDE = 1e-9
"""Distance from every edge, times the edge's length, over the size squared from which a pole counts as inside [-]."""

AT_POLE = 1e-6
"""Distance from the pole over the polygon's size up to which a corner lies on the pole and has no angle [-]."""

OUTWARDS = 1e-6
"""Angle by which the outer rays are turned outwards, so that corners on them are not cut off [rad]."""

REACH = 4.0
"""Length of the rays over the distance to the farthest corner [-]: chosen, so that a window covers the polygon."""

EMPTY = 1e-12
"""Area of a wedge over that of the polygon up to which it is rounding and left out [-]."""


def spread_cohesion(assembly: Assembly) -> Array:
    """Cohesion less what the tension corner explains, c - tan(phi) t [Pa]."""
    law = interface_law(assembly.arrays)
    return np.where(law.cut_off, law.corner_cohesion, 0.0)


def whole_faces(assembly: Assembly) -> Cells:
    """One cell, the whole face, for every cohesive face that touches a free block."""
    x = assembly.arrays
    free = ~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])
    return {k: (_outline(assembly, k),) for k in np.flatnonzero((spread_cohesion(assembly) > 0) & free).tolist()}


def _outline(assembly: Assembly, k: int) -> Array:
    """Corners of interface ``k`` in its tangents about its centroid [m], (n, 2)."""
    x = assembly.arrays
    frame = np.column_stack([x.tangent_1[k], x.tangent_2[k]])
    return (x.corners[x.corner_start[k] : x.corner_start[k + 1]] - x.centre[k]) @ frame


def with_cells(assembly: Assembly, points: ContactPoints, cells: Cells) -> ContactPoints:
    """The contact points of faces, with a point at the centroid of every cell as well.

    Parameters
    ----------
    points : at the corners of faces, in the order of the interfaces
    cells : of faces with cohesion; the corners of such a face stay, without area

    Returns
    -------
    Contact points in the order of the interfaces: of each the corners first, then its cells.
    """
    if not cells:
        return points
    x = assembly.links
    owner = np.repeat(list(cells), [len(c) for c in cells.values()])
    measured = [polygon_area_centroid(p) for c in cells.values() for p in c]
    flat = np.array([centre for _, centre in measured])
    position = x.centre[owner] + flat[:, :1] * x.tangent_1[owner] + flat[:, 1:] * x.tangent_2[owner]
    interface = np.concatenate([points.interface, owner])
    order = np.argsort(interface, kind="stable")
    interface = interface[order]
    # the corners of a face with cells stay, but it is the cells that bear its area
    area = np.where(np.isin(points.interface, owner), 0.0, points.area)
    return ContactPoints(
        position=np.concatenate([points.position, position])[order], interface=interface,
        area=np.concatenate([area, [a for a, _ in measured]])[order],
        directions=np.stack([x.normal[interface], x.tangent_1[interface], x.tangent_2[interface]], axis=1),
        block_a=x.block_a[interface], block_b=x.block_b[interface],
    )


def refined(assembly: Assembly, cells: Cells, twists: Array, allowed: float) -> Cells:
    """Cells cut so that a mechanism dissipates as on whole faces, to a power [W].

    A cell whose error is e becomes k wedges, of error e / k^2; the least number in all has k in proportion to the cube
    root of e.

    Parameters
    ----------
    cells : so far
    twists : of the mechanism [m/s, rad/s], shape (n_blocks, 6)
    allowed : sum of c (integral of |s| - A |s| at the centroid) over all cells afterwards [W]

    Returns
    -------
    Cells: the same object where the error is within ``allowed`` already.
    """
    faces = np.array(list(cells))
    at, spin = face_slip(assembly, twists, faces)  # slip at the centroid [m/s], (f, 2), and its turning [rad/s], (f,)
    cohesion = spread_cohesion(assembly)
    owner, polygons = [], []
    for number, k in enumerate(cells):
        owner += [number] * len(cells[k])
        polygons += list(cells[k])
    row = np.array(owner)  # number in ``faces`` of the face of every cell
    area, centre = (np.array(v) for v in zip(*(polygon_area_centroid(p) for p in polygons), strict=True))
    local = at[row] + spin[row, None] * np.column_stack([-centre[:, 1], centre[:, 0]])  # slip at centroids of cells
    start = np.concatenate([[0], np.cumsum([len(p) for p in polygons])])  # first corner of every cell
    corners = np.concatenate([p - c for p, c in zip(polygons, centre, strict=True)])
    exact = slip_integrals(corners, start, local, spin[row])
    error = np.maximum(exact - area * np.linalg.norm(local, axis=1), 0.0) * cohesion[faces[row]]
    if error.sum() <= allowed:
        return cells
    # k = s cbrt(e) leaves sum(e / k^2) = sum(cbrt(e)) / s^2, which is ``allowed`` for this s
    root = np.cbrt(error)
    pieces = np.ceil(np.sqrt(root.sum() / allowed) * root)
    out: dict[int, list[Array]] = {k: [] for k in cells}
    for q, polygon in enumerate(polygons):
        k = int(faces[row[q]])
        if pieces[q] <= 1:
            out[k].append(polygon)
            continue
        # centre of rotation; a cell with an error turns, so that spin is not zero
        pole = np.array([-at[row[q], 1], at[row[q], 0]]) / spin[row[q]]
        # n wedges of a whole turn err by (pi / n)^2 / 6 of the power: n follows from the part of it that may stay
        kept = error[q] / pieces[q] ** 2 / max(exact[q] * cohesion[k], 1e-300)  # never divided by zero
        around = int(np.ceil(np.pi / np.sqrt(6.0 * kept)))
        out[k] += wedges(polygon, pole, int(pieces[q]), around)
    return {k: tuple(v) for k, v in out.items()}


def wedges(polygon: Array, pole: Array, count: int, around: int) -> list[Array]:
    """A convex polygon cut by rays from a pole at equal angles.

    A pole inside is surrounded by wedges. From a pole outside the rays span the angle under which the polygon is seen.

    Parameters
    ----------
    polygon, pole : [m], shapes (n, 2) and (2,); the polygon counter-clockwise
    count : wedges of the polygon, where the pole lies outside; more where ``around`` asks for it
    around : wedges of a whole turn about the pole

    Returns
    -------
    Wedges [m], shape (k, 2) each; empty ones are left out.
    """
    arm = polygon - pole
    size = np.linalg.norm(np.ptp(polygon, axis=0))
    edge = np.roll(polygon, -1, axis=0) - polygon
    # left of every edge of a counter-clockwise polygon: cross product of edge and the way to the pole
    inside = (edge[:, 0] * -arm[:, 1] - edge[:, 1] * -arm[:, 0] > INSIDE * size**2).all()
    if inside:
        rays = np.linspace(0.0, 2.0 * np.pi, min(max(around, FEWEST_AROUND), MOST_WEDGES) + 1)
    else:
        away = arm[np.linalg.norm(arm, axis=1) > AT_POLE * size]
        middle = np.arctan2(*(polygon_area_centroid(polygon)[1] - pole)[::-1])
        # angles from the direction of the polygon's middle, so that none jumps at pi
        turn = np.angle(np.exp(1j * (np.arctan2(away[:, 1], away[:, 0]) - middle)))
        # as many as the part of a whole turn asks for; at least two, else nothing is cut
        count = max(count, int(np.ceil(around * np.ptp(turn) / (2.0 * np.pi))), 2)
        rays = middle + np.linspace(turn.min(), turn.max(), min(count, MOST_WEDGES) + 1)
        rays[0], rays[-1] = rays[0] - OUTWARDS, rays[-1] + OUTWARDS
    whole = polygon_area_centroid(polygon)[0]
    reach = REACH * np.linalg.norm(arm, axis=1).max()
    out = []
    for low, high in itertools.pairwise(rays):
        ends = pole + reach * np.array([[np.cos(low), np.sin(low)], [np.cos(high), np.sin(high)]])
        piece = clip_convex(polygon, np.vstack([pole, ends]))
        if len(piece) > 2 and polygon_area_centroid(piece)[0] > EMPTY * whole:
            out.append(piece)
    return out
