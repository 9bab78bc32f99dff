"""What proves a step, from poses and histories by numpy alone: nothing here knows how the path was found.

Forces are those of :mod:`limitmason.capacity.path_state`, worked out anew from the reference geometry and the state.
"""

from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity.path_state import (
    PathState,
    StateForces,
    Structure,
    beyond_strength,
    forces,
    placed,
    stored,
    strength,
    tensions,
)
from limitmason.geometry.rotation import axial, vector_product
from limitmason.mechanics.law import SUDDEN

WITHIN = 1e-4
"""Opening or slip beyond the strength at which a brittle point must break, over the elastic one at the strength [-]."""

SHORTEST = 0.1
"""Least elastic opening or slip that this is taken of, over the elastic length of the structure [-]."""

AT_THE_TIP = 1e-9
"""Part of the cohesion that rounding leaves as shear strength of a point at the tip of the cone [-]."""

_KEPT = 1e-6
"""Unbalance and excess in block weights, and departures of flow rule and damage, up to which a state is accepted."""

_MADE = 1e-9
"""Energy that slip may make by rounding, over the gross work of the step [-]."""

_CREATED = 1e-2
"""Energy that a jump may seem to make, of its gross work [-]: its path, and so its work, is not known."""

_IDLE = 1e-6
"""Least gross work of a step, in block weights times elastic lengths: sliding without friction does none."""


class StepCertificate(NamedTuple):
    """How well one state, reached from the one before, keeps the theory.

    Gross work is |dW_live| + |dW_dead| of the step, or the change of stored energy where self-stress that slips away is
    more.

    Parameters
    ----------
    equilibrium : largest unbalanced force, or moment over a block's size, in mean block weights [-]; forces on the
        shapes of blocks that deform and their elastic answer included
    excess : largest excess over the joint law, or the strength of a tie, in mean block weights [-]
    flow : largest departure of the lift from tan(psi) times the slip, over the largest slip or the elastic length [-]
    against : largest power by which slip departs from the sense of the shear, or runs below the limit, and a tie's
        plastic elongation below its strength, over block weight times that length [-]
    dissipation : the least over points and ties of the energy that slip and plastic elongation lose, at most 0, over
        gross work [-]; negative where one makes energy
    energy : what work by trapezoids, change of stored energy and loss leave over, over the gross work [-]
    jump : whether it passes through states that are not kept, so that its slip and lift are sums that the flow rule
        does not bind together
    damage : largest departure of the damage from what opening and slip ask for, and how far brittle points that have
        not broken lie beyond their strength by more than ``WITHIN`` [-]; in a jump, by how much damage fell
    """

    equilibrium: float
    excess: float
    flow: float
    against: float
    dissipation: float
    energy: float
    jump: bool = False
    damage: float = 0.0

    @property
    def accepted(self) -> bool:
        """Whether equilibrium, law, damage and flow rule hold, and no energy is made.

        Departures must be below ``_KEPT``. In an ordinary step no point may make energy by its slip. ``energy`` is not
        judged there: it is the error of the trapezoids, which falls with the length of the step. Of a jump flow rule,
        sense and loss of slip are not asked. As its path is not known it may seem to make energy, up to ``_CREATED``.
        """
        return (
            self.equilibrium < _KEPT
            and self.excess < _KEPT
            and self.damage < _KEPT
            and (
                self.energy > -_CREATED
                if self.jump
                else self.flow < _KEPT and self.against < _KEPT and self.dissipation > -_MADE
            )
        )


class Balance(NamedTuple):
    """Energy of a step: live + dead = stored + lost + broken + jumped, but for what a certificate tells.

    Parameters
    ----------
    live, dead : work of the live and of the dead load [J]
    stored : change of the elastic energy [J]
    lost : loss by slip, crushing and yielding of ties [J]
    broken : loss by damage of joints [J]
    jumped : what a jump takes, to motion and to the joints that break [J]; it then has no other loss
    """

    live: float
    dead: float
    stored: float
    lost: float
    broken: float = 0.0
    jumped: float = 0.0


def equilibrium(s: Structure, at: PathState, found: StateForces | None = None) -> float:
    """Largest unbalanced force, or moment over a block's size, of a free motion or shape, in mean block weights.

    ``found`` are the :func:`forces` of the state, where they are known.

    Parameters
    ----------
    s : the model with its contact points
    at : state of the path
    """
    p = s.points
    components, _, place = found or forces(s, at)
    local = np.einsum("mc,mci->mi", components, p.directions)  # reference axes of block a
    force = np.einsum("mij,mj->mi", at.turn[p.block_a] + np.eye(3), local)  # global axes
    carried = placed(s, at)
    total = s.loads.wrench_at("dead", carried) + at.multiplier * s.loads.wrench_at("live", carried)
    centroid = s.assembly.centroids + at.shift
    for block, sign in ((p.block_b, 1.0), (p.block_a, -1.0)):
        moment = vector_product(place - centroid[block], force)
        np.add.at(total, block, sign * np.concatenate([force, moment], axis=1))
    if s.assembly.ties:
        x, rows = s.assembly.links, slice(len(s.assembly.interfaces), None)  # links are the joints, then the ties
        pulls, end_a, end_b, along = tensions(s, at)
        for block, sign, end in ((x.block_a[rows], 1.0, end_a), (x.block_b[rows], -1.0, end_b)):
            pull = sign * pulls[:, None] * along
            np.add.at(total, block, np.concatenate([pull, vector_product(end - centroid[block], pull)], axis=1))
    total = total / np.array([1.0, 1.0, 1.0, s.size, s.size, s.size]) / s.weight
    largest = float(np.abs(np.where(s.assembly.held, 0.0, total)).max(initial=0.0))
    if s.deformation is None:
        return largest
    d = s.deformation
    on_shapes = -d.stiffness * at.shapes
    arms = s.loads.dead_arms + at.multiplier * s.loads.live_arms
    on_shapes += np.einsum("nij,nkjl,nli->nk", at.turn + np.eye(3), d.gradients, arms)  # sum of f . R G_k r
    for block, sign, shape in ((p.block_b, 1.0, d.shapes_b), (p.block_a, -1.0, d.shapes_a)):
        own = np.einsum("mji,mj->mi", at.turn[block] + np.eye(3), force)  # axes of the block
        np.add.at(on_shapes, block, sign * np.einsum("mi,mik->mk", own, shape))
    return max(largest, float(np.abs(on_shapes).max(initial=0.0)) / s.weight)


def damage_error(s: Structure, before: PathState, after: PathState, old: StateForces, new: StateForces) -> float:
    """Departure of the damage after a step from what the law asks for [-], see :class:`StepCertificate`.

    The law asks for max(h_before, rate_opening x) + rate_slip p, at most 1: x the opening beyond the strength at the
    end, p the slip of the step that met a shear strength. Over a sudden loss it limits x and p instead.

    Parameters
    ----------
    s : the model with its contact points
    before, after : states at the ends of the step
    old, new : the :func:`forces` of both states
    """
    p = s.points
    if not p.softens:
        return 0.0
    (old_force, old_apart, _), (new_force, new_apart, _) = old, new
    grown = np.asarray(after.damage) - before.damage
    now = strength(s, after)
    beyond = beyond_strength(s, after, new_apart)
    # beyond the tip of the cone there is no shear strength that slip could break: it counts up to where that is passed
    normal = new_force[:, 0] / p.area
    at_tip = np.abs(now.shear_strength(normal)) <= AT_THE_TIP * now.cohesion
    all_counts = now.bears_shear(normal) | at_tip
    # shear strengths at the start and, without a limit of the pull, at the end: where they fall to nothing the tip is
    # passed, at this share of the step, and without shear slip and shear displacement are one
    unlimited = p.kn * (after.lift - new_apart[:, 0])
    first, last = (now.shear_strength(n) for n in (old_force[:, 0] / p.area, unlimited))
    share = np.maximum(first, 0.0) / np.where(all_counts, 1.0, np.maximum(first, 0.0) - last)
    slip_at_tip = old_apart[:, 1:] + share[:, None] * (new_apart - old_apart)[:, 1:]
    slid = np.linalg.norm(np.where(all_counts[:, None], after.slip, slip_at_tip) - before.slip, axis=1)
    sudden_opening, sudden_slip = p.by_opening >= SUDDEN, p.by_slip >= SUDDEN
    rate_opening, rate_slip = np.where(sudden_opening, 0.0, p.by_opening), np.where(sudden_slip, 0.0, p.by_slip)
    least = np.minimum(np.maximum(before.damage, rate_opening * beyond), 1.0)
    asked = np.minimum(least + rate_slip * slid, 1.0)
    # where damage has brought the tip to the tension, a part of the slip has done it: the rest met no strength
    # so that between ``least`` and ``asked`` any damage is right there; elsewhere too much and too little both count
    off = np.maximum(np.maximum(np.where(at_tip, least, asked) - after.damage, after.damage - asked), 0.0)
    # of points that break at once the opening and slip beyond the strength are limited, over the elastic ones there
    opening, slip = (np.maximum(x, SHORTEST * s.length) for x in (p.law.tension / p.kn, p.law.cohesion / p.ks))
    whole = np.asarray(after.damage) < 1.0  # what has broken may open and slide
    over = np.maximum(
        np.where(sudden_opening & whole, beyond / opening, 0.0), np.where(sudden_slip & whole, slid / slip, 0.0)
    )
    error = np.maximum(off, np.maximum(over - WITHIN, 0.0))
    return float(np.maximum(error, -grown).max(initial=0.0))  # damage never falls


def certify(s: Structure, before: PathState, after: PathState, jump: bool = False) -> tuple[StepCertificate, Balance]:
    """Certificate and energy of the step from one state to the next.

    Parameters
    ----------
    s : the model with its contact points; its ``weight`` of a mean block [N], elastic ``length`` [m] and block ``size``
        [m] are what departures are measured by
    before, after : states at the ends of the step
    jump : whether the load fell or blocks moved at once, so that energy is lost; flow rule,
        sense of the slip and the loss of single points are then not asked, and damage only that it does not fall
    """
    first, last = forces(s, before), forces(s, after)
    old, new = first.components, last.components
    area = s.points.area
    shear = np.linalg.norm(new[:, 1:], axis=1)
    law = strength(s, after).over(area)
    excess = float(law.excess(new[:, 0], shear).max(initial=0.0)) / s.weight
    slip = after.slip - before.slip
    size = np.linalg.norm(slip, axis=1)
    lift = after.lift - before.lift
    elastic = s.length
    # departures of the flow rule are told in the largest slip, or in the elastic length where less slides
    length = max(float(size.max(initial=0.0)), elastic)
    short = lift - law.tan_psi * size
    # a point at its compressive strength is crushed: its lift may fall short of the slip
    crushed = new[:, 0] >= law.crushing * (1.0 - 1e-9)
    flow = float(np.where(crushed, np.maximum(short, 0.0), np.abs(short)).max(initial=0.0)) / length
    # slip runs against the shear on b and only where the law is exhausted: its power is - T . slip = limit |slip|
    limit = np.maximum(law.shear_strength(new[:, 0]), 0.0)
    power = limit * size + (new[:, 1:] * slip).sum(axis=1)
    against = float(np.abs(power).max(initial=0.0)) / (s.weight * length)
    # loss of every point [J], by the forces at the end of the step: none may be negative
    end_loss = -(new[:, 1:] * slip).sum(axis=1) - new[:, 0] * lift
    # plastic work by the trapezoidal rule: the error of the balance is then of third order in the step
    mean = 0.5 * (old + new)
    lost = float(-(mean[:, 1:] * slip).sum() - (mean[:, 0] * lift).sum())
    broken = _taken_by_damage(s, before, after, first.apart, last.apart)
    if s.assembly.ties:
        pulled, pulls = tensions(s, before)[0], tensions(s, after)[0]
        most = np.array([t.strength for t in s.assembly.ties])  # [N]
        more = after.stretched - before.stretched  # plastic elongation in the step [m]
        excess = max(excess, float((pulls - most).max()) / s.weight)
        against = max(against, float((np.abs(more) * np.abs(most - pulls)).max()) / (s.weight * length))
        end_loss = np.append(end_loss, pulls * more)
        lost += float((0.5 * (pulled + pulls) * more).sum())
    live = 0.5 * (before.multiplier + after.multiplier) * work_of_loads(s, "live", before, after)
    dead = work_of_loads(s, "dead", before, after)
    change = stored(s, after, last) - stored(s, before, first)
    # a step that does no work to speak of (sliding without friction) is measured by the elastic work of a block
    # and one that self-stress drives, by the energy that it sets free
    gross = max(abs(live) + abs(dead), abs(change), _IDLE * s.weight * elastic)
    off, least = equilibrium(s, after, last), float(end_loss.min(initial=0.0)) / gross
    if jump:  # its path is not known: all that is left over goes to motion and to the joints that break
        left, damage = live + dead - change, float(np.max(np.asarray(before.damage) - after.damage, initial=0.0))
        balance = Balance(live=live, dead=dead, stored=change, lost=0.0, jumped=left)
    else:
        left, damage = live + dead - change - lost - broken, damage_error(s, before, after, first, last)
        balance = Balance(live=live, dead=dead, stored=change, lost=lost, broken=broken)
    certificate = StepCertificate(
        equilibrium=off, excess=excess, flow=flow, against=against, dissipation=least, energy=left / gross, jump=jump,
        damage=damage,
    )
    return certificate, balance


def _taken_by_damage(s: Structure, before: PathState, after: PathState, began: Array, apart: Array) -> float:
    """Stored energy that damage takes in a step [J]: the opening beyond the strength times what the tension falls by.

    Damage h by opening goes with the opening x, h = rate x, so that the mean of x over the fall is exact; damage by
    slip meets the mean of the step. ``began`` and ``apart`` are the displacements of the points in both states [m],
    shape (m, c).

    Parameters
    ----------
    s : the model with its contact points
    before, after : states at the ends of the step
    """
    p = s.points
    grown = np.asarray(after.damage) - before.damage
    if not p.softens or not np.any(grown):
        return 0.0
    fall = strength(s, before).tension - strength(s, after).tension  # [Pa]
    # opening beyond the strength while the tension falls, at the beginning and at the end of the step [m]
    end, begin = beyond_strength(s, after, apart), beyond_strength(s, before, began)
    # damage that grows with the opening tells at which opening the fall began and ended, damage / rate: it may
    # begin within the step, at the largest opening before, and end within it, where nothing is left to lose
    gradual = (p.by_opening > 0.0) & (p.by_opening < SUDDEN)
    rate = np.where(gradual, p.by_opening, np.inf)  # damage per opening [1/m]
    end = np.where(gradual, np.minimum(end, after.damage / rate), end)
    begin = np.where(gradual, np.minimum(np.maximum(begin, before.damage / rate), end), begin)
    return float((0.5 * (begin + end) * fall * p.area).sum())


def work_of_loads(s: Structure, case: str, before: PathState, after: PathState) -> float:
    """Work of the dead or live loads from one state to the next [J].

    Forces f work along the ways of their points, f . (dx + d(R (1 + G)) r); moments beside those of their arms r are
    couples, which work along the small spins of the step.

    Parameters
    ----------
    s : the model with its contact points
    case : "dead" or "live", at multiplier 1
    before, after : states at the ends of the step
    """
    wrench, arms = getattr(s.loads, case), getattr(s.loads, f"{case}_arms")
    motion = np.concatenate([after.shift - before.shift, _spins(before.turn, after.turn)], axis=1)
    couples = np.hstack([wrench[:, :3], wrench[:, 3:] - axial(arms)])
    by_arms = np.einsum("nij,nji->n", placed(s, after) - placed(s, before), arms)  # arms are sums of r f^T
    return float((couples * np.where(s.assembly.held, 0.0, motion)).sum() + by_arms.sum())


def _spins(before: Array, after: Array) -> Array:
    """Rotation vectors of small steps [rad], shape (n, 3), by the skew part of R_after R_before^T: to second order.

    Parameters
    ----------
    before, after : R - I in both states, shape (n, 3, 3)
    """
    step = (after - before) @ np.swapaxes(before + np.eye(3), 1, 2)
    return 0.5 * axial(np.swapaxes(step, 1, 2))
