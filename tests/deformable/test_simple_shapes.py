"""Shapes of simply deformable blocks against closed forms: stiffness, mass, patch test, orthogonality, any axes."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, SOLID, Elasticity, simply_deformable_block
from limitmason.deformable.polynomial_body import block_axes, volume_points
from limitmason.geometry.polyhedron import Solid, box, face_planes, prism
from limitmason.geometry.rotation import rotation_matrices
from limitmason.model.block import Block

E, NU, RHO = 16.7e9, 0.2, 1900.0
SIDES = np.array([0.225, 0.1025, 0.075])
STATES = (SOLID, PLANE_STRESS, PLANE_STRAIN)
TURN = rotation_matrices(np.array([[0.3, -0.7, 0.4]]))[0]
FIVE = np.array([[0.0, 0.0], [0.31, -0.05], [0.4, 0.2], [0.15, 0.33], [-0.06, 0.18]])


def brick(sides=SIDES):
    return Block("brick", (box((0.3, -0.2, 0.1), np.array((0.3, -0.2, 0.1)) + sides),), RHO)


def turned(block, matrix):
    solid = block.parts[0]
    return Block(block.name, (Solid(solid.vertices @ matrix.T + (0.5, 0.1, -2.0), solid.faces),), block.density)


def five_sided():
    return Block("five", (prism(FIVE, 0.0, 0.25),), RHO)


def law(state, normal=(0, 1, 0)):
    return Elasticity.of(E, NU, state, None if state == SOLID else normal)


def face_points(solid):
    """Points [m], outward normals and weights [m2] exact to degree 8 over all faces: collapsed Gauss squares."""
    g, w = np.polynomial.legendre.leggauss(5)
    g, w = 0.5 * (g + 1.0), 0.5 * w
    for face in solid.faces:
        corner = solid.vertices[list(face)]
        n = face_planes(corner[None])[0][0]
        for k in range(1, len(face) - 1):
            t = corner[[0, k, k + 1]]
            area = np.linalg.norm(np.cross(t[1] - t[0], t[2] - t[0]))
            for u, wu in zip(g, w, strict=True):
                for v, wv in zip(g, w, strict=True):
                    yield t[0] + u * ((1 - v) * (t[1] - t[0]) + v * (t[2] - t[0])), n, u * wu * wv * area


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("deep", [0.1, 0.9])
def test_axes_of_a_voussoir_are_those_of_its_symmetry_in_whatever_order_its_faces_are_given(state, deep):
    # its two beds are its largest faces, or the longest sides of them, and of equal size
    solid = prism(np.array([[-0.11, 0.0], [0.11, 0.0], [0.15, 0.5], [-0.15, 0.5]]), 0.0, deep)
    normal = None if state == SOLID else np.array([0.0, 1.0, 0.0])
    for faces in (solid.faces, solid.faces[::-1]):
        axes = block_axes(Solid(solid.vertices, faces), normal)
        assert np.sort(np.abs(axes), axis=0) == pytest.approx(np.array([[0.0] * 3, [0.0] * 3, [1.0] * 3]), abs=1e-12)


@pytest.mark.parametrize("state", STATES)
def test_stiffness_of_a_brick_is_that_of_bars_and_beams(state):
    shapes = simply_deformable_block(brick(), law(state))
    k = dict(zip(shapes.names, np.diag(shapes.stiffness), strict=True))
    volume = SIDES.prod()
    shear = E / (2 * (1 + NU))
    # the largest face lies in x-y, its longest side along x: own axes are x, y, z, in a plane x, (y), z
    lame = {SOLID: E * NU / (1 + NU) / (1 - 2 * NU), PLANE_STRESS: E * NU / (1 - NU**2)}
    confined = lame.get(state, lame[SOLID]) + 2 * shear
    assert k["exx"] == pytest.approx(confined * volume, rel=1e-12)
    assert k["exz"] == pytest.approx(shear * volume, rel=1e-12)
    bar = E / (1 - NU**2) if state == PLANE_STRAIN else E
    assert k["bend xz"] == pytest.approx(bar * volume * SIDES[2] ** 2 / 12, rel=1e-12)
    assert k["bend zx"] == pytest.approx(bar * volume * SIDES[0] ** 2 / 12, rel=1e-12)
    if state == SOLID:
        # least energy of a unit twist about x over its warping shape: G 4 Iy Iz / (Iy + Iz), as of an ellipse
        rows = [shapes.names.index(f"twist {i}") for i in "xyz"]
        twist = np.array([0.0, -1.0, 1.0])
        block = shapes.stiffness[np.ix_(rows, rows)]
        least = twist @ block @ twist - (twist @ block[0]) ** 2 / block[0, 0]
        iy, iz = volume * SIDES[1] ** 2 / 12, volume * SIDES[2] ** 2 / 12
        assert least == pytest.approx(shear * 4 * iy * iz / (iy + iz), rel=1e-12)


def divergence(shapes, points, step):
    """Of every shape's stress, by central differences; exact for stresses up to degree 2."""
    out = 0.0
    for j in range(3):
        arm = step * np.eye(3)[j]
        out = out + (shapes.stress(points + arm) - shapes.stress(points - arm))[..., j] / (2.0 * step)
    return out


@pytest.mark.parametrize("state", [PLANE_STRESS, PLANE_STRAIN])
@pytest.mark.parametrize("make", [brick, five_sided])
def test_stresses_of_a_plane_hold_all_linear_ones_in_equilibrium_and_those_of_shear(state, make):
    """div sigma = 0 of every shape, and as many of them as there are: 3 uniform, 6 linear less 2, 2 of shear."""
    block = turned(make(), TURN)
    normal = TURN @ (0.0, 1.0, 0.0)
    shapes = simply_deformable_block(block, law(state, normal))
    x, _ = volume_points(block.parts[0], block.centroid)
    size = np.cbrt(block.volume)
    stress = shapes.stress(x + block.centroid)
    largest = np.abs(stress).max(axis=(0, 2, 3))
    inside = shapes.elasticity.projector
    force = divergence(shapes, block.centroid + x, 0.1 * size) @ inside
    assert np.abs(force / largest[:, None]).max() * size < 1e-9
    flat = (stress / largest[:, None, None]).transpose(1, 0, 2, 3).reshape(shapes.count, -1)
    assert np.linalg.matrix_rank(flat, tol=1e-6) == 9
    linear = [k for k, n in enumerate(shapes.names) if not n.startswith("shear")]
    mean, gradient = shapes.linear_stress(block)
    near = mean[linear] + np.einsum("kijp,mp->mkij", gradient[linear], x)
    assert np.abs((near - stress[:, linear]) / largest[linear, None, None]).max() < 1e-12


@pytest.mark.parametrize("state", STATES)
def test_shear_along_a_brick_is_the_parabola_of_a_beam(state):
    """sigma_i = E x_i x_j, and shear that balances it in every point: tau' = -E x_j, no body force (article 21)."""
    shapes = simply_deformable_block(brick(), law(state))
    x, _ = volume_points(brick().parts[0], brick().centroid)
    row = shapes.names.index("shear xz")
    stress = shapes.axes @ shapes.stress(x + brick().centroid)[:, row] @ shapes.axes.T
    x = x @ shapes.axes.T
    bar = E / (1 - NU**2) if state == PLANE_STRAIN else E
    assert stress[:, 0, 0] == pytest.approx(bar * x[:, 0] * x[:, 2], abs=1e-9 * bar * SIDES.max() ** 2)
    assert np.abs(stress[:, 2, 2]).max() < 1e-12 * np.abs(stress[:, 0, 0]).max()
    force = divergence(shapes, x @ shapes.axes + brick().centroid, 0.01)[:, row]
    assert np.abs(force).max() < 1e-9 * bar * SIDES[2]


@pytest.mark.parametrize("state", [PLANE_STRESS, PLANE_STRAIN])
def test_brick_pulled_by_shear_on_its_sides(state):
    """Timoshenko and Goodier, article 18: sigma_x = s x, tau = -s z in a strip; its energy by hand."""
    shapes = simply_deformable_block(brick(), law(state))
    k = shapes.stiffness
    bar = E / (1 - NU**2) if state == PLANE_STRAIN else E
    lateral = NU / (1 - NU) if state == PLANE_STRAIN else NU
    (a, _, c), volume = SIDES, SIDES.prod()
    row = {n: i for i, n in enumerate(shapes.names)}
    for name, along, across in (("pull x", a, c), ("pull z", c, a)):
        # s^2 / E (x^2 + 2 (1 + nu) z^2) over the brick
        wanted = bar * volume * (along**2 + 2 * (1 + lateral) * across**2) / 12
        assert k[row[name], row[name]] == pytest.approx(wanted, rel=1e-12)
    # bending zx has sigma_z = x: it shares with sigma_x = x the contraction, -nu E' <x^2>; other shapes nothing
    assert k[row["pull x"], row["bend zx"]] == pytest.approx(-lateral * bar * volume * a**2 / 12, rel=1e-12)
    others = [i for n, i in row.items() if n not in ("pull x", "bend zx")]
    assert np.abs(k[row["pull x"], others]).max() < 1e-12 * k[row["pull x"], row["pull x"]]


@pytest.mark.parametrize("flat", [0.02, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 50.0])
@pytest.mark.parametrize("make", ["box", "triangle"])
def test_shapes_of_a_plane_do_not_depend_on_the_axes(flat, make):
    """The same compliance to tractions on the faces when the block's own axes are swapped, turned or nearly so."""
    corners = np.array([[0, 0], [0.3, 0], [0.3, 0.3 * flat], [0, 0.3 * flat]])
    if make == "triangle":
        corners = corners[:3]
    compliance, angle = [], np.deg2rad(37.0)
    spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for start, turn in ((0, np.eye(2)), (1, np.eye(2)), (0, spin), (2, spin)):
        block = Block("p", (prism(np.roll(corners, start, axis=0) @ turn.T, 0.0, 0.1),), RHO)
        shapes = simply_deformable_block(block, law(PLANE_STRESS))
        middle = 0.5 * (corners + np.roll(corners, -1, axis=0))
        where = np.concatenate([corners, middle]) @ turn.T
        u = shapes.displacement(np.column_stack([where[:, 0], np.zeros(len(where)), where[:, 1]]))[:, :, [0, 2]]
        u = (u @ turn).transpose(0, 2, 1).reshape(-1, shapes.count)
        compliance.append(u @ np.linalg.solve(shapes.stiffness, u.T))
        assert np.linalg.eigvalsh(shapes.stiffness / np.sqrt(np.outer(*2 * [np.diag(shapes.stiffness)]))).min() > 1e-6
    for other in compliance[1:]:
        assert np.abs(other - compliance[0]).max() < 1e-9 * np.abs(compliance[0]).max()


def test_mass_matrix_of_a_brick():
    shapes = simply_deformable_block(brick(), law(PLANE_STRESS))
    m, (a, _, c) = dict(zip(shapes.names, np.diag(shapes.mass), strict=True)), SIDES
    mass = RHO * SIDES.prod()
    assert m["exx"] == pytest.approx(mass * a**2 / 12, rel=1e-12)
    # shear without mean rotation: (A z, B x), A + B = 1, A <zz> = B <xx>
    over_z, over_x = a**2 / (a**2 + c**2), c**2 / (a**2 + c**2)
    assert m["exz"] == pytest.approx(mass * (over_z**2 * c**2 + over_x**2 * a**2) / 12, rel=1e-12)
    # bending: u = x z, whose mean rotation is zero; v = -x^2/2 - nu z^2/2 less their means
    x2, z2, x4, z4 = a**2 / 12, c**2 / 12, a**4 / 80, c**4 / 80
    across = ((x4 - x2**2) + NU**2 * (z4 - z2**2)) / 4
    assert m["bend xz"] == pytest.approx(mass * (x2 * z2 + across), rel=1e-12)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("make", [brick, five_sided])
def test_a_mode_has_no_mean_displacement_and_no_mean_rotation(state, make):
    block = make()
    shapes = simply_deformable_block(block, law(state))
    x, w = volume_points(block.parts[0], block.centroid)
    phi = shapes.displacement(x + block.centroid)
    size = np.cbrt(block.volume)
    scale = block.volume * np.abs(phi).max(axis=(0, 2))[:, None]
    assert np.abs(np.einsum("m,mki->ki", w, phi) / scale).max() < 1e-14
    assert np.abs(np.einsum("m,mki->ki", w, np.cross(x[:, None], phi)) / scale).max() < 1e-14 * size


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("make", [brick, five_sided])
def test_patch_test_on_the_faces(state, make):
    """Tractions of uniform stress, of pure bending and of twist are answered by exactly the strains of Hooke's law."""
    normal = TURN @ (0.0, 1.0, 0.0)
    block = turned(make(), TURN)
    shapes = simply_deformable_block(block, law(state, normal))
    wanted = np.random.default_rng(3).normal(size=shapes.count)
    force = np.zeros(shapes.count)
    for x, n, weight in face_points(block.parts[0]):
        if state != SOLID and abs(n @ normal) > 0.5:
            continue  # the faces of the wall: free, or held by what keeps the strain plane
        traction = np.tensordot(wanted, shapes.stress(x[None])[0], axes=1) @ n
        force += weight * shapes.displacement(x[None])[0] @ traction
    assert np.abs(np.linalg.solve(shapes.stiffness, force) - wanted).max() < 1e-12 * np.abs(wanted).max()
    assert shapes.count == (21 if state == SOLID else 9)


@pytest.mark.parametrize("state", STATES)
def test_hooke_law_by_hand(state):
    elastic = law(state)
    strain = np.array([[1e-4, 0.0, 3e-5], [0.0, 0.0, 0.0], [3e-5, 0.0, -2e-4]])
    stress = elastic.stress(strain)
    if state == PLANE_STRESS:  # eps = sigma (1 + nu)/E - nu tr(sigma)/E with sigma_yy = 0
        back = stress * (1 + NU) / E - NU / E * np.trace(stress) * np.diag([1.0, 0.0, 1.0])
        assert np.abs(back - strain).max() < 1e-16
        assert stress[1, 1] == 0.0
    else:
        full = law(SOLID).stress(strain)
        rows = np.ix_([0, 2], [0, 2])
        assert np.abs(stress[rows] - full[rows]).max() < 1e-9 * np.abs(full).max()


@pytest.mark.parametrize("state", STATES)
def test_turned_block_has_turned_shapes(state):
    block = five_sided()
    one = simply_deformable_block(block, law(state))
    two = simply_deformable_block(turned(block, TURN), law(state, TURN @ (0.0, 1.0, 0.0)))
    assert np.abs(two.stiffness - one.stiffness).max() < 1e-12 * np.abs(one.stiffness).max()
    assert np.abs(two.mass - one.mass).max() < 1e-12 * np.abs(one.mass).max()
    x = block.parts[0].vertices
    there = one.displacement(x) @ TURN.T
    assert np.abs(two.displacement(x @ TURN.T + (0.5, 0.1, -2.0)) - there).max() < 1e-12 * np.abs(there).max()


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_units(factor):
    """Lengths times f, stresses over f^2: an energy per squared strain grows as f, per squared curvature as f^3."""
    solid = five_sided().parts[0]
    one = simply_deformable_block(five_sided(), law(SOLID))
    big = Block("big", (Solid(solid.vertices * factor, solid.faces),), RHO)
    two = simply_deformable_block(big, Elasticity.of(E / factor**2, NU, SOLID, None))
    power = np.array([0 if n.startswith("e") else 2 if n.startswith("shear") else 1 for n in one.names])
    back = two.stiffness / factor ** (1.0 + power[:, None] + power)
    assert np.abs(back - one.stiffness).max() < 1e-12 * np.abs(one.stiffness).max()


def test_degree_four_is_integrated_exactly():
    low, high = np.array((0.1, -0.3, 0.2)), np.array((0.7, 0.5, 0.9))
    x, w = volume_points(box(low, high), 0.5 * (low + high))
    h = high - low
    assert (w * x[:, 0] ** 4).sum() == pytest.approx(h.prod() * h[0] ** 4 / 80, rel=1e-13)
    assert (w * x[:, 0] ** 2 * x[:, 2] ** 2).sum() == pytest.approx(h.prod() * (h[0] * h[2]) ** 2 / 144, rel=1e-13)


def test_refusals_say_what_to_do():
    two = Block("L", (box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 0.5))), RHO)
    with pytest.raises(lm.errors.InputError, match="'L' is not convex.*convex blocks with strong joints"):
        simply_deformable_block(two, law(SOLID))
    leaning = turned(brick(), TURN)
    with pytest.raises(lm.errors.InputError, match="'brick' is no prism along"):
        simply_deformable_block(leaning, law(PLANE_STRESS))
    with pytest.raises(lm.errors.InputError, match="poisson_ratio"):
        Elasticity.of(E, 0.5, SOLID, None)
    with pytest.raises(lm.errors.InputError, match="young_modulus"):
        Elasticity.of(0.0, 0.2, SOLID, None)
    with pytest.raises(lm.errors.InputError, match="state of stress"):
        Elasticity.of(E, 0.2, "plane stres", None)
