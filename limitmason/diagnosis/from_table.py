"""The arguments of a study out of a table of measured values: simulator, noise, covariates, units, default causes."""

import hashlib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import exp, log
from pathlib import Path
from typing import Any

import numpy as np

from limitmason import causes, experiments
from limitmason.answers.references import Cited, data_behind
from limitmason.causes.cause import Cause
from limitmason.causes.lists import DELIVERED
from limitmason.constants import VERSION
from limitmason.diagnosis.inference.noise import Measured, Noise
from limitmason.diagnosis.simulate import Collapse, packaged
from limitmason.errors import InputError
from limitmason.experiments.measured_table import MeasuredTable, read_measured
from limitmason.experiments.series import (
    cases_of,
    check_names,
    check_specimens,
    overloaded,
    packaged_table,
    series_notes,
    series_of,
    tilted,
)
from limitmason.methods import get_method

ROLES = ("specimen", "direction", "group", "noise", "predicted")
BATCHES = ("batch", "sensor", "operator", "laboratory")
OFF_RIG = 0.3  # largest friction of the rig, as a share of the median measured value
LEVELS = {True: 17, False: 9}  # of sizes, by whether the predictions stand in the table


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


@dataclass(frozen=True)
class About:
    """What the reports of a study say beside its numbers.

    Parameters
    ----------
    title : heading
    units : unit of every column
    quantity : what was measured, with its unit
    notes : what is assumed of the data and the simulator
    references : papers of packaged data and of the method that predicts, for ``cite()``
    """

    title: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    quantity: str = ""
    notes: tuple[str, ...] = ()
    references: tuple[Cited, ...] = ()


def study_arguments(
    table: str | Path | MeasuredTable | None = None,
    *,
    model: str | Callable[..., float] | None = None,
    method: str = "limit",
    settings: Mapping[str, Any] | None = None,
    measured: str = "measured",
    predicted: str | None = None,
    towards: Sequence[str] = (),
    group: str | None = None,
    covariates: Sequence[str] | None = None,
    batches: Sequence[str] | None = None,
    noise: Noise | float | str | None = None,
    dof: float | None = None,
    tails: float | None = None,
    inputs: Mapping[str, Measured] | None = None,
    causes: Iterable[Cause] | Iterable[str] | None = None,
    tilting: bool = False,
    spatial: bool = False,
    title: str | None = None,
    levels: int | None = None,
    shared: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Arguments of ``Study``; see :meth:`limitmason.diagnosis.Study.from_table`."""
    series = _series(model)
    if table is None and series is None:
        raise InputError("name a data file, or a packaged series as the model; `limitmason diagnose --template FILE` "
                         "writes a file to start from")  # fmt: skip
    data = _read(table) if table is not None else packaged_table(str(series))
    inside = series if series is not None and any(c.has_model for c in cases_of(series)) else None
    inputs = dict(inputs or {})
    unit = data.units.get(measured, "-")
    factor, notes = 1.0, []
    column = predicted or ("predicted" if "predicted" in data.columns else None)
    if inside is not None and predicted is None:
        factor, unit = check_specimens(data, inside, measured)
        simulate: Any = packaged(inside, method, **(settings or {}))
        notes = series_notes(inside, data, inputs)
    elif model is not None and series is None:
        simulate = model
    elif column is not None:
        simulate = _tabulated(data, column, towards, measured, unit)
        notes.append(f"The predictions come from the column {column!r}: causes inside the model cannot be tried.")
    else:
        where = f"the series {series} has no model that could be built" if series else "no model is given"
        raise InputError(f"{data.name}: {where} and there is no column 'predicted'; name one by predicted")
    tabulated = isinstance(simulate, Tabulated)
    if inputs and tabulated:
        raise InputError("a measured input needs a model that takes it: predictions in a column are fixed")
    if towards and not tabulated:
        raise InputError("towards goes with predicted: it leads from one column of predictions to another")
    values = [factor * v for v in data.positive(measured, "the measured values")]
    papers = () if inside is None or tabulated else get_method(method, (settings or {}).get("flow_rule")).references
    used = {measured, group, column if tabulated else None, *towards, *(r for r in ROLES if r != "direction")}
    for name in covariates or ():
        data.column(name, "the covariates")
    kept = list(covariates or (c for c, v in data.columns.items() if c not in used and len(set(v)) > 1))
    group = group or ("group" if "group" in data.columns else None)
    groups = None if group is None else list(data.column(group, "the groups"))
    tilting = tilting or (series is not None and inside is None and tilted(series))
    offered = _Offered(data, values, unit, tilting, batches)
    known = offered.outside()
    if not tabulated and inside is not None:
        felt_by = get_method(method, (settings or {}).get("flow_rule")).name
        known = offered.inside(inside, plane=not spatial, method=felt_by, covariates=kept)
        if spatial and known == offered.inside(inside, plane=True, method=felt_by, covariates=kept):
            raise InputError(f"spatial changes no cause that method {felt_by!r} feels: leave it out")
    elif not tabulated and causes is None:
        raise InputError("a model of your own needs its list of causes")
    return {
        "specimens": data.rows,
        "simulate": simulate,
        "measured": values,
        "noise": _noise(noise, dof, tails, data, measured, values, groups),
        "nuisance": inputs,
        "covariates": kept,
        "groups": groups,
        "shared": shared,
        "levels": levels or LEVELS[tabulated],
        "version": version_of(simulate),
        "causes": (*_chosen(causes, known, tabulated), *(_towards(c) for c in towards)),
        "about": About(
            title or (Path(data.name).stem if table is not None else str(series)),
            data.units,
            f"{'value' if measured == 'measured' else measured} [{unit}]",
            tuple(notes),
            (*data_behind({"source": series}), *papers),
        ),
    }


def _series(model: str | Callable[..., float] | None) -> str | None:
    """The packaged series that a model names; None for a function and for no model."""
    if isinstance(model, str):
        series = series_of(model)
        if series is None:
            packed = ", ".join(experiments.sources())
            raise InputError(f"the model {model!r} is neither module:function nor a packaged series ({packed})")
        return series
    if model is not None and not callable(model):
        raise InputError(f"model must be a function or the name of a packaged series, got {model!r}")
    return None


def pool_rows(pool: str | Path | MeasuredTable, covariates: Iterable[str], simulate: Any) -> list[dict[str, Any]]:
    """Specimens of a table that could be tested next, checked for what the study needs of them.

    Parameters
    ----------
    covariates : names that every specimen must have
    simulate : of the study; that of a packaged series knows its specimens
    """
    table = _read(pool)
    series = getattr(getattr(simulate, "build", None), "source", None)
    for name in (*covariates, *(("specimen",) if series is not None else ())):
        table.column(name, "a covariate of the data")
    if series is not None:
        check_names(table, series)
    return table.rows


def _read(table: str | Path | MeasuredTable) -> MeasuredTable:
    return table if isinstance(table, MeasuredTable) else read_measured(table)


def _tabulated(data: MeasuredTable, column: str, towards: Sequence[str], measured: str, unit: str) -> Tabulated:
    data.positive(column, "the predictions")
    if data.units[column] != unit:
        raise InputError(
            f"{data.name}: column {column!r} is in {data.units[column]!r}, {measured!r} in {unit!r}; give both in one "
            "unit"
        )
    for other in towards:
        data.positive(other, "towards")
    return Tabulated(column, {_keyword(c): c for c in towards})


def version_of(simulate: Any) -> str:
    """What makes simulated values on disk obsolete: another version of this package, an edit of the user's module."""
    source = getattr(sys.modules.get(getattr(simulate, "__module__", "")), "__file__", None)
    own = isinstance(simulate, Collapse | Tabulated)
    return VERSION if own or source is None else hashlib.sha256(Path(source).read_bytes()).hexdigest()[:16]


def _noise(
    stated: Noise | float | str | None, dof: float | None, tails: float | None, table: MeasuredTable, column: str,
    measured: Sequence[float], groups: list | None,
) -> Noise:  # fmt: skip
    """What is stated; else the column "noise" in its own unit; else unknown."""
    if isinstance(stated, Noise):
        return stated
    if stated is None and "noise" in table.columns:
        values, unit = np.array(table.positive("noise")), table.units["noise"]
        if unit not in ("-", "%", table.units[column]):
            raise InputError(
                f"{table.name}: column 'noise' is in {unit!r}; give it relative ('-' or '%') or in the unit of "
                f"{column!r}, {table.units[column]!r}"
            )
        if unit == "%":
            values = values / 100.0
        elif unit != "-":
            values = values / np.array(table.positive(column))
        same = np.ptp(values) <= 1e-12 * values.max()
        return Noise(float(values[0]) if same else tuple(float(v) for v in values), dof, tails)
    if stated in (None, "unknown"):
        if dof is not None or tails is not None:
            raise InputError("dof and tails need a stated noise")
        return Noise.unknown()
    if stated == "replicates":
        if groups is None:
            raise InputError("noise from replicates needs a column of configurations, see group")
        return Noise.from_replicates(measured, groups)
    if isinstance(stated, str):
        raise InputError(f"noise must be a number such as 0.04, 'unknown' or 'replicates', got {stated!r}")
    return Noise(float(stated), dof, tails)


@dataclass(frozen=True)
class _Offered:
    """Causes that are tried where no list is given, from what the table holds."""

    table: MeasuredTable
    measured: Sequence[float]
    unit: str
    tilting: bool
    batches: Sequence[str] | None

    def outside(self) -> list[Cause]:
        """Causes in the measurement, which act on the predicted value."""
        rig = causes.rig_friction((0.0, OFF_RIG * float(np.median(self.measured))), unit=self.unit)
        columns = self.batches or [b for b in BATCHES if b in self.table.columns]
        shifts = [causes.batch_shift(covariate=c, label=v) for c in columns for v in self._labels(c)]
        return [causes.gain(), rig] + ([causes.angle_offset()] if self.tilting else []) + shifts

    def inside(self, series: str, *, plane: bool, method: str, covariates: Iterable[str]) -> list[Cause]:
        """The standard list for a packaged series, with the causes in the measurement of this table."""
        outside = self.outside()
        columns = [c for c in self.batches or self.table.columns if c in DELIVERED]
        outside += [causes.batch_friction(covariate=c, label=v) for c in columns for v in self._labels(c)]
        known = causes.standard(
            plane=plane, method=method, tilting=self.tilting, covariates=covariates,
            overload=overloaded(series, self.table.rows), without=["friction of the rig"] * (not self.tilting),
        )  # fmt: skip
        return [c for c in known if c.name not in {o.name for o in outside}] + outside

    def _labels(self, column: str) -> list:
        """Labels that may differ from the most frequent one."""
        values = list(self.table.column(column, "the batches"))
        ranked = sorted(set(values), key=lambda v: (-values.count(v), str(v)))
        return ranked[1:]


def _chosen(wanted: Iterable[Cause] | Iterable[str] | None, known: list[Cause], tabulated: bool) -> list[Cause]:
    """The list: the user's causes, those named out of what is known here, or all of that."""
    if wanted is None:
        return known
    chosen: list[Any] = list(wanted)
    if not all(isinstance(c, str) for c in chosen):
        if bad := next((c for c in chosen if not isinstance(c, Cause)), None):
            raise InputError(f"a list of Cause is needed, it holds {bad!r}")
        if tabulated and (inside := [c.name for c in chosen if not c.transforms]):
            raise InputError(f"{inside[0]!r} acts inside the model, a column of predictions cannot show it")
        return chosen
    by_name = {c.name: c for c in known}
    if not tabulated:
        by_name |= {n: declared() for n, declared in causes.ALL.items() if n not in by_name}
    for name in chosen:
        if name not in by_name:
            raise InputError(f"there is no cause {name!r}; known here: {', '.join(by_name)}")
    return [by_name[n] for n in chosen]


def _towards(column: str) -> Cause:
    return Cause(
        f"towards {column}", _keyword(column), 0.0, (0.0, 1.0), f"share of the way from the predictions to {column}",
        source="predictions of the two models in the data",
    )  # fmt: skip


def _keyword(column: str) -> str:
    text = "".join(ch if ch.isalnum() else "_" for ch in column)
    return text if text.isidentifier() else f"to_{text}"
