"""Files are written whole or not at all, by every writer, and read with errors that name them."""

import json
import resource
import time

import numpy as np
import pytest
from processes import ended, ready, said, together

import dem
import limitmason as lm
from dem.stages.resuming import check_checkpoint
from limitmason.errors import InputError
from limitmason.figures.page import write_page
from limitmason.formats.meshes import read_solids
from limitmason.storage import files
from limitmason.storage.csv_table import write_table
from limitmason.storage.measured_table import read_measured
from limitmason.study.memo import Memo
from limitmason.study.run_fingerprint import fingerprint


def column(name="a"):
    outlines = [[(-w, a), (w, a), (w, b), (-w, b)] for a, b, w in ((-0.2, 0.0, 0.5), (0.0, 0.3, 0.1))]
    joint = lm.Joint(33.0, normal_stiffness=1e9, shear_stiffness=5e8)
    return lm.Assembly.from_polygons(outlines, thickness=0.3, joint=joint, names=["ground", name], fixed=["ground"])


def solved(wall):
    return lm.limit_analysis(wall, lm.Loads.horizontal(wall))


WRITERS = {
    "model.json": lambda path, wall: lm.formats.write_json(path, wall),
    "answer.json": lambda path, wall: lm.formats.write_prediction(path, solved(wall)),
    "blocks.obj": lambda path, wall: lm.formats.write(path, wall),
    "answer.vtu": lambda path, wall: lm.formats.write(path, wall, prediction=solved(wall)),
    "table.csv": lambda path, wall: write_table(path, {"name": "-"}, [[b.name] for b in wall.blocks]),
    "page.html": lambda path, wall: write_page(path, "page", [b.name for b in wall.blocks]),
    "view.html": lambda path, wall: lm.view(wall, solved(wall), path),
    "picture.png": lambda path, wall: files.save_figure(lm.figures.assembly(wall), path),
    "state.npz": lambda path, wall: dem.initial_state(wall, lm.Loads.weight(wall)).save(path),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_writer_takes_a_tilde_for_the_home_folder(tmp_path, monkeypatch, name):
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    home.mkdir(), elsewhere.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.chdir(elsewhere)
    WRITERS[name](f"~/{name}", column())
    assert (home / name).is_file()
    assert not any(elsewhere.iterdir())


def test_every_reader_takes_a_tilde_for_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    wall = column()
    loads = lm.Loads.weight(wall)
    lm.formats.write(tmp_path / "model.json", wall, loads)
    lm.formats.write(tmp_path / "blocks.obj", wall)
    dem.initial_state(wall, loads).save(tmp_path / "state.npz")
    (tmp_path / "data.csv").write_text("specimen,measured\n# units: -,kN\na,1.0\nb,2.0\n")
    memo = Memo("~/runs.jsonl")
    memo.keep("a", 1.0)
    assert (tmp_path / "runs.jsonl").is_file()
    assert dict(Memo("~/runs.jsonl").rows) == dict(memo.rows)
    assert lm.formats.read("~/model.json").assembly.n_blocks == 2
    assert len(lm.formats.read("~/blocks.obj").names) == 2
    assert read_solids(["~/blocks.obj"]).names
    assert isinstance(dem.State.load("~/state.npz"), dem.State)
    assert len(read_measured("~/data.csv")) == 2
    assert lm.diagnosis.study_from_folder.write_folder("~/folder") == tmp_path / "folder"
    # a name that begins with the sign and is no home folder stays what it is
    assert files.named_path("~no-such-user/a.json").parts[0] == "~no-such-user"


def test_a_store_and_a_checkpoint_take_a_tilde_for_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    store = dem.Store("~/kept")
    with store.alone():
        assert store.checkpoint == tmp_path / "kept" / "checkpoint.npz"
    (tmp_path / "kept" / "some.f8").touch()
    with pytest.raises(InputError, match="some.f8 is of no run"):
        store.check_free()
    (tmp_path / "run.npz").touch()
    with pytest.raises(InputError, match="no archive"):
        check_checkpoint("~/run.npz", begins=True)


def limited(pipe, write, path, wall):
    """Write with a disk that takes 8 bytes; a process of its own, as the limit stays."""
    ready(pipe)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8, 8))
    try:
        write(path, wall)
        pipe.send("written")
    except OSError as error:
        pipe.send(str(error))


@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_is_full_leaves_the_old_file_whole(tmp_path, name):
    path, write = tmp_path / name, WRITERS[name]
    write(path, column())
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    [child], [pipe] = together(limited, [(write, path, column("another"))])
    words = said(pipe)
    ended(child)
    assert name in words
    assert "as it was" in words
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


@pytest.mark.parametrize("name", ["blocks.obj", "table.csv", "page.html", "view.html", "answer.vtu"])
def test_half_of_a_character_in_a_name_is_refused_and_the_old_file_stays(tmp_path, name):
    path, write = tmp_path / name, WRITERS[name]
    write(path, column())
    before = path.read_bytes()
    with pytest.raises(InputError, match=name.replace(".", r"\.")):
        write(path, column("a\ud800b"))
    assert path.read_bytes() == before
    assert not [p.name for p in tmp_path.iterdir() if p.suffix == ".part"]


def many(pipe, path, text):
    ready(pipe)
    for _ in range(50):
        files.write_text(path, text)


def test_two_processes_that_write_one_file_leave_one_whole_one(tmp_path):
    path, texts = tmp_path / "new" / "text", ["a" * 100_000, "b" * 100_000]
    children, _ = together(many, [(path, text) for text in texts])
    assert [ended(child) for child in children] == [0, 0]
    assert path.read_text() in texts
    assert [p.name for p in path.parent.iterdir()] == ["text"]


def test_what_is_written_keeps_the_rights_and_the_place_of_the_old_file(tmp_path):
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    files.write_text(real, "old")
    real.chmod(0o640)
    link.symlink_to(real)
    files.write_text(link, "new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert real.stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("2000", "1" + "0" * 400), "400 digits|401 digits"),
        (lambda text: text.replace("2000", "1" + "0" * 5000), "digits"),
        (lambda text: text.replace('"recipe": {}', '"recipe": ' + "[" * 900 + "]" * 900), "nested too deeply"),
        (lambda text: text.replace('"recipe": {}', '"recipe": ' + "[" * 100_000), "nested too deeply|not JSON"),
        (lambda text: text[: len(text) // 2], "not JSON"),
        (lambda text: "", "line 1, column 1"),
    ],
)
def test_hostile_json_is_refused_by_the_name_of_its_file(tmp_path, change, words):
    path = tmp_path / "model.json"
    lm.formats.write_json(path, column())
    document = {**json.loads(path.read_text()), "recipe": {}}
    document["blocks"][0]["density"] = 2000
    path.write_text(change(json.dumps(document)))
    with pytest.raises(InputError, match=rf"model\.json.*({words})"):
        lm.formats.read_json(path)


def test_bytes_that_are_no_utf_8_are_refused_by_the_name_of_their_file(tmp_path):
    for name in ("model.json", "blocks.obj"):
        (tmp_path / name).write_bytes(b"\xff\xfe\x00\x01")
        with pytest.raises(InputError, match=rf"{name}.*UTF-8"):
            lm.formats.read(tmp_path / name)


@pytest.mark.slow
def test_a_torn_checkpoint_is_refused_by_its_name_wherever_it_is_torn(tmp_path):
    wall = column()
    run = dem.simulate(wall, dem.Hold(steps=10))
    run.save(tmp_path / "run.npz")
    whole = (tmp_path / "run.npz").read_bytes()
    for n in [0, 1, 10, 100, *np.linspace(200, len(whole) - 1, 20).astype(int)]:
        (tmp_path / "torn.npz").write_bytes(whole[:n])
        with pytest.raises(InputError, match=r"torn\.npz"):
            dem.History.load(tmp_path / "torn.npz", wall)
    refused = 0
    for n in range(len(whole) // 2, len(whole) - 1, len(whole) // 64):
        bad = bytearray(whole)
        bad[n] ^= 0xFF
        (tmp_path / "flipped.npz").write_bytes(bytes(bad))
        try:
            same = dem.History.load(tmp_path / "flipped.npz", wall)
        except InputError:
            refused += 1
        else:  # what an archive says twice, its times and lengths, is read once: nothing is lost
            assert fingerprint(same.state) == fingerprint(run.state)
    assert refused > 16
    with pytest.raises(InputError, match="no file"):
        dem.History.load(tmp_path / "none.npz", wall)


def pushed(path=None):
    drive = dem.Drive({"a": {"x": 1.0}})
    return dem.push(column(), drive, to=1e-4, steps=200, samples=10, rate_check=False, checkpoint=path)


def push(pipe, path):
    ready(pipe)
    try:
        pushed(path)
        pipe.send("pushed")
    except Exception as error:
        pipe.send(repr(error))


@pytest.mark.slow
def test_two_pushes_on_one_checkpoint_both_come_to_their_end_or_leave_what_goes_on_if_killed(tmp_path):
    alone = pushed()
    begun, _ = time.perf_counter(), pushed()
    took = time.perf_counter() - begun
    for start in range(8):
        path = tmp_path / f"run{start}.npz"
        children, pipes = together(push, [(path,), (path,)])
        killed = start // 3  # none, one, both
        for child in children[:killed]:
            time.sleep(0.3 * (1 + start % 3) * took)
            child.kill()
        words = [said(pipe) for pipe in pipes]
        assert words[killed:] == ["pushed"] * (2 - killed)
        assert {*words} <= {"pushed", None}
        for child in children:
            ended(child)
        again = pushed(path)
        assert np.array_equal(again.load, alone.load)
        assert np.array_equal(again.displacement, alone.displacement)
