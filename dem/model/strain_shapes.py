"""Blocks that deform in modes: from their shapes to the arrays of the kernel, masses that keep the step, stresses.

Throughout, ``dt`` is the step [s] and ``safety`` the fraction of the stable step that it is [-]. ``mass`` [kg] and
``inertia`` [kg m2] of the blocks have shapes (n,) and (n, 3, 3); ``modes``, ``points`` and ``joints`` are all of them.
"""

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from dem.kernels import LAW, BlockModes, Joints, Points
from dem.model.stable_step import largest_squares, owners, springs_of_blocks
from limitmason.arrays import Array, Flags, Index
from limitmason.checks import choice
from limitmason.deformable import SOLID, STATES, Body, simply_deformable_blocks
from limitmason.deformable.levels import RIGID, SIMPLY_DEFORMABLE
from limitmason.deformable.polynomial_body import products
from limitmason.errors import InputError
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors
from limitmason.mechanics.joint_shapes import face_motions, motion_at
from limitmason.mechanics.plane import Plane, find_plane
from limitmason.model import Assembly, Loads

LEVELS = (RIGID, SIMPLY_DEFORMABLE)
"""How the blocks of a run deform."""

SAME_STIFFNESS = 1e-9
"""Difference of two modes' stiffnesses, over the largest, up to which they are one and rounding would choose modes."""

ROUNDING = 1e-3
"""Part by which a squared frequency may lie beyond what the step carries without more mass [-]."""

WEIGHTS = (1.0, 2.0, 3.0)
"""Weights of the axes of a block by which modes of one stiffness are told apart: any three that differ."""


def plane_of(
    assembly: Assembly, loads: Loads, blocks: str, stress: str, driven: np.ndarray | None = None
) -> Plane | None:
    """Plane that a run needs for the state of stress asked for, None in space.

    Parameters
    ----------
    assembly, loads : blocks, and the loads that must lie in the plane too
    blocks, stress : kind of blocks and state of stress by name
    driven : twists that drives prescribe, shape (k, 6); None without drives

    Raises
    ------
    InputError
        For an unknown kind of blocks or state of stress, a state of stress of rigid blocks, and a problem in no plane.
    """
    choice("blocks", blocks, LEVELS)
    choice("stress", stress, STATES)
    if stress == SOLID:
        return None
    if blocks == RIGID:
        raise InputError(f"stress={stress!r} is for blocks='simply deformable': rigid blocks have no stress")
    plane = find_plane(assembly, loads, driven)
    if plane is None:
        raise InputError(
            f"stress={stress!r} needs blocks, joints, supports, loads and drives that are symmetric about one plane; "
            "take this problem in space"
        )
    return plane


def out_of_plane(plane: Plane) -> Flags:
    """Freedoms that leave a plane whose normal is a global axis, shape (6,).

    They are the displacement along the normal and the turns about the two other axes. Other planes are refused.
    """
    axis = np.abs(plane.normal) > 1.0 - 1e-9  # but for rounding
    if not axis.any():
        raise InputError("the plane of the problem is turned against the axes: leave plane out, or turn the assembly")
    return np.concatenate([axis, ~axis])


@dataclass(frozen=True, eq=False)
class StrainShapes:
    """Shapes of all blocks, fixed in a run, in the kernel's coordinates; 0 if rigid.

    Parameters
    ----------
    coefficients, axes, half : of the shapes, see :class:`limitmason.deformable.Body`, (n, m, 3, e), (n, 3, 3), (n, 3)
    powers : of the polynomials, shape (e, 3)
    mean, gradient : stress at the centroid [Pa] and its gradient [Pa/m] per unit of a coordinate, block axes,
        shapes (n, m, 3, 3), (n, m, 3, 3, 3)
    reach : largest displacement of a corner per unit of a coordinate [m], shape (n, m)
    normal : of the plane, shape (3,); zero in space
    state : "solid", "plane stress" or "plane strain"
    """

    coefficients: Array
    axes: Array
    half: Array
    powers: Index
    mean: Array
    gradient: Array
    reach: Array
    normal: Array
    state: str

    def arrays(self) -> dict[str, Array]:
        """All of it as arrays by name."""
        return {f"deformation.{f.name}": np.asarray(getattr(self, f.name)) for f in fields(self)}

    @property
    def plane(self) -> bool:
        """Whether the blocks deform in a plane."""
        return bool(self.normal.any())

    def displacement(self, block: Index, arm: Array) -> Array:
        """Displacement of every shape at places in blocks, shape (p, 3, m).

        Parameters
        ----------
        block : number of the block, shape (p,)
        arm : place from its centroid [m], shape (p, 3)
        """
        out = np.zeros((len(block), 3, self.reach.shape[1]))
        for i in np.unique(block):
            if self.coefficients[i].any():
                mine = block == i
                value, _ = products(arm[mine] @ self.axes[i].T / self.half[i], self.powers)
                out[mine] = np.einsum("pe,kce,ci->pik", value, self.coefficients[i], self.axes[i], optimize=True)
        return out


class BlockStress(NamedTuple):
    """Stress of every block, tension positive, global axes as the block lies now.

    Parameters
    ----------
    mean : over the volume [Pa], shape (n, 3, 3); zero where a block is rigid
    gradient : of the linear part, sigma(x) = mean + gradient . (x - centroid) [Pa/m], shape (n, 3, 3, 3)
    """

    mean: Array
    gradient: Array

    def at(self, block: int, arm: Array) -> Array:
        """Stress [Pa], shape (k, 3, 3), at places ``arm`` from the centroid [m], (k, 3)."""
        return np.asarray(self.mean[block] + np.einsum("ijp,kp->kij", self.gradient[block], np.atleast_2d(arm)))


def block_stresses(deformation: StrainShapes, modes: BlockModes, rotation: Array) -> BlockStress:
    """Stress of every block, tension positive, along global axes.

    Parameters
    ----------
    deformation, modes : shapes of all blocks, and their coordinates now
    rotation : matrix of every block from the reference position, shape (n, 3, 3)
    """
    mean = np.einsum("nk,nkij->nij", modes.value, deformation.mean)
    slope = np.einsum("nk,nkijp->nijp", modes.value, deformation.gradient)
    r = rotation
    # turned with the block: R S R^T, and the gradient along the turned axes
    return BlockStress(
        r @ mean @ np.swapaxes(r, 1, 2), np.asarray(np.einsum("nai,nbj,ncp,nijp->nabc", r, r, r, slope, optimize=True))
    )


def frames(joints: Joints) -> tuple[Array, Array]:
    """Frames of joints, rows t1, t2, n, in reference axes of a and of b, (k, 3, 3)."""
    turn = rotation_matrices(rotation_vectors(joints.turn))
    return joints.frame, np.asarray(joints.frame @ np.swapaxes(turn, 1, 2))


def sides(deformation: StrainShapes, points: Points, joints: Joints) -> tuple[Array, Array]:
    """Motion of both faces of every joint by a unit of every shape, (k, m, 6) each.

    They are ``side_a`` and ``side_b`` of the kernel for k joints, and m shapes of a block, those of all in
    ``deformation``: displacement and rotation along t1, t2, n. A joint takes up six motions of a face, in a plane those
    in it, see :func:`limitmason.mechanics.joint_shapes.face_motions`.
    """
    frame_a, frame_b = frames(joints)
    whole = np.where(joints.law[:, LAW.cross] != 0.0, 0.0, 1.0)[:, None, None]  # at crossing edges blocks are rigid
    owner, place = owners(joints), np.column_stack([points.s, points.t])
    # motions of a face that count: in a plane displacements in it and the turn about its normal
    kept = np.tile(np.eye(6), (len(frame_a), 1, 1))
    if deformation.plane:
        across = frame_a @ deformation.normal
        turn = across[:, :, None] * across[:, None, :]
        kept[:, :3, :3] -= turn
        kept[:, 3:, 3:] = turn
    out = []
    for block, arm, frame in ((joints.block_a, joints.arm_a, frame_a), (joints.block_b, joints.arm_b, frame_b)):
        axes = frame[owner]
        u = deformation.displacement(block[owner], arm[owner] + np.einsum("xt,xti->xi", place, axes[:, :2]))
        moved = kept @ face_motions(joints.start, place, points.area, axes @ u)  # (k, 6, m), of u (points, 3, m)
        out.append(np.ascontiguousarray(whole * moved.transpose(0, 2, 1)))
    return out[0], out[1]


@dataclass(frozen=True, eq=False)
class Start:
    """Shapes of the blocks that deform, before a run chooses its coordinates."""

    deformation: StrainShapes  # of all blocks
    shapes: dict[int, Body]  # by number of the block

    @classmethod
    def of(cls, assembly: Assembly, stress: str, plane: Plane | None) -> "Start":
        """Shapes of the blocks that have a material.

        Arrays are as wide as the block with the most shapes. A block without a material keeps zeros: nothing deforms.

        Parameters
        ----------
        stress : "solid", "plane stress" or "plane strain"
        plane : of the problem; None in space

        Raises
        ------
        InputError
            What :func:`limitmason.deformable.simply_deformable_blocks` refuses, and a plane state without a plane.
        """
        if (stress != SOLID) != (plane is not None):
            raise InputError(f"stress={stress!r} does not go with a problem {'in a plane' if plane else 'in space'}")
        every = simply_deformable_blocks(assembly, stress, None if plane is None else plane.normal)
        shapes = {i: x for i, x in enumerate(every) if x is not None}
        n, m = len(every), max(x.count for x in shapes.values())
        powers = next(iter(shapes.values())).powers  # of the polynomials, the same for all blocks
        out = StrainShapes(
            coefficients=np.zeros((n, m, 3, len(powers))), axes=np.tile(np.eye(3), (n, 1, 1)), half=np.ones((n, 3)),
            powers=powers, mean=np.zeros((n, m, 3, 3)), gradient=np.zeros((n, m, 3, 3, 3)), reach=np.zeros((n, m)),
            normal=np.zeros(3) if plane is None else plane.normal.copy(), state=stress,
        )
        for i, shape in shapes.items():
            out.coefficients[i], out.axes[i], out.half[i] = shape.coefficients, shape.axes, shape.half
            out.mean[i], out.gradient[i] = shape.linear_stress(assembly.blocks[i])
        return cls(out, shapes)

    def modes(
        self, assembly: Assembly, points: Points, joints: Joints, coupled: Array | None, axes: Array
    ) -> tuple[StrainShapes, BlockModes]:
        """Shapes turned into modes that share neither stiffness nor mass, and these at rest, each of unit mass.

        Parameters
        ----------
        assembly, points, joints : blocks, and what lies between them
        coupled : K_joints of :func:`coupled_of`, for scaled masses K_mode + 2 K_joints; None for the real ones
        axes : of the blocks, along which modes of one stiffness are told apart, shape (n, 3, 3)
        """
        d = self.deformation
        n, m = d.reach.shape
        stiffness, inv_mass, gradient = np.zeros((n, m)), np.zeros((n, m)), np.zeros((n, m, 3, 3))
        new = replace(d, coefficients=d.coefficients.copy(), mean=d.mean.copy(), gradient=d.gradient.copy())
        for i, shape in self.shapes.items():
            k = shape.stiffness
            # K x = value M x, M their own mass or what the stable step asks for; six rigid motions come before shapes
            value, basis = eigh(k, shape.mass if coupled is None else k + 2.0 * coupled[i, 6:, 6:])
            x = assembly.blocks[i].vertices - assembly.centroids[i]
            corners = d.displacement(np.full(len(x), i), x).transpose(0, 2, 1) @ axes[i].T
            value, basis = _told_apart(value, basis, corners)
            stiffness[i], inv_mass[i] = np.maximum(value, 0.0), 1.0
            for array in (new.coefficients, new.mean, new.gradient):
                array[i] = np.tensordot(basis.T, array[i], axes=1)
            gradient[i] = np.tensordot(basis.T, shape.mean_gradient, axes=1)
            new.reach[i] = np.linalg.norm(new.displacement(np.full(len(x), i), x), axis=1).max(axis=0)
        zero = np.zeros((n, m))
        side_a, side_b = sides(new, points, joints)
        return new, BlockModes(
            value=zero, rate=zero.copy(), stiffness=stiffness, mass=np.ones((n, m)), inv_mass=inv_mass,
            gradient=gradient, contact=zero.copy(), load=zero.copy(), net=zero.copy(), side_a=side_a, side_b=side_b,
        )


def _told_apart(value: Array, basis: Array, corners: Array) -> tuple[Array, Array]:
    """Modes of a block of which those of one stiffness are chosen by its own axes.

    Rounding would choose others. Each is damped by the sign of its own rate, so that the choice moves the answer.

    Parameters
    ----------
    value : eigenvalues, ascending, shape (m,)
    basis : eigenvectors as columns, shape (m, m)
    corners : displacement of the corners along the axes of the block per unit of a shape, shape (p, m, 3)
    """
    weighed = corners * np.sqrt(WEIGHTS)
    form = np.einsum("pkc,plc->kl", weighed, weighed)
    value, basis = value.copy(), basis.copy()
    last = np.flatnonzero(np.diff(value) > SAME_STIFFNESS * np.abs(value).max()) + 1
    for alike in np.split(np.arange(len(value)), last):
        if len(alike) > 1:
            chosen = eigh(basis[:, alike].T @ form @ basis[:, alike])[1]
            basis[:, alike] = basis[:, alike] @ chosen
            value[alike] = value[alike] @ chosen**2
    return value, basis


def coupled_of(shapes: StrainShapes, points: Points, joints: Joints, moves: Flags) -> Array:
    """Stiffness of every block's rigid motions and shapes when it alone moves.

    Joints are closed, frames those of the time a joint was made. The shape is (n, 6 + m, 6 + m).

    Parameters
    ----------
    shapes : of all blocks
    moves : which rigid motions a block has, shape (6,)
    """
    out = springs_of_blocks(points, joints, len(shapes.reach), frames(joints)[1], sides(shapes, points, joints))
    out[:, :6][:, ~moves] = 0.0
    out[:, :, :6][:, :, ~moves] = 0.0
    return out


def scale_masses_of_modes(
    mass: Array, inertia: Array, modes: BlockModes, coupled: Array, dt: float, safety: float
) -> None:
    """Write scaled masses of modes, and of blocks as far as modes make these faster.

    A mode of the coordinates of :meth:`Start.modes` has K_mode + 2 K_joints = 1 and so a mass dt^2 / (4 safety^2);
    what rigid motions and modes share is met by a factor on all masses of the block.

    Parameters
    ----------
    coupled : stiffness of :func:`coupled_of`, shape (n, 6 + m, 6 + m)
    """
    allowed = 4.0 * safety**2 / dt**2  # squared frequency that the step carries
    modes.mass[:] = 1.0 / allowed
    rows, squares = _squares_of(mass, inertia, modes, coupled)
    factor = np.maximum(squares / allowed, 1.0)
    mass[rows] *= factor
    inertia[rows] *= factor[:, None, None]
    modes.mass[rows] *= factor[:, None]
    modes.inv_mass[rows] = 1.0 / modes.mass[rows]


def fastest_of(mass: Array, inertia: Array, modes: BlockModes, coupled: Array) -> float:
    """Half of the largest w^2 of blocks that deform [1/s2], 0 without such blocks.

    It is the ``top`` of :func:`.stable_step`, w^2 that of :func:`_squares_of`, ``coupled`` that of :func:`coupled_of`.
    """
    return 0.5 * float(_squares_of(mass, inertia, modes, coupled)[1].max(initial=0.0))


def relative_deformation(deformation: StrainShapes, modes: BlockModes, joints: Joints, points: Points) -> Array:
    """Displacement of b's face against a's by deformation at points [m], shape (p, 3).

    It is along t1, t2, n. The joints have just been made: their two sides have not turned against each other.
    """
    side_a, side_b = sides(deformation, points, joints)
    change = (modes.value[joints.block_b][:, None] @ side_b - modes.value[joints.block_a][:, None] @ side_a)[:, 0]
    return np.asarray(motion_at(np.column_stack([points.s, points.t])) @ change[owners(joints)][:, :, None])[:, :, 0]


def with_joints(deformation: StrainShapes, modes: BlockModes, points: Points, joints: Joints) -> BlockModes:
    """These coordinates of shapes between other ``joints`` and their ``points``."""
    side_a, side_b = sides(deformation, points, joints)
    return modes._replace(side_a=side_a, side_b=side_b)


def add_modal_mass(
    mass: Array, inv_mass: Array, inv_inertia: Array, modes: BlockModes, coupled: Array, dt: float, safety: float
) -> Array:
    """Add mass to blocks that joints found later made too stiff for the step.

    Parameters
    ----------
    mass, inv_mass, inv_inertia : of the blocks, changed, shapes (n,), (n,) and (n, 3, 3)
    modes : masses of the modes, and their rates, changed too
    coupled : stiffness of :func:`coupled_of`, shape (n, 6 + m, 6 + m)

    Returns
    -------
    factor by which every block has become heavier, shape (n,)
    """
    allowed = 4.0 * safety**2 / dt**2
    rows, squares = _squares_of(mass, np.asarray(np.linalg.inv(inv_inertia), float), modes, coupled)
    factor = np.ones(len(mass))
    factor[rows] = np.where(squares / allowed > 1.0 + ROUNDING, squares / allowed, 1.0)
    mass *= factor
    inv_mass[:] = 1.0 / mass
    inv_inertia /= factor[:, None, None]
    modes.mass[:] *= factor[:, None]
    modes.inv_mass[:] /= factor[:, None]
    # momentum stays
    modes.rate[:] /= factor[:, None]
    return factor


def _squares_of(mass: Array, inertia: Array, modes: BlockModes, coupled: Array) -> tuple[Index, Array]:
    """Blocks that deform, and the largest w^2 of each [1/s2], shapes (b,) and (b,).

    With joint stiffness doubled, M^-1 (2 K_joints + K_modes), the largest over single blocks bounds w^2 of the
    assembly. For a joint's spring is stretched by e_b - e_a, and (e_b - e_a)^2 <= 2 e_a^2 + 2 e_b^2.

    Parameters
    ----------
    modes : of all blocks, ``inv_mass`` 0 in rigid ones
    coupled : stiffness of :func:`coupled_of`, shape (n, 6 + m, 6 + m)
    """
    rows = np.flatnonzero(modes.inv_mass.any(axis=1))
    whole, k = 2.0 * coupled[rows], np.arange(6, coupled.shape[1])
    whole[:, k, k] += modes.stiffness[rows]
    return rows, largest_squares(whole, mass[rows], inertia[rows], modes.mass[rows])
