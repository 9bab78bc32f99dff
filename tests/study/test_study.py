"""Studies: the same table whatever runs it or interrupts it, random joints within their bounds, laws of the results."""

import concurrent.futures
import csv
import math

import numpy as np
import pytest
from scipy import stats
from walls import on_slab

import limitmason as lm
from limitmason import study
from limitmason.study.block_size import scaled_unit
from limitmason.study.random_joints import draw_joints

DRAWS = {
    "friction_coefficient": study.Random(study.normal(0.65, 0.1)),
    "cohesion": study.Random(study.lognormal(500.0, 0.5), per="interface"),
}
BRICKS = {"length": 0.4, "height": 0.4, "unit": (0.2, 0.1, 0.1), "joint": lm.Joint(40.0)}


def make_wall(courses=3, **options):
    joint = options.pop("joint", lm.Joint(33.0))
    wall = lm.build.wall(length=0.6, courses=courses, unit=(0.2, 0.1, 0.1), joint=joint, **options)
    return wall, lm.Loads.horizontal(wall)


def stacked(slenderness):
    wall = on_slab([((0, 0, 0), (0.2, 0.2, 0.2 * slenderness))], mu=0.9)
    return wall, lm.Loads.horizontal(wall)


def twisted_block():
    b = on_slab([((0, 0, 0), (0.4, 0.4, 0.4))], mu=0.5)
    live = np.zeros((2, 6))
    live[1, 5] = 0.5 * b.weights[1] * 0.4
    return b, lm.Loads(lm.Loads.weight(b).dead, live)


def square(x, y=1):
    if x == 7:
        raise RuntimeError("seven")
    return {"square": x * x * y, "third": x / 3}


@pytest.fixture(scope="module")
def table():
    return study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=3)


def test_sweep_runs_every_combination_in_order(tmp_path):
    found = study.sweep(square, {"x": (1, 2), "y": (1, 10)}, units={"square": "m2"})
    assert [(r["x"], r["y"], r["square"]) for r in found] == [(1, 1, 1), (1, 10, 10), (2, 1, 4), (2, 10, 40)]
    assert found["third"] == pytest.approx([1 / 3, 1 / 3, 2 / 3, 2 / 3])
    found.write_csv(tmp_path / "t.csv")
    rows = list(csv.reader((tmp_path / "t.csv").open()))
    assert rows[:2] == [["x", "y", "square", "third"], ["# units: -", "-", "m2", "-"]]
    assert float(rows[2][3]) == 1 / 3
    assert len(found.where(x=2)) == 2


def test_sweep_goes_on_after_an_error(tmp_path):
    store = tmp_path / "rows.jsonl"
    with pytest.raises(RuntimeError, match="seven"):
        study.sweep(square, {"x": (5, 6, 7, 8)}, store=store, key="squares")
    lines = []
    found = study.sweep(lambda x: {"square": x * x, "third": x / 3}, {"x": (5, 6, 7, 8)}, store=store, key="squares",
                        progress=lines.append)
    assert len(lines) == 3  # what was there, then 7 and 8
    assert found == study.sweep(lambda x: {"square": x * x, "third": x / 3}, {"x": (5, 6, 7, 8)})


def test_rows_of_other_points_under_the_same_key_are_no_rows_of_this_study(tmp_path):
    """A value more along the last name moves all numbers: (2, 2) stood there twice, and (1, 3) was never run."""
    store = tmp_path / "rows.jsonl"
    study.sweep(square, {"x": (1, 2), "y": (1, 2)}, store=store, key="squares")
    with pytest.raises(ValueError, match="run 2 is of another point, x = 2 in place of 1: the points have changed"):
        study.sweep(square, {"x": (1, 2), "y": (1, 2, 3)}, store=store, key="squares")
    longer = study.sweep(square, {"x": (1, 2, 3), "y": (1, 2)}, store=store, key="squares")
    assert longer == study.sweep(square, {"x": (1, 2, 3), "y": (1, 2)})


def test_runs_that_are_not_finished_are_told_by_a_study_too():
    def build(unit):
        if unit[0] < 0.15:
            raise study.Unfinished
        wall = lm.build.wall(length=0.4, height=0.4, unit=unit, joint=lm.Joint(40.0))
        return wall, lm.Loads.horizontal(wall, (0, 1, 0))

    found = study.block_size_study(build, (0.5, 1.0), unit=(0.2, 0.1, 0.1))
    assert found.notes == ("2 of 4 runs are not finished: call again with the same store",)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 3])
def test_same_seed_same_table_whatever_the_number_of_workers(workers, table):
    assert study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=3, workers=workers) == table


def test_threads_of_the_standard_library_give_the_same_table(table):
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=3, executor=pool) == table


def test_a_dask_cluster_gives_the_same_table(table):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=3, executor=client) == table


def test_another_seed_gives_another_table(table):
    assert study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=4) != table


@pytest.mark.parametrize("cut", [0, 15])
def test_resumed_after_a_kill_the_table_is_identical(cut, tmp_path, table):
    store = tmp_path / "mc.jsonl"
    assert study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=3, store=store) == table
    lines = store.read_text().splitlines(keepends=True)
    store.write_text("".join(lines[:4]) + lines[4][:cut])
    done = []
    again = study.monte_carlo(make_wall(), 6, joints=DRAWS, seed=3, store=store, progress=done.append)
    assert again == table
    assert len(done) == 1 + 3
    assert len(store.read_text().splitlines()) == 7


def test_a_store_of_another_study_is_refused(tmp_path):
    store = tmp_path / "mc.jsonl"
    study.monte_carlo(make_wall(), 2, joints=DRAWS, store=store)
    for change in ({"seed": 1}, {"options": {"contact_model": "grid"}}):
        with pytest.raises(ValueError, match="another study"):
            study.monte_carlo(make_wall(), 2, joints=DRAWS, store=store, **change)
    with pytest.raises(ValueError, match="another study"):
        study.monte_carlo(make_wall(courses=4), 2, joints=DRAWS, store=store)
    other = tmp_path / "other.txt"
    other.write_text("some text\nmore\n")
    with pytest.raises(ValueError, match="not a store"):
        study.monte_carlo(make_wall(), 2, joints=DRAWS, store=other)


@pytest.mark.slow
def test_multiplier_of_a_sliding_block_has_the_distribution_of_its_friction():
    # one flat block slides at its coefficient: lambda = tan(phi), sample by sample
    block = on_slab([((0, 0, 0), (1.0, 1.0, 0.2))], mu=0.5)
    found = study.monte_carlo(
        (block, lm.Loads.horizontal(block)), 40, joints={"friction_coefficient": DRAWS["friction_coefficient"]}
    )
    assert found["multiplier"] == pytest.approx(found["friction_coefficient"], abs=1e-6)
    # a Latin hypercube has one sample in each fortieth of the probability
    shares = stats.norm(0.65, 0.065).cdf(found["friction_coefficient"].astype(float))
    assert sorted((shares * 40).astype(int)) == list(range(40))


def test_longer_random_runs_begin_with_the_shorter_ones():
    short, long = (study.monte_carlo(make_wall(), n, joints=DRAWS, scheme="random") for n in (2, 4))
    assert short.rows == long.rows[:2]
    for column in ("friction_coefficient", "cohesion mean", "multiplier"):
        assert len(set(long[column])) == 4, column


def test_draws_stay_within_physical_bounds_and_dilatancy_below_friction():
    wall, _ = make_wall()
    joints = {
        "friction_angle_deg": study.Random(study.normal(30.0, 0.3), per="interface", low=10.0),
        "dilatancy_angle_deg": study.Random(study.uniform(0.0, 60.0), per="interface"),
        "cohesion": study.Random(study.normal(100.0, 3.0), per="kind"),
    }
    for sample in range(5):
        drawn, record = draw_joints(wall, joints, sample, 0, {})
        laws = [i.joint for i in drawn.interfaces]
        assert all(j.friction_angle_deg >= 10.0 and j.dilatancy_angle_deg <= j.friction_angle_deg for j in laws)
        assert all(j.cohesion >= 0.0 for j in laws)
        assert len({j.friction_angle_deg for j in laws}) == len(laws)
        assert len({(i.kind, i.joint.cohesion) for i in drawn.interfaces}) == len({i.kind for i in drawn.interfaces})
        assert record["cohesion deviation"] > 0.0
    # truncated, not clipped: half the probability of what is left lies below the conditional median
    half = study.Random(study.normal(1.0, 1.0), low=1.0).value(0.5)
    assert half == pytest.approx(stats.norm(1.0, 1.0).ppf(0.75))


def test_correlation_length_makes_neighbours_alike():
    wall, _ = make_wall(courses=8)
    centre = wall.arrays.centre
    near = np.linalg.norm(centre[:, None] - centre[None], axis=2)
    first, second = np.nonzero((near > 0) & (near < 0.12))
    differences = []
    for length in (0.0, 5.0):
        random = study.Random(study.normal(30.0, 0.1), per="interface", correlation_length=length)
        joints = {"friction_angle_deg": random}
        steps = []
        for sample in range(5):
            drawn = draw_joints(wall, joints, sample, 0, {})[0]
            phi = np.array([i.joint.friction_angle_deg for i in drawn.interfaces])
            steps.append(np.abs(phi[first] - phi[second]).mean())
        differences.append(np.mean(steps))
    assert differences[1] < 0.4 * differences[0]


@pytest.mark.slow
def test_sobol_gives_all_variance_to_what_the_multiplier_depends_on():
    # a slender block overturns at 1 / slenderness: friction is without effect
    found = study.sobol(
        stacked, 64, joints={"friction_coefficient": study.Random(study.uniform(0.8, 1.0))},
        parameters={"slenderness": study.Random(study.uniform(3.0, 6.0))},
    )
    shares = dict(zip(found.names, zip(found.first, found.total, strict=True), strict=True))
    assert shares["friction_coefficient"] == pytest.approx((0.0, 0.0), abs=1e-6)
    assert shares["slenderness"] == pytest.approx((1.0, 1.0), abs=0.06)
    assert len(found.table) == 64 * 4


def test_sobol_of_one_variable_gives_it_all():
    slenderness = {"slenderness": study.Random(study.uniform(3.0, 6.0))}
    found = study.sobol(stacked, 16, "mechanisms", parameters=slenderness)
    assert found.first == pytest.approx([1.0], abs=0.2)
    assert found.total == pytest.approx([1.0], abs=0.2)


def test_sobol_of_what_no_draw_changes_is_refused():
    # shares of a variance that is rounding alone were 1.7 and 1.6
    none = {"cohesion": study.Random(study.uniform(0.0, 1e-9))}
    with pytest.raises(lm.errors.InputError, match="no scatter to share: every multiplier is"):
        study.sobol(make_wall(), 4, joints=none)


def test_a_study_takes_an_iterator_for_every_method_it_runs():
    one_by_one = study.block_size_study(BRICKS, iter((0.5, 1.0)), ("associative", "mechanisms"))
    assert one_by_one == study.block_size_study(BRICKS, (0.5, 1.0), ("associative", "mechanisms"))
    shares = study.dilatancy_study(*make_wall(), iter((1.0,)), ("non-associative",))
    assert list(shares["share"]) == [1.0]


@pytest.mark.parametrize("call, message", [
    (lambda: study.monte_carlo(make_wall(), 2), "nothing is random"),
    (lambda: study.monte_carlo(make_wall(), 2, joints={"phi": DRAWS["cohesion"]}), "joint property .* got 'phi'"),
    (lambda: study.monte_carlo(make_wall(), 0, joints=DRAWS), "samples"),
    (lambda: study.monte_carlo(make_wall(), 2, joints=DRAWS, scheme="sobol"), "scheme"),
    (lambda: study.monte_carlo(make_wall(), 2, parameters={"width": DRAWS["friction_coefficient"]}), "fixed model"),
    (lambda: study.sobol(make_wall(), 8, joints=DRAWS), "per assembly"),
    (lambda: study.sobol(make_wall(), 6, joints={"cohesion": study.Random(study.normal(9, 0.1))}), "power of two"),
    (lambda: study.Random(study.normal(1, 0.1), per="course"), "per must be"),
    (lambda: study.Random(3.0), "frozen"),
    (lambda: study.Random(study.normal(1, 0.1), high="2"), "high must be a number, got '2'"),
    (lambda: study.Random(study.normal(1, 0.1), per="block", correlation_length=np.inf), "correlation_length must be"),
    (lambda: study.uniform(0.0, np.inf), "uniform: high must be a finite number"),
    (lambda: study.uniform("0", 1.0), "uniform: low must be a finite number"),
    (lambda: study.Random(stats.norm), "frozen"),
    (lambda: study.normal(0.0, 0.1), "mean of 0"),
    (lambda: study.sweep(lambda x: {"x": 7}, {"x": [1]}), "'x', which is the name of a parameter"),
    (lambda: study.sweep(lambda value: 7, {"value": [1]}), "'value', which is the name of a parameter"),
    (lambda: study.sweep(square, {}), "no parameters"),
    (lambda: study.sweep(square, []), "no points"),
    (lambda: study.dilatancy_study(*make_wall(), (0.0, 1.1)), "psi / phi"),
    (lambda: study.dilatancy_study(*make_wall(), methods=("fem",)), "unknown method"),
    (lambda: study.dilatancy_study(*make_wall(), methods=("limit",)), "'limit' does not read psi"),
    (lambda: study.dilatancy_study(*make_wall(), methods="mechanisms"), "'mechanisms' does not read psi"),
    (lambda: study.dilatancy_study(*make_wall(), methods=()), "name at least one"),
    (lambda: study.dilatancy_study(*make_wall(), methods="dem", options={"limit": {}}), "'limit', which is not among"),
    (lambda: study.block_size_study(BRICKS, methods=()), "name at least one"),
    (lambda: study.block_size_study(BRICKS, options={"dem": {}}), "'dem', which is not among"),
    (lambda: study.contact_point_study(*make_wall(), (1, 2)), "at least 2"),
    (lambda: study.contact_point_study(*make_wall(), (2.5,)), "whole number"),
    (lambda: study.contact_point_study(*make_wall(), (2,), options={"contact_points": (2, 2)}), "points= and along="),
    (lambda: study.dilatancy_study(*make_wall(), 0.5), "shares must be a list"),
    (lambda: study.block_size_study(BRICKS, unit=(0.4, 0.1, 0.2)), "leave unit= out"),
    (lambda: study.block_size_study(lambda _: make_wall(), unit=BRICKS["unit"], direction=(1, 0, 0)), "its own loads"),
    (lambda: study.sobol(make_wall(), "8", joints={"cohesion": study.Random(study.normal(9, 0.1))}), "samples"),
    (lambda: study.Stop("multiplier", every=2.5), "every must be a whole number"),
    (lambda: study.Stop("multiplier", mean="1"), "mean must be a number"),
    (lambda: study.running(study.sweep(square, {"x": [1, 2]}), "y"), "no column 'y'"),
    (lambda: study.sweep(square, {"x": [1]}, batch=1.5, enough=lambda _: False), "batch must be a whole number"),
    (lambda: study.sweep(square, {"x": [1]}, enough=lambda _: True), "give batch="),
    (lambda: study.sweep(square, [1]), "a list of points"),
    (lambda: study.sweep(None, {"x": [1]}), "function must be one that is called with a point"),
    (lambda: study.block_size_study(lambda _: make_wall()[0], (1.0,), unit=BRICKS["unit"]), "it returned Assembly"),
    (lambda: study.block_size_study(lambda _: make_wall(), (1.0,), unit=(0.2, 0.1)), "unit must be"),
    (lambda: study.monte_carlo(
        lambda width: make_wall()[0], 2, parameters={"width": study.Random(study.normal(1, 0.1))}
    ), r"must return a pair \(assembly, loads\), it returned Assembly"),
    (lambda: scaled_unit((1, 1, 1), 1.0, "height"), "vary"),
    (lambda: study.block_size_study({**BRICKS, "unit": (0.2, 0.1)}), r"unit must be \(length, height, thickness\)"),
    (lambda: study.block_size_study({k: v for k, v in BRICKS.items() if k != "height"}), "one of height and courses"),
])
def test_mistakes_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.slow
def test_dilatancy_never_lowers_the_multiplier_and_ends_at_the_associative_value():
    wall, loads = make_wall(courses=4)
    options = {"dem": {"contact_points": (2, 2)}, "non-associative": {"search": "quick"}}
    found = study.dilatancy_study(wall, loads, (0.0, 1.0), options=options)
    exact = lm.limit_analysis(wall, loads).collapse_multiplier
    for method, tolerance in (("non-associative", 1e-6), ("dem", 0.01)):
        own = found.where(method=method)
        assert own["multiplier"][0] < own["multiplier"][1] * (1.0 + 1e-6)
        assert own["multiplier"][1] == pytest.approx(exact, rel=tolerance)
        assert own["ratio"] == pytest.approx(own["multiplier"] / own["multiplier"][1])
        assert own["change"][1] == pytest.approx(100.0 * abs(1.0 - 1.0 / own["ratio"][0]))
    low = found.where(method="non-associative")["multiplier"][0]
    dem = found.where(method="dem", share=0.0).rows[0]
    assert dem["high"] >= low * (1 - 1e-6)
    assert dem["low"] <= exact


def mean_radius_of_points(*numbers):
    """Sum of area times distance from the centre of a unit square: evenly spaced points, ends moved in to 1/12."""
    sides = []
    for n in numbers:
        s, w = np.linspace(-0.5, 0.5, n), np.full(n, 1.0 / (n - 1))
        w[[0, -1]] /= 2.0
        if n > 2:
            handed = (w @ s**2 - 1.0 / 12.0) / (2.0 * (s[0] ** 2 - s[1] ** 2))
            w[[0, -1]] -= handed
            w[[1, -2]] += handed
        sides.append((s, w))
    (s, v), (t, w) = sides
    return float(v @ np.hypot(s[:, None], t) @ w)


def test_more_contact_points_take_the_torsion_of_the_dem_to_uniform_pressure_but_not_that_of_the_program():
    # Godio et al. 2017, Figs 3 and 11: a fall that converges; the program keeps the corners. All points of a twisted
    # elastic block slip under its uniform pressure: mu N times their mean radius, 0.5737, 0.3786, 0.3820 and 0.3826 for
    # 2, 4, 8 and all. From above all the way was a property of trapezoid areas, whose second moment is too large
    found = study.contact_point_study(*twisted_block(), (2, 4, 8), (0.0,), along=8)
    rows = found.where(method="dem").rows
    radii = [mean_radius_of_points(8, n) for n in (2, 4, 8)]
    uniform = (math.sqrt(2.0) + math.log(1.0 + math.sqrt(2.0))) / 6.0
    for row, radius in zip(rows, radii, strict=True):
        assert row["low"] * (1.0 - 1e-3) <= radius <= row["high"] * (1.0 + 1e-3)
    off = [abs(row["multiplier"] - uniform) for row in rows]
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.005 * uniform  # the width of the bracket
    assert found.where(method="associative")["multiplier"] == pytest.approx([math.sqrt(0.5)] * 3, rel=1e-6)


@pytest.mark.filterwarnings("error")
def test_a_column_of_zeros_has_no_coefficient_of_variation_and_never_enough_runs():
    none_fell = study.Table(tuple({"failed": 0.0} for _ in range(50)))
    assert "CoV nan %" in str(study.running(none_fell, "failed"))
    assert not study.Stop("failed")(none_fell)


def test_a_size_that_is_asked_for_twice_is_one_row():
    found = study.block_size_study(BRICKS, (1, 1.0), vary="in plane")
    assert list(found["size"]) == [1.0, 1.0]  # of the wall, and of one piece of it
    assert found["multiplier"] == pytest.approx([0.25, 0.25], abs=1e-6)


def test_block_size_in_plane_keeps_the_slenderness_and_whole_block_moves_it():
    flat, whole = (study.block_size_study(BRICKS, (0.5, 1.0, 2.0), vary=v) for v in ("in plane", "whole block"))
    # a straight wall overturns in one piece at t / H, whatever its blocks
    for size, value in zip(flat["size"], flat["multiplier"], strict=True):
        assert value == pytest.approx(0.1 / 0.4, abs=1e-6), size
    for row in whole:
        assert row["multiplier"] == pytest.approx(0.1 * row["size"] / 0.4, abs=1e-6)
    assert set(whole["status"]) == {"solved"}
    assert list(flat.where(method="associative")["status"]) == ["extrapolated", "solved", "solved", "solved"]


def test_lines_show_every_row_and_refuse_an_empty_table(table):
    figure = lm.figures.study_lines(table, "friction_coefficient", by=("status",), published={"test": [(0.6, 0.7)]})
    lines = {line.get_gid(): line for line in figure.axes[0].lines}
    assert sorted(lines["line"].get_ydata()) == pytest.approx(sorted(table["multiplier"]))
    assert lines["published"].get_xdata() == pytest.approx([0.6])
    with pytest.raises(ValueError, match="nothing to draw"):
        lm.figures.study_lines([{"a": 1.0, "multiplier": math.nan}], "a")
