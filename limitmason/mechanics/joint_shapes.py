"""Shapes of blocks that deform, at the contact points of their joints: what modes and capacity curves share."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array, Index
from limitmason.deformable import Body, polynomial_blocks, simply_deformable_blocks
from limitmason.deformable.levels import RITZ, SIMPLY_DEFORMABLE
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.model.assembly import Assembly

_EXACT = 1e-9
"""Part of a face's area by which an integral over its points may be off and still counts as exact: rounding [-]."""

_SEEN = 1e-10
"""Part of the stiffest rigid motion of a joint's points: a motion below it moves no point [-]."""

_SOFT = 5.0
"""E / (kn l) of a block below which simply deformable shapes may miss more than 2 %."""

_HIGHEST = 3
"""Degree up to which a joint takes up the displacement of a face: chosen."""

_GAUSS = 7
"""Gauss points on a side of :func:`_face_points`: exact to the power 13, of which the collapsed corner takes one."""


def shapes_of(assembly: Assembly, blocks: str, stress: str, normal: ArrayLike | None) -> Sequence[Body | None]:
    """Shapes of every block, None where it is rigid.

    Parameters
    ----------
    blocks : "simply deformable", by :func:`limitmason.deformable.simply_deformable_blocks`, or "ritz", by
        :func:`limitmason.deformable.polynomial_blocks`
    stress : "solid", "plane stress" or "plane strain"
    normal : of the plane, shape (3,); None in space, and for (0, 1, 0) in plane
    """
    return (simply_deformable_blocks if blocks == SIMPLY_DEFORMABLE else polynomial_blocks)(assembly, stress, normal)


def soft_block_warnings(assembly: Assembly, kn: Array, blocks: str) -> tuple[str, ...]:
    """Warning where simply deformable blocks are as soft as their joints, with few shapes for what they then do.

    Parameters
    ----------
    kn : normal stiffness of every interface [Pa/m], shape (interfaces,)
    blocks : "simply deformable"; other kinds have no such limit

    Notes
    -----
    Of 50 random structures 18 had frequencies that "ritz" blocks move by more than 2 %, all with E / (kn l) below 5,
    l the cube root of the volume. Some below it are within 2 %.
    """
    if blocks != SIMPLY_DEFORMABLE:
        return ()
    x, stiffest = assembly.arrays, np.zeros(assembly.n_blocks)  # kn of the stiffest joint of every block [Pa/m]
    for side in (x.block_a, x.block_b):
        np.maximum.at(stiffest, side, kn)
    made_of = [np.inf if b.material is None else b.material.young_modulus for b in assembly.blocks]
    # a block without joints is infinitely stiff beside them; one that is held strains nothing that could be missed
    with np.errstate(divide="ignore"):
        ratio = np.where(assembly.held.all(axis=1), np.inf, np.array(made_of) / (stiffest * np.cbrt(x.volume)))
    i = int(np.argmin(ratio))
    if not ratio[i] < _SOFT:
        return ()
    return (
        f"block {assembly.blocks[i].name!r} is hardly stiffer than its joints, E / (kn l) = {ratio[i]:.2g} below "
        f"{_SOFT:g}: the shapes of simply deformable blocks may be too few, by 2 % and more; compare with "
        "blocks='ritz' of a capacity curve, or with zones",
    )


def at_joints(
    assembly: Assembly, points: ContactPoints, shapes: Sequence[Body | None], blocks: str
) -> tuple[Array, Array]:
    """Displacement of every shape of the blocks a and b at every joint point [m], shapes (m, 3, most shapes) each.

    Columns beyond the shapes of a block are zero.

    Parameters
    ----------
    points : of joints, those of one joint one after another
    shapes : of every block, None where it is rigid
    blocks : "simply deformable", whose joints take up a face's displacement by :func:`face_motions`, as in the DEM; or
        "ritz", by :func:`fitted`
    """
    most = max((s.count for s in shapes if s is not None), default=0)
    out = np.zeros((points.count, 3, most)), np.zeros((points.count, 3, most))
    first = np.flatnonzero(np.diff(points.interface, prepend=-1))
    x = assembly.arrays
    for rows in np.split(np.arange(points.count), first[1:]):
        k = int(points.interface[rows[0]])
        samples, fit = points.position[rows], None
        if blocks == RITZ:
            samples, weights = _face_points(assembly.interfaces[k].polygon)
            fit = fitted(points, rows, samples, weights)
        frame = np.stack([x.tangent_1[k], x.tangent_2[k], x.normal[k]])
        for shifts, block in zip(out, (points.block_a[rows[0]], points.block_b[rows[0]]), strict=True):
            shape = shapes[int(block)]
            if shape is None:
                continue
            u = shape.displacement(samples)  # of every shape there, shape (samples, shapes, 3)
            if fit is not None:
                u = np.tensordot(fit, u, axes=1).transpose(0, 2, 1)
            else:
                place = (samples - x.centre[k]) @ frame[:2].T
                start = np.array([0, len(rows)])
                # the rigid motion of the face, weighted by area, that stands for the shape
                moved = face_motions(start, place, points.area[rows], frame @ u.transpose(0, 2, 1))
                u = frame.T @ (motion_at(place) @ moved[0])
            shifts[rows, :, : shape.count] = u
    return out


def motion_at(place: Array) -> Array:
    """Displacement of points of a joint by its six rigid motions, shape (m, 3, 6).

    Axes and order of the motions: along both tangents and the normal, then turns about the same three.

    Parameters
    ----------
    place : coordinates along the joint's tangents from the point about which it turns [m], shape (m, 2)
    """
    out = np.zeros((len(place), 3, 6))
    out[:, :, :3] = np.eye(3)
    s, t = place.T
    out[:, 2, 3], out[:, 2, 4] = t, -s
    out[:, 0, 5], out[:, 1, 5] = -t, s
    return out


def face_motions(start: Index, place: Array, area: Array, displacement: Array) -> Array:
    """Rigid motions of joints that are nearest to the displacement of a face, by least squares over their points.

    A joint of simply deformable blocks takes up six motions of a face and leaves out how it bends and widens: plane
    faces stay plane, as sections of Timoshenko's beam do. The points of a stiff joint then resist no contraction of
    a block, of which a few shapes cannot have as much as the joint would leave free. Uniform strain moves both faces of
    a joint alike, so that it meets no resistance either.

    Parameters
    ----------
    start : first point of every joint, and the number of points, shape (k + 1,)
    place : of the points along the joint's tangents, from one origin [m], shape (m, 2)
    area : of the points [m2], shape (m,)
    displacement : of any shapes at the points along t1, t2 and the normal, shape (m, 3, n)

    Returns
    -------
    displacement at the origin and rotation per shape, axes of the joint, shape (k, 6, n); of motions that no point
    notices none
    """
    # normal equations, weighed by area. Places are taken over a length of the joint, so that rotations are of the size
    # of displacements; its area is in that length, as a joint of one point has no other
    size = np.sqrt(np.add.reduceat(area, start[:-1]) + np.maximum.reduceat((place**2).sum(axis=1), start[:-1]))
    owner = np.repeat(np.arange(len(start) - 1), np.diff(start))
    rigid = motion_at(place / size[owner][:, None])
    weighted = area[:, None, None] * rigid
    gram = np.add.reduceat(np.einsum("mci,mcj->mij", weighted, rigid), start[:-1], axis=0)
    right = np.add.reduceat(np.einsum("mci,mcn->min", weighted, displacement), start[:-1], axis=0)
    motions = np.linalg.pinv(gram, rcond=_SEEN, hermitian=True) @ right
    # back to rotations [rad]
    motions[:, 3:] /= size[:, None, None]
    return np.asarray(motions)


def fitted(points: ContactPoints, rows: Index, samples: Array, weights: Array) -> Array:
    """Matrix from a face's displacement at samples to the polynomial nearest to it at a joint's points.

    By least squares over the face, of the highest degree up to 3 that the points integrate exactly over it: then
    uniform pressure at the points does the work of uniform pressure on the face, and rigid motions stay as they are. A
    force at a point acts on the block as a traction over the joint that is a polynomial of that degree.

    Parameters
    ----------
    points : of all joints
    rows : numbers of those of this joint, shape (p,)
    samples, weights : of a quadrature over the face [m], (s, 3), and [m2], (s,)

    Returns
    -------
    what a displacement at the samples is multiplied by [-], shape (p, s)
    """
    centre = np.average(samples, axis=0, weights=weights)
    tangents = points.directions[rows[0], 1:]
    # coordinates along the tangents over half the face's size, so that all powers are of one order
    size = float(np.abs((samples - centre) @ tangents.T).max())
    at_points, at_samples = ((x - centre) @ tangents.T / size for x in (points.position[rows], samples))
    area = points.area[rows]
    # the highest degree that the points integrate exactly
    chosen = np.ones((len(rows), 1)), np.ones((len(samples), 1))  # monomials at the points, and at the samples
    for degree in range(1, _HIGHEST + 1):
        here, there = _monomials(at_points, degree), _monomials(at_samples, degree)
        if np.abs(area @ here - weights @ there).max() > _EXACT * weights.sum():
            break
        chosen = here, there
    # least squares by the normal equations over the face
    here, there = chosen
    gram = there.T @ (weights[:, None] * there)
    return np.asarray(here @ np.linalg.solve(gram, (weights[:, None] * there).T))


def _monomials(x: Array, degree: int) -> Array:
    """All products of powers of coordinates up to a degree, (m, number of products), for x of (m, 1) or (m, 2)."""
    if x.shape[1] == 1:
        return np.asarray(x ** np.arange(degree + 1))
    return np.column_stack([x[:, 0] ** i * x[:, 1] ** j for i in range(degree + 1) for j in range(degree + 1 - i)])


def _face_points(polygon: Array) -> tuple[Array, Array]:
    """Points [m], (s, 3), and weights [m2], (s,), exact to degree 12 over a convex polygon of corners (k, 3) [m].

    Every triangle at the first corner is a unit square whose side u = 0 is collapsed into that corner.
    """
    g, w = np.polynomial.legendre.leggauss(_GAUSS)
    g, w = 0.5 * (g + 1.0), 0.5 * w  # from -1 .. 1 to 0 .. 1
    u, v = (x.ravel() for x in np.meshgrid(g, g, indexing="ij"))
    weight = np.outer(w * g, w).ravel()  # the ratio of areas of the map grows as u
    x = np.asarray(polygon, float)
    a, b = x[1:-1] - x[0], x[2:] - x[0]
    twice = np.linalg.norm(np.cross(a, b), axis=1)  # areas of the triangles, doubled
    places = x[0] + np.einsum("s,ti->tsi", u * (1.0 - v), a) + np.einsum("s,ti->tsi", u * v, b)
    return places.reshape(-1, 3), np.outer(twice, weight).ravel()
