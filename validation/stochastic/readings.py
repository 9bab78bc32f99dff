"""What a joint is when it is drawn, and what failed joints keep: two readings that the source leaves open.

Cells of sets 3 and 4: one draw a joint, two, or one for all, and four shares of the cohesion kept. Every joint is in
two halves in all cells, so that the contact points are the same. Own weight comes on evenly and on sound joints, runs
end at 1.5 mm, and the first contacts are kept. All cells of a set have the same random numbers.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import dem
import limitmason as lm
from limitmason import study
from limitmason.arrays import Array
from limitmason.experiments.brick_panels_opening.layout import UNIT
from limitmason.model.assembly import Assembly
from limitmason.model.interface import Interface

from .runs import BRAKE, FALLEN, PANEL, STEPS, TRAVEL, draws

AGAIN = ", again"
KEPT = (0.0, 0.1, 0.25, 0.5)
"""Shares of the cohesion that failed joints keep."""
SHARING = ("two draws a joint", "one draw a joint", "one draw for all")
PLAN = ((4, 10, ""), (4, 20, ""), (4, 40, ""), (3, 20, ""), (4, 10, AGAIN), (3, 10, AGAIN), (4, 60, ""), (3, 40, ""),
        (4, 80, ""), (4, 120, ""), (3, 80, ""), (3, 120, ""))
"""Set, runs a cell, and whether they are the nudged ones, in the order in which they are worth most."""
MOVED = 0.05e-3
"""Opening or slip from which a place counts as moved [m]."""
NUDGE = 1e-6
SEED = 1


def halved(wall: Assembly) -> Assembly:
    """The wall with every joint in two halves along its length, each a joint of its own."""

    def parts(joint: Interface) -> list[Interface]:
        p = joint.polygon
        edges = np.roll(p, -1, axis=0) - p
        flat = int(np.argmin(np.abs(edges[:2, 1]) - np.linalg.norm(edges[:2, [0, 2]], axis=1)))
        p = np.roll(p, -flat, axis=0)  # the first edge lies in the plane of the wall
        a, b, c, d = p
        middle, back = 0.5 * (a + b), 0.5 * (c + d)
        return [replace(joint, polygon=np.array(q)) for q in ((a, middle, back, d), (middle, b, c, back))]

    return wall.with_interfaces([half for joint in wall.interfaces for half in parts(joint)])


def groups(wall: Assembly) -> dict[str, Array]:
    """Joints of the places that the source speaks of."""
    x, z = wall.arrays.centre[:, 0], wall.arrays.centre[:, 2]
    level = np.abs(wall.arrays.normal[:, 2]) > np.sqrt(0.5)
    upright = np.array([b.name.startswith("soldier") for b in wall.blocks])
    first, other = upright[wall.arrays.block_a], upright[wall.arrays.block_b]
    soldiers = np.flatnonzero(upright)
    top = wall.centroids[soldiers, 2].max() + 0.5 * UNIT[0] - 1e-6
    ends = wall.centroids[soldiers, 0].min() - 0.04, wall.centroids[soldiers, 0].max() + 0.04
    above, over_piers = z > top, (x < ends[0]) | (x > ends[1])
    return {
        "between soldiers": first & other, "soldier at pier": (first != other) & ~level,
        "heads above": above & ~level, "beds above": above & level & ~over_piers,
        "beds over piers": above & level & over_piers, "beds of piers": ~above & level,
    }


def told(curve: dem.PushCurve) -> dict[str, Any]:
    """What is kept of a run: peak, curve, the load at which each place first moves, and how it shares in the peak.

    A place has moved when one of its joints has opened or slid by :data:`MOVED` since own weight.
    """
    moved = np.nan_to_num(np.maximum(curve.opening - curve.opening[0], 0.0))
    moved = moved + np.nan_to_num(np.maximum(curve.slip - curve.slip[0], 0.0))
    top, wall = curve.peak, curve.assembly
    volume = moved[top.index] * wall.arrays.area
    left = wall.arrays.centre[:, 0] < 0.5 * (wall.centroids[1:, 0].min() + wall.centroids[1:, 0].max())
    total = max(float(volume.sum()), 1e-300)
    out = {"ultimate": top.load, "at": top.displacement, "left": float(volume[left].sum()) / total}
    for name, which in groups(wall).items():
        over = np.flatnonzero(moved[:, which].max(axis=1) >= MOVED)
        out[f"{name}: first"] = float(curve.load[over[0]]) if len(over) else None
        out[f"{name}: first at"] = float(curve.displacement[over[0]]) if len(over) else None
        out[f"{name}: part"] = float(volume[which].sum()) / total
    every = slice(None, None, 3)
    out["curve"] = [[round(v, 8) for v in curve.displacement[every].tolist()],
                    [round(v, 1) for v in curve.load[every].tolist()]]
    return out


def push(assembly: Assembly, loads: Any, kept: float = 0.0, nudge: float = 0.0) -> dict[str, Any]:
    """Largest load of one panel up to 1.5 mm; a nudge of the strengths tells the noise of a run."""
    del loads
    tiny = 1.0 + nudge
    wall = assembly.with_joints(lambda j: replace(
        j, cohesion=tiny * j.cohesion, tensile_strength=tiny * j.tensile_strength,
        residual_cohesion=kept * tiny * j.cohesion,
    ))
    try:
        curve = dem.push(
            wall, PANEL.drive(), to=TRAVEL, blocks="lumped", steps=STEPS, rate_check=False, samples=100, damping=BRAKE,
            sound=True, settle=dem.Settle(tolerance=1e-5, stop_when_moved=FALLEN, gently=2000), detect_every=None,
        )
    except dem.UnsettledError as refused:
        moved = refused.history.shift
        if np.linalg.norm(moved[-1] - moved[0], axis=1).max() < 0.5 * FALLEN:
            raise
        return {"ultimate": 0.0, "at": 0.0}
    return told(curve)


def with_one_law_a_joint(assembly: Assembly, loads: Any, **how: float) -> dict[str, Any]:
    """The same with both halves of a joint as the first one was drawn."""
    joints = assembly.interfaces
    pairs = zip(joints[::2], joints[1::2], strict=True)
    same = [half for first, other in pairs for half in (first, replace(other, joint=first.joint))]
    return push(assembly.with_interfaces(same), loads, **how)


def name_of(number: int, shared: str, kept: float) -> str:
    """Of a cell, and of its file."""
    return f"set{number}-{shared.replace(' ', '-')}-keeps-{kept:g}"


def compute(store: Path, progress: Callable[[str], object] | None = None) -> None:
    """Make what is missing of all cells, round by round: a study that is cut off has cells of one size."""
    wall = (halved(PANEL.assembly()), lm.Loads.weight)
    for number, samples, again in PLAN:
        for kept in KEPT:
            for shared in SHARING:
                name = name_of(number, shared, kept)
                if progress is not None:
                    progress(f"{name}{again}: {samples}")
                run = partial(with_one_law_a_joint if shared == SHARING[1] else push, kept=kept,
                              nudge=NUDGE if again else 0.0)
                study.monte_carlo(
                    wall, samples, run=run, seed=SEED, scheme="random", store=store / f"{name}{again}.jsonl",
                    **draws(number, shared != SHARING[2]),
                )
