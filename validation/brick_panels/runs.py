"""The pushes behind the page of the panels' paper, each computed once and kept: speeds, levels, starts, no rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason.capacity import elastic_range, pushover
from limitmason.deformable.levels import LUMPED, ZONED
from limitmason.errors import InputError
from limitmason.experiments import registry
from limitmason.experiments.brick_panels_opening import OPTIONS
from limitmason.methods import DEM, get_method
from limitmason.model.assembly import Assembly
from limitmason.study import Memo, fingerprint
from limitmason.study.run_fingerprint import fingerprint_of_code

NAME = "brick-panels-opening"

TRAVEL = 1.3e-3
"""Displacement of the runs [m], beyond the largest that the tables print."""

CRACK = 0.2e-3
"""Width that the paper assumes of a visible crack [m]."""

STEPS = 15_000
"""Of the faster run of every push."""

SPACING = 0.0375
"""Of contact points, and of zones [m]; the lattice on which those of all joints meet."""

EVERY = 1e-5
"""Displacement between the loads that are kept of a curve [m]."""

GIVEN_UP, WAITED = 0.5, 0.3e-3
"""A run of zones ends where it has carried less than this part of its largest load over this displacement [-], [m].

No run that went on lost a peak by it: what is left of a panel then lies on the ground.
"""

NUDGE = 1e-10
"""Largest move of a block in a perturbed start, along each axis [m]."""


@dataclass(frozen=True)
class Answer:
    """What one push gave: loads [kN], displacements beyond own weight [mm]; ``loads`` at every :data:`EVERY`."""

    peak: float
    at_peak: float
    first: float
    at_first: float
    crack: float
    settlement: float
    stiffness: float
    rate: float
    mode: str
    law: str
    spacing: float
    where: str
    loads: Sequence[float] = ()

    def largest_until(self, displacement: float) -> float:
        """Largest load up to a displacement [mm], of the peak and the loads kept; NaN where there are none."""
        if displacement >= self.at_peak:
            return self.peak
        at = 1e3 * EVERY * np.arange(len(self.loads))
        return float(np.asarray(self.loads)[at <= displacement].max(initial=0.0)) or float("nan")


@dataclass(frozen=True)
class Onsets:
    """First failures of runs on one elastic panel, by superposition: loads [kN], below 0 where own weight is too much.

    Parameters
    ----------
    opening, slip : of every run, by that criterion alone; joints lose strength by the first
    where : the joint that opens first in the last of the runs
    settlement : by own weight [mm]
    compliance : under the plate [mm/kN]
    """

    opening: Sequence[float]
    slip: Sequence[float]
    where: str
    settlement: float
    compliance: float


class Runs:
    """Pushes, each computed once and kept in a folder."""

    def __init__(self, store: str | Path | None, progress: Callable[[str], None] | None) -> None:
        self.memo = Memo(None if store is None else Path(store) / f"{NAME}.jsonl", kind=dict)
        self.say = progress or (lambda _: None)

    def __call__(
        self,
        specimen: str,
        *,
        once: bool = False,
        to: float = TRAVEL,
        steps: int = STEPS,
        blocks: str = LUMPED,
        seed: int = 0,
        crack: int = 0,
        **options: Any,
    ) -> Answer:
        """Answer of a specimen with options, at two speeds or one.

        Parameters
        ----------
        blocks : "lumped", "simply deformable" or "zoned"
        seed : of the perturbed start, see :func:`nudged`; 0 for blocks where they are
        crack : course above which the bed joint is without strength at both ends of the panel; 0 for none
        options : of the experiment
        """
        levels = ("blocks", blocks, LUMPED), ("seed", seed, 0), ("crack", crack, 0)
        level = {k: v for k, v, usual in levels if v != usual}
        words = ", ".join(f"{k} {v}" for k, v in (level | options).items())
        return Answer(**self._kept(
            [specimen, once, to, steps, options, *([level] if level else [])], [specimen],
            f"{specimen} {words}{' once' if once else ''}",
            lambda: _pushed(specimen, Push(once, to, steps, blocks, seed, crack), options),
        ))

    def rate_free(self, specimen: str, *, blocks: str = LUMPED, to: float = TRAVEL, **options: Any) -> Answer:
        """Answer of the path without time, of :func:`limitmason.pushover` on the points of the DEM.

        Its ``mode`` says where the path ended early.
        """
        return Answer(**self._kept(
            [specimen, "pushover", to, blocks, options], [specimen],
            f"{specimen} pushover, blocks {blocks}",
            lambda: _followed(specimen, blocks, to, options),
        ))

    def onsets(self, specimens: Sequence[str], *, blocks: str, spacing: float = SPACING, **options: Any) -> Onsets:
        """First failures of runs that differ in their strengths only, by :func:`limitmason.elastic_range`.

        Parameters
        ----------
        blocks : "rigid", "lumped", "simply deformable" or "ritz"
        spacing : of contact points [m]
        options : of the experiment; ``stress`` of blocks that deform
        """
        return Onsets(**self._kept(
            [list(specimens), "elastic range", blocks, spacing, options], specimens,
            f"elastic range, blocks {blocks}, points {1e3 * spacing:.4g} mm apart",
            lambda: _superposed(specimens, blocks, spacing, options),
        ))

    def _kept(
        self, call: Sequence[Any], specimens: Sequence[str], words: str, compute: Callable[[], Answer | Onsets]
    ) -> dict[str, Any]:
        """What is kept of a call, for the models that it is made on and the code that makes it."""
        options = {k: v for part in call if isinstance(part, Mapping) for k, v in part.items() if k in OPTIONS}
        model = _fingerprint_of_panels(*specimens, **options)
        model = fingerprint(model, _fingerprint_of_code(_pushed, _followed, _superposed))

        def say_and_compute() -> dict[str, Any]:
            self.say(words)
            return vars(compute())

        return self.memo.once([*call, model], say_and_compute)


class Push(NamedTuple):
    """One speed or two, displacement [m], steps of the faster run, kind of blocks, seed of the start, course above
    which the bed joint has no strength at its ends.
    """

    once: bool
    to: float
    steps: int
    blocks: str
    seed: int
    crack: int = 0


def nudged(assembly: Assembly, seed: int) -> Assembly:
    """The assembly with every block moved in its plane by up to :data:`NUDGE`, its joints where they were.

    Parameters
    ----------
    seed : of the random moves, uniform along each axis; 0 moves nothing
    """
    if seed == 0:
        return assembly
    random = np.random.default_rng(seed)
    laid = []
    for block in assembly.blocks:
        move = NUDGE * random.uniform(-1.0, 1.0, 3)
        move[1] = 0.0
        laid.append(replace(block, parts=tuple(p._replace(vertices=p.vertices + move) for p in block.parts)))
    return replace(assembly, blocks=tuple(laid))


def cracked(assembly: Assembly, course: int) -> Assembly:
    """The panel whose bed joint above a course has neither cohesion nor tension where it ends on either side.

    Parameters
    ----------
    course : counted from 1 at the bottom; 0 changes nothing
    """
    if course == 0:
        return assembly
    one, two = (f"facade-{c:02d}-" for c in (course, course + 1))
    names = [b.name for b in assembly.blocks]
    beds = [
        (float(np.mean(i.polygon[:, 0])), names[i.block_a], names[i.block_b])
        for i in assembly.interfaces
        if names[i.block_a].startswith(one) and names[i.block_b].startswith(two)
    ]
    if not beds:
        raise InputError(f"the panel has no bed joint above course {course}")
    weak = replace(
        assembly.interfaces[0].joint, cohesion=0.0, tensile_strength=0.0, residual_cohesion=None,
        residual_tensile_strength=None, name="cracked",
    )
    return assembly.with_joints({pair[1:]: weak for pair in (min(beds), max(beds))})


@cache
def _fingerprint_of_panels(*specimens: str, **options: Any) -> str:
    """Of panels with their loads and drives, which many runs share."""
    tests = [registry.load(NAME, s, **options) for s in specimens]
    return fingerprint([(t.assembly(), t.loads(), t.drive()) for t in tests])


@cache
def _fingerprint_of_code(*functions: Callable[..., Any]) -> str:
    return fingerprint_of_code(*functions)


def _gives_up() -> Callable[[Mapping[str, Any]], bool]:
    """Whether a run of zones is over, asked at every sample."""
    largest, since = 0.0, 0.0

    def over(sample: Mapping[str, Any]) -> bool:
        nonlocal largest, since
        largest = max(largest, sample["load"])
        if sample["load"] >= GIVEN_UP * largest:
            since = sample["displacement"]
        return bool(sample["displacement"] - since > WAITED)

    return over


def _pushed(specimen: str, push: Push, options: Mapping[str, Any]) -> Answer:
    test = registry.load(NAME, specimen, **options)
    follow = get_method(DEM).drive
    if follow is None:
        raise InputError("the DEM of this installation does not follow driven structures")
    # without contact_points zones take areas by halves, other blocks those with the second moment of the joint
    ways: dict[str, Any] = {}
    if push.blocks == ZONED:
        # one speed at a time: a run that is given up is followed by no slower one
        ways = {"zone_size": SPACING, "contact_points": SPACING, "progress": _gives_up() if push.once else None}
    if push.blocks == LUMPED:
        # at rest they bear their weight at ft 0.05 MPa, by a margin that it overshoots when it acts at once; bricks
        # that bend do not bear it
        ways["sound"] = True
    panel = nudged(cracked(test.assembly(), push.crack), push.seed)
    curve: Any = follow(
        panel, test.drive(), to=push.to, blocks=push.blocks, steps=push.steps, rate_check=not push.once, **ways
    )
    # a panel too strong to fail counts to the end of its curve
    first, crack = curve.first_failure or curve.peak, curve.first_crack(CRACK)
    # on the way up only: a panel that has failed may carry less than its first failure
    u = curve.displacement
    early = (curve.load < 0.9 * first.load) & (u > 0.2 * first.displacement) & (u < first.displacement)
    if not early.any():
        early = np.arange(len(curve)) == 1
    u, f = curve.displacement[early], curve.load[early]
    return Answer(
        1e-3 * curve.peak.load, 1e3 * curve.peak.displacement, 1e-3 * first.load, 1e3 * first.displacement,
        float("nan") if crack is None else 1e-3 * crack.load, 1e3 * curve.settlement, 1e6 * float(u @ u / (u @ f)),
        curve.rate_error, curve.mode_at(curve.peak.index).name, curve.law, 1e3 * curve.spacing,
        getattr(first, "where", ""), kept_loads(curve.displacement, curve.load),
    )


def kept_loads(displacement: NDArray[np.float64], load: NDArray[np.float64]) -> list[float]:
    """Loads [kN] at every :data:`EVERY` up to the end of a curve in m and N, to a newton."""
    at = EVERY * np.arange(int(displacement.max() / EVERY + 1e-6) + 1)
    return [round(1e-3 * float(f), 3) for f in np.interp(at, displacement, load)]


def _followed(specimen: str, blocks: str, to: float, options: Mapping[str, Any]) -> Answer:
    test = registry.load(NAME, specimen, **options)
    curve = pushover(
        test.assembly(), test.loads(), control=("spreader", "z"), to=-to, blocks=blocks, contact_model="grid",
        grid=SPACING, contacts="first",
    )
    u, f = 1e3 * np.abs(curve.displacement), curve.load  # the live load is 1 kN
    peak, nothing = int(f.argmax()), float("nan")
    first = curve.breaks[0].sample - 1 if curve.breaks else peak
    where = " and ".join(curve.breaks[0].joints) if curve.breaks else ""
    end = "" if u[-1] > 0.999e3 * to else f"to {u[-1]:.2f} mm, where it {curve.status}"
    return Answer(
        float(f[peak]), float(u[peak]), float(f[first]), float(u[first]), nothing, nothing, float(u[1] / f[1]), 0.0,
        end, "", 1e3 * SPACING, where,
    )


def _superposed(specimens: Sequence[str], blocks: str, spacing: float, options: Mapping[str, Any]) -> Onsets:
    stress = options.get("stress")
    given = {k: v for k, v in options.items() if k != "stress"}
    tests = [registry.load(NAME, s, **given) for s in specimens]
    wall = tests[0].assembly()
    found = elastic_range(wall, tests[0].loads(), blocks=blocks, stress=stress, contact_model="grid", grid=spacing)
    ends = [found.with_strengths(t.assembly()) for t in tests]
    opening, slip = [e.end(1, "opening") for e in ends], [e.end(1, "slip") for e in ends]
    last, plate = opening[-1], wall.block_index("spreader")
    assert last is not None
    return Onsets(
        [float("inf") if o is None else o.multiplier for o in opening],
        [float("inf") if o is None else o.multiplier for o in slip], last.joint,
        -1e3 * float(found.shift_dead[plate, 2]), -1e3 * float(found.shift_live[plate, 2]),
    )
