"""Strength of the Murano walls' joints from their peaks, c = 1.25 ft: the second stage of the source's fit."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import dem
import limitmason as lm
from limitmason.experiments import murano_u_walls as murano
from limitmason.model.assembly import Assembly
from validation import murano_literature as literature

NAME = "murano-u-walls"
TO = {"DS": (2.4, 10.0), "REGW": (25.0, 90.0)}
"""Airbag at the end of a faster and of a slower ramp [kN]."""
STEPS, POINTS = 12_000, (3, 3)
EVALUATIONS = 5
"""Of a search: a driven wall's peak jumps by 1 %, within which a search for more goes on for nothing."""

WITHIN = 2e-3
"""The peak is the largest load before the facade has moved so far [m]."""
SCATTER = {"DS": 0.10, "REGW": 0.05}
"""Of the peak, about half the difference of the two values that the source prints of each."""


DRY = "DS"


@dataclass(frozen=True)
class Case:
    """A fit by driven runs of the DEM: wall, unknown, how the joints behave."""

    wall: str
    unknown: lm.Parameter
    options: dict[str, str]

    @property
    def most(self) -> int:
        """Evaluations of a search; a strength that may be zero starts there, where every measured peak sends it."""
        return EVALUATIONS if self.unknown.log else 2

    @property
    def name(self) -> str:
        """Words of the table."""
        how = [f"{k} {v}" for k, v in self.options.items()]
        return ", ".join(["DEM", *how])


def _strength(masonry: str) -> lm.Parameter:
    known = literature.summary(masonry)["tensile strength"]
    return lm.Parameter("tensile_strength", known.median, (1e4, 1e6), resolution=0.05, unit="Pa")


def cases() -> tuple[Case, ...]:
    """Mortared wall by what failed mortar keeps and what the ground does."""
    mortar = [
        {"residual": "none", "ground": "bonded"}, {"residual": "cohesion", "ground": "bonded"},
        {"residual": "none", "ground": "joint"}, {"residual": "cohesion", "ground": "joint"},
    ]
    return tuple(Case("REGW", _strength("mortar"), o) for o in mortar)


def dry_cases() -> tuple[Case, ...]:
    """Dry wall: strength that its stones' interlock may have, lost or kept after failure, at the printed friction.

    From the median of the literature, none.
    """
    known = literature.summary("dry")
    strength = lm.Parameter(
        "tensile_strength", known["tensile strength"].median, (0.0, 2e3), log=False, resolution=100.0, unit="Pa"
    )
    return (
        Case(DRY, strength, {"residual": "none"}), Case(DRY, strength, {"residual": "cohesion"}),
    )


def pushed(specimen: str, wall: Assembly) -> dict[str, float]:
    """Largest force of the airbag before the facade has moved by 2 mm [N]."""
    test = lm.experiments.load(NAME, specimen)
    top = murano.control_block(test)
    settled = dem.simulate(wall, dem.Settle(tolerance=1e-4), loads=test.loads(), contact_points=POINTS)
    first, last = TO[specimen]
    ramps = [dem.Ramp(to=first, steps=STEPS // 4), dem.Ramp(to=last, steps=STEPS, stop_when_moved=0.02)]
    history = dem.simulate(wall, ramps, loads=test.loads(), start=settled, sample=STEPS // 200)
    u = settled.displacement_of(top)[-1, 1] - history.displacement_of(top)[:, 1]
    force = history.reaction[..., 1].sum(axis=1)
    return {"peak": float(force[u <= WITHIN].max())}


def model(case: Case) -> lm.calibration.JointModel:
    """The wall with its mortar, or its friction, unknown."""
    test = lm.experiments.load(NAME, case.wall, **({} if case.wall == DRY else case.options))
    wall = test.assembly()
    if case.wall == DRY and case.options:
        # the experiment's dry joints have no strength to lose
        lost = {"residual_cohesion": 0.0, "residual_tensile_strength": 0.0}
        wall = wall.with_interfaces([
            i if i.kind == "base" else replace(i, joint=replace(i.joint, **lost)) for i in wall.interfaces
        ])
    kinds = ["bed", "head"] + ["base"] * (case.options.get("ground") == "joint")
    return lm.calibration.JointModel(
        wall, _Pushed(case.wall), of={n: (n, kinds) for n in (case.unknown.name, *ties(case))}
    )


def ties(case: Case) -> dict[str, str]:
    """What follows from the unknown."""
    out = {"cohesion": literature.TIES["cohesion"]}
    return {**out, "residual_cohesion": "cohesion"} if case.options.get("residual") == "cohesion" else out


@dataclass(frozen=True)
class _Pushed:
    specimen: str

    def __call__(self, wall: Assembly) -> dict[str, float]:
        return pushed(self.specimen, wall)


def plastic(specimen: str) -> float:
    """Limit load of a wall with the printed joints, psi = phi and nothing lost [N]."""
    test = lm.experiments.load(NAME, specimen)
    return 1e3 * float(lm.predict(test.assembly(), test.loads(), "associative").collapse_multiplier)


def _peaks(wall: str) -> dict[str, dict[str, lm.Target]]:
    """Both values that the source prints of a wall's peak [N]."""
    test = lm.experiments.load(NAME, wall)
    return {
        f"section {k}": {"peak": lm.Target(1e3 * float(test.measured[f"peak (section {k})"]), SCATTER[wall], unit="N")}
        for k in (2, 6)
    }


def fitted(case: Case, store: Path, progress: Callable[[str], object] | None = None) -> Any:
    """Fit of one case to both values that the source prints of its peak."""
    words = case.name if case.wall != DRY else f"{case.name} {case.unknown.name}"
    key = f"{NAME} {case.wall} {words} {STEPS} {POINTS}"
    return lm.calibrate(
        model(case), _peaks(case.wall), [case.unknown], ties=ties(case), leave_out=None,
        level=0.95 if case.wall == DRY else None, search=lm.calibration.SearchSettings(starts=1, most=case.most),
        store=store / f"murano-{case.wall}-{words.replace(' ', '-').replace(',', '')}.jsonl", key=key,
        progress=progress,
    )
