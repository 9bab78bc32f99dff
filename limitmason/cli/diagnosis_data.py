"""What ``limitmason diagnose`` works on: data from a file or a packaged series, simulator, noise, inputs and causes."""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from math import exp, log
from pathlib import Path
from typing import Any

import numpy as np

from limitmason import __version__, experiments
from limitmason import causes as catalogue
from limitmason.cli.series import (
    cases_of,
    check_names,
    check_specimens,
    overloaded,
    packaged_table,
    series_notes,
    series_of,
    tilted,
)  # fmt: skip
from limitmason.diagnosis import Cause, Measured, Noise
from limitmason.diagnosis.simulate import Collapse, packaged
from limitmason.formats.measured import MeasuredTable, read_measured

ROLES = ("specimen", "direction", "group", "noise", "predicted")
BATCHES = ("batch", "sensor", "operator", "laboratory")
OFF_RIG = 0.3  # largest friction of the rig, as a share of the median measured value


@dataclass
class Case:
    """Everything that a study takes, and what its reports need."""

    title: str
    specimens: list[dict[str, Any]]
    simulate: Callable[..., float]
    measured: list[float]
    noise: Noise
    nuisance: dict[str, Measured]
    covariates: list[str]
    groups: list | None
    causes: list[Cause]
    units: Mapping[str, str]
    quantity: str
    pool: list[dict[str, Any]] | None = None
    notes: list[str] = field(default_factory=list)
    levels: int = 9
    version: str = ""


@dataclass(frozen=True)
class Tabulated:
    """A simulator out of a table: the predicted column, on the way towards others by the size of each cause.

    log p = log p0 + sum over columns of size (log p_k - log p0)
    """

    column: str
    towards: Mapping[str, str]

    def __call__(self, specimen: Mapping[str, Any], **sizes: float) -> float:
        """Prediction of one specimen."""
        base = log(specimen[self.column])
        return exp(base + sum(v * (log(specimen[self.towards[k]]) - base) for k, v in sizes.items()))


def read_case(options: argparse.Namespace, settings: dict[str, Any]) -> Case:
    """Everything for a study out of the options of the command."""
    series = None
    if options.model and ":" not in options.model:
        series = series_of(options.model)
        if series is None:
            known = ", ".join(experiments.sources())
            raise ValueError(f"--model {options.model!r} is neither module:function nor a packaged series ({known})")
    if options.data is None and series is None:
        raise ValueError("name a data file, or a packaged series by --model; `limitmason diagnose --template FILE` "
                         "writes a file to start from")  # fmt: skip
    table = read_measured(options.data) if options.data is not None else packaged_table(series)
    model = series if series is not None and any(c.has_model for c in cases_of(series)) else None
    quantity_unit = table.units.get(options.measured, "-")
    factor, notes, rows = 1.0, [], table.rows
    predicted = options.predicted or ("predicted" if "predicted" in table.columns else None)
    if model is not None and options.predicted is None:
        factor, quantity_unit = check_specimens(table, model, options.measured)
        simulate: Any = packaged(model, options.method, **settings)
        notes = series_notes(model, table, options.input)
    elif options.model and series is None:
        simulate = load_object(options.model, "--model")
        if not callable(simulate):
            raise ValueError(f"--model {options.model}: it is no function")
    elif predicted is not None:
        table.positive(predicted, "the predictions")
        if table.units[predicted] != quantity_unit:
            raise ValueError(
                f"{table.name}: column {predicted!r} is in {table.units[predicted]!r}, {options.measured!r} in "
                f"{quantity_unit!r}; give both in one unit"
            )
        for column in options.towards:
            table.positive(column, "--towards")
        simulate = Tabulated(predicted, {_keyword(c): c for c in options.towards})
        notes.append(f"The predictions come from the column {predicted!r}: causes inside the model cannot be tried.")
    else:
        where = f"the series {series} has no model that could be built" if series else "no --model is given"
        raise ValueError(f"{table.name}: {where} and there is no column 'predicted'; name one by --predicted")
    tabulated = isinstance(simulate, Tabulated)
    inputs = dict(_input(text) for text in options.input)
    if inputs and tabulated:
        raise ValueError("--input needs a model that takes it (--model): predictions in a column are fixed")
    if options.towards and not tabulated:
        raise ValueError("--towards goes with --predicted: it leads from one column of predictions to another")
    measured = [factor * v for v in table.positive(options.measured, "the measured values")]
    covariates = _covariates(options, table, predicted if tabulated else None)
    groups = _groups(options, table)
    causes = _causes(options, table, rows, model, tabulated, settings, measured, quantity_unit, covariates)
    pool = read_measured(options.pool) if options.pool else None
    for name in (*covariates, *(("specimen",) if model else ())) if pool is not None else ():
        pool.column(name, "a covariate of the data")
    if pool is not None and isinstance(simulate, Collapse):
        check_names(pool, model)
    return Case(
        title=options.title or (Path(table.name).stem if options.data is not None else series),
        specimens=rows,
        simulate=simulate,
        measured=measured,
        noise=_noise(options, table, measured, groups),
        nuisance=inputs,
        covariates=covariates,
        groups=groups,
        causes=causes,
        units=table.units,
        quantity=f"{'value' if options.measured == 'measured' else options.measured} [{quantity_unit}]",
        pool=pool.rows if pool is not None else None,
        notes=notes,
        levels=17 if tabulated else 9,
        version=_version(simulate),
    )


def load_object(text: str, what: str) -> Any:
    """The object behind "module:name" or "file.py:name", looked up from the current folder too.

    Raises
    ------
    ValueError
        Naming what is not found.
    """
    module, _, name = text.rpartition(":")
    path = Path(module)
    place = str(path.resolve().parent if path.suffix == ".py" else Path.cwd())
    if path.suffix == ".py" and not path.exists():
        raise ValueError(f"{what} {text}: there is no file {module}")
    if place not in sys.path:
        sys.path.insert(0, place)  # stays: worker processes import the same module
    try:
        found = import_module(path.stem if path.suffix == ".py" else module)
    except ModuleNotFoundError as error:
        raise ValueError(f"{what} {text}: {error}; give module:name or file.py:name") from None
    if not hasattr(found, name):
        raise ValueError(f"{what} {text}: {module} has no {name!r}")
    return getattr(found, name)


def _version(simulate: Any) -> str:
    """What makes simulated values on disk obsolete: another version of this package, an edit of the user's module."""
    source = getattr(sys.modules.get(getattr(simulate, "__module__", "")), "__file__", None)
    own = isinstance(simulate, Collapse | Tabulated) or source is None
    return __version__ if own else hashlib.sha256(Path(source).read_bytes()).hexdigest()[:16]


def _covariates(options: argparse.Namespace, table: MeasuredTable, predicted: str | None) -> list[str]:
    if options.covariates:
        for name in options.covariates:
            table.column(name, "--covariates")
        return list(options.covariates)
    used = {options.measured, options.group, predicted, *options.towards, *(r for r in ROLES if r != "direction")}
    return [c for c, v in table.columns.items() if c not in used and len(set(v)) > 1]


def _groups(options: argparse.Namespace, table: MeasuredTable) -> list | None:
    name = options.group or ("group" if "group" in table.columns else None)
    return None if name is None else list(table.column(name, "--group"))


def _noise(options: argparse.Namespace, table: MeasuredTable, measured: Sequence[float], groups: list | None) -> Noise:
    text = options.noise
    if text is None and "noise" in table.columns:
        values, unit = np.array(table.positive("noise")), table.units["noise"]
        if unit not in ("-", "%", table.units[options.measured]):
            raise ValueError(
                f"{table.name}: column 'noise' is in {unit!r}; give it relative ('-' or '%') or in the unit of "
                f"{options.measured!r}, {table.units[options.measured]!r}"
            )
        if unit == "%":
            values = values / 100.0
        elif unit != "-":
            values = values / np.array(table.positive(options.measured))
        same = np.ptp(values) <= 1e-12 * values.max()
        return Noise(float(values[0]) if same else tuple(float(v) for v in values), options.dof, options.tails)
    if text in (None, "unknown"):
        if options.dof is not None or options.tails is not None:
            raise ValueError("--dof and --tails need a stated --noise")
        return Noise.unknown()
    if text == "replicates":
        if groups is None:
            raise ValueError("--noise replicates needs a column of configurations, see --group")
        return Noise.from_replicates(measured, groups)
    try:
        sd = float(text.rstrip("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        raise ValueError(
            f"--noise must be a number such as 0.04 or 4%, 'unknown' or 'replicates', got {text!r}"
        ) from None
    return Noise(sd, options.dof, options.tails)


def _input(text: str) -> tuple[str, Measured]:
    name, _, rest = text.partition("=")
    try:
        value, sd = (float(v) for v in rest.split(","))
    except ValueError:
        raise ValueError(f"--input must read NAME=VALUE,SD such as friction=0.65,0.03, got {text!r}") from None
    return name.strip(), Measured(value, sd)


def _causes(
    options, table, rows, model: str | None, tabulated: bool, settings, measured, unit: str, covariates: Iterable[str]
) -> list[Cause]:
    """The list: the user's, or the catalogue's for the model; with a table only what acts on the predicted value."""
    if options.causes and ":" in options.causes:
        chosen = load_object(options.causes, "--causes")
        chosen = list(chosen() if callable(chosen) else chosen)
        if bad := next((c for c in chosen if not isinstance(c, Cause)), None):
            raise ValueError(f"--causes {options.causes}: a list of Cause is needed, it holds {bad!r}")
        if tabulated and (inside := [c.name for c in chosen if not c.transforms]):
            raise ValueError(f"--causes: {inside[0]!r} acts inside the model, a column of predictions cannot show it")
        return chosen + _towards(options)
    batches = [(c, v) for c in options.batches or [b for b in BATCHES if b in table.columns] for v in _labels(table, c)]
    shifts = [catalogue.batch_shift(covariate=c, label=v) for c, v in batches]
    tilting = options.tilting or (model is None and options.model and tilted(options.model))
    rig = catalogue.rig_friction((0.0, OFF_RIG * float(np.median(measured))), unit=unit)
    outside = [catalogue.gain(), rig] + ([catalogue.angle_offset()] if tilting else []) + shifts
    if tabulated:
        known = outside
    elif model is not None:
        method = "limit, non-associative" if settings.get("flow_rule") == "non-associative" else options.method
        known = catalogue.standard(
            plane=not options.spatial, method=method, tilting=bool(tilting), covariates=covariates,
            overload=overloaded(model, rows), without=["friction of the rig"] * (not tilting),
        )  # fmt: skip
        known = [c for c in known if c.name not in {o.name for o in outside}] + outside
    else:
        known = outside
        if not options.causes:
            raise ValueError("a model of your own needs its list of causes: --causes module:LIST")
    if options.causes:
        names = [n.strip() for n in options.causes.split(",")]
        by_name = {c.name: c for c in known} | (
            {} if tabulated else {n: f() for n, f in catalogue.ALL.items() if n not in {c.name for c in known}}
        )
        for name in names:
            if name not in by_name:
                raise ValueError(f"--causes: there is no cause {name!r}; known here: {', '.join(by_name)}")
        known = [by_name[n] for n in names]
    return known + _towards(options)


def _labels(table: MeasuredTable, column: str) -> list:
    """Labels that may differ from the most frequent one."""
    values = list(table.column(column, "--batches"))
    ranked = sorted(set(values), key=lambda v: (-values.count(v), str(v)))
    return ranked[1:]


def _towards(options: argparse.Namespace) -> list[Cause]:
    return [
        Cause(f"towards {c}", _keyword(c), 0.0, (0.0, 1.0), f"share of the way from the predictions to {c}",
              source="predictions of the two models in the data")
        for c in options.towards
    ]  # fmt: skip


def _keyword(column: str) -> str:
    text = "".join(ch if ch.isalnum() else "_" for ch in column)
    return text if text.isidentifier() else f"to_{text}"
