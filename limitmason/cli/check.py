"""The command ``check``: contacts, near misses, floating blocks and implausible input of a model or a drawing."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import limitmason as lm
from limitmason.cli import console
from limitmason.model import Assembly, ContactError, ContactWarning, PlausibilityWarning


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``check``."""
    check = console.command(
        commands, "check", _check, help="contact report: near misses, floating blocks, implausible input",
        description="Lists the contacts of a model and what may be wrong with them. Exit status 0 when there is "
        "nothing to decide, 1 when there is, 2 for input that cannot be read.",
        target="model file, experiment, or a drawing (.dxf, .svg, .obj, .ply, .stl), for which it proposes the options "
        "that make stones meet",
    )
    check.add_argument("--figure", type=console.figure_file, metavar="FILE", help="draw the report (.png, .pdf, .svg)")
    check.add_argument("--distance", type=float, metavar="M", help="list near misses up to this gap [m]")
    check.add_argument("--angle", type=float, metavar="DEG", help="and up to this angle between faces [deg]")
    console.outline_options(check).add_argument("--tolerance", type=console.length, metavar="LENGTH",
                                        help="gap or overlap up to which faces touch; default: --gap")


def _check(options: argparse.Namespace) -> int:
    """Print what is doubtful in a model, its contacts and its units; 1 where something is."""
    said = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PlausibilityWarning)
        try:
            assembly, title = _loaded(options)
        except ContactError as error:
            # the report says what is wrong, and about which blocks
            assembly, title = error.assembly, Path(options.target).stem
            said.append(str(error))
    path = Path(options.target)
    open_ended = options.gap is None and options.mortar is None and options.tolerance is None
    drawn = path.suffix.lower() in lm.formats.PLANE_DRAWINGS
    report = assembly.contact_report(distance=options.distance, angle_deg=options.angle)
    found, scale = None, options.scale
    if scale is None and any("in mm?" in str(w.message) for w in caught):
        scale = 0.001
    if drawn and open_ended and (report.floating or report.overlaps):
        found = lm.formats.proposal(path, scale=scale, thickness=options.thickness, layers=options.layers)
    if found is not None:
        left = "no block floats" if not found.floating else f"{found.floating} of {len(report.floating)} blocks float"
        units = f" --scale {scale:g}" if scale is not None else ""
        console.show_text(f"{found.why}: try `limitmason check {path}{units} {found.flags}`; then {left}")
    console.show_text(f"{title}: {report}")
    # what the report lists block by block needs no second mention
    told = [w for w in caught if issubclass(w.category, PlausibilityWarning)]
    said += dict.fromkeys(str(w.message) for w in told if not issubclass(w.category, ContactWarning))
    for text in said:
        console.show_text(f"warning: {text}")
    if options.figure:
        console.write_figure(options.figure, lm.figures.contact_report(assembly, report, title=title))
    return 1 if report.decisions or said else 0


def _loaded(options: argparse.Namespace) -> tuple[Assembly, str]:
    """Model of a target and its title; options of drawings are refused for other targets."""
    path = Path(options.target)
    if path.suffix.lower() not in lm.formats.DRAWINGS:
        console.refuse(options, ("tolerance", *console.DRAWING), "by a model or an experiment, which holds its own")
        assembly, _, title, _ = console.read_target(options.target, needs_live_load=False)
        return assembly, title
    settings = {"tolerance": options.tolerance, "thickness": options.thickness, **console.outline_settings(options)}
    return lm.formats.read_drawing(path, **settings), path.stem
