"""Loads as arrays: wrenches per block, where their forces act, and sums, parts and turned copies of them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import choice, finite, numbers
from limitmason.errors import InputError
from limitmason.geometry.rotation import axial
from limitmason.storage.frozen import ReadOnly

LARGEST = 1e30
"""Loads beyond it are errors of input [N, N m]: the squares of others are numbers."""

DEAD_LOADS = "dead loads"
"""Name of loads whose live part was taken away."""

_PARTS = ("dead", "live", "dead_arms", "live_arms")


@dataclass(frozen=True, eq=False)
class LoadArrays(ReadOnly):
    """What :class:`limitmason.model.load.Loads` holds.

    Parameters
    ----------
    dead, live : wrench of every block about its centroid, as it stands at first [N, N m], shape (n_blocks, 6)
    name : label of the load case
    dead_arms, live_arms : sum of r f^T, r from the centroid to the point of the force f [N m], shape (n_blocks, 3, 3);
        zero where not given, so that moments are couples
    """

    dead: Array
    live: Array
    name: str = ""
    dead_arms: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    live_arms: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))

    def __repr__(self) -> str:
        dead, live = (float(np.linalg.norm(w[:, :3], axis=1).sum()) for w in (self.dead, self.live))
        name = f" {self.name!r}" if self.name else ""
        return f"<Loads{name} on {len(self.dead)} blocks: dead {dead:.4g} N, live {live:.4g} N (sums of magnitudes)>"

    def __post_init__(self) -> None:
        """Check shapes and values."""
        for label in ("dead", "live"):
            wrench, arms = (numbers(f"{name} loads", getattr(self, name)) for name in (label, f"{label}_arms"))
            if wrench.ndim != 2 or wrench.shape[1] != 6:
                raise InputError(f"{label} loads must have shape (n_blocks, 6), got {wrench.shape}")
            # none given: moments are couples
            if not arms.size:
                arms = np.zeros((len(wrench), 3, 3))
            if arms.shape != (len(wrench), 3, 3):
                raise InputError(f"{label}_arms must have shape ({len(wrench)}, 3, 3), got {arms.shape}")
            both = np.hstack([wrench, arms.reshape(len(wrench), 9)])
            for bad, what in ((~np.isfinite(both), "not finite (NaN or infinite)"),
                              (np.abs(both) > LARGEST, f"beyond {LARGEST:g} N or N m")):
                if bad.any():
                    block = int(np.flatnonzero(bad.any(axis=1))[0])
                    raise InputError(f"{label} load of block number {block} is {what}")
            object.__setattr__(self, label, wrench)
            object.__setattr__(self, f"{label}_arms", arms)
        if self.dead.shape != self.live.shape:
            raise InputError(f"dead loads are given for {len(self.dead)} blocks, live loads for {len(self.live)}")

    def __add__(self, other: Self) -> Self:
        """Superpose dead with dead and live with live.

        Names are joined by "+".
        """
        if not isinstance(other, LoadArrays):
            return NotImplemented
        if len(self.dead) != len(other.dead):
            raise InputError(f"loads for {len(self.dead)} blocks and loads for {len(other.dead)} have no sum")
        name = " + ".join(n for n in (self.name, other.name) if n)
        return replace(self, name=name, **{k: getattr(self, k) + getattr(other, k) for k in _PARTS})

    def scaled(self, *, dead: float = 1.0, live: float = 1.0) -> Self:
        """Dead and live loads times a factor each.

        Parameters
        ----------
        dead, live : the factors [-]; where that takes the live load away the case is called "dead loads"
        """
        factor = {"dead": finite("dead", dead), "live": finite("live", live)}
        name = DEAD_LOADS if live == 0.0 and self.live.any() else self.name
        return replace(self, name=name, **{k: factor[k.removesuffix("_arms")] * getattr(self, k) for k in _PARTS})

    def of_blocks(self, order: ArrayLike) -> Self:
        """The loads of some blocks in a given order.

        They are those of a renumbered or smaller assembly.

        Parameters
        ----------
        order : numbers of the blocks in this assembly, by their new numbers
        """
        given = numbers("order", order)
        marks = np.asarray(order).dtype == bool
        if marks or given.ndim != 1 or not ((given >= 0) & (given < len(self.dead)) & (given == np.round(given))).all():
            raise InputError(f"order must be numbers of blocks, 0 to {len(self.dead) - 1}, got {order!r}")
        rows = given.astype(np.intp)
        return replace(self, **{k: getattr(self, k)[rows] for k in _PARTS})

    def transformed(self, matrix: ArrayLike) -> Self:
        """The loads turned or mirrored together with their assembly.

        See ``Assembly.transformed``.

        Parameters
        ----------
        matrix : orthogonal, shape (3, 3)
        """
        m = numbers("matrix", matrix)
        if m.shape != (3, 3) or not np.allclose(m @ m.T, np.eye(3), atol=1e-9):
            raise InputError("matrix must be an orthogonal 3 x 3 matrix: a rotation or a mirror")
        turned: dict[str, Any] = {}
        for case in ("dead", "live"):
            wrench, arms = getattr(self, case), getattr(self, f"{case}_arms")
            # moments are axial vectors, which a mirror turns round
            turned[case] = np.hstack([wrench[:, :3] @ m.T, np.linalg.det(m) * wrench[:, 3:] @ m.T])
            turned[f"{case}_arms"] = m @ arms @ m.T
        return replace(self, **turned)

    def rows(self, case: str) -> Array:
        """Wrenches with the arms behind them [N, N m], shape (n_blocks, 15).

        The arms follow row by row.

        ``case`` is "dead" or "live".
        """
        choice("case", case, ("dead", "live"))
        return np.hstack([getattr(self, case), getattr(self, f"{case}_arms").reshape(-1, 9)])

    def wrench_at(self, case: str, turn: Array) -> Array:
        """Dead or live wrenches of blocks that have turned and strained [N, N m], shape (n_blocks, 6).

        Forces keep their direction, their points turn with the block.

        Parameters
        ----------
        case : "dead" or "live"
        turn : F - I of every block, F r where a point at r from the centroid is now; R - I where it is rigid, shape
            (n_blocks, 3, 3)
        """
        wrench = np.array(getattr(self, case))
        wrench[:, 3:] += axial(turn @ getattr(self, f"{case}_arms"))
        return wrench

    def points(self, case: str) -> Array:
        """Where the resultant of every block acts [m], shape (n_blocks, 3).

        From the block's centroid, of the dead or of the live load.

        Of parallel forces their centre. Of a couple and a force the point of the line of action nearest the centroid.
        Zero where no force acts. ``case`` is "dead" or "live".
        """
        choice("case", case, ("dead", "live"))
        wrench, arms = getattr(self, case), getattr(self, f"{case}_arms")
        force, moment = wrench[:, :3], wrench[:, 3:]
        square = (force**2).sum(axis=1, keepdims=True)
        per_square = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0.0)
        # sum of r (f . F) / F^2, then across the force by what of the moment that point leaves over
        centre = np.einsum("nij,nj->ni", arms, force) * per_square
        return np.asarray(centre + np.cross(force, moment - np.cross(centre, force)) * per_square)
