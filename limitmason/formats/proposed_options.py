"""Which option of a reader makes the stones of a drawing meet: measured from the space between them. Needs shapely."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.formats.drawing import OPENINGS, PLANE_DRAWINGS, outlines_of, read_drawing
from limitmason.formats.outline_repair import need_shapely
from limitmason.formats.outlines import Outlines
from limitmason.model import ContactError
from limitmason.storage.files import named_path

EVEN = 0.3
"""Joints of one thickness: most of them differ from the median by less than this share."""

LYING_IN = 0.2
"""Share of every outline of a layer that lies in stones of others where the layer holds no stones."""

_MOST = 0.8
"""Share of the open joints that have to be even for the space to be mortar; chosen."""

_OPEN = 1e-5
"""Width from which on a joint counts as open [m]; chosen: narrower ones are rounding of the drawing."""

_WIDEST = 3.0
"""Widest open joint over the median; chosen: what is wider is taken for no joint."""

_OVERLAP = 0.005
"""Gap that is tried where nothing is open [m]: the default of :func:`limitmason.formats.clean`."""

_COARSE = 4.5e-3
"""Length above which a proposal is rounded to whole millimetres [m], below it to tenths; chosen."""


class Proposal(NamedTuple):
    """What was measured, in words, the options that make the stones meet, and how many blocks still float then."""

    why: str
    options: dict[str, Any]
    floating: int

    @property
    def flags(self) -> str:
        """The options as they are typed on the command line."""
        layers = "".join(f" '{n}'" if " " in n else f" {n}" for n in self.options.get("layers", ()))
        lengths = "".join(f" --{k} {v:g}" for k, v in self.options.items() if k != "layers")
        return (lengths + (f" --layers{layers}" if layers else "")).strip()


def proposal(path: str | Path, **given: Any) -> Proposal | None:
    """Options of ``read_drawing`` that make more stones of a drawing touch.

    Each is tried before it is proposed, see :func:`limitmason.formats.read_drawing`.

    Parameters
    ----------
    path : .dxf or .svg
    given : options of ``read_drawing`` that are settled: ``scale``, ``thickness``, ``layers``

    Returns
    -------
    Proposal
        None where the stones meet as they are drawn, where nothing that was tried helps, and for solids.
    """
    if not isinstance(path, str | Path):
        raise InputError(f"path must be the name of a drawing, got {path!r}")
    path = named_path(path)
    if path.suffix.lower() not in PLANE_DRAWINGS:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return _proposal(path, given)


def _proposal(path: Path, given: dict[str, Any]) -> Proposal | None:
    """What makes the stones of a drawing meet: layers, mortar or gap, tried in turn.

    Gaps that are nearly all of one width are mortar, others are errors of drawing. What leaves the fewest blocks
    without support is proposed, where these are fewer than in the drawing as it is.

    Parameters
    ----------
    path : of the drawing
    given : options of ``read_drawing`` that are settled
    """
    drawn = outlines_of(path, given.get("scale"), gap=None, layers=given.get("layers"))
    why: list[str] = []
    options: dict[str, Any] = {}
    left = _in_others(drawn)
    if left:
        options["layers"] = [n for n in dict.fromkeys(drawn.layers) if n not in left]
        why.append(f"what is drawn on {', '.join(map(repr, left))} lies in stones of other layers")
        drawn = outlines_of(path, given.get("scale"), gap=None, layers=options["layers"])
    before = _floating(path, given)
    gaps = open_joints(drawn.outlines)
    wide = gaps[gaps > _OPEN]
    # each a text and the options it is for; layers that are left out may be all that is needed
    trials: list[tuple[str, dict[str, Any]]] = [("", {})] if left else []
    if len(wide):
        median = float(np.median(wide))
        largest = float(wide[wide <= _WIDEST * median].max())
        alike = float(np.mean(np.abs(wide - median) <= EVEN * median))
        even = alike > _MOST and len(wide) > 0.5 * len(gaps)
        mortar = f"{1e3 * median:.3g} mm of open mortar {'everywhere' if len(wide) == len(gaps) else 'in most joints'}"
        gap = f"gaps of up to {1e3 * largest:.2g} mm between stones"
        # twice the width, chosen: corners that have to meet are farther apart than their sides
        ways = [(mortar, {"mortar": _up(largest)}), (gap, {"gap": _up(2.0 * largest)})]
        trials += ways if even else ways[::-1]
    elif before is None:
        # nothing is open: what is wrong are overlaps or stones drawn twice
        trials.append(("stones overlap, or are drawn twice", {"gap": _OVERLAP}))
    best, least = None, None if before is None else len(before)
    for text, more in trials:
        floating = _floating(path, given | options | more)
        if floating is not None and (least is None or len(floating) < least):
            least = len(floating)
            best = Proposal("; ".join([t for t in (text, *why) if t]), more | options, least)
        if best is not None and best.floating == 0:
            break
    return _without_loose_layers(path, given, drawn, best)


def _without_loose_layers(path: Path, given: dict[str, Any], drawn: Outlines, best: Proposal | None) -> Proposal | None:
    """The proposal without layers whose outlines all float, if fewer blocks float so.

    So a pipe that is drawn in an opening is left out, which is no stone.

    Parameters
    ----------
    path : of the drawing
    given : options of ``read_drawing`` that are settled
    drawn : outlines on the layers of the proposal
    best : the proposal so far; None for none, which stays none
    """
    if best is None or best.floating == 0:
        return best
    floating = set(_floating(path, given | best.options) or ())
    held = {layer for name, layer in zip(drawn.names, drawn.layers, strict=True) if name not in floating}
    loose = [layer for layer in dict.fromkeys(drawn.layers) if layer not in held]
    options = best.options | {"layers": [layer for layer in dict.fromkeys(drawn.layers) if layer in held]}
    left = _floating(path, given | options) if loose and options["layers"] else None
    if left is None or len(left) >= best.floating:
        return best
    return Proposal(f"{best.why}; nothing on {', '.join(map(repr, loose))} is held by a stone", options, len(left))


def open_joints(outlines: list[Array]) -> Array:
    """Widths of the gaps that have to be closed to connect all outlines [m].

    They are the lengths of the minimum spanning tree of the outlines' distances, shape (n - 1,) or fewer: those that
    are wider than half a stone are left out. ``outlines`` are corners x, z [m], shape (k, 2) each.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    shapely = need_shapely()
    stones = shapely.make_valid([shapely.Polygon(o) for o in outlines])
    reach = 0.5 * float(np.median(np.sqrt(shapely.area(stones))))
    i, j = shapely.STRtree(stones).query(stones, predicate="dwithin", distance=reach)
    i, j = i[i < j], j[i < j]
    nothing = 1e-9 * reach  # a sparse matrix takes zero for no connection
    between = shapely.distance(stones[i], stones[j]) + nothing
    # of 32 bits: scipy before 1.17 takes no other numbers here
    pairs = (i.astype(np.int32), j.astype(np.int32))
    tree = minimum_spanning_tree(coo_array((between, pairs), shape=(len(stones), len(stones))).tocsr())
    return np.asarray(np.maximum(tree.data - nothing, 0.0))


def _up(length: float) -> float:
    """A length rounded up to the millimetre, a small one to a tenth of it [m]."""
    step = 1e-3 if length > _COARSE else 1e-4
    # a length that is a whole number of steps, but for a thousandth of one, stays that number
    return round(step * math.ceil(length / step - 1e-3), 4)


def _in_others(drawn: Outlines) -> list[str]:
    """Layers that hold no stones.

    All that is drawn on them lies in outlines of others. ``drawn`` are the outlines of all layers.
    """
    shapely = need_shapely()
    stones = shapely.make_valid([shapely.Polygon(o) for o in drawn.outlines])
    layers, area = np.array(drawn.layers), shapely.area(stones)
    out = []
    for name in dict.fromkeys(drawn.layers):
        mine = layers == name
        # large areas are stones themselves, over which something smaller is drawn; chosen: half of all others
        if mine.all() or name.casefold() in OPENINGS or area[mine].sum() > 0.5 * area[~mine].sum():
            continue
        rest = shapely.union_all(stones[~mine])
        if (shapely.area(shapely.intersection(stones[mine], rest)) > LYING_IN * area[mine]).all():
            out.append(name)
    return out


def _floating(path: Path, options: dict[str, Any]) -> tuple[str, ...] | None:
    """Names of the blocks without a chain of contacts to a support.

    None where the options of ``read_drawing`` leave no assembly of the drawing ``path``, or stones that overlap.
    """
    try:
        report = read_drawing(path, **options).contact_report()
    except ContactError as error:  # raised for stones that overlap, and also where a single stone floats
        report = error.assembly.contact_report()
    except InputError:
        return None
    return None if report.overlaps else tuple(report.floating)
