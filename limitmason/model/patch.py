"""Pressure on a patch that covers whole faces of some blocks and parts of others: airbags, bearings, water."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import finite
from limitmason.errors import InputError
from limitmason.geometry.polygon import clip_convex, polygon_area_centroid
from limitmason.geometry.polyhedron import face_planes
from limitmason.model.input import read_vector

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly


_PARALLEL = np.cos(np.deg2rad(1.0))
_NEAR = 1e-6  # of the patch's size: faces this near to its plane lie in it


def patch_wrenches(
    assembly: "Assembly", corners: ArrayLike, *, pressure: float = 0.0, traction: ArrayLike | None = None
) -> tuple[Array, float]:
    """Wrenches of a load spread evenly over a flat patch, on the blocks whose faces lie in it.

    Every face in the plane of the patch is clipped to it; force and moment are those of what is left,
    F = t A', M = (x' - c) x t A' with its area A' and centroid x'.

    Parameters
    ----------
    corners : of the patch, convex, counter-clockwise seen from outside the wall [m], shape (k, 3); its outward normal
        is that of the faces it loads
    pressure : pushes into the faces [Pa]
    traction : load per area in global axes instead of a pressure [Pa], shape (3,)

    Returns
    -------
    wrenches : about the centroids [N, N m], shape (n_blocks, 6)
    area : of the faces in the patch [m2], less than that of the patch where it overhangs the wall

    Raises
    ------
    InputError
        When the corners are not a flat convex polygon, or no face lies in it.

    Notes
    -----
    Faces that another block covers are loaded too if they lie in the patch: draw it over the free surface only.
    """
    p = np.array([read_vector(f"corners[{k}] of the patch", c) for k, c in enumerate(np.atleast_2d(corners))])
    if len(p) < 3:
        raise InputError(f"a patch needs at least three corners, got {len(p)}")
    normal, size = patch_normal(p)
    load = -finite("pressure", pressure) * normal if traction is None else read_vector("traction", traction)
    first = p[1] - p[0]
    first = first / np.linalg.norm(first)
    axes = np.stack([first, np.cross(normal, first)])
    window = (p - p[0]) @ axes.T
    wrench, total = np.zeros((assembly.n_blocks, 6)), 0.0
    for i, block in enumerate(assembly.blocks):
        for part in block.parts:
            for f in part.faces:
                face = part.vertices[list(f)]
                if np.abs((face - p[0]) @ normal).max() > _NEAR * size:
                    continue
                if face_planes(face[None])[0][0] @ normal < _PARALLEL:
                    continue
                left = clip_convex((face - p[0]) @ axes.T, window)
                if len(left) < 3:
                    continue
                area, centre = polygon_area_centroid(left)
                if area <= _NEAR**2 * size**2:
                    continue
                force = load * area
                arm = p[0] + centre @ axes - assembly.centroids[i]
                wrench[i] += np.concatenate([force, np.cross(arm, force)])
                total += area
    if total == 0.0:
        raise InputError(
            f"no face of a block lies in the patch with corners {p.tolist()} and outward normal "
            f"({normal[0]:.3g}, {normal[1]:.3g}, {normal[2]:.3g}): give the corners counter-clockwise seen from outside"
        )
    return wrench, total


def patch_normal(corners: Array) -> tuple[Array, float]:
    """Unit normal and size of a flat convex polygon."""
    r = corners - corners[0]
    size = float(np.linalg.norm(r, axis=1).max())
    area = 0.5 * np.cross(r[1:-1], r[2:]).sum(axis=0)
    length = float(np.linalg.norm(area))
    if length <= 1e-12 * size**2:
        raise InputError("the corners of the patch lie on one line")
    normal = area / length
    edges = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(edges, np.roll(edges, -1, axis=0)) @ normal
    if np.abs(r @ normal).max() > _NEAR * size or turns.min() < -_NEAR * size**2:
        raise InputError("the corners of the patch must be a flat convex polygon, in order around it")
    return normal, size
