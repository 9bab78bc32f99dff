"""Openings in the facade: units around are cut, pieces that come out too short join their neighbour, a head spans.

Units are sets of boxes. A unit cut at a corner of an opening keeps its L shape (a union of two boxes); a unit cut in
two becomes two units.

A course is a list of its units, from the start of the facade; ``placed`` are the openings with their places in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from limitmason.build.boxes import SAME, coalesced, connected, side_area, subtract
from limitmason.build.plan import Box, Unit
from limitmason.checks import choice, finite, positive
from limitmason.errors import InputError

# chosen
_ON_JOINT = 1e-6  # of a course's height: an edge this near to a bed joint is meant to be on it
_THINNEST = 0.1  # of a course's height: thinner slices beside an opening nobody lays


@dataclass(frozen=True)
class Opening:
    """A rectangular opening through the whole thickness of the facade.

    Parameters
    ----------
    x, z
        Lower left corner [m], from the facade's left end and from the bottom of the wall.
    width, height
        [m].
    lintel
        Height of the lintel [m]; None for one course; False for no lintel.
    bearing
        Length over which the head bears on the wall at each side [m]; None for half a unit under a lintel, and for
        none under soldiers.
    head
        "lintel": one block. "soldier": whole units on end, side by side, as high as a unit is long.
    """

    x: float
    z: float
    width: float
    height: float
    lintel: float | bool | None = None
    bearing: float | None = None
    head: str = "lintel"

    def __post_init__(self) -> None:
        """Check that its place and size are numbers.

        Whether it fits is known to the wall.
        """
        for name in ("x", "z", "width", "height"):
            finite(f"opening: {name} [m]", getattr(self, name))


@dataclass(frozen=True)
class Placed:
    """An opening with every number settled.

    `lintel` is the box of its head, `soldiers` how many fill it.
    """

    x0: float
    x1: float
    z0: float
    z1: float
    lintel: Box | None
    soldiers: int = 0

    @property
    def soldier_boxes(self) -> list[Box]:
        """The units of its soldier course, from the left.

        There are none under a lintel.
        """
        if self.lintel is None:
            return []
        (x0, y0, z0), (x1, y1, z1) = self.lintel
        ends = [x0 + (x1 - x0) * k / self.soldiers for k in range(self.soldiers)] + [x1]
        return [((a, y0, z0), (b, y1, z1)) for a, b in pairwise(ends)] if self.soldiers else []

    @property
    def reach(self) -> tuple[float, float]:
        """x0, x1 [m] of the opening together with its lintel."""
        if self.lintel is None:
            return self.x0, self.x1
        return self.lintel[0][0], self.lintel[1][0]


def place_openings(
    openings: Sequence[Opening | Mapping], *, length: float, thickness: float, levels: Sequence[float],
    unit: tuple[float, float, float], occupied: Sequence[tuple[str, float, float]] = (),
) -> list[Placed]:
    """Settle and check the openings of a facade.

    Parameters
    ----------
    openings
        `Opening`s, or mappings of their fields.
    length, thickness
        Of the facade [m].
    levels
        Heights of the bed joints [m].
    unit
        (length, height, thickness) of a unit [m], from which lintel and bearing take their defaults.
    occupied
        (name, x0, x1) of the walls that meet the facade; neither opening nor lintel may reach into them.

    Raises
    ------
    InputError
        Naming the opening: outside the facade, into a return, over another opening, or leaving a slice thinner than a
        tenth of a course.
    """
    if isinstance(openings, Opening | Mapping) or not isinstance(openings, Iterable):
        raise InputError("openings must be a list: write openings=[...] for one")
    placed: list[Placed] = []
    height = levels[-1]
    for number, given in enumerate(openings):
        where = f"openings[{number}]"
        opening = _opening(given, where)
        x0, z0 = finite(f"{where}.x", opening.x), finite(f"{where}.z", opening.z)
        x1, z1 = x0 + positive(f"{where}.width", opening.width), z0 + positive(f"{where}.height", opening.height)
        if x0 < -SAME or x1 > length + SAME or z0 < -SAME or z1 > height + SAME:
            raise InputError(
                f"{where} spans x {x0:g} to {x1:g}, z {z0:g} to {z1:g} m and leaves the facade "
                f"({length:g} x {height:g} m)"
            )
        z0, z1 = _snap(f"{where}.z", z0, levels), _snap(f"{where}.height", z1, levels)
        soldier = choice(f"{where}.head", opening.head, ("lintel", "soldier")) == "soldier"
        if soldier and opening.lintel is not None:
            raise InputError(f"{where}.lintel is not used with head='soldier': leave it out")
        # an opening up to the top of the wall has nothing to bear, unless a lintel was asked for, which is then refused
        asked = soldier or not (opening.lintel is None or opening.lintel is False) or opening.bearing is not None
        wanted = opening.lintel is not False and (z1 < height or asked)
        if opening.lintel is False and opening.bearing is not None:
            raise InputError(f"{where}.bearing is that of a lintel, and lintel is False: leave it out")
        lintel = _head(where, opening, (x0, x1, z1), (length, thickness), levels, unit) if wanted else None
        soldiers = _soldiers(where, lintel, unit[1]) if soldier and lintel is not None else 0
        here = Placed(max(x0, 0.0), min(x1, length), z0, z1, lintel, soldiers)
        _check_neighbours(where, here, placed, occupied)
        placed.append(here)
    return placed


def cut_openings(
    courses: list[list[Unit]], openings: Sequence[Placed], *, thickness: float, min_piece: float
) -> list[list[Unit]]:
    """Cut the openings and their lintels out of the facade's units.

    A piece shorter than `min_piece` [m] joins the unit beside it in its course, if there is one.

    Parameters
    ----------
    courses : units of every course, bottom course first
    openings : that are cut out
    thickness : of the facade [m]
    min_piece : [m]
    """
    holes: list[Box] = []
    for opening in openings:
        holes.append(((opening.x0, 0.0, opening.z0), (opening.x1, thickness, opening.z1)))
        if opening.lintel is not None:
            holes.append(opening.lintel)
    result: list[list[Unit]] = []
    for units in courses:
        touched: list[Unit] = []
        whole: list[Unit] = []
        for unit in units:
            boxes = unit.boxes
            for hole in holes:
                boxes = [rest for box in boxes for rest in subtract(box, hole)]
            if boxes == unit.boxes:
                whole.append(unit)
                continue
            for part in connected(boxes):
                touched.append(Unit(unit.run, unit.course, unit.leaf, part, unit.axis))
        result.append(_merge_short(whole, touched, min_piece) if touched else whole)
    return result


def _head(
    where: str, opening: Opening, hole: tuple[float, float, float], wall: tuple[float, float], levels: Sequence[float],
    unit: tuple[float, float, float],
) -> Box:
    """Box of the lintel or of the soldiers over an opening [m].

    Parameters
    ----------
    where : name of the opening in errors
    opening : as given
    hole : x0, x1 and top of the opening [m]
    wall : length and thickness of the facade [m]
    levels : heights of the bed joints [m]
    unit : length, height, thickness of a unit [m]
    """
    x0, x1, z1 = hole
    length, thickness = wall
    unit_length, unit_height, _ = unit
    soldier, height = opening.head == "soldier", levels[-1]
    # "is": a lintel of 1 m equals True
    one_course = opening.lintel is None or opening.lintel is True
    depth = unit_height if one_course else positive(f"{where}.lintel", opening.lintel)
    # soldiers are units on end, and stand between the jambs unless a bearing is given
    depth = unit_length if soldier else depth
    bearing = unit_length / 2.0 if opening.bearing is None else positive(f"{where}.bearing", opening.bearing)
    bearing = 0.0 if soldier and opening.bearing is None else bearing
    top = z1 + depth
    if top > height + SAME:
        name = "head: the soldiers'" if soldier else "lintel: its"
        raise InputError(f"{where}.{name} top at {top:g} m is above the wall ({height:g} m)")
    if x0 - bearing < -SAME or x1 + bearing > length + SAME:
        raise InputError(f"{where}.bearing {bearing:g} m reaches beyond the end of the facade")
    top = _snap(f"{where}.{'head' if soldier else 'lintel'}", top, levels)
    return (max(x0 - bearing, 0.0), 0.0, z1), (min(x1 + bearing, length), thickness, top)


def _soldiers(where: str, band: Box, width: float) -> int:
    """Number of units on end that fill the box of a head without a gap.

    Parameters
    ----------
    where : name of the opening in errors
    band : the box [m]
    width : of a unit on end, its height as laid [m]
    """
    span = band[1][0] - band[0][0]
    number = round(span / width)
    if number < 1 or abs(span - number * width) > _ON_JOINT * width:
        raise InputError(
            f"{where}.head: soldiers of {width:g} m do not fill {span:g} m; make width plus bearings a multiple of it"
        )
    return number


def _opening(given: Opening | Mapping, where: str) -> Opening:
    """An opening, given as one or as a mapping of its fields.

    ``where`` names it in errors.
    """
    if isinstance(given, Opening):
        return given
    if isinstance(given, Mapping):
        try:
            return Opening(**given)
        except TypeError as problem:
            raise InputError(f"{where}: {problem}") from None
    raise InputError(f"{where} must be an Opening or a mapping with its fields, got {given!r}")


def _snap(field: str, z: float, levels: Sequence[float]) -> float:
    """Return the bed joint at height z [m], or z itself if it is well inside a course.

    Parameters
    ----------
    field : name of the edge in errors
    z : height of an edge of an opening or its head [m]
    levels : of the bed joints, from the foot to the top [m]
    """
    for course in range(len(levels) - 1):
        low, high = levels[course], levels[course + 1]
        if low - SAME <= z <= high + SAME:
            thin = _THINNEST * (high - low)
            for bed in (low, high):
                if abs(z - bed) <= _ON_JOINT * (high - low):
                    return bed
                if abs(z - bed) < thin:
                    raise InputError(
                        f"{field}: the edge at {z:g} m leaves a slice of {abs(z - bed):.3g} m beside the bed joint at "
                        f"{bed:g} m; move it onto the joint"
                    )
    return z


def _check_neighbours(
    where: str, here: Placed, placed: Sequence[Placed], occupied: Sequence[tuple[str, float, float]]
) -> None:
    """Refuse an opening that, with its lintel, cuts into a wall or another opening.

    Parameters
    ----------
    where : its name in errors
    here : the opening
    placed : the openings before it
    occupied : walls that stand in the way: name, from x and to x [m]
    """
    x0, x1 = here.reach
    for name, low, high in occupied:
        if x0 < high - SAME and x1 > low + SAME:
            raise InputError(
                f"{where} (with its lintel) spans x {x0:g} to {x1:g} m and cuts into {name} ({low:g} to {high:g} m)"
            )
    for index, other in enumerate(placed):
        if any(_cross(a, b) for a in _rectangles(here) for b in _rectangles(other)):
            raise InputError(f"{where} (with its lintel) overlaps openings[{index}]")


def _rectangles(opening: Placed) -> list[tuple[float, float, float, float]]:
    """x0, x1, z0, z1 [m] of an opening and of its lintel."""
    found = [(opening.x0, opening.x1, opening.z0, opening.z1)]
    if opening.lintel is not None:
        low, high = opening.lintel
        found.append((low[0], high[0], low[2], high[2]))
    return found


def _cross(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    """Whether two rectangles x0, x1, z0, z1 [m] have an area in common."""
    ax0, ax1, az0, az1 = a
    bx0, bx1, bz0, bz1 = b
    return min(ax1, bx1) - max(ax0, bx0) > SAME and min(az1, bz1) - max(az0, bz0) > SAME


def _merge_short(whole: list[Unit], touched: list[Unit], min_piece: float) -> list[Unit]:
    """Units of a course from left to right, pieces too short joined to others.

    Of two neighbours the one with the larger common side takes the piece.

    Parameters
    ----------
    whole : units of the course that are as laid
    touched : those that an opening has cut
    min_piece : pieces shorter than this are too short [m]
    """
    pending = sorted(touched, key=_length)
    units = [*whole, *touched]
    for piece in pending:
        if _length(piece) >= min_piece - SAME:
            continue
        best, area = None, 0.0
        for other in units:
            if other is piece:
                continue
            shared = sum(side_area(a, b) for a in piece.boxes for b in other.boxes)
            # of sides that are equal but for rounding the first
            if shared > area * (1.0 + 1e-9):
                best, area = other, shared
        if best is not None:
            best.boxes = coalesced([*best.boxes, *piece.boxes])
            units = [unit for unit in units if unit is not piece]
    return sorted(units, key=lambda unit: (unit.extent(0)[0], unit.extent(1)[0], unit.extent(2)[0]))


def _length(unit: Unit) -> float:
    """Extent of a unit along the facade [m]."""
    low, high = unit.extent(0)
    return high - low
