"""The wall of dem_peers.py in LMGC90; run by dem_peers.py with the interpreter of an environment with compas_lmgc90.

Non-smooth contact dynamics: rigid blocks, Signorini contact and Coulomb friction ("IQS_CLB") between polyhedra,
implicit steps (theta 0.5), LMGC90's own contact detection. The load rises as forces on the blocks; the reaction is the
sum of the contact forces on the base. The solver's iterations and tolerance are those fixed in compas_lmgc90.
"""

import json
import sys
import time
from importlib.metadata import version

import numpy as np
from compas_lmgc90.solver import Solver

ALERT = 2e-3  # m, distance from which LMGC90 looks for contacts


def solver_of(case, density):
    """Solver with the blocks, the base held, and the load that rises along y."""
    solver = Solver(dt=case["step"], theta=0.5, density=density)
    solver.geometry_from_v_f(case["blocks"])
    times = np.array([0.0, case["settle"], case["settle"] + case["ramp"], 10.0 * (case["settle"] + case["ramp"])])
    for number, block in enumerate(case["blocks"]):
        if block["fixed"]:
            for component in ("Vx", "Vy", "Vz", "Rx", "Ry", "Rz"):
                solver.apply_velocity(number, component, np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]]))
        else:
            force = block["weight"] * case["top"]
            solver.apply_force(number, "Fy", np.array([times, [0.0, 0.0, force, force]]))
    solver.contact_law("IQS_CLB", [case["friction"]], alert=ALERT)
    solver.preprocess()
    return solver


def main():
    with open(sys.argv[1]) as file:
        case = json.load(file)
    base = [k + 1 for k, block in enumerate(case["blocks"]) if block["fixed"]]
    weight = sum(block["weight"] for block in case["blocks"] if not block["fixed"])
    begun = time.perf_counter(), time.process_time()
    solver = solver_of(case, case["density"])
    start = np.array(solver.lmgc90.get_initial_state().init_bodies)
    samples, moved, step = [], 0.0, 0
    while moved < case["moved"] and step * case["step"] < case["settle"] + case["ramp"]:
        state = solver.lmgc90.compute_one_step()
        step += 1
        if step % case["every"] == 0:
            on_base = np.isin(np.array(state.interaction_bodies), base).any(axis=1)
            reaction = abs(float(np.array(state.interaction_force_global)[on_base, 1].sum()))
            moved = float(np.linalg.norm(np.array(state.bodies) - start, axis=1).max())
            loading = max(step * case["step"] - case["settle"], 0.0) / case["ramp"] * case["top"]
            samples.append((loading, reaction / weight, moved, len(on_base)))
    result = {
        "version": version("compas_lmgc90"), "elapsed": time.perf_counter() - begun[0],
        "processor": time.process_time() - begun[1], "steps": step, "samples": samples,
    }
    with open(sys.argv[2], "w") as file:
        json.dump(result, file)


if __name__ == "__main__":
    main()
