"""Capacity curves: static paths past limit points, by cone programs with a Newton finish on the DEM's joint law."""

from limitmason.capacity.analysis import pushover
from limitmason.capacity.certificate import StepCertificate
from limitmason.capacity.ensemble import Ensemble, imperfection_ensemble
from limitmason.capacity.path import Steps
from limitmason.capacity.result import Break, Energy, PushoverCurve, Stability

__all__ = [
    "Break",
    "Energy",
    "Ensemble",
    "PushoverCurve",
    "Stability",
    "StepCertificate",
    "Steps",
    "imperfection_ensemble",
    "pushover",
]
