"""Zoned blocks that are driven along a path: steps from sample to sample, and what is written down there."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dem.kernels.zone_arrays import Z_APPLIED, Z_KINETIC, Z_LOST, Z_SUPPORT
from dem.model.joint_marks import JointMarks
from dem.model.rest_criterion import CALM
from dem.stages.resuming import RunStatus
from dem.stages.samples import Samples
from dem.zones import running
from dem.zones.recording import read_model, rigid_motion, save, zone_state, zoned_joint_marks
from dem.zones.zoned_model import ZonedModel
from limitmason.arrays import Array, Flags

GENTLE = 5
"""Samples over which the drive comes up to its speed."""


class ZonedRun:
    """A run of zoned blocks along a path, see :class:`dem.stages.run.Run`.

    The load of a sample is the mean of the last quarter of its steps.

    Parameters
    ----------
    model : at rest; changed on the way
    twist, hold : of rigid blocks per displacement of 1 m, and the freedoms that the drive holds
    path, steps, count : turning points [m], steps over all of them and samples
    """

    status = RunStatus.FINISHED

    def __init__(
        self, model: ZonedModel, twist: Array, hold: Flags, path: Sequence[float], steps: int, count: int
    ) -> None:
        """Write the settled model down as sample 0."""
        self.model, self.twist, self.hold = model, twist, hold
        self.rates, self.chunk = _rates(path, steps, count), steps // count
        self.before = np.where(twist != 0.0, model.rigid.net, 0.0)
        self.work_before = float(model.total[Z_APPLIED] + model.total[Z_SUPPORT])
        self.clock, self.same, self.notes = time.perf_counter(), dict[str, str](), [*model.warnings]
        blocks, joints = model.assembly.n_blocks, (len(model.assembly.interfaces),)
        zones = zone_state(model)
        self.record = Samples(
            **dict.fromkeys(("moved", "load", "kinetic", "energy", "restless", "seconds"), ()),
            **dict.fromkeys(JointMarks._fields, joints), place=(blocks, 3), turn=(blocks, 4),
            **{name: value.shape for name, value in zones._asdict().items()},
        )
        self._sample(0.0, 0.0, 0.0, 0.0)

    @property
    def samples(self) -> int:
        """Samples of the drive so far."""
        return len(self.record) - 1

    @property
    def over(self) -> bool:
        """Whether the path is done."""
        return self.samples == len(self.rates)

    @property
    def where(self) -> tuple[float, str]:
        """Part of the path that is done, and the displacement."""
        return self.samples / len(self.rates), f"{1e3 * self.record.columns['moved'][-1]:.3g} mm"

    def begin(self) -> None:
        """Nothing to do: the drive comes with every sample."""

    finish = begin

    def advance(self) -> Mapping[str, Any]:
        """Step to the next sample; the force of the drive is the mean over the last quarter."""
        model, number, last = self.model, self.samples, self.record.columns
        rate, tail = float(self.rates[number]), min(self.chunk, max(self.chunk // 4, 20))
        running.drive(model, self.twist * rate, self.hold)
        # damping of a steady motion is let through only where little moves beside it
        calm = last["restless"][-1] < CALM
        running.advance(model, self.chunk - tail, drifts=calm)
        running.advance(model, tail, drifts=calm)
        running.refuse_explosion(model)
        load = float(-((model.rigid.total / tail - self.before) * self.twist).sum())
        work = abs(float(model.total[Z_APPLIED] + model.total[Z_SUPPORT]))
        done = max(abs(work - self.work_before), 1e-300)
        moving = float(model.total[Z_KINETIC]) / done if number >= GENTLE else 0.0
        at = last["moved"][-1] + rate * self.chunk
        self._sample(at, load, moving, work)
        return {"step": self.chunk * (number + 1), "displacement": at, "load": load}

    def note(self, text: str) -> None:
        """Keep what a reader must know of it."""
        self.notes.append(text)

    def save(self, file: str | Path, status: RunStatus = RunStatus.INTERRUPTED) -> None:
        """Write a file from which the run goes on to the same bits."""
        # what flew apart is run again from the last file before it
        if status != RunStatus.UNSTABLE:
            save(file, self.model, self.same, self.record)

    def take_up(self, file: Path) -> None:
        """Go on from where a file says that a run like this one stood."""
        self.record.take_up(read_model(file, self.model))
        self.clock = time.perf_counter() - float(self.record.columns["seconds"][-1])

    def _sample(self, at: float, load: float, kinetic: float, work: float) -> None:
        """Write down where the model stands.

        ``work`` is that of loads and supports so far, 0 before the drive.
        """
        model, now = self.model, running.read(self.model)
        moving = float(model.total[Z_KINETIC])
        rest = float(model.total[Z_LOST].sum() + moving) + now.energy
        place, turn = rigid_motion(model)
        self.record.add(
            moved=at, load=load, kinetic=kinetic, energy=abs(work - rest) / max(work, 1e-300) if work else 0.0,
            restless=moving / max(now.energy, 1e-300) if work else 0.0, seconds=time.perf_counter() - self.clock,
            **zoned_joint_marks(model, now)._asdict(), place=place, turn=turn, **zone_state(model)._asdict(),
        )


def _rates(path: Sequence[float], steps: int, samples: int) -> Array:
    """Displacement per step in every sample [m], exactly to each turning point.

    The first ``GENTLE`` samples rise to the speed of the others, as a jump of speed would shake the blocks.
    """
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
