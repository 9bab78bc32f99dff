"""Return map of the joint law at contact points, with its consistent tangent: that of the DEM, for finite steps.

N = kn (lift - w), T = ks (slip - e), -t <= N <= fc, |T| <= c + tan(phi) N; slip by p lifts by tan(psi) p. Stresses
[Pa], compression positive. A finite step returns to the cone wherever kn (lift + flow over - w) > -t and to its apex
otherwise, which for small steps is the DEM's rule; the lift follows the slip at the apex too. Where t lies beyond the
tip c / tan(phi) of the cone a point there carries tension and no shear. Slip lifts whichever way
it leads: where a joint slides back the DEM gives the lift back, and the curve warns (:func:`slid_back`). What exceeds
fc is crushed: the lift falls by it for good. Tension beyond t opens the joint and leaves no plastic opening.

Strengths go from peak to residual values as the damage h of a point goes from 0 to 1. Over a fracture energy

    h = max(h_n, rate_opening x) + rate_slip p,  x = w - lift - t(h) / kn

for the strengths at the end of the step, so that the energy spent does not depend on its length; p counts up to the
tip of the cone, should the step pass it. What is lost at once is not lost here: within a step such points keep their
strength, see :mod:`limitmason.capacity.breaking`.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.mechanics.law import PointLaw, Softening

_OPEN_TANGENT = 1e-9
"""Share of the elastic stiffness left in the tangent, never in the forces: without it a free block's is singular."""


class ElastoplasticLaw(NamedTuple):
    """Law of m contact points: strengths, stiffnesses, and how they soften.

    Parameters
    ----------
    strength : peak strengths [Pa], shapes (m,)
    kn, ks : normal and shear stiffness per area [Pa/m], shape (m,)
    softening : how the points soften; None where none does
    """

    strength: PointLaw
    kn: Array
    ks: Array
    softening: Softening | None = None

    def strength_at(self, damage: Array | float) -> PointLaw:
        """Strengths at a damage between 0, peak, and 1, residual [Pa], shapes (m,)."""
        if self.softening is None:
            return self.strength
        return self.strength.towards(self.softening.rest, np.asarray(damage))

    def at(self, rows: Index) -> "ElastoplasticLaw":
        """The law of some of the points, by number."""
        softening = None if self.softening is None else self.softening.at(rows)
        return ElastoplasticLaw(self.strength.at(rows), self.kn[rows], self.ks[rows], softening)


class PlasticHistory(NamedTuple):
    """Plastic state of the points and ties.

    Parameters
    ----------
    slip : plastic slip along the tangents [m], shape (m, c - 1)
    lift : opening by dilation, less what crushing took [m], shape (m,)
    damage : 0 at peak, 1 at residual strength [-], shape (m,); one 0 for points that never soften
    stretched : plastic elongation of the ties [m], shape (t,)
    stress : (N, T...) from which the next step of softening points begins [Pa], (m, c); one 0 where none softens
    """

    slip: Array
    lift: Array
    damage: Array | float = 0.0
    stretched: Array = np.zeros(0)
    stress: Array | float = 0.0

    def at(self, rows: Index) -> "PlasticHistory":
        """The history of some of the points, by number."""
        damage = np.broadcast_to(self.damage, self.lift.shape)[rows]
        return self._replace(slip=self.slip[rows], lift=self.lift[rows], damage=damage, stress=self.began()[rows])

    def began(self) -> Array:
        """Stress from which the next step begins [Pa], (m, c)."""
        return np.broadcast_to(self.stress, (len(self.slip), self.slip.shape[1] + 1))


class Returned(NamedTuple):
    """Answer of the return map.

    Parameters
    ----------
    stress : (N, T...) [Pa], compression positive, shape (m, c)
    history : plastic state that goes with it
    tangent : - d(stress) / d(displacement) [Pa/m], shape (m, c, c)
    """

    stress: Array
    history: PlasticHistory
    tangent: Array


def virgin(m: int, components: int) -> PlasticHistory:
    """The history of m points of so many components that have not slid."""
    return PlasticHistory(np.zeros((m, components - 1)), np.zeros(m), np.zeros(m))


def trial(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> Array:
    """Stress (N, T...) = (kn (lift - w), ks (slip - e)), without further slip and without limits [Pa], shape (m, c).

    Parameters
    ----------
    old : plastic state before the step
    displacement : (w, e...) of b against a, opening positive [m], shape (m, c)
    """
    stress = np.empty(displacement.shape)
    np.multiply(law.kn, old.lift - displacement[:, 0], out=stress[:, 0])
    np.multiply(law.ks[:, None], old.slip - displacement[:, 1:], out=stress[:, 1:])
    return stress


def return_map(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> Returned:
    """Stress and history after a step from ``old`` to a relative displacement (w, e...) [m], shape (m, c).

    Parameters
    ----------
    old : plastic slip, opening by dilation and damage before the step
    displacement : of block b against a in the frame of the point, opening positive [m]
    """
    tangent = np.empty((*displacement.shape, displacement.shape[1]))
    found = _returned(law, old, displacement, tangent)
    if law.softening is None:
        return found
    from limitmason.capacity import compiled_law

    history = found.history
    # copies: an array that may not be written is another type to the compiler, which would compile all once more
    before = np.array(np.broadcast_to(old.damage, law.kn.shape), order="C")
    damage = before.copy()
    compiled_law.softened(
        np.array(law.strength), np.array(law.softening.rest), *law.softening.gradual, law.kn, law.ks, _OPEN_TANGENT,
        np.array(old.began(), order="C"), old.slip, old.lift, before, displacement, found.stress, history.slip,
        history.lift, damage, tangent,
    )
    return found._replace(history=history._replace(damage=damage, stress=found.stress))


def returned_stress(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> Array:
    """Stress of :func:`return_map` alone [Pa], (m, c), by a law that does not soften.

    Parameters
    ----------
    displacement : of b against a at every point [m], shape (m, c)
    """
    return _returned(law, old, displacement, np.empty((0, 0, 0))).stress


def _returned(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array, tangent: Array) -> Returned:
    """The return by the strengths at the start of the step.

    Parameters
    ----------
    old : plastic state before the step
    displacement : of b against a at every point [m], shape (m, c)
    tangent : written, shape (m, c, c), or left alone where it is empty
    """
    from limitmason.capacity import compiled_law

    stress, slip, lift = np.empty(displacement.shape), np.empty(old.slip.shape), np.empty(old.lift.shape)
    compiled_law.returned(
        np.array(law.strength_at(old.damage)), law.kn, law.ks, _OPEN_TANGENT, old.slip, old.lift, displacement, stress,
        slip, lift, tangent,
    )
    return Returned(stress, PlasticHistory(slip, lift, old.damage), tangent)


def slip_under_strength(
    law: ElastoplasticLaw, s: PointLaw, old: PlasticHistory, tried: Array, normal: Array, slip: Array
) -> Array:
    """Slip of a step that met a shear strength [m], (m,): all of it, or up to the tip of the cone, with no shear left.

    Parameters
    ----------
    s : strengths at the end of the step [Pa]
    old : history at its start
    tried : shear at the end without further slip [Pa], (m, c - 1)
    normal : normal stress at the end without a limit [Pa], (m,)
    slip : size of the slip in the step [m], (m,)
    """
    from limitmason.capacity import compiled_law

    out = np.empty(len(slip))
    compiled_law.slips_to_tip(np.array(s), law.ks, np.array(old.began(), order="C"), tried, normal, slip, out)
    return out
