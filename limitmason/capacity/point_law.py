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

from limitmason.arrays import Array, Flags, Index
from limitmason.mechanics.law import PointLaw, Softening

_OPEN_TANGENT = 1e-9
"""Share of the elastic stiffness left in the tangent, never in the forces: without it a free block's is singular."""

_PROBE = 1e-6
"""Step of the difference quotients of softening points, over their softening length [-]."""

_DAMAGED = 1e-13
"""Change of a damage that counts as none [-]: rounding of a number of size one, with some room."""

_SECANT = 1e-7
"""Step of the damage for the slope of what is demanded [-]: near the root of rounding, best for a difference."""

LARGE = 200
"""Contact points from which compiled sums are loaded: below, that takes longer than what they save."""

_ROUNDS = 40
"""Iterations for a damage at most; what has not come to rest then swings between two values: chosen."""

_BITS = 52
"""Halvings to the last bit of a damage between 0 and 1."""


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
    normal = law.kn * (old.lift - displacement[:, 0])
    return np.column_stack([normal, law.ks[:, None] * (old.slip - displacement[:, 1:])])


def return_map(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> Returned:
    """Stress and history after a step from ``old`` to a relative displacement (w, e...) [m], shape (m, c).

    A joint that softens has no closed form of its tangent, as damage depends on the return: it is taken by central
    differences over ``_PROBE`` of the displacement at which the damage is complete.

    Parameters
    ----------
    old : plastic slip, opening by dilation and damage before the step
    displacement : of block b against a in the frame of the point, opening positive [m]
    """
    if law.softening is None and len(law.kn) >= LARGE:
        return _compiled(law, old, displacement, np.empty((*displacement.shape, displacement.shape[1])))
    tried = _elastic_predictor(law, old, displacement)
    if law.softening is None:
        return _plastic(law, law.strength, old, tried)
    before = np.array(np.broadcast_to(old.damage, law.kn.shape))
    found = _plastic(law, law.strength_at(before), old._replace(damage=before), tried)
    rows = np.flatnonzero(_demanded(law, old._replace(damage=before), tried, before) > before)  # points that soften on
    if not len(rows):
        return found._replace(history=found.history._replace(stress=found.stress))
    assert law.softening is not None
    # the point and all probes of its difference quotients in one call: of few points, calls cost more than numbers
    k, c = len(rows), displacement.shape[1]
    probes = np.concatenate([np.zeros((1, c)), np.eye(c), -np.eye(c)])  # none, ahead and behind along every component
    size = _PROBE / np.maximum(*law.softening.at(rows).gradual)  # [m]
    at = displacement[rows] + probes[:, None, :] * size[:, None]
    many = np.tile(rows, len(probes))
    new, damage = _softened(law.at(many), old.at(many), at.reshape(-1, c))
    before[rows] = damage[:k]
    stress, slip, lift, tangent = found.stress, found.history.slip, found.history.lift, found.tangent
    stresses = new.stress.reshape(len(probes), k, c)
    stress[rows], lift[rows] = stresses[0], new.lift[:k]
    slip[rows] = old.slip[rows] - new.slip[:k, None] * new.along[:k]
    ahead, behind = stresses[1 : c + 1], stresses[c + 1 :]
    tangent[rows] = -0.5 * (ahead - behind).transpose(1, 2, 0) / size[:, None, None]
    for j in range(c):
        tangent[rows, j, j] += _OPEN_TANGENT * np.minimum(law.kn, law.ks)[rows]
    return Returned(stress, PlasticHistory(slip, lift, before, stress=stress), tangent)


def returned_stress(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> Array:
    """Stress of :func:`return_map` alone [Pa], (m, c), by a law that does not soften.

    Parameters
    ----------
    displacement : of b against a at every point [m], shape (m, c)
    """
    if len(law.kn) >= LARGE:
        return _compiled(law, old, displacement, np.empty((0, 0, 0))).stress
    tried = _elastic_predictor(law, old, displacement)
    return _plastic_corrector(law, law.strength, old.lift, tried).stress


def _compiled(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array, tangent: Array) -> Returned:
    """Compiled :func:`return_map` by a law that does not soften.

    Parameters
    ----------
    old : plastic state before the step
    displacement : of b against a at every point [m], shape (m, c)
    tangent : written, shape (m, c, c), or left alone where it is empty
    """
    from limitmason.capacity import compiled

    stress, slip, lift = np.empty(displacement.shape), np.empty(old.slip.shape), np.empty(old.lift.shape)
    s = law.strength
    compiled.returned(
        (s.tan_phi, s.tan_psi, s.cohesion, s.tension, s.crushing), law.kn, law.ks, _OPEN_TANGENT, old.slip, old.lift,
        displacement, stress, slip, lift, tangent,
    )
    return Returned(stress, PlasticHistory(slip, lift, old.damage), tangent)


class _ElasticPredictor(NamedTuple):
    """Stress without limits.

    Parameters
    ----------
    normal : N, compression positive [Pa], shape (m,)
    size : |T| [Pa], shape (m,)
    along : T / |T| [-], shape (m, c - 1)
    opening : w, from which N came [m], shape (m,)
    """

    normal: Array
    size: Array
    along: Array
    opening: Array


class _PlasticCorrector(NamedTuple):
    """Where limits bring a point, and which of them.

    Parameters
    ----------
    slip : size of the slip in the step [m], shape (m,)
    lift : opening by dilation after it [m], shape (m,)
    normal, held : N and |T| after it [Pa], shape (m,)
    along : sense of the shear [-], shape (m, c - 1)
    cone, tip, apex, crushed : whether it slides on the cone, lies beyond the tip of the cone without shear, at the
        tension cut-off, at the compressive strength, shape (m,)
    hardness : shear excess that a unit of slip takes off, ks + kn tan(phi) tan(psi) [Pa/m], shape (m,)
    """

    slip: Array
    lift: Array
    normal: Array
    held: Array
    along: Array
    cone: Flags
    tip: Flags
    apex: Flags
    crushed: Flags
    hardness: Array

    @property
    def stress(self) -> Array:
        """(N, T...) [Pa], (m, c)."""
        return np.column_stack([self.normal, self.held[:, None] * self.along])


def _elastic_predictor(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> _ElasticPredictor:
    """Stress without limits at a displacement (w, e...) of b against a [m], shape (m, c), after a history ``old``."""
    tried = trial(law, old, displacement)
    size = np.sqrt(np.einsum("mc,mc->m", tried[:, 1:], tried[:, 1:]))
    return _ElasticPredictor(tried[:, 0], size, tried[:, 1:] / np.maximum(size, 1e-300)[:, None], displacement[:, 0])


def _softened(law: ElastoplasticLaw, old: PlasticHistory, displacement: Array) -> tuple[_PlasticCorrector, Array]:
    """The return at the least damage that asks for no more damage, and that damage, (m,).

    Parameters
    ----------
    law, displacement : of m points, the displacement of b against a after the history ``old`` [m], shape (m, c)
    """
    before, tried = np.asarray(old.damage), _elastic_predictor(law, old, displacement)
    damage = before
    for _ in range(_ROUNDS):
        asked = _demanded(law, old, tried, damage)
        # Newton's method on damage = demanded(damage), with the slope by a difference
        if (np.abs(asked - damage) < _DAMAGED).all():
            break
        probed = np.minimum(damage + _SECANT, 1.0)
        rise = _demanded(law, old, tried, probed) - asked
        slope = rise / np.maximum(probed - damage, 1e-300)
        # a point whose strength falls faster than its spring unloads goes all the way
        onward = np.where(slope < 1.0, (asked - damage) / np.where(slope < 1.0, 1.0 - slope, 1.0), 1.0 - damage)
        damage = np.clip(damage + onward, before, 1.0)
    else:
        # slip damages no more where the tip of the cone has come to the tension: there the damage stops, halved in on
        swings = np.abs(_demanded(law, old, tried, damage) - damage) >= _DAMAGED
        low, high = before, np.ones(len(before))
        for _ in range(_BITS):
            middle = 0.5 * (low + high)
            more = _demanded(law, old, tried, middle) > middle
            low, high = np.where(more, middle, low), np.where(more, high, middle)
        damage = np.where(swings, high, damage)
    return _plastic_corrector(law, law.strength_at(damage), old.lift, tried), damage


def _demanded(law: ElastoplasticLaw, old: PlasticHistory, tried: _ElasticPredictor, damage: Array) -> Array:
    """Damage that a step asks for, returned with the strengths of a trial value, (m,).

    The true damage is where both are equal: max(h_n, rate_opening x) + rate_slip p, as in the module.

    Parameters
    ----------
    law, old : law of the points, and their history at the start of the step
    tried : elastic predictor
    """
    assert law.softening is not None
    by_opening, by_slip = law.softening.gradual
    s = law.strength_at(damage)
    found = _plastic_corrector(law, s, old.lift, tried)
    beyond = np.maximum(tried.opening - found.lift - s.tension / law.kn, 0.0)
    shear = tried.size[:, None] * tried.along
    slip = slip_under_strength(law, s, old, shear, law.kn * (found.lift - tried.opening), found.slip)
    return np.minimum(np.maximum(old.damage, by_opening * beyond) + by_slip * slip, 1.0)


def slip_under_strength(
    law: ElastoplasticLaw, s: PointLaw, old: PlasticHistory, tried: Array, normal: Array, slip: Array
) -> Array:
    """Slip of a step that met a shear strength [m], (m,): all of it, or up to the tip of the cone, with no shear left.

    Beyond the tip there is none that slip could break. On the way from the stress at the start to that of the end by
    strengths ``s`` the tip is passed where their shear strength is nothing.

    Parameters
    ----------
    s : strengths at the end of the step [Pa]
    old : history at its start
    tried : shear at the end without further slip [Pa], (m, c - 1)
    normal : normal stress at the end without a limit [Pa], (m,)
    slip : size of the slip in the step [m], (m,)
    """
    bears, began = s.bears_shear(np.maximum(normal, -s.tension)), old.began()  # at the end; stress at the start
    if bears.all():
        return slip
    first, last = s.shear_strength(began[:, 0]), s.shear_strength(normal)
    # part of the step, in which strength falls evenly, after which no shear is left
    share = np.where(first > 0.0, first / np.where(bears, 1.0, np.maximum(first, 0.0) - last), 0.0)
    at_tip = began[:, 1:] + share[:, None] * (tried - began[:, 1:])
    return np.where(bears, slip, np.sqrt(np.einsum("mc,mc->m", at_tip, at_tip)) / law.ks)


def _plastic_corrector(law: ElastoplasticLaw, s: PointLaw, lift: Array, tried: _ElasticPredictor) -> _PlasticCorrector:
    """Return of the elastic trial at fixed strengths to cone, tip, apex or crushing cap.

    Each case is asked for in this order and overrides the one before: only the return to the cone tells whether the
    tip is passed, and only what is left there whether the tension is reached.

    Parameters
    ----------
    law : stiffnesses of the points
    s : strengths that stay through the step [Pa]
    lift : opening by dilation before the step [m], shape (m,)
    tried : stress without limits
    """
    kn, ks, n0, size = law.kn, law.ks, tried.normal, tried.size
    hardness = ks + kn * s.tan_phi * s.tan_psi  # shear excess taken off per slip
    slip = np.maximum(size - s.shear_strength(n0), 0.0) / hardness
    # tension between the tip of the cone and a strength beyond it: all of the shear slips
    tip = (slip > 0.0) & (s.shear_strength(n0 + kn * s.tan_psi * slip) < 0.0)
    slip = np.where(tip, size / ks, slip)
    apex = n0 + kn * s.tan_psi * slip <= -s.tension
    tip &= ~apex
    slip = np.where(apex, np.maximum(size - s.corner_cohesion, 0.0) / ks, slip)
    normal = np.where(apex, -s.tension, n0 + kn * s.tan_psi * slip)
    lift = lift + s.tan_psi * slip
    crushed = normal > s.crushing
    if crushed.any():
        normal = np.minimum(normal, s.crushing)
        slip = np.where(crushed, np.maximum(size - s.shear_strength(normal), 0.0) / ks, slip)
        lift = np.where(crushed, tried.opening + normal / kn, lift)
    cone = ~apex & ~tip & (slip > 0.0)
    return _PlasticCorrector(slip, lift, normal, size - ks * slip, tried.along, cone, tip, apex, crushed, hardness)


def _plastic(law: ElastoplasticLaw, s: PointLaw, old: PlasticHistory, tried: _ElasticPredictor) -> Returned:
    """The return with strengths ``s`` that stay, with tangent -d(N, T)/d(w, e).

    ``old`` is the history at the start of the step, ``tried`` the stress without limits at its end.
    """
    found, kn, ks = _plastic_corrector(law, s, old.lift, tried), law.kn, law.ks
    along, cone, tip = found.along, found.cone, found.tip
    history = PlasticHistory(old.slip - found.slip[:, None] * along, found.lift, old.damage)
    # a point that can hold no shear slides by any, though it may bear none yet
    sliding = (found.slip > 0.0) | (s.shear_strength(found.normal) <= 0.0)
    # of the trial shear that is held, by which the stiffness across the slip is less
    share = np.where(sliding, found.held / np.maximum(tried.size, 1e-300), 1.0)
    m, c = len(kn), along.shape[1] + 1
    tangent = np.zeros((m, c, c))
    outer = along[:, :, None] * along[:, None, :]
    tangent[:, 1:, 1:] = (ks * share)[:, None, None] * (np.eye(c - 1) - sliding[:, None, None] * outer)
    # on the cone d(slip) = (-ks s.de + mu kn dw) / hardness with s the sense of the shear; crushed, N stays
    mu, flow = s.tan_phi * cone, kn * s.tan_psi * np.where(tip, 1.0 / ks, (cone & ~found.crushed) / found.hardness)
    tangent[:, 0, 0] = np.where(found.apex | found.crushed, 0.0, kn * (1.0 - flow * mu))
    tangent[:, 0, 1:] = (flow * ks)[:, None] * along
    tangent[:, 1:, 0] = (mu * tangent[:, 0, 0])[:, None] * along
    tangent[:, 1:, 1:] += mu[:, None, None] * along[:, :, None] * tangent[:, 0, None, 1:]
    floor = _OPEN_TANGENT * np.minimum(kn, ks)
    for k in range(c):
        tangent[:, k, k] += floor
    return Returned(found.stress, history, tangent)
