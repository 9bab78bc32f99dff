"""Blocks that deform, as the engine of capacity curves takes them: shapes at the joint points and a spring per shape.

A block's elastic energy is q' K q / 2 in the coordinates of its shapes; here they are chosen so that K is diagonal, and
reduced to what the joint points see: with W the stiffness of the points and L L' = K, the singular values of
W^(1/2) phi L^-T square to the block's compliance over that of the joints. Shapes that move no joint point carry nothing
and are left out, without any loss: that is the static condensation of a block to its joints.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from limitmason.contact_points import ContactPoints
from limitmason.deformable import PLANE_STRESS, SOLID, STATES, modal_blocks, polynomial_blocks
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.plane import Plane, find_plane

Array = NDArray[np.float64]

RIGID, LUMPED, MODAL, ELASTIC = "rigid", "lumped", "modal", "elastic"
BLOCKS = (RIGID, LUMPED, MODAL, ELASTIC)
"""How the blocks of a path deform."""

_UNSEEN = 1e-9
"""Singular value over the largest below which a shape moves no joint point."""

_EXACT = 1e-9
"""To which the points of a joint integrate a polynomial exactly."""

_HIGHEST = 3
"""Degree up to which a joint takes up the displacement of a face."""


class Shapes(Protocol):
    """Shapes of one block: modes of limitmason.deformable."""

    @property
    def count(self) -> int:
        """How many."""

    @property
    def stiffness(self) -> Array:
        """Per pair of shapes, shape (k, k)."""

    def displacement(self, points: Array) -> Array:
        """Displacement of every shape at points (m, 3), shape (m, k, 3)."""


@dataclass(frozen=True, eq=False)
class Deformation:
    """Shapes of n blocks in their coordinates, at m joint points.

    Parameters
    ----------
    shapes : of every block; None where it is rigid
    bases : coordinates of a block's shapes per reduced coordinate, shape (its k, k); None where it is rigid
    stiffness : of the reduced coordinates, which are root mean square displacements of the block's joint points [N/m],
        shape (n, k); 0 where a block has fewer
    shapes_a, shapes_b : displacement of the points of block a and b per unit of a coordinate [-], shape (m, 3, k)
    stress : state of stress
    """

    shapes: tuple[Shapes | None, ...]
    bases: tuple[Array | None, ...]
    stiffness: Array
    shapes_a: Array
    shapes_b: Array
    stress: str

    @property
    def count(self) -> int:
        """Reduced coordinates of a block, k."""
        return self.stiffness.shape[1]

    def coordinates(self, block: int, reduced: Array) -> Array:
        """Coordinates of a block's own shapes from reduced ones, shapes (..., k) to (..., its k)."""
        basis = self.bases[block]
        return np.zeros((*reduced.shape[:-1], 0)) if basis is None else np.asarray(reduced @ basis.T)

    def displacement(self, block: int, point: Array, reduced: Array) -> Array:
        """Displacement of a point of a block by reduced coordinates (..., k), axes of the block [m], shape (..., 3)."""
        shape = self.shapes[block]
        if shape is None:
            return np.zeros((*reduced.shape[:-1], 3))
        return np.asarray(self.coordinates(block, reduced) @ shape.displacement(point[None])[0])


def plane_of(assembly: Assembly, loads: Loads, blocks: str, stress: str | None) -> tuple[Plane | None, str]:
    """Plane in which a path is followed, None in space, and the state of stress of its blocks.

    Raises
    ------
    InputError
        For an unknown kind of blocks or state of stress, a state of stress of blocks that have none, and a plane state
        of a problem in no plane.
    """
    if blocks not in BLOCKS:
        raise InputError(f"blocks must be one of {', '.join(map(repr, BLOCKS))}, got {blocks!r}")
    plane = find_plane(assembly, loads)
    if blocks in (RIGID, LUMPED):
        if stress is not None:
            raise InputError(f"stress={stress!r} is for modal and elastic blocks; {blocks} ones have no stress")
        return plane, SOLID
    if stress is None:
        return plane, SOLID if plane is None else PLANE_STRESS
    if stress not in STATES:
        raise InputError(f"stress must be one of {', '.join(map(repr, STATES))}, got {stress!r}")
    if stress == SOLID:
        return None, SOLID
    if plane is None:
        raise InputError(
            f"stress={stress!r} needs blocks, joints, supports and loads that are symmetric about one plane; take this "
            "problem in space"
        )
    return plane, stress


def deformation(
    assembly: Assembly, points: ContactPoints, blocks: str, stress: str, plane: Plane | None, kn: Array, ks: Array
) -> Deformation:
    """Shapes of the blocks at the joint points.

    Parameters
    ----------
    blocks : "modal", whose points move as the shapes do there, as in the DEM; or "elastic", whose joints take up a
        face's displacement by :func:`fitted`
    kn, ks : of every interface [Pa/m]

    Raises
    ------
    InputError
        What :func:`limitmason.deformable.modal_blocks` refuses.
    """
    normal = None if plane is None else plane.normal
    shapes: Sequence[Shapes | None]
    shapes = (modal_blocks if blocks == MODAL else polynomial_blocks)(assembly, stress, normal)
    at = _at_points(assembly, points, shapes, blocks == ELASTIC)
    springs = np.column_stack([kn, *[ks] * (points.components - 1)])[points.interface] * points.area[:, None]
    bases: list[Array | None] = []
    stiffness, values = [], []
    for i, shape in enumerate(shapes):
        mine = [np.flatnonzero(b == i) for b in (points.block_a, points.block_b)]
        rows = np.concatenate(mine)
        if shape is None or not len(rows):
            bases.append(None)
            stiffness.append(np.zeros(0))
            values.append((mine, [np.zeros((len(r), 3, 0)) for r in mine]))
            continue
        phi = np.concatenate([at[side][r][:, :, : shape.count] for side, r in enumerate(mine)])  # (p, 3, k)
        seen = np.sqrt(springs[rows])[:, :, None] * (points.directions[rows] @ phi)
        root = np.linalg.cholesky(shape.stiffness)
        own = solve_triangular(root, seen.reshape(-1, shape.count).T, lower=True).T
        _, singular, axes = np.linalg.svd(own, full_matrices=False)
        axes = axes[singular > _UNSEEN * max(float(singular.max(initial=0.0)), 1e-300)]
        basis = solve_triangular(root.T, axes.T, lower=False)
        moved = phi @ basis
        size = np.sqrt((moved**2).sum(axis=1).mean(axis=0))
        bases.append(basis / size)
        stiffness.append(1.0 / size**2)
        moved = moved / size
        values.append((mine, [moved[: len(mine[0])], moved[len(mine[0]) :]]))
    count = max((len(s) for s in stiffness), default=0)
    sides = [np.zeros((points.count, 3, count)) for _ in range(2)]
    springs = np.zeros((assembly.n_blocks, count))
    for i, (mine, moved_of) in enumerate(values):
        springs[i, : len(stiffness[i])] = stiffness[i]
        basis_of = bases[i]
        if basis_of is not None:
            bases[i] = np.pad(basis_of, ((0, 0), (0, count - basis_of.shape[1])))
        for side, r, u in zip(sides, mine, moved_of, strict=True):
            side[r, :, : u.shape[2]] = u
    return Deformation(tuple(shapes), tuple(bases), springs, sides[0], sides[1], stress)


def _at_points(
    assembly: Assembly, points: ContactPoints, shapes: Sequence[Shapes | None], fit: bool
) -> tuple[Array, Array]:
    """Displacement of every shape of the blocks a and b at every point, shapes (m, 3, largest k)."""
    most = max((s.count for s in shapes if s is not None), default=0)
    out = np.zeros((points.count, 3, most)), np.zeros((points.count, 3, most))
    first = np.flatnonzero(np.diff(points.interface, prepend=-1))
    for rows in np.split(np.arange(points.count), first[1:]):
        k = int(points.interface[rows[0]])
        samples, weights = _face_points(assembly.interfaces[k].polygon) if fit else (points.position[rows], None)
        fit_matrix = None if weights is None else fitted(points, rows, samples, weights)
        for side, block in zip(out, (points.block_a[rows[0]], points.block_b[rows[0]]), strict=True):
            shape = shapes[int(block)]
            if shape is None:
                continue
            u = shape.displacement(samples)
            if fit_matrix is not None:
                u = np.tensordot(fit_matrix, u, axes=1)
            side[rows, :, : shape.count] = u.transpose(0, 2, 1)
    return out


def fitted(points: ContactPoints, rows: NDArray[np.intp], samples: Array, weights: Array) -> Array:
    """Values at a joint's points of the polynomial that is nearest to a face's displacement, (points, samples).

    By least squares over the face, of the highest degree up to 3 that the points integrate exactly over it: then
    uniform pressure at the points does the work of uniform pressure on the face, and rigid motions stay as they are. A
    force at a point acts on the block as a traction over the joint that is a polynomial of that degree.

    Parameters
    ----------
    rows : the points of the joint
    samples, weights : of a quadrature over the face [m, m2], shapes (s, 3), (s,)
    """
    centre = np.average(samples, axis=0, weights=weights)
    tangents = points.directions[rows[0], 1:]
    size = float(np.abs((samples - centre) @ tangents.T).max())
    at, over = ((x - centre) @ tangents.T / size for x in (points.position[rows], samples))
    area = points.area[rows]
    chosen = np.ones((len(rows), 1)), np.ones((len(samples), 1))
    for degree in range(1, _HIGHEST + 1):
        here, there = _monomials(at, degree), _monomials(over, degree)
        if np.abs(area @ here - weights @ there).max() > _EXACT * weights.sum():
            break
        chosen = here, there
    here, there = chosen
    normal = there.T @ (weights[:, None] * there)
    return np.asarray(here @ np.linalg.solve(normal, (weights[:, None] * there).T))


def _monomials(x: Array, degree: int) -> Array:
    """All products of the coordinates up to a degree, x of shape (m, 1) or (m, 2), shape (m, e)."""
    if x.shape[1] == 1:
        return np.asarray(x ** np.arange(degree + 1))
    return np.column_stack([x[:, 0] ** i * x[:, 1] ** j for i in range(degree + 1) for j in range(degree + 1 - i)])


def _face_points(polygon: Array) -> tuple[Array, Array]:
    """Points [m] and weights [m2] exact to degree 12 over a convex polygon: fans of collapsed Gauss squares."""
    g, w = np.polynomial.legendre.leggauss(7)
    g, w = 0.5 * (g + 1.0), 0.5 * w
    u, v = (x.ravel() for x in np.meshgrid(g, g, indexing="ij"))
    weight = np.outer(w * g, w).ravel()  # collapsed at the first corner
    x = np.asarray(polygon, float)
    a, b = x[1:-1] - x[0], x[2:] - x[0]
    twice = np.linalg.norm(np.cross(a, b), axis=1)
    places = x[0] + np.einsum("s,ti->tsi", u * (1.0 - v), a) + np.einsum("s,ti->tsi", u * v, b)
    return places.reshape(-1, 3), np.outer(twice, weight).ravel()
