"""What an associative prediction says beside its number: reasons and warnings."""

from limitmason.answers.results import ContactModel, Prediction, Status
from limitmason.limit.program.face_cells import spread_cohesion
from limitmason.limit.program.static_theorem import Problem
from limitmason.limit.torsion import JUMPING, LAST
from limitmason.mechanics.law_table import ASSOCIATIVE, notes
from limitmason.mechanics.resultants import twisted_joints

CONFINEMENT_WARNING = 10.0
"""Largest joint force over the total load from which an answer is said to rest on self-stress."""

TWISTED = (
    "some faces carry more torsion than uniform pressure allows (0.38 (mu N + c A) a on a square, less beside shear)"
)

REASON = {
    Status.CANNOT_STAND: "no admissible joint forces carry the dead load: the structure cannot stand before any live "
    "load",
    Status.UNBOUNDED: "no finite multiplier: admissible joint forces grow with the live load without limit",
    Status.NOT_CONVERGED: "the solver stopped without an answer; try another tolerance or contact model",
}


def warnings_of(problem: Problem, prediction: Prediction, confinement: float, torsion: bool) -> list[str]:
    """What to know before the number of an associative prediction is used.

    Parameters
    ----------
    problem : that was solved
    prediction : with its certificate
    confinement : largest joint force over the total load [-]
    torsion : whether the torsion of the faces was limited

    Returns
    -------
    Warnings, one sentence each.
    """
    out = []
    if prediction.status == Status.ALMOST_SOLVED:
        why = prediction.certificate.refusal if prediction.certificate is not None else ""
        out.append("reduced accuracy" + (f": {why}" if why else ": read the certificate before using the number"))
    spread = prediction.details.get("torsion_spread", 0.0)
    if spread > JUMPING:
        tail = prediction.details["torsion_history"][-LAST:]
        out.append(
            f"the torsion iteration did not settle: its last values lie between {min(tail):.6g} and {max(tail):.6g}"
        )
    out += notes(ASSOCIATIVE, problem.assembly, problem.interfaces)
    out += self_stress(confinement)
    if problem.contact_model == "grid" and problem.plane is None and (spread_cohesion(problem.assembly) > 0).any():
        out.append(
            "cohesion is lumped at the points of the grid, its outermost on the edges of the faces, which overstates "
            "the torsion of cohesive faces (by 85 % on a square with 2 x 2 points, less with more); "
            "contact_model='vertices' bounds the error"
        )
    if not torsion and not problem.stress_block.count and twisted_faces(problem, prediction):
        out.append(f"{TWISTED}: torsion_limit=True gives an estimate with it limited")
    return out


def crushed_points(problem: Problem) -> str:
    """Where joints of a problem crush point by point, and on which side that errs, in words."""
    if problem.contact_model == ContactModel.LOBATTO:
        return "Lobatto points, which err to either side of faces that crush"
    return "the points of a grid, which overstate faces that crush"


def self_stress(confinement: float) -> list[str]:
    """A warning where ``confinement``, largest joint force over load [-], is large."""
    if not confinement > CONFINEMENT_WARNING:
        return []
    return [
        f"the answer rests on confining forces: the largest joint force is {confinement:.3g} times the load; "
        "check with a method that builds up stress from zero"
    ]


def twisted_faces(problem: Problem, prediction: Prediction) -> bool:
    """Whether a face in space carries more torsion than uniform pressure allows."""
    resultants = prediction.resultants
    if problem.plane is not None or resultants is None:
        return False
    return bool(twisted_joints(problem.assembly, resultants, problem.force_scale).any())
