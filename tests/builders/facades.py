"""Straight, L and U walls of one bond that the tests of the mechanisms push outwards, and limit analysis of them."""

import limitmason as lm
import mechanisms as me

MU = 0.6
JOINT = lm.Joint.from_friction_coefficient(MU)
COMMON = {"length": 2.4, "courses": 6, "unit": (0.4, 0.2, 0.2), "joint": JOINT}

ROUND = me.Facade(
    length=3.0,
    thickness=0.3,
    courses=10,
    course_height=0.2,
    staggering=0.15,
    unit_weight=20.0,
    friction=0.6,
    side_walls=2,
)


def built(plan="straight", **options):
    extra = {} if plan == "straight" else {"plan": plan, "return_length": 1.6}
    return lm.build.wall(**{**COMMON, **extra, **options})


def outwards(wall):
    return lm.Loads.horizontal(wall, (0, -1, 0))


def associative(wall, loads):
    prediction = lm.limit_analysis(wall, loads)
    assert prediction.status == "solved"
    return prediction.collapse_multiplier
