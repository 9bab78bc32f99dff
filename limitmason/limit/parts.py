"""Independent parts of an assembly: solved apart, and put together again.

Free blocks that no chain of joints between free blocks joins do not know of each other: what is held passes nothing on.
Every part carries an interval of multipliers, so the whole carries what all of them do: the smallest upper end governs.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.results import Bound, BoundKind, Prediction, Resultants, Status
from limitmason.arrays import Index
from limitmason.limit.associative import carry
from limitmason.limit.program.static_theorem import make_problem
from limitmason.mechanics.certificate import certify
from limitmason.mechanics.residuals import part_labels
from limitmason.mechanics.resultants import resultants_from_points, scaled_mechanism
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.support import Support

SAME = 1e-9
"""Difference of two multipliers, relative, at which forces found for one are taken for the other."""

NOTHING = 1e-12
"""Multiplier below which that difference is taken over this instead [-]: a multiplier of zero has no relative one."""

SAME_PLACE = 1e-12
"""Distance of contact points over the largest coordinate up to which they are at the same place: rounding."""


def independent_parts(assembly: Assembly) -> list[Index]:
    """Free blocks of every independent part, in the order of their lowest numbers."""
    label = part_labels(assembly)
    return [np.flatnonzero(label == k) for k in range(int(label.max(initial=-1)) + 1)]


def governed(
    assembly: Assembly,
    loads: Loads,
    parts: list[Index],
    solve: Callable[[Assembly], Prediction],
    model: Mapping[str, Any],
    *,
    check_dead_load: bool,
) -> Prediction:
    """Prediction of the whole from predictions of its parts.

    The part of smallest multiplier governs: its mechanism, the rest at rest; the forces of the others are those of
    their own prediction, or a mean of these and of forces under dead load alone that is in equilibrium at the governing
    multiplier (admissible, for the joint law is convex).

    Parameters
    ----------
    assembly, loads : the whole
    parts : from :func:`independent_parts`
    solve : prediction of an assembly in which the other parts are held
    model : contact_model, grid, in_plane for :func:`limitmason.limit.program.static_theorem.make_problem`
    check_dead_load : whether every part must also stand without live load

    Returns
    -------
    Prediction: ``details["parts"]`` says of every part its blocks, its multiplier [-] and its status. A part that
    cannot stand or has no answer is returned for the whole; so is the least so far, with its status, where one was
    interrupted or out of time.
    """
    held, live = [], []
    for part in parts:
        others = np.setdiff1d(np.flatnonzero(~assembly.fixed), part)
        held.append(assembly.with_supports([Support.fixed(int(i)) for i in others]))
        live.append(bool(loads.live[part][~assembly.held[part]].any()))
    if not any(live):
        make_problem(assembly, loads, **model)  # says that there is no live load
    found: dict[int, Prediction] = {}
    for k in range(len(parts)):  # after an interrupt no more are begun
        if live[k] and not any(p.status == Status.INTERRUPTED for p in found.values()):
            found[k] = solve(held[k])
    rows = tuple(
        {"blocks": [assembly.blocks[i].name for i in part], **_said_of(found.get(k), live[k])}
        for k, part in enumerate(parts)
    )
    # one part that falls, or whose answer is not known, decides the whole
    for status in (Status.CANNOT_STAND, Status.NOT_CONVERGED):
        for k, prediction in found.items():
            if prediction.status == status:
                return _of_part(prediction, k, rows)
    lead = min(found, key=lambda k: found[k].collapse_multiplier)
    first = found[lead]
    # parts not solved yet may govern at less: the smallest so far is a value of its part only
    for status in (Status.INTERRUPTED, Status.TIME_ENDED):
        if any(prediction.status == status for prediction in found.values()):
            return _of_part(replace(first, status=status), lead, rows)
    value = first.collapse_multiplier if first.status != Status.UNBOUNDED else 0.0
    forces = [] if first.resultants is None else [first.resultants]
    for k in range(len(parts)):
        if k == lead or (first.status == Status.UNBOUNDED and k in found):
            continue  # if all that have a live load are without bound, only the others are still asked
        own, falling = _carrying(held[k], loads, value, found.get(k), model, check_dead_load)
        if own is None:
            return _failed(first, k, rows, falling, value if k in found else 0.0)
        forces.append(own)
    if first.status == Status.UNBOUNDED:
        return _of_part(first, lead, rows)
    bound = _bound_of_all(first, [(rows[k]["blocks"][0], p) for k, p in found.items() if k != lead])
    return _whole(assembly, loads, replace(first, bound=bound), lead, rows, forces)


def _said_of(found: Prediction | None, live: bool) -> dict[str, Any]:
    """Multiplier and status of a part; ``found`` is its answer, or None.

    A part without answer either has no ``live`` load and carries any multiplier, or an interrupt came before its turn.
    """
    if found is not None:
        return {"multiplier": found.collapse_multiplier, "status": found.status}
    if live:
        return {"multiplier": float("nan"), "status": Status.INTERRUPTED}
    return {"multiplier": float("inf"), "status": "no live load"}


def _of_part(prediction: Prediction, part: int, rows: tuple) -> Prediction:
    """The prediction of one part as that of the whole, others without forces.

    Parameters
    ----------
    part : its number
    rows : what is said of all parts, see :func:`governed`
    """
    return replace(prediction, details={**prediction.details, "parts": rows, "governing_part": part})


def _failed(first: Prediction, part: int, rows: tuple, falling: Prediction | None, value: float) -> Prediction:
    """Prediction without multiplier of a whole of which a part cannot be carried.

    Parameters
    ----------
    first : answer of any part, for what the model has in common
    part : number of the one that falls
    rows : what is said of all parts, see :func:`governed`
    falling : proof of the fall, or None where neither forces nor proof were found
    value : multiplier of the whole at which the part falls [-]; 0 for the dead load alone
    """
    name = rows[part]["blocks"][0]
    if falling is None:
        reason = f"no forces were found that hold the part with block {name!r} in equilibrium, nor a proof of its fall"
        details: dict[str, Any] = {}
    else:
        load = f"{value:.6g} times the live load, which governs elsewhere," if value else "the dead load"
        reason = f"the part with block {name!r} cannot carry {load}; the mechanism is that of its fall"
        details = dict(falling.details)
    return Prediction(
        method=first.method, collapse_multiplier=float("nan"), bound=Bound(BoundKind.NONE),
        status=Status.NOT_CONVERGED if falling is None else Status.CANNOT_STAND,
        mechanism=None if falling is None else falling.mechanism, provenance=first.provenance, warnings=(reason,),
        details={**details, "parts": rows, "governing_part": part}, flow_rule=first.flow_rule,
        contact_model=first.contact_model, plane=first.plane, stress_block=first.stress_block,
    )


def _bound_of_all(first: Prediction, others: list[tuple[str, Prediction]]) -> Bound:
    """What the multiplier of the governing part is of the whole: exact only where no other part may lie below it.

    Parameters
    ----------
    first : answer of the governing part
    others : name of a block and answer of every other part with live load
    """
    if first.bound.kind is not BoundKind.EXACT:
        return first.bound
    for name, other in others:
        # an estimate is no proof; of a search there may be one that nothing lies below some multiplier
        proof = other.details.get("proof") or {}
        low = np.fmax(proof.get("bound", np.nan), other.details.get("radenkovic", (np.nan,))[0])
        if other.bound.kind is BoundKind.ESTIMATE and not low >= first.collapse_multiplier:
            words = (
                f"estimate: smallest of all parts, of which the one with block {name!r} has an estimate itself; of the "
                f"governing part {first.bound}"
            )
            return Bound(BoundKind.ESTIMATE, words)
    return first.bound


def _carrying(
    part: Assembly, loads: Loads, multiplier: float, own: Prediction | None, model: Mapping[str, Any], check: bool
) -> tuple[Resultants | None, Prediction | None]:
    """Forces in a part at the multiplier of the whole, or how the part falls.

    Parameters
    ----------
    part : the assembly with all other parts held
    multiplier : of the whole [-]
    own : answer of the part alone, or None without live load on it
    model : options of :func:`make_problem`
    check : whether the dead load alone is known to stand

    Returns
    -------
    forces, falling : forces or None, and then a prediction that proves the fall; both None where neither was found
    """
    top = own.collapse_multiplier if own is not None else np.inf
    known = own.resultants if own is not None else None
    if known is not None and abs(top - multiplier) <= SAME * max(abs(top), NOTHING):
        return known, None
    # between zero, where it stands, and its own multiplier forces may be mixed; else they are asked for directly
    mixed = check and known is not None and 0.0 <= multiplier < top
    at = 0.0 if mixed else multiplier
    all_dead = Loads(loads.dead + at * loads.live, np.zeros_like(loads.live))
    base, falling = carry(make_problem(part, all_dead, live_required=False, **model))
    if base is None or known is None or not mixed:
        return base, falling
    share = multiplier / top  # of the forces at ``top``: with the rest of those at zero they balance the multiplier
    return _weighted_sum(part, [(1.0 - share, base), (share, known)]), None


def _weighted_sum(assembly: Assembly, shares: list[tuple[float, Resultants]]) -> Resultants:
    """Sum of joint forces times their shares [-], from pairs (share, forces).

    Forces at different points keep a share of the area as well: cohesion and strengths count per area.
    """
    first = shares[0][1]
    position, interface = first.point_position, first.point_interface
    same = all(
        np.array_equal(r.point_interface, interface)
        and np.array_equal(r.point_area, first.point_area)
        and np.allclose(r.point_position, position, rtol=0.0, atol=SAME_PLACE * np.abs(position).max(initial=1.0))
        for _, r in shares
    )
    if same:
        force = np.asarray(sum(share * r.point_force for share, r in shares))
        return resultants_from_points(assembly, position, interface, first.point_area, force)
    return _joined(assembly, [
        resultants_from_points(assembly, r.point_position, r.point_interface, share * r.point_area,
                               share * r.point_force)
        for share, r in shares
    ])


def _joined(assembly: Assembly, forces: list[Resultants]) -> Resultants:
    """``forces`` of all parts together, in the order of the interfaces."""
    interface = np.concatenate([r.point_interface for r in forces])
    order = np.argsort(interface, kind="stable")
    position, area, force = (
        np.concatenate([getattr(r, name) for r in forces])[order]
        for name in ("point_position", "point_area", "point_force")
    )
    return resultants_from_points(assembly, position, interface[order], area, force)


def _whole(
    assembly: Assembly, loads: Loads, first: Prediction, lead: int, rows: tuple, forces: list[Resultants]
) -> Prediction:
    """The governing part's prediction with forces of all parts, as certified.

    Parameters
    ----------
    assembly, loads : the whole
    first : answer of the governing part
    lead : its number
    rows : what is said of all parts, see :func:`governed`
    forces : of each part
    """
    resultants = _joined(assembly, forces)
    mechanism = first.mechanism
    if mechanism is not None:
        mechanism = scaled_mechanism(
            assembly, loads, mechanism.twists, resultants.point_position, resultants.point_interface
        )
    provenance = dict(first.provenance, parts=len(rows), contact_points=len(resultants.point_interface))
    prediction = replace(
        first, mechanism=mechanism, resultants=resultants, provenance=provenance,
        details={**first.details, "parts": rows, "governing_part": lead},
    )
    certificate = certify(assembly, loads, prediction)
    if first.certificate is not None:
        # the mechanism is that of the part, whose own certificate may have been given a better repair
        same = ("flow_residual", "complementarity", "kinematic_multiplier", "gap", "discretisation", "force_cap")
        certificate = replace(certificate, **{name: getattr(first.certificate, name) for name in same})
    status, warnings = first.status, first.warnings
    # of a torsion limit only the forces are certified, and the status is that of its iteration
    known = first.certificate is not None and first.certificate.accepted
    if status == Status.SOLVED and known and not certificate.accepted:
        status, warnings = Status.ALMOST_SOLVED, (*warnings, f"reduced accuracy: {certificate.refusal}")
    return replace(prediction, certificate=certificate, status=status, warnings=warnings)
