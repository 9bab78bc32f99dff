"""What the macro-model of REGW depends on: a push-over to past the first peak for every reading of the source."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitmason import experiments
from limitmason.constants import GRAVITY
from limitmason.continuum import Continuum, Material, SolidCurve, push
from limitmason.csv_table import parsed, write_table
from limitmason.experiments.murano_u_walls import FORCE, NAME, macro
from limitmason.text_table import filled, markdown

CONCRETE = Material(30e9, 0.2, 2500.0, name="concrete")
"""Of the base that the source meshed too; assumed."""


@dataclass(frozen=True)
class Reading:
    """One change against the model of the page.

    Parameters
    ----------
    name : as on the page
    size : largest edge of a brick [m]
    options : of the experiment
    model : of :func:`macro.macro_model`
    push : of :func:`limitmason.continuum.push`
    material : fields of the masonry that change, a strength as a factor
    load : turns the model into one with other live loads
    """

    name: str
    size: float = 0.30
    options: dict[str, float] = field(default_factory=dict)
    model: dict[str, Any] = field(default_factory=dict)
    push: dict[str, float] = field(default_factory=dict)
    material: dict[str, float] = field(default_factory=dict)
    load: Callable[[Continuum], Continuum] | None = None


def by_mass(model: Continuum) -> Continuum:
    """Load in proportion to mass, outwards, of the same resultant as the airbag's."""
    bare = replace(model, live=np.zeros_like(model.live))
    return bare.with_body_force((0.0, -FORCE / (GRAVITY * model.mass), 0.0))


TEXT = """### What the first peak of REGW depends on

The source has about 37 kN. Its program's default band of solids is the cube root of the volume (DIANA 9.3, Material
Library, section 6.3), as here, and cracks cost what they should: the twelve bricks most cracked at 6 mm have lost 0.93
to 1.01 of Gf over the band. One reading at a time:

[readings]

None but energy or load pattern is worth the missing quarter (27.7 kN on bricks of 0.10 m, 25 % below the source). Up to
28.4 kN the states are stable; from 29.5 kN on the tangent has one or two negative directions. A load in proportion to
mass is not what the source describes. Two more need another element or law: quadratic tetrahedra, six a brick and each
with the cube root of its own volume, give 30.9 kN (bricks of 0.30 m) and 31.4 kN (0.15 m), 15 % below the source, whose
text calls its elements tetrahedra of twenty nodes; cracks that contract sideways with the elastic ratio give 26.0 kN.
"""
STORED = Path(__file__).with_name("readings.csv")
UNITS = {"reading": "-", "stiffness": "kN/mm", "first peak": "kN", "there": "mm", "seconds": "s"}
READINGS = (
    Reading("bricks of 0.30 m"),
    Reading("bricks of 0.15 m", size=0.15),
    Reading("crack band half the cube root, or twice the energy", push={"band": 0.5}),
    Reading("2 x 2 x 2 points", model={"points": 2}),
    Reading("strength 25 % higher", material={"tensile_strength": 1.25}),
    Reading("no crushing", material={"compressive_strength": np.inf, "compressive_energy": np.inf}),
    Reading("Poisson's ratio 0.2", material={"poisson_ratio": 0.2}),
    Reading("side walls 0.85 m", options={"return_length": 0.85}),
    Reading("side walls 1.15 m", options={"return_length": 1.15}),
    Reading("roof load from the facade on", options={"roof_from": 0.0}),
    Reading("on an elastic slab of concrete", model={"slab": CONCRETE}),
    Reading("unbalanced to 5 %, steps of 0.2 mm", push={"tolerance": 5e-2, "largest": 2e-4, "first": 2e-4}),
    Reading("load by mass", load=by_mass),
)


def changed(reading: Reading) -> Continuum:
    """The macro-model of a reading."""
    test = experiments.load(NAME, "REGW", **reading.options)
    model = macro.macro_model(test, size=reading.size, **reading.model)
    if reading.material:
        masonry = model.materials[0]
        new = {k: v if k != "tensile_strength" else v * masonry.tensile_strength for k, v in reading.material.items()}
        model = replace(model, materials=(replace(masonry, **new), *model.materials[1:]))
    return model if reading.load is None else reading.load(model)


def to_the_peak(model: Continuum, point: tuple[float, float, float], to: float = 2e-3, **options: float) -> SolidCurve:
    """Push until the load has fallen by 3 % from its largest, or a displacement [m]."""
    steps: dict[str, Any] = {"first": 5e-5, "largest": 5e-5, **options}
    curve = None
    for end in np.arange(2e-4, to + 1e-9, 2e-4):
        curve = push(model, control=(point, (0.0, -1.0, 0.0)), to=float(end), start=curve, **steps)
        if curve.load[-1] < 0.97 * curve.peak.load or curve.status != "reached":
            break
    assert curve is not None
    return curve


class Peak(NamedTuple):
    """What is kept of a reading: elastic stiffness [kN/mm], first peak [kN], where it is [mm], seconds of a core."""

    stiffness: float
    load: float
    displacement: float
    seconds: float


def run(reading: Reading, progress: Callable[[str], object] | None = None) -> Peak:
    """Push the macro-model of a reading to past its first peak."""
    if progress:
        progress(f"{reading.name} ...")
    begun = time.process_time()
    test = experiments.load(NAME, "REGW", **reading.options)
    curve = to_the_peak(changed(reading), macro.control_point(test), **reading.push)
    top = curve.peak
    stiffness = 1e-6 * float(curve.load[1] / curve.displacement[1])
    return Peak(stiffness, top.load / 1e3, 1e3 * top.displacement, time.process_time() - begun)


def read() -> dict[str, Peak]:
    """What is kept, by name."""
    if not STORED.is_file():
        return {}
    rows = parsed(STORED.read_text(encoding="utf-8"), STORED.name).rows
    return {cells[0]: Peak(*map(float, cells[1:])) for cells in rows}


def make(names: Sequence[str], progress: Callable[[str], object]) -> None:
    """Run readings by name, all that are missing without names, and keep each as soon as it is there."""
    order = [r.name for r in READINGS]
    for reading in READINGS:
        kept = read()
        if reading.name in names or (not names and reading.name not in kept):
            kept[reading.name] = run(reading, progress)
            lines = [[n, *(f"{v:.5g}" for v in kept[n])] for n in sorted(kept, key=order.index)]
            write_table(STORED, UNITS, lines)


def table() -> list[str]:
    """Elastic stiffness and first peak of every kept reading of REGW, and both over those of the first."""
    rows = [["reading", "stiffness [kN/mm]", "over the first", "first peak [kN, mm]", "over the first", "seconds"]]
    kept = read()
    first = kept[READINGS[0].name]
    for name, p in kept.items():
        rows.append([
            name, f"{p.stiffness:.2f}", f"{p.stiffness / first.stiffness:.2f}", f"{p.load:.2f}, {p.displacement:.2f}",
            f"{p.load / first.load:.2f}", f"{p.seconds:.0f}",
        ])  # fmt: skip
    return markdown(rows)


def section() -> list[str]:
    """The section of the page, in lines."""
    return filled(TEXT, {"readings": table()}).splitlines()
