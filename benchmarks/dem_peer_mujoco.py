"""The wall of dem_peers.py in MuJoCo; run by dem_peers.py with the interpreter of MuJoCo's environment.

Every block is a free rigid box, the base a fixed one, contacts are MuJoCo's own between boxes. They are soft: a contact
force comes from a penetration, and friction creeps. What is chosen here: elliptic friction cones, Newton's solver,
a contact time constant of two steps (the stiffest that MuJoCo keeps stable), impedance 0.99 at any depth, friction ten
times as stiff as normal contact (impratio) and three sweeps of the solver that takes remaining slip out.
"""

import json
import sys
import time

import mujoco
import numpy as np


def scene(case):
    """Model of the wall: boxes in their places, the base part of the world."""
    step, mu = case["step"], case["friction"]
    bodies = []
    for k, block in enumerate(case["blocks"]):
        corners = np.array(block["vertices"])
        low, high = corners.min(axis=0), corners.max(axis=0)
        centre, half = (" ".join(f"{x:.9g}" for x in v) for v in (0.5 * (low + high), 0.5 * (high - low)))
        # the real density of the block, whatever the drawing rounds
        mass = block["weight"] / case["gravity"]
        free = "" if block["fixed"] else "<freejoint/>"
        bodies.append(
            f'<body name="b{k}" pos="{centre}">{free}<geom type="box" size="{half}" mass="{mass:.9g}"/></body>'
        )
    return f"""<mujoco>
  <option timestep="{step}" cone="elliptic" solver="Newton" impratio="10" noslip_iterations="3" tolerance="1e-10"
          gravity="0 0 {-case["gravity"]}"/>
  <default>
    <geom condim="3" friction="{mu} 0 0" solref="{2.0 * step} 1" solimp="0.99 0.99 0.001 0.5 2"/>
  </default>
  <worldbody>{"".join(bodies)}</worldbody>
</mujoco>"""


def main():
    with open(sys.argv[1]) as file:
        case = json.load(file)
    g, every = case["gravity"], case["every"]
    begun = time.perf_counter(), time.process_time()
    model = mujoco.MjModel.from_xml_string(scene(case))
    data = mujoco.MjData(model)
    mass = model.body_mass[model.body_dofnum == 6]
    weight = float(mass.sum() * g)
    start, samples, moved, step = data.qpos.reshape(-1, 7)[:, :3].copy(), [], 0.0, 0
    while moved < case["moved"] and step * case["step"] < case["settle"] + case["ramp"]:
        loading = max(step * case["step"] - case["settle"], 0.0) / case["ramp"] * case["top"]
        model.opt.gravity[:] = 0.0, loading * g, -g
        mujoco.mj_step(model, data)
        step += 1
        if step % every == 0:
            # what the base carries: the load less what accelerates the blocks
            reaction = loading * weight - float(mass @ data.qacc.reshape(-1, 6)[:, 1])
            moved = float(np.linalg.norm(data.qpos.reshape(-1, 7)[:, :3] - start, axis=1).max())
            samples.append((loading, reaction / weight, moved, int(data.ncon)))
    result = {
        "version": mujoco.__version__, "elapsed": time.perf_counter() - begun[0],
        "processor": time.process_time() - begun[1], "steps": step, "samples": samples,
    }
    with open(sys.argv[2], "w") as file:
        json.dump(result, file)


if __name__ == "__main__":
    main()
