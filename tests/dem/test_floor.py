"""Blocks that fall in a dynamic run: none sinks below the supports, and what lies there goes with the ground."""

import numpy as np
import pytest

import dem
import limitmason as lm
from dem.stages.debris_floor import Floor
from limitmason.geometry import box

JOINT = lm.Joint(33.0, normal_stiffness=2e8, shear_stiffness=1e8)
TIME = np.arange(0.0, 1.005, 0.01)
SINE = dem.BaseMotion(0.6 * 9.81 * np.sin(2 * np.pi * TIME), 0.01)
STAGES = [SINE, dem.BaseMotion(-0.3 * 9.81 * np.sin(2 * np.pi * TIME), 0.01), SINE]


@pytest.fixture(scope="module")
def three():
    return lm.build.column(width=0.4, depth=0.4, height=1.5, courses=3, joint=JOINT)


@pytest.fixture(scope="module")
def shaken(three):
    return dem.simulate(three, STAGES, mode="dynamic", sample=0.02)


def lowest(history, sample):
    """Lowest corner of every block over the lowest one of the ground [m]."""
    z = np.array([c[:, 2].min() for c in history.corners(sample)])
    return z - z[history.assembly.fixed].min()


@pytest.mark.slow
def test_no_block_sinks_below_the_ground_and_what_fell_goes_with_it(shaken):
    n, held = len(shaken["time"]), shaken.assembly.fixed
    assert min(lowest(shaken, k).min() for k in range(n)) >= 0.0
    floor = Floor(shaken.assembly, shaken.state.dead)
    down = floor.landed(shaken.state).tolist()
    assert down
    assert shaken.quantities["overturned"] == 1.0
    ground = shaken.shift[:, held].mean(axis=1)
    for k in down:
        assert any(f"{shaken.assembly.blocks[k].name!r} fell to the floor" in w for w in shaken.warnings)
        lies = [s for s in range(n) if lowest(shaken, s)[k] <= floor.margin * (1 + 1e-9)]
        assert lies == list(range(lies[0], n))
        assert np.ptp(ground[lies[0] :, 0]) > 0.01, "the ground moves on"
        beside = (shaken.shift[:, k] - ground)[lies[0] :]
        assert np.abs(beside - beside[-1]).max() < 1e-12
    assert np.abs(shaken.energy_error).max() < 0.01 * (np.abs(shaken["applied"]) + np.abs(shaken["support"])).max()


def test_an_impact_on_the_floor_loses_the_energy_of_motion(three):
    state = dem.initial_state(three, lm.Loads.weight(three), mode="dynamic")
    floor, held, k = Floor(three, lm.Loads.weight(three).dead), state.bodies.held.copy(), 3
    mass, inertia = state.bodies.mass[k], 1.0 / np.diag(state.bodies.inv_inertia[k])
    state.bodies.shift[k, 2] = -1.5
    state.bodies.vel[k], state.bodies.ang[k] = (1.0, 0.0, -5.0), inertia * (0.0, 2.0, 0.0)
    assert floor.hold_landed(state, held).tolist() == [k]
    assert state.total[dem.kernels.E_DAMPING] == pytest.approx(0.5 * (mass * 26.0 + inertia[1] * 4.0), rel=1e-12)
    assert held[k].all()
    assert state.energy_of_motion() == 0.0
    assert not len(floor.hold_landed(state, held)), "it lies there already"


@pytest.mark.slow
def test_a_run_cut_after_the_impact_goes_on_to_the_same_bits(three, shaken):
    begun = float(shaken["time"][next(k for k in range(len(shaken["time"])) if shaken["damping"][k] > 1.0)])
    cut = dem.simulate(three, STAGES, mode="dynamic", sample=0.02, progress=lambda row: row["time"] > begun + 0.05)
    assert cut.status == "interrupted"
    whole = dem.resume(cut, STAGES)
    assert np.array_equal(whole.shift, shaken.shift)
    assert np.array_equal(whole["damping"], shaken["damping"])


@pytest.mark.exact
def test_where_blocks_reach_as_low_as_the_supports_the_floor_is_not_known():
    base = [(0, 0), (1, 0), (1, 1), (0, 1)]
    on, under = [(0, 1), (1, 1), (1, 2), (0, 2)], [(0, -1), (1, -1), (1, 0), (0, 0)]
    beside = [(1, 0), (2, 0), (2, 1), (1, 1)]
    for stones, level in (((base, on), 0.0), ((base, under), -1.0 - 6.0**0.5), ((base, beside), -(6.0**0.5))):
        made = lm.Assembly.from_polygons(stones, thickness=1.0, joint=JOINT, fixed=[0])
        floor = Floor(made, lm.Loads.weight(made).dead)
        assert floor.level - floor.margin == pytest.approx(level, abs=1e-12)
        state = dem.initial_state(made, lm.Loads.weight(made), mode="dynamic")
        assert not len(floor.landed(state))
        state.bodies.shift[1, 2] = -1.01 if stones[1] is on else -2.5
        assert floor.landed(state).tolist() == [1]


def test_what_a_history_plots_is_seen_from_the_ground(three):
    ground = dem.BaseMotion(0.05 * 9.81 * np.sin(2 * np.pi * TIME), 0.01)
    run = dem.simulate(three, ground, mode="dynamic", sample=0.1)
    drawn = run.diagram()
    assert np.ptp(run.displacement_of(0)[:, 0]) > 0.05, "the ground moves by 78 mm"
    assert "column" in drawn["ylabel"]
    assert np.abs(drawn["history"]["x"]).max() < 5.0, "the column goes with it [mm]"


def test_the_floor_is_where_the_loads_pull_whichever_axis_that_is():
    """A block slides off a table and falls past its foot: the same in axes in which it falls along any other.

    With the floor along z it was laid down in the middle of a table whose length was along z.
    """

    def run(turn):
        solids = [box((0, -0.2, -0.3), (0.5, 0.2, 0)), box((0.04, -0.1, 0), (0.24, 0.1, 0.1))]
        joint = lm.Joint.from_friction_coefficient(0.3, normal_stiffness=1e8, shear_stiffness=1e8)
        made = lm.Assembly.from_polyhedra([(x @ turn.T, f) for x, f in solids], joint=joint, fixed=[0])
        dead = np.zeros((2, 6))
        dead[:, :3] = made.weights[:, None] * (turn @ [0.0, 0.0, -1.0])
        push = np.zeros((60, 3))
        push[1:12] = 12.0 * turn[:, 0]
        ground = dem.BaseMotion(push, 0.01, after="coast")
        history = dem.simulate(made, ground, loads=lm.Loads(dead, 0 * dead), mode="dynamic", sample=0.02)
        return history, (history.shift[:, 1] - history.shift[:, 0]) @ turn

    first, way = run(np.eye(3))
    assert any("fell to the floor" in w for w in first.warnings)
    for turn in (np.roll(np.eye(3), 1, axis=0), np.roll(np.eye(3), 2, axis=0), np.diag([1.0, -1.0, -1.0])):
        other, same = run(turn)
        assert any("fell to the floor" in w for w in other.warnings)
        assert np.abs(same - way).max() < 1e-6


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_without_weight_there_is_no_floor_and_flight_goes_on(axis, sense):
    made = lm.Assembly.from_polyhedra(
        [box((0, 0, -0.1), (1, 1, 0)), box((0.4, 0.4, 0), (0.6, 0.6, 0.2))],
        joint=lm.Joint(30.0, normal_stiffness=1e8, shear_stiffness=1e8), fixed=[0],
    )
    none = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
    state = dem.initial_state(made, none, mode="dynamic")
    away = np.array([3.0, 3.0, 3.0])
    away[axis] += 2.0 * sense
    state.bodies.shift[1], state.bodies.vel[1, axis] = away, 10.0 * sense
    history = dem.simulate(made, dem.Hold(duration=1.0), loads=none, start=state)
    away[axis] += 10.0 * sense
    assert history.shift[-1, 1] == pytest.approx(away, rel=1e-9, abs=1e-9)
    assert not any("floor" in w for w in history.warnings)
