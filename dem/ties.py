"""Ties in the DEM: springs between two points of blocks that pull, yield at their strength and hang loose after it."""

import numpy as np
from numpy.typing import NDArray

from dem.kernels import Bodies, Ties
from limitmason.model import Assembly
from limitmason.stiffness import TIE_STRETCH, default_tie_stiffness

Array = NDArray[np.float64]

_PLACES = np.zeros((0, 3))
NO_TIES = Ties(
    np.zeros(0, np.int64), np.zeros(0, np.int64), _PLACES, _PLACES, _PLACES, *(np.zeros(0) for _ in range(4))
)


def make_ties(assembly: Assembly, factor: float = 1.0) -> tuple[Ties, tuple[str, ...]]:
    """Kernel arrays of the ties in the reference position, without force, and what a user should know about them.

    Parameters
    ----------
    factor : on all stiffnesses, as ``JointOptions.stiffness_factor``
    """
    rows = slice(len(assembly.interfaces), None)
    x = assembly.links
    a, b = x.block_a[rows].astype(np.int64), x.block_b[rows].astype(np.int64)
    ends = np.array([t.ends for t in assembly.ties]).reshape(-1, 2, 3)
    span = ends[:, 1] - ends[:, 0]
    strength, stiffness = x.compressive_strength[rows].copy(), x.normal_stiffness[rows].copy()
    without = np.isnan(stiffness)
    warnings: tuple[str, ...] = ()
    if without.any():
        stiffness[without] = default_tie_stiffness(assembly, strength[without])
        warnings = (
            f"{np.count_nonzero(without)} of {len(without)} ties name no stiffness: they reach their strength when "
            f"stretched by {TIE_STRETCH:g} of a block; it is not a material property",
        )
    return Ties(
        a, b, ends[:, 0] - x.centroid[a], ends[:, 1] - x.centroid[b], span, np.linalg.norm(span, axis=1),
        factor * stiffness, strength, np.zeros(len(a)),
    ), warnings  # fmt: skip


def elongation(ties: Ties, bodies: Bodies) -> Array:
    """Elongation of every tie in the present position, without cancellation [m], shape (t,)."""
    moved = [
        bodies.shift[block] + np.einsum("tij,tj->ti", bodies.rot[block], arm)
        for block, arm in ((ties.block_a, ties.arm_a), (ties.block_b, ties.arm_b))
    ]
    change = moved[1] - moved[0]
    now = ties.span + change
    return np.asarray((change * (ties.span + now)).sum(axis=1) / (np.linalg.norm(now, axis=1) + ties.length))


def pulls(ties: Ties, bodies: Bodies) -> Array:
    """Tension of every tie in the present position [N], shape (t,); nothing yields."""
    if not len(ties.block_a):
        return np.zeros(0)
    return np.asarray(np.clip(ties.stiffness * (elongation(ties, bodies) - ties.plastic), 0.0, ties.strength))


def stored_energy(ties: Ties, bodies: Bodies) -> float:
    """Energy that the ties would give back in the present position [J]."""
    longer = np.maximum(elongation(ties, bodies) - ties.plastic, 0.0)
    # at its strength a tie is a constant force: it gives back what it took until the next step lets it yield
    elastic = np.minimum(longer, ties.strength / ties.stiffness)
    return float((0.5 * ties.stiffness * elastic**2 + ties.strength * (longer - elastic)).sum())
