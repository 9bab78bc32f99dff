"""Return map of the joint law at contact points, with its consistent tangent: that of the DEM, for finite steps.

N = kn (lift - w), T = ks (slip - e), N >= -t, |T| <= c + tan(phi) N; slip by p lifts by tan(psi) p. Stresses [Pa],
compression positive. A finite step returns to the cone wherever kn (lift + flow over - w) > -t and to its apex
otherwise, which for small steps is the DEM's rule; the lift follows the slip at the apex too. Slip lifts whichever way
it leads: where a joint slides back the DEM gives the lift back, and the curve warns (:func:`slid_back`). Perfectly
plastic; tension beyond t opens the joint and leaves no plastic opening.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.law import PointLaw

Array = NDArray[np.float64]

_OPEN_TANGENT = 1e-9
"""Share of the elastic stiffness left in the tangent, never in the forces: keeps the factorisation of free blocks."""


class Elastic(NamedTuple):
    """Law of m contact points: strengths [Pa] and stiffnesses [Pa/m]."""

    strength: PointLaw
    kn: Array  # (m,)
    ks: Array  # (m,)


class History(NamedTuple):
    """Plastic state of the points: slip along the tangents [m], (m, c - 1), and lift by dilation [m], (m,).

    ``stretched`` is the plastic elongation of the ties [m], (t,).
    """

    slip: Array
    lift: Array
    stretched: Array = np.zeros(0)


class Returned(NamedTuple):
    """Stress (N, T...) [Pa], (m, c), the history that goes with it, and -d(stress)/d(displacement), (m, c, c)."""

    stress: Array
    history: History
    tangent: Array


def virgin(m: int, components: int) -> History:
    """The history of points that have not slid."""
    return History(np.zeros((m, components - 1)), np.zeros(m))


def trial(law: Elastic, old: History, displacement: Array) -> Array:
    """Stress without further slip and without limits, shape (m, c)."""
    normal = law.kn * (old.lift - displacement[:, 0])
    return np.column_stack([normal, law.ks[:, None] * (old.slip - displacement[:, 1:])])


def return_map(law: Elastic, old: History, displacement: Array) -> Returned:
    """Stress and history after a step from ``old`` to a relative displacement (w, e...) [m], shape (m, c)."""
    s, kn, ks = law.strength, law.kn, law.ks
    tried = trial(law, old, displacement)
    n0, shear = tried[:, 0], tried[:, 1:]
    size = np.linalg.norm(shear, axis=1)
    along = shear / np.maximum(size, 1e-300)[:, None]
    hardness = ks + kn * s.tan_phi * s.tan_psi
    over = np.maximum(size - s.shear_strength(n0), 0.0)
    apex = n0 + kn * s.tan_psi * over / hardness <= -s.tension
    cone = ~apex & (over > 0.0)
    edge = s.corner_cohesion
    slides_open = apex & (size > edge)
    slip = np.where(cone, over / hardness, np.where(slides_open, (size - edge) / ks, 0.0))
    normal = np.where(apex, -s.tension, n0 + kn * s.tan_psi * slip)
    held = size - ks * slip
    history = History(old.slip - slip[:, None] * along, old.lift + s.tan_psi * slip)
    # consistent tangent, -d(N, T)/d(w, e)
    share = np.where(cone | slides_open, held / np.maximum(size, 1e-300), 1.0)
    c = displacement.shape[1]
    tangent = np.zeros((len(size), c, c))
    outer = along[:, :, None] * along[:, None, :]
    sliding = (cone | slides_open).astype(float)
    tangent[:, 1:, 1:] = (ks * share)[:, None, None] * (np.eye(c - 1) - sliding[:, None, None] * outer)
    # on the cone d(slip) = (-ks s.de + mu kn dw) / hardness with s the sense of the shear
    mu, flow = s.tan_phi * cone, kn * s.tan_psi / hardness * cone
    tangent[:, 0, 0] = np.where(apex, 0.0, kn * (1.0 - flow * mu))
    tangent[:, 0, 1:] = (flow * ks)[:, None] * along
    tangent[:, 1:, 0] = (mu * tangent[:, 0, 0])[:, None] * along
    tangent[:, 1:, 1:] += mu[:, None, None] * along[:, :, None] * tangent[:, 0, None, 1:]
    floor = _OPEN_TANGENT * np.minimum(kn, ks)
    for k in range(c):
        tangent[:, k, k] += floor
    return Returned(np.column_stack([normal, held[:, None] * along]), history, tangent)


def slid_back(tan_psi: Array, history: History) -> NDArray[np.bool_]:
    """Points whose lift is more than goes with their distance from the start, tan(psi) |slip|, by a hundredth of it.

    Parameters
    ----------
    tan_psi : shape (m,)
    """
    away = tan_psi * np.linalg.norm(history.slip, axis=1)
    return history.lift - away > 0.01 * max(float(np.abs(history.lift).max(initial=0.0)), 1e-300)
