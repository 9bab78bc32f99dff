"""A structure of zoned blocks driven to a displacement at two speeds, as one load-displacement curve."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.joints import Grid, JointOptions
from dem.kernels.zone_arrays import Z_APPLIED, Z_KINETIC, Z_SUPPORT
from dem.stepping import CALM
from dem.zones import running
from dem.zones.marks import joint_marks
from dem.zones.model import ZonedModel, make_model, set_loads
from dem.zones.push_curve import ZonedCurve, rigid_motion, zone_state, zoned_curve
from limitmason.deformable import PLANE_STRESS
from limitmason.errors import InputError, NotConverged
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive
from limitmason.progress import reached, watched

Array = NDArray[np.float64]
Progress = Callable[[Mapping[str, Any]], object]

SLOWER = 3
"""The second run is so many times slower."""

SWINGS = 25
"""Slowest swings that the faster run takes, at least [-]."""

LEAST_STEPS = 10_000
"""Steps that it takes, at least."""

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
    label: str = "",
) -> ZonedCurve:
    """Load-displacement curve of a wall of zoned blocks, own weight settled first.

    Blocks with a material are cut into zones; blocks that are held, driven or carry a servo, and those without a
    material, are rigid. Contacts are those of the reference position, followed along the sides they lie on.

    Parameters
    ----------
    drive : direction, as for :func:`dem.push`; x, z and ry of blocks. A ``servo`` is a dead force here, and holds the
        turn of its block where it is parallel
    to : displacement at the end [m]; several are a path with turning points
    zone_size : largest edge of a zone [m]
    loads : dead loads; self weight alone by default. Live loads do not act
    plane : "plane stress" or "plane strain"
    contact_points : as for :func:`dem.make_state`, those across the thickness at one place; by default no further apart
        than the zones' edges, with areas by halves
    joint_options : as for :func:`dem.push`
    steps : of the faster run over the whole path; by default 25 of the slowest swings, and 10 000 at least
    rate_check : run again at a third of the speed; the answer is that run
    samples : per run
    tolerance : of settling, unbalanced force at a node over the mean applied force per node [-]
    longest : predicted run time above which a push whose ``steps`` nobody chose is refused [s]
    progress : called with a mapping of "run", "part" of all steps done, "time left" [s], "displacement", "load"; return
        True to stop ("interrupted")

    Raises
    ------
    InputError
        For a drive out of the plane or without direction, and as :func:`dem.zones.model.make_model`.
    NotConverged
        Where the structure does not settle under its dead loads.
    """
    path = [float(v) for v in np.atleast_1d(np.asarray(to, dtype=float))]
    ends = np.diff([0.0, *path])
    if not len(path) or not np.isfinite(path).all() or not (np.abs(ends) > 0.0).all():
        raise InputError(f"to must be a displacement [m] or a path of different ones, got {to!r}")
    if samples < 10 or (steps is not None and steps < 10 * samples):
        raise InputError(f"samples must be at least 10 and steps ten times as many, got {samples!r} and {steps!r}")
    unit, held = _unit(drive, assembly)
    loads = loads if loads is not None else Loads.weight(assembly)
    dead = loads.dead.copy()
    for name, servo in drive.servo.items():
        block = assembly.block_index(name)
        dead[block, 2] -= servo.force
        held[block, 4] |= servo.parallel
    still = Loads(dead, np.zeros_like(dead), loads.name)
    stiff = np.flatnonzero(unit.any(axis=1) | held.any(axis=1)).tolist()
    settled = make_model(
        assembly, still, zone_size=zone_size, plane=plane, contact_points=contact_points, joint_options=joint_options,
        stiff=stiff,
    )  # fmt: skip
    set_loads(settled, dead)
    rows = [int(np.count_nonzero(settled.mesh.rigid[:b])) for b in stiff]
    hold = np.zeros_like(settled.rigid.held)
    hold[rows] = held[stiff][:, [0, 2, 4]]
    # a drive that has not begun holds already what it names and does not move, and turns of parallel jacks
    first = hold.copy()
    first[rows] &= unit[stiff][:, [0, 2, 4]] == 0.0
    running.drive(settled, np.zeros(hold.shape), first)
    clock = time.perf_counter()
    if not running.settle(settled, tolerance):
        raise NotConverged(
            f"the structure does not settle under its dead loads (unbalanced force {running.unbalance(settled):.2g} of "
            "the mean applied force per node): it falls before it is driven"
        )
    per_step = (time.perf_counter() - clock) / settled.total[7]
    if steps is None:
        steps = max(int(SWINGS * running.slowest_period(settled)), LEAST_STEPS)
        predicted = per_step * steps * (1 + SLOWER * rate_check)
        if predicted > longest:
            raise InputError(
                f"the push would take about {predicted / 3600.0:.1f} h ({steps} steps of {1e6 * per_step:.0f} us, and "
                "three times as many): take larger zones, softer joints, or give longest="
            )
    counts = (steps, SLOWER * steps) if rate_check else (steps,)
    curves = []
    for number, count in enumerate(counts):
        follow = _Follower(progress, number, sum(counts[:number]), sum(counts), per_step)
        curve = _run(_twin(settled), unit[stiff], rows, hold, path, count, samples, follow)
        curves.append(replace(curve, label=label or ", ".join(str(b) for b in drive.displacement)))
        if curve.status == "interrupted":
            break
    if len(curves) == 1:
        return curves[0]
    both = curves[1].beside(curves[0])
    assert isinstance(both, ZonedCurve)
    return both


def _unit(drive: Drive, assembly: Assembly) -> tuple[Array, NDArray[np.bool_]]:
    """Twist of the blocks per displacement of 1 m, and the freedoms the drive holds, shapes (n, 6)."""
    if not isinstance(drive, Drive):
        raise InputError(f"drive must be a limitmason Drive such as Drive({{'plate': {{'z': -1.0}}}}), got {drive!r}")
    if drive.steps is not None or drive.duration is not None:
        raise InputError("the drive of a push is a direction: leave out its steps and duration, and give steps to push")
    travel, held = drive.twists(assembly)
    size = float(np.linalg.norm(travel[:, :3], axis=1).max())
    if not size > 0.0:
        raise InputError("the drive has no direction: give a translation, such as {'plate': {'z': -1.0}}")
    if travel[:, [1, 3, 5]].any():
        raise InputError("the drive leaves the x-z plane, in which zoned blocks stay: give x, z or ry")
    taken = held & assembly.held
    if taken.any():
        name = assembly.blocks[int(np.flatnonzero(taken.any(axis=1))[0])].name
        raise InputError(f"block {name!r} is held by a support in a degree of freedom that the drive moves")
    return travel / size, held


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
    samples: int, follow: "_Follower",
) -> ZonedCurve:  # fmt: skip
    """One drive along the path."""
    twist = np.zeros(hold.shape)
    # a turn from x to z is one about -y
    twist[rows] = unit[:, [0, 2, 4]] * (1.0, 1.0, -1.0)
    clock = time.perf_counter()
    before = np.where(twist != 0.0, model.rigid.net, 0.0)
    work_before = model.total[Z_APPLIED] + model.total[Z_SUPPORT]
    first = running.read(model)
    marks, energy = [joint_marks(model, first)], [0.0]
    places, zones = [rigid_motion(model)], [zone_state(model)]
    moved, load, kinetic = [0.0], [0.0], [0.0]
    rates = _rates(path, steps, samples)
    chunk, at, restless, status = steps // samples, 0.0, 0.0, "finished"
    tail = min(chunk, max(chunk // 4, 20))
    for number, rate in enumerate(rates):
        running.drive(model, twist * rate, hold)
        calm = restless < CALM
        running.advance(model, chunk - tail, drifts=calm)
        running.advance(model, tail, drifts=calm)
        at += rate * chunk
        now = running.read(model)
        moved.append(at)
        load.append(float(-((model.rigid.total / tail - before) * twist).sum()))
        work = abs(model.total[Z_APPLIED] + model.total[Z_SUPPORT])
        done = max(abs(work - work_before), 1e-300)
        restless = float(model.total[Z_KINETIC]) / max(now.energy, 1e-300)
        kinetic.append(float(model.total[Z_KINETIC]) / done if number >= GENTLE else 0.0)
        rest = model.total[2:6].sum() + model.total[Z_KINETIC] + now.energy
        energy.append(float(abs(work - rest) / max(work, 1e-300)))
        marks.append(joint_marks(model, now))
        places.append(rigid_motion(model))
        zones.append(zone_state(model))
        if follow(chunk * (number + 1), at, load[-1]):
            status = "interrupted"
            break
    seconds = time.perf_counter() - clock
    return zoned_curve(model, moved, load, kinetic, energy, marks, places, zones, status, steps, twist, seconds)


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
        self.clock = time.perf_counter()

    def __call__(self, steps: int, displacement: float, load: float) -> bool:
        """Hand the sample on; whether to stop."""
        done = self.before + steps
        reached(done / self.total, f"{1e3 * displacement:.3g} mm")
        if self.progress is None:
            return False
        pace = (time.perf_counter() - self.clock) / steps if steps else self.pace
        return bool(self.progress({
            "run": self.run, "part": done / self.total, "time left": pace * (self.total - done),
            "displacement": displacement, "load": load,
        }))  # fmt: skip
