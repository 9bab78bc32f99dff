"""The command that diagnoses: what a simulation gets wrong on measured data, named or not, with report and figures."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import limitmason as lm
from limitmason.cli import console
from limitmason.errors import InputError
from limitmason.experiments.series import cases_of, series_of, write_template
from limitmason.storage.files import named_path

ABOUT = """\
Hold a simulation against measured values and say which listed cause explains the difference, or that none does, or that
the data cannot tell.

The data: a CSV file with a row of column names, a line of units (# units: -,m; '-' for words) and one row per
measured value. Column 'measured' holds the value; 'specimen' a name, 'group' the configuration (repeats share one),
'noise' the relative error of each value; all others are covariates. `limitmason diagnose --template data.csv` writes
such a file.

Or a folder, of any number of quantities per specimen: specimens.csv, measured.csv (a column per quantity, blank where
missing), quantities.csv (scatter and kind of each) and predicted.csv, or a model that returns a mapping of quantities.
`limitmason diagnose --template DIR` writes an example.

The simulation: --model with a packaged series (minho, ...; the file names its specimens, or leave the file out),
--model module:function or file.py:function for simulate(specimen, **parameters) of your own, or a column of the file
with its predictions (--predicted); then only causes that act on the predicted value can be tried.
"""

_FROM_FILES: set[str] = set()  # names of modules that were read from files of users

_DEFAULTS = {"out": Path("diagnosis"), "seed": 0, "jobs": 1, "next": 4, "rehearse": 0, "missing": 0}


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``diagnose`` to the commands."""
    asked = console.command(
        commands, "diagnose", _diagnose, help="what a simulation gets wrong on measured data, and why",
        description=ABOUT, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    asked.add_argument("data", nargs="?", type=named_path, metavar="DATA", help="CSV file or folder; see above")
    asked.add_argument("--model", metavar="NAME", help="packaged series, or module:function, or file.py:function")
    asked.add_argument("--predicted", metavar="COLUMN", help="column with predictions; default: 'predicted'")
    asked.add_argument("--template", type=console.in_a_folder, metavar="FILE", help="write a data file to start from "
                       "(with --model SERIES that series) and stop")
    asked.add_argument("--out", type=named_path, metavar="DIR", help="default: diagnosis")
    asked.add_argument("--title", help="of the report; default: the file's name")
    table = asked.add_argument_group("columns")
    table.add_argument("--measured", metavar="COLUMN", help="measured values; default: 'measured'")
    table.add_argument("--group", metavar="COLUMN", help="configuration; default: 'group' where there is one")
    table.add_argument("--covariates", nargs="+", metavar="COLUMN", help="default: all columns left")
    table.add_argument("--batches", nargs="+", metavar="COLUMN", help="columns of words whose labels may be read by "
                       "another gain; default: batch, sensor, operator, laboratory")
    table.add_argument("--shared", nargs="+", metavar="COLUMN", help="columns of words within whose labels tests may "
                       "share a part of their noise; its share is estimated; default: batch, day, operator, sensor, "
                       "laboratory, setup where they are recorded and no cause is about them")
    known = asked.add_argument_group("what is known, and what may be wrong")
    known.add_argument("--noise", metavar="SD", help="relative error of the measured values (0.04 is 4 %%), "
                       "'unknown', or 'replicates' (repeats in a group); default: column 'noise', or unknown")
    known.add_argument("--dof", type=float, help="degrees of freedom of replicates that --noise was taken from")
    known.add_argument("--input", action="append", default=[], metavar="NAME=VALUE,SD", help="input of the "
                       "simulation that was measured, with its error")
    known.add_argument("--causes", metavar="LIST", help="module:LIST or file.py:LIST, or names of the catalogue "
                       "between commas; default for a packaged series: the catalogue's list")
    known.add_argument("--towards", nargs="+", default=[], metavar="COLUMN", help="with --predicted: predictions of a "
                       "second model; tried as a cause, from one to the other")
    known.add_argument("--tilting", action="store_true", help="the values are tangents of a tilt angle")
    known.add_argument("--spatial", action="store_true", help="the walls do not work in one plane")
    run = asked.add_argument_group("run")
    run.add_argument("--seed", type=int, help="default: 0")
    run.add_argument("--levels", type=int, help="most sizes per cause that are simulated; default: 9, or 17 "
                     "where predictions are tabulated")
    run.add_argument("--jobs", type=int, help="processes for the simulations; default: 1")
    run.add_argument("--fresh", action="store_true", help="forget the simulated values in DIR; they are kept there, so "
                     "that a run goes on after a kill")
    run.add_argument("--pool", type=named_path, metavar="CSV", help="specimens that could be tested next; default: "
                     "repeats of those in the file")
    run.add_argument("--next", type=int, metavar="K", help="number of next tests; default: 4")
    run.add_argument("--rehearse", type=int, metavar="N", help="blind trials on this design")
    run.add_argument("--missing", type=int, metavar="N", help="blind trials with each cause taken off the list in "
                     "turn: how often a name is given to something else")
    run.add_argument("--no-checks", action="store_true", help="skip judging the data again without each specimen")
    console.analysis_options(asked)


def _diagnose(options: argparse.Namespace) -> int:
    """Diagnose as typed in ``options``.

    An error of the user's own function keeps its traceback.
    """
    from limitmason.diagnosis.simulator_calls import is_user_code

    try:
        return _run(options)
    except Exception as error:
        # module:function and module:LIST are the user's own; other errors are told by the caller
        if options.debug or not is_user_code(error) or ":" not in f"{options.model}{options.causes}":
            raise
        # an error of the user's own function: where it happened stands in its traceback, never in one line
        console.say("".join(traceback.format_exception(error)).rstrip())
        return 2


def _run(options: argparse.Namespace) -> int:
    """Diagnose what the options name, write the results, and print the answer."""
    if options.template:
        others = [name for name in vars(options) if name not in ("template", "model", "run", "debug", "progress")]
        console.refuse(options, others, "with --template, which writes a file and stops")
        if options.model and ":" in options.model:
            raise InputError(f"--template with --model needs a packaged series, got {options.model!r}")
        if options.template.suffix:
            write_template(options.template, options.model)
        elif options.model:
            raise InputError(f"a template of the series {options.model} is a file: --template {options.template}.csv")
        else:
            lm.diagnosis.study_from_folder.write_folder(options.template)
        console.say(f"wrote {options.template}: replace its rows, keep the line of units, then `limitmason diagnose`")
        return 0
    if options.next == 0:
        console.refuse(options, ("pool",), "with --next 0")
    for name, default in _DEFAULTS.items():
        if getattr(options, name) is None:
            setattr(options, name, default)
    if options.out.exists() and not options.out.is_dir():
        raise InputError(f"--out {options.out} is a file; name a folder")
    store = options.out / "simulations.jsonl"
    if options.fresh:
        store.unlink(missing_ok=True)
    of_folder = options.data is not None and options.data.is_dir()
    read = lm.diagnosis.Study.from_folder if of_folder else lm.diagnosis.Study.from_table
    stated = _of_folder(options) if of_folder else _of_table(options)
    study = read(options.data, cache=store, n_jobs=options.jobs, **stated)
    console.say(str(study))
    found = lm.diagnosis.investigate(
        study, seed=options.seed, next_tests=options.next, pool=options.pool, rehearse=options.rehearse,
        missing=options.missing, progress=console.lines(),
    )
    if not options.no_checks:
        console.say("judging again under other statements of the noise and without each specimen")
    files = lm.figures.diagnosis_folder(found, options.out, checks=not options.no_checks)
    console.show_text("\n".join(_in_short(found.answer.record())))
    console.say(f"wrote {options.out}: {', '.join(str(file.relative_to(options.out)) for file in files)}")
    return 0


def _in_short(record: Mapping[str, Any]) -> list[str]:
    """A diagnosis in three lines at most.

    They are the verdict, what it rests on, and what would settle it.

    Parameters
    ----------
    record : of the diagnosis, as its JSON file holds it
    """
    first, *others = record["in words"] or [""]
    # what would settle it says more than the sentence that comes next
    settles = next((line for line in others if line.startswith("What would")), others[0] if others else "")
    headline = record["headline"]
    return [line for line in (headline[0].upper() + headline[1:] + ".", first, settles) if line]


def _of_folder(options: argparse.Namespace) -> dict[str, Any]:
    """What the options say of the model of a folder.

    They are keywords of ``Study.from_folder``.
    """
    useless = ("measured", "predicted", "group", "batches", "noise", "dof", "towards", "tilting", "spatial")
    console.refuse(options, (*useless, "method", *console.ANALYSIS), "with a folder, whose files say it")
    if options.model and ":" not in options.model:
        raise InputError(f"--model {options.model}: a folder takes a function, module:function or file.py:function")
    model = load_object(options.model, "--model") if options.model else None
    chosen = None
    if options.causes:
        found = _causes(options.causes) or ()
        known = lm.causes.ALL
        chosen = [known[c]() if isinstance(c, str) and c in known else c for c in found]
        if words := [c for c in chosen if isinstance(c, str)]:
            raise InputError(f"there is no cause {words[0]!r}; known: {', '.join(known)}")
    return {"model": model, "causes": chosen, **_stated(options)}


def _stated(options: argparse.Namespace, *more: str) -> dict[str, Any]:
    """Options as keywords of a study by the same names, and measured inputs.

    ``more`` are names besides those that a folder takes too.
    """
    names = ("covariates", "shared", "title", "levels", *more)
    return {name: getattr(options, name) for name in names} | {"inputs": dict(map(_input, options.input))}


def _of_table(options: argparse.Namespace) -> dict[str, Any]:
    """What the options say of data and model, as keywords of ``Study.from_table``."""
    own = bool(options.model) and ":" in options.model
    series = series_of(options.model) if options.model and not own else None
    has_model = series is not None and any(c.buildable for c in cases_of(series))
    _refuse_unused(options, own=own, has_model=has_model)
    model = load_object(options.model, "--model") if own else options.model
    if own and not callable(model):
        raise InputError(f"--model {options.model}: it is no function")
    if own and not options.causes:
        raise InputError("a model of your own needs its list of causes: --causes module:LIST")
    return {
        "model": model, "method": console.method_of(options), "settings": console.settings_of(options),
        "measured": options.measured or "measured", "noise": _noise(options.noise), "causes": _causes(options.causes),
        **_stated(options, "predicted", "towards", "group", "batches", "dof", "tilting", "spatial"),
    }


def _refuse_unused(options: argparse.Namespace, *, own: bool, has_model: bool) -> None:
    """Refuse options that this kind of model does not use.

    Parameters
    ----------
    options : of the command
    own : the model is a function of the user
    has_model : it is a packaged series whose walls can be built
    """
    if own:
        console.refuse(options, ("predicted",), f"with --model {options.model}, which predicts itself")
    if not (has_model and options.predicted is None):
        what = f"--model {options.model}" if own else "predictions in a column (--predicted)"
        console.refuse(options, ("method", *console.ANALYSIS), f"with {what}: no analysis is made here")
        console.refuse(options, ("spatial",), f"with {what}: it chooses among causes inside a packaged model")
    if options.data and options.predicted and has_model:
        console.refuse(options, ("model",), "with --predicted, which takes the predictions from a column")
    if options.causes and ":" in options.causes:
        own_list = "with a list of causes of your own: add them to the list"
        console.refuse(options, ("tilting", "batches", "spatial"), own_list)
    if options.noise == "replicates":
        console.refuse(options, ("dof",), "with --noise replicates, which counts its own degrees of freedom")


def _file_of(module: ModuleType | None) -> Path | None:
    """The file that a module was read from."""
    file = getattr(module, "__file__", None)
    return None if file is None else Path(file).resolve()


def load_object(text: str, what: str) -> Any:
    """The object behind "module:name" or "file.py:name".

    Parameters
    ----------
    text : as typed; a module is looked up in the current folder too
    what : the option, for errors

    Raises
    ------
    InputError
        Naming what is not found. An error of the module itself comes through as it is, with a note.
    """
    module, _, name = text.rpartition(":")
    if not module or not name:
        raise InputError(f"{what} {text}: give module:name or file.py:name")
    path = named_path(module)
    is_file = path.suffix == ".py"
    folder = str(path.resolve().parent if is_file else Path.cwd())
    if is_file and not path.exists():
        raise InputError(f"{what} {text}: there is no file {module}")
    before = list(sys.path)
    if folder not in sys.path:
        sys.path.insert(0, folder)  # stays: worker processes import the same module
    if path.stem in _FROM_FILES and _file_of(sys.modules.get(path.stem)) != path.resolve():
        # a file of that name was read from another folder, which must no longer come first
        sys.modules.pop(path.stem, None)
        sys.path.remove(folder)
        sys.path.insert(0, folder)
    try:
        return _imported(module, name, f"{what} {text}")
    except Exception:
        # the folder of a file that is refused must not hide modules of its names from processes that start later
        sys.path[:] = before
        raise


def _imported(module: str, name: str, typed: str) -> Any:
    """The object of a module, as :func:`load_object`, whose folder is on the path.

    Parameters
    ----------
    module : its name, or that of its file, which ends in .py
    name : of the object
    typed : the option and what was typed, for errors
    """
    from limitmason.diagnosis.simulator_calls import note_user_code

    path = named_path(module)
    is_file = path.suffix == ".py"
    try:
        found = import_module(path.stem if is_file else module)
    except ModuleNotFoundError as error:
        # the module is there, but not one that it imports
        if error.name is None or error.name.split(".")[0] != module.split(".")[0]:
            note_user_code(error, f"{typed}: {path} needs a module that is not there")
            raise
        raise InputError(f"{typed}: {error}; give module:name or file.py:name") from None
    except Exception as error:  # whatever the user's module may raise
        note_user_code(error, f"{typed}: {path} fails when it is imported")
        raise
    if is_file:
        # a module of that name was imported already, or comes first on the path
        if _file_of(found) != path.resolve():
            raise InputError(f"{typed}: another module is called {path.stem}: give the file another name")
        _FROM_FILES.add(path.stem)
    if not hasattr(found, name):
        raise InputError(f"{typed}: {module} has no {name!r}")
    return getattr(found, name)


def _causes(text: str | None) -> list | None:
    """Causes as typed in ``text``.

    They are names between commas, or a list or function of the user's module.
    """
    if not text:
        return None
    if ":" not in text:
        return [name.strip() for name in text.split(",")]
    chosen = load_object(text, "--causes")
    if not callable(chosen):
        return list(chosen)
    from limitmason.diagnosis.simulator_calls import note_user_code

    try:
        return list(chosen())
    except Exception as error:  # whatever the user's function may raise
        note_user_code(error, f"--causes {text} failed")
        raise


def _noise(text: str | None) -> float | str | None:
    """Noise as typed in ``text``: a number, or a word that a study knows.

    4% is 0.04.
    """
    if text in (None, "unknown", "replicates"):
        return text
    try:
        return float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        raise InputError(
            f"--noise must be a number such as 0.04 or 4%, 'unknown' or 'replicates', got {text!r}"
        ) from None


def _input(text: str) -> tuple[str, Any]:
    """Name of an input and its measured value with its error, typed as NAME=VALUE,SD."""
    name, _, rest = text.partition("=")
    try:
        value, sd = (float(v) for v in rest.split(","))
    except ValueError:
        raise InputError(f"--input must read NAME=VALUE,SD such as friction=0.65,0.03, got {text!r}") from None
    return name.strip(), lm.diagnosis.Measured(value, sd)
