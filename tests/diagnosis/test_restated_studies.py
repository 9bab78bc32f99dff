"""Studies of several numbers a specimen with other data or specimens, and what a row says of itself."""

import dataclasses
import math
from datetime import date

import numpy as np
import pytest
from diagnosis_models import (
    CAUSES,
    GAIN,
    LISTED,
    LOAD_CELL,
    ROUNDING,
    WIDTHS,
    data,
    observed,
    several_kinds,
    specimens,
    study,
    walls,
)

from limitmason.diagnosis import Cause, Noise, Observation, Rule, Study
from limitmason.diagnosis.inference.judge import Judge
from limitmason.errors import InputError


def test_other_specimens_have_the_noise_of_each_quantity():
    made = several_kinds(observed(), causes=LISTED)
    again = made.replace(specimens=(s for s in specimens()))
    assert again.scale == pytest.approx(made.scale)
    assert again.confusable().seen == pytest.approx(made.confusable().seen)


def test_other_observations_of_a_study_are_judged_by_tables_of_their_own():
    rows = observed(ROUNDING, 0.012)
    made = several_kinds(rows)
    asked = {"turned": rows[::-1], "fewer": rows[:24], "vaguer": [dataclasses.replace(r, scatter=0.2) for r in rows]}
    made.design(LISTED)
    for some in asked.values():
        restated, fresh = made.replace(measured=some), several_kinds(some)
        assert restated.columns == fresh.columns
        mine, theirs = (s.design(LISTED).whiten(s.measured) for s in (restated, fresh))
        assert mine == pytest.approx(theirs)
    assert made.replace(measured=None).measured is None
    per_row = several_kinds(rows, covariates={"day": list(range(36))})
    with pytest.raises(InputError, match="'day' is not known for every specimen"):
        per_row.replace(measured=rows[::-1])


def test_a_value_not_reached_moves_with_the_measured_values():
    rows = [dataclasses.replace(r, beyond="above") if r.quantity == "peak" else r for r in observed()]
    made = several_kinds(rows)
    made.baseline()
    low = made.measured * np.where([r.beyond == "above" for r in rows], 0.5, 1.0)
    again = several_kinds([dataclasses.replace(r, value=float(v)) for r, v in zip(rows, low, strict=True)])
    assert made.replace(measured=low).baseline() == pytest.approx(again.baseline())
    planned = several_kinds([dataclasses.replace(r, value=math.nan) for r in rows])
    assert np.isfinite(planned.baseline()).all()


def test_a_noise_to_plan_with_is_that_of_ratios_and_what_was_seen_is_misread_as_stated():
    def simulate(s, rounding=0.0):
        return {"peak": (s["width"] - 2.0 * rounding) / s["height"], "opened a|b": s["height"] + 20.0 * rounding > 0.6}

    rows = [Observation(i, q, float(v), 0.1) for i, s in enumerate(specimens()) for q, v in simulate(s).items()]
    made = Study(specimens(), simulate, rows, causes=(ROUNDING, LOAD_CELL), shared=())
    planned = made.known_design(sd=0.05).scale
    assert planned[::2] == pytest.approx(0.05)
    assert planned[1::2] == pytest.approx(made.scale[1::2])
    seen, judge = [], made.judge(rule=Rule(screen=True)).judge_with_own_noise

    def kept(self, y, *rest):
        seen.append(self.design.origin + self.design.scale * y)
        return judge(y, *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Judge, "judge_with_own_noise", kept)
        made.rehearse(n=4, pairs=False)
    # drawn data are readings, yes or no, with the rate of misreading taken off
    read = 0.1 + 0.8 * np.array(seen)[:, 1::2]
    assert read == pytest.approx(np.round(read), abs=1e-9)
    assert set(np.round(read).ravel()) == {0.0, 1.0}


def test_a_quantity_is_told_by_whole_words():
    assert [Observation(0, q, 1.0, 0.05).link for q in ("sliding load", "modelled peak", "mode 1", "slid a|b")] == [
        "log", "log", "identity", "seen"]
    assert Observation(0, "drifts", 1.0, 0.05).kind == "deformation"


def test_a_number_that_is_also_a_name_of_another_specimen_is_refused():
    stacks = [{**s, "name": i + 1} for i, s in enumerate(specimens())]

    def made(*keys):
        return Study(stacks, walls, [Observation(key, "peak", 0.2, 0.04) for key in keys])

    with pytest.raises(InputError, match=r"specimen 1: 1 is the place .* and the name of another: .* as text, '1'"):
        made(1, 2, 3)
    assert made("1", "2").called == ("specimen 1", "specimen 2")
    bare = Study(specimens(), walls, [Observation(k, "peak", 0.2, 0.04) for k in np.arange(3)])
    assert bare.rows.of.tolist() == [0, 1, 2]
    with pytest.raises(InputError, match=r"no such specimen"):
        made([1])


def test_a_circumstance_may_be_a_date_or_missing_where_several_kinds_were_measured():
    rows = observed()
    for days in ([date(2024, 5, 1 + i // 3) for i in range(12)], [None if i < 2 else i // 4 for i in range(12)]):
        columns = several_kinds(rows, covariates={"day": days}).columns
        assert columns["day in force"] == [str(days[i // 3]) if i % 3 == 0 else "-" for i in range(36)]


def test_numbers_of_any_kind_are_answers():
    def simulate(s, soft=1.0):
        return {"peak": np.float32(soft * s["width"]), "opened a|b": np.bool_(True)}

    rows = [Observation(i, q, v, 0.05) for i, s in enumerate(specimens())
            for q, v in (("peak", s["width"]), ("opened a|b", 1))]
    assert Study(specimens(), simulate, rows, shared=()).baseline()[:2] == pytest.approx([WIDTHS[0], 1.0])


@pytest.mark.slow
def test_a_variant_that_states_no_shared_noise_is_judged_by_that_statement():
    made = study(data(GAIN, 1.06, seed=3), covariates=["height", "width"])
    assert made.diagnose(CAUSES).verdict.doubt is not None
    assert made.replace(shared=()).diagnose(CAUSES).verdict.doubt is None


def two_that_act_on_each_other(**options):
    """A study of values that two causes make together, and these: the sum of what each does alone is wrong."""

    def simulate(s, *, a=0.0, b=0.0):
        return s["width"] / s["height"] * math.exp(a * s["height"] + b * s["width"] * 5 + 3.0 * a * b)

    values = np.array([simulate(s, a=0.6, b=0.7) for s in specimens()])
    values *= np.exp(0.02 * np.random.default_rng(0).standard_normal(12))
    first, second = (Cause(name, name, 0.0, (0.0, 1.0)) for name in "ab")
    return Study(specimens(), simulate, values, Noise(0.02), **options), first, second


def sizes_of(diagnosis):
    """Fitted sizes of the pair of both by name."""
    (tested,) = (t for names, t in diagnosis.verdict.tested.items() if set(names) == {"a", "b"})
    return dict(zip(tested.names, tested.sizes, strict=True))


def test_a_pair_has_the_sizes_of_its_own_causes_whatever_list_was_judged_before():
    made, first, second = two_that_act_on_each_other(pair_tables="exact")
    sizes = sizes_of(made.diagnose((first, second), draws=299))
    assert sizes == pytest.approx({"a": 0.6, "b": 0.7}, rel=0.05)
    # was the size of the other cause: the table made for the first list was read along the axes of the second
    assert sizes_of(made.diagnose((second, first), draws=299)) == pytest.approx(sizes, rel=1e-3)


def test_a_pair_whose_sum_another_list_found_wrong_is_judged_by_its_true_table():
    made, first, second = two_that_act_on_each_other()
    listed = (first, second)
    made.design(listed).grid(("a", "b"))  # as a rehearsal leaves it: the sum, not yet compared with the simulator
    made.diagnose((*listed, GAIN), draws=299)
    # was 1.0 of both, by the sum
    assert sizes_of(made.diagnose(listed, draws=299)) == pytest.approx({"a": 0.6, "b": 0.7}, rel=0.05)
