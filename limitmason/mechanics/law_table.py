"""Which theory takes which term of the joint law: one table, which refuses, warns and is docs/laws.md."""

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.display.text_table import markdown
from limitmason.errors import NotApplicable
from limitmason.mechanics.law import above_apex
from limitmason.model.assembly import Assembly

Index = NDArray[np.intp]

LEAST_FRICTION = 1e-6
"""tan(phi) below which a joint counts as frictionless for a method that divides by it."""


class Taken(StrEnum):
    """What a theory does with a term of the law."""

    TAKEN = "taken"
    PLASTIC = "perfectly plastic"
    LEFT_OUT = "left out, says so"
    REFUSED = "refused"


class Term(NamedTuple):
    """A term of the joint law: in the words of a table, in those of a refusal ("the joint ... "), and who has it."""

    name: str
    words: str
    in_joints: Callable[[Assembly], NDArray[np.bool_]]  # which interfaces have it, shape (k,)


class Cell(NamedTuple):
    """What a theory does with a term.

    Parameters
    ----------
    how : taken, perfectly plastic, left out or refused
    why : why it is refused, or a remark for the table
    remedy : what to do where it is refused
    says : warning of a prediction whose joints have the term; empty for none
    """

    how: Taken
    why: str = ""
    remedy: str = ""
    says: str = ""


def _crushes(assembly: Assembly) -> NDArray[np.bool_]:
    return np.isfinite(assembly.arrays.compressive_strength)


_FC = "has a finite compressive strength"
DILATANCY = Term(
    "dilatancy psi < phi", "dilates less than its friction",
    lambda a: a.arrays.tan_psi < a.arrays.tan_phi,
)  # fmt: skip
COHESION = Term("cohesion", "has cohesion", lambda a: a.arrays.cohesion > 0.0)
TENSION = Term("tensile strength", "has tensile strength", lambda a: a.arrays.tensile_strength > 0.0)
ABOVE_APEX = Term(
    "tension above the apex, ft > c / tan(phi)", "has more tensile strength than c / tan(phi)",
    lambda a: above_apex(a.arrays),
)  # fmt: skip
CRUSHING = Term("crushing, at points of a grid", _FC, _crushes)
STRESS_BLOCK = Term("crushing, in-plane sections by their ends", _FC, _crushes)
CORNER_CRUSHING = Term("crushing, faces in space by their corners", _FC, _crushes)
RESIDUAL = Term(
    "softening to residual values", "has residual values or a fracture energy",
    lambda a: np.array([i.joint.softens for i in a.interfaces], dtype=bool),
)  # fmt: skip
SMOOTH = Term("no friction", "has no friction", lambda a: a.arrays.tan_phi <= LEAST_FRICTION)
TIES = Term(
    "ties: rods, anchors, ring beams", "yields",
    lambda a: np.repeat([False, True], [len(a.interfaces), len(a.ties)]),
)  # fmt: skip
TERMS = (DILATANCY, COHESION, TENSION, ABOVE_APEX, CRUSHING, STRESS_BLOCK, CORNER_CRUSHING, RESIDUAL, SMOOTH, TIES)

ASSOCIATIVE, NON_ASSOCIATIVE, DEM, MECHANISMS = "associative", "non-associative", "dem", "mechanisms"
PUSHOVER = "pushover"
PROVEN_SMALLEST, PROVEN_RANGE = "prove=True", "proven range"
INTERIOR_POINT = "interior-point"
THEORIES: Mapping[str, str] = {
    ASSOCIATIVE: "limit analysis, associative",
    NON_ASSOCIATIVE: "limit analysis, non-associative",
    PROVEN_SMALLEST: "non-associative with prove=True",
    PROVEN_RANGE: "proven_range",
    INTERIOR_POINT: "solver='interior-point'",
    DEM: "distinct elements",
    PUSHOVER: "capacity curve",
    MECHANISMS: "analytical mechanisms",
}
"""Theories and solvers by name, as a reader knows them."""

_TAKEN = Cell(Taken.TAKEN)
_AT_CORNERS = Cell(
    Taken.REFUSED, "points at the corners cannot represent (they would only crush at half the full load)",
    "use contact_model='grid' with grid=(8, 8) or finer",
)  # fmt: skip
_ASSOCIATIVE_PLASTIC = Cell(
    Taken.PLASTIC, says="tension and cohesion are taken as perfectly plastic: a section carries ft A L / 2, three "
    "times the elastic-brittle ft A L / 6; where ft > c / tan(phi) the apex of the Coulomb cone governs",
)  # fmt: skip
_NON_ASSOCIATIVE_PLASTIC = Cell(
    Taken.PLASTIC, says="tension and cohesion are taken as perfectly plastic, and dilatancy goes on with any slip"
)
_NO_SOFTENING = Cell(
    Taken.LEFT_OUT, says="residual values of the joints are left out: joints keep their peak strength at any slip and "
    "opening, so joints that soften carry less; the DEM follows them",
)  # fmt: skip
_NO_BLOCK = Cell(
    Taken.REFUSED, "non-associative analysis cannot follow at joints that dilate less than their friction: it has no "
    "exact crushing stress block",
    "use contact_model='grid', which limits the normal force of every contact point",
)  # fmt: skip
_NO_PROOF = Cell(
    Taken.REFUSED, "a proof does not take: where joints crush the smallest multiplier can only be searched for",
    "use lm.limit_analysis(..., flow_rule='non-associative') without prove=True",
)  # fmt: skip
_CUT = Cell(
    Taken.LEFT_OUT, "the law must be convex: tension is cut at the apex of the Coulomb cone, and the answer says which "
    "joint and from which strength",
)  # fmt: skip
_TIES_PLASTIC = Cell(
    Taken.PLASTIC, "tension only, up to the least of yield, bond and anchor plate, with any elongation",
    says="ties yield at their strength with any elongation: where bond or an anchor plate governs that is assumed",
)  # fmt: skip
_NO_TIES = Cell(
    Taken.REFUSED, "a proof does not take: with ties the smallest multiplier can only be searched for",
    "use lm.limit_analysis(..., flow_rule='non-associative') without prove=True",
)  # fmt: skip
_BY_POINTS = Cell(Taken.TAKEN, "at its contact points, like all others")
_BEYOND_APEX = Cell(Taken.TAKEN, "a point beyond the apex carries tension up to ft and no shear")
_CLOSED_FORM = Cell(
    Taken.LEFT_OUT, "by closed forms; a motion that is admissible on the blocks is charged with their power",
    says="cohesion, tension and crushing of the joints are left out by this closed form",
)  # fmt: skip
_CLOSED_FORM_CRUSHING = _CLOSED_FORM._replace(
    why="an upper bound stays one: a motion that opens every joint crushes nothing"
)

TAKES: Mapping[str, Mapping[Term, Cell]] = {
    ASSOCIATIVE: {
        DILATANCY: Cell(Taken.LEFT_OUT, "psi = phi is taken, and the bound says so"),
        COHESION: _ASSOCIATIVE_PLASTIC, TENSION: _ASSOCIATIVE_PLASTIC, ABOVE_APEX: _CUT,
        CRUSHING: Cell(Taken.TAKEN, "errs on the high side; says what half as many points give"),
        STRESS_BLOCK: Cell(Taken.TAKEN, "exact"),
        CORNER_CRUSHING: _AT_CORNERS, RESIDUAL: _NO_SOFTENING, SMOOTH: _TAKEN, TIES: _TIES_PLASTIC,
    },
    NON_ASSOCIATIVE: {
        DILATANCY: Cell(Taken.TAKEN, "goes on with any slip"),
        COHESION: _NON_ASSOCIATIVE_PLASTIC, TENSION: _NON_ASSOCIATIVE_PLASTIC, ABOVE_APEX: _CUT,
        CRUSHING: Cell(Taken.TAKEN, "errs on the high side; says how many points there are"),
        STRESS_BLOCK: _NO_BLOCK, CORNER_CRUSHING: _AT_CORNERS, RESIDUAL: _NO_SOFTENING, SMOOTH: _TAKEN,
        TIES: _TIES_PLASTIC,
    },
    PROVEN_SMALLEST: {
        DILATANCY: _TAKEN, COHESION: _NON_ASSOCIATIVE_PLASTIC, TENSION: _NON_ASSOCIATIVE_PLASTIC, ABOVE_APEX: _CUT,
        CRUSHING: _NO_PROOF, STRESS_BLOCK: _NO_PROOF, CORNER_CRUSHING: _NO_PROOF, RESIDUAL: _NO_SOFTENING,
        SMOOTH: _TAKEN, TIES: _NO_TIES,
    },
    PROVEN_RANGE: {
        DILATANCY: _TAKEN, COHESION: Cell(Taken.PLASTIC), TENSION: Cell(Taken.PLASTIC), ABOVE_APEX: _CUT,
        CRUSHING: _NO_PROOF, STRESS_BLOCK: _NO_PROOF, CORNER_CRUSHING: _NO_PROOF,
        RESIDUAL: Cell(Taken.LEFT_OUT, "a range has no warnings: its docstring says so"), SMOOTH: _TAKEN,
        TIES: _NO_TIES,
    },
    INTERIOR_POINT: {
        DILATANCY: Cell(Taken.LEFT_OUT, "psi = phi is taken, and the bound says so"),
        COHESION: _ASSOCIATIVE_PLASTIC, TENSION: _ASSOCIATIVE_PLASTIC, ABOVE_APEX: _CUT, CRUSHING: _TAKEN,
        STRESS_BLOCK: Cell(Taken.REFUSED, "as stress blocks of in-plane sections the interior-point solver of this "
                           "package does not cover", "use solver='clarabel'"),
        CORNER_CRUSHING: _AT_CORNERS, RESIDUAL: _NO_SOFTENING,
        SMOOTH: Cell(Taken.REFUSED, "the interior-point solver of this package does not cover",
                     "use solver='clarabel'"),
        TIES: Cell(Taken.REFUSED, "the interior-point solver of this package does not cover", "use solver='clarabel'"),
    },
    DEM: {
        DILATANCY: Cell(Taken.TAKEN, "up to JointOptions.dilatant_slip, and given back where a joint slides back"),
        COHESION: _TAKEN,
        TENSION: Cell(Taken.TAKEN, "with residual values it is lost, without them it is perfectly plastic"),
        ABOVE_APEX: _BEYOND_APEX,
        CRUSHING: _TAKEN, STRESS_BLOCK: _BY_POINTS, CORNER_CRUSHING: _BY_POINTS,
        RESIDUAL: Cell(Taken.TAKEN, "by opening, by opening or slip, or not at all (Joint.lost_by); at once, over "
                       "fracture energies or JointOptions.softening_slip; every result says which"), SMOOTH: _TAKEN,
        TIES: Cell(Taken.PLASTIC, "elastic up to their strength, with the elongation that is left; tension only"),
    },
    PUSHOVER: {
        DILATANCY: Cell(Taken.TAKEN, "whichever way the slip leads: where it turns back the curve warns"),
        COHESION: _TAKEN,
        TENSION: Cell(Taken.TAKEN, "with residual values it is lost, without them it is perfectly plastic"),
        ABOVE_APEX: _BEYOND_APEX, CRUSHING: _TAKEN, STRESS_BLOCK: _BY_POINTS, CORNER_CRUSHING: _BY_POINTS,
        RESIDUAL: Cell(Taken.TAKEN, "by opening, by opening or slip, or not at all (Joint.lost_by); over fracture "
                       "energies, or at once by a jump at the displacement where the first point breaks; a joint whose "
                       "tension unloads to the origin is refused"),
        SMOOTH: _TAKEN,
        TIES: Cell(Taken.PLASTIC, "elastic up to their strength, at any rotation, loose when they shorten; not with "
                   "blocks that deform"),
    },
    MECHANISMS: {
        DILATANCY: Cell(Taken.LEFT_OUT, "what is admissible bounds the associative value, and the bound says so"),
        COHESION: _CLOSED_FORM, TENSION: _CLOSED_FORM, ABOVE_APEX: _CUT, CRUSHING: _CLOSED_FORM_CRUSHING,
        STRESS_BLOCK: _CLOSED_FORM_CRUSHING, CORNER_CRUSHING: _CLOSED_FORM_CRUSHING, RESIDUAL: _NO_SOFTENING,
        SMOOTH: _TAKEN,
        TIES: Cell(Taken.LEFT_OUT, "by closed forms; a motion that is admissible on the blocks is charged with their "
                   "power", says="ties are left out by this closed form"),
    },
}  # fmt: skip
"""What every theory does with every term. "interior-point" is a solver of the associative theory."""


def having(assembly: Assembly, term: Term, rows: Index | None = None) -> Index:
    """Numbers of the interfaces whose joints have a term, out of ``rows`` where given."""
    found = np.flatnonzero(term.in_joints(assembly))
    return found if rows is None else np.intersect1d(found, rows)


def refuse(theory: str, term: Term, assembly: Assembly, rows: Index | None = None) -> None:
    """Refuse the joints whose law a theory does not take; does nothing where the table lets the term pass.

    Parameters
    ----------
    theory : of ``THEORIES``
    rows : interfaces that the theory sees; all where omitted

    Raises
    ------
    NotApplicable
        Naming the joint, why, and what to do.
    """
    cell = TAKES[theory][term]
    found = having(assembly, term, rows) if cell.how is Taken.REFUSED else np.empty(0, np.intp)
    if len(found):
        k, x = int(found[0]), assembly.links
        a, b = (assembly.blocks[n].name for n in (int(x.block_a[k]), int(x.block_b[k])))
        what = "joint" if k < len(assembly.interfaces) else "tie"
        raise NotApplicable(f"the {what} between {a!r} and {b!r} {term.words}, which {cell.why}; {cell.remedy}")


def refuse_ties(assembly: Assembly, what: str, remedy: str) -> None:
    """Refuse an assembly with ties where something outside the table does not follow them.

    Raises
    ------
    NotApplicable
        Naming the first tie, what does not follow it, and what to do.
    """
    if assembly.ties:
        raise NotApplicable(f"{assembly.ties[0]}: {what} does not follow ties; {remedy}")


def notes(theory: str, assembly: Assembly, rows: Index | None = None, terms: tuple[Term, ...] = TERMS) -> list[str]:
    """Warnings of what a theory makes of the terms that its joints have, each said once.

    Parameters
    ----------
    rows : interfaces that the theory sees; all where omitted
    terms : to be told of; all where omitted
    """
    cells = [TAKES[theory][term] for term in terms if len(having(assembly, term, rows))]
    return list(dict.fromkeys(cell.says for cell in cells if cell.says))


def page() -> str:
    """The table as a page of the documentation, docs/laws.md."""
    head = ["term of the joint law", *THEORIES.values()]
    lines = [
        "# Which theory takes which joint law", "",
        "Written by `limitmason.mechanics.law_table.page()`; the same table refuses and warns.", "",
    ]  # fmt: skip
    rows = [head]
    remarks: dict[str, int] = {}
    for term in TERMS:
        row = [term.name]
        for theory in THEORIES:
            cell = TAKES[theory][term]
            text = "; ".join(t for t in (_remark(term, cell), f'warns: "{cell.says}"' if cell.says else "") if t)
            mark = f" [{remarks.setdefault(text, len(remarks) + 1)}]" if text else ""
            row.append(cell.how + mark)
        rows.append(row)
    lines += [*markdown(rows), "", *(f"{n}. {text[:1].upper()}{text[1:]}." for text, n in remarks.items())]
    lines += ["", '"Refused" raises `limitmason.errors.NotApplicable`, which names the joint and what to do.', ""]
    return "\n".join(lines)


def _remark(term: Term, cell: Cell) -> str:
    what = "tie" if term is TIES else "joint"
    return f"the {what} {term.words}, which {cell.why}; {cell.remedy}" if cell.how is Taken.REFUSED else cell.why
