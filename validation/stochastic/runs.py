"""One run of the stochastic brick panels: what it pushes and what it keeps, so that nothing must be run twice."""

import numpy as np

import dem
import limitmason as lm
from limitmason import study
from limitmason.experiments import stochastic_brick_panels as published

STEPS = 6000  # over 1.5 mm; a third of the speed for the noise floor
TRAVEL = 1.5e-3  # [m]
BRAKE = dem.Damping(local=0.5)
"""Of these it answers steadiest at this speed: see the page for the others."""
WIDTHS = (0.05e-3, 0.10e-3, 0.15e-3, 0.20e-3)
"""Openings at which a joint counts as cracked [m]; the paper's is 0.15 mm."""
NAMES = {
    "young modulus": ("young_modulus", 1e6), "poisson ratio": ("poisson_ratio", 1.0),
    "normal stiffness": ("normal_stiffness", 1e9), "friction angle": ("friction_angle_deg", 1.0),
    "cohesion": ("cohesion", 1e6), "tensile strength": ("tensile_strength", 1e6),
}
MEAN = {keyword: unit * published.properties()[name].mean for name, (keyword, unit) in NAMES.items()}
"""Of the properties in SI units, by the names of the joints and bricks."""
PANEL = lm.experiments.load("brick-panels-opening", "S1", dilation_deg=0.0).with_options(
    young_modulus=MEAN["young_modulus"], poisson_ratio=MEAN["poisson_ratio"], kn=MEAN["normal_stiffness"],
    ks=MEAN["normal_stiffness"] / published.STIFFNESS_RATIO, friction_deg=MEAN["friction_angle_deg"],
    cohesion=MEAN["cohesion"], tensile_strength=MEAN["tensile_strength"],
)
DIGIT = 1e-7
"""Opening and slip are kept as whole numbers of this [m]."""
FALLEN = 5e-3
"""A panel of which a brick moves so far under own weight falls [m]: those that stand move by some tenths of a mm."""
OWN_WEIGHT = "own weight"
"""Mode of a panel that falls before it is pushed."""


def pushed(assembly, travel=TRAVEL, speed=1.0, damping=BRAKE, blocks="lumped"):
    """Curve of one panel, at the speed of the study or a part of it; None where it falls under its own weight."""
    try:
        return dem.push(
            assembly, PANEL.drive(), to=travel, blocks=blocks, steps=round(STEPS * travel / TRAVEL / speed),
            rate_check=False, samples=400, damping=damping,
            settle=dem.Settle(tolerance=1e-5, stop_when_moved=FALLEN),
        )
    except dem.UnsettledError as refused:
        moved = refused.history.shift
        if np.linalg.norm(moved[-1] - moved[0], axis=1).max() < 0.5 * FALLEN:
            raise  # too slow, not falling
        return None


def told(curve):
    """What is kept of a curve: loads, displacements, modes, what every joint did, and the curve itself."""
    if curve is None:
        return {"ultimate": 0.0, "at": 0.0, "mode": OWN_WEIGHT, "mode at peak": OWN_WEIGHT, "end": "falls"}
    top = curve.peak
    crack = curve.first_crack(WIDTHS[2])
    first, fallen = curve.first_failure, curve.ultimate(0.8)
    out = {
        "ultimate": top.load, "at": top.displacement, "mode": curve.mode.name,
        "crack": float("nan") if crack is None else crack.load,
        "crack at": float("nan") if crack is None else crack.displacement,
        "crack in": "" if crack is None else crack.where,
        "failure": float("nan") if first is None else first.load,
        "failure in": "" if first is None else first.where,
        "widths": [None if c is None else c.load for c in map(curve.first_crack, WIDTHS)],
        "mode at peak": curve.mode_at(top.index).name, "residual": curve.residual, "stiffness": curve.stiffness(),
        "kinetic": float(curve.errors["kinetic"][: top.index + 1].max()), "end": curve.status,
    }
    for name, index in (("peak", top.index), ("fallen", None if fallen is None else fallen.index), ("end", -1)):
        if index is not None:
            for what in ("opening", "slip"):
                moved = getattr(curve, what)[index] - getattr(curve, what)[0]
                out[f"{what} at {name}"] = [None if v != v else round(v / DIGIT) for v in moved.tolist()]
    every = slice(None, None, 4)
    out["curve"] = [
        [round(u, 8) for u in curve.displacement[every].tolist()],
        [round(f, 1) for f in curve.load[every].tolist()],
    ]
    return out


def push(assembly, loads):
    """One run; where the load is largest at the end of the travel, twice as far, and the shorter answer beside."""
    own = told(pushed(assembly))
    if own["at"] < 0.99 * TRAVEL:
        return own
    further = told(pushed(assembly, 2.0 * TRAVEL))
    return {**further, "ultimate at 1.5 mm": own["ultimate"], "at 1.5 mm": own}


def slow_push(assembly, loads):
    """The run at a third of the speed."""
    return told(pushed(assembly, speed=1.0 / 3.0))


def nudged_push(assembly, loads):
    """The run with every friction angle, cohesion and tensile strength larger by a part in a million."""
    from dataclasses import replace

    tiny = 1.0 + 1e-6
    changed = [
        replace(i, joint=replace(
            i.joint, friction_angle_deg=tiny * i.joint.friction_angle_deg, cohesion=tiny * i.joint.cohesion,
            tensile_strength=tiny * i.joint.tensile_strength,
        ))
        for i in assembly.interfaces
    ]
    return told(pushed(assembly.with_interfaces(changed)))


def short_push(assembly, loads):
    """The run to 1.5 mm and no further: joints that lose nothing rise all the way."""
    return told(pushed(assembly))


def kept_push(assembly, loads):
    """The run to 1.5 mm with joints that lose tension by opening and keep their cohesion."""
    from dataclasses import replace

    changed = [replace(i, joint=replace(i.joint, residual_cohesion=i.joint.cohesion)) for i in assembly.interfaces]
    return told(pushed(assembly.with_interfaces(changed)))


def draws(number, spatial, linked=True):
    """What ``monte_carlo`` draws in a set."""
    own = published.drawn(number)
    joints, blocks, links = {}, {}, {}
    for name, value in own.items():
        if name not in NAMES or (linked and name == "cohesion"):
            continue
        keyword, unit = NAMES[name]
        brick = name in ("young modulus", "poisson ratio")
        per = ("block" if brick else "interface") if spatial else "assembly"
        draw = study.Random(study.normal(unit * value.mean, value.variation), per=per)
        (blocks if brick else joints)[keyword] = draw
    if "shear stiffness" in own:
        links["shear_stiffness"] = published.LINKS["shear_stiffness"]
    if "cohesion" in own and linked:
        links["cohesion"] = published.LINKS["cohesion"]
    return {"joints": joints, "blocks": blocks, "links": links}
