"""Zones and their joints in the plane: forces and yielding.

A zone turns with its own mean rotation (polar decomposition at its centre) and strains in the turned axes, so that a
stressed block that turns as a whole feels nothing. Its elastic force is K u; plastic strain is kept as the stress it
takes away, at the four stress points (``spent``), as nodal forces (``relief``) and as amplitudes of the enhanced modes
(``amplitude``, which follow a step behind: one pass of Newton's method with the elastic matrix per step).

A contact point stays at its place on block b and slides along the side of block a: opening is the distance from that
side, slip the travel along it from where it was.
"""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.joint_law import return_map
from dem.kernels.joint_strength import peak_of, plain_peak_of, softening_of
from dem.kernels.zone_arrays import (
    Z_FRACTURE,
    Z_FRICTION,
    Z_MISSED,
    Z_PLASTIC,
    Nodes,
    QuadTable,
    SideContacts,
    Sides,
    Zones,
)
from dem.kernels.zone_plasticity import (
    MAT_D,
    MAT_DN,
    MAT_G,
    MAT_STRAIN,
    MAT_YIELDS,
    SHEAR_NOW,
    SHEAR_PAST,
    TENSION_NOW,
    TENSION_PAST,
    exceeds,
    stress_return,
)

LEFT = 1e-6
"""Part of a segment by which a point must have left it before it goes on to the next one."""

TRIES = 64
"""Segments that a point may pass in a step, so that a search between two that send it back and forth ends."""


@kernel(forceinline=True)
def turned(z: int, nodes: Nodes, zones: Zones, tables: QuadTable, u: Array) -> tuple[float, float]:
    """Displacement of nodes of zone z in its own axes, and cos and sin of its turn.

    The stiffness of a zone then is that of small strains; forces turn back by the same rotation.

    Parameters
    ----------
    nodes, zones, tables : all of them
    u : displacements x, z of its four nodes less the turn about the middle [m], written, shape (8,)

    Returns
    -------
    c, s : cosine and sine of the angle from x to z by which the zone has turned
    """
    kind = np.uint64(zones.kind[z])
    i0, i1 = np.uint64(zones.node[z, 0]), np.uint64(zones.node[z, 1])
    i2, i3 = np.uint64(zones.node[z, 2]), np.uint64(zones.node[z, 3])
    shift, place, grad = nodes.shift, nodes.place, tables.gradient
    mx = 0.25 * (shift[i0, 0] + shift[i1, 0] + shift[i2, 0] + shift[i3, 0])
    mz = 0.25 * (shift[i0, 1] + shift[i1, 1] + shift[i2, 1] + shift[i3, 1])
    cx = 0.25 * (place[i0, 0] + place[i1, 0] + place[i2, 0] + place[i3, 0])
    cz = 0.25 * (place[i0, 1] + place[i1, 1] + place[i2, 1] + place[i3, 1])
    fxx = fxz = fzx = fzz = 0.0
    for a in range(4):
        i = np.uint64(zones.node[z, a])
        dx, dz = shift[i, 0] - mx, shift[i, 1] - mz
        gx, gz = grad[kind, a, 0], grad[kind, a, 1]
        fxx += dx * gx
        fxz += dx * gz
        fzx += dz * gx
        fzz += dz * gz
    # rotation of the polar decomposition of I + grad u, in the plane: its tangent is (F_zx - F_xz) / (F_xx + F_zz)
    p, q = 2.0 + fxx + fzz, fzx - fxz
    r = 1.0 / np.sqrt(p * p + q * q)
    c, s = p * r, q * r
    less = -s * s / (1.0 + c)  # cosine less one, without cancellation
    for a in range(4):
        i = np.uint64(zones.node[z, a])
        dx, dz = shift[i, 0] - mx, shift[i, 1] - mz
        rx, rz = place[i, 0] - cx, place[i, 1] - cz
        u[2 * a] = c * dx + s * dz + less * rx + s * rz
        u[2 * a + 1] = c * dz - s * dx + less * rz - s * rx
    return c, s


@kernel(forceinline=True)
def stress_at(z: int, g: int, zones: Zones, tables: QuadTable, u: Array) -> tuple[float, float, float, float]:
    """Stress xx, zz, xz, yy [Pa], tension positive, at point g of zone z, in its axes.

    It is that of the displacements u, shape (8,), of its nodes in its own axes [m] and of its enhanced modes, less what
    plastic strain has taken away. ``zones`` and ``tables`` are those of all zones.
    """
    # unsigned: no index from the end to allow for
    kind, m = np.uint64(zones.kind[z]), np.uint64(zones.material[z])
    strain, modes, amplitude = tables.strain, tables.modes, zones.amplitude
    xx = zz = xz = 0.0
    for j in range(8):
        xx += strain[kind, g, 0, j] * u[j]
        zz += strain[kind, g, 1, j] * u[j]
        xz += strain[kind, g, 2, j] * u[j]
    for j in range(4):
        b = amplitude[z, j]
        xx += modes[kind, g, 0, j] * b
        zz += modes[kind, g, 1, j] * b
        xz += modes[kind, g, 2, j] * b
    d, dn, sh = tables.material[m, MAT_D], tables.material[m, MAT_DN], tables.material[m, MAT_G]
    across = dn * (xx + zz) if tables.material[m, MAT_STRAIN] != 0.0 else 0.0
    return (
        d * xx + dn * zz - zones.spent[z, g, 0], dn * xx + d * zz - zones.spent[z, g, 1],
        sh * xz - zones.spent[z, g, 2], across - zones.spent[z, g, 3],
    )


@kernel()
def _yield(z: int, zones: Zones, tables: QuadTable, u: Array, trial: Array, plastic: Array) -> tuple[float, int]:
    """Return the four stress points of zone z to the yield surface.

    The zone's ``spent`` stress, nodal ``relief`` and enhanced ``amplitude`` follow, so that elastic forces stay those
    of the displacements.

    Parameters
    ----------
    zones, tables : all of them; the zone's plastic state is changed
    u : displacements of its nodes in the zone's axes [m], shape (8,)
    trial, plastic : work space for a stress and a plastic strain, shape (4,)

    Returns
    -------
    lost : plastic work [J]
    missed : 1 where a point could not be returned, else 0
    """
    kind, m = np.uint64(zones.kind[z]), np.uint64(zones.material[z])
    lost = a0 = a1 = a2 = a3 = 0.0
    missed = 0
    release, amplitude = tables.release, zones.amplitude
    for g in range(4):
        xx, zz, xz, yy = stress_at(z, g, zones, tables, u)
        old = zones.flag[z, g]
        # a point that yielded in the last step counts as one that has yielded
        past = (old & (SHEAR_PAST | TENSION_PAST)) | ((old & (SHEAR_NOW | TENSION_NOW)) << 2)
        if not exceeds(tables.material, m, xx, zz, xz, yy):
            zones.flag[z, g] = past  # it yields no more
            continue
        trial[0], trial[1], trial[2], trial[3] = xx, zz, xz, yy
        new = stress_return(tables.material, m, trial, plastic)
        if new < 0:
            missed = 1
            continue
        zones.flag[z, g] = past | new
        w = tables.weight[kind, g]
        # the stress that plastic strain takes away here, with its nodal forces and what enhanced modes give after it
        d0, d1, d2 = xx - trial[0], zz - trial[1], xz - trial[2]
        zones.spent[z, g, 0] += d0
        zones.spent[z, g, 1] += d1
        zones.spent[z, g, 2] += d2
        zones.spent[z, g, 3] += yy - trial[3]
        for j in range(8):
            # nodal forces w B^T (stress taken away)
            zones.relief[z, j] += w * (
                tables.strain[kind, g, 0, j] * d0 + tables.strain[kind, g, 1, j] * d1
                + tables.strain[kind, g, 2, j] * d2
            )
        a0 += release[kind, g, 0, 0] * d0 + release[kind, g, 0, 1] * d1 + release[kind, g, 0, 2] * d2
        a1 += release[kind, g, 1, 0] * d0 + release[kind, g, 1, 1] * d1 + release[kind, g, 1, 2] * d2
        a2 += release[kind, g, 2, 0] * d0 + release[kind, g, 2, 1] * d1 + release[kind, g, 2, 2] * d2
        a3 += release[kind, g, 3, 0] * d0 + release[kind, g, 3, 1] * d1 + release[kind, g, 3, 2] * d2
        lost += w * (
            trial[0] * plastic[0] + trial[1] * plastic[1] + trial[2] * plastic[2] + trial[3] * plastic[3]
        )
        # length of the plastic strain tensor: its entry 2 holds 2 xz, of which both shears make half of the square
        zones.plastic[z, g] += np.sqrt(
            plastic[0] * plastic[0] + plastic[1] * plastic[1] + plastic[3] * plastic[3] + 0.5 * plastic[2] * plastic[2]
        )
    # all at once: point by point, an even strain would be uneven on the way, and be returned in part
    amplitude[z, 0] += a0
    amplitude[z, 1] += a1
    amplitude[z, 2] += a2
    amplitude[z, 3] += a3
    return lost, missed


@kernel(counted=True)
def zone_forces(nodes: Nodes, zones: Zones, tables: QuadTable, total: Array) -> None:
    """Add forces of all zones to ``nodes.force``; their stress points yield.

    Parameters
    ----------
    nodes, zones, tables : all of them; forces and the plastic state of zones are changed
    total : accumulated sums, entries ``Z_...``: plastic work [J] and zones with a point that could not be returned are
        added
    """
    u, trial, plastic = np.empty(8), np.empty(4), np.empty(4)
    lost = 0.0
    missed = 0
    now = SHEAR_NOW | TENSION_NOW
    force, stiff, relief = nodes.force, tables.stiffness, zones.relief
    for z in range(zones.kind.size):
        kind = np.uint64(zones.kind[z])
        c, s = turned(z, nodes, zones, tables, u)
        if tables.material[zones.material[z], MAT_YIELDS] != 0.0:
            # a call costs more than the question whether it is needed
            active = False
            m = np.uint64(zones.material[z])
            for g in range(4):
                xx, zz, xz, yy = stress_at(z, g, zones, tables, u)
                active = active or exceeds(tables.material, m, xx, zz, xz, yy) or zones.flag[z, g] & now != 0
            if active:
                more, failed = _yield(z, zones, tables, u, trial, plastic)
                lost += more
                missed += failed
        f0, f1, f2, f3 = relief[z, 0], relief[z, 1], relief[z, 2], relief[z, 3]
        f4, f5, f6, f7 = relief[z, 4], relief[z, 5], relief[z, 6], relief[z, 7]
        for j in range(8):
            v = u[j]
            f0 -= stiff[kind, j, 0] * v
            f1 -= stiff[kind, j, 1] * v
            f2 -= stiff[kind, j, 2] * v
            f3 -= stiff[kind, j, 3] * v
            f4 -= stiff[kind, j, 4] * v
            f5 -= stiff[kind, j, 5] * v
            f6 -= stiff[kind, j, 6] * v
            f7 -= stiff[kind, j, 7] * v
        i0, i1 = np.uint64(zones.node[z, 0]), np.uint64(zones.node[z, 1])
        i2, i3 = np.uint64(zones.node[z, 2]), np.uint64(zones.node[z, 3])
        force[i0, 0] += c * f0 - s * f1
        force[i0, 1] += s * f0 + c * f1
        force[i1, 0] += c * f2 - s * f3
        force[i1, 1] += s * f2 + c * f3
        force[i2, 0] += c * f4 - s * f5
        force[i2, 1] += s * f4 + c * f5
        force[i3, 0] += c * f6 - s * f7
        force[i3, 1] += s * f6 + c * f7
    total[Z_PLASTIC] += lost
    total[Z_MISSED] += missed


@kernel(forceinline=True)
def met(
    k: int, nodes: Nodes, sides: Sides, contacts: SideContacts
) -> tuple[int, int, float, int, float, float, float, float]:
    """Where contact point k of block b lies on its side of block a.

    Parameters
    ----------
    nodes, sides, contacts : all of them

    Returns
    -------
    i, j : nodes of a between which it lies
    along : part of the way from i to j [-]
    at : chain entry of ``sides.node`` that holds i
    dx, dy : unit tangent from i to j, x and z; the outward normal of a is (dy, -dx)
    opening : distance from a's side, negative where the point has sunk into it [m]
    slip : travel along the side since the reference position [m]
    """
    b0, b1, share = contacts.node[k, 0], contacts.node[k, 1], contacts.share[k]
    place, shift = nodes.place, nodes.shift
    x = (1.0 - share) * (place[b0, 0] + shift[b0, 0]) + share * (place[b1, 0] + shift[b1, 0])
    y = (1.0 - share) * (place[b0, 1] + shift[b0, 1]) + share * (place[b1, 1] + shift[b1, 1])
    # from the segment of the last step to its neighbours, until the point lies on one; the first and last of the side
    at, side = contacts.segment[k], contacts.side[k]
    first, last = sides.start[side], sides.start[side + 1] - 2
    tried = 0
    while True:
        i, j = sides.node[at], sides.node[at + 1]
        ox, oy = place[i, 0] + shift[i, 0], place[i, 1] + shift[i, 1]
        dx, dy = place[j, 0] + shift[j, 0] - ox, place[j, 1] + shift[j, 1] - oy
        inv = 1.0 / np.sqrt(dx * dx + dy * dy)
        dx, dy = dx * inv, dy * inv
        along = ((x - ox) * dx + (y - oy) * dy) * inv
        tried += 1
        # a point at a node belongs to either segment: it changes only where it has left for good
        if along < -LEFT and at > first and tried < TRIES:
            at -= 1
        elif along > 1.0 + LEFT and at < last and tried < TRIES:
            at += 1
        else:
            break
    slip = sides.arc[at] + along * (sides.arc[at + 1] - sides.arc[at]) - contacts.arc[k]
    opening = (x - ox) * dy - (y - oy) * dx + contacts.gap[k]
    return i, j, along, at, dx, dy, opening, slip


@kernel()
def joint_forces(nodes: Nodes, sides: Sides, contacts: SideContacts, law: Array, soft: bool, total: Array) -> None:
    """Add forces of contact points to ``nodes.force``; slip, lift and damage follow.

    Parameters
    ----------
    nodes, sides, contacts : all of them; forces and the plastic state of contact points are changed
    law : rows of all joints, shape (k, LAW_SIZE)
    soft : whether any joint loses strength or has added terms: only then is the softening compiled in
    total : accumulated sums, entries ``Z_...``: friction and fracture are added [J]
    """
    force = nodes.force
    rubbed_all = broken_all = 0.0
    for k in range(contacts.joint.size):
        i, j, along, at, tx, ty, opening, slip = met(k, nodes, sides, contacts)
        contacts.segment[k] = at
        row = contacts.joint[k]
        moved = slip - contacts.along[k], 0.0, opening - contacts.opening[k]
        contacts.along[k], contacts.opening[k] = slip, opening
        # in the plane nothing slips along a second axis, and there are no dashpots; True lets points dilate and crush
        if soft:
            t, _, n, contacts.slip[k], _, contacts.lift[k], contacts.damage[k], rubbed, raised, _, broken = return_map(
                opening, slip, 0.0, contacts.slip[k], 0.0, contacts.lift[k], contacts.damage[k],
                peak_of(law, row), softening_of(law, row), None, True, moved,
            )
        else:
            t, _, n, contacts.slip[k], _, contacts.lift[k], _, rubbed, raised, _, broken = return_map(
                opening, slip, 0.0, contacts.slip[k], 0.0, contacts.lift[k], 0.0, plain_peak_of(law, row), None, None,
                True, moved,
            )
        area = contacts.area[k]
        rubbed_all += area * (rubbed - raised)
        broken_all += area * broken
        # force on b; the outward normal of a is (ty, -tx)
        fx, fy = area * (t * tx + n * ty), area * (t * ty - n * tx)
        b0, b1, share = contacts.node[k, 0], contacts.node[k, 1], contacts.share[k]
        force[b0, 0] += (1.0 - share) * fx
        force[b0, 1] += (1.0 - share) * fy
        force[b1, 0] += share * fx
        force[b1, 1] += share * fy
        force[i, 0] -= (1.0 - along) * fx
        force[i, 1] -= (1.0 - along) * fy
        force[j, 0] -= along * fx
        force[j, 1] -= along * fy
    total[Z_FRICTION] += rubbed_all
    total[Z_FRACTURE] += broken_all
