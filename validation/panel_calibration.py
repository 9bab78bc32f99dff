"""The joints of the brick panels from the tests on them: elastic joints and driven runs of the DEM as the model.

S1 to S4 share one geometry and tell two loads each. The first crack is that of elastic joints, in one linear solution:
a driven run would need to be slow to show it. The peak is that of a driven run. Every run is kept in a folder and
never made twice; a killed fit goes on with it. See :mod:`validation.calibration_page` for the page.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import dem
import limitmason as lm
from dem.driving.block_structure import default_spacing
from limitmason import study
from limitmason.calibration.profile import end as profile_end
from limitmason.errors import NotConverged
from limitmason.experiments import brick_panels_opening as panels
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.plane import find_plane
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads

NAME = "brick-panels-opening"
OUTLINES = ("787.5/8/4", "675/8/5", "1350/4/3")
L1_OUTLINES = ("787.5/8/4", "562.5/8/4")
TRAVEL, STEPS = 1.3e-3, 6000
STEPS_OF_A_SEARCH = 8
"""Of the fit: a peak that jumps by 1 to 2 % has no sharper minimum."""
UNKNOWN = (
    lm.Parameter("normal_stiffness", 83e9, (5e9, 5e11), unit="Pa/m"),
    lm.Parameter("shear_stiffness", 36e9, (2e9, 2e11), unit="Pa/m"),
    lm.Parameter("friction_angle_deg", 30.0, (20.0, 45.0), resolution=0.05, unit="deg"),
    lm.Parameter("cohesion", 1e5, (1e4, 5e5), resolution=0.05, unit="Pa"),
    lm.Parameter("tensile_strength", 1e5, (4e4, 4e5), resolution=0.05, unit="Pa"),
    lm.Parameter("dilatancy_angle_deg", 5.0, (0.5, 20.0), unit="deg"),
)
PAPER = {p.name: getattr(panels.joint(lm.experiments.load(NAME, "S1")), p.name) for p in UNKNOWN}


def elastic(wall: Assembly) -> tuple[float, float]:
    """Load at which a point of a joint first reaches its tensile strength [N], and stiffness at the spreader [N/m].

    Own weight and a point load on joints that stick: n0 + P n1, compression positive, at the contact points of the
    driven runs; P = min (n0 + ft) / -n1 over those that the load pulls. What slips before has not cracked.

    Raises
    ------
    NotConverged
        Where own weight alone reaches the tensile strength of a joint.
    """
    panel = with_lumped_units(wall)
    loads = Loads.weight(panel).with_point_load(panel, "spreader", (0.0, 0.0, -1.0))
    points = contact_points(
        panel, contact_model="grid", grid=default_spacing(panel), plane=find_plane(panel, loads), elastic=True
    )
    arm = [points.position - panel.centroids[b] for b in (points.block_a, points.block_b)]
    m, free = points.count, ~panel.fixed
    # displacement of b beyond a along every direction, of (ux, uz, ry) of all blocks
    jump = np.zeros((m, points.components, 3 * panel.n_blocks))
    for block, lever, sign in ((points.block_a, arm[0], -1.0), (points.block_b, arm[1], 1.0)):
        d = points.directions
        turn = np.einsum("mki,mi->mk", d, np.cross(np.array([0.0, 1.0, 0.0]), lever))
        for k, part in enumerate((d[:, :, 0], d[:, :, 2], turn)):
            jump[np.arange(m), :, 3 * block + k] += sign * part
    x = panel.arrays
    spring = np.stack([x.normal_stiffness, x.shear_stiffness], axis=1)[points.interface] * points.area[:, None]
    rows = jump[:, :, np.repeat(free, 3)].reshape(m * points.components, -1)
    stiffness = rows.T @ (spring.reshape(-1, 1) * rows)
    given = np.stack([w[free][:, [0, 2, 4]].ravel() for w in (loads.dead, loads.live)], axis=1)
    moved = np.linalg.solve(stiffness, given)
    stress = -(spring.reshape(-1, 1) * (rows @ moved)).reshape(m, points.components, 2) / points.area[:, None, None]
    normal, strength = stress[:, 0], x.tensile_strength[points.interface]
    if (-normal[:, 0] >= strength).any():
        raise NotConverged(
            "own weight alone reaches the tensile strength of a joint: there is no load at the first crack"
        )
    pulled = normal[:, 1] < 0.0
    reached = (normal[pulled, 0] + strength[pulled]) / -normal[pulled, 1]
    spreader = int(np.flatnonzero(free).searchsorted([b.name for b in panel.blocks].index("spreader")))
    return float(reached.min()), float(-1.0 / moved[3 * spreader + 1, 1])


def driven(wall: Assembly) -> dict[str, float]:
    """First joint to fail [N] and stiffness [N/m] of elastic joints, peak of the panel pushed down at mid-span [N]."""
    first, stiffness = elastic(wall)
    return {"first crack": first, "stiffness": stiffness, "peak": peak(wall)}


def peak(wall: Assembly) -> float:
    """Largest load of the driven panel [N]."""
    drive = lm.experiments.load(NAME, "S1").drive()
    curve = dem.push(
        wall, drive, to=TRAVEL, blocks="lumped", steps=STEPS, rate_check=False, damping=dem.Damping(local=0.5)
    )
    return curve.peak.load


def model(specimen: str, outline: str) -> lm.calibration.JointModel:
    """A panel whose joints are unknown."""
    return lm.calibration.JointModel(lm.experiments.load(NAME, specimen, outline=outline).assembly(), driven)


def measured() -> dict[str, dict[str, lm.Target]]:
    """First crack and failure of S1 to S4, scatter as among equal panels; the text of the source has no stiffness."""
    out = {}
    for name in ("S1", "S2", "S3", "S4"):
        test = lm.experiments.load(NAME, name)
        out[name] = {
            "first crack": lm.Target(1e3 * test.measured["first crack"], 0.35, unit="N"),
            "peak": lm.Target(1e3 * test.measured["failure load"], 0.18, unit="N"),
        }
    return out


def fitted(outline: str, store: Path, starts: int, progress: Callable[[str], object] | None = None) -> Any:
    """Fit of S1 to S4 on one outline."""
    return lm.calibrate(
        model("S1", outline), measured(), UNKNOWN, leave_out=None, level=None,
        search=lm.calibration.SearchSettings(starts=starts, most=STEPS_OF_A_SEARCH),
        store=store / f"panel-{outline.replace('/', '-')}.jsonl", key=f"{NAME} {outline} {TRAVEL} {STEPS} elastic",
        progress=progress,
    )


def first_crack(wall: Assembly) -> dict[str, float]:
    """First crack alone [N]."""
    return {"first crack": elastic(wall)[0]}


def ends(fit: Any, outline: str) -> dict[str, tuple[float, float]]:
    """Profile interval of every parameter, minus or plus infinity where a panel at the bound meets the tests as well.

    All by direct runs, kept with those of the fit. The tensile strength has its interval from the first crack alone,
    which knows joint stiffnesses beside it and nothing else; the peak is free to follow by cohesion and friction.
    """
    out, best = {}, fit.minimum
    rise = fit.objective.rise(best, fit.level)
    for axis, p in enumerate(UNKNOWN):
        if p.name != "tensile_strength":
            low, high = (profile_end(fit.objective, best, fit.slopes, axis, sign, rise) for sign in (-1, 1))
            out[p.name] = (low if np.isinf(low) else p.value(low), high if np.isinf(high) else p.value(high))
    (strength,) = (p for p in UNKNOWN if p.name == "tensile_strength")
    low, high = (e if np.isinf(e) else strength.value(e) for e in calibrated_elastic(fit, outline).ends[-1])
    out[strength.name] = (low, high)
    return {p.name: out[p.name] for p in UNKNOWN}


def calibrated_elastic(fit: Any, outline: str) -> Any:
    """Fit of stiffnesses and tensile strength to the first cracks, with intervals; the rest is the fit's."""
    wall = model("S1", outline).with_parameters(**fit.parameters)
    targets = {name: {"first crack": t["first crack"]} for name, t in measured().items()}
    unknown = [p for p in UNKNOWN if p.name in ("normal_stiffness", "shear_stiffness", "tensile_strength")]
    return lm.calibrate(
        lm.calibration.JointModel(wall, first_crack), targets, unknown, leave_out=None,
        search=lm.calibration.SearchSettings(starts=1),
    )


def answers(
    sets: Mapping[str, Mapping[str, float]], store: Path, progress: Callable[[str], object] | None = None
) -> study.Table:
    """What several sets of parameters give on the possible outlines of S1 to S4 and of L1; NaN where there is none."""
    points = [
        {"specimen": specimen, "outline": outline, "set": name, "values": [*values.items()]}
        for name, values in sets.items()
        for specimen, outlines in (("S1", OUTLINES), ("L1", L1_OUTLINES))
        for outline in outlines
    ]
    # by what is run, so that sets which come later do not send the earlier ones back
    return study.Table(tuple(
        row for p in points
        for row in study.sweep(one_answer, [p], store=store / f"answer-{study.fingerprint(p)[:16]}.jsonl",
                               key=study.fingerprint(p, TRAVEL, STEPS), progress=progress)
    ))


def one_answer(specimen: str, outline: str, values: Sequence[tuple[str, float]], **words: str) -> dict[str, Any]:
    """Loads of one set on one outline [N]."""
    del words  # the name of the set, for the table
    given = dict(values)
    panel = model(specimen, outline)
    try:
        return {**panel(**given), "note": ""}
    except NotConverged as refused:
        return {"first crack": float("nan"), "peak": peak(panel.with_parameters(**given)), "note": str(refused)}
