"""The arguments of a study out of a table of measured values."""

import hashlib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from math import exp, log
from pathlib import Path
from typing import Any

import numpy as np

from limitmason import causes, experiments
from limitmason.answers.method import Method
from limitmason.answers.references import Cited, data_behind
from limitmason.causes.catalogue import DELIVERED
from limitmason.causes.cause import Cause
from limitmason.constants import VERSION
from limitmason.diagnosis.inference.noise import Measured, Noise
from limitmason.diagnosis.simulate import Collapse, packaged
from limitmason.errors import InputError
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
from limitmason.storage.measured_table import MeasuredTable, read_measured

ROLES = ("specimen", "group", "noise", "predicted")  # columns that are no covariates
BATCHES = ("batch", "sensor", "operator", "laboratory")
OFF_RIG = 0.3  # largest friction of the rig, as a share of the median measured value
LEVELS = {True: 17, False: 9}  # of sizes, by whether the predictions stand in the table


@dataclass(frozen=True)
class PredictedColumn:
    """A simulator out of a table: the predicted column, moved towards other columns.

    The size of a cause is the share of the way. ``towards`` holds the column of each cause, by its keyword::

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
    costs : of a test, by what is measured in it; 1 where it is not told
    """

    title: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    quantity: str = ""
    notes: tuple[str, ...] = ()
    references: tuple[Cited, ...] = ()
    costs: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class TableStudy:
    """What is stated of a table of measured values.

    See :meth:`limitmason.diagnosis.Study.from_table`.
    """

    table: str | Path | MeasuredTable | None = None
    _: KW_ONLY
    model: str | Callable[..., float] | None = None
    method: str = "limit"
    settings: Mapping[str, Any] = field(default_factory=dict)
    measured: str = "measured"
    predicted: str | None = None
    towards: Sequence[str] = ()
    group: str | None = None
    covariates: Sequence[str] | None = None
    batches: Sequence[str] | None = None
    noise: Noise | float | str | None = None
    dof: float | None = None
    inputs: Mapping[str, Measured] = field(default_factory=dict)
    causes: Cause | Iterable[Cause] | Iterable[str] | None = None
    tilting: bool = False
    spatial: bool = False
    title: str | None = None
    levels: int | None = None
    shared: Sequence[str] | None = None

    def arguments(self) -> dict[str, Any]:
        """Arguments of ``Study`` that the table and the keywords state."""
        simulate, tabulated = self.simulate, self.tabulated
        self._refuse_unused()
        if self.inputs and tabulated:
            raise InputError("a measured input needs a model that takes it: predictions in a column are fixed")
        if self.towards and not tabulated:
            raise InputError("towards goes with predicted: it leads from one column of predictions to another")
        title = Path(self.data.name).stem if self.table is not None else str(self.series)
        quantity = "value" if self.measured == "measured" else self.measured
        wanted = self.group is not None and self.noise != "replicates"  # groups to be left out, even a single one
        papers = () if self.inside is None or tabulated else self._felt_by.references
        return {
            "specimens": self.data.rows,
            "simulate": simulate,
            "measured": self.values,
            "noise": self._noise(),
            "nuisance": dict(self.inputs),
            "covariates": self.kept,
            "groups": None if len(set(self.groups or ())) == 1 and not wanted else self.groups,
            "shared": self.shared,
            "levels": LEVELS[tabulated] if self.levels is None else self.levels,
            "version": version_of(simulate),
            "causes": (*self._chosen(), *(_towards(c) for c in self.towards)),
            "about": About(
                title=self.title or title, units=self.data.units, quantity=f"{quantity} [{self._scaled[1]}]",
                notes=self._notes(), references=(*data_behind({"source": self.series}), *papers),
            ),
        }

    def _refuse_unused(self) -> None:
        """Refuse what this kind of model does not use."""
        own = self.model is not None and self.series is None
        if own and self.predicted is not None:
            raise InputError("predicted names a column of predictions, and the model is a function, which predicts "
                             "itself: leave one of them out")
        unused = {"method": self.method != "limit", "settings": bool(self.settings), "spatial": self.spatial}
        if (own or self.tabulated) and (idle := [name for name, given in unused.items() if given]):
            what = "a function as the model" if own else "predictions in a column"
            raise InputError(f"{idle[0]} is of a packaged series whose walls are computed, not of {what}: leave it out")

    # ---- what the table holds ------------------------------------------------------------------------------------

    @cached_property
    def series(self) -> str | None:
        """The packaged series that the model names, or None for a function or no model."""
        model = self.model
        if isinstance(model, str):
            if (series := series_of(model)) is None:
                packed = ", ".join(experiments.sources())
                raise InputError(f"the model {model!r} is neither module:function nor a packaged series ({packed})")
            return series
        if model is not None and not callable(model):
            raise InputError(f"model must be a function or the name of a packaged series, got {model!r}")
        return None

    @cached_property
    def inside(self) -> str | None:
        """The series, where its walls can be built."""
        return self.series if self.series is not None and any(c.buildable for c in cases_of(self.series)) else None

    @cached_property
    def data(self) -> MeasuredTable:
        """The table, or that of the series."""
        if self.table is None and self.series is None:
            raise InputError("name a data file, or a packaged series as the model; `limitmason diagnose --template "
                             "FILE` writes a file to start from")
        return _read(self.table) if self.table is not None else packaged_table(str(self.series))

    @cached_property
    def simulate(self) -> Any:
        """The packaged series, the user's model, or the column of predictions."""
        if self.inside is not None and self.predicted is None:
            return packaged(self.inside, self.method, **(self.settings or {}))
        if self.model is not None and self.series is None:
            return self.model
        column = self.predicted or ("predicted" if "predicted" in self.data.columns else None)
        if column is None:
            where = f"the series {self.series} has no model that could be built" if self.series else "no model is given"
            raise InputError(f"{self.data.name}: {where} and there is no column 'predicted'; name one by predicted")
        self.data.positive(column, "the predictions")
        unit, own = self.data.units[column], self.data.units.get(self.measured, "-")
        if unit != own:
            raise InputError(f"{self.data.name}: column {column!r} is in {unit!r}, {self.measured!r} in {own!r}; give "
                             "both in one unit")
        towards: dict[str, str] = {}
        for other in self.towards:
            self.data.positive(other, "towards")
            if (first := towards.setdefault(_keyword(other), other)) != other:
                raise InputError(f"{self.data.name}: columns {first!r} and {other!r} differ by signs alone: rename one")
        return PredictedColumn(column, towards)

    @property
    def tabulated(self) -> bool:
        """Whether the predictions stand in a column: no model then computes them, with a cause or without."""
        return isinstance(self.simulate, PredictedColumn)

    @cached_property
    def _scaled(self) -> tuple[float, str]:
        """Factor and unit of the measured values."""
        if self.inside is not None and self.predicted is None:
            return check_specimens(self.data, self.inside, self.measured)
        return 1.0, self.data.units.get(self.measured, "-")

    @cached_property
    def values(self) -> list[float]:
        """Measured values."""
        return [self._scaled[0] * v for v in self.data.positive(self.measured, "the measured values")]

    @cached_property
    def kept(self) -> list[str]:
        """Names of the covariates: those stated, or all columns that are left."""
        for name in self.covariates or ():
            self.data.column(name, "the covariates")
        if self.covariates is not None:
            return list(self.covariates)
        used = {self.measured, self.group, self.simulate.column if self.tabulated else None, *self.towards, *ROLES}
        return [c for c, v in self.data.columns.items() if c not in used and len(set(v)) > 1]

    @cached_property
    def groups(self) -> list[Any] | None:
        """Label of the configuration of each row."""
        group = self.group or ("group" if "group" in self.data.columns else None)
        return None if group is None else list(self.data.column(group, "the groups"))

    def _notes(self) -> tuple[str, ...]:
        """What a reader must be told of where the predictions come from."""
        if self.tabulated:
            column = self.simulate.column
            return (f"The predictions come from the column {column!r}: causes inside the model cannot be tried.",)
        return tuple(series_notes(self.inside, self.data, self.inputs)) if self.inside is not None else ()

    def _noise(self) -> Noise:
        """Noise as it is stated, else the column "noise" in its own unit, else unknown.

        A column in "-" or "%" is relative. Any other must be in the unit of the measured values, and is divided by
        them. Degrees of freedom go with a number or such a column; beside a statement that has its own they are
        refused.
        """
        stated, table, dof = self.noise, self.data, self.dof
        if dof is not None and (isinstance(stated, Noise) or stated == "replicates"):
            raise InputError("dof goes with a noise that is a number or a column; this one has its own: leave dof out")
        if isinstance(stated, Noise):
            return stated
        if stated is None and "noise" in table.columns:
            values, unit, own = np.array(table.positive("noise")), table.units["noise"], table.units[self.measured]
            if unit not in ("-", "%", own):
                raise InputError(f"{table.name}: column 'noise' is in {unit!r}; give it relative ('-' or '%') or in "
                                 f"the unit of {self.measured!r}, {own!r}")
            if unit != "-":
                values = values / (100.0 if unit == "%" else np.array(table.positive(self.measured)))
            same = np.ptp(values) <= 1e-12 * values.max()
            return Noise(float(values[0]) if same else tuple(float(v) for v in values), dof)
        if stated in (None, "unknown"):
            if dof is not None:
                raise InputError("dof needs a stated noise")
            return Noise.unknown()
        if stated == "replicates":
            if self.groups is None:
                raise InputError("noise from replicates needs a column of configurations, see group")
            return Noise.from_replicates(self.values, self.groups)
        if isinstance(stated, str):
            raise InputError(f"noise must be a number such as 0.04, 'unknown' or 'replicates', got {stated!r}")
        return Noise(stated, dof)

    # ---- causes --------------------------------------------------------------------------------------------------

    @property
    def _felt_by(self) -> Method:
        """The method of a packaged series."""
        return get_method(self.method, (self.settings or {}).get("flow_rule"))

    def _offered(self) -> list[Cause]:
        """Causes that are tried where no list is given.

        For a column of predictions, or a series without a model, those are causes in the measurement alone.
        """
        if self.tabulated or self.inside is None:
            if not self.tabulated and self.causes is None:
                raise InputError("a model of your own needs its list of causes")
            tilting = self.tilting or (self.series is not None and self.inside is None and tilted(self.series))
            return self._outside(tilting)
        known = self._standard(plane=not self.spatial)
        if self.spatial and known == self._standard(plane=True):
            raise InputError(f"spatial changes no cause that method {self._felt_by.name!r} feels: leave it out")
        return known

    def _outside(self, tilting: bool) -> list[Cause]:
        """Causes in the measurement, which act on the predicted value."""
        unit = self._scaled[1]
        if self.tilting and unit != "-":
            raise InputError(f"{self.data.name}: tilting is for tangents of a tilt angle, and {self.measured!r} is in "
                             f"{unit!r}: give tan(angle), measured and predicted, in the unit '-'")
        rig = causes.rig_friction((0.0, OFF_RIG * float(np.median(self.values))), unit=unit)
        columns = [b for b in BATCHES if b in self.data.columns] if self.batches is None else self.batches
        shifts = [causes.batch_shift(covariate=c, label=v) for c in columns for v in self._labels(c)]
        return [causes.gain(), rig] + ([causes.angle_offset()] if tilting else []) + shifts

    def _standard(self, *, plane: bool) -> list[Cause]:
        """The standard list for a packaged series, with causes in the measurement.

        ``plane`` is whether its walls work in one plane, so that causes out of it are left out.
        """
        outside = self._outside(self.tilting)
        columns = [c for c in (self.data.columns if self.batches is None else self.batches) if c in DELIVERED]
        overload = overloaded(str(self.inside), self.data.rows)
        for column, label in ((c, v) for c in columns for v in self._labels(c)):
            outside += causes.delivered(label, column, plane=plane, overload=overload)
        known = causes.standard(
            plane=plane, method=self._felt_by.name, tilting=self.tilting, covariates=self.kept, overload=overload,
            without=["friction of the rig"] * (not self.tilting),
        )
        return [c for c in known if c.name not in {o.name for o in outside}] + outside

    def _labels(self, column: str) -> list[Any]:
        """Labels that may differ from the most frequent one."""
        values = list(self.data.column(column, "the batches"))
        return sorted(set(values), key=lambda v: (-values.count(v), str(v)))[1:]

    def _chosen(self) -> list[Cause]:
        """The list: the user's causes, those named of what is offered, or all of that.

        Where a model computes the predictions, any cause of ``causes.ALL`` may be named: what is offered is a usual
        choice, and a cause that the model refuses is set aside later. A column of predictions takes no other than what
        acts on the predicted value.
        """
        known = self._offered()
        if self.causes is None:
            return known
        chosen: list[Any] = [self.causes] if isinstance(self.causes, str | Cause) else list(self.causes)
        if not all(isinstance(c, str) for c in chosen):
            if bad := next((c for c in chosen if not isinstance(c, Cause)), None):
                raise InputError(f"a list of Cause is needed, it holds {bad!r}")
            if self.tabulated and (inside := [c.name for c in chosen if not c.transforms]):
                raise InputError(f"{inside[0]!r} acts inside the model, a column of predictions cannot show it")
            return chosen
        by_name = {c.name: c for c in known}
        if not self.tabulated:
            by_name |= {n: declared() for n, declared in causes.ALL.items() if n not in by_name}
        for name in chosen:
            if name not in by_name:
                raise InputError(f"there is no cause {name!r}; known here: {', '.join(by_name)}")
        return [by_name[n] for n in chosen]


def pool_rows(pool: str | Path | MeasuredTable, covariates: Iterable[str], simulate: Any) -> list[dict[str, Any]]:
    """Specimens of a table that could be tested next, checked for what is needed.

    Parameters
    ----------
    covariates : names that every specimen must have
    simulate : of the study; that of a packaged series knows its specimens
    """
    table = _read(pool)
    series = getattr(getattr(simulate, "build", None), "source", None)  # of what ``simulate.packaged`` returns
    for name in (*covariates, *(("specimen",) if series is not None else ())):
        table.column(name, "a covariate of the data")
    if series is not None:
        check_names(table, series)
    return table.rows


def _read(table: str | Path | MeasuredTable) -> MeasuredTable:
    """A table, read from its file where a path is given."""
    return table if isinstance(table, MeasuredTable) else read_measured(table)


def version_of(simulate: Any) -> str:
    """What makes stored values obsolete: another version, an edit of the module.

    The version is that of this package, the module the user's.
    """
    source = getattr(sys.modules.get(getattr(simulate, "__module__", "")), "__file__", None)
    own = isinstance(simulate, Collapse | PredictedColumn)
    return VERSION if own or source is None else hashlib.sha256(Path(source).read_bytes()).hexdigest()[:16]


def _towards(column: str) -> Cause:
    """Cause that moves predictions towards those of another model, a column."""
    return Cause(
        name=f"towards {column}", parameter=_keyword(column), baseline=0.0, bounds=(0.0, 1.0),
        physics=f"share of the way from the predictions to {column}",
        source="predictions of the two models in the data",
    )


def _keyword(column: str) -> str:
    """Name of a column as a keyword of Python: "_" for what is no letter or digit."""
    text = "".join(ch if ch.isalnum() else "_" for ch in column)
    return text if text.isidentifier() else f"to_{text}"
