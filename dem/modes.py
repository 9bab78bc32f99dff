"""Small vibrations of an assembly whose joints are all closed: stiffness matrix, natural frequencies, mode shapes."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh

from dem.joints import JointOptions, make_laws, make_points
from dem.kernels import LAW_KN, LAW_KS
from limitmason.equilibrium import equilibrium_matrix
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
    """

    frequency: Array
    shape: Array


def stiffness_matrix(
    assembly: Assembly,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 4),
    contact_model: str = "grid",
    joint_options: JointOptions | None = None,
) -> sparse.csc_array:
    """Return the stiffness matrix of blocks on closed elastic joints, K = A k A^T, held degrees of freedom included.

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
    points = make_points(assembly, contact_points, contact_model)
    laws, _ = make_laws(assembly, Loads.weight(assembly).dead, joint_options or JointOptions())
    a = equilibrium_matrix(assembly, points)
    stiff = laws[points.interface][:, [LAW_KN, LAW_KS, LAW_KS]] * points.area[:, None]
    return sparse.csc_array(a @ sparse.diags_array(stiff.ravel()) @ a.T)


def natural_frequencies(
    assembly: Assembly,
    count: int = 3,
    *,
    contact_points: Grid | Mapping[str, Grid] = (4, 4),
    contact_model: str = "grid",
    joint_options: JointOptions | None = None,
) -> Modes:
    """Return the lowest natural modes of an assembly, K u = (2 pi f)^2 M u with the real masses of the blocks.

    Parameters
    ----------
    count : how many modes
    contact_points, contact_model, joint_options : see :func:`dem.make_state`

    Returns
    -------
    Modes

    Raises
    ------
    InputError
        When a free block has no mass, or fewer modes exist than asked for.

    Notes
    -----
    Joints without a stiffness of their own get the one of the DEM, which is no material property: the frequencies are
    then meaningless. Joints are closed and stick, see :func:`stiffness_matrix`.
    """
    free = ~assembly.held.ravel()
    x = assembly.arrays
    moving = ~assembly.held.all(axis=1)
    if (moving & ~(x.mass > 0.0)).any():
        name = assembly.blocks[int(np.flatnonzero(moving & ~(x.mass > 0.0))[0])].name
        raise InputError(f"block {name!r} has no mass: natural frequencies need a positive density")
    if not 1 <= count < free.sum():
        raise InputError(f"count must lie between 1 and {int(free.sum()) - 1}, got {count!r}")
    k = stiffness_matrix(
        assembly, contact_points=contact_points, contact_model=contact_model, joint_options=joint_options
    )[free][:, free]
    blocks = [b for m, j in zip(x.mass, x.inertia, strict=True) for b in (m * np.eye(3), j)]
    m = sparse.csc_array(sparse.block_diag(blocks, format="csc"))[free][:, free]
    # lengths of metres and rotations of radians: a start vector of ones keeps the answer the same from run to run
    value, vector = eigsh(k, count, m, sigma=0.0, v0=np.ones(int(free.sum())))
    order = np.argsort(value)
    shape = np.zeros((count, free.size))
    shape[:, free] = vector[:, order].T
    return Modes(np.sqrt(np.maximum(value[order], 0.0)) / (2.0 * np.pi), shape.reshape(count, -1, 6))
