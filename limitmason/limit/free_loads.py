"""Limit analysis with live loads beside the one that is multiplied, whose multipliers are free."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.arrays import Array
from limitmason.limit.associative import analyse
from limitmason.limit.contact_notes import with_contact_warnings
from limitmason.limit.papers import papers_behind
from limitmason.limit.program.problem import make_problem
from limitmason.mechanics.contact_points import Grid, chosen_grid
from limitmason.mechanics.law_table import refuse
from limitmason.mechanics.model_notes import adds_model_notes
from limitmason.mechanics.residuals import part_labels
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.support import Support


@adds_model_notes(cites=papers_behind)
@with_contact_warnings
def largest_multiplier(
    assembly: Assembly,
    loads: Loads,
    cases: Array,
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] | None = None,
    in_plane: bool | None = None,
    solver: str = "auto",
    tolerance: float = 1e-10,
) -> Prediction:
    r"""Largest multiplier of the live load while other loads take any multiplier that helps it.

    .. math:: \max \lambda \quad A f + w_d + \lambda w_l + \sum_k u_k c_k = 0, \qquad f \in K

    Parameters
    ----------
    assembly, loads : the problem
    cases : c_k [N, N m], shape (k, n_blocks, 6); of the size of the live load
    contact_model, grid, in_plane, solver, tolerance : as for :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Prediction
        ``details["free multipliers"]`` are the u_k. The mechanism does no work on any c_k; its bound is for these u_k.
        Parts that neither live load nor cases reach are left out.

    Notes
    -----
    Associative. The dead load alone is not checked: u_k may be what carries it.
    """
    refuse("associative", assembly)
    label, loaded = part_labels(assembly), loads.live.any(axis=1) | cases.any(axis=(0, 2))
    apart = np.flatnonzero((label >= 0) & ~np.isin(label, label[loaded]))
    assembly = assembly.with_supports([Support.fixed(int(i)) for i in apart])
    model: dict[str, Any] = {"grid": chosen_grid(contact_model, grid), "in_plane": in_plane, "cases": cases}
    problem = make_problem(assembly, loads, contact_model=contact_model, **model)
    return analyse(problem, solver=solver, tolerance=tolerance, check_dead_load=False)[0]
