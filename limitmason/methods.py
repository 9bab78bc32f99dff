"""Methods by name: one vocabulary for ``predict``, ``compare``, studies, causes and the command line."""

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from limitmason.answers.method import (
    ASSOCIATIVE,
    COMPARED_METHODS,
    DEM,
    LIMIT,
    MECHANISMS,
    NON_ASSOCIATIVE,
    Look,
    Method,
)
from limitmason.answers.results import FlowRule, Prediction
from limitmason.errors import InputError
from limitmason.mechanics.stated import with_statements
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

__all__ = [
    "ASSOCIATIVE",
    "COMPARED_METHODS",
    "DEM",
    "ENTRY_POINT_GROUP",
    "LIMIT",
    "MECHANISMS",
    "METHODS",
    "NON_ASSOCIATIVE",
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
    "sustained": "limitmason.validation.sustained:SUSTAINED",
}
"""Method name to "module:object"; other packages add theirs through the entry-point group "limitmason.methods", as a
:class:`limitmason.answers.method.Method` or as a plain function of assembly and loads."""

ENTRY_POINT_GROUP = "limitmason.methods"


def available_methods() -> dict[str, str]:
    """Names of all methods and where each comes from."""
    found = {e.name: e.value for e in entry_points(group=ENTRY_POINT_GROUP)}
    return {**found, **METHODS}


def get_method(name: str, flow_rule: str | None = None) -> Method:
    """The method of a name.

    Parameters
    ----------
    name : of :func:`available_methods`; "limit" is the associative or non-associative method by ``flow_rule``
    flow_rule : for "limit" only, associative by default

    Raises
    ------
    InputError
        For an unknown method or flow rule, and for a flow rule with a method that has its own; the message lists the
        known ones.
    """
    if name == LIMIT:
        rules = tuple(str(rule) for rule in FlowRule)
        name = FlowRule.ASSOCIATIVE if flow_rule is None else flow_rule
        if name not in rules:
            raise InputError(f"flow_rule must be one of {rules}, got {flow_rule!r}")
    elif flow_rule is not None:
        raise InputError(f"flow_rule is an option of method 'limit'; method {name!r} has its own")
    table = available_methods()
    if name not in table:
        raise InputError(f"unknown method {name!r}; available: {', '.join(sorted({LIMIT, *table}))}")
    module, _, attribute = table[name].partition(":")
    found = getattr(import_module(module), attribute)
    return found if isinstance(found, Method) else Method(name, found, look=Look(name))


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
    return with_statements(chosen.predict(assembly, loads, **options), assembly, loads, chosen.name)


def predict_cases(
    assembly: Assembly, cases: Mapping[str, Loads], method: str = LIMIT, **options: Any
) -> dict[str, Prediction]:
    """One prediction per load case.

    Parameters
    ----------
    cases : loads by name, for example {"+x": Loads.horizontal(assembly), "-x": Loads.horizontal(assembly, (-1, 0, 0))}

    Returns
    -------
    dict
        In the order given; the governing case is ``min(out, key=lambda k: out[k].collapse_multiplier)``.
    """
    if not cases:
        raise InputError("no load cases are given")
    return {name: predict(assembly, loads, method, **options) for name, loads in cases.items()}
