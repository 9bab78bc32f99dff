"""Zones in space: elastic forces of hexahedra in axes that turn with each, and the stresses in them.

R is the rotation of the deformation gradient F = I + H at the centre of a zone, by Newton's iteration for the polar
decomposition (Higham 1986), R <- (R + R^-T) / 2, carried as V = R - I so that small strains lose no digits:
V <- (V - (V R^-1)^T) / 2. The error squares in every pass.
"""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.solid_arrays import Hexahedra, HexTable
from dem.kernels.zone_arrays import Nodes

Numbers = tuple[float, ...]

_CLOSE = 1e-9  # change of a pass from which the next one would change nothing


@kernel(forceinline=True)
def polar(h: Numbers) -> Numbers:
    """R - I of F = I + H, both row by row."""
    a, b, c, d, e, f, g, p, q = h
    for _ in range(30):
        r0, r4, r8 = 1.0 + a, 1.0 + e, 1.0 + q
        # inverse of I + V from its cofactors
        c0, c1, c2 = r4 * r8 - f * p, f * g - d * r8, d * p - r4 * g
        inv = 1.0 / (r0 * c0 + b * c1 + c * c2)
        i0, i1, i2 = c0 * inv, (c * p - b * r8) * inv, (b * f - c * r4) * inv
        i3, i4, i5 = c1 * inv, (r0 * r8 - c * g) * inv, (c * d - r0 * f) * inv
        i6, i7, i8 = c2 * inv, (b * g - r0 * p) * inv, (r0 * r4 - b * d) * inv
        # Z = V R^-1; V <- (V - Z^T) / 2
        na = 0.5 * (a - (a * i0 + b * i3 + c * i6))
        nb = 0.5 * (b - (d * i0 + e * i3 + f * i6))
        nc = 0.5 * (c - (g * i0 + p * i3 + q * i6))
        nd = 0.5 * (d - (a * i1 + b * i4 + c * i7))
        ne = 0.5 * (e - (d * i1 + e * i4 + f * i7))
        nf = 0.5 * (f - (g * i1 + p * i4 + q * i7))
        ng = 0.5 * (g - (a * i2 + b * i5 + c * i8))
        np_ = 0.5 * (p - (d * i2 + e * i5 + f * i8))
        nq = 0.5 * (q - (g * i2 + p * i5 + q * i8))
        change = max(
            abs(na - a), abs(nb - b), abs(nc - c), abs(nd - d), abs(ne - e), abs(nf - f), abs(ng - g), abs(np_ - p),
            abs(nq - q),
        )  # fmt: skip
        a, b, c, d, e, f, g, p, q = na, nb, nc, nd, ne, nf, ng, np_, nq
        if change < _CLOSE:
            break
    return a, b, c, d, e, f, g, p, q


@kernel(forceinline=True)
def turned_back(z: int, nodes: Nodes, zones: Hexahedra, table: HexTable, u: Array) -> Numbers:
    """Displacement of a zone's nodes in its own axes, written to u (24); R - I of its rotation, row by row."""
    kind = np.uint64(zones.kind[z])
    shift, place, grad = nodes.shift, nodes.place, table.gradient
    mx = my = mz = cx = cy = cz = 0.0
    for n in range(8):
        i = np.uint64(zones.node[z, n])
        mx += shift[i, 0]
        my += shift[i, 1]
        mz += shift[i, 2]
        cx += place[i, 0]
        cy += place[i, 1]
        cz += place[i, 2]
    mx, my, mz, cx, cy, cz = 0.125 * mx, 0.125 * my, 0.125 * mz, 0.125 * cx, 0.125 * cy, 0.125 * cz
    a = b = c = d = e = f = g = p = q = 0.0
    for n in range(8):
        i = np.uint64(zones.node[z, n])
        dx, dy, dz = shift[i, 0] - mx, shift[i, 1] - my, shift[i, 2] - mz
        gx, gy, gz = grad[kind, n, 0], grad[kind, n, 1], grad[kind, n, 2]
        a += dx * gx
        b += dx * gy
        c += dx * gz
        d += dy * gx
        e += dy * gy
        f += dy * gz
        g += dz * gx
        p += dz * gy
        q += dz * gz
    a, b, c, d, e, f, g, p, q = polar((a, b, c, d, e, f, g, p, q))
    for n in range(8):
        i = np.uint64(zones.node[z, n])
        dx, dy, dz = shift[i, 0] - mx, shift[i, 1] - my, shift[i, 2] - mz
        sx, sy, sz = dx + place[i, 0] - cx, dy + place[i, 1] - cy, dz + place[i, 2] - cz
        # R^T (r + d) - r
        u[3 * n] = dx + a * sx + d * sy + g * sz
        u[3 * n + 1] = dy + b * sx + e * sy + p * sz
        u[3 * n + 2] = dz + c * sx + f * sy + q * sz
    return a, b, c, d, e, f, g, p, q


@kernel(counted=True, forceinline=True)
def solid_forces(nodes: Nodes, zones: Hexahedra, table: HexTable) -> None:
    """Add the forces of all zones to ``nodes.force``."""
    u, local = np.empty(24), np.empty(24)
    force, stiff = nodes.force, table.stiffness
    for z in range(zones.kind.size):
        kind = np.uint64(zones.kind[z])
        a, b, c, d, e, f, g, p, q = turned_back(z, nodes, zones, table, u)
        # eight sums at a time stay in registers: half the time of sums in an array
        for first in range(0, 24, 8):
            f0 = f1 = f2 = f3 = f4 = f5 = f6 = f7 = 0.0
            for j in range(24):
                v = u[j]
                f0 -= stiff[kind, j, first] * v
                f1 -= stiff[kind, j, first + 1] * v
                f2 -= stiff[kind, j, first + 2] * v
                f3 -= stiff[kind, j, first + 3] * v
                f4 -= stiff[kind, j, first + 4] * v
                f5 -= stiff[kind, j, first + 5] * v
                f6 -= stiff[kind, j, first + 6] * v
                f7 -= stiff[kind, j, first + 7] * v
            local[first], local[first + 1], local[first + 2], local[first + 3] = f0, f1, f2, f3
            local[first + 4], local[first + 5], local[first + 6], local[first + 7] = f4, f5, f6, f7
        for n in range(8):
            i = np.uint64(zones.node[z, n])
            x, y, w = local[3 * n], local[3 * n + 1], local[3 * n + 2]
            force[i, 0] += x + a * x + b * y + c * w
            force[i, 1] += y + d * x + e * y + f * w
            force[i, 2] += w + g * x + p * y + q * w


@kernel(counted=True, forceinline=True)
def solid_stresses(nodes: Nodes, zones: Hexahedra, table: HexTable, stresses: Array) -> float:
    """Stresses of all zones in the present position, global axes; changes no state.

    Parameters
    ----------
    stresses : xx, yy, zz, yz, xz, xy [Pa], tension positive, written, shape (e, 8, 6)

    Returns
    -------
    elastic energy [J]
    """
    u, strain, own = np.empty(24), np.empty(6), np.empty(6)
    turn, half, whole = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    energy = 0.0
    for z in range(zones.kind.size):
        kind = zones.kind[z]
        a, b, c, d, e, f, g, p, q = turned_back(z, nodes, zones, table, u)
        turn[0, 0], turn[0, 1], turn[0, 2] = 1.0 + a, b, c
        turn[1, 0], turn[1, 1], turn[1, 2] = d, 1.0 + e, f
        turn[2, 0], turn[2, 1], turn[2, 2] = g, p, 1.0 + q
        for j in range(24):
            along = 0.0
            for i in range(24):
                along += table.stiffness[kind, j, i] * u[i]
            energy += 0.5 * along * u[j]
        for k in range(8):
            for m in range(6):
                strain[m] = 0.0
                for j in range(24):
                    strain[m] += table.strain[kind, k, m, j] * u[j]
            for i in range(6):
                own[i] = 0.0
                for m in range(6):
                    own[i] += table.elastic[kind, i, m] * strain[m]
            whole[0, 0], whole[1, 1], whole[2, 2] = own[0], own[1], own[2]
            whole[1, 2] = whole[2, 1] = own[3]
            whole[0, 2] = whole[2, 0] = own[4]
            whole[0, 1] = whole[1, 0] = own[5]
            for i in range(3):
                for j in range(3):
                    half[i, j] = turn[i, 0] * whole[0, j] + turn[i, 1] * whole[1, j] + turn[i, 2] * whole[2, j]
            for n in range(6):
                i = 0 if n == 0 or n > 3 else 1 if n == 1 or n == 3 else 2
                j = 0 if n == 0 else 1 if n == 1 or n == 5 else 2
                stresses[z, k, n] = half[i, 0] * turn[j, 0] + half[i, 1] * turn[j, 1] + half[i, 2] * turn[j, 2]
    return energy
