"""Runs of the models of a calibration: in parallel, counted, never repeated, kept on disk, with the time left."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.calibration.targets import OutputValue, check_units, outputs_of
from limitmason.display.progress import reached
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.study.linked_formulas import LinkedFormulas
from limitmason.study.memo import Memo
from limitmason.study.sweep import Progress

Model = Callable[..., Any]


class Runs:
    """Models with a memory.

    Parameters
    ----------
    models : called with the parameters that they take, and those tied to them, as keywords
    readings : of every model, what is read of its answer
    aimed : of every model, name and target of every measured curve, to check units
    names : names of the parameters that are fitted
    ties : formulas of further parameters from these
    executor, workers : as for :func:`limitmason.study.sweep`
    store : file that keeps every finished run
    key : fingerprint of models and readings
    progress : called with a line of text after every batch of runs

    Raises
    ------
    InputError
        For a parameter that no model takes, or one that a model needs and nothing gives.
    """

    def __init__(
        self, models: Sequence[Model], readings: Sequence[Sequence[OutputValue]],
        aimed: Sequence[Sequence[tuple[str, Any]]], names: Sequence[str], ties: LinkedFormulas, *, executor: Any,
        workers: int, store: str | Path | None, key: str, progress: Progress | None,
    ) -> None:
        """Check that every parameter reaches a model, and open the store of runs.

        Parameters
        ----------
        models, readings, aimed, names, ties, executor, workers, store, key, progress : see the class
        """
        self.models, self.readings, self.aimed, self.ties = tuple(models), tuple(readings), tuple(aimed), ties
        self.names = tuple(names)
        given = (*self.names, *ties.formulas)
        self.takes = [taken(m, given) for m in self.models]
        # of every fitted parameter, itself and what is tied to it
        feeds = {n: {n, *(t for t in ties.formulas if n in _needs(ties, t))} for n in self.names}
        idle = [n for n in self.names if not any(feeds[n] & set(t) for t in self.takes)]
        if idle:
            every = sorted({n for m in self.models for n in keywords(m) or ()})
            raise InputError(f"no model takes the parameter {idle[0]!r}; they take: {', '.join(every) or 'none'}")
        if bare := [n for m in self.models for n in required(m) if n not in given]:
            raise InputError(f"the model needs {bare[0]!r}: give Parameter({bare[0]!r}, start, (low, high)), or a tie")
        self.executor, self.workers, self.progress = executor, workers, progress
        self.calls, self.seconds = 0, 0.0  # runs made, and the time that they took
        self.told = 0  # runs made at the last line of progress
        self.stage, self.best = "", ""  # of the search, and its best values, in words
        self.left = 0  # runs that are expected still, 0 where that is not known
        self.memo = Memo(store, key, kind=dict)

    def __call__(self, points: Sequence[Mapping[str, float]], of: Iterable[int]) -> list[list[Array]]:
        """Numbers read of some models at every point, one array per model.

        They are NaN where a model refuses or finds no answer.

        Parameters
        ----------
        points : parameters by name
        of : numbers of the models wanted
        """
        of = list(of)
        wanted = [[self._key(m, p) for m in of] for p in points]
        missing = {
            key: {"model": self.models[m], "readings": self.readings[m], "aimed": self.aimed[m],
                  "parameters": self._taken(m, p)}
            for p, row in zip(points, wanted, strict=True) for m, key in zip(of, row, strict=True)
            if key not in self.memo
        }
        if missing:
            self._run(missing)
        return [[np.array(self.memo[key]["values"], dtype=float) for key in row] for row in wanted]

    def note(self, point: Mapping[str, float], of: int) -> str:
        """Why model number ``of`` gave no answer at a point, or empty where it did."""
        return str(self.memo[self._key(of, point)]["note"])

    def _taken(self, m: int, point: Mapping[str, float]) -> dict[str, float]:
        """Parameters that model number ``m`` takes at a point, those tied to the fitted ones included."""
        every = self.ties(point)
        return {n: float(every[n]) for n in self.takes[m]}

    def _key(self, m: int, point: Mapping[str, float]) -> tuple[int | float, ...]:
        """Key of a run in the memory: number of the model, then the values that it takes."""
        return (m, *self._taken(m, point).values())

    def _run(self, missing: Mapping[tuple[int | float, ...], dict[str, Any]]) -> None:
        """Run what is missing and keep it, while the clock and the bar go on.

        ``missing`` holds the arguments of :func:`_one` by the key of the run.
        """
        clock, before = time.perf_counter(), self.calls
        for _ in self.memo.map(_one, missing, executor=self.executor, workers=self.workers):
            self.calls += 1
            ahead = max(self.left, len(missing) - (self.calls - before))
            reached(self.calls / (self.calls + ahead), f"{self.stage}{self.best}: {self.calls} runs")
        self.seconds += time.perf_counter() - clock

    def tell(self, best: str) -> None:
        """Write a line of progress where runs were made since the last one.

        ``best`` are the best values in words.
        """
        self.best, news, self.told = best, self.calls > self.told, self.calls
        if news and self.progress is not None:
            left = f", about {self.seconds / self.calls * self.left:.0f} s left" if self.left else ""
            self.progress(f"{self.stage}{best}: {self.calls} runs in {self.seconds:.0f} s{left}")


def _one(
    model: Model, readings: Sequence[OutputValue], aimed: Sequence[tuple[str, Any]], parameters: Mapping[str, float]
) -> dict[str, Any]:
    """Values that one model gives at one point, or NaN and the reason why it refuses.

    Parameters
    ----------
    model : called with the parameters
    readings : what is read of its answer
    aimed : name and target of every curve that it is held against, to check units
    parameters : its arguments, by name
    """
    try:
        outputs = outputs_of(model(**parameters))
    except (NotApplicable, NotConverged) as refused:
        return {"values": [float("nan")] * len(readings), "note": f"{type(refused).__name__}: {refused}"}
    for name, target in aimed:
        check_units(target, outputs.get(name), name)
    return {"values": [r.of(outputs) for r in readings], "note": ""}


def _signature(model: Model) -> list[inspect.Parameter] | None:
    """Parameters of a model by name, and a ``**`` where it has one; None where it does not tell."""
    try:
        signature = inspect.signature(model).parameters.values()
    except (TypeError, ValueError):
        return None
    return [p for p in signature if p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD, p.VAR_KEYWORD)]


def keywords(model: Model) -> tuple[str, ...] | None:
    """Names that a model takes, or None where it takes any."""
    own = getattr(model, "parameters", None)
    if own is not None and not callable(own):
        return tuple(own)
    named = _signature(model)
    return None if named is None or any(p.kind is p.VAR_KEYWORD for p in named) else tuple(p.name for p in named)


def required(model: Model) -> list[str]:
    """Names that a model must be given, as far as its signature tells."""
    if getattr(model, "parameters", None) is not None:
        return []
    return [p.name for p in _signature(model) or () if p.default is p.empty and p.kind is not p.VAR_KEYWORD]


def taken(model: Model, given: Sequence[str]) -> tuple[str, ...]:
    """Those of the given names that a model takes, in order."""
    names = keywords(model)
    return tuple(given) if names is None else tuple(n for n in given if n in names)


def _needs(ties: LinkedFormulas, name: str) -> set[str]:
    """Everything that a tied quantity depends on, directly or through others."""
    direct = set(ties.direct(name))
    return direct | {n for d in direct if d in ties.formulas for n in _needs(ties, d)}
