"""Certificates: is a prediction in equilibrium, within the joint law, admissible as a motion, and how wide is the gap.

Everything is recomputed with numpy from the assembly, the loads and the prediction's forces and twists. Nothing of the
solver that made them is used, nor the equilibrium matrix: forces are summed block by block, rates are differences of
rigid velocities at the contact points. Limits from which an answer is accepted: ``limitmason.answers.acceptance``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitmason.answers.acceptance import GAP, Certificate
from limitmason.answers.results import FlowRule, Prediction, Resultants
from limitmason.arrays import Array, Flags, Index
from limitmason.mechanics.dissipation import Dissipation, point_dissipation, point_state
from limitmason.mechanics.residuals import (
    PointState,
    block_measures,
    joint_measures,
    live_size,
    part_labels,
    total_load,
    unbalance,
    yield_excess,
)
from limitmason.mechanics.stress_block import stress_blocks_of
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

FORCE_CAP = 10.0
"""Joint force over the total load up to which a mechanism that cannot be repaired still gives a bound."""

AT_REST = 1e-6
"""Rate over the largest below which a repair may leave a block at rest: chosen."""

SETTLED = 0.1
"""Part of the accepted gap within which a bound is not worth a repair: chosen."""

BEYOND = 1e-9
"""Part by which a repair does more than it must, so that rounding leaves no violation."""

ROUNDED_OFF = 1e-14
"""Violation of the flow rule over the largest rate that rounding leaves after a repair [-]."""

LIFTS = (1.0, 2.0, 4.0, 8.0, 16.0, 64.0, 256.0)
"""Rise over spread of the motions that are tried to open every joint: steep enough for any friction, chosen."""

TINY = 1e-300
"""Least divisor: a quotient of zeros is zero."""

LEAST_MULTIPLIER = 1e-3
"""Multiplier below which the gap is relative to this one, in units of that at which live load does the dead's work."""


class Kinematics(NamedTuple):
    """What a mechanism proves: the bound, the same with joints summed over points, the repair it needed."""

    multiplier: float  # bound [-]
    at_points: float  # bound of the law at the contact points [-]
    violation: float  # largest negative g before the repair over the largest rate [-]
    force_cap: float = float("inf")  # joint force over the total load up to which it holds; infinite when repaired
    twists: Array | None = None  # of the repaired mechanism, shape (n_blocks, 6); None where it has no repair


def kinematic_multiplier(
    assembly: Assembly, loads: Loads, prediction: Prediction, *, candidates: tuple[Array, ...] = ()
) -> Kinematics:
    """Upper bound of the associative multiplier from the prediction's mechanism, repaired to be admissible.

    lambda = [ -w_dead . v + sum D(e) ] / (w_live . v), valid for every motion v that nowhere violates the flow rule:
    g = e_n - tan(phi) |e_t| >= 0 at all points without crushing, with e_n the rate of opening and e_t that of sliding.
    A solver's v violates this by its tolerance. The repair adds just enough of a motion that opens every joint: the
    blocks flying apart affinely, v = (x, y, k z), or a candidate supplied by the caller; blocks that no chain of joints
    between free blocks joins to the mechanism stay where they are. Where no motion opens every joint (blocks wedged
    between supports) the remaining violation is charged with the power of a joint force of at most ``FORCE_CAP`` times
    the load (or the largest force found): the bound then holds for all stress states within that cap, not beyond.

    Parameters
    ----------
    assembly, loads : the problem
    prediction : its answer; without a mechanism and forces the bounds are NaN
    candidates : further opening motions to try, twists of shape (n_blocks, 6) each
    """
    mechanism, resultants = prediction.mechanism, prediction.resultants
    if mechanism is None or resultants is None:
        return Kinematics(float("nan"), float("nan"), float("nan"))
    twists = np.where(assembly.held, 0.0, mechanism.twists)
    state = point_state(assembly, resultants, twists)
    joints = Dissipation(assembly, prediction, state)
    uncrushed = joints.rigid  # points without crushing: only there g < 0 is a violation

    def bound_by(v: Array) -> _MotionBound:
        """Bound that a motion gives, or NaN where the live load does no work."""
        live = float((loads.live * v).sum())
        exact, at_points, g = joints.power(v)
        if not live > 0:
            return _MotionBound(float("nan"), float("nan"), g)
        dead = float((loads.dead * v).sum())
        return _MotionBound((exact - dead) / live, (at_points - dead) / live, g)

    def violation_of(g: Array) -> float:
        """Largest rate against the flow rule [m/s], from the free opening of every point."""
        return float(np.where(uncrushed, -g, 0.0).max(initial=0.0))

    given = bound_by(twists)
    size = max(float(np.abs(state.opening).max(initial=0.0)), float(np.abs(state.sliding).max(initial=0.0)), TINY)
    worst = violation_of(given.free_opening)
    # a bound up to this is as close to the multiplier of the forces as a repair could make it
    near = prediction.collapse_multiplier + SETTLED * GAP * abs(prediction.collapse_multiplier)
    admissible = worst <= 0.0
    if admissible and (given.multiplier <= near or uncrushed.all()):
        return Kinematics(given.multiplier, given.at_points, 0.0, twists=twists)
    # points that close by next to nothing crush by rounding alone, which at a high strength is much power: a repair
    # may open them too
    firm = uncrushed if uncrushed.all() else uncrushed | (given.free_opening > -AT_REST * size)
    sets = (uncrushed,) if firm is uncrushed else (uncrushed, firm)
    # speed of every block, its spin over its size [m/s]
    rate = np.abs(twists[:, :3]).max(axis=1) + np.abs(twists[:, 3:]).max(axis=1) * np.cbrt(assembly.volumes)
    best, best_twists = given if admissible else _MotionBound(float("nan"), float("nan"), given.free_opening), twists
    # what hardly moves is better left at rest: to lift a very large block by next to nothing may be too much work
    for still in (0.0, AT_REST):
        moving = rate > still * rate.max()
        motion = np.where(moving[:, None], twists, 0.0)
        g = bound_by(motion).free_opening if still else given.free_opening
        label = part_labels(assembly, moving & ~assembly.fixed)
        touched = ((label[assembly.links.block_a] >= 0) | (label[assembly.links.block_b] >= 0))[
            resultants.point_interface
        ]
        fields = (np.where(moving[:, None], f, 0.0) for f in (*_opening_fields(assembly, label), *candidates))
        for trial in _repairs(state, joints, motion, g, fields, [points & touched for points in sets]):
            repaired = bound_by(trial)
            # "not >=", since the best is NaN until the first repair succeeds
            if violation_of(repaired.free_opening) <= ROUNDED_OFF * size and not repaired.multiplier >= best.multiplier:
                best, best_twists = repaired, trial
        # where all that is slow stands still already, the second round would be the first again
        if best.multiplier <= near or (rate <= AT_REST * rate.max()).sum() == (rate == 0.0).sum():
            break
    if not np.isnan(best.multiplier):
        return Kinematics(best.multiplier, best.at_points, worst / size, twists=best_twists)
    # no repair: what closes against the law is charged with the largest force that a joint may have
    scale = total_load(assembly, loads)
    cap = max(FORCE_CAP * scale, float(np.abs(state.normal_force).max(initial=0.0)))
    violated = float(np.maximum(-given.free_opening[uncrushed], 0.0).sum())
    excess = cap * violated / float((loads.live * twists).sum())
    return Kinematics(given.multiplier + excess, given.at_points + excess, worst / size, cap / scale)


class _MotionBound(NamedTuple):
    """Bound of the associative multiplier by one motion."""

    multiplier: float  # with every joint's dissipation as a whole [-]
    at_points: float  # with that of its contact points [-]
    free_opening: Array  # g = e_n - tan(phi) |e_t| of every point, negative where the flow rule is violated, (m,)


def _repairs(
    state: PointState, joints: Dissipation, motion: Array, g: Array, fields: Iterable[Array], to_open: Iterable[Flags],
) -> Iterator[Array]:
    """The motion with just enough of an opening motion added that no point of a set violates the flow rule.

    One after another for every opening motion and set, as twists of shape (n_blocks, 6). Opening motions that do not
    open every point of the set are passed over.

    Parameters
    ----------
    state : with the law at every point
    joints : which give the rates of a motion at the points
    motion : twists to repair, shape (n_blocks, 6)
    g : their free opening at every point [m/s], shape (m,)
    fields : opening motions, (n_blocks, 6) each
    to_open : sets of points, flags of shape (m,) each
    """
    for field in fields:
        opening, sliding = joints.rates(field)
        opened = state.law.free_opening(opening, np.linalg.norm(sliding, axis=1))
        for points in to_open:
            margin = opened[points]
            if margin.min(initial=np.inf) <= 0.0:
                continue
            # g is concave in v, so adding t field raises every g by at least t times the field's own margin
            need = np.max(np.maximum(-g[points], 0.0) / margin, initial=0.0)
            yield motion + (1.0 + BEYOND) * need * field


def _opening_fields(assembly: Assembly, label: Index) -> Iterator[Array]:
    """Motions in which the blocks fly apart, ever more upwards than sideways, twists of shape (n_blocks, 6).

    Every independent part flies from the middle of its own joints with held blocks, or of its blocks. Head joints open
    as blocks spread, bed joints as they rise: which mixture opens all of them beyond their dilation is found by trying.

    Parameters
    ----------
    label : part of every block, -1 for those at rest, see :func:`limitmason.mechanics.residuals.part_labels`
    """
    c, x, fixed = assembly.centroids, assembly.links, label < 0
    # least and largest coordinates of each part's joints with held blocks, infinite so far; without any, of its blocks
    low, high = np.full((2, label.max() + 1, 3), np.inf) * np.array([1.0, -1.0])[:, None, None]
    at = np.flatnonzero(fixed[x.block_a] != fixed[x.block_b])  # these joints
    owner = label[np.where(fixed[x.block_a], x.block_b, x.block_a)[at]]  # and the parts that they hold
    np.minimum.at(low, owner, x.centre[at])
    np.maximum.at(high, owner, x.centre[at])
    free = np.flatnonzero(~fixed & ~np.isfinite(low).all(axis=1)[label])
    np.minimum.at(low, label[free], c[free])
    np.maximum.at(high, label[free], c[free])
    origin = 0.5 * (low + high)[label]
    for lift in LIFTS:
        field = np.zeros((assembly.n_blocks, 6))
        field[:, :3] = (c - origin) * (1.0, 1.0, lift)
        field[assembly.held] = 0.0
        yield field


def certify(
    assembly: Assembly, loads: Loads, prediction: Prediction, *, candidates: tuple[Array, ...] = (), convex: bool = True
) -> Certificate:
    """Certificate of a prediction, from assembly, loads and prediction alone.

    Parameters
    ----------
    assembly, loads : the problem
    prediction : with forces at contact points, and a mechanism where there is one
    candidates : opening motions for the repair, see :func:`kinematic_multiplier`
    convex : judge the forces by the law with tension cut at the cone's apex, or by ft as it is, as the DEM takes it

    Returns
    -------
    Certificate
        For an associative prediction the kinematic bound and the gap are given; for a non-associative one the
        residual of its flow rule e_n >= tan(psi) |e_t| and its complementarity,
        sum (N + N_t) (e_n - tan(psi) |e_t|) + |T . e_t + (c A + N tan(phi)) |e_t|| over the total load's unit power
        (a point that crushes may close, e_n < tan(psi) |e_t|, at its capacity). Its ``refusal`` says what is wrong.
    """
    r, m = prediction.resultants, prediction.mechanism
    if r is None or not np.isfinite(prediction.collapse_multiplier):
        # nothing to judge: a certificate of NaN is refused
        return Certificate(float("nan"), float("nan"))
    scale = total_load(assembly, loads)
    twists = np.zeros((assembly.n_blocks, 6)) if m is None else np.where(assembly.held, 0.0, m.twists)
    state = point_state(assembly, r, twists, convex=convex)
    forces = _forces_certified(assembly, loads, prediction, r, state)
    if m is None:
        return forces
    pairs = stress_blocks_of(assembly, prediction)
    if pairs is not None:
        # the two ends of a section crush by their stress block, not by the strength of a point
        state = state._replace(law=state.law.without_crushing(pairs.ends))
    rate = float((loads.live * twists).sum())  # power of the live load [W]
    # power that the total load would have at the speed of the live load [W]: the measure of complementarity
    unit = max(abs(rate), TINY) * scale / max(live_size(assembly, loads), TINY)
    if not rate > 0.0:
        return forces  # a motion on which the live load does no work is no collapse mechanism
    if prediction.flow_rule == FlowRule.NON_ASSOCIATIVE:
        short, opposed = state.law.flow_residual(state.normal_force, state.shear_force, state.opening, state.sliding)
        slip = np.linalg.norm(state.sliding, axis=1)
        size = max(float(np.abs(state.opening).max(initial=0.0)), float(slip.max(initial=0.0)))
        flow = float(short.max(initial=0.0) / max(size, TINY))
        # how much the multiplier changes with cohesion spread over the faces instead of lumped at points [-]
        lumped = Dissipation(assembly, prediction, state).spread(twists, state.sliding) / rate
        return replace(
            forces, flow_residual=flow, complementarity=float(opposed.sum() / unit),
            discretisation=lumped / max(abs(prediction.collapse_multiplier), TINY),
        )
    k = kinematic_multiplier(assembly, loads, prediction, candidates=candidates)
    power, _ = point_dissipation(state.law, state.opening, state.sliding)
    by_forces = (state.normal_force * state.opening) + (state.shear_force * state.sliding).sum(axis=1)
    slack = np.abs(by_forces + power) if pairs is None else np.full(1, np.nan)  # a stress block's two ends act together
    static = prediction.collapse_multiplier
    measure = _gap_measure(loads, twists, static)
    return replace(
        forces, flow_residual=k.violation, complementarity=float(slack.max(initial=0.0) / unit),
        kinematic_multiplier=k.multiplier,
        gap=(k.multiplier - static) / measure, discretisation=(k.multiplier - k.at_points) / measure,
        force_cap=k.force_cap,
    )


def _gap_measure(loads: Loads, twists: Array, static: float) -> float:
    """What the gap between the bounds is divided by [-].

    The multiplier itself, unless it is next to nothing beside the one at which the live load does as much work as the
    dead load of the blocks that move could.

    Parameters
    ----------
    twists : of the mechanism, shape (n_blocks, 6)
    static : multiplier of the forces [-]
    """
    by_weight = np.linalg.norm(loads.dead[:, :3], axis=1) * np.linalg.norm(twists[:, :3], axis=1)
    by_couples = np.linalg.norm(loads.dead[:, 3:], axis=1) * np.linalg.norm(twists[:, 3:], axis=1)
    by_live_load = abs(float((loads.live * twists).sum()))
    equal_work = float((by_weight + by_couples).sum()) / max(by_live_load, TINY)
    return max(LEAST_MULTIPLIER * equal_work, abs(static), TINY)


def _forces_certified(
    assembly: Assembly, loads: Loads, prediction: Prediction, r: Resultants, state: PointState
) -> Certificate:
    """Certificate of the forces alone: equilibrium and joint law, over the total load and each by its own measure.

    Parameters
    ----------
    assembly, loads, prediction : as of :func:`certify`
    r : resultants of the prediction
    state : of its contact points
    """
    value, x = prediction.collapse_multiplier, assembly.links
    scale = total_load(assembly, loads)
    pairs = stress_blocks_of(assembly, prediction)
    rest = np.abs(unbalance(assembly, loads, r, value)).max(axis=1)
    measures = block_measures(assembly, loads, r, value)
    excess = yield_excess(state, pairs)
    own = rest / measures  # of every block [-]
    joint = np.zeros(len(x.area))  # of every joint, by its worst point [-]
    np.maximum.at(joint, r.point_interface, excess)
    joint /= joint_measures(assembly, r, measures)
    block, face = int(np.argmax(own)), int(np.argmax(joint))
    names = [b.name for b in assembly.blocks]
    return Certificate(
        float(rest.max(initial=0.0) / scale), float(excess.max(initial=0.0)) / scale,
        static_multiplier=value, confinement=float(np.abs(r.normal).max(initial=0.0) / scale),
        block_residual=float(own[block]), worst_block=names[block], joint_excess=float(joint[face]),
        worst_joint=f"{names[x.block_a[face]]} / {names[x.block_b[face]]}",
    )
