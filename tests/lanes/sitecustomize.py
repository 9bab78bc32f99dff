"""The lanes of ``conftest.py`` in this process and in every one that it starts.

Python runs a module of this name at its start. ``LIMITMASON_JITTER`` holds a seed, ``LIMITMASON_STRICT_MATH`` anything.
"""

import os
import sys
import zlib
from importlib.machinery import PathFinder


class _Changed:
    """Finds one module, and changes it once it is loaded."""

    def __init__(self, name, change):
        self.name, self.change = name, change

    def find_spec(self, name, path=None, target=None):
        if name != self.name or (spec := PathFinder.find_spec(name, path)) is None:
            return None
        load = spec.loader.exec_module

        def changed(module):
            load(module)
            self.change(module)

        spec.loader.exec_module = changed
        return spec


def _move_blocks(module):
    """Every block that is built, not read from a file, is moved by up to 1e-12 m along each axis."""
    import numpy as np

    read, seed = module.read_pieces, os.environ["LIMITMASON_JITTER"]

    def moved(solid, name):
        pieces, frame = read(solid, name), sys._getframe(1)
        while frame is not None:
            if frame.f_globals.get("__name__", "").startswith("limitmason.formats."):
                return pieces  # what was written is read back as it is
            frame = frame.f_back
        # by its name: the same model made twice, in another order or in another process is the same
        text = f"{seed} {name}".encode(errors="backslashreplace")
        move = 1e-12 * np.random.default_rng(zlib.crc32(text)).uniform(-1.0, 1.0, 3)
        pieces = tuple(p._replace(vertices=p.vertices + move) for p in pieces)
        for piece in pieces:
            piece.vertices.setflags(write=False)
        return pieces

    module.read_pieces = moved


def _compile_in_order(module):
    """Kernels add in the order in which they are written."""
    compile_as_asked = module.njit

    def in_order(*functions, **options):
        return compile_as_asked(*functions, **{**options, "fastmath": False})

    module.njit = in_order


if os.environ.get("LIMITMASON_JITTER"):
    sys.meta_path.insert(0, _Changed("limitmason.model.input", _move_blocks))
if os.environ.get("LIMITMASON_STRICT_MATH"):
    sys.meta_path.insert(0, _Changed("numba", _compile_in_order))
