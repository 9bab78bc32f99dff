"""Contact points and dilatancy on Rondelet's wallette: the DEM beside limit analysis on the same points.

The wallette of 3 x 13 blocks of Godio, Stefanou and Sab 2017 (their Figs 3, 11, 12), phi = 35 degrees, kn = ks =
14 GPa/m. Its bond is only in a figure of the source: every plausible one is run (assumed). Published: about 0.40 for
psi = phi and 0.32 for psi = 0, converged from 8 points across. ``--full``: all bonds, up to 20 points (ten minutes).
"""

import os
import sys

from matplotlib.figure import Figure

from limitmason import experiments, study

FULL = "--full" in sys.argv
BONDS = experiments.specimens("rondelet-wallette") if FULL else ("toothed-odd-ragged",)
POINTS = (2, 3, 4, 6, 8, 12, 16, 20) if FULL else (2, 8)
PUBLISHED = {0.0: 0.32, 1.0: 0.40}
COLOURS = {0.0: "#d55e00", 1.0: "#0072b2"}

tables = {}
for bond in BONDS:
    test = experiments.load("rondelet-wallette", bond)
    tables[bond] = study.contact_point_study(
        test.assembly(),
        test.loads(),
        POINTS,
        options={"error_budget": (), "tolerance": 2e-3 if FULL else 1e-2},
        workers=os.cpu_count() if FULL else 1,
        progress=lambda line: print(line, file=sys.stderr),
    )


def line(bond, method, share):
    """Numbers of contact points and multipliers of one line; points without a multiplier are left out."""
    rows = [r for r in tables[bond] if r["method"] == method and r["share"] == share and r["multiplier"] > 0.0]
    return [r["points"] for r in rows], [r["multiplier"] for r in rows]


standing = [bond for bond in BONDS if line(bond, "dem", 1.0)[0]]
figure = Figure(figsize=(3.0 * len(standing) + 1.6, 3.0), dpi=200, layout="constrained")
for ax, bond in zip(figure.subplots(1, len(standing), sharey=True, squeeze=False)[0], standing, strict=True):
    for share, colour in COLOURS.items():
        ax.plot(*line(bond, "dem", share), "o-", ms=4, color=colour, label=f"DEM, ψ = {'φ' if share else '0'}")
        ax.axhline(
            PUBLISHED[share], color=colour, lw=0.8, ls=":", label=f"3DEC, ψ = {'φ' if share else '0'} (published)"
        )
    ax.plot(*line(bond, "associative", 1.0), "k_", ms=9, label="limit analysis, associative")
    ax.set(title=bond + " (assumed bond)", xlabel="contact points across the thickness")
    ax.title.set_fontsize(8)
figure.axes[0].set_ylabel("collapse multiplier [-]")
figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=7, frameon=False)
figure.savefig("rondelet_contact_points.png")

gaps = {}
for bond in BONDS:
    if bond not in standing:
        print(f"{bond}: cannot stand under its own weight in the DEM (the top course overhangs by half a block)")
        continue
    without, dilatant = line(bond, "dem", 0.0)[1][-1], line(bond, "dem", 1.0)[1][-1]
    gaps[bond] = dilatant / without - 1.0
    print(
        f"{bond}: at {POINTS[-1]} points {without:.3f} (psi = 0) and {dilatant:.3f} (psi = phi), "
        f"{100 * gaps[bond]:.0f} % apart; associative {line(bond, 'associative', 1.0)[1][-1]:.4f}; published 0.32, 0.40"
    )
