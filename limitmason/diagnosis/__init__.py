"""Diagnosis: what a simulation gets wrong, named with its size, or an honest "the data cannot tell".

A bootstrap confidence set of physical causes. It works for any ``simulate(specimen, **parameters)`` that returns a
positive prediction of what was measured; see :class:`Study`.
"""

from importlib import import_module

from limitmason.diagnosis.cause import Cause, Extension
from limitmason.diagnosis.decide import Rule
from limitmason.diagnosis.noise import Measured, Noise
from limitmason.diagnosis.plan import Confusable, NextTests
from limitmason.diagnosis.rehearse import Rehearsal, binomial_interval
from limitmason.diagnosis.study import Study
from limitmason.diagnosis.verdict import Diagnosis

__all__ = [
    "Cause",
    "Confusable",
    "Diagnosis",
    "Extension",
    "Measured",
    "NextTests",
    "Noise",
    "Rehearsal",
    "Rule",
    "Study",
    "binomial_interval",
    "catalogue",
]


def __getattr__(name: str):
    """Import the catalogue of causes when it is first asked for: it needs the model, the statistics do not."""
    if name == "catalogue":
        return import_module("limitmason.diagnosis.catalogue")
    raise AttributeError(f"module 'limitmason.diagnosis' has no attribute {name!r}")
