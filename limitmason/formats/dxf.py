"""DXF drawings: what is closed, and what single lines close together, as outlines of blocks, by layer.

Needs the extra ``limitmason[dxf]``.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.formats.outlines import DrawnOutlines, Outlines, check_layers, named_layers
from limitmason.model.plausibility import PlausibilityWarning
from limitmason.storage.files import named_path, needed

# $INSUNITS: code -> (name, metres)
_UNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 4: ("millimetres", 1e-3), 5: ("centimetres", 1e-2), 6: ("metres", 1.0),
    7: ("kilometres", 1e3), 10: ("yards", 0.9144), 14: ("decimetres", 0.1),
}

_POLYLINES = ("LWPOLYLINE", "POLYLINE")
_FACES = ("SOLID", "TRACE", "3DFACE")
_CURVES = (*_POLYLINES, *_FACES, "LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
_FILLS = ("HATCH", "MPOLYGON")
_UNREAD = ("REGION", "BODY", "3DSOLID", "SURFACE", "MESH", "MLINE", "IMAGE", "OLE2FRAME", "ACAD_PROXY_ENTITY")
"""What may show stones and cannot be read: told, not passed over."""

_OWN = "0"  # the layer that takes that of the insert

_FITTED = 2 | 4  # flags of a POLYLINE whose vertices were put there by curve or spline fitting


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
    and dimensions.

    Parameters
    ----------
    path : of the drawing
    layers : names of the layers to read, upper and lower case alike; by default all that are shown, neither off nor
        frozen
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
        neighbours, a drawing without units, an unknown layer, nothing to read.

    Warns
    -----
    PlausibilityWarning
        With the number of single lines, arcs and splines of each layer that enclose nothing, of hatches that are taken
        as blocks or have islands, of regions, solids and images, which cannot be read, and of lines on hidden layers.
    """
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
    check_layers(wanted, [*there, *(layer for _, layer in _entities(drawing.modelspace()))], path)
    hidden = {layer.dxf.name.casefold() for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    drawn = DrawnOutlines()
    unread: Counter[tuple[str, str]] = Counter()
    unseen: Counter[str] = Counter()
    for entity, layer in _entities(drawing.modelspace()):
        if wanted is not None and layer.casefold() not in wanted:
            continue
        if wanted is None and layer.casefold() in hidden:
            unseen[layer] += 1
            continue
        where = f"{path}: layer {layer!r}, entity {entity.dxf.handle or 'of an inserted block'}"
        kind = entity.dxftype()
        if kind in _UNREAD:
            unread[kind, layer] += 1
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
    """Points x, z [m] of an entity, and whether it is drawn as closed."""
    if entity.dxftype() in _POLYLINES:
        return _polyline(entity, ezpath, metres, flatness, where)
    return _flat(ezpath.make_path(entity), metres, flatness, where), False


def _flat(path: Any, metres: float, flatness: float, where: str) -> Array:
    """Points x, z [m] of a path of the library."""
    points = np.array([tuple(p) for p in path.flattening(max(flatness / metres, 1e-12))])
    return _in_plane(points, where) * metres


def _entities(space: Any, inserted_on: str = _OWN) -> Iterable[tuple[Any, str]]:
    """Lines and curves of a space with their layers, those of inserted blocks and of their arrays too.

    What lies on layer 0 of a block lies on the layer on which this is inserted.

    Parameters
    ----------
    inserted_on : layer of the insert, on which a block's own layer 0 lies
    """
    for entity in space:
        layer = inserted_on if entity.dxf.layer == _OWN else entity.dxf.layer
        if entity.dxftype() == "INSERT":
            for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _entities(one.virtual_entities(), layer)
        elif entity.dxftype() in (*_CURVES, *_FILLS, *_UNREAD):
            yield entity, layer


def _metres_per_unit(drawing: Any, path: str | Path) -> float:
    """Metres per unit of a drawing, by its header."""
    code = int(drawing.header.get("$INSUNITS", 0))
    if code not in _UNITS:
        raise InputError(
            f"{path}: the drawing has no unit of length that is known ($INSUNITS = {code}); give scale=, the metres "
            "per drawing unit, for example scale=0.001 for millimetres"
        )
    return _UNITS[code][1]


def _polyline(entity: Any, ezpath: Any, metres: float, flatness: float, where: str) -> tuple[Array, bool]:
    """Points x, z [m] of a polyline, and whether it is drawn as closed.

    Parameters
    ----------
    entity, ezpath : of ezdxf, and its module of paths
    metres : metres per unit of the drawing
    flatness : how far chords may leave an arc [m]
    """
    kind = entity.dxftype()
    if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
        raise InputError(f"{where}: a mesh is no outline; explode it or leave its layer out")
    if kind == "POLYLINE" and (entity.is_3d_polyline or entity.dxf.flags & _FITTED):
        return _flat(ezpath.make_path(entity), metres, flatness, where), bool(entity.is_closed)
    corners = entity.get_points("xyb") if kind == "LWPOLYLINE" else [
        (*tuple(v.dxf.location)[:2], v.dxf.get("bulge", 0.0)) for v in entity.vertices
    ]
    flat = _with_arcs(np.array(corners, dtype=float).reshape(-1, 3), entity.is_closed, flatness / metres)
    height = float(entity.dxf.get("elevation", 0.0)) if kind == "LWPOLYLINE" else 0.0
    points = np.array([tuple(p) for p in entity.ocs().points_to_wcs([(x, y, height) for x, y in flat.tolist()])])
    return _in_plane(points, where) * metres, bool(entity.is_closed)


def _in_plane(points: Array, where: str) -> Array:
    """Points x, y of a line, refused where it leaves the plane of the drawing."""
    points = points.reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) if len(points) else 0.0
    if len(points) and np.ptp(points[:, 2]) > 1e-6 * max(size, 1e-300):
        raise InputError(f"{where}: the line does not lie in the plane of the drawing")
    return points[:, :2]


def _with_arcs(corners: Array, closed: bool, flatness: float) -> Array:
    """Corners x, y with bulge b = tan(angle / 4) of the arc to the next.

    Arcs become chords of equal length.

    The library's own flattening goes through Bezier curves, which leave the arc by 3e-4 of its radius.

    Parameters
    ----------
    corners : x, y and bulge of every vertex, shape (n, 3)
    closed : whether the line is
    flatness : how far chords may leave an arc, unit of the drawing
    """
    out = []
    for k, (x, y, bulge) in enumerate(corners):
        p = np.array([x, y])
        out.append(p[None])
        if bulge == 0.0 or (k + 1 == len(corners) and not closed):
            continue
        chord = corners[(k + 1) % len(corners), :2] - p
        length = float(np.linalg.norm(chord))
        if length == 0.0:
            continue
        angle, radius = 4.0 * np.arctan(bulge), length * (1.0 + bulge**2) / (4.0 * abs(bulge))
        centre = p + 0.5 * chord + (1.0 - bulge**2) / (4.0 * bulge) * np.array([-chord[1], chord[0]])
        step = 2.0 * np.arccos(max(1.0 - flatness / radius, 0.0))
        count = max(int(np.ceil(abs(angle) / max(step, 1e-6))), 2)
        turn = np.arctan2(*(p - centre)[::-1]) + angle * np.arange(1, count) / count
        out.append(centre + radius * np.column_stack([np.cos(turn), np.sin(turn)]))
    return np.concatenate(out) if out else np.empty((0, 2))
