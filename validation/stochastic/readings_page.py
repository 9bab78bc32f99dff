"""The two readings on the page: which pair meets the printed spreads, how the panels break, and the fans of curves."""

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from limitmason import study
from limitmason.display.text_table import markdown
from limitmason.storage.csv_table import parsed, write_table

from .readings import AGAIN, KEPT, SHARING, name_of
from .rows import STORED, read_store
from .rows import read as read_rows
from .tables import both, printed

Array = NDArray[np.float64]
LINES, CURVES = (STORED.with_name(f"stochastic_{name}.csv") for name in ("readings", "fans"))
PLACES = ("between soldiers", "heads above", "beds above", "beds over piers", "beds of piers", "soldier at pier")
UNITS = {"set": "-", "drawn": "-", "keeps": "-", "again": "-", "sample": "-", "ultimate": "N", "at": "um", "left": "-",
         "most": "-", **dict.fromkeys(PLACES, "um")}
GRID = np.linspace(0.0, 1.5e-3, 31)
FANS = tuple((4, sharing, kept) for sharing in SHARING[1:] for kept in (0.0, 0.1))
ONE_SIDE = 0.6
"""Part of the movement on one half of the panel from which a run counts as that side's [-]."""
RUNS_OF_PRINT = 300


def fold(store: Path) -> None:
    """Keep a line of every run in a folder, and the curves of some cells; what it does not hold stays as it is kept."""
    lines = {tuple(r[:5]): r for r in _kept(LINES)}
    curves = {tuple(r[:3]): r for r in _kept(CURVES)}
    for number in (3, 4):
        for kept in KEPT:
            for sharing in SHARING:
                for again in ("", AGAIN):
                    path = store / f"{name_of(number, sharing, kept)}{again}.jsonl"
                    for sample, row in sorted(read_store(path).items()) if path.exists() else ():
                        key = f"{number}", sharing, f"{kept:g}", f"{int(bool(again))}", f"{sample}"
                        lines[key] = [*key, *_line(row)]
                        if (number, sharing, kept) in FANS and not again and "curve" in row:
                            loads = np.interp(GRID, *row["curve"])
                            shown = sharing, f"{kept:g}", f"{sample}"
                            curves[shown] = [*shown, *(f"{v:.0f}" for v in loads)]
    write_table(LINES, UNITS, list(lines.values()))
    grid = {f"{1e3 * u:.2f} mm": "N" for u in GRID}
    write_table(CURVES, {"drawn": "-", "keeps": "-", "sample": "-", **grid}, list(curves.values()))


def _kept(path: Path) -> list[list[str]]:
    """Rows of a kept table, none where it is not there yet."""
    return [list(r) for r in parsed(path.read_text(encoding="utf-8"), path.name).rows] if path.exists() else []


def _line(row: dict[str, Any]) -> list[str]:
    """Peak, side, the place that moves most, and the displacement at which every place first moves."""
    if "left" not in row:  # falls under its own weight
        return [f"{row['ultimate']:.1f}", "0", *[""] * (2 + len(PLACES))]
    first = (row[f"{p}: first at"] for p in PLACES)
    most = max(PLACES, key=lambda p: row[f"{p}: part"])
    return [f"{row['ultimate']:.1f}", f"{1e6 * row['at']:.0f}", f"{row['left']:.2f}", most,
            *("" if v is None else f"{1e6 * v:.0f}" for v in first)]


def read(path: Path = LINES) -> list[dict[str, str]]:
    """What is kept."""
    kept = parsed(path.read_text(encoding="utf-8"), path.name)
    return [dict(zip(kept.header, cells, strict=True)) for cells in kept.rows]


class Cell:
    """The runs of one reading.

    Parameters
    ----------
    lines : all that are kept
    number, sharing, kept : of the set, what is drawn, share of the cohesion that failed joints keep
    """

    def __init__(self, lines: Sequence[dict[str, str]], number: int, sharing: str, kept: float) -> None:
        own = [r for r in lines if (r["set"], r["drawn"], float(r["keeps"])) == (f"{number}", sharing, kept)]
        self.rows = [r for r in own if r["again"] == "0"]
        by = {r["sample"]: float(r["ultimate"]) for r in self.rows}
        pairs = [(by[r["sample"]], float(r["ultimate"])) for r in own if r["again"] == "1" and r["sample"] in by]
        change = np.array([b / a - 1.0 for a, b in pairs if a > 0.0 and b > 0.0])
        self.pairs = len(change)
        self.noise = float(np.sqrt(np.mean(change**2) / 2.0)) if len(change) > 1 else 0.0
        peaks = study.Table(tuple({"ultimate": float(r["ultimate"])} for r in self.rows))
        walk = study.running(peaks, "ultimate")
        self.mean, self.mean_error = float(walk.mean[-1]), float(walk.mean_error[-1])
        raw, error = float(walk.variation[-1]), float(walk.variation[-1] * walk.variation_error[-1])
        self.raw = raw
        self.variation = math.sqrt(max(raw**2 - self.noise**2, 0.0))
        # of a spread that the noise hides, the root of the error of its square
        self.error = min(error * raw / max(self.variation, 1e-9), math.sqrt(2.0 * raw * error))

    def __len__(self) -> int:
        return len(self.rows)


def cells(lines: Sequence[dict[str, str]], number: int) -> dict[tuple[str, float], Cell]:
    """Cells of a set that have runs."""
    known = {(r["drawn"], float(r["keeps"])) for r in lines if r["set"] == f"{number}" and r["again"] == "0"}
    return {(s, k): Cell(lines, number, s, k) for k in KEPT for s in SHARING if (s, k) in known}


def against(
    own: dict[tuple[str, float], Cell], number: int, sharing: str, kept: float
) -> dict[str, tuple[float, float, float]]:
    """Ours, print, and the distance in standard errors of both, of a pair's two spreads and of its shift."""
    a, b = own[sharing, kept], own[SHARING[2], kept]
    (mean_a, cov_a), (mean_b, cov_b) = (printed(number, k) for k in ("spatial", "non-spatial"))
    shift, print_shift = 100.0 * (a.mean / b.mean - 1.0), 100.0 * (mean_a / mean_b - 1.0)
    of_print = math.hypot(cov_a, cov_b) / math.sqrt(RUNS_OF_PRINT)
    of_shift = math.hypot(100.0 * math.hypot(a.mean_error, b.mean_error), of_print)
    return {
        **{name: (100.0 * c.variation, cov, abs(100.0 * c.variation - cov)
                  / math.hypot(100.0 * c.error, cov / math.sqrt(2.0 * RUNS_OF_PRINT)))
           for name, c, cov in (("spatial", a, cov_a), ("non-spatial", b, cov_b))},
        "shift": (shift, print_shift, abs(shift - print_shift) / of_shift),
    }


def table(lines: Sequence[dict[str, str]], number: int) -> list[list[str]]:
    """Every pair beside print."""
    own = cells(lines, number)
    out = [["failed joints keep", "drawn", "runs", "mean [kN]", "CoV [%]", "noise of a run [%]", "one for all: runs",
            "mean [kN]", "CoV [%]", "shift of the mean [%]", "off by (standard errors)"]]
    for sharing, kept in own:
        if sharing == SHARING[2] or (SHARING[2], kept) not in own:
            continue
        a, b = own[sharing, kept], own[SHARING[2], kept]
        found = against(own, number, sharing, kept)
        out.append([
            f"{kept:g} c", sharing, f"{len(a)}", both(1e-3 * a.mean, 1e-3 * a.mean * a.mean_error, 2),
            both(100.0 * a.variation, 100.0 * a.error), f"{100.0 * a.noise:.1f}" if a.pairs > 1 else "not run",
            f"{len(b)}", both(1e-3 * b.mean, 1e-3 * b.mean * b.mean_error, 2),
            both(100.0 * b.variation, 100.0 * b.error) + ("" if b.variation > b.error else ", not clear of noise"),
            both(found["shift"][0], 100.0 * math.hypot(a.mean_error, b.mean_error)),
            ", ".join(f"{away:.1f}" for _, _, away in found.values()),
        ])
    (mean_a, cov_a), (mean_b, cov_b) = (printed(number, k) for k in ("spatial", "non-spatial"))
    out.append(["printed", "", f"{RUNS_OF_PRINT}", f"{mean_a:.2f}", f"{cov_a:.1f}", "", f"{RUNS_OF_PRINT}",
                f"{mean_b:.2f}", f"{cov_b:.1f}", f"{100.0 * (mean_a / mean_b - 1.0):+.1f}", ""])
    return out


def verdict(lines: Sequence[dict[str, str]], number: int = 4) -> str:
    """Whether one pair meets spreads and shift together, within two standard errors."""
    own = cells(lines, number)
    pairs = [(s, k) for s, k in own if s != SHARING[2] and (SHARING[2], k) in own]
    far = {p: against(own, number, *p) for p in pairs}
    met = [p for p in pairs if max(away for _, _, away in far[p].values()) < 2.0]
    level = printed(number, "spatial")[0]
    if not met:
        s, k = min(pairs, key=lambda p: max(away for _, _, away in far[p].values()))
        nearest = ", ".join(f"{name} {ours:.1f} ({text:.1f})" for name, (ours, text, _) in far[s, k].items())
        return (f"**No pair meets both printed spreads and the shift.** Nearest is {s} with {k:g} c kept: {nearest}. "
                f"The mean is {1e-3 * own[s, k].mean:.2f} kN for {level:.2f}.")
    words = []
    for s, k in met:
        near = ", ".join(f"{name} {ours:.1f} ({text:.1f})" for name, (ours, text, _) in far[s, k].items())
        mean = f"mean {1e-3 * own[s, k].mean:.2f} ({level:.2f}) kN"
        worst, away = max(((name, v[2]) for name, v in far[s, k].items()), key=lambda v: v[1])
        words.append(f"- {s[0].upper()}{s[1:]} with {k:g} c kept: {near} %, {mean}. "
                     f"The farthest is {worst}, by {away:.1f} standard errors.")
    many = "One pair meets" if len(met) == 1 else f"{len(met)} pairs meet"
    head = f"**{many} both printed spreads and the shift within two standard errors, of {len(pairs)}.**"
    return "\n\n".join([head, "\n".join(words)])


def breaks(lines: Sequence[dict[str, str]]) -> list[list[str]]:
    """How the panels of set 4 break, by side, corner and place."""
    out = [["failed joints keep", "drawn", "left, both, right [%]", "a soldier slides at a corner [%]",
            "moves most at the peak [%]", "moves first [%]", "second [%]"]]
    for (sharing, kept), cell in cells(lines, 4).items():
        rows = [r for r in cell.rows if r["left"]]
        side = np.array([float(r["left"]) for r in rows])
        sides = [(side >= ONE_SIDE).mean(), ((side < ONE_SIDE) & (side > 1.0 - ONE_SIDE)).mean(),
                 (side <= 1.0 - ONE_SIDE).mean()]
        corner = np.mean([bool(r[PLACES[-1]]) and float(r[PLACES[-1]]) <= float(r["at"]) for r in rows])
        order = [[p for _, p in sorted((float(r[p]), p) for p in PLACES if r[p])] for r in rows]
        out.append([
            f"{kept:g} c", sharing, ", ".join(f"{100 * v:.0f}" for v in sides), f"{100 * corner:.0f}",
            _counted([r["most"] for r in rows]), *(_counted([o[k] for o in order if len(o) > k]) for k in (0, 1)),
        ])
    return out


def _counted(words: Sequence[str]) -> str:
    return ", ".join(f"{name} {100 * n / len(words):.0f}" for name, n in Counter(words).most_common(3))


def _of_set_3(lines: Sequence[dict[str, str]]) -> list[str]:
    """Its verdict and table, or that it has no pair yet."""
    found = table(lines, 3)
    if len(found) > 2:
        return ["Set 3 (stiffness of joints):", "", verdict(lines, 3), "", *markdown(found), ""]
    return ["Set 3 has no whole pair yet: what stands of it below is of the page's own runs.", ""]


def _of_the_weakest(lines: Sequence[dict[str, str]]) -> str:
    """What single weak panels do to a spread where failed joints keep nothing."""
    own = Cell(lines, 4, SHARING[1], 0.0)
    peaks = np.array([float(r["ultimate"]) for r in own.rows])
    page = read_rows()["set4-spatial"]["ultimate"]

    def spread(values: Array) -> str:
        return f"{100.0 * values.std(ddof=1) / values.mean():.1f}"

    return (f"- Where nothing is kept one panel decides: of {len(own)} runs with one draw a joint the spread is "
            f"{spread(peaks)} %, and {spread(np.sort(peaks)[1:])} without the weakest. The page's own {len(page)} runs "
            f"have {spread(page)} %, their first {len(own)} {spread(page[: len(own)])}.")


def section(lines: Sequence[dict[str, str]]) -> list[str]:
    """What the page says of the two readings."""
    sizes = [len(c) for c in cells(lines, 4).values()]
    many = f"{min(sizes)}" if min(sizes) == max(sizes) else f"{min(sizes)} to {max(sizes)}"
    return [
        "## What a joint is when it is drawn, and what failed joints keep", "",
        verdict(lines), "",
        "The text says neither. A joint between two bricks may be drawn once, or once for each of its two contacts. "
        "Residual strengths have a symbol and no value. Both move the spread, so both were run on the same random "
        f"numbers. Set 4 (strengths) has {many} runs a cell.", "",
        "- Every joint is in two halves in all cells. Own weight comes on sound joints. Runs end at 1.5 mm.",
        "- The noise of a run is taken out of a CoV where it was run.",
        "- The pairs were chosen before they were run, and all are shown. Of eight, one may agree by chance.",
        "- The spreads are met well. The shift is met barely: with 40 draws it was nearer to print than with more.", "",
        "Set 4. *Off by*: CoV, CoV of one draw for all, shift, each in standard errors of both sides. Below 2 is "
        "agreement.", "", *markdown(table(lines, 4)), "", *_of_set_3(lines),
        "- With nothing kept a draw a joint spreads too much, with a half too little. The print lies between.",
        "- One draw for all asks for a residual cohesion too: with none its spread is far too large.",
        _of_the_weakest(lines),
        "- **No pair meets the level.** Means lie a fifth to a third below print. Outline, damping and dilation move "
        "them, and none of the three is printed.", "",
        "### How they break", "",
        "The paper shows five pictures. They tell whether a soldier shears, at which corner, and whether the base "
        f"does. A run counts as one side's where {100 * ONE_SIDE:.0f} % of opening and slip at the peak lie there. A "
        "place moves from 0.05 mm on.", "", *markdown(breaks(lines)), "",
        "- Most spatial panels break to one side, as all of the paper's do.",
        "- With one draw for all many do so too. A symmetric panel that breaks at once is decided by rounding.",
        "- Soldiers move first, as the paper says. Head and bed joints above follow, and the piers' beds after them.",
        "- The five shares of the paper are in a figure that is not at hand, so that they cannot be compared.", "",
        "### Fans of curves", "",
        "![curves of set 4 with nothing and a tenth of the cohesion kept](stochastic-fans.png)", "",
    ]


def fans() -> Figure:
    """Curves of all runs of some cells, with their 5, 50 and 95 %."""
    kept = parsed(CURVES.read_text(encoding="utf-8"), CURVES.name)
    page = Figure(figsize=(10.0, 6.6), dpi=130)
    axes = page.subplots(2, 2, sharex=True, sharey=True).T.ravel()
    for ax, (number, sharing, share) in zip(axes, FANS, strict=True):
        own = np.array([[float(v) for v in c[3:]] for c in kept.rows if c[0] == sharing and float(c[1]) == share])
        if not len(own):
            continue
        ax.plot(1e3 * GRID, 1e-3 * own.T, color="0.75", linewidth=0.5)
        for part, style in ((0.05, ":"), (0.5, "-"), (0.95, ":")):
            ax.plot(1e3 * GRID, 1e-3 * np.quantile(own, part, axis=0), "k", linestyle=style, linewidth=1.4)
        ax.set_title(f"set {number}, {sharing}, {share:g} c kept: {len(own)} runs", fontsize="medium")
        ax.set(ylim=(0.0, 7.0), xlim=(0.0, 1.5))
    for ax in axes[1::2]:
        ax.set_xlabel("displacement of the spreader beyond own weight [mm]")
    for ax in axes[:2]:
        ax.set_ylabel("load [kN]")
    page.suptitle("Grey: runs. Black: 5, 50 and 95 % of them.", fontsize="small")
    page.tight_layout()
    return page
