"""Compiled sums over the contact points of large paths; loaded from ``LARGE`` points on, where they outweigh its price.

Each does what the function of its name in :mod:`limitmason.capacity.kinematics`, ``point_law`` or ``system`` does on
whole arrays, point by point, for blocks that do not deform and joints that do not soften.

Arrays are of m points with c force components, normal first. ``block_a`` and ``block_b`` are their blocks, (m,),
``arm_a`` and ``arm_b`` their arms from the centroids [m], (m, 3), ``directions`` those of the components, (m, c, 3),
``force`` the components [N], (m, c). ``basis`` has the wrenches of the d degrees of freedom, (6, d).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def contact(
    block_a: Index, block_b: Index, arm_a: Array, arm_b: Array, offset: Array, reference: Array, shift: Array,
    turn: Array, displacement: Array, directions: Array, place_a: Array, place_b: Array,
) -> None:
    """Write displacements, directions and arms of the points in a pose.

    With p_a and p_b the places of the two material points now, the gap is p_b - p_a, and its components along the
    directions, which turn with a, are the displacement.

    Parameters
    ----------
    block_a, block_b, arm_a, arm_b : see the module, in the reference pose
    offset : from a's place to b's in the reference pose [m], shape (m, 3)
    reference : directions in the reference pose, shape (m, c, 3)
    shift : displacement of the blocks' centroids [m], shape (n, 3)
    turn : rotation matrices less one, so that small turns keep their digits, shape (n, 3, 3)
    displacement : written: of b against a, opening positive [m], shape (m, c)
    directions : written: as they are turned now, shape (m, c, 3)
    place_a, place_b : written: arms from the centroids of a and of b to b's point now [m], shape (m, 3)
    """
    gap = np.empty(3)
    for m in range(len(block_a)):
        a, b = block_a[m], block_b[m]
        for i in range(3):
            swing_a = swing_b = 0.0
            for j in range(3):
                swing_a += turn[a, i, j] * arm_a[m, j]
                swing_b += turn[b, i, j] * arm_b[m, j]
            gap[i] = offset[m, i] + shift[b, i] - shift[a, i] + swing_b - swing_a
            place_a[m, i], place_b[m, i] = arm_a[m, i] + swing_a + gap[i], arm_b[m, i] + swing_b
        for c in range(reference.shape[1]):
            total = 0.0
            for i in range(3):
                x = reference[m, c, i]
                for j in range(3):
                    x += turn[a, i, j] * reference[m, c, j]
                directions[m, c, i] = x
                total += x * gap[i]
            displacement[m, c] = total


@njit(cache=True, error_model="numpy")
def point_wrenches(directions: Array, arm_a: Array, arm_b: Array, basis: Array, out: Array) -> None:
    """Write the wrenches of unit forces on both blocks of every point, opposite on a.

    Parameters
    ----------
    directions, arm_a, arm_b : as turned now, see the module
    basis : (force, moment) of every degree of freedom, shape (6, d)
    out : written: (-n, -r_a x n) and (n, r_b x n) of every direction n times the basis, shape (m, c, 2, d), a first
    """
    for m in range(len(directions)):
        for c in range(directions.shape[1]):
            x, y, z = directions[m, c]
            for side in range(2):
                u, v, w = arm_b[m] if side else arm_a[m]
                k, o, n = v * z - w * y, w * x - u * z, u * y - v * x  # moment, arm x direction
                sign = 1.0 if side else -1.0
                for j in range(basis.shape[1]):
                    force = x * basis[0, j] + y * basis[1, j] + z * basis[2, j]
                    moment = k * basis[3, j] + o * basis[4, j] + n * basis[5, j]
                    out[m, c, side, j] = sign * (force + moment)


@njit(cache=True, error_model="numpy")
def block_wrenches(block_a: Index, block_b: Index, wrenches: Array, force: Array, out: Array) -> None:
    """Add the forces of all points to the degrees of freedom of their blocks.

    Parameters
    ----------
    wrenches : of :func:`point_wrenches`
    out : [N, N m], added to, shape (n, d)
    """
    for m in range(len(block_a)):
        for c in range(force.shape[1]):
            for j in range(out.shape[1]):
                out[block_a[m], j] += wrenches[m, c, 0, j] * force[m, c]
                out[block_b[m], j] += wrenches[m, c, 1, j] * force[m, c]


@njit(cache=True, error_model="numpy")
def returned(
    strength: tuple[Array, Array, Array, Array, Array], kn: Array, ks: Array, floor: float, old_slip: Array,
    old_lift: Array, displacement: Array, stress: Array, slip: Array, lift: Array, tangent: Array,
) -> None:
    """Write stress and history of every point, and the consistent tangent if asked.

    An elastic trial is returned to the law in implicit steps: sliding along the shear with dilation psi, at the tip of
    the cone where no shear is left, at the tension cut-off (``apex``), or at the crushing strength. Components are
    normal first, then the shears.

    Parameters
    ----------
    strength : tan(phi), tan(psi) [-], cohesion, tension and crushing strength [Pa], shape (m,) each
    kn, ks : [Pa/m], shape (m,)
    floor : share of the elastic stiffness left in the tangent
    old_slip, old_lift : plastic slip and opening before the step [m], shapes (m, c - 1) and (m,)
    displacement : of b against a, opening positive [m], shape (m, c)
    stress : written, compression positive [Pa], (m, c)
    slip, lift : written, plastic slip and opening after the step [m], shaped as before it
    tangent : written unless it is empty: - d(stress) / d(displacement) [Pa/m], shape (m, c, c) or (0, c, c)
    """
    tan_phi, tan_psi, cohesion, tension, crushing = strength
    c = displacement.shape[1]
    along = np.empty(c - 1)
    for m in range(len(kn)):
        # elastic trial: normal stress n0, shear of this size along the unit vector ``along``
        mu, psi, n0, size = tan_phi[m], tan_psi[m], kn[m] * (old_lift[m] - displacement[m, 0]), 0.0
        for j in range(c - 1):
            along[j] = ks[m] * (old_slip[m, j] - displacement[m, 1 + j])
            size += along[j] * along[j]
        size = np.sqrt(size)
        for j in range(c - 1):
            along[j] /= max(size, 1e-300)
        # plastic slip p at which |shear| - ks p = c + mu (n0 + kn psi p)
        hardness = ks[m] + kn[m] * mu * psi
        p = max(size - (cohesion[m] + mu * n0), 0.0) / hardness
        # beyond the tip the cone bears no shear: all of it slips
        tip = p > 0.0 and cohesion[m] + mu * (n0 + kn[m] * psi * p) < 0.0
        if tip:
            p = size / ks[m]
        apex = n0 + kn[m] * psi * p <= -tension[m]
        tip = tip and not apex
        if apex:
            p = max(size - max(cohesion[m] - mu * tension[m], 0.0), 0.0) / ks[m]
        normal = -tension[m] if apex else n0 + kn[m] * psi * p
        raised = old_lift[m] + psi * p
        crushed = normal > crushing[m]
        if crushed:
            normal = crushing[m]
            p = max(size - (cohesion[m] + mu * normal), 0.0) / ks[m]
            raised = displacement[m, 0] + normal / kn[m]
        held = size - ks[m] * p  # shear that is left
        stress[m, 0], lift[m] = normal, raised
        for j in range(c - 1):
            stress[m, 1 + j] = held * along[j]
            slip[m, j] = old_slip[m, j] - p * along[j]
        if not len(tangent):
            continue
        # derivatives by displacement, as in point_law: of n first (``first`` by the opening), then of the shears, which
        # follow n by ``slope`` on the cone, while n rises by ``flow`` per unit of shear stiffness as slip lifts
        cone = not apex and not tip and p > 0.0
        sliding = p > 0.0 or cohesion[m] + mu * normal <= 0.0
        share = held / max(size, 1e-300) if sliding else 1.0
        slope = mu if cone else 0.0
        flow = kn[m] * psi * (1.0 / ks[m] if tip else 1.0 / hardness if cone and not crushed else 0.0)
        first = 0.0 if apex or crushed else kn[m] * (1.0 - flow * slope)
        least = floor * min(kn[m], ks[m])
        tangent[m, 0, 0] = first + least
        for i in range(c - 1):
            tangent[m, 0, 1 + i] = flow * ks[m] * along[i]
            tangent[m, 1 + i, 0] = slope * first * along[i]
        for i in range(c - 1):
            for j in range(c - 1):
                x = ks[m] * share * ((i == j) - sliding * along[i] * along[j])
                tangent[m, 1 + i, 1 + j] = x + slope * along[i] * tangent[m, 0, 1 + j] + (least if i == j else 0.0)


@njit(cache=True, error_model="numpy")
def elements(
    components: tuple[int, ...], freedoms: tuple[int, ...], area: Array, wrenches: Array, tangent: Array,
    directions: Array, arm_a: Array, arm_b: Array, force: Array, starts: Index, basis: Array, out: Array,
) -> None:
    """Write the derivative of the wrenches on the two blocks of every run of points by the blocks' motions.

    It has a part of the points' stiffness and one of the geometry, as forces turn with the blocks.

    Parameters
    ----------
    components, freedoms : tuples of c and d numbers, whose lengths the compiler knows and writes loops out by
    area : of every point [m2]
    tangent : derivative of its stress [Pa/m], (m, c, c)
    wrenches : of :func:`point_wrenches`
    directions : axes of its frame, shape (m, c, 3)
    force : its force along them [N], shape (m, c)
    arm_a, arm_b : from the centroids of its two blocks, global axes, shape (m, 3)
    starts : first point of every run, shape (k,)
    basis : degrees of freedom of a block: velocity and spin by each of them, shape (6, d)
    out : written, shape (k, 2 d, 2 d)
    """
    c, d = len(components), len(freedoms)
    flat, stiff = wrenches.reshape(len(area), c, 2 * d), np.empty(2 * d)
    f, total, a, b, turned = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    shift, spin = basis[:3].T.copy(), basis[3:6].T.copy()
    shifts = np.array([j for j in range(d) if np.abs(shift[j]).max() > 0.0])
    spins = np.array([j for j in range(d) if np.abs(spin[j]).max() > 0.0])
    for k in range(len(starts)):
        own = out[k]
        own[:], total[:], a[:], b[:] = 0.0, 0.0, 0.0, 0.0
        for m in range(starts[k], starts[k + 1] if k + 1 < len(starts) else len(area)):
            for i in range(3):
                f[i] = 0.0
                for h in range(c):
                    f[i] += directions[m, h, i] * force[m, h]
                total[i] += f[i]
            on_a = f[0] * arm_a[m, 0] + f[1] * arm_a[m, 1] + f[2] * arm_a[m, 2]
            on_b = f[0] * arm_b[m, 0] + f[1] * arm_b[m, 1] + f[2] * arm_b[m, 2]
            for i in range(3):
                a[i, i] -= on_a
                b[i, i] -= on_b
                for j in range(3):
                    a[i, j] += f[i] * arm_a[m, j]
                    b[i, j] += f[i] * arm_b[m, j]
            for h in range(c):
                for j in range(2 * d):
                    x = 0.0
                    for g in range(c):
                        x += tangent[m, h, g] * flat[m, g, j]
                    stiff[j] = area[m] * x
                for i in range(2 * d):
                    x = flat[m, h, i]
                    for j in range(2 * d):
                        own[i, j] -= x * stiff[j]
        # a, b are sums of F arm^T - (arm . F) 1 for the two blocks, ``turned`` is [total], as in geometric_stiffness;
        # only what moves or turns a block counts
        turned[0, 1], turned[0, 2], turned[1, 2] = -total[2], total[1], -total[0]
        turned[1, 0], turned[2, 0], turned[2, 1] = total[2], -total[1], total[0]
        for j in spins:
            for i in shifts:
                x = _between(shift[i], turned, spin[j])
                own[i, j] += x
                own[d + i, j] -= x
                own[j, i] += x
                own[j, d + i] -= x
            for i in spins:
                x, y = _between(spin[i], b, spin[j]), _between(spin[j], b, spin[i])
                own[i, j] += _between(spin[i], a, spin[j])
                own[d + i, j] -= x
                own[i, d + j] -= y
                own[d + i, d + j] += y


@njit(cache=True, error_model="numpy", inline="always")
def _between(x: Array, a: Array, y: Array) -> float:
    """Scalar product of x with a y."""
    total = 0.0
    for i in range(3):
        total += x[i] * (a[i, 0] * y[0] + a[i, 1] * y[1] + a[i, 2] * y[2])
    return total


@njit(cache=True, error_model="numpy")
def assembled(element: Array, scale: Array, slot: Index, out: Array) -> None:
    """Add the entries of elements to their places in a sparse matrix.

    Parameters
    ----------
    element : matrices of k elements, two blocks or ends of d degrees of freedom each, shape (k, 2 d, 2 d)
    scale : of every entry of an element, to own units, shape (2 d, 2 d)
    slot : place in ``out`` of every entry, -1 for those of held blocks, shape (k * 4 d^2,)
    out : entries of the sparse matrix, added to
    """
    size, flat = scale.size, scale.ravel()
    for e in range(len(element)):
        values, places = element[e].ravel(), slot[e * size : (e + 1) * size]
        for i in range(size):
            if places[i] >= 0:
                out[places[i]] += values[i] * flat[i]


@njit(cache=True, error_model="numpy")
def relative(block_a: Index, block_b: Index, wrenches: Array, motion: Array, out: Array) -> None:
    """Write the displacements of the points by a small motion of the blocks.

    Parameters
    ----------
    wrenches : of :func:`point_wrenches`, shape (m, c, 2, d)
    motion : of the degrees of freedom, shape (n, d)
    out : written [m], shape (m, c)
    """
    for m in range(len(block_a)):
        for c in range(out.shape[1]):
            x = 0.0
            for j in range(motion.shape[1]):
                x += wrenches[m, c, 0, j] * motion[block_a[m], j] + wrenches[m, c, 1, j] * motion[block_b[m], j]
            out[m, c] = x


@njit(cache=True, error_model="numpy")
def moved(motion: Array, shift: Array, turn: Array) -> None:
    """Move n blocks on, in place.

    With S + 1 the rotation of the step, R - 1 becomes R - 1 + S + S (R - 1).

    Parameters
    ----------
    motion : shift and rotation vector in global axes [m, rad], shape (n, 6)
    shift : changed, displacement of the centroids [m], (n, 3)
    turn : changed, R - 1, rotation matrix less one, (n, 3, 3)
    """
    k, step, old = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(motion)):
        x, y, z = motion[m, 3], motion[m, 4], motion[m, 5]
        angle = np.sqrt(x * x + y * y + z * z)
        # S = sin(a)/a K + (1 - cos(a))/a^2 K^2, K the skew matrix of the rotation vector, as in rotation_matrices
        first = np.sin(angle) / angle if angle > 0.0 else 1.0
        half = np.sin(0.5 * angle) / (0.5 * angle) if angle > 0.0 else 1.0
        second = 0.5 * half * half
        k[0, 0] = k[1, 1] = k[2, 2] = 0.0
        k[0, 1], k[0, 2], k[1, 2], k[1, 0], k[2, 0], k[2, 1] = -z, y, -x, z, -y, x
        for i in range(3):
            shift[m, i] += motion[m, i]
            for j in range(3):
                square = k[i, 0] * k[0, j] + k[i, 1] * k[1, j] + k[i, 2] * k[2, j]
                step[i, j] = first * k[i, j] + second * square
                old[i, j] = turn[m, i, j]
        for i in range(3):
            for j in range(3):
                more = step[i, 0] * old[0, j] + step[i, 1] * old[1, j] + step[i, 2] * old[2, j]
                turn[m, i, j] = old[i, j] + step[i, j] + more
