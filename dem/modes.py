"""The DEM's old names for small vibrations, whose home is :func:`limitmason.modes`."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from dem.joints import JointOptions, make_laws, make_points
from dem.kernels import LAW_KN, LAW_KS
from limitmason.deformable import SOLID
from limitmason.deformable.levels import RIGID
from limitmason.equilibrium import equilibrium_matrix
from limitmason.model import Assembly, Loads
from limitmason.vibration import modes

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
    """Return the lowest natural modes of an assembly; :func:`limitmason.modes` under its old name.

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

    Warns
    -----
    DeprecationWarning
        Always: the name goes with the next release.
    """
    warnings.warn(
        "dem.natural_frequencies is now limitmason.modes (joint_options as stiffness=(kn, ks)); the old name goes with "
        "the next release", DeprecationWarning, stacklevel=2,
    )  # fmt: skip
    laws, _ = make_laws(assembly, Loads.weight(assembly).dead, joint_options or JointOptions())
    found = modes(
        assembly, count, contact_points=contact_points, contact_model=contact_model,
        stiffness=(laws[:, LAW_KN], laws[:, LAW_KS]), blocks=blocks, stress=stress,
    )  # fmt: skip
    return Modes(found.frequency, found.shape[:, :, :6], found.shape[:, :, 6:])


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
    points = make_points(assembly, contact_points, contact_model, None)
    laws, _ = make_laws(assembly, Loads.weight(assembly).dead, joint_options or JointOptions())
    a = equilibrium_matrix(assembly, points)
    stiff = laws[points.interface][:, [LAW_KN, LAW_KS, LAW_KS]] * points.area[:, None]
    return sparse.csc_array(a @ sparse.diags_array(stiff.ravel()) @ a.T)
