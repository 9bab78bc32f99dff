"""The page of the brick panels' paper, ``panels.md``: minutes for what is kept, hours for the whole.

    python -m validation.brick_panels --store FOLDER --out docs/papers

Answers are kept in FOLDER; a run that was cut off goes on with them.
"""

import argparse
from pathlib import Path

from .page import page


def main() -> None:
    """Make what is missing and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--store", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--out", type=Path, default=Path("docs/papers"), metavar="FOLDER")
    chosen = parser.parse_args()
    text = page(store=chosen.store, progress=print)
    (chosen.out / "panels.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
