"""What the joints carry in the present position, without changing their state."""

from dem.kernels.arrays import LAW, Array, BlockModes, Joints, Points, RigidBodies
from dem.kernels.compiled import kernel
from dem.kernels.deformed import deformation_at
from dem.kernels.joint_law import stress
from dem.kernels.joint_strength import peak_of, softening_of
from dem.kernels.kinematics import crossing, kinematics, third_axis


@kernel(fast=False)
def measure(
    points: Points, joints: Joints, bodies: RigidBodies, position: Array, force: Array, opening: Array, slip: Array,
    modes: BlockModes | None = None, space: bool | None = None,
) -> float:
    """Places, forces, openings and slips of contact points now; changes no state.

    Parameters
    ----------
    points, joints, bodies : all of them
    position : block b's material points now less the reference centroid of b, global axes [m], written, shape (m, 3)
    force : on block b, global axes [N], written, shape (m, 3)
    opening : w - w_p, total opening less dilation, negative where pressed [m], written, shape (m,)
    slip : total slip of b against a along t1, t2 [m], written, shape (m, 2)
    modes, space : of blocks that deform, see :func:`dem.kernels.advance`

    Returns
    -------
    elastic energy : sum of (N^2 / kn + T^2 / ks) A / 2, and ft A times the opening beyond the tension cut-off, and the
        strain energy of the blocks [J]
    """
    energy = 0.0
    if modes is not None:
        for b in range(modes.value.shape[0]):
            for k in range(modes.value.shape[1]):
                energy += modes.stiffness[b, k] * modes.value[b, k] * modes.value[b, k]
        energy *= 0.5
    for j in range(joints.block_a.size):
        b = joints.block_b[j]
        law = joints.law[j]
        kn, ks, fc = law[LAW.kn], law[LAW.ks], law[LAW.crushing]
        # two edges that cross have one point, without strains of their blocks and without tension
        if law[LAW.cross] != 0.0:
            axes, far, _, rb = crossing(j, joints, bodies)
            k = joints.start[j]
            opening[k], slip[k, 0], slip[k, 1] = far + points.gap[k] - points.lift[k], 0.0, 0.0
            # the law keeps the crushing strength over kn, as an opening
            n = min(max(-kn * opening[k], 0.0), kn * fc)
            t1, t2 = ks * points.slip_1[k], ks * points.slip_2[k]
            energy += points.area[k] * 0.5 * (n * n / kn + (t1 * t1 + t2 * t2) / ks)
            for r in range(3):
                force[k, r] = points.area[k] * (axes[0][r] * t1 + axes[1][r] * t2 + axes[2][r] * n)
                position[k, r] = rb[r] + bodies.shift[b, r]
            continue
        axes, d, g, _, rb = kinematics(j, joints, bodies)
        z1, z2, z3 = third_axis(g)
        peak, softening = peak_of(joints.law, j), softening_of(joints.law, j)
        for k in range(joints.start[j], joints.start[j + 1]):
            # displacement of b against a at the point: slip e1, e2 and opening w, as in sums.point_sums
            x, y, far, h = points.s[k], points.t[k], points.gap[k], points.damage[k]
            e1 = d[0] + g[0] * x + g[1] * y + z1 * far
            e2 = d[1] + g[2] * x + g[3] * y + z2 * far
            w = d[2] + g[4] * x + g[5] * y + z3 * far
            u1 = u2 = u3 = 0.0  # displacement of a's face by its strains, which carries the point along
            if modes is not None:
                r1, r2, r3, u1, u2, u3 = deformation_at(j, joints, modes, space, g, x, y)
                e1, e2, w = e1 + r1, e2 + r2, w + r3
            t1, t2, n, elastic = stress(
                w, e1, e2, points.slip_1[k], points.slip_2[k], points.lift[k], h, peak, softening
            )
            opening[k] = w - points.lift[k]
            slip[k, 0], slip[k, 1] = e1, e2
            energy += points.area[k] * elastic
            px, py, pz = x + e1 + u1, y + e2 + u2, w + u3
            for r in range(3):
                force[k, r] = points.area[k] * (axes[0][r] * t1 + axes[1][r] * t2 + axes[2][r] * n)
                position[k, r] = rb[r] + bodies.shift[b, r] + axes[0][r] * px + axes[1][r] * py + axes[2][r] * pz
    return energy
