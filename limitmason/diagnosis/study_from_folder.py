"""The arguments of a study out of a folder of CSV files.

``specimens.csv`` has one row per specimen: "specimen", its name, and covariates. ``measured.csv`` has "specimen" and a
column per quantity; a blank cell is a missing value, "> 20" one that was not reached. Columns such as "opened a|b" hold
1 (seen) or 0. ``quantities.csv`` has one row per quantity: "quantity", "scatter" (of what was seen or not the rate of
misreading), and where the name does not tell, "kind" and "link" (see ``Observation``). Its "cost" of a test is weighed
where tests are suggested; a column that is blank so far may be measured next. ``predicted.csv``, as ``measured.csv``,
holds predictions where no model is given.

``curves.csv`` holds "specimen", "displacement" and "load" of measured curves, row by row; their peak, stiffness, drift
at the peak and residual are rows of the study (:func:`limitmason.diagnosis.curves.features`), by the scatter of "load"
(relative) and "displacement" (in its unit) in ``quantities.csv``. ``sensors.csv`` holds "specimen", "x", "y", "z",
"direction" and a column per shape, "mode 1" and so on, of modes whose "frequency 1" stands in ``measured.csv``; the
scatter of "mode" is that of a component over the largest of its shape. The model then finds a ``ModalTest`` in the
specimen, under "modal test", as ``limitmason.diagnosis.simulate.several`` takes it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitmason import causes as catalogue
from limitmason.answers.curve import Curve
from limitmason.causes.cause import Cause
from limitmason.diagnosis.curves import features
from limitmason.diagnosis.inference.noise import Measured
from limitmason.diagnosis.observations import Observation
from limitmason.diagnosis.simulate import MODAL_TEST
from limitmason.diagnosis.study_from_table import BATCHES, LEVELS, About, version_of
from limitmason.errors import InputError
from limitmason.experiments.series import copy_template
from limitmason.storage.files import named_path
from limitmason.storage.measured_table import MeasuredTable, read_measured
from limitmason.vibration import ModalTest

SPECIMENS, MEASURED, QUANTITIES, PREDICTED = FILES = "specimens.csv", "measured.csv", "quantities.csv", "predicted.csv"
CURVES, SENSORS = "curves.csv", "sensors.csv"
LOAD, DISPLACEMENT, MODE = "load", "displacement", "mode"  # whose scatter is that of columns of these files


@dataclass(frozen=True)
class PredictedRows:
    """A simulator out of a table of predictions, by the name of the specimen."""

    values: Mapping[str, Mapping[str, float]]

    def __call__(self, specimen: Mapping[str, Any]) -> Mapping[str, float]:
        """Predictions of one specimen."""
        return self.values[specimen["specimen"]]


def folder_arguments(
    folder: str | Path, *, model: Callable[..., Any] | None = None, causes: Iterable[Cause] | None = None,
    inputs: Mapping[str, Measured] | None = None, shared: Sequence[str] | None = None,
    covariates: Sequence[str] | None = None, title: str | None = None, levels: int | None = None,
) -> dict[str, Any]:
    """Arguments of ``Study`` from the files of a folder.

    Parameters
    ----------
    folder : that holds the files
    model : simulator; None where the folder holds predictions
    causes : the list; None is a gain, and labels that another gain may have read
    inputs : measured inputs of the model, by name
    shared : columns whose labels may share noise
    covariates : columns that effects may go with; None is all that differ
    title : of the report; None is the name of the folder
    levels : most sizes at which a cause is simulated; None is the number of ``LEVELS``, more where predictions are read

    Raises
    ------
    InputError
        For files, rows, columns or units that are missing or do not go together.
    """
    folder = named_path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder")
    for name in (SPECIMENS, MEASURED, QUANTITIES, *(() if model is not None else (PREDICTED,))):
        if not (folder / name).exists():
            more = ", or a model that predicts" if name == PREDICTED else ""
            raise InputError(f"{folder} lacks {name}{more}; `limitmason diagnose --template DIR` writes an example")
    read = (*FILES, CURVES, SENSORS)
    if others := sorted(f.name for f in folder.glob("*.csv") if f.name not in read):
        warnings.warn(f"{folder}: not read: {', '.join(others)}; a folder holds {', '.join(read)}", stacklevel=3)
    specimens = read_measured(folder / SPECIMENS)
    names = _once(specimens, "specimen")
    rows = [{**row, "specimen": name} for row, name in zip(specimens.rows, names, strict=True)]
    measured = read_measured(folder / MEASURED, blanks=True)
    about = read_measured(folder / QUANTITIES)
    stated, costs = _quantities(about, measured), _costs(about)
    known = {q: said for q, said in stated.items() if q in measured.columns}
    observed = [*_of_curves(folder / CURVES, names, stated), *_of_sensors(folder / SENSORS, rows, measured, stated)]
    if observed and model is None:
        raise InputError(f"{folder}: {CURVES} and {SENSORS} need a model, which predicts curves and modes")
    for i, row in enumerate(measured.rows):
        for quantity, said in known.items():
            observed.append(Observation(
                str(row["specimen"]), quantity, float(row[quantity]), unit=measured.units[quantity],
                beyond=measured.beyond.get((i, quantity), ""), **said,
            ))
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
        "levels": LEVELS[isinstance(model, PredictedRows)] if levels is None else levels,
        "version": version_of(model),
        "causes": tuple(_readings(specimens) if causes is None else causes),
        "about": About(
            title or folder.name, specimens.units, ", ".join(f"{q} [{measured.units[q]}]" for q in known), costs=costs
        ),
    }


def _once(table: MeasuredTable, column: str) -> list[str]:
    """Names in a column, none of which may be there twice."""
    names = [str(v) for v in table.column(column)]
    if twice := next((n for i, n in enumerate(names) if n in names[:i]), None):
        raise InputError(f"{table.name}: {column} {twice!r} is there twice")
    return names


def _quantities(table: MeasuredTable, measured: MeasuredTable) -> dict[str, dict[str, Any]]:
    """Scatter, kind and link that a table states of every quantity, by its name.

    Parameters
    ----------
    table, measured : quantities.csv and measured.csv, whose quantities must each have a row in it
    """
    out: dict[str, dict[str, Any]] = {}
    table.column("scatter", "the error of each quantity")
    _once(table, "quantity")
    for line, row in zip(table.lines, table.rows, strict=True):
        quantity = str(row.get("quantity", ""))
        if quantity not in (*measured.columns, LOAD, DISPLACEMENT, MODE):
            raise InputError(f"{table.name}: row {line}: {measured.name} has no column {quantity!r}")
        out[quantity] = {k: row[k] if k == "scatter" else str(row[k]) for k in ("scatter", "kind", "link") if k in row}
    if bare := [q for q in measured.columns if q != "specimen" and q not in out]:
        raise InputError(f"{table.name}: there is no row for the quantity {bare[0]!r} of {measured.name}")
    return out


def _costs(table: MeasuredTable) -> dict[str, float]:
    """Cost of a test by quantity, where it is told."""
    out = {str(row["quantity"]): float(row["cost"]) for row in table.rows if "cost" in row}
    if bad := [q for q, cost in out.items() if not cost > 0.0]:
        raise InputError(f"{table.name}: the cost of {bad[0]!r} must be a positive number")
    return out


def _stated(file: Path, stated: Mapping[str, Mapping[str, Any]], quantity: str) -> float:
    """Scatter that is stated of a quantity, which ``file`` needs."""
    if quantity not in stated:
        raise InputError(f"{file}: {QUANTITIES} has no row for {quantity!r}, whose scatter is needed")
    return float(stated[quantity]["scatter"])


def _by_specimen(table: MeasuredTable, names: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
    """Rows of each specimen of a table, in their order."""
    out: dict[str, list[dict[str, Any]]] = {}
    for line, row, name in zip(table.lines, table.rows, table.column("specimen"), strict=True):
        if str(name) not in names:
            raise InputError(f"{table.name}: row {line}: {SPECIMENS} has no specimen {str(name)!r}")
        out.setdefault(str(name), []).append(row)
    return out


def _of_curves(file: Path, names: Sequence[str], stated: Mapping[str, Mapping[str, Any]]) -> list[Observation]:
    """Features of the curves in a file, none where there is no file.

    Parameters
    ----------
    names, stated : of the specimens, and what is said of every quantity, by name
    """
    if not file.exists():
        return []
    table = read_measured(file)
    for column in (LOAD, DISPLACEMENT):
        table.column(column, "the curves")
    errors = {
        "load_error": _stated(file, stated, LOAD), "displacement_error": _stated(file, stated, DISPLACEMENT),
    }
    out = []
    for name, rows in _by_specimen(table, names).items():
        u, f = (np.array([row[column] for row in rows], dtype=float) for column in (DISPLACEMENT, LOAD))
        curve = Curve(u, f, table.units[DISPLACEMENT], table.units[LOAD], name)
        out += features(name, curve, **errors)
    return out


def _of_sensors(
    file: Path, specimens: list[dict[str, Any]], measured: MeasuredTable, stated: Mapping[str, Mapping[str, Any]]
) -> list[Observation]:
    """Components of the shapes in a file, whose modal tests join the specimens.

    There are none where there is no file.

    Parameters
    ----------
    measured : table of measured values
    stated : what is said of every quantity, by name
    """
    if not file.exists():
        return []
    table, component = read_measured(file), _stated(file, stated, MODE)
    shapes = [c for c in table.columns if c.startswith("mode ")]
    for column in ("x", "y", "z", "direction", *(c.replace("mode", "frequency") for c in shapes)):
        (measured if column.startswith("frequency") else table).column(column, "the modes of " + file.name)
    out = []
    tested = {str(row["specimen"]): row for row in measured.rows}
    for name, rows in _by_specimen(table, [str(s["specimen"]) for s in specimens]).items():
        if name not in tested:
            raise InputError(f"{table.name}: {measured.name} has no row for specimen {name!r}, with its frequencies")
        sensors = [((float(r["x"]), float(r["y"]), float(r["z"])), str(r["direction"])) for r in rows]
        frequency = [tested[name][c.replace("mode", "frequency")] for c in shapes]
        test = ModalTest(sensors, np.array(frequency, dtype=float), np.array([[r[c] for r in rows] for c in shapes]))
        next(s for s in specimens if s["specimen"] == name)[MODAL_TEST] = test  # where a model looks for it
        out += [o for o in Observation.of_modes(name, test, component=component) if o.quantity.startswith(MODE)]
    return out


def _values(
    table: MeasuredTable, measured: MeasuredTable, names: Sequence[str], quantities: Collection[str]
) -> dict[str, dict[str, float]]:
    """Predictions by specimen and quantity; a unit other than that of the measured one is refused.

    Parameters
    ----------
    table, measured : predicted.csv and measured.csv
    names : of the specimens, each of which needs a row
    quantities : columns to take, which both tables must have
    """
    for quantity in quantities:
        table.column(quantity, "the predictions")
        if table.units[quantity] != measured.units[quantity]:
            given, wanted = table.units[quantity], measured.units[quantity]
            raise InputError(f"{table.name}: column {quantity!r} is in {given!r}, measured in {wanted!r}: use one unit")
    _once(table, "specimen")
    out = {str(row["specimen"]): {q: float(row[q]) for q in quantities} for row in table.rows}
    if missing := [n for n in names if n not in out]:
        raise InputError(f"{table.name} has no row for specimen {missing[0]!r}")
    return out


def _readings(specimens: MeasuredTable) -> list[Cause]:
    """Causes in the measurement, without a model: a gain, labels of another gain."""
    out = [catalogue.gain()]
    for column in (b for b in BATCHES if b in specimens.columns):
        values = list(specimens.columns[column])
        first = max(dict.fromkeys(values), key=values.count)
        out += [catalogue.batch_shift(covariate=column, label=v) for v in dict.fromkeys(values) if v != first]
    return out


def write_folder(folder: str | Path) -> Path:
    """Write an example of the four files: twelve stacks, one cell missing.

    Raises
    ------
    InputError
        Where a file stands in the way.
    """
    folder = named_path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name in (SPECIMENS, MEASURED, PREDICTED, QUANTITIES):
        copy_template(name, folder / name)
    return folder
