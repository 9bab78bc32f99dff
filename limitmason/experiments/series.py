"""Packaged series: their measured values as a table, and what a study of them has to know."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.errors import InputError
from limitmason.experiments import registry
from limitmason.experiments.experiment import Experiment
from limitmason.model import Loads
from limitmason.storage.files import write_text
from limitmason.storage.measured_table import MeasuredTable, force_factor, write_measured

WORDS = ("stone", "loading")  # of a packaged row, beside its parameters
RESULTS = ("failure type", "failure")  # parameters that are outcomes, not covariates


def series_of(name: str) -> str | None:
    """The packaged source that a name means, in full or by its beginning, or None."""
    found = [s for s in registry.sources() if s == name] or [s for s in registry.sources() if s.startswith(name)]
    if len(found) > 1:
        raise InputError(f"the series {name!r} could be {' or '.join(found)}")
    return found[0] if found else None


def cases_of(series: str) -> list[Experiment]:
    """All experiments of a series."""
    return [registry.load(series, s) for s in registry.specimens(series)]


def tilted(series: str) -> bool:
    """Whether a packaged series consists of tilting tests."""
    return "tilt angle" in cases_of(series)[0].measured


def overloaded(series: str, rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether the dead load of a series is more than the weight of its blocks.

    Its first row is asked.
    """
    test = registry.load(series, rows[0]["specimen"])
    wall = test.assembly()
    return not np.allclose(test.loads().dead, Loads.weight(wall).dead)


def check_specimens(table: MeasuredTable, series: str, measured: str) -> tuple[float, str]:
    """Factor from the unit of a measured column to that of predictions, and that.

    ``measured`` is the name of the column. Specimens and directions of the table that the series does not have are
    refused.
    """
    check_names(table, series)
    table.column(measured, "the measured values")
    unit = registry.load(series, registry.specimens(series)[0]).multiplier_to_measured.unit
    return force_factor(table.units[measured], unit, f"{table.name}: column {measured!r}"), unit


def check_names(table: MeasuredTable, series: str) -> None:
    """Refuse specimens and directions of a table that the series does not have."""
    known = registry.specimens(series)
    for line, name in zip(table.lines, table.column("specimen", f"the specimens of {series}"), strict=True):
        if name not in known:
            raise InputError(
                f"{table.name}: row {line}, column 'specimen': {series} has no {name!r}; it has {', '.join(known)}"
            )
    for line, sense in zip(table.lines, table.columns.get("direction", ()), strict=False):
        if sense not in ("+", "-"):
            raise InputError(f"{table.name}: row {line}, column 'direction' must be + or -, got {sense!r}")


def series_notes(series: str, table: MeasuredTable, inputs: Iterable[str]) -> list[str]:
    """What the models of a series assume, and what its sources leave open.

    Each is one sentence.

    Parameters
    ----------
    series : name of the packaged source
    table : whose specimens are asked for
    inputs : names of the measured inputs, which close what the sources leave open
    """
    cases = [registry.load(series, name) for name in dict.fromkeys(table.column("specimen"))]
    said = Counter(sentence for case in cases for sentence in case.assumptions)
    given = set(inputs)
    left_open: Counter[str] = Counter()
    for case in cases:
        for name, values in case.open_options.items():
            # words, such as a bond, are no inputs that could be measured
            if name not in given and all(isinstance(v, float) for v in values):
                left_open[f"The sources leave {name} open ({min(values):g} to {max(values):g}); no measured input of "
                          "that name is given, so it is taken as exact."] += 1
    sentences = [*said.items(), *left_open.items()]
    return [s if k == len(cases) else f"{s} (For {k} of the specimens.)" for s, k in sentences]


def packaged_table(series: str) -> MeasuredTable:
    """Measured values of a packaged series, one row per value.

    What varies between specimens stands beside them.

    Raises
    ------
    InputError
        Where nothing was measured.
    """
    rows, units = [], {"specimen": "-", "direction": "-", "measured": "-", "group": "-"}
    configurations: dict[tuple, str] = {}  # letter of a group by the parameters that its specimens share
    cases = cases_of(series)
    shown: dict[str, str] = {}  # units of the parameters by name
    for case in cases:
        for name, value in case.parameters.items():
            if name not in RESULTS:
                shown.setdefault(name, getattr(value, "unit", "-"))
    for case in cases:
        words = {w: case.row[w] for w in WORDS if case.row.get(w)}
        own = {k: _plain(case.parameters[k]) for k in shown if k in case.parameters}
        group = configurations.setdefault(tuple(own.items()), _letter(len(configurations)))
        # where nothing can be predicted what others computed stands beside what was measured
        published = [t for t in case.targets if t.kind == "published"] if not case.has_model else []
        for target in case.targets:
            if target.kind != "measured":
                continue
            row = {"specimen": case.specimen, "direction": target.direction, "measured": float(case.value(target)),
                   "group": group, **own, **words}
            for k, other in enumerate(published):
                name = "predicted" if k == 0 else other.quantity
                row[name] = float(case.value(other))
                units[name] = case.value(other).unit
            units["measured"] = case.value(target).unit
            rows.append(row)
            units.update({w: "-" for w in words})
    if not rows:
        raise InputError(f"{series} has no measured values; it is a numerical benchmark")
    units.update({k: u for k, u in shown.items() if k not in units})
    # columns that every row has, and of covariates only those that vary
    whole = [k for k in units if all(k in r for r in rows)]
    kept = [k for k in whole if k in ("specimen", "measured", "group", "predicted") or len({r[k] for r in rows}) > 1]
    if len(configurations) in (1, len(cases)):  # no repeats known, or nothing to tell configurations apart by
        kept.remove("group")
    return MeasuredTable(
        name=series, units={k: units[k] for k in kept}, columns={k: tuple(r[k] for r in rows) for k in kept},
        lines=tuple(range(1, len(rows) + 1)),
    )


def _letter(number: int) -> str:
    """Name of a group by its number from 0: A to Z, then A' to Z', and so on."""
    return chr(ord("A") + number % 26) + "'" * (number // 26)


def _plain(value: Any) -> Any:
    """A parameter as a word or a plain number."""
    return value if isinstance(value, str) else float(value)


def write_template(path: Path, model: str | None = None) -> None:
    """Write a data file to start from: an example, or the measured values of a series.

    Parameters
    ----------
    path : of the file, which must not be there yet
    model : name of a packaged series, or its beginning; None for the example

    Raises
    ------
    InputError
        For a series that is not packaged, or a file that exists.
    """
    series = series_of(model) if model and ":" not in model else None
    if model and series is None:
        known = ", ".join(registry.sources())
        raise InputError(f"a template of {model!r}: that is no packaged series; they are {known}")
    if series is not None:
        table = packaged_table(series)
        source = registry.load(series, registry.specimens(series)[0]).source
        write_measured(path, table.units, table.rows, f"{source.title}\n{source}")
        return
    copy_template("data.csv", path)


def copy_template(name: str, path: Path) -> None:
    """Copy the file ``name`` of the folder ``template`` to a path.

    Its example numbers are made up.

    Raises
    ------
    InputError
        Where the file exists already.
    """
    if path.exists():
        raise InputError(f"{path} exists already; choose another name")
    write_text(path, (files(__package__) / "template" / name).read_text(encoding="utf-8"))
