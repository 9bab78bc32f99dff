"""Blocks from triangle meshes exactly as drawn: notches and hollows stay, and they collapse as closed forms say."""

import re
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

import limitmason as lm
from limitmason.cli import console, main
from limitmason.errors import InputError
from limitmason.formats import DRAWINGS, meshes, read_solids, read_stones
from limitmason.geometry.polyhedron import mass_properties

trimesh = pytest.importorskip("trimesh")

STEM = [(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (0, 2), (0, 1), (1, 1)]  # a T: x, z


def t_stone():
    triangles = np.array([(0, 1, 7), (1, 2, 7), (2, 3, 4), (2, 4, 7), (4, 5, 7), (5, 6, 7)])
    stone = trimesh.creation.extrude_triangulation(np.array(STEM, dtype=float), triangles, 1.0)
    stone.vertices = stone.vertices[:, [0, 2, 1]] * [1, -1, 1]  # its plane stands upright
    return stone


def ground():
    return trimesh.creation.box(bounds=[(-2, -2, -1), (5, 1, 0)])


@pytest.mark.parametrize("suffix", ["ply", "stl", "off", "obj"])
def test_a_stone_of_several_parts_stands_on_its_stem_in_every_format(tmp_path, suffix):
    path = tmp_path / f"stone.{suffix}"
    trimesh.util.concatenate([ground(), t_stone()]).export(path)
    solids, names = read_solids(path)
    assert names == ["stone-1", "stone-2"]
    wall = lm.Assembly.from_polyhedra(solids, names=names, joint=lm.Joint(60.0), fixed=["stone-1"])
    assert wall.blocks[1].volume == pytest.approx(4.0, rel=1e-6)
    assert len(wall.blocks[1].parts) == 2
    answer = lm.limit_analysis(wall, lm.Loads.horizontal(wall, (1, 0, 0)))
    assert answer.collapse_multiplier == pytest.approx(0.5 / 1.25, rel=1e-5)  # half the stem over the centroid's height


def test_a_folder_of_stones_and_the_command_line(tmp_path, capsys):
    ground().export(tmp_path / "base_1.stl")
    t_stone().export(tmp_path / "tee_2.ply")
    assert read_solids(tmp_path).names == ["base_1", "tee_2"]
    trimesh.util.concatenate([ground(), t_stone()]).apply_scale(1e3).export(tmp_path / "both.stl")
    assert main(["solve", str(tmp_path / "both.stl"), "--friction", "60", "--scale", "0.001", "--tilt", "left"]) == 0
    assert "0.4000" in capsys.readouterr().out
    assert main(["solve", str(tmp_path / "both.stl"), "--friction", "60", "--thickness", "1"]) == 2
    assert "solids have their own" in capsys.readouterr().err
    assert console.DRAWING_FILES == DRAWINGS


def test_a_hollow_stays_and_what_is_no_stone_is_refused(tmp_path):
    hollow = trimesh.creation.box((1, 1, 1))
    hollow.invert()
    trimesh.util.concatenate([trimesh.creation.box((3, 3, 3)), hollow]).export(tmp_path / "hollow.ply")
    solids, names = read_solids(tmp_path / "hollow.ply")
    assert len(names) == 1
    assert lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0)).blocks[0].volume == pytest.approx(26.0)
    trimesh.util.concatenate([ground(), hollow.apply_translation((9, 0, 5))]).export(tmp_path / "out.ply")
    with pytest.raises(InputError, match=r"out-\d: its faces run clockwise"):
        read_solids(tmp_path / "out.ply")
    for name, text in (("no.stl", "no mesh"), ("empty.stl", ""), ("empty.ply", "")):
        (tmp_path / name).write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=f"{name}: not a mesh"):
            read_solids(tmp_path / name)


@pytest.mark.parametrize("suffix", ["ply", "stl", "off", "obj"])
@pytest.mark.parametrize("welded", [False, True])
def test_bricks_that_share_corners_edges_and_faces_are_bodies_of_their_own(tmp_path, suffix, welded):
    places = np.stack(np.meshgrid(*3 * [np.arange(3.0)], indexing="ij"), axis=-1).reshape(-1, 3)
    bricks = trimesh.util.concatenate([trimesh.creation.box(bounds=[p, p + 1.0]) for p in places])
    turn = trimesh.transformations.rotation_matrix(0.7, (0.3, -0.5, 0.8))
    for matrix in (np.eye(4), turn):
        pile = bricks.copy().apply_transform(matrix)
        if welded:
            pile.merge_vertices()
        pile.export(tmp_path / f"pile.{suffix}")
        solids, _ = read_solids(tmp_path / f"pile.{suffix}")
        found = mass_properties([s for s, in solids])
        assert found.volume == pytest.approx(np.ones(27), rel=1e-5)  # files hold 7 digits
        centres = (places + 0.5) @ matrix[:3, :3].T
        assert np.linalg.norm(found.centroid[:, None] - centres, axis=2).min(axis=0) == pytest.approx(0.0, abs=1e-6)


def test_a_stack_of_equal_bricks_in_one_file_overturns_as_the_closed_form_says(tmp_path):
    stack = [trimesh.creation.box(bounds=[(0, 0, k), (0.5, 1, k + 1)]) for k in range(4)]
    trimesh.util.concatenate(stack).export(tmp_path / "stack.stl")
    solids, names = read_solids(tmp_path / "stack.stl")
    wall = lm.Assembly.from_polyhedra(solids, names=names, joint=lm.Joint(60.0), fixed=[names[0]])
    answer = lm.limit_analysis(wall, lm.Loads.horizontal(wall, (1, 0, 0)))
    assert answer.collapse_multiplier == pytest.approx(0.5 / 3.0, rel=1e-6)  # width over height of what is free


def test_what_is_open_stays_open_and_fills_as_much_of_its_hull_wherever_it_lies(tmp_path):
    cube = trimesh.creation.box(bounds=[(0, 0, 0), (1, 1, 1)])
    for k, away in enumerate(((0, 0, 0), (50, 20, 7))):
        trimesh.Trimesh(cube.vertices + away, cube.faces[:-2], process=False).export(tmp_path / f"open_{k}.stl")
        # a pyramid from the centre to the side that is missing, a sixth
        alone = read_stones(tmp_path / f"open_{k}.stl", convexity=0.5).convexity
        assert alone == pytest.approx([5 / 6], rel=1e-5)
        solids, names = read_solids(tmp_path / f"open_{k}.stl")
        with pytest.raises(InputError, match=f"open_{k}.* is open"):
            lm.Assembly.from_polyhedra(solids, names=names, joint=lm.Joint(30.0))
    with pytest.raises(InputError, match="fills 83 % of its convex hull"):
        read_stones(tmp_path)


@pytest.mark.parametrize(("away", "warned"), [(50.0, False), (5.3e6, True)])
def test_a_file_in_single_precision_far_from_its_origin_is_warned_of(tmp_path, away, warned):
    brick = trimesh.creation.box(bounds=[(0, 0, 0), (0.4, 0.2, 0.2)]).apply_translation((0, away, 0))
    brick.export(tmp_path / "brick.stl")
    brick.export(tmp_path / "brick.off")  # written in digits
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read_solids(tmp_path / "brick.off")
        assert not said
        read_solids(tmp_path / "brick.stl")
    assert [bool(re.search(r"rounds corners to 0\.5 m, and 'brick' measures", str(w.message))) for w in said] == (
        [True] if warned else []
    )


def test_notes_that_systems_put_beside_files_are_no_meshes_and_bad_ones_are_named(tmp_path):
    ground().export(tmp_path / "base.stl")
    (tmp_path / "._base.stl").write_bytes(b"\0\5\x16\7")
    with zipfile.ZipFile(tmp_path / "wall.zip", "w") as archive:
        archive.write(tmp_path / "base.stl", "wall/base.stl")
        archive.writestr("__MACOSX/wall/._base.stl", b"\0\5\x16\7")
    assert read_solids(tmp_path).names == read_solids(tmp_path / "wall.zip").names == ["base"]
    (tmp_path / "cut.zip").write_bytes((tmp_path / "wall.zip").read_bytes()[:-30])
    with pytest.raises(InputError, match=r"cut\.zip: cut off, damaged or no archive"):
        read_solids(tmp_path / "cut.zip")
    (tmp_path / "nan.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"nan\.obj: a coordinate is not finite"):
        read_solids(tmp_path / "nan.obj")


def test_files_are_read_by_the_number_at_the_end_of_their_name():
    names = ["w2-10", "w2-009", "w2-8", "stone\u00b2", "stone", "w10-1"]
    assert [p.stem for p in sorted((Path(f"{n}.ply") for n in names), key=meshes._natural)] == [
        "stone", "stone\u00b2", "w10-1", "w2-8", "w2-009", "w2-10",
    ]
