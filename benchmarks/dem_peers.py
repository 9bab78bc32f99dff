"""Our distinct elements, LMGC90 and MuJoCo on one wall pushed out of its plane until it falls.

The wall: 104 blocks of 80 x 40 x 28 mm (halves at the ends) in 11 courses, 720 x 440 x 28 mm, dry, on a held base. The
load: own weight, and a share of it that rises steadily along y, which is what tilting the base is up to the length of
gravity. Exact multiplier: overturning as one body at thickness over height, 28 / 440 = 0.06364. All get the same
blocks, weights and friction. The peers integrate real masses in real time under a steady ramp and are read at the base:
largest horizontal reaction over the weight (median of five successive readings), until a block has moved 2.8 mm. Ours
holds load after load until it is in equilibrium, with scaled masses, and its multiplier is the largest load held;
Contact points and time steps are printed. Compare processor seconds.

LMGC90 and MuJoCo run in environments of their own, which the interpreters given here belong to:

    python -m venv lmgc90 && lmgc90/bin/pip install compas_lmgc90
    python -m venv mujoco && mujoco/bin/pip install mujoco
    python benchmarks/dem_peers.py --lmgc90 lmgc90/bin/python --mujoco mujoco/bin/python     # 1 to 2 minutes
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np

import dem
import limitmason as lm

UNIT = (0.08, 0.04, 0.028)  # length, height, thickness [m]
COURSES = 11
FRICTION = 0.67
TOP = 0.1  # multiplier at the end of the ramp
SETTLE = 0.1  # seconds under the weight alone before the ramp
MOVED = 0.1 * UNIT[2]
EXACT = UNIT[2] / (COURSES * UNIT[1])


def wall():
    """The wall on its base, and weight with a horizontal share of it along y."""
    joint = lm.Joint.from_friction_coefficient(FRICTION)
    assembly = lm.build.wall(length=9 * UNIT[0], courses=COURSES, unit=UNIT, joint=joint)
    return assembly, lm.Loads.horizontal(assembly, (0, 1, 0))


def case_of(assembly, step, ramp):
    """What a peer's script needs, for the command line of its interpreter."""
    blocks = [
        {
            "vertices": block.parts[0].vertices.tolist(),
            "faces": [[int(v) for v in face] for face in block.parts[0].faces],
            "fixed": bool(fixed),
            "weight": float(weight),
        }
        for block, fixed, weight in zip(assembly.blocks, assembly.fixed, assembly.weights, strict=True)
    ]
    return {
        "blocks": blocks, "friction": FRICTION, "density": float(assembly.blocks[-1].density),
        "gravity": float(assembly.weights[-1] / assembly.arrays.mass[-1]), "step": step, "settle": SETTLE, "ramp": ramp,
        "top": TOP, "moved": MOVED, "every": max(round(0.008 / step), 1),
    }


def peer(script, interpreter, assembly, step, ramp):
    """Row of a peer: its script run by its interpreter."""
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder) / "case.json", Path(folder) / "result.json"
        given.write_text(json.dumps(case_of(assembly, step, ramp)))
        command = [interpreter, str(Path(__file__).with_name(script)), str(given), str(found)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode or not found.exists():
            sys.exit(
                f"{script} failed with {interpreter} (exit code {run.returncode}):\n{(run.stdout + run.stderr)[-2000:]}"
            )
        result = json.loads(found.read_text())
    samples = np.array(result["samples"])
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(samples[:, 1], 5), axis=1)
    fell = samples[-1, 2] >= MOVED
    return {
        "points": f"{samples[:, 3].max():.0f}", "how": f"ramp of {TOP / ramp:.3g}/s in steps of {1e3 * step:g} ms",
        "multiplier": float(smooth.max()), "elapsed": result["elapsed"], "processor": result["processor"],
        "version": result["version"], "note": "" if fell else " (did not fall)",
    }


def ours(assembly, loads, grid):
    """Row of our search without error budget."""
    begun = time.perf_counter(), time.process_time()
    p = dem.collapse(assembly, loads, contact_points=grid, error_budget=())
    count = len(dem.initial_state(assembly, loads, contact_points=grid).points.s)
    return {
        "points": str(count), "how": "increments in equilibrium",
        "multiplier": p.collapse_multiplier, "elapsed": time.perf_counter() - begun[0],
        "processor": time.process_time() - begun[1], "version": lm.__version__,
        "note": "" if p.status == "solved" else f" ({p.status})",
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--lmgc90", metavar="PYTHON", help="interpreter of an environment with compas_lmgc90")
    parser.add_argument("--mujoco", metavar="PYTHON", help="interpreter of an environment with mujoco")
    parser.add_argument("--ramp", type=float, default=1.0, help=f"seconds in which the peers' load reaches {TOP}")
    parser.add_argument("--lmgc90-step", type=float, default=2e-3, help="time step of LMGC90 [s]")
    parser.add_argument("--mujoco-step", type=float, default=2e-3, help="time step of MuJoCo [s]")
    given = parser.parse_args()
    assembly, loads = wall()
    # compiled functions are loaded, or compiled the first time, before the clock starts
    dem.collapse(assembly, loads, contact_points=(2, 2), error_budget=(), max_steps=100)
    rows = {"limitmason": ours(assembly, loads, (2, 2))}
    rows["limitmason, 2 x 4 points"] = ours(assembly, loads, (2, 4))
    if given.lmgc90:
        rows["LMGC90"] = peer("dem_peer_lmgc90.py", given.lmgc90, assembly, given.lmgc90_step, given.ramp)
    if given.mujoco:
        rows["MuJoCo"] = peer("dem_peer_mujoco.py", given.mujoco, assembly, given.mujoco_step, given.ramp)
    print(
        f"Exact multiplier {EXACT:.5f}. Load average at the end {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores.\n"
    )
    print("| program | version | points | load | multiplier | against exact | processor [s] | ratio | elapsed [s] |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, row in rows.items():
        print(
            f"| {name} | {row['version']} | {row['points']} | {row['how']} | {row['multiplier']:.5f}{row['note']} "
            f"| {100 * (row['multiplier'] / EXACT - 1.0):+.1f} % | {row['processor']:.1f} "
            f"| {row['processor'] / rows['limitmason']['processor']:.1f} | {row['elapsed']:.1f} |"
        )


if __name__ == "__main__":
    main()
