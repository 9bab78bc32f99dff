"""Closed-form mechanisms of a U-shaped wall: what crack angle and friction do to them, beside limit analysis."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import limitmason as lm
import mechanisms

joint = lm.Joint(friction_angle_deg=33.0)
wall = lm.build.wall(length=2.4, courses=9, unit=(0.4, 0.2, 0.2), joint=joint, plan="U", return_length=1.8)
outwards = lm.Loads.horizontal(wall, (0, -1, 0))

# thickness, courses, overlap, unit weight and friction are read from the wall's recipe and joints
facade = mechanisms.Facade.from_assembly(wall, outwards)
print(f"{facade.courses} courses of {facade.course_height:g} m, v = {facade.staggering:g} m, f = {facade.friction:.3f}")

found = {
    "A simple rocking": mechanisms.simple_rocking(wall, loads=outwards),
    "B, crack to the hinge": mechanisms.compound_rocking(wall, loads=outwards, crossed_courses="hinge"),
    "B, worst crack": mechanisms.compound_rocking(wall, loads=outwards),
    "B, whole courses": mechanisms.compound_rocking(wall, loads=outwards, crack="stepped"),
    "D horizontal flexure": mechanisms.horizontal_flexure(wall, loads=outwards),
    "overturning in one piece": mechanisms.overturning(wall, loads=outwards),
}
for name, prediction in found.items():
    d = prediction.details
    text = f"{name:<25} lambda = {prediction.collapse_multiplier:.4f}"
    if "omega_bracket" in d:
        low, high = d["omega_bracket"]
        text += f" (omega 0: {low:.4f}, 1: {high:.4f}), hinge {d['hinge_courses']} courses down"
        text += f", crack {d['crack_angle_deg']:.1f} deg"
    print(text)
    print(f"{'':<25} {prediction.bound.kind}")

associative = lm.limit_analysis(wall, outwards)
smallest = mechanisms.smallest(wall, outwards)
d = smallest.details
print(f"associative limit analysis {associative.collapse_multiplier:.4f}")
print(f"smallest bound             {smallest.collapse_multiplier:.4f} ({smallest.governing})")
print(f"smallest estimate          {d['smallest_estimate']:.4f} ({d['smallest_estimate_of']}), which bounds nothing")

with lm.figures.print_style():
    figure = Figure(figsize=(6.3, 3.4), dpi=200, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    # blue, orange, green and purple are told apart with every common colour vision
    for crossed, colour in zip((3, 5, 7, 9), ("#0072b2", "#e69f00", "#009e73", "#cc79a7"), strict=True):
        options = {"hinge_courses": 9, "crossed_courses": crossed}
        # the crack is no steeper than the bond steps, and ends within the side wall
        within = facade.side_wall_length / (crossed * facade.course_height)
        slope = np.linspace(0.0, min(facade.steepest_crack, within), 61)
        curve = [mechanisms.compound_rocking(facade, **options, crack_tangent=s).collapse_multiplier for s in slope]
        axes.plot(slope, curve, color=colour, label=f"crack through {crossed} courses")
        worst = mechanisms.compound_rocking(facade, **options)
        axes.plot(worst.details["crack_tangent"], worst.collapse_multiplier, "o", color=colour)
    axes.axhline(associative.collapse_multiplier, color="0.3", linestyle="--", label="associative limit analysis")
    axes.set(
        xlabel="tangent of the crack angle [-]", ylabel="multiplier λ [-]",
        title="Compound rocking: worst crack of each depth marked",
    )
    axes.legend()
    figure.savefig("mechanism_b_crack_angle.png")
