"""What the closed forms need to know of a wall, given as numbers or read from an assembly's recipe."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

from limitmason.checks import finite, instance, not_negative, positive
from limitmason.constants import GRAVITY
from limitmason.errors import InputError, NotApplicable
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from mechanisms.built_wall import BEAMS, at_origin, check_free, foot_level, unit_density, wall_recipe

ROUNDING = 1e-9
"""Relative: lengths, tangents and loads of the closed forms that differ by less are equal."""

_EPS = 1e-6  # relative: loads, levels and friction coefficients of an assembly closer than this are the same


@dataclass(frozen=True, kw_only=True)
class Facade:
    """A facade in running bond with side walls, as the closed-form mechanisms see it.

    Any consistent units do; the names below assume metres and newtons. x runs inward from the toe line on the face
    towards which the wall falls, z up from its foot.

    Parameters
    ----------
    length, thickness : L and t of the facade, corners included [m]
    courses : number of courses n; the height is n h
    course_height, staggering : h and v, the overlap of a unit over the one below [m]
    unit_weight : gamma [N/m3]
    friction : f = tan(phi) of the bed joints [-]
    side_walls : number n_s of side walls; 0 for a straight wall
    side_wall_thickness : t_s [m]; the facade's where omitted
    side_wall_length : from the inner face of the facade to the free end [m]
    overload, side_overload : line loads q on the facade and q_s on the side walls [N/m]
    overload_length : L_Q over which q acts [m]; the facade's length where omitted
    overload_offset : X_Q of the overload from the toe line [m]; t/2 where omitted
    overload_inertia : horizontal force per multiplier and per vertical force of the facade's overload; 1 for masses, 0
        for loads that hang on no mass [-]
    side_overload_inertia : the same of the side walls' overload [-]
    overload_rise : height of the overload's line of action above the top of the wall [m]
    crack_offset : x_0 at which cracks in the side walls start [m]; the facade's thickness where omitted
    steepest_crack : tan(alpha_b), largest inclination of a stepped crack [-]; v / h where omitted

    Raises
    ------
    InputError
        Naming the field that is wrong.

    Notes
    -----
    A stepped crack moves v sideways per course of height h, so tan(alpha_b) = v / h. Murano et al. (section 6.3) use
    v over the *length* of the unit (26 degrees instead of 32.6); set ``steepest_crack`` to follow them.
    """

    length: float
    thickness: float
    courses: int
    course_height: float
    staggering: float
    unit_weight: float
    friction: float
    side_walls: int = 0
    side_wall_thickness: float = None  # type: ignore[assignment]  # None takes its default below
    side_wall_length: float = math.inf
    overload: float = 0.0
    side_overload: float = 0.0
    overload_length: float = None  # type: ignore[assignment]  # None takes its default below
    overload_offset: float = None  # type: ignore[assignment]  # None takes its default below
    overload_inertia: float = 1.0
    side_overload_inertia: float = 1.0
    overload_rise: float = 0.0
    crack_offset: float = None  # type: ignore[assignment]  # None takes its default below
    steepest_crack: float = None  # type: ignore[assignment]  # None takes its default below

    def __post_init__(self) -> None:
        """Fill what follows from other fields, and say which one is wrong."""
        for name in ("thickness", "course_height", "staggering"):
            positive(name, getattr(self, name))
        for name, (_, value) in self._following.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("courses", "side_walls"):
                least = 1 if field.name == "courses" else 0
                if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
                    raise InputError(f"{field.name} must be a whole number of at least {least}, got {value!r}")
            elif field.name in _ABOVE_ZERO:
                if (field.name, value) != ("side_wall_length", math.inf):
                    positive(field.name, value)
            else:
                not_negative(field.name, value)

    @property
    def _following(self) -> dict[str, tuple[tuple[str, ...], float]]:
        """Fields that follow from others where they are not given: from which, and their values then."""
        return {
            "side_wall_thickness": (("thickness",), self.thickness),
            "overload_length": (("length",), self.length),
            "overload_offset": (("thickness",), 0.5 * self.thickness),
            "crack_offset": (("thickness",), self.thickness),
            "steepest_crack": (("staggering", "course_height"), self.slope),
        }

    @property
    def height(self) -> float:
        """H = n h [m]."""
        return self.courses * self.course_height

    @property
    def slope(self) -> float:
        """Ratio v / h: how far a stepped crack moves sideways per unit of height [-]."""
        return self.staggering / self.course_height

    @property
    def weight(self) -> float:
        """Weight of the whole facade, gamma L t H [N]."""
        return self.unit_weight * self.length * self.thickness * self.height

    def rocking_powers(self, top: float) -> tuple[float, float]:
        """Powers that resist and that drive what lies above a hinge, per turn about its toe line [N m].

        ``top`` is the depth of the hinge below the top of the wall [m].
        """
        weight = self.unit_weight * self.thickness * self.length * top
        load = self.overload * self.overload_length
        return (
            weight * 0.5 * self.thickness + load * self.overload_offset,
            weight * 0.5 * top + load * self.overload_inertia * (top + self.overload_rise),
        )

    def changed(self, **fields_: Any) -> Facade:
        """Copy with some fields replaced, by name; what followed from a replaced field is worked out again."""
        # a field that has the value it would follow to was not given: None lets it follow the new ones
        reset = {
            name: None
            for name, (of, value) in self._following.items()
            if not fields_.keys().isdisjoint(of) and getattr(self, name) == value
        }
        return replace(self, **{**reset, **fields_})

    def as_dict(self) -> dict[str, Any]:
        """All fields, for provenance."""
        return asdict(self)

    @classmethod
    def from_assembly(cls, assembly: Assembly, loads: Loads | None = None, **changes: Any) -> Facade:
        """Parameters of a wall of ``limitmason.build``, from its recipe and its loads.

        Geometry comes from the recipe, friction from the bed joints, the unit weight from the density of units and
        gravity, the overload from loading beams and from dead loads on beams and on the top course.

        Parameters
        ----------
        assembly : with a recipe of kind "wall", as ``build.wall`` and ``build.layout`` write it
        loads : out of plane or in plane; weight alone with its horizontal twin where omitted
        changes : fields that replace what is read

        Raises
        ------
        NotApplicable
            Without such a recipe; for a bond without stagger, units held above the foot, bed joints of different
            friction, units of different density, dead loads below the top course, and live loads that are not the
            weights turned horizontally.
        """
        recipe = wall_recipe(assembly)
        assembly = at_origin(assembly)
        check_free(assembly)
        if recipe.get("plan") == "box":
            raise NotApplicable("a closed plan: its rear wall holds the side walls, which the closed forms leave free")
        staggering = recipe.get("staggering")
        if not staggering:
            raise NotApplicable("recipe['staggering'] is missing: the bond has no overlap from which cracks could step")
        returns = recipe.get("returns", [])
        thickness = recipe["thickness"]
        # lengths of the side walls from the inner face of the facade on
        beyond = [r["length"] - thickness for r in returns]
        found: dict[str, Any] = {
            "length": recipe["length"], "thickness": thickness,
            "courses": recipe["courses"] - int(recipe.get("base") == "course"),  # a held bottom course is the ground
            "course_height": recipe["unit_height"], "staggering": staggering,
            "unit_weight": changes["unit_weight"] if "unit_weight" in changes else unit_density(assembly) * GRAVITY,
            "side_walls": len(returns),
            "friction": changes["friction"] if "friction" in changes else bed_friction(assembly),
        }
        if returns:
            found["side_wall_thickness"] = recipe["side_wall_thickness"]
            found["side_wall_length"] = min(beyond)  # a crack must fit in the shorter one, wedges are alike
        found |= _read_overloads(assembly, loads, found, sum(beyond))
        try:
            return cls(**{**found, **changes})
        except InputError as error:
            if changes:
                raise
            # nobody gave these numbers: they are what a closed form would need of this wall
            raise NotApplicable(f"the closed forms do not take what is read off this wall: {error}") from None


_ABOVE_ZERO = (
    "length", "thickness", "course_height", "staggering", "unit_weight", "side_wall_thickness", "side_wall_length",
    "overload_length", "steepest_crack",
)
"""Fields of a facade that must be positive; the others may be zero."""


class ReadParameters(NamedTuple):
    """Parameters, and the assembly and loads they were read from, or None."""

    facade: Facade
    assembly: Assembly | None
    loads: Loads | None


def read(facade: Facade | Assembly, loads: Loads | None = None, **changes: Any) -> ReadParameters:
    """Take a Facade as it is, or read one from an assembly.

    Parameters
    ----------
    facade : numbers, or a built wall
    loads : of the wall; weights along -y where omitted
    changes : fields that replace those of the facade; those that are None are left out

    Raises
    ------
    InputError
        When ``facade`` is neither, and for loads of a Facade or of another assembly.
    """
    given = {name: value for name, value in changes.items() if value is not None}
    if isinstance(facade, Assembly):
        loads = loads_of(facade, loads, (0.0, -1.0, 0.0))
        found = Facade.from_assembly(facade, loads, **given)
        return ReadParameters(found, at_origin(facade), loads)
    if not isinstance(facade, Facade):
        raise InputError(f"facade must be a mechanisms.Facade or a limitmason.Assembly, got {type(facade).__name__}")
    if loads is not None:
        raise InputError("loads go with an assembly; a Facade carries its overload itself")
    return ReadParameters(facade.changed(**given) if given else facade, assembly=None, loads=None)


def courses_to_try(name: str, value: int | None, most: int) -> range:
    """The number of courses that is given, or all from 1 to the most, of which the worst will be taken.

    Parameters
    ----------
    name : of the argument, for the message
    value : what was given, or None
    most : number of courses there are
    """
    if value is None:
        return range(1, most + 1)
    if isinstance(value, bool) or (n := finite(name, value)) != int(n) or not 1 <= n <= most:
        raise InputError(f"{name} must be a whole number from 1 to {most}, got {value!r}")
    return range(int(value), int(value) + 1)


def check_reduction(value: float | None) -> None:
    """Refuse a factor on the friction that is given and does not lie between 0 and 1."""
    if value is not None and not 0.0 <= finite("reduction", value) <= 1.0:
        raise InputError(f"reduction must lie between 0 (no friction) and 1 (all of it), got {value!r}")


def loads_of(assembly: Assembly, loads: Loads | None, direction: tuple[float, float, float]) -> Loads:
    """Loads that are given for an assembly, refused where they do not fit it; its weights along a direction if none."""
    if loads is None:
        return Loads.horizontal(assembly, direction)
    if len(instance("loads", loads, Loads).dead) != assembly.n_blocks:
        raise InputError(f"the loads are for {len(loads.dead)} blocks, the assembly has {assembly.n_blocks}")
    return loads


def bed_friction(assembly: Assembly) -> float:
    """Friction coefficient of all bed joints of an assembly, or of base joints where it has but one course [-].

    Raises
    ------
    NotApplicable
        When they differ: a closed form knows one value.
    """
    for kind in ("bed", "base"):
        values = np.unique([i.joint.tan_phi for i in assembly.interfaces if i.kind == kind])
        if len(values):
            if np.ptp(values) > _EPS:
                span = f"{values.min():.4g} to {values.max():.4g}"
                raise NotApplicable(f"friction of the bed joints differs ({span}); read the Facade with friction=...")
            return float(values[0])
    raise NotApplicable("friction cannot be read: the assembly has no bed joints")


def load_direction(assembly: Assembly, loads: Loads) -> tuple[str, int]:
    """Axis ("x" or "y") and sense (1 or -1) of live loads that are the weights turned horizontally.

    On the top course and on beams more than the weight may act, as from an overload that is mass.

    Parameters
    ----------
    assembly, loads : the problem

    Raises
    ------
    NotApplicable
        For any other live load on the units: a closed form has nowhere to put it.
    """
    units = [k for k, b in enumerate(assembly.blocks) if not assembly.fixed[k] and not b.name.startswith(BEAMS)]
    weight = assembly.weights[units]
    if not weight.sum() > 0.0:
        raise NotApplicable("no unit with weight is free to move: the closed forms turn the weights of units")
    live = loads.live[units, :3]
    vertical = live[:, 2] != 0.0
    total = live.sum(axis=0) / weight.sum()  # at least 1 along the axis of the load
    axis = int(np.argmax(np.abs(total[:2])))
    sense = 1 if total[axis] > 0 else -1
    expected = np.zeros_like(live)
    expected[:, axis] = sense * weight
    extra = live - expected
    levels = np.array([assembly.blocks[k].bounds[1, 2] for k in units])
    below = levels < levels.max() - _EPS * np.ptp(np.append(levels, 0.0))  # units below the top course
    if vertical.any() or (np.abs(extra[below]) > _EPS * weight[below, None]).any() or not abs(total[axis]) > 1.0 - _EPS:
        raise NotApplicable(
            "live loads must be the weights turned along x or y (Loads.horizontal, Loads.tilting), with more of them "
            "only on the top course and on beams: the closed forms know no other load"
        )
    return "xy"[axis], sense


def _read_overloads(assembly: Assembly, loads: Loads | None, found: dict, beyond: float) -> dict[str, float]:
    """Line loads on facade and side walls with their inertia, offset and rise of the facade's, as fields of a Facade.

    Parameters
    ----------
    assembly : built wall, with loading beams or loads on its top course
    loads : on it; weights along -y where omitted
    found : what was read of the wall, by name
    beyond : length of all side walls beyond the facade [m]
    """
    loads = loads_of(assembly, loads, (0.0, -1.0, 0.0))
    axis, sense = load_direction(assembly, loads)
    height = foot_level(assembly) + found["courses"] * found["course_height"]
    top = height * (1.0 - _EPS)
    vertical = {"facade": 0.0, "side": 0.0}
    moment = {"offset": 0.0, "rise": 0.0}  # of the facade's loads about its face y = 0, and about its top
    pushed = {"facade": 0.0, "side": 0.0}
    for k, block in enumerate(assembly.blocks):
        if assembly.fixed[k]:
            continue
        # a beam is overload with its own weight, a unit only with what acts on it beside its weight
        beam = block.name.startswith(BEAMS)
        own = 0.0 if beam else assembly.weights[k]
        push = loads.live[k, "xyz".index(axis)] * sense - own
        down = -loads.dead[k, 2] - own
        if max(abs(down), abs(push)) <= _EPS * assembly.weights[k]:
            continue
        if np.abs(loads.dead[k, :2]).max() > _EPS * abs(assembly.weights[k]) or down < 0.0:
            raise NotApplicable(f"dead load on block {block.name!r} must act downwards: the closed forms know no other")
        if block.bounds[1, 2] < top:
            raise NotApplicable(
                f"dead load on block {block.name!r} lies below the top course: it cannot be an overload"
            )
        side = "side" if block.name.startswith(("return", "beam-")) else "facade"
        vertical[side] += down
        pushed[side] += push
        if side == "facade":
            centre = assembly.centroids[k]
            # a force down at y off the centroid turns about x: m_x = -dy * down
            moment["offset"] += down * centre[1] - loads.dead[k, 3]
            # a push along y at dz above the centroid turns about x by m_x = -dz push, one along x about y by dz push
            own_moment = (-loads.live[k, 3] if axis == "y" else loads.live[k, 4]) * sense
            moment["rise"] += push * (centre[2] - height) + own_moment
    out: dict[str, float] = {}
    if vertical["facade"] > 0.0:
        y = moment["offset"] / vertical["facade"]
        out["overload"] = vertical["facade"] / found["length"]
        # the toe line is on the face towards which the wall falls
        out["overload_offset"] = max(found["thickness"] - y if axis == "y" and sense > 0 else y, 0.0)
        out["overload_inertia"] = _inertia(pushed["facade"], vertical["facade"])
        if pushed["facade"] > 0.0:
            out["overload_rise"] = max(moment["rise"] / pushed["facade"], 0.0)
    if vertical["side"] > 0.0:
        out["side_overload"] = vertical["side"] / beyond
        out["side_overload_inertia"] = _inertia(pushed["side"], vertical["side"])
    return out


def _inertia(push: float, down: float) -> float:
    """Horizontal over vertical force of an overload [-], none where it is rounding; both [N]."""
    return push / down if abs(push) > ROUNDING * down else 0.0
