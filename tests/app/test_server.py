"""Who the application answers, and what it refuses: tokens, origins, hosts, paths, names, sizes, code as a value."""

import ast
import socket
from urllib.parse import quote

import pytest
from application import served, session

from limitmason.app import folder
from limitmason.app.server import Server
from limitmason.errors import InputError


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    place = tmp_path_factory.mktemp("app")
    (place / "outside.json").write_text("{}")
    (place / "chosen").mkdir()
    with served(place / "chosen") as found:
        yield found


# --- who is answered


def test_the_page_comes_with_what_it_needs_and_forbids_the_rest(client):
    status, content, headers = client("")
    assert status == 200
    assert b"app.js" in content
    assert b"http" not in content  # nothing from elsewhere
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    for name in ("form.js", "app.js", "app.css"):
        status, content, _ = client(name)
        assert status == 200
        assert b"http:" not in content


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
                                    "http://localhost.evil:{port}", None])
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
                                  "server.py", "__init__.py"])
def test_no_path_leads_out_of_the_page(client, path):
    assert client(path)[0] == 404


NAMES = ["../outside.json", "/etc/passwd", "a/b.json", "..", "", "x" * 300 + ".json", "a\0.json", "a\n.json",
         "..\\x.json", ".json", ".hidden.json", "c:x.json", "<script>.json", "wall.exe", "wall.py"]


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
])
def test_a_session_that_no_page_sends_is_refused(client, change):
    status, found = client.json("api/script", session() | change)
    assert status == 422
    assert found["error"]["name"] == "InputError"


HOSTILE = ['"); import os; os.system("touch hacked"); ("', "'''", '"""', "\\", "\n", "\r\nimport os", "{}",
           "{0}", "\ud800", "#", "__import__('os').getcwd()", "1e999",
           "1_000", "0x10", "٣", "1j", "\u2028"]


@pytest.mark.parametrize("text", HOSTILE)
def test_what_is_typed_stays_a_value(client, text):
    # every statement is one assignment of one call with plain values, whatever was typed anywhere
    body = session("wall", joint={"cohesion": text}, unit=f"0.4, {text}", bond=text, more=[
        {"kind": "with_point_load", "values": {"block": text, "force": f"0, 0, {text}"}}])
    status, found = client.json("api/script", body)
    assert status == 200
    tree = ast.parse(found["script"])
    load = {"kind": "with_point_load", "values": {"block": "b", "force": "0, 0, 1"}}
    plain = ast.parse(client.json("api/script", session("wall", more=[load]))[1]["script"])
    assert [type(n) for n in tree.body] == [type(n) for n in plain.body]
    called, known = ({ast.unparse(n.func) for n in ast.walk(t) if isinstance(n, ast.Call)} for t in (tree, plain))
    assert called <= known | {"float"}


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
