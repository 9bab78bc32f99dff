"""Blocks from triangle meshes exactly as drawn: notches and hollows stay, and they collapse as closed forms say."""

from pathlib import Path

import numpy as np
import pytest

import limitmason as lm
from limitmason.cli import console, main
from limitmason.errors import InputError
from limitmason.formats import DRAWINGS, meshes, read_solids

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


def test_files_are_read_by_the_number_at_the_end_of_their_name():
    names = ["w2-10", "w2-009", "w2-8", "stone\u00b2", "stone", "w10-1"]
    assert [p.stem for p in sorted((Path(f"{n}.ply") for n in names), key=meshes._natural)] == [
        "stone", "stone\u00b2", "w10-1", "w2-8", "w2-009", "w2-10",
    ]
