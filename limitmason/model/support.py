"""Supports: which of a block's six degrees of freedom are held."""

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass

from limitmason.checks import switch
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
    _: KW_ONLY
    translations: bool = False
    rotations: bool = False
    dofs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Take single degrees of freedom as a tuple, and check that something is held."""
        if not isinstance(self.dofs, Iterable):
            raise InputError(
                f"support of block {self.block!r}: dofs must be names out of {DEGREES_OF_FREEDOM}, got {self.dofs!r}"
            )
        for name in ("translations", "rotations"):
            switch(f"support of block {self.block!r}: {name}", getattr(self, name))
        names = (self.dofs,) if isinstance(self.dofs, str) else tuple(self.dofs)
        unknown = [d for d in names if d not in DEGREES_OF_FREEDOM]
        if unknown:
            raise InputError(
                f"support of block {self.block!r}: unknown degree of freedom {unknown[0]!r}; use any of "
                f"{DEGREES_OF_FREEDOM}"
            )
        object.__setattr__(self, "dofs", names)
        if not any(self.held):
            raise InputError(f"support of block {self.block!r} holds nothing: set translations, rotations or dofs")

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
