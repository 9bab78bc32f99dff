"""What tells one model from another: blocks, joints, supports, ties and materials, compared field by field."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Flags
from limitmason.errors import InputError
from limitmason.model.block import Block
from limitmason.model.interface import Interface
from limitmason.model.joint import Joint
from limitmason.model.joint_term import name_of
from limitmason.model.material import FRACTURE, Material
from limitmason.model.tie import Tie
from limitmason.storage.frozen import ReadOnly

Table = NDArray[Any]

ROUNDING = 1e-12
"""Difference of two numbers, over the largest of their field, that machines and libraries make of one model [-]."""

_CORNERS = ("shape", "polygon")


@dataclass(frozen=True, eq=False)
class Fingerprint(ReadOnly):
    """Content of an assembly as arrays.

    A file keeps them, and another model is compared with them.

    Labels of joints, materials and ties, the recipe and the rules of detection are no part of it: they change no
    answer.

    Parameters
    ----------
    arrays : by "what: field", a row per block, joint or tie; corners in a row, with their counts
    """

    arrays: Mapping[str, Table]

    @classmethod
    def of(
        cls, blocks: Sequence[Block], held: Table, joints: Sequence[Interface], ties: Sequence[Tie], ends: Table,
        tolerance: float,
    ) -> Fingerprint:
        """Fingerprint of what an assembly holds.

        The assembly keeps it as :attr:`Assembly.fingerprint`.

        Parameters
        ----------
        blocks : all n of them
        held : whether each degree of freedom of every block is held, shape (n, 6)
        joints : interfaces of the assembly
        ties : all t of them
        ends : blocks of every tie, -1 for the ground, shape (t, 2)
        tolerance : of contacts [m]
        """
        out: dict[str, Table] = {
            "block: name": np.array([b.name for b in blocks], dtype=str),
            "block: shape": _rows([b.vertices for b in blocks]),
            "block: number of vertices": np.array([len(b.vertices) for b in blocks]),
            "block: list of faces": np.array([repr([p.faces for p in b.parts]) for b in blocks], dtype=str),
            "block: density": np.array([b.density for b in blocks], dtype=float),
            "block: axis": np.array([[np.nan] * 3 if b.axis is None else b.axis for b in blocks]).reshape(-1, 3),
            "block: support": held.copy(),
            **_columns("block: material's ", Material, [b.material for b in blocks], FRACTURE),
            "joint: pair of blocks": np.array([(i.block_a, i.block_b) for i in joints], dtype=np.int64).reshape(-1, 2),
            "joint: polygon": _rows([i.polygon for i in joints]),
            "joint: number of corners": np.array([len(i.polygon) for i in joints], dtype=np.int64),
            "joint: normal": _rows([i.normal[None] for i in joints]),
            "joint: kind": np.array([i.kind for i in joints], dtype=str),
            **_columns("joint: ", Joint, [i.joint for i in joints], ("terms",)),
            **_term_columns([i.joint for i in joints]),
            "tie: pair of blocks": np.asarray(ends, dtype=np.int64).reshape(-1, 2),
            "tie: pair of ends": np.array([t.ends for t in ties]).reshape(-1, 6),
            "tie: strength": np.array([t.strength for t in ties], dtype=float),
            "tie: stiffness": np.array([t.axial_stiffness for t in ties], dtype=float),
            "model: tolerance": np.array([tolerance], dtype=float),
        }
        return cls(out)

    @property
    def digests(self) -> dict[str, str]:
        """Hash of each of "blocks", "materials", "supports", "joints" and "ties".

        Two models have equal hashes where all their numbers are equal to the last bit.
        """
        groups: dict[str, list[Table]] = {"blocks": [], "materials": [], "supports": [], "joints": [], "ties": []}
        for name, table in self.arrays.items():
            # "block: density" is of a block, and so on; supports and materials stand among the fields of blocks
            of, field = name.split(": ")
            group = "supports" if field == "support" else "materials" if field.startswith("material's") else f"{of}s"
            groups["blocks" if of == "model" else group].extend((np.array([name]), table))
        return {group: _digest(*tables) for group, tables in groups.items()}

    @property
    def digest(self) -> str:
        """Hash of all of it, 64 hexadecimal digits."""
        return _digest(np.array(list(self.digests.values())))

    def difference(self, then: Fingerprint) -> str:
        """First thing in which this model differs from another, in words.

        The text is empty where nothing differs by more than rounding.

        Parameters
        ----------
        then : of the model that is compared with
        """
        if missing := sorted(set(self.arrays) ^ set(then.arrays)):
            return f"the other one says {'no ' if missing[0] in self.arrays else ''}{missing[0]!r}"
        for name, what in (("block: name", "blocks"), ("joint: kind", "joints"), ("tie: strength", "ties")):
            if len(self.arrays[name]) != len(then.arrays[name]):
                return f"it has {len(self.arrays[name])} {what} and had {len(then.arrays[name])}"
        for name, now in self.arrays.items():
            was = then.arrays[name]
            of, field = name.split(": ")
            # where the numbers of corners differ, these are told below
            same = _same(now, was) if now.shape == was.shape else np.ones(0, dtype=bool)
            if same.all():
                continue
            # first row with a difference; corners have a row each, of which the block or joint is told
            k = int(np.argmin(same.reshape(len(now), -1).all(axis=1)))
            if field in _CORNERS:
                count = self.arrays[f"{of}: number of {'vertices' if of == 'block' else 'corners'}"]
                k = int(np.searchsorted(np.cumsum(count), k, side="right"))
            long = field in (*_CORNERS, "list of faces")
            values = "" if long else f" now ({_said(now[k])}), not {_said(was[k])}"
            return f"{self._named(of, k)} has another {field}{values}"
        return ""

    def _named(self, of: str, k: int) -> str:
        """Row k of the blocks, joints or ties in words.

        Parameters
        ----------
        of : "block", "joint", "tie" or "model"
        k : number of the row
        """
        names = self.arrays["block: name"]
        if of == "block":
            return f"block {str(names[k])!r}"
        if of == "model":
            return "it"
        a, b = self.arrays[f"{of}: pair of blocks"][k]
        return f"the {of} between {str(names[a])!r} and {repr(str(names[b])) if b >= 0 else 'the ground'}"

    def check_same(self, then: Fingerprint, what: str) -> None:
        """Refuse another model than the one that something belongs to.

        Parameters
        ----------
        then : of the model that it belongs to
        what : it is, such as "the state that start= gives"

        Raises
        ------
        InputError
            Naming the first block, joint or tie that differs, and its field.
        """
        if other := self.difference(then):
            raise InputError(f"{what} is of another model than the one given: {other}; give that model, or begin anew")


def check_same_loads(
    case: str, now: Table, then: Table, names: Sequence[str], what: str, counted: Table | None = None
) -> None:
    """Refuse other loads than those that act in a state.

    Parameters
    ----------
    case : "dead" or "live", for the message
    now, then : wrenches of all blocks and arms [N, N m], see ``Loads.rows``, shape (n, 15)
    names : of the blocks
    what : the state that the other loads act in, for the message
    counted : blocks whose loads count, shape (n, 1); all by default

    Raises
    ------
    InputError
        Naming the block.
    """
    scale = max(float(np.abs(then).max(initial=0.0)), 1e-300)
    off = np.abs(now - then) > ROUNDING * scale
    if counted is not None:
        off &= counted
    if off.any():
        i = int(np.flatnonzero(off.any(axis=1))[0])
        # equal wrenches, unequal arms
        if not off[i, :6].any():
            raise InputError(f"the {case} load of block {names[i]!r} acts at another point now than in {what}")
        here, there = (x[i, :6].tolist() for x in (now, then))
        raise InputError(f"the {case} load of block {names[i]!r} is {here} now and was {there} in {what}")


def _columns(
    prefix: str, kind: type[Joint] | type[Material], rows: Sequence[Any], without: Sequence[str]
) -> dict[str, Table]:
    """A column for every field of a law or material, its label left out.

    NaN stands for None, and choices are given by their number.

    Parameters
    ----------
    prefix : of the columns' names
    kind : class of the law or material, whose fields are read
    rows : the law or material of every row
    without : fields that are left out
    """
    out = {}
    distinct = {id(row): row for row in rows}
    for field in fields(kind):
        if field.name == "name" or field.name in without:
            continue
        value = {key: _number(None if row is None else getattr(row, field.name)) for key, row in distinct.items()}
        out[prefix + field.name] = np.array([value[id(row)] for row in rows], dtype=float)
    return out


def _term_columns(joints: Sequence[Joint]) -> dict[str, Table]:
    """A column for every number of the terms that joints have.

    It is NaN where a joint has no such term.
    """
    numbers = [{(name_of(t), f): v for t in joint.terms for f, v in t.numbers.items()} for joint in joints]
    return {
        f"joint: {name}'s {field}": np.array([own.get((name, field), np.nan) for own in numbers])
        for name, field in sorted({key for own in numbers for key in own})
    }


def _number(value: Any) -> float:
    """Value of a field as a number.

    A choice is its place among the choices, None is NaN.
    """
    if isinstance(value, StrEnum):
        return float(tuple(type(value)).index(value))
    return float("nan") if value is None else float(value)


def _rows(parts: Sequence[Table]) -> Table:
    """Tables of three columns one under the other, an empty one where there are none."""
    return np.concatenate(parts) if len(parts) else np.zeros((0, 3))


def _same(now: Table, was: Table) -> Flags:
    """Which entries of two tables of one shape are equal, but for rounding.

    NaN equals NaN. Rounding is measured by the largest finite entry of ``now``, and not of ``was``.
    """
    # words and whole numbers
    if now.dtype.kind != "f" or was.dtype.kind != "f":
        return np.asarray(now == was)
    largest = np.abs(now[np.isfinite(now)]).max(initial=0.0)
    # infinite strengths: their difference is NaN, and they are equal by ==
    with np.errstate(invalid="ignore"):
        near = np.abs(now - was) <= ROUNDING * largest
    return np.asarray(near | (now == was) | (np.isnan(now) & np.isnan(was)))


def _said(value: Any) -> str:
    """A value of a table in words: a number, a row of numbers or a word."""
    return f"{value:g}" if np.ndim(value) == 0 and isinstance(value, np.floating) else str(np.asarray(value).tolist())


def _digest(*parts: Table) -> str:
    """Hash of arrays by shape, type and value."""
    made = hashlib.sha256()
    for part in parts:
        plain = part + 0.0 if part.dtype.kind == "f" else part  # -0.0 is 0.0
        made.update(f"{plain.shape}{plain.dtype.str}".encode())
        made.update(np.ascontiguousarray(plain).tobytes())
    return made.hexdigest()
