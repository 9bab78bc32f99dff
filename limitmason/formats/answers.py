"""Predictions as JSON: multiplier, bound, status, certificate, mechanism, joint forces, warnings and provenance.

Numbers that are not finite (a multiplier that does not exist, a gap that does not apply) are written as the texts
"Infinity", "-Infinity" and "NaN", because JSON has no form for them; what a method does not give is null.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.answers.acceptance import Certificate
from limitmason.answers.references import Citation, Cited, Reference, given_fields
from limitmason.answers.results import (
    Bound,
    BoundKind,
    ContactModel,
    FlowRule,
    Mechanism,
    Prediction,
    Range,
    Resultants,
    Status,
)
from limitmason.errors import InputError
from limitmason.formats.document import DocumentNode, plain, read_document, restored, write_document
from limitmason.model import Assembly

SCHEMA, VERSION = "limitmason-prediction", 2
UNITS = {
    "twists": "m/s, rad/s up to a common factor", "opening": "m/s", "sliding": "m/s", "normal": "N", "shear": "N",
    "moment": "N m", "torsion": "N m", "point_position": "m", "point_force": "N",
}  # fmt: skip
_KEYS = (
    "schema", "version", "units", "method", "collapse_multiplier", "bound", "bound_kind", "status", "warnings",
    "certificate", "blocks", "mechanism", "resultants", "provenance", "details", "flow_rule", "contact_model", "plane",
    "stress_block", "governing", "error_budget", "range", "lost_in_failure", "references",
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
        "bound": str(prediction.bound),
        "bound_kind": str(prediction.bound.kind),
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
    document |= {
        "flow_rule": None if prediction.flow_rule is None else str(prediction.flow_rule),
        "contact_model": None if prediction.contact_model is None else str(prediction.contact_model),
        "plane": prediction.plane, "stress_block": prediction.stress_block, "governing": prediction.governing,
        "error_budget": plain(prediction.error_budget, "error_budget", strict=False),
        "range": plain(prediction.range._asdict(), "range"),
        "lost_in_failure": list(prediction.lost_in_failure),
        "references": [{"role": c.role, **given_fields(c.reference)} for c in prediction.references],
    }  # fmt: skip
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
    InputError
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
    provenance = restored(node["provenance"].mapping()) if "provenance" in node else {}
    details = restored(node["details"].mapping()) if "details" in node else {}
    return Prediction(
        method=node["method"].text(),
        collapse_multiplier=node["collapse_multiplier"].number(),
        bound=_bound(node),
        status=_chosen(node["status"], Status),
        mechanism=_arrays(node, "mechanism", Mechanism, {"twists": (6,), "sliding": (2,)}),
        resultants=_arrays(
            node, "resultants", Resultants,
            {"shear": (2,), "moment": (2,), "point_position": (3,), "point_force": (3,)},
        ),
        certificate=certificate,
        warnings=tuple(w.text() for w in node.get("warnings") or ()),
        provenance=provenance,
        details=details,
        **(_typed(node) if node["version"].value > 1 else _typed_of_0_1(provenance, details)),
    )  # fmt: skip


def _chosen(node: DocumentNode, kind: type[StrEnum]) -> Any:
    """A value of a closed set."""
    if node.text() not in tuple(kind):
        raise node.error(f"expected one of {', '.join(kind)}, got {node.text()!r}")
    return kind(node.text())


def _bound(node: DocumentNode) -> Bound:
    """The bound with its kind; files of 0.1 hold its words alone."""
    words = node["bound"].text()
    return Bound(_chosen(node["bound_kind"], BoundKind), words) if "bound_kind" in node else Bound.from_text(words)


def _typed(node: DocumentNode) -> dict[str, Any]:
    """Typed fields of a prediction; keys that are missing keep their defaults."""
    out: dict[str, Any] = {}
    for key, kind in (("flow_rule", FlowRule), ("contact_model", ContactModel)):
        if key in node:
            out[key] = _chosen(node[key], kind)
    for key in ("plane", "stress_block"):
        if key in node:
            if not isinstance(node[key].value, bool):
                raise node[key].error("expected true or false")
            out[key] = node[key].value
    if "governing" in node:
        out["governing"] = node["governing"].text() if node["governing"].value else ""
    if "error_budget" in node:
        out["error_budget"] = restored(node["error_budget"].mapping())
    if "lost_in_failure" in node:
        out["lost_in_failure"] = tuple(w.text() for w in node["lost_in_failure"])
    if "references" in node:
        out["references"] = tuple(_cited(entry) for entry in node["references"])
    if "range" in node:
        part = node["range"]
        part.mapping(Range._fields)
        meaning = part["meaning"]
        out["range"] = Range(part["low"].number(), part["high"].number(), meaning.text() if meaning.value else "")
    return out


def _cited(node: DocumentNode) -> Cited:
    """A paper and what it is cited for."""
    names = [f.name for f in fields(Reference)]
    node.mapping(["role", *names])
    given: dict[str, Any] = {k: v.text() for k, v in node.items() if k in names and k not in ("authors", "year")}
    authors = tuple(a.text() for a in node.get("authors") or ())
    year = int(node["year"].number()) if "year" in node else None
    try:
        return Citation([Cited(node["role"].text(), Reference(**given, authors=authors, year=year))])[0]
    except (InputError, TypeError) as wrong:
        raise node.error(str(wrong)) from None


def _typed_of_0_1(provenance: Mapping[str, Any], details: Mapping[str, Any]) -> dict[str, Any]:
    """The same of a file of 0.1, which held them in provenance and details only."""
    out: dict[str, Any] = {
        "plane": bool(provenance.get("plane", False)), "stress_block": provenance.get("crushing") == "stress block",
        "governing": str(details.get("governing") or ""), "error_budget": details.get("error budget") or {},
    }  # fmt: skip
    if provenance.get("flow_rule") in tuple(FlowRule):
        out["flow_rule"] = FlowRule(provenance["flow_rule"])
    if provenance.get("contact_model") in tuple(ContactModel):
        out["contact_model"] = ContactModel(provenance["contact_model"])
    return out


def _arrays(node: DocumentNode, key: str, kind: Any, columns: dict[str, Sequence[int]]) -> Any:
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
