"""Results carry what programs ask of them as typed fields: kind of bound, range, governing case."""

import json
import math

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm
import mechanisms
from dem.stages.resuming import RunStatus
from limitmason import formats
from limitmason.answers.results import Bound, BoundKind, ContactModel, FlowRule, Mechanism, Prediction, Status
from limitmason.capacity.outcomes import PathEnd
from limitmason.errors import InputError
from limitmason.model.stages import Settle

DRY = lm.Joint(33.0)
GLUED = lm.Joint(33.0, cohesion=2e3, tensile_strength=1e3)


def model(joint=DRY):
    wall = on_slab([((0.0, 0.0, 0.0), (0.4, 0.3, 0.3)), ((0.0, 0.0, 0.3), (0.3, 0.3, 0.5))], joint=joint, density=2e3)
    return wall, lm.Loads.horizontal(wall)


KINDS = {
    "associative": (lambda w, p: lm.limit_analysis(w, p), DRY, BoundKind.EXACT),
    "torsion limit": (lambda w, p: lm.limit_analysis(w, p, torsion_limit=True, in_plane=False), DRY,
                      BoundKind.ESTIMATE),
    "cohesive faces on a grid": (
        lambda w, p: lm.limit_analysis(w, p, contact_model="grid", grid=(2, 2), in_plane=False), GLUED,
        BoundKind.ESTIMATE,
    ),
    "proven smallest": (lambda w, p: lm.limit_analysis(w, p, "non-associative", prove=True), DRY, BoundKind.EXACT),
    "quick search": (lambda w, p: lm.limit_analysis(w, p, "non-associative", search="quick", prove=False), DRY,
                     BoundKind.ESTIMATE),
    "bracket, low": (lambda w, p: lm.limit.limit_bracket(w, p).lower, lm.Joint(33.0, 20.0), BoundKind.LOWER),
    "bracket, high": (lambda w, p: lm.limit.limit_bracket(w, p).upper, lm.Joint(33.0, 20.0), BoundKind.UPPER),
    "dem": (lambda w, p: dem.collapse(w, p, contact_points=(2, 2), error_budget=()), DRY, BoundKind.ESTIMATE),
    "admissible mechanism": (lambda w, p: lm.predict(w, p, "mechanisms"), DRY, BoundKind.UPPER),
    "one block": (
        lambda w, p: mechanisms.stack(width=0.2, course_height=0.2, courses=5, friction=0.6), DRY, BoundKind.EXACT,
    ),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_kind_of_a_bound_is_what_its_words_say(name):
    call, joint, kind = KINDS[name]
    bound = call(*model(joint)).bound
    assert isinstance(bound, Bound)
    assert bound.kind is kind
    assert bound.startswith(str(bound.kind))


def test_without_a_multiplier_there_is_no_bound():
    blocks = [((0.25, 0.0, 0.0), (0.45, 0.3, 0.3)), ((0.0, 0.0, 0.3), (0.3, 0.3, 0.6))]
    leaning = on_slab(blocks, joint=DRY, density=2e3)
    found = lm.limit_analysis(leaning, lm.Loads.horizontal(leaning))
    assert found.status == "cannot stand under dead load"
    assert (found.bound.kind, str(found.bound)) == (BoundKind.NONE, "none")


def test_words_of_another_package_are_taken_for_the_kind_that_they_begin_with():
    for words, kind in (("upper: theirs", BoundKind.UPPER), ("their own", BoundKind.ESTIMATE), ("", BoundKind.NONE)):
        found = Prediction("theirs", 0.3, words, Status.SOLVED)
        assert (found.bound.kind, str(found.bound)) == (kind, words)


def test_what_logic_needs_is_in_fields():
    wall, loads = model()
    associative = lm.predict(wall, loads)
    assert (associative.flow_rule, associative.contact_model) == (FlowRule.ASSOCIATIVE, ContactModel.VERTICES)
    lowest = lm.predict(wall, loads, "non-associative", search="quick")
    assert lowest.flow_rule is FlowRule.NON_ASSOCIATIVE
    assert lowest.range.known
    assert lowest.range.low <= lowest.collapse_multiplier <= lowest.range.high
    run = lm.predict(wall, loads, "dem", contact_points=(2, 2), error_budget=("stiffness",))
    assert set(run.error_budget) == {"stiffness"}
    assert (run.range.low, run.range.high) == run.interval
    assert run.flow_rule is None
    lead = lm.predict(wall, loads, "mechanisms")
    assert lead.governing == lead.details["governing"]
    crushing = lm.predict(*model(lm.Joint(33.0, compressive_strength=1e6)))
    assert (crushing.plane, crushing.stress_block) == (True, True)


@pytest.mark.parametrize("method", ["associative", "non-associative", "mechanisms"])
def test_files_keep_the_typed_fields_and_those_of_0_1_are_read(method, tmp_path):
    wall, loads = model()
    found = lm.predict(wall, loads, method)
    path = tmp_path / "answer.json"
    formats.write_prediction(path, found)
    back = formats.read_prediction(path)
    names = ("bound", "flow_rule", "contact_model", "plane", "stress_block", "governing", "range")
    for name in names:
        here, there = getattr(found, name), getattr(back, name)
        assert here == there or (name == "range" and math.isnan(here.low) and math.isnan(there.low))
        assert type(here) is type(there)
    assert back.bound.kind is found.bound.kind
    # a file of 0.1 has the words of the bound, and the rest in provenance and details
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["bound_kind"] == str(found.bound.kind)
    new = {"bound_kind", "flow_rule", "contact_model", "plane", "stress_block", "governing", "error_budget", "range"}
    old = {k: v for k, v in document.items() if k not in new} | {"version": 1}
    path.write_text(json.dumps(old), encoding="utf-8")
    again = formats.read_prediction(path)
    assert again.bound.kind is found.bound.kind
    for name in names[:-1]:
        assert getattr(again, name) == getattr(found, name), name
    document["bound_kind"] = "hearsay"
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(ValueError, match="bound_kind: expected one of exact, lower, upper, estimate, none"):
        formats.read_prediction(path)


def test_stored_answers_of_a_comparison_keep_their_kind(tmp_path):
    wall, loads = model()
    fresh = lm.compare(wall, loads, ("mechanisms",), store=tmp_path)["mechanisms"]
    assert fresh.bound.kind is BoundKind.UPPER
    (path,) = tmp_path.glob("**/answers.jsonl")
    before = path.read_text(encoding="utf-8")
    kept = lm.compare(wall, loads, ("mechanisms",), store=tmp_path)["mechanisms"]
    assert (kept.bound.kind, str(kept.bound)) == (BoundKind.UPPER, str(fresh.bound))
    assert path.read_text(encoding="utf-8") == before, "nothing was solved again"


def test_the_words_of_a_closed_set_become_its_members_and_others_are_refused():
    found = Prediction("other", 0.5, Bound(BoundKind.NONE), "solved", flow_rule="associative", contact_model="grid")
    assert found.status is Status.SOLVED
    assert found.flow_rule is FlowRule.ASSOCIATIVE
    assert found.contact_model is ContactModel.GRID
    with pytest.raises(InputError, match="status must be one of 'solved', .* got 'optimal'"):
        Prediction("other", 0.5, Bound(BoundKind.NONE), "optimal")
    with pytest.raises(InputError, match="flow_rule must be one of"):
        Prediction("other", 0.5, Bound(BoundKind.NONE), "solved", flow_rule="normality")


@pytest.mark.slow
def test_how_a_run_ended_is_a_member_of_a_closed_set_that_reads_as_before(tmp_path):
    wall = lm.build.wall(length=0.4, courses=2, unit=(0.2, 0.1, 0.1), joint=lm.Joint(33.0))
    loads = lm.Loads.horizontal(wall)
    history = dem.simulate(wall, Settle())
    assert history.status is RunStatus.FINISHED
    assert str(history.status) == "finished"
    history.save(tmp_path / "history.npz")
    assert dem.History.load(tmp_path / "history.npz", wall).status is RunStatus.FINISHED
    assert isinstance(lm.pushover(wall, loads).status, PathEnd)
    assert isinstance(dem.collapse(wall, loads, error_budget=(), contact_points=(2, 2)).status, Status)


def test_a_joint_that_opens_as_far_as_it_slides_is_not_counted_twice():
    moved = Mechanism(np.zeros((2, 6)), np.array([1.0, 0.1]), np.array([[1.0], [0.5]]))
    assert moved.pattern(np.array([0, 1]), ["a", "b"]) == {"opened a": 1, "opened b": 0, "slid a": 0, "slid b": 1}
