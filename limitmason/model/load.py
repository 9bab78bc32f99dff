"""Loads: a dead wrench per block, and a live one that the multiplier scales."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.checks import choice, finite, not_negative, numbers
from limitmason.errors import InputError
from limitmason.model.applied_forces import AppliedForces
from limitmason.model.axles import axle_forces
from limitmason.model.backfill import backfill_forces
from limitmason.model.input import read_direction, read_fixed, read_vector
from limitmason.model.load_arrays import DEAD_LOADS, LARGEST, LoadArrays
from limitmason.model.patch_pressure import patch_forces
from limitmason.model.plausibility import warn_of_point
from limitmason.model.pressure import Pressure, side_forces

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly

SELF_WEIGHT = "self weight"
"""Name of loads without a live part, as :meth:`Loads.weight` makes them."""

_OTHERS = " and others"


@dataclass(frozen=True, eq=False)
class Loads(LoadArrays):
    r"""Dead and live loads.

    The structure carries dead + lambda live. Forces keep their direction as blocks move, and their points move along:

    .. math:: M(R) = M_0 + \sum_i \bigl((R - I) r_i\bigr) \times f_i

    Parameters
    ----------
    dead, live : wrench of every block about its centroid, as it stands at first [N, N m], shape (n_blocks, 6)
    name : label of the load case
    dead_arms, live_arms : where the forces act: sum of r f^T, r from the centroid to the point of the force f [N m],
        shape (n_blocks, 3, 3). The methods below fill them. Without them a moment is a couple, which stays as it is

    Notes
    -----
    Loads on held degrees of freedom go straight to the support and do not count.
    """

    @classmethod
    def weight(cls, assembly: Assembly) -> Loads:
        """Self weight as dead load, nothing live yet.

        Add live loads with the ``with_`` methods.

        Parameters
        ----------
        assembly : its blocks are loaded, each at its centroid and along -z
        """
        _assembly(assembly)
        dead = np.zeros((assembly.n_blocks, 6))
        dead[:, 2] = -assembly.weights
        return cls(dead, np.zeros_like(dead), SELF_WEIGHT)

    @classmethod
    def body_force(cls, assembly: Assembly, direction: ArrayLike) -> Loads:
        """Self weight dead, and every block's weight turned to a direction as live load.

        Parameters
        ----------
        assembly : its blocks are loaded, each at its centroid
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
        assembly : its blocks are loaded, each at its centroid
        direction : horizontal vector, shape (3,); only its direction counts

        Raises
        ------
        InputError
            When the direction is zero, not finite, or not horizontal: 1e-9 of its length may be vertical by rounding.
        """
        d = read_vector("direction", direction)
        if abs(read_direction("direction", d)[2]) > 1e-9:
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
        assembly : as it stands on the level table; its blocks are loaded, each at its centroid
        axis : horizontal vector, shape (3,); only its direction counts

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

        A place clearly outside the block's box is warned of: it is often a wrong unit or block.

        Parameters
        ----------
        assembly : that these loads are for
        block : name or number
        force : in global axes [N], shape (3,)
        at : point of the block where the force acts [m], shape (3,); its centroid when not given
        case : "live" (scaled by the multiplier) or "dead"
        """
        self._check_fits(assembly)
        i = assembly.block_index(block)
        f = numbers(f"force on block {block!r}", force)
        if f.shape != (3,) or not (np.abs(f) < LARGEST).all():
            raise InputError(f"force on block {block!r} must be three finite numbers below {LARGEST:g}, got {force!r}")
        point = assembly.centroids[i] if at is None else read_vector("at", at)
        if at is not None and f.any():
            warn_of_point(assembly.blocks[i].name, point, assembly.blocks[i].bounds)
        forces = AppliedForces.none(assembly)
        forces.add(i, point, f)
        return self._with(forces, case, f"point load on {assembly.blocks[i].name}")

    def with_pressure(
        self,
        assembly: Assembly,
        block: int | str,
        *,
        pressure: float | None = None,
        level: float | None = None,
        unit_weight: float | None = None,
        traction: ArrayLike | None = None,
        face: str | tuple[float, float, float] = "top",
        case: str = "dead",
    ) -> Loads:
        """These loads and a load spread over one whole side of a block, with what other blocks cover of it.

        Water or earth presses with p + gamma (level - z) below its level, and with p above it.

        Parameters
        ----------
        assembly : that these loads are for
        block : name or number
        pressure : p, pushes into the face [Pa]; 0 where a level is given
        level : of the water or earth [m]
        unit_weight : gamma, growth of the pressure with depth [N/m3]; of earth its unit weight times its coefficient
        traction : load per area in global axes instead of a pressure [Pa], shape (3,)
        face : "top", "bottom", "+x", "-x", "+y", "-y" or an outward direction; all faces within 10 degrees of it
        case : "dead" or "live"

        Raises
        ------
        InputError
            When the block has no face on that side, or all of it above the level, or not exactly one of a pressure and
            a traction is given.

        Notes
        -----
        The force keeps its direction as the block turns; that of a fluid would turn with the face.
        """
        self._check_fits(assembly)
        i = assembly.block_index(block)
        on = f"block {assembly.blocks[i].name!r}"
        pushes = Pressure.read(on, "traction", pressure, level, unit_weight) if traction is None else None
        if pushes is None and (pressure, level, unit_weight) != (None, None, None):
            raise InputError(f"load on {on}: give either pressure or traction")
        forces = side_forces(assembly, i, face, pushes or read_vector("traction", traction))
        return self._with(forces, case, f"pressure on {assembly.blocks[i].name}")

    def with_patch_pressure(
        self,
        assembly: Assembly,
        corners: ArrayLike,
        *,
        pressure: float | None = None,
        level: float | None = None,
        unit_weight: float | None = None,
        force: float | None = None,
        case: str = "live",
    ) -> Loads:
        """These loads and a pressure on a flat patch across blocks.

        An airbag, water or earth presses so: with p + gamma (level - z) below its level, and with p above it. Faces in
        the plane of the patch, within the tolerance of contacts, are loaded wherever they lie within it, those that
        another block covers too: draw the patch over what is exposed.

        Parameters
        ----------
        assembly : that these loads are for
        corners : of the patch, convex, counter-clockwise seen from outside [m], shape (k, 3); it loads faces whose
            outward normal is its own
        pressure : p, pushes into the faces [Pa]; 0 where a level is given
        level : of the water or earth [m]
        unit_weight : gamma, growth of the pressure with depth [N/m3]
        force : resultant of an even pressure instead, positive into the faces [N]
        case : "live" (scaled by the multiplier) or "dead"

        Raises
        ------
        InputError
            When not exactly one of a pressure and a force is given, or no face lies in the patch and below the level.

        Notes
        -----
        The force is spread over the area of the faces within the patch, not over that of the patch: a pressure of 1 Pa
        is laid on and scaled by force / area. See :func:`limitmason.model.patch_pressure.patch_forces`.
        """
        self._check_fits(assembly)
        if force is None:
            pushes = Pressure.read("a patch", "force", pressure, level, unit_weight)
        elif (pressure, level, unit_weight) != (None, None, None):
            raise InputError("load on a patch: give either pressure or force")
        forces, area = patch_forces(assembly, corners, Pressure(1.0) if force is not None else pushes)
        factor = 1.0 if force is None else finite("force", force) / area
        return self._with(forces, case, "pressure on a patch", factor)

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
        assembly : that these loads are for
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
        Weight without strength, see :func:`limitmason.model.backfill.backfill_forces`.
        """
        self._check_fits(assembly)
        forces = backfill_forces(assembly, level, density, lateral=lateral, blocks=blocks)
        return self._with(forces, case, "fill")

    def with_axle(
        self,
        assembly: Assembly,
        at: float,
        force: float,
        *,
        level: float,
        spread_deg: float = 30.0,
        contact: float = 0.3,
        case: str = "live",
    ) -> Loads:
        """These loads and an axle on the fill over an arch.

        Its load spreads to the extrados and acts there.

        See :func:`limitmason.model.axles.axle_forces`.

        Parameters
        ----------
        assembly : that these loads are for, an arch in the x-z plane
        at : x of the axle [m]
        force : its load downwards over the whole width [N]
        level : top of the fill [m]
        spread_deg : angle by which the load spreads with depth, from the vertical [deg]
        contact : length of the wheels on the fill, along x [m]
        case : "live" or "dead"
        """
        self._check_fits(assembly)
        forces = axle_forces(
            assembly, finite("at", at), finite("force", force), level=finite("level", level), spread_deg=spread_deg,
            contact=contact,
        )
        return self._with(forces, case, f"axle at x = {at:.4g} m")

    def with_precompression(self, assembly: Assembly, force: float, *, block: int | str = "beam") -> Loads:
        """These loads and a vertical dead force at the centroid of the loading beam.

        Parameters
        ----------
        assembly : that these loads are for
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

        The force of a block is its weight times the vector, at its centroid.

        Parameters
        ----------
        assembly : that these loads are for
        direction : vector [-], shape (3,); its length is a factor on the weight
        blocks : names or numbers, or None for all
        case : "live" (scaled by the multiplier) or "dead"
        """
        self._check_fits(assembly)
        rows = range(assembly.n_blocks) if blocks is None else map(assembly.block_index, read_fixed(blocks, "blocks"))
        forces = AppliedForces.none(assembly)
        for i in rows:
            forces.force[i] = assembly.weights[i] * read_vector("direction", direction)
        return self._with(forces, case, "body force")

    def _check_fits(self, assembly: Assembly) -> None:
        """Refuse what is no assembly, and one of another number of blocks."""
        _assembly(assembly)
        if len(self.dead) != assembly.n_blocks:
            raise InputError(f"these loads are for {len(self.dead)} blocks, the assembly has {assembly.n_blocks}")

    def _with(self, forces: AppliedForces, case: str, what: str, factor: float = 1.0) -> Loads:
        """These loads and further forces, added to the dead or the live part.

        Loads that are called by their dead part take the name of the first live load. Further ones are "and others".

        Parameters
        ----------
        forces : to be added
        case : "dead" or "live"
        what : name of the forces
        factor : on the forces [-]
        """
        choice("case", case, ("dead", "live"))
        parts, name = {case: factor * forces.wrench, f"{case}_arms": factor * forces.arms}, self.name
        if case == "live" and parts["live"].any():
            if self.live.any():
                name = name if not name or name.endswith(_OTHERS) else name + _OTHERS
            elif name in (SELF_WEIGHT, DEAD_LOADS):
                name = what
        return replace(self, name=name, **{key: getattr(self, key) + part for key, part in parts.items()})


def _assembly(given: Any) -> None:
    """Refuse what is no assembly, by the class that it has."""
    if not hasattr(given, "n_blocks"):
        raise InputError(f"loads are made of an Assembly, got {given if given is None else type(given).__name__}")
