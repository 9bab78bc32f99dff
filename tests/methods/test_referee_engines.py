"""Every engine against the referee: own statics, and what no answer may depend on.

By the thousand: ``python -m tests.referee --engine all --seed 1 --out DIR``.
"""

from dataclasses import replace

import numpy as np
import pytest
from referee.engines import ENGINES
from referee.lane import DISAGREE, trial
from referee.laws import different
from referee.model import Frame
from scipy.spatial.transform import Rotation

from limitmason.errors import NotConverged

SLICE = {"limit": 3, "settlement": 4, "elastic": 2, "modes": 1, "dem simulate": 1}
"""Structures of each engine in the fast lane; one of each other in the whole suite."""


@pytest.mark.parametrize("name", [n if n in SLICE else pytest.param(n, marks=pytest.mark.slow) for n in ENGINES])
def test_an_engine_keeps_the_laws(name):
    engine = ENGINES[name]
    rows = [trial(engine, 22, k, engine.laws[:3]) for k in range(SLICE.get(name, 1))]
    assert not [row for row in rows if row["outcome"] == DISAGREE], rows
    assert any(row["outcome"] == "agree" for row in rows), rows


@pytest.mark.parametrize(("name", "number"), [
    ("elastic", 1), ("elastic", 20), ("elastic simply deformable", 2), ("elastic simply deformable", 5)
])
def test_what_stands_on_a_map_answers_as_at_the_origin(name, number):
    """Coordinates 5,300 km from the origin are rounded to 1e-9 m, and no product of them may enter."""
    engine, turn = ENGINES[name], Rotation.from_euler("z", 34.0, degrees=True).as_matrix()
    frame = Frame(matrix=turn, shift=turn.T @ [6e5, 5.3e6, 100.0])
    model = engine.model(4711, number)
    assert not different(engine.ask(model.seen(frame)), engine.ask(model), frame, 1e-5)


# ---- the referee itself ---------------------------------------------------------------------------------------------


def spoiled(name, spoil):
    """An engine whose answers are spoiled, asked for one structure."""
    engine = ENGINES[name]
    return trial(replace(engine, answer=lambda model: spoil(engine.answer(model), model)), 5, 1).get("complaints", {})


def test_an_answer_that_is_off_is_found_by_own_statics():
    def more(answer, model):
        q = answer["multiplier"]
        return answer | {"multiplier": q._replace(value=1.00001 * q.value)}

    assert list(spoiled("limit", more)) == ["own statics"]


def test_own_statics_hold_where_sizes_lie_decades_apart():
    """Shims under a giant: an interior point ends at .601, the tangent planes of the same cones at .636 from above."""
    assert trial(ENGINES["limit"], 4711, 436, ())["outcome"] == "agree"


def test_an_answer_that_depends_on_axes_numbers_or_units_is_found_by_the_laws():
    def by_place(answer, model):
        q = answer["frequency"]
        return answer | {"frequency": q._replace(value=q.value * (1 + 1e-4 * np.sign(model.solids[0][0][0, 0])))}

    def by_unit(answer, model):
        q = answer["frequency"]
        return answer | {"frequency": q._replace(value=q.value + 1e-3)}

    assert spoiled("modes", by_place)
    assert {"in mm, N", "in other units"} & set(spoiled("modes", lambda a, m: by_unit(a, m)))


def test_a_raw_error_is_a_failure_and_a_refusal_in_one_frame_too():
    def raw(answer, model):
        raise TypeError("int() argument")

    def sometimes(answer, model):
        if model.length > 100.0:
            raise NotConverged("too large")
        return answer

    assert list(spoiled("elastic", raw)) == ["raw error"]
    assert "in mm, N" in spoiled("elastic", sometimes)
