"""What a zoned run has written down and where it stands, in memory and in a file that another process goes on from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.joint_marks import JointMarks
from dem.kernels.solid_arrays import FaceContacts
from dem.resuming import RunStatus, check_same, digest
from dem.zones.marks import zone_marks
from dem.zones.solid_mesh import SolidMesh
from dem.zones.zoned_model import ZonedModel
from limitmason.errors import InputError
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


class ZoneState(NamedTuple):
    """Zones at a sample: displacements of all nodes [m], shape (n, 2) or (n, 3); flags of the stress points, shape
    (e, 4), in space a zero for each zone; accumulated length of the plastic strain, largest of each zone's points [-],
    shape (e,).
    """

    shift: Array
    flags: NDArray[np.int64]
    plastic: Array

    @property
    def marks(self) -> NDArray[np.int64]:
        """Mark of every zone, see :func:`dem.zones.marks.zone_marks`."""
        return zone_marks(self.flags)


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


def signature(model: ZonedModel, **settings: Any) -> dict[str, str]:
    """What a run must have in common with the one it goes on from, as a digest by name.

    Parameters
    ----------
    settings : of the run, by the names a user gave them
    """
    mesh, c = model.mesh, model.contacts
    thickness = () if isinstance(mesh, SolidMesh) else (mesh.thickness,)
    on_a = (c.origin, c.tangent) if isinstance(c, FaceContacts) else (c.side, c.arc)
    parts = {
        "zones": (mesh.place, mesh.zones, *thickness, mesh.rigid),
        "materials": tuple(model.tables),
        "joints": (model.law, model.interface),
        "contact points": (c.joint, *on_a, c.node, c.share, c.area, c.gap),
        "loads": (model.nodes.load, model.rigid.load),
    }
    out, whole = {}, model.assembly.fingerprint.digests
    for name, arrays in parts.items():
        out[name] = digest(whole.pop(name, "").encode(), *(np.ascontiguousarray(v).tobytes() for v in arrays))
    return out | whole | {name: digest(repr(value).encode()) for name, value in settings.items()}


def _moving(model: ZonedModel) -> list[tuple[str, str]]:
    """Arrays of a model that change, by the group they stand in."""
    return [(k, name) for k, names in _MOVING.items() for name in names if name in getattr(model, k)._fields]


def save(path: Path, model: ZonedModel, same: Mapping[str, str], record: Record | None, **numbers: float) -> None:
    """Write the moving part of a model, and a record; the file is whole, or the one that was there before.

    Parameters
    ----------
    same : from :func:`signature`
    numbers : to be handed back by :func:`load`
    """
    arrays: dict[str, Any] = {
        f"{group}.{name}": getattr(getattr(model, group), name) for group, name in _moving(model)
    }
    arrays |= {f"record.{k}": v for k, v in record.arrays().items()} if record is not None else {}
    write_archive(path, arrays | {f"number.{k}": np.array(v) for k, v in numbers.items()} | {
        "total": model.total, "same.names": np.array(list(same)), "same.digests": np.array(list(same.values())),
    })  # fmt: skip


def load(path: Path, model: ZonedModel, same: Mapping[str, str]) -> tuple[Record | None, dict[str, float]]:
    """Put a model where a file's was; the record and the numbers that were kept with it.

    Raises
    ------
    InputError
        For a file of another kind, and one of another model or run, naming what differs.
    """
    file = read_archive(path)
    if "same.names" not in file:
        raise InputError(f"{path} is no checkpoint of zoned blocks: give another file")
    then = dict(zip(file["same.names"].tolist(), file["same.digests"].tolist(), strict=True))
    check_same(path, then, same)
    for group, name in _moving(model):
        getattr(getattr(model, group), name)[...] = file[f"{group}.{name}"]
    model.total[...] = file["total"]
    kept = {k.removeprefix("record."): v for k, v in file.items() if k.startswith("record.")}
    numbers = {k.removeprefix("number."): float(v) for k, v in file.items() if k.startswith("number.")}
    return (Record.from_arrays(kept) if kept else None), numbers
