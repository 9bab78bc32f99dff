"""Commands on the packaged experiments: list, show, run, and predictions of a large series."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import limitmason as lm
from limitmason.cli import console
from limitmason.display.text_table import abridged, aligned
from limitmason.errors import InputError


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``experiments`` with its actions to the commands."""
    packaged = commands.add_parser("experiments", help="list, show and run the packaged experiments")
    packaged.set_defaults(run=lambda o: (packaged.print_help(), 0)[1])  # without an action: help, and exit status 0
    actions = packaged.add_subparsers(metavar="ACTION")
    listing = console.command(actions, "list", _list, help="sources and specimens")
    listing.add_argument("source", nargs="?", help="only this source")
    show = console.command(
        actions, "show", _show, help="data sheet of one specimen: parameters, values, source, assumptions"
    )
    show.add_argument("source")
    show.add_argument("specimen", nargs="?")
    run = console.command(actions, "run", _run, help="predict and print beside measured and published values")
    run.add_argument("source", nargs="?", help="a source, or SOURCE/SPECIMEN")
    run.add_argument("specimens", nargs="*", help="only these specimens")
    run.add_argument("--all", action="store_true", help="every packaged experiment that has a model")
    run.add_argument("--csv", type=console.writable, metavar="FILE", help="also write the table to a file")
    run.add_argument("--figure", type=console.figure_file, metavar="FILE",
                     help="also draw predicted against measured or published")
    console.analysis_options(run, flow_default="as published")

    series = console.command(
        commands, "predict", _predict, help="a large series of tests by a model of its ladder (resumable)"
    )
    series.add_argument("series", metavar="SERIES", help="a packaged series with a page of its own")
    series.add_argument("walls", nargs="*", metavar="WALL", help="only these walls; default: all")
    series.add_argument("--method", required=True, metavar="METHOD",
                        help="formulas, first, extended or non-associative (blocks), pushover, dem (a dozen walls)")
    series.add_argument("--store", type=console.writable, metavar="FILE",
                        help="keep answers here and go on after a kill")
    series.add_argument("--workers", type=int, default=1, help="processes, one wall each")
    series.add_argument("--no-interval", action="store_true", help="do not move the inputs: a seventh of the time")
    series.add_argument("--csv", type=console.writable, metavar="FILE",
                        help="write the table here, not to the terminal")


def _predict(options: argparse.Namespace) -> int:
    """Print or write the predicted forces of the walls typed in ``options``."""
    from limitmason.comparison.wall_ladder import predict_walls
    from limitmason.experiments import registry
    from limitmason.storage.csv_table import write_table

    # series with a page of their own are those that the ladder of models predicts
    known = [s for s in registry.sources() if s not in registry.tabled()]
    if options.series not in known:
        raise InputError(f"series must be {' or '.join(known)}, got {options.series!r}")
    found = predict_walls(
        options.method, options.walls or None, store=options.store, spread=not options.no_interval,
        workers=options.workers, progress=console.say,
    )
    cells = [[p.wall, p.method, *(f"{v:.4g}" for v in (p.force, *p.interval)), p.mode or "-", p.status] for p in found]
    units = {"wall": "-", "method": "-", "V": "kN", "V_low": "kN", "V_high": "kN", "mode": "-", "status": "-"}
    if options.csv:
        write_table(options.csv, units, cells)
        console.say(f"wrote {options.csv}")
        return 0
    rows, cut = abridged(cells)
    header = [name if unit == "-" else f"{name} [{unit}]" for name, unit in units.items()]
    console.show_text("\n".join([aligned([header, *rows]), *(f"{text}: --csv FILE writes them" for text in cut)]))
    return 0


def _list(options: argparse.Namespace) -> int:
    """Print the packaged experiments, or the specimens of one source.

    The source is typed in ``options``.
    """
    for source in [options.source] if options.source else lm.experiments.sources():
        names = lm.experiments.specimens(source)
        case = lm.experiments.load(source, names[0])
        console.show_text(f"{source}: {case.source.title}\n  {' '.join(names)}")
    return 0


def _show(options: argparse.Namespace) -> int:
    """Print the data sheets of the source or the specimen typed in ``options``."""
    from limitmason.experiments import registry

    source, _, specimen = options.source.partition("/")
    if specimen and options.specimen:
        raise InputError(f"specimen {options.specimen!r} is given besides {options.source!r}: name one")
    specimen = options.specimen or specimen
    # of a large series with a page of its own a list: its data sheets are hundreds
    if not specimen and source in set(lm.experiments.sources()) - set(registry.tabled()):
        names = lm.experiments.specimens(source)
        rows = [[name, lm.experiments.load(source, name).title] for name in names]
        console.show_text(f"{source}: {lm.experiments.load(source, names[0]).source.title}\n\n{aligned(rows)}\n\n"
                  f"limitmason experiments show {source} {names[0]} shows the data sheet of one")
        return 0
    for name in [specimen] if specimen else lm.experiments.specimens(source):
        console.show_text(str(lm.experiments.load(source, name)) + "\n")
    return 0


def _run(options: argparse.Namespace) -> int:
    """Predict the specimens of ``options`` and print them beside measured values."""
    if options.all == bool(options.source):
        raise InputError("name a source, or give --all; see `limitmason experiments list`")
    settings = console.settings_of(options)
    flow_rule = settings.pop("flow_rule", None)
    rows = lm.comparison.table(
        _cases(options), method=console.method_of(options), flow_rule=flow_rule, progress=console.lines(), **settings
    )
    console.show_text(lm.comparison.as_text(rows))
    if options.csv:
        lm.comparison.write_rows(rows, options.csv)
        console.say(f"wrote {options.csv}")
    if options.figure:
        console.write_figure(options.figure, lm.figures.predicted_beside_references(rows))
    return 0


def _cases(options: argparse.Namespace) -> Sequence:
    """The experiments typed in ``options``.

    They are all with a model, those of a source, or some of its specimens.
    """
    if options.all:
        return lm.experiments.all_cases(with_model=True)
    source, _, one = options.source.partition("/")
    names = ([one] if one else []) + options.specimens
    return [lm.experiments.load(source, name) for name in names] or lm.experiments.all_cases(source=source)
