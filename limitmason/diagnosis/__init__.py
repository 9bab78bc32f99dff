"""Diagnosis: what a simulation gets wrong, named with its size, or not to be told.

A bootstrap confidence set of physical causes. It works for any ``simulate(specimen, **parameters)`` that returns a
positive prediction of what was measured; see :class:`Study`.
"""

from limitmason.causes import Cause, Extension
from limitmason.diagnosis.error_rates import Rehearsal, binomial_interval
from limitmason.diagnosis.inference.next_tests import Confusable, NextTests
from limitmason.diagnosis.inference.noise import Measured, Noise
from limitmason.diagnosis.inference.verdict import Rule
from limitmason.diagnosis.investigation import Investigation, investigate
from limitmason.diagnosis.observations import EvidenceKind, Observation
from limitmason.diagnosis.report import Diagnosis
from limitmason.diagnosis.study import Study
from limitmason.display.notebook import shows

__all__ = [
    "Cause", "Confusable", "Diagnosis", "EvidenceKind", "Extension", "Investigation", "Measured", "NextTests", "Noise",
    "Observation", "Rehearsal", "Rule", "Study", "binomial_interval", "investigate",
]

shows(__name__)
