"""Forces by name: resultants of joints and ties, and what the structure puts on its supports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Flags
from limitmason.checks import instance
from limitmason.display.notebook import html_table
from limitmason.display.text_table import abridged
from limitmason.errors import InputError
from limitmason.mechanics.law import interface_law
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import Tabular, table_text, write_table

COLUMNS: Mapping[str, str] = {
    "kind": "-", "name": "-", "fx": "N", "fy": "N", "fz": "N", "normal": "N", "shear": "N",
    "x": "m", "y": "m", "z": "m", "eccentricity": "m", "strength_used": "-",
}
"""Columns of a table of forces, with their units."""


_CARRIES = 1e-4
"""Part of the largest joint force above which an interface counts as carrying any [-]: chosen."""

_AT_LIMIT = 0.999
"""Part of its shear strength at which an interface counts as at its friction limit [-]: chosen."""

_NO_FORCE = 1e-9
"""Part of the largest joint force that counts as none [-]: rounding."""


class JointForces(NamedTuple):
    """Resultants of k interfaces."""

    force: Array  # on block b, in global axes [N], (k, 3)
    centre: Array  # the point it passes through [m], (k, 3)
    carries: Flags  # which interfaces bear more than next to nothing, (k,)
    at_friction_limit: Flags  # (k,)
    normal: Array  # compression positive [N], (k,)
    shear: Array  # size of the tangential part [N], (k,)
    strength: Array  # in shear, c A + N tan(phi) [N], (k,)


def joint_forces(model: Assembly, prediction: Prediction) -> JointForces:
    """Resultant and centre of pressure of every interface.

    x_c = sum N x / sum N over its contact points.

    Parameters
    ----------
    model : what was solved
    prediction : its answer with resultants

    Returns
    -------
    JointForces
        ``at_friction_limit`` where the shear reaches 99.9 % of c A + N tan(phi). An interface whose normal force is
        nil or tensile has its centroid as centre.

    Raises
    ------
    InputError
        When the prediction has no resultants, or those of another assembly.
    """
    r = instance("prediction", prediction, Prediction, "of lm.limit_analysis, lm.predict ...").resultants
    if r is None:
        raise InputError(
            f"this prediction ({prediction.method}) has no joint forces: its status is '{prediction.status}'"
        )
    x, k = model.arrays, len(model.interfaces)
    owner = np.asarray(r.point_interface, dtype=np.intp)
    # some methods tell nothing of ties. A support that settles is solved without the joints between held blocks
    if len(r.normal) not in (k, k + len(model.ties)):
        raise InputError(
            f"this prediction ({prediction.method}) has forces of {len(r.normal)} joints and ties, the assembly has "
            f"{k} joints and {len(model.ties)} ties: give the structure that was solved, prediction.structure"
        )
    faces = owner < k  # the ties are numbered after them
    owner, point_force = owner[faces], r.point_force[faces]
    force = np.zeros((k, 3))
    np.add.at(force, owner, point_force)
    # only what presses counts for the centre
    pressure = np.maximum(np.einsum("ij,ij->i", point_force, x.normal[owner]), 0.0)
    total = np.bincount(owner, pressure, k)
    moment = np.stack([np.bincount(owner, pressure * r.point_position[faces, i], k) for i in range(3)], axis=1)
    size = np.linalg.norm(force, axis=1)
    largest = float(size.max(initial=0.0))
    pressed = total > _NO_FORCE * max(largest, 1e-300)
    centre = np.where(pressed[:, None], moment / np.where(pressed, total, 1.0)[:, None], x.centre)
    normal = np.einsum("ij,ij->i", force, x.normal)
    shear = np.linalg.norm(force - normal[:, None] * x.normal, axis=1)
    strength = interface_law(x).over(x.area).shear_strength(normal)
    carries = size > _CARRIES * largest
    at_limit = carries & (shear >= _AT_LIMIT * strength - _NO_FORCE * largest)
    return JointForces(force, centre, carries, at_limit, normal, shear, strength)


@dataclass(frozen=True, eq=False)
class ForceTable(Tabular):
    """Joint forces and support reactions of an answer, a row each.

    Ordered as joints, ties and supports.

    Parameters
    ----------
    rows : cells in the order of ``COLUMNS``, None where one has no meaning. Of a joint "a|b": force on b, its normal
        part (compression positive) and shear, the centre of pressure, its distance from the middle of the face, and
        shear over c A + N tan(phi). Of a tie: the pull at its end a, and its part of the strength. Of a support: the
        force with which joints and ties press on the block, opposite to what the ground supplies beside the block's own
        load, and the point of its line nearest to the centroid
    """

    rows: tuple[tuple[Any, ...], ...]

    def to_csv(self, path: str | Path) -> None:
        """Write the table with its units to a file."""
        write_table(path, COLUMNS, self._text())

    def tabulated(self) -> tuple[Mapping[str, str], list[Sequence[Any]]]:
        """Columns with their units, and the rows."""
        return COLUMNS, list(self.rows)

    def __str__(self) -> str:
        rows, cut = abridged(self._text())
        return table_text(COLUMNS, rows) + "".join(f"# {c}: to_csv and to_dataframe have them\n" for c in cut)

    def _repr_html_(self) -> str:
        """The table as a notebook shows it."""
        head = [name if unit == "-" else f"{name} [{unit}]" for name, unit in COLUMNS.items()]
        rows, cut = abridged(self._text(6))
        return html_table(head, rows, [f"{c}: to_csv and to_dataframe have them" for c in cut])

    def _text(self, digits: int = 9) -> list[list[str]]:
        """Cells as text, numbers to so many digits and those without a meaning empty."""
        return [[f"{c:.{digits}g}" if isinstance(c, float) else c or "" for c in row] for row in self.rows]


def force_table(answer: Prediction, assembly: Assembly | None = None) -> ForceTable:
    """Resultants of all joints, ties and supports of an answer, by name.

    Parameters
    ----------
    answer : with joint forces
    assembly : that was solved; by default the one that the answer carries

    Raises
    ------
    InputError
        For an answer without joint forces, and one that does not carry its structure where none is given.

    Notes
    -----
    Joint forces of limit analysis are one admissible state of many: a row is no measure of what a joint really carries.
    The share of strength is that of friction and cohesion; rocking shows in the eccentricity.
    """
    instance("answer", answer, Prediction, "of lm.limit_analysis, lm.predict ...")
    model = answer.structure if assembly is None else assembly
    if model is None:
        raise InputError(f"this prediction ({answer.method}) does not carry its structure: give the assembly")
    joints, x, r = joint_forces(model, answer), model.links, answer.resultants
    assert r is not None
    rows: list[tuple[Any, ...]] = []
    along, shear, strength = joints.normal, joints.shear, joints.strength
    least = _NO_FORCE * np.abs(joints.force).max(initial=0.0)
    for k, name in enumerate(model.joint_names):
        # shear without any strength has no share of it: a tensile joint beyond the apex of its cone
        used = float(shear[k] / strength[k]) if strength[k] > least else None if shear[k] > least else 0.0
        off = float(np.linalg.norm(joints.centre[k] - model.arrays.centre[k]))
        # fx, fy, fz, normal, shear, x, y, z, eccentricity, strength_used
        row = (*map(float, joints.force[k]), float(along[k]), float(shear[k]), *map(float, joints.centre[k]), off, used)
        rows.append(("joint", name, *row))
    owner = np.asarray(r.point_interface, dtype=np.intp)
    for t, tie in enumerate(model.ties):
        k = len(model.interfaces) + t
        pull = -r.point_force[owner == k].sum(axis=0)  # of block b on a: a tie presses where its ends part
        size = float(np.linalg.norm(pull))
        ends = [model.blocks[i].name for i in (x.block_a[k], x.block_b[k])]
        part = size / float(x.compressive_strength[k])  # among the links a tie's strength [N] stands there
        row = (*map(float, pull), size, 0.0, *map(float, tie.ends[0]), None, part)
        rows.append(("tie", tie.name or "~".join(ends), *row))
    for i in np.flatnonzero(model.held.any(axis=1)):
        sign = (x.block_b[owner] == i).astype(float) - (x.block_a[owner] == i)
        force = sign[:, None] * r.point_force
        total = force.sum(axis=0)
        moment = np.cross(r.point_position - model.centroids[i], force).sum(axis=0)
        # the resultant's line is nearest to the centroid at F x M / |F|^2 from it
        square = float(total @ total)
        foot = model.centroids[i] + (np.cross(total, moment) / square if square > 0.0 else 0.0)
        off = float(np.linalg.norm(foot - model.centroids[i]))
        rows.append(("support", model.blocks[i].name, *map(float, total), None, None, *map(float, foot), off, None))
    return ForceTable(tuple(rows))
