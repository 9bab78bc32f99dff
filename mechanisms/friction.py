"""Friction on the bed joints that a crack crosses: sums F_g and F_q, crack-angle reduction, torsion of an overlap."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import count, not_negative, numbers, positive
from limitmason.errors import InputError
from limitmason.geometry.polygon import polar_mean_radius
from mechanisms.parameters import ROUNDING, Facade


class FrictionSums(NamedTuple):
    """Largest friction of the crossed bed joints, and its heights.

    Parameters
    ----------
    weight, weight_height : F_g from self weight [N], and height Z_g of its resultant above the hinge [m]
    overload, overload_height : F_q from overload [N], and height Z_q of its resultant above the hinge [m]
    """

    weight: float
    weight_height: float
    overload: float
    overload_height: float

    @property
    def force(self) -> float:
        """F_g + F_q [N]."""
        return self.weight + self.overload

    @property
    def moment(self) -> float:
        """F_g Z_g + F_q Z_q about the hinge [N m]."""
        return self.weight * self.weight_height + self.overload * self.overload_height


def bed_joint_friction(
    *,
    friction: float,
    unit_weight: float,
    thickness: float,
    staggering: float,
    course_height: float,
    crossed: int,
    overload: float = 0.0,
    base_height: float = 0.0,
) -> FrictionSums:
    """Return the largest friction of the bed joints that one vertical crack crosses.

    They lie under the top ``crossed`` courses.

        F_g = f gamma t v h n (n + 1) / 2,    Z_g = z_b + h (n - 1) / 3
        F_q = f q v n,                        Z_q = z_b + h (n - 1) / 2

    Parameters
    ----------
    friction : f [-]
    unit_weight : gamma [N/m3]
    thickness : of the cracked wall [m]
    staggering, course_height : v and h [m]
    crossed : number of courses n that the crack crosses, from the top
    overload : q on the cracked wall [N/m]
    base_height : z_b of the lowest crossed joint above the hinge [m]

    Raises
    ------
    InputError
        When ``crossed`` is no whole number of one or more, and for another number that is none or negative.

    Notes
    -----
    Structure of F_g, F_q, Z after Casapulla et al. as used by Murano et al., eqs (24)-(26); the expressions are derived
    in docs/mechanisms.md, section 2 (no table of the original was at hand). Joint j carries gamma t v (j h)
    plus q v on its overlap, without load spreading: too low where the units spread the load, too high where the side
    wall is unloaded by the rocking itself.
    """
    f = not_negative("friction", friction)
    for name, value in (
        ("unit_weight", unit_weight), ("thickness", thickness), ("staggering", staggering),
        ("course_height", course_height), ("overload", overload), ("base_height", base_height),
    ):
        not_negative(name, value)
    n, h = count("crossed", crossed), course_height
    return FrictionSums(
        weight=f * unit_weight * thickness * staggering * h * n * (n + 1) / 2.0,
        weight_height=base_height + h * (n - 1) / 3.0,
        overload=f * overload * staggering * n,
        overload_height=base_height + h * (n - 1) / 2.0,
    )


def joint_friction(f: Facade, joints: ArrayLike) -> Array:
    """Return the friction of bed joints of a side wall, f (gamma t v j h + q v) [N].

    Parameters
    ----------
    f : facade and side walls
    joints : numbers j of the joints, counted from the top, shape (k,)
    """
    j = np.asarray(joints, dtype=float)
    weight = f.unit_weight * f.side_wall_thickness * j * f.course_height
    return f.friction * f.staggering * (weight + f.side_overload)


def crack_angle_reduction(tangent: ArrayLike, steepest: float) -> Array | float:
    """Return omega = 1 - tan(alpha_c) / tan(alpha_b).

    The share of the friction that an inclined crack leaves.

    Parameters
    ----------
    tangent : tan(alpha_c), from 0 (vertical crack) to ``steepest`` [-]
    steepest : tan(alpha_b) [-]

    Raises
    ------
    InputError
        For a crack that no bond allows.

    Notes
    -----
    If a share p of the courses steps, tan(alpha_c) = p tan(alpha_b) and only 1 - p of the joints keep an overlap to
    slide on. Derived (docs/mechanisms.md, section 2); matches the role of omega in Murano et al., eq (25). Wrong for
    few courses, where it matters which of them step.
    """
    t = numbers("tangent", tangent)
    if not ((t >= 0.0) & (t <= positive("steepest", steepest) * (1.0 + ROUNDING))).all():
        raise InputError(f"crack tangent must lie between 0 and tan(alpha_b) = {steepest:g}, got {tangent!r}")
    out = np.maximum(1.0 - t / steepest, 0.0)
    return float(out) if out.ndim == 0 else out


def torsion_radius(a: float, b: float) -> float:
    """Return the torque over the shear at yield of a rectangle, d_0 = T_o / S_o [m].

    Under uniform pressure it is the polar mean radius of the rectangle about its centre.

        r_m = [2 a b d + a^3 asinh(b/a) + b^3 asinh(a/b)] / (12 a b),    d = sqrt(a^2 + b^2)

    Parameters
    ----------
    a, b : sides [m]

    Returns
    -------
    float
        [m]; 0.382598 for a unit square, a quarter of the length for a thin strip.

    Notes
    -----
    Derived (docs/mechanisms.md, section 4.3). Wrong where the pressure is not uniform: on two opposite corners it
    nearly doubles.
    """
    a, b = positive("a", a), positive("b", b)
    d = math.hypot(a, b)
    return (2.0 * a * b * d + a**3 * math.asinh(b / a) + b**3 * math.asinh(a / b)) / (12.0 * a * b)


def edge_radii(overlap: float, thickness: float) -> tuple[float, float]:
    """Return the mean radius of an overlap about a pole on its outer edge: the middle of the edge, and its end [m].

    Parameters
    ----------
    overlap : along the outer face [m]
    thickness : across [m]

    Notes
    -----
    Two blocks of mechanism D share an edge on the outer face, so their true relative rotation has its pole there, not
    at the centre of the overlap that d_0 is about (docs/mechanisms.md, section 4.2: 1.79 to 2 times d_0).
    """
    rectangle = np.array([[0.0, 0.0], [overlap, 0.0], [overlap, thickness], [0.0, thickness]])
    return polar_mean_radius(rectangle, (0.5 * overlap, 0.0)), polar_mean_radius(rectangle, (0.0, 0.0))


def torsion_shear_curve(a: float, b: float, poles: ArrayLike, *, points: int = 200) -> tuple[Array, Array]:
    """Return shear and torque at yield of a rectangle that turns about poles off its centre.

    The pressure is uniform. Shear is given over that without torque, S/S_o, and torque over that without shear, T/T_o.
    Every point slides across its arm from a pole, which lies on the axis along b at a distance e from the centre. S is
    the mean component along a of the unit sliding directions, T their mean moment about the *centre* over r_m of
    :func:`torsion_radius`. e = 0 is pure torsion, e -> infinity pure shear.

    Parameters
    ----------
    a, b : sides [m]
    poles : distances e [m]
    points : quadrature points per side

    Returns
    -------
    S/S_o, T/T_o : shape of ``poles``

    Notes
    -----
    Derived by integration (docs/mechanisms.md, section 4.3). The straight line T/T_o + S/S_o = 1 behind Murano et al.,
    eq (26), lies far inside it, the circle 4 to 6 % outside.
    """
    radius = torsion_radius(a, b)
    node, weight = np.polynomial.legendre.leggauss(count("points", points))
    share = np.outer(weight, weight) / 4.0  # of the area, at every point of the rule; they add up to one
    x, y = np.meshgrid(0.5 * a * node, 0.5 * b * node, indexing="ij")
    distance = numbers("poles", poles)
    shear, torque = np.empty(distance.shape), np.empty(distance.shape)
    for index, pole in np.ndenumerate(distance):
        # direction of sliding at every point, across its arm from the pole
        arm = y + pole
        r = np.hypot(x, arm)
        # a point at the pole slides in all directions: none in the mean
        along, across = (np.divide(v, r, out=np.zeros_like(r), where=r > 0.0) for v in (arm, -x))
        shear[index] = (share * along).sum()
        torque[index] = (share * (along * y - across * x)).sum()
    return shear, torque / radius
