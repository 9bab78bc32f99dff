"""Ties in the DEM: what its kernel sees of them, and what is read of a position."""

import numpy as np

from dem.kernels import RigidBodies, Ties
from limitmason.arrays import Array
from limitmason.mechanics.tie_springs import NO_TIES as NO_SPRINGS
from limitmason.mechanics.tie_springs import TieSprings, stretched, tension, tie_springs
from limitmason.model import Assembly

NO_TIES = Ties(*NO_SPRINGS, plastic=np.zeros(0))


def make_ties(assembly: Assembly, factor: float = 1.0) -> tuple[Ties, tuple[str, ...]]:
    """Kernel arrays of the ties of an assembly without force, and notes for the user.

    Parameters
    ----------
    factor : on all stiffnesses, as ``JointOptions.stiffness_factor`` [-]
    """
    made, said = tie_springs(assembly)
    # copies: to the compiler arrays of the model, which may not be written, are another type
    own = TieSprings._make(v.copy() for v in made._replace(stiffness=factor * made.stiffness))
    return Ties(*own, plastic=np.zeros(len(made.length))), said


def springs(ties: Ties) -> TieSprings:
    """Ties of the kernel without what is left of their elongation."""
    return TieSprings(*(getattr(ties, name) for name in TieSprings._fields))


def elongation(ties: Ties, bodies: RigidBodies) -> Array:
    """Elongation of every tie in the present position [m], shape (t,)."""
    return stretched(springs(ties), bodies.shift, bodies.rot).elongation


def pulls(ties: Ties, bodies: RigidBodies) -> Array:
    """Tension of every tie in the present position [N], shape (t,).

    None yields, and their state stays.
    """
    if not len(ties.block_a):
        return np.zeros(0)
    return tension(springs(ties), elongation(ties, bodies), ties.plastic)[0]


def stored_energy(ties: Ties, bodies: RigidBodies) -> float:
    """Energy that the ties would give back in the present position [J]."""
    longer = np.maximum(elongation(ties, bodies) - ties.plastic, 0.0)
    # at its strength a tie is a constant force: it gives back what it took until the next step lets it yield
    elastic = np.minimum(longer, ties.strength / ties.stiffness)
    return float((0.5 * ties.stiffness * elastic**2 + ties.strength * (longer - elastic)).sum())
