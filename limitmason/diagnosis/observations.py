"""What was measured: one row per number, with quantity, kind, error and scale."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from limitmason.checks import choice, instance, positive
from limitmason.diagnosis.inference.trends import is_numeric
from limitmason.diagnosis.specimens import numbers_of
from limitmason.errors import InputError
from limitmason.vibration import ModalTest

VALUE = "value"  # the quantity of a study that measured one number per specimen


class EvidenceKind(StrEnum):
    """Kinds of evidence: an error of the instrument may be shared within one alone."""

    FORCE = "force"
    DEFORMATION = "deformation"
    VIBRATION = "vibration"
    PATTERN = "pattern"


KIND_OF = {
    EvidenceKind.DEFORMATION: ("stiffness", "drift", "displacement", "rotation", "sway", "peak rotation",
                               "peak displacement", "residual rotation", "residual displacement"),
    EvidenceKind.VIBRATION: ("frequency", "mode", "damping", "period"),
    EvidenceKind.PATTERN: ("crack pattern", "opened", "slid", "crushed", "failure mode", "overturned"),
}  # all else is a force
SEEN = "seen"
FLAGS = ("opened", "slid", "crushed", "failure mode", "overturned")  # quantities that were seen (1) or not (0)
SIGNED = ("mode", "residual displacement")  # quantities that may be negative: compared as they are, not as logarithms


def _begins(quantity: str, words: Iterable[str]) -> bool:
    """Whether a quantity begins with one of some words, or its plural: a "sliding load" was not seen."""
    return re.match(rf"(?:{'|'.join(words)})s?(?![a-z])", quantity.lower()) is not None


@dataclass(frozen=True)
class Observation:
    r"""One measured number of one specimen.

    Parameters
    ----------
    specimen : its number, from 0, or its name (the "specimen" or "name" of its mapping)
    quantity : what was measured, as the simulator calls it: "peak", "stiffness", "frequency 1", "opened a|b", ...
    value : NaN where it is missing; 1 or 0 for what was seen or not (opened, slid, crushed, overturned, failure mode)
    scatter : standard deviation, relative to the value for a logarithmic scale, in its unit for a linear one; the rate
        of misreading, below one half, of what was seen or not; None where the study states the noise
    unit : of the value, for reports
    kind : of evidence, see :class:`EvidenceKind`; "" goes by the name of the quantity
    link : "log" compares logarithms (positive values), "identity" differences, "seen" what was seen or not; "" goes by
        the name of the quantity
    beyond : "above" where only that is known: the test ended before its peak, the wall did not fall up to this angle;
        "below" for the opposite; "" for a measured value. Predictions beyond the value then fit it without misfit,
        others by their distance to it
    counted : of a load of a curve, points of the measured curve and how many independent ones they are worth

    Raises
    ------
    InputError
        For an unknown kind or link, a scatter that is not positive, or a value that its scale cannot take.

    Notes
    -----
    What was seen or not, y of 1 or 0 with a rate e of misreading, is compared as (y - e) / (1 - 2 e) with the predicted
    1 or 0. Its mean is the truth and its standard deviation :math:`\sqrt{e (1 - e)} / (1 - 2 e)`. Of two patterns the
    difference of misfits is then that of the exact likelihoods up to a factor. Wrong in its tails where few joints
    tell two causes apart.
    """

    specimen: Any
    quantity: str
    value: float = float("nan")
    scatter: float | None = None
    unit: str = "-"
    kind: str = ""
    link: str = ""
    beyond: str = ""
    counted: tuple[int, float] | None = None

    def __post_init__(self) -> None:
        """Take kind and link that are not stated from the name, and check every field."""
        instance(f"the quantity of specimen {self.specimen}", self.quantity, str, "its name")
        choice(f"{self._called}: kind", self.kind, (*EvidenceKind, ""))
        choice(f"{self._called}: link", self.link, ("log", "identity", SEEN, ""))
        guessed = next((k for k, words in KIND_OF.items() if _begins(self.quantity, words)), EvidenceKind.FORCE)
        object.__setattr__(self, "kind", EvidenceKind(self.kind or guessed))
        link = SEEN if _begins(self.quantity, FLAGS) else "identity" if _begins(self.quantity, SIGNED) else "log"
        object.__setattr__(self, "link", self.link or link)
        try:
            object.__setattr__(self, "value", float(self.value))
        except (TypeError, ValueError):
            raise InputError(f"{self._called} is {self.value!r}; a number is needed, NaN where it is missing") from None
        if np.isinf(self.value) or (self.link == "log" and self.value <= 0.0):
            needed = "a logarithmic scale takes positive finite values" if self.link == "log" else "it must be finite"
            raise InputError(f"{self._called} is {self.value!r}; {needed}")
        if self.scatter is not None:
            positive(f"{self._called}: the scatter", self.scatter)
        if self.scatter is not None and self.link == "log" and self.scatter >= 1.0:
            raise InputError(f"{self._called}: scatter is relative, 0.05 is 5 %; got {self.scatter!r}")
        if self.seen and not (self.value in (0.0, 1.0) or np.isnan(self.value)):
            raise InputError(f"{self._called} is {self.value!r}; it takes 1 (seen), 0 (not seen) or NaN")
        if self.seen and not (self.scatter is not None and self.scatter < 0.5):
            raise InputError(f"{self._called}: scatter must be the rate of misreading, below 0.5: {self.scatter!r}")
        choice(f"{self._called}: beyond", self.beyond, ("above", "below", ""))
        if self.beyond and (self.scatter is None or self.seen):
            raise InputError(f"{self._called}: a value that was not reached needs a number and its scatter")

    @property
    def seen(self) -> bool:
        """Whether it was seen or not, rather than measured."""
        return self.link == SEEN

    @property
    def compared(self) -> tuple[float, float | None]:
        """Value and scatter as compared: what is seen or not, corrected for misreading."""
        if self.scatter is None or not self.seen:
            return self.value, self.scatter
        keep = 1.0 - 2.0 * self.scatter
        return (self.value - self.scatter) / keep, float(np.sqrt(self.scatter * (1.0 - self.scatter))) / keep

    @classmethod
    def of_modes(
        cls, specimen: Any, test: ModalTest, *, frequency: float = 0.01, component: float = 0.03
    ) -> list[Observation]:
        """Rows of frequencies and shapes of a modal test.

        The simulator answers "modes" with the same test.

        Parameters
        ----------
        frequency : its relative standard deviation [-]
        component : standard deviation of a component over the largest of its shape [-]
        specimen : key of the specimen, which the rows carry
        """
        found = test.quantities.items()
        return [
            cls(specimen, q, v, scatter=frequency, unit="Hz") if q.startswith("frequency")
            else cls(specimen, q, v, scatter=component) for q, v in found
        ]

    @property
    def _called(self) -> str:
        return f"{self.quantity} of specimen {self.specimen}"


@dataclass(frozen=True, eq=False)
class Rows:
    """The numbers of a study, one row each.

    Parameters
    ----------
    of : number of the specimen of each row, shape (n,)
    quantities, kinds : of each row
    log : whether it is compared by its logarithm, shape (n,)
    values : measured, shape (n,); None where nothing is measured yet
    scatter : stated standard deviation on the scale of comparison, shape (n,); None where it is not stated per row
    misread : rate of misreading of rows that were seen or not, 0 of measured ones; None where all were measured
    low, high : what predictions are cut at, as they are, shape (n,): values that were not reached; None for no cut
    counted : by number of a specimen, points of its curve and how many independent ones they are worth
    planned : quantities that were measured nowhere yet, with kind, whether by the logarithm, and scatter of each
    """

    of: np.ndarray
    quantities: tuple[str, ...]
    kinds: tuple[str, ...]
    log: np.ndarray
    values: np.ndarray | None = None
    scatter: np.ndarray | None = None
    misread: tuple[float, ...] | None = None
    low: np.ndarray | None = None
    high: np.ndarray | None = None
    counted: Mapping[int, tuple[int, float]] = field(default_factory=dict)
    planned: Mapping[str, tuple[str, bool, float]] = field(default_factory=dict)

    @classmethod
    def plain(cls, n: int, values: Any = None) -> Rows:
        """One number per specimen.

        Raises
        ------
        InputError
            For another number of values, or values that are not positive and finite.
        """
        out = cls(np.arange(n), (VALUE,) * n, (str(EvidenceKind.FORCE),) * n, np.ones(n, dtype=bool))
        return out if values is None else out.with_values(values)

    @classmethod
    def read(cls, observed: Sequence[Observation], specimens: Sequence[Any]) -> Rows:
        """Rows of observations of all specimens and quantities, as they come.

        Those without a value are left out, unless nothing at all is measured yet. A quantity that has none is one that
        may be measured next.

        Parameters
        ----------
        observed : in any order; each names its specimen by its name or its place among ``specimens``

        Raises
        ------
        InputError
            For a specimen that is not there, a number given twice, a quantity in two units, or a scatter stated for
            some rows only.
        """
        begun = {o.quantity for o in observed if not np.isnan(o.value)}
        planned = {o.quantity: (str(o.kind), o.link == "log", float(o.compared[1] or 0.0)) for o in observed
                   if begun and o.quantity not in begun and o.scatter is not None}
        chosen = [o for o in observed if not np.isnan(o.value)] or list(observed)
        of = numbers_of([(o.specimen, o._called) for o in chosen], specimens)  # place of the specimen of each row
        taken: set[tuple[int, str]] = set()
        for number, o in zip(of, chosen, strict=True):
            if (number, o.quantity) in taken:
                raise InputError(f"{o._called} is given twice: a repeat is a specimen of its own")
            taken.add((number, o.quantity))
        units: dict[str, str] = {}  # of each quantity, as first stated
        for o in chosen:
            if o.unit != "-" and (first := units.setdefault(o.quantity, o.unit)) != o.unit:
                raise InputError(f"{o._called} is in {o.unit!r}, others in {first!r}: give one quantity in one unit")
        pairs = [o.compared for o in chosen]
        stated = [scatter for _, scatter in pairs if scatter is not None]
        if stated and len(stated) < len(chosen):
            bare = next(o for o in chosen if o.scatter is None)
            raise InputError(f"{bare._called} has no scatter, others have: state it for every number or for none")
        values = np.array([value for value, _ in pairs])
        # of a value that was not reached: a prediction beyond it is cut at it, and then has no misfit
        cut = any(o.beyond for o in chosen)
        low, high = (np.array([o.value if o.beyond == b and not np.isnan(o.value) else end for o in chosen])
                     for b, end in (("below", -np.inf), ("above", np.inf)))
        return cls(
            of=np.array(of, dtype=int), quantities=tuple(o.quantity for o in chosen),
            kinds=tuple(o.kind for o in chosen), log=np.array([o.link == "log" for o in chosen], dtype=bool),
            values=None if np.isnan(values).all() else frozen(values), scatter=np.array(stated) if stated else None,
            misread=tuple(float(o.scatter or 0.0) * o.seen for o in chosen) if any(o.seen for o in chosen) else None,
            low=low if cut else None, high=high if cut else None, planned=planned,
            counted={i: o.counted for i, o in zip(of, chosen, strict=True) if o.counted},
        )

    def __len__(self) -> int:
        return len(self.of)

    @property
    def several(self) -> bool:
        """Whether more than one quantity was measured."""
        return len(set(self.quantities)) > 1

    @property
    def needed(self) -> dict[str, bool]:
        """Quantities that the simulator must return, and whether each must be positive."""
        return {q: bool(log) for q, log in zip(self.quantities, self.log, strict=True)}

    def asked(self, specimens: int) -> list[frozenset[str]]:
        """Quantities of each specimen."""
        return [frozenset(q for q, i in zip(self.quantities, self.of, strict=True) if i == k) for k in range(specimens)]

    @property
    def column(self) -> np.ndarray:
        """Number of each row's quantity among those needed, shape (n,)."""
        order = {q: i for i, q in enumerate(self.needed)}
        return np.array([order[q] for q in self.quantities], dtype=int)

    @property
    def noise(self) -> np.ndarray:
        """Scatter and rate of misreading of every row, 0 where not stated, shape (2, n)."""
        return np.array([np.zeros(len(self)) if v is None else v for v in (self.scatter, self.misread)], dtype=float)

    def alike(self, other: Rows) -> bool:
        """Whether both are of the same numbers in one order, so that their predictions are the same."""
        names = (self.quantities, self.kinds) == (other.quantities, other.kinds)
        cuts = zip((self.low, self.high), (other.low, other.high), strict=True)
        return names and np.array_equal(self.of, other.of) and np.array_equal(self.log, other.log) and all(
            np.array_equal(a, b) if a is not None and b is not None else a is b for a, b in cuts)

    def with_values(self, values: Any) -> Rows:
        """These rows with other values, one per row; None for those of numbers not measured yet."""
        if values is None:
            return replace(self, values=None)
        try:
            out = np.array(values, dtype=float)
        except (TypeError, ValueError):
            raise InputError(
                "measured takes numbers, or rows of Observation alone; limitmason.diagnosis.curves.features makes rows "
                "of a curve, Observation.of_modes of modes") from None
        if out.shape != (len(self),):
            what = "number" if self.several else "specimen"
            raise InputError(f"measured must have one value per {what} ({len(self)}), got shape {out.shape}")
        bad = np.flatnonzero(~(np.isfinite(out) & (~self.log | (out > 0))))
        if len(bad):
            where = f"specimen {self.of[bad[0]]}"
            raise InputError(f"measured values must be positive and finite; {where} has {out[bad[0]]:g}")
        low, high = (None if cut is None else np.where(np.isfinite(cut), out, cut) for cut in (self.low, self.high))
        return replace(self, values=frozen(out), low=low, high=high)

    def on(self, count: int) -> Rows:
        """Rows of ``count`` other specimens: all quantities, planned ones too, no values.

        Where a scatter is stated, that of a quantity is its mean over these rows, or as planned.
        """
        kinds = dict(zip(self.quantities, self.kinds, strict=True)) | {q: k for q, (k, _, _) in self.planned.items()}
        logs = self.needed | {q: log for q, (_, log, _) in self.planned.items()}

        later = [scatter for _, _, scatter in self.planned.values()]

        def spread(stated: Sequence[float] | np.ndarray, planned: Sequence[float]) -> list[float]:
            """Mean of what is stated of each quantity, and what is planned, for all rows."""
            return [*(np.asarray(stated)[self.column == k].mean() for k in range(len(self.needed))), *planned] * count

        return Rows(
            of=np.repeat(np.arange(count), len(logs)), quantities=tuple(logs) * count,
            kinds=tuple(kinds[q] for q in logs) * count, log=np.tile(np.array(list(logs.values()), dtype=bool), count),
            scatter=None if self.scatter is None else np.array(spread(self.scatter, later)),
            misread=None if self.misread is None else tuple(spread(self.misread, [0.0] * len(later))),
        )

    def linked(self, values: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
        """Predictions on the scale of comparison: cut, logarithms or as they are.

        Parameters
        ----------
        values : predictions, rows last
        rows : numbers of these rows, all by default
        """
        rows = np.arange(len(self)) if rows is None else rows
        if self.low is not None and self.high is not None:
            values = np.clip(values, self.low[rows], self.high[rows])
        return linked(values, self.log[rows])

    def spread_out(self, name: str, column: Sequence[Any], specimens: int) -> list[Any]:
        """A column with one entry per row, which may come with one per specimen.

        Where there are as many rows as specimens, its entries are those of the specimens.

        Raises
        ------
        InputError
            For another number of entries; ``name`` is what the message calls the column.
        """
        column = list(column)
        if len(column) == len(self) != specimens:
            return column
        if len(column) != specimens:
            raise InputError(f"{name} has {len(column)} values for {specimens} specimens")
        return [column[i] for i in self.of]

    def columns(self, covariates: Mapping[str, Sequence[Any]], names: Sequence[str]) -> dict[str, Sequence[Any]]:
        """Columns along which effects are looked for, by name, one entry per row each.

        They are the covariates. Of several quantities each covariate also comes within each kind of evidence alone.

        Parameters
        ----------
        covariates : one entry per row
        names : what each row's specimen is called
        """
        out, kinds = dict(covariates), list(dict.fromkeys(self.kinds))
        if not self.several:
            return out
        out |= {"quantity": list(self.quantities), "specimen": list(names)}
        for kind in kinds if len(kinds) > 1 else ():
            for name, column in covariates.items():
                out[f"{name} in {kind}"] = _within([k == kind for k in self.kinds], column)
        return out


def _within(inside: Sequence[bool], column: Sequence[Any]) -> list[Any]:
    """A column on the rows ``inside``, on others the mean of these, or "-" of labels."""
    numbers = [v for v, i in zip(column, inside, strict=True) if i]
    if not is_numeric(numbers):
        return [str(v) if i else "-" for v, i in zip(column, inside, strict=True)]
    mean = float(np.mean([float(v) for v in numbers]))
    return [float(v) if i else mean for v, i in zip(column, inside, strict=True)]


def linked(values: np.ndarray, log: np.ndarray) -> np.ndarray:
    """Logarithms of the columns that ``log`` tells, shape (n,), others as they are."""
    return np.log(values) if log.all() else np.where(log, np.log(np.where(log, values, 1.0)), values)


def unlinked(values: np.ndarray, log: np.ndarray) -> np.ndarray:
    """Inverse of :func:`linked`."""
    return np.exp(values) if log.all() else np.where(log, np.exp(np.where(log, values, 0.0)), values)


def frozen(values: np.ndarray) -> np.ndarray:
    """An array that cannot be written to."""
    values.flags.writeable = False
    return values
