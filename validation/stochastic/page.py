"""The page of the random panels: tables, and the sentences whose numbers come from them."""

import math

import numpy as np

from limitmason import study
from limitmason.text_table import filled, markdown

from .runs import OWN_WEIGHT
from .tables import (
    ALONE,
    CELLS,
    KINDS,
    Tables,
    both,
    cells,
    convergence,
    cracks,
    floors,
    laws,
    mean_set,
    modes,
    name_of,
    noise,
    printed,
    ratios,
)
from .text import REPEATED, TEXT, TIME


def page(tables: Tables) -> str:
    """The whole page."""
    counts = [len(tables[name_of(*c)]) for c in CELLS]
    mean_rows = [r for r in tables["mean-set"] if r["sample"] // 100 == 0]
    kept = tables["set4-spatial-kept"]
    words = {
        "runs": f"{counts[0]}" if len(set(counts)) == 1 else f"{min(counts)} to {max(counts)}",
        "agreement": agreement(tables), "fallen": fallen(tables), "independent": independent(tables),
        "brittleness": brittleness(tables),
        "kept_rise": f"with cohesion kept, {_late(kept)} of {len(kept)} spatial runs have their largest after 1.4 mm",
        "mean_set": f"{np.mean([r['ultimate'] for r in mean_rows]) / 1e3:.1f}",
        "floor": spread_of(tables["floor"]), "third": spread_of(tables["floor-third"]), "judged": judged(tables),
        "repeated": REPEATED, "alone": f"{ALONE:g}", "symmetry": symmetry(tables), "time": TIME,
    }  # fmt: skip
    parts = {
        "ratios": ratios(tables), "cells": cells(tables), "laws": laws(tables),
        "mean set": mean_set(tables["mean-set"]), "floor": floors(tables), "cracks": cracks(tables),
        "modes": modes(tables), "convergence": convergence(tables),
    }  # fmt: skip
    return filled(TEXT.format(**words), {name: markdown(lines) for name, lines in parts.items()})


def _late(table: study.Table) -> int:
    return int((table["at"].astype(float) > 1.4e-3).sum())


def spread_of(table: study.Table) -> str:
    """CoV of the peaks of a study in words."""
    own = study.running(table, "ultimate")
    value = 100 * own.variation[-1]
    return f"{both(value, value * own.variation_error[-1])} % ({int(own.n[-1])} runs)"


def agreement(tables: Tables) -> str:
    """How far ratios and non-spatial spreads lie from the published ones, in sampling errors of both sides."""
    out = []
    for number in (1, 2, 3, 4):
        a, b = (study.running(tables[name_of(number, k)], "ultimate") for k in KINDS)
        cov_a, cov_b = (printed(number, k)[1] for k in KINDS)
        # of logarithms; 300 published runs have an error of their own
        error = math.hypot(a.variation_error[-1], b.variation_error[-1], 0.041, 0.041)
        away = abs(math.log(a.variation[-1] / b.variation[-1] / (cov_a / cov_b))) / error
        out.append(f"set {number} {away:.1f}")
    return f"Ratios of CoV differ from the published ones by so many sampling errors of both sides: {', '.join(out)}."


def fallen(tables: Tables) -> str:
    """Runs that fall under their own weight, and the spread of the cells that have some without them."""
    out = []
    for number, kind in CELLS:
        table = tables[name_of(number, kind)]
        stood = study.Table(tuple(r for r in table if r["mode"] != OWN_WEIGHT))
        if gone := len(table) - len(stood):
            own = study.running(stood, "ultimate")
            out.append(
                f"{gone} of {len(table)} runs of set {number} {kind}; without them its mean is "
                f"{own.mean[-1] / 1e3:.2f} kN and its CoV {100 * own.variation[-1]:.1f} %"
            )
    if not out:
        return "No panel of these falls under its own weight."
    return (
        f"Panels that fall under their own weight count as runs that carry nothing: {'; '.join(out)}. Whether the "
        "weakest draws stand is decided by how their weight comes on; here it is there at once, with the motion damped."
    )


def independent(tables: Tables) -> str:
    """Spread of set 4 with strengths drawn each by itself."""
    parts = []
    for kind in KINDS:
        table = tables[f"set4-{kind}-independent"]
        parts.append(f"{spread_of(table)} {kind}")
    return f"set 4 has {parts[1]} and {parts[0]}"


def brittleness(tables: Tables) -> str:
    """What part of the spread perfect plasticity has, for the same draws."""
    out = []
    for kind in KINDS:
        brittle = study.running(tables[f"set4-{kind}"], "ultimate").variation[-1]
        plastic = study.running(tables[f"plastic-{kind}-associative"], "load").variation[-1]
        out.append(f"{100 * plastic:.1f} % where brittle joints have {100 * brittle:.1f} % ({kind})")
    return (
        f"**Geometry of the mechanism and brittleness.** Perfect plasticity at psi = phi has a CoV of {out[0]} and "
        f"{out[1]}. One draw for all moves every joint together and spreads in any law. A draw for every joint "
        "averages over the joints of a plastic mechanism; that brittle ones fail one after the other keeps the spread "
        "and lowers the mean."
    )


def judged(tables: Tables) -> str:
    """Sets 2 and 3 above the noise."""
    out = []
    for number in (2, 3):
        for kind in KINDS:
            found = noise(tables, number, kind)
            if found is None:
                continue
            own = study.running(tables[name_of(number, kind)], "ultimate")
            spread, error = own.variation[-1], own.variation[-1] * own.variation_error[-1]
            clear = (spread - found[0]) / math.hypot(error, found[1])
            verdict = "above it" if clear > 2.0 else "not clear of it"
            out.append(f"set {number} {kind} ({100 * spread:.1f} % beside {100 * found[0]:.1f} %) {verdict}")
    return f"Judged above the noise of a run: {'; '.join(out)}." if out else ""


def symmetry(tables: Tables) -> str:
    """Asymmetric runs of all spatial and all non-spatial cells together, in words."""
    out = []
    for kind in KINDS:
        lone = np.concatenate([tables[name_of(n, kind)]["lone"].astype(float) for n in (1, 2, 3, 4)])
        lone = lone[np.isfinite(lone)]
        out.append(f"{int((lone > ALONE).sum())} of {len(lone)} {kind}")
    return (
        f"Ours: {out[0]} and {out[1]} ones. A symmetric panel does not break quite symmetrically: joints that fail at "
        "the same load on both sides fail one after the other by rounding, and what follows leans to one side."
    )
