"""What the specimens of the Pavia tilting tests may have looked like: layouts that give both published 3DEC values.

    python -m validation.pavia_layouts [--full --store DIR --workers N --time-limit SECONDS] [--table FILE]
                                       [--report FILE]

The plans of S1 to S13 are not at hand. Layouts drawn from all plausible ones are screened by limit analysis and
computed by the DEM with 3DEC's contact points at psi = 0 and psi = phi; those that give both published values of a
specimen are listed, and so is how often *permuted* values are met. Every layout found is inferred, not measured. By
default the computed table beside this script is read and its first layouts are computed again; ``--full`` computes the
table, small walls first (hours of one core: it keeps each result in DIR, goes on from there, stops at the time limit).
"""

import csv
import sys
from pathlib import Path

import numpy as np

import limitmason as lm
from limitmason.display.text_table import markdown
from limitmason.experiments import pavia_tilting as pavia

from . import layouts
from .catalogue import COLUMNS, compute_layouts
from .figure import layout_search
from .report import layout_report
from .search import search_layouts

FULL, DRAWN = "--full" in sys.argv, 700


def option(name, default):
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


def say(line):
    print(line, file=sys.stderr, flush=True)


def span(values, form=".2f"):
    return f"{min(values):{form}} to {max(values):{form}}"


def number(text):
    try:
        return int(text) if text.isdigit() else float(text)
    except ValueError:
        return text


def notes_on(catalogue, pairs, sizes):
    """Sentences on what was computed, with the ranges over the catalogue."""
    zero, full, half, double = (catalogue[c] for c in (*COLUMNS, *sizes))
    return (
        f"Computed so far: {len(catalogue)} of {DRAWN} layouts drawn. Those near a published value by limit analysis "
        f"and small walls come first ({span(catalogue['blocks'], '.0f')} blocks). Larger walls may still fit.",
        "Ratios over the whole catalogue, whether a layout fits or not:",
        "\n".join(markdown([
            ["ratio", "range", "count"],
            ["DEM at psi = phi over the associative value, whose joints are rigid",
             span(full / catalogue["associative"]), "-"],
            ["DEM, psi = 0 over psi = phi", span(zero / full),
             f"published: {span([a / b for a, b in pairs.values()])}"],
            ["associative, blocks half as long and high over the reference in a wall of the same size", span(half),
             f"below 1 in {(half < 1).sum()} of {len(half)}"],
            ["the same, blocks twice as long and high", span(double),
             f"above 1 in {(double > 1).sum()} of {len(double)}"],
        ])),
        "![Published pairs and layouts](pavia_layouts.png)",
        "Written by `python -m validation.pavia_layouts` from the table `validation/pavia_layouts/layouts.csv`. With "
        "`--full` more of the catalogue is computed first.",
    )


def main():
    """Compute what is asked for, search, draw, and write the page."""
    pairs, measured = layouts.published_pairs(), layouts.measured_multipliers()
    settings = {"friction_angle_deg": 33.82, "options": {"contact_points": pavia.CONTACT_POINTS, "tolerance": 0.01}}
    zero, full = COLUMNS
    table = Path(option("--table", Path(__file__).with_name("layouts.csv")))
    if FULL:
        catalogue = compute_layouts(
            pavia.specimen, layouts.catalogue(DRAWN), [target for _, target in pairs.values()], progress=say,
            store=option("--store", "pavia"), workers=int(option("--workers", 1)),
            time_limit=float(option("--time-limit", "inf")), **settings,
        )
        for row in catalogue:  # the size study, by limit analysis
            for name, scale in (("half", 0.5), ("double", 2.0)):
                wall, loads = pavia.specimen(**{c: row[c] for c in layouts.LAYOUTS}, block_scale=scale)
                row[f"{name} / reference"] = lm.predict(wall, loads, "limit").collapse_multiplier / row["associative"]
        catalogue.write_csv(table)
    else:
        with table.open(encoding="utf-8") as file:
            lines = list(csv.DictReader(file))[1:]  # the first line holds the units
        catalogue = lm.study.Table(tuple({c: number(v) for c, v in line.items()} for line in lines))
        first = [{c: row[c] for c in layouts.LAYOUTS} for row in catalogue.rows[:1]]
        again = compute_layouts(pavia.specimen, first, catalogue["associative"][:1], **settings)
        print("computed again:", again, "in the table:", lm.study.Table(catalogue.rows[:1]), sep="\n")

    search = search_layouts(catalogue, pairs, columns=(zero, full), tolerance=0.05)
    print(search.summary(), *search.controls, search.verdict, sep="\n")
    report = Path(option("--report", "docs/pavia.md"))
    report.parent.mkdir(parents=True, exist_ok=True)
    layout_search(search, title="Pavia tilting tests: published 3DEC pairs and layouts").savefig(
        report.with_name("pavia_layouts.png")
    )
    sizes = ("half / reference", "double / reference")
    findings = {
        "DEM at psi = 0 over psi = phi (a condition of the search)": search.over_sets(lambda r, _: r[zero] / r[full]),
        "DEM at psi = 0 over the test, mean of repeats": search.over_sets(lambda r, n: r[zero] / np.mean(measured[n])),
        "Blocks half as long and high, associative multiplier": search.over_sets(lambda r, _: r[sizes[0]]),
        "Blocks twice as long and high, associative multiplier": search.over_sets(lambda r, _: r[sizes[1]]),
    }
    notes = notes_on(catalogue, pairs, sizes)
    report.write_text(
        layout_report(
            search, title="Pavia tilting tests: layouts inferred from the published 3DEC values", findings=findings,
            about=(*layouts.SEARCH_NOTES, *notes),
            describe=(*layouts.LAYOUTS, "blocks", "associative", *sizes),
        ),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
