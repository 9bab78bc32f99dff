"""Pressure on a patch that covers whole faces of some blocks and parts of others: airbags, bearings, water."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.geometry.polygon import clip_convex, polygon_area_centroid
from limitmason.geometry.polyhedron import face_plane
from limitmason.model.applied_forces import AppliedForces
from limitmason.model.face_touch import outer_faces_of
from limitmason.model.input import read_list, read_vector
from limitmason.model.pressure import Pressure

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly


_PARALLEL = np.cos(np.deg2rad(1.0))  # chosen: faces turned by less look the way of the patch
_FLAT = 1e-12  # of the patch's size squared: an area below it is rounding
NEAR = 1e-6  # of the patch's size: faces this near to its plane lie in it


class Patch(NamedTuple):
    """A flat convex polygon.

    Parameters
    ----------
    corners : counter-clockwise about the normal [m], shape (k, 3)
    normal : outward unit normal, shape (3,)
    size : largest distance of a corner from the first [m]
    axes : unit vectors in its plane that make a right-handed frame with the normal, shape (2, 3)
    """

    corners: Array
    normal: Array
    size: float
    axes: Array

    def holds(self, points: Array, slack: float = 0.0) -> Any:
        """Whether points lie in its plane, one answer for each n of them.

        Parameters
        ----------
        points : [m], shape (..., n, 3)
        slack : distance from the plane up to which they lie in it, beyond rounding [m]
        """
        return np.abs((points - self.corners[0]) @ self.normal).max(axis=-1) <= max(NEAR * self.size, slack)

    def clipped(self, face: Array) -> Array:
        """The part of a face within it [m], shape (m, 2).

        It is in the patch's axes from its first corner. The face is [m], shape (n, 3).
        """
        return clip_convex((face - self.corners[0]) @ self.axes.T, (self.corners - self.corners[0]) @ self.axes.T)

    def missed(self, what: str) -> InputError:
        """The error that nothing of a kind, such as "face of a block", lies in it."""
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
    given = read_list("corners of the patch", corners)
    p = np.array([read_vector(f"corners[{k}] of the patch", c) for k, c in enumerate(given)]).reshape(-1, 3)
    # a corner that is given again right after itself, or at the end, is one
    p = p[np.any(p != np.roll(p, 1, axis=0), axis=1)]
    if len(p) < 3:
        raise InputError(f"a patch needs at least three corners, got {len(p)}")
    r = p - p[0]
    size = float(np.linalg.norm(r, axis=1).max())
    # the vector area points along the normal
    vector = 0.5 * np.cross(r[1:-1], r[2:]).sum(axis=0)
    area = float(np.linalg.norm(vector))
    if area <= _FLAT * size**2:
        raise InputError("the corners of the patch lie on one line")
    normal = vector / area
    edges = np.roll(p, -1, axis=0) - p
    following = np.roll(edges, -1, axis=0)
    turns = np.cross(edges, following) @ normal
    # a star turns round twice and more
    rounds = np.arctan2(turns, (edges * following).sum(axis=1)).sum() / (2.0 * np.pi)
    # of a convex polygon no edge turns to the right
    if np.abs(r @ normal).max() > NEAR * size or turns.min() < -NEAR * size**2 or rounds > 1.5:
        raise InputError("the corners of the patch must be a flat convex polygon, in order around it")
    first = p[1] - p[0]
    first = first / np.linalg.norm(first)
    return Patch(p, normal, size, np.stack([first, np.cross(normal, first)]))


def patch_forces(assembly: "Assembly", corners: ArrayLike, pressure: Pressure) -> tuple[AppliedForces, float]:
    """Forces of a pressure on a flat patch, on the blocks whose faces lie in it.

    Every face in the plane of the patch, within the tolerance of contacts, is clipped to it, and the pressure is
    integrated over what is left.

    Parameters
    ----------
    assembly : whose blocks are loaded
    corners : of the patch, convex, counter-clockwise seen from outside the wall [m], shape (k, 3); its outward normal
        is that of the faces it loads
    pressure : pushes into the faces

    Returns
    -------
    forces : of the blocks
    area : of the faces in the patch [m2], less than that of the patch where it overhangs the wall

    Raises
    ------
    InputError
        When the corners are not a flat convex polygon, no face lies in it, or it lies above the pressure's level.

    Notes
    -----
    Faces that another block covers are loaded too if they lie in the patch: draw it over the free surface only.
    """
    patch = read_patch(corners)
    forces, total, loaded = AppliedForces.none(assembly), 0.0, False
    for i in range(assembly.n_blocks):
        for face in outer_faces_of(assembly, i):
            if not patch.holds(face, assembly.tolerance) or face_plane(face)[0] @ patch.normal < _PARALLEL:
                continue
            left = patch.clipped(face)
            area = polygon_area_centroid(left)[0] if len(left) > 2 else 0.0
            # a face that only touches the patch leaves a sliver of rounding
            if area <= NEAR**2 * patch.size**2:
                continue
            loaded |= pressure.press(forces, i, patch.corners[0] + left @ patch.axes, patch.normal)
            total += area
    if total == 0.0:
        raise patch.missed("face of a block")
    if not loaded:
        raise InputError(f"the patch lies above the level {pressure.level:g} m: nothing presses on it")
    return forces, total
