"""Calls that take an assembly and its loads: whatever else is given is refused by name before anything is computed."""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeVar

from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

P = ParamSpec("P")
R = TypeVar("R")


def of_model(function: Callable[P, R]) -> Callable[P, R]:
    """A function that checks its assembly and its loads first.

    Its first argument must be an assembly, and its ``loads`` must be loads.

    Raises
    ------
    InputError
        For anything else; it says what was given, and in which order the two are written.
    """
    names = tuple(signature(function).parameters)
    wanted = {names[0]: (Assembly, "an Assembly"), "loads": (Loads, "Loads, for example Loads.horizontal(assembly)")}

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        """Check model and loads, then call the function."""
        call = signature(function)  # read here: what is closed over counts in a stored result, and this has no content
        try:
            given = call.bind_partial(*args, **kwargs).arguments
        except TypeError:
            given = {}  # the call below says what is wrong with it
        for name in [n for n in wanted if n in given]:
            kind, text = wanted[name]
            left_out = given[name] is None and call.parameters[name].default is None
            if not (isinstance(given[name], kind) or left_out):
                got = type(given[name]).__name__
                raise InputError(f"{name} must be {text}; got {got}. Write {function.__name__}({', '.join(names[:2])})")
        model, loads = given.get(names[0]), given.get("loads")
        if isinstance(model, Assembly) and isinstance(loads, Loads) and len(loads.dead) != model.n_blocks:
            raise InputError(f"the loads are for {len(loads.dead)} blocks, the assembly has {model.n_blocks}")
        return function(*args, **kwargs)

    return checked
