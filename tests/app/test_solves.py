"""A solve on the page is the call that it shows: same number, same errors, a script that runs; and its process ends."""

import math
import runpy
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from application import alive, ends, served, session

import limitmason as lm
from limitmason.app import folder, forms, jobs, script, worker
from limitmason.errors import InputError


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with served(tmp_path_factory.mktemp("app")) as found:
        yield found


# --- forms


def test_every_number_has_its_unit():
    told = {
        ("structure", "wall", "length"): "m", ("structure", "wall", "density"): "kg/m3",
        ("structure", "wall", "courses"): "-",
        ("structure", "dome", "density"): "kg/m3", ("structure", "arch", "angle_deg"): "deg",
        ("structure", "vault", "radius"): "m", ("structure", "layout", "unit"): "m", ("opening", "Opening", "x"): "m",
        ("joint", "Joint", "friction_angle_deg"): "deg", ("joint", "Joint", "cohesion"): "Pa",
        ("joint", "Joint", "normal_stiffness"): "Pa/m", ("joint", "Joint", "fracture_energy_shear"): "J/m2",
        ("joint", "Joint", "residual_cohesion"): "Pa", ("more", "with_point_load", "force"): "N",
        ("more", "with_pressure", "pressure"): "Pa", ("more", "with_pressure", "unit_weight"): "N/m3",
            ("analysis", "pushover", "to"): "m",
        ("drawing", "drawing", "mortar"): "m", ("drawing", "drawing", "density"): "kg/m3",
    }
    units = {
        (part, name, f.name): f.unit
        for part, group in forms.calls().items() for name, call in group.items() for f in call.fields
        if f.kind in ("number", "numbers")
    }
    assert told.items() <= units.items()
    without = {key[2] for key, unit in units.items() if unit == "-"}
    # counts, ratios and directions
    assert without == {
        "courses", "leaves", "header_every", "pier_courses", "voussoirs", "lunes", "direction", "grid", "scale"
    }


def test_what_a_field_offers_is_taken_by_its_call():
    # the stones at the lowest level, not a block of that name
    field = next(f for f in forms.calls()["drawing"]["drawing"].fields if f.name == "fixed")
    assert [script.literal(c, field.kind) for c in field.choices] == ['"lowest"']
    assert script.literal("a-1, a-2", field.kind) == '("a-1", "a-2")'
    # digits of other scripts are numbers to float, and none in the source of Python
    assert script.literal("٣.٥", "number") == '"٣.٥"'


def test_a_decimal_comma_is_no_pair_of_stiffnesses():
    # (1, 5e9): a normal stiffness of 1 Pa/m, by which a wall of bricks sinks by metres
    call = forms.calls()["analysis"]["pushover"]
    for typed in ("1,5e9", " 0,5 ", "-1,5"):
        with pytest.raises(InputError, match="stiffness: .* may be one number or two: write a decimal point"):
            script._arguments(call.fields, {"stiffness": typed})
    for typed, line in (("1.5e9", "stiffness=1.5e9"), ("2e9, 1e9", "stiffness=(2e9, 1e9)")):
        assert script._arguments(call.fields, {"stiffness": typed}) == [line]
    assert script._arguments(forms.calls()["analysis"]["limit_analysis"].fields, {"grid": "5,5"}) == ["grid=(5, 5)"]
    fields = forms.calls()["joint"]["Joint"].fields
    assert script._arguments(fields, {"cohesion": 0, "tensile_strength": " "}) == ["cohesion=0"]


def test_what_an_experiment_offers_is_taken_by_it():
    # a residual strength of "none" once became None, which the experiment refuses
    here, words = folder.Folder("."), 0
    for at, specimen in (("mcmaster-bending", "theta-0"), ("modern-walls", "1")):
        offered = {f.name: f.choices for f in forms.experiment_fields(at, specimen) if f.choices}
        for name, choices in offered.items():
            for choice in choices:
                made = {"kind": "experiment", "source": at, "specimen": specimen, "values": {name: choice}}
                lines = script.statements({"structure": made, "loads": {"kind": "own"}}, here, kind="draw")
                scope = {}
                exec("\n".join(line.text for line in lines[:2]), scope)
                assert scope["test"].options[name] == choice
                words += choice == "none"
    assert words == 2


def test_every_form_begins_with_something_that_solves():
    for name, call in forms.calls()["structure"].items():
        joint = lm.Joint(33.0)
        given = [f"{f.name}={forms_literal(f)}" for f in call.fields if f.value != ""]
        wall = eval(f"lm.build.{name}({', '.join(given)}, joint=joint)", {"lm": lm, "joint": joint})
        assert wall.n_blocks > 1


def test_what_can_be_chosen_is_what_the_call_takes():
    seen = 0
    for name, call in forms.calls()["structure"].items():
        start = {f.name: forms_literal(f) for f in call.fields if f.value != ""}
        for field in call.fields:
            if field.choices:
                given = ", ".join(f"{k}={v}" for k, v in (start | {field.name: "'?'"}).items())
                with pytest.raises(InputError) as refused:
                    eval(f"lm.build.{name}({given}, joint=lm.Joint(33.0))", {"lm": lm})
                allowed = str(refused.value).partition("one of ")[2].partition(", got")[0].split(", ")
                known, chosen = {a.strip("'").lower() for a in allowed}, {c.lower() for c in field.choices}
                assert known - {"none"} == chosen - {"none"}
                seen += 1
    assert seen >= 10


def forms_literal(field):
    return script.literal(field.value, field.kind)


# --- solves, each in a process of its own


@pytest.mark.slow
def test_a_solve_gives_the_number_of_the_same_call_in_python(client):
    found = client.solved(session(joint={"friction_angle_deg": "20"}))
    column = lm.build.column(width=0.4, depth=0.4, unit_height=0.2, courses=8, joint=lm.Joint(20.0))
    expected = lm.limit_analysis(column, lm.Loads.horizontal(column)).collapse_multiplier
    assert expected == pytest.approx(0.25)  # width over height
    assert found["summary"]["number"] == expected
    assert found["summary"]["status"] == "solved"
    assert {"mechanism.png", "forces.png", "scene.html", "answer.json", "model.json"} <= set(found["files"])
    status, picture, headers = client(f"api/result/{found['job']}/mechanism.png")
    assert (status, picture[:4]) == (200, b"\x89PNG")
    headers = client(f"api/result/{found['job']}/scene.html")[2]
    assert "sandbox allow-scripts" in headers["Content-Security-Policy"]  # it cannot call the server
    assert client(f"api/result/{found['job']}/../../x")[0] == client("api/result/999")[0] == 404


@pytest.mark.slow
def test_the_downloaded_script_gives_the_same_number_and_files(client, tmp_path, monkeypatch):
    found = client.solved(session(joint={"friction_angle_deg": "10"}))
    status, text, headers = client(f"api/result/{found['job']}/session.py?download=1")
    assert status == 200
    assert "attachment" in headers["Content-Disposition"]
    (tmp_path / "session.py").write_bytes(text)
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path("session.py")
    number = found["summary"]["number"]
    assert names["answer"].collapse_multiplier == number == pytest.approx(math.tan(math.radians(10)))
    assert set(found["files"]) == {p.name for p in tmp_path.iterdir()} - {"session.py"}
    answer = lm.formats.read_prediction("answer.json")
    assert answer.collapse_multiplier == found["summary"]["number"]
    model = lm.formats.read_json("model.json")
    assert lm.limit_analysis(*model).collapse_multiplier == pytest.approx(found["summary"]["number"])


COLUMN = {"courses": "3"}
FALLS = {"radius": "2", "angle_deg": "180", "thickness": "0.15", "width": "1", "voussoirs": "9"}  # below .1075 radii
SCRIPTS = [("limit_analysis", "column", COLUMN), ("pushover", "column", COLUMN), ("stability", "column", COLUMN),
           ("stability", "arch", FALLS), ("limit_analysis", "arch", FALLS), ("compare", "column", COLUMN)]


@pytest.mark.slow
@pytest.mark.parametrize(("analysis", "structure", "values"), SCRIPTS)
def test_the_script_of_every_analysis_runs_to_its_end(analysis, structure, values, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    body = session(structure, analysis=analysis, **values)
    if analysis != "limit_analysis":
        given = {"stability": {"tilts": "+x"}, "compare": {"methods": "mechanisms"}}
        body["analysis"]["values"] = given.get(analysis, {})
    (tmp_path / "app").mkdir()
    lines = script.statements(body, folder.Folder(tmp_path / "app"))
    found = worker.run(lines, str(tmp_path / "app"))
    assert list((tmp_path / "app").iterdir()) == []  # what the page shows stands in no folder
    monkeypatch.chdir(tmp_path)
    (tmp_path / "session.py").write_text(script.source(jobs.Computation(1, "solve", lines, result=found).done_lines()))
    names = runpy.run_path("session.py")
    same, shown = worker.summary(names), found["summary"]
    assert same["number"] == shown["number"]
    assert (same["what"], same.get("status")) == (shown["what"], shown.get("status"))
    assert {p.name for p in tmp_path.iterdir()} == {*found["files"], "session.py", "app"}
    falls = structure == "arch"
    assert ("mechanism.png" in found["files"]) == (falls or analysis == "limit_analysis")
    assert not falls or "cannot stand" in shown["what"] + shown.get("status", "")


@pytest.mark.slow
@pytest.mark.parametrize("body, part, name, words", [
    (session(joint={"friction_angle_deg": "95"}), "joint", "InputError", "friction_angle_deg = 95"),
    (session(joint={"friction_angle_deg": "nan"}), "joint", "InputError", "friction_angle_deg is NaN"),
    (session(joint={"cohesion": "lots"}), "joint", "InputError", "cohesion must be a number, got 'lots'"),
    (session(joint={"friction_angle_deg": ""}), "joint", "TypeError", "friction_angle_deg"),
    (session(width="-1"), "structure", "InputError", "width must be positive"),
    (session(width="0,4"), "structure", "InputError", "width must be a finite number, got '0,4'"),
    (session() | {"loads": {"kind": "weight"}}, "analysis", "InputError", "live load"),
    (session(more=[{"kind": "with_point_load", "values": {"block": "nobody", "force": "1, 0, 0"}}]), "more.0",
     "InputError", "nobody"),
])
def test_wrong_input_has_its_named_error_where_it_was_typed(client, body, part, name, words):
    error = client.solved(body)["error"]
    assert (error["part"], error["name"]) == (part, name)
    assert words in error["text"]


@pytest.mark.slow
def test_the_other_analyses_and_the_report(client):
    curve = client.solved(session(analysis="pushover", courses="3"))
    column = lm.build.column(width=0.4, depth=0.4, unit_height=0.2, courses=3, joint=lm.Joint(33.0))
    assert curve["summary"]["number"] == lm.pushover(column, lm.Loads.horizontal(column)).peak.load
    assert {"curve.png", "scene.html"} <= set(curve["files"])
    body = session(analysis="stability", courses="3")
    body["analysis"]["values"] = {"tilts": "+x"}
    standing = client.solved(body)
    assert standing["summary"]["what"].startswith("can stand")
    body = session(analysis="compare", courses="3")
    body["analysis"]["values"] = {"methods": "associative, mechanisms"}
    theories = client.solved(body)
    assert [row[0] for row in theories["summary"]["rows"]] == ["associative", "mechanisms"]
    assert theories["summary"]["rows"][0][1] == pytest.approx(math.tan(math.radians(33)))  # slides before it tips
    assert {"theories.png", "report.html"} <= set(theories["files"])
    report = client.solved(session(courses="3"), "report")
    assert report["files"] == ["report.html"]
    assert b"<h1>" in client(f"api/result/{report['job']}/report.html")[1]


@pytest.mark.slow
def test_a_packaged_experiment_and_a_model_file(client):
    body = session() | {
        "structure": {"kind": "experiment", "source": "ferris-tin-loi-2001", "specimen": "wall-3", "values": {}},
        "loads": {"kind": "own"},
    }
    found = client.solved(body)
    test = lm.experiments.load("ferris-tin-loi-2001", "wall-3")
    assert found["summary"]["number"] == pytest.approx(float(test.published["associative"]), abs=2e-3)
    assert any("associative" in line for line in found["summary"]["beside"])
    model = client(f"api/result/{found['job']}/model.json")[1]
    assert client("api/upload?name=wall.json", model)[0] == 200
    body["structure"] = {"kind": "file", "file": "wall.json", "other_joints": True}
    same = client.solved(body | {"joint": {"friction_angle_deg": "33.02386755579664"}})  # atan 0.65
    assert same["summary"]["number"] == pytest.approx(found["summary"]["number"], abs=1e-7)
    (client.server.folder.path / "wall.json").unlink()


def test_a_drawing_without_its_extra_has_a_named_error(tmp_path, monkeypatch):
    (tmp_path / "wall.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0h1v1h-1z'/></svg>")
    body = session() | {"structure": {"kind": "file", "file": "wall.svg", "values": {"scale": "1", "thickness": "0.2"}},
                        "loads": {"kind": "own"}}
    monkeypatch.setitem(sys.modules, "svg.path", None)
    monkeypatch.chdir(tmp_path)
    lines = script.statements(body, folder.Folder(tmp_path), kind="draw")
    error = worker.run(lines, str(tmp_path))["error"]
    assert (error["part"], error["name"]) == ("structure", "ImportError")
    assert "pip install 'limitmason[app]'" in error["text"]


def test_open_mortar_of_a_drawing_is_measured_and_what_is_proposed_solves(tmp_path, monkeypatch):
    pytest.importorskip("shapely")
    monkeypatch.chdir(tmp_path)
    lm.formats.write_model_template("wall.svg")

    def run(**more):
        values = {"scale": "0.001", "thickness": "0.2"} | more
        body = session() | {"structure": {"kind": "file", "file": "wall.svg", "values": values}}
        body["loads"] = {"kind": "own"}
        return worker.run(script.statements(body, folder.Folder(tmp_path), kind="draw"), str(tmp_path))

    error = run()["error"]
    assert error["text"].startswith("12 mm of open mortar everywhere: try mortar 0.012. block 'stones-1' floats")
    assert "error" not in run(mortar="0.012")


def endless(pipe, _folder):
    """A worker that never ends by itself."""
    while True:
        pipe.recv()
        pipe.send(("progress", 0.25, "so far"))
        time.sleep(1000)


@pytest.mark.slow
def test_cancel_ends_the_process_and_a_second_solve_is_told_to_wait(tmp_path):
    with served(tmp_path) as client:
        server = client.server
        server.jobs = jobs.Jobs(str(tmp_path), target=endless)
        first = client.json("api/run", session())[1]["job"]
        while client.json(f"api/result/{first}")[1]["part"] != 0.25:
            time.sleep(0.05)
        process = server.jobs.process
        for kind in ("solve", "draw", "report"):
            status, found = client.json(f"api/run?kind={kind}", session())
            assert (status, found["error"]["name"]) == (409, "Busy")
        assert client("api/cancel", b"")[0] == 200
        assert not alive(process)
        assert client.json(f"api/result/{first}")[1]["state"] == "cancelled"
        second = client.json("api/run", session())
        assert second[0] == 200
        last = server.jobs.process
    assert not alive(last)  # nor does the end of the server leave one


@pytest.mark.slow
def test_a_page_that_is_closed_leaves_no_process_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "GRACE", 0.2)
    with served(tmp_path) as client:
        server = client.server
        server.jobs = jobs.Jobs(str(tmp_path), target=endless)
        page = socket.create_connection(("127.0.0.1", client.port), timeout=10)
        page.sendall(f"GET /{server.token}/api/events HTTP/1.1\r\nHost: 127.0.0.1:{client.port}\r\n\r\n".encode())
        assert b"200" in page.recv(1000)
        monkeypatch.setattr(jobs, "MOST_PAGES", 1)
        assert client("api/events")[0] == 409  # a browser would wait for ever for a connection
        number = client.json("api/run", session())[1]["job"]
        process = server.jobs.process
        assert process is not None
        page.close()
        assert ends(process)
        assert client.json(f"api/result/{number}")[1]["state"] == "cancelled"


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").exists(), reason="finds processes by /proc")
def test_a_killed_server_leaves_no_process_behind(tmp_path):
    code = (
        "from limitmason.app.server import Server\n"
        "if __name__ == '__main__':\n"
        "    server = Server('.')\n"
        "    server.jobs.warm()\n"
        "    print(server.jobs.process, flush=True)\n"
        "    server.serve_forever()\n"
    )
    (tmp_path / "serve.py").write_text(code)
    run = subprocess.Popen([sys.executable, "serve.py"], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    process = int(run.stdout.readline())
    assert alive(process)
    run.kill()
    run.wait()
    run.stdout.close()
    assert ends(process)
