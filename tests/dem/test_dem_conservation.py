"""The DEM kernel against laws: statics, momentum, energy, order of the time step, exact repetition."""

import numpy as np
import pytest
from walls import on_slab, running_bond, stack

import dem
import limitmason as lm
from dem import kernels
from dem.model.advance import run_constant
from limitmason.geometry import box
from limitmason.mechanics.contact_points import contact_points
from limitmason.mechanics.equilibrium import equilibrium_matrix

UNDAMPED = dem.JointOptions(dashpot=0.0)
STIFF = lm.Joint(40.0, normal_stiffness=1e8, shear_stiffness=6e7)


def slender(joint=STIFF):
    return on_slab([((0, 0, 0), (0.2, 0.3, 0.8))], joint=joint)


def kinetic(bodies, i):
    return 0.5 * bodies.mass[i] * bodies.vel[i] @ bodies.vel[i] + 0.5 * bodies.ang[i] @ bodies.spin[i]


@pytest.mark.parametrize("grid", [(2, 2), (3, 7), (4, 8)])
def test_one_statics_block_wrenches_equal_the_equilibrium_matrix_times_contact_forces(grid):
    wall = running_bond(3, 4, joint=lm.Joint(45.0, normal_stiffness=1e9, shear_stiffness=4e8))
    loads = lm.Loads.weight(wall)
    state = dem.initial_state(wall, loads, contact_points=grid)
    points = contact_points(wall, contact_model="grid", grid=grid)
    random = np.random.default_rng(3)
    normal = random.uniform(1.0, 2.0, points.count)
    shear = random.uniform(-0.5, 0.5, (points.count, 2))
    # at zero displacement N = kn A w_p and T = ks A (plastic slip): any force below the friction limit can be set
    area = state.points.area
    state.points.lift[:] = normal / (1e9 * area)
    state.points.slip_1[:], state.points.slip_2[:] = (shear / (4e8 * area[:, None])).T
    state.joints.law[:, kernels.LAW.lift] = 0.0
    kernels.contact_wrenches(state.points, state.joints, state.bodies)
    expected = equilibrium_matrix(wall, points) @ np.column_stack([normal, shear]).ravel()
    assert np.abs(state.bodies.contact.ravel() - expected).max() < 1e-12 * np.abs(expected).max()


def test_joint_forces_and_moments_cancel_at_any_displacement_and_rotation():
    b = stack([(0.2, 0.2)] * 3, joint=lm.Joint(40.0, normal_stiffness=1e7))
    state = dem.initial_state(b, lm.Loads.weight(b), mode="dynamic")
    random = np.random.default_rng(5)
    for i in range(b.n_blocks):
        q = np.r_[1.0, random.normal(size=3) * 0.05]
        state.bodies.quat[i] = q / np.linalg.norm(q)
        kernels.rotation_of(state.bodies.quat[i], state.bodies.rot[i])
        state.bodies.shift[i] = random.normal(size=3) * 0.01
    kernels.contact_wrenches(state.points, state.joints, state.bodies)
    f = state.bodies.contact
    place = b.centroids + state.bodies.shift
    size = np.abs(f[:, :3]).max()
    assert size > 1.0
    assert np.abs(f[:, :3].sum(axis=0)).max() < 1e-12 * size
    assert np.abs((f[:, 3:] + np.cross(place, f[:, :3])).sum(axis=0)).max() < 1e-12 * size


def test_elastic_forces_and_moments_are_the_gradient_of_the_elastic_energy_at_large_displacement():
    # cohesion and tension so high that nothing yields: the joint is then a spring whatever the displacement
    joint = lm.Joint(45.0, cohesion=1e9, tensile_strength=1e9, normal_stiffness=1e7, shear_stiffness=4e6)
    b = stack([(0.2, 0.2), (0.3, 0.1)], joint=joint)
    state = dem.initial_state(b, lm.Loads.weight(b))
    random = np.random.default_rng(11)

    def turned(q, vector):
        half = np.linalg.norm(vector) / 2.0
        p = np.r_[np.cos(half), np.sinc(half / np.pi) * vector / 2.0]
        return np.r_[p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]

    for i in range(b.n_blocks):
        state.bodies.quat[i] = turned(state.bodies.quat[i], random.normal(size=3) * 0.2)
        kernels.rotation_of(state.bodies.quat[i], state.bodies.rot[i])
        state.bodies.shift[i] = random.normal(size=3) * 0.05
    kernels.contact_wrenches(state.points, state.joints, state.bodies)
    force = state.bodies.contact.copy()

    def energy(block, dof, h):
        moved = state.copy()
        step = np.zeros(6)
        step[dof] = h
        moved.bodies.shift[block] += step[:3]
        moved.bodies.quat[block] = turned(moved.bodies.quat[block], step[3:])
        kernels.rotation_of(moved.bodies.quat[block], moved.bodies.rot[block])
        return moved.measured(b).elastic_energy

    h = 1e-5
    for block in range(b.n_blocks):
        for dof in range(6):
            slope = (energy(block, dof, h) - energy(block, dof, -h)) / (2.0 * h)
            assert -slope == pytest.approx(force[block, dof], abs=1e-6 * np.abs(force).max())


def test_forces_do_not_change_when_the_whole_assembly_is_turned_rigidly():
    b = stack([(0.2, 0.2)] * 2, joint=lm.Joint(40.0, normal_stiffness=1e7))
    loads = lm.Loads.weight(b)
    state = dem.simulate(b, dem.Settle(), loads=loads).state
    kernels.contact_wrenches(state.points, state.joints, state.bodies)
    before = state.bodies.contact.copy()
    q = np.array([np.cos(0.6), *(np.sin(0.6) * np.array([0.48, 0.6, 0.64]))])
    turn = np.empty((3, 3))
    kernels.rotation_of(q, turn)
    turn += np.eye(3)
    for i in range(b.n_blocks):
        assert np.abs(state.bodies.quat[i, 1:]).max() < 1e-9
        now = b.centroids[i] + state.bodies.shift[i]
        state.bodies.shift[i] = turn @ now - b.centroids[i]
        state.bodies.quat[i] = q
        state.bodies.rot[i] = turn - np.eye(3)
    kernels.contact_wrenches(state.points, state.joints, state.bodies)
    size = np.abs(before).max()
    # displacements of 1e-7 m now sit on rotations of 1 rad: rounding of 1e-16 m shows as 1e-9
    assert np.abs(state.bodies.contact[:, :3] - before[:, :3] @ turn.T).max() < 1e-7 * size


@pytest.mark.slow
def test_free_fall_keeps_momentum_and_the_energy_of_a_tumbling_block():
    b = slender()
    loads = lm.Loads.weight(b)
    state = dem.initial_state(b, loads, mode="dynamic", dt=1e-4)
    state.bodies.shift[1] = (0.0, 0.0, 100.0)
    state.bodies.vel[1] = (1.0, -2.0, 0.0)
    state.bodies.ang[1] = (3.0, 2.0, 1.0)
    first = dem.simulate(b, dem.Hold(steps=1), loads=loads, start=state, mode="dynamic").state
    spinning = 0.5 * first.bodies.ang[1] @ first.bodies.spin[1]
    end = dem.simulate(b, dem.Hold(steps=30_000), loads=loads, start=state, mode="dynamic", sample=5000).state
    bodies = end.bodies
    assert bodies.vel[1] == pytest.approx((1.0, -2.0, -9.81 * 3.0), rel=1e-11)
    assert bodies.ang[1] == pytest.approx((3.0, 2.0, 1.0), abs=1e-12)
    assert np.linalg.norm(bodies.quat[1]) == pytest.approx(1.0, abs=1e-14)
    assert 0.5 * bodies.ang[1] @ bodies.spin[1] == pytest.approx(spinning, rel=1e-6)


def test_dashpots_take_nothing_from_free_flight():
    b = slender()
    loads = lm.Loads.weight(b)
    state = dem.initial_state(b, loads, mode="dynamic", joint_options=dem.JointOptions(dashpot=1e-4))
    state.bodies.shift[1] = (0.0, 0.0, 1.0)
    state.bodies.vel[1] = (0.3, 0.0, 2.0)
    steps = int(0.3 / state.dt)
    end = dem.simulate(b, dem.Hold(steps=steps), loads=loads, start=state, mode="dynamic").state
    assert end.bodies.vel[1] == pytest.approx((0.3, 0.0, 2.0 - 9.81 * steps * end.dt), rel=1e-11)
    assert end.total[kernels.E_VISCOUS] == 0.0


def rocking(dt_factor, steps, sample, grid=(2, 2)):
    """Undamped elastic rocking without uplift, started from rest by a push on the settled block."""
    b = slender()
    loads = lm.Loads.weight(b)
    rest = dem.simulate(
        b,
        dem.Settle(damping=dem.Damping(0.8), tolerance=1e-11),
        loads=loads,
        mode="dynamic",
        contact_points=grid,
        joint_options=UNDAMPED,
    ).state
    rest.stop()
    rest.dt *= dt_factor
    rest.total[:] = 0.0
    rest.bodies.ang[1] = (0.0, 0.05, 0.0)
    run = dem.simulate(b, dem.Hold(steps=steps), loads=loads, start=rest, mode="dynamic", sample=sample)
    return b, loads, rest, run


def window_energy(assembly, loads, state, steps=400):
    """Mean of kinetic (half steps averaged to full steps), elastic and potential energy over a window."""
    h = dem.simulate(assembly, dem.Hold(steps=steps), loads=loads, start=state, mode="dynamic", sample=1)
    kin = 0.5 * (h["kinetic"][1:] + h["kinetic"][:-1])
    # kinetic n+1/2 belongs between the positions n and n+1, which is where elastic and potential energy are taken
    height = h.shift[:-1, 1, 2]
    return kin + h["elastic"][:-1] + assembly.weights[1] * height, h


def test_undamped_elastic_rocking_keeps_its_energy_within_a_thousandth_over_30_000_steps():
    b, loads, start, run = rocking(0.5, 30_000, 10_000)
    first, h = window_energy(b, loads, start)
    last, _ = window_energy(b, loads, run.state)
    rest = dem.simulate(b, dem.Settle(damping=dem.Damping(0.8), tolerance=1e-11), loads=loads, mode="dynamic",
                        contact_points=(2, 2), joint_options=UNDAMPED)
    ground = rest["elastic"][-1] + b.weights[1] * rest.shift[-1, 1, 2]
    assert h["largest opening"].max() <= 0.0  # no uplift: the law is linear
    assert run["friction"][-1] == 0.0
    motion = first.mean() - ground
    assert motion > 1e-4
    # the amplitude goes with the root of the energy of motion
    assert abs(np.sqrt((last.mean() - ground) / motion) - 1.0) < 1e-3


def test_halving_the_time_step_quarters_the_error_of_the_position():
    duration, ends = 300, []
    for factor in (1.0, 0.5, 0.25, 0.125):
        *_, run = rocking(factor, int(duration / factor), 10**6)
        ends.append(run.state.bodies.shift[1].copy())
    errors = [np.linalg.norm(e - ends[-1]) for e in ends[:-1]]
    # against the finest solution, with leapfrog started from a velocity half a step off (first order in phase)
    assert errors[0] > errors[1] > errors[2] > 0.0
    assert errors[0] / errors[1] > 1.8


def test_two_runs_agree_bit_for_bit():
    wall = running_bond(3, 4, mu=0.6)
    loads = lm.Loads.horizontal(wall)
    stages = [dem.Settle(max_steps=600), dem.Ramp(to=0.9, steps=1500)]
    one = dem.simulate(wall, stages, loads=loads).state
    two = dem.simulate(wall, stages, loads=loads).state
    assert np.array_equal(one.bodies.shift, two.bodies.shift)
    assert np.array_equal(one.points.lift, two.points.lift)


@pytest.mark.parametrize("mode", ["quasi-static", "dynamic"])
def test_resume_from_a_written_checkpoint_continues_exactly(tmp_path, mode):
    wall = running_bond(2, 3, joint=lm.Joint(30.0, dilatancy_angle_deg=10.0, normal_stiffness=1e9))
    loads = lm.Loads.horizontal(wall)
    ramp = dem.Ramp(to=0.4, steps=700)
    begun = dem.simulate(wall, [dem.Hold(steps=300), ramp], loads=loads, mode=mode)
    whole = dem.simulate(wall, dem.Hold(steps=901), loads=loads, mode=mode, start=begun)
    half = dem.simulate(wall, dem.Hold(steps=400), loads=loads, mode=mode, start=begun)
    half.state.save(tmp_path / "state.npz")
    again = dem.State.load(tmp_path / "state.npz")
    rest = dem.simulate(wall, dem.Hold(steps=501), loads=loads, mode=mode, start=again, factors=half.factors)
    for name in ("shift", "quat", "vel", "ang"):
        assert np.array_equal(getattr(rest.state.bodies, name), getattr(whole.state.bodies, name)), name
    for name in ("slip_1", "slip_2", "lift"):
        assert np.array_equal(getattr(rest.state.points, name), getattr(whole.state.points, name)), name
    assert np.array_equal(rest.state.total, whole.state.total)


def test_energy_is_accounted_when_a_block_slides_to_rest():
    b = on_slab([((0, 0, 0), (0.3, 0.3, 0.1))], joint=lm.Joint(30.0, normal_stiffness=1e8))
    loads = lm.Loads.weight(b)
    rest = dem.simulate(
        b,
        dem.Settle(damping=dem.Damping(0.8), tolerance=1e-10),
        loads=loads,
        mode="dynamic",
        dt=2e-5,
        joint_options=UNDAMPED,
    ).state
    rest.stop()
    rest.total[:] = 0.0
    rest.bodies.vel[1] = (0.2, 0.0, 0.0)
    energy = kinetic(rest.bodies, 1)
    h = dem.simulate(b, dem.Hold(duration=0.06), loads=loads, start=rest, mode="dynamic", sample=50)
    stop = 0.2**2 / (2.0 * 9.81 * np.tan(np.deg2rad(30.0)))
    assert h.state.bodies.shift[1, 0] == pytest.approx(stop, rel=5e-3)
    assert h["friction"][-1] == pytest.approx(energy, rel=5e-3)


def test_stops_at_peaks_of_the_kinetic_energy_take_energy_from_every_mode():
    # a stop that restarts with a whole step's kick starts fast modes from 1 / cos(w dt / 2) times their amplitude
    b = stack([(0.4, 0.2), (0.4, 0.2)], mu=0.6)
    loads = lm.Loads.horizontal(b)
    state = dem.initial_state(b, loads, contact_points=(4, 4))
    force = []
    for _ in range(8):
        run_constant(state, loads.dead + 0.1 * loads.live, 250, dem.Damping(kinetic=True))
        force.append(np.abs(state.bodies.net[~b.fixed]).max())
    assert force[-1] < 1e-3 * b.weights[1]


def in_the_air(**options):
    """A block 1 m above a floor, real masses."""
    a = lm.Assembly.from_polyhedra(
        [box((-1, -1, -0.1), (1, 1, 0)), box((0, 0, 0), (0.3, 0.3, 0.2))], joint=lm.Joint(35.0, normal_stiffness=1e9),
        fixed=[0],
    )
    state = dem.initial_state(a, lm.Loads.weight(a), mode="dynamic", **options)
    state.bodies.shift[1, 2] = 1.0
    return a, state


def test_a_load_that_grows_moves_blocks_to_where_they_are_at_the_time_recorded():
    # from nothing: a t^3 / (6 T); with the load of the end of a step at its beginning it was that of a step later
    a, state = in_the_air()
    loads = lm.Loads(np.zeros((2, 6)), np.array([np.zeros(6), [a.weights[1], 0, 0, 0, 0, 0]]))
    h = dem.simulate(a, dem.Ramp(1.0, duration=0.05), loads=loads, start=state, sample=1)
    late = h["time"] > 20 * state.dt
    assert h.shift[late, 1, 0] == pytest.approx(9.81 * h["time"][late] ** 3 / 0.3, rel=5e-3)
    assert h["multiplier"] == pytest.approx(h["time"] / 0.05, rel=1e-9)


def test_a_stage_lasts_as_long_as_it_says_at_any_step():
    # ramps are not rounded up to whole steps: 10.4 of them drove a block by 0.106 for 0.1 m
    for dt in (None, 7e-5):
        a, state = in_the_air(dt=dt)
        for duration in (2.35 * state.dt, 10.4 * state.dt, 0.003):
            drive = dem.Drive({0: {"x": 0.1}}, duration=duration)
            h = dem.simulate(a, [drive, dem.Hold(duration=duration)], start=state, sample=1)
            assert h["time"][-1] == pytest.approx(2.0 * duration, rel=1e-9)
            assert h.shift[-1, 0, 0] == pytest.approx(0.1, rel=1e-9)
            assert h.state.dt == state.dt
