"""Wall plans: straight, L, T, U and closed, as runs of wall that interlock where they meet, laid course by course.

The facade runs along x with its outer face at y = 0 and its thickness towards +y; returns leave it in the +y direction.
In one course the facade passes through the corner and the returns stop against it, in the next course the returns pass
through: no two units overlap and none is missing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from limitmason.build.bond import drop_cut_ends, lapping_course, smallest_overlap
from limitmason.build.leading_course import Bond, Ends, Piece, leading_course
from limitmason.checks import choice, positive
from limitmason.errors import InputError

# lower and upper corner [m]
Box = tuple[tuple[float, float, float], tuple[float, float, float]]

PLANS = ("straight", "L", "T", "U", "box")


@dataclass(frozen=True)
class StraightWall:
    """One straight wall of the plan, a run.

    Parameters
    ----------
    name : "facade", "return-left", "return-right", "return-middle" or "rear"
    axis : of its length, 0 for x, 1 for y
    origin : x, y of the corner from which length and thickness are measured, both in the positive direction [m]
    length, thickness : outside to outside [m]
    ends : what crosses it at its ends, and between
    outer_first : whether the outer face is the one at the origin
    leads_even : whether it passes through the corners in even courses, counted from 0
    """

    name: str
    axis: int
    origin: tuple[float, float]
    length: float
    thickness: float
    ends: Ends
    outer_first: bool = True
    leads_even: bool = True

    @property
    def footprint(self) -> tuple[float, float, float, float]:
        """x0, x1, y0, y1 [m]."""
        x, y = self.origin
        along, across = self.length, self.thickness
        return (x, x + along, y, y + across) if self.axis == 0 else (x, x + across, y, y + along)


@dataclass
class Unit:
    """A unit while the wall is being laid.

    Parameters
    ----------
    run : name of the wall it is in
    course : counted from 0 at the bottom
    leaf : counted from 0 at the outer face, -1 for a unit through the whole thickness
    boxes : that it fills together [m]
    axis : along which its length is laid, 0 for x, 1 for y
    """

    run: str
    course: int
    leaf: int
    boxes: list[Box]
    axis: int

    def extent(self, k: int) -> tuple[float, float]:
        """Smallest and largest coordinate of the unit [m].

        The number ``k`` says which, of x, y or z.
        """
        return min(box[0][k] for box in self.boxes), max(box[1][k] for box in self.boxes)


def make_runs(
    plan: str,
    length: float,
    thickness: float,
    *,
    return_length: float | tuple[float, float] | None = None,
    return_thickness: float | None = None,
    return_position: float | None = None,
    corner: str | None = None,
) -> list[StraightWall]:
    """Return the runs of a plan, facade first.

    Parameters
    ----------
    plan
        "straight", "L" (one return, at the end `corner`), "T" (one return in the field of the facade), "U" (two),
        "box" (two, closed by a rear wall as thick as the facade).
    length, thickness
        Of the facade, outside to outside [m].
    return_length
        From the facade's outer face to the return's free end, or to the outer face of the rear wall [m]; a pair
        (left, right) for "U".
    return_thickness
        [m]; the facade's where omitted.
    return_position
        "T" only: x of the return's axis [m]; the middle of the facade where omitted.
    corner
        "L" only: "left" or "right" end of the facade; left where omitted.
    """
    choice("plan", plan, PLANS)
    if corner is not None:
        choice("corner", corner, ("left", "right"))
    # what the plan has no use for is refused, not passed over
    if plan == "straight":
        for name, value in (("return_length", return_length), ("return_thickness", return_thickness)):
            if value is not None:
                raise InputError(f"{name} is given but plan is 'straight'; choose plan 'L', 'T', 'U' or 'box'")
    if plan != "T" and return_position is not None:
        raise InputError(f"return_position is for plan 'T', got plan {plan!r}")
    if plan != "L" and corner is not None:
        raise InputError(f"corner is for plan 'L', got plan {plan!r}")
    facade = StraightWall(name="facade", axis=0, origin=(0.0, 0.0), length=length, thickness=thickness, ends=Ends())
    if plan == "straight":
        return [facade]
    if return_length is None:
        raise InputError(f"return_length is needed for plan {plan!r}")
    depth = thickness if return_thickness is None else positive("return_thickness", return_thickness)
    both = return_length if isinstance(return_length, (tuple, list)) else (return_length, return_length)
    if len(both) != 2 or (plan != "U" and isinstance(return_length, (tuple, list))):
        raise InputError(
            f"return_length must be one length, or a pair (left, right) for plan 'U'; got {return_length!r}"
        )
    lengths = [positive("return_length", value) for value in both]
    for value in lengths:
        if value <= thickness:
            raise InputError(f"return_length {value:g} m does not reach beyond the facade ({thickness:g} m thick)")
        if plan == "box" and value <= 2.0 * thickness:
            raise InputError(f"return_length {value:g} m leaves no room between facade and rear wall")
    needed = 2.0 * depth if plan in ("U", "box") else depth
    if length <= needed:
        raise InputError(f"length {length:g} m leaves no facade beside returns {depth:g} m thick")

    def make(name: str, x: float, reach: float, *, outer_first: bool) -> StraightWall:
        """A return from x [m] on, ``reach`` [m] long.

        ``outer_first`` says that its outer face is the one at x.
        """
        ends = Ends(thickness, thickness) if plan == "box" else Ends(start=thickness)
        return StraightWall(
            name=name, axis=1, origin=(x, 0.0), length=reach, thickness=depth, ends=ends, outer_first=outer_first,
            leads_even=False,
        )

    left = make("return-left", 0.0, lengths[0], outer_first=True)
    right = make("return-right", length - depth, lengths[1], outer_first=False)
    if plan in ("U", "box"):
        facade = replace(facade, ends=Ends(depth, depth))
        rear = replace(facade, name="rear", origin=(0.0, lengths[0] - thickness), outer_first=False)
        return [facade, left, right] + ([rear] if plan == "box" else [])
    if plan == "L":
        ends, beside = (Ends(end=depth), right) if corner == "right" else (Ends(start=depth), left)
        return [replace(facade, ends=ends), beside]
    middle = length / 2.0 if return_position is None else positive("return_position", return_position)
    x0 = middle - depth / 2.0
    if x0 <= 0.0 or x0 + depth >= length:
        raise InputError(f"return_position {middle:g} m puts the return at the end of the facade; use plan 'L'")
    stem = make("return-middle", x0, lengths[0], outer_first=True)
    return [replace(facade, ends=Ends(crossing=(x0, x0 + depth))), stem]


@dataclass(frozen=True)
class Courses:
    """The two alternating courses of one run, and the smallest ``overlap`` of theirs [m]."""

    leading: tuple[Piece, ...]
    lapping: tuple[Piece, ...]
    overlap: float


def lay_courses(bond: Bond, run: StraightWall, *, ragged: tuple[bool, bool]) -> Courses:
    """Return the two courses of a run.

    Parameters
    ----------
    bond : that it is laid in
    run : whose length and ends they fill
    ragged : whether no cut unit closes the free end at the start, and that at the end
    """
    leading = leading_course(bond, run.length, run.ends)
    lapping = lapping_course(bond, run.length, run.ends, leading)
    overlap = smallest_overlap(leading.pieces, lapping)
    at_start, at_end = ragged
    # an end that is not ragged is treated like a corner, where nothing is dropped: any thickness but 0 says so
    kept = Ends(start=run.ends.start or float(not at_start), end=run.ends.end or float(not at_end))
    return Courses(
        drop_cut_ends(bond, leading.pieces, run.length, kept), drop_cut_ends(bond, lapping, run.length, kept), overlap
    )


def lay_run(
    run: StraightWall, courses: Courses, levels: list[float], *, bond: Bond, start_half: bool = False,
    header_every: tuple[int, int] | None = None,
) -> list[list[Unit]]:
    """Return the units of a run, course by course from the bottom.

    Parameters
    ----------
    run, courses, bond
        The run, its two alternating courses, and the bond they were laid in.
    levels
        Heights of the bed joints [m], one more than there are courses.
    start_half
        Whether the bottom course of the facade is the lapping one.
    header_every
        (k, j): in every k-th course every j-th position is one through-stone that ties the leaves.

    Notes
    -----
    A unit is a box along the run from ``a`` to ``b``, across it from ``c`` to ``d``, and from ``low`` to ``high`` [m].
    """
    laid: list[list[Unit]] = []
    origin_along, origin_across = run.origin[run.axis], run.origin[1 - run.axis]
    edges = [origin_across + run.thickness * k / bond.leaves for k in range(bond.leaves)]
    edges.append(origin_across + run.thickness)
    for course in range(len(levels) - 1):
        even = (course + int(start_half)) % 2 == 0
        pieces = courses.leading if even == run.leads_even else courses.lapping
        low, high = levels[course], levels[course + 1]
        tying = _through_stones(header_every, course, len(pieces))
        units: list[Unit] = []
        for position, piece in enumerate(pieces):
            a, b = origin_along + piece.start, origin_along + piece.end
            header = piece.header or position in tying
            through = header or bond.leaves == 1
            axis = 1 - run.axis if header else run.axis
            for leaf in range(1 if through else bond.leaves):
                c, d = (edges[0], edges[-1]) if through else (edges[leaf], edges[leaf + 1])
                box = ((a, c, low), (b, d, high)) if run.axis == 0 else ((c, a, low), (d, b, high))
                # leaf 0 is the outer one
                number = leaf if run.outer_first else bond.leaves - 1 - leaf
                units.append(Unit(run.name, course, -1 if through else number, [box], axis))
        laid.append(units)
    return laid


def _through_stones(header_every: tuple[int, int] | None, course: int, positions: int) -> set[int]:
    """Positions of a course where one stone ties all leaves, counted from 0.

    Parameters
    ----------
    header_every : (k, j), in every k-th course every j-th position; None for none
    course : counted from 0
    positions : how many the course has
    """
    if header_every is None:
        return set()
    every_course, every_position = header_every
    turn, between = divmod(course + 1, every_course)
    if between:
        return set()
    # through-stones of successive header courses stand in quincunx
    shift = (every_position // 2) * (turn % 2)
    return {k for k in range(positions) if (k + shift) % every_position == 0}
