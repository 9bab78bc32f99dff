"""Vaults, domes and towers: volumes in closed form, symmetry, published thickness of a dome; fill as a load."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import trapezoid
from wall_checks import deepest_overlap, parts, volume

import mechanisms
from limitmason import Joint, Loads, build, limit_analysis
from limitmason.errors import InputError, NotApplicable

JOINT = Joint(35.0)


def multiplier(assembly, direction):
    answer = limit_analysis(assembly, Loads.horizontal(assembly, direction))
    assert answer.status == "solved"
    return answer.collapse_multiplier


def sector(radius, thickness, voussoirs, angle=math.pi):
    """Areas of the voussoirs of an arch: half sin(beta) (Ro^2 - Ri^2)."""
    return 0.5 * math.sin(angle / voussoirs) * ((radius + thickness / 2) ** 2 - (radius - thickness / 2) ** 2)


def test_barrel_is_the_arch_across_and_weaker_along():
    shape = {"radius": 2.0, "thickness": 0.4, "voussoirs": 11}
    barrel = build.vault(length=1.6, unit_length=0.5, joint=JOINT, **shape)
    arch = build.arch(width=1.6, joint=JOINT, **shape)
    free = ("base-left", "base-right")
    assert volume(barrel, without=free) == pytest.approx(11 * sector(2.0, 0.4, 11) * 1.6, rel=1e-12)
    assert multiplier(barrel, (1, 0, 0)) == pytest.approx(multiplier(arch, (1, 0, 0)), abs=1e-6)
    assert multiplier(barrel, (0, 1, 0)) < multiplier(arch, (0, 1, 0)) - 0.01
    # whole and half pieces in turn; the last piece joins its neighbour where it would be short
    assert [n for n in (b.name for b in barrel.blocks) if n.startswith("voussoir-01")][-1] == "voussoir-01-03"


@pytest.mark.slow
@pytest.mark.parametrize("voussoirs", [6, 7])
def test_groin_vault_is_closed_and_the_same_from_four_sides(voussoirs):
    vault = build.vault(shape="groin", unit_length=0.6, radius=2.0, thickness=0.4, voussoirs=voussoirs, joint=JOINT)
    # a prism between a groin, y = |x|, and y = a has the volume A (a - |x|) with its centroid's x; the keystone halves
    inside, outside, beta = 1.8, 2.2, math.pi / voussoirs
    edges = -0.5 * math.pi + beta * np.arange(voussoirs + 1)
    total = 0.0
    for low, high in pairwise(edges):
        ring = [
            (r * math.sin(t), r * math.cos(t))
            for r, t in ((inside, low), (outside, low), (outside, high), (inside, high))
        ]
        halves = [[(max(s * x, 0.0), z) for x, z in ring] for s in (1, -1)] if low < -1e-9 < 1e-9 < high else [ring]
        for polygon in halves:
            if low < -1e-9 < 1e-9 < high:  # symmetric about x = 0: half the area, bounded by the axis
                top, bottom = outside * math.cos(high), inside * math.cos(high)
                polygon = [
                    (0.0, bottom),
                    (0.0, top),
                    (outside * math.sin(high), top),
                    (inside * math.sin(high), bottom),
                ]
            x, z = np.abs([p[0] for p in polygon]), np.array([p[1] for p in polygon])
            cross = x * np.roll(z, -1) - np.roll(x, -1) * z
            area, first = 0.5 * cross.sum(), (cross * (x + np.roll(x, -1))).sum() / 6.0
            total += abs(area) * (2.2 + 0.4) - abs(first)
    held = [b.name for b, fixed in zip(vault.blocks, vault.fixed, strict=True) if fixed]
    assert volume(vault, without=held) == pytest.approx(4 * total, rel=1e-9)
    assert vault.recipe["bay"] == pytest.approx(5.2)
    along = multiplier(vault, (1, 0, 0))
    for direction in ((0, 1, 0), (-1, 0, 0), (0, -1, 0)):
        assert multiplier(vault, direction) == pytest.approx(along, abs=1e-6)


@pytest.mark.slow
def test_dome_fills_its_shell_and_turns_without_change():
    dome = build.dome(radius=5.0, thickness=0.5, courses=8, lunes=12, joint=Joint(50.0))
    assert dome.n_blocks == 1 + 8 * 12 + 1
    assert multiplier(dome, (1, 0, 0)) == pytest.approx(multiplier(dome, (0, 1, 0)), abs=1e-6)
    fine = build.dome(
        radius=5.0, thickness=0.5, courses=20, lunes=48, opening_deg=20.0, springing_deg=80.0, joint=JOINT
    )
    shell = 2.0 * math.pi / 3.0 * (5.25**3 - 4.75**3) * (math.cos(math.radians(20.0)) - math.cos(math.radians(80.0)))
    assert volume(fine) == pytest.approx(shell, rel=5e-3)
    assert volume(fine) < shell
    assert "keystone" not in {b.name for b in fine.blocks}


@pytest.mark.slow
def test_hemisphere_stands_from_the_thickness_that_heyman_gives():
    # 4.2 % of the radius (Heyman 1967); meridional cracks from springing to crown are the joints here
    def stands(share):
        dome = build.dome(radius=5.0, thickness=5.0 * share, courses=12, lunes=16, joint=Joint(50.0))
        return limit_analysis(dome, Loads.horizontal(dome)).status == "solved"

    assert stands(0.045)
    assert not stands(0.040)


@pytest.mark.exact
@pytest.mark.slow
def test_tower_is_closed_bonded_and_weaker_at_its_door():
    shape = {
        "length": 1.6,
        "courses": 8,
        "unit": (0.4, 0.2, 0.2),
        "joint": Joint(33.0),
        "plan": "box",
        "return_length": 1.6,
    }
    tower = build.wall(**shape)
    low, high, _ = parts(tower)
    assert deepest_overlap(low, high) <= 1e-12
    assert volume(tower) == pytest.approx((1.6**2 - 1.2**2) * 1.6, rel=1e-12)
    assert tower.recipe["smallest_overlap"] == pytest.approx(0.2)
    assert multiplier(tower, (1, 0, 0)) == pytest.approx(multiplier(tower, (-1, 0, 0)), abs=1e-6)
    door = build.wall(
        **shape, openings=[{"x": 0.6, "z": 0.0, "width": 0.4, "height": 0.8, "lintel": 0.2, "bearing": 0.2}]
    )
    assert multiplier(door, (1, 0, 0)) < multiplier(tower, (1, 0, 0))
    beams = build.wall(**shape, top_beam=0.2, beam_over="all")
    assert {"beam", "beam-left", "beam-right", "beam-rear"} <= {b.name for b in beams.blocks}
    low, high, _ = parts(beams)
    assert deepest_overlap(low, high) <= 1e-12
    with pytest.raises(NotApplicable, match="closed plan"):
        mechanisms.Facade.from_assembly(tower, Loads.horizontal(tower, (0, -1, 0)))


def test_fill_weighs_what_lies_between_its_level_and_the_extrados():
    shape = {"radius": 2.0, "thickness": 0.4, "voussoirs": 8}
    barrel = build.vault(length=1.5, unit_length=0.5, joint=JOINT, **shape)
    theta = -0.5 * math.pi + math.pi / 8 * np.arange(9)
    x, z = 2.2 * np.sin(theta), 2.2 * np.cos(theta)
    for level in (2.5, 1.0):
        depth = 0.0
        for k in range(8):  # each extrados is a chord; below the level only
            s = np.linspace(0.0, 1.0, 20_001)
            height = np.clip(level - (z[k] + s * (z[k + 1] - z[k])), 0.0, None)
            depth += trapezoid(height, x[k] + s * (x[k + 1] - x[k]))
        own = Loads.weight(barrel)
        fill = own.with_backfill(barrel, level, 1600.0).dead - own.dead
        assert -fill[:, 2].sum() == pytest.approx(depth * 1.5 * 1600.0 * 9.81, rel=1e-7)
        assert np.abs(fill[:, :2]).max() == 0.0
        # balanced about the middle: the moment of all fill about the axis of the vault is none
        moment = fill[:, 3:].sum(axis=0) + np.cross(barrel.centroids, fill[:, :3]).sum(axis=0)
        assert moment[1] == pytest.approx(0.0, abs=1e-9 * np.abs(fill).sum())
    # pressure at rest on one half: K rho g (h1^2 - h2^2) / 2 per metre
    pressed = Loads.weight(barrel).with_backfill(barrel, 2.5, 1600.0, lateral=0.4).dead
    right = [i for i, c in enumerate(barrel.centroids) if c[0] > 0]
    assert -pressed[right, 0].sum() == pytest.approx(0.4 * 1600.0 * 9.81 * (2.5**2 - 0.3**2) / 2.0 * 1.5, rel=1e-9)


@pytest.mark.exact
@pytest.mark.parametrize("lateral", [0.0, 0.4])
def test_a_barrel_under_fill_and_an_axle_is_the_arch_of_its_section(lateral):
    """Nothing differs along y: in space, of whole or lapping stones, the multiplier is that of the plane arch.

    The fill presses inwards with K times the weight of what lies beside a face, on its height (Rankine's thrust).
    """
    shape = {"radius": 1.0, "thickness": 0.12, "voussoirs": 9, "angle_deg": 150.0, "joint": Joint(45.0)}
    plane = build.arch(width=0.6, **shape)
    top, unit_weight = float(plane.blocks[6].bounds[1][2]) + 0.1, 1800.0 * 9.81

    def loaded(assembly):
        fill = Loads.weight(assembly).with_backfill(assembly, top, 1800.0, lateral=lateral)
        return fill.with_axle(assembly, 0.3, 1e4, level=top)

    wanted = limit_analysis(plane, loaded(plane)).collapse_multiplier
    for length in (0.6, 0.25):
        barrel = build.vault(length=0.6, unit_length=length, **shape)
        assert limit_analysis(barrel, loaded(barrel)).collapse_multiplier == pytest.approx(wanted, rel=1e-6)
    assert limit_analysis(plane, loaded(plane), in_plane=False).collapse_multiplier == pytest.approx(wanted, rel=1e-6)
    # extrados of the first voussoir, from a springing upwards
    angles = np.deg2rad([75.0, 75.0 - 150.0 / 9.0])
    height = 1.06 * np.cos(angles) - math.cos(angles[0])
    thrust = lateral * unit_weight * 0.6 * (height[1] - height[0]) * (top - height.mean())
    assert loaded(plane).dead[2, 0] == pytest.approx(thrust, rel=1e-9, abs=1e-9)


def test_fill_on_a_flat_top_is_its_weight_and_covered_faces_carry_none():
    wall = build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT)
    fill = Loads.weight(wall).with_backfill(wall, 1.0, 1500.0)
    added = -(fill.dead - Loads.weight(wall).dead)[:, 2]
    assert added.sum() == pytest.approx(1500.0 * 9.81 * 0.4 * 1.2 * 0.2, rel=1e-12)
    assert {wall.blocks[i].name[:9] for i in np.flatnonzero(added > 1e-6)} == {"facade-03"}
    with pytest.raises(InputError, match="lies on no face"):
        Loads.weight(wall).with_backfill(wall, 0.1, 1500.0)
    with pytest.raises(ValueError, match="on no face of these blocks: .* or they are covered"):
        Loads.weight(wall).with_backfill(wall, 1.0, 1500.0, blocks=["facade-01-02"])
    with pytest.raises(InputError, match="every face that the fill lies on is level"):
        Loads.weight(wall).with_backfill(wall, 1.0, 1500.0, lateral=0.4)


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: build.vault(unit_length=0.5, radius=2, thickness=0.4, voussoirs=7, joint=JOINT), "needs its length"),
        (
            lambda: build.vault(
                shape="groin", length=1.0, unit_length=0.5, radius=2, thickness=0.4, voussoirs=7, joint=JOINT
            ),
            "bay",
        ),
        (lambda: build.vault(shape="fan", unit_length=0.5, radius=2, thickness=0.4, voussoirs=7, joint=JOINT), "shape"),
        (lambda: build.dome(radius=2, thickness=0.4, courses=5, lunes=3, joint=JOINT), "lunes"),
        (lambda: build.dome(radius=2, thickness=0.4, courses=5, lunes=8, springing_deg=100, joint=JOINT), "springing"),
        (
            lambda: build.wall(length=1.6, courses=2, unit=(0.4, 0.2, 0.2), joint=JOINT, plan="box", return_length=0.4),
            "room",
        ),
    ],
)
def test_wrong_input_is_named(call, match):
    with pytest.raises(InputError, match=match):
        call()
