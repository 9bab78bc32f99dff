"""Walls laid in a bond on a straight, L, T, U or closed plan, with openings, lintels, through-stones and beam."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from limitmason.build.arguments import courses_from, unit_size
from limitmason.build.bond import make_bond
from limitmason.build.cracks import unit_crack_planes, with_potential_cracks
from limitmason.build.erect import Site, add_ground, add_units
from limitmason.build.leading_course import Bond
from limitmason.build.opening import Opening, Placed, cut_openings, place_openings
from limitmason.build.plan import StraightWall, Unit, lay_courses, lay_run, make_runs
from limitmason.checks import choice, count, positive
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint

_ENDS = ("flush", "ragged")
_MAY_CRACK = 0.75  # of a unit's length, chosen: shorter pieces get no potential crack


def wall(
    *,
    length: float,
    unit: tuple[float, float, float],
    joint: Joint,
    height: float | None = None,
    courses: int | None = None,
    density: float = 2000.0,
    bond: str = "running",
    leaves: int | None = None,
    header_every: tuple[int, int] | None = None,
    staggering: float | None = None,
    start: str = "whole",
    ends: str | tuple[str, str] = "flush",
    min_piece: float | None = None,
    plan: str = "straight",
    return_length: float | tuple[float, float] | None = None,
    return_thickness: float | None = None,
    return_position: float | None = None,
    corner: str | None = None,
    openings: Sequence[Opening | Mapping] = (),
    lintel_density: float | None = None,
    base: str | None = "slab",
    base_margin: float | None = None,
    top_beam: float | None = None,
    beam_over: str = "facade",
    beam_density: float | None = None,
    spreader: tuple[float, float] | None = None,
    joints: Mapping | None = None,
    unit_cracks: Joint | None = None,
    tolerance: float | None = None,
) -> Assembly:
    """Return a masonry wall of units in contact, without gaps and without overlaps.

    The facade runs along x from 0 to `length`, its outer face at y = 0, its thickness towards +y, its foot at z = 0;
    returns leave it in the +y direction. Courses alternate: in the odd ones (the bottom one is the first) the facade
    passes through the corners, in the even ones the returns do.

    Parameters
    ----------
    length
        Of the facade, outside to outside [m].
    unit
        (length, height, thickness) of a stretcher [m], nominal: joints have no thickness.
    joint
        Law of every joint, unless `joints` says otherwise.
    height, courses
        Exactly one of them: height [m], a whole number of courses; or the number of courses.
    density
        [kg/m3], of the units and whatever has no density of its own.
    bond
        "running": stretchers. "header": units laid across. "english": courses of stretchers and of headers in turn.
        "flemish": stretcher and header in turn in every course. The last three make a wall one unit length thick.
    leaves
        Running bond only: number of leaves, each one unit thick (default 1). Leaves touch; what ties them is
        `header_every` and the corners.
    header_every
        (k, j): in every k-th course every j-th unit position is one stone through all leaves, in quincunx.
    staggering
        Running and header bond: shorter overlap of a unit over the one below [m], default half a unit.
    start
        "whole" or "half": the bottom course of the facade is the one with whole units at its end (and through the
        corner), or the other one.
    ends
        "flush": cut units close the free ends; "ragged": no cut unit at a free end, every other course steps back. A
        pair gives left and right end of a straight wall.
    min_piece
        Cut pieces shorter than this [m] join their neighbour; default a quarter of a unit.
    plan
        "straight", "L", "T", "U", or "box": closed by a wall "rear" as thick as the facade, for towers. A "T" is a
        wall with a buttress.
    return_length
        From the outer face of the facade to the free end of the return, or to the outer face of the rear wall [m]; for
        "U" also a pair (left, right).
    return_thickness
        Running bond in one leaf only [m]; default that of the facade.
    return_position
        "T" only: x of the axis of the return [m], default the middle of the facade.
    corner
        "L" only: "left" or "right", default "left".
    openings
        `Opening` objects (or mappings of their fields) in the facade. A lintel is one block with the stated bearing, a
        soldier course whole units on end.
    lintel_density, beam_density
        [kg/m3]; default `density`.
    base
        "slab": a held block "base" under everything. "course": no slab, the units of the bottom course are held.
        None: nothing is held.
    base_margin
        Projection of the slab on every side, default half a unit [m]; it is one course thick.
    top_beam
        Height of a loading beam on the top [m]; none where omitted.
    beam_over
        "facade": block "beam" over the whole facade; "returns": blocks "beam-left" and so on over the returns from
        the inner face of the facade on, to that of the rear wall; "all": these and "beam-rear".
    spreader
        (length, height) of a plate on the top at mid-length of a straight wall, block "spreader" of the density of
        beams [m]; none where omitted.
    joints
        Laws by kind ("bed", "head", "base") or by pair of block names, as `Assembly.from_polyhedra` takes them.
    unit_cracks
        Law of a potential crack across the middle of every unit along its length, a joint of kind "crack" between
        "facade-03-05-a" and "facade-03-05-b"; pieces shorter than three quarters of a unit, held units, lintels,
        soldiers and beams stay whole. Other planes: :func:`limitmason.build.with_potential_cracks`.
    tolerance
        Gap or overlap up to which faces count as touching [m], as `Assembly.from_polyhedra` takes it.

    Returns
    -------
    Assembly
        Blocks "base", "facade-03-05" (course, position, from 01; leaves add "a" for the outer, "b"),
        "return-left-02-01", "lintel-1", "soldier-1-01", "beam", "spreader", in this order course by course. `recipe`
        holds what was built.

    Raises
    ------
    InputError
        Naming the argument that is wrong.

    Notes
    -----
    Wrong for irregular masonry: all units of a bond are alike but for cut pieces. `recipe["smallest_overlap"]` is the
    smallest overlap of two successive courses away from openings; beside an opening a cut may come nearer.
    """
    unit_length, unit_height, unit_thickness = unit_size(unit)
    size = (unit_length, unit_height, unit_thickness)
    total = positive("length", length)
    positive("density", density)
    number = courses_from(height, courses, unit_height)
    # pattern of the courses, with its thickness, leaves, pitch and least piece
    laid = make_bond(bond, size, leaves=leaves, staggering=staggering, min_piece=min_piece)
    choice("start", start, ("whole", "half"))
    choice("beam_over", beam_over, ("facade", "returns", "all"))
    header_every = _headers(header_every, laid.leaves, laid.name)
    if return_thickness is not None and (laid.name != "running" or laid.leaves > 1):
        raise InputError("return_thickness is for running bond in one leaf; other bonds fix the thickness")
    ragged = _ragged(ends, plan, laid.name)
    runs = make_runs(
        plan, total, laid.thickness, return_length=return_length, return_thickness=return_thickness,
        return_position=return_position, corner=corner,
    )
    levels = [unit_height * k for k in range(number + 1)]
    occupied = [(run.name, *run.footprint[:2]) for run in runs[1:] if run.name != "rear"]
    placed = place_openings(
        openings, length=total, thickness=laid.thickness, levels=levels, unit=size, occupied=occupied
    )
    by_run, overlap = _laid(runs, laid, levels, ragged, start == "half", header_every)
    if placed:
        by_run[0] = cut_openings(by_run[0], placed, thickness=laid.thickness, min_piece=laid.min_piece)
    site = Site(density)
    add_ground(site, _bounds(runs), size, base, base_margin)
    add_units(site, [[u for units in by_run for u in units[k]] for k in range(number)], fix_bottom=base == "course")
    _add_lintels(site, placed, lintel_density)
    _add_beams(site, runs, levels[-1], top_beam, beam_over, beam_density)
    _add_spreader(site, runs, levels[-1], spreader, top_beam, beam_density)
    recipe = {
        "kind": "wall", "plan": plan, "bond": bond, "length": total, "height": levels[-1], "thickness": laid.thickness,
        "courses": number, "unit": list(size), "unit_length": laid.pitch, "unit_height": unit_height,
        "unit_thickness": unit_thickness, "leaves": laid.leaves,
        "header_every": None if header_every is None else list(header_every), "staggering": laid.staggering,
        "smallest_overlap": None if overlap == float("inf") else overlap, "start": start,
        "ends": list(ends) if isinstance(ends, (tuple, list)) else ends, "min_piece": laid.min_piece,
        "returns": [_return_recipe(run) for run in runs[1:] if run.name != "rear"],
        "side_walls": sum(run.name.startswith("return") for run in runs),
        "side_wall_thickness": runs[1].thickness if len(runs) > 1 else 0.0,
        "openings": [_opening_recipe(opening) for opening in placed], "density": float(density), "base": base,
        "top_beam": top_beam, "beam_over": beam_over if top_beam is not None else None,
        "spreader": None if spreader is None else [float(s) for s in spreader],
    }
    built = site.assembly(joint, recipe, joints=joints, tolerance=tolerance)
    return built if unit_cracks is None else _with_unit_cracks(site, built, unit_cracks, _MAY_CRACK * unit_length)


def _laid(
    runs: Sequence[StraightWall], bond: Bond, levels: list[float], ragged: tuple[bool, bool], start_half: bool,
    header_every: tuple[int, int] | None,
) -> tuple[list[list[list[Unit]]], float]:
    """Units of every run, course by course, and the smallest overlap of courses [m].

    Parameters
    ----------
    runs : of the plan
    bond : of the facade, and of the returns but for their thickness
    levels : heights of the bed joints [m], one more than there are courses
    ragged : whether no cut unit closes the free end at the start, and that at the end
    start_half : whether the bottom course of the facade is the lapping one
    header_every : every how many courses and positions a header ties the leaves; None for no headers
    """
    by_run, overlap = [], float("inf")
    for run in runs:
        # a return of another thickness is laid in the same units
        own = bond if run.thickness == bond.thickness else replace(bond, thickness=run.thickness)
        courses = lay_courses(own, run, ragged=ragged)
        overlap = min(overlap, courses.overlap)
        by_run.append(lay_run(run, courses, levels, bond=own, start_half=start_half, header_every=header_every))
    return by_run, overlap


def _with_unit_cracks(site: Site, built: Assembly, cracks: object, shortest: float) -> Assembly:
    """The wall with potential cracks across the middle of its units.

    Parameters
    ----------
    site : whose names tell units from lintels, soldiers and beams
    built : the wall
    cracks : law of the cracks, checked here
    shortest : pieces shorter than this stay whole [m]
    """
    if not isinstance(cracks, Joint):
        raise InputError(f"unit_cracks must be the law of the cracks, a Joint, got {cracks!r}")
    may_crack = [n for n in site.names if n.startswith(("facade", "return", "rear")) and n not in site.fixed]
    return with_potential_cracks(built, unit_crack_planes(built, may_crack, shortest), cracks)


def _add_lintels(site: Site, placed: Sequence[Placed], density: float | None) -> None:
    """Add the lintels of openings, or the units on end above them.

    Parameters
    ----------
    site : to which they are added
    placed : the openings
    density : of lintels [kg/m3], the site's own where None; units on end have that of units
    """
    lintels = [opening.lintel for opening in placed if opening.lintel is not None and not opening.soldiers]
    if density is not None and not lintels:
        raise InputError("lintel_density is given but no opening has a lintel")
    for index, lintel in enumerate(lintels):
        site.add_box(f"lintel-{index + 1}", lintel, axis=0, density=density)
    for index, soldiers in enumerate([opening.soldier_boxes for opening in placed if opening.soldiers]):
        digits = max(2, len(str(len(soldiers))))
        for k, box in enumerate(soldiers):
            site.add_box(f"soldier-{index + 1}-{k + 1:0{digits}d}", box, axis=2)


def _headers(given: object, leaves: int, bond: str) -> tuple[int, int] | None:
    """Every how many courses and positions a header ties the leaves, or None.

    Parameters
    ----------
    given : as given, a pair of whole numbers or None
    leaves : of the wall; there is nothing to tie in one leaf
    bond : its name
    """
    if given is None:
        return None
    if bond != "running" or leaves < 2:
        raise InputError("header_every ties leaves: it needs running bond with leaves of 2 or more")
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise InputError(f"header_every must be a pair (every k-th course, every j-th position), got {given!r}")
    return count("header_every course", given[0]), count("header_every position", given[1])


def _ragged(ends: object, plan: str, bond: str) -> tuple[bool, bool]:
    """Whether the left and the right end of a wall are left ragged.

    Parameters
    ----------
    ends : as given, "flush", "ragged" or a pair of these
    plan : name of the plan; only a straight wall has two free ends
    bond : its name; English and Flemish bond end with closers, which are cut units
    """
    several = isinstance(ends, (tuple, list))
    pair = tuple(ends) if isinstance(ends, (tuple, list)) else (ends, ends)
    if several and (len(pair) != 2 or plan != "straight"):
        raise InputError(f"ends must be one word, or a pair (left, right) for a straight wall; got {ends!r}")
    left, right = (choice("ends", end, _ENDS) == "ragged" for end in pair)
    either = left or right
    if either and plan == "box":
        raise InputError("ends: a wall on a closed plan has no free end to be ragged")
    if either and bond in ("english", "flemish"):
        raise InputError(f"ends: ragged ends are for running and header bond, got bond {bond!r}")
    return left, right


def _bounds(runs: Sequence[StraightWall]) -> tuple[float, float, float, float]:
    """x0, x1, y0, y1 of the box around all runs in plan [m]."""
    prints = [run.footprint for run in runs]
    return (min(p[0] for p in prints), max(p[1] for p in prints), min(p[2] for p in prints), max(p[3] for p in prints))


def _add_beams(
    site: Site, runs: Sequence[StraightWall], top: float, given: float | None, over: str, density: float | None
) -> None:
    """Add a beam on the facade, on the returns, or on all runs.

    Parameters
    ----------
    site : to which they are added
    runs : of the plan, facade first
    top : level of the top of the wall [m]
    given : height of the beams [m]; None for none
    over : "facade", "returns" or "all"
    density : of the beams [kg/m3], the site's own where None
    """
    if given is None:
        if over != "facade":
            raise InputError("beam_over is given but top_beam is not")
        return
    depth = positive("top_beam", given)
    if over != "facade" and len(runs) == 1:
        raise InputError(f"beam_over {over!r} needs returns, but plan is 'straight'")
    rear = next((run for run in runs if run.name == "rear"), None)
    for run in runs:
        facade = run.name == "facade"
        # "facade" is for the facade alone, "returns" for all other runs but the rear wall
        if over != "all" and (facade != (over == "facade") or run is rear):
            continue
        x0, x1, y0, y1 = run.footprint
        # facade and rear wall have the corners
        if run.name.startswith("return"):
            y0, y1 = runs[0].thickness, y1 if rear is None else rear.footprint[2]
        name = "beam" if facade else f"beam-{run.name.removeprefix('return-')}"
        site.add_box(name, ((x0, y0, top), (x1, y1, top + depth)), axis=run.axis, density=density)


def _add_spreader(
    site: Site, runs: Sequence[StraightWall], top: float, given: object, top_beam: object, density: float | None
) -> None:
    """Add the block that spreads the load, in the middle of a straight wall's top.

    Parameters
    ----------
    site : to which it is added
    runs : of the plan, which must be the facade alone
    top : level of the top of the wall [m]
    given : (length, height) of the block [m]; None for none
    top_beam : height of a beam on the same place, which must be None
    density : of the block [kg/m3], the site's own where None
    """
    if density is not None and top_beam is None and given is None:
        raise InputError("beam_density is given but neither top_beam nor spreader is")
    if given is None:
        return
    if len(runs) > 1 or top_beam is not None:
        raise InputError("spreader is for a straight wall without a top beam")
    if not isinstance(given, (tuple, list)) or len(given) != 2:
        raise InputError(f"spreader must be a pair (length, height) [m], got {given!r}")
    length, height = positive("spreader length", given[0]), positive("spreader height", given[1])
    x0, x1, y0, y1 = runs[0].footprint
    if length > x1 - x0:
        raise InputError(f"spreader length {length:g} m is longer than the wall ({x1 - x0:g} m)")
    middle = 0.5 * (x0 + x1)
    site.add_box(
        "spreader", ((middle - 0.5 * length, y0, top), (middle + 0.5 * length, y1, top + height)), axis=0,
        density=density,
    )


def _return_recipe(run: StraightWall) -> dict:
    """What the recipe of a wall keeps of a return.

    Name, side, length and thickness [m], and where it runs from and to in x [m].
    """
    side, x = run.name.removeprefix("return-"), list(run.footprint[:2])
    return {"name": run.name, "side": side, "length": run.length, "thickness": run.thickness, "x": x}


def _opening_recipe(opening: Placed) -> dict:
    """What the recipe of a wall keeps of an opening.

    Place, size and head [m], and the number of soldiers where there are any.
    """
    size = {"width": opening.x1 - opening.x0, "height": opening.z1 - opening.z0}
    record = {"x": opening.x0, "z": opening.z0, **size, "lintel": None, "bearing": None}
    if opening.soldiers:
        record["soldiers"] = opening.soldiers
    if opening.lintel is not None:
        record["lintel"] = None if opening.soldiers else opening.lintel[1][2] - opening.lintel[0][2]
        record["bearing"] = opening.x0 - opening.lintel[0][0]
    return record
