"""The load at which a curve has lost 2 % of its stiffness: the light-damage limit state of Murano et al."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.checks import finite, numbers, positive
from limitmason.errors import InputError


class LightDamage(NamedTuple):
    """The limit state on a curve.

    Parameters
    ----------
    load, displacement : at it [N], [m]
    initial_stiffness : that it is measured by [N/m]
    """

    load: float
    displacement: float
    initial_stiffness: float


def light_damage(
    displacement: ArrayLike, load: ArrayLike, *, drop: float = 0.02, initial_stiffness: float | None = None
) -> LightDamage:
    """Return the point of a curve at which its secant stiffness has fallen by 2 %.

    It is the first point of the curve on the line F = (1 - drop) K_0 d.

    Parameters
    ----------
    displacement, load : the curve [m], [N], shape (n,), from the origin or near it, displacement growing
    drop : 0.02 for light damage [-]
    initial_stiffness : K_0 [N/m]; secant of the first point away from the origin where omitted

    Raises
    ------
    InputError
        For curves that are too short, not increasing in displacement, or that never lose that much stiffness.

    Notes
    -----
    Source: Murano et al., section 6.3, "a reduction of 2 % of the initial stiffness". That the secant is meant is
    derived from their Table 10: 0.98 times initial stiffness times initial displacement gives seven of the eight
    printed light-damage loads (not DS_Macro_FEM, 1.73 for 0.83 kN). Wrong for noisy curves: smooth first, and give K_0.
    """
    d, f = numbers("displacement", displacement), numbers("load", load)
    if d.ndim != 1 or d.shape != f.shape or len(d) < 2:
        raise InputError(f"displacement and load must be curves of equal length, got shapes {d.shape} and {f.shape}")
    if not (np.diff(d) > 0.0).all() or d[0] < 0.0:
        raise InputError("displacement must grow from zero on: cut the curve before it turns")
    if not np.isfinite(f).all():
        raise InputError(f"load is not finite at sample {int(np.argmin(np.isfinite(f)))}")
    if not 0.0 < finite("drop", drop) < 1.0:
        raise InputError(f"drop must lie between 0 and 1, got {drop!r}")
    away = d > 0.0
    d, f = d[away], f[away]
    k0 = positive("initial_stiffness", f[0] / d[0] if initial_stiffness is None else initial_stiffness)
    # load above the line of the reduced secant; its first sign change is the point
    spare = f - (1.0 - drop) * k0 * d
    if spare[0] < 0.0:  # the first point is past it already: the curve comes from the origin, on that line
        d, f, spare = np.append(0.0, d), np.append(0.0, f), np.append(0.0, spare)
    below = np.flatnonzero(spare < 0.0)
    if not len(below):
        raise InputError(f"the curve never loses {drop:.0%} of its initial stiffness: it ends before light damage")
    j = int(below[0])
    share = spare[j - 1] / (spare[j - 1] - spare[j])  # of the way from sample j - 1 to j
    load_there, displacement_there = f[j - 1] + share * (f[j] - f[j - 1]), d[j - 1] + share * (d[j] - d[j - 1])
    return LightDamage(float(load_there), float(displacement_there), k0)
