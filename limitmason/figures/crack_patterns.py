"""Crack pattern of a driven structure at moments of its curve."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.figures import elevation, style
from limitmason.figures.deformation import rigid_motion
from limitmason.figures.outline import wall_plane
from limitmason.geometry.rotation import rotation_vectors
from limitmason.mechanics.rigid_motion import RigidMotion, structure_size
from limitmason.model.input import read_list

MOMENTS = ("first crack", "peak", "end")
_WIDEST, _LEAST = 3.0, 0.6  # lines of the largest movement and of next to none [pt]
_THIN = 0.7  # lines of joints that have failed but hardly moved [pt]
_HARDLY = 30.0  # largest movement of a picture over one that counts as hardly any, chosen [-]
_TITLE = 0.3  # height of the heading of a picture [in]
_DRAWN = 0.05  # of the structure: largest displacement as drawn


@style.in_print_style
def cracks(
    curve: Any,
    *,
    at: tuple[str | int, ...] = MOMENTS,
    width: float = 0.15e-3,
    scale: float | None = None,
    title: str | None = None,
    caption: str | None = None,
) -> Figure:
    """Elevations of a driven structure, its joints thicker the more they moved.

    A joint is drawn where it has failed: vermilion where it has opened more than slid, blue where it slid, its line as
    thick as its movement is large beside the largest of the same picture; below a thirtieth of that it is a thin grey
    line.

    Parameters
    ----------
    curve : of ``dem.push``: with ``assembly``, ``opening``, ``slip``, ``failed``, ``states`` and ``first_crack``
    at : moments to draw: "first crack" (of ``width``), "first failure", "peak", "end", or samples by number
    width : opening that counts as a crack [m]
    scale : factor on displacements and rotations; by default so that the largest at the last moment can be seen
    title : heading
    caption : text under it after the scale

    Raises
    ------
    InputError
        For a curve without what its joints did, an unknown moment, and a structure that is no wall of a single leaf.
    """
    if getattr(curve, "failed", None) is None or curve.assembly is None:
        raise InputError("this curve does not tell what its joints did: draw the curve of dem.push")
    chosen = [(_index(curve, moment, width), moment) for moment in read_list("at", at)]
    drawn = one_a_sample([(i, m) for i, m in chosen if i is not None])
    if not drawn:
        told = ", ".join(str(moment) for _, moment in chosen) or "no moments"
        raise InputError(f"none of {told} happened on this curve: name another moment or width")
    model = curve.assembly
    moved = [_moved(curve, i) for i, _ in drawn]
    plane = wall_plane(model)
    if plane is None:
        raise InputError("cracks are drawn in elevation, and this structure has no plane of its own")
    if scale is None:
        scale = style.seen_at(moved[-1][0], _DRAWN * structure_size(model))
    view = elevation.Elevation(model, plane)
    motions = [rigid_motion(model, u, v, scale) for u, v in moved]
    frame = elevation.window_of([view.frame(m) for m in motions])
    text = [f"displacements drawn {scale:g} times"]
    late = {"first crack": f"no first crack: never {1e3 * width:g} mm wide", "first failure": "no first failure"}
    text += [late[str(m)] for i, m in chosen if i is None]
    text += [caption] if caption else []
    page = style.page_width()
    # scale of the drawings [in/m]: on the page beside the numbers of their axes, each at most 3.2 in high
    inch = float(min((page - 0.67) / frame.span[0], 3.2 / frame.span[1]))
    figure, axes = style.panels(page, len(drawn) * (frame.span[1] * inch + _TITLE) + 0.3, rows=len(drawn))
    thin = style.outline_width(inch, view.block_size(), widest=0.5)  # thinner than the marks of joints
    for ax, (i, moment), motion in zip(axes, drawn, motions, strict=True):
        elevation.draw_blocks(ax, view, thin, motion=motion)
        _draw_joints(ax, view, motion, curve, i)
        elevation.set_frame(ax, view, frame)
        ax.set_title(_heading(curve, i, moment), loc="left", fontsize=8.0, pad=3.0)
        if ax is not axes[-1]:
            ax.set_xlabel("")
            ax.tick_params(labelbottom=False)
    entries = (
        (style.OPENING, _WIDEST, "joint opened"), (style.SLIDING, _WIDEST, "joint slid"),
        (style.GHOST, _THIN, "failed, hardly moved"),
    )
    handles = [Line2D([], [], color=colour, linewidth=wide, label=label) for colour, wide, label in entries]
    return style.finished(figure, title, " · ".join(text), handles)


def one_a_sample(moments: list[tuple[int, str | int]]) -> list[tuple[int, str]]:
    """Samples in the order in which they are named, with all moments of each.

    Moments are joined by "and".

    Parameters
    ----------
    moments : sample and moment, a name or the number of a sample
    """
    names: dict[int, list[str]] = {}
    for index, moment in moments:
        names.setdefault(index, []).append(moment if isinstance(moment, str) else f"sample {index}")
    return [(index, " and ".join(dict.fromkeys(found))) for index, found in names.items()]


def sample_of(curve: Any, moment: str | int) -> int:
    """Sample of ``curve`` at a moment: "peak", "end", or a number, also from the end."""
    if isinstance(moment, str) and moment not in ("peak", "end"):
        raise InputError(f"unknown moment {moment!r}: 'peak', 'end' or a sample by number")
    return int(curve.peak.index) if moment == "peak" else int(curve.point(-1 if moment == "end" else moment).index)


def _index(curve: Any, moment: str | int, width: float) -> int | None:
    """Number of the sample of ``curve`` at a moment, or None where it did not happen.

    Parameters
    ----------
    moment : as in :func:`cracks`
    width : opening of a first crack [m]
    """
    if not isinstance(moment, str) or moment in ("peak", "end"):
        return sample_of(curve, moment)
    if moment in ("first crack", "first failure"):
        found = curve.first_crack(width) if moment == "first crack" else curve.first_failure
        return None if found is None else found.index
    raise InputError(f"unknown moment {moment!r}: 'first crack', 'first failure', 'peak', 'end' or a sample")


def _moved(curve: Any, index: int) -> tuple[Array, Array]:
    """Displacements [m] and rotation vectors [rad] of blocks at a sample, (n, 3) each.

    They count from the model as it was built: settling under its own weight is a part of them.
    """
    shift, quaternion = curve.states[index]
    return np.asarray(shift), rotation_vectors(np.asarray(quaternion))


def _draw_joints(ax: Axes, view: elevation.Elevation, motion: RigidMotion, curve: Any, index: int) -> None:
    """Draw the joints that have failed, as wide as they have opened or slid.

    Those that moved by less than a thirtieth of the largest are grey and thin.

    Parameters
    ----------
    ax, view : axes, and the elevation that is drawn on them
    motion : of the blocks, as drawn
    curve : of a driven structure: ``opening``, ``slip`` [m] and ``failed`` of its interfaces, shape (samples, k)
    index : number of the sample
    """
    # no record of a joint is no movement
    opening, slip = (np.nan_to_num(getattr(curve, n)[index]) for n in ("opening", "slip"))
    failed = np.nan_to_num(curve.failed[index]) > 0.0
    movement = np.maximum(opening, slip) * failed
    largest = float(movement.max(initial=0.0))
    small = failed & (movement <= largest / _HARDLY)
    widths = np.where(small, _THIN, _LEAST + (_WIDEST - _LEAST) * movement / max(largest, 1e-300))
    for flags, colour, gid in (
        (small, style.GHOST, "failed"), (failed & ~small & (opening >= slip), style.OPENING, "opening"),
        (failed & ~small & (slip > opening), style.SLIDING, "sliding"),
    ):
        rows = np.flatnonzero(flags)
        if len(rows):
            middle = list(0.5 * np.add(*view.segments(rows, motion)))  # between the faces of both blocks
            ax.add_collection(LineCollection(
                middle, colors=colour, linewidths=widths[rows], gid=gid, zorder=3.0, capstyle="butt"
            ))


def _heading(curve: Any, index: int, name: str) -> str:
    """A moment of a curve in words, with the widest opening of a joint.

    ``index`` is the number of its sample, ``name`` what the moment is called.
    """
    widest = 1e3 * float(np.nan_to_num(curve.opening[index]).max(initial=0.0))
    return f"{point_text(curve, index, name)}, widest opening {widest:.2g} mm"


def point_text(curve: Any, index: int, name: str) -> str:
    """A moment of a curve in words: ``name``, load and displacement, N and m with units that fit them.

    ``index`` is the number of its sample.
    """
    point = curve.point(index)
    load, along = f"{point.load:.3g} {curve.load_unit}", f"{point.displacement:.3g} {curve.displacement_unit}"
    load = style.force_text(point.load) if curve.load_unit == "N" else load
    return f"{name}: {load} at {f'{1e3 * point.displacement:.3g} mm' if curve.displacement_unit == 'm' else along}"
