"""Capacity curves: static paths past limit points, by cone programs with a Newton finish on the DEM's joint law."""

from limitmason.answers.curve import Energy
from limitmason.capacity.analysis import pushover
from limitmason.capacity.certificate import StepCertificate
from limitmason.capacity.elastic_range import ElasticRange, Onset, elastic_range
from limitmason.capacity.ensemble import Ensemble, imperfection_ensemble
from limitmason.capacity.result import Break, PushoverCurve, SampleStability
from limitmason.capacity.step_length import Steps
from limitmason.display.notebook import shows

__all__ = [
    "Break",
    "ElasticRange",
    "Energy",
    "Ensemble",
    "Onset",
    "PushoverCurve",
    "SampleStability",
    "StepCertificate",
    "Steps",
    "elastic_range",
    "imperfection_ensemble",
    "pushover",
]

shows(__name__)
