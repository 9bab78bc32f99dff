"""The joint law in one compiled form: what limit analysis, certificates, virtual work, bounds and the DEM all read.

|T| <= c + tan(phi) N,  N >= -t with t = min(ft, c / tan(phi)),  N <= fc;  a sliding point opens by tan(psi) per slip.

The tension corner t is worked out here and nowhere else: where ft > c / tan(phi) the apex of the Coulomb cone is the
cut-off. Counted from that corner, N' = N + t, the law reads |T| <= c' + tan(phi) N', 0 <= N' <= q with
c' = c - tan(phi) t >= 0 and q = fc + t. Compression is positive; c, t and fc are strengths [Pa], or forces [N] once the
law is taken :meth:`PointLaw.over` tributary areas.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.model.arrays import AssemblyArrays
from limitmason.model.joint import Joint

Array = NDArray[np.float64]


def tension_corner(tensile_strength: Array, cohesion: Array, tan_phi: Array) -> Array:
    """Tension that a point can carry, t = min(ft, c / tan(phi)); ft where there is no friction.

    Parameters
    ----------
    tensile_strength, cohesion : ft, c [Pa] or [N], shape (m,)
    tan_phi : [-], shape (m,)
    """
    cohesion, tan_phi = np.asarray(cohesion, dtype=float), np.asarray(tan_phi, dtype=float)
    apex = np.divide(cohesion, tan_phi, out=np.full(np.shape(cohesion), np.inf), where=tan_phi > 0.0)
    return np.minimum(tensile_strength, apex)


class PointLaw(NamedTuple):
    """The law at m contact points: strengths [Pa] per interface, or capacities [N] over tributary areas; shape (m,)."""

    tan_phi: Array
    tan_psi: Array
    cohesion: Array  # c
    tension: Array  # t, the tension corner
    crushing: Array  # fc, infinite without crushing

    @property
    def corner_cohesion(self) -> Array:
        """Shear strength at the tension corner, c' = c - tan(phi) t >= 0."""
        return np.maximum(self.cohesion - self.tan_phi * self.tension, 0.0)

    @property
    def corner_crushing(self) -> Array:
        """Largest normal force counted from the tension corner, q = fc + t."""
        return self.crushing + self.tension

    def over(self, area: Array) -> "PointLaw":
        """Capacities [N] over tributary areas [m2], shape (m,), of a law given by strengths [Pa]."""
        return self._replace(cohesion=self.cohesion * area, tension=self.tension * area, crushing=self.crushing * area)

    def scaled(self, factor: float) -> "PointLaw":
        """All strengths times a factor [-]."""
        return self.over(np.full(np.shape(self.cohesion), factor))

    def at(self, rows: NDArray) -> "PointLaw":
        """The law at some points, in the order asked for."""
        return PointLaw(*(column[rows] for column in self))

    def excess(self, normal: Array, shear: Array) -> Array:
        """How far a force lies outside the law, the largest of its three conditions [N], shape (m,); <= 0 inside.

        Parameters
        ----------
        normal : N, compression positive [N], shape (m,)
        shear : size of T [N], shape (m,)
        """
        outside = np.maximum(shear - self.cohesion - self.tan_phi * normal, -normal - self.tension)
        return np.maximum(outside, normal - self.crushing)

    def lift(self, opening: Array, slip: Array) -> Array:
        """Opening beyond what associative sliding needs, g = e_n - tan(phi) |e_t| [m/s], shape (m,)."""
        return opening - self.tan_phi * slip

    def dissipation(self, opening: Array, slip: Array) -> Array:
        """Power that the associative law dissipates in a motion [W], shape (m,).

        D = c |e_t| + t g for g >= 0 and c |e_t| - fc g for g < 0; without crushing g < 0 is no admissible motion and
        nothing is added for it.

        Parameters
        ----------
        opening, slip : e_n and |e_t| [m/s], shape (m,)
        """
        g = self.lift(opening, slip)
        power = self.cohesion * slip + np.where(g > 0, self.tension * g, 0.0)
        finite = np.isfinite(self.crushing)
        power[finite] += self.crushing[finite] * np.maximum(-g[finite], 0.0)
        return power

    def inside(self) -> "PointLaw":
        """The associative law with friction psi that lies inside this one and shares its tension corner.

        Its cohesion is c - (tan(phi) - tan(psi)) t: with the full cohesion the reduced cone would leave the true one
        where joints are in tension. Source: Radenkovic's second theorem.
        """
        cohesion = np.maximum(self.cohesion - (self.tan_phi - self.tan_psi) * self.tension, 0.0)
        return self._replace(tan_phi=self.tan_psi, cohesion=cohesion)


def interface_law(arrays: AssemblyArrays) -> PointLaw:
    """The law of every interface by its strengths [Pa], shape (k,)."""
    tension = tension_corner(arrays.tensile_strength, arrays.cohesion, arrays.tan_phi)
    return PointLaw(arrays.tan_phi, arrays.tan_psi, arrays.cohesion, tension, arrays.compressive_strength)


def peak_law(joint: Joint) -> PointLaw:
    """The law of one joint before it softens, strengths [Pa], arrays of one entry."""
    return _one(joint.tan_phi, joint.tan_psi, joint.cohesion, joint.tensile_strength, joint.compressive_strength)


def residual_law(joint: Joint, tan_psi: float | None = None) -> PointLaw:
    """The law of one joint after it has softened; values it does not name stay at their peak, strengths [Pa].

    Parameters
    ----------
    tan_psi : residual dilatancy [-]; that of the peak where omitted, never above the residual friction
    """
    peak = peak_law(joint)
    phi, c, ft = joint.residual_friction_angle_deg, joint.residual_cohesion, joint.residual_tensile_strength
    friction = joint.tan_phi if phi is None else float(np.tan(np.deg2rad(phi)))
    return _one(
        friction, min(joint.tan_psi if tan_psi is None else tan_psi, friction), joint.cohesion if c is None else c,
        float(peak.tension[0]) if ft is None else ft, joint.compressive_strength,
    )  # fmt: skip


def _one(tan_phi: float, tan_psi: float, cohesion: float, tensile_strength: float, crushing: float) -> PointLaw:
    columns = [np.array([float(v)]) for v in (tan_phi, tan_psi, cohesion, tensile_strength, crushing)]
    columns[3] = tension_corner(columns[3], columns[2], columns[0])
    return PointLaw(*columns)
