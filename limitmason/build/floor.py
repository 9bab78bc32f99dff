"""Floors and roofs as a block that rests on the walls by friction, so that its mass may slide on its bearings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from limitmason.checks import finite, instance, positive
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.model.assembly import Assembly
from limitmason.model.contact_warnings import renumbered_doubts
from limitmason.model.input import read_list
from limitmason.model.joint import Joint

_NEAR = 0.01  # of the floor's least size, chosen: blocks this near are looked at for bearings, more than contacts need


def with_floor(
    assembly: Assembly,
    *,
    mass: float,
    joint: Joint,
    footprint: Sequence[float] | None = None,
    level: float | None = None,
    thickness: float = 0.2,
    name: str = "floor",
) -> Assembly:
    """This assembly with a floor, or a roof.

    It is a rigid block of a given mass that rests by friction where it bears.

    It is the last block. Make the loads after it: they then hold its weight, and its share of a horizontal load.

    Parameters
    ----------
    assembly : that it rests on
    mass : of the floor with what it carries [kg]; its centre is that of the block, half the thickness above the bearing
    joint : law of its bearings, for example ``Joint.from_friction_coefficient(0.4)`` for timber on masonry
    footprint : x0, x1, y0, y1 [m]; the plan of the free blocks where omitted
    level : of its underside [m]; the top of the free blocks where omitted
    thickness : [m]
    name : of the block; a second floor needs another

    Returns
    -------
    Assembly
        With the bearings found between the block and those below, above and beside it. Bearings between joists are one
        face each: give several floors for several joists. The recipe is dropped, for the builder did not lay this.

    Raises
    ------
    InputError
        For a floor that overlaps blocks or touches none of them, a name in use, and sizes that are not positive.

    Notes
    -----
    As a load on a block (``Loads.with_pressure``) the same mass would be fastened to that block for ever. Here it is
    left behind as soon as its inertia exceeds friction: under Loads.horizontal it alone slides at tan(phi). The block
    is rigid: it ties the walls below it together through friction, which a flexible timber floor does less.
    """
    instance("assembly", assembly, Assembly)
    mass, thickness = positive("mass", mass), positive("thickness", thickness)
    if any(b.name == name for b in assembly.blocks):
        raise InputError(f"there is a block {name!r} already: give the floor another name")
    # lowest and highest coordinates, shape (2, 3) each: the ground may reach far beyond the walls
    free = [b.bounds for b, held in zip(assembly.blocks, assembly.fixed, strict=True) if not held]
    if not free and (footprint is None or level is None):
        raise InputError("every block is held: give footprint and level of the floor")
    if footprint is None:
        low, high = np.min([f[0] for f in free], axis=0), np.max([f[1] for f in free], axis=0)
        footprint = (low[0], high[0], low[1], high[1])
    plan = [finite("footprint", v) for v in read_list("footprint", footprint)]
    if len(plan) != 4 or not (plan[0] < plan[1] and plan[2] < plan[3]):
        raise InputError(f"footprint must be x0 < x1 and y0 < y1 [m], got {tuple(footprint)!r}")
    under = max(f[1, 2] for f in free) if level is None else finite("level", level)
    corners = np.array([[plan[0], plan[2], under], [plan[1], plan[3], under + thickness]])
    solid = box(tuple(corners[0]), tuple(corners[1]))
    density = mass / float(np.prod(corners[1] - corners[0]))
    # contacts are found only with what it touches, so that joints made by hand elsewhere stay as they are
    slack = _NEAR * float(np.min(corners[1] - corners[0]))
    near = [
        k
        for k, b in enumerate(assembly.blocks)
        if (b.bounds[0] <= corners[1] + slack).all() and (b.bounds[1] >= corners[0] - slack).all()
    ]
    laid = Assembly.from_polyhedra(
        [*(list(assembly.blocks[k].parts) for k in near), solid], joint=joint,
        density=[*(assembly.blocks[k].density for k in near), density],
        names=[*(assembly.blocks[k].name for k in near), name], **assembly.contact_rules.as_options(),
    )
    floor = len(near)  # its number in ``laid``, the largest one there
    # number in the assembly of every block of ``laid``
    numbers = np.array([*near, assembly.n_blocks])
    # no block is held in ``laid``, so that only here a bearing on the ground gets its kind
    bearings = tuple(
        replace(
            i, block_a=int(numbers[i.block_a]), block_b=int(numbers[i.block_b]),
            kind="base" if assembly.fixed[numbers[min(i.block_a, i.block_b)]] else i.kind,
        )
        for i in laid.interfaces
        if floor in (i.block_a, i.block_b)
    )
    if not bearings:
        raise InputError(f"the floor {name!r} touches no block: check footprint {tuple(plan)} and level {under:g} m")
    whole = replace(
        assembly, blocks=(*assembly.blocks, laid.blocks[-1]), interfaces=(*assembly.interfaces, *bearings), recipe={},
        doubts=(*assembly.doubts, *renumbered_doubts((d for d in laid.doubts if floor in (d.a, d.b)), numbers)),
    )
    whole.check_connected()
    return whole
