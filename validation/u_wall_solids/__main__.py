"""Runs behind the table of readings on the page of the U walls, kept beside this file.

python -m validation.u_wall_solids [NAME ...]    makes what is missing, or the runs that are named; seconds each

The page itself is made by ``python -m validation.u_walls``.
"""

import argparse

from . import readings


def main() -> None:
    """Run and keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="of readings to run again; what is missing by default")
    chosen = parser.parse_args()
    unknown = set(chosen.names) - {r.name for r in readings.READINGS}
    if unknown:
        parser.error(f"no reading called {', '.join(sorted(unknown))}")
    readings.make(chosen.names, print)


if __name__ == "__main__":
    main()
