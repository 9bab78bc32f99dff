"""Methods by name: one vocabulary for ``predict``, ``compare``, studies, causes and the command line."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from limitmason.answers.curve import Curve
from limitmason.answers.method import (
    ASSOCIATIVE,
    COMPARED_METHODS,
    DEM,
    LIMIT,
    MECHANISMS,
    NON_ASSOCIATIVE,
    Look,
    Method,
    hyphened,
)
from limitmason.answers.results import FlowRule, Prediction, Status
from limitmason.checks import instance
from limitmason.display.notebook import shows
from limitmason.errors import InputError, NotConverged
from limitmason.mechanics.model_notes import with_model_notes
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.interrupts import handed_on
from limitmason.vibration import ModalTest, modes
from limitmason.vibration.blocks import closed_system
from limitmason.vibration.modes import solved

__all__ = [
    "ASSOCIATIVE",
    "COMPARED_METHODS",
    "DEM",
    "ENTRY_POINT_GROUP",
    "LIMIT",
    "MECHANISMS",
    "METHODS",
    "MODES",
    "NON_ASSOCIATIVE",
    "Answer",
    "answer",
    "available_methods",
    "get_method",
    "predict",
    "predict_cases",
]

METHODS: Mapping[str, str] = {
    ASSOCIATIVE: "limitmason.limit.method:ASSOCIATIVE",
    NON_ASSOCIATIVE: "limitmason.limit.method:NON_ASSOCIATIVE",
    DEM: "dem.method:DEM",
    MECHANISMS: "mechanisms.method:MECHANISMS",
    "pushover": "limitmason.capacity.method:PUSHOVER",
    "sustained": "limitmason.comparison.sustained:SUSTAINED",
}
"""Method name to "module:object"; other packages add theirs through the entry-point group "limitmason.methods", as a
:class:`limitmason.answers.method.Method` or as a plain function of assembly and loads."""

ENTRY_POINT_GROUP = "limitmason.methods"

MODES = "modes"
"""Natural frequencies and shapes, beside the methods that predict a collapse, for :func:`answer` and causes."""

LOAD_AT = "load at "  # before a displacement, in the unit of the method's curve
SPARE = 3  # modes beyond those measured, which may have changed places with them


def available_methods() -> dict[str, str]:
    """Names of all methods and where each comes from, as "module:object"; a name of this package cannot be taken."""
    return {**_of_other_packages(), **METHODS}


@cache
def _of_other_packages() -> Mapping[str, str]:
    """Names of methods of other packages that are installed, and where each comes from."""
    # read once: it opens a file of every package that is installed, and every prediction asks
    return {e.name: e.value for e in entry_points(group=ENTRY_POINT_GROUP)}


def method_name(name: Any) -> Any:
    """The name of a method as :func:`available_methods` has it, see ``hyphened``; what is none comes back as it is."""
    return hyphened(name, available_methods())


def get_method(name: str, flow_rule: str | None = None) -> Method:
    """The method of a name.

    Parameters
    ----------
    name : of :func:`available_methods`; "limit" is the associative or non-associative method by ``flow_rule``. Hyphens
        may be written as underscores, here as wherever a method or a flow rule is named
    flow_rule : for "limit" only, associative by default

    Raises
    ------
    InputError
        For an unknown method or flow rule, and for a flow rule with a method that has its own; the message lists the
        known ones.
    """
    if name == LIMIT:
        rules = tuple(str(rule) for rule in FlowRule)
        name = FlowRule.ASSOCIATIVE if flow_rule is None else hyphened(flow_rule, rules)
        if name not in rules:
            raise InputError(f"flow_rule must be one of {rules}, got {flow_rule!r}")
    elif flow_rule is not None:
        raise InputError(f"flow_rule is an option of method 'limit'; method {name!r} has its own")
    table, name = available_methods(), method_name(name)
    if not isinstance(name, str) or name not in table:
        raise InputError(f"unknown method {name!r}; available: {', '.join(sorted({LIMIT, *table}))}")
    module, _, attribute = table[name].partition(":")
    found = getattr(import_module(module), attribute)
    return found if isinstance(found, Method) else Method(name, found, look=Look(name))


def options_by_method(
    methods: Sequence[str], options: Mapping[str, Mapping[str, Any]] | None
) -> dict[str, dict[str, Any]]:
    """Options of every method, by its name (empty where none are given).

    Parameters
    ----------
    methods : names, as :func:`method_name` has them
    options : of methods by name, in which hyphens may be written as underscores, as arguments of Python need

    Raises
    ------
    InputError
        For no methods, an unknown one, options that are no mapping, and those of a method that is not asked for.
    TypeError
        For an option that a method does not take.
    """
    if not methods:
        raise InputError(f"methods: name at least one, for example {', '.join(COMPARED_METHODS)}")
    named, out = _by_name(options or {}), {}
    for method in methods:
        given = named.get(method, {})
        get_method(method).check_options(given)
        out[method] = dict(given)
    if unused := sorted(set(named) - set(methods)):
        raise InputError(f"options are given for {unused[0]!r}, which is not among the methods {', '.join(methods)}")
    return out


def _by_name(options: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Options by the names of their methods, none of which may be given twice, with underscores and hyphens."""
    out: dict[str, Mapping[str, Any]] = {}
    for written, given in options.items():
        name = method_name(written)
        if name in out:
            raise InputError(f"options of {name!r} are given twice, as {name.replace('-', '_')!r} too: write one")
        if not isinstance(given, Mapping):
            raise InputError(f"options of {name!r} must be a mapping, got {given!r}")
        out[name] = given
    return out


@of_model
def predict(assembly: Assembly, loads: Loads, method: str = LIMIT, **options: Any) -> Prediction:
    """Collapse multiplier by a method given by name.

    Parameters
    ----------
    assembly, loads : the problem
    method : a name of :func:`available_methods`; "limit" takes the flow rule as option ``flow_rule``
    options : of the method

    Raises
    ------
    InputError
        For an unknown method; the message lists the known ones.
    NotApplicable
        Where the method refuses the structure, its joint laws or its loads.
    NotConverged
        Where it found no answer that could be certified.
    TypeError
        For an option that the method does not take.
    """
    chosen = get_method(method, options.pop("flow_rule", None))
    return with_model_notes(chosen.predict(assembly, loads, **options), assembly, loads, chosen.name)


@dataclass(frozen=True, eq=False)
class Answer:
    """What one model answers to several questions.

    Parameters
    ----------
    quantities : those asked for, by name
    by : what each method found, by its name: a ``Prediction``, a ``Curve`` or ``Modes``
    """

    quantities: Mapping[str, float]
    by: Mapping[str, Any] = field(default_factory=dict)

    def __getitem__(self, quantity: str) -> float:
        return self.quantities[quantity]

    def __str__(self) -> str:
        return "\n".join(f"{name}: {value:.6g}" for name, value in self.quantities.items())


@of_model
def answer(
    assembly: Assembly, loads: Loads, wanted: Mapping[str, str | Callable[[Assembly, Loads], float]],
    **options: Mapping[str, Any],
) -> Answer:
    """Quantities of one model by one or several methods, each run once.

    Parameters
    ----------
    wanted : quantity to the method that finds it: a name of :func:`available_methods` (see ``Prediction.quantities``
        and ``Curve.quantities``; "load at X" reads its curve), "limit", "modes"; or to a function of assembly and loads
    options : of a method, by its name. ``test`` of "modes" is a :class:`~limitmason.vibration.ModalTest`, with whose
        shapes modes are paired; ``drive`` of a method that drives structures is a ``Drive``, or a function of assembly
        and loads that gives one, and goes with ``to`` [m]; ``stages`` of a method that follows histories are stages of
        loading, or a function that gives them: "peak rotation", "residual displacement", "overturned" (see
        ``dem.History.quantities``)

    Raises
    ------
    InputError
        For a quantity that its method does not find; the message lists those it does.
    NotConverged, NotApplicable
        As of :func:`predict`.

    >>> answer(wall, loads, {"peak": "pushover", "stiffness": "pushover", "frequency 1": "modes"})  # doctest: +SKIP
    """
    if not isinstance(wanted, Mapping):
        raise InputError(f"wanted must be a mapping such as {{'peak': 'limit'}}, quantity to method, got {wanted!r}")
    wanted = {quantity: method_name(method) for quantity, method in wanted.items()}
    chosen = _by_name(options)
    for name in chosen:
        if name not in wanted.values():
            raise InputError(f"options of {name!r}: no quantity is asked of it")
    by: dict[str, Any] = {}  # what each method found, and its quantities
    known: dict[str, Mapping[str, float]] = {}
    out: dict[str, float] = {}
    for quantity, method in wanted.items():
        instance("wanted: the name of a quantity", quantity, str)
        if callable(method):
            out[quantity] = float(method(assembly, loads))
            continue
        if method != MODES:
            get_method(method)  # refuses what is no name of one
        if method not in by:
            asked = [q for q, m in wanted.items() if m == method]
            by[method], known[method] = _answered(assembly, loads, method, asked, **chosen.get(method, {}))
        if quantity not in known[method] and quantity.startswith(LOAD_AT):
            out[quantity] = _load_at(by[method], method, _place(quantity))
            continue
        if quantity not in known[method]:
            names = [q for q in known[method] if "|" not in q]  # joints, by name, would fill pages
            raise InputError(f"method {method!r} does not find {quantity!r}; it finds {', '.join(names)}")
        out[quantity] = float(known[method][quantity])
    return Answer(out, by)


def _answered(
    assembly: Assembly, loads: Loads, method: str, wanted: Sequence[str], *, test: ModalTest | None = None,
    drive: Any = None, stages: Any = None, **options: Any,
) -> tuple[Any, Mapping[str, float]]:
    """What a method found, and all its quantities by name.

    Parameters
    ----------
    method : name of a method, or "modes"
    wanted : quantities that are asked of it, by which it is told how many modes to find
    test : whose shapes modes are paired with
    drive, stages : of methods that follow them, or functions of assembly and loads that make them
    options : of the method
    """
    # who follows stages takes no drive beside them, and only modes are paired with a test
    given = {"test": test, "drive": drive, "stages": stages}
    taken = "test" if method == MODES else "drive" if drive is not None else "stages"
    if unused := [name for name, value in given.items() if value is not None and name != taken]:
        besides = " beside a drive" if method != MODES and unused[0] == "stages" else ""
        raise InputError(f"options of {method!r}: {unused[0]} is not used by it{besides}: leave it out")
    if method == MODES:
        if test is not None:
            instance("options of 'modes': test", test, ModalTest)
            system = closed_system(assembly, **{k: v for k, v in options.items() if k != "count"})
            # a small structure has no more modes than unknowns
            most = min(len(test) + SPARE, max(len(test), system.stiffness.shape[0]))
            modal = solved(system, options.get("count", most))
            return modal, test.predicted(modal)
        # as many modes as the highest number asked for, such as 3 of "frequency 3"
        numbers = [int(word) for q in wanted for word in q.split()[1:2] if word.isdecimal()]
        modal = modes(assembly, **{"count": max(numbers, default=1), **options})
        return modal, modal.quantities
    if drive is not None:
        driven = get_method(method).drive
        if driven is None:
            raise InputError(f"method {method!r} follows no drive; dem does")
        curve = driven(assembly, drive(assembly, loads) if callable(drive) else drive, **options)
        return curve, curve.quantities
    if stages is not None:
        follow = get_method(method).follow
        if follow is None:
            raise InputError(f"method {method!r} follows no stages; dem does")
        history = follow(assembly, stages(assembly, loads) if callable(stages) else stages, loads=loads, **options)
        if str(history.status) != "finished":
            raise NotConverged(f"the history of method {method!r} ended '{history.status}'")
        return history, history.quantities
    found = predict(assembly, loads, method, **options)
    if found.status not in (Status.SOLVED, Status.ALMOST_SOLVED) or not math.isfinite(found.collapse_multiplier):
        raise NotConverged(f"method {method!r} ended '{found.status}' (multiplier {found.collapse_multiplier:.4g})")
    return found, found.quantities


def _place(quantity: str) -> float:
    """Displacement that the name of a quantity holds, in the unit of the curve."""
    try:
        return float(quantity[len(LOAD_AT) :])
    except ValueError:
        raise InputError(f"{quantity!r}: write a displacement in the curve's unit, as in '{LOAD_AT}0.001'") from None


def _load_at(found: Any, method: str, displacement: float) -> float:
    """Load of a method's curve at a displacement, in the curve's units.

    Parameters
    ----------
    found : prediction with a curve in its details, or a curve
    method : that found it, for messages
    displacement : in the curve's unit
    """
    curve = found.details.get("curve") if isinstance(found, Prediction) else found
    if not isinstance(curve, Curve):
        raise InputError(f"method {method!r} follows no curve: it has no load at a displacement")
    load = float(curve.at(displacement))
    if math.isnan(load):
        raise NotConverged(f"the curve of {method!r} ends at {curve.displacement.max():.4g} {curve.displacement_unit}, "
                           f"before {displacement:g}")
    return load


@of_model
def predict_cases(
    assembly: Assembly, cases: Mapping[str, Loads], method: str = LIMIT, **options: Any
) -> dict[str, Prediction]:
    """One prediction per load case.

    Parameters
    ----------
    assembly, method, options : as of :func:`predict`
    cases : loads by name, for example {"+x": Loads.horizontal(assembly), "-x": Loads.horizontal(assembly, (-1, 0, 0))}

    Returns
    -------
    dict
        In the order given; the governing case is ``min(out, key=lambda k: out[k].collapse_multiplier)``.
    """
    if not isinstance(cases, Mapping):
        raise InputError(f"cases must be a mapping of loads by name, got {type(cases).__name__}")
    if not cases:
        raise InputError("no load cases are given")
    whole = handed_on()(predict)  # an interrupt that one run answers with what it has so far ends all cases
    return {name: whole(assembly, loads, method, **options) for name, loads in cases.items()}


shows(__name__)
