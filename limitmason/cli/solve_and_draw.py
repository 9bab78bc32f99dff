"""Commands on one model: solve, figure, view, template.

File or packaged case becomes a model in ``console.read_target``.
"""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

import limitmason as lm
from limitmason.answers.results import Prediction
from limitmason.cli import console
from limitmason.errors import InputError
from limitmason.mechanics.joint_forces import force_table
from limitmason.methods import predict
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``solve``, ``figure``, ``view`` and ``template`` to the commands."""
    solve = console.command(
        commands, "solve", _solve, target="", help="collapse multiplier of a model with its certificate"
    )
    solve.add_argument("--output", type=console.writable, metavar="FILE", help="write the whole prediction as JSON")
    solve.add_argument("--figure", type=console.figure_file, metavar="FILE",
                       help="draw the mechanism (.png, .pdf, .svg)")
    solve.add_argument("--forces", type=console.writable, metavar="FILE",
                       help="write joint forces and reactions as CSV")
    solve.add_argument("--vtu", type=console.writable, metavar="FILE", help="write blocks and mechanism for ParaView")
    console.analysis_options(solve)
    console.drawing_options(solve)

    figure = console.command(commands, "figure", _figure, help="draw an assembly, its mechanism or its contact forces")
    figure.add_argument("kind", choices=("assembly", "mechanism", "forces"))
    figure.add_argument("target", metavar="TARGET")
    figure.add_argument("-o", "--output", type=console.figure_file, metavar="FILE", help="default: KIND.png")
    figure.add_argument("--view", choices=("auto", "elevation", "3d"), default="auto")
    figure.add_argument("--dpi", type=console.dots, default=200, metavar="DOTS",
                        help="per inch, 10 to 2400; default: 200")
    console.analysis_options(figure)
    console.drawing_options(figure)

    view = console.command(
        commands, "view", _view, target="", help="write a scene of a model and its answer to turn in a browser"
    )
    view.add_argument("-o", "--output", type=console.page_file, metavar="FILE", help="default: scene.html")
    view.add_argument("--open", action="store_true", help="open it in the browser")
    view.add_argument("--alone", action="store_true", help="the structure alone: nothing is analysed")
    console.analysis_options(view)
    console.drawing_options(view)

    template = console.command(commands, "template", _template, help="write a small model file, or a drawing, to edit")
    template.add_argument("file", type=console.writable, help="a model (.json), or a drawing in millimetres (.svg)")
    template.add_argument("--arch", action="store_true", help="the arch of a bridge instead of a wall")


def _predicted(options: argparse.Namespace, assembly: Assembly, loads: Loads) -> tuple[Prediction, int]:
    """The prediction that the options ask for of an assembly under loads, printed, and the exit status."""
    method = console.method_of(options)
    prediction = predict(assembly, loads, method, **console.told(console.settings_of(options), method))
    return prediction, console.report(prediction, assembly)


def _solve(options: argparse.Namespace) -> int:
    """Print the prediction of the target of ``options``, write the files asked for, and return the exit status."""
    assembly, loads, title, _ = console.read_target(options.target, options)
    console.say_what(title, assembly, loads)
    prediction, status = _predicted(options, assembly, loads)
    if options.output:
        lm.formats.write_prediction(options.output, prediction, assembly=assembly)
        console.say(f"wrote {options.output}")
    if options.forces:
        force_table(prediction, assembly).to_csv(options.forces)
        console.say(f"wrote {options.forces}")
    if options.vtu:
        lm.formats.write_vtu(options.vtu, assembly, prediction)
        console.say(f"wrote {options.vtu}")
    if options.figure:
        draw(options.figure, "mechanism", assembly, prediction, title)
    return status


def _figure(options: argparse.Namespace) -> int:
    """Draw the target of ``options``, its mechanism or forces, to a file, and return the exit status."""
    assembly, loads, title, _ = console.read_target(options.target, options)
    output = options.output or Path(f"{options.kind}.png")
    if options.kind == "assembly":
        console.refuse(options, ("method", *console.ANALYSIS), "by `figure assembly`, which analyses nothing")
        draw(output, "assembly", assembly, None, title, view=options.view, dpi=options.dpi)
        return 0
    prediction, status = _predicted(options, assembly, loads)
    # a structure that cannot stand has no collapse load, but a mechanism by which it falls
    if status == 0 or (options.kind == "mechanism" and prediction.mechanism is not None):
        draw(output, options.kind, assembly, prediction, title, view=options.view, dpi=options.dpi)
    return status


def _view(options: argparse.Namespace) -> int:
    """Write a scene of a target and its answer for a browser, and return the exit status."""
    assembly, loads, title, _ = console.read_target(options.target, options, needs_live_load=not options.alone)
    output = options.output or Path("scene.html")
    shown, status = None, 0
    if options.alone:
        console.refuse(options, ("method", *console.ANALYSIS), "with --alone, which analyses nothing")
    else:
        shown, status = _predicted(options, assembly, loads)
    lm.figures.view(assembly, shown, output, title=title)
    console.say(f"wrote {output}: open it in a browser; it needs no network")
    if options.open:
        webbrowser.open(output.resolve().as_uri())
    return status


def draw(path: Path, kind: str, assembly: Assembly, prediction: Prediction | None, title: str, *, view: str = "auto",
         dpi: int = 200) -> None:
    """Draw an assembly, a mechanism or joint forces to a file and say so.

    Of a prediction with neither its status is told, and nothing drawn. Where only the one asked for is missing that is
    an InputError.

    Parameters
    ----------
    path : of the figure
    kind : "mechanism" or "forces"; of no meaning for an assembly alone
    assembly : to be drawn
    prediction : whose mechanism or forces are drawn; None for an assembly alone
    title : of the figure
    view : "auto", "elevation" or "3d"
    dpi : dots per inch
    """
    if prediction is None:
        figure = lm.figures.assembly(assembly, title=title, view=view)
    elif prediction.mechanism is None and prediction.resultants is None:
        console.say(f"no figure: {prediction.status}")
        return
    elif kind == "mechanism":
        if prediction.mechanism is None:
            raise InputError(f"there is no mechanism to draw: {prediction.method!r} gives none")
        figure = lm.figures.mechanism(assembly, prediction, title=title, view=view)
    else:
        if prediction.resultants is None:
            raise InputError(f"there are no joint forces to draw: {prediction.method!r} gives none")
        figure = lm.figures.contact_forces(assembly, prediction, title=title, view=view)
    console.write_figure(path, figure, dpi=dpi)


def _template(options: argparse.Namespace) -> int:
    """Write a small model or drawing to the file in ``options``, say how to go on, and return status 0."""
    lm.formats.write_model_template(options.file, of="arch" if options.arch else "wall")
    what = "a small wall; edit its outlines, joint and loads, then `limitmason solve`"
    if options.arch:
        what = "the arch of a bridge; `limitmason stability` and `axles` read it"
    elif options.file.suffix.lower() == ".svg":
        what = f"a small wall drawn in mm; `limitmason check {options.file} --scale 0.001` reads it, with the extra dxf"
    console.say(f"wrote {options.file}: {what}")
    return 0
