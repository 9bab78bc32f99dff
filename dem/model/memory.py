"""What a model takes of the machine's memory: said and refused before it is made."""

import os
from collections.abc import Mapping

import numpy as np

from limitmason.errors import InputError
from limitmason.model import Assembly

PER_POINT = 420
"""Bytes of a contact point at the most, its part of joint and blocks included: 360 from 1,000 to 100,000 bricks."""

FREE = 0.9
"""Share of the machine's memory that a model may take [-]."""


def memory_of_machine() -> float:
    """Memory of the machine [bytes], infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return np.inf


def refuse_too_large(assembly: Assembly, grid: object) -> None:
    """Refuse a model whose contact points do not fit into memory; where a spacing is given their number is not known.

    Parameters
    ----------
    grid : points along and across every joint, one pair or one by kind

    Raises
    ------
    InputError
        With the number of points, the memory that they take, and what the machine has.
    """
    x = assembly.arrays
    moves = ~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])
    if isinstance(grid, Mapping):
        each = np.array([float(np.prod(grid.get(i.kind, (0, 0)))) for i in assembly.interfaces])
    elif isinstance(grid, tuple):
        each = np.full(len(moves), float(np.prod(grid)))
    else:
        return
    points = float(each[moves].sum())
    need, have = PER_POINT * points, memory_of_machine()
    if need > FREE * have:
        raise InputError(
            f"{points:.0f} contact points on {int(moves.sum())} joints take {need / 1e9:.2g} GB, the machine has "
            f"{have / 1e9:.2g} GB: give fewer contact_points, or fewer blocks"
        )
