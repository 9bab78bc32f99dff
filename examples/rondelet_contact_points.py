"""Contact points on Rondelet's wallette: the DEM beside limit analysis on the same points.

The wallette of 3 x 13 blocks of Godio, Stefanou and Sab 2017 (their Figs 3, 11, 12), phi = 35 degrees, kn = ks =
14 GPa/m. Its bond is only in a figure of the source: every plausible one is run (assumed). Published: about 0.40 for
psi = phi, converged from 8 points across; 0.32 for psi = 0 is derived from a
difference "of the order of 25%". ``--full``: all bonds, up to 20 points across.

At psi = 0 the points along the unit matter more than those across: two of them keep the pressure at the ends of a face,
and its torsional strength mu N r with the mean radius r of the pressure stays far above that of uniform pressure.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

from limitmason import experiments, study

FULL = "--full" in sys.argv
BONDS = experiments.specimens("rondelet-wallette") if FULL else ("toothed-odd-ragged",)
ACROSS = (2, 3, 4, 6, 8, 12, 16, 20) if FULL else (2, 8)
ALONG = (2, 4, 8) if FULL else (2, 4)
PUBLISHED = {0.0: 0.32, 1.0: 0.40}
COLOURS = {0.0: "#d55e00", 1.0: "#0072b2"}
STYLES = dict(zip(ALONG, ("o-", "s--", "^:"), strict=False))

tables = {}
for bond in BONDS:
    test = experiments.load("rondelet-wallette", bond)
    for along in ALONG:
        tables[bond, along] = study.contact_point_study(
            test.assembly(),
            test.loads(),
            ACROSS,
            along=along,
            reference=along == 2,  # more points never change the associative program
            options={"error_budget": (), "tolerance": 2e-3 if FULL else 1e-2},
            progress=lambda line: print(line, file=sys.stderr),
        )


def line(bond, along, method, share):
    """Numbers of points across and multipliers of one line; points without a multiplier are left out."""
    rows = [r for r in tables[bond, along] if r["method"] == method and r["share"] == share and r["multiplier"] > 0.0]
    return [r["points"] for r in rows], [r["multiplier"] for r in rows]


def mean_radius(length, width, along, across):
    """Mean distance of the contact points from the centre of a face, weighted by their areas [m]."""
    ends = []
    for n in (along, across):
        # equal shares but for two points at each end, so that the second moment is that of the face
        h, weight = 1.0 / (n - 1), np.r_[0.5, np.ones(n - 2), 0.5] / (n - 1)
        if n > 2:
            weight -= h / (12.0 * (1.0 - h)) * np.convolve([1.0, *np.zeros(n - 2), 1.0], [-1.0, 1.0, -1.0], "same")
        ends.append(weight)
    x, y = (np.linspace(-0.5, 0.5, n) * size for n, size in ((along, length), (across, width)))
    return float((np.outer(*ends) * np.hypot(x[:, None], y[None, :])).sum())


standing = [bond for bond in BONDS if any(line(bond, along, "dem", share)[0] for along in ALONG for share in COLOURS)]
figure = Figure(figsize=(3.0 * len(standing) + 2.2, 3.2), dpi=200, layout="constrained")
for ax, bond in zip(figure.subplots(1, len(standing), sharey=True, squeeze=False)[0], standing, strict=True):
    for share, colour in COLOURS.items():
        psi = "φ" if share else "0"
        for along, style in STYLES.items():
            label = f"DEM, ψ = {psi}, {along} points along"
            ax.plot(*line(bond, along, "dem", share), style, ms=3.5, lw=1.2, color=colour, label=label)
        line_of = "--" if share else ":"
        ax.axhline(PUBLISHED[share], color="k", ls=line_of, lw=0.8, label=f"3DEC, ψ = {psi} (published, about)")
    ax.plot(*line(bond, 2, "associative", 1.0), "D", ms=4, mfc="none", c="#009e73", label="limit analysis, associative")
    ax.set_title(f"{bond} (assumed bond)", fontsize=8)
    ax.set(xlabel="contact points across the thickness [-]", ylim=(0.2, 0.46))
    ax.spines[["top", "right"]].set_visible(False)
figure.axes[0].set_ylabel("collapse multiplier [-]")
figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=7, frameon=False)
figure.savefig("rondelet_contact_points.png")

block, n = test.parameters, ACROSS[-1]
half_lap = (0.5e-3 * float(block["block width"]), 1e-3 * float(block["block thickness"]))
radii = {along: mean_radius(*half_lap, along, n) for along in (*ALONG, 200)}
print("mean radius of uniform pressure on half a bed face, over its true value:")
print("  " + ", ".join(f"{along} points along {radii[along] / radii[200]:.2f}" for along in ALONG))
found = {}
for bond in standing:
    print(f"{bond}: associative {line(bond, 2, 'associative', 1.0)[1][-1]:.4f}; published 0.40, derived 0.32")
    for along in ALONG:
        last = {share: (line(bond, along, "dem", share)[1] or [float("nan")])[-1] for share in COLOURS}
        found[bond, along] = (last[0.0], last[1.0])
        print(
            f"  {along} x {n} points: {last[0.0]:.3f} (psi = 0), {last[1.0]:.3f} (psi = phi), "
            f"{100 * (last[1.0] / last[0.0] - 1.0):.0f} % apart"
        )
if any(without != without for without, _ in found.values()):
    print("nan: cannot stand under its own weight (the end block of the top course overhangs by half)")
