"""The command ``pushover``: a structure driven to a displacement, its load-displacement curve and its cracks."""

from __future__ import annotations

import argparse
from typing import Any

import limitmason as lm
from limitmason.cli import console
from limitmason.errors import InputError
from limitmason.experiments.experiment import Experiment
from limitmason.methods import DEM, get_method
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.stages import Drive
from limitmason.storage.csv_table import write_table
from limitmason.storage.files import named_path

_BASIS = slice(3, 6)
"""Lines in the text of a curve that say what it rests on: blocks, joints and speed, where a first failure is told."""


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``pushover`` to the commands."""
    push = console.command(
        commands, "pushover", _push, target="",
        help="drive a structure to a displacement: load-displacement curve, cracks, mode",
        description="Own weight settles, then a block is driven; it runs to the end whatever the load does. Lengths "
        "may carry a unit: 2mm, 0.002, 37.5mm.",
    )
    push.add_argument("--to", type=console.length, nargs="+", metavar="LENGTH", required=True,
                      help="displacement at the end; several are turning points of cycles")
    push.add_argument("--method", default=DEM, help=f"a method that follows driven structures; default: {DEM}")
    push.add_argument("--block", metavar="NAME", help="block to drive; default: what the experiment drives")
    push.add_argument("--direction", type=float, nargs=3, metavar=("X", "Y", "Z"), help="needs --block")
    kinds = "rigid (default), lumped (into the joints), 'simply deformable', zoned"
    push.add_argument("--blocks", help=f"how units deform: {kinds}")
    push.add_argument("--zone-size", type=console.length, metavar="LENGTH",
                      help="largest edge of a zone, of zoned blocks")
    push.add_argument("--stress", help="of zoned blocks: plane stress (default) or plane strain")
    push.add_argument("--spacing", type=console.length, metavar="LENGTH",
                      help="largest distance between contact points")
    push.add_argument("--steps", type=int, help="of the faster of the two runs; default: by the slowest swing")
    push.add_argument("--once", action="store_true", help="one speed: no rate error, a quarter of the time")
    push.add_argument("--option", action="append", default=[], metavar="NAME=VALUE",
                      help="of the experiment, for example outline=675/8/5; may be given again")
    push.add_argument("--checkpoint", type=console.writable, metavar="FILE", help="go on from here after a kill")
    push.add_argument("--figure", type=console.figure_file, metavar="FILE", help="draw the curve (.png, .pdf, .svg)")
    push.add_argument("--cracks", type=console.figure_file, metavar="FILE",
                      help="draw the cracks at first crack, peak, end")
    push.add_argument("--csv", type=console.writable, metavar="FILE", help="write displacement [m] and load [N]")
    console.drawing_options(push, tilt=False)


def _push(options: argparse.Namespace) -> int:
    """Drive the target of ``options`` along a path and print its curve.

    It is written where that was asked for. The exit status is 3 where the run did not get to its end.
    """
    follow = get_method(options.method).drive
    if follow is None:
        raise InputError(f"--method {options.method} does not follow a structure that is driven")
    test, assembly, loads, title = _target(options)
    drive = _drive(options, test)
    settings = {
        "blocks": options.blocks, "contact_points": options.spacing, "steps": options.steps,
        "zone_size": options.zone_size, "stress": options.stress,
        "checkpoint": options.checkpoint, "rate_check": False if options.once else None,
    }
    console.say_what(title, assembly)
    if test is not None and test.inferred:
        console.say("the outline is inferred, not published")
    curve = follow(
        assembly, drive, to=options.to if len(options.to) > 1 else options.to[0], loads=loads,
        label=f"{options.method}, {title}", **{k: v for k, v in settings.items() if v is not None},
    )
    console.show_text(str(curve))
    if options.csv:
        write_table(options.csv, *curve.tabulated())
        console.say(f"wrote {options.csv}")
    if options.figure or options.cracks:
        _draw(options, curve, test, title)
    return 0 if curve.status == "finished" else 3


def _target(options: argparse.Namespace) -> tuple[Experiment | None, Assembly, Loads, str]:
    """Experiment, or None for a file, assembly, loads and name of the target.

    The target is typed in ``options``.
    """
    source, slash, specimen = options.target.partition("/")
    path = named_path(options.target)
    if slash and not path.exists() and path.suffix.lower() not in (".json", *console.DRAWING_FILES):
        console.refuse(options, console.DRAWING, "by an experiment, which holds its own")
        test = lm.experiments.load(source, specimen, **_chosen(options.option))
        assembly = test.assembly()
        return test, assembly, test.loads(), f"{source} {specimen}"
    if options.option:
        raise InputError("--option is of a packaged experiment, and the target is a file: leave it out")
    assembly, loads, title, _ = console.read_target(options.target, options, needs_live_load=False)
    return None, assembly, loads, title


def _chosen(texts: list[str]) -> dict[str, Any]:
    """Options of an experiment by name, from ``texts`` written NAME=VALUE.

    Numbers become numbers; the words None, True and False become what they say.
    """
    words: dict[str, bool | None] = {"None": None, "True": True, "False": False}  # "none" is a residual strength
    out: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--option {text!r} must be written NAME=VALUE")
        try:
            out[name] = float(value)
        except ValueError:
            out[name] = words.get(value, value)
    return out


def _drive(options: argparse.Namespace, test: Experiment | None) -> Drive:
    """What is driven: the block in ``options``, or what the experiment drives.

    The experiment ``test`` is None for a file.
    """
    if options.block is not None:
        if options.direction is None:
            raise InputError("--block needs --direction X Y Z")
        # an axis that is not named is free to move, one with a zero would be held
        moves = {k: v for k, v in zip("xyz", options.direction, strict=True) if v != 0.0}
        return Drive({options.block: moves})
    if options.direction is not None:
        raise InputError("--direction needs --block")
    if test is None:
        raise InputError("a model file or a drawing does not say what is driven: give --block NAME --direction X Y Z")
    return test.drive()


def _draw(options: argparse.Namespace, curve: Any, test: Experiment | None, title: str) -> None:
    """Draw the curve, the cracks or both to the files of ``options``.

    Parameters
    ----------
    options : of the command
    curve : that the method followed
    test : the experiment, drawn beside the curve where it has values; None for a file
    title : of the figures
    """
    marks = ["Outline inferred, not published."] if test is not None and test.inferred else []
    if options.figure:
        known = test if test is not None and (test.measured or test.published) else None
        text = " ".join([*marks, *str(curve).splitlines()[_BASIS]])
        drawn = lm.figures.load_displacement(curve, measured=known, title=title, caption=text)
        console.write_figure(options.figure, drawn)
    if options.cracks:
        console.write_figure(options.cracks, lm.figures.cracks(curve, title=title, caption=" ".join(marks) or None))
