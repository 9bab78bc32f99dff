"""Blocks on their way through stages: steps in chunks, from sample to sample."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dem.contact.near import ground_shift
from dem.default_damping import FREE, RAMPING, SETTLING
from dem.model.advance import run
from dem.model.stable_step import block_stiffness
from dem.model.state import DYNAMIC, State, UnstableError
from dem.model.unbalance import displacement_since, restless
from dem.stages.load_factors import load_factors
from dem.stages.recording import Recorder
from dem.stages.resuming import Position, RunStatus
from dem.stages.stage_checks import SERVO_EVERY, servo_holds, stage_length
from limitmason.arrays import Array, Flags
from limitmason.errors import InputError
from limitmason.model import Assembly
from limitmason.model.base_motion import COAST, BaseMotion
from limitmason.model.stages import Drive, Servo, Settle, Stage

CALM_EVERY = 25
"""Steps after which a drive that waits for calm looks whether there is."""

PATIENCE = 3000
"""Steps in a row for which it stands still at most: what falls for good is never at rest."""

_QUIET = 4  # checks in a row in which a Settle must find forces and moments small: one alone may hit a swing's middle
_WHOLE = 1e-9  # of a step or a duration: what is nearer to a whole number of steps is one, but for rounding [-]
_SUMMED = 0.25  # weight of what a jack's push has lacked so far against what it lacks now, times the gain [-]


class StageRun:
    """A run of rigid or strained blocks, see :class:`dem.stages.run.Run`.

    Parameters
    ----------
    rec : with the stages, and the samples of a run that is taken up
    at : where it stood; None for one that begins
    ended : how it has ended already; None for one that goes on

    Attributes
    ----------
    stage : in which it stands
    at : where in that stage, with what counts from its beginning
    sample : steps between samples, or time between them [s]
    steps, duration : length of the stage: in steps, or None and then [s]
    brake : damping of the stage
    drives : twists that are prescribed, per unit of their factors, shape (d, n, 6)
    own : row of ``drives`` from which on they are the stage's own, and not of ground that coasts
    servos : jacks of the stage, whose twists are the last rows of ``drives``
    calm : kinetic over elastic energy above which a drive stands still [-], None where it never does
    pause : whether the stage is over and the next one not yet open
    """

    def __init__(self, rec: Recorder, at: Position | None, ended: RunStatus | None = None) -> None:
        self.rec, self.begun = rec, at
        self.status = ended or (RunStatus.FINISHED if at is None else rec.status)
        self.over = ended is not None
        self.pause = False

    @property
    def samples(self) -> int:
        """Samples so far."""
        return len(self.rec.samples)

    @property
    def where(self) -> tuple[float | None, str]:
        """Part of the stages that is done, and where the run stands in words.

        The part is None in a stage that ends when it likes.
        """
        words = f"{type(self.stage).__name__.lower()}, stage {self.at.stage + 1} of {len(self.rec.stages)}"
        # of a Settle nobody knows how many steps it takes: it counts as none
        steps = [0.0 if isinstance(s, Settle) else self._steps_of(s) for s in self.rec.stages]
        part_of_stage = self.at.done / max(self.at.done + max(self._remaining(), 0), 1)
        done = sum(steps[: self.at.stage]) + part_of_stage * steps[self.at.stage]
        return None if isinstance(self.stage, Settle) else done / max(sum(steps), 1.0), words

    def _steps_of(self, stage: Stage) -> float:
        """Steps of a stage at the present time step."""
        steps, duration = stage_length(stage)
        return float(steps) if steps is not None else (duration or 0.0) / self.rec.state.dt

    def begin(self) -> None:
        """Stand ready for the first chunk."""
        if self.over:
            return
        if self.begun is None:
            self.rec.start()
        self._open(0 if self.begun is None else self.begun.stage, self.begun)

    def advance(self) -> Mapping[str, Any] | None:
        """Steps to the next sample, or to the next look at contacts, jacks or calm."""
        try:
            return self._advance()
        except UnstableError as error:
            self.rec.position = None  # positions are no longer numbers: nothing can go on from here
            error.history = self.rec.history(RunStatus.UNSTABLE)
            raise

    def _advance(self) -> Mapping[str, Any] | None:
        """Step to the next sample, or while nothing must be looked at; None without one."""
        self._leave()
        if self.over:
            return None
        rec, state, at = self.rec, self.rec.state, self.at
        count, waits = self._chunk()
        number = self._sample_number()
        table, speeds = self._table(count), self._speeds(count, waits)
        # what acts where the blocks are at the beginning of a step are the loads of that time; scaled masses have none
        acting = table[:-1] if state.mode == DYNAMIC else table[1:]
        # what waits for rest has no steady motion to be let through
        brake = replace(self.brake, combined=False) if waits else self.brake
        run(state, rec.cases, acting, brake, self.drives, speeds)
        state.factors = table[-1].copy()
        if waits:
            at.waited += count
        else:
            # who has run out of patience moves every other time: each chunk that moves gives as much patience back
            at.waited = at.waited - count if at.waited >= PATIENCE else 0
            at.done += count
        rec.look(count)
        if state.mode == DYNAMIC and rec.hold_landed(at.held):
            self._prescribe(self.stage)
        if waits or (self._sample_number() == number and self._remaining() > 0):
            return None
        sampled = rec.add(state, at.stage)
        if self._ends(sampled) or self._remaining() <= 0:
            self.pause = at.ended = True
            self.over = at.stage + 1 == len(rec.stages)
        return sampled

    def finish(self) -> None:
        """Leave the last stage."""
        if self.rec.position is not None:
            self._close()
            self.rec.position = None

    def note(self, text: str) -> None:
        """Keep ``text``, what a reader must know of it."""
        self.rec.notes.append(text)

    def save(self, file: str | Path, status: RunStatus = RunStatus.INTERRUPTED) -> None:
        """Write a file from which the run goes on to the same bits, or how it ended."""
        self._leave()  # a stage that is over is no place to go on from: the begin of the next is
        self.rec.status = self.status
        self.rec.history(status).save(file)

    def _leave(self) -> None:
        """Open the next stage with a length where one is over."""
        while self.pause and not self.over:
            self._open(self.at.stage + 1, None)

    def _open(self, number: int, at: Position | None) -> None:
        """Begin a stage, or go on in it where ``at`` says; without length it pauses.

        Damping is the stage's own, else that of the run, else the usual one of its kind.

        Parameters
        ----------
        number : of the stage, from 0
        at : where a run that is resumed stood in it; None begins it
        """
        if number and at is None:
            self._close()
        rec, state, stage = self.rec, self.rec.state, self.rec.stages[number]
        rec.status, self.stage = self.status, stage
        self.sample, damping = rec.settings.sample, rec.settings.damping
        dynamic, settles = state.mode == DYNAMIC, isinstance(stage, Settle)
        # in a quasi-static run masses are scaled, and damping only brings blocks to rest
        usual = FREE if dynamic else SETTLING if settles else RAMPING
        self.brake = stage.damping or damping or usual
        self.steps, duration = (stage.max_steps, None) if isinstance(stage, Settle) else stage_length(stage)
        self.duration = duration or 0.0
        if at is None:
            # what blocks have moved, what is held and the energy count from the beginning of the stage
            at = Position(
                stage=number, done=0, begun=state.time, dt=state.dt, factors=state.factors.copy(),
                shift=state.bodies.shift.copy(), quat=state.bodies.quat.copy(), held=state.bodies.held.copy(), quiet=0,
                outcome=RunStatus.NOT_SETTLED if settles else RunStatus.FINISHED,
                servo=np.zeros((len(stage.servo), 2)), watch=rec.watch, energy=np.array(list(rec.begun.values())),
            )
        self.servos = [
            _Jack(rec.assembly, state, block, servo, row)
            for (block, servo), row in zip(stage.servo.items(), at.servo, strict=True)
        ]
        self.at = rec.position = at
        rec.watch = at.watch
        self._prescribe(stage)
        self.calm = stage.calm if isinstance(stage, Drive) else None
        if self.calm is not None and (dynamic or self.steps is None):
            raise InputError("a Drive that waits for calm is for quasi-static runs, its length in steps")
        self.pause = at.ended or self._remaining() <= 0
        self.over = self.pause and number + 1 == len(rec.stages)

    def _prescribe(self, stage: Stage) -> None:
        """Lay out what is prescribed in a stage, and hold the freedoms that it moves.

        Twists are per unit of their factor, shape (d, n, 6). They come in the order of :meth:`_speeds`: the ground that
        coasts, a base motion or a drive, and the servos.
        """
        rec, state, at = self.rec, self.rec.state, self.at
        n, held = rec.assembly.n_blocks, rec.assembly.held.copy()
        if state.mode == DYNAMIC:
            held[rec.floor.landed(state)] = True
        drives: list[Array] = []
        if state.ground.any():
            drives.append(_of_ground(held, state.ground))
        self.own = len(drives)  # behind the ground stands what the stage itself prescribes
        if isinstance(stage, BaseMotion):
            if state.mode != DYNAMIC:
                raise InputError("BaseMotion needs mode='dynamic': scaled masses have no inertia to speak of")
            drives += [_of_ground(held, d) for d in stage.units]
        elif isinstance(stage, Drive):
            # a velocity: the whole travel in the length of the stage
            travel, hold = stage.twists(rec.assembly)
            drives.append(travel / (self.duration if self.steps is None else self.steps * at.dt))
            state.bodies.held[hold] = True
        if self.servos:
            state.bodies.held[servo_holds(stage, rec.assembly)] = True
            for servo in self.servos:
                jack = np.zeros((n, 6))
                jack[servo.block, 2] = -1.0  # downwards
                drives.append(jack)
        self.drives = np.stack(drives) if drives else np.zeros((0, n, 6))

    def _close(self) -> None:
        """Let go what the stage has held, and keep how it ended."""
        rec, state, at, stage = self.rec, self.rec.state, self.at, self.stage
        if stage.servo and isinstance(stage, Drive):
            rec.note_pushes(stage, at.stage)
        if isinstance(stage, Settle):
            rec.note_slip(stage, at.done)
            if at.stage:
                rec.note_motion_after_ramp(rec.stages[at.stage - 1], at.shift)
        # the step that was shortened so that whole ones end with the stage; one that new contacts ask for stays
        if self.duration and np.isclose(
            state.dt * np.ceil(self.duration / at.dt - _WHOLE), self.duration, rtol=_WHOLE
        ):
            state.dt = at.dt
        held = at.held.copy()
        if isinstance(stage, Drive) and stage.keep:
            held |= stage.twists(rec.assembly)[1]
        state.bodies.held[:] = held
        # a record that ends with velocity may leave the ground moving
        if isinstance(stage, BaseMotion) and stage.after == COAST:
            state.ground = state.ground + stage.left_over()[0]
        if at.outcome != RunStatus.FINISHED:
            self.status = at.outcome

    def _remaining(self) -> int:
        """Steps left in the stage."""
        # new contacts may shorten the step, so a duration is counted in time
        if self.steps is not None:
            return self.steps - self.at.done
        state = self.rec.state
        return int(np.ceil((self.duration - (state.time - self.at.begun)) / state.dt - _WHOLE))

    def _sample_number(self) -> int:
        """Samples of the stage due by now: one every so many steps, or seconds."""
        if isinstance(self.sample, int):
            return self.at.done // self.sample
        return int((self.rec.state.time - self.at.begun) / self.sample + _WHOLE)

    def _to_sample(self) -> int:
        """Steps to the next sample.

        It lies at a multiple of a number of steps, or at the first step after one of a time.
        """
        if isinstance(self.sample, int):
            return self.sample - self.at.done % self.sample
        ahead = self.at.begun + (self._sample_number() + 1) * self.sample - self.rec.state.time
        return max(1, int(np.ceil(ahead / self.rec.state.dt - _WHOLE)))

    def _chunk(self) -> tuple[int, bool]:
        """Steps of the next chunk, and whether the drive stands still for calm in it.

        A chunk ends with the next sample, the stage, a search for contacts, or where a jack or calm must be looked at.
        """
        rec, state, at, left = self.rec, self.rec.state, self.at, self._remaining()
        count = min(self._to_sample(), left, rec.steps_to_look())
        if self.servos:
            count = min(count, SERVO_EVERY)
        if self.steps is None:
            # the stage ends at a whole step: what it prescribes is neither stretched nor overshot
            rest = self.duration - (state.time - at.begun)
            if abs(left * state.dt - rest) > _WHOLE * rest:
                state.dt = rest / left
        if self.calm is None:
            return count, False
        return min(count, CALM_EVERY), at.waited < PATIENCE and restless(state, self.calm)

    def _table(self, count: int) -> Array:
        """Factors of the load cases at the ends of ``count`` steps, (count + 1, 5)."""
        at, state, ahead = self.at, self.rec.state, np.arange(count + 1)
        if self.steps is not None:
            part = (at.done + ahead) / self.steps
        else:
            part = np.minimum((state.time - at.begun + ahead * state.dt) / self.duration, 1.0)
        return load_factors(at.factors, part, self.stage)

    def _speeds(self, count: int, waits: bool) -> Array:
        """Factors of the prescribed twists in each of the next steps, shape (count, d).

        Parameters
        ----------
        count : steps
        waits : whether the drive stands still until the blocks are calm
        """
        state, at, stage = self.rec.state, self.at, self.stage
        speeds = np.ones((count, len(self.drives) - len(self.servos)))
        if isinstance(stage, BaseMotion):
            # the mean velocity of every step: the ground is where the record has it when the step ends
            times = np.asarray(state.time - at.begun + np.arange(count + 1) * state.dt, dtype=np.float64)
            speeds[:, self.own :] = np.diff(stage.displacement(times), axis=0) / state.dt
        elif isinstance(stage, Drive) and self.steps is not None:
            # new contacts may have shortened the step since the stage began
            speeds[:, self.own] = 0.0 if waits else at.dt / state.dt
        descent = [servo.velocity(state, count) for servo in self.servos]
        return np.concatenate([speeds, np.tile(descent, (count, 1))], axis=1) if descent else speeds

    def _ends(self, sampled: Mapping[str, float]) -> bool:
        """Whether the stage ends before its time: settled, or a block moved too far.

        Parameters
        ----------
        sampled : columns of the sample just recorded
        """
        rec, at, stage = self.rec, self.at, self.stage
        over = False
        if isinstance(stage, Settle):
            # what jacks lack counts too, divided by the mean load of a block
            lack = max((abs(servo.lacking(rec.state)) for servo in self.servos), default=0.0)
            worst = max(sampled["unbalanced force"], sampled["unbalanced moment"], lack / rec.scale.force)
            at.quiet = at.quiet + 1 if worst < stage.tolerance else 0
            over = at.quiet >= _QUIET and at.done >= stage.gently
            at.outcome = RunStatus.FINISHED if over else at.outcome
            over = over or (rec.state.mode != DYNAMIC and rec.fallen(at.shift))
        if stage.stop_when_moved is not None:
            start = at.shift
            # against a ground that moves
            if isinstance(stage, BaseMotion) or rec.state.ground.any():
                start = start + ground_shift(rec.assembly, rec.state.bodies.shift - start)
            over = over or displacement_since(rec.state, start, at.quat, rec.scale) > stage.stop_when_moved
        return over


def _of_ground(held: Flags, velocity: Sequence[float] | Array) -> Array:
    """Twists of blocks that move with the ground, on what is held, shape (n, 6).

    ``velocity`` is that of the ground [m/s].
    """
    out = np.zeros(held.shape)
    out[:, :3] = held[:, :3] * np.asarray(velocity)
    return out


class _Jack:
    """A servo at work.

    It has its block, the push downwards that is wanted [N], and what it has learnt, a row of ``Position.servo``.
    """

    def __init__(self, assembly: Assembly, state: State, block: int | str, servo: Servo, learnt: Array) -> None:
        """Jack on a block, with what it has learnt before.

        Parameters
        ----------
        assembly, state : the blocks, and where they are
        block, servo : on which it stands, and the push that it is to give
        learnt : how far the jack moves per newton that is lacking [m/N], 0 where it begins, and the lack summed over
            the steps so far [N], changed as it learns; shape (2,)
        """
        self.block, self.force, self.gain = assembly.block_index(block), servo.force, servo.gain
        stiffness = block_stiffness(state.points, state.joints, assembly.n_blocks, ties=state.ties)[self.block, 2, 2]
        if not stiffness > 0.0:
            raise InputError(f"servo on block {block!r}: no joint of it carries a vertical force")
        self.learnt = learnt
        if not learnt[0] > 0.0:
            learnt[0] = servo.gain / stiffness  # as the block's own joints give

    def lacking(self, state: State) -> float:
        """Force wanted less the push of the last step of ``state`` [N], both downwards."""
        return float(self.force - state.bodies.net[self.block, 2])

    def velocity(self, state: State, steps: int) -> float:
        """Downward velocity for the next ``steps`` [m/s], by the rule of ``Servo``."""
        lack = self.lacking(state)
        # out of contact all of the force is lacking, and there is nothing to learn a speed from
        self.learnt[1] = self.learnt[1] + steps * lack if lack < self.force else 0.0
        per_newton, lacked = self.learnt.tolist()
        return float(per_newton * (lack + _SUMMED * self.gain * lacked) / state.dt)
