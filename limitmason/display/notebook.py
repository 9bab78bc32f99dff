"""What a notebook shows of an object: its words, and the picture that ``limitmason.figures`` draws of it.

Drawing stands far above the model and its answers. They say only that they can be shown; who draws them is told here
once, by the package, and imported when something is shown for the first time.
"""

from collections.abc import Callable
from html import escape
from typing import Any, Protocol


class Drawing(Protocol):
    """What draws objects of this package."""

    def html(self, shown: Any) -> str:
        """Picture of an object as HTML, or empty where there is none."""
        ...

    def plot(self, shown: Any, **options: Any) -> Any:
        """Figure of an object."""
        ...


_drawing: list[Callable[[], Drawing]] = []


def draws(load: Callable[[], Drawing]) -> None:
    """Say who draws, by a function that imports it."""
    _drawing[:] = [load]


class Displayed:
    """An object that a notebook shows with its picture, and that ``plot()`` draws."""

    def plot(self, **options: Any) -> Any:
        """Draw this object as a ``matplotlib.figure.Figure``.

        The options are those of the function that draws it.

        Raises
        ------
        InputError
            Where there is nothing to draw; the message says why.
        """
        return _drawing[0]().plot(self, **options)

    def _repr_html_(self) -> str:
        """Its words and its picture."""
        text = f'<pre style="white-space: pre-wrap">{escape(str(self))}</pre>'
        return text + (_drawing[0]().html(self) if _drawing else "")


def html_table(head: list[str], rows: list[list[str]], notes: list[str]) -> str:
    """A table as HTML, with lines below it."""
    cells = "".join(f"<th>{escape(c)}</th>" for c in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    below = "".join(f"<br>{escape(n)}" for n in notes)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>{below}"
