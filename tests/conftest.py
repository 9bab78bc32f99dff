import os
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
if (HOME / "pyproject.toml").exists():
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HOME), os.environ.get("PYTHONPATH", "")]))

SLOW = Path(__file__).with_name("slow.txt").read_text(encoding="utf-8").split("\n")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow what ``slow.txt`` names: files, tests or single cases, by their path below ``tests``."""
    slow = {line for line in SLOW if line}
    tests = Path(__file__).parent
    for item in items:
        file = item.path.relative_to(tests).as_posix() if item.path.is_relative_to(tests) else ""
        name = f"{file}::{item.name}"
        if slow & {file, name, name.partition("[")[0]}:
            item.add_marker(pytest.mark.slow)
