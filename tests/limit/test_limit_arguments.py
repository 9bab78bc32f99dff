"""No argument of limit analysis is ignored in silence: it is used, or refused by name."""

import pytest
from walls import stack

import limitmason as lm
from limitmason.errors import InputError

TWO = [(1.0, 1.0), (1.0, 1.0)]


@pytest.mark.parametrize("solver", ["interior-point", "cvxpy", "cvxpy:HIGHS"])
def test_torsion_limit_takes_clarabel_only(solver):
    assembly = stack(TWO)
    with pytest.raises(ValueError, match="torsion limit"):
        lm.limit_analysis(assembly, lm.Loads.horizontal(assembly, (1, 1, 0)), torsion_limit=True, solver=solver)


@pytest.mark.parametrize("solver", ["clarabel", "interior-point", "cvxpy", "cvxpy:HIGHS", "simplex"])
def test_non_associative_takes_no_solver(solver):
    assembly = stack(TWO)
    with pytest.raises(ValueError, match="solver="):
        lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), "non-associative", solver=solver)


def test_verbose_reports_the_programs_of_the_non_associative_rule_too(capfd):
    assembly = stack(TWO)
    lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), "non-associative", verbose=True)
    assert "clarabel" in capfd.readouterr().out.lower()


def test_cvxpy_takes_no_tolerance():
    assembly = stack(TWO)
    with pytest.raises(ValueError, match="tolerance"):
        lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), solver="cvxpy:HIGHS", tolerance=1e-6)


@pytest.mark.parametrize("rule", ["associative", "non-associative"])
@pytest.mark.parametrize("value", [0, -1.0, float("nan"), "5"])
def test_numbers_that_are_none_are_refused_by_the_name_of_the_argument(rule, value):
    assembly = stack(TWO)
    for name in ("tolerance", "time_limit", "accuracy")[: 1 if rule == "associative" else 3]:
        with pytest.raises(lm.errors.InputError, match=name):
            lm.limit_analysis(assembly, lm.Loads.horizontal(assembly), rule, **{name: value})


@pytest.mark.parametrize("torsion", [False, True])
def test_verbose_reports_every_program(capfd, torsion):
    assembly = stack(TWO)
    loads = lm.Loads.horizontal(assembly, (0.8, 0.6, 0))
    lm.limit_analysis(assembly, loads, torsion_limit=torsion, solver="clarabel", verbose=True)
    assert capfd.readouterr().out.lower().count("clarabel.rs") >= (2 if torsion else 1)


@pytest.mark.parametrize("heights", [(2,), (2, 3)])
def test_wrong_arguments_are_refused_with_one_part_and_with_several(heights):
    boxes = [((3 * i, 0, k), (3 * i + 1, 1, k + 1)) for i, n in enumerate(heights) for k in range(n)]
    from walls import on_slab

    assembly = on_slab(boxes)
    loads = lm.Loads.horizontal(assembly)
    with pytest.raises(TypeError, match="unknown option 'search'"):
        lm.limit_analysis(assembly, loads, search="quick")
    with pytest.raises(ValueError, match="solver must be one of"):
        lm.limit_analysis(assembly, loads, solver="simplex")
    with pytest.raises(ValueError, match="contact_model"):
        lm.limit_analysis(assembly, loads, contact_model="points")
    with pytest.raises(ValueError, match="live load is zero"):
        lm.limit_analysis(assembly, lm.Loads.weight(assembly))
    with pytest.raises(ValueError, match="loads are for"):
        lm.limit_analysis(assembly, lm.Loads(loads.dead[:2], loads.live[:2]))


def test_a_bracket_uses_or_refuses_its_grid_as_limit_analysis_does():
    wall = lm.build.column(width=0.3, depth=0.3, unit_height=0.2, courses=2, joint=lm.Joint(30.0))
    loads = lm.Loads.horizontal(wall)
    with pytest.raises(InputError, match="grid"):
        lm.limit_bracket(wall, loads, grid=(5, 5))
    upper = lm.limit_bracket(wall, loads, contact_model="lobatto", in_plane=False).upper
    whole = lm.limit_analysis(wall, loads, contact_model="lobatto", in_plane=False)
    assert upper.provenance["contact_points"] == whole.provenance["contact_points"]


@pytest.mark.parametrize(("call", "message"), [
    (lambda w, h: lm.limit_analysis(w, h, torsion_limit="1"), "torsion_limit"),
    (lambda w, h: lm.limit_analysis(w, h, solver=None), "solver"),
    (lambda w, h: lm.load_region(w, "x", [h]), "dead"),
    (lambda w, h: lm.proven_range(w, h, which=5), "which"),
    (lambda w, h: lm.proven_range(w, h, velocity_bound="x"), "velocity_bound"),
    (lambda w, h: lm.limit_analysis(w, h, "non-associative", seed=-1), "seed"),
])
def test_what_is_no_number_is_refused_by_name(call, message):
    wall = lm.build.column(width=0.3, depth=0.3, unit_height=0.2, courses=2, joint=lm.Joint(30.0))
    with pytest.raises(InputError, match=message):
        call(wall, lm.Loads.horizontal(wall))


def test_a_whole_number_may_be_a_float_and_a_direction_needs_a_name():
    """A seed of 2.0 and a direction given as a list ended in a TypeError of another package."""
    wall = lm.build.column(width=0.3, depth=0.3, unit_height=0.2, courses=2, joint=lm.Joint(30.0))
    loads = lm.Loads.horizontal(wall)
    found = [lm.limit_analysis(wall, loads, "non-associative", search="quick", seed=s) for s in (2, 2.0)]
    assert found[0].collapse_multiplier == found[1].collapse_multiplier
    assert lm.proven_range(wall, loads, which="smallest", seed=2.0).proven
    with pytest.raises(InputError, match="give other directions by name"):
        lm.stability(wall, tilts=[[1.0, 0.0, 0.0]])
