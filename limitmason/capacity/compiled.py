"""Compiled sums over the contact points of a path: places, wrenches, elements, and what a motion makes of them.

They are written point by point. :mod:`limitmason.capacity.kinematics` and ``system`` call them, and load them then: an
import of the package does without the compiler.

Arrays are of m points with c force components, normal first. ``block_a`` and ``block_b`` are their blocks, (m,),
``directions`` those of the components, (m, c, 3), ``force`` the components [N], (m, c). ``arm_a`` and ``arm_b`` lead
from the centroids of a and of b to b's point in the pose [m], (m, 3). Only :func:`contact` takes those of the
reference pose, each to the block's own point. A block has d = r + k degrees of freedom, r rigid ones before those of
its k shapes. ``shapes_a`` and ``shapes_b`` are the displacements of its points by each shape, (m, 3, k).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@njit(cache=True, error_model="numpy")
def contact(
    block_a: Index, block_b: Index, arm_a: Array, arm_b: Array, offset: Array, reference: Array, shapes_a: Array,
    shapes_b: Array, shift: Array, turn: Array, shapes: Array, displacement: Array, directions: Array, new_arm_a: Array,
    new_arm_b: Array, turned_b: Array,
) -> None:
    """Write displacements, directions and arms of the points in a pose.

    With p_a and p_b the places of the two material points now, the gap is p_b - p_a, and its components along the
    directions, which turn with a, are the displacement.

    Parameters
    ----------
    block_a, block_b, shapes_a, shapes_b : see the module, in the reference pose
    arm_a, arm_b : from the centroids of a and of b, each to its own point, reference pose [m], shape (m, 3)
    offset : from a's place to b's in the reference pose [m], shape (m, 3)
    reference : directions in the reference pose, shape (m, c, 3)
    shift : displacement of the blocks' centroids [m], shape (n, 3)
    turn : rotation matrices less one, so that small turns keep their digits, shape (n, 3, 3)
    shapes : coordinates of the blocks' shapes, shape (n, k)
    displacement : written: of b against a, opening positive [m], shape (m, c)
    directions : written: as they are turned now, shape (m, c, 3)
    new_arm_a, new_arm_b : written: arms from the centroids of a and of b to b's point now [m], shape (m, 3)
    turned_b : written: ``shapes_b`` as turned now, shape (m, 3, k)
    """
    gap, bent = np.empty(3), np.empty(3)
    for m in range(len(block_a)):
        a, b = block_a[m], block_b[m]
        for i in range(3):
            # a's point as its block has bent, in axes that have not turned
            bent[i] = 0.0
            for k in range(shapes.shape[1]):
                bent[i] += shapes_a[m, i, k] * shapes[a, k]
        for i in range(3):
            # how far the end of either arm moves by its block's turn and bending
            swing_a, swing_b = bent[i], 0.0
            for j in range(3):
                swing_a += turn[a, i, j] * (arm_a[m, j] + bent[j])
                swing_b += turn[b, i, j] * arm_b[m, j]
            for k in range(shapes.shape[1]):
                x = shapes_b[m, i, k]
                for j in range(3):
                    x += turn[b, i, j] * shapes_b[m, j, k]
                turned_b[m, i, k] = x
                swing_b += x * shapes[b, k]
            gap[i] = offset[m, i] + shift[b, i] - shift[a, i] + swing_b - swing_a
            new_arm_a[m, i], new_arm_b[m, i] = arm_a[m, i] + swing_a + gap[i], arm_b[m, i] + swing_b
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
def point_wrenches(
    directions: Array, reference: Array, arm_a: Array, arm_b: Array, shapes_a: Array, turned_b: Array, basis: Array,
    out: Array,
) -> None:
    """Write the wrenches of unit forces on both blocks of every point, opposite on a.

    Parameters
    ----------
    directions, arm_a, arm_b, turned_b : in the pose, what :func:`contact` has written
    reference, shapes_a : directions in the reference pose, and shapes of a, whose frame turns with them
    basis : velocity, spin and rates of the shapes by every degree of freedom, shape (6 + k, r + k); only the first six
        rows and r columns, of the rigid ones, are read
    out : written: (-n, -r_a x n) and (n, r_b x n) of every direction n times the basis, then the work of n on the
        shapes, shape (m, c, 2, r + k), a first
    """
    shapes = shapes_a.shape[2]
    rigid = basis.shape[1] - shapes
    for m in range(len(directions)):
        for c in range(directions.shape[1]):
            x, y, z = directions[m, c]
            for side in range(2):
                u, v, w = arm_b[m] if side else arm_a[m]
                mx, my, mz = v * z - w * y, w * x - u * z, u * y - v * x  # moment, arm x direction
                sign = 1.0 if side else -1.0
                for j in range(rigid):
                    force = x * basis[0, j] + y * basis[1, j] + z * basis[2, j]
                    moment = mx * basis[3, j] + my * basis[4, j] + mz * basis[5, j]
                    out[m, c, side, j] = sign * (force + moment)
            for j in range(shapes):
                on_a = on_b = 0.0
                for i in range(3):
                    on_a += reference[m, c, i] * shapes_a[m, i, j]
                    on_b += directions[m, c, i] * turned_b[m, i, j]
                out[m, c, 0, rigid + j], out[m, c, 1, rigid + j] = -on_a, on_b


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
def elements(
    components: tuple[int, ...], freedoms: tuple[int, ...], area: Array, wrenches: Array, tangent: Array,
    starts: Index, out: Array,
) -> None:
    """Write what the points' stiffness gives the wrenches on the two blocks of every run by the blocks' motions.

    Parameters
    ----------
    components, freedoms : tuples of c and d numbers, whose lengths the compiler knows and writes loops out by
    area : of every point [m2]
    wrenches : of :func:`point_wrenches`
    tangent : derivative of a point's stress by its displacement [Pa/m], (m, c, c)
    starts : first point of each of s runs of points between the same two blocks, shape (s,)
    out : written, shape (s, 2 d, 2 d)
    """
    c, d = len(components), len(freedoms)
    flat, stiff = wrenches.reshape(len(area), c, 2 * d), np.empty(2 * d)
    for k in range(len(starts)):
        own = out[k]
        own[:] = 0.0
        for m in range(starts[k], starts[k + 1] if k + 1 < len(starts) else len(area)):
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


@njit(cache=True, error_model="numpy")
def geometric(
    directions: Array, arm_a: Array, arm_b: Array, force: Array, starts: Index, basis: Array, out: Array
) -> None:
    """Add how the wrenches on the two blocks of every run change as constant forces turn with the blocks.

    A spin theta of a turns the force F by theta x F = -[F] theta. Of the arms d(arm_b) = -[arm_b] theta_b and
    d(arm_a) = du_b - du_a - [arm_b] theta_b.

    Parameters
    ----------
    directions : axes of the points' frames, shape (m, c, 3)
    arm_a, arm_b : from the centroids of a and of b to b's point in the pose, global axes [m], shape (m, 3)
    force : of every point along its axes [N], shape (m, c)
    starts : first point of each of s runs, shape (s,)
    basis : rigid degrees of freedom of a block: velocity and spin by each of them, shape (6, r)
    out : added to, shape (s, 2 r, 2 r)
    """
    d = basis.shape[1]
    f, total, a, b, turned = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    shift, spin = basis[:3].T.copy(), basis[3:6].T.copy()
    shifts = np.array([j for j in range(d) if np.abs(shift[j]).max() > 0.0])
    spins = np.array([j for j in range(d) if np.abs(spin[j]).max() > 0.0])
    for k in range(len(starts)):
        own = out[k]
        total[:], a[:], b[:] = 0.0, 0.0, 0.0
        for m in range(starts[k], starts[k + 1] if k + 1 < len(starts) else len(force)):
            for i in range(3):
                f[i] = 0.0
                for h in range(force.shape[1]):
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
        # a, b are now the sums of [arm] [F] = F arm^T - (arm . F) 1 for the two blocks, ``turned`` is [total]; only
        # what moves or turns a block counts
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
    element : matrices of s elements, two blocks or ends of d degrees of freedom each, shape (s, 2 d, 2 d)
    scale : of every entry of an element, to own units, shape (2 d, 2 d)
    slot : place in ``out`` of every entry, -1 for those of held blocks, shape (s * 4 d^2,)
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
