"""What a terminal and a notebook show of an object: its words, and the picture that ``limitmason.figures`` draws of it.

Every class of a package has a short text and an HTML form: :func:`shows` gives them, so that a new class has them too.
A class that says more has its own ``__str__``.

Drawing stands far above the model and its answers. They say only that they can be shown; who draws them is told here
once, by the package, and imported when something is shown for the first time.
"""

import collections
import dataclasses
import inspect
import re
import reprlib
import sys
from collections.abc import Callable, Mapping
from enum import Enum
from html import escape
from typing import Any, Protocol

import numpy as np

_WIDE = 70
"""Longest text of one field; of what is longer only the kind and the size are shown."""

_PACKAGES = ("limitmason", "dem", "mechanisms")
_seen: set[str] = set()  # names of modules whose classes have been looked at

_GENERATED = (dataclasses.__file__, collections.__file__, reprlib.__file__)
"""Files whose code makes the methods of dataclasses and named tuples: such a method was written by nobody."""

_FEW = 6
"""Longest array, list or mapping whose items are shown."""


class Drawing(Protocol):
    """What draws objects of this package."""

    def html(self, shown: Any) -> str:
        """Picture of an object as HTML, or empty where there is none."""
        ...

    def plot(self, shown: Any, *which: Any, **options: Any) -> Any:
        """Figure of an object."""
        ...


_drawing: list[Callable[[], Drawing]] = []


def draws(load: Callable[[], Drawing]) -> None:
    """Say who draws, by a function that imports it."""
    _drawing[:] = [load]


class Displayed:
    """An object that a notebook shows with its picture, and that ``plot()`` draws."""

    def plot(self, *which: Any, **options: Any) -> Any:
        """Draw this object as a ``matplotlib.figure.Figure``.

        Arguments are those of the function that draws it, behind the object itself: the number of a mode, the column of
        a table.

        Raises
        ------
        InputError
            Where there is nothing to draw; the message says why.
        """
        return _drawing[0]().plot(self, *which, **options)

    def _repr_html_(self) -> str:
        """Its words and its picture."""
        return html_words(self) + (_drawing[0]().html(self) if _drawing else "")


def shows(caller: str) -> None:
    """Give classes of these packages a short text and an HTML form if they lack them.

    The text is one line: the first of the class's own words, or the fields that differ from their defaults. Arrays and
    whatever is long stand by kind and size alone. The HTML form holds all words, or a table of the fields with what the
    docstring says of each.

    Parameters
    ----------
    caller : name of the public package or module that calls this at its end; all other modules that are imported by
        then are looked at too, each once
    """
    for name, module in list(sys.modules.items()):
        if name in _seen or name.partition(".")[0] not in _PACKAGES:
            continue
        if name != caller and getattr(module.__spec__, "_initializing", False):
            continue  # half imported: its classes are not all there yet
        _seen.add(name)
        for kind in list(vars(module).values()):
            if isinstance(kind, type) and kind.__module__ == name and kind.__name__[0] != "_":
                _give(kind)


def _give(kind: type) -> None:
    """Give the class ``kind`` its line of text and its HTML where it has none."""
    if issubclass(kind, Enum | BaseException | str | float):  # these show themselves well
        return
    has_fields = dataclasses.is_dataclass(kind) or hasattr(kind, "_fields")
    if not has_fields and "__init__" not in vars(kind):
        return  # what other classes take in says nothing of them
    if kind.__repr__ is object.__repr__:
        kind.__repr__ = _line  # type: ignore[method-assign]
    if has_fields and "__repr__" in vars(kind) and not _written(kind, "__repr__"):
        if dataclasses.is_dataclass(kind) and any(_written(k, "__repr__") for k in kind.__mro__[1:]):
            del kind.__repr__  # a dataclass made one over that of the class from which it comes
        else:
            kind.__repr__ = _line  # type: ignore[method-assign]
    if not hasattr(kind, "_repr_html_"):
        kind._repr_html_ = html_words  # type: ignore[attr-defined]


def _written(kind: type, name: str) -> bool:
    """Whether the class ``kind`` itself has a method of that name that somebody wrote."""
    code = getattr(vars(kind).get(name), "__code__", None)
    # "<string>" is where a method was made by exec
    return code is not None and code.co_filename not in (*_GENERATED, "<string>")


def _line(self: Any) -> str:
    """The ``__repr__`` of a class: the first line of its own text, or its fields.

    Its own text is that of a ``__str__`` that somebody wrote.
    """
    name = type(self).__name__
    if any(_written(k, "__str__") for k in type(self).__mro__):
        return f"<{name}: {_cut(str(self).partition(chr(10))[0])}>"
    defaults = _defaults(type(self))
    fields = _fields(self)
    if not fields:
        return f"{name}()" if dataclasses.is_dataclass(self) else f"<{name}>"
    given = {k: v for k, v in fields.items() if not (k in defaults and _same(v, defaults[k]))}
    return f"{name}({_cut(', '.join(f'{k}={_short(v)}' for k, v in given.items()), times=3)})"


def _cut(text: str, times: int = 2) -> str:
    """A text of at most ``times`` the length of a field's, with dots where more would follow."""
    return text if len(text) <= times * _WIDE else f"{text[: times * _WIDE - 3]}..."


def _fields(shown: Any) -> dict[str, Any]:
    """Values by name of the public fields of a dataclass or a named tuple; of other objects there are none."""
    names = getattr(shown, "_fields", ())
    if dataclasses.is_dataclass(shown):
        names = [f.name for f in dataclasses.fields(shown) if f.repr]
    return {name: getattr(shown, name) for name in names if name[0] != "_"}


def _defaults(kind: Any) -> dict[str, Any]:
    """Defaults by name of the fields of the class ``kind`` that have one."""
    if hasattr(kind, "_field_defaults"):
        return dict(kind._field_defaults)
    made = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    plain = {f.name: f.default for f in made if f.default is not dataclasses.MISSING}
    return plain | {f.name: f.default_factory() for f in made if f.default_factory is not dataclasses.MISSING}


def _same(a: Any, b: Any) -> bool:
    """Whether a value ``a`` is a default ``b``; what holds arrays is one only as itself."""
    try:
        # NaN, which differs from itself, is the default NaN
        return a is b or (type(a) is type(b) and bool(a == b or (a != a and b != b)))
    except ValueError:  # arrays have no single truth
        return False


def _short(value: Any) -> str:
    """A value of a field in one line: itself if it is short, else its kind and size."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Enum):
        return repr(value.value)
    if isinstance(value, np.ndarray):
        if value.ndim < 2 and value.size <= _FEW and value.dtype.kind in "fi":
            return f"[{', '.join(f'{v:.6g}' for v in value.ravel())}]"
        return f"<array {' x '.join(map(str, value.shape))}>"
    if isinstance(value, str):
        return repr(value if len(value) <= _WIDE else f"{value[: _WIDE - 3]}...")
    inside = ""
    # the very types: a named tuple is shown by its own line
    row = type(value) in (tuple, list, set, frozenset)
    if row and len(value) <= _FEW:
        first, last = "()" if type(value) is tuple else "[]" if type(value) is list else "{}"
        comma = "," if type(value) is tuple and len(value) == 1 else ""
        inside = f"{first}{', '.join(map(_short, value))}{comma}{last}"
    elif isinstance(value, Mapping) and len(value) <= _FEW:
        inside = "{" + ", ".join(f"{_short(k)}: {_short(v)}" for k, v in value.items()) + "}"
    elif callable(value) and not dataclasses.is_dataclass(value):
        inside = f"<{getattr(value, '__name__', type(value).__name__)}>"
    elif not (row or isinstance(value, Mapping)):
        inside = repr(value)
    if inside and len(inside) <= _WIDE and "\n" not in inside:
        return inside
    plain = isinstance(value, list | dict | set | frozenset) or type(value) is tuple
    return f"<{type(value).__name__}{f' of {len(value)}' if plain else ''}>"


def html_words(shown: Any) -> str:
    """What the object ``shown`` says of itself, as HTML.

    It is the text that somebody wrote, or a table of its fields and what they mean.
    """
    # words that somebody wrote, not the line that every class is given here
    own = any(_written(k, n) for k in type(shown).__mro__ for n in ("__str__", "__repr__") if vars(k).get(n) != _line)
    if own or not _fields(shown):
        return f'<pre style="white-space: pre-wrap; font-family: monospace">{escape(str(shown))}</pre>'
    meanings = _meanings(type(shown))
    rows = [[name, _short(value), meanings.get(name, "")] for name, value in _fields(shown).items()]
    return f"<b>{escape(type(shown).__name__)}</b>" + html_table(["field", "value", "what it is"], rows, [], words=True)


def _meanings(kind: type) -> dict[str, str]:
    """What the docstring of the class ``kind`` says of its fields, by name: "a, b : words" is said of both."""
    out: dict[str, str] = {}
    section = re.search(r"Parameters\n-{5,}\n(.*?)(?:\n\n|\Z)", inspect.getdoc(kind) or "", flags=re.DOTALL)
    for names, words in re.findall(r"^([\w, ]+?) : (.*(?:\n +.*)*)", section[1] if section else "", re.MULTILINE):
        out |= dict.fromkeys(names.split(", "), " ".join(words.split()).replace("``", "").replace(":class:", ""))
    return out


def html_table(head: list[str], rows: list[list[str]], notes: list[str], *, words: bool = False) -> str:
    """A table as HTML.

    Parameters
    ----------
    head, rows : cells of the head, and of every row
    notes : lines below it
    words : whether cells hold words, which stand at the left; numbers stand where the page has them
    """
    look = ' style="text-align: left"' if words else ""
    cells = "".join(f"<th{look}>{escape(c)}</th>" for c in head)
    body = "".join("<tr>" + "".join(f"<td{look}>{escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    below = "".join(f"<br>{escape(n)}" for n in notes)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>{below}"
