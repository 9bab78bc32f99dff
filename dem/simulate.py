"""The public entry to time stepping: stages one after the other, a history, checkpoints that continue exactly."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from dem.detection import near_margin, redetect, travel_per_step
from dem.history import COLUMNS, History
from dem.joints import JointOptions
from dem.loading import SERVO_EVERY, BaseMotion, Drive, Ramp, Servo, Settle, Stage, Tilt, servo_holds, stage_length
from dem.stability import block_stiffness
from dem.state import DYNAMIC, QUASI_STATIC, State, UnstableError, make_state
from dem.stepping import Damping, Scale, displacement_since, run, unbalance
from limitmason.model import Assembly, Loads

Array = NDArray[np.float64]

_SETTLING = Damping(local=0.8)
_LOADING = Damping(local=0.5)
_FREE = Damping()


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
    dt: float | None = None,
    damping: Damping | None = None,
    sample: int = 200,
    progress: Callable[[Mapping[str, Any]], object] | None = None,
    start: History | State | None = None,
    factors: Sequence[float] | None = None,
    detect_every: int | None = None,
) -> History:
    """Follow an assembly through stages of loading.

    Parameters
    ----------
    stages : ``Settle``, ``Ramp``, ``Tilt``, ``Drive``, ``BaseMotion``, ``Hold``
    loads : dead and live loads; self weight alone by default. Blocks' weights are part of the dead loads
    mode : "quasi-static" (scaled masses, local damping), the default, or "dynamic" (real masses, no damping but the
        joints')
    contact_points, contact_model, joint_options : see :func:`dem.make_state`; give ``JointOptions(dashpot=...)`` for
        stiffness-proportional damping, which leaves free flight alone
    dt : time step [s]; None takes the stable one
    damping : of every stage without its own; local 0.8 to settle and 0.5 to load (quasi-static), none (dynamic)
    sample : steps between samples, and between two calls of ``progress``
    progress : called with the last sample as a mapping; return True to stop ("interrupted")
    start : a history, or a state, to continue from; ``loads`` must be the same. Mode, contact points, joint options and
        time step are those of the state: others are refused
    factors : of the load cases at the start, ``history.factors`` of the run that wrote the state; taken over from a
        history, dead loads alone for a state
    detect_every : most steps between searches for new contacts (large displacement); fewer where blocks move fast.
        None keeps the first contacts: right up to collapse, wrong after

    Returns
    -------
    History
        Also when interrupted by the keyboard or by ``progress``: everything up to then is kept.

    Raises
    ------
    UnstableError
        When the state is no longer finite or energy appears from nowhere; ``error.history`` holds what was recorded.
    ValueError
        For stages that the mode does not allow, settings that a state to start from has already, and what
        :func:`dem.make_state` refuses.
    """
    todo = [stages] if isinstance(stages, Stage) else list(stages)
    loads = loads if loads is not None else Loads.weight(assembly)
    if isinstance(start, History):
        state, factors = start.state.copy(), factors or start.factors
    elif isinstance(start, State):
        state = start.copy()
    else:
        state = make_state(
            assembly, loads, contact_points=contact_points or POINTS, contact_model=contact_model or "grid",
            joint_options=joint_options, mode=mode or QUASI_STATIC, dt=dt,
        )  # fmt: skip
    if start is not None:
        given = {"contact_points": contact_points, "contact_model": contact_model, "joint_options": joint_options}
        given["mode"] = None if mode == state.mode else mode
        given["dt"] = None if dt == state.dt else dt
        for name, value in given.items():
            if value is not None:
                raise ValueError(f"{name} is that of the state to start from: leave {name}={value!r} out")
    if sample < 1:
        raise ValueError(f"sample must be at least 1 step, got {sample}")
    recorder = _Recorder(assembly, loads, state, todo, factors)
    status = "finished"
    try:
        for number, stage in enumerate(todo):
            outcome = _run_stage(assembly, state, stage, number, recorder, damping, sample, progress, detect_every)
            if outcome == "interrupted":
                status = outcome
                break
            if outcome != "finished":
                status = outcome
    except KeyboardInterrupt:
        status = "interrupted"
    except UnstableError as error:
        error.history = recorder.history("unstable")
        raise
    return recorder.history(status)


def _run_stage(
    assembly: Assembly,
    state: State,
    stage: Stage,
    number: int,
    rec: "_Recorder",
    damping: Damping | None,
    sample: int,
    progress: Callable[[Mapping[str, Any]], object] | None,
    detect_every: int | None,
) -> str:
    """One stage in chunks of ``sample`` steps; the last may be shorter."""
    dynamic = state.mode == DYNAMIC
    brake = (
        stage.damping
        or damping
        or (_SETTLING if isinstance(stage, Settle) and not dynamic else _FREE if dynamic else _LOADING)
    )
    settle = isinstance(stage, Settle)
    steps, duration = (stage.max_steps, None) if settle else stage_length(stage)
    begun = state.time

    def remaining() -> int:
        # new contacts may shorten the step, so a duration is counted in time
        if steps is not None:
            return steps - done
        return int(np.ceil((duration - (state.time - begun)) / state.dt - 1e-9))

    done = 0
    drives, held = rec.drives, state.bodies.held.copy()
    if isinstance(stage, BaseMotion):
        if not dynamic:
            raise ValueError("BaseMotion needs mode='dynamic': scaled masses have no inertia to speak of")
        d = np.asarray(stage.direction, dtype=float)
        drives = np.zeros((1, assembly.n_blocks, 6))
        drives[0, :, :3] = assembly.held[:, :3] * (d / np.linalg.norm(d))
    elif isinstance(stage, Drive):
        travel, hold = stage.twists(assembly)
        drives = travel[None] / (duration if steps is None else steps * state.dt)
        state.bodies.held[hold] = True
    servos = [_Jack(assembly, state, block, servo) for block, servo in stage.servo.items()]
    if servos:
        state.bodies.held[servo_holds(stage, assembly)] = True
        jacks = np.zeros((len(servos), assembly.n_blocks, 6))
        for row, servo in zip(jacks, servos, strict=True):
            row[servo.block, 2] = -1.0
        drives = np.concatenate([drives, jacks])
    shift, quat = state.bodies.shift.copy(), state.bodies.quat.copy()
    factors0, target = rec.factors.copy(), rec.target(stage)
    quiet, outcome = 0, "finished" if not settle else "not settled"
    while (left := remaining()) > 0:
        count = min(sample - done % sample, left)
        if detect_every:
            count = min(count, rec.steps_to_detection(state, detect_every))
        if servos:
            count = min(count, SERVO_EVERY)
        ahead = np.arange(1, count + 1)
        elapsed = state.time - begun
        part = (done + ahead) / steps if steps is not None else np.minimum((elapsed + ahead * state.dt) / duration, 1.0)
        table = rec.table(factors0, target, part, stage)
        if isinstance(stage, BaseMotion):
            speeds = stage.velocity(elapsed + (ahead - 0.5) * state.dt)[:, None]
        else:
            speeds = np.ones((count, len(drives) - len(servos)))
        if servos:
            descent = np.array([servo.velocity(state, count) for servo in servos])
            speeds = np.concatenate([speeds, np.tile(descent, (count, 1))], axis=1)
        run(state, rec.cases, table, brake, drives, speeds)
        rec.factors = table[-1].copy()
        done += count
        if detect_every:
            rec.maybe_detect(state, count, detect_every)
        if done % sample and remaining() > 0:
            continue
        sampled = rec.add(state, number)
        if progress is not None and progress(sampled):
            outcome = "interrupted"
            break
        if settle:
            off = max((abs(servo.lacking(state)) for servo in servos), default=0.0)
            worst = max(sampled["unbalanced force"], sampled["unbalanced moment"], off / rec.scale.force)
            quiet = quiet + 1 if worst < stage.tolerance else 0
            if quiet >= 4:
                outcome = "finished"
                break
        if stage.stop_when_moved is not None:
            moved = displacement_since(state, shift, quat, rec.scale)
            if moved > stage.stop_when_moved:
                break
    if isinstance(stage, Drive) and stage.keep:
        held |= stage.twists(assembly)[1]
    state.bodies.held[:] = held
    return outcome


class _Jack:
    """A servo at work: block, wanted push [N], gain over the vertical stiffness of the block's joints [m/N]."""

    def __init__(self, assembly: Assembly, state: State, block: int | str, servo: Servo) -> None:
        self.block, self.force, self.gain = assembly.block_index(block), servo.force, servo.gain
        stiffness = block_stiffness(state.points, state.joints, assembly.n_blocks)[self.block, 2, 2]
        if not stiffness > 0.0:
            raise ValueError(f"servo on block {block!r}: no joint of it carries a vertical force")
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


class _Recorder:
    """Load cases with their present factors, and the samples taken so far."""

    def __init__(
        self,
        assembly: Assembly,
        loads: Loads,
        state: State,
        stages: Sequence[Stage],
        factors: Sequence[float] | None,
    ) -> None:
        n = assembly.n_blocks
        self.assembly, self.state, self.stages = assembly, state, stages
        weight = np.zeros((n, 6))
        weight[:, 2] = -assembly.weights
        weight[assembly.fixed] = 0.0
        # loads on wholly held blocks go straight to the support and do not count
        dead, live = loads.dead.copy(), loads.live.copy()
        dead[assembly.fixed] = live[assembly.fixed] = 0.0
        # the part of the dead load that is weight turns with a tilting table, the rest stays
        own = np.where(np.abs(dead[:, 2] - weight[:, 2]) <= np.abs(dead[:, 2]), 1.0, 0.0)[:, None] * weight
        east, north = np.zeros((n, 6)), np.zeros((n, 6))
        east[:, 0], north[:, 1] = -own[:, 2], -own[:, 2]
        self.cases = np.stack([dead - own, own, live, east, north])
        self.factors = np.array((1.0, 1.0, 0.0, 0.0, 0.0) if factors is None else factors, dtype=float)
        self.multiplier, self.tilt = 0.0, 0.0
        self.scale = Scale.of(assembly, dead if dead.any() else live)
        self.drives = np.zeros((0, n, 6))
        driven = [assembly.block_index(b) for s in stages if isinstance(s, Drive) for b in s.displacement]
        driven += [assembly.block_index(b) for s in stages for b in s.servo]
        # an earlier run may have left blocks held by a Drive
        held = (assembly.held | state.bodies.held).any(axis=1)
        self.blocks = np.array(sorted({*np.flatnonzero(held).tolist(), *driven}), dtype=np.intp)
        self.rows: list[list[float]] = []
        self.reaction: list[Array] = []
        self.shift: list[Array] = []
        self.quaternion: list[Array] = []
        self.opening: list[Array] = []
        self.margin, self.since, self.travelled = near_margin(assembly), 0, 0.0
        self.first_energy: float | None = None
        self.notes: list[str] = list(state.warnings)

    def target(self, stage: Stage) -> float:
        """Multiplier or tilt angle at the end of the stage."""
        if isinstance(stage, Ramp):
            return stage.to
        if isinstance(stage, Tilt):
            return float(np.deg2rad(stage.to_deg))
        return 0.0

    def table(self, start: Array, target: float, part: Array, stage: Stage) -> Array:
        """Factors of the cases at the given parts of a stage, shape (steps, 5)."""
        out = np.tile(start, (len(part), 1))
        if isinstance(stage, Ramp):
            out[:, 2] = start[2] + part * (target - start[2])
        elif isinstance(stage, Tilt):
            axis = np.asarray(stage.axis, dtype=float)
            if not np.linalg.norm(axis) > 0 or abs(axis[2]) > 1e-9 * np.linalg.norm(axis):
                raise ValueError(f"tilting axis {stage.axis} is not horizontal")
            d = np.cross(axis / np.linalg.norm(axis), (0.0, 0.0, 1.0))
            first = float(np.arctan2(start[3] * d[0] + start[4] * d[1], start[1]))
            angle = first + part * (target - first)
            out[:, 1], out[:, 3], out[:, 4] = np.cos(angle), np.sin(angle) * d[0], np.sin(angle) * d[1]
        return out

    def steps_to_detection(self, state: State, every: int) -> int:
        """Steps until contacts must be searched: no corner may travel more than half the margin in between."""
        left = 0.5 * self.margin - self.travelled
        step = travel_per_step(self.assembly, state)
        return max(1, min(every - self.since, int(left / step) if step > 0 else every))

    def maybe_detect(self, state: State, steps: int, every: int) -> None:
        """Search for contacts when it is time to."""
        self.since += steps
        self.travelled += steps * travel_per_step(self.assembly, state)
        if self.since >= every or self.travelled > 0.45 * self.margin:
            self.notes += redetect(self.assembly, state, margin=self.margin)
            self.since, self.travelled = 0, 0.0

    def add(self, state: State, stage: int) -> dict[str, float]:
        """Record a sample; refuse a state in which energy appears from nowhere."""
        now = state.measured(self.assembly)
        e = state.total
        force, moment = unbalance(state, self.scale)
        opening = np.full(len(self.assembly.interfaces), np.nan)
        owner = state.interface[now.owner]
        kept = owner >= 0
        largest = np.full(len(opening), -np.inf)
        np.maximum.at(largest, owner[kept], now.opening[kept])
        opening = np.where(np.isfinite(largest), largest, np.nan)
        tilt = float(np.arctan2(np.hypot(self.factors[3], self.factors[4]), self.factors[1]))
        row = {
            "time": state.time,
            "step": float(e[kernels.E_STEPS]),
            "stage": float(stage),
            "multiplier": float(self.factors[2]),
            "tilt": tilt,
            "unbalanced force": force,
            "unbalanced moment": moment,
            "kinetic": float(e[kernels.E_KINETIC]),
            "elastic": now.elastic_energy,
            "friction": float(e[kernels.E_FRICTION]),
            "fracture": float(e[kernels.E_FRACTURE]),
            "viscous": float(e[kernels.E_VISCOUS]),
            "damping": float(e[kernels.E_DAMPING]),
            "applied": float(e[kernels.E_APPLIED]),
            "support": float(e[kernels.E_SUPPORT]),
            "largest opening": float(now.opening.max(initial=0.0)),
            "largest slip": float(np.linalg.norm(now.slip, axis=1).max(initial=0.0)),
        }
        self.rows.append([row[c] for c in COLUMNS])
        # what the support adds so that the held degrees of freedom follow their prescribed motion
        self.reaction.append(np.where(state.bodies.held, -state.bodies.net, 0.0)[self.blocks])
        self.shift.append(state.bodies.shift.copy())
        self.quaternion.append(state.bodies.quat.copy())
        self.opening.append(opening)
        created = row["kinetic"] + row["elastic"] + row["friction"] + row["fracture"] + row["viscous"]
        created += row["damping"] - row["applied"] - row["support"]
        if self.first_energy is None:
            self.first_energy = created
        size = max(row["elastic"], abs(row["applied"]) + abs(row["support"]), 1e-300)
        if row["kinetic"] > 10.0 * size and created - self.first_energy > 10.0 * size:
            raise UnstableError(
                f"energy explodes at step {row['step']:.0f}: kinetic {row['kinetic']:.3g} J against {size:.3g} J done "
                "by the loads; the time step is too long for the stiffness of the joints"
            )
        return row

    def history(self, status: str) -> History:
        """Everything recorded so far."""
        table = np.array(self.rows).reshape(len(self.rows), len(COLUMNS))
        n, k = self.assembly.n_blocks, len(self.assembly.interfaces)
        return History(
            self.assembly, status, {c: table[:, i].copy() for i, c in enumerate(COLUMNS)},
            np.array(self.reaction).reshape(-1, len(self.blocks), 6), self.blocks,
            np.array(self.shift).reshape(-1, n, 3), np.array(self.quaternion).reshape(-1, n, 4),
            np.array(self.opening).reshape(-1, k), self.state,
            tuple(s.name or type(s).__name__ for s in self.stages), tuple(dict.fromkeys(self.notes)),
            tuple(self.factors.tolist()),
        )  # fmt: skip
