"""Search for loads that are safe at once, inside by forces, outside by mechanisms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.acceptance import OWN_RESIDUAL
from limitmason.answers.results import Bound, BoundKind, Prediction, Resultants, Status
from limitmason.arrays import Array
from limitmason.checks import count, instance, positive, several
from limitmason.errors import InputError, NotConverged
from limitmason.geometry.convex_set import (
    corners_of_half_spaces,
    extreme_points,
    extreme_rays,
    nearest_in_hull,
    positively_spans,
)
from limitmason.limit.load_set import HalfPlane, LoadRegion
from limitmason.limit.program.clarabel_solver import opening_motion, solve_static
from limitmason.limit.program.cones import make_cones
from limitmason.limit.program.scaling import balanced
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.limit.range.bracket import inside
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.contact_points import chosen_grid
from limitmason.mechanics.law_table import refuse
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model

FLAT = 1e-3
"""Least extent of a set that its gap is measured by, over the multiplier at which a load is as large as the dead."""

FAR = 10.0
"""Sizes of multipliers at which a set without end is cut, over the largest that is found where it has one: chosen."""

AT_APEX = 1e-6
"""Distance from the origin up to which a corner of a cone cut at 1 is its apex [-], well above a solver's error."""

NO_STRENGTH = 1e-9
"""What crushing joints and ties bear beside loads without end, over the least of these at multiplier one [-].

Far below ``AT_APEX``, and not zero, as no joint or tie is without any strength.
"""

NO_WORK = 1e-6
"""Work of the loads on a motion, over its largest velocity times the dead load, up to which it is none [-]: chosen."""

SAME_DIRECTION = 1e-9
"""Distance of two unit directions up to which they are the same [-]: rounding."""


@of_model
def load_region(
    assembly: Assembly,
    dead: Loads,
    cases: Sequence[Loads],
    *,
    tolerance: float = 1e-3,
    within: float | Sequence[float] | None = None,
    most: int = 400,
    contact_model: str = "vertices",
    grid: Any = None,
    in_plane: bool | None = None,
) -> LoadRegion:
    r"""Multipliers of two or three loads that a structure carries at once.

    The set is closed from inside and outside.

    .. math:: R = \{ \lambda : A f + w + \sum_k \lambda_k w_k = 0,\ f \in K \}, \qquad
        \lambda \in R \Rightarrow \sum_k (w_k \cdot v) \lambda_k \le D(v) - w \cdot v \ \text{for every } v

    Parameters
    ----------
    assembly : the structure
    dead : its dead load
    cases : one to three loads; the live part of each is what is multiplied, and its name is kept; a
        second of the same name is numbered
    tolerance : gap at which the set counts as closed, see :class:`LoadRegion`
    within : sizes of the multipliers up to which the set is wanted; without, ten times the largest that is found where
        the set has no end
    most : programs that are solved at most, beside two along every axis; the cone and the certain set have as many
    contact_model, grid, in_plane : as for :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    LoadRegion
        Draw it with ``lm.figures.load_region``.

    Raises
    ------
    InputError
        Naming the case that has no live load, or two that are the same load.
    NotConverged
        Where the solver answers neither with forces nor with a motion.

    Notes
    -----
    Associative. Every corner's forces and every half-plane's mechanism are checked as certificates are, without the
    solver. Wrong beyond small displacements, and for blocks that deform.
    """
    cases = several("cases", cases, Loads)
    if not 1 <= len(cases) <= 3:
        raise InputError(f"cases: one to three loads make a region, got {len(cases)}")
    if instance("dead", dead, Loads).live.any():
        raise InputError("dead: its live part has no role in a region; give it as a case")
    positive("tolerance", tolerance)
    count("most", most, least=0)
    limit = None if within is None else np.array([positive("within", v) for v in np.atleast_1d(within).tolist()])
    if limit is not None and len(limit) not in (1, len(cases)):
        raise InputError(f"within: give one size, or one for each of the {len(cases)} cases, got {within!r}")
    limit = None if limit is None else np.broadcast_to(limit, (len(cases),))
    for number, case in enumerate([dead, *cases], start=-1):  # the dead load is number -1, the cases begin at 0
        if len(case.dead) != assembly.n_blocks:
            label = "dead" if number < 0 else f"case {case.name or number!r}"
            raise InputError(f"{label}: for {len(case.dead)} blocks, the assembly has {assembly.n_blocks}")
    for number, case in enumerate(cases):
        if not case.live[~assembly.held].any():
            raise InputError(f"case {case.name or number!r} has no live load on a free block")
    refuse("associative", assembly)
    live = np.array([c.live for c in cases])
    if np.linalg.matrix_rank(np.where(assembly.held, 0.0, live).reshape(len(cases), -1)) < len(cases):
        raise InputError("cases: one of the loads is made of the others")
    names = _names(cases)
    model = {"contact_model": contact_model, "grid": chosen_grid(contact_model, grid), "in_plane": in_plane}

    def region(made: Assembly, dead: Loads, limit: Array | None) -> LoadRegion:
        """Region of a structure under its dead load, with a ``limit`` (k,) or None."""
        return _closed(_Support(made, dead, live, model), names, tolerance, limit, most)

    found = region(assembly, dead, limit)
    if np.isfinite(found.within).any() and len(found.corners):
        # the region has no end and was cut at ``within``. Its endless directions are the region without dead load and
        # strengths, which is a cone; cut at 1, its corners away from the origin lie on the rays
        least = NO_STRENGTH * float(np.abs(live).sum(axis=(1, 2)).min())
        homogeneous = region(_endless(assembly, least), replace(dead, dead=0.0 * dead.dead), np.ones(len(cases)))
        size = np.linalg.norm(homogeneous.corners, axis=1)
        away = size > AT_APEX
        rays = homogeneous.corners[away] / size[away, None]
        found = replace(found, cone=extreme_rays(rays))
    if any(i.joint.tan_psi < i.joint.tan_phi for i in assembly.interfaces):
        # with friction tan(psi) the same motions are associative: what lies inside is safe for any flow rule
        reduced = assembly.with_joints(inside)
        # where the region has no end, this one is cut at the same multipliers
        same = found.within if np.isfinite(found.within).all() else limit
        found = replace(found, certain=region(reduced, dead, same))
    return found


def _endless(assembly: Assembly, least: float) -> Assembly:
    """The assembly whose joints bear only what can grow with the loads without end.

    Friction stays. Cohesion and tensile strength are left out; joints that crush, and ties, bear next to nothing.

    Parameters
    ----------
    least : force that a joint which crushes, or a tie, bears at most [N]
    """
    crushing = least / float(assembly.arrays.area.max())

    def law(joint: Joint) -> Joint:
        """Friction alone, or next to no strength for a joint that crushes."""
        if math.isinf(joint.compressive_strength):
            return Joint(joint.friction_angle_deg)
        return Joint(0.0, compressive_strength=crushing)

    return assembly.with_joints(law).with_ties([replace(tie, anchor_force=least) for tie in assembly.ties])


class _Farthest(NamedTuple):
    """Where the set of loads ends in a direction."""

    status: str  # "solved", "unbounded" or "cannot stand"
    multipliers: Array  # [-], (k,)
    forces: Resultants | None  # that carry them; None without a certificate
    half_plane: HalfPlane | None  # of the mechanism; None without a proof


class _Support:
    """Largest multipliers in a direction: forces, and the mechanism's half-plane.

    Attributes
    ----------
    problem : with the live loads in units of ``unit``
    unit : multiplier at which a live load is as large as the dead load [-], shape (k,)
    opening : a motion that opens all joints, as twists, or nothing where there is none; None until it is asked for
    """

    def __init__(self, assembly: Assembly, dead: Loads, live: Array, model: dict[str, Any]) -> None:
        """Scale the live loads to one size, so that directions are comparable.

        Parameters
        ----------
        dead : whose live part is not used
        live : wrenches of all live loads [N, N m], shape (k, n_blocks, 6)
        model : keywords of :func:`make_problem`
        """
        # without a dead load the least live load takes its place
        sizes = np.abs(live).sum(axis=(1, 2))
        self.unit = max(float(np.abs(dead.dead[~assembly.fixed]).sum()), float(sizes.min())) / sizes
        self.live, self.dead, self.assembly = live, dead, assembly
        scaled = live * self.unit[:, None, None]
        self.problem = make_problem(assembly, Loads(dead.dead, scaled[0]), cases=scaled[1:], **model)
        self.opening: tuple[Array, ...] | None = None

    def __call__(self, direction: Array, within: Array | None) -> _Farthest:
        """Largest multipliers in a direction.

        Parameters
        ----------
        direction : of the multipliers [-], shape (k,)
        within : their largest sizes [-], shape (k,); None for no limit
        """
        status = ""
        for p in (self.problem, balanced(self.problem)):
            scale = self.unit * p.live_scale  # multiplier = scaled multiplier * scale
            towards = direction * scale / np.linalg.norm(direction * scale)
            limits = None if within is None else within / scale
            solution = solve_static(p, make_cones(p), direction=towards, within=limits)
            status = str(solution.status)
            y = scale * np.array([solution.multiplier, *solution.free])
            if status == Status.UNBOUNDED:
                return _Farthest(status, y, forces=None, half_plane=None)
            if status == Status.CANNOT_STAND:
                return _Farthest(status, y, forces=None, half_plane=self.half_plane(p, solution.velocity))
            if status in (Status.SOLVED, Status.ALMOST_SOLVED):
                forces = self.certified(p, y, solution.force)
                plane = self.half_plane(p, solution.velocity)
                if forces is not None:
                    return _Farthest(Status.SOLVED, y, forces, plane)
        raise NotConverged(f"the program of direction {direction.round(4).tolist()} ended {status!r} without forces")

    def certified(self, p: Problem, y: Array, scaled: Array) -> Resultants | None:
        """Forces that carry multipliers y, shape (k,), by their own certificate, or None.

        Parameters
        ----------
        p : the problem in some scaling
        y : multipliers [-]
        scaled : forces of p [-], shape (c m,)
        """
        loads = Loads(self.dead.dead, np.tensordot(y, self.live, 1))
        forces = p.resultants(p.forces(scaled))
        # without dead load there is no load to measure the unbalance by at multipliers of zero: taken as they are
        if not self.dead.dead.any():
            return forces
        # ``loads`` hold the multipliers already, so that theirs is one
        state = Prediction(
            method="", collapse_multiplier=1.0, bound=Bound(BoundKind.NONE), status=Status.SOLVED, resultants=forces,
            **p.contact_facts,
        )
        found = certify(self.assembly, loads, state)
        return forces if max(found.block_residual, found.joint_excess) <= OWN_RESIDUAL else None

    def half_plane(self, p: Problem, velocity: Array) -> HalfPlane | None:
        """What a motion v proves: sum of lambda_k w_k . v <= D(v) - w . v, or None.

        D is the power that the joints dissipate, w the dead load. The motion is first repaired to obey the flow rule.
        A motion on which no load works has a normal of zeros: a negative offset then proves that the set is empty.

        Parameters
        ----------
        p : the problem in some scaling
        velocity : dual of the equilibrium rows of p, shape (r,)
        """
        twists = np.where(self.assembly.held, 0.0, p.twists(velocity))
        rate = np.tensordot(self.live, twists, 2)  # power of every live load, (k,)
        size = float(np.linalg.norm(rate * self.unit))
        # the certificate wants loads that do work on the motion: those of the normal, or the dead load alone
        works = size > NO_WORK * np.abs(twists).max() * np.abs(self.dead.dead).sum()
        load = np.tensordot(rate * self.unit**2, self.live, 1) if works else self.dead.dead
        dead = self.dead.dead if works else 0.0 * load
        if self.opening is None:
            motion = opening_motion(p)[0]
            self.opening = () if motion is None else (p.twists(motion),)
        k = p.proven_by(Loads(dead, load), twists, self.opening)
        if k.twists is None or not math.isfinite(k.multiplier):
            return None
        # multiplier times power = D(v) - w . v; where the dead load is the load itself w . v is still to be taken off
        power = float((load * k.twists).sum())
        offset = k.multiplier * power - (0.0 if works else power)
        normal = np.tensordot(self.live, k.twists, 2)
        size = float(np.linalg.norm(normal)) if works else 1.0
        return HalfPlane(normal / size, offset / size, k.twists)


def _names(cases: Sequence[Loads]) -> tuple[str, ...]:
    """Name of every load case, no two alike: axes and columns go by it."""
    names: list[str] = []
    for k, case in enumerate(cases):
        name = case.name or f"case {k}"
        numbered = (f"{name} ({n})" for n in itertools.count(2))
        names.append(next(one for one in itertools.chain([name], numbered) if one not in names))
    return tuple(names)


def _closed(
    support: _Support, names: tuple[str, ...], tolerance: float, within: Array | None, most: int
) -> LoadRegion:
    """Region of the multipliers that are carried, from its extreme points.

    It asks ``support`` for the farthest point and half-plane along directions from the inner set (hull of the points
    found) to corners of the outer one (all half-planes together). It ends when the gap over the size is at most
    ``tolerance``, no direction is new, or more than ``most`` programs beside those along the axes would be needed.

    Parameters
    ----------
    names : of the loads
    tolerance : largest distance of an outer corner from the inner set, over the diameter of that [-]
    within : largest sizes of the multipliers [-], shape (k,), or None
    most : programs at most, beside those along the axes
    """
    k = len(names)
    axes = [sign * np.eye(k)[i] for i in range(k) for sign in (1.0, -1.0)]
    first = [support(d, within) for d in axes]
    if within is None and any(found.status == Status.UNBOUNDED for found in first):
        within = _far(first, support.unit)
        first = [support(d, within) for d in axes]
    planes = [found.half_plane for found in first if found.half_plane is not None]
    if within is None and not positively_spans(np.array([p.normal for p in planes]).reshape(-1, k)):
        # of wedged blocks no motion proves an end: the set is cut there too, and stays open
        within = _far(first, support.unit)
    limits = np.full(k, np.inf) if within is None else within
    if any(found.status == Status.CANNOT_STAND for found in first):
        # empty where a half-plane lies wholly beyond the box of multipliers that were asked for; without such limits
        # the program is infeasible whatever the multipliers, so that the normal is zero but for rounding
        reach = np.where(np.isfinite(limits), limits, 0.0)
        proofs = [p.twists for p in planes if p.offset < -float(np.abs(p.normal) @ reach)]
        if not proofs:
            raise NotConverged("no multipliers are carried, by the solver; no motion was found that proves it")
        return LoadRegion(
            names=names, status="empty", corners=np.zeros((0, k)), forces=(), outside=tuple(planes), gap=math.nan,
            within=limits, proof=proofs[0],
        )
    if within is not None:
        planes += [HalfPlane(d, float(within @ np.abs(d)), None) for d in axes]
    carried = [(found.multipliers, found.forces) for found in first if found.forces is not None]
    asked: list[Array] = []
    while True:
        inner = np.array([multipliers for multipliers, _ in carried])
        # distances are measured over the extents of the inner set, so that no case drowns another
        extent = np.maximum(np.ptp(inner, axis=0), FLAT * support.unit)
        outwards, gap = _outwards(inner, planes, extent, tolerance)
        fresh = [d for d in outwards if not any(np.linalg.norm(d - old) < SAME_DIRECTION for old in asked)]
        if gap <= tolerance or not fresh or len(asked) + len(fresh) > most:
            break
        for d in fresh:
            asked.append(d)
            found = support(d, within)
            if found.forces is not None:
                carried.append((found.multipliers, found.forces))
            if found.half_plane is not None:
                planes.append(found.half_plane)
    keep = extreme_points(inner / extent)  # no corner has come since: the search ends before it asks
    return LoadRegion(
        names=names, status="closed" if gap <= tolerance else "not closed", corners=inner[keep],
        forces=tuple(carried[i][1] for i in keep), outside=tuple(planes), gap=gap, within=limits,
    )


def _far(first: list[_Farthest], unit: Array) -> Array:
    """Multipliers certainly far from the origin, at which a set is cut [-], shape (k,).

    They are at least those at which a load is as large as the dead one, ``unit`` (k,). ``first`` are the farthest
    points along the axes.
    """
    ends = [np.abs(found.multipliers) for found in first if found.status == Status.SOLVED]
    return np.maximum(FAR * np.max(ends, axis=0), unit) if ends else FAR * unit


def _outwards(inner: Array, planes: list[HalfPlane], extent: Array, tolerance: float) -> tuple[list[Array], float]:
    """Where the outer set stands out of the inner one: directions, and the gap [-].

    The gap is the largest distance of a corner of the outer set from the inner one, over the diameter of that.

    Parameters
    ----------
    inner : corners of the inner set [-], shape (m, k)
    planes : of the outer set
    extent : multipliers that distances are measured by [-], shape (k,)
    tolerance : part of the diameter up to which a corner does not stand out [-]
    """
    # of a set that is a point but for rounding, as a cone without rays, the extents themselves are the measure
    size = max(float(np.linalg.norm(np.ptp(inner / extent, axis=0))), 1.0)
    normal, offset = np.array([p.normal for p in planes]) * extent, np.array([p.offset for p in planes])
    far = corners_of_half_spaces(normal, offset, inner / extent)
    foot = np.array([nearest_in_hull(inner / extent, w) for w in far])  # of every outer corner on the inner set
    away = np.linalg.norm(far - foot, axis=1) if len(far) else np.zeros(0)
    # (w - f) is the normal of the inner set in multipliers over the extent: in multipliers it is over the extent again
    normals = [(w - f) / extent for w, f, a in zip(far, foot, away, strict=True) if a > tolerance * size]
    return [n / np.linalg.norm(n) for n in normals], float(away.max(initial=0.0)) / size
