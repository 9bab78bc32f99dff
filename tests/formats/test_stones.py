"""Scanned stones: a wall of bricks with mortar gaps grows back to the wall without them; rubble comes in whole."""

from pathlib import Path

import numpy as np
import pytest

import limitmason as lm
from limitmason import Joint, build
from limitmason.errors import InputError
from limitmason.formats import Stones, read_stones
from limitmason.geometry import box
from limitmason.geometry.growing import grown

trimesh = pytest.importorskip("trimesh")

WALL = build.wall(length=0.8, courses=4, unit=(0.4, 0.2, 0.2), joint=Joint(33.0))
N = WALL.n_blocks - 1
RUBBLE = Path(__file__).resolve().parents[2] / "examples" / "rubble_leaf.zip"


def bricks(mortar):
    """Bricks of a wall, each smaller by half a mortar joint all round."""
    middles = [(b.bounds[0], b.bounds[1]) for b in WALL.blocks[1:]]
    return [box(low + 0.5 * mortar, high - 0.5 * mortar) for low, high in middles]


def turn(axis, angle):
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def test_bricks_grow_over_their_mortar_to_the_joints_of_the_wall():
    ground = WALL.blocks[0].parts[0]
    stones = Stones([b.vertices for b in bricks(0.01)], [b.name for b in WALL.blocks[1:]], [1.0] * N)
    met = stones.grown(0.012, {"base": ground})
    between = [g.gap for g in met.gaps if g.j < N]
    assert between == pytest.approx([0.01] * len(between), abs=1e-9)
    assert [g.gap for g in met.gaps if g.j == N] == pytest.approx([0.005] * 2, abs=1e-9)
    wall = met.assembly(joint=Joint(33.0), density=2000.0, fixed=["base"])
    names = lambda a: sorted(  # noqa: E731
        tuple(sorted((a.blocks[i.block_a].name, a.blocks[i.block_b].name))) for i in a.interfaces
    )
    assert names(wall) == names(WALL)
    # faces in joints lie at the joint's middle, free faces where the brick ends
    for i in wall.interfaces:
        assert np.abs(i.polygon @ i.normal - np.round(i.polygon @ i.normal / 0.2) * 0.2).max() < 1e-9
    assert (wall.blocks[-1].parts[0].vertices == ground.vertices).all()
    low = np.min([b.bounds[0] for b in wall.blocks[:-1]], axis=0)
    assert low == pytest.approx([0.005, 0.005, 0.0], abs=1e-9)
    assert f"{N} stones" in str(met)
    assert "volume" in str(met)


def test_turned_and_renumbered_stones_grow_alike():
    stones = [b.vertices for b in bricks(0.01)]
    rotation = turn((1, 2, 3), 0.7)
    plain = grown(stones, 0.012)
    other = grown([s @ rotation.T + [3.0, -1.0, 2.0] for s in reversed(stones)], 0.012)
    assert other.after[::-1] == pytest.approx(plain.after, rel=1e-9)
    assert sorted(g.gap for g in other.gaps) == pytest.approx(sorted(g.gap for g in plain.gaps), abs=1e-9)


def test_stones_that_overlap_are_cut_in_the_middle_and_named():
    a, b = box((0, 0, 0), (1.02, 1, 1)), box((1.0, 0, 0), (2, 1, 1))
    met = Stones([a.vertices, b.vertices], ["left", "right"], [1.0, 1.0]).grown(0.01)
    assert met.gaps[0].gap == pytest.approx(-0.02, abs=1e-9)
    assert met.after == pytest.approx([1.01, 0.99], rel=1e-9)
    assert "left and right overlapped by 20 mm" in str(met)
    lost = Stones([a.vertices, a.vertices * 0.5 + 0.1], ["left", "inside"], [1.0, 1.0])
    assert lost.grown(0.01).gaps[0].gap < -0.4  # a stone in a stone is cut too, and the text says by how much


def test_a_stone_far_from_others_stays_as_it_is():
    stones = [box((0, 0, 0), (1, 1, 1)).vertices, box((1.5, 0, 0), (2, 1, 1)).vertices]
    met = Stones(stones, ["a", "b"], [1.0, 1.0]).grown(0.1)
    assert met.gaps == ()
    assert met.after == pytest.approx(met.before)
    assert "a meets no other stone" in str(met)


@pytest.mark.parametrize(("up", "order"), [("x", (2, 0, 1)), ("y", (0, 2, 1)), ("z", (0, 1, 2))])
def test_meshes_are_read_turned_and_scaled(tmp_path, up, order):
    size = np.array([0.1, 0.2, 0.3])  # of the stone, z up
    in_file = 1e3 * size[list(order)] if up != "y" else 1e3 * size[[0, 2, 1]]
    trimesh.creation.box(in_file).export(tmp_path / "stone_2.ply")
    trimesh.creation.icosphere(radius=100.0).export(tmp_path / "stone_10.stl")
    stones = read_stones(tmp_path, scale=1e-3, up=up)
    assert stones.names == ["stone_2", "stone_10"]
    assert np.ptp(stones.points[0], axis=0) == pytest.approx(size)
    assert stones.convexity == pytest.approx([1.0, 1.0])


def test_bodies_of_one_file_are_stones_of_their_own(tmp_path):
    one, two = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1)).apply_translation((3, 0, 0))
    trimesh.util.concatenate([one, two]).export(tmp_path / "leaf.obj")
    assert read_stones(tmp_path / "leaf.obj").names == ["leaf-1", "leaf-2"]


def test_what_is_no_convex_stone_is_refused_with_advice(tmp_path):
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    corner = trimesh.creation.extrude_triangulation(outline, triangles, 1.0)
    corner.export(tmp_path / "corner.ply")
    with pytest.raises(InputError, match="corner: fills 86 % of its convex hull, 90 % asked for: split it"):
        read_stones(tmp_path / "corner.ply", convexity=0.9)
    assert read_stones(tmp_path / "corner.ply", convexity=0.8).convexity == pytest.approx([3.0 / 3.5])
    (tmp_path / "notes.ply").write_text("not a mesh", encoding="utf-8")
    with pytest.raises(InputError, match=r"notes\.ply: not a mesh"):
        read_stones(tmp_path / "notes.ply")
    with pytest.raises(InputError, match="no file"):
        read_stones(tmp_path / "empty") if (tmp_path / "empty").mkdir() is None else None
    with pytest.raises(InputError, match="up must be"):
        read_stones(tmp_path, up="w")
    with pytest.raises(InputError, match="up must be"):
        read_stones(tmp_path, up=["z"])


def test_stones_are_held_and_grown_against_what_is_named(tmp_path):
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "cube.ply")
    stones = read_stones(tmp_path / "cube.ply")
    for against in (3, [box((-1, -1, -2), (1, 1, -0.51))]):
        with pytest.raises(InputError, match="against must be a Mapping"):
            stones.grown(0.02, against)
    with pytest.raises(InputError, match=r"against\['ground'\] must be a Solid, got 3"):
        stones.grown(0.02, {"ground": 3})
    met = stones.grown(0.02)
    with pytest.raises(InputError, match=r"write fixed=\['cube'\]"):
        met.assembly(joint=lm.Joint(30.0), density=2000.0, fixed="cube")
    with pytest.raises(InputError, match="names: the stones keep"):
        met.assembly(joint=lm.Joint(30.0), density=2000.0, names=["a"])


@pytest.mark.parametrize("away", [(0, 0, 0), (40, -30, 20)])
def test_how_full_a_stone_is_does_not_hang_on_its_place_nor_on_the_senses_of_its_faces(tmp_path, away):
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    corner = trimesh.creation.extrude_triangulation(outline, triangles, 1.0)
    faces = corner.faces.copy()
    faces[::3] = faces[::3, ::-1]  # as scans are that were cleaned by hand
    trimesh.Trimesh(corner.vertices + away, faces, process=False).export(tmp_path / "corner.ply")
    stones = read_stones(tmp_path / "corner.ply", convexity=0.5)
    assert stones.convexity == pytest.approx([3.0 / 3.5], rel=1e-5)


@pytest.mark.slow
def test_rubble_of_39_scanned_stones_comes_in_whole():
    stones = read_stones(RUBBLE, up="x")
    assert len(stones.names) == 39
    assert stones.names[2] == "stone_2"
    assert min(stones.convexity) > 0.94
    met = stones.grown(0.03, {"ground": box((-0.1, -0.1, -0.1), (1, 0.3, 0))})
    assert all(0 <= g.gap <= 0.03 for g in met.gaps)
    assert (met.moved <= 0.03 + 1e-9).all()
    # no stone reaches across its planes
    for g in met.gaps:
        assert (met.solids[g.i].vertices @ g.normal).max() <= g.offset + 1e-9
        assert (met.solids[g.j].vertices @ g.normal).min() >= g.offset - 1e-9
