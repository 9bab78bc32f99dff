"""The load-displacement curve of a push, with what its joints did: first failure, cracks, peak, residual, mode."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.failure_mode import Mode, failure_mode
from dem.history import History
from dem.papers import PAPERS
from limitmason.answers.curve import Curve, Event
from limitmason.answers.references import data_behind
from limitmason.errors import InputError
from limitmason.model import Assembly

Array = NDArray[np.float64]

RESTLESS = 1e-2
"""Kinetic energy over the work so far from which a stretch of the curve is called dynamic [-]."""

RATE = 0.02
"""Rate error from which a curve warns [-]."""

BY_WEIGHT = "fails under its own weight"

FEW = 2
"""Joints that have failed by the peak up to which it does not hang on the order in which they did."""


@dataclass(frozen=True)
class JointPoint:
    """A point of a curve at which a joint did something: sample, displacement, load, the joint, and how far it went."""

    index: int
    displacement: float
    load: float
    where: str
    value: float


@dataclass(frozen=True, eq=False)
class PushCurve(Curve):
    """Curve of :func:`dem.push`; sample 0 is the settled structure before it is driven.

    Parameters
    ----------
    assembly : what was driven; of lumped units with the joints' series stiffness
    history : of the drive, from sample 1 on
    opening, slip, crushed : largest opening, plastic slip and crushing in every interface [m], shape (n, k)
    used, failed : largest part of its strength in use, and part of its area that has reached it [-], shape (n, k)
    settlement : displacement by own weight of the driven block along the drive [m]
    blocks : how units deform
    spacing : largest distance between neighbouring contact points [m]
    law : what joints lose when they fail, in words
    steps : taken from sample 0 on
    faster : the same run at three times the speed; None where there was one run
    """

    assembly: Assembly | None = None
    history: History | None = None
    opening: Array | None = None
    slip: Array | None = None
    crushed: Array | None = None
    used: Array | None = None
    failed: Array | None = None
    settlement: float = 0.0
    blocks: str = ""
    spacing: float = 0.0
    law: str = ""
    steps: int = 0
    faster: PushCurve | None = None

    @property
    def rate_error(self) -> float:
        """Difference of the peaks at the two speeds over the slower one's [-]; NaN after one run."""
        if self.faster is None:
            return float("nan")
        peak = self.peak.load
        return abs(self.faster.peak.load - peak) / max(abs(peak), 1e-300)

    @property
    def first_failure(self) -> JointPoint | None:
        """Where the first point of a joint reached its strength while driven; None where none did.

        Between two samples the strength in use is continued in a line, the load along the secant: exact for elastic
        joints. Where it is reached before there are two samples, the first that shows it. Where own weight alone breaks
        a joint, sample 0 and no load.
        """
        assert self.failed is not None
        assert self.used is not None
        failed = np.nan_to_num(self.failed) > 0.0
        if failed[0].any():
            k = int(np.argmax(np.nan_to_num(self.failed[0])))
            return JointPoint(0, float(self.displacement[0]), float(self.load[0]), self._joint(k), 1.0)
        hit = failed.any(axis=1)
        if not hit.any():
            return None
        i = int(np.argmax(hit))
        rows = np.flatnonzero(failed[i])
        u, f, j = self.displacement, self.load, i - 1
        if j == 0:
            # nothing to continue a line from
            return JointPoint(i, float(u[i]), float(f[i]), self._joint(int(rows[0])), 1.0)
        rise = (self.used[j, rows] - self.used[j - 1, rows]) / (u[j] - u[j - 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            ahead = np.where(rise > 0.0, (1.0 - self.used[j, rows]) / rise, np.inf)
        k = int(np.argmin(ahead))
        step = min(float(ahead[k]), float(abs(u[i] - u[j]))) * float(np.sign(u[i] - u[j]))
        load = float(f[j] + (f[j] - f[0]) / (u[j] - u[0]) * step)
        return JointPoint(i, float(u[j] + step), load, self._joint(int(rows[k])), 1.0)

    def first_crack(self, width: float, kind: str | None = None) -> JointPoint | None:
        """Where an opening first reaches a width, in joints of one kind; None where none does.

        Parameters
        ----------
        width : [m]; of a lumped unit the elastic opening includes the units' share, some micrometres
        kind : "bed", "head", "base"; None for all
        """
        assert self.opening is not None
        assert self.assembly is not None
        if not width > 0.0:
            raise InputError(f"width must be positive [m], got {width!r}")
        kept = np.array([kind is None or i.kind == kind for i in self.assembly.interfaces])
        wide = np.nan_to_num(self.opening) * kept
        hit = (wide >= width).any(axis=1)
        if not hit.any():
            return None
        i = int(np.argmax(hit))
        k = int(np.argmax(wide[i]))
        if i == 0:
            return JointPoint(0, float(self.displacement[0]), float(self.load[0]), self._joint(k), float(wide[0, k]))
        part = (width - wide[i - 1, k]) / (wide[i, k] - wide[i - 1, k])
        u, f = self.displacement, self.load
        return JointPoint(
            i, float(u[i - 1] + part * (u[i] - u[i - 1])), float(f[i - 1] + part * (f[i] - f[i - 1])), self._joint(k),
            float(wide[i, k]),
        )  # fmt: skip

    @property
    def residual(self) -> float:
        """Load at the end, the median of the last five samples."""
        return float(np.median(self.load[-5:]))

    @property
    def mode(self) -> Mode:
        """How it failed, by the joints that have moved at the end; see :func:`dem.failure_mode.failure_mode`."""
        return self.mode_at(-1)

    def mode_at(self, index: int) -> Mode:
        """The same at a sample."""
        assert self.assembly is not None
        assert self.opening is not None
        assert self.slip is not None
        assert self.crushed is not None
        i = self.point(index).index
        since = (v[i] - v[0] for v in (self.opening, self.slip, self.crushed))
        return failure_mode(self.assembly, *since)

    def moved(self, index: int) -> tuple[Array, Array]:
        """Displacements of the centroids [m] and quaternions of all blocks at a sample, own weight included."""
        assert self.history is not None
        i = self.point(index).index
        if i == 0:
            return self.states[0]
        return self.history.shift[i - 1], self.history.quaternion[i - 1]

    def beside(self, faster: PushCurve) -> PushCurve:
        """This curve with the same run at a higher speed as its rate error."""
        peak = max(abs(self.peak.load), 1e-300)
        # both run the same path: where it is done to the same part
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

    def _joint(self, k: int) -> str:
        assert self.assembly is not None
        i = self.assembly.interfaces[k]
        return f"{i.kind} joint of {self.assembly.blocks[i.block_a].name} and {self.assembly.blocks[i.block_b].name}"

    def __str__(self) -> str:
        """Peak and the rest in a few lines, with what it rests on."""
        lines = [Curve.__str__(self)]
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
        return "\n".join(lines + [f"  note: {w}" for w in self.warnings])

    __repr__ = __str__


def make_curve(
    assembly: Assembly, settled: History, history: History, unit: Array, steps: int, **words: Any
) -> PushCurve:
    """Curve of a history that began at a settled one.

    Parameters
    ----------
    unit : twist of the blocks per displacement of 1 m, shape (n, 6)
    """
    block = int(np.argmax(np.linalg.norm(unit[:, :3], axis=1)))
    direction = unit[block, :3]
    before = settled.state.bodies.shift[block]
    driven = [k for k, b in enumerate(history.reaction_blocks) if unit[b].any()]
    twist = unit[history.reaction_blocks[driven]]
    load = np.einsum("sbk,bk->s", history.reaction[:, driven], twist)
    kinetic = history.kinetic_ratio_since(settled)
    energy = history.energy_error / history._work
    # a state goes on and is written to
    shift, quat = settled.state.bodies.shift.copy(), settled.state.bodies.quat.copy()
    states = [(shift, quat), *zip(history.shift, history.quaternion, strict=True)]
    notes = list(history.warnings)
    displacement = (history.shift[:, block] - before) @ direction
    notes += dynamic_notes(displacement, kinetic)

    def marks(name: str) -> Array:
        return np.concatenate([getattr(settled, name)[-1:], getattr(history, name)])

    curve = PushCurve(
        np.concatenate([[0.0], displacement]), np.concatenate([[0.0], load]),
        errors={"energy": np.concatenate([[0.0], energy]), "kinetic": np.concatenate([[0.0], kinetic])},
        states=states, status=history.status, warnings=tuple(notes), source="dem.push", assembly=assembly,
        history=history, opening=marks("opening"), slip=marks("slip"), crushed=marks("crushed"), used=marks("used"),
        failed=marks("failed"), settlement=float(before @ direction), law="; ".join(history.lost_in_failure),
        steps=steps, references=(*PAPERS, *data_behind(assembly.recipe)), **words,
    )  # fmt: skip
    sudden = any("at once" in law and "in failure: nothing" not in law for law in history.lost_in_failure)
    if sudden and (np.nan_to_num(marks("failed")[curve.peak.index]) > 0.0).sum() > FEW:
        notes.append(
            "joints lose their strength at once: the peak hangs on which joint breaks first, and that on rounding; "
            "quote the median of a few starts whose blocks are moved by 1e-12 m, or lm.pushover"
        )
    return replace(curve, events=failure_events(curve), warnings=tuple(notes))


def dynamic_notes(displacement: Array, kinetic: Array) -> list[str]:
    """A note where the kinetic energy is more than a small part of the work, from which displacement [m] on."""
    dynamic = np.flatnonzero(kinetic > RESTLESS)
    if not len(dynamic):
        return []
    return [
        f"kinetic energy reaches {kinetic.max():.1e} of the work, above {RESTLESS:g} first at "
        f"{displacement[dynamic[0]]:.3g} m: from there on drops are dynamic, and what follows one is a fall, not a "
        "branch of equilibrium"
    ]


def failure_events(curve: PushCurve) -> tuple[Event, ...]:
    """The first failure of a curve as an event, by own weight or while it is driven; none where no joint fails."""
    first = curve.first_failure
    if first is None:
        return ()
    return (Event("first failure" if first.index else BY_WEIGHT, first.index, first.where, first.value),)
