"""Joints that give way at the edge on which a block rocks: what a path on corners leaves out.

On corners a block rocks about the very edge of a joint. On a face of stiffness kn the pressure near that edge is a
triangle of length x = sqrt(2 N / (k theta)), k the stiffness per length across the joint: the force stands x / 3
inside. With hinges that turn at rates r_j per control displacement u the load is, to first order,

    lambda(u) = lambda_0 - C / sqrt(u) - g u,   C = sum N_j r_j sqrt(2 N_j / (k_j r_j)) / 3 / (live power),

with -g the slope that displacements give it. It is largest at u = (C / 2 g)^(2/3), lower than lambda_0 by
3 (g C^2 / 4)^(1/3).
"""

import numpy as np

from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.kinematics import motion_between
from limitmason.capacity.program import solve_step
from limitmason.capacity.stepping import Node

TOLD = 0.015
"""Part of the largest load from which what corners leave out is told [-]: the estimate is good to a quarter."""

SHARED = 1.5
"""Largest load of an associative path over that of the path, in space, from which it is told [-]."""

_ENDLESS = 1e3  # times from which no number is told
_FAR = 1e6  # advance of the live load that outweighs what elastic forces cost, in block weights times elastic lengths


def told_of_edges(generations: Generations, nodes: list[Node]) -> list[str]:
    """What to say where faces of the same stiffness would bear less than the few points of a path."""
    lost = lost_at_edges(generations, nodes)
    if lost < TOLD:
        return []
    return [
        "blocks rock on the ends of their joints, which do not give way: faces of this stiffness would bear about "
        f"{lost:.1%} less, by an estimate to first order; give contact_model='lobatto' for them"
    ]


def told_of_sharing(generations: Generations, nodes: list[Node]) -> list[str]:
    """What to say where friction in space bears far less than it could, by how the points of faces share the pressure.

    Below the associative limit load equilibrium leaves many states open; which one a path takes, and so the load at
    which it slides, hangs on the springs of its points. Of 14 structures in space two bore less than two thirds of
    that load, and moved by 28 and 49 % on finer points; the others bore 88 % of it and more, or had other reasons.
    """
    system = generations.systems[0]
    top = max(abs(n.multiplier) for n in nodes)
    if system.bodies.directions.shape[1] == 2 or top == 0.0:
        return []
    virgin, rest = system.virgin(), system.at_rest()
    at = system.evaluate(rest, virgin, 0.0)
    none = np.zeros((len(system.bodies.area), 3))
    sense = np.sign(max(nodes, key=lambda n: abs(n.multiplier)).multiplier)
    most = solve_step(system, at, virgin, none, None, sense * _FAR * system.weight * system.length)
    if most is None or abs(most.multiplier) < SHARED * top:
        return []
    times = abs(most.multiplier) / top
    more = f"{times:.2g} times the largest load" if times < _ENDLESS else "far more"
    return [
        f"with dilation as large as friction joints could bear {more}: where they slide hangs on how faces share their "
        "pressure among points, and a path on corners may be off by a third either way; give contact_model='lobatto' "
        "for faces"
    ]


def lost_at_edges(generations: Generations, nodes: list[Node]) -> float:
    """Part by which the largest load would be lower if joints gave way at their edges [-].

    It is 0.0 without a limit point. A face that bears N and has turned by t is pressed over the length x = sqrt(2 N /
    (k t)), with k its stiffness per length, and its force acts x / 3 from the edge. The load lost by that falls with
    the way u as c / sqrt(u), while the curve itself falls by slope u. Their sum is least at 3 cbrt(slope c^2 / 4).

    It is wrong where blocks then move by another mechanism. On small structures in plane it was mostly within a quarter
    of the difference, once at a third of it; in space it was too high on 2 of 12.
    """
    load = np.array([n.multiplier for n in nodes])
    way = np.array([n.control for n in nodes])
    top = int(np.abs(load).argmax())
    if top + 1 >= len(nodes) or load[top] == 0.0:
        return 0.0
    node, after = nodes[top], nodes[top + 1]
    s = generations.structures[node.generation]
    p = s.points
    motion = motion_between(node.pose, after.pose)
    power = float((s.loads.live * motion[:, :6]).sum())
    advance = abs(after.control - node.control)
    if power * load[top] <= 0.0 or advance == 0.0:
        return 0.0
    shift = 0.0  # sum of N times the turn times x / 3 at a turn of one step, per step
    for k in np.unique(p.interface[p.interface >= 0]):
        rows = np.flatnonzero(p.interface == k)
        pressed = float(np.maximum(node.force[rows, 0], 0.0).sum())
        a, b = p.block_a[rows[0]], p.block_b[rows[0]]
        normal = p.directions[rows[0], 0] + node.pose.turn[a] @ p.directions[rows[0], 0]
        spin = motion[b, 3:6] - motion[a, 3:6]
        spin = spin - (spin @ normal) * normal  # what turns about the normal opens nothing
        rate = float(np.linalg.norm(spin))
        if pressed <= 0.0 or rate == 0.0:
            continue
        across = s.assembly.interfaces[k].polygon @ np.cross(normal, spin / rate)
        per_length = p.kn[rows[0]] * s.assembly.arrays.area[k] / float(np.ptp(across))
        shift += pressed * np.sqrt(2.0 * pressed * rate * advance / per_length) / 3.0
    c = shift / abs(power)
    slope = max(abs(load[top]) - abs(load[-1]), 0.0) / abs(way[-1] - way[top])
    return 3.0 * float(np.cbrt(slope * c**2 / 4.0)) / float(abs(load[top]))
