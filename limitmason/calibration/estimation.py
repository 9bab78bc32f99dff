"""From tests to parameters: the least misfit of models and tests, and how much the tests fix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.arrays import Array
from limitmason.calibration.cross_validation import groups_of, left_out
from limitmason.calibration.doubts import fit_warnings
from limitmason.calibration.information import Information
from limitmason.calibration.least_squares import SAME, SearchSettings, Slopes, confirmed, searched
from limitmason.calibration.objective import Minimum, Objective
from limitmason.calibration.parameter import Parameter, ParameterScale
from limitmason.calibration.profile import profile
from limitmason.calibration.result import Fit
from limitmason.calibration.runs import Model, Runs
from limitmason.calibration.targets import CurveTarget, Entry, OutputValue, entries_of
from limitmason.checks import finite, instance, listener
from limitmason.display.progress import watched
from limitmason.errors import InputError
from limitmason.study.linked_formulas import LinkedFormulas
from limitmason.study.run_fingerprint import fingerprint
from limitmason.study.sweep import Progress

STANDARD = SearchSettings()

_LEVEL = 0.95  # of what a fit without intervals predicts
_FINEST = 1e-12  # relative: scatter of a number below it is that of its last digits

AGAIN = 3
"""Times that the intervals begin anew because they met a better minimum."""


@watched("calibration")
def calibrate(
    model: Model | Mapping[str, Model],
    targets: Mapping[str, Any],
    parameters: Sequence[Parameter],
    *,
    ties: Mapping[str, str] | None = None,
    leave_out: str | Mapping[str, str] | None = "test",
    level: float | None = 0.95,
    search: SearchSettings = STANDARD,
    workers: int = 1,
    executor: Any = None,
    store: str | Path | None = None,
    key: str | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Parameters at which a model meets what was measured, and what is left open.

    min sum ((log model - log measured) / scatter)^2

    Parameters
    ----------
    model : called with parameters as keywords; returns a number, a mapping of numbers, sequences (frequencies) and
        curves by name, a ``Curve`` or a ``Prediction``. A function, a :class:`limitmason.calibration.JointModel` of a
        structure and any method, or a :class:`limitmason.calibration.SolidModel` of a continuum. By name of the test
        where there are several
    targets : what was measured, by name of the model's output: a number, (value, scatter), :class:`Target`,
        :class:`CurveTarget`. Several tests: a mapping of such mappings, by name of the test; one model then serves all
        of them, or each has its own
    parameters : the unknowns
    ties : formulas of further parameters, {"shear_stiffness": "normal_stiffness / 2"}
    leave_out : "test" fits again without each test and predicts it, "quantity" without each target; or a group by name
        of the test, such as its geometry. None leaves nothing out. Of one test "test" means "quantity"
    level : of the profile intervals, which take some runs for either end [-]; None computes none
    search : how many starts, and steps of each, see :class:`limitmason.calibration.SearchSettings`
    workers, executor : as for :func:`limitmason.study.sweep`; the columns of a Jacobian run side by side
    store : file that keeps every run; the same call goes on after a kill, and other measured values use it again
    key : identifies the models in the store; by default their names and code
    progress : called with one line after every batch of runs: stage, least misfit so far and its values, time left

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        For targets that no model gives, parameters that no model takes, scatter known of some and unknown of others, or
        unknown with no more targets than parameters.
    NotConverged
        Where the model answers at no start, or gives no number for a target at the least misfit: names the target.

    Notes
    -----
    The search takes its slopes over one standard deviation to either side, by runs: a kink, a flat or a jump of the
    model within it is seen. The best of all runs is the answer. Two parameters and their intervals take
    less than 100 runs.
    With known scatter the ends of an interval lie where the least misfit with the parameter held rises by the quantile
    of chi squared; with unknown scatter by that of F times the residual variance. Both are exact for models that are
    linear on the scale of the fit. Minima apart from each other lie in one interval, and a warning names them. The
    error of the model itself is in neither: the error on what was left out is.
    A prediction of the rest is not a test of what all tests share: name groups by geometry or load where you can.
    """
    instance("search", search, SearchSettings, "SearchSettings(starts=6)")
    listener("progress", progress, "a line of text")
    if level is not None and not 0.0 < finite("level", level) < 1.0:
        raise InputError(f"level must lie between 0 and 1, or be None, got {level!r}")
    scale, tied = ParameterScale(parameters), LinkedFormulas(ties or {})
    tied.check(scale.names)
    asked = _asked(model, targets)
    models, entries = asked.models, asked.entries
    known = _scatter_known(entries, len(scale))
    # what is read of each model, each output once, and the place of every entry in it
    readings: list[list[OutputValue]] = [[] for _ in models]
    places = []
    for e, m in zip(entries, asked.model_of, strict=True):
        if e.reading not in readings[m]:
            readings[m].append(e.reading)
        places.append(readings[m].index(e.reading))
    own = "" if store is None else fingerprint("calibration", key or models, readings, scale.names, tied.formulas)
    runs = Runs(models, readings, asked.aimed, scale.names, tied, executor=executor, workers=workers, store=store,
                key=own, progress=progress)
    deviation = np.array([1.0 if e.scatter is None else e.scatter for e in entries])
    objective = Objective(
        scale=scale, entries=entries, model_of=asked.model_of, place_of=tuple(places), deviation=deviation, known=known,
        runs=runs,
    )
    best, slopes, minima, ends = _fitted(objective, search, level)
    objective.refuse_lost(best)
    information = Information(
        scale=scale, slopes=slopes.central, variance=objective.variance(best),
        sides=np.array([slopes.below, slopes.above]),
    )
    groups = groups_of(entries, leave_out)
    by = "group" if isinstance(leave_out, Mapping) else str(leave_out)
    if by == "test" and len({e.test for e in entries}) == 1:  # of one test its quantities were left out
        by = "quantity"
    missed = None if groups is None else left_out(objective, groups, best, information, by, search.most)
    return Fit(
        objective=objective, minimum=best, minima=tuple(minima), information=information, slopes=slopes,
        level=level or _LEVEL, ends=ends, left_out=missed, groups=tuple(groups or ()),
        warnings=fit_warnings(objective, best, minima, objective.rise(best, level or _LEVEL), slopes),
    )


class Searched(NamedTuple):
    """What a search has found.

    Parameters
    ----------
    best : the answer
    slopes : of the residuals there
    minima : every minimum that a search ended at
    ends : intervals of the p parameters on the scale of the fit, shape (p, 2); None without a level
    """

    best: Minimum
    slopes: Slopes
    minima: list[Minimum]
    ends: Array | None


def _fitted(objective: Objective, effort: SearchSettings, level: float | None) -> Searched:
    """Search for the least misfit, and intervals if a level is given.

    A run for an interval may lie lower than the best so far: the search then goes on from it, and the intervals begin
    anew, ``AGAIN`` times at most. Intervals are always those of the answer. A warning says if one more run lies lower.

    Parameters
    ----------
    objective : what is asked
    effort : starts, and steps of each
    level : confidence of the intervals [-], None for none
    """
    best, guess, minima = searched(objective, effort)
    objective.refuse_lost(best)  # before the intervals, which take most of the runs
    objective.say("slopes")
    best, slopes = confirmed(objective, best, guess, effort.most)
    if level is None:
        return Searched(best, slopes, minima, ends=None)
    for begun_anew in range(AGAIN + 1):
        objective.say("best values found, now their intervals", now=True)
        ends = profile(objective, best, slopes, objective.rise(best, level))
        if begun_anew == AGAIN or objective.best.chi2 > best.chi2 - SAME * objective.variance(best):
            break
        best, slopes = confirmed(objective, objective.best, slopes.central, effort.most)
    return Searched(best, slopes, minima, ends)


class NumbersToMeet(NamedTuple):
    """What is asked of which model.

    Parameters
    ----------
    models : each once, though it may serve several tests
    entries : numbers to be met
    model_of : number of the model of every entry
    aimed : of every model, name and target of every measured curve that it is held against
    """

    models: list[Model]
    entries: tuple[Entry, ...]
    model_of: tuple[int, ...]
    aimed: list[list[tuple[str, Any]]]


def _asked(model: Model | Mapping[str, Model], targets: Mapping[str, Any]) -> NumbersToMeet:
    """What is asked of which model, checked.

    Parameters
    ----------
    model : one for all tests, or one by name of the test
    targets : measured values by name, or by test and name
    """
    if not isinstance(targets, Mapping) or not targets:
        raise InputError(f"targets must be a mapping of what was measured by name, got {targets!r}")
    several = all(isinstance(t, Mapping) for t in targets.values())
    if not several and (any(isinstance(t, Mapping) for t in targets.values()) or isinstance(model, Mapping)):
        raise InputError("of several tests every one needs its own mapping of targets, by name of the test")
    tests: Mapping[str, Mapping[str, Any]] = targets if several else {"test": targets}
    models: list[Model] = []
    entries: list[Entry] = []
    model_of: list[int] = []
    aimed: list[list[tuple[str, Any]]] = []
    for test, asked in tests.items():
        if isinstance(model, Mapping) and test not in model:
            raise InputError(f"test {test!r} has no model; models: {', '.join(model)}")
        own: Any = model[test] if isinstance(model, Mapping) else model
        if not callable(own):
            raise InputError(f"a model must be a function of the parameters or a JointModel, got {own!r}")
        number = next((k for k, m in enumerate(models) if m is own), len(models))
        if number == len(models):
            models.append(own)
            aimed.append([])
        if not asked:
            raise InputError(f"test {test!r} has no targets")
        for name, target in asked.items():
            found = entries_of(test, name, target)
            entries += found
            model_of += [number] * len(found)
            if isinstance(target, CurveTarget | Curve):
                aimed[number].append((name, target))
    if isinstance(model, Mapping) and (idle := [n for n in model if n not in tests]):
        raise InputError(f"model {idle[0]!r} has no targets: leave it out")
    return NumbersToMeet(models, tuple(entries), tuple(model_of), aimed)


def _scatter_known(entries: Sequence[Entry], unknowns: int) -> bool:
    """Whether the scatter of the entries is given: of all of them, or of none.

    Without it more entries are needed than unknowns, as their misfit then tells it.

    Parameters
    ----------
    entries : numbers to be met
    unknowns : number of parameters
    """
    stated = [e.scatter is not None for e in entries]
    for e in entries:
        if e.scatter is not None and e.scatter < _FINEST * (1.0 if e.relative else abs(e.measured)):
            raise InputError(f"the scatter of {e.label!r}, {e.scatter!r}, is finer than numbers are: give its own")
    if all(stated):
        return True
    if any(stated):
        missing = entries[stated.index(False)]
        raise InputError(f"the scatter of {missing.label!r} is not given while others' is: give all or none")
    if len(entries) <= unknowns:
        raise InputError(
            f"without a scatter {unknowns} parameters need more than {unknowns} numbers, there are {len(entries)}"
        )
    return False
