"""Blocks that deform, as the engine of capacity curves takes them: shapes at the joint points and a spring per shape.

A block's elastic energy is q' K q / 2 in the coordinates of its shapes; here they are chosen so that K is diagonal, and
reduced to what the joint points see: with W the stiffness of the points and L L' = K, the singular values of
W^(1/2) phi L^-T square to the block's compliance over that of the joints. Shapes that move no joint point carry nothing
and are left out, without any loss: that is the static condensation of a block to its joints. Where forces act beside
the centroid its mean gradient is seen too, on which they work.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from limitmason.arrays import Array, Flags
from limitmason.checks import choice
from limitmason.deformable import PLANE_STRESS, SOLID, STATES, Body
from limitmason.deformable.levels import LUMPED, RIGID, RITZ, SIMPLY_DEFORMABLE
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.joint_shapes import at_joints, shapes_of
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.plane import Plane, find_plane, two_planes
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

BLOCKS = (RIGID, LUMPED, SIMPLY_DEFORMABLE, RITZ)
"""How the blocks of a path deform."""

_UNSEEN = 1e-9
"""Singular value over the largest below which a shape moves no joint point [-]: rounding leaves 1e-15 of them."""


@dataclass(frozen=True, eq=False)
class CondensedShapes:
    """Shapes of n blocks in their coordinates, at m joint points.

    Parameters
    ----------
    shapes : of every block; None where it is rigid
    bases : coordinates of a block's shapes per reduced coordinate, shape (its k, k); None where it is rigid
    stiffness : of the reduced coordinates, which are root mean square displacements of the block's joint points [N/m],
        shape (n, k); 0 where a block has fewer
    shapes_a, shapes_b : displacement of the points of block a and b per unit of a coordinate [-], shape (m, 3, k)
    gradients : mean gradient of the displacement per unit of a coordinate, reference axes [1/m], shape (n, k, 3, 3)
    blocks : "simply deformable" or "ritz"
    """

    shapes: tuple[Body | None, ...]
    bases: tuple[Array | None, ...]
    stiffness: Array
    shapes_a: Array
    shapes_b: Array
    gradients: Array
    blocks: str

    @property
    def count(self) -> int:
        """Reduced coordinates of a block, k."""
        return self.stiffness.shape[1]

    def coordinates(self, block: int, reduced: Array) -> Array:
        """Coordinates of a block's own shapes from reduced ones, shapes (..., k) to (..., its k)."""
        basis = self.bases[block]
        return np.zeros((*reduced.shape[:-1], 0)) if basis is None else np.asarray(reduced @ basis.T)

    def placed(self, turn: Array, reduced: Array) -> Array:
        """R (1 + G) - I of every block, which carries points of loads along, shape (n, 3, 3).

        G is the mean gradient of the displacement: a load strains its block as if it were spread over it.

        Parameters
        ----------
        turn : R - I, shape (n, 3, 3)
        reduced : coordinates [m], shape (n, k)
        """
        gradient = np.einsum("nk,nkij->nij", reduced, self.gradients)
        return np.asarray(turn + gradient + turn @ gradient)

    def displacement(self, block: int, point: Array, reduced: Array) -> Array:
        """Displacement of a point of a block by reduced coordinates (..., k), axes of the block [m], shape (..., 3)."""
        shape = self.shapes[block]
        if shape is None:
            return np.zeros((*reduced.shape[:-1], 3))
        return np.asarray(self.coordinates(block, reduced) @ shape.displacement(point[None])[0])


def lumped(assembly: Assembly, stiffness: float | tuple[float, float] | None) -> Assembly:
    """The assembly whose joints have the compliance of its units too.

    Raises
    ------
    InputError
        For a stiffness of joints that is given beside.
    """
    if stiffness is not None:
        raise InputError("blocks='lumped' puts the units' compliance into the joints, which stiffness= would undo")
    return with_lumped_units(assembly)


def plane_of(assembly: Assembly, loads: Loads, blocks: str, stress: str | None) -> tuple[Plane | None, str]:
    """Plane in which a path is followed, None in space, and the state of stress of its blocks.

    Parameters
    ----------
    blocks, stress : kind of blocks and state of stress by name; None for what the model allows

    Raises
    ------
    InputError
        For an unknown kind of blocks or state of stress, a state of stress of blocks that have none, and a plane state
        of a problem in no plane.
    """
    choice("blocks", blocks, BLOCKS)
    plane = find_plane(assembly, loads)
    if blocks in (RIGID, LUMPED):
        if stress is not None:
            raise InputError(f"stress={stress!r} is for blocks that deform; {blocks} ones have no stress")
        return plane, SOLID
    if stress is None:
        in_space = plane is None or two_planes(assembly, loads)
        return (None, SOLID) if in_space else (plane, PLANE_STRESS)
    choice("stress", stress, STATES)
    if stress == SOLID:
        return None, SOLID
    if plane is None:
        raise InputError(
            f"stress={stress!r} needs blocks, joints, supports and loads that are symmetric about one plane; take this "
            "problem in space"
        )
    return plane, stress


def deformation(
    assembly: Assembly, loads: Loads, points: ContactPoints, blocks: str, stress: str, plane: Plane | None, kn: Array,
    ks: Array,
) -> CondensedShapes:
    """Shapes of the blocks at the joint points, as few as the joints and the loads feel.

    With K the stiffness of a block's shapes, k the springs of its joint points and phi the displacement of these by the
    shapes, new shapes are the eigenvectors of phi^T k phi against K. Those that the joints do not feel are left out.

    Parameters
    ----------
    assembly, loads : the model; of its loads only those beside centroids count
    points : m contact points of the joints
    blocks : "simply deformable" or "ritz"
    stress, plane : state of stress by name, and the plane that it is in; None in space
    kn, ks : normal and shear stiffness of every interface [Pa/m], shape (interfaces,)

    Raises
    ------
    InputError
        What :func:`limitmason.deformable.simply_deformable_blocks` refuses.
    """
    normal = None if plane is None else plane.normal
    shapes = shapes_of(assembly, blocks, stress, normal)
    at = at_joints(assembly, points, shapes, blocks)
    springs = np.column_stack([kn, *[ks] * (points.components - 1)])[points.interface] * points.area[:, None]  # [N/m]
    # of every block: basis, stiffness of its k coordinates, and its points as block a and as block b, with their
    # displacements per coordinate, (points, 3, k)
    bases: list[Array | None] = []
    stiffness, at_points = [], []
    loaded: Flags = (loads.dead_arms != 0.0).any(axis=(1, 2)) | (loads.live_arms != 0.0).any(axis=(1, 2))
    for i, shape in enumerate(shapes):
        mine = [np.flatnonzero(b == i) for b in (points.block_a, points.block_b)]
        rows = np.concatenate(mine)
        if shape is None or not len(rows):
            bases.append(None)
            stiffness.append(np.zeros(0))
            at_points.append((mine, [np.zeros((len(r), 3, 0)) for r in mine]))
            continue
        phi = np.concatenate([at[side][r][:, :, : shape.count] for side, r in enumerate(mine)])  # (points, 3, shapes)
        # eigenvectors by singular values of k^1/2 phi L^-T, with K = L L^T
        felt = np.sqrt(springs[rows])[:, :, None] * (points.directions[rows] @ phi)
        root = np.linalg.cholesky(shape.stiffness)
        # of a block with loads beside its centroid the mean gradient times its size is seen too, as a joint would
        strained = np.cbrt(assembly.volumes[i]) * shape.mean_gradient.reshape(shape.count, 9).T * loaded[i]
        seen = np.concatenate([felt.reshape(-1, shape.count), np.sqrt(springs[rows].sum()) * strained])
        over_own = solve_triangular(root, seen.T, lower=True).T
        _, singular, axes = np.linalg.svd(over_own, full_matrices=False)
        axes = axes[singular > _UNSEEN * max(float(singular.max(initial=0.0)), 1e-300)]
        basis = solve_triangular(root.T, axes.T, lower=False)
        moved = phi @ basis
        # a coordinate is a root mean square displacement of the joint points [m], and of the ends by mean strain
        size = np.sqrt((moved**2).sum(axis=1).mean(axis=0) + ((strained @ basis) ** 2).sum(axis=0))
        bases.append(basis / size)
        stiffness.append(1.0 / size**2)
        moved = moved / size
        at_points.append((mine, [moved[: len(mine[0])], moved[len(mine[0]) :]]))
    # all blocks have as many coordinates as the one with most: the others are padded by zeros
    count = max((len(s) for s in stiffness), default=0)
    sides = [np.zeros((points.count, 3, count)) for _ in range(2)]
    of_blocks, gradients = np.zeros((assembly.n_blocks, count)), np.zeros((assembly.n_blocks, count, 3, 3))
    for i, (mine, moved_of) in enumerate(at_points):
        of_blocks[i, : len(stiffness[i])] = stiffness[i]
        basis_of, body = bases[i], shapes[i]
        if basis_of is not None and body is not None:
            bases[i] = padded = np.pad(basis_of, ((0, 0), (0, count - basis_of.shape[1])))
            gradients[i] = np.tensordot(padded.T, body.mean_gradient, axes=1)
        for side, r, u in zip(sides, mine, moved_of, strict=True):
            side[r, :, : u.shape[2]] = u
    return CondensedShapes(
        shapes=tuple(shapes), bases=tuple(bases), stiffness=of_blocks, shapes_a=sides[0], shapes_b=sides[1],
        gradients=gradients, blocks=blocks,
    )
