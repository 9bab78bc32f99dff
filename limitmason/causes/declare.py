"""How a cause is declared: one function that edits a model or a reading, and beside it what it is.

>>> @declare("cohesion", parameter="cohesion_kpa", lever="cohesion", baseline=0.0, bounds=(0.0, 5.0), unit="kPa",
...          physics="...", source="...", isolate="...", hidden_when="...")
... def cohesion(size, assembly, loads, *, kinds=KINDS):
...     ...

makes ``cohesion(bounds, kinds=...)`` return a :class:`~limitmason.causes.Cause`. The function is called with sizes
other than the baseline only, and returns the changed (assembly, loads), or the reading for a cause in the measurement.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, fields
from functools import update_wrapper
from typing import Any

from limitmason.answers.method import LEVERS
from limitmason.causes.cause import Cause
from limitmason.checks import choice
from limitmason.model import Assembly, Loads

Bounds = tuple[float, float]
Model = tuple[Assembly, Loads]  # what a cause changes


@dataclass(frozen=True)
class Edit:
    """A declared change with its options: ``edit(size, *model)``, or ``edit(size, prediction, specimen)`` of a reading.

    ``specimen=`` and ``quantity=`` go to functions that take them.

    Parameters
    ----------
    declared : the declaration
    options : of its function
    """

    declared: Declared
    options: tuple[tuple[str, Any], ...] = ()

    def __call__(self, size: float, *model: Any, **read: Any) -> Any:
        """The model, or the reading, with the cause at a size.

        At the size of the baseline it is as it was.
        """
        if size == self.declared.baseline:
            return model[0] if len(model) == 1 or self.declared.lever == "reading" else model
        return self.declared.function(size, *model, **dict(self.options), **read)


@dataclass(frozen=True)
class Declaration:
    """What is said of a cause, as a decorator of the function that makes it.

    Parameters
    ----------
    name, parameter, baseline, bounds, physics, unit, source, isolate, hidden_when, analyses, reads, drifts : see
        :class:`~limitmason.causes.Cause`; bounds are the default
    lever : one of ``LEVERS``
    by_simulator : whether the simulator takes the parameter itself
    variant : checks the options and returns what depends on them: name, parameter, physics, unit, own
    """

    name: str
    _: KW_ONLY
    parameter: str
    lever: str
    baseline: float
    bounds: Bounds
    physics: str
    unit: str = "-"
    source: str = ""
    isolate: str = ""
    hidden_when: str = ""
    by_simulator: bool = False
    analyses: int = 0
    variant: Callable[..., Mapping[str, Any]] | None = None
    reads: tuple[str, ...] = ()
    drifts: tuple[str, ...] = ()

    def __call__(self, function: Callable[..., Any]) -> Declared:
        """The cause that a function makes, see the head of this file."""
        return Declared(function, self)


declare = Declaration


class Declared:
    """A cause as it is declared.

    Called with bounds and options it gives the cause itself.

    Parameters
    ----------
    function : makes the change, ``function(size, assembly, loads, *, options)`` or, of a reading,
        ``function(size, prediction, specimen, *, options)``
    declaration : what is said of it
    """

    def __init__(self, function: Callable[..., Any], declaration: Declaration):
        """Take options and fields of a cause from its function and its declaration."""
        name, lever = declaration.name, declaration.lever
        choice(f"cause {name!r}: lever", lever, LEVERS)
        update_wrapper(self, function)
        self.function, self.declaration, self.name, self.lever = function, declaration, name, lever
        self.baseline, self.bounds = declaration.baseline, declaration.bounds
        self.__code__ = function.__code__  # values on disk belong to the code that made them
        parameters = inspect.signature(function).parameters.values()
        self.options = {p.name: p.default for p in parameters if p.kind is p.KEYWORD_ONLY and p.name != "specimen"}
        own = ("baseline", "bounds", "by_simulator", "variant")  # the rest is a cause's own
        self.said: dict[str, Any] = {
            **{f.name: getattr(declaration, f.name) for f in fields(declaration) if f.name not in own},
            "acts_on": "measurement" if lever == "reading" else "simulation",
            "reads_specimen": lever != "reading" and any(p.name == "specimen" for p in parameters),
            "reads_quantity": lever == "reading" and any(p.name == "quantity" for p in parameters),
        }
        keyword = inspect.Parameter.KEYWORD_ONLY
        first = inspect.Parameter("bounds", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=declaration.bounds)
        rest = [inspect.Parameter(n, keyword, default=v) for n, v in self.options.items()]
        self.__signature__ = inspect.Signature([first, *rest], return_annotation=Cause)

    def __call__(self, bounds: Bounds | None = None, **options: Any) -> Cause:
        """The declared cause with bounds and options of one's own.

        Parameters
        ----------
        bounds : smallest and largest size; None is the default of the declaration
        options : of the function

        Raises
        ------
        TypeError
            For an option that the function does not take.
        """
        for name in options:
            if name not in self.options:
                raise TypeError(
                    f"cause {self.name!r} has no option {name!r}; it takes: {', '.join(self.options) or 'none'}"
                )
        given = {name: _fixed(value) for name, value in {**self.options, **options}.items()}
        variant = self.declaration.variant
        said = {**self.said, **(variant(**given) if variant is not None else {})}
        edit = None if self.declaration.by_simulator else Edit(self, tuple(given.items()))
        return Cause(baseline=self.baseline, bounds=self.bounds if bounds is None else bounds, apply=edit, **said)

    def __reduce__(self) -> str | tuple[Any, ...]:
        if self.__module__ == "__main__":  # a worker process has another one: the function itself goes along
            return Declared, (self.function, self.declaration)
        return self.function.__qualname__  # found again by its name, as a function is

    def __repr__(self) -> str:
        return f"<declared cause {self.__module__}.{self.function.__qualname__}>"


def _fixed(value: Any) -> Any:
    """An option as a value that can be compared and kept: sequences become tuples."""
    return tuple(value) if isinstance(value, Iterable) and not isinstance(value, (str, bytes, Mapping)) else value
