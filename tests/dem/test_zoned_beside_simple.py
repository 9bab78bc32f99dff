"""Zoned blocks beside the assembled equations of their zones, Ritz blocks condensed to their joints, and simple."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear import solution

import dem
import limitmason as lm
from dem.kernels.zone_arrays import Z_APPLIED, Z_KINETIC, Z_SIZE
from dem.model.state import UnstableError
from dem.zones import running
from dem.zones.assemble_zones import make_model
from dem.zones.zoned_model import contact_matrix, freedoms, stiffness

BRICK = lm.Material(young_modulus=16.7e9, poisson_ratio=0.15, density=2000.0)
MORTAR = lm.Joint(30.0, cohesion=1e5, tensile_strength=5e4, normal_stiffness=8.2e10, shear_stiffness=3.6e10)
STRONG = replace(MORTAR, cohesion=1e9, tensile_strength=1e9)
POINTS = 0.0375
EAST = dem.Drive({"beam": {"x": 1.0}})


def wall(joint, courses=4):
    made = lm.build.wall(
        length=0.45, courses=courses, unit=(0.225, 0.075, 0.1025), joint=joint, density=2000.0, top_beam=0.075,
        beam_density=60_000.0,
    )
    return made.with_material(BRICK, blocks=[b.name for b in made.blocks if b.name != "beam"])


def pushed(model, blocks, to, steps, **options):
    more = {"zone_size": POINTS} if blocks == "zoned" else {}
    return dem.push(
        model, EAST, to=to, blocks=blocks, contact_points=POINTS, steps=steps, rate_check=False, samples=50, **more,
        **options,
    )


@pytest.mark.slow
def test_strong_joints_carry_point_by_point_what_the_assembled_equations_give():
    # stepped zones know no matrix, the equations no time
    model = wall(STRONG)
    loads = lm.Loads.weight(model).with_point_load(model, "beam", (2e3, 0.0, 0.0))
    dead = lm.Loads(loads.dead + loads.live, np.zeros_like(loads.live))
    zones = make_model(model, dead, zone_size=POINTS, contact_points=POINTS)
    reach, free = freedoms(zones), zones.nodes.body < 0
    force = np.concatenate([zones.nodes.load[free].ravel(), zones.rigid.load[~zones.rigid.held]])
    u = reach @ solution(reach.T @ stiffness(zones) @ reach, force)
    opening, slip = (contact_matrix(zones) @ u).reshape(-1, 2).T
    kn, ks = zones.law[zones.contacts.joint][:, :2].T
    assert running.settle(zones, 1e-6)
    now = running.read(zones)
    for found, exact in ((now.normal, -kn * opening), (now.shear, ks * slip)):
        # the shear on block b resists its slip
        sign = np.sign((found * exact).sum())
        assert np.abs(found - sign * exact).max() < 1e-3 * np.abs(exact).max()
    # the wall bends: joints are pulled at one end, so that the sense of the loads is seen
    assert now.normal.min() < -0.1 * now.normal.max()


@pytest.mark.slow
def test_zones_and_elastic_bricks_condensed_to_their_joints_are_equally_stiff():
    # polynomials with tractions that are smooth over a face, and zones with forces at their nodes: 1e-3 where a face
    # is loaded evenly, a per cent of the wall's compliance where it is not
    model = wall(STRONG)
    loads = lm.Loads.weight(model).with_point_load(model, "beam", (1e3, 0.0, 0.0))
    free = lm.pushover(
        model, loads, control=("beam", "x"), to=2e-6, blocks="ritz", contact_model="grid", grid=POINTS,
        contacts="first",
    )
    driven = pushed(model, "zoned", 2e-6, 8000)
    slope = [c.load[-1] / c.displacement[-1] for c in (free, driven)]
    assert slope[1] == pytest.approx(1e3 * slope[0], rel=0.01)


@pytest.mark.slow
def test_ductile_joints_carry_the_same_by_simple_and_by_zoned_bricks():
    # bond never lost: no order of failures to be decided, so that the curves differ by the bricks' shapes alone
    model = wall(MORTAR)
    zoned, simple = (pushed(model, blocks, 4e-4, 12_000) for blocks in ("zoned", "simply deformable"))
    at = np.linspace(2e-5, 4e-4, 20)
    one, two = (np.interp(at, c.displacement, c.load) for c in (zoned, simple))
    assert two == pytest.approx(one, rel=0.05)
    assert simple.peak.load == pytest.approx(zoned.peak.load, rel=0.02)
    # beyond the straight part of the curve: joints have yielded
    assert one[-1] < 0.7 * one[0] * at[-1] / at[0]


def test_a_run_that_explodes_keeps_no_load_of_the_explosion(monkeypatch):
    # masses made too light for the step in the middle of a run: what grows from there is no load of the wall
    light, advance = [], running.advance

    def advance_lighter(model, steps, *more, **options):
        if model.rigid.drive.any():
            light.append(steps)
            if len(light) == 30:
                model.nodes.mass[:] *= 0.75
                model.rigid.mass[:] *= 0.75
        return advance(model, steps, *more, **options)

    whole = pushed(wall(MORTAR), "zoned", 1e-4, 1000)
    monkeypatch.setattr(running, "advance", advance_lighter)
    cut = pushed(wall(MORTAR), "zoned", 1e-4, 1000)
    assert cut.status == "unstable"
    assert any("energy explodes" in w for w in cut.warnings)
    assert 5 < len(cut) < 40
    assert np.abs(cut.load).max() < 2.0 * np.abs(whole.load[: len(cut)]).max()
    assert cut.errors["energy"].max() < 0.1


@pytest.mark.parametrize("kinetic", [np.nan, np.inf])
def test_energy_that_is_no_number_is_an_explosion(monkeypatch, kinetic):
    monkeypatch.setattr(running, "read", lambda model: SimpleNamespace(energy=0.0))
    model = SimpleNamespace(total=np.zeros(Z_SIZE))
    model.total[Z_APPLIED], model.total[Z_KINETIC] = 1.0, 0.5 * running.EXPLODES
    running.refuse_explosion(model)
    model.total[Z_KINETIC] = kinetic
    with pytest.raises(UnstableError, match="energy explodes"):
        running.refuse_explosion(model)
