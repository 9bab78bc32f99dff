"""Commands that put all theories side by side: as a table, and as the report of one structure.

``solve`` is in ``solve_and_draw``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import limitmason as lm
from limitmason.cli import console
from limitmason.errors import InputError
from limitmason.methods import COMPARED_METHODS, DEM, available_methods, get_method, method_name
from limitmason.storage.files import named_path


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``compare`` and ``report`` to the commands."""
    known = (*COMPARED_METHODS, *sorted(set(available_methods()) - set(COMPARED_METHODS)))
    compare = console.command(
        commands, "compare", _compare, target="", help="several theories, and a test, side by side"
    )
    compare.add_argument("--measured", type=float, nargs="+", metavar="LAMBDA",
                         help="multiplier of the test: one value, low and high, or low, value and high")
    compare.add_argument("--store", type=named_path, metavar="FOLDER", help="keep answers here and go on after a kill")
    compare.add_argument("--figure", type=console.figure_file, metavar="FILE", help="draw them (.png, .pdf, .svg)")
    compare.add_argument("--points", type=int, nargs=2, metavar=("ALONG", "ACROSS"),
                         help="contact points of the DEM; default: 4 8")
    compare.add_argument("--no-budget", action="store_true", help="DEM without its error budget: four times as fast")
    compare.add_argument("--proven", type=float, metavar="SECONDS",
                         help="prove the ends of the non-associative range, so long each (small walls)")
    compare.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    console.drawing_options(compare)

    report = console.command(
        commands, "report", _report, target="model file, experiment or drawing",
        help="one page on a structure: input, all theories, checks, figures",
    )
    report.add_argument("-o", "--output", type=console.page_file, default=Path("report.html"), metavar="FILE",
                        help="default: report.html")
    for parser in (compare, report):
        parser.add_argument("--methods", nargs="+", type=method_name, choices=known, default=list(COMPARED_METHODS),
                            metavar="METHOD", help=f"out of {', '.join(known)}; default: the four theories")
    report.add_argument("--title", help="heading; by default the name of the target")
    console.drawing_options(report)


def _report(options: argparse.Namespace) -> int:
    """Write a page on the target of ``options`` by several methods.

    The exit status is 3 where none has an answer.
    """
    target = console.read_target(options.target, options)
    title = options.title or target.title
    # cheap settings leave out what costs more than the answer, such as an error budget
    settings: dict[str, Any] = {m: dict(get_method(m).cheap) for m in options.methods if get_method(m).cheap}
    model = target.assembly, target.loads
    result = lm.comparison.compare(*model, options.methods, progress=console.lines(), title=title, **settings)
    lm.figures.structure_report(*model, result, options.output, title=title, assumed=target.assumed)
    console.say(f"wrote {options.output}")
    return 0 if any(row.solved for row in result.rows) else 3


def _compare(options: argparse.Namespace) -> int:
    """Print the answers of several methods to the target of ``options`` side by side.

    The exit status is 3 where none has an answer.
    """
    assembly, loads, title, _ = console.read_target(options.target, options)
    console.say_what(title, assembly, loads)
    settings: dict[str, dict[str, Any]] = {}
    if DEM in options.methods:
        points = {"contact_points": tuple(options.points)} if options.points else {}
        settings[DEM] = {**points, "error_budget": ()} if options.no_budget else points
    elif options.points or options.no_budget:
        raise InputError("--points and --no-budget are for the dem, which is not among --methods")
    result = lm.comparison.compare(
        assembly, loads, options.methods, options.measured, store=options.store, progress=console.lines(),
        proven=options.proven, title=title, **settings,
    )
    console.show_text(result.as_markdown() if options.markdown else result.table())
    solved = any(row.solved for row in result.rows)
    if options.figure and not solved:
        console.say("no figure: no theory has a finite multiplier")
    if options.figure and solved:
        console.write_figure(options.figure, lm.figures.side_by_side(result))
    return 0 if solved else 3
