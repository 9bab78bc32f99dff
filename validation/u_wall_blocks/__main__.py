"""Make what is missing of the runs behind the page of the U walls, and keep it beside this file.

python -m validation.u_wall_blocks identify [NAME ...]    records and modes, about three minutes a run
"""

import argparse

from . import identification

STUDIES = {"identify": identification}


def main() -> None:
    """Run and keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", choices=tuple(STUDIES))
    parser.add_argument("names", nargs="*", help="of runs to make again; what is missing by default")
    chosen = parser.parse_args()
    study = STUDIES[chosen.study]
    unknown = set(chosen.names) - {c.name for c in study.CASES}
    if unknown:
        parser.error(f"no run called {', '.join(sorted(unknown))}; known: {', '.join(c.name for c in study.CASES)}")
    study.make(chosen.names, print)


if __name__ == "__main__":
    main()
