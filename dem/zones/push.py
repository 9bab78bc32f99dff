"""A structure of zoned blocks driven to a displacement at two speeds, as one load-displacement curve."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.driving import SLOWER, named, turning_points, unit_twist
from dem.joints import Grid, JointOptions
from dem.kernels.arrays import LAW_KN, LAW_KS
from dem.kernels.zone_arrays import Z_APPLIED, Z_KINETIC, Z_SUPPORT
from dem.pace import default_steps
from dem.resuming import RunStatus, interrupts_wait, part_file
from dem.state import UnstableError
from dem.stepping import CALM
from dem.zones import running
from dem.zones.marks import joint_marks
from dem.zones.model import make_model, set_loads
from dem.zones.push_curve import ZonedCurve, rigid_motion, zone_state, zoned_curve
from dem.zones.recording import EVERY, Record, load, save, signature
from dem.zones.zoned_model import ZonedModel
from limitmason.deformable import PLANE_STRESS, SOLID
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError, NotConverged
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive

Array = NDArray[np.float64]
Progress = Callable[[Mapping[str, Any]], object]

LEAST_STEPS = 40_000
"""Steps that the faster run takes, at least: a brittle panel that fails at 9 kN carries 14 to 19 in 6000 to 20 000."""

SETTLING = 10
"""Slowest swings in which loads come on and come to rest, about."""

AT_REST = 1e-8
"""Kinetic over elastic energy below which what does not balance is rounding [-]."""

TRIED = 20
"""Steps by which the pace is measured."""

GENTLE = 5
"""Samples over which the drive comes up to its speed."""


@watched("push of zones")
def push_zoned(
    assembly: Assembly,
    drive: Drive,
    *,
    to: float | Sequence[float],
    zone_size: float,
    loads: Loads | None = None,
    plane: str = PLANE_STRESS,
    contact_points: Grid | None = None,
    joint_options: JointOptions | None = None,
    steps: int | None = None,
    rate_check: bool = True,
    samples: int = 250,
    tolerance: float = running.SETTLED,
    longest: float = 3600.0,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    label: str = "",
) -> ZonedCurve:
    """Load-displacement curve of a wall of zoned blocks, own weight settled first.

    Blocks with a material are cut into zones; blocks that are held, driven or carry a servo, and those without a
    material, are rigid. Contacts are those of the reference position, followed along the sides they lie on.

    Parameters
    ----------
    drive : direction, as for :func:`dem.push`; x, z and ry of blocks, in space any. A ``servo`` is a dead force here,
        and holds the turns of its block where it is parallel
    to : displacement at the end [m]; several are a path with turning points
    zone_size : largest edge of a zone [m]
    loads : dead loads; self weight alone by default. Live loads do not act
    plane : "plane stress" or "plane strain", zones that strain, yield and crack; or "solid", elastic zones in space
    contact_points : as for :func:`dem.make_state`, in the plane those across the thickness at one place; by default no
        further apart than the zones' edges, with areas by halves
    joint_options : as for :func:`dem.push`
    steps : of the faster run over the whole path; by default 40 of the slowest swings, and 40 000 at least
    rate_check : run again at a third of the speed; the answer is that run
    samples : per run
    tolerance : of settling, unbalanced force at a node over the mean applied force per node [-]
    longest : predicted run time above which a push is refused [s]; with ``steps`` given, that of settling alone counts
    progress : called with a mapping of "run", "part" of all steps done, "time left" [s], "displacement", "load"; return
        True to stop ("interrupted")
    checkpoint : file beside which the settled model and the runs are kept as they go; the same push with the same file
        goes on where it was cut off, to the same bits, or returns at once what was finished

    Raises
    ------
    InputError
        For a drive out of the plane or without direction, a checkpoint of another push, stiffness contrasts that make
        the run hopeless (with the predicted time), and as
        :func:`dem.zones.model.make_model`.
    NotConverged
        Where the structure does not settle under its dead loads.
    """
    path = turning_points(to)
    if samples < 10 or (steps is not None and steps < 10 * samples):
        raise InputError(f"samples must be at least 10 and steps ten times as many, got {samples!r} and {steps!r}")
    unit, held = unit_twist(drive, assembly)
    if plane != SOLID and unit[:, [1, 3, 5]].any():
        raise InputError(
            f"the drive leaves the x-z plane, in which zoned blocks stay: give x, z or ry, or stress={SOLID!r} "
            "for zones in space"
        )
    loads = loads if loads is not None else Loads.weight(assembly)
    dead = loads.dead.copy()
    for name, servo in drive.servo.items():
        block = assembly.block_index(name)
        dead[block, 2] -= servo.force
        held[block, [3, 4, 5] if plane == SOLID else [4]] |= servo.parallel
    still = Loads(dead, np.zeros_like(dead), loads.name)
    stiff = np.flatnonzero(unit.any(axis=1) | held.any(axis=1)).tolist()
    settled = make_model(
        assembly, still, zone_size=zone_size, plane=plane, contact_points=contact_points, joint_options=joint_options,
        stiff=stiff,
    )  # fmt: skip
    set_loads(settled, dead)
    rows = [int(np.count_nonzero(settled.mesh.rigid[:b])) for b in stiff]
    hold = np.zeros_like(settled.rigid.held)
    hold[rows] = held[stiff][:, settled.axes]
    # a drive that has not begun holds already what it names and does not move, and turns of parallel jacks
    first = hold.copy()
    first[rows] &= unit[stiff][:, settled.axes] == 0.0
    running.drive(settled, np.zeros(hold.shape), first)
    file = part_file(checkpoint, "settled")
    same = signature(settled, plane=plane, drive=first.tolist(), tolerance=tolerance)
    if file is not None and file.exists():
        kept = load(file, settled, same)[1]
        per_step, period = kept["per_step"], kept["period"]
    else:
        per_step, period = _pace(settled), running.slowest_period(settled)
        wanted = steps if steps is not None else _default_steps(period, samples)
        _refuse_hopeless(settled, per_step, period, wanted, 1 + SLOWER * rate_check, longest, steps is not None)
        # under softer joints than most it takes a few of the slowest swings
        try:
            rests = running.settle(settled, tolerance, max(running.MOST_STEPS, int(SETTLING * period)))
        except UnstableError as error:
            raise NotConverged(f"the structure falls under its dead loads before it is driven: {error}") from error
        if not rests:
            raise NotConverged(_unsettled(settled))
        if file is not None:
            save(file, settled, same, None, per_step=per_step, period=period)
    steps = steps if steps is not None else _default_steps(period, samples)
    counts = (steps, SLOWER * steps) if rate_check else (steps,)
    curves = []
    for number, count in enumerate(counts):
        follow = _Follower(progress, number, sum(counts[:number]), sum(counts), per_step)
        name = "v" if number == 0 else f"v{SLOWER}"
        curve = _run(_twin(settled), unit[stiff], rows, hold, path, count, samples, follow, part_file(checkpoint, name))
        curves.append(replace(curve, label=named(drive, label)))
        if curve.status == "interrupted":
            break
    if len(curves) == 1:
        return curves[0]
    both = curves[1].beside(curves[0])
    assert isinstance(both, ZonedCurve)
    return both


def _default_steps(period: float, samples: int) -> int:
    """Steps of the faster run from those of the slowest swing, ten to a sample at least."""
    return max(default_steps(period), LEAST_STEPS, 10 * samples)


def _pace(model: ZonedModel) -> float:
    """Time that a step takes [s], from a few of a copy once they are compiled."""
    tried = _twin(model)
    running.advance(tried, 1)
    clock = time.perf_counter()
    running.advance(tried, TRIED)
    return (time.perf_counter() - clock) / TRIED


def _refuse_hopeless(
    model: ZonedModel, per_step: float, period: float, steps: int, runs: int, longest: float, chosen: bool
) -> None:
    """Refuse a push whose predicted time is beyond the longest, or, where its steps were chosen, its settling.

    Raises
    ------
    InputError
        With the predicted time, the steps and the stiffest and softest springs.
    """
    settling = SETTLING * period
    predicted = per_step * (settling + (0 if chosen else runs * steps))
    if predicted <= longest:
        return
    raise InputError(
        f"the push would take about {predicted / 3600.0:.1f} h: the slowest swing takes {period:.3g} steps of "
        f"{1e6 * per_step:.0f} us, to settle some {SETTLING} of them"
        + ("" if chosen else f", the push {runs * steps} steps")
        + f". Stiffness contrasts make it long: {_contrast(model)}. Take softer units, stiffer joints or larger zones, "
        "or give longest="
    )


def _contrast(model: ZonedModel) -> str:
    """Stiffness of zones and joints in words."""
    zone = max(b.material.young_modulus for b in model.assembly.blocks if b.material is not None) / model.mesh.size
    joint = model.law[:, [LAW_KN, LAW_KS]]
    return f"zones have E / size = {zone:.2g} Pa/m, joints from {joint.min():.2g} to {joint.max():.2g} Pa/m"


def _unsettled(model: ZonedModel) -> str:
    """Why a model did not settle, in words: it moves, or it is at rest but for the rounding of stiff springs."""
    force = f"unbalanced force {running.unbalance(model):.2g} of the mean applied force per node"
    if model.total[Z_KINETIC] < AT_REST * running.read(model).energy:
        return (
            f"the structure rests under its dead loads, but its forces are not in balance ({force}): they are lost in "
            f"the rounding of springs too stiff for them; {_contrast(model)}. Take softer units or joints"
        )
    return f"the structure does not settle under its dead loads ({force}): it falls before it is driven"


def _twin(model: ZonedModel) -> ZonedModel:
    """The same model with arrays of its own."""

    def copied(group: Any) -> Any:
        return type(group)(*(v.copy() for v in group))

    return replace(
        model, nodes=copied(model.nodes), zones=copied(model.zones), contacts=copied(model.contacts),
        rigid=copied(model.rigid), total=model.total.copy(),
    )  # fmt: skip


def _run(
    model: ZonedModel, unit: Array, rows: list[int], hold: NDArray[np.bool_], path: list[float], steps: int,
    samples: int, follow: "_Follower", file: Path | None,
) -> ZonedCurve:  # fmt: skip
    """One drive along the path, from its beginning or from where a file says it stood."""
    twist = np.zeros(hold.shape)
    twist[rows] = unit[:, model.axes] * model.sense
    before = np.where(twist != 0.0, model.rigid.net, 0.0)
    work_before = float(model.total[Z_APPLIED] + model.total[Z_SUPPORT])
    same = signature(
        model, plane=model.plane, drive=(twist.tolist(), hold.tolist()), to=path, steps=steps, samples=samples
    )
    record = load(file, model, same)[0] if file is not None and file.exists() else None
    if record is None:
        record = Record()
        _sample(model, record, 0.0, 0.0, 0.0, 0.0)
    rates = _rates(path, steps, samples)
    chunk, clock, taken = steps // samples, time.perf_counter(), record.seconds
    tail = min(chunk, max(chunk // 4, 20))
    follow.goes_on(chunk * (len(record.moved) - 1))
    record.status = RunStatus.FINISHED
    with interrupts_wait() as interrupt:
        for number in range(len(record.moved) - 1, len(rates)):
            running.drive(model, twist * rates[number], hold)
            calm = record.restless < CALM
            try:
                running.advance(model, chunk - tail, drifts=calm)
                running.advance(model, tail, drifts=calm)
                running.refuse_explosion(model)
            except UnstableError as error:
                # what was there before is a curve
                if number < 1:
                    raise
                record.status, record.ended = RunStatus.UNSTABLE, f"the run ended early: {error}"
                break
            load_now = float(-((model.rigid.total / tail - before) * twist).sum())
            work = abs(float(model.total[Z_APPLIED] + model.total[Z_SUPPORT]))
            done = max(abs(work - work_before), 1e-300)
            at = record.moved[-1] + float(rates[number]) * chunk
            moving = float(model.total[Z_KINETIC]) / done if number >= GENTLE else 0.0
            _sample(model, record, at, load_now, moving, work)
            record.seconds = taken + time.perf_counter() - clock
            stop = follow(chunk * (number + 1), at, load_now) or interrupt.asked
            if file is not None and (stop or number + 1 == len(rates) or (number + 1) % EVERY == 0):
                save(file, model, same, record)
            if stop:
                record.status = RunStatus.INTERRUPTED
                break
    return zoned_curve(model, record, steps, twist)


def _sample(model: ZonedModel, record: Record, at: float, load_now: float, kinetic: float, work: float) -> None:
    """Write down where the model stands; ``work`` is that of loads and supports so far, 0 before the drive."""
    now = running.read(model)
    rest = float(model.total[2:6].sum() + model.total[Z_KINETIC]) + now.energy
    record.moved.append(at)
    record.load.append(load_now)
    record.kinetic.append(kinetic)
    record.energy.append(abs(work - rest) / max(work, 1e-300) if work else 0.0)
    record.restless = float(model.total[Z_KINETIC]) / max(now.energy, 1e-300) if work else 0.0
    record.marks.append(joint_marks(model, now))
    record.places.append(rigid_motion(model))
    record.zones.append(zone_state(model))


def _rates(path: list[float], steps: int, samples: int) -> Array:
    """Displacement per step in every sample [m]: a gentle start, then one speed, exactly to each turning point."""
    lengths = np.diff([0.0, *path])
    whole = np.abs(lengths).sum()
    chunk = steps // samples
    rates: list[float] = []
    for branch, length in enumerate(lengths):
        count = max(round(samples * abs(length) / whole), GENTLE + 1)
        weight = np.ones(count)
        if branch == 0:
            weight[:GENTLE] = (np.arange(GENTLE) + 0.5) / GENTLE
        rates += list(length * weight / weight.sum() / chunk)
    return np.array(rates)


class _Follower:
    """Tells what part of the push is done and how long the rest will take."""

    def __init__(self, progress: Progress | None, run: int, before: int, total: int, per_step: float) -> None:
        self.progress, self.run, self.before, self.total, self.pace = progress, run, before, total, per_step
        self.clock, self.begun = time.perf_counter(), 0

    def goes_on(self, steps: int) -> None:
        """The run begins, or is taken up, after so many steps."""
        self.clock, self.begun = time.perf_counter(), steps

    def __call__(self, steps: int, displacement: float, load: float) -> bool:
        """Hand the sample on; whether to stop."""
        done = self.before + steps
        reached(done / self.total, f"{1e3 * displacement:.3g} mm")
        if self.progress is None:
            return False
        own = steps - self.begun
        pace = (time.perf_counter() - self.clock) / own if own else self.pace
        return bool(self.progress({
            "run": self.run, "part": done / self.total, "time left": pace * (self.total - done),
            "displacement": displacement, "load": load,
        }))  # fmt: skip
