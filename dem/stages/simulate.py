"""The public entry to time stepping: stages, a history, exact checkpoints."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Unpack

import numpy as np

from dem.model.initial_state import initial_state
from dem.model.state import DYNAMIC, State, UnstableError
from dem.settings import StateOptions, given
from dem.stages.history import History, RunSettings
from dem.stages.recording import Recorder
from dem.stages.resuming import RunStatus, check_checkpoint, check_continues, check_same_stages, stage_as_text
from dem.stages.run import Progress, go
from dem.stages.stage_checks import check_stages, prescribed
from dem.stages.stage_run import StageRun
from dem.stages.store import Store
from limitmason.checks import count, finite, instance, numbers, positive, several
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.model_call import of_model
from limitmason.model.stages import Damping, Ramp, Stage


@of_model
def simulate(
    assembly: Assembly,
    stages: Stage | Sequence[Stage],
    *,
    loads: Loads | None = None,
    damping: Damping | None = None,
    sample: int | float = 200,
    store: Store | str | Path | None = None,
    progress: Progress | None = None,
    start: History | State | None = None,
    factors: Sequence[float] | None = None,
    detect_every: int | None = 50,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 20,
    **model: Unpack[StateOptions],
) -> History:
    """Follow an assembly through stages of loading.

    Parameters
    ----------
    assembly : the structure
    stages : ``Settle``, ``Ramp``, ``Tilt``, ``Drive``, ``BaseMotion``, ``Hold``
    loads : dead and live loads; self weight alone by default, those of ``start`` where there is one. Blocks' weights
        are part of the dead loads
    damping : of every stage without its own; local 0.8 to settle and 0.5 to load (quasi-static), none (dynamic)
    sample : steps between samples, and between two calls of ``progress``; a number with a point, such as 0.02, is the
        time between them [s], counted from the begin of every stage, in dynamic runs. It is also when searches for
        contacts begin, see ``detect_every``: other samples move a rocking wall by some per cent
    store : folder in which the samples are kept while it runs, or a :class:`dem.Store` that says of which blocks. The
        history then reads them from there, and its checkpoint is there: ``History.load(folder)`` goes on after a kill
    progress : called with the last sample as a mapping; return True to stop ("interrupted")
    start : a history, or a state, to continue from, with its own mode, laws, points and loads; one that differs from
        them is refused by name. From a history stages go on to the bits that one run of all of them gives; at a state,
        which may have been changed by hand, contacts are looked for at once. What was cut off in the middle of a stage
        goes on with :func:`resume`; given here its stage ends, and lets go what it held
    factors : of the load cases at the start; those of ``start``, or dead loads alone
    detect_every : most steps between two searches for new contacts; where blocks move fast there are fewer. Searches
        begin when a sample sees two blocks that have moved by 2.5 % of the smallest block dimension against each other,
        and a warning says so: until then the contacts of the start are all there are. None keeps them for ever: wrong
        where blocks leave them or meet others
    checkpoint, checkpoint_every : file to which the history so far is written every so many samples; ``History.load``
        and :func:`resume` go on from it to the same bits, also when the process was killed. A run that begins does not
        write over one that is there
    model : options of :func:`dem.initial_state`, by name. ``mode`` is "quasi-static" (scaled masses, local damping; the
        default) or "dynamic" (real masses). ``contact_points`` are the points of a joint along both its sides,
        ``contact_model`` where they lie on it, ``dt`` the time step [s], the longest stable one in dynamic runs. With
        real masses joints alone damp, by dashpots of a tenth of critical at the fastest motion of a block: a face that
        lands flat rebounds with 0.74 of its speed or more. ``joint_options=JointOptions(dashpot=0)`` takes them away,
        another number is damping in proportion to stiffness. ``blocks`` are "rigid" or "simply deformable", which
        strain and bend in a state of ``stress``: ``history.state.stresses``

    Returns
    -------
    History
        Also when interrupted by the keyboard or by ``progress``: everything up to then is kept.

    Raises
    ------
    UnstableError
        When the state is no longer finite or energy appears from nowhere; ``error.history`` holds what was recorded.
    InputError
        For stages that the mode does not allow, what does not fit ``start``, and what
        :func:`dem.initial_state` refuses.

    Notes
    -----
    Two threads step rigid blocks with 3,500 joints or more, to the bits of one. The environment variable
    NUMBA_NUM_THREADS=1 keeps to one; so do the workers of a study, processes started from Python and side threads.
    """
    kept = Store(store) if isinstance(store, str | Path) else store
    if kept is not None:
        instance("store", kept, Store, "or the name of a folder")
    check_checkpoint(checkpoint, begins=start is None)
    with nullcontext() if kept is None else kept.alone():
        if kept is not None:
            kept.check_free()
        run = prepared(
            assembly, stages, loads=loads, damping=damping, sample=sample, start=start, factors=factors,
            detect_every=detect_every, store=kept, **model,
        )
        return _stepped(run, progress=progress, checkpoint=checkpoint, every=checkpoint_every)


def _stepped(
    run: StageRun, *, progress: Progress | None, checkpoint: str | Path | None, every: int
) -> History:
    """History of a run that was stepped to its end, with a checkpoint in its store.

    Parameters
    ----------
    progress : called with every sample; returns True to stop
    checkpoint : file, None for none; a run with a store has its own
    every : samples between two checkpoints
    """
    store = run.rec.store
    if store is None:
        status = go(run, progress=progress, checkpoint=checkpoint, checkpoint_every=every)
        return run.rec.history(status)
    if checkpoint is not None:
        raise InputError(f"the checkpoint of a run with a store is in its folder {store.folder}: leave checkpoint out")
    try:
        status = go(run, progress=progress, checkpoint=store.checkpoint, checkpoint_every=every)
    except UnstableError:
        run.save(store.checkpoint, RunStatus.UNSTABLE)
        raise
    run.save(store.checkpoint, status)
    return run.rec.history(status)


def prepared(
    assembly: Assembly, stages: Stage | Sequence[Stage], *, loads: Loads | None = None, damping: Damping | None = None,
    sample: int | float = 200, start: History | State | None = None, factors: Sequence[float] | None = None,
    detect_every: int | None = 50, store: Store | None = None, **model: Unpack[StateOptions],
) -> StageRun:
    """Run that stands before its first step.

    Arguments, errors and units are those of :func:`simulate`; ``store`` is the folder itself.
    """
    listed = [stages] if isinstance(stages, Stage) else stages
    todo, chosen = list(several("stages", listed, Stage)), given(model, StateOptions, "simulate")
    if not todo:
        raise InputError("stages: give at least one, for example dem.Settle()")
    before = start.state if isinstance(start, History) else start
    if before is not None:
        instance("start", before, State, "or a History")
    # a state that has taken steps bears its loads already
    timed = (chosen.get("mode") or (None if before is None else before.mode)) == DYNAMIC
    notes = check_stages(todo, loaded=before is not None and before.time > 0.0, timed=timed)
    if damping is not None:
        instance("damping", damping, Damping)
    if not isinstance(sample, int | np.integer):
        sample = positive("sample", sample, "s")
        if not timed:
            raise InputError(
                f"sample = {sample:g} s is for dynamic runs: time counts steps in others, give a whole number"
            )
    elif (sample := int(sample)) < 1:
        raise InputError(f"sample must be at least 1 step, got {sample}")
    detect_every = None if detect_every is None else count("detect_every", detect_every)
    if before is None:
        loads = loads if loads is not None else Loads.weight(assembly)
        state = initial_state(assembly, loads, driven=prescribed(assembly, todo), **chosen)
    else:
        state = before.copy()
        if isinstance(start, History) and start.position is not None:
            state.bodies.held[:] = start.position.held  # what a stage that was cut off held ends with it
        loads = loads if loads is not None else state.loads
        # of the options of a state mode and joints may be given again if they are the same; any other is refused
        mode, law = chosen.pop("mode", state.mode), chosen.pop("joint_options", None)
        for name in chosen:
            raise InputError(f"{name} is part of the state to start from: leave it out, or make a new state")
        if mode != state.mode:
            raise InputError(f"the state to start from is {state.mode}, not {mode}")
        check_continues(assembly, state, loads, law)
        if isinstance(start, State):
            state.check_turns(assembly)
    if factors is not None:
        now = numbers("factors", factors)
        if now.shape != state.factors.shape:
            raise InputError(f"factors must be {len(state.factors)} numbers, got {factors!r}")
        for value in now:
            finite("factors: each", value)
        state.factors = now
    state.take_loads(loads)
    if not state.live.any() and any(isinstance(s, Ramp) for s in todo):
        raise InputError("a Ramp scales live loads, and there are none: give loads=lm.Loads.horizontal(assembly)")
    watch = start.settings.watch if isinstance(start, History) else None
    texts = tuple(stage_as_text(s) for s in todo)
    settings = RunSettings(sample=sample, damping=damping, stages=texts, detect_every=detect_every, watch=watch)
    recorder = Recorder(assembly, loads, state, todo, settings, store)
    recorder.notes += notes
    recorder.same = start.same if isinstance(start, History) else {}
    return StageRun(recorder, at=None)


def resume(
    history: History,
    stages: Stage | Sequence[Stage],
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 20,
) -> History:
    """Go on with a run that was interrupted, or killed after a checkpoint.

    What comes out is what the run would have given without the cut, to the last bit: the samples before it are kept.

    Parameters
    ----------
    history : of the run, or :meth:`History.load` of its checkpoint
    stages : all stages of the run, the same as then
    progress, checkpoint, checkpoint_every : as for :func:`simulate`

    Raises
    ------
    InputError
        When the run was over, for other stages (named), and for an assembly whose joints have changed.
    """
    instance("history", history, History)
    if history.position is None:
        raise InputError(f"the run is over ({history.status}): give simulate(start=history) further stages")
    check_checkpoint(checkpoint, begins=False)
    with nullcontext() if history.store is None else history.store.alone():  # what is taken up cuts files
        return _stepped(taken_up(history, stages), progress=progress, checkpoint=checkpoint, every=checkpoint_every)


def taken_up(history: History, stages: Stage | Sequence[Stage]) -> StageRun:
    """Run of ``stages`` that stands where a history of them does, see :func:`resume`.

    One that has ended stays so: a history without a position is over, and its status says how.
    """
    todo = [stages] if isinstance(stages, Stage) else list(several("stages", stages, Stage))
    check_same_stages(todo, history.settings.stages)
    state = history.state.copy()
    loads = state.loads
    check_continues(history.assembly, state, loads, options=None)
    recorder = Recorder(history.assembly, loads, state, todo, history.settings, history.store)
    recorder.take_up(history)
    ended = RunStatus(history.status) if history.position is None else None
    # a history may be taken up once more: where it stands stays as it is
    return StageRun(recorder, copy.deepcopy(history.position), ended)
