"""Fingerprint of what a stored result belongs to: models, functions with all that they use, and plain values.

``memo`` compares it, and refuses a store with another one.
"""

from __future__ import annotations

import dis
import hashlib
import sys
import sysconfig
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, partial
from importlib import import_module
from itertools import takewhile
from logging import Logger
from pathlib import Path, PurePath
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from limitmason.model.blockwork import Blockwork
from limitmason.model.load import Loads

_PYTHON = frozenset(sys.stdlib_module_names) - {"types", "collections"} | frozenset(sys.builtin_module_names)
_OF_CLASSES = ("__", "_abc_")  # names under which Python keeps what it knows of a class
_PART_OF = ("LOAD_ATTR", "LOAD_METHOD")  # instructions that take a part of a value
# what counts of a module that is held as a whole: functions, classes and data, not open files and the like
_OF_MODULES = (
    FunctionType, type, ModuleType, np.ndarray, bool, int, float, complex, str, bytes, tuple, list, dict, set,
    frozenset,
)


def fingerprint(*parts: Any) -> str:
    """Hash of models, loads, functions and plain values.

    Equal for equal content, whatever the process or the machine.

    Parameters
    ----------
    parts : assemblies, loads, arrays, mappings, sequences, numbers, text; functions, with their code, constants,
        defaults, what they close over and what they read of their module and of others of one's own; objects, with
        their fields and, of classes of one's own, their code

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    TypeError
        For objects without a content of their own, such as open files; the message says what holds them.

    Notes
    -----
    This package and others that are installed count by name; a :class:`Memo` keeps the version of this one itself. When
    in doubt two things differ: code compiled by another version of Python is other code.
    """
    return _fingerprint(parts, state=True)


def fingerprint_of_code(*parts: Any) -> str:
    """Fingerprint without the lists, mappings and sets that parts hold as state.

    Such state of functions and objects is, for example, a counter. For functions whose author says when they change,
    see :func:`fingerprint`.
    """
    return _fingerprint(parts, state=False)


def _fingerprint(parts: tuple[Any, ...], *, state: bool) -> str:
    """Hash of the content of ``parts``; with what functions hold now where ``state``."""
    digest = _Digest(state)
    for part in parts:
        digest.feed(part)
    return digest.made.hexdigest()


class _Digest:
    """A hash that is fed values, each with a tag of its kind: 1 and "1" differ.

    Attributes
    ----------
    made : the hash so far
    state : whether collections that functions and objects hold are fed too
    seen : functions, classes and modules that were fed, by id and with their number: they may lead to themselves
    open : ids of other values that are being fed
    """

    def __init__(self, state: bool) -> None:
        self.made, self.state = hashlib.sha256(), state
        self.seen: dict[int, int] = {}
        self.open: set[int] = set()

    def tag(self, *words: object) -> None:
        """Add words, parted by a sign, so that ("a", "b") and ("ab",) differ."""
        self.made.update((":".join(map(str, words)) + ";").encode("utf-8", "surrogatepass"))

    def feed(self, value: Any) -> None:
        """Add a value: plain ones here, those with parts by the other methods.

        What was fed before, or is being fed, is not fed once more.
        """
        if isinstance(value, Enum):
            self.tag("member", type(value).__qualname__, value.name)
            if not _installed(type(value).__module__):
                self.feed(value.value)
        elif isinstance(value, np.generic):
            self.feed(value.item())
        elif isinstance(value, bool | int | float | complex | str | bytes | type(None) | type(Ellipsis)):
            self.tag(type(value).__name__, value.hex() if isinstance(value, float) else repr(value))
        elif isinstance(value, np.ndarray) and value.dtype != object:
            self.tag("array", value.shape, value.dtype.str)
            self.made.update(np.ascontiguousarray(value).tobytes())
        elif isinstance(value, FunctionType | type | ModuleType):
            if id(value) in self.seen:
                self.tag("again", self.seen[id(value)])
            else:
                self.seen[id(value)] = len(self.seen)
                if isinstance(value, FunctionType):
                    self.feed_function(value)
                elif isinstance(value, type):
                    self.feed_class(value)
                else:
                    self.feed_module(value)
        elif id(value) in self.open:
            raise TypeError(f"a {type(value).__name__} holds itself, so that it has no content of an end")
        else:
            self.open.add(id(value))
            self.feed_whole(value)
            self.open.remove(id(value))

    def feed_whole(self, value: Any) -> None:
        """Add a value with parts: models, collections, paths, code, objects.

        Each has a tag of its kind, then its parts are fed one by one, in an order that does not hang on chance.
        """
        if isinstance(value, Blockwork):
            self.tag("assembly", value.fingerprint.digest)
            # what the model's own fingerprint leaves out, and a stored result may still depend on
            labels = [*(i.joint.name for i in value.interfaces), *(t.name for t in value.ties)]
            labels += [b.material.name if b.material else "" for b in value.blocks]
            self.feed((value.recipe, value.contact_rules, labels))
        elif isinstance(value, Loads):
            self.tag("loads")
            self.feed((value.dead, value.live, value.dead_arms, value.live_arms))
        elif isinstance(value, Mapping):
            self.tag("mapping", len(value))
            for key, item in sorted(value.items(), key=lambda entry: (str(type(entry[0])), repr(entry[0]))):
                self.feed(key)
                self.feed(item)
        elif isinstance(value, list | tuple | np.ndarray):
            self.tag("sequence", len(value))
            for item in value:
                self.feed(item)
        elif isinstance(value, set | frozenset):
            self.tag("set", len(value))
            for item in sorted(self.alone(v) for v in value):
                self.tag(item)
        elif isinstance(value, PurePath):
            self.tag("path", value)
        elif isinstance(value, CodeType):
            self.feed_code(value)
        elif isinstance(value, MethodType):
            self.tag("method")
            self.feed((value.__self__, value.__func__))
        elif isinstance(value, partial):
            self.tag("partial")
            self.feed((value.func, value.args, value.keywords))
        elif isinstance(value, BuiltinFunctionType | np.ufunc):
            self.tag(type(value).__name__, getattr(value, "__module__", ""), value.__name__)
        elif isinstance(value, Logger):
            self.tag("logger", value.name)
        elif isinstance(getattr(value, "__wrapped__", getattr(value, "py_func", None)), FunctionType):
            self.feed(getattr(value, "__wrapped__", None) or value.py_func)  # cached, or compiled by numba
        else:
            self.feed_object(value)

    def alone(self, member: Any) -> str:
        """Hash of one member of a set, to sort by.

        It knows what was fed before the set, so that what leads back ends. It knows no other member, as a set has no
        order.
        """
        own = _Digest(self.state)
        own.seen, own.open = dict(self.seen), set(self.open)
        own.feed(member)
        return own.made.hexdigest()

    def feed_attribute(self, owner: str, name: str, value: Any) -> None:
        """Add a value that a function or an object holds under a name.

        :func:`fingerprint_of_code` leaves out collections that may change: they are state, as of a counter.

        Parameters
        ----------
        owner, name : of what holds it and under which name, for the error where it has no content
        value : what is held
        """
        if not self.state and isinstance(value, list | dict | set | bytearray):
            return
        self.tag(name)
        try:
            self.feed(value)
        except TypeError as error:
            raise TypeError(f"{owner} uses {name!r}: {error}") from None

    def feed_code(self, code: CodeType) -> None:
        """Add what compiled Python code does: instructions, constants and names.

        Constants hold the functions within it. In which file and line the code stands does not count.
        """
        self.tag("code", code.co_code.hex(), code.co_names, code.co_varnames, code.co_freevars)
        self.tag(code.co_exceptiontable.hex(), code.co_flags)
        self.tag(code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount)
        for constant in code.co_consts:
            self.feed(constant)

    def feed_function(self, function: FunctionType) -> None:
        """Add a function with its defaults and all values that it reads from around it.

        One that is installed counts by its name; of any other the code counts, and what that reads of its module.
        """
        self.tag("function", function.__qualname__)
        if _installed(function.__module__):
            self.tag(function.__module__)
            reads: Mapping[str, Any] = _closed_over(function)
        else:
            self.feed_code(function.__code__)
            reads = {**_closed_over(function), **_read_of_module(function)}
        self.feed((function.__defaults__, function.__kwdefaults__))
        for name, value in sorted(reads.items()):
            self.feed_attribute(function.__qualname__, name, value)

    def feed_class(self, kind: type) -> None:
        """Add a class, ``kind``: by name where it is installed, else with its code too."""
        self.tag("class", kind.__module__ if _installed(kind.__module__) else "", kind.__qualname__)
        if _installed(kind.__module__):
            return
        self.feed(kind.__bases__)
        for name, value in sorted(vars(kind).items()):
            if hasattr(type(value), "__get__") and not isinstance(value, FunctionType):
                # of a class method, a property, or a method that keeps its values, the function
                inner = ("__func__", "fget", "__wrapped__", "py_func", "func")
                value = next((getattr(value, n) for n in inner if hasattr(value, n)), None)
            if isinstance(value, FunctionType) or not name.startswith(_OF_CLASSES):
                self.feed_attribute(kind.__qualname__, name, value)

    def feed_module(self, module: ModuleType) -> None:
        """Add a ``module``: by name where it is installed, else with its text and values.

        Its values count as they may be taken from other modules.
        """
        self.tag("module", module.__name__)
        if _installed(module.__name__):
            return
        file = getattr(module, "__file__", None)
        self.feed(Path(file).read_bytes() if file and Path(file).is_file() else None)
        for name, value in sorted(vars(module).items()):
            if not name.startswith("__") and isinstance(value, _OF_MODULES):
                self.feed_attribute(module.__name__, name, value)

    def feed_object(self, value: Any) -> None:
        """Add an object by its class and fields; one without content is refused."""
        kind = type(value)
        if isinstance(value, np.random.Generator):
            self.tag("generator")
            self.feed(value.bit_generator.state)
            return
        if hasattr(value, "dist") and hasattr(value, "kwds"):  # a distribution of scipy.stats with its parameters
            self.tag("distribution", value.dist.name)
            self.feed((type(value.dist), value.args, value.kwds))
            return
        if is_dataclass(value):
            held: Mapping[str, Any] = {f.name: getattr(value, f.name) for f in fields(value)}
        elif kind.__module__ in ("datetime", "decimal", "fractions", "uuid") or kind in (range, slice):
            held = {"": repr(value)}
        elif hasattr(value, "__dict__") and kind.__module__.partition(".")[0] not in _PYTHON:
            held = vars(value)
        else:
            raise TypeError(
                f"a {kind.__name__} has no content to identify a stored result by; leave the store out, or give a key"
            )
        self.feed_class(kind)
        for name, item in sorted(held.items()):
            self.feed_attribute(f"a {kind.__qualname__}", name, item)


def _closed_over(function: FunctionType) -> dict[str, Any]:
    """Values of the functions around it that a function reads, by name.

    One that is not filled yet is None.
    """
    out = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            out[name] = cell.cell_contents
        except ValueError:  # not filled yet
            out[name] = None
    return out


def _read_of_module(function: FunctionType) -> dict[str, Any]:
    """Values that a function, with those within it, reads of its module or imports.

    They are found by its instructions. Of another module of one's own the values that are read count, under names with
    dots: ``model.size``. It counts as a whole where the code holds on to it.
    """
    found: dict[str, Any] = {}
    codes, space = [function.__code__], function.__globals__
    while codes:
        code = codes.pop()
        codes += [c for c in code.co_consts if isinstance(c, CodeType)]
        steps = [i for i in dis.get_instructions(code) if i.opname != "EXTENDED_ARG"]
        for at, step in enumerate(steps):
            name, after = step.argval, steps[at + 1 :]
            if step.opname in ("LOAD_GLOBAL", "LOAD_NAME") and name in space:
                # a name of the module, and at once behind it what is taken of it
                found |= _followed(name, space[name], takewhile(lambda i: i.opname in _PART_OF, after))
            elif step.opname == "IMPORT_NAME":
                # the number of dots before the name stands two instructions earlier
                module = _imported("." * int(steps[at - 2].argval) + name, space.get("__package__"))
                # ``from module import a, b`` takes parts one after the other; ``import module`` takes the whole
                taken = [i for i in takewhile(lambda i: i.opname != "POP_TOP", after) if i.opname == "IMPORT_FROM"]
                for part in taken or (None,):
                    found |= _followed(name, module, [part] if part is not None else ())
    return found


def _followed(name: str, value: Any, steps: Iterable[dis.Instruction]) -> dict[str, Any]:
    """What code reads in the end: a value, or the part of a module that it takes.

    Parts are followed through modules of one's own alone. The answer is the value by its name with dots.

    Parameters
    ----------
    name, value : what the code reads first
    steps : instructions that take a part of it, in order
    """
    for step in steps:
        if not isinstance(value, ModuleType) or _installed(value.__name__) or not hasattr(value, step.argval):
            break
        name, value = f"{name}.{step.argval}", getattr(value, step.argval)
    return {name: value}


def _imported(name: str, package: str | None) -> ModuleType | None:
    """The module that code imports by a name, which may be relative; None without one.

    Dots before the name make it relative to ``package``.
    """
    try:
        return import_module(name, package)
    except (ImportError, TypeError):  # code may import what is not there, or by dots outside a package
        return None


@cache
def _installed(module: str | None) -> bool:
    """Whether a module is installed, with Python or as a package: its name counts.

    This package is. A module that is not is one's own: its content counts.
    """
    top = (module or "").partition(".")[0]
    if top in ("limitmason", "dem", "mechanisms") or top in _PYTHON:
        return True
    file = getattr(sys.modules.get(top), "__file__", None) or ""
    return any(file.startswith(sysconfig.get_path(p)) for p in ("purelib", "platlib"))
