"""Archives of runs: written whole or not at all, what they keep of joints, and files of 0.1."""

import os
from collections.abc import Mapping
from dataclasses import fields
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem import kernels
from limitmason.model import Assembly, Joint

Array = NDArray[np.float64]

JOINT_FIELDS = tuple(f.name for f in fields(Joint) if f.name != "name")


def joint_row(joint: Joint) -> Array:
    """What a joint says, shape (len(JOINT_FIELDS),): NaN for None, choices by their number."""

    def number(value: Any) -> float:
        if isinstance(value, StrEnum):
            return float(tuple(type(value)).index(value))
        return np.nan if value is None else float(value)

    return np.array([number(getattr(joint, name)) for name in JOINT_FIELDS])


def joint_table(assembly: Assembly) -> Array:
    """What the joint of every interface says, see :func:`joint_row`, shape (k, len(JOINT_FIELDS))."""
    joints = [i.joint for i in assembly.interfaces]
    # a wall has hundreds of interfaces and a few joints
    row = {number: joint_row(joint) for number, joint in {id(j): j for j in joints}.items()}
    return np.array([row[id(j)] for j in joints]).reshape(-1, len(JOINT_FIELDS))


def write_archive(path: str | Path, arrays: Mapping[str, Array]) -> None:
    """Write arrays to a numpy archive; the file is whole or the old one, also when the process dies on the way."""
    path = Path(path)
    beside = path.with_name(path.name + ".part")
    with open(beside, "wb") as file:
        np.savez(file, **arrays)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def law_of_0_1(law: Array) -> Array:
    """Law rows as now, of a file of 0.1 too: there one damage per opening or slip, and no secant."""
    more = kernels.LAW_SIZE - law.shape[1]
    if more <= 0:
        return law
    law = np.hstack([law, np.zeros((len(law), more))])
    law[:, kernels.LAW_RATE_SLIP] = law[:, kernels.LAW_RATE]
    return law


def table_of_0_1(table: Array) -> Array:
    """What joints say as now, of a file of 0.1 too: what it does not know is as it is where nothing is said."""
    nothing = joint_row(Joint(0.0))
    return np.hstack([table, np.tile(nothing[table.shape[1] :], (len(table), 1))])
