"""Zoned blocks as a push drives them: loads that come on, pace, samples of a drive and files of them."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from dem.driving.push_curve import PushCurve
from dem.driving.structure import DrivenStructure, widest_spacing
from dem.kernels.arrays import LAW
from dem.kernels.zone_arrays import Z_APPLIED, Z_KINETIC, Z_LOST, Z_SUPPORT
from dem.model.joint_marks import MARKS
from dem.model.state import UnstableError
from dem.model.unbalance import CALM
from dem.settings import ZONED_STEPS, PushSettings
from dem.stages.resuming import RunStatus, signature
from dem.stages.stage_checks import check_stages, servo_holds
from dem.stages.store import Samples
from dem.zones import recording, running
from dem.zones.assemble_zones import make_model
from dem.zones.recording import ZoneState
from dem.zones.zoned_model import AXES, SENSE, ZonedModel, slowest_period
from limitmason.arrays import Array, Flags
from limitmason.deformable import PLANE_STRESS
from limitmason.deformable.levels import ZONED
from limitmason.errors import InputError, NotConverged
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive

AT_REST = 1e-8
"""Kinetic over elastic energy below which what does not balance is rounding [-]."""

LEAST_STEPS = 40_000
"""Steps that the faster run takes, at least: a brittle panel that fails at 9 kN carries 14 to 19 in 6000 to 20 000."""

# chosen
_GENTLE = 5  # samples over which the drive comes up to its speed
_TAIL = 4  # the load of a sample is the mean over its last quarter
_LEAST_TAIL = 20  # steps of such a mean, as long as the sample has as many
_SLID = 0.5  # part of the shortest side of a zone from which a joint that has slid is pointed out [-]

_NONE = 1e-300  # work or energy [J] that a part is of, instead of 0

class ZonedRun:
    """A run of zoned blocks along a path, see :class:`dem.stages.run.Run`.

    The load of a sample is the mean of the last quarter of its steps.

    Parameters
    ----------
    model : at rest; changed on the way
    twist : of rigid blocks per displacement of 1 m, along x, z and about -y, shape (r, 3)
    hold : freedoms of rigid blocks that the drive holds, shape (r, 3)
    path : turning points of the displacement [m]
    steps : of the whole path, about
    count : samples of the whole path, about

    Attributes
    ----------
    rates : displacement per step in every sample [m], shape (samples,)
    chunk : steps of a sample
    before : forces of the blocks on what the drive moves when it begins [N, N m], shape (r, 3)
    work_before : work of loads and supports up to then [J]
    record : what is written down of every sample, by column
    same : digests that a file of this run must share, see :func:`dem.stages.resuming.signature`
    """

    status = RunStatus.FINISHED

    def __init__(
        self, model: ZonedModel, twist: Array, hold: Flags, path: Sequence[float], steps: int, count: int
    ) -> None:
        """Write the settled model down as sample 0."""
        self.model, self.twist, self.hold = model, twist, hold
        self.rates, self.chunk = _rates(path, steps, count), steps // count
        # what stands there when the drive begins is no load of the drive: forces on what it moves [N, N m], and work
        self.before = np.where(twist != 0.0, model.rigid.net, 0.0)
        self.work_before = float(model.total[Z_APPLIED] + model.total[Z_SUPPORT])
        self.clock, self.same, self.notes = time.perf_counter(), dict[str, str](), [*model.warnings]
        first = self._sampled(0.0, 0.0, 0.0, 0.0)
        self.record = Samples(**{name: np.shape(value) for name, value in first.items()})
        self.record.add(**first)

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
        """Step to the next sample, and return its step, displacement [m] and load [N]."""
        model, number, last = self.model, self.samples, self.record.columns
        # displacement per step [m], and the steps at the end over which the load is a mean
        rate, tail = float(self.rates[number]), min(self.chunk, max(self.chunk // _TAIL, _LEAST_TAIL))
        running.drive(model, self.twist * rate, self.hold)
        # damping of a steady motion is let through only where little moves beside it
        calm = last["restless"][-1] < CALM
        running.advance(model, self.chunk - tail, drifts=calm)
        running.advance(model, tail, drifts=calm)
        running.refuse_explosion(model)
        # forces of the blocks on the drive, summed over the tail: the drive's is the opposite
        load = float(-((model.rigid.total / tail - self.before) * self.twist).sum())
        work = abs(float(model.total[Z_APPLIED] + model.total[Z_SUPPORT]))
        done = max(abs(work - self.work_before), _NONE)
        # while the drive starts there is no work yet to be a part of
        kinetic = float(model.total[Z_KINETIC]) / done if number >= _GENTLE else 0.0
        at = last["moved"][-1] + rate * self.chunk
        self.record.add(**self._sampled(at, load, kinetic, work))
        return {"step": self.chunk * (number + 1), "displacement": at, "load": load}

    def note(self, text: str) -> None:
        """Keep what a reader must know of it."""
        self.notes.append(text)

    def save(self, file: str | Path, status: RunStatus = RunStatus.INTERRUPTED) -> None:
        """Write a file from which the run goes on to the same bits."""
        # what flew apart is run again from the last file before it
        if status != RunStatus.UNSTABLE:
            recording.save(file, self.model, self.same, self.record)

    def take_up(self, file: Path) -> None:
        """Go on from where a file says that a run like this one stood."""
        self.record.take_up(recording.read_model(file, self.model))
        self.clock = time.perf_counter() - float(self.record.columns["seconds"][-1])

    def _sampled(self, at: float, load: float, kinetic: float, work: float) -> dict[str, Any]:
        """What is written down of where the model stands, by column.

        Parameters
        ----------
        at : displacement of the drive [m]
        load : force of the drive [N]
        kinetic : kinetic energy over the work of the drive [-]
        work : of loads and supports so far [J], 0 before the drive
        """
        model, now = self.model, running.read(self.model)
        moving = float(model.total[Z_KINETIC])
        rest = float(model.total[Z_LOST].sum() + moving) + now.energy
        place, turn = recording.rigid_motion(model)
        marks, zones = recording.zoned_joint_marks(model, now), recording.zone_state(model)
        return dict(
            moved=at, load=load, kinetic=kinetic, energy=abs(work - rest) / max(work, _NONE) if work else 0.0,
            restless=moving / max(now.energy, _NONE) if work else 0.0, seconds=time.perf_counter() - self.clock,
            **vars(marks), place=place, turn=turn, **zones._asdict(),
        )


def _rates(path: Sequence[float], steps: int, samples: int) -> Array:
    """Displacement per step in every sample [m], exactly to each turning point.

    The first samples rise to the speed of the others, as a jump of speed would shake the blocks.

    Parameters
    ----------
    path : turning points [m], from 0
    steps : of the whole path, about: every sample has as many, and a short branch some samples more
    samples : of the whole path, about
    """
    lengths = np.diff([0.0, *path])
    whole = np.abs(lengths).sum()
    chunk = steps // samples
    rates: list[float] = []
    for branch, length in enumerate(lengths):
        count = max(round(samples * abs(length) / whole), _GENTLE + 1)
        speed = np.ones(count)  # over that of the samples behind the start
        if branch == 0:
            speed[:_GENTLE] = (np.arange(_GENTLE) + 0.5) / _GENTLE
        rates += list(length * speed / speed.sum() / chunk)
    return np.array(rates)


class ZonedStructure(DrivenStructure):
    """Zoned blocks that a push drives.

    Contacts are those of the reference position, followed along the sides they lie on. A servo is a dead force, and
    holds the turns of its block where it is parallel. Attributes beside those of :class:`DrivenStructure`:

    Attributes
    ----------
    model : of the blocks, changed as it settles; runs drive copies
    twist : of rigid blocks per displacement of 1 m, x, z and turn from x to z, shape (r, 3)
    hold : freedoms of rigid blocks that the drive holds, shape (r, 3)
    """

    blocks = ZONED
    to_settle = 10.0
    tried = 20
    least_samples = 1

    def __init__(self, assembly: Assembly, drive: Drive, loads: Loads | None, chosen: PushSettings) -> None:
        """Zones, contacts, masses and signature; nothing moves yet.

        Parameters
        ----------
        assembly : what is driven, a wall in the x-z plane
        drive : which blocks and along which direction in that plane
        loads : dead ones; self weight where None
        chosen : settings of the push, with the size of zones
        """
        stress = chosen.stress or PLANE_STRESS
        assert chosen.zone_size is not None
        super().__init__(assembly, drive, loads, chosen)
        unit, held = self.unit, self.held
        # along y, and turns about x and z
        if unit[:, [1, 3, 5]].any():
            raise InputError(
                "the drive leaves the x-z plane, in which zoned blocks stay: give x, z or ry, or take simply "
                "deformable blocks, which strain and bend in space"
            )
        for setting in ("calm", "damping"):
            if getattr(drive, setting) is not None:
                raise InputError(f"zoned blocks take no {setting}: leave it out of the drive")
        check_stages([drive], loaded=False, timed=False)
        servo_holds(drive, assembly)
        given_loads = loads if loads is not None else Loads.weight(assembly)
        dead = given_loads.dead.copy()
        for name, servo in drive.servo.items():
            block = assembly.block_index(name)
            dead[block, 2] -= servo.force
            held[block, 4] |= servo.parallel
        # what is driven or held moves as one
        stiff = np.flatnonzero(unit.any(axis=1) | held.any(axis=1)).tolist()
        self.least_steps = max(LEAST_STEPS, ZONED_STEPS * chosen.samples)
        self.model = model = make_model(
            assembly, replace(given_loads.scaled(live=0.0), dead=dead), zone_size=chosen.zone_size, plane=stress,
            contact_points=chosen.contact_points, joint_options=chosen.joint_options, stiff=stiff,
        )
        # a block's number among the rigid ones
        rows = [int(np.count_nonzero(model.mesh.rigid[:b])) for b in stiff]
        self.twist, self.hold = np.zeros(model.rigid.held.shape), np.zeros_like(model.rigid.held)
        self.twist[rows] = unit[stiff][:, AXES] * SENSE
        self.hold[rows] = held[stiff][:, AXES]
        # a drive that has not begun holds already what it names and does not move, and turns of parallel jacks
        first = self.hold & (self.twist == 0.0)
        running.drive(model, np.zeros(first.shape), first)
        mesh, c = model.mesh, model.contacts
        parts = {
            "zones": (mesh.place, mesh.zones, mesh.thickness, mesh.rigid),
            "materials": (*model.tables,), "joints": (model.law, model.interface),
            "contact points": (c.joint, c.side, c.arc, c.node, c.share, c.area, c.gap),
            "loads": (model.nodes.load, model.rigid.load, model.rigid.arms),
        }
        self.same = signature(assembly, parts, blocks=ZONED, stress=stress, holds=first.tolist())

    @cached_property
    def period(self) -> float:
        """Steps of the slowest motion."""
        return slowest_period(self.model)

    def contrast(self) -> str:
        """Stiffness of zones and joints in words."""
        m = self.model
        zone = max(b.material.young_modulus for b in m.assembly.blocks if b.material is not None) / m.mesh.size
        joint = m.law[:, [LAW.kn, LAW.ks]]
        return f"zones have E / size = {zone:.2g} Pa/m, joints from {joint.min():.2g} to {joint.max():.2g} Pa/m"

    def try_steps(self, count: int) -> None:
        """Take steps of a copy."""
        running.advance(self.model.copy(), count)

    def come_to_rest(self) -> None:
        """Step the model under its dead loads until it rests.

        Raises
        ------
        NotConverged
            Where it does not come to rest, or flies apart: it falls before it is driven.
        """
        # under softer joints than most it takes a few of the slowest swings
        most = max(running.MOST_STEPS, int(self.to_settle * self.period))
        try:
            rests = running.settle(self.model, max_steps=most)
        except UnstableError as error:
            raise NotConverged(f"the structure falls under its dead loads before it is driven: {error}") from error
        if not rests:
            raise NotConverged(self._unsettled())

    def keep_rest(self, file: Path) -> None:
        """Write the model at rest to a file."""
        recording.save(file, self.model, self.same, None)

    def take_rest(self, file: Path) -> None:
        """Put the model where a file's was at rest."""
        recording.read_model(file, self.model)

    def _unsettled(self) -> str:
        """Why the model did not settle, in words: it moves, or springs round too much."""
        force = f"unbalanced force {running.unbalance(self.model):.2g} of the mean applied force per node"
        if self.model.total[Z_KINETIC] < AT_REST * running.read(self.model).energy:
            return (
                f"the structure rests under its dead loads, but its forces are not in balance ({force}): they are lost "
                f"in the rounding of springs too stiff for them; {self.contrast()}. Take softer units or joints"
            )
        return f"the structure does not settle under its dead loads ({force}): it falls before it is driven"

    def begun(self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None) -> ZonedRun:
        """Run of a copy along a path, with arguments as for :meth:`DrivenStructure.begun`."""
        run = ZonedRun(self.model.copy(), self.twist, self.hold, path, steps, self.chosen.samples)
        run.same = dict(same)
        if file is not None:
            run.take_up(file)
        return run

    def steps_of(self, run: ZonedRun) -> tuple[float, float]:
        """Number that the first step of a run counts from, and steps that it has taken."""
        return 0.0, float(run.chunk * run.samples)

    def curve_of(self, run: ZonedRun, status: RunStatus, steps: int, seconds: float) -> PushCurve:
        """Curve of a run: displacement, force, errors, marks and states of the zones.

        Parameters
        ----------
        status : how the run ended
        steps : that it was to take
        seconds : of this call; the curve's are those of the record, runs before it was taken up included
        """
        r, m = run.record.arrays(), self.model
        slid = float(np.nanmax(r["slip"][-1], initial=0.0))
        driven = int(np.argmax(np.linalg.norm(self.twist[:, :2], axis=1)))  # the block that moves farthest
        steps_along = np.diff(m.sides.arc)  # from node to node along each side; not positive on to the next side
        shortest = float(steps_along[steps_along > 0.0].min())
        if slid > _SLID * shortest:
            run.note(
                f"a joint has slid by {1e3 * slid:.3g} mm: contacts are those of the reference position, and a block "
                "that leaves the face it lies on is still carried by its plane"
            )
        spacing = widest_spacing(m.contacts.arc[None, m.contacts.joint == row] for row in range(len(m.interface)))
        return PushCurve(
            r["moved"], r["load"], errors={"energy": r["energy"], "kinetic": r["kinetic"]},
            states=list(zip(r["place"], r["turn"], strict=True)), status=status, warnings=tuple(run.notes),
            assembly=self.assembly, **{name: r[name] for name in MARKS}, blocks=ZONED,
            settlement=float(m.nodes.shift[m.nodes.body == driven].mean(axis=0) @ self.twist[driven, :2]),
            law="; ".join(m.lost), spacing=spacing, steps=steps, seconds=float(r["seconds"][-1]), mesh=m.mesh,
            zones=[ZoneState(*z) for z in zip(*(r[name] for name in ZoneState._fields), strict=True)], stress=m.plane,
        )
