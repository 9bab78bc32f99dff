"""Joints that give way at the edge on which a block rocks: what a path on corners leaves out.

On corners a block rocks about the very edge of a joint. On a face of stiffness kn the pressure near that edge is a
triangle of length x = sqrt(2 N / (k theta)), k the stiffness per length across the joint: the force stands x / 3
inside. With hinges that turn at rates r_j per control displacement u the load is, to first order,

    lambda(u) = lambda_0 - C / sqrt(u) - g u,   C = sum N_j r_j sqrt(2 N_j / (k_j r_j)) / 3 / (live power),

with -g the slope that displacements give it. It is largest at u = (C / 2 g)^(2/3), lower than lambda_0 by
3 (g C^2 / 4)^(1/3).

``nodes`` are the states of the path, in their order.
"""

import numpy as np

from limitmason.arrays import Array, Flags, Index
from limitmason.capacity.certificate import work_of_loads
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.contacts import NEW, standard_points
from limitmason.capacity.kinematics import motion_between
from limitmason.capacity.program import solve_step
from limitmason.capacity.step_equilibrium import Node
from limitmason.mechanics.contact_points import LOBATTO, ContactPoints, weakening
from limitmason.mechanics.resultants import resultants_from_points, twisted_joints
from limitmason.model.assembly import Assembly

TOLD = 0.015
"""Part of the largest load from which what corners leave out is told [-]: the estimate is good to a quarter."""

GLUED_FACES = (
    "7 x 7 points stand for each face of glued joints: on small structures in space the load was up to 4 % off from "
    "9 x 9, and displacements before the peak up to 60 %; contact_model='lobatto', grid=(9, 9) comes nearer"
)
"""Measured on the structures of ``tests/referee/defaults.py``, beside 9 x 9 points."""

SHARED = 1.5
"""Largest load of an associative path over that of the path, in space, from which it is told [-]."""

STIFFER = 1.02
"""Second moment of a joint's points over that of its face from which it is told [-]."""

NEARLY, UNSURE = 0.98, 0.01
"""Part of the largest load whose displacement is told, and by how much loads hang on points that crush or break [-]."""

LEVEL = 0.05
"""Spread of that displacement from which it is told [-]; it is 2 % on a straight line."""

# chosen, not derived: far from both what rounding leaves and what would change a warning
_CRUSHED = 1e-6
"""Part of its strength up to which a point crushes [-]."""

_AT_END = 1e-3
"""Part of the width of a joint within which a point lies at its end [-]."""

_BEARS = 1e-2
"""Part of what a joint bears up to which its points inside bear nothing [-]."""

_ENDLESS = 1e3
"""Times the largest load from which no number is told: it is next to infinite."""

_NEUTRAL = 1e-3
"""Stiffness of motions that nothing drives or holds, over that of the elastic length over the size of a block [-]."""

_FAR = 1e6
"""Advance of the live load that outweighs what elastic forces cost, in block weights times elastic lengths."""


def stiffness_warnings(assembly: Assembly, points: ContactPoints, named: Flags) -> list[str]:
    """What to say where points turn joints of a stiffness that somebody named more stiffly than faces.

    Parameters
    ----------
    points : contact points of the reference pose
    named : interfaces whose stiffness was given, shape (k,)
    """
    times = second_moment_ratio(assembly, points)[named[np.unique(points.interface)]]
    too_stiff = times[times > STIFFER]
    if not len(too_stiff):
        return []
    return [
        f"{len(too_stiff)} of {len(times)} joints of a given stiffness have two points on a side, which turn up to "
        f"{too_stiff.max():.2g} times as stiffly as their faces: displacements before the largest load may be far off, "
        "mostly too small; give contact_model='lobatto' for them"
    ]


def second_moment_ratio(assembly: Assembly, points: ContactPoints) -> Array:
    """How much stiffer a joint's points turn than its face: the largest ratio of their second moments [-].

    With J = sum A r r^T over the points, and the integral of r r^T over the face, r from the face's centroid in its
    plane, it is the largest eigenvalue of J_face^-1 J_points. It is 3 of two points on a side, and 4 of the corners of
    a triangle.

    Parameters
    ----------
    assembly : blocks and joints
    points : contact points in the reference pose, those of one joint one after another

    Returns
    -------
    one number for every joint that has points, in the order of the interfaces
    """
    x, first = assembly.arrays, np.flatnonzero(np.diff(points.interface, prepend=-1))
    tangents = np.zeros((len(x.area), *points.directions[0, 1:].shape))
    tangents[points.interface[first]] = points.directions[first, 1:]

    def along(place: Array, owner: Index) -> Array:
        """Coordinates of places in the plane of their faces, from the centroid [m]."""
        return np.asarray(np.einsum("mci,mi->mc", tangents[owner], place - x.centre[owner]))

    # triangles from the centroid to the sides. With p and q its other corners a triangle of area A has
    # A / 12 ((p + q)(p + q)^T + p p^T + q q^T); the cross product is twice the area
    owner, following = x.corner_owner, np.arange(1, len(x.corners) + 1)
    following[x.corner_start[1:] - 1] = x.corner_start[:-1]  # after the last corner of a face comes its first
    one, two = x.corners - x.centre[owner], (x.corners - x.centre[owner])[following]
    part = np.einsum("mi,mi->m", np.cross(one, two), x.normal[owner]) / 24.0
    one, two = along(x.corners, owner), along(x.corners[following], owner)
    of_face = np.einsum("m,mi,mj->mij", part, one + two, one + two)
    of_face += np.einsum("m,mi,mj->mij", part, one, one) + np.einsum("m,mi,mj->mij", part, two, two)
    of_face = np.add.reduceat(of_face, x.corner_start[:-1])[points.interface[first]]
    arm = along(points.position, points.interface)
    of_points = np.add.reduceat(np.einsum("m,mi,mj->mij", points.area, arm, arm), first)
    return np.asarray(np.linalg.eigvals(np.linalg.solve(of_face, of_points)).real.max(axis=1))


def flat_top_warnings(nodes: list[Node]) -> list[str]:
    """What to say where joints crush or break and the load is nearly level before its largest.

    Points of a face bear its load to a part of ``UNSURE`` only, so that the displacement at which ``NEARLY`` all of the
    largest load is reached may hang on them.
    """
    load, way = np.array([(abs(n.multiplier), abs(n.control - nodes[0].control)) for n in nodes]).T
    top = int(load.argmax())
    # displacements [m] at which a little less than that load, the load itself, and a little more are first reached
    shares = NEARLY + np.array([-UNSURE, 0.0, UNSURE])
    low, at, high = np.interp(shares * load[top], np.maximum.accumulate(load[: top + 1]), way[: top + 1])
    if high <= (1.0 + LEVEL) * low:
        return []
    return [
        f"points at which joints crush or break bear a load to {UNSURE:.0%} or so: {NEARLY:.0%} of the largest is "
        f"reached at {at:.3g} m, or anywhere from {low:.3g} to {high:.3g} m"
    ]


def landed_warnings(generations: Generations, nodes: list[Node]) -> list[str]:
    """What to say where, along a path, blocks that had no joint meet and their points crush.

    Such a point has the law and the area of one of a joint nearby, so that its strength is not that of its own face.
    """
    for node in nodes:
        s = generations.structures[node.generation]
        c = s.points
        # points between blocks that had no joint, at their compressive strength
        full = (c.interface == NEW) & (node.force[:, 0] > (1.0 - _CRUSHED) * c.law.crushing * c.area)
        if full.any():
            k = int(full.argmax())
            a, b = (s.assembly.blocks[i].name for i in (c.block_a[k], c.block_b[k]))
            way = node.control - nodes[0].control
            return [
                f"{a!r} and {b!r} had no joint, met and crush where they meet, from {way:.3g} m on: "
                "those points have the area of one in a joint nearby, so that loads from there on may be far off; "
                "draw the blocks in contact and give the distance as gaps="
            ]
    return []


def edge_warnings(generations: Generations, nodes: list[Node], remedy: str) -> list[str]:
    """What to say where faces of the same stiffness would bear less than the few points of a path.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    remedy : option of :func:`limitmason.pushover` that the warning advises, in words
    """
    lost = lost_at_edges(generations, nodes)
    if lost < TOLD:
        return []
    return [
        "blocks rock on the ends of their joints, which do not give way: faces of this stiffness would bear about "
        f"{lost:.1%} less, by an estimate to first order; give {remedy} for them"
    ]


def pressure_sharing_warnings(generations: Generations, nodes: list[Node]) -> list[str]:
    """What to say where friction in space bears far less than it could, by how the points of faces share the pressure.

    Below the associative limit load equilibrium leaves many states open; which one a path takes, and so the load at
    which it slides, hangs on the springs of its points. Of 14 structures in space two bore less than two thirds of
    that load, and moved by 28 and 49 % on finer points; the others bore 88 % of it and more, or had other reasons.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    system = generations.systems[0]
    top = max(abs(n.multiplier) for n in nodes)
    in_plane = system.bodies.directions.shape[1] == 2
    if in_plane or top == 0.0:
        return []
    virgin, rest = system.virgin(), system.at_rest()
    at = system.evaluate(rest, virgin, multiplier=0.0)
    # the associative limit load: a program without elastic forces, whose load is pushed so far that these cost nothing
    none = np.zeros((len(system.bodies.area), 3))
    sense = np.sign(max(nodes, key=lambda n: abs(n.multiplier)).multiplier)
    most = solve_step(
        system, at, virgin, elastic=none, normal=None, advance=sense * _FAR * system.weight * system.length
    )
    if most is None or abs(most.multiplier) < SHARED * top:
        return []
    times = abs(most.multiplier) / top
    more = f"{times:.2g} times the largest load" if times < _ENDLESS else "far more"
    return [
        f"with dilation as large as friction joints could bear {more}: where they slide hangs on how faces share their "
        "pressure among points, and a path on corners may be off by a third either way; give contact_model='lobatto' "
        "for faces"
    ]


def torsion_warnings(generations: Generations, nodes: list[Node]) -> list[str]:
    """What to say where corners carry torsion that faces would not, at the largest load in space.

    Friction at the corners of a square resists torsion 1.85 times as well as under even pressure. ``generations`` have
    standard points.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    system = generations.systems[0]
    # faces of a plane structure do not twist, and those of other joints have points inside
    in_plane = system.bodies.directions.shape[1] == 2
    if in_plane or standard_points(generations.structures[0].assembly, None)[0] != "vertices":
        return []
    node = max(nodes, key=lambda n: abs(n.multiplier))
    s = generations.structures[node.generation]
    p = s.points
    mine = p.interface >= 0
    place, force = generations.forces(node).on_joints(p)
    found = resultants_from_points(s.assembly, place[mine], p.interface[mine], p.area[mine], force[mine])
    twisted = np.flatnonzero(twisted_joints(s.assembly, found, system.weight))
    if not len(twisted):
        return []
    joint = s.assembly.interfaces[int(twisted[0])]
    between = s.assembly.joint_text(joint.block_a, joint.block_b)
    return [
        f"faces twist, as at {between}: their corners carry more torsion than faces under even pressure. The load may "
        "be too high, by a quarter where a block is pushed off its centre; give contact_model='lobatto' for faces"
    ]


def branch_warnings(generations: Generations, nodes: list[Node]) -> list[str]:
    """What to say where a path goes on over states that do not stand even at a held displacement.

    The determinant of the tangent, bordered by the control, changes its sign where another branch leaves. States that
    are neutral there, as of parts that slide by themselves, do not count: the smallest stiffness must be seen beside
    what displacements of an elastic length change in forces. An even number of modes lost at once is not seen, nor a
    branch that is left in the step that comes to it.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    first, found = generations.sense(nodes[0], before=None, prescribed="control"), []
    for k in range(1, len(nodes)):
        if generations.sense(nodes[k], before=nodes[k - 1], prescribed="control") == first:
            continue
        system = generations.systems[nodes[k].generation]
        if generations.softest(nodes[k], nodes[k - 1]) > _NEUTRAL * system.length / system.size:
            found.append(k)
    if not found:
        return []
    start = nodes[found[0]]
    return [
        f"bifurcation: {len(found)} of {len(nodes)} samples do not stand even at a held displacement, the first at "
        f"{start.control - nodes[0].control:.4g} m, lambda {start.multiplier:.5g}: there the smallest disturbance "
        "leads off this path, to another load; curve.stability(k) tells of each sample"
    ]


def lost_at_edges(generations: Generations, nodes: list[Node]) -> float:
    """Part by which the largest load would be lower if joints gave way at their edges [-], to first order.

    It is 0.0 without a limit point. Joints count that bear on their edges alone. A face that bears N and has turned by
    t is pressed over the length x = sqrt(2 N / (k t)), with k its stiffness per length, and its force acts x / 3 from
    the edge. The load lost by that falls with the way u as c / sqrt(u), while the curve itself falls by slope u. Their
    sum is least at 3 cbrt(slope c^2 / 4).

    It is wrong where blocks then move by another mechanism. On small structures in plane it was mostly within a quarter
    of the difference, once at a third of it; in space it was too high on 2 of 12.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    load = np.array([n.multiplier for n in nodes])
    way = np.array([n.control for n in nodes])
    top = int(np.abs(load).argmax())
    # the load still rises at the end, or there is none
    if top + 1 >= len(nodes) or load[top] == 0.0:
        return 0.0
    node, after = nodes[top], nodes[top + 1]
    s = generations.structures[node.generation]
    p = s.points
    motion = motion_between(node.pose, after.pose)
    power = work_of_loads(s, "live", generations.state(node), generations.state(after))
    advance = abs(after.control - node.control)
    # the motion after the largest load is no mechanism of this load
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
        rate = float(np.linalg.norm(spin))  # turn of the joint in the step [rad]
        if pressed <= 0.0 or rate == 0.0:
            continue  # a joint without pressure, or that does not turn, has no edge to give way at
        axis = np.cross(normal, spin / rate)  # in the face, square to the edge
        # coordinates across the axis of the turn: of the joint's corners, whose range is its width, and of its points
        across, place = s.assembly.interfaces[k].polygon @ axis, p.place_b[rows] @ axis
        to_end = np.minimum(place - place.min(), place.max() - place) / float(np.ptp(across))
        per_length = p.kn[rows[0]] * s.assembly.arrays.area[k] / float(np.ptp(across))
        if float(np.maximum(node.force[rows, 0], 0.0)[to_end > _AT_END].sum()) > _BEARS * pressed:
            continue  # points that bear inside the face give way at its edge by themselves
        shift += pressed * np.sqrt(2.0 * pressed * rate * advance / per_length) / 3.0
    c = shift / abs(power)
    slope = max(abs(load[top]) - abs(load[-1]), 0.0) / abs(way[-1] - way[top])
    return 3.0 * float(np.cbrt(slope * c**2 / 4.0)) / float(abs(load[top]))


def followed_warnings(
    generations: Generations, nodes: list[Node], contact_model: str | None, standard: bool, *, named: bool
) -> list[str]:
    """Warnings of a path that was followed from its unstressed state.

    Parameters
    ----------
    generations, nodes : the path
    contact_model, standard : as asked for, and whether points are the default ones
    named : whether any joint has a stiffness of its own
    """
    found = branch_warnings(generations, nodes) + (torsion_warnings(generations, nodes) if standard else [])
    return found + (_point_warnings(generations, nodes, contact_model, standard) if named else [])


def _point_warnings(
    generations: Generations, nodes: list[Node], contact_model: str | None, standard: bool
) -> list[str]:
    """Warnings of what few points leave out of faces whose stiffness is named.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    contact_model : name of the points that the user asked for; None where he named none
    standard : whether the points are those of :func:`.standard_points`, as neither model nor grid was given
    """
    # other points were chosen with a grid, by whoever knows what he leaves out
    if not standard and contact_model != LOBATTO:
        return []
    # joints that crush or break have many points on a side: only where their load is nearly reached is uncertain
    if weakening(generations.structures[0].assembly).any():
        return flat_top_warnings(nodes) if standard else []
    points = generations.structures[0].points
    # joints in space with cohesion or tension: only for these does the standard name a grid, of 7 x 7 points
    glued = points.components == 3 and standard_points(generations.structures[0].assembly, plane=None)[1] is not None
    if not standard or glued:
        return edge_warnings(generations, nodes, "more points by grid=") + [GLUED_FACES] * (standard and glued)
    remedy = "contact_model='lobatto'"
    return edge_warnings(generations, nodes, remedy) + pressure_sharing_warnings(generations, nodes)
