"""Limit analysis of rigid-block assemblies as cone programs, and what bounds what."""

from limitmason.display.notebook import shows
from limitmason.limit.analysis import limit_analysis
from limitmason.limit.axles import AxleEnvelope, axle_envelope
from limitmason.limit.least_thickness import minimum_thickness
from limitmason.limit.load_regions import load_region
from limitmason.limit.load_set import LoadRegion
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.limit.range.bracket import Bracket, limit_bracket
from limitmason.limit.range.proven_range import ProvenRange, proven_range
from limitmason.limit.settlement import settlement_analysis
from limitmason.limit.strengthening import Strengthening, strengthen
from limitmason.limit.thrust_range import Thrust, thrust

__all__ = [
    "AxleEnvelope",
    "Bracket",
    "LoadRegion",
    "Problem",
    "ProvenRange",
    "Strengthening",
    "Thrust",
    "axle_envelope",
    "limit_analysis",
    "limit_bracket",
    "load_region",
    "make_problem",
    "minimum_thickness",
    "proven_range",
    "settlement_analysis",
    "strengthen",
    "thrust",
]

shows(__name__)
