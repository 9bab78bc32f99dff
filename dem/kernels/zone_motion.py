"""Equation of motion of zones' nodes and of rigid blocks among them, in the plane and in space."""

from dem.kernels.arrays import Array
from dem.kernels.braking import against_change
from dem.kernels.compiled import kernel
from dem.kernels.solid_arrays import RigidSolids
from dem.kernels.zone_arrays import Z_APPLIED, Z_DAMPING, Z_KINETIC, Z_STEPS, Z_SUPPORT, Nodes, Rigid


@kernel(forceinline=True)
def brake_of(local: float, drifts: bool, force: float, change: float, speed: float) -> float:
    """Cundall's local damping, or his combined one where motion is steady: against the change of the force too."""
    brake = local * abs(force) * (1.0 if speed > 0.0 else -1.0 if speed < 0.0 else 0.0)
    return against_change(local, force, change, brake) if drifts else brake


@kernel(forceinline=True)
def move(
    nodes: Nodes, rigid: Rigid | RigidSolids, total: Array, axes: int, freedoms: int, dt: float, local: float,
    drifts: bool,
) -> None:  # fmt: skip
    """One step of F - brake = m dv / dt for nodes of zones and for rigid blocks, without what they carry along.

    Parameters
    ----------
    total : sums of work, see the ``Z_`` entries
    axes, freedoms : of a node and of a rigid block, (2, 3) in the plane and (3, 6) in space; literals, for the compiler
    dt, local, drifts : as :func:`dem.kernels.zones.advance_zones` takes them
    """
    force, shift, velocity = nodes.force, nodes.shift, nodes.velocity
    applied = support = damping = kinetic = 0.0
    for i in range(nodes.mass.size):
        if nodes.body[i] >= 0:
            continue
        inverse = dt / nodes.mass[i]
        for r in range(axes):
            f, v = force[i, r], velocity[i, r]
            if nodes.held[i, r]:
                shift[i, r] += dt * v
                support -= f * v * dt
                applied += nodes.load[i, r] * v * dt
                continue
            brake = brake_of(local, drifts, f, f - nodes.before[i, r], v)
            nodes.before[i, r] = f
            new = v + (f - brake) * inverse
            mean = 0.5 * (v + new)
            velocity[i, r] = new
            shift[i, r] += dt * new
            damping += brake * mean * dt
            applied += nodes.load[i, r] * mean * dt
            kinetic += 0.5 * nodes.mass[i] * new * new
    for b in range(rigid.centre.shape[0]):
        for r in range(freedoms):
            f, v = rigid.net[b, r], rigid.velocity[b, r]
            rigid.total[b, r] += f
            if rigid.held[b, r]:
                new = rigid.drive[b, r]
                mean = 0.5 * (v + new)
                support -= f * mean * dt
            else:
                brake = brake_of(local, drifts, f, f - rigid.before[b, r], v)
                rigid.before[b, r] = f
                new = v + (f - brake) * dt / rigid.mass[b, r]
                mean = 0.5 * (v + new)
                damping += brake * mean * dt
                kinetic += 0.5 * rigid.mass[b, r] * new * new
            applied += rigid.load[b, r] * mean * dt
            rigid.velocity[b, r] = new
            rigid.shift[b, r] += dt * new
    total[Z_APPLIED] += applied
    total[Z_SUPPORT] += support
    total[Z_DAMPING] += damping
    total[Z_KINETIC] = kinetic
    total[Z_STEPS] += 1.0
