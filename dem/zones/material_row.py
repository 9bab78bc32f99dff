"""The row of numbers by which the kernels know a material of zones."""

import numpy as np

from dem.kernels.zone_plasticity import (
    MAT_C,
    MAT_D,
    MAT_DN,
    MAT_FT,
    MAT_G,
    MAT_K,
    MAT_KPSI,
    MAT_SIZE,
    MAT_STRAIN,
    MAT_YIELDS,
)
from limitmason.arrays import Array
from limitmason.mechanics.law import unit_tension
from limitmason.model import Material


def material_row(material: Material, plane_strain: bool, elastic: Array) -> Array:
    """Row of the table of materials, shape (MAT_SIZE,).

    Parameters
    ----------
    elastic : of :class:`limitmason.deformable.Elasticity`, shape (4, 3)
    """
    row = np.zeros(MAT_SIZE)
    row[MAT_STRAIN] = float(plane_strain)
    row[MAT_D], row[MAT_DN], row[MAT_G] = elastic[0, 0], elastic[0, 1], elastic[2, 2]
    row[MAT_K], row[MAT_KPSI], row[MAT_C], row[MAT_FT] = 1.0, 1.0, np.inf, np.inf
    if material.cohesion is not None and material.friction_angle_deg is not None:
        sin, sin_psi = (
            np.sin(np.deg2rad(angle)) for angle in (material.friction_angle_deg, material.dilatancy_angle_deg)
        )
        row[MAT_K], row[MAT_KPSI] = (1.0 + sin) / (1.0 - sin), (1.0 + sin_psi) / (1.0 - sin_psi)
        row[MAT_C] = 2.0 * material.cohesion * np.sqrt(row[MAT_K])
        row[MAT_FT] = unit_tension(material)
        row[MAT_YIELDS] = 1.0
    return row
