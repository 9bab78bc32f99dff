"""Commands that put all theories side by side: as a table, and as the report of one structure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from limitmason.cli.console import (
    drawing_options,
    figure_file,
    lines,
    load_target,
    page_file,
    read_target,
    say,
    show_text,
)
from limitmason.errors import InputError
from limitmason.methods import COMPARED_METHODS, available_methods, get_method
from limitmason.storage.files import save_figure


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``compare`` and ``report``."""
    known = (*COMPARED_METHODS, *sorted(set(available_methods()) - set(COMPARED_METHODS)))
    command = commands.add_parser("compare", help="several theories, and a test, side by side")
    command.add_argument("target", metavar="TARGET")
    command.add_argument("--methods", nargs="+", choices=known, default=list(COMPARED_METHODS),
                         metavar="METHOD", help=f"out of {', '.join(known)}; default: the four theories")
    command.add_argument("--measured", type=float, nargs="+", metavar="LAMBDA",
                         help="multiplier of the test: one value, low and high, or low, value and high")
    command.add_argument("--store", type=Path, metavar="FOLDER", help="keep answers here and go on after a kill")
    command.add_argument("--figure", type=figure_file, metavar="FILE", help="draw them (.png, .pdf, .svg)")
    command.add_argument("--points", type=int, nargs=2, metavar=("ALONG", "ACROSS"),
                         help="contact points of the DEM; default: 4 8")
    command.add_argument("--no-budget", action="store_true", help="DEM without its error budget: four times as fast")
    command.add_argument("--proven", type=float, metavar="SECONDS",
                         help="prove the ends of the non-associative range, so long each (small walls)")
    command.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    drawing_options(command)
    command.set_defaults(run=_compare)

    report = commands.add_parser("report", help="one page on a structure: input, all theories, checks, figures")
    report.add_argument("target", metavar="TARGET", help="model file, experiment or drawing")
    report.add_argument("-o", "--output", type=page_file, default=Path("report.html"), metavar="FILE",
                        help="default: report.html")
    report.add_argument("--methods", nargs="+", choices=known, default=list(COMPARED_METHODS), metavar="METHOD",
                        help=f"out of {', '.join(known)}; default: the four theories")
    report.add_argument("--title", help="heading; by default the name of the target")
    drawing_options(report)
    report.set_defaults(run=_report)


def _report(options: argparse.Namespace) -> int:
    from limitmason import figures
    from limitmason.comparison import compare

    target = read_target(options.target, options)
    title = options.title or target.title
    settings: dict[str, Any] = {m: dict(get_method(m).cheap) for m in options.methods if get_method(m).cheap}
    result = compare(target.assembly, target.loads, options.methods, progress=lines(), title=title, **settings)
    figures.structure_report(
        target.assembly, target.loads, result, options.output, title=title, assumed=target.assumed
    )
    say(f"wrote {options.output}")
    return 0 if any(row.solved for row in result.rows) else 3


def _compare(options: argparse.Namespace) -> int:
    from limitmason.comparison import compare

    assembly, loads, title = load_target(options.target, options)
    say(f"{title}: {int((~assembly.fixed).sum())} free blocks, {len(assembly.interfaces)} interfaces, {loads.name}")
    settings: dict[str, dict[str, Any]] = {}
    if "dem" in options.methods:
        dem = {"contact_points": tuple(options.points)} if options.points else {}
        settings["dem"] = {**dem, "error_budget": ()} if options.no_budget else dem
    elif options.points or options.no_budget:
        raise InputError("--points and --no-budget are for the dem, which is not among --methods")
    result = compare(
        assembly, loads, options.methods, options.measured, store=options.store, progress=lines(),
        proven=options.proven, title=title, **settings,
    )
    show_text(result.as_markdown() if options.markdown else result.table())
    solved = any(row.solved for row in result.rows)
    if options.figure and not solved:
        say("no figure: no theory has a finite multiplier")
    if options.figure and solved:
        from limitmason import figures

        save_figure(figures.side_by_side(result), options.figure)
        say(f"wrote {options.figure}")
    return 0 if solved else 3
