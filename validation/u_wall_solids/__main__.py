"""Runs behind the table of readings on the page of the U walls, kept beside this file.

python -m validation.u_wall_solids [NAME ...]    makes what is missing, or the runs that are named; seconds each
python -m validation.u_wall_solids --cost        what an iteration costs with 450 to 17,000 bricks; minutes, 5 GB
python -m validation.u_wall_solids --whole SIZE  REGW to 6 mm on bricks of a size [m]; with --kept DIR it can be gone on

The page itself is made by ``python -m validation.u_walls``.
"""

from pathlib import Path

from ..kept_runs import command, refuse_unknown
from . import cost, readings, whole


def main() -> None:
    """Run and keep."""
    parser = command(__doc__)
    parser.add_argument("--cost", action="store_true", help="measure the meshes whose cost is not kept")
    parser.add_argument("--whole", type=float, metavar="SIZE", help="push REGW to 6 mm on bricks of a size [m]")
    parser.add_argument("--kept", type=Path, help="folder of the states of such a path")
    chosen = parser.parse_args()
    refuse_unknown(parser, chosen.names, readings.READINGS)
    if chosen.whole is not None:
        whole.make(chosen.whole, print, chosen.kept)
        return
    if chosen.cost:
        cost.make(print)
        return
    readings.make(chosen.names, print)


if __name__ == "__main__":
    main()
