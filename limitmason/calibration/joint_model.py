"""A structure as a model of a calibration: the parameters are properties of its joints, and any method runs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from limitmason.errors import InputError
from limitmason.methods import get_method
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

PROPERTIES = tuple(f.name for f in fields(Joint) if f.name != "name")


@dataclass(frozen=True, eq=False)
class JointModel:
    """Model whose parameters are properties of joints.

    Parameters
    ----------
    assembly : with the properties that are not fitted
    run : name of a method ("limit", "associative", "non-associative", "dem", "mechanisms"), whose multiplier is the
        answer "multiplier"; or ``run(assembly)`` returning numbers, sequences and curves by name, or a curve:
        ``lambda wall: lm.pushover(wall, ...)``, frequencies, a driven test
    loads : for a method by name
    of : which property of which kinds of joints a parameter is, {"bed_cohesion": ("cohesion", ["bed"])}; without it
        parameters are called as the properties, and all joints have them
    options : of the method

    Raises
    ------
    InputError
        For an unknown property, a kind that no joint has, two parameters of one property, an unknown method, and one
        without loads.
    """

    assembly: Assembly
    run: str | Callable[[Assembly], Any]
    loads: Loads | None = None
    of: Mapping[str, tuple[str, Sequence[str]]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the joints have what is named."""
        kinds = {i.kind for i in self.assembly.interfaces}
        taken: dict[tuple[str, str], str] = {}  # parameter by property and kind
        for name, said in self.of.items():
            if isinstance(said, str) or len(said) != 2 or isinstance(said[1], str):
                raise InputError(f"{name!r}: write (property, [kinds]), as in ('cohesion', ['bed']), got {said!r}")
            prop, where = said
            if prop not in PROPERTIES:
                raise InputError(f"{name!r}: a joint has no {prop!r}; it has {', '.join(PROPERTIES)}")
            for kind in where:
                if kind not in kinds:
                    raise InputError(f"{name!r}: no joint is of kind {kind!r}; kinds: {', '.join(sorted(kinds))}")
            for kind in where or kinds:
                if (other := taken.setdefault((prop, kind), name)) != name:
                    raise InputError(f"{other!r} and {name!r} are both the {prop} of {kind} joints: one would be lost")
        if isinstance(self.run, str):
            get_method(self.run)  # an unknown name is refused at once
            if self.loads is None:
                raise InputError(f"method {self.run!r} needs loads=")
        elif self.loads is not None or self.options:
            raise InputError("loads and options go with a method by name; a function has its own")

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names that it takes."""
        return tuple(self.of) or PROPERTIES

    def with_parameters(self, **values: float) -> Assembly:
        """The structure with these properties of its joints.

        Parameters
        ----------
        values : in the units of the properties, by name of the parameter

        Raises
        ------
        InputError
            For a name that it does not take, and values that no joint may have.
        """
        for name in values:
            if name not in self.parameters:
                raise InputError(f"the model does not take {name!r}; it takes {', '.join(self.parameters)}")
        changed = []
        for i in self.assembly.interfaces:
            own: dict[str, Any] = {}
            for name, value in values.items():
                prop, kinds = self.of.get(name, (name, ()))
                if not kinds or i.kind in kinds:
                    own[prop] = value
            changed.append(replace(i, joint=replace(i.joint, **own)))
        return self.assembly.with_interfaces(changed)

    def __call__(self, **values: float) -> Any:
        """The answer of the method at these properties."""
        wall = self.with_parameters(**values)
        if not isinstance(self.run, str):
            return self.run(wall)
        assert self.loads is not None
        method = get_method(self.run)
        return method.predict(wall, self.loads, **method.one_of_many(self.options))
