"""Joints that do not quite fit: gaps, and the misfit with which given joint forces stand in the reference pose.

Below psi = phi the load at which a structure first loses equilibrium depends on the self-stress that its joints have
from the start. A spring holds a force F at the misfit -F / k: with those of an admissible state of limit analysis the
structure is in that state before anything has moved, and a path goes on from there. A tie is too short by T / k then.
"""

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.results import Prediction
from limitmason.arrays import Array
from limitmason.capacity import newton, step_equilibrium
from limitmason.capacity.kinematics import moved
from limitmason.capacity.step_equilibrium import Node
from limitmason.capacity.step_length import Steps
from limitmason.capacity.system import System
from limitmason.checks import numbers
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import ContactPoints

_SAME_PLACE = 1e-6
"""Part of the structure's size by which points of a prediction and of a path may lie apart [-]: chosen."""

_NO_MOTION = 1e-9
"""Motion of what is controlled, of the largest entry of a mechanism's twists, that counts as none [-]: rounding."""


def of_gaps(points: ContactPoints, gaps: ArrayLike | None) -> Array | None:
    """Initial displacements of b against a at the contact points by gaps [m], (m, c).

    Parameters
    ----------
    points : m contact points of the path
    gaps : opening of every point [m], shape (m,), none negative; None for faces that touch
    """
    if gaps is None:
        return None
    opening = numbers("gaps [m]", gaps)
    if not (opening.shape == (points.count,) and (opening >= 0.0).all() and np.isfinite(opening).all()):
        raise InputError(f"gaps must be {points.count} lengths [m], finite and not negative, one per contact point")
    out = np.zeros((points.count, points.components))
    out[:, 0] = opening
    return out


def of_forces(points: ContactPoints, state: Prediction, kn: Array, ks: Array) -> Array:
    """Misfit with which the points carry the joint forces of a prediction in the reference pose [m], shape (m, c).

    Parameters
    ----------
    points : contact points of the path
    state : prediction of limit analysis on the same points
    kn, ks : of every interface [Pa/m], shape (k,)

    Raises
    ------
    InputError
        For a prediction without joint forces or a mechanism, or with other contact points.
    """
    r = state.resultants
    if r is None or state.mechanism is None or not np.isfinite(state.collapse_multiplier):
        raise InputError("initial must be a prediction with joint forces and a mechanism, from lm.limit_analysis")
    joints = r.point_interface < len(kn)  # ties come after them
    apart = np.inf
    if joints.sum() == points.count and np.array_equal(r.point_interface[joints], points.interface):
        apart = float(np.abs(r.point_position[joints] - points.position).max(initial=0.0))
    if apart > _SAME_PLACE * float(np.ptp(points.position, axis=0).max(initial=0.0)):
        raise InputError(
            f"initial has {joints.sum()} contact points, the path {points.count}, or they lie elsewhere: give both the "
            "same contact_model and grid"
        )
    force = np.einsum("mci,mi->mc", points.directions, r.point_force[joints])
    stiffness = np.column_stack([kn[points.interface], *[ks[points.interface]] * (points.components - 1)])
    return -force / (stiffness * points.area[:, None])


def begun_with(system: System, state: Prediction, to: float | None, ratio: float, steps: Steps) -> list[Node]:
    """The node without control displacement, and one along the state's mechanism.

    The second is left out where it is not found. The multiplier is solved for; the state's own is where the search
    begins.

    Parameters
    ----------
    system : equations of the structure, whose joints misfit by what the state's forces need
    state : prediction with a multiplier and a mechanism
    to : control displacement to reach [m]; None for the sense of the load
    ratio : work of the live load per control displacement [N]
    steps : lengths of the steps, of which the first is made along the mechanism
    """
    rest = system.at_rest()
    old = system.virgin()
    old = old._replace(stretched=_too_short(system, state))
    way = newton.Way.begin(system, rest, state.collapse_multiplier, old, 0.0)
    solved = newton.solve(way)
    programs = 0
    # at a limit state the tangent may be singular: the digits that the prediction's solver left are then all that lacks
    if solved is None and way.unbalance < newton.ENOUGH:
        solved = newton.Solved(way.state, way.state.multiplier, 0)
    if solved is None:
        found = step_equilibrium.by_programs(
            system, rest, old, target=0.0, multiplier=state.collapse_multiplier, normal=None, ratio=ratio
        )
        if found is None:
            return []
        solved, programs = found
    # ``looked``, the pose in which contacts were last looked for, is the reference pose
    first = step_equilibrium.node_of(solved, programs=programs)._replace(looked=rest)
    assert state.mechanism is not None
    twists = np.array(state.mechanism.twists)
    # control displacement by the mechanism's twists as they are scaled, and that of the first step [m]
    along = float((system.control * (twists[:, :3] @ system.bodies.basis[:3])).sum())
    move = np.copysign(steps.first * system.length, ratio if to is None else to)
    # a mechanism that does not move what is controlled tells no first step
    if not abs(along) > _NO_MOTION * float(np.abs(twists).max(initial=0.0)):
        return [first]
    guess = moved(solved.state.pose, move / along * twists), solved.multiplier
    second = step_equilibrium.step(system, first, first.control + float(move), guess, ratio)
    return [first] if second is None else [first, second._replace(looked=rest)]


def _too_short(system: System, state: Prediction) -> Array:
    """Plastic elongation with which ties bear the tensions of a prediction in the reference pose [m], shape (t,).

    It is negative: a tie that is too short by T / k pulls with T.

    Parameters
    ----------
    system : equations of the structure, with its ties
    state : prediction of limit analysis, with joint forces
    """
    r = state.resultants
    assert r is not None
    n = len(system.ties.length)
    pull = np.linalg.norm(r.point_force[len(r.point_force) - n :], axis=1)  # they come after the joints
    # without the digits by which a solver's tension exceeds the strength
    return -np.minimum(pull, system.ties.strength) / system.ties.stiffness
