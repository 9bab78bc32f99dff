"""The command line: packaged experiments, models from files, theories side by side, diagnosis, figures.

Answers go to standard output, progress and errors to standard error. A mistake in the input ends with exit status 2
and one line that names it, an analysis that is not solved, or almost, with exit status 3.

In every module ``add_commands`` takes ``commands``, the parsers of all commands, to which it adds its own. The function
that runs a command takes ``options``, what was typed as argparse read it, and returns the exit status.
"""

import argparse
import warnings
from collections.abc import Sequence
from typing import Any

from limitmason.cli.console import refuse_same_file, say
from limitmason.cli.parser import command_parser
from limitmason.display.progress import reached, show_progress, task
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.storage.interrupts import INTERRUPTED, handed_on


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    Parameters
    ----------
    arguments : as typed after ``limitmason``; those of the process by default
    """
    options = command_parser().parse_args(arguments)
    if not hasattr(options, "run"):
        command_parser().print_help()
        return 0
    if options.progress is not None:
        with show_progress(options.progress):
            return _run(options)
    return _run(options)


def _run(options: argparse.Namespace) -> int:
    """Run the command of ``options`` and return its exit status.

    An error of input is told in one line.
    """
    try:
        with task("limitmason"), warnings.catch_warnings(), handed_on():  # of a run that ends early with what it has
            warnings.showwarning = _tell
            reached(0.0, share=1.0)
            refuse_same_file(options)
            return options.run(options)
    except KeyboardInterrupt:
        say("interrupted")
        return INTERRUPTED
    except BrokenPipeError:  # who reads the output has enough of it, as `head` does
        return 0
    except (InputError, NotApplicable, NotConverged, TypeError, KeyError, OSError, ImportError, UnicodeError) as error:
        # a plain ValueError is no refusal but a mistake of ours: it keeps its traceback
        if options.debug:
            raise
        if isinstance(error, FileNotFoundError):
            text = f"{error.filename}: no such file"
        elif isinstance(error, OSError) and error.filename and error.strerror:
            text = f"{error.filename}: {error.strerror.lower()}"  # without its number
        elif isinstance(error, KeyError) and error.args:
            text = error.args[0]  # as a text it has quotes around
        else:
            text = str(error)
        say(f"error: {text}")
        return 2


def _tell(message: Warning | str, category: type[Warning], *_place: Any, **_more: Any) -> None:
    """A warning as a line of its own.

    Where in the code it arose helps nobody at a terminal.
    """
    say(f"warning: {message}" if issubclass(category, UserWarning) else f"{category.__name__}: {message}")
