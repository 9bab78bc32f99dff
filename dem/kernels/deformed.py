"""Joints between blocks that deform in modes: displacements and forces at their points as polynomials on the joint.

The total relative displacement at a point is that of the rigid motions plus R_rel phi_b q_b - phi_a q_a, phi the shapes
of either block at its material point, each carried by its block: a block that turns keeps its strains. On the plane of
a joint a quadratic shape is a quadratic of the point's coordinates, so that a joint needs the coefficients of both
sides once, and hands back the moments sum (1, p, p^2) f of its forces; what acts on a mode is their product.
"""

import numpy as np

from dem.kernels.arrays import E_FRACTURE, E_FRICTION, E_VISCOUS, LAW, Array, Bodies, Joints, Modes, Points
from dem.kernels.braking import against_change
from dem.kernels.compiled import kernel
from dem.kernels.deformed_plane import _plane_joint, _side, _turn_in_plane, _turned_side
from dem.kernels.deformed_space import _quadratic, _space_joint, _space_side, _space_turn
from dem.kernels.forces import Numbers, add_wrench
from dem.kernels.kinematics import _kinematics


@kernel(forceinline=True)
def _modal_forces(
    points: Points, joints: Joints, bodies: Bodies, modes: Modes, space: bool | None, dt: float, total: Array,
    scratch: Array,
) -> None:  # fmt: skip
    """Fill ``bodies.contact`` and ``modes.contact`` from all joints and update the plastic state of their points.

    ``space`` is None in a plane: the compiler then leaves out what is for space.
    """
    contact, vel, spin = bodies.contact, bodies.vel, bodies.spin
    value, rate, on_modes, one, two = modes.value, modes.rate, modes.contact, modes.side_a, modes.side_b
    along, pad = modes.along, modes.pad
    contact[:] = 0.0
    on_modes[:] = 0.0
    law = joints.law
    s, t, area, gap, damage = points.s, points.t, points.area, points.gap, points.damage
    slip_1, slip_2, lift = points.slip_1, points.slip_2, points.lift
    friction = viscous = fracture = 0.0
    for j in range(joints.block_a.size):
        if law[j, LAW.cross] != 0.0:
            continue
        a, b = np.uint64(joints.block_a[j]), np.uint64(joints.block_b[j])
        p0, p1 = joints.start[j], joints.start[j + 1]
        axes, d, g, ra, rb = _kinematics(j, joints, bodies)
        if space is None:
            out = _plane_joint(
                j, a, b, p0, p1, s, t, area, gap, slip_1, slip_2, lift, damage, law, vel, spin, value, rate, on_modes,
                one, two, along, axes, d, g, ra, rb, dt,
            )  # fmt: skip
        else:
            out = _space_joint(
                j, a, b, p0, p1, s, t, area, gap, slip_1, slip_2, lift, damage, law, vel, spin, value, rate, on_modes,
                one, two, pad, axes, d, g, ra, rb, dt, scratch,
            )  # fmt: skip
        friction += out[6]
        viscous += out[7] * dt
        fracture += out[8]
        add_wrench(contact, a, b, axes, out, ra, rb)
    total[E_FRICTION] += friction
    total[E_VISCOUS] += viscous
    total[E_FRACTURE] += fracture


@kernel(forceinline=True)
def _move_modes(
    modes: Modes, dt: float, kick: float, local: float, drifts: bool | None, viscosity: float, keep: float,
    lag: float,
) -> tuple[float, float]:  # fmt: skip
    """A step of the modal coordinates; returns kinetic energy and what damping took [J]."""
    value, rate, net = modes.value, modes.rate, modes.net
    kinetic = damping = 0.0
    for i in range(value.shape[0]):
        for k in range(value.shape[1]):
            if modes.inv_mass[i, k] == 0.0:
                continue
            f = modes.contact[i, k] - modes.stiffness[i, k] * value[i, k]
            past = net[i, k]
            net[i, k] = f
            v = rate[i, k]
            brake = local * abs(f) * (int(v > 0.0) - int(v < 0.0))
            if drifts is not None and drifts:
                brake = against_change(local, f, f - past, brake)
            new = (v * keep + (f - brake) * modes.inv_mass[i, k] * kick) * lag
            damping += brake * 0.5 * (v + new) * dt
            damping += viscosity * modes.mass[i, k] * (0.5 * (v + new)) ** 2 * dt
            rate[i, k] = new
            kinetic += 0.5 * modes.mass[i, k] * new * new
            value[i, k] += dt * new
    return kinetic, damping


@kernel(fast=False)
def deformation_at(
    j: int, joints: Joints, modes: Modes, space: bool | None, g: Numbers, k: int, points: Points, scratch: Array,
) -> Numbers:  # fmt: skip
    """Relative displacement by deformation at point k of joint j, and a's own part of it, joint axes (3), (3)."""
    a, b = joints.block_a[j], joints.block_b[j]
    x, y = points.s[k], points.t[k]
    if space is not None:
        one, two = scratch[0], scratch[1]
        _space_side(modes.side_a, j, modes.value, a, one)
        _space_side(modes.side_b, j, modes.value, b, two)
        _space_turn(two, g, False)
        u1, u2, u3 = _quadratic(one, 0, x, y), _quadratic(one, 6, x, y), _quadratic(one, 12, x, y)
        v1, v2, v3 = _quadratic(two, 0, x, y), _quadratic(two, 6, x, y), _quadratic(two, 12, x, y)
    else:
        al, be = modes.along[j, 0], modes.along[j, 1]
        cos, sin = _turn_in_plane(g, al, be)
        p = al * x + be * y
        c = _side(modes.side_a, j, modes.value, a)
        e = _turned_side(_side(modes.side_b, j, modes.value, b), cos, sin)
        slide, u3 = c[0] + p * (c[1] + p * c[2]), c[3] + p * (c[4] + p * c[5])
        u1, u2 = al * slide, be * slide
        slide, v3 = e[0] + p * (e[1] + p * e[2]), e[3] + p * (e[4] + p * e[5])
        v1, v2 = al * slide, be * slide
    return v1 - u1, v2 - u2, v3 - u3, u1, u2, u3
