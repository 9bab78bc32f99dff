"""What a path refuses of an assembly, and how its joints lose strength."""

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics import law_table
from limitmason.mechanics.law import SUDDEN, Softening, softening
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads


def refuse(assembly: Assembly, loads: Loads) -> None:
    """Refuse joints that a path does not follow, and models that nothing can push."""
    if len(loads.dead) != assembly.n_blocks:
        raise InputError(f"loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    law_table.refuse(law_table.PUSHOVER, assembly)
    if assembly.fixed.all():
        raise InputError("every block is held: there is nothing to push")


def refuse_partial_rotations(assembly: Assembly) -> None:
    """Refuse blocks in space of which some rotations are held."""
    turning = assembly.held[:, 3:]
    some = np.flatnonzero(turning.any(axis=1) & ~turning.all(axis=1))
    if len(some):
        raise NotApplicable(
            f"block {assembly.blocks[some[0]].name!r} has some of its rotations held: with finite rotations in space "
            "pushover takes all or none"
        )


def softening_of(assembly: Assembly, kn: Array, ks: Array) -> Softening | None:
    """How every interface softens; None where none does.

    A joint that has lost all of its opening's or its slip's energy is at damage 1. The slip is the plastic one:
    1 / rate_slip = 2 GfII / (c - c_r).
    """
    joints = [i.joint for i in assembly.interfaces]
    if not any(j.softens for j in joints):
        return None
    found = softening(joints, kn, ks)
    lost, slip = assembly.arrays.cohesion - found.rest.cohesion, found.by_slip
    gradual = (slip > 0.0) & (slip < SUDDEN)
    return found._replace(by_slip=np.where(gradual, 1.0 / (1.0 / np.where(gradual, slip, 1.0) + lost / ks), slip))
