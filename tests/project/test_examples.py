"""Every short example runs as shipped, from another folder, reaches its headline numbers and prints what is stored."""

import math
import re
import subprocess

import pytest
from example_runs import EXAMPLES, LONG, run_example


def block_on_slope(g):
    for value, exact in g["multipliers"].values():
        assert value == pytest.approx(exact, abs=1e-7)
    assert g["multipliers"][0.2][1] == pytest.approx(math.tan(math.radians(33)))


def stack(g):
    assert g["prediction"].collapse_multiplier == pytest.approx(0.4 / 1.5, abs=1e-7)


def modes_of_a_wall(g):
    assert g["soft"].frequency == pytest.approx(g["stiff"].frequency / math.sqrt(2.0), rel=1e-6)


def semicircular_arch(g):
    assert g["minimum"] == pytest.approx(0.1075, abs=3e-4)
    assert g["falling"].status == "cannot stand under dead load"
    assert g["prediction"].status == "solved"
    assert g["thrust"] > 0


def wall_with_opening(g):
    right, left = g["predictions"].values()
    # the wall is symmetric
    assert right.collapse_multiplier == pytest.approx(left.collapse_multiplier, abs=1e-6)
    assert g["pulled"].status == "solved"


def rubble_leaf(g):
    assert g["leaf"].n_blocks == 41
    dry, mortar = g["predictions"]["dry"], g["predictions"]["mortar"]
    assert dry.status == "cannot stand under dead load"  # a small stone between two large ones is pushed out
    assert mortar.collapse_multiplier > 0.5 + 0.01  # friction of the beam alone carries 0.5; its bed has cohesion


def traced_drawing(g):
    assert g["wall"].n_blocks == 28
    assert all(p.status == "solved" for p in g["predictions"].values())


def capacity_curve(g):
    assert g["point"].load == pytest.approx(0.33195, rel=4e-3)
    assert g["worst"] < 1e-6


def gaps_in_a_corner_wall(g):
    first, kept = g["found"].spread_of_first_loss, g["found"].spread_of_sustained
    assert min(first.paths, kept.paths) >= 9
    # the load of the displaced wall depends on gaps far less, and not on where the path began
    assert (kept.high - kept.low) / kept.median < 0.5 * (first.high - first.low) / first.median
    assert g["late"].collapse_multiplier == pytest.approx(kept.median, rel=5e-3)
    assert first.high < g["associative"] == pytest.approx(0.36197, abs=1e-4)


def tie_rods(g):
    for name, found in g["predictions"].items():
        assert found.status == "solved"
        assert found.collapse_multiplier == pytest.approx(g["exact"][name], abs=1e-6)
    assert g["sliding"].collapse_multiplier == pytest.approx(0.25, abs=1e-6)
    assert g["moving"] == ["floor"]
    for name, curve in g["curves"].items():
        # the rods stretch by half a millimetre before they yield, and the facade leans by as much
        assert 0.999 * g["exact"][name] < curve.peak.load < g["exact"][name]
        assert all(c.accepted for c in curve.certificates)
    assert g["curves"]["rods"].load[-1] > 0.25 > 0.1 > g["curves"]["bare"].load[-1]


def wall_flow_rules(g):
    values = g["multipliers"]
    assert values[0.0] <= values[0.5] + 1e-6 <= values[1.0] + 2e-6
    assert values[1.0] == pytest.approx(g["associative"].collapse_multiplier, abs=1e-6)


def two_mechanisms(g):
    assert g["associative"].collapse_multiplier == pytest.approx(0.33195, abs=1e-4)
    assert g["lowest"].collapse_multiplier <= 1.01 * 0.264


def mechanisms_of_a_u_shaped_wall(g):
    found = g["found"]
    # the power of the mechanism balances: each multiplier solves its own virtual-work equation
    for name, prediction in found.items():
        low, high = prediction.details.get("omega_bracket", (0.0, 1.0))
        assert low - 1e-9 <= prediction.collapse_multiplier <= high + 1e-9, name
    assert g["associative"].collapse_multiplier <= g["smallest"].collapse_multiplier + 1e-7
    assert g["smallest"].bound.startswith("upper")


def diagnose_pavia(g):
    plain, dilatant = g["verdicts"].values()
    # without plans no cause is told from the others; a walls' lean or an offset of a degree stays, dilatancy goes
    assert plain.kind in ("behaves like", "either")
    assert plain.causes[0] == "angle offset"
    assert -1.6 < plain.estimates["angle offset"].size < -0.8
    assert "dilatancy" not in plain.causes
    assert plain.gain.error_after < 0.5 * plain.gain.error_before
    # where the joints dilate fully, that they do less is not rejected
    assert "less dilatancy" in dilatant.causes
    assert g["dof"] == 3


def calibrate_brick_panels(g):
    fit = g["fit"]
    # two outputs that scatter as four panels do fix nothing to 5 %, and the fit says so
    assert fit.identified == ()
    assert math.isinf(fit.deviation["normal_stiffness"])  # no stiffness was measured
    # the published set lies within what the panels allow
    for name in ("cohesion", "tensile_strength"):
        low, high = fit.interval[name]
        assert low < g["paper"][name] < high
    # a peak is fitted to the mean of four of one geometry, so that each left out is missed by their scatter
    assert 0.2 < fit.left_out.error < 0.6
    assert g["plan"].best.name == "triplet"


def calibrate_murano_stiffness(g):
    # the stiffness of the source's own models, from their frequencies, on a bond that is assumed
    for name, far in (("DS", 0.20), ("REGW", 0.05)):
        fit = g["fits"][name]
        printed = 1e9 * float(g["lm"].experiments.load("murano-u-walls", name).row["kn"])
        assert fit.parameters["normal_stiffness"] == pytest.approx(printed, rel=far)
        assert fit.tied["shear_stiffness"] == fit.parameters["normal_stiffness"] / 2
        # every frequency goes with the root of the stiffness: the logarithms of what is left have mean zero
        rest = [math.log(fitted / measured) for _, _, measured, fitted, _ in fit.rows]
        assert sum(rest) == pytest.approx(0.0, abs=1e-5)


def stochastic_panels(g):
    # what the page shows is what the stored runs give
    page = (EXAMPLES.parent / "docs" / "papers" / "stochastic.md").read_text(encoding="utf-8")
    assert "\n".join(g["markdown"](g["lines"])) in page
    spread = {name: found.variation[-1] for name, found in g["spreads"].items()}
    floor = g["study"].running(g["tables"]["floor"], "ultimate").variation[-1]
    # strengths govern; one draw for all spreads a little more than published, as the slopes of the page say; bricks do
    # not govern, and lie near the noise of a brittle sequence
    for number, printed in ((1, 0.234), (4, 0.2211)):
        assert 0.0 < spread[number, "non-spatial"] / printed - 1.0 < 0.25
    assert spread[2, "spatial"] < 2.5 * floor < 0.25 * spread[1, "spatial"]
    assert spread[3, "spatial"] > spread[3, "non-spatial"]  # as published
    # joints that keep something share the load: the published ratio 0.43 lies between them and brittle ones
    assert g["by_law"]["nothing is lost"] < 0.43 < g["by_law"]["opening takes all"]
    assert g["by_law"]["cohesion stays"] < 0.43


CHECKS = {
    f.__name__: f
    for f in (
        block_on_slope, stack, modes_of_a_wall, semicircular_arch, wall_with_opening, rubble_leaf, traced_drawing,
        capacity_curve, gaps_in_a_corner_wall, tie_rods, wall_flow_rules, two_mechanisms,
        mechanisms_of_a_u_shaped_wall, diagnose_pavia, calibrate_brick_panels, calibrate_murano_stiffness,
        stochastic_panels,
    )
}


def test_every_example_is_checked():
    assert {p.stem for p in EXAMPLES.glob("*.py")} == {*CHECKS, *LONG}


def test_every_figure_of_an_example_is_written_where_it_is_run():
    for path in EXAMPLES.glob("*.py"):
        for target in re.findall(r"savefig\(\s*([^\s,)]+)", path.read_text(encoding="utf-8")):
            assert re.match(r'f?"[^/]*$|name$|report\.with_name', target), (path.name, target)


def test_no_figure_lies_in_the_root_of_the_repository():
    root = EXAMPLES.parent
    ignored = (root / ".gitignore").read_text(encoding="utf-8").split()
    assert {"/*.png", "/*.gif", "/*.pdf", "/*.svg", "/diagnosis/"} <= set(ignored)
    listed = ["git", "ls-files", "*.png", "*.gif"]
    tracked = subprocess.run(listed, cwd=root, capture_output=True, text=True, check=False)
    assert not [name for name in tracked.stdout.split() if "/" not in name]


@pytest.mark.parametrize("name", sorted(CHECKS))
def test_example(name, tmp_path, monkeypatch, capsys):
    run_example(name, CHECKS[name], tmp_path, monkeypatch, capsys)
