"""Powers by integration over the moving bodies, joint by joint: what every closed form has to reproduce.

Nothing here uses the closed forms of the other modules. Bodies are integrated by Gauss quadrature of the velocity
field, friction is added up one bed joint after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import choice, count, finite, instance, not_negative, numbers, positive
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.contact_points import ContactPoints, contact_points
from limitmason.mechanics.equilibrium import equilibrium_matrix
from limitmason.mechanics.law import interface_law
from limitmason.model.assembly import Assembly
from limitmason.model.input import read_list
from limitmason.model.load import Loads
from mechanisms.parameters import ROUNDING, Facade, check_reduction

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact to degree 7: the fields below have at most 3
_ADMISSIBLE = 1e-9  # of the largest rate: a lack of opening that is rounding


class PowerBalance(NamedTuple):
    """Powers per unit of rotation rate about the hinge [N m], lambda travel = lift + overload_lift + friction.

    Parameters
    ----------
    lift, overload_lift : power needed to raise the bodies and the overload
    friction : power of the prescribed friction forces
    travel : power of the horizontal live forces at a multiplier of one
    """

    lift: float
    overload_lift: float
    friction: float
    travel: float

    @property
    def multiplier(self) -> float:
        """Multiplier at which the powers balance [-]."""
        return (self.lift + self.overload_lift + self.friction) / self.travel

    def as_dict(self) -> dict[str, float]:
        """The powers and their multiplier, for a Prediction's details."""
        return {**self._asdict(), "multiplier": self.multiplier}


def rocking_power(
    facade: Facade,
    *,
    hinge: int,
    crossed: int,
    tangent: float = 0.0,
    stepping: Sequence[int] | None = None,
    reduction: float | None = None,
    below_crack: str = "connected",
) -> PowerBalance:
    """Power balance of facade and wedges turning about the toe line.

    The crack in every side wall is vertical up to the lowest of the ``crossed`` courses, then inclined by ``tangent``;
    or, where ``stepping`` courses are given, inclined by the bond's own slope over those and vertical over the others.

    Parameters
    ----------
    facade : parameters
    hinge : n_k, courses between the top and the hinge
    crossed : n_c, courses that the crack crosses
    tangent : tan(alpha_c) [-]
    stepping : numbers of the stepping courses, counted from the top
    reduction : factor on the friction of the crossed joints; 1 - tangent / tan(alpha_b) where omitted
    below_crack : "connected", joints between hinge and crack keep their friction; "free", they have none

    Raises
    ------
    InputError
        For courses that the facade does not have above the hinge, a crack steeper than the bond, and a tangent beside
        stepping courses.
    """
    instance("facade", facade, Facade)
    hinge = _courses("hinge", hinge, facade.courses, least=0)
    crossed = _courses("crossed", crossed, hinge, least=0)
    choice("below_crack", below_crack, ("connected", "free"))
    if not 0.0 <= finite("tangent", tangent) <= facade.steepest_crack * (1.0 + ROUNDING):
        raise InputError(f"tangent must lie between 0 and tan(alpha_b) = {facade.steepest_crack:g}, got {tangent!r}")
    if stepping is not None:
        stepping = [_courses("stepping: each", j, crossed) for j in read_list("stepping", stepping)]
        if tangent:
            raise InputError("tangent is of a straight crack: give it or stepping, not both")
    check_reduction(reduction)
    h, top = facade.course_height, hinge * facade.course_height
    lift = travel = friction = 0.0
    # the facade, course by course: u_x = z, u_z = x
    for z0 in np.arange(hinge) * h:
        lift += _box(lambda x, z: x, 0.0, facade.thickness, z0, z0 + h) * facade.unit_weight * facade.length
        travel += _box(lambda x, z: z, 0.0, facade.thickness, z0, z0 + h) * facade.unit_weight * facade.length
    load = facade.overload * facade.overload_length
    overload_lift = load * facade.overload_offset
    travel += load * facade.overload_inertia * (top + facade.overload_rise)
    omega = 1.0 - tangent / facade.steepest_crack if reduction is None else reduction
    # weight of a side wall per area [N/m2], and width of its wedge at the foot of the course that is added [m]
    wedge, width = facade.unit_weight * facade.side_wall_thickness, 0.0
    sides = facade.side_walls
    for j in range(hinge, 0, -1):  # courses and the joints below them, from the hinge up
        z0, inside = top - j * h, j <= crossed
        steps = stepping is not None and j in stepping
        slope = (facade.steepest_crack if steps else 0.0) if stepping is not None else tangent
        slope = slope if inside else 0.0
        start, x0 = width, facade.crack_offset

        # defaults keep the numbers of this course, which the loop changes
        def edge(z: float, start: float = start, slope: float = slope, z0: float = z0) -> float:
            """Place of the crack in this course at a height above the hinge, from the outer face [m]."""
            return facade.crack_offset + start + slope * (z - z0)

        if start or slope:
            lift += sides * wedge * _under(lambda x, z: x, x0, edge, z0, z0 + h)
            travel += sides * wedge * _under(lambda x, z: z, x0, edge, z0, z0 + h)
        width += slope * h
        carried = facade.unit_weight * facade.side_wall_thickness * facade.staggering * j * h
        carried += facade.side_overload * facade.staggering
        # friction that stays: below the crack all or none, of a stepping course none, else that of an even slope
        if not inside:
            share = float(below_crack == "connected")
        else:
            share = omega if stepping is None else float(not steps)
        friction += sides * share * facade.friction * carried * z0
    on_wedge = facade.side_overload * width
    overload_lift += sides * on_wedge * (facade.crack_offset + 0.5 * width)
    travel += sides * on_wedge * facade.side_overload_inertia * top
    return PowerBalance(*(float(p) for p in (lift, overload_lift, friction, travel)))


def flexure_power(
    facade: Facade,
    *,
    hinge: int,
    tangent: float,
    contact_factor: float = 1.0,
    torsion_radius: float,
    reduction: float | None = None,
) -> PowerBalance:
    """Power balance of mechanism D, horizontal flexure.

    A rectangle rocks about its foot, and two triangles beside it turn about inclined lines. The triangles turn by one,
    the rectangle by sin(a); everything is divided by sin(a), so that powers are per unit of the rectangle's rotation.
    Friction turns at cos(a) on two vertical and two inclined lines.

    Parameters
    ----------
    facade : parameters; with one side wall the facade is one half of the mechanism
    hinge : n_k, courses between the top and the hinge
    tangent : tan(a), inclination of the outer lines from the vertical [-]
    contact_factor : k, share of the overlap that is in contact [-]
    torsion_radius : d_0, radius at which friction resists the torsion of an overlap [m]
    reduction : factor on the friction of the inclined lines; 1 - tangent / tan(alpha_b) where omitted

    Raises
    ------
    NotApplicable
        For another number of side walls than 1 or 2: nothing holds the triangles then.
    InputError
        For a hinge or lines outside the facade, and lines steeper than the bond.
    """
    if instance("facade", facade, Facade).side_walls not in (1, 2):
        raise NotApplicable(f"side_walls must be 1 or 2 for horizontal flexure, got {facade.side_walls}")
    hinge, tangent = _courses("hinge", hinge, facade.courses), positive("tangent", tangent)
    not_negative("contact_factor", contact_factor)
    not_negative("torsion_radius", torsion_radius)
    check_reduction(reduction)
    h, height = facade.course_height, hinge * facade.course_height
    # a facade held at one end is half of one that is held at both: that is taken, and halved at the end
    halves = 2.0 if facade.side_walls == 2 else 1.0
    length = facade.length if halves == 2.0 else 2.0 * facade.length
    a = np.arctan(tangent)
    middle = length - 2.0 * height * tangent
    if tangent > facade.steepest_crack * (1.0 + ROUNDING) or middle < -ROUNDING * length:
        raise InputError(f"tangent {tangent!r} must not exceed tan(alpha_b) and L / (2 H_k), the bond and the facade")
    unit_weight, t = facade.unit_weight, facade.thickness
    lift = travel = 0.0
    for z0 in np.arange(hinge) * h:
        # rectangle, u_x = z sin(a), u_z = x sin(a); the depth of the wall is x
        lift += np.sin(a) * unit_weight * middle * _box(lambda x, z: x, 0.0, t, z0, z0 + h)
        travel += np.sin(a) * unit_weight * middle * _box(lambda x, z: z, 0.0, t, z0, z0 + h)
        # the two triangles, s along the wall from the foot of the line: it is at s = z tan(a), the vertical side at 0
        # u_z = x sin(a), 0.5 t^2 sin(a) over the depth; u_x = (z tan(a) - s) cos(a), the distance from the line
        lift += (
            2.0 * unit_weight * 0.5 * t**2 * np.sin(a)
            * _under(lambda s, z: 1.0, 0.0, lambda z: z * tangent, z0, z0 + h)
        )
        travel += 2.0 * unit_weight * t * _under(
            lambda s, z: (z * tangent - s) * np.cos(a), 0.0, lambda z: z * tangent, z0, z0 + h
        )
    # the overload acts on a share of the top, and counts as spread evenly over all of it [N/m]
    q = facade.overload * facade.overload_length / facade.length
    overload_lift = q * length * facade.overload_offset * np.sin(a)
    travel += _push_of_overload(facade, q, height, a, middle)
    omega = 1.0 - tangent / facade.steepest_crack if reduction is None else reduction
    friction = 0.0
    for j in range(1, hinge + 1):
        force = facade.friction * facade.staggering * (unit_weight * t * j * h + q)
        friction += 2.0 * (1.0 + omega) * contact_factor * torsion_radius * force * np.cos(a)
    scale = 0.5 * halves / np.sin(a)
    return PowerBalance(*(float(scale * p) for p in (lift, overload_lift, friction, travel)))


def _courses(name: str, value: object, most: int, least: int = 1) -> int:
    """A number of courses from ``least`` to ``most``, or an error with the ``name`` of the argument."""
    number = count(name, value, least)
    if number > most:
        raise InputError(f"{name} must be a whole number from {least} to {most}, got {value!r}")
    return number


def _push_of_overload(facade: Facade, q: float, height: float, a: float, middle: float) -> float:
    """Power of the overload's horizontal force in mechanism D [N m].

    It is that at a multiplier of one, with triangles that turn by one.

    Parameters
    ----------
    facade : parameters
    q : overload, spread over the whole top [N/m]
    height : of the top above the hinge [m]
    a : inclination of the outer lines from the vertical [rad]
    middle : width of the rectangle [m]
    """
    push, rise, half_top = q * facade.overload_inertia, facade.overload_rise, height * np.tan(a)
    # along the top edge of a triangle, from the middle part outwards
    edge, weight = 0.5 * (_NODES + 1.0) * half_top, 0.5 * _WEIGHTS * half_top
    on_triangle = float(weight @ ((half_top - edge) * np.cos(a) + rise * np.sin(a)))
    return float(push * middle * np.sin(a) * (height + rise) + 2.0 * push * on_triangle)


class ContactCheck(NamedTuple):
    """A motion held against the joints of an assembly.

    Parameters
    ----------
    violation : largest lack of opening, tan(phi) |e_t| - e_n, over the largest rate; 0 for an admissible motion [-]
    multiplier : at which weights, live loads and cohesion balance on the assembly's own blocks; an upper bound of
        associative limit analysis on the same interfaces if the motion is admissible, without meaning if not [-]; ties
        that the motion stretches dissipate their strength
    opening, sliding : rates at the contact points [m/s], shapes (m,) and (m,)
    points : the contact points
    """

    violation: float
    multiplier: float
    opening: Array
    sliding: Array
    points: ContactPoints

    @property
    def admissible(self) -> bool:
        """Whether the motion opens every joint by tan(phi) times its sliding."""
        return self.violation <= _ADMISSIBLE


def check_contacts(assembly: Assembly, loads: Loads, twists: Array) -> ContactCheck:
    """Hold a motion against the equilibrium matrix.

    e = A^T v, admissible where e_n >= tan(phi) |e_t| everywhere.

    lambda = (sum D(e) - w_dead . v) / (w_live . v) with D = c A |e_t| + N_t (e_n - tan(phi) |e_t|), N_t the tension
    capacity of a contact [N], A its area.

    Parameters
    ----------
    assembly, loads : the problem
    twists : velocities of centroids and angular velocities [m/s, rad/s], shape (n_blocks, 6)

    Raises
    ------
    NotApplicable
        When the live load does no work in this motion.
    """
    instance("assembly", assembly, Assembly)
    twists = numbers("twists", twists)
    if twists.shape != (assembly.n_blocks, 6):
        raise InputError(f"twists must have shape ({assembly.n_blocks}, 6), got {twists.shape}")
    v = np.where(assembly.held, 0.0, twists)
    points = contact_points(assembly, ties=True)
    rates = (equilibrium_matrix(assembly, points).T @ v.ravel()).reshape(-1, 3)
    # mechanisms of rigid blocks: a crushing strength is left out, and what overlaps is a violation; ties may yield
    faces = points.interface < len(assembly.interfaces)
    law = interface_law(assembly.links).at(points.interface).over(points.area).without_crushing(np.flatnonzero(faces))
    opening, sliding = rates[:, 0], np.linalg.norm(rates[:, 1:], axis=1)
    excess = law.free_opening(opening, sliding)[faces]
    largest = max(float(np.abs(opening).max(initial=0.0)), float(sliding.max(initial=0.0)), 1e-300)
    dissipated = float(law.dissipation(opening, sliding).sum())
    work = float((loads.live * v).sum())
    if not work > 0.0:
        raise NotApplicable(
            "the live load does no work in this mechanism: it is not moved by it, or in the other sense"
        )
    multiplier = (dissipated - float((loads.dead * v).sum())) / work
    return ContactCheck(abs(float(excess.min(initial=0.0))) / largest, multiplier, opening, sliding, points)


def _box(field: Callable[[Array, float], Array | float], x0: float, x1: float, z0: float, z1: float) -> float:
    """Integral of a field over x0 <= x <= x1, z0 <= z <= z1."""
    return _under(field, x0, lambda z: x1, z0, z1)


def _under(
    field: Callable[[Array, float], Array | float], x0: float, edge: Callable[[float], float], z0: float, z1: float
) -> float:
    """Integral of a field over x0 <= x <= edge(z), z0 <= z <= z1, exact for the polynomials met here.

    ``field`` is called with several x, shape (k,), and one z [m].
    """
    total = 0.0
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        z = 0.5 * (z0 + z1) + 0.5 * (z1 - z0) * node
        half = 0.5 * (edge(z) - x0)
        x = x0 + half * (1.0 + _NODES)
        total += weight * half * float(_WEIGHTS @ np.broadcast_to(field(x, z), x.shape))
    return 0.5 * (z1 - z0) * total
