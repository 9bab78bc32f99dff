"""Small vibrations of an assembly whose joints are all closed: stiffness matrix, natural frequencies, mode shapes."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh

from dem.deformation import MODAL, RIGID, plane_of
from dem.joints import JointOptions, make_laws, make_points
from dem.kernels import LAW_KN, LAW_KS
from limitmason.deformable import SOLID, modal_blocks
from limitmason.equilibrium import degrees_of_freedom, equilibrium_matrix
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads

Array = NDArray[np.float64]
Grid = tuple[int, int]


class Modes(NamedTuple):
    """Natural modes of an assembly, lowest first.

    Parameters
    ----------
    frequency : [Hz], shape (k,)
    shape : displacement and rotation of every block per mode, of unit modal mass, shape (k, n_blocks, 6)
    strain : coordinates of the shapes of every block that deforms, as :func:`limitmason.deformable.modal_block` orders
        them (strains [-], curvatures [1/m]), shape (k, n_blocks, m), m = 0 where blocks are rigid
    """

    frequency: Array
    shape: Array
    strain: Array


class _Model(NamedTuple):
    """Stiffness and mass of all degrees of freedom, which are free, and how they make up the blocks' motions."""

    stiffness: sparse.csc_array
    mass: sparse.csc_array
    free: NDArray[np.bool_]
    basis: Array  # rigid motions of a block, (6, d)
    modes: int  # shapes of a block


def stiffness_matrix(
    assembly: Assembly,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 4),
    contact_model: str = "grid",
    joint_options: JointOptions | None = None,
) -> sparse.csc_array:
    """Return the stiffness matrix of rigid blocks on closed elastic joints, K = A k A^T, held ones included.

    Parameters
    ----------
    contact_points, contact_model, joint_options : see :func:`dem.make_state`

    Returns
    -------
    sparse array, shape (6 n_blocks, 6 n_blocks); row 6 i + j is degree of freedom j of block i [N/m, N, N m]

    Notes
    -----
    A is the equilibrium matrix, k holds kn and ks times the tributary areas. It is the tangent at rest only where every
    joint is closed over its whole face and nothing slides: dry walls under little load are softer. From three contact
    points on a side joints bend as their faces do; with two their bending stiffness is three times too large.
    """
    options = joint_options or JointOptions()
    return _model(assembly, contact_points, contact_model, options, RIGID, SOLID).stiffness


def natural_frequencies(
    assembly: Assembly,
    count: int = 3,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 4),
    contact_model: str = "grid",
    joint_options: JointOptions | None = None,
    blocks: str = RIGID,
    stress: str = SOLID,
) -> Modes:
    """Return the lowest natural modes of an assembly, K u = (2 pi f)^2 M u with the real masses of the blocks.

    Parameters
    ----------
    count : how many modes
    contact_points, contact_model, joint_options : see :func:`dem.make_state`
    blocks, stress : "rigid", or "modal" blocks that strain and bend, in space ("solid"), "plane stress" or "plane
        strain"; in a plane only motions in it are found

    Returns
    -------
    Modes

    Raises
    ------
    InputError
        When a free block has no mass, fewer modes exist than asked for, and what :func:`dem.make_state` refuses.

    Notes
    -----
    Joints without a stiffness of their own get the one of the DEM, which is no material property: the frequencies are
    then meaningless. Joints are closed and stick, see :func:`stiffness_matrix`.
    """
    x = assembly.arrays
    moving = ~assembly.held.all(axis=1)
    if (moving & ~(x.mass > 0.0)).any():
        name = assembly.blocks[int(np.flatnonzero(moving & ~(x.mass > 0.0))[0])].name
        raise InputError(f"block {name!r} has no mass: natural frequencies need a positive density")
    model = _model(assembly, contact_points, contact_model, joint_options or JointOptions(), blocks, stress)
    free = model.free
    if not 1 <= count < free.sum():
        raise InputError(f"count must lie between 1 and {int(free.sum()) - 1}, got {count!r}")
    # lengths of metres and rotations of radians: a start vector of ones keeps the answer the same from run to run
    k, m = model.stiffness[free][:, free], model.mass[free][:, free]
    value, vector = eigsh(sparse.csc_array(k), count, sparse.csc_array(m), sigma=0.0, v0=np.ones(int(free.sum())))
    order = np.argsort(value)
    shape = np.zeros((count, free.size))
    shape[:, free] = vector[:, order].T
    n = assembly.n_blocks
    d = model.basis.shape[1]
    rigid = shape[:, : d * n].reshape(count, n, d) @ model.basis.T
    strain = shape[:, d * n :].reshape(count, n, model.modes)
    return Modes(np.sqrt(np.maximum(value[order], 0.0)) / (2.0 * np.pi), rigid, strain)


def _model(
    assembly: Assembly,
    contact_points: Grid | Mapping[str, Grid],
    contact_model: str,
    options: JointOptions,
    blocks: str,
    stress: str,
) -> _Model:
    """Stiffness and mass matrices: rigid motions of all blocks first, then their shapes."""
    dead = Loads.weight(assembly)
    plane = plane_of(assembly, dead, blocks, stress)
    points = make_points(assembly, contact_points, contact_model, plane)
    laws, _ = make_laws(assembly, dead.dead, options)
    basis, free = degrees_of_freedom(assembly, plane)
    a = equilibrium_matrix(assembly, points, plane=plane)
    stiff = laws[points.interface][:, [LAW_KN, *[LAW_KS] * (points.components - 1)]] * points.area[:, None]
    x = assembly.arrays
    whole = np.zeros((len(x.mass), 6, 6))
    whole[:, :3, :3], whole[:, 3:, 3:] = x.mass[:, None, None] * np.eye(3), x.inertia
    masses = list(basis.T @ whole @ basis)
    strains: list[Array] = []
    count, moves = 0, [free.ravel()]
    if blocks == MODAL:
        shapes = modal_blocks(assembly, stress, None if plane is None else plane.normal)
        count = max(s.count for s in shapes if s is not None)
        rows = sparse.lil_array((count * len(shapes), a.shape[1]))
        for i, shape in enumerate(shapes):
            size = 0 if shape is None else shape.count
            masses.append(np.zeros((count, count)) if shape is None else shape.mass)
            strains.append(np.zeros((count, count)) if shape is None else shape.stiffness)
            moves.append(np.arange(count) < size)
            if shape is None:
                continue
            for side, sign in ((points.block_a, -1.0), (points.block_b, 1.0)):
                at = np.flatnonzero(side == i)
                value = sign * np.einsum("mki,mci->kmc", shape.displacement(points.position[at]), points.directions[at])
                columns = (points.components * at[:, None] + np.arange(points.components)).ravel()
                rows[count * i : count * (i + 1), columns] = value.reshape(count, -1)
        a = sparse.vstack([a, rows.tocsr()])
    k = sparse.csc_array(a @ sparse.diags_array(stiff.ravel()) @ a.T)
    if strains:
        none = sparse.csc_array((free.size, free.size))
        k = sparse.csc_array(k + sparse.block_diag([none, *strains], format="csc"))
    mass = sparse.csc_array(sparse.block_diag(masses, format="csc"))
    return _Model(k, mass, np.concatenate(moves), basis, count)
