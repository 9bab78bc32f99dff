"""What a method says of itself, so that tables, figures, the command line and the diagnosis ask it instead of its name.

A method is one object in one file beside its theory: name, settings, solve, what its bound means, and how it
looks beside others. ``limitmason.methods`` finds it by name.
"""

import inspect
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field, fields, make_dataclass, replace
from difflib import get_close_matches
from functools import partial
from typing import Any

from limitmason.answers.curve import Curve
from limitmason.answers.references import LIMITMASON, Citation, Cited
from limitmason.answers.results import Prediction
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

COMPARED_METHODS = ("associative", "non-associative", "dem", "mechanisms")
"""Methods that a comparison runs where none is named."""

ASSOCIATIVE, NON_ASSOCIATIVE, DEM, MECHANISMS = COMPARED_METHODS

LIMIT = "limit"
"""Limit analysis with the flow rule as an option, for ``predict`` and the command line: one of the first two."""

LEVERS = (
    "friction", "friction of single joints", "cohesion", "tension", "dilatancy", "crushing", "torsion", "stiffness",
    "softening", "faces", "blocks", "weights", "displaced blocks", "direction of loads", "overload", "reading",
)
"""What a cause pulls at; a method declares which of them it feels and computes."""

DISPLACED = tuple(lever for lever in LEVERS if lever not in ("torsion", "displaced blocks"))
"""Levers of a theory that displaces blocks itself."""

def hyphened(name: Any, known: Container[str] = COMPARED_METHODS) -> Any:
    """A name as it is known: underscores may stand for hyphens, as arguments of Python need.

    Every method and flow rule that a user names is read by this. What is no such name comes back as it is.

    Parameters
    ----------
    name : as it was given, which may be anything
    known : names of methods or of flow rules
    """
    if not isinstance(name, str) or name in known:
        return name
    written = name.replace("_", "-")
    return written if written in known else name


Solve = Callable[..., Prediction]


def settings_of(name: str, *functions: Callable, without: tuple[str, ...] = ()) -> type:
    """A frozen dataclass whose fields are the keyword-only parameters of functions, with their defaults.

    Names and defaults are then written in the functions alone. Where two functions share a name the first counts.

    Parameters
    ----------
    name : of the dataclass
    functions : whose keyword-only parameters become fields
    without : names of parameters that become no fields, as the method does not take them
    """
    entries: dict[str, tuple[str, Any, Any]] = {}  # name, type and default of every field, by name
    for function in functions:
        for p in inspect.signature(function).parameters.values():
            if p.kind is p.KEYWORD_ONLY and p.name not in without and p.name not in entries:
                # a factory that returns the default: a dataclass refuses defaults that can be changed
                entries[p.name] = (p.name, p.annotation, field(default_factory=partial(_itself, p.default)))
    return make_dataclass(name, entries.values(), frozen=True)


def _itself(value: Any) -> Any:
    return value


@dataclass(frozen=True)
class Look:
    """How a method is drawn beside others: a name for axes, one of the colours of ``figures.style``, and a marker."""

    name: str
    colour: str = "PURPLE"
    marker: str = "P"


@dataclass(frozen=True, eq=False)
class Method:
    """A theory or program that predicts a collapse multiplier.

    Parameters
    ----------
    name : by which ``predict``, ``compare``, the command line and causes know it
    solve : called with assembly, loads and the settings as keywords; raises ``NotApplicable`` for what it refuses
    settings : frozen dataclass of its options; None for a function of another package, which checks its own
    look : how it is drawn
    cheap : settings of one run of many, in a study or a diagnosis, unless the user says otherwise
    stated : defaults that a comparison writes into its store, so that answers with and without them are told apart
    beside : what of a prediction's details stands beside its multiplier in a comparison, in words; "" for nothing
    kept : keys of a prediction's details that a comparison keeps
    theorem : what theory says of its answer. "upper": it bounds the structure's own law from above. "admissible": it is
        a multiplier that law admits. "mechanism": it bounds the associative value from above. "displaced": it is that
        of the displaced structure. "simulation": anything else
    drive : follows a structure that is driven to a displacement: called with assembly, ``Drive`` and ``to=`` [m]; None
        where the method has no such thing
    follow : follows a structure through stages of loading: called with assembly, stages and ``loads=``; None where the
        method has no such thing
    references : papers behind it, for ``cite()`` of answers that do not name their own
    levers : those of ``LEVERS`` that it feels and computes with its default points; by default all but "torsion"
    plane_levers : further ones that it computes in plane only
    takes_over : settings that are the prediction of another method, by its name: a comparison that has it hands it over
    """

    name: str
    solve: Solve
    settings: type | None = None
    look: Look = field(default_factory=lambda: Look("other"))
    cheap: Mapping[str, Any] = field(default_factory=dict)
    stated: Mapping[str, Any] = field(default_factory=dict)
    beside: Callable[[Mapping[str, Any]], str] = lambda _: ""
    kept: tuple[str, ...] = ()
    theorem: str = "simulation"
    drive: Callable[..., Curve] | None = None
    follow: Callable[..., Any] | None = None
    references: tuple[Cited, ...] = ()
    levers: tuple[str, ...] = tuple(lever for lever in LEVERS if lever != "torsion")
    plane_levers: tuple[str, ...] = ()
    takes_over: Mapping[str, str] = field(default_factory=dict)

    @property
    def heading(self) -> str:
        """Name in the head of a table: that of figures where it is an abbreviation."""
        return self.look.name if self.look.name.isupper() else self.name

    @property
    def takes(self) -> tuple[str, ...]:
        """Names of its options, or empty where it does not tell."""
        return () if self.settings is None else tuple(f.name for f in fields(self.settings))

    def feels(self, lever: str, *, plane: bool = True) -> bool:
        """Whether it feels and computes what a cause pulls at, one of ``LEVERS``.

        ``plane`` says whether the problem is plane; in space a method may compute less.
        """
        return lever in self.levers or (plane and lever in self.plane_levers)

    def one_of_many(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """Options of one run of many: the cheap ones, unless others are given."""
        return {**self.cheap, **options}

    def row(self, assembly: Assembly, loads: Loads, options: Mapping[str, Any]) -> dict[str, Any]:
        """Multiplier, range and status of one run of a study, as columns of a table.

        Parameters
        ----------
        assembly : to be solved
        loads : on it
        options : of the method, besides those of :meth:`one_of_many`
        """
        found = self.predict(assembly, loads, **self.one_of_many(options))
        low, high = map(float, found.range[:2])
        return {"multiplier": float(found.collapse_multiplier), "low": low, "high": high, "status": found.status}

    def check_options(self, options: Mapping[str, Any]) -> None:
        """Refuse an option that the method does not take.

        Raises
        ------
        TypeError
            Naming the option, and the nearest one it may have meant.
        """
        unknown = sorted(set(options) - set(self.takes)) if self.settings is not None else []
        if unknown:
            near = get_close_matches(unknown[0], self.takes, n=1, cutoff=0.6)
            hint = f"; did you mean {near[0]!r}?" if near else f"; it takes {', '.join(self.takes)}"
            raise TypeError(f"method {self.name!r} has no option {unknown[0]!r}{hint}")

    def predict(self, assembly: Assembly, loads: Loads, **options: Any) -> Prediction:
        """Its prediction, with options by name.

        Raises
        ------
        TypeError
            For an option that it does not take.
        InputError, NotApplicable, NotConverged
            As the method itself: wrong input, a structure, law or load that it refuses, a run without an answer.
        """
        self.check_options(options)
        found = self.solve(assembly, loads, **options)
        return replace(found, references=found.references or self.references)

    def cite(self) -> Citation:
        """The papers behind the method, as text and as BibTeX (``cite().bibtex``)."""
        return Citation((*self.references, LIMITMASON))
