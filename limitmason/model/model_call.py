"""Calls that take an assembly and its loads: whatever else is given is refused by name before anything is computed."""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar

from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

P = ParamSpec("P")
R = TypeVar("R")


def of_model(function: Callable[P, R]) -> Callable[P, R]:
    """A function whose first argument must be an assembly, and whose ``loads`` must be loads.

    Raises
    ------
    InputError
        For anything else; it says what was given, and in which order the two are written.
    """
    names = tuple(signature(function).parameters)
    parameters = signature(function).parameters
    where = names.index("loads") if "loads" in names else None
    optional = where is not None and parameters["loads"].default is None
    call = f"{function.__name__}({', '.join(names[:2])})"

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        _refuse(args, kwargs, 0, names[0], Assembly, "an Assembly", call)
        if where is not None and not (optional and _given(args, kwargs, where, "loads") in ((), (None,))):
            _refuse(args, kwargs, where, "loads", Loads, "Loads, for example Loads.horizontal(assembly)", call)
        return function(*args, **kwargs)

    return checked


def _given(args: tuple[Any, ...], kwargs: dict[str, Any], where: int, name: str) -> tuple[Any, ...]:
    """The value of an argument, alone in a tuple, or empty where none was given."""
    return args[where : where + 1] or ((kwargs[name],) if name in kwargs else ())


def _refuse(
    args: tuple[Any, ...], kwargs: dict[str, Any], where: int, name: str, kind: type, wanted: str, call: str
) -> None:
    """Refuse an argument of another class.

    One that is missing is left to Python, which names it.
    """
    for value in _given(args, kwargs, where, name):
        if not isinstance(value, kind):
            raise InputError(f"{name} must be {wanted}; got {type(value).__name__}. Write {call}")
