"""The page ``methods.md``, every packaged case by every theory: an hour; or the table of ``predicted.md``: minutes.

    python -m validation.every_case --store FOLDER --markdown docs/methods.md --csv docs/methods.csv
    python -m validation.every_case --summary

Answers are kept in FOLDER; a run that was cut off goes on with them.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from limitmason.constants import VERSION
from limitmason.methods import COMPARED_METHODS

from . import as_markdown, cases, not_covered, solve_cases, summary_table, write_csv


def main(arguments: Sequence[str] | None = None) -> None:
    """Make what is missing and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--summary", action="store_true", help="the table of predicted.md instead, by limit analysis")
    parser.add_argument("--source", help="only this source")
    parser.add_argument("--specimen", help="only cases of this specimen")
    parser.add_argument("--methods", nargs="+", choices=COMPARED_METHODS, default=COMPARED_METHODS, metavar="METHOD")
    parser.add_argument("--thorough", action="store_true", help="whole error budgets, longer search, proven ranges")
    parser.add_argument("--store", type=Path, metavar="FOLDER", help="keep answers here and go on after a kill")
    parser.add_argument("--workers", type=int, default=1, help="processes, one case each; needs --store")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the page here, not to the terminal")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="also write one line per case and theory")
    chosen = parser.parse_args(arguments)
    if chosen.summary:
        print(summary_table(progress=print))
        return
    wanted = cases(chosen.source, specimen=chosen.specimen)
    if not wanted:
        parser.error(f"no packaged case with a model is called {chosen.source} {chosen.specimen}")
    found = solve_cases(
        wanted, chosen.methods, thorough=chosen.thorough, store=chosen.store, workers=chosen.workers, progress=print
    )
    missing = () if chosen.source or chosen.specimen else not_covered()
    page = as_markdown(found, missing, version=VERSION, thorough=chosen.thorough)
    if chosen.markdown:
        chosen.markdown.write_text(page, encoding="utf-8")
    else:
        print(page)
    if chosen.csv:
        write_csv(found, chosen.csv)


if __name__ == "__main__":
    main()
