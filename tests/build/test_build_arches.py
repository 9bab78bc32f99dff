"""Geometry of built arches and columns, and the minimum thickness of arches, from formulas."""

import json

import numpy as np
import pytest
from thrust_lines import centroid_radius, thinnest

from limitmason import Joint, build

JOINT = Joint(33.0)
# semicircle with radial joints: t/R of the continuous arch, Milankovitch 1907 (0.1075), solved to six digits
MILANKOVITCH = 0.107478


def voussoirs(assembly):
    return [block for block in assembly.blocks if block.name.startswith("voussoir")]


@pytest.mark.parametrize("number", [7, 12, 60])
@pytest.mark.parametrize("angle_deg", [180.0, 120.0, 240.0])
def test_circular_arch_volume_is_its_formula(number, angle_deg):
    arch = build.arch(radius=2.0, thickness=0.3, width=0.5, voussoirs=number, angle_deg=angle_deg, joint=JOINT)
    step = np.radians(angle_deg) / number
    each = 0.5 * 0.5 * np.sin(step) * (2.15**2 - 1.85**2)
    assert [block.volume for block in voussoirs(arch)] == pytest.approx([each] * number)
    # and tends to the volume of the ring, length of the centre line times section
    assert each * number == pytest.approx(2.0 * np.radians(angle_deg) * 0.3 * 0.5, rel=step**2 / 6.0)


def test_arch_has_one_contact_per_joint_and_held_springings():
    arch = build.arch(radius=1.0, thickness=0.12, width=0.4, voussoirs=21, joint=JOINT)
    assert len(arch.interfaces) == 22
    assert sum(i.kind == "base" for i in arch.interfaces) == 2
    assert [b.name for b, f in zip(arch.blocks, arch.fixed, strict=True) if f] == ["base-left", "base-right"]
    assert arch.n_blocks == 23
    for interface in arch.interfaces:
        # every joint is radial: its plane holds the centre, which is the origin for a semicircle
        assert abs(interface.normal @ interface.polygon[0]) < 1e-9
    assert arch.recipe["keystone"] is True
    keystone = arch.blocks[arch.block_index("voussoir-11")]
    assert keystone.centroid[0] == pytest.approx(0.0, abs=1e-12)


def test_arch_by_span_and_rise_equals_arch_by_radius():
    span, rise = 4.0, 1.0
    arch = build.arch(span=span, rise=rise, thickness=0.3, width=0.5, voussoirs=15, joint=JOINT)
    radius = arch.recipe["radius"]
    assert radius == pytest.approx(2.5)  # (2^2 + 1^2) / 2
    same = build.arch(
        radius=radius, angle_deg=arch.recipe["angle_deg"], thickness=0.3, width=0.5, voussoirs=15, joint=JOINT
    )
    assert arch.centroids == pytest.approx(same.centroids)
    assert same.recipe["span"] == pytest.approx(span)
    assert same.recipe["rise"] == pytest.approx(rise)


def test_springing_centres_are_at_the_ends_of_the_span():
    arch = build.arch(span=4.0, rise=1.0, thickness=0.3, width=0.5, voussoirs=15, joint=JOINT)
    base = [i for i in arch.interfaces if i.kind == "base"]
    centres = sorted(i.polygon.mean(axis=0)[0] for i in base)
    assert centres == pytest.approx([-2.0, 2.0])
    assert [i.polygon.mean(axis=0)[2] for i in base] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_pointed_arch_is_symmetric_and_as_high_as_stated():
    arch = build.arch(span=4.0, rise=3.0, thickness=0.3, width=0.5, voussoirs=20, shape="pointed", joint=JOINT)
    assert arch.recipe["radius"] == pytest.approx((2.0**2 + 3.0**2) / 4.0)
    blocks = voussoirs(arch)
    for left, right in zip(blocks, blocks[::-1], strict=True):
        assert left.volume == pytest.approx(right.volume)
        assert left.centroid * [-1, 1, 1] == pytest.approx(right.centroid)
    crown = [i for i in arch.interfaces if abs(i.polygon[:, 0]).max() < 1e-12]
    assert len(crown) == 1
    low, high = crown[0].polygon[:, 2].min(), crown[0].polygon[:, 2].max()
    assert low < 3.0 < high
    assert abs(crown[0].normal[0]) == pytest.approx(1.0)


def test_arch_on_piers():
    arch = build.arch(
        radius=2.0, thickness=0.3, width=0.5, voussoirs=20, pier_height=3.0, pier_width=0.6, pier_courses=5, joint=JOINT
    )
    assert arch.n_blocks == 1 + 2 * 5 + 20
    assert [b.name for b, f in zip(arch.blocks, arch.fixed, strict=True) if f] == ["base"]
    assert arch.blocks[arch.block_index("pier-left-5")].bounds == pytest.approx(
        np.array([[-2.45, 0.0, -0.6], [-1.85, 0.5, 0.0]])
    )
    # two joints per side of five pier blocks and the springing, the base twice, 19 between voussoirs
    assert len(arch.interfaces) == 19 + 2 * (4 + 1) + 2


def test_arch_from_curves_reproduces_the_circular_one():
    theta = np.linspace(-np.pi / 2, np.pi / 2, 13)
    ring = np.column_stack([np.sin(theta), np.cos(theta)])
    drawn = build.arch_from_curves(0.9 * ring, 1.1 * ring, width=0.4, joint=JOINT)
    built = build.arch(radius=1.0, thickness=0.2, width=0.4, voussoirs=12, joint=JOINT)
    assert drawn.centroids == pytest.approx(built.centroids)
    assert json.loads(json.dumps(drawn.recipe))["voussoirs"] == 12


def test_arch_recipe_is_plain_data():
    arch = build.arch(radius=1.0, thickness=0.12, width=0.4, voussoirs=20, density=1900.0, joint=JOINT)
    recipe = json.loads(json.dumps(arch.recipe))
    assert recipe == arch.recipe
    expected = {"kind": "arch", "shape": "circular", "radius": 1.0, "thickness": 0.12, "width": 0.4, "voussoirs": 20}
    assert {key: recipe[key] for key in expected} == expected
    assert recipe["angle_deg"] == pytest.approx(180.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"thickness": -0.1}, "thickness must be positive"),
        ({"thickness": 2.5}, "no intrados"),
        ({"radius": None}, "give radius"),
        ({"span": 2.0}, "give radius"),
        ({"voussoirs": 0}, "voussoirs must be a whole number"),
        ({"angle_deg": 340.0}, "angle_deg"),
        ({"radius": None, "span": 2.0, "rise": 1.0, "angle_deg": 120.0}, "angle_deg goes with radius"),
        ({"shape": "pointed", "radius": None, "span": 2.0, "rise": 1.5, "angle_deg": 180.0}, "not by radius"),
        ({"width": float("inf")}, "width must be a finite number"),
        ({"shape": "ogee"}, "shape must be one of"),
        ({"shape": "pointed"}, "span and rise"),
        ({"shape": "pointed", "radius": None, "span": 2.0, "rise": 0.9}, "rise 0.9 m of a pointed arch"),
        ({"shape": "pointed", "radius": None, "span": 2.0, "rise": 1.5, "voussoirs": 9}, "voussoirs must be even"),
        ({"pier_height": 1.0, "angle_deg": 120.0}, "pier_height"),
        ({"pier_height": 1.0, "pier_width": 0.05}, "pier_width"),
        ({"pier_courses": 3}, "pier_courses is given but pier_height is not"),
    ],
)
def test_arch_errors_name_the_argument(change, message):
    good = {"radius": 1.0, "thickness": 0.12, "width": 0.4, "voussoirs": 20, "joint": JOINT}
    with pytest.raises(ValueError, match=message):
        build.arch(**{**good, **change})


def test_arch_from_curves_names_the_voussoir_whose_joints_cross():
    ring = np.column_stack([np.linspace(-1, 1, 6), np.zeros(6)])
    crossed = ring + [0.0, 0.2]
    crossed[[2, 3]] = crossed[[3, 2]]
    with pytest.raises(ValueError, match="voussoir 3 is not convex"):
        build.arch_from_curves(ring, crossed, width=0.3, joint=JOINT)


# ---- minimum thickness ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["chord", "sector"])
@pytest.mark.parametrize("number", [60, 61, 100, 181])
def test_milankovitch_1907_semicircular_minimum_thickness(number, shape):
    assert thinnest(number, chord=shape == "chord") == pytest.approx(0.1075, abs=3e-4)


def test_minimum_thickness_tends_to_the_continuous_arch_from_below():
    values = [thinnest(n, chord=False) for n in (6, 24, 96, 600)]
    assert all(value < MILANKOVITCH for value in values)
    assert values[-1] == pytest.approx(MILANKOVITCH, abs=2e-6)


@pytest.mark.exact
def test_lever_arms_of_the_thrust_line_are_those_of_the_blocks_that_arch_builds():
    number, thickness = 12, 0.15
    arch = build.arch(radius=1.0, thickness=thickness, width=0.4, voussoirs=number, joint=JOINT)
    centroids = np.array([block.centroid for block in voussoirs(arch)])
    stated = centroid_radius(thickness, np.pi / number, chord=True)
    assert np.hypot(centroids[:, 0], centroids[:, 2]) == pytest.approx(stated, rel=1e-12)
    # a sector is the limit of many thin plane-faced slices, each weighing the same
    slices = 4000
    offsets = (np.arange(slices) + 0.5) / slices * np.pi / number - np.pi / number / 2
    mean = centroid_radius(thickness, np.pi / number / slices, chord=True) * np.cos(offsets).mean()
    assert centroid_radius(thickness, np.pi / number, chord=False) == pytest.approx(mean, rel=1e-7)


def test_minimum_thickness_falls_with_the_embrace():
    falling = [thinnest(40, angle) for angle in (180.0, 150.0, 120.0, 90.0)]
    assert falling == sorted(falling, reverse=True)
    assert falling[-1] < 0.02


# ---- column ---------------------------------------------------------------------------------------------------------


def test_column_is_a_stack_on_a_held_base():
    column = build.column(width=0.3, depth=0.2, unit_height=0.1, courses=5, joint=JOINT)
    assert [b.name for b in column.blocks] == ["base", *(f"column-{k}" for k in range(1, 6))]
    assert len(column.interfaces) == 5
    assert column.blocks[3].bounds == pytest.approx(np.array([[0, 0, 0.2], [0.3, 0.2, 0.3]]))
    assert sum(b.volume for b in column.blocks[1:]) == pytest.approx(0.3 * 0.2 * 0.5)
    by_height = build.column(width=0.3, depth=0.2, height=0.5, courses=5, joint=JOINT)
    assert by_height.centroids == pytest.approx(column.centroids)
    assert json.loads(json.dumps(column.recipe)) == column.recipe
    single = build.column(width=0.3, depth=0.2, height=1.0, courses=1, base="course", joint=JOINT)
    assert single.n_blocks == 1
    assert single.fixed.all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 0.0}, "width"),
        ({"unit_height": None}, "unit_height is needed"),
        ({"courses": None, "height": 0.33}, "height 0.33 m is not a whole number"),
        ({"base": "rock"}, "base must be one of"),
        ({"base_margin": -1.0}, "base_margin"),
        ({"base_margin": "half"}, "base_margin must be a finite number, got 'half'"),
    ],
)
def test_column_errors_name_the_argument(change, message):
    good = {"width": 0.3, "depth": 0.2, "unit_height": 0.1, "courses": 5, "joint": JOINT}
    with pytest.raises(ValueError, match=message):
        build.column(**{**good, **change})
