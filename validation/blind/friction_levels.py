"""Are alarms across two codes made by the coarse table of friction? Nulls with 3 and with 9 levels of it.

``python -m validation.blind.friction_levels --trials 200``: the same noise for truths and candidates by limit analysis
and by the DEM (stored values of `two_codes.csv`; limit analysis adds those at the finer levels). Writes its part of
`report.md`.
"""

import argparse
from pathlib import Path

import numpy as np

from limitmason.diagnosis import Noise, Rule, Study

from . import report_parts, small_walls, two_codes_trials
from .small_walls import DEM, LIMIT

SEED = 77
BEGIN, END = "<!-- friction levels: begin -->", "<!-- friction levels: end -->"
CASES = ((LIMIT, LIMIT, 3), (LIMIT, LIMIT, 9), (LIMIT, DEM, 3), (DEM, LIMIT, 3), (DEM, LIMIT, 9))


def alarms(values, truth, candidates, levels, trials):
    """Largest error of the friction table at the frictions of the truth, in units of the noise, and alarms on nulls."""
    truths, code = (small_walls.Simulator(c, values, lambda *_: None) for c in (truth, candidates))
    noise = two_codes_trials.NOISE
    stated = noise if truth == candidates else float(np.hypot(noise, two_codes_trials.method_error()))
    options = {**two_codes_trials.SLOW, "nuisance_levels": levels, "shared": ()}
    known = (small_walls.SPECIMENS, code, None, Noise(noise), small_walls.NUISANCE, small_walls.COVARIATES)
    study = Study(*known, **options).replace(noise=Noise(stated))
    design = study.design(small_walls.CAUSES)
    nodes, worst = design.null.z[0], 0.0
    for z in two_codes_trials.FRICTIONS:
        shown = design.null.between([np.interp(z, nodes, np.arange(len(nodes)))])
        worst = max(worst, float(np.abs(shown - design.whiten(np.array(code.predict(z=z)))).max()))
    found = 0
    for k in range(trials):
        rng = np.random.default_rng([SEED, k])
        z = float(rng.choice(two_codes_trials.FRICTIONS, p=two_codes_trials.CHANCES))
        expected = np.array(truths.predict(z=z))
        measured = expected * np.exp(noise * rng.standard_normal(len(expected)))
        rule = Rule(identify=False, screen=True)
        asked = study.replace(measured=measured)
        verdict = asked.diagnose(small_walls.CAUSES, seed=k, draws=699, rule=rule, pairs=False)
        found += verdict.kind != "none"
    return worst, found


def main(arguments=None):
    """Write one line per case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("report.md"))
    given = parser.parse_args(arguments)
    values = dict(small_walls.read())
    lines = [BEGIN, "## Alarms across two codes: is it the friction table?", "",
             "Nulls of the 14 specimens of `small_walls.py`, the same noise in every case, the rule before a name is "
             "earned. Written by `python -m validation.blind.friction_levels`.", "",
             "| truth | candidates | levels of friction | table's largest error | alarms |",
             "|---|---|---|---|---|"]
    for truth, candidates, levels in CASES:
        worst, found = alarms(values, truth, candidates, levels, given.trials)
        row = f"{worst:.2f} of the noise | {found} of {given.trials}"
        lines.append(f"| {truth} | {candidates} | {levels} | {row} |")
    report_parts.put(given.out, "\n".join([*lines, END, ""]), BEGIN, END)


if __name__ == "__main__":
    main()
