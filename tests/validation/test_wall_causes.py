"""Causes of what wall models get wrong: nested in their model, on the walls they are about, by laws in closed form."""

import numpy as np
import pytest

from limitmason import experiments
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.experiments.modern_walls import DENSITY, axial_force
from limitmason.limit import limit_analysis
from validation.wall_causes import (
    CRACK,
    FORCE,
    MODE,
    REPLICATES,
    STIFFNESS,
    WallModel,
    as_specimens,
    cracking_force,
    replicate_scatter,
    responses,
    stiffness,
    wall_causes,
)

NAME = "modern-walls"
HELD, CANTILEVER, SOLID = "189", "126", "25"


def test_stiffness_is_that_of_timoshenko_and_the_first_crack_that_of_navier():
    test = experiments.load(NAME, HELD)
    row = test.row
    length, height, t = (float(row[k]) for k in ("L", "H", "t"))
    e, g = 1e6 * float(row["E"]), 1e6 * float(row["G"])
    held = 1.0 / (height**3 / (12.0 * e * t * length**3 / 12.0) + 1.2 * height / (g * length * t))
    assert stiffness(test) == pytest.approx(1e-3 * held * height / 100.0)
    free = 1.0 / (height**3 / (3.0 * e * t * length**3 / 12.0) + 1.2 * height / (g * length * t))
    assert stiffness(test.with_options(shear_span=1.0)) == pytest.approx(1e-3 * free * height / 100.0)
    # the edge has its bond and no more at M = V H0
    bare = test.with_options(tension_share=0.0)
    moment = 1e3 * cracking_force(bare) * 0.5 * height
    assert moment / (t * length**2 / 6.0) == pytest.approx(1e6 * float(row["sigma0"]))


def test_causes_are_nested_and_act_on_their_own_walls(tmp_path):
    model = WallModel("laws", tmp_path / "store.jsonl", ("A", "B"))
    wall = {"specimen": CANTILEVER, "campaign": "A"}
    base = model(wall)
    for cause in wall_causes(("cohesion_lost", "webs_weaker", "rig_turns", "overlap_short")):
        assert model(wall, **{cause.parameter: 0.0}) == pytest.approx(base)
    assert model(wall, webs_weaker_at_1=0.5) == pytest.approx(base)  # of the other campaign
    assert model(wall, webs_weaker_at_0=0.5)[FORCE] < 0.95 * base[FORCE]
    assert model(wall, webs_weaker_at_0=0.5) == model(wall, webs_weaker=0.5)
    assert model(wall, rig_turns=0.5) == pytest.approx(base)  # a cantilever has no rotation to lose
    assert model(wall, stiffness_lost=0.5)[STIFFNESS] == pytest.approx(0.5 * base[STIFFNESS])
    again = WallModel("laws", tmp_path / "store.jsonl")
    size = len(again.memo)
    assert again(wall, webs_weaker=0.5) == model(wall, webs_weaker=0.5)
    assert len(again.memo) == size  # read, not computed
    with pytest.raises(InputError, match="there is no cause 'webs'"):
        wall_causes(("webs",))


def test_hollow_units_alone_have_webs():
    model = WallModel("laws")
    wall = {"specimen": SOLID, "campaign": "A"}
    assert model(wall, webs_weaker=0.5) == model(wall)


def test_force_of_a_wall_that_rocks_goes_with_its_shear_span():
    # nothing but its edges gives way: the moment of a section is N L / 2 (1 - N / (L t fc)), N with the weight above
    for span in (0.5, 0.8):
        test = experiments.load(NAME, "137", mu=5.0, fv0=5.0, tension_share=0.0, cracks="none", shear_span=span)
        length, height, t, fc = (float(test.row[k]) for k in ("L", "H", "t", "fc"))
        weight = DENSITY * GRAVITY * length * height * t
        axial = axial_force(test) + np.array([0.0, weight])
        top, base = axial * length / 2.0 * (1.0 - axial / (1e6 * fc * length * t))
        expected = 1e-3 / height * min(top / (1.0 - span), base / span)
        found = limit_analysis(test.assembly(), test.loads(), check_dead_load=False)
        assert found.collapse_multiplier == pytest.approx(expected, rel=1e-3)


def test_scatter_of_replicates_is_that_of_the_table():
    for quantity in (FORCE, STIFFNESS, CRACK):
        found, freedom = replicate_scatter(quantity)
        assert found == pytest.approx(REPLICATES[quantity], abs=0.006)
        assert freedom >= 6


def test_responses_hold_what_is_printed():
    found = responses()
    assert found["22"][FORCE] == pytest.approx(234.415)
    assert (found["22"][MODE], found["144"][MODE], found["26"][MODE]) == (0.0, 0.0, 1.0)
    assert np.isnan(found["22"][CRACK])
    assert as_specimens(["144"])[0]["filled"] == "not filled"
