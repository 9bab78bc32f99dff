"""The recipes of CONTRIBUTING.md: every code block runs as it stands, files under the names that they say."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
RECIPES = {
    title.split(": ")[1]: re.findall(r"```python\n(.*?)```", body, flags=re.DOTALL)
    for title, body in re.findall(r"^## (Recipe \d: [^\n]*)\n(.*?)(?=^## |\Z)", TEXT, flags=re.DOTALL | re.MULTILINE)
}


def test_there_are_four_recipes_each_with_a_file_and_a_script():
    assert list(RECIPES) == ["a term of the joint law", "a method", "an experiment", "a cause"]
    for blocks in RECIPES.values():
        assert [b.startswith("# file: ") for b in blocks] == [True, False]


@pytest.mark.slow
# that of a method compares last digits
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.exact) if n == "a method" else n for n in RECIPES]
)
def test_recipe_runs(name, tmp_path):
    file, script = RECIPES[name]
    (tmp_path / re.match(r"# file: (\w+\.py)\n", file)[1]).write_text(file, encoding="utf-8")
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True,
        text=True, check=False,
    )
    assert done.returncode == 0, done.stderr


def test_commands_that_it_names_exist():
    for module in re.findall(r"python -m ([\w.]+)", TEXT):
        if module not in ("venv", "sphinx", "build"):
            path = ROOT / Path(*module.split("."))
            assert path.with_suffix(".py").exists() or (path / "__main__.py").exists(), module
    for path in re.findall(r"`((?:tests|limitmason|dem|benchmarks|\.ci)/[\w./]*)`", TEXT):
        assert (ROOT / path).exists(), path
