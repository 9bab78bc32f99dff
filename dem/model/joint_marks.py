"""What has become of the joints at a moment: how far each has opened and slid, how much of its strength is in use."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from dem.kernels import LAW
from dem.model.state import PointForces, State
from limitmason.arrays import Array, Index
from limitmason.model import Assembly
from limitmason.model.relaid import of_kind

ROUNDING = 1e-9
"""Part of a joint's elastic movement at its strength below which plastic movement is rounding [-]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointMarks:
    """Marks per interface, NaN where its contacts were found anew.

    They have shape (k,) at a moment and (samples, k) in a record.

    Parameters
    ----------
    opening : largest opening less dilation [m]
    slip : largest plastic slip at its points [m]
    crushed : largest closing beyond the compressive strength [m]
    used : largest part in use of the undamaged strength at its points, in tension, shear or compression [-]; 1 where it
        is reached, and where it was passed
    failed : part of its area where the strength was reached: damaged, slipped, opened beyond ft or crushed [-]
    """

    opening: Array
    slip: Array
    crushed: Array
    used: Array
    failed: Array


@dataclass(frozen=True)
class FirstOpening:
    """Where in a record an opening first reaches a width."""

    sample: int  # at which it is seen
    part: float  # of the way there from the sample before [-], at which the width is reached; 1 at sample 0
    joint: int  # number of the interface
    opening: float  # at that sample [m]


def first_opening(marks: JointMarks, assembly: Assembly, width: float, kind: str | None) -> FirstOpening | None:
    """Where an opening first reaches a width, in joints of one kind, or None.

    Between two samples openings grow in a line. Of several joints that reach the width there, the first is taken; of
    those that are as wide at sample 0, the widest. A joint whose contacts were found anew (NaN) counts as closed.

    Parameters
    ----------
    width : more than 0 [m]
    kind : "bed", "head", "base", "crack"; None for all
    """
    kept = np.flatnonzero(of_kind(assembly.interfaces, kind))
    wide = np.nan_to_num(marks.opening[:, kept])
    hit = (wide >= width).any(axis=1)
    if not hit.any():
        return None
    i = int(np.argmax(hit))
    if i == 0:
        k, part = int(np.argmax(wide[0])), 1.0
    else:
        late = np.flatnonzero(wide[i] >= width)
        parts = (width - wide[i - 1, late]) / (wide[i, late] - wide[i - 1, late])
        k, part = int(late[np.argmin(parts)]), float(parts.min())
    return FirstOpening(i, part, int(kept[k]), float(wide[i, k]))


MARKS = tuple(f.name for f in fields(JointMarks))


def joint_marks(state: State, now: PointForces, count: int) -> JointMarks:
    """Marks of the joints of a state.

    Parameters
    ----------
    state, now : the state, and its contact forces in the present position
    count : number of interfaces of the assembly
    """
    p, law = state.points, state.joints.law[now.owner]
    kn, ft = law[:, LAW.kn], law[:, LAW.tension]
    force = np.linalg.norm(now.force, axis=1) / p.area
    # the normal stress that the opening would make in a joint that does not crush, in tension at most ft and none once
    # a point is damaged; the shear stress is the rest of the force beside the normal stress that is really there
    normal = np.maximum(-kn * now.opening, np.where(p.damage > 0.0, 0.0, -ft))
    crushing = np.minimum(normal, kn * law[:, LAW.crushing])
    shear = np.sqrt(np.maximum(force**2 - crushing**2, 0.0))
    slip = np.hypot(p.slip_1, p.slip_2)
    interface = state.interface[now.owner]
    kept = interface >= 0  # contacts found anew belong to no interface
    points = {
        "opening": now.opening, "slip": slip, "normal": normal, "shear": shear, "lift": p.lift, "damage": p.damage,
        "area": p.area,
    }
    return marks_of(law[kept], interface[kept], count, **{name: values[kept] for name, values in points.items()})


def bond_yielded(assembly: Assembly, state: State) -> tuple[float, str]:
    """Largest plastic movement of a joint whose bond never ends [m], and its name.

    Such a joint is perfectly plastic: it keeps cohesion and tension however far it opens or slips. Without one the
    answer is 0 and "".
    """
    now = state.measured(assembly)
    p, law = state.points, state.joints.law[now.owner]
    bond = np.maximum(law[:, LAW.cohesion], law[:, LAW.tension]) > 0.0
    bond &= np.maximum(law[:, LAW.by_opening], law[:, LAW.by_slip]) == 0.0
    if not bond.any():
        return 0.0, ""
    # opening beyond that at the tensile strength, or plastic slip
    moved = np.maximum(now.opening - law[:, LAW.tension] / law[:, LAW.kn], np.hypot(p.slip_1, p.slip_2)) * bond
    k = int(moved.argmax())
    j = now.owner[k]
    return float(moved[k]), assembly.joint_text(state.joints.block_a[j], state.joints.block_b[j])


def marks_of(
    law: Array, interface: Index, count: int, *, opening: Array, slip: Array, normal: Array, shear: Array, lift: Array,
    damage: Array, area: Array,
) -> JointMarks:
    """Marks per interface from what stands at the contact points.

    Rigid, simply deformable and zoned blocks have them alike.

    Parameters
    ----------
    law : of every point's joint, columns as in ``LAW``, shape (m, LAW_SIZE)
    interface : of every point, shape (m,)
    count : number of interfaces of the assembly
    opening : less dilation [m], shape (m,)
    slip : plastic, without sign [m], shape (m,)
    normal : stress, compression positive [Pa], shape (m,)
    shear : stress, without sign [Pa], shape (m,)
    lift : what dilation gave and crushing took [m], shape (m,)
    damage : part of the strength that is gone [-], shape (m,)
    area : [m2], shape (m,)
    """
    kn, ks, mu, c, ft = (law[:, k] for k in (LAW.kn, LAW.ks, LAW.tan_phi, LAW.cohesion, LAW.tension))
    size = np.maximum(np.maximum(np.abs(normal), shear), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        # a joint without strength and without stress uses none of it
        pulled = np.where(-normal > ROUNDING * size, -normal / ft, 0.0)
        limit = np.maximum(c + mu * normal, 0.0)
        sheared = np.where(shear > ROUNDING * size, shear / limit, 0.0)
        pressed = np.where(np.isfinite(law[:, LAW.crushing]), normal / (kn * law[:, LAW.crushing]), 0.0)
        used = np.fmax(np.maximum(np.maximum(pulled, sheared), pressed), 0.0)
    softens = (law[:, LAW.by_opening] > 0.0) | (law[:, LAW.by_slip] > 0.0)
    # only crushing takes more from the lift than dilation gave
    depth = np.maximum(-lift, 0.0)
    plastic = (opening > (1.0 + ROUNDING) * ft / kn) | (slip > ROUNDING * size / ks)
    failed = np.where(softens, damage > 0.0, plastic) | (depth > ROUNDING * size / kn)

    def largest(values: Array) -> Array:
        """Largest value at the points of every interface, NaN without one, (count,)."""
        out = np.full(count, -np.inf)
        np.maximum.at(out, interface, values)
        return np.where(np.isfinite(out), out, np.nan)

    with np.errstate(invalid="ignore"):  # an interface without points has no area
        part_failed = np.bincount(interface, area * failed, count) / np.bincount(interface, area, count)
    return JointMarks(
        opening=largest(opening), slip=largest(slip), crushed=largest(depth),
        used=largest(np.where(failed, 1.0, np.minimum(used, 1.0))), failed=part_failed,
    )
