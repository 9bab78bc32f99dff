"""The report of one structure as one HTML page: what it is, and all theories.

``model`` and ``loads`` are the problem, ``compared`` is what the theories say. The page of ``lm.view``, in space, is
:mod:`limitmason.figures.scene`.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from limitmason.answers.results import BoundKind, Prediction
from limitmason.checks import instance
from limitmason.comparison import SideBySide
from limitmason.constants import VERSION
from limitmason.figures.collapse_mechanism import assembly as draw_assembly
from limitmason.figures.collapse_mechanism import mechanism
from limitmason.figures.contacts import contact_report
from limitmason.figures.forces import contact_forces
from limitmason.figures.page import bullets, image, table, write_page
from limitmason.figures.studies import side_by_side
from limitmason.model import Assembly, Joint, Loads
from limitmason.model.model_call import of_model

# what a number says of the collapse, by the kind of its bound
_KINDS = {
    BoundKind.EXACT: "exact for the law it names",
    BoundKind.UPPER: "the structure collapses at this multiplier or below it",
    BoundKind.LOWER: "the structure carries at least this",
    BoundKind.ESTIMATE: "an estimate: no side is certain",
    BoundKind.NONE: "no statement",
}

_NAMED = 12  # held blocks that are named, so that the sentence stays one

NOT_COVERED = (
    "Blocks are rigid in limit analysis and mechanisms: what comes from their deformation or cracking is not in them.",
    "The multiplier is that of the load pattern above; other directions and points of attack may govern.",
    "Time does not enter: no dynamics, no creep, no decay of mortar.",
    "Foundations do not move unless a support was given that does.",
    "The values of joints and weights are those below; nothing here says that the structure has them.",
)


@of_model
def structure_report(
    model: Assembly,
    loads: Loads,
    compared: SideBySide,
    path: str | Path,
    *,
    title: str = "",
    assumed: Sequence[str] = (),
) -> Path:
    """Write what was computed of a structure as one self-contained HTML file.

    The page also shows the input, the checks and the figures.

    Parameters
    ----------
    model, loads : the problem
    compared : from ``limitmason.compare(model, loads)``; its first prediction with a mechanism is the one drawn
    path : file to write
    title : of the page
    assumed : sentences on what was assumed, such as of a drawing

    Returns
    -------
    Path
        The file.
    """
    instance("compared", compared, SideBySide, "of lm.compare")
    name = title or compared.title or "Structure"
    drawn = next((r.prediction for r in compared.rows if r.prediction is not None and r.prediction.mechanism), None)
    parts = [
        f'<p class="title">{escape(name)}</p><h1>{escape(_headline(compared))}</h1>',
        '<p class="list"><strong>What this is.</strong> Computed by limitmason ' + escape(VERSION) + " for the "
        "geometry, joints and loads on this page, by theories that do not share their solvers. Whether they are those "
        "of the structure is an engineer's judgement.</p>",
        "<h2>All theories side by side</h2>" + _compared(compared),
    ]
    if any(r.solved for r in compared.rows):
        parts.append(image(side_by_side(compared), "multipliers with their ranges"))
    parts.append(bullets(compared.findings()))
    if drawn is not None:
        parts.append(f"<h2>How it fails ({escape(drawn.method)})</h2>" + image(mechanism(model, drawn), "mechanism"))
        if drawn.resultants is not None:
            parts.append("<h2>Forces in the joints</h2>" + image(contact_forces(model, drawn), "joint forces"))
    parts.append("<h2>Geometry and supports</h2>" + image(draw_assembly(model), "assembly"))
    parts.append(bullets(geometry_facts(model)))
    parts.append("<h2>Loads</h2>" + bullets(load_facts(model, loads)))
    parts.append("<h2>Joints</h2>" + joint_table(model))
    if model.ties:
        parts.append("<h2>Ties</h2>" + bullets([str(tie) for tie in model.ties]))
    parts.append("<h2>Contacts</h2>" + _contacts(model))
    told = [assumed] if isinstance(assumed, str) and assumed else assumed  # a single sentence is no list of letters
    parts.append("<h2>Assumed</h2>" + bullets(told or ["Nothing beyond the input above."]))
    parts.append("<h2>Checks of every answer</h2>" + _checks(compared))
    parts.append("<h2>What this does not cover</h2>" + bullets(NOT_COVERED))
    return write_page(path, name, parts)


def _headline(compared: SideBySide) -> str:
    """Sentence with the smallest upper bound, and the smallest answer if below it.

    Larger upper bounds are left out: they say nothing beside the smallest.
    """
    solved = [r for r in compared.rows if r.solved]
    if not solved:
        return "No theory found a finite collapse multiplier."
    least = min(solved, key=lambda r: r.multiplier)
    above = [r for r in solved if r.bound.kind in (BoundKind.EXACT, BoundKind.UPPER)]
    if not above:  # lower bounds and estimates alone do not limit the load from above
        return f"Collapse at about {least.multiplier:.3g} times the live load ({least.method})."
    bound = min(above, key=lambda r: r.multiplier)
    text = f"Collapse at no more than {bound.multiplier:.3g} times the live load ({bound.method})"
    lower = least.multiplier < 0.995 * bound.multiplier  # chosen: a difference that three digits show
    return text + (f"; {least.method} finds {least.multiplier:.3g}." if lower else ".")


def _compared(compared: SideBySide) -> str:
    """HTML table of multipliers [-] by all theories, and of the test if there is one.

    A cell in a one-tuple holds a number: :func:`~limitmason.figures.page.table` sets it flush right.
    """
    rows = []
    for r in compared.rows:
        ends = f"{r.low:.4f} to {r.high:.4f}" if r.has_range else ""
        value = f"{r.multiplier:.4f}" if np.isfinite(r.multiplier) else "-"
        rows.append(("", [r.method, (value,), (ends,), r.status, f"{_KINDS[r.bound.kind]} ({r.bound})"]))
    if compared.measured is not None:
        low, middle, high = compared.measured
        ends = f"{low:.4f} to {high:.4f}" if high > low else ""  # one test has no range
        rows.append(("kept", ["test", (f"{middle:.4f}",), (ends,), "measured", ""]))  # a row in bold
    return table(["theory", "multiplier", "range", "status", "what the number is"], rows)


def geometry_facts(model: Assembly) -> list[str]:
    """Sentences on blocks, size, weight and supports, naming the first of many."""
    bounds = np.array([b.bounds for b in model.blocks])
    size = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
    held = [model.blocks[i].name for i in np.flatnonzero(model.held.any(axis=1))]
    free = ~model.fixed
    return [
        f"{model.n_blocks} blocks, {len(model.interfaces)} joints"
        f"{f', {len(model.ties)} ties' if model.ties else ''}, {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} m "
        "(x, y, z)",
        f"weight of the blocks that are not fixed: {model.weights[free].sum() / 1e3:.4g} kN",
        f"held: {', '.join(held[:_NAMED]) or 'none'}{f' and {len(held) - _NAMED} more' if len(held) > _NAMED else ''}",
    ]


def load_facts(model: Assembly, loads: Loads) -> list[str]:
    """Sentences on the sums of dead and live load on free degrees of freedom."""
    free = ~model.held
    out = [f"load case: {loads.name}"] if loads.name else []
    for label, wrench in (("dead", loads.dead * free), ("live, times the multiplier", loads.live * free)):
        x, y, z = wrench[:, :3].sum(axis=0) / 1e3
        out.append(f"{label}: sum {x:.4g}, {y:.4g}, {z:.4g} kN along x, y, z on the degrees of freedom that move")
    return out


def joint_table(model: Assembly) -> str:
    """HTML table of every joint law, how many joints have it and their area [m2]."""
    laws: dict[Joint, list[float]] = {}
    for i in model.interfaces:
        laws.setdefault(i.joint, []).append(i.area)
    rows = [
        ("", [law.name or "joint", (str(len(areas)),), (f"{sum(areas):.4g}",), repr(law)])
        for law, areas in laws.items()
    ]
    return table(["name", "joints", "area [m2]", "law: angles [deg], strengths [Pa], stiffness [Pa/m]"], rows)


def _contacts(model: Assembly) -> str:
    """HTML of the contact report, with its figure where there is something to decide."""
    report = model.contact_report()
    drawing = image(contact_report(model, report), "contacts") if report.decisions else ""
    return f"<pre>{escape(str(report))}</pre>" + drawing


def _checks(compared: SideBySide) -> str:
    """Certificate and warnings of every answer as preformatted text."""
    out = []
    for row in compared.rows:
        found: Prediction | None = row.prediction
        text = [f"{row.method}: {row.status}, {row.seconds:.1f} s"]
        if found is not None and found.certificate is not None:
            text += [f"  {line}" for line in str(found.certificate).splitlines()]
        text += [f"  warning: {w}" for w in row.warnings]
        out.append("\n".join(text))
    return "<pre>" + escape("\n\n".join(out)) + "</pre>"
