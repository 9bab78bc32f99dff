"""Which static theorems this package's own solver covers.

Kept from the solver, which loads the compiler.
"""

import numpy as np

from limitmason.errors import NotApplicable
from limitmason.limit.program.static_theorem import Problem
from limitmason.mechanics.law_table import INTERIOR_POINT, SECTIONS, refuse


def unsupported(problem: Problem) -> str | None:
    """What keeps the own solver from a problem, or None.

    It needs friction everywhere and linear bounds per point.
    """
    if len(problem.free):
        return "the interior-point solver of this package takes one live load; use solver='clarabel'"
    try:
        refuse(INTERIOR_POINT, problem.assembly, problem.block_interfaces, where=SECTIONS)
        refuse(INTERIOR_POINT, problem.assembly, problem.interfaces)
    except NotApplicable as refusal:
        return str(refusal)
    # an empty row of G leaves M = G H^-1 G^T without a factor
    if (np.bincount(problem.matrix.indices, minlength=len(problem.row)) == 0).any():
        return (
            "the interior-point solver of this package does not cover blocks with a free motion that no joint resists; "
            "use solver='clarabel'"
        )
    return None
