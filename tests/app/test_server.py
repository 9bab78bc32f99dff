"""The application without a browser: who is answered, what is refused, and that a solve is the call that is shown."""

import ast
import http.client
import json
import math
import os
import runpy
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from urllib.parse import quote

import pytest

import limitmason as lm
from limitmason.app import folder, forms, jobs, script, worker
from limitmason.app.server import Server
from limitmason.errors import InputError


def start(part, name):
    """What the form begins with."""
    return {f.name: f.value for f in forms.calls()[part][name].fields if f.value != ""}


def session(structure="column", *, joint=None, analysis="limit_analysis", more=(), **values):
    """A session as the page sends it."""
    return {
        "structure": {"kind": structure, "values": start("structure", structure) | values},
        "joint": start("joint", "Joint") | (joint or {}),
        "loads": {"kind": "horizontal", "values": {"direction": "1, 0, 0"}, "more": list(more)},
        "analysis": {"kind": analysis, "values": start("analysis", analysis)},
    }


class Client:
    """Requests to a server, with what a page of it sends unless told otherwise."""

    def __init__(self, server):
        self.server, self.port = server, server.server_address[1]
        self.origin = f"http://127.0.0.1:{self.port}"

    def __call__(self, path, body=None, *, token=None, host=None, origin=..., method=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=100)
        headers["Host"] = host or f"127.0.0.1:{self.port}"
        if origin is ...:
            origin = self.origin if body is not None else None
        if origin is not None:
            headers["Origin"] = origin
        address = f"/{self.server.token if token is None else token}/{path}"
        data = json.dumps(body).encode() if isinstance(body, dict) else body
        connection.request(method or ("GET" if body is None else "POST"), address, data, headers)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content, dict(answer.getheaders())

    def json(self, *arguments, **options):
        status, content, _ = self(*arguments, **options)
        return status, json.loads(content)

    def finished(self, number, seconds=100.0):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = self.json(f"api/result/{number}")[1]
            if found["state"] not in ("waiting", "running"):
                return found
            time.sleep(0.05)
        raise AssertionError(f"after {seconds} s: {found}")

    def solved(self, body, kind="solve"):
        status, found = self.json(f"api/run?kind={kind}", body)
        assert status == 200, found
        return self.finished(found["job"])


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    place = tmp_path_factory.mktemp("app")
    (place / "outside.json").write_text("{}")
    (place / "chosen").mkdir()
    with Server(str(place / "chosen")) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield Client(server)
        server.shutdown()


def alive(number):
    """Whether a process is there, and no zombie."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    held = Path(f"/proc/{number}/stat")
    return not held.exists() or held.read_text().rpartition(")")[2].split()[0] != "Z"


def ends(number, seconds=20.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if not alive(number):
            return True
        time.sleep(0.05)
    return False


# --- who is answered


def test_the_page_comes_with_what_it_needs_and_forbids_the_rest(client):
    status, content, headers = client("")
    assert status == 200
    assert b"app.js" in content
    assert b"http" not in content  # nothing from elsewhere
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert client("app.js")[0] == client("app.css")[0] == 200
    assert b"http:" not in client("app.js")[1] + client("app.css")[1]


def test_only_the_loopback_address_is_served(client):
    assert client.server.server_address[0] == "127.0.0.1"
    assert client.server.socket.getsockname()[0] == "127.0.0.1"


def test_tokens_are_random_and_long(client, tmp_path):
    with Server(str(tmp_path)) as other:
        assert other.token != client.server.token
        assert len(other.token) >= 32


@pytest.mark.parametrize("token", ["", "x", "../x", "%00", "é".encode().decode("latin-1")])
@pytest.mark.parametrize("path", ["", "app.js", "api/forms", "api/events", "api/result/1"])
def test_without_the_token_nothing_is_answered(client, token, path):
    status, content, _ = client(path, token=quote(token, safe="/."))
    assert status == 403
    assert client.server.token.encode() not in content


@pytest.mark.parametrize("path", ["api/run", "api/script", "api/cancel", "api/upload?name=a.json"])
@pytest.mark.parametrize("origin", ["http://example.com", "null", "https://127.0.0.1:{port}", "http://127.0.0.1",
                                    "http://localhost.evil:{port}", None])  # fmt: skip
def test_another_origin_or_none_may_do_nothing(client, path, origin):
    origin = origin.format(port=client.port) if origin else None
    status, found = client.json(path, {}, origin=origin)
    assert status == 403
    assert "origin" in found["error"]
    assert client("api/forms", origin="http://example.com")[0] == 403


def test_a_host_name_that_was_bound_to_this_machine_is_refused(client):
    for host in ("example.com", f"example.com:{client.port}", "127.0.0.1", f"127.0.0.1:{client.port + 1}"):
        assert client("api/forms", host=host)[0] == 403
    assert client("api/forms", host=f"localhost:{client.port}")[0] == 200


# --- files


@pytest.mark.parametrize("path", ["../outside.json", "api/../../outside.json", "api/result/1/../../../x",
                                  "%2e%2e/outside.json", "/etc/passwd", "..%2foutside.json", "page.html",
                                  "server.py", "__init__.py"])  # fmt: skip
def test_no_path_leads_out_of_the_page(client, path):
    assert client(path)[0] == 404


NAMES = ["../outside.json", "/etc/passwd", "a/b.json", "..", "", "x" * 300 + ".json", "a\0.json", "a\n.json",
         "..\\x.json", ".json", ".hidden.json", "c:x.json", "<script>.json", "wall.exe", "wall.py"]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_no_name_leads_out_of_the_folder(client, name):
    before = sorted(p.name for p in client.server.folder.path.parent.rglob("*"))
    body = session() | {"structure": {"kind": "file", "file": name}}
    status, found = client.json("api/run", body)
    assert status == 422
    assert found["error"]["name"] == "InputError"
    assert client("api/upload?name=" + quote(name), b"{}")[0] == 422
    assert sorted(p.name for p in client.server.folder.path.parent.rglob("*")) == before


def test_a_link_out_of_the_folder_is_not_followed(client):
    link = client.server.folder.path / "link.json"
    link.symlink_to("../outside.json")
    try:
        assert "link.json" not in client.json("api/files")[1]["files"]
        assert client("api/run", session() | {"structure": {"kind": "file", "file": "link.json"}})[0] == 422
        assert client("api/upload?name=link.json", b"new")[0] == 422
        assert (client.server.folder.path.parent / "outside.json").read_text() == "{}"
    finally:
        link.unlink()


def test_an_upload_is_kept_and_never_replaces_another_file(client):
    assert client.json("api/upload?name=my%20wall.json", b"1") == (200, {"file": "my wall.json"})
    assert client("api/upload?name=my%20wall.json", b"1")[0] == 200
    status, found = client.json("api/upload?name=my%20wall.json", b"2")
    assert status == 422
    assert "already" in found["error"]["text"]
    path = client.server.folder.path / "my wall.json"
    assert path.read_bytes() == b"1"
    assert "my wall.json" in client.json("api/files")[1]["files"]
    path.unlink()


def test_a_large_upload_is_refused_before_it_is_read(client):
    with socket.create_connection(("127.0.0.1", client.port), timeout=10) as connection:
        head = f"POST /{client.server.token}/api/upload?name=a.json HTTP/1.1\r\nHost: 127.0.0.1:{client.port}\r\n"
        head += f"Origin: {client.origin}\r\nContent-Length: 300000000\r\n\r\n"
        connection.sendall(head.encode())  # and not a byte of the 300 MB
        answer = connection.recv(1000)
    assert b" 413 " in answer.splitlines()[0]
    assert not list(client.server.folder.path.glob("a.json"))
    assert folder.LARGEST < 300e6


def test_a_request_without_length_or_json_is_refused(client):
    with socket.create_connection(("127.0.0.1", client.port), timeout=10) as connection:
        head = f"POST /{client.server.token}/api/run HTTP/1.1\r\nHost: 127.0.0.1:{client.port}\r\n"
        connection.sendall(f"{head}Origin: {client.origin}\r\nTransfer-Encoding: chunked\r\n\r\n".encode())
        assert b" 411 " in connection.recv(1000).splitlines()[0]
    for body in (b"", b"[", b"[]", b"\xff", b"[" * 100_000):
        assert client("api/run", body)[0] == 400


@pytest.mark.parametrize("change", [
    {"structure": {"kind": "__import__('os')"}}, {"structure": 3},
    {"joint": {"x=1);import os;(": "1"}}, {"joint": []},
    {"loads": {"kind": "scaled"}}, {"loads": {"kind": "own"}}, {"loads": {"kind": "horizontal", "more": "x"}},
    {"analysis": {"kind": "view"}}, {"analysis": {"kind": 3}},
    {"structure": {"kind": "experiment", "source": "../x", "specimen": "y"}},
])  # fmt: skip
def test_a_session_that_no_page_sends_is_refused(client, change):
    status, found = client.json("api/script", session() | change)
    assert status == 422
    assert found["error"]["name"] == "InputError"


HOSTILE = ['"); import os; os.system("touch hacked"); ("', "'''", '"""', "\\", "\n", "\r\nimport os", "{}",
           "{0}", "\ud800", "#", "__import__('os').getcwd()", "1e999",
           "1_000", "0x10", "٣", "1j", "\u2028"]  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE)
def test_what_is_typed_stays_a_value(client, text):
    # every statement is one assignment of one call with plain values, whatever was typed anywhere
    body = session("wall", joint={"cohesion": text}, unit=f"0.4, {text}", bond=text, more=[
        {"kind": "with_point_load", "values": {"block": text, "force": f"0, 0, {text}"}}])  # fmt: skip
    status, found = client.json("api/script", body)
    assert status == 200
    tree = ast.parse(found["script"])
    load = {"kind": "with_point_load", "values": {"block": "b", "force": "0, 0, 1"}}
    plain = ast.parse(client.json("api/script", session("wall", more=[load]))[1]["script"])
    assert [type(n) for n in tree.body] == [type(n) for n in plain.body]
    called, known = ({ast.unparse(n.func) for n in ast.walk(t) if isinstance(n, ast.Call)} for t in (tree, plain))
    assert called <= known | {"float"}


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
        ("more", "with_pressure", "pressure"): "Pa", ("analysis", "pushover", "to"): "m",
        ("drawing", "drawing", "mortar"): "m", ("drawing", "drawing", "density"): "kg/m3",
    }  # fmt: skip
    units = {
        (part, name, f.name): f.unit
        for part, group in forms.calls().items() for name, call in group.items() for f in call.fields
        if f.kind in ("number", "numbers")
    }  # fmt: skip
    assert told.items() <= units.items()
    without = {key[2] for key, unit in units.items() if unit == "-"}
    # counts, ratios and directions
    assert without == {
        "courses", "leaves", "header_every", "pier_courses", "voussoirs", "lunes", "direction", "grid", "scale"
    }


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
])  # fmt: skip
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
                        "loads": {"kind": "own"}}  # fmt: skip
    monkeypatch.setitem(sys.modules, "svg.path", None)
    monkeypatch.chdir(tmp_path)
    lines = script.statements(body, folder.Folder(tmp_path), kind="draw")
    error = worker.run(lines, str(tmp_path))["error"]
    assert (error["part"], error["name"]) == ("structure", "ImportError")
    assert "pip install 'limitmason[app]'" in error["text"]


def endless(pipe, _folder):
    """A worker that never ends by itself."""
    while True:
        pipe.recv()
        pipe.send(("progress", 0.25, "so far"))
        time.sleep(1000)


@pytest.mark.slow
def test_cancel_ends_the_process_and_a_second_solve_is_told_to_wait(tmp_path):
    with Server(str(tmp_path)) as server:
        server.jobs = jobs.Jobs(str(tmp_path), target=endless)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        client = Client(server)
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
        server.shutdown()
    assert not alive(last)  # nor does the end of the server leave one


@pytest.mark.slow
def test_a_page_that_is_closed_leaves_no_process_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "GRACE", 0.2)
    with Server(str(tmp_path)) as server:
        server.jobs = jobs.Jobs(str(tmp_path), target=endless)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        client = Client(server)
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
        server.shutdown()


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


# --- the command


def test_a_port_in_use_and_a_folder_that_is_not_there_are_named(client, tmp_path):
    with pytest.raises(InputError, match=f"--port {client.port} cannot be had"):
        Server(str(tmp_path), client.port)
    with pytest.raises(InputError, match="--port 70000"):
        Server(str(tmp_path), 70000)
    with pytest.raises(InputError, match="no folder"):
        Server(str(tmp_path / "none"))


def test_the_command_prints_the_address_and_ends_with_ctrl_c(tmp_path, capsys, monkeypatch):
    from limitmason import cli

    def interrupted(server):
        raise KeyboardInterrupt

    monkeypatch.setattr(Server, "serve_forever", interrupted)
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert cli.main(["app", "--folder", str(tmp_path), "--no-browser"]) == 0
    out = capsys.readouterr()
    assert out.out.startswith("http://127.0.0.1:")
    assert opened == []
    assert cli.main(["app", "--folder", str(tmp_path)]) == 0
    assert opened == [capsys.readouterr().out.strip()]
