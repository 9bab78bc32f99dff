"""The state of a simulation: contact points, joints and bodies.

Copied for save and restore, written for resume.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.kernels import BlockModes, Joints, NearPairs, Points, RigidBodies, Ties
from dem.kernels.deformed import PLANE_MODES, SPACE_MODES
from dem.model.stable_step import owners, points_of
from dem.model.strain_shapes import (
    BlockStress,
    StrainShapes,
    block_stresses,
)
from dem.model.tie_arrays import NO_TIES, pulls, stored_energy
from limitmason.answers.results import Resultants
from limitmason.arrays import Array, Flags, Index
from limitmason.errors import InputError, NotConverged
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors
from limitmason.mechanics.resultants import resultants_from_points
from limitmason.model import Assembly, Loads
from limitmason.model.fingerprint import Fingerprint
from limitmason.storage.files import Archive, read_archive, write_archive

ENDS = 10
"""Columns of ``State.ends``, see :mod:`dem.model.edge_points`."""

REST, WEIGHT, LIVE, WEIGHT_X, WEIGHT_Y = range(5)
"""Load cases of ``State.factors``: dead loads but weight, weight, live loads, weight turned along x, and along y."""

QUASI_STATIC, DYNAMIC = "quasi-static", "dynamic"
_PLAIN = ("interface", "total", "laws", "contact", "dead", "live", "dead_arms", "live_arms", "factors", "ground",
          "setback", "ends", "outside")


_TURNED = 1e-6  # rotation, against that of the quaternion, that is no rounding [-]; chosen


class UnsettledError(NotConverged):
    """A structure does not come to rest under its dead loads.

    ``history`` tells a fall from a lack of steps.
    """

    history: Any = None


class UnstableError(NotConverged, RuntimeError):
    """The state is not finite or its energy explodes.

    The message names what and when, ``history`` what was kept.

    A run without an answer, and a ``RuntimeError`` as in 0.1.
    """

    history: Any = None


@dataclass
class State:
    """Everything that changes, and the arrays it changes on.

    Made by :func:`dem.initial_state`.

    Parameters
    ----------
    points, joints, bodies : kernel arrays of contact points, joints and blocks, see :mod:`dem.kernels.arrays`
    interface : interface of the assembly each joint is; -2 - i for one cut anew from interface i, -1 for a new pair
    total : accumulated energies, entries ``E_...`` of :mod:`dem.kernels.arrays`
    time : [s], in quasi-static runs the number of steps times the nominal step
    dt : step [s]
    mode : "quasi-static" or "dynamic"
    laws : kernel law of every interface of the assembly, for contacts found later, shape (k, LAW_SIZE)
    contact : how the blocks of every joint meet: 1 face on face, 2 edge or corner on a face, 3 two edges, shape (k,)
    dead, live, dead_arms, live_arms : loads it was made for or run with last, see :class:`limitmason.Loads`
    factors : of the load cases now: dead loads but weight, weight, live loads, weight along x, and along y, shape (5,)
    ground : velocity at which held blocks coast after a base motion [m/s], shape (3,)
    model : fingerprint of the assembly it belongs to
    modes, deformation : of blocks that deform, None where all are rigid
    setback : part of the gap of points cut anew under load that keeps their energy, until they open [m], shape (m,)
    ends : of points of joints that slid, see :mod:`dem.model.edge_points`, NaN of others, shape (m, 10)
    outside : motions that leave the plane of a plane problem, held in all blocks for good, shape (6,)
    ties : kernel arrays of the ties
    near : pairs that searches for contacts look at once they have moved, None before the first
    """

    points: Points
    joints: Joints
    bodies: RigidBodies
    interface: NDArray[np.int64]
    total: Array
    time: float
    dt: float
    mode: str
    laws: Array
    contact: NDArray[np.int64]
    dead: Array
    live: Array
    dead_arms: Array
    live_arms: Array
    factors: Array
    ground: Array
    model: Fingerprint
    setback: Array
    ends: Array
    outside: Flags
    warnings: tuple[str, ...] = field(default_factory=tuple)
    modes: BlockModes | None = None
    deformation: StrainShapes | None = None
    ties: Ties = field(default_factory=lambda: NO_TIES)
    near: NearPairs | None = None

    @property
    def loads(self) -> Loads:
        """Loads it was made for or run with last."""
        return Loads(self.dead, self.live, dead_arms=self.dead_arms, live_arms=self.live_arms)

    def take_loads(self, loads: Loads) -> None:
        """Run with other loads from now on."""
        self.dead, self.live = loads.dead.copy(), loads.live.copy()
        self.dead_arms, self.live_arms = loads.dead_arms.copy(), loads.live_arms.copy()

    @property
    def space(self) -> bool | None:
        """None where simply deformable blocks deform in a plane.

        The kernel must know that before it is compiled.
        """
        return None if self.deformation is None or self.deformation.plane else True

    def copy(self) -> State:
        """A state that shares nothing with this one."""

        def twin(x: Any) -> Any:
            """An array or a named tuple of arrays once more.

            Anything else does not change and is shared.
            """
            if isinstance(x, np.ndarray):
                return x.copy()
            return type(x)(*(v.copy() for v in x)) if hasattr(x, "_fields") else x

        return State(**{f.name: twin(getattr(self, f.name)) for f in fields(self)})

    def part(self, rows: Index) -> State:
        """This state with the joints ``rows`` alone, in the order given, as copies."""
        j, count = self.joints, np.diff(self.joints.start)[rows]
        points = points_of(j, rows)
        joints: dict[str, Any] = {name: x[rows] for name, x in j._asdict().items() if name != "start"}
        joints["start"] = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        modes = self.modes
        if modes is not None:
            modes = modes._replace(side_a=modes.side_a[rows], side_b=modes.side_b[rows])
        return replace(
            self, points=Points(*(x[points] for x in self.points)), joints=Joints(**joints), modes=modes,
            interface=self.interface[rows], contact=self.contact[rows], setback=self.setback[points],
            ends=self.ends[points],
        )

    def arrays(self) -> dict[str, Array]:
        """All of it as arrays by name, for a numpy archive."""
        out = {f"{name}.{key}": value for name in ("points", "joints", "bodies", "ties")
               for key, value in getattr(self, name)._asdict().items()}
        out |= {name: getattr(self, name) for name in _PLAIN}
        if self.near is not None:
            out |= {f"near.{k}": v for k, v in self.near._asdict().items()}
        if self.modes is not None and self.deformation is not None:
            out |= {f"modes.{k}": v for k, v in self.modes._asdict().items()}
            out |= self.deformation.arrays()
        return out | {f"model.{k}": v for k, v in self.model.arrays.items()} | {
            "clock": np.array([self.time, self.dt]), "mode": np.array(self.mode),
            "warnings": np.array(self.warnings, str), "terms": np.array(list(kernels.COLUMNS), str),
        }

    @classmethod
    def from_arrays(cls, file: Mapping[str, Any], path: object) -> State:
        """Inverse of :meth:`arrays`.

        Parameters
        ----------
        file : arrays by name
        path : where they came from, named in errors

        Raises
        ------
        InputError
            Where something is missing, by its name.
        """
        file = Archive(path, file)

        def group(kind: Any, name: str) -> Any:
            """Arrays of a named tuple of this kind, which stand under ``name.field``."""
            return kind(*(file[f"{name}.{key}"] for key in kind._fields))

        model = Fingerprint(dict(file.group("model")))
        if not model.arrays:
            raise InputError(f"{path} does not say which model it is of: it is of another version of this package")
        if len(file["total"]) != kernels.E_SIZE:
            raise InputError(f"{path} was written by another version of this package: its sums of energy differ")
        terms = [str(name) for name in file.get("terms", ())]
        if terms != list(kernels.COLUMNS):
            raise InputError(
                f"{path} was written with the terms {terms} added to the joint law, now there are "
                f"{list(kernels.COLUMNS)}: register the same in the same order (limitmason.model.joint_term.ADDED)"
            )
        plain = {name: file[name] for name in _PLAIN}
        modes = deformation = None
        if "modes.value" in file:
            modes = group(BlockModes, "modes")
            plane = bool(file["deformation.normal"].any())
            _check_widths(path, modes, len(plain["contact"]), PLANE_MODES if plane else SPACE_MODES)
            shapes = {f.name: file[f"deformation.{f.name}"] for f in fields(StrainShapes)}
            deformation = StrainShapes(**shapes | {"state": str(shapes["state"])})
        return cls(
            group(Points, "points"), group(Joints, "joints"), group(RigidBodies, "bodies"), ties=group(Ties, "ties"),
            model=model, near=group(NearPairs, "near") if "near.pairs" in file else None,
            time=float(file["clock"][0]), dt=float(file["clock"][1]), mode=str(file["mode"]),
            warnings=tuple(str(w) for w in file["warnings"]), modes=modes, deformation=deformation,
            **plain,
        )

    def save(self, path: str | Path) -> None:
        """Write the state to a numpy archive from which :meth:`load` continues exactly."""
        write_archive(path, self.arrays())

    @classmethod
    def load(cls, path: str | Path) -> State:
        """Read a state written by :meth:`save`."""
        return cls.from_arrays(read_archive(path), path)

    def check_turns(self, assembly: Assembly) -> None:
        """Refuse blocks of an assembly whose rotation is not that of their quaternion.

        The kernel reads both: a state of which one was changed by hand would begin to move as if it stood elsewhere.
        """
        wanted = rotation_matrices(rotation_vectors(self.bodies.quat)) - np.eye(3)
        off = np.abs(wanted - self.bodies.rot).max(axis=(1, 2))
        off = np.maximum(off, np.abs(np.linalg.norm(self.bodies.quat, axis=1) - 1.0))
        if not (off < _TURNED).all():
            name = assembly.blocks[int(np.flatnonzero(~(off < _TURNED))[0])].name
            raise InputError(
                f"block {name!r} of the state to start from is turned two ways: bodies.rot must be R - I of the unit "
                "quaternion bodies.quat, set both"
            )

    def energy_of_motion(self) -> float:
        """Kinetic energy of the freedoms that are not held, as they move now [J]."""
        b = self.bodies
        rot = b.rot + np.eye(3)
        spin = np.einsum("nij,njk,nlk,nl->ni", rot, b.inv_inertia, rot, b.ang)
        # held freedoms are driven: their motion is no energy of the structure
        twice = b.mass[:, None] * b.vel**2 * ~b.held[:, :3] + b.ang * spin * ~b.held[:, 3:]
        energy = 0.5 * float(twice.sum())
        if self.modes is not None:
            energy += 0.5 * float((self.modes.mass * self.modes.rate**2).sum())
        return energy

    def stop(self) -> None:
        """Set all velocities to zero."""
        for array in (self.bodies.vel, self.bodies.spin, self.bodies.ang):
            array[:] = 0.0
        if self.modes is not None:
            self.modes.rate[:] = 0.0
        self.total[kernels.E_KINETIC] = 0.0

    def forces(self) -> PointForces:
        """Contact forces in the present position, and energy without ties.

        Places are less the reference centroid of block b.
        """
        m = len(self.points.s)
        out = np.empty((m, 3)), np.empty((m, 3)), np.empty(m), np.empty((m, 2))
        energy = kernels.measure(self.points, self.joints, self.bodies, *out, self.modes, self.space)
        return PointForces(owners(self.joints), *out, float(energy))

    def measured(self, assembly: Assembly) -> PointForces:
        """Contact forces in the present position, and energy with ties."""
        now = self.forces()
        energy = stored_energy(self.ties, self.bodies) if len(self.ties.block_a) else 0.0
        return replace(
            now, position=now.position + assembly.centroids[self.joints.block_b[now.owner]],
            elastic_energy=float(now.elastic_energy + energy),
        )

    @property
    def stresses(self) -> BlockStress:
        """Stress of every block now, tension positive.

        It has a mean and the gradient that bending gives.

        Raises
        ------
        InputError
            Where the blocks are rigid.
        """
        if self.modes is None or self.deformation is None:
            raise InputError(
                "rigid blocks have no stress: run with blocks='simply deformable', of an assembly with a material"
            )
        return block_stresses(self.deformation, self.modes, self.bodies.rot + np.eye(3))

    def senses(self, assembly: Assembly) -> Array:
        """Whether the joint of each point runs as its interface, 1, or the other way, -1.

        At -1 block a of the joint is the interface's block b: second axis, normal and force are turned round. Joints
        that were found anew count as 1. The shape is (m,).
        """
        owner = owners(self.joints)
        kept = self.interface >= 0
        first = assembly.arrays.block_a[np.where(kept, self.interface, 0)]
        return np.where(kept & (self.joints.block_a != first), -1.0, 1.0)[owner]

    def resultants(self, assembly: Assembly) -> Resultants:
        """Resultants of the interfaces and ties of an assembly, from contact forces.

        They act at their places before displacement. Joints cut anew belong to no interface and are left out.
        """
        now = self.measured(assembly)
        x = assembly.links
        k = self.interface[now.owner]
        kept = k >= 0
        k, sense = k[kept], self.senses(assembly)[kept, None]
        s, t = self.points.s[kept, None], sense * self.points.t[kept, None]
        place = x.centre[k] + s * x.tangent_1[k] + t * x.tangent_2[k]
        rows = len(assembly.interfaces) + np.arange(len(assembly.ties))
        return resultants_from_points(
            assembly, np.concatenate([place, x.centre[rows]]), np.concatenate([k, rows]),
            np.concatenate([self.points.area[kept], x.area[rows]]),
            np.concatenate([sense * now.force[kept], pulls(self.ties, self.bodies)[:, None] * x.normal[rows]]),
        )


@dataclass(frozen=True)
class PointForces:
    """Contact points now, and the elastic energy of joints and blocks that strain.

    Parameters
    ----------
    owner : joint of every point, shape (m,)
    position : of block b's material points, global axes [m], shape (m, 3)
    force : on block b, global axes [N], shape (m, 3)
    opening : less dilation, negative where pressed [m], shape (m,)
    slip : total, b against a along t1, t2 [m], shape (m, 2)
    elastic_energy : [J]
    """

    owner: Index
    position: Array
    force: Array
    opening: Array
    slip: Array
    elastic_energy: float


def _check_widths(path: object, modes: BlockModes, joints: int, shapes: int) -> None:
    """Refuse simply deformable blocks whose arrays have not the width kernels read.

    Kernels look at no width.

    Parameters
    ----------
    path : where they came from, for errors
    modes : arrays of the blocks' shapes
    joints, shapes : how many joints, and shapes of a block, the kernels read
    """
    for name, array in modes._asdict().items():
        wanted: tuple[int, ...] = (joints, shapes, 6) if name.startswith("side") else (len(modes.value), shapes)
        wanted += (3, 3) if name == "gradient" else ()
        if array.shape != wanted:
            raise InputError(
                f"{path} holds simply deformable blocks whose {name} is of shape {array.shape} for {wanted} here: it "
                "is of another version of this package; run it again from the start"
            )
