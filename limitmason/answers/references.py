"""The papers behind an answer: theory, method, solver and data, as text and as BibTeX.

Methods, solvers and packaged experiments declare their own; answers carry them along, and ``cite()`` lists them. What a
source does not give (authors, volume, DOI) is left out, never filled in.
"""

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any, NamedTuple, Self

from limitmason.checks import choice
from limitmason.constants import VERSION
from limitmason.errors import InputError

THEORY, METHOD, SOLVER, DATA, PROGRAM = ROLES = ("theory", "method", "solver", "data", "program")
"""What a paper is cited for, in the order in which a citation lists them."""

_HOUSE = {
    "article": "journal", "book": "publisher", "inproceedings": "booktitle", "manual": "organization",
    "misc": "howpublished", "phdthesis": "school", "techreport": "institution",
}
"""Kinds of BibTeX, and the field in which each says where the work was published."""


@dataclass(frozen=True)
class Reference:
    """A paper, book, thesis, data set or program.

    Parameters
    ----------
    key : of BibTeX, one for each reference: "gilbert2006"
    kind : of BibTeX: "article", "book", "inproceedings", "manual", "misc", "phdthesis", "techreport"
    title : of the work
    authors : as "Surname, A. B."; without a comma a name is taken as it stands (a body, a project); empty where the
        sources at hand do not give them
    year : None where it is not known
    published_in : journal, proceedings, school or publisher
    volume : as text, empty where it is not known
    number : as text, empty where it is not known
    pages : as text, empty where they are not known
    doi : without the address of the resolver, empty where it is not known
    url : empty where it is not known
    note : what a reader of the list must know, such as what is missing

    Raises
    ------
    InputError
        For a key that BibTeX could not read, an unknown kind, no title, and authors in one text.
    """

    key: str
    kind: str
    title: str
    authors: tuple[str, ...] = ()
    year: int | None = None
    published_in: str = ""
    volume: str = ""
    number: str = ""
    pages: str = ""
    doi: str = ""
    url: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """Check what BibTeX would stumble over, and take lists for tuples.

        JSON has no tuples.
        """
        if not self.key or not all(c.isascii() and (c.isalnum() or c in "-_:") for c in self.key):
            raise InputError(f"the key of a reference is letters, digits, '-', '_' and ':', got {self.key!r}")
        choice(f"reference {self.key!r}: kind", self.kind, tuple(_HOUSE))
        if not self.title:
            raise InputError(f"reference {self.key!r} has no title")
        if isinstance(self.authors, str):
            raise InputError(f"reference {self.key!r}: authors are a list of names, write [{self.authors!r}]")
        object.__setattr__(self, "authors", tuple(self.authors))

    def __str__(self) -> str:
        """One line for a list of references."""
        names = ", ".join(a.replace(", ", " ", 1).replace(". ", ".") for a in self.authors)  # "Surname A.B."
        # without a year a colon ends the names; without both the title begins the line
        head = f"{names} ({self.year})".strip() if self.year else names and f"{names}:"
        volume = self.volume + (f"({self.number})" if self.number else "")
        published = " ".join(p for p in (self.published_in, volume) if p)
        house = ", ".join(p for p in (published, self.pages) if p)
        where = f"doi {self.doi}" if self.doi else self.url
        parts = [p for p in (f"{head} {self.title}".strip(), house, where) if p]
        return ". ".join(parts) + (f" [{self.note}]" if self.note else "")

    @property
    def bibtex(self) -> str:
        """The entry for a .bib file in UTF-8."""
        # braces keep a body from being taken apart as a name, and capitals of a title from being made small
        authors = " and ".join(a if ", " in a else "{" + a + "}" for a in self.authors)
        rows = {
            "author": authors, "title": "{" + self.title + "}", "year": str(self.year or ""),
            _HOUSE[self.kind]: self.published_in, "volume": self.volume, "number": self.number,
            "pages": re.sub("[-–]+", "--", self.pages),
        }
        given = [f"  {name} = {{{_escaped(text)}}}" for name, text in rows.items() if text]
        # addresses are read as they stand, without escapes
        given += [f"  {name} = {{{text}}}" for name, text in (("doi", self.doi), ("url", self.url)) if text]
        given += [f"  note = {{{_escaped(self.note)}}}"] if self.note else []
        return f"@{self.kind}{{{self.key},\n" + ",\n".join(given) + "\n}"


def given_fields(reference: Reference) -> dict[str, Any]:
    """Fields of a reference that have a value, as plain data for a file."""
    values = {f.name: getattr(reference, f.name) for f in fields(reference)}
    return {k: list(v) if isinstance(v, tuple) else v for k, v in values.items() if v not in ("", None, ())}


def _escaped(text: str) -> str:
    """Text in which the signs that TeX takes for its own are escaped."""
    for sign in "&%#_$":
        text = text.replace(sign, "\\" + sign)
    return text


class Cited(NamedTuple):
    """A reference and what it is cited for, one of ``ROLES``."""

    role: str
    reference: Reference


@cache
def _papers() -> dict[str, Reference]:
    """Papers behind the methods of this package, ``papers.json``, by key."""
    rows = json.loads((files(__package__) / "papers.json").read_text(encoding="utf-8"))
    return {row["key"]: Reference(**row) for row in rows}


def cited(role: str, *keys: str) -> tuple[Cited, ...]:
    """Papers of ``papers.json`` by their keys, cited for one of ``ROLES``."""
    return tuple(Cited(role, _papers()[key]) for key in keys)


class Citation(tuple[Cited, ...]):
    """What to cite for an answer: a list by role that prints as text.

    ``bibtex`` is the same for a .bib file.

    Parameters
    ----------
    cited : in any order; what is named twice for the same role is listed once

    Raises
    ------
    InputError
        Where two different references have one key, and for an unknown role.
    """

    def __new__(cls, cited: Iterable[Cited]) -> Self:
        """Order what is ``cited`` by role, and drop what is there twice."""
        rows = list(dict.fromkeys(Cited(*c) for c in cited))
        by_key: dict[str, Reference] = {}
        for role, reference in rows:
            if role not in ROLES:
                raise InputError(f"{reference.key!r}: a reference is cited for {', '.join(ROLES)}, not for {role!r}")
            if by_key.setdefault(reference.key, reference) != reference:
                raise InputError(f"two references have the key {reference.key!r}")
        return super().__new__(cls, sorted(rows, key=lambda c: ROLES.index(c.role)))

    def _lines(self) -> list[tuple[str, Reference]]:
        """Every reference once, with all that it is cited for."""
        return [(", ".join(c.role for c in self if c.reference == r), r) for r in self.references]

    @property
    def references(self) -> tuple[Reference, ...]:
        """Each reference once."""
        return tuple(dict.fromkeys(c.reference for c in self))

    @property
    def keys(self) -> tuple[str, ...]:
        """Their BibTeX keys."""
        return tuple(r.key for r in self.references)

    @property
    def bibtex(self) -> str:
        """Entries for a .bib file in UTF-8."""
        return "\n\n".join(r.bibtex for r in self.references) + "\n"

    def __str__(self) -> str:
        """One reference per line, after what it is cited for."""
        return "\n".join(f"{role}: {reference}" for role, reference in self._lines())

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """The list, and the BibTeX entries to unfold."""
        rows = "".join(f"<tr><td>{role}</td><td>{escape(str(r))}</td></tr>" for role, r in self._lines())
        return f"<table>{rows}</table><details><summary>BibTeX</summary><pre>{escape(self.bibtex)}</pre></details>"


LIMITMASON = Cited(
    PROGRAM, Reference("limitmason", "misc", f"limitmason {VERSION}", ("The limitmason developers",), note="software")
)
"""This program itself; see CITATION.cff."""

_data: list[Callable[[str], tuple[Cited, ...]]] = []


def data_by(find: Callable[[str], tuple[Cited, ...]]) -> None:
    """Say who knows the papers of a packaged source by its name.

    The packaged experiments do so once, as answers must not know them.
    """
    _data[:] = [find]


def data_behind(recipe: Mapping[str, Any]) -> tuple[Cited, ...]:
    """Papers of the data that an assembly was built from.

    They are empty where its ``recipe`` names no packaged source.
    """
    name = recipe.get("source")
    return _data[0](name) if _data and isinstance(name, str) else ()


class Citable:
    """An answer with ``references`` of what it rests on."""

    references: tuple[Cited, ...]

    def cite(self) -> Citation:
        """The papers behind this answer: theory, method, solver, data, and this program.

        ``cite().bibtex`` gives them as BibTeX. Methods, solvers and packaged experiments declared them. A structure of
        one's own adds nothing.
        """
        return Citation((*self.references, LIMITMASON))
