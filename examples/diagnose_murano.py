"""Diagnosis of one wall by three numbers: fit a cause on the first frequency, predict the second one and the stiffness.

    python diagnose_murano.py [--rehearse 60]

REGW is a U-shaped wall of stone and mortar under an airbag. The source prints how far its three models are from the
first two measured frequencies, in whole per cent: three such pairs enclose each frequency within 0.5 %. It does not
print which mode of a model the second measured one is. Mode 2 moves the side walls along the facade; sensors that
read across the facade see modes 1 and 3. Each cause gets its size from the first frequency alone. What it then predicts
was not used.

--rehearse draws walls whose second measured mode truly is mode 2, and counts how often mode 3 would have fitted.
"""

import argparse

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import limitmason as lm
from limitmason import causes
from limitmason.experiments.murano_u_walls import control_block

# frequency of three models of the source [Hz], and by how many per cent it is off the measured one (its Figure 20)
FIRST = ((28.35, 6), (28.03, 5), (28.01, 5))
SECOND = ((32.45, -7), (32.06, -8), (30.73, -12))
STIFFNESS = 29.8  # [kN/mm], measured


def measured(pairs):
    """Middle and half width [Hz] of what models and their errors, rounded to whole per cent, leave to a measurement."""
    low = max(f / (1.0 + (e + 0.5) / 100.0) for f, e in pairs)
    high = min(f / (1.0 + (e - 0.5) / 100.0) for f, e in pairs)
    return 0.5 * (low + high), 0.5 * (high - low)


def changed(changes, side_wall=1.0):
    """REGW with causes at their sizes and side walls of some length [m], its loads, and the stone that was read."""
    test = lm.experiments.load("murano-u-walls", "REGW", return_length=side_wall)
    model = test.assembly(), test.loads()
    for cause, size in changes:
        model = cause.apply(size, *model)
    return *model, control_block(test)


CAUSES = {
    "stiffness of all joints": causes.joint_stiffness(),
    "stiffness of bed joints": causes.joint_stiffness(kinds=("bed",)),
    "stiffness of head joints": causes.joint_stiffness(kinds=("head",)),
    "stiffness of the ground": causes.joint_stiffness(kinds=("base",)),
    "density": causes.block_density(),
    "length of the side walls [m]": None,
}


def model(name, size):
    """The wall with one cause of the list at some size."""
    return changed((), side_wall=size) if CAUSES[name] is None else changed([(CAUSES[name], size)])


def fitted(name, frequency):
    """Size of a cause that gives the first frequency [Hz]."""
    low, high = (0.7, 1.2) if CAUSES[name] is None else (0.5, 1.5)
    return brentq(lambda size: lm.modes(model(name, size)[0], 1).frequency[0] - frequency, low, high, xtol=2e-3)


def stiffness(assembly, loads, stone):
    """Load of the airbag over the displacement at the top of the facade [kN/mm]."""
    return -1e-3 / float(lm.elastic_range(assembly, loads).shift_live[stone, 1])


def rehearsed(count, error, side_walls, seed=20261124):
    """How many drawn walls, whose second measured mode is mode 2, mode 3 of the fitted wall predicts within an error.

    Stiffness of beds, heads and ground is drawn log-normally with a spread of 40 %, density with 5 %, the length of
    the side walls evenly between two values [m]. All joints of the wall as stated are fitted on the first frequency.
    """
    draw, hits = np.random.default_rng(seed), 0
    stated = lm.modes(changed(())[0], 3).frequency
    for _ in range(count):
        sizes = np.exp(draw.normal(0.0, (0.4, 0.4, 0.4, 0.05)))
        drawn = [(cause, float(size)) for cause, size in zip(list(CAUSES.values())[1:5], sizes, strict=True)]
        truth = lm.modes(changed(drawn, side_wall=float(draw.uniform(*side_walls)))[0], 2).frequency
        # blocks are rigid: one factor on all joints is one factor on all frequencies
        hits += abs(stated[2] * truth[0] / stated[0] / truth[1] - 1.0) < error
    return hits


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rehearse", type=int, default=0, metavar="N", help="walls to draw")
    arguments = parser.parse_args()
    (first, first_error), (second, second_error) = measured(FIRST), measured(SECOND)
    print(f"measured: {first:.2f} +- {first_error:.2f} Hz, {second:.2f} +- {second_error:.2f} Hz, {STIFFNESS} kN/mm")

    rows = {}
    print(f"{'fitted on the first frequency':30} size  mode 2 [Hz]  mode 3 [Hz]  stiffness [kN/mm]")
    for name in CAUSES:
        size = fitted(name, first)
        wall = model(name, size)
        found = lm.modes(wall[0], 3).frequency
        rows[name] = (found[1], found[2], stiffness(*wall))
        print(f"{name:30} {size:4.2f}  {found[1]:11.1f}  {found[2]:11.1f}  {rows[name][2]:17.1f}")

    for side_walls in ((0.7, 1.2), (0.9, 1.1)) if arguments.rehearse else ():
        hits = rehearsed(arguments.rehearse, 0.02, side_walls)
        low, high = lm.diagnosis.binomial_interval(hits, arguments.rehearse)
        print(f"mode 2 true, side walls of {side_walls[0]} to {side_walls[1]} m: mode 3 within 2 % in {hits} of "
              f"{arguments.rehearse} walls, {100 * low:.0f} to {100 * high:.0f} %")

    off = 100.0 * (np.array(list(rows.values())) / (second, second, STIFFNESS) - 1.0)
    fig, ax = plt.subplots(figsize=(6.4, 3.0), layout="constrained")
    places = np.arange(len(rows))[::-1]
    ax.axvspan(-100 * second_error / second, 100 * second_error / second, color="0.85", lw=0)
    ax.axvline(0.0, color="0.3", lw=0.8)
    looks = (("second frequency = mode 2", "o", "#D55E00"), ("second frequency = mode 3", "s", "#0072B2"),
             ("stiffness", "^", "0.35"))
    for column, (label, marker, colour) in zip(off.T, looks, strict=True):
        ax.plot(column, places, marker, color=colour, label=label)
    ax.set_yticks(places, list(rows))
    ax.set_xlabel("predicted over measured, less 1 [%]")
    fig.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    fig.savefig("diagnose_murano.png", dpi=150)
