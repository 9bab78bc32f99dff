"""Layout searches on catalogues of known truth, and the specimen of the Pavia tests they are made for."""

import math

import numpy as np
import pytest
from pavia_layouts import layouts
from pavia_layouts.catalogue import COLUMNS as COLUMNS_OF_LAYOUTS
from pavia_layouts.catalogue import compute_layouts
from pavia_layouts.report import layout_report
from pavia_layouts.search import search_layouts

import limitmason as lm
from limitmason.experiments import pavia_tilting as pavia
from limitmason.mechanics.contact_points import contact_points
from limitmason.study import Table, sweep

COLUMNS = ("zero", "full")
LENGTH, HEIGHT, THICKNESS = 0.08, 0.04, 0.028


def table(values):
    return Table(tuple({"layout": k, "zero": float(a), "full": float(b)} for k, (a, b) in enumerate(values)))


def draw(rng, number):
    """Pairs as walls give them: the second value from 0.14 to 0.4, the first 0.75 to 0.97 of it."""
    full = np.exp(rng.uniform(np.log(0.14), np.log(0.4), number))
    return np.column_stack([full * rng.uniform(0.75, 0.97, number), full])


def crossed():
    """Eight pairs of two ratios, stepped so that no permuted pair comes near one of them."""
    full = 0.2 * 1.0566 ** np.arange(8)
    return np.column_stack([full * np.where(np.arange(8) % 2, 0.80, 0.97), full])


def test_planted_layouts_are_found_and_declared_informative():
    rng = np.random.default_rng(3)
    truth = crossed()
    planted = truth * rng.uniform(0.995, 1.005, truth.shape)
    decoys = np.column_stack([np.full(40, 0.5), rng.uniform(0.6, 0.9, 40)])
    order = rng.permutation(48)
    values = np.concatenate([planted, decoys])[order]
    pairs = {f"P{k}": tuple(pair) for k, pair in enumerate(truth)}
    search = search_layouts(table(values), pairs, columns=COLUMNS, tolerance=0.015)
    for k, name in enumerate(pairs):
        assert search.compatible[name] == (int(np.flatnonzero(order == k)[0]),)
        assert search.misfit[name] <= 0.006
    assert search.informative
    assert search.controls[-1].fitted == 0
    assert search.controls[-1].pairs > 4
    # all of 8 and none of m fitted: one way out of (8 + m over 8)
    assert search.controls[-1].chance == pytest.approx(1.0 / math.comb(8 + search.controls[-1].pairs, 8))
    assert "says something" in search.verdict


def test_dense_catalogue_fits_permuted_pairs_as_often_and_says_nothing():
    rng = np.random.default_rng(5)
    pairs = {f"P{k}": tuple(pair) for k, pair in enumerate(draw(rng, 9))}
    search = search_layouts(table(draw(rng, 3000)), pairs, columns=COLUMNS)
    assert all(search.compatible.values())
    assert search.controls[-1].fitted == search.controls[-1].pairs > 0
    assert not search.informative
    assert "says nothing" in search.verdict


@pytest.mark.parametrize("layouts", [10, 40, 150])
def test_random_catalogues_are_rarely_called_informative(layouts):
    rng = np.random.default_rng(layouts)
    called = 0
    for _ in range(100):
        pairs = {f"P{k}": tuple(pair) for k, pair in enumerate(draw(rng, 9))}
        called += search_layouts(table(draw(rng, layouts)), pairs, columns=COLUMNS).informative
    # the level of the test is 5 %: 12 of 100 would have a chance of 0.4 %
    assert called < 12


def test_both_values_of_one_layout_must_fit():
    pairs = {"P": (0.2, 0.25)}
    values = [(0.2, 0.3), (0.3, 0.25), (0.209, 0.241), (float("nan"), 0.25), (0.2101, 0.25)]
    search = search_layouts(table(values), pairs, columns=COLUMNS, tolerance=0.05)
    assert search.compatible["P"] == (2,)
    assert search.misfit["P"] == pytest.approx(0.045)
    # one pair has no permuted one: nothing can be said
    assert not search.informative
    nothing = search_layouts(table(values[:2]), pairs, columns=COLUMNS)
    assert nothing.layouts("P").rows == ()
    assert "no layout" in nothing.verdict


def test_controls_count_the_pairs_they_name():
    pairs = {"A": (0.10, 0.20), "B": (0.30, 0.33), "C": (0.16, 0.18)}
    search = search_layouts(table([(0.16, 0.2), (0.3, 0.33)]), pairs, columns=COLUMNS, tolerance=0.01)
    every, ordered, alike = search.controls
    assert (every.pairs, every.fitted) == (6, 1)  # C with A
    # A-B, A-C, C-A, C-B: first below second
    assert (ordered.pairs, ordered.fitted) == (4, 1)
    # ratios 0.5 to 0.909: A-C 0.556, C-A 0.8; C-B 0.485 and A-B 0.303 are less, the others above 1
    assert (alike.pairs, alike.fitted) == (2, 1)
    assert alike.layouts == pytest.approx(0.5)


def test_conclusions_hold_only_over_the_whole_set():
    pairs = {"P": (0.2, 0.25), "Q": (0.3, 0.32), "R": (0.9, 0.95)}
    search = search_layouts(table([(0.2, 0.25), (0.198, 0.25), (0.3, 0.32)]), pairs, columns=COLUMNS)
    p, q, r = search.over_sets(lambda row, name: row["zero"] / 0.199)
    assert (p.side, q.side, r.side) == ("open", "above", "no layout")
    assert (p.layouts, p.low, p.high) == (2, pytest.approx(0.198 / 0.199), pytest.approx(0.2 / 0.199))
    unknown = search.over_sets(lambda row, name: float("nan") if row["layout"] == 1 else 2.0)
    assert (unknown[0].side, unknown[1].side) == ("open", "above")
    report = layout_report(search, title="T", findings={"ratio": (p, q, r)}, describe=("layout",))
    assert report.count("inferred, not measured") >= 3
    assert "is no statement about the walls" in " ".join(report.split())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pairs": {}}, "no published pairs"),
        ({"pairs": {"P": (0.2, 0.0)}}, "'P' must be two positive"),
        ({"tolerance": 0.0}, "tolerance must be positive"),
        ({"catalogue": Table(())}, "no layout"),
    ],
)
def test_bad_input_of_a_search_is_named(change, message):
    given = {"catalogue": table([(0.2, 0.25)]), "pairs": {"P": (0.2, 0.25)}, "columns": COLUMNS, **change}
    with pytest.raises(ValueError, match=message):
        search_layouts(given.pop("catalogue"), given.pop("pairs"), **given)


def test_unfinished_runs_are_left_out_and_done_the_next_time(tmp_path):
    def half(*, x, done):
        if not done and x > 1:
            raise lm.study.Unfinished
        return {"y": 2 * x}

    store, points = tmp_path / "rows.jsonl", range(4)
    first = sweep(half, [{"x": x, "done": False} for x in points], store=store, key="k")
    assert list(first["x"]) == [0, 1]
    assert "2 of 4" in first.notes[0]
    again = sweep(half, [{"x": x, "done": True} for x in points], store=store, key="k")
    assert list(again["y"]) == [0, 2, 4, 6]


def stack(*, courses, mark, dilatancy_angle_deg=0.0):
    """One unit wide, so that it overturns at t / H whatever the flow rule."""
    joint = lm.Joint(35.0, dilatancy_angle_deg=dilatancy_angle_deg)
    wall = lm.build.wall(length=LENGTH, courses=courses, unit=(LENGTH, HEIGHT, THICKNESS), joint=joint)
    return wall, lm.Loads.horizontal(wall, (0, 1, 0))


@pytest.mark.slow
def test_computed_catalogue_screens_goes_on_from_its_store_and_starts_with_small_walls(tmp_path):
    layouts = [{"courses": n, "mark": f"wall {n}"} for n in (4, 6, 2)]
    targets = (THICKNESS / (2 * HEIGHT), THICKNESS / (4 * HEIGHT) / 1.1)
    settings = {"friction_angle_deg": 35.0, "options": {"contact_points": (2, 2)}, "store": tmp_path}
    nothing = compute_layouts(stack, layouts, targets, time_limit=-1.0, **settings)
    assert len(nothing) == 0
    assert "4 of 4" in nothing.notes[0]
    found = compute_layouts(stack, layouts, targets, **settings)
    # six courses are near neither target
    assert list(found["mark"]) == ["wall 2", "wall 4"]
    assert list(found["blocks"]) == [3, 6]  # every other course is two halves
    exact = THICKNESS / HEIGHT / found["courses"]
    assert found["associative"] == pytest.approx(exact, rel=1e-6)
    for column in COLUMNS_OF_LAYOUTS:
        assert found[column] == pytest.approx(exact, rel=0.01)
    lines = []
    assert compute_layouts(stack, layouts, targets, progress=lines.append, **settings) == found
    assert lines == [f"{n} of {n} runs are in {tmp_path / name}.jsonl" for n, name in ((3, "associative"), (4, "dem"))]
    with pytest.raises(ValueError, match="another study"):
        compute_layouts(stack, layouts[:2], targets, **settings)
    with pytest.raises(ValueError, match="must not be empty"):
        compute_layouts(stack, [], targets, friction_angle_deg=35.0)


def names(assembly, start):
    return [b.name for b in assembly.blocks if b.name.startswith(start)]


@pytest.mark.parametrize("returns", [1, 2])
@pytest.mark.parametrize("corner", pavia.CORNERS)
def test_specimen_fills_its_plan_and_interlocks_in_every_course(returns, corner):
    courses, facade, beside = 6, 5, 2.5
    wall, _ = pavia.specimen(
        facade_units=facade, courses=courses, return_walls=returns, return_units=beside, corner=corner
    )
    plan = facade * LENGTH * THICKNESS + returns * (beside * LENGTH - THICKNESS) * THICKNESS
    assert wall.arrays.volume[1:].sum() == pytest.approx(plan * courses * HEIGHT)
    assert list(np.flatnonzero(wall.fixed)) == [0]
    assert wall.blocks[0].name == "base"
    # no head joint above another, and a corner unit of one wall on one of the other in every course, 28 x 28 mm
    assert wall.recipe["smallest_overlap"] >= THICKNESS - 1e-9
    walls = [
        {b.name.rsplit("-", 2)[0] for b in (wall.blocks[i.block_a], wall.blocks[i.block_b])} for i in wall.interfaces
    ]
    laps = [i.area for i, w in zip(wall.interfaces, walls, strict=True) if len(w) == 2 and i.kind == "bed"]
    assert len(laps) == returns * (courses - 1)
    assert laps == pytest.approx([THICKNESS**2] * len(laps))


def test_specimen_is_laid_block_by_block_as_counted_by_hand():
    wall, _ = pavia.specimen(facade_units=4, courses=2, return_walls=2, return_units=3)
    # course 1: 4 whole units, returns of 92, 80, 40 mm behind; course 2: returns of 3 units, 92, 80, 92 between
    assert [len(names(wall, f"facade-0{k}")) for k in (1, 2)] == [4, 3]
    assert [len(names(wall, f"return-left-0{k}")) for k in (1, 2)] == [3, 3]
    length = {b.name: round(float(v) / HEIGHT / THICKNESS, 6)
              for b, v in zip(wall.blocks, wall.arrays.volume, strict=True)}
    assert [length[n] for n in names(wall, "facade-02")] == [0.092, 0.08, 0.092]
    assert [length[n] for n in names(wall, "return-left-01")] == [0.092, 0.08, 0.04]
    other, _ = pavia.specimen(facade_units=4, courses=2, return_walls=2, return_units=3, first_through="return")
    assert [len(names(other, f"facade-0{k}")) for k in (1, 2)] == [3, 4]


def test_loading_sense_pushes_the_facade_away_from_or_towards_its_returns():
    found = {}
    for sense, sign in (("outward", -1.0), ("inward", 1.0)):
        wall, loads = pavia.specimen(facade_units=4, courses=4, return_walls=2, return_units=3, sense=sense)
        y = {b.name: c[1] for b, c in zip(wall.blocks, wall.centroids, strict=True)}
        facade = np.mean([y[n] for n in names(wall, "facade")])
        returns = np.mean([y[n] for n in names(wall, "return")])
        towards = np.sign(returns - facade)
        assert sign == (towards if sense == "inward" else -towards)
        assert loads.live[:, 1] == pytest.approx(sign * wall.weights)
        found[sense] = lm.limit_analysis(wall, loads).collapse_multiplier
    # pushed against its returns the facade is propped
    assert found["inward"] > found["outward"]


def test_growing_blocks_keep_the_wall():
    arguments = {"facade_units": 4, "courses": 4, "return_walls": 1, "return_units": 2}
    volumes = [pavia.specimen(**arguments, block_scale=s)[0].arrays.volume[1:] for s in (0.5, 1.0, 2.0)]
    assert len(volumes[0]) > 2 * len(volumes[1]) > 4 * len(volumes[2])
    assert [v.sum() for v in volumes] == pytest.approx([volumes[1].sum()] * 3)


@pytest.mark.parametrize(
    "wrong",
    [{"return_walls": 3}, {"facade_units": 2.3}, {"sense": "up"}, {"corner": "butt"}, {"block_scale": 3.0},
     {"facade_units": "4"}, {"courses": 2.5}, {"block_scale": None}, {"first_through": "both"}],
)
def test_bad_arguments_of_the_specimen_are_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        pavia.specimen(**{"facade_units": 3, "courses": 4, **wrong})


def test_contact_points_can_be_given_by_wall():
    wall, _ = pavia.specimen(facade_units=3, courses=3, return_walls=1, return_units=2)
    points = contact_points(wall, contact_model="grid", grid=pavia.CONTACT_POINTS)
    counted = np.bincount(points.interface, minlength=len(wall.interfaces))
    for k, i in enumerate(wall.interfaces):
        both = wall.blocks[i.block_a].name + " " + wall.blocks[i.block_b].name
        assert counted[k] == (16 if "facade" in both else 4), both
    # across the thickness of the facade: eight distinct y on a bed joint of its own
    beds = [k for k, i in enumerate(wall.interfaces) if i.kind == "bed" and
            all(wall.blocks[b].name.startswith("facade") for b in (i.block_a, i.block_b))]
    assert len(np.unique(points.position[points.interface == beds[0], 1].round(9))) == 8
    # walls go before kinds, and what no wall names falls to its kind
    mixed = {"facade": (2, 3), "bed": (2, 2), "head": (2, 2), "base": (4, 4)}
    counted = np.bincount(contact_points(wall, contact_model="grid", grid=mixed).interface)
    base = [k for k, i in enumerate(wall.interfaces) if i.kind == "base"]
    assert {int(counted[k]) for k in base} == {6, 16}
    with pytest.raises(ValueError, match="'facad e'"):
        contact_points(wall, contact_model="grid", grid={"facad e": (2, 8), "return": (2, 2)})
    with pytest.raises(ValueError, match="no entry for joints of kind"):
        contact_points(wall, contact_model="grid", grid={"facade": (2, 8)})


def test_catalogue_is_a_fixed_order_of_plausible_layouts():
    short, long = layouts.catalogue(20), layouts.catalogue(60)
    assert short == long[:20]
    assert all(layout[name] in layouts.LAYOUTS[name] for layout in long for name in layouts.LAYOUTS)
    assert len({tuple(x.values()) for x in layouts.catalogue()}) == len(layouts.catalogue())
    for layout in layouts.catalogue(8, most_blocks=30, seed=4):
        wall, _ = pavia.specimen(**layout)
        assert wall.recipe["options"] == {k: layout[k] for k in wall.recipe["options"]}
        assert wall.n_blocks < 45


def test_published_pairs_are_those_of_the_source_and_repeats_count_once():
    pairs, tests = layouts.published_pairs(), layouts.measured_multipliers()
    assert pairs.keys() == tests.keys()
    assert pairs["S1-S3"] == (0.272, 0.334)
    assert tests["S1-S3"] == (0.254, 0.226, 0.244)
    assert len(pairs) == 9
    assert all(low < high for low, high in pairs.values())
