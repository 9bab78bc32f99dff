"""Contacts in large displacement: joints cut anew, new pairs, what is inherited.

Throughout, ``assembly`` has the blocks and their interfaces, and ``state`` is what a run changes.
"""

from typing import NamedTuple

import numpy as np

from dem.contact.joint_renewal import (
    PARTED,
    PIVOT_SLIP,
    PIVOT_TURN,
    SLIP_FRACTION,
    TURN_LIMIT,
    among,
    largest_slip,
    outworn_joints,
    pair_codes,
    slip_allowed,
    spacing_of,
    turned_since,
)
from dem.contact.near import ALWAYS, SMALL, Neighbours, placed
from dem.contact.new_joints import Fresh, assemble, cut
from dem.contact.piece_contacts import FLAT, Bearings, PiecesMeet, area_of, least_area, moved_together, on_next_faces
from dem.contact.state_transfer import Families, close_setbacks, inherit, keep_energy, keep_pace
from dem.kernels import APART, CROSSING, E_DAMPING, FACES, NearPairs
from dem.kernels.arrays import Index
from dem.model.edge_points import note_slid
from dem.model.pieces import Pieces
from dem.model.stable_step import points_of
from dem.model.state import DYNAMIC, State
from limitmason.arrays import Array, Flags
from limitmason.model import Assembly

STIFF_TURN = 1e-3
"""Turn since a joint was made up to which a block's stiffness is that of then, to some thousandths [rad].

With real masses it is :data:`PIVOT_TURN`, to a hundredth: the step is .65 of the stable one, and nothing else hangs
on it.
"""

SOONEST = 4
"""Fewest steps between two searches; chosen."""

ONE_PLANE = 0.5
"""Distance over the margin up to which two joints of a block lie on one face; chosen."""

AHEAD = 0.5
"""Part of the time to a touch after which it is looked again: what closes in is seen before it is through; chosen."""

SIDEWAYS = 0.1
"""Part of its largest speed at which a corner is taken to close in, though it runs alongside: it may turn; chosen."""


class Found(NamedTuple):
    """Notes for the user, and the time until an open edge or corner may touch [s]."""

    notes: list[str]
    soonest: float


def redetect(assembly: Assembly, state: State, pieces: Pieces, *, margin: float, sharp: bool = False) -> Found:
    """Cut outworn joints anew, drop open ones and add new pairs, where blocks moved.

    A joint between faces stays while it has slipped less than a quarter of its point spacing and, turned by more than 3
    degrees, while its nearest point is the nearest of the blocks: a rocking block keeps its points. The crossing of two
    edges follows them at any slip and turn and stays while it is where the pieces overlap least. What carries nothing
    at a corner, an edge or a crossing is looked for anew each time. New pairs take the law of a joint of one of their
    blocks without cohesion and tension: they were never bonded. What a new joint inherits, and with it how much energy,
    is told in :mod:`dem.contact.state_transfer`. Energy that contacts found anew no longer store is counted as
    artificial damping.

    A pair is looked at again when its blocks have moved or turned against each other by as much as it takes for a joint
    of theirs to be outworn, and at most by half the margin: up to there the contacts that it has are all there are.

    Parameters
    ----------
    assembly, state : blocks, and the state of a run, which is changed
    pieces : convex pieces of the blocks
    margin : gap up to which two blocks count as near [m]
    sharp : look at open edges and corners alone, whose time has come before that of a search of all pairs
    """
    around = Neighbours.of(assembly, state, pieces, margin, state.near)
    # pair codes of the blocks of pieces that are near, and of the joints
    first, second = around.near.blocks.T
    near_codes = pair_codes(first, second, assembly.n_blocks)
    joint_codes = pair_codes(state.joints.block_a, state.joints.block_b, assembly.n_blocks)
    joined = among(near_codes, np.sort(joint_codes))  # pairs whose blocks have a joint
    if state.near is None:
        _allow(assembly, state, pieces, around.near, margin, near_codes, joint_codes, joined)
    state.near = around.near
    _narrow(assembly, state)
    due = around.near.angle == ALWAYS if sharp else around.due()
    # pairs whose time has come, and joints whose blocks are no longer near
    gone = joint_codes[~among(joint_codes, np.sort(near_codes))]
    looked = np.union1d(near_codes[due & (joined | ~around.apart)], gone)
    if not len(looked):
        return Found([], np.inf)
    # first the joints of these pairs alone: most of them stay
    search = _Search(assembly, state, pieces, around, near_codes, looked, margin)
    active, soonest = search.active, search.soonest()
    near = state.near = around.looked_at(among(near_codes, looked), *search.allowances(near_codes, made=None))
    if not len(active):
        return Found([], soonest)
    # then, where joints are outworn or new, with all that lies beside them
    search = _Search(assembly, state, pieces, around._replace(near=near), near_codes, active, margin, beside=True)
    search.cut()
    made, families = search.make()
    state.near = search.around.looked_at(among(near_codes, search.looked), *search.allowances(near_codes, made))
    soonest = min(soonest, search.soonest())
    if search.stays.all() and made is None:
        return Found([], soonest)
    if made:
        keep_energy(search.state, search.now, np.where(search.stays, -1, search.group), made, families)
        keep_pace(state, assembly.centroids, made)
    # energy that the joints which go store, less what the new ones will
    stored = search.state.part(np.flatnonzero(~search.stays)).measured(assembly).elastic_energy
    stays = np.ones(len(state.contact), dtype=bool)
    stays[search.rows] = search.stays
    # blocks that have turned so far that their stiffness, by which masses are scaled, is to be made anew
    changed = np.zeros(assembly.n_blocks, dtype=bool)
    limit = PIVOT_TURN if state.mode == DYNAMIC else STIFF_TURN  # see STIFF_TURN
    joints = search.state.joints
    for ends in (joints.block_a, joints.block_b):
        changed[ends[search.stays & (search.turn > limit)]] = True
    notes = assemble(assembly, state, stays, made, changed)
    new = np.arange(int(stays.sum()), len(state.contact))
    state.total[E_DAMPING] += stored - state.part(new).measured(assembly).elastic_energy
    return Found(notes, soonest)


def _allow(
    assembly: Assembly, state: State, pieces: Pieces, near: NearPairs, margin: float, code: Index, own: Index,
    joined: Flags,
) -> None:
    """Write how far pairs may move from the reference before they are looked at.

    Pairs of faces or sharp corners that are near without a joint are looked at always. A joint may slip by a part of
    its point spacing and turn by ``TURN_LIMIT``.

    Parameters
    ----------
    near : pairs of pieces; ``move`` [m] and ``angle`` [rad] are written
    margin : gap up to which two blocks count as near [m]
    code : pair code of every row of ``near``, shape (m,)
    own : pair code of every joint, shape (k,)
    joined : rows whose blocks have a joint, shape (m,)
    """
    unturned = np.zeros((assembly.n_blocks, 3, 3))  # R - I of blocks in the reference position
    shape = PiecesMeet(placed(pieces, unturned, assembly.centroids)[0], pieces, near.pairs, margin).now
    sharp = (shape.kind > FACES) | (~joined & (shape.kind == FACES) & (area_of(shape) > least_area(assembly)))
    # of the joints of two blocks the one that may slip least decides
    known, row = np.unique(code, return_inverse=True)
    slip, use = np.full(len(known), np.inf), among(own, known)
    allowed = slip_allowed(spacing_of(state), np.diff(state.joints.start))
    np.minimum.at(slip, np.searchsorted(known, own[use]), allowed[use])
    near.move[:] = np.where(sharp | (near.move == ALWAYS), ALWAYS, np.minimum(near.move, slip[row]))
    near.angle[:] = np.where(near.move == ALWAYS, ALWAYS, np.where(joined, TURN_LIMIT, near.angle))


def _narrow(assembly: Assembly, state: State) -> None:
    """Move points set back under load that have opened towards where they had been."""
    if not state.setback.any():
        return
    # joints that have such a point
    rows = np.unique(np.searchsorted(state.joints.start, np.flatnonzero(state.setback), side="right") - 1)
    part, points = state.part(rows), points_of(state.joints, rows)
    close_setbacks(part, part.measured(assembly))
    state.points.gap[points], state.setback[points] = part.points.gap, part.setback


class _Search:
    """What is found on some pairs: their joints that go, and how their pieces meet.

    It sees the joints of these pairs alone, or of their blocks and of all that these touch, with numbers of its own.

    Attributes
    ----------
    assembly, pieces, margin, around : as given to it
    rows : numbers in the whole state of the joints that are seen, shape (k,)
    state : their part of the state
    now : what their points measure now
    rot, place : rotation matrix and centroid [m] of every block now, shapes (n, 3, 3) and (n, 3)
    code : pair code of every such joint, shape (k,)
    turn, slip : its turn since it was made [rad] and its largest slip [m], shape (k,)
    outworn : joints that are to be made anew, shape (k,)
    stays : joints of pairs without any, shape (k,)
    of_row : pair code of every near pair of pieces, shape (m,)
    looked : pair codes of the blocks that are looked at, ascending
    pairs, key : near pairs of pieces that are looked at, shape (p, 2), and the pair code of each, shape (p,)
    met : how they meet
    makes : of these, those that make a joint, shape (p,)
    hit : blocks of the joints that are seen, shape (n,)
    bearings : joints that carry; None where what lies beside is not looked at
    beside : the joint beside each that meets on the face that goes on, by row of ``pairs``
    family : families of pairs whose joints share their energy
    group : family of every joint, shape (k,)
    active : pair codes whose joints are to be made or made anew
    """

    def __init__(
        self, assembly: Assembly, state: State, pieces: Pieces, around: Neighbours, code: Index, looked: Index,
        margin: float, *, beside: bool = False,
    ) -> None:
        """Look at some pairs of blocks as they lie now, and find which joints are outworn.

        Parameters
        ----------
        assembly, state, pieces : blocks, the whole state, and the convex pieces of the blocks
        around : pieces that are near each other
        code : pair code of the blocks of each such row, shape (m,)
        looked : pair codes to look at, ascending
        margin : gap up to which blocks count as near [m]
        beside : take in the joints of neighbours too, as a cut may run on into them
        """
        n, one, two = assembly.n_blocks, state.joints.block_a, state.joints.block_b
        self.assembly, self.pieces, self.margin, self.around, self.of_row = assembly, pieces, margin, around, code
        rows, hit = among(pair_codes(one, two, n), looked), np.zeros(n, dtype=bool)
        hit[looked // n] = hit[looked % n] = True  # both blocks of every pair code
        # joints of these blocks, and of the blocks behind those joints
        for _ in range(2 if beside else 0):
            rows = hit[one] | hit[two]
            hit[one[rows]] = hit[two[rows]] = True
        self.rows, self.hit = np.flatnonzero(rows), hit
        part = self.state = state.part(self.rows)
        self.rot, self.place = state.bodies.rot + np.eye(3), assembly.centroids + state.bodies.shift
        now = self.now = part.measured(assembly)
        note_slid(part, now)
        self.code, self.turn = pair_codes(part.joints.block_a, part.joints.block_b, n), turned_since(part)
        self.slip = largest_slip(part, now)
        flat = (part.contact == FACES) & ~(self.turn > TURN_LIMIT)
        self.bearings = Bearings.of(part, now, self.rot, flat) if beside else None
        self._meet(looked)
        shape, at = self.met.now, np.flatnonzero(self.met.now.kind > 0)
        self.outworn = outworn_joints(
            assembly, part, now, self.code, self.key[at], shape.kind[at], shape.gap[at], margin, self.turn,
            self.slip, among(self.code, looked),
        )
        # whose edges end a joint was found out on the way: the whole state keeps it
        state.ends[points_of(state.joints, self.rows)] = part.ends
        self.stays = ~among(self.code, np.sort(self.code[self.outworn]))
        self.group, self.family = self.code, Families()
        # pairs that overlap little along another axis too may meet on a face that goes on, and new pairs have no joint
        asks = (shape.kind != APART) & (shape.beside > -margin)
        asks |= self.makes & ~among(self.key, np.sort(self.code))
        self.active = np.union1d(self.code[self.outworn], self.key[asks]) if not beside else looked

    def cut(self) -> None:
        """Mark further joints that must be made anew together with outworn ones.

        Some lie at an edge that is none, as the face goes on there in that of the next block. Others slipped on one
        face with an outworn one. ``outworn``, ``stays`` and families are changed; pairs that come to be cut anew are
        looked at too.
        """
        assert self.bearings is not None
        joints, shape, outworn = self.state.joints, self.met.now, self.outworn
        normal = np.einsum("kij,kj->ki", self.rot[joints.block_a], joints.frame[:, 2])
        # a pair that meets on the face of joint k, which goes on: its joints across that face were at an edge that is
        # none, and a pair without another joint takes over a part of k
        for row, k in self.beside.items():
            own = np.flatnonzero(self.code == self.key[row])
            across = np.abs(normal[own] @ shape.plane[row, :3]) < FLAT
            outworn[own[across]] = True
            if self.makes[row] and across.all():
                outworn[k] = True
                self.family.join(int(self.key[row]), int(self.code[k]))
        for k, other in moved_together(joints, self.bearings, outworn, self.slip, ONE_PLANE * self.margin):
            outworn[other] = True
            self.family.join(int(self.code[k]), int(self.code[other]))
        # all joints of a pair go together: a concave block may touch another in several places
        recut = np.unique(self.code[outworn])
        self.stays = ~among(self.code, recut)
        self.group = self.family.of_all(self.code)
        if not among(recut, self.looked).all():
            self._meet(np.union1d(self.looked, recut))

    def _meet(self, looked: Index) -> None:
        """Find how the pieces of some pairs of blocks meet, and which make a joint.

        Parameters
        ----------
        looked : pair codes of the blocks that are looked at
        """
        self.looked, around = looked, self.around
        near = np.flatnonzero(among(self.of_row, looked) & ~around.apart)
        self.key, self.pairs = self.of_row[near], around.near.pairs[near]
        self.met, n = PiecesMeet(around.corners, self.pieces, self.pairs, self.margin, self.hit), self.assembly.n_blocks
        seen = self.bearings
        self.beside = {} if seen is None else on_next_faces(self.met, self.state.joints, seen, n)
        shape = self.met.now
        self.makes = (shape.kind > FACES) | ((shape.kind == FACES) & (area_of(shape) > least_area(self.assembly)))

    def make(self) -> tuple[Fresh | None, Index]:
        """Make joints of the pairs that have none that stays, with what outworn ones held.

        Returns
        -------
        made : the joints, or None without any
        families : family of each, pairs between whose joints forces are shared out anew, shape (n,)
        """
        shape, owner = self.met.now, self.pieces.owner
        rows = np.flatnonzero(self.makes & ~among(self.key, np.sort(self.code[self.stays])))
        if not len(rows):
            return None, rows
        key = self.key[rows]
        # block a carries the face, the base of the meeting
        first, (p, q) = shape.base_first[rows], owner[self.pairs[rows]].T
        block_a, block_b = np.where(first, p, q), np.where(first, q, p)
        # the joint whose law each takes: one of its own pair, else the one beside it; -1 asks for that of an interface,
        # as edges that cross do
        on_faces = np.flatnonzero(self.state.contact != CROSSING)
        known, at = np.unique(self.code[on_faces], return_index=True)
        like = np.array([self.beside.get(row, -1) for row in rows.tolist()], dtype=np.int64)
        if len(known):
            own = among(key, known)
            like = np.where(own, on_faces[at][np.searchsorted(known, key) * own], like)
        like = np.where(shape.kind[rows] == CROSSING, -1, like)
        made, kept = cut(self.assembly, self.state, shape, rows, (block_a, block_b), like)
        if not len(kept):
            return None, kept
        key = key[kept]
        families = self.family.of_all(key)
        pair, family = (np.where(self.stays, -1, x) for x in (self.code, self.group))
        inherit(self.state, self.now, pair, family, made, key, families)
        return made, families

    def allowances(self, code: Index, made: Fresh | None) -> tuple[Array, Array]:
        """Motion [m] and turn [rad] up to which pairs need not be looked at again.

        A pair is looked at when a joint of it may be dropped or cut anew: when it slips or turns too far, parts by
        :data:`PARTED` times the margin, or comes to pivot. Until then nothing can happen that a search would find.

        Parameters
        ----------
        code : pair codes of the blocks that are asked for, shape (m,)
        made : joints that this search has made, None for none

        Returns
        -------
        move, angle : shape (m,), :data:`ALWAYS` for pairs that are looked at in every search
        """
        state, now = self.state, self.now
        first, stays = state.joints.start[:-1], self.stays & among(self.code, self.looked)
        move, angle = np.full(len(self.looked), SMALL * self.margin), np.full(len(self.looked), np.inf)
        # row of ``looked`` of every joint that stays
        at = np.searchsorted(self.looked, self.code[stays])
        if stays.any():
            spacing, nearest = spacing_of(state), np.minimum.reduceat(now.opening, first)
            size, turn = spacing * np.sqrt(np.diff(state.joints.start)), self.turn
            # what is left to each limit; the least of a pair's joints counts. A joint may pivot once it has both slid
            # and turned: waiting for the first of the two is enough
            to_slide, to_turn = PIVOT_SLIP * size - self.slip, PIVOT_TURN - turn
            may_move = np.minimum(SLIP_FRACTION * spacing - self.slip, PARTED * self.margin - nearest)
            may_move = np.where(to_slide > 0.0, np.minimum(may_move, to_slide), may_move)
            may_move[(state.contact > FACES) | (turn > TURN_LIMIT) | ((to_slide <= 0.0) & (to_turn <= 0.0))] = ALWAYS
            np.minimum.at(move, at, may_move[stays])
            may_turn = np.where((to_slide > 0.0) | (to_turn <= 0.0), np.maximum(TURN_LIMIT - turn, 0.0), to_turn)
            may_turn[state.contact > FACES] = ALWAYS
            np.minimum.at(angle, at, may_turn[stays])
        if made:
            joints, count = made.joints, np.diff(made.joints.start)
            # and the joints that have just been made
            k = np.searchsorted(self.looked, pair_codes(joints.block_a, joints.block_b, self.assembly.n_blocks))
            spacing = np.sqrt(np.add.reduceat(made.points.area, joints.start[:-1]) / count)
            corner = made.heirs.contact > FACES
            np.minimum.at(move, k, np.where(corner, ALWAYS, slip_allowed(spacing, count)))
            np.minimum.at(angle, k, np.where(corner, ALWAYS, TURN_LIMIT))
        # corners, edges and crossings are looked at again at every search
        sharp = np.searchsorted(self.looked, self.key[self.met.now.kind > FACES])
        move[sharp] = angle[sharp] = ALWAYS
        row = np.minimum(np.searchsorted(self.looked, code), len(self.looked) - 1)
        return move[row], angle[row]

    def soonest(self) -> float:
        """Time after which open edges and corners are looked at again [s].

        At its speed of now even the quickest of them does not touch before.
        """
        shape, b = self.met.now, self.state.bodies
        use = (shape.kind > FACES) & (shape.gap > 0.0)
        if self.bearings is None:
            use &= ~among(self.key, self.active)  # these are looked at again with what is beside them
        if not use.any():
            return np.inf
        one, other = self.pieces.owner[self.pairs[use]].T
        crosses = (shape.kind[use] == CROSSING)[:, None]
        at = np.where(crosses, shape.crossing[use, 2], shape.polygon[use, 0])
        along = np.where(crosses, shape.crossing[use, 4], shape.plane[use, :3])
        # speed of one block against the other at that place along the axis of the gap, and the fastest it could be
        vel = (b.vel[other] + np.cross(b.spin[other], at - self.place[other])) - b.vel[one]
        closing = np.abs(((vel - np.cross(b.spin[one], at - self.place[one])) * along).sum(axis=1))
        by_spin = np.linalg.norm(b.spin, axis=1) * self.pieces.reach
        fastest = np.linalg.norm(b.vel[one] - b.vel[other], axis=1) + by_spin[one] + by_spin[other]
        speed = np.maximum(closing, SIDEWAYS * fastest)
        return float((AHEAD * shape.gap[use] / np.maximum(speed, 1e-300)).min())
