"""Joints made while blocks move: on a face, at a corner, where edges cross.

Which pairs need one is found in ``dem.contact.detection``.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.contact.joint_renewal import pair_codes
from dem.contact.piece_contacts import least_area
from dem.kernels import CROSSING, E_DAMPING, E_KINETIC, LAW, ROOM, Cut, Heirs, Joints, Meetings, Points, Poses
from dem.kernels.cutting import LATTICE
from dem.model.stable_step import SAFETY, block_stiffness, points_of, scaled_masses, stable_step
from dem.model.state import DYNAMIC, State
from dem.model.strain_shapes import add_modal_mass, coupled_of, fastest_of, with_joints
from limitmason.arrays import Array, Flags, Index
from limitmason.model import Assembly

Number = TypeVar("Number", bound=np.generic)

SLACK = 1e-3
"""Part by which a step or a mass may miss what the joints ask for: rounding is no reason to change it [-]."""


class Fresh(NamedTuple):
    """Joints before they are written to the arrays of the kernel."""

    joints: Joints
    points: Points
    heirs: Heirs  # what else is known of them: the kernel that steps does not need it
    origin: Index  # as ``State.interface``, (k,)


def poses_of(assembly: Assembly, state: State) -> Poses:
    """Where the blocks of an assembly are, and the area that a corner takes [m2].

    Touching corners and crossing edges meet in a point; a stiffness per area needs an area all the same. It is assumed:
    that of an inner point of the lattice on a square face of the smaller block's volume, (V^(1/3) / 3)^2. Both have the
    same, so that no energy is lost where a corner slides off a face and two edges go on.
    """
    b = state.bodies
    area = (np.cbrt(assembly.volumes) / (LATTICE - 1)) ** 2
    return Poses(b.rot + np.eye(3), assembly.centroids + b.shift, b.quat, np.asarray(assembly.centroids), area)


def cut(
    assembly: Assembly, state: State, met: Meetings, rows: Index, blocks: tuple[Index, Index], like: Index
) -> tuple[Fresh, Index]:
    """Joints where some pairs of pieces meet, and which of the pairs have one.

    A face or a corner of block b lies on the plane of a face of block a, or two edges pass each other. A joint of
    passing edges carries no cohesion or tension and does not dilate: nothing was laid there.

    Parameters
    ----------
    assembly, state : blocks, and the state they are in
    met : how all pairs meet
    rows : pairs that get a joint, numbers in ``met``, shape (r,)
    blocks : a and b of each, shape (r,)
    like : joint whose law a pair without an interface takes, shape (r,): its own, or that on a face that goes on in
        this one; -1 for the interface on the nearest face of either block that looks the same way

    Returns
    -------
    made : the joints, k of them
    kept : numbers in ``rows`` of their pairs, shape (k,): an area that is next to nothing makes no joint
    """
    r, poses = len(rows), poses_of(assembly, state)
    # room for a joint of every pair, as wide as the one with the most points
    shapes: dict[str, tuple[int, ...]] = {name: (ROOM,) for name in ("s", "t", "area", "gap")}
    shapes |= {name: (3, 3) for name in ("world", "frame")} | {"position": (ROOM, 3), "apart": ()}
    shapes |= {name: (3,) for name in ("arm_a", "arm_b", "offset", "edge")}
    shapes |= {name: (4,) for name in ("turn", "limits")}
    out = Cut(size=np.zeros(r, dtype=np.int64), **{name: np.empty((r, *shape)) for name, shape in shapes.items()})
    one, two = blocks
    kernels.cut_joints(rows, one, two, met, poses, least_area(assembly), out)
    kept = np.flatnonzero(out.size)
    one, two, count = one[kept], two[kept], out.size[kept]
    used = np.arange(ROOM) < count[:, None]
    contact = met.kind[rows[kept]]
    law, origin = _laws(assembly, state, poses, (one, two), like[kept], out.world[kept, 2], out.arm_a[kept])
    crosses = contact == CROSSING
    # edges that cross meet in a point: no bond and no dilation there, and no damage is done. What the pair has suffered
    # before still counts: friction lies between peak and residual value as the damage says that its points inherit
    for column in (LAW.cohesion, LAW.rest_cohesion, LAW.tension, LAW.rest_tension, LAW.tan_psi, LAW.rest_tan_psi,
                   LAW.by_opening, LAW.by_slip, LAW.secant):
        law[crosses, column] = 0.0
    law[crosses, LAW.cross] = 1.0
    joints = Joints(
        block_a=one, block_b=two, start=np.concatenate([[0], np.cumsum(count)]).astype(np.int64), frame=out.frame[kept],
        turn=out.turn[kept], arm_a=out.arm_a[kept], arm_b=out.arm_b[kept], offset=out.offset[kept], law=law,
        edge=out.edge[kept], limits=out.limits[kept],
    )
    m = int(count.sum())
    s, t, area, gap = (x[kept][used] for x in (out.s, out.t, out.area, out.gap))
    points = Points(
        s=s, t=t, area=area, gap=gap, slip_1=np.zeros(m), slip_2=np.zeros(m), lift=np.zeros(m), damage=np.zeros(m)
    )
    heirs = Heirs(
        contact=contact, world=out.world[kept], position=out.position[kept][used],
        apart=np.repeat(out.apart[kept], count), aside=np.zeros((m, 2)), setback=np.zeros(m),
    )
    return Fresh(joints, points, heirs, origin), kept


def _laws(
    assembly: Assembly, state: State, poses: Poses, blocks: tuple[Index, Index], like: Index, normal: Array, arm: Array
) -> tuple[Array, Index]:
    """Law of every pair's interface, or an unbonded one, and where it came from.

    Parameters
    ----------
    assembly, state, poses : blocks, the state they are in, and where they are
    blocks : numbers of the first and the second block of every pair, shape (k,) each
    like : joint whose law a pair without an interface takes, -1 for the interface on the nearest face of either block
        that looks along the normal, shape (k,)
    normal : from a to b now, unit vectors, shape (k, 3)
    arm : joint's origin from the centroid of a, axes of a [m], shape (k, 3)

    Returns
    -------
    law : rows of the kernel, shape (k, columns)
    origin : -2 less the number of the interface whose law it is, -1 for an unbonded one, shape (k,)
    """
    # interface of every pair of blocks, found by the code of the two
    x, (one, two), n = assembly.arrays, blocks, assembly.n_blocks
    code, pair = pair_codes(x.block_a, x.block_b, n), pair_codes(one, two, n)
    order = np.argsort(code, kind="stable")
    at = np.minimum(np.searchsorted(code[order], pair), len(code) - 1)
    own = order[at]
    has = code[own] == pair  # whether these blocks have an interface
    law = np.where(has[:, None], state.laws[own], state.joints.law[like] if len(state.joints.law) else 0.0)
    for k in np.flatnonzero(~has & (like < 0)).tolist():
        a, b = int(one[k]), int(two[k])
        place = poses.place[a] + poses.rot[a] @ arm[k]
        law[k] = state.laws[kernels.facing_interface(x.block_a, x.block_b, x.normal, x.centre, poses, a, b, normal[k],
                                                     place)]
    # blocks that had no interface were never bonded
    for column in (LAW.cohesion, LAW.rest_cohesion, LAW.tension, LAW.rest_tension):
        law[~has, column] = 0.0
    return law, np.where(has, -2 - own, -1)


def assemble(
    assembly: Assembly, state: State, stays: Flags, made: Fresh | None, changed: Flags
) -> list[str]:
    """Write the kept and the new joints to the state, and keep the step stable.

    Parameters
    ----------
    assembly, state : blocks, and the state, which is changed
    stays : joints of the state that are kept, shape (k,)
    made : new joints, None for none
    changed : blocks, beside those of new joints, whose stiffness is other than when it was looked at last, shape (n,)

    Returns
    -------
    notes for the user
    """
    j, those = state.joints, np.flatnonzero(stays)
    kept = points_of(j, those)

    def stack(old: NDArray[Number], of: Index, new: NDArray[Number] | None) -> NDArray[Number]:
        """Rows ``of`` an old array that are kept, and the new ones after them."""
        out = np.empty((len(of) + (0 if new is None else len(new)), *old.shape[1:]), dtype=old.dtype)
        np.take(old, of, axis=0, out=out[: len(of)], mode="clip")
        if new is not None:
            out[len(of) :] = new
        return out

    new = made.points if made else (None,) * len(Points._fields)
    state.points = Points(*(stack(old, kept, x) for old, x in zip(state.points, new, strict=True)))
    not_asked = np.full((len(made.points.s), state.ends.shape[1]), np.nan) if made else None  # see State.ends
    state.ends = stack(state.ends, kept, not_asked)
    state.setback = stack(state.setback, kept, made.heirs.setback if made else None)
    sizes = np.concatenate([np.diff(j.start)[stays], np.diff(made.joints.start) if made else []])
    rows = {name: stack(old, those, getattr(made.joints, name) if made else None)
            for name, old in j._asdict().items() if name != "start"}
    state.joints = Joints(**rows, start=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64))
    state.interface = stack(state.interface, those, made.origin if made else None)
    state.contact = stack(state.contact, those, made.heirs.contact if made else None)
    stiffened = changed.copy()
    if made:
        # the rise of a joint by dilation begins where its points begin, not at zero
        highest = np.maximum.reduceat(made.points.lift, made.joints.start[:-1])
        law = state.joints.law[len(those) :]
        law[:, LAW.lift] = np.maximum(law[:, LAW.lift], highest)
        stiffened[made.joints.block_a] = stiffened[made.joints.block_b] = True
    if state.modes is not None and state.deformation is not None:
        state.modes = with_joints(state.deformation, state.modes, state.points, state.joints)
    return _keep_stable(assembly, state, stiffened)


def _keep_stable(assembly: Assembly, state: State, blocks: Flags) -> list[str]:
    """Shorten the step, or add mass, where new contacts made blocks stiffer.

    Real masses stay and the step falls. With scaled masses the step stays and mass is added.

    Energy of motion that goes with added mass is counted as artificial damping.

    Parameters
    ----------
    assembly, state : blocks, and the state, whose step or masses are changed
    blocks : those that may have become stiffer, shape (n,)

    Returns
    -------
    notes for the user
    """
    bodies = state.bodies
    stiffness = block_stiffness(
        state.points, state.joints, assembly.n_blocks, bodies.rot + np.eye(3), state.ties, blocks
    )
    # what nothing can do needs no mass: points across the thickness would slow a plane problem's turns fiftyfold
    moves = ~state.outside
    stiffness *= moves[:, None] & moves
    inertia = np.asarray(np.linalg.inv(bodies.inv_inertia), dtype=np.float64)
    coupled = None
    if state.modes is not None and state.deformation is not None:
        coupled = coupled_of(state.deformation, state.points, state.joints, moves)
    if state.mode == DYNAMIC:
        top = 0.0 if coupled is None or state.modes is None else fastest_of(bodies.mass, inertia, state.modes, coupled)
        # below the stability limit of the blocks taken one by one, as their joints couple them
        looked_at = blocks & ~assembly.fixed
        limit = stable_step(stiffness, bodies.mass, inertia, looked_at, state.joints, safety=1.0, top=top)
        limit *= SAFETY
        if limit < (1.0 - SLACK) * state.dt:
            state.dt = limit
            return ["new contacts made the joints stiffer: the time step was shortened"]
        return []
    # mass [kg] and inertia tensor [kg m2] that the step asks for; mass 1 stands for a block without joints
    mass, needed_inertia = scaled_masses(stiffness, state.dt, SAFETY)
    before = state.energy_of_motion()
    for i in np.flatnonzero(blocks & (mass > (1.0 + SLACK) * bodies.mass)).tolist():
        # mass that joins at rest: momentum stays, speed and energy of motion fall
        factor = float(mass[i] / bodies.mass[i])
        bodies.mass[i] = mass[i]
        bodies.inv_mass[i] = 1.0 / mass[i]
        bodies.vel[i] = np.where(bodies.held[i, :3], bodies.vel[i], bodies.vel[i] / factor)
        bodies.spin[i] = np.where(bodies.held[i, 3:], bodies.spin[i], bodies.spin[i] / factor)
        bodies.inv_inertia[i] = bodies.inv_inertia[i] / factor
    rows = np.flatnonzero(blocks & (mass != 1.0))
    # inertia that the joints' rotational stiffness asks for: by the largest ratio to what there is, about any axis
    fastest = np.linalg.eigvals(bodies.inv_inertia[rows] @ needed_inertia[rows]).real.max(axis=1, initial=0.0)
    slow = fastest > 1.0 + SLACK
    for i, top in zip(rows[slow].tolist(), fastest[slow].tolist(), strict=True):
        bodies.inv_inertia[i] /= top
        bodies.spin[i] = np.where(bodies.held[i, 3:], bodies.spin[i], bodies.spin[i] / top)
    if coupled is not None and state.modes is not None:
        factors = add_modal_mass(
            bodies.mass, bodies.inv_mass, bodies.inv_inertia, state.modes, coupled, state.dt, SAFETY
        )[:, None]
        bodies.vel[:] = np.where(bodies.held[:, :3], bodies.vel, bodies.vel / factors)
        bodies.spin[:] = np.where(bodies.held[:, 3:], bodies.spin, bodies.spin / factors)
    after = state.energy_of_motion()
    state.total[E_DAMPING] += before - after
    state.total[E_KINETIC] += after - before
    return []
