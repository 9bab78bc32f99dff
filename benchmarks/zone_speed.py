"""Zone updates per second beside what the arithmetic of a zone would allow on this processor, measured in the same run.

    python benchmarks/zone_speed.py

The bound is the rate of fused multiply-adds of a product of two 400 x 400 matrices on one thread: what a zone's own
multiplications and additions would take if nothing else were to do. Zones gather and scatter eight numbers at nodes
that lie apart, and a yield surface branches: no code comes near it, and the ratio says how far off this one is.
"""

import time

import numpy as np

import limitmason as lm
from dem.kernels.zones import joint_forces, zone_forces
from dem.zones import running
from dem.zones.assemble_zones import make_model

FLOPS = {"elastic": 2 * 64 + 60, "below its strength": 2 * 64 + 60 + 4 * (2 * 36 + 25)}
"""Multiplications and additions of a zone: K u, turning to its axes and back; strains and surface at four points."""


def timed(work, repeats=7):
    """Shortest processor time of a few calls [s]."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def arithmetic():
    """Floating-point operations per second of a matrix product on this thread."""
    a = np.random.default_rng(0).standard_normal((400, 400))
    return 2 * 400**3 / timed(lambda: a @ a, 20)


def wall(material, pressure=0.6e6, speed=0.0):
    """Seven courses of ten units, each in four by four zones, under weight, a pressure and a beam driven down."""
    joint = lm.Joint(22.0, cohesion=2e5, normal_stiffness=20e9, shear_stiffness=8e9)
    made = lm.build.wall(length=2.45, courses=7, unit=(0.245, 0.25, 0.3), joint=joint, density=1000.0, top_beam=0.3)
    made = made.with_material(material, blocks=[b.name for b in made.blocks if b.name != "beam"])
    model = make_model(made, lm.Loads.weight(made).with_precompression(made, pressure * 2.45 * 0.3), zone_size=0.0625)
    running.advance(model, 500)
    if speed:
        held = np.zeros(model.rigid.held.shape, bool)
        held[np.argmax(model.rigid.centre[:, 1])] = True
        running.drive(model, np.where(held, [0.0, -speed, 0.0], 0.0), held)
        running.advance(model, 150)
    return model


def main():
    rate = arithmetic()
    print(f"arithmetic: {1e-9 * rate:.1f} GFLOP/s, one thread, matrix product of 400 x 400")
    stone = dict(young_modulus=3e9, poisson_ratio=0.15, density=1000.0)
    kinds = {
        "elastic": lm.Material(**stone),
        "below its strength": lm.Material(**stone, cohesion=5e6, friction_angle_deg=35.0, tensile_strength=3e6),
        "yielding": lm.Material(**stone, cohesion=0.05e6, friction_angle_deg=10.0, tensile_strength=0.01e6),
    }
    for name, material in kinds.items():
        # what yields is driven: it bears .12 MPa and flows at a tenth of its yield strain a step
        model = wall(material) if name in FLOPS else wall(material, 0.06e6, 5e-6)
        count = len(model.zones.kind)
        steps, flow = (200, 0.0) if name in FLOPS else (10, model.nodes.velocity.copy())

        def zones(model=model, steps=steps, flow=flow):
            for _ in range(steps):
                model.nodes.shift[:] += flow  # what does not move yields once
                zone_forces(model.nodes, model.zones, model.tables, model.total)

        seconds = timed(zones) / steps / count
        line = f"{name:20s} {count} zones: {1e9 * seconds:6.1f} ns each, {1e-6 / seconds:6.1f} M updates/s"
        if name in FLOPS:
            bound = FLOPS[name] / rate
            line += f"; its {FLOPS[name]} operations would take {1e9 * bound:.1f} ns: {seconds / bound:.1f} times that"
        else:
            share = np.mean((model.zones.flag & 3) > 0)
            line += f"; {share:.0%} of the stress points yield"
        print(line)
        whole = timed(lambda model=model, steps=steps: running.advance(model, steps)) / steps
        points = len(model.contacts.area)

        def joints(model=model, steps=steps):
            for _ in range(steps):
                joint_forces(model.nodes, model.sides, model.contacts, model.law, model.soft, model.total)

        each = timed(joints) / steps / points
        print(f"{'':20s} {points} contact points: {1e9 * each:.1f} ns each; a whole step {1e6 * whole:.0f} us")


if __name__ == "__main__":
    main()
