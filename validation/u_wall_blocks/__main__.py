"""Runs behind the block sections of the page of the U walls, kept beside this file, and those sections.

python -m validation.u_wall_blocks identify [NAME ...]    records and modes, a minute a run on an idle core
python -m validation.u_wall_blocks push [NAME ...]        pushes with other joints, a quarter of a minute each; five of
                                                          stones at rest
python -m validation.u_wall_blocks onset [NAME ...]       points that give way first, seconds each
python -m validation.u_wall_blocks places [NAME ...]      where the walls have cracked at the end, seconds each
python -m validation.u_wall_blocks page                   sections of docs/papers/u-walls.md from what is kept

A run that is kept is not made again unless it is named.
"""

from pathlib import Path

from ..kept_runs import command, make, refuse_unknown
from . import identification, onset, page, places, pushed

STUDIES = {"identify": identification, "push": pushed, "onset": onset, "places": places}
PAGE = Path("docs/papers/u-walls.md")


def main() -> None:
    """Run and keep, or write."""
    parser = command(__doc__, (*STUDIES, "page"))
    chosen = parser.parse_args()
    if chosen.what == "page":
        text = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(text.partition(page.FIRST)[0].rstrip("\n") + "\n\n" + page.sections(), encoding="utf-8")
        return
    study = STUDIES[chosen.what]
    refuse_unknown(parser, chosen.names, study.CASES)
    make(study, chosen.names, print)


if __name__ == "__main__":
    main()
