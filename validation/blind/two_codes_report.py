"""The report of the trials across two codes: the null between them first, then what was found and missed."""

from collections import Counter
from datetime import UTC, datetime

import numpy as np

import dem
from dem.model.joints import JointOptions
from limitmason.diagnosis import binomial_interval

from . import score, small_walls
from . import two_codes_trials as two_codes
from .small_walls import DEM, LIMIT, SPECIMENS

NARROW = {"error_budget": (), "tolerance": 3e-4}
TRIED = {
    "bracket a tenth": {"contact_points": (3, 2)},
    "bracket a tenth, joints 10 times as stiff": {
        "contact_points": (3, 2), "joint_options": JointOptions(stiffness_factor=10.0),
    },
    "bracket a tenth, 4 x 8 points": {"contact_points": (4, 8)},
    "bracket a tenth, 2 x 2 points": {"contact_points": (2, 2)},
}


def text(records, seed, seconds):
    """The report as markdown."""
    blocks = [int((~small_walls.build(s)[0].fixed).sum()) for s in SPECIMENS]
    at = Counter(k[0] for k in two_codes.codes()[DEM].values)
    limit, distinct = (", ".join(f"{k}={v!r}" for k, v in small_walls.OPTIONS[c].items()) for c in (LIMIT, DEM))
    return "\n".join([
        "# Blind trials across two codes",
        "",
        f"{datetime.now(UTC).date()}, seed {seed}, {seconds:.0f} s. {len(SPECIMENS)} specimens of {min(blocks)} to "
        f"{max(blocks)} blocks "
        f"(stacks, strips, walls in plane, sliders), {len(two_codes.CAUSES)} causes, noise "
        f"{100 * two_codes.NOISE:.0f} %, friction {small_walls.FRICTION} +- {small_walls.FRICTION_ERROR} "
        "(all assumed). "
        f"Stored values: {at[DEM]} of `dem.collapse({distinct})`, {at[LIMIT]} of `limit_analysis({limit})`. Like with "
        "like: every joint has psi = phi, where the multiplier is unique and the same in theory for both codes. "
        "Written by `python -m validation.blind.two_codes`.",
        "",
        *_null(),
        *_why(),
        *[line for code, record in records.items() for line in _trials(code, record)],
        *_drawn(),
        "",
    ])


def _null():
    sharp = {z: two_codes.difference(z=z) for z in two_codes.FRICTIONS}
    both, error = two_codes.codes(), two_codes.method_error()
    largest = max(np.abs(d).max() for d in sharp.values())
    lines = [
        "## First the null: the codes without any effect",
        "",
        f"DEM over limit analysis, {len(SPECIMENS)} specimens at {len(sharp)} frictions: {100 * error:.2f} % root mean "
        f"square, {100 * largest:.2f} % largest. The root mean square is declared as the method error on top of the "
        "noise.",
        "",
        "| specimen | limit analysis | DEM | difference | "
        + " | ".join(f"at {z:+.0f} sd of friction" for z in sharp if z)
        + " |",
        "|---|---|---|---|" + "---|" * (len(sharp) - 1),
    ]
    for i, s in enumerate(SPECIMENS):
        values = [both[c](s) for c in (LIMIT, DEM)]
        cells = [f"{100 * d[i]:+.2f} %" for z, d in sharp.items() if z]
        lines.append(f"| {s['name']} | {values[0]:.4f} | {values[1]:.4f} | {100 * sharp[0.0][i]:+.2f} % | "
                     + " | ".join(cells) + " |")
    lines += ["", "With an effect switched on in both codes, at every planted size:", "",
              "| cause | sizes | rms | largest | in | at size |", "|---|---|---|---|---|---|"]
    for name, sizes in two_codes.ready(LIMIT).sizes.items():
        sizes = [x for x in sizes if both[DEM].knows(_cause(name), x, (0.0,)) and not _cause(name).transforms]
        if sizes:
            d = np.array([two_codes.difference((name,), (x,)) for x in sizes])
            row, column = np.unravel_index(np.abs(d).argmax(), d.shape)
            lines.append(
                f"| {name} | {len(sizes)} | {100 * np.sqrt((d**2).mean()):.2f} % | {100 * d[row, column]:+.2f} % | "
                f"{SPECIMENS[column]['name']} | {sizes[row]:g} |"
            )
    return [*lines, ""]


def _cause(name):
    return next(c for c in two_codes.CAUSES if c.name == name)


def _why():
    """The sharp specimens computed again: what the difference between the codes is made of."""
    lines = ["Where the difference comes from (lower end of the bracket over limit analysis, computed anew):",
             "", "| specimen | " + " | ".join(TRIED) + " |", "|---|" + "---|" * len(TRIED)]
    table = []
    for s in SPECIMENS:
        exact = two_codes.codes()[LIMIT](s)
        table.append(
            [
                dem.collapse(*small_walls.build(s), **NARROW, **o).collapse_multiplier / exact - 1.0
                for o in TRIED.values()
            ]
        )
        lines.append(f"| {s['name']} | " + " | ".join(f"{100 * v:+.3f} %" for v in table[-1]) + " |")
    rms = np.sqrt((np.array(table) ** 2).mean(axis=0))
    return [*lines, "| rms | " + " | ".join(f"{100 * v:.3f} %" for v in rms) + " |", ""]


def _trials(code, record):
    lines = [f"## {two_codes.SPOKEN[code].capitalize().replace('dem', 'DEM')}", "",
             "| class | required | measured | 95 % interval | trials | |", "|---|---|---|---|---|---|"]
    for label, required, rate, low, high, holds in score.requirements(record.sheet):
        n = record.sheet.trials(label)
        lines.append(
            f"| {label} | {required} | {100 * rate:.1f} % | {100 * low:.1f} to {100 * high:.1f} % | {n} | "
            f"{'holds' if holds else '**falls short**'} |"
        )
    if record.size_errors:
        median, n = float(np.median(record.size_errors)), len(record.size_errors)
        lines.append(f"| size of a named cause | median error <= 15 % | {100 * median:.1f} % | | {n} | "
                     f"{'holds' if median <= 0.15 else '**falls short**'} |")
        low, high = binomial_interval(int(np.sum(record.covered)), n)
        lines += ["", f"95 % interval of a named size holds the truth: {100 * np.mean(record.covered):.1f} % "
                  f"({100 * low:.1f} to {100 * high:.1f} %) of {n}."]
    lines += ["", record.sheet.text(), "", "The same trials judged by broken rules:", ""]
    for name, sheet in record.broken.items():
        held = score.requirements(sheet)
        failed = [f"{a}: {b}" for a, b, *_, holds in held if not holds]
        lines.append(f"- {name}: fails {len(failed)} of {len(held)} ({'; '.join(failed)})")
    if record.missed:
        lines += ["", "Missed or wrong (hidden, size, d2, outcome, answer):", ""]
        lines += [
            f"- {n}, {x:g}, d2 {d:g}: {o}{' (' + ', '.join(c) + ')' if c else ''}" for n, x, d, o, c in record.missed
        ]
    return [*lines, ""]


def _drawn():
    lines = [
        "## What could be planted",
        "",
        "d2 of the candidates at the sizes of their tables: clear 25 to 150, middle 9 to 25, both also from the "
        "baseline. A cause is drawn first, then a size; the true friction is -2, 0 or 2 standard deviations from the "
        "measured one with chances 1/8, 3/4, 1/8 (mean and variance of the normal distribution).",
        "",
        "| truth in | class | cause: sizes |",
        "|---|---|---|",
    ]
    for code, candidates in two_codes.CANDIDATES.items():
        where = two_codes.ready(candidates)
        for kind in ("clear", "middle"):
            rows = two_codes.choices(two_codes.codes()[code], where, kind)
            shown = "; ".join(f"{n}: {', '.join(f'{where.sizes[n][r]:.4g}' for r in rr)}" for n, rr in rows.items())
            lines.append(f"| {code} | {kind} | {shown} |")
    return lines
