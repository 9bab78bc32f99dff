"""Runs behind the table of readings on the page of the U walls, kept beside this file.

python -m validation.u_wall_solids [NAME ...]    makes what is missing, or the runs that are named; seconds each

The page itself is made by ``python -m validation.u_walls``.
"""

from ..kept_runs import command, refuse_unknown
from . import readings


def main() -> None:
    """Run and keep."""
    parser, chosen = command(__doc__)
    refuse_unknown(parser, chosen.names, readings.READINGS)
    readings.make(chosen.names, print)


if __name__ == "__main__":
    main()
