"""Blocks on elastic joints: K = A k A^T from contact points, all closed or as a state has left them.

Blocks that deform have shapes beside their motion, with a stiffness and a mass of their own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from limitmason.arrays import Array, Flags
from limitmason.checks import choice
from limitmason.deformable import SOLID, STATES, Body
from limitmason.deformable.levels import RIGID, RITZ, SIMPLY_DEFORMABLE
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.contact_points import contact_points as points_of
from limitmason.mechanics.default_stiffness import joint_stiffness
from limitmason.mechanics.equilibrium import degrees_of_freedom
from limitmason.mechanics.joint_shapes import shapes_of, soft_block_warnings
from limitmason.mechanics.law_table import refuse_ties
from limitmason.mechanics.plane import Plane, find_plane
from limitmason.mechanics.stiffness_matrix import stiffness_matrix
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.vibration.system import VibratingSystem

Grid = tuple[int, int]

_SLIDES = 1.0 - 1e-6  # of the shear strength: a point at it slides; solvers leave less than the millionth
_OPEN = 1e-9  # of the largest force: a point with less, and no tension, bears nothing
# chosen
_NEARER, _HELD = 1e-6, 1e-3  # of a distance, and of the size: what decides between boxes that are equally near
_OUTSIDE = 1e-2  # of the size of the structure: a point farther from all boxes lies in no block


@dataclass(frozen=True, eq=False)
class BlockCarrier:
    """How shapes of blocks move points.

    A shape has displacement, rotation about the centroid and coordinates of what deforms for every block, (n, 6 + k).

    Parameters
    ----------
    assembly : the blocks
    shapes : of each that deforms, None of rigid ones; empty where all are rigid
    """

    assembly: Assembly
    shapes: Sequence[Body | None] = ()

    @property
    def places(self) -> Array:
        """Centroids [m], shape (n, 3)."""
        return self.assembly.centroids

    @property
    def masses(self) -> Array:
        """Of the blocks, those wholly held included [kg], shape (n,)."""
        return self.assembly.arrays.mass

    @property
    def moving(self) -> Flags:
        """Blocks that are not wholly held, shape (n,)."""
        return ~self.assembly.fixed

    def at(self, shape: Array, points: Array) -> Array:
        """Displacement of points [m], shape (p, 3).

        A point goes with the block whose bounding box holds it, or is nearest: u = u_b + theta_b x (x - x_b), and the
        displacement by its shapes where the block deforms.

        Parameters
        ----------
        shape : (u, theta, coordinates of shapes) of every block [m, rad], shape (n, 6 + k)
        points : places in the reference state [m], shape (p, 3)

        Raises
        ------
        InputError
            For a point farther from all boxes than a hundredth of the structure.
        """
        bounds = np.array([b.bounds for b in self.assembly.blocks])
        # of every point from every box along the axis where it is farthest, negative inside [m], shape (p, n)
        outside = np.maximum(bounds[:, 0] - points[:, None], points[:, None] - bounds[:, 1]).max(axis=2)
        size = float(np.ptp(bounds.reshape(-1, 3), axis=0).max())
        # where boxes touch, the block that moves and whose centre is nearer carries the point: the two small terms
        # decide between boxes that are equally near, and never over a real distance
        gap = np.maximum(outside, 0.0) + _NEARER * np.linalg.norm(points[:, None] - self.places, axis=2)
        gap[:, self.assembly.fixed] += _HELD * size
        owner = np.argmin(gap, axis=1)
        far = outside[np.arange(len(points)), owner] > _OUTSIDE * size
        if far.any():
            x = points[int(np.argmax(far))]
            raise InputError(f"point ({x[0]:g}, {x[1]:g}, {x[2]:g}) lies in no block")
        u = shape[owner]
        out = np.asarray(u[:, :3] + np.cross(u[:, 3:6], points - self.places[owner]))
        for i in np.unique(owner) if self.shapes else ():
            if (own := self.shapes[i]) is not None:
                mine = owner == i
                out[mine] += np.einsum("mki,k->mi", own.displacement(points[mine]), shape[i, 6 : 6 + own.count])
        return out


def closed_system(
    assembly: Assembly,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 4),
    contact_model: str = "grid",
    stiffness: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
    blocks: str = RIGID,
    stress: str = SOLID,
) -> VibratingSystem:
    """Blocks whose joints are closed over their whole faces and stick.

    Parameters
    ----------
    assembly : the blocks; their materials count where they deform
    contact_points, contact_model : see :func:`limitmason.mechanics.contact_points.contact_points`; from three points on
        a side joints bend as their faces do, with two their bending stiffness is three times too large
    stiffness : see :func:`limitmason.mechanics.default_stiffness.joint_stiffness`
    blocks : "rigid"; "simply deformable", with the shapes of the DEM's blocks that deform; "ritz", bodies in
        polynomials, which have modes of their own
    stress : of blocks that deform: "solid"; "plane stress" or "plane strain", of which only motions in the plane of the
        problem are found

    Raises
    ------
    InputError
        What :func:`limitmason.mechanics.joint_shapes.shapes_of` refuses, unknown names, a plane state of rigid blocks
        or of a problem in no plane.
    """
    choice("blocks", blocks, (RIGID, SIMPLY_DEFORMABLE, RITZ))
    choice("stress", stress, STATES)
    dead, plane = Loads.weight(assembly), None
    if stress != SOLID:
        plane = find_plane(assembly, dead)
        if blocks == RIGID or plane is None:
            why = "rigid blocks have no stress" if blocks == RIGID else "this problem is in no plane"
            raise InputError(f"stress={stress!r} is for blocks that deform in a plane: {why}")
    points = points_of(assembly, contact_model=contact_model, grid=contact_points, plane=plane, elastic=True)
    kn, ks, told = joint_stiffness(assembly, dead.dead, stiffness)
    components = np.column_stack([kn, *[ks] * (points.components - 1)])[points.interface]
    warnings = (*told, *["the frequencies are meaningless"] * bool(told), *soft_block_warnings(assembly, kn, blocks))
    label = f"{'' if blocks == RIGID else blocks + ' '}blocks on closed joints"
    shapes = None if blocks == RIGID else shapes_of(assembly, blocks, stress, None if plane is None else plane.normal)
    return block_system(assembly, points, components, label, warnings, plane, shapes, blocks)


def state_stiffness(
    normal: Array, shear: Array, limit: Array, tension: Array, kn: Array, ks: Array, sliding: str
) -> tuple[Array, str]:
    """Stiffness (kn, ks, ks) per point of a state [Pa/m], shape (m, 3), and a text.

    The text says how many points are open and slide.

    Parameters
    ----------
    normal : forces of the points, compression positive [N], shape (m,)
    shear : the size of their shear [N], shape (m,)
    limit : shear strength of the points at those forces [N], shape (m,)
    tension : tensile strength that the points still have [N], shape (m,)
    kn, ks : of the points [Pa/m], shape (m,)
    sliding : "sticks", since a point that slides back sticks at first, or "drops" for no shear stiffness there

    Notes
    -----
    A point without force is open and carries nothing, unless it can bear tension: then it is at rest and holds both
    ways. Vibrations are taken so small that none opens or closes.
    """
    choice("sliding", sliding, ("sticks", "drops"))
    scale = float(np.abs(normal).max(initial=0.0))
    is_open = (np.abs(normal) + shear <= _OPEN * scale) & ~(tension > 0.0)
    # a point of no strength that bears nothing is open, not sliding
    slides = ~is_open & (shear >= _SLIDES * limit)
    kept = np.where(is_open | (slides & (sliding == "drops")), 0.0, ks)
    text = f"{int(is_open.sum())} of {len(normal)} points open, {int(slides.sum())} slide"
    return np.column_stack([np.where(is_open, 0.0, kn), kept, kept]), text


def block_system(
    assembly: Assembly,
    points: ContactPoints,
    stiffness: Array,
    label: str,
    warnings: tuple[str, ...] = (),
    plane: Plane | None = None,
    shapes: Sequence[Body | None] | None = None,
    blocks: str = RIGID,
) -> VibratingSystem:
    """Stiffness and mass of blocks on springs at contact points.

    K = A k A^T, and M is that of rigid motions and shapes.

    Parameters
    ----------
    assembly : the blocks
    points : contact points of its joints, m of them
    stiffness : per area, of normal and two tangents [Pa/m], shape (m, 3); of normal and one in plane, (m, 2)
    plane : in which blocks move, where points come with one
    shapes, blocks : of blocks that deform, and their kind, which says how joint points take them up; none by default
    label : what the stiffness is of, in words
    warnings : what a reader must be told

    Raises
    ------
    InputError
        When a free block has no mass.
    NotApplicable
        For an assembly with ties: their stiffness is not in the system.
    """
    refuse_ties(assembly, "a small vibration", "leave the ties out: assembly.with_ties(())")
    x = assembly.arrays
    # rigid motions of a block, six or those of the plane, and which of them are free
    basis, kept = degrees_of_freedom(assembly, plane)
    free = kept.ravel()
    moving = ~assembly.held.all(axis=1)
    if (moving & ~(x.mass > 0.0)).any():
        name = assembly.blocks[int(np.flatnonzero(moving & ~(x.mass > 0.0))[0])].name
        raise InputError(f"block {name!r} has no mass: natural frequencies need a positive density")
    inertia = np.zeros((assembly.n_blocks, 6, 6))
    inertia[:, :3, :3] = x.mass[:, None, None] * np.eye(3)
    inertia[:, 3:, 3:] = x.inertia
    masses = list(basis.T @ inertia @ basis)
    _, k = stiffness_matrix(assembly, points, stiffness, plane, shapes, blocks)
    counts = np.zeros(assembly.n_blocks, np.intp)  # shapes of every block
    if shapes is not None:
        counts = np.array([0 if s is None else s.count for s in shapes])
        free = np.concatenate([free, np.ones(counts.sum(), bool)])
        masses += [s.mass for s in shapes if s is not None]
    mass = sparse.csc_array(sparse.block_diag(masses, format="csc"))[free][:, free]
    unit = np.zeros((len(free), 3))
    # rigid motions of all blocks along x, y and z, which tell the participating mass
    unit[: kept.size] = np.tile(basis[:3].T, (assembly.n_blocks, 1))
    # which shapes every block has, of the most that one has
    place = np.arange(counts.max(initial=0)) < counts[:, None]

    if plane is not None:
        across = ", ".join(f"{v:g}" for v in np.round(plane.normal, 6) + 0.0)
        note = f"only motions in the plane across ({across}) are found: those out of it may be lower"
        warnings = (*warnings, note)
    total = (x.mass[:, None] * ~assembly.held[:, :3]).sum(axis=0)
    return VibratingSystem(
        stiffness=sparse.csc_array(k[free][:, free]), mass=sparse.csc_array(mass),
        excited=np.asarray(mass @ unit[free]), spread=partial(_spread, free, basis, place),
        carrier=BlockCarrier(assembly, shapes or ()), total=np.asarray(total, dtype=np.float64), label=label,
        solve=None, warnings=warnings,
    )


def _spread(free: Flags, basis: Array, place: Flags, vector: Array) -> Array:
    """Motion of all blocks from a vector of the free unknowns, shape (n, 6 + m).

    A row is (u, theta, coordinates of shapes) of a block.

    Parameters
    ----------
    free : which of all unknowns are free, first d rigid ones of every block, then all coordinates of shapes
    basis : rigid motion (u, theta) per degree of freedom, shape (6, d)
    place : which of the m most coordinates a block has, shape (n, m)
    vector : values of the free unknowns, shape (r,)
    """
    out = np.zeros(free.size)
    out[free] = vector
    rigid = len(place) * basis.shape[1]
    deformed = np.zeros(place.shape)
    deformed[place] = out[rigid:]
    return np.hstack([out[:rigid].reshape(-1, basis.shape[1]) @ basis.T, deformed])
