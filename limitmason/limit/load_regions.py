"""Loads that are safe at once: a convex set between corners with forces and half-planes with mechanisms."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.acceptance import OWN_RESIDUAL
from limitmason.answers.results import Bound, BoundKind, Prediction, Resultants, Status
from limitmason.arrays import Array
from limitmason.checks import numbers, positive, several
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError, NotConverged
from limitmason.geometry.convex_set import corners_of_half_spaces, extreme_points, extreme_rays, nearest_in_hull
from limitmason.limit.program.cones import make_cones
from limitmason.limit.program.problem import Problem, make_problem
from limitmason.limit.program.scaling import balanced
from limitmason.limit.program.static import opening_motion, solve_static
from limitmason.limit.range.bracket import inside
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.contact_points import chosen_grid
from limitmason.mechanics.law_table import refuse
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.files import write_text

FLAT = 1e-3
"""Least extent of a set that its gap is measured by, over the multiplier at which a load is as large as the dead."""


class HalfPlane(NamedTuple):
    """Loads that a mechanism does not let pass.

    normal . multipliers <= offset, for a unit normal.
    """

    normal: Array
    offset: float
    twists: Array | None  # of the mechanism, (n_blocks, 6); None for a limit of what was asked


@dataclass(frozen=True, eq=False)
class LoadRegion(Displayed):
    """Set of multipliers that a structure carries at once, from inside and outside.

    Parameters
    ----------
    names : of the load cases
    status : "closed" within the tolerance, "not closed", or "empty": no multipliers within the limits are carried
    corners : multipliers with forces that carry them; all between them are carried too [-], shape (m, k)
    forces : joint forces at every corner
    outside : half-planes that no carried load leaves, each with its mechanism
    gap : largest distance of an outer corner from the inner set, over the diameter of the inner set, in multipliers
        over their extents [-]; of an empty set NaN
    cone : directions in which the set has no end, unit rays whose cone it is, shape (r, k); none where it is bounded
    within : sizes of the multipliers beyond which nothing was asked, shape (k,); infinite where none was needed
    proof : of an empty set: the motion in which the dead load does more work than the joints dissipate, whatever the
        multipliers
    certain : for psi < phi, the set of joints with friction psi: what it holds is carried by every flow rule between
        psi and phi, and what this set does not hold by none (Radenkovic); None where psi = phi
    """

    names: tuple[str, ...]
    status: str
    corners: Array
    forces: tuple[Resultants, ...]
    outside: tuple[HalfPlane, ...]
    gap: float
    within: Array
    cone: Array = field(default_factory=lambda: np.zeros((0, 0)))
    proof: Array | None = None
    certain: LoadRegion | None = None

    def contains(self, multipliers: Sequence[float]) -> bool | None:
        """Whether the structure carries these multipliers, None where neither is proven.

        It is True where forces carry them and False where a mechanism moves. Between the two sets it is None.
        Beyond ``within`` it is None too, where the cone does not reach.
        """
        y = numbers("multipliers", multipliers)
        if y.shape != (len(self.names),) or not np.isfinite(y).all():
            raise InputError(f"multipliers: give one for each of {' and '.join(self.names)}, got {multipliers!r}")
        if any(p.twists is not None and p.normal @ y > p.offset for p in self.outside):
            return False
        if not len(self.corners):
            return None
        size = np.abs(self.corners).max(axis=0) + np.abs(self.corners).max() * 1e-12
        cone = self.cone / size if len(self.cone) else None
        return True if np.linalg.norm(y / size - nearest_in_hull(self.corners / size, y / size, cone)) <= 1e-9 else None

    def to_json(self, path: str | Path) -> None:
        """Write corners, half-planes, cone and gap to a file."""
        planes = [{"normal": p.normal.tolist(), "offset": p.offset, "limit": p.twists is None} for p in self.outside]
        kept = {
            "cases": self.names, "status": self.status, "corners": self.corners.tolist(), "outside": planes,
            "gap": None if math.isnan(self.gap) else self.gap, "cone": self.cone.tolist(),
        }
        write_text(path, json.dumps(kept, indent=1) + "\n")

    def __str__(self) -> str:
        """Status, counts and gap."""
        text = f"safe loads {' and '.join(self.names)}: {self.status}"
        if self.status == "empty":
            return text
        rays = "one ray" if len(self.cone) == 1 else f"{len(self.cone)} rays"
        unbounded = f", unbounded along {rays}" if len(self.cone) else ""
        text = f"{text}, {len(self.corners)} corners, {len(self.outside)} half-planes, gap {self.gap:.1e}{unbounded}"
        if self.certain is None:
            return text
        count = len(self.certain.corners)
        return f"{text}; by every flow rule from psi to phi: {f'{count} corners' if count else self.certain.status}"


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
    most : programs that are solved at most
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
    if dead.live.any():
        raise InputError("dead: its live part has no role in a region; give it as a case")
    positive("tolerance", tolerance)
    limit = None if within is None else np.array([positive("within", v) for v in np.atleast_1d(within).tolist()])
    if limit is not None and len(limit) not in (1, len(cases)):
        raise InputError(f"within: give one size, or one for each of the {len(cases)} cases, got {within!r}")
    limit = None if limit is None else np.broadcast_to(limit, (len(cases),))
    for number, case in enumerate([dead, *cases], -1):
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
        return _closed(_Support(made, dead, live, model), names, tolerance, limit, most)

    found = region(assembly, dead, limit)
    if np.isfinite(found.within).any() and len(found.corners):
        # the region has no end and was cut at ``within``. Its endless directions are the region without dead load and
        # strengths, which is a cone; cut at 1, its corners away from the origin lie on the rays
        homogeneous = region(assembly.with_joints(_endless), replace(dead, dead=0.0 * dead.dead), np.ones(len(cases)))
        size = np.linalg.norm(homogeneous.corners, axis=1)
        rays = homogeneous.corners[size > 1e-6] / size[size > 1e-6, None]
        found = replace(found, cone=extreme_rays(rays))
    if any(i.joint.tan_psi < i.joint.tan_phi for i in assembly.interfaces):
        # with friction tan(psi) the same motions are associative: what lies inside is safe for any flow rule
        reduced = assembly.with_joints(inside)
        # cut where the region was
        same = found.within if np.isfinite(found.within).all() else limit
        found = replace(found, certain=region(reduced, dead, same))
    return found


def _endless(joint: Joint) -> Joint:
    """The joint without strengths that a load that grows without end would leave behind."""
    crushes = math.isfinite(joint.compressive_strength)
    return Joint(0.0 if crushes else joint.friction_angle_deg, compressive_strength=joint.compressive_strength)


class _Support:
    """Largest multipliers in a direction, with the forces at them and the half-plane of their mechanism."""

    def __init__(self, assembly: Assembly, dead: Loads, live: Array, model: dict[str, Any]) -> None:
        """Scale the live loads to one size, so that directions of multipliers are comparable.

        Parameters
        ----------
        live : wrenches of all live loads [N, N m], shape (k, n_blocks, 6)
        model : keywords of :func:`make_problem`
        """
        sizes = np.abs(live).sum(axis=(1, 2))
        self.unit = max(float(np.abs(dead.dead[~assembly.fixed]).sum()), float(sizes.min())) / sizes
        self.live, self.dead, self.assembly = live, dead, assembly
        scaled = live * self.unit[:, None, None]
        self.problem = make_problem(assembly, Loads(dead.dead, scaled[0]), cases=scaled[1:], **model)
        self.solved = 0
        self.opening: tuple[Array, ...] | None = None

    def __call__(
        self, direction: Array, within: Array | None
    ) -> tuple[str, Array, Resultants | None, HalfPlane | None]:
        """Largest multipliers in a direction.

        Parameters
        ----------
        direction, within : of the multipliers, and their largest sizes or None, shape (k,) [-]

        Returns
        -------
        status, multipliers, forces, half_plane : forces None without a certificate, half_plane None without a proof
        """
        self.solved += 1
        status = ""
        for p in (self.problem, balanced(self.problem)):
            scale = self.unit * p.live_scale  # multiplier = scaled multiplier * scale
            h = direction * scale / np.linalg.norm(direction * scale)
            limits = None if within is None else within / scale
            solution = solve_static(p, make_cones(p), direction=h, within=limits)
            status = str(solution.status)
            y = scale * np.array([solution.multiplier, *solution.free])
            if status in (Status.UNBOUNDED, Status.CANNOT_STAND):
                return status, y, None, self.half_plane(p, solution.velocity) if status == Status.CANNOT_STAND else None
            if status in (Status.SOLVED, Status.ALMOST_SOLVED):
                forces = self.certified(p, y, solution.force)
                plane = self.half_plane(p, solution.velocity)
                if forces is not None:
                    return Status.SOLVED, y, forces, plane
        raise NotConverged(f"the program of direction {direction.round(4).tolist()} ended {status!r} without forces")

    def certified(self, p: Problem, y: Array, scaled: Array) -> Resultants | None:
        """Forces that carry multipliers y, shape (k,), by their own certificate, or None.

        Parameters
        ----------
        scaled : forces of the scaled problem p
        """
        loads = Loads(self.dead.dead, np.tensordot(y, self.live, 1))
        forces = p.resultants(p.forces(scaled))
        if not self.dead.dead.any():
            return forces  # of a cone, whose apex has no load to measure what is left by: rays as the solver has them
        state = Prediction("", 1.0, Bound(BoundKind.NONE), Status.SOLVED, None, forces, **p.contact_facts)
        found = certify(self.assembly, loads, state)
        return forces if max(found.block_residual, found.joint_excess) <= OWN_RESIDUAL else None

    def half_plane(self, p: Problem, velocity: Array) -> HalfPlane | None:
        """What a motion, as repaired, proves of all loads.

        It is None where the motion proves nothing.

        A motion on which no load works has a normal of zeros: a negative offset then proves that the set is empty.

        Parameters
        ----------
        velocity : dual of the equilibrium rows of p
        """
        twists = np.where(self.assembly.held, 0.0, p.twists(velocity))
        rate = np.tensordot(self.live, twists, 2)
        size = float(np.linalg.norm(rate * self.unit))
        # the certificate wants loads that do work on the motion: those of the normal, or the dead load alone
        works = size > 1e-6 * np.abs(twists).max() * np.abs(self.dead.dead).sum()
        load = np.tensordot(rate * self.unit**2, self.live, 1) if works else self.dead.dead
        dead = self.dead.dead if works else 0.0 * load
        if self.opening is None:
            motion = opening_motion(p)[0]
            self.opening = () if motion is None else (p.twists(motion),)
        k = p.proven_by(Loads(dead, load), twists, self.opening)
        if k.twists is None or not math.isfinite(k.multiplier):
            return None
        offset = k.multiplier * float((load * k.twists).sum()) - (0.0 if works else float((load * k.twists).sum()))
        normal = np.tensordot(self.live, k.twists, 2)
        size = float(np.linalg.norm(normal)) if works else 1.0
        return HalfPlane(normal / size, offset / size, k.twists)


def _names(cases: Sequence[Loads]) -> tuple[str, ...]:
    """Name of every load case, no two alike: axes of a figure and columns of a file are told apart by it."""
    told = [c.name or f"case {k}" for k, c in enumerate(cases)]
    before = [told[:k].count(name) for k, name in enumerate(told)]
    return tuple(f"{name} ({n + 1})" if n else name for name, n in zip(told, before, strict=True))


def _closed(
    support: _Support, names: tuple[str, ...], tolerance: float, within: Array | None, most: int
) -> LoadRegion:
    """Region of the multipliers that are carried, from its extreme points.

    It asks ``support`` for the farthest point and half-plane along directions from the inner set to corners of the
    outer one. It ends when the gap over the size is at most ``tolerance``, no direction is new, or more than ``most``
    programs would be needed.

    Parameters
    ----------
    names, within : of the loads, and the largest sizes of their multipliers, shape (k,), or None [-]
    """
    k = len(names)
    axes = [sign * np.eye(k)[i] for i in range(k) for sign in (1.0, -1.0)]
    first = [support(d, within) for d in axes]
    if within is None and any(status == Status.UNBOUNDED for status, *_ in first):
        ends = [np.abs(y) for status, y, *_ in first if status == Status.SOLVED]
        within = np.maximum(10.0 * np.max(ends, axis=0), support.unit) if ends else 10.0 * support.unit
        first = [support(d, within) for d in axes]
    planes = [p for *_, p in first if p is not None]
    limits = np.full(k, np.inf) if within is None else within
    if any(status == Status.CANNOT_STAND for status, *_ in first):
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
    corners, forces = [y for _, y, *_ in first], [f for _, _, f, _ in first if f is not None]
    asked: list[Array] = []
    gap = math.inf
    while True:
        inner = np.array(corners)
        extent = np.maximum(np.ptp(inner, axis=0), FLAT * support.unit)
        size = float(np.linalg.norm(np.ptp(inner / extent, axis=0)))
        # where the outer set stands out of the inner one: its corners, and the nearest points of the inner set
        normal, offset = np.array([p.normal for p in planes]) * extent, np.array([p.offset for p in planes])
        far = corners_of_half_spaces(normal, offset, inner / extent)
        foot = np.array([nearest_in_hull(inner / extent, w) for w in far])
        away = np.linalg.norm(far - foot, axis=1) if len(far) else np.zeros(0)
        gap = float(away.max(initial=0.0)) / size
        # outwards from there, as directions of the multipliers themselves
        fresh = [
            (w - f) / extent / np.linalg.norm((w - f) / extent)
            for w, f, a in zip(far, foot, away, strict=True) if a > tolerance * size
        ]
        fresh = [d for d in fresh if not any(np.linalg.norm(d - old) < 1e-9 for old in asked)]
        if gap <= tolerance or not fresh or support.solved + len(fresh) > most:
            break
        for d in fresh:
            asked.append(d)
            _, y, force, plane = support(d, within)
            if force is not None:
                corners.append(y)
                forces.append(force)
            planes += [] if plane is None else [plane]
    keep = extreme_points(np.array(corners) / extent)
    return LoadRegion(
        names=names, status="closed" if gap <= tolerance else "not closed", corners=np.array(corners)[keep],
        forces=tuple(forces[i] for i in keep), outside=tuple(planes), gap=gap, within=limits,
    )
