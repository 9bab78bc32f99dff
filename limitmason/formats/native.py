"""The native model file: JSON that holds an assembly and its loads exactly, and that can be typed by hand.

A file as short as this is a model::

    {"schema": "limitmason-model", "version": 1,
     "outlines": [[[-1, -0.2], [2, -0.2], [2, 0], [-1, 0]], [[0, 0], [1, 0], [1, 2], [0, 2]]],
     "names": ["ground", "pier"], "thickness": 0.5, "density": 2000,
     "joint": {"friction_angle_deg": 33}, "fixed": ["ground"], "loads": {"horizontal": [1, 0, 0]}}

Keys, units in brackets:

geometry
    ``outlines`` of corners x, z [m] with ``thickness`` [m] and optional ``names``; or ``blocks``: objects with
    ``name``, ``vertices`` [m] and ``faces`` (counter-clockwise from outside), or ``parts``: a list of such convex
    pieces; optional ``density`` and ``axis`` per block. ``density`` [kg/m3]: one, or a list, or one in each block.
    ``tolerance`` [m] and ``contact_rules``: which faces touch, {"distance" [m] (null: 1e-4 of the smaller block's
    width), "angle_deg", "wedge_deg", "width" [m]}, see ``limitmason.Assembly.from_polyhedra``.
materials
    ``material``: the fields of ``limitmason.Material`` for every block; or ``materials``, a table of named ones, and
    ``material`` in each block that is made of one. A block's own ``density`` goes before that of its material.
joints
    ``joint``: the fields of ``limitmason.Joint`` (or ``friction_coefficient`` for the angle); ``joints``: the same by
    kind, {"head": {...}}; ``joints_between``: [{"blocks": ["a", "b"], "joint": {...}}]. A file written by
    :func:`write_json` has ``joint_laws``, a table of named laws, and ``interfaces``, which assigns them.
ties
    ``ties``: [{"blocks": ["a", "b"] (or ["a", null], tied to the ground), "points": [[x, y, z], [x, y, z]] [m]} with
    ``yield_force``, ``bond_force``, ``anchor_force`` [N] and the other fields of ``limitmason.Tie``.
supports
    ``fixed``: names or numbers of blocks; ``supports``: [{"block": "a", "translations": true, "dofs": ["rx"]}].
loads
    One of ``horizontal``, ``body_force`` (directions) and ``tilting`` (axis), added to the self weight; ``point_loads``
    [{"block", "force" [N], "at" [m], "case"}]; ``pressures`` [{"block", "pressure" [Pa], "level" [m], "unit_weight"
    [N/m3], "face", "case"}], or "traction" [Pa] in their place; ``precompression`` {"force" [N], "block"}; or the
    wrenches per block themselves, ``dead`` and ``live`` [N, N m], with ``dead_arms`` and ``live_arms`` [N m].
recipe
    Anything. Keys that start with an underscore are comments.

Which versions are read is judged in :mod:`limitmason.formats.document`.

Contacts are found again on reading, with the stored tolerance; a file that says otherwise is refused. Interfaces that
were changed after they were found carry their own ``polygon`` and ``normal``.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.checks import instance
from limitmason.errors import InputError
from limitmason.formats import entries
from limitmason.formats.document import DocumentNode, plain, read_document, restored, write_document
from limitmason.geometry.contact import ContactRules
from limitmason.model import Assembly, ContactError, Interface, Joint, Loads, Material, Support, Tie
from limitmason.model.joint_term import name_of
from limitmason.model.plausibility import PlausibilityWarning

SCHEMA, VERSION = "limitmason-model", 1
UNITS = {
    "length": "m", "mass": "kg", "density": "kg/m3", "force": "N", "moment": "N m", "stress": "Pa",
    "stiffness": "Pa/m", "angle": "deg",
}
_KEYS = (
    "schema", "version", "units", "name", "outlines", "names", "thickness", "density", "blocks", "tolerance",
    "contact_rules", "material", "materials", "joint", "joints", "joints_between", "joint_laws", "interfaces", "fixed",
    "supports", "ties", "loads", "recipe",
)


class _StoredInterface(NamedTuple):
    """An interface of a file: numbers of its blocks, law, kind, and its entry, which may hold its shape."""

    block_a: int
    block_b: int
    law: Joint
    kind: str
    entry: DocumentNode

    @property
    def pair(self) -> tuple[int, int]:
        """Numbers of the blocks, the smaller one first, as contact detection gives them."""
        return min(self.block_a, self.block_b), max(self.block_a, self.block_b)


class Model(NamedTuple):
    """What a model file holds: the assembly, and its loads, which are self weight where the file gives none."""

    assembly: Assembly
    loads: Loads


def write_json(path: str | Path, assembly: Assembly, loads: Loads | None = None) -> None:
    """Write an assembly and its loads.

    :func:`read_json` returns them with every number unchanged.

    Parameters
    ----------
    path : of the file, by custom ending in .json
    assembly, loads : the model; without loads the file has none

    Raises
    ------
    InputError
        When the recipe holds something that is not plain data, or the loads belong to another assembly, and for a block
        that floats, which no file may have.
    """
    instance("assembly", assembly, Assembly)
    if loads is not None and len(instance("loads", loads, Loads).dead) != assembly.n_blocks:
        raise InputError(f"the loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    if assembly.supports:
        assembly.check_connected()
    laws = _names("joint", (i.joint for i in assembly.interfaces))
    materials = _names("material", (b.material for b in assembly.blocks if b.material is not None))
    names = [b.name for b in assembly.blocks]
    # on reading contacts are found again: only others have to be stored
    shapes = () if _same_as_found(assembly) else ("polygon", "normal")
    interfaces = [
        {"blocks": [names[i.block_a], names[i.block_b]], "kind": i.kind, "law": laws[i.joint],
         **{shape: plain(getattr(i, shape), shape) for shape in shapes}}
        for i in assembly.interfaces
    ]
    document: dict[str, Any] = {
        "schema": SCHEMA, "version": VERSION, "units": UNITS, "tolerance": plain(assembly.tolerance, "tolerance"),
        **_rules(assembly),
        **({"materials": {name: _given(m) for m, name in materials.items()}} if materials else {}),
        "blocks": [
            {
                "name": b.name, "density": plain(b.density, "density"),
                **({} if b.axis is None else {"axis": plain(b.axis, "axis")}),
                **({} if b.material is None else {"material": materials[b.material]}),
                "parts": [
                    {"vertices": plain(p.vertices, "vertices"), "faces": [list(f) for f in p.faces]} for p in b.parts
                ],
            }
            for b in assembly.blocks
        ],
        "joint_laws": {name: _given(joint) for joint, name in laws.items()},
        "interfaces": interfaces,
        "supports": [
            {"block": s.block if isinstance(s.block, str) else int(s.block), "translations": s.translations,
             "rotations": s.rotations, "dofs": list(s.dofs)}
            for s in assembly.supports
        ],
    }
    if assembly.ties:
        document["ties"] = [_tie(tie) for tie in assembly.ties]
    if loads is not None:
        document["loads"] = {
            "name": loads.name, "dead": plain(loads.dead, "loads.dead"), "live": plain(loads.live, "loads.live"),
            **{
                key: plain(arms.reshape(-1, 9), f"loads.{key}")
                for key, arms in (("dead_arms", loads.dead_arms), ("live_arms", loads.live_arms)) if arms.any()
            },
        }
    document["recipe"] = plain(assembly.recipe, "recipe")
    write_document(path, document)


def _rules(assembly: Assembly) -> dict[str, Any]:
    """Rules of contact as an entry of the file.

    There is none where they say no more than the tolerance does.
    """
    rules = assembly.contact_rules
    if rules == ContactRules(assembly.tolerance):
        return {}
    return {"contact_rules": {f.name: getattr(rules, f.name) for f in fields(rules)}}


def _tie(tie: Tie) -> dict[str, Any]:
    """A tie as an entry of the file."""
    numbers = {name: getattr(tie, name) for name in entries.TIE_NUMBERS if getattr(tie, name) is not None}
    name = {"name": tie.name} if tie.name else {}
    return {"blocks": [tie.block_a, tie.block_b], "points": plain(tie.ends, "ties"), **numbers, **name}


def _names(kind: str, laws: Iterable[Any]) -> dict[Any, str]:
    """Names for ``laws``, joint laws or materials, each once and no name twice.

    Those without a name of their own are called by ``kind``, "joint" or "material", and a number.
    """
    out: dict[Any, str] = {}
    for law in dict.fromkeys(laws):
        base = law.name or f"{kind}-{len(out)}"
        name, k = base, 2
        while name in out.values():
            name, k = f"{base} ({k})", k + 1
        out[law] = name
    return out


def _given(law: Joint | Material) -> dict[str, Any]:
    """Fields of a law or material that differ from their default, as plain data."""
    values = {f.name: getattr(law, f.name) for f in fields(law) if getattr(law, f.name) != f.default}
    if "terms" in values:
        values["terms"] = {name_of(term): term.numbers for term in values["terms"]}
    return {name: plain(value, name) for name, value in values.items()}


def _same_as_found(assembly: Assembly) -> bool:
    """Whether contact detection would find the very interfaces that an assembly has."""
    # an assembly without any may have lost those that detection would find: the file must say none
    if not assembly.interfaces:
        return False
    found = _with_found_contacts(assembly).interfaces
    return len(found) == len(assembly.interfaces) and all(
        (f.block_a, f.block_b) == (i.block_a, i.block_b)
        and np.array_equal(f.polygon, i.polygon)
        and np.array_equal(f.normal, i.normal)
        for f, i in zip(found, assembly.interfaces, strict=True)
    )


def _with_found_contacts(assembly: Assembly) -> Assembly:
    """The assembly with the contacts that detection finds by its rules."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlausibilityWarning)  # it was said when the assembly was made
        return Assembly.from_polyhedra(
            [list(b.parts) for b in assembly.blocks], joint=Joint(0.0), density=[b.density for b in assembly.blocks],
            names=[b.name for b in assembly.blocks], axes=[b.axis for b in assembly.blocks], recipe=assembly.recipe,
            **assembly.contact_rules.as_options(),
        )


def read_json(path: str | Path) -> Model:
    """Read a model file, written by :func:`write_json` or by hand.

    See the module's text for the keys.

    Parameters
    ----------
    path : of the file

    Returns
    -------
    Model
        ``assembly, loads``

    Raises
    ------
    InputError
        For malformed files and impossible models; the message names file, key and block.
    """
    node = read_document(path, SCHEMA, VERSION)
    node.mapping(_KEYS)
    _check_units(node)
    if ("outlines" in node) == ("blocks" in node):
        raise node.error("give exactly one of 'outlines' (with 'thickness') and 'blocks'")
    if ("interfaces" in node) == ("joint" in node):
        raise node.error("give exactly one of 'joint' and 'interfaces' (with 'joint_laws')")
    pairs = ("names", "outlines"), ("thickness", "outlines"), ("materials", "blocks"), ("joint_laws", "interfaces")
    for key, other in pairs:
        if key in node and other not in node:
            raise node[key].error(f"goes with {other!r}, which are not there; leave it out")
    try:
        assembly = entries.with_materials(node, _stored(node) if "interfaces" in node else _simple(node))
        if "ties" in node:
            assembly = assembly.with_ties(entries.tie_of(entry) for entry in node["ties"])
        return Model(assembly, entries.loads_of(node, assembly))
    except ContactError as error:
        raise ContactError(f"{node.file}: {error}", error.assembly) from None
    except InputError as error:
        text = str(error)
        raise (error if text.startswith(f"{node.file}: ") else node.error(text)) from None


def _check_units(node: DocumentNode) -> None:
    """Refuse a file that says other units than those that are read."""
    units = node.get("units")
    if units is None:
        return
    units.mapping(UNITS)
    for key, unit in units.items():
        if key in UNITS and unit.value != UNITS[key]:
            raise unit.error(f"only {UNITS[key]!r} is read, got {unit.value!r}; convert the numbers")


def _tolerances(node: DocumentNode) -> dict[str, Any]:
    """Arguments of constructors of ``Assembly`` that say which faces touch, from the document ``node``."""
    rules, distance = node.get("contact_rules"), node.given("tolerance", DocumentNode.number, default=None)
    if rules is None:
        return {"tolerance": distance}
    given = rules.mapping(("distance", "angle_deg", "wedge_deg", "width"))
    if "distance" in given:
        distance = rules.given("distance", DocumentNode.number, default=None)
    names = {"angle_deg": "angle_tolerance_deg", "wedge_deg": "wedge_tolerance_deg", "width": "smallest_contact"}
    return {"tolerance": distance, **{names[key]: rules[key].number() for key in names if key in rules}}


def _simple(node: DocumentNode) -> Assembly:
    """Assembly of a document ``node`` of outlines or blocks, with laws of its joints.

    Its contacts are found here; a document that stores them is read by :func:`_stored`.
    """
    supports = [entries.support_of(s) for s in node.get("supports") or ()]
    # what is held in every direction is fixed, and held while contacts are found
    fixed = [f.block() for f in node.get("fixed") or ()] + [s.block for s in supports if all(s.held)]
    options: dict[str, Any] = {
        "joint": entries.joint_of(node["joint"]), "joints": entries.joint_table(node), "fixed": fixed,
        "recipe": node.given("recipe", _recipe, default=None), **_tolerances(node),
    }
    if "outlines" in node:
        count = len(list(node["outlines"]))
        for key in ("names", "density"):
            if key in node and isinstance(node[key].value, list) and len(node[key].value) != count:
                raise node[key].error(f"{len(node[key].value)} entries for {count} outlines")
        density: Any = entries.DENSITY
        if given := node.get("density"):
            density = given.row() if isinstance(given.value, list) else given.number()
        names = [n.text() for n in node["names"]] if "names" in node else None
        assembly = Assembly.from_polygons(
            [outline.array(2) for outline in node["outlines"]], thickness=node["thickness"].number(), names=names,
            density=density, **options,
        )
    else:
        assembly = Assembly.from_polyhedra(**entries.blocks_of(node), **options)
    partial = [s for s in supports if not all(s.held)]
    return assembly.with_supports(partial) if partial else assembly


def _recipe(node: DocumentNode) -> dict[str, Any]:
    """How the structure was made, as its file says it: any plain data by key."""
    return restored(node.mapping())


def _stored(node: DocumentNode) -> Assembly:
    """Assembly of a document ``node`` that gives every interface with its law."""
    for key in ("joints", "joints_between"):
        if key in node:
            raise node[key].error("does not go with 'interfaces', which assign the laws; remove one of the two")
    if "outlines" in node:
        raise node["interfaces"].error("needs 'blocks'; give 'joint' with 'outlines'")
    laws = {name: entries.joint_of(law) for name, law in node["joint_laws"].items()}
    # the law of the contacts that are found here stands for those of the file, which follow
    assembly = Assembly.from_polyhedra(
        **entries.blocks_of(node), joint=Joint(0.0), **_tolerances(node),
        recipe=node.given("recipe", _recipe, default=None),
    )
    # of blocks that were turned the stored one is the same but for rounding
    assembly = replace(assembly, tolerance=node["tolerance"].number())
    rows = []
    for entry in node["interfaces"]:
        entry.mapping(("blocks", "kind", "law", "polygon", "normal"))
        a, b = entries.block_pair(entry["blocks"], assembly)
        if entry["law"].text() not in laws:
            raise entry["law"].error(f"there is no law {entry['law'].value!r} in 'joint_laws'")
        rows.append(_StoredInterface(a, b, laws[entry["law"].value], entry["kind"].text(), entry))
    shaped = [("polygon" in row.entry or "normal" in row.entry) for row in rows]
    if any(shaped) and not all(shaped):
        raise rows[shaped.index(False)].entry.error("'polygon' is missing; give it for every interface or for none")
    if any(shaped):
        interfaces = [
            Interface(row.block_a, row.block_b, *entries.shape_of(row.entry), row.law, row.kind) for row in rows
        ]
    else:  # an empty list says that there are none
        interfaces = _assigned(node, assembly, rows) if rows else []
    assembly = replace(assembly, interfaces=tuple(interfaces))
    supports = [entries.support_of(s) for s in node.get("supports") or ()]
    supports += [Support.fixed(f.block()) for f in node.get("fixed") or ()]
    return assembly.with_supports(supports) if supports else assembly


def _assigned(node: DocumentNode, assembly: Assembly, rows: list[_StoredInterface]) -> list[Interface]:
    """Found interfaces with the stored laws and kinds.

    Several between one pair of blocks take those of the file in its order.

    Parameters
    ----------
    node : the document, for errors
    assembly : with the interfaces that contact detection found
    rows : the interfaces of the file
    """
    stored = Counter(row.pair for row in rows)
    found = Counter((i.block_a, i.block_b) for i in assembly.interfaces)
    for pair in sorted(stored | found):
        if stored[pair] != found[pair]:
            a, b = (assembly.blocks[k].name for k in pair)
            raise node["interfaces"].error(
                f"blocks {a!r} and {b!r} have {stored[pair]} interface(s) in the file, but {found[pair]} found with "
                f"the tolerance of {assembly.tolerance:.3g} m; if the geometry was edited, replace 'interfaces' and "
                "'joint_laws' by 'joint', or correct the geometry"
            )
    waiting: dict[tuple[int, int], list[_StoredInterface]] = {}
    for row in rows:
        waiting.setdefault(row.pair, []).append(row)
    out = []
    for interface in assembly.interfaces:
        row = waiting[interface.block_a, interface.block_b].pop(0)
        out.append(replace(interface, joint=row.law, kind=row.kind))
    return out
