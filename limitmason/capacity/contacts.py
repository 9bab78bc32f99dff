"""Contact points of a path: which material points meet, who carries the frame, and what law, area and stiffness go
with them.

A point is a corner of one block on a face of another: the block whose corner it is carries the point, the other the
frame, whichever of them the interface calls a. So carried, a point that slides stays under the corner, and its normal
stays that of the face. Points inside a face, and corners that meet, could belong to either block: the firmer carries
their frame, see :func:`firmness`. Nothing depends on how blocks are numbered.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Flags, Index
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import (
    LOBATTO,
    LOBATTO_POINTS,
    ContactPoints,
    Grid,
    chosen_grid,
    contact_points,
    on_few_points,
    weakening,
)
from limitmason.mechanics.law import PointLaw, Softening
from limitmason.mechanics.plane import Plane
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.storage.frozen import ReadOnly

NEW = -1
"""Interface of a point between two blocks that had no joint."""

NO_CORNER = -1
"""Corner or face of a point that is none."""

_MANY = 40_000
"""Points of a structure that are taken at most: beyond, fewer are put on the sides. Chosen."""

_FEWEST = 5
"""Points on a side, however many joints there are: loads are then up to 24 % too high, as the warning says."""

_GLUED = (7, 7)
"""Points along and across joints in space that bear cohesion or tension: chosen."""

_SAME = 1e-9
"""Part of the largest of some lengths or forces that rounding may change [-]."""


def points_of_path(
    assembly: Assembly, plane: Plane | None, contact_model: str | None = None,
    grid: Grid | float | Mapping[str, Grid] | None = None, initial: Prediction | None = None,
) -> tuple[ContactPoints, tuple[str, ...]]:
    """The contact points that are asked for, else those that the joints need, see :func:`limitmason.pushover`.

    Parameters
    ----------
    plane : in which blocks move; None in space
    contact_model, grid, initial : as of :func:`limitmason.pushover`

    Returns
    -------
    points, and warnings where they are fewer than the joints need

    Raises
    ------
    InputError
        Where no joint touches a free block.
    """
    warnings: tuple[str, ...] = ()
    if contact_model is None and grid is not None:
        contact_model = "grid"
    elif contact_model is None and initial is not None:
        contact_model = initial.contact_model or "vertices"
    elif contact_model is None:
        contact_model, grid, warnings = standard_points(assembly, plane)
    chosen: Grid | float | Mapping[str, Grid] = chosen_grid(contact_model, grid)
    points = contact_points(assembly, contact_model=contact_model, grid=chosen, plane=plane, elastic=True)
    if not points.count:
        raise InputError("no joint touches a free block: there is nothing that could carry a load")
    if not warnings:
        warnings = on_few_points(assembly, "leave contact_model and grid out for what the joints need", points)
    return points, warnings


def standard_points(assembly: Assembly, plane: Plane | None) -> tuple[str, Grid | None, tuple[str, ...]]:
    """Contact model and grid that the joints' law needs, and a warning where there are too many joints for it.

    "lobatto" where joints crush or lose strength, and in space, with 7 x 7 points, where they have cohesion or tensile
    strength, since at the corners cohesion resists twisting 1.85 times as much as on a square face; else "vertices".

    Parameters
    ----------
    plane : in which blocks move; None in space
    """
    x = assembly.arrays
    weak = weakening(assembly)
    if not weak.any():
        glued = plane is None and bool((np.maximum(x.cohesion, x.tensile_strength) > 0.0).any())
        return (LOBATTO, _GLUED, ()) if glued else ("vertices", None, ())
    joints = int((~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])).sum())
    # as many points on a side as there is room for, n per joint in plane, n^2 in space
    most = _MANY // max(joints, 1)
    n = max(_FEWEST, min(LOBATTO_POINTS, most if plane is not None else int(most**0.5)))
    if n == LOBATTO_POINTS:
        return LOBATTO, (n, n), ()
    return LOBATTO, (n, n), (
        f"joints crush or break at {n} points on a side, not {LOBATTO_POINTS}, for want of room on {joints} joint(s): "
        f"loads may be too high, at worst by 24 % with 5 points, 11 % with 7 and 4 % with 11; "
        f"give contact_model='lobatto', grid=({LOBATTO_POINTS}, {LOBATTO_POINTS}) for all",
    )


@dataclass(frozen=True, eq=False)
class PathContacts(ReadOnly):
    """What m contact points of c force components are, in the reference pose.

    Parameters
    ----------
    block_a, block_b : numbers of the block that carries the frame and of the one that carries the point; the force acts
        on b, and on a the opposite, shape (m,)
    place_a, place_b : material points that meet, where the reference pose has them [m], shape (m, 3)
    directions : normal from a to b and tangents in the reference axes of a, shape (m, c, 3)
    area : tributary area [m2], shape (m,)
    interface : number of the interface, or ``NEW``, shape (m,)
    sense : 1.0 where b is the interface's block b too, -1.0 where it is its a, shape (m,)
    law, rest : strengths at peak and residual [Pa]
    kn, ks : [Pa/m], shape (m,)
    corner, face : numbers of what meets, see :mod:`limitmason.capacity.contact_search.faces`; ``NO_CORNER`` for points
        that are neither, shape (m,)
    by_opening, by_slip : damage per opening beyond the strength and per slip, see :class:`Softening` [1/m], shape (m,)
    """

    block_a: Index
    block_b: Index
    place_a: Array
    place_b: Array
    directions: Array
    area: Array
    interface: Index
    sense: Array
    law: PointLaw
    kn: Array
    ks: Array
    corner: Index
    face: Index
    rest: PointLaw
    by_opening: Array
    by_slip: Array

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.area)

    @property
    def components(self) -> int:
        """Force components of a point, 2 or 3."""
        return self.directions.shape[1]

    @property
    def softens(self) -> bool:
        """Whether any point can lose strength."""
        return bool(self.by_opening.any() or self.by_slip.any())

    @property
    def softening(self) -> Softening | None:
        """How the points soften, or None where none does."""
        return Softening(self.rest, self.by_opening, self.by_slip) if self.softens else None

    def at(self, rows: Index | Flags) -> "PathContacts":
        """Some of the points, by number or by flag."""
        chosen: dict[str, Any] = {}
        for f in fields(self):
            column = getattr(self, f.name)
            chosen[f.name] = column.at(rows) if isinstance(column, PointLaw) else column[rows]
        return PathContacts(**chosen)

    def with_rows(self, other: "PathContacts") -> "PathContacts":
        """These points, with the ``other`` ones behind them, which have as many force components."""
        joined: dict[str, Any] = {}
        for f in fields(self):
            mine, theirs = getattr(self, f.name), getattr(other, f.name)
            if isinstance(mine, PointLaw):
                joined[f.name] = PointLaw(*(np.concatenate(pair) for pair in zip(mine, theirs, strict=True)))
            else:
                joined[f.name] = np.concatenate([mine, theirs])
        return PathContacts(**joined)

    def ordered(self) -> Index:
        """Numbers of the points, those of a pair of blocks one after another, (m,)."""
        low, high = np.minimum(self.block_a, self.block_b), np.maximum(self.block_a, self.block_b)
        return np.lexsort((high, low))


def first_contacts(
    points: ContactPoints, law: PointLaw, kn: Array, ks: Array, misfit: Array | None = None,
    softening: Softening | None = None,
) -> PathContacts:
    """The contact points of the reference pose, the frame carried by the points' block a.

    Parameters
    ----------
    points : of the reference pose
    law : of every interface [Pa], shape (k,)
    kn, ks : normal and shear stiffness of every interface [Pa/m], shape (k,)
    misfit : displacement of b against a in the reference pose, opening and along the tangents [m], shape (m, c); none
        by default
    softening : how every interface softens; None where none does
    """
    if softening is None:
        softening = Softening(law, np.zeros(len(kn)), np.zeros(len(kn)))
    place_a = points.position
    if misfit is not None:
        # a's place lies off b's by what the joint has to close
        place_a = place_a - np.einsum("mc,mci->mi", misfit, points.directions)
    rows = points.interface
    none = np.full(points.count, NO_CORNER, np.intp)
    residual, by_opening, by_slip = softening.at(rows)
    return PathContacts(
        block_a=points.block_a, block_b=points.block_b, place_a=place_a, place_b=points.position.copy(),
        directions=points.directions, area=points.area, interface=rows, sense=np.ones(points.count), law=law.at(rows),
        kn=kn[rows], ks=ks[rows], corner=none, face=none.copy(), rest=residual, by_opening=by_opening, by_slip=by_slip,
    )


def turned_over(c: PathContacts, rows: Flags) -> PathContacts:
    """The points, some of them with blocks a and b exchanged.

    Block a carries the frame of a point. Force components keep their sign, as direction and blocks change together.

    Parameters
    ----------
    c : m contact points
    rows : which are turned over, shape (m,)
    """
    a, b = np.where(rows, c.block_b, c.block_a), np.where(rows, c.block_a, c.block_b)
    place_a = np.where(rows[:, None], c.place_b, c.place_a)
    place_b = np.where(rows[:, None], c.place_a, c.place_b)
    sign = np.where(rows, -1.0, 1.0)
    return replace(
        c, block_a=a, block_b=b, place_a=place_a, place_b=place_b, directions=sign[:, None, None] * c.directions,
        sense=sign * c.sense,
    )


def firmness(assembly: Assembly, loads: Loads) -> Index:
    """Rank of every block by which of two carries a frame, equal where nothing tells them apart, shape (n,).

    A held block comes before one that moves, then the heavier one, the one farther along the dead load, the one farther
    along the live load, and the one nearer to the middle of the structure. Turned, mirrored and renumbered structures
    have the same ranks.

    Parameters
    ----------
    loads : whose sums give the directions
    """
    x = assembly.centroids
    middle = x.mean(axis=0)
    # from the least to the most important: the last key decides first
    keys = [-np.linalg.norm(x - middle, axis=1)]
    keys += [(x - middle) @ _unit(w[:, :3].sum(axis=0), w) for w in (loads.live, loads.dead)]
    keys += [assembly.weights, assembly.fixed.astype(float)]
    ranks = np.array([_rank(k) for k in keys])
    return np.unique(ranks[::-1], axis=1, return_inverse=True)[1].reshape(-1)


def _unit(total: Array, parts: Array) -> Array:
    """Direction of a sum of vectors, or zero where it is the rounding of its parts, shape (3,).

    Parameters
    ----------
    total : the sum, shape (3,)
    parts : what was summed, whose sizes tell the rounding
    """
    size = float(np.linalg.norm(total))
    return total / size if size > _SAME * float(np.abs(parts).sum()) else np.zeros(3)


def _rank(value: Array) -> Index:
    """Rank of every value, from 0, equal for values that differ by rounding only, shape (n,)."""
    order = np.argsort(value)
    apart = np.diff(value[order], prepend=value[order[:1]]) > _SAME * float(np.abs(value).max(initial=0.0))
    out = np.empty(len(value), np.intp)
    out[order] = np.cumsum(apart)
    return out


def carried_firmly(points: ContactPoints, firm: Index) -> ContactPoints:
    """The points with their frame on the firmer of both blocks, which becomes block a.

    Force components keep their sign.

    Parameters
    ----------
    points : with the frame on either block
    firm : rank of every block by :func:`firmness`, shape (n,)
    """
    swapped = firm[points.block_b] > firm[points.block_a]
    a, b = np.where(swapped, points.block_b, points.block_a), np.where(swapped, points.block_a, points.block_b)
    sign = np.where(swapped, -1.0, 1.0)[:, None, None]
    return replace(points, block_a=a, block_b=b, directions=sign * points.directions)
