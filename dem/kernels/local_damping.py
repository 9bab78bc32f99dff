"""Local damping: what it takes of a force while blocks, their shapes and the nodes of zones move."""

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


@kernel(inline="always")
def brake_of(local: float, drifts: bool | None, force: float, past: float, speed: float) -> float:
    """Cundall's local damping of an unbalanced force F [N], or moment: local |F| sign(v).

    Parameters
    ----------
    local : factor of local damping [-]
    drifts : whether motion is steady, and damping the combined one; None where it never is
    force, past : unbalanced force now and in the step before
    speed : velocity before the step
    """
    v = float(speed)
    # a sign without branches: which way a freedom moves cannot be foretold, and a third of a step went into guessing
    brake = local * abs(force) * ((v > 0.0) - (v < 0.0))
    if drifts is not None and drifts:
        brake = against_change(local, force, force - past, brake)
    return brake
