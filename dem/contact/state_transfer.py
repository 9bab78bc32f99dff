"""What joints made while blocks move inherit, and the energy that there was."""

import numpy as np

from dem import kernels
from dem.contact.joint_renewal import among
from dem.contact.new_joints import Fresh
from dem.kernels import CROSSING, FACES, LAW, Testators
from dem.model.stable_step import owners, points_of
from dem.model.state import PointForces, State
from dem.model.strain_shapes import relative_deformation
from limitmason.arrays import Array, Index

SLIDES = 0.99
"""Part of the largest shear by Coulomb's law from which a new point is taken to slide [-]; chosen."""


class Families:
    """Pairs of blocks whose joints on one face are cut anew and share their energy.

    Pairs go by their pair codes.

    A family is named by the code of one of its pairs. Whatever was joined to nothing is a family of its own.
    """

    def __init__(self) -> None:
        self._first: dict[int, int] = {}  # from a pair to the one it was joined to

    def of(self, pair: int) -> int:
        """Family of a pair."""
        while pair in self._first:
            pair = self._first[pair]
        return pair

    def of_all(self, pairs: Index) -> Index:
        """Family of every pair, shape (n,)."""
        out = pairs.copy()
        for k in np.flatnonzero(among(pairs, np.array(sorted(self._first), dtype=np.int64))).tolist():
            out[k] = self.of(int(pairs[k]))
        return out

    def join(self, one: int, other: int) -> None:
        """Make the families of two pairs one, by the pair codes."""
        one, other = self.of(one), self.of(other)
        if one != other:
            self._first[one] = other


def inherit(
    state: State, now: PointForces, pair: Index, family: Index, made: Fresh, pairs: Index, families: Index
) -> None:
    """Write shear, dilation and damage of the nearest old point to every new one.

    Shear is the elastic shear displacement. A new joint between faces looks among the old joints of its family, any
    other among those of its pair of blocks.

    Parameters
    ----------
    state, now : state with the old joints, and what their points measure
    pair, family : codes of the pair of blocks and of the family of every old joint, -1 of those that stay, shape (k,)
    made : new joints, changed
    pairs, families : those codes of the new ones, shape (n,)
    """
    faces = made.heirs.contact == FACES
    # ``order``: old joints sorted by pair, then once more by family; those of each new joint are a run in one of both,
    # from ``low`` on in all that is sorted
    order: list[Index] = []
    low, count = np.zeros((2, len(pairs)), dtype=np.int64)
    for old_codes, new_codes, mine in ((pair, pairs, ~faces), (family, families, faces)):
        rows = np.argsort(old_codes, kind="stable")
        first, end = (np.searchsorted(old_codes[rows], new_codes, side=side) for side in ("left", "right"))
        low[mine], count[mine] = (first + len(old_codes) * len(order))[mine], (end - first)[mine]
        order.append(rows)
    # numbers of every new joint and the old ones that it may inherit from, new joint after new joint
    start = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    new = np.repeat(np.arange(len(pairs)), count)
    old = np.concatenate(order)[np.arange(start[-1]) - start[new] + low[new]]
    kernels.inherit(
        state.points, state.joints, Testators(state.contact, now.position, now.force), start, old,
        (pair[old] == pairs[new]).astype(np.int64), made.points, made.joints, made.heirs,
    )
    _deform(state, made)


def _deform(state: State, made: Fresh) -> None:
    """Write how the faces of new joints are displaced by the blocks' deformation now.

    The joint law sees this displacement in every step. Plastic slips grow by it, so that shear forces stay, and
    openings are those of the deformed faces. ``state`` has the shapes of the blocks; ``made``, the joints, is changed.
    """
    if state.modes is None or state.deformation is None:
        return
    change = relative_deformation(state.deformation, state.modes, made.joints, made.points)
    change[made.heirs.contact[owners(made.joints)] == CROSSING] = 0.0
    made.points.slip_1[:] += change[:, 0]
    made.points.slip_2[:] += change[:, 1]
    made.heirs.aside[:] = change[:, :2]
    made.heirs.apart[:] += change[:, 2]


def keep_energy(state: State, now: PointForces, family: Index, made: Fresh, families: Index) -> None:
    """Let the new joints of a family store the elastic energy of the old ones.

    1. The energies of pressure and of shear in the old points are summed up by family.
    2. Gaps of new points are changed until these store the same under pressure.
    3. Their elastic slips are changed by one factor until these store the same in shear.

    Cut anew under load, the points lie elsewhere; a pair first seen when it overlaps has none to give. Where the new
    ones would store more, gaps widen: only points that are pressed are set back, and :func:`close_setbacks` takes it
    back as they open. Where they would store less, gaps of pressed points narrow in proportion to their depth. Shear
    grows or falls in proportion, up to what Coulomb's law lets every point bear: a force on next to no area slides.
    What damage has taken of the strength is not borne.

    Energy is lost where keeping it would press harder. On an area A an even force N stores N^2 / (2 kn A), so that with
    the same force a joint of which dA is gone holds dA / A more: who keeps the energy has a force sqrt(1 - dA / A) of
    what it was, and on points that are pressed less evenly than before, one that is larger. It may be so by
    :data:`dem.kernels.point_transfer.HARDER`: at twice the force a block that slides from one stone to the next is
    shaken at every edge that it passes.

    Parameters
    ----------
    state, now : state with the old joints, and what their points measure
    family : codes of the families of old joints, -1 for those that stay, shape (k,)
    made : new joints, whose gaps and slips of points and setbacks of heirs are changed
    families : codes of their families, shape (n,)
    """
    # families are counted from 0, and ``old`` are the points of the joints that they replace
    known, number = np.unique(families, return_inverse=True)
    points, old = state.points, points_of(state.joints, np.flatnonzero(np.isin(family, known)))
    law, area = state.joints.law[now.owner[old]], points.area[old]
    kn, ks = law[:, LAW.kn], law[:, LAW.ks]
    # elastic closing [m], of no more than that at which a point crushes, as what was measured of it
    closing = np.minimum(np.maximum(-now.opening[old], 0.0), law[:, LAW.crushing])
    # normal force of points that are pressed, and of bonded ones that are pulled: force . R_a n
    push = kn * area * closing
    joint, force = now.owner[old], now.force[old]
    turn = state.bodies.rot[state.joints.block_a[joint]] + np.eye(3)
    pull = np.einsum("pi,pij,pj->p", force, turn, state.joints.frame[joint, 2]) * (now.opening[old] > 0.0)
    # square of the shear force: what is left of the whole
    shear = np.maximum((force**2).sum(axis=1) - push**2 - pull**2, 0.0)
    family_of = np.searchsorted(known, family[now.owner[old]])  # of every old point
    # energy of pressure, energy of shear T^2 / (2 ks A), and normal force of each family
    of_points = (0.5 * kn * area * closing**2, 0.5 * shear / (ks * area), push)
    sums = [np.bincount(family_of, x, len(known)) for x in of_points]
    rows = np.argsort(number, kind="stable")
    start = np.searchsorted(number[rows], np.arange(len(known) + 1)).astype(np.int64)
    kernels.keep_energy(made.points, made.joints, made.heirs, start, rows, *sums)


def keep_pace(state: State, centroids: Array, made: Fresh) -> None:
    """Let new joints that slide have the plastic slip of one step ago.

    All joints have it between two steps. Else the displacement of the last step would be no slip but a motion of the
    springs. Friction would give work back, and dashpots would take it.

    Parameters
    ----------
    state : of the blocks
    centroids : of the blocks in the reference position [m], shape (n, 3)
    made : new joints, which have their energy; slips are changed
    """
    joints, points, heirs, bodies = made.joints, made.points, made.heirs, state.bodies
    j = owners(joints)
    # displacement of b against a in the last step at every point [m], global axes, then along t1 and t2
    moved = np.zeros((len(j), 3))
    for block, sign in ((joints.block_a[j], -1.0), (joints.block_b[j], 1.0)):
        arm = heirs.position - centroids[block] - bodies.shift[block]
        moved += sign * state.dt * (bodies.vel[block] + np.cross(bodies.spin[block], arm))
    moved = np.einsum("pci,pi->pc", heirs.world[j, :2], moved)
    slip = np.column_stack([points.slip_1, points.slip_2])
    borne = slip - heirs.aside  # elastic slip
    most = kernels.largest_elastic_slip(points, joints, heirs)
    # open points have no spring to move; pressed ones without friction do, and bear nothing to tell by
    springs = (most > 0.0) | (points.lift - points.gap - heirs.apart > 0.0)
    # points at their strength that the last step brought there
    slides = (np.linalg.norm(borne, axis=1) >= SLIDES * most) & (np.linalg.norm(borne - moved, axis=1) > most)
    slip -= (springs & slides)[:, None] * moved
    points.slip_1[:], points.slip_2[:] = slip.T


def close_setbacks(state: State, now: PointForces) -> None:
    """Move points that opened back from where :func:`keep_energy` set them.

    Only points without force are moved, as far as they are open, so that no energy changes.

    Parameters
    ----------
    state : gaps and setbacks are changed
    now : what its points measure; openings are changed
    """
    if not state.setback.any():
        return
    free = ~now.force.any(axis=1)
    less = np.where(free, np.minimum(state.setback, np.maximum(now.opening, 0.0)), 0.0)
    state.points.gap[:] -= less
    state.setback -= less
    now.opening[:] -= less
