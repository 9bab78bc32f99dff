"""Capacity curves: a static path past the limit points, by cone programs with a Newton finish on the DEM's joint law."""

from limitmason.pushover.analysis import pushover
from limitmason.pushover.certificate import StepCertificate
from limitmason.pushover.path import Steps
from limitmason.pushover.result import Energy, PushoverCurve

__all__ = ["Energy", "PushoverCurve", "StepCertificate", "Steps", "pushover"]
