"""The code blocks of a page: run in order, compared with the output shown below each, pictures kept beside the page.

    python docs/site/page_blocks.py PAGE.md ...

runs pages and writes what they print and draw back into them; the tests run them and compare.
"""

import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

_BLOCK = re.compile(r"```python\n(?P<code>.*?)```\n(?:\n```text\n(?P<shown>.*?)```\n)?", flags=re.DOTALL)
_PICTURE = re.compile(r"!\[[^\]]*\]\(images/([^)]+)\)")


class Block(NamedTuple):
    """Code of a page and the output that the page shows below it; None where it shows none."""

    code: str
    shown: str | None


def blocks(text: str) -> list[Block]:
    """The Python blocks of a page in order, each with the block of text that follows it at once."""
    return [Block(m["code"], m["shown"]) for m in _BLOCK.finditer(text)]


def pictures(text: str) -> list[str]:
    """Names of the pictures in the folder ``images`` that a page shows."""
    return _PICTURE.findall(text)


def run(text: str, folder: Path) -> list[str]:
    """Run the blocks of a page in one namespace and a folder of their own.

    Parameters
    ----------
    text : of the page
    folder : where the code runs; what it draws is left there

    Returns
    -------
    list
        What each block printed.
    """
    scope: dict[str, object] = {"__name__": "__main__"}
    printed = []
    with contextlib.chdir(folder):
        for number, block in enumerate(blocks(text), 1):
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(compile(block.code, f"<block {number}>", "exec"), scope)
            printed.append(out.getvalue())
    return printed


def with_outputs(text: str, printed: list[str]) -> str:
    """The page with the output of every block below it."""
    fresh = iter(printed)

    def shown(match: re.Match[str]) -> str:
        out = next(fresh)
        return f"```python\n{match['code']}```\n" + (f"\n```text\n{out}```\n" if out else "")

    return _BLOCK.sub(shown, text)


def main(pages: list[str]) -> None:
    """Run pages and write what they print and draw back into them."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    for page in (Path(p).resolve() for p in pages):
        text = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as name:
            printed = run(text, Path(name))
            page.write_text(with_outputs(text, printed), encoding="utf-8")
            for picture in pictures(text):
                (page.parent / "images").mkdir(exist_ok=True)
                shutil.copy(Path(name) / picture, page.parent / "images" / picture)


if __name__ == "__main__":
    main(sys.argv[1:])
