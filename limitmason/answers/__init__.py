"""What methods return: predictions with bound and certificate, curves, and the papers behind them."""

from limitmason.answers.acceptance import Certificate
from limitmason.answers.curve import Curve, CurvePoint, Event
from limitmason.answers.references import Citation, Cited, Reference
from limitmason.answers.results import (
    NO_TILT,
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
from limitmason.display.notebook import shows

__all__ = [
    "NO_TILT", "Bound", "BoundKind", "Certificate", "Citation", "Cited", "ContactModel", "Curve", "CurvePoint", "Event",
    "FlowRule", "Mechanism", "Prediction", "Range", "Reference", "Resultants", "Status",
]

shows(__name__)
