"""Damping of steady motion."""

from dem.kernels.compiled import kernel


@kernel(forceinline=True)
def against_change(local: float, force: float, change: float, brake: float) -> float:
    """Combined damping from local damping: half of it, and half against the change of the force.

    brake = local |F| (sign(v) - sign(dF)) / 2: nothing in the mean where velocity keeps its sign and force swings.

    Parameters
    ----------
    local : factor of local damping [-]
    force : unbalanced force [N], or moment
    change : of it in the last step
    brake : local |F| sign(v), of local damping

    References
    ----------
    P. A. Cundall, combined damping of UDEC and FLAC: the sign of the velocity is taken from the change of the force.
    """
    way = 1.0 if change > 0.0 else -1.0 if change < 0.0 else 0.0
    return 0.5 * (brake - local * abs(force) * way)
