"""Stiffness of the measured walls: elastic over measured, laws with campaigns left out, and their figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from limitmason.experiments import registry
from limitmason.experiments.modern_walls import NAME, value
from limitmason.experiments.modern_walls.inputs import inputs_of
from validation.wall_causes import MODULUS_AT, STIFFNESS, responses, stiffness
from validation.wall_figures import save
from validation.wall_loop import scatter

Array = NDArray[np.float64]
EN_1998 = 0.5  # share of the uncracked stiffness, EN 1998-1, 4.3.1(7)


class Stiff(NamedTuple):
    """Walls with a bilinear curve: number, campaign, ln(elastic / measured), ln(3 s0 / fc), whether E is of a code."""

    walls: list[str]
    campaigns: list[str]
    logs: Array
    pressed: Array
    of_code: NDArray[np.bool_]


def stiff_walls() -> Stiff:
    """All walls with a response, a shear span and a bilinear curve."""
    walls, campaigns, logs, pressed, of_code = [], [], [], [], []
    for wall, response in responses().items():
        test = registry.load(NAME, wall)
        if test.no_model or not np.isfinite(response[STIFFNESS]):
            continue
        walls.append(wall)
        campaigns.append(test.row["campaign"])
        logs.append(np.log(stiffness(test) / response[STIFFNESS]))
        pressed.append(np.log(value(test, "sigma0") / (MODULUS_AT * inputs_of(test.row)["fc"].value)))
        of_code.append(not test.row["E"])
    return Stiff(walls, campaigns, np.array(logs), np.array(pressed), np.array(of_code))


def printed(found: Stiff) -> Stiff:
    """The walls whose E is printed."""
    keep = np.flatnonzero(~found.of_code)
    walls, campaigns = [found.walls[k] for k in keep], [found.campaigns[k] for k in keep]
    return Stiff(walls, campaigns, found.logs[keep], found.pressed[keep], found.of_code[keep])


def fitted_left_out(logs: Array, columns: Array, campaigns: Sequence[str]) -> tuple[Array, Array]:
    """ln(predicted / measured) with a linear law fitted to the other campaigns, and the fits, shape (campaigns, k)."""
    of, out, fits = np.array(campaigns), np.empty(len(logs)), []
    for campaign in dict.fromkeys(campaigns):
        own = of == campaign
        fit = np.linalg.lstsq(columns[~own], -logs[~own], rcond=None)[0]
        out[own] = logs[own] + columns[own] @ fit
        fits.append(fit)
    return out, np.array(fits)


def within(found: Stiff, draws: int = 2000, seed: int = 0) -> tuple[float, float, float]:
    """Exponent of the load within campaigns, each with its own level, and ends of 90 % of draws of campaigns."""
    of = np.array(found.campaigns)
    names = list(dict.fromkeys(found.campaigns))
    x, y = found.pressed.copy(), -found.logs.copy()
    for name in names:
        own = of == name
        x[own], y[own] = x[own] - x[own].mean(), y[own] - y[own].mean()
    xy, xx = (np.array([float((x * v)[of == name].sum()) for name in names]) for v in (y, x))
    drawn = np.random.default_rng(seed).integers(len(names), size=(draws, len(names)))
    low, high = np.quantile(xy[drawn].sum(axis=1) / xx[drawn].sum(axis=1), [0.05, 0.95])
    return float(xy.sum() / xx.sum()), float(low), float(high)


def fitted_exponent(found: Stiff) -> float:
    """Exponent of the load over all walls, with a share where E is of a code."""
    columns = np.column_stack([found.pressed, found.of_code.astype(float)])
    return float(np.linalg.lstsq(columns, -found.logs, rcond=None)[0][0])


def laws(found: Stiff) -> Mapping[str, tuple[Array, str]]:
    """ln(predicted / measured) by law, and what was fitted over the campaigns left out."""
    one, code = np.ones(len(found.logs)), found.of_code.astype(float)
    known: dict[str, tuple[Array, str]] = {
        "elastic, gross": (found.logs, "nothing"),
        "half of it (EN 1998-1)": (found.logs + np.log(EN_1998), "nothing"),
    }
    for name, columns, words in (
        ("a share of it", [one], ("share {}", np.exp)),
        ("a share, another where E is of a code", [one, code], ("share {}", np.exp)),
        ("joints that close: E (3 s0 / fc)^m", [found.pressed], ("m {}", None)),
        ("joints that close, E of a code times a share", [found.pressed, code], ("m {}", None)),
    ):
        out, fits = fitted_left_out(found.logs, np.column_stack(columns), found.campaigns)
        text, of = words
        first = fits[:, 0] if of is None else of(fits[:, 0])
        said = text.format(f"{first.min():.2f} to {first.max():.2f}")
        if len(columns) > 1:
            other = np.exp(fits[:, 1])
            said += f", of a code {other.min():.2f} to {other.max():.2f}"
        known[name] = out, said
    return known


def stiffness_lines(found: Stiff) -> list[list[str]]:
    """A row per law for a table."""
    lines = [["law of the stiffness", "median", "sd of ln", "90 %", "fitted"]]
    for name, (logs, said) in laws(found).items():
        s = scatter(logs)
        lines.append([name, f"{s.median:.2f}", f"{s.deviation:.2f}", f"{s.nine:.2f}", said])
    return lines


def stiffness_figure(found: Stiff, exponent: float, path: Path) -> None:
    """Measured over elastic stiffness against load, by campaign; filled where E is printed; the law beside it."""
    figure = Figure(figsize=(8.6, 5.4), layout="constrained")
    axes = figure.add_subplot()
    marks = "osD^v<>PXph*d8H"
    for k, campaign in enumerate(dict.fromkeys(found.campaigns)):
        own = np.array([c == campaign for c in found.campaigns])
        for filled in (True, False):
            part = own & (found.of_code != filled)
            if part.any():
                axes.plot(np.exp(found.pressed[part]) * MODULUS_AT, np.exp(-found.logs[part]), marks[k % len(marks)],
                          color=f"C{k % 10}", markerfacecolor=f"C{k % 10}" if filled else "none", markersize=5,
                          label=campaign if own[part].any() and (filled or not (own & ~found.of_code).any()) else None,
                          )
    load = np.geomspace(0.02, 0.45, 50)
    axes.plot(load, (load / MODULUS_AT) ** exponent, "k-", linewidth=1.4, label=f"(3 s0 / fc)^{exponent:.2f}")
    axes.axhline(EN_1998, color="k", linestyle="--", linewidth=1.0, label="half (EN 1998-1)")
    axes.axhline(1.0, color="k", linestyle=":", linewidth=0.8, label="elastic, gross section")
    axes.set(xscale="log", yscale="log", xlabel="axial stress over compressive strength, s0 / fc",
             ylabel="measured over elastic stiffness")
    axes.set_xticks([0.02, 0.05, 0.1, 0.2, 0.4], ["0.02", "0.05", "0.1", "0.2", "0.4"])
    axes.set_yticks([0.05, 0.1, 0.2, 0.5, 1.0, 2.0], ["0.05", "0.1", "0.2", "0.5", "1", "2"])
    axes.minorticks_off()
    axes.set_title("Walls lose stiffness where they are loaded little; filled: E printed, hollow: 1000 fc", fontsize=10)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    save(figure, path)
