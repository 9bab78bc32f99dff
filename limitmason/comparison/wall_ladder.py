"""Measured walls by a ladder of models: force, failure mode and interval of every wall, kept as they come."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.method import hyphened
from limitmason.answers.results import Prediction
from limitmason.checks import choice, listener, several
from limitmason.comparison.wall_curves import TRIES, wall_curve
from limitmason.comparison.wall_modes import mode_inside, rocking_force
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.experiments import registry
from limitmason.experiments.experiment import Experiment
from limitmason.experiments.modern_walls import MODELS, NAME, shear_span, value
from limitmason.experiments.modern_walls.inputs import inputs_of
from limitmason.limit.analysis import whole_limit_analysis
from limitmason.mechanics.pier_strength import wall_forces
from limitmason.study.memo import Memo
from limitmason.study.run_fingerprint import fingerprint

LADDER = ("formulas", "first", "extended", "non-associative", "pushover", "dem")
"""Models of the ladder: *non-associative* is the extended one without dilatancy, *pushover* the capacity curve of a
wall whose joints and units lose their strength, *dem* the same wall driven by the distinct element method."""

DOZEN = "124", "189", "110", "113", "137", "142", "144", "145", "12", "168", "25", "170"
"""Walls that the DEM drives where none are named: by number of units, a wall whose campaign and first printed mode no
smaller one has, of those with all inputs and a response; ``validation.wall_curves`` chooses them."""
USUAL: Mapping[str, Sequence[str]] = {"dem": DOZEN}
"""Walls of a method where none are named and not all are meant."""

ROCKS = 0.86
"""Share of the force at which a wall rocks in one piece from which on it is said to rock (F); **fitted** to modes."""

MODEL_SPREAD: Mapping[str, float] = {
    "formulas": 0.16, "first": 0.27, "extended": 0.15, "non-associative": 0.22, "pushover": 0.18, "dem": 0.18,
}
"""Scatter of a model beside that of the inputs, standard deviation of the logarithm: of the walls in
``docs/measured-walls.md``, campaigns left out. The DEM has that of the curves. Of *non-associative* it is the root mean
square: without dilatancy walls carry a tenth less, and no number was fitted anew."""

SEARCHED = 120.0
"""Time [s] after which the search of a wall without dilatancy ends with the smallest multiplier that it has."""

NINETY = 1.645  # normal deviates of a 90 % interval


class WallPrediction(NamedTuple):
    """Answer of a model for a wall.

    Parameters
    ----------
    wall : its number
    method : a model of ``LADDER``
    force : at the medians of the inputs [kN]
    spread : standard deviation of its logarithm from the inputs, NaN where they were not moved [-]
    rocks : force over that of the wall rocking in one piece [-], but 1 or 0 of formulas and curves, which name the mode
        themselves
    inside : the mode by what gave way inside the wall, see :func:`wall_modes.mode_inside`
    status : "solved", or why there is no answer; beside a force, why there is no spread, or that its curve ended before
        it had a peak
    seconds : processor time
    """

    wall: str
    method: str
    force: float
    spread: float
    rocks: float
    inside: str
    status: str
    seconds: float

    @property
    def mode(self) -> str:
        """S shear, F flexure, SL sliding, G gaping.

        F where units and joints inside the wall cost it little.
        """
        return "F" if self.rocks >= ROCKS else self.inside

    @property
    def interval(self) -> tuple[float, float]:
        """Ends that hold 90 % [kN]: inputs, where they were moved, and model.

        The distribution is lognormal.
        """
        wide = float(np.exp(NINETY * np.hypot(np.nan_to_num(self.spread), MODEL_SPREAD[self.method])))
        return self.force / wide, self.force * wide


@watched("predict")
def predict_walls(
    method: str,
    walls: Iterable[str] | None = None,
    *,
    store: str | Path | None = None,
    spread: bool = True,
    workers: int = 1,
    executor: Any = None,
    options: Mapping[str, Any] | None = None,
    progress: Callable[[str], object] | None = None,
) -> list[WallPrediction]:
    """Force, mode and interval of walls of ``modern-walls`` by a model of the ladder.

    Parameters
    ----------
    method : "formulas" (:func:`mechanisms.wall_forces`), "first" and "extended" block models by associative limit
        analysis, "non-associative": the extended one without dilatancy, "pushover" and "dem": the largest force of
        :func:`limitmason.comparison.wall_curves.wall_curve`
    walls : their numbers; all where omitted, by the DEM those of ``DOZEN``
    store : file that keeps every answer; the same call goes on after a kill
    spread : move every input that the model uses by its standard deviation, one by one, for the interval: four or five
        runs more
    workers, executor : as for :func:`limitmason.study.sweep`: processes of joblib, or a dask client
    options : of the assembly, over those of the model; "formulas" have none
    progress : called with a line per wall, with the time that is left

    Raises
    ------
    InputError
        For an unknown method or wall, options of "formulas", and a store of another version.

    Notes
    -----
    The spread of the inputs is that of first order: the root of the sum of squares of the changes of ln V. Inputs are
    taken as independent. Wall 97 has no shear span: its status says so, unless the option gives one.
    """
    method = choice("method", hyphened(method, LADDER), LADDER)
    listener("progress", progress, "a line of text")
    if method == "formulas" and options:
        raise InputError(f"options: the formulas have no assembly, and no {', '.join(options)}")
    if walls is None:
        walls = USUAL.get(method, registry.specimens(NAME))
    names = [walls] if isinstance(walls, str) else list(several("walls", walls, str))
    chosen = {} if method == "formulas" else {**MODELS.get(method, MODELS["extended"]), **(options or {})}
    memo = Memo(store, kind=dict)
    # answers of other options are told apart in the store, and of paths that may take another number of tries
    asked = fingerprint(method, dict(chosen), spread, *[TRIES] * (method == "pushover"))
    keys = {(name, method, asked): name for name in names}
    jobs = {k: {"wall": n, "method": method, "options": chosen, "spread": spread} for k, n in keys.items()}
    missing, begun = sum(k not in memo for k in keys), time.perf_counter()
    for done, (key, row) in enumerate(memo.map(predict_wall, jobs, workers=workers, executor=executor), 1):
        reached(done / max(missing, 1), f"wall {key[0]}")
        if progress is not None:
            left = (time.perf_counter() - begun) / done * (missing - done)
            said = f"{row['force']:.1f} kN" if np.isfinite(row["force"]) else row["status"]
            progress(f"[{done}/{missing}] wall {key[0]}: {said}; {left:.0f} s left")
    return [WallPrediction(**{k: memo[key][k] for k in WallPrediction._fields}) for key in keys]


def predict_wall(wall: str, method: str, options: Mapping[str, Any], spread: bool) -> dict[str, Any]:
    """One wall by one model, as a row of the store: force [kN], its mode and spread.

    The spread is the root of the sum of squares of changes of the logarithm, each by one standard deviation of an
    input. A refusal of one of these runs leaves the force without a spread, beside the reason as status.

    Parameters
    ----------
    wall : its number
    method : a model of ``LADDER``
    options : of the wall's model
    spread : whether its spread is asked for

    Returns
    -------
    The fields of :class:`WallPrediction` by name. Of a wall that no model can take, the status is why.
    """
    begun = time.process_time()
    test = registry.load(NAME, wall, **options)
    row: dict[str, Any] = {"wall": wall, "method": method, "status": test.no_model, "inside": "", "seconds": 0.0}
    row |= dict.fromkeys(("force", "spread", "rocks"), np.nan)
    if test.no_model:
        return row
    solve = _SOLVERS[method]
    try:
        row["force"], row["rocks"], row["inside"], ended = solve(test)
        if spread:
            unused = _UNUSED["formulas" if method == "formulas" else test.options["cracks"]]
            # each at one standard normal deviate above its median, or above the value that an option gives
            moved = [
                solve(test.with_options(**{name: i._replace(value=value(test, name)).drawn(1.0)})).force
                for name, i in inputs_of(test.row).items() if name not in unused
            ]
            row["spread"] = float(np.linalg.norm(np.log(np.array(moved) / row["force"])))
        known = method == "formulas" or test.row["head_joints"]  # no formula asks for them
        row["status"] = ended if known else f"{ended}; head joints unknown, taken as not filled"
    except (InputError, NotApplicable, NotConverged) as refusal:
        row["status"] = str(refusal)
    return {**row, "seconds": time.process_time() - begun}


class _Solved(NamedTuple):
    """What a solver says of a wall, as in :class:`WallPrediction`.

    Parameters
    ----------
    force : [kN]
    rocks : force over that of the wall rocking in one piece, or 1 or 0 of what names the mode itself [-]
    inside : mode by what gave way inside the wall
    ended : "solved", or that a curve may not have come to its peak
    """

    force: float
    rocks: float
    inside: str
    ended: str = "solved"


_UNUSED = {"formulas": ("fb",), "diagonal strength": ("fb",), "unit strength": ("ft",), "none": ("fb", "ft")}
"""Strengths of units and masonry that the formulas, or the cracks of a block model, do not ask for."""


def _by_formulas(test: Experiment) -> _Solved:
    """Smallest force by the formulas for piers.

    It rocks (1.0) where the formula of rocking gives it. The mode inside is SL where that of sliding does, else S. The
    table has MPa and mm, formulas take Pa and m.
    """
    row = test.row
    forces = wall_forces(
        float(row["L"]), float(row["H"]), float(row["t"]), shear_span(test) * float(row["H"]),
        stress=1e6 * value(test, "sigma0"), strength=1e6 * value(test, "fc"), cohesion=1e6 * value(test, "fv0"),
        friction=value(test, "mu"), diagonal_strength=1e6 * value(test, "ft"),
        unit=(1e-3 * float(row["lb"]), 1e-3 * float(row["hb"])),
    )
    force = 1e-3 * float(forces.smallest)
    rocks = 1.0 if forces.governing == "rocking" else 0.0  # the formula that governs names the mode
    return _Solved(force, rocks, inside="SL" if forces.governing == "sliding" else "S")


def formulas_force(test: Experiment) -> float:
    """The smallest of the four formulas [kN]."""
    return _by_formulas(test).force


def _by_blocks(test: Experiment) -> _Solved:
    """Answer of associative limit analysis for a wall."""
    # walls of the database stood under their dead load: it need not be checked
    return _answer(test, whole_limit_analysis(test.assembly(), test.loads(), check_dead_load=False))


def _without_dilatancy(test: Experiment) -> _Solved:
    """Answer for a wall by the smallest non-associative multiplier that is found."""
    wall, loads = test.assembly(), test.loads()  # points: no exact stress block goes without dilatancy
    return _answer(test, whole_limit_analysis(
        wall, loads, "non-associative", contact_model="grid", search="quick", time_limit=SEARCHED
    ))


def _answer(test: Experiment, found: Prediction) -> _Solved:
    """Answer from a prediction under a live load of 1 kN: its multiplier is the force in kN."""
    force = float(found.collapse_multiplier)
    if not np.isfinite(force) or found.mechanism is None:
        raise NotConverged(f"{test.name}: {found.status}")
    return _Solved(force, force / rocking_force(test), mode_inside(test.assembly(), found.mechanism.twists))


def _by_curve(test: Experiment, by: str = "pushover") -> _Solved:
    """Answer for a wall by its capacity curve, which is followed ``by`` a method."""
    found = wall_curve(test, by=by)
    if not found.force:
        raise NotConverged(f"{test.name}: {found.status}")
    # the curve itself names the mode
    return _Solved(found.peak, 1.0 if found.mode == "F" else 0.0, found.mode, found.cut_short or "solved")


_SOLVERS: Mapping[str, Callable[[Experiment], _Solved]] = {
    "formulas": _by_formulas, "first": _by_blocks, "extended": _by_blocks, "non-associative": _without_dilatancy,
    "pushover": _by_curve, "dem": partial(_by_curve, by="dem"),
}
