"""Patterns, values not reached, curves and modes as evidence: likelihoods, scatter and counts in closed form."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import dem
import limitmason as lm
from limitmason import causes
from limitmason.answers import Curve
from limitmason.constants import GRAVITY
from limitmason.diagnosis import Cause, Observation, Study, curves
from limitmason.diagnosis.simulate import several
from limitmason.errors import InputError


def test_what_was_seen_is_a_likelihood_with_a_rate_of_misreading():
    # of two patterns the difference of misfits is that of the exact likelihoods times one factor, whatever was seen
    rate, rng = 0.1, np.random.default_rng(5)
    one, other = rng.integers(0, 2, (2, 40))
    for _ in range(3):
        seen = np.where(rng.random(40) < rate, 1 - one, one)
        value, sd = np.array([Observation(0, "opened a|b", float(v), rate).compared for v in seen]).T
        ours = 0.5 * ((((value - other) / sd) ** 2).sum() - (((value - one) / sd) ** 2).sum())
        exact = ((seen == one).sum() - (seen == other).sum()) * np.log((1 - rate) / rate)
        assert ours == pytest.approx(exact * 0.5 * (1 - 2 * rate) / (rate * (1 - rate) * np.log((1 - rate) / rate)))
    assert Observation(0, "opened a|b", 1.0, rate).kind == "pattern"
    for wrong, words in (({"value": 0.5}, "1 \\(seen\\)"), ({"scatter": 0.6}, "rate of misreading"),
                         ({"beyond": "above"}, "not reached")):
        with pytest.raises(InputError, match=words):
            Observation(**{"specimen": 0, "quantity": "slid a|b", "value": 1.0, "scatter": 0.1} | wrong)


def test_a_value_that_was_not_reached_fits_all_predictions_beyond_it():
    # three walls stood at 20 degrees, of which a model says 15, 20 and 30: only the first is against it
    rows = [Observation(i, "angle", 20.0, 0.1, beyond="above") for i in range(3)]
    made = Study([{"x": v} for v in (15.0, 20.0, 30.0)], lambda s, k=1.0: k * s["x"], rows, shared=(), levels=5)
    assert made.baseline() == pytest.approx([15.0, 20.0, 20.0])
    below = [Observation(i, "angle", 20.0, 0.1, beyond="below") for i in range(3)]
    assert Study(made.specimens, made.simulate, below, shared=()).baseline() == pytest.approx([20.0, 20.0, 30.0])


def test_a_loose_joint_is_found_among_all_by_frequencies_and_shapes():
    def build(s=None, loose=None):
        joint = lm.Joint(35.0, normal_stiffness=2e9, shear_stiffness=8e8)
        made = lm.build.column(width=1.2, depth=1.0, unit_height=1.5, courses=4, joint=joint)
        weak = dataclasses.replace(joint, normal_stiffness=4e8, shear_stiffness=1.6e8)
        laid = [dataclasses.replace(i, joint=weak) if k == loose else i for k, i in enumerate(made.interfaces)]
        return made.with_interfaces(laid), lm.Loads.weight(made)

    sensors = [((0.1, 0.1, z), d) for z in (2.0, 4.0, 5.9) for d in "xy"]
    found = lm.modes(build(loose=1)[0], 3)
    shape = found.at([p for p, _ in sensors])[:, np.arange(6), [0, 1] * 3]
    rng = np.random.default_rng(1)
    shape = shape / np.abs(shape).max(axis=1)[:, None] + 0.03 * rng.standard_normal(shape.shape)
    test = lm.vibration.ModalTest(sensors, found.frequency * (1.0 + 0.01 * rng.standard_normal(3)), shape)
    rows = Observation.of_modes("tower", test)
    simulate = several(lambda s: build(), {})
    made = Study([{"specimen": "tower", "modal test": test}], simulate, rows, shared=(), levels=9)
    assert made.n == 3 * (1 + 6)
    answer = made.diagnose(causes.each_joint(build()[0], (0.1, 1.0)), pairs=False)
    assert answer.causes == ("loose joint column-1|column-2",)
    assert answer.kind == "behaves like"  # one kind of evidence
    assert answer.estimates[answer.causes[0]].low < 0.2 < answer.estimates[answer.causes[0]].high


def test_points_of_a_curve_count_as_many_as_their_covariance_says():
    rng, k, m = np.random.default_rng(8), 40, 400
    for share, exact in ((0.0, 40.0), (0.5, 40.0**2 / (40.0 + 40.0 * 39.0 * 0.25)), (1.0, 1.0)):
        made = np.sqrt(share) * rng.standard_normal((m, 1)) + np.sqrt(1.0 - share) * rng.standard_normal((m, k))
        assert curves.effective_points(made) == pytest.approx(exact, rel=0.12)
    # few curves: without bias on average
    few = [curves.effective_points(rng.standard_normal((12, 6))) for _ in range(300)]
    assert np.mean(few) > 4.5  # cut at 6, the plain ratio would give 3.9


def test_a_curve_is_compared_by_features_or_by_points_that_are_not_each_a_witness():
    u = np.linspace(0.0, 2.0, 201)
    # the load comes back to zero: a residual of nothing has no ratio to be compared by
    with pytest.warns(UserWarning, match="residual of specimen A: left out, it is not positive"):
        rows = curves.features("A", lm.Curve(u, 2.0 * u - u**2), load_error=0.02, displacement_error=0.01)
    told = {q.quantity: q for q in rows}
    assert {q: told[q].value for q in told} == pytest.approx(
        {"peak": 1.0, "drift at peak": 1.0, "stiffness": 0.3 / (np.sqrt(0.9) - np.sqrt(0.6))}, rel=1e-3
    )
    # within 4 % of the peak over |u - 1| <= 0.2
    assert told["drift at peak"].scatter == pytest.approx(np.hypot(0.01, 0.2), rel=1e-6)
    between = np.sqrt(0.9) - np.sqrt(0.6)
    assert told["stiffness"].scatter == pytest.approx(np.sqrt(2.0) * np.hypot(0.02, 0.01 / between), rel=1e-3)

    def line(slope):
        return lm.Curve([0.0, 1.0], [0.0, slope])

    rng = np.random.default_rng(0)
    truth = {i: line(1.0 + i) for i in range(8)}
    shaken = {i: line((1.0 + i) * np.exp(0.05 * rng.standard_normal())) for i in truth}
    rows, effective = curves.points(shaken, truth, load_error=0.05, displacement_error=1e-6, count=50)
    assert effective == pytest.approx(1.0)  # one gain per curve: fifty loads are one witness
    assert [(r.specimen, r.quantity) for r in rows] == [(i, "load at 1") for i in truth]
    assert rows[3].scatter == pytest.approx(0.05, rel=1e-6)
    assert curves.points(shaken, load_error=0.05, displacement_error=1e-6)[1] == 1.0
    # on a line F = s u an error e of the displacement makes a relative one of e / u, at its end too
    (last,), _ = curves.points({0: line(3.0)}, load_error=0.03, displacement_error=0.04)
    assert last.scatter == pytest.approx(0.05, rel=1e-9)
    short = dict.fromkeys(truth, lm.Curve([0.0, 0.5], [0.0, 1.0]))
    with pytest.raises(InputError, match="ends before"):
        curves.points(shaken, short, load_error=0.05, displacement_error=1e-6)


def test_a_curve_that_begins_late_has_the_error_of_its_own_slope():
    late = lm.Curve([1.0, 2.0, 3.0], [5.0, 6.0, 4.0])
    rows, _ = curves.points({"a": late}, load_error=0.02, displacement_error=0.01)
    assert [r.value for r in rows] == [4.0]
    rows, _ = curves.points(dict.fromkeys("abcd", late), dict.fromkeys("abcd", late), load_error=0.02,
                            displacement_error=0.01, count=3)
    first = rows[0]  # at 1 m the slope is that behind it, of 1 N/m
    assert (first.quantity, first.value) == ("load at 1", 5.0)
    assert first.scatter == pytest.approx(np.hypot(0.02, 1.0 * 0.01 / 5.0))


@pytest.mark.slow
def test_histories_are_a_kind_of_data_peak_rotation_of_a_pulse_and_overturned_or_not():
    b, h, push = 0.4, 1.6, 0.2

    def build(s):
        joint = lm.Joint(60.0, normal_stiffness=1e10)
        made = lm.build.column(width=b * s.get("part", 1.0), depth=0.4, unit_height=h, courses=1, joint=joint)
        return made, lm.Loads.weight(made)

    def pulse(s):
        shaken = dem.BaseMotion(acceleration=[s["g"] * GRAVITY] * (round(push / 0.01) + 1), sample_step=0.01,
                                after="coast")
        settled = dem.Hold(duration=0.05, damping=dem.Damping(0.8))
        options = {"stages": [settled, shaken, dem.Hold(duration=0.25)], "mode": "dynamic",
                   "contact_points": (2, 2), "joint_options": dem.JointOptions(dashpot=0.0)}
        wanted = dict.fromkeys(("peak rotation", "overturned"), "dem")
        return lm.answer(*build(s), wanted, dem=options).quantities

    # a rigid block about its edge, Housner 1963: theta'' = -p^2 sin(alpha - theta) + p^2 a cos(alpha - theta) / g
    alpha, p2 = np.arctan(b / h), 3.0 * GRAVITY / (2.0 * np.hypot(b, h))

    def rock(t, y, a):
        return [y[1], p2 * (-np.sin(alpha - y[0]) + (a if t < push else 0.0) * np.cos(alpha - y[0]))]

    a = 0.4
    top = solve_ivp(rock, (0.0, push + 0.25), [0.0, 0.0], args=(a,), max_step=1e-3).y[0].max()
    shaken, still = pulse({"g": a}), pulse({"g": 0.8 * b / h})  # West: no rocking below g b / h
    assert shaken["peak rotation"] == pytest.approx(top, rel=0.05)  # softer joints turn more
    assert still["peak rotation"] < 1e-3 * top
    assert (shaken["overturned"], still["overturned"]) == (0.0, 0.0)
    rows = [Observation(0, "peak rotation", 1.1 * top, 0.05, "rad"), Observation(0, "overturned", 0.0, 0.1),
            Observation(1, "residual displacement", 0.0, 0.001, "m")]
    assert [r.kind for r in rows] == ["deformation", "pattern", "deformation"]
    assert [r.link for r in rows] == ["log", "seen", "identity"]
    made = Study([{"g": a}, {"g": a}], lambda s: {**pulse(s), "residual displacement": 0.0}, rows, shared=())
    assert made.baseline() == pytest.approx([shaken["peak rotation"], 0.0, 0.0])
    turned = dem.simulate(build({})[0], dem.Hold(duration=0.001), mode="dynamic").quantities
    assert set(turned) == {"peak rotation", "peak displacement", "residual displacement", "overturned"}
    with pytest.raises(InputError, match="follows no stages; dem does"):
        lm.answer(*build({}), {"overturned": "limit"}, limit={"stages": []})


def test_errors_of_what_was_seen_are_drawn_as_misreadings():
    rows = [Observation(i, "opened a|b", float(i % 2), 0.1) for i in range(4)] + [Observation(0, "peak", 1.0, 0.1)]
    made = Study([{"x": i % 2} for i in range(4)], lambda s, k=1.0: {"opened a|b": float(s["x"]), "peak": k}, rows,
                 shared=())
    noise = made.design([Cause("k", "k", 1.0, (0.5, 2.0))]).noise
    assert noise.misread == (0.1, -0.1, 0.1, -0.1, 0.0)
    drawn = noise.errors(np.random.default_rng(0), 20000, 5)
    assert drawn.mean(axis=0) == pytest.approx(0.0, abs=0.03)
    assert drawn.std(axis=0) == pytest.approx(1.0, abs=0.03)
    assert set(np.round(drawn[:, 0], 6)) == {-0.333333, 3.0}  # one in ten is read as seen
    assert set(np.round(drawn[:, 1], 6)) == {0.333333, -3.0}


def test_a_folder_may_hold_curves_and_shapes_at_sensors(tmp_path):
    files = {
        "specimens.csv": "specimen,width\n# units: -,m\nA,0.2\nB,0.1\n",
        "measured.csv": "specimen,frequency 1\n# units: -,Hz\nA,20.0\nB,\n",
        "quantities.csv": "quantity,scatter\n# units: -,-\nfrequency 1,0.01\nload,0.02\ndisplacement,0.1\nmode,0.03\n",
        "curves.csv": "specimen,displacement,load\n# units: -,mm,kN\nA,0,0\nA,2,4\nA,4,3\nB,0,0\nB,1,2\nB,2,1\n",
        "sensors.csv": "specimen,x,y,z,direction,mode 1\n# units: -,m,m,m,-,-\nA,.1,.1,.1,x,2.0\nA,.1,.1,.3,x,-4\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)

    def simulate(s):
        modal = s["modal test"].quantities if "modal test" in s else {}
        return {"peak": 10.0 * s["width"], "stiffness": 1.0, "drift at peak": 1.0, "residual": 1.0, **modal}

    made = Study.from_folder(tmp_path, model=simulate, shared=())
    measured = {(i, q): v for i, q, v in zip(made.rows.of.tolist(), made.rows.quantities, made.measured, strict=True)}
    assert measured[0, "peak"] == 4.0
    assert measured[1, "stiffness"] == pytest.approx(2.0)
    assert (measured[0, "mode 1 sensor 1"], measured[0, "mode 1 sensor 2"]) == (-0.5, 1.0)
    assert measured[0, "frequency 1"] == 20.0
    assert (1, "frequency 1") not in measured  # blank
    assert made.baseline()[made.rows.quantities.index("frequency 1")] == pytest.approx(20.0)
    (tmp_path / "predicted.csv").write_text(files["measured.csv"])
    with pytest.raises(InputError, match="need a model"):
        Study.from_folder(tmp_path)
    (tmp_path / "quantities.csv").write_text(files["quantities.csv"].replace("mode,0.03\n", ""))
    with pytest.raises(InputError, match="no row for 'mode'"):
        Study.from_folder(tmp_path, model=simulate)


def test_what_a_curve_or_a_sensor_lacks_is_said(tmp_path):
    files = {"specimens": "specimen,h\n-,m\na,1\nb,2\n", "measured": "specimen,frequency 1\n-,Hz\na,1\n",
             "quantities": "quantity,scatter\n-,-\nfrequency 1,0.02\nmode,0.05\n",
             "sensors": "specimen,x,y,z,direction,mode 1\n-,m,m,m,-,-\nb,0,0,1,x,1\nb,0,0,2,x,0.5\n"}
    for name, text in files.items():
        (tmp_path / f"{name}.csv").write_text(text)
    with pytest.raises(InputError, match=r"measured.csv has no row for specimen 'b', with its frequencies"):
        Study.from_folder(tmp_path, model=lambda s: {})
    short = Curve([0.0, 1.0, 2.0], [0.0, 10.0, 12.0], "mm", "kN")
    with pytest.raises(InputError, match=r"measured in mm, kN and predicted in m, kN"):  # was said to end too soon
        curves.points({"a": short}, {"a": short.in_units("m", 1e-3, "kN", 1.0)}, load_error=0.02,
                      displacement_error=0.01)


def test_factors_over_a_wide_range_are_tabulated_by_their_ratio():
    # f = 1 / sqrt(1 + 1 / s), a spring of factor s in row with another: nine levels by ratio are enough down to 1/50
    rows = [Observation(i, f"frequency {i + 1}", 0.7, 0.01) for i in range(2)]
    loose = Cause("loose", "s", 1.0, (0.02, 1.0))
    made = Study([{}, {}], lambda x, s=1.0: {f"frequency {i + 1}": (1.0 + 1.0 / s) ** -0.5 for i in range(2)}, rows,
                 shared=(), levels=9)
    table = made.table(loose)
    assert table.levels[0][4] == pytest.approx(0.02**0.5)
    for s in (0.025, 0.1, 0.6):
        exact = np.log((1.0 + 1.0 / s) ** -0.5)
        assert made.tables.between({loose: s}) == pytest.approx(exact, abs=0.003)
