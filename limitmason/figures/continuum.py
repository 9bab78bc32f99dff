"""Solids of bricks in space: moved, and coloured by stress, strain or cracks.

``model`` is the solid, ``ax`` are the axes that are drawn on.
"""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import instance, numbers, positive
from limitmason.continuum import Continuum
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.painter import VIEWPOINT_DEG, Camera, camera, viewpoint

_BAR = 0.62  # width that a colour bar takes beside the drawing [in]
_LIGHT = np.array([0.35, -0.45, 0.82])  # direction of the light, of length 1 but for rounding: above the viewer
_STONE = (0.80, 0.76, 0.70)  # red, green and blue of bricks without values
_EQUAL = 1e-12  # difference of two values over the larger one that is rounding [-]
_FRACTION = 15.0  # size of the structure over the largest displacement as drawn where no scale is given


@style.in_print_style
def solid_map(
    model: Continuum,
    values: ArrayLike | None = None,
    *,
    displacement: ArrayLike | None = None,
    scale: float | None = None,
    label: str = "",
    limits: tuple[float, float] | None = None,
    colours: str = "viridis",
    title: str | None = None,
    caption: str | None = None,
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
    ax: Axes | None = None,
) -> Figure:
    """Drawing of the free faces of a solid, where its nodes have moved to.

    Faces have the colour of a value per brick, where values are given.

    Parameters
    ----------
    model : the solid
    values : one per brick, shape (m,), or per integration point, shape (m, q), of which that of the
        largest size in a brick counts, with its sign
    displacement : of the nodes [m], shape (n_nodes, 3)
    scale : factor on displacements, > 0; by default the largest is drawn as a fifteenth of the structure's size
    label : of the colour bar, with its unit
    limits : lowest and highest colour; those of the values by default
    colours : a colour map of matplotlib
    title : heading
    caption : text under it after the scale
    viewpoint_deg : azimuth and elevation of the viewer [deg]
    ax : axes to draw on; a new figure when not given
    """
    instance("model", model, Continuum)
    if colours not in colormaps:
        raise InputError(f"colours must be the name of a colour map of matplotlib, got {colours!r}")
    if values is None and limits is not None:
        raise InputError("limits are of the colours of values: give these, or leave them out")
    moved, text = _moved(model, displacement, scale)
    view = camera(*viewpoint(viewpoint_deg))
    per_brick = None if values is None else _per_brick(model, values)
    page_points = view.project(moved)
    low, high = page_points.min(axis=0), page_points.max(axis=0)
    page = style.Page(high - low, ax, framed=False, beside=0.0 if per_brick is None else _BAR)
    norm = None
    if per_brick is not None:
        ends = numbers("limits", (per_brick.min(), per_brick.max()) if limits is None else limits)
        if ends.shape != (2,) or not np.isfinite(ends).all() or ends[0] > ends[1]:
            raise InputError(f"limits are two finite numbers, (lowest, highest), got {limits!r}")
        bottom, top = map(float, ends)
        if top - bottom <= _EQUAL * max(abs(bottom), abs(top)):  # one colour, at the lower end of a bar with numbers
            top = bottom + max(0.1 * abs(bottom), _EQUAL)
        norm = Normalize(bottom, top)
    thin = style.outline_width(page.inch, _brick_size(model))
    _paint(page.ax, model, moved, view, per_brick, norm, colours, thin)
    page.ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    page.ax.axis("off")
    figure = page.finish(title, " · ".join(t for t in (text, caption) if t) or None, [])
    if norm is not None:
        _bar(figure, page.ax, norm, colours, label)
    return figure


def _moved(model: Continuum, displacement: ArrayLike | None, scale: float | None) -> tuple[Array, str]:
    """Places of the nodes as drawn [m], shape (n_nodes, 3), and words about them.

    Parameters
    ----------
    displacement : of the nodes [m], shape (n_nodes, 3); None for the place at rest
    scale : factor on the displacements; None for a largest of a fifteenth of the size
    """
    nodes = model.mesh.nodes
    if displacement is None:
        if scale is not None:
            raise InputError("scale is of displacements: give them, or leave it out")
        return nodes, ""
    u = numbers("displacement", displacement)
    if u.shape != nodes.shape or not np.isfinite(u).all():
        raise InputError(f"displacements must be finite and of shape {nodes.shape}, got shape {u.shape}")
    largest = float(np.linalg.norm(u, axis=1).max())
    size = float(np.ptp(nodes, axis=0).max())
    factor = positive("scale", scale) if scale is not None else size / _FRACTION / largest if largest > 0.0 else 1.0
    return nodes + factor * u, f"largest displacement {1e3 * largest:.3g} mm · drawn {factor:.3g} times"


def _per_brick(model: Continuum, values: ArrayLike) -> Array:
    """One value per brick, (m,): of ``values`` at its points, (m, q), the largest.

    It is the one of the largest absolute value, with its sign.
    """
    v = numbers("values", values)
    if v.ndim == 2:
        v = np.take_along_axis(v, np.abs(v).argmax(axis=1)[:, None], axis=1)[:, 0]
    if v.shape != (len(model.mesh),) or not np.isfinite(v).all():
        raise InputError(f"values must be finite, one per brick ({len(model.mesh)}), got shape {v.shape}")
    return v


def _brick_size(model: Continuum) -> float:
    """Median smallest side of the bricks [m]."""
    c = model.mesh.corners
    return float(np.median((c.max(axis=1) - c.min(axis=1)).min(axis=1)))


def _paint(
    ax: Axes, model: Continuum, places: Array, view: Camera, values: Array | None, norm: Normalize | None,
    colours: str, width: float,
) -> None:
    """Paint the faces that look at the viewer, from behind, coloured by values.

    Parameters
    ----------
    places : of the nodes as drawn [m], shape (n_nodes, 3)
    view : from which they are seen
    values, norm, colours : one number per brick, shape (m,), the range of colours and the colour map; without numbers
        the faces have the colour of stone
    width : of outlines [pt]; edges of bricks are half as thick
    """
    mesh = model.mesh
    faces = mesh.boundary_nodes  # corners around each face, counter-clockwise from outside
    p = places[faces]  # corners in space [m], shape (faces, 4, 3)
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    seen = np.flatnonzero(normal @ view.towards > 0.0)
    # by the depth of their middles: right for faces of like sizes
    depth = p[seen].mean(axis=1) @ view.towards
    seen = seen[np.argsort(depth)]
    light = np.abs(normal[seen] @ _LIGHT) / np.linalg.norm(normal[seen], axis=1)
    if values is None or norm is None:
        base = np.tile(_STONE, (len(seen), 1))
    else:
        owner = mesh.boundary_owner[seen]
        base = colormaps[colours](norm(values[owner]))[:, :3]
    shade = base * (0.78 + 0.22 * light)[:, None]  # chosen: the colour bar still reads in the shade
    flat = list(view.project(p[seen].reshape(-1, 3)).reshape(-1, 4, 2))
    ax.add_collection(
        PolyCollection(flat, facecolors=shade, edgecolors=style.BLACK, linewidths=0.5 * width, gid="bricks")
    )


def _bar(figure: Figure, ax: Axes, norm: Normalize, colours: str, label: str) -> None:
    """Add a colour bar in a strip of ``_BAR`` inches by which the page is widened.

    What is on the page keeps its size and place in inches.

    Parameters
    ----------
    ax : the drawing, beside which the bar stands
    norm, colours, label : range of values, colour map and name of the bar
    """
    width, height = figure.get_size_inches()
    # places on a page are parts of its width, which grows
    for other in figure.axes:
        box = other.get_position()
        place = (box.x0 * width / (width + _BAR), box.y0, box.width * width / (width + _BAR), box.height)
        other.set_position(place)
    for text in figure.texts:
        text.set_x(text.get_position()[0] * width / (width + _BAR))
    figure.set_size_inches(width + _BAR, height)
    box = ax.get_position()
    strip = figure.add_axes((width / (width + _BAR), box.y0 + 0.1 * box.height, 0.09 / width, 0.8 * box.height))
    bar = figure.colorbar(ScalarMappable(norm, colours), cax=strip)
    bar.set_label(label, fontsize=7)
    bar.ax.tick_params(labelsize=6.5, width=0.5, length=2.0)
    bar.outline.set_linewidth(0.5)
