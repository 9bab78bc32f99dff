"""What the page of the U walls reads off a curve."""

import sys
from pathlib import Path

import numpy as np
import pytest
from u_wall_solids import cost, readings
from u_wall_solids import light_damage as prints
from u_walls import light_damage, where_secant_is

import limitmason as lm
from limitmason import experiments
from limitmason.continuum.uniaxial_curves import curves_of, envelope
from limitmason.experiments.murano_u_walls import NAME
from validation import murano_macro as macro

PAGE = Path(__file__).parents[2] / "docs" / "papers" / "u-walls.md"


def test_light_damage_and_the_load_at_a_secant_of_a_bilinear_curve():
    # 40 kN/mm to 10 kN, then 20 kN/mm: secant 0.98 x 40 at u = 5 / (0.98 x 40 - 20) mm
    u = np.concatenate([[0.0], np.linspace(0.05, 1.0, 96)])
    load = np.where(u <= 0.25, 40 * u, 10 + 20 * (u - 0.25))
    curve = lm.Curve(1e-3 * u, 1e3 * load)
    at = 5 / (0.98 * 40 - 20)
    assert light_damage(curve) == pytest.approx((0.98 * 40 * at, at), rel=1e-9)
    # initial stiffness over 0.5 mm, 30 kN/mm: 29.4 at u = 5 / (29.4 - 20) mm
    later = 5 / (0.98 * 30 - 20)
    assert light_damage(curve, over=5e-4) == pytest.approx((0.98 * 30 * later, later), rel=1e-9)
    assert np.isnan(light_damage(curve, over=1e-3)).all()
    assert where_secant_is(curve, 50.0) == "above the elastic one"
    assert where_secant_is(curve, 20.0) == "not reached"
    assert where_secant_is(curve, 30.0) == "15.00 kN, 0.50 mm"


def reading(start):
    return next(r for r in readings.READINGS if r.name.startswith(start))


def test_pressure_over_the_whole_width_has_its_resultant_its_moment_and_its_share_at_the_ends():
    model = readings.changed(reading("pressure over the whole width"))
    nodes, load = model.mesh.nodes, model.live
    assert load.sum(axis=0) == pytest.approx([0.0, -1000.0, 0.0], abs=1e-9)
    assert float(nodes[:, 2] @ load[:, 1]) == pytest.approx(-1000.0 * 1.35 / 2, rel=1e-9)
    assert float(nodes[:, 0] @ load[:, 1]) == pytest.approx(-1000.0 * 2.25 / 2, rel=1e-9)
    outer = np.isclose(nodes[:, 1], 0.0)
    assert load[outer, 1].sum() == pytest.approx(-1000.0 * 0.6 / 2.25, rel=1e-9)


def test_a_crack_across_the_layer_that_alone_cracks_costs_the_fracture_energy():
    model = readings.changed(reading("one crack"))
    elastic, weak = model.materials
    assert not elastic.fractures
    assert weak.fractures
    layer = model.mesh.material == 1
    assert np.ptp(model.mesh.corners[layer], axis=1)[:, 1] == pytest.approx(readings.LAYER)
    width = np.cbrt(model.discretisation.volume.sum(axis=1)[layer])
    curves = curves_of([weak], np.zeros(len(width), dtype=int), width)
    _, _, area = envelope(curves, np.full((len(width), 3), 1.0))
    assert area[:, 0] * readings.LAYER == pytest.approx(12.0, rel=1e-6)
    assert model.live.sum(axis=0) == pytest.approx([0.0, -1000.0, 0.0], abs=1e-9)
    assert model.dead.sum(axis=0) == pytest.approx([0.0, 0.0, -2e4], abs=1e-6)


def test_printed_light_damage_is_the_end_of_a_chord_less_two_per_cent():
    for wall in ("DS", "REGW"):
        test = experiments.load(NAME, wall)
        shown = [
            [float(test.measured[k]) for k in (
                "initial stiffness", "light-damage load", "light-damage displacement")],
            *([float(macro.published(wall, s)[k]) for k in ("stiffness", "light_load", "light_displacement")]
              for s in ("final", "micro")),
        ]
        for k, (stiffness, load, to) in enumerate(shown):
            if (wall, k) != ("DS", 1):  # the one pair that does not fit
                assert 0.98 * stiffness * to == pytest.approx(load, abs=0.0101)


def test_a_chord_ends_on_the_curve():
    curve = lm.Curve(np.array([0.0, 2e-4, 1e-3]), np.array([0.0, 8e3, 1.6e4]))  # 40, then 10 kN/mm
    cells = prints.chord(curve, 30.0, 9.0, 0.4)  # 10 kN at 0.4 mm: 25 kN/mm
    assert [float(c) for c in cells] == [0.4, 30.0, 25.0, 0.83, 9.0, 9.8, 1.09]


def test_growth_is_the_exponent_of_each_part_between_the_two_largest_meshes(monkeypatch):
    # size, bricks, unknowns, law, stiffness, factor, solution, memory, modes, sparse factor
    def row(n):
        return [0.1, n, 15 * n, 1e-4 * n, 2e-4 * n, 1e-7 * n**2, 3e-5 * n, 1e-2 * n**1.3, np.nan, np.nan]

    monkeypatch.setattr(cost, "read", lambda: [[0.3, 10, 100, 9, 9, 9, 9, 9, 9, 9], row(1000), row(16000)])
    assert cost.growth() == pytest.approx({"factor": 2.0, "rest": 1.0, "memory": 1.3})
    assert "not run" in cost.table()[-1]
    assert cost.table()[2].split(" | ")[-1] == "1.0 |"


def test_page_says_what_is_stored_of_costs_and_of_the_peak_in_two_sorts_of_steps():
    assert "\n".join(cost.section()).strip() in PAGE.read_text(encoding="utf-8")
    assert 0.01 < cost.steps()["apart"] < 0.02  # the page's words: 1 to 2 %


def test_memory_is_in_megabytes_whatever_the_system_counts_in(monkeypatch):
    resource = pytest.importorskip("resource")
    used = type("Usage", (), {"ru_maxrss": 3e8})
    monkeypatch.setattr(resource, "getrusage", lambda who: used)
    for system, megabytes in (("linux", 3e5), ("darwin", 3e2)):
        monkeypatch.setattr(sys, "platform", system)
        assert cost._memory() == megabytes
