"""Supports: which of a block's six degrees of freedom are held."""

from collections.abc import Iterable
from dataclasses import dataclass

from limitmason.errors import InputError

DEGREES_OF_FREEDOM = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Support:
    """Held degrees of freedom of one block.

    They are about its centroid and along the global axes.

    Parameters
    ----------
    block : block name or number
    translations : hold x, y and z
    rotations : hold rx, ry and rz
    dofs : further single ones out of "x", "y", "z", "rx", "ry", "rz"

    Raises
    ------
    InputError
        For an unknown degree of freedom, or when nothing is held.
    """

    block: int | str
    translations: bool = False
    rotations: bool = False
    dofs: tuple[str, ...] = ()

    def __init__(
        self, block: int | str, *, translations: bool = False, rotations: bool = False, dofs: Iterable[str] = ()
    ) -> None:
        names = (dofs,) if isinstance(dofs, str) else tuple(dofs)
        unknown = [d for d in names if d not in DEGREES_OF_FREEDOM]
        if unknown:
            raise InputError(
                f"support of block {block!r}: unknown degree of freedom {unknown[0]!r}; use any of {DEGREES_OF_FREEDOM}"
            )
        object.__setattr__(self, "block", block)
        object.__setattr__(self, "translations", bool(translations))
        object.__setattr__(self, "rotations", bool(rotations))
        object.__setattr__(self, "dofs", names)
        if not any(self.held):
            raise InputError(f"support of block {block!r} holds nothing: set translations, rotations or dofs")

    @classmethod
    def fixed(cls, block: int | str) -> "Support":
        """All six degrees of freedom held."""
        return cls(block, translations=True, rotations=True)

    @property
    def held(self) -> tuple[bool, ...]:
        """Flag per degree of freedom in the order x, y, z, rx, ry, rz."""
        return tuple(
            (self.translations if i < 3 else self.rotations) or name in self.dofs
            for i, name in enumerate(DEGREES_OF_FREEDOM)
        )
