"""The page of the McMaster wallettes: five angles by brittle DEM, the size of the blocks, what moves the strength.

    python -m validation.mcmaster --out docs/papers --kept FILE

makes ``mcmaster.md``; answers are kept in the file of ``--kept`` as they come.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import dem
from limitmason import experiments
from limitmason.build.cracks import with_potential_cracks
from limitmason.deformable.levels import RIGID, SIMPLY_DEFORMABLE
from limitmason.display.text_table import filled, markdown
from limitmason.experiments import mcmaster_bending as mcmaster
from limitmason.experiments.experiment import Experiment
from limitmason.model import Assembly, Loads, Material
from limitmason.model.joint import Joint, LostBy
from limitmason.study import Memo, fingerprint

NAME = "mcmaster-bending"
POINTS, FINER = (4, 8), (8, 16)
STEPS = 80_000
QUARTER: tuple[str, ...] = ("theta-0",)  # angles at a quarter of the size, which takes minutes
AXIS = 2500.0  # last label of the axis of moments in the source's Fig. 19 [N m]
LAWS: dict[str, Callable[[Joint], dict[str, Any]]] = {
    "lost by opening only": lambda j: {"lost_by": LostBy.OPENING},
    "nothing lost": lambda j: {"lost_by": LostBy.NOTHING},
    "c 0.27 MPa, half": lambda j: {"cohesion": 0.27e6},
    "ft 0.18 MPa, half": lambda j: {"tensile_strength": 0.18e6},
    "ks 3.5 GPa/m, half of kn": lambda j: {"shear_stiffness": 3.5e9},
    "ks 14 GPa/m, twice kn": lambda j: {"shear_stiffness": 14e9},
}
SUSPECTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("as it is", {}),
    ("a third of the speed", {"steps": 3 * STEPS}),
    ("twice the points along and across (8, 16)", {"points": FINER}),
    ("half the points along (2, 8)", {"points": (2, 8)}),
    ("half the points across (4, 4)", {"points": (4, 4)}),
    ("loads 0.3 m apart", {"load_span": 0.3, "push": 2e-3}),
    ("loads 0.5 m apart", {"load_span": 0.5, "push": 2e-3}),
    ("loads 0.9 m apart", {"load_span": 0.9, "push": 2e-3}),
    ("supports 1.2 m apart", {"support_span": 1.2}),
    ("supports 1.55 m apart", {"support_span": 1.55}),
    ("bond shifted by a quarter of a course", {"bond_shift": 0.25}),
    ("bond shifted by half a course", {"bond_shift": 0.5}),
    ("psi 36 degrees", {"dilatancy_deg": 36.0}),
    *((name, {"law": name, "push": 2e-3}) for name in LAWS),
    ("rollers and loads with the friction of joints", {"rollers_rub": True}),
    ("bars, or strips under them, 50 mm wide", {"bar_width": 0.05}),
    ("elastic blocks, E 10 GPa", {"modulus": 10e9}),
    ("blocks may crack across the middle, ft 3 MPa", {"block_tension": 3e6}),
    ("blocks may crack across the middle, ft 1.5 MPa", {"block_tension": 1.5e6}),
    ("weight of 1000 kg/m3 with the load", {"density": 1000.0}),
    ("weight of 1500 kg/m3 with the load", {"density": 1500.0}),
)
TEXT = """# McMaster wallettes: brittle four-point bending

Our strengths contradict nothing that the text prints. Its figures are not at hand, so nothing more can be decided.
The paper's sentence on the size of blocks holds in the plane.

Made by `python -m validation.mcmaster`: DEM, loading bars driven, {points} contact points along and across a joint,
{steps} steps. Joints are those of the paper's Table 4: kn = ks = 7 GPa/m, c 0.54, ft 0.36 MPa, 36 degrees, psi 0.
Blocks are rigid, 400 x 200 x 150 mm, in a wallette of 1600 x 790 mm.

Assumed:

- supports 1.5 m and loads 0.7 m apart;
- a bed joint and a head joint at the centre;
- no weight;
- a point that fails loses cohesion and tensile strength at once and keeps its friction;
- slivers at the edges are left out.

Missing in the text:

- spans, density and position of the wallettes;
- the measured means and their scatter (Fig. 9);
- every value of the DEM of the paper (Figs 9, 18, 19). Only labels of the axes can be read: 1.2 MPa beside the tests
  (Fig. 9), 2.0 MPa in the size study (Fig. 18), 2500 N m (Fig. 19). An axis may go on beyond its last label: for angles
  that is 80, and 90 degrees was run.

## Five angles at full size

[angles]

Equation 9 of the paper is ftn sin2 + ftp cos2 between 0 and 90 degrees. All lie below the 1.2 MPa of Fig. 9.

## What 0 and 15 degrees hang on

The moments at 0 and 15 degrees are {moment:.0f} and {at_15:.0f} N m. The last label of Fig. 19 is 2500, the next would
be 3000, so the figure may hold them. Each assumption changed alone:

[suspects]

- Less than 3 % downwards: speed, spans, dilatancy, finer contact points. Fewer points and
  another cut of the bond only raise it: four courses of 200 mm fill 790 mm as the first row has it.
- Friction at the rollers and wider bars raise it. Simply deformable blocks (nu 0.2) lower it by 4 to 6 %, part of
  it.
- Blocks may have a plane across their middle (c 1.5 ft, brittle, kn = ks = 70 GPa/m). One that does not crack loses
  3 and 10 %, by the give of the plane. One that cracks at 1.5 MPa lowers 0 degrees by 19 %. The blocks
  of the source are rigid and whole, and its wallettes failed in steps along the joints.
- Opening alone as the cause of loss, or none, put it far above 3000 N m, the next label. So the source has lost
  cohesion by slip as well, as 3DEC does.
- Two matter most downwards. One is the weight of a wallette that lies flat under its load.
  It is unknown; 1000 and 1500 kg/m3 give {w1000:.0f} and {w1500:.0f} N m. The other is lower cohesion or tensile
  strength than Table 4 prints. Softer ks only goes part of the way.
- Against the weight: a bed joint at 90 degrees would break at {w90:.2f} MPa under 1500 kg/m3. The source chose an
  ft of 0.36 MPa for its tests.

## Size of the blocks

{sizes_head}

[sizes]

- The paper: "all the dimensions of the blocks were scaled", larger blocks are stronger.
- In the plane alone (thickness 150 mm) strength falls with the blocks at 0 to 75 degrees. At 90, where a bed joint
  breaks alone, it does not move. This is the paper's sentence.
- With the thickness the moment falls with about its square, which is the paper's sentence for moments. The strength
  6 M / (b t2) moves by 1 to 14 % either way. Fig. 18 with its 2.0 MPa does not say which was meant.
"""


class Answers:
    """Strengths, each computed once and kept in a file."""

    def __init__(self, file: Path | None) -> None:
        self.memo = Memo(file, kind=dict)

    def __call__(self, specimen: str, **options: Any) -> dict[str, float]:
        """Answer of a specimen with options; see :func:`bent`."""
        call = [specimen, {"points": POINTS, "steps": STEPS, **options}]
        return self.memo.once([*call, fingerprint(*call, bent)], lambda: self._bent(specimen, **options))

    def _bent(self, specimen: str, **options: Any) -> dict[str, float]:
        print(specimen, options, flush=True)
        return bent(specimen, **options)


def bent(
    specimen: str, *, points: tuple[int, int] = POINTS, steps: int = STEPS, push: float = 1e-3, law: str = "",
    modulus: float | None = None, block_tension: float | None = None, rollers_rub: bool = False, **options: Any,
) -> dict[str, float]:
    """Largest strength 6 M / (b t^2) [Pa], moment [N m], travel at it [m], and part of the broken area in bed joints.

    Parameters
    ----------
    modulus : Young's modulus of blocks that deform in modes [Pa]; None for rigid ones
    block_tension : tensile strength of a potential crack across the middle of every block [Pa]; None for none
    rollers_rub : give the rollers and loads the friction of the joints

    Raises
    ------
    RuntimeError
        Where the load was still rising at the end: the push is too short.
    """
    test = experiments.load(NAME, specimen, **options)
    wall = test.assembly()
    if law:
        wall = wall.with_joints(
            lambda j: j if j.name != "mortar joint" else Joint(**{**vars(j), **LAWS[law](j)})
        )
    if rollers_rub:
        wall = wall.with_joints(lambda j: j if j.name != "roller" else replace(j, friction_angle_deg=36.0))
    if block_tension is not None:
        if options.get("density") is not None:
            raise ValueError("blocks that may crack have no weight here")
        wall = with_potential_cracks(wall, _middles(wall, test), _crack(block_tension))
    if modulus is not None:
        own = [b.name for b in wall.blocks if b.name.startswith("block-")]
        wall = wall.with_material(Material(young_modulus=modulus, poisson_ratio=0.2), blocks=own)
    loads = test.loads() if block_tension is None else Loads(np.zeros((wall.n_blocks, 6)), np.zeros((wall.n_blocks, 6)))
    held = dict.fromkeys(("x", "z", "rx", "ry", "rz"), 0.0)
    drive = dem.Drive(displacement={bar: {"y": -push, **held} for bar in mcmaster.LOADED}, steps=steps)
    try:
        history = dem.simulate(
            wall, drive, loads=loads, contact_points=points, sample=steps // 200, detect_every=None,
            blocks=RIGID if modulus is None else SIMPLY_DEFORMABLE,
        )
    except dem.UnstableError as error:
        # broken pieces that fall: after the peak
        if error.history is None:
            raise
        history = error.history
    force = -sum(history.reaction_of(bar)[:, 1] for bar in mcmaster.LOADED)
    stress = force / (2.0 * mcmaster.line_load(test, 1.0))
    # what falls apart may hit the bars: the peak is before the first fall to a quarter of it
    fallen = np.flatnonzero(stress < 0.25 * np.maximum.accumulate(stress))
    fallen = fallen[stress[: fallen[-1]].max(initial=0.0) > 0.0] if len(fallen) else fallen
    begun = int(np.argmax(stress > 0.0))
    fallen = fallen[fallen > begun]
    last = int(fallen[0]) if len(fallen) else len(stress)
    peak = int(stress[:last].argmax())
    if peak >= len(stress) - 2 and not law:
        raise RuntimeError(f"{specimen} {options}: still rising at {1e3 * push:g} mm")
    p, t = test.parameters, mcmaster.thickness_of(test)
    state, angle = history.state, np.deg2rad(p["orientation"])
    is_bed = np.abs(wall.arrays.normal @ (-np.sin(angle), 0.0, np.cos(angle))) > 0.5
    of_point = np.repeat(state.interface, np.diff(state.joints.start))
    broken = state.points.damage * state.points.area
    return {
        "strength": float(stress[peak]), "moment": float(stress[peak]) * float(p["width"]) * 1e-3 * t**2 / 6.0,
        "travel": push * (peak + 1) / (steps // (steps // 200)),
        "bed": float(broken[is_bed[of_point]].sum() / max(broken.sum(), 1e-300)),
    }


def _middles(wall: Assembly, test: Experiment) -> dict[int | str, tuple[np.ndarray, np.ndarray]]:
    """Plane across the middle of every block that the edge of the wallette leaves three quarters of."""
    angle = np.deg2rad(float(test.parameters["orientation"]))
    along = np.array([np.cos(angle), 0.0, np.sin(angle)])
    least = 0.75 * float(test.parameters["block length"]) / 1e3
    own = [b for b in wall.blocks if b.name.startswith("block-") and np.ptp(b.vertices @ along) > least]
    return {b.name: (b.centroid, along) for b in own}


def _crack(tension: float) -> Joint:
    """Brittle law of the cracks of blocks, ten times as stiff as the joints."""
    return Joint(
        36.0, cohesion=1.5 * tension, tensile_strength=tension, residual_cohesion=0.0, residual_tensile_strength=0.0,
        normal_stiffness=70e9, shear_stiffness=70e9, name="crack of a block",
    )


def angles(answers: Answers) -> list[str]:
    """Table of the five angles."""
    names = experiments.specimens(NAME)
    ends = [answers(f"theta-{a}")["strength"] for a in (0, 90)]
    rows = [["bed joints", "6 M / (b t2) [MPa]", "M [N m]", "travel [mm]", "a third of the speed", "points (8, 16)",
             "equation 9 between ours", "broken area in bed joints", "the tests"]]
    for name in names:
        test = experiments.load(NAME, name)
        a, slow, fine = answers(name), answers(name, steps=3 * STEPS), answers(name, points=FINER)
        square = np.sin(np.deg2rad(test.parameters["orientation"])) ** 2
        rows.append([
            f"{float(test.parameters['orientation']):g}", f"{1e-6 * a['strength']:.3f}", f"{a['moment']:.0f}",
            f"{1e3 * a['travel']:.2f}", f"{slow['strength'] / a['strength'] - 1.0:+.1%}",
            f"{fine['strength'] / a['strength'] - 1.0:+.1%}",
            f"{1e-6 * (ends[1] * square + ends[0] * (1.0 - square)):.3f}", f"{a['bed']:.2f}",
            str(test.parameters["failure"]),
        ])
    return markdown(rows)


def suspects(answers: Answers) -> list[str]:
    """Table of what each suspect does at 0 and 15 degrees."""
    rows = [["", "M at 0 degrees [N m]", "change", "M at 15 degrees [N m]", "change", f"both below {AXIS:.0f}"]]
    base = [answers(n)["moment"] for n in ("theta-0", "theta-15")]
    for name, options in SUSPECTS:
        found = [answers(n, **options)["moment"] for n in ("theta-0", "theta-15")]
        cells = [c for m, b in zip(found, base, strict=True) for c in (f"{m:.0f}", f"{m / b - 1.0:+.1%}")]
        rows.append([name, *cells, "yes" if max(found) < AXIS else ""])
    return markdown(rows)


def sizes(answers: Answers) -> list[str]:
    """Table of block sizes."""
    head = ["bed joints", "1: MPa", "N m"]
    head += ["1/2 in plane: MPa", "N m", "1/2 with thickness: MPa", "N m", "1/4 in plane: MPa", "N m"]
    rows = [head]
    for name in experiments.specimens(NAME):
        cells = [name.removeprefix("theta-")]
        whole = answers(name)
        cells += [f"{1e-6 * whole['strength']:.3f}", f"{whole['moment']:.0f}"]
        for scale in (0.5, 0.25):
            for thick in (False, True):
                if scale == 0.25 and (thick or name not in QUARTER):
                    cells += ["-", "-"] if not thick else []
                    continue
                # rotation of a joint at one stress goes with 1 / t, their number with 1 / scale
                far = 2.0 * whole["travel"] / scale / (scale if thick else 1.0)
                a = answers(name, block_scale=scale, scale_thickness=thick, push=round(far, 5))
                cells += [f"{1e-6 * a['strength']:.3f}", f"{a['moment']:.0f}"]
        rows.append(cells)
    return markdown(rows)


def page(answers: Answers) -> str:
    """The page as Markdown."""
    tables = {"angles": angles(answers), "suspects": suspects(answers), "sizes": sizes(answers)}
    words = {
        "points": f"{POINTS[0]} and {POINTS[1]}", "steps": STEPS, "moment": answers("theta-0")["moment"],
        "at_15": answers("theta-15")["moment"],
        "w1000": answers("theta-0", density=1000.0)["moment"], "w1500": answers("theta-0", density=1500.0)["moment"],
        "w90": 1e-6 * answers("theta-90", density=1500.0)["strength"],
        "sizes_head": "Length and height of the blocks over those of the source; the wallette keeps its size.",
    }
    return filled(TEXT.format(**words), tables)


def main() -> None:
    """Make the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/papers"))
    parser.add_argument("--kept", type=Path, default=None, help="file of answers, read where there")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    (chosen.out / "mcmaster.md").write_text(page(Answers(chosen.kept)), encoding="utf-8")


if __name__ == "__main__":
    main()
