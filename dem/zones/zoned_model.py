"""What a model of zoned blocks consists of, in the plane and in space."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dem.kernels.arrays import Index
from dem.kernels.solid_arrays import FaceContacts, Facets, Hexahedra, HexTable, RigidSolids
from dem.kernels.zone_arrays import Nodes, QuadTable, Rigid, SideContacts, Sides, ZonedArrays, Zones
from dem.zones.mesh import ZoneMesh
from dem.zones.solid_mesh import SolidMesh
from limitmason.arrays import Array
from limitmason.deformable import SOLID
from limitmason.model import Assembly


@dataclass(frozen=True, eq=False)
class ZonedModel:
    """Everything that changes, and the arrays it changes on.

    Made by :func:`dem.zones.model.make_model`.

    Parameters
    ----------
    nodes, zones, tables, sides, contacts, rigid : kernel arrays, those of the plane or those of space
    law : row of the joint law for every row of ``interface``
    lost : what joints lose where they fail, in words
    soft : whether a joint loses strength
    interface : interface of the assembly each law is of
    total : accumulated works, see ``dem.kernels.zones``
    dt : [s]; 1 where masses are scaled to the step
    plane : "plane stress", "plane strain" or "solid"
    """

    assembly: Assembly
    mesh: ZoneMesh | SolidMesh
    nodes: Nodes
    zones: Zones | Hexahedra
    tables: QuadTable | HexTable
    sides: Sides | Facets
    contacts: SideContacts | FaceContacts
    rigid: Rigid | RigidSolids
    law: Array
    soft: bool
    interface: Index
    total: Array
    dt: float
    plane: str
    warnings: tuple[str, ...]
    lost: tuple[str, ...]

    def copy(self) -> "ZonedModel":
        """This model with arrays of its own."""

        def copied(group: Any) -> Any:
            return type(group)(*(v.copy() for v in group))

        moving = {name: copied(getattr(self, name)) for name in ("nodes", "zones", "contacts", "rigid")}
        return replace(self, **moving, total=self.total.copy())

    @property
    def arrays(self) -> ZonedArrays:
        """What the kernels see of it."""
        return ZonedArrays(*(getattr(self, name) for name in ZonedArrays._fields))

    @property
    def space(self) -> bool:
        """Whether it is a model in space."""
        return self.plane == SOLID

    @property
    def dimension(self) -> int:
        """Freedoms of a node: 2 in the plane x-z, 3 in space."""
        return self.nodes.place.shape[1]

    @property
    def axes(self) -> list[int]:
        """Which of the six motions of a block the freedoms of a rigid one are: x, z and ry, or all."""
        return list(range(6)) if self.space else [0, 2, 4]

    @property
    def sense(self) -> Array:
        """Signs of these motions as rigid blocks have them, shape (3,) or (6,): in the plane a turn from x to z is one
        about -y.
        """
        return np.ones(6) if self.space else np.array([1.0, 1.0, -1.0])
