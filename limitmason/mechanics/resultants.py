"""What a theory finds at contact points as results: resultants of the interfaces, mechanism to a common scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from limitmason.answers.results import Mechanism, Resultants
from limitmason.arrays import Array
from limitmason.mechanics.dissipation import along_tangents, point_rates
from limitmason.mechanics.residuals import live_size
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads


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
    moment = np.cross(arm, force)

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
