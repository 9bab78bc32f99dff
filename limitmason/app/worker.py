"""The process that runs the lines of a session, and what it sends back of them."""

from __future__ import annotations

import ast
import math
import os
import signal
import tempfile
import threading
import time
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.app.script import ScriptLine
from limitmason.comparison import SideBySide
from limitmason.display.progress import reached, task, told_to
from limitmason.errors import InputError, NotApplicable, NotConverged
from limitmason.formats import proposal
from limitmason.model import ContactError
from limitmason.stability_check import Standing

NAMED = (InputError, NotApplicable, NotConverged, TypeError, KeyError, OSError, ImportError, UnicodeError, MemoryError)
"""Errors that are an answer: their words go to the page; any other is a mistake of ours and is called one."""

DRAWING = "drawing = lm.formats.model_of_drawing("
"""How the line begins that reads a drawing."""

LEAST_MEMORY = 4 << 30
"""Bytes of address space that the process gets on any machine."""

MOST_NAMES = 2000
"""Block names that are sent for the fields that ask for one."""


def work(pipe: Connection, folder: str) -> None:
    """Run the sessions that come through the pipe until its other end goes away.

    Parameters
    ----------
    pipe : gets ``list[ScriptLine]``; sends ``("progress", part, text)`` and ``("done", result)``
    folder : where the lines run, so that they name files as the downloaded script does
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in the terminal is for the server, which ends this process
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    _limit_memory()
    import_module("limitmason.figures")  # while somebody fills in the form
    os.chdir(folder)
    lock = threading.Lock()

    def send(*message: Any) -> None:
        """Send a message whole: the thread that keeps the time of a run sends too."""
        with lock:
            pipe.send(message)

    while True:
        try:
            lines = pipe.recv()
        except (EOFError, OSError):
            return
        with told_to(lambda part, text: send("progress", part, text)):
            result = run(lines, folder)
        send("done", result)


def run(lines: Sequence[ScriptLine], folder: str) -> dict[str, Any]:
    """Run the lines of a session.

    Parameters
    ----------
    lines : of the script, in their order
    folder : where they run

    Returns
    -------
    dict
        "summary" of the answer, "files" that the lines wrote by name, "notes" with warnings, "seconds", and lines
        "left_out" that had nothing to show; or "error" with "part", "name" and "text" where a line was refused.
    """
    begun = time.monotonic()
    names: dict[str, Any] = {"__name__": "session"}
    files: dict[str, bytes] = {}
    notes: list[str] = []
    left_out: list[str] = []
    with warnings.catch_warnings(record=True) as caught, task("solve"):
        warnings.simplefilter("always", UserWarning)
        for i, line in enumerate(lines):
            # solving fills the bar but for a tenth, which is kept for the pictures
            reached(0.9 if line.shows else 0.0, share=0.0 if line.shows else 0.9)
            try:
                if line.text.startswith("print("):  # the page has its own words for the answer
                    continue
                if line.shows:
                    files |= _written(line.text, names, folder)
                else:
                    exec(compile(line.text, f"line {i}", "exec"), names)
            except NAMED as error:
                if line.shows:  # a curve without states, an answer without mechanism: no picture is no failure
                    notes.append(_words(error))
                    left_out.append(line.text)
                    continue
                text = (_proposed(line.text) if isinstance(error, ContactError) else "") + _words(error)
                return {"error": {"part": line.part, "name": type(error).__name__, "text": text},
                        "notes": _told(caught)}
            except Exception as error:
                return {"error": {"part": line.part, "name": type(error).__name__, "text": "a mistake in limitmason, "
                        f"please report it with the script: {error}"}, "notes": _told(caught)}
    notes = list(dict.fromkeys([*_told(caught), *notes]))
    spent = round(time.monotonic() - begun, 2)
    return {"summary": summary(names), "files": files, "notes": notes, "seconds": spent, "left_out": left_out}


def summary(names: Mapping[str, Any]) -> dict[str, Any]:
    """What the page writes of an answer, by what it is.

    ``names`` are the variables of the session. There is always the "structure". With an answer "number" is what stands
    in large letters, None where it has none or it is not finite, and "what" says what that is.
    """
    wall = names["wall"]
    free = int((~wall.fixed).sum())
    out: dict[str, Any] = {
        "structure": f"{free} free block{'' if free == 1 else 's'}, {len(wall.interfaces)} joints",
        "blocks": [b.name for b in wall.blocks[:MOST_NAMES]],
        "beside": [*_beside(names.get("test")), *_assumed(names.get("drawing"))],
    }
    answer = names.get("answer")
    if answer is None:
        return out
    out |= {"text": str(answer), "number": None, "what": "", "warnings": list(getattr(answer, "warnings", ()))}
    if isinstance(answer, Prediction):
        value = float(answer.collapse_multiplier)
        out |= {"number": _plain(value), "what": "collapse multiplier λ [-]", "status": str(answer.status),
                "bound": str(answer.bound)}
        with suppress(ValueError):  # loads that no tilt of the ground gives have no angle
            if math.isfinite(value):
                out["also"] = f"tilt at collapse {answer.tilt_angle_deg:.2f}°"
    elif isinstance(answer, Curve):  # over a displacement in m
        what = "largest multiplier λ [-]" if answer.load_unit == "-" else f"largest load [{answer.load_unit}]"
        out |= {"number": _plain(answer.peak.load), "what": what,
                "status": str(answer.status), "also": f"at a displacement of {1e3 * answer.peak.displacement:.4g} mm"}
    elif isinstance(answer, Standing):
        out |= {"what": str(answer).partition("\n")[0], "warnings": list(answer.notes)}
    elif isinstance(answer, SideBySide):
        out |= {"what": "λ [-] by the theories side by side", "rows": [
            [r.method, _plain(r.multiplier), r.status, r.bound] for r in answer.rows]}
    return out


def _beside(test: Any) -> list[str]:
    """Sentences on what was measured and published of a packaged experiment, none without one."""
    if test is None:
        return []
    return [f"{k}, {name}: {v}" for k in ("measured", "published") for name, v in getattr(test, k).items()]


def _assumed(drawing: Any) -> list[str]:
    """Sentences on what was assumed to make a model of a drawing, none without one."""
    return [] if drawing is None else [f"assumed: {text}" for text in drawing.assumed]


def _plain(value: float) -> float | None:
    """A number for JSON, which knows neither NaN nor infinite ones: these are None."""
    return float(value) if math.isfinite(value) else None


def _written(line: str, names: dict[str, Any], folder: str) -> dict[str, bytes]:
    """Run a line that writes files, and return what is in them by their names.

    The files stay in no folder.

    Parameters
    ----------
    names : that the lines before have made
    folder : in which they are written for a moment
    """
    with tempfile.TemporaryDirectory(prefix=".limitmason-", dir=folder) as place:
        os.chdir(place)
        try:
            exec(compile(line, "show", "exec"), names)
            return {p.name: p.read_bytes() for p in Path(place).iterdir()}
        finally:
            os.chdir(folder)


def _words(error: BaseException) -> str:
    """An error in the words that the page shows."""
    if isinstance(error, ImportError):
        return f"{error}; all that the application opens: pip install 'limitmason[app]'"
    if isinstance(error, MemoryError):
        return f"not enough memory, take fewer blocks: {error}".rstrip(": ")
    return str(error.args[0] if isinstance(error, KeyError) and error.args else error)


def _proposed(line: str) -> str:
    """What makes the stones of a drawing meet, in the words of the form.

    ``line`` is the one that read the drawing.
    """
    if not line.startswith(DRAWING):
        return ""
    # the line is an assignment of a call with literal arguments: read, not run
    call = ast.parse(line).body[0].value  # type: ignore[attr-defined]
    given = {k.arg: ast.literal_eval(k.value) for k in call.keywords if k.arg in ("scale", "thickness", "layers")}
    found = proposal(ast.literal_eval(call.args[0]), **given)
    if found is None:
        return ""
    options = {k: v if isinstance(v, float) else ", ".join(v) for k, v in found.options.items()}
    return f"{found.why}: try {' and '.join(f'{k} {v}' for k, v in options.items())}. "


def _told(caught: Sequence[warnings.WarningMessage]) -> list[str]:
    """Words of warnings that are for a user, each once."""
    return list(dict.fromkeys(str(w.message) for w in caught if issubclass(w.category, UserWarning)))


def _end_with_the_parent() -> None:
    """A server that was killed leaves no process behind."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _limit_memory() -> None:
    """Make it an error to take more than half of the machine's memory.

    Else the machine would stand still.
    """
    try:
        import resource

        most = max(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2, LEAST_MEMORY)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    except (ImportError, ValueError, OSError):
        return  # not on this system
