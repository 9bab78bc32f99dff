"""A cause: a physical extension of the model, nested in the baseline, and how it acts on a prediction."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

from limitmason.checks import choice, numbers
from limitmason.errors import InputError

ACTS_ON = ("simulation", "measurement")


@dataclass(frozen=True)
class Cause:
    """A physical explanation that can be switched on in the model, with one size.

    Parameters
    ----------
    name : what it is called in a verdict
    parameter : keyword under which its size is passed to ``simulate(specimen, **parameters)``
    baseline : size that recovers the baseline model; must lie within the bounds
    bounds : smallest and largest size that are physically possible
    physics : one line on the physics
    acts_on : "simulation" (a changed joint, geometry or load) or "measurement" (sensor, batch, order of tests)
    apply : how it changes the model, or None when ``simulate`` takes the parameter itself.
        For a measurement cause ``apply(size, prediction, specimen)`` returns the transformed positive prediction.
        For a simulation cause ``apply(size, *model)`` returns the changed model (assembly, joint, loads, whatever the
        simulator builds), and ``simulate`` gets a keyword ``extend``: it calls ``extend(*model)`` before it solves.
    unit : unit of the size, for reports
    source : where the physics comes from
    isolate : the experiment that would show this cause alone
    hidden_when : when data cannot show it, or cannot tell it from another cause
    lever : what it pulls at, of ``causes.LEVERS``; methods say which of them they feel; empty is felt by all
    reads_specimen : ``apply`` of a simulation cause also takes ``specimen=``, for what differs from test to test
    reads_quantity : ``apply`` of a measurement cause also takes ``quantity=``, the name of what is read
    reads : of a measurement cause, the kinds of evidence or the quantities that it acts on; () is all
    own : columns of the specimens that it acts along by its own law, such as the label of a batch or a normal load
    drifts : columns of the order of tests: where none of them is recorded, the same error that grows from nothing from
        test to test stands as a rival of this one
    analyses : most limit analyses that ``apply`` itself runs each time; 0 for nearly all causes

    Raises
    ------
    InputError
        For bounds that exclude the baseline or are not finite and increasing, or an unknown ``acts_on``.

    Notes
    -----
    Wrong when the cause has more than one size: split it, or fix the shape by a covariate.
    """

    name: str
    parameter: str
    baseline: float
    bounds: tuple[float, float]
    physics: str = ""
    acts_on: str = "simulation"
    apply: Callable[..., Any] | None = None
    unit: str = "-"
    source: str = ""
    isolate: str = ""
    hidden_when: str = ""
    lever: str = ""
    reads_specimen: bool = False
    reads_quantity: bool = False
    analyses: int = 0
    reads: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    drifts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        pair = numbers(f"cause {self.name!r}: bounds", self.bounds)
        if pair.shape != (2,):
            raise InputError(f"cause {self.name!r}: bounds are a smallest and a largest size, got {self.bounds!r}")
        low, high = pair.tolist()
        object.__setattr__(self, "bounds", (low, high))
        object.__setattr__(self, "baseline", float(self.baseline))
        for name in ("reads", "own", "drifts"):  # tuples, as tables are kept by causes, which must have a hash
            names = getattr(self, name)
            object.__setattr__(self, name, (names,) if isinstance(names, str) else tuple(names))
        if not (isfinite(low) and isfinite(high) and low < high):
            raise InputError(f"cause {self.name!r}: bounds must be finite and increasing, got {self.bounds}")
        if not low <= self.baseline <= high:
            raise InputError(f"cause {self.name!r}: bounds {self.bounds} exclude the baseline {self.baseline:g}")
        choice(f"cause {self.name!r}: acts_on", self.acts_on, ACTS_ON)
        if self.apply is None and not str(self.parameter).isidentifier():
            raise InputError(
                f"cause {self.name!r}: {self.parameter!r} cannot be a keyword of simulate; rename it or give apply="
            )

    @property
    def sides(self) -> tuple[float, ...]:
        """The bounds that differ from the baseline.

        A one-sided cause has one, a two-sided cause two.
        """
        return tuple(b for b in self.bounds if b != self.baseline)

    @property
    def transforms(self) -> bool:
        """Whether it acts on the predicted value and so needs no further simulation."""
        return self.acts_on == "measurement" and self.apply is not None

    def reads_row(self, quantity: str, kind: str) -> bool:
        """Whether a measurement cause acts on a quantity of some kind."""
        return not self.reads or quantity in self.reads or kind in self.reads

    def show(self, size: float) -> str:
        """A size with its unit."""
        return f"{size:.3g}" if self.unit == "-" else f"{size:.3g} {self.unit}"


@dataclass(frozen=True)
class Extension:
    """The changes of several causes at given sizes, to be called on a model.

    ``extend(*model)`` returns the changed model: a single object for one argument, else a tuple of as many.

    Parameters
    ----------
    steps : pairs of a cause with ``apply`` and its size, in the order of application
    specimen : passed on to causes that read it
    """

    steps: tuple[tuple[Cause, float], ...]
    specimen: Any = None

    def __call__(self, *model: Any) -> Any:
        """Apply all steps to the model."""
        for cause, size in self.steps:
            more = {"specimen": self.specimen} if cause.reads_specimen else {}
            assert cause.apply is not None, "a cause without apply is a keyword of the simulator"
            changed = cause.apply(size, *model, **more)
            model = changed if len(model) != 1 and isinstance(changed, tuple) else (changed,)
        return model[0] if len(model) == 1 else model


def check_causes(causes: Iterable[Cause], nuisance: Iterable[str] = ()) -> tuple[Cause, ...]:
    """The list as a tuple, after checking that it can be used.

    Raises
    ------
    TypeError
        For an entry that is no cause.
    InputError
        For an empty list, a name used twice, or a parameter that is also a nuisance input.
    """
    causes = (causes,) if isinstance(causes, Cause | str) else tuple(causes)
    if not causes:
        raise InputError("the list of causes is empty: a verdict is conditional on a list")
    names: list[str] = []
    for cause in causes:
        if not isinstance(cause, Cause):
            called = getattr(cause, "__name__", "")
            raise TypeError(f"a cause must be a Cause, such as causes.{called or 'gain'}(), got {called or cause!r}")
        if cause.name in names:
            raise InputError(f"the name {cause.name!r} is used by two causes")
        if cause.apply is None and cause.parameter in tuple(nuisance):
            raise InputError(
                f"cause {cause.name!r}: its parameter {cause.parameter!r} is also a measured nuisance input; "
                "a measured input is redrawn within its error and cannot be a free cause as well"
            )
        names.append(cause.name)
    return causes


def cause_pairs(causes: Sequence[Cause]) -> list[tuple[Cause, Cause]]:
    """All pairs that can act together, in list order.

    Two causes that set the same parameter of the simulator cannot: it takes one value of it.
    """
    out = []
    for i, first in enumerate(causes):
        for second in causes[i + 1 :]:
            if first.parameter != second.parameter or first.apply is not None or second.apply is not None:
                out.append((first, second))
    return out
