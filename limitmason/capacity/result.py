"""A capacity curve: load multiplier against control displacement, with states, certificates and energy per step."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.certificate import State, StepCertificate, Structure, forces
from limitmason.capacity.kinematics import Pose, motion_between
from limitmason.capacity.path import LASTING, LEVEL
from limitmason.capacity.stepping import Node
from limitmason.capacity.system import System
from limitmason.curve import Curve, CurvePoint
from limitmason.errors import InputError
from limitmason.plane import find_plane
from limitmason.resultants import resultants_from_points, scaled_mechanism
from limitmason.results import Mechanism, Resultants
from limitmason.vibration.blocks import block_system, state_stiffness
from limitmason.vibration.system import VibratingSystem

Array = NDArray[np.float64]


class Energy(NamedTuple):
    """Energy up to every sample [J], shape (n,): work of live and dead loads, stored, lost; and what is left over.

    ``error`` is live + dead - stored - lost over the gross work |dW_live| + |dW_dead| so far, by second-order work.
    """

    live: Array
    dead: Array
    stored: Array
    lost: Array
    error: Array


class Cost(NamedTuple):
    """What a path took: steps, cone programs, Newton iterations of the accepted steps."""

    steps: int
    programs: int
    iterations: int


@dataclass(frozen=True, eq=False)
class PushoverCurve(Curve):
    """Capacity curve by :func:`limitmason.pushover`; the load is the multiplier [-].

    The displacement is that of the control from the state under dead load [m]. Sample 0 is that state.
    """

    structure: Structure | None = None
    system: System | None = None
    nodes: tuple[Node, ...] = ()
    certificates: tuple[StepCertificate, ...] = ()
    energy: Energy | None = None
    jumps: tuple[int, ...] = ()
    origin: Pose | None = None

    @property
    def multiplier(self) -> Array:
        """Load multiplier per sample [-]."""
        return self.load

    @property
    def first_limit_point(self) -> CurvePoint | None:
        """The first sample after which the load falls, or the first of a plateau at the end; None while it rises."""
        largest = float(np.abs(self.load).max())
        falls = np.flatnonzero(np.diff(self.load) < -LEVEL * largest)
        if len(falls):
            return self.point(int(falls[0]))
        first = int(np.argmax(self.load >= self.load[-1] - LEVEL * largest))
        return self.point(first) if len(self) - first >= LASTING else None

    @property
    def cost(self) -> Cost:
        """What the path took."""
        return Cost(len(self) - 1, sum(n.programs for n in self.nodes), sum(n.iterations for n in self.nodes))

    def displacement_of(self, block: int | str) -> Array:
        """Displacement of a block's centroid from the reference pose at every sample [m], shape (n, 3)."""
        assert self.structure is not None
        i = self.structure.assembly.block_index(block)
        return np.array([n.pose.shift[i] for n in self.nodes])

    def vibration(self, *, sample: int = -1, sliding: str = "sticks") -> VibratingSystem:
        """Blocks on the joints that a sample has left closed, for :func:`limitmason.modes`; see there.

        Parameters
        ----------
        sample : of the curve
        sliding : "sticks" or "drops": points at their shear strength keep or lose their shear stiffness
        """
        assert self.structure is not None
        s, node = self.structure, self.nodes[self._sample(sample)]
        components, _, _ = forces(s, state_of(node))
        shear = np.linalg.norm(components[:, 1:], axis=1)
        limit = s.law.over(s.points.area).shear_strength(components[:, 0])
        stiffness, found = state_stiffness(components[:, 0], shear, limit, s.kn, s.ks, sliding)
        plane = None if s.points.components == 3 else find_plane(s.assembly, s.loads)
        label = f"blocks at {self.displacement[sample]:.3g} m of a capacity curve, {found}"
        return block_system(s.assembly, s.points, stiffness[:, : s.points.components], label, plane=plane)

    def mechanism(self, step: int) -> Mechanism | None:
        """Motion from a sample to the next, scaled as a collapse mechanism; of the last, the motion that led to it.

        Raises
        ------
        InputError
            For a sample that the curve does not have.
        """
        assert self.structure is not None
        k = self._sample(step)
        first = k if k + 1 < len(self) else k - 1
        if first < 0:
            return None
        twists = motion_between(self.nodes[first].pose, self.nodes[first + 1].pose)
        p = self.structure.points
        return scaled_mechanism(self.structure.assembly, self.structure.loads, twists, p.position, p.interface)

    def resultants(self, step: int) -> Resultants:
        """Joint forces of a sample, in the joints' frames: those of block a in its reference pose.

        Normal and shear are along the frame that block a carries; moments are about the undeformed joint's centroid,
        with the displacement of the points in it.

        Raises
        ------
        InputError
            For a sample that the curve does not have.
        """
        assert self.structure is not None
        node, p = self.nodes[self._sample(step)], self.structure.points
        components, apart, _ = forces(self.structure, state_of(node))
        force = np.einsum("mc,mci->mi", components, p.directions)
        place = p.position + np.einsum("mc,mci->mi", apart, p.directions)
        return resultants_from_points(self.structure.assembly, place, p.interface, p.area, force)

    def _sample(self, step: int) -> int:
        if not -len(self) <= step < len(self):
            raise InputError(f"the curve has samples 0 to {len(self) - 1}, got {step!r}")
        return range(len(self))[step]


def state_of(node: Node) -> State:
    """What a certificate reads of a node."""
    return State(node.pose.shift, node.pose.turn, node.history.slip, node.history.lift, node.multiplier)
