"""The joint law in one compiled form: what limit analysis, certificates, virtual work, bounds and the DEM all read.

|T| <= c + tan(phi) N,  N >= -t with t = min(ft, c / tan(phi)),  N <= fc;  a sliding point opens by tan(psi) per slip.

The tension corner t is worked out here and nowhere else: where ft > c / tan(phi) the apex of the Coulomb cone is the
cut-off, since what limit analysis takes is convex. Distinct elements take ft itself (``convex=False``): beyond the apex
a point carries tension up to ft and no shear. Counted from the corner, N' = N + t, the convex law reads
|T| <= c' + tan(phi) N', 0 <= N' <= q with c' = c - tan(phi) t >= 0 and q = fc + t. Compression is positive; c, t and fc
are strengths [Pa], or forces [N] once the law is taken :meth:`PointLaw.over` tributary areas. Which theory takes which
term stands in :mod:`limitmason.mechanics.law_table`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array, Flags, Index
from limitmason.errors import InputError
from limitmason.model.arrays import AssemblyArrays
from limitmason.model.joint import Joint, LostBy
from limitmason.model.material import Material

BELOW_THE_APEX = 1e-12
"""Part of the cohesion that friction must leave at the tension corner for it to lie below the apex, beyond rounding."""


def tension_corner(tensile_strength: Array, cohesion: Array, tan_phi: Array) -> Array:
    """Tension that a point can carry, t = min(ft, c / tan(phi)), shape (m,), or ft where there is no friction.

    Parameters
    ----------
    tensile_strength, cohesion : ft and c, both [Pa] or both [N], shape (m,)
    tan_phi : [-], shape (m,)
    """
    cohesion, tan_phi = np.asarray(cohesion, dtype=float), np.asarray(tan_phi, dtype=float)
    apex = np.divide(cohesion, tan_phi, out=np.full(np.shape(cohesion), np.inf), where=tan_phi > 0.0)
    return np.minimum(tensile_strength, apex)


def unit_tension(material: Material) -> float:
    """Largest tensile stress of a unit's zones, ft or the apex of its Mohr-Coulomb cone [Pa].

    It is infinite if the unit is elastic.
    """
    if material.cohesion is None:
        # a material without cohesion has no yield law: its zones stay elastic
        return np.inf
    strength = np.inf if material.tensile_strength is None else material.tensile_strength
    return float(tension_corner(np.array(strength), np.array(material.cohesion), np.array(material.tan_phi)))


LOST = ("tan_phi", "tan_psi", "cohesion", "tension")
"""Columns of the law that go from peak to residual values; crushing stays."""


class PointLaw(NamedTuple):
    """The law at m contact points: strengths [Pa] or capacities [N], shape (m,).

    Strengths are per interface, capacities over tributary areas.
    """

    tan_phi: Array  # friction [-]
    tan_psi: Array  # opening per slip, the dilatancy [-]
    cohesion: Array  # c
    tension: Array  # t, the tension corner, positive
    crushing: Array  # fc, positive and infinite without crushing

    @property
    def apex(self) -> Array:
        """Tension at the tip of the Coulomb cone, c / tan(phi), or infinite without friction."""
        return tension_corner(np.full(np.shape(self.cohesion), np.inf), self.cohesion, self.tan_phi)

    @property
    def cut_off(self) -> Flags:
        """Points whose tension corner is a cut-off below the apex, so that the cone alone does not limit tension."""
        smooth = (self.tan_phi == 0.0) & (self.cohesion == 0.0)  # no cone is left: only N >= -t limits tension
        return (self.tan_phi * self.tension < (1.0 - BELOW_THE_APEX) * self.cohesion) | smooth

    @property
    def crushes(self) -> Flags:
        """Points with a finite compressive strength."""
        return np.isfinite(self.crushing)

    @property
    def corner_cohesion(self) -> Array:
        """Shear strength at the tension corner, c' = c - tan(phi) t >= 0."""
        return np.maximum(self.cohesion - self.tan_phi * self.tension, 0.0)

    @property
    def corner_crushing(self) -> Array:
        """Largest normal force counted from the tension corner, q = fc + t."""
        return self.crushing + self.tension

    def from_corner(self) -> "PointLaw":
        """This law of N' = N + t: cohesion c', no tension, crushing at q, and psi never above phi."""
        return self._replace(
            tan_psi=np.minimum(self.tan_psi, self.tan_phi), cohesion=self.corner_cohesion,
            tension=np.zeros(np.shape(self.tension)), crushing=self.corner_crushing,
        )

    def over(self, area: Array) -> "PointLaw":
        """Capacities [N] over tributary areas [m2], shape (m,), of a law given by strengths [Pa]."""
        # a point without area does not crush either: infinity times 0 would be NaN
        crushing = np.full(np.shape(self.crushing), np.inf)
        np.multiply(self.crushing, area, out=crushing, where=self.crushes)
        return self._replace(cohesion=self.cohesion * area, tension=self.tension * area, crushing=crushing)

    def in_units_of(self, force: Array | float) -> "PointLaw":
        """All capacities [N] over a force [N], one or one per point, shape (m,)."""
        return self._replace(
            cohesion=self.cohesion / force, tension=self.tension / force, crushing=self.crushing / force
        )

    def at(self, rows: NDArray) -> "PointLaw":
        """The law at some points, in the order asked for."""
        return PointLaw(*(column[rows] for column in self))

    def towards(self, rest: "PointLaw", damage: Array) -> "PointLaw":
        """The law of points on their way to residual values: peak values at damage 0, those of ``rest`` at 1.

        Parameters
        ----------
        rest : residual law of the same points
        damage : of every point, from 0 to 1 [-], shape (m,)
        """
        pairs = {name: (getattr(self, name), getattr(rest, name)) for name in LOST}
        return self._replace(**{name: peak + damage * (left - peak) for name, (peak, left) in pairs.items()})

    def without_crushing(self, rows: NDArray | None = None) -> "PointLaw":
        """The law with infinite compressive strength at some points, at all where none are named."""
        crushing = np.array(self.crushing)
        crushing[slice(None) if rows is None else rows] = np.inf
        return self._replace(crushing=crushing)

    def shear_strength(self, normal: Array) -> Array:
        """Largest shear under a normal force or stress, c + tan(phi) N, shape (m,).

        It is in the unit of the law, and negative beyond the apex.
        """
        return self.cohesion + self.tan_phi * normal

    def bears_shear(self, normal: Array) -> Flags:
        """Points with a shear strength under a normal force, shape (m,): none beyond the tip of the cone."""
        return np.asarray(self.shear_strength(normal) >= -BELOW_THE_APEX * self.cohesion)

    def excess(self, normal: Array, shear: Array) -> Array:
        """How far a force lies outside the law, the largest of its three conditions, shape (m,).

        It is in the unit of the law, and <= 0 inside.

        Parameters
        ----------
        normal : N, compression positive, in the unit of the law, shape (m,)
        shear : size of T, in the unit of the law, shape (m,)
        """
        strength = self.shear_strength(normal)
        # tension above the apex: there is no shear beyond it, and no less than none
        strength = np.where(self.tension > self.apex, np.maximum(strength, 0.0), strength)
        outside = np.maximum(shear - strength, -normal - self.tension)
        return np.maximum(outside, normal - self.crushing)

    def free_opening(self, opening: Array, slip: Array) -> Array:
        """Opening beyond what associative sliding needs, g = e_n - tan(phi) |e_t| [m/s], shape (m,)."""
        return opening - self.tan_phi * slip

    def dissipation(self, opening: Array, slip: Array) -> Array:
        """Power that the associative law dissipates in a motion [W], shape (m,).

        D = c |e_t| + t g for g >= 0 and c |e_t| - fc g for g < 0, of capacities [N]; without crushing g < 0 is no
        admissible motion and nothing is added for it.

        Parameters
        ----------
        opening, slip : e_n and |e_t| [m/s], shape (m,)
        """
        g = self.free_opening(opening, slip)
        power = self.cohesion * slip + np.where(g > 0, self.tension * g, 0.0)
        finite = self.crushes
        power[finite] += self.crushing[finite] * np.maximum(-g[finite], 0.0)
        return power

    def flow_residual(self, normal: Array, shear: Array, opening: Array, sliding: Array) -> tuple[Array, Array]:
        """What forces and rates violate of the flow rule with psi: rate [m/s] and power against it [W], both (m,).

        A point opens by tan(psi) per slip, or more with N = -t, or less with N = fc; and T = -(c + tan(phi) N) along
        the slip. The power is |(N + t) p| + |(fc - N) k| + |T . e_t + (c + tan(phi) N) |e_t||, where p and k are the
        opening beyond tan(psi) |e_t| and short of it. Where nothing crushes k is the violation of the rate, and its
        power |(N + t) k|. The law must be one of capacities [N], see :meth:`over`.

        Parameters
        ----------
        normal : N [N], shape (m,)
        shear, sliding : T [N] and e_t [m/s] in any axes, shape (m, d)
        opening : e_n [m/s], shape (m,)
        """
        slip = np.linalg.norm(sliding, axis=1)
        beyond = opening - self.tan_psi * slip  # [m/s], negative where it is short
        opposed = np.abs((shear * sliding).sum(axis=1) + self.shear_strength(normal) * slip)
        crushes = self.crushes
        power = np.abs((normal + self.tension) * np.where(crushes, np.maximum(beyond, 0.0), beyond))
        rest = (self.crushing - normal)[crushes]
        power[crushes] += np.abs(rest * np.maximum(-beyond[crushes], 0.0))
        return np.where(crushes, 0.0, np.maximum(-beyond, 0.0)), opposed + power

    def inside(self) -> "PointLaw":
        """The associative law with friction psi that lies inside this one and shares its tension corner.

        Its cohesion is c - (tan(phi) - tan(psi)) t: with the full cohesion the reduced cone would leave the true one
        where joints are in tension. Source: Radenkovic's second theorem.
        """
        return self.frozen(-self.tension)

    def frozen(self, normal: Array) -> "PointLaw":
        """The associative law with friction psi that has this one's shear strength under a given normal force.

        c := max(c + (tan(phi) - tan(psi)) N, 0), the step of Haslinger's fixed point for non-associated friction.

        Parameters
        ----------
        normal : N, compression positive, in the unit of the law, shape (m,)
        """
        fixed = np.maximum(self.cohesion + (self.tan_phi - self.tan_psi) * normal, 0.0)
        return self._replace(tan_phi=self.tan_psi, cohesion=fixed)


def above_apex(arrays: AssemblyArrays) -> Flags:
    """Which interfaces have more tensile strength than c / tan(phi), shape (k,)."""
    corner = tension_corner(arrays.tensile_strength, arrays.cohesion, arrays.tan_phi)
    return arrays.tensile_strength > corner / (1.0 - BELOW_THE_APEX)


def interface_law(arrays: AssemblyArrays, *, convex: bool = True) -> PointLaw:
    """The law of every interface by its strengths [Pa], shape (k,).

    Parameters
    ----------
    arrays : interfaces, or interfaces and ties
    convex : cut the tension at the apex; without, ft counts as it is, as in the DEM
    """
    ft = arrays.tensile_strength
    tension = tension_corner(ft, arrays.cohesion, arrays.tan_phi) if convex else ft
    return PointLaw(arrays.tan_phi, arrays.tan_psi, arrays.cohesion, tension, arrays.compressive_strength)


def peak_law(joints: Sequence[Joint], *, convex: bool = True) -> PointLaw:
    """The law of joints before they soften, strengths [Pa], shape (number of joints,).

    ``convex`` is that of :func:`interface_law`.
    """
    rows = [(j.tan_phi, j.tan_psi, j.cohesion, j.tensile_strength, j.compressive_strength) for j in joints]
    mu, psi, c, ft, fc = np.array(rows, dtype=float).reshape(-1, 5).T
    return PointLaw(mu, psi, c, tension_corner(ft, c, mu) if convex else ft, fc)


def residual_law(joints: Sequence[Joint], tan_psi: Array | None = None, *, convex: bool = True) -> PointLaw:
    """The law of joints after they have softened, strengths [Pa], shape (number of joints,).

    Values a joint does not name stay at their peak.

    Parameters
    ----------
    joints : one or more
    tan_psi : residual dilatancy [-], shape (number of joints,); that of the peak where omitted, never above the
        residual friction
    convex : cut the residual tension at the residual apex. Without, a residual tensile strength that is named counts
        as it is. One that is not named stays as it lies at the peak: beyond the apex it does not ask for cohesion,
        below it it ends with it
    """
    peak = peak_law(joints, convex=convex)

    def after(values: Sequence[float | None], before: Array) -> Array:
        """Residual values, those before softening where None is named."""
        return np.array([b if v is None else v for v, b in zip(values, before, strict=True)], dtype=float)

    angle = [j.residual_friction_angle_deg for j in joints]
    friction = after([None if a is None else float(np.tan(np.deg2rad(a))) for a in angle], peak.tan_phi)
    cohesion = after([_rest(j.residual_cohesion, j.fracture_energy_shear) for j in joints], peak.cohesion)
    left = [_rest(j.residual_tensile_strength, j.fracture_energy_tension) for j in joints]
    strength = after(left, peak.tension)
    dilatancy = np.minimum(peak.tan_psi if tan_psi is None else tan_psi, friction)
    tension = tension_corner(strength, cohesion, friction)
    if not convex:
        named = np.array([v is not None for v in left], dtype=bool)
        tension = np.where(named | (peak.tension > peak.apex), strength, tension)
    return PointLaw(friction, dilatancy, cohesion, tension, peak.crushing)


def _rest(residual: float | None, energy: float | None) -> float | None:
    """A residual strength: as named, 0 where only the energy spent on the way is named, None for that of the peak."""
    return 0.0 if residual is None and energy is not None else residual


SUDDEN = 1e30
"""Damage per opening or slip [1/m] of a joint that loses its strength at once."""


class Softening(NamedTuple):
    """How points lose strength: residual values, and damage per opening beyond the strength and per slip [1/m], (m,).

    A rate of ``SUDDEN`` loses it at once, 0 never.
    """

    rest: PointLaw  # residual law
    by_opening: Array  # [1/m], (m,)
    by_slip: Array  # [1/m], (m,)

    @property
    def sudden(self) -> tuple[Flags, Flags]:
        """Points that lose their strength at once, by opening and by slip."""
        return self.by_opening >= SUDDEN, self.by_slip >= SUDDEN

    @property
    def gradual(self) -> tuple[Array, Array]:
        """The rates of what is lost over a length, 0 for the others [1/m]."""
        opening, slip = self.sudden
        return np.where(opening, 0.0, self.by_opening), np.where(slip, 0.0, self.by_slip)

    def at(self, rows: Index | Flags) -> "Softening":
        """Of some of the points."""
        return Softening(self.rest.at(rows), self.by_opening[rows], self.by_slip[rows])


def softening(
    joints: Sequence[Joint], kn: Array, ks: Array, slip: Array | float = 0.0, tan_psi: Array | None = None
) -> Softening:
    """How joints lose strength: over 2 GfI / (ft - ft_r) of opening, over 2 GfII / (c - c_r) of plastic slip.

    What the DEM counts is the displacement beyond the strength, elastic part included: it is shorter than the plastic
    slip by what the elastic part gives back, (c - c_r) / ks. Where phi falls too under a stress N that adds
    N (tan(phi) - tan(phi_r)) / ks, which is left out: GfII is exact where phi stays.

    Parameters
    ----------
    joints : whose laws these are; those that do not soften get rates of 0
    kn, ks : elastic stiffness [Pa/m], shape (number of joints,)
    slip : opening or slip over which joints without fracture energy lose their strength [m], 0 for a sudden drop;
        one for all, or shape (number of joints,)
    tan_psi : residual dilatancy, as for :func:`residual_law`

    Raises
    ------
    InputError
        Where the curve of a fracture energy would run back, (ft - ft_r)^2 / (2 kn) >= GfI: the elastic joint has stored
        more than breaking it takes. Names the joint and the least stiffness.
    """
    peak, rest = peak_law(joints, convex=False), residual_law(joints, tan_psi, convex=False)
    slip = np.broadcast_to(np.asarray(slip, dtype=float), (len(joints),))
    rates = np.zeros((2, len(joints)))  # damage by opening, and by slip [1/m]
    for k, joint in enumerate(joints):
        if not joint.softens:
            continue
        rates[:, k] = 1.0 / slip[k] if slip[k] > 0.0 else SUDDEN
        for row, field, energy, drop, kind, stiffness in (
            (0, "tension", joint.fracture_energy_tension, peak.tension[k] - rest.tension[k], "normal", kn[k]),
            (1, "shear", joint.fracture_energy_shear, peak.cohesion[k] - rest.cohesion[k], "shear", ks[k]),
        ):
            if energy is None:
                continue
            # the elastic joint gives this back when it breaks: with less to spend the curve would run back
            if energy <= drop**2 / (2.0 * stiffness):
                name = f"joint {joint.name!r}" if joint.name else "joint"
                raise InputError(
                    f"{name}: fracture_energy_{field} = {energy:g} J/m2 is less than what the elastic joint has stored "
                    f"at its strength, {drop**2 / (2.0 * stiffness):.3g} J/m2: {kind}_stiffness (now {stiffness:.3g} "
                    f"Pa/m) must be above {drop**2 / (2.0 * energy):.3g} Pa/m; leave the energy out for a sudden drop"
                )
            # of the plastic slip the elastic one, drop / ks, is taken off, which the joint gives back meanwhile
            rates[row, k] = 1.0 / (2.0 * energy / drop - (drop / stiffness if field == "shear" else 0.0))
        if joint.lost_by is LostBy.OPENING:
            rates[1, k] = 0.0
    return Softening(rest, *rates)
