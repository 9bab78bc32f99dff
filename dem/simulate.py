"""The public entry to time stepping: stages one after the other, a history, checkpoints that continue exactly."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.history import History
from dem.joints import JointOptions
from dem.loading import SERVO_EVERY, check_base_motions, prescribed, servo_holds, stage_length
from dem.recording import Recorder, Watch
from dem.resuming import (
    Interrupt,
    Position,
    RunStatus,
    check_continues,
    check_same_stages,
    interrupts_wait,
    spelled,
)
from dem.stability import block_stiffness
from dem.state import DYNAMIC, QUASI_STATIC, State, UnstableError, make_state
from dem.stepping import displacement_since, restless, run
from limitmason.deformable import SOLID
from limitmason.deformable.levels import RIGID
from limitmason.display.progress import reached, task, watched
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.stages import COAST, BaseMotion, Damping, Drive, Servo, Settle, Stage

Array = NDArray[np.float64]
Progress = Callable[[Mapping[str, Any]], object]

_SETTLING = Damping(local=0.8)
_LOADING = Damping(local=0.5)
_FREE = Damping()


CALM_EVERY = 25
"""Steps after which a drive that waits for calm looks whether there is."""

PATIENCE = 3000
"""Steps in a row for which it stands still at most: what falls for good is never at rest."""

POINTS = (4, 8)
"""Contact points along and across a joint, where none are given."""


def simulate(
    assembly: Assembly,
    stages: Stage | Sequence[Stage],
    *,
    loads: Loads | None = None,
    mode: str | None = None,
    contact_points: tuple[int, int] | Mapping[str, tuple[int, int]] | None = None,
    contact_model: str | None = None,
    joint_options: JointOptions | None = None,
    blocks: str | None = None,
    stress: str | None = None,
    dt: float | None = None,
    damping: Damping | None = None,
    sample: int = 200,
    progress: Progress | None = None,
    start: History | State | None = None,
    factors: Sequence[float] | None = None,
    detect_every: int | None = 50,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 20,
) -> History:
    """Follow an assembly through stages of loading.

    Parameters
    ----------
    stages : ``Settle``, ``Ramp``, ``Tilt``, ``Drive``, ``BaseMotion``, ``Hold``
    loads : dead and live loads; self weight alone by default, those of ``start`` where there is one. Blocks' weights
        are part of the dead loads
    mode : "quasi-static" (scaled masses, local damping; the default) or "dynamic" (real masses, no damping but the
        joints')
    contact_points, contact_model, joint_options, dt : see :func:`dem.make_state`, (4, 8) and "grid" by default; give
        ``JointOptions(dashpot=...)`` for stiffness-proportional damping, which leaves free flight alone
    blocks, stress : "rigid" blocks, or "modal" ones that strain and bend, in space ("solid"), "plane stress" or "plane
        strain"; see :func:`dem.make_state`, "rigid" and "solid" by default. ``history.state.stresses`` are the stresses
    damping : of every stage without its own; local 0.8 to settle and 0.5 to load (quasi-static), none (dynamic)
    sample : steps between samples, and between two calls of ``progress``
    progress : called with the last sample as a mapping; return True to stop ("interrupted")
    start : a history, or a state, to continue from, with its own mode, laws, points and loads; one that differs from
        them is refused by name. What was cut off in the middle of a stage goes on with :func:`resume`
    factors : of the load cases at the start; those of ``start``, or dead loads alone
    detect_every : most steps between searches for new contacts, fewer where blocks move fast. They begin where a corner
        has moved by 2.5 % of the smallest block dimension against the held blocks, and a warning says so: up to there
        the first contacts are all there are. None keeps those for ever: wrong where blocks leave them or meet others
    checkpoint : file to which the history so far is written every ``checkpoint_every`` samples; ``History.load`` and
        :func:`resume` go on from it to the same bits, also when the process was killed

    Returns
    -------
    History
        Also when interrupted by the keyboard or by ``progress``: everything up to then is kept.

    Raises
    ------
    UnstableError
        When the state is no longer finite or energy appears from nowhere; ``error.history`` holds what was recorded.
    InputError
        For stages that the mode does not allow, what does not fit ``start``, and what :func:`dem.make_state` refuses.
    """
    todo = [stages] if isinstance(stages, Stage) else list(stages)
    notes = check_base_motions(todo)
    if sample < 1 or checkpoint_every < 1 or (detect_every is not None and detect_every < 1):
        raise InputError(
            f"sample, checkpoint_every and detect_every must be at least 1, got {sample}, {checkpoint_every} and "
            f"{detect_every}"
        )
    if start is None:
        loads = loads if loads is not None else Loads.weight(assembly)
        state = make_state(
            assembly, loads, contact_points=contact_points or (4, 8), contact_model=contact_model or "grid",
            joint_options=joint_options, mode=mode or QUASI_STATIC, dt=dt, blocks=blocks or RIGID,
            stress=stress or SOLID, driven=prescribed(assembly, todo),
        )  # fmt: skip
    else:
        state = (start.state if isinstance(start, History) else start).copy()
        loads = loads if loads is not None else Loads(state.dead, state.live)
        given_again = {
            "contact_points": contact_points, "contact_model": contact_model, "dt": dt, "blocks": blocks,
            "stress": stress,
        }  # fmt: skip
        for name, value in given_again.items():
            if value is not None:
                raise InputError(f"{name} is part of the state to start from: leave it out, or make a new state")
        if mode is not None and mode != state.mode:
            raise InputError(f"the state to start from is {state.mode}, not {mode}")
        check_continues(assembly, state, loads, joint_options)
    if factors is not None:
        given = np.array(factors, dtype=float)
        if given.shape != state.factors.shape:
            raise InputError(f"factors must be {len(state.factors)} numbers, got {factors!r}")
        state.factors = given
    state.dead, state.live = loads.dead.copy(), loads.live.copy()
    recorder = Recorder(assembly, loads, state, todo, detect_every)
    recorder.notes += notes
    recorder.settings = (sample, damping, tuple(spelled(s) for s in todo))
    recorder.same = start.same if isinstance(start, History) else {}
    return _follow(
        recorder, None, progress=progress, checkpoint=checkpoint, checkpoint_every=checkpoint_every
    )


def resume(
    history: History,
    stages: Stage | Sequence[Stage],
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 20,
) -> History:
    """Go on with a run that was interrupted, or killed after a checkpoint, in the middle of its stages.

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
    todo = [stages] if isinstance(stages, Stage) else list(stages)
    at = history.position
    if at is None:
        raise InputError(f"the run is over ({history.status}): give simulate(start=history) further stages")
    sample, damping, before = history.settings[:3]
    check_same_stages(todo, before)
    state = history.state.copy()
    loads = Loads(state.dead, state.live)
    check_continues(history.assembly, state, loads, None)
    recorder = Recorder(history.assembly, loads, state, todo, history.settings[3])
    recorder.settings = (sample, damping, before)
    recorder.take_up(history)
    return _follow(
        recorder, at, progress=progress, checkpoint=checkpoint, checkpoint_every=checkpoint_every
    )


@watched("time stepping")
def _follow(
    rec: Recorder,
    at: Position | None,
    *,
    progress: Progress | None,
    checkpoint: str | Path | None,
    checkpoint_every: int,
) -> History:
    """Run the stages from a position, or from the first."""
    status = RunStatus.FINISHED if at is None else rec.status

    def write() -> None:
        if checkpoint is not None and len(rec.rows) % checkpoint_every == 0:
            rec.status = status
            rec.history(RunStatus.INTERRUPTED).save(checkpoint)

    try:
        with interrupts_wait() as interrupt:
            if at is None:
                rec.start()
            for number in range(0 if at is None else at.stage, len(rec.stages)):
                rec.status = status
                reached(number / len(rec.stages), _stage_name(rec, number), share=1.0 / len(rec.stages))
                with task("stage"):
                    outcome = _run_stage(rec, number, at, progress, write, interrupt)
                at = None
                if outcome == RunStatus.INTERRUPTED:
                    return rec.history(outcome)
                if outcome != RunStatus.FINISHED:
                    status = outcome
    except KeyboardInterrupt:
        return rec.history(RunStatus.INTERRUPTED)
    except UnstableError as error:
        rec.position = None
        error.history = rec.history(RunStatus.UNSTABLE)
        raise
    rec.position = None
    return rec.history(status)


def _stage_name(rec: Recorder, number: int) -> str:
    return f"{type(rec.stages[number]).__name__.lower()}, stage {number + 1} of {len(rec.stages)}"


def _run_stage(
    rec: Recorder,
    number: int,
    at: Position | None,
    progress: Progress | None,
    write: Callable[[], None],
    interrupt: Interrupt,
) -> RunStatus:
    """One stage in chunks of ``sample`` steps; the last may be shorter."""
    assembly, state, stage = rec.assembly, rec.state, rec.stages[number]
    sample, damping, _ = rec.settings
    dynamic = state.mode == DYNAMIC
    brake = (
        stage.damping
        or damping
        or (_SETTLING if isinstance(stage, Settle) and not dynamic else _FREE if dynamic else _LOADING)
    )
    settle = isinstance(stage, Settle)
    steps, duration = (stage.max_steps, None) if settle else stage_length(stage)
    servos = [_Jack(assembly, state, block, servo) for block, servo in stage.servo.items()]
    if at is None:
        at = Position(
            number, 0, state.time, state.dt, rec.factors.copy(), state.bodies.shift.copy(), state.bodies.quat.copy(),
            state.bodies.held.copy(), 0, RunStatus.NOT_SETTLED if settle else RunStatus.FINISHED,
            np.zeros((len(servos), 2)), np.zeros(4), np.zeros(len(rec.begun)),
        )  # fmt: skip
    else:
        for servo, kept in zip(servos, at.servo, strict=True):
            servo.give, servo.sum = float(kept[0]), float(kept[1])
        w = at.watch
        rec.watch = Watch(int(w[0]), float(w[1]), int(w[2]), bool(w[3]))

    def remaining() -> int:
        # new contacts may shorten the step, so a duration is counted in time
        if steps is not None:
            return steps - at.done
        return int(np.ceil((duration - (state.time - at.begun)) / state.dt - 1e-9))

    drives, own = rec.drives, 0
    if state.ground.any():
        coasting = np.zeros((1, assembly.n_blocks, 6))
        coasting[0, :, :3] = assembly.held[:, :3] * state.ground
        drives, own = np.concatenate([drives, coasting]), 1
    if isinstance(stage, BaseMotion):
        if not dynamic:
            raise InputError("BaseMotion needs mode='dynamic': scaled masses have no inertia to speak of")
        shaken = np.zeros((1, assembly.n_blocks, 6))
        shaken[0, :, :3] = assembly.held[:, :3] * stage.unit
        drives = np.concatenate([drives, shaken])
    elif isinstance(stage, Drive):
        travel, hold = stage.twists(assembly)
        drives = np.concatenate([drives, travel[None] / (duration if steps is None else steps * at.dt)])
        state.bodies.held[hold] = True
    if servos:
        state.bodies.held[servo_holds(stage, assembly)] = True
        jacks = np.zeros((len(servos), assembly.n_blocks, 6))
        for row, servo in zip(jacks, servos, strict=True):
            row[servo.block, 2] = -1.0
        drives = np.concatenate([drives, jacks])
    target = rec.target(stage)
    calm = stage.calm if isinstance(stage, Drive) else None
    if calm is not None and (dynamic or steps is None):
        raise InputError("a Drive that waits for calm is for quasi-static runs, its length in steps")

    def keep() -> None:
        # where the run stands, for a checkpoint and for who takes up the history of an interrupted one
        at.servo = np.array([(servo.give, servo.sum) for servo in servos]).reshape(-1, 2)
        w = rec.watch
        at.watch = np.array([w.since, w.travelled, w.due, w.searching], dtype=float)
        at.energy = np.array(list(rec.begun.values()))
        rec.position = at

    keep()
    while (left := remaining()) > 0:
        count = min(sample - at.done % sample, left, rec.steps_to_look())
        if servos:
            count = min(count, SERVO_EVERY)
        if duration is not None:
            # the stage ends at a whole step: what it prescribes is neither stretched nor overshot
            rest = duration - (state.time - at.begun)
            if abs(left * state.dt - rest) > 1e-9 * rest:
                state.dt = rest / left
        waits = False
        if calm is not None:
            count = min(count, CALM_EVERY)
            waits = at.waited < PATIENCE and restless(state, calm)
        ahead = np.arange(count + 1)
        elapsed = state.time - at.begun
        part = (
            (at.done + ahead) / steps if steps is not None else np.minimum((elapsed + ahead * state.dt) / duration, 1.0)
        )
        table = rec.table(at.factors, target, part, stage)
        # what acts where the blocks are at the beginning of a step are the loads of that time; scaled masses have none
        acting = table[:-1] if dynamic else table[1:]
        speeds = np.ones((count, len(drives) - len(servos)))
        if isinstance(stage, BaseMotion):
            speeds[:, own] = stage.velocity(elapsed + (ahead[1:] - 0.5) * state.dt)
        elif isinstance(stage, Drive) and steps is not None:
            # new contacts may have shortened the step since the stage began
            speeds[:, own] = 0.0 if waits else at.dt / state.dt
        if servos:
            descent = np.array([servo.velocity(state, count) for servo in servos])
            speeds = np.concatenate([speeds, np.tile(descent, (count, 1))], axis=1)
        # what waits for rest has no steady motion to be let through
        run(state, rec.cases, acting, replace(brake, combined=False) if waits else brake, drives, speeds)
        state.factors = table[-1].copy()
        if waits:
            at.waited += count
            rec.look(count)
            keep()
            if interrupt.asked:
                return RunStatus.INTERRUPTED
            continue
        # who has run out of patience moves every other time
        at.waited = at.waited - count if at.waited >= PATIENCE else 0
        at.done += count
        rec.look(count)
        keep()
        if at.done % sample and remaining() > 0:
            if interrupt.asked:
                return RunStatus.INTERRUPTED
            continue
        sampled = rec.add(state, number)
        reached(None if settle else at.done / (at.done + max(remaining(), 0)))
        over = False
        if settle:
            off = max((abs(servo.lacking(state)) for servo in servos), default=0.0)
            worst = max(sampled["unbalanced force"], sampled["unbalanced moment"], off / rec.scale.force)
            at.quiet = at.quiet + 1 if worst < stage.tolerance else 0
            over = at.quiet >= 4
            at.outcome = RunStatus.FINISHED if over else at.outcome
        if stage.stop_when_moved is not None:
            over = over or displacement_since(state, at.shift, at.quat, rec.scale) > stage.stop_when_moved
        if not over and remaining() > 0:
            write()
        if (progress is not None and progress(sampled)) or interrupt.asked:
            return RunStatus.INTERRUPTED
        if over:
            break
    if duration is not None and np.isclose(state.dt * np.ceil(duration / at.dt - 1e-9), duration, rtol=1e-9):
        state.dt = at.dt  # unless new contacts have shortened it
    held = at.held.copy()
    if isinstance(stage, Drive) and stage.keep:
        held |= stage.twists(assembly)[1]
    state.bodies.held[:] = held
    if isinstance(stage, BaseMotion) and stage.after == COAST:
        state.ground = state.ground + stage.left_over()[0] * stage.unit
    return at.outcome


class _Jack:
    """A servo at work: block, wanted push [N], gain over the vertical stiffness of the block's joints [m/N]."""

    def __init__(self, assembly: Assembly, state: State, block: int | str, servo: Servo) -> None:
        self.block, self.force, self.gain = assembly.block_index(block), servo.force, servo.gain
        stiffness = block_stiffness(state.points, state.joints, assembly.n_blocks, ties=state.ties)[self.block, 2, 2]
        if not stiffness > 0.0:
            raise InputError(f"servo on block {block!r}: no joint of it carries a vertical force")
        self.give, self.sum = servo.gain / stiffness, 0.0

    def lacking(self, state: State) -> float:
        """Force wanted less the push in the last step [N]."""
        return float(self.force - state.bodies.net[self.block, 2])

    def velocity(self, state: State, steps: int) -> float:
        """Downward velocity for the next steps [m/s]."""
        off = self.lacking(state)
        # out of contact there is nothing to learn a speed from
        self.sum = self.sum + steps * off if off < self.force else 0.0
        return self.give * (off + 0.25 * self.gain * self.sum) / state.dt
