"""What to cite for limit analysis: theory, search, and the solver used."""

from collections.abc import Mapping
from typing import Any

from limitmason.answers.references import METHOD, SOLVER, THEORY, Cited, cited
from limitmason.answers.results import FlowRule, Prediction

ASSOCIATIVE = cited(THEORY, "livesley1978", "radenkovic1961")
"""The static theorem on rigid blocks, and why its value bounds every other flow rule from above."""

NON_ASSOCIATIVE = (*ASSOCIATIVE, *cited(THEORY, "ferris2001"), *cited(METHOD, "gilbert2006"))
"""The problem with its complementarity, and the sequence of programs by which it is searched."""

_SOLVERS: Mapping[str, tuple[str, ...]] = {
    "clarabel": ("goulart2024",), "highs": ("huangfu2018",), "interior-point": ("mehrotra1992", "nesterov1997"),
    "cvxpy": ("diamond2016",),
}
"""By the name that ``provenance["solver"]`` gives."""


def solver_papers(names: str) -> tuple[Cited, ...]:
    """What to cite for solvers named as in ``provenance["solver"]``.

    Such names are "clarabel, HiGHS" or "cvxpy:SCS". Of a solver behind cvxpy that is none of this package's own, cvxpy
    alone is known.
    """
    parts = [p for name in names.split(",") for p in name.strip().lower().split(":")]
    return tuple(c for p in parts for c in cited(SOLVER, *_SOLVERS.get(p, ())))


def papers_behind(prediction: Prediction) -> tuple[Cited, ...]:
    """Theory, search and solvers of a prediction by limit analysis."""
    facts: Mapping[str, Any] = prediction.provenance
    rule = NON_ASSOCIATIVE if prediction.flow_rule == FlowRule.NON_ASSOCIATIVE else ASSOCIATIVE
    proven = prediction.details.get("proof") is not None
    return (*rule, *(cited(METHOD, "sherali1990") if proven else ()), *solver_papers(str(facts.get("solver", ""))))
