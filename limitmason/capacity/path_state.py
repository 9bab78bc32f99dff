"""A state of a path apart from the engine that found it: strengths, forces, tensions of ties, stored energy.

Forces are worked out anew from the reference geometry, the joint law and the state, by numpy alone: a solver that drops
a term of its own equations cannot hide it in the certificate.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity.contacts import PathContacts
from limitmason.capacity.deformable import CondensedShapes
from limitmason.mechanics.law import PointLaw
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads


class PathState(NamedTuple):
    """A state of the path: all that forces, energy and certificates are worked out from.

    Parameters
    ----------
    shift : displacement of the blocks' centroids [m], shape (n, 3)
    turn : R - I of their rotations, shape (n, 3, 3)
    shapes : coordinates of the shapes of blocks that deform [m], shape (n, k); k = 0 for rigid blocks
    slip : plastic slip of the points along their tangents [m], shape (m, c - 1)
    lift : their opening by dilation and crushing [m], shape (m,)
    multiplier : of the live load [-]
    damage : 0 at peak, 1 at residual strength [-], shape (m,); one 0 for joints that never soften
    stretched : plastic elongation of the ties [m], shape (t,)
    """

    shift: Array
    turn: Array
    shapes: Array
    slip: Array
    lift: Array
    multiplier: float
    damage: Array | float = 0.0
    stretched: Array = np.zeros(0)


class Structure(NamedTuple):
    """What the certificate reads: the model and its contact points with their law and stiffness per area.

    Parameters
    ----------
    assembly : blocks, joints and ties
    loads : dead and live loads
    points : contact points with law and stiffness per area
    weight : mean block weight [N]
    size : median block size [m]
    length : elastic length [m]: block weight over the mean normal stiffness of a point
    deformation : shapes of blocks that deform; None where all are rigid
    tie_stiffness : of the assembly's ties [N/m], shape (t,)
    """

    assembly: Assembly
    loads: Loads
    points: PathContacts
    weight: float
    size: float
    length: float
    deformation: CondensedShapes | None = None
    tie_stiffness: Array = np.zeros(0)


class StateForces(NamedTuple):
    """Forces and displacements of m contact points in a state.

    Parameters
    ----------
    components : of the force on block b along normal and tangents [N], compression positive, shape (m, c)
    apart : displacement of b against a along them [m], opening positive, shape (m, c)
    place : where b's points are now [m], shape (m, 3)
    """

    components: Array
    apart: Array
    place: Array

    def on_joints(self, points: PathContacts) -> tuple[Array, Array]:
        """Places [m] and forces on block b of the joint [N], in axes that turn with the points' a, (m, 3) each."""
        # a point may have the joint's b as its a
        force = points.sense[:, None] * np.einsum("mc,mci->mi", self.components, points.directions)
        return points.place_a + np.einsum("mc,mci->mi", self.apart, points.directions), force


def strength(s: Structure, at: PathState) -> PointLaw:
    """Strengths of the points at the damage of a state [Pa], shapes (m,)."""
    return s.points.law.towards(s.points.rest, np.asarray(at.damage))


def forces(s: Structure, at: PathState) -> StateForces:
    """Forces, displacements and places of the contact points in a state.

    N = max(kn (lift - w), -t) A and T = ks (slip - e) A, with (w, e) the displacement of b against a in the frame that
    turns with a.

    Parameters
    ----------
    s : the model with its contact points
    at : state of the path
    """
    p, x = s.points, s.assembly.centroids
    rotation = at.turn + np.eye(3)
    a, b = p.block_a, p.block_b
    moved_a = at.shift[a] + np.einsum("mij,mj->mi", at.turn[a], p.place_a - x[a])
    moved_b = at.shift[b] + np.einsum("mij,mj->mi", at.turn[b], p.place_b - x[b])
    if s.deformation is not None:
        bent_a = np.einsum("mik,mk->mi", s.deformation.shapes_a, at.shapes[a])
        bent_b = np.einsum("mik,mk->mi", s.deformation.shapes_b, at.shapes[b])
        moved_a = moved_a + np.einsum("mij,mj->mi", rotation[a], bent_a)
        moved_b = moved_b + np.einsum("mij,mj->mi", rotation[b], bent_b)
    # seen in the frame that turns with block a, which carries the normal
    in_a = np.einsum("mji,mj->mi", rotation[a], p.place_b - p.place_a + moved_b - moved_a)
    apart = np.einsum("mci,mi->mc", p.directions, in_a)
    normal = np.maximum(p.kn * (at.lift - apart[:, 0]), -strength(s, at).tension)
    shear = p.ks[:, None] * (at.slip - apart[:, 1:])
    return StateForces(np.column_stack([normal, shear]) * p.area[:, None], apart, p.place_b + moved_b)


def placed(s: Structure, at: PathState) -> Array:
    """R (1 + G) - I of every block, by which the points of its loads have moved, G its mean strain, shape (n, 3, 3)."""
    return at.turn if s.deformation is None else s.deformation.placed(at.turn, at.shapes)


def tensions(s: Structure, at: PathState) -> tuple[Array, Array, Array, Array]:
    """Tensions, present ends and directions of the ties in a state.

    Parameters
    ----------
    s : the model with its contact points
    at : state of the path

    Returns
    -------
    Tension [N], (t,), without a bound above; ends on blocks a and b [m], (t, 3); unit vectors from a to b, (t, 3).
    """
    x, ties = s.assembly.links, s.assembly.ties
    rows = slice(len(s.assembly.interfaces), None)  # links are the joints, then the ties
    ends = np.array([t.ends for t in ties]).reshape(-1, 2, 3)
    moved = [  # displacement of the ends on block a and on block b [m], (t, 3) each
        at.shift[block] + np.einsum("tij,tj->ti", at.turn[block], end - s.assembly.centroids[block])
        for block, end in ((x.block_a[rows], ends[:, 0]), (x.block_b[rows], ends[:, 1]))
    ]
    first, change = ends[:, 1] - ends[:, 0], moved[1] - moved[0]
    span = first + change
    length = np.linalg.norm(span, axis=1)
    # a difference of squares: that of two lengths would lose the digits that a stiff rod needs
    longer = (change * (first + span)).sum(axis=1) / (length + np.linalg.norm(first, axis=1))
    pulls = np.maximum(s.tie_stiffness * (longer - at.stretched), 0.0)
    along = span / np.maximum(length, 1e-300)[:, None]
    return pulls, ends[:, 0] + moved[0], ends[:, 1] + moved[1], along


def beyond_strength(s: Structure, at: PathState, apart: Array) -> Array:
    """Opening of the points beyond their strength in a state [m], shape (m,).

    ``apart`` as :func:`forces` gives it.
    """
    return np.asarray(np.maximum(apart[:, 0] - at.lift - strength(s, at).tension / s.points.kn, 0.0))


def stored(s: Structure, at: PathState, found: StateForces | None = None) -> float:
    """Elastic energy of joints, blocks and ties in a state [J].

    What opening against the tensile strength keeps is in it, as a closing joint gives it back. Blocks that deform add
    q' K q / 2, ties T^2 / (2 k). ``found`` are the :func:`forces` of the state, where they are known.

    Parameters
    ----------
    s : the model with its contact points
    at : state of the path
    """
    components, apart, _ = found or forces(s, at)
    stress = components / s.points.area[:, None]
    p = s.points
    # energy per area [J/m2]: of opening at the tensile strength, and of the springs
    held = strength(s, at).tension * beyond_strength(s, at, apart)
    density = 0.5 * stress[:, 0] ** 2 / p.kn + held + 0.5 * (stress[:, 1:] ** 2).sum(axis=1) / p.ks
    bent = 0.0 if s.deformation is None else 0.5 * float((s.deformation.stiffness * at.shapes**2).sum())
    pulled = 0.5 * float((tensions(s, at)[0] ** 2 / s.tie_stiffness).sum()) if s.assembly.ties else 0.0
    return float((density * p.area).sum()) + bent + pulled
