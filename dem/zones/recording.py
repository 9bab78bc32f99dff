"""What a zoned run has written down and where it stands, in memory and in a file that another process goes on from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dem.joint_marks import JointMarks, PointMarks, marks_of
from dem.kernels.solid_arrays import RigidSolids
from dem.kernels.zone_arrays import Z_KINETIC, Zones
from dem.resuming import RunStatus
from dem.zone_marks import ZoneState
from dem.zones.running import Reading, read
from dem.zones.zoned_model import ZonedModel
from limitmason.storage.files import read_archive, write_archive

Array = NDArray[np.float64]

EVERY = 20
"""Samples between two checkpoints."""

_MOVING: Mapping[str, tuple[str, ...]] = {
    "nodes": ("shift", "velocity", "mass", "load", "force", "before", "held"),
    "zones": ("spent", "relief", "amplitude", "flag", "plastic"),
    "contacts": ("segment", "facet", "local", "slip", "lift", "damage"),
    "rigid": ("shift", "turn", "velocity", "mass", "load", "held", "drive", "before", "net", "total"),
}
"""Arrays that change, or that a solver of eigenvalues has made: of these a file holds what the model has."""


@dataclass
class Record:
    """Samples of a drive so far, and where it stands.

    Parameters
    ----------
    moved, load : displacement [m] and load beyond the settled one [N] at every sample
    kinetic, energy : kinetic energy over the work of the drive, and what does not balance of the work [-]
    marks, places, zones : of the joints, blocks and zones at every sample
    restless : kinetic over elastic energy at the last sample [-]
    seconds : that the run has taken [s]
    status, ended : how it has ended, and why where it did so early
    """

    moved: list[float] = field(default_factory=list)
    load: list[float] = field(default_factory=list)
    kinetic: list[float] = field(default_factory=list)
    energy: list[float] = field(default_factory=list)
    marks: list[JointMarks] = field(default_factory=list)
    places: list[tuple[Array, Array]] = field(default_factory=list)
    zones: list[ZoneState] = field(default_factory=list)
    restless: float = 0.0
    seconds: float = 0.0
    status: str = RunStatus.FINISHED
    ended: str = ""

    def sample(self, model: ZonedModel, at: float, load_now: float, kinetic: float, work: float) -> None:
        """Write down where a model stands; ``work`` is that of loads and supports so far, 0 before the drive."""
        now = read(model)
        rest = float(model.total[2:6].sum() + model.total[Z_KINETIC]) + now.energy
        self.moved.append(at)
        self.load.append(load_now)
        self.kinetic.append(kinetic)
        self.energy.append(abs(work - rest) / max(work, 1e-300) if work else 0.0)
        self.restless = float(model.total[Z_KINETIC]) / max(now.energy, 1e-300) if work else 0.0
        self.marks.append(zoned_joint_marks(model, now))
        self.places.append(rigid_motion(model))
        self.zones.append(zone_state(model))

    def arrays(self) -> dict[str, Array]:
        """All of it as arrays by name."""
        out = {name: np.array(getattr(self, name)) for name in ("moved", "load", "kinetic", "energy")}
        out |= {f"marks.{name}": np.stack([getattr(m, name) for m in self.marks]) for name in JointMarks._fields}
        out |= {"place": np.stack([p for p, _ in self.places]), "turn": np.stack([q for _, q in self.places])}
        out |= {f"zones.{k}": np.stack([getattr(z, k) for z in self.zones]) for k in ("shift", "flags", "plastic")}
        return out | {"restless": np.array(self.restless), "seconds": np.array(self.seconds)}

    @classmethod
    def from_arrays(cls, file: Mapping[str, Any]) -> "Record":
        """Inverse of :meth:`arrays`."""
        columns = {name: file[name].tolist() for name in ("moved", "load", "kinetic", "energy")}
        marks = [JointMarks(*rows) for rows in zip(*(file[f"marks.{k}"] for k in JointMarks._fields), strict=True)]
        places = list(zip(file["place"], file["turn"], strict=True))
        zones = [
            ZoneState(*rows) for rows in zip(*(file[f"zones.{k}"] for k in ("shift", "flags", "plastic")), strict=True)
        ]
        return cls(
            **columns, marks=marks, places=places, zones=zones, restless=float(file["restless"]),
            seconds=float(file["seconds"]),
        )  # fmt: skip


def _moving(model: ZonedModel) -> list[tuple[str, str]]:
    """Arrays of a model that change, by the group they stand in."""
    return [(k, name) for k, names in _MOVING.items() for name in names if name in getattr(model, k)._fields]


def save(path: Path, model: ZonedModel, same: Mapping[str, str], record: Record | None) -> None:
    """Write the moving part of a model, and a record; the file is whole, or the one that was there before.

    Parameters
    ----------
    same : what a run must have in common to go on from it, see :func:`dem.resuming.signature`
    """
    arrays: dict[str, Any] = {
        f"{group}.{name}": getattr(getattr(model, group), name) for group, name in _moving(model)
    }
    arrays |= {f"record.{k}": v for k, v in record.arrays().items()} if record is not None else {}
    write_archive(path, arrays | {
        "total": model.total, "same.names": np.array(list(same)), "same.digests": np.array(list(same.values())),
    })  # fmt: skip


def read_digests(path: Path) -> dict[str, str]:
    """What a run must have in common with that of a file; empty where it does not say so."""
    file = read_archive(path)
    names = ("same.names", "same.digests")
    return dict(zip(*(file[k].tolist() for k in names), strict=True)) if names[0] in file else {}


def read_model(path: Path, model: ZonedModel) -> Record | None:
    """Put a model where a file's was; the record that was kept with it."""
    file = read_archive(path)
    for group, name in _moving(model):
        getattr(getattr(model, group), name)[...] = file[f"{group}.{name}"]
    model.total[...] = file["total"]
    kept = {k.removeprefix("record."): v for k, v in file.items() if k.startswith("record.")}
    return Record.from_arrays(kept) if kept else None


def zoned_joint_marks(model: ZonedModel, now: Reading) -> JointMarks:
    """Marks per interface of the assembly, as :func:`dem.joint_marks.joint_marks` has them for rigid blocks."""
    p = model.contacts
    points = PointMarks(now.opening, _size(p.slip), now.normal, _size(now.shear), p.lift, p.damage, p.area)
    return marks_of(points, model.law[p.joint], model.interface[p.joint], len(model.assembly.interfaces))


def _size(values: Array) -> Array:
    """Size of what lies along a joint, shape (m,): of numbers in the plane, of pairs in space."""
    return np.abs(values) if values.ndim == 1 else np.linalg.norm(values, axis=1)


def zone_state(model: ZonedModel) -> ZoneState:
    """State of the zones now; those in space are elastic."""
    if not isinstance(model.zones, Zones):
        e = len(model.zones.kind)
        return ZoneState(model.nodes.shift.copy(), np.zeros((e, 1), np.int64), np.zeros(e))
    return ZoneState(model.nodes.shift.copy(), model.zones.flag.copy(), model.zones.plastic.max(axis=1))


def rigid_motion(model: ZonedModel) -> tuple[Array, Array]:
    """Displacement of the centroids [m] and quaternions of all blocks, nearest to their nodes' motion."""
    if model.space:
        return _motion_in_space(model)
    n, mesh = model.assembly.n_blocks, model.mesh
    count = np.bincount(mesh.block, minlength=n)
    place, shift = model.nodes.place, model.nodes.shift

    def mean(values: Array) -> Array:
        return np.column_stack([np.bincount(mesh.block, values[:, k], n) / count for k in range(2)])

    middle, mean_shift = mean(place), mean(shift)
    r = place - middle[mesh.block]
    s = r + shift - mean_shift[mesh.block]
    cross = np.bincount(mesh.block, r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0], n)
    turn = np.arctan2(cross, np.bincount(mesh.block, (r * s).sum(axis=1), n))
    arm = model.assembly.centroids[:, [0, 2]] - middle
    cos, sin = np.cos(turn) - 1.0, np.sin(turn)
    out = np.zeros((n, 3))
    out[:, 0] = mean_shift[:, 0] + cos * arm[:, 0] - sin * arm[:, 1]
    out[:, 2] = mean_shift[:, 1] + cos * arm[:, 1] + sin * arm[:, 0]
    quaternion = np.zeros((n, 4))
    quaternion[:, 0], quaternion[:, 2] = np.cos(0.5 * turn), -np.sin(0.5 * turn)
    return out, quaternion


def _motion_in_space(model: ZonedModel) -> tuple[Array, Array]:
    """As :func:`rigid_motion`; of a rigid block its own, of a zoned one the rotation nearest to its nodes' (Kabsch)."""
    assert isinstance(model.rigid, RigidSolids)
    mesh, shift = model.mesh, model.nodes.shift
    out, quaternion = np.zeros((model.assembly.n_blocks, 3)), np.zeros((model.assembly.n_blocks, 4))
    out[mesh.rigid], quaternion[mesh.rigid] = model.rigid.shift[:, :3], model.rigid.turn
    for block in np.flatnonzero(~mesh.rigid):
        own = mesh.block == block
        place = mesh.place[own]
        middle, mean = place.mean(axis=0), shift[own].mean(axis=0)
        r = place - middle
        turn, _ = Rotation.align_vectors(r + shift[own] - mean, r)
        arm = model.assembly.centroids[block] - middle
        out[block] = mean + turn.apply(arm) - arm
        quaternion[block] = turn.as_quat(canonical=True)[[3, 0, 1, 2]]
    return out, quaternion
