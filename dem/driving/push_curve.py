"""The load-displacement curve of a push, with what its joints did: first failure, cracks, peak, residual, mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dem.driving.failure_mode import MODES, Mode, failure_mode
from dem.model.joint_marks import JointMarks, first_opening
from dem.papers import PAPERS
from dem.stages.history import History
from dem.zones.mesh import ZoneMesh
from dem.zones.recording import AT_YIELD, ELASTIC, TENSION, YIELDED, ZoneState
from limitmason.answers.curve import Curve, Event
from limitmason.answers.references import data_behind
from limitmason.answers.results import flags
from limitmason.arrays import Array
from limitmason.checks import positive
from limitmason.errors import InputError
from limitmason.model import Assembly

RESTLESS = 1e-2
"""Kinetic energy over the work so far from which a stretch of the curve is called dynamic [-]."""

RATE = 0.02
"""Rate error from which a curve warns [-]."""

CRACK = 0.15e-3
"""Opening, slip or crushing of a joint that a test would write down as a crack [m]."""

BY_WEIGHT = "fails under its own weight"

SWING = 0.05
"""Swing of the load about its running median, over the peak, from which a curve warns [-]."""

_COURSE, _WITHIN = 10, (0.05, 0.95)
"""Part of the samples, one in so many, over which that median runs, and quantiles between which a load swings."""

BETWEEN = 0.02
"""Load that may be missed between two samples, over the peak, from which a curve warns [-]."""

FEW = 2
"""Joints that have failed by the peak up to which it does not hang on the order in which they did."""

END = 5
"""Samples at the end whose median load is the residual: one alone may ride on a swing."""

TINY = 1e-300  # a load or work that a part is of, instead of 0


@dataclass(frozen=True)
class JointPoint:
    """A point of a curve at which a joint, or a zone of a block, did something."""

    index: int  # of the sample at which it is seen
    displacement: float  # [m], at that sample or on the way to it
    load: float  # [N]
    where: str  # the joint, or the block
    value: float  # how far, at that sample: width [m], strain [-], or part of the strength in use [-]


@dataclass(frozen=True, eq=False, kw_only=True)
class PushCurve(Curve, JointMarks):
    """Curve of :func:`dem.push`.

    Sample 0 is the settled structure before it is driven.

    Parameters
    ----------
    assembly : what was driven; of lumped units with the joints' series stiffness
    history : of the drive, from sample 1 on; None of zoned blocks
    opening, slip, crushed : largest opening, plastic slip and crushing in every interface [m], shape (n, k)
    used : largest part of its strength in use [-], shape (n, k)
    failed : part of its area that has reached it [-], shape (n, k)
    settlement : displacement by own weight of the driven block along the drive [m]
    blocks : how units deform
    spacing : largest distance between neighbouring contact points [m]
    law : what joints lose when they fail, in words
    steps : taken from sample 0 on
    seconds : that the run took [s]
    faster : the same run at three times the speed; None where there was one run
    mesh : nodes and zones of zoned blocks
    zones : their state at every sample; empty of other blocks
    stress : of the zones: "plane stress" or "plane strain"
    """

    assembly: Assembly
    history: History | None = None
    settlement: float
    blocks: str
    spacing: float
    law: str
    steps: int
    seconds: float
    faster: PushCurve | None = None
    mesh: ZoneMesh | None = None
    zones: Sequence[ZoneState] = ()
    stress: str = ""

    @property
    def rate_error(self) -> float:
        """Difference of the peaks at the two speeds over the slower one's [-].

        It is NaN after one run.
        """
        if self.faster is None:
            return float("nan")
        peak = self.peak.load
        return abs(self.faster.peak.load - peak) / max(abs(peak), TINY)

    @property
    def first_failure(self) -> JointPoint | None:
        """Where the first point of a joint reached its strength while driven.

        It is None where none did.

        Between two samples the strength in use is continued in a line, the load along the secant: exact for elastic
        joints. Where it is reached before there are two samples, the first that shows it is returned. Where own weight
        alone breaks a joint, that is sample 0 and no load.
        """
        failed, u, f = np.nan_to_num(self.failed) > 0.0, self.displacement, self.load
        if failed[0].any():
            k = int(np.argmax(np.nan_to_num(self.failed[0])))
            return JointPoint(0, float(u[0]), float(f[0]), self._joint(k), value=1.0)
        hit = failed.any(axis=1)
        if not hit.any():
            return None
        seen = int(np.argmax(hit))  # sample that shows it, and the one before, where no joint had failed yet
        last, joints = seen - 1, np.flatnonzero(failed[seen])
        if last == 0:
            # nothing to continue a line from
            return JointPoint(seen, float(u[seen]), float(f[seen]), self._joint(int(joints[0])), value=1.0)
        # per metre of the way, whichever way the drive goes
        rise = (self.used[last, joints] - self.used[last - 1, joints]) / abs(u[last] - u[last - 1])
        # way from the last sample on which each joint comes to its strength; none where its use does not rise
        with np.errstate(divide="ignore", invalid="ignore"):
            ahead = np.where(rise > 0.0, (1.0 - self.used[last, joints]) / rise, np.inf)
        k = int(np.argmin(ahead))
        # it has failed by the sample that shows it
        step = min(float(ahead[k]), float(abs(u[seen] - u[last]))) * float(np.sign(u[seen] - u[last]))
        load = float(f[last] + (f[last] - f[0]) / (u[last] - u[0]) * step)
        return JointPoint(seen, float(u[last] + step), load, self._joint(int(joints[k])), value=1.0)

    def first_crack(self, width: float, kind: str | None = None) -> JointPoint | None:
        """Where an opening first reaches a width, in joints of one kind, or None.

        Between two samples openings grow in a line. Of several joints that reach the width there, the first is taken.
        Displacement and load are those at the width, ``value`` is the opening [m] at the sample that shows it. A joint
        whose contacts were found anew (NaN) counts as closed. Where own weight opens a joint, that is sample 0.

        Parameters
        ----------
        width : [m]; of a lumped unit the elastic opening includes the units' share, some micrometres
        kind : "bed", "head", "base", "crack"; None for all
        """
        positive("width", width, "m")
        found = first_opening(self, self.assembly, width, kind)
        if found is None:
            return None
        i, last = found.sample, max(found.sample - 1, 0)
        u, f = (float(v[last] + found.part * (v[i] - v[last])) for v in (self.displacement, self.load))
        return JointPoint(i, u, f, self._joint(found.joint), found.opening)

    @property
    def residual(self) -> float:
        """Load at the end [N], the median of the last five samples."""
        return float(np.median(self.load[-END:]))

    @property
    def mode(self) -> Mode:
        """How it failed, by the joints that have moved at the end, see ``failure_mode``."""
        return self.mode_at(-1)

    def mode_at(self, index: int) -> Mode:
        """Failure mode by what joints have moved up to a sample, -1 for the last."""
        i = self.point(index).index
        since = (v[i] - v[0] for v in (self.opening, self.slip, self.crushed))
        return failure_mode(self.assembly, *since)

    def moved(self, index: int) -> tuple[Array, Array]:
        """Displacements of the centroids [m] and quaternions of all blocks at a sample.

        Own weight is included.
        """
        return self.states[self.point(index).index]

    def first_unit_crack(self, width: float) -> JointPoint | None:
        """Where a zone that failed in tension is first stretched by a width, or None.

        The stretch is the zone's accumulated plastic strain times its size (``mesh.zone_sizes``), at the most strained
        of its four points. A crack is smeared over a zone, whose first touch of the tensile strength nobody could see.
        For cracks that are joints use ``first_crack(width, "crack")``.

        Parameters
        ----------
        width : [m]
        """
        positive("width", width, "m")
        sizes = self._mesh.zone_sizes
        return self._first_zone([z.plastic * sizes * (z.marks == TENSION) for z in self.zones], width)

    def first_crushing(self, strain: float) -> JointPoint | None:
        """Where a zone that yielded in shear alone first has a plastic strain, or None.

        Parameters
        ----------
        strain : accumulated length of the plastic strain [-], 1.4 times the shortening of a zone crushed along one axis
            without dilatancy
        """
        positive("strain", strain)
        return self._first_zone([z.plastic * np.isin(z.marks, (AT_YIELD, YIELDED)) for z in self.zones], strain)

    @property
    def _mesh(self) -> ZoneMesh:
        """Mesh of zoned blocks; asked of others it is refused."""
        if self.mesh is None:
            raise InputError(f"{self.blocks} blocks have no zones: push with blocks='zoned'")
        return self.mesh

    def _first_zone(self, values: Sequence[Array], least: float) -> JointPoint | None:
        """First sample at which any zone reaches the value ``least``, or None.

        ``values`` holds one array per sample, shape (zones,). The point names the block of the zone with the largest.
        """
        for i, value in enumerate(values):
            hit = np.flatnonzero(value >= least)
            if len(hit):
                k = int(hit[np.argmax(value[hit])])
                where = self.assembly.blocks[int(self._mesh.zone_block[k])].name
                return JointPoint(i, float(self.displacement[i]), float(self.load[i]), where, float(value[k]))
        return None

    def beside(self, faster: PushCurve) -> PushCurve:
        """This curve with a faster run of the same path as its rate error.

        The error is the difference of the loads at equal ways along the path, over the peak of this one.
        """
        peak = max(abs(self.peak.load), TINY)
        # by the way travelled, which grows where a displacement turns back
        way = [np.concatenate([[0.0], np.cumsum(np.abs(np.diff(c.displacement)))]) for c in (self, faster)]
        other = np.interp(way[0], way[1], faster.load)
        both = replace(self, errors={**self.errors, "rate": np.abs(other - self.load) / peak}, faster=faster)
        if both.rate_error > RATE:
            note = (
                f"peaks at the two speeds differ by {both.rate_error:.1%}: {faster.peak.load:.5g} {self.load_unit} in "
                f"{faster.steps} steps, {self.peak.load:.5g} in {self.steps}; take more steps"
            )
            both = replace(both, warnings=(*both.warnings, note))
        return both

    def in_units(self, displacement_unit: str, displacement: float, load_unit: str, load: float) -> Curve:
        """This curve and the faster one in other units, see :meth:`.Curve.in_units`."""
        units = displacement_unit, displacement, load_unit, load
        found, faster = super().in_units(*units), None if self.faster is None else self.faster.in_units(*units)
        assert isinstance(found, PushCurve)
        assert isinstance(faster, PushCurve | None)
        return replace(found, faster=faster)

    @property
    def quantities(self) -> dict[str, float]:
        """Quantities of every curve, with the first crack, 0.15 mm wide, and what each joint has done.

        "opened J", "slid J" and "crushed J" of a joint J are 1 for a largest movement beyond 0.15 mm at the end of the
        curve, else 0; "failure mode N" is 1 for the name N of :attr:`mode`.
        """
        out, first = super().quantities, self.first_crack(CRACK)
        if first is not None:
            out |= {"first crack": first.load, "drift at first crack": first.displacement}
        out |= {f"failure mode {name}": float(name == self.mode.name) for name in MODES}
        moved = {"opened": self.opening, "slid": self.slip, "crushed": self.crushed}
        return out | flags({k: np.nan_to_num(v[-1]) for k, v in moved.items()}, self.assembly.joint_names, CRACK)

    def _joint(self, k: int) -> str:
        """Joint number k in words, by its kind and its two blocks."""
        i = self.assembly.interfaces[k]
        return f"{i.kind} joint of {self.assembly.blocks[i.block_a].name} and {self.assembly.blocks[i.block_b].name}"

    def __str__(self) -> str:
        """Peak and the rest in a few lines, with what it rests on."""
        lines = Curve.__str__(self).splitlines()
        first = self.first_failure
        if first is not None:
            at = f"{first.displacement:.4g} {self.displacement_unit}"
            lines.append(f"  first failure {first.load:.4g} {self.load_unit} at {at}, {first.where}")
        rate = "one speed" if self.faster is None else f"rate error {self.rate_error:.2%}"
        lines += [
            f"  residual {self.residual:.4g} {self.load_unit}; mode: {self.mode}",
            f"  {self.blocks} blocks, contact points up to {1e3 * self.spacing:.4g} mm apart",
            f"  joints: {self.law or 'without strength'}",
            f"  {rate}; kinetic energy up to {self.errors['kinetic'].max():.1e} of the work; {self.steps} steps",
        ]
        if self.mesh is not None:
            share = f"{np.mean(self.zones[-1].marks > ELASTIC):.1%} of them yielded or cracked at the end"
            lines.append(f"  {len(self.mesh.zones)} zones up to {1e3 * self.mesh.size:.4g} mm, {self.stress}; {share}")
        return "\n".join(lines)

    __repr__ = __str__


def told(curve: PushCurve, label: str) -> PushCurve:
    """A curve with what a reader must know of it: source, events and warnings.

    ``label`` is what a legend calls it.
    """
    # sample 0 is the structure at rest before the drive
    kinetic = curve.errors["kinetic"][1:]
    notes = [*curve.warnings, *dynamic_notes(curve.displacement[1:], kinetic)]
    if (swing := swing_of(curve.load)) > SWING:
        notes.append(
            f"the load swings by {swing:.0%} of its peak about its running median: the peak is that of a swing; take "
            "more steps, or damping=Damping(local=0.8)"
        )
    if (higher := missed_between(curve.load)) > BETWEEN:
        notes.append(
            f"the load falls at once behind its largest sample: the peak may be up to {higher:.1%} higher; take "
            # so many times as many that a quarter of what is warned of may be missed
            f"samples={math.ceil(higher / (0.25 * BETWEEN)) * (len(curve) - 1)}"
        )
    # joints that lose all at once break one after the other, each by what the others before left it
    sudden = any("at once" in law and "in failure: nothing" not in law for law in curve.law.split("; "))
    if sudden and (np.nan_to_num(curve.failed[curve.peak.index]) > 0.0).sum() > FEW:
        notes.append(
            "joints lose their strength at once: the peak hangs on which joint breaks first, and that on rounding; "
            "quote the median of a few starts whose blocks are moved by 1e-12 m, or lm.pushover"
        )
    first, failed = curve.first_failure, []
    if first is not None:
        failed.append(Event("first failure" if first.index else BY_WEIGHT, first.index, first.where, first.value))
    return replace(
        curve, label=label, source="dem.push", references=(*PAPERS, *data_behind(curve.assembly.recipe)),
        events=(*failed, *_zone_events(curve)), warnings=tuple(notes),
    )


def swing_of(load: Array) -> float:
    """Swing of the load about its running median, over the peak [-].

    It is half the range in which nine tenths of the loads lie. The median runs over a tenth of the samples; ``load``
    [N] has one value per sample.
    """
    width = len(load) // _COURSE | 1  # an odd number of samples has a middle one
    middle = np.median(np.lib.stride_tricks.sliding_window_view(load, width), axis=1)
    about = load[width // 2 :][: len(middle)] - middle
    low, high = np.quantile(about, _WITHIN)
    return float(0.5 * (high - low) / max(np.abs(load).max(), TINY))


def missed_between(load: Array) -> float:
    """Load beyond the largest sample that may have been missed, over the peak [-].

    Where it falls at once, by more than twice its last rise, it may have risen for almost a sample more; 0 elsewhere,
    and at the ends of the curve. ``load`` has one value per sample [N].
    """
    size = np.abs(load)
    k = int(np.argmax(size))
    if k == 0 or k + 1 == len(size):
        return 0.0
    rise, fall = float(size[k] - size[k - 1]), float(size[k] - size[k + 1])
    return rise / float(size[k]) if fall > 2.0 * rise else 0.0


def dynamic_notes(displacement: Array, kinetic: Array) -> list[str]:
    """A note from which displacement on a curve is dynamic, none where it is not.

    ``displacement`` [m] and ``kinetic``, the energy over the work [-], have one value per sample.
    """
    dynamic = np.flatnonzero(kinetic > RESTLESS)
    if not len(dynamic):
        return []
    return [
        f"kinetic energy reaches {kinetic.max():.1e} of the work, above {RESTLESS:g} first at "
        f"{displacement[dynamic[0]]:.3g} m: from there on drops are dynamic, and what follows one is a fall, not a "
        "branch of equilibrium"
    ]


def _zone_events(curve: PushCurve) -> list[Event]:
    """Where zones first yield and first crack, and their plastic strain [-]; empty if blocks are not zoned.

    Of several at one sample the most strained counts.
    """
    events = []
    for name, wanted in (("unit yields", (AT_YIELD, YIELDED)), ("unit cracks", (TENSION,))):
        # plastic strain where a zone bears the mark, and less than any elsewhere
        first = curve._first_zone([np.where(np.isin(z.marks, wanted), z.plastic, -1.0) for z in curve.zones], 0.0)
        if first is not None:
            events.append(Event(name, first.index, first.where, first.value))
    return events
