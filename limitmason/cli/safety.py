"""Commands on safety: whether a model stands, axles over a bridge, loads that are safe at once, verdict of a code."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import limitmason as lm
from limitmason.checks import positive
from limitmason.cli import console, solve_and_draw
from limitmason.errors import InputError
from limitmason.limit import axle_envelope, load_region, thrust
from limitmason.model.support_motion import group_of
from limitmason.stability_check import stability

_ROUNDING = 1e-9
"""Multiplier over the largest one of a set that is shown as zero; chosen, above rounding."""


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``stability``, ``axles``, ``region`` and ``assess`` to the commands."""
    stands = console.command(
        commands, "stability", _stability, target="", help="whether a model can stand, how well, and with what thrust"
    )
    stands.add_argument("--support", nargs="+", metavar="BLOCK", help="held blocks: least and greatest thrust on them")
    stands.add_argument("--along", type=float, nargs=3, metavar=("X", "Y", "Z"),
                        help="direction of that thrust; default: level, from the middle of the blocks to the support")
    stands.add_argument("--figure", type=console.figure_file, metavar="FILE", help="draw its forces, or how it falls")
    console.drawing_options(stands, tilt=False)

    axles = console.command(
        commands, "axles", _axles, target="", help="multiplier of axles over their positions on an arch bridge"
    )
    axles.add_argument("--axle", nargs=2, type=float, action="append", required=True, metavar=("BEHIND", "FORCE"),
                       help="place behind the first [m] and load [N]; once for every axle")
    axles.add_argument("--level", type=float, required=True, help="top of the fill [m]")
    axles.add_argument("--fill", type=float, metavar="DENSITY", help="its weight is dead load too [kg/m3]")
    axles.add_argument("--spread", type=float, default=30.0, help="angle of the spread from the vertical [deg]")
    axles.add_argument("--figure", type=console.figure_file, metavar="FILE", help="draw the envelope")
    console.drawing_options(axles, tilt=False)

    region = console.command(
        commands, "region", _region, target="", help="multipliers of two or three loads that a model carries at once"
    )
    region.add_argument("--push", nargs=4, action="append", default=[], metavar=("BLOCK", "X", "Y", "Z"),
                        help="a load: force on the middle of a block [N]; once for every load")
    region.add_argument("--live", action="store_true", help="the live load of the model is a load too, the first")
    region.add_argument("--within", type=float, nargs="+", metavar="LAMBDA", help="largest multipliers asked for")
    region.add_argument("--tolerance", type=float, default=1e-3, help="gap between proven inside and outside")
    region.add_argument("--output", type=console.writable, metavar="FILE", help="write corners and half-planes as JSON")
    region.add_argument("--figure", type=console.figure_file, metavar="FILE", help="draw the set of two loads")
    console.drawing_options(region)

    verdict = console.command(
        commands, "assess", _assess, target="", help="verdict on the mechanism of the live load by the Italian Circular"
    )
    site = ("AG", "F0", "TC")
    verdict.add_argument("--site", type=float, nargs=3, required=True, metavar=site,
                         help="a_g over g, F0 and Tc* [s] of SLV, and of SLD and SLC by default")
    verdict.add_argument("--sld", type=float, nargs=3, metavar=site, help="those of SLD")
    verdict.add_argument("--slc", type=float, nargs=3, metavar=site, help="those of SLC")
    verdict.add_argument("--soil", default="A", help="class A to E; default: A")
    verdict.add_argument("--topography", type=float, default=1.0, metavar="ST", help="factor of the slope; default: 1")
    verdict.add_argument("--mode", type=float, nargs=2, action="append", metavar=("PERIOD", "FACTOR"),
                         help="it stands on a floor: period [s] and participation times shape there; once for every "
                         "mode of the building, longest first")
    verdict.add_argument("--confidence", type=float, default=1.35, metavar="FC", help="1.35 (default), 1.20 or 1.00")
    verdict.add_argument("--to", type=console.length, metavar="LENGTH",
                         help="follow the curve so far, or until it overturns; default: q = 2 alone")
    verdict.add_argument("--title", help="heading; by default the name of the target")
    verdict.add_argument("-o", "--output", type=console.page_file, default=Path("assessment.html"), metavar="FILE",
                         help="default: assessment.html")
    console.drawing_options(verdict)


def _stability(options: argparse.Namespace) -> int:
    """Print whether the target of ``options`` stands under its dead load.

    The exit status is 3 where it does not.
    """
    assembly, loads, title, _ = console.read_target(options.target, options, needs_live_load=False)
    dead = loads.scaled(live=0.0)
    if options.along and not options.support:
        raise InputError("--along needs --support")
    if options.support:
        group_of(assembly, options.support)  # a name that is wrong is said before the analysis
    found = stability(assembly, dead)
    console.show_text(str(found))
    if options.support and found.stands:
        try:
            told = thrust(assembly, options.support, direction=options.along, loads=dead)
        except InputError as error:
            # one slab under both ends of an arch lies in no direction
            raise InputError(str(error).replace("direction: none", "--along: no direction")) from None
        console.show_text(str(told))
    if options.figure:
        solve_and_draw.draw(options.figure, "forces" if found.stands else "mechanism", assembly, found.state, title)
    return 0 if found.stands and found.stands_on_path is not False else 3


def _axles(options: argparse.Namespace) -> int:
    """Print the multiplier of the axles of ``options`` at every place of their train."""
    assembly, loads, title, _ = console.read_target(options.target, options, needs_live_load=False)
    dead = loads.scaled(live=0.0)
    if options.fill is not None:
        dead = dead.with_backfill(assembly, options.level, options.fill)
    train = [(behind, force) for behind, force in options.axle]  # [m] behind the first, [N]
    found = axle_envelope(assembly, dead, train, level=options.level, spread_deg=options.spread)
    console.show_text(str(found))
    if options.figure:
        console.write_figure(options.figure, lm.figures.axle_envelope(found, title=title))
    return 0


def _region(options: argparse.Namespace) -> int:
    """Print the set of multipliers of two or three loads that a model carries.

    The model is the target of ``options``. The exit status is 3 where the set is not closed.
    """
    assembly, loads, title, _ = console.read_target(options.target, options, needs_live_load=options.live)
    dead = loads.scaled(live=0.0)
    cases = [replace(loads, name=loads.name or "live load")] if options.live else []
    for block, *force in options.push:
        try:
            vector = [float(v) for v in force]
        except ValueError:
            raise InputError(f"--push {block} {' '.join(force)}: a block and three numbers [N]") from None
        cases.append(replace(dead.with_point_load(assembly, block, vector), name=f"push on {block}"))
    if not cases:
        raise InputError("region: give --push BLOCK X Y Z once for every load, or --live")
    within = options.within
    if within is not None and len(within) not in (1, len(cases)):
        raise InputError(f"--within: give one number, or one for each of the {len(cases)} loads")
    found = load_region(
        assembly, dead, cases, tolerance=options.tolerance,
        within=within[0] if within is not None and len(within) == 1 else within,
    )
    console.show_text(str(found))
    # a multiplier that is zero but for rounding is printed as zero
    rounding = _ROUNDING * np.abs(found.corners).max(initial=0.0)
    for corner in found.corners:
        console.show_text("  " + "  ".join(f"{v:.6g}" for v in np.where(np.abs(corner) < rounding, 0.0, corner)))
    if options.output:
        found.to_json(options.output)
        console.say(f"wrote {options.output}")
    if options.figure:
        console.write_figure(options.figure, lm.figures.load_region(found, title=title))
    return 0 if found.status == "closed" else 3


def _assess(options: argparse.Namespace) -> int:
    """Write an assessment of the target of ``options`` by the Italian Circular.

    Limit states are damage (SLD), life safety (SLV) and collapse (SLC), each with a spectrum of the site.
    """
    from limitmason.capacity.analysis import whole_pushover
    from limitmason.codes import FloorSpectrum, GroundSpectrum, assess

    assembly, loads, title, _ = console.read_target(options.target, options)
    spectra: dict[str, GroundSpectrum | FloorSpectrum] = {}
    modes = options.mode or []
    for state, own in (("SLD", options.sld), ("SLV", None), ("SLC", options.slc)):
        ag, f0, tc = own or options.site  # a_g over g, F0 and Tc* [s]
        ground = GroundSpectrum(ag, f0, tc, soil=options.soil, topography=options.topography)
        spectra[state] = FloorSpectrum(ground, [t for t, _ in modes], [f for _, f in modes]) if modes else ground
    curve = None
    if options.to is not None:
        positive("--to", options.to, "m")
        curve = whole_pushover(assembly, loads, to=options.to)
        console.say(f"capacity curve: {curve.status} at {curve.displacement[-1]:.4g} m")
    try:
        found = assess(assembly, loads, spectra, curve=curve, confidence_factor=options.confidence)
    except InputError as error:
        # a curve that is too short is mended by the option that says how far it goes
        raise InputError(f"--to: {error}" if "the curve ends" in str(error) else str(error)) from None
    console.show_text(str(found))
    lm.figures.assessment_report(found, options.output, title=options.title or title)
    console.say(f"wrote {options.output}")
    return 0
