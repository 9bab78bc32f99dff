"""The panel whose every joint is the mean one: what law, outline, stiffness, damping and speed do to its peak."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import dem
from limitmason import study
from limitmason.model.assembly import Assembly

from .runs import MEAN, PANEL, pushed

REPEATS = 3
"""Runs of every case, friction angles apart by parts in a million: a single peak is not sharp."""


@dataclass(frozen=True)
class Case:
    """One departure from the mean set.

    Parameters
    ----------
    group, name : what is changed, and how
    options : of the panel
    joint : further fields of its joints
    push : keywords of :func:`.runs.pushed`
    """

    group: str
    name: str
    options: dict[str, Any]
    joint: dict[str, Any]
    push: dict[str, Any]


def _case(group: str, name: str, joint: dict[str, Any] | None = None, push: dict[str, Any] | None = None,
          **options: Any) -> Case:
    return Case(group, name, options, joint or {}, push or {})


C, KN = MEAN["cohesion"], MEAN["normal_stiffness"]
CASES = (
    _case("mean set", "as drawn from"),
    _case("speed", "a third", push={"speed": 1 / 3}),
    _case("speed", "a ninth", push={"speed": 1 / 9}),
    _case("damping", "local 0.8, a third of the speed", push={"damping": dem.Damping(0.8), "speed": 1 / 3}),
    _case("damping", "combined 0.5, a third of the speed",
          push={"damping": dem.Damping(0.5, combined=True), "speed": 1 / 3}),
    _case("damping", "combined 0.8, a third of the speed",
          push={"damping": dem.Damping(0.8, combined=True), "speed": 1 / 3}),
    _case("law of loss", "opening or slip takes all", loss="opening or slip"),
    _case("law of loss", "opening takes tension and a half of cohesion", joint={"residual_cohesion": 0.5 * C}),
    _case("law of loss", "opening takes tension, cohesion stays", joint={"residual_cohesion": C}),
    _case("law of loss", "nothing is lost", loss="nothing"),
    _case("outline", "675/8/5", outline="675/8/5"),
    _case("outline", "1350/4/3", outline="1350/4/3"),
    _case("outline", "675/8/5, cohesion stays", joint={"residual_cohesion": C}, outline="675/8/5"),
    _case("bond", "bottom course starts with a half brick", start="half"),
    _case("ks / kn", "0.2", ks=0.2 * KN),
    _case("ks / kn", "0.437, ks as Table 2 prints it", ks=5.9e9),
    _case("ks / kn", "1", ks=KN),
    _case("bricks", "E = 70 GPa", young_modulus=70e9),
    _case("bricks", "strain and bend (simply deformable)", push={"blocks": "simply deformable"}),
)


def wall_of(case: Case, nudge: int = 0) -> Assembly:
    """The panel of a case, its friction angles larger by some parts in a million."""
    wall: Assembly = PANEL.with_options(**case.options).assembly()
    tiny = 1.0 + 1e-6 * nudge
    return wall.with_joints(lambda j: replace(j, friction_angle_deg=tiny * j.friction_angle_deg, **case.joint))


def one(number: int, nudge: int) -> dict[str, Any]:
    """Peak and the rest of one run of a case."""
    case = CASES[number]
    curve = pushed(wall_of(case, nudge), **case.push)
    crack, top = curve.first_crack(0.15e-3), curve.peak
    return {
        "ultimate": top.load, "at": top.displacement, "crack": float("nan") if crack is None else crack.load,
        "stiffness": curve.stiffness(), "kinetic": float(curve.errors["kinetic"][: top.index + 1].max()),
        "mode": curve.mode_at(top.index).name, "residual": curve.residual,
    }


def compute(store: Path, progress: Callable[[str], object] | None = None, workers: int = 1) -> study.Table:
    """All cases, kept in a file."""
    key = study.fingerprint([(repr(c), n) for c in CASES for n in range(REPEATS)])
    points = [{"number": k, "nudge": n} for n in range(REPEATS) for k in range(len(CASES))]
    return study.sweep(one, points, store=store / "mean-set.jsonl", key=key, progress=progress, workers=workers)
