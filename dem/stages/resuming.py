"""Going on where a run ended or was cut off: what must agree, where it stood."""

import hashlib
import signal
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields, is_dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.contact.detection import SOONEST
from dem.model.joints import JointOptions, make_laws
from dem.model.state import LIVE, State
from limitmason.arrays import Array, Flags
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.fingerprint import check_same_loads
from limitmason.model.stages import Stage
from limitmason.storage.files import Archive, as_json, named_path, of_json, read_archive
from limitmason.storage.interrupts import ends_early


class RunStatus(StrEnum):
    """How a run of stages, or one of them, ended."""

    FINISHED = "finished"
    INTERRUPTED = "interrupted"
    NOT_SETTLED = "not settled"
    UNSTABLE = "unstable"


@dataclass
class Watch:
    """When contacts must be looked for: what has happened since the last search."""

    since: int = 0  # steps
    travelled: float = 0.0  # way of the fastest corner [m]
    due: int = SOONEST  # steps after which corners must be looked at
    searching: bool = False  # False as long as nothing has moved beyond small displacement


@dataclass
class Position:
    """Where in its stages a run stands: all that a stage knows beside the state.

    Parameters
    ----------
    stage : number of the stage, from 0
    done : steps of it taken, those of waiting left out
    begun, dt : time and time step at its begin [s]
    factors, shift, quat, held : of :class:`dem.model.state.State` at its begin, [-], [m], [-]; ``held`` before the
        stage held any degrees of freedom itself, shapes (5,), (n, 3), (n, 4), (n, 6)
    quiet : checks in a row in which a Settle was quiet
    outcome : of the stage so far
    servo : vertical give [m/N] and summed lack [N] of every servo, which writes its own row, shape (s, 2)
    energy : sums of energy that the run began with, for the guard against explosions, shape (8,)
    waited : steps in a row, about, for which a drive has stood still for calm
    ended : whether the stage has ended, also before its time
    """

    stage: int
    done: int
    begun: float
    dt: float
    factors: Array
    shift: Array
    quat: Array
    held: Flags
    quiet: int
    outcome: RunStatus
    servo: Array
    watch: Watch
    energy: Array
    waited: int = 0
    ended: bool = False

    def arrays(self) -> dict[str, Any]:
        """All of it as arrays by name."""
        values = {f.name: getattr(self, f.name) for f in fields(self)} | {"watch": astuple(self.watch)}
        numbers = {name: value for name, value in values.items() if not isinstance(value, np.ndarray)}
        arrays = {f"position.{name}": value for name, value in values.items() if name not in numbers}
        return arrays | {"position.numbers": as_json(numbers)}

    @classmethod
    def from_arrays(cls, file: Archive) -> "Position | None":
        """Inverse of :meth:`arrays`, from a history's file; None where the run was over."""
        found: dict[str, Any] = file.group("position")
        if not found:
            return None
        found |= of_json(found, "numbers")
        del found["numbers"]
        found["outcome"], found["watch"] = RunStatus(found["outcome"]), Watch(*found["watch"])
        return cls(**found)


def part_file(checkpoint: str | Path | None, name: str) -> Path | None:
    """File of part ``name`` of a run beside ``checkpoint``; None where that is."""
    if checkpoint is None:
        return None
    path = named_path(checkpoint)
    return path.with_name(f"{path.stem}-{name}.npz")


def stage_as_text(value: Any) -> str:
    """A stage, or a part of one, as text with its values; equal ones have equal text.

    Parameters
    ----------
    value : a stage, or a number, text, array, mapping or sequence in it
    """
    if is_dataclass(value) and not isinstance(value, type):
        parts = ", ".join(f"{f.name}={stage_as_text(getattr(value, f.name))}" for f in fields(value))
        return f"{type(value).__name__}({parts})"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k!r}: {stage_as_text(v)}" for k, v in value.items()) + "}"
    if isinstance(value, np.ndarray | Sequence) and not isinstance(value, str):
        return "[" + ", ".join(stage_as_text(v) for v in value) + "]"
    return repr(value.item() if isinstance(value, np.generic) else value)


def check_same_stages(stages: Sequence[Stage], before: Sequence[str]) -> None:
    """Refuse stages other than those a run was cut off in, ``before`` as texts.

    Raises
    ------
    InputError
        Naming the first stage that differs.
    """
    now = [stage_as_text(s) for s in stages]
    for number, (one, two) in enumerate(zip(now, before, strict=False)):
        if one != two:
            raise InputError(f"stage {number} is not the one the run was cut off in: {one} against {two}")
    if len(now) != len(before):
        raise InputError(f"the run was cut off in {len(before)} stages, {len(now)} are given")


def digest(*parts: bytes) -> str:
    """What stands for a setting in a file: equal where all bytes are."""
    made = hashlib.sha256()
    for part in parts:
        made.update(part)
    return made.hexdigest()


def digests(**settings: Any) -> dict[str, str]:
    """Digest of every setting, by the name a user gave it."""
    return {name: digest(stage_as_text(value).encode()) for name, value in settings.items()}


def signature(assembly: Assembly, parts: Mapping[str, Iterable[NDArray[Any]]], **settings: Any) -> dict[str, str]:
    """What a run must share with the one it goes on from, as a digest by name.

    Parameters
    ----------
    parts : arrays that the model is made of, by what they are; what the assembly knows by that name goes with them
    settings : of the run, by the names a user gave them
    """
    out, of_assembly = {}, dict(assembly.fingerprint.digests)
    for name, arrays in parts.items():
        known = of_assembly.pop(name, "").encode()
        out[name] = digest(known, *(np.ascontiguousarray(v).tobytes() for v in arrays))
    return out | of_assembly | digests(**settings)


def check_same(path: Path, now: Mapping[str, str]) -> None:
    """Refuse a checkpoint of a run with other settings.

    Parameters
    ----------
    path : of the checkpoint, which holds digests of the settings of its run, by name
    now : digests of those of the run that would go on from it

    Raises
    ------
    InputError
        Naming the settings that differ, and for a file that does not say of which run it is.
    """
    file = read_archive(path)
    then = of_json(file, "same") if "same" in file else {}
    if not then:
        raise InputError(
            f"the checkpoint {path} does not say how its push was run: it is of an earlier version, or no push; give "
            "another file, or delete this one"
        )
    other = [name for name, made in now.items() if then.get(name) != made]
    if other:
        raise InputError(
            f"the checkpoint {path} is of another run: its {', '.join(other)} differ from those given now; give "
            "another file, delete this one, or give what was given then"
        )


def check_checkpoint(path: str | Path | None, *, begins: bool) -> None:
    """Refuse to write a checkpoint over what would be lost.

    Parameters
    ----------
    path : of the checkpoint, None for none
    begins : whether the run begins, and is no part of one that the file may hold

    Raises
    ------
    InputError
        For a folder, a file that is no run, and a run that this one does not go on from.
    """
    if path is None or not named_path(path).exists():
        return
    if named_path(path).is_dir():
        raise InputError(f"the checkpoint {path} is a folder: give a file")
    if named_path(path).is_file() and "words" not in read_archive(path):
        raise InputError(f"{path} is no checkpoint of a run, and would be lost: give another file")
    if begins and Path(path).is_file():
        raise InputError(
            f"{path} holds a run already: go on with dem.resume(dem.History.load({str(path)!r}, assembly), stages, "
            f"checkpoint={str(path)!r}), delete it to begin anew, or give another file"
        )


def check_continues(assembly: Assembly, state: State, loads: Loads, options: JointOptions | None) -> None:
    """Refuse to go on from a state with another model, other laws or other loads.

    Parameters
    ----------
    assembly : the model now
    state : to go on from, which knows its own model, laws and loads
    loads : now
    options : of the joints now; None for those of the state

    Raises
    ------
    InputError
        Naming the block, or the joint and its field.
    """
    assembly.fingerprint.check_same(state.model, "the state to go on from")
    if options is not None:
        laws, _ = make_laws(assembly, state.dead, options)
        if options.dashpot is None:
            # a dynamic run has chosen its own
            laws[:, kernels.LAW.dash] = state.laws[:, kernels.LAW.dash]
        if not np.array_equal(laws, state.laws):
            raise InputError(
                "joint_options differ from those of the run that ended in this state, which goes on with its own laws: "
                "leave them out, or make a new state"
            )
    # nothing has acted yet
    if state.total[kernels.E_STEPS] == 0.0:
        return
    for case in ("dead", "live"):
        if case == "live" and state.factors[LIVE] == 0.0:
            continue
        what = (
            "the run that ended in this state: a jump of a load that acts is not a load history; leave loads out to "
            "keep them, or bring the change as live load"
        )
        check_same_loads(
            case, loads.rows(case), state.loads.rows(case), [b.name for b in assembly.blocks], what,
            ~assembly.fixed[:, None],
        )


class Interrupt:
    """Whether the keyboard has asked to stop."""

    asked = False


@contextmanager
def interrupts_wait() -> Iterator[Interrupt]:
    """Keep an interrupt from the keyboard until the chunk under way is complete.

    So no state is torn. What is yielded says whether one has come.
    """
    waiting = Interrupt()
    # only the main thread may say what a signal does
    if threading.current_thread() is not threading.main_thread():
        yield waiting
        return

    def note(*_: object) -> None:
        """Take the signal down instead of stopping."""
        waiting.asked = True
        ends_early()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield waiting
    finally:
        signal.signal(signal.SIGINT, before)
