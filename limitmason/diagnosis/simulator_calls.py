"""Calls of the user's simulator: checked, counted, in parallel, kept on disk."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from functools import partial
from math import isfinite, nan
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.causes.cause import Cause, Extension
from limitmason.display.progress import reached, task
from limitmason.errors import InputError
from limitmason.storage.files import named_path
from limitmason.study.memo import Memo
from limitmason.study.run_fingerprint import fingerprint, fingerprint_of_code
from limitmason.study.workers import run_points

OWN = "in code given to the study: "  # begins the note on an error that code of the user raised


def note_user_code(error: Exception, what: str) -> None:
    """Say with an error of the user's own function where it was called.

    Type and traceback stay the same.
    """
    error.add_note(f"{OWN}{what}")


def is_user_code(error: BaseException) -> bool:
    """Whether an error was raised by code of the user."""
    return any(note.startswith(OWN) for note in getattr(error, "__notes__", ()))


Prediction = float | Mapping[str, float]
NUMBERED = "number "  # begins what is known of a specimen only by its place in the list


class Job(NamedTuple):
    """One call of the simulator.

    Parameters
    ----------
    specimen : its number
    parameters : keywords and their values
    steps : causes with ``apply``, and the size of each in its unit
    """

    specimen: int
    parameters: tuple[tuple[str, float], ...]
    steps: tuple[tuple[Cause, float], ...] = ()


class Simulator:
    """A plain function ``simulate(specimen, **parameters)`` with a memory.

    Parameters
    ----------
    simulate : returns the prediction of what was measured, a number, or a mapping of quantities to numbers
    specimens : what is passed to it, one per measured value
    cache : file that keeps every value, one line each; an interrupted study goes on where it stopped
    n_jobs : processes
    needed : quantities that it must return, and whether each must be positive; a single one may come as a number
    asked : which of them it must return of each specimen; None is all
    version : part of the key on disk, for what it does not see; with one, lists and mappings that ``simulate`` holds
        are taken for its own state, such as counters, and do not count

    Notes
    -----
    Specimens that are equal are simulated once: those to which ``simulate.identity(specimen)`` gives the same text, if
    the function has such an attribute (None is no statement), else mappings with equal content but for "measured".
    Causes that read the specimen are still simulated for each.

    The key in the file holds the function with all that it uses of its module (:func:`limitmason.study.fingerprint`),
    ``version``, the specimen, the parameters and the causes with their options. What it reads elsewhere, such as a
    file, is not seen: change ``version`` then. A kill loses only the calls under way.
    """

    def __init__(
        self, simulate: Callable[..., float], specimens: Sequence[Any], *, cache: str | Path | None = None,
        n_jobs: int = 1, version: str = "", needed: Mapping[str, bool] | None = None,
        asked: Sequence[frozenset[str]] | None = None,
    ):
        """Begin without any simulation.

        What it knows is kept by specimen, parameters and causes, in memory and in the file.

        Parameters
        ----------
        simulate, specimens : the user's function and what it is called with
        n_jobs : processes
        needed : quantities by name, and whether they must be positive
        asked : quantities by specimen
        cache : file that keeps the answers
        version : what stands for the code of ``simulate`` there
        """
        if not callable(simulate):
            raise TypeError(f"simulate must be a function simulate(specimen, **parameters), got {simulate!r}")
        self.simulate = simulate
        self.specimens = list(specimens)
        self.needed = dict(needed or {"value": True})
        self.asked = asked
        self.cache = None if cache is None else named_path(cache)
        self.n_jobs = n_jobs
        self.version = version
        self.calls = 0
        self.progress: Callable[[int], None] | None = None  # told the number of calls after each
        self._known: dict[tuple[str, tuple, tuple], Prediction] = {}  # by specimen as _who says, parameters, causes
        self._equal: list[str] | None = None  # what _equal_to says of every specimen, once it is asked for
        self._memo = None if cache is None else Memo(cache, kind=(int, float, dict))
        # of the function as it is now: calls may change what it holds
        known = fingerprint_of_code if version else fingerprint
        self._of = "" if cache is None else known(simulate, version)
        self._names: dict[str | Cause, str] = {}  # of specimens and causes in the file

    def check_parameters(self, names: Iterable[str], of: str) -> None:
        """Refuse parameters that ``simulate`` does not take.

        Parameters
        ----------
        names, of : of the parameters, and what has them, for the message

        Raises
        ------
        InputError
            The message lists what it takes.
        """
        try:
            signature = inspect.signature(self.simulate).parameters
        except (TypeError, ValueError):  # a compiled function without signature: its own error will do
            return
        if any(p.kind is p.VAR_KEYWORD for p in signature.values()):
            return
        takes = [n for n, p in signature.items() if p.kind in (p.KEYWORD_ONLY, p.POSITIONAL_OR_KEYWORD)]
        for name in names:
            if name not in takes:
                known = ", ".join(takes[1:]) or "none"
                raise InputError(f"simulate does not take the parameter {name!r} of {of}; it takes: {known}")

    def predict(self, jobs: Sequence[Job]) -> np.ndarray:
        """Predictions of all jobs, (jobs, quantities), computing only the new ones.

        Raises
        ------
        InputError
            For a prediction that is not a positive finite number; the message names specimen and parameters. An error
            of ``simulate`` itself comes through as it is, with a note that names them.
        """
        keys = [(self._who(j), j.parameters, j.steps) for j in jobs]
        missing: dict[tuple, Job] = {}
        for key, job in zip(keys, jobs, strict=True):
            if key not in self._known:
                missing.setdefault(key, job)
        if self._memo is not None:
            for key in [k for k in missing if self._text(missing[k]) in self._memo]:
                kept = self._memo[self._text(missing[key])]
                if self._suffices(kept, self._asked(missing[key].specimen)):
                    self._known[key] = kept
                    missing.pop(key)
        if missing:
            with task("simulations", shown=self.progress is None):
                self._run(missing)
        read = [self._read(job, self._known[key]) for job, key in zip(jobs, keys, strict=True)]
        return np.array(read).reshape(len(jobs), len(self.needed))

    def _run(self, missing: dict[tuple, Job]) -> None:
        """Simulate missing jobs in worker processes, check and keep each answer."""
        before = self.calls
        if self._memo is not None:
            self._memo.check_writable()
        keys, jobs = list(missing), list(missing.values())
        calls = [(k, {"simulate": self.simulate, "specimen": self.specimens[j.specimen], "job": j})
                 for k, j in enumerate(jobs)]
        with closing(run_points(_call, calls, executor=None, workers=self.n_jobs)) as results:
            for k, value in results:
                self._known[keys[k]] = self._checked(jobs[k], value)
                if self._memo is not None:
                    self._memo.keep(self._text(jobs[k]), self._known[keys[k]])
                reached((self.calls - before) / len(jobs), f"{self.calls - before} of {len(jobs)}")

    def _asked(self, specimen: int) -> frozenset[str]:
        return frozenset(self.needed) if self.asked is None else self.asked[specimen]

    def _suffices(self, kept: Prediction, asked: frozenset[str]) -> bool:
        """Whether an answer that another study has kept holds the quantities ``asked``, on the scale of this one."""
        if isinstance(kept, Mapping):
            return asked <= set(kept)
        must_be_positive, *others = self.needed.values()
        return not others and (kept > 0.0 or not must_be_positive)

    def _read(self, job: Job, known: Prediction) -> list[float]:
        """The quantities needed, in order, NaN for those not asked of this specimen.

        ``known`` is the answer to the job: a number, where one quantity is needed, or numbers by quantity.
        """
        if isinstance(known, float):  # asked for first: most are, and whether one is a Mapping takes longer
            return [known]
        if not isinstance(known, Mapping):
            return [float(known)]
        asked, out = self._asked(job.specimen), []
        for quantity, must_be_positive in self.needed.items():
            if quantity in asked:
                what = partial(_quantity_of, self.specimens[job.specimen], job, quantity)
                if quantity not in known:
                    gave = ", ".join(map(str, known)) or "nothing"
                    raise InputError(f"{what()} is missing; it gave {gave}{_to_answer(quantity)}")
                out.append(number(known[quantity], what, must_be_positive))
            else:
                out.append(nan)
        return out

    def _checked(self, job: Job, value: Any) -> Prediction:
        """Count a call and refuse an answer that is no number, or lacks a quantity.

        Parameters
        ----------
        value : what the user's function returned
        """
        self.calls += 1
        if self.progress is not None:
            self.progress(self.calls)

        def what() -> str:
            return f"simulate for {_called(self.specimens[job.specimen], job)}"

        # an Answer of limitmason.methods holds its numbers as "quantities"
        value = value if isinstance(value, float) else getattr(value, "quantities", value)
        if isinstance(value, float) or not isinstance(value, Mapping):
            if len(self.needed) > 1:
                raise InputError(f"{what()} gave {_short(value)}; a mapping of {', '.join(self.needed)} is needed")
            (must_be_positive,) = self.needed.values()
            return number(value, what, must_be_positive)
        self._read(job, value)  # refuses what is missing or no number
        # what is not asked for is kept as well: another study of the same file may ask
        asked = self._asked(job.specimen)
        return {str(q): float(v) for q, v in value.items() if q in asked or (isinstance(v, Real) and isfinite(v))}

    def on(self, specimens: Sequence[Any], needed: Mapping[str, bool]) -> "Simulator":
        """A simulator of other specimens and quantities that knows those equal to these.

        Parameters
        ----------
        needed : quantities by name, and whether each must be positive
        """
        out = Simulator(
            self.simulate, specimens, cache=self.cache, n_jobs=self.n_jobs, version=self.version, needed=needed
        )
        out._of = self._of
        # a specimen known by its place alone is another one in another list
        out._known = {key: value for key, value in self._known.items()
                      if not key[0].startswith(NUMBERED) and out._suffices(value, frozenset(needed))}
        return out

    def _who(self, job: Job) -> str:
        """What tells a call's specimen from others: equal for specimens that are equal."""
        if job.steps and any(cause.reads_specimen for cause, _ in job.steps):
            return f"{NUMBERED}{job.specimen}"
        if self._equal is None:
            self._equal = [self._equal_to(i) for i in range(len(self.specimens))]
        return self._equal[job.specimen]

    def _equal_to(self, number: int) -> str:
        """Text under which the answers of a specimen are kept: equal specimens share them.

        It is the identity that ``simulate`` declares, the content of a mapping without its measured value, or a number.
        """
        specimen, identity = self.specimens[number], getattr(self.simulate, "identity", None)
        said = identity(specimen) if callable(identity) else None
        if said is not None:
            return f"identity {said}"
        if isinstance(specimen, Mapping):
            return f"equal {fingerprint({k: v for k, v in specimen.items() if k != 'measured'})}"
        return f"{NUMBERED}{number}"

    def _text(self, job: Job) -> str:
        """Key in the file: function, specimen, parameters and causes."""
        who = self._who(job)
        specimen = self._named(who, lambda: self.specimens[job.specimen] if who.startswith(NUMBERED) else who)
        steps = [(c.name, c.parameter, self._named(c, partial(getattr, c, "apply")), size) for c, size in job.steps]
        return fingerprint(self._of, specimen, job.parameters, steps)[:32]

    def _named(self, what: str | Cause, thing: Callable[[], Any]) -> str:
        """Fingerprint of a specimen or a cause, made once: of ``thing()``, which ``what`` tells from others."""
        if what not in self._names:
            self._names[what] = fingerprint(thing())
        return self._names[what]


def number(value: Any, what: Callable[[], str], must_be_positive: bool = True) -> float:
    """The value as a float, refused unless finite and, if need be, positive.

    Parameters
    ----------
    what : gives the words of an error, made only where there is one
    must_be_positive : whether its logarithm is compared
    """
    needed = "a positive finite number" if must_be_positive else "a finite number"
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{what()} gave {_short(value)}; {needed} is needed") from None
    if not isfinite(out) or (must_be_positive and out <= 0.0):
        small = ", or return a small positive number for a model that cannot stand" if must_be_positive else ""
        raise InputError(
            f"{what()} gave {out!r}; {needed} is needed: narrow the bounds of the cause, give the measured input "
            f"bounds{small}"
        )
    return out


def _quantity_of(specimen: Any, job: Job, quantity: str) -> str:
    """A quantity of a call in words, for errors."""
    return f"simulate for {_called(specimen, job)}: {quantity!r}"


def _to_answer(quantity: str) -> str:
    """What to give so that a frequency or a shape is answered, or empty.

    It is empty for what only ``simulate`` itself can know.
    """
    if not quantity.startswith(("frequency", "mode")):
        return ""
    by_number = f"several(build, {{{quantity!r}: 'modes'}}) finds it by its number; " if quantity[0] == "f" else ""
    return (f"; {by_number}by its measured shape several(build, answers) finds it where the specimen has a ModalTest "
            "under 'modal test', whose rows are Observation.of_modes")


def _call(simulate: Callable[..., Any], specimen: Any, job: Job) -> Any:
    """Simulate a specimen with parameters and causes, and note both with an error."""
    parameters: dict[str, Any] = dict(job.parameters)
    if job.steps:
        parameters["extend"] = Extension(job.steps, specimen)
    try:
        return simulate(specimen, **parameters)
    except Exception as error:  # whatever the user's function may raise
        note_user_code(error, f"simulate failed for {_called(specimen, job)}")
        raise


def _called(specimen: Any, job: Job) -> str:
    """A call in words, for errors: specimen and its number, parameters, causes."""
    return f"specimen {job.specimen} with {_show(job)} ({_short(specimen)})"


def _short(thing: Any, width: int = 160) -> str:
    """What ``repr`` says of a thing, cut after ``width`` characters."""
    text = repr(thing)
    return text if len(text) <= width else f"{text[:width]}..."


def _show(job: Job) -> str:
    """Parameters and sizes of causes of a call, in words."""
    given = [f"{k}={float(v)!r}" for k, v in job.parameters] + [f"{c.name}={float(v)!r}" for c, v in job.steps]
    return ", ".join(given) or "no parameters"
