"""Potential cracks in units: planes through blocks that become joints between their two parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import instance
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid
from limitmason.geometry.splitting import split_polygon, split_solid
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block
from limitmason.model.contact_warnings import renumbered_doubts
from limitmason.model.input import read_names, read_vector
from limitmason.model.interface import Interface
from limitmason.model.joint import Joint

Plane = tuple[ArrayLike, ArrayLike]
"""A point [m] and a normal of any length, shape (3,) each."""

_ON_PLANE = 1e-9  # of the block's size: vertices nearer to the plane lie on it, far above rounding

CRACK = "crack"
"""Kind of the joint in a potential crack, beside "bed", "head" and "base"."""

LEAST_PART = 1e-6
"""Least part of a block's volume that a crack may cut off [-]."""


def with_potential_cracks(assembly: Assembly, planes: Mapping[int | str, Plane], joint: Joint) -> Assembly:
    """This assembly with blocks cut by planes into two that a joint holds together.

    Every interface of a cut block is cut with it and keeps its law, so that a joint in the crack that is strong enough
    leaves the multiplier of the uncut structure, and one of stiffness kn adds 1 / kn to the compliance across it.

    Parameters
    ----------
    assembly : that is cut
    planes : by block name or number, a point [m] and a normal, shape (3,) each; one plane for a block
    joint : law of the cracks; tensile strength and cohesion of the unit, or less

    Returns
    -------
    Assembly
        Block "name" becomes "name-a" and, where the normal points, "name-b"; their joint is of kind "crack". Loads are
        made for the new assembly. The recipe is dropped, as wherever the geometry changes.

    Raises
    ------
    InputError
        For a plane that misses its block, or cuts off less than a millionth of it; a block that is held, by name; a tie
        that is fastened to a block that is cut; and a block that has the name of a part already.
    """
    instance("assembly", assembly, Assembly)
    if not isinstance(planes, Mapping):
        raise InputError(f"planes must read {{'block': (point, normal)}}, got {type(planes).__name__}")
    instance("joint", joint, Joint)
    numbers = {assembly.block_index(block): (block, plane) for block, plane in planes.items()}
    if len(numbers) != len(planes):
        raise InputError("planes name a block twice, by its name and by its number")
    for tie in assembly.ties:
        for end in (tie.block_a, tie.block_b):
            if end is not None and assembly.block_index(end) in numbers:
                raise InputError(f"{tie}: block {end!r} is cut by a crack; give ties after the cracks, on its parts")
    held = {assembly.block_index(s.block) for s in assembly.supports}
    blocks: list[Block] = []
    cut: dict[int, tuple[Array, Array, float]] = {}  # point, unit normal and slack of the plane, by old block number
    first: list[int] = []  # number of a block, or of its part below the plane, in the new assembly
    cracks: list[Interface] = []
    for k, block in enumerate(assembly.blocks):
        first.append(len(blocks))
        if k not in numbers:
            blocks.append(block)
            continue
        if k in held:
            raise InputError(f"block {block.name!r} is held: a crack in it would open nothing; leave it out")
        point, normal = _plane(numbers[k][1], block.name)
        slack = _ON_PLANE * float(np.ptp(block.vertices, axis=0).max())
        parts: tuple[list[Solid], list[Solid]] = ([], [])
        polygons = []
        for solid in block.parts:
            below, above, polygon = split_solid(solid, point, normal, slack)
            parts[0].extend([] if below is None else [below])
            parts[1].extend([] if above is None else [above])
            polygons.extend([polygon] if len(polygon) else [])
        names = (f"{block.name}-a", f"{block.name}-b")
        halves = [replace(block, name=n, parts=tuple(p)) for n, p in zip(names, parts, strict=True)]
        least = min(h.volume if h.parts else 0.0 for h in halves)
        # a sliver would be a block of no weight; without polygon the plane only touches the block
        if not least > LEAST_PART * block.volume or not polygons:
            far = (block.vertices - point) @ normal
            raise InputError(
                f"the crack plane of block {block.name!r} misses it: its corners lie from {far.min():.4g} to "
                f"{far.max():.4g} m along the normal from the plane's point; move the point inside"
            )
        cut[k] = point, normal, slack
        cracks += [Interface(
            block_a=len(blocks), block_b=len(blocks) + 1, polygon=p, normal=normal, joint=joint, kind=CRACK,
        ) for p in polygons]
        blocks += halves
    read_names([b.name for b in blocks], len(blocks))  # "name-a" may be the name of another block
    interfaces = [piece for i in assembly.interfaces for piece in _pieces(i, cut, first)]
    supports = tuple(
        replace(s, block=assembly.blocks[assembly.block_index(s.block)].name) for s in assembly.supports
    )
    return replace(
        assembly, blocks=tuple(blocks), interfaces=(*interfaces, *cracks), supports=supports, recipe={},
        doubts=renumbered_doubts(assembly.doubts, np.array(first)),
    )


def unit_crack_planes(assembly: Assembly, names: Sequence[str], least_length: float) -> dict[int | str, Plane]:
    """Planes across the middle of units along the direction in which they are laid.

    Parameters
    ----------
    assembly : that has the units
    names : of the blocks that may crack; those without a laid direction are left whole
    least_length : shorter pieces are left whole [m]

    Returns
    -------
    dict
        Point in the middle [m] and unit normal along the unit, by block name.
    """
    planes: dict[int | str, Plane] = {}
    for name in names:
        block = assembly.blocks[assembly.block_index(name)]
        if block.axis is None:
            continue
        along = block.vertices @ block.axis
        if np.ptp(along) >= least_length:
            middle = 0.5 * (along.min() + along.max())
            planes[name] = (block.centroid + (middle - block.centroid @ block.axis) * block.axis, block.axis)
    return planes


def _plane(plane: Plane, name: str) -> tuple[Array, Array]:
    """Point [m] and unit normal of a crack plane, shape (3,) each, checked.

    Parameters
    ----------
    plane : as given: a point and a normal of any length
    name : of its block, for messages
    """
    if not isinstance(plane, (tuple, list, np.ndarray)) or len(plane) != 2:
        raise InputError(f"the crack plane of block {name!r} must be a point and a normal, got {plane!r}")
    point = read_vector(f"point of the crack plane of block {name!r}", plane[0])
    normal = read_vector(f"normal of the crack plane of block {name!r}", plane[1])
    size = float(np.linalg.norm(normal))
    if not size > 0.0:
        raise InputError(f"the normal of the crack plane of block {name!r} has no length")
    return point, normal / size


def _pieces(
    interface: Interface, cut: Mapping[int, tuple[Array, Array, float]], first: Sequence[int]
) -> list[Interface]:
    """Pieces of an interface between the parts of its blocks.

    Each is between one part of block a and one of block b.

    Parameters
    ----------
    interface : of the uncut assembly
    cut : point [m], unit normal and slack [m] of the plane of every block that is cut
    first : number in the new assembly of every block, or of its part below the plane; the part above follows it
    """
    pieces = [replace(interface, block_a=first[interface.block_a], block_b=first[interface.block_b])]
    # above is 0 for the part below the plane and 1 for the one above, whose block has the next number
    for side, block in (("block_a", interface.block_a), ("block_b", interface.block_b)):
        if block in cut:
            pieces = [
                replace(piece, polygon=part, **{side: getattr(piece, side) + above})
                for piece in pieces
                for above, part in enumerate(split_polygon(piece.polygon, *cut[block]))
                if part is not None
            ]
    return pieces
