"""What numba keeps of the kernels: one body per function, and a stamp that sees every edit.

That fresh and kept kernels give the same bits is in the lane of validation, which compiles them anew.
"""

import ast
import gc
import importlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from numba import njit
from numba.core.errors import TypingError
from numba.core.event import Listener, install_listener

import dem
import limitmason as lm
from dem import kernels
from dem.kernels import compiled
from dem.kernels.zone_motion import advance_zones
from dem.model.advance import run_constant
from dem.zones import running
from dem.zones.assemble_zones import make_model


@pytest.mark.parametrize(
    "name",
    [
        "joint_law.return_map", "joint_law.stress", "joint_strength.strength_of", "added_terms.with_added",
        "sums.point_sums", "deformed.strained_sums", "joint_forces._joint_forces", "zone_measure._zone_stresses",
    ],
)
def test_what_sums_over_contact_points_is_part_of_its_caller(name):
    # one body per compiled function: a second one under the same name is what differed
    file, function = name.split(".")
    assert getattr(importlib.import_module(f"dem.kernels.{file}"), function).targetoptions["forceinline"]


class Asked(Listener):
    """Whether Python searches for garbage, asked at the start and at the end of every compilation."""

    def __init__(self):
        self.searches = []

    def on_start(self, event):
        self.searches.append(gc.isenabled())

    on_end = on_start


def test_garbage_waits_for_the_compiler_and_is_collected_again_after_an_error():
    inner = njit(lambda x: 2.0 * x)
    asked = Asked()
    with install_listener("numba:compile", asked):
        assert njit(lambda x: inner(x) + 1.0)(1.0) == 3.0
        assert gc.isenabled()
        with pytest.raises(TypingError):
            njit(lambda x: x.nothing)(1.0)
    assert gc.isenabled()
    # two functions and one that fails: off at every start, on again where the outermost ends
    assert asked.searches == [False, False, False, True, False, True]
    gc.disable()
    try:
        njit(lambda x: 3.0 * x)(1.0)
        assert not gc.isenabled()
    finally:
        gc.enable()


# ---- what is kept on disk

# a copy of the package outside any other: what a tie turns a block by, and how many of its functions came from the
# disk. Of what reaches into another file it takes a third of the compiler's time that a contact point takes
MOMENT = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from copied.kernels import RigidBodies, Ties, add_tie_forces
def at(*x): return np.array([x], dtype=float)
ties = Ties(np.zeros(1, int), np.ones(1, int), at(0, 0, 0), at(0, 1, 0), at(1, 0, 0), np.ones(1), np.array([1e3]),
    np.array([1e9]), np.array([-1.0]))
two = np.zeros((2, 3))
bodies = RigidBodies(two, np.array([[1.0, 0, 0, 0]] * 2), np.zeros((2, 3, 3)), two, two, two, np.ones(2), np.ones(2),
    np.stack([np.eye(3)] * 2), np.zeros((2, 6), bool), np.zeros((2, 6)), np.zeros((2, 6)),
    np.stack([np.eye(3)] * 2))
add_tie_forces(ties, bodies, np.zeros(9))
print(bodies.contact[1, 5], sum(add_tie_forces.stats.cache_hits.values()))
"""


def copied(to: Path) -> Path:
    """A copy of dem/kernels as copied/kernels, with imports of its own name; the folder of its files."""
    folder = to / "copied" / "kernels"
    folder.mkdir(parents=True)
    for path in sorted(Path(kernels.__file__).parent.glob("*.py")):
        source = path.read_text(encoding="utf-8").replace("from dem.kernels", "from copied.kernels")
        (folder / path.name).write_text(source, encoding="utf-8")
    return folder


def moment(root: Path, cache: Path | None = None, script: str = MOMENT) -> tuple[float, int]:
    """Moment of a tie with an arm of 1 m in a fresh process, and how often its function was loaded from the disk."""
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment |= {} if cache is None else {"NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", script, str(root)], env=environment, capture_output=True, text=True, check=True
    )
    value, hits = done.stdout.split()
    return float(value), int(hits)


def test_no_function_escapes_the_stamp():
    folder = Path(kernels.__file__).parent
    for path in sorted(folder.glob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        made = [d for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for d in f.decorator_list]
        assert path.name == "compiled.py" or all(ast.unparse(d).startswith("kernel(") for d in made), path.name
        imported = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
        imported |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
        foreign = {m.split(".")[0] for m in imported if not m.startswith("dem.kernels")} - set(sys.stdlib_module_names)
        # the terms that are added to the joint law come from outside: their files are in the stamp
        assert foreign <= {"numpy", "numba", *(["limitmason"] if path.name == "compiled.py" else [])}, path.name
    # and no other file of the package compiles
    others = [p for p in folder.parent.rglob("*.py") if folder not in p.parents and "numba" in p.read_text("utf-8")]
    assert others == []
    index = kernels.advance._cache._cache_file
    assert index._source_stamp[1] == compiled.SOURCES == compiled.content(folder)


def test_no_kernel_is_compiled_twice_for_arrays_that_may_not_be_written_or_lie_otherwise():
    # weights of a Loads may not be written, those of a chunk of a history may; two blocks or more lay by columns
    brick = lm.Material(young_modulus=1e10, poisson_ratio=0.2, density=2000.0)
    wall = lm.build.column(width=0.2, depth=0.1, height=0.3, courses=3, joint=lm.Joint(40.0)).with_material(brick)
    loads = lm.Loads.weight(wall)
    state = dem.initial_state(wall, loads)
    for writeable in (True, False):
        wrench = loads.dead.copy()
        wrench.flags.writeable = writeable
        run_constant(state, wrench, 1, dem.Damping(local=0.8))
    running.advance(make_model(wall, loads, zone_size=0.1, stiff=[3]), 1)
    for kernel in (kernels.advance, advance_zones):
        text = [str(signature) for signature in kernel.signatures]
        assert text
        assert not any("readonly" in t or ", F)" in t for t in text)


@pytest.mark.slow
def test_processes_that_start_together_share_what_is_kept_and_an_edit_of_an_imported_file_is_seen(tmp_path):
    folder, cache = copied(tmp_path), tmp_path / "cache"
    before = {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in folder.glob("*.py")}
    folder.chmod(0o555)  # a read-only installation
    try:
        with ThreadPoolExecutor(2) as pool:
            together = list(pool.map(moment, [tmp_path] * 2, [cache] * 2))
        assert [value for value, _ in together] == [pytest.approx(1e3)] * 2
        assert moment(tmp_path, cache) == (pytest.approx(1e3), 1)
    finally:
        folder.chmod(0o755)
    assert {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in folder.glob("*.py")} == before
    # an edit of the same length and with the time stamp of before: neither time nor size tells
    imported = folder / "kinematics.py"
    stamp, source = imported.stat(), imported.read_text(encoding="utf-8")
    assert source.count(", u[0] * v[1] - u[1] * v[0]\n") == 1
    edited = source.replace(" - u[1] * v[0]\n", " - 2*u[1]*v[0]\n")
    imported.write_text(edited, encoding="utf-8")
    os.utime(imported, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert imported.stat().st_size == stamp.st_size
    for cached in imported.parent.glob("__pycache__/kinematics.*.pyc"):
        cached.unlink()  # Python's own cache asks for time and size
    assert moment(tmp_path, cache) == (pytest.approx(2e3), 0)
    # and a class whose name stands in what was kept may go
    for path in folder.glob("*.py"):
        path.write_text(path.read_text(encoding="utf-8").replace("Ties", "Cords"), encoding="utf-8")
    assert moment(tmp_path, cache, MOMENT.replace("Ties", "Cords")) == (pytest.approx(2e3), 0)
