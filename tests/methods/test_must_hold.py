"""What theory puts in order between theories, on walls of the builders and on packaged cases.

The packaged cases by all methods, and every case in which the DEM leaves the non-associative range with the reason, are
in docs/methods.md.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from walls import corner, running_bond

import limitmason as lm
import mechanisms
from limitmason.comparison.findings import Answers

DRY = lm.Joint(33.82)
PLANS = {
    "straight": {},
    "L": {"plan": "L", "return_length": 0.12},
    "U": {"plan": "U", "return_length": 0.12},
}
SENSES = {"outwards": (0, -1, 0), "in plane": (1, 0, 0)}


def built(plan="straight", joint=DRY, **changes):
    arguments = {"length": 0.32, "height": 0.16, "unit": (0.08, 0.04, 0.04), **PLANS[plan], **changes}
    return lm.build.wall(joint=joint, **arguments)


def minho(specimen="SW.100.1"):
    test = lm.experiments.load("minho-dry-stone-2005-2009", specimen)
    return test.assembly(), test.loads()


PROBLEMS = {
    "straight wall outwards": lambda: pushed(built(), "outwards"),
    "straight wall in plane": lambda: pushed(built(), "in plane"),
    "slippery wall in plane": lambda: pushed(built(joint=lm.Joint(20.0)), "in plane"),
    "L outwards": lambda: pushed(built("L"), "outwards"),
    "U outwards": lambda: pushed(built("U"), "outwards"),
    "U of slippery joints": lambda: pushed(built("U", lm.Joint(12.0)), "outwards"),
    "shear wall under a beam": minho,
}


def pushed(assembly, sense):
    return assembly, lm.Loads.horizontal(assembly, SENSES[sense])


# ---- associative <= any admissible mechanism on the same interfaces --------------------------------------------------


@pytest.mark.parametrize("name", PROBLEMS)
def test_no_admissible_mechanism_of_the_catalogue_lies_below_the_associative_multiplier(name):
    assembly, loads = PROBLEMS[name]()
    associative = lm.limit_analysis(assembly, loads).collapse_multiplier
    found, _ = mechanisms.catalogue(assembly, loads)
    admissible = {k: p.details["kinematic_multiplier"] for k, p in found.items() if p.details.get("admissible")}
    assert admissible, "overturning and sliding in one piece are admissible on every wall"
    for mechanism, multiplier in admissible.items():
        assert associative <= multiplier * (1 + 1e-7), mechanism
    # and the comparison has teeth: the bound is met where theory says so
    if name == "straight wall outwards":
        assert min(admissible.values()) == pytest.approx(associative, rel=1e-6)


@pytest.mark.parametrize("make", [corner, lambda: running_bond(3, 4), lambda: built("U")], ids=["L", "wall", "U"])
def test_mechanisms_of_other_loads_are_bounds_too(make):
    # a mechanism that opens every joint as its friction asks stays admissible when the load changes
    assembly = make()
    cases = [lm.Loads.horizontal(assembly, d) for d in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (1, -1, 0))]
    solved = [lm.limit_analysis(assembly, loads) for loads in cases]
    bounds = 0
    for (i, p), (j, loads) in itertools.product(enumerate(solved), enumerate(cases)):
        motion = p.mechanism.twists * ~assembly.held
        work = float((loads.live * motion).sum())
        if work > 1e-6:
            bound = -float((loads.dead * motion).sum()) / work
            assert solved[j].collapse_multiplier <= bound * (1 + 1e-5)
            if i == j:
                assert bound == pytest.approx(p.collapse_multiplier, rel=1e-5)
            bounds += i != j
    assert bounds >= 4


# ---- non-associative <= associative ----------------------------------------------------------------------------------


def three_dimensional():
    return built("L", courses=3, height=None, length=0.24)


@pytest.mark.parametrize("name", ["wall", "corner", "ferris 1", "ferris 3", "shear wall", "any"])
def test_non_associative_lies_between_radenkovics_bounds(name):
    problems = {
        "wall": lambda: pushed(running_bond(3, 5), "in plane"),
        "corner": lambda: pushed(three_dimensional(), "outwards"),
        "ferris 1": lambda: ferris("wall-1"),
        "ferris 3": lambda: ferris("wall-3"),
        "shear wall": minho,
        "any": lambda: pushed(built(joint=lm.Joint(40.0, dilatancy_angle_deg=10.0)), "in plane"),
    }
    assembly, loads = problems[name]()
    upper = lm.limit_analysis(assembly, loads)
    lowest = lm.limit_analysis(assembly, loads, "non-associative", search="quick", measure_jump=False)
    assert lowest.status == "solved"
    assert lowest.collapse_multiplier <= upper.collapse_multiplier * (1 + 1e-7)
    low, high = lowest.details["radenkovic"]
    assert low - 1e-7 <= lowest.collapse_multiplier <= high + 1e-7


def ferris(specimen, **options):
    test = lm.experiments.load("ferris-tin-loi-2001", specimen, **options)
    return test.assembly(), test.loads()


# ---- DEM at psi = 0 inside the non-associative range -----------------------------------------------------------------


def dem_and_range(assembly, loads, points):
    """Both answers side by side, the DEM with its whole error budget."""
    return lm.compare(
        assembly, loads, ("associative", "non-associative", "dem"), dem={"contact_points": points},
        non_associative={"search": "quick", "measure_jump": False},
    )


INSIDE = {
    "slippery wall": (lambda: pushed(running_bond(3, 4, mu=0.4), "in plane"), (2, 2)),
    "strip out of plane": (lambda: pushed(built(length=0.16), "outwards"), (2, 4)),
}
LONGER = {
    "ferris 3": (lambda: ferris("wall-3"), (2, 2)),
    "shear wall": (lambda: minho("SW.250.1"), (2, 2)),
}


@pytest.mark.parametrize("name", [*INSIDE, *(pytest.param(k, marks=pytest.mark.slow) for k in LONGER)])
def test_dem_lies_inside_the_non_associative_range_within_its_error_budget(name):
    make, points = {**INSIDE, **LONGER}[name]
    result = dem_and_range(*make(), points)
    assert Answers(result.rows).position(result["dem"]).startswith("inside"), result.table()
    # an error bar that holds everything would say nothing
    assert result["dem"].high - result["dem"].low < 0.1 * result["dem"].multiplier


@pytest.mark.slow
def test_a_dem_answer_outside_is_called_so():
    result = lm.compare(*ferris("wall-3"), ("associative", "non-associative"), non_associative={"search": "quick"})
    upper = result["associative"]
    off = {"below": 0.9 * result["non-associative"].multiplier, "above": 1.1 * upper.multiplier}
    for side, value in off.items():
        answer = replace(upper, method="dem", multiplier=value, low=0.99 * value, high=1.01 * value)
        assert Answers((*result.rows, answer)).position(answer).startswith(side)


# ---- scaling the whole wall, and growing only its blocks -------------------------------------------------------------


@pytest.mark.parametrize("scale", [0.1, 7.3])
def test_scaling_the_whole_wall_leaves_cohesionless_multipliers_unchanged(scale):
    wall = built("U")
    grown = built(
        "U", length=0.32 * scale, height=0.16 * scale, unit=(0.08 * scale, 0.04 * scale, 0.04 * scale),
        return_length=0.12 * scale,
    )
    answers = []
    for assembly in (wall, grown):
        loads = lm.Loads.horizontal(assembly, SENSES["outwards"])
        answers.append([
            lm.limit_analysis(assembly, loads).collapse_multiplier,
            lm.predict(assembly, loads, "mechanisms").collapse_multiplier,
        ])
        flat = lm.Loads.horizontal(assembly, SENSES["in plane"])
        answers[-1].append(lm.limit_analysis(assembly, flat).collapse_multiplier)
    assert answers[0] == pytest.approx(answers[1], rel=1e-5)


@pytest.mark.slow
def test_scaling_leaves_the_dem_multiplier_unchanged():
    # where the joints name no stiffness: it then grows so that the deformation stays the same part of a block
    values = []
    for scale in (1.0, 7.3):
        strip = built(length=0.16 * scale, height=0.16 * scale, unit=(0.08 * scale, 0.04 * scale, 0.04 * scale))
        values.append(lm.predict(*pushed(strip, "outwards"), "dem", contact_points=(2, 4)).collapse_multiplier)
    assert values[0] == pytest.approx(values[1], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.1, 7.3])
def test_scaling_leaves_the_non_associative_multiplier_unchanged(scale):
    wall, loads = ferris("wall-3")
    large = wall.transformed(scale * np.eye(3))
    values = [
        lm.limit_analysis(w, x, "non-associative", search="quick", measure_jump=False).collapse_multiplier
        for w, x in ((wall, loads), (large, lm.Loads.horizontal(large)))
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-6)


@pytest.mark.exact
@pytest.mark.slow
def test_growing_only_the_blocks_is_a_result_and_no_law():
    arguments = {"length": 0.32, "height": 0.16, "unit": (0.08, 0.04, 0.04), "joint": DRY, **PLANS["L"]}
    table = lm.study.block_size_study(arguments, {"associative": (0.5, 1.0, 2.0)}, direction=SENSES["outwards"])
    own = table.where(method="associative")
    grown = [r["multiplier"] for r in own if r["size"] > 0]
    # the bond at the corner changes: the multiplier moves, by how much and which way is for the table to show
    assert max(grown) > 1.02 * min(grown)
    # what does not see the blocks stays: one rigid piece overturns or slides as before
    monolith = table.where(method="monolith")["multiplier"]
    assert monolith == pytest.approx(monolith[0], rel=1e-12)
    # sliding is one of these: with joints that slip first, the blocks' size changes nothing
    slippery = {**arguments, "joint": lm.Joint(4.0)}
    slides = lm.study.block_size_study(slippery, (0.5, 1.0, 2.0), direction=SENSES["outwards"])
    assert [r["multiplier"] for r in slides if r["size"] > 0] == pytest.approx([np.tan(np.deg2rad(4.0))] * 6, rel=1e-6)
