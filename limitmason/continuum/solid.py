"""The continuum model: a meshed solid, its materials, supports and loads, from the outline of a block model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array, Flags
from limitmason.checks import choice, finite, instance, not_negative, numbers, several
from limitmason.constants import GRAVITY
from limitmason.continuum.discretisation import Discretisation
from limitmason.continuum.factor import Factor
from limitmason.continuum.mesh import Box, Mesh, box_axes, box_of, mesh_boxes, stands_on
from limitmason.continuum.patch import patch_forces
from limitmason.deformable.elasticity import SOLID, Elasticity
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.input import read_direction, read_vector
from limitmason.model.material import Material
from limitmason.storage.frozen import ReadOnly, frozen
from limitmason.vibration.system import VibratingSystem

_ON = 1e-6  # of the structure's size: nodes this near to a held block stand on it


class Reactions(NamedTuple):
    """What the supports carry: force [N], shape (3,), and moment about the origin [N m], shape (3,)."""

    force: Array
    moment: Array


@dataclass(frozen=True, eq=False)
class Continuum(ReadOnly):
    """A homogeneous solid of bricks of 20 or 8 nodes.

    A frozen value, the ``with_`` methods return changed copies.

    Parameters
    ----------
    mesh : bricks
    materials : by the numbers of ``mesh.material``
    held : displacements that are zero, shape (n_nodes, 3)
    dead, live : forces on the nodes beside the own weight [N], shape (n_nodes, 3); a multiplier scales the live ones
    lumped : masses carried by the nodes [kg], shape (n_nodes,); their weight is dead load
    points : integration points along an edge of a brick; with 2 a single layer of bricks has motions without strain

    Raises
    ------
    InputError
        For a material without density, one that yields by Mohr and Coulomb, bricks of a material that is not given,
        arrays that do not fit the nodes, and other points than 2 or 3.
    """

    mesh: Mesh
    materials: tuple[Material, ...]
    held: Flags
    dead: Array
    live: Array
    lumped: Array
    points: int = 3

    def __post_init__(self) -> None:
        """Check that a solid may be made of its materials."""
        choice("points", self.points, (2, 3))
        for m in self.materials:
            instance("material", m, Material)
            if m.density is None:
                raise InputError(f"material {m.name!r} has no density: a solid takes it from there, 0 for no weight")
            if m.yields:
                raise InputError(
                    f"material {m.name!r}: solids crack and crush over fracture energies; cohesion and "
                    "friction_angle_deg are for units"
                )
        if (most := int(self.mesh.material.max())) >= len(self.materials):
            raise InputError(f"bricks name material {most}, counted from 0, {len(self.materials)} are given")
        n = len(self.mesh.nodes)
        for name, shape in {"held": (n, 3), "dead": (n, 3), "live": (n, 3), "lumped": (n,)}.items():
            # a copy: what the caller holds may change, and is not frozen
            own = np.array(getattr(self, name), dtype=bool if name == "held" else float)
            if own.shape != shape:
                raise InputError(f"{name} must have shape {shape}, a row for each node, got {own.shape}")
            object.__setattr__(self, name, own)

    @classmethod
    def from_boxes(
        cls,
        boxes: Sequence[Box],
        material: Material | Sequence[Material],
        *,
        size: float | tuple[float, float, float],
        foot: float | None = None,
        planes: Sequence[tuple[int, float]] = (),
        points: int = 3,
        nodes: int = 20,
    ) -> Continuum:
        """A solid of boxes along the axes, held on a level.

        Parameters
        ----------
        boxes : may touch; what they are made of is their number in ``material``
        material : one, or a sequence
        size : largest edge of a brick [m]
        foot : height of the level on which all nodes are held [m]; the lowest one by default
        planes : further planes (axis, coordinate [m]) that edges of bricks follow
        points : integration points along an edge, 2 or 3
        nodes : of a brick, 20 or 8, see :class:`Mesh`
        """
        mesh = mesh_boxes(boxes, size, planes=planes, nodes=nodes)
        z = mesh.nodes[:, 2]
        level = float(z.min()) if foot is None else finite("foot", foot)
        held = np.abs(z - level) <= _ON * float(np.ptp(mesh.nodes, axis=0).max())
        if not held.any():
            raise InputError(f"foot: no node lies at {level:g} m; the solid goes from {z.min():g} to {z.max():g} m")
        return cls._bare(mesh, _several(material), held, points)

    @classmethod
    def from_assembly(
        cls,
        assembly: Assembly,
        material: Material,
        *,
        size: float | tuple[float, float, float],
        slab: Material | None = None,
        planes: Sequence[tuple[int, float]] = (),
        points: int = 3,
        nodes: int = 20,
    ) -> Continuum:
        """The solid that the free blocks fill, held where it stands on wholly held blocks.

        Joints leave no trace.

        Parameters
        ----------
        assembly : of boxes along three common directions, such as those of ``build.wall``
        material : of the masonry; the densities of the blocks are not used
        size : largest edge of a brick [m]
        slab : material of the held blocks, which are then meshed too and held on their lowest faces, at whatever level
            each stands; None: rigid
        planes : further planes (axis, coordinate [m]) that edges of bricks follow, in the frame of the first block
        points : integration points along an edge, 2 or 3
        nodes : of a brick, 20 or 8, see :class:`Mesh`

        Raises
        ------
        NotApplicable
            For blocks of another shape.
        InputError
            When no block is wholly held, or none touches the solid.
        """
        if not instance("assembly", assembly, Assembly).fixed.any() or assembly.fixed.all():
            raise InputError("a solid needs blocks that are free and blocks that are wholly held, on which it stands")
        first = int(np.flatnonzero(~assembly.fixed)[0])
        frame = box_axes(assembly.blocks[first].parts[0].vertices)
        # boxes in that frame: material 0 of free blocks, 1 of held ones
        free: list[Box] = []
        fixed: list[Box] = []
        for block, still in zip(assembly.blocks, assembly.fixed, strict=True):
            for part in block.parts:
                box = box_of(part._replace(vertices=part.vertices @ frame.T), block.name)
                (fixed if still else free).append(box._replace(material=int(still)))
        mesh = mesh_boxes([*free, *fixed] if slab is not None else free, size, planes=planes, nodes=nodes)
        near = _ON * float(np.ptp(mesh.nodes, axis=0).max())
        if slab is None:
            held = np.zeros(len(mesh.nodes), dtype=bool)
            for box in fixed:
                held |= ((mesh.nodes >= box.low - near) & (mesh.nodes <= box.high + near)).all(axis=1)
            if not held.any():
                raise InputError("no wholly held block touches the solid: it stands on nothing")
        else:
            held = np.zeros(len(mesh.nodes), dtype=bool)
            for box in (b for b in fixed if not any(stands_on(b, other, near) for other in fixed)):
                foot = np.array([*box.high[:2], box.low[2]])
                held |= ((mesh.nodes >= box.low - near) & (mesh.nodes <= foot + near)).all(axis=1)
        if not np.array_equal(frame, np.eye(3)):
            mesh = Mesh(mesh.solid.p.T @ frame, mesh.bricks, mesh.material, nodes)
        materials = (material,) if slab is None else (material, slab)
        return cls._bare(mesh, materials, held, points)

    @classmethod
    def _bare(cls, mesh: Mesh, materials: tuple[Material, ...], held: Flags, points: int) -> Continuum:
        """A solid without loads; its nodes marked by ``held``, shape (n_nodes,), do not move."""
        none = np.zeros((len(mesh.nodes), 3))
        return cls(mesh, materials, np.repeat(held[:, None], 3, axis=1), none, none.copy(), none[:, 0].copy(), points)

    @cached_property
    def discretisation(self) -> Discretisation:
        """Integration points, matrices and their order.

        Shared by copies that differ in loads alone.
        """
        return Discretisation(self.mesh, self.held, self.points)

    @cached_property
    def elastic(self) -> Factor:
        """Factor of the elastic stiffness of the free unknowns."""
        d = self.discretisation
        return d.factor(d.stiffness(self.moduli))

    @property
    def moduli(self) -> Array:
        """Elastic stiffness per material [Pa], shape (k, 6, 6).

        The order is (xx, yy, zz, xy, yz, zx), and shears are angles.
        """
        return np.array([Elasticity.of(m.young_modulus, m.poisson_ratio, SOLID).matrix for m in self.materials])

    @property
    def densities(self) -> Array:
        """Mass density per material [kg/m3]."""
        return np.array([m.density for m in self.materials], dtype=float)

    @property
    def brick_densities(self) -> Array:
        """Mass density per brick [kg/m3]."""
        return np.asarray(self.densities[self.mesh.material])

    @property
    def solid_mass(self) -> float:
        """Of the bricks alone [kg]."""
        return float(self.discretisation.volume.sum(axis=1) @ self.brick_densities)

    @cached_property
    def mass(self) -> float:
        """Of the solid and what it carries [kg]."""
        return float(self.solid_mass + self.lumped.sum())

    @cached_property
    def all_dead(self) -> Array:
        """Dead forces with the own weight and that of lumped masses [N], shape (3 n,)."""
        force = -GRAVITY * self.brick_densities[:, None] * (0.0, 0.0, 1.0)
        dead = self.dead.copy()
        dead[:, 2] -= GRAVITY * self.lumped
        return frozen(np.asarray(self.discretisation.body_force(force) + dead.ravel()))

    def with_patch_pressure(
        self, corners: ArrayLike, *, pressure: float | None = None, force: float | None = None, case: str = "live"
    ) -> Continuum:
        """This model and a pressure on a flat convex patch of its free faces.

        The patch is read as by ``Loads.with_patch_pressure``.

        Parameters
        ----------
        corners : counter-clockwise seen from outside [m], shape (k, 3)
        pressure : pushes into the faces [Pa]
        force : resultant of the pressure instead [N]
        case : "live" or "dead"
        """
        if (pressure is None) == (force is None):
            raise InputError("load on a patch: give either pressure or force")
        nodal, area, normal = patch_forces(self.mesh, corners)
        size = finite("pressure", pressure) if force is None else finite("force", force) / area
        return self._plus(-size * nodal[:, None] * normal, case)

    def with_patch_mass(self, corners: ArrayLike, mass: float) -> Continuum:
        """This model and a mass [kg] spread over a patch of its free faces.

        It weighs and vibrates with them.
        """
        not_negative("mass on a patch", mass)
        nodal, area, _ = patch_forces(self.mesh, corners)
        return self._like(lumped=self.lumped + nodal * (mass / area))

    def with_body_force(self, direction: ArrayLike, *, case: str = "live") -> Continuum:
        """This model and its own weight turned to a direction.

        Lumped masses count, and the length of the direction is a factor.
        """
        d = read_vector("direction", direction)
        solid = self.discretisation.body_force(GRAVITY * self.brick_densities[:, None] * d)
        return self._plus(solid.reshape(-1, 3) + GRAVITY * self.lumped[:, None] * d, case)

    def with_forces(self, forces: ArrayLike, *, case: str = "live") -> Continuum:
        """This model and forces on its nodes [N], shape (n_nodes, 3)."""
        f = numbers("forces", forces)
        if f.shape != self.dead.shape or not np.isfinite(f).all():
            raise InputError(f"forces must be finite and of shape {self.dead.shape}, got shape {f.shape}")
        return self._plus(f, case)

    def _plus(self, forces: Array, case: str) -> Continuum:
        choice("case", case, ("dead", "live"))
        return self._like(**{case: getattr(self, case) + forces})

    def _like(self, **changed: Array) -> Continuum:
        other = replace(self, **changed)  # type: ignore[arg-type]
        for kept in ("discretisation", "elastic"):  # neither depends on loads
            if kept in self.__dict__:
                other.__dict__[kept] = self.__dict__[kept]
        return other

    def vibration(self) -> VibratingSystem:
        """Elastic stiffness and consistent mass, for :func:`limitmason.modes`."""
        return vibrating(self, self.elastic, f"elastic solid of {len(self.mesh)} bricks")

    def value_at(self, displacement: Array, points: ArrayLike) -> Array:
        """Displacement at points of the solid [m], shape (k, 3), from that of the nodes, shape (3 n,)."""
        brick, weight = self.mesh.at(points)
        u = displacement.reshape(-1, 3)[self.mesh.connectivity[brick]]
        return np.asarray(np.einsum("ka,kai->ki", weight, u))

    def functional(self, point: ArrayLike, direction: ArrayLike) -> Array:
        """Weights of the unknowns in one displacement of a point, shape (3 n,).

        It is the displacement along the direction, whatever the length of that vector.
        """
        d = read_direction("direction of the control", direction)
        brick, weight = self.mesh.at(read_vector("point", point))
        out = np.zeros(self.dead.shape)
        out[self.mesh.connectivity[brick[0]]] = weight[0][:, None] * d
        return out.ravel()

    def reactions(self, stress: Array, forces: Array) -> Reactions:
        """Force and moment of the supports on the solid.

        Parameters
        ----------
        stress : at the integration points, tension positive [Pa], shape (m, q, 6)
        forces : loads on the nodes [N], shape (3 n,)
        """
        f = np.where(self.discretisation.held, self.discretisation.forces(stress) - forces, 0.0).reshape(-1, 3)
        return Reactions(f.sum(axis=0), np.cross(self.mesh.nodes, f).sum(axis=0))


@dataclass(frozen=True, eq=False)
class NodeCarrier(ReadOnly):
    """Nodes of a solid as what carries the shapes of its modes, shape (n, 3)."""

    model: Continuum

    @property
    def places(self) -> Array:
        """Nodes [m], shape (n, 3)."""
        return self.model.mesh.nodes

    @cached_property
    def masses(self) -> Array:
        """Share of each node in the volume times density, scaled to be positive, and what it carries [kg]."""
        model, d = self.model, self.model.discretisation
        m = d.assembled(d.mass(model.densities)).diagonal()  # row sums are negative at corners of such bricks
        lumped = d.spread(m).reshape(-1, 3).max(axis=1)
        return frozen(np.asarray(lumped * (model.solid_mass / lumped.sum()) + model.lumped))

    @property
    def moving(self) -> Flags:
        """Nodes that are not wholly held, shape (n,)."""
        return np.asarray(~self.model.held.all(axis=1), dtype=np.bool_)

    def at(self, shape: Array, points: Array) -> Array:
        """Displacement of points of the solid, shape (p, 3)."""
        return self.model.value_at(shape.ravel(), points)


def _at_nodes(d: Discretisation, values: Array) -> Array:
    """Displacements of all nodes from those that are free, shape (n, 3)."""
    return d.spread(values).reshape(-1, 3)


def _negative(d: Discretisation, factor: Factor, mass: Array, shift: float) -> int | None:
    """How many squares of circular frequencies lie below ``shift`` [1/s2], by Sylvester's law of inertia.

    ``factor`` is that of the stiffness, ``mass`` that of every brick [kg], shape (m, k, k).
    """
    return d.factor(factor.values - shift * mass).negative


def vibrating(model: Continuum, factor: Factor, label: str) -> VibratingSystem:
    """A solid as a system that vibrates.

    Parameters
    ----------
    model : the solid
    factor : of its stiffness, elastic or damaged
    label : of the system, in words
    """
    d = model.discretisation
    extra = np.repeat(model.lumped, 3)
    # inertial force of every node per acceleration of the ground along x, y and z [kg]
    excited = np.zeros((len(model.mesh.nodes), 3, 3))
    for i, along in enumerate(np.eye(3)):
        force = d.body_force(model.brick_densities[:, None] * along)
        excited[..., i] = (force + extra * np.tile(along, len(excited))).reshape(-1, 3)
    mass = d.mass(model.densities, extra)
    # solutions are not corrected: the iteration for modes corrects itself
    return VibratingSystem(
        stiffness=d.assembled(factor.values), mass=d.assembled(mass), excited=excited.reshape(-1, 3)[d.order],
        spread=partial(_at_nodes, d), carrier=NodeCarrier(model), total=np.full(3, model.mass), label=label,
        solve=partial(factor.solve, corrections=0), below=partial(_negative, d, factor, mass),
    )


def _several(material: Material | Sequence[Material]) -> tuple[Material, ...]:
    """One material or several, as a tuple."""
    return (material,) if isinstance(material, Material) else several("materials", material, Material)
