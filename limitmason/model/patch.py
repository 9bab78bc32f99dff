"""Pressure on a patch that covers whole faces of some blocks and parts of others: airbags, bearings, water."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import finite
from limitmason.errors import InputError
from limitmason.geometry.polygon import clip_convex, polygon_area_centroid
from limitmason.geometry.polyhedron import face_plane
from limitmason.model.input import read_vector

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly


_PARALLEL = np.cos(np.deg2rad(1.0))
NEAR = 1e-6  # of the patch's size: faces this near to its plane lie in it


class Patch(NamedTuple):
    """A flat convex polygon: corners [m], outward normal, size [m], and axes in its plane, shape (2, 3)."""

    corners: Array
    normal: Array
    size: float
    axes: Array

    def holds(self, points: Array) -> Any:
        """Whether points lie in its plane, over their last axis but one."""
        return np.abs((points - self.corners[0]) @ self.normal).max(axis=-1) <= NEAR * self.size

    def clipped(self, face: Array) -> Array:
        """The part of a face within it, in its axes from its first corner."""
        return clip_convex((face - self.corners[0]) @ self.axes.T, (self.corners - self.corners[0]) @ self.axes.T)

    def missed(self, what: str) -> InputError:
        """The error that nothing lies in it."""
        n = self.normal
        return InputError(
            f"no {what} lies in the patch with corners {self.corners.tolist()} and outward normal "
            f"({n[0]:.3g}, {n[1]:.3g}, {n[2]:.3g}): give the corners counter-clockwise seen from outside"
        )


def read_patch(corners: ArrayLike) -> Patch:
    """A patch by its corners, counter-clockwise seen from outside [m], shape (k, 3).

    Raises
    ------
    InputError
        When they are no flat convex polygon.
    """
    p = np.array([read_vector(f"corners[{k}] of the patch", c) for k, c in enumerate(np.atleast_2d(corners))])
    if len(p) < 3:
        raise InputError(f"a patch needs at least three corners, got {len(p)}")
    r = p - p[0]
    size = float(np.linalg.norm(r, axis=1).max())
    area = 0.5 * np.cross(r[1:-1], r[2:]).sum(axis=0)
    length = float(np.linalg.norm(area))
    if length <= 1e-12 * size**2:
        raise InputError("the corners of the patch lie on one line")
    normal = area / length
    edges = np.roll(p, -1, axis=0) - p
    turns = np.cross(edges, np.roll(edges, -1, axis=0)) @ normal
    if np.abs(r @ normal).max() > NEAR * size or turns.min() < -NEAR * size**2:
        raise InputError("the corners of the patch must be a flat convex polygon, in order around it")
    first = p[1] - p[0]
    first = first / np.linalg.norm(first)
    return Patch(p, normal, size, np.stack([first, np.cross(normal, first)]))


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
    patch = read_patch(corners)
    load = -finite("pressure", pressure) * patch.normal if traction is None else read_vector("traction", traction)
    wrench, total = np.zeros((assembly.n_blocks, 6)), 0.0
    for i, block in enumerate(assembly.blocks):
        for face in block.faces:
            if not patch.holds(face) or face_plane(face)[0] @ patch.normal < _PARALLEL:
                continue
            left = patch.clipped(face)
            area, centre = polygon_area_centroid(left) if len(left) > 2 else (0.0, np.zeros(2))
            if area <= NEAR**2 * patch.size**2:
                continue
            force = load * area
            arm = patch.corners[0] + centre @ patch.axes - assembly.centroids[i]
            wrench[i] += np.concatenate([force, np.cross(arm, force)])
            total += area
    if total == 0.0:
        raise patch.missed("face of a block")
    return wrench, total
