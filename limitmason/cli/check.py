"""The command ``check``: contacts, near misses, floating blocks and implausible input of a model or a drawing."""

from __future__ import annotations

import argparse
import warnings

import limitmason as lm
from limitmason.cli import console
from limitmason.model import Assembly, ContactError, ContactWarning, PlausibilityWarning
from limitmason.storage.files import named_path


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``check`` to the commands."""
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


_IN_MM = 0.001
"""Metres per unit that are tried for a drawing which looks as if it were in millimetres."""


def _check(options: argparse.Namespace) -> int:
    """Print what is doubtful in a model, its contacts and its units.

    ``options`` are those typed. The exit status is 1 where something is to be decided.
    """
    said = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PlausibilityWarning)
        try:
            assembly, title = _loaded(options)
        except ContactError as error:
            # the report says what is wrong, and about which blocks
            assembly, title = error.assembly, named_path(options.target).stem
            said.append(str(error))
    path = named_path(options.target)
    report = assembly.contact_report(distance=options.distance, angle_deg=options.angle)
    undecided = options.gap is None and options.mortar is None and options.tolerance is None
    if path.suffix.lower() in lm.formats.PLANE_DRAWINGS and undecided and (report.floating or report.overlaps):
        scale = options.scale
        if scale is None and any("in mm?" in str(w.message) for w in caught):
            scale = _IN_MM
        found = lm.formats.proposal(path, scale=scale, thickness=options.thickness, layers=options.layers)
        if found is not None:
            floats = f"{found.floating} of {len(report.floating)} blocks float" if found.floating else "no block floats"
            units = f" --scale {scale:g}" if scale is not None else ""
            # with what was typed: the proposal was measured so
            typed = {"thickness": options.thickness, "layers": options.layers}
            flags = found._replace(options={k: v for k, v in typed.items() if v is not None} | found.options).flags
            file = f'"{path}"' if " " in str(path) else path
            console.show_text(f"{found.why}: try `limitmason check {file}{units} {flags}`; then {floats}")
    console.show_text(f"{title}: {report}")
    doubts = [w for w in caught if issubclass(w.category, PlausibilityWarning)]
    # what the report lists block by block needs no second mention
    said += dict.fromkeys(str(w.message) for w in doubts if not issubclass(w.category, ContactWarning))
    for text in said:
        console.show_text(f"warning: {text}")
    if options.figure:
        console.write_figure(options.figure, lm.figures.contact_report(assembly, report, title=title))
    return 1 if report.decisions or said else 0


def _loaded(options: argparse.Namespace) -> tuple[Assembly, str]:
    """Assembly and title of the target of ``options``.

    Options of drawings are refused for other targets.
    """
    path = named_path(options.target)
    if path.suffix.lower() not in lm.formats.DRAWINGS:
        console.refuse(options, ("tolerance", *console.DRAWING), "by a model or an experiment, which holds its own")
        subject = console.read_target(options.target, needs_live_load=False)
        return subject.assembly, subject.title
    if path.suffix.lower() in lm.formats.PLANE_DRAWINGS and options.thickness is None:
        console.say("assumed: thickness 1 m over all outlines")
    settings = {"tolerance": options.tolerance, "thickness": options.thickness, **console.outline_settings(options)}
    return lm.formats.read_drawing(path, **settings), path.stem
