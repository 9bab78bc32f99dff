"""What a study states: specimens, values, errors, and the simulator with tables."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from limitmason.causes.cause import Cause, check_causes
from limitmason.checks import instance
from limitmason.diagnosis.cause_tables import CauseTables, StudyCache, placing_noise
from limitmason.diagnosis.inference.grid import at_measured
from limitmason.diagnosis.inference.noise import Measured, Noise
from limitmason.diagnosis.inference.shared_noise import unstated
from limitmason.diagnosis.observations import Observation, Rows, unlinked
from limitmason.diagnosis.simulator_calls import Simulator
from limitmason.diagnosis.specimens import called, circumstances_of, covariates_of, recorded
from limitmason.diagnosis.study_from_folder import folder_arguments
from limitmason.diagnosis.study_from_table import About, TableStudy
from limitmason.diagnosis.tabulate import Tabulator
from limitmason.errors import InputError
from limitmason.storage.frozen import ReadOnly
from limitmason.storage.measured_table import MeasuredTable

FEWEST = 4  # numbers, where their noise is not stated; two where it is
STATEMENTS = ("measured", "noise", "groups", "covariates", "causes", "about", "shared")  # no table depends on them


@dataclass(frozen=True, eq=False, repr=False)
class Statement(ReadOnly):
    """What a :class:`~limitmason.diagnosis.Study` is made of.

    Parameters, units and errors are told there.
    """

    specimens: Sequence[Any]
    simulate: Callable[..., float]
    measured: Any = None
    noise: Noise = field(default_factory=Noise.unknown)
    nuisance: Mapping[str, Measured] = field(default_factory=dict)
    covariates: Any = None
    groups: Sequence | None = None
    shared: Sequence[str] | None = None
    _: KW_ONLY
    levels: int = 17
    nuisance_levels: int | None = None
    cache: str | Path | None = None
    n_jobs: int = 1
    version: str = ""
    pair_tables: str = "verified"
    crossed: str = "full"
    causes: tuple[Cause, ...] = ()
    about: About = field(default_factory=About)
    rows: Any = None
    made: InitVar[StudyCache | None] = None
    columns: Mapping[str, Sequence[Any]] = field(init=False)
    scale: np.ndarray = field(init=False)
    tables: CauseTables = field(init=False)
    _made: StudyCache = field(init=False)

    def __post_init__(self, made: StudyCache | None) -> None:
        """Check the statement and derive its rows, noise scale, columns and tables.

        ``made`` holds the tables of a variant to share; new ones are made where it is None.
        """
        specimens = tuple(self.specimens)
        instance("noise", self.noise, Noise, "Noise(0.05) for 5 %")
        rows = rows_of(self.measured, self.rows, specimens)
        noise, n = self.noise, len(rows)
        if rows.scatter is not None:  # errors that observations state stand in for that of the study
            noise = Noise(tuple(rows.scatter), noise.dof, by_row=True, misread=rows.misread)
        if n < (least := FEWEST if noise.kind == "unknown" else 2):
            what = "numbers, of one specimen or several," if rows.several or n < 2 else "specimens"
            raise InputError(f"at least {least} {what} are needed, got {n}")
        if not isinstance(self.nuisance, Mapping):
            raise InputError(f"nuisance must be Measured(value, sd) by name, got {self.nuisance!r}")
        nuisance = dict(self.nuisance)
        told = circumstances_of(specimens) if self.covariates is None else self.covariates
        covariates = covariates_of(told, specimens, rows.spread_out)
        if unknown := [name for name in self.shared or () if name not in covariates]:
            raise InputError(f"shared names {unknown[0]!r}, which is no covariate; known: {', '.join(covariates)}")
        for name, given in nuisance.items():
            if not isinstance(given, Measured):
                raise InputError(f"nuisance {name!r} must be Measured(value, sd), got {given!r}")
        # several values of one specimen are left out together, unless groups say otherwise
        several = rows.several and len(set(rows.of)) > 1  # specimens of which nothing was measured yet do not count
        groups = self.groups if self.groups is not None or not several else list(range(len(specimens)))
        spread = None if groups is None else rows.spread_out("groups", groups, len(specimens))
        if spread is not None and len(set(spread)) == 1:
            raise InputError(
                f"groups has the one label {spread[0]!r}, without which nothing is left to predict from: give labels "
                "that differ, one for each configuration, or leave groups out"
            )
        fixed: dict[str, Any] = {
            "specimens": specimens,
            "rows": rows,
            "noise": noise,
            "scale": noise.scale(n),
            "measured": rows.values,
            "covariates": covariates,
            "columns": rows.columns(covariates, [called(specimens[i], i) for i in rows.of]),
            "shared": None if self.shared is None else tuple(self.shared),
            "groups": spread,
            "nuisance": nuisance,
        }
        for name, value in fixed.items():
            object.__setattr__(self, name, value)
        made = made or StudyCache(self._new_tables(), {})
        object.__setattr__(self, "tables", made.tables)
        object.__setattr__(self, "_made", made)

    def _new_tables(self) -> CauseTables:
        """Empty tables of this study's causes, with a simulator of their own."""
        simulator = Simulator(
            self.simulate, self.specimens, cache=self.cache, n_jobs=self.n_jobs, version=self.version,
            needed=self.rows.needed, asked=self.rows.asked(len(self.specimens)),
        )
        placing = placing_noise(self.noise, self.n)
        tabulator = Tabulator(
            simulator, self.rows, self.nuisance, placing, levels=self.levels, nuisance_levels=self.nuisance_levels,
            crossed=self.crossed,
        )
        return CauseTables(tabulator, self.pair_tables)

    @classmethod
    def from_table(
        cls,
        table: str | Path | MeasuredTable | None = None,
        *,
        cache: str | Path | None = None,
        n_jobs: int = 1,
        **stated: Any,
    ) -> Self:
        """A study of measured values in a table, with its causes, noise and units.

        Parameters
        ----------
        table : CSV file with names, a line of units and one row per measured value; None is the packaged series
            that ``model`` names
        cache, n_jobs : as for the study
        stated : ``model``, a packaged series or ``simulate(specimen, **parameters)``; without one the predictions stand
            in a column (``predicted``, and ``towards`` columns of a second model). Columns: ``measured``, ``group``,
            ``covariates`` (all that are left), ``shared`` (those of them whose labels share noise, see the study) and
            ``batches``, whose labels may be read by another gain. What is
            known: ``noise`` (a :class:`Noise`, a relative error, "replicates", "unknown"; else the column "noise"),
            ``dof`` of it, ``inputs``, measured inputs of the model by name. ``causes``, causes or their
            names; else all that fit the model, with ``tilting`` for tangents of a tilt angle and ``spatial`` for walls
            that do not work in one plane. ``method`` and ``settings`` of a packaged series; ``levels``, ``title``

        Raises
        ------
        InputError
            Naming file, row and column of what is wrong.
        """
        return cls(cache=cache, n_jobs=n_jobs, **TableStudy(table, **stated).arguments())

    @classmethod
    def from_folder(
        cls, folder: str | Path, *, cache: str | Path | None = None, n_jobs: int = 1, **stated: Any
    ) -> Self:
        """A study of a folder of CSV files.

        Cells may be missing. There may be any number of quantities and specimens.

        Parameters
        ----------
        folder : with specimens.csv, measured.csv and quantities.csv, see :mod:`limitmason.diagnosis.study_from_folder`
        cache, n_jobs : as for the study
        stated : ``model``, ``simulate(specimen, **parameters)``, which returns a mapping of quantities; without one
            predicted.csv holds the predictions. ``causes``; else those in the measurement. ``inputs``, measured inputs
            of the model by name; ``covariates``, ``shared``, ``title``, ``levels``

        Raises
        ------
        InputError
            Naming file, row and column of what is wrong.
        """
        return cls(cache=cache, n_jobs=n_jobs, **folder_arguments(folder, **stated))

    @classmethod
    def from_experiments(cls, series: str, **stated: Any) -> Self:
        """A study of a packaged series by its own models or published predictions.

        See :meth:`from_table`.
        """
        return cls.from_table(None, model=series, **stated)

    def __str__(self) -> str:
        """What is measured, how well, and what may be wrong, in a line."""
        title = f"{self.about.title}: " if self.about.title else ""
        count = f"{len(self.causes) or 'no'} cause{'s' * (len(self.causes) != 1)}"
        causes = ": ".join(t for t in (count, ", ".join(c.name for c in self.causes)) if t)
        return f"{title}{self.n} values, noise {self.noise}, {causes}"

    @property
    def n(self) -> int:
        """Number of measured numbers."""
        return len(self.rows)

    @property
    def called(self) -> tuple[str, ...]:
        """What each row is called: its specimen, and its quantity if several."""
        names = [called(self.specimens[i], int(i)) for i in self.rows.of]
        if self.rows.several:
            names = [f"{name}, {q}" for name, q in zip(names, self.rows.quantities, strict=True)]
        return tuple(names)

    @property
    def simulator(self) -> Simulator:
        """The calls of the simulator, counted and kept."""
        return self.tabulator.simulator

    @property
    def tabulator(self) -> Tabulator:
        """What makes the tables."""
        return self.tables.tabulator

    def replace(self, **changes: Any) -> Self:
        """This study with other arguments.

        Tables are kept where only what was measured is stated otherwise: measured values, noise, groups, covariates.
        Their levels then stay where the noise first stated has put them. Observations in another order, or of other
        quantities, need tables of their own. Other specimens begin without measured values
        and groups, and their covariates are read anew.
        """
        if "specimens" in changes:
            changes = {**changes, "specimens": tuple(changes["specimens"])}
            rows = self.rows.on(len(changes["specimens"]))  # with the noise of each quantity, where rows state it
            noise = self.noise.for_others() if self.noise.by_row else self.noise
            changes = {
                "measured": None, "groups": None, "covariates": tuple(self.covariates), "rows": rows, "noise": noise,
                **changes,
            }
        elif "measured" in changes:
            changes["measured"] = measured = _listed(changes["measured"])
            rows = rows_of(measured, self.rows, self.specimens)
            if not rows.alike(self.rows):  # no table is of these numbers
                told = {"noise": Noise.unknown()} if self.noise.by_row and rows.scatter is None else {}
                return dataclasses.replace(self, **{**self._by_specimen(), **told, **changes})
            if not np.array_equal(rows.noise, self.rows.noise):  # designs are in units of it
                changes = {"noise": self.noise, **changes}
        if not set(changes) <= set(STATEMENTS):
            return dataclasses.replace(self, **changes)
        # designs are in units of the noise and hold the trends along covariates
        if set(changes) & {"noise", "covariates"}:
            return dataclasses.replace(self, **changes, made=StudyCache(self.tables, {}))
        made = self._made
        # judges leave out groups, allow for noise shared unstated, and set rehearsals: tables and designs do not
        if set(changes) & {"groups", "shared"}:
            made = StudyCache(self.tables, made.designs)
        return dataclasses.replace(self, **changes, made=made)

    def _by_specimen(self) -> dict[str, Any]:
        """Covariates and groups with an entry per specimen, for other numbers of the same specimens."""
        of = self.rows.of.tolist()
        first = {number: row for row, number in reversed(list(enumerate(of)))}  # row of each that was measured

        def read(name: str, column: Sequence[Any]) -> list[Any]:
            """Entries of a column by specimen; of one that no row is of, what it has recorded."""
            out = [column[first[i]] if i in first else recorded(s, name) for i, s in enumerate(self.specimens)]
            if None in out or any(out[i] != v for i, v in zip(of, column, strict=True)):
                raise InputError(f"{name!r} is not known for every specimen: give it with the other measured values")
            return out

        groups = None if self.groups is None or list(self.groups) == of else read("groups", self.groups)
        return {"covariates": {k: read(k, v) for k, v in self.covariates.items()}, "groups": groups}

    def baseline(self) -> np.ndarray:
        """Prediction of the baseline at the measured inputs, shape (n,)."""
        return unlinked(at_measured(self.tables.base()), self.rows.log)

    def predicted(
        self, causes: Cause | Iterable[Cause], sizes: float | Iterable[float], z: Iterable[float] = ()
    ) -> np.ndarray:
        """Prediction with given causes switched on, by the simulator itself, shape (n,).

        Parameters
        ----------
        causes, sizes : one or two causes and their sizes
        z : measured inputs in standard deviations from their values; none is the values themselves

        Raises
        ------
        InputError
            For another number of sizes than of causes, or of values than of inputs with an error.
        """
        z = tuple(z) or tuple(0.0 for _ in self.tabulator.free)
        causes = (causes,) if isinstance(causes, Cause | str) else tuple(causes)
        causes = check_causes(causes) if causes else ()
        sizes = tuple(sizes) if isinstance(sizes, Iterable) else (sizes,)
        free = len(self.tabulator.free)
        if len(causes) != len(sizes) or len(z) != free:
            raise InputError(f"{len(causes)} causes have {len(sizes)} sizes, and {free} inputs with an error {len(z)} "
                             "values: give one for each")
        return unlinked(self.tabulator.evaluate(causes, [(sizes, z)])[0], self.rows.log)

    @property
    def unstated(self) -> tuple[str, ...]:
        """Circumstances that no column tells and tests may share: batch, day, set-up.

        See ``shared``.
        """
        return unstated(self.covariates) if self.shared is None else ()


def _listed(measured: Any) -> Any:
    """Measured values that can be read again."""
    return list(measured) if isinstance(measured, Iterator) else measured


def rows_of(measured: Any, rows: Any, specimens: Sequence[Any]) -> Rows:
    """What is compared: observations, one value per known row, or per specimen.

    Parameters
    ----------
    measured : observations, one value per row, or None where nothing is measured yet
    rows : rows known before, or None
    specimens : what was tested
    """
    measured = _listed(measured)
    if measured is not None and len(measured) and all(isinstance(o, Observation) for o in measured):
        return Rows.read(list(measured), specimens)
    if isinstance(rows, Rows):
        return rows if measured is rows.values else rows.with_values(measured)
    return Rows.plain(len(specimens), measured)
