"""Materials of units: what they refuse, where they go, and that a file returns every number."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from format_models import SIMPLE, make_assembly, turned, write

import limitmason as lm
from limitmason import formats
from limitmason.build.variants import displaced
from limitmason.errors import InputError
from limitmason.mechanics.law import unit_tension

BRICK = {"young_modulus": 16.7e9, "poisson_ratio": 0.15}
STONE = {**BRICK, "cohesion": 2e6, "friction_angle_deg": 40.0}
STRONG = {"cohesion": 2e6, "friction_angle_deg": 40.0}


def test_elastic_constants():
    brick = lm.Material(**BRICK)
    # 9 K G / (3 K + G) = E and (3 K - 2 G) / (2 (3 K + G)) = nu
    k, g = brick.bulk_modulus, brick.shear_modulus
    assert 9.0 * k * g / (3.0 * k + g) == pytest.approx(16.7e9, rel=1e-14)
    assert (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g)) == pytest.approx(0.15, rel=1e-13)
    assert not brick.yields
    assert unit_tension(brick) == math.inf


def test_tension_ends_at_the_apex_of_the_cone():
    apex = 2e6 / math.tan(math.radians(40.0))
    assert unit_tension(lm.Material(**STONE)) == pytest.approx(apex)
    assert unit_tension(lm.Material(**STONE, tensile_strength=1e6)) == 1e6
    assert unit_tension(lm.Material(**STONE, tensile_strength=9e6)) == pytest.approx(apex)
    assert unit_tension(lm.Material(**{**STONE, "friction_angle_deg": 0.0})) == math.inf
    assert lm.Material(**{**STONE, "friction_angle_deg": 0.0}).yields


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"young_modulus": 0.0}, "young_modulus"),
        ({"young_modulus": float("inf")}, "young_modulus"),
        ({"young_modulus": "16.7e9"}, "young_modulus"),
        ({"young_modulus": None}, "young_modulus"),
        ({"poisson_ratio": 0.5}, "poisson_ratio.*0.5"),
        ({"poisson_ratio": 0.7}, "poisson_ratio"),
        ({"poisson_ratio": -1.0}, "poisson_ratio"),
        ({"poisson_ratio": float("nan")}, "poisson_ratio"),
        ({"density": -2000.0}, "density"),
        ({"cohesion": 1e6}, "friction_angle_deg"),
        ({"friction_angle_deg": 30.0}, "cohesion"),
        ({"cohesion": 1e6, "friction_angle_deg": 90.0}, "friction_angle_deg"),
        ({"cohesion": -1e6, "friction_angle_deg": 30.0}, "cohesion"),
        ({"cohesion": 1e6, "friction_angle_deg": 30.0, "dilatancy_angle_deg": 31.0}, "dilatancy_angle_deg"),
        ({"tensile_strength": 1e6}, "tensile_strength"),
        ({"tensile_strength": 0.0}, "tensile_strength needs cohesion"),
        ({"dilatancy_angle_deg": 5.0}, "dilatancy_angle_deg"),
        ({"tensile_energy": 12.0}, "tensile_energy needs tensile_strength"),
        ({"tensile_strength": 1e5, "tensile_energy": 0.0}, "tensile_energy must be positive"),
        ({"tensile_strength": 0.0, "tensile_energy": 12.0}, "tensile_strength must be positive"),
        ({"compressive_strength": 1e6}, "compressive_energy"),
        ({"compressive_energy": 1e3}, "compressive_strength"),
        ({**STRONG, "compressive_strength": 1e6, "compressive_energy": 1e3}, "do not go with cohesion"),
        ({**STRONG, "tensile_strength": 1e5, "tensile_energy": 12.0}, "do not go with cohesion"),
    ],
)
def test_wrong_values_are_refused_by_name(fields, message):
    with pytest.raises(InputError, match=message):
        lm.Material(**{**BRICK, **fields})


def test_error_carries_the_name():
    with pytest.raises(ValueError, match="material 'tuff'.*poisson_ratio"):
        lm.Material(**{**BRICK, "poisson_ratio": 0.6}, name="tuff")


@pytest.mark.parametrize(
    "fields, word",
    [
        ({"young_modulus": 16.7}, "GPa"),
        ({**STONE, "cohesion": 2.0}, "MPa"),
        ({**STONE, "friction_angle_deg": 0.7}, "radians"),
    ],
)
def test_other_units_are_suspected(fields, word):
    with pytest.warns(lm.PlausibilityWarning, match=word):
        lm.Material(**{**BRICK, **fields})


def test_a_material_gives_the_block_its_density_and_keeps_it_without():
    wall = make_assembly()
    before = wall.weights
    assert np.array_equal(wall.with_material(lm.Material(**BRICK)).weights, before)
    heavy = wall.with_material(lm.Material(**BRICK, density=2500.0), blocks=["pier"])
    k = wall.block_index("pier")
    assert heavy.blocks[k].density == 2500.0
    assert heavy.blocks[k].material is not None
    assert all(b.material is None for i, b in enumerate(heavy.blocks) if i != k)


def test_the_recipe_states_the_density_of_the_units_or_none():
    """It went on stating that of before, also in the file of the model."""
    wall = lm.build.wall(length=1.2, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(35.0), density=2000.0)
    heavy = lm.Material(**BRICK, density=2500.0)
    assert wall.with_material(lm.Material(**BRICK)).recipe == wall.recipe
    assert wall.with_material(heavy).recipe == wall.recipe | {"density": 2500.0}
    assert wall.with_material(heavy, blocks=["base"]).recipe == wall.recipe
    mixed = wall.with_material(heavy, blocks=["facade-01-01"]).recipe
    assert mixed == {k: v for k, v in wall.recipe.items() if k != "density"}


def test_a_block_without_density_is_refused_by_name():
    wall = make_assembly()
    light = replace(wall, blocks=tuple(replace(b, density=0.0) if b.name == "pier" else b for b in wall.blocks))
    for density in (None, 0.0):
        with pytest.raises(ValueError, match="'pier' has no density.*density="):
            light.with_material(lm.Material(**BRICK, density=density), blocks=["pier"])
    assert light.with_material(lm.Material(**BRICK, density=1800.0)).blocks[light.block_index("pier")].density == 1800.0


def test_a_block_refuses_fracture_energies_by_name():
    solid = lm.Material(**BRICK, tensile_strength=1e5, tensile_energy=12.0)
    with pytest.raises(InputError, match="block 'pier': units yield by cohesion .* limitmason.continuum"):
        make_assembly().with_material(solid, blocks=["pier"])


@pytest.mark.parametrize(
    "given, options, message",
    [
        ({"nowhere": lm.Material(**BRICK)}, {}, "nowhere"),
        ({"pier": "brick"}, {}, "'pier'.*limitmason.Material"),
        ({"pier": lm.Material(**BRICK)}, {"blocks": ["pier"]}, "table names its blocks"),
        (lm.Material(**BRICK), {"blocks": "pier"}, "list of block names"),
    ],
)
def test_wrong_assignment(given, options, message):
    with pytest.raises(ValueError, match=message):
        make_assembly().with_material(given, **options)


def test_a_turned_or_renumbered_copy_keeps_the_material():
    stone = lm.Material(**STONE, tensile_strength=3e5)
    wall = make_assembly().with_material(stone, blocks=["pier"])
    for copy in (turned(wall), wall.renumbered([2, 0, 1]), displaced(wall, np.zeros((3, 6)))):
        assert [b.name for b in copy.blocks if b.material == stone] == ["pier"]


def test_a_file_returns_every_number(tmp_path):
    stone = lm.Material(
        **{**STONE, "poisson_ratio": 1 / 7}, tensile_strength=1e5 * (0.1 + 0.2), density=2345.6, name="stone"
    )
    wall = make_assembly().with_material({"pier": stone, "ground": lm.Material(**BRICK)})
    formats.write_json(tmp_path / "m.json", wall)
    back = formats.read_json(tmp_path / "m.json").assembly
    assert [b.material for b in back.blocks] == [b.material for b in wall.blocks]
    assert [b.density for b in back.blocks] == [b.density for b in wall.blocks]


def test_a_typed_file_gives_one_material_to_all_blocks(tmp_path):
    simple = {k: v for k, v in SIMPLE.items() if k != "density"}
    path = write(tmp_path / "m.json", {**simple, "material": {**BRICK, "density": 1900}})
    assembly = formats.read_json(path).assembly
    assert {b.density for b in assembly.blocks} == {1900.0}
    assert {b.material for b in assembly.blocks} == {lm.Material(**BRICK, density=1900)}
    # a density of the file's own goes first
    path = write(tmp_path / "m.json", {**simple, "density": 2100, "material": {**BRICK, "density": 1900}})
    assert {b.density for b in formats.read_json(path).assembly.blocks} == {2100.0}


@pytest.mark.parametrize(
    "change, message",
    [
        ({"material": {**BRICK, "poisson_ratio": 0.5}}, "material.*poisson_ratio"),
        ({"material": {"young_modulus": 1e9}}, "poisson_ratio.*missing"),
        ({"material": {**BRICK, "cohesive": 1}}, "cohesive"),
    ],
)
def test_a_wrong_entry_is_named_with_its_file(tmp_path, change, message):
    path = write(tmp_path / "m.json", {**SIMPLE, **change})
    with pytest.raises(ValueError, match=f"{path.name}.*{message}"):
        formats.read_json(path)


def test_an_unknown_material_of_a_block_is_named(tmp_path):
    path = tmp_path / "m.json"
    formats.write_json(path, make_assembly().with_material(lm.Material(**BRICK, name="clay")))
    document = json.loads(path.read_text())
    document["blocks"][1]["material"] = "mud"
    path.write_text(json.dumps(document))
    with pytest.raises(ValueError, match="no material 'mud'"):
        formats.read_json(path)
