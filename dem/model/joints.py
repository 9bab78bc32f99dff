"""From the joint laws of an assembly to the arrays of the kernel: stiffness defaults, softening, contact points."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.kernels import LAW, Joints, Points
from limitmason.arrays import Array
from limitmason.checks import numbers, positive
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.contact_points import LOBATTO, LOBATTO_POINTS, ContactPoints, contact_points
from limitmason.mechanics.default_stiffness import default_stiffness, missing_stiffness
from limitmason.mechanics.law import LOST, SUDDEN, PointLaw, peak_law, softening
from limitmason.mechanics.model_notes import lost_in_failure
from limitmason.mechanics.plane import Plane
from limitmason.model import Assembly, LostBy, Unloading
from limitmason.model.joint_term import name_of

PER_POINT = 420
"""Bytes of a contact point at the most, its part of joint and blocks included: 360 from 1,000 to 100,000 bricks."""

FREE = 0.9
"""Share of the machine's memory that a model may take [-]."""

PerJoint = float | Mapping[str, float] | Sequence[float] | Array


@dataclass(frozen=True)
class JointOptions:
    """What the joint law needs beyond ``limitmason.Joint``.

    One value, one by kind of joint, or one per interface.

    Parameters
    ----------
    dilatant_slip : plastic slip up to which a joint dilates [m]; infinite by default. Sliding back closes the joint
        again; contacts that are cut anew (:mod:`dem.contact.detection`) keep their lift and start their slip at nothing
    softening_slip : plastic slip (or crack opening) over which c, ft, phi and psi go linearly to their residual
        values [m]; 0 is a brittle drop; only joints with residual values soften, and those with fracture energies of
        their own take no other length
    residual_dilatancy_angle_deg : psi after softening [deg]; None keeps psi
    stiffness_factor : multiplies kn and ks of every joint [-]
    shear_factor : multiplies ks of every joint once more [-]
    dashpot : viscous over elastic contact stiffness [s], 0 for none. None is none in quasi-static runs and, with real
        masses, what damps the fastest motion of a block by a tenth of critical. It acts in closed joints only, so that
        free flight loses nothing, and together with the spring inside Coulomb's law

    Notes
    -----
    Restitution is no number of its own here but follows from the dashpot. A face that lands flat rebounds with
    e = exp(-2 z / s atan2(s, z)), s = sqrt(1 - z^2), z = dashpot / 2 sqrt(kn A / m), for z < 1 (spring and dashpot
    that do not pull). A block that rocks from edge to edge (half base b, half height h) keeps the part
    r(x) = (J - m b x) / (J + m b x), J = m (b^2 + h^2) / 3 + m h^2, of its spin, x the place of the impulse: angular
    momentum about it is kept. Housner's 1 - 3/2 sin^2(alpha) is r(b), the impulse all at the new edge, the least that
    can be left. Points between the edges take a part of it, so that x < b and more is left, never more than r(0) = 1:
    with two points across the rocking direction, or contact_model="vertices", and z of 1 or so the impact is
    Housner's. In between it depends on the points and the dashpot, as it does on the unevenness of a real joint.
    """

    dilatant_slip: PerJoint = np.inf
    softening_slip: PerJoint = 0.0
    residual_dilatancy_angle_deg: PerJoint | None = None
    stiffness_factor: float = 1.0
    shear_factor: float = 1.0
    dashpot: PerJoint | None = None


def per_interface(value: PerJoint, kinds: Sequence[str], label: str) -> Array:
    """One number per interface, shape (k,), from what a user may give.

    Parameters
    ----------
    value : a scalar, a mapping by kind of joint, or one number per interface
    kinds : kind of every interface
    label : name of the option, for errors

    Raises
    ------
    InputError
        For a kind without an entry, a negative number or NaN, and more or fewer numbers than interfaces.
    """
    if isinstance(value, Mapping):
        missing = set(kinds) - set(value)
        if missing:
            raise InputError(f"{label} has no entry for joints of kind {sorted(missing)[0]!r}")
        out = numbers(label, [value[k] for k in kinds])
    else:
        out = numbers(label, value)
        if out.shape not in ((), (1,), (len(kinds),)):
            raise InputError(f"{label} must be one number, or {len(kinds)}, one for each interface")
        out = np.broadcast_to(out, (len(kinds),)).copy()
    if np.isnan(out).any() or (out < 0).any():
        raise InputError(f"{label} must not be negative or NaN")
    return out


def law_at(rows: Array, damage: Array, slip: Array) -> PointLaw:
    """Strengths [Pa] and tangents of angles of points in their state.

    They lie between peak and residual values.

    Parameters
    ----------
    rows : the kernel's rows of the law of every point's joint, shape (m, LAW_SIZE)
    damage : of the points, 0 to 1 [-], shape (m,)
    slip : size of their plastic slip [m], shape (m,)
    """
    # fc from the closing fc / kn
    crushing = rows[:, LAW.crushing] * rows[:, LAW.kn]
    peak, rest = (
        PointLaw(crushing=crushing, **{name: rows[:, getattr(LAW, of + name)] for name in LOST}) for of in ("", "rest_")
    )
    law = peak.towards(rest, damage)
    # added terms, whose first column says whether a joint has them, change the first four: angles, c and ft
    for name, own in kernels.COLUMNS.items():
        for k in np.flatnonzero(rows[:, own.start]):
            worn = kernels.ADDED[name].strength(*(column[k] for column in law[:4]), slip[k], damage[k],
                                                *rows[k, own.start + 1 : own.stop])
            for column, value in zip(law[:4], worn, strict=True):
                column[k] = value
    return law


def losses(assembly: Assembly, laws: Array) -> tuple[str, ...]:
    """What the joints lose where they fail, in words.

    ``laws`` are the kernel's rows of all interfaces, with which a run goes, shape (k, LAW_SIZE).
    """
    # opening over which strength is lost [m]; 0 where none is, and where it is lost at once
    rate = laws[:, LAW.by_opening]
    length = np.divide(1.0, rate, out=np.zeros(len(rate)), where=(rate > 0.0) & (rate < SUDDEN))
    return lost_in_failure(assembly, length)


Grid = tuple[int, int] | float | Mapping[str, tuple[int, int]]


VERTICES = "vertices"
"""Contact model of the corners of every interface alone."""

DEFAULT_POINTS = (4, 8)
"""Contact points along the unit and across the thickness, unless told or joints crush."""


def chosen_points(assembly: Assembly, grid: Grid | None, contact_model: str | None) -> tuple[Grid, str]:
    """Contact points and model that are asked for, else those that the joints need.

    A section that crushes bears -13 to +11 % on the lattice of the default, on points that crowd towards the edges 1 %.

    Parameters
    ----------
    assembly : whose joints may crush
    grid, contact_model : what is asked for, None for what the joints need

    Raises
    ------
    InputError
        For points that are asked for beside corners alone, which would not use them.
    """
    if grid is not None and contact_model == VERTICES:
        raise InputError(
            f"contact_points={grid!r} are not used by contact_model={contact_model!r}: give contact_model='grid'"
        )
    crushes = bool(np.isfinite(assembly.arrays.compressive_strength).any())  # infinite where a joint never does
    if contact_model is None:
        contact_model = LOBATTO if grid is None and crushes else "grid"
    if grid is None:
        return (LOBATTO_POINTS, LOBATTO_POINTS) if contact_model == LOBATTO else DEFAULT_POINTS, contact_model
    return grid, contact_model


def memory_of_machine() -> float:
    """Memory of the machine [bytes], infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return np.inf


def refuse_too_large(assembly: Assembly, grid: object) -> None:
    """Refuse a model whose contact points do not fit into memory.

    Where a spacing is given their number is not known, and none is refused.

    Parameters
    ----------
    assembly : whose interfaces get the points, but for those between held blocks
    grid : points along and across every joint, one pair or one by kind

    Raises
    ------
    InputError
        With the number of points, the memory that they take, and what the machine has.
    """
    x = assembly.arrays
    moves = ~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b])
    if isinstance(grid, Mapping):
        each = np.array([float(np.prod(grid.get(i.kind, (0, 0)))) for i in assembly.interfaces])
    elif isinstance(grid, tuple):
        each = np.full(len(moves), float(np.prod(grid)))
    else:
        return
    points = float(each[moves].sum())
    need, have = PER_POINT * points, memory_of_machine()
    if need > FREE * have:
        raise InputError(
            f"{points:.0f} contact points on {int(moves.sum())} joints take {need / 1e9:.2g} GB, the machine has "
            f"{have / 1e9:.2g} GB: give fewer contact_points, or fewer blocks"
        )


def make_points(assembly: Assembly, grid: Grid, contact_model: str, plane: Plane | None = None) -> ContactPoints:
    """Contact points of the interfaces that touch a free block, in their order.

    Parameters
    ----------
    grid, contact_model : see :func:`limitmason.mechanics.contact_points.contact_points`
    plane : of a plane problem, on which one row of points lies; None in space
    """
    refuse_too_large(assembly, grid)
    return contact_points(
        assembly, contact_model=contact_model, grid=grid, plane=plane, elastic=True, called="contact_points"
    )


def make_joints(
    assembly: Assembly, dead: Array, contacts: ContactPoints, options: JointOptions
) -> tuple[Points, Joints, NDArray[np.int64], Array, tuple[str, ...]]:
    """Kernel arrays of the joints in the reference position.

    Parameters
    ----------
    dead : wrench per block [N, N m], shape (n, 6), for the stiffness of joints that have none
    contacts : contact points, sorted by interface
    options : what the joint law needs beyond the assembly's joints

    Returns
    -------
    points, joints : without slip, opening and damage
    interface : interface number of every joint, shape (k,)
    laws : of all interfaces, shape (all, LAW_SIZE)
    warnings : what a user should know about them
    """
    x = assembly.arrays
    interface, first = np.unique(contacts.interface, return_index=True)
    start = np.concatenate([first, [contacts.count]]).astype(np.int64)
    local = contacts.position - x.centre[contacts.interface]
    zero = np.zeros(contacts.count)
    points = Points(
        s=(local * x.tangent_1[contacts.interface]).sum(axis=1),
        t=(local * x.tangent_2[contacts.interface]).sum(axis=1), area=contacts.area.copy(), gap=zero,
        slip_1=zero.copy(), slip_2=zero.copy(), lift=zero.copy(), damage=zero.copy(),
    )
    a, b = x.block_a[interface].astype(np.int64), x.block_b[interface].astype(np.int64)
    frame = np.stack([x.tangent_1[interface], x.tangent_2[interface], x.normal[interface]], axis=1)
    turn = np.zeros((len(interface), 4))
    turn[:, 0] = 1.0
    law, warnings = make_laws(assembly, dead, options)
    joints = Joints(
        block_a=a, block_b=b, start=start, frame=np.ascontiguousarray(frame), turn=turn,
        arm_a=x.centre[interface] - x.centroid[a], arm_b=x.centre[interface] - x.centroid[b],
        offset=np.zeros((len(interface), 3)), law=np.ascontiguousarray(law[interface]),
        edge=np.zeros((len(interface), 3)), limits=np.zeros((len(interface), 4)),
    )
    return points, joints, interface.astype(np.int64), law, warnings


def make_laws(assembly: Assembly, dead: Array, options: JointOptions) -> tuple[Array, tuple[str, ...]]:
    """Law rows of the kernel for all interfaces, shape (k, LAW_SIZE), and warnings.

    Tension counts up to ft where ft > c / tan(phi) too, unlike in limit analysis, which cuts it at the cone's apex.

    Parameters
    ----------
    dead : wrench per block [N, N m], shape (n, 6), for the stiffness of joints that have none
    options : what the joint law needs beyond the assembly's joints
    """
    kinds = [i.kind for i in assembly.interfaces]
    laws = [i.joint for i in assembly.interfaces]
    warnings: list[str] = []
    standard = default_stiffness(assembly, dead)
    without = sum(j.normal_stiffness is None for j in laws)
    if without:
        warnings.append(missing_stiffness(without, len(laws), standard))
    dilatant = per_interface(options.dilatant_slip, kinds, "dilatant_slip")
    length = per_interface(options.softening_slip, kinds, "softening_slip")
    for joint, given in zip(laws, length, strict=True):
        if given > 0.0 and not (joint.fracture_energy_tension is None and joint.fracture_energy_shear is None):
            raise InputError(
                f"joint {joint.name!r} has a fracture energy of its own and softening_slip = {given:g} m: give one"
            )
    for name in ("stiffness_factor", "shear_factor"):
        positive(f"joint_options: {name}", getattr(options, name))
    dash = per_interface(0.0 if options.dashpot is None else options.dashpot, kinds, "dashpot")
    if not np.isfinite(dash).all():
        raise InputError("dashpot must be finite [s]: 0 takes it away, with 1e-3 or so little rebounds")
    later = options.residual_dilatancy_angle_deg
    # residual tan(psi)
    psi_r = None if later is None else np.tan(np.deg2rad(per_interface(later, kinds, "residual_dilatancy_angle_deg")))
    peak = peak_law(laws, convex=False)
    out = np.zeros((len(laws), kernels.LAW_SIZE))
    for k, joint in enumerate(laws):
        kn = (joint.normal_stiffness or standard) * options.stiffness_factor
        ks = joint.shear_stiffness
        ks = (kn if ks is None else ks * options.stiffness_factor) * options.shear_factor
        if not ks > 0.0:
            raise NotApplicable(f"joint of interface {k} has shear_stiffness 0: it must be positive in the DEM")
        out[k, [LAW.kn, LAW.ks]] = kn, ks
    rest, by_opening, by_slip = softening(laws, out[:, LAW.kn], out[:, LAW.ks], length, psi_r)
    if psi_r is not None:
        # psi alone falls too, but not where nothing is to be lost
        alone = (psi_r != peak.tan_psi) & (by_opening == 0.0) & [j.lost_by is not LostBy.NOTHING for j in laws]
        rate = np.divide(1.0, length, out=np.full(len(laws), SUDDEN), where=length > 0.0)
        by_opening, by_slip = np.where(alone, rate, by_opening), np.where(alone, rate, by_slip)
    for name in LOST:
        out[:, getattr(LAW, name)], out[:, getattr(LAW, f"rest_{name}")] = getattr(peak, name), getattr(rest, name)
    # fc as a closing, fc / kn, so that the kernel compares displacements
    out[:, LAW.crushing] = peak.crushing / out[:, LAW.kn]
    out[:, LAW.by_opening], out[:, LAW.by_slip], out[:, LAW.dash] = by_opening, by_slip, dash
    # a joint whose opening does no damage has lost no tension that could unload otherwise than by its stiffness
    out[:, LAW.secant] = (by_opening > 0.0) & [j.unloading is Unloading.SECANT for j in laws]
    # a joint that does not dilate is never lifted, for an infinite slip either
    out[:, LAW.lift] = peak.tan_psi * np.where(peak.tan_psi > 0.0, dilatant, 0.0)
    # of each term that was added to a joint's law a flag, and its numbers
    for row, joint in zip(out, laws, strict=True):
        for term in joint.terms:
            name = name_of(term)
            if name not in kernels.COLUMNS:
                raise InputError(f"term {name!r} of the joint law was registered after dem was imported: do so before")
            row[kernels.COLUMNS[name]] = 1.0, *term.numbers.values()
    return out, tuple(warnings)
