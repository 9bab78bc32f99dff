"""How long the non-associative analysis searches: short where nothing slides, no longer than asked, and it says so."""

import time

import numpy as np
import pytest
from walls import corner, running_bond, stack

import limitmason as lm
from limitmason.cli import main
from limitmason.limit.nonassociative import analysis, force_program, ordered_search
from limitmason.limit.nonassociative.force_program import ForceProgram
from limitmason.limit.nonassociative.search import Effort, search_smallest
from limitmason.methods import predict_cases


def searched(wall, direction=(0, -1, 0), **options):
    told = []
    loads = lm.Loads.horizontal(wall, direction)
    return lm.limit_analysis(wall, loads, "non-associative", progress=told.append, **options), told


@pytest.mark.slow
def test_a_wall_that_overturns_as_one_is_not_searched_for_long():
    # thickness over height: nothing slides, so the state is admissible whatever the dilatancy
    wall = running_bond(3, 7)
    found, told = searched(wall)
    assert found.status == "solved"
    assert found.collapse_multiplier == pytest.approx(0.2 / 1.4, abs=1e-8)
    assert found.details["slides_nowhere"]
    assert "slides nowhere" in found.bound
    assert "not proven" in found.bound
    assert len(told) == found.details["candidates"] <= 6
    assert found.certificate.complementarity < 1e-8


def test_a_turned_and_renumbered_wall_that_overturns_is_found_to_slide_nowhere_too():
    wall = running_bond(2, 4)
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    moved = wall.transformed(3.0 * turn, (1.0, 2.0, 3.0))
    moved = moved.renumbered(np.random.default_rng(2).permutation(wall.n_blocks))
    found, _ = searched(moved, turn @ (0.0, -1.0, 0.0))
    assert found.details["slides_nowhere"]
    assert found.collapse_multiplier == pytest.approx(0.25, abs=1e-8)


@pytest.fixture(scope="module")
def at_the_corner():
    return searched(corner())


@pytest.mark.slow
def test_a_wall_that_slides_is_searched(at_the_corner):
    found, _ = at_the_corner
    assert not found.details["slides_nowhere"]
    assert found.details["candidates"] > 20
    assert found.collapse_multiplier < found.details["radenkovic"][1] - 0.01


@pytest.mark.parametrize("in_plane", [None, False])
def test_the_search_ends_where_the_lower_bound_is_met(in_plane):
    # rocking of a slender stack is governed by the same corner with psi in place of phi
    joint = lm.Joint.from_friction_coefficient(0.7, dilatancy_angle_deg=30.0)
    found, told = searched(stack([(0.3, 0.3)] * 4, joint=joint), (1, 0, 0), in_plane=in_plane, prove=False)
    assert found.collapse_multiplier == pytest.approx(0.25, abs=1e-6)
    assert found.details["bound_met"]
    assert found.bound.startswith("exact: smallest admissible multiplier, it meets the lower bound")
    assert len(told) == 1


@pytest.mark.slow
def test_every_stage_is_told_with_the_lowest_value_so_far(at_the_corner):
    found, told = at_the_corner
    lowest = [t.best for t in told]
    assert np.all(np.diff(lowest) <= 0.0)
    assert lowest[-1] == pytest.approx(found.collapse_multiplier, abs=1e-12)
    assert [t.best for t in found.details["trials"]] == pytest.approx(lowest)
    assert f"lowest so far {lowest[0]:.6g}" in str(told[0])


def test_a_time_too_short_for_any_state_gives_the_nearest_one_and_says_that_the_time_ended():
    found, told = searched(corner(), time_limit=1e-6)
    assert found.status == "time limit ended it"
    assert any("the time limit ended the search after 1 trials" in w for w in found.warnings)
    assert any("the multiplier is not certified" in w for w in found.warnings)
    assert "not admissible" in str(found.bound)
    assert found.certificate.equilibrium_residual < 1e-6  # forces in equilibrium with their multiplier all the same
    low, high = found.details["radenkovic"]
    assert high > 0.4
    assert low <= found.collapse_multiplier <= 2.0 * high
    assert len(told) == 1


def test_programs_end_with_the_time_and_leave_the_associative_bound(monkeypatch):
    wall = corner()
    upper = lm.limit_analysis(wall, lm.Loads.horizontal(wall, (0, -1, 0)))
    monkeypatch.setattr(force_program, "GRACE", 1e-9)
    found, told = searched(wall, time_limit=1e-6)
    assert found.status == "time limit ended it"
    assert found.bound.kind == "upper"
    assert found.collapse_multiplier == pytest.approx(upper.collapse_multiplier, rel=1e-9)
    assert np.isnan(found.details["sequential_multiplier"])
    assert found.certificate.equilibrium_residual < 1e-6
    assert any("below the associative bound, which is given" in w for w in found.warnings)
    assert len(told) == 1


@pytest.mark.parametrize("search", ["quick", "standard", "thorough"])
def test_no_program_but_one_ends_after_the_time_limit(search, monkeypatch):
    """A clock that each cone program of the search moves on by a second: the last one may end after the limit."""
    clock = [0.0]

    def second(solve):
        def timed(*args, **options):
            clock[0] += 1.0
            return solve(*args, **options)

        return timed

    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    for name in ("solve", "largest"):
        monkeypatch.setattr(ForceProgram, name, second(getattr(ForceProgram, name)))
    wall, ended = corner(), 0
    for limit in (2.5, 4.5, 9.5, 17.5, 33.5, 64.5):
        clock[0] = 0.0
        found, _ = searched(wall, search=search, time_limit=limit)
        assert clock[0] <= limit + 1.0, limit
        ended += found.details["time_limit_reached"]
        told = any("the time limit ended the search after" in w for w in found.warnings)
        assert told == found.details["time_limit_reached"]
        assert np.isfinite(found.collapse_multiplier)
        assert found.status in ("solved", "time limit ended it")
    assert ended >= 3


def interrupting(after):
    """A progress call that is Ctrl-C at a trial, and what it was told."""
    told = []

    def say(trial):
        told.append(trial)
        if len(told) == after:
            raise KeyboardInterrupt

    return say, told


@pytest.mark.parametrize("after", [1, 2, 4])
def test_ctrl_c_keeps_the_lowest_state_so_far(after):
    """Trials 1 and 2 are a sequence and its push in space; the state returned is admissible by its certificate."""
    wall = corner()
    loads = lm.Loads.horizontal(wall, (0, -1, 0))
    say, told = interrupting(after)
    found = lm.limit_analysis(wall, loads, "non-associative", progress=say)
    assert found.status == "interrupted"
    assert len(told) == found.details["candidates"] == after
    assert found.collapse_multiplier == pytest.approx(min(t.certified for t in told), rel=1e-9)
    assert found.certificate.complementarity < 1e-6
    assert found.certificate.equilibrium_residual < 1e-6
    assert found.range[0] <= found.collapse_multiplier <= found.range[1]
    assert any(f"the search was interrupted after {after} trials" in w for w in found.warnings)
    assert not found.details["time_limit_reached"]


def test_an_interrupted_search_ends_what_goes_on_with_its_multiplier():
    wall = corner()
    loads = lm.Loads.horizontal(wall, (0, -1, 0))
    say, told = interrupting(1)
    with pytest.raises(KeyboardInterrupt):
        lm.compare(wall, loads, ("non-associative", "associative"), non_associative={"progress": say})
    say, again = interrupting(1)
    with pytest.raises(KeyboardInterrupt):
        predict_cases(wall, {"a": loads, "b": loads}, "non-associative", progress=say)
    assert len(told) == len(again) == 1


def test_ctrl_c_in_a_proof_keeps_the_state_of_the_search(monkeypatch):
    """tan(phi) W of a pile that slides as one."""

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(ordered_search, "prove_smallest", interrupted)
    wall = stack([(0.2, 0.1)] * 4, mu=0.3)
    found = lm.limit_analysis(wall, lm.Loads.horizontal(wall), "non-associative")
    assert found.status == "interrupted"
    assert found.collapse_multiplier == pytest.approx(0.3, rel=1e-6)
    assert found.details["proof"] is None
    assert "not proven" in found.bound


@pytest.mark.slow
def test_the_command_line_tells_stages_and_takes_search_and_time_limit(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(time, "perf_counter", time.process_time)
    wall = corner()
    file = tmp_path / "corner.json"
    lm.formats.write_json(file, wall, lm.Loads.horizontal(wall, (0, -1, 0)))
    solve = ["solve", str(file), "--flow-rule", "non-associative"]
    assert main(["--progress", "always", *solve, "--search", "thorough", "--time-limit", "1"]) == 0
    out, err = capsys.readouterr()
    assert "the time limit ended the search" in out
    assert err.count("lowest so far") > 1
    assert main([*solve, "--time-limit", "-1"]) == 2
    assert "time_limit must be positive" in capsys.readouterr().err
    assert main(["solve", str(file), "--search", "quick"]) == 2
    assert "--search is not used by associative" in capsys.readouterr().err


def test_the_search_with_a_little_dilatancy_ends_with_the_time_too(monkeypatch):
    """It began before the limit and went on to its end before: 17 s more on a wall of 924 points."""
    given = []

    def stopped(*arguments, **options):
        given.append(options)
        return search_smallest(*arguments, **options)._replace(stopped=True)

    monkeypatch.setattr(analysis, "search_smallest", stopped)
    found, _ = searched(running_bond(2, 2), (1, 0, 0), search="quick", time_limit=600.0, prove=False, measure_jump=True)
    assert given[0]["deadline"] < np.inf
    # what was found until then may lie high, and is no jump
    assert np.isnan(found.details["at_small_dilatancy"])
    assert not any("jump" in warning for warning in found.warnings)


@pytest.mark.parametrize("angle", [60.0, 87.0, 89.9])
def test_the_search_ends_as_low_at_steep_friction_as_at_less_of_it(angle):
    """1 / 1.4, proven at every one of these angles by the mixed-integer program.

    Nothing slides in that state: it keeps the law at any steeper friction. The search ended at 4/3 from 87 degrees on.
    """
    effort = Effort(slopes=(0.005,), mixings=(0.6,), random_starts=4, pushes=(), lower_each=True, descents=4)
    wall = running_bond(2, 3, joint=lm.Joint(angle))
    found, _ = searched(wall, (1, 0, 0), search=effort, prove=False, measure_jump=False)
    assert found.collapse_multiplier == pytest.approx(1.0 / 1.4, rel=1e-9)
    assert found.certificate.complementarity < 1e-8


@pytest.mark.parametrize("angle", [87.0, 89.9])
def test_the_short_search_in_space_ends_as_low_at_steep_friction_too(angle):
    """The state in the plane of the wall, under the part of the push along it; it was 1.36 above 60 degrees."""
    wall = running_bond(2, 3, joint=lm.Joint(angle))
    found, _ = searched(wall, (1, 0.2, 0), measure_jump=False)
    assert found.collapse_multiplier == pytest.approx(np.sqrt(1.04) / 1.4, rel=1e-6)


def test_what_stands_by_steep_friction_alone_is_searched_with_it():
    """Blocks on a ramp of 70 degrees with friction of 80: they are pushed down it at tan(10 degrees)."""
    turn = np.radians(70.0)

    def turned(x0, x1, y0, y1):
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        return corners @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]

    ramp = lm.Assembly.from_polygons(
        [turned(-2, 8, -0.5, 0), turned(0, 1, 0, 0.3), turned(1, 2, 0, 0.3)], thickness=1.0, joint=lm.Joint(80.0),
        fixed=[0],
    )
    found, told = searched(ramp, (-1, 0, 0), prove=False, measure_jump=False)
    assert found.collapse_multiplier == pytest.approx(np.tan(np.radians(10.0)), rel=1e-6)
    random = [trial for trial in told if "best" not in trial.strategy and "sequence" not in trial.strategy]
    assert random
    assert all(np.isfinite(trial.certified) for trial in random)
