"""The entries of a model file: blocks, joint laws, supports and loads, each from its keys."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.formats.document import DocumentNode
from limitmason.model import Assembly, Joint, Loads, Material, Support, Tie
from limitmason.model.joint_term import JointTerm, added_terms

TIE_NUMBERS = tuple(f.name for f in fields(Tie) if f.name not in ("block_a", "point_a", "block_b", "point_b", "name"))
"""Fields of a tie that are numbers."""

DENSITY = 2000.0
"""Of blocks for which a file gives none [kg/m3], the default of ``Assembly`` too."""

_UNIT = 1e-6
"""Length of a unit vector may be off by this much, which a file's digits make; chosen."""

_PIECE_KEYS = ("vertices", "faces")
_LOAD_KEYS = (
    "name", "dead", "live", "dead_arms", "live_arms", "horizontal", "body_force", "tilting", "point_loads", "pressures",
    "precompression",
)


def blocks_of(node: DocumentNode) -> dict[str, Any]:
    """Arguments of ``Assembly.from_polyhedra`` for the blocks of a document ``node``."""
    solids, names, densities, axes = [], [], [], []
    blocks, default = list(node["blocks"]), node.get("density")
    each = list(default) if default is not None and isinstance(default.value, list) else None  # one for every block
    if default is not None and each is not None and len(each) != len(blocks):
        raise default.error(f"{len(each)} densities for {len(blocks)} blocks")
    for k, block in enumerate(blocks):
        block.mapping(("name", "density", "axis", "material", "parts", *_PIECE_KEYS))
        names.append(block.given("name", DocumentNode.text, f"block-{k}"))
        density = block.get("density") or (default if each is None else each[k])
        densities.append(DENSITY if density is None else density.number())
        axes.append(block.given("axis", DocumentNode.row, default=None))
        pieces = [block]  # a convex block is its own piece
        if "parts" in block:
            for key in _PIECE_KEYS:
                if key in block:
                    raise block[key].error("does not go with 'parts', which hold all of the block; leave one out")
            pieces = list(block["parts"])
            for piece in pieces:
                piece.mapping(_PIECE_KEYS)
        solids.append([(piece["vertices"].array(3), _faces(piece["faces"])) for piece in pieces])
    return {"solids": solids, "names": names, "density": densities, "axes": axes}


def _faces(node: DocumentNode) -> tuple[tuple[int, ...], ...]:
    """Faces as numbers of their vertices, from 0."""
    return tuple(tuple(index.whole("the number of a vertex, from 0") for index in face) for face in node)


def joint_of(node: DocumentNode) -> Joint:
    """A joint law from the entry of its fields."""
    values = node.values(Joint, friction_coefficient=DocumentNode.number, terms=_terms)
    if ("friction_angle_deg" in values) == ("friction_coefficient" in values):
        raise node.error("give exactly one of 'friction_angle_deg' and 'friction_coefficient'")
    if "friction_coefficient" in values:
        return node.make(Joint.from_friction_coefficient, values.pop("friction_coefficient"), **values)
    return node.make(Joint, **values)


def _terms(node: DocumentNode) -> tuple[JointTerm, ...]:
    """Terms added to a joint law, from their entry ``node``.

    The entry is an object of objects: numbers by field, under the registered name of each term.
    """
    known, out = added_terms(), []
    for name, numbers in node.items():
        if name not in known:
            raise numbers.error(f"no term {name!r} of the joint law is registered; known: {', '.join(known) or 'none'}")
        numbers.mapping(tuple(f.name for f in fields(known[name])))
        out.append(known[name](**{k: v.number() for k, v in numbers.items()}))
    return tuple(out)


def joint_table(node: DocumentNode) -> dict[Any, Joint]:
    """Joint laws of a document ``node``, by kind of joint and by pair of block names."""
    table: dict[Any, Joint] = {}
    if "joints" in node:
        table |= {kind: joint_of(law) for kind, law in node["joints"].items()}
    for entry in node.get("joints_between") or ():
        entry.mapping(("blocks", "joint"))
        a, b = entry["blocks"].pair("block names")
        table[a.text(), b.text()] = joint_of(entry["joint"])
    return table


def material_of(node: DocumentNode) -> Material:
    """A material from its fields."""
    values = node.values(Material)
    for key in ("young_modulus", "poisson_ratio"):
        if key not in values:
            raise node.error(f"{key!r} is missing")
    return node.make(Material, **values)


def with_materials(node: DocumentNode, assembly: Assembly) -> Assembly:
    """The assembly with the materials of a document.

    There is one for all blocks, or a table of which the blocks give a name. A density that the file gives a block goes
    before that of its material.

    Parameters
    ----------
    node : the document
    assembly : with the blocks of the document, in its order
    """
    table = {name: material_of(entry) for name, entry in node["materials"].items()} if "materials" in node else {}
    default = node.given("material", material_of, default=None)
    # outlines have no entries of their own, and so no material of their own
    entries = list(node["blocks"]) if "blocks" in node else [None] * assembly.n_blocks
    blocks = list(assembly.blocks)
    for k, entry in enumerate(entries):
        material = default
        if entry is not None and "material" in entry:
            name = entry["material"].text()
            if name not in table:
                raise entry["material"].error(f"there is no material {name!r} in 'materials'")
            material = table[name]
        if material is None:
            continue
        given = "density" in node or (entry is not None and "density" in entry)
        density = blocks[k].density if given or material.density is None else float(material.density)
        if not density > 0.0:
            raise node.error(f"block {blocks[k].name!r} has no density and neither has its material")
        blocks[k] = replace(blocks[k], material=material, density=density)
    return replace(assembly, blocks=tuple(blocks))


def shape_of(node: DocumentNode) -> tuple[Array, Array]:
    """Polygon [m], shape (n, 3), and unit normal, shape (3,), of an interface that a file gives with its shape."""
    polygon, normal = node["polygon"].array(3), node["normal"].row()
    if len(polygon) < 3:
        raise node["polygon"].error(f"a polygon needs three corners, got {len(polygon)}")
    if normal.shape != (3,) or not abs(np.linalg.norm(normal) - 1.0) < _UNIT:
        raise node["normal"].error("expected a unit vector x, y, z")
    r = polygon - polygon[0]
    if not np.cross(r[1:-1], r[2:]).sum(axis=0) @ normal > 0.0:
        raise node["polygon"].error("its corners must run counter-clockwise about the normal, around an area")
    return polygon, normal


def block_pair(node: DocumentNode, assembly: Assembly) -> tuple[int, int]:
    """Numbers of two blocks given by name or number."""
    a, b = (node.make(assembly.block_index, block.block()) for block in node.pair("block names"))
    return a, b


def support_of(node: DocumentNode) -> Support:
    """A support from the entry of its fields."""
    values = node.values(Support, block=None)
    return node.make(Support, node["block"].block(), **values)


def tie_of(node: DocumentNode) -> Tie:
    """A tie from its entry ``node``.

    ``blocks`` and ``points`` are pairs. The second block is null for the ground.
    """
    node.mapping(("blocks", "points", "name", *TIE_NUMBERS))
    blocks, points = list(node["blocks"]), list(node["points"])
    if len(blocks) != 2 or len(points) != 2:
        raise node.error("a tie has two 'blocks' (null for the ground) and two 'points'")
    numbers = {name: node[name].number() for name in TIE_NUMBERS if name in node}
    return node.make(
        Tie, blocks[0].block(), points[0].row(), None if blocks[1].value is None else blocks[1].block(),
        points[1].row(), name=node.given("name", DocumentNode.text, ""), **numbers,
    )


def _face_of_block(node: DocumentNode) -> str | tuple[Any, ...]:
    """A face of a block: its name, or the direction x, y, z in which it looks."""
    return node.text() if isinstance(node.value, str) else tuple(node.row())


def loads_of(node: DocumentNode, assembly: Assembly) -> Loads:
    """Loads of a document: wrenches as given, or self weight with named actions.

    Parameters
    ----------
    node : the document; without an entry for loads they are self weight alone
    assembly : of the document, on which they act
    """
    if "loads" not in node:
        return Loads.weight(assembly)
    loads = node["loads"]
    loads.mapping(_LOAD_KEYS)
    name = loads.given("name", DocumentNode.text, "")
    kinds = [k for k in ("dead", "horizontal", "body_force", "tilting") if k in loads]
    if len(kinds) > 1:  # each is a whole live load of its own
        raise loads.error(f"{kinds[0]!r} and {kinds[1]!r} exclude each other")
    actions = ("horizontal", "body_force", "tilting", "point_loads", "pressures", "precompression")
    for key in actions if "dead" in loads else ("live", "dead_arms", "live_arms"):
        if key in loads:
            what = "does not go with 'dead', which holds all loads" if "dead" in loads else "needs 'dead' beside it"
            raise loads[key].error(f"{what}; leave one of them out" if "dead" in loads else what)
    if "dead" in loads:
        n = assembly.n_blocks
        arms = {key: loads[key].array(9, rows=n).reshape(n, 3, 3) for key in ("dead_arms", "live_arms") if key in loads}
        return Loads(loads["dead"].array(6, rows=n), loads["live"].array(6, rows=n), name, **arms)
    out = Loads.weight(assembly)
    if kinds:
        kind = kinds[0]  # that is also what the constructor is called
        out = getattr(Loads, kind)(assembly, loads[kind].row())
    for entry in loads.get("point_loads") or ():
        entry.mapping(("block", "force", "at", "case"))
        out = out.with_point_load(
            assembly, entry["block"].block(), entry["force"].row(),
            at=entry.given("at", DocumentNode.row, default=None), case=entry.given("case", DocumentNode.text, "live"),
        )
    for entry in loads.get("pressures") or ():
        entry.mapping(("block", "pressure", "level", "unit_weight", "traction", "face", "case"))
        out = out.with_pressure(
            assembly, entry["block"].block(),
            **{k: entry.given(k, DocumentNode.number, default=None) for k in ("pressure", "level", "unit_weight")},
            traction=entry.given("traction", DocumentNode.row, default=None),
            case=entry.given("case", DocumentNode.text, "dead"), face=entry.given("face", _face_of_block, "top"),
        )
    if "precompression" in loads:
        entry = loads["precompression"]
        entry.mapping(("force", "block"))
        block = entry.given("block", DocumentNode.block, "beam")
        out = out.with_precompression(assembly, entry["force"].number(), block=block)
    return replace(out, name=name) if name else out
