"""Generations of contacts along a path: from when on which points are, and the equations that go with them."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from limitmason.capacity.certificate import certify
from limitmason.capacity.contact_search.crossing import is_crossing
from limitmason.capacity.contact_search.faces import Shapes
from limitmason.capacity.contact_search.overlap import DEEP, deepest
from limitmason.capacity.contact_search.touching import beside_faces, found_anew, landed, outside
from limitmason.capacity.kinematics import Pose, motion_between
from limitmason.capacity.path_state import PathState, StateForces, Structure, forces, stored
from limitmason.capacity.step_equilibrium import Node, Onward
from limitmason.capacity.system import Evaluated, System

RUNS_OFF = 4.0
"""Overshoots by which a point that bears may run off its face in one step [-]."""

MOVES_ON = 20.0
"""Overshoots by which a place where sides cross may move along the side that carries it in one step [-]."""

_OPEN = 0.1
"""Gap of a joint that still bears its bond, over the block size, up to which a path goes on [-]: chosen."""

_TURNS = 3e-3
"""Moment of its shear at the gap, over that of all forces at a block, up to which a path goes on [-]: chosen."""

_INVERSE = 4
"""Iterations for the smallest stiffness: its size is asked for, not its digits."""

_ANEW = 0.5
"""Motion of the blocks, in overshoots, below which contacts are not looked for again [-]: chosen."""

_BELOW = 0.5
"""Overshoots by which an open point may lie below a face at the end of a shortened step [-]: chosen."""

_MARGIN = 0.9
"""Part of what is allowed to which a step is shortened [-], so that the shorter one does not just miss it: chosen."""

FIRMER = 0.9
"""Stiffness of a point over that at the other end of a step, below which it counts as weaker [-]."""

LEAST = 0.05
"""Least share of a step that is tried where too much would happen in all of it [-]: chosen, so that paths go on."""


@dataclass
class Generations:
    """What a path is made of, generation by generation.

    A new one begins where contacts were found anew.

    Parameters
    ----------
    shapes : faces and corners of the blocks, and the overshoot, a length by which points may pass faces in a step [m];
        None where contacts are never looked for
    make : from a structure to its equations
    structures : model and contact points of every generation
    systems : equations of every generation
    tangents : pose, pose before, slope of the multiplier [1/m] and speed of the blocks [-], as asked last
    """

    shapes: Shapes | None
    make: Callable[[Structure], System]
    structures: list[Structure]
    systems: list[System] = field(default_factory=list)
    # slope and speed over the control displacement, as asked last
    tangents: deque[tuple[Pose, Pose | None, float, float]] = field(default_factory=lambda: deque(maxlen=8))

    def __post_init__(self) -> None:
        """Make the equations of the first generation."""
        self.systems = [self.make(s) for s in self.structures]

    def state(self, node: Node) -> PathState:
        """What a certificate reads of a node."""
        h = node.history
        return PathState(*node.pose, h.slip, h.lift, node.multiplier, h.damage, h.stretched)

    def begun(self, node: Node) -> Node:
        """The node as the next step starts from it: with the contacts that were found anew there."""
        if node.onward is None:
            return node
        return node._replace(
            history=node.onward.history, force=node.onward.force, generation=node.onward.generation, onward=None
        )

    def energy(self, before: Node, after: Node) -> float:
        """Energy that a step leaves over, over its gross work, by the certificate [-]: positive where some is lost."""
        return certify(self.structures[after.generation], self.state(before), self.state(after))[0].energy

    def looked_at(self, node: Node, since: Node) -> Node:
        """The node with the contacts found anew in its pose, if any.

        Its field ``looked`` is the pose in which contacts were last looked for.

        Parameters
        ----------
        node : as it was found
        since : node before it; where blocks have moved by less than half the overshoot since contacts were last looked
            for, they are not looked for
        """
        shapes, s = self.shapes, self.structures[node.generation]
        if shapes is None:
            return node
        before = since.looked or since.pose
        if _farthest(shapes, before, node.pose) < _ANEW * shapes.step:
            return node._replace(looked=before)
        node = node._replace(looked=node.pose)
        found = found_anew(shapes, s.points, node.pose, node.history, node.force, before)
        if found is None:
            return node
        self.structures.append(s._replace(points=found.contacts))
        self.systems.append(self.make(self.structures[-1]))
        history = found.history._replace(stretched=node.history.stretched)  # ties have no contacts: theirs stays
        newest = len(self.structures) - 1
        return node._replace(onward=Onward(newest, history, found.force, before=found.before))

    def bonded(self, node: Node) -> str:
        """Which perfectly plastic joint is open and still bears cohesion or tension, "" where that does not matter.

        A bond ends by opening; the law does not say when. It is taken to matter where points are open by a tenth of a
        block, or where the moment of their shear at the gap is above 0.003 of that of all forces over a block.

        Parameters
        ----------
        node : state of the path
        """
        s = self.structures[node.generation]
        p = s.points
        bond = (np.maximum(p.law.cohesion, p.law.tension) > 0.0) & (np.maximum(p.by_opening, p.by_slip) == 0.0)
        if not bond.any():
            return ""
        # opening without that of dilation and crushing [m], size of the force [N], and its shear at the gap [N m]
        gap = np.where(bond, self.forces(node).apart[:, 0] - node.history.lift, 0.0)
        bears = np.linalg.norm(node.force, axis=1)
        turning = np.linalg.norm(node.force[:, 1:], axis=1) * np.maximum(gap, 0.0)
        most = float((gap * (bears > 0.0)).max())  # largest opening of a point that bears [m]
        if most <= _OPEN * s.size and turning.sum() <= _TURNS * s.size * bears.sum():
            return ""
        k = int((gap * (bears > 0.0)).argmax())
        return (
            f"{s.assembly.joint_text(p.block_a[k], p.block_b[k])} is open by {most:.2g} m and still bears its "
            "perfectly plastic cohesion or tension; give residual values or fracture energies to go on"
        )

    def through(self, node: Node) -> str:
        """Names of two blocks that go through each other in a node, where they have no point, or "" if none do."""
        s = self.structures[node.generation]
        slack = DEEP * s.size
        if self.shapes is not None:
            # corners from which the ends of faces are pulled in pass each other, faces that were apart do not meet
            slack += 2.0 * self.shapes.inset + float(self.shapes.opening.max(initial=0.0))
        found = deepest(s.assembly, s.points, node.pose, node.force, slack)
        if found is None:
            return ""
        a, b = (s.assembly.blocks[i].name for i in found[:2])
        return f"{a!r} and {b!r}, by {found[2]:.2g} m"

    def until_landed(self, before: Node, after: Node) -> float:
        """Share of a step in which no open point comes to lie deep in a face [-].

        It is 1.0 where the whole step is free of that, and never below ``LEAST``, even where a point lands sooner. In a
        longer step blocks would pass through each other before contacts are looked for.

        Parameters
        ----------
        before, after : nodes at both ends of the step
        """
        shapes, s = self.shapes, self.structures[after.generation]
        if shapes is None:
            return 1.0
        travel = _farthest(shapes, before.pose, after.pose)
        if travel < shapes.step:
            return 1.0
        # gaps of the points that landed, at both ends of the step [m]
        was, now = landed(shapes, s.points, before.pose, after.pose, travel)
        # to half an overshoot below the face, by the straight line between both gaps
        share = (was + _BELOW * shapes.step) / (was - now)
        return max(LEAST, float(share.min(initial=1.0)))

    def until_off(self, before: Node, after: Node) -> float:
        """Share of a step in which no point that bears runs off its face by more than a few overshoots [-].

        It is 1.0 where none does in the whole step, and never below ``LEAST``. What a point meets beyond the edge, and
        what it then carries, is found at the end of a step only.

        Parameters
        ----------
        before, after : nodes at both ends of the step
        """
        shapes, s = self.shapes, self.structures[after.generation]
        if shapes is None:
            return 1.0
        # how far points lie outside their faces, and how far they may [m]
        beyond = outside(shapes, s.points, after.pose)
        most = shapes.step * np.where(is_crossing(shapes, s.points), MOVES_ON, RUNS_OFF)
        far = (after.force[:, 0] != 0.0) & (beyond > most)
        if not far.any():
            return 1.0
        was = beside_faces(shapes, s.points, before.pose)
        # of points that were outside already no shorter step tells when they left
        left = far & (was > -shapes.step)
        # by the straight line from ``was`` [m] inside to ``beyond`` outside, to a part of what is allowed
        share = (was + _MARGIN * most)[left] / (was + beyond)[left]
        return max(LEAST, float(share.min(initial=1.0)))

    def changed(self, node: Node) -> float:
        """Elastic energy that a node has more, after its contacts were found anew [J], or 0 where they were not."""
        if node.onward is None:
            return 0.0
        after = self.begun(node)
        before = stored(self.structures[node.generation], self.state(node))
        return stored(self.structures[after.generation], self.state(after)) - before

    def _reached(self, node: Node, before: Node | None) -> Evaluated:
        """A node as it was reached from the one before, with the tangents of that step."""
        old = node.history if before is None else self.begun(before).history
        return self.systems[node.generation].evaluate(node.pose, old, node.multiplier)

    def rise(self, node: Node, before: Node | None, move: float) -> float:
        """By how much the multiplier rises over a control displacement, by the tangent at a node [-].

        It is nan where that is singular.

        Parameters
        ----------
        node : state of the path
        before : node from which it was reached, whose slip decides which points slide on; None for the first
        move : the control displacement, signed [m]
        """
        return move * self._tangent(node, before, move)[0]

    def paces(self, last: Node, before: Node | None, new: Node) -> list[float]:
        """How far blocks would move in a step by the tangent at its start and by that at its end [m], inf if singular.

        Parameters
        ----------
        before : node from which ``last`` was reached
        last, new : nodes at both ends of the step
        """
        move = new.control - last.control
        told = [abs(move) * self._tangent(*ends, move)[1] for ends in ((last, before), (new, last))]
        return np.nan_to_num(told, nan=np.inf).tolist()

    def _tangent(self, node: Node, before: Node | None, move: float) -> tuple[float, float]:
        """Slope of the multiplier [1/m] and speed of all blocks [-], by the tangent.

        Both are per control displacement, and NaN where the tangent is singular.

        Parameters
        ----------
        node, before : as of :meth:`rise`
        move : control displacement over which the tangent is taken, signed [m]
        """
        since = None if before is None else before.pose
        # of a sample that is asked for again the poses are the same objects: its tangent is kept
        for pose, other, slope, speed in self.tangents:
            if pose is node.pose and other is since:
                return slope, speed
        step = self.systems[node.generation].along_tangent(self._reached(node, before), move)
        # motion in own units and, last, multiplier, per control displacement [m]
        own = np.full(2, np.nan) if step is None else step / move
        slope, speed = float(own[-1]), float(np.linalg.norm(own[:-1])) * self.structures[0].length
        self.tangents.append((node.pose, since, slope, speed))
        return slope, speed

    def handed(self, before: Node, begun: Node, new: Node, toward: float) -> float:
        """What contacts found anew at the start of a step took off the load [-].

        It is the fall in the step beyond that by the tangent of the new contacts, from 0 to the whole fall. It is 0
        where no contacts were found anew, or the load rose.

        Parameters
        ----------
        before, begun : node at the start, as it was reached, and with the new contacts with which the step begins
        new : node at the end
        toward : sign of the load in the sense in which it is pushed
        """
        fell = toward * (before.multiplier - new.multiplier)
        if before.onward is None or fell <= 0.0:
            return 0.0
        # without what was taken off the load would have changed by the tangent; where that is singular nothing is
        # known, and all of a fall by a jump counts
        rises = toward * self.rise(new, begun, new.control - begun.control)
        return float(np.clip(fell + rises, 0.0, fell)) if np.isfinite(rises) else fell * new.jump

    def weakest_rise(self, nodes: list[Node], new: Node, move: float) -> float | None:
        """Rise of the multiplier over a step with the softer tangent of every point [-].

        Of the tangents of a point at both ends of the step the softer one is taken. None where one end has all of
        these, so that nothing new is told; NaN where the structure's tangent is then singular. Points that let go make
        a path less steep, those that take hold steeper. Where both happen in a step this is as steep as it falls,
        whichever came first.

        Parameters
        ----------
        nodes : path so far
        new : state at the end of the step
        move : control displacement of the step, signed [m]
        """
        last = nodes[-1]
        at, was = self._reached(new, last), self._reached(last, nodes[-2] if len(nodes) > 1 and not last.jump else None)
        now, earlier = at.returned.tangent, was.returned.tangent
        if last.onward is not None:
            # rows of points before contacts were found anew; a new point has no earlier tangent
            anew = last.onward.before
            earlier = np.where((anew < 0)[:, None, None], now, earlier[anew])
        # of every point the trace of its tangent tells how stiff it is
        own, others = (np.trace(t, axis1=1, axis2=2) for t in (now, earlier))
        weaker = others < FIRMER * own
        if not (weaker.any() and (own < FIRMER * others).any()):
            return None
        mixed = at.returned._replace(tangent=np.where(weaker[:, None, None], earlier, now))
        step = self.systems[new.generation].along_tangent(at._replace(returned=mixed), move)
        return np.nan if step is None else float(step[-1])

    def sense(self, node: Node, before: Node | None, prescribed: str) -> int:
        """Sign of the tangent's determinant, see :meth:`System.sense`.

        Parameters
        ----------
        node : state of the path
        before : node from which it was reached, whose slip decides which points slide on
        prescribed : what is kept, "multiplier" for constant load or "control" for a held displacement
        """
        return self.systems[node.generation].sense(self._reached(node, before), prescribed)

    def softest(self, node: Node, before: Node | None) -> float:
        """Smallest stiffness of the structure where its control displacement is held, 0 if singular.

        It is the smallest absolute eigenvalue of the tangent K, bordered by the control displacement held at zero and
        the multiplier as its reaction. Inverse iterations, x = K^-1 (x / |x|), tend to its reciprocal. Unit: mean
        block weight over elastic length (load over displacement in the units of :mod:`limitmason.capacity.system`).

        Parameters
        ----------
        before : node from which it was reached, whose slip decides which points slide on
        """
        system = self.systems[node.generation]
        # any start that is not orthogonal to the softest motion; the seed makes runs repeat
        motion = np.random.default_rng(0).standard_normal(system.order)
        try:
            factors = system.bordered(self._reached(node, before), "control")
        except RuntimeError:
            return 0.0
        for _ in range(_INVERSE):
            # the right side: a force of length one, and no displacement of the control
            motion = factors.solve(np.append(motion / np.linalg.norm(motion), 0.0))[:-1]
        return 1.0 / max(float(np.linalg.norm(motion)), 1e-300)

    def forces(self, node: Node) -> StateForces:
        """Forces and displacements of a node's points, see :func:`.path_state.forces`."""
        return forces(self.structures[node.generation], self.state(node))


def _farthest(shapes: Shapes, before: Pose, after: Pose) -> float:
    """The farthest that any corner of a block may have moved between two poses [m]: |shift| + |spin| times its arm."""
    motion = motion_between(before, after)
    way = np.linalg.norm(motion[:, :3], axis=1) + np.linalg.norm(motion[:, 3:6], axis=1) * shapes.spread
    return float(way.max(initial=0.0))
