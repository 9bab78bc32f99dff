"""Threads, the package under test, what is slow, and the lanes that change what no answer may hang on."""

import os
import random
import runpy
import sys
import types
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import pytest

# one thread per process: the runs share two cores, and timings of figures and programs stay comparable
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# processes that a test starts take the package that is tested: the installed one, or the checkout where that is what
# was imported; never what lies in the folder in which they happen to start
os.environ["PYTHONSAFEPATH"] = "1"
HOME = Path(find_spec("limitmason").origin).parents[1]

# the trials above the package import each other from the root; on the path it would put the checkout under test
VALIDATION = types.ModuleType("validation")
VALIDATION.__path__ = [str(Path(__file__).parents[1] / "validation")]
sys.modules.setdefault("validation", VALIDATION)
if (HOME / "pyproject.toml").exists():
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HOME), os.environ.get("PYTHONPATH", "")]))

SLOW = Path(__file__).with_name("slow.txt").read_text(encoding="utf-8").split("\n")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Lanes: an answer hangs neither on the last digits of the blocks nor on the order of tests or of sums."""
    lanes = parser.getgroup("lanes")
    lanes.addoption("--jitter", type=int, default=0, help="seed: every block is moved by up to 1e-12 m along each axis")
    lanes.addoption("--shuffle", type=int, default=0, help="seed: modules, and tests within them, in random order")
    lanes.addoption("--strict-math", action="store_true", help="kernels add in the order in which they are written")


def pytest_configure(config: pytest.Config) -> None:
    """Put the lanes in force before any test module imports the package, here and in processes that tests start."""
    if getattr(config.option, "dist", "no") == "load":
        # a file is one worker's, which makes its module fixtures once; the longest files first, see below
        config.option.dist, config.option.loadscopereorder = "loadfile", False
    lanes = Path(__file__).with_name("lanes")
    if config.getoption("strict_math"):
        os.environ["LIMITMASON_STRICT_MATH"] = "1"
        # read by numba when it is imported
        os.environ["NUMBA_CACHE_DIR"] = str(config.cache.mkdir("strict-math"))
    if seed := config.getoption("jitter"):
        os.environ["LIMITMASON_JITTER"] = str(seed)
    if config.getoption("strict_math") or config.getoption("jitter"):
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(lanes), os.environ.get("PYTHONPATH", "")]))
        runpy.run_path(str(lanes / "sitecustomize.py"))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark as slow the single cases that ``slow.txt`` names by their path below ``tests``; put the lanes in force."""
    slow = {line for line in SLOW if line}
    tests = Path(__file__).parent
    for item in items:
        file = item.path.relative_to(tests).as_posix() if item.path.is_relative_to(tests) else ""
        name = f"{file}::{item.name}"
        if name in slow:
            item.add_marker(pytest.mark.slow)
    _leave_out_studies(config, items)
    long = Counter(item.path for item in items if item.get_closest_marker("slow"))
    items.sort(key=lambda item: -long[item.path])
    if config.getoption("jitter"):
        for item in items:
            if item.get_closest_marker("exact"):
                item.add_marker(pytest.mark.skip(reason="compares last digits"))
    if seed := config.getoption("shuffle"):
        order = random.Random(seed)
        files = sorted({item.path for item in items})
        order.shuffle(files)
        order.shuffle(items)
        items.sort(key=lambda item: files.index(item.path))  # module fixtures are made once all the same


def _leave_out_studies(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out slow tests of pages, blind trials and long examples, a lane, unless their folder or a file is named."""
    studies = Path(__file__).with_name("validation")
    named = [(config.invocation_params.dir / str(arg).split("::")[0]).resolve() for arg in config.args]
    if any(path.is_relative_to(studies) for path in named):
        return
    left = [item for item in items if item.path.is_relative_to(studies) and item.get_closest_marker("slow")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if item not in set(left)]
