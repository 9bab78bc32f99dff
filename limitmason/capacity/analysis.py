"""The call: from a model and its loads to a capacity curve."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity import path, stepping
from limitmason.capacity.certificate import Balance, StepCertificate, Structure, certify, equilibrium
from limitmason.capacity.kinematics import Pose, at_rest, make_bodies
from limitmason.capacity.path import Steps
from limitmason.capacity.point_law import Elastic, History, slid_back
from limitmason.capacity.result import Energy, PushoverCurve, state_of
from limitmason.capacity.stepping import Node
from limitmason.capacity.system import System
from limitmason.contact_points import Grid, contact_points
from limitmason.curve import Event
from limitmason.equilibrium import project
from limitmason.errors import InputError, NotApplicable
from limitmason.law import interface_law
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.plane import find_plane
from limitmason.stated import tension_cut
from limitmason.stiffness import SETTLEMENT, default_stiffness

Array = NDArray[np.float64]

_VERIFIED_SLIP = 5e-3
"""Slip past the first limit point, over the size of a joint, from which a curve is said to be unverified."""

WANDERED = 0.1
"""Slip over the size of a joint from which the contacts, which are not found anew, are no longer where they were."""

_AXES = {"x": 0, "y": 1, "z": 2}


def pushover(
    assembly: Assembly,
    loads: Loads,
    *,
    control: str | tuple[int | str, str] = "live",
    to: float | None = None,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] = (5, 5),
    stiffness: float | tuple[float, float] | None = None,
    steps: Steps | None = None,
    start: PushoverCurve | None = None,
    progress: Callable[[str], None] | None = None,
) -> PushoverCurve:
    """Capacity curve of rigid blocks with elastic, unilateral, frictional joints: load against displacement.

    The joint law, the contact points and the stiffness are those of the DEM; rotations are finite. The dead load is
    applied first, to the unstressed structure.

    Parameters
    ----------
    assembly, loads : the problem; loads keep their direction, and their moments about the centroids, as blocks move
    control : what is prescribed: "live", the mean displacement along the live forces, sum(live . shift) / sum |live|;
        or (block, "x"), "y" or "z" of its centroid
    to : control displacement from the state under dead load [m]; negative for the other sense; None goes on until the
        load has fallen 0.2 % below its first limit point, at most to a tenth of a block
    contact_model, grid : as in :func:`limitmason.contact_points.contact_points`
    stiffness : kn, or (kn, ks), of every joint [Pa/m]; by default that of the joints, else the DEM's default
    steps : see :class:`Steps`
    start : curve whose last state is gone on from, for the same model, contact points and dead load; its live load must
        be the same up to a factor, which may be negative
    progress : called with a line per step

    Returns
    -------
    PushoverCurve
        ``status`` is "reached", "limit point passed", "slides on at constant load", "overturned" (the multiplier came
        back to zero), "stopped" or "cannot stand under dead load". The first limit point at psi < phi is that of the
        path from the unstressed wall: an estimate, no bound.

    Raises
    ------
    NotApplicable
        For crushing and softening joints, and for blocks of which some rotations are held, in space.
    InputError
        For a live load without forces, and for a control, length or stiffness that makes no sense.

    Notes
    -----
    Contacts are not found anew: a warning says from where sliding exceeds a tenth of a joint. Beyond small displacement
    the answer depends on which of two blocks carries the joint's frame. Tension that opens a joint leaves no damage:
    perfect plasticity without crack memory, as in the DEM's perfectly plastic law.
    """
    begun, say = time.perf_counter(), progress or (lambda _: None)
    _refuse(assembly, loads)
    plane = find_plane(assembly, loads)
    points = contact_points(assembly, contact_model=contact_model, grid=grid, plane=plane, elastic=True)
    if not points.count:
        raise InputError("no joint touches a free block: there is nothing that could carry a load")
    if plane is None:
        _refuse_partial_rotations(assembly)
    kn, ks, warnings = _stiffnesses(assembly, loads, stiffness)
    law = interface_law(assembly.arrays).at(points.interface)
    bodies = make_bodies(assembly, points, plane)
    free = bodies.free
    dead, live = project(loads.dead, bodies.basis) * free, project(loads.live, bodies.basis) * free
    mine = free.any(axis=1)
    weight = float(np.linalg.norm(loads.dead[mine, :3], axis=1).mean()) or float(
        np.linalg.norm(loads.live[mine, :3], axis=1).mean()
    )
    size = float(np.median(np.cbrt(assembly.arrays.volume[mine])))
    kn, ks = kn[points.interface], ks[points.interface]
    row, ratio = _control(assembly, control, bodies.basis, free, live)
    system = System(bodies, Elastic(law, kn, ks), dead, live, row, weight, size)
    structure = Structure(assembly, loads, points, law, kn, ks, weight, size)
    nodes, origin = _begin(system, structure, start, say)
    if not nodes:
        warnings.append("no equilibrium under the dead load was found: is it carried, and is every block held?")
        return PushoverCurve(
            np.zeros(1), np.zeros(1), load_unit="-", label="pushover", status=path.CANNOT_STAND,
            warnings=tuple(warnings), source="limitmason", structure=structure, system=system,
        )  # fmt: skip
    if to is not None and not (np.isfinite(to) and to != 0.0):
        raise InputError(f"to must be a displacement [m] that is not zero, or None, got {to!r}")

    def energy(before: Node, after: Node) -> float:
        return certify(structure, state_of(before), state_of(after))[0].energy

    end = None if to is None else system.controlled(origin) + to
    status, said = path.follow(system, nodes, end, ratio, steps or Steps(), say, energy)
    warnings += said
    say(f"{status} after {len(nodes) - 1} steps, {time.perf_counter() - begun:.1f} s")
    return _curve(structure, system, nodes, origin, status, warnings)


def _refuse(assembly: Assembly, loads: Loads) -> None:
    if len(loads.dead) != assembly.n_blocks:
        raise InputError(f"loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    for i in assembly.interfaces:
        j, names = i.joint, tuple(assembly.blocks[b].name for b in (i.block_a, i.block_b))
        if np.isfinite(j.compressive_strength):
            raise NotApplicable(
                f"the joint between {names[0]!r} and {names[1]!r} crushes (compressive_strength): pushover does not "
                "follow crushing; leave it out or use method 'dem'"
            )
        if j.softens:
            raise NotApplicable(
                f"the joint between {names[0]!r} and {names[1]!r} softens (residual values or fracture energies): "
                "pushover follows perfectly plastic joints only; leave them out or use method 'dem'"
            )
    if assembly.fixed.all():
        raise InputError("every block is held: there is nothing to push")


def _refuse_partial_rotations(assembly: Assembly) -> None:
    turning = assembly.held[:, 3:]
    some = np.flatnonzero(turning.any(axis=1) & ~turning.all(axis=1))
    if len(some):
        raise NotApplicable(
            f"block {assembly.blocks[some[0]].name!r} has some of its rotations held: with finite rotations in space "
            "pushover takes all or none"
        )


def _stiffnesses(
    assembly: Assembly, loads: Loads, stiffness: float | tuple[float, float] | None
) -> tuple[Array, Array, list[str]]:
    """Kn and ks per interface [Pa/m], and what a user should know about them."""
    x, warnings = assembly.arrays, []
    if cut := tension_cut(assembly):
        warnings.append(cut)
    if stiffness is not None:
        pair = np.atleast_1d(np.asarray(stiffness, dtype=float))
        if pair.shape not in ((1,), (2,)) or not (np.isfinite(pair).all() and (pair > 0).all()):
            raise InputError(f"stiffness must be kn or (kn, ks), positive numbers [Pa/m], got {stiffness!r}")
        return np.full(len(x.area), pair[0]), np.full(len(x.area), pair[-1]), warnings
    missing = ~(x.normal_stiffness > 0.0)
    standard = default_stiffness(assembly, loads.dead)
    if missing.any():
        warnings.append(
            f"{int(missing.sum())} of {len(missing)} joints name no stiffness: kn = ks = {standard:.3g} Pa/m is used, "
            f"chosen so that the foot shortens by {SETTLEMENT:g} of a block under the dead load; it is not a material "
            "property"
        )
    kn = np.where(missing, standard, x.normal_stiffness)
    ks = np.where(np.isnan(x.shear_stiffness), kn, x.shear_stiffness)
    if not (ks > 0.0).all():
        raise NotApplicable(
            f"joint of interface {int(np.argmin(ks > 0))} has shear_stiffness 0: it must be positive here"
        )
    return kn, ks, warnings


def _control(
    assembly: Assembly, control: Any, basis: Array, free: NDArray, live: Array
) -> tuple[Array, float]:
    """Row of the control displacement, (n, d), and the live loads' work per control displacement at first [N]."""
    forces = np.where(np.abs(basis[:3]).max(axis=0) > 0.5, live, 0.0)
    total = float(np.linalg.norm(forces, axis=1).sum())
    if not total > 0.0:
        raise InputError("no live force acts on a free block: there is nothing to push with")
    if isinstance(control, str):
        if control != "live":
            raise InputError(f"control must be 'live' or (block, 'x'), got {control!r}")
        return forces / total, total
    if len(control) != 2 or control[1] not in _AXES:
        raise InputError(f"control must be 'live' or (block, 'x' or 'y' or 'z'), got {control!r}")
    i = assembly.block_index(control[0])
    row = np.zeros_like(live)
    row[i] = basis[_AXES[control[1]]] * free[i]
    if not row.any():
        raise InputError(f"control: block {control[0]!r} does not move along {control[1]!r}")
    return row, total


def _begin(
    system: System, structure: Structure, start: PushoverCurve | None, say: Callable[[str], None]
) -> tuple[list[Node], Pose]:
    """First node, and the pose under dead load from which displacements count."""
    if start is None:
        first = stepping.dead_load(system)
        if first is None:
            return [], at_rest(structure.assembly.n_blocks)
        say(f"dead load: {first.programs} programs, {first.iterations} iterations of Newton")
        return [first], first.pose
    before = start.structure
    if before is None or not start.nodes:
        raise InputError("start is a curve without states: there is nothing to go on from")
    now = structure
    same = (
        before.points.position.shape == now.points.position.shape
        and np.allclose(before.points.position, now.points.position, rtol=0.0, atol=1e-9 * now.size)
        and np.array_equal(before.points.block_a, now.points.block_a)
        and np.allclose(before.kn, now.kn)
        and np.allclose(before.ks, now.ks)
        and np.allclose(before.loads.dead, now.loads.dead)
    )
    if not same:
        raise InputError("start is a curve of another model: points, stiffness and dead load must be the same")
    old, new = before.loads.live, now.loads.live
    factor = float((old * new).sum() / (new * new).sum())
    if not np.allclose(old, factor * new, rtol=0.0, atol=1e-9 * np.abs(old).max()):
        raise NotApplicable("start: the live load may change by a factor only; other live loads are not followed")
    last = start.nodes[-1]
    first = last._replace(
        multiplier=factor * last.multiplier, control=system.controlled(last.pose), programs=0, iterations=0, jump=False
    )
    assert start.origin is not None
    return [first], start.origin


def _curve(
    structure: Structure, system: System, nodes: list[Node], origin: Pose, status: path.PathEnd, warnings: list[str]
) -> PushoverCurve:
    states = [state_of(n) for n in nodes]
    zero = StepCertificate(equilibrium(structure, states[0]), 0.0, 0.0, 0.0, 0.0, 0.0)
    certificates, balances = [zero], [Balance(0.0, 0.0, 0.0, 0.0)]
    for (before, after), node in zip(pairwise(states), nodes[1:], strict=True):
        certificate, balance = certify(structure, before, after)
        certificates.append(certificate._replace(jump=node.jump))
        balances.append(balance)
    table = np.array(balances)
    gross = np.cumsum(np.abs(table[:, 0]) + np.abs(table[:, 1]))
    live, dead, stored, lost = np.cumsum(table, axis=0).T
    energy = Energy(live, dead, stored, lost, (live + dead - stored - lost) / np.maximum(gross, 1e-300))
    bad = [k for k, c in enumerate(certificates) if not c.accepted]
    if bad:
        warnings.append(f"the certificate refuses {len(bad)} of {len(nodes)} samples, the first is {bad[0]}")
    jumps = path.jumps(nodes)
    if jumps:
        warnings.append(f"{len(jumps)} of {len(nodes) - 1} steps are jumps, made through viscous sub-steps")
    size = np.sqrt(structure.assembly.arrays.area[structure.points.interface])
    for k, s in enumerate(states):
        slid = np.linalg.norm(s.slip, axis=1) / size
        worst = int(np.argmax(slid))
        if slid[worst] > WANDERED:
            p, blocks = structure.points, structure.assembly.blocks
            a, b = blocks[p.block_a[worst]].name, blocks[p.block_b[worst]].name
            warnings.append(
                f"from sample {k} on {a!r} and {b!r} have slid by more than {WANDERED:g} of their joint: contacts are "
                "not found anew, and the curve beyond is that of the first contacts"
            )
            break
    for k, s in enumerate(states):
        back = np.flatnonzero(slid_back(structure.law.tan_psi, History(s.slip, s.lift)))
        if len(back):
            p, blocks = structure.points, structure.assembly.blocks
            a, b = blocks[p.block_a[back[0]]].name, blocks[p.block_b[back[0]]].name
            warnings.append(
                f"from sample {k} on {a!r} and {b!r} slide back, or round a bend: the curve keeps the lift of "
                "dilation, which the DEM gives back; quote it up to there, or set dilatancy_angle_deg to 0"
            )
            break
    curve = PushoverCurve(
        np.array([n.control for n in nodes]) - system.controlled(origin), np.array([n.multiplier for n in nodes]),
        load_unit="-", label="pushover",
        events=tuple(Event("jump", k) for k in jumps), errors={"energy": np.array([c.energy for c in certificates])},
        states=tuple(states), status=status, warnings=tuple(warnings), source="limitmason", structure=structure,
        system=system, nodes=tuple(nodes), certificates=tuple(certificates), energy=energy, jumps=jumps, origin=origin,
    )  # fmt: skip
    top = curve.first_limit_point
    if top is None:
        return curve
    beyond = float((np.linalg.norm(states[-1].slip - states[top.index].slip, axis=1) / size).max())
    if beyond <= _VERIFIED_SLIP:
        return curve
    unverified = (
        f"past the first limit point (sample {top.index}, lambda {top.load:.5g}) joints slide by {beyond:.2g} of "
        "their size: such branches are not verified, and walls were met on which the curve left the right one; quote "
        "it up to there"
    )
    return replace(curve, warnings=(*curve.warnings, unverified))
