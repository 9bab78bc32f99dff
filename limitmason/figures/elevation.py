"""Assemblies in elevation: outlines, hatched fixed blocks, joints, opened gaps.

``view`` is what is drawn, on the axes ``ax``; ``width`` is that of lines, in points; ``moving`` are flags of the
blocks, shape (n,), and ``motion`` moves them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path

from limitmason.arrays import Array, Flags, Index
from limitmason.figures import style
from limitmason.figures.outline import elevation_loops
from limitmason.mechanics.plane import Plane
from limitmason.mechanics.rigid_motion import MovingJoints, RigidMotion, free_or_all
from limitmason.model import Assembly


class Window(NamedTuple):
    """The visible part of an elevation: lower left and upper right corner [m]."""

    low: Array
    high: Array

    @property
    def span(self) -> Array:
        """Width and height [m]."""
        return self.high - self.low


def window_of(windows: Sequence[Window]) -> Window:
    """The smallest window that holds all ``windows``."""
    return Window(np.min([w.low for w in windows], axis=0), np.max([w.high for w in windows], axis=0))


def with_held(low: Array, high: Array, held: Array, share: float) -> Array:
    """Lowest and highest place of a drawing [m], (2, 2): what moves, and some ground.

    Of what is held only a margin about the moving part is shown: a wide ground seen whole would shrink the structure
    to a detail.

    Parameters
    ----------
    low, high : ends of what moves, on the page [m], shape (2,)
    held : ends of what is held [m], shape (2, 2)
    share : widest margin over the geometric mean of the sides of what moves [-]
    """
    reach = share * float(np.sqrt(np.prod(np.maximum(high - low, 1e-12))))
    return np.array([
        np.maximum(np.minimum(low, held[0]), low - reach), np.minimum(np.maximum(high, held[1]), high + reach)
    ])


_HELD_SHOWN = 0.25
"""Widest margin of the ground that is drawn over the size of the rest [-], chosen: it is seen as ground."""


class Elevation:
    """Outlines of blocks in one vertical plane, ready to be moved and drawn.

    ``axes`` are the directions to the right and up, shape (3, 2); ``loops`` are the closed outlines of every block in
    space [m], shape (k, 3) each; ``order`` has the numbers of the blocks from behind to the front.
    """

    def __init__(self, assembly: Assembly, plane: Plane) -> None:
        """Find the outlines of blocks of ``assembly`` along the normal of ``plane``."""
        self.assembly = assembly
        self.plane = plane
        self.axes = np.column_stack([plane.axis_1, plane.axis_2])
        self.loops = [elevation_loops(b, plane, assembly.tolerance) for b in assembly.blocks]
        # those behind are drawn first; depths within the tolerance are one, so that blocks keep their order
        depth = assembly.centroids @ plane.normal
        self.order = np.argsort(-np.round(depth / max(assembly.tolerance, 1e-12)), kind="stable")

    @property
    def axis_names(self) -> tuple[str, str]:
        """Labels of the axes to the right and up; a turned wall has no letter along it."""
        a = self.plane.axis_1
        for name, unit in (("x", 0), ("y", 1)):
            if abs(abs(a[unit]) - 1.0) < 1e-9:
                return (name if a[unit] > 0 else f"\N{MINUS SIGN}{name}", "z")
        return ("along the wall", "z")

    def paths(self, blocks: Index, motion: RigidMotion | None = None) -> list[Path]:
        """Outline of each of ``blocks``, by number, where ``motion`` has it or at rest.

        The loops of a block are one path.
        """
        out = []
        for i in blocks:
            vertices, codes = [], []
            for loop in self.loops[i]:
                points = (loop if motion is None else motion.moved(loop, int(i))) @ self.axes
                vertices.append(np.vstack([points, points[:1]]))
                codes += [Path.MOVETO] + [Path.LINETO] * (len(points) - 1) + [Path.CLOSEPOLY]
            out.append(Path(np.concatenate(vertices), codes))
        return out

    def frame(self, motion: RigidMotion | None = None) -> Window:
        """Window of free blocks before and after the motion, and fixed ones, as they move too, in a margin."""
        free = np.flatnonzero(~self.assembly.fixed)
        points = self._corners(free_or_all(self.assembly))
        if motion is not None and len(free):
            points = np.concatenate([points, self._corners(free, motion)])
        low, high = points.min(axis=0), points.max(axis=0)
        fixed = np.flatnonzero(self.assembly.fixed)
        if len(fixed) and len(free):
            # a support that gives way moves too
            held = np.concatenate([self._corners(fixed), *([] if motion is None else [self._corners(fixed, motion)])])
            low, high = with_held(low, high, np.array([held.min(axis=0), held.max(axis=0)]), _HELD_SHOWN)
        margin = 0.02 * float((high - low).max())  # lines at the edge show their whole width
        return Window(low - margin, high + margin)

    def _corners(self, blocks: Index, motion: RigidMotion | None = None) -> Array:
        """Places on the page of outlines of ``blocks``, moved or not [m], shape (k, 2)."""
        pairs = [(int(i), loop) for i in blocks for loop in self.loops[i]]
        rows = [(loop if motion is None else motion.moved(loop, i)) @ self.axes for i, loop in pairs]
        return np.concatenate(rows) if rows else np.zeros((0, 2))

    def block_size(self) -> float:
        """Median smaller side of the free blocks' outlines [m]."""
        sides = [np.ptp(np.concatenate(self.loops[i]) @ self.axes, axis=0).min() for i in free_or_all(self.assembly)]
        return float(np.median(sides))

    def segments(self, interfaces: Index, motion: RigidMotion) -> tuple[Array, Array]:
        """Ends of interfaces in plane, by block a and by block b [m], (k, 2, 2) each.

        An interface is a line here: its ends are its extreme corners along that line, of several those in front.

        Parameters
        ----------
        interfaces : their numbers, shape (k,)
        motion : of the blocks
        """
        x = self.assembly.arrays
        a, b = np.empty((len(interfaces), 2, 2)), np.empty((len(interfaces), 2, 2))
        for row, k in enumerate(interfaces):
            corners = x.corners[x.corner_start[k] : x.corner_start[k + 1]]
            along, depth = np.cross(self.plane.normal, x.normal[k]), corners @ self.plane.normal
            s = corners @ along
            # of one depth, that of the blocks' outlines: where blocks leave the plane the gap behind is another
            front = [np.where(np.abs(s - end) <= self.assembly.tolerance, depth, np.inf) for end in (s.min(), s.max())]
            ends = corners[[int(d.argmin()) for d in front]]
            for side, block in ((a, x.block_a[k]), (b, x.block_b[k])):
                side[row] = motion.moved(ends, int(block)) @ self.axes
        return a, b


def draw_blocks(
    ax: Axes, view: Elevation, width: float, *, motion: RigidMotion | None = None, moving: Flags | None = None,
    outline: str = style.OUTLINE,
) -> None:
    """Draw the blocks as three collections: moving, still, and fixed (hatched).

    Parameters
    ----------
    width : of outlines [pt]
    motion : of the moving and the fixed blocks; those that are still stay where they are
    moving : blocks that move, all free ones by default
    outline : colour of edges
    """
    fixed = view.assembly.fixed
    moves = ~fixed if moving is None else moving & ~fixed
    layers = (("still", ~fixed & ~moves, style.STILL), ("blocks", moves, style.STONE))
    for gid, flags, colour in layers:
        rows = view.order[flags[view.order]]
        if len(rows):
            paths = view.paths(rows, motion if gid == "blocks" else None)
            ax.add_collection(PathCollection(
                paths, facecolors=colour, edgecolors=outline, linewidths=width, gid=gid, zorder=2.0, joinstyle="round",
            ))
    rows = view.order[fixed[view.order]]
    if len(rows):
        paths = view.paths(rows, motion)
        held = PathCollection(
            paths, facecolors=style.FIXED, edgecolors=style.HATCH, linewidths=width, hatch="/////", gid="fixed",
            zorder=1.5,
        )
        _thin_hatch(held)
        ax.add_collection(held)
        # the hatch takes the edge colour, so the outline is drawn once more
        ax.add_collection(PathCollection(
            paths, facecolors="none", edgecolors=outline, linewidths=width, zorder=2.1, gid="fixed outline",
        ))


def _thin_hatch(artist: PathCollection | Patch) -> None:
    """Thin lines in the hatch of a patch, where matplotlib can."""
    if hasattr(artist, "set_hatch_linewidth"):  # matplotlib 3.10 and later
        artist.set_hatch_linewidth(0.4)


_DENSE = 150
"""Ghosts beyond which they would cover the drawing: they are then paler, not dashed, and lie under the blocks."""


def draw_ghost(ax: Axes, view: Elevation, moving: Flags, width: float) -> None:
    """Draw original outlines of ``moving`` blocks, dashed and over the displaced ones.

    Where they are many they are pale lines under the blocks. ``width`` is that of outlines [pt].
    """
    rows = np.flatnonzero(moving)
    if not len(rows):
        return
    dense = len(rows) > _DENSE
    ax.add_collection(PathCollection(
        view.paths(rows), facecolors="none", edgecolors=style.GHOST, linewidths=0.8 * width, gid="ghost",
        linestyles="solid" if dense else (0, (3.0, 2.0)), alpha=0.5 if dense else 0.9, zorder=1.0 if dense else 2.4,
    ))


def draw_joints(ax: Axes, view: Elevation, joints: MovingJoints, motion: RigidMotion, width: float) -> None:
    """Draw the gap of moving joints filled, and their faces as coloured lines.

    Parameters
    ----------
    joints : flags ``opens`` and ``slides`` of the interfaces, shape (k,), which choose the colour
    motion : of the blocks, which carry the two faces of a joint apart
    width : of outlines [pt]; faces are a little thicker
    """
    for flags, colour, gid in ((joints.opens, style.OPENING, "opening"), (joints.slides, style.SLIDING, "sliding")):
        rows = np.flatnonzero(flags)
        if not len(rows):
            continue
        a, b = view.segments(rows, motion)
        gaps = np.concatenate([a, b[:, ::-1]], axis=1)  # corners around: along block a and back along b
        ax.add_collection(PolyCollection(
            list(gaps), facecolors=style.pale(colour), edgecolors="none", linewidths=0.0, gid=gid, zorder=2.6
        ))
        faces, thick = np.concatenate([a, b]), 1.3 * width + 0.3
        ax.add_collection(LineCollection(list(faces), colors=colour, linewidths=thick, gid=f"{gid} faces", zorder=3.0))


def joint_handles(joints: MovingJoints | None, *, fixed: bool, ghost: bool, hatch: bool) -> list[Patch | Line2D]:
    """Legend entries for what is really in the drawing.

    Parameters
    ----------
    joints : those marked, None without marks
    fixed, ghost : whether fixed blocks, and outlines of the place at rest, are drawn
    hatch : whether fixed blocks are hatched, as in elevation alone
    """
    handles: list[Patch | Line2D] = []
    if joints is not None:
        moves = (joints.opens, style.OPENING, "joint opens"), (joints.slides, style.SLIDING, "joint slides")
        for colour, label in [(c, text) for flags, c, text in moves if flags.any()]:
            handles.append(Patch(facecolor=style.pale(colour), edgecolor=colour, linewidth=1.0, label=label))
    if ghost:
        handles.append(Line2D([], [], color=style.GHOST, linewidth=0.8, linestyle=(0, (3, 2)), label="before"))
    if fixed:
        patch = Patch(facecolor=style.FIXED, edgecolor=style.HATCH, hatch="/////" if hatch else None, linewidth=0.4,
                      label="fixed")
        _thin_hatch(patch)
        handles.append(patch)
    return handles


def set_frame(ax: Axes, view: Elevation, frame: Window) -> None:
    """Set the limits of ``frame`` and axes in metres."""
    ax.set_xlim(frame.low[0], frame.high[0])
    ax.set_ylim(frame.low[1], frame.high[1])
    style.metre_axes(ax, view.axis_names)


def label_blocks(ax: Axes, view: Elevation, scale: float) -> None:
    """Write names at the blocks' centroids, as large as fits up to 7 pt.

    ``scale`` is that of the drawing [pt/m].
    """
    for i, block in enumerate(view.assembly.blocks):
        x, y = view.assembly.centroids[i] @ view.axes
        wide, high = scale * np.ptp(np.concatenate(view.loops[i]) @ view.axes, axis=0)
        # 0.62 of its size is the mean width of a letter
        size = float(min(0.5 * high, wide / (0.62 * max(len(block.name), 1)), 7.0))
        ax.text(x, y, block.name, ha="center", va="center", fontsize=max(size, 1.0), color=style.FAINT, zorder=4,
                clip_on=True, parse_math=False)
