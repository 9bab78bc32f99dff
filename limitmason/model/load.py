"""Loads: a dead wrench per block, and a live one that the multiplier scales."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import choice, finite, not_negative, numbers
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import face_plane
from limitmason.model.backfill import backfill_wrenches
from limitmason.model.input import read_direction, read_vector
from limitmason.model.patch import patch_wrenches
from limitmason.model.plausibility import warn_of_point, warn_of_pressure
from limitmason.storage.frozen import ReadOnly

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly


LARGEST = 1e30
"""Loads beyond it are errors of input [N, N m]: the squares of others are numbers."""

_SIDES = {
    "top": (0, 0, 1), "bottom": (0, 0, -1), "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0),
    "+z": (0, 0, 1), "-z": (0, 0, -1),
}


@dataclass(frozen=True, eq=False)
class Loads(ReadOnly):
    """Dead and live loads.

    The structure carries dead + lambda live.

    Parameters
    ----------
    dead, live : wrench of every block about its centroid [N, N m], shape (n_blocks, 6)
    name : label of the load case

    Notes
    -----
    Loads on held degrees of freedom go straight to the support and do not count.
    """

    dead: Array
    live: Array
    name: str = ""

    def __repr__(self) -> str:
        dead, live = (float(np.linalg.norm(w[:, :3], axis=1).sum()) for w in (self.dead, self.live))
        name = f" {self.name!r}" if self.name else ""
        return f"<Loads{name} on {len(self.dead)} blocks: dead {dead:.4g} N, live {live:.4g} N (sums of magnitudes)>"

    def __post_init__(self) -> None:
        """Check shapes and values."""
        for label in ("dead", "live"):
            wrench = np.array(getattr(self, label), dtype=float)
            if wrench.ndim != 2 or wrench.shape[1] != 6:
                raise InputError(f"{label} loads must have shape (n_blocks, 6), got {wrench.shape}")
            if not np.isfinite(wrench).all():
                block = int(np.flatnonzero(~np.isfinite(wrench).all(axis=1))[0])
                raise InputError(f"{label} load of block number {block} is not finite (NaN or infinite)")
            if (np.abs(wrench) > LARGEST).any():
                block = int(np.argmax(np.abs(wrench).max(axis=1)))
                raise InputError(f"{label} load of block number {block} is beyond {LARGEST:g} N or N m")
            object.__setattr__(self, label, wrench)
        if self.dead.shape != self.live.shape:
            raise InputError(f"dead loads are given for {len(self.dead)} blocks, live loads for {len(self.live)}")

    @classmethod
    def weight(cls, assembly: Assembly) -> Loads:
        """Self weight as dead load, nothing live yet.

        Add live loads with the ``with_`` methods.
        """
        if not hasattr(assembly, "n_blocks"):
            raise InputError(f"loads are made of an Assembly, got {type(assembly).__name__}")
        dead = np.zeros((assembly.n_blocks, 6))
        dead[:, 2] = -assembly.weights
        return cls(dead, np.zeros_like(dead), "self weight")

    @classmethod
    def body_force(cls, assembly: Assembly, direction: ArrayLike) -> Loads:
        """Self weight dead, and every block's weight turned to a direction as live load.

        Parameters
        ----------
        direction : any vector but zero, shape (3,); only its direction counts
        """
        d = read_direction("direction", direction)
        base = cls.weight(assembly)
        live = np.zeros_like(base.dead)
        live[:, :3] = assembly.weights[:, None] * d
        return cls(base.dead, live, f"body force along ({d[0]:.4g}, {d[1]:.4g}, {d[2]:.4g})")

    @classmethod
    def horizontal(cls, assembly: Assembly, direction: ArrayLike = (1.0, 0.0, 0.0)) -> Loads:
        """Self weight dead, the same weight sideways live: lambda = a_h / g.

        For cohesionless joints without crushing the collapse multiplier equals tan(tilt angle) exactly.

        Parameters
        ----------
        direction : horizontal vector, shape (3,)

        Raises
        ------
        InputError
            When the direction is zero, not finite or not horizontal.
        """
        d = read_vector("direction", direction)
        if abs(d[2]) > 1e-9 * np.linalg.norm(d):
            raise InputError(
                f"direction {tuple(float(x) for x in d)} is not horizontal; use Loads.body_force for an inclined one"
            )
        return replace(cls.body_force(assembly, d), name=f"horizontal ({d[0]:.4g}, {d[1]:.4g}, 0)")

    @classmethod
    def tilting(cls, assembly: Assembly, axis: ArrayLike = (0.0, 1.0, 0.0)) -> Loads:
        """Loads of a tilting table.

        lambda = tan(tilt angle) for joints without cohesion, tension and crushing.

        The table turns by alpha about a horizontal axis (right-hand rule). Seen from the table the weight W turns the
        other way: W (-cos(alpha) z + sin(alpha) d) with d = axis x z, that is cos(alpha) (dead + tan(alpha) live).

        Parameters
        ----------
        axis : horizontal vector, shape (3,)

        Raises
        ------
        InputError
            When the axis is not horizontal: the weight then runs over a cone, and no single multiplier describes it.

        Notes
        -----
        With cohesion, tension or crushing the common factor cos(alpha) does not cancel: lambda is then the multiplier
        of the horizontal load on an upright structure, not the tangent of the angle.
        """
        a = read_direction("axis", axis)
        if abs(a[2]) > 1e-9:
            raise InputError(f"tilting axis {tuple(float(x) for x in a)} is not horizontal")
        sideways = cls.horizontal(assembly, np.cross(a, (0.0, 0.0, 1.0)))
        return replace(sideways, name=f"tilting about ({a[0]:.4g}, {a[1]:.4g}, 0)")

    def with_point_load(
        self,
        assembly: Assembly,
        block: int | str,
        force: ArrayLike,
        *,
        at: ArrayLike | None = None,
        case: str = "live",
    ) -> Loads:
        """These loads and a point load on one block.

        Parameters
        ----------
        block : name or number
        force : [N], shape (3,)
        at : point of application [m], shape (3,); the block's centroid when not given. Paths and histories keep the
            force and its moment about the centroid while the block turns: what rests on a block that turns far is
            better a block of its own
        case : "live" (scaled by the multiplier) or "dead"
        """
        i = assembly.block_index(block)
        f = numbers(f"force on block {block!r}", force)
        if f.shape != (3,) or not (np.abs(f) < LARGEST).all():
            raise InputError(f"force on block {block!r} must be three finite numbers below {LARGEST:g}, got {force!r}")
        arm = np.zeros(3) if at is None else read_vector("at", at) - assembly.centroids[i]
        if at is not None and f.any():
            warn_of_point(assembly.blocks[i].name, arm + assembly.centroids[i], assembly.blocks[i].bounds)
        wrench = np.zeros((assembly.n_blocks, 6))
        wrench[i] = np.concatenate([f, np.cross(arm, f)])
        return self._plus(assembly, wrench, case)

    def with_pressure(
        self,
        assembly: Assembly,
        block: int | str,
        *,
        pressure: float | None = None,
        traction: ArrayLike | None = None,
        face: str | tuple[float, float, float] = "top",
        case: str = "dead",
    ) -> Loads:
        """These loads and a load spread over one side of a block.

        Parameters
        ----------
        block : name or number
        pressure : pushes into the face [Pa]
        traction : load per area in global axes instead of a pressure [Pa], shape (3,)
        face : "top", "bottom", "+x", "-x", "+y", "-y" or an outward direction; all faces within 10 degrees of it
        case : "dead" or "live"

        Raises
        ------
        InputError
            When the block has no face on that side, or not exactly one of pressure and traction is given.
        """
        i = assembly.block_index(block)
        if (pressure is None) == (traction is None):
            raise InputError(f"load on block {block!r}: give either pressure or traction")
        if isinstance(face, str) and face not in _SIDES:
            raise InputError(f"face {face!r} is not one of {tuple(_SIDES)} or a direction of three numbers")
        outward = read_direction("face", _SIDES[face] if isinstance(face, str) else face)
        if pressure is not None:
            warn_of_pressure(f"block {assembly.blocks[i].name!r}", finite("pressure", pressure))
        per_unit = None if traction is None else read_vector("traction", traction)
        wrench = np.zeros((assembly.n_blocks, 6))
        found = False
        for corners in assembly.blocks[i].faces:
            normal, _ = face_plane(corners)
            if normal @ outward < np.cos(np.deg2rad(10.0)):
                continue
            found = True
            r = corners - corners[0]
            # areas [m2] of a fan of triangles from the first corner
            triangle = 0.5 * np.cross(r[1:-1], r[2:]) @ normal
            centre = corners[0] + (triangle[:, None] * (r[1:-1] + r[2:]) / 3.0).sum(axis=0) / triangle.sum()
            force = (-float(pressure or 0.0) * normal if per_unit is None else per_unit) * triangle.sum()
            wrench[i] += np.concatenate([force, np.cross(centre - assembly.centroids[i], force)])
        if not found:
            raise InputError(f"block {assembly.blocks[i].name!r} has no face towards {face!r}")
        return self._plus(assembly, wrench, case)

    def with_patch_pressure(
        self,
        assembly: Assembly,
        corners: ArrayLike,
        *,
        pressure: float | None = None,
        force: float | None = None,
        case: str = "live",
    ) -> Loads:
        """These loads and an even pressure on a flat patch across blocks, as of an airbag.

        Faces in the plane of the patch are loaded wherever they lie within it, those that another block covers too:
        draw the patch over what is exposed.

        Parameters
        ----------
        corners : of the patch, counter-clockwise seen from outside [m], shape (k, 3); see
            :func:`limitmason.model.patch.patch_wrenches`
        pressure : pushes into the faces [Pa]
        force : resultant of the pressure on the faces instead [N]
        case : "live" or "dead"

        Raises
        ------
        InputError
            When not exactly one of pressure and force is given, or no face lies in the patch.
        """
        if (pressure is None) == (force is None):
            raise InputError("load on a patch: give either pressure or force")
        if pressure is not None:
            warn_of_pressure("a patch", finite("pressure", pressure))
        wrench, area = patch_wrenches(assembly, corners, pressure=1.0 if pressure is None else pressure)
        if force is not None:
            wrench = wrench * (finite("force", force) / area)
        return self._plus(assembly, wrench, case)

    def with_backfill(
        self,
        assembly: Assembly,
        level: float,
        density: float,
        *,
        lateral: float = 0.0,
        blocks: Iterable[int | str] | None = None,
        case: str = "dead",
    ) -> Loads:
        """These loads and the weight of fill on every bare face that looks up.

        Such fill lies over the haunches of a vault.

        Parameters
        ----------
        level : of the top of the fill [m]
        density : of the fill [kg/m3]
        lateral : horizontal over vertical stress in the fill; 0 for weight alone. It acts on inclined faces alone
        blocks : that carry the fill, all free ones by default
        case : "dead" or "live"

        Raises
        ------
        InputError
            When the fill reaches no face, or only level ones, on which lateral would do nothing.

        Notes
        -----
        Weight without strength, see :func:`limitmason.model.backfill.backfill_wrenches`.
        """
        wrench = backfill_wrenches(assembly, level, density, lateral=lateral, blocks=blocks)
        return self._plus(assembly, wrench, case)

    def with_precompression(self, assembly: Assembly, force: float, *, block: int | str = "beam") -> Loads:
        """These loads and a vertical dead force at the centroid of the loading beam.

        Parameters
        ----------
        force : downwards [N], >= 0
        block : the loading beam, a block named "beam" by default (``build.wall(..., top_beam=...)`` makes one)
        """
        down = not_negative("precompression force", force)
        return self.with_point_load(assembly, block, (0.0, 0.0, -down), case="dead")

    def with_body_force(
        self,
        assembly: Assembly,
        direction: ArrayLike,
        *,
        blocks: Iterable[int | str] | None = None,
        case: str = "live",
    ) -> Loads:
        """These loads and the weight of named blocks turned to a direction.

        All blocks by default.

        Parameters
        ----------
        direction : shape (3,); its length is a factor on the weight
        blocks : names or numbers, or None for all
        """
        rows: Iterable[int] = range(assembly.n_blocks) if blocks is None else [assembly.block_index(b) for b in blocks]
        wrench = np.zeros((assembly.n_blocks, 6))
        for i in rows:
            wrench[i, :3] = assembly.weights[i] * read_vector("direction", direction)
        return self._plus(assembly, wrench, case)

    def _plus(self, assembly: Assembly, wrench: Array, case: str) -> Loads:
        choice("case", case, ("dead", "live"))
        if len(self.dead) != assembly.n_blocks:
            raise InputError(f"these loads are for {len(self.dead)} blocks, the assembly has {assembly.n_blocks}")
        return replace(self, **{case: getattr(self, case) + wrench})

    def __add__(self, other: Loads) -> Loads:
        """Superpose dead with dead and live with live."""
        if not isinstance(other, Loads):
            return NotImplemented
        name = " + ".join(n for n in (self.name, other.name) if n)
        return Loads(self.dead + other.dead, self.live + other.live, name)

    def scaled(self, *, dead: float = 1.0, live: float = 1.0) -> Loads:
        """Dead and live loads times a factor each."""
        return replace(self, dead=finite("dead", dead) * self.dead, live=finite("live", live) * self.live)
