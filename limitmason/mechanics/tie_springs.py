"""Ties as springs between material points of two blocks: they pull, yield at their strength and hang loose after it.

T = k (L - L0 - p), not below zero and not above the strength; p is the plastic elongation, which grows by what the
spring would be stretched beyond its strength and never shrinks. A tie is unstressed in the reference pose and follows
its ends exactly at any rotation. Capacity curves and the DEM read this; limit analysis needs the strength alone.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array, Index
from limitmason.mechanics.default_stiffness import TIE_STRETCH, default_tie_stiffness
from limitmason.model.assembly import Assembly


class TieSprings(NamedTuple):
    """What t ties are in the reference pose."""

    block_a: Index  # numbers of the blocks that they join, (t,)
    block_b: Index
    arm_a: Array  # from the centroid of a block to the tie's end in it [m], (t, 3)
    arm_b: Array
    span: Array  # from the end in a to that in b [m], (t, 3)
    length: Array  # L0 [m], (t,)
    stiffness: Array  # k [N/m], (t,)
    strength: Array  # [N], (t,)


class Stretched(NamedTuple):
    """Ties between moved blocks."""

    elongation: Array  # L - L0 [m], (t,)
    length: Array  # L [m], (t,)
    span: Array  # from the end in a to that in b [m], (t, 3)
    swing_a: Array  # by how much the rotation of a has moved the tie's end in it [m], (t, 3)
    swing_b: Array


_PLACES = np.zeros((0, 3))
_NUMBERS = np.zeros(0, np.intp)
NO_TIES = TieSprings(_NUMBERS, _NUMBERS, _PLACES, _PLACES, _PLACES, *(np.zeros(0) for _ in range(3)))
"""Of a structure without ties."""


def tie_springs(assembly: Assembly) -> tuple[TieSprings, tuple[str, ...]]:
    """The ties of an assembly, and what a user should know about those without a stiffness, a sentence or nothing."""
    rows = slice(len(assembly.interfaces), None)
    x = assembly.links
    a, b = x.block_a[rows], x.block_b[rows]
    ends = np.array([t.ends for t in assembly.ties]).reshape(-1, 2, 3)
    span = ends[:, 1] - ends[:, 0]
    # among the links a tie is a joint of area one that faces the other way: its pull is what this joint bears in
    # compression, and its strength [N] stands there
    strength, stiffness = x.compressive_strength[rows].copy(), x.normal_stiffness[rows].copy()
    without = np.isnan(stiffness)
    said: tuple[str, ...] = ()
    if without.any():
        stiffness[without] = default_tie_stiffness(assembly, strength[without])
        said = (
            f"{int(without.sum())} of {len(without)} ties name no stiffness: they reach their strength when stretched "
            f"by {TIE_STRETCH:g} of a block; it is not a material property",
        )
    arms = ends[:, 0] - x.centroid[a], ends[:, 1] - x.centroid[b]
    return TieSprings(a, b, *arms, span, np.linalg.norm(span, axis=1), stiffness, strength), said


def stretched(ties: TieSprings, shift: Array, turn: Array) -> Stretched:
    """Elongation and place of ties where their blocks have moved.

    Parameters
    ----------
    ties : in the reference pose
    shift : of the centroids of all blocks [m], shape (n, 3)
    turn : R - I of their rotations, shape (n, 3, 3)
    """
    a, b = ties.block_a, ties.block_b
    swing_a = np.einsum("tij,tj->ti", turn[a], ties.arm_a)
    swing_b = np.einsum("tij,tj->ti", turn[b], ties.arm_b)
    change = shift[b] - shift[a] + swing_b - swing_a
    now = ties.span + change
    length = np.linalg.norm(now, axis=1)
    # L - L0 = (L^2 - L0^2) / (L + L0), of which L^2 - L0^2 = change . (span + now): no difference of near lengths
    elongation = (change * (ties.span + now)).sum(axis=1) / (length + ties.length)
    return Stretched(elongation, length, now, swing_a, swing_b)


def tension(ties: TieSprings, elongation: Array, plastic: Array) -> tuple[Array, Array, Array]:
    """Tension of ties, and what remains of it.

    Parameters
    ----------
    ties : t of them
    elongation : L - L0 [m], shape (t,)
    plastic : plastic elongation p before [m], shape (t,)

    Returns
    -------
    tension : T [N], shape (t,)
    after : plastic elongation after it [m], shape (t,)
    tangent : dT/dL [N/m], zero where a tie yields or hangs loose, shape (t,)
    """
    tried = ties.stiffness * (elongation - plastic)
    yields = tried > ties.strength
    after = np.where(yields, elongation - ties.strength / ties.stiffness, plastic)
    tangent = np.where(yields | (tried <= 0.0), 0.0, ties.stiffness)
    return np.clip(tried, 0.0, ties.strength), after, tangent
