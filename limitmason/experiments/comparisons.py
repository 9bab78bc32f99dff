"""Predictions held against the measured and published values of the packaged experiments."""

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import isfinite, nan
from typing import Any

from limitmason.experiments.record import KINDS, Experiment, Quantity, Target
from limitmason.experiments.registry import all_cases, sources
from limitmason.methods import predict
from limitmason.results import Prediction

NO_MODEL = "no assembly"


@dataclass(frozen=True, eq=False)
class Comparison:
    """One predicted value beside one value of an experiment.

    Parameters
    ----------
    source, specimen : which experiment
    quantity, kind : which of its values; kind is "measured", "published", "recomputed", or "derived" where the source
        states something that the value follows from
    reference : that value
    predicted : in the unit of ``reference``; NaN without a prediction
    low, high : smallest and largest prediction over what the sources leave open; NaN where not asked for
    method, flow_rule : what predicted it; the flow rule is empty for methods other than limit analysis
    options : options of the assembly that differ from the experiment's own
    status : of the prediction, or why there is none
    seconds : time of the prediction; a value shared by several rows carries the same time
    prediction : the whole answer, with mechanism and certificate
    """

    source: str
    specimen: str
    quantity: str
    kind: str
    reference: Quantity
    predicted: float
    method: str
    flow_rule: str
    status: str
    seconds: float
    low: float = nan
    high: float = nan
    options: Mapping[str, Any] = field(default_factory=dict)
    prediction: Prediction | None = None

    @property
    def unit(self) -> str:
        """Unit of both values."""
        return self.reference.unit

    @property
    def ratio(self) -> float:
        """Predicted over reference."""
        return self.predicted / float(self.reference) if self.reference else nan


def run(
    test: Experiment,
    method: str = "limit",
    *,
    flow_rule: str | None = None,
    kinds: Iterable[str] = ("measured", "published"),
    quantities: Iterable[str] | None = None,
    spread: bool = False,
    **settings: Any,
) -> tuple[Comparison, ...]:
    """Predict an experiment and compare with its values.

    Parameters
    ----------
    test : the experiment, with the options chosen for it
    method : as in ``limitmason.predict``
    flow_rule : limit analysis only. None: published values with the flow rule they were computed with, measured ones
        with the associative rule. Given: measured values with this rule, and only the published ones computed with it
    kinds : which values to compare with, out of "measured", "published", "recomputed"
    quantities : only these
    spread : also predict over all combinations of the experiment's ``open_options`` and report the range
    settings : passed to the method

    Returns
    -------
    tuple of Comparison
        One row per value; without an assembly the rows say so and predict NaN.

    Raises
    ------
    ValueError
        For unknown kinds, and a flow rule with a method that has none.
    """
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    if unknown := [k for k in kinds if k not in KINDS]:
        raise ValueError(f"kinds: there is no {unknown[0]!r}; known are {', '.join(KINDS)}")
    if flow_rule is not None and method != "limit":
        raise ValueError(f"flow_rule is an option of limit analysis; method {method!r} takes that of the joints")
    wanted = None if quantities is None else set(quantities)
    solved: dict[tuple, tuple[Prediction | None, str, float]] = {}

    def solve(options: Mapping[str, Any], direction: str, rule: str) -> tuple[Prediction | None, str, float]:
        key = (rule, direction, tuple(sorted(options.items())))
        if key not in solved:
            solved[key] = _solve(
                test, options, direction, method, {**settings, "flow_rule": rule} if rule else settings
            )
        return solved[key]

    factor = float(test.multiplier_to_measured)
    combinations = _combinations(test) if spread else []
    rows = []
    for target in test.targets:
        if target.kind not in kinds or (wanted is not None and target.quantity not in wanted):
            continue
        rule = _flow_rule(target, method, flow_rule)
        if rule is None:
            continue
        prediction, status, seconds = solve(target.options, target.direction, rule)
        value = prediction.collapse_multiplier * factor if prediction is not None else nan
        others = [solve({**c, **target.options}, target.direction, rule)[0] for c in combinations]
        found = [value] + [p.collapse_multiplier * factor for p in others if p is not None]
        row = Comparison(
            test.source.name, test.specimen, target.quantity, test.standing(target), test.value(target), value, method,
            rule, status, seconds, min(found) if combinations else nan, max(found) if combinations else nan,
            dict(target.options), prediction,
        )  # fmt: skip
        rows.append(row)
    return tuple(rows)


def _flow_rule(target: Target, method: str, asked: str | None) -> str | None:
    """Flow rule to predict a target with, empty where the method has none, None to leave the target out."""
    if method != "limit":
        return ""
    if asked is None:
        return target.flow_rule or "associative"
    return asked if target.flow_rule in (None, asked) else None


def _combinations(test: Experiment) -> list[dict[str, Any]]:
    """Every combination of the options that the sources leave open; none where they leave nothing open."""
    names = list(test.open_options)
    return [dict(zip(names, values, strict=True)) for values in product(*test.open_options.values())] if names else []


def _solve(
    test: Experiment, options: Mapping[str, Any], direction: str, method: str, settings: Mapping[str, Any]
) -> tuple[Prediction | None, str, float]:
    if not test.has_model:
        return None, NO_MODEL, 0.0
    case = test.with_options(**options) if options else test
    assembly, loads = case.assembly(), case.loads(direction)
    start = time.perf_counter()
    # one run of many: the DEM's error budget would cost as much again
    single = {"error_budget": (), **settings} if method == "dem" else settings
    prediction = predict(assembly, loads, method, **single)
    return prediction, prediction.status, time.perf_counter() - start


def table(
    cases: Iterable[Experiment] | None = None,
    *,
    source: str | Sequence[str] | None = None,
    method: str = "limit",
    with_model: bool | None = True,
    **arguments: Any,
) -> tuple[Comparison, ...]:
    """Rows of :func:`run` for many experiments.

    Parameters
    ----------
    cases : the experiments; by default all packaged ones with an assembly
    source : only this source, or these
    method, arguments : as in :func:`run`
    with_model : as in ``all_cases``
    """
    if cases is None:
        names = sources() if source is None else (source,) if isinstance(source, str) else tuple(source)
        cases = [case for name in names for case in all_cases(source=name, with_model=with_model)]
    elif source is not None:
        raise ValueError("give either cases or source")
    return tuple(row for case in cases for row in run(case, method, **arguments))


def as_text(rows: Iterable[Comparison]) -> str:
    """Rows as a table in plain text, one line each."""
    header = ("experiment", "quantity", "kind", "reference", "predicted", "range", "ratio", "flow rule", "status", "s")
    lines = [header]
    for r in rows:
        known = isfinite(r.predicted)
        options = "".join(f", {k} {v}" for k, v in r.options.items())
        line = (
            f"{r.source}/{r.specimen}", r.quantity + options, r.kind, str(r.reference),
            f"{r.predicted:.5g}" if known else "-", f"{r.low:.4g} to {r.high:.4g}" if isfinite(r.low) else "",
            f"{r.ratio:.3f}" if known else "-", r.flow_rule or r.method, r.status, f"{r.seconds:.2f}",
        )  # fmt: skip
        lines.append(line)
    if not any(line[5] for line in lines[1:]):
        lines = [line[:5] + line[6:] for line in lines]
    width = [max(map(len, column)) for column in zip(*lines, strict=True)]
    align = "<<<>>" + ">" * (len(width) - 8) + "<<>"
    return "\n".join(
        "  ".join(f"{c:{a}{w}}" for c, a, w in zip(line, align, width, strict=True)).rstrip() for line in lines
    )
