"""Assemblies in space: parallel projection, shaded faces, exact hidden surfaces.

``ax`` are the axes that are drawn on and ``scene`` is what is drawn; ``width`` is that of lines, in points;
``segments`` are pairs of ends on the page [m], shape (2, 2) each.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgb
from matplotlib.path import Path
from matplotlib.transforms import Bbox

from limitmason.arrays import Array, Flags, Index
from limitmason.figures import style
from limitmason.figures.outline import Edge, visible_edges
from limitmason.figures.painter import Camera, back_to_front, piece_faces, places_behind
from limitmason.geometry import Solid
from limitmason.geometry.facing import all_faces, inner_faces
from limitmason.mechanics.rigid_motion import MovingJoints, RigidMotion, free_or_all
from limitmason.model import Assembly

_LIGHT = np.array([-0.28, 0.55, 0.79])
"""Direction of the light in page axes (right, up, towards the viewer)."""

_FACING = 1e-9
"""Cosine below which a face is seen edge on: rounding [-]."""

_MANY_GHOSTS = 600
"""Beyond so many pieces their dashed edges are one grey, and sorting them is not worth the time."""


class SolidView:
    """Convex pieces of an assembly, moved or not, with what is needed to paint them.

    ``pieces`` are those of all blocks where they are drawn, ``owner`` is the number of each one's block. ``edges`` are
    the visible edges of each at rest. ``faces`` are the planes of their faces where they are drawn: unit ``normal``,
    and ``offset`` [m] along it. ``hidden`` are the faces (piece, face) at which blocks were cut into pieces.
    """

    def __init__(self, assembly: Assembly, view: Camera, motion: RigidMotion | None = None) -> None:
        """Find edges and faces of the pieces of all blocks, moved as the motion has them.

        Parameters
        ----------
        assembly, view : the structure, and from where it is seen
        motion : of the blocks, None for the place at rest
        """
        self.assembly = assembly
        self.view = view
        self.motion = motion
        self.owner = np.repeat(np.arange(assembly.n_blocks), [len(b.parts) for b in assembly.blocks])
        self.edges = [e for b in assembly.blocks for e in visible_edges(b.parts, assembly.tolerance)]
        self.pieces = [
            Solid(self.moved(part.vertices, i), part.faces) for i, b in enumerate(assembly.blocks) for part in b.parts
        ]
        self.faces = piece_faces(self.pieces)
        self.hidden = _cuts(assembly, self.owner)

    def moved(self, points: Array, block: int) -> Array:
        """Places [m] of ``points`` at rest, shape (n, 3), as a block carries them."""
        return points if self.motion is None else self.motion.moved(points, int(block))

    def facing(self, piece: int) -> list[int]:
        """Numbers of a piece's faces that look at the viewer and are no cuts in a block."""
        n = len(self.pieces[piece].faces)
        towards = self.faces.normal[piece, :n] @ self.view.towards
        return [k for k in range(n) if towards[k] > _FACING and (piece, k) not in self.hidden]

    def page_bounds(self, blocks: Index) -> Array:
        """Lowest and highest page coordinates of some blocks [m], shape (2, 2)."""
        rows = np.flatnonzero(np.isin(self.owner, blocks)).tolist()
        points = np.concatenate([self.view.project(self.pieces[k].vertices) for k in rows])
        return np.array([points.min(axis=0), points.max(axis=0)])


class _Ink:
    """Paths with colours, widths [pt] and dashes, a row each, in the order of painting."""

    def __init__(self) -> None:
        """Begin without paths."""
        self.rows: list[tuple[Path, Any, Any, float, Any]] = []  # path, colours of face and edge, width, dashes

    def area(self, points: Array, colour: Any, width: float) -> None:
        """Add a filled polygon, ``points`` on the page, (n, 2), with a line of its own.

        ``width`` is that of the line [pt].
        """
        self.rows.append((Path(np.vstack([points, points[:1]]), closed=True), colour, colour, width, "-"))

    def strokes(self, segments: list[Array], colour: Any, width: float, *, dashed: bool = False) -> None:
        """Add lines of a colour between pairs of ends, ``segments``; ``width`` in points."""
        if segments:
            codes = [Path.MOVETO, Path.LINETO] * len(segments)
            dash = (0.0, (3.0, 2.0)) if dashed else "-"
            self.rows.append((Path(np.concatenate(segments), codes), "none", colour, width, dash))

    def collection(self, **options: Any) -> PathCollection:
        """All paths as one collection, in the order in which they were added."""
        paths, face, edge, width, dash = (list(column) for column in zip(*self.rows, strict=True))
        return PathCollection(
            paths, facecolors=face, edgecolors=edge, linewidths=width, linestyles=dash, capstyle="round",
            joinstyle="round", **options,
        )


def draw_solids(
    ax: Axes, scene: SolidView, width: float, *, moving: Flags, joints: MovingJoints | None, before: SolidView,
    ghosts: Flags, outline: str,
) -> None:
    """Draw all blocks from back to front, with moving joints where they show.

    Parameters
    ----------
    scene : the blocks as they are drawn
    width : of outlines [pt]
    moving : blocks in the colour of stone, shape (n,); the others are pale, fixed ones grey
    joints : to be marked, None for no marks
    before : the blocks at rest
    ghosts : blocks of which dashed edges at rest are drawn, shape (n,); edges that displaced blocks cover do not show
    outline : colour of edges
    """
    fixed = scene.assembly.fixed
    marks = _joint_marks(scene, joints)
    ghost_pieces = np.flatnonzero(ghosts[before.owner]).tolist()
    ink = _Ink()
    if len(ghost_pieces) > _MANY_GHOSTS:  # drawn first, under all blocks
        for piece in ghost_pieces:
            ink.strokes(_edge_strokes(before, piece), style.GHOST, 0.8 * width)
        ghost_pieces = []
    order = back_to_front(scene.pieces, scene.faces, scene.view)
    waiting: dict[int, list[int]] = {}  # ghosts by the place in the order before which they are painted
    outlines = [before.pieces[p] for p in ghost_pieces]
    places = places_behind(order, scene.pieces, outlines, scene.view) if outlines else []
    for ghost, place in zip(ghost_pieces, places, strict=True):
        waiting.setdefault(place, []).append(ghost)

    def draw_ghosts(place: int) -> None:
        """Dash the edges of ghosts that come before this place in the order."""
        for ghost in waiting.get(place, ()):
            ink.strokes(_edge_strokes(before, ghost), style.GHOST, 0.8 * width, dashed=True)

    for place, piece in enumerate(order):
        draw_ghosts(place)
        block = int(scene.owner[piece])
        colour = style.FIXED if fixed[block] else style.STONE if moving[block] else style.STILL
        solid = scene.pieces[piece]
        for k in scene.facing(piece):
            # its line of 0.25 pt closes the seam to the next face
            ink.area(scene.view.project(solid.vertices[list(solid.faces[k])]),
                     _shaded(colour, scene.faces.normal[piece, k], scene.view), width=0.25)
        ink.strokes(_edge_strokes(scene, piece), outline, width)
        for strokes, tint in marks.get(piece, ()):
            ink.strokes(strokes, tint, 1.6 * width + 0.5)
    draw_ghosts(len(order))  # those that nothing hides
    ax.add_collection(ink.collection(gid="blocks", zorder=2.0))


def _edge_strokes(scene: SolidView, piece: int) -> list[Array]:
    """Ends on the page [m] of a piece's edges at faces that the viewer sees, shape (2, 2) each.

    ``piece`` is its number.
    """
    block, visible = int(scene.owner[piece]), set(scene.facing(piece))
    edges: list[Edge] = [e for e in scene.edges[piece] if visible.intersection(e.faces)]
    if not edges:
        return []
    ends = scene.view.project(scene.moved(np.array([p for e in edges for p in (e.start, e.end)]), block))
    return list(ends.reshape(-1, 2, 2))


def _joint_marks(scene: SolidView, joints: MovingJoints | None) -> dict[int, list[tuple[list[Array], str]]]:
    """For every piece, by number, visible edges of its moving joints, with colour.

    Of a joint those edges of its outline are seen that lie on a visible face beside the contact.

    Parameters
    ----------
    joints : which open and which slide, flags ``opens`` and ``slides`` of shape (k,); None marks nothing

    Returns
    -------
    dict
        Ends on the page [m], shape (2, 2) for each edge, and their colour; one pair for each joint of a piece.
    """
    marks: dict[int, list[tuple[list[Array], str]]] = {}
    if joints is None:
        return marks
    of_block: dict[int, list[int]] = {}
    for piece, block in enumerate(scene.owner.tolist()):
        of_block.setdefault(block, []).append(piece)
    slack = 5.0 * scene.assembly.tolerance  # chosen: corners of a joint may lie off the faces by the tolerance
    for k in np.flatnonzero(joints.opens | joints.slides).tolist():
        interface = scene.assembly.interfaces[k]
        colour = style.OPENING if joints.opens[k] else style.SLIDING
        for block in (interface.block_a, interface.block_b):
            corners = scene.moved(interface.polygon, block)
            contact = scene.moved(interface.polygon[0] + interface.normal, block) - corners[0]  # normal, turned
            ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)  # of the edges, shape (n, 2, 3)
            for piece in of_block[block]:
                strokes: dict[int, Array] = {}
                for f in scene.facing(piece):  # an edge where two faces meet is drawn once
                    normal, offset = scene.faces.normal[piece, f], scene.faces.offset[piece, f]
                    if abs(normal @ contact) > 0.99:  # the face in contact itself, up to 8 degrees
                        continue
                    on = (np.abs(ends @ normal - offset) <= slack).all(axis=1)
                    strokes.update({int(e): scene.view.project(ends[e]) for e in np.flatnonzero(on)})
                if strokes:
                    marks.setdefault(piece, []).append((list(strokes.values()), colour))
    return marks


def _cuts(assembly: Assembly, owner: Index) -> set[tuple[int, int]]:
    """Faces (piece, face) that two pieces of a block share: cuts, not surfaces.

    Pieces are numbered through all blocks, ``owner`` being the block of each; faces within their piece.
    """
    faces, start = all_faces([part for block in assembly.blocks for part in block.parts])
    rows = np.flatnonzero(inner_faces(faces, owner, assembly.tolerance))
    return set(zip(faces.part[rows].tolist(), (rows - start[faces.part[rows]]).tolist(), strict=True))


def _shaded(colour: str, normal: Array, view: Camera) -> tuple[float, float, float]:
    """Red, green and blue of a colour on a face, lighter towards the light.

    ``normal`` is the unit normal of the face, ``view`` the camera.
    """
    # chosen: 0.72 of the colour in the shade, so that edges still show
    light = _LIGHT / np.linalg.norm(_LIGHT)
    lit = max(0.0, float(np.array([normal @ view.right, normal @ view.up, normal @ view.towards]) @ light))
    red, green, blue = (float(c) * (0.72 + 0.28 * lit) for c in to_rgb(colour))
    return red, green, blue


def draw_triad(ax: Axes, view: Camera, corner: Array, length: float) -> None:
    """Draw the axes x, y and z as arrows of one length: the scale of the drawing.

    Parameters
    ----------
    view : from where the structure is seen
    corner : where they start on the page [m], shape (2,)
    length : of each in space [m]
    """
    for name, direction in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0))):
        tip = corner + length * view.project(np.array([direction]))[0]
        arrow = {"arrowstyle": "-|>", "linewidth": 0.8, "color": style.FAINT, "shrinkA": 0.0, "shrinkB": 0.0}
        ax.annotate("", tuple(tip), tuple(corner), arrowprops={**arrow, "mutation_scale": 6.0})
        beyond = corner + 1.2 * (tip - corner)
        ax.text(beyond[0], beyond[1], name, fontsize=7.0, color=style.FAINT, ha="center", va="center")


def block_size(assembly: Assembly) -> float:
    """Median smallest side of the free blocks [m]."""
    return float(np.median([np.ptp(assembly.blocks[i].vertices, axis=0).min() for i in free_or_all(assembly)]))


class Layout:
    """Limits of the page, and where the axes stand: in a corner, or below it.

    ``low`` and ``high`` are the limits of the page, ``origin`` is where the axes start, ``label`` where their length
    is written [m]; ``length`` is that of the axes [m].

    Parameters
    ----------
    scene : what is drawn
    bounds : its lowest and highest place on the page [m], shape (2, 2)
    ax : axes of the caller, whose size is that of the page; None for a new page
    """

    def __init__(self, scene: SolidView, bounds: Array, ax: Axes | None) -> None:
        """Fit the drawing on its page, and find a free corner and a length for the axes."""
        self.view = scene.view
        span = np.ptp(bounds, axis=0)
        room = np.array([style.page_width() - 0.24, style.HEIGHT])  # [in], without the margins of a bare page
        if ax is not None:
            room = style.figure_of(ax).get_size_inches() * ax.get_position().size
        inch = float((room / span).min())  # scale [in/m]: below, inches on paper over it are metres
        self.length = style.round_length(0.16 * float(span.max()))  # chosen: about a sixth of the drawing
        # box of the arrows about their origin; with the letters they are a quarter longer
        ends = 1.25 * self.length * scene.view.project(np.eye(3))
        low, high = np.minimum(ends.min(axis=0), 0.0), np.maximum(ends.max(axis=0), 0.0)
        gap = 0.07 / inch
        # the label, 0.9 by 0.16 inches, stands below the arrows
        size = np.array([max(high[0] - low[0], 0.9 / inch), high[1] - low[1] + 0.16 / inch])
        corners = [bounds[0] + gap, np.array([bounds[1, 0] - size[0] - gap, bounds[0, 1] + gap])]
        # left or right in the lower corners of the drawing, else below it
        free = [c for c in corners if not _covered(scene, c - gap, c + size + gap)]
        corner = free[0] if free else bounds[0] + np.array([gap, -size[1] - gap])
        self.label = corner
        self.origin = corner + np.array([-low[0], 0.16 / inch - low[1]])
        margin = 0.03 / inch
        self.low = np.minimum(bounds[0], corner) - margin
        self.high = bounds[1] + margin

    def draw(self, ax: Axes) -> None:
        """Draw the axes with their length; equal scales and no frame."""
        draw_triad(ax, self.view, self.origin, self.length)
        x, y = self.label
        ax.text(x, y, f"axes {self.length:g} m", fontsize=7.0, color=style.FAINT, va="bottom", gid="scale")
        ax.set_xlim(self.low[0], self.high[0])
        ax.set_ylim(self.low[1], self.high[1])
        ax.set_aspect("equal", adjustable="box")
        ax.set_axis_off()


def _covered(scene: SolidView, low: Array, high: Array) -> bool:
    """Whether the drawing covers a part of a box on the page, ``low`` to ``high`` [m]."""
    box = Bbox(np.array([low, high]))
    return any(
        Path(scene.view.project(solid.vertices[list(solid.faces[k])])).intersects_bbox(box, filled=True)
        for piece, solid in enumerate(scene.pieces)
        for k in scene.facing(piece)
    )
