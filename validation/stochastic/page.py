"""The page of the random panels: tables, and the sentences whose numbers come from them."""

import math

import numpy as np

from limitmason import build, study
from limitmason.display.text_table import filled, markdown
from limitmason.experiments import stochastic_brick_panels as published
from limitmason.model import Assembly, Joint, Loads

from . import pace, readings_page
from .runs import OWN_WEIGHT, draws
from .study import SEED
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
    slowed,
)
from .text import REPEATED, REPEATS, TEXT, TIME


def page(tables: Tables) -> str:
    """The whole page."""
    counts = [len(tables[name_of(*c)]) for c in CELLS]
    mean_rows = [r for r in tables["mean-set"] if r["sample"] // 100 == 0]
    kept = tables["set4-spatial-kept"]
    words = {
        "runs": counted(counts),
        "slopes": slopes(tables), "settled": settled(tables), "agreement": agreement(tables),
        "fallen": fallen(tables), "independent": independent(tables),
        "brittleness": brittleness(tables),
        "kept_rise": f"with cohesion kept, {_late(kept)} of {len(kept)} spatial runs have their largest after 1.4 mm",
        "mean_set": f"{np.mean([r['ultimate'] for r in mean_rows]) / 1e3:.1f}",
        "floor": spread_of(tables["floor"]), "third": spread_of(tables["floor-third"]), "judged": judged(tables),
        "repeated": REPEATED, "alone": f"{ALONE:g}", "symmetry": symmetry(tables), "time": TIME,
        "repeats": REPEATS, "slower": slower(tables),
    }
    parts = {
        "ratios": ratios(tables), "cells": cells(tables), "laws": laws(tables),
        "mean set": mean_set(tables["mean-set"]), "floor": floors(tables), "cracks": cracks(tables),
        "modes": modes(tables), "convergence": convergence(tables),
        "pace": pace.table(),
    }
    found = {name: markdown(lines) for name, lines in parts.items()}
    return filled(TEXT.format(**words), {**found, "readings": readings_page.section(readings_page.read())})


def counted(counts: list[int]) -> str:
    """How many runs a cell has, beside the published number."""
    if min(counts) >= published.RUNS:
        return f"{min(counts)} runs a cell, as published"
    many = f"{counts[0]}" if len(set(counts)) == 1 else f"{min(counts)} to {max(counts)}"
    return f"{many} runs a cell, not {published.RUNS}"


def inputs(number: int, runs: int) -> study.Table:
    """What was drawn for all joints at once; draws know seed, number and name alone, so that a pair of bricks will do.

    Parameters
    ----------
    number : of the set
    runs : how many
    """
    law = Joint(30.0, cohesion=1e4, tensile_strength=1e4, normal_stiffness=1e10, shear_stiffness=1e10)
    pair = build.wall(length=0.2, courses=2, unit=(0.2, 0.1, 0.1), joint=law)
    return study.monte_carlo(
        (pair, Loads.weight), runs, run=_nothing, seed=SEED, scheme="random", **draws(number, False)
    )


def _nothing(assembly: Assembly, loads: Loads) -> dict[str, float]:
    return {}


def slopes(tables: Tables) -> str:
    """Log-slopes of the peak of set 4 with one draw for all, and the spread that they give to first order.

    CoV = sqrt(sum (slope CoV of the draw)^2); cohesion follows strength and friction
    """
    table = tables[name_of(4, KINDS[1])]
    drawn = inputs(4, len(table))
    peak = table["ultimate"].astype(float)
    names = ("tensile_strength", "friction_angle_deg")
    given = np.column_stack([drawn[n].astype(float) for n in names])
    stood = peak > 0.0
    design = np.column_stack([np.ones(stood.sum()), np.log(given[stood])])
    found = np.linalg.lstsq(design, np.log(peak[stood]), rcond=None)[0][1:]
    spread = given.std(axis=0, ddof=1) / given.mean(axis=0)
    first = float(np.hypot(*(found * spread)))
    half = np.median(given[:, 0])
    low, high = (
        np.polyfit(np.log(given[part & stood, 0]), np.log(peak[part & stood]), 1)[0]
        for part in (given[:, 0] < half, given[:, 0] >= half)
    )
    own, (_, paper) = study.running(table, "ultimate").variation[-1], printed(4, KINDS[1])
    return (
        f"set 4 has {100 * own:.1f} % where {paper:.1f} % is printed. Its log-slopes over its own runs are "
        f"{found[0]:.2f} for ft with the cohesion that follows it and {found[1]:.2f} for phi. They give "
        f"{100 * first:.1f} % as the root of the sum of squares. For ft the slope is {low:.2f} below the median "
        f"strength and {high:.2f} above: weak panels come near to falling under their own weight"
    )


def settled(tables: Tables) -> str:
    """How far means and spreads still move at the end."""
    means, spreads = [], []
    for number, kind in CELLS:
        own = study.running(tables[name_of(number, kind)], "ultimate")
        if own.n[-1] < published.RUNS:
            return ""
        before = published.RUNS - 50 - 2
        means.append(abs(own.mean[-1] / own.mean[before] - 1.0))
        spreads.append(abs(own.variation[-1] / own.variation[before] - 1.0))
    return (
        f" From 250 to 300 runs no mean moves by more than {100 * max(means):.1f} %, no CoV by more than "
        f"{100 * max(spreads):.0f} % of itself."
    )


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
    return f"Ratios of CoV are off the published ones by these sampling errors: {', '.join(out)}."


def fallen(tables: Tables) -> str:
    """Runs that fall under their own weight, and the spread of the cells that have some without them."""
    out = []
    for number, kind in CELLS:
        table = tables[name_of(number, kind)]
        stood = study.Table(tuple(r for r in table if r["mode"] != OWN_WEIGHT))
        if gone := len(table) - len(stood):
            own = study.running(stood, "ultimate")
            out.append(
                f"In set {number} {kind} this holds for {gone} of {len(table)} runs. The others have a mean of "
                f"{own.mean[-1] / 1e3:.2f} kN and a CoV of {100 * own.variation[-1]:.1f} %."
            )
    if not out:
        return "No panel of these falls under its own weight."
    return (
        f"Panels that fall under their own weight count as runs that carry nothing. {' '.join(out)} How the weight "
        "comes on decides whether the weakest draws stand. Here it is there at once, with the motion damped."
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
    out, quick = [], []
    for kind in KINDS:
        table = tables[f"plastic-{kind}-associative"]
        same = {r["sample"] for r in table}
        brittle = study.running(
            study.Table(tuple(r for r in tables[f"set4-{kind}"] if r["sample"] in same)), "ultimate"
        ).variation[-1]
        plastic = study.running(table, "load")
        own = plastic.variation[-1]
        out.append(
            f"The {kind} CoV is {100 * own:.1f} % where brittle joints have {100 * brittle:.1f} % (the same "
            f"{int(plastic.n[-1])} draws, {100 * (own / brittle) ** 2:.0f} % of the variance)."
        )
        searched = study.running(tables[f"plastic-{kind}-non-associative"], "load")
        quick.append(f"{100 * searched.variation[-1]:.1f} % ({kind}, {int(searched.n[-1])} draws)")
    return (
        "**Geometry of the mechanism and brittleness.** Perfect plasticity at psi = phi spreads less. "
        f"{' '.join(out)} At psi = 0 it is {quick[0]} and {quick[1]}. One draw for all moves every joint together and "
        "spreads in any law. A draw for every joint averages over the joints of a plastic mechanism. Brittle ones fail "
        "one after the other, which keeps the spread and lowers the mean."
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
            out.append(f"- set {number} {kind}: {100 * spread:.1f} % beside {100 * found[0]:.1f} %, {verdict}")
    return "\n".join(["Spread beside the noise of a run:", "", *out]) if out else ""


def slower(tables: Tables) -> str:
    """What a third of the speed does to the peaks of all cells together."""
    found = [c for number, kind in CELLS if (c := slowed(tables, number, kind)) is not None]
    if not found:
        return "No draw was run slower."
    change = np.concatenate(found)
    return (
        f"At a third of the speed {len(change)} of these panels peak {100 * change.mean():+.1f} +- "
        f"{100 * change.std(ddof=1) / math.sqrt(len(change)):.1f} % beside the speed of the study. Its means are too "
        "large by about that, spatial and non-spatial ones alike."
    )


def symmetry(tables: Tables) -> str:
    """Asymmetric runs of all spatial and all non-spatial cells together, in words."""
    out = []
    for kind in KINDS:
        lone = np.concatenate([tables[name_of(n, kind)]["lone"].astype(float) for n in (1, 2, 3, 4)])
        lone = lone[np.isfinite(lone)]
        out.append(f"{int((lone > ALONE).sum())} of {len(lone)} {kind}")
    return (
        f"Ours: {out[0]} and {out[1]} ones. A symmetric panel does not break quite symmetrically. By rounding, joints "
        "that fail at the same load on both sides fail one after the other. What follows leans to one side."
    )
