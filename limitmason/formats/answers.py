"""Predictions as JSON: multiplier, bound, status, certificate, mechanism, joint forces, warnings and provenance.

Numbers that are not finite (a multiplier that does not exist, a gap that does not apply) are written as the texts
"Infinity", "-Infinity" and "NaN", because JSON has no form for them; what a method does not give is null.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

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
    Reaction,
    Resultants,
)
from limitmason.checks import instance
from limitmason.formats.document import DocumentNode, plain, read_document, write_document
from limitmason.model import Assembly

SCHEMA, VERSION = "limitmason-prediction", 2
_V0_1 = 1  # version of the files of limitmason 0.1
UNITS = {
    "twists": "m/s, rad/s up to a common factor", "opening": "m/s", "sliding": "m/s", "normal": "N", "shear": "N",
    "moment": "N m", "torsion": "N m", "point_position": "m", "point_force": "N",
}


def write_prediction(path: str | Path, prediction: Prediction, *, assembly: Assembly | None = None) -> None:
    """Write a prediction.

    :func:`read_prediction` returns it with every number unchanged.

    Parameters
    ----------
    path : of the file
    prediction : to be written; entries of its provenance and details that are not plain data are kept as text
    assembly : its block names go into the file, so that the rows of the twists can be told apart
    """
    instance("prediction", prediction, Prediction)
    names = {} if assembly is None else {"blocks": [b.name for b in assembly.blocks]}
    held = {f.name: getattr(prediction, f.name) for f in fields(prediction) if f.name not in ("structure", "loads")}
    document: dict[str, Any] = {
        "schema": SCHEMA, "version": VERSION, "units": UNITS, **names, "bound_kind": str(prediction.bound.kind),
        **{name: plain(value, name, strict=False) for name, value in held.items()},
        "collapse_multiplier": plain(float(prediction.collapse_multiplier), "collapse_multiplier"),
        "range": plain(prediction.range._asdict(), "range"),
        "reaction": None if prediction.reaction is None else plain(prediction.reaction._asdict(), "reaction"),
        "references": [{"role": c.role, **given_fields(c.reference)} for c in prediction.references],
    }
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
    for key in ("method", "collapse_multiplier", "bound", "status"):
        node[key]  # an error where it is not there
    elsewhere = ("schema", "version", "units", "blocks", "structure", "loads", "bound", "bound_kind")
    values = node.values(
        Prediction, **dict.fromkeys(elsewhere),
        mechanism=partial(_arrays, kind=Mechanism, columns={"twists": (6,), "sliding": (2,)}),
        resultants=partial(_arrays, kind=Resultants, columns={
            "shear": (2,), "moment": (2,), "point_position": (3,), "point_force": (3,),
        }),
        certificate=lambda part: part.make(Certificate, **part.values(Certificate)),
        range=lambda part: part.make(Range, **part.values(Range)),
        reaction=lambda part: part.make(Reaction, **part.values(Reaction)),
        references=lambda part: tuple(map(_cited, part)),
    )
    if node["version"].value == _V0_1:
        values = _typed_of_0_1(values.get("provenance", {}), values.get("details", {})) | values
    words = node["bound"].text()
    # files of 0.1 give the bound in words alone
    kind = node["bound_kind"].read(BoundKind) if "bound_kind" in node else None
    return node.make(Prediction, bound=Bound(kind, words) if kind else Bound.from_text(words), **values)


def _cited(node: DocumentNode) -> Cited:
    """A paper and what it is cited for, from its entry."""
    values = node.values(Reference, role=DocumentNode.text)
    # a citation refuses an unknown role
    return node.make(lambda role, **given: Citation([Cited(role, Reference(**given))])[0], **values)


def _typed_of_0_1(provenance: Mapping[str, Any], details: Mapping[str, Any]) -> dict[str, Any]:
    """Typed fields of a file of 0.1, which held them in provenance and details only."""
    out: dict[str, Any] = {
        "plane": bool(provenance.get("plane", False)), "stress_block": provenance.get("crushing") == "stress block",
        "governing": str(details.get("governing") or ""), "error_budget": details.get("error budget") or {},
    }
    if provenance.get("flow_rule") in tuple(FlowRule):
        out["flow_rule"] = FlowRule(provenance["flow_rule"])
    if provenance.get("contact_model") in tuple(ContactModel):
        out["contact_model"] = ContactModel(provenance["contact_model"])
    return out


def _arrays(node: DocumentNode, *, kind: type, columns: Mapping[str, tuple[int, ...]]) -> Any:
    """A result that holds arrays, from its entry.

    Parameters
    ----------
    node : the entry
    kind : the class of the result
    columns : of arrays with columns, their number by name: JSON has no shape for an array without rows
    """
    values = node.values(kind)
    return node.make(kind, **{k: v if v.size else v.reshape(0, *columns.get(k, ())) for k, v in values.items()})
