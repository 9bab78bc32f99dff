"""The state a simulation begins with: an assembly at rest in its reference position, free of stress."""

from __future__ import annotations

import numpy as np

from dem import kernels
from dem.kernels import BlockModes, Joints, Points, RigidBodies
from dem.model.edge_points import base_first
from dem.model.joints import DEFAULT_POINTS, Grid, JointOptions, chosen_points, make_joints, make_points
from dem.model.stable_step import SAFETY, block_stiffness, scaled_masses, stable_step
from dem.model.state import DYNAMIC, ENDS, QUASI_STATIC, State
from dem.model.strain_shapes import (
    Start,
    StrainShapes,
    coupled_of,
    fastest_of,
    out_of_plane,
    plane_of,
    scale_masses_of_modes,
)
from dem.model.tie_arrays import make_ties
from limitmason.arrays import Array, Flags, Index
from limitmason.checks import choice, instance, positive
from limitmason.deformable import SOLID
from limitmason.deformable.levels import RIGID, SIMPLY_DEFORMABLE
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import on_few_points
from limitmason.mechanics.joint_shapes import soft_block_warnings
from limitmason.mechanics.law_table import refuse_ties
from limitmason.mechanics.plane import Plane
from limitmason.model import Assembly, Loads

UNDER_CRITICAL = 0.1
"""Damping of the fastest motion of a block by the default dashpot, over critical [-]; chosen."""

EQUAL = 1e-9
"""Part by which two areas may differ by rounding and be equal."""

NO_SLOPE = 1e-12
"""Component of a unit vector below which it is rounding."""

VISCOSITY = 0.01
"""Adaptive viscosity at the start times the step: it adapts from there; chosen."""


def _real_masses(assembly: Assembly) -> tuple[Array, Array]:
    """Masses [kg], shape (n,), and inertia tensors [kg m2], (n, 3, 3), of all blocks.

    Held blocks may have none and get 1, which moves nothing. A free block without mass is refused.
    """
    mass, inertia = assembly.arrays.mass.copy(), assembly.arrays.inertia.copy()
    light = ~assembly.fixed & ~(mass > 0.0)
    if light.any():
        name = assembly.blocks[int(np.flatnonzero(light)[0])].name
        raise InputError(f"block {name!r} has no mass: a dynamic simulation needs a positive density")
    massless = ~(mass > 0.0)
    mass[massless], inertia[massless] = 1.0, np.eye(3)
    return mass, inertia


def _own_axes(points: Points, joints: Joints, n: int) -> Array:
    """Axes of the largest joint of every block, of equal ones the first, (n, 3, 3).

    Rows are t1, t2 and n. Along them blocks are damped: along axes of space an answer would hang on how the structure
    stands there. ``points`` and ``joints`` are all of them, n is the number of blocks.
    """
    axes, largest = np.tile(np.eye(3), (n, 1, 1)), np.zeros(n)  # area of the largest joint so far [m2]
    for j, area in enumerate(np.add.reduceat(points.area, joints.start[:-1])):
        for block in (joints.block_a[j], joints.block_b[j]):
            if area > largest[block] * (1.0 + EQUAL):
                axes[block], largest[block] = joints.frame[j], area
    axes[np.abs(axes) < NO_SLOPE] = 0.0
    return axes


def _at_rest(mass: Array, inertia: Array, held: Flags, axes: Array) -> RigidBodies:
    """Kernel arrays of the blocks, at rest in their reference position.

    Parameters
    ----------
    mass : [kg], shape (n,)
    inertia : about the centroid [kg m2], shape (n, 3, 3)
    held : degrees of freedom that are held, shape (n, 6)
    axes : rows along which blocks are damped, shape (n, 3, 3)
    """
    n = len(mass)
    zero, quat = np.zeros((n, 3)), np.zeros((n, 4))
    quat[:, 0] = 1.0
    return RigidBodies(
        shift=zero, quat=quat, rot=np.zeros((n, 3, 3)), vel=zero.copy(), spin=zero.copy(), ang=zero.copy(), mass=mass,
        inv_mass=1.0 / mass, inv_inertia=np.ascontiguousarray(np.linalg.inv(inertia)), held=held,
        contact=np.zeros((n, 6)), net=np.zeros((n, 6)), axes=axes,
    )


def _jointed(
    assembly: Assembly, loads: Loads, contact_points: Grid | None, contact_model: str | None, options: JointOptions,
    plane: Plane | None,
) -> tuple[tuple[Points, Joints, Index, Array, tuple[str, ...]], tuple[str, ...]]:
    """Joints of an assembly, and warnings of faces that have few contact points.

    Parameters
    ----------
    contact_points, contact_model, plane : as for :func:`initial_state`
    options : what the joint law needs beyond the assembly's joints

    Returns
    -------
    made : points, joints, interface of each, laws of all interfaces, and warnings, see :func:`make_joints`
    few : the warnings of few points
    """
    grid, model = chosen_points(assembly, contact_points, contact_model)
    coarse = model == "grid" and grid == DEFAULT_POINTS
    if coarse and contact_points is None and plane is not None:
        # a row of the default has as many points whichever way the plane lies to the units, as on a square column
        grid = (DEFAULT_POINTS[0],) * 2
    contacts = make_points(assembly, grid, model, plane)
    if not contacts.count:
        raise InputError("no joint touches a free block: there is nothing to settle on")
    made = make_joints(assembly, loads.dead, contacts, options)
    finer = "give contact_model='lobatto' and contact_points=(15, 15)"
    return made, on_few_points(assembly, finer, None if coarse else contacts)


def initial_state(
    assembly: Assembly,
    loads: Loads,
    *,
    contact_points: Grid | None = None,
    contact_model: str | None = None,
    joint_options: JointOptions | None = None,
    mode: str = QUASI_STATIC,
    dt: float | None = None,
    safety: float | None = None,
    plane: Plane | None = None,
    blocks: str = RIGID,
    stress: str = SOLID,
    driven: Array | None = None,
) -> State:
    """State of an assembly at rest in its reference position, free of stress.

    Parameters
    ----------
    loads : its dead loads set the default stiffness
    contact_points : points along the unit and across the thickness, one pair or one per kind of joint or per wall, or
        their largest spacing [m]; see :func:`limitmason.mechanics.contact_points.contact_points`. (4, 8) by default,
        where joints crush (15, 15) that crowd towards the edges
    contact_model : "grid", "lobatto" for points that crowd towards the edges, or "vertices" for the corners of every
        interface
    joint_options : what the joint law needs beyond the assembly's joints; its defaults by default
    mode : "quasi-static" scales mass and inertia so that every block is as fast as the step allows; "dynamic" keeps
        the real ones
    dt : [s]; None chooses 1 (quasi-static, where time has no meaning) or the stable step (dynamic)
    safety : fraction of the bound of the stable time step that is used; 0.65 by default, for the reason given at
        :data:`dem.model.stable_step.SAFETY`
    plane : of a plane problem whose normal is a global axis, from :func:`limitmason.mechanics.plane.find_plane`: one
        row of contact points lies on it, and every block is held in the motions out of it; found where ``stress`` asks
        for it
    blocks : "rigid", or "simply deformable": blocks with a material strain uniformly, bend and twist, see
        :func:`limitmason.deformable.simply_deformable_block`; blocks without one, and wholly held ones, stay rigid.
        Point loads and pressures strain it by its mean gradient, as if they were spread over it
    stress : "solid", "plane stress" or "plane strain"; simply deformable blocks only
    driven : twists that stages will prescribe, shape (k, 6); a plane found for ``stress`` holds them

    Raises
    ------
    InputError
        For an unknown mode, no free block, joints without stiffness, massless blocks in a dynamic run, and a given
        time step that is not positive or above the stable one.
    """
    choice("mode", mode, (QUASI_STATIC, DYNAMIC))
    dt = None if dt is None else positive("dt", dt)
    n, free = assembly.n_blocks, ~assembly.fixed
    if not free.any():
        raise InputError("every block is held: there is nothing to simulate")
    if blocks == SIMPLY_DEFORMABLE:
        refuse_ties(assembly, "a block that strains in modes", "use blocks='rigid'")
    needed = plane_of(assembly, loads, blocks, stress, driven)
    plane = needed if plane is None else plane
    held = assembly.held.copy()
    if plane is not None:
        held |= out_of_plane(plane)
    options = JointOptions() if joint_options is None else instance("joint_options", joint_options, JointOptions)
    (points, joints, interface, laws, warnings), few = _jointed(
        assembly, loads, contact_points, contact_model, options, plane
    )
    if mode == DYNAMIC:  # blocks that rock turn far
        points, joints = base_first(assembly, loads.dead, points, joints)
    ties, said = make_ties(assembly, options.stiffness_factor)
    warnings = (*warnings, *said, *few)
    # stiffness of every block alone, without motions that a plane problem does not have
    stiffness = block_stiffness(points, joints, n, ties=ties)
    moves = np.ones(6, dtype=bool) if plane is None else ~out_of_plane(plane)
    stiffness *= moves[:, None] & moves
    safety = SAFETY if safety is None else safety
    start = Start.of(assembly, stress, plane) if blocks == SIMPLY_DEFORMABLE else None
    if start is not None and (rigid := int(free.sum()) - len(start.shapes)):
        warnings = (*warnings, f"{rigid} of {int(free.sum())} free blocks have no material and stay rigid")
    warnings += soft_block_warnings(assembly, laws[:, kernels.LAW.kn], blocks)
    deformation: StrainShapes | None = None
    modes: BlockModes | None = None
    axes = _own_axes(points, joints, n)
    if mode == QUASI_STATIC:
        dt = 1.0 if dt is None else dt
        mass, inertia = scaled_masses(stiffness, dt, safety)
        if start is not None:
            coupled = coupled_of(start.deformation, points, joints, moves)
            deformation, modes = start.modes(assembly, points, joints, coupled, axes)
            scale_masses_of_modes(mass, inertia, modes, coupled_of(deformation, points, joints, moves), dt, safety)
    else:
        mass, inertia = _real_masses(assembly)
        top = 0.0  # half of the largest squared frequency of blocks that strain [1/s2]
        if start is not None:
            deformation, modes = start.modes(assembly, points, joints, None, axes)
            top = fastest_of(mass, inertia, modes, coupled_of(deformation, points, joints, moves))
        if options.dashpot is None:
            # part of critical damping z = dashpot w / 2 at the fastest motion w, for which the undamped step is 2 / w
            dash = UNDER_CRITICAL * stable_step(stiffness, mass, inertia, free, joints, safety=1.0, top=top)
            joints.law[:, kernels.LAW.dash] = laws[:, kernels.LAW.dash] = dash
        largest = stable_step(stiffness, mass, inertia, free, joints, safety=1.0, top=top)
        dt = safety * largest if dt is None else dt
        if dt > largest:
            raise InputError(f"dt = {dt:g} s is above the stable time step of {largest:g} s of these joints and masses")
    bodies = _at_rest(mass, inertia, held, axes)
    total = np.zeros(kernels.E_SIZE)
    total[kernels.E_VISCOSITY] = VISCOSITY / dt
    return State(
        points=points, joints=joints, bodies=bodies, interface=interface, total=total, time=0.0, dt=float(dt),
        mode=mode, laws=laws, contact=np.ones(len(interface), dtype=np.int64), dead=loads.dead.copy(),
        live=loads.live.copy(), dead_arms=loads.dead_arms.copy(), live_arms=loads.live_arms.copy(),
        factors=np.array((1.0, 1.0, 0.0, 0.0, 0.0)), ground=np.zeros(3), model=assembly.fingerprint,
        setback=np.zeros(len(points.s)), ends=np.full((len(points.s), ENDS), np.nan), outside=~moves,
        warnings=warnings, modes=modes, deformation=deformation, ties=ties,
    )
