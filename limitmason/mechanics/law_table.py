"""Which theory takes which term of the joint law: one table, which refuses, warns and is docs/laws.md."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from limitmason.arrays import Flags, Index
from limitmason.display.text_table import markdown
from limitmason.errors import NotApplicable
from limitmason.mechanics.law import above_apex
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint, Unloading
from limitmason.model.joint_term import Cell, JointTerm, Taken, added_terms

LEAST_FRICTION = 1e-6
"""tan(phi) up to which a joint counts as frictionless for a method that divides by it: chosen, far below any joint."""

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
"""Theories and solvers by name, as a reader knows them; "interior-point" is a solver of the associative theory."""

LIMIT = (ASSOCIATIVE, NON_ASSOCIATIVE, PROVEN_SMALLEST, PROVEN_RANGE, INTERIOR_POINT)

GRID, SECTIONS, CORNERS = "points of a grid", "in-plane sections by their ends", "faces in space by their corners"
"""Where joints are judged, for terms of which a theory does not make the same everywhere."""

TAKEN = Cell(Taken.TAKEN)


class Term(NamedTuple):
    """A term of the joint law.

    Parameters
    ----------
    name : in the words of a table
    words : in those of a refusal: "the joint ... "
    in_joints : which interfaces have it, shape (k,)
    takes : what theories do with it, by their names; one that is not named refuses it
    where : it is only this term where joints are judged so, see ``GRID``; everywhere where empty
    """

    name: str
    words: str
    in_joints: Callable[[Assembly], Flags]
    takes: Mapping[str, Cell]
    where: str = ""

    def cell(self, theory: str) -> Cell:
        """What a theory does with it."""
        if theory in self.takes:
            return self.takes[theory]
        why = f"this theory does not follow ({THEORIES.get(theory, theory)})"
        return Cell(Taken.REFUSED, why, "take method 'dem', or leave it out")


def _all(cell: Cell, *theories: str) -> dict[str, Cell]:
    """The same cell for several theories."""
    return dict.fromkeys(theories, cell)


def _crushes(assembly: Assembly) -> Flags:
    return np.isfinite(assembly.arrays.compressive_strength)


def _where(holds: Callable[[Joint], bool]) -> Callable[[Assembly], Flags]:
    """Interfaces for whose joint something holds."""
    return lambda assembly: np.array([holds(i.joint) for i in assembly.interfaces], dtype=bool)


def _has(kind: type[JointTerm]) -> Callable[[Assembly], Flags]:
    """Interfaces whose joint has an added term of a kind."""
    return _where(lambda joint: any(type(t) is kind for t in joint.terms))


_ASSOCIATIVE_PLASTIC = Cell(
    Taken.PLASTIC,
    says="tension and cohesion are taken as perfectly plastic: a section carries ft A L / 2, three "
    "times the elastic-brittle ft A L / 6; where ft > c / tan(phi) the apex of the Coulomb cone governs",
)
_NON_ASSOCIATIVE_PLASTIC = Cell(
    Taken.PLASTIC, says="tension and cohesion are taken as perfectly plastic, and dilatancy goes on with any slip"
)
_BY_FORMULAS = "by the closed forms; a bound by a motion that the blocks can make counts what they dissipate"
_CLOSED_FORM = Cell(
    Taken.LEFT_OUT,
    _BY_FORMULAS,
    says="cohesion, tension and crushing of the joints are left out by this closed form",
)
_STRENGTH = {
    **_all(_ASSOCIATIVE_PLASTIC, ASSOCIATIVE, INTERIOR_POINT),
    **_all(_NON_ASSOCIATIVE_PLASTIC, NON_ASSOCIATIVE, PROVEN_SMALLEST),
    PROVEN_RANGE: Cell(Taken.PLASTIC), **_all(TAKEN, DEM, PUSHOVER), MECHANISMS: _CLOSED_FORM,
}
_NO_SOFTENING = Cell(
    Taken.LEFT_OUT,
    says="residual values of the joints are left out: joints keep their peak strength at any slip and "
    "opening, so joints that soften carry less; the DEM follows them",
)
_LEFT_OUT_OF_RANGE = Cell(Taken.LEFT_OUT, "a proven range carries no warnings; its docstring says so")
_PLASTIC_THEORIES = {**_all(_NO_SOFTENING, *LIMIT, MECHANISMS), PROVEN_RANGE: _LEFT_OUT_OF_RANGE}
_NO_PROOF, _NO_TIES = (
    Cell(
        Taken.REFUSED,
        f"a proof does not cover: {why} the smallest multiplier can only be searched for",
        "use lm.limit_analysis(..., flow_rule='non-associative') without prove=True",
    )
    for why in ("where joints crush", "with ties")
)
_AT_CORNERS = Cell(
    Taken.REFUSED,
    "points at the corners cannot represent (they would only crush at half the full load)",
    "use contact_model='grid' with grid=(8, 8) or finer",
)
_CRUSHING = {
    **_all(_NO_PROOF, PROVEN_SMALLEST, PROVEN_RANGE),
    **_all(Cell(Taken.TAKEN, "at its contact points, like all others"), DEM, PUSHOVER),
    MECHANISMS: _CLOSED_FORM._replace(why="a motion that opens every joint crushes nothing: its bound holds"),
}
_NOT_COVERED = Cell(Taken.REFUSED, "the interior-point solver of this package does not cover", "use solver='clarabel'")
_PSI_IS_PHI = Cell(Taken.LEFT_OUT, "psi = phi is taken, and the bound says so")
_LOST = Cell(Taken.TAKEN, "lost where the joint has residual values, else perfectly plastic")
_TIES_PLASTIC = Cell(
    Taken.PLASTIC,
    "tension only, up to the least of yield, bond and anchor plate, with any elongation",
    says="ties yield at their strength with any elongation: where bond or an anchor plate governs that is assumed",
)
_FC = "has a finite compressive strength"
_BY = "by opening, by opening or slip, or not at all (Joint.lost_by); "

DILATANCY = Term(
    "dilatancy psi < phi", "dilates less than its friction", lambda a: a.arrays.tan_psi < a.arrays.tan_phi, {
        **_all(_PSI_IS_PHI, ASSOCIATIVE, INTERIOR_POINT), **_all(TAKEN, PROVEN_SMALLEST, PROVEN_RANGE),
        NON_ASSOCIATIVE: Cell(Taken.TAKEN, "joints go on opening with any slip"),
        DEM: Cell(Taken.TAKEN, "up to JointOptions.dilatant_slip; the joint closes again where it slides back"),
        PUSHOVER: Cell(Taken.TAKEN, "slip opens the joint in any direction; where it turns back the curve warns"),
        MECHANISMS: Cell(Taken.LEFT_OUT, "psi = phi is taken: a motion gives an upper bound of the associative value"),
    },
)
COHESION = Term("cohesion", "has cohesion", lambda a: a.arrays.cohesion > 0.0, _STRENGTH)
TENSION = Term(
    "tensile strength", "has tensile strength", lambda a: a.arrays.tensile_strength > 0.0,
    _STRENGTH | _all(_LOST, DEM, PUSHOVER),
)
ABOVE_APEX = Term(
    "tension above the apex, ft > c / tan(phi)", "has more tensile strength than c / tan(phi)",
    lambda a: above_apex(a.arrays), {
        **_all(Cell(
            Taken.LEFT_OUT, "the law must be convex: tension is cut at the apex of the Coulomb cone, and the answer "
            "says which joint and from which strength",
        ), *LIMIT, MECHANISMS),
        **_all(Cell(Taken.TAKEN, "a point beyond the apex carries tension up to ft and no shear"), DEM, PUSHOVER),
    },
)
CRUSHING = Term(
    "crushing, at points of a grid", _FC, _crushes, {
        **_CRUSHING, **_all(TAKEN, INTERIOR_POINT, DEM, PUSHOVER),
        ASSOCIATIVE: Cell(Taken.TAKEN, "errs on the high side; the answer says what half as many points give"),
        NON_ASSOCIATIVE: Cell(Taken.TAKEN, "errs on the high side; the answer says how many points there are"),
    }, GRID,
)
STRESS_BLOCK = Term(
    "crushing, in-plane sections by their ends", _FC, _crushes, {
        **_CRUSHING, ASSOCIATIVE: Cell(Taken.TAKEN, "exact"),
        NON_ASSOCIATIVE: Cell(
            Taken.REFUSED, "non-associative analysis cannot follow at joints that dilate less than their friction: it "
            "has no exact crushing stress block",
            "use contact_model='grid', which limits the normal force of every contact point",
        ),
        INTERIOR_POINT: _NOT_COVERED._replace(why=f"{_NOT_COVERED.why} with exact stress blocks of in-plane sections"),
    }, SECTIONS,
)
CORNER_CRUSHING = Term(
    "crushing, faces in space by their corners", _FC, _crushes,
    _CRUSHING | _all(_AT_CORNERS, ASSOCIATIVE, NON_ASSOCIATIVE, INTERIOR_POINT), CORNERS,
)
RESIDUAL = Term(
    "softening to residual values", "has residual values or a fracture energy", _where(lambda j: j.softens), {
        **_PLASTIC_THEORIES,
        DEM: Cell(Taken.TAKEN, f"{_BY}at once, over fracture energies or JointOptions.softening_slip; every result "
                  "says which"),
        PUSHOVER: Cell(Taken.TAKEN, f"{_BY}over fracture energies, or at once by a jump at the displacement where the "
                       "first point breaks"),
    },
)
UNLOADING = Term(
    "tension that unloads to the origin", "unloads to the origin (unloading='secant')",
    _where(lambda j: j.softens and j.unloading is Unloading.SECANT), {
        **_PLASTIC_THEORIES, DEM: TAKEN,
        PUSHOVER: Cell(Taken.REFUSED, "the capacity curve does not follow", "take 'elastic' or method 'dem'"),
    },
)
SMOOTH = Term(
    "no friction", "has no friction", lambda a: a.arrays.tan_phi <= LEAST_FRICTION,
    _all(TAKEN, *THEORIES) | {INTERIOR_POINT: _NOT_COVERED},
)
TIES = Term(
    "ties: rods, anchors, ring beams", "yields",
    lambda a: np.repeat([False, True], [len(a.interfaces), len(a.ties)]), {
        **_all(_TIES_PLASTIC, ASSOCIATIVE, NON_ASSOCIATIVE), **_all(_NO_TIES, PROVEN_SMALLEST, PROVEN_RANGE),
        INTERIOR_POINT: _NOT_COVERED,
        DEM: Cell(Taken.PLASTIC, "tension only, elastic up to their strength; what they have yielded by remains"),
        PUSHOVER: Cell(Taken.PLASTIC, "tension only, elastic up to their strength, at any rotation; not with blocks "
                       "that deform"),
        MECHANISMS: Cell(Taken.LEFT_OUT, _BY_FORMULAS, says="ties are left out by this closed form"),
    },
)
FIELDS = (
    DILATANCY, COHESION, TENSION, ABOVE_APEX, CRUSHING, STRESS_BLOCK, CORNER_CRUSHING, RESIDUAL, UNLOADING, SMOOTH,
    TIES,
)
"""Terms that the fields of ``Joint`` make, and ties."""


def terms() -> tuple[Term, ...]:
    """All terms of the joint law: those of its fields, and those that are added to it."""
    added = (Term(kind.title, kind.words, _has(kind), kind.takes) for kind in added_terms().values())
    return (*FIELDS, *added)


def having(assembly: Assembly, term: Term, rows: Index | None = None) -> Index:
    """Numbers of the interfaces whose joints have a term, out of ``rows`` where given."""
    found = np.flatnonzero(term.in_joints(assembly))
    return found if rows is None else np.intersect1d(found, rows)


def refuse(theory: str, assembly: Assembly, rows: Index | None = None, *, where: str = "") -> None:
    """Refuse joints whose law a theory does not take: of every term that the joints have.

    Parameters
    ----------
    theory : of ``THEORIES``
    assembly : whose joints and ties are looked at
    rows : interfaces that the theory sees; all where omitted
    where : the contact points of the theory, ``GRID``, ``SECTIONS`` or ``CORNERS``. A row of the table that is for
        other points is passed over: an in-plane section can take what a corner in space cannot

    Raises
    ------
    NotApplicable
        Naming the joint, why, and what to do.
    """
    for term in terms():
        cell = term.cell(theory)
        if cell.how is not Taken.REFUSED or term.where not in ("", where):
            continue
        found = having(assembly, term, rows)
        if len(found):
            k, x = int(found[0]), assembly.links
            a, b = (assembly.blocks[n].name for n in (int(x.block_a[k]), int(x.block_b[k])))
            what = "joint" if k < len(assembly.interfaces) else "tie"
            raise NotApplicable(f"the {what} between {a!r} and {b!r} {term.words}, which {cell.why}; {cell.remedy}")


def refuse_ties(assembly: Assembly, what: str, remedy: str) -> None:
    """Refuse an assembly with ties where something outside the table does not follow them.

    Parameters
    ----------
    what : as the message names it
    remedy : what to do instead, in words

    Raises
    ------
    NotApplicable
        Naming the first tie, what does not follow it, and what to do.
    """
    if assembly.ties:
        raise NotApplicable(f"{assembly.ties[0]}: {what} does not follow ties; {remedy}")


def notes(
    theory: str, assembly: Assembly, rows: Index | None = None, among: tuple[Term, ...] | None = None
) -> list[str]:
    """Warnings of what a theory makes of the terms that its joints have, each said once.

    Parameters
    ----------
    theory : of ``THEORIES``
    rows : interfaces that the theory sees; all where omitted
    among : terms to be told of; all where omitted
    """
    cells = [term.cell(theory) for term in among or terms() if len(having(assembly, term, rows))]
    return list(dict.fromkeys(cell.says for cell in cells if cell.says))


def page() -> str:
    """The table as a page of the documentation, docs/laws.md."""
    head = ["term of the joint law", *THEORIES.values()]
    lines = [
        "# Which theory takes which joint law", "",
        "Written by `limitmason.mechanics.law_table.page()`; the same table refuses and warns.", "",
    ]
    rows = [head]
    remarks: dict[str, int] = {}  # footnotes by their text: cells that say one thing share a number
    for term in terms():
        row = [term.name]
        for theory in THEORIES:
            cell = term.cell(theory)
            said = [*_remark(term, cell).split("; "), f'warns: "{cell.says}"' if cell.says else ""]
            text = " ".join(f"{sentence[0].upper()}{sentence[1:]}." for sentence in said if sentence)
            mark = f" [{remarks.setdefault(text, len(remarks) + 1)}]" if text else ""
            row.append(cell.how + mark)
        rows.append(row)
    lines += [*markdown(rows), "", *(f"{n}. {text}" for text, n in remarks.items())]
    lines += ["", '"Refused" raises `limitmason.errors.NotApplicable`, which names the joint and what to do.', ""]
    return "\n".join(lines)


def _remark(term: Term, cell: Cell) -> str:
    """What a footnote of the page says of a term and what a theory makes of it, empty where there is nothing to say."""
    what = "tie" if term.name == TIES.name else "joint"
    return f"the {what} {term.words}, which {cell.why}; {cell.remedy}" if cell.how is Taken.REFUSED else cell.why
