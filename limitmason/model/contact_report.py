"""The contact report: which faces touch, which nearly do, what hangs on little, what a wider tolerance would add."""

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.geometry.contact import ContactRules
from limitmason.model.contact_warnings import length_text
from limitmason.model.face_touch import UntouchedFace
from limitmason.storage.frozen import ReadOnly

TINY = 0.1
"""A contact narrower than this fraction of the smaller block's width is tiny [-]."""

_SHOWN = 20  # rows of a table that a reader looks at
_FEW = 5  # rows of what a reader need not decide on


class ContactEntry(NamedTuple):
    """A contact of the model.

    Parameters
    ----------
    a, b : names of its blocks
    kind : "base", "bed", "head" or "crack"
    area : [m2]
    width : least width in its plane [m]
    gap : least and largest between the two faces [m], negative where they overlap; NaN where an interface made by hand
        lies on no face of one of its blocks
    angle_deg : between the two faces [deg], NaN as the gap
    place : its centroid [m], shape (3,)
    tiny : whether it is narrow beside its blocks, see :data:`TINY`
    """

    a: str
    b: str
    kind: str
    area: float
    width: float
    gap: tuple[float, float]
    angle_deg: float
    place: Array
    tiny: bool


class NearMiss(NamedTuple):
    """Two faces in doubt.

    Parameters
    ----------
    a, b : names of their blocks
    kind : as of a ``limitmason.geometry.contact.DoubtfulContact``, or "left out": faces that touch where the model has
        no interface
    gap : least and largest [m]
    angle_deg : between the faces [deg]
    area : that they have in common [m2]
    place : middle of that area [m], shape (3,)
    polygons : corners of the area's convex parts [m]
    """

    a: str
    b: str
    kind: str
    gap: tuple[float, float]
    angle_deg: float
    area: float
    place: Array
    polygons: list[Array]


class EdgeContact(NamedTuple):
    """Blocks that touch along an edge or at a corner only.

    No force passes there in this model.

    Parameters
    ----------
    a, b : names of the blocks
    kind : "edge" or "corner"
    place : where they touch [m], shape (3,)
    """

    a: str
    b: str
    kind: str
    place: Array


@dataclass(frozen=True, eq=False)
class ContactReport(ReadOnly):
    """What :meth:`limitmason.Assembly.contact_report` found.

    ``str`` makes a table of it.

    Parameters
    ----------
    n_blocks : of the assembly
    tolerance : gap up to which faces touch: least and largest over the blocks [m]
    rules : angles and width that hold
    contacts : every interface of the model
    near_misses : faces that may have been meant to touch: "apart", "opens", "turned" or "narrow" where the two blocks
        share no other contact, and "left out"
    kept : wedges that are contacts by a rule: "closed" or "in part"
    passed_over : other pairs of faces that were not made a contact: "narrow" or "turned" beside another contact, and
        "narrow" by a least width that was given
    edges : touching along an edge or at a corner only
    overlaps : names and depth beyond the tolerance [m]
    deepest_overlap : of faces in contact, within the tolerance [m]
    untouched : faces that touch nothing, the outer faces of a sound wall among them
    n_faces : of all blocks
    floating : blocks without a chain of contacts to a support, or without any contact where nothing is held
    hanging : free blocks whose only contact is tiny
    would_add : what is widened, and how many more pairs of faces would then be contacts
    looked_up_to : gap [m] and angle between faces [deg] up to which near misses were looked for
    """

    n_blocks: int
    tolerance: tuple[float, float]
    rules: ContactRules
    contacts: tuple[ContactEntry, ...]
    near_misses: tuple[NearMiss, ...]
    kept: tuple[NearMiss, ...]
    passed_over: tuple[NearMiss, ...]
    edges: tuple[EdgeContact, ...]
    overlaps: tuple[tuple[str, str, float], ...]
    deepest_overlap: float
    untouched: tuple[UntouchedFace, ...]
    n_faces: int
    floating: tuple[str, ...]
    hanging: tuple[str, ...]
    would_add: tuple[tuple[str, int], ...]
    looked_up_to: tuple[float, float]

    @property
    def tiny(self) -> tuple[ContactEntry, ...]:
        """Contacts that are short relative to their blocks."""
        return tuple(c for c in self.contacts if c.tiny)

    @property
    def decisions(self) -> tuple[str, ...]:
        """What a user should decide before trusting a multiplier.

        It is empty for a clean model.
        """
        out = []
        for rows, one, many in (
            (self.near_misses, "near miss", "near misses"),
            ([k for k in self.kept if k.kind == "in part"], "wedge kept in part", "wedges kept in part"),
            (self.overlaps, "overlap", "overlaps"),
            (self.floating, "floating block", "floating blocks"),
            (self.hanging, "block that hangs on one tiny contact", "blocks that hang on one tiny contact"),
        ):
            if rows:
                out.append(f"{len(rows)} {one if len(rows) == 1 else many}")
        return tuple(out)

    @property
    def tolerance_text(self) -> str:
        """Gap up to which faces touch, with its unit."""
        low, high = (length_text(t) for t in self.tolerance)
        return low if low == high else f"{low} to {high}"

    def __repr__(self) -> str:
        """One line."""
        verdict = ", ".join(self.decisions) or "nothing to decide"
        return f"<ContactReport: {len(self.contacts)} contacts of {self.n_blocks} blocks; {verdict}>"

    def __str__(self) -> str:
        """The whole report as text.

        Lengths in mm, places in m.
        """
        kinds = Counter(c.kind for c in self.contacts)
        lines = [
            f"{self.n_blocks} blocks, {len(self.contacts)} contacts"
            + (f" ({', '.join(f'{n} {k}' for k, n in sorted(kinds.items()))})" if kinds else ""),
            f"tolerance {self.tolerance_text}; angle {self.rules.angle_deg:g} degrees, wedges closed up to "
            f"{self.rules.wedge_deg:g} degrees",
            f"near misses looked for up to {length_text(self.looked_up_to[0])} and {self.looked_up_to[1]:g} degrees",
        ]
        if self.contacts:
            area = [c.area for c in self.contacts]
            lines.append(f"area {min(area):.3g} to {max(area):.3g} m2")
        if known := [c for c in self.contacts if not np.isnan(c.angle_deg)]:
            low, high = (1e3 * extreme(g for c in known for g in c.gap) for extreme in (min, max))
            angle = max(c.angle_deg for c in known)
            lines.append(f"gap {low:.2g} to {high:.2g} mm, angle up to {angle:.2g} degrees")
        if len(known) < len(self.contacts):
            lines.append(f"{len(self.contacts) - len(known)} contacts lie on no face of one of their blocks")
        if self.deepest_overlap > 0.0:
            lines.append(f"deepest overlap within the tolerance {1e3 * self.deepest_overlap:.2g} mm")
        lines += _doubt_rows("near misses: faces that may have been meant to touch", self.near_misses)
        lines += _doubt_rows("wedges kept as contacts", self.kept)
        tiny = [f"{c.a} | {c.b} | {1e3 * c.width:.3g} mm wide, {c.area:.3g} m2 | {_place(c.place)}" for c in self.tiny]
        lines += _rows("tiny contacts", tiny)
        lines += _rows("overlaps", [f"{a} | {b} | {1e3 * d:.3g} mm deep" for a, b, d in self.overlaps])
        lines += _rows("floating blocks: no chain of contacts to a support", list(self.floating))
        lines += _rows("blocks that hang on one tiny contact", list(self.hanging))
        edges = [f"{e.a} | {e.b} | {e.kind} | {_place(e.place)}" for e in self.edges]
        lines += _rows("edge and corner contacts: no force passes there", edges, shown=_FEW)
        lines += _doubt_rows("passed over: narrow, or turned beside another contact", self.passed_over, shown=_FEW)
        lines.append(f"{len(self.untouched)} of {self.n_faces} faces touch nothing (outer faces included)")
        if self.would_add:
            lines.append("more contacts with " + "; ".join(f"{what}: {count:+d}" for what, count in self.would_add))
        lines.append(f"to decide: {', '.join(self.decisions)}" if self.decisions else "nothing to decide")
        return "\n".join(lines)


def _place(place: Array) -> str:
    return f"at ({', '.join(f'{x:.4g}' for x in place)}) m"


def _rows(title: str, rows: list[str], *, shown: int = _SHOWN) -> list[str]:
    """A titled list in words, of at most ``shown`` rows."""
    if not rows:
        return []
    more = [f"  ... and {len(rows) - shown} more"] if len(rows) > shown else []
    return [f"{title} ({len(rows)})", *(f"  {r}" for r in rows[:shown]), *more]


def _doubt_rows(title: str, rows: tuple[NearMiss, ...], *, shown: int = _SHOWN) -> list[str]:
    """A titled list of near misses in words, of at most ``shown`` rows."""
    return _rows(title, [
        f"{d.a} | {d.b} | {d.kind} | gap {1e3 * d.gap[0]:.2g} to {1e3 * d.gap[1]:.2g} mm, {d.angle_deg:.2g} degrees, "
        f"{d.area:.3g} m2 | {_place(d.place)}" for d in rows
    ], shown=shown)
