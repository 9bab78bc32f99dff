"""Rigid blocks that stand for units that deform: the units' compliance goes to the joints between them."""

from dataclasses import replace

import numpy as np

from limitmason.errors import InputError
from limitmason.model.assembly import Assembly

_DECIMALS = 24
"""Decimals of a compliance [m/Pa] that are compared: those of units are 1e-12 and more, below 1e-24 it is rounding."""


def with_lumped_units(assembly: Assembly) -> Assembly:
    """This assembly with the compliance of its units in the joints between them, for methods of rigid blocks.

    1/kn* = 1/kn + h/E,  1/ks* = 1/ks + h/G  on every joint, h/E the sum over both blocks of the distance from centroid
    to joint over the modulus: springs in series. A block that is held wholly, or has no material, adds nothing.

    Returns
    -------
    Assembly
        The same strengths; the blocks keep their materials

    Raises
    ------
    ValueError
        Where no block has a material, and naming the joint that has no stiffness of its own.

    Notes
    -----
    A bar of units under uniform stress shortens exactly as units and joints in series do. Left out are Poisson's
    effect, bending and shear lag inside a unit, and the flow of force past a head joint: a panel's own-weight
    settlement comes out about 5 % low, its compliance under a point load up to 15 %.
    """
    made_of = [None if held else b.material for b, held in zip(assembly.blocks, assembly.fixed, strict=True)]
    if not any(made_of):
        raise InputError(
            "no unit has a material whose compliance could go to the joints: give assembly.with_material("
            "limitmason.Material(young_modulus=..., poisson_ratio=...))"
        )
    x = assembly.arrays
    normal = np.array([0.0 if m is None else 1.0 / m.young_modulus for m in made_of])
    shear = np.array([0.0 if m is None else 1.0 / m.shear_modulus for m in made_of])
    # distance [m] of the joint's plane from either centroid: the part of the unit that it stands for
    reach = [np.abs(np.einsum("ij,ij->i", x.normal, x.centre - x.centroid[block])) for block in (x.block_a, x.block_b)]
    soft = [reach[0] * c[x.block_a] + reach[1] * c[x.block_b] for c in (normal, shear)]
    interfaces, known = [], {}
    for k, i in enumerate(assembly.interfaces):
        kn, ks = i.joint.normal_stiffness, i.joint.shear_stiffness
        # springs in series need both: a default stiffness is no property, and 1 / 0 no spring
        if kn is None or not kn > 0.0 or ks == 0.0:
            joint = assembly.joint_text(i.block_a, i.block_b)
            raise InputError(f"{joint} needs a normal and a shear stiffness of its own")
        ks = kn if ks is None else ks
        # joints alike but for rounding share one law
        key = (i.joint, round(float(soft[0][k]), _DECIMALS), round(float(soft[1][k]), _DECIMALS))
        if key not in known:
            known[key] = replace(
                i.joint,
                normal_stiffness=1.0 / (1.0 / kn + float(soft[0][k])),
                shear_stiffness=1.0 / (1.0 / ks + float(soft[1][k])),
            )
        interfaces.append(replace(i, joint=known[key]))
    return replace(assembly, interfaces=tuple(interfaces))
