"""Requests to the application, as its page sends them, and whether a process is still there."""

import http.client
import json
import os
import threading
import time
from contextlib import contextmanager
from pathlib import Path

from limitmason.app import forms
from limitmason.app.server import Server


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


@contextmanager
def served(place):
    """A client of a server of its own on a folder."""
    with Server(str(place)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            yield Client(server)
        finally:
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
