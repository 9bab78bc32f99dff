"""What a theory finds at contact points as results: resultants of the interfaces, mechanism to a common scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from limitmason.answers.results import Mechanism, Resultants
from limitmason.arrays import Array, Flags
from limitmason.geometry.rotation import vector_product
from limitmason.mechanics.dissipation import along_tangents, point_rates
from limitmason.mechanics.law import interface_law
from limitmason.mechanics.residuals import live_size
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

TORSION = 0.4
"""Torsion over strength times side of a face that is more than uniform pressure allows [-]: a square has 0.3826."""

NO_TORSION = 1e-6
"""Torsion [N m] over the unit of force [N] that is rounding."""

BESIDE_SHEAR = 1.05
"""Chosen: shares of shear and of torsion, squared, whose sum is beyond even pressure. On that it is below one."""


def twisted_joints(assembly: Assembly, found: Resultants, unit: float) -> Flags:
    """Joints in space that carry more torsion than uniform pressure allows, shape (k,).

    The limit is ``TORSION`` times the strength in shear [N] and the root of the area [m], exact for squares. A dry face
    that also slides bears less, about the centre of its pressure: the squares of both shares then add up to one.

    Parameters
    ----------
    found : forces in the joints, and in ties after them
    unit : a force of the problem, of which 1e-6 is rounding [N]
    """
    x = assembly.links
    law, normal = interface_law(x), np.maximum(found.normal, 0.0)
    strength = law.over(x.area).shear_strength(normal)
    limit = TORSION * strength * np.sqrt(x.area)
    alone = np.abs(found.torsion) > limit + NO_TORSION * unit
    dry = (law.cohesion == 0.0) & (strength > NO_TORSION * unit)
    safe = np.where(dry, normal, 1.0)
    # about the centre of pressure, at (-m2, m1) / N along the tangents
    about = found.torsion + (found.moment * found.shear).sum(axis=1) / safe
    shares = (about / np.where(dry, limit, 1.0)) ** 2
    shares += ((found.shear / np.where(dry, strength, 1.0)[:, None]) ** 2).sum(axis=1)
    turns = np.abs(about) > NO_TORSION * unit
    return alone | (dry & turns & (shares > BESIDE_SHEAR))


def resultants_from_points(
    assembly: Assembly, position: Array, interface: NDArray, area: Array, force: Array
) -> Resultants:
    """Resultants of all interfaces from forces at contact points.

    Parameters
    ----------
    position : of the points [m], shape (m, 3)
    area : of the points [m2], shape (m,)
    interface : number of the joint, or of the tie after them, shape (m,)
    force : on block b in global axes [N], shape (m, 3)
    """
    x = assembly.links
    k = len(x.block_a)
    arm = position - x.centre[interface]
    moment = vector_product(arm, force)

    def total(vector: Array, direction: Array) -> Array:
        """Sum over the points of every joint of a vector's part along a direction of the joint, shape (k,)."""
        return np.asarray(np.bincount(interface, (vector * direction[interface]).sum(axis=1), k), dtype=float)

    return Resultants(
        normal=total(force, x.normal), shear=np.column_stack([total(force, x.tangent_1), total(force, x.tangent_2)]),
        moment=np.column_stack([total(moment, x.tangent_1), total(moment, x.tangent_2)]),
        torsion=total(moment, x.normal), point_position=position, point_interface=interface, point_area=area,
        point_force=force,
    )


def scaled_mechanism(
    assembly: Assembly, loads: Loads, twists: Array, position: Array, interface: NDArray
) -> Mechanism | None:
    """Mechanism scaled so that the live power is the size of the live load.

    It is None when the live load does no work.

    Parameters
    ----------
    twists : of every block, velocity of the centroid and spin, to any scale, shape (n, 6)
    position : contact points at which openings and slips are told [m], shape (m, 3)
    interface : number of the joint or tie of each, shape (m,)
    """
    v = np.where(assembly.held, 0.0, twists)
    rate = float((loads.live * v).sum())
    if not rate > 0:
        return None
    size = live_size(assembly, loads)
    # power [W] as large as the live load [N]: its mean speed is then 1 m/s
    v = v * ((size if size > 0 else 1.0) / rate)
    opening, sliding = point_rates(assembly, v, position, interface)
    return Mechanism(v, opening, along_tangents(assembly, interface, sliding))
