"""Figures of the page of the measured walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import limitmason as lm
from limitmason.comparison.wall_curves import WallCurve
from limitmason.comparison.wall_ladder import WallPrediction
from limitmason.experiments.modern_walls import MODELS, NAME
from limitmason.experiments.modern_walls.inputs import complete
from limitmason.experiments.source_folder import read_table
from validation.wall_loop import first_mode

COLOURS = {"S": "#c0392b", "F": "#2471a3", "SL": "#7d3c98", "G": "#229954", "D": "#7f8c8d"}
MARKS = {"HC": "o", "SB-C": "s", "SB-CS": "P", "AAC": "^", "CS": "D", "LAC": "v"}
MOST = 0.06  # largest shift drawn, share of the height


def save(figure: Figure, path: Path) -> None:
    """Write a PNG."""
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)


def scatter_figure(found: Mapping[str, list[WallPrediction]], walls: Sequence[Any], path: Path) -> None:
    """Predicted against measured by model, failure mode (colour) and unit type (marker); hollow: inputs missing."""
    rows = {r["specimen"]: r for r in read_table(NAME, "walls.csv").rows}
    figure = Figure(figsize=(13.0, 5.2), layout="constrained")
    for k, (method, answers) in enumerate(found.items()):
        axes = figure.add_subplot(1, len(found), k + 1)
        by = {p.wall: p.force for p in answers}
        for m in walls:
            colour = COLOURS[first_mode(m.mode)]
            filled = complete(rows[m.wall])
            axes.plot(m.force, by[m.wall], MARKS[rows[m.wall]["unit_type"]], color=colour, markersize=5,
                      markerfacecolor=colour if filled else "none", alpha=0.8)
        ends = np.array([17.0, 1100.0])
        axes.plot(ends, ends, "k-", linewidth=0.8)
        for factor in (0.8, 1.25):
            axes.plot(ends, factor * ends, "k:", linewidth=0.7)
        axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends, title=method,
                 xlabel="measured [kN]", ylabel="predicted [kN]" if k == 0 else "")
        axes.set_aspect("equal")
    handles = [axes.plot([], [], "o", color=c, label=f"mode {n}")[0] for n, c in COLOURS.items()]
    handles += [axes.plot([], [], m, color="k", markerfacecolor="none", label=n)[0] for n, m in MARKS.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=11, fontsize=8, frameon=False)
    save(figure, path)


def worst_walls(names: Sequence[str], found: Mapping[str, WallPrediction], path: Path) -> None:
    """Mechanisms of the extended model of some walls, two rows."""
    figure = Figure(figsize=(13.0, 6.4), layout="constrained")
    columns = -(-len(names) // 2)
    for k, name in enumerate(names):
        axes = figure.add_subplot(2, columns, k + 1)
        test = lm.experiments.load(NAME, name, **MODELS["extended"])
        wall = test.assembly()
        answer = lm.limit_analysis(wall, test.loads(), check_dead_load=False)
        measured = 0.5 * (test.measured["Vmax+"] + test.measured["Vmax-"])
        assert answer.mechanism is not None
        _draw(axes, wall, np.asarray(answer.mechanism.twists))
        axes.set_title(f"wall {name}: {found[name].force:.0f} / {measured:.0f} kN\n{found[name].mode} / "
                       f"{test.parameters['failure type']}", fontsize=9)
    figure.suptitle("extended model / measured", fontsize=10)
    save(figure, path)


def _draw(axes: Any, wall: lm.Assembly, twists: np.ndarray) -> None:
    shapes, colours = [], []
    height = max(float(b.bounds[1, 2]) for b in wall.blocks)
    lift = np.cross(twists[:, 3:], np.array([0.0, 0.0, 0.3])) + twists[:, :3]
    scale = MOST * height / max(float(np.abs(lift[:, [0, 2]]).max()), 1e-12)
    for k, block in enumerate(wall.blocks):
        low, high = block.bounds
        corners = np.array([[low[0], 0, low[2]], [high[0], 0, low[2]], [high[0], 0, high[2]], [low[0], 0, high[2]]])
        arms = corners - wall.centroids[k] * np.array([1.0, 0.0, 1.0])
        moved = corners + scale * (twists[k, :3] + np.cross(twists[k, 3:], arms))
        shapes.append(moved[:, [0, 2]])
        colours.append("#b0b0b0" if wall.fixed[k] or block.name == "beam" else "#e8c9a0")
    axes.add_collection(PolyCollection(shapes, facecolors=colours, edgecolors="k", linewidths=0.3))
    axes.autoscale()
    axes.set_aspect("equal")
    axes.axis("off")


def envelopes(curves: Mapping[str, WallCurve], path: Path) -> None:
    """Measured envelopes of both senses and computed curves, each divided by its largest force."""
    rows = read_table(NAME, "envelopes.csv").rows
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    for k, name in enumerate(dict.fromkeys(r["specimen"] for r in rows)):
        axes = figure.add_subplot(2, 3, k + 1)
        for sense, colour in (("pos", "#2c3e50"), ("neg", "#7f8c8d")):
            own = np.array([[abs(float(r["drift"])), abs(float(r["force"]))] for r in rows if r["specimen"] == name
                            and r["sense"] == sense])
            own = own[np.argsort(own[:, 0], kind="stable")]
            axes.plot(own[:, 0], own[:, 1] / own[:, 1].max(), color=colour, linewidth=1.2)
        if name in curves and curves[name].force:
            found = curves[name]
            axes.plot(found.drift, np.array(found.force) / found.peak, color="#c0392b", linewidth=1.4)
        axes.set(title=f"wall {name}", xlabel="drift [%]", ylabel="force over largest", xlim=(0.0, 0.7),
                 ylim=(0.0, 1.1))
    handles = [axes.plot([], [], color=c, label=n)[0] for n, c in (
        ("measured, positive", "#2c3e50"), ("measured, negative", "#7f8c8d"), ("computed", "#c0392b"))]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    save(figure, path)


def drift_at(share: float, drift: np.ndarray, force: np.ndarray) -> float:
    """Drift at which a share of the largest force is first reached."""
    far = int(np.argmax(force >= share * force.max()))
    return float(np.interp(share * force.max(), force[far - 1 : far + 1], drift[far - 1 : far + 1]))
