"""What proves a step, from poses and histories by numpy alone: nothing here knows how the path was found.

The forces are worked out anew from the reference geometry, the joint law and the state; a solver that drops a term of
its own equations cannot hide it here.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity.contacts import Contacts
from limitmason.capacity.deformable import Deformation
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

Array = NDArray[np.float64]


class State(NamedTuple):
    """A state of the path: shift [m], (n, 3); R - I, (n, 3, 3); coordinates of the blocks' shapes [m], (n, k), none of
    rigid blocks; slip [m], (m, c - 1); lift [m], (m,); multiplier; plastic elongation of the ties [m], (t,).
    """

    shift: Array
    turn: Array
    shapes: Array
    slip: Array
    lift: Array
    multiplier: float
    stretched: Array = np.zeros(0)


class StepCertificate(NamedTuple):
    """How well one state, reached from the one before, keeps the theory.

    ``equilibrium`` is the largest unbalanced force, or moment over a block's size, in mean block weights, forces on the
    shapes of blocks that deform and their elastic answer included; ``excess`` the largest excess over the joint law, or
    the strength of a tie, in block weights; ``flow`` the largest departure of the lift from tan(psi) times the slip,
    and ``against`` of the slip from the sense of the shear and of slip, or a tie's plastic elongation, below the limit,
    both over the largest slip or elastic displacement; ``dissipation`` the least over points and ties of the energy
    that slip and plastic elongation lose, over the gross work; ``energy`` what work by trapezoids, change of stored
    energy and loss leave over, over the gross work |dW_live| + |dW_dead| of the step. A ``jump`` passes through states
    that are not kept, so that its slip and lift are sums that the flow rule does not bind together.
    """

    equilibrium: float
    excess: float
    flow: float
    against: float
    dissipation: float
    energy: float
    jump: bool = False

    @property
    def accepted(self) -> bool:
        """Equilibrium to 1e-6 of a block weight, law and flow rule to rounding, no energy made by slip."""
        return (
            self.equilibrium < 1e-6
            and self.excess < 1e-6
            and (self.jump or (self.flow < 1e-6 and self.against < 1e-6 and self.dissipation > -1e-9))
        )


class Balance(NamedTuple):
    """Energy of a step [J]: work of live and dead load, change of stored energy, loss."""

    live: float
    dead: float
    stored: float
    lost: float


class Structure(NamedTuple):
    """What the certificate reads: the model and its contact points with their law and stiffness per area.

    ``weight`` [N], ``size`` [m] and ``length`` [m] are the mean block weight, the block size and the elastic length;
    ``deformation`` the shapes of blocks that deform, None where all are rigid; ``tie_stiffness`` of the assembly's ties
    [N/m], (t,).
    """

    assembly: Assembly
    loads: Loads
    points: Contacts
    weight: float
    size: float
    length: float
    deformation: Deformation | None = None
    tie_stiffness: Array = np.zeros(0)


def forces(s: Structure, at: State) -> tuple[Array, Array, Array]:
    """Force components on block b [N], (m, c); displacement [m], (m, c); present places of b's points [m], (m, 3)."""
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
    in_a = np.einsum("mji,mj->mi", rotation[a], p.place_b - p.place_a + moved_b - moved_a)
    apart = np.einsum("mci,mi->mc", p.directions, in_a)
    normal = np.maximum(p.kn * (at.lift - apart[:, 0]), -p.law.tension)
    shear = p.ks[:, None] * (at.slip - apart[:, 1:])
    return np.column_stack([normal, shear]) * p.area[:, None], apart, p.place_b + moved_b


def tensions(s: Structure, at: State) -> tuple[Array, Array, Array, Array]:
    """Tension of the ties [N], (t,), without a bound above; ends on a and b [m], unit vectors from a to b, (t, 3)."""
    x, ties = s.assembly.links, s.assembly.ties
    rows = slice(len(s.assembly.interfaces), None)
    ends = np.array([t.ends for t in ties]).reshape(-1, 2, 3)
    moved = [
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


def equilibrium(s: Structure, at: State) -> float:
    """Largest unbalanced force, or moment over a block's size, of a free motion or shape, in mean block weights."""
    p = s.points
    components, _, place = forces(s, at)
    local = np.einsum("mc,mci->mi", components, p.directions)
    force = np.einsum("mij,mj->mi", at.turn[p.block_a] + np.eye(3), local)
    total = s.loads.dead + at.multiplier * s.loads.live
    centroid = s.assembly.centroids + at.shift
    for block, sign in ((p.block_b, 1.0), (p.block_a, -1.0)):
        moment = np.cross(place - centroid[block], force)
        np.add.at(total, block, sign * np.concatenate([force, moment], axis=1))
    if s.assembly.ties:
        x, rows = s.assembly.links, slice(len(s.assembly.interfaces), None)
        pulls, end_a, end_b, along = tensions(s, at)
        for block, sign, end in ((x.block_a[rows], 1.0, end_a), (x.block_b[rows], -1.0, end_b)):
            force = sign * pulls[:, None] * along
            np.add.at(total, block, np.concatenate([force, np.cross(end - centroid[block], force)], axis=1))
    total = total / np.array([1.0, 1.0, 1.0, s.size, s.size, s.size]) / s.weight
    largest = float(np.abs(np.where(s.assembly.held, 0.0, total)).max(initial=0.0))
    if s.deformation is None:
        return largest
    d = s.deformation
    on_shapes = -d.stiffness * at.shapes
    for block, sign, shape in ((p.block_b, 1.0, d.shapes_b), (p.block_a, -1.0, d.shapes_a)):
        own = np.einsum("mji,mj->mi", at.turn[block] + np.eye(3), force)  # axes of the block
        np.add.at(on_shapes, block, sign * np.einsum("mi,mik->mk", own, shape))
    return max(largest, float(np.abs(on_shapes).max(initial=0.0)) / s.weight)


def stored(s: Structure, at: State) -> float:
    """Elastic energy, with what opening against the tensile strength keeps [J]; a closing joint gives it back.

    That of blocks that deform is in it, q' K q / 2, and that of ties, T^2 / (2 k).
    """
    components, apart, _ = forces(s, at)
    stress = components / s.points.area[:, None]
    p = s.points
    beyond = np.maximum(apart[:, 0] - at.lift - p.law.tension / p.kn, 0.0)
    density = 0.5 * stress[:, 0] ** 2 / p.kn + p.law.tension * beyond + 0.5 * (stress[:, 1:] ** 2).sum(axis=1) / p.ks
    bent = 0.0 if s.deformation is None else 0.5 * float((s.deformation.stiffness * at.shapes**2).sum())
    pulled = 0.5 * float((tensions(s, at)[0] ** 2 / s.tie_stiffness).sum()) if s.assembly.ties else 0.0
    return float((density * p.area).sum()) + bent + pulled


def certify(s: Structure, before: State, after: State) -> tuple[StepCertificate, Balance]:
    """Certificate and energy of the step from one state to the next."""
    old, new = forces(s, before)[0], forces(s, after)[0]
    area = s.points.area
    shear = np.linalg.norm(new[:, 1:], axis=1)
    law = s.points.law.over(area)
    excess = float(law.excess(new[:, 0], shear).max(initial=0.0)) / s.weight
    slip = after.slip - before.slip
    size = np.linalg.norm(slip, axis=1)
    lift = after.lift - before.lift
    elastic = s.length
    length = max(float(size.max(initial=0.0)), elastic)
    flow = float(np.abs(lift - law.tan_psi * size).max(initial=0.0)) / length
    # slip runs against the shear on b and only where the law is exhausted: its power is - T . slip = limit |slip|
    limit = np.maximum(law.shear_strength(new[:, 0]), 0.0)
    power = limit * size + (new[:, 1:] * slip).sum(axis=1)
    against = float(np.abs(power).max(initial=0.0)) / (s.weight * length)
    loss = -(new[:, 1:] * slip).sum(axis=1) - new[:, 0] * lift
    mean = 0.5 * (old + new)
    lost = float(-(mean[:, 1:] * slip).sum() - (mean[:, 0] * lift).sum())
    if s.assembly.ties:
        first, pulls = tensions(s, before)[0], tensions(s, after)[0]
        strength = np.array([t.strength for t in s.assembly.ties])
        more = after.stretched - before.stretched
        excess = max(excess, float((pulls - strength).max()) / s.weight)
        against = max(against, float((np.abs(more) * np.abs(strength - pulls)).max()) / (s.weight * length))
        loss = np.append(loss, pulls * more)
        lost += float((0.5 * (first + pulls) * more).sum())
    motion = np.concatenate([after.shift - before.shift, _spins(before.turn, after.turn)], axis=1)
    motion = np.where(s.assembly.held, 0.0, motion)
    live = 0.5 * (before.multiplier + after.multiplier) * float((s.loads.live * motion).sum())
    dead = float((s.loads.dead * motion).sum())
    change = stored(s, after) - stored(s, before)
    # a step that does no work to speak of (sliding without friction) is measured by the elastic work of a block
    gross = max(abs(live) + abs(dead), 1e-6 * s.weight * elastic)
    error = (live + dead - change - lost) / gross
    return (
        StepCertificate(equilibrium(s, after), excess, flow, against, float(loss.min(initial=0.0)) / gross, error),
        Balance(live, dead, change, lost),
    )


def _spins(before: Array, after: Array) -> Array:
    """Rotation vectors of small steps by the skew part, right to second order."""
    step = (after - before) @ np.swapaxes(before + np.eye(3), 1, 2)
    return 0.5 * np.stack(
        [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]], axis=1
    )
