"""What all commands share: where answers and messages go, the target, and the settings of an analysis.

Errors become messages and exit codes in ``limitmason.cli``.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import limitmason as lm
from limitmason.answers.results import Prediction, Status
from limitmason.display.progress import bars_are_drawn, write
from limitmason.errors import InputError
from limitmason.methods import LIMIT, NON_ASSOCIATIVE, available_methods, get_method, method_name
from limitmason.model.assembly import Assembly, ContactError
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.storage.files import named_path, save_figure

_NAMED = 20
"""So many falling blocks are named; a figure shows the rest."""

_FALLING = 0.01
"""Rate of a block over the largest of all from which on it is told to fall; chosen."""

_DPI = range(10, 2401)
"""Dots per inch that a figure may have; chosen."""


def say(text: str) -> None:
    """Write a message to standard error, above the bar of a run that goes on."""
    write(text)


def lines() -> Callable[[str], None] | None:
    """What takes the lines of a long run besides its bar.

    It is None where nobody looks or asked for them.
    """
    return say if bars_are_drawn() else None


def show_text(text: str) -> None:
    """Write an answer to standard output."""
    write(text, sys.stdout)


def command(
    commands: argparse._SubParsersAction, name: str, run: Callable[[argparse.Namespace], int], *,
    target: str | None = None, **told: Any,
) -> argparse.ArgumentParser:
    """Add a command and return its parser.

    Parameters
    ----------
    commands : parsers of all commands, or of the actions of one
    name : of the command
    run : function that runs it
    target : help of its argument TARGET, "" for no help of its own: the page of all commands says what a TARGET is;
        None where the command takes none
    told : help and description of the command
    """
    parser = commands.add_parser(name, **told)
    parser.set_defaults(run=run)
    if target is not None:
        parser.add_argument("target", metavar="TARGET", help=target or None)
    return parser


def write_figure(path: Path, figure: Any, *, dpi: int = 200) -> None:
    """Write a figure of matplotlib to a file, with ``dpi`` dots per inch, and say so."""
    save_figure(figure, path, dpi=dpi)
    say(f"wrote {path}")


def say_what(title: str, assembly: Assembly, loads: Loads | None = None) -> None:
    """Say what is analysed: title, free blocks, interfaces and, if given, loads."""
    under = "" if loads is None else f", {loads.name}"
    say(f"{title}: {int((~assembly.fixed).sum())} free blocks, {len(assembly.interfaces)} interfaces{under}")


def figure_file(text: str) -> Path:
    """A path that a figure can be written to, checked before an analysis begins."""
    path = named_path(text)
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise argparse.ArgumentTypeError(f"{text!r} must end in .png, .pdf or .svg")
    return writable(text)


def writable(text: str) -> Path:
    """A path of a file in a folder that exists, checked before an analysis begins."""
    path = named_path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{text!r} is a folder: name a file")
    return in_a_folder(text)


def in_a_folder(text: str) -> Path:
    """A path in a folder that exists, checked before an analysis begins."""
    path = named_path(text)
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"there is no folder {str(path.parent)!r}: make it first")
    return path


def dots(text: str) -> int:
    """Dots per inch of a figure, checked before an analysis begins."""
    if not text.isdecimal() or int(text) not in _DPI:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no whole number of dots per inch from {_DPI.start} to {_DPI.stop - 1}"
        )
    return int(text)


def page_file(text: str) -> Path:
    """A path that a page can be written to, checked before an analysis begins."""
    path = writable(text)
    if path.suffix.lower() not in (".html", ".htm"):
        raise argparse.ArgumentTypeError(f"{text!r} must end in .html; a browser prints it as PDF")
    return path


class Subject(NamedTuple):
    """What a command works on, and what was assumed to make it."""

    assembly: Assembly
    loads: Loads
    title: str
    assumed: tuple[str, ...] = ()


def read_target(target: str, drawing: argparse.Namespace | None = None, *, needs_live_load: bool = True) -> Subject:
    """The subject of a command: a model file, a packaged experiment or a drawing.

    Parameters
    ----------
    target : as typed: a path, or SOURCE/SPECIMEN
    drawing : options of the command, where it takes those of :func:`drawing_options`; None where it takes no drawing
    needs_live_load : refuse a model file without a live load
    """
    path = named_path(target)
    if path.exists() or path.suffix.lower() in (".json", *DRAWING_FILES):
        if path.suffix.lower() in lm.formats.DRAWINGS:
            return _drawing(path, drawing)
        if drawing is not None:
            refuse(drawing, DRAWING, "by a model file, which holds its own")
        model = lm.formats.read_json(path)
        if needs_live_load and not model.loads.live.any():
            raise InputError(f"{path}: the file holds no live load; add a 'loads' entry, see `limitmason template`")
        return Subject(model.assembly, model.loads, path.stem)
    source, slash, specimen = target.partition("/")
    if not slash:
        raise InputError(f"{target!r} is neither a file nor SOURCE/SPECIMEN; see `limitmason experiments list`")
    if drawing is not None:
        refuse(drawing, DRAWING, "by an experiment, which holds its own")
    test = lm.experiments.load(source, specimen)
    return Subject(test.assembly(), test.loads(), f"{source} {specimen}", tuple(test.assumptions))


DRAWING = ("thickness", "friction", "density", "tilt", "held", "scale", "gap", "mortar", "layers")
"""Options that a drawing needs besides its outlines."""

DRAWING_FILES = (".dxf", ".svg", ".obj", ".ply", ".stl", ".off")
"""As ``formats.DRAWINGS``, which takes long to load."""

_LENGTHS = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
_TILTS = {"x": "x", "left": "-x", "y": "y", "front": "-y"}  # a shell takes -x for an option


def drawing_options(parser: argparse.ArgumentParser, *, tilt: bool = True) -> None:
    """Add options for what a drawing does not hold.

    That is thickness, joints, weight, loads and supports. An option is None unless it is typed.

    Parameters
    ----------
    parser : of the command
    tilt : whether the command has a live load, whose direction is an option
    """
    group = outline_options(parser)
    group.add_argument("--friction", type=float, metavar="DEG", help="friction angle of every joint [deg]")
    group.add_argument("--density", type=float, metavar="KG_M3", help="of every block; default: 2000 kg/m3")
    group.add_argument("--held", nargs="+", metavar="NAME", help="held blocks; default: a layer named support, base or "
                       "ground, else the stones that reach down to the lowest level")
    if tilt:
        group.add_argument("--tilt", choices=tuple(_TILTS), help="direction of the live load: x (right), left (against "
                           "x), y (away from the viewer), front; default: x")


def outline_options(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """Add options on how the outlines of a drawing are read.

    ``parser`` is that of the command; the group of these options is returned.
    """
    group = parser.add_argument_group("drawings only (.dxf, .svg, .obj, .ply, .stl)")
    group.add_argument("--thickness", type=length, metavar="LENGTH", help="of the wall over outlines")
    group.add_argument("--scale", type=float, metavar="M", help="metres per unit of the drawing; default: that of the "
                       "file, which an .svg does not have")
    group.add_argument("--gap", type=length, metavar="LENGTH", help="close gaps between outlines up to this length, "
                       "for example 3mm")
    group.add_argument("--mortar", type=length, metavar="LENGTH", help="thickness of mortar joints drawn as open "
                       "space: stones grow by half of it")
    group.add_argument("--layers", nargs="+", metavar="NAME", help="layers to read; default: all but openings, "
                       "windows, doors")
    return group


def length(text: str) -> float:
    """A length [m], typed with a unit or in metres."""
    found = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*([a-z]*)\s*", text)  # number and unit
    try:
        return float(found[1]) * _LENGTHS[found[2]] if found else float(text)
    except (ValueError, KeyError):
        raise argparse.ArgumentTypeError(f"{text!r} is no length such as 2mm or 0.002") from None


def outline_settings(options: argparse.Namespace) -> dict[str, Any]:
    """What was typed of :func:`outline_options`, without the thickness.

    Readers of drawings take it as keywords.
    """
    return {name: getattr(options, name) for name in ("scale", "gap", "mortar", "layers")}


def _drawing(path: Path, options: argparse.Namespace | None) -> Subject:
    """A drawing as a model, and what was assumed and moved for it.

    Parameters
    ----------
    path : of the drawing
    options : of the command, with those of :func:`drawing_options`; None where it takes none
    """
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if options is None or options.friction is None:
        raise InputError(
            f"{path} holds geometry alone: `limitmason solve {path.name} --thickness 0.4 --friction 33 --tilt x` "
            "solves it, other commands take the same options; for more than one joint or load write a script "
            "(examples/traced_drawing.py)"
        )
    settings = {
        "thickness": options.thickness, "density": options.density,
        "tilt": _TILTS.get(getattr(options, "tilt", None) or ""), "fixed": options.held, **outline_settings(options),
    }
    given = {k: v for k, v in settings.items() if v is not None}
    try:
        model = lm.formats.model_of_drawing(path, joint=Joint(options.friction), **given)
    except ContactError as error:
        # advice for what a gap can close and was not yet asked to
        if path.suffix.lower() not in lm.formats.PLANE_DRAWINGS or options.gap is not None:
            raise
        raise InputError(
            f"{error}; --gap 5mm closes gaps and overlaps up to that and drops stones that are drawn twice; "
            f"`limitmason check {path.name}` lists them and proposes what to type"
        ) from None
    if model.cleaned is not None:
        say(str(model.cleaned))
    for text in model.assumed:
        say(f"assumed: {text}")
    moved = (str(model.cleaned),) if model.cleaned is not None else ()
    return Subject(model.assembly, model.loads, path.stem, (*model.assumed, *moved))


def report(prediction: Prediction, assembly: Assembly | None = None) -> int:
    """Print a prediction and return its exit status: 3 unless solved or almost so.

    Where the structure cannot stand, the blocks that fall are named, if the ``assembly`` is given.
    """
    show_text(str(prediction))
    if assembly is not None and prediction.status == Status.CANNOT_STAND and prediction.mechanism is not None:
        falling = prediction.mechanism.moving_blocks(_FALLING)
        names = [assembly.blocks[i].name for i in falling if not assembly.fixed[i]]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        show_text(f"  blocks that fall under dead load: {', '.join(names[:_NAMED])}{more}")
    return 0 if prediction.status in (Status.SOLVED, Status.ALMOST_SOLVED) else 3


ANALYSIS = ("flow_rule", "contact_model", "grid", "torsion_limit", "search", "time_limit")
"""Options of an analysis, of which every method takes its own."""


def analysis_options(parser: argparse.ArgumentParser, flow_default: str = "associative") -> None:
    """Add the options of an analysis to a command.

    All are None or False unless typed, so that none is lost unseen.

    Parameters
    ----------
    parser : of the command
    flow_default : flow rule where none is typed, in words for the help
    """
    group = parser.add_argument_group("analysis")
    group.add_argument("--method", type=method_name, choices=(LIMIT, *sorted(available_methods())),
                       help=f"default: {LIMIT}")
    group.add_argument("--flow-rule", type=method_name, choices=("associative", "non-associative"),
                       help=f"associative ignores the dilatancy angle; default: {flow_default}")
    group.add_argument("--contact-model", choices=("vertices", "grid"), help="default: vertices")
    group.add_argument("--grid", type=int, nargs=2, metavar=("ALONG", "ACROSS"),
                       help="points per interface; needs grid")
    group.add_argument("--torsion-limit", action="store_true",
                       help="limit torsion to that of uniform pressure (estimate)")
    group.add_argument("--search", choices=("quick", "standard", "thorough"),
                       help="how long the non-associative analysis searches; default: standard")
    group.add_argument("--time-limit", type=float, metavar="SECONDS",
                       help="after which that search ends with the smallest it has")


def refuse(options: argparse.Namespace, names: Iterable[str], because: str) -> None:
    """Refuse options that were typed and would not be used.

    Parameters
    ----------
    options : of the command
    names : of the options that it would not use
    because : what makes them useless, in words

    Raises
    ------
    InputError
        Naming the first of them.
    """
    for name in names:
        value = getattr(options, name, None)
        if value is not None and value is not False and value != []:
            # DATA of `diagnose` is an argument by its place
            shown = name.upper() if name == "data" else f"--{name.replace('_', '-')}"
            raise InputError(f"{shown} is not used {because}: leave it out")


def refuse_same_file(options: argparse.Namespace) -> None:
    """Refuse to write over the target of a command, or two answers to one file.

    ``options`` are those of the command, checked before anything is read.
    """
    taken = {named_path(options.target).resolve(): "the target"} if getattr(options, "target", None) else {}
    for name, value in vars(options).items():
        if isinstance(value, Path) and name not in ("data", "pool"):
            shown, file = f"--{name.replace('_', '-')}", value.resolve()
            if file in taken:
                raise InputError(f"{shown} {value} is {taken[file]}, which would be lost: name another file")
            taken[file] = f"the file of {shown}"


def method_of(options: argparse.Namespace) -> str:
    """The method asked for."""
    return options.method or LIMIT


def settings_of(options: argparse.Namespace) -> dict:
    """Settings of the analysis typed in ``options``, as keywords of ``predict``.

    Those that the method does not take are refused by name.
    """
    method = method_of(options)
    if method != LIMIT:  # any other name says its flow rule, or needs none
        refuse(options, ("flow_rule",), f"by --method {method}, which has its own")
    chosen = get_method(method, options.flow_rule)
    takes = {*chosen.takes, "flow_rule"}
    refuse(options, (n for n in ANALYSIS if n not in takes), f"by {chosen.name}, which takes {_flags(takes)}")
    if options.grid and options.contact_model != "grid":
        raise InputError("--grid needs --contact-model grid")
    given = {name: getattr(options, name) for name in ANALYSIS}
    return {k: tuple(v) if k == "grid" else v for k, v in given.items() if v is not None and v is not False}


def _flags(names: Iterable[str]) -> str:
    """Options of an analysis as they are typed, without the flow rule.

    That has a refusal of its own.
    """
    return ", ".join(f"--{n.replace('_', '-')}" for n in ANALYSIS if n in names and n != "flow_rule") or "none of these"


def told(settings: dict, method: str) -> dict:
    """Settings of an analysis that tells every stage of its search.

    It does so where somebody looks. Only the non-associative analysis searches, named as ``method`` or as a flow rule
    in the ``settings``.
    """
    searching = NON_ASSOCIATIVE in (method, settings.get("flow_rule"))
    return settings | ({"progress": lambda trial: say(f"  {trial}")} if searching and lines() else {})
