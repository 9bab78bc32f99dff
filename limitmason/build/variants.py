"""Imperfect variants of an assembly: contact over part of a face, open joints, other sizes, displaced blocks.

Each returns a new assembly and leaves loads alone. The recipe is dropped wherever the geometry changes, so that closed
forms that read lengths from it refuse instead of using lengths that no longer hold.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import finite, not_negative, numbers
from limitmason.errors import InputError
from limitmason.geometry.contact import DoubtfulContact
from limitmason.geometry.polyhedron import Solid
from limitmason.geometry.rotation import rotation_matrices
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block
from limitmason.model.detection import doubts_between
from limitmason.model.input import read_direction, read_fixed, read_vector
from limitmason.model.interface import COS_45, ROUNDING, Interface

_GOLDEN = 0.6180339887498949  # golden ratio less one: the parts of its multiples spread most evenly over 0 to 1 [-]

_RUNS_ALONG = 0.9  # cosine of 25 degrees, chosen: how far an edge may turn from the head joint it ends at


def with_part_of_thickness(assembly: Assembly, share: float, direction: ArrayLike = (0.0, 1.0, 0.0)) -> Assembly:
    """This assembly with contact over the middle of the thickness only.

    Corners of a face move across the wall towards the middle between its outermost ones.

    Parameters
    ----------
    assembly : whose interfaces are narrowed
    share : width in contact over the full width [-], 0 < share <= 1
    direction : across the wall, shape (3,), of any length; faces whose normal is within 45 degrees of it, as between
        two leaves, keep their whole area

    Raises
    ------
    InputError
        For a share outside its range.
    """
    if not 0.0 < finite("share", share) <= 1.0:
        raise InputError(f"share of the thickness in contact must be above 0 and at most 1, got {share!r}")
    d = read_direction("direction", direction)
    changed = []
    for i in assembly.interfaces:
        in_plane = d - (d @ i.normal) * i.normal
        # the sine of the angle between normal and direction: the face has a width across the wall if it is large
        size = float(np.linalg.norm(in_plane))
        if size > COS_45:
            across = in_plane / size
            place = i.polygon @ across
            middle = 0.5 * (np.max(place) + np.min(place))
            shift = (share - 1.0) * (place - middle)
            i = replace(i, polygon=i.polygon + shift[:, None] * across)
        changed.append(i)
    return replace(assembly, interfaces=tuple(changed), recipe={})


def with_head_joints_gaping(assembly: Assembly, gap: float) -> Assembly:
    """This assembly with units that stop half a gap short of every head joint.

    Bed joints lose overlap by that. An edge of a bed or base joint that ends at a head joint is moved inwards by
    gap / 2; edges at the free end of a wall and along its faces stay. In running bond an overlap v between two head
    joints becomes v - gap. The faces in the head joints themselves stay in contact: wedged by mortar dust or chips;
    take them away with :func:`without_head_joints`.

    Parameters
    ----------
    assembly : whose bed and base joints are shortened
    gap : between the units at a head joint [m], >= 0

    Raises
    ------
    InputError
        When a bed joint is not longer than what it loses.
    """
    not_negative("gap", gap)
    # by orientation, not by kind: at the base too some joints stand and others lie
    heads = [i for i in assembly.interfaces if abs(i.normal[2]) < COS_45]
    # boxes of the head joints, wider by the gaps that two joints at an edge may have
    low = np.array([h.polygon.min(axis=0) for h in heads]).reshape(-1, 3) - 2.0 * assembly.tolerance
    high = np.array([h.polygon.max(axis=0) for h in heads]).reshape(-1, 3) + 2.0 * assembly.tolerance
    normals = np.array([h.normal for h in heads]).reshape(-1, 3)
    changed = []
    for i in assembly.interfaces:
        polygon = i.polygon
        if abs(i.normal[2]) >= COS_45 and len(heads):
            following = np.roll(polygon, -1, axis=0)
            middle = 0.5 * (polygon + following)
            along = following - polygon
            inward = np.cross(i.normal, along / np.linalg.norm(along, axis=1)[:, None])
            # an edge ends at a head joint that its middle touches and that it runs along: shape (edges, heads)
            ends_at = ((middle[:, None] >= low) & (middle[:, None] <= high)).all(axis=2)
            ends_at &= np.abs(inward @ normals.T) > _RUNS_ALONG
            for edge in np.flatnonzero(ends_at.any(axis=1)):
                polygon = _cut_edge(assembly, i, polygon, inward[edge], middle[edge], 0.5 * gap)
        changed.append(i if polygon is i.polygon else replace(i, polygon=polygon))
    return replace(assembly, interfaces=tuple(changed), recipe={})


def without_head_joints(assembly: Assembly, share: float = 1.0) -> Assembly:
    """This assembly without contact in a share of its head joints.

    Which joints go is fixed by their number (a golden-ratio sequence spreads them over the wall), and those open at a
    small share stay open at a larger one: the answer is the same every time and falls with the share.

    Parameters
    ----------
    assembly : whose joints of kind "head" are taken away
    share : of the head joints [-], 0 to 1

    Raises
    ------
    InputError
        For a share outside its range, and when a block then hangs on nothing.
    """
    if not 0.0 <= finite("share", share) <= 1.0:
        raise InputError(f"share of open head joints must be 0 to 1, got {share!r}")
    heads = [k for k, i in enumerate(assembly.interfaces) if i.kind == "head"]
    # place of every head joint in the order in which they open: sorted twice, numbers become their ranks
    rank = np.argsort(np.argsort((np.arange(1, len(heads) + 1) * _GOLDEN) % 1.0))
    removed = {k for k, r in zip(heads, rank.tolist(), strict=True) if r < round(share * len(heads))}
    kept = tuple(i for k, i in enumerate(assembly.interfaces) if k not in removed)
    out = replace(assembly, interfaces=kept, recipe={})
    out.check_connected()
    return out


def resized(assembly: Assembly, factors: ArrayLike) -> Assembly:
    """This assembly stretched along the axes about the origin.

    Densities stay, so weights follow the volumes.

    Parameters
    ----------
    assembly : with its blocks, joints and ties
    factors : along x, y and z [-], > 0, shape (3,)
    """
    f = read_vector("factors", factors)
    if not (f > 0).all():
        raise InputError(f"factors must be positive, got {tuple(f.tolist())}")
    blocks = tuple(
        replace(
            b, parts=tuple(Solid(p.vertices * f, p.faces) for p in b.parts), axis=None if b.axis is None else b.axis * f
        )
        for b in assembly.blocks
    )
    interfaces = []
    for i in assembly.interfaces:
        n = i.normal / f  # a normal goes with the inverse transpose
        interfaces.append(replace(i, polygon=i.polygon * f, normal=n / np.linalg.norm(n)))
    ties = tuple(replace(t, point_a=t.ends[0] * f, point_b=t.ends[1] * f) for t in assembly.ties)
    return replace(
        assembly, blocks=blocks, interfaces=tuple(interfaces), ties=ties, recipe={}, doubts=_doubts(assembly, blocks)
    )


def with_density_factor(assembly: Assembly, factor: float, blocks: Iterable[int | str] | None = None) -> Assembly:
    """This assembly with other densities of its blocks.

    Parameters
    ----------
    assembly : whose densities are multiplied
    factor : new over old density [-], >= 0
    blocks : names or numbers of the blocks that it holds for; None for all
    """
    not_negative("density factor", factor)
    named = range(assembly.n_blocks) if blocks is None else read_fixed(blocks, "blocks")
    chosen = {assembly.block_index(b) for b in named}
    recipe = dict(assembly.recipe)
    # a recipe has one density: it tells the truth only where all blocks are changed alike
    if blocks is None and "density" in recipe:
        recipe["density"] = recipe["density"] * factor
    elif blocks is not None:
        recipe = {}
    new = tuple(replace(b, density=b.density * factor) if k in chosen else b for k, b in enumerate(assembly.blocks))
    return replace(assembly, blocks=new, recipe=recipe)


def displaced(assembly: Assembly, displacements: Sequence[Array] | Array) -> Assembly:
    """This assembly with every block moved and turned by a finite rigid displacement.

    Joints and ties go along.

    An interface moves with its free block where the other is held, else by the mean motion of its two blocks, as a
    joint of springs between them does.

    Parameters
    ----------
    assembly : in its place before
    displacements : translation of the centroid [m] and rotation vector [rad] of every block, shape (n_blocks, 6)
    """
    u = numbers("displacements", displacements)
    if u.shape != (assembly.n_blocks, 6) or not np.isfinite(u).all():
        raise InputError(f"displacements must be finite and of shape ({assembly.n_blocks}, 6), got shape {u.shape}")
    turn, centre = rotation_matrices(u[:, 3:]), assembly.centroids

    def moved(points: Array, block: int) -> Array:
        """Points of a block [m], shape (..., 3), after its displacement."""
        return (points - centre[block]) @ turn[block].T + centre[block] + u[block, :3]

    blocks = tuple(
        replace(
            b,
            parts=tuple(Solid(moved(p.vertices, k), p.faces) for p in b.parts),
            axis=None if b.axis is None else turn[k] @ b.axis,
        )
        for k, b in enumerate(assembly.blocks)
    )
    fixed, interfaces = assembly.fixed, []
    for i in assembly.interfaces:
        # the free block, or both; block a where both are held
        sides = [k for k in (i.block_a, i.block_b) if not fixed[k]] or [i.block_a]
        mean_turn = rotation_matrices(u[sides, 3:].mean(axis=0))
        middle = i.polygon.mean(axis=0)
        new_middle = np.mean([moved(middle, k) for k in sides], axis=0)
        polygon = (i.polygon - middle) @ mean_turn.T + new_middle
        interfaces.append(replace(i, polygon=polygon, normal=mean_turn @ i.normal))
    ties = []
    for t in assembly.ties:
        a, b = t.ends
        b = b if t.block_b is None else moved(b, assembly.block_index(t.block_b))
        ties.append(replace(t, point_a=moved(a, assembly.block_index(t.block_a)), point_b=b))
    return replace(
        assembly, blocks=blocks, interfaces=tuple(interfaces), ties=tuple(ties), recipe={},
        doubts=_doubts(assembly, blocks),
    )


def _doubts(assembly: Assembly, blocks: Sequence[Block]) -> tuple[DoubtfulContact, ...]:
    """What nearly touches between blocks that have changed place or size, where something did before."""
    return doubts_between(blocks, assembly.contact_rules) if assembly.doubts else ()


def _cut_edge(
    assembly: Assembly, interface: Interface, polygon: Array, inward: Array, at: Array, depth: float
) -> Array:
    """The polygon without a strip along one of its edges [m], shape (m, 3).

    Parameters
    ----------
    assembly, interface : whose polygon it is, for the error where nothing is left
    polygon : convex [m], shape (n, 3)
    inward : unit vector across the edge into the polygon, shape (3,)
    at : a point of the edge [m], shape (3,)
    depth : of the strip [m]
    """
    # signed distance of every corner from the line where the strip ends, positive in what is left [m]
    distance = (polygon - at) @ inward - depth
    if distance.max() <= ROUNDING * np.ptp(polygon, axis=0).max():
        joint = assembly.joint_text(interface.block_a, interface.block_b)
        raise InputError(f"{joint} is not longer than the {depth:.3g} m it loses at a head joint")
    out = []
    # as ``part_within``, but multiplied before it is divided: last digits of answers hang on that
    for k in range(len(polygon)):
        j = (k + 1) % len(polygon)
        if distance[k] >= 0.0:
            out.append(polygon[k])
        # the side from k to j crosses the line
        if distance[k] * distance[j] < 0.0:
            out.append(polygon[k] + (polygon[j] - polygon[k]) * distance[k] / (distance[k] - distance[j]))
    return np.array(out)


