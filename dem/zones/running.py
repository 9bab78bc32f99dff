"""Stepping a zoned model: settle under dead loads, drive rigid blocks, read forces, stresses and energies."""

from typing import NamedTuple

import numpy as np

from dem.default_damping import ZONES
from dem.kernels.zone_arrays import Z_APPLIED, Z_KINETIC, Z_LOST, Z_MISSED, Z_SUPPORT
from dem.kernels.zone_measure import measure_zones
from dem.kernels.zone_motion import advance_zones
from dem.model.state import UnstableError
from dem.zones.zoned_model import ZonedModel, slowest_period
from limitmason.arrays import Array, Flags

SETTLED = 1e-4
"""Unbalanced force at a node over the mean applied force per node from which a model is settled [-]."""


LEAST_STEPS, SWINGS = 400, 2.0
"""Fewest steps, and slowest swings, over which loads come on; chosen."""

LONGEST = 4
"""Loads come on in at most one part in so many of all steps: the rest is for settling; chosen."""

CHECK_EVERY = 200
"""Steps between two looks at the unbalance; chosen."""

EXPLODES = 1.0
"""Energy from nowhere over the work of loads and supports from which a run has exploded: they are all there is [-]."""


class Reading(NamedTuple):
    """What a model holds in a position.

    Parameters
    ----------
    energy : elastic, of zones and joints [J]
    stress : at all stress points, tension positive [Pa]: xx, zz, xz, yy, shape (e, 4, 4)
    opening : less dilation [m], of all contact points, shape (m,)
    slip : total [m], along the joint, shape (m,)
    normal : on block b, compression positive [Pa], shape (m,)
    shear : on block b [Pa], as ``slip``
    """

    energy: float
    stress: Array
    opening: Array
    slip: Array
    normal: Array
    shear: Array


def advance(model: ZonedModel, steps: int, *, drifts: bool = False) -> None:
    """Advance by a number of steps under the loads and drives as they are.

    Local damping is that for which masses are scaled, :data:`dem.default_damping.ZONES`.

    Parameters
    ----------
    model : changed
    steps : how many
    drifts : whether it is combined damping for parts that move on steadily

    Raises
    ------
    UnstableError
        Where a node has left the structure's surroundings, a zone is pressed flat, or a stress could not be returned to
        its surface.
    """
    advance_zones(model.arrays, steps, model.dt, ZONES, drifts)
    blocks, mesh, shift = model.assembly.blocks, model.mesh, model.nodes.shift
    lost = ~np.isfinite(shift).all(axis=1)
    if lost.any():
        name = blocks[int(mesh.block[int(np.argmax(lost))])].name
        raise UnstableError(f"the place of a node of block {name!r} is no longer finite")
    flown = np.abs(shift).max(axis=1) > np.ptp(model.nodes.place, axis=0).max()
    corner = (model.nodes.place + shift)[model.zones.node]
    one, two = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    # diagonals of a zone that no longer turn the same way: it has no area left
    flat = one[:, 0] * two[:, 1] <= one[:, 1] * two[:, 0]
    # energy from nowhere is told first: what flies or is pressed flat then follows from it
    if flown.any() or flat.any():
        refuse_explosion(model)
    if flown.any():
        name = blocks[int(mesh.block[int(np.argmax(flown))])].name
        raise UnstableError(f"block {name!r} has moved farther than the structure is large")
    if flat.any():
        name = blocks[int(mesh.zone_block[int(np.argmax(flat))])].name
        raise UnstableError(f"a zone of block {name!r} is pressed flat: the block bears less than what loads it")
    if model.total[Z_MISSED] > 0.0:
        raise UnstableError("a stress could not be returned to its yield surface: dilatancy beyond the friction angle")


def refuse_explosion(model: ZonedModel) -> None:
    """Refuse a state in which energy appears from nowhere.

    Loads read from it would mean nothing. Kinetic energy is asked first: a model that explodes flies apart, and reading
    elastic energy costs as much as a step.

    Raises
    ------
    UnstableError
        Where the kinetic energy, and what more there is of all energies than loads and supports have given, are both
        above :data:`EXPLODES` times that work, or no number.
    """
    total = model.total
    work = max(abs(float(total[Z_APPLIED] + total[Z_SUPPORT])), 1e-300)
    kinetic = float(total[Z_KINETIC])
    if kinetic <= EXPLODES * work:
        return
    # asked the other way round, so that energy that is no number is refused too
    if not float(total[Z_LOST].sum()) + kinetic + read(model).energy - work <= EXPLODES * work:
        raise UnstableError(
            f"energy explodes: kinetic {kinetic:.3g} J against {work:.3g} J that loads and supports have given; a "
            "block that has fallen out drags its joints along, or the step is too long for them"
        )


def read(model: ZonedModel) -> Reading:
    """Stresses, joint forces and elastic energy in the present position."""
    stress = np.zeros((len(model.zones.kind), 4, 4))
    joint = np.zeros((len(model.contacts.area), 4))
    energy = float(measure_zones(model.arrays, stress, joint))
    return Reading(energy, stress, *np.ascontiguousarray(joint.T))


def unbalance(model: ZonedModel) -> float:
    """Largest unbalanced force or moment of a model, divided by the applied force [-].

    At a free node it is divided by the mean applied force per free node, as each bears a small part of the load. At a
    rigid block, which may bear all of it, it is divided by the sum, and its moment by that times the block's least
    extent. A structure without loads is measured by the forces that drive it.
    """
    nodes, rigid = model.nodes, model.rigid
    free = nodes.body < 0
    applied = float(np.linalg.norm(nodes.load, axis=1).sum())
    applied += float(np.linalg.norm(rigid.load[:, :2], axis=1).sum())
    driven = float(np.abs(rigid.net[:, :2][rigid.held[:, :2]]).max(initial=0.0))
    applied = max(applied, driven, 1e-300)
    on_blocks = np.where(rigid.held, 0.0, rigid.net)
    for k in np.flatnonzero(on_blocks[:, 2]):
        block = model.assembly.blocks[int(model.mesh.block[np.argmax(nodes.body == k)])]
        on_blocks[k, 2] /= float(np.ptp(block.bounds, axis=0)[[0, 2]].min())
    at_node = float(np.abs(nodes.force[free]).max(initial=0.0)) / (applied / max(int(free.sum()), 1))
    return max(at_node, float(np.abs(on_blocks).max(initial=0.0)) / applied)


MOST_STEPS = 200_000
"""Steps in which a model settles, at most."""

RAMP = 20
"""Parts in which loads are brought on: at once they would swing, and what swings yields and slips for good."""


def settle(model: ZonedModel, tolerance: float = SETTLED, max_steps: int = MOST_STEPS) -> bool:
    """Bring the loads on and run until the unbalance is below a tolerance.

    Loads come in :data:`RAMP` parts over two of the slowest swings, at most a quarter of the steps. What is returned is
    whether the model has settled, False where that takes too many steps.

    Parameters
    ----------
    model : changed
    tolerance : unbalanced over acting force, see :func:`unbalance` [-]
    max_steps : steps in all
    """
    acting = model.nodes.load, model.rigid.load, model.rigid.arms
    whole = [x.copy() for x in acting]
    # steps under each part of the loads
    part = int(np.clip(SWINGS * slowest_period(model), LEAST_STEPS, max_steps // LONGEST)) // RAMP
    for k in range(1, RAMP + 1):
        for x, full in zip(acting, whole, strict=True):
            x[:] = k / RAMP * full
        if k < RAMP:
            advance(model, part)
    for _ in range(max((max_steps - RAMP * part) // CHECK_EVERY, 1)):
        advance(model, CHECK_EVERY)
        if unbalance(model) < tolerance:
            return True
    return False


def drive(model: ZonedModel, velocity: Array, held: Flags) -> None:
    """Hold freedoms of rigid blocks, and prescribe their velocities.

    What is held already stays held.

    Parameters
    ----------
    velocity : x, z [m per step] and turn from x to z [rad per step] of the rigid blocks, shape (r, 3)
    held : freedoms that are meant, shape (r, 3)
    """
    model.rigid.held[:] |= held
    model.rigid.drive[held] = velocity[held]
