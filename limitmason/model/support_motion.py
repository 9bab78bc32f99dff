"""How a group of held blocks moves as one: a translation and a turn about a point."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.model.blockwork import Blockwork
from limitmason.model.input import read_vector
from limitmason.model.support import DEGREES_OF_FREEDOM

Group = int | str | Sequence[int | str]
"""A block by name or number, or several that move as one."""


@dataclass(frozen=True)
class SupportMotion:
    r"""Displacement of a group of held blocks that move as one.

    It is a translation and a turn about a point.

    .. math:: u(x) = \tau + \omega \times (x - p)

    Parameters
    ----------
    translation : tau [m], shape (3,)
    rotation : omega, small, right-hand rule [rad], shape (3,)
    about : p, the point that the turn leaves in place [m], shape (3,)

    Raises
    ------
    InputError
        Naming the part that is no vector, or when nothing moves.

    Notes
    -----
    Wrong for large turns: the field is linear in omega.
    """

    translation: Sequence[float] = (0.0, 0.0, 0.0)
    rotation: Sequence[float] = (0.0, 0.0, 0.0)
    about: Sequence[float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check the parts."""
        for name in ("translation", "rotation", "about"):
            part = read_vector(f"{name} of a support's motion", getattr(self, name))
            object.__setattr__(self, name, tuple(part.tolist()))
        if not any((*self.translation, *self.rotation)):
            raise InputError("a support's motion moves nothing: give translation or rotation")

    def twist(self, point: Array) -> Array:
        """Displacement of a point [m], shape (3,), and the turn: [m, rad], shape (6,)."""
        arm = np.asarray(point) - self.about
        return np.concatenate([self.translation + np.cross(self.rotation, arm), self.rotation])

    def displacements(self, assembly: Blockwork, support: Group) -> dict[str, dict[str, float]]:
        """Displacement of every block of a group about its centroid [m, rad].

        By block name and degree of freedom, as ``dem.Drive`` takes it. A support that holds some freedoms alone moves
        in these; of a block that is not held at all every freedom is driven.

        Parameters
        ----------
        assembly : that has the blocks
        support : the group
        """
        out = {}
        for i in group_of(assembly, support):
            held = assembly.held[i] if assembly.held[i].any() else np.ones(6, dtype=bool)
            moves = zip(DEGREES_OF_FREEDOM, self.twist(assembly.centroids[i]).tolist(), held, strict=True)
            out[assembly.blocks[i].name] = {name: value for name, value, driven in moves if driven}
        return out


def group_of(assembly: Blockwork, support: Group) -> list[int]:
    """Numbers of the blocks of a group.

    Parameters
    ----------
    assembly : that has the blocks
    support : the group, as a user gives it

    Raises
    ------
    InputError
        For a group without blocks, one that names a block twice, or one of several blocks that are not all wholly held.
    """
    named = list(support) if isinstance(support, Collection) and not isinstance(support, str) else [support]
    group = [] if support is None else [assembly.block_index(block) for block in named]
    if not group or len(set(group)) < len(group):
        raise InputError(f"support: give one block, or a list of different ones that settle as one; got {support!r}")
    # one block moves in what is held of it; several move as one body only if all of each is held
    for k in group if len(group) > 1 else ():
        if not assembly.fixed[k]:
            raise InputError(f"block {assembly.blocks[k].name!r} is not wholly held: blocks that settle as one must be")
    return group
