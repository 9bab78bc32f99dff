"""Limit analysis as two methods: associative flow, and that of the joints."""

from functools import partial

from limitmason.answers.method import Look, Method, settings_of
from limitmason.answers.results import FlowRule
from limitmason.limit import papers
from limitmason.limit.analysis import limit_analysis
from limitmason.limit.nonassociative.analysis import solve_nonassociative

_LEVERS = (
    "friction", "friction of single joints", "cohesion", "tension", "faces", "blocks", "weights", "displaced blocks",
    "direction of loads", "overload", "reading",
)

ASSOCIATIVE = Method(
    "associative",
    partial(limit_analysis, flow_rule=FlowRule.ASSOCIATIVE),
    settings_of("AssociativeSettings", limit_analysis),
    look=Look("limit analysis,\nassociative", "BLUE", "v"),
    theorem="upper",
    references=papers.ASSOCIATIVE,
    levers=(*_LEVERS, "torsion"),
    plane_levers=("crushing",),  # in space the corners of a face cannot represent it
)

NON_ASSOCIATIVE = Method(
    "non-associative",
    partial(limit_analysis, flow_rule=FlowRule.NON_ASSOCIATIVE),
    settings_of("NonAssociativeSettings", limit_analysis, solve_nonassociative),
    look=Look("limit analysis,\nnon-associative", "SKY", "^"),
    kept=("radenkovic",),
    theorem="admissible",
    references=papers.NON_ASSOCIATIVE,
    levers=(*_LEVERS, "dilatancy"),  # crushing on a grid only
)
