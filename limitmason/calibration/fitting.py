"""From tests to parameters: the least misfit of models and tests, and how much the tests fix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from limitmason.calibration.fit import Fit, LeftOut, LeftOutRow, fit_warnings
from limitmason.calibration.information import Information
from limitmason.calibration.parameter import Parameter, Scale
from limitmason.calibration.problem import OPTIMISERS, SAME, Minimum, Problem, left_out, profile, search
from limitmason.calibration.runs import Model, Runs
from limitmason.calibration.targets import CurveTarget, Entry, Reading, entries_of
from limitmason.curve import Curve
from limitmason.errors import InputError
from limitmason.progress import watched
from limitmason.study.store import fingerprint
from limitmason.study.sweep import Progress
from limitmason.study.ties import Ties

Array = NDArray[np.float64]

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
    intervals: bool = True,
    level: float = 0.95,
    optimiser: str = "least squares",
    starts: int = 6,
    seed: int = 0,
    step: float = 1e-4,
    most: int = 60,
    workers: int = 1,
    executor: Any = None,
    store: str | Path | None = None,
    key: str | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Parameters at which a model meets what was measured, and what the measurements cannot tell.

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
    intervals : whether profile intervals are computed, many runs each
    level : of the intervals [-]
    optimiser : "least squares" (``scipy.optimize.least_squares``), or "nelder-mead" for a misfit with jumps larger than
        ``step`` can see past
    starts : followed from the best points of a Latin hypercube within the bounds, the given start first
    seed : of the hypercube
    step : of finite differences on the scale of the fit; 0.03 to 0.1 for a simulated peak that jumps
    most : evaluations of a single search
    workers, executor : as for :func:`limitmason.study.sweep`; the columns of a Jacobian run side by side
    store : file that keeps every run; the same call goes on after a kill, and other measured values use it again
    key : identifies the models in the store; by default their names and code
    progress : called with one line after every batch of runs, with the time left of the present stage

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        For targets that no model gives, parameters that no model takes, scatter known of some and unknown of others, or
        unknown with no more targets than parameters.
    NotConverged
        Where the model answers at no start.

    Notes
    -----
    With known scatter the ends of an interval lie where the least misfit with the parameter held rises by the quantile
    of chi squared; with unknown scatter by that of F times the residual variance. Both are exact for models that are
    linear on the scale of the fit. The error of the model itself is in neither: the error on what was left out is.
    A prediction of the rest is not a test of what all tests share: name groups by geometry or load where you can.
    """
    if optimiser not in OPTIMISERS:
        raise InputError(f"optimiser must be one of {OPTIMISERS}, got {optimiser!r}")
    if not 0.0 < level < 1.0:
        raise InputError(f"level must lie between 0 and 1, got {level!r}")
    if starts < 1 or most < 2 or not step > 0.0:
        raise InputError(f"starts must be at least 1, most 2 and step positive, got {starts!r}, {most!r}, {step!r}")
    scale, tied = Scale(parameters), Ties(ties or {})
    tied.check(scale.names)
    models, entries, model_of, aimed = _asked(model, targets)
    known = _scatter_known(entries, len(scale))
    readings: list[list[Reading]] = [[] for _ in models]
    places = []
    for e, m in zip(entries, model_of, strict=True):
        if e.reading not in readings[m]:
            readings[m].append(e.reading)
        places.append(readings[m].index(e.reading))
    own = "" if store is None else fingerprint("calibration", key or models, readings, scale.names, tied.formulas)
    runs = Runs(models, readings, aimed, scale.names, tied, executor=executor, workers=workers, store=store, key=own,
                progress=progress)  # fmt: skip
    deviation = np.array([1.0 if e.scatter is None else e.scatter for e in entries])
    problem = Problem(scale, entries, model_of, tuple(places), deviation, runs, step)
    best, minima = search(problem, starts, seed, optimiser, most)
    information, ends = _information(problem, best, known), None
    for _ in range(AGAIN if intervals else 0):
        rise = _rise(problem, best, known, level)
        ends, least = profile(problem, best, information.covariance, rise, optimiser, most)
        if least.chi2 > best.chi2 - SAME * (1.0 if known else information.variance):
            break
        best = least
        information = _information(problem, best, known)
    groups = _groups(entries, leave_out)
    return Fit(
        problem, best, tuple(minima), information, level, ends,
        None if groups is None else _left_out(problem, groups, best, known, leave_out, optimiser, most), known,
        tuple(groups or ()), fit_warnings(problem, best, minima, known),
    )  # fmt: skip


def _asked(
    model: Model | Mapping[str, Model], targets: Mapping[str, Any]
) -> tuple[list[Model], tuple[Entry, ...], tuple[int, ...], list[dict[str, Any]]]:
    """Different models, entries, number of the model of each, and the curves aimed at by model."""
    if not isinstance(targets, Mapping) or not targets:
        raise InputError(f"targets must be a mapping of what was measured by name, got {targets!r}")
    several = all(isinstance(t, Mapping) for t in targets.values())
    if not several and (any(isinstance(t, Mapping) for t in targets.values()) or isinstance(model, Mapping)):
        raise InputError("of several tests every one needs its own mapping of targets, by name of the test")
    tests: Mapping[str, Mapping[str, Any]] = targets if several else {"test": targets}
    models: list[Model] = []
    entries: list[Entry] = []
    model_of: list[int] = []
    aimed: list[dict[str, Any]] = []
    for test, asked in tests.items():
        if isinstance(model, Mapping) and test not in model:
            raise InputError(f"test {test!r} has no model; models: {', '.join(model)}")
        own: Any = model[test] if isinstance(model, Mapping) else model
        if not callable(own):
            raise InputError(f"a model must be a function of the parameters or a JointModel, got {own!r}")
        number = next((k for k, m in enumerate(models) if m is own), len(models))
        if number == len(models):
            models.append(own)
            aimed.append({})
        if not asked:
            raise InputError(f"test {test!r} has no targets")
        for name, target in asked.items():
            found = entries_of(test, name, target)
            entries += found
            model_of += [number] * len(found)
            if isinstance(target, CurveTarget | Curve):
                aimed[number][name] = target
    if isinstance(model, Mapping) and (idle := [n for n in model if n not in tests]):
        raise InputError(f"model {idle[0]!r} has no targets: leave it out")
    return models, tuple(entries), tuple(model_of), aimed


def _scatter_known(entries: Sequence[Entry], unknowns: int) -> bool:
    stated = [e.scatter is not None for e in entries]
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


def _variance(problem: Problem, best: Minimum, known: bool) -> float:
    return 1.0 if known else max(best.chi2, 1e-24) / max(problem.n - len(problem.scale), 1)


def _information(problem: Problem, best: Minimum, known: bool) -> Information:
    problem.runs.stage = "information"
    slopes = problem.jacobian(best.x, range(len(problem.scale)), central=True)
    return Information(problem.scale, slopes, _variance(problem, best, known))


def _rise(problem: Problem, best: Minimum, known: bool, level: float) -> float:
    if known:
        return float(stats.chi2.ppf(level, 1))
    dof = problem.n - len(problem.scale)
    return float(stats.f.ppf(level, 1, dof)) * _variance(problem, best, known)


def _groups(entries: Sequence[Entry], leave_out: str | Mapping[str, str] | None) -> list[str] | None:
    if leave_out is None:
        return None
    if isinstance(leave_out, Mapping):
        if missing := [e.test for e in entries if e.test not in leave_out]:
            raise InputError(f"leave_out names no group for test {missing[0]!r}")
        groups = [leave_out[e.test] for e in entries]
        if len(set(groups)) < 2:
            raise InputError("leave_out needs at least two groups")
        return groups
    if leave_out not in ("test", "quantity"):
        raise InputError(f"leave_out must be 'test', 'quantity', groups by test, or None, got {leave_out!r}")
    by_test = leave_out == "test" and len({e.test for e in entries}) > 1
    groups = [e.test if by_test else f"{e.test}: {e.reading.output} {e.reading.what}" for e in entries]
    return groups if len(set(groups)) > 1 else None


def _left_out(
    problem: Problem, groups: Sequence[str], best: Minimum, known: bool, by: str | Mapping[str, str] | None,
    optimiser: str, most: int,
) -> LeftOut:  # fmt: skip
    rows: dict[int, LeftOutRow] = {}
    for name, found in left_out(problem, groups, best, optimiser, most).items():
        mine = [g == name for g in groups]
        rest, gone = problem.only([not m for m in mine]), problem.only(mine)
        spread = _information(rest, found, known).covariance
        slopes = gone.jacobian(found.x, range(len(problem.scale))) * gone.deviation[:, None]
        open_ = np.sqrt(np.einsum("ij,jk,ik->i", slopes, spread, slopes))
        values = gone.predicted([found.x])[0]
        for k, e, v, d in zip(np.flatnonzero(mine), gone.entries, values, open_, strict=True):
            error = v / e.measured - 1.0 if e.relative else v - e.measured
            rows[int(k)] = LeftOutRow(name, e.label, e.measured, float(v), float(error), float(d))
    return LeftOut(tuple(rows[k] for k in sorted(rows)), "group" if isinstance(by, Mapping) else str(by))
