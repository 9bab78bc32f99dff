"""The fingerprint of a model: every field of blocks, joints, supports, ties and materials tells, labels do not."""

from dataclasses import fields, replace

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.errors import InputError
from limitmason.model.material import FRACTURE

JOINT = lm.Joint(33.0, normal_stiffness=1e9, shear_stiffness=5e8)
STONE = lm.Material(young_modulus=1e9, poisson_ratio=0.2)


def stack(half=0.2, joint=JOINT, density=2000.0):
    ends = [(-0.2, 0.0, 0.5), (0.0, 0.3, half), (0.3, 0.6, half)]
    outlines = [[(-w, low), (w, low), (w, high), (-w, high)] for low, high, w in ends]
    return lm.Assembly.from_polygons(
        outlines, thickness=0.3, joint=joint, names=["ground", "a", "top"], fixed=["ground"], density=density
    )


def tied(**options):
    wall = stack()
    return wall.with_ties([lm.Tie("top", (0, 0.1, 0.5), "ground", (0, 0.1, -0.1), **options)])


def all_changes():
    """A model and what differs from it in one field, in words."""
    wall = stack()
    yield stack(0.05), wall, "block 'a' has another shape"
    yield stack(density=500.0), wall, r"block 'ground' has another density now \(500\), not 2000"
    yield wall.with_supports([lm.Support("a", dofs=["y"])]), wall, "block 'a' has another support"
    yield wall.with_material(STONE), wall, "block 'ground' has another material's young_modulus"
    stiffer = replace(STONE, young_modulus=9e9)
    yield wall.with_material(stiffer), wall.with_material(STONE), r"young_modulus now \(9e\+09\), not 1e\+09"
    yield wall.with_interfaces(wall.interfaces[:1]), wall, "1 joints and had 2"
    pulled = wall.with_contact_ends_pulled_in(0.01)
    yield pulled, wall, "the joint between 'ground' and 'a' has another polygon"
    for field, value in (
        ("friction_angle_deg", 20.0), ("dilatancy_angle_deg", 5.0), ("cohesion", 5e3), ("tensile_strength", 1e3),
        ("compressive_strength", 1e7), ("normal_stiffness", 2e9), ("shear_stiffness", 1e9), ("residual_cohesion", 0.0),
        ("residual_friction_angle_deg", 20.0), ("residual_tensile_strength", 0.0), ("lost_by", "nothing"),
        ("unloading", "secant"),
    ):
        other = wall.with_joints({("a", "top"): replace(JOINT, **{field: value})})
        yield other, wall, f"the joint between 'a' and 'top' has another {field}"
    strong = replace(JOINT, cohesion=1e4, tensile_strength=1e4)
    for field in ("fracture_energy_tension", "fracture_energy_shear"):
        base = stack(joint=strong)
        yield base.with_joints({("a", "top"): replace(strong, **{field: 10.0})}), base, f"another {field}"
    one = tied(yield_force=1e4, area=1e-4, modulus=2e11)
    yield wall, one, "0 ties and had 1"
    yield tied(yield_force=1e4, area=1e-4, modulus=1e9), one, "the tie between 'top' and 'ground' has another stiffness"
    yield tied(yield_force=5.0, area=1e-4, modulus=2e11), one, "another strength"


@pytest.mark.parametrize(("now", "then", "words"), list(all_changes()), ids=lambda v: v if isinstance(v, str) else "")
def test_every_field_of_a_model_is_told_by_name(now, then, words):
    with pytest.raises(InputError, match=f"the state is of another model .*{words}"):
        now.fingerprint.check_same(then.fingerprint, "the state")
    assert now.fingerprint.digest != then.fingerprint.digest


def test_no_field_of_a_joint_or_material_is_left_out():
    kept = set(stack().fingerprint.arrays)
    # blocks have no fracture energies
    # terms have a column for each of their numbers where a joint has one: tests/dem/test_joint_terms.py
    of_joints, of_materials = ("joint: ", {"name", "terms"}), ("block: material's ", {"name", *FRACTURE})
    for kind, (prefix, apart) in ((lm.Joint, of_joints), (lm.Material, of_materials)):
        assert {f.name for f in fields(kind)} - {name.removeprefix(prefix) for name in kept} == apart


def test_a_model_made_twice_read_from_a_file_and_relabelled_is_the_same(tmp_path):
    wall = stack().with_material(STONE)
    lm.formats.write_json(tmp_path / "wall.json", wall)
    again = lm.formats.read_json(tmp_path / "wall.json")[0]
    named = wall.with_joints(lambda joint: replace(joint, name="mortar"))
    for other in (stack().with_material(STONE), again, named):
        assert other.fingerprint.difference(wall.fingerprint) == ""
        assert other.fingerprint.digest == wall.fingerprint.digest


def test_rounding_of_another_machine_is_no_other_model_and_a_tenth_of_a_micrometre_is():
    wall = stack()
    for move, same in ((1e-14, True), (1e-7, False)):
        other = wall.transformed(np.eye(3), (move, 0.0, 0.0))
        assert (other.fingerprint.difference(wall.fingerprint) == "") is same


REST = dem.Settle(tolerance=1e-5)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (stack(density=500.0), "block 'ground' has another density"),
        (stack(0.05), "block 'a' has another shape"),
        (stack(joint=replace(JOINT, cohesion=1e3)), "another cohesion"),
        (stack().with_material(STONE), "another material"),
        (tied(yield_force=1e4, stiffness=1e6), "1 ties and had 0"),
    ],
)
def test_the_dem_goes_on_with_its_own_model_only(tmp_path, other, words):
    wall = stack()
    rest = dem.simulate(wall, REST)
    rest.save(tmp_path / "rest.npz")
    for call in (
        lambda: dem.simulate(other, REST, start=rest),
        lambda: dem.simulate(other, REST, start=rest.state),
        lambda: dem.History.load(tmp_path / "rest.npz", other),
    ):
        with pytest.raises(InputError, match=words):
            call()
    on = dem.simulate(stack(), REST, start=dem.History.load(tmp_path / "rest.npz", stack()))
    assert on.status == "finished"
