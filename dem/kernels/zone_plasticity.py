"""Mohr-Coulomb with a tension cut-off at a stress point: return to the surface.

Tension positive, s1 >= s2 >= s3. Shear: k s1 - s3 <= 2 c sqrt(k), k = (1 + sin phi) / (1 - sin phi), flow
(k_psi, 0, -1) with psi for phi. Tension: s <= ft for each, flow associated (both as UDEC and FLAC have them). Edges and
corners are returned to exactly: the multipliers of up to three planes at once, all >= 0, with no plane exceeded after
it. In plane stress the stress across is one of the three and stays zero.

Called at every stress point of a zone by :mod:`dem.kernels.zones`.
"""

from typing import NamedTuple

import numpy as np

from dem.kernels.arrays import Array, Index
from dem.kernels.compiled import kernel

MAT_STRAIN, MAT_K, MAT_C, MAT_FT, MAT_KPSI, MAT_D, MAT_DN, MAT_G, MAT_YIELDS = 0, 1, 2, 3, 4, 5, 6, 7, 8
"""Row of a material: 1 in plane strain, k, 2 c sqrt(k) [Pa], ft [Pa], k_psi, D11, D12, G [Pa], 1 where it yields."""
MAT_SIZE = 9
"""Numbers of such a row."""

SHEAR_NOW, TENSION_NOW, SHEAR_PAST, TENSION_PAST = 1, 2, 4, 8
"""Flags of a stress point: yields in shear or in tension in this step, or did so before."""

_TINY = 1e-11
"""Excess over the sum of the stresses up to which a plane counts as met: a return ends on it but for rounding [-]."""

_SINGULAR = 1e-12
"""Pivot over D11 below which planes that are met at once depend on each other [-]."""


class Planes(NamedTuple):
    """Planes of a yield surface in principal stresses, a s <= b, and elastic law."""

    a: Array  # normals, not of unit length, (6, 3)
    b: Array  # [Pa], (6,)
    f: Array  # directions of flow, (6, 3)
    d: float  # D11 [Pa]
    dn: float  # D12 [Pa]
    rounding: float  # stress by which a plane may be exceeded [Pa]


class Met(NamedTuple):
    """What a return to some planes gives."""

    multiplier: Array  # of every active plane, (3,)
    stress: Array  # principal stresses after it [Pa], (3,)
    matrix: Array  # room for the equations, (3, 4)


@kernel(fast=False)
def planes(mat: Array, m: int, a: Array, b: Array, f: Array, shear: Index) -> int:
    """Write the yield planes a s <= b of material row m, and return their number.

    The stresses are principal ones: s1 >= s2 >= s3 in plane strain; in plane stress the two in the plane, and 0.

    Parameters
    ----------
    mat : rows of all materials, columns ``MAT_...``, shape (materials, MAT_SIZE)
    a, b : coefficients and bounds [Pa] of the planes, written, shapes (6, 3) and (6,)
    f : direction of plastic flow of each plane, written, shape (6, 3)
    shear : 1 where a plane is of shear, 0 where it is of tension, written, shape (6,)
    """
    k, c, ft, q = mat[m, MAT_K], mat[m, MAT_C], mat[m, MAT_FT], mat[m, MAT_KPSI]
    for i in range(6):
        for r in range(3):
            a[i, r] = f[i, r] = 0.0
        shear[i] = 1
    # plane strain: shear between largest and smallest, then the edges where two are equal, then tension of each
    if mat[m, MAT_STRAIN] != 0.0:
        for i, (up, low) in enumerate(((0, 2), (0, 1), (1, 2))):
            a[i, up], a[i, low], b[i] = k, -1.0, c
            f[i, up], f[i, low] = q, -1.0
        for r in range(3):
            a[3 + r, r] = f[3 + r, r] = 1.0
            b[3 + r] = ft
            shear[3 + r] = 0
        return 6
    # plane stress, 0 across: shear in the plane; each in tension, k s <= c or s <= ft; each in compression, -s <= c
    a[0, 0], a[0, 1], b[0] = k, -1.0, c
    f[0, 0], f[0, 1] = q, -1.0
    cut = min(ft, c / k)
    for r in range(2):
        a[1 + r, r] = f[1 + r, r] = 1.0
        b[1 + r] = cut
        # where the cut-off lies above c / k, the plane through the zero stress across governs; same flow in the plane
        shear[1 + r] = 0 if ft <= c / k else 1
        a[3 + r, r] = f[3 + r, r] = -1.0
        b[3 + r] = c
    return 5


@kernel(fast=False)
def _met(active: Index, count: int, n: int, s: Array, surface: Planes, met: Met) -> bool:
    """Return to some planes at once; True where it is admissible.

    It is where all multipliers are >= 0 and no plane is exceeded after it.

    Parameters
    ----------
    active : numbers of the planes that are active, shape (3,)
    count : how many of these count
    n : number of all planes
    s : trial principal stresses [Pa], shape (3,)
    surface : all planes, the elastic law and the rounding
    met : multipliers and stress that are written, and work space
    """
    a, b, f, d, dn, tol = surface
    lam, out, m = met
    # a_i (s - D sum of lam_j f_j) = b_i: matrix a_i D f_j, and the right-hand side a_i s - b_i as its last column
    for i in range(count):
        p = active[i]
        for j in range(count):
            q = active[j]
            sum_f = f[q, 0] + f[q, 1] + f[q, 2]
            v = 0.0
            for r in range(3):
                v += a[p, r] * ((d - dn) * f[q, r] + dn * sum_f)
            m[i, j] = v
        m[i, 3] = a[p, 0] * s[0] + a[p, 1] * s[1] + a[p, 2] * s[2] - b[p]
    # elimination with pivots, then the multipliers from the last one back
    for i in range(count):
        best = i
        for j in range(i + 1, count):
            if abs(m[j, i]) > abs(m[best, i]):
                best = j
        if abs(m[best, i]) < _SINGULAR * d:
            return False
        for r in range(4):
            m[i, r], m[best, r] = m[best, r], m[i, r]
        for j in range(i + 1, count):
            t = m[j, i] / m[i, i]
            for r in range(i, 4):
                m[j, r] -= t * m[i, r]
    for i in range(count - 1, -1, -1):
        v = m[i, 3]
        for j in range(i + 1, count):
            v -= m[i, j] * lam[j]
        lam[i] = v / m[i, i]
        if lam[i] < 0.0:
            return False  # plastic flow does not run backwards
    for r in range(3):
        out[r] = s[r]
    for i in range(count):
        p = active[i]
        sum_f = f[p, 0] + f[p, 1] + f[p, 2]
        for r in range(3):
            out[r] -= lam[i] * ((d - dn) * f[p, r] + dn * sum_f)
    for p in range(n):  # noqa: SIM110 - numba compiles no generator
        if a[p, 0] * out[0] + a[p, 1] * out[1] + a[p, 2] * out[2] - b[p] > tol:
            return False
    return True


@kernel(fast=False, forceinline=True)
def _onto_shear(mat: Array, m: int, s: Array, plastic: Array) -> bool:
    """Return to the face of shear; True where no other plane is exceeded then.

    It lies between the largest and the smallest stress.

    Most stress points return so. Arguments as in :func:`principal_return`; they are written where the answer is True.
    """
    k, c, ft, q = mat[m, MAT_K], mat[m, MAT_C], mat[m, MAT_FT], mat[m, MAT_KPSI]
    d, dn = mat[m, MAT_D], mat[m, MAT_DN]
    plane_strain = mat[m, MAT_STRAIN] != 0.0
    low = 2 if plane_strain else 1  # the smallest stress; in plane stress the smaller one in the plane
    over = k * s[0] - s[low] - c
    if over > 0.0:
        # multiplier of the flow (q, 0, -1), and the stresses after it
        x = over / (k * (d * q - dn) - (dn * q - d))
        one, three = s[0] - x * (d * q - dn), s[low] - x * (dn * q - d)
        mid = s[1] - x * dn * (q - 1.0) if plane_strain else 0.0
        if one <= ft and mid <= one and mid >= three:
            plastic[0], plastic[1], plastic[2] = x * q, 0.0, 0.0
            plastic[low] = -x
            s[0], s[low] = one, three
            if plane_strain:
                s[1] = mid
            return True
    return False


@kernel(fast=False)
def _planes_met(n: int, s: Array, surface: Planes, beyond: Array, most: int, active: Index, met: Met) -> int:
    """Find the planes to which a stress returns at once: one, else two, else three.

    Combinations of one size are tried in the order of the planes. Of the planes that are met in the end the trial
    stress exceeds one at least.

    Parameters
    ----------
    n : number of all planes
    s : trial principal stresses [Pa], shape (3,)
    surface : all planes, the elastic law and the rounding
    beyond : whether the trial stress exceeds each plane, shape (6,)
    most : how many planes may be met at once
    active : numbers of the planes that are met, written, shape (3,)
    met : multipliers and stress of the return, written

    Returns
    -------
    count : how many planes are met; 0 where no combination is
    """
    for i in range(n):
        active[0] = i
        if beyond[i] and _met(active, 1, n, s, surface, met):
            return 1
    for size in range(2, most + 1):
        for r in range(size):
            active[r] = r
        r = 0
        while r >= 0:
            use = False
            for i in range(size):
                use = use or beyond[active[i]]
            if use and _met(active, size, n, s, surface, met):
                return size
            # the next ones: the last plane that can still go on does, and those behind it follow at once
            r = size - 1
            while r >= 0 and active[r] == n - size + r:
                r -= 1
            if r >= 0:
                active[r] += 1
                for i in range(r + 1, size):
                    active[i] = active[i - 1] + 1
    return 0


@kernel(fast=False, counted=True)
def principal_return(mat: Array, m: int, s: Array, plastic: Array) -> int:
    """Return sorted principal stresses to the yield surface.

    Parameters
    ----------
    mat, m : rows of all materials, columns ``MAT_...``, and the row that counts
    s : trial principal stresses in the order of :func:`planes` [Pa], overwritten, shape (3,)
    plastic : plastic strain in the same axes [-], written, shape (3,)

    Returns
    -------
    flags : ``SHEAR_NOW`` and ``TENSION_NOW``; -1 where no combination of planes was met (never for psi <= phi)
    """
    if _onto_shear(mat, m, s, plastic):
        return SHEAR_NOW
    q, plane_strain = mat[m, MAT_KPSI], mat[m, MAT_STRAIN] != 0.0
    a, b, f = np.empty((6, 3)), np.empty(6), np.empty((6, 3))
    shear, active, lam, out = np.empty(6, np.int64), np.empty(3, np.int64), np.empty(3), np.empty(3)
    beyond = np.empty(6, np.bool_)
    n = planes(mat, m, a, b, f, shear)
    for i in range(n):
        beyond[i] = a[i, 0] * s[0] + a[i, 1] * s[1] + a[i, 2] * s[2] > b[i]
    tol = _TINY * (abs(s[0]) + abs(s[1]) + abs(s[2]) + mat[m, MAT_C])
    surface = Planes(a, b, f, mat[m, MAT_D], mat[m, MAT_DN], tol)
    count = _planes_met(n, s, surface, beyond, 3 if plane_strain else 2, active, Met(lam, out, np.empty((3, 4))))
    for r in range(3):
        plastic[r] = 0.0
    if count == 0:
        return -1
    flags = 0
    for i in range(count):
        p = active[i]
        for r in range(3):
            plastic[r] += lam[i] * f[p, r]
        # in plane stress what shears against the zero stress across also strains across, which no stress resists: of
        # planes 3 and 4 (compression) q per multiplier, of 1 and 2 (tension) -1 / q, by the flow (q, 0, -1) of shear
        if not plane_strain and p > 0 and shear[p]:
            plastic[2] += lam[i] * q if p > 2 else -lam[i] / q
        if lam[i] > 0.0:
            flags |= SHEAR_NOW if shear[p] else TENSION_NOW
    for r in range(3 if plane_strain else 2):
        s[r] = out[r]
    return flags


@kernel(forceinline=True)
def exceeds(mat: Array, m: int, xx: float, zz: float, xz: float, yy: float) -> bool:
    """Whether a stress lies outside the yield surface of row m of ``mat``.

    It is xx, zz, xz, yy [Pa], tension positive.
    """
    mean, half = 0.5 * (xx + zz), 0.5 * (xx - zz)
    r = np.sqrt(half * half + xz * xz)
    low, high = min(mean - r, yy), max(mean + r, yy)
    return mat[m, MAT_K] * high - low > mat[m, MAT_C] or high > mat[m, MAT_FT]


@kernel(fast=False, counted=True)
def stress_return(mat: Array, m: int, stress: Array, plastic: Array) -> int:
    """Return a stress to the yield surface of a material.

    Parameters
    ----------
    mat, m : rows of all materials, columns ``MAT_...``, and the row that counts
    stress : xx, zz, xz, yy, tension positive [Pa], overwritten, shape (4,)
    plastic : plastic strain increment xx, zz, 2 xz, yy [-], written, shape (4,)

    Returns
    -------
    flags : ``SHEAR_NOW`` and ``TENSION_NOW``, 0 where the stress lay inside, -1 where no return was found
    """
    xx, zz, xz, yy = stress
    for r in range(4):
        plastic[r] = 0.0
    if not exceeds(mat, m, xx, zz, xz, yy):
        return 0
    # Mohr's circle: one and two are the principal stresses in the plane, cos and sin of twice the angle to them
    mean, half = 0.5 * (xx + zz), 0.5 * (xx - zz)
    r = np.sqrt(half * half + xz * xz)
    cos, sin = (half / r, xz / r) if r > 0.0 else (1.0, 0.0)
    s, p = np.empty(3), np.empty(3)
    one, two = mean + r, mean - r
    # largest, middle and least stress; i, j, k: where one, two and yy stand among them
    if mat[m, MAT_STRAIN] == 0.0:
        s[0], s[1], s[2] = one, two, 0.0
        i, j, k = 0, 1, 2
    elif yy > one:
        s[0], s[1], s[2] = yy, one, two
        i, j, k = 1, 2, 0
    elif yy < two:
        s[0], s[1], s[2] = one, two, yy
        i, j, k = 0, 1, 2
    else:
        s[0], s[1], s[2] = one, yy, two
        i, j, k = 0, 2, 1
    flags = principal_return(mat, m, s, p)
    if flags < 0:
        return flags
    # back to x and z by the same angle: an isotropic return does not turn the principal axes
    mean, half = 0.5 * (s[i] + s[j]), 0.5 * (s[i] - s[j])
    stress[0], stress[1], stress[2], stress[3] = mean + half * cos, mean - half * cos, half * sin, s[k]
    mean, half = 0.5 * (p[i] + p[j]), 0.5 * (p[i] - p[j])
    plastic[0], plastic[1], plastic[2], plastic[3] = mean + half * cos, mean - half * cos, 2.0 * half * sin, p[k]
    return flags
