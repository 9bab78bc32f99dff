"""Stresses, joint forces and elastic energy of a zoned model; nothing changes."""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.joint_law import stress
from dem.kernels.joint_strength import peak_of, softening_of
from dem.kernels.zone_arrays import Nodes, QuadTable, SideContacts, Sides, ZonedArrays, Zones
from dem.kernels.zone_plasticity import MAT_D, MAT_DN, MAT_G, MAT_STRAIN, MAT_YIELDS, stress_return
from dem.kernels.zones import met, stress_at, turned


@kernel(counted=True, forceinline=True)
def _zone_stresses(nodes: Nodes, zones: Zones, tables: QuadTable, stresses: Array) -> float:
    """Write the stresses of all zones, and return their elastic energy [J].

    Parameters
    ----------
    nodes, zones, tables : all of them
    stresses : xx, zz, xz and yy at the four stress points, in axes of the structure, tension positive [Pa], written,
        shape (zones, 4, 4)
    """
    u, trial, plastic = np.empty(8), np.empty(4), np.empty(4)
    energy = 0.0
    for z in range(zones.kind.size):
        c, s = turned(z, nodes, zones, tables, u)
        # unsigned, as the kernel that steps has it: for a number of another type ``stress_return`` were compiled again
        m = np.uint64(zones.material[z])
        # diagonal and off-diagonal term of the elastic matrix, and shear modulus [Pa]
        d, dn, sh = tables.material[m, MAT_D], tables.material[m, MAT_DN], tables.material[m, MAT_G]
        for g in range(4):
            xx, zz, xz, yy = stress_at(z, g, zones, tables, u)
            if tables.material[m, MAT_YIELDS] != 0.0:
                # the nodes have moved since the last return. 0: still elastic; -1: no return was found, then the step
                # too has the point go on with its elastic stress
                trial[0], trial[1], trial[2], trial[3] = xx, zz, xz, yy
                if stress_return(tables.material, m, trial, plastic) > 0:
                    xx, zz, xz, yy = trial
            if tables.material[m, MAT_STRAIN] != 0.0:
                # plane strain: energy of the mean and of the deviator, by the bulk modulus and the shear modulus
                mean, bulk = (xx + zz + yy) / 3.0, (d + 2.0 * dn) / 3.0
                dev = (xx - mean) ** 2 + (zz - mean) ** 2 + (yy - mean) ** 2 + 2.0 * xz * xz
                density = 0.5 * mean * mean / bulk + 0.25 * dev / sh
            else:
                # plane stress: half of stress times strain, by the inverse of the elastic matrix in the plane
                det = d * d - dn * dn
                density = 0.5 * (d * (xx * xx + zz * zz) - 2.0 * dn * xx * zz) / det + 0.5 * xz * xz / sh
            energy += tables.weight[zones.kind[z], g] * density
            # from the zone's axes to those of the structure
            stresses[z, g, 0] = c * c * xx + s * s * zz - 2.0 * c * s * xz
            stresses[z, g, 1] = s * s * xx + c * c * zz + 2.0 * c * s * xz
            stresses[z, g, 2] = c * s * (xx - zz) + (c * c - s * s) * xz
            stresses[z, g, 3] = yy
    return energy


@kernel(forceinline=True)
def _joint_stresses(
    nodes: Nodes, sides: Sides, contacts: SideContacts, law: Array, joint: Array, energy: float
) -> float:
    """Write opening, slip and stress of contact points; return ``energy`` with theirs.

    Energies are in [J].

    Parameters
    ----------
    nodes, sides, contacts : all of them
    law : rows of all joints, columns as in ``LAW``, shape (k, LAW_SIZE)
    joint : opening less plastic opening, slip [m], normal stress, compression positive, and shear stress on b [Pa] of
        every point, written, shape (m, 4)
    energy : elastic energy of the zones [J]
    """
    for k in range(contacts.joint.size):
        _, _, _, _, _, _, opening, slip = met(k, nodes, sides, contacts)
        row = contacts.joint[k]
        # in the plane nothing slips along a second axis
        t, _, n, elastic = stress(
            opening, slip, 0.0, contacts.slip[k], 0.0, contacts.lift[k], contacts.damage[k], peak_of(law, row),
            softening_of(law, row),
        )
        joint[k, 0], joint[k, 1], joint[k, 2], joint[k, 3] = opening - contacts.lift[k], slip, n, t
        energy += contacts.area[k] * elastic
    return energy


@kernel(counted=True)
def measure_zones(model: ZonedArrays, stresses: Array, joint: Array) -> float:
    """Stresses and joint forces in the plane as it stands; changes no state.

    Parameters
    ----------
    model : all arrays of the model
    stresses : in global axes xx, zz, xz, yy [Pa], tension positive, written, shape (e, 4, 4)
    joint : opening less dilation, slip [m], normal (compression positive) and shear stress on b [Pa], written, (m, 4)

    Returns
    -------
    elastic energy of zones and joints [J]
    """
    nodes, zones, tables, sides, contacts, _, law, _, _ = model
    energy = _zone_stresses(nodes, zones, tables, stresses)
    return _joint_stresses(nodes, sides, contacts, law, joint, energy)
