"""Joints between blocks that deform in shapes: motion of faces, forces on shapes.

A joint takes up the six rigid motions of a face that are nearest to what a shape does there. A shape is six numbers of
a joint's side then, a displacement c and a rotation w, and both sides add to the relative motion of the rigid blocks,

    delta = d + G X + R_rel (c_b + w_b x X) - (c_a + w_a x X),  X = (s, t, 0),

each carried by its block: a block that turns keeps its strains. The joint law sees a joint between rigid blocks with
another d and G. What its forces do to a shape is c . sum f + w . sum X x f.
"""

import numpy as np

from dem.kernels.added_terms import Numbers
from dem.kernels.arrays import LAW, Array, BlockModes, BlockStep, Joints, Points, RigidBodies
from dem.kernels.compiled import kernel
from dem.kernels.kinematics import Axes, relative_motion, third_axis
from dem.kernels.local_damping import ROUNDING, brake_of
from dem.kernels.sums import braked_sums, held_sums, yielding_sums

NOTHING = (0.0,) * 16
"""As many numbers as the sums between blocks that strain: what they are before a loop over points has run."""

PLANE_MODES, SPACE_MODES = 9, 21
"""Shapes of a block in a plane and in space: known to the compiler, which unrolls its loops."""


@kernel(forceinline=True)
def face_motion(side: Array, j: int, x: Array, i: int, space: bool | None) -> Numbers:
    """Displacement [m] and rotation [rad] of a side of joint j by shapes of block i.

    Parameters
    ----------
    side : c [m] and w [rad] of every joint by a unit of every shape, shape (joints, shapes, 6)
    j : the joint
    x : coordinates of the shapes of all blocks, or their rates, shape (blocks, shapes)
    i : the block
    space : None in a plane, where a block has fewer shapes and no twist about the joint's normal

    Returns
    -------
    displacement c and rotation w along t1, t2, n, six numbers
    """
    c1 = c2 = c3 = w1 = w2 = w3 = 0.0
    for k in range(PLANE_MODES if space is None else SPACE_MODES):
        q = x[i, k]
        c1 += q * side[j, k, 0]
        c2 += q * side[j, k, 1]
        c3 += q * side[j, k, 2]
        w1 += q * side[j, k, 3]
        w2 += q * side[j, k, 4]
        if space is not None:
            w3 += q * side[j, k, 5]
    return c1, c2, c3, w1, w2, w3


@kernel(forceinline=True)
def slopes(u: Numbers) -> Numbers:
    """Motion c + w x (s, t, 0) of block a's face, like d and g of a joint.

    Parameters
    ----------
    u : displacement c [m] and rotation w [rad] of the face, three numbers each, in the joint's axes

    Returns
    -------
    c [m], then its slopes d/ds and d/dt component by component [-]: c1, c2, c3, 0, -w3, w3, 0, -w2, w1
    """
    return u[0], u[1], u[2], 0.0, -u[5], u[5], 0.0, -u[4], u[3]


@kernel(forceinline=True)
def turned_slopes(u: Numbers, g: Numbers, space: bool | None) -> Numbers:
    """Motion of block b's face by strains, R (c + w x X), X = (s, t, 0), in a's frame.

    The counterpart of :func:`slopes` for a face that has turned with its block by R = R_rel against block a.

    Parameters
    ----------
    u : displacement c [m] and rotation w [rad] of the face, three numbers each, in block b's axes
    g : first two columns of R - I, row by row: G11, G12, G21, G22, G31, G32 [-]; the third column of R follows
    space : None in a plane, where no face turns about its normal

    Returns
    -------
    R c [m], then d/ds and d/dt of R (w x X) [-], component by component: nine numbers as those of :func:`slopes`
    """
    # w x (s, t, 0) = (-w3 t, w3 s, w1 t - w2 s)
    z1, z2, z3 = third_axis(g)
    r11, r12, r21, r22, r31, r32 = 1.0 + g[0], g[1], g[2], 1.0 + g[3], g[4], g[5]
    c1, c2, c3, w1, w2, w3 = u
    d1, d2, d3 = r11 * c1 + r12 * c2 + z1 * c3, r21 * c1 + r22 * c2 + z2 * c3, r31 * c1 + r32 * c2 + z3 * c3
    if space is None:  # no face turns about its normal
        return d1, d2, d3, -z1 * w2, z1 * w1, -z2 * w2, z2 * w1, -z3 * w2, z3 * w1
    return (
        d1, d2, d3, r12 * w3 - z1 * w2, z1 * w1 - r11 * w3, r22 * w3 - z2 * w2, z2 * w1 - r21 * w3, r32 * w3 - z3 * w2,
        z3 * w1 - r31 * w3,
    )


@kernel(forceinline=True)
def turned_back(f1: float, f2: float, f3: float, g: Numbers) -> Numbers:
    """Vector (f1, f2, f3) along the joint's axes as block b carries them: R^T f.

    Parameters
    ----------
    f1, f2, f3 : its components along t1, t2, n
    g : first two columns of G = R - I of b against a: G11, G12, G21, G22, G31, G32; the third column of R follows
    """
    z1, z2, z3 = third_axis(g)
    return (
        (1.0 + g[0]) * f1 + g[2] * f2 + g[4] * f3, g[1] * f1 + (1.0 + g[3]) * f2 + g[5] * f3,
        z1 * f1 + z2 * f2 + z3 * f3,
    )


@kernel(forceinline=True)
def less(v: Numbers, u: Numbers) -> Numbers:
    """Motion v less motion u, nine numbers each as :func:`slopes` gives them."""
    return (
        v[0] - u[0], v[1] - u[1], v[2] - u[2], v[3] - u[3], v[4] - u[4], v[5] - u[5], v[6] - u[6], v[7] - u[7],
        v[8] - u[8],
    )


@kernel(forceinline=True)
def load_shapes(
    contact: Array, i: int, side: Array, j: int, sign: float, f: Numbers, s: Numbers, t: Numbers, space: bool | None
) -> None:
    """Add what a joint's forces do to the shapes of block i: work per unit of each.

    Parameters
    ----------
    contact : forces on the shapes of all blocks [N], added to, shape (blocks, shapes)
    i : the block
    side : displacement and rotation of the face by every shape, shape (joints, shapes, 6)
    j : the joint
    sign : -1 for block a, 1 for block b
    f, s, t : sums of f [N], s f and t f [N m] over the points, f being the force on b, in the axes of that side
    space : None in a plane, where faces do not turn about their normal
    """
    # moments about the joint's origin: t f3, -s f3 and s f2 - t f1
    f1, f2, f3, m1, m2, m3 = sign * f[0], sign * f[1], sign * f[2], sign * t[2], -sign * s[2], sign * (s[1] - t[0])
    for k in range(PLANE_MODES if space is None else SPACE_MODES):
        x = side[j, k, 0] * f1 + side[j, k, 1] * f2 + side[j, k, 2] * f3 + side[j, k, 3] * m1 + side[j, k, 4] * m2
        if space is not None:
            x += side[j, k, 5] * m3
        contact[i, k] += x


@kernel(forceinline=True)
def strained_sums(
    j: int, points: Points, joints: Joints, bodies: RigidBodies, modes: BlockModes, space: bool | None,
    axes: Axes, d: Numbers, g: Numbers, ra: Numbers, rb: Numbers, dt: float,
) -> Numbers:
    """Forces, moments and losses of joint j between blocks that strain.

    Forces on their shapes are added to these.

    Points within their strength are summed first; only a joint with one that is not is summed again by the whole law.

    Parameters
    ----------
    points, joints, bodies : all of them; points that yield are changed
    modes : shapes of all blocks; ``modes.contact`` is added to
    space : None in a plane
    axes : frame of the joint in global axes, rows t1, t2, n
    d : displacement of its origin in them, b against a [m]
    g : R_rel - I: G11, G12, G21, G22, G31, G32 [-]
    ra, rb : from both centroids to block a's joint origin, global axes [m]
    dt : step [s]; 0 for forces in a position

    Returns
    -------
    force on block b [N] and its moment about block a's joint origin [N m], three numbers each in the joint's axes, then
    work, lost, broken and beyond of :func:`dem.kernels.sums.point_sums`
    """
    a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
    # strains of either face move it by u and v, and b's against a's by e: the law sees d and G with e added
    u = slopes(face_motion(modes.side_a, j, modes.value, a, space))
    v = turned_slopes(face_motion(modes.side_b, j, modes.value, b, space), g, space)
    e, z = less(v, u), third_axis(g)
    d_all = d[0] + e[0], d[1] + e[1], d[2] + e[2]
    g_all = g[0] + e[3], g[1] + e[4], g[2] + e[5], g[3] + e[6], g[4] + e[7], g[5] + e[8]
    placed = d_all, g_all, z
    brakes, out = joints.law[j, LAW.dash] != 0.0 and dt > 0.0, NOTHING
    # the last argument of the three sums says that blocks strain; their last number counts points beyond their strength
    if not brakes:
        out = held_sums(j, points, joints, placed, True)
    if brakes or out[15] != 0.0:
        motion = relative_motion(j, joints, bodies, axes, ra, rb)
        rates = less(
            turned_slopes(face_motion(modes.side_b, j, modes.rate, b, space), g, space),
            slopes(face_motion(modes.side_a, j, modes.rate, a, space)),
        )
        if brakes:
            out = braked_sums(j, points, joints, placed, motion, rates, True)
        if out[15] != 0.0:
            out = yielding_sums(j, points, joints, placed, motion, rates, dt, True)
    f1, f2, f3, s1, s2, s3, t1, t2, t3, u1, u2, u3, work, lost, broken, beyond = out
    load_shapes(modes.contact, a, modes.side_a, j, -1.0, (f1, f2, f3), (s1, s2, s3), (t1, t2, t3), space)
    load_shapes(
        modes.contact, b, modes.side_b, j, 1.0, turned_back(f1, f2, f3, g), turned_back(s1, s2, s3, g),
        turned_back(t1, t2, t3, g), space,
    )
    # arms end in b's points: d + X + G X + z gap with b's strains and without a's. Columns x and y of I + G and b's
    # slopes lead along s and t: the moment is d x f + x x sum s f + y x sum t f + z x sum gap f
    d1, d2, d3 = d[0] + v[0], d[1] + v[1], d[2] + v[2]
    x1, x2, x3 = 1.0 + g[0] + v[3], g[2] + v[5], g[4] + v[7]
    y1, y2, y3 = g[1] + v[4], 1.0 + g[3] + v[6], g[5] + v[8]
    return (
        f1, f2, f3, d2 * f3 - d3 * f2 + x2 * s3 - x3 * s2 + y2 * t3 - y3 * t2 + z[1] * u3 - z[2] * u2,
        d3 * f1 - d1 * f3 + x3 * s1 - x1 * s3 + y3 * t1 - y1 * t3 + z[2] * u1 - z[0] * u3,
        d1 * f2 - d2 * f1 + x1 * s2 - x2 * s1 + y1 * t2 - y2 * t1 + z[0] * u2 - z[1] * u1, work, lost, broken, beyond,
    )


@kernel(inline="always")
def load_strain(modes: BlockModes, i: int, rot: Array, arms: Array, force: Array) -> None:
    """Loads of block i on its shapes, and the moment that its strain adds.

    They are written to ``modes.load``; the moment is added to ``force``.

    The point at r from the centroid goes to R (1 + sum of q_k G_k) r. With B_k = R G_k sum of r f^T the force on shape
    k is tr(B_k), and the moment grows by q_k times the axial vector of B_k.

    Parameters
    ----------
    rot : R - I of all blocks, shape (n, 3, 3)
    arms : sum of r f^T, reference axes [N m], shape (3, 3)
    force : of the loads on the block [N, N m], shape (6,)
    """
    for k in range(modes.value.shape[1]):
        load = 0.0
        for a in range(3):
            for b in range(3):
                # B_k of row a and column b
                entry = 0.0
                for r in range(3):
                    turn = rot[i, a, r] + (1.0 if a == r else 0.0)
                    for s in range(3):
                        entry += turn * modes.gradient[i, k, r, s] * arms[s, b]
                if a == b:
                    load += entry
                else:
                    # the axial vector is (B_yz - B_zy, B_zx - B_xz, B_xy - B_yx)
                    axis, sense = 3 - a - b, 1.0 if (b - a) % 3 == 1 else -1.0
                    force[3 + axis] += sense * entry * modes.value[i, k]
        modes.load[i, k] = load


@kernel(forceinline=True)
def move_modes(modes: BlockModes, step: BlockStep, local: float, drifts: bool | None) -> tuple[float, float, float]:
    """Move the shapes of all blocks by a step.

    Parameters
    ----------
    modes : coordinates, rates and forces of the shapes, changed
    step : time step and factors of the scheme, see :class:`dem.kernels.arrays.BlockStep`
    local : factor of local damping [-]
    drifts : whether motion is steady, and damping the combined one; None where it never is

    Returns
    -------
    kinetic : kinetic energy of the shapes [J]
    damping : what damping took in the step [J]
    applied : work of the loads on the shapes in the step [J]
    """
    value, rate, net = modes.value, modes.rate, modes.net
    dt, kick, viscosity, keep, lag = step
    kinetic = damping = applied = 0.0
    for i in range(value.shape[0]):
        squares = 0.0
        for k in range(value.shape[1]):
            squares += rate[i, k] * rate[i, k]
        least = ROUNDING * np.sqrt(squares)  # a shape that is not excited moves by rounding: its sign says nothing
        for k in range(value.shape[1]):
            if modes.inv_mass[i, k] == 0.0:
                continue  # the block has no such shape
            f = modes.contact[i, k] - modes.stiffness[i, k] * value[i, k] + modes.load[i, k]
            v = float(rate[i, k])
            brake = brake_of(local, drifts, f, net[i, k], v * (abs(v) > least))
            net[i, k] = f
            new = (v * keep + (f - brake) * modes.inv_mass[i, k] * kick) * lag
            damping += brake * 0.5 * (v + new) * dt
            applied += modes.load[i, k] * 0.5 * (v + new) * dt
            damping += viscosity * modes.mass[i, k] * (0.5 * (v + new)) ** 2 * dt
            rate[i, k] = new
            kinetic += 0.5 * modes.mass[i, k] * new * new
            value[i, k] += dt * new
    return kinetic, damping, applied


@kernel(fast=False)
def deformation_at(
    j: int, joints: Joints, modes: BlockModes, space: bool | None, g: Numbers, x: float, y: float
) -> Numbers:
    """Displacement by deformation at a point: of b's face against a's, then of a's.

    Both are three components [m] in the joint's axes: c + d/ds x + d/dt y of motions as :func:`slopes` lays them out.

    Parameters
    ----------
    j : the joint
    joints, modes : all joints, and the shapes of all blocks
    space : True in space, None in a plane, as ``State.space``
    g : R_rel - I: G11, G12, G21, G22, G31, G32 [-]
    x, y : place of the point along t1 and t2 [m]
    """
    # nine numbers each: u of a's face, v of b's in a's axes, e of b's against a's
    u = slopes(face_motion(modes.side_a, j, modes.value, joints.block_a[j], space))
    v = turned_slopes(face_motion(modes.side_b, j, modes.value, joints.block_b[j], space), g, space)
    e = less(v, u)
    return (
        e[0] + e[3] * x + e[4] * y, e[1] + e[5] * x + e[6] * y, e[2] + e[7] * x + e[8] * y,
        u[0] + u[3] * x + u[4] * y, u[1] + u[5] * x + u[6] * y, u[2] + u[7] * x + u[8] * y,
    )
