"""Collected joint properties and the distributions of the stochastic panels: the numbers agree where they should."""

import math

import pytest

import limitmason as lm
from limitmason.experiments import stochastic_brick_panels
from limitmason.study.linked_formulas import LinkedFormulas
from validation import murano_literature as literature


def test_printed_averages_are_those_of_the_rows_but_for_what_the_caveats_name():
    dry, mortar = literature.summary("dry"), literature.summary("mortar")
    assert (dry["shear stiffness"].rows, mortar["normal stiffness"].rows) == (20, 13)
    close = (
        dry["shear stiffness"], dry["tensile strength"], dry["friction angle"], mortar["shear stiffness"],
        mortar["tensile strength"], mortar["cohesion"],
    )
    for one in close:
        assert one.mean == pytest.approx(one.printed, rel=0.01)
    assert dry["normal stiffness"].mean * 19 / 20 == pytest.approx(224.2, rel=1e-3)  # with the zero that is printed
    assert mortar["friction angle"].mean == pytest.approx(33.4, abs=0.05)
    assert dry["cohesion"].mean > 50 * dry["cohesion"].printed


def test_averages_of_stiffness_are_two_outliers():
    for masonry, times in (("dry", 46), ("mortar", 260)):
        found = literature.summary(masonry)["normal stiffness"]
        rows = [float(row["normal stiffness"]) for row in literature.joints(masonry).values()]
        rest = sorted(rows)[: -1 if masonry == "dry" else -2]
        assert found.mean / found.median > times
        assert sum(rest) / len(rest) < 0.2 * found.mean


def test_ratios_of_the_two_stages_are_those_of_the_final_set():
    wall = lm.experiments.load("murano-u-walls", "REGW").row
    values = {"normal_stiffness": float(wall["kn"]), "tensile_strength": float(wall["ft"])}
    tied = LinkedFormulas(literature.TIES)(values)
    assert tied["shear_stiffness"] == float(wall["ks"])
    assert tied["cohesion"] == pytest.approx(float(wall["c"]), rel=0.02)


def test_mean_set_of_the_stochastic_panels_obeys_its_links_as_the_caveats_say():
    p = stochastic_brick_panels.properties()
    given = {"normal_stiffness": p["normal stiffness"].mean, "tensile_strength": p["tensile strength"].mean,
             "friction_angle_deg": p["friction angle"].mean}
    tied = LinkedFormulas(stochastic_brick_panels.LINKS)(given)
    assert tied["shear_stiffness"] == pytest.approx(5.82, abs=0.005)
    assert tied["cohesion"] == pytest.approx(0.0462, abs=1e-4)
    # first order: CoV of ft tan(phi) from those of ft and phi
    phi = math.radians(30.0)
    of_phi = phi / (math.sin(phi) * math.cos(phi)) * p["friction angle"].variation
    spread = math.hypot(p["tensile strength"].variation, of_phi)
    assert spread == pytest.approx(0.21, abs=0.005)
    assert p["cohesion"].variation == 0.15


def test_sets_hold_what_table_3_crosses():
    sets = {k: set(stochastic_brick_panels.drawn(k)) for k in (1, 2, 3, 4)}
    assert sets[1] == sets[2] | sets[3] | sets[4]
    assert sets[2] == {"young modulus", "poisson ratio"}
    assert sets[3] == {"normal stiffness", "shear stiffness"}
    both = [lm.experiments.load("stochastic-brick-panels", f"set-4-{k}") for k in ("spatial", "non-spatial")]
    spatial, one = (e.published for e in both)
    key = "variation of the ultimate load"
    assert spatial[key] / one[key] == pytest.approx(0.43, abs=0.005)
    with pytest.raises(lm.errors.InputError, match="set must be"):
        stochastic_brick_panels.drawn(5)
    with pytest.raises(lm.errors.InputError, match="masonry must be"):
        literature.summary("brick")
