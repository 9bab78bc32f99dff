"""Tables of the page of the random panels: cells beside Table 4, laws, modes, cracks, noise; and its figure."""

import math
from collections import Counter
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import stats

import limitmason as lm
from limitmason import figures, study
from limitmason.experiments import stochastic_brick_panels as published

from .mean_set import CASES
from .runs import OWN_WEIGHT

Array = NDArray[np.float64]
Tables = Mapping[str, study.Table]

KINDS = ("spatial", "non-spatial")
CELLS = tuple((number, kind) for number in (1, 2, 3, 4) for kind in KINDS)
ALONE = 0.5
"""Part of the movement without mirror image from which a mechanism counts as asymmetric [-]."""
WALKED = (12, 24, 50, 100, 150, 200, 250, 300)


def name_of(number: int, kind: str) -> str:
    """Study of a cell."""
    return f"set{number}-{kind}"


def printed(number: int, kind: str) -> tuple[float, float]:
    """Mean [kN] and CoV [%] of Table 4."""
    mean, variation = lm.experiments.load(published.NAME, f"set-{number}-{kind}").published.values()
    return float(mean), float(variation)


def both(value: float, error: float, digits: int = 1) -> str:
    """A value with its sampling error."""
    return f"{value:.{digits}f} +- {error:.{digits}f}"


def cells(tables: Tables) -> list[list[str]]:
    """Mean and spread of every cell beside Table 4."""
    lines = [["set", "runs", "mean [kN]", "published", "CoV [%]", "published"]]
    for number, kind in CELLS:
        own = study.running(tables[name_of(number, kind)], "ultimate")
        mean, variation = printed(number, kind)
        value, spread = own.mean[-1] / 1e3, 100 * own.variation[-1]
        lines.append([
            f"{number} {kind}", f"{int(own.n[-1])}", both(value, value * own.mean_error[-1], 2), f"{mean:.2f}",
            both(spread, spread * own.variation_error[-1]), f"{variation:.1f}",
        ])
    return lines


def ratios(tables: Tables) -> list[list[str]]:
    """Spatial over non-spatial: CoV, with and without the noise of a run, and mean, beside Table 4."""
    lines = [["set", "ratio of CoV, noise of a run out", "with it", "published", "shift of the mean [%]", "published"]]
    for number in (1, 2, 3, 4):
        a, b = (study.running(tables[name_of(number, k)], "ultimate") for k in KINDS)
        (mean_a, cov_a), (mean_b, cov_b) = (printed(number, k) for k in KINDS)
        ratio = a.variation[-1] / b.variation[-1]
        error = ratio * math.hypot(a.variation_error[-1], b.variation_error[-1])
        shift = a.mean[-1] / b.mean[-1] - 1.0
        lines.append([
            f"{number}", ratio_without_noise(tables, number), both(ratio, error, 2), f"{cov_a / cov_b:.2f}",
            both(100 * shift, 100 * math.hypot(a.mean_error[-1], b.mean_error[-1])),
            f"{100 * (mean_a / mean_b - 1.0):+.1f}",
        ])
    return lines


def ratio_without_noise(tables: Tables, number: int) -> str:
    """Spatial over non-spatial CoV, of each of which the variance of a run is taken off, with its standard error."""
    left, relative = [], []
    for kind in KINDS:
        own, found = study.running(tables[name_of(number, kind)], "ultimate"), noise(tables, number, kind)
        spread, error = own.variation[-1], own.variation[-1] * own.variation_error[-1]
        value, uncertain, _ = found or (0.0, 0.0, 0)
        rest = spread**2 - value**2
        if rest <= 2.0 * math.hypot(spread * error, value * uncertain):
            return "not clear of the noise"
        left.append(math.sqrt(rest))
        relative.append(math.hypot(spread * error, value * uncertain) / rest)
    ratio = left[0] / left[1]
    return both(ratio, ratio * math.hypot(*relative), 2)


def noise(tables: Tables, number: int, kind: str) -> tuple[float, float, int] | None:
    """Noise of one run in a cell [-], its standard error and the pairs behind it.

    Runs of the same draws, strengths apart by a part in a million: root mean square difference over sqrt(2).
    """
    again = tables.get(f"{name_of(number, kind)}-nudged")
    if again is None or len(again) < 2:
        return None
    first = _same_samples(tables[name_of(number, kind)], again)
    square = ((again["ultimate"].astype(float) - first) / first) ** 2
    value = math.sqrt(float(square.mean()) / 2.0)
    return value, value / math.sqrt(2.0 * len(square)), len(square)


def _same_samples(table: study.Table, other: study.Table) -> Array:
    """Peaks of the samples of another table, within the first travel as there."""
    by = {r["sample"]: r["far"] if r["far"] == r["far"] else r["ultimate"] for r in table}
    return np.array([by[r["sample"]] for r in other])


def slowed(tables: Tables, number: int, kind: str) -> Array | None:
    """What a third of the speed changes of the peaks of a cell, over the same draws [-]; None where it was not run."""
    slow = tables.get(f"{name_of(number, kind)}-slow")
    if slow is None or len(slow) < 2:
        return None
    return np.asarray(slow["ultimate"].astype(float) / _same_samples(tables[name_of(number, kind)], slow) - 1.0)


def floors(tables: Tables) -> list[list[str]]:
    """What a single run is worth: noise, and what a third of the speed changes."""
    lines = [["set", "CoV [%]", "noise of a run [%]", "pairs", "CoV without it [%]", "a third of the speed [%]",
              "runs"]]
    for number, kind in CELLS:
        found, own = noise(tables, number, kind), study.running(tables[name_of(number, kind)], "ultimate")
        if found is None:
            continue
        value, error, pairs = found
        spread = own.variation[-1]
        change, text, runs = slowed(tables, number, kind), "", ""
        if change is not None:
            text = both(100 * change.mean(), 100 * change.std(ddof=1) / math.sqrt(len(change)))
            runs = f"{len(change)}"
        left = f"{100 * math.sqrt(spread**2 - value**2):.1f}" if spread > value else "none"
        lines.append([
            f"{number} {kind}", f"{100 * spread:.1f}", both(100 * value, 100 * error), f"{pairs}", left, text, runs,
        ])
    return lines


def correlation(table: study.Table) -> tuple[float, float, float, int]:
    """Rank correlation of first crack and peak, its 95 % interval and the runs that cracked."""
    crack, peak = table["crack"].astype(float), table["ultimate"].astype(float)
    seen = np.isfinite(crack) & np.isfinite(peak)
    rank = float(stats.spearmanr(crack[seen], peak[seen]).statistic)
    reach = 1.96 * 1.03 / math.sqrt(max(int(seen.sum()) - 3, 1))
    return rank, math.tanh(math.atanh(rank) - reach), math.tanh(math.atanh(rank) + reach), int(seen.sum())


def cracks(tables: Tables) -> list[list[str]]:
    """First crack beside failure."""
    lines = [["set", "first crack [kN]", "CoV [%]", "under own weight", "rank correlation with the peak",
              "95 % interval"]]
    for number, kind in CELLS:
        table = tables[name_of(number, kind)]
        own = study.running(table, "crack")
        rank, low, high, _ = correlation(table)
        failure = table["failure"].astype(float)
        known = failure[np.isfinite(table["lone"].astype(float))] == 0.0
        value = own.mean[-1] / 1e3
        lines.append([
            f"{number} {kind}", both(value, value * own.mean_error[-1], 2), f"{100 * own.variation[-1]:.0f}",
            f"{100 * known.mean():.0f} %" if len(known) else "", f"{rank:.2f}", f"{low:.2f} to {high:.2f}",
        ])
    return lines


def _shares(table: study.Table, column: str) -> list[tuple[str, float]]:
    """Share of each word of a column, the most frequent first."""
    words = Counter(str(row[column]) for row in table if row.get(column) is not None)
    return sorted(((name, k / words.total()) for name, k in words.items()), key=lambda s: (-s[1], s[0]))


def _percent(share: float) -> str:
    """In whole per cent, less than one with a decimal."""
    return f"{100 * share:.0f}" if share >= 0.01 else f"{100 * share:.1f}"


def modes(tables: Tables) -> list[list[str]]:
    """Modes by rule at the peak and at the end, and how many runs break asymmetrically."""
    lines = [["set", "mode at the peak", "mode at the end", "runs", "movement without mirror image",
              "asymmetric runs"]]
    for number, kind in CELLS:
        table = study.Table(tuple(
            r for r in tables[name_of(number, kind)] if math.isfinite(r["lone"]) or r["mode"] == OWN_WEIGHT
        ))
        if len(table) < 2:
            continue
        words = [
            ", ".join(f"{name} {_percent(share)} %" for name, share in _shares(table, column))
            for column in ("mode at peak", "mode")
        ]
        lone = table["lone"].astype(float)
        lone = lone[np.isfinite(lone)]  # what falls before it is pushed has no peak to look at
        many = stats.binomtest(int((lone > ALONE).sum()), len(lone))
        ends = many.proportion_ci(method="wilson")
        lines.append([
            f"{number} {kind}", *words, f"{len(lone)}",
            f"{np.mean(lone):.2f} (5 to 95 %: {np.quantile(lone, 0.05):.2f} to {np.quantile(lone, 0.95):.2f})",
            f"{100 * many.statistic:.0f} % ({100 * ends.low:.0f} to {100 * ends.high:.0f})",
        ])
    return lines


def convergence(tables: Tables) -> list[list[str]]:
    """Mean and CoV after so many runs, over what they are after all."""
    lines = [["set", *(f"{n}" for n in WALKED)]]
    for number, kind in CELLS:
        own = study.running(tables[name_of(number, kind)], "ultimate")
        cellsof = []
        for n in WALKED:
            if n > own.n[-1]:
                cellsof.append("")
                continue
            k = n - 2
            cellsof.append(f"{own.mean[k] / 1e3:.2f} kN, {100 * own.variation[k]:.1f} %")
        lines.append([f"{number} {kind}", *cellsof])
    return lines


def mean_set(table: study.Table) -> list[list[str]]:
    """What laws, outlines and the rest do to the mean panel."""
    lines = [["changed", "to", "peak [kN]", "runs", "at [mm]", "first crack [kN]", "mode at the peak"]]
    for number, case in enumerate(CASES):
        rows = [r for r in table if r["sample"] // 100 == number]
        if not rows:
            continue
        peaks, at, crack = (np.array([r[n] for r in rows], dtype=float) for n in ("ultimate", "at", "crack"))
        spread = f" ({peaks.min() / 1e3:.2f} to {peaks.max() / 1e3:.2f})" if len(rows) > 1 else ""
        lines.append([
            case.group, case.name, f"{peaks.mean() / 1e3:.2f}{spread}", f"{len(rows)}", f"{1e3 * at.mean():.2f}",
            f"{crack.mean() / 1e3:.2f}" if np.isfinite(crack).all() else "-", rows[0]["mode"] or "-",
        ])
    return lines


LAWS = (
    ("DEM, opening takes cohesion and tension", "set4-{}", "ultimate", 1e-3),
    ("DEM, opening takes tension, cohesion stays, to 1.5 mm", "set4-{}-kept", "ultimate", 1e-3),
    ("DEM, nothing is lost, to 1.5 mm", "set4-{}-nothing", "ultimate", 1e-3),
    ("limit analysis, psi = 0, smallest load that a quick search finds", "plastic-{}-non-associative", "load", 1.0),
    ("limit analysis, psi = phi", "plastic-{}-associative", "load", 1.0),
)
"""Law of set 4's joints, its study, column and unit over kN; the same draws in all."""


def laws(tables: Tables) -> list[list[str]]:
    """Set 4 under every law: mean, spread, their ratio, and how far a peak follows the brittle one of the same draw."""
    lines = [["joints", "runs", "mean spatial [kN]", "non-spatial", "CoV spatial [%]", "non-spatial", "ratio of CoV",
              "shift of mean [%]", "rank with the brittle peak, spatial", "non-spatial"]]
    for words, form, column, unit in LAWS:
        own = [tables.get(form.format(kind)) for kind in KINDS]
        if any(t is None or len(t) < 3 for t in own):
            continue
        a, b = (study.running(t, column) for t in own if t is not None)
        ratio = a.variation[-1] / b.variation[-1]
        error = ratio * math.hypot(a.variation_error[-1], b.variation_error[-1])
        ranks = []
        for kind, table in zip(KINDS, own, strict=True):
            assert table is not None
            first = {r["sample"]: r["ultimate"] for r in tables[f"set4-{kind}"]}
            pairs = np.array([(first[r["sample"]], r[column]) for r in table if r["sample"] in first])
            ranks.append("" if form == "set4-{}" else f"{stats.spearmanr(*pairs.T).statistic:.2f}")
        lines.append([
            words, f"{int(a.n[-1])} and {int(b.n[-1])}", f"{unit * a.mean[-1]:.2f}", f"{unit * b.mean[-1]:.2f}",
            *(both(100 * r.variation[-1], 100 * r.variation[-1] * r.variation_error[-1]) for r in (a, b)),
            both(ratio, error, 2), f"{100 * (a.mean[-1] / b.mean[-1] - 1):+.1f}", *ranks,
        ])
    (mean_a, cov_a), (mean_b, cov_b) = (printed(4, k) for k in KINDS)
    lines.append(["published", "300 and 300", f"{mean_a:.2f}", f"{mean_b:.2f}", f"{cov_a:.1f}", f"{cov_b:.1f}",
                  f"{cov_a / cov_b:.2f}", f"{100 * (mean_a / mean_b - 1):+.1f}", "", ""])
    return lines


def figure(tables: Tables) -> Figure:
    """Histograms of set 1, convergence of both cells, and first crack beside failure."""
    import matplotlib.pyplot as plt

    drawn, axes = plt.subplots(2, 2, figsize=(11.0, 7.4))
    kn = {kind: study.Table(tuple({k: r[k] / 1e3 for k in ("ultimate", "crack")} for r in tables[name_of(1, kind)]))
          for kind in KINDS}
    tests = [float(lm.experiments.load("brick-panels-opening", f"S{k}").measured["failure load"]) for k in range(1, 5)]
    figures.histogram(kn, "ultimate", label="ultimate load [kN]", measured=tests, title="Set 1", ax=axes[0, 0])
    for ax, kind in zip(axes[1], KINDS, strict=True):
        own = study.running(kn[kind], "ultimate")
        for name, value, error in (("mean", own.mean, own.mean_error), ("CoV", own.variation, own.variation_error)):
            label = f"{name}, {value[-1]:.4g} at the end"
            (line,) = ax.plot(own.n[5:], value[5:] / value[-1], linewidth=1.1, label=label)
            ax.fill_between(own.n[5:], 1 - error[5:], 1 + error[5:], color=line.get_color(), alpha=0.15, linewidth=0)
        ax.set(xlabel="runs [-]", ylabel="ultimate load: value over its last [-]", title=f"Set 1, {kind}")
        ax.legend(frameon=False, fontsize="small")
    for kind, marker in zip(KINDS, "ox", strict=True):
        at, peak = (kn[kind][name].astype(float) for name in ("crack", "ultimate"))
        axes[0, 1].plot(at, peak, marker, markersize=3, label=kind, linestyle="none")
    axes[0, 1].set_xlabel("load at the first crack of 0.15 mm [kN]")
    axes[0, 1].set_ylabel("ultimate load [kN]")
    axes[0, 1].legend(frameon=False, fontsize="small")
    drawn.tight_layout()
    return drawn
