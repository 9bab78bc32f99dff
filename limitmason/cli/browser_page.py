"""The command ``app``: serve the page of :mod:`limitmason.app` to a browser."""

from __future__ import annotations

import argparse
import webbrowser

from limitmason.cli import console


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``app`` to the commands."""
    app = console.command(
        commands, "app", _serve,
        help="open the application in the browser: build or load a structure, solve, look, download the script",
        description="Serves one page on the loopback address of this machine, behind a random token, until Ctrl-C. It "
        "reads and writes files of the chosen folder alone, and uses no network.",
    )
    app.add_argument("--port", type=int, default=0, help="of the loopback address; default: a free one")
    app.add_argument("--folder", default=".", metavar="FOLDER", help="the only one whose models and drawings are read, "
                     "and where uploads are kept; default: the current one")
    app.add_argument("--no-browser", action="store_true", help="only print the address")


def _serve(options: argparse.Namespace) -> int:
    """Serve the page until it is interrupted.

    The folder and the port are those of ``options``.
    """
    from limitmason.app.server import Server

    with Server(options.folder, options.port) as server:
        console.show_text(server.url)
        console.say(f"folder {server.folder.path}; Ctrl-C ends the application")
        if not options.no_browser:
            webbrowser.open(server.url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            console.say("ended")
    return 0
