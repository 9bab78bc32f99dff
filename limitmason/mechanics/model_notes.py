"""What every prediction says of its model: its tilt angle, where tension is cut, and what joints lose in failure."""

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any

import numpy as np

from limitmason.answers.references import Cited, data_behind
from limitmason.answers.results import NO_TILT, Prediction
from limitmason.arrays import Array
from limitmason.mechanics.law import interface_law, peak_law, residual_law
from limitmason.mechanics.law_table import ABOVE_APEX, THEORIES
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint, LostBy, Unloading
from limitmason.model.joint_term import Taken
from limitmason.model.load import Loads

_SAME = 1e-9
"""Part of the largest load, or of a strength, below which a difference is rounding [-]."""

_TURNED = 1e-6
"""Part of a weight by which the live load may be off a horizontal copy of it [-]: chosen."""


def why_no_tilt_angle(assembly: Assembly, loads: Loads) -> str:
    """Why lambda is not tan(tilt angle), or empty where it is.

    On a tilting table every weight W becomes W (-cos(alpha) z + sin(alpha) d), that is cos(alpha) (dead + tan(alpha)
    live) with the own weights dead and the same weights along one horizontal direction d live. The factor cos(alpha)
    cancels where the joints have no strength of their own.

    Parameters
    ----------
    assembly, loads : the problem; loads on held degrees of freedom do not count
    """
    moves = ~assembly.held
    weight = np.zeros((assembly.n_blocks, 6))
    weight[:, 2] = -assembly.weights
    scale = max(float(np.abs(weight * moves).max(initial=0.0)), 1e-300)
    if np.abs((loads.dead - weight) * moves).max(initial=0.0) > _SAME * scale:
        return "the dead load is not the own weight of the blocks alone"
    live = loads.live * moves
    free = moves[:, :2].all(axis=1) & (assembly.weights > _SAME * scale)
    if not free.any():
        return "no block with a weight is free to move sideways"
    # the heaviest block tells the direction, which all others must have
    k = int(np.argmax(np.where(free, assembly.weights, 0.0)))
    direction = live[k] / assembly.weights[k]
    sideways = assembly.weights[:, None] * direction * moves
    level = abs(direction[2]) <= _SAME and abs(float(np.hypot(*direction[:2])) - 1.0) <= _TURNED
    if not level or np.abs(live - sideways).max(initial=0.0) > _TURNED * scale or direction[3:].any():
        return "the live load is not the weight of every block turned to one horizontal direction"
    strong = next((i for i in assembly.interfaces if not i.joint.is_cohesionless), None)
    if strong is not None:
        joint = assembly.joint_text(strong.block_a, strong.block_b)
        return f"{joint} has cohesion, tensile or compressive strength: the cosine of the angle does not cancel"
    if assembly.ties:
        return f"the strength of the {assembly.ties[0]} is no weight: the cosine of the angle does not cancel"
    return ""


def tension_above_apex(assembly: Assembly, taken: bool = False) -> str:
    """Which joints have more tensile strength than c / tan(phi), and what of it counts.

    The text is empty where there are none.

    The convex law ends at the apex of the Coulomb cone, so ft > c / tan(phi) is never reached. Programs that check ft
    apart from the cone do not cut it, nor does the DEM here: parameters calibrated in them lose tension elsewhere.

    Parameters
    ----------
    taken : whether the theory takes ft as it is
    """
    x, apex_stress = assembly.arrays, interface_law(assembly.arrays).tension  # both [Pa], shape (interfaces,)
    lost = np.where(x.tensile_strength > (1.0 + _SAME) * apex_stress, x.tensile_strength - apex_stress, 0.0)
    if not lost.any():
        return ""
    k = int(np.argmax(lost))
    worst = assembly.interfaces[k].joint
    name = f" ({worst.name})" if worst.name else ""
    how, counts = "cut at", f"counts as c / tan(phi) = {apex_stress[k]:.4g} Pa"
    if taken:
        how = "taken beyond"
        counts = (
            f"counts in full, without shear beyond c / tan(phi) = {apex_stress[k]:.4g} Pa, at which limit analysis and "
            "mechanisms cut it: their loads are lower"
        )
    return (
        f"tension is {how} the apex of the Coulomb cone in {np.count_nonzero(lost)} of {len(lost)} joints: a tensile "
        f"strength of {worst.tensile_strength:.4g} Pa{name} {counts}"
    )


def adds_model_notes(
    theory: str = "", cites: Callable[[Prediction], tuple[Cited, ...]] = lambda found: found.references
) -> Callable[[Callable[..., Prediction]], Callable[..., Prediction]]:
    """A decorator that lets a method ``(assembly, loads, ...)`` say with its prediction what holds for every method.

    How many faces nearly touch goes with every multiplier: it is found with the contacts and costs nothing.

    Parameters
    ----------
    theory : as in :func:`with_model_notes`
    cites : the papers behind a prediction of this method
    """

    def stating(method: Callable[..., Prediction]) -> Callable[..., Prediction]:
        """The method, whose predictions then carry the notes."""

        @wraps(method)
        def stated(assembly: Assembly, loads: Loads, *arguments: Any, **options: Any) -> Prediction:
            """The method's prediction with what its model is, what to cite and what the contacts warn of."""
            found = method(assembly, loads, *arguments, **options)
            warnings = (*found.warnings, *assembly.contact_warnings)
            found = replace(found, references=cites(found), warnings=warnings)
            return with_model_notes(found, assembly, loads, theory)

        return stated

    return stating


def with_model_notes(prediction: Prediction, assembly: Assembly, loads: Loads, theory: str = "") -> Prediction:
    """The prediction with why it has no tilt angle, empty where it has one, and a warning of tension above the apex.

    The papers of packaged data that the assembly was built from join its own. Nothing is added that it says already.

    Parameters
    ----------
    theory : of ``law_table.THEORIES`` where it is one; some take tension above the apex, others cut it
    """
    takes = theory in THEORIES and ABOVE_APEX.cell(theory).how is Taken.TAKEN
    said = tension_above_apex(assembly, takes)
    warnings = prediction.warnings if not said or said in prediction.warnings else (*prediction.warnings, said)
    details = prediction.details
    if NO_TILT not in details:
        details = {**details, NO_TILT: why_no_tilt_angle(assembly, loads)}
    lost = prediction.lost_in_failure or lost_in_failure(assembly)
    references = tuple(dict.fromkeys((*prediction.references, *data_behind(assembly.recipe))))
    return replace(
        prediction, details=details, warnings=warnings, lost_in_failure=lost, references=references,
        structure=assembly, loads=loads,
    )


def lost_in_failure(assembly: Assembly, lengths: Array | None = None) -> tuple[str, ...]:
    """What the joints lose where they fail, by what and over which energy, a sentence for each law that has a strength.

    Parameters
    ----------
    lengths : of a theory that follows softening: opening or slip over which joints without fracture energies lose
        their strength [m], 0 at once, shape (k,); without, joints are perfectly plastic
    """
    # joints by identity, each with its length: many interfaces share one
    known: dict[tuple[int, float | None], tuple[Joint, float | None]] = {}
    for k, i in enumerate(assembly.interfaces):
        length = None if lengths is None else float(lengths[k])
        known.setdefault((id(i.joint), length), (i.joint, length))
    words = [_joint_loses(*joint) for joint in known.values()]
    return tuple(dict.fromkeys(w for w in words if w))


def _joint_loses(joint: Joint, length: float | None) -> str:
    """What a joint loses where it fails, and over which energy, empty where it has nothing to lose.

    Parameters
    ----------
    joint : its law
    length : slip and opening over which joints without fracture energies soften [m]; None where the theory never
        softens
    """
    peak, rest = peak_law([joint], convex=False), residual_law([joint], convex=False)
    names = ("c", "ft", "tan(phi)")
    # of each the peak value and what is left
    values = [[float(getattr(law, f)[0]) for law in (peak, rest)] for f in ("cohesion", "tension", "tan_phi")]
    (cohesion, _), (tension, _), (friction, friction_left) = values
    if cohesion == tension == 0.0 and friction == friction_left and not joint.terms:
        return ""
    label = f"joint {joint.name!r}" if joint.name else "joints"
    strengths = f"c {cohesion:.4g} Pa, ft {tension:.4g} Pa, tan(phi) {friction:.4g}"
    own = [f"{t.words} ({', '.join(f'{k} {v:.4g}' for k, v in t.numbers.items())})" for t in joint.terms]
    if length is None or not joint.softens:
        return f"{label}: {strengths}: {'; '.join(own) or 'nothing is lost in failure (perfectly plastic)'}"
    falls = ", ".join(f"{n} to {r:.4g}" for n, (p, r) in zip(names, values, strict=True) if p != r) or "nothing"
    energies = {"GfI": joint.fracture_energy_tension, "GfII": joint.fracture_energy_shear}
    over = f"over {length:.3g} m" if length > 0.0 and not any(energies.values()) else "at once"
    opening, slip = (over if e is None else f"over {name} = {e:.4g} J/m2" for name, e in energies.items())
    by = f"by opening {opening}" + (f" or by slip {slip}" if joint.lost_by is LostBy.OPENING_OR_SLIP else " only")
    back = "; tension unloads to the origin" if joint.unloading is Unloading.SECANT else ""
    return f"{label}: {strengths}: " + "; ".join([f"lost in failure: {falls}, {by}{back}", *own])
