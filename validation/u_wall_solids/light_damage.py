"""What the source prints as light damage: ends of chords, beside the same chords of every family here."""

from collections.abc import Mapping, Sequence

import numpy as np

from limitmason import experiments
from limitmason.answers.curve import Curve
from limitmason.display.text_table import filled, markdown
from limitmason.experiments.murano_u_walls import NAME
from validation import murano_macro as macro

LOST = 0.98
"""Share of the initial stiffness that is left at light damage (source, section 6.3)."""
TEXT = """### Light damage

The source takes light damage where 2 % of the initial stiffness are lost (section 6.3). What it prints is something
else. Seven of its eight loads are 0.98 x stiffness x displacement to the last digit, with a displacement of two
digits. They are ends of chords over which a stiffness was taken, less 2 %; no curve need bend there.

| wall | the chords end at | displacement |
|---|---|---|
| REGW, all four curves | 9.8 to 11.1 kN | 0.33 mm in the test, 0.22 to 0.24 in the models |
| DS, all four | 1.0 to 2.1 kN | 0.47 to 0.57 mm |

By all appearances these ends were chosen, and no law of joints or bricks decides on them. Over the same chords:

[chords]

The eighth, DS of the macro-model, does not fit. Printed is 0.83 kN. That is 0.98 x 1.49 kN/mm x 0.57 mm, or nearly
0.98 x 3.10 kN/mm x 0.27 mm. But 3.10 and 0.57, both like its neighbours, make 1.73 kN.

By the words of section 6.3 the curves here have:

[light-damage]

For DS, which softens from the start, this depends on the displacement over which the initial stiffness is taken. REGW
is elastic to 8 kN, where a corner first meets the strength. It is 2 % softer at 18 kN (17.3 kN on bricks of 0.10 m).
"""


def section(
    solids: Mapping[str, Curve | None], stones: Mapping[str, Curve], rigid: Curve, regw: float, lost: Sequence[str]
) -> list[str]:
    """The section of the page, in lines.

    Parameters
    ----------
    solids : curves of the macro-models, by wall and properties
    stones : curves of the micro-models, by wall
    rigid : curve of the rigid blocks of DS
    regw : stiffness of those of REGW, which keep to their line as far as printed [kN/mm]
    lost : lines of the table of loads at which 2 % are lost
    """
    return filled(TEXT, {"chords": chords(solids, stones, rigid, regw), "light-damage": list(lost)}).splitlines()


def chords(solids: Mapping[str, Curve | None], stones: Mapping[str, Curve], rigid: Curve, regw: float) -> list[str]:
    """Table of stiffness and load over the printed chords."""
    rows = [["model", "chord to [mm]", "stiffness printed [kN/mm]", "here", "over the printed",
             "0.98 of its end, printed [kN]", "here", "over the printed"]]
    for family, sets, curves in (("macro", "final", solids), ("micro", "micro", stones)):
        for wall in ("DS", "REGW"):
            curve = curves[f"{wall} {sets}"]
            p = macro.published(wall, sets)
            if curve is not None:
                printed = [float(p[c]) for c in ("stiffness", "light_load", "light_displacement")]
                rows.append([f"{wall} {family}-model", *chord(curve, *printed)])
    for wall in ("DS", "REGW"):
        q = experiments.load(NAME, wall).published
        stiffness, load = float(q["3DEC initial stiffness"]), float(q["3DEC light-damage load"])
        to = round(load / (LOST * stiffness), 2)  # 0.48 and 0.22 mm, as printed
        line = Curve(np.array([0.0, 1e-3]), np.array([0.0, 1e3 * regw]))
        rows.append([f"{wall} rigid blocks (3DEC)", *chord(rigid if wall == "DS" else line, stiffness, load, to)])
    return markdown(rows)


def chord(curve: Curve, stiffness: float, load: float, to: float) -> list[str]:
    """Cells of a row: stiffness [kN/mm] over a chord to a displacement [mm] and 0.98 of the load there, by print."""
    end = float(np.interp(1e-3 * to, curve.displacement, curve.load)) / 1e3
    here = end / to
    return [f"{to:g}", f"{stiffness:g}", f"{here:.2f}", f"{here / stiffness:.2f}", f"{load:g}", f"{LOST * end:.2f}",
            f"{LOST * end / load:.2f}"]
