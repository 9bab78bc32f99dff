"""The server of the page: on the loopback address, behind a random token, for pages of its own origin alone.

The largest file is stated in ``folder``.
"""

from __future__ import annotations

import json
import secrets
import socket
from collections.abc import Callable
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from limitmason.app import forms
from limitmason.app.folder import LARGEST, Folder
from limitmason.app.jobs import Busy, Computation, Jobs
from limitmason.app.script import source, statements
from limitmason.constants import VERSION
from limitmason.errors import InputError
from limitmason.experiments import registry

HOST = "127.0.0.1"
_LARGEST_SESSION = 500_000  # bytes
_BEAT = 1.0  # seconds between two signs of life to a page, by which one that has gone is noticed

# files of the page, by their addresses, with their types
_STATIC = {"": ("page.html", "text/html"), "app.css": ("app.css", "text/css"),
           **{name: (name, "text/javascript") for name in ("form.js", "app.js")}}
_TYPES = {"png": "image/png", "json": "application/json", "html": "text/html", "py": "text/x-python"}

# what a browser lets a page do: that of the application takes all from its own origin, and no other site may frame it
_OWN = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; frame-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# scenes and reports hold their script in themselves: they run it apart from the page, and reach nothing
_MADE = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)


class Refused(Exception):
    """A request that is not answered: status and reason."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


class Server(ThreadingHTTPServer):
    """The application: one folder, one process for solves, any number of pages.

    ``hosts`` are the names, with the port, by which it may be asked. ``token`` is the secret part of its address.

    Parameters
    ----------
    folder : the only place where files are read and written
    port : of the loopback address; 0 takes a free one

    Raises
    ------
    InputError
        For a port that is taken or that there is not, and a folder that there is not.
    """

    daemon_threads = True

    def __init__(self, folder: str = ".", port: int = 0) -> None:
        """Open the port under a token in the address, for this user's pages alone."""
        self.folder = Folder(folder)
        self.jobs = Jobs(str(self.folder.path))
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"--port {port} cannot be had ({error}): give another, or leave it out") from None
        self.token = secrets.token_urlsafe(24)  # bytes: more than can be guessed
        number = self.server_address[1]
        self.hosts = {f"{name}:{number}" for name in (HOST, "localhost")}

    allow_reuse_address = not hasattr(socket, "SO_EXCLUSIVEADDRUSE")  # on Windows it would take a port that is in use

    @property
    def url(self) -> str:
        """Address of the page, with its token."""
        return f"http://{HOST}:{self.server_address[1]}/{self.token}/"

    def server_close(self) -> None:
        """End the process of solves too."""
        super().server_close()
        self.jobs.close()

    def handle_error(self, _request: Any, _address: Any) -> None:
        """A page that went away in the middle of an answer is no error."""


class _Handler(BaseHTTPRequestHandler):
    """One connection: ``path`` is an address behind the token, without a leading slash."""

    server: Server
    server_version = "limitmason"
    sys_version = ""
    timeout = 60  # of a client that sends nothing

    def do_GET(self) -> None:
        """Answer what changes nothing."""
        self._answer(self._get)

    def do_POST(self) -> None:
        """Answer what acts."""
        self._answer(self._post)

    def log_message(self, _format: str, *_values: Any) -> None:
        """Say nothing: the address holds the token."""

    def _answer(self, how: Callable[[str, dict[str, str]], None]) -> None:
        """Answer a request, or say why not: wrong input is 422, a mistake of ours 500.

        Parameters
        ----------
        how : called with path and query of a request that may be answered
        """
        with suppress(ConnectionError, TimeoutError):
            try:
                path, query = self._allowed()
                how(path, query)
            except Refused as refusal:
                self.close_connection = True  # its body was perhaps not read: what follows would be taken for a request
                self._send(refusal.status, json.dumps({"error": refusal.reason}).encode(), "application/json")
            except InputError as error:
                self._json({"error": {"part": "structure", "name": "InputError", "text": str(error)}}, status=422)
            except ConnectionError:  # the page has gone, see above: there is nobody to tell
                raise
            except Exception as error:
                text = f"a mistake in limitmason, please report it: {error!r}"
                self._json({"error": {"part": "structure", "name": type(error).__name__, "text": text}}, status=500)

    def _allowed(self) -> tuple[str, dict[str, str]]:
        """Path behind the token, and the query by name, of a request.

        One that may not be answered is refused. The host keeps out names that another site had resolved to this
        machine, the origin its pages, the token users of this machine.
        """
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        if host not in self.server.hosts:
            raise Refused(403, "this host is not served")
        own = {f"http://{h}" for h in self.server.hosts}
        # browsers leave the origin out of a GET alone
        if (origin is not None and origin not in own) or (origin is None and self.command != "GET"):
            raise Refused(403, "this origin is not served")
        parts = urlsplit(self.path)
        token, _, path = parts.path[1:].partition("/")
        # compared in a time that does not tell how much of it is right
        if not secrets.compare_digest(token.encode(), self.server.token.encode()):
            raise Refused(403, "the token in the address is missing or wrong: open the address that the terminal shows")
        return unquote(path), {k: v[-1] for k, v in parse_qs(parts.query).items()}

    def _get(self, path: str, query: dict[str, str]) -> None:
        """Answer a request that changes nothing: pages, forms, files, events, results.

        Parameters
        ----------
        query : what follows "?" in the address, by name
        """
        if path in _STATIC:
            name, kind = _STATIC[path]
            self._send(200, files("limitmason.app").joinpath(name).read_bytes(), kind)
        elif path == "api/forms":
            self._json(self._forms())
        elif path == "api/files":
            self._json({"files": self.server.folder.names()})
        elif path == "api/experiment":
            at, specimen = query.get("source", ""), query.get("specimen", "")
            if at not in registry.sources() or specimen not in registry.specimens(at):
                raise Refused(404, "there is no such experiment")
            self._json({"fields": [vars(f) for f in forms.experiment_fields(at, specimen)],
                        "text": str(registry.load(at, specimen))})
        elif path == "api/events":
            self._events()
        elif path.startswith("api/result/"):
            self._result(path.removeprefix("api/result/"), download="download" in query)
        else:
            raise Refused(404, "there is nothing here")

    def _post(self, path: str, query: dict[str, str]) -> None:
        """Answer a request that acts: cancel, upload, write or run a script.

        Parameters
        ----------
        query : what follows "?" in the address, by name
        """
        if path == "api/cancel":
            self.server.jobs.cancel()
            self.server.jobs.warm()
            self._json({})
        elif path == "api/upload":
            self._json({"file": self.server.folder.add(query.get("name", ""), self._body(LARGEST))})
        elif path in ("api/script", "api/run"):
            try:
                session = json.loads(self._body(_LARGEST_SESSION))
            except (ValueError, RecursionError):
                raise Refused(400, "the session is no JSON") from None
            if not isinstance(session, dict):
                raise Refused(400, "the session is no object")
            self._session(path, session, query.get("kind", "solve"))
        else:
            raise Refused(404, "there is nothing here")

    def _session(self, path: str, session: dict[str, Any], kind: str) -> None:
        """Answer with the script of a session, or run it as a job (409 if busy).

        Parameters
        ----------
        path : "api/script" or "api/run"
        session : as the page sends it
        kind : "draw", "solve" or "report"
        """
        if kind not in ("draw", "solve", "report"):
            raise Refused(400, "kind is draw, solve or report")
        lines = statements(session, self.server.folder, kind=kind)
        if path == "api/script":
            self._json({"script": source(lines)})
            return
        try:
            job = self.server.jobs.start(kind, lines)
        except Busy as busy:
            self._json({"error": {"part": "analysis", "name": "Busy", "text": str(busy)}}, status=409)
            return
        self._json({"job": job.number})

    def _forms(self) -> dict[str, Any]:
        """All forms, packaged experiments and files, as the page asks for them when it opens."""
        parts = {part: {name: c.as_json() for name, c in group.items()} for part, group in forms.calls().items()}
        cases = {at: list(registry.specimens(at)) for at in registry.sources()}
        return {"calls": parts, "experiments": cases, "files": self.server.folder.names(), "version": VERSION,
                "folder": self.server.folder.path.name, "largest": LARGEST}

    def _events(self) -> None:
        """Tell a page how far the job is until the page goes away.

        Writing to a page that has gone ends in an error.
        """
        if not self.server.jobs.page_opened():
            raise Refused(409, "the application is open in too many pages: close one")
        self.close_connection = True
        try:
            self._head(200, "text/event-stream", length=None)
            said = ""
            while True:
                job = self.server.jobs.last()
                text = json.dumps(job.as_json()) if job is not None else "{}"
                self.wfile.write((f"data: {text}\n\n" if text != said else ": alive\n\n").encode())
                self.wfile.flush()
                said = text
                self.server.jobs.wait(_BEAT)
        finally:
            self.server.jobs.page_closed()

    def _result(self, path: str, *, download: bool) -> None:
        """Send what a job gave as JSON, or one of its files.

        Parameters
        ----------
        path : number of the job, and behind a slash the name of a file
        download : whether the browser is to keep the file
        """
        number, _, name = path.partition("/")
        # a number of ten digits and more is that of no job
        job = self.server.jobs.get(int(number)) if number.isdecimal() and len(number) < 10 else None
        if job is None:
            raise Refused(404, "this result is no longer kept: solve again")
        if not name:
            held = {k: v for k, v in job.result.items() if k != "files"}
            done = job.done_lines()
            self._json({**job.as_json(), **held, "files": sorted(job.result.get("files", ())), "script": source(done),
                        "lines": [line.text for line in done if line.shows]})
            return
        data = self._file(job, name)
        kind = name.rpartition(".")[2]
        self._send(200, data, _TYPES.get(kind, "application/octet-stream"), policy=_MADE if kind == "html" else _OWN,
                   attachment=name if download else None)

    def _file(self, job: Computation, name: str) -> bytes:
        """Bytes of a file that a job has made, by its name; its script is one too."""
        if name == "session.py":
            return source(job.done_lines()).encode()
        data = job.result.get("files", {}).get(name)
        if data is None:
            raise Refused(404, "the job has no such file")
        return bytes(data)

    def _body(self, most: int) -> bytes:
        """What a request brings, refused where it announces more than ``most`` bytes.

        It is refused before any of it is read.
        """
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or len(length) > 15:  # an endless number is not worth reading
            raise Refused(411, "the length is missing")
        if int(length) > most:
            raise Refused(413, f"{int(length) / 1e6:.0f} MB are too much: at most {most / 1e6:g} MB")
        data = self.rfile.read(int(length))
        if len(data) < int(length):
            raise Refused(400, "the request broke off")
        return data

    def _json(self, data: Any, status: int = 200) -> None:
        """Send data as JSON."""
        self._send(status, json.dumps(data, allow_nan=False).encode(), "application/json")

    def _send(self, status: int, data: bytes, kind: str, *, policy: str = _OWN, attachment: str | None = None) -> None:
        """Send bytes of a media type ``kind``; the other arguments are those of :meth:`_head`."""
        self._head(status, kind, len(data), policy, attachment)
        self.wfile.write(data)

    def _head(
        self, status: int, kind: str, length: int | None, policy: str = _OWN, attachment: str | None = None
    ) -> None:
        """Send the head of an answer, which keeps other sites from using it.

        Parameters
        ----------
        status : code of the answer
        kind : media type
        length : bytes, None where not known
        policy : what the page may load
        attachment : name under which a browser keeps it
        """
        self.send_response(status)
        text = kind.startswith("text/") or kind == "application/json"
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if text else kind)
        if length is not None:
            self.send_header("Content-Length", str(length))
        if attachment is not None:
            self.send_header("Content-Disposition", f'attachment; filename="{attachment}"')
        for name, value in (
            ("Content-Security-Policy", policy), ("X-Content-Type-Options", "nosniff"), ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"), ("Cross-Origin-Resource-Policy", "same-origin"),
        ):
            self.send_header(name, value)
        self.end_headers()
