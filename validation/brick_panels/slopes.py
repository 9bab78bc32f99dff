"""Power laws of printed and computed loads in the strengths of the joints."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array

LEFT_OUT = 13
"""Run out of line with its neighbours, left out of slopes as by its authors' own trend."""


def regressors(rows: Sequence[Mapping[str, str]]) -> tuple[Array, NDArray[np.bool_]]:
    """1, log tan(phi), log c, log ft of the runs kept, shape (kept, 4), and which of all are."""
    keep = np.array([int(r["specimen"][-2:]) != LEFT_OUT for r in rows])
    x = np.array([[np.tan(np.radians(float(r["friction"]))), float(r["cohesion"]), float(r["tension"])] for r in rows])
    return np.column_stack([np.ones(len(x)), np.log(x)])[keep], keep


def log_slopes(rows: Sequence[Mapping[str, str]], load: Array) -> tuple[Array, Array]:
    """Exponents of tan(phi), c and ft in a power law of the loads, by least squares without the run left out.

    Returns
    -------
    exponents, and the standard errors that the scatter about the power law leaves them, shapes (3,)
    """
    table, keep = regressors(rows)
    found = np.linalg.lstsq(table, np.log(load[keep]), rcond=None)[0]
    left = np.log(load[keep]) - table @ found
    variance = float(left @ left) / (len(table) - len(found)) * np.diag(np.linalg.inv(table.T @ table))
    return np.asarray(found[1:]), np.asarray(np.sqrt(variance)[1:])
