"""What to cite for limit analysis: the theory, the search of the smallest multiplier, and the solver that was used."""

from collections.abc import Mapping
from typing import Any

from limitmason.answers.references import METHOD, SOLVER, THEORY, Cited, Reference
from limitmason.answers.results import FlowRule, Prediction

LIVESLEY = Reference(
    "livesley1978", "article", "Limit analysis of structures formed from rigid blocks", ("Livesley, R. K.",), 1978,
    "International Journal for Numerical Methods in Engineering", "12", "12", "1853-1871",
)  # fmt: skip
RADENKOVIC = Reference(
    "radenkovic1961", "article", "Théorèmes limites pour un matériau de Coulomb à dilatation non standardisée",
    ("Radenkovic, D.",), 1961, "Comptes rendus de l'Académie des sciences", "252", pages="4103-4104",
    note="title, volume and pages recalled, not checked against the original",
)  # fmt: skip
FERRIS = Reference(
    "ferris2001", "article",
    "Limit analysis of frictional block assemblies as a mathematical program with complementarity constraints",
    ("Ferris, M. C.", "Tin-Loi, F."), 2001, "International Journal of Mechanical Sciences", "43", pages="209-224",
)  # fmt: skip
GILBERT = Reference(
    "gilbert2006", "article",
    "Limit analysis of masonry block structures with non-associative frictional joints using linear programming",
    ("Gilbert, M.", "Casapulla, C.", "Ahmed, H. M."), 2006, "Computers and Structures", "84", pages="873-887",
    doi="10.1016/j.compstruc.2006.02.005",
)  # fmt: skip
SHERALI = Reference(
    "sherali1990", "article",
    "A hierarchy of relaxations between the continuous and convex hull representations for zero-one programming "
    "problems",
    ("Sherali, H. D.", "Adams, W. P."), 1990, "SIAM Journal on Discrete Mathematics", "3", "3", "411-430",
    "10.1137/0403036",
)  # fmt: skip
CLARABEL = Reference(
    "goulart2024", "misc", "Clarabel: An interior-point solver for conic programs with quadratic objectives",
    ("Goulart, P. J.", "Chen, Y."), 2024, "arXiv 2405.12762", url="https://arxiv.org/abs/2405.12762",
)  # fmt: skip
HIGHS = Reference(
    "huangfu2018", "article", "Parallelizing the dual revised simplex method", ("Huangfu, Q.", "Hall, J. A. J."), 2018,
    "Mathematical Programming Computation", "10", "1", "119-142", "10.1007/s12532-017-0130-5", note="HiGHS",
)  # fmt: skip
MEHROTRA = Reference(
    "mehrotra1992", "article", "On the implementation of a primal-dual interior point method", ("Mehrotra, S.",), 1992,
    "SIAM Journal on Optimization", "2", "4", "575-601", "10.1137/0802028",
)  # fmt: skip
NESTEROV = Reference(
    "nesterov1997", "article", "Self-scaled barriers and interior-point methods for convex programming",
    ("Nesterov, Yu. E.", "Todd, M. J."), 1997, "Mathematics of Operations Research", "22", "1", "1-42",
    "10.1287/moor.22.1.1",
)  # fmt: skip
CVXPY = Reference(
    "diamond2016", "article", "CVXPY: A Python-embedded modeling language for convex optimization",
    ("Diamond, S.", "Boyd, S."), 2016, "Journal of Machine Learning Research", "17", "83", "1-5",
)  # fmt: skip

ASSOCIATIVE = (Cited(THEORY, LIVESLEY), Cited(THEORY, RADENKOVIC))
"""The static theorem on rigid blocks, and why its value bounds every other flow rule from above."""

NON_ASSOCIATIVE = (*ASSOCIATIVE, Cited(THEORY, FERRIS), Cited(METHOD, GILBERT))
"""The problem with its complementarity, and the sequence of programs by which it is searched."""

_SOLVERS: Mapping[str, tuple[Reference, ...]] = {
    "clarabel": (CLARABEL,), "highs": (HIGHS,), "interior-point": (MEHROTRA, NESTEROV), "cvxpy": (CVXPY,),
}  # fmt: skip
"""By the name that ``provenance["solver"]`` gives."""


def solver_papers(names: str) -> tuple[Cited, ...]:
    """What to cite for solvers named as in ``provenance["solver"]``.

    Such names are "clarabel, HiGHS" or "cvxpy:SCS". Of a solver behind cvxpy that is none of this package's own, cvxpy
    alone is known.
    """
    parts = [p for name in names.split(",") for p in name.strip().lower().split(":")]
    return tuple(Cited(SOLVER, r) for p in parts for r in _SOLVERS.get(p, ()))


def papers_behind(prediction: Prediction) -> tuple[Cited, ...]:
    """Theory, search and solvers of a prediction by limit analysis."""
    facts: Mapping[str, Any] = prediction.provenance
    rule = NON_ASSOCIATIVE if prediction.flow_rule == FlowRule.NON_ASSOCIATIVE else ASSOCIATIVE
    proven = prediction.details.get("proof") is not None
    return (*rule, *((Cited(METHOD, SHERALI),) if proven else ()), *solver_papers(str(facts.get("solver", ""))))
