"""Ties chosen from candidates: blocks that overturn in closed form, and the bound of all candidates."""

from itertools import combinations

import pytest

import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box

PULL = 2000.0


def pier():
    """A block one metre wide and two high between two rocks, and ties to either at three heights."""
    solids = [box(*c) for c in (((-4, 0, -1), (5, 1, 0)), ((-4, 0, 0), (-3, 1, 2)), ((4, 0, 0), (5, 1, 2)))]
    model = lm.Assembly.from_polyhedra(
        [*solids, box((0, 0, 0), (1, 1, 2))], joint=lm.Joint(60.0), fixed=[0, 1, 2],
        names=["ground", "left", "right", "pier"],
    )
    ties = []
    for side, end, rock in (("left", 0.0, -3.0), ("right", 1.0, 4.0)):
        for z in (0.5, 1.0, 1.8):
            ties.append(
                lm.Tie("pier", (end, 0.5, z), side, (rock, 0.5, z), yield_force=PULL, name=f"{side} {z}")
            )
    return model, ties


@pytest.mark.slow
def test_the_highest_ties_on_the_right_side_are_taken_first():
    """Lambda = (W b / 2 + sum T z) / (W h / 2) about the edge; ties behind it are of no use."""
    model, ties = pier()
    weight, loads = model.weights[3], lm.Loads.horizontal(model)
    found = lm.strengthen(model, loads, ties)
    gains = {z: PULL * z / weight for z in (0.5, 1.0, 1.8)}
    assert found.before == pytest.approx(0.5, rel=1e-6)
    assert [s.name for s in found.steps] == ["left 1.8", "left 1.0", "left 0.5"]
    assert [s.gain for s in found.steps] == pytest.approx([gains[1.8], gains[1.0], gains[0.5]], rel=1e-5)
    assert found.alone["left 1.0"] == pytest.approx(0.5 + gains[1.0], rel=1e-6)
    assert found.alone["right 1.8"] == pytest.approx(0.5, rel=1e-6)
    assert found.bound == pytest.approx(0.5 + sum(gains.values()), rel=1e-6)
    assert found.left == pytest.approx(0.0, abs=1e-6)
    assert "all candidates" in str(found)


@pytest.mark.slow
def test_few_for_a_target_and_the_proof_of_what_is_left():
    model, ties = pier()
    weight, loads = model.weights[3], lm.Loads.horizontal(model)
    two = lm.strengthen(model, loads, ties, most=2)
    assert two.left == pytest.approx(PULL * 0.5 / weight, rel=1e-4)
    best = max(
        lm.limit_analysis(model.with_ties(pair), loads).collapse_multiplier for pair in combinations(ties, 2)
    )
    assert best == pytest.approx(two.after, rel=1e-7)
    assert best <= two.bound
    goal = lm.strengthen(model, loads, ties, target=0.5 + PULL * 1.0 / weight)
    assert goal.reached
    assert [s.name for s in goal.steps] == ["left 1.8"]
    assert goal.fewest
    assert "reached with 1; proven: no fewer do" in str(goal)
    beyond = lm.strengthen(model, loads, ties, target=9.0)
    assert beyond.reached is False
    assert beyond.fewest is None
    assert "out of reach of all candidates" in str(beyond)


@pytest.mark.slow
def test_the_fewest_for_a_target_where_the_best_first_is_no_part_of_them():
    """Two pushes: the anchor helps against both and is taken first, but a tie on either side is enough without it."""
    model, ties = pier()
    weight, both = model.weights[3], [lm.Loads.horizontal(model, (s, 0, 0)) for s in (1, -1)]
    anchor = lm.Tie("pier", (0.5, 0.5, 0.2), "ground", (0.5, 0.5, -0.5), yield_force=PULL, name="anchor")
    some, target = [anchor, ties[0], ties[2], ties[5]], 0.5 + PULL * 1.8 / weight * (1.0 - 1e-6)
    greedy = lm.strengthen(model, both, some, target=target, proof=0)
    assert [s.name for s in greedy.steps[:1]] == ["anchor"]
    assert len(greedy.steps) == 3
    assert greedy.reached
    assert greedy.fewest is False
    assert "reached with 3; that no fewer do is not proven" in str(greedy)
    found = lm.strengthen(model, both, some, target=target)
    assert sorted(s.name for s in found.steps) == ["left 1.8", "right 1.8"]
    assert found.fewest
    enough = [
        len(names) for n in range(len(some) + 1) for names in combinations(some, n)
        if min(lm.limit_analysis(model.with_ties(names), c).collapse_multiplier for c in both) >= target
    ]
    assert min(enough) == len(found.steps)
    assert found.after == pytest.approx(0.5 + PULL * 1.8 / weight, rel=1e-5)


@pytest.mark.slow
def test_two_directions_need_a_tie_on_either_side():
    """One tie raises neither smallest multiplier; it is taken all the same, and the next raises both."""
    model, ties = pier()
    weight = model.weights[3]
    cases = [lm.Loads.horizontal(model, (s, 0, 0)) for s in (1, -1)]
    found = lm.strengthen(model, cases, ties, most=2)
    assert sorted(s.name for s in found.steps) == ["left 1.8", "right 1.8"]
    assert found.after == pytest.approx(0.5 + PULL * 1.8 / weight, rel=1e-5)


def test_candidates_that_make_no_choice_are_refused():
    model, ties = pier()
    loads = lm.Loads.horizontal(model)
    with pytest.raises(InputError, match="at least one candidate"):
        lm.strengthen(model, loads, [])
    with pytest.raises(InputError, match="the same name"):
        lm.strengthen(model, loads, [ties[0], ties[0]])
    with pytest.raises(InputError, match="most must be a whole number"):
        lm.strengthen(model, loads, ties, most=0)


def test_ties_add_nothing_to_what_has_no_end():
    model, ties = pier()
    found = lm.strengthen(model, lm.Loads.body_force(model, (0, 0, -1)), ties[:1])
    assert found.before == found.bound == float("inf")
    assert found.left == 0.0
    assert "0 more at most" in str(found)
