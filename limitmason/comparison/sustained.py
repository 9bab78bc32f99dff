"""The sustained load: what the mechanism of the smallest admissible state still carries once it has moved.

Below psi = phi a structure first loses equilibrium at a load that depends on the self-stress of its joints: gaps of
1e-4 of a block reach the smallest admissible multiplier. In most walls that motion arrests itself: forces that gathered
in a corner spread as blocks move. A path at large displacement from the smallest state on says what is left after a
tenth of the thickness, which depends on the gaps far less.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from limitmason.answers.method import DISPLACED, Look, Method, settings_of
from limitmason.answers.results import Bound, BoundKind, Prediction, Status
from limitmason.capacity import Steps
from limitmason.capacity.analysis import whole_pushover
from limitmason.capacity.contacts import standard_points
from limitmason.capacity.ensemble import GOES_ON, thickness
from limitmason.capacity.outcomes import PathEnd
from limitmason.capacity.papers import PAPERS
from limitmason.checks import positive
from limitmason.display.progress import watched
from limitmason.errors import NotApplicable, NotConverged
from limitmason.mechanics.contact_points import Grid, chosen_grid
from limitmason.mechanics.plane import find_plane
from limitmason.methods import NON_ASSOCIATIVE, get_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.storage.interrupts import handed_on


@watched("sustained load")
def sustained(
    assembly: Assembly,
    loads: Loads,
    *,
    smallest: Prediction | None = None,
    goes_on: float = GOES_ON,
    search: str = "standard",
    time_limit: float | None = None,
    contact_model: str | None = None,
    grid: Grid | Mapping[str, Grid] | None = None,
    contacts: str = "first",
    stiffness: float | tuple[float, float] | None = None,
    steps: Steps | None = None,
    progress: Callable[[str], None] | None = None,
) -> Prediction:
    """Load after a displacement of a tenth of the thickness, on the path from the smallest admissible state.

    Parameters
    ----------
    assembly, loads : the problem; the live loads are followed
    smallest : that state, a non-associative prediction on the same contact points; searched for where omitted
    goes_on : displacement along the live forces over the thickness, the smallest dimension of a block [-]
    search, time_limit : of the search, see :func:`limitmason.limit_analysis`
    contact_model, grid : of both, those of ``smallest`` where this is given (its ``grid`` is to be repeated); by
        default what the joints need, as for :func:`limitmason.pushover`
    stiffness, steps, progress : of the path, see :func:`limitmason.pushover`
    contacts : of the path, see :func:`limitmason.pushover`; "first" by default, the points of the smallest state

    Returns
    -------
    Prediction
        An estimate: of the displaced structure, by one path, from the smallest state that was found. ``details`` hold
        the multiplier at its beginning, "first loss", the "largest on the way", and the "curve".

    Raises
    ------
    InputError
        For a length that is not positive, a state on other contact points, and a grid that is not used.
    NotConverged
        Where there is no smallest state to begin with.
    """
    few_points: tuple[str, ...] = ()  # what the standard points warn of
    positive("goes_on", goes_on)
    # both the search and the path need the same points: those asked for, of the given state, or by the joints
    if contact_model is None and grid is not None:
        contact_model = "grid"
    elif contact_model is None and smallest is not None:
        contact_model = smallest.contact_model or "vertices"
    elif contact_model is None:
        contact_model, grid, few_points = standard_points(assembly, find_plane(assembly, loads))
    chosen = chosen_grid(contact_model, grid)
    options: dict[str, Any] = {} if contact_model == "vertices" else {"grid": chosen}
    if smallest is None:
        with handed_on():
            smallest = get_method(NON_ASSOCIATIVE).predict(
                assembly, loads, contact_model=contact_model, search=search, time_limit=time_limit, **options
            )
    if smallest.status != Status.SOLVED or smallest.mechanism is None:
        raise NotConverged(f"there is no smallest state to begin with: {smallest.status}")
    to = goes_on * thickness(assembly)
    curve = whole_pushover(
        assembly, loads, initial=smallest, to=to, contact_model=contact_model, contacts=contacts, stiffness=stiffness,
        steps=steps, progress=progress, **options,
    )
    value, status, warnings = math.nan, Status.NOT_CONVERGED, (*few_points, *curve.warnings)
    # a structure that has overturned on the way carries nothing any more
    if curve.status == PathEnd.REACHED:
        value, status = float(curve.load[-1]), Status.SOLVED
    elif curve.status == PathEnd.OVERTURNED:
        value, status = 0.0, Status.SOLVED
    else:
        warnings = (*warnings, f"the path ends at {curve.displacement[-1]:.3g} m of {to:.3g} m: {curve.status}")
    # a load whose path left equilibrium or the joint law at some sample is no answer, wherever the path ended
    if not all(c.accepted for c in curve.certificates):
        status = Status.NOT_CONVERGED
    resultants, mechanism = None, None
    try:
        if curve.nodes:  # none where the path found no state to begin with
            mechanism, resultants = curve.mechanism(-1), curve.resultants(-1)
    except NotApplicable as reason:
        warnings = (*warnings, str(reason))
    meaning = (
        f"estimate: load still carried {1e3 * to:.3g} mm after the smallest state found lost equilibrium, "
        f"{goes_on:g} of the thickness"
    )
    return Prediction(
        method="sustained", collapse_multiplier=value, bound=Bound(BoundKind.ESTIMATE, meaning), status=status,
        mechanism=mechanism, resultants=resultants, warnings=warnings,
        provenance=curve.cost.provenance, details={
            "curve": curve, "first loss": float(smallest.collapse_multiplier),
            "largest on the way": float(curve.load.max()), "displacement": to,
        },
    )


def _beside(details: Mapping[str, Any]) -> str:
    """Loads at the beginning of the path and the largest on it, in words; "" where a store has not kept them."""
    if "first loss" not in details:
        return ""
    return f"from {details['first loss']:.5f} on, at most {details['largest on the way']:.5f} on the way"


SUSTAINED = Method(
    "sustained",
    sustained,
    settings_of("SustainedSettings", sustained),
    look=Look("sustained", "PURPLE", "X"),
    beside=_beside,
    kept=("first loss", "largest on the way", "displacement"),
    theorem="displaced",
    takes_over={"smallest": NON_ASSOCIATIVE},
    references=PAPERS,
    # as its path, but crushing, which the search for the smallest state takes on a grid only
    levers=tuple(lever for lever in DISPLACED if lever != "crushing"),
)
