"""What a method returns, and the closed sets of words it is written in.

All frozen, none knows a solver.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.acceptance import LABEL_WIDTH, Certificate
from limitmason.answers.curve import Curve
from limitmason.answers.references import Citable, Cited
from limitmason.arrays import Array, Index
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError, NotApplicable
from limitmason.storage.frozen import ReadOnly


class Status(StrEnum):
    """How an analysis ended, by what can be certified, not by what a solver says."""

    SOLVED = "solved"
    ALMOST_SOLVED = "almost solved"
    CANNOT_STAND = "cannot stand under dead load"
    UNBOUNDED = "unbounded"
    NOT_CONVERGED = "not converged"
    TIME_ENDED = "time limit ended it"
    INTERRUPTED = "interrupted"


class BoundKind(StrEnum):
    """What a multiplier is with respect to the law that its bound names."""

    EXACT = "exact"
    LOWER = "lower"
    UPPER = "upper"
    ESTIMATE = "estimate"
    NONE = "none"


class FlowRule(StrEnum):
    """Normality (psi = phi), or sliding that dilates by psi < phi."""

    ASSOCIATIVE = "associative"
    NON_ASSOCIATIVE = "non-associative"


class ContactModel(StrEnum):
    """Where an interface transmits forces.

    The corners of its polygon, or a lattice, even or dense at the edges.
    """

    VERTICES = "vertices"
    GRID = "grid"
    LOBATTO = "lobatto"


class Bound(str):
    """What a multiplier is, in words for a reader, with its ``kind`` for a program.

    >>> bound = Bound(BoundKind.UPPER, "upper bound for every flow rule")
    >>> bound.kind is BoundKind.UPPER, str(bound)
    (True, 'upper bound for every flow rule')
    """

    __slots__ = ("kind",)
    kind: BoundKind

    def __new__(cls, kind: BoundKind, text: str | None = None) -> Bound:
        """Take the kind and the words, which are the kind alone where none are given."""
        self = super().__new__(cls, str(kind) if text is None else text)
        self.kind = BoundKind(member_of(BoundKind, kind, "kind of a bound"))
        return self

    def __getnewargs__(self) -> Any:
        return self.kind, str(self)

    @classmethod
    def from_text(cls, text: str) -> Bound:
        """Bound of words alone, as files of 0.1 hold it, which begin with the kind.

        Words ``text`` that begin otherwise are those of an estimate; there is no bound without any.
        """
        first = text.replace(":", " ").replace(";", " ").split()[:1]
        if first and first[0] in tuple(BoundKind):
            return cls(BoundKind(first[0]), text)
        return cls(BoundKind.ESTIMATE if text else BoundKind.NONE, text)


class Range(NamedTuple):
    """Low and high end about a multiplier [-], and what they are; an end is NaN where there is none."""

    low: float = math.nan
    high: float = math.nan
    meaning: str = ""

    @property
    def known(self) -> bool:
        """Whether both ends are numbers."""
        return math.isfinite(self.low) and math.isfinite(self.high)


class Reaction(NamedTuple):
    """Least reaction of a support that gives way.

    Parameters
    ----------
    least : of the support [N], or [N m] of one that turns; NaN where there is none. Below zero it may still be a force
        that the structure cannot do without, the other way
    by_mechanism : lower bound that a mechanism proves, in the same unit
    by_forces : upper bound that admissible forces prove, in the same unit
    stands_without : whether the structure stands without the support
    unit : of the three, "N" or "N m"
    """

    least: float = math.nan
    by_mechanism: float = math.nan
    by_forces: float = math.nan
    stands_without: bool = False
    unit: str = "N"


def member_of(kind: type[StrEnum], text: str, field_: str) -> StrEnum:
    """Member of the closed set ``kind`` by its words.

    Other words are an error that names the field and lists all of them.
    """
    try:
        return kind(text)
    except ValueError:
        raise InputError(f"{field_} must be one of {', '.join(map(repr, map(str, kind)))}, got {text!r}") from None


NO_TILT = "no tilt angle because"
"""Key of ``Prediction.details``: why the multiplier is not the tangent of a tilt angle, empty where it is."""


def flags(moved: Mapping[str, Array], joints: Sequence[str], least: float) -> dict[str, float]:
    """What every joint does, by "movement joint": 1 for its largest movement, 0 for others.

    All are 0 for a joint that does not move by more than ``least``.

    Parameters
    ----------
    moved : size of the movement of every joint, by name of the movement, shape (k,) each: displacements [m] or rates
    joints : names of the joints
    least : movement that counts, in the same unit
    """
    largest = np.argmax(list(moved.values()), axis=0)  # of equal ones the first
    return {
        f"{name} {joint}": float(top == k and size > least)
        for k, (name, sizes) in enumerate(moved.items())
        for joint, size, top in zip(joints, sizes, largest, strict=True)
    }


@dataclass(frozen=True, eq=False)
class Mechanism(ReadOnly):
    """Collapse mechanism.

    Rigid velocities, scaled so that the mean velocity along the live loads is one.

    Parameters
    ----------
    twists : velocity of the centroid and angular velocity of every block [m/s, rad/s] up to a common factor,
        shape (n_blocks, 6)
    opening : opening rate per contact point, positive when the joint opens [m/s], shape (m,)
    sliding : sliding rate of block b relative to block a, per contact point [m/s], shape (m, 2), or (m, 1) in plane
    """

    twists: Array
    opening: Array
    sliding: Array

    def pattern(self, interface: Index, joints: Sequence[str], least: float = 0.02) -> dict[str, float]:
        """What every joint does, as a test would write it down.

        "opened J" and "slid J" are 1 or 0, never both 1.

        Parameters
        ----------
        interface : number of the joint of every contact point, shape (m,)
        joints : their names
        least : a joint that moves less than this part of the largest rate of all is intact [-]
        """
        of_joint = interface < len(joints)  # points of ties come after those of all joints
        opened, slid = np.zeros(len(joints)), np.zeros(len(joints))
        np.maximum.at(opened, interface[of_joint], np.abs(self.opening)[of_joint])
        np.maximum.at(slid, interface[of_joint], np.linalg.norm(self.sliding, axis=1)[of_joint])
        largest = float(max(opened.max(initial=0.0), slid.max(initial=0.0)))
        return flags({"opened": opened, "slid": slid}, joints, least * largest)

    def __repr__(self) -> str:
        return f"<Mechanism of {len(self.twists)} blocks, {len(self.moving_blocks())} of them moving>"

    def moving_blocks(self, threshold: float = 1e-6) -> Index:
        """Numbers of the blocks that move, shape (k,).

        Parameters
        ----------
        threshold : a block moves whose largest rate is more than this part of the largest of all [-]
        """
        rate = np.abs(self.twists).max(axis=1)
        return np.flatnonzero(rate > threshold * max(float(rate.max(initial=0.0)), 1e-300))


@dataclass(frozen=True, eq=False)
class Resultants(ReadOnly):
    """Forces in the joints, compression positive, acting on block b.

    They act on block a in the opposite sense.

    Parameters
    ----------
    normal : N per interface [N], shape (k,)
    shear : along tangent_1 and tangent_2 of the assembly's arrays [N], shape (k, 2)
    moment : about the interface's centroid, around tangent_1 and tangent_2 [N m], shape (k, 2)
    torsion : about the centroid, around the normal [N m], shape (k,)
    point_position : [m], shape (m, 3)
    point_interface : interface each point belongs to, shape (m,)
    point_area : tributary area [m2], shape (m,)
    point_force : force on block b in global axes [N], shape (m, 3)
    """

    normal: Array
    shear: Array
    moment: Array
    torsion: Array
    point_position: Array
    point_interface: Index
    point_area: Array
    point_force: Array

    def __repr__(self) -> str:
        return f"<Resultants of {len(self.normal)} joints from the forces of {len(self.point_area)} contact points>"


@dataclass(frozen=True, eq=False)
class Prediction(Displayed, Citable, ReadOnly):
    """A method's answer.

    Parameters
    ----------
    method : which theory and flow rule
    collapse_multiplier : lambda [-]; NaN when the structure cannot stand, infinite when unbounded
    bound : what it is relative to, in words; ``bound.kind`` is the :class:`BoundKind`. Words alone are taken for a
        :class:`Bound` by the kind that they begin with
    status : a :class:`Status`; its words are taken for it
    mechanism : velocities at collapse; None where the method has none
    resultants : joint forces; None where the method has none
    certificate : how well the answer satisfies its theory; None where the method has none
    warnings : what a user should know before trusting the number
    provenance : versions, settings and times that reproduce it: written for a reader, read by no program
    details : further results of the method
    flow_rule : that the answer follows; None where the method has no such rule
    contact_model : that the joint forces follow; None where the method has its own
    plane : whether the problem was reduced to a plane one
    stress_block : whether crushing is that of in-plane sections, not of points
    governing : which of several cases the answer belongs to; empty where there is one
    error_budget : what changed with every setting that was checked, by its name; empty without checks
    range : low and high end about the multiplier and what they are
    reaction : of a support that settles, whose answer this is in place of a multiplier
    structure : assembly that was solved, for ``plot()``; not kept by files, nor by copies to other processes
    loads : that it was solved under, kept as the structure is
    lost_in_failure : what the joints lose where they fail, by what and over which energy, one sentence per joint law;
        empty where they have nothing to lose
    references : papers of the theory, the method, the solvers and the packaged data, for ``cite()``
    """

    method: str
    collapse_multiplier: float
    bound: Bound
    status: Status
    mechanism: Mechanism | None = None
    resultants: Resultants | None = None
    certificate: Certificate | None = None
    warnings: tuple[str, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)
    flow_rule: FlowRule | None = None
    contact_model: ContactModel | None = None
    plane: bool = False
    stress_block: bool = False
    governing: str = ""
    error_budget: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    range: Range = field(default_factory=Range)
    reaction: Reaction | None = None
    lost_in_failure: tuple[str, ...] = ()
    references: tuple[Cited, ...] = ()
    structure: Any = field(default=None, repr=False)
    loads: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Take words for the member of the closed set that they name.

        Other packages and files of 0.1 give words alone.
        """
        if not isinstance(self.bound, Bound):
            object.__setattr__(self, "bound", Bound.from_text(self.bound))
        for name, kind in (("status", Status), ("flow_rule", FlowRule), ("contact_model", ContactModel)):
            given = getattr(self, name)
            # a method may have no flow rule and no contact model, but ends somehow
            if not isinstance(given, kind) and (given is not None or name == "status"):
                object.__setattr__(self, name, member_of(kind, given, name))

    def __repr__(self) -> str:
        return f"<Prediction by {self.method}: {self.answer} ({self.status})>"

    def __getstate__(self) -> dict[str, Any]:
        """Without structure and loads, which every answer of a study would carry along."""
        return {**self.__dict__, "structure": None, "loads": None}

    @property
    def quantities(self) -> dict[str, float]:
        """What a test would write down, by name: peak, curve and pattern.

        "peak" is the multiplier. The pattern, "opened J" and "slid J" of every joint J, is that of the mechanism, where
        structure and contact points are known. A method that tells what is left of the load gives that as "residual".
        """
        out = {"peak": float(self.collapse_multiplier)}
        curve = self.details.get("curve")
        if isinstance(curve, Curve):
            limit = self.details.get("limit point displacement")
            # the answer is the load of the limit point, which a curve may climb above later on
            out = curve.quantities | ({} if limit is None else out | {"drift at peak": float(limit)})
        if self.mechanism is None or self.resultants is None or self.structure is None:
            return out
        joints = self.resultants.point_interface
        if len(joints) == len(self.mechanism.opening):  # forces and rates of the same contact points
            out |= self.mechanism.pattern(joints, self.structure.joint_names)
        return out

    @property
    def interval(self) -> tuple[float, float] | None:
        """Low and high end about the multiplier by the method's own error budget [-].

        It is None where the method gives none.
        """
        ends = self.details.get("interval")
        return None if ends is None else (float(ends[0]), float(ends[1]))

    @property
    def tilt_angle_deg(self) -> float:
        """Tilt at collapse, the angle whose tangent is the multiplier [deg].

        Raises
        ------
        NotApplicable
            Where the multiplier is not the tangent of a tilt angle: dead loads besides the own weight, live loads other
            than the weights turned to one horizontal direction, or joints with cohesion, tensile or compressive
            strength; the message says which. Also where the method did not say what its loads were.
        """
        reason = self.details.get(NO_TILT, "it does not say which loads it is for; lm.predict and lm.limit_analysis do")
        if reason:
            raise NotApplicable(f"no tilt angle belongs to the multiplier of {self.method!r}: {reason}")
        return float(np.degrees(np.arctan(self.collapse_multiplier)))

    @property
    def answer(self) -> str:
        """The number and its name: the multiplier, or the reaction of a support."""
        if self.reaction is None:
            return f"lambda = {self.collapse_multiplier:.6g}"
        least, unit = self.reaction.least, self.reaction.unit
        return "no reaction" if math.isnan(least) else f"least reaction {least:.6g} {unit}"

    def __str__(self) -> str:
        """Multiplier, what it is, and its certificate."""
        lines = [f"{self.method}: {self.answer} ({self.status}; {self.bound})"]
        if self.interval is not None:
            # what was changed, by how much that changed the answer, and how finely that is known
            parts = [
                f"{name} {100 * row['change']:+.1f} % (resolved to {100 * row['resolution']:.1g} %)"
                if np.isfinite(row["change"])
                else f"{name} undecided"
                for name, row in self.error_budget.items()
            ]
            low, high = self.interval
            lines.append(f"  interval {low:.6g} to {high:.6g}: {', '.join(['bracket', *parts])}")
        if self.certificate is not None:
            lines += ["  " + row for row in self._certificate_rows()]
        lines += [f"  {words}" for words in self.lost_in_failure]
        lines += [f"  warning: {w}" for w in self.warnings]
        return "\n".join(lines)

    def _certificate_rows(self) -> list[str]:
        """Lines of the certificate; for a support that settles, bounds of its reaction in place of multipliers."""
        rows = str(self.certificate).splitlines()
        if self.reaction is None or math.isnan(self.reaction.by_forces):
            return rows
        ends, unit = {"mechanism": self.reaction.by_mechanism, "forces": self.reaction.by_forces}, self.reaction.unit
        own = [f"{f'reaction by the {name}':<{LABEL_WIDTH}}{value:.8g} {unit}" for name, value in ends.items()]
        return [r for r in rows if " multiplier" not in r] + own
