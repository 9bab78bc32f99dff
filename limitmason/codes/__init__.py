"""Verdicts of codes of practice on capacities of this package.

Every code is a file.
"""

from limitmason.codes.circular_2019 import Assessment, assess
from limitmason.codes.spectra import FloorSpectrum, GroundSpectrum, RecordSpectrum
from limitmason.display.notebook import shows

__all__ = ["Assessment", "FloorSpectrum", "GroundSpectrum", "RecordSpectrum", "assess"]

shows(__name__)
