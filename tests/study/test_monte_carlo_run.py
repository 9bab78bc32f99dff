"""Random runs of any answer: closed spreads, links, stopping, the same numbers after a kill or with more workers."""

import dataclasses
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from walls import bonded_stack

import limitmason as lm
from limitmason import study
from limitmason.study.linked_formulas import LinkedFormulas
from limitmason.study.random_joints import draw_blocks
from validation import panel_surrogate as surrogate

# Table 2 of the stochastic paper: mean and CoV [-]
PAPER = {
    "normal_stiffness": (13.5e9, 0.15), "friction_angle_deg": (30.0, 0.058), "cohesion": (0.046e6, 0.15),
    "tensile_strength": (0.040e6, 0.20),
}
SHARE = study.Random(study.uniform(0.2, 0.8))
LINKED = {
    "shear_stiffness": "normal_stiffness / 2.32",
    "cohesion": "2 * tensile_strength * tan(radians(friction_angle_deg))",
}


def stack(n, strength=1e5):
    """n joints one above the other."""
    return bonded_stack(n, strength), lm.Loads.weight


def mean_strength(assembly, loads):
    """A load that all joints share."""
    return {"peak": float(np.mean([i.joint.tensile_strength for i in assembly.interfaces]))}


def published_panel(assembly, loads):
    """The published panel, of the first joint's properties."""
    j = assembly.interfaces[0].joint
    got = surrogate.panel_response(83e9, 36e9, j.friction_angle_deg, j.cohesion, j.tensile_strength)
    return {"ultimate": got["peak"], "mode": "strong" if got["peak"] > 3e3 else "weak"}


def spread(per, n, samples=400, **options):
    draw = study.Random(study.normal(4e4, 0.2), per=per, **options)
    return study.running(
        study.monte_carlo(stack(n), samples, run=mean_strength, joints={"tensile_strength": draw}, scheme="random"),
        "peak",
    )


@pytest.mark.parametrize("n", [1, 4, 16])
def test_spatial_spread_falls_with_the_root_of_the_joints_that_share_the_load(n):
    found = spread("interface", n)
    exact = 0.2 / math.sqrt(n)
    assert found.variation[-1] == pytest.approx(exact, rel=4.0 * found.variation_error[-1])
    assert found.mean[-1] == pytest.approx(4e4, rel=4.0 * exact / math.sqrt(400))


def test_one_draw_for_all_keeps_the_whole_spread_whatever_the_number_of_joints():
    few, many = (spread("assembly", n) for n in (2, 16))
    assert few.variation[-1] == pytest.approx(0.2, rel=4.0 * few.variation_error[-1])
    assert few.mean == pytest.approx(many.mean)
    assert few.variation[-1] == pytest.approx(many.variation[-1])


def test_correlated_joints_lie_between_independent_and_equal_ones():
    # correlation r = exp(-d / l) of a mean of n normals: CoV^2 (n + sum of r) / n^2, the draw being normal
    n, length = 9, 0.5
    z = 0.2 * np.arange(n)
    exact = 0.2 * math.sqrt(np.exp(-np.abs(z[:, None] - z) / length).sum()) / n
    found = spread("interface", n, correlation_length=length)
    assert 0.2 / 3.0 < exact < 0.2
    assert found.variation[-1] == pytest.approx(exact, rel=4.0 * found.variation_error[-1])


def test_drawn_density_is_that_of_every_block_and_the_loads_follow():
    wall, _ = stack(5)
    draw = study.Random(study.normal(2000.0, 0.1), per="block")
    changed, record = draw_blocks(wall, {"density": draw}, 0, 0, {})
    density = np.array([b.density for b in changed.blocks])
    assert len(set(density)) == wall.n_blocks
    assert record == {"density mean": pytest.approx(density.mean()), "density deviation": pytest.approx(density.std())}
    found = study.monte_carlo(
        (wall, lm.Loads.weight), 200, run=lambda a, p: {"load": float(-p.dead[~a.fixed, 2].sum())},
        blocks={"density": draw}, scheme="random",
    )
    own = study.running(found, "load")
    # five blocks of equal volume
    assert own.variation[-1] == pytest.approx(0.1 / math.sqrt(5), rel=4.0 * own.variation_error[-1])
    with pytest.raises(lm.errors.InputError, match="loads that follow"):
        study.monte_carlo((wall, lm.Loads.weight(wall)), 2, blocks={"density": draw})
    with pytest.raises(lm.errors.InputError, match="no material"):
        study.monte_carlo((wall, lm.Loads.weight), 1, blocks={"young_modulus": study.Random(study.normal(7e9, 0.1))})


def panel_table(linked, samples=300):
    drawn = {k: study.Random(study.normal(*PAPER[k])) for k in PAPER if not (linked and k == "cohesion")}
    return study.monte_carlo(stack(1), samples, run=published_panel, joints=drawn, links=LINKED if linked
                             else {"shear_stiffness": LINKED["shear_stiffness"]}, scheme="random", seed=7)


def first_order(linked):
    """Root of the sum of squares of log-slope times CoV; in a link the slopes of one draw add up with their signs."""
    phi, c, ft, _ = surrogate.log_slopes()
    angle = math.radians(30.0)
    tan_of_phi = angle / (math.sin(angle) * math.cos(angle))  # slope of log tan(phi) over log phi
    of = {"friction_angle_deg": phi * tan_of_phi, "cohesion": c, "tensile_strength": ft}
    if linked:
        of = {"friction_angle_deg": (phi + c) * tan_of_phi, "tensile_strength": ft + c}
    return math.sqrt(sum((slope * PAPER[name][1]) ** 2 for name, slope in of.items()))


@pytest.mark.parametrize("linked", [True, False])
def test_non_spatial_spread_is_the_root_of_the_sum_of_squares_and_a_signed_sum_in_a_link(linked):
    found = study.running(panel_table(linked), "ultimate")
    # first order of slopes that are exact for a power law; the normal draws are not small, hence the last term
    assert found.variation[-1] == pytest.approx(first_order(linked), rel=4.0 * found.variation_error[-1] + 0.02)


def test_published_slopes_give_the_printed_spread_of_set_4_only_when_strengths_are_linked():
    # printed: 22.11 % (set 4, non-spatial)
    assert first_order(True) == pytest.approx(0.2211, rel=0.06)
    assert first_order(False) < 0.14


def test_links_hold_in_every_joint_and_are_recorded():
    found = study.monte_carlo(
        stack(6), 3, scheme="random", links=LINKED,
        run=lambda a, p: {"worst": max(abs(i.joint.cohesion / (2 * i.joint.tensile_strength * i.joint.tan_phi) - 1.0)
                                       + abs(i.joint.shear_stiffness * 2.32 / i.joint.normal_stiffness - 1.0)
                                       for i in a.interfaces)},
        joints={k: study.Random(study.normal(*PAPER[k]), per="interface") for k in PAPER if k != "cohesion"},
    )
    assert found["worst"].max() < 1e-12
    assert "cohesion mean" in found.columns
    assert np.isfinite(found["shear_stiffness deviation"]).all()


def test_studies_of_other_properties_share_the_random_numbers_of_those_in_common():
    both = {k: study.Random(study.normal(*PAPER[k])) for k in ("friction_angle_deg", "tensile_strength")}
    one = {"tensile_strength": both["tensile_strength"]}
    a, b = (study.monte_carlo(stack(1), 5, run=mean_strength, joints=j, scheme="random") for j in (both, one))
    assert (a["tensile_strength"] == b["tensile_strength"]).all()
    spatial = {k: dataclasses.replace(r, per="interface") for k, r in both.items()}
    c, d = (
        study.monte_carlo(stack(4), 5, run=mean_strength, joints=j)
        for j in (spatial, {"tensile_strength": spatial["tensile_strength"]})
    )
    assert (c["peak"] == d["peak"]).all()


def test_running_error_is_that_of_a_known_normal():
    # error of the mean sigma / sqrt(n), of the CoV CoV / sqrt(2 n): over 300 repeats of 50
    rng = np.random.default_rng(0)
    ends = []
    for _ in range(300):
        table = study.Table(tuple({"x": v} for v in rng.normal(10.0, 1.0, 50)))
        r = study.running(table, "x")
        ends.append(
            (r.mean[-1], r.variation[-1], r.mean_error[-1] * r.mean[-1], r.variation_error[-1] * r.variation[-1])
        )
    mean, variation, mean_error, variation_error = np.array(ends).T
    assert mean.std() == pytest.approx(mean_error.mean(), rel=0.12)
    assert variation.std() == pytest.approx(variation_error.mean(), rel=0.12)
    assert mean_error.mean() == pytest.approx(1.0 / math.sqrt(50), rel=0.05)


def test_running_keeps_its_digits_and_counts_what_is_missing():
    values = [1e9 + k for k in (0.0, 1.0, 2.0, 3.0)]
    found = study.running(study.Table(tuple({"x": v} for v in (*values, math.nan))), "x")
    assert found.deviation[-1] == pytest.approx(np.std([0, 1, 2, 3], ddof=1), rel=1e-9)
    assert found.missing == 1
    assert "1 runs gave no value" in str(found)


@pytest.mark.slow
def test_stopping_rule_stops_when_both_errors_are_small_and_a_store_goes_on(tmp_path):
    draw = {"tensile_strength": study.Random(study.normal(4e4, 0.2))}
    given = {"run": mean_strength, "joints": draw, "scheme": "random"}
    rule = study.Stop("peak", mean=0.02, variation=0.08, every=10, least=20)
    found = study.monte_carlo(stack(1), 400, stop=rule, **given)
    assert len(found) % 10 == 0
    assert 60 <= len(found) < 200  # 1 / (2 n) = 0.08^2 wants 84, (0.2 / 0.02)^2 = 100
    assert rule(found)
    assert not rule(study.Table(found.rows[:-10]))
    assert found.rows == study.monte_carlo(stack(1), len(found), **given).rows
    store = tmp_path / "rows.jsonl"
    study.monte_carlo(stack(1), 30, store=store, **given)
    again = study.monte_carlo(stack(1), 400, stop=rule, store=store, **given)
    assert again == found
    assert study.monte_carlo(stack(1), 400, stop=rule, store=store, workers=2, **given) == found
    with pytest.raises(lm.errors.InputError, match="random"):
        study.monte_carlo(stack(1), 9, stop=rule, run=mean_strength, joints=draw)


KILLED = """
import sys, time
sys.path[:0] = {paths!r}
import limitmason as lm
from limitmason import study
from walls import bonded_stack

def slow(assembly, loads):
    time.sleep(0.05)
    strength = assembly.interfaces[0].joint.tensile_strength
    # every finished run leaves a mark before it answers
    with open({marks!r}, "a") as file:
        file.write(f"{{strength!r}}\\n")
    return {{"peak": strength / 3.0}}

def main(workers):
    draw = {{"tensile_strength": study.Random(study.normal(4e4, 0.2), per="interface")}}
    return study.monte_carlo(
        (bonded_stack(2, 1e5), lm.Loads.weight), 24, run=slow, joints=draw, scheme="random",
        store={store!r}, workers=workers,
    )

if __name__ == "__main__":
    main(int(sys.argv[1]))
"""


@pytest.mark.slow
def test_killed_runs_go_on_without_computing_one_twice(tmp_path):
    marks, store = tmp_path / "marks.txt", tmp_path / "rows.jsonl"
    script = tmp_path / "killed.py"
    builders = Path(__file__).resolve().parents[1] / "builders"
    script.write_text(KILLED.format(paths=[str(builders)], marks=str(marks), store=str(store)))
    process = subprocess.Popen([sys.executable, str(script), "1"], start_new_session=True)
    deadline = time.time() + 120.0
    while (
        process.poll() is None
        and time.time() < deadline
        and not (store.exists() and len(store.read_text().splitlines()) > 6)
    ):
        time.sleep(0.01)
    assert process.poll() is None, "the run ended, or failed, before it could be killed"
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = len(store.read_text().splitlines()) - 1
    assert 5 < kept < 24
    subprocess.run([sys.executable, str(script), "1"], check=True)
    done = marks.read_text().splitlines()
    assert len(store.read_text().splitlines()) == 25
    # the run that the kill met may have answered without being kept; no other was made twice
    assert 24 <= len(done) <= 25
    assert len(set(done)) == 24
    marks.unlink()
    store.unlink()
    subprocess.run([sys.executable, str(script), "2"], check=True)
    assert sorted(set(done)) == sorted(marks.read_text().splitlines())  # the same bits with two workers


def test_curves_words_and_refusals_of_a_run_are_kept(tmp_path):
    def run(assembly, loads):
        strength = assembly.interfaces[0].joint.tensile_strength
        if strength < 3.5e4:
            raise lm.errors.NotConverged("it fell")
        u = np.linspace(0.0, 2.0, 21)
        return {
            "curve": lm.Curve(u, strength * np.minimum(u, 1.0), "mm", "N"),
            "mode": "weak" if strength < 4e4 else "strong",
        }

    given = {"run": run, "joints": {"tensile_strength": study.Random(study.normal(4e4, 0.2))}, "seed": 2}
    found = study.monte_carlo(stack(1), 30, **given)
    gone = [r for r in found if "curve" not in r]
    assert 1 < len(gone) < 20
    assert all(r["status"] == "no answer: it fell" for r in gone)
    curves = study.curves_of(found)
    assert len(curves) == 30 - len(gone)
    assert curves[0].peak.displacement == 1.0
    assert curves[0].load_unit == "N"
    assert sum(r.get("mode") in ("weak", "strong") for r in found) == len(curves)
    assert study.monte_carlo(stack(1), 30, store=tmp_path / "rows.jsonl", **given) == found
    assert study.monte_carlo(stack(1), 30, store=tmp_path / "rows.jsonl", **given) == found


def test_truncation_is_stated():
    wide = {"tensile_strength": study.Random(study.normal(1e5, 0.5))}
    found = study.monte_carlo(stack(1), 2, run=mean_strength, joints=wide)
    assert any("truncated to 0" in n and f"{stats.norm.cdf(-2.0):.2g}" in n for n in found.notes)
    narrow = {"tensile_strength": study.Random(study.normal(1e5, 0.05))}
    assert not study.monte_carlo(stack(1), 2, run=mean_strength, joints=narrow).notes


def test_draws_that_change_nothing_are_told():
    """A block slides at tan(phi), whatever its dilatancy: associative limit analysis takes psi = phi."""
    block = lm.build.column(width=1.0, depth=1.0, unit_height=0.5, courses=1, joint=lm.Joint(30.0, 10.0))
    model = (block, lm.Loads.horizontal(block))
    for name, told in (("dilatancy_ratio", True), ("friction_coefficient", False)):
        draw = {name: lm.study.Random(lm.study.uniform(0.3, 0.6))}
        table = lm.study.monte_carlo(model, 4, joints=draw)
        assert any("every multiplier is 0.57735: it does not hang on what was" in n for n in table.notes) is told


@pytest.mark.parametrize(
    ("drawn", "links"),
    [
        ("dilatancy_ratio", {"cohesion": "1e5 * tan(radians(dilatancy_angle_deg))"}),
        ("friction_angle_deg", {"cohesion": "1e5 * tan(radians(dilatancy_angle_deg))"}),  # psi comes down to phi
        ("friction_angle_deg", {"cohesion": "1e5 * friction_coefficient"}),
        ("friction_coefficient", {"cohesion": "1e5 * tan(radians(friction_angle_deg))"}),
        (
            "tensile_strength",
            {"friction_angle_deg": "20 + tensile_strength / 1e4", "cohesion": "1e5 * friction_coefficient"},
        ),
    ],
)
def test_links_read_the_angles_that_the_joints_come_to_have(drawn, links):
    joint = lm.Joint(friction_angle_deg=35.0, dilatancy_angle_deg=12.0, cohesion=1e5, tensile_strength=5e4)
    assembly, loads = stack(2)
    model = assembly.with_joints(lambda _: joint), loads

    def run(assembly, loads):
        of = assembly.interfaces[0].joint
        return {"c": of.cohesion, "phi": of.friction_angle_deg, "psi": of.dilatancy_angle_deg}

    ranges = {"friction_angle_deg": (5.0, 9.0), "tensile_strength": (1e4, 9e4)}
    low, high = ranges.get(drawn, (0.1, 0.9))
    table = study.monte_carlo(
        model, 5, run=run, joints={drawn: study.Random(study.uniform(low, high))}, links=links
    )
    angle = table["psi" if "dilatancy" in links["cohesion"] else "phi"]
    assert table["c"] == pytest.approx(1e5 * np.tan(np.radians(angle)), rel=1e-9)
    assert np.ptp(angle) > 1.0


def test_a_discrete_distribution_keeps_a_value_at_its_bound():
    # glued or not: half of the joints have the value 0, which is the bound of a cohesion
    glued = study.Random(stats.bernoulli(0.5), per="interface")
    table = study.monte_carlo(stack(40), 5, run=lambda a, p: {"n": 1}, joints={"friction_coefficient": glued})
    share = table["friction_coefficient mean"].mean()
    assert share == pytest.approx(0.5, abs=4.0 * 0.5 / np.sqrt(200))
    assert table.notes == ()


def test_equal_mappings_of_parameters_give_equal_tables():
    def build(width, height):
        joint = lm.Joint(friction_angle_deg=30.0)
        wall = lm.build.wall(length=width, courses=1, unit=(width, height, 0.2), joint=joint)
        return wall, lm.Loads.weight(wall)

    draws = {"width": study.Random(study.uniform(0.2, 0.4)), "height": study.Random(study.uniform(0.1, 0.2))}
    one, other = (
        study.monte_carlo(build, 4, run=lambda a, p: {"n": 1}, parameters=p)
        for p in (draws, dict(reversed(draws.items())))
    )
    assert (one["width"] == other["width"]).all()
    assert (one["height"] == other["height"]).all()


def test_formulas_follow_each_other():
    ties = LinkedFormulas({"c": "2 * b", "b": "-a ** 2 + sqrt(a)"})
    assert ties({"a": 4.0}) == {"a": 4.0, "b": -14.0, "c": -28.0}
    assert ties({"a": np.array([1.0, 4.0])})["c"].tolist() == [0.0, -28.0]
    with pytest.raises(lm.errors.InputError, match=r"needs a value of 'tan', call it as tan\(...\)"):
        LinkedFormulas({"c": "2 * tan"})({})
    with pytest.raises(lm.errors.InputError, match="a formula of 1201 characters, the most are 1000"):
        LinkedFormulas({"c": "1+" * 600 + "1"})


def test_what_bounds_take_of_a_parameter_of_the_builder_is_told():
    drawn = {"width": study.Random(study.normal(1.0, 0.5), low=0.5)}
    found = study.monte_carlo(lambda width: stack(1), 2, run=lambda a, p: {"n": 1}, parameters=drawn)
    assert found.notes[0].startswith("width is truncated to 0.5 ... inf, which takes 0.16 of its probability")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"links": {"cohesion": "mortar"}}, "no property of a joint"),
        ({"links": {"tensile_strength": "cohesion"}}, "drawn and linked"),
        ({"links": {"density": "cohesion"}}, "properties of joints"),
        ({"links": {"cohesion": "normal_stiffness"}}, "which the joints do not have"),
        ({"links": {"cohesion": "-tensile_strength"}}, "no joint may have"),
        ({"method": "dem"}, "takes the place of a method"),
        ({"blocks": {"colour": study.Random(study.normal(1.0, 0.1))}}, "block property must be one of"),
        ({"blocks": {"density": study.Random(study.normal(1.0, 0.1), per="interface")}}, "per block"),
        ({"run": lambda a, p: {"tensile_strength": 1.0}}, "name of a drawn value"),
        ({"seed": -1}, "seed must be a whole number of at least 0"),
        ({"seed": None}, "seed must be a finite number"),
        ({"joints": {"dilatancy_ratio": SHARE}, "links": {"dilatancy_angle_deg": "3"}}, "drawn and linked"),
        ({"joints": {"dilatancy_angle_deg": SHARE}, "links": {"friction_angle_deg": "30"}}, "draw dilatancy_ratio"),
        ({"links": {"dilatancy_angle_deg": "80"}}, "more than the friction angle"),
    ],
)
def test_wrong_input_is_named(given, message):
    call = {"run": mean_strength, "joints": {"tensile_strength": study.Random(study.normal(4e4, 0.2))}, **given}
    with pytest.raises(lm.errors.InputError, match=message):
        study.monte_carlo(stack(1), 2, **call)
