"""Ties in the DEM: force against elongation, yielding, slack, energy, histories; collapse against closed forms."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walls import on_slab, stack

import dem
import limitmason as lm
from dem import kernels
from dem.model.initial_state import initial_state
from dem.model.state import State
from dem.model.tie_arrays import elongation, stored_energy

STIFFNESS, STRENGTH = 1e6, 400.0


def slider(**changes):
    """A block on the ground, tied to it by a rod that lies level."""
    block = on_slab([((0, 0, 0), (1, 1, 0.5))], mu=0.3)
    options = {"yield_force": STRENGTH, "stiffness": STIFFNESS, **changes}
    return block.with_ties([lm.Tie("block-1", (0, 0.5, 0.0), None, (-0.5, 0.5, 0.0), **options)])


def test_force_against_elongation_yields_hangs_loose_and_pulls_again():
    tied = slider()
    limit = STRENGTH / STIFFNESS
    moves = (0.5 * limit, 3.0 * limit, 2.5 * limit, 0.0, 2.5 * limit)
    # the block may not turn: its end would go another way than its centroid
    stages = [
        dem.Drive(displacement={"block-1": {"x": x, "rx": 0.0, "ry": 0.0, "rz": 0.0}}, steps=400, keep=True)
        for x in np.diff([0.0, *moves])
    ]
    run = dem.simulate(tied, [dem.Settle(), *stages], contact_points=(2, 2), sample=50)
    last = [np.flatnonzero(run["stage"] == k + 1)[-1] for k in range(len(moves))]
    moved = run.displacement_of("block-1")[:, 0]
    moved = moved[last] - moved[np.flatnonzero(run["stage"] == 0)[-1]]
    assert moved == pytest.approx(moves, abs=1e-3 * limit)
    # k u, its strength, half a limit back from it, loose with two limits left, up to where it was
    expected = [0.5 * STRENGTH, STRENGTH, 0.5 * STRENGTH, 0.0, 0.5 * STRENGTH]
    assert run.tie_force[last, 0] == pytest.approx(expected, abs=5e-3 * STRENGTH)
    assert run.state.ties.plastic[0] == pytest.approx(2.0 * limit, rel=1e-2)
    worked = max(np.abs(run["applied"]).max(), np.abs(run["support"]).max())
    assert np.abs(run.energy_error).max() < 0.02 * worked


def test_tie_and_friction_carry_the_load_together():
    tied = slider(yield_force=1e5)
    weight = tied.weights[1]
    loads = lm.Loads.horizontal(tied)
    run = dem.simulate(
        tied, [dem.Settle(), dem.Ramp(to=0.5, steps=4000), dem.Hold(steps=4000)], loads=loads, contact_points=(2, 2)
    )
    forces = run.state.resultants(tied)
    pull, friction = run.tie_force[-1, 0], -forces.shear[0] @ [tied.arrays.tangent_1[0, 0], tied.arrays.tangent_2[0, 0]]
    assert pull + friction == pytest.approx(0.5 * weight, rel=1e-3)
    assert forces.normal[-1] == pytest.approx(pull, rel=1e-12)
    # friction cannot take more than mu W
    assert pull >= 0.2 * weight * (1.0 - 1e-3)


@pytest.mark.parametrize("to", [-1.0, 1.3])
def test_collapse_brackets_the_closed_form_of_an_overturning_wall(to):
    wall = stack([(0.3, 0.5)] * 2, mu=0.9)
    at, force = 0.8, 800.0
    rod = lm.Tie("block-2", (0.0 if to < 0 else 0.3, 0.5, at), None, (to, 0.5, at), yield_force=force)
    tied = wall.with_ties([rod])
    found = dem.collapse(tied, lm.Loads.horizontal(tied), contact_points=(2, 2), error_budget=())
    # the rod on the side it moves towards hangs loose
    exact = 0.3 + (force * at / (0.5 * wall.weights[1:].sum()) if to < 0 else 0.0)
    low, high = found.interval
    assert low * 0.998 <= exact <= high * 1.002
    assert found.certificate.equilibrium_residual < 1e-4
    assert found.certificate.yield_violation < 1e-9
    assert found.resultants.normal[-1] == pytest.approx(force if to < 0 else 0.0, abs=1e-2 * force)
    assert any("ties name no stiffness" in w for w in found.warnings)


def moved_state(tied, seed=0, size=0.3):
    state = initial_state(tied, lm.Loads.weight(tied), contact_points=(2, 2))
    rng = np.random.default_rng(seed)
    for i in np.flatnonzero(~tied.fixed):
        state.bodies.shift[i] = size * rng.normal(size=3)
        turn = Rotation.from_rotvec(size * rng.normal(size=3))
        state.bodies.quat[i] = np.roll(turn.as_quat(), 1)
        state.bodies.rot[i] = turn.as_matrix() - np.eye(3)
    return state


def pair():
    blocks = on_slab([((0, 0, 0), (1, 1, 0.5)), ((2, 0, 0), (3, 1, 0.5))])
    return blocks.with_ties([
        lm.Tie("block-1", (1, 0.3, 0.4), "block-2", (2, 0.9, 0.1), yield_force=1e9, stiffness=STIFFNESS),
        lm.Tie("block-2", (3, 0.5, 0.5), None, (4, 0, 0), yield_force=1e9, stiffness=2.0 * STIFFNESS),
    ])


def test_elongation_is_the_change_of_the_distance_of_both_ends_at_any_rotation():
    tied = pair()
    state = moved_state(tied)
    b = state.bodies

    def at(block, point):
        k = tied.block_index(block)
        return b.shift[k] + tied.centroids[k] + (b.rot[k] + np.eye(3)) @ (point - tied.centroids[k])

    for tie, longer in zip(tied.ties, elongation(state.ties, b), strict=True):
        one = at(tie.block_a, tie.ends[0])
        two = tie.ends[1] if tie.block_b is None else at(tie.block_b, tie.ends[1])
        assert longer == pytest.approx(np.linalg.norm(two - one) - tie.length, abs=1e-12)


def test_forces_of_ties_are_the_slope_of_their_energy():
    tied = pair()
    state = moved_state(tied, seed=3)
    for number in (1, 2):
        state.bodies.contact[:] = 0.0
        kernels.add_tie_forces(state.ties, state.bodies, state.total)
        wrench = state.bodies.contact[number].copy()
        for k in range(3):
            step = 1e-6 * np.eye(3)[k]
            slope = []
            for sign in (1.0, -1.0):
                other = state.copy()
                other.bodies.shift[number] += sign * step
                slope.append(stored_energy(other.ties, other.bodies))
            assert wrench[k] == pytest.approx(-(slope[0] - slope[1]) / 2e-6, rel=1e-5, abs=1.0)
            slope = []
            for sign in (1.0, -1.0):
                other = state.copy()
                turn = Rotation.from_rotvec(sign * step).as_matrix()
                other.bodies.rot[number] = turn @ (state.bodies.rot[number] + np.eye(3)) - np.eye(3)
                slope.append(stored_energy(other.ties, other.bodies))
            assert wrench[3 + k] == pytest.approx(-(slope[0] - slope[1]) / 2e-6, rel=1e-5, abs=1.0)
    # action and reaction: free blocks and ground together feel no force and no moment
    total = state.bodies.contact
    place = state.bodies.shift + tied.centroids
    assert np.abs(total[:, :3].sum(axis=0)).max() < 1e-6 * np.abs(total).max()
    assert np.abs((total[:, 3:] + np.cross(place, total[:, :3])).sum(axis=0)).max() < 1e-6 * np.abs(total).max()


def test_a_state_keeps_its_ties_and_refuses_others(tmp_path):
    tied = slider()
    run = dem.simulate(tied, [dem.Settle(), dem.Drive(displacement={"block-1": {"x": 1e-3}}, steps=200)],
                       contact_points=(2, 2), sample=50)
    run.save(tmp_path / "run.npz")
    back = dem.History.load(tmp_path / "run.npz", tied)
    assert back.tie_force.tolist() == run.tie_force.tolist()
    assert back.state.ties.plastic[0] == run.state.ties.plastic[0] > 0.0
    copy = run.state.copy()
    copy.ties.plastic[:] = 0.0
    assert run.state.ties.plastic[0] > 0.0
    assert isinstance(back.state, State)
    with pytest.raises(ValueError, match="it has 0 ties and had 1"):
        dem.simulate(tied.with_ties(()), dem.Hold(steps=10), start=run)
    stronger = tied.with_ties([dataclasses.replace(tied.ties[0], yield_force=2.0 * STRENGTH)])
    with pytest.raises(ValueError, match="the tie between .* has another strength"):
        dem.simulate(stronger, dem.Hold(steps=10), start=run)


def test_ties_shorten_the_stable_step_of_real_masses():
    loads = lm.Loads.weight(slider())
    soft = initial_state(slider(), loads, contact_points=(2, 2), mode="dynamic")
    stiff = initial_state(slider(stiffness=1e13), loads, contact_points=(2, 2), mode="dynamic")
    assert stiff.dt < 0.5 * soft.dt


def test_a_block_let_go_on_a_stretched_tie_is_not_half_a_step_ahead():
    """Central differences swing at sin(w' dt / 2) = w dt / 2, w^2 = k / m, and begin at rest."""
    tied, pulled = slider(yield_force=1e9), 1e-4
    none = lm.Loads(np.zeros((2, 6)), np.zeros((2, 6)))
    options = dem.JointOptions(dashpot=0.0)
    state = dem.initial_state(tied, none, mode="dynamic", contact_points=(2, 2), joint_options=options)
    # clear of the ground; the line of the tie goes through the centroid
    middle = tied.centroids[1]
    state.ties.arm_a[0] = 0.0
    state.ties.span[0] = (-1.0, 0.0, 0.0)
    state.ties.length[0] = 1.0
    state.ties.arm_b[0] += middle - (1.0, 0.0, 0.0) - (-0.5, 0.5, 0.0)
    state.bodies.shift[1, 0] = pulled
    state.points.gap[:] = 1.0
    h = dem.simulate(tied, dem.Hold(steps=20), start=state, loads=none, mode="dynamic", sample=1, detect_every=None)
    w, dt = np.sqrt(STIFFNESS / tied.arrays.mass[1]), h.state.dt
    angle = 2.0 * np.arcsin(0.5 * w * dt) * np.arange(1, 21)
    assert h.shift[:, 1, 0] == pytest.approx(pulled * np.cos(angle), abs=1e-9 * pulled)
