"""DXF drawings: what is closed, and what single lines close together, as outlines of blocks, by layer.

Needs the extra ``limitmason[dxf]``.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import not_negative, positive
from limitmason.errors import InputError
from limitmason.formats.outlines import DrawnOutlines, Outlines, check_layers, named_layers
from limitmason.model.plausibility import PlausibilityWarning
from limitmason.storage.files import named_path, needed

_UNITS = {
    1: 0.0254,  # inches
    2: 0.3048,  # feet
    4: 1e-3,  # millimetres
    5: 1e-2,  # centimetres
    6: 1.0,  # metres
    7: 1e3,  # kilometres
    10: 0.9144,  # yards
    14: 0.1,  # decimetres
}
"""Metres by the code of a unit in the header variable $INSUNITS."""

_POLYLINES = ("LWPOLYLINE", "POLYLINE")
_FACES = ("SOLID", "TRACE", "3DFACE")
_CURVES = (*_POLYLINES, *_FACES, "LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
_FILLS = ("HATCH", "MPOLYGON")
_UNREAD = ("REGION", "BODY", "3DSOLID", "SURFACE", "MESH", "MLINE", "IMAGE", "OLE2FRAME", "ACAD_PROXY_ENTITY")
"""What may show stones and cannot be read: told, not passed over."""

_OWN = "0"  # the layer that takes that of the insert

_FITTED = 2 | 4  # flags of a POLYLINE whose vertices were put there by curve or spline fitting

_LEAST_FLATNESS = 1e-12
"""Units of the drawing, chosen: ezdxf refuses zero, and takes millions of chords at this."""

_IN_PLANE = 1e-6
"""Height of a line over its size up to which it lies in the plane of the drawing; chosen, above rounding."""

_MOST_CHORDS = 10_000
"""Of a curve between two knots, chosen: no drawing of stones needs more."""

_LEAST_TURN = 1e-6
"""Least turn of an arc over one chord [rad], chosen: with a tiny flatness the turn is zero by rounding."""


def read_dxf(
    path: str | Path,
    *,
    layers: str | Iterable[str] | None = None,
    scale: float | None = None,
    flatness: float = 1e-3,
    gap: float = 1e-3,
) -> Outlines:
    """Read the outlines of blocks in the model space of a DXF drawing.

    Closed polylines, circles, ellipses, splines and filled faces are read. So are open ones, lines and arcs where they
    form loops.

    The drawing's x is x, its y becomes z (up). Inserted blocks of the drawing are taken apart; what lies on their layer
    0 takes the layer of the insert. Arcs become chords.
    Lines of a layer form a loop where their ends meet within ``gap``; what encloses nothing is counted in a warning.
    A hatch is a block where nothing else is drawn; mostly it repeats the lines around it, and is left out. So are texts
    and dimensions, and what the drawing marks as invisible.

    Parameters
    ----------
    path : of the drawing
    layers : names of the layers to read, upper and lower case alike; by default all that are shown, neither off nor
        frozen, nor inserted on a frozen one
    scale : metres per drawing unit; by default from the drawing's $INSUNITS
    flatness : largest distance between an arc and its chord [m]
    gap : distance up to which ends of single lines meet [m]

    Returns
    -------
    Outlines
        In the order of the drawing; names count from 1 within each layer.

    Raises
    ------
    ImportError
        When ezdxf is not installed; the message says how to install it.
    InputError
        Naming the file, and the layer and handle of the entity: an open polyline that encloses nothing with its
        neighbours, a drawing without units, an unknown layer, an insert of a block that is missing, nothing to read.

    Warns
    -----
    PlausibilityWarning
        With the number of single lines, arcs and splines of each layer that enclose nothing, of hatches that are taken
        as blocks or have islands, of regions, solids, images and other drawings referred to, which cannot be read, and
        of lines on hidden layers.
    """
    not_negative("flatness", flatness)
    ezdxf, ezpath = (needed(name, "DXF drawings", "dxf") for name in ("ezdxf", "ezdxf.path"))
    try:
        drawing = ezdxf.readfile(named_path(path))
    except ezdxf.DXFError as error:
        raise InputError(f"{path}: not a DXF drawing that can be read: {error}") from None
    except OSError as error:
        # ezdxf reports text that is no DXF as an OSError; a missing file stays what it is
        if isinstance(error, FileNotFoundError):
            raise
        raise InputError(f"{path}: not a DXF drawing: {error}") from None
    except (StopIteration, ValueError, LookupError, AttributeError, RuntimeError) as error:
        # a file that ends too early leaves the reader with what it did not expect
        raise InputError(f"{path}: not a whole DXF drawing ({type(error).__name__} {error}): written again?") from None
    metres = _metres_per_unit(drawing, path) if scale is None else positive("scale", scale, "m per drawing unit")
    wanted = named_layers(layers)
    there = [layer.dxf.name for layer in drawing.layers]
    # of layers asked for by name all is read, frozen or not
    frozen = frozenset(layer.dxf.name.casefold() for layer in drawing.layers if layer.is_frozen() and wanted is None)
    try:
        entities = list(_entities(drawing.modelspace(), frozen))
    except (ezdxf.DXFError, RecursionError) as error:
        raise InputError(f"{path}: an inserted block cannot be taken apart: {error}; purge or explode it") from None
    check_layers(wanted, [*there, *(layer for _, layer in entities)], path)
    # names of layers differ by more than upper and lower case: an entity may spell that of its layer in its own way
    spelt = {name.casefold(): name for name in reversed([*there, *(layer for _, layer in entities)])}
    hidden = {layer.dxf.name.casefold() for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    drawn = DrawnOutlines()
    unread: Counter[tuple[str, str]] = Counter()
    unseen: Counter[str] = Counter()
    for entity, spelling in entities:
        layer = spelt[spelling.casefold()]
        if wanted is not None and layer.casefold() not in wanted:
            continue
        if wanted is None and layer.casefold() in hidden:
            unseen[layer] += 1
            continue
        where = f"{path}: layer {layer!r}, entity {entity.dxf.handle or 'of an inserted block'}"
        kind = entity.dxftype()
        if kind in _UNREAD:
            unread[kind, layer] += 1
        elif kind == "INSERT":
            unread["external reference", layer] += 1
        elif kind in _FILLS:
            rings = [_flat(p, metres, flatness, where) for p in ezpath.from_hatch(entity)]
            drawn.fill(layer, [r for r in rings if len(r) > 2])
        else:
            points, closed = _line(entity, ezpath, metres, flatness, where)
            drawn.take(layer, points, closed, kind, where)
    for (kind, layer), n in unread.items():
        warnings.warn(
            f"{path}: layer {layer!r}: {n} {kind} cannot be read and {'is' if n == 1 else 'are'} left out; explode "
            "them to lines where they are blocks", PlausibilityWarning, stacklevel=2,
        )
    for layer, n in unseen.items():
        warnings.warn(
            f"{path}: layer {layer!r} is off or frozen: {n} {'entity is' if n == 1 else 'entities are'} left out; name "
            "it in layers= to read it", PlausibilityWarning, stacklevel=2,
        )
    found = drawn.outlines(gap, path, _POLYLINES)
    if not found.outlines:
        where = "" if wanted is None else " on the layers asked for"
        raise InputError(f"{path}: no closed outline{where}; draw every block as one, in the model space")
    return found


def _line(entity: Any, ezpath: Any, metres: float, flatness: float, where: str) -> tuple[Array, bool]:
    """Points x, z of an entity [m], shape (n, 2), and whether it is drawn as closed.

    Parameters
    ----------
    entity : of ezdxf
    ezpath : its module of paths, an optional library
    metres : metres per unit of the drawing
    flatness : largest distance between an arc and its chord [m]
    where : the file, layer and entity, for errors
    """
    if entity.dxftype() in _POLYLINES:
        return _polyline(entity, ezpath, metres, flatness, where)
    if entity.dxftype() == "SPLINE" and not entity.construction_tool().is_clamped:
        return _in_plane(_periodic(entity.construction_tool(), flatness / metres), where) * metres, False
    # circles and the like come as closed because they end where they began
    return _flat(ezpath.make_path(entity), metres, flatness, where), False


def _flat(path: Any, metres: float, flatness: float, where: str) -> Array:
    """Points x, z of a path of ezdxf [m], shape (n, 2).

    The other arguments are those of :func:`_line`.
    """
    points = np.array([tuple(p) for p in path.flattening(max(flatness / metres, _LEAST_FLATNESS))])
    return _in_plane(points, where) * metres


def _periodic(spline: Any, flatness: float) -> Array:
    """Points x, y, z of a spline whose knots do not end in its ends, as a closed one has them, shape (n, 3).

    Such a curve is drawn over its inner knots alone; ezdxf goes on to the outermost.

    Parameters
    ----------
    spline : of ezdxf
    flatness : largest distance between the curve and its chord, in units of the drawing
    """
    knots, degree = np.array(spline.knots()), spline.degree
    inner = np.unique(knots[degree : len(knots) - degree])
    pieces = []
    for a, b in pairwise(inner.tolist()):
        n, far = 2, np.inf
        # chords of half the length are four times as near; the middles of the chords tell how near they are
        while far > max(flatness, _LEAST_FLATNESS) and n < _MOST_CHORDS:
            n *= 2
            points = np.array([tuple(p) for p in spline.points(np.linspace(a, b, n + 1))])
            far = float(np.linalg.norm(points[1::2] - 0.5 * (points[:-1:2] + points[2::2]), axis=1).max())
        pieces += [points[:-1:2]]
    return np.concatenate([*pieces, points[-1:]])


def _entities(space: Any, frozen: frozenset[str], inserted_on: str = _OWN) -> Iterable[tuple[Any, str]]:
    """Entities that may show blocks, each with its layer.

    Inserts are taken apart. Of one on a frozen layer nothing shows, whatever layers its parts lie on: they count as
    parts of the frozen one. Of one on a layer that is off, parts on other layers show.

    Parameters
    ----------
    space : entities of ezdxf, of the model space or of an inserted block
    frozen : names of frozen layers, in lower case
    inserted_on : layer of the insert: what lies on layer 0 of a block of the drawing takes it
    """
    for entity in space:
        if entity.dxf.get("invisible", 0):
            continue
        hides = inserted_on.casefold() in frozen
        layer = inserted_on if hides or entity.dxf.layer == _OWN else entity.dxf.layer
        if entity.dxftype() == "INSERT" and _is_elsewhere(entity):
            yield entity, layer
        elif entity.dxftype() == "INSERT":
            # one insert may stand for rows and columns of copies
            for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _entities(one.virtual_entities(), frozen, layer)
        elif entity.dxftype() in (*_CURVES, *_FILLS, *_UNREAD):
            yield entity, layer


def _is_elsewhere(insert: Any) -> bool:
    """Whether the parts of an insert of ezdxf are in another file."""
    block = insert.block()
    return block is not None and bool(block.block.is_xref or block.block.is_xref_overlay)


def _metres_per_unit(drawing: Any, path: str | Path) -> float:
    """Metres per unit of a drawing of ezdxf, by its header.

    ``path`` names it in errors.
    """
    code = int(drawing.header.get("$INSUNITS", 0))
    if code not in _UNITS:
        raise InputError(
            f"{path}: the drawing has no unit of length that is known ($INSUNITS = {code}); give scale=, the metres "
            "per drawing unit, for example scale=0.001 for millimetres"
        )
    return _UNITS[code]


def _polyline(entity: Any, ezpath: Any, metres: float, flatness: float, where: str) -> tuple[Array, bool]:
    """Points x, z of a polyline [m], shape (n, 2), and whether it is drawn as closed.

    Parameters
    ----------
    entity : LWPOLYLINE or POLYLINE of ezdxf
    ezpath : its module of paths, an optional library
    metres : metres per unit of the drawing
    flatness : largest distance between an arc and its chord [m]
    where : the file, layer and entity, for errors
    """
    kind = entity.dxftype()
    if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
        raise InputError(f"{where}: a mesh is no outline; explode it or leave its layer out")
    # neither has arcs between its vertices, as the other polylines may
    if kind == "POLYLINE" and (entity.is_3d_polyline or entity.dxf.flags & _FITTED):
        return _flat(ezpath.make_path(entity), metres, flatness, where), bool(entity.is_closed)
    # x, y and bulge of every corner, in the plane of the polyline
    corners = entity.get_points("xyb") if kind == "LWPOLYLINE" else [
        (*tuple(v.dxf.location)[:2], v.dxf.get("bulge", 0.0)) for v in entity.vertices
    ]
    flat = _with_arcs(np.array(corners, dtype=float).reshape(-1, 3), entity.is_closed, flatness / metres)
    height = float(entity.dxf.get("elevation", 0.0)) if kind == "LWPOLYLINE" else 0.0
    # that plane has axes of its own where the line was mirrored or drawn in another view
    points = np.array([tuple(p) for p in entity.ocs().points_to_wcs([(x, y, height) for x, y in flat.tolist()])])
    return _in_plane(points, where) * metres, bool(entity.is_closed)


def _in_plane(points: Array, where: str) -> Array:
    """Points x, y of a line, shape (n, 2).

    One that leaves the plane of the drawing is refused.

    Parameters
    ----------
    points : x, y and height, shape (n, 3), in units of the drawing
    where : the file, layer and entity, for errors
    """
    points = points.reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    if len(points) and np.ptp(points[:, 2]) > _IN_PLANE * size:
        raise InputError(f"{where}: the line does not lie in the plane of the drawing")
    return points[:, :2]


def _with_arcs(corners: Array, closed: bool, flatness: float) -> Array:
    """Points x, y of a polyline with chords for its arcs, shape (m, 2).

    The chords of an arc are of equal length. The library's own flattening goes through Bezier curves, which leave the
    arc by 3e-4 of its radius.

    Parameters
    ----------
    corners : x, y and bulge of every corner, shape (n, 3), in units of the drawing. The bulge is tan(angle / 4) of the
        arc from there to the next corner, positive counter-clockwise, zero for a straight side
    closed : whether the last corner goes on to the first
    flatness : largest distance between an arc and its chord, in units of the drawing
    """
    out = []
    for k, (x, y, bulge) in enumerate(corners):
        start = np.array([x, y])
        out.append(start[None])
        if bulge == 0.0 or (k + 1 == len(corners) and not closed):
            continue
        chord = corners[(k + 1) % len(corners), :2] - start
        length = float(np.linalg.norm(chord))
        if length == 0.0:  # two corners in one place have no arc between them
            continue
        # with b = tan(angle / 4): sin(angle / 2) = 2 b / (1 + b^2), and the centre stands on the chord's bisector
        angle, radius = 4.0 * np.arctan(bulge), length * (1.0 + bulge**2) / (4.0 * abs(bulge))
        centre = start + 0.5 * chord + (1.0 - bulge**2) / (4.0 * bulge) * np.array([-chord[1], chord[0]])
        # a chord that turns by t leaves the arc by radius (1 - cos(t / 2)); two chords at least keep it an arc
        turn = 2.0 * np.arccos(max(1.0 - flatness / radius, 0.0))
        count = max(int(np.ceil(abs(angle) / max(turn, _LEAST_TURN))), 2)
        first = np.arctan2(*(start - centre)[::-1])
        direction = first + angle * np.arange(1, count) / count
        out.append(centre + radius * np.column_stack([np.cos(direction), np.sin(direction)]))
    return np.concatenate(out) if out else np.empty((0, 2))
