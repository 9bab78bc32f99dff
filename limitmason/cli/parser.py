"""All commands, with their options, as one parser.

Types of options, such as lengths with their unit, are in ``console``.
"""

import argparse
import re
from typing import Any

from limitmason import __version__
from limitmason.cli import (
    browser_page,
    check,
    compare_and_report,
    diagnosis,
    experiments,
    pushover,
    safety,
    solve_and_draw,
)
from limitmason.display.progress import MODES

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
  limitmason compare wall.json --figure compare_and_report.png   every theory side by side
  limitmason pushover brick-panels-opening/S1 --to 2mm --blocks lumped --figure s1.png
  limitmason predict modern-walls --method extended --store walls.jsonl
  limitmason diagnose --template data.csv              measured values to fill in, then
  limitmason diagnose data.csv --noise 0.04 --out result
  limitmason app                                       all of this on a page in the browser
  limitmason view wall.json --open                     a scene to turn, in the browser
  limitmason figure mechanism wall.json -o wall.pdf    also: assembly, forces; .png, .pdf or .svg

units: SI (m, kg, N, Pa), angles in degrees where a name ends in _deg; z is up, compression positive.
The multiplier scales the live loads; for horizontal loads equal to the weight it is the tangent of the tilt angle
(dry joints). exit status: 0 solved, 1 something to decide (check), 2 wrong input, 3 not solved, 130 interrupted.
"""


class _Parser(argparse.ArgumentParser):
    """A parser that takes -1e4 and -2mm for numbers, as forces and lengths are written, and for no options."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        # argparse has no public way to say what looks like a number
        self._negative_number_matcher = re.compile(r"-\d*\.?\d+\.?([eE][-+]?\d+)?[a-z]*$")


def command_parser() -> argparse.ArgumentParser:
    """Parser of ``limitmason COMMAND ...``.

    ``run`` of what it returns is the function of the command, which takes all of it and returns the exit status.
    """
    style = argparse.RawDescriptionHelpFormatter
    top = _Parser("limitmason", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=style)
    top.add_argument("--version", action="version", version=f"limitmason {__version__}")
    top.add_argument("--progress", choices=MODES, metavar="WHEN",
                     help="how far a long run is: always, never, or auto, on a terminal")
    top.add_argument("--debug", action="store_true", help="show the whole traceback of an error")
    commands = top.add_subparsers(title="commands", metavar="COMMAND")
    for module in (experiments, solve_and_draw, safety, check, compare_and_report, pushover, diagnosis, browser_page):
        module.add_commands(commands)
    return top
