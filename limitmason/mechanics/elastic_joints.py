"""Rigid blocks on linear elastic joints: small displacements and joint stresses before collapse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from limitmason.arrays import Array
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.stiffness_matrix import stiffness_matrix
from limitmason.model import Assembly, Loads

OPEN = 1e-6  # stiffness left in head joints that are taken as open: keeps a block between two of them in place


def elastic_displacements(
    assembly: Assembly, wrench: Array, *, normal_stiffness: float, shear_ratio: float = 0.4, head_joints: bool = False
) -> tuple[Array, Array]:
    """Displacements of rigid blocks on linear springs, and the joint forces.

    K u = w. Every face of area A, second moments I and polar moment J gives K its stiffness: kn A, ks A, kn I and ks J.

    Parameters
    ----------
    wrench : load on every block about its centroid [N, N m], shape (n, 6)
    normal_stiffness : kn of every joint [Pa/m]
    shear_ratio : ks / kn [-]
    head_joints : whether head joints carry; dry ones with a gap do not. Where blocks hang on them alone, as near the
        crown of an arch, they carry in any case

    Returns
    -------
    displacement : of every block [m, rad], shape (n, 6)
    normal : compressive force of every interface [N], shape (k,)

    Raises
    ------
    NotApplicable
        For a structure that its joints do not hold in place.

    Notes
    -----
    Wrong once joints open: linear springs carry tension, so displacements near collapse are underestimated.
    Bending stiffness is exact for rectangular faces; of other polygons the polar moment is.
    """
    x = assembly.arrays
    points = contact_points(assembly, contact_model="vertices")
    k = points.interface
    arm = points.position - x.centre[k]
    # corners moved inwards so that the areas at them have the second moment of the face itself
    corner = np.bincount(k, points.area * (arm**2).sum(axis=1), len(x.area))
    shrink = np.sqrt(np.divide(_polar_moments(assembly), corner, out=np.zeros(len(x.area)), where=corner > 0))
    points = replace(points, position=x.centre[k] + shrink[k, None] * arm)
    left_out = np.zeros(len(assembly.interfaces), dtype=bool)
    if not head_joints and _stands_without_head_joints(assembly):
        left_out = np.array([i.kind == "head" for i in assembly.interfaces], dtype=bool)
    # nearly no stiffness instead of none: the matrix stays regular
    share = np.where(left_out[k], OPEN, 1.0) * normal_stiffness
    springs = share[:, None] * np.array([1.0, shear_ratio, shear_ratio])
    equilibrium, whole = stiffness_matrix(assembly, points, springs)
    free = np.flatnonzero(~assembly.held.ravel())
    stiffness = whole[free][:, free]
    # moments over a length of the block, so that forces and moments have one scale
    length = np.ones((assembly.n_blocks, 6))
    length[:, 3:] = np.cbrt(x.volume)[:, None]
    scale = sparse.diags_array(1.0 / length.ravel()[free])
    try:  # a factor that is singular raises, or gives infinite displacements
        solved = splu(sparse.csc_array(scale @ stiffness @ scale)).solve(scale @ wrench.ravel()[free])
    except RuntimeError:
        solved = np.full(len(free), np.nan)
    if not np.isfinite(solved).all():
        raise NotApplicable("the joints do not hold every block in place: an elastic state does not exist")
    u = np.zeros(assembly.n_blocks * 6)
    u[free] = scale @ solved
    opening = (equilibrium.T @ u)[0::3]  # of every corner; its two slips follow it
    normal = np.bincount(k, -springs[:, 0] * points.area * opening, len(x.area))
    return u.reshape(-1, 6), np.asarray(normal, dtype=np.float64)


def dead_load_stress(assembly: Assembly, loads: Loads) -> Array:
    """Mean normal stress of every interface under dead load [Pa], shape (k,).

    The joints are elastic, and their uniform stiffness cancels. Joints between two held blocks get 0.
    """
    total = float(np.abs(loads.dead[:, :3]).sum()) or 1.0
    area = assembly.arrays.area
    kn = total / float(area.mean()) / 1e-6  # a micrometre, so that the numbers stay in range
    _, normal = elastic_displacements(assembly, np.asarray(loads.dead), normal_stiffness=kn)
    return normal / area


def _stands_without_head_joints(assembly: Assembly) -> bool:
    """Whether every block has a way to a support through bed and base joints."""
    try:
        assembly.with_interfaces(i for i in assembly.interfaces if i.kind != "head").check_connected()
    except InputError:
        return False
    return True


def _polar_moments(assembly: Assembly) -> Array:
    """Polar second moment of area of every interface about its centroid [m4], shape (k,)."""
    x = assembly.arrays
    out = np.empty(len(x.area))
    for i in range(len(out)):
        p = x.corners[x.corner_start[i] : x.corner_start[i + 1]] - x.centre[i]
        q = np.roll(p, -1, axis=0)
        cross = np.cross(p, q) @ x.normal[i]
        out[i] = (cross * ((p * p).sum(axis=1) + (p * q).sum(axis=1) + (q * q).sum(axis=1))).sum() / 12.0
    return out
