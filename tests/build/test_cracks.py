"""Potential cracks in units: the strong limit is the uncut wall, the soft one adds a series compliance."""

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm
from limitmason.geometry.polyhedron import box, mass_properties
from limitmason.geometry.splitting import split_solid

STRONG = lm.Joint(45.0, cohesion=1e7, tensile_strength=1e7, name="unit")
UNIT = (0.4, 0.2, 0.2)


def wall(joint=None, **options):
    return lm.build.wall(length=1.6, courses=4, unit=UNIT, joint=joint or lm.Joint(33.0), **options)


@pytest.mark.parametrize("options", [{}, {"plan": "L", "return_length": 0.8}, {"bond": "english", "unit": None}])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, -1, 0)])
def test_strong_cracks_leave_the_multiplier_of_the_uncut_wall(options, direction):
    options = {k: v for k, v in options.items() if v is not None}
    whole, cut = wall(**options), wall(**options, unit_cracks=STRONG)
    assert cut.n_blocks > 1.5 * whole.n_blocks
    assert cut.weights.sum() == pytest.approx(whole.weights.sum(), rel=1e-12)
    assert sum(i.area for i in cut.interfaces if i.kind != "crack") == pytest.approx(
        sum(i.area for i in whole.interfaces), rel=1e-12
    )
    values = [lm.limit_analysis(w, lm.Loads.horizontal(w, direction)).collapse_multiplier for w in (whole, cut)]
    assert values[1] == pytest.approx(values[0], rel=1e-6)


def test_weak_cracks_lower_it_and_a_crack_opens_at_the_tensile_strength_of_the_unit():
    whole, weak = wall(), wall(unit_cracks=lm.Joint(33.0))
    values = [lm.limit_analysis(w, lm.Loads.horizontal(w)).collapse_multiplier for w in (whole, weak)]
    assert values[1] < 0.99 * values[0]
    # a block of two halves hangs by its crack: lambda = ft A + weight of the half below
    side, ft = 0.2, 5e3
    block = on_slab([((0, 0, 0), (side, side, side))], joint=STRONG)
    halves = lm.build.with_potential_cracks(
        block, {1: ((0, 0, 0.5 * side), (0, 0, 1))}, lm.Joint(30.0, cohesion=1e5, tensile_strength=ft)
    )
    up = lm.Loads.weight(halves).with_point_load(halves, "block-1-b", (0, 0, 1.0))
    found = lm.limit_analysis(halves, up).collapse_multiplier
    assert found == pytest.approx(ft * side**2 + halves.weights[2], rel=1e-6)


@pytest.mark.slow
def test_in_linear_stiffness_a_crack_adds_its_series_compliance():
    side, bed = 0.2, 1e9
    block = on_slab([((0, 0, 0), (side, side, side))], joint=lm.Joint(35.0, normal_stiffness=bed))
    loads = lm.Loads.weight(block)

    def top(assembly):
        state = dem.simulate(assembly, dem.Settle(tolerance=1e-9), contact_points=(4, 4)).state
        return state.bodies.shift[-1, 2]

    whole, differences = top(block), []
    for kn in (1e9, 1e10, 1e11):
        law = lm.Joint(35.0, cohesion=1e6, tensile_strength=1e6, normal_stiffness=kn)
        cut = lm.build.with_potential_cracks(block, {"block-1": ((0, 0, 0.12), (0, 0, 1))}, law)
        carried = cut.weights[2] / side**2
        differences.append(top(cut) - whole)
        assert differences[-1] == pytest.approx(-carried / kn, rel=1e-3)
    assert np.array(differences[1:]) / differences[:-1] == pytest.approx([0.1, 0.1], rel=1e-2)
    assert loads.dead[1, 2] == pytest.approx(-block.weights[1])


@pytest.mark.parametrize("tilt", [(1, 0, 0), (0, 0, 1), (1, 2, 3), (1, 1, 0)])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_solid_is_split_into_two_closed_ones_of_its_volume(tilt, scale):
    normal = np.array(tilt) / np.linalg.norm(tilt)
    solid = box((0, 0, 0), (0.4 * scale, 0.2 * scale, 0.3 * scale))
    centre = np.array([0.2, 0.1, 0.15]) * scale
    below, above, polygon = split_solid(solid, centre, normal, 1e-9 * scale)
    parts = mass_properties([below, above])
    whole = mass_properties([solid])
    assert parts.volume == pytest.approx(np.full(2, 0.5 * whole.volume[0]), rel=1e-12)
    assert ((parts.centroid - centre) @ normal * (-1, 1) > 0).all()
    assert (polygon - centre) @ normal == pytest.approx(np.zeros(len(polygon)), abs=1e-12 * scale)
    # closed: every edge is run through once each way
    for part in (below, above):
        edges = [(f[k - 1], f[k]) for f in part.faces for k in range(len(f))]
        assert len(set(edges)) == len(edges)
        assert {(b, a) for a, b in edges} == set(edges)
    ring = polygon - polygon.mean(axis=0)
    assert (np.cross(ring, np.roll(ring, -1, axis=0)) @ normal > 0).all()


def test_any_plane_through_a_block_of_several_parts_and_its_bad_input():
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))])
    slanted = lm.build.with_potential_cracks(block, {"block-1": ((0.1, 0.1, 0.1), (1, 0, 1))}, STRONG)
    assert [b.name for b in slanted.blocks] == ["block-0", "block-1-a", "block-1-b"]
    assert slanted.interfaces[-1].area == pytest.approx(0.2 * 0.2 * np.sqrt(2.0), rel=1e-12)
    value = [lm.limit_analysis(a, lm.Loads.horizontal(a)).collapse_multiplier for a in (block, slanted)]
    assert value[1] == pytest.approx(value[0], rel=1e-6)
    for planes, said in (
        ({"block-1": ((0.5, 0, 0), (1, 0, 0))}, "'block-1' misses it: its corners lie from -0.5 to -0.3 m"),
        ({"block-1": ((0.2, 0, 0), (1, 0, 0))}, "misses it"),
        ({"block-1": ((0, 0, 0), (0, 0, 0))}, "has no length"),
        ({"block-1": ((0, 0, 0), "x")}, "three finite numbers"),
        ({"block-1": 3.0}, "a point and a normal"),
        ({"block-0": ((0.1, 0.1, -0.05), (1, 0, 0))}, "'block-0' is held"),
        ({"block-1": ((0.1, 0, 0), (1, 0, 0)), 1: ((0.1, 0, 0), (1, 0, 0))}, "twice"),
    ):
        with pytest.raises(lm.errors.InputError, match=said):
            lm.build.with_potential_cracks(block, planes, STRONG)
    stack = [box((0, 0, k), (1, 1, k + 1)) for k in range(3)]
    named = lm.Assembly.from_polyhedra(stack, joint=STRONG, fixed=[0], names=["base", "u", "u-a"])
    with pytest.raises(lm.errors.InputError, match="'u-a' is used more than once"):
        lm.build.with_potential_cracks(named, {"u": ((0.5, 0.5, 1.5), (1, 0, 0))}, STRONG)
    with pytest.raises(lm.errors.InputError, match="unit_cracks must be the law"):
        wall(unit_cracks=True)


def test_a_cracked_wall_turned_is_the_same_and_runs_in_the_dem(tmp_path):
    cut = wall(unit_cracks=lm.Joint(40.0, cohesion=2e3, tensile_strength=1e3))
    turned = cut.transformed([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    one = lm.limit_analysis(cut, lm.Loads.horizontal(cut)).collapse_multiplier
    other = lm.limit_analysis(turned, lm.Loads.horizontal(turned, (0, 1, 0))).collapse_multiplier
    assert other == pytest.approx(one, rel=1e-6)
    assert dem.simulate(cut, dem.Settle(), contact_points=(2, 2)).status == "finished"
    lm.formats.write_json(tmp_path / "cut.json", cut)
    again, _ = lm.formats.read_json(tmp_path / "cut.json")
    assert [i.kind for i in again.interfaces] == [i.kind for i in cut.interfaces]


def test_units_of_every_run_of_a_closed_plan_get_their_crack():
    # a whole stretcher that stayed whole would be longer than three quarters of a unit
    cut = wall(plan="box", return_length=1.6, unit_cracks=STRONG)
    lengths = {}
    for block in cut.blocks:
        if block.axis is not None:
            lengths.setdefault(block.name.split("-")[0], []).append(np.ptp(block.vertices @ block.axis))
    assert set(lengths) == {"facade", "return", "rear"}
    assert max(map(max, lengths.values())) < 0.75 * UNIT[0] * (1.0 + 1e-9)
    # a square tower is the same from both ends: its rear wall has as many cracks as its facade
    of = [sum(i.kind == "crack" and cut.blocks[i.block_a].name.startswith(run) for i in cut.interfaces)
          for run in ("facade", "rear")]
    assert of[0] == of[1] > 0
