"""What a model of zoned blocks consists of."""

from dataclasses import dataclass, replace
from typing import Any

from dem.kernels.arrays import Index
from dem.kernels.zone_arrays import Nodes, QuadTable, Rigid, SideContacts, Sides, ZonedArrays, Zones
from dem.zones.mesh import ZoneMesh
from limitmason.arrays import Array
from limitmason.model import Assembly

AXES, SENSE = (0, 2, 4), (1.0, 1.0, -1.0)
"""Which of a block's six motions x, z and ry are, and their signs here: a turn from x to z is one about -y."""


@dataclass(frozen=True, eq=False)
class ZonedModel:
    """Everything that changes, and the arrays it changes on.

    Made by :func:`dem.zones.model.make_model`.

    Parameters
    ----------
    nodes, zones, tables, sides, contacts, rigid : kernel arrays
    law : row of the joint law for every row of ``interface``
    lost : what joints lose where they fail, in words
    soft : whether a joint loses strength
    interface : interface of the assembly each law is of
    total : accumulated works, see ``dem.kernels.zones``
    dt : [s]; 1 where masses are scaled to the step
    plane : "plane stress" or "plane strain"
    """

    assembly: Assembly
    mesh: ZoneMesh
    nodes: Nodes
    zones: Zones
    tables: QuadTable
    sides: Sides
    contacts: SideContacts
    rigid: Rigid
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
