"""Elastic blocks in polynomials against bars, beams, uniform strain and a mesh of finite elements."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, SOLID, polynomial_block, polynomial_blocks
from limitmason.deformable.elasticity import Elasticity
from limitmason.deformable.polynomial_body import volume_points
from limitmason.errors import InputError

E, NU, RHO = 2e9, 0.25, 1800.0
NORMAL = (0.0, 1.0, 0.0)


def prism(outline, width):
    return lm.Assembly.from_polygons([outline], thickness=width, joint=lm.Joint(30.0), density=RHO).blocks[0]


def bar(length=1.0, depth=0.05, width=0.1):
    return prism([(0, 0), (length, 0), (length, depth), (0, depth)], width)


def law(state, nu=NU):
    return Elasticity.of(E, nu, state, None if state == SOLID else NORMAL)


def frequencies(block):
    return np.sqrt(np.diag(block.stiffness) / np.diag(block.mass)) / (2.0 * np.pi)


@pytest.mark.parametrize("state", [PLANE_STRESS, PLANE_STRAIN, pytest.param(SOLID, marks=pytest.mark.slow)])
def test_free_bar_swings_along_and_across_as_bars_do(state):
    """c / 2 L along, and 22.373 / (2 pi L^2) sqrt(EI / rho A) across (Euler and Bernoulli), L / h = 40."""
    found = frequencies(polynomial_block(bar(depth=0.025, width=0.04), law(state), degree=6))
    modulus = E / (1.0 - NU**2) if state == PLANE_STRAIN else E
    along = np.sqrt(modulus / RHO) / 2.0
    across = 22.3733 / (2.0 * np.pi) * np.sqrt(modulus / RHO / 12.0) * 0.025
    assert np.abs(found / along - 1.0).min() < 2e-3
    assert np.abs(found / across - 1.0).min() < 6e-3  # shear and rotary inertia take 0.4 %


@pytest.mark.parametrize("state", [PLANE_STRESS, SOLID])
def test_shapes_share_no_mass_and_no_motion_with_rigid_ones(state):
    outline = [(0, 0), (0.3, 0.02), (0.25, 0.15), (0.05, 0.13)]
    made = prism(outline, 0.1)
    shapes = polynomial_block(made, law(state), degree=3)
    x, w = volume_points(made.parts[0], made.centroid, 6)
    phi = shapes.displacement(x + made.centroid)
    assert np.abs(np.einsum("m,mki->ki", w, phi)).max() < 1e-13 * made.volume
    assert np.abs(np.einsum("m,mki->ki", w, np.cross(x[:, None], phi))).max() < 1e-13 * made.volume
    mass = RHO * np.einsum("m,mki,mli->kl", w, phi, phi)
    assert mass == pytest.approx(shapes.mass, abs=1e-9 * shapes.mass.max())


@pytest.mark.parametrize("state", [PLANE_STRESS, PLANE_STRAIN, SOLID])
@pytest.mark.parametrize("degree", [1, 4])
def test_uniform_stress_gives_its_exact_compliance(state, degree):
    """Pull p on both ends of a bar: the ends part by p L / E, and the sides come together by nu of that."""
    length, depth, width, p = 0.4, 0.1, 0.08, 3e4
    made = bar(length, depth, width)
    shapes = polynomial_block(made, law(state), degree=degree)
    g, w = np.polynomial.legendre.leggauss(5)
    y, z = (a.ravel() for a in np.meshgrid(0.5 * width * g, 0.5 * depth * g, indexing="ij"))
    weight = 0.25 * width * depth * np.outer(w, w).ravel()
    ends = [made.centroid + np.column_stack([s * 0.5 * length * np.ones_like(y), y, z]) for s in (1, -1)]
    force = p * weight @ (shapes.displacement(ends[0]) - shapes.displacement(ends[1]))[:, :, 0]
    q = np.linalg.solve(shapes.stiffness, force)
    u = [q @ shapes.displacement((made.centroid + np.array(d))[None])[0] for d in ((0.2, 0, 0), (0, 0, 0.05))]
    elastic = law(state)
    assert 2.0 * u[0][0] == pytest.approx(p * length / elastic.bar_modulus, rel=1e-9)
    assert 2.0 * u[1][2] == pytest.approx(-elastic.contraction * p * depth / elastic.bar_modulus, rel=1e-9)


def test_stone_on_its_ends_under_its_middle_meets_a_fine_mesh_from_below():
    """Pressure on the middle third of the top, borne by the outer sixths of the bottom: finite elements, 60 x 24 Q2."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import ddot, sym_grad

    length, depth, width, p = 0.3, 0.12, 0.1, 1e5
    plane, made = law(PLANE_STRESS), bar(length, depth, width)

    @skfem.BilinearForm
    def stiffness(u, v, _):
        trace = u.grad[0, 0] + u.grad[1, 1]
        return plane.lame * trace * (v.grad[0, 0] + v.grad[1, 1]) + 2.0 * plane.shear * ddot(sym_grad(u), sym_grad(v))

    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, length, 61), np.linspace(0, depth, 25))
    element = skfem.ElementVector(skfem.ElementQuad2())
    basis, load = skfem.Basis(mesh, element), 0.0
    third = length / 3
    faces = ((-1.0, depth, ((third, 2 * third),)), (1.0, 0.0, ((0.0, third / 2), (length - third / 2, length))))
    for sense, z, spans in faces:
        for low, high in spans:
            on = mesh.facets_satisfying(
                lambda x, z=z, low=low, high=high: (np.abs(x[1] - z) < 1e-9) & (x[0] > low) & (x[0] < high), True
            )
            part = skfem.FacetBasis(mesh, element, facets=on)
            load = load + skfem.LinearForm(lambda v, _, sense=sense: sense * p * v[1]).assemble(part)
    matrix = stiffness.assemble(basis)
    held = [basis.get_dofs(lambda x, at=at: (np.abs(x[0] - at) < 1e-9) & (x[1] < 1e-9)).all() for at in (0.0, length)]
    held = np.concatenate([held[0], held[1][1:]])
    exact = width * float(load @ skfem.solve(*skfem.condense(matrix, load, D=held)))
    g, w = np.polynomial.legendre.leggauss(8)
    found = []
    for degree in (2, 4, 6):
        shapes = polynomial_block(made, plane, degree=degree)
        force = np.zeros(shapes.count)
        for sense, z, spans in faces:
            for low, high in spans:
                x = 0.5 * (low + high) + 0.5 * (high - low) * g
                at = np.column_stack([x, np.full(8, made.centroid[1]), np.full(8, z)])
                force += sense * p * width * 0.5 * (high - low) * (w @ shapes.displacement(at)[:, :, 2])
        found.append(force @ np.linalg.solve(shapes.stiffness, force) / exact)
    assert found[0] < found[1] < found[2] < 1.0 + 1e-6
    assert found[1] > 0.9
    assert found[2] > 0.95


def test_what_is_no_prism_or_no_degree_is_refused():
    with pytest.raises(InputError, match="degree of the polynomials"):
        polynomial_block(bar(), law(SOLID), degree=9)
    wall = lm.Assembly.from_polygons(
        [[(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1), (1, 1), (1, 2), (0, 2)], [(0, 2), (1, 2), (1, 3), (0, 3)]],
        thickness=0.1, joint=lm.Joint(30.0), fixed=[0],
    ).with_material(lm.Material(young_modulus=E, poisson_ratio=NU))
    one, two, three = polynomial_blocks(wall, PLANE_STRESS, NORMAL, degree=2)
    assert one is None
    assert two.coefficients is three.coefficients
    assert three.centroid == pytest.approx((0.5, 0.0, 2.5), abs=0.06)
