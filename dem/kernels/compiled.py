"""How the functions of this package are compiled and kept on disk.

An edit of any file makes all be compiled again.

numba keeps a compiled function beside the file that defines it and asks that file alone whether it is stale, by its
time and size up to 0.67 and by its content from 0.68 on. A caller carries the code of what it calls, so an edited
callee would go on running in its callers. Here every kept function is stamped with the content of all sources of the
package instead; no file is touched, so that a read-only installation and processes that start together are no matter.
"""

import gc
import hashlib
import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.cpu import CPUTargetOptions
from numba.core.event import Event, Listener, register
from numba.core.registry import CPUDispatcher

from limitmason.model.joint_term import added_terms

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be reordered and multiply-adds fused; NaN and infinity keep their meaning."""


COUNTS = hasattr(CPUTargetOptions, "_nrt")
"""Whether numba lets a function that makes no arrays leave out counting who holds those it is given."""


ADDED = added_terms()
"""Terms added to the joint law: compiled in, and with the content of their files part of the stamp."""


def content(folder: Path, others: Iterable[Path] = ()) -> str:
    """Digest of all Python files of a folder and of others, by name and content."""
    digest = hashlib.sha256()
    for path in (*sorted(folder.glob("*.py")), *others):
        digest.update(path.name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


SOURCES = content(Path(__file__).parent, [Path(inspect.getfile(term)) for term in ADDED.values()])


def _kept_or_none(load: Callable[[], dict[Any, Any]]) -> Callable[[], dict[Any, Any]]:
    """Reader of numba's cache: nothing, where a class of the arguments is no more.

    Parameters
    ----------
    load : numba's reader of the compiled versions of a function that are on disk
    """

    def kept() -> dict[Any, Any]:
        """What is on disk, or nothing."""
        try:
            return load()
        except (AttributeError, ImportError):
            # numba reads the types of the arguments before it looks at the stamp
            return {}

    return kept


class _Collecting(Listener):
    """Keeps Python's search for garbage waiting while functions are compiled.

    It took a seventh of that time and found little.

    The compiler makes millions of small objects that it still needs, and each search looks through all of them.
    """

    def __init__(self) -> None:
        self.depth, self.was = 0, False

    def on_start(self, event: Event) -> None:
        """Stop it where the outermost function begins; one thread compiles at a time."""
        if self.depth == 0:
            self.was = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """Let it go on as it was."""
        self.depth -= 1
        if self.depth == 0 and self.was:
            gc.enable()


register("numba:compile", _Collecting())


class _Part(CPUDispatcher):
    """A function that only compiled ones call, without a way in for Python.

    A way in costs as much as a short function.
    """

    def __call__(self, *arguments: Any) -> Any:
        """Call it through a way in that is compiled on the first call: for tests."""
        if not hasattr(self, "door"):
            part = self
            self.door = njit(error_model="numpy")(lambda *given: part(*given))
        return self.door(*arguments)


def kernel(
    *, fast: bool = True, counted: bool = False, kept: bool = True, **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function of this package on its first call, and keep it on disk.

    It is kept until any file of the package changes.

    Parameters
    ----------
    fast : let sums be reordered; not where a sign decides which way a search goes
    counted : count references to arrays: needed where one is made, or handed back. Every count is an atomic addition,
        and where one function hands a dozen arrays to the next, per joint, they took two thirds of a modal step
    kept : on disk; not what is part of its callers and has no file of this package
    options : of ``numba.njit``: ``forceinline`` for what must be part of its caller, so that the same bits come out of
        a process that compiles and of one that loads; ``inline="always"`` for what returns many numbers in registers,
        and for a part of a long function: compiled by itself, its sums would be reordered without those around it, and
        brittle runs end elsewhere

    Notes
    -----
    numba has no public way to say what a stamp depends on. Where its cache is built otherwise than here assumed,
    nothing is kept on disk: every process then compiles for itself, which is slow and right.
    """
    if COUNTS:
        options["_nrt"] = counted

    options["no_cfunc_wrapper"] = True

    def compiled(function: Callable[..., Any]) -> Any:
        """The function compiled by numba, its cache stamped with all kernel sources."""
        # what only compiled functions call, by its options or its name, needs no way in for Python
        inner = "forceinline" in options or function.__name__.startswith("_")
        part = inner and "inline" not in options  # such a function is never compiled by itself, unless Python calls it
        options["no_cpython_wrapper"] = part
        math = FASTMATH if fast else False
        dispatcher = njit(cache=kept, error_model="numpy", nogil=True, fastmath=math, **options)(function)
        if part and isinstance(dispatcher, CPUDispatcher):
            dispatcher.__class__ = _Part
        cache = getattr(dispatcher, "_cache", None)  # none where NUMBA_DISABLE_JIT leaves the function as it is
        index = getattr(cache, "_cache_file", None)
        if index is not None and hasattr(index, "_source_stamp") and hasattr(index, "_load_index"):
            # numba loads a compiled function only where this stamp is the one it was written with
            index._source_stamp = (index._source_stamp, SOURCES)
            index._load_index = _kept_or_none(index._load_index)
        elif cache is not None and kept:
            cache.disable()  # a cache that cannot be stamped could be stale
        return dispatcher

    return compiled
