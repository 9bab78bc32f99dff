"""Runs behind the block sections of the page of the U walls, kept beside this file, and those sections.

python -m validation.u_wall_blocks identify [NAME ...]    records and modes, a minute a run on an idle core
python -m validation.u_wall_blocks push [NAME ...]        pushes with other joints, a quarter of a minute each
python -m validation.u_wall_blocks page                   sections of docs/papers/u-walls.md from what is kept

A run that is kept is not made again unless it is named.
"""

import argparse
from pathlib import Path

from . import identification, page, pushed

STUDIES = {"identify": identification, "push": pushed}
PAGE = Path("docs/papers/u-walls.md")


def main() -> None:
    """Run and keep, or write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=(*STUDIES, "page"))
    parser.add_argument("names", nargs="*", help="of runs to make again; what is missing by default")
    chosen = parser.parse_args()
    if chosen.what == "page":
        text = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(text.partition(page.FIRST)[0].rstrip("\n") + "\n\n" + page.sections(), encoding="utf-8")
        return
    study = STUDIES[chosen.what]
    unknown = set(chosen.names) - {c.name for c in study.CASES}
    if unknown:
        parser.error(f"no run called {', '.join(sorted(unknown))}; known: {', '.join(c.name for c in study.CASES)}")
    study.make(chosen.names, print)


if __name__ == "__main__":
    main()
