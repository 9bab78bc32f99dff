"""Predictions held against the measured and published values of the packaged experiments."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import isfinite, isnan
from pathlib import Path
from typing import Any

from limitmason.answers.method import hyphened
from limitmason.answers.results import FlowRule
from limitmason.checks import choice, instance, listener, several
from limitmason.comparison.rows import NAN, Row
from limitmason.display.progress import reached, watched
from limitmason.display.text_table import abridged, aligned
from limitmason.errors import InputError
from limitmason.experiments.experiment import KINDS, Experiment, TargetValue
from limitmason.experiments.registry import all_cases, tabled
from limitmason.methods import LIMIT, get_method, method_name, predict
from limitmason.storage.csv_table import write_table

NO_MODEL = "no assembly"
OPEN = "what the sources leave open"
"""What the range of a row is that :func:`run` made with ``spread``."""


def run(
    test: Experiment,
    method: str = "limit",
    *,
    flow_rule: str | None = None,
    kinds: Iterable[str] = ("measured", "published"),
    quantities: Iterable[str] | None = None,
    spread: bool = False,
    **settings: Any,
) -> tuple[Row, ...]:
    """Predict an experiment and compare with its values.

    Parameters
    ----------
    test : the experiment, with the options chosen for it
    method : as in ``limitmason.predict``; "associative" and "non-associative" are "limit" with that flow rule
    flow_rule : limit analysis only. None: published values with the flow rule they were computed with, measured ones
        with the associative rule. Given: measured values with this rule, and only the published ones computed with it
    kinds : which values to compare with, out of "measured", "published", "recomputed"
    quantities : only these, of those that the experiment has
    spread : also predict over all combinations of the experiment's ``open_options`` and report the range of the
        answers; a combination without one counts for nothing
    settings : passed to the method

    Returns
    -------
    tuple of Row
        One row per value; without an assembly, and where the method refuses the structure or finds no answer, the rows
        say so and predict NaN.

    Raises
    ------
    InputError
        For unknown kinds and flow rules, quantities that the experiment does not have, and a flow rule with a method
        that has none.
    """
    instance("test", test, Experiment, "limitmason.experiments.load")
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    if unknown := [k for k in kinds if k not in KINDS]:
        raise InputError(f"kinds: there is no {unknown[0]!r}; known are {', '.join(KINDS)}")
    method, flow_rule = method_name(method), hyphened(flow_rule, tuple(FlowRule))
    if flow_rule is not None and method == LIMIT:
        choice("flow_rule", flow_rule, tuple(FlowRule))
    if flow_rule is not None and method != LIMIT:
        raise InputError(f"flow_rule is an option of limit analysis; method {method!r} takes that of the joints")
    wanted = _quantities(quantities, [test])
    solved: dict[tuple, Row] = {}

    def solve(options: Mapping[str, Any], direction: str, rule: str) -> Row:
        """Row of the specimen in a direction, computed once for all values that ask.

        Parameters
        ----------
        options : of the assembly
        direction : of the live load
        rule : flow rule, "" where the method has none
        """
        key = (rule, direction, tuple(sorted(options.items())))
        if key not in solved:
            chosen = {**settings, "flow_rule": rule} if rule else settings
            solved[key] = _solve(test, options, direction, method, chosen)
        return solved[key]

    factor = float(test.multiplier_to_measured)
    combinations = _combinations(test) if spread else []
    rows = []
    for target in test.targets:
        if target.kind not in kinds or target.quantity not in wanted:
            continue
        rule = _flow_rule(target, method, flow_rule)
        if rule is None:
            continue
        row = solve(target.options, target.direction, rule)
        # what the value itself was stated for is settled, also where the sources leave it open for others
        others = [solve({**c, **target.options}, target.direction, rule) for c in combinations]
        if combinations:
            found = [r.multiplier * factor for r in (row, *others) if not isnan(r.multiplier)]
            if found:
                row = replace(row, low=min(found), high=max(found), range_is=OPEN)
        rows.append(replace(
            row, factor=factor, reference=test.value(target), source=test.source.name, specimen=test.specimen,
            quantity=target.quantity, kind=test.standing(target), flow_rule=rule, options=dict(target.options),
        ))
    return tuple(rows)


def _quantities(asked: Iterable[str] | None, tests: Iterable[Experiment]) -> set[str]:
    """Names of the quantities to compare.

    Parameters
    ----------
    asked : one name or several, each of a quantity that one of the tests has; None for all of them
    tests : the experiments
    """
    known = dict.fromkeys(t.quantity for test in tests for t in test.targets)
    wanted = list(known) if asked is None else [asked] if isinstance(asked, str) else list(asked)
    for name in wanted:
        choice("quantities", name, known)
    return set(wanted)


def _flow_rule(target: TargetValue, method: str, asked: str | None) -> str | None:
    """Flow rule to predict a value with, "" of a method without, None to leave it out.

    Parameters
    ----------
    target : the measured or published value
    method : by which it is predicted
    asked : flow rule that a user asks for, None for that of the value
    """
    if method != LIMIT and method not in tuple(FlowRule):
        return ""
    if method == LIMIT and asked is None:
        return target.flow_rule or "associative"
    rule = asked or method  # a method of that name is the rule
    # a value computed by another rule is not comparable; a measured one knows no rule
    if target.flow_rule not in (None, rule):
        return None
    return rule if method == LIMIT else ""


def _combinations(test: Experiment) -> list[dict[str, Any]]:
    """Every combination of the options that the sources leave open, or none where they leave nothing open."""
    names = list(test.open_options)
    return [dict(zip(names, values, strict=True)) for values in product(*test.open_options.values())] if names else []


def _solve(
    test: Experiment, options: Mapping[str, Any], direction: str, method: str, settings: Mapping[str, Any]
) -> Row:
    """Row of one method for a test with options, or one that says there is no model.

    Parameters
    ----------
    test : the experiment
    options : of its model, over those chosen for it
    direction : of the live load
    method : its name
    settings : of the method, among them the flow rule where it has one
    """
    if not test.has_model:
        return Row(method, status=NO_MODEL)
    case = test.with_options(**options) if options else test
    assembly, loads = case.assembly(), case.loads(direction)
    chosen = get_method(method, settings.get("flow_rule")).one_of_many(settings)
    return Row.attempted(method, lambda: predict(assembly, loads, method, **chosen))


@watched("experiments")
def table(
    cases: Iterable[Experiment] | None = None,
    *,
    source: str | Sequence[str] | None = None,
    method: str = "limit",
    quantities: Iterable[str] | None = None,
    with_model: bool | None = True,
    progress: Callable[[str], object] | None = None,
    **arguments: Any,
) -> tuple[Row, ...]:
    """Rows of :func:`run` for many experiments.

    Parameters
    ----------
    cases : the experiments; by default all packaged ones with an assembly
    source : only this source, or these
    method, arguments : as in :func:`run`
    quantities : only these, of those that one of the experiments has
    with_model : as in ``all_cases``, of a source; cases that are given are taken as they are
    progress : called with a line before each experiment
    """
    if cases is None:
        names = tabled() if source is None else (source,) if isinstance(source, str) else tuple(source)
        cases = [case for name in names for case in all_cases(source=name, with_model=with_model)]
    elif source is not None:
        raise InputError("give either cases or source")
    cases = several("cases", cases, Experiment)
    wanted = _quantities(quantities, cases)
    if "kinds" in arguments and not isinstance(arguments["kinds"], str):
        arguments["kinds"] = tuple(arguments["kinds"])  # those of an iterator are for every experiment
    listener("progress", progress, "a line of text")
    rows: list[Row] = []
    for k, case in enumerate(cases, 1):
        reached((k - 1) / len(cases), case.specimen, share=1.0 / len(cases))
        if progress is not None:
            progress(f"[{k}/{len(cases)}] {case.source.name}/{case.specimen}")
        rows += run(case, method, quantities=wanted & {t.quantity for t in case.targets}, **arguments)
    return tuple(rows)


def write_rows(rows: Iterable[Row], path: str | Path) -> None:
    """Write rows of :func:`table` to a CSV file, one line each, with a comment line of units below the names.

    Parameters
    ----------
    rows : predicted and measured
    path : of the file
    """
    units = {
        "source": "-", "specimen": "-", "quantity": "-", "kind": "-", "unit": "unit of reference and predicted",
        "reference": "unit", "predicted": "unit", "ratio": "-", "method": "-", "flow_rule": "-", "status": "-",
        "seconds": "s",
    }
    lines = []
    for r in rows:
        reference = NAN if r.reference is None else float(r.reference)
        shown = {"reference": reference, "seconds": f"{r.seconds:.3f}"}
        lines.append([shown[name] if name in shown else getattr(r, name) for name in units])
    write_table(path, units, lines)


def as_text(rows: Iterable[Row]) -> str:
    """Rows as a table in plain text, one line each, the middle of many left out with a count."""
    header = ("experiment", "quantity", "kind", "reference", "predicted", "range", "ratio", "flow rule", "status", "s")
    lines: list[tuple[str, ...]] = [header]
    for r in rows:
        known = isfinite(r.predicted)
        options = "".join(f", {k} {v}" for k, v in r.options.items())
        line = (
            f"{r.source}/{r.specimen}", r.quantity + options, r.kind, "-" if r.reference is None else str(r.reference),
            f"{r.predicted:.5g}" if known else "-", f"{r.low:.4g} to {r.high:.4g}" if r.has_range else "",
            f"{r.ratio:.3f}" if isfinite(r.ratio) else "-", r.flow_rule or r.method, r.status, f"{r.seconds:.2f}",
        )
        lines.append(line)
    column = header.index("range")
    align = "<<<>>>><<>"
    if not any(line[column] for line in lines[1:]):  # no method gave one
        lines = [line[:column] + line[column + 1:] for line in lines]
        align = align[:column] + align[column + 1:]
    shown, cut = abridged(lines[1:])
    table = aligned([lines[0], *shown], align)
    return "\n".join([table, *(f"{c}: write_rows (--csv FILE) writes them" for c in cut)])
