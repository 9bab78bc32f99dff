"""Ties in limit analysis and mechanisms against closed forms: overturning, sliding, ring beams; and copies."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation
from walls import leaning, on_slab, running_bond, stack

import dem
import limitmason as lm
from limitmason.errors import NotApplicable
from limitmason.mechanics import law_table
from limitmason.mechanics.certificate import certify

RULES = ("associative", "non-associative")
HEIGHT, WIDTH = 2.0, 0.3


def pier(**options):
    return stack([(WIDTH, 0.5)] * 4, mu=0.7, **options)


def tied(wall, force, at=1.8, *, to=-1.0, **strength):
    """A horizontal tie to the ground at a height on the face x = 0, or on the other one where it goes to +x."""
    x = 0.0 if to < 0 else WIDTH
    block = f"block-{1 + int(at / 0.5)}"
    return wall.with_ties([lm.Tie(block, (x, 0.5, at), None, (to, 0.5, at), yield_force=force, **strength)])


def certified(prediction):
    c = prediction.certificate
    assert prediction.status == "solved"
    assert max(c.equilibrium_residual, c.yield_violation, c.complementarity, c.flow_residual) < 1e-8
    if prediction.flow_rule == "associative":
        assert c.accepted
        assert abs(c.gap) < 1e-7
    return prediction.collapse_multiplier


def value(wall, direction=(1, 0, 0), rule="associative", **options):
    if rule == "non-associative":
        options = {"search": "quick", "measure_jump": False, **options}
    return certified(lm.limit_analysis(wall, lm.Loads.horizontal(wall, direction), rule, **options))


@pytest.mark.parametrize("in_plane", [None, False])
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("at", [0.75, 1.8])
def test_overturning_wall_with_a_tie_at_a_height(at, rule, in_plane):
    # W lambda H / 2 = W t / 2 + Y h; above the tie nothing has changed
    wall = pier()
    weight, force = wall.weights[1:].sum(), 400.0
    foot = (0.5 * weight * WIDTH + force * at) / (0.5 * weight * HEIGHT)
    above = min(WIDTH / (0.5 * k) for k in range(1, 1 + int((HEIGHT - at) / 0.5)) or (1,)) if at < 1.5 else np.inf
    assert value(wall, rule=rule, in_plane=in_plane) == pytest.approx(WIDTH / HEIGHT, abs=1e-7)
    expected = min(foot, *(_from(wall, level, force, at) for level in (0.5, 1.0, 1.5)), above)
    assert value(tied(wall, force, at), rule=rule, in_plane=in_plane) == pytest.approx(expected, abs=1e-7)


def _from(wall, level, force, at):
    """Multiplier at which the part above a level overturns about it, with the tie if that is above too."""
    weight = wall.weights[1:].sum() * (HEIGHT - level) / HEIGHT
    return (0.5 * weight * WIDTH + force * max(at - level, 0.0)) / (0.5 * weight * (HEIGHT - level))


@pytest.mark.parametrize("rule", RULES)
def test_a_tie_that_is_strong_enough_moves_the_hinge_to_its_own_height(rule):
    # rigid: the wall cannot leave the tie and breaks below and above it, whatever more strength it has
    wall = pier()
    strong = [value(tied(wall, force), rule=rule) for force in (3e4, 3e5, 3e6)]
    assert strong == pytest.approx([strong[0]] * 3, abs=1e-6)
    assert strong[0] > value(tied(wall, 400.0), rule=rule) > value(wall, rule=rule)
    # between yielding tie and rigid one the multiplier rises as a straight line with the strength
    at, weight = 1.8, wall.weights[1:].sum()
    for force in (100.0, 200.0, 800.0):
        gain = value(tied(wall, force), rule=rule) - WIDTH / HEIGHT
        assert gain == pytest.approx(force * at / (0.5 * weight * HEIGHT), abs=1e-7)


def test_a_tie_hangs_loose_where_the_wall_moves_towards_it():
    wall = pier()
    assert value(tied(wall, 1e4), (-1, 0, 0)) == pytest.approx(WIDTH / HEIGHT, abs=1e-7)
    assert value(tied(wall, 400.0, to=1.5), (-1, 0, 0)) == pytest.approx(value(tied(wall, 400.0)), abs=1e-7)


def test_bond_or_plate_govern_where_they_are_the_least():
    wall = pier()
    expected = value(tied(wall, 400.0))
    assert value(tied(wall, 1e5, bond_force=400.0)) == pytest.approx(expected, abs=1e-9)
    assert value(tied(wall, 1e5, bond_force=1e4, anchor_force=400.0)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("rule", RULES)
def test_a_tie_holds_a_block_that_slides(rule):
    # lambda W = mu W + Y
    block = on_slab([((0, 0, 0), (2, 1, 0.5))], mu=0.3)
    force = 0.2 * block.weights[1]
    held = block.with_ties([lm.Tie("block-1", (0, 0.5, 0.0), None, (-1, 0.5, 0.0), yield_force=force)])
    assert value(held, rule=rule) == pytest.approx(0.5, abs=1e-7)


def test_a_tie_between_two_blocks_pulls_both():
    # of two piers apart the slender one is held by the stocky one, which gives as much as it takes
    boxes = [((0, 0, 0), (0.2, 1, 2)), ((2, 0, 0), (3, 1, 2))]
    pair = on_slab(boxes, mu=3.0)
    w1, w2, force = *pair.weights[1:], 700.0
    beam = pair.with_ties([lm.Tie("block-1", (0.2, 0.5, 2), "block-2", (2, 0.5, 2), yield_force=force)])
    # away from each other only one direction stretches it
    left = (0.1 * w1 + 2.0 * force) / w1
    assert value(beam, (-1, 0, 0)) == pytest.approx(left, abs=1e-7)
    found = lm.limit_analysis(beam, lm.Loads.horizontal(beam, (-1, 0, 0)))
    pull = found.resultants.normal[-1] * beam.links.normal[-1]
    assert pull == pytest.approx([-force, 0.0, 0.0], abs=1e-3)  # on block b, towards a
    # a tie too strong to yield: both overturn together, (W1 t1 + W2 t2) / (W1 + W2) / h
    rigid = pair.with_ties([lm.Tie("block-1", (0.2, 0.5, 2), "block-2", (2, 0.5, 2), yield_force=1e6)])
    assert value(rigid, (-1, 0, 0)) == pytest.approx((0.2 * w1 + 1.0 * w2) / (w1 + w2) / 2.0, abs=1e-7)


@pytest.mark.parametrize("rule", RULES)
def test_a_ring_beam_joins_a_facade_to_its_returns(rule):
    # the facade overturns away from two returns that stand; two pieces of the beam yield: lambda = t / H + 2 Y h / M
    house = on_slab([((0, 0, 0), (3, 0.3, 2)), ((0, 1, 0), (0.3, 4, 2)), ((2.7, 1, 0), (3, 4, 2))], mu=0.9)
    line = [(0.15, 3.0, 2.0), (0.15, 0.15, 2.0), (2.85, 0.15, 2.0), (2.85, 3.0, 2.0)]
    force = 500.0
    beam = house.with_ties(lm.ring_beam(house, line, yield_force=force))
    assert len(beam.ties) == 2
    assert value(house, (0, -1, 0), rule) == pytest.approx(0.15, abs=1e-7)
    expected = 0.15 + 2.0 * force * 2.0 / house.weights[1]
    assert value(beam, (0, -1, 0), rule) == pytest.approx(expected, abs=1e-7)


def test_turned_renumbered_and_scaled_copies_agree():
    wall = running_bond(2, 4)
    rod = lm.Tie(wall.blocks[-1].name, (0.7, 0.0, 0.7), None, (0.4, 1.0, 0.5), yield_force=300.0)
    held = wall.with_ties([rod])
    expected = value(held, (0, -1, 0))
    assert expected > value(wall, (0, -1, 0)) + 0.01
    turn = Rotation.from_euler("z", 127.0, degrees=True).as_matrix()
    order = np.random.default_rng(4).permutation(wall.n_blocks)
    moved = held.transformed(turn, (5.0, -3.0, 1.0)).renumbered(order)
    assert value(moved, turn @ (0.0, -1.0, 0.0)) == pytest.approx(expected, abs=1e-7)
    assert value(held.transformed(np.diag([-1.0, 1.0, 1.0])), (0, -1, 0)) == pytest.approx(expected, abs=1e-7)
    for scale in (1e-2, 1e2):
        # weights go with the cube of the length, and so must the strength
        ends = scale * rod.ends
        size = held.transformed(scale * np.eye(3)).with_ties(())
        size = size.with_ties([lm.Tie(rod.block_a, ends[0], None, ends[1], yield_force=300.0 * scale**3)])
        assert value(size, (0, -1, 0)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.slow
def test_a_turned_and_renumbered_plane_wall_keeps_its_non_associative_value():
    held = tied(pier(), 400.0, 0.75)
    expected = value(held, rule="non-associative")
    turn = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()
    moved = held.transformed(turn, (3.0, -2.0, 1.0)).renumbered([3, 1, 4, 0, 2])
    found = lm.limit_analysis(moved, lm.Loads.horizontal(moved, turn @ (1.0, 0.0, 0.0)), "non-associative")
    assert found.provenance["plane"]
    assert certified(found) == pytest.approx(expected, abs=1e-6)


def test_swapped_ends_are_the_same_tie():
    wall = running_bond(2, 3)
    a, b = (wall.blocks[k].name for k in (-1, 1))
    p, q = (0.3, 0.1, 0.55), (0.3, 0.0, 0.1)
    one = wall.with_ties([lm.Tie(a, p, b, q, yield_force=200.0)])
    two = wall.with_ties([lm.Tie(b, q, a, p, yield_force=200.0)])
    assert value(one, (0, -1, 0)) == pytest.approx(value(two, (0, -1, 0)), abs=1e-9)


def test_the_certificate_knows_the_tie():
    held = tied(pier(), 400.0)
    loads = lm.Loads.horizontal(held)
    found = lm.limit_analysis(held, loads)
    assert certify(held, loads, found).kinematic_multiplier == pytest.approx(found.collapse_multiplier, abs=1e-8)
    # with a weaker rod the same forces break the law, and its mechanism is worth less
    weaker = tied(pier(), 300.0)
    other = certify(weaker, loads, found)
    assert other.yield_violation * held.weights[1:].sum() == pytest.approx(100.0, rel=1e-6)
    assert other.kinematic_multiplier == pytest.approx(value(weaker), abs=1e-7)


def test_radenkovics_bracket_holds_with_ties():
    held = tied(pier(), 400.0)
    bracket = lm.limit_bracket(held, lm.Loads.horizontal(held))
    low, high = bracket.lower.collapse_multiplier, bracket.upper.collapse_multiplier
    assert low - 1e-9 <= value(held, rule="non-associative") <= high + 1e-9
    # without friction the tie is all that is left: lambda W = Y
    smooth = on_slab([((0, 0, 0), (2, 1, 0.5))], mu=0.3)
    smooth = smooth.with_ties([lm.Tie("block-1", (0, 0.5, 0.0), None, (-1, 0.5, 0.0), yield_force=1e3)])
    low = lm.limit_bracket(smooth, lm.Loads.horizontal(smooth)).lower.collapse_multiplier
    assert low == pytest.approx(1e3 / smooth.weights[1], abs=1e-6)


def test_mechanisms_charge_a_motion_with_the_ties_that_it_stretches():
    wall = pier()
    held = tied(wall, 400.0)
    loads = lm.Loads.horizontal(held)
    found = lm.predict(held, loads, "mechanisms")
    assert found.bound.startswith("upper")
    assert found.collapse_multiplier == pytest.approx(value(held), abs=1e-7)
    assert found.details["catalogue"]["sliding"] == pytest.approx(0.7 + 400.0 / wall.weights[1:].sum())
    loose = lm.predict(held, lm.Loads.horizontal(held, (-1, 0, 0)), "mechanisms")
    assert loose.collapse_multiplier == pytest.approx(WIDTH / HEIGHT, abs=1e-9)


def test_what_cannot_take_ties_says_so():
    held = tied(pier(), 400.0)
    loads = lm.Loads.horizontal(held)
    for call in (
        lambda: lm.limit_analysis(held, loads, solver="interior-point"),
        lambda: lm.limit_analysis(held, loads, "non-associative", prove=True),
        lambda: lm.proven_range(held, loads),
    ):
        with pytest.raises(NotApplicable, match="tie between 'block-4' and 'block-0' yields"):
            call()
    made = held.with_material(lm.Material(young_modulus=1e9, poisson_ratio=0.2))
    with pytest.raises(NotApplicable, match="capacity curve of simply deformable blocks does not follow ties"):
        lm.pushover(made, loads, blocks="simply deformable")
    with pytest.raises(NotApplicable, match="strains in modes does not follow ties"):
        dem.initial_state(made, loads, blocks="simply deformable")
    with pytest.raises(ValueError, match="block 'block-4' is cut by a crack"):
        lm.build.with_potential_cracks(held, {"block-4": ((0.15, 0.5, 1.75), (1.0, 0.0, 0.0))}, lm.Joint(30.0))
    assert any("ties yield at their strength" in w for w in lm.limit_analysis(held, loads).warnings)
    with pytest.raises(NotApplicable, match="is no weight"):
        _ = lm.limit_analysis(held, loads).tilt_angle_deg
    assert set(law_table.TIES.takes) == set(law_table.THEORIES)


def by_linear_program(wall, loads):
    """Largest multiplier of a wall in x-z by a program of its own: two points a joint, Coulomb's half-planes, rods."""
    rows, columns, limits, cones = 3 * wall.n_blocks, [], [], []

    def column(ends, force):
        wrench = np.zeros(rows)
        for block, sign, point in ends:
            arm = point - wall.centroids[block]
            turn = arm[2] * force[0] - arm[0] * force[2]
            wrench[3 * block : 3 * block + 3] += sign * np.array([force[0], force[2], turn])
        return wrench

    for joint in wall.interfaces:
        along = np.array([joint.normal[2], 0.0, -joint.normal[0]])
        for x, z in np.unique(np.round(joint.polygon[:, [0, 2]], 9), axis=0):
            ends = [(joint.block_a, -1.0, np.array([x, 0.0, z])), (joint.block_b, 1.0, np.array([x, 0.0, z]))]
            for sign in (1.0, -1.0):
                cones.append((len(columns), len(columns) + 1, sign, joint.joint.tan_phi))
            columns += [column(ends, joint.normal), column(ends, along)]
            limits += [(0.0, None), (None, None)]
    for tie in wall.ties:
        blocks = (wall.block_index(tie.block_a), 0 if tie.block_b is None else wall.block_index(tie.block_b))
        columns.append(column(list(zip(blocks, (1.0, -1.0), tie.ends, strict=True)), tie.direction))
        limits.append((0.0, tie.strength))
    friction = np.zeros((len(cones), len(columns) + 1))
    for k, (normal, shear, sign, mu) in enumerate(cones):
        friction[k, normal], friction[k, shear] = -mu, sign
    live, dead = (loads[:, [0, 2, 4]].ravel() for loads in (loads.live, loads.dead))
    balance = np.column_stack([*columns, live])[3:]  # block 0 is the ground
    cost = np.append(np.zeros(len(columns)), -1.0)
    answer = linprog(cost, friction, np.zeros(len(cones)), balance, -dead[3:], [*limits, (None, None)], method="highs")
    return -answer.fun


@pytest.mark.parametrize("seed", range(8))
def test_random_ties_give_what_a_program_of_its_own_gives(seed):
    rng = np.random.default_rng(seed)
    wall = running_bond(2, 3, mu=float(rng.uniform(0.3, 1.0)))
    ties = []
    for _ in range(rng.integers(1, 4)):
        a, b = rng.choice(np.arange(1, wall.n_blocks), 2, replace=False)
        other, end = int(b), wall.centroids[b]
        if rng.random() < 0.4:
            other, end = None, (rng.uniform(-1.0, 2.0), 0.1, rng.uniform(-0.1, 1.0))
        ties.append(lm.Tie(int(a), wall.centroids[a], other, end, yield_force=float(10.0 ** rng.uniform(0.0, 4.0))))
    held = wall.with_ties(ties)
    expected = by_linear_program(held, lm.Loads.horizontal(held))
    assert value(held) == pytest.approx(expected, abs=1e-6)
    assert value(held, in_plane=False) == pytest.approx(expected, abs=1e-6)
    assert value(held, rule="non-associative") <= expected + 1e-7


def test_a_tie_stands_beside_crushing_and_cohesive_joints():
    crushing = tied(stack([(WIDTH, 0.5)] * 4, joint=lm.Joint(35.0, compressive_strength=5e5)), 500.0)
    rigid = tied(pier(), 500.0)
    weaker = value(crushing)
    assert value(crushing.with_ties(())) < weaker < value(rigid)
    # force balance at the foot by hand: e = t / 2 - W / (2 fc d) is the lever arm of the stress block
    weight = crushing.weights[1:].sum()
    arm = 0.5 * WIDTH - weight / (2.0 * 5e5)
    assert weaker == pytest.approx((weight * arm + 500.0 * 1.8) / (0.5 * weight * HEIGHT), abs=1e-6)
    bonded = tied(stack([(WIDTH, 0.5)] * 4, joint=lm.Joint(35.0, cohesion=1e3, tensile_strength=500.0)), 500.0)
    assert value(bonded) == pytest.approx(value(bonded, in_plane=False), abs=1e-6)


def test_strengths_from_nothing_to_a_rod_that_never_yields():
    wall, weight = pier(), pier().weights[1:].sum()
    for force in (1e-9, 1e-3, 1.0):
        exact = WIDTH / HEIGHT + force * 1.8 / (0.5 * weight * HEIGHT)
        assert value(tied(wall, force)) == pytest.approx(exact, abs=1e-8)
    assert value(tied(wall, 1e4 * weight)) == pytest.approx(value(tied(wall, 1e7 * weight)), abs=1e-8)
    with pytest.raises(ValueError, match="more than 1e\\+08 times the load"):
        value(tied(wall, 1e9 * weight))


def test_a_tie_joins_parts_that_nothing_else_joins():
    pair = on_slab([((0, 0, 0), (0.2, 1, 2)), ((2, 0, 0), (2.3, 1, 2))], mu=0.9)
    joined = pair.with_ties([lm.Tie("block-1", (0.2, 0.5, 2), "block-2", (2, 0.5, 2), yield_force=1e5)])
    loads = lm.Loads.horizontal(pair, (-1, 0, 0))
    assert len(lm.limit_analysis(pair, loads).details["parts"]) == 2
    found = lm.limit_analysis(joined, loads)
    assert "parts" not in found.details
    w1, w2 = pair.weights[1:]
    assert certified(found) == pytest.approx((0.2 * w1 + 0.3 * w2) / (w1 + w2) / 2.0, abs=1e-7)


def test_a_tie_carries_a_block_that_would_fall():
    # overhanging by 0.2 of its length: the rod holds W 0.2 over its arm of 0.4 and overturning starts from there
    fallen = leaning()
    assert lm.limit_analysis(fallen, lm.Loads.horizontal(fallen)).status == "cannot stand under dead load"
    held = fallen.with_ties([lm.Tie(1, (0.6, 0.5, 0.5), None, (0.6, 0.5, -0.5), yield_force=1e5)])
    weight = held.weights[1]
    # about the edge at x = 1: Y 0.4 = W 0.2 + lambda W 0.5
    exact = (1e5 * 0.4 - 0.2 * weight) / (0.5 * weight)
    sliding = np.tan(np.radians(40.0)) * (weight + 1e5) / weight
    assert value(held) == pytest.approx(min(exact, sliding), abs=1e-7)
    weak = fallen.with_ties([lm.Tie(1, (0.6, 0.5, 0.5), None, (0.6, 0.5, -0.5), yield_force=0.4 * weight)])
    assert lm.limit_analysis(weak, lm.Loads.horizontal(weak)).status == "cannot stand under dead load"
