"""A small model file to start from."""

import json
from itertools import pairwise
from pathlib import Path

from limitmason.errors import InputError
from limitmason.storage.files import write_text

_MODEL = """\
{
 "schema": "limitmason-model",
 "version": 1,
 "thickness": 0.3,
 "density": 2000.0,
 "joint": {"friction_angle_deg": 33.0, "dilatancy_angle_deg": 0.0},
 "fixed": ["ground"],
 "loads": {"horizontal": [1, 0, 0]},
 "names": [
NAMES
 ],
 "outlines": [
OUTLINES
 ]
}
"""


def write_model_template(path: str | Path) -> None:
    """Write a wall of six courses as a model file, to be edited by hand.

    Running bond, one line per block.

    Parameters
    ----------
    path : of the file, which must not be there yet

    Raises
    ------
    InputError
        Where the file exists: it may be somebody's work.
    """
    path = Path(path)
    if path.exists():
        raise InputError(f"{path} exists already; choose another name")
    stones = {"ground": [[-0.2, -0.2], [1.4, -0.2], [1.4, 0.0], [-0.2, 0.0]]}
    for course, ends in enumerate([[0, 0.4, 0.8, 1.2], [0, 0.2, 0.6, 1.0, 1.2]] * 3):
        low, high = round(0.2 * course, 3), round(0.2 * (course + 1), 3)
        for k, (left, right) in enumerate(pairwise(ends), 1):
            stones[f"stone-{course + 1}-{k}"] = [[left, low], [right, low], [right, high], [left, high]]
    rows = [[f"  {json.dumps(outline)}" for outline in stones.values()], [f'  "{name}"' for name in stones]]
    outlines, names = (",\n".join(r) for r in rows)
    write_text(path, _MODEL.replace("OUTLINES", outlines).replace("NAMES", names))
