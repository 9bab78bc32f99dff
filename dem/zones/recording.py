"""What a zoned run has written down and where it stands, in memory and in a file that another process goes on from."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dem.kernels.zone_plasticity import SHEAR_NOW, SHEAR_PAST, TENSION_NOW, TENSION_PAST
from dem.model.joint_marks import JointMarks, marks_of
from dem.stages.store import Samples
from dem.zones.running import Reading
from dem.zones.zoned_model import MOVING, ZonedModel
from limitmason.arrays import Array
from limitmason.storage.files import as_json, read_archive, write_archive

ELASTIC, AT_YIELD, YIELDED, TENSION = 0, 1, 2, 3
"""Marks of a zone: elastic, yields in shear now, yielded so before, failed in tension at any time."""


class ZoneState(NamedTuple):
    """Zones at a sample.

    Parameters
    ----------
    shift : displacements of all nodes [m], shape (n, 2)
    flags : of the stress points, shape (e, 4)
    plastic : accumulated length of the plastic strain, largest of each zone's points [-], shape (e,)
    """

    shift: Array
    flags: NDArray[np.int64]
    plastic: Array

    @property
    def marks(self) -> NDArray[np.int64]:
        """Mark of every zone from the flags of its stress points, shape (e,).

        Tension goes before shear, and now before past.
        """
        whole = np.bitwise_or.reduce(self.flags, axis=1)
        out = np.where(whole & SHEAR_PAST, YIELDED, ELASTIC)
        out = np.where(whole & SHEAR_NOW, AT_YIELD, out)
        return np.where(whole & (TENSION_NOW | TENSION_PAST), TENSION, out)


def save(path: str | Path, model: ZonedModel, same: Mapping[str, str], samples: Samples | None) -> None:
    """Write what a run changes of a model, and samples.

    The file is whole, or the one that was there before.

    Parameters
    ----------
    path : of the file
    model : the model where it stands
    same : what a run must have in common to go on from it, see :func:`dem.stages.resuming.signature`
    samples : what the run has written down so far; None for nothing
    """
    arrays: dict[str, Any] = {f"{k}.{name}": v for k in MOVING for name, v in getattr(model, k)._asdict().items()}
    arrays |= {f"sample.{k}": v for k, v in samples.arrays().items()} if samples is not None else {}
    write_archive(path, arrays | {"total": model.total, "same": as_json(dict(same))})


def read_model(path: Path, model: ZonedModel) -> dict[str, Any]:
    """Put a model where that of a file was, and return the samples kept with it.

    The model is changed. Samples are arrays by name.
    """
    file = read_archive(path)
    for group in MOVING:
        for name, array in getattr(model, group)._asdict().items():
            array[...] = file[f"{group}.{name}"]
    model.total[...] = file["total"]
    return file.group("sample")


def zoned_joint_marks(model: ZonedModel, now: Reading) -> JointMarks:
    """Marks per interface of the assembly, as those of rigid blocks.

    See :func:`dem.model.joint_marks.joint_marks`.

    ``now`` is what the model holds in its position.
    """
    p = model.contacts
    return marks_of(
        model.law[p.joint], model.interface[p.joint], len(model.assembly.interfaces), opening=now.opening,
        slip=np.abs(p.slip), normal=now.normal, shear=np.abs(now.shear), lift=p.lift, damage=p.damage, area=p.area,
    )


def zone_state(model: ZonedModel) -> ZoneState:
    """State of the zones now."""
    return ZoneState(model.nodes.shift.copy(), model.zones.flag.copy(), model.zones.plastic.max(axis=1))


def rigid_motion(model: ZonedModel) -> tuple[Array, Array]:
    """Rigid motion of all blocks that is nearest to that of their nodes.

    Returns
    -------
    shift : displacement of the centroids, x, y, z [m], shape (n, 3); y is 0
    quaternion : rotation, scalar first, shape (n, 4): a turn from x to z is one about -y
    """
    n, mesh = model.assembly.n_blocks, model.mesh
    count = np.bincount(mesh.block, minlength=n)
    place, shift = model.nodes.place, model.nodes.shift

    def mean(values: Array) -> Array:
        """Mean of values x, z at the nodes of every block, shape (n, 2)."""
        return np.column_stack([np.bincount(mesh.block, values[:, k], n) / count for k in range(2)])

    middle, mean_shift = mean(place), mean(shift)
    # the turn of least squares between the arms of the nodes before (r) and after (s), from x to z
    r = place - middle[mesh.block]
    s = r + shift - mean_shift[mesh.block]
    cross = np.bincount(mesh.block, r[:, 0] * s[:, 1] - r[:, 1] * s[:, 0], n)
    turn = np.arctan2(cross, np.bincount(mesh.block, (r * s).sum(axis=1), n))
    # nodes move about their own mean, which is off the block's centroid
    arm = model.assembly.centroids[:, [0, 2]] - middle
    less, sin = np.cos(turn) - 1.0, np.sin(turn)
    out = np.zeros((n, 3))
    out[:, 0] = mean_shift[:, 0] + less * arm[:, 0] - sin * arm[:, 1]
    out[:, 2] = mean_shift[:, 1] + less * arm[:, 1] + sin * arm[:, 0]
    quaternion = np.zeros((n, 4))
    quaternion[:, 0], quaternion[:, 2] = np.cos(0.5 * turn), -np.sin(0.5 * turn)
    return out, quaternion
