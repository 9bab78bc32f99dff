"""Masonry bonds along one straight run of wall: where the head joints of two successive courses fall.

A run is laid in two courses that alternate. The *leading* course covers the whole run: at a corner it passes through
to the outer face. The *lapping* course is derived from it, unit by unit, so that its head joints fall over the units
below and never over their joints; at a corner it stops against the crossing wall, whose units pass through in that
course. Positions u [m] run along the wall from 0 to its length.

``length`` is that of the run that is laid [m]; a ``Piece`` begins and ends at distances from the run's start.
"""

from __future__ import annotations

from itertools import pairwise
from string import ascii_lowercase

from limitmason.build.leading_course import BONDS, TOLERANCE, Bond, Ends, Leading, Piece, Size, is_header
from limitmason.checks import choice, count, positive
from limitmason.errors import InputError

_TWO_JOINTS_OVER = 0.75  # of a stretcher, chosen: over a shorter piece of English bond one joint stands, in the middle
_HEADER_OVER = 1.75  # of a header's width, chosen: over a shorter piece of Flemish bond no header is centred
_TWICE = 1e-6  # of a unit's length, chosen: a unit this near to twice as long as thick is meant so


def make_bond(
    name: str, unit: tuple[float, float, float], *, leaves: int | None = None, staggering: float | None = None,
    min_piece: float | None = None,
) -> Bond:
    """Return the bond `name` for units (length, height, thickness) [m].

    Running bond lays stretchers in `leaves` leaves, so the wall is `leaves` unit thicknesses thick; header, English and
    Flemish bond make a wall one unit length thick.

    Parameters
    ----------
    name : "running", "header", "english" or "flemish"
    unit : length, height and thickness of a unit, joints included [m]
    leaves : of running bond, 1 where None
    staggering : of running and header bond: shorter overlap of a unit over the one below [m], half a unit where None
    min_piece : length below which no piece is laid [m], a quarter of the unit's length along the wall where None

    Raises
    ------
    InputError
        Unknown bond; staggering beyond half a unit; English or Flemish bond with a unit not twice as long as thick.
    """
    choice("bond", name, BONDS)
    length, _, thickness = unit
    half_bonded = name in ("english", "flemish")
    # two headers cover a stretcher: only then do joints of every course fall over units of the next
    if half_bonded and abs(length - 2.0 * thickness) > _TWICE * length:
        raise InputError(
            f"unit: {name} bond needs units twice as long as thick (nominal sizes, joints included), "
            f"got {length:g} x {thickness:g} m"
        )
    # module: length along the wall of each unit that a leading course repeats, and whether it is a header. pitch is the
    # longest of these lengths, across the number of units side by side in the thickness, depth the thickness
    if name == "running":
        number = count("leaves", 1 if leaves is None else leaves)
        if number > len(ascii_lowercase):  # names of blocks have a letter for the leaf
            raise InputError(f"leaves must be at most {len(ascii_lowercase)}, got {leaves!r}")
        module: tuple[Size, ...] = ((length, False),)
        pitch, across, depth = length, number, number * thickness
    else:
        if leaves is not None:
            raise InputError(f"leaves is for running bond; a wall in {name} bond is one unit length thick")
        depth, across = length, 2 if half_bonded else 1
        module = {
            "header": ((thickness, True),),
            "english": ((length, False),),
            "flemish": ((length, False), (thickness, True)),
        }[name]
        pitch = module[0][0]
    if staggering is None:
        lap = pitch / 4.0 if half_bonded else pitch / 2.0
    elif half_bonded:
        raise InputError(f"staggering of {name} bond is a quarter of the unit length; leave it out")
    else:
        lap = positive("staggering", staggering)
        if lap > pitch / 2.0 * (1.0 + TOLERANCE):
            raise InputError(
                f"staggering is the shorter overlap of two courses, at most half a unit ({pitch / 2.0:g} m); "
                f"got {lap:g} m"
            )
    shortest = pitch / 4.0 if min_piece is None else positive("min_piece", min_piece)
    if shortest > pitch / 2.0:
        raise InputError(f"min_piece must not exceed half a unit ({pitch / 2.0:g} m), got {shortest:g} m")
    return Bond(
        name=name, pitch=pitch, module=module, header_width=thickness, staggering=lap, leaves=across, thickness=depth,
        min_piece=shortest,
    )


def lapping_course(bond: Bond, length: float, ends: Ends, leading: Leading) -> tuple[Piece, ...]:
    """Return the course laid over and under the leading one, between crossing walls.

    Parameters
    ----------
    bond : of both courses
    length : of the run [m]
    ends : thickness of the walls that cross at its start and end [m], 0 for a free end, and the span of a T junction
    leading : the course that it laps
    """
    low, high = ends.start, length - ends.end
    if ends.crossing is None:
        intervals = [(low, high)]
    else:
        intervals = [(low, ends.crossing[0]), (ends.crossing[1], high)]
    below = [p.start for p in leading.pieces[1:]]
    joints = _lapping_joints(bond, length, ends, leading)
    course: list[Piece] = []
    for start, end in intervals:
        if end - start <= bond.tolerance:
            continue
        # joints that would leave too short a piece at an end are left out
        least = bond.min_piece - bond.tolerance
        inside = [u for u in joints if u - start >= least and end - u >= least]
        cuts = [start, *inside, end]
        if bond.name in ("english", "flemish"):
            # at a free end of the run, where no wall crosses
            if start == 0.0:
                cuts = _closer_second(bond, cuts, below)
            if end == length:  # the same there, on the mirror image of the course
                mirrored = _closer_second(bond, [length - u for u in cuts[::-1]], [length - u for u in below])
                cuts = [start, *(length - u for u in mirrored[-2:0:-1]), end]
        for a, b in pairwise(cuts):
            course.append(Piece(a, b, is_header(bond, b - a)))
    return tuple(course)


def drop_cut_ends(bond: Bond, course: tuple[Piece, ...], length: float, ends: Ends) -> tuple[Piece, ...]:
    """Return the course without the cut units at its free ends.

    A ragged end is made of whole units only.

    Parameters
    ----------
    bond : that it is laid in
    course : its pieces
    length : of the run [m]
    ends : what bounds the run; 0 for a free end
    """
    pieces = list(course)
    whole = bond.pitch - bond.tolerance
    if pieces and not ends.start and pieces[0].start <= bond.tolerance and pieces[0].end - pieces[0].start < whole:
        del pieces[0]
    at_end = bool(pieces) and not ends.end and pieces[-1].end >= length - bond.tolerance
    if at_end and pieces[-1].end - pieces[-1].start < whole:
        del pieces[-1]
    return tuple(pieces)


def smallest_overlap(lower: tuple[Piece, ...], upper: tuple[Piece, ...]) -> float:
    """Return the smallest distance between head joints of two courses [m].

    A head joint is an end of a piece inside the run (where a lapping course stops against a crossing wall there is a
    joint too); the ends of the run itself do not count. Infinite if one of the courses has no head joint.

    Parameters
    ----------
    lower, upper : pieces of the two courses
    """
    if not lower or not upper:
        return float("inf")
    edges = (min(lower[0].start, upper[0].start), max(lower[-1].end, upper[-1].end))
    tolerance = TOLERANCE * (edges[1] - edges[0])
    inner = []
    for course in (lower, upper):
        ends = {p.start for p in course} | {p.end for p in course}
        inner.append([u for u in ends if edges[0] + tolerance < u < edges[1] - tolerance])
    return min((abs(a - b) for a in inner[0] for b in inner[1]), default=float("inf"))


def _lapping_joints(bond: Bond, length: float, ends: Ends, leading: Leading) -> list[float]:
    """Places of the head joints of the lapping course in increasing order [m].

    Over every piece of the leading course there is one, or two.

    Parameters
    ----------
    bond : of both courses
    length : of the run [m]
    ends : what bounds the run
    leading : the course below, with the sense in which each piece was laid
    """
    joints: list[float] = []
    for piece, sense in zip(leading.pieces, leading.senses, strict=True):
        size = piece.end - piece.start
        # the last piece laid towards a free end is cut by it
        at_end = piece.end == length and not ends.end and sense > 0
        at_start = piece.start == 0.0 and not ends.start and sense < 0
        for offset in _offsets(bond, size, piece.header, clipped=at_end or at_start, centred=sense == 0):
            if bond.tolerance < offset < size - bond.tolerance:
                joints.append(piece.end - offset if sense < 0 else piece.start + offset)
    return sorted(joints)


def _offsets(bond: Bond, size: float, header: bool, *, clipped: bool, centred: bool) -> list[float]:
    """Where the lapping course has joints over one piece [m].

    Distances are from the end that the piece was laid from.

    A unit clipped by the free end of the wall keeps the distances of a whole one; a unit cut to fit between two corners
    is lapped at its middle if it is too short for them.

    English bond laps a stretcher at its quarters, over the middles of headers half as long. Shorter than three quarters
    of it, two joints would stand too close. Flemish bond centres a header on a stretcher. Shorter than 1.75 headers,
    too little would be left beside it.

    Parameters
    ----------
    bond : of both courses
    size : length of the piece [m]
    header : whether it goes through the whole thickness
    clipped : whether the wall's free end has cut it
    centred : whether it lies in the very middle
    """
    if bond.name == "english":
        whole = bond.pitch if clipped else size
        if whole <= _TWO_JOINTS_OVER * bond.pitch + bond.tolerance:
            return [whole / 2.0]
        return [whole / 4.0, 3.0 * whole / 4.0]
    if bond.name == "flemish":
        if header:
            return []
        whole = bond.pitch if clipped else size
        if whole < _HEADER_OVER * bond.header_width:
            return [whole / 2.0]
        return [(whole - bond.header_width) / 2.0, (whole + bond.header_width) / 2.0]
    lap = bond.staggering if clipped else min(bond.staggering, size / 2.0)
    if not centred:
        return [lap]
    # a middle piece is lapped from both ends, unless too little would lie between the two joints
    return [lap, size - lap] if size - 2.0 * lap >= bond.min_piece else [size / 2.0]


def _closer_second(bond: Bond, cuts: list[float], below: list[float]) -> list[float]:
    """Swap a closer at the free start of a course with the header behind it.

    The wall then ends in a whole header. The course stays where the moved joint would come too near one of the course
    below. Returned are the ends of its pieces [m].

    Parameters
    ----------
    bond : English or Flemish
    cuts : ends of the pieces of the course [m]
    below : head joints of the course below [m]
    """
    # the first piece is no closer, which is narrower than a header
    if len(cuts) < 3 or cuts[1] - cuts[0] >= bond.header_width - bond.tolerance:
        return cuts
    moved = cuts[0] + cuts[2] - cuts[1]
    # the piece behind it is no header
    if cuts[2] - cuts[1] > bond.header_width + bond.tolerance:
        return cuts
    # the quarter of a unit by which these bonds lap
    if any(abs(moved - u) < bond.pitch / 4.0 - bond.tolerance for u in below):
        return cuts
    return [cuts[0], moved, *cuts[2:]]
