"""A layout search in words: the whole result as Markdown, with what may be concluded and what may not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from limitmason.display.text_table import markdown
from limitmason.study.table import Table

from .search import INFERRED, Finding, LayoutSearch


def layout_report(
    search: LayoutSearch,
    *,
    title: str,
    about: Sequence[str] = (),
    findings: Mapping[str, Sequence[Finding]] | None = None,
    describe: Sequence[str],
) -> str:
    """Markdown of a search: verdict, what was searched, permuted control, compatible sets, conclusions.

    Parameters
    ----------
    title, about : heading, and paragraphs under it
    findings : ranges over the whole sets by question, from ``LayoutSearch.over_sets``
    describe : columns of the catalogue that say what a layout is

    Returns
    -------
    str
        Every table of layouts is marked "inferred, not measured". Where the search is not informative, the findings
        are said to describe layouts and not specimens.
    """
    lines = [f"# {title}", "", f"**{search.verdict[:1].upper()}{search.verdict[1:]}.**", ""]
    for paragraph in about:
        lines += [paragraph, ""]
    lines += ["## Permuted control", "", *_controls(search), ""]
    lines += [f"## Compatible layouts ({INFERRED})", "", *_markdown(search.summary()), ""]
    if findings:
        lines += ["## Over the whole compatible sets", ""]
        if not search.informative:
            lines += [
                "The search does not identify the specimens. What follows holds for the layouts found. It is no "
                "statement about the walls that were tested.",
                "",
            ]
        for question, found in findings.items():
            lines += [f"### {question[:1].upper()}{question[1:]}", "", *_findings(found), ""]
    lines += [f"## The sets in full ({INFERRED})", ""]
    for name in search.pairs:
        layouts = search.layouts(name)
        lines += [f"### {name}: {len(layouts)} of {len(search.catalogue)} layouts", ""]
        if len(layouts):
            kept = [c for c in (*describe, *search.columns) if c in layouts.columns]
            lines += [*_markdown(Table(tuple({c: r.get(c) for c in kept} for r in layouts), layouts.units)), ""]
    return "\n".join(lines).rstrip() + "\n"


def _controls(search: LayoutSearch) -> list[str]:
    own = [len(numbers) for numbers in search.compatible.values()]
    rows = [
        {"pairs": "published", "fitted": f"{sum(n > 0 for n in own)} of {len(own)}",
         "layouts per pair": sum(own) / len(own), "chance, were they alike": None}
    ]
    rows += [
        {"pairs": f"permuted: {c.admitted}", "fitted": f"{c.fitted} of {c.pairs}", "layouts per pair": c.layouts,
         "chance, were they alike": c.chance}
        for c in search.controls
    ]
    note = "The chance is that of Fisher's exact test, one-sided. The last control decides."
    return _markdown(Table(tuple(rows), {}, (note,)))


def _findings(found: Sequence[Finding]) -> list[str]:
    rows = tuple(
        {"specimen": f.specimen, "layouts": f.layouts, "smallest": f.low, "largest": f.high,
         "over the whole set": {"open": f"on both sides of {f.about:g}, or unknown for a layout: no conclusion",
                                "no layout": "no layout"}.get(f.side, f"{f.side} {f.about:g}")}
        for f in found
    )
    settled = [f for f in found if f.side in ("below", "above")]
    sides = {side: sum(f.side == side for f in settled) for side in ("below", "above")}
    told = f"Below {found[0].about:g} over the whole set of {sides['below']}, above of {sides['above']}, of "
    told += f"{sum(f.layouts > 0 for f in found)} specimens with a compatible layout."
    return [*_markdown(Table(rows)), "", told]


def _markdown(table: Table) -> list[str]:
    head = [c if table.units.get(c, "-") == "-" else f"{c} [{table.units[c]}]" for c in table.columns]
    lines = markdown([head, *([_cell(row.get(c)) for c in table.columns] for row in table)])
    return [*lines, "", *table.notes] if table.notes else lines


def _cell(value: object) -> str:
    if value is None or (isinstance(value, float) and value != value):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
