"""From the nodes of a path to a curve: certificates and energy of its steps, events, and what a reader must be told.

``nodes`` are the states of the path, in their order.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from limitmason.answers.curve import Energy, Event
from limitmason.answers.references import data_behind
from limitmason.capacity.certificate import Balance, StepCertificate, certify, equilibrium
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.contact_search.touching import outside
from limitmason.capacity.kinematics import Pose
from limitmason.capacity.outcomes import PathEnd
from limitmason.capacity.papers import PAPERS
from limitmason.capacity.point_law import PlasticHistory
from limitmason.capacity.result import Break, PushoverCurve
from limitmason.capacity.slip_softening import slid_back
from limitmason.capacity.step_equilibrium import Node

WANDERED = 0.1
"""Slip over the size of a joint from which a point that is not found anew is no longer where it was [-]."""


NEARLY = 0.98
"""Part of the first limit load whose displacement is looked at [-]: chosen."""

WITHIN = 1e-3
"""Change of the load about ``NEARLY`` of it, for which the displacement is asked [-]: chosen."""

FLAT = 0.02
"""Part of a displacement that may hang on a change of the load by ``WITHIN`` without a warning [-]: chosen."""


def certified_curve(
    generations: Generations,
    nodes: list[Node],
    origin: Pose,
    status: PathEnd,
    warnings: list[str],
    unit: float | None,
    toward: float = 1.0,
) -> PushoverCurve:
    """The curve of a path with a certificate per step.

    Parameters
    ----------
    origin : pose under dead load, from which displacements count
    status : how the path ended
    warnings : what is known so far; more is added
    generations : contacts and equations of every part of the path
    nodes : its states, in their order
    unit : load of multiplier 1 [N]; None where the curve is in multipliers
    toward : sign of the load in the sense in which it is pushed
    """
    first = nodes[0]
    structures, state = generations.structures, generations.state
    zero = StepCertificate(
        equilibrium=equilibrium(structures[first.generation], state(first)), excess=0.0, flow=0.0, against=0.0,
        dissipation=0.0, energy=0.0,
    )
    certificates, balances = [zero], [Balance(live=0.0, dead=0.0, stored=0.0, lost=0.0)]
    for node, after in pairwise(nodes):
        before = generations.begun(node)
        certificate, balance = certify(structures[after.generation], state(before), state(after), after.jump)
        certificates.append(certificate)
        # what finding contacts anew changed in the stored energy counts to the step that begins with them
        balances.append(balance._replace(stored=balance.stored + generations.changed(node)))
    table = np.array(balances)
    # columns are those of ``Balance``; errors are over the work that all steps did
    gross = np.cumsum(np.abs(table[:, 0]) + np.abs(table[:, 1]))
    live, dead, stored, lost, broken, jumped = np.cumsum(table, axis=0).T
    left = live + dead - stored - lost - broken - jumped
    energy = Energy(live, dead, stored, lost, left / np.maximum(gross, 1e-300), broken, jumped)
    breaks = _breaks(generations, nodes, balances)
    bad = [k for k, c in enumerate(certificates) if not c.accepted]
    if bad:
        warnings.append(f"the certificate refuses {len(bad)} of {len(nodes)} samples, the first is {bad[0]}")
    jumps = tuple(k for k, node in enumerate(nodes[1:], 1) if node.jump)
    if jumps:
        through = len(jumps) - len(breaks)
        parts = [f"{len(breaks)} where joints break at once"] * bool(breaks)
        parts += [f"{through} to a state that no path leads to"] * bool(through)
        warnings.append(f"{len(jumps)} of {len(nodes) - 1} steps are jumps, {' and '.join(parts)}")
    through_each_other = _through(generations, nodes) if generations.shapes is None else ""
    warnings += filter(None, (_stayed(generations, nodes), through_each_other, _returned(generations, nodes)))
    renewed = [k for k, n in enumerate(nodes) if n.onward is not None]
    events = [Event("jump", k) for k in jumps]
    events += [Event("joint breaks", b.sample, b.joints[0], b.energy) for b in breaks]
    events += [Event("contacts found anew", k) for k in renewed]
    scale, named = (1.0, "-") if unit is None else (unit, "N")
    curve = PushoverCurve(
        np.array([n.control for n in nodes]) - generations.systems[0].controlled(origin),
        scale * np.array([n.multiplier for n in nodes]), load_unit=named, unit=scale,
        label="pushover", events=tuple(events),
        errors={"energy": np.array([c.energy for c in certificates])}, states=tuple(state(n) for n in nodes),
        status=status, warnings=tuple(warnings), source="limitmason", generations=generations, nodes=tuple(nodes),
        certificates=tuple(certificates), energy=energy, jumps=jumps, origin=origin, breaks=breaks,
        toward=toward,
        references=(*PAPERS, *data_behind(structures[0].assembly.recipe)),
    )
    return replace(curve, warnings=(*warnings, said)) if (said := _told_of_flat_top(curve)) else curve


def _told_of_flat_top(curve: PushoverCurve) -> str:
    """Warning where the displacement near the first limit point hangs on the last digits of the load, or ""."""
    # a curve without a limit point, or one that begins near to its load, has no displacement there to tell of
    top = curve.first_limit_point
    if top is None or curve.toward * top.load <= 0.0 or curve.load[0] / top.load > NEARLY - WITHIN:
        return ""
    # displacements [m] at which the load first comes to these parts of the limit load
    before, at, after = (curve._crossing(x * top.load, top.index) for x in (NEARLY - WITHIN, NEARLY, NEARLY + WITHIN))
    wide = max(abs(after - at), abs(at - before))
    if wide <= FLAT * abs(at):
        return ""
    return (
        f"the curve is flat below its first limit point: {WITHIN:.1%} of the load is {wide / abs(at):.0%} of the "
        f"displacement at {NEARLY:.0%} of it; quote loads there"
    )


def _breaks(generations: Generations, nodes: list[Node], balances: list[Balance]) -> tuple[Break, ...]:
    """What broke at once, a :class:`Break` for every node with broken points.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    balances : energy of the step that led to every node, shape (nodes,)
    """
    found = []
    for k, node in enumerate(nodes):
        if node.broken is None or k == 0:  # what broke on the way to sample 0 is no step of this curve
            continue
        p = generations.structures[node.generation].points
        rows, blocks = node.broken, generations.structures[0].assembly.blocks
        pairs = zip(p.block_a[rows].tolist(), p.block_b[rows].tolist(), strict=True)
        joints = dict.fromkeys(f"{blocks[min(a, b)].name} - {blocks[max(a, b)].name}" for a, b in pairs)
        found.append(Break(sample=k, joints=tuple(joints), points=len(rows), energy=balances[k].jumped))
    return tuple(found)


def _returned(generations: Generations, nodes: list[Node]) -> str:
    """Warning of the first points that slide back or round a bend after they have dilated, or "".

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    for k, node in enumerate(nodes):
        s = generations.structures[node.generation]
        p = s.points
        # points found anew took over the lift of others, and their two material points do not meet along the tangents
        aside = np.einsum("mci,mi->mc", p.directions[:, 1:], p.place_b - p.place_a)
        own = np.abs(aside).max(axis=1) < 1e-9 * s.size  # 0 but for rounding
        back = np.flatnonzero(own & slid_back(p.law.tan_psi, PlasticHistory(node.history.slip, node.history.lift)))
        if len(back):
            a, b = (s.assembly.blocks[i].name for i in (p.block_a[back[0]], p.block_b[back[0]]))
            return (
                f"from sample {k} on {a!r} and {b!r} slide back, or round a bend: the curve keeps the lift of "
                "dilation, which the DEM gives back; quote it up to there, or set dilatancy_angle_deg to 0"
            )
    return ""


def _through(generations: Generations, nodes: list[Node]) -> str:
    """Warning of blocks that go through each other on a path that keeps the points of the undeformed joints, or "".

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    # blocks that have gone through each other are taken to stay so: the first such sample is found by bisection
    low, high = -1, len(nodes) - 1
    if not (met := generations.through(nodes[high])):
        return ""
    while high - low > 1:
        k = (low + high) // 2
        said = generations.through(nodes[k])
        low, high, met = (low, k, said) if said else (k, high, met)
    return f"from sample {high} on blocks go through each other where they have no contact point: {met}"


def _stayed(generations: Generations, nodes: list[Node]) -> str:
    """Warning of the first point that bears and has slid far from where its blocks may meet, or "".

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    nodes : states of the path, in their order
    """
    for k, node in enumerate(nodes):
        s = generations.structures[node.generation]
        p = s.points
        # size of the joint of every point, of a block for points between blocks that had none [m]
        joined = p.interface >= 0
        size = np.full(p.count, s.size)
        size[joined] = np.sqrt(s.assembly.arrays.area[p.interface[joined]])
        # a point that no face is known of has gone as far as it slid, another as far as it lies outside its face [m]
        far = np.where(p.face < 0, np.linalg.norm(node.history.slip, axis=1), 0.0)
        if generations.shapes is not None:
            far = np.maximum(far, outside(generations.shapes, p, node.pose))
        far[node.force[:, 0] <= 0.0] = 0.0  # where a point that bears nothing is does not matter
        worst = int((far / size).argmax())
        if far[worst] > WANDERED * size[worst]:
            a, b = (s.assembly.blocks[i].name for i in (p.block_a[worst], p.block_b[worst]))
            return (
                f"from sample {k} on {a!r} and {b!r} have slid by more than {WANDERED:g} of their joint at a point "
                "that is not found anew: the curve beyond is that of the first points"
            )
    return ""
