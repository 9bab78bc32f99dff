"""The command that diagnoses: what a simulation gets wrong on measured data, named or not, with report and figures."""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from typing import Any

from limitmason.cli.console import analysis_options, say, settings_of, show_text

ABOUT = """\
Hold a simulation against measured values and say which listed cause explains the difference, or that none does, or that
the data cannot tell.

The data: a CSV file with a row of column names, a row of units ('-' for pure numbers and words) and one row per
measured value. Column 'measured' holds the value; 'specimen' a name, 'group' the configuration (repeats share one),
'noise' the relative error of each value; all others are covariates. `limitmason diagnose --template data.csv` writes
such a file.

The simulation: --model with a packaged series (minho, ...; the file names its specimens, or leave the file out),
--model module:function or file.py:function for simulate(specimen, **parameters) of your own, or a column of the file
with its predictions (--predicted); then only causes that act on the predicted value can be tried.
"""


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``diagnose``."""
    command = commands.add_parser(
        "diagnose", help="what a simulation gets wrong on measured data, and why", description=ABOUT,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    command.add_argument("data", nargs="?", type=Path, metavar="DATA.csv", help="measured values; see above")
    command.add_argument("--model", metavar="NAME", help="packaged series, or module:function, or file.py:function")
    command.add_argument("--predicted", metavar="COLUMN", help="column with predictions; default: 'predicted'")
    command.add_argument("--template", type=Path, metavar="FILE", help="write a data file to start from (with --model "
                         "SERIES that series) and stop")  # fmt: skip
    command.add_argument("--out", type=Path, default=Path("diagnosis"), metavar="DIR", help="default: diagnosis")
    command.add_argument("--title", help="of the report; default: the file's name")
    table = command.add_argument_group("columns")
    table.add_argument("--measured", default="measured", metavar="COLUMN", help="measured values; default: 'measured'")
    table.add_argument("--group", metavar="COLUMN", help="configuration; default: 'group' where there is one")
    table.add_argument("--covariates", nargs="+", metavar="COLUMN", help="default: all columns left")
    table.add_argument("--batches", nargs="+", metavar="COLUMN", help="columns of words whose labels may be read by "
                       "another gain; default: batch, sensor, operator, laboratory")  # fmt: skip
    known = command.add_argument_group("what is known, and what may be wrong")
    known.add_argument("--noise", metavar="SD", help="relative error of the measured values (0.04 is 4 %%), "
                       "'unknown', or 'replicates' (repeats in a group); default: column 'noise', "
                       "or unknown")  # fmt: skip
    known.add_argument("--dof", type=float, help="degrees of freedom of replicates that --noise was taken from")
    known.add_argument("--tails", type=float, help="Student errors with so many degrees of freedom, against blunders")
    known.add_argument("--input", action="append", default=[], metavar="NAME=VALUE,SD", help="input of the "
                       "simulation that was measured, with its error")  # fmt: skip
    known.add_argument("--causes", metavar="LIST", help="module:LIST or file.py:LIST, or names of the catalogue "
                       "between commas; default for a packaged series: the catalogue's list")  # fmt: skip
    known.add_argument("--towards", nargs="+", default=[], metavar="COLUMN", help="with --predicted: predictions of a "
                       "second model; tried as a cause, from one to the other")  # fmt: skip
    known.add_argument("--tilting", action="store_true", help="the values are tangents of a tilt angle")
    known.add_argument("--spatial", action="store_true", help="the walls do not work in one plane")
    run = command.add_argument_group("run")
    run.add_argument("--seed", type=int, default=0)
    run.add_argument("--levels", type=int, help="most sizes per cause that are simulated; default: 9, or 17 "
                     "where predictions are tabulated")  # fmt: skip
    run.add_argument("--jobs", type=int, default=1, help="processes for the simulations")
    run.add_argument("--fresh", action="store_true", help="forget the simulated values in DIR; they are kept there, so "
                     "that a run goes on after a kill")  # fmt: skip
    run.add_argument("--pool", type=Path, metavar="CSV", help="specimens that could be tested next; default: "
                     "repeats of those in the file")  # fmt: skip
    run.add_argument("--next", type=int, default=4, metavar="K", help="number of next tests; default: 4")
    run.add_argument("--rehearse", type=int, default=0, metavar="N", help="blind trials on this design")
    run.add_argument("--no-checks", action="store_true", help="skip judging the data again without each specimen")
    analysis_options(command)
    command.set_defaults(run=_diagnose)


def _diagnose(options: argparse.Namespace) -> int:
    from limitmason.cli import diagnosis_data as data
    from limitmason.cli.series import write_template

    if options.template:
        write_template(options.template, options.model)
        say(f"wrote {options.template}: replace its rows, keep the row of units, then `limitmason diagnose`")
        return 0
    case = data.read_case(options, settings_of(options))
    if options.out.exists() and not options.out.is_dir():
        raise ValueError(f"--out {options.out} is a file; name a folder")
    from limitmason.diagnosis import Study

    store = options.out / "simulations.jsonl"
    if options.fresh:
        store.unlink(missing_ok=True)
    study = Study(
        case.specimens, case.simulate, case.measured, case.noise, case.nuisance, case.covariates, case.groups,
        levels=options.levels or case.levels, n_jobs=options.jobs, cache=store, version=case.version,
    )  # fmt: skip
    study.simulator.progress = _Progress(study.n, len(case.causes))
    say(f"{case.title}: {study.n} values, noise {study.noise}, {len(case.causes)} causes: "
        f"{', '.join(c.name for c in case.causes)}")  # fmt: skip
    verdict = study.diagnose(case.causes, seed=options.seed)
    say(f"{study.simulator.calls} simulations")
    pool = case.pool if case.pool is not None else case.specimens
    tests = verdict.next_tests(pool, k=min(options.next, len(pool))) if options.next > 0 else None
    rehearsal = None
    if options.rehearse > 0:
        say(f"{options.rehearse} blind trials")
        rehearsal = study.rehearse(case.causes, n=options.rehearse, seed=options.seed)
    if not options.no_checks:
        say("judging again under other statements of the noise and without each specimen")
    _write(options, case, verdict, tests, rehearsal)
    return 0


def _write(options: argparse.Namespace, case: Any, verdict: Any, tests: Any, rehearsal: Any) -> None:
    from limitmason import figures

    text = f"{case.title}\n\n" + verdict.report(checks=not options.no_checks)
    if tests is not None:
        where = "in the pool" if case.pool is not None else "in the data, to be repeated"
        text += f"\n\nNext tests, {tests.reason}: rows {', '.join(str(i + 1) for i in tests.indices)} {where}."
        if tests.pairs:
            text += f" Smallest d2 over the pairs: {tests.before:.1f} before, {tests.after:.1f} after."
    text += "".join(f"\n{note}" for note in ["", *case.notes])
    show_text(text)
    out = options.out
    out.mkdir(parents=True, exist_ok=True)
    (out / "report.txt").write_text(text + "\n", encoding="utf-8")
    picture = figures.diagnosis(verdict, units=case.units, quantity=case.quantity, title=case.title)
    picture.savefig(out / "diagnosis.png", dpi=200)
    figures.confusable(verdict.distances, title=case.title).savefig(out / "confusable.png", dpi=200)
    if rehearsal is not None:
        figures.rehearsal(rehearsal, title=case.title).savefig(out / "rehearsal.png", dpi=200)
    _write_causes(out / "causes.csv", verdict)
    figures.diagnosis_page(
        verdict, out / "diagnosis.html", title=case.title, units=case.units, quantity=case.quantity, next_tests=tests,
        rehearsal=rehearsal, notes=case.notes, checks=not options.no_checks, figure=picture,
    )  # fmt: skip
    for name in ("report.txt", "diagnosis.html", "diagnosis.png", "confusable.png", "rehearsal.png", "causes.csv"):
        if (out / name).exists() and (name != "rehearsal.png" or rehearsal is not None):
            say(f"wrote {out / name}")


def _write_causes(path: Path, verdict: Any) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["cause", "acts on", "unit of size", "kept", "size", "low", "high", "log-likelihood gain",
                         "p deficit", "p trend", "p scatter"])  # fmt: skip
        writer.writerow(["-", "-", "-", "-", "unit", "unit", "unit", "-", "-", "-", "-"])
        for row in verdict.table():
            ends = row["interval"] or [("", "")] * len(row["size"])
            sizes, low, high = (
                " + ".join(f"{v:.6g}" if v != "" else "" for v in part).strip(" +")
                for part in (row["size"], [e[0] for e in ends], [e[1] for e in ends])
            )
            chances = ["" if row[f"p_{k}"] is None else f"{row[f'p_{k}']:.4f}" for k in ("deficit", "shape", "scatter")]
            kept = "yes" if row["kept"] else "no"
            writer.writerow([row["cause"], row["acts_on"], row["unit"], kept, sizes, low, high, f"{row['gain']:.4f}",
                             *chances])  # fmt: skip


class _Progress:
    """Says now and then how many simulations are done."""

    def __init__(self, specimens: int, causes: int, every: float = 10.0) -> None:
        self.every, self.last = every, time.monotonic()
        self.about = f"{specimens} specimens x {causes} causes x a few sizes"

    def __call__(self, calls: int) -> None:
        if time.monotonic() - self.last >= self.every:
            self.last = time.monotonic()
            say(f"{calls} simulations done ({self.about})")
