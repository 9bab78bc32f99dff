"""A structure of zoned blocks as a push drives it: loads that come on, pace, samples of a drive and files of them."""

import time
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dem.driving import Follower, go, unit_twist, widest_spacing
from dem.joint_marks import JointMarks
from dem.kernels.arrays import LAW
from dem.kernels.solid_arrays import FaceContacts
from dem.kernels.zone_arrays import Z_KINETIC, Sides
from dem.push_curve import PushCurve
from dem.resuming import RunStatus, check_same, signature
from dem.settings import PushSettings
from dem.state import UnstableError
from dem.zone_marks import ZoneState
from dem.zones import running
from dem.zones.drive import ZonedRun
from dem.zones.model import make_model, set_loads
from dem.zones.recording import read_digests, read_model, save
from dem.zones.solid_mesh import SolidMesh
from dem.zones.zoned_model import ZonedModel
from limitmason.deformable import PLANE_STRESS, SOLID
from limitmason.deformable.levels import ZONED
from limitmason.errors import InputError, NotConverged
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive

Array = NDArray[np.float64]

AT_REST = 1e-8
"""Kinetic over elastic energy below which what does not balance is rounding [-]."""

TRIED = 20
"""Steps by which the pace is measured."""

LEAST_STEPS = 40_000
"""Steps that the faster run takes, at least: a brittle panel that fails at 9 kN carries 14 to 19 in 6000 to 20 000."""


class ZonedStructure:
    """Zoned blocks that a push drives, as :class:`dem.structure.BlockStructure` are.

    Contacts are those of the reference position, followed along the sides they lie on. A servo is a dead force, and
    holds the turns of its block where it is parallel.
    """

    blocks = ZONED
    to_settle = 10.0

    def __init__(self, assembly: Assembly, drive: Drive, loads: Loads | None, chosen: PushSettings) -> None:
        """Zones, contacts, masses and signature; nothing moves yet."""
        stress = chosen.stress or PLANE_STRESS
        assert chosen.zone_size is not None
        unit, held = unit_twist(drive, assembly)
        if stress != SOLID and unit[:, [1, 3, 5]].any():
            raise InputError(
                f"the drive leaves the x-z plane, in which zoned blocks stay: give x, z or ry, or stress={SOLID!r} "
                "for zones in space"
            )
        for given in ("calm", "damping"):
            if getattr(drive, given) is not None:
                raise InputError(f"zoned blocks take no {given}: leave it out of the drive")
        dead = (loads if loads is not None else Loads.weight(assembly)).dead.copy()
        for name, servo in drive.servo.items():
            block = assembly.block_index(name)
            dead[block, 2] -= servo.force
            held[block, [3, 4, 5] if stress == SOLID else [4]] |= servo.parallel
        stiff = np.flatnonzero(unit.any(axis=1) | held.any(axis=1)).tolist()
        self.assembly, self.unit, self.held, self.chosen = assembly, unit, held, chosen
        self.least_steps = max(LEAST_STEPS, 10 * chosen.samples)
        self.model = model = make_model(
            assembly, Loads(dead, np.zeros_like(dead)), zone_size=chosen.zone_size, plane=stress,
            contact_points=chosen.contact_points, joint_options=chosen.joint_options, stiff=stiff,
        )  # fmt: skip
        set_loads(model, dead)
        rows = [int(np.count_nonzero(model.mesh.rigid[:b])) for b in stiff]
        self.twist, self.hold = np.zeros(model.rigid.held.shape), np.zeros_like(model.rigid.held)
        self.twist[rows] = unit[stiff][:, model.axes] * model.sense
        self.hold[rows] = held[stiff][:, model.axes]
        # a drive that has not begun holds already what it names and does not move, and turns of parallel jacks
        first = self.hold & (self.twist == 0.0)
        running.drive(model, np.zeros(first.shape), first)
        mesh, c = model.mesh, model.contacts
        on_a = (c.origin, c.tangent) if isinstance(c, FaceContacts) else (c.side, c.arc)
        parts = {
            "zones": (mesh.place, mesh.zones, *(() if isinstance(mesh, SolidMesh) else (mesh.thickness,)), mesh.rigid),
            "materials": (*model.tables,), "joints": (model.law, model.interface),
            "contact points": (c.joint, *on_a, c.node, c.share, c.area, c.gap),
            "loads": (model.nodes.load, model.rigid.load),
        }  # fmt: skip
        self.same: Mapping[str, str] = signature(assembly, parts, blocks=ZONED, stress=stress, holds=first.tolist())

    @cached_property
    def period(self) -> float:
        """Steps of the slowest motion."""
        return running.slowest_period(self.model)

    def step_time(self) -> float:
        """Time that a step takes [s], from a few of a copy once they are compiled."""
        tried = self.model.copy()
        running.advance(tried, 1)
        clock = time.perf_counter()
        running.advance(tried, TRIED)
        return (time.perf_counter() - clock) / TRIED

    def contrast(self) -> str:
        """Stiffness of zones and joints in words."""
        m = self.model
        zone = max(b.material.young_modulus for b in m.assembly.blocks if b.material is not None) / m.mesh.size
        joint = m.law[:, [LAW.kn, LAW.ks]]
        return f"zones have E / size = {zone:.2g} Pa/m, joints from {joint.min():.2g} to {joint.max():.2g} Pa/m"

    def check(self, file: Path, same: Mapping[str, str]) -> None:
        """Refuse a file of another push."""
        check_same(file, read_digests(file), same)

    def rest(self, file: Path | None) -> None:
        """Come to rest under the dead loads, or take the rest from a file; it is kept there."""
        model = self.model
        if file is not None and file.exists():
            self.check(file, self.same)
            read_model(file, model)
            return
        # under softer joints than most it takes a few of the slowest swings
        try:
            rests = running.settle(model, max_steps=max(running.MOST_STEPS, int(self.to_settle * self.period)))
        except UnstableError as error:
            raise NotConverged(f"the structure falls under its dead loads before it is driven: {error}") from error
        if not rests:
            raise NotConverged(self._unsettled())
        if file is not None:
            save(file, model, self.same, None)

    def _unsettled(self) -> str:
        """Why a model did not settle, in words: it moves, or it is at rest but for the rounding of stiff springs."""
        force = f"unbalanced force {running.unbalance(self.model):.2g} of the mean applied force per node"
        if self.model.total[Z_KINETIC] < AT_REST * running.read(self.model).energy:
            return (
                f"the structure rests under its dead loads, but its forces are not in balance ({force}): they are lost "
                f"in the rounding of springs too stiff for them; {self.contrast()}. Take softer units or joints"
            )
        return f"the structure does not settle under its dead loads ({force}): it falls before it is driven"

    def drive(
        self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None, follow: Follower
    ) -> PushCurve:
        """Drive a copy along a path in so many steps, or on from where a file says that it stood."""
        run = ZonedRun(self.model.copy(), self.twist, self.hold, path, steps, self.chosen.samples)
        run.same = dict(same)
        if file is not None and file.exists():
            self.check(file, same)
            run.take_up(file)
        follow.begin(0.0, run.chunk * run.samples)
        notes = [*self.model.warnings]
        try:
            status = go(run, progress=follow, checkpoint=file)
            if file is not None:
                run.save(file)
        except UnstableError as error:
            # what was there before is a curve
            if not run.samples:
                raise
            status = RunStatus.UNSTABLE
            notes.append(f"the run ended early: {error}")
        r, m = run.record.arrays(), self.model
        slid, driven = float(np.nanmax(r["slip"][-1], initial=0.0)), int(np.argmax(np.abs(self.twist).max(axis=1)))
        if slid > 0.5 * _shortest(m):
            notes.append(
                f"a joint has slid by {1e3 * slid:.3g} mm: contacts are those of the reference position, and a block "
                "that leaves the face it lies on is still carried by its plane"
            )
        return PushCurve(
            r["moved"], r["load"], errors={"energy": r["energy"], "kinetic": r["kinetic"]},
            states=list(zip(r["place"], r["turn"], strict=True)), status=status, warnings=tuple(notes),
            assembly=self.assembly, **{name: r[name] for name in JointMarks._fields}, blocks=ZONED,
            settlement=float(m.nodes.shift[m.nodes.body == driven].mean(axis=0) @ self.twist[driven, : m.dimension]),
            law="; ".join(m.lost), spacing=_spacing(m), steps=steps, seconds=float(r["seconds"][-1]), mesh=m.mesh,
            zones=[ZoneState(*z) for z in zip(*(r[name] for name in ZoneState._fields), strict=True)], stress=m.plane,
        )  # fmt: skip


def _spacing(model: ZonedModel) -> float:
    """Largest distance between neighbouring contact points of a joint [m]."""
    contacts = model.contacts

    def along(row: int) -> Array:
        own = contacts.joint == row
        if isinstance(contacts, FaceContacts):
            return np.asarray((contacts.origin[own] @ contacts.tangent[row].T).T)
        return np.asarray(contacts.arc[own][None])

    return widest_spacing(along(row) for row in range(len(model.interface)))


def _shortest(model: ZonedModel) -> float:
    """Shortest edge of a facet of the blocks' faces [m]."""
    if isinstance(model.sides, Sides):
        steps = np.diff(model.sides.arc)
        return float(steps[steps > 0.0].min())
    x = model.nodes.place[model.sides.node]
    return float(np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).min())
