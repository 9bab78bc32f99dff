"""Methods by name, so that a caller names a theory without importing it."""

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points

from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import Prediction
from limitmason.stated import with_statements

__all__ = [
    "ENTRY_POINT_GROUP",
    "METHODS",
    "available_methods",
    "predict",
    "predict_cases",
]

METHODS: Mapping[str, str] = {
    "limit": "limitmason.limit:limit_analysis",
    "dem": "dem:collapse",
    "mechanisms": "mechanisms:smallest",
}
"""Method name to "module:function"; other packages add theirs through the entry-point group "limitmason.methods"."""

ENTRY_POINT_GROUP = "limitmason.methods"


def available_methods() -> dict[str, str]:
    """Names of all methods and where each comes from."""
    found = {e.name: e.value for e in entry_points(group=ENTRY_POINT_GROUP)}
    return {**found, **METHODS}


def predict(assembly: Assembly, loads: Loads, method: str = "limit", **options) -> Prediction:
    """Collapse multiplier by a method given by name.

    Parameters
    ----------
    assembly, loads : the problem
    method : "limit", or a name of :func:`available_methods`
    options : passed to the method

    Raises
    ------
    ValueError
        For an unknown method; the message lists the known ones.
    """
    table = available_methods()
    if method not in table:
        raise ValueError(f"unknown method {method!r}; available: {', '.join(sorted(table))}")
    module, _, function = table[method].partition(":")
    return with_statements(getattr(import_module(module), function)(assembly, loads, **options), assembly, loads)


def predict_cases(
    assembly: Assembly, cases: Mapping[str, Loads], method: str = "limit", **options
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
        raise ValueError("no load cases are given")
    return {name: predict(assembly, loads, method, **options) for name, loads in cases.items()}
