"""Local damping: what it takes of a force on blocks, their shapes and nodes."""

import numpy as np

from dem.kernels.arrays import Array, RigidBodies
from dem.kernels.compiled import kernel

ROUNDING = 1e-12  # velocity over the speed of its block below which it has no sign


@kernel(forceinline=True)
def against_change(local: float, force: float, change: float, brake: float) -> float:
    """Combined damping: half of the local one, and half against the change of force.

    brake = local |F| (sign(v) - sign(dF)) / 2: nothing in the mean where velocity keeps its sign and force swings.

    Parameters
    ----------
    local : factor of local damping [-]
    force : unbalanced force [N], or moment [N m]
    change : of it in the last step, in the same unit
    brake : local |F| sign(v), of local damping, in the same unit

    References
    ----------
    P. A. Cundall, combined damping of UDEC and FLAC: the sign of the velocity is taken from the change of the force.
    """
    sign = 1.0 if change > 0.0 else -1.0 if change < 0.0 else 0.0
    return 0.5 * (brake - local * abs(force) * sign)


@kernel(inline="always")
def brake_of(local: float, drifts: bool | None, force: float, past: float, speed: float) -> float:
    """Cundall's local damping: local |F| sign(v), to be taken from the unbalanced F.

    F is a force [N] or moment.

    Parameters
    ----------
    local : factor of local damping [-]
    drifts : whether motion is steady, and damping the combined one; None where it never is
    force, past : unbalanced force now and in the step before [N], or moments [N m]
    speed : velocity before the step [m/s], or spin [rad/s]; only its sign counts
    """
    v = float(speed)
    # a sign without branches: which way a freedom moves cannot be foretold, and a third of a step went into guessing
    brake = local * abs(force) * ((v > 0.0) - (v < 0.0))
    if drifts is not None and drifts:
        brake = against_change(local, force, force - past, brake)
    return brake


@kernel(inline="always")
def least_speeds(bodies: RigidBodies, i: int) -> tuple[float, float]:
    """Velocity [m/s] and spin [rad/s] up to which a motion of block i is rounding.

    What a motion does not excite moves by rounding, up or down as the structure stands in space: its sign would turn
    all of its damping about.

    Parameters
    ----------
    bodies : all blocks
    i : number of the block
    """
    moves = turns = 0.0
    for k in range(3):
        moves += bodies.vel[i, k] * bodies.vel[i, k]
        turns += bodies.spin[i, k] * bodies.spin[i, k]
    inv = bodies.inv_inertia[i]
    # 1 / r^2 of a radius about as large as those of gyration
    per = max(bodies.mass[i] * (inv[0, 0] + inv[1, 1] + inv[2, 2]), 1e-300)
    return ROUNDING * np.sqrt(moves + turns / per), ROUNDING * np.sqrt(moves * per + turns)


@kernel(inline="always")
def brakes_of(
    local: float, drifts: bool | None, force: Array, i: int, at: int, past: Array, speed: Array, least: float,
    held: Array, axes: Array,
) -> tuple[float, float, float]:
    """Local damping of block i's unbalanced force [N] or moment [N m], along x, y, z.

    It is worked out along each of the block's own axes by itself. What moves steadily along one axis then brakes
    nothing along the others, however the structure stands in space.

    Parameters
    ----------
    local, drifts : as :func:`brake_of` takes them
    force : unbalanced forces [N] and moments [N m] of all blocks, shape (n, 6)
    i : number of the block
    at : first of the three columns of ``force``, ``held`` and ``past`` that are meant: 0 for forces, 3 for moments
    past : those of the block in the step before, shape (6,)
    speed : velocity [m/s] or spin [rad/s] of all blocks before the step, shape (n, 3)
    least : speed up to which it has no sign, see :func:`least_speeds`
    held : degrees of freedom that are held and do not count, shape (n, 6)
    axes : see :class:`dem.kernels.arrays.RigidBodies`, shape (n, 3, 3)
    """
    x = y = z = 0.0
    for c in range(3):
        f = v = before = 0.0
        for k in range(3):
            if not held[i, at + k]:
                f += axes[i, c, k] * force[i, at + k]
                v += axes[i, c, k] * speed[i, k]
                if drifts is not None:
                    before += axes[i, c, k] * past[at + k]
        brake = brake_of(local, drifts, f, before, v * (abs(v) > least))
        x += brake * axes[i, c, 0]
        y += brake * axes[i, c, 1]
        z += brake * axes[i, c, 2]
    return x, y, z
