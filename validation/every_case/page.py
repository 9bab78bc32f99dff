"""The table of all cases by all theories as Markdown and as tidy CSV, with what theory demands of it checked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

from limitmason.comparison.comparing import SideBySide
from limitmason.comparison.findings import BROKEN, HOLDS, INSIDE, NOT_CHECKED, Answers
from limitmason.comparison.rows import REFUSED, Row
from limitmason.display.text_table import markdown
from limitmason.methods import ASSOCIATIVE, COMPARED_METHODS, DEM, MECHANISMS, get_method
from limitmason.storage.csv_table import write_table

from .cases import Case, ReferenceValue, settings_of
from .solving import dem_verdict

Found = Mapping[Case, SideBySide]

UNEXPLAINED = "NOT EXPLAINED."
"""Written where an answer leaves the range of theory and the folder of its source does not say why."""


def span(low: float, high: float, form: str = ".4g") -> str:
    """A range as text, a single number where both ends read the same."""
    return f"{low:{form}}" if f"{low:{form}}" == f"{high:{form}}" else f"{low:{form}} to {high:{form}}"


def names_of(names: Sequence[str]) -> str:
    """Several names as the first, the last and their number."""
    return names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)})"


def references_for(case: Case, method: str) -> tuple[ReferenceValue, ...]:
    """Values to divide an answer by: measured ones, and published ones of the answer's own flow rule.

    The DEM and the non-associative analysis of joints with psi = phi follow the associative rule; a mechanism is held
    against associative values.
    """
    dilatant = all(i.joint.tan_psi >= i.joint.tan_phi - 1e-12 for i in case.test.assembly().interfaces)
    rule = "associative" if method in (ASSOCIATIVE, MECHANISMS) or dilatant else "non-associative"
    return tuple(r for r in case.references if r.flow_rule in (None, rule))


def as_markdown(
    found: Found, missing: Sequence[tuple[str, tuple[str, ...], str]], *, version: str, thorough: bool = False
) -> str:
    """The whole page.

    Parameters
    ----------
    found : from :func:`solve_cases`
    missing : from :func:`not_covered`
    version : of limitmason, for the line on where the page comes from
    thorough : whether the answers are those of a thorough run
    """
    lines = [
        "# Every packaged case by every theory",
        "",
        f"Made by `python -m validation.every_case{' --thorough' if thorough else ''}`, version {version}. Nothing is "
        "tuned. A value is followed by its range in brackets. After × stands its ratio to the test or to the "
        "published value of the same flow rule.",
        "",
        "- associative: exact for psi = phi, an upper bound for every psi.",
        "- non-associative: the smallest admissible multiplier found at the case's own psi. In brackets stand the "
        "multipliers of all certified states found. Where it says *proven*, they are an interval outside which there "
        "is none.",
        "- DEM: at the case's own psi, with the bracket of its search. Where it says *budget*, changes are summed on "
        "each side: ten times the stiffness, twice the contact points and half the rate.",
        "- mechanisms: the smallest *bound*, admissible on these blocks, and its name. Then comes the smallest "
        "estimate, which bounds nothing. It stands alone where no mechanism is admissible.",
    ]
    for source, group in groupby(found, key=lambda c: c.source):
        own = {c: found[c] for c in group}
        lines += ["", f"## {source}", "", next(iter(own)).test.source.title, ""]
        assumed = next(iter(own)).test.recipe.shown.assumed
        lines += [assumed, ""] if assumed else []
        lines += _settings(own, thorough)
        methods = [m for m in COMPARED_METHODS if any(m in r for r in own.values())]
        unit = next(iter(own)).unit
        head = ["case", "test or published", *(get_method(m).heading for m in methods)]
        lines += ["", f"Values in {unit}." if unit != "-" else "Values are multipliers of the weight.", ""]
        lines += markdown([head, *([c.name, _span_of(c), *(_cell(c, r, m) for m in methods)] for c, r in own.items())])
        lines += [*_refusals(own), *_checks(own)]
    if any(name not in r for r in found.values() for name in COMPARED_METHODS):
        lines.insert(3, "An empty cell was not computed.")
    lines += ["", "## Not in the table", ""]
    lines += [f"- {source} {names_of(names)}: {reason}." for source, names, reason in missing]
    return "\n".join(lines) + "\n"


def _settings(own: Found, thorough: bool) -> list[str]:
    kinds = {settings_of(c, thorough=thorough)._replace(proven=None) for c in own}
    out = []
    for s in sorted(kinds, key=str):
        grid = "" if s.grid is None else f"; limit analysis on a grid of {s.grid[0]} x {s.grid[1]}, for crushing"
        points = f"{s.contact_points[0]} x {s.contact_points[1]}"
        out.append(f"DEM: {points} contact points along and across a joint{grid}. Search: {s.search}.")
    return out


def _span_of(case: Case) -> str:
    out = []
    for label, group in groupby(sorted(case.references, key=_label), key=_label):
        values = [r.value for r in group]
        out.append(f"{label} {span(min(values), max(values))}" + (f" ({len(values)})" if len(values) > 2 else ""))
    return "; ".join(out) or "none"


def _label(reference: ReferenceValue) -> str:
    words = reference.label.split(maxsplit=1)[1]
    # both senses of a cyclic test stand in one row
    return words.rstrip("+-") if reference.kind == "measured" else words


def ratio_span(case: Case, answer: Row) -> tuple[float, float]:
    """Smallest and largest ratio of an answer to its references, NaN without any."""
    value = answer.in_unit(float(case.test.multiplier_to_measured)).predicted
    ratios = [value / r.value for r in references_for(case, answer.method)]
    return (min(ratios), max(ratios)) if ratios and answer.solved else (math.nan, math.nan)


def _cell(case: Case, result: SideBySide, method: str) -> str:
    if method not in result:
        return ""
    factor = float(case.test.multiplier_to_measured)
    answer = result[method].in_unit(factor)
    if answer.refusal is not None:
        return REFUSED
    if not answer.solved:
        known = math.isfinite(answer.multiplier)
        return f"{answer.predicted:.4g} ({answer.status})" if known else answer.status
    text = f"{answer.predicted:.4g}"
    if answer.has_range:
        proven = "proven " if answer.range_is.startswith("no admissible") else ""
        budget = "budget " if len(answer.details.get("error budget") or ()) else ""
        text += f" ({proven}{budget}{span(answer.low, answer.high)})"
    low, high = ratio_span(case, answer)
    if math.isfinite(low):
        text += f" × {span(low, high, '.2f')}"
    if method == MECHANISMS:
        d = answer.details
        text += f" {d.get('governing', '')}, {'bound' if d.get('smallest_upper_bound_of') else 'estimate'}"
        if answer.beside:
            text += f"; estimate {d['smallest_estimate'] * factor:.4g} {d['smallest_estimate_of']}"
    return text


def _refusals(own: Found) -> list[str]:
    refused: dict[str, list[str]] = {}
    for case, result in own.items():
        for row in result.rows:
            reason = row.refusal
            if reason is not None:
                refused.setdefault(f"not covered by {get_method(row.method).heading}: {reason}", []).append(case.name)
    return ["", *(f"- {names_of(names)}: {reason}" for reason, names in refused.items())] if refused else []


def _checks(own: Found) -> list[str]:
    """What theory demands, counted, and every case that needs an explanation with it."""
    kept, broken, outside, silent, inside, left = 0, [], [], [], 0, []
    for case, result in own.items():
        answers = Answers(result.rows)
        for finding in answers.findings():
            kept += finding.state == HOLDS and finding.method != DEM
            broken += [f"- BROKEN, {case.name}: {finding}"] if finding.state == BROKEN else []
            left += [case.name] if finding.state == NOT_CHECKED and finding.method != DEM else []
        if DEM not in result or result[DEM].refusal is not None:
            continue
        verdict = answers.position(result[DEM])
        inside += verdict == INSIDE
        if verdict and verdict != INSIDE:
            outside.append(f"- {case.name}: the DEM lies {verdict}. {_reason(case, verdict)}")
        if not result[DEM].solved:
            silent.append(f"- {case.name}: DEM {result[DEM].status}. {_reason(case, result[DEM].status)}")
        elif not verdict:
            silent.append(f"- {case.name}: the admissible range beside the DEM was not computed whole.")
    total = inside + len(outside)
    out = [""]
    if kept or broken:
        rest = f"; {len(left)} not checked, where there is no range or no bound to compare" if left else ""
        text = "Orders that theory demands (non-associative <= associative <= admissible mechanism)"
        out.append(f"{text}: {kept} hold, {len(broken)} broken{rest}.")
    if total:
        out.append(f"The DEM lies inside the admissible range within its error bar in {inside} of {total} cases.")
    return [*(out if len(out) > 1 else []), *([""] if broken or outside or silent else []), *broken, *outside, *silent]


def _reason(case: Case, outcome: str) -> str:
    return case.test.recipe.shown.reason_for(case.name, outcome) or UNEXPLAINED


_COLUMNS = (
    "source", "specimens", "variant", "sense", "method", "unit", "value", "low", "high", "range is", "bound", "status",
    "mechanism", "estimate", "estimate of", "references", "reference low", "reference high", "ratio low",
    "ratio high", "DEM is",
)


def write_csv(found: Found, path: str | Path) -> None:
    """Write one line per case and method, with a comment line of units below the names."""
    own_unit = {"value", "low", "high", "estimate", "reference low", "reference high"}
    lines = []
    for case, result in found.items():
        factor = float(case.test.multiplier_to_measured)
        for row in (r.in_unit(factor) for r in result.rows):
            references = references_for(case, row.method)
            values = [r.value for r in references]
            ends = (min(values), max(values)) if values else (math.nan, math.nan)
            lines.append([
                case.source, " ".join(case.specimens), case.variant, case.direction, row.method, case.unit,
                *map(_number, (row.predicted, row.low, row.high)), row.range_is, row.bound,
                row.status, row.details.get("governing", ""),
                _number(factor * float(row.details.get("smallest_estimate", math.nan))),
                row.details.get("smallest_estimate_of") or "",
                "; ".join(dict.fromkeys(r.label for r in references)),
                *map(_number, ends), *map(_number, ratio_span(case, row)),
                dem_verdict(result) if row.method == DEM else "",
            ])
    write_table(path, {c: "column unit" if c in own_unit else "-" for c in _COLUMNS}, lines)


def _number(value: float) -> str:
    return f"{value:.6g}" if math.isfinite(value) else ""
