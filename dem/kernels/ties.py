"""Forces of ties: springs between points of blocks that pull, yield, hang loose."""

import numpy as np

from dem.kernels.arrays import E_FRICTION, Array, RigidBodies, Ties
from dem.kernels.compiled import kernel
from dem.kernels.kinematics import cross, dot, turn_row


@kernel(fast=False)
def add_tie_forces(ties: Ties, bodies: RigidBodies, total: Array, sums: int = 0) -> None:
    """Add the forces of all ties to the blocks and let them yield.

    0 <= T = k (elongation - plastic) <= strength.

    Parameters
    ----------
    ties : all ties; ``ties.plastic`` grows where they yield
    bodies : blocks; wrenches are added to ``bodies.contact``
    total : accumulated energies [J], added to
    sums : entry of ``total`` with which they begin
    """
    rot, shift, contact = bodies.rot, bodies.shift, bodies.contact
    for j in range(ties.block_a.size):
        a, b = ties.block_a[j], ties.block_b[j]
        ca, cb = ties.arm_a[j], ties.arm_b[j]
        # arms in global axes, and the displacement of end b against end a
        pa = turn_row(rot, a, ca[0], ca[1], ca[2])
        pb = turn_row(rot, b, cb[0], cb[1], cb[2])
        span = ties.span[j]
        d0 = shift[b, 0] - shift[a, 0] + (pb[0] - cb[0]) - (pa[0] - ca[0])
        d1 = shift[b, 1] - shift[a, 1] + (pb[1] - cb[1]) - (pa[1] - ca[1])
        d2 = shift[b, 2] - shift[a, 2] + (pb[2] - cb[2]) - (pa[2] - ca[2])
        now = (span[0] + d0, span[1] + d1, span[2] + d2)
        length = np.sqrt(dot(now, now))
        # L - L0 = (L^2 - L0^2) / (L + L0) without cancellation
        both = d0 * (span[0] + now[0]) + d1 * (span[1] + now[1]) + d2 * (span[2] + now[2])
        longer = both / (length + ties.length[j])
        pull = ties.stiffness[j] * (longer - ties.plastic[j])
        if pull > ties.strength[j]:
            more = (pull - ties.strength[j]) / ties.stiffness[j]
            ties.plastic[j] += more
            total[sums + E_FRICTION] += ties.strength[j] * more
            pull = ties.strength[j]
        if pull > 0.0:
            # on block a, which is drawn towards b
            f = (pull * now[0] / length, pull * now[1] / length, pull * now[2] / length)
            ma, mb = cross(pa, f), cross(pb, f)
            for i in range(3):
                contact[a, i] += f[i]
                contact[a, 3 + i] += ma[i]
                contact[b, i] -= f[i]
                contact[b, 3 + i] -= mb[i]
