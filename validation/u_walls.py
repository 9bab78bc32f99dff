"""The page of the U walls: stiffness, modes, light damage and peaks of every family beside the source.

    python -m validation.u_walls --out docs/papers [--size 0.15] [--kept FOLDER]

makes ``u-walls.md`` and ``u-walls.png``. Push-overs are written to the folder of ``--kept`` and read back from it: they
take minutes.
"""

import argparse
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import limitmason as lm
import mechanisms
from limitmason import experiments
from limitmason.answers.curve import Curve, Event
from limitmason.capacity import Steps
from limitmason.continuum import SolidCurve, load_curve, push, solve_elastic
from limitmason.continuum.path import INTERRUPTED
from limitmason.display.text_table import filled, markdown
from limitmason.errors import InputError, NotConverged
from limitmason.figures import load_displacement, print_style
from validation import murano_macro as macro
from validation import murano_micro as micro

NAME = "murano-u-walls"
MODELS = (("DS", "step 1", 6e-3), ("DS", "final", 6e-3), ("REGW", "final", 6e-3))
MICRO = (("DS", 1.1e-3), ("REGW", 1.0e-3))  # mean displacement under the airbag at the end [m]
RIGID = ("DS", 6e-4)  # blocks that do not deform, as in 3DEC
MOST = 500  # tries of a step of a micro-model
OVER = (0.05e-3, 0.1e-3, 0.15e-3, 0.2e-3)  # displacements that an initial stiffness may be taken over [m]
PRINTED_PEAKS = {"DS step 1": "slightly above 20", "DS final": "2.5 to 3", "REGW final": "37 (15 % below 43.5)"}
TEXT = """# The U walls of Murano et al., every family beside the paper

Made by `python -m validation.u_walls --size {size}`; source: {source}.
Homogeneous solids of 20-node bricks of at most {size} m, crack band the cube root of a brick's volume; blocks on the
assumed bond.

[assumptions]
- The load on the side walls weighs but does not vibrate; with its mass the frequencies are half.

## Stiffness

[stiffness]

The 3.10 kN/mm printed of DS are no elastic stiffness: about 16 kN/mm follow from the modulus, and the printed
frequencies agree. The dead load alone cracks a wall of 0.9 kPa; what is left is 4.7 kN/mm (bricks of 0.15 m).

On bricks of 0.10 m, the source's size, REGW has 43.98 kN/mm, 5.3 % below the print. Longer side walls (46.21 with
1.09 m) are not the reason, see below. Where the models of DS have the stiffness that is printed of them, as a secant:

[secants]

## Natural frequencies [Hz] and shapes

[modes]

The plan is the source's: frequencies printed of REGW stand in one ratio to those here at 1.00 m alone.

| side walls [m] | mode 1 | mode 2 | mode 3 |
|---|---|---|---|
| 1.00 | 0.964 | 0.963 | 0.964 |
| 0.95 (bricks of 0.30 m) | 0.95 | 0.94 | 0.93 |
| 1.05 (bricks of 0.30 m) | 0.94 | 0.96 | 0.96 |

The common factor says that E over density was 7 % less than in the source's Table 9. Its stiffness asks for 5 % more:
E is then 894 MPa, and one of the three estimates of its Table 8 is 900. DS has no common factor.

The criterion compares with the closed-joint modes of the blocks here, in the source with modes identified in 3DEC.
Shapes of two models are more alike than a model's and an identified one's. Seconds stand beside those of an
iteration, below.

## Push-over

![load against displacement](u-walls.png)

[push-over]

A jump is a step at which no Newton iteration ends: the crack runs on at constant displacement.

[cost]

[chords]

[readings]

## Micro-model

Stones that strain and bend on the DEM's joints, `lm.pushover(blocks="simply deformable")`; load and displacement as
above.

[micro-assumptions]

[micro]

The stiffness is the tangent under dead load. That of DS is no elastic one: of 4878 contact points 1723 are open and
790 slide before the airbag presses, with rigid stones. The printed 4.18 kN/mm is a secant: light damage printed
beside it, 2.05 kN at 0.50 mm, is 4.10 kN/mm. DS then slides on at the load of the test.

The mortar of REGW loses cohesion and tension at once where it fails; this is assumed, the source does not say. Every
break is a jump of the curve. The largest load is that of the test (43.5 or 47.8 kN) and lies above the source's
plateau near 40 kN. There is no plateau: the load falls to half by 2 mm. On a ground joint without tension it has one:
see *Other joints of the blocks*.

Joints that lose nothing carry 124 kN at 4.5 mm and rise on. The first break comes at 22.9 kN, a loss of 2 % at three
times the light damage printed. That print is no loss of stiffness, see above. Seconds are of one processor core; the
source's micro-model took seven days.

The DEM's own push-over of the blocks is `examples/murano_pushover.py`.
"""
SOURCE = "Murano et al., sections 3 to 6, Tables 4 to 10, Figs 14 to 21"


def main() -> None:
    """Make the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/papers"))
    parser.add_argument("--size", type=float, default=0.15, help="largest edge of a brick [m]")
    parser.add_argument("--kept", type=Path, default=None, help="folder of push-overs, read where there")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    curves = {}
    for specimen, properties, to in MODELS:
        label = f"{specimen} {properties}"
        print(f"{label} ...", flush=True)
        curves[label] = pushed(specimen, properties, chosen.size, to, chosen.kept)
    stones = {}
    for specimen, to in MICRO:
        print(f"{specimen} micro ...", flush=True)
        stones[f"{specimen} micro"] = stone_by_stone(specimen, to, chosen.kept)
    print("DS rigid ...", flush=True)
    rigid = stone_by_stone(*RIGID, chosen.kept, blocks="rigid")
    # here, since only the command runs from the root of the source tree
    from validation.u_wall_blocks import curves as of_blocks
    from validation.u_wall_blocks.page import sections

    drawn(curves, stones, of_blocks.curves(chosen.kept)).savefig(chosen.out / "u-walls.png", dpi=160)
    text = page(curves, stones, rigid, chosen.size) + "\n" + sections()
    (chosen.out / "u-walls.md").write_text(text, encoding="utf-8")


def pushed(specimen: str, properties: str, size: float, to: float, kept: Path | None) -> SolidCurve | None:
    """Push-over of a macro-model, from the folder where it is there; None where the run fails."""
    test = experiments.load(NAME, specimen)
    model = macro.macro_model(test, properties, size=size)
    file = None if kept is None else kept / f"{specimen} {properties} {size:g} {to:g}.npz".replace(" ", "_")
    before = load_curve(file, model) if file is not None and file.is_file() else None
    if before is not None and before.status != INTERRUPTED:
        return before
    control = macro.control_point(test), (0.0, -1.0, 0.0)
    try:
        return push(
            model, control=control, to=to, first=2e-5, largest=to / 25, start=before, checkpoint=file, progress=print
        )
    except NotConverged as error:
        print(error)
        return None


def stone_by_stone(specimen: str, to: float, kept: Path | None, blocks: str = "simply deformable") -> Curve:
    """Push-over of a micro-model, load [N] over the top's displacement [m], from the folder where it is there."""
    name = "micro" if blocks == "simply deformable" else blocks
    file = None if kept is None else kept / f"{specimen}_{name}_{to:g}_{MOST:g}.npz"
    if file is None or not file.is_file():
        test = experiments.load(NAME, specimen)
        begun = time.process_time()
        found = micro.push_micro(test, to, blocks=blocks, steps=Steps(most=MOST), progress=print)
        assert found.energy is not None
        columns = {
            "displacement": micro.at_the_top(found, test), "load": 1e3 * found.multiplier, "status": str(found.status),
            "seconds": time.process_time() - begun, "energy": found.energy.error, "warnings": list(found.warnings),
            "jumped": [c.jump for c in found.certificates], "accepted": [c.accepted for c in found.certificates],
        }
        if file is None:
            return _read(columns)
        np.savez(file, **{k: np.asarray(v) for k, v in columns.items()})
    with np.load(file) as kept_run:
        return _read(dict(kept_run))


def _read(columns: Mapping[str, Any]) -> Curve:
    """The curve of a kept run."""
    events = [Event("break", int(k)) for k in np.flatnonzero(columns["jumped"])]
    if not np.all(columns["accepted"]):
        events.append(Event("refused by its certificate", int(np.argmin(columns["accepted"]))))
    return Curve(
        np.asarray(columns["displacement"]), np.asarray(columns["load"]), events=tuple(events),
        errors={"energy": np.asarray(columns["energy"])}, status=str(columns["status"]),
        warnings=tuple(str(w) for w in columns["warnings"]), source=f"{float(columns['seconds']):.0f}",
    )


def micro_stiffness(specimen: str, gigapascals: float | None) -> float:
    """Tangent under dead load at the top [kN/mm], with stones of a modulus [GPa], or rigid ones."""
    test = experiments.load(NAME, specimen, residual="full")  # nothing fails at this load
    stone = micro.STONE if gigapascals is None else replace(micro.STONE, young_modulus=1e9 * gigapascals)
    curve = micro.push_micro(test, 2e-7, blocks="rigid" if gigapascals is None else "simply deformable", stone=stone)
    return 1e-3 * float(curve.multiplier[1] / micro.at_the_top(curve, test)[1])


def light_damage(curve: Curve, over: float | None = None) -> tuple[float, float]:
    """Load [kN] and displacement [mm] at which the secant stiffness has fallen by 2 % of the initial one.

    Parameters
    ----------
    over : displacement over which the initial stiffness is taken [m]; the first step by default
    """
    u, load = curve.displacement, curve.load
    start = float(u[1]) if over is None else over
    on = u > np.maximum(start, np.maximum.accumulate(np.append(0.0, u[:-1])))
    try:
        found = mechanisms.light_damage(np.append(start, u[on]), np.append(np.interp(start, u, load), load[on]))
    except InputError:  # a curve that ends before
        return float("nan"), float("nan")
    return found.load / 1e3, 1e3 * found.displacement


def where_secant_is(curve: Curve, stiffness: float) -> str:
    """Load and displacement at which the secant first is as low as a stiffness [kN/mm]."""
    secant = curve.load[1:] / curve.displacement[1:] / 1e6
    if secant[0] <= stiffness:
        return "above the elastic one"
    below = np.flatnonzero(secant <= stiffness)
    if not len(below):
        return "not reached"
    load, travel = _between(curve, int(below[0]) + 1, 1e6 * stiffness)
    return f"{load / 1e3:.2f} kN, {1e3 * travel:.2f} mm"


def _between(curve: Curve, i: int, secant: float) -> tuple[float, float]:
    """Load [N] and displacement [m] of a secant [N/m] on the chord from sample i - 1 to i."""
    (f, g), (u, v) = curve.load[i - 1 : i + 1].tolist(), curve.displacement[i - 1 : i + 1].tolist()
    part = (secant * u - f) / (g - f - secant * (v - u))
    return f + part * (g - f), u + part * (v - u)


def elastic_stiffness(specimen: str, properties: str, size: float, **options: float) -> float:
    """Elastic stiffness at the control point under the airbag [kN/mm]."""
    test = experiments.load(NAME, specimen, **options)
    model = macro.macro_model(test, properties, size=size)
    u = [solve_elastic(model, load).at(macro.control_point(test))[0, 1] for load in (0.0, 1.0)]
    return 1e-3 / float(u[0] - u[1])


def drawn(
    curves: dict[str, SolidCurve | None], stones: dict[str, Curve], blocks: dict[str, tuple[Any, Any]]
) -> Figure:
    """All curves in one figure, a wall a panel, with the peaks of the tests."""
    shown = {
        k.replace(" step", " solid, step").replace(" final", " solid, final"): (c.displacement, c.load)
        for k, c in (curves | stones).items() if c is not None
    } | blocks
    with print_style():
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        figure.suptitle(
            "Airbag against top displacement. Solids: smeared cracks; micro: stones that deform; blocks: the DEM;\n"
            "loose foot: ground joint without tension; tests: peaks of Murano et al., section 6", fontsize="small",
        )
        for ax, wall, free in zip(figure.subplots(1, 2), ("REGW", "DS"), (0.57, 0.85), strict=True):
            peak = float(experiments.load(NAME, wall).measured["peak (section 6)"])
            of_wall = {k.removeprefix(f"{wall} "): c for k, c in shown.items() if k.startswith(wall)}
            load_displacement(of_wall, levels={"test, peak": 1e3 * peak}, title=wall, ax=ax)
            ax.legend(loc="center right", bbox_to_anchor=(1.0, free))  # between the curves
    return figure


def page(curves: dict[str, SolidCurve | None], stones: dict[str, Curve], rigid: Curve, size: float) -> str:
    """The page as Markdown."""
    from validation.u_wall_solids import cost, readings
    from validation.u_wall_solids import light_damage as prints  # only the command runs from the root of the tree

    found = {"size": f"{size:g}", "source": SOURCE}
    tables = {
        "stiffness": stiffnesses(curves, size), "modes": frequencies(size), "push-over": peaks(curves),
        "assumptions": [f"- {line}" for line in macro.ASSUMPTIONS], "micro": stone_table(stones),
        "micro-assumptions": [f"- {line}" for line in micro.ASSUMPTIONS],
        "chords": prints.section(curves, stones, rigid, micro_stiffness("REGW", None), light_damages(curves)),
        "readings": readings.section(), "cost": cost.section(), "secants": secants(curves, stones, rigid),
    }
    return filled(TEXT.format(**found), tables)


def stiffnesses(curves: dict[str, SolidCurve | None], size: float) -> list[str]:
    """Table of elastic stiffness, and where the printed one is passed as a secant."""
    head = ["model", "elastic [kN/mm]", "side walls 0.85 m", "side walls 1.15 m", "printed", "printed is the secant at"]
    rows = [head]
    for specimen, properties, _ in MODELS:
        label = f"{specimen} {properties}"
        printed = macro.published(specimen, properties).get("stiffness")
        curve = curves[label]
        rows.append([
            label, *(f"{elastic_stiffness(specimen, properties, size, **o):.2f}" for o in (
                {}, {"return_length": 0.85}, {"return_length": 1.15})),
            "-" if printed is None else f"{float(printed):g}",
            "-" if printed is None or curve is None else where_secant_is(curve, float(printed)),
        ])
    return markdown(rows)


def frequencies(size: float) -> list[str]:
    """Table of modes: solids and blocks here, and the source's models."""
    rows = [["wall", "family", "mode 1", "mode 2", "mode 3", "MAC 1", "MAC 2", "MAC 3"]]
    for specimen in ("DS", "REGW"):
        test = experiments.load(NAME, specimen)
        blocks = lm.modes(test.assembly(), 3)
        solid = lm.modes(macro.macro_model(test, size=size), 3)
        alike = np.diag(lm.mac(solid, blocks).values)
        rows.append([specimen, "solid, here", *(f"{f:.2f}" for f in solid.frequency), *(f"{v:.2f}" for v in alike)])
        for family in ("final", "micro"):
            p = macro.published(specimen, family)
            cells = [f"{float(p[f'{k}_{i}']):.2f}" for k in ("frequency", "mac") for i in (1, 2, 3)]
            rows.append([specimen, {"final": "macro-model, printed", "micro": "micro-model, printed"}[family], *cells])
        stones = lm.modes(micro.micro_model(test), 3, blocks="simply deformable", contact_points=micro.POINTS)
        alike = np.diag(lm.mac(stones, blocks).values)
        rows.append([specimen, "stones, here", *(f"{f:.2f}" for f in stones.frequency), *(f"{v:.2f}" for v in alike)])
        rows.append([specimen, "blocks, here", *(f"{f:.2f}" for f in blocks.frequency), "", "", ""])
        printed = [f"{float(test.published[f'3DEC frequency {k}']):.2f}" for k in (1, 2, 3)]
        rows.append([specimen, "3DEC, printed", *printed, "", "", ""])
    return markdown(rows)


def stone_table(stones: dict[str, Curve]) -> list[str]:
    """Table of stiffness, light damage and loads of the micro-models."""
    head = ["wall", "stiffness [kN/mm]", "stones 10, 50 GPa", "rigid", "printed", "printed is the secant at",
            "light damage [kN, mm]", "printed", "largest [kN, mm]", "printed", "at the end", "breaks",
            "energy left over", "seconds"]
    rows = [head]
    for label, curve in stones.items():
        specimen = label.split()[0]
        p = macro.published(specimen, "micro")
        load, travel = light_damage(curve)
        top, end = curve.peak, curve.point(-1)
        largest = experiments.load(NAME, specimen).published.get("FE micro-model peak")
        stiff = [micro_stiffness(specimen, e) for e in (micro.STONE.young_modulus / 1e9, 10.0, 50.0, None)]
        rows.append([
            specimen, f"{stiff[0]:.2f}", f"{stiff[1]:.2f}, {stiff[2]:.2f}", f"{stiff[3]:.2f}",
            f"{float(p['stiffness']):g}", where_secant_is(curve, float(p["stiffness"])), f"{load:.2f}, {travel:.3f}",
            f"{float(p['light_load']):g}, {float(p['light_displacement']):g}",
            f"{top.load / 1e3:.2f}, {1e3 * top.displacement:.2f}", "-" if largest is None else str(largest),
            f"{end.load / 1e3:.2f} kN at {1e3 * end.displacement:.2f} mm, {curve.status}",
            str(sum(e.name == "break" for e in curve.events)), f"{np.abs(curve.errors['energy']).max():.1%}",
            curve.source,
        ])
    return markdown(rows)


def secants(curves: dict[str, SolidCurve | None], stones: dict[str, Curve], rigid: Curve) -> list[str]:
    """Table of load and displacement at which each model of DS has the stiffness that is printed of it."""
    models: dict[str, tuple[Curve | None, float]] = {
        "solid, DS final (macro-model)": (curves["DS final"], float(macro.published("DS")["stiffness"])),
        "stones (micro-model)": (stones["DS micro"], float(macro.published("DS", "micro")["stiffness"])),
        "rigid blocks (3DEC)": (rigid, float(experiments.load(NAME, "DS").published["3DEC initial stiffness"])),
    }
    rows = [["model", "at first [kN/mm]", "printed [kN/mm]", "is the secant at"]]
    for label, (curve, printed) in models.items():
        if curve is not None:
            first = 1e-6 * float(curve.load[1] / curve.displacement[1])
            rows.append([label, f"{first:.2f}", f"{printed:g}", where_secant_is(curve, printed)])
    return markdown(rows)


def light_damages(curves: dict[str, SolidCurve | None]) -> list[str]:
    """Table of light damage by the displacement over which the initial stiffness is taken."""
    rows = [["model", *(f"initial over {1e3 * d:g} mm [kN, mm]" for d in OVER)]]
    for label, curve in curves.items():
        if curve is not None and "light_load" in macro.published(*label.split(" ", 1)):
            cells = [light_damage(curve, d) for d in OVER]
            rows.append([label, *(f"{f:.2f}, {u:.3f}" for f, u in cells)])
    return markdown(rows)


def peaks(curves: dict[str, SolidCurve | None]) -> list[str]:
    """Table of light damage and peaks."""
    rows = [["model", "light damage [kN, mm]", "printed", "peak [kN, mm]", "printed", "at the end", "jumps",
             "residual", "energy left over"]]
    for label, curve in curves.items():
        specimen, properties = label.split(" ", 1)
        p = macro.published(specimen, properties)
        printed = f"{float(p['light_load']):g}, {float(p['light_displacement']):g}" if "light_load" in p else "-"
        if curve is None:
            rows.append([label, "no state under dead load", printed, "", PRINTED_PEAKS[label], "", "", "", ""])
            continue
        load, travel = light_damage(curve)
        top, end = curve.peak, curve.point(-1)
        assert curve.energy is not None
        rows.append([
            label, f"{load:.2f}, {travel:.3f}", printed, f"{top.load / 1e3:.2f}, {1e3 * top.displacement:.2f}",
            PRINTED_PEAKS[label], f"{end.load / 1e3:.2f} kN at {1e3 * end.displacement:.2f} mm, {curve.status}",
            str(sum(e.name == "jump" for e in curve.events)), f"{curve.residual.max():.0e}",
            f"{np.abs(curve.energy.error).max():.1%}",
        ])
    return markdown(rows)


if __name__ == "__main__":
    main()
