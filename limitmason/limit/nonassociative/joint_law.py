"""The true joint law for any dilatancy angle, moved to its tension corner."""

from typing import NamedTuple, TypeGuard

import numpy as np
from scipy import sparse

from limitmason.arrays import Array, Flags
from limitmason.limit.program.static_theorem import Problem
from limitmason.mechanics.law import PointLaw
from limitmason.mechanics.law_table import NON_ASSOCIATIVE, SECTIONS, refuse

SAME_ANGLE = 1e-15
"""Difference of tan(phi) and tan(psi) that is rounding: the law is associative there."""


class JointLaw(NamedTuple):
    """Joint law with N' = N + t from the tension corner, scaled as in ``Problem``.

    |T| <= c' + tan(phi) N',  0 <= N' <= q;  e_n = tan(psi) |e_t| + p - k with p, k >= 0, N' p = 0 and (q - N') k = 0,
    and T e_t = -(c' + tan(phi) N') |e_t|. Here t = min(ft A, c A / tan(phi)) and c' = c A - tan(phi) t >= 0.
    """

    matrix: sparse.csc_array  # (r, c m)
    dead: Array  # dead load less what the corner's own tension carries, (r,)
    live: Array  # (r,)
    tan_phi: Array  # (m,)
    tan_psi: Array  # (m,)
    tension: Array  # t, (m,)
    cohesion: Array  # c', (m,)
    crushing: Array  # q, infinite without crushing, (m,)
    components: int  # c = 3, or 2 in plane
    live_size: float  # sum |live|: velocities are scaled to live . v = live_size, a mean live velocity of one
    total: float  # total load in scaled units

    @property
    def points(self) -> PointLaw:
        """The law of the points alone, in N' = N + t."""
        return PointLaw(self.tan_phi, self.tan_psi, self.cohesion, np.zeros(len(self.tan_phi)), self.crushing)

    @property
    def dilatant(self) -> Flags:
        """Points where the flow rule is normality: psi = phi, or nothing to dilate on."""
        return self.tan_psi >= self.tan_phi - SAME_ANGLE


class ForceState(NamedTuple):
    """Scaled multiplier, forces from the corner, velocities with live . v = live_size."""

    multiplier: float  # [-]
    force: Array  # (N', T) of every point [-], (c m,)
    velocity: Array  # of the equilibrium rows, (r,)


class Violation(NamedTuple):
    """What a state violates: forces over total load, rates at live velocity one.

    It is zero for an exact state.
    """

    equilibrium: float  # largest unbalance of a row [-]
    yielding: float  # largest excess over the joint law [-]
    flow: float  # largest opening short of tan(psi) times sliding
    complementarity: float  # power against the flow rule, over all points [-]

    @property
    def worst(self) -> float:
        """Largest of the four, or infinite for a state that is not a number."""
        largest = max(self)
        return largest if np.isfinite(largest) else float("inf")


def joint_law(problem: Problem) -> JointLaw:
    """The joint law of all points of a problem, from the tension corner.

    N' = N + t, c' = c A - tan(phi) t, dead' = dead - A (t on N).

    Parameters
    ----------
    problem : from :func:`limitmason.limit.program.static_theorem.make_problem`

    Raises
    ------
    NotApplicable
        For in-plane sections with an exact crushing stress block, which has no dilatancy law here.
    """
    refuse(NON_ASSOCIATIVE, problem.assembly, problem.block_interfaces, where=SECTIONS)
    law, tension = problem.law.from_corner(), problem.law.tension
    corner = np.zeros(problem.matrix.shape[1])
    corner[:: problem.components] = tension
    return JointLaw(
        matrix=problem.matrix, dead=problem.dead - problem.matrix @ corner, live=problem.live, tan_phi=law.tan_phi,
        tan_psi=law.tan_psi, tension=tension, cohesion=law.cohesion, crushing=law.crushing,
        components=problem.components, live_size=float(np.abs(problem.live).sum()), total=problem.size,
    )


def split(law: JointLaw, vector: Array) -> tuple[Array, Array, Array]:
    """Normal parts (m,), tangential ones (m, c - 1), and their size (m,).

    ``vector`` holds forces or rates of all points, shape (c m,), normal component first.
    """
    x = vector.reshape(-1, law.components)
    tangential = x[:, 1:]
    return x[:, 0], tangential, np.linalg.norm(tangential, axis=1)


def from_corner(law: JointLaw, normal: Array) -> Array:
    """N' of given normal forces N (m,), compression positive, scaled; not below zero."""
    return np.maximum(normal + law.tension, 0.0)


def true_forces(law: JointLaw, state: ForceState) -> Array:
    """Forces (N, T) of a state, tension negative, scaled, shape (c m,)."""
    force = state.force.copy()
    force[:: law.components] -= law.tension
    return force


def normalised(law: JointLaw, velocity: Array) -> Array | None:
    """Velocities (r,) scaled to live . v = live_size, or None without live work."""
    power = float(law.live @ velocity)
    return velocity * (law.live_size / power) if power > 0 else None


def excess(law: JointLaw, force: Array) -> float:
    """Largest excess of forces (N', T), (c m,), over the law, over total load [-]."""
    normal, _, shear = split(law, force)
    return float(law.points.excess(normal, shear).max(initial=0.0)) / law.total


def violation(law: JointLaw, state: ForceState) -> Violation:
    """Everything a state violates, from the law's arrays alone.

    Complementarity is the sum over points of N' p + (q - N') k + |T . e_t + (c' + tan(phi) N') |e_t||, over the total
    load at mean live velocity one: to first order, how far the multiplier could be wrong.
    """
    normal, shear, _ = split(law, state.force)
    opening, sliding, _ = split(law, law.matrix.T @ state.velocity)
    rest = law.matrix @ state.force + law.dead + state.multiplier * law.live
    short, power = law.points.flow_residual(normal, shear, opening, sliding)
    return Violation(
        float(np.abs(rest).max(initial=0.0) / law.total), excess(law, state.force), float(short.max(initial=0.0)),
        float(power.sum() / law.total),
    )


def exact(state: ForceState | None, law: JointLaw, tolerance: float) -> TypeGuard[ForceState]:
    """Whether a state keeps the law within a tolerance on its worst violation [-]."""
    return state is not None and bool(np.isfinite(state.force).all()) and violation(law, state).worst <= tolerance
