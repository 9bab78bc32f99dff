"""How the panels' peaks depend on how their bricks deform, over perturbed starts and beside the path without rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from limitmason.deformable.levels import LUMPED, RITZ, SIMPLY_DEFORMABLE, ZONED
from limitmason.display.text_table import markdown
from limitmason.experiments.source_folder import read_table

from .runs import (
    GIVEN_UP,
    NAME,
    NUDGE,
    SPACING,
    STEPS,
    TRAVEL,
    WAITED,
    Answer,
    Runs,
)

SLOWER = 3 * STEPS
"""Steps of a run that is as slow as the slower of the two of a push."""

BENDING: dict[str, Any] = {"once": True, "steps": SLOWER, "blocks": SIMPLY_DEFORMABLE, "seed": 1}
"""One run of bricks that strain and bend."""

STARTS = (1, 2, 3)
"""Perturbed starts of the runs that have several."""

CLOSELY = ("udec-09", "udec-10", "udec-14")
"""Runs that have several, and rate-free paths."""

ZONED_STEPS = 130_000
"""Of the faster run of zoned bricks; the slower takes three times as many, as that of simply deformable ones does."""

TARGET, TARGET_WORST, STEADY = 0.05, 0.12, 0.02
"""Agreement this package aims at in the median and in the worst run, where both rate errors are below the third [-]."""

GRADUAL = 1e-4
"""Opening over which joints lose their strength, where they lose it gradually [m]."""

DUCTILE_TO, DUCTILE_STEPS = 0.5e-3, 50_000
"""Displacement [m] at which loads are compared where joints lose nothing, and steps of zoned bricks up to it."""

FORKED, BEDS = ("udec-05", "udec-10", "udec-14"), (8, 9)
"""Runs in which two cracks compete, and the courses above which they run."""


def section(runs: Runs) -> list[str]:
    """Part of the page."""
    return [
        "## Bricks that deform: three levels", "",
        "Lumped: rigid bricks, their compliance in the joints. Simply deformable: bricks that strain and bend. Zoned: "
        f"bricks of {1e3 * SPACING:.4g} mm zones. The same contact points. Perturbed starts: every brick moved by up "
        f"to {NUDGE:g} m. Rate-free: `lm.pushover` on the same points with the same law.", "",
        *_stiffness(runs), *_grid(runs), *_starts(runs), *_zones(runs),
    ]


def _slow(runs: Runs, name: str, blocks: str, seed: int) -> Answer:
    return runs(name, once=True, steps=SLOWER, blocks=blocks, seed=seed)


def _stiffness(runs: Runs) -> list[str]:
    strong: dict[str, Any] = {"cohesion": 1e7, "tensile_strength": 1e7}
    free = [runs.rate_free("udec-09", blocks=b, to=5e-5, **strong).stiffness for b in (LUMPED, SIMPLY_DEFORMABLE, RITZ)]
    zoned = runs("udec-09", once=True, to=5e-5, steps=12_000, blocks=ZONED, **strong).stiffness
    return [
        f"- Compliance under the plate with joints that do not fail, without rate: lumped {free[0]:.5f}, simply "
        "deformable "
        f"{free[1]:.5f}, elastic bricks condensed to their joints {free[2]:.5f} mm/kN. Zoned bricks, driven, have "
        f"{zoned:.5f}: "
        f"simply deformable {free[1] / zoned - 1.0:+.1%} of zoned (target 3%).", "",
    ]


def _grid(runs: Runs) -> list[str]:
    names = [r["specimen"] for r in read_table(NAME, "udec_runs.csv").rows]
    lumped, simple = [runs(n) for n in names], [runs(n, **BENDING) for n in names]
    ratio = np.array([m.peak / f.peak for m, f in zip(simple, lumped, strict=True)])
    body = [["run", "lumped [kN]", "at [mm]", "simply deformable [kN]", "at [mm]", "simply deformable/lumped"]]
    body += [
        [n[-2:], f"{f.peak:.2f}", f"{f.at_peak:.2f}", f"{m.peak:.2f}", f"{m.at_peak:.2f}", f"{q:.2f}"]
        for n, f, m, q in zip(names, lumped, simple, ratio, strict=True)
    ]
    return [
        f"Peaks up to {1e3 * TRAVEL:.1f} mm, {SLOWER} steps, one start each: simply deformable over lumped, median "
        f"{np.median(ratio):.2f}, from {ratio.min():.2f} to {ratio.max():.2f}.", "", *markdown(body), "",
    ]


def _starts(runs: Runs) -> list[str]:
    body = [["run", "blocks", f"median of {len(STARTS)} [kN]", "least", "largest", "rate-free [kN]"]]
    off = []
    for name in CLOSELY:
        for blocks in (LUMPED, SIMPLY_DEFORMABLE):
            found = [_slow(runs, name, blocks, s) for s in STARTS]
            free = runs.rate_free(name, blocks=blocks)
            body.append([name[-2:], blocks, *_spread(found), f"{free.peak:.2f}" + (free.mode and f" ({free.mode})")])
            if not free.mode:
                off.append(abs(float(np.median([a.peak for a in found])) / free.peak - 1.0))
    return [
        "Perturbed starts, driven, beside the path without rate:", "", *markdown(body), "",
        f"Paths without rate that went on to {1e3 * TRAVEL:.1f} mm lie within {max(off, default=0.0):.0%} of the "
        "medians of driven starts.", "",
    ]


class _Pair(NamedTuple):
    """A run by zoned and by simply deformable bricks, at the slower of two speeds, and the rate errors of both [-]."""

    name: str
    zoned: Answer
    simple: Answer
    zoned_rate: float
    simple_rate: float

    @property
    def ratio(self) -> float:
        """Simply deformable over zoned peak [-]."""
        return self.simple.peak / self.zoned.peak

    @property
    def before(self) -> float:
        """Simply deformable over zoned, largest loads up to the displacement of the first of the two peaks [-]."""
        at = min(self.zoned.at_peak, self.simple.at_peak)
        return self.simple.largest_until(at) / self.zoned.largest_until(at)

    @property
    def steady(self) -> bool:
        """Whether both rate errors are small."""
        return max(self.zoned_rate, self.simple_rate) < STEADY


def _pair(runs: Runs, name: str, **more: Any) -> _Pair:
    faster, slower = [
        [runs(name, once=True, steps=k * n, blocks=b, seed=1, **more) for b, n in _PACE.items()] for k in (1, 3)
    ]
    zoned_rate, simple_rate = (abs(f.peak / s.peak - 1.0) for f, s in zip(faster, slower, strict=True))
    return _Pair(name, slower[0], slower[1], zoned_rate, simple_rate)


_PACE = {ZONED: ZONED_STEPS, SIMPLY_DEFORMABLE: SLOWER}


def _zones(runs: Runs) -> list[str]:
    names = [r["specimen"] for r in read_table(NAME, "udec_runs.csv").rows]
    pairs = [_pair(runs, name) for name in names]
    body = [[
        "run", "zoned [kN]", "at [mm]", "rate", "simply deformable [kN]", "at [mm]", "rate", "simply deformable/zoned",
        "to the first peak",
    ]]
    body += [
        [
            p.name[-2:], f"{p.zoned.peak:.2f}", f"{p.zoned.at_peak:.2f}", f"{p.zoned_rate:.1%}", f"{p.simple.peak:.2f}",
            f"{p.simple.at_peak:.2f}", f"{p.simple_rate:.1%}", f"{p.ratio:.2f}", f"{p.before:.2f}",
        ]
        for p in pairs
    ]
    steady = [p for p in pairs if p.steady]
    before = np.abs(np.array([p.before for p in pairs]) - 1.0)
    return [
        "### Simply deformable beside zoned bricks", "",
        f"Peaks up to {1e3 * TRAVEL:.1f} mm, the same contact points and law, one perturbed start, two speeds. Zoned "
        f"bricks take {ZONED_STEPS} and {3 * ZONED_STEPS} steps, simply deformable ones {SLOWER} and {3 * SLOWER}. The "
        "slower "
        f"run's load stands here, *rate* is what the faster one's differs by. A zoned run ends where less than "
        f"{GIVEN_UP:.0%} of its largest load is left over {1e3 * WAITED:.1f} mm.", "",
        *markdown(body), "",
        f"- Target where both rates are below {STEADY:.0%}: median within {TARGET:.0%}, worst within "
        f"{TARGET_WORST:.0%}. " + _agreement("There", steady) + " " + _agreement("Of all", pairs)
        + " Slower runs than these were not made.",
        f"- Up to the displacement of the first of the two peaks both still stand. There the largest loads of "
        f"{len(pairs)} runs differ by {np.median(before):.1%} in the median and {before.max():.1%} at most (last "
        "column).",
        *_laws(runs, names), *_fork(runs), "",
        *_over_starts(runs, [p.name for p in pairs if abs(p.ratio - 1.0) > TARGET]),
    ]


def _agreement(where: str, pairs: Sequence[_Pair]) -> str:
    """How simply deformable peaks lie beside zoned ones, in a sentence."""
    if not pairs:
        return f"{where}: none."
    ratio = np.array([p.ratio for p in pairs])
    off = np.abs(ratio - 1.0)
    out = [p.name[-2:] for p, o in zip(pairs, off, strict=True) if o > TARGET_WORST]
    return (
        f"{where}, {len(pairs)} runs: simply deformable over zoned median {np.median(ratio):.2f}, from "
        f"{ratio.min():.2f} to {ratio.max():.2f}. The median difference is {np.median(off):.1%}, the worst "
        f"{off.max():.1%}; {int((off <= TARGET).sum())} lie within {TARGET:.0%}, "
        + (f"beyond {TARGET_WORST:.0%}: {', '.join(out)}." if out else "none beyond.")
    )


def _laws(runs: Runs, names: Sequence[str]) -> list[str]:
    ductile: dict[str, Any] = {"once": True, "to": DUCTILE_TO, "seed": 1, "loss": "nothing"}
    table = read_table(NAME, "udec_runs.csv")
    lines = []
    for gradual, words, zoned_steps in (
        (False, f"- Joints that lose nothing, loads at {1e3 * DUCTILE_TO:.1f} mm", DUCTILE_STEPS),
        (True, f"- Strength lost over an opening of {1e3 * GRADUAL:.1f} mm (GfI 2.5 to 7.5 J/m2), peaks", ZONED_STEPS),
    ):
        peaks = []
        for n in names:
            given = ductile
            if gradual:
                energy = round(0.5e6 * float(table.row(n)["tension"]) * GRADUAL, 6)
                given = {"once": True, "seed": 1, "fracture_energy": energy}
            peaks.append([
                runs(n, steps=k, blocks=b, **given).peak for b, k in ((SIMPLY_DEFORMABLE, SLOWER), (ZONED, zoned_steps))
            ])
        ratio = np.divide(*np.array(peaks).T)
        off = np.abs(ratio - 1.0)
        lines.append(
            f"{words}, {len(names)} runs at one speed. Simply deformable over zoned goes from {ratio.min():.3f} to "
            f"{ratio.max():.3f}, median difference {np.median(off):.1%}, worst {off.max():.1%}."
        )
        if not gradual:
            worst = names[int(off.argmax())]
            kinds = (SIMPLY_DEFORMABLE, RITZ)
            free = [runs.rate_free(worst, blocks=b, to=DUCTILE_TO, loss="nothing").peak for b in kinds]
            speeds = ((SIMPLY_DEFORMABLE, SLOWER), (ZONED, DUCTILE_STEPS))
            driven = [runs(worst, steps=n, blocks=b, **ductile).peak for b, n in speeds]
            lines.append(
                f"- The shapes that bricks have decide. In run {worst[-2:]} of these simply deformable bricks carry "
                f"{driven[0]:.2f} and without rate {free[0]:.2f} kN. Elastic ones condensed to their joints carry "
                f"without rate {free[1]:.2f}, zoned ones {driven[1]:.2f}."
            )
    return lines


def _fork(runs: Runs) -> list[str]:
    """Runs in which two cracks compete, with each of these made to open first."""
    found = []
    for name in FORKED:
        loads = [
            [
                runs(name, once=True, steps=n, blocks=b, seed=1, crack=course, to=DUCTILE_TO).peak
                for b, n in ((ZONED, DUCTILE_STEPS), (SIMPLY_DEFORMABLE, SLOWER))
            ]
            for course in BEDS
        ]
        words = ", ".join(f"above {c} {z:.2f} and {m:.2f}" for c, (z, m) in zip(BEDS, loads, strict=True))
        found.append(f"  - run {name[-2:]}: {words}")
    return [
        f"- Where single brittle runs part, two cracks compete. The bed joints above courses {BEDS[0]} and {BEDS[1]} "
        "come to their "
        "strength together at the ends of the panel. They do so within a hundredth of it. The one that breaks first "
        "unloads the "
        "other, and the crack along it decides what the panel carries from there on. Speed, rounding or the shapes of "
        "the bricks may decide: in run 14 zoned bricks go either way at two speeds. The list below makes one of the "
        "two open first, by ends without strength. It has largest loads up to "
        f"{1e3 * DUCTILE_TO:.1f} mm, zoned and simply deformable [kN].",
        *found,
        "- What own weight breaks does not decide it. Run 10 keeps its peak within 2 % at each level when it starts "
        "from the points that the other had broken.",
    ]


def _over_starts(runs: Runs, names: Sequence[str]) -> list[str]:
    """Runs whose one start differs, over several."""
    if not names:
        return []
    body = [["run", "zoned, median [kN]", "least", "largest", "simply deformable, median [kN]", "least", "largest",
             "simply deformable/zoned"]]
    apart = []
    for name in names:
        zoned, simple = (
            [runs(name, once=True, steps=n, blocks=b, seed=s) for s in STARTS] for b, n in _PACE.items()
        )
        low, high = sorted([[a.peak for a in found] for found in (zoned, simple)], key=max)
        if max(low) < min(high) and name not in FORKED:
            apart.append(name[-2:])
        medians = [float(np.median([a.peak for a in found])) for found in (zoned, simple)]
        body.append([name[-2:], *_spread(zoned), *_spread(simple), f"{medians[1] / medians[0]:.2f}"])
    unmet = [
        f"Ranges of starts that do not meet, without a fork shown above: {', '.join(apart)}. Which joints part them is "
        "not traced.", "",
    ]
    return [
        f"Runs beyond {TARGET:.0%} over {len(STARTS)} perturbed starts, at the faster speed:", "", *markdown(body), "",
        *(unmet if apart else []),
    ]


def _spread(found: Sequence[Answer]) -> list[str]:
    peaks = [a.peak for a in found]
    return [f"{np.median(peaks):.2f}", f"{min(peaks):.2f}", f"{max(peaks):.2f}"]
