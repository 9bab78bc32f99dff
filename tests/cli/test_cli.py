"""The command line, run as a user would: what it prints, writes, and says when the input is wrong."""

import argparse
import csv
import json
import os
import re
import shlex
import subprocess
import sys

import pytest

import limitmason as lm
from limitmason import cli
from limitmason.cli import main, solve_and_draw
from limitmason.cli.parser import command_parser
from limitmason.formats import read_json, read_prediction
from limitmason.storage.interrupts import ends_early


def run(*arguments, capsys):
    status = cli.main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_help_reads_like_a_manual():
    out = subprocess.run(
        [sys.executable, "-m", "limitmason", "--help"], capture_output=True, text=True, check=True
    ).stdout
    for word in ("experiments", "solve", "figure", "template", "units", "exit status", "examples"):
        assert word in out


LONG = ("experiments run", "compare", "pushover", "predict", "app")  # minutes, or for ever: their words are parsed


@pytest.mark.slow
def test_every_example_of_the_help_runs_as_printed(tmp_path, monkeypatch, capsys):
    # in their order, in an empty folder: what one reads another has written
    pytest.importorskip("shapely")
    pytest.importorskip("svg.path")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(solve_and_draw.webbrowser, "open", lambda address: True)
    printed = re.findall(r"^  limitmason (.*?)(?: {2,}.*)?$", cli.parser._EPILOG, re.MULTILINE)
    assert len(printed) > 20
    for line in printed:
        words = shlex.split(line)
        if line.startswith(LONG):
            assert hasattr(cli.parser.command_parser().parse_args(words), "run"), line
            continue
        status, _, err = run(*words, capsys=capsys)
        assert status == (1 if "facade.svg" in line and words[0] == "check" else 0), f"{line}\n{err}"


def test_the_drawn_template_is_the_wall_of_the_model_once_its_mortar_is_named(tmp_path, capsys):
    pytest.importorskip("shapely")
    pytest.importorskip("svg.path")
    import limitmason as lm

    for name in ("wall.json", "wall.svg"):
        run("template", tmp_path / name, capsys=capsys)
    _, out, err = run("check", tmp_path / "wall.svg", "--scale", "0.001", capsys=capsys)
    assert "assumed: thickness 1 m" in err  # areas hang on it
    proposed = re.search(r"try `limitmason (.*?)`", out)
    assert proposed
    status, _, _ = run(*shlex.split(proposed[1]), capsys=capsys)
    assert status == 0
    model = lm.formats.read_json(tmp_path / "wall.json").assembly
    drawn = lm.formats.read_drawing(
        tmp_path / "wall.svg", scale=0.001, mortar=0.012, thickness=0.3, density=2000.0, joint=lm.Joint(33.0)
    )
    assert drawn.n_blocks == model.n_blocks
    assert len(drawn.interfaces) == len(model.interfaces)


def test_an_arch_is_a_model_and_no_drawing(tmp_path, capsys):
    status, _, err = run("template", tmp_path / "arch.svg", "--arch", capsys=capsys)
    assert status == 2
    assert ".json" in err
    assert not (tmp_path / "arch.svg").exists()


def test_version_is_printed():
    out = subprocess.run(
        [sys.executable, "-m", "limitmason", "--version"], capture_output=True, text=True, check=True
    )
    assert out.stdout.startswith("limitmason 0.")


def test_no_command_prints_the_help(capsys):
    status, out, _ = run(capsys=capsys)
    assert status == 0
    assert "usage: limitmason" in out


def test_experiments_list_and_show(capsys):
    _, out, _ = run("experiments", "list", capsys=capsys)
    assert "ferris-tin-loi-2001" in out
    assert "SW.30.1" in out
    _, out, _ = run("experiments", "show", "ferris-tin-loi-2001/wall-3", capsys=capsys)
    assert "0.404" in out
    _, out, _ = run("experiments", "show", "modern-walls", capsys=capsys)
    assert len(out.splitlines()) == 198 + 4, "a large series is listed, a line a wall"
    assert "modern-walls 1 shows the data sheet of one" in out


def test_experiments_run_writes_table_and_figure(tmp_path, capsys):
    table, figure = tmp_path / "t.csv", tmp_path / "t.png"
    status, out, err = run(
        "--progress", "always", "experiments", "run", "ferris-tin-loi-2001", "wall-1", "wall-2", "--flow-rule",
        "associative", "--csv", table, "--figure", figure, capsys=capsys,
    )
    assert status == 0
    assert "0.64286" in out
    assert "[2/2]" in err
    _, _, err = run("experiments", "run", "ferris-tin-loi-2001", "wall-1", "--flow-rule", "associative", capsys=capsys)
    assert err == "", "a file is not told how far a run is unless it is asked for"
    rows = list(csv.reader(table.open()))
    assert rows[1][-1] == "s"
    assert {r[1] for r in rows[2:]} == {"wall-1", "wall-2"}
    assert figure.read_bytes()[:4] == b"\x89PNG"


def test_template_solve_and_outputs(tmp_path, capsys):
    model, answer, picture, vtu = (tmp_path / n for n in ("m.json", "a.json", "p.png", "v.vtu"))
    assert run("template", model, capsys=capsys)[0] == 0
    status, out, err = run("solve", model, "--output", answer, "--figure", picture, "--vtu", vtu, capsys=capsys)
    assert status == 0
    assert "gap" in out
    assert "free blocks" in err
    value = read_prediction(answer).collapse_multiplier
    import limitmason as lm

    assembly, loads = read_json(model)
    assert value == pytest.approx(lm.limit_analysis(assembly, loads).collapse_multiplier)
    assert picture.exists()
    assert vtu.exists()
    status, _, err = run("template", model, capsys=capsys)
    assert status == 2
    assert "exists already" in err


def test_an_edited_template_follows_its_loads(tmp_path, capsys):
    model = tmp_path / "m.json"
    run("template", model, capsys=capsys)
    document = json.loads(model.read_text())
    document["joint"] = {"friction_coefficient": 0.1}
    model.write_text(json.dumps(document))
    _, out, _ = run("solve", model, capsys=capsys)
    assert "lambda = 0.1 " in out


@pytest.mark.parametrize("kind", ["assembly", "mechanism", "forces"])
def test_figures(kind, tmp_path, capsys):
    path = tmp_path / f"{kind}.svg"
    status, _, err = run("figure", kind, "ferris-tin-loi-2001/wall-1", "-o", path, capsys=capsys)
    assert status == 0
    assert f"wrote {path}" in err
    assert path.read_text().lstrip().startswith("<?xml")


@pytest.mark.parametrize("arguments, message", [
    (("solve", "nowhere.json"), "nowhere.json: no such file"),
    (("pushover", "no/where.json", "--to", "1mm", "--block", "a", "--direction", "1", "0", "0"), "no such file"),
    (("solve", "ferris"), "neither a file nor SOURCE/SPECIMEN"),
    (("solve", "ferris/wall-1"), "unknown experiment source"),
    (("solve", "ferris-tin-loi-2001/wall-9"), "wall-9"),
    (("solve", "pavia-tilting/S1"), "not published"),
    (("solve", "ferris-tin-loi-2001/wall-1", "--grid", "3", "3"), "--contact-model grid"),
    (("experiments", "run"), "--all"),
])
def test_mistakes_end_with_one_line_and_status_2(arguments, message, capsys):
    status, out, err = run(*arguments, capsys=capsys)
    assert status == 2
    assert message in err
    assert err.count("\n") <= 1 + ("free blocks" in err)
    assert "Traceback" not in err + out


def test_specimen_names_with_dots_are_not_file_names(tmp_path, capsys):
    path = tmp_path / "f.png"
    status, _, err = run("figure", "forces", "minho-dry-stone-2005-2009/SW.100.1", "-o", path, capsys=capsys)
    assert status == 0, err
    assert path.exists()


def test_solids_without_a_model_are_refused_with_a_hint(tmp_path, capsys):
    path = tmp_path / "blocks.obj"
    path.write_text("o a\nv 0 0 0\n")
    status, _, err = run("solve", path, capsys=capsys)
    assert status == 2
    assert "error:" in err


def test_malformed_model_names_the_place(tmp_path, capsys):
    model = tmp_path / "m.json"
    model.write_text('{"schema": "limitmason-model", "version": 1,')
    status, _, err = run("solve", model, capsys=capsys)
    assert status == 2
    assert "m.json" in err
    assert "line" in err


def test_structure_that_cannot_stand_has_its_own_status(tmp_path, capsys):
    model = tmp_path / "m.json"
    model.write_text(json.dumps({
        "schema": "limitmason-model", "version": 1, "thickness": 1, "joint": {"friction_angle_deg": 40},
        "outlines": [[[0, -1], [1, -1], [1, 0], [0, 0]], [[0.7, 0], [2.3, 0], [2.3, 1], [0.7, 1]]],
        "fixed": [0], "loads": {"horizontal": [1, 0, 0]},
    }))
    status, out, _ = run("solve", model, capsys=capsys)
    assert status == 3
    assert "cannot stand under dead load" in out


@pytest.mark.parametrize("name, word", [("wall.txt", ".png"), ("missing/wall.png", "no folder")])
def test_a_figure_that_cannot_be_written_is_refused_before_the_analysis(name, word, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        run("solve", "ferris-tin-loi-2001/wall-1", "--figure", tmp_path / name, capsys=capsys)
    out, err = capsys.readouterr()
    assert stop.value.code == 2
    assert word in err
    assert not out


@pytest.mark.parametrize("option", ["--output", "--forces", "--vtu", "--figure"])
def test_a_folder_in_place_of_a_file_is_refused_before_the_analysis(option, tmp_path, capsys):
    folder = tmp_path / "taken.png"
    folder.mkdir()
    with pytest.raises(SystemExit) as stop:
        main(["solve", "ferris-tin-loi-2001/wall-4", option, str(folder)])
    assert stop.value.code == 2
    told = capsys.readouterr()
    assert "is a folder: name a file" in told.err
    assert "lambda" not in told.out


@pytest.mark.parametrize("dots", ["-3", "0", "100000", "nan"])
def test_dots_that_no_picture_has_are_refused_before_the_analysis(dots, capsys):
    with pytest.raises(SystemExit) as stop:
        run("figure", "mechanism", "ferris-tin-loi-2001/wall-1", "--dpi", dots, capsys=capsys)
    out, err = capsys.readouterr()
    assert stop.value.code == 2
    assert f"--dpi: '{dots}' is no whole number" in err
    assert not out


@pytest.mark.slow
def test_a_session_does_what_the_command_does(tmp_path, capsys):
    # what the command line reaches is in the library: template, drawing, table of a series with its file and figure
    import limitmason as lm

    by_command, by_call = tmp_path / "command.json", tmp_path / "call.json"
    run("template", by_command, capsys=capsys)
    lm.formats.write_model_template(by_call)
    assert by_call.read_bytes() == by_command.read_bytes()
    with pytest.raises(lm.errors.InputError, match="exists already"):
        lm.formats.write_model_template(by_call)

    said = []
    rows = lm.comparison.table(source="ferris-tin-loi-2001", flow_rule="associative", progress=said.append)
    assert said[0] == "[1/6] ferris-tin-loi-2001/wall-1"
    _, out, _ = run("experiments", "run", "ferris-tin-loi-2001", "--flow-rule", "associative",
                    "--csv", tmp_path / "command.csv", capsys=capsys)
    assert [line.split()[:5] for line in out.splitlines()[1:]] == [
        line.split()[:5] for line in lm.comparison.as_text(rows).splitlines()[1:]
    ]
    lm.comparison.write_rows(rows, tmp_path / "call.csv")
    files = [list(csv.reader((tmp_path / f"{name}.csv").open())) for name in ("command", "call")]
    assert [row[:-1] for row in files[0]] == [row[:-1] for row in files[1]]  # the last column is the time it took
    assert lm.figures.predicted_beside_references(rows).axes


@pytest.mark.parametrize("command", [
    ("template", "none/wall.json"), ("template", "none/wall.svg"), ("diagnose", "--template", "none/data.csv"),
    ("diagnose", "--template", "none/data"), ("solve", "wall.json", "--output", "none/answer.json"),
    ("solve", "wall.json", "--figure", "none/wall.png"),
])
def test_a_file_in_a_folder_that_is_not_there_is_refused_by_name(command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        cli.main(list(command))
    assert "there is no folder 'none': make it first" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


def test_a_drawing_is_an_assembly(tmp_path):
    import limitmason as lm

    block = lm.build.wall(length=0.4, courses=2, unit=(0.2, 0.1, 0.1), joint=lm.Joint(33.0), base=None)
    lm.formats.write_obj(tmp_path / "wall.obj", block)
    read = lm.formats.read_drawing(tmp_path / "wall.obj", joint=lm.Joint(20.0))
    assert read.n_blocks == block.n_blocks
    assert len(read.interfaces) == len(block.interfaces)
    assert {i.joint.friction_angle_deg for i in read.interfaces} == {20.0}
    smaller = lm.formats.read_drawing(tmp_path / "wall.obj", scale=0.5)
    assert smaller.arrays.volume.sum() == pytest.approx(block.arrays.volume.sum() / 8.0)
    for wrong, words in (({"thickness": 0.3}, "thickness is for outlines"), ({}, "a drawing ends in .dxf, .svg, .obj")):
        with pytest.raises(lm.errors.InputError, match=words):
            lm.formats.read_drawing(tmp_path / ("wall.obj" if wrong else "wall.dwg"), **wrong)


def test_a_scene_is_written_and_opened_on_demand(tmp_path, capsys, monkeypatch):
    opened = []
    monkeypatch.setattr(solve_and_draw.webbrowser, "open", opened.append)
    model, scene = tmp_path / "wall.json", tmp_path / "scene.html"
    assert main(["template", str(model)]) == 0
    assert main(["view", str(model), "-o", str(scene)]) == 0
    out = capsys.readouterr()
    assert "lambda = " in out.out
    assert f"wrote {scene}: open it in a browser; it needs no network" in out.err
    assert "stone-1-1" in scene.read_text(encoding="utf-8")
    assert not opened
    # the structure alone needs no live load and no analysis
    assert main(["view", str(model), "--alone", "--open", "-o", str(scene)]) == 0
    assert "lambda" not in capsys.readouterr().out
    assert opened == [scene.resolve().as_uri()]
    assert main(["view", str(model), "--alone", "--method", "dem"]) == 2
    assert "--method is not used with --alone" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["solve", "."], ".: is a directory"),
        (["solve", "nofile.dxf", "--friction", "33"], "nofile.dxf: no such file"),
        (["compare", "ferris-tin-loi-2001/wall-3", "--measured", "nan"], "measured must be a finite number"),
    ],
)
def test_what_the_system_refuses_is_named_without_a_number(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "Errno" not in said


@pytest.mark.parametrize(("text", "metres"), [
    ("-1mm", -1e-3), ("-2.5e-1cm", -2.5e-3), ("-0.002", -0.002), (".5m", 0.5),
])
def test_a_length_with_a_sign_and_a_unit_is_no_option(text, metres):
    given = command_parser().parse_args(["pushover", "wall.json", "--to", "2mm", text, "--blocks", "lumped"])
    assert given.to == pytest.approx([2e-3, metres])
    with pytest.raises(SystemExit):
        command_parser().parse_args(["pushover", "wall.json", "--to", "-mm"])


def test_a_support_that_is_not_there_is_refused_before_the_analysis(monkeypatch, capsys):
    monkeypatch.setattr("limitmason.cli.safety.stability", lambda *_: pytest.fail("the analysis ran"))
    assert main(["stability", "ferris-tin-loi-2001/wall-3", "--support", "nope"]) == 2
    assert "nope" in capsys.readouterr().err


def test_a_thrust_on_one_slab_is_asked_along_a_direction(tmp_path, capsys):
    """The middle of a pier stands over that of its slab: 'give one' was said, and no option took it."""
    joint = lm.Joint(35.0, dilatancy_angle_deg=35.0)
    pier = lm.build.column(width=0.4, depth=0.4, unit_height=0.5, courses=1, joint=joint)
    lm.formats.write_json(tmp_path / "pier.json", pier)
    typed = ["stability", str(tmp_path / "pier.json"), "--support", "base"]
    assert main(typed) == 2
    assert "--along: no direction follows" in capsys.readouterr().err
    assert main([*typed, "--along", "0", "0", "-1"]) == 0
    assert f"thrust {pier.weights[1]:.6g} N to {pier.weights[1]:.6g} N along (0, 0, -1)" in capsys.readouterr().out


def test_an_option_of_an_experiment_that_is_true_or_false_is_no_word():
    chosen = cli.pushover._chosen(["crushing=False", "unit_cracks=True", "kn=None", "residual=none", "friction=0.6"])
    assert chosen == {"crushing": False, "unit_cracks": True, "kn": None, "residual": "none", "friction": 0.6}


@pytest.mark.parametrize(("more", "message"), [
    (("--forces", "wall.json"), "--forces wall.json is the target, which would be lost"),
    (("--output", "./wall.json"), "--output wall.json is the target"),
    (("--output", "a.json", "--forces", "a.json"), "is the file of --"),
])
def test_no_answer_is_written_over_the_target_or_another_answer(more, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run("template", "wall.json", capsys=capsys)
    before = (tmp_path / "wall.json").read_bytes()
    status, out, err = run("solve", "wall.json", *more, capsys=capsys)
    assert status == 2
    assert message in err
    assert not out
    assert (tmp_path / "wall.json").read_bytes() == before
    assert not (tmp_path / "a.json").exists()


def test_a_verdict_is_not_asked_of_a_push_the_other_way(tmp_path, capsys):
    run("template", tmp_path / "wall.json", capsys=capsys)
    status, _, err = run("assess", tmp_path / "wall.json", "--site", 0.15, 2.45, 0.28, "--to", "-1mm", capsys=capsys)
    assert status == 2
    assert "--to must be positive [m], got -0.001" in err


def test_a_tilde_is_the_home_folder_in_every_place_of_a_command(tmp_path, monkeypatch, capsys):
    """A shell leaves it as it is in --output=~/x and between quotes, and a folder of that name was made."""
    monkeypatch.setenv("HOME", str(tmp_path))
    run("template", "~/wall.json", capsys=capsys)
    run("solve", "~/wall.json", "--output=~/answer.json", "--figure=~/wall.png", capsys=capsys)
    run("check", "~/wall.json", capsys=capsys)
    run("compare", "~/wall.json", "--methods", "associative", "--store", "~/answers", capsys=capsys)
    assert {p.name for p in tmp_path.iterdir()} == {"wall.json", "answer.json", "wall.png", "answers"}
    with pytest.raises(SystemExit):
        main(["solve", "~/wall.json", "--output", "~/missing/answer.json"])
    assert f"there is no folder '{tmp_path}/missing'" in capsys.readouterr().err


COMMAND = "from limitmason.cli import main\nraise SystemExit(main())\n"


@pytest.mark.parametrize("started, told", [
    (["-m", "limitmason"], "interrupted\n"), (["limitmason"], "interrupted\n"), (["script.py"], "Traceback"),
])
def test_an_interrupt_while_the_libraries_load_is_one_line_of_the_command_alone(started, told, tmp_path):
    """The command gave the traceback of an import; a script that loads the package keeps it."""
    (tmp_path / "numpy.py").write_text("raise KeyboardInterrupt\n")
    for name in ("limitmason", "script.py"):
        (tmp_path / name).write_text(COMMAND)
    places = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    ended = subprocess.run(
        [sys.executable, *started], cwd=tmp_path, env=os.environ | {"PYTHONPATH": places}, capture_output=True,
        text=True, check=False,
    )
    assert ended.stderr.startswith(told)
    assert (ended.stderr == told) == (ended.returncode == 130) == (told != "Traceback")


def test_an_interrupted_search_prints_what_it_has_and_ends_with_the_status_of_an_interrupt(monkeypatch, capsys):
    """It ended with 3, "no finite multiplier", below the multiplier that it had printed."""

    def searched(_):
        print("0.2637, the lowest of 3 trials")
        ends_early()
        return 3

    typed = argparse.Namespace(run=searched, progress=None, debug=False)
    monkeypatch.setattr(cli, "command_parser", lambda: argparse.Namespace(parse_args=lambda _: typed))
    assert cli.main(["solve"]) == 130
    said = capsys.readouterr()
    assert "0.2637" in said.out
    assert said.err == "interrupted\n"
