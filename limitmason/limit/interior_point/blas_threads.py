"""One BLAS thread for a while: on small fronts a second one only waits, busily."""

import contextlib
import ctypes
import functools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy
import scipy

Control = tuple[Callable[[], int], Callable[[int], None]]
"""Getter and setter of a library's number of threads."""


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Context in which BLAS uses one thread; the number before is restored.

    Two threads made the factorisation of 3,000 to 10,000 blocks up to 2.5 times slower. Uses threadpoolctl where it is
    installed, otherwise the OpenBLAS that numpy and scipy bring with them. With any other BLAS nothing happens.
    """
    try:
        from threadpoolctl import threadpool_limits
    except ImportError:
        controls = _bundled_openblas()
    else:
        with threadpool_limits(limits=1, user_api="blas"):
            yield
        return
    before = [get() for get, _ in controls]
    try:
        for _, put in controls:
            put(1)
        yield
    finally:
        for (_, put), threads in zip(controls, before, strict=True):
            put(threads)


@functools.cache
def _bundled_openblas() -> tuple[Control, ...]:
    """Getter and setter of threads of every OpenBLAS in numpy's and scipy's wheels."""
    found = []
    for package in (numpy, scipy):
        folder = Path(str(package.__file__)).parent
        for library in (*folder.parent.glob(f"{folder.name}.libs/*openblas*"), *folder.glob(".dylibs/*openblas*")):
            try:
                handle = ctypes.CDLL(str(library))  # already loaded: this is a second name for it
            except OSError:  # built for another machine, or it lacks a library of its own
                continue
            for suffix in ("64_", ""):  # builds with 64-bit integers carry it in their names
                get = getattr(handle, f"scipy_openblas_get_num_threads{suffix}", None)
                put = getattr(handle, f"scipy_openblas_set_num_threads{suffix}", None)
                if get and put:
                    found.append((get, put))
                    break
    return tuple(found)
