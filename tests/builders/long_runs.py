"""A small wall and a run of it through every kind of stage, to be cut off and taken up."""

from walls import running_bond

import dem
import limitmason as lm

JOINT = lm.Joint(30.0, dilatancy_angle_deg=10.0, normal_stiffness=1e9)


def wall_and_loads():
    wall = running_bond(2, 3, joint=JOINT)
    return wall, lm.Loads.horizontal(wall)


def stages():
    top = 7
    return [
        dem.Settle(max_steps=700), dem.Ramp(to=0.3, steps=900),
        dem.Hold(steps=530, servo={top: dem.Servo(300.0, parallel=False)}),
        dem.Drive(displacement={top: {"x": 2e-3}}, steps=650, keep=True), dem.Hold(steps=200),
    ]
