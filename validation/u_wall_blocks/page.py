"""What the page of the U walls says of the blocks: identified modes, other joints, mechanisms; from the kept lines."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

import limitmason as lm
from limitmason.display.text_table import filled, markdown
from limitmason.experiments.murano_u_walls import macro, micro

from . import identification, onset, printed_mechanisms, pushed
from .identification import CASES, Found, Run

Array = NDArray[np.float64]

ALIKE = 0.5
"""Criterion below which an identified shape is that of no mode."""

FIRST = "## Modes identified from simulated records"
TEXT = """{first}

White noise at the base of the blocks' DEM along x and y together; frequencies and shapes from displacements of
{channels} stones: `dem.white_noise`, `dem.identify`. Dashpots damp the first mode by {damping:.0%} (assumed). An
identified mode stands under the mode of the state's tangent that its shape is most like; criterion in brackets.
`python -m validation.u_wall_blocks identify` makes these runs.

[identified]

[found]

## Shapes beside those identified

[mac]

[mac-words]

## Other joints of the blocks

Rigid blocks in the DEM, {points}, first contacts kept; the airbag driven through a spring, so that
its load falls where the wall gives way. *Stones* strain and bend as in the micro-model, in the DEM or *at rest*, by
`lm.pushover`. *Lost* are cohesion and tension of a joint where it fails; *not at rest* is the mean difference of airbag
and ground over the peak; limit analysis is the associative one, nothing lost, and *hull* the one of the smallest convex
law around the DEM's. `python -m validation.u_wall_blocks push` makes these runs.

[pushed]

[pushed-words]

### The first points that give way

`python -m validation.u_wall_blocks onset` makes these runs.

[onset]

[onset-words]

## Mechanisms with the stated inputs

Printed, this package's closed forms at what the text states (hinge and crack 4 courses down, 13 degrees, k = 0.5) and
at the optimum (worst hinge and crack, k = 1); loads with 22.33 kN, the whole facade at 10 m/s2.

[mechanisms]

The terms of equations 24 to 26 are in a paper that was not at hand; `docs/mechanisms.md` derives ours and says what of
Table 10 can be reproduced. At the stated inputs B and D of REGW come within 15 and 3 % of the printed factors and B of
DS within 6 %; A of both walls and D of DS are off by 1.5 to 2.9 times, so that this is no confirmation. The optimum is
nearer for A alone.
"""

FOUND = """\
No joint of REGW opens under this noise, and its record has the modes of its closed joints to 0.1 %. A push to 44 kN
that is taken off again leaves cracks open: 4, 0.6 and 2 % off its modes, and the record has those of that state to
0.3 % (FDD 0.8 %). DS has no closed joints to begin with: 37 % of its contact points are open under dead load, and its
record lies 9 to 12 % below the tangent of that state, with 3 to 4 % damping; with a tenth of the noise 6 to 8 %
below, with 1 to 2 %: joints that just touch open, close and slide however small the motion. The same stones on joints
that hold have the closed frequencies to 0.3 %. What the source prints for DS lies between joints that all stay closed
and joints that may open, nearer to the first. Its noise ends at 30 Hz, below the second and third mode that it prints
for REGW: with such noise only the first is found here (looked for up to 33 Hz)."""

MAC_WORDS = """\
Solid and stones against the shapes that white noise finds in the blocks, as the source compared with those of 3DEC.
DS at a tenth of the noise is within 0.1 of the print but for the stones' first mode. Under the whole noise its third
pair falls to 0.58 and 0.55: joints slide, the second and third frequency lie 0.4 Hz apart and the third shape is a
mixture (0.69 with its own tangent's); the first two stay within 0.1. In REGW the solid's first mode is within 0.1,
all others lie 0.11 to 0.19 above the print: the record of blocks whose joints stay closed has their modes' shapes to
1.00, so nothing of an identification lowers the criterion here."""

ONSET_WORDS = """\
The table is of joints that lose nothing; up to its first point every law is the same, a spring. The first point of REGW
opens at 23 kN, in the head joint at mid-span of the top course, and the first slips at 37 to 40 kN: at the 9.93 (3DEC)
and 9.71 kN (stones) printed as light damage, ends of chords as said above, nothing gives way on such a ground. If the
ground joint has no tension its first point opens at 6.5 kN, under the rear leaf of the facade at mid-span; 12 or 13 are
open at 10 kN, and 2 % of the stiffness are lost at 12.8 kN and 0.26 mm, or, where it has no cohesion either and the
first point slips at 5 kN, at 11.1 kN and 0.23 mm, beside the printed 0.22 and 0.23 mm. So a loss of stiffness there
needs a ground joint without tension; whether the print is one cannot be told from it. DS has no first point: points are
open and slide under dead load."""

PUSHED_WORDS = """\
What the foot does, not fracture energy, residual cohesion or dilatancy, decides between a plateau and a fall. On a
ground joint without tension but with cohesion the wall turns over about its foot in one piece: 31 kN at 1 mm, then 37
to 38 kN with no peak before, whatever failed mortar keeps above; rigidly, and by limit analysis, 37.6 kN = (36.2 kN x
0.342 m + 20 kN x 0.65 m) / 0.675 m. That is the shape that the source describes, a plateau that hardly rises, 4 to 12 %
below its 40 kN (stones) and 43 kN (3DEC). Dry it slides at 28 to 31 kN. On a ground joint like the
others a peak stands before the same plateau: 41 kN where cohesion is kept or lost by opening alone, 56 kN over the
fracture energy of Table 9, 38 kN where all is lost at once (then 20 kN: the foot slides). On a ground that holds, a
wall that keeps its cohesion turns over on the bed joint above (60 kN, then 50; rigidly 49.7 kN); else the facade comes
off its side walls at 48 to 55 kN and 17 to 27 kN are left. Where nothing is lost the load comes to limit analysis from
below as the wall moves, 160 of 169 kN at 18 mm. Dilatancy of 10 degrees adds 3 kN to the peak and 2 kN behind. The
diagonal cracks of the facade that the source describes are not those of a wall that turns over in one; the crack
along the second bed joint of the test is.

Elastic stones on a ground joint have the same loads driven in the DEM and at rest, in the micro-model's engine:
stiffness 47.7 kN/mm to 0.2 %, peaks of 38.3 and 38.0 kN (all lost at once), 40.5 and 40.9 kN (by opening alone), at 5
mm 19.5 and 19.6, 39.4 and 38.4 kN, and the same mechanisms. Only in the brittle fall, at 2 mm, the driven wall has 32
kN and the one at rest 24: inertia, ten times as slowly it is 29. Driven so slowly a wall has also lost its 2 % at 28
kN, as at rest, not at 24 to 26, where faster ones sway. So the micro-model, too, has the plateau on a ground joint.

The first step of the source's calibration. REGW has 43 kN where mortar is lost at once or by opening, 37 and 39 kN on
a ground joint, and 137 to 143 kN, limit analysis, where nothing is lost: none has the printed 60 kN. DS, with a tensile
strength of 0.403 MPa, 120 times above the apex of its cone: where that is lost by slip too, joints that slide hold
nothing and 9 to 11 kN are left. Lost by opening alone it has 62 kN at 0.07 mm (53 on a ground joint), up to which it is
800 times as stiff as the test: the printed knee at 60 kN. Behind it 35 to 38 kN are left (24 to 28 where it slides on
its ground joint). An airbag that only grows does not show that: behind a knee at 62 kN it rises to 77 kN at 2 mm and 82
at 5, or, growing four times as slowly, 67 and 68, by inertia. That is the printed curve, which rises to 80 kN behind
its knee and then slightly on; how fast its airbag grew is not in the text. At rest more than 62 kN takes joints that do
not lose their tension at once where they open: over 12 J/m2, assumed, 143 kN and then 102 to 106; where nothing is
lost 270 kN at 2 mm, which rise to 286 at 10 mm (262 on a ground joint, which fall to 140). Limit analysis cuts the
strength at the apex, 21 kN, and is no bound of the DEM's law, which is not convex beyond it; the hull of that law has
371 kN (261 on a ground joint), and is one for a wall at rest.

These are driven runs at one speed, which walls that slide follow by sticking and slipping. DS has 2.8 to 2.9 kN, as
the micro-model above, at rest in every state, has (2.83 kN); an airbag that only grows shows 2.9 to 3.1 kN. Behind
the peak of a brittle wall such an airbag shows inertia: REGW, all lost at once, 30 kN where 18 kN are left. The
micro-model falls to 23 kN at 2 mm, too."""


def sections() -> str:
    """The sections as Markdown."""
    runs, modes = identification.tables()
    channels = len(identification.channels(identification.model(CASES[0])[1]))
    text = TEXT.format(
        first=FIRST, channels=channels, damping=identification.DAMPING,
        points=f"{pushed.POINTS[0]} x {pushed.POINTS[1]} points a joint",
    )  # fmt: skip
    return filled(text, {
        "identified": identified(runs, modes), "found": FOUND.splitlines(), "mac": criteria(modes),
        "mac-words": MAC_WORDS.splitlines(), "pushed": pushes(pushed.read()),
        "pushed-words": PUSHED_WORDS.splitlines(), "mechanisms": table_10(), "onset": onset.table(onset.read()),
        "onset-words": ONSET_WORDS.splitlines(),
    })  # fmt: skip


def paired(found: Found, state: Found) -> list[tuple[int, float] | None]:
    """For the first three modes of a state the identified mode most like it and the criterion, or None."""
    values = lm.mac(found.shape, state.shape).values
    best = [(int(column.argmax()), float(column.max())) for column in values.T[:3]]
    return [pair if pair[1] >= ALIKE else None for pair in best]


def identified(runs: Mapping[str, Run], modes: Mapping[tuple[str, str], Found]) -> list[str]:
    """Table of frequencies: of closed joints, of the state, as found, as printed."""
    rows = [["record", "noise", "open, broken points", "frequencies [Hz]", "mode 1", "mode 2", "mode 3", "damping"]]
    for case in CASES:
        if case.name not in runs:
            continue
        kept = runs[case.name]
        noise = f"{case.seconds:g} s to {case.highest:g} Hz, {case.rms:g} m/s2"
        points = f"{kept.open}, {kept.broken} of {kept.points}"
        head = [case.name, noise, points]
        for label, values in (("closed joints", kept.closed), ("tangent of the state", kept.tangent)):
            rows.append([*head, label, *(f"{f:.2f}" for f in values[:3]), ""])
            head = ["", "", ""]
        for method in ("ssi", "fdd"):
            found = modes[case.name, method]
            pairs = paired(found, modes[case.name, identification.TANGENT])
            cells = ["-" if p is None else f"{found.frequency[p[0]]:.2f} ({p[1]:.2f})" for p in pairs]
            damping = [found.damping[p[0]] for p in pairs if p is not None]
            told = ", ".join(f"{d:.1%}" for d in damping) if method == "ssi" else ""
            rows.append(["", "", "", f"identified, {method.upper()}", *cells, told])
        if case.name == case.wall:
            published = identification.model(case)[0].published
            printed = [f"{float(published[f'3DEC frequency {k}']):.2f}" for k in (1, 2, 3)]
            rows.append(["", "", "", "3DEC, printed", *printed, ""])
    return markdown(rows)


def criteria(modes: Mapping[tuple[str, str], Found]) -> list[str]:
    """Table of the modal assurance criterion of solid and stones with identified shapes, beside the print."""
    rows = [["shapes identified in", "compared with", "mode 1", "mode 2", "mode 3", "printed"]]
    for case in CASES:
        if (case.name, "ssi") not in modes or case.pushed:
            continue
        test, wall = identification.model(case)
        where = identification.channels(wall)
        found = modes[case.name, "ssi"]
        pairs = paired(found, modes[case.name, identification.TANGENT])
        models = {
            "final": ("solid", lm.modes(macro.macro_model(test, size=0.15), 3)),
            "micro": ("stones", lm.modes(micro.micro_model(test), 3, blocks="modal", contact_points=micro.POINTS)),
        }
        for properties, (label, own) in models.items():
            values = lm.mac(found.shape, identification.at_channels(own, wall, where)).values
            cells = ["-" if p is None else f"{values[p[0], k]:.2f}" for k, p in enumerate(pairs)]
            p = macro.published(case.wall, properties)
            rows.append([case.name, label, *cells, ", ".join(f"{float(p[f'mac_{k}']):.2f}" for k in (1, 2, 3))])
    return markdown(rows)


def pushes(kept: Mapping[str, pushed.Pushed]) -> list[str]:
    """Table of pushes with other joints."""
    rows = [["blocks", "stiffness [kN/mm]", "light damage [kN, mm]", "peak [kN, mm]",
             "at " + ", ".join(f"{u:g}" for u in pushed.AT) + " mm [kN]", "at the end", "not at rest",
             "limit analysis [kN]"]]  # fmt: skip
    for name, p in kept.items():
        rows.append([
            name, f"{p.stiffness:.4g}", f"{p.light[0]:.1f}, {p.light[1]:.2g}", f"{p.peak[0]:.1f}, {p.peak[1]:.2g}",
            "-" if np.isnan(p.at).all() else ", ".join("-" if np.isnan(v) else f"{v:.1f}" for v in p.at),
            f"{p.mechanism}, {p.end:.2g} mm", "at rest" if np.isnan(p.rate) else f"{p.rate:.1%}",
            f"{p.limit:.1f}" + ("" if np.isnan(p.hull) else f"; hull {p.hull:.1f}"),
        ])  # fmt: skip
    return markdown(rows)


def table_10() -> list[str]:
    """Table of mechanisms A, B and D."""
    rows = [["wall", "mechanism", "factor, printed", "at stated inputs", "at the optimum", "load, printed [kN]",
             "at stated inputs", "at the optimum"]]  # fmt: skip
    for r in printed_mechanisms.table_10():
        weight = printed_mechanisms.murano_facade(r.wall).weight
        rows.append([
            r.wall, r.mechanism, f"{r.printed_factor:g}", f"{r.as_stated:.3f}", f"{r.recomputed:.3f}",
            f"{r.printed_load / 1e3:.2f}", f"{r.as_stated * weight / 1e3:.2f}", f"{r.recomputed * weight / 1e3:.2f}",
        ])  # fmt: skip
    return markdown(rows)
