"""Whether a structure can stand, and how well: by friction, joint faces and a tilt of the ground."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.results import Bound, BoundKind, Prediction, Range, Status
from limitmason.arrays import Array
from limitmason.capacity import PushoverCurve
from limitmason.capacity.analysis import whole_pushover
from limitmason.checks import finite, switch
from limitmason.display.notebook import shows
from limitmason.errors import InputError, NotApplicable
from limitmason.limit.associative import carry
from limitmason.limit.associative_prediction import UNDECIDED
from limitmason.limit.margin import Margin, last_standing, standing_margin
from limitmason.limit.program.static_theorem import Problem, make_problem
from limitmason.limit.range.bracket import inside
from limitmason.mechanics.law_table import refuse
from limitmason.mechanics.model_notes import with_model_notes
from limitmason.model.assembly import Assembly
from limitmason.model.input import read_vector
from limitmason.model.interface import Interface
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.model.plausibility import PlausibilityWarning

__all__ = ["Standing", "stability"]

LARGEST_DIVISOR = 1e3
"""Divisor of tan(phi) up to which a structure is tried [-]; one that stands there needs no friction to speak of."""

SMALLEST_SHARE = 1e-3
"""Length of every joint face over its own down to which a structure is tried [-]: it is then all but a point."""

# horizontal unit vectors in which the ground falls, by name
GROUND = {"+x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "+y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0)}


@dataclass(frozen=True, eq=False)
class Standing:
    """Whether a structure can stand, and how far it is from where it cannot.

    Parameters
    ----------
    stands : True with admissible forces, False with a motion, None where neither was found
    state : forces that carry the dead load, or the motion by which it falls; for figures and tables
    friction : largest divisor of every tan(phi), between a proven low and high end [-]
    share : smallest factor of the lengths of every joint face, shrunk about its centroid [-]
    tilt : largest tilt of the ground, by the direction in which the ground falls [deg]
    certain : for psi < phi: True where joints of friction psi carry the load too, which every flow rule between the two
        then does (Radenkovic); else None
    path : for psi < phi: the curve of elastic joints on which the dead load has come, one sample; None where it was not
        asked for or no path could be followed
    notes : what a reader must know
    """

    stands: bool | None
    state: Prediction
    friction: Range = field(default_factory=Range)
    share: Range = field(default_factory=Range)
    tilt: Mapping[str, Range] = field(default_factory=dict)
    certain: bool | None = None
    path: PushoverCurve | None = None
    notes: tuple[str, ...] = ()

    @property
    def stands_on_path(self) -> bool | None:
        """Whether elastic joints of the real flow rule came to rest under the dead load; None without a path."""
        return None if self.path is None else self.path.status != Status.CANNOT_STAND

    def __str__(self) -> str:
        """Verdict, the measures with their brackets, and the notes."""
        verdict = {True: "can stand", False: "cannot stand", None: "undecided"}[self.stands]
        verdict += " by every flow rule" * bool(self.certain)
        verdict += {True: "; it does on a path", False: "; on a path it falls", None: ""}[self.stands_on_path]
        rows = [("tan(phi) divided by", self.friction, ""), ("joint faces shrunk to", self.share, "")]
        rows += [(f"ground falls towards {name}", tilt, " deg") for name, tilt in self.tilt.items()]
        lines = [f"{words:<28}{r.low:.6g} to {r.high:.6g}{unit}" for words, r, unit in rows if not math.isnan(r.low)]
        return "\n".join([verdict, *("  " + line for line in lines), *("  note: " + n for n in self.notes)])


@of_model
def stability(
    assembly: Assembly,
    loads: Loads | None = None,
    *,
    tilts: Sequence[str] | Mapping[str, ArrayLike] = tuple(GROUND),
    accuracy: float = 1e-8,
    path: bool = True,
    contact_model: str = "vertices",
    in_plane: bool | None = None,
) -> Standing:
    r"""Can the structure stand under its dead load, and how well.

    It can where some admissible forces carry the load; else a motion proves that none do:

    .. math:: A f + w = 0,\ f \in K \qquad \text{or} \qquad w \cdot v > D(v)

    Three measures follow, each the end of an interval that is halved until its ends differ by the accuracy: the largest
    s with tan(phi) / s in every joint, the smallest share of every joint face, shrunk about its centroid with weights
    and blocks unchanged, and the largest angle by which the ground may tilt.

    Parameters
    ----------
    assembly : what stands
    loads : dead loads; self weight by default. A tilt turns the self weight and leaves other loads in the ground's axes
    tilts : directions in which the ground falls: of "+x", "-x", "+y", "-y", or horizontal vectors by name; none with ()
    accuracy : of divisor and share [-], and of the tilt [rad]
    path : for psi < phi, bring the dead load on elastic joints of the real flow rule too, by ``lm.pushover``
    contact_model, in_plane : as for :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Standing
        Both ends of every measure are proven: by forces at the standing end, by a motion at the other. An infinite end
        of a divisor or a tilt, and a share of 0, mean that it was not found: the structure stands without friction to
        speak of, on a vertical ground, or on a thousandth of its faces.

    Raises
    ------
    InputError
        For live loads, and a tilt that is no horizontal direction.
    NotApplicable
        For joint laws that limit analysis cannot represent.

    Notes
    -----
    Heyman's safe theorem. For psi < phi forces that can carry the load do not prove that it is carried: "can stand" and
    the measures are then necessary. Two answers stand beside it. Joints of friction psi that carry the load too are
    sufficient (Radenkovic). The path brings the load on blocks without stress, and falls where only wedged blocks
    would hold; it is that of one stiffness, no proof. A structure that stands at one value is taken to stand at all
    safer ones; with cohesion and a tilt that need not hold.
    """
    refuse("associative", assembly)
    loads = Loads.weight(assembly) if loads is None else loads
    if loads.live.any():
        raise InputError("loads: stability is asked of dead loads; give them with case='dead'")
    ground = {name: _horizontal(name, d) for name, d in _directions(tilts).items()}
    if not 0.0 < finite("accuracy", accuracy) < 0.1:  # a coarser measure would say little
        raise InputError(f"accuracy must be above 0 and below 0.1, got {accuracy!r}")

    path = switch("path", path)
    model: dict[str, Any] = {"contact_model": contact_model, "in_plane": in_plane}
    stands, state = _state(make_problem(assembly, loads, live_required=False, **model))
    state = with_model_notes(state, assembly, loads)
    if not stands:
        unknown = (f"neither forces nor a motion was found; {UNDECIDED}",) if stands is None else ()
        return Standing(stands, state, notes=unknown)
    certain, curve, notes = _below_normality(assembly, loads, path, model)

    def with_friction(divisor: float) -> Margin:
        """Margin of the structure with tan(phi) divided in every joint [-]."""
        return standing_margin(assembly.with_joints(lambda joint: _divided(joint, divisor)), loads, **model)

    def with_share(share: float) -> Margin:
        """Margin of the structure with every joint face shrunk to a share of its lengths [-]."""
        return standing_margin(assembly.with_interfaces(_shrunk(assembly, share)), loads, **model)

    def tilted(direction: Array) -> Callable[[float], Margin]:
        """Margin of the structure over the angle by which the ground falls [rad].

        ``direction`` is a horizontal unit vector, along which it falls.
        """

        def at(angle: float) -> Margin:
            """Margin at one angle [rad]."""
            dead = np.array(loads.dead)
            # gravity turns: weight W along -z becomes W (sin d - cos z), and -W z is in the dead load already
            dead[:, :3] += assembly.weights[:, None] * (math.sin(angle) * direction + (0, 0, 1.0 - math.cos(angle)))
            return standing_margin(assembly, Loads(dead, loads.live), **model)

        return at

    with catch_warnings():
        simplefilter("ignore", PlausibilityWarning)  # of joints next to smooth, which nobody gave
        divisor = last_standing(with_friction, safe=1.0, far=LARGEST_DIVISOR, accuracy=accuracy)
    share = last_standing(with_share, safe=1.0, far=SMALLEST_SHARE, accuracy=accuracy)
    tilt = {}  # low and high end by direction [deg]
    for name, d in ground.items():
        angle = last_standing(tilted(d), safe=0.0, far=0.5 * math.pi, accuracy=accuracy)
        tilt[name] = np.degrees(angle[:2])
    # a share falls towards where the structure does not stand: the standing end is its upper one
    return Standing(
        stands=True, state=state, friction=divisor,
        share=Range(0.0 if math.isinf(share.high) else share.high, share.low),
        tilt={name: Range(float(low), float(high)) for name, (low, high) in tilt.items()}, certain=certain, path=curve,
        notes=notes,
    )


def _state(problem: Problem) -> tuple[bool | None, Prediction]:
    """Whether the dead load is carried, with its forces or the motion of its fall.

    It is None where neither was found.

    Parameters
    ----------
    problem : equilibrium and law of the joints under the dead load
    """
    forces, falling = carry(problem)
    words = Bound(BoundKind.NONE, "no multiplier: forces that carry the dead load" if forces else "")
    state = Prediction(
        "stability", math.nan, words, Status.SOLVED, mechanism=None, resultants=forces, **problem.contact_facts
    )
    if forces is not None:
        return True, state
    return (None, replace(state, status=Status.NOT_CONVERGED)) if falling is None else (False, falling)


def _divided(joint: Joint, divisor: float) -> Joint:
    """The joint with tan(phi) over ``divisor`` [-], and psi not above the new phi: nothing dilates more."""
    phi = math.degrees(math.atan(joint.tan_phi / divisor))
    return replace(joint, friction_angle_deg=phi, dilatancy_angle_deg=min(joint.dilatancy_angle_deg, phi))


def _shrunk(assembly: Assembly, share: float) -> list[Interface]:
    """Interfaces with all lengths times ``share`` [-] about their centroids."""
    centre = assembly.arrays.centre
    return [replace(i, polygon=c + share * (i.polygon - c)) for i, c in zip(assembly.interfaces, centre, strict=True)]


def _directions(tilts: Sequence[str] | Mapping[str, ArrayLike]) -> Mapping[str, ArrayLike]:
    """Directions of ``tilts`` by name, not checked or scaled yet.

    Parameters
    ----------
    tilts : a name of ``GROUND``, several, or directions by name
    """
    if isinstance(tilts, Mapping):
        return tilts
    if not isinstance(tilts, str | Sequence):
        raise InputError(f"tilts: give names or directions by name, got {tilts!r}; none with ()")
    names = (tilts,) if isinstance(tilts, str) else tuple(tilts)
    if unknown := [n for n in names if not isinstance(n, str) or n not in GROUND]:
        raise InputError(f"tilts: {unknown[0]!r} is none of {', '.join(GROUND)}; give other directions by name")
    return {n: GROUND[n] for n in names}


def _horizontal(name: str, direction: ArrayLike) -> Array:
    """The horizontal unit vector of a direction that a user gave under a name."""
    d = read_vector(f"tilt {name!r}", direction)
    size = float(np.linalg.norm(d))
    if not size > 0.0 or abs(d[2]) > 1e-9 * size:  # rounding may leave it off the level
        raise InputError(f"tilt {name!r} must be a horizontal direction that is not zero, got {direction!r}")
    return d / size


def _below_normality(
    assembly: Assembly, loads: Loads, path: bool, model: dict[str, Any]
) -> tuple[bool | None, PushoverCurve | None, tuple[str, ...]]:
    """What can be said for psi < phi, where admissible forces do not prove enough.

    Forces that can carry the load do not prove then that it is carried.

    Parameters
    ----------
    assembly : what stands
    loads : its dead loads
    path : whether the path is asked for
    model : options of :func:`limitmason.limit.make_problem`

    Returns
    -------
    certain : True where joints of friction psi carry the load too, so that every flow rule does; None where they do
        not, which proves nothing, and where psi = phi in all joints
    curve : of the path on which the dead load comes, None without one
    notes : sentences on both
    """
    if all(i.joint.tan_psi == i.joint.tan_phi for i in assembly.interfaces):
        return None, None, ()
    reduced = make_problem(assembly.with_joints(inside), loads, live_required=False, **model)
    forces, _ = carry(reduced)
    certain = True if forces is not None else None
    notes = ["psi < phi in some joints: 'can stand' and the measures are necessary, not sufficient"]
    if certain:
        notes = ["psi < phi in some joints: friction psi carries the load too, so that it stands by every flow rule"]
    if not path:
        return certain, None, (*notes, "no path was asked for")
    try:
        curve = whole_pushover(assembly, loads, to=0.0, contact_model=model["contact_model"])
    except NotApplicable as refusal:
        return certain, None, (*notes, f"no path: {refusal}")
    came = "falls" if curve.status == Status.CANNOT_STAND else "comes to rest"
    notes.append(f"path: the load comes on blocks without stress on elastic joints (see path.warnings): it {came}")
    return certain, curve, tuple(notes)


shows(__name__)
