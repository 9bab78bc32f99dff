"""A diagnosis as one HTML page: verdict, meaning, evidence, what to do next.

``result`` is a diagnosis, of which every function writes a part as HTML. Cells of tables that hold a number are
one-tuples, see :func:`~limitmason.figures.page.table`; the row of the best explanation has the class "kept".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from limitmason.diagnosis import basis_text as rests_on
from limitmason.diagnosis import verdict_text as said
from limitmason.diagnosis.error_rates import OUTCOMES, Rehearsal
from limitmason.diagnosis.inference.gain import told_error
from limitmason.diagnosis.report import check_lines
from limitmason.figures.diagnosis_panels import diagnosis as diagnosis_figure
from limitmason.figures.page import bullets, image, paragraphs, table, write_page
from limitmason.figures.residuals import with_unit


def diagnosis_page(
    result: Any,
    path: str | Path,
    *,
    title: str = "Diagnosis",
    units: Mapping[str, str] | None = None,
    quantity: str = "",
    next_tests: Any = None,
    rehearsal: Any = None,
    missing: Any = None,
    notes: Sequence[str] = (),
    checks: bool = True,
    figure: Figure | None = None,
) -> Path:
    """Write a verdict with its figures and tables as one self-contained HTML file.

    Parameters
    ----------
    result : from ``Study.diagnose(causes)``
    path : file to write
    title : of the page
    units, quantity : as for :func:`~limitmason.figures.diagnosis_panels.diagnosis`
    next_tests : from ``Diagnosis.next_tests(pool)`` or ``Study.plan``; left out where None
    rehearsal : from ``Study.rehearse(causes)``; left out where None
    missing : from ``Study.rehearse(causes, hide="each")``; left out where None
    notes : sentences on the data and the simulator, such as what is assumed
    checks : judge the data again under other statements and without each specimen (some seconds)
    figure : the picture, where it is drawn already

    Returns
    -------
    Path
        The file.
    """
    units = units or {}
    words = said.headline(result)
    count = len(result.listed)
    picture = figure if figure is not None else diagnosis_figure(result, units=units, quantity=quantity)
    parts = [
        f'<p class="title">{escape(title)}</p><h1>{escape(words[0].upper() + words[1:])}.</h1>',
        f'<p class="list"><strong>Conditional on the list.</strong> The verdict chooses among the {count} '
        f"cause{'s' * (count != 1)} listed below, alone and in pairs. A cause that is not on the list cannot be named; "
        "a p beside a cause means that it is not rejected, not that it is true; a cause is identified only where no "
        "model discrepancy does as well, otherwise the data behave like it. "
        f"{escape(said.if_it_were_missing(result))}</p>",
        "<h2>What it means</h2>" + paragraphs(said.meaning(result)),
        "<h2>The picture</h2>" + image(picture, "residuals, sizes, distances and predictions"),
    ]
    if result.kept:
        parts.append("<h2>What the better model gains</h2>" + _gains(result))
    parts.append("<h2>The causes considered</h2>" + _causes(result))
    parts.append("<h2>What it rests on</h2>" + bullets([*rests_on.basis(result), *notes]))
    parts += [f"<p>{escape(text)}</p>" for text in rests_on.trend_words(result)]
    gate = escape(said.gate_words(result.verdict.p))
    parts.append(f'<p class="small">Gate for &ldquo;none&rdquo;: {gate}. Seed {result.seed}.</p>')
    hangs = check_lines(result, result.checks) if checks else []
    parts.append("<h2>What to keep in mind</h2>" + bullets([*hangs, *result.warnings]))
    parts.append("<h2>What this design can tell apart</h2>" + _distances(result))
    if next_tests is not None:
        parts.append("<h2>Next tests</h2>" + _next_tests(next_tests, units))
    for trials, heading in ((rehearsal, "Blind trials on this design"), (missing, "With the true cause missing")):
        if trials is not None:
            parts.append(f"<h2>{heading}</h2>" + _trials(trials))
    parts.append("<h2>The specimens</h2>" + _specimens(result, units, quantity))
    return write_page(path, title, parts)


def _gains(result: Any) -> str:
    """HTML of what the best kept explanations gain in errors and log scores."""
    rows = []
    for names, gain in result.gains.items():
        by_group = "no groups given" if gain.leave_group_out is None else str(gain.leave_group_out)
        rows.append(("kept" if names == result.kept[0] else "", [
            " and ".join(result.sized(names)), (told_error(gain.error_before),),
            (told_error(gain.error_after),), (told_error(gain.error_left_out),),
            (str(gain.leave_one_out),), (by_group,), (str(gain.selected),),
        ]))
    header = ["extension, size [95 % interval]", "error before", "after", "specimens left out",
              "log score, leave one out", "leave group out", "choice repeated in each fold"]
    more = len(result.kept) - len(rows)
    text = (
        "Errors are root mean squares of log(measured / predicted). Log scores are of left-out values, extension minus "
        "baseline, with standard error; above 0 the extension predicts better. A score quoted after the choice is "
        "optimistic; the last column makes the choice again without the part left out."
    )
    if more > 0:
        text += f" {more} more explanations are not rejected."
    return table(header, rows) + f'<p class="small">{escape(text)}</p>'


def _causes(result: Any) -> str:
    """HTML of the causes listed: physics, bounds, best fit, verdict, size seen."""
    rows = []
    for cause in result.listed:
        tested = result.verdict.tested[(cause.name,)]
        physics = "; ".join(
            p for p in (cause.physics, f"source: {cause.source}" if cause.source else "",
                        f"shown alone by: {cause.isolate}" if cause.isolate else "") if p
        )
        bounds = f"{cause.bounds[0]:g} to {cause.bounds[1]:g}" + ("" if cause.unit == "-" else f" {cause.unit}")
        rows.append(("kept" if tested.kept else "", [
            cause.name, cause.acts_on, physics, (f"{cause.baseline:g}; {bounds}",), (cause.show(tested.sizes[0]),),
            (f"{tested.gain:+.1f}",), result.state_of((cause.name,)),
            said.seen_from(cause, result.detectable[cause.name]),
        ]))
    header = ["cause", "acts on", "physics", "baseline; bounds", "best fit", "log-likelihood", "verdict",
              "would have been seen from"]
    return table(header, rows)


def _distances(result: Any) -> str:
    """HTML of how far every cause lies from baseline and nearest rival, as d2."""
    rows = [
        ("", [row["cause"], (f"{row['d2_baseline']:.0f}",), row["rival"], (f"{row['d2']:.1f}",)])
        for row in result.distances.table()
    ]
    text = (
        "d2: squared distance in units of the noise after the rival and the measured inputs are refitted, at a clearly "
        "visible size. 25 and more: told apart nearly always; below 1: twins, no data of this design can decide."
    )
    header = ["true cause", "d2 to the baseline", "nearest rival", "d2 to it"]
    return table(header, rows) + f'<p class="small">{escape(text)}</p>'


def _trials(trials: Rehearsal) -> str:
    """HTML of outcomes of blind trials, a row a cause; what never came is left out."""
    shown = [o for o in OUTCOMES if any(row.get(o) for row in trials.counts.values())]
    rows = [("", [row["hidden"], *((str(row[c]),) for c in ("trials", *shown))]) for row in trials.table()]
    text = "Hidden and listed causes share their tables: this tries the statistics, not the physics."
    return table(["hidden", "trials", *shown], rows) + f'<p class="small">{text}</p>'


def _next_tests(tests: Any, units: Mapping[str, str]) -> str:
    """HTML of the ``tests`` proposed next: why, and covariates in ``units``.

    A pool of specimens without covariates is told by what they print.
    """
    first = tests.specimens[0]
    names = list(first) if isinstance(first, Mapping) else []
    header = ["number in the pool", *(with_unit(n, units) for n in names)] if names else ["number", "specimen"]
    header += ["measure", "cost"] if tests.quantities else []
    rows = []
    for k, (i, s) in enumerate(zip(tests.indices, tests.specimens, strict=True)):
        what = [tests.quantities[k], f"{tests.costs[k]:g}"] if tests.quantities else []
        rows.append(("", [(str(i + 1),), *([_number(s.get(n)) for n in names] if names else [repr(s)]), *what]))
    told = "".join(f" {text[0].upper()}{text[1:]}." for text in tests.expected)
    return f"<p>{escape(tests.reason[0].upper() + tests.reason[1:])}.{escape(told)}</p>" + table(header, rows)


def _specimens(result: Any, units: Mapping[str, str], quantity: str) -> str:
    """HTML of measured and predicted values by specimen.

    Predicted are those of the baseline and of the best explanation.

    Parameters
    ----------
    units : of the covariates, by name
    quantity : what was measured, with its unit
    """
    before, best = result.predicted(()), result.predicted() if result.kept else None
    named = [s.removeprefix("specimen ") for s in result.specimens]
    # a covariate that only repeats the names of the specimens has no column
    shown = [n for n in result.covariates if [str(v) for v in result.covariates[n]] != named]
    told = {"baseline": before} if best is None else {"baseline": before, " + ".join(result.kept[0]): best}
    header = ["specimen", *(with_unit(n, units) for n in shown), f"measured {quantity}".strip()]
    header += [text for name in told for text in (name, "left [%]")]
    rows = []
    for i in range(result.n):
        value = float(result.measured[i])
        cells: list[Any] = [named[i], *(_number(result.covariates[n][i]) for n in shown), (f"{value:.4g}",)]
        for predicted in told.values():
            left = 100.0 * float(np.expm1(np.log(value / predicted[i])))
            cells += [(f"{predicted[i]:.4g}",), (f"{left:+.1f}",)]
        rows.append(("", cells))
    return table(header, rows)


def _number(value: Any) -> Any:
    """Cell of a covariate: a number as a one-tuple, else its text."""
    return (f"{value:.4g}",) if isinstance(value, (int, float)) and not isinstance(value, bool) else str(value)
