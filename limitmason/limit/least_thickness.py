"""The least thickness at which an arch, a dome or a vault can stand."""

from collections.abc import Callable
from functools import cache

import numpy as np

from limitmason.answers.results import Range
from limitmason.checks import finite, instance, positive
from limitmason.errors import InputError
from limitmason.limit.margin import Margin, last_standing, standing_margin
from limitmason.mechanics.law_table import refuse
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads


def minimum_thickness(
    build: Callable[[float], Assembly],
    *,
    between: tuple[float, float],
    loads: Callable[[Assembly], Loads] = Loads.weight,
    accuracy: float = 1e-7,
    contact_model: str = "vertices",
    in_plane: bool | None = None,
) -> Range:
    """Least thickness of an arch, a dome or a vault that can stand under its load.

    Parameters
    ----------
    build : the structure of a thickness [m], such as ``lambda t: lm.build.arch(radius=1, thickness=t, ...)``
    between : a thickness at which it falls, and a larger one at which it stands [m]
    loads : dead loads of a structure; its weight by default
    accuracy : between the ends, over the larger thickness [-]
    contact_model, in_plane : as for :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Range
        Low end at which it is proven to fall by a motion, and high end at which forces carry it [m]. The low end is 0
        where it stands at the smaller thickness given, or where no fall is proven.

    Raises
    ------
    InputError
        When it does not stand at the larger thickness.

    Notes
    -----
    Joints slide by their friction, associative; rings of a dome press but do not pull. Of the semicircular arch t / R
    is 0.1075 with radial and 0.1095 with vertical cuts (Makris and Alexakis). It grows below 21.6 degrees of friction,
    and below 17.2 no thickness is enough (Cocchetti and Rizzi, 2020). The number of voussoirs counts: a coarse arch is
    thinner by some 1e-4 at 30 voussoirs. Wrong where a structure stands at one thickness and falls at a larger one.
    """
    if np.shape(between) != (2,) or not callable(build) or not callable(loads):
        raise InputError("minimum_thickness: build and loads are functions, between is a small and a larger thickness")
    thin, thick = (finite("between", t) for t in between)
    if not 0.0 < thin < thick:
        raise InputError(f"between must be a small and a larger thickness [m], got {between!r}")
    positive("accuracy", accuracy)

    @cache  # the thick end is asked for twice
    def margin(thickness: float) -> Margin:
        """Margin of the structure of a thickness [m] under its dead load."""
        assembly = instance("build", build(thickness), Assembly)
        refuse("associative", assembly)
        case = instance("loads", loads(assembly), Loads)
        if case.live.any():
            raise InputError("loads: a thickness is asked of dead loads; give them with case='dead'")
        return standing_margin(assembly, case, contact_model=contact_model, in_plane=in_plane)

    if not margin(thick).low >= 0.0:
        raise InputError(f"between: it does not stand at a thickness of {thick:g} m either; give a larger one")
    # ``last_standing`` takes the accuracy of values below 1 m over 1 m: here it is over the larger thickness
    found = last_standing(margin, thick, thin, accuracy * min(1.0, thick))
    # from the thick end that stands down to the thin one that falls: the range is turned round
    return Range(0.0 if found.high == float("inf") else found.high, found.low, "thickness [m]")
