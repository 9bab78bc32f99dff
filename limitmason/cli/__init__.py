"""The command line: packaged experiments, models from files, theories side by side, diagnosis, figures.

Answers go to standard output, progress and errors to standard error; a mistake in the input ends with exit status 2
and one line that names it, an analysis without a finite multiplier with exit status 3.
"""

import argparse
import warnings
from collections.abc import Sequence
from typing import Any

from limitmason.cli.console import say
from limitmason.cli.parser import command_parser
from limitmason.display.progress import reached, show_progress, task
from limitmason.errors import InputError, NotApplicable, NotConverged


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
