"""What is kept of the runs beside the examples: a line per run, made from the stores of the runs."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from limitmason import study
from limitmason.model.assembly import Assembly
from limitmason.storage.csv_table import parsed, write_table

Array = NDArray[np.float64]

STORED = Path(__file__).parents[2] / "examples" / "stored" / "stochastic_panels.csv"
NUMBERS = {
    "ultimate": "N", "load": "kN", "at": "m", "crack": "N", "failure": "N", "residual": "N", "stiffness": "N/m",
    "kinetic": "-", "lone": "-", "lone at end": "-", "far": "N",
}
"""What is kept of a run with its unit: "load" is that of perfect plasticity, "far" the peak within the first travel."""
WORDS = ("mode", "mode at peak", "crack in")


def mirrored(wall: Assembly) -> NDArray[np.intp]:
    """Number of the joint that lies opposite every joint of a symmetric wall in the x-z plane."""
    centre = wall.arrays.centre[:, [0, 2]]
    middle = 0.5 * (centre[:, 0].min() + centre[:, 0].max())
    far, at = cKDTree(centre).query(np.column_stack([2.0 * middle - centre[:, 0], centre[:, 1]]))
    if far.max() > 1e-6:
        raise ValueError(f"the wall is not symmetric: a joint lacks its image by {far.max():.3g} m")
    return np.asarray(at, dtype=np.intp)


def lone(moved: Array, area: Array, opposite: NDArray[np.intp]) -> float:
    """Part of the movement of all joints that has no mirror image [-]: 0 of a symmetric mechanism, 1 of one side alone.

    sum |a_j m_j - a_k m_k| / (2 sum a_j m_j), k opposite j

    Parameters
    ----------
    moved : opening and slip of every joint since own weight [m], shape (k,)
    area : [m2], shape (k,)
    opposite : from :func:`mirrored`
    """
    volume = moved * area
    total = float(volume.sum())
    return float(np.abs(volume - volume[opposite]).sum()) / (2.0 * total) if total > 0.0 else math.nan


def line(row: Mapping[str, Any], wall: Assembly, opposite: NDArray[np.intp]) -> dict[str, Any]:
    """What is kept of one run."""
    out = {name: _number(row.get(name)) for name in NUMBERS if name not in ("lone", "lone at end", "far")}
    for name, when in (("lone", "peak"), ("lone at end", "end")):
        out[name] = math.nan
        if f"opening at {when}" in row:
            both = ([max(v or 0, 0) for v in row[f"{what} at {when}"]] for what in ("opening", "slip"))
            out[name] = lone(np.sum(list(both), axis=0), wall.arrays.area, opposite)
    # where the run went twice as far, the peak within the first travel
    out["far"] = _number(row.get("ultimate at 1.5 mm"))
    return {**out, **{name: str(row.get(name, "")) for name in WORDS}}


def _number(value: Any) -> float:
    return math.nan if value is None or value == "" else float(value)


def read_store(path: Path) -> dict[int, dict[str, Any]]:
    """Rows of a store by the number of the sample, whichever study; a line cut off by a kill is left out."""
    out = {}
    for text in path.read_text(encoding="utf-8").split("\n")[1:-1]:
        entry = json.loads(text)
        out[int(entry["key"])] = entry["row"]
    return out


def from_stores(folder: Path, wall: Assembly) -> dict[str, study.Table]:
    """Lines of all studies in a folder, by name."""
    opposite, found = mirrored(wall), {}
    for path in sorted(folder.glob("*.jsonl")):
        own = read_store(path)
        if path.stem == "mean-set":
            # number and nudge in one, so that every line of a study has a number of its own
            own = {100 * int(r["number"]) + int(r["nudge"]): r for r in own.values()}
        found[path.stem] = study.Table(tuple({"sample": k, **line(own[k], wall, opposite)} for k in sorted(own)))
    return found


def folded(tables: Mapping[str, study.Table], newer: Mapping[str, study.Table]) -> dict[str, study.Table]:
    """Tables with newer lines in the place of older ones of the same sample, up to the first sample that is missing."""
    out = {}
    for name in sorted({*tables, *newer}):
        every = {r["sample"]: r for t in (tables, newer) for r in t.get(name, ())}
        whole = [k for place, k in enumerate(sorted(every)) if name == "mean-set" or k == place]
        out[name] = study.Table(tuple(every[k] for k in whole))
    return out


def write(tables: Mapping[str, study.Table], path: Path = STORED) -> None:
    """Write the kept lines; numbers to seven digits."""
    lines = []
    for name, table in tables.items():
        for r in table:
            numbers = ("" if math.isnan(v) else f"{v:.7g}" for v in (_number(r.get(k)) for k in NUMBERS))
            lines.append([name, r["sample"], *numbers, *(r.get(k, "") for k in WORDS)])
    write_table(path, {"study": "-", "sample": "-", **NUMBERS, **dict.fromkeys(WORDS, "-")}, lines)


def read(path: Path = STORED) -> dict[str, study.Table]:
    """Tables by name from the kept lines."""
    found: dict[str, list[dict[str, Any]]] = {}
    kept = parsed(path.read_text(encoding="utf-8"), path.name)
    for cells in kept.rows:
        r = dict(zip(kept.header, cells, strict=True))
        numbers = {k: _number(r.get(k)) for k in NUMBERS}
        words = {k: r.get(k, "") for k in WORDS}
        found.setdefault(r["study"], []).append({"sample": int(r["sample"]), **numbers, **words})
    return {name: study.Table(tuple(own)) for name, own in found.items()}
