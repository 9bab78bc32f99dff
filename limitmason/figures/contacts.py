"""The contact report as a drawing: joints, near misses, faces that touch nothing.

``ax`` are the axes that are drawn on; ``width`` is that of lines, in points; ``axes`` project places in space on the
page, shape (3, 2); ``gid`` names what is drawn.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from limitmason.arrays import Array, Flags
from limitmason.checks import instance
from limitmason.errors import InputError
from limitmason.figures import elevation, style
from limitmason.figures.canvas import Canvas
from limitmason.figures.painter import VIEWPOINT_DEG
from limitmason.model import Assembly
from limitmason.model.contact_report import ContactReport, NearMiss

_CONTACT, _MISS, _WEDGE, _TINY, _EDGE = style.GREEN, style.VERMILION, style.BLUE, style.ORANGE, style.BLACK
_BARE, _BROKEN = style.PURPLE, (0, (1.2, 2.0))
_FLOATS = style.pale(_MISS, 0.25)  # fill of blocks that float
_LABELLED = 12
"""So many near misses get a label; more would cover the drawing, and the printed report names them all."""


@style.in_print_style
def contact_report(
    model: Assembly,
    report: ContactReport | None = None,
    *,
    view: str = "auto",
    labels: bool = True,
    title: str | None = None,
    ax: Axes | None = None,
    viewpoint_deg: tuple[float, float] = VIEWPOINT_DEG,
) -> Figure:
    """Contacts of an assembly (green), wedges kept (blue) and bare faces.

    A wedge is a joint whose faces open at an angle; kept ones are contacts. Near misses, faces that nearly touch but
    are no contact, stand with gap and angle (vermilion).

    Parameters
    ----------
    model : the assembly
    report : from ``model.contact_report()``, which is called when it is not given
    view : "elevation", "3d", or "auto": elevation for a single leaf of prisms, otherwise 3-D, where marks shine through
        the blocks and faces that touch nothing are not marked
    labels : write gap and largest angle at the twelve worst near misses
    title : heading
    ax : axes to draw on; a new figure when not given
    viewpoint_deg : azimuth, from x towards y, and elevation of the viewer in 3-D [deg]

    Returns
    -------
    Figure
        Axes in metres with equal aspect; ``savefig`` writes PNG, PDF or SVG.

    Raises
    ------
    InputError
        For a report of another assembly, and an unknown view.
    """
    instance("model", model, Assembly)
    report = model.contact_report() if report is None else instance("report", report, ContactReport)
    if report.n_blocks != model.n_blocks:
        raise InputError(f"the report is of {report.n_blocks} blocks, the assembly has {model.n_blocks}")
    canvas = Canvas(model, view, ax, viewpoint_deg=viewpoint_deg)
    page, plane, axes, width = canvas.page, canvas.plane, canvas.axes, canvas.width
    loose = np.isin([b.name for b in model.blocks], report.floating)
    canvas.blocks(moving=loose if plane is None else np.zeros(model.n_blocks, dtype=bool))
    found = [i.polygon for i in model.interfaces]
    kept, missed = ([p for row in rows for p in row.polygons] for rows in (report.kept, report.near_misses))
    if plane is not None:
        _loose(page.ax, canvas.drawing, loose, width)
        bare = [f.corners for f in report.untouched if abs(f.normal @ plane.normal) < 0.05]  # seen edge on
        broken = {"linestyle": _BROKEN, "capstyle": "butt"}
        _lines(page.ax, bare, axes, _BARE, width + 0.6, gid="untouched", zorder=2.5, **broken)
        _lines(page.ax, found, axes, _CONTACT, 1.6 * width + 0.5, gid="contacts", zorder=3.0)
        _lines(page.ax, kept, axes, _WEDGE, 2.0 * width + 1.0, gid="kept", zorder=4.0)
        _lines(page.ax, missed, axes, _MISS, 2.0 * width + 1.0, gid="near misses", zorder=4.0)
    else:
        # contacts are many and lie behind each other: they are paler than what is to be decided
        _areas(page.ax, found, axes, _CONTACT, alpha=0.25, gid="contacts")
        _areas(page.ax, kept, axes, _WEDGE, alpha=0.7, gid="kept")
        _areas(page.ax, missed, axes, _MISS, alpha=0.7, gid="near misses")
    canvas.frame()
    _points(page.ax, [c.place for c in report.tiny], axes, marker="o", colour=_TINY, gid="tiny")
    _points(page.ax, [e.place for e in report.edges], axes, marker="x", colour=_EDGE, gid="edges")
    if labels:
        misses = report.near_misses[:_LABELLED]
        named = [(m, _MISS) for m in misses] + [(m, _WEDGE) for m in report.kept[: _LABELLED - len(misses)]]
        _label(page, named, axes)
    return page.finish(
        title, _caption(report), [*_handles(report, plane=plane is not None), *canvas.handles(moves=False)]
    )


def _lines(
    ax: Axes, polygons: list[Array], axes: Array, colour: str, width: float, gid: str, zorder: float, **look: Any
) -> None:
    """Draw polygons seen edge on: their longest stretch on the page.

    Parameters
    ----------
    axes : of the page, as columns, shape (3, 2)
    colour : of the lines
    polygons : corners [m], shape (n, 3) each
    width : of the lines [pt]
    gid, zorder, look : name, height in the drawing and further options of the lines in matplotlib
    """
    if not polygons:
        return
    segments = []
    for polygon in polygons:
        flat = polygon @ axes
        # the two corners that lie farthest apart on the page
        apart = np.linalg.norm(flat[:, None] - flat[None], axis=2)
        i, j = np.unravel_index(int(apart.argmax()), apart.shape)
        segments.append(flat[[i, j]])
    look = {"capstyle": "round", **look}
    ax.add_collection(LineCollection(segments, colors=colour, linewidths=width, gid=gid, zorder=zorder, **look))


def _areas(ax: Axes, polygons: list[Array], axes: Array, colour: str, alpha: float, gid: str) -> None:
    """Draw polygons seen from the front, filled; corners in [m], shape (n, 3).

    ``alpha`` is from 0, clear, to 1, opaque; ``axes`` are those of the page, shape (3, 2).
    """
    if polygons:
        flat = [p @ axes for p in polygons]
        ax.add_collection(PolyCollection(
            flat, facecolors=colour, edgecolors=colour, linewidths=0.5, alpha=alpha, gid=gid, zorder=5.0,
        ))


def _loose(ax: Axes, drawing: elevation.Elevation, loose: Flags, width: float) -> None:
    """Draw blocks that float, flagged by ``loose``, filled."""
    if loose.any():
        ax.add_collection(PathCollection(
            drawing.paths(np.flatnonzero(loose)), facecolors=_FLOATS, edgecolors=style.OUTLINE,
            linewidths=width, gid="floating", zorder=2.2,
        ))


def _points(ax: Axes, places: list[Array], axes: Array, marker: str, colour: str, gid: str) -> None:
    """Draw open markers at places in space [m], shape (3,) each."""
    if places:
        x, z = (np.array(places) @ axes).T
        (line,) = ax.plot(x, z, marker, color=colour, markersize=4.5, markerfacecolor="none", markeredgewidth=1.1,
                          linestyle="none", zorder=6.0)
        line.set_gid(gid)


def _label(page: style.Page, rows: list[tuple[NearMiss, str]], axes: Array) -> None:
    """Write gap and angle beside each near miss, where no other label is.

    The first free of eight places around it is taken, or the last where none is free.

    Parameters
    ----------
    page : whose axes have their limits
    rows : near misses with the colours of their labels
    """
    ax, size = page.ax, 6.5  # of the letters [pt]
    taken: list[tuple[Array, Array]] = []  # lower left and upper right corners of the labels so far
    middle = np.array([np.mean(ax.get_xlim()), np.mean(ax.get_ylim())])
    for row, colour in rows:
        text = f"{_gap(row)}, {row.angle_deg:.2g}°"
        at = row.place @ axes
        out = np.where(at >= middle, 1.0, -1.0)  # outwards from the middle of the drawing, where there is room
        # in points on the page, from its middle
        here = 72.0 * page.inch * (at - middle)
        # size of the text in points, by the mean width of a letter
        box = np.array([0.58 * size * len(text) + 4.0, size + 5.0])
        # a low place in each of the four directions, outwards first, then a high one
        for lift, side in [(k, (u, v)) for k in (8.0, 24.0) for u in (1, -1) for v in (1, -1)]:
            step = out * side * (9.0, lift)
            low = here + np.where(step < 0.0, step - box, step)
            if all((low >= end).any() or (low + box <= start).any() for start, end in taken):
                break
        taken.append((low, low + box))
        ax.annotate(
            text, tuple(at), tuple(step), textcoords="offset points", ha="left" if step[0] > 0 else "right",
            va="bottom" if step[1] > 0 else "top", fontsize=size, color=colour,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": colour, "linewidth": 0.4},
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5}, zorder=7.0, annotation_clip=False,
        )


def _gap(row: NearMiss) -> str:
    """Gap of a near miss in mm, as a range where it differs by more than 1 %."""
    low, high = (1e3 * g for g in row.gap)
    return f"{high:.2g} mm" if high - low <= 0.01 * abs(high) else f"{low:.2g}\N{EN DASH}{high:.2g} mm"


def _caption(report: ContactReport) -> str:
    """What ``report`` found, in one line."""
    return " · ".join([
        f"{len(report.contacts)} contacts of {report.n_blocks} blocks", f"tolerance {report.tolerance_text}",
        f"angle {report.rules.angle_deg:g}°",
        f"to decide: {', '.join(report.decisions)}" if report.decisions else "nothing to decide",
    ])


def _handles(report: ContactReport, *, plane: bool) -> list[Patch | Line2D]:
    """Legend entries of the drawing, which is an elevation where ``plane`` is true."""
    mark: dict[str, Any] = {"linestyle": "none", "markersize": 4.5, "markerfacecolor": "none"}
    # what there is of a kind, its colour and name, and how its mark differs from a thick line
    entries: list[tuple[Any, str, str, dict[str, Any]]] = [
        (report.contacts, _CONTACT, "contact", {}), (report.kept, _WEDGE, "wedge kept: gap, angle", {}),
        (report.near_misses, _MISS, "near miss: gap, angle", {}),
        (plane and report.untouched, _BARE, "touches nothing", {"linewidth": 1.2, "linestyle": _BROKEN}),
        (report.tiny, _TINY, "tiny contact", {**mark, "marker": "o"}),
        (report.edges, _EDGE, "edge or corner only", {**mark, "marker": "x"}),
    ]
    handles: list[Patch | Line2D] = [
        Line2D([], [], color=colour, label=label, **{"linewidth": 1.8, **look})
        for rows, colour, label, look in entries if rows
    ]
    if report.floating:
        colour = _FLOATS if plane else style.STONE
        handles.append(Patch(facecolor=colour, edgecolor=style.OUTLINE, linewidth=0.5, label="floats"))
    return handles
