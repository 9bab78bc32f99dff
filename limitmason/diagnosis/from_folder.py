"""The arguments of a study out of a folder of CSV files: specimens, what was measured on them, and how well.

``specimens.csv`` has one row per specimen: "specimen", its name, and covariates. ``measured.csv`` has "specimen" and a
column per quantity; a blank cell is a missing value, "> 20" one that was not reached. Columns such as "opened a|b" hold
1 (seen) or 0. ``quantities.csv`` has one row per quantity: "quantity", "scatter" (of what was seen or not the rate of
misreading), and where the name does not tell, "kind" and "link" (see ``Observation``). ``predicted.csv``, as
``measured.csv``, holds predictions where no model is given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitmason import causes as catalogue
from limitmason.causes.cause import Cause
from limitmason.diagnosis.from_table import BATCHES, LEVELS, About, version_of
from limitmason.diagnosis.inference.noise import Measured
from limitmason.diagnosis.observations import EvidenceKind, Observation
from limitmason.errors import InputError
from limitmason.experiments.measured_table import MeasuredTable, read_measured, write_measured

SPECIMENS, MEASURED, QUANTITIES, PREDICTED = FILES = "specimens.csv", "measured.csv", "quantities.csv", "predicted.csv"


@dataclass(frozen=True)
class PredictedRows:
    """A simulator out of a table of predictions, by the name of the specimen."""

    values: Mapping[str, Mapping[str, float]]

    def __call__(self, specimen: Mapping[str, Any]) -> Mapping[str, float]:
        """Predictions of one specimen."""
        return self.values[specimen["specimen"]]


def folder_arguments(
    folder: str | Path,
    *,
    model: Callable[..., Any] | None = None,
    causes: Iterable[Cause] | None = None,
    inputs: Mapping[str, Measured] | None = None,
    shared: Sequence[str] | None = None,
    covariates: Sequence[str] | None = None,
    title: str | None = None,
    levels: int | None = None,
) -> dict[str, Any]:
    """Arguments of ``Study``; see :meth:`limitmason.diagnosis.Study.from_folder`."""
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder")
    for name in (SPECIMENS, MEASURED, QUANTITIES, *(() if model is not None else (PREDICTED,))):
        if not (folder / name).exists():
            more = ", or a model that predicts" if name == PREDICTED else ""
            raise InputError(f"{folder} lacks {name}{more}; `limitmason diagnose --template DIR` writes an example")
    specimens = read_measured(folder / SPECIMENS)
    names = [str(v) for v in specimens.column("specimen")]
    if twice := next((n for i, n in enumerate(names) if n in names[:i]), None):
        raise InputError(f"{specimens.name}: specimen {twice!r} is there twice")
    rows = [{**row, "specimen": name} for row, name in zip(specimens.rows, names, strict=True)]
    measured = read_measured(folder / MEASURED, blanks=True)
    known = _quantities(read_measured(folder / QUANTITIES), measured)
    observed = []
    for i, row in enumerate(measured.rows):
        for quantity, said in known.items():
            observed.append(Observation(
                str(row["specimen"]), quantity, float(row[quantity]), unit=measured.units[quantity],
                beyond=measured.beyond.get((i, quantity), ""), **said,
            ))  # fmt: skip
    if model is None:
        model = PredictedRows(_values(read_measured(folder / PREDICTED), measured, names, known))
    kept = [c for c, v in specimens.columns.items() if c != "specimen" and len(set(v)) > 1]
    return {
        "specimens": rows,
        "simulate": model,
        "measured": observed,
        "nuisance": dict(inputs or {}),
        "covariates": list(kept if covariates is None else covariates),
        "shared": shared,
        "levels": levels or LEVELS[isinstance(model, PredictedRows)],
        "version": version_of(model),
        "causes": tuple(_readings(specimens) if causes is None else causes),
        "about": About(title or folder.name, specimens.units, ", ".join(f"{q} [{measured.units[q]}]" for q in known)),
    }


def _quantities(table: MeasuredTable, measured: MeasuredTable) -> dict[str, dict[str, Any]]:
    """What is said of every quantity, by its name."""
    out: dict[str, dict[str, Any]] = {}
    table.column("scatter", "the error of each quantity")
    for line, row in zip(table.lines, table.rows, strict=True):
        quantity = str(row.get("quantity", ""))
        if quantity not in measured.columns:
            raise InputError(f"{table.name}: row {line}: {measured.name} has no column {quantity!r}")
        out[quantity] = {k: row[k] if k == "scatter" else str(row[k]) for k in ("scatter", "kind", "link") if k in row}
    if bare := [q for q in measured.columns if q != "specimen" and q not in out]:
        raise InputError(f"{table.name}: there is no row for the quantity {bare[0]!r} of {measured.name}")
    return out


def _values(
    table: MeasuredTable, measured: MeasuredTable, names: Sequence[str], quantities: Iterable[str]
) -> dict[str, dict[str, float]]:  # fmt: skip
    """Predictions by specimen, in the units of what was measured."""
    for quantity in quantities:
        table.column(quantity, "the predictions")
        if table.units[quantity] != measured.units[quantity]:
            given, wanted = table.units[quantity], measured.units[quantity]
            raise InputError(f"{table.name}: column {quantity!r} is in {given!r}, measured in {wanted!r}: use one unit")
    out = {str(row["specimen"]): {q: float(row[q]) for q in quantities} for row in table.rows}
    if missing := [n for n in names if n not in out]:
        raise InputError(f"{table.name} has no row for specimen {missing[0]!r}")
    return out


def _readings(specimens: MeasuredTable) -> list[Cause]:
    """Causes in the measurement, which need no model: a gain, and labels that another gain may have read."""
    out = [catalogue.gain()]
    for column in (b for b in BATCHES if b in specimens.columns):
        values = list(specimens.columns[column])
        first = max(dict.fromkeys(values), key=values.count)
        out += [catalogue.batch_shift(covariate=column, label=v) for v in dict.fromkeys(values) if v != first]
    return out


def write_folder(folder: str | Path) -> Path:
    """Write an example of the four files: twelve stacks with peak, stiffness and frequency, one cell missing.

    Raises
    ------
    InputError
        Where a file stands in the way.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    scatter = {"peak": 0.05, "stiffness": 0.08, "frequency 1": 0.01}
    units = {"specimen": "-", "peak": "kN", "stiffness": "kN/mm", "frequency 1": "Hz"}
    specimens, predicted, measured = [], [], []
    for k in range(12):
        height, width, batch = 0.4 + 0.1 * (k // 2), (0.16, 0.10)[k // 2 % 2], "AB"[k % 2]
        name = f"stack {k + 1}"
        stiffness = 100.0 * (width / height) ** 3
        found = {"peak": 10.0 * width / height, "stiffness": stiffness, "frequency 1": float(np.sqrt(50.0 * stiffness))}
        specimens.append({"specimen": name, "height": height, "width": width, "batch": batch})
        predicted.append({"specimen": name, **{q: f"{v:.5g}" for q, v in found.items()}})
        gain = {"peak": 1.2, "stiffness": 1.2}  # of a load cell: forces and stiffness read high, frequencies do not
        read = {q: v * gain.get(q, 1.0) * np.exp(scatter[q] * rng.standard_normal()) for q, v in found.items()}
        measured.append({"specimen": name, **{q: f"{v:.4g}" for q, v in read.items()}})
    measured[3]["stiffness"] = ""
    about = [{"quantity": q, "scatter": sd, "kind": kind, "link": "log"} for (q, sd), kind in
             zip(scatter.items(), EvidenceKind, strict=False)]  # fmt: skip
    write_measured(folder / SPECIMENS, {"specimen": "-", "height": "m", "width": "m", "batch": "-"}, specimens)
    note = "made up, with a load cell that reads 20 % high; a blank cell is a missing value"
    write_measured(folder / MEASURED, units, measured, note)
    write_measured(folder / PREDICTED, units, predicted, "left out where a model predicts")
    write_measured(folder / QUANTITIES, {"quantity": "-", "scatter": "-", "kind": "-", "link": "-"}, about)
    return folder
