"""A structure on a page that fits it, in elevation or space, with joints and ties.

``model`` is the structure.
"""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from limitmason.arrays import Array, Flags
from limitmason.checks import choice
from limitmason.figures import elevation, style
from limitmason.figures.assembly_in_space import Layout, SolidView, block_size, draw_solids
from limitmason.figures.outline import elevation_plane, wall_plane
from limitmason.figures.painter import VIEWPOINT_DEG, camera, viewpoint
from limitmason.figures.tie_lines import draw_ties
from limitmason.mechanics.plane import Plane
from limitmason.mechanics.rigid_motion import MovingJoints, RigidMotion, structure_size
from limitmason.model import Assembly, Loads

VIEWS = ("auto", "elevation", "3d")

_ARROW = 0.2
"""Length of the arrow of a load over the size of the structure."""

_TO_VIEWER = 0.2
"""Part of a direction on the page below which it points at the viewer: its arrow could not be read there."""


class Canvas:
    """The page of a structure, large enough for all its positions.

    ``plane`` is that of an elevation, None in space; ``axes`` are the directions to the right and up on the page,
    shape (3, 2); ``size`` is that of a block [m], ``width`` that of outlines [pt]. ``page`` has the axes ``ax``.
    In elevation ``drawing`` holds the outlines of the blocks and ``window`` the limits of the page. In space ``camera``
    is from where they are seen, ``before`` are the blocks at rest, ``layout`` has the limits.

    Parameters
    ----------
    model : the structure
    view : "elevation", "3d", or "auto": elevation for a single leaf of prisms that moves in its plane
    ax : axes to draw on; a new page when not given
    twists : motion that the view is chosen for, shape (n, 6)
    motions : positions that the page must hold, None for the place at rest
    viewpoint_deg : azimuth and elevation of the viewer in space [deg]; by default at the corner towards which the
        blocks move, where they do
    """

    def __init__(
        self, model: Assembly, view: str, ax: Axes | None, *, twists: Array | None = None,
        motions: Sequence[RigidMotion | None] = (None,), viewpoint_deg: tuple[float, float] | None = None,
    ) -> None:
        """Choose plane or space, and a page on which all positions fit."""
        self.model, self.plane = model, chosen_plane(model, view, twists)
        if self.plane is not None:
            self.drawing = elevation.Elevation(model, self.plane)
            self.window = elevation.window_of([self.drawing.frame(m) for m in motions])
            self.page = style.Page(self.window.span, ax)
            self.axes, self.size = self.drawing.axes, self.drawing.block_size()
        else:
            if viewpoint_deg is None:
                viewpoint_deg = VIEWPOINT_DEG if twists is None else _corner_they_move_to(model, twists)
            self.camera = camera(*viewpoint(viewpoint_deg))
            self.before = SolidView(model, self.camera)
            self._motion = motions[0]
            self._scene = self._moved(self._motion)
            bounds = [_bounds(self._scene, self.before), *(_bounds(self._moved(m), self.before) for m in motions[1:])]
            ends = np.array([np.min([b[0] for b in bounds], axis=0), np.max([b[1] for b in bounds], axis=0)])
            self.layout = Layout(self._scene, ends, ax)
            self.page = style.Page(self.layout.high - self.layout.low, ax, framed=False)
            self.axes, self.size = np.column_stack([self.camera.right, self.camera.up]), block_size(model)
        self.ax, self.width = self.page.ax, style.outline_width(self.page.inch, self.size)
        self._told_apart = False

    def _moved(self, motion: RigidMotion | None) -> SolidView:
        """The blocks in space as ``motion`` has them, or at rest."""
        return self.before if motion is None else SolidView(self.model, self.camera, motion)

    def blocks(
        self, motion: RigidMotion | None = None, *, moving: Flags | None = None, ghosts: Flags | None = None,
        joints: MovingJoints | None = None, outline: str = style.OUTLINE,
    ) -> None:
        """Draw the blocks in a position.

        Parameters
        ----------
        motion : that has brought them there, None for the place at rest
        moving : blocks in the colour of stone, all by default; the others are pale
        ghosts : blocks whose place at rest is drawn as an outline
        joints : marked where they open or slide
        outline : colour of edges
        """
        none = np.zeros(self.model.n_blocks, dtype=bool)
        moving, ghosts = ~none if moving is None else moving, none if ghosts is None else ghosts
        free = ~self.model.fixed
        # whether blocks that move and others are drawn, which the legend then tells apart
        self._told_apart = bool((moving & free).any() and (~moving & free).any())
        if self.plane is None:
            scene = self._scene if motion is self._motion else self._moved(motion)
            draw_solids(
                self.ax, scene, self.width, moving=moving, joints=joints, before=self.before, ghosts=ghosts,
                outline=outline,
            )
            return
        elevation.draw_blocks(self.ax, self.drawing, self.width, motion=motion, moving=moving, outline=outline)
        elevation.draw_ghost(self.ax, self.drawing, ghosts, self.width)
        if joints is not None and motion is not None:
            elevation.draw_joints(self.ax, self.drawing, joints, motion, self.width)

    def ties(self, motion: RigidMotion | None = None, *, yields: Flags | None = None) -> list[Line2D]:
        """Draw the ties over the blocks and return entries for the legend.

        Parameters
        ----------
        motion : of the blocks, which carry the ends
        yields : ties that are drawn as yielding, shape (t,)
        """
        return draw_ties(self.ax, self.model, lambda p: p @ self.axes, self.width, motion=motion, yields=yields)

    def load(self, loads: Loads | None, label: str = "live load") -> list[Line2D]:
        """Draw the resultant of the live loads where it acts, and return its entry.

        The entry is for the legend, by ``label``, or none. A resultant that acts off the page has none.
        """
        found = resultant(self.model, loads)
        if found is None:
            return []
        place, direction = found
        tail, along = place @ self.axes, direction @ self.axes
        if np.linalg.norm(along) < _TO_VIEWER:
            return []
        along *= _ARROW * structure_size(self.model) / np.linalg.norm(along)
        halo = effects.withStroke(linewidth=3.6, foreground="white")
        arrow = {"arrowstyle": "-|>", "linewidth": 1.8, "color": style.BLACK, "shrinkA": 0.0, "shrinkB": 0.0,
                 "mutation_scale": 11.0, "path_effects": [halo]}
        low, high = self.window if self.plane is not None else (self.layout.low, self.layout.high)
        places = (tail, tail - along)  # with its tail where the load acts, or else its tip, as far as that is drawn
        shown = [p for p in places if (low <= p + along).all() and (p + along <= high).all()]
        if not shown:
            return []
        tail = shown[0]
        self.ax.annotate("", tuple(tail + along), tuple(tail), arrowprops=arrow, zorder=6.0, gid="load")
        return [Line2D([], [], color=style.BLACK, linewidth=1.8, marker=">", markevery=[1], label=label)]

    def frame(self) -> None:
        """Draw what does not move: limits, and metre axes or the triad that is the scale."""
        if self.plane is None:
            self.layout.draw(self.ax)
        else:
            elevation.set_frame(self.ax, self.drawing, self.window)

    def handles(
        self, joints: MovingJoints | None = None, *, ghost: bool = False, moves: bool = True
    ) -> list[Patch | Line2D]:
        """Legend entries for what is really in the drawing.

        ``moves`` tells whether blocks in the colour of stone are those that move.
        """
        fixed, hatch = bool(self.model.fixed.any()), self.plane is not None
        told = (("block moves", style.STONE), ("block stands still", style.STILL))
        apart = told if self._told_apart and moves else ()
        blocks = [Patch(facecolor=c, edgecolor=style.OUTLINE, linewidth=0.4, label=label) for label, c in apart]
        return [*blocks, *elevation.joint_handles(joints, fixed=fixed, ghost=ghost, hatch=hatch)]


def resultant(model: Assembly, loads: Loads | None) -> tuple[Array, Array] | None:
    """Point on the line of action of the live loads [m], and its unit direction.

    Only those on free blocks count; shape (3,) each. ``loads.live`` are forces [N] and moments [N m] about the
    centroids, shape (n, 6).

    None where the loads are not of these blocks, or where their forces cancel: a couple has no line of action.
    """
    if loads is None or len(loads.live) != model.n_blocks:
        return None
    live, free = loads.live, ~model.fixed
    force, centre = live[free, :3], model.centroids[free] + loads.points("live")[free]
    size = np.linalg.norm(force, axis=1)
    total = force.sum(axis=0)
    if not np.linalg.norm(total) > 1e-6 * size.sum():  # what is left of forces that cancel is rounding
        return None
    # the point of the line nearest to the centre of the forces; a moment about the line itself does not move it
    middle = size @ centre / size.sum()
    moment = (live[free, 3:] + np.cross(model.centroids[free] - middle, force)).sum(axis=0)
    return middle + np.cross(total, moment) / (total @ total), total / np.linalg.norm(total)


def chosen_plane(model: Assembly, view: str, twists: Array | None) -> Plane | None:
    """Plane of the elevation that a view asks for, or None for a drawing in space.

    Parameters
    ----------
    view : one of ``VIEWS``
    twists : of a mechanism, shape (n, 6), which "auto" draws in elevation only where it stays in the plane
    """
    choice("view", view, VIEWS)
    if view == "3d":
        return None
    plane = wall_plane(model, twists if view == "auto" else None)
    if plane is None and view == "elevation":  # no wall of one leaf: looked at along y
        return elevation_plane(np.array([0.0, 1.0, 0.0]))
    return plane


def _bounds(scene: SolidView, before: SolidView) -> Array:
    """Lowest and highest place on the page of free blocks, moved and at rest [m].

    Shape (2, 2).

    Fixed ones count up to half the drawing's size beyond the free ones: a wide ground must not shrink these.

    Parameters
    ----------
    scene, before : the blocks as they are drawn, and at rest
    """
    model = scene.assembly
    free, fixed = np.flatnonzero(~model.fixed), np.flatnonzero(model.fixed)
    if not len(free):
        return scene.page_bounds(fixed)
    both = np.concatenate([scene.page_bounds(free), before.page_bounds(free)])
    low, high = both_ends = np.array([both.min(axis=0), both.max(axis=0)])
    if not len(fixed):
        return both_ends
    return elevation.with_held(low, high, scene.page_bounds(fixed), share=0.5)


def _corner_they_move_to(model: Assembly, twists: Array) -> tuple[float, float]:
    """Azimuth and elevation [deg] of the corner towards which the blocks move.

    It is one of four; motions are weighted by volume. ``twists`` are those of the mechanism, shape (n, 6): velocities
    of the centroids come first.
    """
    weight = model.volumes * np.linalg.norm(twists[:, :3], axis=1)
    mean = (weight[:, None] * twists[:, :3]).sum(axis=0)
    # the usual viewpoint and its mirror images in the planes of x and y
    corners = [(azimuth, VIEWPOINT_DEG[1]) for azimuth in (-58.0, -122.0, 58.0, 122.0)]
    # rounded: of corners that are equally near the first is taken, whatever the last digit says
    return max(corners, key=lambda c: round(float(camera(*c).towards @ mean), 9))
