"""The nouns of packaged data: a quantity with its unit, a source, a target to compare with, and an experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

from limitmason.answers.curve import Curve
from limitmason.answers.references import DATA, LIMITMASON, Citation, Cited, Reference
from limitmason.checks import choice, single_number
from limitmason.errors import InputError
from limitmason.experiments.recipe import Recipe
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.stages import Drive

KINDS = ("measured", "published", "recomputed")
"""Tables of an experiment with values that a prediction can be held against."""


class Quantity(float):
    """A number with its unit.

    It computes and compares as the plain number.

    Parameters
    ----------
    value : number in ``unit``
    unit : "-" for a pure number
    note : remark of the source on this value
    """

    __slots__ = ("note", "unit")
    unit: str
    note: str

    def __new__(cls, value: float, unit: str = "-", note: str = "") -> Quantity:
        """Make the number and hang its unit on it."""
        self = super().__new__(cls, value)
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "note", note)
        return self

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse: a quantity is frozen."""
        raise AttributeError(f"a Quantity is frozen; cannot set {name!r}")

    def __reduce__(self) -> tuple:
        return Quantity, (float(self), self.unit, self.note)

    def __repr__(self) -> str:
        return f"Quantity({float(self)!r}, {self.unit!r})"

    def __str__(self) -> str:
        return f"{float(self):g}" if self.unit == "-" else f"{float(self):g} {self.unit}"

    def __format__(self, spec: str) -> str:
        return float(self).__format__(spec) if spec else str(self)


@dataclass(frozen=True)
class Source:
    """Where a set of experiments comes from.

    Parameters
    ----------
    name : key in ``limitmason.experiments.load``
    title : one line on what it is
    kind : "experiment" or "numerical benchmark"
    citation : the paper, as text
    doi : empty where the sources at hand do not give it
    url : empty where the sources at hand do not give it
    licence : of the data
    references : what the keys in the ``source`` column of the CSV files stand for
    caveats : to be read before using the numbers
    papers : what to cite for its numbers; what the sources at hand do not give is left out
    """

    name: str
    title: str
    kind: str
    citation: str
    doi: str
    url: str
    licence: str
    references: Mapping[str, str] = field(default_factory=dict)
    caveats: tuple[str, ...] = ()
    papers: tuple[Reference, ...] = ()

    def __str__(self) -> str:
        doi = f", doi {self.doi}" if self.doi else ""
        return f"{self.citation}{doi}"


class Option(NamedTuple):
    """An option of a source's assemblies: default, unit, what it changes, and what may be chosen if not anything."""

    default: Any
    unit: str
    meaning: str
    choices: tuple[Any, ...] = ()


class TargetValue(NamedTuple):
    """A value that a prediction can be held against.

    Parameters
    ----------
    quantity : its name in the table of that kind
    kind : table of the experiment, one of :data:`KINDS`
    flow_rule : with which it was computed; None for a measured value
    direction : sense of the live load, "+" or "-"
    options : of the assembly it belongs to
    copy : whether another program computed it from the same model as one of the others: it is no reference of its own
    """

    quantity: str
    kind: str
    flow_rule: str | None = None
    direction: str = "+"
    options: Mapping[str, Any] = {}
    copy: bool = False


@dataclass(frozen=True, eq=False)
class Experiment:
    """A packaged specimen.

    Parameters, how to build it, what was measured and what others computed.

    Parameters
    ----------
    source : where it comes from
    specimen : its name there
    title : one line on what it is
    parameters : geometry and material as the source gives them, each a ``Quantity`` or a word
    measured : measured quantities, empty for a numerical benchmark
    published : values computed by others
    recomputed : values computed for this project when the data were collected, not published
    assumptions : everything that the sources leave open and the assembly assumes, one sentence each
    targets : which of these values a collapse multiplier is compared with, and under which flow rule and options
    multiplier_to_measured : what a multiplier of 1 means, for example 1 kN; predicted = multiplier times this
    options : chosen values of the assembly's options
    option_table : their defaults, units and meanings
    open_options : options that the sources leave open, each with the values to show a prediction over
    row : the row of the data file, as text
    recipe : functions of its source that build the assembly and the loads
    no_model : why there is no assembly to hold theories against, empty when there is one
    inferred : where ``no_model`` is given, what the assembly that can be built all the same was inferred from; empty
        where there is none
    """

    source: Source
    specimen: str
    title: str
    recipe: Recipe
    parameters: Mapping[str, Quantity | str]
    measured: Mapping[str, Quantity] = field(default_factory=dict)
    published: Mapping[str, Quantity] = field(default_factory=dict)
    recomputed: Mapping[str, Quantity] = field(default_factory=dict)
    assumptions: tuple[str, ...] = ()
    targets: tuple[TargetValue, ...] = ()
    multiplier_to_measured: Quantity = field(default_factory=lambda: Quantity(1.0))
    options: Mapping[str, Any] = field(default_factory=dict)
    option_table: Mapping[str, Option] = field(default_factory=dict)
    open_options: Mapping[str, tuple] = field(default_factory=dict)
    row: Mapping[str, str] = field(default_factory=dict)
    no_model: str = ""
    inferred: str = ""

    @property
    def name(self) -> str:
        """Source and specimen in one word."""
        return f"{self.source.name}/{self.specimen}"

    @property
    def has_model(self) -> bool:
        """Whether the sources at hand say enough to build an assembly."""
        return not self.no_model

    @property
    def buildable(self) -> bool:
        """Whether an assembly can be built, of what sources say or what was inferred."""
        return self.recipe.assembly is not None and (self.has_model or bool(self.inferred))

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of every parameter and value."""
        tables = (self.parameters, self.measured, self.published, self.recomputed)
        return {k: v.unit for table in tables for k, v in table.items() if isinstance(v, Quantity)}

    @property
    def directions(self) -> tuple[str, ...]:
        """Senses of the live load that the targets ask for, out of "+" and "-".

        It is "+" without targets.
        """
        return tuple(d for d in ("+", "-") if any(t.direction == d for t in self.targets)) or ("+",)

    def value(self, target: TargetValue) -> Quantity:
        """The value a target points to."""
        return getattr(self, target.kind)[target.quantity]

    def standing(self, target: TargetValue) -> str:
        """What a value is, to be shown beside it.

        It is the kind of the value, or "derived" where no source prints the number itself.
        """
        return "derived" if self.value(target).note == "derived" else target.kind

    def assembly(self) -> Assembly:
        """The specimen as blocks in contact, built with the chosen options.

        Raises
        ------
        InputError
            When the sources at hand do not say enough to build it; the message says what is missing.
        """
        return self._assembly

    @cached_property
    def _assembly(self) -> Assembly:
        """The assembly, built once."""
        if self.recipe.assembly is None or not self.buildable:
            raise InputError(f"{self.name} has no assembly: {self.no_model}")
        return self.recipe.assembly(self)

    def loads(self, direction: str = "+") -> Loads:
        """Dead and live loads of the test.

        Parameters
        ----------
        direction : sense of the live load, "+" or "-"
        """
        choice("direction", direction, ("+", "-"))
        assembly = self.assembly()
        if self.recipe.loads is None:
            raise InputError(f"{self.name} has no loads: the sources at hand do not state them")
        return self.recipe.loads(self, assembly, 1.0 if direction == "+" else -1.0)

    def curve(self) -> Curve:
        """Measured load-displacement curve, in the units of the source.

        The curve names them.

        Raises
        ------
        InputError
            Where none was found; the message names the specimens that have one.
        """
        if self.recipe.curve is None:
            raise InputError(f"no curve of {self.name} was found; {self.source.name} has none")
        return self.recipe.curve(self)

    def drive(self) -> Drive:
        """What the test drives and which way, for ``dem.push``.

        Raises
        ------
        InputError
            Where nothing is driven.
        """
        if self.recipe.drive is None:
            raise InputError(f"{self.name} has no drive: {self.source.name} was loaded by forces, or does not say how")
        return self.recipe.drive(self)

    def cite(self) -> Citation:
        """The papers behind its numbers, as text and as BibTeX (``cite().bibtex``)."""
        return Citation((*(Cited(DATA, paper) for paper in self.source.papers), LIMITMASON))

    def with_options(self, **options: Any) -> Experiment:
        """This experiment built with other options.

        See ``option_table``.
        """
        return self.recipe.load(self.specimen, **{**self.options, **options})

    def __str__(self) -> str:
        """Data sheet."""
        lines = [self.name, self.title, "", f"Source       {self.source}", f"Licence      {self.source.licence}"]
        if not self.has_model:
            heading = "No published assembly" if self.inferred else "No assembly"
            lines += ["", f"{heading}: {self.no_model}"]
        if self.inferred:
            lines += [f"Inferred, not published: {self.inferred}"]
        for heading, table in (
            ("Parameters", self.parameters),
            ("Measured", self.measured),
            ("Published by others", self.published),
            ("Computed for this project, not published", self.recomputed),
        ):
            lines += ["", heading] + (_lines(table) or ["  none"])
        if self.multiplier_to_measured.unit != "-":
            lines += ["", f"A multiplier of 1 means {self.multiplier_to_measured}"]
        if self.option_table:
            lines += ["", "Options (chosen value; meaning)"]
            width = max(map(len, self.option_table))
            for key, option in self.option_table.items():
                unit = "" if option.unit == "-" else f" {option.unit}"
                left_open = self.open_options.get(key)
                shown = f"; left open by the sources: {', '.join(map(str, left_open))}" if left_open else ""
                lines.append(f"  {key:<{width}}  {self.options[key]}{unit}; {option.meaning}{shown}")
        for heading, sentences in (("Assumptions", self.assumptions), ("Caveats", self.source.caveats)):
            lines += ["", heading] + ([f"  - {s}" for s in sentences] or ["  none"])
        return "\n".join(lines)


def _lines(table: Mapping[str, Quantity | str]) -> list[str]:
    """Quantities and words of a table, one line each, with the remark of the source."""
    width = max(map(len, table), default=0)
    return [
        f"  {key:<{width}}  {value}" + (f"  ({value.note})" if isinstance(value, Quantity) and value.note else "")
        for key, value in table.items()
    ]


def chosen_options(table: Mapping[str, Option], given: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Defaults of options, overridden by what is given.

    An unknown option, or choice of one, is an error that lists the known ones. So is a number that is none.

    Parameters
    ----------
    table : options of a source by name
    given : what a user chose
    source : name of the source, for errors
    """
    for key in given:
        if key not in table:
            known = ", ".join(table) or "none"
            raise InputError(f"{source} has no option {key!r}; its options are: {known}")
        option, value = table[key], given[key]
        if option.choices:
            choice(f"{source}: {key}", value, option.choices)
        # the builders know the words that they take; every other option is a number, or None where that is the default
        elif not (isinstance(option.default, str) or (value is None and option.default is None)):
            single_number(f"{source}: {key}", value)
    return {key: given.get(key, option.default) for key, option in table.items()}


def with_source(assembly: Assembly, test: Experiment) -> Assembly:
    """The assembly with source, specimen and options of the experiment in its recipe."""
    recipe = {**assembly.recipe, "source": test.source.name, "specimen": test.specimen, "options": dict(test.options)}
    return replace(assembly, recipe=recipe)
