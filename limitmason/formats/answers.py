"""Predictions as JSON: multiplier, bound, status, certificate, mechanism, joint forces, warnings and provenance.

Numbers that are not finite (a multiplier that does not exist, a gap that does not apply) are written as the texts
"Infinity", "-Infinity" and "NaN", because JSON has no form for them; what a method does not give is null.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.formats.document import Node, plain, read_document, restored, write_document
from limitmason.model import Assembly
from limitmason.results import Certificate, Mechanism, Prediction, Resultants

SCHEMA, VERSION = "limitmason-prediction", 1
UNITS = {
    "twists": "m/s, rad/s up to a common factor", "opening": "m/s", "sliding": "m/s", "normal": "N", "shear": "N",
    "moment": "N m", "torsion": "N m", "point_position": "m", "point_force": "N",
}  # fmt: skip
_KEYS = (
    "schema", "version", "units", "method", "collapse_multiplier", "bound", "status", "warnings", "certificate",
    "blocks", "mechanism", "resultants", "provenance", "details",
)  # fmt: skip


def write_prediction(path: str | Path, prediction: Prediction, *, assembly: Assembly | None = None) -> None:
    """Write a prediction; :func:`read_prediction` returns it with every number unchanged.

    Parameters
    ----------
    path : of the file
    prediction : to be written; entries of its provenance and details that are not plain data are kept as text
    assembly : its block names go into the file, so that the rows of the twists can be told apart
    """
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "version": VERSION,
        "units": UNITS,
        "method": prediction.method,
        "collapse_multiplier": plain(float(prediction.collapse_multiplier), "collapse_multiplier"),
        "bound": prediction.bound,
        "status": prediction.status,
        "warnings": list(prediction.warnings),
        "certificate": None if prediction.certificate is None else plain(prediction.certificate, "certificate"),
    }
    if assembly is not None:
        document["blocks"] = [b.name for b in assembly.blocks]
    for key in ("mechanism", "resultants"):
        part = getattr(prediction, key)
        document[key] = (
            None if part is None else {f.name: plain(getattr(part, f.name), f"{key}.{f.name}") for f in fields(part)}
        )
    document["provenance"] = plain(prediction.provenance, "provenance", strict=False)
    document["details"] = plain(prediction.details, "details", strict=False)
    write_document(path, document)


def read_prediction(path: str | Path) -> Prediction:
    """Read a prediction written by :func:`write_prediction`.

    Parameters
    ----------
    path : of the file

    Raises
    ------
    ValueError
        For malformed files; the message names file and key.
    """
    node = read_document(path, SCHEMA, VERSION)
    node.mapping(_KEYS)
    certificate = None
    if "certificate" in node:
        names = [f.name for f in fields(Certificate)]
        node["certificate"].mapping(names)
        given: dict[str, Any] = {
            k: v.text() if isinstance(v.value, str) and k.startswith("worst_") else v.number()
            for k, v in node["certificate"].items()
            if v.value is not None
        }
        certificate = Certificate(**given)
    return Prediction(
        method=node["method"].text(),
        collapse_multiplier=node["collapse_multiplier"].number(),
        bound=node["bound"].text(),
        status=node["status"].text(),
        mechanism=_arrays(node, "mechanism", Mechanism, {"twists": (6,), "sliding": (2,)}),
        resultants=_arrays(
            node, "resultants", Resultants,
            {"shear": (2,), "moment": (2,), "point_position": (3,), "point_force": (3,)},
        ),
        certificate=certificate,
        warnings=tuple(w.text() for w in node.get("warnings") or ()),
        provenance=restored(node["provenance"].mapping()) if "provenance" in node else {},
        details=restored(node["details"].mapping()) if "details" in node else {},
    )  # fmt: skip


def _arrays(node: Node, key: str, kind: Any, columns: dict[str, Sequence[int]]) -> Any:
    """A frozen result of arrays; the given widths shape what is empty."""
    if key not in node:
        return None
    part = node[key]
    part.mapping([f.name for f in fields(kind)])
    values = {}
    for f in fields(kind):
        rows = part[f.name]
        try:
            array = np.array(restored(rows.value), dtype=np.intp if f.name == "point_interface" else float)
        except (TypeError, ValueError):
            raise rows.error("expected numbers in rows of equal length") from None
        values[f.name] = array.reshape(0, *columns.get(f.name, ())) if array.size == 0 else array
    return kind(**values)
