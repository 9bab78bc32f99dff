"""The command line: packaged experiments, models from files, theories side by side, diagnosis, figures.

Answers go to standard output, progress and errors to standard error; a mistake in the input ends with exit status 2
and one line that names it, an analysis without a finite multiplier with exit status 3.
"""

import argparse
import re
import warnings
from collections.abc import Sequence
from typing import Any

from limitmason import __version__
from limitmason.cli import application, check, diagnosis, experiments, models, pushover, safety, theories
from limitmason.cli.console import say
from limitmason.display.progress import MODES, reached, show_progress, task
from limitmason.errors import InputError, NotApplicable, NotConverged

_DESCRIPTION = """\
Collapse multiplier of rigid-block masonry: at what load a block structure collapses, how, and how far to trust it.

A TARGET is either a model file (.json; `limitmason template` writes one to start from) or a packaged experiment
written SOURCE/SPECIMEN, for example ferris-tin-loi-2001/wall-3.
"""

_EPILOG = """\
examples:
  limitmason experiments list                          what is packaged
  limitmason experiments show minho-dry-stone-2005-2009 SW.100.1
  limitmason experiments run ferris-tin-loi-2001       all six walls against the published values
  limitmason experiments run --all --csv table.csv     everything, as a table file
  limitmason solve ferris-tin-loi-2001/wall-3 --figure wall-3.png
  limitmason template wall.json                        a small wall to edit
  limitmason check wall.json --figure check.png        contacts, near misses, implausible input
  limitmason template facade.svg                       the same wall as a drawing in mm with open mortar
  limitmason check facade.svg --scale 0.001            what makes drawn stones meet (needs the extra dxf)
  limitmason stability wall.json --figure stands.png   can it stand, and how well
  limitmason template arch.json --arch                 the arch of a bridge
  limitmason axles arch.json --axle 0 5e4 --axle 1.8 5e4 --level 2.2 --figure axles.png
  limitmason region wall.json --live --push stone-6-2 0 0 -1e4 --figure region.png
  limitmason assess wall.json --site 0.15 2.45 0.28 --soil B --to 0.5
  limitmason solve wall.json --flow-rule non-associative --output answer.json
  limitmason compare wall.json --figure theories.png   every theory side by side
  limitmason pushover brick-panels-opening/S1 --to 2mm --blocks lumped --figure s1.png
  limitmason predict modern-walls --method extended --store walls.jsonl
  limitmason diagnose --template data.csv              measured values to fill in, then
  limitmason diagnose data.csv --noise 0.04 --out result
  limitmason app                                       all of this on a page in the browser
  limitmason view wall.json --open                     a scene to turn, in the browser
  limitmason figure mechanism wall.json -o wall.pdf    also: assembly, forces; .png, .pdf or .svg

units: SI (m, kg, N, Pa), angles in degrees where a name ends in _deg; z is up, compression positive.
The multiplier scales the live loads; for horizontal loads equal to the weight it is the tangent of the tilt angle
(dry joints). exit status: 0 solved, 1 something to decide (check), 2 wrong input, 3 no finite multiplier,
130 interrupted.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    Parameters
    ----------
    arguments : as typed after ``limitmason``; those of the process by default
    """
    options = _parser().parse_args(arguments)
    if not hasattr(options, "run"):
        _parser().print_help()
        return 0
    if options.progress is not None:
        with show_progress(options.progress):
            return _run(options)
    return _run(options)


def _run(options: argparse.Namespace) -> int:
    """Run a command and return its exit code; errors of input are one line."""
    try:
        with task("limitmason"), warnings.catch_warnings():
            warnings.showwarning = _tell
            reached(0.0, share=1.0)
            return options.run(options)
    except KeyboardInterrupt:
        say("interrupted")
        return 130
    except BrokenPipeError:
        return 0
    except (InputError, NotApplicable, NotConverged, TypeError, KeyError, OSError, ImportError, UnicodeError) as error:
        # a plain ValueError is no refusal but a mistake of ours: it keeps its traceback
        if options.debug:
            raise
        if isinstance(error, FileNotFoundError):
            error = InputError(f"{error.filename}: no such file")
        elif isinstance(error, OSError) and error.filename and error.strerror:
            error = InputError(f"{error.filename}: {error.strerror.lower()}")
        say(f"error: {error.args[0] if isinstance(error, KeyError) and error.args else error}")
        return 2


def _tell(message: Warning | str, category: type[Warning], *_place: Any, **_more: Any) -> None:
    """A warning as a line of its own.

    Where in the code it arose helps nobody at a terminal.
    """
    say(f"warning: {message}" if issubclass(category, UserWarning) else f"{category.__name__}: {message}")


class _Parser(argparse.ArgumentParser):
    """A parser that takes -1e4 for a number, as forces are written, and for no option."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._negative_number_matcher = re.compile(r"-\d*\.?\d+\.?([eE][-+]?\d+)?$")


def _parser() -> argparse.ArgumentParser:
    style = argparse.RawDescriptionHelpFormatter
    top = _Parser("limitmason", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=style)
    top.add_argument("--version", action="version", version=f"limitmason {__version__}")
    top.add_argument("--progress", choices=MODES, metavar="WHEN",
                     help="how far a long run is: always, never, or auto, on a terminal")
    top.add_argument("--debug", action="store_true", help="show the whole traceback of an error")
    commands = top.add_subparsers(title="commands", metavar="COMMAND")

    experiments.add_commands(commands)
    models.add_commands(commands)
    safety.add_commands(commands)
    check.add_commands(commands)
    theories.add_commands(commands)
    pushover.add_commands(commands)
    diagnosis.add_commands(commands)
    application.add_commands(commands)
    return top
