"""Forces of the joints on the blocks: sums over all points, and crossing edges.

The axes of a joint turn with its block a: ``kinematics``.
"""

import numpy as np

from dem.kernels.added_terms import Numbers
from dem.kernels.arrays import (
    E_FRACTURE,
    E_FRICTION,
    E_SIZE,
    E_VISCOUS,
    LAW,
    Array,
    BlockModes,
    Joints,
    Part,
    Points,
    RigidBodies,
)
from dem.kernels.compiled import kernel
from dem.kernels.deformed import strained_sums
from dem.kernels.joint_law import return_map
from dem.kernels.joint_strength import Peak
from dem.kernels.kinematics import Axes, cross, crossing, dot, kinematics, third_axis
from dem.kernels.sums import joint_sums


@kernel(fast=False)
def _crossing_forces(
    points: Points, joints: Joints, bodies: RigidBodies, dt: float, total: Array, part: Part
) -> None:
    """Add the forces of all crossing edges.

    A call from the loop of :func:`_joint_forces` would slow that by half.

    Their law has no cohesion, tension or dilation, and no added terms: what slips there is not counted and does no
    damage. Friction is what the damage has left that the point inherited.

    Parameters
    ----------
    points, joints, bodies : all of them; wrenches are added to ``bodies.contact``, crossing points are changed
    dt : length of the step that led here [s]; 0 to read forces without moving anything
    total : energies by ``E_...`` [J], added to
    part : joints, and where their sums go
    """
    law, contact, vel, spin = joints.law, bodies.contact, bodies.vel, bodies.spin
    per_dt = 1.0 / dt if dt > 0.0 else 0.0
    for j in range(part.first, part.end):
        if law[j, LAW.cross] == 0.0:
            continue
        a, b, k = joints.block_a[j], joints.block_b[j], joints.start[j]
        (t1, t2, n), distance, ra, rb = crossing(j, joints, bodies)
        mu = law[j, LAW.tan_phi] + points.damage[k] * (law[j, LAW.rest_tan_phi] - law[j, LAW.tan_phi])
        w, old = distance + points.gap[k], points.lift[k]
        if not w < old:
            # open: the elastic slip is lost
            points.slip_1[k] = points.slip_2[k] = 0.0
            continue
        wa, wb = cross((spin[a, 0], spin[a, 1], spin[a, 2]), ra), cross((spin[b, 0], spin[b, 1], spin[b, 2]), rb)
        va = (vel[a, 0] + wa[0], vel[a, 1] + wa[1], vel[a, 2] + wa[2])
        vb = (vel[b, 0] + wb[0], vel[b, 1] + wb[1], vel[b, 2] + wb[2])
        # velocity of b's edge against a's at the place where they pass [m/s]
        r1, r2, r3 = dot(vb, t1) - dot(va, t1), dot(vb, t2) - dot(va, t2), dot(vb, n) - dot(va, n)
        # no dilation, cohesion, tension, largest plastic opening or added terms: these are the zeros and the None
        peak = Peak(law[j, LAW.kn], law[j, LAW.ks], mu, 0.0, 0.0, 0.0, law[j, LAW.crushing], 0.0, None)
        dashpot = law[j, LAW.dash] if dt > 0.0 else 0.0, r1, r2, r3, per_dt
        # the point moves along both edges, so that its shear displacement is summed: all of it is in the slip. The law
        # is given none beside it, and no damage or softening; True lets it crush
        a1, a2 = points.slip_1[k] - dt * r1, points.slip_2[k] - dt * r2
        q1, q2, q3, points.slip_1[k], points.slip_2[k], points.lift[k], _, rubbed, raised, braked, _ = return_map(
            w, 0.0, 0.0, a1, a2, old, 0.0, peak, None, dashpot, True, (dt * r1, dt * r2, dt * r3)
        )
        da = points.area[k]  # the law gives stresses
        q = (q1 * da, q2 * da, q3 * da)
        f = dot((t1[0], t2[0], n[0]), q), dot((t1[1], t2[1], n[1]), q), dot((t1[2], t2[2], n[2]), q)
        ma, mb = cross(ra, f), cross(rb, f)
        to_a, to_b = part.row + a, part.row + b
        for i in range(3):
            contact[to_a, i] -= f[i]
            contact[to_a, 3 + i] -= ma[i]
            contact[to_b, i] += f[i]
            contact[to_b, 3 + i] += mb[i]
        total[part.sums + E_VISCOUS] += da * braked * dt
        total[part.sums + E_FRICTION] += da * (rubbed - raised)


@kernel(inline="always")
def add_wrench(
    contact: Array, a: int, b: int, axes: Axes, force: Numbers, moment: Numbers, ra: Numbers, rb: Numbers
) -> None:
    """Add force and moment of a joint, in its axes, to b and their opposites to a.

    Parameters
    ----------
    contact : wrench on every block about its centroid [N, N m], added to, shape (n, 6)
    a, b : rows of ``contact`` of the two blocks
    axes : rows t1, t2, n of the joint in global axes
    force, moment : on b about the joint's origin, along t1, t2, n [N], [N m]
    ra, rb : arms from either centroid to the joint's origin, global axes [m]
    """
    f0 = axes[0][0] * force[0] + axes[1][0] * force[1] + axes[2][0] * force[2]
    f1 = axes[0][1] * force[0] + axes[1][1] * force[1] + axes[2][1] * force[2]
    f2 = axes[0][2] * force[0] + axes[1][2] * force[1] + axes[2][2] * force[2]
    m0 = axes[0][0] * moment[0] + axes[1][0] * moment[1] + axes[2][0] * moment[2]
    m1 = axes[0][1] * moment[0] + axes[1][1] * moment[1] + axes[2][1] * moment[2]
    m2 = axes[0][2] * moment[0] + axes[1][2] * moment[1] + axes[2][2] * moment[2]
    contact[a, 0] -= f0
    contact[a, 1] -= f1
    contact[a, 2] -= f2
    contact[a, 3] -= m0 + ra[1] * f2 - ra[2] * f1
    contact[a, 4] -= m1 + ra[2] * f0 - ra[0] * f2
    contact[a, 5] -= m2 + ra[0] * f1 - ra[1] * f0
    contact[b, 0] += f0
    contact[b, 1] += f1
    contact[b, 2] += f2
    contact[b, 3] += m0 + rb[1] * f2 - rb[2] * f1
    contact[b, 4] += m1 + rb[2] * f0 - rb[0] * f2
    contact[b, 5] += m2 + rb[0] * f1 - rb[1] * f0


@kernel(forceinline=True)
def _joint_forces(
    points: Points, joints: Joints, bodies: RigidBodies, dt: float, total: Array, part: Part,
    modes: BlockModes | None = None, space: bool | None = None,
) -> None:
    """Add the forces of a part of the joints, but not of edges that cross.

    Their points are updated.

    Parameters
    ----------
    points, joints : all of them; points that yield are changed
    bodies : blocks; wrenches are added to ``bodies.contact``
    dt : length of the step that led here [s]; 0 to read forces without moving anything
    total : accumulated scalars, entries ``E_...``, added to [J]
    part : which joints, and where their sums go
    modes : shapes of blocks that deform, ``modes.contact`` is added to; None where all blocks are rigid
    space : None where blocks strain in a plane; what is None the compiler leaves out
    """
    contact, law = bodies.contact, joints.law
    friction = viscous = fracture = 0.0
    for j in range(part.first, part.end):
        if law[j, LAW.cross] != 0.0:
            continue
        a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
        axes, d, g, ra, rb = kinematics(j, joints, bodies)
        if modes is None:
            sums = joint_sums(j, points, joints, bodies, axes, (d, g, third_axis(g)), (ra, rb), dt)
        else:
            sums = strained_sums(j, points, joints, bodies, modes, space, axes, d, g, ra, rb, dt)
        f1, f2, f3, m1, m2, m3, rubbed, braked, broken, _ = sums
        friction += rubbed
        viscous += braked * dt
        fracture += broken
        row = np.uint64(part.row)
        add_wrench(contact, row + a, row + b, axes, (f1, f2, f3), (m1, m2, m3), ra, rb)
    total[part.sums + E_FRICTION] += friction
    total[part.sums + E_VISCOUS] += viscous
    total[part.sums + E_FRACTURE] += fracture


@kernel(counted=True)
def contact_wrenches(points: Points, joints: Joints, bodies: RigidBodies) -> None:
    """Wrench of the joints on every rigid block as it lies, about its centroid.

    It is written to ``bodies.contact``, [N] and [N m], shape (n, 6). Points and crossing edges of ``joints`` yield as
    in a step: their state may change. Energies are not kept.
    """
    part, total = Part(0, joints.block_a.size, 0, 0), np.zeros(E_SIZE)
    bodies.contact[:] = 0.0
    _joint_forces(points, joints, bodies, 0.0, total, part)
    _crossing_forces(points, joints, bodies, 0.0, total, part)
