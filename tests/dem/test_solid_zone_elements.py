"""Zones in space against closed forms of elasticity: patch test, bending, volumes, waves, and turning as a whole."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from solid_bodies import SolidBody, grid

import limitmason as lm
from dem.zones.element import FACES

E = 10e9
STRAIN = np.array([[1.0, 0.35, -0.2], [0.35, -0.6, 0.5], [-0.2, 0.5, 0.3]])
TURN = Rotation.from_rotvec(np.deg2rad(30.0) * np.array([2.0, -1.0, 2.0]) / 3.0).as_matrix()


def material(poisson=0.2):
    return lm.Material(young_modulus=E, poisson_ratio=poisson, density=2000.0)


def distorted(seed=1):
    """A box of 1.2 x 0.9 x 0.7 m in skewed zones with warped faces; the outer faces stay plane."""
    sides = (1.2, 0.9, 0.7)
    place, cells = grid(*(np.linspace(0.0, side, n + 1) for side, n in zip(sides, (3, 3, 2), strict=True)))
    inner = (place > 0.0) & (place < sides)
    place += np.random.default_rng(seed).uniform(-0.06, 0.06, place.shape) * inner
    return place, cells, inner.all(axis=1)


def stress_of(strain, poisson):
    lam, mu = E * poisson / (1 + poisson) / (1 - 2 * poisson), E / 2 / (1 + poisson)
    return lam * np.trace(strain) * np.eye(3) + 2 * mu * strain


@pytest.mark.parametrize("poisson", [0.0, 0.2, 0.49])
def test_patch_of_skewed_zones_under_constant_strain_is_in_equilibrium_and_has_hookes_stress(poisson):
    place, cells, inside = distorted()
    body = SolidBody(place, cells, material(poisson))
    body.nodes.shift[:] = place @ (1e-9 * STRAIN)  # small: stresses are exact up to squares of the strain
    force = body.forces()
    assert inside.sum() == 4
    assert np.abs(force[inside]).max() < 1e-12 * np.abs(force).max()
    exact = stress_of(1e-9 * STRAIN, poisson)
    assert np.abs(body.stresses()[0] - exact).max() < 1e-7 * np.abs(exact).max()


@pytest.mark.parametrize("poisson", [0.2, 0.49])
def test_assembled_forces_of_a_constant_stress_are_its_boundary_tractions(poisson):
    place, cells, _ = distorted()
    body = SolidBody(place, cells, material(poisson))
    force = -(body.stiffness @ (place @ STRAIN).ravel()).reshape(-1, 3)
    stress, exact = stress_of(STRAIN, poisson), np.zeros_like(force)
    sides = place.max(axis=0)
    for cell in cells:
        for face in FACES:
            x = place[cell[face]]
            for axis in range(3):
                for plane, sign in ((0.0, -1.0), (sides[axis], 1.0)):
                    if (np.abs(x[:, axis] - plane) < 1e-12).all():
                        # area of a plane quadrilateral, shared by its bilinear functions: exact with 2 x 2 points
                        flat, corner = np.delete(x, axis, axis=1), np.array([[-1, -1], [1, -1], [1, 1], [-1, 1.0]])
                        for at in corner / np.sqrt(3.0):
                            factor = 1.0 + at * corner
                            slope = 0.25 * corner * factor[:, ::-1]
                            area = abs(np.linalg.det(slope.T @ flat))
                            traction = sign * area * stress[axis]
                            exact[cell[face]] -= np.outer(0.25 * factor.prod(axis=1), traction)
    assert np.abs(force - exact).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize("poisson", [0.2, 0.499])
@pytest.mark.parametrize("across", [1, 2])
def test_cantilever_bends_and_shears_as_timoshenkos_with_one_zone_in_its_depth(across, poisson):
    # eight times as long as deep, pulled along y or z: without incompatible modes one zone is 50 to 100 % too stiff
    length, depth, force, n = 0.8, 0.1, 1e3, 8
    place, cells = grid(np.linspace(0, length, n + 1), np.array([0, depth]), np.array([0, depth]))
    held = np.zeros(place.shape, bool)
    root, tip = (np.flatnonzero(place[:, 0] == x) for x in (0.0, length))
    # plane sections at the root, free to grow thicker; the reaction enters there as the force does at the tip
    held[root, 0] = held[root[0], 1:] = held[root[1], 2] = True
    body = SolidBody(place, cells, material(poisson), held)
    body.nodes.load[tip, across], body.nodes.load[root, across] = -force / 4, force / 4
    shear, factor = E / 2 / (1 + poisson), 10 * (1 + poisson) / (12 + 11 * poisson)  # Cowper 1966, rectangle
    exact = force * (length**3 / (3 * E * depth**4 / 12) + length / (factor * shear * depth**2))
    u = body.solved()
    assert u[root, across].mean() - u[tip, across].mean() == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 1, 0)])
def test_pure_bending_of_a_brick_is_exact_in_one_zone_about_any_axis(axes):
    size, nu, kappa = np.array([0.225, 0.1, 0.075]), 0.2, 1e-3
    place, cells = grid(*(np.array([-s / 2, s / 2]) for s in size))
    body = SolidBody(place, cells, material(nu))
    i, j, k = axes  # along the beam, about, across
    x, y, z = place[:, i], place[:, j], place[:, k]
    u = np.zeros_like(place)
    u[:, i], u[:, j] = kappa * x * z, -nu * kappa * y * z
    u[:, k] = -kappa * (x**2 + nu * (z**2 - y**2)) / 2
    energy = 0.5 * u.ravel() @ body.stiffness @ u.ravel()
    exact = 0.5 * E * size[j] * size[k] ** 3 / 12 * kappa**2 * size[i]
    assert energy == pytest.approx(exact, rel=1e-12)


def test_one_volume_alone_is_stiff_as_poissons_ratio_goes_to_a_half():
    # no locking: of the 18 deformations of a skewed zone only the one that changes its volume grows as 1 / (1 - 2 nu)
    place, cells, _ = distorted()
    values = {}
    for poisson in (0.49, 0.49999):
        body = SolidBody(place[cells[0]], np.arange(8)[None], material(poisson))
        values[poisson] = np.sort(np.linalg.eigvalsh(body.tables.stiffness[0]))[6:]
    growth = values[0.49999] / values[0.49]
    assert growth[-1] > 500.0  # 1 / (1 - 2 nu) grows 1000 times
    assert growth[:-1].max() < 2.0
    assert values[0.49].min() > 0.0


def test_stressed_zones_turned_by_thirty_degrees_feel_nothing():
    place, cells, _ = distorted()
    turned, straight = (SolidBody(place, cells, material()) for _ in range(2))
    straight.nodes.shift[:] = 1e-3 * np.random.default_rng(3).standard_normal(place.shape)
    turned.nodes.shift[:] = (place + straight.nodes.shift) @ TURN.T - place + [3.0, -7.0, 2.0]
    f0, f1 = straight.forces(), turned.forces()
    assert np.abs(f1 - f0 @ TURN.T).max() < 1e-11 * np.abs(f0).max()
    (s0, e0), (s1, e1) = straight.stresses(), turned.stresses()
    assert e1 == pytest.approx(e0, rel=1e-12)
    assert np.abs(s1 - TURN @ s0 @ TURN.T).max() < 1e-11 * np.abs(s0).max()


@pytest.mark.parametrize("angle", [1e-7, 0.3, 2.9])
def test_a_body_turned_without_strain_has_no_stress(angle):
    place, cells, _ = distorted()
    body = SolidBody(place, cells, material())
    turn = Rotation.from_rotvec(angle * np.array([2.0, -1.0, 2.0]) / 3.0).as_matrix()
    body.nodes.shift[:] = place @ turn.T - place
    assert np.abs(body.stresses()[0]).max() < 1e-13 * E


def test_a_soft_brick_that_spins_and_flies_keeps_energy_and_momentum():
    place, cells = grid(np.linspace(0, 0.4, 4), np.array([0, 0.2]), np.array([0, 0.1]))
    body = SolidBody(place, cells, lm.Material(young_modulus=1e7, poisson_ratio=0.3, density=2000.0), density=2000.0)
    body.nodes.velocity[:] = np.cross([8.0, -5.0, 12.0], place - place.mean(axis=0)) + [1.0, 0.0, 0.0]
    mass = body.nodes.mass[:, None]

    def kept():
        v, x = body.nodes.velocity, place + body.nodes.shift
        spin = np.cross(x - (mass * x).sum(axis=0) / mass.sum(), mass * v).sum(axis=0)
        elastic = body.stresses()[1]
        return elastic + 0.5 * (mass * v * v).sum(), (mass * v).sum(axis=0), spin, elastic

    energy, push, spin, _ = kept()
    body.run(int(1.0 / body.dt), local=0.0)  # two and a half turns
    after = kept()
    assert after[3] > 1e-4 * energy  # it is stretched by its spin
    assert after[0] == pytest.approx(energy, rel=3e-4)  # of the order of its strain
    assert np.abs(after[1] - push).max() < 1e-11 * np.abs(push).max()
    assert np.linalg.norm(after[2] - spin) < 3e-5 * np.linalg.norm(spin)


def test_pressure_wave_travels_at_its_speed_with_true_mass():
    # a bar held across, struck at its end: the front arrives at the middle at L / 2c; sqrt(M / rho), M constrained
    length, n, poisson, density = 2.0, 400, 0.3, 2000.0
    side = np.array([0.0, length / n])
    place, cells = grid(np.linspace(0, length, n + 1), side, side)
    held = np.zeros(place.shape, bool)
    held[:, 1:] = True
    body = SolidBody(place, cells, material(poisson), held, density=density)
    speed = np.sqrt(E * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson) / density)
    body.nodes.load[place[:, 0] == 0.0, 0] = 5e3
    middle, steps = np.flatnonzero(place[:, 0] == length / 2), 0
    behind = 2e4 / ((length / n) ** 2 * density * speed)  # particle velocity p / (rho c)
    while body.nodes.velocity[middle, 0].mean() < 0.5 * behind:
        body.run(1, local=0.0)
        steps += 1
    assert length / 2 / (steps * body.dt) == pytest.approx(speed, rel=0.01)


def test_explicit_rest_state_is_the_static_solution_and_energies_balance():
    place, cells = grid(np.linspace(0, 0.4, 5), np.linspace(0, 0.1, 2), np.linspace(0, 0.1, 2))
    held = np.zeros(place.shape, bool)
    held[place[:, 0] == 0.0] = True
    body = SolidBody(place, cells, material(), held)
    body.nodes.load[:, 1:] = 0.004, -0.01  # small: no change of geometry
    body.run(6000)
    exact = body.solved()
    assert np.abs(body.nodes.shift - exact).max() < 1e-6 * np.abs(exact).max()
    _, energy = body.stresses()
    applied, damping, kinetic = body.total[[0, 5, 6]]
    assert applied == pytest.approx(energy + damping + kinetic, rel=1e-9)
    assert damping > 0.0
