"""Pages of HTML that need nothing else: style, figures, tables and lists."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from limitmason.storage.files import write_text

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 62rem; margin: 2rem auto;
       padding: 0 1rem; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: .2rem 0 1rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .5rem; border-bottom: 1px solid #ccc; padding-bottom: .2rem; }
.title { color: #666; margin: 0; }
.list { background: #fff4e8; border-left: 4px solid #d55e00; padding: .6rem 1rem; }
table { border-collapse: collapse; font-size: .88rem; margin: .6rem 0; }
th, td { text-align: left; vertical-align: top; padding: .25rem .7rem .25rem 0; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; }
td:last-child:not(.n) { min-width: 14em; }
td.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.kept td { font-weight: 600; }
.wide { overflow-x: auto; }
pre { white-space: pre-wrap; font-size: .82rem; }
img { max-width: 100%; height: auto; }
small, .small { color: #666; font-size: .85rem; }
"""

_DOTS, _SHOWN = 160, 130
"""Dots of a picture, and pixels of the page that it takes, per inch of the figure; chosen: legible, and sharp when
enlarged a little."""


def write_page(path: str | Path, title: str, parts: Sequence[str]) -> Path:
    """Write HTML ``parts`` as a page under a plain ``title``, and return its path."""
    text = (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )
    return write_text(path, text)


def image(figure: Figure, description: str) -> str:
    """HTML of a figure as part of the page; ``description`` is read out."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS)
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    width = round(figure.get_size_inches()[0] * _SHOWN)
    return f'<img alt="{escape(description)}" width="{width}" src="data:image/png;base64,{data}">'


def paragraphs(sentences: Iterable[str]) -> str:
    """HTML of plain sentences, a paragraph each."""
    return "".join(f"<p>{escape(s)}</p>" for s in sentences)


def bullets(sentences: Iterable[str]) -> str:
    """HTML of plain sentences as a list."""
    return "<ul>" + "".join(f"<li>{escape(s)}</li>" for s in sentences) + "</ul>"


def table(header: Sequence[str], rows: Iterable[tuple[str, Sequence[Any]]]) -> str:
    """HTML of a table.

    Parameters
    ----------
    header : names of the columns
    rows : class of the style sheet and cells of every row; "kept" is set in bold, "" is plain. Cells are plain text; a
        number is a one-tuple of its text, and is set flush right
    """
    lines = ["<tr>" + "".join(f"<th>{escape(h)}</th>" for h in header) + "</tr>"]
    for kind, cells in rows:
        shown = [
            f'<td class="n">{escape(c[0])}</td>' if isinstance(c, tuple) else f"<td>{escape(str(c))}</td>"
            for c in cells
        ]
        lines.append(f'<tr class="{kind}">' + "".join(shown) + "</tr>")
    return '<div class="wide"><table>' + "\n".join(lines) + "</table></div>"
