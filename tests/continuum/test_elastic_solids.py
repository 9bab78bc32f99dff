"""Elastic solids: exact bars and beams, loads on patches, turned copies, and the stiffness of the U walls."""

from dataclasses import replace

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments
from limitmason.continuum import Box, Continuum, Mesh, solve_elastic
from limitmason.continuum.mesh import box_of, mesh_boxes
from limitmason.errors import InputError, NotApplicable
from limitmason.geometry import box
from validation.murano_macro import control_point, macro_model, material, published

BAR = Box(np.zeros(3), np.array([0.3, 0.2, 1.5]))
SQUARE = [(0.0, 0.0, 1.5), (0.3, 0.0, 1.5), (0.3, 0.2, 1.5), (0.0, 0.2, 1.5)]


@pytest.mark.parametrize("points", [2, 3])
def test_bar_under_its_own_weight_shortens_by_the_closed_form(points):
    # nu = 0 and quadratic shape functions: u = rho g L^2 / (2 E) at the top, stress rho g (L - z), both exact
    bar = Continuum.from_boxes([BAR], lm.Material(1e9, 0.0, 2000.0), size=0.3, points=points)
    state = solve_elastic(bar)
    assert state.at((0.11, 0.07, 1.5))[0, 2] == pytest.approx(-2000 * 9.81 * 1.5**2 / 2e9, rel=1e-10)
    z = bar.discretisation.places[..., 2]
    assert state.stress[..., 2] == pytest.approx(-2000 * 9.81 * (1.5 - z), abs=1e-6 * 2000 * 9.81 * 1.5)
    assert state.reactions.force == pytest.approx([0.0, 0.0, 2000 * 9.81 * 0.3 * 0.2 * 1.5], abs=1e-6)
    assert bar.mass == pytest.approx(2000 * 0.09)


def test_beam_in_pure_bending_has_the_exact_curvature_and_stress():
    # tractions of the stress sigma (x - b/2) on the top; with nu = 0 the clamp does not disturb: u = kappa z^2 / 2
    e = 2e9
    beam = Continuum.from_boxes([BAR], lm.Material(e, 0.0, 0.0), size=(0.15, 0.2, 0.3))
    stress = np.zeros((*beam.discretisation.places.shape[:2], 6))
    stress[..., 2] = 1e6 * (beam.discretisation.places[..., 0] - 0.15)
    state = solve_elastic(beam.with_forces(beam.discretisation.forces(stress).reshape(-1, 3)), 1.0)
    assert state.stress == pytest.approx(stress, abs=1e-3)
    assert state.at((0.15, 0.1, 1.5))[0, 0] == pytest.approx(-1e6 / e * 1.5**2 / 2, rel=1e-9)
    assert state.residual < 1e-12


def test_bricks_of_eight_nodes_are_exact_in_tension_and_too_stiff_in_bending_by_the_known_factor():
    # an even strain is exact; a brick of length l bends with a shear that is not there: E I -> E I + G A l^2 / 12
    e, length, depth = 2e9, 0.3, 0.3
    bar = Continuum.from_boxes([BAR], lm.Material(e, 0.2, 0.0), size=(depth, 0.2, length), nodes=8)
    pulled = solve_elastic(bar.with_patch_pressure(SQUARE, pressure=-3e5), 1.0)
    assert len(bar.mesh.nodes) == 4 * 6
    free = lm.Material(e, 0.0, 0.0)
    even = solve_elastic(replace(bar, materials=(free,)).with_patch_pressure(SQUARE, pressure=-3e5), 1.0)
    assert even.at((0.11, 0.07, 0.75))[0] == pytest.approx([0.0, 0.0, 3e5 / e * 0.75], abs=1e-12)
    assert pulled.reactions.force[2] == pytest.approx(-3e5 * 0.06)
    beam = replace(bar, materials=(free,))
    stress = np.zeros((*beam.discretisation.places.shape[:2], 6))
    stress[..., 2] = 1e6 * (beam.discretisation.places[..., 0] - 0.15)
    # the moment of that stress on the top alone: forces of both corners of each edge
    moment, corner = 1e6 * 0.2 * depth**3 / 12, np.abs(bar.mesh.nodes[:, 2] - 1.5) < 1e-9
    forces = np.zeros((len(bar.mesh.nodes), 3))
    forces[corner, 2] = np.sign(bar.mesh.nodes[corner, 0] - 0.15) * moment / depth / 2
    turned = solve_elastic(beam.with_forces(forces), 1.0)
    exact = -1e6 / e * 1.5**2 / 2
    assert turned.at((0.15, 0.1, 1.5))[0, 0] == pytest.approx(exact / (1.0 + 0.5 * (length / depth) ** 2), rel=1e-9)


def test_slender_cantilever_bends_and_shears_as_timoshenkos():
    tall = Box(np.zeros(3), np.array([0.2, 0.2, 2.0]))
    beam = Continuum.from_boxes([tall], lm.Material(1e9, 0.0, 0.0), size=0.1)
    top = [(0.2, 0.0, 1.9), (0.2, 0.2, 1.9), (0.2, 0.2, 2.0), (0.2, 0.0, 2.0)]
    u = -solve_elastic(beam.with_patch_pressure(top, force=1e3), 1.0).at((0.1, 0.1, 2.0))[0, 0]
    ei, ga, h = 1e9 * 0.2**4 / 12, 0.5e9 * 0.04 * 5 / 6, 1.95  # the load's middle; its turn carries on to the top
    assert u == pytest.approx(1e3 * (h**3 / (3 * ei) + h / ga + 0.05 * h**2 / (2 * ei)), rel=2e-3)


def test_patch_that_cuts_faces_has_its_resultant_and_its_moment():
    bar = Continuum.from_boxes([BAR], lm.Material(1e9, 0.2, 0.0), size=0.17)
    part = [(0.3, 0.03, 0.21), (0.3, 0.13, 0.21), (0.3, 0.13, 1.12), (0.3, 0.03, 1.12)]
    state = solve_elastic(bar.with_patch_pressure(part, pressure=7e3), 2.0)
    force = -2.0 * 7e3 * 0.1 * 0.91
    assert state.reactions.force == pytest.approx([-force, 0.0, 0.0], abs=1e-6)
    middle = np.array([0.3, 0.08, 0.665])
    assert state.reactions.moment == pytest.approx(-np.cross(middle, [force, 0.0, 0.0]), abs=1e-6)
    heavy = bar.with_patch_mass(SQUARE, 50.0)
    assert heavy.mass == pytest.approx(50.0)
    assert solve_elastic(heavy).reactions.force[2] == pytest.approx(50.0 * 9.81)


def test_joints_and_layout_leave_no_trace_and_a_turned_copy_answers_the_same():
    kwargs = {"length": 1.2, "height": 0.6, "joint": lm.Joint(30.0), "plan": "L", "return_length": 0.8}
    stone = lm.Material(5e8, 0.3, 2100.0)
    answers = []
    for unit in ((0.4, 0.2, 0.2), (0.3, 0.1, 0.2)):
        wall = lm.build.wall(unit=unit, **kwargs)
        for turn in (0.0, np.pi / 2, 0.7):
            c, s = np.cos(turn), np.sin(turn)
            matrix = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            copy = wall.transformed(matrix, (3.0, -2.0, 0.0))
            copy = copy.renumbered(np.random.default_rng(1).permutation(copy.n_blocks))
            solid = Continuum.from_assembly(copy, stone, size=0.2)
            state = solve_elastic(solid.with_body_force(matrix @ [0.0, -1.0, 0.0]), 0.3)
            u = state.at(matrix @ [0.5, 0.1, 0.6] + [3.0, -2.0, 0.0])[0] @ matrix
            answers.append([len(solid.mesh), *u])
    assert np.allclose(answers, answers[0], rtol=1e-8, atol=1e-14)
    assert answers[0][2] < 0.0


def test_what_cannot_be_meshed_or_held_is_refused_by_name():
    arch = lm.build.arch(radius=2.0, thickness=0.3, voussoirs=9, width=0.5, joint=lm.Joint(30.0))
    with pytest.raises(NotApplicable, match="no box along the axes"):
        Continuum.from_assembly(arch, lm.Material(1e9, 0.2, 2000.0), size=0.1)
    bar = Continuum.from_boxes([BAR], lm.Material(1e9, 0.2, 2000.0), size=0.3)
    with pytest.raises(InputError, match="no free face"):
        bar.with_patch_pressure(SQUARE[::-1], force=1.0)
    with pytest.raises(InputError, match="outside the solid"):
        solve_elastic(bar).at((0.0, 0.0, 2.0))
    for made_of, message in (
        (lm.Material(1e9, 0.2), "'' has no density"),
        (lm.Material(1e9, 0.2, 2000.0, cohesion=1e5, friction_angle_deg=30.0), "are for units"),
    ):
        with pytest.raises(InputError, match=message):
            Continuum.from_boxes([BAR], made_of, size=0.3)
    with pytest.raises(InputError, match="bricks name material 1, counted from 0, 1 are given"):
        replace(bar, mesh=mesh_boxes([BAR._replace(material=1)], 0.3))


def test_arrays_of_a_mesh_and_a_solid_are_copies_and_must_fit():
    unit = mesh_boxes([Box(np.zeros(3), np.ones(3))], 1.0, nodes=8)
    vertices, bricks, material = np.asfortranarray(unit.solid.p.T.copy()), unit.bricks.copy(), np.zeros(1, dtype=int)
    mesh = Mesh(vertices, bricks, material, 8)
    held, dead, lumped = np.zeros((8, 3), dtype=bool), np.zeros((8, 3)), np.zeros(8)
    held[mesh.nodes[:, 2] == 0.0] = True
    solid = Continuum(mesh, (lm.Material(1e9, 0.2, 0.0),), held, dead, dead, lumped)
    for mine in (vertices, bricks, material, held, dead, lumped):
        mine[:] = 1  # neither frozen nor followed
    assert (solid.mesh.solid.p.T == unit.solid.p.T).all()
    assert solid.mesh.bricks.tolist() == unit.bricks.tolist()
    assert (solid.held.sum(), solid.dead.max(), solid.lumped.max()) == (12, 0.0, 0.0)
    with pytest.raises(InputError, match=r"dead must have shape \(8, 3\), a row for each node, got \(2, 3\)"):
        replace(solid, dead=np.zeros((2, 3)))
    with pytest.raises(InputError, match=r"bricks \(m, 8\), got \(8, 3\) and \(8,\)"):
        Mesh(unit.solid.p.T.tolist(), bricks[0].tolist(), [0], 8)


def test_slabs_at_two_levels_are_both_held_and_a_slab_on_a_slab_is_not():
    """A lintel on two piers, one of which stands on a step: only the lower slab was held, and the step hung in air."""
    boxes = {
        "low": ((0, 0, -0.2), (1, 1, 0)), "under": ((3, 0, -0.4), (4, 1, 0)), "step": ((3, 0, 0), (4, 1, 0.5)),
        "left": ((0, 0, 0), (1, 1, 1)), "right": ((3, 0, 0.5), (4, 1, 1)), "lintel": ((0, 0, 1), (4, 1, 1.5)),
    }
    joint, stone = lm.Joint(30.0), lm.Material(1e9, 0.2, 2000.0)
    wall = lm.Assembly.from_polyhedra(
        [box(*ends) for ends in boxes.values()], joint=joint, density=2000.0, names=list(boxes),
        fixed=["low", "under", "step"],
    )
    solid = Continuum.from_assembly(wall, stone, size=0.5, slab=stone, nodes=8)
    held = solid.mesh.nodes[solid.held.all(axis=1)]
    assert {(float(round(x, 6)) < 2.0, float(round(z, 6))) for x, _, z in held} == {(True, -0.2), (False, -0.4)}


@pytest.mark.parametrize("shift", [0.0, 1e3])
def test_a_tapered_block_is_no_box_wherever_it_stands(shift):
    # a top that is 5 mm shorter: half a hundred-thousandth of a coordinate of 1 km, a hundredth of the block
    wall = lm.build.wall(length=0.8, height=0.4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(30.0))
    part = wall.blocks[int(np.flatnonzero(~wall.fixed)[0])].parts[0]
    away = part._replace(vertices=part.vertices + np.array([shift, -shift, 0.0]))
    box = box_of(away, "stone")
    assert box.high - box.low == pytest.approx(np.ptp(part.vertices, axis=0), abs=1e-9)
    tapered = away.vertices.copy()
    tapered[(tapered[:, 0] == box.high[0]) & (tapered[:, 2] == box.high[2]), 0] -= 5e-3
    with pytest.raises(NotApplicable, match="'stone' is no box"):
        box_of(away._replace(vertices=tapered), "stone")


def test_strengths_from_the_modulus_are_those_of_tables_6_and_9():
    for specimen, properties in (("DS", "step 1"), ("REGW", "final")):
        printed = material(specimen, properties)
        found = lm.Material.from_modulus(printed.young_modulus)
        assert found.compressive_strength == pytest.approx(printed.compressive_strength, rel=1e-9)
        assert found.tensile_strength == pytest.approx(printed.tensile_strength, rel=1e-9)
        assert found.compressive_energy == pytest.approx(printed.compressive_energy, rel=1e-3)
        assert found.tensile_energy == printed.tensile_energy
    final = material("DS", "final")
    assert final.tensile_strength == pytest.approx(final.compressive_strength / 100, rel=1e-4)


def secant(specimen, properties="final", size=0.15, **options):
    test = experiments.load("murano-u-walls", specimen, **options)
    model = macro_model(test, properties, size=size)
    u = [solve_elastic(model, load).at(control_point(test))[0, 1] for load in (0.0, 1.0)]
    return 1e-3 / (u[0] - u[1])  # kN/mm under 1 kN


@pytest.mark.slow
def test_elastic_stiffness_of_the_macro_models():
    # printed 46.42 lies between side walls of 1.00 m, which are derived, and 1.15 m; at 0.15 m bricks within 5 % of the
    # first, on the source's 0.10 m 5.3 % below: the mesh that gives 46.9 has one brick through the wall
    stiffness = secant("REGW")
    assert stiffness == pytest.approx(46.42, rel=0.05)
    assert stiffness < 46.42 < secant("REGW", return_length=1.15)
    assert secant("REGW", size=0.3) == pytest.approx(46.9, rel=0.01)
    # 3.10 is printed for DS: no elastic wall of this modulus and these frequencies has it
    assert secant("DS") == pytest.approx(16.0, rel=0.05)
    assert secant("DS", "step 1") / secant("DS") == pytest.approx(398 / 295, rel=1e-9)


@pytest.mark.slow
def test_printed_frequencies_of_regw_say_that_its_side_walls_are_one_metre_long():
    # E and density move all frequencies by one factor: the plan is right where the three printed ones over ours agree
    printed = np.array([float(published("REGW")[f"frequency_{k}"]) for k in (1, 2, 3)])

    def spread(length):
        test = experiments.load("murano-u-walls", "REGW", return_length=length)
        over = printed / lm.modes(macro_model(test, size=0.3), 3).frequency
        return np.ptp(over) / over.mean()

    assert spread(1.0) < 0.005
    assert min(spread(0.95), spread(1.05)) > 0.02


@pytest.mark.slow
def test_an_elastic_slab_under_the_macro_model_softens_it_a_little():
    test = experiments.load("murano-u-walls", "REGW")
    concrete = lm.Material(30e9, 0.2, 2500.0)
    on_slab = macro_model(test, size=0.3, slab=concrete)
    assert on_slab.materials[1] == concrete
    # thirty-five times stiffer than the wall: a per cent at most, and never stiffer than a rigid ground
    u = [solve_elastic(on_slab, load).at(control_point(test))[0, 1] for load in (0.0, 1.0)]
    assert 0.98 * secant("REGW", size=0.3) < 1e-3 / (u[0] - u[1]) < secant("REGW", size=0.3)
