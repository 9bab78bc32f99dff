"""The page of the BNW shear walls: units that deform, yield and crack, beside the tests and the paper.

    python -m validation.bnw_walls --out docs/papers --kept FOLDER

makes ``bnw.md``, ``bnw.png`` (curves) and ``bnw-plasticity.png``. Pushes are kept in the folder of ``--kept`` as they
go; a run that was cut off goes on, one that is there is read back.
"""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import dem
from limitmason import experiments
from limitmason.display.text_table import filled, markdown
from limitmason.experiments import Experiment
from limitmason.experiments.bnw_walls import ASSUMED
from limitmason.figures import load_displacement, plasticity

from . import bnw_cycles

NAME = "bnw-walls"
WALLS = ("BNW1", "BNW2", "BNW3")
INPUT: Mapping[str, Any] = {"friction": 0.4, "cohesion": 0.25e6, "young_modulus": 3.088e9}
MODELS: Mapping[str, Mapping[str, Any]] = {"units yield": {}, "units yield and crack": {"unit_cracks": True}}
CRACKING = "units yield and crack"
LEAST_DRIFT = 1.0  # to which every wall is driven [%]; further where its measured ultimate drift is larger
ZONE = 0.128  # largest edge of a zone [m]: two by two in a unit
STEPS: Mapping[str, int] = {"units yield": 8_000, "units yield and crack": 15_000}  # of the faster run
SLOWER_STEPS: Mapping[tuple[str, str], int] = {("BNW1", "units yield and crack"): 30_000}  # 15 000 leave 4.6 %
ONCE_DRIFT, ONCE_STEPS = 0.6, 7_500  # of the runs with other inputs [%]: beyond their peaks
CRACK, CRUSHED = 1e-4, 2e-3  # what counts as a crack that is seen [m], and as crushing [plastic strain]
VARIED: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("as assumed", {}),
    ("friction 0.2", {"friction": 0.2}),
    ("friction 0.6", {"friction": 0.6}),
    ("cohesion 0 (database: 0.25 MPa)", {"cohesion": 0.0}),
    ("G: ks 1.75 GPa/m", {"ks": 1.75e9}),
    ("E 6.18 GPa", {"young_modulus": 6.176e9}),
    ("fc 0.5 times", {"unit_strength": 0.5 * 4.956e6}),
    ("fc 0.75 times", {"unit_strength": 0.75 * 4.956e6}),
    ("fc 1.5 times", {"unit_strength": 1.5 * 4.956e6}),
    ("ft 0.1 MPa", {"unit_tension": 0.1e6}),
    ("ft 0.4 MPa", {"unit_tension": 0.4e6}),
)
PAPER_ORDER = {
    "BNW1": "toes disintegrate in the first cycles (Fig. 8); hybrid failure",
    "BNW2": "shear cracks, mainly through units, then the toe (5.2)",
    "BNW3": "shear cracks along head joints and through units, the toe about at the peak or after it (5.3)",
}
TEXT = """# BNW walls: the paper's numbers beside ours

Made by `python -m validation.bnw_walls`. Sources: the paper (UDEC) and the database named in
`limitmason experiments show bnw-walls`. Ours is the DEM, with units in zones of at most {zone:.0f} mm (Mohr-Coulomb
with a tension cut-off). A rigid beam is driven sideways, free to rise and turn, at two speeds. Ours is the slower run,
and *rate* the difference of the two peaks.

**Predicted with inputs of codes and a database; nothing is fitted to these walls.** The table of materials of the paper
is lost, so that its own input cannot be run.

- Of the database: geometry, vertical stress, bilinear idealisation, peaks, drifts. The compressive strength of the
  masonry is 4.956 MPa, the initial shear strength 0.25 MPa (how it was obtained is not stated). Of EN 1996-1-1:
  friction 0.4. Of the sister series BNL, same units: E 3.088 GPa, taken for the units.
- Assumed of joints: kn {kn:g} and ks {ks:g} GPa/m, no tensile strength, nothing lost in slip.
- Assumed of units: nu {nu:g}, friction {phi:g} degrees, dilatancy 0, fc of the masonry, ft {ft:g} MPa.
- Assumed of the wall: no weight, a running bond of ten expanded units, and the force at its top (H0 / H = 1) on a thin
  rigid beam.
- A crack in a unit is its vertical mid-plane as a joint with the unit's cohesion, friction and ft. It loses cohesion
  and ft when it opens or slips. Away from these planes nothing softens: yielding zones keep their strength.
- Missing: height and weight of the beam, curves of the tests and of UDEC, the definition of the bilinear
  idealisation, and cycles. The tests were cyclic, three times at every amplitude; ours is one push.

## Peaks, stiffness, ultimate drift

[walls]

The stiffness of the database is its bilinear force over its elastic drift, both senses. Ours are the secants at 40 and
80 % of the peak. *At the ultimate drift* is ours at the database's. Both runs of a wall together took at most
{minutes:.1f} min on a busy machine. The rate error is that of the peak; {rate}.

![load against displacement](bnw.png)

- Mean of ours over measured: units yield {mean_yield}, with cracks {mean_crack}. UDEC, calibrated on these walls, is
  within 1 % of the positive peaks.
- Without crack planes the load hardly falls: nothing in the model softens, and there is no ultimate drift. With them it
  falls after a peak, as the tests do; where it ends is set by the brittle loss that is assumed.

## What comes first

[order]

*ft reached* is the first stress point anywhere that meets the tensile strength. It is a zone beside a head joint,
stretched by some micrometres, which no one could see. *Crack* is a zone stretched by {crack:g} mm or a crack plane
moved as much. *Toe* is a zone that yielded in shear to a plastic strain of {crushed:g}.

- By the first stress point cracks lead in all three walls; by what could be seen they lead in {led}.
- The paper has it so in BNW2 and BNW3, too. Only BNW1's toes go first there.
- The lead of the cracks is {lead} % of drift with crack planes. It does not turn with fc from 0.5 to 1.5 times nor ft
  from 0.1 to 0.4 MPa, as the list below shows. The planes fail in shear under the struts, whatever ft.
- {alone}
- The tests had two things that the single push has not. Cycles crush a toe three times at every amplitude, both ends in
  turn: they do not turn the order, see below. Shells of a hollow unit fall off, weaker than the masonry's strength
  spread over its whole section: not tried, their strength is not printed.

What comes first as inputs change:

{flips}

![plasticity](bnw-plasticity.png)

## What moves it

With crack planes, one speed, to a drift of {once:g} %. E and G of the masonry: 1/E = 1/E(unit) + 1/(kn h), 1/G =
1/G(unit) + 1/(ks h), h the height of a course. The sister series has E 3.09 and G 0.28 to 0.37 GPa.

[varied]

[cycles]

## Misfit

{misfit}
"""


@dataclass(frozen=True)
class Pushed:
    """A wall that was pushed: test, curve, height [m]."""

    test: Experiment
    curve: dem.PushCurve
    height: float

    def drift(self, displacement: float) -> float:
        """Drift [%] at a displacement [m]."""
        return 100.0 * displacement / self.height

    @property
    def measured(self) -> float:
        """Mean of the measured peaks of both senses [kN]."""
        m = self.test.measured
        return 0.5 * (float(m["Vmax+"]) + float(m["Vmax-"]))

    @property
    def ratio(self) -> float:
        """Peak over the measured one [-]."""
        return 1e-3 * self.curve.peak.load / self.measured


def pushed(specimen: str, kept: Path | None, *, once: bool = False, zone: float = ZONE, **options: Any) -> Pushed:
    """A wall with options, at two speeds or one."""
    test = experiments.load(NAME, specimen, **{**INPUT, **options})
    height = float(test.parameters["height"])
    drift = ONCE_DRIFT if once else max(LEAST_DRIFT, float(test.measured["bilinear ultimate drift+"]))
    words = [specimen, "once" if once else "", f"{1e3 * zone:g}", *(f"{k}{v}" for k, v in options.items())]
    file = None if kept is None else kept / ("_".join(filter(None, words)) + ".npz")
    print(*words, flush=True)
    model = model_of(options)
    steps = SLOWER_STEPS.get((specimen, model), STEPS[model])
    curve = dem.push(
        test.assembly(), test.drive(), to=1e-2 * drift * height, loads=test.loads(), blocks="zoned", zone_size=zone,
        steps=ONCE_STEPS if once else steps, rate_check=not once, samples=250, checkpoint=file,
        label=f"{specimen}, DEM",
    )
    return Pushed(test, curve, height)


def once_pushed(wall: str, change: str, kept: Path | None) -> Pushed:
    """A wall with crack planes and one of the changes of ``VARIED``, at one speed."""
    return pushed(wall, kept, once=True, **{**MODELS[CRACKING], **dict(VARIED)[change]})


def model_of(options: Mapping[str, Any]) -> str:
    """Which of the two models options make."""
    return CRACKING if options.get("unit_cracks") else "units yield"


def moved_crack(p: Pushed) -> int | None:
    """First sample at which a crack plane has opened or slid by ``CRACK``."""
    c = p.curve
    own = np.array([i.kind == "crack" for i in c.assembly.interfaces])
    if not own.any():
        return None
    far = np.maximum(np.nan_to_num(c.opening[:, own]), np.nan_to_num(c.slip[:, own])).max(axis=1)
    return int(np.argmax(far >= CRACK)) if (far >= CRACK).any() else None


def crack_and_toe(p: Pushed) -> tuple[int | None, int | None]:
    """Samples of the first crack that is seen, in a zone or a crack plane, and of the first crushing."""
    zone, toe = p.curve.first_unit_crack(CRACK), p.curve.first_crushing(CRUSHED)
    cracks = [i for i in (None if zone is None else zone.index, moved_crack(p)) if i is not None]
    return min(cracks, default=None), None if toe is None else toe.index


def at(p: Pushed, index: int | None) -> str:
    """Drift and load at a sample."""
    if index is None:
        return "-"
    return f"{p.drift(float(p.curve.displacement[index])):.2f} %, {1e-3 * float(p.curve.load[index]):.0f} kN"


def walls(found: Mapping[tuple[str, str], Pushed]) -> list[str]:
    """Table of peaks, stiffness and ultimate drift."""
    rows = [["wall", "model", "peak [kN]", "at drift [%]", "measured +, - [kN]", "at [%]", "ours / mean", "UDEC [kN]",
             "stiffness [kN/mm]", "database", "at the ultimate drift", "rate", "steps", "zones"]]
    for (wall, model), p in found.items():
        m, c = p.test.measured, p.curve
        stiff = [
            float(m[f"bilinear force{s}"]) / (1e-2 * float(m[f"bilinear elastic drift{s}"]) * 1e3 * p.height)
            for s in "+-"
        ]
        ours = f"{1e-6 * c.stiffness(0.0, 0.4):.0f}, {1e-6 * c.stiffness(0.0, 0.8):.0f}"
        last = 1e-2 * float(m["bilinear ultimate drift+"]) * p.height
        assert c.mesh is not None
        rows.append([
            wall, model, f"{1e-3 * c.peak.load:.0f}", f"{p.drift(c.peak.displacement):.2f}",
            f"{float(m['Vmax+']):.0f}, {float(m['Vmax-']):.0f}",
            f"{float(m['drift at Vmax+']):.2f}, {float(m['drift at Vmax-']):.2f}", f"{p.ratio:.2f}",
            f"{float(p.test.published['UDEC limit force']):.0f}", ours, f"{stiff[0]:.0f}, {stiff[1]:.0f}",
            f"{float(c.at(last)) / c.peak.load:.2f} of the peak", f"{c.rate_error:.1%}", str(c.steps),
            str(len(c.mesh.zones)),
        ])
    return markdown(rows)


def orders(found: Mapping[tuple[str, str], Pushed]) -> list[str]:
    """Table of what comes first."""
    rows = [["wall", "model", "ft reached", "fc reached", "crack", "toe", "peak", "first crack, database [%]",
             "the paper"]]
    for (wall, model), p in found.items():
        c = p.curve
        named = [next((e.index for e in c.events if e.name == name), None) for name in ("unit cracks", "unit yields")]
        rows.append([
            wall, model, *(at(p, i) for i in (*named, *crack_and_toe(p), c.peak.index)),
            f"{float(p.test.measured['drift at first crack']):.2f}", PAPER_ORDER[wall],
        ])
    return markdown(rows)


def first_of(p: Pushed) -> str:
    """"crack" or "toe", whichever is first; "both" in one sample, "none" where there is neither."""
    crack, toe = crack_and_toe(p)
    if crack is None or toe is None or crack == toe:
        return "both" if crack == toe and crack is not None else "crack" if toe is None else "toe"
    return "crack" if crack < toe else "toe"


def both(p: Pushed) -> str:
    """Drift and load at crack and toe."""
    return " and ".join(at(p, i) for i in crack_and_toe(p))


def varied(found: Mapping[tuple[str, str], Pushed]) -> list[str]:
    """Tables of what inputs do, one of every wall."""
    out = []
    for wall in WALLS:
        rows = [[wall, "masonry E, G [GPa]", "peak [kN]", "change", "at drift [%]", "crack", "toe", "first"]]
        for name, options in VARIED:
            p, base = found[wall, name], found[wall, VARIED[0][0]]
            rows.append([
                name, moduli(options), f"{1e-3 * p.curve.peak.load:.0f}",
                f"{p.curve.peak.load / base.curve.peak.load - 1.0:+.0%}",
                f"{p.drift(p.curve.peak.displacement):.2f}", *(at(p, i) for i in crack_and_toe(p)), first_of(p),
            ])
        out += [*markdown(rows), ""]
    return out[:-1]


def moduli(options: Mapping[str, Any]) -> str:
    """E and G of the masonry [GPa], units and bed joints in series."""
    o = {**ASSUMED, **INPUT, **options}
    height = 0.25
    shear = o["young_modulus"] / (2.0 * (1.0 + o["poisson_ratio"]))
    e, g = (1e-9 / (1.0 / m + 1.0 / (k * height)) for m, k in ((o["young_modulus"], o["kn"]), (shear, o["ks"])))
    return f"{e:.2f}, {g:.2f}"


def drawn(found: Mapping[tuple[str, str], Pushed]) -> Figure:
    """Curves of all walls."""
    page = Figure(figsize=(6.3, 8.4), dpi=160)
    FigureCanvasAgg(page)
    for k, wall in enumerate(WALLS):
        ax = page.add_subplot(3, 1, k + 1)
        test = found[wall, CRACKING].test
        height = float(test.parameters["height"])
        points = [
            ("measured peaks, both senses", 1e-2 * float(test.measured[f"drift at Vmax{s}"]) * height,
             1e3 * float(test.measured[f"Vmax{s}"])) for s in "+-"
        ]
        load_displacement({m: found[wall, m].curve for m in MODELS}, measured=test, points=points, ax=ax, title=wall)
        ax.set_ylim(0.0, None)
    page.tight_layout()
    return page


def mapped(found: Mapping[tuple[str, str], Pushed]) -> Figure:
    """Plasticity maps of BNW1 and BNW2 with cracks, at the peak and at the end, as one picture."""
    pictures = []
    for wall in WALLS:
        figure = plasticity(found[wall, CRACKING].curve, title=f"{wall}, {CRACKING}: predicted, nothing fitted")
        figure.set_dpi(110)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pictures.append(np.asarray(canvas.buffer_rgba())[:, :, :3])
    tall = max(p.shape[0] for p in pictures)
    page = Figure(figsize=(sum(p.shape[1] for p in pictures) / 110, tall / 110), dpi=110)
    FigureCanvasAgg(page)
    left, whole = 0, sum(p.shape[1] for p in pictures)
    for p in pictures:
        ax = page.add_axes((left / whole, 1.0 - p.shape[0] / tall, p.shape[1] / whole, p.shape[0] / tall))
        ax.imshow(p)
        ax.axis("off")
        left += p.shape[1]
    return page


def misfits(found: Mapping[tuple[str, str], Pushed]) -> list[str]:
    """Sentences on what does not fit."""
    out = []
    for wall in WALLS:
        p = found[wall, CRACKING]
        m = p.test.measured
        after = p.curve.ultimate(0.8)
        fell = "does not fall to 80 % of it"
        if after is not None:
            fell = f"has fallen to 80 % of it at {p.drift(after.displacement):.2f} %"
        ends = " and ".join(f"{float(m[f'bilinear ultimate drift{s}']):.2f}" for s in "+-")
        tops = " and ".join(f"{float(m[f'drift at Vmax{s}']):.2f}" for s in "+-")
        out.append(
            f"- {wall}: peak {p.ratio - 1.0:+.0%} with cracks, {found[wall, 'units yield'].ratio - 1.0:+.0%} without. "
            f"It lies at {p.drift(p.curve.peak.displacement):.2f} % where the test has {tops} %. The load {fell} "
            f"(test, bilinear: {ends} %)."
        )
    return out


def page(kept: Path | None) -> tuple[str, Figure, Figure]:
    """The page as Markdown, and its figures."""
    found = {(w, m): pushed(w, kept, **o) for w in WALLS for m, o in MODELS.items()}
    other = {(w, name): once_pushed(w, name, kept) for name, _ in VARIED for w in WALLS}
    means = [np.mean([found[w, m].ratio for w in WALLS]) for m in MODELS]
    seconds = max(p.curve.seconds + (p.curve.faster.seconds if p.curve.faster is not None else 0.0)
                  for p in found.values())
    led = [w for w in WALLS if first_of(found[w, CRACKING]) == "crack"]
    flips = [
        f"- {name}: {', '.join(f'{w} {first_of(other[w, name])}' for w in WALLS)}"
        for name, o in VARIED if {"unit_tension", "unit_strength"} & set(o)
    ]
    alone = pushed("BNW1", kept, once=True, unit_tension=0.4e6)
    spans = [0.01 * round(100.0 * (ends[1] - ends[0])) for ends in (
        [p.drift(float(p.curve.displacement[i])) for i in crack_and_toe(p) if i is not None]
        for (_, m), p in found.items() if m == CRACKING
    ) if len(ends) == 2]
    rates = {f"{w} {m}": p.curve.rate_error for (w, m), p in found.items()}
    above = [f"{n} ({v:.1%})" for n, v in rates.items() if v > 0.03]
    words = {
        "lead": f"{min(spans):.2f} to {max(spans):.2f}",
        "rate": f"above 3 %: {', '.join(above)}" if above else "none is above 3 %",
        "alone": f"Without crack planes BNW1 has crack and toe at {both(found['BNW1', 'units yield'])}. With ft 0.4 "
        f"MPa they are at {both(alone)}.",
        "once": ONCE_DRIFT, "zone": 1e3 * ZONE, "kn": 1e-9 * ASSUMED["kn"], "ks": 1e-9 * ASSUMED["ks"],
        "nu": ASSUMED["poisson_ratio"], "phi": ASSUMED["unit_friction_deg"], "ft": 1e-6 * ASSUMED["unit_tension"],
        "mean_yield": f"{means[0]:.2f}", "mean_crack": f"{means[1]:.2f}", "crack": 1e3 * CRACK, "crushed": CRUSHED,
        "minutes": seconds / 60.0, "led": ", ".join(led) or "none", "flips": "\n".join(flips),
        "misfit": "\n".join(misfits(found)),
    }
    tables = {"walls": walls(found), "order": orders(found), "varied": varied(other), "cycles": bnw_cycles.section()}
    return filled(TEXT.format(**words), tables), drawn(found), mapped(found)


def main() -> None:
    """Make the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/papers"))
    parser.add_argument("--kept", type=Path, default=None, help="folder of pushes, read where there")
    chosen = parser.parse_args()
    for folder in (chosen.out, chosen.kept):
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
    text, curves, maps = page(chosen.kept)
    (chosen.out / "bnw.md").write_text(text, encoding="utf-8")
    curves.savefig(chosen.out / "bnw.png")
    maps.savefig(chosen.out / "bnw-plasticity.png")


if __name__ == "__main__":
    main()
