"""The twelve specimens with capacity curves: peak, stiffness, drift, and loads along the falling branch.

Tables take up to 17 sizes a cause. With 5 they missed 14 scatters where a weak base joint turns rocking into sliding.
With 17 they miss 6, beside the jump itself, and a fifth of a scatter in 2 % of the numbers (11 % before).

All are read off one path of rigid blocks on elastic, frictional joints (``lm.pushover``), so that a cause moves them
together. Cohesion is not on the list: a path ends where open joints still bear it.
"""

import limitmason as lm
from limitmason.capacity.step_length import Steps

from . import campaigns
from .kinds_designs import CAUSES, Trials, build

FALLEN = 0.85  # share of the peak at which the drift is read
PLACES = (0.03, 0.08)  # displacements over the thickness at which loads are read
FAR = 0.2  # end of a path over the thickness
QUICK = Steps(opening=3e-3, peak=2e-3)  # loads within 0.1 % of those of default steps
SCATTER = dict.fromkeys(("peak", "stiffness", "drift", *(f"load at {x:g}" for x in PLACES)), 0.05)


def pushed(specimen, *, extend=None, **inputs):
    """Peak and stiffness of one specimen; of stacks and strips, which rock, also the drift and loads of the curve.

    Walls pushed in plane slide: their load stays, or falls at once where a unit slips off.
    """
    model = build(specimen, **inputs)
    model = model if extend is None else extend(*model)
    rocks, thickness = specimen["setup"] in ("stack", "strip"), specimen["thickness"]
    far = FAR * thickness if rocks else None
    curve = lm.pushover(*model, to=far, contact_model="vertices", contacts="first",
                        steps=QUICK)
    out = {q: curve.quantities[q] for q in ("peak", "stiffness")}
    if rocks:
        out["drift"] = fallen_to(curve, FALLEN)
        out |= {f"load at {x:g}": float(curve.at(x * thickness)) for x in PLACES}
    return out


def fallen_to(curve, share):
    """First displacement beyond the peak at which the load has fallen to a share of it; the end where it slides on."""
    x, y = curve.displacement, curve.load
    top = int(y.argmax())
    for k in range(top + 1, len(y)):
        if y[k] <= share * y[top]:
            return float(x[k - 1] + (y[k - 1] - share * y[top]) / (y[k - 1] - y[k]) * (x[k] - x[k - 1]))
    return float(x[-1])


class Curves(Trials):
    """Planted data sets of specimens with capacity curves; the loads along a curve err independently."""

    causes = tuple(c for c in CAUSES if c.name != "cohesion")
    scatter, levels = SCATTER, 17  # sizes are added where a mechanism takes over from another
    simulate = staticmethod(pushed)

    def __init__(self, cache, covariates=campaigns.COVARIATES):
        super().__init__(covariates, cache, quantities=tuple(SCATTER))
