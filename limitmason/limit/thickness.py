"""Least thickness at which a structure stands, built anew for each thickness that is tried."""

from __future__ import annotations

from collections.abc import Callable

from limitmason.answers.results import Range
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
        where it stands at the smaller thickness given.

    Raises
    ------
    InputError
        When it does not stand at the larger thickness.

    Notes
    -----
    Joints slide by their friction, associative; rings of a dome press but do not pull. Of the semicircular arch t / R
    is 0.1075 with radial and 0.1095 with vertical cuts (Makris and Alexakis), and a function of the angle of friction
    below some 22 degrees. The number of voussoirs counts: a coarse arch is thinner by some 1e-4 at 30 voussoirs. Wrong
    where a structure stands at one thickness and falls at a larger one.
    """
    thin, thick = (float(t) for t in between)
    if not 0.0 < thin < thick:
        raise InputError(f"between must be a small and a larger thickness [m], got {between!r}")

    def margin(thickness: float) -> Margin:
        assembly = build(thickness)
        refuse("associative", assembly)
        return standing_margin(assembly, loads(assembly), contact_model=contact_model, in_plane=in_plane)

    if not margin(thick)[0] >= 0.0:
        raise InputError(f"between: it does not stand at a thickness of {thick:g} m either; give a larger one")
    found = last_standing(margin, thick, thin, accuracy * min(1.0, thick))
    return Range(0.0 if found.high == float("inf") else found.high, found.low, "thickness [m]")
