"""Limit analysis against the referee: status, multiplier, and the same of a turned and renumbered copy."""

import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from . import plane, space
from .assemblies import Case

TOLERANCE = 1e-6
"""Largest difference of two multipliers, over the referee's [-].

Added to it is 1e-8 of the multiplier at which live load equals dead load on some block, for values at zero.
"""

AGREE, DISAGREE, REFUSED, UNDECIDED = "agree", "DISAGREE", "refused", "undecided"


class Comparison(NamedTuple):
    """Outcome, what the referee says, what limit analysis says of the case and of its copy."""

    outcome: str
    referee: str
    theirs: tuple[str, ...]
    note: str = ""


_SAME = {
    plane.CANNOT_STAND: "cannot stand under dead load",
    plane.NO_LIMIT: "unbounded",
}


def judge(case: Case) -> plane.Verdict:
    """The referee's verdict."""
    return plane.referee(case) if case.plane else space.referee(case)


def compare(case: Case, *, copies: int = 1) -> Comparison:
    """Set limit analysis against the referee.

    A number has to be the referee's to 1e-6. "Almost solved" and "not converged" are refusals, but an "almost solved"
    number has to hold to a thousandth. An error in building or solving is a refusal, too: it names a block.
    """
    from limitmason import limit_analysis

    verdict = judge(case)
    if verdict.status == plane.UNDECIDED:
        return Comparison(UNDECIDED, verdict.status, ())
    wanted = _SAME.get(verdict.status, f"{verdict.value!r}")
    outcomes, theirs, first = [], [], None
    for turn in range(1 + copies):
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                assembly, loads = case.rebuilt(turn, first) if turn else case.build()
                first = first or loads
                answer = limit_analysis(assembly, loads)
            except ValueError as error:
                outcomes.append(REFUSED)
                theirs.append(f"{type(error).__name__}: {error}")
                continue
        number = answer.collapse_multiplier
        theirs.append(f"{number!r} ({answer.status})" if np.isfinite(number) else answer.status)
        outcomes.append(_outcome(verdict, answer.status, number))
    worst = next((o for o in (DISAGREE, REFUSED) if o in outcomes), AGREE)
    return Comparison(worst, wanted, tuple(theirs))


def _outcome(verdict: plane.Verdict, status: str, number: float) -> str:
    if status == "not converged":
        return REFUSED
    if verdict.status != plane.NUMBER:
        return AGREE if status == _SAME[verdict.status] else DISAGREE
    if status not in ("solved", "almost solved"):
        return DISAGREE
    slack = TOLERANCE if status == "solved" else 1e-3
    good = abs(number - verdict.value) <= slack * abs(verdict.value) + 1e-8 * verdict.unit
    return DISAGREE if not good else AGREE if status == "solved" else REFUSED


def shrunk(case: Case, *, copies: int = 1) -> Case:
    """The case with blocks and loads taken away as long as the disagreement stays."""

    def still(trial: Case) -> bool:
        try:
            return bool(trial.free) and compare(trial, copies=copies).outcome == DISAGREE
        except Exception:
            return False

    going = True
    while going:
        going = False
        candidates = [case.without(i) for i in reversed(range(len(case.outlines))) if len(case.outlines) > 1]
        candidates += [
            replace(case, loads=tuple(f for j, f in enumerate(case.loads) if j != k)) for k in range(len(case.loads))
        ]
        if len(set(case.density)) > 1:
            candidates.append(replace(case, density=(2000.0,) * len(case.density)))
        if case.law != replace(case.law, cohesion=0.0, tension=0.0, crushing=np.inf):
            candidates.append(replace(case, law=replace(case.law, cohesion=0.0, tension=0.0, crushing=np.inf)))
        for trial in candidates:
            if trial.loads and any(f.case == "live" for f in trial.loads) and still(trial):
                case, going = trial, True
                break
    return case
