"""A verdict drawn: the capacity of a mechanism beside the demand of its spectrum."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from limitmason.answers.curve import Curve
from limitmason.codes import Assessment
from limitmason.codes.circular_2019 import DAMPING, Spectrum
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.figures import style


@style.in_print_style
def assessment(
    verdict: Assessment, spectrum: Spectrum, curve: Curve | None = None, *, title: str | None = None
) -> Figure:
    """Capacity of a mechanism over the displacement spectrum.

    With the points of SLV and SLC.

    Parameters
    ----------
    verdict : from ``limitmason.assess``
    spectrum, curve : that it was made with
    title : heading

    Raises
    ------
    InputError
        For a verdict without a curve, of which q = 2 is all there is.
    """
    c = verdict.bodies
    if curve is None or not c.d:
        raise InputError("a verdict by q = 2 alone has no capacity curve to draw")
    figure, (left, right) = style.panels(style.FULL_WIDTH, 2.4, columns=2)
    alpha = curve.load / float(getattr(curve, "unit", 1.0))
    peak = int(np.argmax(alpha))
    along = curve.displacement * (c.d0 / np.interp(0.0, -alpha[peak:], curve.displacement[peak:]))
    left.plot(along, alpha * GRAVITY / (c.mass_share * verdict.confidence_factor), color="black", lw=0.9)
    periods = np.linspace(0.02, 1.6 * max(c.period.values()), 200)
    for state, colour in (("SLV", style.ORANGE), ("SLC", style.BLUE)):
        demand = [spectrum.displacement(float(t), DAMPING[state]) for t in periods]
        right.plot(periods, demand, color=colour, lw=0.9, label=state)
        right.plot([c.period[state]], [c.d[state]], "o", color=colour, ms=4)
        left.plot([c.d[state]], [c.a[state]], "o", color=colour, ms=4)
    left.set(xlabel="displacement d [m]", ylabel="capacity a [m/s$^2$]", xlim=(0.0, 1.05 * c.d0), ylim=(0.0, None))
    right.set(xlabel="period [s]", ylabel="displacement of the demand [m]", xlim=(0.0, None), ylim=(0.0, None))
    right.legend(frameon=False)
    share = ", ".join(f"{state} {s:.0%}" for state, s in verdict.safety.items())
    text = f"{c.bodies} bodies, e* {c.mass_share:.3f}, FC {verdict.confidence_factor:.2f}; of the demand: {share}"
    return style.finished(figure, title, text, [])
