"""Barrel and groin vaults of voussoirs laid in courses: the arch of a section, drawn out along its axis.

``outlines`` of voussoirs and the ``feet`` they stand on are in x-z [m], shapes (n, 4, 2) and (4, 2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from limitmason.arrays import Array
from limitmason.build.erect import Site
from limitmason.build.voussoirs import circle, circle_facts, circular_joints, outlines_between, springing
from limitmason.checks import choice, count, positive
from limitmason.errors import InputError
from limitmason.geometry.polyhedron import Solid, prism
from limitmason.geometry.splitting import split_solid
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

_SHAPES = ("barrel", "groin")
_ROUNDING = 1e-9  # relative: lengths and angles that differ by less are equal
_LEAST_PIECE = 0.25  # of a unit's length, chosen: shorter pieces of a course join their neighbour
_NORTH, _WEST = (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)


def vault(
    *,
    thickness: float,
    voussoirs: int,
    unit_length: float,
    joint: Joint,
    shape: str = "barrel",
    length: float | None = None,
    projection: float | None = None,
    radius: float | None = None,
    angle_deg: float | None = None,
    span: float | None = None,
    rise: float | None = None,
    density: float = 2000.0,
    joints: Mapping | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return a vault of voussoirs on held springers.

    It is a barrel along y, or two barrels that cross over a square bay.

    Parameters
    ----------
    thickness
        Radial [m].
    voussoirs
        Courses of the section, from springing to springing.
    unit_length
        Of a voussoir along its course [m]; courses lap by half of it, and pieces shorter than a quarter join their
        neighbour.
    shape
        "barrel" or "groin".
    length
        Barrel: along y [m].
    projection
        Groin: how far the webs reach beyond the extrados at the springing, along their axes [m]; default the thickness.
    radius, angle_deg, span, rise
        Of the centre line of the section, as in `arch`.
    joint, joints, density, tolerance
        As in `wall`.

    Returns
    -------
    Assembly
        Held blocks first: "base-left", "base-right" of a barrel, "springer-1" to "springer-8" of a groin vault. Then
        "voussoir-03-02": course from the left springing, position along it; a groin vault has webs "north-03-02",
        "west", "south", "east". The centre is over x = 0 (and y = 0 of a groin vault), springings at z = 0.

    Raises
    ------
    InputError
        Naming the argument that is wrong.

    Notes
    -----
    The webs of a groin vault are mitred in the vertical planes through its diagonals: a stone of one web meets the
    stone of the next over the whole section of its course. Real groins have stones that bond the webs, and four webs'
    keystones are one stone: mitred joints are weaker. Faces between joints are plane, as in `arch`.
    """
    choice("shape", shape, _SHAPES)
    number, depth = count("voussoirs", voussoirs), positive("thickness", thickness)
    positive("density", density)
    unit = positive("unit_length", unit_length)
    r, angle = circle(radius, angle_deg, span, rise)
    inner, outer = circular_joints(r, angle, depth, number)
    outlines = outlines_between(inner, outer)
    feet = [springing(inner[end], outer[end], depth, left=end == 0) for end in (0, -1)]
    site = Site(density)
    recipe: dict = {
        "kind": "vault", "shape": shape, **circle_facts(r, angle), "thickness": depth, "voussoirs": number,
        "unit_length": unit, "density": float(density),
    }
    if shape == "barrel":
        if length is None or projection is not None:
            raise InputError("a barrel vault needs its length; projection is for groin vaults")
        recipe["length"] = positive("length", length)
        _barrel(site, outlines, feet, recipe["length"], unit)
    else:
        if length is not None:
            raise InputError("length is for barrel vaults: the bay of a groin vault follows from span and projection")
        # the bay is measured at the springings, which must be the widest part of the section
        if angle > math.pi + _ROUNDING:
            got = math.degrees(angle)
            raise InputError(f"a groin vault needs an angle of embrace of 180 degrees or less, got {got:g}")
        beyond = depth if projection is None else positive("projection", projection)
        recipe["bay"] = 2.0 * (float(np.abs(outer[[0, -1], 0]).max()) + beyond)
        _groin(site, outlines, feet, 0.5 * recipe["bay"], unit)
    return site.assembly(joint, recipe, joints=joints, tolerance=tolerance)


def _barrel(site: Site, outlines: Array, feet: list[Array], length: float, unit: float) -> None:
    """Add a barrel of courses along y, with a held block behind each springing.

    Parameters
    ----------
    site : to which blocks are added
    outlines : of the voussoirs of the section in x-z from left to right [m], shape (n, 4, 2)
    feet : outlines of the held blocks left and right [m], shape (4, 2) each
    length : of the vault along y [m]
    unit : length of a stone along y [m]
    """
    for side, foot in zip(("left", "right"), feet, strict=True):
        site.add(f"base-{side}", prism(foot, y0=0.0, y1=length), fixed=True)
    for k, outline in enumerate(outlines):
        for j, (a, b) in enumerate(_pieces(0.0, length, unit, half=k % 2 == 1, least=_LEAST_PIECE * unit)):
            site.add(_name("voussoir", k, j, len(outlines)), prism(outline, a, b), axis=_NORTH)


def _groin(site: Site, outlines: Array, feet: list[Array], half_bay: float, unit: float) -> None:
    """Add the four webs of a groin vault and their springers.

    One web is the barrel along +y between its groins. The others are the same turned by 90 degrees each.

    Parameters
    ----------
    site : to which blocks are added
    outlines : of the voussoirs of the section in x-z from left to right [m], shape (n, 4, 2)
    feet : outlines of the held blocks left and right [m], shape (4, 2) each
    half_bay : half the vault's side [m]
    unit : length of a stone [m]
    """
    slack = _ROUNDING * half_bay
    for turn in range(4):
        for k, foot in enumerate(feet):
            springer = _turned(_mitred(prism(foot, y0=0.0, y1=half_bay), slack), turn)
            site.add(f"springer-{2 * turn + k + 1}", springer, fixed=True)
    for turn, name in enumerate(("north", "west", "south", "east")):
        axis = (_NORTH, _WEST)[turn % 2]
        for k, outline in enumerate(outlines):
            # the groin cuts the course at y = |x|, on its far side this far from the centre
            far_side = float(np.abs(outline[:, 0]).max())
            # laid from the free edge inwards, so that the piece at the groin is the odd one
            cuts = _pieces(0.0, half_bay, unit, half=k % 2 == 1, least=far_side + _LEAST_PIECE * unit)
            for j, (a, b) in enumerate(cuts):
                piece = prism(outline, half_bay - b, half_bay - a)
                site.add(_name(name, k, j, len(outlines)), _turned(_mitred(piece, slack), turn), axis=axis)


def _pieces(start: float, end: float, unit: float, *, half: bool, least: float) -> list[tuple[float, float]]:
    """Start and end of every piece of a course [m].

    Parameters
    ----------
    start, end : of the course [m]
    unit : length of a stone [m]
    half : whether the first piece is half a unit long, so that the course laps those beside it
    least : length of the last piece [m], which is longer where what is left over would be shorter
    """
    cuts, at = [start], start + (0.5 if half else 1.0) * unit
    while at < end - least + _ROUNDING * unit:
        cuts.append(at)
        at += unit
    return list(zip(cuts, [*cuts[1:], end], strict=True))


def _mitred(piece: Solid, slack: float) -> Solid:
    """What of a piece lies in y >= |x|.

    The vertical planes through the diagonals of the bay bound it.

    Parameters
    ----------
    piece : convex, of the web along +y
    slack : distance from the cut at which a vertex lies on it [m]
    """
    for side in (1.0, -1.0):
        kept, _, _ = split_solid(piece, np.zeros(3), np.array([side, -1.0, 0.0]) / math.sqrt(2.0), slack)
        if kept is None:
            raise InputError("projection: the bay is too small, a course has no length between its groins")
        piece = kept
    return piece


def _turned(solid: Solid, quarters: int) -> Solid:
    """A solid turned about the z axis by so many ``quarters`` of a turn, exactly."""
    vertices = solid.vertices
    for _ in range(quarters):
        vertices = np.column_stack([-vertices[:, 1], vertices[:, 0], vertices[:, 2]])
    # adding zero turns -0.0 into 0.0
    return Solid(vertices + 0.0, solid.faces)


def _name(word: str, course: int, position: int, courses: int) -> str:
    """Name of a stone, "word-03-02".

    Its course and its place in it are counted from 0.

    The number of all courses says how many digits that of a course has.
    """
    digits = max(2, len(str(courses)))
    return f"{word}-{course + 1:0{digits}d}-{position + 1:02d}"
