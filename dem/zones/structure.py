"""A structure of zoned blocks as a push drives it: loads that come on, pace, samples of a drive and files of them."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from dem.driving.path import widest_spacing
from dem.driving.push_curve import PushCurve
from dem.driving.structure import DrivenStructure
from dem.driving.zone_marks import ZoneState
from dem.kernels.arrays import LAW
from dem.kernels.zone_arrays import Z_KINETIC
from dem.model.joint_marks import JointMarks
from dem.model.state import UnstableError
from dem.settings import PushSettings
from dem.stages.resuming import RunStatus, signature
from dem.zones import running
from dem.zones.drive import ZonedRun
from dem.zones.model import make_model, set_loads
from dem.zones.recording import read_digests, read_model, save
from dem.zones.zoned_model import AXES, SENSE
from limitmason.deformable import PLANE_STRESS
from limitmason.deformable.levels import ZONED
from limitmason.errors import InputError, NotConverged
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive

AT_REST = 1e-8
"""Kinetic over elastic energy below which what does not balance is rounding [-]."""

LEAST_STEPS = 40_000
"""Steps that the faster run takes, at least: a brittle panel that fails at 9 kN carries 14 to 19 in 6000 to 20 000."""


class ZonedStructure(DrivenStructure):
    """Zoned blocks that a push drives.

    Contacts are those of the reference position, followed along the sides they lie on. A servo is a dead force, and
    holds the turns of its block where it is parallel.
    """

    blocks = ZONED
    to_settle = 10.0
    tried = 20
    least_samples = 1

    def __init__(self, assembly: Assembly, drive: Drive, loads: Loads | None, chosen: PushSettings) -> None:
        """Zones, contacts, masses and signature; nothing moves yet."""
        stress = chosen.stress or PLANE_STRESS
        assert chosen.zone_size is not None
        super().__init__(assembly, drive, loads, chosen)
        unit, held = self.unit, self.held
        if unit[:, [1, 3, 5]].any():
            raise InputError(
                "the drive leaves the x-z plane, in which zoned blocks stay: give x, z or ry, or take simply "
                "deformable blocks, which strain and bend in space"
            )
        for given in ("calm", "damping"):
            if getattr(drive, given) is not None:
                raise InputError(f"zoned blocks take no {given}: leave it out of the drive")
        dead = (loads if loads is not None else Loads.weight(assembly)).dead.copy()
        for name, servo in drive.servo.items():
            block = assembly.block_index(name)
            dead[block, 2] -= servo.force
            held[block, 4] |= servo.parallel
        stiff = np.flatnonzero(unit.any(axis=1) | held.any(axis=1)).tolist()
        self.least_steps = max(LEAST_STEPS, 10 * chosen.samples)
        self.model = model = make_model(
            assembly, Loads(dead, np.zeros_like(dead)), zone_size=chosen.zone_size, plane=stress,
            contact_points=chosen.contact_points, joint_options=chosen.joint_options, stiff=stiff,
        )
        set_loads(model, dead)
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
            "loads": (model.nodes.load, model.rigid.load),
        }
        self.same = signature(assembly, parts, blocks=ZONED, stress=stress, holds=first.tolist())

    @cached_property
    def period(self) -> float:
        """Steps of the slowest motion."""
        return running.slowest_period(self.model)

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
        """Come to rest under the dead loads."""
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
        save(file, self.model, self.same, None)

    def take_rest(self, file: Path) -> None:
        """Put the model where a file's was at rest."""
        read_model(file, self.model)

    def digests_of(self, file: Path) -> Mapping[str, str]:
        """What a file says that a run which goes on from it must have in common with it."""
        return read_digests(file)

    def _unsettled(self) -> str:
        """Why a model did not settle, in words: it moves, or it is at rest but for the rounding of stiff springs."""
        force = f"unbalanced force {running.unbalance(self.model):.2g} of the mean applied force per node"
        if self.model.total[Z_KINETIC] < AT_REST * running.read(self.model).energy:
            return (
                f"the structure rests under its dead loads, but its forces are not in balance ({force}): they are lost "
                f"in the rounding of springs too stiff for them; {self.contrast()}. Take softer units or joints"
            )
        return f"the structure does not settle under its dead loads ({force}): it falls before it is driven"

    def begun(self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None) -> ZonedRun:
        """Run of a copy along a path, from its start or from where a file says that it stood."""
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

        Its ``seconds`` are those of the record, runs before it included.
        """
        r, m = run.record.arrays(), self.model
        slid, driven = float(np.nanmax(r["slip"][-1], initial=0.0)), int(np.argmax(np.abs(self.twist).max(axis=1)))
        pieces = np.diff(m.sides.arc)
        shortest = float(pieces[pieces > 0.0].min())
        if slid > 0.5 * shortest:
            run.note(
                f"a joint has slid by {1e3 * slid:.3g} mm: contacts are those of the reference position, and a block "
                "that leaves the face it lies on is still carried by its plane"
            )
        spacing = widest_spacing(m.contacts.arc[None, m.contacts.joint == row] for row in range(len(m.interface)))
        return PushCurve(
            r["moved"], r["load"], errors={"energy": r["energy"], "kinetic": r["kinetic"]},
            states=list(zip(r["place"], r["turn"], strict=True)), status=status, warnings=tuple(run.notes),
            assembly=self.assembly, **{name: r[name] for name in JointMarks._fields}, blocks=ZONED,
            settlement=float(m.nodes.shift[m.nodes.body == driven].mean(axis=0) @ self.twist[driven, :2]),
            law="; ".join(m.lost), spacing=spacing, steps=steps, seconds=float(r["seconds"][-1]), mesh=m.mesh,
            zones=[ZoneState(*z) for z in zip(*(r[name] for name in ZoneState._fields), strict=True)], stress=m.plane,
        )
