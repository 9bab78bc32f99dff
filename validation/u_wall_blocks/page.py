"""What the page of the U walls says of the blocks: identified modes, other joints, mechanisms; from the kept lines."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

import limitmason as lm
from limitmason.display.text_table import filled, markdown
from validation import murano_macro as macro
from validation import murano_micro as micro

from . import identification, murano_table_10, onset, places, pushed
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

Rigid blocks in the DEM, {points}, first contacts kept. The airbag is driven through a spring, so that its load falls
where the wall gives way. `python -m validation.u_wall_blocks push` makes these runs.

- *Stones* strain and bend as in the micro-model, in the DEM or *at rest*, by `lm.pushover`.
- *Lost* are cohesion and tension of a joint where it fails.
- *Not at rest* is the mean difference of airbag and ground over the peak.
- Limit analysis is the associative one, nothing lost; *hull* is the one of the smallest convex law around the DEM's.

[pushed]

[pushed-words]

### Places of damage

Has a joint there moved by {apart:g} mm and more? Ours are the pushes above to 18 mm, the source's pictures are at 40
mm; "-" where its text does not say. `python -m validation.u_wall_blocks places` makes these runs.

[places]

- *DS*: the facade comes off its side walls and cracks in steps, as in the test and in both kinds of blocks. The test
  cracked on the left alone. The bond assumed here is nearly symmetric, and so is its damage.
- *REGW*: the facade comes off its side walls and opens at the top of mid-span, where the test's diagonal began. No
  diagonal goes down from there: the assumed bond cracks along a low bed joint instead. The test had both.

### The first points that give way

`python -m validation.u_wall_blocks onset` makes these runs.

[onset]

[onset-words]

## Mechanisms with the stated inputs

Beside what is printed stand this package's closed forms. *Stated inputs* are a hinge and crack 4 courses down, 13
degrees and k = 0.5; the *optimum* is the worst hinge and crack, k = 1. Loads are with 22.33 kN, the whole facade at
10 m/s2.

[mechanisms]

At the stated inputs some of Table 10 comes out, which is no confirmation. B and D of REGW come within 15 and 3 % of
the printed factors, and B of DS within 6 %. A of both walls and D of DS are off by 1.5 to 2.9 times. The optimum is
nearer for A alone. The terms of equations 24 to 26 are in a paper that was not at hand. `docs/mechanisms.md` derives
ours and says what of Table 10 can be reproduced.
"""

FOUND = """\
The record of REGW has the modes of its closed joints to 0.1 %: no joint opens under this noise. A push to 44 kN that is
taken off again leaves cracks open. They take 4, 0.6 and 2 % off its modes, and the record has those of that state to
0.3 % (FDD 0.8 %).

DS has no closed joints to begin with: 37 % of its contact points are open under dead load. Joints that just touch open,
close and slide however small the motion:

| noise | record below the tangent of that state | damping |
|---|---|---|
| whole | 9 to 12 % | 3 to 4 % |
| a tenth | 6 to 8 % | 1 to 2 % |

The same stones on joints that hold have the closed frequencies to 0.3 %. What the source prints for DS lies between
joints that all stay closed and joints that may open, nearer to the first.

Its noise ends at 30 Hz, below the second and third mode that it prints for REGW. With such noise only the first is
found here (looked for up to 33 Hz)."""

MAC_WORDS = """\
Solid and stones are compared with the shapes that white noise finds in the blocks, as the source compared with those of
3DEC.

- DS at a tenth of the noise is within 0.1 of the print but for the stones' first mode.
- DS under the whole noise: the first two stay within 0.1, the third pair falls to 0.58 and 0.55. Joints slide, and the
  second and third frequency lie 0.4 Hz apart. The third shape is then a mixture (0.69 with its own tangent's).
- REGW: the solid's first mode is within 0.1, all others lie 0.11 to 0.19 above the print. The record of blocks whose
  joints stay closed has their modes' shapes to 1.00. So nothing of an identification lowers the criterion here."""

ONSET_WORDS = """\
A loss of stiffness at the printed light damage needs a ground joint without tension. Whether the print is one cannot be
told from it. The table is of joints that lose nothing; up to its first point every law is the same, a spring.

- *REGW*: the first point opens at 23 kN, in the head joint at mid-span of the top course. The first slips at 37 to 40
  kN. So nothing gives way at the 9.93 (3DEC) and 9.71 kN (stones) printed as light damage: ends of chords, as said
  above.
- *REGW, ground joint without tension*: its first point opens at 6.5 kN, under the rear leaf of the facade at
  mid-span. At 10 kN 12 or 13 are open, and 2 % of the stiffness are lost at 12.8 kN and 0.26 mm.
- *REGW, ground joint without cohesion either*: the first point slips at 5 kN, and 2 % are lost at 11.1 kN and 0.23
  mm. Printed are 0.22 and 0.23 mm.
- *DS* has no first point: points are open and slide under dead load."""

PUSHED_WORDS = """\
What the foot does decides between a plateau and a fall, not fracture energy, residual cohesion or dilatancy.

| ground | what the wall does |
|---|---|
| a joint without tension but with cohesion | turns over about its foot in one piece: 31 kN at 1 mm, then 37 to 38 kN |
| a dry joint | slides at 28 to 31 kN |
| a joint like the others, cohesion kept or lost by opening alone | a peak of 41 kN before the same plateau |
| the same, over the fracture energy of Table 9 | a peak of 56 kN |
| the same, all lost at once | a peak of 38 kN, then 20 kN: the foot slides |
| holds; the wall keeps its cohesion | turns over on the bed joint above: 60 kN, then 50 (rigidly 49.7 kN) |
| holds; the wall loses its cohesion | the facade comes off its side walls at 48 to 55 kN; 17 to 27 kN are left |

The plateau has no peak before it, whatever failed mortar keeps above. It is rigid overturning, by limit analysis too:
37.6 kN = (36.2 kN x 0.342 m + 20 kN x 0.65 m) / 0.675 m.
That is the shape that the source describes, a plateau that hardly rises. It lies 4 to 12 % below its 40 kN (stones)
and 43 kN (3DEC).

Where nothing is lost the load comes to limit analysis from below as the wall moves, 160 of 169 kN at 18 mm. Dilatancy
of 10 degrees adds 3 kN to the peak and 2 kN behind. The diagonal cracks of the facade that the source describes are
not those of a wall that turns over in one. The crack along the second bed joint of the test is.

Elastic stones on a ground joint have the same loads driven in the DEM and at rest, in the micro-model's engine. The
stiffness is 47.7 kN/mm to 0.2 %, and the mechanisms are the same:

| [kN] | driven | at rest |
|---|---|---|
| peak, all lost at once | 38.3 | 38.0 |
| peak, lost by opening alone | 40.5 | 40.9 |
| at 5 mm, all lost at once | 19.5 | 19.6 |
| at 5 mm, lost by opening alone | 39.4 | 38.4 |
| at 2 mm, in the brittle fall | 32 | 24 |

Only the brittle fall differs. That is inertia: driven ten times as slowly it is 29 kN. Driven so slowly a wall has
also lost its 2 % at 28 kN, as at rest. Faster ones sway, and lose it at 24 to 26 kN. So the micro-model, too, has the
plateau on a ground joint.

*The first step of the source's calibration.* REGW comes nearest to the printed 60 kN where mortar keeps its cohesion
and the ground holds: 53 kN, 12 % less. It turns over on the bed joint above the ground, at rigidly 49.7 kN. It has 43
kN where mortar is lost at once or by opening, 37 and 39 kN on a ground joint. Where nothing is lost limit analysis has
137 to 143 kN.

*The stiffness of DS.* Head joints of a dry wall may not touch before they have closed by a tenth of a millimetre. With
head joints a thousandth as stiff the chord to 0.48 mm is 3.6 instead of 4.0 kN/mm, printed 2.80. So open head joints
are a third of that difference. The rest hangs on which stones bear under own weight, which the bond decides.

DS has a tensile strength of 0.403 MPa, 120 times above the apex of its cone. What is left of it depends on how it is
lost:

| DS | load [kN] |
|---|---|
| lost by slip too: joints that slide hold nothing | 9 to 11 are left |
| lost by opening alone | 62 at 0.07 mm, then 35 to 38 |
| the same, on a ground joint | 53, then 24 to 28 where it slides on it |
| the same, an airbag that only grows | a knee at 62, 77 at 2 mm and 82 at 5 |
| the same, growing four times as slowly | 67 at 2 mm and 68 at 5 |
| over 12 J/m2, assumed | 143, then 102 to 106 |
| nothing is lost | 270 at 2 mm, rising to 286 at 10 mm |
| nothing is lost, on a ground joint | 262, falling to 140 |

Lost by opening alone it is 800 times as stiff as the test up to 62 kN: the printed knee at 60 kN. An airbag that only
grows hides the fall behind it, by inertia. That is the printed curve, which rises to 80 kN behind its knee and then
slightly on. How fast its airbag grew is not in the text. At rest more than 62 kN takes joints that do not lose their
tension at once where they open.

Limit analysis cuts the strength at the apex, 21 kN. It is no bound of the DEM's law, which is not convex beyond the
apex. The hull of that law has 371 kN (261 on a ground joint), and is a bound for a wall at rest.

These are driven runs at one speed, which walls that slide follow by sticking and slipping. DS has 2.8 to 2.9 kN, and
the micro-model above, at rest in every state, has 2.83 kN. An airbag that only grows shows 2.9 to 3.1 kN. Behind the
peak of a brittle wall such an airbag shows inertia: REGW, all lost at once, 30 kN where 18 kN are left. The
micro-model falls to 23 kN at 2 mm, too."""


def sections() -> str:
    """The sections as Markdown."""
    runs, modes = identification.tables()
    channels = len(identification.channels(identification.model(CASES[0])[1]))
    text = TEXT.format(
        first=FIRST, channels=channels, damping=identification.DAMPING,
        points=f"{pushed.POINTS[0]} x {pushed.POINTS[1]} points a joint", apart=places.APART,
    )
    return filled(text, {
        "identified": identified(runs, modes), "found": FOUND.splitlines(), "mac": criteria(modes),
        "places": places_of_damage(places.read()), "mac-words": MAC_WORDS.splitlines(), "pushed": pushes(pushed.read()),
        "pushed-words": PUSHED_WORDS.splitlines(), "mechanisms": table_10(), "onset": onset.table(onset.read()),
        "onset-words": ONSET_WORDS.splitlines(),
    })


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
        stones = {"blocks": "simply deformable", "contact_points": micro.POINTS}
        models = {
            "final": ("solid", lm.modes(macro.macro_model(test, size=0.15), 3)),
            "micro": ("stones", lm.modes(micro.micro_model(test), 3, **stones)),
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
             "limit analysis [kN]"]]
    for name, p in kept.items():
        rows.append([
            name, f"{p.stiffness:.4g}", f"{p.light[0]:.1f}, {p.light[1]:.2g}", f"{p.peak[0]:.1f}, {p.peak[1]:.2g}",
            "-" if np.isnan(p.at).all() else ", ".join("-" if np.isnan(v) else f"{v:.1f}" for v in p.at),
            f"{p.mechanism}, {p.end:.2g} mm", "at rest" if np.isnan(p.rate) else f"{p.rate:.1%}",
            f"{p.limit:.1f}" + ("" if np.isnan(p.hull) else f"; hull {p.hull:.1f}"),
        ])
    return markdown(rows)


SAID = {
    "DS": (
        ("facade off its side walls", "yes, left", "yes", "yes", "yes"), ("top at mid-span", "yes", "-", "-", "-"),
        ("steps in the facade", "yes, left", "yes", "yes", "no"), ("a low bed joint", "-", "-", "-", "-"),
    ),
    "REGW": (
        ("facade off its side walls", "yes", "yes", "yes", "yes"), ("top at mid-span", "yes", "-", "-", "yes"),
        ("steps in the facade", "yes, left", "yes", "yes", "yes"),
        ("a low bed joint", "yes, the second", "-", "-", "-"),
    ),
}
"""Places of damage in the source's words (sections 2, 6.1 and 6.2): test, 3DEC, micro-model, macro-model."""


def places_of_damage(kept: Mapping[str, places.Places]) -> list[str]:
    """Table of places at which the walls have cracked, beside the source."""

    def sides(left: float, right: float) -> str:
        cracked = [side for side, v in (("left", left), ("right", right)) if v >= places.APART]
        return {0: "no", 1: f"yes, {cracked[0] if cracked else ''}", 2: "yes, both"}[len(cracked)]

    def ours(place: str, p: places.Places) -> str:
        if place == "facade off its side walls":
            return sides(p.left_wall, p.right_wall)
        if place == "steps in the facade":
            return sides(p.left_steps, p.right_steps)
        if place == "top at mid-span":
            return "yes" if p.middle >= places.APART else "no"
        beds = (p.bed_1, p.bed_2, p.bed_3)
        return f"yes, bed {int(np.argmax(beds)) + 1}" if max(beds) >= places.APART else "no"

    rows = [["wall", "place", "test", "3DEC", "micro-model", "macro-model", "ours"]]
    for wall, lines in SAID.items():
        own = [(name.partition(", ")[2], p) for name, p in kept.items() if name.split(",")[0] == wall]
        for place, *said in lines:
            told = "; ".join(f"{ours(place, p)}{f' ({law})' if law else ''}" for law, p in own)
            rows.append([wall, place, *said, told])
    return markdown(rows)


def table_10() -> list[str]:
    """Table of mechanisms A, B and D."""
    rows = [["wall", "mechanism", "factor, printed", "at stated inputs", "at the optimum", "load, printed [kN]",
             "at stated inputs", "at the optimum"]]
    for r in murano_table_10.table_10():
        weight = murano_table_10.murano_facade(r.wall).weight
        rows.append([
            r.wall, r.mechanism, f"{r.printed_factor:g}", f"{r.as_stated:.3f}", f"{r.recomputed:.3f}",
            f"{r.printed_load / 1e3:.2f}", f"{r.as_stated * weight / 1e3:.2f}", f"{r.recomputed * weight / 1e3:.2f}",
        ])
    return markdown(rows)
