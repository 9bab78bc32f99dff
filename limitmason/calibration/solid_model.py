"""A solid as a model of a calibration: the parameters are properties of its masonry, and the mesh is made once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from limitmason.errors import InputError
from limitmason.model.material import FRACTURE

if TYPE_CHECKING:  # who calibrates joints need not wait for the finite elements
    from limitmason.continuum import Continuum


@dataclass(frozen=True, eq=False)
class SolidModel:
    """Model whose parameters are properties of masonry taken as a continuum.

    Parameters
    ----------
    solid : with the properties that are not fitted
    run : ``run(solid)`` returning numbers, sequences and curves by name, or a curve: that of
        ``limitmason.continuum.push(solid, ...)`` on a coarse mesh, or its frequencies
    of : which property of which materials a parameter is, {"upper_modulus": ("young_modulus", [1])}; without it
        parameters are called as the properties, and all materials have them

    Raises
    ------
    InputError
        For an unknown property, and a number that no material has.

    Notes
    -----
    What a mesh does to the answer goes into the parameters: fit on the mesh on which they will be used, or state the
    change on a finer one. Fracture energy is told by the fall after the peak, hardly by the peak of a small specimen.
    A strength without its energy, or the other way round, is refused by the material.
    """

    solid: Continuum
    run: Callable[[Continuum], Any]
    of: Mapping[str, tuple[str, Sequence[int]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the materials have what is named."""
        count, known = len(self.solid.materials), self._properties
        for name, (prop, numbers) in self.of.items():
            if prop not in known:
                raise InputError(f"{name!r}: masonry has no {prop!r}; it has {', '.join(known)}")
            for k in numbers:
                if not 0 <= k < count:
                    raise InputError(f"{name!r}: there is no material {k}; the solid has 0 to {count - 1}")

    @property
    def _properties(self) -> tuple[str, ...]:
        """Names of the properties of masonry, as its material has them."""
        return ("young_modulus", "poisson_ratio", "density", "tensile_strength", *FRACTURE)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names that it takes."""
        return tuple(self.of) or self._properties

    def with_parameters(self, **values: float) -> Continuum:
        """The solid with these properties of its masonry.

        Parameters
        ----------
        values : in the units of the properties, by name of the parameter

        Raises
        ------
        InputError
            For a name that it does not take, and values that no masonry may have.
        """
        changes: list[dict[str, Any]] = [{} for _ in self.solid.materials]
        for name, value in values.items():
            if name not in self.parameters:
                raise InputError(f"the model does not take {name!r}; it takes {', '.join(self.parameters)}")
            prop, numbers = self.of.get(name, (name, ()))
            for k in numbers or range(len(changes)):
                changes[k][prop] = value
        materials = tuple(replace(m, **own) for m, own in zip(self.solid.materials, changes, strict=True))
        return replace(self.solid, materials=materials)

    def __call__(self, **values: float) -> Any:
        """The answer at these properties."""
        return self.run(self.with_parameters(**values))
