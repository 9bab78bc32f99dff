"""Command of the blind trials across two codes, the DEM and limit analysis.

``python -m validation.blind.two_codes --make`` fills the store (it goes on where it stopped; half an hour of one core);
``python -m validation.blind.two_codes --seed 20261121 --scale 1`` runs the trials and writes `two_codes.md`.
"""

import argparse
import sys
import time
from pathlib import Path

from joblib import Parallel, delayed

from . import two_codes_report, two_codes_trials
from .small_walls import DEM, LIMIT
from .trials import Record


def main(arguments=None):
    """Fill the store, or run the trials and write the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--make", action="store_true", help="compute what is not stored yet, and nothing else")
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--scale", type=float, default=1.0, help="multiplies the number of trials")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".md"))
    given = parser.parse_args(arguments)
    if given.make:
        two_codes_trials.make()
        return
    start = time.perf_counter()
    records = {code: Record() for code in (DEM, LIMIT)}
    todo = two_codes_trials.jobs(given.seed, given.scale)
    answers = Parallel(n_jobs=given.workers, return_as="generator")(delayed(two_codes_trials.work)(job) for job in todo)
    for done, (code, more) in enumerate(answers, start=1):
        records[code].add(more)
        sys.stderr.write(f"\r{done} of {len(todo)} portions")
    sys.stderr.write("\n")
    text = two_codes_report.text(records, given.seed, time.perf_counter() - start)
    given.out.write_text(text, encoding="utf-8")
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
