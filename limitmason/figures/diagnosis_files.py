"""All that an investigation found, as a folder: report, pictures, table, page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from limitmason.diagnosis.report import write_record
from limitmason.errors import InputError
from limitmason.figures.confusion import confusable
from limitmason.figures.diagnosis_panels import diagnosis
from limitmason.figures.verdict_page import diagnosis_page
from limitmason.storage.csv_table import write_table
from limitmason.storage.files import named_path, save_figure, write_text


def diagnosis_folder(found: Any, folder: str | Path, *, checks: bool = True) -> list[Path]:
    """Write report.txt, diagnosis.html, pictures, causes.csv, verdict.json.

    Rehearsals, and trials with a cause that is missing from the list, are written too where they were made.

    Parameters
    ----------
    found : from :func:`limitmason.diagnosis.investigate`
    folder : made where it does not exist
    checks : judge the data again under other statements and without each specimen (some seconds)

    Returns
    -------
    list of Path
        The files in the order named.

    Raises
    ------
    InputError
        Where a file stands in place of the folder.
    """
    out, answer = named_path(folder), found.answer
    there = next((p for p in (out, *out.parents) if p.exists()), out)
    if there.is_file():
        raise InputError(f"{there} is a file; name a folder")
    out.mkdir(parents=True, exist_ok=True)
    about = answer.study.about
    write_text(out / "report.txt", found.report(checks=checks) + "\n")
    picture = diagnosis(answer, units=about.units, quantity=about.quantity, title=about.title)
    save_figure(picture, out / "diagnosis.png")
    save_figure(confusable(answer.distances, title=about.title), out / "confusable.png")
    files = ["report.txt", "diagnosis.html", "diagnosis.png", "confusable.png"]
    for trials, name in ((found.rehearsal, "rehearsal.txt"), (found.missing, "missing.txt")):
        if trials is not None:
            write_text(out / name, f"{trials}\n")
            files.append(name)
    write_causes(out / "causes.csv", answer)
    diagnosis_page(
        answer, out / "diagnosis.html", title=about.title or "Diagnosis", units=about.units, quantity=about.quantity,
        next_tests=found.next_tests, rehearsal=found.rehearsal, missing=found.missing, notes=about.notes, checks=checks,
        figure=picture,
    )
    write_record(out / "verdict.json", answer)
    return [out / name for name in (*files, "causes.csv", "verdict.json")]


def write_causes(path: str | Path, answer: Any) -> None:
    """Write the causes of ``answer`` as CSV, a row per cause and kept pair."""
    # "unit": that of the row, which stands in "unit of size"
    units = {
        "cause": "-", "acts on": "-", "unit of size": "-", "kept": "-", "size": "unit", "low": "unit", "high": "unit",
        "log-likelihood gain": "-", "p deficit": "-", "p trend": "-", "p scatter": "-",
        "identified": "-",
    }
    lines = []
    # a pair has a size of each of its causes, joined by "+"; without an interval both ends are empty
    for row in answer.table():
        ends = row["interval"] or [("", "")] * len(row["size"])
        sizes, low, high = (
            " + ".join(f"{v:.6g}" if v != "" else "" for v in part).strip(" +")
            for part in (row["size"], [e[0] for e in ends], [e[1] for e in ends])
        )
        # p_shape is that of a trend along a covariate
        chances = ["" if row[f"p_{k}"] is None else f"{row[f'p_{k}']:.4f}" for k in ("deficit", "shape", "scatter")]
        kept = "yes" if row["kept"] else "no"
        gain = f"{row['gain']:.4f}"
        identified = {True: "yes", False: "no", None: ""}[row["identified"]]
        lines.append([row["cause"], row["acts_on"], row["unit"], kept, sizes, low, high, gain, *chances, identified])
    write_table(path, units, lines)
