"""The report of a verdict as one HTML page: mechanism, curve, spectrum, capacity."""

from __future__ import annotations

import math
from html import escape
from pathlib import Path

from limitmason.checks import instance
from limitmason.codes import Assessment, FloorSpectrum, GroundSpectrum, RecordSpectrum
from limitmason.codes.circular_2019 import STATES
from limitmason.codes.mechanism_capacity import DAMPING, Capacity, Spectrum, peak_of
from limitmason.codes.spectra import LARGEST_AG
from limitmason.constants import GRAVITY, VERSION
from limitmason.figures.collapse_mechanism import mechanism
from limitmason.figures.page import bullets, image, table, write_page
from limitmason.figures.report_page import geometry_facts, joint_table, load_facts
from limitmason.figures.safety import assessment

_SHEET = """
.sheet { display: grid; grid-template-columns: 2fr 3fr; gap: 1.2rem; align-items: start; }
.sheet img { width: auto; max-height: 30rem; }
.sheet div + div img { max-height: 20rem; }
@page { size: A4; margin: 12mm; }
@media print { html { font-size: 9px; } body { font-size: 9px; max-width: none; margin: 0; padding: 0; } }
"""

_NOT_COVERED = (
    "The mechanism is that of the load pattern named here; other patterns, floors and ties may govern.",
    "Stones do not break, and walls do not leave their bond, unless the model lets them.",
    "The values of joints, weights and of the site are those below; nothing here says that the structure has them.",
)


def assessment_report(verdict: Assessment, path: str | Path, *, title: str = "Local mechanism") -> Path:
    """Write a verdict by the Italian Circular of 2019 as one self-contained HTML page.

    Its limit states are damage (SLD), life safety (SLV) and collapse (SLC).

    Parameters
    ----------
    verdict : from ``limitmason.assess``
    path : file to write
    title : of the page

    Returns
    -------
    Path
        The file.
    """
    instance("verdict", verdict, Assessment, "by lm.assess")
    headline = (
        f"SLV is reached at {_shown(verdict.reached['SLV'], 3)} g, {verdict.share_text('SLV')} of the "
        f"{verdict.demand['SLV']:.3f} g that are asked"
    )
    drawn = [image(mechanism(verdict.structure, verdict.prediction, title="Mechanism"), "mechanism")]
    # without a curve the spectrum is drawn, which a record does not have
    if verdict.curve is not None or not any(isinstance(s, RecordSpectrum) for s in verdict.spectra.values()):
        heading = "Elastic spectrum" if verdict.curve is None else "Capacity and demand"
        drawn.append(image(assessment(verdict, title=heading), "capacity and spectrum"))
    parts = [
        f"<style>{_SHEET}</style>",
        f'<p class="title">{escape(title)}</p><h1>{escape(headline)}</h1>',
        f"<p>Italian Circular of 21 January 2019 no. 7, C8.7.1, by limitmason {escape(VERSION)}. Whether mechanism, "
        "loads and site are those of the structure is an engineer's judgement.</p>",
        _states(verdict),
        f'<div class="sheet"><div>{drawn[0]}</div><div>{"".join(drawn[1:])}{_capacities(verdict)}</div></div>',
        bullets([f"warning: {w}" for w in verdict.warnings]) if verdict.warnings else "",
        "<h2>Input</h2>" + bullets(_input(verdict)) + joint_table(verdict.structure),
        "<h2>What this does not cover</h2>" + bullets(_NOT_COVERED),
    ]
    return write_page(path, title, parts)


def _states(verdict: Assessment) -> str:
    """HTML of the accelerations reached and asked at each limit state [g], and ratios."""
    # rows as of page.table: "kept" is bold, and a number is a tuple of its text
    how = {
        "SLD": "peak acceleration against a0*",
        "SLV": "q = 2 on the peak acceleration" if verdict.curve is None else "displacement spectrum at T",
        "SLC": "displacement spectrum at T",
    }
    rows = [
        ("kept" if state == "SLV" else "", [
            state, (_shown(verdict.reached[state], 3),), (f"{verdict.demand[state]:.3f}",),
            (verdict.share_text(state),), how[state],
        ])
        for state in verdict.safety
    ]
    return table(["limit state", "a_g reached [g]", "a_g asked [g]", "share", "by"], rows)


def _capacities(verdict: Assessment) -> str:
    """HTML of the capacity by bodies, as the Circular asks, and by single blocks.

    A body is all blocks that move as one.
    """

    def cells(c: Capacity) -> dict[str, float]:
        """Numbers of one reading by their names with units."""
        out = {"alpha0 [-]": verdict.multiplier, "e* [-]": c.mass_share, "a0* [m/s2]": c.a0}
        if verdict.curve is not None:
            out["d0 [m]"] = c.d0
            for state in DAMPING:
                out |= {
                    f"d {state} [m]": c.d[state],
                    f"a(d) {state} [m/s2]": c.a[state],
                    f"T {state} [s]": c.period[state],
                }
        out |= {f"a_g {state} [g]": c.ag[state] for state in STATES if state in c.ag}
        return {**out, "a_g SLV by q = 2 [g]": c.ag_simplified}

    bodies, stones = cells(verdict.bodies), cells(verdict.stones)
    # as of page.table: no class, and a number is a tuple of its text
    rows = [("", [name, (_shown(bodies[name]),), (_shown(stones[name]),)]) for name in bodies]
    n = verdict.bodies.bodies
    header = ["", f"{n} {'body' if n == 1 else 'bodies'} (the text)", f"{verdict.stones.bodies} blocks singly"]
    return table(header, rows)


def _shown(value: float, digits: int = 4) -> str:
    """A quantity in words; infinite is an acceleration [g] beyond all that were tried."""
    return f"more than {LARGEST_AG:g}" if math.isinf(value) else f"{value:.{digits}f}"


def _input(verdict: Assessment) -> list[str]:
    """Sentences on spectra, confidence factor, structure, loads and mechanism."""
    by_spectrum: dict[str, list[str]] = {}
    for state in STATES:
        by_spectrum.setdefault(_described(verdict.spectra[state]), []).append(state)
    return [
        *(f"{', '.join(states)}: {text}" for text, states in by_spectrum.items()),
        f"confidence factor {verdict.confidence_factor:.2f}",
        *geometry_facts(verdict.structure),
        *load_facts(verdict.structure, verdict.loads),
        f"mechanism by {verdict.prediction.method}: {verdict.prediction.bound}",
    ]


def _described(spectrum: Spectrum) -> str:
    """One sentence on a spectrum."""
    if isinstance(spectrum, GroundSpectrum):
        return (
            f"ground, a_g {spectrum.ag:.3f} g, F0 {spectrum.f0:.3f}, Tc* {spectrum.tc_star:.3f} s, "
            f"soil {spectrum.soil}, S {spectrum.amplification:.3f}"
        )
    if isinstance(spectrum, FloorSpectrum):
        modes = ", ".join(f"{t:.3f} s with {f:.2f}" for t, f in zip(spectrum.periods, spectrum.factors, strict=True))
        return f"floor above {_described(spectrum.ground)}; modes {modes}, damping {spectrum.damping:.1%}"
    peak = peak_of(spectrum) / GRAVITY
    stands = "" if math.isclose(peak, spectrum.ag, rel_tol=1e-9) else f", for a_g {spectrum.ag:.3f} g"
    return f"record of {len(spectrum.record)} samples of {spectrum.sample_step} s, peak {peak:.3f} g{stands}"  # type: ignore[arg-type]
