"""Torsion estimate: faces limited by even pressure about their own centres.

Shear V beside torsion M is limited by a circle of their shares of the strength alone, (V / V_o)^2 + (M / M_o)^2 <= 1.
The plastic curve of uniform pressure lies inside it: the circle takes up to 7 % too much on a square face, 11 % on one
of 2 x 1 and 14 % on longer ones. A strip that slides along itself is taken up to 4 % too weak.
"""

import numpy as np

from limitmason.answers.results import Status
from limitmason.arrays import Array
from limitmason.geometry.polygon import centred_overlap, polar_mean_radius
from limitmason.limit.program.clarabel_solver import Solution, solve_static
from limitmason.limit.program.cones import TorsionLimit, make_cones
from limitmason.limit.program.static_theorem import Problem

MAX_ITERATIONS = 60
"""Programs solved in search of a pressure that fits its own torsion limit."""

SAME = 1e-7
"""Relative change of the multiplier from one program to the next at which the search ends."""

NEAR = 1e-9
"""Scaled multiplier below which that change is taken as absolute [-], so that a multiplier of zero can settle."""

HALF_STEPS = 6
"""Programs with half a step towards their forces while the pressure still wanders; averages follow. Chosen."""

LEAST_ITERATIONS = 12
"""Programs after which ``SETTLED`` may end the search: chosen, so that averages have had time to come to rest."""

LAST = 5
"""Multipliers whose spread says whether the search has settled: chosen."""

SETTLED = 1e-3
"""Relative spread of the last multipliers at which the search ends: a tenth of a per cent."""

JUMPING = 2e-3
"""Relative spread that jumping centres of pressure leave, up to which the answer counts as solved."""

UNLOADED = 1e-7
"""Normal force of a face over the largest of a point up to which it is rounding: its pole is then its centroid."""

LEAST_RADIUS = 1e-4
"""Polar mean radius over the root of the face's area at least [-]: chosen, a pole at the edge leaves no area at all."""


def with_torsion_limit(
    problem: Problem, solution: Solution, tolerance: float, reduction: float, *, verbose: bool = False
) -> tuple[Solution, float, dict]:
    """Repeat with torsion limited about the last centre of pressure of each face.

    The step towards the new forces shrinks (successive averages), so that faces whose pressure jumps from corner to
    corner settle. The value has settled when the last tenth of a per cent no longer moves; otherwise the spread of the
    last iterates is reported and the status says that accuracy is reduced.

    Parameters
    ----------
    problem, solution : the program, in space, and its solution without the limit, scaled
    tolerance : of the solver [-]
    reduction : the torsional strength is that of uniform pressure over this number [-]
    verbose : report every iteration of the solver

    Returns
    -------
    Solution, seconds in solvers, and what the prediction says of the iteration.
    """
    last: Solution | None = None
    values, seconds, force = [], 0.0, solution.force
    for k in range(MAX_ITERATIONS):
        limits = torsion_limits(problem, force)
        limits = limits._replace(radius=limits.radius / reduction)
        answer = solve_static(problem, make_cones(problem, torsion=limits), tolerance=tolerance, verbose=verbose)
        seconds += answer.seconds
        if answer.status not in (Status.SOLVED, Status.ALMOST_SOLVED):
            if last is None:
                return solution._replace(status=Status.NOT_CONVERGED), seconds, {"torsion_iterations": k + 1}
            # too strict a linearisation: move back towards forces that were possible
            force = 0.5 * (force + last.force)
            continue
        last = answer
        values.append(answer.multiplier)
        recent = values[-LAST:]
        if len(values) > 1 and abs(values[-1] - values[-2]) <= SAME * max(NEAR, abs(values[-1])):
            break
        if k >= LEAST_ITERATIONS and max(recent) - min(recent) <= SETTLED * abs(values[-1]):
            break
        # half steps while the pressure still wanders, then averages that must come to rest: 1/2 at k = 6, then less
        force = force + (answer.force - force) * (0.5 if k < HALF_STEPS else 0.5 * HALF_STEPS / k)
    if last is None:
        return solution._replace(status=Status.NOT_CONVERGED), seconds, {"torsion_iterations": MAX_ITERATIONS}
    tail = values[-LAST:]
    # two values that end the search are the same; they have no spread to speak of
    spread = 0.0 if len(values) < 3 else (max(tail) - min(tail)) / max(abs(values[-1]), 1e-300)
    details = {
        "torsion_iterations": len(values),
        "torsion_history": [v * problem.live_scale for v in values],
        "torsion_spread": spread,
    }
    status = Status.SOLVED if spread <= JUMPING else Status.ALMOST_SOLVED
    return last._replace(status=status), seconds, details


def torsion_limits(problem: Problem, force: Array) -> TorsionLimit:
    """Centre and polar mean radius of the compressed area of every loaded interface.

    The compressed area is the part of the face that is symmetric about the centre of pressure, which carries its force
    under uniform pressure.

    Parameters
    ----------
    force : scaled [-], shape (3 m,): normal (compression > 0) and two tangents of every point
    """
    x = problem.assembly.arrays
    points = problem.points
    normal = force.reshape(-1, 3)[:, 0]
    interfaces = problem.interfaces[problem.interfaces < len(x.area)]  # the ties after them do not twist
    total = np.bincount(points.interface, normal, len(x.area))
    threshold = UNLOADED * np.abs(normal).max(initial=0.0)
    chosen, poles, radii = [], [], []
    for k in interfaces:
        frame = np.column_stack([x.tangent_1[k], x.tangent_2[k]])
        corners = (x.corners[x.corner_start[k] : x.corner_start[k + 1]] - x.centre[k]) @ frame
        pole = np.zeros(2)
        if total[k] > threshold:
            p = np.flatnonzero(points.interface == k)
            weight = np.maximum(normal[p], 0.0)  # tension of cohesive points moves no centre of pressure
            pole = (weight[:, None] * ((points.position[p] - x.centre[k]) @ frame)).sum(axis=0) / weight.sum()
        area = centred_overlap(corners, pole)
        chosen.append(k)
        poles.append(x.centre[k] + frame @ pole)
        size = np.sqrt(x.area[k])
        radii.append(max(polar_mean_radius(area, pole) if len(area) >= 3 else 0.0, LEAST_RADIUS * size))
    return TorsionLimit(np.array(chosen), np.array(poles), np.array(radii))
