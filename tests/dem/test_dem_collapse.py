"""Collapse multipliers of the DEM against exact values, published programs and its own honesty."""

import functools

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from walls import beside_or_on_a_large_block, lattice_weights, on_slab, running_bond, stack

import dem
import limitmason as lm
from dem.kernels import LAW
from dem.model.rest_or_collapse import hold
from dem.model.unbalance import Scale
from dem.multiplier.search import Controls, _Bracket

collapse = functools.partial(dem.collapse, error_budget=())

PAVIA_WALL = dict(size=(0.08, 0.04, 0.028), joint=lm.Joint(33.82))


def test_block_on_a_slope_slides_at_the_friction_angle():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    p = collapse(b, lm.Loads.tilting(b), tolerance=1e-3)
    assert p.collapse_multiplier == pytest.approx(0.4, rel=5e-3)
    assert p.details["largest stable"] <= 0.4 * (1 + 1e-4) <= p.details["smallest moving"] * (1 + 1e-3)


@pytest.mark.parametrize("grid", [(2, 2), (4, 8), (8, 8)])
def test_slender_block_overturns_at_its_slenderness_with_any_number_of_edge_points(grid):
    b = on_slab([((0, 0, 0), (0.2, 0.3, 0.8))], mu=0.7)
    p = collapse(b, lm.Loads.horizontal(b), contact_points=grid, tolerance=1e-3)
    assert p.collapse_multiplier == pytest.approx(0.25, rel=5e-3)


def test_stack_of_five_equal_blocks_overturns_at_a_fifth_of_its_slenderness():
    b = stack([(0.2, 0.2)] * 5, mu=0.7)
    # joints so stiff that the sway within 0.2 % of the collapse does not show: the closed form is that of rigid blocks
    stiff = dem.JointOptions(stiffness_factor=10.0)
    p = collapse(b, lm.Loads.horizontal(b), tolerance=1e-3, joint_options=stiff)
    assert p.collapse_multiplier == pytest.approx(0.2, rel=5e-3)
    assert p.certificate.equilibrium_residual < 1e-4
    assert p.certificate.yield_violation < 1e-12


@pytest.mark.slow
def test_free_wall_of_104_blocks_overturns_out_of_plane_at_thickness_over_height():
    wall = running_bond(9, 11, **PAVIA_WALL)
    assert wall.n_blocks - 1 == 104
    p = collapse(wall, lm.Loads.horizontal(wall, (0, 1, 0)), contact_points=(2, 4))
    assert p.status == "solved"
    assert p.collapse_multiplier == pytest.approx(0.028 / 0.44, rel=0.03)
    # blocks turn about the foot: the top moves most, out of plane
    speed = p.mechanism.twists[:, 1]
    assert speed[np.argmax(wall.centroids[:, 2])] == pytest.approx(speed.max(), rel=0.05)


def test_every_multiplier_comes_with_its_error_budget_and_an_interval():
    b = on_slab([((0, 0, 0), (0.2, 0.3, 0.8))], mu=0.7)
    p = lm.predict(b, lm.Loads.horizontal(b), "dem", contact_points=(2, 2), tolerance=2e-3)
    budget = p.details["error budget"]
    assert set(budget) == {"stiffness", "ks/kn", "contact points", "rate"}
    # edge points overturn at the same load whatever their number and stiffness
    assert all(abs(row["change"]) <= 4e-3 and row["status"] == "solved" for row in budget.values())
    low, high = p.interval
    assert low <= p.collapse_multiplier < high
    assert low <= 0.25 * (1 + 1e-3)
    assert high >= 0.25 * (1 - 1e-3)
    assert f"interval {low:.6g} to {high:.6g}: bracket, stiffness" in str(p)


@pytest.mark.slow
def test_intervals_of_columns_on_soft_joints_hold_the_value_of_rigid_ones():
    # two of these ten did while repeats resolved to a whole per cent counted as "+0.00 %"
    rng = np.random.default_rng(7)
    held = []
    for _ in range(10):
        count, width, height = int(rng.integers(2, 6)), rng.uniform(0.15, 0.3), rng.uniform(0.15, 0.25)
        rigid = width / (count * height)
        # the foot shortens by 1e-5 to 5e-4 of its width: 0.3 to 2 % of the multiplier
        kn = 2000.0 * 9.81 * count * height / (10.0 ** rng.uniform(-5.0, -3.3) * width)
        mu = 2.0 * rigid + 0.3
        joint = lm.Joint(np.rad2deg(np.arctan(mu)), normal_stiffness=kn, shear_stiffness=kn)
        column = stack([(width, height)] * count, depth=0.3, joint=joint)
        p = dem.collapse(column, lm.Loads.horizontal(column), contact_points=(2, 4), moved_limit=0.05)
        held.append(p.interval[0] <= rigid <= p.interval[1])
        assert p.interval[1] < 1.03 * rigid
    assert sum(held) >= 9


def test_the_error_budget_finds_the_torsion_that_more_points_lose_at_the_price_of_a_search():
    # two points across carry a torque in the corners, 0.7071 mu N a; a face carries 0.3826
    b = on_slab([((0, 0, 0), (0.4, 0.4, 0.4))], mu=0.5)
    live = np.zeros((2, 6))
    live[1, 5] = 0.5 * b.weights[1] * 0.4
    twist = lm.Loads(lm.Loads.weight(b).dead, live)
    p = dem.collapse(b, twist, contact_points=(2, 2))
    assert p.collapse_multiplier == pytest.approx(np.sqrt(0.5), rel=5e-3)
    change = p.details["error budget"]["contact points"]
    # the repeat starts from nine tenths of the value found, far above its own: it must come down all the way
    assert change["multiplier"] == pytest.approx((np.sqrt(2.0) + np.arcsinh(1.0)) / 6.0, rel=3e-2)
    assert change["change"] < -0.2
    assert p.interval[0] == pytest.approx(change["multiplier"], rel=1e-2)
    assert any("not converged in this respect" in w for w in p.warnings)


@pytest.mark.slow
def test_loads_that_stay_undecided_widen_the_bracket_and_the_status_says_so():
    a = lm.experiments.load("ferris-tin-loi-2001", "wall-3", rounding=0.02).assembly()
    p = collapse(a, lm.Loads.horizontal(a), contact_points=(2, 2), max_steps=3000)
    inside = [u for u in p.details["undecided"] if p.interval[0] < u < p.interval[1]]
    assert inside
    assert p.status != "solved"
    # what is in equilibrium is so also with more time, and what moves does not stand
    longer = collapse(
        a, lm.Loads.horizontal(a), contact_points=(2, 2), joint_options=dem.JointOptions(stiffness_factor=0.1)
    )
    assert p.interval[0] <= longer.collapse_multiplier * 1.005
    assert longer.collapse_multiplier <= p.interval[1] * 1.005


@pytest.mark.parametrize("high", [False, True])
@pytest.mark.parametrize("ratio", [5.0, 20.0, 40.0, 400.0])
def test_small_stack_overturns_at_its_own_slenderness_beside_or_on_a_large_block(ratio, high):
    # against the mean block load the falling stack counted as balanced: 62 to 125 % too much at 20 and 40, "solved"
    wall = beside_or_on_a_large_block(ratio, high=high)
    p = collapse(wall, lm.Loads.horizontal(wall), contact_points=(2, 2))
    assert p.status in ("solved", "almost solved")
    assert p.collapse_multiplier == pytest.approx(0.25, rel=6e-3)
    assert p.interval[0] <= 0.25 <= p.interval[1]


@pytest.mark.parametrize(("scale", "density"), [(1e-3, 2000.0), (1e3, 2.0), (1e-3, 2e6)])
def test_small_stack_beside_a_large_block_in_other_units(scale, density):
    wall = beside_or_on_a_large_block(30.0, high=False, scale=scale, density=density)
    p = collapse(wall, lm.Loads.horizontal(wall), contact_points=(2, 2))
    assert p.collapse_multiplier == pytest.approx(0.25, rel=6e-3)


@pytest.mark.parametrize("density", [0.0, 1e-3])
def test_a_weightless_stone_between_heavy_ones_is_no_obstacle(density):
    # a billionth of the load that presses it: its own load is below the rounding of the forces on it
    column = on_slab(
        [((0, 0, 0), (0.2, 0.2, 0.002)), ((0, 0, 0.002), (0.2, 0.2, 0.602))], mu=0.75, density=[2000.0, density, 2000.0]
    )
    p = collapse(column, lm.Loads.horizontal(column), contact_points=(2, 2))
    assert p.status == "solved"
    # the weight acts 0.302 above the slab, and turns about the foot or the shim's upper edge
    assert p.collapse_multiplier == pytest.approx(0.1 / 0.302, rel=1e-2)


def test_balanced_forces_of_a_block_that_slides_on_are_no_equilibrium():
    # at tan(phi) a block that was given a push slides on at a steady pace under forces that balance
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    loads = lm.Loads.horizontal(b)
    state = dem.initial_state(b, loads)
    scale = Scale.of(b, loads.dead)
    hold(b, state, loads.dead, scale, dem.Damping(0.8), tolerance=1e-6, limit=0.01, max_steps=5_000)
    hold(b, state, loads.dead + 0.4 * loads.live, scale, dem.Damping(0.8), tolerance=1e-6, limit=0.01, max_steps=5_000)
    state.bodies.vel[1, 0] = 2e-6  # m per step, 10 mm in 5000
    verdict = hold(
        b, state, loads.dead + 0.4 * (1.0 + 1e-6) * loads.live, scale, dem.Damping(), tolerance=1e-4, limit=4e-3,
        max_steps=5_000,
    )
    assert verdict.outcome == "moving"


def test_a_column_that_still_sank_when_its_forces_were_small_is_at_rest_once_it_stops():
    # what it sank since its forces were small first was counted for good: 60,000 steps, "undecided"
    b = on_slab([((0, 0, 0.1 * k), (0.2, 0.2, 0.1 * k + 0.1)) for k in range(30)], mu=0.6)
    loads = lm.Loads.weight(b)
    state = dem.initial_state(b, loads, contact_points=(2, 2))
    sunk = np.cumsum(np.arange(30, 0, -1)) * b.weights[1] / (state.joints.law[0, LAW.kn] * 0.04)
    verdict = hold(
        b, state, loads.dead, Scale.of(b, loads.dead), dem.Damping(0.8), tolerance=np.inf, limit=2.0 * sunk[-1],
        max_steps=5_000,
    )
    assert verdict.outcome == "equilibrium"
    assert -state.bodies.shift[1:, 2] == pytest.approx(sunk, rel=0.05)


def test_a_block_past_its_support_cannot_stand_under_dead_load():
    b = on_slab([((0, 0, 0), (0.2, 0.2, 0.2)), ((0.15, 0, 0.2), (0.45, 0.2, 0.4))], mu=0.7)
    p = collapse(b, lm.Loads.horizontal(b))
    assert p.status == "cannot stand under dead load"
    assert np.isnan(p.collapse_multiplier)


def test_a_load_that_cannot_collapse_the_block_is_unbounded():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.7)
    loads = lm.Loads.body_force(b, (0, 0, -1))
    assert collapse(b, loads, contact_points=(2, 2)).status == "unbounded"


def test_a_short_budget_is_undecided_and_never_counted_as_stable():
    wall = running_bond(3, 6, **PAVIA_WALL)
    p = collapse(wall, lm.Loads.horizontal(wall, (0, 1, 0)), contact_points=(2, 4), max_steps=1700)
    assert p.details["undecided"]
    assert p.collapse_multiplier < 0.028 / 0.24
    assert p.status == "not converged" or any("undecided" in w for w in p.warnings)


def test_an_interrupted_search_returns_the_loads_found_in_equilibrium():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    tried = []

    def stop(load, verdict):
        tried.append(load)
        if len(tried) == 3:
            raise KeyboardInterrupt

    p = collapse(b, lm.Loads.horizontal(b), progress=stop)
    assert p.status == "not converged"
    assert p.collapse_multiplier == tried[1]
    assert any("interrupted" in w for w in p.warnings)


def test_a_stone_pushed_off_its_centre_turns_and_slides_at_the_exact_load_of_every_grid():
    # the kinetic stops fed a fast elastic mode: (4, 4) never settled above 0.1, (8, 8) at no load
    mu, side, push = 0.5, 0.4, (0.2, 0.38, 0.3)
    b = on_slab([((0, 0, 0), (side, side, 0.2)), ((0, 0, 0.2), (side, side, 0.4))], mu=mu)
    loads = lm.Loads.weight(b).with_point_load(b, 2, (b.weights[2], 0.0, 0.0), at=push)

    def exact(grid):
        """Rigid stone turning about its best centre (cx, cy) on the elastic pressure of the same points."""
        at = [np.linspace(-0.5, 0.5, k) * side for k in grid]
        # the trapezoid rule stood here: it bends 1 + 2 / (k - 1)^2 too stiffly, and the elastic pressure follows it
        weights = [lattice_weights(k) for k in grid]
        x, y = (v.ravel() for v in np.meshgrid(*at, indexing="ij"))
        area = np.outer(*weights).ravel()
        arm, lever = push[1] - side / 2, push[2] - 0.2

        def excess(load):
            normal = area * (1.0 + load * lever * x / (area * x * x).sum())
            assert normal.min() > 0
            power = [
                minimize(
                    lambda c: mu * (normal * np.hypot(x - c[0], y - c[1])).sum() / abs(arm - c[1]), (0.01, cy),
                    method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-9, "maxiter": 2000},
                ).fun
                for cy in (-0.3, -0.15, -0.05, 0.05)
            ]
            return min(power) - load

        return brentq(excess, 0.2, 0.5, xtol=1e-6)

    values = []
    for grid in ((2, 2), (2, 4), (4, 4), (8, 8)):
        p = collapse(b, loads, contact_points=grid, tolerance=1e-3, max_steps=30_000)
        assert p.status == "solved"
        assert p.collapse_multiplier == pytest.approx(exact(grid), rel=2e-3)
        assert all(u > 0.9 * p.collapse_multiplier for u in p.details["undecided"])
        values.append(p.collapse_multiplier)
    # more points share the torque with the middle of the joint
    assert (np.diff(values) < 1e-3 * np.array(values[:-1])).all()


def test_joints_without_stiffness_get_a_default_and_the_user_is_told():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], mu=0.4)
    assert any("no stiffness" in w for w in collapse(b, lm.Loads.horizontal(b)).warnings)
    given = on_slab([((0, 0, 0), (0.3, 0.3, 0.2))], joint=lm.Joint(20.0, normal_stiffness=1e10))
    assert not collapse(given, lm.Loads.horizontal(given)).warnings


def test_cohesion_and_tension_carry_a_glued_block_to_its_brittle_moment():
    # elastic-brittle section: ft b h^2 / 6 at the edge, against which perfect plasticity reaches much more
    ft, side = 2e4, 0.2
    joint = lm.Joint(35.0, cohesion=1e5, tensile_strength=ft, residual_tensile_strength=0.0, residual_cohesion=0.0)
    b = on_slab([((0, 0, 0), (side, side, side))], joint=joint, density=2000.0)
    loads = lm.Loads.weight(b).with_point_load(b, 1, (1.0, 0.0, 0.0), at=(0.1, 0.1, 2.0))
    rows = 28  # what is left when a row has gone ends in a whole point: 3.3 % too much with 20 rows
    p = collapse(b, loads, contact_points=(rows, rows), tolerance=1e-3)
    weight, section = b.weights[1], side**3 / 6.0
    exact = (ft + weight / side**2) * section / 2.0
    # the same section as rows of points: the load at which the outermost row left reaches ft, whichever k rows are gone
    s = np.linspace(-0.5, 0.5, rows) * side
    a = side**2 * lattice_weights(rows)

    def capacity(k):
        left, x = a[k:], s[k:]
        # stress p + q x, tension positive: sum is -weight, ft at the outermost row; moment about the middle
        matrix = np.array([[left.sum(), (left * x).sum()], [1.0, x[0]]])
        p0, q0 = np.linalg.solve(matrix, [-weight, ft])
        return -((p0 + q0 * x) * left * x).sum() / 2.0

    discrete = max(capacity(k) for k in range(5))
    # with the second moment of the face the first row gives way exactly where the whole section does
    assert capacity(0) == pytest.approx(exact, rel=1e-9)
    assert discrete == pytest.approx(exact, rel=0.03)
    assert p.collapse_multiplier == pytest.approx(discrete, rel=5e-3)


@pytest.mark.slow
def test_ferris_tin_loi_wall_5_with_rounded_ends_agrees_with_our_non_associative_value():
    a = lm.experiments.load("ferris-tin-loi-2001", "wall-5", rounding=0.02).assembly()
    loads = lm.Loads.horizontal(a)
    softer = dem.JointOptions(stiffness_factor=0.1)
    p = collapse(a, loads, contact_points=(2, 2), joint_options=softer, tolerance=1e-2)
    exact = lm.limit_analysis(a, loads, "non-associative", search="quick").collapse_multiplier
    assert p.collapse_multiplier == pytest.approx(exact, rel=0.03)


@pytest.mark.parametrize(
    ("wall", "lmgc90", "udec"),
    [("wall-1", 0.578, 0.577),
        pytest.param("wall-2", 0.512, 0.495, marks=pytest.mark.slow),
        pytest.param("wall-3", 0.321, 0.325, marks=pytest.mark.slow),
        pytest.param("wall-4", 0.242, 0.236, marks=pytest.mark.slow)],
)
def test_ferris_tin_loi_walls_with_rounded_ends_agree_with_lmgc90_or_udec(wall, lmgc90, udec):
    a = lm.experiments.load("ferris-tin-loi-2001", wall, rounding=0.02).assembly()
    # the stiffness does not show (x 0.1 and x 1 agree to 0.4 %), the softer one gets there in half the steps
    softer = dem.JointOptions(stiffness_factor=0.1)
    p = collapse(a, lm.Loads.horizontal(a), contact_points=(2, 2), joint_options=softer)
    assert min(abs(p.collapse_multiplier / lmgc90 - 1.0), abs(p.collapse_multiplier / udec - 1.0)) < 0.04


def test_loads_asked_for_below_one_that_stood_tell_nothing_of_where_collapse_is():
    c = Controls(0.01, max_steps=1, moved_limit=0.3, equilibrium=1e-3, damping=dem.Damping(), unit=1.0, first=0.1)

    def climbed(*through):
        bracket, loads = _Bracket(1.0, through, c, np.inf), []
        for _ in range(6):
            loads.append(bracket.next_load())
            bracket.held(loads[-1], [])
        return loads

    assert climbed(0.5, 1.0) == climbed()


def test_an_undecided_repeat_is_no_measured_change():
    # so few steps that the search ends but its repeats with other joints do not
    column = stack([(0.2, 0.2)] * 3)
    loads = lm.Loads.horizontal(column)
    full = dem.collapse(column, loads, contact_points=(2, 2), max_steps=1_500)
    undecided = [name for name, row in full.details["error budget"].items() if row["status"] == "not converged"]
    assert undecided
    for name in undecided:
        assert np.isnan(full.details["error budget"][name]["change"])
        assert f"{name} undecided" in str(full)
    assert full.interval[0] <= full.collapse_multiplier <= full.interval[1]


def test_one_check_is_given_as_one_of_several():
    column = stack([(0.2, 0.2)] * 3)
    with pytest.raises(ValueError, match="such as"):
        dem.collapse(column, lm.Loads.horizontal(column), error_budget="stiffness")


def test_joints_so_soft_that_the_wall_sways_by_what_counts_as_collapse_are_pointed_out():
    column = stack([(0.2, 0.4)] * 3)
    soft = column.with_joints(lm.Joint(35.0, normal_stiffness=1e7, shear_stiffness=1e7))
    p = collapse(soft, lm.Loads.horizontal(soft), contact_points=(4, 2), moved_limit=0.01)
    assert any("raise moved_limit" in w for w in p.warnings)
    stiff = collapse(column, lm.Loads.horizontal(column), contact_points=(4, 2))
    assert not any("raise moved_limit" in w for w in stiff.warnings)


def test_a_wall_whose_weight_is_neglected_is_decided_though_its_loose_blocks_weigh_next_to_nothing():
    # sheared wall without weight, turning about its toe: H h = N L / 2
    joint = lm.Joint.from_friction_coefficient(0.6)
    light = {"density": 1e-6, "beam_density": 1e-6, "top_beam": 0.05}
    wall = lm.build.wall(length=1.2, courses=6, unit=(0.4, 0.2, 0.2), joint=joint, **light)
    loads = lm.Loads.weight(wall).with_precompression(wall, 1e5).with_point_load(wall, "beam", (1e3, 0.0, 0.0))
    found = collapse(wall, loads)
    assert found.status == "solved"
    assert found.details["undecided"] == []
    assert found.collapse_multiplier == pytest.approx(1e5 * 0.6 / (6 * 0.2 + 0.025) / 1e3, rel=2e-3)


@pytest.mark.slow
def test_a_jammed_wedge_shows_what_its_ratio_of_stiffnesses_decides():
    # its weight W drives it in with friction mobilised: N = W / (2 (s + mu c)); pulled out, friction turns round, which
    # unloads N by its part 2 mu s / (r c + mu s), r = ks / kn. Weight that acts at once overshoots and jams it deeper
    angle, mu = np.deg2rad(80.0), 0.3
    s, c, run = np.cos(angle), np.sin(angle), 0.3 / np.tan(angle)
    seat = [(-1, -0.3), (0, -0.3), (0, 0), (-run, 0.3), (-1, 0.3)]
    body = [(0, 0), (0.1, 0), (0.1 + run, 0.3), (-run, 0.3)]

    def holds(shear, checks):
        joint = lm.Joint.from_friction_coefficient(mu, normal_stiffness=1e9, shear_stiffness=shear * 1e9)
        a = lm.Assembly.from_polygons(
            [seat, [(0.1 - x, z) for x, z in reversed(seat)], body], thickness=0.3, joint=joint, fixed=[0, 1]
        )
        live = np.zeros((3, 6))
        live[2, 2] = a.weights[2]
        loads = lm.Loads(lm.Loads.weight(a).dead, live)
        return dem.collapse(a, loads, contact_points=(2, 2), tolerance=2e-3, error_budget=checks)

    def exact(r):
        return 1.0 + (mu * c - s) / (mu * c + s) * (1.0 - 2.0 * mu * s / (r * c + mu * s))

    found, soft = holds(1.0, ("ks/kn",)), holds(0.4, ())
    row = found.error_budget["ks/kn"]
    assert found.collapse_multiplier == pytest.approx(exact(1.0), rel=5e-3)
    assert soft.collapse_multiplier == pytest.approx(exact(0.4), rel=0.01)
    assert row["multiplier"] == pytest.approx(exact(0.4), rel=0.01)
    assert any("ks/kn changed" in w for w in found.warnings)
    assert found.interval[0] == pytest.approx(row["multiplier"], rel=3e-3)
