"""Zones against closed forms of elasticity: patch test, bending, volumes, waves, and turning as a whole."""

import numpy as np
import pytest
from zone_bodies import ZoneBody, grid

import limitmason as lm
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS

E = 10e9


def material(poisson=0.2):
    return lm.Material(young_modulus=E, poisson_ratio=poisson, density=2000.0)


def distorted(n=4, m=3, seed=1):
    """A rectangle of 2.0 x 1.1 m in skewed zones."""
    place, cells = grid(np.linspace(0.0, 2.0, n + 1), np.linspace(0.0, 1.1, m + 1))
    inside = (place[:, 0] > 0) & (place[:, 0] < 2.0) & (place[:, 1] > 0) & (place[:, 1] < 1.1)
    place[inside] += np.random.default_rng(seed).uniform(-0.1, 0.1, (inside.sum(), 2))
    return place, cells, inside


@pytest.mark.parametrize("plane", [PLANE_STRESS, PLANE_STRAIN])
@pytest.mark.parametrize("poisson", [0.0, 0.2, 0.49])
def test_patch_of_skewed_zones_under_constant_strain_is_in_equilibrium_and_has_hookes_stress(plane, poisson):
    place, cells, inside = distorted()
    body = ZoneBody(place, cells, material(poisson), plane=plane)
    strain = 1e-9 * np.array([[1.0, 0.35], [0.35, -0.6]])  # small: stresses are exact up to squares of the strain
    body.nodes.shift[:] = place @ strain
    force = body.forces()
    assert np.abs(force[inside]).max() < 1e-12 * np.abs(force).max()
    lam = E * poisson / (1 + poisson) / (1 - 2 * poisson)
    mu = E / 2 / (1 + poisson)
    bulk = 2 * lam * mu / (lam + 2 * mu) if plane == PLANE_STRESS else lam
    trace = strain[0, 0] + strain[1, 1]
    exact = [bulk * trace + 2 * mu * strain[0, 0], bulk * trace + 2 * mu * strain[1, 1], 2 * mu * strain[0, 1],
             0.0 if plane == PLANE_STRESS else lam * trace]
    stress, _ = body.stresses()
    assert np.abs(stress - exact).max() < 1e-7 * np.abs(exact).max()


def test_assembled_forces_of_a_constant_stress_are_its_boundary_tractions():
    place, cells, _ = distorted()
    body = ZoneBody(place, cells, material(), thickness=0.3)
    strain = 1e-3 * np.array([[1.0, 0.35], [0.35, -0.6]])
    force = -(body.stiffness @ (place @ strain).ravel()).reshape(-1, 2)
    mu, bulk = E / 2.4, E * 0.2 / (1 - 0.04)
    stress = bulk * np.trace(strain) * np.eye(2) + 2 * mu * strain
    exact = np.zeros_like(force)
    for side, normal in (((place[:, 1] == 0), (0, -1)), ((place[:, 0] == 2.0), (1, 0)), ((place[:, 1] == 1.1), (0, 1)),
                         ((place[:, 0] == 0), (-1, 0))):
        own = np.flatnonzero(side)
        run = place[own] @ np.abs([normal[1], normal[0]])
        own, run = own[np.argsort(run)], np.sort(run)
        for k in range(len(own) - 1):
            exact[own[k : k + 2]] -= 0.5 * 0.3 * (run[k + 1] - run[k]) * stress @ normal
    assert np.abs(force - exact).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize("deep", [1, 2, 4])
@pytest.mark.parametrize("plane, poisson", [(PLANE_STRESS, 0.2), (PLANE_STRAIN, 0.499)])
def test_cantilever_bends_and_shears_as_timoshenkos_with_one_zone_in_its_depth(deep, plane, poisson):
    # eight times as long as deep; two constant-strain triangles in the depth lose 43 % of this
    length, depth, force = 0.8, 0.1, 1e3
    place, cells = grid(np.linspace(0, length, 8 * deep + 1), np.linspace(0, depth, deep + 1))
    held = np.zeros(place.shape, bool)
    root, tip = (np.flatnonzero(place[:, 0] == x) for x in (0.0, length))
    # plane sections at the root, free to grow thicker; the reaction enters there as the force does at the tip
    held[root, 0] = held[root[0], 1] = True
    body = ZoneBody(place, cells, material(poisson), held, plane)
    share = np.where((tip == tip[0]) | (tip == tip[-1]), 0.5, 1.0) / deep
    body.nodes.load[tip, 1], body.nodes.load[root, 1] = -force * share, force * share
    stiff = E if plane == PLANE_STRESS else E / (1 - poisson**2)
    shear = E / 2 / (1 + poisson)
    exact = force * (length**3 / (3 * stiff * depth**3 / 12) + length / (5 / 6 * shear * depth))
    u = body.solved()
    assert u[root, 1].mean() - u[tip, 1].mean() == pytest.approx(exact, rel=0.01)


def test_pure_bending_of_a_rectangle_is_exact_in_one_zone():
    place, cells = grid(np.array([0.0, 0.225]), np.array([0.0, 0.075]))
    body = ZoneBody(place, cells, material(), thickness=0.1)
    # u = x z kappa, w = -kappa x^2 / 2 - nu kappa z^2 / 2 from the middle: pure bending
    x, z = place[:, 0] - 0.1125, place[:, 1] - 0.0375
    kappa = 1e-3
    u = np.column_stack([kappa * x * z, -kappa * x**2 / 2 - 0.2 * kappa * z**2 / 2])
    energy = 0.5 * u.ravel() @ body.stiffness @ u.ravel()
    assert energy == pytest.approx(0.5 * E * 0.1 * 0.075**3 / 12 * kappa**2 * 0.225, rel=1e-12)


def test_a_stressed_zone_turned_by_thirty_degrees_feels_nothing():
    place, cells, _ = distorted()
    turned, straight = (ZoneBody(place, cells, material(), plane=PLANE_STRAIN) for _ in range(2))
    rng = np.random.default_rng(3)
    straight.nodes.shift[:] = 1e-3 * rng.standard_normal(place.shape)
    angle = np.deg2rad(30.0)
    r = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned.nodes.shift[:] = (place + straight.nodes.shift) @ r.T - place + [3.0, -7.0]
    f0, f1 = straight.forces(), turned.forces()
    assert np.abs(f1 - f0 @ r.T).max() < 1e-11 * np.abs(f0).max()
    s0, e0 = straight.stresses()
    s1, e1 = turned.stresses()
    assert e1 == pytest.approx(e0, rel=1e-12)
    tensor = np.array([[s0[..., 0], s0[..., 2]], [s0[..., 2], s0[..., 1]]])
    seen = np.einsum("ia,abzg,jb->ijzg", r, tensor, r)
    assert np.abs(s1[..., 0] - seen[0, 0]).max() < 1e-11 * np.abs(s0).max()
    assert np.abs(s1[..., 2] - seen[0, 1]).max() < 1e-11 * np.abs(s0).max()


def test_a_body_turned_without_strain_has_no_stress():
    place, cells, _ = distorted()
    body = ZoneBody(place, cells, material())
    angle = 2.5
    r = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    body.nodes.shift[:] = place @ r.T - place
    assert np.abs(body.stresses()[0]).max() < 1e-13 * E


@pytest.mark.parametrize("plane", [PLANE_STRESS, PLANE_STRAIN])
def test_pressure_wave_travels_at_its_speed_with_true_mass(plane):
    # a bar held across, struck at its end: the front arrives at the middle at L / 2c; sqrt(M / rho), M constrained
    length, n, poisson, density = 2.0, 400, 0.3, 2000.0
    place, cells = grid(np.linspace(0, length, n + 1), np.array([0.0, length / n]))
    held = np.zeros(place.shape, bool)
    held[:, 1] = True
    body = ZoneBody(place, cells, material(poisson), held, plane, density=density)
    stiff = E / (1 - poisson**2) if plane == PLANE_STRESS else E * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson)
    speed = np.sqrt(stiff / density)
    body.nodes.load[place[:, 0] == 0.0, 0] = 5e3
    middle, steps = np.flatnonzero(place[:, 0] == length / 2), 0
    behind = 1e4 / (length / n * density * speed)  # particle velocity p / (rho c)
    while body.nodes.velocity[middle, 0].mean() < 0.5 * behind:
        body.run(1, local=0.0)
        steps += 1
    assert length / 2 / (steps * body.dt) == pytest.approx(speed, rel=0.01)


def test_explicit_rest_state_is_the_static_solution_and_energies_balance():
    place, cells = grid(np.linspace(0, 0.4, 9), np.linspace(0, 0.1, 3))
    held = np.zeros(place.shape, bool)
    held[place[:, 0] == 0.0] = True
    body = ZoneBody(place, cells, material(), held)
    body.nodes.load[:, 1] = -0.01  # small: no change of geometry
    body.run(6000)
    exact = body.solved()
    assert np.abs(body.nodes.shift - exact).max() < 1e-6 * np.abs(exact).max()
    _, energy = body.stresses()
    applied, damping, kinetic = body.total[[0, 5, 6]]
    assert applied == pytest.approx(energy + damping + kinetic, rel=1e-9)
    assert damping > 0.0
