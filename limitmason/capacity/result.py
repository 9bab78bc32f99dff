"""A capacity curve: load multiplier against control displacement, with states, certificates and energy per step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.curve import Curve, CurvePoint, Energy
from limitmason.answers.results import Mechanism, Resultants
from limitmason.arrays import Array, Index
from limitmason.capacity.certificate import StepCertificate
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.kinematics import Pose, motion_between
from limitmason.capacity.limit_point import first_limit_point
from limitmason.capacity.path_state import Structure, strength, tensions
from limitmason.capacity.path_warnings import STIFFER, second_moment_ratio
from limitmason.capacity.step_equilibrium import Node, handed_over
from limitmason.deformable.levels import RIGID
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.mechanics.plane import find_plane
from limitmason.mechanics.resultants import resultants_from_points, scaled_mechanism
from limitmason.vibration.blocks import block_system, state_stiffness
from limitmason.vibration.system import VibratingSystem

_NO_LOAD = 1e-9
"""Load over the largest one below which it is rounding [-]."""


class Break(NamedTuple):
    """Joints that lose their strength at once.

    Parameters
    ----------
    sample : number of the sample after the break
    joints : names of both blocks of every joint
    points : how many contact points broke
    energy : what the structure gives off at the same displacement, to the joints and to motion [J]
    """

    sample: int
    joints: tuple[str, ...]
    points: int
    energy: float


class Cost(NamedTuple):
    """What a path took: numbers of accepted steps, of cone programs, and of Newton iterations of these steps."""

    steps: int
    programs: int
    iterations: int

    @property
    def provenance(self) -> dict[str, int]:
        """These numbers as a prediction tells them."""
        return {"steps": self.steps, "programs": self.programs, "Newton iterations": self.iterations}


class SampleStability(StrEnum):
    """What a state would do if it were left alone."""

    STABLE = "stable"
    HELD = "held by the control"
    UNSTABLE = "unstable"


@dataclass(frozen=True, eq=False, kw_only=True)
class PushoverCurve(Curve):
    """Capacity curve by :func:`limitmason.pushover`.

    Displacement, load, their units and the label are those of Curve. The load is the multiplier [-], or a moved
    support's force [N]. The displacement is that of the control from the state under dead load [m]. Sample 0 is that
    state.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : state of every sample
    certificates : how well each state keeps the theory, of every sample
    energy : works and energies of every sample
    jumps : numbers of the samples that no states led to
    breaks : what broke at once, and at which samples
    origin : pose under dead load, from which displacements count
    unit : load of multiplier 1, in ``load_unit``
    toward : sign of a load that pushes: with ``to`` below zero loads are negative, and the peak is the lowest
    """

    generations: Generations
    nodes: tuple[Node, ...] = ()
    certificates: tuple[StepCertificate, ...] = ()
    energy: Energy | None = None
    jumps: tuple[int, ...] = ()
    breaks: tuple[Break, ...] = ()
    origin: Pose | None = None
    unit: float = 1.0
    toward: float = 1.0

    @property
    def _sense(self) -> float:
        """Sign of the loads of which the peak is taken: that of the push, if it came to such a load, else the other.

        A way back may end before the load has changed its sign, and a support that yields is pushed less and less.
        """
        came = (self.toward * self.load).max() > _NO_LOAD * np.abs(self.load).max()
        return self.toward if came else -self.toward

    @property
    def multiplier(self) -> Array:
        """Load multiplier per sample [-].

        Where a support moves, it is the force on that support over the dead load.
        """
        return self.load / self.unit

    def as_force(self) -> Curve:
        """This curve with the resultant of its live loads instead of their multiplier [N].

        Loads on held degrees of freedom do not count. A curve of forces already stays as it is.

        Raises
        ------
        InputError
            For live loads without a resultant, such as a couple.
        """
        if self.load_unit != "-":
            return self
        # what acts on held freedoms goes straight to the support
        force = self.structure.loads.live[:, :3] * ~self.structure.assembly.held[:, :3]
        resultant = float(np.linalg.norm(force.sum(axis=0)))
        # the rounding of forces that cancel
        if resultant <= 1e-9 * float(np.abs(force).sum()):
            raise InputError("the live loads of this curve have no resultant: draw its multiplier alone")
        return replace(self, load=resultant * self.load, load_unit="N", unit=resultant)

    def in_units(self, displacement_unit: str, displacement: float, load_unit: str, load: float) -> Curve:
        """This curve in other units; its multiplier stays as it is.

        Parameters
        ----------
        displacement_unit, displacement, load_unit, load : as of :meth:`.Curve.in_units`
        """
        found = super().in_units(displacement_unit, displacement, load_unit, load)
        assert isinstance(found, PushoverCurve)
        return replace(found, unit=load * self.unit)

    @property
    def first_limit_point(self) -> CurvePoint | None:
        """The largest load before one that has passed it, in the sense of the push.

        A limit point is passed where the load is 0.2 % below it, what contacts found anew take off aside; where it has
        not risen while the displacement doubled, or by less than 0.02 % over 0.02 blocks; or where it is below at the
        end of the curve. Shallower and shorter dips hang on the steps. It is None while the load rises.
        """
        lacks = handed_over(self.toward, self.nodes) * abs(self.unit)
        # beside the size of blocks displacements are in metres, whatever the unit of the curve
        way = self.displacement if self.displacement_unit == "m" else np.array([n.control for n in self.nodes])
        found = first_limit_point(np.sign(self.unit) * self.toward * self.load, way, lacks, self.structure.size)
        return None if found is None else self.point(found)

    @property
    def cost(self) -> Cost:
        """What the path took."""
        return Cost(len(self) - 1, sum(n.programs for n in self.nodes), sum(n.iterations for n in self.nodes))

    @property
    def structure(self) -> Structure:
        """The model with the contact points of the reference pose."""
        return self.generations.structures[0]

    def displacement_of(self, block: int | str, at: ArrayLike | None = None) -> Array:
        """Displacement of a point of a block from the reference pose [m], shape (n, 3).

        By default the point is the centroid.

        Parameters
        ----------
        block : number or name
        at : the point in the reference pose [m], shape (3,); it moves with the block, and with the bending of one that
            deforms
        """
        assembly = self.structure.assembly
        i = assembly.block_index(block)
        shift = np.array([n.pose.shift[i] for n in self.nodes])
        if at is None and self.structure.deformation is None:
            return shift
        arm = np.asarray(assembly.centroids[i] if at is None else at, dtype=float) - assembly.centroids[i]
        if arm.shape != (3,) or not np.isfinite(arm).all():
            raise InputError(f"at must be a point x, y, z [m], got {at!r}")
        bent = np.zeros_like(shift)
        if (d := self.structure.deformation) is not None:
            bent = d.displacement(i, assembly.centroids[i] + arm, np.array([n.pose.shapes[i] for n in self.nodes]))
        return shift + bent + np.array([n.pose.turn[i] @ (arm + u) for n, u in zip(self.nodes, bent, strict=True)])

    @property
    def tie_force(self) -> Array:
        """Tension in every tie of the assembly [N], shape (n, t).

        It is laid out as :attr:`dem.History.tie_force`.
        """
        made = self.generations
        rows = [tensions(made.structures[n.generation], made.state(n))[0] for n in self.nodes]
        return np.array(rows).reshape(len(self.nodes), len(self.structure.assembly.ties))

    @property
    def _rows_of_ties(self) -> Index:
        a = self.structure.assembly
        return len(a.interfaces) + np.arange(len(a.ties))

    def vibration(self, *, sample: int = -1, sliding: str = "sticks") -> VibratingSystem:
        """Blocks on the joints that a sample leaves closed, for :func:`limitmason.modes`.

        Parameters
        ----------
        sample : of the curve
        sliding : "sticks" or "drops": points at their shear strength keep or lose their shear stiffness

        Raises
        ------
        InputError
            For a sample that the curve does not have.
        NotApplicable
            Where contacts had been found anew by that sample.
        """
        s, node = self.structure, self.nodes[self._sample(sample)]
        if node.generation:
            raise NotApplicable(f"sample {sample}: contacts were found anew on the way: its blocks lie on no joints")
        components = self.generations.forces(node).components
        p = s.points
        shear = np.linalg.norm(components[:, 1:], axis=1)
        left = strength(s, self.generations.state(node)).over(p.area)
        limit = left.shear_strength(components[:, 0])
        stiffness, found = state_stiffness(components[:, 0], shear, limit, left.tension, p.kn, p.ks, sliding)
        plane = None if s.points.components == 3 else find_plane(s.assembly, s.loads)
        warnings: tuple[str, ...] = ()  # of the system whose modes are then asked for
        if plane is not None:
            warnings = ("the path was followed in its plane: only modes in this plane are found, none across it",)
        label = f"blocks at {self.displacement[sample]:.3g} {self.displacement_unit} of a capacity curve, {found}"
        points = ContactPoints(p.place_a, p.interface, p.area, p.directions, p.block_a, p.block_b)
        if (times := second_moment_ratio(s.assembly, points).max()) > STIFFER:
            warnings += (
                f"joints with two points on a side turn up to {times:.2g} times as stiffly as their faces: frequencies "
                f"are up to {times**0.5:.2g} times too high; follow the path with contact_model='grid'",
            )
        shapes, blocks = (None, RIGID) if s.deformation is None else (s.deformation.shapes, s.deformation.blocks)
        return block_system(s.assembly, points, stiffness[:, : p.components], label, warnings, plane, shapes, blocks)

    def mechanism(self, step: int) -> Mechanism | None:
        """Motion from sample ``step`` to the next, scaled as a collapse mechanism.

        For the last sample it is the motion that led to it; None of a curve of one sample.

        Raises
        ------
        InputError
            For a sample that the curve does not have.
        """
        k = self._sample(step)
        first = k if k + 1 < len(self) else k - 1
        if first < 0:
            return None
        twists = motion_between(self.nodes[first].pose, self.nodes[first + 1].pose)[:, :6]
        s = self.structure
        x, ties = s.assembly.links, self._rows_of_ties
        place, interface = np.concatenate([s.points.place_a, x.centre[ties]]), np.append(s.points.interface, ties)
        return scaled_mechanism(s.assembly, s.loads, twists, place, interface)

    def resultants(self, step: int) -> Resultants:
        """Joint forces of sample ``step``, in the joints' frames: those of the reference pose.

        Ties follow the joints.

        Every force is turned back with the block that carries its frame; moments are about the undeformed joint's
        centroid, with the displacement of the points in it.

        Raises
        ------
        InputError
            For a sample that the curve does not have.
        NotApplicable
            Where blocks press on each other that had no joint: no joint could carry these forces.
        """
        node = self.nodes[self._sample(step)]
        s = self.generations.structures[node.generation]
        p = s.points
        at = self.generations.forces(node)
        components, mine = at.components, p.interface >= 0  # points of joints, not of blocks that met on the way
        if components[~mine].any():
            # the one of the others that bears most
            i = int(np.flatnonzero(~mine)[int(np.abs(components[~mine]).max(axis=1).argmax())])
            a, b = (s.assembly.blocks[k].name for k in (p.block_a[i], p.block_b[i]))
            raise NotApplicable(f"sample {step}: {a!r} and {b!r} press on each other, which had no joint")
        place, force = at.on_joints(p)
        x, ties = s.assembly.links, self._rows_of_ties
        return resultants_from_points(
            s.assembly, np.concatenate([place[mine], x.centre[ties]]), np.append(p.interface[mine], ties),
            np.append(p.area[mine], x.area[ties]),
            np.concatenate([force[mine], tensions(s, self.generations.state(node))[0][:, None] * x.normal[ties]]),
        )

    def stability(self, step: int) -> SampleStability:
        """Whether sample ``step`` would stand under its load alone, or is held by the control.

        By the sign of the determinant of the tangent (sliding points slide on, open ones stay open) against that of
        sample 0, which is taken as stable: an even number of modes lost at once is not seen. A singular tangent,
        sign 0, counts as one of another sign. ``UNSTABLE`` is a state that not even the control holds.

        Raises
        ------
        InputError
            For a sample that the curve does not have.
        """
        k = self._sample(step)
        before = self.nodes[k - 1] if k else None
        held, alone = (
            self.generations.sense(self.nodes[k], before, prescribed)
            == self.generations.sense(self.nodes[0], before=None, prescribed=prescribed)
            for prescribed in ("control", "multiplier")
        )
        if not held:
            return SampleStability.UNSTABLE
        return SampleStability.STABLE if alone else SampleStability.HELD

    def controlled(self, shift: Array) -> float:
        """The control displacement [m] of blocks whose centroids are displaced by ``shift`` [m], shape (n, 3)."""
        system = self.generations.systems[0]
        return system.controlled(system.at_rest()._replace(shift=shift))

    def _sample(self, step: int) -> int:
        """Number of a sample from 0 on, for one that may count back from the end, -1 the last."""
        if not self.nodes:
            raise InputError(f"the curve has no states, it {self.status}")
        if not (isinstance(step, int | np.integer) and -len(self) <= step < len(self)):
            raise InputError(f"the curve has samples 0 to {len(self) - 1}, got {step!r}")
        return range(len(self))[step]
