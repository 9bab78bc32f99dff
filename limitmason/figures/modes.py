"""Mode shapes as pictures, and the matrix that compares those of two models."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from limitmason.arrays import Array
from limitmason.checks import instance, positive, several
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.continuum import solid_map
from limitmason.figures.deformation import deformed
from limitmason.geometry.rotation import quaternions
from limitmason.mechanics.rigid_motion import free_bounds, largest_rates
from limitmason.vibration import Mac, Modes
from limitmason.vibration.blocks import BlockCarrier
from limitmason.vibration.mac import ALIKE

_REACH = 0.06  # largest displacement drawn over the structure's size


def mode_shape(modes: Modes, number: int, *, reach: float = _REACH, title: str | None = None, **options: Any) -> Figure:
    """A mode shape of blocks or of a solid.

    Parameters
    ----------
    modes : from ``limitmason.modes``
    number : of the mode, from 1
    reach : largest displacement as drawn over the structure's largest extent [-]; fixed blocks do not count
    title : heading; number and frequency by default
    options : of ``figures.deformed`` (blocks) or ``figures.solid_map`` (solids), such as ``viewpoint_deg``; a
        ``caption`` stands behind the shares
    """
    shape = _drawn(modes, number, reach)
    title = title or f"Mode {number}: {modes.frequency[number - 1]:.2f} Hz"
    share = ", ".join(f"{a} {s:.0%}" for a, s in zip("xyz", modes.share[number - 1], strict=True))
    more = options.pop("caption", None)
    caption = f"participating mass {share}" + (f" · {more}" if more else "")
    carrier = modes.system.carrier
    if isinstance(carrier, BlockCarrier):
        # no joint is marked: how far it opens hangs on the reach
        options = {"crack": np.inf, "legend": False, "view": "3d", **options}
        moved = shape[:, :3], quaternions(shape[:, 3:6])
        figure: Figure = deformed(carrier.assembly, moved, title=title, caption=caption, **options)
    else:
        # a brick has the colour of its node that moves most
        size = np.linalg.norm(shape[carrier.model.mesh.connectivity], axis=2).max(axis=1)  # type: ignore[attr-defined]
        figure = solid_map(
            carrier.model, size / size.max(), displacement=shape, scale=1.0, label="displacement [-]",  # type: ignore[attr-defined]
            title=title, caption=caption, **options,
        )
    # the displacement of a mode has no size of its own: the caption that states one is left out
    ax, wide = options.get("ax"), float(figure.get_size_inches()[0])
    wide = wide - 0.24 if ax is None else wide * ax.get_position().width  # 0.24: margins of a page [in]
    written = [text for text in (figure if ax is None else ax).texts if text.get_gid() == "caption"]
    written[-1].set_text(style.wrapped(caption, wide))
    return figure


def _drawn(modes: Modes, number: int, reach: float) -> Array:
    """Motions in a mode as drawn: [m], and rotations of blocks [rad], (n, 3 or 6).

    Parameters
    ----------
    number : of the mode, from 1
    reach : largest displacement over the structure's largest extent [-]; of blocks that of their corners
    """
    instance("modes", modes, Modes, "of lm.modes")
    if not (isinstance(number, int | np.integer) and 1 <= number <= len(modes)):
        raise InputError(f"mode must lie between 1 and {len(modes)}, got {number!r}")
    positive("reach", reach)
    shape, carrier = modes.shape[number - 1], modes.system.carrier
    if isinstance(carrier, BlockCarrier):  # corners move where blocks turn about their own centroids too
        size = float(np.ptp(free_bounds(carrier.assembly), axis=0).max())
        largest = float(largest_rates(carrier.assembly, shape[:, :6]).max())
    else:
        size = float(np.ptp(modes.places, axis=0).max())
        largest = float(np.linalg.norm(shape[:, :3], axis=1).max())
    return np.asarray(shape * (reach * size / largest))


@style.in_print_style
def mac_matrix(
    mac: Mac, *, names: tuple[str, str] = ("first", "second"), title: str | None = None, caption: str | None = None
) -> Figure:
    """Matrix of the modal assurance criterion (MAC), the best of each row framed.

    Values below 0.5 are not framed.

    Parameters
    ----------
    mac : from ``limitmason.mac``
    names : of the two models, rows and columns
    title, caption : heading and the small text under it
    """
    if len(words := several("names", names, str)) != 2:
        raise InputError(f"names are two, of the models of the rows and of the columns, got {names!r}")
    k, l = instance("mac", mac, Mac, "of lm.mac").values.shape  # noqa: E741
    left, foot = 1.05, 0.62  # inches, as all lengths here: room for the names of rows and columns
    cell = min(0.52, (style.page_width() - left - 0.2) / l)  # chosen: two decimals fit in it
    wide = max(cell * l + left + 0.2, 3.0)  # a title and its caption have room
    heading = style.Heading(title, caption, wide)
    high = cell * k + foot + heading.depth
    figure = style.blank(wide, high)
    ax = figure.add_axes((left / wide, foot / high, cell * l / wide, cell * k / high))
    best = mac.values.argmax(axis=1)
    for i in range(k):
        for j in range(l):
            v = min(float(mac.values[i, j]), 1.0)  # above it is rounding
            ax.add_patch(Rectangle((j, i), 1, 1, facecolor=style.pale(style.BLUE, v), edgecolor="white", gid="cell"))
            # white where a cell is so dark that black is not read
            ax.text(j + 0.5, i + 0.5, f"{v:.2f}", ha="center", va="center", fontsize=7,
                    color="white" if v > 0.75 else style.BLACK, gid="value")
        if mac.values[i, best[i]] >= ALIKE:
            at = (best[i] + 0.03, i + 0.03)  # a frame inside the cell
            ax.add_patch(Rectangle(at, 0.94, 0.94, fill=False, edgecolor=style.BLACK, gid="best"))
    ax.set(xlim=(0, l), ylim=(k, 0))
    ax.set_xticks(np.arange(l) + 0.5, _ticks(mac.frequency_b), fontsize=6.5)
    ax.set_yticks(np.arange(k) + 0.5, _ticks(mac.frequency_a), fontsize=6.5)
    ax.set_xlabel(words[1], fontsize=7.5)
    ax.set_ylabel(words[0], fontsize=7.5)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    heading.put(figure)
    return figure


def _ticks(frequency: Array) -> list[str]:
    """Number from 1 and frequency [Hz] of every mode, without it where it is NaN."""
    return [f"{i + 1}" if np.isnan(f) else f"{i + 1}\n{f:.1f} Hz" for i, f in enumerate(frequency)]
